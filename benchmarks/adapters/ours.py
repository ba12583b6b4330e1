"""armangle itself."""

from __future__ import annotations

from typing import Any

import numpy as np

import armangle as aa

from .contract import Arcs, Batch, Floats, Problem, Solver


def make(problem: Problem) -> dict[str, Any]:
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    psi, gc = problem.psi, problem.gc
    psi_list, gc_list = psi.tolist(), gc.tolist()

    def inverse(i: int, pose: Floats, seed: Floats) -> Floats:
        return arm.inverse(pose, psi_list[i], gc_list[i], limits=False)

    def step(i: int, pose: Floats, seed: Floats) -> Floats | None:
        now = aa.step(arm, seed, pose, max_joint_step=10.0)
        return now.q if now.status == aa.Status.OK else None

    def anywhere(i: int, pose: Floats, seed: Floats) -> Floats | None:
        """A step; where the seed's branch has no answer, the nearest feasible arm angle on another."""
        now = step(i, pose, seed)
        if now is not None:
            return now
        _, angle, branch = arm.forward(seed)
        every = arm.feasible(pose)
        found = np.flatnonzero(~every.is_empty)
        if len(found) == 0:
            return None
        branch = branch if branch in found else found[0]
        return arm.inverse(pose, every[branch].nearest(angle), branch, limits=False)

    return {
        "inverse at a given arm angle and GC": Solver(inverse, seeds=("none",)),
        "inverse at given arm angles and GCs, batch": Batch(
            lambda poses: arm.inverse(poses, psi, gc, limits=False)
        ),
        "step from the seed": Solver(step, seeds=("near",)),
        "step from the seed, else any branch": Solver(anywhere),
        "arcs of all 8 GC": Arcs(lambda pose: arm.feasible(pose).intervals),
    }
