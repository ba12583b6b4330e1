"""The curve behind a joint path: the arm angle as a function of s, kept as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .._arrays import Floats

_ORDERS = 3


class Placed(NamedTuple):
    """Rows of a curve at parameters s: joints, arm angle, pose, least limit margin, residual."""

    q: Floats
    psi: Floats
    pose: Floats
    margin: Floats
    residual: Floats


@dataclass(frozen=True, eq=False)
class Curve:
    """Segments of the path, stretches of the angle, the plane that it is measured from, and the branch.

    Parameters
    ----------
    segments, stretches, plane : ndarray
        As the core writes them.
    gc : int
        Global configuration 0..7, the same along the curve.
    """

    segments: Floats
    stretches: Floats
    plane: Floats
    gc: int

    @property
    def end(self) -> float:
        """The s where the curve ends: 1 for a whole path."""
        return float(self.stretches[-1, 1])

    @property
    def knots(self) -> Floats:
        """The s between which the curve is smooth, shape (k,)."""
        return np.append(self.stretches[:, 0], self.end)

    def at(self, core: Any, s: Floats) -> Placed:
        """Return the rows at s (N,), each up to `end`; `core` is the arm's."""
        n = len(s)
        rows = Placed(np.empty((n, 7)), np.empty(n), np.empty((n, 4, 4)), np.empty(n), np.empty(n))
        core.curve_at(self.segments, self.stretches, self.plane, self.gc, s, *rows)
        return rows

    def derivatives(self, core: Any, s: Floats) -> Floats:
        """Return q', q'', q''' with respect to s, shape (N, 3, 7)."""
        out = np.empty((len(s), _ORDERS, 7))
        core.curve_derivatives(self.segments, self.stretches, self.plane, self.gc, s, out)
        return out
