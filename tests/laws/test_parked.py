"""Configurations where robots are parked: near one, two or three singularities, with encoder noise."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray
from support import draw
from support.parked import ARMS, DIGITS, SelfMotion, at_limit, parked

import armangle as aa

INSIDE = 1e-6
"""A witness is inside its limits by this much, rad."""


def feasible_is_solvable(arm: aa.Arm, q: NDArray[np.float64]) -> int:
    """Check that `feasible`, `freedom` and `solve` agree on each branch; return the feasible ones, one bit
    each.
    """
    pose = arm.forward(q, on_error="nan")[0]
    arcs = arm.feasible(pose)
    held = sum(1 << gc for gc in range(8) if arcs.status[gc] == aa.Status.OK)
    assert arm.freedom(pose).gc == held, q.tolist()
    for gc in range(8):
        one = arm.solve(pose, gc=gc)
        assert bool(one.ok) == bool(held >> gc & 1), (q.tolist(), gc)
        if one.ok:
            assert arm.within_limits(one.q), (q.tolist(), gc)
            assert np.abs(arm.forward(one.q, on_error="nan")[0] - pose).max() < 1e-12
    return held


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", ARMS)
def test_a_branch_is_feasible_where_50_digits_find_a_solution(name: str) -> None:
    """`feasible` has every branch in which a search with 50 digits finds a solution of parked joints."""
    arm = aa.Arm.from_catalogue(name).with_(base=np.eye(4), tool=np.eye(4))
    rng = draw.generator(1805, ARMS.index(name))
    with mpmath.workdps(DIGITS):
        for _ in range(draw.count(6, len(ARMS))):
            q = parked(arm, rng)
            held = feasible_is_solvable(arm, q)
            witnessed = SelfMotion(arm, q).branches(INSIDE, 8)
            assert witnessed & ~held == 0, (q.tolist(), bin(witnessed), bin(held))


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ARMS)
def test_a_hinge_on_its_limit_with_a_straight_elbow(name: str) -> None:
    """The branch of joints with the elbow straight and a joint on its limit is feasible."""
    arm = aa.Arm.from_catalogue(name).with_(base=np.eye(4), tool=np.eye(4))
    rng = draw.generator(4201, ARMS.index(name))
    for _ in range(draw.count(40, len(ARMS))):
        q = at_limit(arm, rng)
        held = feasible_is_solvable(arm, q)
        assert arm.reachable(arm.forward(q, on_error="nan")[0]) == bool(held), q.tolist()
        assert held >> int(arm.forward(q, on_error="nan")[2]) & 1, q.tolist()


def test_a_search_that_is_cut_short_says_so() -> None:
    """`solve` of parked joints has a solution, OK or UNPROVEN, and `solutions` says the same."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    rng, said = draw.generator(4202), set()
    for _ in range(draw.count(60)):
        pose = arm.forward(parked(arm, rng), on_error="nan")[0]
        seed = rng.uniform(-0.3, 0.3, 7)
        found = arm.solve(pose, seed=seed)
        assert found.ok
        assert arm.solutions(pose, seed=seed)[0].status == found.status
        said.add(found.status)
    assert said == {aa.Status.OK, aa.Status.UNPROVEN}
