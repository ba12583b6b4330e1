"""Laws of the arcs of nearly S-R-S arms: in them all limits hold, out of them one breaks, ends are limits."""

from __future__ import annotations

import numpy as np
import pytest
from support.calibrated import ARMS, Array, postures
from support.laws import circle_gap

import armangle as aa

CLEAR = 1e-9  # rad of a joint: nearer to a limit nothing is decided
EVERY = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())


def within(arm: aa.Arm, q: Array) -> float:
    """Least distance (rad) of joints to their limits up to multiples of 2π; negative beyond."""
    middle, half = 0.5 * (arm.lower + arm.upper), 0.5 * (arm.upper - arm.lower)
    return float(np.where(half >= np.pi, np.inf, half - circle_gap(q, middle)).min())


def test_a_joint_goes_through_the_gap_of_a_range_of_nearly_a_turn() -> None:
    """Arcs end on both sides of the gap between limits of nearly ±π, and `inverse` there breaks a limit."""
    arm = ARMS["kuka_iiwa7_r800 1.0 mm"]
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[[0, 2, 4, 6]], upper[[0, 2, 4, 6]] = -np.pi + 0.01, np.pi - 0.01
    wide = arm.with_(lower=lower, upper=upper)
    pose, psi, gc = wide.forward(postures(wide, 40, 30))
    gaps = 0
    for i in range(len(pose)):
        arcs = wide.feasible(pose[i], gc[i])
        assert psi[i] in arcs
        for (_, before), (after, _), ends, next_ends in zip(
            arcs.intervals, arcs.intervals[1:], arcs.ends, arcs.ends[1:], strict=False
        ):
            if ends[1].joint is None or ends[1].joint != next_ends[0].joint or after - before > 0.1:
                continue
            inside = wide.inverse(pose[i], np.linspace(before, after, 7)[1:-1], gc[i], limits=False)
            assert all(within(wide, row) < 0 for row in inside)
            for end, at in ((ends[1], before), (next_ends[0], after)):
                joint = wide.inverse(pose[i], at, gc[i], limits=False)[end.joint - 1]
                assert circle_gap(joint, end.value) <= 1e-10
            gaps += ends[1].side != next_ends[0].side  # through it, and not back out of it
    assert gaps > 10


def test_reasons_of_empty_sets() -> None:
    """The status of an empty set of a calibrated arm names reach, elbow, margin or limits."""
    arm = ARMS["kuka_iiwa7_r800 1.0 mm"]
    pose, _, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    far = pose.copy()
    far[0, 3] += 2.0
    assert arm.feasible(far, gc).status == aa.Status.UNREACHABLE
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[3], upper[3] = 0.5, 1.0
    assert arm.with_(lower=lower, upper=upper).feasible(pose, 2).status == aa.Status.ELBOW_LIMIT
    assert arm.with_(singularity_margin=1.4).feasible(pose, gc).status == aa.Status.ELBOW_MARGIN
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[0], upper[0] = 3.0, 3.1
    assert arm.with_(lower=lower, upper=upper).feasible(pose, gc).status == aa.Status.LIMITS
