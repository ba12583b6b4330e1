"""The objective of a plan by plain sums over many samples: no series, no splines, no Gauss points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import armangle as aa

from .moves import line

SAMPLES = 2001
EVEN = np.linspace(0, 1, SAMPLES)
REFERENCE, FLOOR, HOME, ENOUGH = 0.2, 0.02, 0.1, 0.35


@dataclass
class Terms:
    """The terms of the objective of a motion, each without its weight."""

    travel: float
    limits: float
    singularities: float

    @property
    def total(self) -> float:
        """The sum of all terms."""
        return self.travel + self.limits + self.singularities


def length(arm: aa.Arm, path: aa.Path, steps: int = 2001) -> float:
    """The length of a path, rad: the sum over steps of the largest of the rotations of wrist direction, elbow
    and tool; at least 1e-4.
    """
    frames = arm.frames(np.zeros(7))
    shoulder = frames[1, :3, 3]
    poses = path.pose(np.linspace(0, 1, steps))
    flange_to_wrist = np.linalg.inv(arm.tool) @ np.array([0, 0, -arm.geometry.d_wf, 1.0])
    wrist = (poses @ flange_to_wrist)[:, :3] - shoulder
    reach = np.linalg.norm(wrist, axis=1)
    upper, lower = (
        np.hypot(arm.geometry.d_se, arm.geometry.a_3),
        np.hypot(arm.geometry.d_ew, arm.geometry.a_4),
    )
    cosine = np.clip((reach**2 - upper**2 - lower**2) / (2 * upper * lower), -1, 1)
    elbow = np.stack([cosine, np.sqrt(1 - cosine**2)], axis=1)
    chords = [
        np.linalg.norm(np.diff(x, axis=0), axis=1)
        for x in (wrist / reach[:, None], elbow, poses[:, :3, 0], poses[:, :3, 2])
    ]
    return max(1e-4, float(np.max(chords, axis=0).sum()))


def margin_scale(arm: aa.Arm, path: aa.Path) -> float:
    """The factor of the costs of margins along a path, from its `length`."""
    turned = length(arm, path)
    return max(turned**2, min(1.0, (turned / 0.5) ** 2))


def nearness(distance: np.ndarray, enough: float, floor: float = FLOOR) -> np.ndarray:
    """The cost (...) of distances d (..., k), rad, from limits, summed over k: (0.2 / d - 0.2 / enough)^2,
    below `floor` its tangent; 0 from `enough` on, and everywhere if `enough` is at most FLOOR.
    """
    if enough <= FLOOR:
        return np.zeros(distance.shape[:-1])
    held = np.maximum(distance, floor)
    near = REFERENCE / held - REFERENCE / enough
    cost = near**2 + 2 * near * REFERENCE / held * (held - distance) / held
    return np.where(distance < enough, cost, 0.0).sum(axis=-1)


def singular(distance: np.ndarray, enough: float) -> np.ndarray:
    """The cost (...) of distances (..., k), rad, from singularities, 0 from `enough` on."""
    return nearness(distance, enough, min(HOME, enough / 2))


def terms(
    arm: aa.Arm, path: aa.Path, q: np.ndarray, enough: float = ENOUGH, limit_margin: float = 0.0,
    singularity_margin: float = 0.0,
) -> Terms:  # fmt: skip
    """The terms of joints (N, 7) at equal steps of s from 0 to 1: limits but those of joint 4, singularities
    of joints 2 and 6.
    """
    moving = [0, 1, 2, 4, 5, 6]
    steps = np.diff(q, axis=0)
    theta = arm.geometry.signs * q + arm.geometry.offsets
    hinges = np.abs(np.angle(np.exp(1j * theta[:, [1, 5]])))
    bounds = np.concatenate([q - arm.lower, arm.upper - q], axis=1)[:, moving + [7 + j for j in moving]]
    weight = margin_scale(arm, path)

    def mean(x: np.ndarray) -> float:
        """The mean over s times the weight."""
        return float((0.5 * (x[1:] + x[:-1])).mean()) * weight

    return Terms(
        travel=float((steps**2).sum()) * len(steps),
        limits=mean(nearness(bounds - limit_margin, enough)),
        singularities=mean(
            singular(np.concatenate([hinges, np.pi - hinges], axis=1) - singularity_margin, enough)
        ),
    )


def planned(result: aa.JointPath) -> np.ndarray:
    """The joints of a plan, (SAMPLES, 7)."""
    return result.at(np.linspace(0, 1, SAMPLES)).q


def reversals(q: np.ndarray, still: float = 1e-3) -> int:
    """The number of reversals by more than `still` (rad) over all joints of (N, 7)."""
    count = 0
    for joint in q.T:
        way, farthest = 0.0, joint[0]
        for x in joint:
            if way * (farthest - x) > still:
                count += 1
            if abs(x - farthest) > still or way * (x - farthest) > 0:
                way, farthest = (np.sign(x - farthest) if abs(x - farthest) > still else way), x
    return count


def free_lines(arm: aa.Arm, length: float, number: int) -> list[tuple[np.ndarray, aa.Line, aa.JointPath]]:
    """`number` times random joints, a line of `length` (m) from their pose, and the motion along it at a
    constant arm angle, 6 degrees from all limits, and from 0 in joints 2 and 6.
    """
    rng, found = np.random.default_rng(1), []
    while len(found) < number:
        q = rng.uniform(arm.lower * 0.8, arm.upper * 0.8)
        shift = rng.normal(size=3)
        path = line(arm, q, length * shift / np.linalg.norm(shift))
        held = aa.follow(arm, path, start=q, policy=aa.Hold(), samples=200)
        if held.ok and min(held.margin.min(), np.abs(held.q[:, [1, 5]]).min()) > np.radians(6):
            found.append((q, path, held))
    return found
