"""Deviation of an arm's own chain from its nominal arm, and the bands in which its branches merge."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from .._arrays import JOINTS, MILLIMETRES, Floats
from .._values import fill
from ..errors import UnsupportedError
from ..models.axes import rotation_angle
from .any_arm import AnyArm
from .frozen_value import FrozenValue
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


class ChainDeviation(FrozenValue):
    """Deviation of an arm's own chain from its nominal arm, within the limits: `Arm.deviation`.

    Each number is measured when it is first read, over random configurations. Without an own chain all are 0,
    and the share is 1.

    Parameters
    ----------
    arm : Arm
        The arm whose chain is compared.

    Attributes
    ----------
    nominal : Arm
        The arm that defines psi and gc, without obstacles: the one fitted to the chain. For an arm without an
        own chain it is the arm itself.
    position_rms, position_max : float
        Distance, m: over a thousand random configurations, and the largest of them; elsewhere it may be some
        percent larger.
    rotation_rms, rotation_max : float
        The same for the angle, rad.
    bands : tuple of 3 float
        Largest |θ2|, |θ4 - δ| and |θ6| (rad) of a random configuration there that `Arm.inverse` did not
        reproduce. Two branches meet at 0; on the true arm they separate or merge. In these bands the status
        is NEAR_SINGULAR, or the solution is another one of the same pose, psi and gc. With an offset
        wrist or shoulder they are not measured: `UnsupportedError`.
    proven_share : float
        The share of poses, 0 to 1, whose feasible intervals are completely proven in all branches: of 50
        random configurations. At the other poses `Arm.feasible` leaves out unproven parts and returns their
        length in ``unproven``.
    """

    __slots__ = ("_arm",)
    _arm: AnyArm

    def __init__(self, arm: AnyArm) -> None:
        fill(self, _arm=arm)

    def __eq__(self, other: object) -> bool:
        return self._arm == other._arm if isinstance(other, ChainDeviation) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._arm)

    def __reduce__(self) -> tuple[Any, ...]:
        return ChainDeviation, (self._arm,)

    def __repr__(self) -> str:
        return f"{self._arm!r}.deviation"

    @property
    def nominal(self) -> Any:
        """The arm that defines psi and gc."""
        return self._arm._nominal

    @property
    def position_rms(self) -> float:
        """Root mean square of the distance, m."""
        return _off(self._arm)[0]

    @property
    def position_max(self) -> float:
        """Largest distance, m."""
        return _off(self._arm)[1]

    @property
    def rotation_rms(self) -> float:
        """Root mean square of the angle, rad."""
        return _off(self._arm)[2]

    @property
    def rotation_max(self) -> float:
        """Largest angle, rad."""
        return _off(self._arm)[3]

    @property
    def bands(self) -> tuple[float, float, float]:
        """Largest |θ2|, |θ4 - δ| and |θ6| of a configuration that the inverse did not reproduce, rad."""
        return _bands(self._arm)

    @property
    def proven_share(self) -> float:
        """The share of poses whose feasible intervals are completely proven."""
        return _proven_share(self._arm)

    def __str__(self) -> str:
        """Return distances, angles and, if the arm has them, bands in mm, mrad and degrees, on one line."""
        said = (
            f"{self.position_rms * MILLIMETRES:.3g} mm and {self.rotation_rms * 1e3:.3g} mrad rms, where "
            f"looked at up to {self.position_max * MILLIMETRES:.3g} mm and {self.rotation_max * 1e3:.3g} mrad"
        )
        if self._arm.redundancy != "arm_angle":
            return said
        bands = ", ".join(f"{band:.2g}" for band in np.degrees(self.bands))
        return f"{said}; branches merge within {bands} deg of θ2, θ4 - δ, θ6 = 0"


@lru_cache(maxsize=64)
def _off(arm: AnyArm) -> tuple[float, float, float, float]:
    """Return rms and maximum of the distance (m), then of the angle (rad), of the nominal arm's poses."""
    if arm.geometry.chain is None:
        return 0.0, 0.0, 0.0, 0.0
    q = _postures(arm, np.random.default_rng(_SEED), _POSTURES)
    true, near = arm.forward(q, on_error="nan")[0], arm._nominal.forward(q, on_error="nan")[0]
    position = np.linalg.norm((true - near)[:, :3, 3], axis=-1)
    rotation = rotation_angle(true - near)
    return (
        float(np.sqrt(np.mean(position**2))),
        float(position.max()),
        float(np.sqrt(np.mean(rotation**2))),
        float(rotation.max()),
    )


@lru_cache(maxsize=64)
def _bands(arm: AnyArm) -> tuple[float, float, float]:
    """Return the largest distances of the three singular angles from 0 where the inverse loses joints."""
    if arm.geometry.chain is None:
        return 0.0, 0.0, 0.0
    if arm.redundancy != "arm_angle":
        raise UnsupportedError(
            "deviation.bands is not made for an arm on its own chain with an offset wrist or shoulder: "
            "the notes of report say how far the chain is off"
        )
    rng = np.random.default_rng(_SEED)
    first, second, third = (_band(arm, rng, joint) for joint in _SINGULAR_JOINTS)
    return first, second, third


@lru_cache(maxsize=64)
def _proven_share(arm: AnyArm) -> float:
    """Return the share of random configurations' poses whose intervals are proven in all branches."""
    if arm.geometry.chain is None:
        return 1.0
    q = _postures(arm, np.random.default_rng(_SEED), LOOKED_AT)
    left_out = arm.feasible(arm.forward(q, on_error="nan")[0]).unproven
    return float(np.mean(~left_out.any(axis=-1)))


def _postures(arm: AnyArm, rng: np.random.Generator, count: int) -> Floats:
    """Return random configurations (n, 7) within the limits, rad; a range above 2π is cut to [-π, π]."""
    wide = ~(arm.upper - arm.lower < 2.0 * np.pi)
    lower, upper = np.where(wide, -np.pi, arm.lower), np.where(wide, np.pi, arm.upper)
    return rng.uniform(lower, upper, (count, JOINTS))


def _band(arm: AnyArm, rng: np.random.Generator, joint: int) -> float:
    """Return the largest |angle| (rad) of a singular joint at which the inverse misses random joints."""
    q = _postures(arm, rng, _IN_BAND)
    angle = _WIDEST * _NARROWEST ** rng.uniform(0.0, 1.0, _IN_BAND) * rng.choice((-1.0, 1.0), _IN_BAND)
    start = arm.geometry.delta if joint == _SINGULAR_JOINTS[1] else 0.0
    theta = to_theta(arm._handle, q)
    theta[:, joint] = angle + start
    q[:, joint] = to_q(arm._handle, theta)[:, joint]
    theta[:, _SINGULAR_JOINTS[1]] -= arm.geometry.delta
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
