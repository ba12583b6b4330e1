"""Freedom, and turns of base and tool: against the arcs of poses that are turned by hand."""

from __future__ import annotations

import numpy as np
import pytest
from support import draw
from support.planned_arms import random_arm
from support.threads import in_threads

import armangle as aa
from armangle.models.catalogue import srs_catalogue

NARROW = ["openarm_v10", "human_arm_left", "yaskawa_sia5d", "kuka_iiwa7_r800", "barrett_wam7"]
Poses = np.ndarray


def turned(arm: aa.Arm, pose: Poses, angle: Poses, of_base: bool) -> Poses:
    """The pose turned by `angle` (...), rad, about axis 1 if `of_base`, else about axis 7."""
    turn = np.zeros((*np.shape(angle), 4, 4))
    turn[..., 2, 2] = turn[..., 3, 3] = 1.0
    turn[..., 0, 0] = turn[..., 1, 1] = np.cos(angle)
    turn[..., 1, 0] = np.sin(angle)
    turn[..., 0, 1] = -np.sin(angle)
    frame = arm.base if of_base else arm.tool
    inverse = np.linalg.inv(frame)
    return frame @ turn @ inverse @ pose if of_base else pose @ inverse @ turn @ frame


def poses_of(arm: aa.Arm, rng: np.random.Generator, count: int) -> Poses:
    """Poses of random joints up to 0.3 rad beyond the limits, some with theta_2 or theta_6 exactly 0."""
    bound = np.pi
    lower, upper = np.maximum(arm.lower, -bound), np.minimum(arm.upper, bound)
    q = rng.uniform(lower - 0.3, upper + 0.3, (count, 7))
    for joint in (1, 5):
        q[rng.random(count) < 0.1, joint] = -arm.geometry.offsets[joint] * arm.geometry.signs[joint]
    return arm.forward(q, on_error="nan")[0]


SINGULAR = [(), (1,), (3,), (5,), (1, 3), (3, 5), (1, 5), (1, 3, 5)]
"""Which of joints 2, 4 and 6 are at 0 (index 1, 3, 5)."""


def postures_of(arm: aa.Arm, rng: np.random.Generator, count: int) -> Poses:
    """Joints within the limits, for each of SINGULAR at most `count`, some exactly at a limit."""
    straight = arm.geometry.signs * (np.array([0, 0, 0, arm.geometry.delta, 0, 0, 0]) - arm.geometry.offsets)
    q = rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (len(SINGULAR), count, 7))
    for own, joints in zip(q, SINGULAR, strict=True):
        ends = rng.choice([-1, 0, 0, 0, 0, 1], own.shape)
        own[ends < 0] = np.broadcast_to(arm.lower, own.shape)[ends < 0]
        own[ends > 0] = np.broadcast_to(arm.upper, own.shape)[ends > 0]
        own[:, joints] = straight[list(joints)]
    q = q.reshape(-1, 7)
    return q[arm.within_limits(q, 0.0)]


def plain_postures_of(arm: aa.Arm, rng: np.random.Generator, count: int) -> Poses:
    """Joints (count, 7) that are all at 0, a right angle or a limit."""
    q = np.empty((count, 7))
    for joint, (lower, upper) in enumerate(zip(arm.lower, arm.upper, strict=True)):
        choice = np.array([-np.pi / 2, 0.0, np.pi / 2, lower, upper])
        q[:, joint] = rng.choice(choice[(choice >= lower) & (choice <= upper)], count)
    return q


def arms(rng: np.random.Generator) -> list[aa.Arm]:
    """Arms of the catalogue, and random ones with base and tool."""
    base, tool = np.eye(4), aa.pose([0.05, 0.02, 0.1], rpy=[0.3, 0.2, 0.1])
    base[:3, 3] = 0.1, 0.2, 0.3
    own = [aa.Arm.from_catalogue(name) for name in NARROW]
    return [*own, *(random_arm(rng).with_(base=base, tool=tool) for _ in range(6))]


