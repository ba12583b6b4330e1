"""What trackers are given, and what is asked of their ticks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import armangle as aa

from . import streams

Array = NDArray[np.float64]

DT = 0.004
HARDEST = 10.0


def named(name: str) -> aa.Arm:
    return aa.Arm.from_catalogue(name)


def settled(tracker: aa.Tracker, pose: Array, seconds: float) -> aa.types.Tracked:
    for _ in range(round(seconds / DT)):
        now = tracker.step(pose)
    return now


def moved(pose: Array, by: Array) -> Array:
    out = pose.copy()
    out[:3, 3] += by
    return out


def random_rotation(rng: np.random.Generator) -> Array:
    axis = rng.normal(size=3)
    return streams.rotation(rng.uniform(0, np.pi) * axis[None] / np.linalg.norm(axis))[0]


def hostile(arm: aa.Arm, rng: np.random.Generator) -> Array:
    """One command of a kind drawn anew."""
    pose = np.eye(4)
    kind = rng.integers(6)
    if kind == 0:  # anywhere, in reach or metres away
        pose[:3, :3] = random_rotation(rng)
        pose[:3, 3] = rng.normal(size=3) * rng.choice([0.3, 1.0, 5.0])
    elif kind == 1:  # within limits
        pose = arm.forward(rng.uniform(arm.lower, arm.upper))[0].copy()
    elif kind == 2:  # the wrist in the shoulder
        pose[:3, :3] = random_rotation(rng)
        pose[:3, 3] = [0, 0, arm.d_bs]
        pose[:3, 3] += pose[:3, 2] * arm.d_wf
        pose = arm.base @ pose @ arm.tool
    elif kind == 3:
        pose[rng.integers(3), rng.integers(4)] = rng.choice([np.nan, np.inf, 1e300])
    elif kind == 4:  # no rotation
        pose[:3, :3] *= rng.uniform(-2, 2)
    else:  # stretched out along a random ray
        pose[:3, :3] = random_rotation(rng)
        pose[:3, 3] = (arm.d_se + arm.d_ew) * rng.normal(size=3)
    return pose


def check_bounds(arm: aa.Arm, q: Array, dt: Array, hardest: float = HARDEST) -> None:
    v = np.diff(q, axis=0) / dt[:, None]
    before = np.concatenate([np.zeros((1, 7)), v[:-1]])
    assert np.isfinite(q).all()
    assert (q >= arm.lower).all()
    assert (q <= arm.upper).all()
    assert (np.abs(v) <= arm.velocity * (1 + 1e-9)).all()
    assert (np.abs(v - before) <= hardest * dt[:, None] * (1 + 1e-9) + 1e-12).all()
    room = np.where(v > 0, arm.upper - q[1:], q[1:] - arm.lower)
    assert (v**2 / (2 * hardest) <= room + 1e-9).all()
