"""The nearest pose within reach, and poses in float32 that rounding puts out of it."""

from __future__ import annotations

import copy
import pickle
import re

import numpy as np
import pytest
from support.strategies import Array

import armangle as aa

EPS = float(np.finfo(np.float32).eps)
NAMES = ("kuka_iiwa7_r800", "openarm_v10", "barrett_wam7")


def placed(name: str) -> aa.Arm:
    """An arm of the catalogue on a slanted base, with a tool of its own."""
    arm = aa.Arm.from_catalogue(name)
    base = aa.pose([0.4, -0.3, 0.2], rpy=[0.3, -0.5, 1.0])
    return arm.with_(base=base).with_tool(aa.pose([0.02, 0.03, 0.1], rotvec=[0.4, 0.1, -0.2]))


def unequal() -> aa.Arm:
    """An arm with links so different that there is an inner reach."""
    return aa.Arm(d_bs=0.3, d_se=0.5, d_ew=0.3, d_wf=0.1, base=aa.pose([1, 2, 3], rpy=[1, 2, 3]))


def size(arm: aa.Arm) -> float:
    """The sum of all lengths of an arm, m."""
    ends = np.linalg.norm(arm.base[:3, 3]) + np.linalg.norm(arm.tool[:3, 3])
    return float(arm.geometry.reach + abs(arm.geometry.d_bs) + abs(arm.geometry.d_wf) + ends)


def wrist(arm: aa.Arm, pose: Array) -> Array:
    """The vector (3,) from shoulder to wrist, m, in the frame of the base."""
    flange = np.linalg.inv(arm.base) @ pose @ np.linalg.inv(arm.tool)
    return flange[:3, 3] - arm.geometry.d_wf * flange[:3, 2] - np.array([0, 0, arm.geometry.d_bs])


@pytest.mark.parametrize("arm", [*map(placed, NAMES), unequal()], ids=lambda arm: arm.name or "unequal")
def test_no_pose_of_that_orientation_within_reach_is_nearer(arm: aa.Arm) -> None:
    """`explain` gives the nearest pose of the same orientation within reach and its distance."""
    rng = np.random.default_rng(1)
    beyond = 0
    for pose in arm.forward(rng.uniform(-3, 3, (60, 7)))[0]:
        pose[:3, 3] += rng.normal(size=3) * rng.choice([0.05, 0.5, 2.0])
        found = arm.explain(pose)
        assert found.nearest is not None
        distance = np.linalg.norm(wrist(arm, pose))
        excess = max(distance - arm.geometry.reach, arm.geometry.inner_reach - distance, 0.0)
        assert abs(found.nearest_gap - excess) <= 1e-13 * size(arm)
        moved = np.linalg.norm(found.nearest[:3, 3] - pose[:3, 3])
        assert abs(moved - found.nearest_gap) <= 1e-13 * size(arm)
        assert (found.nearest[:3, :3] == pose[:3, :3]).all()
        arm.inverse(found.nearest, 0.3, 2, limits=False)  # within reach: raises if it were not
        if found.nearest_gap == 0:
            assert (found.nearest == pose).all()
            continue
        beyond += 1
        tries = found.nearest_gap * 0.999 * rng.normal(size=(200, 3))
        tries *= np.minimum(1, 0.999 * found.nearest_gap / np.linalg.norm(tries, axis=1, keepdims=True))
        near = np.repeat(pose[None], 200, axis=0)
        near[:, :3, 3] += tries
        assert np.isnan(arm.inverse(near, 0.3, 2, on_error="nan", limits=False)).all()
    assert beyond >= 10


def test_a_wrist_on_the_shoulder_goes_out_to_the_inner_reach() -> None:
    """With the wrist on the shoulder the nearest pose within reach is at the inner reach."""
    arm = unequal()
    flange = np.eye(4)
    flange[2, 3] = arm.geometry.d_bs + arm.geometry.d_wf
    found = arm.explain(arm.base @ flange)
    assert found.nearest_gap == pytest.approx(arm.geometry.inner_reach, abs=1e-14)
    assert found.nearest is not None
    assert np.linalg.norm(wrist(arm, found.nearest)) == pytest.approx(arm.geometry.inner_reach, abs=1e-12)


