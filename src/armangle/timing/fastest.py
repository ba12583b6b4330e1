"""The fastest s(t) along given derivatives of q: linear programs in y = (ds/dt)².

    q̇² = q'² y        q̈ = q'' y + q' y' / 2        q⃛ = √y (q''' y + 3/2 q'' y' + q' y'' / 2)

Velocities and accelerations are linear in y: one program. A bound j on the jerk is not, but the tangent of j
/ √y lies below it. So each of a sequence of linear programs is safe and none is slower than the last.

Source: Verscheure et al. (2009), Time-optimal path tracking for robots; Debrouwere et al. (2013),
Time-optimal path following for robots with convex-concave constraints.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._arrays import JOINTS, Floats
from ..errors import PathError
from .grid import Grid, composed
from .linear_program import Basis, LinearProgram, needed
from .trajectory import Timing, from_speeds, through

LEAST_MEAN = 1e-4
"""Least relevant share of the mean speed of s; its inverse is the greatest."""
FEWEST, MOST = 20, 2000
"""Intervals of a spline of y for a short piece, and for a motion that slows down often."""
PER_DIP, DEEP = 12, 1.25
"""Intervals for each place where it slows down, to below its speeds nearby by this factor."""
WITHIN, SHARES = np.array([0.06, 0.5, 0.94]), np.array([0.25, 0.5, 0.25])
"""Places in an interval of the spline at which bounds are imposed, and the share of each."""
AT_REST = 9
"""Places in the first and last interval at which bounds are imposed: a start may be all jerk."""
CALM = (0, 1, 2, 4, 8)
"""Numbers of knots over which first guesses are smoothed; the fastest is used."""
TOLERANCE, MATTERS = 1e-6, 0.5
"""Relative accuracy of HiGHS for a bound; share of a bound from which it enters a program."""
SLACKS = 1.5
"""Share of its slack by which a row of jerk may exceed its bound, because the tangent replaces 1 / √y."""
MOST_SLACK = 1e6
"""Largest slack of a program that is brought within its bounds."""
GROWTH = 4.0
"""Largest factor by which y may grow or shrink in one program."""
ROUNDS, GAIN = 30, 1e-3
"""Largest number of linear programs in a sequence, and the gain in time at which it ends."""
MET = 1e-6
"""Relative error of a speed at an end, from the accuracy of HiGHS."""
LOOSE = 2.0
"""Factor by which ds/dt may exceed the largest reachable value: bounds at a grid are inexact between."""
NEWTON = 2
"""Steps of Newton's method that improve the r of an s from 1e-6 to rounding."""
PIECES = 4
"""Pieces of s(t) in an interval of the spline."""
NONE = np.empty(0)


class TooFast(PathError):
    """No timing brakes joints from the velocity at the start, or accelerates them to that at the end."""


def fastest(g: Grid, acceleration: Floats, most: Floats, ends: tuple[float, float] = (0.0, 0.0)) -> Timing:
    """Return the fastest timing from one speed to another, without a stop between.

    `acceleration` (7,), largest joint accelerations, rad/s²; `most` (N + 1,), largest ds/dt at each s of the
    grid, 1/s; `ends`, ds/dt at the start and end, 1/s. Raises `MissingExtraError`, and `PathError` if there
    is none, for example if such a speed cannot be braked.
    """
    return from_speeds(g.s, np.sqrt(_squares(g, acceleration, most, ends)))


