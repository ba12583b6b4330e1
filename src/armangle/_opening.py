"""The one way to open files for reading: regular files alone, up to a size limit."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

MIB = 2**20
DESCRIPTION = 32 * MIB
"""Largest size of a robot in XML, and of a planning scene, bytes."""
TABLES = 2 * MIB
"""Largest size of TOML, bytes: Python reads this in about a second."""
TEXT = 64 * MIB
"""Largest size of a text of numbers that is read as a whole, bytes."""
NUMBERS = 1024 * MIB
"""Largest size of binary numbers, of meshes, and of text that is read in blocks, bytes."""

_KEY_PARTS = 16  # of a dotted key: valid files have at most two; tomllib needs their square in memory

_KINDS = {
    stat.S_ISDIR: "a folder",
    stat.S_ISFIFO: "a pipe",
    stat.S_ISSOCK: "a socket",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
}
_WORDS = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"""|\Z)'
    r"|'''.*?(?:'''|\Z)"
    r'|"(?:\\.|[^"\\\n])*"?'
    r"|'[^'\n]*'?"
    r"|(#[^\n]*)",
    re.DOTALL,
)
"""Strings and comments of TOML; the pattern visits no character twice."""
_DOTTED = re.compile(rf"(?:[\w-]*[ \t]*\.[ \t]*){{{_KEY_PARTS}}}")

PathLike = str | os.PathLike[str]
Fail = Callable[[str], NoReturn]


def open_file(path: PathLike, most: int, fail: Fail) -> BinaryIO:
    """Return a regular file of at most `most` bytes, opened for reading; else `fail` receives the reason.

    Devices, pipes and sockets are rejected unread: they may be endless, or never answer. So is a number,
    which Python would treat as an open file.
    """
    if not isinstance(path, (str, bytes, os.PathLike)):
        fail(f"is {path!r:.50}, wanted the path of a file")
    try:
        file = open(path, "rb", opener=_open)  # noqa: SIM115 - with an opener; who asks closes it
    except FileNotFoundError:
        fail("no such file")
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        fail(f"cannot be read: {getattr(error, 'strerror', None) or error}")
    size = os.fstat(file.fileno()).st_size
    if size > most:
        file.close()
        fail(too_long(size, most))
    return file


def check_file(path: PathLike, most: int, fail: Fail) -> None:
    """Call `fail` if a library that opens a file by itself would not find what `open_file` opens."""
    open_file(path, most, fail).close()


def bytes_of(path: PathLike, most: int, fail: Fail) -> bytes:
    """Return the contents of a file, which may grow while it is read; errors as for `open_file`."""
    with open_file(path, most, fail) as file:
        try:
            data = file.read(most + 1) or b""
        except OSError as error:
            fail(f"cannot be read: {error.strerror}")
    if len(data) > most:
        fail(too_long(len(data), most))
    return data


def text_of(path: PathLike, most: int, fail: Fail) -> str:
    """Return the text of a file in UTF-8; errors as for `open_file`."""
    try:
        return bytes_of(path, most, fail).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        fail(f"not UTF-8 text: {error.reason}")


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raises `ValueError` if the text is not TOML (tomllib.TOMLDecodeError), or nested more deeply than valid
    files.
    """
    if _DOTTED.search(_WORDS.sub(lambda found: "" if found[1] else "_", text)):
        raise ValueError(f"holds a dotted key of more than {_KEY_PARTS} parts")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise ValueError("nested too deeply, wanted plain keys") from None
    except ValueError:  # more digits than Python reads
        raise ValueError("holds a whole number that is too long") from None


def _open(path: str, flags: int) -> int:
    """Open a regular file; raise for a device or pipe."""
    mode = Path(path).stat().st_mode
    for is_kind, what in _KINDS.items():
        if is_kind(mode):
            raise OSError(0, f"{what}, wanted a file")
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def too_long(size: int, most: int) -> str:
    """Return the error text for a size above the bound, both in bytes."""
    unit, name = (MIB, "MiB") if most >= MIB else (1, "bytes")
    return f"{-(-size // unit)} {name}, wanted at most {most // unit} {name}"
