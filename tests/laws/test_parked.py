"""Configurations where robots are parked: near one, two or three singularities, with encoder noise."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from support import draw
from support.parked import ARMS, DIGITS, SelfMotion, parked

import armangle as aa

INSIDE = 1e-6
"""A witness is inside its limits by this much, rad."""


@pytest.mark.parametrize("name", ARMS)
def test_a_branch_is_feasible_where_50_digits_find_a_solution(name: str) -> None:
    """And what the product finds solves the pose within the limits."""
    arm = aa.Arm.from_catalogue(name)
    bare = arm.with_(base=np.eye(4), tool=np.eye(4))
    rng = draw.generator(1805, ARMS.index(name))
    with mpmath.workdps(DIGITS):
        for _ in range(draw.count(6, len(ARMS))):
            q = parked(bare, rng)
            pose = bare.forward(q, on_error="nan")[0]
            arcs = bare.feasible(pose)
            held = sum(1 << gc for gc in range(8) if arcs.status[gc] == aa.Status.OK)
            witnessed = SelfMotion(bare, q).branches(INSIDE, 8)
            assert witnessed & ~held == 0, (q.tolist(), bin(witnessed), bin(held))
            assert bare.freedom(pose).gc == held, q.tolist()
            for gc in range(8):
                one = bare.solve(pose, gc=gc)
                assert bool(one.ok) == bool(held >> gc & 1), (q.tolist(), gc)
                if one.ok:
                    assert bare.within_limits(one.q), (q.tolist(), gc)
                    assert np.abs(bare.forward(one.q, on_error="nan")[0] - pose).max() < 1e-12
