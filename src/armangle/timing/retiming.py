"""Timing of a joint path: as fast as joint bounds allow, always on the Cartesian path."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import JOINTS, Floats, as_number, warn
from .._progress import Progress, as_progress, in_parts, part
from ..arm.arm import Arm
from ..arm.keywords import names_keywords
from ..errors import InputError, PathError
from ..motion.curves import repeated
from ..motion.joint_path import JointPath
from ..motion.options import Bound, finite_seven, joint_bound
from ..motion.paths import NO_DEVIATION, Deviation
from .fastest import NONE, REST, End, TooFast, fastest, needed_knots, smooth
from .grid import Grid, corners, grid
from .motion import (
    BESIDE,
    RESTS,
    Motion,
    Part,
    beside_ends,
    just_before,
    steep_ends,
    tool_derivatives,
    unproven_ends,
)
from .rounding import rounded
from .straight import SLOWEST, is_straight, straight
from .tool_speed import HELD, HELD_WITH_JERK, not_held, speed_lost
from .trajectory import Timing, Trajectory, joined, resting, sampled

GRID, LEAST_BETWEEN_BREAKS = 400, 4
"""Intervals of s that are evaluated, and the least number between two breaks, unless there are as many."""
WITH_JERK, LEAST_WITH_JERK = 200, 2
"""The same if bounds are imposed at several places in each ..."""
AT_SPEED, LEAST_AT_SPEED = 640, 24
"""... and where a tool speed is to be held as well, which shows what is coarse."""
KNOTS, KNOTS_AT_SPEED, ATTEMPTS = (80, 120), (80, 240), 6
"""Intervals of a spline of the speed with bounded jerk: a second attempt uses more where it changes. Later
attempts keep them, and add some where bounds are exceeded between the evaluated places."""
FULL_PARTS, LEAST_IN_PART = 8, 40
"""Number of parts between corners up to which each has all intervals, and the least in each of more parts."""
FEW_STOPS, MOST_STOPS = 8, 300
"""Number of corners up to which stopping at each of them is tried too, and where it may be faster."""
ALONG = 1e-4
"""Share of an end's velocities by which they may deviate from the path's direction, or exceed a bound."""
TOLERANCE = 1e-4
"""Permitted deviation of the end effector at rounded corners by default, m."""
CYCLE = 1e-3
DENSE = 100
"""Cycles between two corners below which they share the joints' accelerations."""
FINER, MOST_FINER = 4, 6
OVER, OVER_WITH_JERK = 1.001, 1.005
"""Excess of bounds between grid points above which the grid becomes finer there."""
SLOW = 0.5
"""Share of the speed near corners below which they slow the motion down, and a point is inserted."""
AT_CAP, LOST, GAIN = 0.9, 0.02, 1.005
"""Share of a bound from which it counts as limiting; share of time that may be lost in all where no bound
limits; gain of a finer grid below which it is not refined for that."""
CHECKED = 4000
LEAP, STILL = 1.01, 3e-5
"""Share of a bound on velocity, and rad, beyond which a joint move is a jump; rows are joined to 1e-5."""
LOOKED, MOST_LOOKS = 1e-3, 24
"""Largest joint move between two samples, rad, and number of bisections of a time between two."""
LOOKED_BESIDE, JUMP = 200, 4.0
"""Least number of times sampled near an unproven range. Permitted change of a velocity in a cycle there, as a
factor of its acceleration: 2 at a corner, more where joints leave as the root of s."""
MOST_TOLERANCE = 1.0
MOST_ROWS = 4_000_000
"""Rows of a trajectory: an hour at 1 kHz."""
_MOST_SPEED = 1e6
_FAST_TOOL = 10.0  # m/s: faster than any end effector of such an arm
_LEAST_BOUND = 1e-12
"""Least velocities, accelerations and jerks: smaller ones give meaningless times."""


_ROWS = "sample= is the time between the rows, s; at(t) of the result gives any"
_KEYWORDS = {
    "dt": _ROWS,
    "velocity_now": "start= are the joint velocities at the beginning, goal= those at the end, rad/s",
    "acceleration_now": "start=(velocities, accelerations) are those at the beginning, rad/s and rad/s²",
    "samples": _ROWS,
    "speed": "tool_speed= is the tool's, m/s, velocity= the joints', rad/s",
    "duration": "it is as short as velocity= and acceleration= let it be",
}


