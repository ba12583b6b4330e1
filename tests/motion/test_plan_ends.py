"""Where a plan begins or ends with the arm stretched: no leap, a proof where there is one, true reasons."""

from __future__ import annotations

import numpy as np
import pytest
from support.draw import count, generator
from support.planned_arms import IIWA

import armangle as aa

AMID = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
STRETCHED = np.array([0.1, 0.4, 0.2, 0.0, 0.3, 0.8, 0.5])
CANDLE = np.zeros(7)
NEAR = 1e-6
DENSE = np.linspace(0, 1, 5001)


def pose_of(q: np.ndarray) -> np.ndarray:
    """The tool's pose, also where no arm angle is."""
    return np.asarray(IIWA.forward(q, on_error="nan")[0])


def plan_to(end: np.ndarray, fixed: bool, back: bool) -> aa.JointPath:
    """A line between a posture amid the limits and a stretched one, whose joints are asked or not."""
    line = aa.Line(pose_of(end), pose_of(AMID)) if back else aa.Line(pose_of(AMID), pose_of(end))
    asked = {"start" if back else "goal": end} if fixed else {}
    return aa.plan(IIWA, line, **asked)


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("end", [STRETCHED, CANDLE], ids=["stretched", "candle"])
def test_a_stretched_end_is_come_to_without_a_leap(end: np.ndarray, fixed: bool, back: bool) -> None:
    """Joints move as the root of the way there: over a millionth of it by a thousandth of a radian."""
    result = plan_to(end, fixed, back)
    assert result.ok, result.explain()
    q = result.at([0.0, NEAR] if back else [1.0, 1.0 - NEAR]).q
    speed = np.abs(q[1] - q[0]).max() / np.sqrt(NEAR)
    assert speed < 5.0
    rows = np.diff(result.q, axis=0), np.sqrt(np.diff(result.s))[:, None]
    assert np.abs(rows[0] / rows[1]).max() < 5.0
    np.testing.assert_allclose(pose_of(result.q), result.poses, atol=1e-12)
    assert result.certified == (end is STRETCHED)
    if fixed:
        np.testing.assert_allclose(result.q[0 if back else -1], end, atol=1e-9)


@pytest.mark.parametrize("back", [False, True])
def test_a_limit_just_inside_what_a_stretched_end_needs_is_not_certified(back: bool) -> None:
    result = plan_to(STRETCHED, True, back)
    x = result.curve
    assert x is not None
    end = 0 if back else -1
    q = result.at(DENSE).q
    for joint in range(7):
        for side, extreme in (("lower", q[:, joint].argmin()), ("upper", q[:, joint].argmax())):
            at_end = extreme == end % len(DENSE)
            if not at_end:
                continue
            for inset, proven in ((1e-6, False), (-1e-3, True)):
                limits = {"lower": IIWA.lower.copy(), "upper": IIWA.upper.copy()}
                limits[side][joint] = q[end, joint] + (inset if side == "lower" else -inset)
                open_, _ = IIWA.with_(**limits)._handle.certify_curve(
                    x.segments, x.stretches, x.plane, x.gc, 0.0
                )
                assert (len(open_) == 0) == proven, (joint, side)


def test_a_margin_asked_is_not_proven_at_a_stretched_end() -> None:
    line = aa.Line(pose_of(AMID), pose_of(STRETCHED))
    assert not aa.plan(IIWA.with_(singularity_margin=1e-3), line).certified


def test_a_path_that_goes_beyond_the_reach_is_refused() -> None:
    last = pose_of(STRETCHED)
    last[:3, 3] *= 1 + 1e-9
    refused = aa.plan(IIWA, aa.Line(pose_of(AMID), last))
    assert not refused.ok
    assert "reach" in refused.explain()


@pytest.mark.parametrize("back", [False, True])
def test_no_timing_and_the_true_reason(back: bool) -> None:
    pytest.importorskip("scipy")
    result = plan_to(CANDLE, True, back)
    inner, end = result.derivatives([0.5, 0.0 if back else 1.0])
    assert np.isfinite(inner).all()
    assert np.isnan(end).all()
    with pytest.raises(aa.PathError, match=rf"at s = {0 if back else 1} joints have no finite speed"):
        aa.retime(result, acceleration=5.0)


