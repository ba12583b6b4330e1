"""The laws of the core as measures: each returns numbers that a test compares with the stated bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import armangle as aa
from support.strategies import TURN, Array, bends, unlimited

POSE = 1e-12
"""Largest difference of an entry of a pose, m or 1."""

JOINT = 1e-9
"""Largest difference of a joint that comes back, rad; and the clearance at which limits are decided."""

EPS = float(np.finfo(float).eps)
WINDOW = np.array([-2e-9, -1e-9, 0.0, 1e-9, 2e-9])
JOINT_COUNT = 7
PIVOTS = np.array([1, 0, 1, 0, 1, 0, 1], dtype=bool)
BEND_OF = np.array([0, 0, 0, 1, 2, 2, 2])
"""Which of (theta_2, theta_4 - delta, theta_6) a joint is singular with."""


def gap(a: Array, b: Array) -> float:
    """Largest difference of two arrays; 0 for empty ones."""
    return float(np.abs(np.asarray(a) - np.asarray(b)).max(initial=0.0))


def circle_gap(a: Array, b: Array) -> Array:
    """Distance of angles on the circle, rad, element by element."""
    return np.asarray(np.abs((np.asarray(a) - b + np.pi) % TURN - np.pi))


def axis_distance(arm: aa.Arm, pose: Array) -> Array:
    """Distance r of the wrist from the base axis, m, shape (...)."""
    flange = np.linalg.inv(arm.base) @ pose @ np.linalg.inv(arm.tool)
    wrist = flange[..., :3, 3] - arm.geometry.d_wf * flange[..., :3, 2]
    return np.asarray(np.hypot(wrist[..., 0], wrist[..., 1]))


def is_regular(arm: aa.Arm, q: Array, pose: Array) -> NDArray[np.bool_]:
    """Where the inverse must reproduce joints: |sin| of all three bends >= 1e-3 and r >= 1 mm."""
    bent = np.abs(np.sin(bends(arm, q))).min(axis=-1) >= 1e-3
    return np.asarray(bent & (axis_distance(arm, pose) >= 1e-3))


def members(arcs: aa.ArcSet, psi: Array) -> NDArray[np.bool_]:
    """Whether psi (P, K) lies in the intervals of arcs (P,), without tolerance."""
    lower, upper = arcs.intervals[..., 0], arcs.intervals[..., 1]
    past = (psi[:, :, None] - lower[:, None]) % TURN
    return np.asarray((past <= (upper - lower)[:, None]).any(-1) | arcs.is_full[:, None])


@dataclass(frozen=True)
class Truth:
    """What the joints say, by solving for them: all of shape (P, K, 7)."""

    q: Array
    inside: NDArray[np.bool_]
    distance: Array
    """To the nearest limit in either direction of any winding, rad; infinite where there is none."""
    blur: Array
    """What rounding of psi and of the pose does to the joint, rad."""

    def is_clear(self, slack: float) -> NDArray[np.bool_]:
        """Whether joints are farther from their limits than rounding moves them and than `slack` (rad)."""
        return np.asarray(self.distance > slack + 1e-15 + self.blur)


def truth(arm: aa.Arm, pose: Array, gc: Array, psi: Array) -> Truth:
    """The joints at psi (P, K) of poses (P, 4, 4), each compared with its limits up to multiples of 2π."""
    free = unlimited(arm)
    q = free.inverse(pose[:, None], psi, gc[:, None], limits=False)
    width = arm.upper - arm.lower
    turning = ~(width < TURN)
    with np.errstate(invalid="ignore"):
        inside = ((q - arm.lower) % TURN <= width) | turning
        distance = np.minimum(circle_gap(q, arm.lower), circle_gap(q, arm.upper))
    distance = np.where(turning, np.inf, distance)
    slope = np.abs(free.self_motion(pose[:, None], psi, gc[:, None]))
    return Truth(q, np.asarray(inside), distance, 16 * EPS * (slope + _sensitivity(arm, q)))


def _sensitivity(arm: aa.Arm, q: Array) -> Array:
    """By how much the rounding error of joints 1, 3, 5, 7 exceeds that of the pose: 1 / |sin| of the bend; 0
    for the others, and 1 where the bend vanishes on the whole circle and the library's convention holds.
    """
    sine = np.abs(np.sin(bends(arm, q)))
    whole = sine.max(axis=1, keepdims=True) <= 1e-13
    sine = np.where(whole, 1.0, np.maximum(sine, 1e-300))
    return np.where(PIVOTS, 1 / sine[..., BEND_OF], 0.0)


@dataclass(frozen=True)
class Verdict:
    """Samples, those with all joints clear of their limits, and those of them that the arcs get wrong."""

    samples: int
    clear: int
    wrong: list[str]


def classify(arm: aa.Arm, pose: Array, gc: Array, psi: Array) -> Verdict:
    """Compare arcs, of each joint and of all, with limits at psi, where all joints are clear of their limits.

    Clear is further from a limit than 1e-9 rad and than rounding of psi and pose moves the joint. A sample
    whose joint is beyond its limit at a psi 1e-9 rad away, or may be for all that rounding leaves of it
    there, lies in a piece that is dropped by definition; where both hinges come within 1e-9 rad of 0, two
    such pieces follow one another.
    """
    real = truth(arm, pose, gc, psi)
    clear = real.is_clear(JOINT)
    each = arm.feasible(pose, gc, per_joint=True)
    said = np.stack([members(each[:, j], psi) for j in range(JOINT_COUNT)], axis=-1)
    together = members(arm.feasible(pose, gc), psi)[..., None]
    doubts = np.concatenate([(said != real.inside) & clear,
                             (together != real.inside.all(-1, keepdims=True))
                             & clear.all(-1, keepdims=True)], axis=-1)  # fmt: skip
    wrong = []
    for p, k, j in zip(*np.nonzero(doubts), strict=True):
        near = truth(arm, pose[p : p + 1], gc[p : p + 1], psi[p : p + 1, k : k + 1] + WINDOW)
        joint = slice(None) if j == JOINT_COUNT else slice(j, j + 1)
        inside, clear_there = near.inside[0, :, joint], near.is_clear(0.0)[0, :, joint]
        if (inside & clear_there).all() or (~inside & clear_there).any(-1).all():
            what = "all joints" if j == JOINT_COUNT else f"joint {j + 1}"
            wrong.append(f"{what}: not {bool(inside.all())} at psi={psi[p, k]!r} gc={gc[p]} of {arm!r}, "
                         f"pose={pose[p].tolist()}, q={real.q[p, k].tolist()}")  # fmt: skip
    return Verdict(psi.size, int(clear.all(-1).sum()), wrong)
