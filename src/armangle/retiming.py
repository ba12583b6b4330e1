"""Times for a joint path: as fast as joint bounds allow, always on the Cartesian path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ._along import Grid, Motion, breaks, corners, grid, tool_derivatives
from ._arrays import Floats, as_number
from ._bounds import Bound, joint_bound
from ._ruckig import smooth
from ._timing import Timing, joined
from ._toppra import fastest
from .errors import InputError
from .joint_path import JointPath
from .trajectory import SpeedLoss, Trajectory, sampled

GRID = 400
CYCLE = 1e-3
LEAST_BETWEEN_CORNERS = 4
FINER, MOST_FINER = 2, 4
OVER = 1.01
"""Where bounds are exceeded between grid points by more than this, the grid is made finer."""
CHECKED = 4000
HELD, HELD_ROWS = 1e-3, 4001
"""A tool speed is held within this share of it; rows at which that is looked at."""
_MOST_SPEED = 1e6
_SLOWEST = 1e-12


class _Bounds(NamedTuple):
    velocity: Floats
    acceleration: Floats
    jerk: Floats | None
    tool_speed: float | None
    cycle: float


def retime(
    path: Motion,
    *,
    velocity: Bound = True,
    acceleration: Bound = True,
    jerk: ArrayLike | None = None,
    tool_speed: float | None = None,
    cycle: float = CYCLE,
    sample: float = 0.01,
) -> Trajectory:
    """Return a trajectory along a joint path that keeps joint velocities and accelerations, rest to rest.

    Every posture lies on the Cartesian path: only s(t) is chosen. Without `jerk` it is time-optimal (toppra,
    from dq/ds and d²q/ds² in closed form; never a spline through samples). With `jerk` ruckig times s alone,
    under bounds on s that follow from the derivatives of q: safe, not optimal.

    Bounds hold at 400 points of the path or more, by toppra or by the bounds on s; they are looked at between
    as well, at 4000 times or more, and the whole motion is slowed down by what they are exceeded there.

    At a corner of the path, as between given poses, the joints' velocities would have to jump; the motion
    stops there, or slows down until the jump is one that the joints can make within a `cycle`.

    Parameters
    ----------
    path : JointPath
        From `plan` or `follow`; it must be ok.
    velocity, acceleration : array_like, shape (7,), or True
        Bounds, rad/s and rad/s², > 0; True: the arm's own. Infinite: none.
    jerk : array_like, shape (7,), optional
        Bounds, rad/s³, > 0.
    tool_speed : float, optional
        Constant speed of the tool's origin, m/s, > 0, between a ramp at either end. Where joints cannot
        follow, the tool slows down; ``speed_lost`` of the result says where first, and why.
    cycle : float
        Time within which a joint's velocity may jump by what its acceleration allows, s: the controller's
        cycle, 1 ms by default. 0: the motion stops at every corner. With `jerk` it always does.
    sample : float
        Time between the rows of the result, s, > 0.

    Returns
    -------
    Trajectory
        Fields ``t, s, q, qd, qdd``, and ``at(t)`` for any time.

    Raises
    ------
    PathError
        If the path is not ok, or no timing keeps the bounds.
    MissingExtraError
        Without toppra (ruckig for `jerk`): pip install 'armangle[time]'.
    InputError, ShapeError, NotFiniteError
        If a number is out of range, or the arm states no velocity or acceleration.

    Source: Pham and Pham (2018), TOPP-RA; Berscheid and Kröger (2021), ruckig.
    """
    bounds = _checked(path, velocity, acceleration, jerk, tool_speed, cycle)
    step = as_number("sample", sample, 0.0, _MOST_SPEED, low_open=True)
    count = GRID
    for _ in range(MOST_FINER):
        g = grid(path, count, LEAST_BETWEEN_CORNERS)
        timing, over = _timed(path, g, bounds)
        if over <= OVER:
            break
        count *= FINER
    timing = timing.slower(over if bounds.jerk is not None else max(over, 1.0))
    lost = None
    if bounds.tool_speed is not None:
        lost = _speed_lost(path, g, bounds, bounds.tool_speed) or _not_held(path, timing, bounds.tool_speed)
    return sampled(path, timing, step, bounds.tool_speed, lost)


def _checked(
    path: Motion, velocity: Bound, acceleration: Bound, jerk: ArrayLike | None, tool_speed: float | None,
    cycle: float,
) -> _Bounds:  # fmt: skip
    if not isinstance(path, Motion):
        raise InputError(f"path is {path!r:.100}, wanted a JointPath")
    if isinstance(path, JointPath):
        path.raise_for_status()
    v = joint_bound(path.arm, "velocity", velocity, path.arm.velocity)
    a = joint_bound(path.arm, "acceleration", acceleration, path.arm.acceleration)
    if np.isinf(a).any():
        raise InputError(
            "a timing needs a bound on the acceleration of every joint: acceleration=(7,) in rad/s²"
        )
    j = None if jerk is None else joint_bound(path.arm, "jerk", jerk, np.full(7, np.inf))
    speed = None
    if tool_speed is not None:
        speed = as_number("tool_speed", tool_speed, 0.0, _MOST_SPEED, low_open=True)
    return _Bounds(v, a, j, speed, as_number("cycle", cycle, 0.0, 1.0))


def _timed(path: Motion, g: Grid, b: _Bounds) -> tuple[Timing, float]:
    """Return a timing, and by what factor in time it breaks the bounds between the grid points."""
    jump = corners(g)
    with np.errstate(divide="ignore", invalid="ignore"):
        within = np.where(jump > 0, b.acceleration * b.cycle / jump, np.inf).min(axis=1)
    if b.jerk is not None:
        within[np.isfinite(within)] = 0.0
    caps = np.minimum(_speed_caps(path, g, b), within)
    stops = np.union1d([0, len(g.s) - 1], np.flatnonzero(caps == 0))
    pieces = []
    for first, last in zip(stops[:-1].tolist(), stops[1:].tolist(), strict=True):
        part, most = g.between(first, last), caps[first : last + 1].copy()
        most[[0, -1]] = np.where(most[[0, -1]] > 0, most[[0, -1]], most[1:-1].max())
        if b.jerk is None:
            pieces.append(fastest(part, b.acceleration, most))
        else:
            pieces.append(smooth(part, b.velocity, b.acceleration, b.jerk, float(most.min())))
    timing = joined(pieces)
    return timing, _excess(path, timing, b)


def _speed_caps(path: Motion, g: Grid, b: _Bounds) -> Floats:
    """Return the greatest ds/dt at every grid point that velocities and the tool's speed allow, (N + 1,)."""
    fastest_joint = np.maximum(np.abs(g.after[:, 0]), np.abs(g.before[:, 0]))
    with np.errstate(divide="ignore"):
        caps = np.min(b.velocity / np.maximum(fastest_joint, _SLOWEST), axis=1)
    if b.tool_speed is not None:
        way = [np.linalg.norm(tool_derivatives(path, s)[0], axis=1) for s in (g.s, np.nextafter(g.s, 0.0))]
        caps = np.minimum(caps, b.tool_speed / np.maximum(np.maximum(*way), _SLOWEST))
    return np.asarray(caps)


