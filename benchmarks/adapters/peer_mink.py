"""mink on MuJoCo: differential inverse kinematics by DAQP, iterated to the pose."""

from __future__ import annotations

from typing import Any

import mink
import mujoco
import numpy as np

from .contract import ITERATIONS, TOLERANCE, Floats, Problem, Solver, with_restarts

MASSES = '<mujoco><compiler boundmass="1" boundinertia="0.01" fusestatic="false"/></mujoco>'
STEP = 1.0  # s: a whole step to the target each iteration


def make(problem: Problem) -> dict[str, Any]:
    text = problem.urdf.read_text(encoding="utf-8").replace("<link", MASSES + "<link", 1)
    model = mujoco.MjModel.from_xml_string(text)
    configuration = mink.Configuration(model)
    task = mink.FrameTask("tip", "body", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-6)
    limits = [mink.ConfigurationLimit(model, gain=1.0)]

    def solve(i: int, pose: Floats, seed: Floats) -> Floats | None:
        task.set_target(mink.SE3.from_matrix(pose))

        def attempt(start: Floats) -> Floats | None:
            configuration.update(start)
            for _ in range(ITERATIONS):
                if np.abs(task.compute_error(configuration)).max() < TOLERANCE:
                    return np.array(configuration.q)
                try:
                    speed = mink.solve_ik(configuration, [task], STEP, "daqp", limits=limits)
                except mink.NoSolutionFound:
                    return None
                configuration.integrate_inplace(speed, STEP)
            return None

        return with_restarts(attempt, problem, seed, i)

    return {"FrameTask by DAQP with restarts": Solver(solve)}
