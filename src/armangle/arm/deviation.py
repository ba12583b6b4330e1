"""How far an arm's own chain is from its nominal arm, and the bands in which its branches merge."""

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
"""Random postures at whose poses it is looked how much is proven."""
_WIDEST = np.radians(20.0)
_NARROWEST = 1e-5  # of the widest
_AGAIN = 1e-6  # rad: joints that the inverse gives back
_SINGULAR_JOINTS = (1, 3, 5)


@dataclass(frozen=True)
class ChainDeviation:
    """How far the tip of an arm's own chain is from that of its nominal arm, over postures within the limits.

    Parameters
    ----------
    position_rms, position_max : float
        Distance, m: that of some thousand random postures, and the greatest of them; elsewhere it may be some
        percent more.
    rotation_rms, rotation_max : float
        The same of the angle, rad.
    bands : tuple of 3 float
        How near θ2, θ4 - δ and θ6 were to 0 (rad) at the farthest random posture there that `Arm.inverse` did
        not give back: two branches meet at 0, and on the true arm they part or merge. In these bands the
        status is NEAR_SINGULAR, or the posture is another of the same pose, psi and gc.
    """

    position_rms: float = 0.0
    position_max: float = 0.0
    rotation_rms: float = 0.0
    rotation_max: float = 0.0
    bands: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __str__(self) -> str:
        """Both, in mm, mrad and degrees, in one line."""
        bands = ", ".join(f"{band:.2g}" for band in np.degrees(self.bands))
        return (
            f"{self.position_rms * MILLIMETRES:.3g} mm and {self.rotation_rms * 1e3:.3g} mrad rms, where "
            f"looked at up to {self.position_max * MILLIMETRES:.3g} mm and "
            f"{self.rotation_max * 1e3:.3g} mrad; "
            f"branches merge within {bands} deg of θ2, θ4 - δ, θ6 = 0"
        )


class Chained(Protocol):
    """What is asked of an arm."""

    lower: Floats
    upper: Floats
    chain: Floats | None
    _handle: _core.Arm

    @property
    def delta(self) -> float:
        """Where θ4 is of the stretched arm, rad."""

    @property
    def nominal(self) -> Chained:
        """The exact arm that its arm angle is that of."""

    def forward(self, q: Floats, *, on_error: Any) -> tuple[Floats, Any, Any]: ...
    def inverse(self, pose: Floats, psi: Any, gc: Any, *, limits: bool, on_error: Any) -> Floats: ...
    def within_limits(self, q: Floats, tol: float) -> Any: ...
    def feasible(self, pose: Floats) -> Any: ...


@lru_cache(maxsize=64)
def deviation_of(arm: Chained) -> ChainDeviation:
    """Return the deviation of an arm; zero where it has no chain of its own."""
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
    """Return at what share of the poses of random postures the intervals of all branches are proven."""
    if arm.chain is None:
        return 1.0
    q = _postures(arm, np.random.default_rng(_SEED), LOOKED_AT)
    left_out = arm.feasible(arm.forward(q, on_error="nan")[0]).unproven
    return float(np.mean(~left_out.any(axis=-1)))


def _postures(arm: Chained, rng: np.random.Generator, count: int) -> Floats:
    """Return random postures (n, 7) within the limits; a joint with more than a turn takes one turn."""
    wide = ~(arm.upper - arm.lower < 2.0 * np.pi)
    lower, upper = np.where(wide, -np.pi, arm.lower), np.where(wide, np.pi, arm.upper)
    return rng.uniform(lower, upper, (count, JOINTS))


def _band(arm: Chained, rng: np.random.Generator, joint: int) -> float:
    """Return how near to 0 a singular angle was where the inverse did not give a posture back."""
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
    known = np.nan_to_num(psi)  # of no posture that is given back
    again = arm.inverse(pose, known, gc, limits=False, on_error="nan")  # a seed would be given back
    off = np.abs((again - q + np.pi) % (2 * np.pi) - np.pi)
    lost = np.isfinite(psi) & ~(off.max(axis=1) < _AGAIN)
    return float(np.abs(angle[lost]).max(initial=0.0))
