"""Pink on Pinocchio: differential inverse kinematics by DAQP, iterated to the pose."""

from __future__ import annotations

from typing import Any

import numpy as np
import pink
import pinocchio as pin
from pink.limits import ConfigurationLimit
from pink.tasks import FrameTask

from .contract import ITERATIONS, TOLERANCE, Floats, Problem, Solver, with_restarts

STEP = 1.0  # s: a whole step to the target each iteration


def make(problem: Problem) -> dict[str, Any]:
    model = pin.buildModelFromUrdf(str(problem.urdf))
    data = model.createData()
    task = FrameTask("tip", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-6)
    limits = [ConfigurationLimit(model, config_limit_gain=1.0)]

    def solve(i: int, pose: Floats, seed: Floats) -> Floats | None:
        task.set_target(pin.SE3(pose))

        def attempt(start: Floats) -> Floats | None:
            configuration = pink.Configuration(model, data, start.copy())
            for _ in range(ITERATIONS):
                if np.abs(task.compute_error(configuration)).max() < TOLERANCE:
                    return np.array(configuration.q)
                try:
                    speed = pink.solve_ik(
                        configuration, [task], STEP, "daqp", limits=limits, safety_break=False
                    )
                except pink.exceptions.NoSolutionFound:
                    return None
                configuration.integrate_inplace(speed, STEP)
            return None

        return with_restarts(attempt, problem, seed, i)

    return {"FrameTask by DAQP with restarts": Solver(solve)}