def _squares(g: Grid, acceleration: Floats, most: Floats, ends: tuple[float, float]) -> Floats:
    """Return (ds/dt)² at the grid points of the fastest timing; between them d²s/dt² is constant."""
    sparse = needed("scipy.sparse")
    n = len(g.s)
    step = np.diff(g.s)
    unit = _limited(most, g, acceleration, ends) ** 2
    first, second = np.arange(n - 1), np.arange(1, n)
    rows = []
    for joint in np.flatnonzero(np.isfinite(acceleration)):
        turned = np.flatnonzero(g.turns[:, joint])
        for side, at in ((g.after[:-1], first), (g.before[1:], second)):
            slope = side[:, 0, joint] / (2 * step)
            bend = sparse.csr_matrix((side[:, 1, joint], (first, at)), shape=(n - 1, n))
            turn = sparse.csr_matrix((g.turns[:, joint], (first, at)), shape=(n - 1, n))
            entries = np.concatenate([-slope, slope]), (np.tile(first, 2), np.concatenate([first, second]))
            here = (bend + sparse.csr_matrix(entries, shape=(n - 1, n))) / acceleration[joint]
            rows += [here, (here + turn / acceleration[joint])[turned]]
    matrix = sparse.vstack(rows) @ sparse.diags(unit)
    lowest, highest = np.zeros(n), np.ones(n)
    highest[[0, -1]] = np.square(ends) / unit[[0, -1]]
    both = sparse.vstack([matrix, -matrix]).tocsr()
    if not any(ends):
        return np.asarray(unit * LinearProgram(-np.ones(n), both, lowest, highest).solved())
    at_ends = np.zeros(n)
    at_ends[[0, -1]] = -1.0
    reached = LinearProgram(at_ends, both, lowest, highest).solved()[[0, -1]]
    if (short := reached < (1 - MET) * highest[[0, -1]]).any():
        end = int(np.argmax(short))
        share = np.sqrt(reached[end] / highest[[0, -1]][end])
        raise TooFast(
            f"no timing is found: joints cannot {('be braked', 'be brought up')[end]} within their bounds "
            f"{('from the velocities of start=', 'to the velocities of goal=')[end]} on the path: "
            f"{100 * share:.3g} % of them can; where it has corners, jerk= or tolerance= rounds them"
        )
    lowest[[0, -1]] = highest[[0, -1]] = reached
    return np.asarray(unit * LinearProgram(-np.ones(n), both, lowest, highest).solved())


def _limited(most: Floats, g: Grid, acceleration: Floats, ends: tuple[float, float]) -> Floats:
    """Return upper bounds of ds/dt at the grid points, reduced to what can be reached from the ends.

    A joint at a distance of L rad from a place of speed v is at most √(v² + 2 a L) fast. If no joint moves, s
    has no natural speed and gets an upper bound.
    """
    step = np.diff(g.s)[:, None]
    rate = np.maximum(np.abs(g.after[:, 0]), np.abs(g.before[:, 0]))
    moves = np.maximum(rate[:-1], rate[1:]) * step
    moved, left = np.cumsum(moves, axis=0), np.cumsum(moves[::-1], axis=0)[::-1]
    first, last = ((speed * rate[at]) ** 2 for speed, at in zip(ends, (0, -1), strict=True))
    reached = np.full(len(g.s), np.inf)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        come = np.minimum(first + 2 * acceleration * moved[:-1], last + 2 * acceleration * left[1:])
        speeds = np.where(rate[1:-1] > 0, np.sqrt(come) / rate[1:-1], np.inf)
    reached[1:-1] = LOOSE * np.min(speeds, axis=1)
    slow = 2 * np.sqrt(np.max(moved[-1] / acceleration))
    cruise = float(np.sum(step[:, 0] * np.minimum(1 / np.maximum(most[1:], 1e-300), 1e300)))
    upper = float(g.s[-1] - g.s[0]) / (LEAST_MEAN * max(cruise, slow))
    found = np.minimum(np.minimum(most, reached), upper)
    found[[0, -1]] = np.maximum(found[[0, -1]], ends)
    return np.asarray(found)


class End(NamedTuple):
    """Motion of s at an end: ds/dt, 1/s, and d²s/dt², 1/s²; NaN: free."""

    speed: float = 0.0
    acceleration: float = np.nan


REST = End(), End()


