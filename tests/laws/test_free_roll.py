"""A free roll: no roll of a dense ladder has a nearer posture, and no step is refused for joint 7."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support import draw
from support.moves import limited
from support.planned_arms import random_arm

import armangle as aa

NAMES = ("openarm_v10", "human_arm_left", "kuka_iiwa7_r800")
OFFSET = ("franka_fr3", "fetch")


def rolled(poses: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Poses turned by `angle` (...), rad, about their own z axis."""
    turn = np.zeros((*np.shape(angle), 4, 4))
    turn[..., 0, 0] = turn[..., 1, 1] = np.cos(angle)
    turn[..., 1, 0] = np.sin(angle)
    turn[..., 0, 1] = -turn[..., 1, 0]
    turn[..., 2, 2] = turn[..., 3, 3] = 1.0
    return poses @ turn


def along_axis_7(arm: aa.Arm) -> aa.Arm:
    """The arm with a tool whose z axis is axis 7."""
    tool = np.eye(4)
    tool[2, 3] = 0.13
    return arm.with_(tool=tool)


def arms(rng: np.random.Generator) -> list[aa.Arm]:
    """Arms of the catalogue and random ones, all with a tool along axis 7."""
    own = [along_axis_7(aa.Arm.from_catalogue(name)) for name in (*OFFSET, *NAMES)]
    return [*own, *(along_axis_7(random_arm(rng)) for _ in range(4))]


def near_limits(arm: aa.Arm, rng: np.random.Generator, count: int) -> np.ndarray:
    """Random joints within the limits or up to 0.2 rad outside."""
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    return rng.uniform(lower - 0.2, upper + 0.2, (count, 7))


def same_but_for_roll(a: np.ndarray, b: np.ndarray) -> None:
    """Check that poses differ by rotations about their z axes only."""
    assert np.allclose(a[..., :3, 2:], b[..., :3, 2:], rtol=0, atol=1e-9)


@pytest.mark.turns(4)
@pytest.mark.parametrize("metric", ["l2", "max"])
@pytest.mark.parametrize("weight", [None, np.array([1.0, 2.0, 0.5, 1.0, 0.0, 3.0, 0.7])])
def test_no_roll_of_a_ladder_has_a_nearer_posture(metric: str, weight: np.ndarray | None) -> None:
    """`solve(roll="free")` is as near as any of 60 rolls, and states psi, gc, margin and distance rightly."""
    rng = draw.generator(16, 30, metric == "l2", weight is None)
    angles = np.arange(60) * (2 * np.pi / 60)
    found_some = lost_some = 0
    for arm in arms(rng):
        poses = arm.forward(near_limits(arm, rng, 12), on_error="nan")[0]
        near = np.clip(near_limits(arm, rng, 12), arm.lower, arm.upper)
        free = arm.solve(poses, seed=near, metric=metric, weight=weight, roll="free")
        ladder = arm.solve(rolled(poses[:, None], angles), seed=near[:, None], metric=metric, weight=weight)
        nearest = np.where(ladder.ok, ladder.distance, np.inf).min(axis=1)
        assert (np.where(free.ok, free.distance, np.inf) <= nearest + 1e-9).all()
        assert np.array_equal(free.ok, ~arm.feasible_turns(poses, about="tool").is_empty)
        held, psi, gc = arm.forward(free.q[free.ok])
        same_but_for_roll(held, poses[free.ok])
        assert np.array_equal(gc, free.gc[free.ok])
        assert np.allclose(np.exp(1j * (psi - free.psi[free.ok])), 1.0, rtol=0, atol=1e-9)
        assert arm.within_limits(free.q[free.ok], tol=1e-9).all()
        assert np.allclose(arm.limit_margin(free.q[free.ok]), free.margin[free.ok], atol=1e-9)
        apart = (free.q - near)[free.ok] * np.sqrt(1.0 if weight is None else weight)
        size = np.linalg.norm(apart, axis=1) if metric == "l2" else np.abs(apart).max(axis=1)
        assert np.allclose(free.distance[free.ok], size, atol=1e-9)
        # and the roll that it took is one that feasible_turns has
        assert arm.reachable(held).all()
        found_some, lost_some = found_some + int(free.ok.sum()), lost_some + int((~free.ok).sum())
    assert found_some > 40 and lost_some > 5


