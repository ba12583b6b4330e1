"""Doors of arms with an offset beside the kinematics: copies, frames, files, what is not made for them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import armangle as aa
from armangle.models.catalogue import offset_catalogue

FR3 = aa.Arm.from_catalogue("franka_fr3")
Q = np.array([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])
# its offset is at the shoulder
MIRRORED = aa.Arm(
    a_1=0.117, d_bs=0.3, d_se=0.35, d_ew=0.32, d_wf=0.15, signs=[1, -1, 1, 1, -1, 1, 1], offsets=[0.3] * 7,
    lower=[-2.0] * 7, upper=[2.0] * 7, base=aa.pose([0.1, 0.2, 0.3], rpy=[0.1, 0.2, 0.3]),
    tool=aa.pose([0.0, 0.1, 0.2], rpy=[0.3, -0.2, 0.1]), name="shoulder",
)  # fmt: skip


def joints(arm: aa.Arm, count: int, seed: int = 0) -> Any:
    """Return random joints (count, 7) within the limits."""
    return np.random.default_rng(seed).uniform(arm.lower, arm.upper, (count, 7))


@pytest.mark.parametrize("arm", [FR3, MIRRORED], ids=lambda arm: arm.name)
def test_frames_lead_along_the_chain_to_the_pose(arm: aa.Arm) -> None:
    """`frames` of an arm with an offset wrist or shoulder end at the flange and hold the offset.

    Each joint turns the frames after it.
    """
    q = joints(arm, 50)
    frames = arm.frames(q)
    np.testing.assert_allclose(frames[:, 7] @ arm.tool, arm.forward(q)[0], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(arm.elbow(q), frames[:, 3, :3, 3])
    row, offset = (1, arm.geometry.a_1) if arm.geometry.a_1 else (6, arm.geometry.a_6)
    plain = arm._rows.frames(q)
    moved = frames[:, row:, :3, 3] - plain[:, row:, :3, 3]
    np.testing.assert_allclose(moved, offset * plain[:, row, None, :3, 0] + 0 * moved, rtol=0, atol=1e-14)
    for i in range(7):  # joint i + 1 turns frames i + 1 ... 7 about the z axis of frame i, and no other
        turned = arm.frames(q + 0.3 * np.eye(7)[i])
        np.testing.assert_allclose(turned[:, : i + 1], frames[:, : i + 1], rtol=0, atol=1e-14)
        held = np.linalg.inv(frames[:, i]) @ turned[:, i + 1]
        before = np.linalg.inv(frames[:, i]) @ frames[:, i + 1]
        np.testing.assert_allclose(held[:, 2, :], before[:, 2, :], rtol=0, atol=1e-13)


@pytest.mark.parametrize("arm", [FR3, MIRRORED], ids=lambda arm: arm.name)
def test_all_eight_rows_are_those_of_each_branch(arm: aa.Arm) -> None:
    """`inverse` without gc has the row of each branch, NaN if limits exclude it."""
    pose, free, gc = arm.forward(joints(arm, 40))
    rows = arm.inverse(pose, free, limits=False)
    one = arm.inverse(pose[:, None], free[:, None], np.arange(8), on_error="nan", limits=False)
    np.testing.assert_array_equal(rows, one)
    inside = arm.inverse(pose, free, on_error="nan")
    there = np.isfinite(inside[..., 0])
    assert there[np.arange(40), gc].all() and (arm.limit_margin(inside[there]) > -1e-9).all()
    dropped = np.isfinite(rows[..., 0]) & ~there
    assert dropped.any() and (arm.limit_margin(rows[dropped]) < 0).all()


def test_limits_are_enforced_as_asked() -> None:
    """`inverse` beyond limits raises LimitError, unless limits=False."""
    pose, free, gc = FR3.forward(Q)
    rows = FR3.inverse(pose, free, limits=False)
    outside = next(k for k in range(8) if np.isfinite(rows[k, 0]) and not FR3.within_limits(rows[k]))
    with pytest.raises(aa.LimitError, match="joint"):
        FR3.inverse(pose, free, outside)
    np.testing.assert_array_equal(FR3.inverse(pose, free, gc), FR3.inverse(pose, free, gc, limits=False))


def test_a_copy_with_changes_keeps_the_rest() -> None:
    """`with_` and `with_tool` of an offset arm change what is asked and keep the rest."""
    arm = FR3.with_(lower=FR3.lower + 0.1, acceleration=10.0, name="mine")
    assert arm.name == "mine" and arm.geometry.a_6 == FR3.geometry.a_6 and (arm.acceleration == 10.0).all()
    np.testing.assert_array_equal(arm.lower, FR3.lower + 0.1)
    np.testing.assert_array_equal(arm.velocity, FR3.velocity)
    assert repr(FR3) == "Arm.from_catalogue('franka_fr3')"
    assert "a_6 88, d_bs 333" in str(FR3) and "a_1 117" in str(MIRRORED)
    other = FR3.with_(a_1=0.1, a_6=0.0)
    assert other.redundancy == "joint_1" and other.forward(Q)[1] == Q[0]


@pytest.mark.parametrize("arm", [FR3, MIRRORED], ids=lambda arm: arm.name)
def test_a_file_is_read_back_by_the_door_of_any_arm(arm: aa.Arm) -> None:
    """`from_urdf` and `load` of an offset arm's URDF give the arm back."""
    for read in (aa.Arm.from_urdf(arm.to_urdf()), aa.Arm.load(arm.to_urdf())):
        q = joints(arm, 20)
        np.testing.assert_allclose(read.forward(q)[0], arm.forward(q)[0], atol=1e-9)
        assert (read.geometry.d_se, read.geometry.d_ew, read.kind, read.redundancy) == (
            arm.geometry.d_se,
            arm.geometry.d_ew,
            arm.kind,
            arm.redundancy,
        )
        assert read.report is not None


