"""The grid of a timing: rising s, and the joints' derivatives on both sides of each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._arrays import JOINTS, Floats
from ..errors import PathError
from .motion import Motion, Part, breaks, just_before

SMOOTH, NOTHING = 1e-6, 1e-9
"""Shares of |q'| there, and of the largest of a path, by which rounding may make it jump without a corner."""

MANY = 1600
"""Number of intervals above which no more than `count` are added."""


class Grid(NamedTuple):
    """Derivatives of q at rising s (N + 1,), on both sides of each: after it and before it, (N + 1, 3, 7).

    `turns` is the mean contribution of dense corners to q'' between two points, (N, 7).
    """

    s: Floats
    after: Floats
    before: Floats
    turns: Floats

    def between(self, first: int, last: int) -> Grid:
        """Return the part between two points, without the sides beyond either."""
        after, before = self.after[first : last + 1].copy(), self.before[first : last + 1].copy()
        after[-1], before[0] = before[-1], after[0]
        return Grid(self.s[first : last + 1], after, before, self.turns[first:last])

    def with_dense(self, near: Floats) -> Grid:
        """Return the grid with corners closer to each other than `near`, an s for each, as curvature."""
        jump = corners(self)
        ends = np.union1d([0, len(self.s) - 1], np.flatnonzero(jump.any(axis=1)))
        apart = np.diff(self.s[ends])
        dense = apart < np.minimum(near[ends[:-1]], near[ends[1:]])
        mean = np.where(dense, 1 / (2 * apart), 0.0)[:, None] * (jump[ends[:-1]] + jump[ends[1:]])
        return self._replace(turns=np.repeat(mean, np.diff(ends), axis=0))


def grid(motion: Motion, count: int, least: int, more: Floats) -> Grid:
    """Return derivatives on at least `count` intervals over [0, 1], `least` between breaks, also at `more`.

    If that makes more than `MANY` intervals, there are fewer between breaks. Raises `PathError` if joints
    have no finite rate along the path at one of them.
    """
    ends = breaks(motion)
    least = min(least, max(1, MANY // (len(ends) - 1)))
    parts = np.maximum(least, np.ceil(np.diff(ends) * count)).astype(int)
    pieces = [np.linspace(a, b, k + 1)[:-1] for a, b, k in zip(ends[:-1], ends[1:], parts, strict=True)]
    s = np.union1d(np.append(np.concatenate(pieces), 1.0), more)
    after = motion.derivatives(s)
    before = after.copy()
    inner = np.isin(s, ends[1:-1])
    before[inner] = motion.derivatives(just_before(motion, s[inner]))
    endless = ~(np.isfinite(after) & np.isfinite(before)).all(axis=(1, 2))
    if endless.any():
        at = motion.s(s[endless])[0] if isinstance(motion, Part) else s[endless][0]
        raise PathError(
            f"no timing is found: at s = {at:g} joints have no finite speed along the path: the "
            "arm is singular there, stretched or folded, or has no solution between two rows. At an end "
            "of the path a large enough tolerance= rounds that; otherwise leave it out."
        )
    return Grid(s, after, before, np.zeros((len(s) - 1, JOINTS)))


def composed(d: Floats, first: Floats, second: Floats, third: Floats) -> Floats:
    """Return the derivatives (N, 3, 7) of q(s(r)) with respect to r, from those of q(s) and of s(r)."""
    d1, d2, d3 = d.transpose(1, 0, 2)
    r1, r2, r3 = first[:, None], second[:, None], third[:, None]
    return np.stack([d1 * r1, d2 * r1**2 + d1 * r2, d3 * r1**3 + 3 * d2 * r1 * r2 + d1 * r3], axis=1)


def corners(g: Grid) -> Floats:
    """Return the jump of q' at each grid point, (N + 1, 7); 0 if it is rounding alone."""
    after, before = g.after[:, 0], g.before[:, 0]
    rate = np.maximum(np.abs(after), np.abs(before)).max(axis=1, keepdims=True)
    return np.where(np.abs(after - before) > SMOOTH * rate + NOTHING * rate.max(), after - before, 0.0)
