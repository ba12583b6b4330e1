"""Joint motion between the rows of a path: curves over s."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import JOINTS, Floats, Ints
from .._values import by_content
from ..arm.arm import Arm
from ..arm.roll import Roll
from ..errors import needed

ORDERS = 3
RESTS = 1e-9
"""Rad: rows nearer than this are equal."""
REPEATS = 2e-5
"""rad: rows nearer than the last digit of a teach pendant, 0.001 degrees, count as equal ..."""
APART = 50
"""... where the rows beside them are so many times as far apart."""
_LOOKS = 9  # samples between two rows of different branches
_ELBOW = 2  # of a branch's bits
_ROUND = 0.5  # rad: a joint that deviates more from the straight line between rows turns around
_SHIFT = 8  # numbers of a shift: its start and end, and six coefficients


class Placed(NamedTuple):
    """Rows of a curve at parameters s: joints, arm angle, branch, pose, limit margin, residual."""

    q: Floats
    psi: Floats
    gc: Floats
    pose: Floats
    margin: Floats
    residual: Floats

    @classmethod
    def empty(cls, n: int) -> Placed:
        """Return n rows of memory that is not set."""
        return cls(*(np.empty((n, *shape)) for shape in ((JOINTS,), (), (), (4, 4), (), ())))


@by_content
@dataclass(frozen=True, eq=False)
class Curve:
    """Segments of the path, stretches of the angle, the plane of its zero, and the branch.

    `segments`, `stretches` and `plane` are in the core's format. `gc` is the global configuration at its
    start; it changes where the curve passes θ2 = 0 or θ6 = 0. `roll` "free": joint 7 is constant, and poses
    have any roll about axis 7. For a true chain, `shifts` are corrections of a leading joint, in the core's
    format, and `base` (4, 4), m, is that of its nominal arm, if not the arm's own.
    """

    segments: Floats
    stretches: Floats
    plane: Floats
    gc: int
    roll: Roll = "pose"
    shifts: Floats = field(default_factory=lambda: np.empty((0, _SHIFT)))
    base: Floats | None = None
    leads_the_tool = False

    @property
    def end(self) -> float:
        """The s where the curve ends: 1 for a whole path."""
        return float(self.stretches[-1, 1])

    @property
    def knots(self) -> Floats:
        """The s between which the curve is smooth, shape (k,)."""
        return np.append(self.stretches[:, 0], self.end)

    def at(self, handle: _core.Arm, s: Floats) -> Placed:
        """Return the rows at s (N,), each up to `end`; `handle` is the arm's."""
        rows = Placed.empty(len(s))
        handle.curve_at(*self._columns, s, *rows)
        return rows

    def derivatives(self, handle: _core.Arm, s: Floats) -> Floats:
        """Return q', q'', q''' with respect to s, shape (N, 3, 7)."""
        out = np.empty((len(s), ORDERS, JOINTS))
        handle.curve_derivatives(*self._columns, s, out)
        return out

    @property
    def _columns(self) -> tuple[Floats, Floats, Floats, int, bool, Floats, Floats | None]:
        """The numbers of the curve in the core's order."""
        free = self.roll == "free"
        return self.segments, self.stretches, self.plane, self.gc, free, self.shifts, self.base


class _Rows:
    """What curves through rows share: they are smooth between rows."""

    s: Floats
    end = 1.0

    @property
    def knots(self) -> Floats:
        """The s between which the curve is smooth, shape (n,)."""
        return self.s


