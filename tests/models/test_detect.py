"""Detection of S-R-S arms: generated ones in any frames, and real ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.chain import (
    RandomArm,
    broken_chain,
    dh_forward,
    pose_error,
    random_frame,
    shift,
    turn,
    urdf_forward,
    urdf_of,
)  # fmt: skip
from support.chains import read_urdf
from support.needs import model

from armangle.models.axes import Axes
from armangle.models.description import ArmDescription
from armangle.models.detect import describe_chain
from armangle.models.urdf import write_urdf

pytestmark = pytest.mark.filterwarnings("ignore:joint .* is continuous")

EXACT = 1e-9
LENGTHS = ("d_bs", "d_se", "d_ew", "d_wf", "a_3", "a_4", "d_4")
NAMES = tuple(f"to_l{i}" for i in range(7))


def assert_meets_file(text: str, arm: ArmDescription, rng, position=EXACT, rotation=EXACT) -> None:
    """Assert that an arm has the poses of a URDF text within position (m) and rotation (rad)."""
    for q in np.vstack([np.zeros(7), rng.uniform(-np.pi, np.pi, (4, 7))]):
        own = urdf_forward(text, "tip", dict(zip(arm.joint_names, q, strict=True)))
        off, turned = pose_error(dh_forward(arm, q), own)
        assert off <= position
        assert turned <= rotation


def assert_same(one: ArmDescription, other: ArmDescription, tolerance: float = EXACT) -> None:
    """Assert that two descriptions have equal numbers and joint names."""
    for name in LENGTHS:
        assert getattr(one, name) == pytest.approx(getattr(other, name), abs=tolerance)
    assert one.signs == other.signs
    np.testing.assert_allclose(one.offsets, other.offsets, atol=tolerance)
    np.testing.assert_allclose(one.base, other.base, atol=tolerance)
    np.testing.assert_allclose(one.tool, other.tool, atol=tolerance)
    np.testing.assert_allclose(one.lower, other.lower, atol=tolerance)
    np.testing.assert_allclose(one.upper, other.upper, atol=tolerance)
    np.testing.assert_allclose(one.velocity, other.velocity, atol=tolerance)
    assert one.joint_names == other.joint_names


def drawn(seed: int, **change: float) -> tuple[RandomArm, str, np.random.Generator]:
    """A made arm, its text in random frames, and what drew them."""
    rng = np.random.default_rng(seed)
    made = RandomArm(rng, elbow_offset=seed % 2 == 1, right_angles=seed % 4 >= 2)
    for name, value in change.items():
        setattr(made, name, value)
    return made, urdf_of(made, rng), rng


def assert_found(made: RandomArm, text: str, rng: np.random.Generator) -> ArmDescription:
    """Assert that a URDF's arm is that which was made, and is itself when written and read; return it."""
    arm, report = describe_chain(read_urdf(text, "root", "tip"))
    assert arm.joint_names == NAMES
    assert_meets_file(text, arm, rng)
    assert max(report.residual_position, report.residual_rotation) <= EXACT
    assert min(arm.d_bs, arm.d_se, arm.d_ew, arm.d_wf) >= 0.0
    assert (arm.offsets[0], arm.offsets[6]) == (0.0, 0.0)
    assert (arm.d_se == 0.0, arm.d_ew == 0.0) == (made.d_se == 0.0, made.d_ew == 0.0)
    written = write_urdf(arm)
    assert_meets_file(written, arm, rng)
    again, report = describe_chain(read_urdf(written))
    assert (report.base, report.tip) == ("base", "tip")
    assert_same(again, arm)
    return arm


@pytest.mark.turns(8)
@pytest.mark.slow
@pytest.mark.parametrize("part", range(8))
def test_generated_arm_is_found_whatever_its_frames(part):
    """`describe_chain` finds random arms in random frames, with their lengths."""
    for seed in range(part, 400, 8):
        gap = 10 ** np.random.default_rng(seed).uniform(-4, -0.5) * (seed % 5 == 0)  # along axis 4
        made, text, rng = drawn(seed, d_4=gap * (-1) ** seed)
        arm = assert_found(made, text, rng)
        for name in ("d_se", "d_ew", "a_3", "a_4", "d_4"):
            assert abs(getattr(arm, name)) == pytest.approx(abs(getattr(made, name)), abs=EXACT), seed


def test_a_link_across_its_axis_is_an_elbow_offset():
    """`describe_chain` finds random arms with an elbow offset and d_se = 0, d_ew = 0 or both."""
    for seed in range(1, 80, 2):
        across = {"d_se": 0.0} if seed % 3 else {"d_ew": 0.0}
        assert_found(*drawn(seed, **(across if seed % 5 else {"d_se": 0.0, "d_ew": 0.0})))


def test_a_common_perpendicular_stands_on_both_axes():
    """`Axes.perpendicular` gives distance and foot of the common perpendicular of two axes."""
    rng = np.random.default_rng(8)
    for points, directions in zip(rng.normal(size=(50, 7, 3)), rng.normal(size=(50, 7, 3)), strict=True):
        axes = Axes(points, directions / np.linalg.norm(directions, axis=1, keepdims=True))
        distance, foot = axes.perpendicular(2, 3)
        other = axes.perpendicular(3, 2)[1]
        assert np.linalg.norm(foot - other) == pytest.approx(distance, abs=1e-9)
        assert np.abs((foot - other) @ axes.directions[[2, 3]].T).max() < 1e-9
        assert np.linalg.norm(np.cross(foot - points[3], axes.directions[3])) < 1e-9


