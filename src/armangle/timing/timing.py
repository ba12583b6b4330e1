"""A timing: s as a function of t, a cubic on each piece."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import Floats, Ints


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