class _Bounds(NamedTuple):
    velocity: Floats
    acceleration: Floats
    jerk: Floats | None
    tool_speed: float | None
    cycle: float
    tolerance: float
    ends: tuple[End, End]

    @property
    def moving(self) -> bool:
        """Whether the motion begins or ends while it moves."""
        return any(end.speed for end in self.ends)

    def within(self, share: float) -> _Bounds:
        """Return the velocity bounds divided by `share`, and the accelerations by its square."""
        return self._replace(velocity=self.velocity / share, acceleration=self.acceleration / share**2)

    def of_part(self, way: Part, ends: tuple[End, End]) -> _Bounds:
        """Return the bounds for a part, whose `ends`, of s, become those of the part's own parameter."""
        width = way.last - way.first
        first, last = (End(end.speed / width, end.acceleration / width) for end in ends)
        return self._replace(ends=(first, last))


@names_keywords(None, _KEYWORDS)
def retime(
    path: Motion,
    *,
    start: ArrayLike | None = None,
    goal: ArrayLike | None = None,
    velocity: Bound = True,
    acceleration: Bound = True,
    jerk: ArrayLike | None = None,
    tolerance: float | None = None,
    tool_speed: float | None = None,
    cycle: float = CYCLE,
    sample: float = 0.01,
    progress: Progress | bool | None = None,
) -> Trajectory:
    """Return a trajectory along a joint path that respects joint velocities and accelerations.

    Every configuration is on the Cartesian path: only s(t) is chosen. It is time-optimal, from dq/ds and
    d²q/ds² in closed form; with `jerk` nearly so, from d³q/ds³ too.

    Bounds hold at hundreds of points of the path. Between them they are checked ten times as densely. If they
    are exceeded by 0.1 %, points are added; for the remaining excess the whole motion is slowed down. Joint
    limits hold to 1e-6 rad, also between the poses of a followed path.

    At a corner of the path, as between followed poses, the joints' velocities would have to jump. Without
    `jerk` the motion slows down until the joints can make the jump within a `cycle`. With `jerk` corners are
    rounded: the end effector leaves the path within `tolerance`, and ``deviation`` of the result says how
    far. It stops at corners only if that is faster and there are at most 300.

    A row of joints that repeats the one before it is left out, because it is no stop. Such rows are within
    2e-5 rad of it, single or several in sequence, if the neighbouring rows are 50 times as far apart; or
    within 1e-9 rad. If no joint moves at all, the trajectory has one row, at rest, and takes 0 s.

    Parameters
    ----------
    path : JointPath
        From `plan`, `follow` or `JointPath.from_joints`; it must be ok.
    start, goal : array_like, shape (7,) or (2, 7), optional
        Joint velocities at its start and end, rad/s, along the path; at rest by default. They are met to a
        relative 1e-6, for example those of a previous motion: ``start=other.at(t).qd``. With `jerk`
        accelerations (rad/s²) may follow them, ``start=(at.qd, at.qdd)``; otherwise any within the bounds are
        used. On the path they have one free number: they are met up to the change by the jerk in 1 ms. If
        only that brakes the motion, as after one that brakes as hard as it may, bounds are exceeded by up to
        0.4 %.
    velocity, acceleration : float, array_like of shape (7,), or True
        Bounds, rad/s and rad/s², > 0; a number for all joints; True: the arm's own. An infinite velocity is
        unbounded; accelerations must be finite.
    jerk : float, or array_like of shape (7,), optional
        Bounds, rad/s³, > 0.
    tolerance : float, optional
        Permitted deviation of the end effector from the path, m, at a corner, or near a singular end without
        a finite or proven joint rate; a radian counts as 0.2 m. 0: none, the motion then stops at every
        corner. By default 0.1 mm with `jerk`, 0 without.
    tool_speed : float, optional
        Constant speed of the end effector's origin, m/s, > 0, between a ramp at either end; with `jerk`
        within 1 %. If joints cannot follow, it slows down; ``speed_lost`` of the result says where first, and
        why.
    cycle : float
        Time within which a joint's velocity may jump by what its acceleration allows, s: the controller's
        cycle, 1 ms by default. With 0, or with `jerk`, the motion stops at every corner that is not rounded.
    sample : float
        Time between the rows of the result, s, > 0.
    progress : function (done, total), or bool, optional
        Called with the finished thousandths, of attempts at parts between corners; True: a bar on stderr.

    Returns
    -------
    Trajectory
        Fields ``t, s, q, qd, qdd``, and ``at(t)`` for any time.

    Raises
    ------
    PathError
        If the path is not ok, violates a joint limit between two rows, or no timing respects the bounds, for
        example if they cannot brake `start`.
    MissingExtraError
        Without scipy: pip install 'armangle[time]'.
    InputError
        If a number is out of range, the arm has no velocity or acceleration, or `start` or `goal` violates a
        bound or is not along the path.

    Source: Verscheure et al. (2009); Debrouwere et al. (2013).
    """
    bounds = _checked(path, velocity, acceleration, jerk, tolerance, tool_speed, cycle)
    step = as_number("sample", sample, 0.0, _MOST_SPEED, low_open=True)
    told = as_progress(progress)
    notes = _not_trusted(path.arm) if velocity is True else ()
    path = _without_repeats(path)
    bounds = bounds._replace(ends=_ends(path, start, goal, bounds))
    with in_parts(told) as tell:
        if _stands(path):
            q = path.q[-1] if isinstance(path, JointPath) else np.asarray(path.at(1.0).q)
            return replace(resting(path, q, bounds.tool_speed), notes=notes)
        path, g, timing, off = min(_ways(path, bounds, tell), key=lambda way: way.timing.duration)
        _raise_for_leaps(path, timing, bounds.velocity)
        _raise_for_unproven(path, timing, bounds)
        if not timing.duration <= MOST_ROWS * step:
            raise InputError(
                f"the motion takes {timing.duration:.3g} s, more than {MOST_ROWS} rows of sample = "
                f"{step:g} s: wanted a larger sample, or bounds in rad/s, rad/s², rad/s³ and a "
                "tool_speed in m/s"
            )
        lost = None
        if bounds.tool_speed is not None:
            jump = bounds.acceleration * (bounds.cycle if bounds.jerk is None else 0.0)
            given = bounds.tool_speed, bounds.velocity, bounds.acceleration, jump
            share = HELD if bounds.jerk is None else HELD_WITH_JERK
            lost = speed_lost(path, g, *given) or not_held(path, timing, bounds.tool_speed, share)
        return replace(sampled(path, timing, step, bounds.tool_speed, lost, off), notes=notes)