@pytest.mark.slow
def test_the_writing_depends_on_the_axes_alone():
    """`describe_chain` gives the same arm for the same axes in other frames."""
    for seed in range(60):
        made, _, _ = drawn(seed, d_4=0.02 * (seed % 3 == 0))
        texts = [urdf_of(made, np.random.default_rng(k)) for k in (1, 2)]
        one, other = (describe_chain(read_urdf(text, "root", "tip"))[0] for text in texts)
        assert_same(
            replace(one, lower=other.lower, upper=other.upper), other
        )  # a limit is drawn with the frames


REAL = {
    # name: lengths, elbow offsets, signs, zeros in degrees, as published for these files
    "kuka_iiwa7_r800": ((0.34, 0.4, 0.4, 0.126, 0, 0), "+++++++", (0,) * 7),
    "kuka_iiwa14_r820_official": ((0.36, 0.42, 0.4, 0.152, 0, 0), "+++++++", (0,) * 7),
    "schunk_lwa4d": ((0.24, 0.328, 0.323, 0.0824, 0, 0), "+++-+++", (0,) * 7),
    "rokae_xmate_er3_pro": ((0.3426, 0.3929, 0.3656, 0.2509, 0, 0), "+++-+++", (0,) * 7),
    "realman_rm75": ((0.2405, 0.256, 0.21, 0.144, 0, 0), "+++-+++", (0,) * 7),
    "openarm_v10": ((0.1225, 0.22, 0.216, 0.0205, 0, 0), "++++++-", (0, 0, 90, 0, 90, -90, 0)),
    "yaskawa_sia5d": ((0.31, 0.27, 0.27, 0.145, 0.085, -0.06), "++++---", (0, 0, 0, -90, 0, 0, 0)),
}


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", REAL)
def test_real_file_gives_its_published_numbers_and_is_met_within_its_residual(name):
    """`describe_chain` of a real file has the published lengths; its residual bounds the error of poses."""
    lengths, signs, zeros = REAL[name]
    path = model(name)
    chain, text = read_urdf(path), path.read_text()
    arm, report = describe_chain(chain)
    np.testing.assert_allclose([getattr(arm, key) for key in LENGTHS], (*lengths, 0), atol=5e-5)
    assert "".join("+" if s > 0 else "-" for s in arm.signs) == signs
    np.testing.assert_allclose(np.degrees(arm.offsets), zeros, atol=1e-3)
    errors = []
    for q in np.random.default_rng(1).uniform(-np.pi, np.pi, (100, 7)):
        own = urdf_forward(text, chain.tip, dict(zip(arm.joint_names, q, strict=True)))
        errors.append(pose_error(dh_forward(arm, q), own))
    off, turned = np.max(errors, axis=0)
    if name == "realman_rm75":
        assert 1e-6 < off < 6e-6
        assert off <= report.residual_position < 8e-6
        assert turned <= report.residual_rotation < 7 * 3.68e-6
    else:
        assert max(off, turned, report.residual_position, report.residual_rotation) <= EXACT


def test_rounded_right_angles_leave_plain_frames():
    """Base and tool of a file with rounded right angles are exact identities."""
    arm, report = describe_chain(read_urdf(model("realman_rm75")))
    np.testing.assert_array_equal(arm.base, np.eye(4))
    np.testing.assert_array_equal(arm.tool, np.eye(4))
    assert report.angle_miss == pytest.approx(3.67e-6, rel=0.01)


def test_suspicious_speeds_are_noted():
    """`describe_chain` notes a velocity of 16.75 rad/s."""
    _, report = describe_chain(read_urdf(model("openarm_v10")))
    wanted = "velocity of joint 'openarm_joint1' is 16.75 rad/s (960 deg/s): not trusted"
    assert wanted in report.notes


@pytest.mark.slow
def test_within_tolerance_is_snapped_and_the_residual_said():
    """`describe_chain` of a nearly S-R-S chain states residuals that bound the errors of its poses."""
    for seed in range(50):
        rng = np.random.default_rng(seed)
        axis = random_frame(rng)[:3, 2]
        chain = broken_chain(int(rng.integers(1, 7)), shift(*(axis * 1e-5)) @ turn(axis, 5e-6))
        arm, report = describe_chain(chain)
        for q in rng.uniform(-np.pi, np.pi, (5, 7)):
            off, turned = pose_error(dh_forward(arm, q), chain.forward(q))
            assert off <= report.residual_position + EXACT and turned <= report.residual_rotation + EXACT
        assert report.residual_position < 1e-4


@pytest.mark.parametrize("length", [2e-5, 2e-4, 2e-2])
def test_small_elbow_offsets_are_kept_whatever_the_tolerance(length):
    """`describe_chain` keeps an elbow offset of 0.1 mm for every tolerance, and drops one of 0.01 mm."""
    arm, report = describe_chain(broken_chain(3, shift(1e-4, 0, 0)), length=length)
    assert (arm.a_3, arm.a_4) == (pytest.approx(1e-4, abs=EXACT), 0.0)
    assert report.residual_position <= EXACT
    arm, report = describe_chain(broken_chain(3, shift(1e-5, 0, 0)), length=length)
    assert (arm.a_3, arm.a_4) == (0.0, 0.0)
    assert (report.source, report.base, report.tip) == ("text", "a", "b") and report.postures >= 100
    assert report.joint_names == arm.joint_names == tuple(f"j{i}" for i in range(7))
    assert not arm.base.flags.writeable and not arm.tool.flags.writeable
