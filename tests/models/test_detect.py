"""Detection of S-R-S arms: generated ones in any frames, and real ones."""

from __future__ import annotations

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
)
from support.needs import model

from armangle.models.axes import Axes
from armangle.models.description import ArmDescription, ImportReport
from armangle.models.detect import describe_chain
from armangle.models.urdf import read_urdf, write_urdf

pytestmark = pytest.mark.filterwarnings("ignore:joint .* is continuous")

EXACT = 1e-9
LENGTHS = ("d_bs", "d_se", "d_ew", "d_wf", "a_3", "a_4", "d_4")
NAMES = tuple(f"to_l{i}" for i in range(7))


def assert_meets_file(text: str, arm: ArmDescription, rng, position=EXACT, rotation=EXACT) -> None:
    for q in np.vstack([np.zeros(7), rng.uniform(-np.pi, np.pi, (4, 7))]):
        own = urdf_forward(text, "tip", dict(zip(arm.joint_names, q, strict=True)))
        off, turned = pose_error(dh_forward(arm, q), own)
        assert off <= position
        assert turned <= rotation


def assert_same(one: ArmDescription, other: ArmDescription, tolerance: float = EXACT) -> None:
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


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(400))
def test_generated_arm_is_found_whatever_its_frames(seed):
    rng = np.random.default_rng(seed)
    made = RandomArm(rng, elbow_offset=seed % 2 == 1, right_angles=seed % 4 >= 2)
    text = urdf_of(made, rng)
    arm, report = describe_chain(read_urdf(text, "root", "tip"))
    assert arm.joint_names == NAMES
    assert_meets_file(text, arm, rng)
    assert report.residual_position <= EXACT
    assert report.residual_rotation <= EXACT
    assert min(arm.d_bs, arm.d_se, arm.d_ew, arm.d_wf) >= 0.0
    assert (arm.offsets[0], arm.offsets[6]) == (0.0, 0.0)
    for name in ("d_se", "d_ew", "a_3", "a_4"):
        assert abs(getattr(arm, name)) == pytest.approx(abs(getattr(made, name)), abs=EXACT)


@pytest.mark.parametrize("seed", range(40))
def test_a_link_across_its_axis_is_an_elbow_offset(seed):
    rng = np.random.default_rng(seed)
    made = RandomArm(rng, elbow_offset=True, right_angles=seed % 4 >= 2)
    made.d_se = 0.0 if seed % 3 else made.d_se
    made.d_ew = 0.0 if seed % 2 else made.d_ew
    text = urdf_of(made, rng)
    arm, report = describe_chain(read_urdf(text, "root", "tip"))
    assert_meets_file(text, arm, rng)
    assert report.residual_position <= EXACT
    assert (arm.d_se == 0.0) == (made.d_se == 0.0)


def test_a_common_perpendicular_stands_on_both_axes():
    rng = np.random.default_rng(8)
    for points, directions in zip(rng.normal(size=(50, 7, 3)), rng.normal(size=(50, 7, 3)), strict=True):
        axes = Axes(points, directions / np.linalg.norm(directions, axis=1, keepdims=True))
        distance, foot = axes.perpendicular(2, 3)
        other = axes.perpendicular(3, 2)[1]
        assert np.linalg.norm(foot - other) == pytest.approx(distance, abs=1e-9)
        assert np.abs((foot - other) @ axes.directions[[2, 3]].T).max() < 1e-9
        assert np.linalg.norm(np.cross(foot - points[3], axes.directions[3])) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(80))
def test_a_gap_along_axis_4_is_part_of_the_elbow(seed):
    rng = np.random.default_rng(seed)
    made = RandomArm(rng, elbow_offset=seed % 2 == 1, right_angles=seed % 4 >= 2)
    made.d_4 = rng.choice([-1, 1]) * 10 ** rng.uniform(-4, -0.5)
    text = urdf_of(made, rng)
    arm, report = describe_chain(read_urdf(text, "root", "tip"))
    assert_meets_file(text, arm, rng)
    assert report.residual_position <= EXACT
    assert abs(arm.d_4) == pytest.approx(abs(made.d_4), abs=EXACT)
    again, _ = describe_chain(read_urdf(write_urdf(arm)))
    assert_same(again, arm)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_the_writing_depends_on_the_axes_alone(seed):
    rng = np.random.default_rng(seed)
    made = RandomArm(rng, elbow_offset=seed % 2 == 1, right_angles=seed % 4 >= 2)
    made.d_4 = 0.02 * (seed % 3 == 0)
    frames = [describe_chain(read_urdf(urdf_of(made, np.random.default_rng(k)), "root", "tip"))[0]
              for k in (1, 2)]  # fmt: skip
    for name in LENGTHS:
        first, second = (getattr(arm, name) for arm in frames)
        assert first == pytest.approx(second, abs=EXACT)
    assert frames[0].signs == frames[1].signs
    np.testing.assert_allclose(frames[0].offsets, frames[1].offsets, atol=EXACT)
    np.testing.assert_allclose(frames[0].base, frames[1].base, atol=EXACT)
    np.testing.assert_allclose(frames[0].tool, frames[1].tool, atol=EXACT)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_written_urdf_imports_back_to_the_same_arm(seed):
    rng = np.random.default_rng(seed)
    made = RandomArm(rng, elbow_offset=seed % 2 == 1, right_angles=seed % 4 >= 2)
    first, _ = describe_chain(read_urdf(urdf_of(made, rng), "root", "tip"))
    text = write_urdf(first)
    assert_meets_file(text, first, rng)
    again, report = describe_chain(read_urdf(text))
    assert_same(again, first)
    assert (report.base, report.tip) == ("base", "tip")


