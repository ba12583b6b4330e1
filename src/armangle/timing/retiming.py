"""Times for a joint path: as fast as joint bounds allow, always on the Cartesian path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats, as_number
from ..errors import InputError
from ..motion.joint_path import JointPath
from ..motion.options import Bound, joint_bound
from .by_ruckig import smooth
from .by_toppra import fastest
from .grid import RESTS, Grid, Motion, corners, grid, tool_derivatives
from .tool_speed import not_held, speed_lost
from .trajectory import Timing, Trajectory, joined, sampled

GRID = 400
CYCLE = 1e-3
LEAST_BETWEEN_BREAKS = 4
FINER, MOST_FINER = 4, 6
OVER = 1.001
"""Where bounds are exceeded between grid points by more than this, the grid is made finer there."""
CHECKED = 4000
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

    Bounds hold at 400 points of the path or more, by toppra or by the bounds on s. Between them they are
    looked at ten times as closely; where they are exceeded by 0.1 % there are more points, and by what is
    left the whole motion is slowed down. Anywhere, 0.1 % is the most that has been seen.

    At a corner of the path, as between given poses, the joints' velocities would have to jump; the motion
    stops there, or slows down until the jump is one that the joints can make within a `cycle`.

    Parameters
    ----------
    path : JointPath
        From `plan` or `follow`; it must be ok.
    velocity, acceleration : float, array_like of shape (7,), or True
        Bounds, rad/s and rad/s², > 0; a number for all joints; True: the arm's own. Infinite: none.
    jerk : float, or array_like of shape (7,), optional
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
    more = np.empty(0)
    for _ in range(MOST_FINER):
        g = grid(path, GRID, LEAST_BETWEEN_BREAKS, more)
        timing = _timed(path, g, bounds)
        s, factor = _excess(path, g, timing, bounds)
        if factor.max() <= OVER:
            break
        more = np.union1d(more, _finer(g.s, s[factor > OVER]))
    over = float(factor.max())
    timing = timing.slower(over if bounds.jerk is not None else max(over, 1.0))
    lost = None
    if bounds.tool_speed is not None:
        jump = bounds.acceleration * (bounds.cycle if bounds.jerk is None else 0.0)
        given = bounds.tool_speed, bounds.velocity, bounds.acceleration, jump
        lost = speed_lost(path, g, *given) or not_held(path, timing, bounds.tool_speed)
    return sampled(path, timing, step, bounds.tool_speed, lost)


def _finer(s: Floats, bad: Floats) -> Floats:
    """Return places that divide the intervals of s that hold bad places, and their neighbours."""
    k = np.clip(np.searchsorted(s, bad, side="right") - 1, 0, len(s) - 2)
    k = np.unique(np.clip(k[:, None] + np.arange(-1, 2), 0, len(s) - 2))
    return np.asarray((s[k, None] + (s[k + 1] - s[k])[:, None] * np.arange(1, FINER) / FINER).reshape(-1))


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
            "a timing needs a bound on the acceleration of every joint: acceleration=, in rad/s²"
        )
    if not np.abs(path.derivatives(np.linspace(0.0, 1.0, GRID))[:, 0]).max() > RESTS:
        raise InputError("no joint moves along the path: there is nothing to time")
    j = None if jerk is None else joint_bound(path.arm, "jerk", jerk, np.full(7, np.inf))
    speed = None
    if tool_speed is not None:
        speed = as_number("tool_speed", tool_speed, 0.0, _MOST_SPEED, low_open=True)
    return _Bounds(v, a, j, speed, as_number("cycle", cycle, 0.0, 1.0))


def _timed(path: Motion, g: Grid, b: _Bounds) -> Timing:
    """Return a timing that keeps the bounds at the grid points."""
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
    return joined(pieces)


def _speed_caps(path: Motion, g: Grid, b: _Bounds) -> Floats:
    """Return the greatest ds/dt at every grid point that velocities and the tool's speed allow, (N + 1,)."""
    fastest_joint = np.maximum(np.abs(g.after[:, 0]), np.abs(g.before[:, 0]))
    with np.errstate(divide="ignore"):
        caps = np.min(b.velocity / np.maximum(fastest_joint, _SLOWEST), axis=1)
    if b.tool_speed is not None:
        way = [np.linalg.norm(tool_derivatives(path, s)[0], axis=1) for s in (g.s, np.nextafter(g.s, 0.0))]
        caps = np.minimum(caps, b.tool_speed / np.maximum(np.maximum(*way), _SLOWEST))
    return np.asarray(caps)


def _excess(path: Motion, g: Grid, timing: Timing, b: _Bounds) -> tuple[Floats, Floats]:
    """Return places between grid points, and by what factors time has to be stretched for them."""
    t = _times_between(g, timing)
    s, speed, acceleration = timing.at(t)
    d = path.derivatives(s)
    speed, acceleration = speed[:, None], acceleration[:, None]
    qd, qdd = d[:, 0] * speed, d[:, 1] * speed**2 + d[:, 0] * acceleration
    factor = np.maximum(
        np.max(np.abs(qd) / b.velocity, axis=1), np.sqrt(np.max(np.abs(qdd) / b.acceleration, axis=1))
    )
    if b.jerk is not None:
        jolt = timing.jerk_at(t)[:, None]
        qddd = d[:, 2] * speed**3 + 3 * d[:, 1] * speed * acceleration + d[:, 0] * jolt
        factor = np.maximum(factor, np.cbrt(np.max(np.abs(qddd) / b.jerk, axis=1)))
    if b.tool_speed is not None:
        way = np.linalg.norm(tool_derivatives(path, s)[0], axis=1)
        factor = np.maximum(factor, way * speed[:, 0] / b.tool_speed)
    return s, factor


def _times_between(g: Grid, timing: Timing) -> Floats:
    """Return times inside the pieces of a timing, and such at which s is inside the intervals of the grid."""
    inside = np.array([0.02, 0.08, 0.16, 0.3, 0.5, 0.7, 0.84, 0.92, 0.98])
    t = (timing.t[:-1, None] + np.diff(timing.t)[:, None] * inside).reshape(-1)
    dense = np.union1d(t, np.linspace(0.0, timing.duration, CHECKED))
    places = (g.s[:-1, None] + np.diff(g.s)[:, None] * inside).reshape(-1)
    return np.union1d(t, np.interp(places, timing.at(dense)[0], dense))