@pytest.mark.parametrize("name", offset_catalogue())
def test_the_doors_of_the_catalogue_are_those_of_any_arm(name: str) -> None:
    """`from_catalogue` and `load` give every offset arm, with its kind and free joint."""
    arm = aa.Arm.from_catalogue(name)
    assert name in aa.catalogue() and aa.Arm.load(name) == arm and eval(repr(arm), {"Arm": aa.Arm}) == arm
    assert (arm.kind, arm.redundancy) in {("offset_wrist", "joint_7"), ("offset_shoulder", "joint_1")}
    q = joints(arm.with_(lower=np.maximum(arm.lower, -3.0), upper=np.minimum(arm.upper, 3.0)), 20)
    psi = arm.forward(q)[1]
    np.testing.assert_allclose(psi, q[:, 6 if arm.redundancy == "joint_7" else 0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("arm", [FR3, MIRRORED], ids=lambda arm: arm.name)
def test_the_slope_of_its_limit_margin_is_that_of_its_joints(arm: aa.Arm) -> None:
    """`gradients.limit_margin` of an offset arm equals differences."""
    for q in joints(arm, 20):
        ahead, behind = (arm.limit_margin(q + s * 1e-7 * np.eye(7)) for s in (1, -1))
        np.testing.assert_allclose(aa.gradients.limit_margin(arm, q), (ahead - behind) / 2e-7, atol=1e-6)


def test_a_name_or_keyword_that_there_is_not_is_said() -> None:
    """Attributes and keywords that do not exist are refused with a hint."""
    with pytest.raises(AttributeError, match="'Arm' object has no attribute 'postures'"):
        FR3.postures  # noqa: B018 - the name alone is asked
    with pytest.raises(aa.InputError, match="'d_sw', wanted one of 'd_bs', "):
        FR3.with_(d_sw=0.1)
    with pytest.raises(TypeError, match=r"Arm\(\) missing 3 required keyword-only arguments: 'd_se'"):
        aa.Arm(a_6=0.088, d_bs=0.3)
    with pytest.raises(aa.InputError, match="solve of an Arm takes no near=: "):
        FR3.solve(np.eye(4), near=Q)
    with pytest.raises(TypeError, match="unexpected keyword argument 'nonsense'"):
        FR3.solve(np.eye(4), nonsense=1)