def test_the_explanation_says_where_and_copies_keep_it() -> None:
    """`explain` out of reach names the nearest pose; copies and pickles keep it; a plan's has none."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    far = aa.pose([2.0, 0.0, 0.34], rpy=[0, np.pi / 2, 0])
    found = arm.explain(far)
    line = (
        "The nearest pose within reach, in the same orientation, is 1074 mm away: x, y, z = 0.926, 0, 0.34 m."
    )
    assert found.explain().endswith(line)
    assert "nearest pose" not in arm.explain(arm.forward(np.zeros(7))[0]).explain()
    for again in (copy.deepcopy(found), pickle.loads(pickle.dumps(found))):
        assert again.explain() == found.explain()
        assert (again.nearest == found.nearest).all()
        with pytest.raises(ValueError, match="read-only"):
            again.nearest[0, 0] = 1
    path = aa.plan(arm, np.stack([far, far])).diagnosis
    assert path is not None
    assert path.nearest is None


# -- float32 -----------------------------------------------------------------------------------------


def rounded(arm: aa.Arm, count: int) -> tuple[Array, Array, Array]:
    """At most `count` random float32 poses with psi and gc, a quarter of them stretched, a quarter folded."""
    rng = np.random.default_rng(7)
    q = rng.uniform(-3, 3, (count, 7))
    at = np.arange(count) % 4
    theta = np.where(
        at == 1,
        arm.geometry.delta,
        np.where(
            at == 2, arm.geometry.delta + np.pi, arm.geometry.signs[3] * q[:, 3] + arm.geometry.offsets[3]
        ),
    )
    q[:, 3] = arm.geometry.signs[3] * (theta - arm.geometry.offsets[3])
    pose, psi, gc = arm.forward(q, on_error="nan")
    some = np.isfinite(psi)
    return pose[some].astype(np.float32), psi[some], gc[some]


def test_a_hundred_thousand_float32_poses_are_solved_to_their_own_rounding() -> None:
    """`inverse` solves float32 poses that rounding puts out of reach, to 3 units of float32."""
    arms = [placed(NAMES[0]), aa.Arm.from_catalogue(NAMES[0]), placed(NAMES[2]), unequal()]
    for arm in arms:
        poses, psi, gc = rounded(arm, 25_000)
        plain = arm.inverse(poses.astype(np.float64), psi, gc, on_error="nan", limits=False)
        assert np.isnan(plain).any()  # else nothing is tested here
        q = arm.inverse(poses, psi, gc, limits=False)
        assert np.isfinite(q).all()
        back = arm.forward(q, on_error="nan")[0]
        off = np.linalg.norm(back[:, :3, 3] - poses[:, :3, 3], axis=1)
        assert off.max() <= 3 * EPS * size(arm)
        assert np.abs(back[:, :3, :3] - poses[:, :3, :3]).max() <= 3 * EPS
        one = arm.inverse(poses[17], psi[17], gc[17], limits=False)
        assert np.array_equal(one, q[17])  # one alone is one of many


def test_one_float32_pose_is_read_as_it_comes_and_is_one_of_many() -> None:
    """A single float32 pose goes to the core as it is, and gives the row of its batch."""
    arm = placed(NAMES[0])
    poses, psi, gc = rounded(arm, 200)
    near = np.zeros(7)
    arcs, found = arm.feasible(poses, gc), arm.solve(poses, near)
    for i, pose in enumerate(poses):
        assert arm._handle.inverse_few(pose, float(psi[i]), int(gc[i])) is not None
        assert np.array_equal(arm.feasible(pose, gc[i]).intervals, arcs[i].intervals)
        one, row = arm.solve(pose, near), found.row(i)
        for mine, theirs in zip(one, row, strict=True):
            assert np.array_equal(mine, theirs, equal_nan=True)


def test_every_function_takes_a_float32_pose_at_its_reach() -> None:
    """All functions take a float32 pose that rounding puts out of reach, and refuse a skewed one."""
    arm = aa.Arm.from_catalogue(NAMES[0]).with_(lower=np.full(7, -6.0), upper=np.full(7, 6.0))
    poses, psi, gc = rounded(arm, 4000)
    out = np.isnan(arm.inverse(poses.astype(np.float64), psi, gc, on_error="nan", limits=False)).any(axis=1)
    pose, angle, branch = poses[out][0], float(psi[out][0]), int(gc[out][0])
    q = arm.inverse(pose, angle, branch, limits=False)
    assert np.isfinite(arm.inverse(pose, angle, limits=False)).all()
    assert arm.self_motion(pose, angle, branch).shape == (7,)
    for arcs in (arm.feasible(pose, branch), arm.feasible(pose), arm.feasible(pose, branch, per_joint=True)):
        assert (np.asarray(arcs.status) != aa.Status.UNREACHABLE).all()
    assert np.isfinite(aa.gradients.joint_function(arm, pose, branch, 1).value(0.2))
    assert aa.step(arm, q, pose).status is aa.Status.OK
    assert aa.resolve(arm, pose, angle, branch).status is aa.Status.OK
    assert aa.follow(arm, pose[None], start=q).ok
    assert aa.plan(arm, pose[None]).ok
    assert arm.explain(pose).ok
    assert pose.dtype == np.float32  # as it came
    skew = pose.copy()
    skew[0, 0] += 1e-3
    with pytest.raises(aa.InputError, match="not orthonormal"):
        arm.inverse(skew, angle, branch, limits=False)


def test_what_is_farther_than_rounding_is_out_of_reach_in_float32_too() -> None:
    """A float32 pose 0.1 mm out of reach is UNREACHABLE."""
    arm = aa.Arm.from_catalogue(NAMES[0])
    far = aa.pose(
        [arm.geometry.reach + arm.geometry.d_wf + 1e-4, 0, arm.geometry.d_bs], rpy=[0, np.pi / 2, 0]
    )
    with pytest.raises(aa.UnreachableError, match=re.escape("pose is out of reach by 0.1")):
        arm.inverse(far.astype(np.float32), 0.0, 0, limits=False)
    assert aa.step(arm, np.zeros(7), far.astype(np.float32)).status is aa.Status.UNREACHABLE


def on_elbow_limits(arm: aa.Arm, count: int, beyond: float = 0.0) -> tuple[Array, Array]:
    """Random joints within the limits but joint 4, on a limit or `beyond` it (rad), and their poses in
    float32.
    """
    rng = np.random.default_rng(8)
    low, high = np.maximum(arm.lower, -2.5), np.minimum(arm.upper, 2.5)
    q = rng.uniform(0.9 * low + 0.1 * high, 0.1 * low + 0.9 * high, (count, 7))
    q[:, 3] = rng.choice([arm.lower[3] - beyond, arm.upper[3] + beyond], count)
    return q, arm.forward(q)[0].astype(np.float32)


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "rainbow_rby1_left", "rokae_ar5_left"])
def test_a_float32_pose_keeps_joint_4_on_its_limit(name: str) -> None:
    """`solve` finds joint 4 on its limit for float32 poses, which rounding puts beyond."""
    arm = aa.Arm.from_catalogue(name)
    q, poses = on_elbow_limits(arm, 60)
    found = arm.solve(poses, seed=q)
    assert found.ok.all() and arm.reachable(poses).all()
    assert found.distance.max() <= 1e-3 and arm.within_limits(found.q).all()
    assert np.abs(arm.forward(found.q)[0] - poses).max() <= 3 * EPS * max(size(arm), 1.0)


def test_what_is_farther_beyond_joint_4_than_rounding_has_no_posture_in_float32_too() -> None:
    """A float32 pose with joint 4 1e-5 rad beyond its limit is not reachable."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    assert not arm.reachable(on_elbow_limits(arm, 60, beyond=1e-5)[1]).any()


def test_a_float32_pose_beside_straight_is_not_made_straight_for_a_limit_there() -> None:
    """`solve` of a float32 pose keeps joint 4 at 1e-3 rad, though its limit is 0."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    arm = arm.with_(lower=[*arm.lower[:3], 0.0, *arm.lower[4:]])
    q = np.array([0.1, 0.4, 0.2, 1e-3, 0.3, 0.8, 0.5])
    found = arm.solve(arm.forward(q)[0].astype(np.float32), seed=q)
    assert 5e-4 < found.q[3] < 2e-3