def test_the_best_margin_over_all_rolls() -> None:
    """`solve(roll="free")` without a seed has at least the margin of any of 48 rolls."""
    rng = draw.generator(16, 31)
    angles = np.arange(48) * (2 * np.pi / 48)
    for arm in arms(rng)[:4]:
        poses = arm.forward(near_limits(arm, rng, 8), on_error="nan")[0]
        free = arm.solve(poses, roll="free")
        ladder = arm.solve(rolled(poses[:, None], angles))
        most = np.where(ladder.ok, ladder.margin, -np.inf).max(axis=1)
        assert (np.where(free.ok, free.margin, -np.inf) >= most - 1e-9).all()


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", *OFFSET])
def test_one_pose_is_a_row_of_its_batch_and_another_axis_goes_by_a_ladder(name: str) -> None:
    """`solve(roll="free")` of one pose is a row of its batch, for a tool along axis 7 or not."""
    arm = aa.Arm.from_catalogue(name).with_(tool=aa.pose([0.1, 0.0, 0.1], rpy=[0.0, 0.7, 0.0]))
    rng = draw.generator(16, 32)
    q = np.clip(near_limits(arm, rng, 6), arm.lower, arm.upper)
    poses = arm.forward(q)[0]
    near = q + rng.uniform(-0.3, 0.3, q.shape)
    free, plain = arm.solve(poses, seed=near, roll="free"), arm.solve(poses, seed=near)
    assert free.ok.all() and (free.distance <= plain.distance + 1e-12).all()
    assert (free.distance < plain.distance - 1e-3).any()
    same_but_for_roll(arm.forward(free.q)[0], poses)
    for k in range(6):
        one = arm.solve(poses[k], seed=near[k], roll="free")
        assert isinstance(one.status, aa.Status) and np.array_equal(one.q, free.q[k])
    shared = arm.solve(poses[:3], seed=near[2], roll="free")  # one seed for all poses
    assert shared.q.shape == (3, 7) and np.array_equal(shared.q[2], free.q[2])
    straight = along_axis_7(arm)
    poses = straight.forward(q)[0]
    batch = straight.solve(poses, seed=near, roll="free")
    one = straight.solve(poses[2], seed=near[2], roll="free")
    assert np.array_equal(one.q, batch.q[2]) and isinstance(one.margin, float)
    far = straight.solve(aa.pose([9.0, 0.0, 0.0]), seed=near[0], roll="free")
    assert not far.ok and far.status is aa.Status.UNREACHABLE and np.isnan(far.q).all()


