"""Doors of an `OffsetArm` beside the kinematics: copies, frames, what leads from `Arm` to it."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import armangle as aa
from armangle.models.offset import offset_catalogue

FR3 = aa.Arm.from_catalogue("franka_fr3")
Q = np.array([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])
MIRRORED = aa.Arm(
    a_1=0.117, d_bs=0.3, d_se=0.35, d_ew=0.32, d_wf=0.15, signs=[1, -1, 1, 1, -1, 1, 1], offsets=[0.3] * 7,
    lower=[-2.0] * 7, upper=[2.0] * 7, base=aa.pose([0.1, 0.2, 0.3], rpy=[0.1, 0.2, 0.3]),
    tool=aa.pose([0.0, 0.1, 0.2], rpy=[0.3, -0.2, 0.1]), name="shoulder",
)  # fmt: skip


def joints(arm: aa.Arm, count: int, seed: int = 0) -> Any:
    """Return joint values within the limits."""
    return np.random.default_rng(seed).uniform(arm.lower, arm.upper, (count, 7))


@pytest.mark.parametrize("arm", [FR3, MIRRORED], ids=lambda arm: arm.name)
def test_frames_lead_along_the_chain_to_the_pose(arm: aa.Arm) -> None:
    q = joints(arm, 50)
    frames = arm.frames(q)
    np.testing.assert_allclose(frames[:, 7] @ arm.tool, arm.forward(q)[0], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(arm.elbow(q), frames[:, 3, :3, 3])
    row, offset = (1, arm.a_1) if arm.a_1 else (6, arm.a_6)
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
    pose, free, gc = FR3.forward(Q)
    rows = FR3.inverse(pose, free, limits=False)
    outside = next(k for k in range(8) if np.isfinite(rows[k, 0]) and not FR3.within_limits(rows[k]))
    with pytest.raises(aa.LimitError, match="joint"):
        FR3.inverse(pose, free, outside)
    np.testing.assert_array_equal(FR3.inverse(pose, free, gc), FR3.inverse(pose, free, gc, limits=False))


def test_a_copy_with_changes_keeps_the_rest() -> None:
    arm = FR3.with_(lower=FR3.lower + 0.1, acceleration=10.0, name="mine")
    assert arm.name == "mine" and arm.a_6 == FR3.a_6 and (arm.acceleration == 10.0).all()
    np.testing.assert_array_equal(arm.lower, FR3.lower + 0.1)
    np.testing.assert_array_equal(arm.velocity, FR3.velocity)
    assert pickle.loads(pickle.dumps(arm)) == arm and eval(repr(arm), {"OffsetArm": aa.Arm}) == arm
    assert repr(FR3) == "OffsetArm.from_catalogue('franka_fr3')"
    assert "a_6 88, d_bs 333" in str(FR3) and "a_1 117" in str(MIRRORED)
    with pytest.raises(aa.InputError, match="chain"):
        FR3.with_(chain=np.tile(np.eye(4), (8, 1, 1)))
    hand = aa.pose([0.0, 0.0, 0.1034], rpy=[0.0, 0.0, -np.pi / 4])
    np.testing.assert_allclose(FR3.with_tool(hand).forward(Q)[0], FR3.forward(Q)[0] @ hand, atol=1e-15)
    other = FR3.with_(a_1=0.1, a_6=0.0)
    assert other._free_joint == 1 and other.forward(Q)[1] == Q[0]


def test_limits_are_asked_of_the_arm_itself() -> None:
    assert FR3.within_limits(Q) and not FR3.within_limits(np.zeros(7))
    assert FR3.limit_margin(Q) == np.minimum(Q - FR3.lower, FR3.upper - Q).min()


@pytest.mark.parametrize("arm", [FR3, MIRRORED], ids=lambda arm: arm.name)
def test_a_file_leads_from_the_wrong_door_to_the_right_one(arm: aa.Arm) -> None:
    text = arm.to_urdf()
    with pytest.raises(aa.ModelError, match=r"armangle\.OffsetArm takes .* S-R-S but for an offset"):
        aa.Arm.from_urdf(text)
    read = aa.Arm.from_urdf(text)
    q = joints(arm, 20)
    np.testing.assert_allclose(read.forward(q)[0], arm.forward(q)[0], atol=1e-9)
    assert (read.rows.d_se, read.rows.d_ew) == (arm._rows.d_se, arm._rows.d_ew)
    assert read._free_joint == arm._free_joint


def test_an_srs_file_leads_back() -> None:
    iiwa = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    with pytest.raises(aa.ModelError, match=r"armangle\.Arm"):
        aa.Arm.from_urdf(iiwa.to_urdf())
    with pytest.raises(aa.InputError, match=r"Arm\.from_catalogue\('kuka_iiwa7_r800'\)"):
        aa.Arm.from_catalogue("kuka_iiwa7_r800")


@pytest.mark.parametrize("name", offset_catalogue())
def test_the_catalogue_of_arms_names_the_other_door(name: str) -> None:
    with pytest.raises(aa.InputError, match=rf"OffsetArm\.from_catalogue\('{name}'\)"):
        aa.Arm.from_catalogue(name)


def test_a_word_of_the_name_is_enough_for_the_hint() -> None:
    with pytest.raises(aa.InputError, match="franka_fr3"):
        aa.Arm.from_catalogue("franka")


def test_what_an_arm_alone_has_is_answered_with_what_there_is() -> None:
    alone = [name for name in dir(aa.Arm) if not name.startswith("_") and not hasattr(FR3, name)]
    assert {"solutions", "best", "explain", "reachable", "clear", "clearance", "psi_towards"} <= {*alone}
    for name in alone:
        with pytest.raises(AttributeError, match=f"an OffsetArm has no {name}: ") as caught:
            getattr(FR3, name)
        assert caught.type is AttributeError  # a traceback names no class that nobody can import
    with pytest.raises(AttributeError, match="no attribute 'postures'"):
        FR3.postures  # noqa: B018 - the name alone is asked
    with pytest.raises(TypeError, match=r"OffsetArm\(\) got an unexpected keyword argument 'd_sw'"):
        FR3.with_(d_sw=0.1)
    with pytest.raises(TypeError, match=r"OffsetArm\(\) missing 3 required keyword-only arguments: 'd_se'"):
        aa.Arm(a_6=0.088, d_bs=0.3)


@pytest.mark.parametrize("word", ["metric", "outside", "roll", "scene", "prefer", "singularity_margin"])
def test_a_keyword_of_an_arm_alone_is_refused_by_name(word: str) -> None:
    pose, free, gc = FR3.forward([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])
    with pytest.raises(aa.InputError, match=f"solve of an OffsetArm takes no {word}=: "):
        FR3.solve(pose, **{word: 1})
    with pytest.raises(aa.InputError, match=f"feasible of an OffsetArm takes no {word}=: "):
        FR3.feasible(pose, gc, **{word: 1})
    with pytest.raises(aa.InputError, match="inverse of an OffsetArm takes no psi=: free is its place"):
        FR3.inverse(pose, psi=free, gc=gc, limits=False)
    with pytest.raises(TypeError, match="unexpected keyword argument 'nonsense'"):
        FR3.solve(pose, nonsense=1)
