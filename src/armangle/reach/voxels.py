"""Voxels: the share of all orientations that the end effector reaches at positions in space."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .._arrays import Floats, as_number, as_whole, frozen
from .._threads import thread_count, threads
from .._values import by_content
from ..arm.arm import Arm
from ..errors import InputError
from ..poses import pose

ORIENTATIONS = 100  # number of orientations tried at each position by default
_LEAST, _MOST = 1e-3, 10.0  # m
_MOST_ORIENTATIONS = 100_000
_MOST_VOXELS = 10_000_000
_AT_ONCE = 200_000  # poses, 128 bytes each
_FIRST, _SECOND = np.sqrt(2.0), 1.533751168755204288118041


@by_content
@dataclass(frozen=True, eq=False, repr=False)
class Voxels:
    """Positions of the end effector, and the share of orientations that it reaches there.

    Attributes
    ----------
    position : ndarray, shape (n, 3)
        Middles of the voxels, m, in the frame that poses are given in; positions without a reachable
        orientation are left out.
    share : ndarray, shape (n,)
        Share of the orientations with a solution within the limits, in (0, 1].
    spacing : float
        Edge of a voxel, m.
    orientations : int
        Number of orientations tried at each.
    """

    position: Floats = field()
    share: Floats
    spacing: float
    orientations: int

    def __repr__(self) -> str:
        return f"<{len(self.share)} Voxels of {self.spacing:g} m, {self.orientations} orientations each>"


def voxels_of(arm: Arm, spacing: float, orientations: int) -> Voxels:
    """Return the voxels of an arm: `Arm.reachable` for each orientation at each position."""
    edge = as_number("spacing", spacing, _LEAST, _MOST)
    tried = as_whole("orientations", orientations, 1, _MOST_ORIENTATIONS)
    ball = np.empty(4)
    arm._handle.reach_ball(ball)
    shoulder, radius = ball[:3], float(ball[3])
    half = int(radius / edge) + 1
    if (2 * half + 1) ** 3 > _MOST_VOXELS:
        count = (2 * half + 1) ** 3
        raise InputError(f"spacing is {edge:g} m: {count} voxels, wanted at most {_MOST_VOXELS}")
    line = edge * np.arange(-half, half + 1)
    around = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    places = shoulder + around[np.linalg.norm(around, axis=1) <= radius]
    turned = pose(np.zeros(3), wxyz=even_orientations(tried))
    share = np.empty(len(places))
    step = max(1, _AT_ONCE // len(turned))
    for first in range(0, len(places), step):
        some = places[first : first + step]
        poses = np.broadcast_to(turned, (len(some), *turned.shape)).copy()
        poses[..., :3, 3] = some[:, None]
        with threads(thread_count(0)):
            held = arm.reachable(poses)
        share[first : first + step] = np.asarray(held).mean(axis=1)
    some_held = share > 0
    return Voxels(frozen(places[some_held]), frozen(share[some_held]), edge, tried)


def even_orientations(count: int) -> Floats:
    """Return unit quaternions w x y z (count, 4), spread evenly over all rotations.

    Source: Alexa (2022), "Super-Fibonacci spirals: fast, low-discrepancy sampling of SO(3)".
    """
    middle = np.arange(count) + 0.5
    inner, outer = np.sqrt(middle / count), np.sqrt(1 - middle / count)
    first, second = 2 * np.pi * middle / _FIRST, 2 * np.pi * middle / _SECOND
    return np.stack(
        [inner * np.sin(first), inner * np.cos(first), outer * np.sin(second), outer * np.cos(second)],
        axis=-1,
    )
