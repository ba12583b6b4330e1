"""Paths of arms with an offset, own chains too, between their rows: on the pose, smooth, and timed."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from support.gradients import named

import armangle as aa

ARMS = ["franka_fr3", "ufactory_xarm7", "willow_garage_pr2_left"]
ARMS += ["calibrated franka_fr3", "calibrated willow_garage_pr2_left"]
READY = {
    "franka_fr3": [0.1, -0.6, 0.2, -2.2, 0.1, 1.9, 0.7],
    "ufactory_xarm7": [0.1, 0.4, 0.2, 1.2, 0.3, 0.9, 0.2],
    "willow_garage_pr2_left": [0.4, 0.5, 0.6, -1.3, 0.4, -0.8, 0.3],
}
POLICIES: list[Any] = [aa.Hold(), aa.Centre(K=0.2)]


def followed(name: str, policy: Any = POLICIES[0], count: int = 25) -> aa.JointPath:
    """Return a motion of 8 cm that turns the tool by 0.2 rad, in one branch."""
    arm, ready = named(name), READY[name.split()[-1]]
    first = arm.forward(ready)[0]
    s = np.linspace(0.0, 1.0, count)[:, None]
    poses = first @ aa.pose(s * [0.03, 0.05, -0.06], rotvec=s * [0.1, 0.1, -0.15])
    path = aa.follow(arm, poses, start=ready, policy=policy)
    assert path.ok and len(set(path.gc.tolist())) == 1
    return path


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("policy", POLICIES, ids=lambda p: type(p).__name__)
def test_it_is_on_its_pose_between_the_rows_and_meets_them(name: str, policy: Any) -> None:
    """`JointPath.at` of a followed motion holds the pose between the rows, meets the rows and does
    not leap.
    """
    path, s = followed(name, policy), np.linspace(0.0, 1.0, 401)
    between, arm = path.at(s), path.arm
    pose, free, gc = arm.forward(between.q)
    np.testing.assert_allclose(pose, between.pose, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.cos(free - between.psi), 1.0, rtol=0, atol=1e-12)
    assert (gc == path.gc[0]).all() and (between.gc == path.gc[0]).all()
    np.testing.assert_allclose(path.at(path.s).q, path.q, rtol=0, atol=1e-9)
    np.testing.assert_allclose(path.at(path.s).pose, path.poses, rtol=0, atol=1e-12)
    rows = np.abs(np.diff(path.q, axis=0)).max()
    assert np.abs(np.diff(between.q, axis=0)).max() < rows  # no leap in between


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("policy", POLICIES, ids=lambda p: type(p).__name__)
def test_its_derivatives_are_differences(name: str, policy: Any) -> None:
    """The derivatives of a followed motion equal finite differences."""
    path, h = followed(name, policy), 1e-5
    s = (path.s[:-1, None] + np.diff(path.s)[:, None] * [0.2, 0.7]).reshape(-1)
    exact = path.derivatives(s)
    first = (path.at(s + h).q - path.at(s - h).q) / (2 * h)
    higher = (path.derivatives(s + h)[:, :2] - path.derivatives(s - h)[:, :2]) / (2 * h)
    np.testing.assert_allclose(exact[:, 0], first, rtol=0, atol=1e-6)
    np.testing.assert_allclose(exact[:, 1:], higher, rtol=1e-4, atol=1e-4)
    assert np.abs(exact[:, 1:]).max() > 0.1


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("jerk", [None, 60.0])
def test_it_is_timed_within_its_bounds(name: str, jerk: float | None) -> None:
    """`retime` of a followed motion keeps its bounds and, but for 0.1 mm under a jerk bound, its line."""
    path = followed(name)
    motion = aa.retime(path, velocity=1.5, acceleration=4.0, jerk=jerk, sample=1e-3)
    assert np.abs(motion.qd).max() <= 1.5 * 1.002 and np.abs(motion.qdd).max() <= 4.0 * 1.002
    np.testing.assert_allclose(motion.q[[0, -1]], path.q[[0, -1]], rtol=0, atol=1e-9)
    tool = path.arm.forward(motion.q)[0][:, :3, 3]
    line = path.at(motion.s).pose[:, :3, 3]
    assert np.linalg.norm(tool - line, axis=1).max() <= motion.deviation.position + 1e-9
    assert motion.deviation.position <= (0.0 if jerk is None else 1e-4)


def test_it_is_slower_than_the_joints_alone_and_stops_at_neither_row() -> None:
    """`retime` takes under half the time of stops at all rows, and no less than one joint motion from end to
    end.
    """
    path = followed("franka_fr3")
    fast = aa.retime(path, velocity=1.5, acceleration=4.0)
    steps = np.abs(np.diff(path.q, axis=0)).max(axis=1)
    assert fast.duration < 0.5 * (2 * np.sqrt(steps / 4.0)).sum()
    least = 2 * np.sqrt(np.abs(path.q[-1] - path.q[0]).max() / 4.0)
    assert fast.duration >= least


def test_it_travels_whole_and_joins() -> None:
    """A followed motion of an offset arm can be pickled, joined and retimed."""
    path = followed("franka_fr3")
    s = np.linspace(0, 1, 33)
    again = pickle.loads(pickle.dumps(path))
    np.testing.assert_array_equal(again.at(s).q, path.at(s).q)
    back = aa.follow(path.arm, path.poses[::-1], start=path.q[-1], policy=aa.Hold())
    both = aa.join([path, back])
    np.testing.assert_allclose(both.at([0.0, 0.5, 1.0]).q, [path.q[0], path.q[-1], path.q[0]], atol=1e-9)
    assert aa.retime(both, acceleration=4.0).duration > aa.retime(path, acceleration=4.0).duration


def test_a_single_row_stays() -> None:
    """`JointPath.at` of one row is that row everywhere."""
    path = followed("franka_fr3", count=1)
    np.testing.assert_allclose(path.at([0.0, 0.4, 1.0]).q, np.repeat(path.q, 3, axis=0), rtol=0, atol=1e-12)


def test_a_fold_is_passed_as_any_place() -> None:
    """`follow` of a Franka passes theta_5 = 90 degrees into another branch; the motion stays on its poses."""
    arm = aa.Arm.from_catalogue("franka_fr3")
    q = np.array([-0.937, -0.727, 0.392, -2.388, -1.564, 2.566, -0.122])
    poses = np.repeat(arm.forward(q)[0][None], 30, axis=0)
    poses[:, :3, 3] += np.linspace(0.0, 1.0, 30)[:, None] * [-0.048, -0.004, 0.01]
    path = aa.follow(arm, poses, start=q, policy=aa.Hold())
    changed = np.flatnonzero(np.diff(path.gc))
    assert path.ok and len(changed)
    passed(path)


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", ARMS)
def test_theta_2_and_theta_6_at_0_are_passed_as_any_place(name: str) -> None:
    """Motions through theta_2 = 0 or theta_6 = 0, by rows and by `follow`, stay on their poses
    between rows.
    """
    arm = named(name).with_(lower=np.full(7, -4.0), upper=np.full(7, 4.0))
    for joint in (2, 6):
        middle = np.array(READY[name.split()[-1]])
        middle[joint - 1] = -arm.geometry.signs[joint - 1] * arm.geometry.offsets[joint - 1]
        way = np.array([0.05, 0.03, -0.06, 0.04, 0.05, 0.04, -0.05])
        way[joint - 1] = 0.2
        q = middle + np.linspace(-0.48, 0.52, 20)[:, None] * way
        rows = aa.JointPath.from_joints(arm, q, between="tool")
        assert len(set(rows.gc.tolist())) == 2 or joint == (2 if arm.geometry.a_1 else 6)
        passed(rows)
        followed = aa.follow(arm, arm.forward(q)[0], start=q[0], policy=aa.Hold())
        assert followed.ok
        passed(followed)


def passed(path: aa.JointPath) -> None:
    """Check that a motion is on its poses between rows, leaps nowhere, and that derivatives and `retime`
    hold.
    """
    s = np.linspace(0.0, 1.0, 701)
    between, arm = path.at(s), path.arm
    np.testing.assert_allclose(arm.forward(between.q)[0], between.pose, rtol=0, atol=1e-12)
    np.testing.assert_allclose(path.at(path.s).q, path.q, rtol=0, atol=1e-9)
    assert np.abs(np.diff(between.q, axis=0)).max() < np.abs(np.diff(path.q, axis=0)).max()
    h = 1e-6
    inner = (path.s[:-1] + 0.4 * np.diff(path.s))[:, None].ravel()
    slope = (path.at(inner + h).q - path.at(inner - h).q) / (2 * h)
    np.testing.assert_allclose(path.derivatives(inner)[:, 0], slope, rtol=1e-4, atol=1e-6)
    motion = aa.retime(path, acceleration=4.0)
    assert np.abs(motion.qdd).max() <= 4.0 * 1.002
    assert motion.duration < (2 * np.sqrt(np.abs(np.diff(path.q, axis=0)).max(axis=1) / 4.0)).sum()
