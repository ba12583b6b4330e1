"""Streams of hands: smooth random motions, with the noise, outliers and sampling that real ones have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import armangle as aa

Array = NDArray[np.float64]

SCENARIOS = ("inside", "fast", "beyond", "singular", "limits", "glitch")
POSTURES = {
    "kuka_iiwa14_r820": [0.0, 40.0, 20.0, -80.0, 0.0, 60.0, 0.0],
    "realman_rm75_b": [0.0, 40.0, 20.0, -80.0, 0.0, 60.0, 0.0],
    "openarm_v10": None,
}
VELOCITY = {"realman_rm75_b": np.radians([179.9, 179.9, 224.6, 224.6, 224.6, 224.6, 224.6])}
"""Joint speeds of arms whose hands in `stream` are faster than the catalogue's, rad/s."""
NOISE = 0.4e-3, np.radians(0.08)
HAND_RATE = 90.0
OUTLIERS, OUTLIER = 12, 0.3
STEPS, STEP = 3, 0.06
REST = 0.5


@dataclass(frozen=True)
class Stream:
    """The poses of a hand at each control cycle, what a tracker is given, and when that is new."""

    dt: float
    true: Array
    samples: Array
    fresh: NDArray[np.bool_]


def rotation(vectors: Array) -> Array:
    """Return the rotations (n, 3, 3) about vectors (n, 3), rad."""
    angle = np.linalg.norm(vectors, axis=-1)[:, None, None]
    K = np.zeros((len(vectors), 3, 3))
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -vectors[:, 2], vectors[:, 1], -vectors[:, 0]
    K -= np.swapaxes(K, 1, 2)
    sinc = np.sinc(angle / np.pi)
    versine = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.eye(3) + sinc * K + versine * (K @ K)


def posture(arm: aa.Arm) -> Array:
    """Return joints far from limits and singularities, at which a stream begins: of POSTURES, or searched."""
    given = POSTURES.get(arm.name or "")
    if given is not None:
        return np.radians(given)
    middle = 0.5 * (arm.lower + arm.upper)
    width = arm.upper - arm.lower
    rng = np.random.default_rng(1)
    trial = middle + width * rng.uniform(-0.3, 0.3, (2000, 7))
    bend = np.abs(
        np.sin(trial[:, [1, 3, 5]] * arm.geometry.signs[[1, 3, 5]] + arm.geometry.offsets[[1, 3, 5]])
    ).min(-1)
    room = np.minimum(trial - arm.lower, arm.upper - trial).min(-1)
    return np.asarray(trial[np.argmax(np.minimum(room, bend))])


def _smooth(rng: np.random.Generator, t: Array, highest: float) -> Array:
    """Return three smooth random functions of time (n, 3) with amplitudes near 1."""
    out = np.zeros((len(t), 3))
    for _ in range(5):
        f, phase = rng.uniform(0.1, 1.0, 3) * highest, rng.uniform(0, 2 * np.pi, 3)
        out += rng.uniform(0.2, 0.6, 3) * np.sin(2 * np.pi * f * t[:, None] + phase)
    return out


def hand(arm: aa.Arm, scenario: str, seed: int, dt: float, seconds: float) -> Array:
    """Return the poses of a hand (n, 4, 4), beginning at the pose of `posture`."""
    rng = np.random.default_rng([seed, SCENARIOS.index(scenario)])
    t = dt * np.arange(round(seconds / dt))
    reach = arm.geometry.d_se + arm.geometry.d_ew
    start = arm.forward(posture(arm))[0]
    highest, metres, radians = 0.35, 0.1 * reach, 0.3
    centre = np.zeros(3)
    if scenario == "fast":
        highest, metres, radians = 1.6, 0.05 * reach, 0.15
    if scenario == "beyond":
        metres, direction = 0.25 * reach, start[:3, 3] - arm.base[:3, 3]
        centre = 0.2 * reach * direction / np.linalg.norm(direction)
    if scenario == "singular":
        metres, radians = 0.2 * reach, 0.5
        over = arm.base @ np.array([0, 0, arm.geometry.d_bs + 0.7 * reach, 1.0])
        centre = 0.6 * (over[:3] - start[:3, 3])
    if scenario == "limits":
        radians = 0.8
    begun = np.clip(t / 2.0, 0, 1)[:, None]
    begun = begun**3 * (10 - 15 * begun + 6 * begun**2)
    poses = np.repeat(start[None], len(t), axis=0)
    poses[:, :3, 3] += begun * (centre + metres * _smooth(rng, t, highest))
    poses[:, :3, :3] = rotation(begun * radians * _smooth(rng, t, highest)) @ start[:3, :3]
    if scenario == "glitch":
        for k in rng.integers(len(t) // 10, len(t), STEPS):
            poses[k:, :3, 3] += STEP * rng.choice([-1.0, 1.0]) * np.eye(3)[rng.integers(3)]
    return poses


def noisy(poses: Array, rng: np.random.Generator) -> Array:
    """Return poses with the noise of a hand tracker."""
    out = poses.copy()
    out[:, :3, 3] += NOISE[0] * rng.normal(size=(len(poses), 3))
    out[:, :3, :3] = rotation(NOISE[1] * rng.normal(size=(len(poses), 3))) @ poses[:, :3, :3]
    return out


def stream(
    arm: aa.Arm,
    scenario: str,
    seed: int,
    *,
    dt: float = 0.004,
    seconds: float = 30.0,
    noise: bool = True,
    rate: float = HAND_RATE,
) -> Stream:
    """Return a stream; without noise the tracker is given the hand's pose in each cycle."""
    true = hand(arm, scenario, seed, dt, seconds)
    if not noise:
        return Stream(dt, true, true, np.ones(len(true), bool))
    rng = np.random.default_rng([seed, 17])
    beat = np.floor(dt * np.arange(len(true)) * rate + 1e-9).astype(int)
    fresh = np.diff(beat, prepend=-1) > 0
    seen = noisy(true, rng)[fresh]
    if scenario == "glitch":
        at = rng.choice(np.arange(len(seen) // 10, len(seen) - 1), OUTLIERS, replace=False)
        direction = rng.normal(size=(OUTLIERS, 3))
        seen[at, :3, 3] += OUTLIER * direction / np.linalg.norm(direction, axis=1)[:, None]
    return Stream(dt, true, seen[np.cumsum(fresh) - 1], fresh)


def judged(arm: aa.Arm, true: Array, dt: float) -> NDArray[np.bool_]:
    """Return in which cycles the pose has a solution within limits, as it had for the `REST` s before."""
    ok = np.asarray(arm.solve(true).ok)
    blocked = np.where(ok, -1, np.arange(len(ok)))
    last = np.maximum.accumulate(blocked)
    return ok & (np.arange(len(ok)) - last > REST / dt)


def errors(arm: aa.Arm, q: Array, true: Array) -> tuple[Array, Array]:
    """Return the distance of the tool from the hand in each cycle, m and rad."""
    poses = arm.forward(q)[0]
    relative = np.einsum("nji,njk->nik", poses[:, :3, :3], true[:, :3, :3])
    axis = np.stack([relative[:, 2, 1] - relative[:, 1, 2], relative[:, 0, 2] - relative[:, 2, 0],
                     relative[:, 1, 0] - relative[:, 0, 1]], axis=-1)  # fmt: skip
    angle = np.arctan2(np.linalg.norm(axis, axis=-1), np.trace(relative, axis1=1, axis2=2) - 1)
    return np.linalg.norm(poses[:, :3, 3] - true[:, :3, 3], axis=-1), angle
