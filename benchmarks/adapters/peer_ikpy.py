"""ikpy: bounded least squares by SciPy on the whole frame."""

from __future__ import annotations

from typing import Any

import numpy as np
from ikpy.chain import Chain

from .contract import Floats, Problem, Solver


def make(problem: Problem) -> dict[str, Any]:
    mask = [False, *[True] * 7, False]
    chain = Chain.from_urdf_file(str(problem.urdf), base_elements=["base"], active_links_mask=mask)
    inside = 1e-9  # its optimiser wants a start strictly between the bounds

    def solve(i: int, pose: Floats, seed: Floats) -> Floats:
        start = np.clip(seed, problem.lower + inside, problem.upper - inside)
        found = chain.inverse_kinematics_frame(
            pose, initial_position=[0.0, *start, 0.0], orientation_mode="all"
        )
        return np.asarray(found)[1:8]

    return {"least squares, one attempt": Solver(solve)}