@pytest.mark.turns(8)
@pytest.mark.parametrize("name", srs_catalogue())
def test_freedom_agrees_with_arcs_and_postures_where_joints_are_one_axis(name: str) -> None:
    """At singularities `freedom`, `feasible`, `reachable`, `feasible_turns` and `solve` agree."""
    arm = aa.Arm.from_catalogue(name)
    q = postures_of(arm, draw.generator(16, 5), draw.count(40))
    theta, poses = arm.geometry.signs * q + arm.geometry.offsets, arm.forward(q, on_error="nan")[0]
    has, arcs = arm.freedom(poses), arm.feasible(poses)
    assert np.abs(has.total - arcs.measure.sum(axis=-1)).max() < 1e-12
    assert np.array_equal(has.arcs, arcs.count.sum(axis=-1))
    bits = (~arcs.is_empty) @ (1 << np.arange(8))
    assert not (bits & ~has.gc).any()
    assert np.array_equal(arm.reachable(poses), has.gc != 0)
    for turns in (arm.feasible_turns(poses, about="base"), arm.feasible_turns(poses, about="tool")):
        assert turns.contains(0.0)[has.gc != 0].all()
    shown = np.zeros(has.gc.shape, np.uint8)
    for gc in range(8):  # a branch without arcs holds a pose by a share of a turn: the posture is shown
        found = arm.solve(poses, gc=gc)
        shown |= found.ok.astype(np.uint8) << np.uint8(gc)
        assert arm.within_limits(found.q[found.ok], 1e-10).all()
        back = arm.forward(found.q[found.ok], on_error="nan")[0]
        assert np.abs(back - poses[found.ok]).max(initial=0.0) < 1e-9
    # with both hinges at 0 at one arm angle a posture is one of four branches at once: one may be shown
    assert not (shown & ~has.gc).any() and np.array_equal(shown != 0, has.gc != 0)
    assert (shown == has.gc)[(np.abs(theta[:, [1, 5]]) > 1e-12).any(axis=-1)].all()


@pytest.mark.turns(8)
@pytest.mark.parametrize("name", srs_catalogue())
def test_a_posture_at_its_limits_holds_its_pose(name: str) -> None:
    """All functions hold poses of joints at right angles and limits, if not singular."""
    # beside a singular posture rounding moves a joint by more than the 1e-11 rad of an isolated arm angle
    arm = aa.Arm.from_catalogue(name)
    rng = draw.generator(16, 6)
    q = np.concatenate([plain_postures_of(arm, rng, draw.count(300)), postures_of(arm, rng, 10)])
    pose, psi, gc = arm.forward(q, on_error="nan")
    known = np.isfinite(psi)
    pose, psi, gc, q = pose[known], psi[known], gc[known], q[known]
    bends = np.sin(
        (arm.geometry.signs * q + arm.geometry.offsets - [0, 0, 0, arm.geometry.delta, 0, 0, 0])[:, [1, 3, 5]]
    )
    sharp = (np.abs(bends) > 0.02).all(axis=-1)
    assert sharp.sum() > 20
    has = arm.freedom(pose)
    assert arm.reachable(pose)[sharp].all()
    assert (has.gc >> gc & 1)[sharp].all()
    assert not arm.feasible(pose, gc).is_empty[sharp].any()
    assert arm.solve(pose).ok[sharp].all()


@pytest.mark.parametrize("of_base", [True, False])
def test_a_turn_is_in_the_arcs_where_the_turned_pose_is_reachable(of_base: bool) -> None:
    """`feasible_turns` holds the angles at which the turned pose is reachable."""
    rng = draw.generator(16, 3, of_base)
    checked = 0
    for arm in arms(rng):
        for pose in poses_of(arm, rng, 12):
            arcs = arm.feasible_turns(pose, about="base" if of_base else "tool")
            angle = rng.uniform(-np.pi, np.pi, 120)
            ends = arcs.intervals[~np.isnan(arcs.intervals)].ravel()
            if len(ends) and not arcs.is_full:
                near = rng.choice(ends, 60) + rng.choice([-1, 1], 60) * 10.0 ** rng.uniform(-7, -1, 60)
                angle = np.concatenate([angle, near])
            holds = np.asarray(arcs.contains(angle))
            there = turned(arm, pose, angle, of_base)
            says = arm.reachable(there)
            differ = holds != says
            if differ.any():  # an arm angle alone may hold a pose; solve knows it
                differ[differ] = holds[differ] != arm.solve(there[differ]).ok
            if differ.any() and len(ends):
                away = np.abs((angle[differ, None] - ends + np.pi) % (2 * np.pi) - np.pi).min(axis=-1)
                assert (away < 1e-7).all()
            elif differ.any():
                raise AssertionError((pose, angle[differ]))
            checked += len(angle)
    assert checked > 10_000


