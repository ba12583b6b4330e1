"""Plans of arms with a locked joint: through theta_2 = 0 and theta_6 = 0, where the other branch begins."""

from __future__ import annotations

import numpy as np
import pytest
from support.draw import count, generator
from support.moves import limited, line, proven, slopes_hold

import armangle as aa

NAMES = ("kuka_iiwa7_r800", "realman_rm75_b", "openarm_v10", "human_arm_left")
ARMS = {name: aa.Arm.from_catalogue(name) for name in NAMES}
HINGE = {1: 1, 3: 1, 5: 5, 7: 5}
"""Index of the hinge beside each pivot that may be locked."""


def drawn(joint: int, rng: np.random.Generator) -> tuple[aa.Arm, aa.Line, np.ndarray] | None:
    """An arm with `joint` locked, a line across 0 of the hinge beside it, and its start; None if limits
    forbid.
    """
    free, hinge = ARMS[str(rng.choice(NAMES))], HINGE[joint]
    middle = float(np.angle(np.exp(-1j * free.geometry.signs[hinge] * free.geometry.offsets[hinge])))
    if not free.lower[hinge] + 0.2 < middle < free.upper[hinge] - 0.2:
        return None
    start = rng.uniform(0.8 * free.lower, 0.8 * free.upper)
    side = rng.choice([-1, 1]) * rng.uniform(0.02, 0.2)
    end = start + 0.1 * rng.normal(size=7)
    start[hinge], end[hinge], end[joint - 1] = middle + side, middle - side * rng.random(), start[joint - 1]
    arm = limited(free, joint - 1, start[joint - 1], start[joint - 1])
    if not (arm.within_limits(start) and arm.within_limits(end)):
        return None
    return arm, aa.Line(arm.forward(start)[0], arm.forward(end)[0]), start


@pytest.mark.turns(4)
@pytest.mark.parametrize("joint", sorted(HINGE))
def test_where_follow_passes_a_plan_does(joint: int) -> None:
    """With a locked joint plans pass theta_2 or theta_6 = 0 in 95 % of the cases that `follow` passes."""
    rng, ways, certified = generator(joint), 0, 0
    for _ in range(count(25)):
        case = drawn(joint, rng)
        if case is None:
            continue
        arm, way, start = case
        if not aa.follow(arm, way, start=start, samples=1001, policy=aa.Hold(), max_joint_step=0.04).ok:
            continue
        ways += 1
        path = aa.plan(arm, way, start=start)
        certified += path.certified
        if path.certified:
            assert np.ptp(proven(path, start).q[:, joint - 1]) == 0
            slopes_hold(path, 0.5, 1e-5, 1e-3 * max(1, np.abs(path.derivatives(0.5)[0]).max()))
    assert ways > 3 and certified >= 0.95 * ways, (certified, ways)


@pytest.mark.turns(4)
@pytest.mark.parametrize("joint", sorted(HINGE))
def test_a_singularity_margin_is_kept_with_a_locked_joint(joint: int) -> None:
    """A certified plan with a margin and a locked joint keeps theta_2 and theta_6 off 0."""
    rng, asked = generator(10, joint), 0
    for _ in range(count(8)):
        case = drawn(joint, rng)
        if case is None:
            continue
        arm, line, start = case
        asked += 1
        path = aa.plan(arm.with_(singularity_margin=0.01), line, start=start)
        if not path.certified:
            continue
        dense = path.at(np.linspace(0, 1, 2001)).q
        theta = arm.geometry.signs * dense + arm.geometry.offsets
        assert np.abs(np.sin(theta[:, [1, 5]])).min() > np.sin(0.01) - 1e-9
    assert asked > 2


def test_a_hinge_far_from_straight_beside_a_locked_joint() -> None:
    """A plan is certified with joint 5 locked and theta_6 near a right angle."""
    start = np.array([0.2, -0.3, 0.4, 1.2, -0.37, 0.1, 0.3])
    arm = limited(ARMS["openarm_v10"], 4, start[4], start[4])
    end = start + np.array([0.1, 0.1, -0.1, 0.1, 0, -0.1, 0.1])
    assert aa.plan(arm, aa.Line(arm.forward(start)[0], arm.forward(end)[0]), start=start).certified


def test_a_joint_of_a_whole_turn_stays_on_its_winding_along_a_limit() -> None:
    """A plan whose joint 1 starts at a limit of ±π does not leap by a turn to the other limit."""
    arm = ARMS["human_arm_left"]
    rng, on_limit = generator(3), 0
    for _ in range(count(30)):
        start = rng.uniform(arm.lower, arm.upper)
        start[0] = rng.choice([arm.lower[0], arm.upper[0]])
        path = aa.plan(arm, line(arm, start, 0.02 * rng.normal(size=3)), start=start, psi=rng.uniform(-3, 3))
        if not path.ok:
            continue
        on_limit += 1
        assert np.abs(np.diff(path.q, axis=0)).max() <= 0.2 + 1e-9
    assert on_limit > 2
