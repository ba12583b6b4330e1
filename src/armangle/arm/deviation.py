"""Deviation of an arm's own chain from its nominal arm, and the bands in which its branches merge."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from .. import _core
from .._arrays import JOINTS, MILLIMETRES, Floats
from .joint_map import to_q, to_theta

_SEED = 5
_POSTURES = 1000
_IN_BAND = 1500
LOOKED_AT = 50
"""Number of random configurations at whose poses the proven share is measured."""
_WIDEST = np.radians(20.0)
_NARROWEST = 1e-5  # of the widest
_AGAIN = 1e-6  # rad: accuracy at which the inverse reproduces joints
_SINGULAR_JOINTS = (1, 3, 5)


@dataclass(frozen=True)
class ChainDeviation:
    """Deviation of the end effector of an arm's own chain from its nominal arm, within the limits.

    Parameters
    ----------
    position_rms, position_max : float
        Distance, m: over some thousand random configurations, and the largest of them; elsewhere it may be
        some percent larger.
    rotation_rms, rotation_max : float
        The same for the angle, rad.
    bands : tuple of 3 float
        Largest |θ2|, |θ4 - δ| and |θ6| (rad) of a random configuration there that `Arm.inverse` did not
        reproduce. Two branches meet at 0; on the true arm they separate or merge. In these bands the status
        is NEAR_SINGULAR, or the solution is another one of the same pose, psi and gc.
    """

    position_rms: float = 0.0
    position_max: float = 0.0
    rotation_rms: float = 0.0
    rotation_max: float = 0.0
    bands: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __str__(self) -> str:
        """Return both in mm, mrad and degrees, on one line."""
        bands = ", ".join(f"{band:.2g}" for band in np.degrees(self.bands))
        return (
            f"{self.position_rms * MILLIMETRES:.3g} mm and {self.rotation_rms * 1e3:.3g} mrad rms, where "
            f"looked at up to {self.position_max * MILLIMETRES:.3g} mm and "
            f"{self.rotation_max * 1e3:.3g} mrad; "
            f"branches merge within {bands} deg of θ2, θ4 - δ, θ6 = 0"
        )


class Chained(Protocol):
    """The functions that an arm must have."""

    lower: Floats
    upper: Floats
    chain: Floats | None
    _handle: _core.Arm

    @property
    def delta(self) -> float:
        """θ4 of the stretched arm, rad."""

    @property
    def nominal(self) -> Chained:
        """The exact arm that defines the arm angle."""

    def forward(self, q: Floats, *, on_error: Any) -> tuple[Floats, Any, Any]: ...
    def inverse(self, pose: Floats, psi: Any, gc: Any, *, limits: bool, on_error: Any) -> Floats: ...
    def within_limits(self, q: Floats, tol: float) -> Any: ...
    def feasible(self, pose: Floats) -> Any: ...


@lru_cache(maxsize=64)
def deviation_of(arm: Chained) -> ChainDeviation:
    """Return the deviation of an arm; zero without its own chain."""
    if arm.chain is None:
        return ChainDeviation()
    rng = np.random.default_rng(_SEED)
    q = _postures(arm, rng, _POSTURES)
    true, near = arm.forward(q, on_error="nan")[0], arm.nominal.forward(q, on_error="nan")[0]
    position = np.linalg.norm((true - near)[:, :3, 3], axis=-1)
    chord = np.linalg.norm((true - near)[:, :3, :3], axis=(-2, -1)) / np.sqrt(8.0)
    rotation = 2.0 * np.arcsin(np.minimum(chord, 1.0))
    first, second, third = (_band(arm, rng, joint) for joint in _SINGULAR_JOINTS)
    return ChainDeviation(
        float(np.sqrt(np.mean(position**2))),
        float(position.max()),
        float(np.sqrt(np.mean(rotation**2))),
        float(rotation.max()),
        (first, second, third),
    )


@lru_cache(maxsize=64)
def proven_share_of(arm: Chained) -> float:
    """Return the share of random configurations' poses whose intervals are proven in all branches."""
    if arm.chain is None:
        return 1.0
    q = _postures(arm, np.random.default_rng(_SEED), LOOKED_AT)
    left_out = arm.feasible(arm.forward(q, on_error="nan")[0]).unproven
    return float(np.mean(~left_out.any(axis=-1)))


def _postures(arm: Chained, rng: np.random.Generator, count: int) -> Floats:
    """Return random configurations (n, 7) within the limits, rad; a range above 2π is cut to [-π, π]."""
    wide = ~(arm.upper - arm.lower < 2.0 * np.pi)
    lower, upper = np.where(wide, -np.pi, arm.lower), np.where(wide, np.pi, arm.upper)
    return rng.uniform(lower, upper, (count, JOINTS))


def _band(arm: Chained, rng: np.random.Generator, joint: int) -> float:
    """Return the largest |angle| (rad) of a singular joint at which the inverse misses random joints."""
    q = _postures(arm, rng, _IN_BAND)
    angle = _WIDEST * _NARROWEST ** rng.uniform(0.0, 1.0, _IN_BAND) * rng.choice((-1.0, 1.0), _IN_BAND)
    start = arm.delta if joint == _SINGULAR_JOINTS[1] else 0.0
    theta = to_theta(arm._handle, q)
    theta[:, joint] = angle + start
    q[:, joint] = to_q(arm._handle, theta)[:, joint]
    theta[:, _SINGULAR_JOINTS[1]] -= arm.delta
    others = [other for other in _SINGULAR_JOINTS if other != joint]
    alone = (np.abs(np.sin(theta[:, others])) > np.sin(_WIDEST)).all(axis=1)
    counts = alone & np.asarray(arm.within_limits(q, 1e-9))
    if not counts.any():
        return 0.0
    q, angle = q[counts], angle[counts]
    pose, psi, gc = arm.forward(q, on_error="nan")
    known = np.nan_to_num(psi)  # for configurations that are not reproduced
    again = arm.inverse(pose, known, gc, limits=False, on_error="nan")  # with a seed it would return the seed
    off = np.abs((again - q + np.pi) % (2 * np.pi) - np.pi)
    lost = np.isfinite(psi) & ~(off.max(axis=1) < _AGAIN)
    return float(np.abs(angle[lost]).max(initial=0.0))
