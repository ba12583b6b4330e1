"""Pinocchio: inverse kinematics after its own example, as damped Gauss-Newton clipped to the limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from .contract import ITERATIONS, TOLERANCE, Floats, Problem, Solver, with_restarts

DAMPING = 1e-6 * np.eye(6)


def make(problem: Problem) -> dict[str, Any]:
    model = pin.buildModelFromUrdf(str(problem.urdf))
    data = model.createData()
    tip = model.getFrameId("tip")

    def solve(i: int, pose: Floats, seed: Floats) -> Floats | None:
        target = pin.SE3(pose)

        def attempt(start: Floats) -> Floats | None:
            q = start.copy()
            for _ in range(ITERATIONS):
                pin.forwardKinematics(model, data, q)
                between = pin.updateFramePlacement(model, data, tip).actInv(target)
                error = pin.log6(between).vector
                if np.abs(error).max() < TOLERANCE:
                    return q
                jacobian = -pin.Jlog6(between.inverse()) @ pin.computeFrameJacobian(model, data, q, tip)
                move = -jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + DAMPING, error)
                q = np.clip(q + move, problem.lower, problem.upper)
            return None

        return with_restarts(attempt, problem, seed, i)

    return {"CLIK with restarts": Solver(solve)}
