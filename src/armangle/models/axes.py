"""Seven axes in space: where they intersect, and why they may not be S-R-S.

Every measure is independent of the configuration. It compares neighbouring axes only, by their angle, by the
length of their common perpendicular, and by the feet of two perpendiculars on the axis between.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .._arrays import millimetres
from .chain import Chain, FloatArray

UPPER_ARM, FOREARM = 2, 3

SRS_LENGTH, SRS_ANGLE = 2e-5, 1e-5  # m, rad: axes with smaller deviations are those of an S-R-S arm
NEAR_LENGTH = 50e-3  # m: axes with smaller deviations, and perpendicular within
NEAR_ANGLE = math.radians(2.0)  # this angle, are nearly S-R-S
MAX_LENGTH, MAX_ANGLE = 0.1, 0.1  # m, rad: the largest tolerances, and the largest deviation of an own chain

_PARALLEL_SINE = 1e-9
_NOISE, _LENGTH_DIGITS = 1e-12, 12  # rad; decimals of a length
_ROUNDED = 1e-9  # of a bound: rounding of a length that a file writes as a difference
_NO_LENGTH = 4e-5  # m; each of a link's two lengths may count as zero up to half of it
_CENTRES = {"shoulder": (0, 1, 2), "wrist": (4, 5, 6)}


def cross(u: FloatArray, v: FloatArray) -> FloatArray:
    """Return u x v of two vectors (3,), in a tenth of NumPy's time for general arrays."""
    (a, b, c), (x, y, z) = u.tolist(), v.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def angle_about(axis: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the angle (rad, in (-pi, pi]) about `axis` that turns `start` to `end`; a multiple of π/2 is
    exact.
    """
    angle = math.atan2(float(axis @ cross(start, end)), float(start @ end))
    quarter = round(angle / (math.pi / 2.0))
    if abs(angle - quarter * math.pi / 2.0) <= _NOISE:
        return abs(quarter) * math.pi / 2.0 if abs(quarter) == 2 else quarter * math.pi / 2.0
    return angle


def rounded(length: float) -> float:
    """Return a length (m) without the rounding of the file."""
    return round(float(length), _LENGTH_DIGITS) + 0.0


@dataclass(frozen=True, eq=False)
class Axes:
    """Seven axes as lines at q = 0: `points` (7, 3), one on each, m; unit `directions` (7, 3) of positive
    rotation.
    """

    points: FloatArray
    directions: FloatArray

    def squareness_error(self, i: int) -> float:
        """Return the deviation of axes i and i+1 (from 0) from a right angle, rad, in [0, pi/2]."""
        cosine = float(np.abs(self.directions[i] @ self.directions[i + 1]))
        sine = float(np.linalg.norm(cross(self.directions[i], self.directions[i + 1])))
        return float(np.arctan2(cosine, sine))

    def perpendicular(self, i: int, j: int) -> tuple[float, FloatArray]:
        """Return the distance (m) of axes i and j (from 0), and the foot (3,) of the perpendicular on j."""
        between = self.points[j] - self.points[i]
        u, v = self.directions[i], self.directions[j]
        normal = cross(u, v)
        square = float(normal @ normal)
        if square < _PARALLEL_SINE**2:
            foot = self.foot(self.points[i], j)
            return float(np.linalg.norm(foot - self.points[i])), foot
        foot = self.points[j] - v * float(cross(u, between) @ normal) / square
        return float(abs(between @ normal)) / square**0.5, foot

    def foot(self, point: FloatArray, i: int) -> FloatArray:
        """Return the point (3,) of axis i that is nearest to a point (3,), m."""
        v = self.directions[i]
        return np.asarray(self.points[i] + v * (v @ (point - self.points[i])), dtype=np.float64)

    def centre(self, where: str) -> FloatArray:
        """Return the point (3,) nearest to the three axes of the shoulder or wrist, m."""
        index = list(_CENTRES[where])
        u = self.directions[index]
        across = np.eye(3) - u[:, :, None] * u[:, None, :]
        shift = np.einsum("ijk,ik->j", across, self.points[index] - self.points[index[0]])
        step = np.linalg.lstsq(across.sum(axis=0), shift, rcond=None)[0]
        return np.asarray(self.points[index[0]] + step, dtype=np.float64)

    def misses(self, where: str) -> dict[str, float]:
        """Return the lengths (m) by which the three axes of "shoulder" or "wrist" miss a common point.

        The keys are texts with ``{}`` for the length.
        """
        a, b, c = _CENTRES[where]
        lengths: dict[str, float] = {}
        for i, j in pairwise((a, b, c)):
            lengths[f"axes {i + 1} and {j + 1} pass {{}} apart"] = self.perpendicular(i, j)[0]
        feet = self.perpendicular(a, b)[1] - self.perpendicular(c, b)[1]
        what = f"axes {a + 1} and {c + 1} meet axis {b + 1} {{}} apart"
        lengths[what] = float(np.linalg.norm(feet))
        return lengths

    def elbow_ends(self) -> tuple[FloatArray, FloatArray]:
        """Return the points (3,) of axis 4 nearest to axis 3 and to axis 5, m."""
        return self.perpendicular(2, 3)[1], self.perpendicular(4, 3)[1]

    @cached_property
    def worst_miss(self) -> tuple[float, float]:
        """Return the largest of `misses` for the shoulder, and for the wrist, m."""
        return max(self.misses("shoulder").values()), max(self.misses("wrist").values())

    @cached_property
    def worst_squareness(self) -> float:
        """Return the largest deviation of two neighbours from a right angle, rad."""
        return max(self.squareness_error(i) for i in range(len(self.points) - 1))

    def extent(self) -> float:
        """Return the total length of upper arm and forearm, m."""
        ends = zip(("shoulder", "wrist"), self.elbow_ends(), strict=True)
        return sum(float(np.linalg.norm(self.centre(where) - end)) for where, end in ends)


@dataclass(frozen=True)
class Reason:
    """One reason against S-R-S: a sentence, and its effect on the position of the end effector, m."""

    sentence: str
    size: float
    is_length: bool


def exceeds(value: float, most: float) -> bool:
    """Return whether a value exceeds a bound by more than rounding."""
    return value > most + _ROUNDED * abs(most) if math.isfinite(most) else value > most


def above(value: float) -> str:
    """Return a number slightly above a positive value, with three digits, as text."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"{(math.floor(value / step) + 1) * step:.3g}"


def differs(off: tuple[float, float]) -> str:
    """Return a deviation (m, rad) as text in mm and degrees."""
    return f"{millimetres(off[0])} and {math.degrees(off[1]):.3g} deg"


def tolerances(length: float | None, angle: float | None) -> str:
    """Return, as text, arguments that permit deviations (m, rad; None for one that is not needed)."""
    given = {"length": length, "angle": angle}
    return " and ".join(
        f"{name}_tolerance={above(value)}" for name, value in given.items() if value is not None
    )


def reasons_against(axes: Axes, angle: float, length: float) -> list[Reason]:
    """Return every reason why the axes are not S-R-S, most important first.

    `angle` (rad) is the permitted deviation of neighbours from 90 degrees, `length` (m) the permitted
    distance of axes from a common point. Angles are ranked by their effect over the length of the arm.
    """
    reasons = [
        Reason(_square_sentence(i, axes), axes.squareness_error(i) * axes.extent(), False)
        for i in range(6)
        if exceeds(axes.squareness_error(i), angle)
    ]
    for where, members in _CENTRES.items():
        misses = sorted((-miss, what) for what, miss in axes.misses(where).items() if exceeds(miss, length))
        if misses:
            worst = -misses[0][0]
            names = "axes {}, {} and {}".format(*(i + 1 for i in members))
            detail = ", ".join(what.format(millimetres(-miss)) for miss, what in misses)
            sentence = f"{names} miss a common {where} point by {millimetres(worst)} ({detail})"
            reasons.append(Reason(sentence, worst, True))
    reasons += _elbow_reasons(axes)
    return sorted(reasons, key=lambda reason: -reason.size)


def _square_sentence(i: int, axes: Axes) -> str:
    """Return the sentence that axes i and i+1 (from 0) are not perpendicular."""
    cosine = float(np.clip(axes.directions[i] @ axes.directions[i + 1], -1.0, 1.0))
    apart = f"axes {i + 1} and {i + 2} are {np.degrees(np.arccos(cosine)):.6g} deg apart, not 90"
    if i == UPPER_ARM:
        return f"the upper arm does not run along axis 3: {apart}"
    if i == FOREARM:
        return f"the forearm does not run along axis 5: {apart}"
    return f"neighbours are not orthogonal: {apart}"


def _elbow_reasons(axes: Axes) -> list[Reason]:
    """Return reasons for links without length: axis 4 passes through the shoulder or the wrist."""
    reasons = []
    upper, fore = axes.elbow_ends()
    for where, part, end in (("shoulder", "upper arm", upper), ("wrist", "forearm", fore)):
        size = float(np.linalg.norm(axes.centre(where) - end))
        if size <= _NO_LENGTH:
            sentence = f"axis 4 passes through the {where} point: the {part} has no length"
            reasons.append(Reason(sentence, float("inf"), False))
    return reasons


POSTURES = 300
ROUNDING = 1e-9

_SEED = 7
_CLIMBERS = 8
_SWEEPS = 3
_ANGLES = np.linspace(-np.pi, np.pi, 24, endpoint=False)


def worst_difference(one: Chain, other: Chain) -> tuple[float, float]:
    """Return the largest distance (m) and angle (rad) found between the end effectors of two chains.

    Random configurations over full turns, then from the worst of them joint after joint to the angle of the
    largest difference. It varies smoothly, so few sweeps come close to the maximum. Below ``ROUNDING`` the
    random configurations suffice.
    """

    def distance(difference: FloatArray) -> FloatArray:
        """Return the distances (...), m, from the difference (..., 4, 4) of poses."""
        return np.asarray(np.linalg.norm(difference[..., :3, 3], axis=-1), dtype=np.float64)

    q = np.random.default_rng(_SEED).uniform(-np.pi, np.pi, (POSTURES, len(one.joints)))
    return _climb(one, other, distance, q), _climb(one, other, rotation_angle, q)


def rotation_angle(difference: FloatArray) -> FloatArray:
    """Return the angles (...), rad, between rotations from the difference (..., 4, 4) of poses."""
    chord = np.linalg.norm(difference[..., :3, :3], axis=(-2, -1)) / np.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(chord, 1.0)), dtype=np.float64)


def _climb(
    one: Chain, other: Chain, size: Callable[[FloatArray], FloatArray], q: NDArray[np.float64]
) -> float:
    """Return the largest `size` of the difference of two end effectors found by coordinate search from the
    joints `q` (n, joints).
    """
    found = size(one.forward(q) - other.forward(q))
    if found.max() <= ROUNDING:
        return float(found.max())
    best = q[np.argsort(found)[-_CLIMBERS:]]
    rows = np.arange(len(best))
    for _ in range(_SWEEPS):
        for joint in range(q.shape[1]):
            tries = np.column_stack([best[:, joint], np.tile(_ANGLES, (len(best), 1))])
            differences = one.swept(best, joint, tries) - other.swept(best, joint, tries)
            best[:, joint] = tries[rows, size(differences).argmax(axis=1)]
    return float(size(one.forward(best) - other.forward(best)).max())
