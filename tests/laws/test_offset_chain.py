"""Laws of arms on their own chain with an offset nominal arm: a calibrated Franka, a calibrated Fetch.

The reference is the chain walked link by link, and a dense grid of the free joint.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.calibrated import calibrated_offset, plain_forward

import armangle as aa

ARMS = [
    calibrated_offset("franka_fr3", 1.0, 1.0),
    calibrated_offset("franka_fr3", 20.0, 10.0),
    calibrated_offset("fetch", 1.0, 1.0),
]
IDS = ["franka, 1 mm", "franka, 20 mm", "fetch, 1 mm"]


def joints(arm: aa.Arm, count: int, seed: int) -> Any:
    """Return random joints (count, 7) within the limits, of joints without limits within ±π."""
    rng = np.random.default_rng(seed)
    return rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (count, 7))


def meets(arm: aa.Arm, q: Any, pose: Any) -> None:
    """Check that joints (n, 7) hold poses (n, 4, 4) by the chain, multiplied link by link."""
    reached = np.array([plain_forward(arm, row) for row in q])
    np.testing.assert_allclose(reached, pose, rtol=0, atol=4e-12)


@pytest.mark.parametrize("arm", ARMS, ids=IDS)
def test_forward_is_the_chain_walked_link_by_link(arm: aa.Arm) -> None:
    """`forward`, `frames` and `jacobian` are those of the links multiplied in order, psi is the free
    joint.
    """
    q = joints(arm, 200, 1)
    pose, psi, gc = arm.forward(q)
    np.testing.assert_allclose(pose, [plain_forward(arm, row) for row in q], rtol=0, atol=1e-14)
    free = q[:, int(arm.redundancy[-1]) - 1]
    np.testing.assert_array_equal(psi, free)
    np.testing.assert_array_equal(gc, arm.deviation.nominal.forward(q)[2])
    np.testing.assert_allclose(arm.frames(q)[:, 7] @ arm.tool, pose, rtol=0, atol=1e-14)


@pytest.mark.parametrize("arm", ARMS, ids=IDS)
def test_inverse_gives_the_joints_back_and_holds_the_pose(arm: aa.Arm) -> None:
    """`inverse` of `forward` is NaN in under 1 %, else holds the pose, mostly with the same joints."""
    q = joints(arm, 1000, 2)
    pose, psi, gc = arm.forward(q)
    back = arm.inverse(pose, psi, gc, seed=q, limits=False, on_error="nan")
    found = np.isfinite(back[:, 0])
    assert found.mean() > 0.99  # the others are next to where branches meet
    meets(arm, back[found], pose[found])
    np.testing.assert_array_equal(arm.forward(back[found])[2], gc[found])
    np.testing.assert_allclose(back[found][:, int(arm.redundancy[-1]) - 1], psi[found], rtol=0, atol=1e-15)
    assert (np.abs(back[found] - q[found]).max(axis=1) < 1e-6).mean() > 0.9


@pytest.mark.parametrize("arm", ARMS, ids=IDS)
def test_intervals_are_those_of_a_grid_but_for_what_is_unproven(arm: aa.Arm) -> None:
    """`feasible` agrees with the limits of `inverse` on a grid, but for `unproven`."""
    rng = np.random.default_rng(3)
    pose, _, _ = arm.forward(joints(arm, 6, 3))
    sets = arm.feasible(pose)
    assert sets.shape == (6, 8) and np.asarray(sets.measure).sum() > 0.5
    psi = rng.uniform(-np.pi, np.pi, 120)
    q = arm.inverse(pose[:, None, None], psi, np.arange(8)[:, None], on_error="nan", limits=False)
    held = np.minimum(q - arm.lower, arm.upper - q).min(axis=-1)  # NaN where no solution is found
    inside = np.moveaxis(np.array([sets.contains(np.full((6, 8), x)) for x in psi]), 0, -1)
    assert (held[inside] > -1e-9).all()  # false for NaN
    missing = (held > 1e-9) & ~inside
    allowed = np.asarray(sets.unproven)[..., None] / (2.0 * np.pi)
    assert (missing.mean(axis=-1, keepdims=True) <= allowed + 0.1).all()
    proven = np.broadcast_to(np.asarray(sets.unproven)[..., None] == 0.0, missing.shape)
    assert not (missing & proven).any()


@pytest.mark.turns(2)
@pytest.mark.parametrize("arm", ARMS, ids=IDS)
def test_solve_holds_the_pose_and_a_proven_answer_is_the_nearest_of_a_grid(arm: aa.Arm) -> None:
    """`solve` holds pose and limits, and if OK is as near as any value of a grid."""
    q = joints(arm, 30, 4)
    rng = np.random.default_rng(5)
    seed = np.clip(q + rng.normal(0.0, 0.2, q.shape), arm.lower, arm.upper)
    pose = arm.forward(q)[0]
    found = arm.solve(pose, seed)
    assert found.ok.mean() > 0.9
    meets(arm, found.q[found.ok], pose[found.ok])
    assert arm.within_limits(found.q[found.ok]).all()
    np.testing.assert_allclose(found.distance, np.linalg.norm(found.q - seed, axis=1), atol=1e-12)
    psi = np.linspace(-np.pi, np.pi, 150)
    every = arm.inverse(pose[:, None, None], psi, np.arange(8)[:, None], on_error="nan")
    grid = np.linalg.norm(every - seed[:, None, None], axis=-1)
    least = np.nanmin(np.where(np.isnan(grid), np.inf, grid), axis=(1, 2))
    proven = found.status == aa.Status.OK
    assert proven.any() or arm is ARMS[1]  # 20 mm leave a nearer one possible in every case
    assert (found.distance[proven] <= least[proven] + 1e-9).all()
    known = arm.solve(pose, q)
    np.testing.assert_allclose(known.q[known.ok], q[known.ok], rtol=0, atol=1e-6)


@pytest.mark.parametrize("arm", ARMS, ids=IDS)
def test_follow_keeps_to_the_poses_and_the_joints_do_not_jump(arm: aa.Arm) -> None:
    """`follow` along 2 cm holds poses and limits, in steps below 0.2 rad, like `step`."""
    done = 0
    for q in joints(arm, 10, 6):
        pose = arm.forward(q)[0]
        poses = np.repeat(pose[None], 40, axis=0)
        poses[:, :3, 3] += np.linspace(0.0, 0.02, 40)[:, None] * [0.6, -0.64, 0.48]
        path = aa.follow(arm, poses, start=q)
        good = path.status == aa.Status.OK
        meets(arm, path.q[good], poses[good])
        assert (np.abs(np.diff(path.q[good], axis=0)) < 0.2 + 1e-9).all()
        assert arm.within_limits(path.q[good]).all()
        if good[:2].all():
            np.testing.assert_array_equal(aa.step(arm, path.q[0], poses[1]).q, path.q[1])
        done += good.all()
    assert done >= 7  # the others come to a limit


@pytest.mark.parametrize("arm", ARMS, ids=IDS)
def test_a_copy_a_file_and_its_source_are_the_same_arm(arm: aa.Arm) -> None:
    """The URDF of such an arm keeps its chain."""
    assert arm.kind == f"{arm.deviation.nominal.kind}_chain" and arm.deviation.nominal.geometry.chain is None
    assert arm != arm.deviation.nominal
    q = joints(arm, 20, 7)
    pose = arm.forward(q)[0]
    again = aa.Arm.load(arm.to_urdf())
    assert again.kind == arm.kind and again.redundancy == arm.redundancy
    np.testing.assert_allclose(again.forward(q)[0], pose, rtol=0, atol=1e-12)
    assert again.report is not None and any("at the tip" in note for note in again.report.notes)


def test_a_chain_far_from_its_rows_is_rejected() -> None:
    """`with_(chain=)` refuses links too far from the nominal ones."""
    arm = ARMS[0]
    with pytest.raises(aa.InputError, match="from the nominal link"):
        arm.deviation.nominal.with_(chain=arm.with_tool(aa.pose([0.0, 0.0, 0.5])).geometry.chain)


@pytest.mark.parametrize("arm", ARMS, ids=IDS)
def test_no_posture_beside_the_best_has_a_larger_margin(arm: aa.Arm) -> None:
    """No value of the free joint next to that of `solve(prefer="margin")` has a larger margin."""
    pose = arm.forward(joints(arm, 40, 6))[0]
    found = arm.solve(pose, prefer="margin")
    pose, q, psi, gc, margin = (x[found.ok] for x in (pose, found.q, found.psi, found.gc, found.margin))
    slope = aa.gradients.inverse(arm, pose, psi, gc, on_error="nan")
    smooth = np.abs(slope).max(axis=(1, 2)) < 20.0
    assert smooth.sum() > 10
    for aside in (-1e-6, -3e-8, 3e-8, 1e-6):
        beside = arm.inverse(pose, psi + aside, gc, seed=q, limits=False, on_error="nan")[smooth]
        distance = np.minimum(beside - arm.lower, arm.upper - beside).min(axis=1)
        assert (distance <= margin[smooth] + 1e-12).all(), aside
