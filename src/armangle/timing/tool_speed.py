"""Places where a constant tool speed is impossible, and the reason."""

from __future__ import annotations

import numpy as np

from .._arrays import Floats
from .grid import Grid, corners
from .motion import RESTS, Motion, breaks, tool_derivatives
from .trajectory import SpeedLoss, Timing

HELD, HELD_WITH_JERK, HELD_ROWS = 1e-3, 1e-2, 4001
"""Relative accuracy of a constant tool speed; number of rows that are checked."""
STEADY = 1e-6
"""Largest relative change from row to row at other places."""


def speed_lost(
    path: Motion, g: Grid, tool_speed: float, velocity: Floats, acceleration: Floats, jump: Floats
) -> SpeedLoss | None:
    """Return the first place at which joints cannot keep the constant tool speed (m/s); None if they can.

    Ramps are not counted. The grid is evaluated at its points, and halfway between. `velocity`,
    `acceleration` and `jump` (7,) are bounds: rad/s, rad/s², and rad/s by which velocities may jump at a
    corner.
    """
    s = np.setdiff1d(np.union1d(g.s, 0.5 * (g.s[1:] + g.s[:-1])), breaks(path)[1:-1])
    first, second = tool_derivatives(path, s)
    speed = _path_speed(first, tool_speed)
    way = np.linalg.norm(first, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        change = -np.sum(first * second, axis=1) / way**2 * speed**2
        d = path.derivatives(s)
        needs_velocity = np.abs(d[:, 0]) * speed[:, None]
        needs_acceleration = np.abs(d[:, 1] * speed[:, None] ** 2 + d[:, 0] * change[:, None])
        inner = g.s[1:-1]
        at_corners = (
            np.abs(corners(g))[1:-1] * _path_speed(tool_derivatives(path, inner)[0], tool_speed)[:, None]
        )
        found = [
            _first(s, needs_velocity / velocity, "velocity"),
            _first(s, needs_acceleration / acceleration, "acceleration"),
            _first(inner, at_corners / jump, "corner"),
        ]
    return min((place for place in found if place is not None), key=lambda place: place.s, default=None)


def not_held(path: Motion, timing: Timing, tool_speed: float, share: float) -> SpeedLoss | None:
    """Return where a timing has another tool speed between its ramps; None if nowhere.

    It deviates if the tool is slower by more than this share of it. A ramp ends where the tool has reached
    the speed, and begins where it only slows down from then on.
    """
    s, speed, _ = timing.at(np.linspace(0.0, timing.duration, HELD_ROWS))
    tool = np.linalg.norm(tool_derivatives(path, s)[0], axis=1) * speed / tool_speed
    change = np.diff(tool)
    first = np.argmax(np.append(change < -STEADY, True) | (tool >= 1 - share))
    last = len(tool) - 1 - np.argmax(np.append(change[::-1] > STEADY, True) | (tool[::-1] >= 1 - share))
    gaps = np.flatnonzero(tool[first : last + 1] < 1 - share)
    return SpeedLoss(float(s[first + gaps[0]]), None, "ramps", np.inf) if len(gaps) else None


def _path_speed(first: Floats, tool_speed: float) -> Floats:
    """Return ds/dt for the tool speed, from p' (N, 3), m; infinite where the tool does not move with s."""
    way = np.linalg.norm(first, axis=1)
    return np.where(way > RESTS, tool_speed / np.maximum(way, RESTS), np.inf)


def _first(s: Floats, ratio: Floats, bound: str) -> SpeedLoss | None:
    """Return the first s at which a ratio (N, 7) exceeds 1, with the joint of the largest, or None."""
    known = np.where(np.isnan(ratio), 0.0, ratio)
    over = known.max(axis=1, initial=0.0) > 1 + 1e-9
    if not over.any():
        return None
    k = int(np.argmax(over))
    joint = int(np.argmax(known[k]))
    return SpeedLoss(float(s[k]), joint + 1, bound, float(known[k, joint]))
