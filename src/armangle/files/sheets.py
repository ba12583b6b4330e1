"""Sheets: named columns of equal length, and their form in CSV, NPZ and JSON.

A value is saved as a sheet, and each file format writes any sheet. NaN is ``nan`` in CSV and ``null`` in
JSON, infinities are ``inf`` and ``"inf"``. :mod:`armangle.files.archive_blocks` reads them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .._arrays import PathLike
from ..errors import InputError

_ROWS_AT_ONCE = 4096


@dataclass(frozen=True, eq=False)
class Sheet:
    """Columns to save.

    `kind` of value, such as "joints", a word in NPZ and JSON files; `blocks` by name, (N,) or (N, k) numbers
    or words, in the order of the file; `headings`, the k CSV headings of each block with more than one
    column; `joint_names` of a trajectory, for YAML.
    """

    kind: str
    blocks: Mapping[str, NDArray[Any]]
    headings: Mapping[str, tuple[str, ...]]
    joint_names: tuple[str, ...] = ()


def ending(path: PathLike) -> str:
    """Return the ending of a file to write: .csv, .npz, .json or .yaml; raise `InputError` for any other."""
    found = Path(path).suffix.lower()
    if found not in WRITERS:
        raise InputError(f"{path}: ending {found!r} is not known, wanted one of {', '.join(WRITERS)}")
    return found


def plain(array: NDArray[Any]) -> Any:
    """Return an array as lists for JSON: null for NaN, "inf" and "-inf" for infinities.

    >>> plain(np.array([1.0, np.nan, -np.inf]))
    [1.0, None, '-inf']
    """
    values = np.asarray(array)
    if values.dtype.kind != "f" or np.isfinite(values).all():
        return values.tolist()
    mixed = values.astype(object)
    mixed[np.isnan(values)] = None
    mixed[values == np.inf] = "inf"
    mixed[values == -np.inf] = "-inf"
    return mixed.tolist()


def _write_csv(sheet: Sheet, file: BinaryIO) -> None:
    """Write a sheet as CSV with a header."""
    names = [name for block in sheet.blocks for name in sheet.headings.get(block, (block,))]
    file.write((",".join(names) + "\n").encode())
    columns = [column for array in sheet.blocks.values() for column in np.atleast_2d(array.T)]
    for first in range(0, len(columns[0]), _ROWS_AT_ONCE):
        cells = [column[first : first + _ROWS_AT_ONCE].tolist() for column in columns]
        texts = (cell if isinstance(cell[0], str) else map(repr, cell) for cell in cells)
        file.write("".join(",".join(row) + "\n" for row in zip(*texts, strict=True)).encode())


def _write_npz(sheet: Sheet, file: BinaryIO) -> None:
    """Write a sheet as NPZ, an array for each block."""
    arrays: dict[str, Any] = {"kind": np.array(sheet.kind), **sheet.blocks}
    np.savez_compressed(file, **arrays)


def _write_json(sheet: Sheet, file: BinaryIO) -> None:
    """Write a sheet as JSON, a list for each block."""
    table = {"kind": sheet.kind} | {name: plain(array) for name, array in sheet.blocks.items()}
    file.write(json.dumps(table, allow_nan=False).encode() + b"\n")


def _write_yaml(sheet: Sheet, file: BinaryIO) -> None:
    """Write a trajectory as a ROS message JointTrajectory in YAML; raise for any other sheet."""
    if not sheet.joint_names:
        if sheet.kind == "trajectory":
            raise InputError("a trajectory without joint names cannot be saved as .yaml")
        raise InputError(f"{sheet.kind} cannot be saved as .yaml, which is for trajectories")
    write_joint_trajectory(sheet.joint_names, sheet.blocks, file)


WRITERS = {".csv": _write_csv, ".npz": _write_npz, ".json": _write_json, ".yaml": _write_yaml}


_NANOSECONDS = 1_000_000_000
_FIELDS = {"positions": "q", "velocities": "qd", "accelerations": "qdd"}


def write_joint_trajectory(
    names: tuple[str, ...], blocks: Mapping[str, NDArray[Any]], file: BinaryIO, frame: str = ""
) -> None:
    """Write joint names and the blocks t (N,), q, qd, qdd (N, 7) as a YAML message with frame_id `frame`.

    Words are quoted as JSON strings and lists are flow lists, which YAML accepts too.
    """
    head = ["header:", "  stamp: {sec: 0, nanosec: 0}", f"  frame_id: {json.dumps(frame)}"]
    head += [f"joint_names: {json.dumps(list(names))}", "points:"]
    file.write(("\n".join(head) + "\n").encode())
    columns = [np.asarray(blocks[name]).tolist() for name in _FIELDS.values()]
    for t, *rows in zip(np.asarray(blocks["t"]).tolist(), *columns, strict=True):
        seconds, rest = divmod(round(t * _NANOSECONDS), _NANOSECONDS)
        lines = [f"{field}: {json.dumps(row)}" for field, row in zip(_FIELDS, rows, strict=True)]
        lines += ["effort: []", f"time_from_start: {{sec: {seconds}, nanosec: {rest}}}"]
        file.write(("- " + "\n  ".join(lines) + "\n").encode())
