"""Clouds of points from NPZ, NPY, CSV, PLY and PCD files."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from .. import _opening
from .._arrays import Floats, PathLike
from ..errors import SceneError
from ..scenes.shapes import Cloud
from .archive_blocks import array_of, members_of

_AXES = ("x", "y", "z")
_PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
_ENDINGS = (".npz", ".npy", ".csv", ".ply", ".pcd")


def load_cloud(path: PathLike, radius: float, *, name: str | None = None) -> Cloud:
    """Return the cloud of a file without non-finite points, which cameras write for missing depth.

    Parameters
    ----------
    path : path
        ``.npy`` or ``.npz`` (``points``, or the only array) of shape (N, 3); ``.csv`` with the columns
        x, y, z, with or without a line of names; ``.ply`` and ``.pcd``, as text or binary, not compressed. m.
    radius : float
        m, of each point.
    name : str, optional

    Returns
    -------
    Cloud

    Raises
    ------
    SceneError
        If the file cannot be read, has no such columns, or no finite points.

    Examples
    --------
    >>> import armangle as aa, numpy as np
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> file = Path(mkdtemp()) / "seen.npz"
    >>> np.savez(file, points=np.ones((20, 3)))
    >>> aa.io.load_cloud(file, 0.01)
    Cloud(<20 points>, radius=0.01, name=None)
    """
    kind = Path(path).suffix.lower()
    if kind not in _ENDINGS:
        _fail(path, f"a file ending in {', '.join(_ENDINGS)}")
    most = _opening.TEXT if kind == ".csv" else _opening.NUMBERS
    data = _opening.bytes_of(path, most, lambda why: _fail(path, f"a file that can be read ({why})"))
    try:
        points = {".npz": _npz, ".npy": _npy, ".csv": _csv, ".ply": _ply, ".pcd": _pcd}[kind](data)
    except SceneError:
        raise
    except Exception as error:  # broken files raise many kinds of errors
        _fail(path, f"points x, y, z ({error or type(error).__name__})")
    if points.ndim != 2 or points.shape[1] != len(_AXES) or points.dtype.kind not in "fiu":
        _fail(path, f"points of shape (N, 3), not {points.shape} of {points.dtype}")
    finite = points[np.isfinite(points).all(axis=1)]
    if not len(finite):
        _fail(path, "points, of which some are finite")
    return Cloud(finite, radius, name=name)


def _fail(path: PathLike, wanted: str) -> NoReturn:
    """Raise the error of a file that holds no points."""
    raise SceneError("Cloud", "path", str(path), wanted)


def _npy(data: bytes) -> Floats:
    """Return the array in the bytes of an NPY file; ValueError if they are none."""
    if not data.startswith(b"\x93NUMPY"):
        raise ValueError("it has no header of NPY")
    return array_of(data, "it")


def _npz(data: bytes) -> Floats:
    """Return the array `points`, or the only one, in the bytes of an NPZ file; ValueError without it."""
    if not zipfile.is_zipfile(io.BytesIO(data)):
        raise ValueError("it is no NPZ: not a zip archive")
    arrays = members_of(io.BytesIO(data))
    if "points" not in arrays and len(arrays) != 1:
        raise ValueError(f"it holds {', '.join(arrays) or 'nothing'}, wanted points")
    return arrays["points"] if "points" in arrays else next(iter(arrays.values()))


def _csv(data: bytes) -> Floats:
    """Return the points of the bytes of a CSV file: columns x, y, z by name, or the only three."""
    text = data.decode("utf-8-sig")
    first = text.split("\n", 1)[0].strip()
    names = [word.strip().lower() for word in first.split(",")]
    named = set(_AXES) <= set(names)
    if not any(line.partition("#")[0].strip() for line in text.splitlines()[named:]):
        raise ValueError("it has no rows")
    columns = [names.index(axis) for axis in _AXES] if named else None
    return np.loadtxt(io.StringIO(text), delimiter=",", skiprows=int(named), usecols=columns, ndmin=2)


def _ply(data: bytes) -> Floats:
    """Return the points (n, 3) in the bytes of a PLY file.

    Source: Turk, The PLY Polygon File Format (1994).
    """
    head, mark, body = data.partition(b"end_header")
    if not mark or not head.startswith(b"ply"):
        raise ValueError("it has no header of PLY")
    body = body.split(b"\n", 1)[1]
    form, elements = "", list[tuple[str, int, list[tuple[str, str]]]]()
    for words in (line.split() for line in head.decode("ascii").splitlines()):
        if words[:1] == ["format"]:
            form = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            if words[1] == "list" and elements[-1][0] == "vertex":
                raise ValueError("a list in its vertices")
            if words[1] != "list":
                elements[-1][2].append((words[2], _PLY_TYPES[words[1]]))
    if not elements or elements[0][0] != "vertex":
        raise ValueError("its first element is not vertex")
    _, count, fields = elements[0]
    if form == "ascii":
        return _columns_of_text(body, count, [name for name, _ in fields])
    order = {"binary_little_endian": "<", "binary_big_endian": ">"}[form]
    return _columns_of_bytes(body, count, [(name, order + kind) for name, kind in fields])


def _pcd(data: bytes) -> Floats:
    """Return the points (n, 3) in the bytes of a PCD file.

    Source: the PCD file format of the Point Cloud Library, version 0.7.
    """
    head, mark, body = data.partition(b"\nDATA ")
    if not mark:
        raise ValueError("it has no header of PCD")
    form, body = body.split(b"\n", 1)
    table = {words[0]: words[1:] for words in map(str.split, head.decode("ascii").splitlines()) if words}
    count, names = int(table["POINTS"][0]), table["FIELDS"]
    repeats = [int(word) for word in table.get("COUNT", ["1"] * len(names))]
    if form.strip() == b"ascii":
        spread = [name for name, times in zip(names, repeats, strict=True) for _ in range(times)]
        return _columns_of_text(body, count, spread)
    if form.strip() != b"binary":
        raise ValueError(f"DATA {form.strip().decode()} is not read, only ascii and binary")
    kinds = [f"<{kind.lower()}{size}" for kind, size in zip(table["TYPE"], table["SIZE"], strict=True)]
    fields: list[Any] = []
    for at, (name, kind, times) in enumerate(zip(names, kinds, repeats, strict=True)):
        label = name if name in _AXES else f"{name}_{at}"  # PCD pads with fields that are all called _
        fields.append((label, kind) if times == 1 else (label, kind, (times,)))
    return _columns_of_bytes(body, count, fields)


def _columns_of_text(body: bytes, count: int, names: list[str]) -> Floats:
    """Return x, y and z (count, 3) of the first rows of a text; `names` are its columns."""
    if len(body) > _opening.TEXT:
        raise ValueError(f"more than {_opening.TEXT // _opening.MIB} MiB of text; write it as binary")
    columns = [names.index(axis) for axis in _AXES]
    points = np.loadtxt(io.BytesIO(body), usecols=columns, max_rows=count, ndmin=2)
    if len(points) != count:
        raise ValueError(f"{len(points)} points, and {count} in its header")
    return points


def _columns_of_bytes(body: bytes, count: int, fields: list[Any]) -> Floats:
    """Return x, y and z (n, 3) of `count` binary rows; `fields` are its columns and their types."""
    table = np.frombuffer(body, dtype=np.dtype(fields), count=count)
    return np.column_stack([table[axis].astype(np.float64) for axis in _AXES])
