"""Robotics Toolbox for Python: its Levenberg-Marquardt solver in C++, with its own restarts."""

from __future__ import annotations

import warnings
from typing import Any

import roboticstoolbox as rtb

from .contract import TOLERANCE, Floats, Problem, Solver

SQUARE = 0.5 * TOLERANCE**2  # its residual is half the squared error


def make(problem: Problem) -> dict[str, Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        chain = rtb.Robot.URDF(str(problem.urdf)).ets()

    def solve(i: int, pose: Floats, seed: Floats) -> Floats | None:
        answer = chain.ik_LM(pose, q0=seed, tol=SQUARE, joint_limits=True)
        q, success = (answer.q, answer.success) if hasattr(answer, "q") else answer[:2]
        return q if success else None

    return {"ik_LM": Solver(solve)}
