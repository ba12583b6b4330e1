"""Where a plan begins or ends with the arm stretched: no leap, a proof where there is one, true reasons."""

from __future__ import annotations

import numpy as np
import pytest
from support.draw import count, generator
from support.moves import DENSE, just_inside, limited, line, proven, refused
from support.planned_arms import IIWA

import armangle as aa

AMID = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
STRETCHED = np.array([0.1, 0.4, 0.2, 0.0, 0.3, 0.8, 0.5])
CANDLE = np.zeros(7)
NEAR = 1e-6


def plan_to(end: np.ndarray, fixed: bool, back: bool) -> aa.JointPath:
    """A plan between AMID and `end`, reversed if `back`, with the joints of `end` asked if `fixed`."""
    ends = IIWA.forward(np.array([AMID, end]), on_error="nan")[0]
    asked = {"start" if back else "goal": end} if fixed else {}
    return aa.plan(IIWA, aa.Line(*(ends[::-1] if back else ends)), **asked)


@pytest.mark.turns(2)
@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("end", [STRETCHED, CANDLE], ids=["stretched", "candle"])
def test_a_stretched_end_is_come_to_without_a_leap(end: np.ndarray, fixed: bool, back: bool) -> None:
    """Near a stretched end a plan's joints move as the root of s, without a leap."""
    result = plan_to(end, fixed, back)
    assert result.ok, result.explain()
    q = result.at([0.0, NEAR] if back else [1.0, 1.0 - NEAR]).q
    speed = np.abs(q[1] - q[0]).max() / np.sqrt(NEAR)
    assert speed < 5.0
    rows = np.diff(result.q, axis=0), np.sqrt(np.diff(result.s))[:, None]
    assert np.abs(rows[0] / rows[1]).max() < 5.0
    np.testing.assert_allclose(IIWA.forward(result.q, on_error="nan")[0], result.poses, atol=1e-12)
    assert result.certified == (end is STRETCHED)
    if fixed:
        np.testing.assert_allclose(result.q[0 if back else -1], end, atol=1e-9)


@pytest.mark.parametrize("back", [False, True])
def test_a_limit_just_inside_what_a_stretched_end_needs_is_not_certified(back: bool) -> None:
    """A plan to a stretched end is not certified with a limit just inside its joints there."""
    end = 0 if back else len(DENSE) - 1
    assert just_inside(plan_to(STRETCHED, True, back), where=lambda at: at == end) > 2


def test_a_margin_is_not_proven_at_a_stretched_end_and_beyond_the_reach_is_refused() -> None:
    """With a margin a plan to a stretched end is not certified; just beyond reach it fails."""
    way = plan_to(STRETCHED, False, False).path
    assert not aa.plan(IIWA.with_(singularity_margin=1e-3), way).certified
    last = way.end.copy()
    last[:3, 3] *= 1 + 1e-9
    refused = aa.plan(IIWA, aa.Line(way.start, last))
    assert not refused.ok and "reach" in refused.explain()


@pytest.mark.parametrize("back", [False, True])
def test_no_timing_and_the_true_reason(back: bool) -> None:
    """At a stretched end derivatives are NaN, and `retime` says that joints have no finite speed."""
    pytest.importorskip("scipy")
    result = plan_to(CANDLE, True, back)
    inner, end = result.derivatives([0.5, 0.0 if back else 1.0])
    assert np.isfinite(inner).all()
    assert np.isnan(end).all()
    with pytest.raises(aa.PathError, match=rf"at s = {0 if back else 1} joints have no finite speed"):
        aa.retime(result, acceleration=5.0)


def test_many_windings_at_a_singular_start_are_searched_within_the_budget() -> None:
    """A plan from a singular start is certified though four joints may be turned by 2π."""
    arm = aa.Arm.from_catalogue("mitsubishi_pa10")
    for joint in (2, 6):
        arm = limited(arm, joint, arm.lower[joint] - 6, arm.upper[joint] + 6)
    start = np.array([-2.185348, -0.373359, -1.868826, -1.244487, -1.783982, 0.0, 3.234194])
    proven(aa.plan(arm, line(arm, start, [4e-4, -3e-4, 5e-4]), start=start), start)


@pytest.mark.parametrize(
    ("name", "hinge", "draws", "length"),
    [("barrett_wam7", 1, 8, 1e-6), ("barrett_wam7", 5, 8, 1e-6), ("human_arm_left", 5, 40, 0.03)],
)
def test_what_follow_does_from_where_a_hinge_is_shut_a_plan_does(
    name: str, hinge: int, draws: int, length: float
) -> None:
    """Where `follow` leads from joint 2 or 6 singular with the elbow stretched, a plan does; where joint 6 is
    on its limit, 90 % are certified.
    """
    arm, half_turn = aa.Arm.from_catalogue(name), name == "human_arm_left"
    rng, ways, certified = generator(21, hinge), 0, 0
    for _ in range(count(draws)):
        start = rng.uniform(0.8 * arm.lower, 0.8 * arm.upper)
        start[hinge] = arm.geometry.signs[hinge] * -arm.geometry.offsets[hinge]
        if half_turn:
            start[hinge] = min(
                arm.lower[5],
                arm.upper[5],
                key=lambda q: np.cos(arm.geometry.signs[5] * q + arm.geometry.offsets[5]),
            )
        else:
            start[3] = arm.geometry.signs[3] * (arm.geometry.delta - arm.geometry.offsets[3])
        way = line(arm, start, length * rng.normal(size=3))
        if not aa.follow(arm, way, start=start, samples=2001, max_joint_step=0.02, policy=aa.Hold()).ok:
            continue
        ways += 1
        path = aa.plan(arm, way, start=start)
        certified += path.certified
        assert path.ok or half_turn
        if path.ok:
            dense = path.at(np.linspace(0, 1, 2001)).q
            assert arm.within_limits(dense, 1e-9).all() and np.abs(np.diff(path.q, axis=0)).max() < 0.2 + 1e-9
            assert half_turn or np.abs(np.diff(dense, axis=0)).max() < 0.05
    assert ways > 1 + 2 * half_turn and (not half_turn or certified >= 0.9 * ways), (certified, ways)


def test_a_goal_that_the_start_does_not_lead_to_and_a_start_elsewhere_are_told() -> None:
    """`plan` says that a goal is in a branch the start does not lead to, or a start off the path."""
    home = np.radians([0, 0, 0, -90, 0, 90, 0])
    way = aa.Line(IIWA.forward(home)[0], aa.pose([0.5, -0.15, 0.4], rpy=[np.pi, 0, np.pi]))
    assert aa.plan(IIWA, way, start=home).ok
    other = next(s for s in IIWA.solutions(way.end, seed=home) if s.gc not in (2, 3))
    failed = aa.plan(IIWA, way, start=home, goal=other.q)
    assert not failed.ok and "plan without goal=" in failed.explain()
    way = line(IIWA, AMID, [0, 0, 0.1])
    refused(aa.InputError, r"Line from arm.forward\(start\)\[0\]", aa.plan, IIWA, way, start=AMID + 0.3)
