"""PlaCo: its kinematics solver, iterated to the pose."""

from __future__ import annotations

from typing import Any

import numpy as np
import placo

from .contract import ITERATIONS, TOLERANCE, Floats, Problem, Solver, with_restarts


def make(problem: Problem) -> dict[str, Any]:
    robot = placo.RobotWrapper(str(problem.urdf), placo.Flags.ignore_collisions)
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.enable_joint_limits(True)
    task = solver.add_frame_task("tip", np.eye(4))
    task.configure("tip", "soft", 1.0, 1.0)
    first = robot.state.q.size - 7

    def solve(i: int, pose: Floats, seed: Floats) -> Floats | None:
        task.T_world_frame = pose

        def attempt(start: Floats) -> Floats | None:
            state = robot.state.q.copy()
            state[first:] = start
            robot.state.q = state
            robot.update_kinematics()
            for _ in range(ITERATIONS):
                solver.solve(True)
                robot.update_kinematics()
                position, orientation = task.position(), task.orientation()
                if position.error_norm() < TOLERANCE and orientation.error_norm() < TOLERANCE:
                    return np.array(robot.state.q[first:])
            return None

        return with_restarts(attempt, problem, seed, i)

    return {"KinematicsSolver with restarts": Solver(solve)}