@by_content
@dataclass(frozen=True, eq=False)
class OffsetCurve(_Rows):
    """Rows of an arm with an offset wrist or shoulder: the free joint is linear between two rows.

    `segments` are in the core's format. `s` and `free` (n,), n >= 2: the rows' parameters, and the free
    joint's values there, rad, continuous; `q` (n, 7), rad; `gc` of the first row.
    """

    segments: Floats
    s: Floats
    free: Floats
    q: Floats
    gc: int
    leads_the_tool = False

    def at(self, handle: Any, s: Floats) -> Placed:
        """Return the rows at s (N,); `handle` is the arm's."""
        rows = Placed.empty(len(s))
        handle.rows_at(*self._columns, s, *rows)
        return rows

    def derivatives(self, handle: Any, s: Floats) -> Floats:
        """Return q', q'', q''' with respect to s, shape (N, 3, 7)."""
        out = np.empty((len(s), ORDERS, JOINTS))
        handle.rows_derivatives(*self._columns, s, out)
        return out

    def torn(self, handle: Any, gc: Ints) -> int:
        """Return the index of the first row from which no motion leads to the next row; -1 if all are
        connected. `gc` (n,) are the branches of the rows.

        Branches meet at θ2 = 0 and at a fold, which joints pass in a straight line; not at the elbow.
        """
        over = np.flatnonzero(np.diff(gc))
        share = np.linspace(0.0, 1.0, _LOOKS + 2)[1:-1]
        for row in over.tolist():
            s = self.s[row] + (self.s[row + 1] - self.s[row]) * share
            straight = self.q[row] + (self.q[row + 1] - self.q[row]) * share[:, None]
            off = np.abs(self.at(handle, s).q - straight).max()
            if (gc[row] ^ gc[row + 1]) & _ELBOW or not off <= _ROUND:
                return row
        return -1

    @property
    def _columns(self) -> tuple[Floats, Floats, Floats, Floats]:
        """The numbers of the curve in the core's order."""
        return self.segments, self.s, self.free, self.q


@dataclass(frozen=True, eq=False)
class _JointRows(_Rows):
    """Rows of joints that determine the path of the end effector.

    `s` (n,), n >= 2, rises from 0 to 1; `q` (n, 7), rad; `gc` of the first row; `segments`, straight lines
    from pose to pose of the rows: the end effector itself follows the joints.
    """

    arm: Arm
    s: Floats
    q: Floats
    gc: int
    segments: Floats
    leads_the_tool = True

    def joints(self, s: Floats) -> Floats:
        """Return joints at s (N,), (N, 7) rad."""
        raise NotImplementedError

    def at(self, handle: Any, s: Floats) -> Placed:
        """Return the rows at s (N,); psi is in (-π, π], NaN if it does not exist."""
        q = self.joints(s)
        pose, psi, gc = self.arm.forward(q, on_error="nan")
        margin = np.asarray(self.arm.limit_margin(q))
        return Placed(q, np.asarray(psi), np.asarray(gc, dtype=np.float64), pose, margin, np.zeros(len(q)))

    def _row(self, s: Floats) -> Ints:
        """Return the index of the row at or before each s; at the end, of the last but one."""
        return np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 2)


@by_content
@dataclass(frozen=True, eq=False)
class JointLines(_JointRows):
    """Rows of joints with linear joint motion between them."""

    def joints(self, s: Floats) -> Floats:
        """Return joints at s (N,), (N, 7) rad."""
        return np.stack([np.interp(s, self.s, joint) for joint in self.q.T], axis=-1)

    def derivatives(self, handle: Any, s: Floats) -> Floats:
        """Return q', q'', q''' with respect to s, shape (N, 3, 7); at a row, of the next piece."""
        row = self._row(s)
        out = np.zeros((len(s), ORDERS, JOINTS))
        out[:, 0] = np.diff(self.q, axis=0)[row] / np.diff(self.s)[row, None]
        return out


