"""Timing with bounded jerk by ruckig: one profile of s from rest to rest."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arrays import Floats
from .by_toppra import needed
from .grid import Grid
from .trajectory import Timing

SHARES = np.linspace(0.05, 1.0, 20)
"""Shares of the greatest speed that are tried: a slower cruise leaves more of the other bounds."""


def _profile(length: float, speed: float, acceleration: float, jerk: float) -> Any:
    ruckig = needed("ruckig")
    asked = ruckig.InputParameter(1)
    asked.current_position, asked.target_position = [0.0], [length]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = [speed], [acceleration], [jerk]
    found = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(asked, found)
    return found.profiles[0][0]


def _best_bounds(
    d: Floats, velocity: Floats, acceleration: Floats, jerk: Floats, cap: float, length: float
) -> tuple[float, float, float]:
    """Return bounds on speed, acceleration and jerk of s under which the joints keep theirs, of 400 the best.

    With d = |q'|, |q''|, |q'''| at all points: d1 V <= v, d2 V² + d1 A <= a, d3 V³ + 3 d2 V A + d1 J <= j.
    """
    d1, d2, d3 = np.maximum(d, 1e-12).transpose(1, 0, 2)
    fastest = min(cap, *(np.min(x) for x in (velocity / d1, np.sqrt(acceleration / d2), np.cbrt(jerk / d3))))
    best, bounds = np.inf, (fastest, np.inf, np.inf)
    for v in fastest * SHARES * (1 - 1e-9):
        hardest = float(np.min((acceleration - d2 * v**2) / d1))
        left, taken = (jerk - d3 * v**3) / d1, 3 * v * d2 / d1
        for a in hardest * SHARES:
            j = float(np.min(left - taken * a))
            if a <= 0 or j <= 0:
                continue
            duration = _rest_to_rest(length, v, a, j)
            if duration < best:
                best, bounds = duration, (v, a, j)
    return bounds


def _rest_to_rest(length: float, v: float, a: float, j: float) -> float:
    """Return the least time from rest to rest over `length` with bounded speed, acceleration and jerk."""
    a = min(a, np.sqrt(v * j))
    ramp = v / a + a / j
    if v * ramp <= length:
        return float(length / v + ramp)
    if 2 * a**3 / j**2 >= length:
        return float(4 * np.cbrt(length / (2 * j)))
    peak = 0.5 * (np.sqrt(a**4 / j**2 + 4 * a * length) - a**2 / j)
    return float(2 * (peak / a + a / j))


def smooth(g: Grid, velocity: Floats, acceleration: Floats, jerk: Floats, cap: float) -> Timing:
    """Return a timing from rest to rest, without a stop between, that keeps joint bounds at the grid points.

    Parameters
    ----------
    g : Grid
        s and the derivatives of q.
    velocity, acceleration, jerk : ndarray, shape (7,)
        rad/s, rad/s², rad/s³.
    cap : float
        Greatest ds/dt, 1/s.

    Raises
    ------
    MissingExtraError
    """
    sides = np.abs(np.concatenate([g.after, g.before]))
    length = float(g.s[-1] - g.s[0])
    bounds = _best_bounds(sides, velocity, acceleration, jerk, cap, length)
    return _timing(_profile(length, *bounds), float(g.s[0]))


def _timing(profile: Any, begin: float) -> Timing:
    phase = np.array(profile.t) > 0
    t = np.concatenate([[0.0], np.cumsum(profile.t)])
    p, v, a = (np.array(x)[:-1][phase] for x in (profile.p, profile.v, profile.a))
    return Timing(np.append(t[:-1][phase], t[-1]), p + begin, v, a, np.array(profile.j)[phase])
