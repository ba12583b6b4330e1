"""Files: poses, joints and trajectories as CSV, NPZ and JSON, trajectories for ROS as YAML.

Radians, metres and unit quaternions throughout.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import singledispatch
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import JOINTS, Floats, Ints, PathLike, as_poses
from .._values import by_content, freeze
from ..arm.solution import Solution, Solutions
from ..errors import InputError, ModelError
from ..motion.joint_path import JointPath, even_parameters
from ..poses import COLUMNS, UNIT_TOLERANCE, poses_from_rows, rows_from_poses
from ..status import STATUSES, Status
from ..timing.trajectory import Trajectory
from .archive_blocks import number_block, read_blocks, word_block
from .csv_blocks import CsvBlock, CsvFile
from .joint_rows import JOINT_COLUMNS, NO_GC, OPTIONAL, codes, row_fault, unsaid_fault
from .replacing import replacing
from .sheets import WRITERS, Sheet, ending
from .trajectories import RATES, TrajectoryTable, holds_trajectory, load_trajectory

_HEADINGS = {"q": JOINT_COLUMNS, "pose": COLUMNS}
_FEW_DIGITS = 5e-3  # error of a quaternion's length if its numbers have three digits, and some reserve


@by_content
@dataclass(frozen=True, eq=False)
class JointTable:
    """A joint file: rows of joint values with further columns; arrays are read-only.

    Not to be confused with `JointPath`, which also has its arm and poses.

    Parameters
    ----------
    s : ndarray, shape (N,)
        Path parameter, any finite number in the file; `save` writes 0 to 1.
    q : ndarray, shape (N, 7)
        Joint values, rad; NaN in rows without a solution.
    psi : ndarray, shape (N,)
        Arm angle, rad; NaN if the file has none.
    gc : ndarray of int64, shape (N,)
        Global configuration; -1 if the file has none.
    status : ndarray of int8, shape (N,)
        `Status` of each row.
    margin : ndarray, shape (N,)
        Distance to the nearest joint limit, rad; NaN if the file has none.
    trajectory : TrajectoryTable or None
        Times, velocities and accelerations of the same rows if the file is a trajectory.
    """

    s: Floats
    q: Floats
    psi: Floats
    gc: Ints
    status: NDArray[np.int8]
    margin: Floats
    trajectory: TrajectoryTable | None = None

    def __post_init__(self) -> None:
        freeze(self, "s", "q", "psi", "gc", "status", "margin")

    def __len__(self) -> int:
        return len(self.q)

    def __repr__(self) -> str:
        return f"<JointTable of {len(self)} rows>"


# -- writing -----------------------------------------------------------------------------------------


def save(value: Any, path: PathLike) -> None:
    """Write a value to a file; the ending .csv, .npz, .json or .yaml determines the format.

    The file is written under a temporary name and then renamed: a failed run leaves the old file unchanged.

    Parameters
    ----------
    value : JointPath, JointTable, Solution, Solutions, Trajectory, TrajectoryTable, or array_like (N, 4, 4)
        A trajectory has the columns t (s), s, q1..q7 (rad), qd1..qd7 (rad/s), qdd1..qdd7 (rad/s²). It alone
        can be YAML: a ROS ``trajectory_msgs/JointTrajectory``. Any other motion has the columns s, q1..q7
        (rad), psi (rad), gc, status, margin (rad). So have solutions, with equal steps of s. Poses, also one
        of shape (4, 4), have x, y, z (m), qw, qx, qy, qz. In NPZ and JSON q1..q7 are one array ``q`` (N, 7),
        and a pose's seven numbers one array ``pose`` (N, 7).
    path : path
        The file to write.

    Raises
    ------
    InputError
        If the ending is unknown, or the value cannot be saved.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(np.eye(4), f"{folder}/home.csv")
    ...     print(Path(folder, "home.csv").read_text(), end="")
    x,y,z,qw,qx,qy,qz
    0.0,0.0,0.0,1.0,0.0,0.0,0.0
    """
    write = WRITERS[ending(path)]
    sheet = sheet_of(value)
    with replacing(path) as file:
        write(sheet, file)


@singledispatch
def sheet_of(value: Any) -> Sheet:
    """Return the columns under which poses are saved, raise for others; types register their own function."""
    if not isinstance(value, (np.ndarray, list, tuple)):
        raise InputError(f"a {type(value).__name__} cannot be saved, wanted a path or poses (N, 4, 4)")
    if np.shape(value)[-1:] == (JOINTS,):
        raise InputError(
            f"an array {np.shape(value)} may be joints or poses: joints are saved as a JointPath or "
            "a Solution, seven numbers of a pose by armangle.pose(p[:3], wxyz=p[3:])"
        )
    poses = as_poses("poses", value)
    if poses.ndim > 3:
        raise InputError(f"poses has shape {poses.shape}, wanted (4, 4) or (N, 4, 4)")
    frames = poses.reshape(-1, 4, 4)
    _core.check_transforms(np.ascontiguousarray(frames), "pose")
    return Sheet("poses", {"pose": rows_from_poses(frames)}, _HEADINGS)


@sheet_of.register(JointPath)
@sheet_of.register(JointTable)
def _(value: JointPath | JointTable) -> Sheet:
    """Return the columns for a joint path: one row for each of its rows, solved or not."""
    return _joint_rows(value, value.s, value.status)


@sheet_of.register
def _(value: Solution) -> Sheet:
    """Return the columns for a batch of solutions: one row for each pose, NaN where there is none."""
    return _joint_rows(value, even_parameters(np.size(value.status)), value.status)


@sheet_of.register
def _(value: Solutions) -> Sheet:
    """Return the columns for all solutions of one pose: one row for each; raise for a batch of poses."""
    status = np.full(len(value), Status.OK)  # one pose; for a batch len() raises the error
    return _joint_rows(value, even_parameters(len(value)), status)


def _joint_rows(value: JointPath | JointTable | Solution | Solutions, s: Floats, status: Any) -> Sheet:
    """Return the columns for a value with joints, one row for each; arrays of any shape are flattened."""
    names = np.array([status.name for status in STATUSES])[np.ravel(status)]
    blocks = {"s": s, "q": np.reshape(value.q, (-1, JOINTS))}
    blocks |= {name: np.ravel(getattr(value, name)) for name in ("psi", "gc")}
    return Sheet("joints", blocks | {"status": names, "margin": np.ravel(value.margin)}, _HEADINGS)


@sheet_of.register(Trajectory)
@sheet_of.register(TrajectoryTable)
def _(value: Trajectory | TrajectoryTable) -> Sheet:
    """Return the columns for a trajectory, with the joint names of its arm, or its own."""
    blocks = {name: getattr(value, name) for name in ("t", "s", *RATES)}
    names = value.joint_names if isinstance(value, TrajectoryTable) else value.path.arm.geometry.joint_names
    return Sheet("trajectory", blocks, RATES, names)


# -- reading -----------------------------------------------------------------------------------------


def load_poses(path: PathLike, *, lost: bool = False) -> Floats:
    """Return the poses of a file.

    Parameters
    ----------
    path : path
        CSV with the columns x, y, z (m), qw, qx, qy, qz in any order, others are ignored; or a file ending in
        .npz or .json, as `save` writes it. A CSV file is read in blocks, never as a whole.
    lost : bool
        Whether rows may lack a pose, with seven empty cells or NaN: missing samples. They are NaN, which
        `Tracker.step` accepts.

    Returns
    -------
    ndarray, shape (N, 4, 4)
        Poses; quaternions are normalized exactly.

    Raises
    ------
    ModelError
        With file, line and column: a missing column, a word or NaN instead of a number, a quaternion whose
        length is not 1 within 1e-6.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(np.eye(4), f"{folder}/home.csv")
    ...     load_poses(f"{folder}/home.csv").shape
    (1, 4, 4)
    """
    if Path(path).suffix.lower() in (".npz", ".json"):
        rows = number_block(read_blocks(path), path, "pose", len(COLUMNS))
        fault = _pose_fault(rows, lost)
        if fault is not None:
            raise ModelError(f"pose[{fault[0]}]: {fault[2]}", source=str(path))
        return _poses_or_lost(rows)
    file = CsvFile(path, COLUMNS, lost=lost)
    parts = [_pose_rows(file, block, lost) for block in file.blocks()]
    poses = np.empty((sum(map(len, parts)), 4, 4))
    done = 0
    for part in parts:
        poses[done : done + len(part)] = _poses_or_lost(part)
        done += len(part)
    return poses


def sample_times(path: PathLike) -> Floats | None:
    """Return the column t (s) of a CSV file of poses, NaN in empty cells.

    None without that column or without rows, and for NPZ and JSON. Raises `ModelError`.
    """
    if Path(path).suffix.lower() in (".npz", ".json"):
        return None
    file = CsvFile(path, COLUMNS, ("t",), lost=True)
    parts = [block.numbers[:, len(COLUMNS)] for block in file.blocks()]
    return np.concatenate(parts) if parts and "t" in file.at else None


def _poses_or_lost(rows: Floats) -> Floats:
    """Return rows x, y, z, quaternion as poses (n, 4, 4); NaN for rows with a NaN."""
    came = np.isfinite(rows).all(axis=1)
    if came.all():
        return poses_from_rows(rows)
    poses = np.full((len(rows), 4, 4), np.nan)
    poses[came] = poses_from_rows(np.ascontiguousarray(rows[came]))
    return poses


def _pose_rows(file: CsvFile, block: CsvBlock, lost: bool) -> Floats:
    """Return the rows of a block; raise at the first that is no pose (nor, if `lost`, empty)."""
    fault = _pose_fault(block.numbers, lost)
    if fault is not None:
        row, column, message = fault
        file.fail(message, block.lines[row], column)
    return block.numbers


def _pose_fault(rows: Floats, lost: bool) -> tuple[int, str, str] | None:
    """Return row, column and reason of the first row (of (N, 7)) that is no pose; None if all are.

    Empty rows count as poses if `lost`.
    """
    infinite = ~np.isfinite(rows)
    if lost:
        infinite[np.isnan(rows).all(axis=1)] = False
    if infinite.any():
        row, k = (int(i) for i in np.argwhere(infinite)[0])
        return row, COLUMNS[k], f"{COLUMNS[k]} is {rows[row, k]}, wanted a finite number"
    length = np.linalg.norm(rows[:, 3:], axis=1)
    bad = np.abs(length - 1) > UNIT_TOLERANCE
    if bad.any():
        row = int(np.argmax(bad))
        message = f"the quaternion has length {length[row]:.9g}, wanted 1 within {UNIT_TOLERANCE:g}"
        if abs(length[row] - 1) < _FEW_DIGITS:
            message += "; where digits were left out divide qw, qx, qy, qz by it"
        return row, COLUMNS[3], message
    return None


def load_joints(path: PathLike) -> JointTable:
    """Return the rows of a joint file, as `save` writes it.

    Parameters
    ----------
    path : path
        CSV with the columns q1..q7 (rad) in any order and, optionally, s, psi, gc, status, margin; or a file
        ending in .npz or .json. For a trajectory the times, velocities and accelerations are in
        ``trajectory``; `load_trajectory` returns them alone.

    Returns
    -------
    JointTable
        Defaults of missing columns: s has equal steps from 0 to 1, psi and margin are NaN, gc is -1, and
        status is OK if all joints are numbers, otherwise NOT_REACHED.

    Raises
    ------
    ModelError
        With file, line and column: a missing column, a word instead of a number, an unknown status, an s that
        is not finite, a gc that is not an integer from 0 to 7 (or -1), a row with status OK that lacks a
        joint, or the psi or gc that other such rows have.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "a.csv").write_text("q1,q2,q3,q4,q5,q6,q7\\n0,0.5,0,-1,0,1,0\\n")
    ...     load_joints(f"{folder}/a.csv").q.tolist()
    [[0.0, 0.5, 0.0, -1.0, 0.0, 1.0, 0.0]]
    """
    if Path(path).suffix.lower() == ".yaml":
        raise ModelError("a trajectory, which load_trajectory reads", source=str(path))
    table = _joints_of(path)
    return replace(table, trajectory=load_trajectory(path)) if holds_trajectory(path) else table


def _joints_of(path: PathLike) -> JointTable:
    """Return the rows of a joint file of any format."""
    if Path(path).suffix.lower() in (".npz", ".json"):
        return _joints_from_blocks(path)
    file = CsvFile(path, JOINT_COLUMNS, OPTIONAL, ("status",))
    numbers, status = [np.empty((0, JOINTS + len(OPTIONAL)))], [np.empty(0, dtype=np.int8)]
    lines = [np.empty(0, dtype=np.int64)]
    for block in file.blocks():
        words = block.words.get("status")
        fault = row_fault(block.numbers, words, file.at)
        if fault is not None:
            file.fail(fault[2], block.lines[fault[0]], fault[1])
        numbers.append(block.numbers)
        status.append(codes(block.numbers, words))
        lines.append(np.array(block.lines, dtype=np.int64))
    rows, outcome = np.concatenate(numbers), np.concatenate(status)
    fault = unsaid_fault(rows, outcome) if "status" in file.at else None
    if fault is not None:
        file.fail(fault[2], int(np.concatenate(lines)[fault[0]]), fault[1])
    return _joint_table(rows, outcome)


def _joints_from_blocks(path: PathLike) -> JointTable:
    """Return the rows of a joint file in NPZ or JSON."""
    blocks = read_blocks(path)
    q = number_block(blocks, path, "q", JOINTS)
    unknown = np.full(len(q), np.nan)
    columns = [number_block(blocks, path, name, 0) if name in blocks else unknown for name in OPTIONAL]
    words = word_block(blocks, path, "status") if "status" in blocks else None
    for name, column in zip((*OPTIONAL, "status"), (*columns, words), strict=True):
        if column is not None and len(column) != len(q):
            raise ModelError(f"{name} has {len(column)} rows and q has {len(q)}", source=str(path))
    numbers = np.column_stack([q, *columns])
    fault = row_fault(numbers, words, blocks)
    if fault is None:
        status = codes(numbers, words)
        fault = unsaid_fault(numbers, status) if words is not None else None
    if fault is not None:
        raise ModelError(f"row {fault[0]}: {fault[2]}", source=str(path))
    return _joint_table(numbers, status)


def _joint_table(numbers: Floats, status: NDArray[np.int8]) -> JointTable:
    """Return numbers (q, s, psi, gc, margin) and statuses as a table; a missing s becomes even
    from 0 to 1.
    """
    s, psi, gc, margin = numbers[:, JOINTS:].T
    if len(s) and np.isnan(s).all():
        s = np.linspace(0.0, 1.0, len(s))
    index = np.where(np.isnan(gc), NO_GC, gc).astype(np.int64)
    return JointTable(s, numbers[:, :JOINTS], psi, index, status, margin)
