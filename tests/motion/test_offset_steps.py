"""Steps of an arm with an offset wrist or shoulder: continuous, on the pose, within limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import armangle as aa

FR3 = aa.Arm.from_catalogue("franka_fr3")
XARM = aa.Arm.from_catalogue("ufactory_xarm7")
MIRRORED = aa.Arm(
    a_1=0.117, d_bs=0.3, d_se=0.35, d_ew=0.32, d_wf=0.15, a_3=0.03, a_4=-0.02, signs=[1, -1, 1, 1, -1, 1, 1],
    offsets=[0.3] * 7, lower=[-2.6] * 7, upper=[2.6] * 7, tool=aa.pose([0.0, 0.1, 0.2], rpy=[0.3, -0.2, 0.1]),
    name="shoulder",
)  # fmt: skip
ARMS = [FR3, XARM, MIRRORED]
READY = np.array([0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4])
STEP = 0.2


def motion(arm: aa.Arm, rng: np.random.Generator, count: int, share: float = 1.0) -> tuple[Any, Any]:
    """Return `count` poses of a smooth motion within the limits, and its joints; `share` scales it."""
    middle, half = 0.5 * (arm.lower + arm.upper), 0.45 * np.minimum(arm.upper - arm.lower, 4.0)
    phase, rate = rng.uniform(-np.pi, np.pi, 7), rng.uniform(0.5, 1.5, 7)
    s = np.linspace(0.0, 2.0, count)[:, None]
    q = middle + share * half * np.sin(rate * s + phase)
    return arm.forward(q)[0], q


def holds(arm: aa.Arm, path: aa.JointPath) -> None:
    """Check that each row that is OK holds its pose within the limits; if all are, also the size of each
    step.
    """
    ok = path.status == aa.Status.OK
    pose = arm.forward(path.q[ok])[0]
    np.testing.assert_allclose(pose, path.poses[ok], rtol=0, atol=1e-9)
    assert (arm.limit_margin(path.q[ok]) >= -1e-9).all()
    assert path.residual[ok].max(initial=0) < 1e-9
    steps = np.diff(np.vstack([path.start, path.q[ok]]), axis=0) if ok.all() else np.zeros((1, 7))
    assert np.abs(steps).max() <= STEP + 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
@pytest.mark.parametrize(
    "policy", [aa.Hold(), aa.Repulsion(), aa.Centre(K=0.2)], ids=lambda p: type(p).__name__
)
def test_a_motion_is_followed_until_no_posture_is_one_step_away(arm: aa.Arm, policy: Any) -> None:
    """`follow` holds its poses, and where it ends no joints on a dense grid are within one step."""
    done, count = 0, 60
    grid = np.linspace(-np.pi, np.pi, 1001)
    for seed in range(8):
        poses, q = motion(arm, np.random.default_rng(seed), count)
        path = aa.follow(arm, poses, start=q[0], policy=policy)
        holds(arm, path)
        done += int((path.status == aa.Status.OK).sum())
        free = arm.forward(path.q[path.status == aa.Status.OK])[1]
        turns = (path.psi[path.status == aa.Status.OK] - free) / (2 * np.pi)
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)
        k = path.first_failure
        if k is None:
            continue
        before = path.q[k - 1] if k else q[0]
        beside = arm.inverse(poses[k], grid, np.arange(8)[:, None], seed=before, on_error="nan")
        assert not (np.abs(beside - before).max(axis=-1) <= STEP - 1e-3).any()
    assert done >= 0.4 * 8 * count


def test_holding_the_free_joint_holds_it_to_the_bit_where_it_may() -> None:
    """`step` with Hold keeps joint 7 of a Franka to the bit."""
    pose = FR3.forward(READY)[0].copy()
    pose[:3, 3] += [0.0005, -0.0003, 0.0004]
    now = aa.step(FR3, READY, pose, policy=aa.Hold())
    assert now.status is aa.Status.OK
    assert now.psi == READY[6] and now.gc == FR3.forward(READY)[2]


def test_a_home_posture_with_joints_1_and_3_on_one_axis_steps_on() -> None:
    """`step` of a Franka with q_2 = 0 holds its own pose; steps to poses beside it are exact if OK."""
    q = READY.copy()
    q[1] = 0.0
    pose = FR3.forward(q)[0]
    still = aa.step(FR3, q, pose)
    assert still.status is aa.Status.OK
    np.testing.assert_allclose(FR3.forward(still.q)[0], pose, atol=1e-9)
    assert np.abs(still.q - q).max() <= STEP
    for axis in range(3):
        beside = pose.copy()
        beside[axis, 3] += 0.001
        now = aa.step(FR3, q, beside)
        if now.status is aa.Status.OK:
            np.testing.assert_allclose(FR3.forward(now.q)[0], beside, atol=1e-9)
            assert np.abs(now.q - q).max() <= STEP


def test_a_fold_is_passed_through() -> None:
    """`follow` takes a Franka through theta_5 = 90 degrees, where its branch ends and joint 7 turns back."""
    q = np.array([0.1, 0.3, 0.2, -1.9, 1.2, 2.0, 0.4])
    end = q + np.array([0.0, 0.0, 0.0, 0.0, 0.7, 0.0, 0.0])
    s = np.linspace(0, 1, 80)[:, None]
    poses, _, gc = FR3.forward(q + s * (end - q))
    assert len(set(gc.tolist())) == 2
    for policy in (aa.Hold(), aa.Repulsion()):
        path = aa.follow(FR3, poses, start=q, policy=policy)
        holds(FR3, path)
        assert path.ok, path.explain()


def test_what_is_allowed_binds() -> None:
    """`step(allowed=)` uses only allowed values of the free joint, or is NOT_ALLOWED."""
    pose, free, gc = FR3.forward(READY)
    arcs = FR3.feasible(pose, gc)
    shut = aa.ArcSet([[free + 0.5, free + 0.6]])
    now = aa.step(FR3, READY, pose, allowed=shut)
    assert now.status is aa.Status.NOT_ALLOWED
    near = aa.ArcSet([[free - 0.05, free - 0.02]])
    now = aa.step(FR3, READY, pose, allowed=near, policy=aa.Hold())
    assert now.status is aa.Status.OK and now.psi in near and now.psi in arcs


def test_why_there_is_no_step() -> None:
    """`step` and `follow` name the reason: out of reach, a joint jump, limits."""
    far = aa.pose([3.0, 0, 0])
    now = aa.step(FR3, READY, far)
    assert now.status is aa.Status.UNREACHABLE and now.why is aa.Status.UNREACHABLE
    np.testing.assert_array_equal(now.q, READY)
    turned = FR3.forward(READY)[0] @ aa.pose([0, 0, 0], rpy=[0, 0, 2.0])
    assert aa.step(FR3, READY, turned).status in (aa.Status.JOINT_JUMP, aa.Status.LIMITS)
    assert aa.step(FR3, READY, FR3.forward(READY)[0], policy=aa.Hold(outside="stop")).status is aa.Status.OK
    path = aa.follow(FR3, np.stack([FR3.forward(READY)[0], far]), start=READY)
    assert not path.ok and "out of reach" in path.explain()
    assert aa.follow(FR3, np.empty((0, 4, 4)), start=READY).q.shape == (0, 7)


def test_a_wish_for_the_free_joint_is_met() -> None:
    """Steps with Towards(psi) bring joint 7 of a Franka to its wish while the tool stands."""
    pose, free, _ = FR3.forward(READY)
    q = READY
    for _ in range(60):
        now = aa.step(FR3, q, pose, policy=aa.Towards(psi=float(free) - 0.4, K=0.3))
        assert now.status is aa.Status.OK
        np.testing.assert_allclose(FR3.forward(now.q)[0], pose, atol=1e-9)
        q = now.q
    assert abs(q[6] - (READY[6] - 0.4)) < 1e-6
