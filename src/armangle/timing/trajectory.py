"""Trajectory: a joint path with times, the result of `retime`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatOrArray, Floats, as_floats
from .._values import by_content, freeze
from ..errors import InputError
from ..motion.joint_path import SAID
from ..motion.paths import NO_DEVIATION, Deviation
from .motion import Motion


@by_content
@dataclass(frozen=True, eq=False)
class Timing:
    """s(t) in pieces: polynomials of the time since the start of each.

    `t` (K + 1,) are the starts of the pieces, and the end, s. With x the time since the piece began, s is the
    sum over k of ``coefficients[:, k] x**k``, (K, 6). `end_speed` is ds/dt at the end, 1/s.
    """

    t: Floats
    coefficients: Floats
    end_speed: float = 0.0

    @property
    def duration(self) -> float:
        """The time at the end, s."""
        return float(self.t[-1])

    def at(self, t: Floats) -> tuple[Floats, Floats, Floats]:
        """Return s, ds/dt and d²s/dt² at times (N,); s = 1 and ds/dt is `end_speed` at the end.

        s stays below that of the next piece, which may begin at a corner: there joints have another rate.
        """
        s, speed, acceleration, _ = self._orders(t)
        s = np.minimum(s, np.nextafter(np.append(self.coefficients[1:, 0], 1.0)[self._piece(t)], 0.0))
        over = t >= self.t[-1]  # the last pieces take less than a digit of t if no joint moves
        s = np.where(over, 1.0, np.clip(s, 0.0, 1.0))
        speed = np.where(over, self.end_speed, np.maximum(speed, 0.0))
        return s, speed, acceleration

    def jerk_at(self, t: Floats) -> Floats:
        """Return d³s/dt³ at times (N,)."""
        return self._orders(t)[3]

    def _orders(self, t: Floats) -> tuple[Floats, ...]:
        """Return s and its first three derivatives with respect to t."""
        k = self._piece(t)
        x, c = t - self.t[k], self.coefficients[k].T
        found = []
        for _ in range(4):
            found.append(sum(each * x**power for power, each in enumerate(c)))
            c = c[1:] * np.arange(1, len(c))[:, None]
        return tuple(np.asarray(each) for each in found)

    def _piece(self, t: Floats) -> Any:
        """Return the index of the piece at times t."""
        return np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.coefficients) - 1)

    def speeds(self) -> Floats:
        """Return ds/dt at the starts of pieces, and at the end, (K + 1,)."""
        return np.append(self.coefficients[:, 1], self.end_speed)

    def rests(self) -> Floats:
        """Return the middles (s) of pieces with ds/dt 0 at both ends, which take infinitely long."""
        begin, speed = self.coefficients[:, 0], self.speeds()
        k = np.flatnonzero((speed[:-1] == 0) & (speed[1:] == 0))
        return np.asarray((begin[k] + np.append(begin[1:], 1.0)[k]) / 2)

    def of_part(self, first: float, last: float) -> Timing:
        """Return this timing, over s from 0 to 1, as one over s from `first` to `last`."""
        coefficients = self.coefficients * (last - first)
        coefficients[:, 0] += first
        return Timing(self.t, coefficients, self.end_speed * (last - first))

    def slower(self, factor: float) -> Timing:
        """Return the same motion with `factor` times the duration."""
        return Timing(
            self.t * factor, self.coefficients / factor ** np.arange(_TERMS), self.end_speed / factor
        )


_TERMS = 6


def from_speeds(s: Floats, speed: Floats) -> Timing:
    """Return the timing with ds/dt `speed` at s (N + 1,) and constant d²s/dt² between."""
    step = np.diff(s)
    with np.errstate(divide="ignore", over="ignore"):  # infinite where the speed is 0
        duration = 2 * step / (speed[1:] + speed[:-1])
    coefficients = np.zeros((len(step), _TERMS))
    coefficients[:, 0], coefficients[:, 1] = s[:-1], speed[:-1]
    coefficients[:, 2] = np.diff(speed**2) / (4 * step)
    return Timing(np.concatenate([[0.0], np.cumsum(duration)]), coefficients, float(speed[-1]))


def through(t: Floats, s: Floats, speed: Floats, acceleration: Floats) -> Timing:
    """Return the timing with these s, ds/dt and d²s/dt² at times t (K + 1,), a quintic between two."""
    h = np.diff(t)
    v, a = speed[:-1] * h, acceleration[:-1] * h**2 / 2
    left = np.diff(s) - v - a
    slope = speed[1:] * h - v - 2 * a
    bend = acceleration[1:] * h**2 / 2 - a
    terms = [
        s[:-1],
        v,
        a,
        10 * left - 4 * slope + bend,
        7 * slope - 15 * left - 2 * bend,
        6 * left - 3 * slope + bend,
    ]
    return Timing(t, np.stack(terms, axis=1) / h[:, None] ** np.arange(_TERMS), float(speed[-1]))


def of_jerks(s: float, durations: Floats, jerks: Floats) -> Timing:
    """Return the timing from rest at s with constant d³s/dt³ `jerks` for each of the durations."""
    rows, state = [], np.array([s, 0.0, 0.0])
    kept = durations > 0
    for time, jerk in zip(durations[kept], jerks[kept], strict=True):
        position, speed, acceleration = state
        rows.append([position, speed, acceleration / 2, jerk / 6, 0.0, 0.0])
        state = np.array(
            [
                position + time * (speed + time * (acceleration / 2 + time * jerk / 6)),
                speed + time * (acceleration + time * jerk / 2),
                acceleration + time * jerk,
            ]
        )
    return Timing(np.concatenate([[0.0], np.cumsum(durations[kept])]), np.array(rows))


def joined(pieces: list[Timing]) -> Timing:
    """Return consecutive timings as one."""
    begins = np.concatenate([[0.0], np.cumsum([piece.duration for piece in pieces])])
    t = np.concatenate([p.t[:-1] + b for p, b in zip(pieces, begins[:-1], strict=True)])
    coefficients = np.concatenate([piece.coefficients for piece in pieces])
    return Timing(np.append(t, begins[-1]), coefficients, pieces[-1].end_speed)


_SLACK = 1e-12


@by_content
class TrajectoryPoint(NamedTuple):
    """Values of a trajectory at t: ``s (...)``, ``q, qd, qdd (..., 7)`` in rad, rad/s, rad/s²."""

    s: FloatOrArray
    q: Floats
    qd: Floats
    qdd: Floats


@dataclass(frozen=True)
class SpeedLoss:
    """The first place where a constant tool speed cannot be held.

    Parameters
    ----------
    s : float
        Path parameter in [0, 1].
    joint : int or None
        The joint 1..7 that would violate its bound most; None for ramps.
    bound : "velocity", "acceleration", "corner" or "ramps"
        The bound; at a corner of the path the joint's velocity would have to jump; ramps up and down leave no
        room between them.
    ratio : float
        The joint's required value relative to its bound; infinite for ramps, at a corner with a stop, and
        where the tool rests.
    """

    s: float
    joint: int | None
    bound: str
    ratio: float

    @property
    def sentence(self) -> str:
        """The place in words."""
        if self.bound == "corner":
            return (
                f"At s = {self.s:.6g} the path has a corner: the velocity of joint {self.joint} would jump."
            )
        if self.bound == "ramps":
            return f"At s = {self.s:.6g} the tool is slower: ramps to and from what is near leave no room."
        if np.isinf(self.ratio):
            return f"At s = {self.s:.6g} the tool rests while joint {self.joint} moves."
        share = f"{self.ratio:.3g} times its bound"
        return f"At s = {self.s:.6g} joint {self.joint} would need a {self.bound} of {share}."


@by_content
@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """A motion in time along a joint path. Arrays are read-only.

    It is equally exact between the rows: `at` evaluates the closed-form inverse on the path.

    Parameters
    ----------
    path : JointPath
        The path of `s`: the given one without rows that repeat the one before. If corners were rounded it has
        ``at(s).q`` and ``derivatives`` alone.
    t : ndarray, shape (N,)
        Times of the rows, s, from 0 to `duration`.
    s : ndarray, shape (N,)
        Path parameter in [0, 1].
    q, qd, qdd : ndarray, shape (N, 7)
        Joint values, velocities and accelerations: rad, rad/s, rad/s².
    timing : Timing
        s as a function of t.
    tool_speed : float or None
        The requested constant tool speed, m/s.
    speed_lost : SpeedLoss or None
        The first place where it is impossible.
    deviation : Deviation
        Largest deviation of the end effector from the path at rounded corners, m and rad.
    notes : tuple of str
        Notes about untrusted bounds: the arm's notes on its velocities, if these were used.
    """

    path: Motion
    t: Floats
    s: Floats
    q: Floats
    qd: Floats
    qdd: Floats
    timing: Timing
    tool_speed: float | None = None
    speed_lost: SpeedLoss | None = None
    deviation: Deviation = NO_DEVIATION
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "t", "s", "q", "qd", "qdd")

    def __len__(self) -> int:
        return len(self.t)

    @property
    def ok(self) -> bool:
        """True: `retime` raises `PathError` if there is no timing."""
        return True

    @property
    def duration(self) -> float:
        """Duration of the motion, s."""
        return self.timing.duration

    def at(self, t: ArrayLike) -> TrajectoryPoint:
        """Return the motion at any time: q at s(t), q' ds/dt, and q'' (ds/dt)² + q' d²s/dt².

        Parameters
        ----------
        t : array_like, shape (...)
            Times from 0 to `duration`, s.

        Returns
        -------
        TrajectoryPoint
            Fields ``s, q, qd, qdd``.

        Raises
        ------
        InputError
            If a time is outside.
        """
        times = as_floats("t", t)
        bad = ~((times >= -_SLACK) & (times <= self.duration + _SLACK))
        if bad.any():
            raise InputError(f"t holds {times[bad].flat[0]:g}, wanted times from 0 to {self.duration:g} s")
        if self.duration > 0:
            s, qd, qdd = motion_at(self.path, self.timing, times.reshape(-1))
            q = np.asarray(self.path.at(s).q)
        else:
            s, q, qd, qdd = (
                np.repeat(row, times.size, axis=0) for row in (self.s, self.q, self.qd, self.qdd)
            )
        rows = (times.shape, (*times.shape, 7))
        return TrajectoryPoint(
            s.reshape(rows[0])[()], q.reshape(rows[1]), qd.reshape(rows[1]), qdd.reshape(rows[1])
        )

    def explain(self) -> str:
        """Return in words the duration, and whether a requested tool speed is constant or where it is lost.

        Also the rounding of corners, the assumed motion between rows of joints, and untrusted velocities.
        """
        return " ".join([self._explained(), *(f"Note: {note}." for note in self.notes)])

    def _explained(self) -> str:
        """Return in words the duration, and whether the requested tool speed is constant."""
        if self.duration == 0:
            return "No joint moves along the path: 0 s, at rest."
        text = f"{self.duration:.6g} s along the path."
        between = getattr(self.path, "between", None)
        if between is not None and self.path.path is None:
            text += f" {SAID[between]}"
        if max(self.deviation) > 0:
            position, rotation = 1e3 * self.deviation.position, np.degrees(self.deviation.rotation)
            text += f" Corners are rounded by at most {position:.3g} mm and {rotation:.3g} deg."
        if self.tool_speed is None:
            return text
        if self.speed_lost is None:
            return f"{text} The tool moves at {self.tool_speed:g} m/s but for the ramps at both ends."
        return f"{text} {self.tool_speed:g} m/s cannot be held. {self.speed_lost.sentence}"

    def __repr__(self) -> str:
        return f"<Trajectory of {self.duration:.6g} s, {len(self)} rows>"


def motion_at(path: Motion, timing: Timing, t: Floats) -> tuple[Floats, Floats, Floats]:
    """Return s, joint velocities and accelerations at times (N,)."""
    s, speed, acceleration = timing.at(t)
    d = path.derivatives(s)
    first, second = d[:, 0], d[:, 1]
    return s, first * speed[:, None], second * (speed**2)[:, None] + first * acceleration[:, None]


def sampled(
    path: Motion, timing: Timing, step: float, tool_speed: float | None, lost: SpeedLoss | None,
    off: Deviation,
) -> Trajectory:  # fmt: skip
    """Return the trajectory of a timing with rows every `step` s, and one at its end."""
    count = max(int(np.ceil(timing.duration / step - 1e-9)), 1)
    t = np.append(np.arange(count) * step, timing.duration)
    s, qd, qdd = motion_at(path, timing, t)
    return Trajectory(path, t, s, np.asarray(path.at(s).q), qd, qdd, timing, tool_speed, lost, off)


def resting(path: Motion, q: Floats, tool_speed: float | None) -> Trajectory:
    """Return the trajectory that stays at q (7,): one row, 0 s long."""
    timing = Timing(np.zeros(2), np.eye(1, _TERMS))  # s = 1
    still = np.zeros((1, len(q)))
    return Trajectory(path, np.zeros(1), np.ones(1), q[None].copy(), still, still.copy(), timing, tool_speed)