@pytest.mark.parametrize("hinge", [1, 5])
def test_a_short_way_out_of_a_stretched_arm_with_a_hinge_at_zero(hinge: int) -> None:
    """Neither has the proof a margin there; what `follow` does a plan does, and nothing leaps."""
    arm = aa.Arm.from_catalogue("barrett_wam7")
    rng, ways = generator(21, hinge), 0
    for _ in range(count(8)):
        start = rng.uniform(0.8 * arm.lower, 0.8 * arm.upper)
        start[3] = arm.signs[3] * (arm.delta - arm.offsets[3])
        start[hinge] = arm.signs[hinge] * -arm.offsets[hinge]
        first = arm.forward(start)[0]
        last = first.copy()
        last[:3, 3] += 1e-6 * rng.normal(size=3)
        line = aa.Line(first, last)
        followed = aa.follow(arm, line, start=start, samples=4001, max_joint_step=0.02, policy=aa.Hold())
        if not followed.ok:
            continue
        ways += 1
        path = aa.plan(arm, line, start=start)
        assert path.ok, path.explain()
        dense = path.at(np.linspace(0, 1, 2001)).q
        assert np.abs(np.diff(dense, axis=0)).max() < 0.05 and arm.within_limits(dense, 1e-9).all()
    assert ways > 1


def test_many_windings_at_a_singular_start_are_searched_within_the_budget() -> None:
    """Each joint of four turns multiplies the postures of a section: the cheapest lead on."""
    free = aa.Arm.from_catalogue("mitsubishi_pa10")
    start = np.array([-2.185348, -0.373359, -1.868826, -1.244487, -1.783982, 0.0, 3.234194])
    lower, upper = free.lower.copy(), free.upper.copy()
    lower[[2, 6]] -= 6
    upper[[2, 6]] += 6
    arm = free.with_(lower=lower, upper=upper)
    first = arm.forward(start)[0]
    last = first.copy()
    last[:3, 3] += [4e-4, -3e-4, 5e-4]
    path = aa.plan(arm, aa.Line(first, last), start=start)
    assert path.certified, path.explain()


def test_a_start_with_a_hinge_at_half_a_turn() -> None:
    """Joint 6 of a human arm on one of its limits is at theta = -pi: there two branches meet as at 0."""
    arm = aa.Arm.from_catalogue("human_arm_left")
    rng, ways, certified = generator(22), 0, 0
    for _ in range(count(40)):
        start = rng.uniform(0.8 * arm.lower, 0.8 * arm.upper)
        start[5] = min(arm.lower[5], arm.upper[5], key=lambda q: np.cos(arm.signs[5] * q + arm.offsets[5]))
        assert np.cos(arm.signs[5] * start[5] + arm.offsets[5]) < -1 + 1e-12
        first = arm.forward(start)[0]
        last = first.copy()
        last[:3, 3] += 0.03 * rng.normal(size=3)
        line = aa.Line(first, last)
        followed = aa.follow(arm, line, start=start, samples=1001, max_joint_step=0.04, policy=aa.Hold())
        if not followed.ok:
            continue
        ways += 1
        path = aa.plan(arm, line, start=start)
        certified += path.certified
        if path.ok:
            assert np.abs(np.diff(path.q, axis=0)).max() < 0.2 + 1e-9
            assert arm.within_limits(path.at(np.linspace(0, 1, 1001)).q, 1e-9).all()
    assert ways > 3 and certified >= 0.9 * ways, (certified, ways)


def test_a_goal_that_the_start_does_not_lead_to_says_what_it_does() -> None:
    """At home two branches are one; a path leaves it in one of them only."""
    home = np.radians([0, 0, 0, -90, 0, 90, 0])
    line = aa.Line(IIWA.forward(home)[0], aa.pose([0.5, -0.15, 0.4], rpy=[np.pi, 0, np.pi]))
    assert aa.plan(IIWA, line, start=home).ok
    other = next(s for s in IIWA.solutions(line.end, seed=home) if s.gc not in (2, 3))
    refused = aa.plan(IIWA, line, start=home, goal=other.q)
    assert not refused.ok
    assert refused.explain().endswith("to another posture of the last pose: plan without goal=.")


def test_a_start_elsewhere_is_told_how_to_go_there() -> None:
    line = aa.Line(pose_of(AMID), pose_of(AMID) @ aa.pose([0, 0, 0.1]))
    with pytest.raises(aa.InputError, match=r"begin it with a Line from arm.forward\(start\)\[0\]"):
        aa.plan(IIWA, line, start=AMID + 0.3)