def _not_trusted(arm: Arm) -> tuple[str, ...]:
    """Return the arm's notes about velocity bounds that its source may have wrong; perhaps none."""
    report = arm.report
    every = (*arm.geometry.notes, *(() if report is None else report.notes))
    return tuple(note for note in every if note.startswith("velocity") and "not trusted" in note)


def _without_repeats(path: Motion) -> Motion:
    """Return the path without rows of joints that repeat the row before; one with a `Path` is unchanged."""
    if not isinstance(path, JointPath) or path.path is not None:
        return path
    repeats = repeated(path.q)
    if not repeats.any() or repeats.all():
        return path
    kept = np.append(0, np.flatnonzero(~repeats) + 1)
    own = np.append(0.0, np.cumsum(np.diff(path.s)[~repeats]))  # s without the rests
    q = path.q[kept]
    q[-1] = path.q[-1]
    s = None if np.ptp(np.diff(own)) <= RESTS else own / own[-1]
    again = JointPath.from_joints(path.arm, q, s=s, status=path.status[kept], between=path.between)
    return _without_repeats(again)


class _Way(NamedTuple):
    path: Motion
    grid: Grid
    timing: Timing
    deviation: Deviation


def _ways(path: Motion, b: _Bounds, tell: Progress) -> list[_Way]:
    """Return timings of a path, with its corners and with rounded ones, of which each may be the fastest."""
    steep = steep_ends(path) if b.tolerance > 0 else (False, False)
    left = np.where(steep, np.maximum(BESIDE, beside_ends(path)), 0.0)
    inner = Part(path, float(left[0]), 1.0 - float(left[1])) if any(steep) else path
    first = grid(inner, GRID, 1, np.empty(0))
    bends = corners(first).any(axis=1)
    many = np.count_nonzero(bends)
    nodes = np.union1d([0.0, 1.0], inner.s(first.s[bends]) if isinstance(inner, Part) else first.s[bends])
    asked = b.tolerance > 0 and (many > 0 or any(steep))
    slopes = [
        path.derivatives(s)[0] if end.speed else None for s, end in zip(_places(path), b.ends, strict=True)
    ]
    without = rounded(path, nodes, b.tolerance, steep, (slopes[0], slopes[1])) if asked else None
    if without is None:
        return [_Way(path, *_kept(path, b, tell), NO_DEVIATION)]
    smoothed, off = without
    failed, found = None, list[_Way]()
    try:
        found.append(_Way(smoothed, *_kept(smoothed, b, part(tell, 0, 2)), off))
    except PathError as error:  # an end moves; with stops it need not
        if any(steep) or not b.moving:
            raise
        failed = error
    if any(steep):
        return found
    least = found[0].timing.duration if found else np.inf
    if many <= FEW_STOPS or (many <= MOST_STOPS and _least_with_stops(path, first, b) < least):
        try:
            found.append(_Way(path, *_kept(path, b, part(tell, 1, 2)), NO_DEVIATION))
        except PathError:
            if not b.moving:
                raise
    if not found and failed is not None:
        raise failed
    return found