def test_ends_name_the_joint_that_turns_and_its_limit() -> None:
    """Ends of `feasible_turns` name joint 1 or 7 and its limit."""
    arm = aa.Arm.from_catalogue("openarm_v10")
    pose = aa.pose([0.1, 0.3, 0.2])
    for arcs, joint in (
        (arm.feasible_turns(pose, about="base"), 1),
        (arm.feasible_turns(pose, about="tool"), 7),
    ):
        assert not arcs.is_full and arcs.count > 0
        for pair in arcs.ends:
            assert [end.joint for end in pair] == [joint, joint]
            assert [end.value for end in pair] == [
                {"lower": arm.lower, "upper": arm.upper}[end.side][joint - 1] for end in pair
            ]


def test_where_the_arm_is_straight_along_its_base_axis_joints_1_and_3_share_the_turn() -> None:
    """Turns of the base of an upright arm go as far as joints 1 and 3 together."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(
        lower=np.radians([-20, -120, -30, -120, -170, -120, -175]),
        upper=np.radians([20, 120, 30, 120, 170, 120, 175]),
    )
    candle = arm.forward(np.zeros(7))[0]
    turns = arm.feasible_turns(candle, about="base")
    # 50 degrees either way by joints 1 and 3 alone; wrist and arm angle give more
    assert turns.contains(np.radians([-49.9, 0.0, 49.9])).all()
    for angle in np.radians([-49.9, 30.0, 49.9]):
        assert arm.solve(turned(arm, candle, angle, True)).ok


def test_no_pose_is_no_turn_and_batches_are_their_poses() -> None:
    """`feasible_turns`, `reachable` and `freedom` take batches, no poses and poses out of reach."""
    arm = aa.Arm.from_catalogue("openarm_v10")
    poses = poses_of(arm, draw.generator(16, 4), 20).reshape(4, 5, 4, 4)
    turns = arm.feasible_turns(poses, about="base")
    assert turns.shape == (4, 5)
    assert turns[2, 3] == arm.feasible_turns(poses[2, 3], about="base")
    assert in_threads(2, lambda: arm.feasible_turns(poses, about="base")) == turns
    assert arm.feasible_turns(np.empty((0, 4, 4)), about="tool").shape == (0,)
    assert arm.reachable(np.empty((0, 4, 4))).shape == (0,)
    assert arm.freedom(np.empty((0, 4, 4))).gc.shape == (0,)
    far = arm.feasible_turns(aa.pose([9.0, 0.0, 0.0]), about="base")
    assert far.is_empty and far.status is aa.Status.UNREACHABLE
    one = arm.freedom(poses[0, 0])
    assert isinstance(one.status, aa.Status) and one.gc.shape == ()


def test_locked_joints_leave_single_turns() -> None:
    """With locked joints `reachable`, `feasible_turns` and `place` hold the pose."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.array([0.3, 0.3, 0.2, -1.0, 0.3, 0.8, 0.5])
    pose = arm.forward(q)[0]
    for joints in ([0, 2], [0, 1], [2, 6], list(range(7))):
        lower, upper = arm.lower.copy(), arm.upper.copy()
        lower[joints] = upper[joints] = q[joints]
        locked = arm.with_(lower=lower, upper=upper)
        assert locked.reachable(pose)
        assert 0.0 in locked.feasible_turns(pose, about="base")
        assert 0.0 in locked.feasible_turns(pose, about="tool")
        found = aa.place(locked, pose[None], [0.0], [0.0])
        assert found.reached.item() == 1.0 and found.missed() == ()
