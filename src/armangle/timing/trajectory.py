"""Trajectory: a joint path with times, as `retime` returns it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats, Ints, as_floats, frozen
from ..errors import InputError
from .grid import Motion


@dataclass(frozen=True, eq=False)
class Timing:
    """s(t) with three derivatives at the beginning of each piece.

    Parameters
    ----------
    t : ndarray, shape (K + 1,)
        Where pieces begin, and the end, s.
    s, speed, acceleration, jerk : ndarray, shape (K,)
        s, ds/dt, d²s/dt², d³s/dt³ at the beginning of each; the jerk is constant on it.
    """

    t: Floats
    s: Floats
    speed: Floats
    acceleration: Floats
    jerk: Floats

    @property
    def duration(self) -> float:
        """When s is 1, s."""
        return float(self.t[-1])

    def at(self, t: Floats) -> tuple[Floats, Floats, Floats]:
        """Return s, ds/dt and d²s/dt² at times (N,)."""
        k = self._piece(t)
        x, v, a, j = t - self.t[k], self.speed[k], self.acceleration[k], self.jerk[k]
        s = self.s[k] + x * (v + x * (a / 2 + x * j / 6))
        return np.clip(s, 0.0, 1.0), np.maximum(v + x * (a + x * j / 2), 0.0), a + x * j

    def jerk_at(self, t: Floats) -> Floats:
        """Return d³s/dt³ at times (N,)."""
        return np.asarray(self.jerk[self._piece(t)])

    def _piece(self, t: Floats) -> Ints:
        return np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.s) - 1)

    def slower(self, factor: float) -> Timing:
        """Return the same motion that takes `factor` times as long."""
        k = factor
        return Timing(self.t * k, self.s, self.speed / k, self.acceleration / k**2, self.jerk / k**3)


def from_speeds(s: Floats, speed: Floats) -> Timing:
    """Return the timing of speeds ds/dt at s (N + 1,), the acceleration constant between neighbours."""
    step = np.diff(s)
    duration = 2 * step / (speed[1:] + speed[:-1])
    acceleration = np.diff(speed**2) / (2 * step)
    t = np.concatenate([[0.0], np.cumsum(duration)])
    return Timing(t, s[:-1], speed[:-1], acceleration, np.zeros(len(step)))


def joined(pieces: list[Timing]) -> Timing:
    """Return timings one after the other."""
    begins = np.concatenate([[0.0], np.cumsum([piece.duration for piece in pieces])])
    t = np.concatenate([p.t[:-1] + b for p, b in zip(pieces, begins[:-1], strict=True)])
    columns = (
        np.concatenate([getattr(p, name) for p in pieces]) for name in ("s", "speed", "acceleration", "jerk")
    )
    return Timing(np.append(t, begins[-1]), *columns)


_SLACK = 1e-12


class TrajectoryPoint(NamedTuple):
    """Where a trajectory is at t: ``s (...)``, ``q, qd, qdd (..., 7)`` in rad, rad/s, rad/s²."""

    s: Floats | np.float64
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
        The joint 1..7 that would break its bound most; None for ramps.
    bound : "velocity", "acceleration", "corner" or "ramps"
        Which; at a corner of the path the joint's velocity would have to jump; ramps up and down leave no
        room between them.
    ratio : float
        What the joint would need there over what it has; infinite at a corner that has to be stopped at.
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


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """A motion in time along a joint path. Arrays are read-only.

    Between the rows it is as exact as at them: `at` evaluates the closed-form inverse on the path.

    Parameters
    ----------
    path : JointPath
        What is moved along.
    t : ndarray, shape (N,)
        Times of the rows, s, from 0 to `duration`.
    s : ndarray, shape (N,)
        Path parameter in [0, 1].
    q, qd, qdd : ndarray, shape (N, 7)
        Joint values, velocities and accelerations: rad, rad/s, rad/s².
    timing : Timing
        s as a function of t.
    tool_speed : float or None
        The constant tool speed that was asked for, m/s.
    speed_lost : SpeedLoss or None
        Where it cannot be held, first.
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
    _arrays: tuple[str, ...] = field(default=("t", "s", "q", "qd", "qdd"), init=False, repr=False)

    def __post_init__(self) -> None:
        for name in self._arrays:
            array = getattr(self, name).view()
            frozen(array)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def duration(self) -> float:
        """How long the motion takes, s."""
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
        s, qd, qdd = motion_at(self.path, self.timing, times.reshape(-1))
        q = np.asarray(self.path.at(s).q)
        rows = (times.shape, (*times.shape, 7))
        return TrajectoryPoint(
            s.reshape(rows[0])[()], q.reshape(rows[1]), qd.reshape(rows[1]), qdd.reshape(rows[1])
        )

    def explain(self) -> str:
        """Return in words how long the motion takes, and whether a tool speed that was asked for is held."""
        text = f"{self.duration:.6g} s along the path."
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
    path: Motion, timing: Timing, step: float, tool_speed: float | None, lost: SpeedLoss | None
) -> Trajectory:
    """Return the trajectory of a timing with rows every `step` s, and one at its end."""
    count = max(int(np.ceil(timing.duration / step - 1e-9)), 1)
    t = np.append(np.arange(count) * step, timing.duration)
    s, qd, qdd = motion_at(path, timing, t)
    return Trajectory(path, t, s, np.asarray(path.at(s).q), qd, qdd, timing, tool_speed, lost)
