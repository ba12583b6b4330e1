"""Steps of an arm with an offset wrist or shoulder: continuous, on the pose, within limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.families import MIRRORED, of

import armangle as aa

FR3 = aa.Arm.from_catalogue("franka_fr3")
ARMS = [FR3, aa.Arm.from_catalogue("ufactory_xarm7"), MIRRORED]
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
@of(ARMS)
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
