"""Arms with bodies amid obstacles, and how far they are from them."""

from __future__ import annotations

from typing import Any

import numpy as np

import armangle as aa

from . import streams
from .moves import Array, begun
from .ticks import DT

CLEARANCE = 0.01
BODY = aa.Body.bones(upper_arm=0.05, forearm=0.045)
GRIP = 0.03  # m


def with_body(name: str) -> aa.Arm:
    """An arm of the catalogue with a collision model and a ball as gripper."""
    grip = aa.Ball([0.0, 0.0, 0.12], GRIP, name="grip")
    return aa.Arm.from_catalogue(name).with_(body=BODY, hand=[grip])


def distance(arm: aa.Arm, scene: aa.Scene, q: Array) -> Array:
    """The distances of configurations from obstacles, computed by another method than the tracker's."""
    return np.asarray(arm.clearance(q, scene).distance)


def shape(rng: np.random.Generator, at: Array, name: str) -> aa.Ball | aa.Capsule | aa.Box:
    """A random ball, capsule or box at a point."""
    kind = rng.integers(3)
    if kind == 0:
        return aa.Ball(at, rng.uniform(0.03, 0.1), name=name)
    if kind == 1:
        return aa.Capsule(at, at + 0.2 * rng.normal(size=3), rng.uniform(0.02, 0.06), name=name)
    frame = np.eye(4)
    frame[:3, 3] = at
    frame[:3, :3] = streams.rotation(rng.normal(size=(1, 3)))[0]
    return aa.Box(frame, rng.uniform(0.03, 0.15, 3), name=name)


def cluttered(arm: aa.Arm, start: Array, rng: np.random.Generator, count: int = 6) -> aa.Scene:
    """A scene of at most `count` obstacles around the arm, each more than 15 mm from it at the joints
    `start`.
    """
    shoulder = (arm.base @ np.array([0, 0, arm.geometry.d_bs, 1.0]))[:3]
    reach = arm.geometry.d_se + arm.geometry.d_ew
    found: list[aa.Ball | aa.Capsule | aa.Box] = []
    for k in range(20 * count):
        one = shape(rng, shoulder + 0.5 * reach * rng.normal(size=3), f"obstacle {k}")
        if distance(arm, aa.Scene([*found, one]), start) > 0.015:
            found.append(one)
        if len(found) == count:
            break
    return aa.Scene(found, clearance=CLEARANCE)


def between(q: Array, parts: int = 4) -> Array:
    """The joints (n, 7) with each step divided into `parts`."""
    share = np.arange(parts)[:, None, None] / parts
    return np.concatenate([(q[:-1] + share * np.diff(q, axis=0)).reshape(-1, 7), q[-1:]])


def started(arm: aa.Arm, scene: aa.Scene, start: Array, **options: Any) -> aa.Tracker:
    """A tracker at rest at the joints `start`, with this scene."""
    return begun(start, arm.with_(scene=scene), DT, **options)
