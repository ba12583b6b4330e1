"""Links that swing know all three signs of a branch: what is asked of all branches is what each one says."""

from __future__ import annotations

import numpy as np
import pytest
from support.draw import count, generator

import armangle as aa

NAMES = ["kuka_iiwa7_r800", "barrett_wam7", "yaskawa_sia5d", "openarm_v10"]


def drawn(name: str, rng: np.random.Generator, swings: bool) -> tuple[aa.Arm, aa.Scene, np.ndarray]:
    """An arm with shapes off the axes of links 1, 2, 5 and 6 if `swings`, else bones; a scene of balls; a
    pose.
    """
    arm = aa.Arm.from_catalogue(name)
    balls = {k: [aa.Ball(rng.normal(size=3) * 0.08, 0.05)] for k in (1, 2, 5, 6)}
    arm = arm.with_(body=aa.Body(balls) if swings else aa.Body.bones(upper_arm=0.06, forearm=0.06))
    shoulder = arm.frames(np.zeros(7))[1, :3, 3]
    scene = aa.Scene([aa.Ball(shoulder + rng.normal(size=3) * 0.25, 0.08) for _ in range(3)])
    return arm, scene, arm.forward(rng.uniform(arm.lower, arm.upper).clip(-2.8, 2.8))[0]


@pytest.mark.turns(2)
@pytest.mark.parametrize("swings", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_all_branches_are_those_asked_one_by_one(name: str, swings: bool) -> None:
    """`feasible` of all branches in a scene equals that of each branch."""
    rng, differ = generator(41, len(name)), 0
    for _ in range(count(4)):
        arm, scene, pose = drawn(name, rng, swings)
        kept = arm.with_(scene=scene)
        every = kept.feasible(pose)
        clear = kept.with_(lower=np.full(7, -np.inf), upper=np.full(7, np.inf)).feasible(pose)
        differ += len({str(clear[gc].intervals) for gc in range(8)}) > 2
        for gc in range(8):
            one = kept.feasible(pose, gc)
            assert every[gc].status is one.status
            assert every[gc].ends or one.ends or every[gc].is_full == one.is_full
            assert np.allclose(every[gc].intervals, one.intervals, rtol=0, atol=1e-9)
    assert (differ > 0) == swings


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", NAMES)
def test_no_solution_touches_and_none_is_missed(name: str) -> None:
    """`solve` and `solutions` in a scene keep clear, and fail only where no arc is left."""
    rng, found = generator(42, len(name)), 0
    for _ in range(count(6)):
        arm, scene, pose = drawn(name, rng, True)
        near = rng.uniform(arm.lower, arm.upper).clip(-2.8, 2.8)
        kept = arm.with_(scene=scene)
        nearest, each = kept.solve(pose, seed=near), kept.solutions(pose, seed=near)
        assert nearest.ok or kept.feasible(pose).measure.max() < 1e-6
        assert nearest.ok == each.ok
        for solution in [nearest, *each] if nearest.ok else []:
            _, psi, gc = arm.forward(solution.q)
            assert kept.clearance(arm.inverse(pose, psi, gc, limits=False)).distance >= -1e-9
            found += 1
    assert found > 4
