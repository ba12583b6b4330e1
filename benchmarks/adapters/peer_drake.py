"""Drake: its InverseKinematics program, solved by SNOPT, with restarts."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.solvers import SnoptSolver

from .contract import TOLERANCE, Floats, Problem, Solver, with_restarts

# Three points fix the pose; the program's own orientation constraint bounds a cosine, which SNOPT cannot
# resolve to this tolerance.
POINTS = (np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))


def make(problem: Problem) -> dict[str, Any]:
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(problem.urdf))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    tip, world, solver = plant.GetFrameByName("tip"), plant.world_frame(), SnoptSolver()

    def solve(i: int, pose: Floats, seed: Floats) -> Floats | None:
        program = InverseKinematics(plant)
        for point in POINTS:
            place = pose[:3, :3] @ point + pose[:3, 3]
            program.AddPositionConstraint(tip, point, world, place - TOLERANCE, place + TOLERANCE)

        def attempt(start: Floats) -> Floats | None:
            result = solver.Solve(program.prog(), start, None)
            return result.GetSolution(program.q()) if result.is_success() else None

        return with_restarts(attempt, problem, seed, i)

    return {"InverseKinematics by SNOPT with restarts": Solver(solve)}
