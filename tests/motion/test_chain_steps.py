"""Steps of nearly S-R-S arms: the true pose is met, within the true limits, and nothing jumps."""

from __future__ import annotations

import numpy as np
import pytest
from support.calibrated import ARMS, NAMES, calibrated, postures
from support.draw import generator
from support.laws import POSE, circle_gap, gap
from support.moves import moved

import armangle as aa
from armangle.arm.chain import edge_of_reach

EVERY = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
POLICIES = (aa.Repulsion(), aa.Hold(), aa.Centre(0.2), aa.Towards(psi=0.5, K=0.3))


def nudged(pose: np.ndarray, rng: np.random.Generator, size: float = 1e-3) -> np.ndarray:
    """A pose moved by a random translation and rotation of about `size` (m, rad)."""
    return aa.pose(size * rng.normal(size=3)) @ pose @ aa.pose([0, 0, 0], rotvec=size * rng.normal(size=3))


def test_a_path_that_leaves_the_reach_says_so_where_branches_meet_first() -> None:
    """`follow` of a calibrated arm out of reach ends with NEAR_SINGULAR, and `explain` names the edge of
    reach.
    """
    arm = calibrated("kuka_iiwa7_r800", 0.1, 0.1)
    q = np.array([0.1, 0.4, 0.2, -0.4, 0.3, 0.8, 0.5])
    start = arm.forward(q)[0]
    out = arm.frames(q)[5, :3, 3] - arm.frames(q)[1, :3, 3]
    end = moved(start, 0.1 * out / np.linalg.norm(out))
    motion = aa.follow(arm, aa.Line(start, end), start=q, samples=3000)
    at = motion.first_failure
    assert motion.status[at] == aa.Status.NEAR_SINGULAR
    assert "It is at the edge of reach" in motion.explain()
    beyond = edge_of_reach(arm, end)
    assert "the edge of reach, or beyond: of the S-R-S arm beside the chain the pose is out of" in beyond
    assert edge_of_reach(arm, start) == edge_of_reach(arm.deviation.nominal, end) == ""


@pytest.mark.parametrize("name", NAMES)
def test_without_deviation_it_is_the_exact_step(name: str) -> None:
    """With a chain that deviates by nothing, `step` gives the joints and psi of the plain arm."""
    arm = aa.Arm.from_catalogue(name)
    near = calibrated(name, 0.0, 0.0)
    rng = generator(45)
    compared = 0
    for i, q in enumerate(postures(arm, 12, 46)):
        pose, _, gc = arm.forward(q)
        pose = nudged(pose, rng)
        if near.feasible(pose, gc).unproven > 0.0:
            continue
        policy = POLICIES[i % 4]
        exact, kept = aa.step(arm, q, pose, policy=policy), aa.step(near, q, pose, policy=policy)
        if exact.status != aa.Status.OK or np.abs(exact.q - q).max() > 0.19:
            continue
        assert kept.status == exact.status
        assert gap(kept.q, exact.q) <= 1e-7 and circle_gap(kept.psi, exact.psi) <= 1e-7
        compared += 1
    assert compared >= 6


