"""ssik: its prebuilt iiwa 7."""

from __future__ import annotations

from typing import Any

import numpy as np
import ssik

from .contract import Arcs, Floats, Problem, Solver


def make(problem: Problem) -> dict[str, Any]:
    arm = ssik.Manipulator.from_prebuilt("iiwa7")

    def seeded(i: int, pose: Floats, seed: Floats) -> Floats | None:
        found = arm.solve(pose, max_solutions=1, q_seed=seed)
        return found[0].q if found else None

    def every(i: int, pose: Floats, seed: Floats) -> Floats | None:
        found = arm.solve(pose)
        return found[0].q if found else None

    def arcs(pose: Floats) -> list[Floats]:
        return [np.array(chart.in_limits()).reshape(-1, 2) for chart in arm.self_motion(pose).charts]

    return {
        "nearest to the seed": Solver(seeded),
        "all solutions (16 samples x 8 branches)": Solver(every, seeds=("none",)),
        "arcs of all branches": Arcs(arcs),
    }
