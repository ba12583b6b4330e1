"""The fastest s(t) for linear joint motion: velocity, acceleration and jerk bounded, in closed form.

Seven parts, of jerk j, 0, -j, 0, -j, 0, j; some may take no time. v is the largest speed, reached with
acceleration a or before that. One ramp takes v / a + a / j or 2 √(v / j), and covers v / 2 times that.

Source: Biagiotti and Melchiorri (2008), Trajectory Planning for Automatic Machines and Robots, 3.4.
"""

from __future__ import annotations

import numpy as np

from .._arrays import Floats
from .grid import Grid
from .trajectory import Timing, of_jerks

SAME = 1e-9
"""Relative difference of derivatives and speeds on a straight line due to rounding."""
SLOWEST = 1e-12
"""Least move of a joint over s that counts, rad, so that without motion the time is tiny."""
_SIGNS = np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])


def is_straight(g: Grid, most: Floats) -> bool:
    """Return whether every joint is linear in s and the bound `most` on ds/dt is the same all along."""
    slope = g.after[:, 0]
    even = np.abs(slope - slope[0]).max() <= SAME * np.abs(slope[0]).max()
    way = (g.s[-1] - g.s[0]) ** np.arange(1, 3)[:, None]
    bends = np.abs(np.stack([g.after, g.before])[:, :, 1:] * way).max() > SAME * np.abs(slope[0]).max()
    one = most[1:-1].max(initial=most[0]) <= (1 + SAME) * most[1:-1].min(initial=most[0])
    return bool(even and one and not bends)


def straight(g: Grid, acceleration: Floats, jerk: Floats, most: Floats) -> Timing:
    """Return the fastest timing from rest to rest of a motion that `is_straight`.

    `acceleration` and `jerk` (7,) are bounds of the joints, rad/s², rad/s³; `most` (N + 1,) is the largest
    ds/dt at each s, 1/s.
    """
    way = float(g.s[-1] - g.s[0])
    rate = np.maximum(np.abs(g.after[0, 0]), SLOWEST)
    a = float((acceleration / rate).min())
    j = float((jerk / rate).min())
    v = min(float(most[1:-1].min(initial=most[0])), _peak(way, a, j))
    bend = min(a / j, np.sqrt(v / j))
    hold = max(v / a - a / j, 0.0)
    cruise = max(way / v - (2 * bend + hold), 0.0)
    return of_jerks(float(g.s[0]), np.array([bend, hold, bend, cruise, bend, hold, bend]), j * _SIGNS)


def _peak(way: float, a: float, j: float) -> float:
    """Return the speed reached from rest over half the distance `way`, at most acceleration a and jerk j."""
    ramp = a / j
    v = a / 2 * (np.sqrt(ramp**2 + 4 * way / a) - ramp)
    return float(v if v * j >= a**2 else np.cbrt((way / 2) ** 2 * j))
