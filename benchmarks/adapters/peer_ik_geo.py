"""ik-geo: six joints in closed form, joint 3 locked at 16 values, the nearest to the seed's first."""

from __future__ import annotations

from typing import Any

import numpy as np
from ik_geo import Robot

from .contract import Floats, Locked, Problem, Solver, first_within

X, Y, Z = np.eye(3)
ZERO = np.zeros(3)


def _locked(value: float) -> tuple[Any, Floats]:
    """The chain with joint 3, which turns about the upper arm, as a part of the rigid upper arm."""
    c, s = np.cos(value), np.sin(value)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    axes = [Z, Y, turn @ -Y, Z, turn @ Y, Z]
    offsets = [0.34 * Z, ZERO, 0.4 * Z, 0.4 * Z, ZERO, ZERO, 0.126 * Z]
    return Robot.spherical_two_intersecting(np.array(axes), np.array(offsets)), turn


def make(problem: Problem) -> dict[str, Any]:
    locked = Locked(problem, 2)
    robots = [_locked(value) for value in locked.values]

    def nearest(i: int, pose: Floats, seed: Floats) -> Floats | None:
        rotation, position = pose[:3, :3], pose[:3, 3]
        for k in locked.outward(seed[2]):
            robot, turn = robots[k]
            by_columns = turn @ rotation.T  # of the rotation up to the locked joint's turn
            found = [q for q, approximate in robot.get_ik(by_columns, position) if not approximate]
            if not found:
                continue
            joints = np.insert(np.array(found), 2, locked.values[k], axis=1)
            answer = first_within(problem, joints)
            if answer is not None:
                return answer
        return None

    return {"joint 3 locked at 16 values, first within limits": Solver(nearest)}