def _least_with_stops(path: Motion, g: Grid, b: _Bounds) -> float:
    """Return a lower bound (s) of the duration of a motion that stops at every corner."""
    stops = g.s[np.union1d([0, len(g.s) - 1], np.flatnonzero(corners(g).any(axis=1)))]
    ways = np.abs(np.diff(path.at(stops).q, axis=0))
    least = 2 * np.sqrt(ways / b.acceleration) if b.jerk is None else np.cbrt(32 * ways / b.jerk)
    return float(np.maximum(least, ways / b.velocity).max(axis=1).sum())


def _kept(path: Motion, b: _Bounds, tell: Progress) -> tuple[Grid, Timing]:
    """Return a grid and a timing within all bounds (to 0.1 % if an end moves), also between its points."""
    if b.jerk is not None:
        return _kept_with_jerk(path, b, b.jerk, tell)
    if not b.moving:
        return _kept_on_grids(path, b, tell)
    try:  # it cannot be slowed down as a whole: that would slow its ends down too
        return _kept_on_grids(path, b.within(OVER), tell)
    except TooFast:  # for example inside another motion that brakes as hard as it may
        return _kept_on_grids(path, b.within(1 / OVER), tell)


def _kept_on_grids(path: Motion, b: _Bounds, tell: Progress) -> tuple[Grid, Timing]:
    """Return the last of ever finer grids, and a timing on it within all bounds; jerk is not bounded."""
    more, takes = np.empty(0), np.inf
    for attempt in range(MOST_FINER):
        tell(attempt, MOST_FINER)
        g, caps = _between_stops(path, b, more)
        g = g.with_dense(DENSE * b.cycle * caps)
        timing = _timed(g, caps, b)
        if not np.isfinite(timing.t).all():  # the grid may be too coarse for a bend
            if attempt + 1 == MOST_FINER:
                _raise_for_leaps(path, timing, b.velocity)
            more = np.union1d(more, _finer(g.s, timing.rests()))
            continue
        s, factor = _excess(path, g, timing, b)
        bad, before, takes = s[factor > OVER], takes, timing.duration * max(float(factor.max()), 1.0)
        if takes * GAIN < before:
            bad = np.concatenate([bad, _slack(g, caps, timing, b)])
        if not len(bad):
            break
        more = np.union1d(more, _finer(g.s, bad))
    if b.moving and factor.max() <= OVER:
        return g, timing
    if b.moving:
        raise _exceeded(s, factor)
    return g, timing.slower(max(float(factor.max()), 1.0))


def _exceeded(s: Floats, factor: Floats) -> PathError:
    """Return the error that a motion with a moving end would need `factor` (N,) times as long at s."""
    most = float(factor.max())
    return PathError(
        "no timing is found that keeps the bounds from start= to goal=: beside s = "
        f"{s[factor.argmax()]:.6g} velocities, accelerations and jerks would have to be {most:.4g}, "
        f"{most**2:.4g} and {most**3:.4g} times what they may be: ask for less, or plan the path"
    )


def _between_stops(path: Motion, b: _Bounds, more: Floats) -> tuple[Grid, Floats]:
    """Return a grid with a point between any two slow corners, and the largest ds/dt at its points."""
    g = grid(path, GRID, LEAST_BETWEEN_BREAKS, more)
    caps = _speed_caps(path, g, b)
    slow = _corner_caps(g, b) < SLOW * caps
    slow[[0, -1]] = True
    alone = slow[:-1] & slow[1:]
    if alone.any():
        g = grid(path, GRID, LEAST_BETWEEN_BREAKS, np.union1d(more, (g.s[:-1] + np.diff(g.s) / 2)[alone]))
        caps = _speed_caps(path, g, b)
    return g, np.minimum(caps, _corner_caps(g, b))


