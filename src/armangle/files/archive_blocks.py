"""Blocks of NPZ and JSON files: named arrays from files with arbitrary contents.

For any bytes the result is arrays or a ModelError, and the memory used stays within the possible contents of
a file of that length.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from .. import _opening
from .._arrays import Floats, PathLike
from ..errors import ModelError

_NUMBERS = "fiu"
_WORDS = "U"
_MEMBER = ".npy"
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_MOST_PER_BYTE = 1032  # deflate: 258 bytes for 2 bits
_SPECIAL = {None: np.nan, "inf": np.inf, "-inf": -np.inf}


def refuse(path: PathLike, message: str, line: int | None = None) -> NoReturn:
    """Raise the ModelError of a file, with its path and line."""
    raise ModelError(message, source=str(path), line=line)


def read_blocks(path: PathLike) -> dict[str, NDArray[Any]]:
    """Return the blocks of an NPZ file, or for any ending but .npz of a JSON file, unchecked.

    Raises `ModelError` if the file does not exist, or is not of its kind.
    """
    return _read_npz(path) if Path(path).suffix.lower() == ".npz" else _read_json(path)


def number_block(blocks: Mapping[str, NDArray[Any]], path: PathLike, name: str, width: int) -> Floats:
    """Return a block as float64 (N, width), or (N,) for width 0.

    Raises `ModelError` if it is missing, holds anything but real numbers, or has another shape.
    """
    if name not in blocks:
        refuse(path, f"missing {name!r}; the file has {', '.join(map(repr, blocks)) or 'nothing'}")
    wanted = f"wanted numbers of shape {f'(N, {width})' if width else '(N,)'}"
    block = blocks[name]
    if block.dtype.kind not in _NUMBERS:  # complex numbers, times and words would be cast silently
        refuse(path, f"{name} is not an array of numbers but of {block.dtype}, {wanted}")
    array = block.astype(np.float64)
    if width and array.size == 0:
        array = array.reshape(0, width)
    if array.ndim != (2 if width else 1) or (width and array.shape[1] != width):
        refuse(path, f"{name} has shape {array.shape}, {wanted}")
    return array


def word_block(blocks: Mapping[str, NDArray[Any]], path: PathLike, name: str) -> list[str]:
    """Return a block of words, which must be in `blocks`; raise `ModelError` if it holds anything else."""
    block = blocks[name]
    if block.ndim != 1 or (block.size and block.dtype.kind != _WORDS):
        refuse(path, f"{name} is not a row of words but of {block.dtype}, shape {block.shape}")
    try:
        return [str(word) for word in block]
    except (ValueError, SystemError) as error:  # numbers that are not characters: numpy leaves them to Python
        refuse(path, f"{name} is not a row of words: {error}")


def _read_npz(path: PathLike) -> dict[str, NDArray[Any]]:
    """Return the arrays of an NPZ file by name; raise if it is not one."""
    with _opening.open_file(path, _opening.NUMBERS, partial(refuse, path)) as file:
        try:
            return members_of(file)
        except Exception as error:  # invalid data makes zipfile, zlib and numpy raise almost anything
            refuse(path, f"not NPZ: {error or type(error).__name__}")


def members_of(file: BinaryIO) -> dict[str, NDArray[Any]]:
    """Return the arrays of an NPZ archive by name; raise if it would unpack to too many bytes.

    Invalid data makes zipfile, zlib and numpy raise almost anything.
    """
    blocks = {}
    with zipfile.ZipFile(file) as archive:
        members = [member for member in archive.infolist() if member.filename.endswith(_MEMBER)]
        if sum(member.file_size for member in members) > _opening.NUMBERS:
            raise ValueError(f"it unpacks to more than {_opening.NUMBERS // _opening.MIB} MiB")
        if sum(member.compress_size for member in members) > file.seek(0, io.SEEK_END):
            raise ValueError("its members are longer than the file")
        for member in members:
            most = _MOST_PER_BYTE * member.compress_size
            if member.compress_type not in _METHODS or member.file_size > most:
                raise ValueError(f"{member.filename} is not packed as NPZ is")
            blocks[member.filename.removesuffix(_MEMBER)] = array_of(archive.read(member), member.filename)
    return blocks


def array_of(data: bytes, name: str) -> NDArray[Any]:
    """Return the array that the bytes of an .npy file hold; raise if its header claims more
    than they hold.
    """
    head = io.BytesIO(data)
    version = npy.read_magic(head)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"{name} has version {version}, wanted (1, 0) or (2, 0)")
    read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, fortran_order, dtype = read_header(head)
    if dtype.hasobject:
        raise ValueError(f"{name} holds Python objects, wanted numbers or words")
    return np.ndarray(shape, dtype, buffer=data, offset=head.tell(), order="F" if fortran_order else "C")


def _read_json(path: PathLike) -> dict[str, NDArray[Any]]:
    """Return the lists of a JSON file as arrays by name; raise if it is no table."""
    text = _opening.text_of(path, _opening.TEXT, partial(refuse, path))
    try:
        table = json.loads(text)
    except json.JSONDecodeError as error:
        raise ModelError(
            f"not JSON: {error.msg}", source=str(path), line=error.lineno, column=error.colno
        ) from None
    except RecursionError:
        refuse(path, "nested too deeply, wanted an object of named columns")
    except ValueError:  # more digits than Python reads
        refuse(path, "holds a whole number that is too long")
    if not isinstance(table, dict):
        refuse(path, f"holds a {type(table).__name__}, wanted an object of named columns")
    return {str(name): _column(value, path, str(name)) for name, value in table.items()}


def _column(value: Any, path: PathLike, name: str) -> NDArray[Any]:
    """Return a JSON list as an array of numbers (null is NaN) or words; of objects for anything else."""
    try:
        array = np.array(value, dtype=object)
    except (ValueError, RecursionError):
        refuse(path, f"{name} is nested too deeply")
    cells = array.ravel().tolist()
    kinds = set(map(type, cells))
    if list in kinds:
        refuse(path, f"holds a column whose rows are not of one length: {name}")
    if kinds == {str} and not _SPECIAL.keys() >= set(cells):
        return array.astype(str)
    if kinds & {str, type(None)}:
        cells = [_SPECIAL.get(c, c) if c is None or isinstance(c, str) else c for c in cells]
    if not set(map(type, cells)) <= {float, int}:
        return array
    try:
        return np.array(cells, dtype=np.float64).reshape(array.shape)
    except OverflowError:
        refuse(path, f"{name} holds a whole number that is too large")