def crossing(arm: aa.Arm, joint: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Two joint configurations well within the limits on both sides of `joint` = singular, at most 0.15 rad
    apart.
    """
    q = arm.lower + (arm.upper - arm.lower) * rng.uniform(0.2, 0.8, 7)
    zero = arm.geometry.delta if joint == 3 else 0.0
    q[joint] = arm.geometry.signs[joint] * (zero - arm.geometry.offsets[joint])
    off = rng.choice([0.05, 0.02, 0.01, 0.003])
    move = rng.normal(size=7) * rng.choice([0.02, 0.01, 0.003])
    move[joint] = 0.0
    ahead, behind = q.copy(), q + np.clip(move, -0.1, 0.1)
    ahead[joint] += off
    behind[joint] -= off * rng.uniform(0.2, 1.0)
    return ahead, behind


@pytest.mark.turns(2)
@pytest.mark.parametrize("joint", [1, 3, 5], ids=["shoulder", "elbow", "wrist"])
@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "barrett_wam7"])
def test_a_step_goes_through_where_branches_meet(name: str, joint: int) -> None:
    """A calibrated arm steps across singularities, at most 2 of 120 refused, often into another branch."""
    arm, rng, lost, elsewhere = calibrated(name, 1.0, 1.0), generator(45, joint), 0, 0
    tries = 120
    for k in range(tries):
        q, there = crossing(arm, joint, rng)
        pose = arm.forward(there, on_error="nan")[0]
        now = aa.step(arm, q, pose, policy=POLICIES[k % 3])
        if now.status != aa.Status.OK:
            lost += 1
            assert now.q.tolist() == q.tolist()
            continue
        assert gap(arm.forward(now.q, on_error="nan")[0], pose) <= POSE
        assert arm.limit_margin(now.q) >= -1e-9 and np.abs(now.q - q).max() <= 0.2
        own = aa.step(arm, q, pose, gc=int(arm.forward(q, on_error="nan")[2]))
        elsewhere += int(own.status != aa.Status.OK)
    assert lost <= 2, f"{lost} of {tries} refused"
    assert elsewhere > 3  # its own branch alone would not do


def test_a_home_posture_is_left_and_come_back_to() -> None:
    """`follow` of a calibrated arm leaves and regains [0, 0, 0, -90, 0, 90, 0] degrees, where theta_2
    is 0.
    """
    arm = calibrated("kuka_iiwa7_r800", 0.5, 0.5)
    home = np.radians([0.0, 0.0, 0.0, -90.0, 0.0, 90.0, 0.0])
    first = arm.forward(home, on_error="nan")[0]
    for direction in np.vstack([np.eye(3), -np.eye(3)]):
        s = 0.1 * np.sin(np.linspace(0.0, np.pi, 200))
        poses = np.repeat(first[None], 200, axis=0)
        poses[:, :3, 3] += s[:, None] * direction
        path = aa.follow(arm, poses, start=home, policy=aa.Hold())
        assert path.ok, (direction, path.explain())
        assert gap(arm.forward(path.q, on_error="nan")[0], poses) <= POSE


@pytest.mark.parametrize("joint", [1, 5])
def test_bounds_are_kept_where_a_step_goes_through(joint: int) -> None:
    """Bounded steps of a calibrated arm across a singularity keep the bounds, and 19 of 20 arrive."""
    arm, rng = calibrated("kuka_iiwa7_r800", 1.0, 1.0), generator(46, joint)
    arrived = partly = 0
    for _ in range(20):
        q, there = crossing(arm, joint, rng)
        pose, speed = arm.forward(there, on_error="nan")[0], np.zeros(7)
        for _ in range(60):
            now = aa.step(
                arm, q, pose, policy=aa.Hold(), velocity=3.0, acceleration=20.0, dt=0.01, velocity_now=speed
            )
            before, q, speed = speed, now.q, now.velocity
            assert np.abs(speed).max() <= 3.0 * (1 + 1e-9)
            assert np.abs(speed - before).max() <= 20.0 * 0.01 * (1 + 1e-9)
            partly += int(now.status == aa.Status.PARTIAL)
        arrived += int(gap(arm.forward(q, on_error="nan")[0], pose) <= POSE)
    assert arrived >= 19 and partly > 20, (arrived, partly)


def test_a_bounded_step_goes_to_another_arm_angle_where_that_of_the_policy_is_round_a_turn() -> None:
    """Bounded steps of a calibrated arm arrive also if at the policy's psi a joint is a full turn away."""
    arm = calibrated("kuka_iiwa14_r820", 0.4, 0.2)
    rng, done = np.random.default_rng(3), 0
    for _ in range(40):
        q = rng.uniform(arm.lower * 0.8, arm.upper * 0.8)
        goal = np.clip(q + rng.uniform(-1, 1, 7) * 1.5, arm.lower * 0.95, arm.upper * 0.95)
        if arm.forward(goal)[2] != arm.forward(q)[2]:
            continue
        pose = arm.forward(goal)[0]
        for _ in range(800):
            now = aa.step(arm, q, pose, dt=0.02, velocity=2.0)
            q = now.q
            if now.status != aa.Status.PARTIAL:
                break
        assert now.status == aa.Status.OK, (now.status, now.why)
        done += 1
    assert done > 10