@pytest.mark.parametrize("name", (*NAMES, *OFFSET))
def test_joint_7_stays_along_a_path_and_is_never_why_a_step_is_refused(name: str) -> None:
    """`follow` and `step` with free roll keep joint 7 and z axis, and reach as many poses as with a fixed
    roll.
    """
    arm = along_axis_7(aa.Arm.from_catalogue(name))
    if np.isinf(arm.upper[6]):
        arm = limited(arm, 6, -3.0, 3.0)
    rng = draw.generator(16, 33, (*NAMES, *OFFSET).index(name))
    gained = 0
    for _ in range(12):
        start = rng.uniform(np.maximum(arm.lower, -2) * 0.8, np.minimum(arm.upper, 2) * 0.8)
        start[6] = 0.97 * min(arm.upper[6], 3.0)  # a little further, and the roll of the start is lost
        pose = arm.forward(start)[0]
        line = np.repeat(pose[None], 80, axis=0)
        line[:, :3, 3] += np.linspace(0, 1, 80)[:, None] * rng.uniform(-0.2, 0.2, 3)
        wild = rolled(line, rng.uniform(-np.pi, np.pi, 80))  # whatever roll the poses ask
        free = aa.follow(arm, wild, start=start, roll="free")
        done = np.asarray(free.status) == aa.Status.OK
        assert np.abs(free.q[done, 6] - start[6]).max(initial=0) == 0
        same_but_for_roll(free.poses[done], wild[done])
        assert np.allclose(arm.forward(free.q[done])[0], free.poses[done], atol=1e-12)
        assert arm.within_limits(free.q[done], tol=1e-9).all()
        assert np.allclose(arm.limit_margin(free.q[done]), free.margin[done], atol=1e-12)
        held = aa.follow(arm, line, start=start)  # the naive way: one roll for all poses
        assert done.sum() >= (np.asarray(held.status) == aa.Status.OK).sum()
        gained += int(done.sum() - (np.asarray(held.status) == aa.Status.OK).sum())
        q = start
        for k in np.flatnonzero(done):
            now = aa.step(arm, q, wild[k], roll="free")
            assert np.array_equal(now.q, free.q[k]) and now.margin == free.margin[k]
            q = now.q
        bound = aa.follow(
            arm, wild, start=start, roll="free", dt=0.05, velocity=2.0, acceleration=40.0, lookahead=4
        )
        fine = np.asarray(bound.status) == aa.Status.OK
        assert np.abs(bound.q[fine, 6] - start[6]).max(initial=0) == 0
        same_but_for_roll(bound.poses[fine], wild[fine])
    assert gained > (5 if name in OFFSET else 50)  # joint 7 ends fewer of their lines


@pytest.mark.parametrize("bounds", [{}, {"velocity": 1.5, "dt": 0.02}], ids=["free", "bounded"])
@pytest.mark.parametrize("name", (*NAMES, *OFFSET))
def test_joint_7_stays_on_the_way_to_the_nearest_pose_and_the_arm_rests(
    name: str, bounds: dict[str, Any]
) -> None:
    """Steps with free roll to a pose out of reach keep joint 7, and come to rest."""
    arm = along_axis_7(aa.Arm.from_catalogue(name))
    rng = draw.generator(16, 34, (*NAMES, *OFFSET).index(name))
    for _ in range(8):
        lower, upper = np.maximum(arm.lower, -2), np.minimum(arm.upper, 2)
        q = start = lower + (upper - lower) * rng.uniform(0.2, 0.8, 7)
        pose = rolled(arm.forward(q)[0], rng.uniform(-np.pi, np.pi))
        pose[:3, 3] += rng.uniform(0.3, 1.5) * np.array([0.6, -0.5, 0.6])
        for _ in range(800):
            now = aa.step(
                arm, q, pose, policy=aa.Hold(), roll="free", fallback="nearest_pose", **bounds,
            )  # fmt: skip
            assert now.q[6] == start[6] and arm.within_limits(now.q, tol=1e-9)
            went, q = np.abs(now.q - q).max(), now.q
            if went < 1e-12:
                break
        assert went < 1e-9


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "fetch"])
def test_through_theta_6_zero_no_joint_of_the_wrist_swings(name: str) -> None:
    """`follow` with free roll through theta_6 = 0 moves no joint by 0.02 rad a row."""
    arm = along_axis_7(aa.Arm.from_catalogue(name))
    q = np.array([0.2, 0.6, 0.1, -1.2, 0.7, 0.05, 0.4])
    turned = np.repeat(q[None], 60, axis=0)
    turned[:, 5] = np.linspace(0.05, -0.05, 60)
    path = aa.follow(arm, arm.forward(turned)[0], start=q, roll="free", policy=aa.Hold())
    assert path.ok and np.abs(np.diff(path.q, axis=0)).max() < 0.02


