"""TRAC-IK by its Python bindings: Newton and SQP side by side, with its own restarts, 5 ms at most."""

from __future__ import annotations

from typing import Any

import numpy as np
from trac_ik import TracIK

from .contract import TOLERANCE, Floats, Problem, Solver


def make(problem: Problem) -> dict[str, Any]:
    solver = TracIK("base", "tip", str(problem.urdf), timeout=0.005, epsilon=TOLERANCE, solver_type="Speed")

    def solve(i: int, pose: Floats, seed: Floats) -> Floats | None:
        answer = solver.ik(pose[:3, 3], pose[:3, :3], seed)
        return None if answer is None else np.asarray(answer)

    return {"Speed": Solver(solve)}
