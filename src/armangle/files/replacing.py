"""Files written completely or not at all: first to a temporary file, then renamed."""

from __future__ import annotations

import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from .._arrays import PathLike
from ..errors import OutputError

_WRITABLE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH


@contextmanager
def replacing(path: PathLike) -> Iterator[BinaryIO]:
    """Open a file beside `path` for writing; it replaces `path` when the block succeeds.

    If the block fails, or the process is killed in it, the old file is unchanged. Raises `OutputError` with
    `path`, if it cannot be written: no such folder, no permission, no space; a read-only file; or no regular
    file: a folder, a pipe, a device.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replacing(f"{folder}/a.txt") as file:
    ...         _ = file.write(b"whole")
    ...     Path(folder, "a.txt").read_text()
    'whole'
    """
    target = _target(path)
    beside = target.with_name(f".{target.name}.{secrets.token_hex(8)}.part")
    try:
        _check_replaceable(path)
        with beside.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            shutil.copymode(target, beside)
        beside.replace(target)
    except BaseException as error:
        with suppress(OSError):
            beside.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, OutputError):
            raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
        raise


def _target(path: PathLike) -> Path:
    """Return the file that a path leads to through links."""
    try:
        return Path(os.path.realpath(path))
    except ValueError as error:  # a name that no file can have
        raise OutputError(f"{str(path)!r}: cannot be written: {error}") from None


def _check_replaceable(path: PathLike) -> None:
    """Raise if the target is a folder, a device, or a file that may not be written."""
    try:
        mode = os.stat(path).st_mode  # noqa: PTH116 - follows links, /proc's too
    except FileNotFoundError:
        return
    if stat.S_ISDIR(mode):
        raise OutputError(f"{path}: cannot be written: it is a folder")
    if not stat.S_ISREG(mode):
        raise OutputError(f"{path}: cannot be written: it is a pipe or a device, wanted a regular file")
    if not (mode & _WRITABLE and os.access(path, os.W_OK)):
        raise OutputError(f"{path}: cannot be written: it is read-only")