def test_what_a_free_roll_is_not_for() -> None:
    """roll="free" is refused with options that contradict it, and with shapes that would turn among
    obstacles.
    """
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    pose = arm.forward(q)[0]
    tilted = arm.with_(tool=aa.pose([0.1, 0.0, 0.1]))
    with pytest.raises(aa.InputError, match="a single step can only roll about axis 7"):
        aa.step(tilted, q, pose, roll="free")
    outside = np.append(q[:6], 5.0)
    with pytest.raises(aa.InputError, match="joint 7 of start stands outside its limits"):
        aa.follow(arm, pose[None], start=outside, roll="free")
    with pytest.raises(aa.InputError, match="does not go with fallback"):
        arm.solve(pose, seed=q, roll="free", fallback="nearest_pose")
    with pytest.raises(aa.InputError, match="wanted one of the others positive"):
        arm.solve(pose, seed=q, roll="free", weight=[0, 0, 0, 0, 0, 0, 1])
    wrist = along_axis_7(aa.Arm.from_catalogue("franka_fr3"))
    asked = (("policy", aa.Towards(psi=0.1)), ("allowed", aa.ArcSet([(0.0, 1.0)])))
    for option, value in asked:  # psi is joint 7
        for call in (aa.step, lambda arm, q, pose, **more: aa.follow(arm, pose[None], start=q, **more)):
            with pytest.raises(aa.InputError, match=f"joint 7 keeps its value, which is psi, and {option}"):
                call(wrist, q, wrist.forward(q)[0], roll="free", **{option: value})
    scene = aa.Scene([aa.Ball([0.0, 0.9, 0.5], 0.1)])
    bones = arm.with_(body=aa.Body.bones(upper_arm=0.05, forearm=0.05))
    flange = aa.Body({4: [aa.Ball([0, 0, 0.1], 0.05)], 7: [aa.Ball([0.1, 0, 0.0], 0.03, name="plug")]})
    for name, holding in (
        ("hand", bones.with_(hand=[aa.Ball([0.01, 0, 0.1], 0.05)])),
        ("plate", bones.with_(hand=[aa.Box(aa.pose([0, 0, 0.1]), [0.1, 0.1, 0.1], name="plate")])),
        ("plug", arm.with_(body=flange)),
    ):
        with pytest.raises(aa.InputError, match=f"{name}, which .* would turn with it: not with obstacles"):
            holding.with_(scene=scene).solve(pose, seed=q, roll="free")
        with pytest.raises(aa.InputError, match=f"{name}, which"):
            aa.follow(holding.with_(scene=scene), pose[None], start=q, roll="free")


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "franka_fr3"])
def test_a_hand_that_is_round_about_the_axis_keeps_clear_whatever_the_roll(name: str) -> None:
    """With a gripper round about axis 7 `solve`, `step` and `follow` with free roll keep clear."""
    arm = (
        along_axis_7(aa.Arm.from_catalogue(name))
        .with_(body=aa.Body({4: [aa.Capsule([0, 0, 0], [0, 0, 0.4], 0.06)], 7: [aa.Ball([0, 0, 0], 0.05)]}))
        .with_(hand=[aa.Capsule([0, 0, 0], [0, 0, 0.15], 0.03, name="drill")])
    )
    rng, seen, touched = np.random.default_rng(8), 0, 0
    for _ in range(40):
        q = 0.5 * (arm.lower + arm.upper) + 0.35 * (arm.upper - arm.lower) * rng.uniform(-1, 1, 7)
        pose = arm.forward(q)[0]
        beside = arm.elbow(q) + rng.normal(size=3) * 0.15
        scene = aa.Scene([aa.Ball(beside, 0.06, name="lamp")], clearance=0.01)
        found = arm.with_(scene=scene).solve(pose, seed=q, roll="free")
        if not found.ok:
            continue
        seen += 1
        touched += arm.clearance(q, scene).distance < 0.01
        assert arm.clearance(found.q, scene).distance >= 0.01 - 1e-9
        now = aa.step(arm.with_(scene=scene), found.q, pose, roll="free")
        path = aa.follow(arm.with_(scene=scene), pose[None], start=found.q, roll="free")
        for joints in ([now.q] if now.status == aa.Status.OK else []) + ([path.q[0]] if path.ok else []):
            assert arm.clearance(joints, scene).distance >= 0.01 - 1e-9
    assert seen > 20 and touched > 2
