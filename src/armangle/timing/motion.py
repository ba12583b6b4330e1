"""The timing's view of a motion: joints and end effector over s, their derivatives, and their jumps."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats
from .._values import by_content
from ..arm.arm import Arm

RESTS = 1e-9
"""The end effector rests if it moves by less per unit of s, m."""
STEP = 1e-6
"""Step of a difference, in s."""
BESIDE = 1e-6
"""Distance from an end, in s, within which joints without a finite rate count as at it."""
AT_END = 1e-3
"""Distance from an end, in s, within which an unproven range belongs to it."""
CLOSE = 1e-9
"""Breaks closer than this count as one."""


@runtime_checkable
class Motion(Protocol):
    """What can be timed: a `JointPath`, or any object with q and its derivatives over s in [0, 1]."""

    @property
    def arm(self) -> Arm:
        """The arm that moves."""

    @property
    def path(self) -> Any:
        """The end effector's `Path`; None if it is straight from pose to pose."""

    def at(self, s: ArrayLike, /) -> Any:
        """Return a value with the field q, (..., 7) rad."""

    def derivatives(self, s: ArrayLike, /) -> Floats:
        """Return q', q'', q''' with respect to s, (..., 3, 7)."""


def breaks(motion: Motion) -> Floats:
    """Return the s at which derivatives of q may jump, with 0 and 1; of several close ones only the last."""
    return _close_breaks(motion)[1]


def just_before(motion: Motion, s: Floats) -> Floats:
    """Return the s just below each given one; below the whole group for one in a group of close breaks."""
    first, last = _close_breaks(motion)
    k = np.minimum(np.searchsorted(last, s), len(last) - 1)
    return np.nextafter(np.where(last[k] == s, first[k], s), 0.0)


def _close_breaks(motion: Motion) -> tuple[Floats, Floats]:
    """Return the first and the last of every run of close breaks."""
    rows: Any = motion
    if hasattr(motion, "breaks"):
        return np.asarray(rows.breaks), np.asarray(rows.breaks)
    path = motion.path.breaks if motion.path is not None else rows.s
    curve = getattr(motion, "_drawn", None)
    knots = curve.knots if curve is not None else np.empty(0)
    ends = np.unique(np.concatenate([[0.0, 1.0], path, knots]))
    apart = np.diff(ends) > CLOSE
    first, last = ends[np.append(True, apart)], ends[np.append(apart, True)]
    first[0], last[0] = 0.0, 0.0
    return first, last


def steep_ends(motion: Motion) -> tuple[bool, bool]:
    """Return whether dq/ds is infinite or unproven at the start, and at the end.

    Also if no rate is proven: near an end where branches meet a plan may be uncertified, and jump.
    """
    every = breaks(motion)
    near = (every[every <= BESIDE], every[every >= 1.0 - BESIDE])
    first, last = (bool(np.isfinite(motion.derivatives(s)).all()) for s in near)
    begin, end = beside_ends(motion)
    return not first or begin > 0, not last or end > 0


def beside_ends(motion: Motion) -> tuple[float, float]:
    """Return the unproven lengths of s at the start and at the end of a path, 0 if all is proven."""
    open_ = unproven_ends(motion)
    at_end = open_[:, 0] > AT_END
    return float(open_[~at_end, 1].max(initial=0.0)), float((1.0 - open_[at_end, 0]).max(initial=0.0))


def unproven_ends(motion: Motion) -> Floats:
    """Return the unproven ranges of s, (K, 2), that lie within `AT_END` of an end of the path."""
    open_ = np.reshape(getattr(motion, "uncertified", np.empty((0, 2))), (-1, 2))
    return np.asarray(open_[(open_[:, 1] <= AT_END) | (open_[:, 0] >= 1.0 - AT_END)])


@by_content
class Part:
    """The part of a motion from s = `first` to s = `last`, as a motion over r in [0, 1]."""

    def __init__(self, whole: Motion, first: float, last: float) -> None:
        """Take the part of a motion from s = `first` to `last`."""
        self.whole, self.first, self.last = whole, first, last
        self._end = float(just_before(whole, np.array([last]))[0])
        every = breaks(whole)
        inner = every[(every > first) & (every < last)]
        self.breaks = np.concatenate([[0.0], (inner - first) / self._width, [1.0]])

    @property
    def arm(self) -> Arm:
        """The arm that moves."""
        return self.whole.arm

    @property
    def path(self) -> Any:
        """The path of the whole motion."""
        return self.whole.path

    def at(self, s: ArrayLike, /) -> Any:
        """Return a value with the field q, (..., 7) rad."""
        return self.whole.at(self.s(np.asarray(s)))

    def derivatives(self, s: ArrayLike, /) -> Floats:
        """Return q', q'', q''' with respect to r, (..., 3, 7); at the end those from before it."""
        inside = np.minimum(self.s(np.asarray(s)), self._end)
        return self.whole.derivatives(inside) * self._width ** np.arange(1, 4)[:, None]

    def tool_derivatives(self, s: Floats) -> tuple[Floats, Floats]:
        """Return p' (m) and p'' (m) of the end effector's position with respect to r."""
        first, second = tool_derivatives(self.whole, np.minimum(self.s(s), self._end))
        return first * self._width, second * self._width**2

    def s(self, r: Floats) -> Floats:
        """Return the s of the whole at r: linear, at most `last`."""
        return np.minimum(self.first + self._width * r, self.last)

    @property
    def _width(self) -> float:
        """The length of the part in s."""
        return self.last - self.first


def _joints_lead(motion: Motion) -> bool:
    """Return whether the motion is given by its joints, so that the end effector follows from them."""
    curve: Any = getattr(motion, "curve", motion)
    return curve is not None and curve.leads_the_tool is True


def _where_joints_lead(motion: Motion, s: Floats) -> tuple[Floats, Floats]:
    """Return p' and p'' of the end effector (N, 3), m, from the Jacobian J: J q' and J q'' + J' q'."""
    q, d = motion.at(s).q, motion.derivatives(s)
    slope, bend = d[:, 0], d[:, 1, :, None]
    before, here, after = (motion.arm.jacobian(q + step * slope)[:, :3] for step in (-STEP, 0.0, STEP))
    first, turned = here @ slope[..., None], (after - before) / (2 * STEP) @ slope[..., None]
    return first[..., 0], (here @ bend + turned)[..., 0]


def tool_derivatives(motion: Motion, s: Floats) -> tuple[Floats, Floats]:
    """Return p' and p'' of the end effector's origin, m per unit of s and of its square, (N, 3) each."""
    rows: Any = motion
    if isinstance(motion, Part):
        return motion.tool_derivatives(s)
    if _joints_lead(motion):
        return _where_joints_lead(motion, s)
    if motion.path is not None:
        first, second = (np.asarray(motion.path.derivative(s, order))[:, :3] for order in (1, 2))
        return first, second
    if len(rows.s) == 1:
        return np.zeros((len(s), 3)), np.zeros((len(s), 3))
    piece = np.clip(np.searchsorted(rows.s, s, side="right") - 1, 0, len(rows.s) - 2)
    step = np.diff(rows.poses[:, :3, 3], axis=0) / np.diff(rows.s)[:, None]
    return step[piece], np.zeros((len(s), 3))