REAL = {
    # name: lengths, elbow offsets, signs, zeros in degrees, as published for these files
    "kuka_iiwa7_r800": ((0.34, 0.4, 0.4, 0.126, 0, 0), "+++++++", (0,) * 7),
    "kuka_iiwa14_r820_official": ((0.36, 0.42, 0.4, 0.152, 0, 0), "+++++++", (0,) * 7),
    "schunk_lwa4d": ((0.24, 0.328, 0.323, 0.0824, 0, 0), "+++-+++", (0,) * 7),
    "rokae_xmate_er3_pro": ((0.3426, 0.3929, 0.3656, 0.2509, 0, 0), "+++-+++", (0,) * 7),
    "realman_rm75": ((0.2405, 0.256, 0.21, 0.144, 0, 0), "+++-+++", (0,) * 7),
    "openarm_v10": ((0.1225, 0.22, 0.216, 0.0205, 0, 0), "++++++-", (0, 0, 90, 0, 90, -90, 0)),
    "yaskawa_sia5d": (
        (0.31, 0.27, 0.27, 0.145, 0.085, -0.06),
        "++++---",
        (0, 0, 0, -90, 0, 0, 0),
    ),
}


@pytest.mark.parametrize("name", REAL)
def test_real_file_gives_its_published_numbers(name):
    lengths, signs, zeros = REAL[name]
    arm, _ = describe_chain(read_urdf(model(name)))
    np.testing.assert_allclose([getattr(arm, key) for key in LENGTHS], (*lengths, 0), atol=5e-5)
    assert "".join("+" if s > 0 else "-" for s in arm.signs) == signs
    np.testing.assert_allclose(np.degrees(arm.offsets), zeros, atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", REAL)
def test_real_file_is_met_within_its_residual(name):
    path = model(name)
    text = path.read_text()
    chain = read_urdf(path)
    arm, report = describe_chain(chain)
    rng = np.random.default_rng(1)
    off, turned = 0.0, 0.0
    for q in rng.uniform(-np.pi, np.pi, (300, 7)):
        own = urdf_forward(text, chain.tip, dict(zip(arm.joint_names, q, strict=True)))
        errors = pose_error(dh_forward(arm, q), own)
        off, turned = max(off, errors[0]), max(turned, errors[1])
    if name == "realman_rm75":
        assert 1e-6 < off < 6e-6
        assert off <= report.residual_position < 8e-6
        assert turned <= report.residual_rotation < 7 * 3.68e-6
    else:
        assert max(off, turned, report.residual_position, report.residual_rotation) <= EXACT


def test_rounded_right_angles_leave_plain_frames():
    arm, report = describe_chain(read_urdf(model("realman_rm75")))
    np.testing.assert_array_equal(arm.base, np.eye(4))
    np.testing.assert_array_equal(arm.tool, np.eye(4))
    assert report.angle_miss == pytest.approx(3.67e-6, rel=0.01)


def test_suspicious_speeds_are_noted():
    _, report = describe_chain(read_urdf(model("openarm_v10")))
    wanted = "velocity of joint 'openarm_joint1' is 16.75 rad/s (960 deg/s): not trusted"
    assert wanted in report.notes


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(50))
def test_within_tolerance_is_snapped_and_the_residual_said(seed):
    rng = np.random.default_rng(seed)
    joint = int(rng.integers(1, 7))
    axis = random_frame(rng)[:3, 2]
    frame = shift(*(axis * 1e-5)) @ turn(axis, 5e-6)
    chain = broken_chain(joint, frame)
    arm, report = describe_chain(chain)
    for q in rng.uniform(-np.pi, np.pi, (5, 7)):
        off, turned = pose_error(dh_forward(arm, q), chain.forward(q))
        assert off <= report.residual_position + EXACT
        assert turned <= report.residual_rotation + EXACT
    assert report.residual_position < 1e-4


@pytest.mark.parametrize("length", [2e-5, 2e-4, 2e-2])
def test_small_elbow_offsets_are_kept_whatever_the_tolerance(length):
    arm, report = describe_chain(broken_chain(3, shift(1e-4, 0, 0)), length=length)
    assert (arm.a_3, arm.a_4) == (pytest.approx(1e-4, abs=EXACT), 0.0)
    assert report.residual_position <= EXACT
    arm, report = describe_chain(broken_chain(3, shift(1e-5, 0, 0)), length=length)
    assert (arm.a_3, arm.a_4) == (0.0, 0.0)


def test_report_says_what_was_read():
    chain = broken_chain(0, np.eye(4))
    arm, report = describe_chain(chain)
    assert isinstance(report, ImportReport)
    assert (report.source, report.base, report.tip) == ("text", "a", "b")
    assert report.joint_names == arm.joint_names == tuple(f"j{i}" for i in range(7))
    assert report.postures >= 100
    assert not arm.base.flags.writeable
    assert not arm.tool.flags.writeable
