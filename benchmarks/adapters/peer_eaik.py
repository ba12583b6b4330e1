"""EAIK: six joints in closed form, joint 3 locked at 16 values, the nearest to the seed's first."""

from __future__ import annotations

from typing import Any

import numpy as np
from eaik.IK_HP import HPRobot

from .contract import Batch, Floats, Locked, Problem, Solver, first_within

X, Y, Z = np.eye(3)
ZERO = np.zeros(3)
AXES = np.array([Z, Y, Z, -Y, Z, Y, Z])
OFFSETS = np.array([0.34 * Z, ZERO, 0.4 * Z, ZERO, 0.4 * Z, ZERO, ZERO, 0.126 * Z])


def make(problem: Problem) -> dict[str, Any]:
    locked = Locked(problem, 2)
    robots = [HPRobot(AXES, OFFSETS, [(2, value)]) for value in locked.values]
    middle = HPRobot(AXES, OFFSETS, [(2, 0.0)])

    def within(found: Any) -> Floats | None:
        joints, approximate = found.Q, found.is_LS
        if any(approximate):
            joints = joints[~np.array(approximate)]
        return first_within(problem, joints) if len(joints) else None

    def nearest(i: int, pose: Floats, seed: Floats) -> Floats | None:
        for k in locked.outward(seed[2]):
            answer = within(robots[k].IK(pose))
            if answer is not None:
                return answer
        return None

    def batch(poses: Floats) -> Floats:
        out = np.full((len(poses), 7), np.nan)
        for row, found in zip(out, middle.IK_batched(poses, 1), strict=True):
            answer = within(found)
            if answer is not None:
                row[:] = answer
        return out

    return {
        "joint 3 locked at 16 values, first within limits": Solver(nearest),
        "joint 3 locked at 0, batch, one thread": Batch(batch),
    }