def _kept_with_jerk(path: Motion, b: _Bounds, jerk: Floats, tell: Progress) -> tuple[Grid, Timing]:
    """Return a grid, and a timing within all bounds: each part between corners is timed on its own."""
    g = grid(path, GRID, 1, np.empty(0))
    ends = np.union1d([0.0, 1.0], g.s[corners(g).any(axis=1)])
    ways = [Part(path, first, last) for first, last in pairwise(ends.tolist())]
    full = min(1.0, FULL_PARTS / len(ways))
    timings = []
    for k, way in enumerate(ways):
        inside = b.ends[0] if k == 0 else End(), b.ends[1] if k + 1 == len(ways) else End()
        timings.append(_part_kept(way, full, b.of_part(way, inside), jerk, part(tell, k, len(ways))))
    return g, joined([each.of_part(way.first, way.last) for each, way in zip(timings, ways, strict=True)])


def _part_kept(way: Part, full: float, b: _Bounds, jerk: Floats, tell: Progress) -> Timing:
    """Return the fastest of several timings of a part between two corners.

    `full` is its share of the grid; less than 1 if there are many parts, with one attempt each.
    """
    count, least = (WITH_JERK, LEAST_WITH_JERK) if b.tool_speed is None else (AT_SPEED, LEAST_AT_SPEED)
    least = max(LEAST_WITH_JERK, min(least, count // (len(way.breaks) - 1)))
    found, before, more, broken, gain = list[Timing](), None, NONE, NONE, np.inf
    share, over = (OVER_WITH_JERK, OVER) if b.moving else (1.0, OVER_WITH_JERK)
    asked, rough = (b.velocity / share, b.acceleration / share**2, jerk / share**3), None
    few, many = KNOTS if b.tool_speed is None else KNOTS_AT_SPEED
    attempts = ATTEMPTS if full == 1 else 1
    for attempt in range(attempts):
        tell(attempt, attempts)
        g = grid(way, max(int(full * count), LEAST_IN_PART), least, more)
        caps = np.minimum(_speed_caps(way, g, b), _corner_caps(g, b))
        if b.moving and not attempt:
            caps[[0, -1]] = np.where(caps[[0, -1]] > 0, caps[[0, -1]], caps[1:-1].max())
            speeds = b.ends[0].speed, b.ends[1].speed
            rough = fastest(g, b.acceleration * OVER**2, caps * OVER, speeds)
        if is_straight(g, caps) and not b.moving:
            timing = straight(g, b.acceleration, jerk, caps)
        else:
            knots = many if attempt else few
            most = partial(_at_tool_speed, way, b=b)
            before = smooth(way.derivatives, g, asked, most, knots, b.ends, rough, before, broken)
            timing = before.timing
        if not np.isfinite(timing.t).all():
            _raise_for_leaps(way.whole, timing.of_part(way.first, way.last), b.velocity)
        s, factor = _excess(way, g, timing, b)
        bad = s[factor > over]
        if not b.moving:
            timing = timing.slower(float(factor.max()) or 1.0)  # 0 if nothing moves
        if not (b.moving and len(bad)):
            gain = found[-1].duration / timing.duration if found else np.inf
            found.append(timing)
        if b.moving and before is not None and before.over > (share * OVER) ** 2:
            break
        if before is None or (attempt and not len(bad)) or (len(broken) and gain < 1):
            break
        if attempt:
            broken = bad
        else:
            more = _finer(g.s, bad)
        count = max(count, needed_knots(before.speed))
    if not found:
        raise _exceeded(way.s(s), factor)
    return min(found, key=lambda timing: timing.duration)


def _raise_for_leaps(path: Motion, timing: Timing, velocity: Floats) -> None:
    """Raise if joints move between two times farther than the velocity bounds permit."""
    if not np.isfinite(timing.t).all():
        last = int(np.argmin(np.isfinite(timing.t))) - 1
        _raise_leap(f"behind s = {timing.coefficients[last, 0]:.6g} joints leap")
    t = np.linspace(0.0, timing.duration, CHECKED)
    begin, end = t[:-1], t[1:]
    for _ in range(MOST_LOOKS):
        s = timing.at(np.concatenate([begin, end]))[0].reshape(2, -1)
        ways = np.abs(np.subtract(*path.at(s).q))
        farther = ways - LEAP * velocity * (end - begin)[:, None] > STILL
        if farther.any():
            k, joint = np.argwhere(farther)[0].tolist()
            _raise_leap(f"between s = {s[0, k]:.6g} and {s[1, k]:.6g} joint {joint + 1} leaps")
        far = (ways[:, np.isfinite(velocity)] > LOOKED).any(axis=1)
        if not far.any():
            return
        middle = (begin[far] + end[far]) / 2
        begin, end = np.concatenate([begin[far], middle]), np.concatenate([middle, end[far]])


def _raise_for_unproven(path: Motion, timing: Timing, b: _Bounds) -> None:
    """Raise if a velocity jumps in an unproven range of s by more than a cycle permits."""
    step = max(b.cycle, CYCLE)
    for low, high in unproven_ends(path).tolist():
        dense = np.linspace(0.0, timing.duration, CHECKED)
        dense = np.union1d(dense, np.geomspace(step / CHECKED, timing.duration / 2, CHECKED))
        dense = np.union1d(dense, timing.duration - dense)
        t = np.interp([low, high], timing.at(dense)[0], dense)
        count = int(np.clip(4 * np.ptp(t) / step, LOOKED_BESIDE, CHECKED))
        middle = np.linspace(t[0] - step, t[1] + step, count)
        if b.moving:  # beyond the ends nothing is known
            middle = np.clip(middle, step, max(timing.duration - step, step))
        before, here, after = (
            path.at(timing.at(np.clip(middle + shift, 0.0, timing.duration))[0]).q
            for shift in (-step, 0.0, step)
        )
        jump = np.abs(after - 2 * here + before).max(axis=0) / step
        joint = int(np.argmax(jump / b.acceleration))
        if jump[joint] > JUMP * b.acceleration[joint] * step:
            _raise_leap(f"between s = {low:.6g} and {high:.6g}, which is not proven, joint {joint + 1} leaps")


def _raise_leap(where: str) -> None:
    """Raise the error of a path whose joints jump."""
    raise PathError(
        f"no timing is found: {where}: between rows, or near a configuration where branches meet or the arm "
        "is stretched. At an end tolerance= may round that; otherwise leave it out, or plan the path."
    )


def _slack(g: Grid, caps: Floats, timing: Timing, b: _Bounds) -> Floats:
    """Return the middles (s) of the intervals in which a finer grid, not a bound, permits a faster motion.

    Between two points of the grid s has one acceleration. Near a stop, where s rises from rest to a cap, that
    may be far less than the joints permit.
    """
    step, spent, speed = np.diff(g.s), np.diff(timing.t), timing.speeds()
    y, rise = speed**2, np.diff(speed**2)[:, None] / (2 * step[:, None])
    needed = [
        np.abs(side[:, 1] * y[at, None] + side[:, 0] * rise + turn * y[at, None])
        for side, at in ((g.after[:-1], slice(0, -1)), (g.before[1:], slice(1, None)))
        for turn in (0.0, g.turns)
    ]
    used = np.max(np.max(needed, axis=0) / b.acceleration, axis=1)
    most = np.maximum(caps[:-1], caps[1:])
    slow = np.minimum(speed[:-1], speed[1:]) < AT_CAP * most
    lost = spent - step / np.maximum(most, SLOWEST)
    slack = (used < AT_CAP) & slow & (lost * len(step) > LOST * timing.duration)
    return np.asarray((g.s[:-1] + step / 2)[slack])


def _finer(s: Floats, bad: Floats) -> Floats:
    """Return places that divide the intervals of s with the bad places, and those next to them."""
    k = np.clip(np.searchsorted(s, bad, side="right") - 1, 0, len(s) - 2)
    k = np.unique(np.clip(k[:, None] + np.arange(-1, 2), 0, len(s) - 2))
    return np.asarray((s[k, None] + (s[k + 1] - s[k])[:, None] * np.arange(1, FINER) / FINER).reshape(-1))


def _checked(
    path: Motion, velocity: Bound, acceleration: Bound, jerk: ArrayLike | None, tolerance: float | None,
    tool_speed: float | None, cycle: float,
) -> _Bounds:  # fmt: skip
    """Return the bounds as numbers in rad, m, s; raise if an argument is invalid."""
    if not isinstance(path, Motion):
        if isinstance(path, np.ndarray) and path.shape[-1:] == (JOINTS,):
            raise InputError("path is an array, wanted a JointPath: of joints JointPath.from_joints(arm, q)")
        raise InputError(f"path is {path!r:.100}, wanted a JointPath")
    if isinstance(path, JointPath):
        path.raise_for_status()
        if len(path) == 0:
            raise PathError("the path has no rows, wanted at least one")
    v = joint_bound(path.arm, "velocity", velocity, path.arm.velocity)
    a = joint_bound(path.arm, "acceleration", acceleration, path.arm.acceleration)
    if np.isinf(a).any():
        raise InputError(
            "a timing needs a bound on the acceleration of every joint: acceleration=, in rad/s²"
        )
    j = None if jerk is None else joint_bound(path.arm, "jerk", jerk, np.full(7, np.inf))
    if j is not None and not np.isfinite(j).any():
        j = None  # unbounded
    for name, bound in (("velocity", v), ("acceleration", a), ("jerk", j)):
        if bound is not None and bound.min() < _LEAST_BOUND:
            k = int(np.argmin(bound))
            raise InputError(f"{name}[{k}] is {bound[k]:g}, wanted at least {_LEAST_BOUND:g}")
    speed = None
    if tool_speed is not None:
        speed = as_number("tool_speed", tool_speed, _LEAST_BOUND, _MOST_SPEED)
        if speed > _FAST_TOOL:
            warn(f"tool_speed is {speed:g}, wanted m/s: was this mm/s?")
    given = (TOLERANCE if j is not None else 0.0) if tolerance is None else tolerance
    off = as_number("tolerance (m)", given, 0.0, MOST_TOLERANCE)
    return _Bounds(v, a, j, speed, as_number("cycle", cycle, 0.0, 1.0), off, REST)


def _ends(path: Motion, start: ArrayLike | None, goal: ArrayLike | None, b: _Bounds) -> tuple[End, End]:
    """Return the motion of s at both ends of a path, within the bounds."""
    given = zip(("start", "goal"), (start, goal), _places(path), strict=True)
    first, last = (End() if value is None else _end(path, name, value, s, b) for name, value, s in given)
    return first, last


def _places(path: Motion) -> tuple[float, float]:
    """Return the s of the start and, just below 1, of the end of a path."""
    return 0.0, float(just_before(path, np.ones(1))[0])


def _end(path: Motion, name: str, value: ArrayLike, s: float, b: _Bounds) -> End:
    """Return ds/dt and d²s/dt² at an end from joint velocities (7,), or with accelerations too (2, 7)."""
    with_acceleration = np.ndim(value) == 2 and np.shape(value)[0] == 2
    rows = [finite_seven(name, row) for row in (np.asarray(value) if with_acceleration else [value])]
    speeds, accelerations = rows[0], rows[-1] if with_acceleration else None
    if accelerations is not None and b.jerk is None:
        raise InputError(
            f"{name} has accelerations, which may jump without jerk=: give velocities alone, or jerk="
        )
    if not speeds.any():
        if accelerations is not None and accelerations.any():
            raise InputError(
                f"{name} has accelerations and no velocity: a motion from or to rest has neither"
            )
        return End()
    _check_below(name, speeds, b.velocity, "rad/s")
    first, second, _ = path.derivatives(s)
    if not np.isfinite(first).all() or not first.any():
        raise InputError(f"{name} is a motion, and joints have no speed along the path at that end")
    speed = max(float(first @ speeds / (first @ first)), 0.0)
    _check_along(name, "velocities", speeds, first * speed, ALONG * np.abs(speeds).max(), "rad/s")
    if accelerations is None or b.jerk is None:
        return End(speed)
    _check_below(f"{name}[1]", accelerations, b.acceleration, "rad/s²")
    bent = second * speed**2
    bend = float(first @ (accelerations - bent) / (first @ first))
    room = ALONG * np.abs(accelerations).max() + b.jerk * CYCLE
    _check_along(name, "accelerations", accelerations, bent + first * bend, room, "rad/s²")
    return End(speed, bend)


def _check_below(name: str, given: Floats, bound: Floats, unit: str) -> None:
    """Raise if a value exceeds the bound of its joint."""
    over = np.abs(given) > bound * (1 + ALONG)
    if over.any():
        joint = int(np.argmax(over))
        raise InputError(
            f"{name}[{joint}] is {given[joint]:g} {unit}, above the bound of joint {joint + 1}, "
            f"{bound[joint]:g} {unit}"
        )


def _check_along(name: str, what: str, given: Floats, there: Floats, room: ArrayLike, unit: str) -> None:
    """Raise if values differ by more than `room` from what the path permits at an end."""
    off = np.abs(given - there)
    if (off > room).any():
        joint = int(np.argmax(off - room))
        raise InputError(
            f"{name} does not lead along the path: of the {what} {given.round(4).tolist()} {unit} that of "
            f"joint {joint + 1} is {off[joint]:.3g} {unit} off; the nearest there are "
            f"{there.round(4).tolist()}"
        )


def _stands(path: Motion) -> bool:
    """Return whether no joint moves along the path."""
    if isinstance(path, JointPath) and path.curve is None and np.ptp(path.q, axis=0).max() <= RESTS:
        return True
    slopes = path.derivatives(np.linspace(0.0, 1.0, GRID + 1))[:, 0]
    return bool(np.isfinite(slopes).all() and np.abs(slopes).max() <= RESTS)


def _timed(g: Grid, caps: Floats, b: _Bounds) -> Timing:
    """Return the fastest timing within the bounds at grid points; it stops where `caps` of ds/dt are 0."""
    stops = np.union1d([0, len(g.s) - 1], np.flatnonzero(caps == 0))
    pieces = []
    for first, last in pairwise(stops.tolist()):
        part, most = g.between(first, last), caps[first : last + 1].copy()
        most[[0, -1]] = np.where(most[[0, -1]] > 0, most[[0, -1]], most[1:-1].max())
        ends = b.ends[0].speed if first == 0 else 0.0, b.ends[1].speed if last == len(caps) - 1 else 0.0
        pieces.append(fastest(part, b.acceleration, most, ends))
    return joined(pieces)


def _speed_caps(path: Motion, g: Grid, b: _Bounds) -> Floats:
    """Return the largest ds/dt at every grid point by velocities and the tool speed, (N + 1,)."""
    fastest_joint = np.maximum(np.abs(g.after[:, 0]), np.abs(g.before[:, 0]))
    with np.errstate(divide="ignore", over="ignore"):
        caps = np.min(b.velocity / np.maximum(fastest_joint, SLOWEST), axis=1)
    for s in (g.s, just_before(path, g.s)):
        caps = np.minimum(caps, _at_tool_speed(path, s, b))
    return np.asarray(caps)


def _corner_caps(g: Grid, b: _Bounds) -> Floats:
    """Return the largest ds/dt at each grid point by its jump of q': infinite without, 0 for bounded jerk."""
    jump = np.abs(corners(g))
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        within = np.where(jump > 0, b.acceleration * b.cycle / jump, np.inf).min(axis=1)
    if b.jerk is not None:
        within[np.isfinite(within)] = 0.0
    return np.asarray(within)


def _at_tool_speed(path: Motion, s: Floats, b: _Bounds) -> Floats:
    """Return the ds/dt with which the tool has its requested speed at s (N,); infinite without one."""
    if b.tool_speed is None:
        return np.full(len(s), np.inf)
    return np.asarray(
        b.tool_speed / np.maximum(np.linalg.norm(tool_derivatives(path, s)[0], axis=1), SLOWEST)
    )


def _excess(path: Motion, g: Grid, timing: Timing, b: _Bounds) -> tuple[Floats, Floats]:
    """Return s between grid points, and the factor by which the timing is too fast there (1: just within)."""
    t = _times_between(g, timing)
    s, speed, acceleration = timing.at(t)
    d = path.derivatives(s)
    speed, acceleration = speed[:, None], acceleration[:, None]
    qd, qdd = d[:, 0] * speed, d[:, 1] * speed**2 + d[:, 0] * acceleration
    turns = g.turns[np.clip(np.searchsorted(g.s, s, side="right") - 1, 0, len(g.turns) - 1)] * speed**2
    most = np.maximum(np.abs(qdd), np.abs(qdd + turns))
    factor = np.maximum(
        np.max(np.abs(qd) / b.velocity, axis=1), np.sqrt(np.max(most / b.acceleration, axis=1))
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
    """Return times at which a timing is checked: inside each piece and each interval of the grid."""
    inside = np.array([1e-6, 0.02, 0.08, 0.16, 0.3, 0.5, 0.7, 0.84, 0.92, 0.98, 1 - 1e-6])
    t = (timing.t[:-1, None] + np.diff(timing.t)[:, None] * inside).reshape(-1)
    dense = np.union1d(t, np.linspace(0.0, timing.duration, CHECKED))
    places = (g.s[:-1, None] + np.diff(g.s)[:, None] * inside).reshape(-1)
    return np.union1d(t, np.interp(places, timing.at(dense)[0], dense))