class _Course(NamedTuple):
    """A piece of s as a polynomial of r in [0, 1], at rest or moving at its ends.

    s leaves rest as r³, so that dr/dt need not vanish at the ends however small the jerk. At a moving end
    ds/dr is not 0, and d²s/dr² is.
    """

    first: float
    last: float
    ends: tuple[End, End] = REST

    def _shape(self, r: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return s and its first three derivatives with respect to r, for s from 0 to 1."""
        left, (starts, arrives) = 1 - r, (end.speed > 0 for end in self.ends)
        if starts and arrives:
            return r, np.ones_like(r), np.zeros_like(r), np.zeros_like(r)
        if starts:
            return 2 * r - 2 * r**3 + r**4, 2 * left**2 * (1 + 2 * r), -12 * r * left, 24 * r - 12
        if arrives:
            return r**3 * (2 - r), 2 * r**2 * (1 + 2 * left), 12 * r * left, 12 - 24 * r
        return (
            r**3 * (10 - 15 * r + 6 * r**2),
            30 * (r * left) ** 2,
            60 * r * left * (1 - 2 * r),
            60 * (1 - 6 * r * left),
        )

    def s(self, r: Floats) -> Floats:
        """Return s at r."""
        return np.clip(self.first + (self.last - self.first) * self._shape(r)[0], self.first, self.last)

    def rates(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """Return ds/dr, d²s/dr², d³s/dr³."""
        first, second, third = ((self.last - self.first) * each for each in self._shape(r)[1:])
        return first, second, third

    def squares(self) -> list[tuple[float, float]]:
        """Return for each end (dr/dt)² and its derivative with respect to r; NaN at an end at rest."""
        rate = self.rates(np.array([0.0, 1.0]))[0]
        return [
            ((end.speed / rate[k]) ** 2, 2 * end.acceleration / rate[k])
            if end.speed > 0
            else (np.nan, np.nan)
            for k, end in enumerate(self.ends)
        ]

    def derivatives(self, of_s: Callable[[Floats], Floats], r: Floats) -> Floats:
        """Return q', q'', q''' with respect to r, (N, 3, 7)."""
        return composed(of_s(np.clip(self.s(r), self.first, np.nextafter(self.last, 0))), *self.rates(r))

    def r(self, s: Floats) -> Floats:
        """Return r at rising values of s."""
        table = np.linspace(0, 1, 20_001)
        known = self.s(table)
        r = np.interp(s, known, table)
        cell = np.clip(np.searchsorted(known, s) - 1, 0, len(table) - 2)
        for _ in range(NEWTON):
            rate = self.rates(r)[0]
            step = (self.s(r) - s) / np.where(rate > 0, rate, np.inf)
            r = np.clip(r - step, table[cell], table[cell + 1])  # at the ends s is flat: a long step
        return np.asarray(r)


class Smooth(NamedTuple):
    """A timing with bounded jerk, from a spline of y = (dr/dt)²; places r (N,) of the bounds."""

    timing: Timing
    knots: Floats
    coefficients: Floats
    places: Floats
    speed: Floats
    over: float  # factor of y beyond the bounds, at least 1; larger only if an end requires it


def smooth(
    derivatives: Callable[[Floats], Floats], g: Grid, bounds: tuple[Floats, Floats, Floats],
    most: Callable[[Floats], Floats], knots: int, ends: tuple[End, End] = REST,
    rough: Timing | None = None, before: Smooth | None = None, broken: Floats = NONE,
) -> Smooth:  # fmt: skip
    """Return a fast timing with bounded jerk from one end to the other, without a stop between.

    `derivatives` gives q', q'', q''' (N, 3, 7) at s (N,), `most` the largest ds/dt (N,), 1/s. `bounds` (7,)
    each: joint velocities, accelerations and jerks, rad/s, rad/s², rad/s³. `knots` is the number of intervals
    of the spline of y if the motion does not slow down often; `ends` is the motion at its start and end. If
    an end moves, `rough` is required, a timing from one end to the other without a bound on jerk. `before` is
    the result with fewer knots: new ones are placed where its speed changes; or stay, if bounds are also
    asked for at s `broken` (K,), where it breaks them.

    If a moving end requires it, bounds are exceeded by as little as is found: `Smooth.over`. Raises
    `MissingExtraError`, and `PathError` if there is no timing.
    """
    course = _Course(float(g.s[0]), float(g.s[-1]), ends)
    _, acceleration, jerk = bounds
    stay = before if len(broken) else None
    if stay is not None:
        cells, places = stay.knots, np.union1d(stay.places, course.r(broken))
    else:
        cells, places = _spread_knots(course, derivatives, g, bounds, most, knots, before)
    fast, bent, (q1, q2, q3) = _reach(course, derivatives, bounds, most, places)
    spline = _Spline(cells, places)
    held = spline.held(course.squares())
    turned = [_rows(spline, (q2, q1 / 2), joint) / a for joint, a in _bounded(acceleration)]
    jolted = [_rows(spline, (q3, 1.5 * q2, q1 / 2), joint) / j for joint, j in _bounded(jerk)]
    reach = np.minimum(fast, bent)
    if rough is not None:
        reach = np.minimum(reach, _speed_of(rough, course, places))
    if stay is not None:
        guesses = [stay.coefficients]
    else:
        guesses = [spline.shape(reach**2, calm) for calm in CALM]
        if before is not None:
            guesses.append(spline.shape(np.minimum(fast, _speed_at(places, before)) ** 2, 0))
    programs = _Programs(spline, guesses, fast**2, turned, jolted, held)
    best = programs.best()
    speed = np.sqrt(spline.values @ best)
    return Smooth(spline.timing(course, best), cells, best, places, speed, programs.over)


def _speed_of(timing: Timing, course: _Course, places: Floats) -> Floats:
    """Return dr/dt at r `places` of a timing over s; infinite where s does not change with r."""
    s = np.append(timing.coefficients[:, 0], 1.0)
    speed = np.sqrt(np.interp(course.s(places), s, timing.speeds() ** 2))
    rate = course.rates(places)[0]
    return np.where(rate > 0, speed / np.where(rate > 0, rate, 1.0), np.inf)


def _spread_knots(
    course: _Course, derivatives: Callable[[Floats], Floats], g: Grid, bounds: tuple[Floats, Floats, Floats],
    most: Callable[[Floats], Floats], knots: int, before: Smooth | None,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Return the spline's knots in r, dense where speed changes, and the r at which bounds are checked."""
    count = min(knots, max(FEWEST, len(g.s)))
    places = np.union1d(_within(np.linspace(0.0, 1.0, count + 1)), course.r(_within(g.s)))
    fast, bent, _ = _reach(course, derivatives, bounds, most, places)
    speed = np.minimum(fast, bent)
    count = max(count, min(needed_knots(speed), len(g.s)))
    if before is None:
        ends = _spread(places, [places, _spent(places, speed)], count)
    else:
        speed = _speed_at(places, before)
        caps = _changes(most(course.s(places)))
        ends = _spread(places, [places, _spent(places, speed), caps, _changes(speed)], count)
    ends = _fine_ends(ends, course.squares())
    first, last = np.linspace([0.0, ends[-2]], [ends[1], 1.0], AT_REST).T
    return ends, np.unique(np.concatenate([places, _within(ends), first, last]))


def _fine_ends(knots: Floats, squares: list[tuple[float, float]]) -> Floats:
    """Return knots, with more at an end where (dr/dt)² (`squares`) falls too fast for a positive spline."""
    (first, slope), (last, rise) = squares
    while first + slope * knots[1] / 3 < first / 2:
        knots = np.insert(knots, 1, knots[1] / 2)
    while last - rise * (1 - knots[-2]) / 3 < last / 2:
        knots = np.insert(knots, -1, (1 + knots[-2]) / 2)
    return knots


def _speed_at(places: Floats, before: Smooth) -> Floats:
    """Return dr/dt of an earlier result at r `places`."""
    return np.asarray(np.interp(places, before.places, before.speed))


def _reach(
    course: _Course, derivatives: Callable[[Floats], Floats], bounds: tuple[Floats, Floats, Floats],
    most: Callable[[Floats], Floats], places: Floats,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Return at r `places` the largest dr/dt by velocity bounds, that by all bounds (roughly), and q', q'',
    q''' with respect to r.
    """
    velocity, acceleration, jerk = bounds
    q1, q2, q3 = d = course.derivatives(derivatives, places).transpose(1, 0, 2)
    with np.errstate(divide="ignore", over="ignore"):
        fast = np.min(velocity / np.abs(q1), axis=1)
        fast = np.minimum(fast, most(course.s(places)) / course.rates(places)[0])
        bent = np.minimum(np.sqrt(acceleration / np.abs(q2)), np.cbrt(jerk / np.abs(q3))).min(axis=1)
    mean = 1 / np.mean(1 / np.minimum(fast, bent))
    highest = mean / LEAST_MEAN
    return np.asarray(np.minimum(fast, highest)), np.asarray(np.minimum(bent, highest)), d


def needed_knots(speed: Floats) -> int:
    """Return how many intervals a spline needs for a speed with so many minima."""
    return min(PER_DIP * _dips(speed), MOST)


def _dips(speed: Floats) -> int:
    """Return how many minima a speed has that are deeper than the factor `DEEP`."""
    found, low, high, falls = 0, np.inf, 0.0, True
    for here in speed.tolist():
        low, high = min(low, here), max(high, here)
        if falls and here > DEEP * low:
            found, high, falls = found + 1, here, False
        elif not falls and DEEP * here < high:
            low, falls = here, True
    return found


def _spent(places: Floats, speed: Floats) -> Floats:
    """Return the time (s) from the first place up to each, for a speed at each."""
    slowness = 1 / speed
    return np.append(0.0, np.cumsum(np.diff(places) * (slowness[1:] + slowness[:-1]) / 2))


def _changes(speed: Floats) -> Floats:
    """Return the sum of |change of log(speed)| up to each place."""
    speed = np.minimum(speed, np.max(speed, initial=1.0, where=np.isfinite(speed)))
    return np.append(0.0, np.cumsum(np.abs(np.diff(np.log(speed)))))


def _spread(places: Floats, rising: list[Floats], count: int) -> Floats:
    """Return count + 1 knots from 0 to 1 at which the mean of the rising quantities grows by equal shares.

    Each is scaled to 0..1 first; flat ones are left out.
    """
    share = np.mean([(each - each[0]) / np.ptp(each) for each in rising if np.ptp(each) > 0], axis=0)
    knots = np.interp(np.linspace(0.0, 1.0, count + 1), share, places)
    knots[[0, -1]] = 0.0, 1.0
    return np.asarray(knots)


def _within(ends: Floats) -> Floats:
    """Return the places at the shares WITHIN of each interval between consecutive ends, in order."""
    return np.asarray((ends[:-1, None] + np.diff(ends)[:, None] * WITHIN).reshape(-1))


def _bounded(bounds: Floats) -> list[tuple[int, float]]:
    """Return joint and bound of each joint with a finite bound."""
    return [(j, float(bounds[j])) for j in range(JOINTS) if np.isfinite(bounds[j])]


def _diagonal(values: Floats) -> Any:
    """Return a sparse diagonal matrix."""
    return needed("scipy.sparse").diags(values)


class _Spline:
    """y(r) by cubic B-splines, its values and two derivatives at places."""

    def __init__(self, knots: Floats, places: Floats) -> None:
        """Compute the matrices that give y and two derivatives at the places from coefficients."""
        self._knots = np.concatenate([np.zeros(3), knots, np.ones(3)])
        self.ends, self._places = knots, places
        self.count = len(knots) + 2
        self.orders = [self.order(places, order) for order in range(3)]
        self.values = self.orders[0]

    def order(self, at: Floats, order: int) -> Any:
        """Return the values, or derivatives, of all B-splines at places, (N, K).

        Those of degree d on knots t, from degree d - 1: d (c[i + 1] - c[i]) / (t[i + d + 1] - t[i + 1]).
        """
        sparse, knots = needed("scipy.sparse"), self._knots
        change = sparse.identity(self.count, format="csr")
        for degree in range(3, 3 - order, -1):
            share = degree / (knots[degree + 1 : -1] - knots[1 : -degree - 1])
            change = sparse.diags([-share, share], [0, 1], shape=(len(share), len(share) + 1)) @ change
            knots = knots[1:-1]
        values = needed("scipy.interpolate").BSpline.design_matrix(at, knots, 3 - order)
        return (values.tocsr() @ change).tocsr()

    def held(self, squares: list[tuple[float, float]]) -> Floats:
        """Return coefficients (K,): two at each end by `squares`, y and dy/dr there; the others are NaN."""
        (first, slope), (last, rise) = squares
        out = np.full(self.count, np.nan)
        out[:2] = first, first + slope * self.ends[1] / 3
        out[-2:] = last - rise * (1 - self.ends[-2]) / 3, last
        return out

    def shape(self, reach: Floats, calm: int) -> Floats:
        """Return positive coefficients of a smooth curve below `reach`, which is given at the places; `calm`
        is the number of knots over which it is smoothed.
        """
        middles = np.convolve(self._knots[1:-1], np.ones(3) / 3, mode="valid")
        low = np.log(np.interp(middles, self._places, reach))
        padded = np.pad(low, 2 * calm, mode="edge")
        eroded = np.min(np.lib.stride_tricks.sliding_window_view(padded, 2 * calm + 1), axis=1)
        return np.exp(np.convolve(eroded, np.ones(2 * calm + 1) / (2 * calm + 1), mode="valid"))

    def timing(self, course: _Course, coefficients: Floats) -> Timing:
        """Return s(t) through the spline's s, ds/dt and d²s/dt² at many r."""
        basis = needed("scipy.interpolate").BSpline
        y = basis(self._knots, coefficients, 3)
        r = np.append((self.ends[:-1, None] + np.diff(self.ends)[:, None] * np.arange(PIECES) / PIECES), 1.0)
        nodes, weights = np.polynomial.legendre.leggauss(4)
        inner = r[:-1, None] + np.diff(r)[:, None] * (nodes + 1) / 2
        spent = np.sum(weights / 2 / np.sqrt(y(inner)), axis=1) * np.diff(r)
        rate, bend, _ = course.rates(r)
        speed = np.sqrt(y(r))
        return through(
            np.concatenate([[0.0], np.cumsum(spent)]), course.s(r), rate * speed,
            bend * speed**2 + rate * y.derivative()(r) / 2,
        )  # fmt: skip


def _rows(spline: _Spline, factors: tuple[Floats, ...], joint: int) -> Any:
    """Return the matrix that gives sum_k factor_k[:, joint] d^k y/dr^k from spline coefficients."""
    return sum(
        _diagonal(factor[:, joint]) @ matrix for factor, matrix in zip(factors, spline.orders, strict=False)
    )


class _Programs:
    """Minimizes time by a sequence of linear programs in z, where the spline's coefficients are unit * z.

    Bounds apply at many places, above and below. A program holds the relevant ones, adds others when they are
    violated, and starts from the solution of the previous one.
    """

    def __init__(
        self, spline: _Spline, guesses: list[Floats], most: Floats, turned: list[Any], jolted: list[Any],
        held: Floats,
    ) -> None:  # fmt: skip
        """Build the rows of bounds: y `most`, accelerations `turned`, jerks `jolted`; coefficients `held` are
        fixed, NaN where free.
        """
        stack = needed("scipy.sparse").vstack
        turns, jolts = stack(turned).tocsr(), stack(jolted).tocsr()
        self._linear = stack([_diagonal(1 / most) @ spline.values, turns, -turns]).tocsr()
        self._jolted = stack([jolts, -jolts]).tocsr()
        self._y = stack([spline.values] * (2 * len(jolted))).tocsr()
        self._weights = np.outer(np.diff(spline.ends), SHARES).reshape(-1)
        self._values = spline.order(_within(spline.ends), 0)
        self._free, self.over = np.isnan(held), 1.0
        if self._free.all():
            self._unit = min((self._kept(guess) for guess in guesses), key=self._time)
        else:
            each = [np.where(self._free, guess, held) for guess in guesses]
            self._unit = min(each, key=lambda guess: max(map(np.max, self._shares(guess))))
        units = _diagonal(self._unit)
        self._linear, self._jolted = self._linear @ units, self._jolted @ units
        self._y, self._values = self._y @ units, self._values @ units
        self._asked = np.empty(0, dtype=int)  # the rows of the program in their order, linear ones first
        self._is_asked = np.zeros(self._linear.shape[0] + self._jolted.shape[0], dtype=bool)
        self._basis: Basis | None = None

    def _time(self, z: Floats) -> float:
        """Return the time (s) of coefficients z."""
        return float(np.sum(self._weights / np.sqrt(self._values @ z)))

    def _kept(self, z: Floats) -> Floats:
        """Return z scaled down (or up) as a whole until the bounds hold exactly."""
        linear, jolted = self._shares(z)
        return np.asarray(z * ((1 - TOLERANCE) / max(linear.max(), jolted.max() ** (2 / 3))))

    def _shares(self, z: Floats) -> tuple[Floats, Floats]:
        """Return the share of each bound that z uses, for velocity and acceleration, and for jerk."""
        return self._linear @ z, (self._jolted @ z) * np.sqrt(self._y @ z)

    def best(self) -> Floats:
        """Return the spline's coefficients that the sequence of programs ends with."""
        z = np.ones(len(self._unit))
        if not self._free.all():
            z = self._brought_within(z)
        time = self._time(z)
        for _ in range(ROUNDS):
            self._ask(z, MATTERS)
            found = self._next(z)
            shares = np.linspace(0.0, 1.0, 11)[1:]
            times = [self._time(z + share * (found - z)) for share in shares]
            k = int(np.argmin(times))
            gain = 1 - times[k] / time
            if gain > 0:
                z, time = z + shares[k] * (found - z), times[k]
            if gain < GAIN:
                break
        return self._unit * z

    def _brought_within(self, z: Floats) -> Floats:
        """Return coefficients that respect the bounds, or exceed all by as little as the programs find.

        Coefficients of the ends cannot be scaled. In these programs all rows share one slack, which is the
        cost.
        """
        cost, slack, basis = np.append(np.zeros(len(z)), 1.0), np.inf, None
        stack = needed("scipy.sparse").hstack

        def elastic(rows: Any) -> Any:
            """Return rows with one more variable, which loosens all of them alike."""
            return stack([rows, np.full((rows.shape[0], 1), -1.0)]).tocsr()

        for _ in range(ROUNDS):
            self._ask(z, 1.0)
            low, high = self._room(z)
            rows = elastic(self._rows(z, self._asked))
            program = LinearProgram(cost, rows, np.append(low, 0.0), np.append(high, MOST_SLACK), basis)
            while True:
                found = program.solved()
                new = self._ask(found[:-1], 1 + SLACKS * found[-1] + 10 * TOLERANCE)
                if not len(new):
                    break
                program.add(elastic(self._rows(z, new)))
            basis = program.basis
            z, before, slack = found[:-1], slack, found[-1]
            if slack <= TOLERANCE or slack > (1 - GAIN) * before:
                break
        linear, jolted = self._shares(z)
        self.over = max(float(linear.max()), float(jolted.max()) ** (2 / 3), 1.0)
        self._linear, self._jolted = self._linear / self.over, self._jolted / self.over**1.5
        return z

    def _room(self, z: Floats) -> tuple[Floats, Floats]:
        """Return the least and greatest coefficients that the next program may choose."""
        return np.where(self._free, z / GROWTH, z), np.where(self._free, GROWTH * z, z)

    def _ask(self, z: Floats, most: float) -> Any:
        """Add the further rows of which z uses more than the share `most`, and return their indices."""
        new = np.flatnonzero((np.concatenate(self._shares(z)) > most) & ~self._is_asked)
        self._is_asked[new] = True
        self._asked = np.append(self._asked, new)
        return new

    def _next(self, z: Floats) -> Floats:
        """Return the z of least time, with the time and jerk bounds linear about the present z."""
        y = self._values @ z
        cost = -(self._values.T @ (self._weights * y**-1.5))
        program = LinearProgram(cost, self._rows(z, self._asked), *self._room(z), self._basis)
        while True:
            found = program.solved()
            new = self._ask(found, 1 + 10 * TOLERANCE)
            if len(new) == 0:
                self._basis = program.basis
                return found
            program.add(self._rows(z, new))

    def _rows(self, z: Floats, asked: Any) -> Any:
        """Return the rows of these indices; jerk bounds are replaced by tangents at z."""
        is_linear = asked < self._linear.shape[0]
        jolts = asked[~is_linear] - self._linear.shape[0]
        here = self._y[jolts]
        y = here @ z
        tangent = _diagonal(0.5 * y**-1.5) @ here
        jolted = _diagonal(np.sqrt(y) / 1.5) @ (self._jolted[jolts] + tangent)
        rows = needed("scipy.sparse").vstack([self._linear[asked[is_linear]], jolted]).tocsr()
        return rows[np.argsort(np.argsort(~is_linear, kind="stable"))]