@by_content
@dataclass(frozen=True, eq=False)
class JointSpline(_JointRows):
    """A cubic spline through rows of joints: twice differentiable, but where joints begin or end a rest.

    `rests`: whether joints rest where rows repeat; otherwise such rows are like others. `slopes` (7,) are q'
    at the ends; None: "not a knot" there.
    """

    rests: bool = False
    slopes: tuple[Floats | None, Floats | None] = (None, None)

    @cached_property
    def moving(self) -> Ints:
        """Indices of the rows through which the spline passes: not those that repeat the row before."""
        repeats = repeated(self.q) if self.rests else np.zeros(len(self.q) - 1, dtype=bool)
        return np.arange(len(self.q)) if repeats.all() else np.append(0, np.flatnonzero(~repeats) + 1)

    @cached_property
    def own(self) -> Floats:
        """The spline's parameter at each row, (n,): s without the parts in which the joints rest."""
        moves = np.isin(np.arange(1, len(self.s)), self.moving)
        return np.append(0.0, np.cumsum(np.diff(self.s) * moves))

    @cached_property
    def spline(self) -> Any:
        """The spline of SciPy, a function of `own`."""
        interpolate = needed("scipy.interpolate", "a spline through joints needs", "time")
        ends = tuple("not-a-knot" if slope is None else (1, slope) for slope in self.slopes)
        return interpolate.CubicSpline(self.own[self.moving], self.q[self.moving], bc_type=ends)

    def joints(self, s: Floats) -> Floats:
        """Return joints at s (N,), (N, 7) rad."""
        return np.asarray(self.spline(np.interp(s, self.s, self.own)))

    def derivatives(self, handle: Any, s: Floats) -> Floats:
        """Return q', q'', q''' with respect to s, shape (N, 3, 7); at a row, of the next piece."""
        own = np.interp(s, self.s, self.own)
        moves = (np.diff(self.own) > 0)[self._row(s), None, None]
        return np.where(moves, np.stack([self.spline(own, order) for order in (1, 2, 3)], axis=1), 0.0)

    def passed(self, lower: Floats, upper: Floats) -> Floats:
        """Return for each piece and joint by how much (rad) the spline exceeds a limit at most; 0 within."""
        a, b, c, _ = self.spline.c
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(b * b - 3 * a * c)
            turns = np.stack([(-b - root) / (3 * a), (-b + root) / (3 * a), -c / (2 * b)])
        at = np.clip(np.nan_to_num(turns), 0.0, np.diff(self.spline.x)[:, None])
        q = self.spline.c[3] + at * (c + at * (b + at * a))
        return np.asarray(np.maximum(np.maximum(lower - q, q - upper).max(axis=0), 0.0))


def repeated(q: Floats) -> NDArray[np.bool_]:
    """Return which rows of joints (n, 7) are equal to the row before except for noise, (n - 1,)."""
    steps = np.abs(np.diff(q, axis=0)).max(axis=1, initial=0.0)
    beside = np.pad(steps, 1, constant_values=np.inf)
    small = np.minimum(beside[:-2], beside[2:]) >= APART * steps  # next to longer ones
    found = np.asarray((steps <= RESTS) | ((steps <= REPEATS) & small))
    edges = np.diff((beside <= REPEATS).astype(int))  # several in a row count as one
    for first, last in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        way = steps[first:last].sum()
        found[first:last] |= way <= REPEATS and min(beside[first], beside[last + 1]) >= APART * way
    return found


class AnyCurve(Protocol):
    """Joint motion along s: one of the curves above, or several in sequence."""

    @property
    def segments(self) -> Floats:
        """The path of the end effector."""

    @property
    def gc(self) -> int:
        """Global configuration at the start."""

    @property
    def end(self) -> float:
        """The s where it ends."""

    @property
    def knots(self) -> Floats:
        """The s between which it is smooth."""

    @property
    def leads_the_tool(self) -> bool:
        """Whether the joints determine the path of the end effector, or the path determines the joints."""

    def at(self, handle: Any, s: Floats) -> Placed:
        """Return the rows at s (N,)."""

    def derivatives(self, handle: Any, s: Floats) -> Floats:
        """Return q', q'', q''' with respect to s, shape (N, 3, 7)."""
