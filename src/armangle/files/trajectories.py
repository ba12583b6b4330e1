"""Saved trajectories: times, joint values, velocities and accelerations."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import _opening
from .._arrays import JOINTS, Floats, PathLike
from .._values import by_content, freeze
from ..errors import ModelError
from .archive_blocks import number_block, read_blocks, refuse
from .csv_blocks import CsvFile, RowLines, open_text

RATES = {name: tuple(f"{name}{i}" for i in range(1, JOINTS + 1)) for name in ("q", "qd", "qdd")}
_NUMBERS = ("t", *(name for names in RATES.values() for name in names))
_MESSAGE = {"positions": "q", "velocities": "qd", "accelerations": "qdd"}
_TIME = re.compile(r"\{sec: (\d{1,18}), nanosec: (\d{1,9})\}")
_NANO = 1e-9


@by_content
@dataclass(frozen=True, eq=False, repr=False)
class TrajectoryTable:
    """A trajectory file: rows in time; arrays are read-only.

    Not to be confused with `Trajectory`, which also has its path, and so every time between the rows.

    Parameters
    ----------
    t : ndarray, shape (N,)
        Times, s, rising.
    s : ndarray, shape (N,)
        Path parameter as in the file; NaN if it has none, as in YAML.
    q, qd, qdd : ndarray, shape (N, 7)
        Joint values, velocities and accelerations: rad, rad/s, rad/s².
    joint_names : tuple of str
        Names of the joints; empty if the file has none, as all but YAML.
    """

    t: Floats
    s: Floats
    q: Floats
    qd: Floats
    qdd: Floats
    joint_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "t", "s", "q", "qd", "qdd")

    def __len__(self) -> int:
        return len(self.t)

    @property
    def duration(self) -> float:
        """Time from the first row to the last, s; 0 without rows."""
        return float(self.t[-1] - self.t[0]) if len(self.t) else 0.0

    def __repr__(self) -> str:
        return f"<TrajectoryTable of {self.duration:.6g} s, {len(self)} rows>"


def load_trajectory(path: PathLike) -> TrajectoryTable:
    """Return the rows of a trajectory file, as `save` writes it.

    Parameters
    ----------
    path : path
        CSV with the columns t (s), q1..q7 (rad), qd1..qd7 (rad/s), qdd1..qdd7 (rad/s²) in any order and,
        optionally, s; a file ending in .npz or .json; or .yaml, a ROS ``JointTrajectory`` as `save` writes
        it, with times in whole nanoseconds.

    Returns
    -------
    TrajectoryTable

    Raises
    ------
    ModelError
        With file and line, or row: a missing column; a word, NaN or infinity instead of a number; a time that
        does not rise.

    Examples
    --------
    >>> import tempfile
    >>> names = ",".join(f"{name}{i}" for name in ("q", "qd", "qdd") for i in range(1, 8))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     text = f"t,{names}\\n0{',0' * 21}\\n0.5{',0.1' * 21}\\n"
    ...     _ = Path(folder, "a.csv").write_text(text)
    ...     load_trajectory(f"{folder}/a.csv")
    <TrajectoryTable of 0.5 s, 2 rows>
    """
    match Path(path).suffix.lower():
        case ".npz" | ".json":
            return _from_blocks(path)
        case ".yaml" | ".yml":
            return _from_message(path)
    return _from_csv(path)


def holds_trajectory(path: PathLike) -> bool:
    """Return whether a file has the columns of a trajectory; False for a CSV file that cannot be read.

    Raises `ModelError` if an NPZ or JSON file cannot be read.
    """
    if Path(path).suffix.lower() in (".npz", ".json"):
        return {"t", "qd", "qdd"} <= read_blocks(path).keys()
    try:
        with open_text(path, partial(refuse, path)) as file:
            header = next((row for row in csv.reader(RowLines(file)) if "".join(row).strip()), [])
    except (ModelError, OSError, UnicodeDecodeError, csv.Error):
        return False
    return set(_NUMBERS) <= {name.strip() for name in header}


def _from_csv(path: PathLike) -> TrajectoryTable:
    """Return the trajectory of a CSV file."""
    file = CsvFile(path, _NUMBERS, ("s",))
    parts = [np.empty((0, len(_NUMBERS) + 1))]
    lines: list[int] = []
    for block in file.blocks():
        parts.append(block.numbers)
        lines += block.lines
    rows = np.concatenate(parts)
    t, q, qd, qdd, s = rows[:, 0], rows[:, 1:8], rows[:, 8:15], rows[:, 15:22], rows[:, 22]
    fault = _fault({"t": t, "q": q, "qd": qd, "qdd": qdd})
    if fault is not None:
        file.fail(fault[1], lines[fault[0]])
    return TrajectoryTable(t, s, q, qd, qdd)


def _from_blocks(path: PathLike) -> TrajectoryTable:
    """Return the trajectory of an NPZ or JSON file."""
    blocks = read_blocks(path)
    t = number_block(blocks, path, "t", 0)
    s = number_block(blocks, path, "s", 0) if "s" in blocks else np.full(len(t), np.nan)
    q, qd, qdd = (number_block(blocks, path, name, JOINTS) for name in RATES)
    for name, column in {"s": s, "q": q, "qd": qd, "qdd": qdd}.items():
        if len(column) != len(t):
            refuse(path, f"{name} has {len(column)} rows and t has {len(t)}")
    fault = _fault({"t": t, "q": q, "qd": qd, "qdd": qdd})
    if fault is not None:
        refuse(path, f"row {fault[0]}: {fault[1]}")
    return TrajectoryTable(t, s, q, qd, qdd)


def _from_message(path: PathLike) -> TrajectoryTable:
    """Return the trajectory of a YAML file of the form that `save` writes, read without a YAML library."""
    names: tuple[str, ...] = ()
    columns: dict[str, list[Any]] = {"t": [], "q": [], "qd": [], "qdd": []}
    text = _opening.text_of(path, _opening.TEXT, partial(refuse, path))
    for number, line in enumerate(text.splitlines(), 1):
        key, _, value = line.removeprefix("- ").strip().partition(": ")
        if key == "joint_names":
            names = tuple(_list(path, number, value, str))
        elif key in _MESSAGE:
            columns[_MESSAGE[key]].append(_list(path, number, value, float))
        elif key == "time_from_start":
            time = _TIME.fullmatch(value)
            if time is None:
                refuse(path, f"time_from_start is {value!r:.60}, wanted {{sec: .., nanosec: ..}}", number)
            columns["t"].append(int(time[1]) + int(time[2]) * _NANO)
    if len({len(column) for column in columns.values()}) != 1 or not names:
        refuse(path, "no JointTrajectory as armangle.io.save writes it")
    t = np.array(columns["t"], dtype=np.float64)
    q, qd, qdd = (np.array(columns[name], dtype=np.float64).reshape(-1, JOINTS) for name in RATES)
    fault = _fault({"t": t, "q": q, "qd": qd, "qdd": qdd})
    if fault is not None:
        refuse(path, f"point {fault[0]}: {fault[1]}")
    return TrajectoryTable(t, np.full(len(t), np.nan), q, qd, qdd, names)


def _list(path: PathLike, line: int, text: str, kind: type) -> list[Any]:
    """Return the seven words or numbers of a list in brackets; raise for anything else."""
    try:
        found = json.loads(text, parse_int=float)  # an integer may be too large
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, list) or len(found) != JOINTS or not all(type(x) is kind for x in found):
        what = "words" if kind is str else "numbers"
        refuse(path, f"{text!r:.60} is no list of {JOINTS} {what}", line)
    return found


def _fault(columns: dict[str, Floats]) -> tuple[int, str] | None:
    """Return the first row that no trajectory may have, and what is wrong; None if all rows are right."""
    for name, column in columns.items():
        bad = ~np.isfinite(column)
        if bad.any():
            row, *joint = (int(i) for i in np.argwhere(bad)[0])
            which = f"{name}{joint[0] + 1}" if joint else name
            return row, f"{which} is {column[(row, *joint)]}, wanted a finite number"
    t = columns["t"]
    back = np.diff(t) <= 0
    if back.any():
        row = int(np.argmax(back)) + 1
        return row, f"t is {t[row]:g} after {t[row - 1]:g}, wanted times that rise"
    return None
