"""A joint path as what timing sees: joints and tool over s, their derivatives, and where these jump."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats
from ..arm.arm import Arm

RESTS = 1e-9
"""The tool rests where it moves by less per unit of s, m."""
CLOSE = 1e-9
"""Breaks nearer to the next one than this are that one."""
SMOOTH = 1e-6
"""Share of the greatest |q'| of a path by which it may jump at a break that is no corner: rounding."""


@runtime_checkable
class Motion(Protocol):
    """What is timed: a `JointPath`, or anything that gives q and its derivatives over s in [0, 1]."""

    @property
    def arm(self) -> Arm:
        """The arm that moves."""

    @property
    def path(self) -> Any:
        """Where the tool goes, a `Path`; None where it goes straight from pose to pose."""

    def at(self, s: ArrayLike, /) -> Any:
        """Return a value with the field q, (..., 7) rad."""

    def derivatives(self, s: ArrayLike, /) -> Floats:
        """Return q', q'', q''' with respect to s, (..., 3, 7)."""


class Grid(NamedTuple):
    """Derivatives of q at rising s (N + 1,), on both sides of each: after it and before it, (N + 1, 3, 7)."""

    s: Floats
    after: Floats
    before: Floats

    def between(self, first: int, last: int) -> Grid:
        """Return the part from one point to another, without what lies beyond either."""
        after, before = self.after[first : last + 1].copy(), self.before[first : last + 1].copy()
        after[-1], before[0] = before[-1], after[0]
        return Grid(self.s[first : last + 1], after, before)


def breaks(motion: Motion) -> Floats:
    """Return the s where derivatives of q may jump, 0 and 1 among them."""
    rows: Any = motion
    if hasattr(motion, "breaks"):
        return np.asarray(rows.breaks)
    path = motion.path.breaks if motion.path is not None else rows.s
    curve = getattr(motion, "curve", None)
    knots = curve.knots if curve is not None else np.empty(0)
    ends = np.unique(np.concatenate([[0.0, 1.0], path, knots]))
    apart = np.append(np.diff(ends) > CLOSE, True)
    apart[0] = True
    return np.asarray(ends[apart])


def grid(motion: Motion, count: int, least: int, more: Floats) -> Grid:
    """Return at least `count` intervals over [0, 1], `least` or more between breaks, and ends at `more`."""
    ends = breaks(motion)
    parts = np.maximum(least, np.ceil(np.diff(ends) * count)).astype(int)
    pieces = [np.linspace(a, b, k + 1)[:-1] for a, b, k in zip(ends[:-1], ends[1:], parts, strict=True)]
    s = np.union1d(np.append(np.concatenate(pieces), 1.0), more)
    after = motion.derivatives(s)
    before = after.copy()
    inner = np.isin(s, ends[1:-1])
    before[inner] = motion.derivatives(np.nextafter(s[inner], 0.0))
    return Grid(s, after, before)


def composed(d: Floats, first: Floats, second: Floats, third: Floats) -> Floats:
    """Return the derivatives (N, 3, 7) of q(s(r)) from those of q(s), and s', s'', s''' (N,)."""
    d1, d2, d3 = d.transpose(1, 0, 2)
    r1, r2, r3 = first[:, None], second[:, None], third[:, None]
    return np.stack([d1 * r1, d2 * r1**2 + d1 * r2, d3 * r1**3 + 3 * d2 * r1 * r2 + d1 * r3], axis=1)


def corners(g: Grid) -> Floats:
    """Return |q' after - q' before|, (N + 1, 7), with 0 where the two differ by rounding."""
    jump = np.abs(g.after[:, 0] - g.before[:, 0])
    return np.where(jump > SMOOTH * np.abs(g.after[:, 0]).max(), jump, 0.0)


def tool_derivatives(motion: Motion, s: Floats) -> tuple[Floats, Floats]:
    """Return p' and p'' of the tool's origin, m per unit of s and of its square, (N, 3) each."""
    rows: Any = motion
    if hasattr(motion, "tool_derivatives"):
        first, second = rows.tool_derivatives(s)
        return first, second
    if motion.path is not None:
        first, second = (np.asarray(motion.path.derivative(s, order))[:, :3] for order in (1, 2))
        return first, second
    if len(rows.s) == 1:
        return np.zeros((len(s), 3)), np.zeros((len(s), 3))
    piece = np.clip(np.searchsorted(rows.s, s, side="right") - 1, 0, len(rows.s) - 2)
    step = np.diff(rows.poses[:, :3, 3], axis=0) / np.diff(rows.s)[:, None]
    return step[piece], np.zeros((len(s), 3))
