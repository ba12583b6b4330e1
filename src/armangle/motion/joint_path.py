"""JointPath: a motion in joint space along poses, as `follow` and `plan` return it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._arrays import (
    JOINTS,
    FloatOrArray,
    Floats,
    IntOrArray,
    Ints,
    as_floats,
    as_number,
    chosen,
    unwrap_known,
)
from .._values import by_content, freeze
from ..arm.arm import Arm
from ..arm.diagnosis import Diagnosis
from ..errors import InputError, PathError, has_package
from ..scenes.scene import Scene
from ..status import SOLVED, STATUSES, Status
from .curves import ORDERS, AnyCurve, JointLines, JointSpline
from .kinds import branches_of, curve_through, why_unreached
from .paths import Deviation, Path, checked_parameters, deviation_of

MOST_PASSED = 1e-6
"""Largest limit violation between two rows, rad, if no arm angle can remove it."""
BEGIN = "arm.solve(poses[0], seed=start).q"
"""Advice for a path whose first pose is too far from the start."""
ROW_STEP = 0.2
"""Largest move of a joint between rows after rows are added, rad."""
FINEST = 1e-9  # of s: no row is added between rows nearer than this
LEAST_STEP = 1e-6
"""Least step of `JointPath.finer`, rad."""
_MOST_ROWS = 10_000_000
_ENDLESS = 1e9  # rad per unit of s: a larger rate is unbounded
_READ = 1e-6  # rad: error of a file's missing digits
_FEWEST_SMOOTH = 8  # rows needed for a cubic spline through every other row
_SMOOTH = 0.25
"""Largest error of a spline relative to straight lines: 0.6 at a corner, step squared on a curve."""
_TURN = 2 * np.pi
Between = Literal["tool", "joints", "spline"]
BETWEEN = ("tool", "joints", "spline")
SAID = {
    "tool": "Between its rows the tool goes straight.",
    "joints": "Between its rows every joint goes straight.",
    "spline": "Between its rows joints are on a spline.",
}
"""The motion between rows, in words."""
_OF_A_JOINT = (Status.JOINT_JUMP, Status.LIMITS, Status.WINDING_EXHAUSTED)
"""Statuses of a step that are best explained by one joint."""
_OUT_OF_REACH = (Status.UNREACHABLE, Status.FOLDED, Status.ELBOW_LIMIT, Status.ELBOW_MARGIN, Status.LIMITS)


@by_content
class PathPoint(NamedTuple):
    """Values of a path at s: ``q (..., 7)`` rad, ``psi (...)`` rad, ``gc (...)``, ``pose (..., 4, 4)`` m.

    Beyond the s that was reached q and psi are NaN, and gc is -1.
    """

    q: Floats
    psi: FloatOrArray
    gc: IntOrArray
    pose: Floats


def blank_rows(n: int) -> dict[str, Any]:
    """Return the columns of n empty rows: NaN, gc -1, NOT_REACHED."""
    return {
        "q": np.full((n, JOINTS), np.nan), "psi": np.full(n, np.nan), "gc": np.full(n, -1, dtype=np.int64),
        "status": np.full(n, Status.NOT_REACHED, dtype=np.int8), "margin": np.full(n, np.nan),
        "residual": np.full(n, np.nan),
    }  # fmt: skip


def even_parameters(n: int) -> Floats:
    """Return the s of n poses at equal steps from 0 to 1; 0 for a single pose."""
    return np.linspace(0.0, 1.0, n) if n != 1 else np.zeros(1)


def rows_between(arm: Arm, curve: AnyCurve, rows: Floats, step: float) -> Floats:
    """Return the s of rows with rows inserted so that no joint moves more than `step` (rad) between two.

    A jump, as at a singular end, remains between two rows within `FINEST` of each other. Insertion ends early
    if an inserted row has no solution.
    """
    coarser = rows
    while True:
        q = curve.at(arm._handle, rows).q
        if not np.isfinite(q).all():  # an inserted row has no solution; nothing is proven there
            return coarser
        steps = np.abs(np.diff(q, axis=0)).max(axis=1, initial=0.0)
        parts = np.where(np.diff(rows) > FINEST, np.ceil(steps / step), 1).astype(int)
        if (parts <= 1).all():
            return rows
        ends = zip(rows[:-1], rows[1:], parts.clip(1), strict=True)
        coarser = rows
        rows = np.concatenate([*(np.linspace(low, high, n + 1)[:-1] for low, high, n in ends), rows[-1:]])


def _outside(q: Floats, beyond: Floats, verb: str) -> str:
    """Return as a sentence with `verb` which joint of q is outside its limits most, by `beyond` (7,), rad."""
    joint = int(np.argmax(beyond))
    unit = " Joints are in rad: were these degrees?" if np.abs(q).max() > _TURN else ""
    return f"Joint {joint + 1} {verb} {np.degrees(beyond[joint]):.4g} deg outside its limits.{unit}"


def _unwrapped(arm: Arm, q: Floats) -> Floats:
    """Return joints (n, 7) with turns added so that unlimited joints take the shorter way to the next row."""
    out = np.array(q, order="C")
    free = np.isinf(arm.lower) & np.isinf(arm.upper)
    out[:, free] = np.unwrap(out[:, free], axis=0)
    return out


def _raise_where_wrapped(arm: Arm, q: Floats) -> None:
    """Raise if a joint moves by more than π between two rows although ±2π would be shorter and within limits.

    Values beyond one turn of an encoder, [-π, π] or [0, 2π], do not wrap.
    """
    steps = np.diff(q, axis=0)
    low, high = q.min(axis=0) + _READ, q.max(axis=0) - _READ
    in_a_turn = ((low >= -np.pi) & (high <= np.pi)) | ((low >= 0) & (high <= _TURN))
    shorter = q[1:] - _TURN * np.round(steps / _TURN)
    inside = (shorter >= arm.lower - _READ) & (shorter <= arm.upper + _READ)
    wrapped = np.argwhere((np.abs(steps) > np.pi) & inside & in_a_turn)
    if not len(wrapped):
        return
    row, joint = wrapped[0].tolist()
    raise PathError(
        f"from row {row} to row {row + 1} joint {joint + 1} goes from {q[row, joint]:.6g} to "
        f"{q[row + 1, joint]:.6g} rad, more than half a turn, and the shorter way fits the limits: "
        f"if its values wrap, q[:, {joint}] = np.unwrap(q[:, {joint}]); to move that far, give rows between"
    )


def _smooth(path: JointPath) -> JointSpline | None:
    """Return the spline through rows that are smooth; None if they are not, or it would violate a limit.

    They are smooth if a spline through every other row misses the others by far less than straight lines.
    """
    kept = path._apart()
    if not has_package("scipy") or len(kept) < _FEWEST_SMOOTH:
        return None
    rows = path._rows_of_joints(kept)
    curve = JointSpline(*rows, rests=True)
    own, q = curve.own[curve.moving], rows[2][curve.moving]
    if len(own) < _FEWEST_SMOOTH:
        return None
    missed = np.zeros(2)
    for first in (0, 1):
        some, others = np.arange(first, len(own), 2), np.arange(first + 1, len(own) - 1, 2)
        for k, kind in enumerate((JointSpline, JointLines)):
            half = kind(rows[0], (own[some] - own[first]) / np.ptp(own[some]), q[some], *rows[3:])
            at = (own[others] - own[first]) / np.ptp(own[some])
            missed[k] = max(missed[k], np.abs(half.joints(at) - q[others])[at < 1].max())
    beyond = curve.passed(path.arm.lower, path.arm.upper).max()
    return curve if missed[0] <= _SMOOTH * missed[1] + _READ and beyond <= MOST_PASSED else None


def _raise_where_torn(gc: Ints, row: int) -> None:
    """Raise because no joint motion leads from row `row` to the next; do nothing if `row` is -1."""
    if row < 0:
        return
    over = (
        f"the branch changes from {gc[row]} to {gc[row + 1]}, and a straight motion of the end effector "
        "cannot do that: give from_joints more rows there, or between='joints'"
    )
    if gc[row] == gc[row + 1]:
        over = (
            "the arm is singular, and no motion leads to the next row: follow more poses there, or use plan"
        )
    raise PathError(f"the path has no values after row {row}: {over}")


@by_content
@dataclass(frozen=True, eq=False, repr=False)
class JointPath:
    """A motion along poses: one row a pose. Arrays are read-only; rows not reached are NaN, gc -1.

    Parameters
    ----------
    arm : Arm
        The arm that moves.
    s : ndarray, shape (N,)
        Path parameter in [0, 1].
    poses : ndarray, shape (N, 4, 4)
        Requested poses of the end effector, m; with a free roll the reached ones.
    q : ndarray, shape (N, 7)
        Joint values, rad, continuous over ±π.
    psi : ndarray, shape (N,)
        Arm angle, or the value of the free joint, rad, continuous.
    gc : ndarray of int64, shape (N,)
        Global configuration of each row.
    status : ndarray of int8, shape (N,)
        `Status` of each row.
    margin : ndarray, shape (N,)
        Distance to the nearest joint limit, rad.
    residual : ndarray, shape (N,)
        Distance of the end effector's origin from its pose, m.
    certified : bool
        Whether limits and margins are proven between the rows too, on all of [0, 1]; never by `follow`.
    uncertified : ndarray, shape (k, 2)
        The unproven ranges of s.
    diagnosis : Diagnosis or None
        The findings of `plan` for every global configuration, best first: ranking, or reasons for no path.
    path : Path or None
        The path of the end effector between the rows; if None, straight with shortest rotations. If the
        joints determine it (``between=`` of `from_joints`), it is that of `at`.
    curve : Curve or None
        The arm angle or the joints between the rows; None: the arm angle (free joint) is linear.
    start : ndarray, shape (7,), or None
        The joints before the first pose, rad, from `follow`.
    scenes : tuple of Scene
        The obstacles when it was made: none, one scene, or one a row.
    """

    arm: Arm
    s: Floats
    poses: Floats
    q: Floats
    psi: Floats
    gc: Ints
    status: NDArray[np.int8]
    margin: Floats
    residual: Floats
    certified: bool = False
    uncertified: Floats = field(default_factory=lambda: np.array([[0.0, 1.0]]))
    diagnosis: Diagnosis | None = None
    path: Path | None = None
    curve: AnyCurve | None = None
    start: Floats | None = None
    scenes: tuple[Scene, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "s", "poses", "q", "psi", "gc", "status", "margin", "residual", "uncertified")

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.__post_init__()  # arrays of a copy are read-only too

    def __len__(self) -> int:
        return len(self.s)

    @classmethod
    def from_joints(
        cls, arm: Arm, q: ArrayLike, *, s: ArrayLike | None = None,
        status: ArrayLike | None = None, between: Between | None = None,
    ) -> JointPath:  # fmt: skip
        """Return joint values from a file or a teach pendant as a motion, for `at` and `retime`.

        Parameters
        ----------
        arm : Arm
        q : array_like, shape (N, 7)
            Joint values, rad; NaN in rows without. An unlimited joint takes the shorter way from row to row:
            turns from wrapping encoders, as at ±π, are undone.
        s : array_like, shape (N,), optional
            Path parameters from 0 to 1, not decreasing; at equal steps by default.
        status : array_like of int, shape (N,), optional
            `Status` of each row; by default OK, or NOT_REACHED without joints. A solved row is LIMITS if its
            joints violate limits.
        between : "tool", "joints" or "spline", optional
            The motion between rows. The default is "spline" if rows are smooth, otherwise "tool"; ``between``
            of the result tells which. Rows are smooth if a spline through every other row meets the rows
            between far better than straight lines do, keeps the limits, and SciPy is installed. "tool": the
            end effector moves straight, as in a motion of `follow`. "joints": every joint moves linearly, as
            between taught configurations (PTP), or along the result of a joint-space planner. "spline":
            joints follow a cubic spline through the rows, twice differentiable, as in a smooth motion; where
            rows repeat joints rest. It needs SciPy: pip install 'armangle[time]'.

        Returns
        -------
        JointPath
            Poses, arm angle and configuration are computed from the joints. The pose of a failed row is NaN,
            also if joints are constant there, because joints do not determine the missed pose.

        Raises
        ------
        PathError
            If no row has joints, a spline through them violates a limit, or a joint with limits wraps: it
            moves by more than half a turn between rows although its limits permit the shorter way.
        InputError
            If an array has a wrong shape, or s decreases.
        """
        if between is not None:
            chosen("between", between, BETWEEN)
        rows_given = as_floats("q", q, (JOINTS,)).reshape(-1, JOINTS)
        n = len(rows_given)
        known = np.isfinite(rows_given).all(axis=1)
        if not known.any():
            raise PathError("no row has joint values, wanted at least one")
        at = even_parameters(n) if s is None else as_floats("s", s, ()).reshape(-1)
        if len(at) != n or not (np.diff(at) >= 0).all() or at[0] != 0 or at[-1] != (n > 1):
            ends = f" from {at[0]:.6g} to {at[-1]:.6g}" if len(at) else ""
            raise InputError(f"s holds {len(at)} numbers{ends}, wanted {n} from 0 to 1 that do not fall")
        rows, poses = blank_rows(n), np.full((n, 4, 4), np.nan)
        joints = _unwrapped(arm, rows_given[known])
        poses[known], rows["psi"][known], rows["gc"][known] = arm.forward(joints, on_error="nan")
        rows["q"][known], rows["margin"][known] = joints, arm.limit_margin(joints)
        rows["residual"][known] = 0.0
        if status is None:
            rows["status"][known] = np.where(arm.within_limits(joints), Status.OK, Status.LIMITS)
        else:
            given = np.asarray(status)
            if given.shape != (n,):
                raise InputError(f"status has shape {given.shape}, wanted ({n},)")
            rows["status"] = given.astype(np.int8)
            beyond = np.isin(given[known], SOLVED) & ~arm.within_limits(joints, _READ)
            rows["status"][np.flatnonzero(known)[beyond]] = Status.LIMITS
        failed = ~np.isin(rows["status"], SOLVED)
        poses[failed] = rows["residual"][failed] = np.nan
        unwrap_known(rows["psi"])
        found = cls(arm=arm, s=at, poses=poses, **rows)
        if not found.ok:
            return found
        _raise_where_wrapped(arm, joints)
        if between is None:
            smooth = _smooth(found)
            return found if smooth is None else replace(found, curve=smooth)
        return found if between == "tool" else replace(found, curve=found._led(between))

    @property
    def between(self) -> Between:
        """The motion between rows: end effector along its path, joints linear, or joints on a spline."""
        kinds: dict[type, Between] = {JointLines: "joints", JointSpline: "spline"}
        return kinds.get(type(self.curve), "tool")

    @property
    def ok(self) -> bool:
        """Whether every pose is solved within all limits."""
        return bool(np.isin(self.status, SOLVED).all())

    @property
    def first_failure(self) -> int | None:
        """Index of the first row that is not solved, or None."""
        bad = np.flatnonzero(~np.isin(self.status, SOLVED))
        return int(bad[0]) if len(bad) else None

    @property
    def deviation(self) -> Deviation:
        """Largest deviation of rounded corners (`blend`) from the given path: m and rad; otherwise 0."""
        return deviation_of(self.path)

    @property
    def clearance(self) -> Floats:
        """Smallest distance between links and obstacles at each row, m; NaN without a scene or solution."""
        return self._nearest()[0]

    @property
    def closest(self) -> tuple[float, str, str] | None:
        """The s of the row with the smallest clearance, and the names of obstacle and link.

        None without a scene, or without an obstacle.
        """
        apart, names = self._nearest()
        if not np.isfinite(apart).any():
            return None
        at = int(np.nanargmin(apart))
        return float(self.s[at]), *names[at]

    def _nearest(self) -> tuple[Floats, list[tuple[str, str]]]:
        """Return for each row the distance to the obstacles (m, or NaN) and names of obstacle and link."""
        apart, names = np.full(len(self), np.nan), [("", "")] * len(self)
        known = np.flatnonzero(np.isfinite(self.psi) & np.isfinite(self.poses).all(axis=(1, 2)))
        for k in known.tolist() if self.scenes else ():
            scene = self.scenes[k if len(self.scenes) > 1 else 0]
            near = self.arm.clearance(self.q[k], scene)
            apart[k], names[k] = near.distance, (str(near.obstacle), str(near.link))
        return apart, names

    def at(self, s: ArrayLike) -> PathPoint:
        """Return the motion at any s: the closed-form inverse at the pose and the arm angle there.

        The result is on the path to 1e-12. Joints are interpolated only if `from_joints` requested it, with
        psi in (-π, π], or NaN if it does not exist. If the path has neither `path` nor `curve` (from
        `follow`), the end effector moves straight and by the shortest rotation from pose to pose, and the arm
        angle, or the free joint, is linear; q is NaN without a solution. If that would violate a limit, the
        arm angle deviates so that the limit holds, to 1e-6 rad.

        Parameters
        ----------
        s : array_like, shape (...)
            Path parameter in [0, 1].

        Returns
        -------
        PathPoint
            Fields ``q, psi, gc, pose``.

        Raises
        ------
        InputError
            If an s is not in [0, 1].
        PathError
            If no row is solved, or a path of `follow` is incomplete; or if a limit is violated between two of
            its rows for every arm angle.
        """
        at = checked_parameters(s)
        curve = self._drawn
        flat = at.reshape(-1)
        inside = flat <= curve.end
        q, psi = np.full((at.size, JOINTS), np.nan), np.full(at.size, np.nan)
        placed = curve.at(self.arm._handle, np.ascontiguousarray(flat[inside]))
        q[inside], psi[inside] = placed.q, placed.psi
        pose = np.empty((at.size, 4, 4))
        _core.path_poses(curve.segments, np.ascontiguousarray(flat), pose)
        pose[inside] = placed.pose
        gc = np.full(at.size, -1, dtype=np.int64)
        gc[inside] = placed.gc
        shape = at.shape
        return PathPoint(
            q=q.reshape(*shape, JOINTS),
            psi=psi.reshape(shape)[()],
            gc=gc.reshape(shape)[()],
            pose=pose.reshape(*shape, 4, 4),
        )

    def finer(self, step: float = ROW_STEP) -> JointPath:
        """Return the same motion with rows inserted, so that no joint moves far between two.

        For controllers with linear joint motion between rows: the end effector hardly leaves its path.

        Parameters
        ----------
        step : float
            Largest move of a joint between rows, rad, 1e-6 to 2 pi.

        Returns
        -------
        JointPath
            Its rows are among the new ones, bit for bit, one for each s. The scene of a row with moving
            obstacles holds until the next of these.

        Raises
        ------
        InputError
            If it takes more than 10^7 rows.
        PathError
            As `at`; if the path is incomplete, joints jump on it, or a solution between two rows is missing.
        """
        most = as_number("step (rad)", step, LEAST_STEP, _TURN)
        self.raise_for_status()
        curve = self._drawn
        way = float(np.nansum(np.abs(np.diff(self.q, axis=0)).max(axis=1, initial=0.0)))
        if way / most > _MOST_ROWS:
            raise InputError(f"joints go {way:.3g} rad: more than {_MOST_ROWS} rows of step = {most:g} rad")
        own = self._apart()
        if len(own) == 1:
            return self
        s = rows_between(self.arm, curve, self.s[own], most)
        placed = curve.at(self.arm._handle, s)
        far = np.abs(np.diff(placed.q, axis=0)).max(axis=1) > most + _READ
        if far.any() or not np.isfinite(placed.q).all():
            at = s[int(np.argmax(far))]
            raise PathError(
                f"after s = {at:.6g} joints jump, or two rows have no solution between them: follow more "
                "poses there, or plan"
            )
        columns: dict[str, Any] = {name: getattr(placed, name) for name in ("q", "psi", "margin", "residual")}
        columns |= {"poses": placed.pose, "gc": placed.gc.astype(np.int64)}
        columns["status"] = np.full(len(s), Status.OK, dtype=np.int8)
        kept = np.searchsorted(s, self.s[own])
        before = np.searchsorted(kept, np.arange(len(s)), side="right") - 1
        unwrap_known(columns["psi"])
        turns = np.round((self.psi[own] - columns["psi"][kept]) / _TURN)
        columns["psi"] += _TURN * np.where(np.isfinite(turns), turns, 0.0)[before]
        for name, column in columns.items():
            column[kept] = getattr(self, name)[own]
        scenes = self.scenes
        if len(scenes) > 1:
            scenes = tuple(scenes[k] for k in own[before])
        return replace(self, s=s, curve=curve, scenes=scenes, **columns)

    def derivatives(self, s: ArrayLike) -> Floats:
        """Return dq/ds, d²q/ds², d³q/ds³ at s in closed form, by Taylor arithmetic through the inverse.

        Parameters
        ----------
        s : array_like, shape (...)
            Path parameter in [0, 1]; at one of ``path.breaks`` the later piece counts.

        Returns
        -------
        ndarray, shape (..., 3, 7)
            rad per unit of s, and of its square and cube. NaN beyond the s that was reached. NaN also if
            joints have no finite rate along the path: at an end with the arm stretched or otherwise singular.

        Raises
        ------
        InputError, PathError
            As `at`.
        """
        at = checked_parameters(s)
        curve = self._drawn
        flat = at.reshape(-1)
        inside = flat <= curve.end
        out = np.full((at.size, ORDERS, JOINTS), np.nan)
        out[inside] = curve.derivatives(self.arm._handle, np.ascontiguousarray(flat[inside]))
        finite = np.isfinite(out).all(axis=(1, 2)) & (np.abs(out[:, 0]) < _ENDLESS).all(axis=1)
        out[~finite] = np.nan
        return out.reshape(*at.shape, ORDERS, JOINTS)

    @cached_property
    def _drawn(self) -> AnyCurve:
        """The motion between the rows: the given curve, or one through them; raise if some are unsolved."""
        if self.curve is not None:
            return self.curve
        if self.diagnosis is not None or not self.ok or len(self) == 0:
            raise PathError(f"the path has no values between its rows: {self.explain()}")
        every, kept = branches_of(self.arm, self.q, self.gc), self._apart()
        segments = self.path._segments if self.path is not None else self._straight(kept)
        rows = self.s[kept], self.q[kept], self.psi[kept]
        branches = every[kept]
        if len(kept) == 1:
            rows = np.array([0.0, 1.0]), np.repeat(rows[1], 2, axis=0), np.repeat(rows[2], 2)
            branches = np.repeat(branches, 2)
        s, q, psi = map(np.ascontiguousarray, rows)
        torn = curve_through(self.arm, segments, s, q, psi, branches)[1]
        _raise_where_torn(every, int(kept[torn]) if torn >= 0 else -1)
        found = self.arm._handle.rows_within(segments, s, q, psi, branches)
        s, psi, q, gc, excess, joint, row = found
        if excess > MOST_PASSED:
            raise PathError(
                f"the path has no values between its rows: behind row {kept[row]} joint {joint} passes its "
                f"limit by {np.degrees(excess):.3g} deg; follow more poses there, or plan"
            )
        curve, torn = curve_through(self.arm, segments, s[:, 0], q, psi[:, 0], gc[:, 0].astype(np.int64))
        if torn >= 0:
            _raise_where_torn(every, int(np.searchsorted(self.s, s[torn, 0], side="right")) - 1)
        return curve

    def _led(self, between: Between) -> JointLines | JointSpline:
        """Return the curve through the rows in joint space: linear, or a spline, which must keep limits."""
        kept = self._apart()
        rows = self._rows_of_joints(kept)
        if between == "joints":
            return JointLines(*rows)
        curve = JointSpline(*rows, rests=True)
        beyond = curve.passed(self.arm.lower, self.arm.upper)
        if beyond.max() > MOST_PASSED:
            row, joint = np.unravel_index(beyond.argmax(), beyond.shape)
            raise PathError(
                f"behind row {kept[curve.moving[row]]} a spline through the rows takes joint {joint + 1} "
                f"past its limit by {np.degrees(beyond.max()):.3g} deg: give more rows there, or "
                "between='joints'"
            )
        return curve

    def _rows_of_joints(self, kept: Ints) -> tuple[Arm, Floats, Floats, int, Floats]:
        """Return the arguments of a curve through the joints of these rows."""
        s, q = self.s[kept], self.q[kept]
        if len(kept) == 1:
            s, q = np.array([0.0, 1.0]), np.repeat(q, 2, axis=0)
        return self.arm, s, q, int(self.gc[0]), self._straight(kept)

    def _apart(self) -> Ints:
        """Return the indices of rows with a larger s than the row before; others repeat its joints.

        Raises `PathError` if joints move between two rows with the same s.
        """
        kept = np.append(0, np.flatnonzero(np.diff(self.s) > 0) + 1)
        moved = np.abs(self.q - self.q[kept[np.searchsorted(kept, np.arange(len(self)), side="right") - 1]])
        if moved.max() > MOST_PASSED:
            row, joint = np.unravel_index(moved.argmax(), moved.shape)
            raise PathError(
                f"the path has no values between its rows: at row {row} joint {joint + 1} moves by "
                f"{moved.max():.3g} rad, and s does not"
            )
        return kept

    def _straight(self, rows: Ints) -> Floats:
        """Return the path segments that lead straight from the pose of each of these rows to the next."""
        segments = np.empty((max(len(rows) - 1, 1), _core.SEGMENT_WIDTH))
        _core.path_waypoints(
            np.ascontiguousarray(self.poses[rows]), np.ascontiguousarray(self.s[rows]), segments
        )
        return segments

    def explain(self) -> str:
        """Return in words whether the path is solved, and if not, where and why it fails."""
        if self.diagnosis is not None and not self.ok:
            return self.diagnosis.explain()
        at = self.first_failure
        one = len(self) == 1
        if at is None:
            proven = ", and proven between them" if self.certified else ""
            if len(self) == 0:
                return "There is no pose."
            count = "The one pose is" if one else f"All {len(self)} poses are"
            clear = " and collision-free" if self.scenes else ""
            led = "" if self.between == "tool" else f" {SAID[self.between]}"
            return f"{count} solved within all limits{clear}{proven}.{led}{self._rounded()}{self._unproven()}"
        done = int(np.isin(self.status, SOLVED).sum())
        sentence = STATUSES[self.status[at]].sentence
        if one:
            return f"The one pose is not solved. {sentence}{self._detail(at)}"
        where = f"pose {at} (s = {self.s[at]:.4g}) is the first that is not"
        return (
            f"{done} of {len(self)} poses are solved; {where}. {sentence}{self._detail(at)}{self._later(at)}"
        )

    def _later(self, at: int) -> str:
        """Return why other poses after `at` failed, as a sentence with a space before it, or ""."""
        others = (*SOLVED, self.status[at], Status.NOT_REACHED)
        kinds, counts = np.unique(self.status[at:][~np.isin(self.status[at:], others)], return_counts=True)
        if not len(kinds):
            return ""
        said = ", ".join(f"{count} {Status(kind).name}" for kind, count in zip(kinds, counts, strict=True))
        lost = self.status[at] in _OUT_OF_REACH and Status.JOINT_JUMP in kinds
        gap = "; outside='nearest' keeps near a hand through a gap" if lost else ""
        return f" Behind it also {said}{gap}."

    def _rounded(self) -> str:
        """Return the deviation of rounded corners, as a sentence with a space before it, or ""."""
        position, rotation = self.deviation
        if max(position, rotation) == 0:
            return ""
        return f" Corners are rounded by at most {1e3 * position:.3g} mm and {np.degrees(rotation):.3g} deg."

    def _unproven(self) -> str:
        """Return where a planned path is unproven, as a sentence with a space before it, or ""."""
        if self.certified or self.diagnosis is None:
            return ""
        ranges = ", ".join(f"{lower:.4g} to {upper:.4g}" for lower, upper in self.uncertified[:5])
        more = ", and more" if len(self.uncertified) > 5 else ""
        return f" Between them it is not proven for s from {ranges}{more}."

    def _detail(self, at: int) -> str:
        """Return by how much pose `at` fails, as a sentence with a space before it, or ""."""
        if (
            self.status[at] == Status.LIMITS
            and np.isfinite(self.q[at]).all()
            and self._beyond(self.q[at]).max() > 0
        ):
            return f" {_outside(self.q[at], self._beyond(self.q[at]), 'is')}"
        if not np.isfinite(self.poses[at]).all():
            return ""
        if self.status[at] in (Status.UNREACHABLE, Status.NEAR_SINGULAR):
            return why_unreached(self.arm, self.poses[at], int(self.status[at]))
        solved = np.flatnonzero(np.isin(self.status[:at], SOLVED))
        before = self.q[solved[-1]] if len(solved) else self.start
        if self.status[at] not in _OF_A_JOINT or before is None:
            return ""
        outside = self._beyond(before)
        if outside.max() > 0:
            return f" {_outside(before, outside, 'starts')}"
        _, psi, gc = self.arm.forward(before, on_error="nan")
        if not np.isfinite(psi):
            return ""
        held = self.arm.inverse(self.poses[at], psi, gc, seed=before, limits=False, on_error="nan")
        if not np.isfinite(held).all():
            return ""
        return self._held(at, before, held)

    def _held(self, at: int, before: Floats, held: Floats) -> str:
        """Return in words how far joints would move from `before` to `held`: pose `at` at the same psi."""
        near = held + _TURN * np.round((before - held) / _TURN)
        if self.status[at] == Status.JOINT_JUMP:
            move = np.abs(near - before)
            joint = int(np.argmax(move))
            first = f" Begin at {BEGIN}." if at == 0 and self.start is not None else ""
            return (
                f" With {self._redundancy} held, joint {joint + 1} would move "
                f"{np.degrees(move[joint]):.4g} deg."
                f"{first}"
            )
        beyond = self._beyond(near)
        joint = int(np.argmax(beyond))
        if not beyond[joint] > 0:
            return ""
        side = "upper" if near[joint] > self.arm.upper[joint] else "lower"
        limit = np.degrees(getattr(self.arm, side)[joint])
        passed = f"would pass its {side} limit of {limit:.4g} deg by {np.degrees(beyond[joint]):.4g} deg"
        return f" With {self._redundancy} held, joint {joint + 1} {passed}."

    @property
    def _redundancy(self) -> str:
        """The redundant quantity, in words."""
        words = self.arm.redundancy.replace("_", " ")
        return f"the {words}" if words == "arm angle" else words

    def _beyond(self, q: Floats) -> Floats:
        """Return how far each joint of q violates its limits, rad; negative within them."""
        return np.maximum(self.arm.lower - q, q - self.arm.upper)

    def raise_for_status(self) -> None:
        """Raise `PathError` with the explanation, unless the path is ok."""
        if not self.ok:
            raise PathError(self.explain())

    def __repr__(self) -> str:
        state = "ok" if self.ok else f"fails at row {self.first_failure}"
        if self.certified:
            state = "certified"
        return f"<JointPath of {len(self)} pose{'s' * (len(self) != 1)}, {state}>"