def _excess(path: Motion, timing: Timing, b: _Bounds) -> float:
    """Return the factor by which time has to be stretched for the bounds to hold inside the pieces too."""
    inside = np.array([0.02, 0.25, 0.5, 0.75, 0.98])
    t = (timing.t[:-1, None] + np.diff(timing.t)[:, None] * inside).reshape(-1)
    t = np.union1d(t, (np.arange(CHECKED) + 0.5) * (timing.duration / CHECKED))
    s, speed, acceleration = timing.at(t)
    d = path.derivatives(s)
    speed, acceleration = speed[:, None], acceleration[:, None]
    qd, qdd = d[:, 0] * speed, d[:, 1] * speed**2 + d[:, 0] * acceleration
    factor = max(np.max(np.abs(qd) / b.velocity), np.sqrt(np.max(np.abs(qdd) / b.acceleration)))
    if b.jerk is not None:
        jolt = timing.jerk_at(t)[:, None]
        qddd = d[:, 2] * speed**3 + 3 * d[:, 1] * speed * acceleration + d[:, 0] * jolt
        factor = max(factor, np.cbrt(np.max(np.abs(qddd) / b.jerk)))
    if b.tool_speed is not None:
        way = np.linalg.norm(tool_derivatives(path, s)[0], axis=1)
        factor = max(factor, np.max(way * speed[:, 0]) / b.tool_speed)
    return float(factor)


def _speed_lost(path: Motion, g: Grid, b: _Bounds, tool_speed: float) -> SpeedLoss | None:
    """Return the first place where joints cannot follow the tool at its constant speed, ramps apart."""
    s = np.setdiff1d(np.union1d(g.s, 0.5 * (g.s[1:] + g.s[:-1])), breaks(path)[1:-1])
    first, second = tool_derivatives(path, s)
    way = np.maximum(np.linalg.norm(first, axis=1), _SLOWEST)
    speed = (tool_speed / way)[:, None]
    change = (-(tool_speed**2) * np.sum(first * second, axis=1) / way**4)[:, None]
    d = path.derivatives(s)
    ratios = {
        "velocity": np.abs(d[:, 0] * speed) / b.velocity,
        "acceleration": np.abs(d[:, 1] * speed**2 + d[:, 0] * change) / b.acceleration,
    }
    found = [_first(s, ratio, name) for name, ratio in ratios.items()]
    jump = corners(g)[1:-1]
    at = np.linalg.norm(tool_derivatives(path, g.s[1:-1])[0], axis=1, keepdims=True)
    needs = jump * tool_speed / np.maximum(at, _SLOWEST)
    with np.errstate(divide="ignore", invalid="ignore"):
        found.append(_first(g.s[1:-1], np.where(jump > 0, needs / (b.acceleration * b.cycle), 0.0), "corner"))
    places = [place for place in found if place is not None]
    return min(places, key=lambda place: place.s, default=None)


def _not_held(path: Motion, timing: Timing, tool_speed: float) -> SpeedLoss | None:
    """Return where a timing leaves the tool's speed between its ramps, though each place would allow it."""
    s, speed, _ = timing.at(np.linspace(0.0, timing.duration, HELD_ROWS))
    held = np.linalg.norm(tool_derivatives(path, s)[0], axis=1) * speed >= (1 - HELD) * tool_speed
    if not held.any():
        return SpeedLoss(float(s[np.argmax(speed)]), None, "ramps", np.inf)
    first, last = np.argmax(held), len(held) - 1 - np.argmax(held[::-1])
    gaps = np.flatnonzero(~held[first:last])
    return SpeedLoss(float(s[first + gaps[0]]), None, "ramps", np.inf) if len(gaps) else None


def _first(s: Floats, ratio: Floats, bound: str) -> SpeedLoss | None:
    """Return where one of the ratios (N, 7) first exceeds 1, and the joint of the greatest there."""
    over = ratio.max(axis=1, initial=0.0) > 1 + 1e-9
    if not over.any():
        return None
    k = int(np.argmax(over))
    joint = int(np.argmax(ratio[k]))
    return SpeedLoss(float(s[k]), joint + 1, bound, float(ratio[k, joint]))
