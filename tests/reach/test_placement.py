"""Base placement: no scanned yaw finds more, and what is said to be reached is."""

from __future__ import annotations

import numpy as np
import pytest
from support.families import CHAINS, of
from support.maps import ARMS, OFFSET_ARMS
from support.moves import refused
from support.threads import in_threads

import armangle as aa


def grasps(rng: np.random.Generator, count: int) -> np.ndarray:
    """Poses (count, 4, 4) of tools that point down, each rolled and pitched by at most 1 rad, on a table."""
    angles = np.stack(
        [rng.uniform(-1, 1, count), np.pi + rng.uniform(-1, 1, count), rng.uniform(-np.pi, np.pi, count)], -1
    )
    return aa.pose(rng.uniform([-0.6, -0.6, 0.0], [0.6, 0.6, 0.4], (count, 3)), rpy=angles)


def at(base: np.ndarray, arm: aa.Arm, yaw: float) -> aa.Arm:
    """The arm on a base at that position, turned by `yaw` (rad) about the vertical."""
    frame = base.copy()
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    frame[:3, :3] = turn @ arm.base[:3, :3]
    return arm.with_(base=frame)


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", [*ARMS, "kuka_iiwa7_r800", *OFFSET_ARMS])
@pytest.mark.parametrize("hanging", [False, True])
def test_no_scanned_yaw_beats_it(name: str, hanging: bool) -> None:
    """`place` reaches the weight it says, also near both ends of its stretch; no scanned yaw reaches more."""
    arm, (many, yaws) = aa.Arm.load(name), (12, 61) if name in OFFSET_ARMS else (60, 181)
    if hanging:
        arm = arm.with_(base=np.diag([1.0, -1.0, -1.0, 1.0]))
    rng = np.random.default_rng(3)
    poses, weight = grasps(rng, many), rng.uniform(0.5, 2.0, many)
    found = aa.place(arm, poses, [-0.3, 0.1], [-0.2, 0.3], z=0.5 if hanging else 0.0, weight=weight)
    assert found.reached.max() > 3.0
    for (i, j), reached in np.ndenumerate(found.reached):
        base = found.base(i, j)
        assert weight[arm.with_(base=base).reachable(poses)].sum() == pytest.approx(reached, abs=1e-9)
        for yaw in np.linspace(-np.pi, np.pi, yaws):
            assert weight[at(base, arm, yaw).reachable(poses)].sum() <= reached + 1e-9
        half = 0.499 * found.stretch[i, j]
        for yaw in (found.yaw[i, j] - half, found.yaw[i, j] + half):
            assert weight[at(base, arm, yaw).reachable(poses)].sum() == pytest.approx(reached, abs=1e-9)
    lost = {k for k, _ in found.missed()}
    assert lost == set(np.flatnonzero(~arm.with_(base=found.best()).reachable(poses)))
    assert all(why is not aa.Status.OK for _, why in found.missed())


@of(CHAINS)
@pytest.mark.parametrize("hanging", [False, True])
def test_what_an_own_chain_is_proven_to_reach_it_reaches(arm: aa.Arm, hanging: bool) -> None:
    """`place` of an own chain reaches the weight it says from the base it gives, and no more than `unproven`
    beyond it; no scanned yaw about its own axis is proven to reach more.
    """
    if hanging:
        arm = arm.with_(base=np.diag([1.0, -1.0, -1.0, 1.0]) @ arm.base)
    rng = np.random.default_rng(3)
    poses, weight = grasps(rng, 8), rng.uniform(0.5, 2.0, 8)
    found = aa.place(arm, poses, [-0.3], [-0.2, 0.3], z=0.5 if hanging else 0.0, weight=weight)
    assert found.reached.max() > 2.0
    for (i, j), reached in np.ndenumerate(found.reached):
        base = found.base(i, j)
        stands = arm.with_(base=base)
        axis = stands.frames(np.zeros(7))[0]
        np.testing.assert_allclose(axis[:2, 3], [found.x[i], found.y[j]], rtol=0, atol=1e-12)
        np.testing.assert_allclose(abs(axis[2, 2]), 1.0, rtol=0, atol=1e-15)
        held = weight[stands.reachable(poses)].sum()
        assert reached - 1e-9 <= held <= reached + found.unproven[i, j] + 1e-9
        for yaw in rng.uniform(-np.pi, np.pi, 20):
            turned = aa.pose([0, 0, 0], rpy=[0, 0, yaw]) @ base
            turned[:2, 3] += axis[:2, 3] - (turned @ np.linalg.inv(base) @ axis)[:2, 3]
            proven = arm.with_(base=turned).feasible(poses).ok.any(axis=-1)
            assert weight[proven].sum() <= reached + 1e-9


@pytest.mark.parametrize("name", [*ARMS, *OFFSET_ARMS])
def test_no_pose_all_out_of_reach_and_one(name: str) -> None:
    """`place` takes no pose, poses all out of reach, and a single one."""
    arm = aa.Arm.load(name)
    none = aa.place(arm, [], [0.0], [0.0, 0.1])
    assert none.reached.tolist() == [[0.0, 0.0]] and none.missed() == ()
    far = aa.place(arm, aa.pose([[9.0, 0.0, 0.0]] * 3), [0.0], [0.0])
    assert str(far) == "0 of 3 reached from any of 1 positions"
    assert far.reached[0, 0] == 0 and [k for k, _ in far.missed()] == [0, 1, 2]
    one = aa.place(
        arm, grasps(np.random.default_rng(1), 1), np.linspace(-0.4, 0.4, 9), np.linspace(-0.4, 0.4, 9)
    )
    assert one.reached.max() == 1.0
    assert one.arm is arm and "of 1 reached from" in str(one)


@pytest.mark.parametrize("name", ARMS)
def test_threads_change_nothing(name: str) -> None:
    """`place` gives equal results in 1 and 3 threads."""
    arm = aa.Arm.from_catalogue(name)
    poses = grasps(np.random.default_rng(2), 40)
    a, b = (in_threads(n, lambda: aa.place(arm, poses, np.linspace(0, 0.3, 4), [0.1])) for n in (1, 3))
    assert np.array_equal(a.yaw, b.yaw) and np.array_equal(a.reached, b.reached)


@pytest.mark.parametrize("name", ARMS)
def test_a_pose_that_is_none_is_refused_before_any_work(name: str) -> None:
    """`place` refuses a pose that holds NaN and names its row."""
    poses = grasps(np.random.default_rng(4), 3)
    poses[1, 0, 3] = np.nan
    refused(aa.InputError, r"poses\[1\]", lambda: aa.place(aa.Arm.from_catalogue(name), poses, [0.0], [0.0]))


def test_a_base_that_leans_is_refused_with_its_angle() -> None:
    """`place` refuses an arm whose axis 1 is not vertical."""
    base = np.eye(4)
    base[:3, :3] = aa.pose([0, 0, 0], rpy=[0.1, 0, 0])[:3, :3]
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(base=base)
    refused(aa.InputError, r"leans axis 1 by 5.73 deg", lambda: aa.place(arm, [], [0.0], [0.0]))
