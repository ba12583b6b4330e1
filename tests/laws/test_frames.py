"""Arm.frames: the DH frames in space, against the plain NumPy chain of Eq. (1)."""

from __future__ import annotations

import numpy as np
import pytest
from support.strategies import frame
from support.threads import in_threads

import armangle as aa
from armangle.arm.joint_map import to_q, to_theta
from armangle.models.catalogue import srs_catalogue

_TWIST = (-np.pi / 2, np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, np.pi / 2, 0.0)
_OFFSET_ELBOW = "barrett_wam7"


def _dh(theta: float, alpha: float, d: float, a: float) -> np.ndarray:
    """Return Eq. (1)."""
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


def _by_hand(arm: aa.Arm, q: np.ndarray) -> np.ndarray:
    d = (arm.d_bs, 0, arm.d_se, arm.d_4, arm.d_ew, 0, arm.d_wf)
    a = (0, 0, arm.a_3, arm.a_4, 0, 0, 0)
    out = [arm.base]
    for theta, row in zip(arm.signs * q + arm.offsets, zip(_TWIST, d, a, strict=True), strict=True):
        out.append(out[-1] @ _dh(theta, *row))
    return np.array(out)


@pytest.mark.parametrize("name", srs_catalogue())
def test_frames_are_those_of_the_dh_rows(name: str) -> None:
    arm = aa.Arm.from_catalogue(name)
    q = np.random.default_rng(3).uniform(-2, 2, (6, 7))
    frames = arm.frames(q)
    assert frames.shape == (6, 8, 4, 4)
    for one, joints in zip(frames, q, strict=True):
        np.testing.assert_allclose(one, _by_hand(arm, joints), atol=1e-14)
    np.testing.assert_allclose(frames[:, 7] @ arm.tool, arm.forward(q)[0], atol=1e-14)


@pytest.mark.parametrize("name", srs_catalogue())
def test_the_joint_map_is_signs_and_offsets(name: str) -> None:
    arm = aa.Arm.from_catalogue(name)
    q = np.random.default_rng(6).uniform(-7, 7, (2, 3, 7))
    theta = to_theta(arm._handle, q)
    np.testing.assert_allclose(theta, arm.signs * q + arm.offsets, atol=1e-14)
    np.testing.assert_allclose(to_q(arm._handle, theta), q, atol=1e-14)


def test_a_batch_is_its_elements_bit_for_bit() -> None:
    arm = aa.Arm.from_catalogue(_OFFSET_ELBOW)
    q = np.random.default_rng(4).uniform(-2, 2, (3, 4, 7))
    frames = in_threads(2, lambda: arm.frames(q))
    for index in np.ndindex(3, 4):
        np.testing.assert_array_equal(frames[index], arm.frames(q[index]))


def test_each_joint_turns_about_the_z_axis_of_the_frame_before_it() -> None:
    arm = aa.Arm.from_catalogue(_OFFSET_ELBOW)
    q = np.random.default_rng(5).uniform(-1, 1, 7)
    frames, jacobian = arm.frames(q), arm.jacobian(q)
    axes = frames[:7, :3, 2] * arm.signs[:, None]
    np.testing.assert_allclose(jacobian[3:].T, axes, atol=1e-14)
    tip = arm.forward(q)[0][:3, 3]
    np.testing.assert_allclose(jacobian[:3].T, np.cross(axes, tip - frames[:7, :3, 3]), atol=1e-13)


def test_a_joint_that_is_not_finite_is_named() -> None:
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.zeros((2, 7))
    q[1, 3] = np.nan
    with pytest.raises(aa.InputError, match=r"q\[1\] holds nan"):
        arm.frames(q)
    with pytest.raises(aa.InputError, match=r"q has shape \(6,\)"):
        arm.frames(np.zeros(6))


@pytest.mark.parametrize("name", srs_catalogue())
def test_a_tool_is_mounted_on_the_present_tip(name: str) -> None:
    arm, rng = aa.Arm.from_catalogue(name), np.random.default_rng(5)
    tool = frame(rng)
    tool[:3, 3] = rng.uniform(-0.3, 0.3, 3)
    q = rng.uniform(-2, 2, (200, 7))
    longer = arm.with_tool(tool)
    np.testing.assert_allclose(longer.forward(q)[0], arm.forward(q)[0] @ tool, rtol=0, atol=1e-14)
    assert longer.with_(tool=arm.tool) == arm
    assert longer.with_tool(np.linalg.inv(tool)) != longer
    np.testing.assert_array_equal(arm.with_(tool=tool).frames(q), arm.frames(q))
    np.testing.assert_allclose(arm.with_(tool=tool).tool, tool, rtol=0, atol=1e-15)


def test_a_tool_that_replaces_the_tip_is_elsewhere() -> None:
    arm, gripper, q = aa.Arm.from_catalogue("openarm_v10"), np.eye(4), np.full(7, 0.3)
    gripper[2, 3] = 0.15
    mounted, replaced = arm.with_tool(gripper), arm.with_(tool=gripper)
    apart = np.linalg.norm(mounted.forward(q)[0][:3, 3] - replaced.forward(q)[0][:3, 3])
    np.testing.assert_allclose(apart, 0.15 * np.sqrt(2), atol=1e-6)  # its tip is turned by 120 degrees


def test_a_tool_is_a_rigid_transform() -> None:
    with pytest.raises(aa.InputError, match="the rotation of tool is not orthonormal"):
        aa.Arm.from_catalogue("openarm_v10").with_tool(np.diag([2.0, 2.0, 2.0, 1.0]))
