"""How far two chains of seven joints are apart at worst."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .chain import Chain, FloatArray

POSTURES = 300
ROUNDING = 1e-9

_SEED = 7
_CLIMBERS = 8
_SWEEPS = 3
_ANGLES = np.linspace(-np.pi, np.pi, 24, endpoint=False)


def worst_difference(one: Chain, other: Chain) -> tuple[float, float]:
    """Return the greatest distance (m) and angle (rad) found between the tips of two chains.

    Random postures over full turns, then from the worst of them joint after joint to the angle
    where the difference is greatest: it varies smoothly, so few sweeps come close to the maximum.
    Below ``ROUNDING`` the random postures are enough.
    """

    def distance(q: FloatArray) -> FloatArray:
        difference = one.forward(q) - other.forward(q)
        return np.asarray(np.linalg.norm(difference[..., :3, 3], axis=-1), dtype=np.float64)

    def angle(q: FloatArray) -> FloatArray:
        return rotation_angle(one.forward(q) - other.forward(q))

    joints = len(one.joints)
    q = np.random.default_rng(_SEED).uniform(-np.pi, np.pi, (POSTURES, joints))
    return _climb(distance, q), _climb(angle, q)


def rotation_angle(difference: FloatArray) -> FloatArray:
    """Return the angles (...), rad, between rotations from the difference (..., 4, 4) of poses."""
    chord = np.linalg.norm(difference[..., :3, :3], axis=(-2, -1)) / np.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(chord, 1.0)), dtype=np.float64)


def _climb(size: Callable[[FloatArray], FloatArray], q: NDArray[np.float64]) -> float:
    """Return the greatest value of ``size`` found from starts ``q`` (n, joints)."""
    found = size(q)
    if found.max() <= ROUNDING:
        return float(found.max())
    best = q[np.argsort(found)[-_CLIMBERS:]]
    rows = np.arange(len(best))
    for _ in range(_SWEEPS):
        for joint in range(q.shape[1]):
            tries = np.repeat(best[:, None], _ANGLES.size + 1, axis=1)
            tries[:, 1:, joint] = _ANGLES
            best = tries[rows, size(tries).argmax(axis=1)]
    return float(size(best).max())
