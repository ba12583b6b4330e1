"""What files of real robots say oddly, and is read all the same: each with its note."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pytest
from support.chain import Chain, broken_chain, joint_xml, shift, simple_urdf, turn
from support.chains import read_mjcf, read_urdf
from support.needs import case, model, need

import armangle as aa
from armangle.errors import InputError, ModelError
from armangle.models.axes import NEAR_ANGLE, Axes
from armangle.models.detect import describe_chain, nearness
from armangle.models.fit import fit
from armangle.models.urdf import Source
from armangle.models.urdf.writing import write_chain

INF = float("inf")
X, Z = np.eye(3)[0], np.eye(3)[2]
FR3 = aa.Arm.from_catalogue("franka_fr3")
PLAIN = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1, velocity=[1] * 7)


def with_limit(kind: str, limit: str) -> str:
    """Return a URDF whose third joint has another type and limit."""
    inside = f'<axis xyz="0 0 1"/><limit {limit}/>' if limit else '<axis xyz="0 0 1"/>'
    return simple_urdf(j3=joint_xml("j3", "l2", "l3", kind, inside))


STATED = 'lower="-1.5" upper="1.25" velocity="1"'


@pytest.mark.parametrize(("use", "wanted"), [("ignore", (-INF, INF)), ("use", (-1.5, 1.25))])
def test_limits_of_a_continuous_joint_are_noted_and_used_if_wanted(use, wanted):
    """`read_urdf` notes limits of a continuous joint, and uses them if continuous_limits="use"."""
    chain = read_urdf(with_limit("continuous", STATED), continuous_limits=use)
    assert (chain.joints[2].lower, chain.joints[2].upper) == wanted
    (note,) = chain.notes
    assert note.startswith("joint 'j3' is continuous, which means no limits, but states -1.5 to 1.25 rad: ")
    done = {
        "ignore": "NOT used (continuous_limits='use')",
        "use": "used all the same",
    }[use]
    assert note.endswith(f"they are {done}")


@pytest.mark.parametrize("limit", ["", 'velocity="1"', 'lower="0" upper="0" velocity="1"'])
@pytest.mark.parametrize("use", ["ignore", "use"])
def test_a_continuous_joint_that_states_none_has_none_and_no_note(limit, use):
    """A continuous joint without limits, or 0 to 0, has none and no note."""
    chain = read_urdf(with_limit("continuous", limit), continuous_limits=use)
    assert (chain.joints[2].lower, chain.joints[2].upper, chain.notes) == (-INF, INF, ())


@pytest.mark.parametrize("arm", [PLAIN.with_(lower=-1, upper=1), FR3], ids=["srs", "offset"])
def test_an_arm_says_that_its_limits_are_not_used(arm: aa.Arm) -> None:
    """`from_urdf` of continuous joints with limits warns, notes it, and uses them on request."""
    text = arm.to_urdf().replace('type="revolute"', 'type="continuous"')
    with pytest.warns(UserWarning, match="joint 'joint_1' is continuous, .* NOT used") as caught:
        read = aa.Arm.from_urdf(text)
    assert [str(one.message) for one in caught] == list(read.geometry.notes) and caught[
        0
    ].filename == __file__
    assert len(read.geometry.notes) == 7 and np.isinf(read.lower).all()
    assert "note: joint 'joint_7' is continuous" in str(read.report)
    used = aa.Arm.from_urdf(text, continuous_limits="use")
    np.testing.assert_allclose([used.lower, used.upper], [arm.lower, arm.upper], rtol=0, atol=1e-9)
    with pytest.raises(InputError, match="continuous_limits is 'yes', wanted one of"):
        aa.Arm.from_urdf(text, continuous_limits="yes")


def test_a_speed_or_a_limit_that_means_none_is_none():
    """`read_urdf` takes velocities <= 0 and huge limits as none, with a note."""
    for velocity in ("-1", "-0.5", "inf", "0"):
        chain = read_urdf(with_limit("revolute", f'lower="-1" upper="1" velocity="{velocity}"'))
        assert chain.joints[2].velocity == INF
        assert chain.notes == (f"velocity of joint 'j3' is {float(velocity):g}: taken as not given",)
    for huge in ("1e16", "2147483648", "1.8e308", "inf", "1e6"):
        chain = read_urdf(with_limit("revolute", f'lower="-{huge}" upper="{huge}"'))
        assert (chain.joints[2].lower, chain.joints[2].upper) == (-INF, INF)
        assert all(note.endswith("rad: taken as none") for note in chain.notes) and len(chain.notes) == 2
        chain = read_urdf(with_limit("revolute", f'lower="-1" upper="{huge}"'))
        assert (chain.joints[2].lower, chain.joints[2].upper) == (-1.0, INF)


def limited(lower: float, upper: float) -> Chain:
    """The chain of PLAIN with these limits (rad) of all joints."""
    return read_urdf(PLAIN.with_(lower=[lower] * 7, upper=[upper] * 7).to_urdf())


def test_limits_that_cannot_be_meant_are_noted():
    """`describe_chain` notes limits that are all 0, or look like degrees."""
    assert describe_chain(limited(0.0, 0.0))[1].notes == (
        "all limits are 0 to 0, so that no joint may move: state the true ones",
    )
    with pytest.warns(UserWarning, match="limits look like degrees"):
        chain = limited(-170.0, 170.0)
    (note,) = describe_chain(chain)[1].notes
    assert note.startswith("limits look like degrees where rad are wanted: joint 'joint_1' -170 to 170, ")
    assert describe_chain(limited(-2 * np.pi, 6 * np.pi))[1].notes == ()


def test_limits_of_an_arm_that_look_like_degrees_are_noted():
    """`with_` limits that look like degrees warns and notes it, until they are changed."""
    with pytest.warns(UserWarning, match="limits look like degrees"):
        arm = PLAIN.with_(lower=-170, upper=170)
    (note,) = set(arm.geometry.notes) - set(PLAIN.geometry.notes)
    assert note.startswith("limits look like degrees where rad are wanted: joint ")
    other = arm.with_(upper=175).geometry.notes
    assert other.count(note) == 0 and len(other) == len(arm.geometry.notes)
    assert arm.with_(lower=-2.9, upper=2.9).geometry.notes == PLAIN.geometry.notes


def test_lengths_of_an_arm_that_look_like_mm_are_noted():
    """`with_` lengths that look like mm warns and notes it, until they are changed."""
    with pytest.warns(UserWarning, match="lengths look like mm where m are wanted: d_bs 340, d_se 400$"):
        arm = PLAIN.with_(d_bs=340, d_se=400)
    (note,) = set(arm.geometry.notes) - set(PLAIN.geometry.notes)
    assert note.startswith("lengths look like mm")
    assert len(arm.with_(d_wf=0.2).geometry.notes) == len(arm.geometry.notes)
    assert arm.with_(d_bs=0.34, d_se=0.4).geometry.notes == PLAIN.geometry.notes


LEFTOVERS = (
    '<xacro:property name="width" value=".2"/>',
    '<xacro:arg name="a" default="b"/>',
    '<xacro:macro name="unused"><link name="a"/><joint name="b"/></xacro:macro>',
    '<xacro:nowhere_defined name="gripper"/>',
    '<xacro:include filename="materials.xacro"/>',
    '<xacro:if value="1"><gazebo/></xacro:if>',
    '<link name="x"><xacro:inertia m="1"/></link>',
    "<gazebo><xacro:unused_too/></gazebo>",
)


def test_a_tag_of_xacro_that_makes_no_joint_is_left_out():
    """`read_urdf` leaves out tags of xacro that make no joint, with a note."""
    plain, q = read_urdf(simple_urdf()), np.linspace(-1, 1, 7)
    for leftover in LEFTOVERS:
        chain = read_urdf(simple_urdf(leftover), "l0", "l7")
        tag = re.findall(r"<(xacro:\w+)", leftover)[0]
        assert chain.notes == (f"<{tag}> in line 18 is left over from xacro: left out",)
        np.testing.assert_array_equal(chain.forward(q), plain.forward(q))
    (note,) = read_urdf(simple_urdf(LEFTOVERS[0] * 5), "l0", "l7").notes
    assert "<xacro:property> in line 18 and 4 more" in note


def test_a_macro_that_is_called_is_named_with_its_line(tmp_path):
    """`read_urdf` raises for a call of a xacro macro, with its line."""
    path = tmp_path / "arm.urdf"
    macro = '<xacro:macro name="arm">\n<link name="a"/>\n</xacro:macro>'
    path.write_text(f"<robot>\n{macro}\n <xacro:arm/>\n</robot>")
    with pytest.raises(ModelError) as caught:
        read_urdf(path)
    assert str(caught.value).startswith(f"{path}:5:2: <xacro:arm> calls a macro: this is xacro, not URDF")


def test_a_file_is_judged_by_what_it_holds_and_not_by_its_name(tmp_path):
    """`read_urdf` reads plain URDF in a file named .xacro."""
    path = tmp_path / "arm.urdf.xacro"
    path.write_text(simple_urdf())
    assert len(read_urdf(path).joints) == 7


@pytest.mark.parametrize("start", ["\n", "\r\n\t ", "\ufeff", "\ufeff\n\n"])
def test_blank_lines_may_come_first_in_text_bytes_and_files(start, tmp_path):
    """`read_urdf` takes blanks before the XML, and counts lines with them."""
    text = start + '<?xml version="1.0" encoding="utf-8"?>\n' + simple_urdf()
    path = tmp_path / "arm.urdf"
    path.write_bytes(text.encode())
    sources: tuple[Source, ...] = (text, text.encode(), path)
    for source in sources:
        assert len(read_urdf(source).joints) == 7
    wrong = text.replace("<link", "<link/><link", 1)
    for source in (wrong, wrong.encode()):
        with pytest.raises(ModelError) as caught:
            read_urdf(source)
        assert caught.value.line == 3 + start.count("\n")


@pytest.mark.parametrize("ends", [("world", "l0"), ("l0", "lost"), ("here", "there")])
def test_a_joint_at_a_link_that_is_not_there_is_left_out(ends):
    """`read_urdf` leaves out a joint at a missing link, with a note."""
    text = simple_urdf(joint_xml("dangling", *ends, "fixed"))
    chain = read_urdf(text)
    lost = next(end for end in ends if not re.fullmatch(r"l\d", end))
    assert (chain.base, chain.tip) == ("l0", "l7")
    assert chain.notes == (f"joint 'dangling' names a link {lost!r} that is not there: left out",)


# near arms


@pytest.mark.parametrize("joint", [1, 6])
def test_an_offset_arm_is_named_only_where_there_is_one(joint):
    """The refusal of a near arm names an offset wrist or shoulder only if one would fit."""
    for off, named in ((shift(0.012, 0, 0), True), (shift(0, 0.012, 0), False)):
        with pytest.raises(ModelError) as caught:
            describe_chain(broken_chain(joint, off))
        assert caught.value.near and ("but for an offset" in str(caught.value)) is named


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_the_fitted_arm_is_nearer_than_the_snapped_one_and_a_minimum(seed):
    """The arm fitted to a near chain has the least error over its lengths and frames."""
    rng = np.random.default_rng(seed)
    chain = broken_chain(0, np.eye(4), seed)
    for joint in (1, 2, 4, 6):
        moved = list(chain.joints)
        axis = rng.normal(size=3)
        frame = turn(axis / np.linalg.norm(axis), rng.normal(scale=3e-3))
        frame[:3, 3] = rng.normal(scale=4e-3, size=3)
        moved[joint] = type(moved[joint])(f"j{joint}", frame @ moved[joint].origin, moved[joint].axis)
        chain = Chain(chain.name, chain.base, chain.tip, tuple(moved), chain.tip_origin)
    arm, report = describe_chain(chain, length=0.1, angle=0.1)
    q = rng.uniform(-np.pi, np.pi, (2000, 7))

    def mean_square(candidate: aa.Arm) -> float:
        """The mean squared error (m²) of an arm's poses."""
        difference = candidate.forward(q)[0] - chain.forward(q)
        turned = np.linalg.norm(difference[:, :3, :3], axis=(1, 2)) ** 2 / 2
        return float(
            (difference[:, :3, 3] ** 2).sum(axis=1).mean() + (candidate.geometry.reach**2 * turned).mean()
        )

    fitted = aa.Arm._from_description(arm)
    least = mean_square(fitted)
    for name in ("d_se", "d_ew", "a_3", "a_4", "d_4"):
        for step in (-8e-3, 8e-3):
            assert mean_square(fitted.with_(**{name: getattr(fitted.geometry, name) + step})) > least
    for frame in (shift(8e-3, 0, 0), shift(0, 0, -8e-3), turn(Z, 16e-3)):
        assert mean_square(fitted.with_(base=fitted.base @ frame)) > least
        assert mean_square(fitted.with_(tool=frame @ fitted.tool)) > least
    assert report.residual_position < 0.1


def test_an_exact_arm_is_its_own_fit():
    """`fit` of an exact arm to its own chain gives its lengths."""
    chain = read_urdf(aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.35, d_wf=0.1, a_3=0.03, a_4=-0.02).to_urdf())
    arm, _ = describe_chain(chain)
    again = fit(arm, chain)
    for name in ("d_se", "d_ew", "a_3", "a_4", "d_4"):
        assert getattr(again, name) == pytest.approx(getattr(arm, name), abs=1e-12)


FITTED = {
    # file: residual of the arm snapped at q = 0 in mm, and of the fitted one, as measured before
    "kinova_gen3_7dof": (49.6, 30.4),
    "kuka_iiwa14_rosi": (0.9, 0.65),
}


@pytest.mark.parametrize("name", FITTED)
def test_a_real_near_arm_is_fitted(name):
    """The residual of a real nearly S-R-S arm after the fit is as small as measured before."""
    snapped, fitted = FITTED[name]
    _, report = describe_chain(read_urdf(model(name)), length=0.03)
    assert 1e3 * report.residual_position <= fitted < snapped


def test_nearness_names_both_bounds():
    """`nearness` gives the largest miss (m) and tilt (rad) of axes."""
    found = nearness(Axes(*broken_chain(1, shift(0, 0.013, 0) @ turn(X, 4e-4)).lines()))
    assert (found.srs, found.near) == (False, True)
    assert found.miss == pytest.approx(0.013, rel=0.02) and found.tilt == pytest.approx(4e-4)
    assert NEAR_ANGLE > 4e-4


# the small files of the findings


READ = (
    "01_rpy_wrist_d_ew_0.urdf", "02_velocity_minus_1.urdf", "03_xacro_leftover.urdf", "05_lift_arm.urdf",
    "08_limit_1e16.urdf", "09_limits_all_zero.urdf", "10_limits_in_degrees.urdf", "11_newline_first.urdf",
    "12_parent_world_undeclared.urdf", "13_no_xacro_in_it.urdf.xacro", "14_velocity_inf.urdf",
)  # fmt: skip


@pytest.mark.parametrize("name", READ)
def test_each_case_is_read_and_met(name):
    """`from_urdf` of each small case has the file's poses, with a note if the file is odd."""
    arm = aa.Arm.from_urdf(case(name))
    report = arm.report
    assert report is not None and report.residual_position <= 1e-9
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (100, 7))
    chain = read_urdf(case(name), report.base, report.tip)
    np.testing.assert_allclose(arm.forward(q)[0], chain.forward(q), atol=1e-9)
    quiet = name in ("01_rpy_wrist_d_ew_0.urdf", "11_newline_first.urdf", READ[9])
    assert bool(arm.geometry.notes) is not quiet


def test_a_near_arm_keeps_its_elbow_offset():
    """The fitted arm of a near file keeps its elbow offset for either tolerance."""
    file = case("07_near_with_elbow_offset.urdf")
    arms = [aa.Arm.from_urdf(file, fit="srs", length_tolerance=length) for length in (0.0196, 0.0201)]
    assert arms[0] == arms[1]
    assert 0.015 < arms[0].geometry.a_3 < 0.045


def test_mjcf_needs_no_meshes():
    """`from_mjcf` reads a model whose meshes are missing; six hinges are refused."""
    need("mujoco")
    arm = aa.Arm.from_mjcf(case("16_mjcf_mesh_missing.xml"))
    assert (arm.geometry.d_bs, arm.geometry.d_se, arm.geometry.d_ew) == pytest.approx((0.3, 0.4, 0.39))
    with pytest.raises(aa.ArmangleError, match="no chain of 7 rotating joints is found") as caught:
        read_mjcf(case("17_mjcf_six_hinges.xml"))
    assert "not unique" not in str(caught.value)


# arms with an offset wrist or shoulder: the same options, notes and report


def test_an_offset_arm_has_the_notes_that_an_arm_has():
    """`from_urdf` of an offset arm notes and warns as for an S-R-S arm."""
    text = FR3.to_urdf()
    speeds = re.sub(r'velocity="[^"]*"', 'velocity="-1"', text)
    wide = re.sub(r'(lower|upper)="(-?)[^"]*"', r'\1="\g<2>1e16"', text)
    none = re.sub(r'(lower|upper)="[^"]*"', r'\1="0"', text)
    left = text.replace("<link", '<xacro:property name="a" value="1"/><link', 1)
    for changed, what, count in (
        (speeds, "taken as not given", 7), (wide, "taken as none", 14), (none, "all limits are 0 to 0", 1),
        (left, "<xacro:property> in line", 1), (text, "", 0),
    ):  # fmt: skip
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            arm = aa.Arm.from_urdf(changed)
        assert [str(one.message) for one in caught] == [
            note for note in arm.geometry.notes if "0 to 0" in note
        ]
        assert arm.report is not None and arm.report.notes == arm.geometry.notes
        assert len(arm.geometry.notes) == count and all(what in note for note in arm.geometry.notes)
        assert arm.with_(name="mine").report == arm.report
    report = aa.Arm.from_urdf(text).report
    assert report is not None and report.residual_position <= 1e-9
    assert report.wrist_miss == pytest.approx(FR3.geometry.a_6, abs=1e-9)
    assert (
        FR3.report is None
        and FR3.geometry.reach == FR3._rows.geometry.reach
        and FR3.geometry.d_se == FR3._rows.geometry.d_se
    )


def calibrated(arm: aa.Arm, seed: int = 0) -> Chain:
    """Return an arm's chain with joint frames that are off by some 0.5 mm and 1 mrad."""
    rng, chain = np.random.default_rng(seed), read_urdf(arm.to_urdf())
    joints = list(chain.joints)
    for i, joint in enumerate(joints):
        axis = rng.normal(size=3)
        frame = turn(axis / np.linalg.norm(axis), rng.normal(scale=1e-3))
        frame[:3, 3] = rng.normal(scale=5e-4, size=3)
        joints[i] = replace(joint, origin=frame @ joint.origin)
    return replace(chain, joints=tuple(joints))


@pytest.mark.parametrize("seed", range(3))
def test_a_calibrated_arm_keeps_its_chain_and_tolerances_idealise_it(seed: int) -> None:
    """`load` of a calibrated offset arm keeps its chain; tolerances make it ideal with its residual."""
    chain = calibrated(FR3, seed)
    text = write_chain(chain, "calibrated")
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (500, 7))
    own = aa.Arm.load(text)
    assert own.kind == "offset_wrist_chain" and own.report is not None
    assert own.report.residual_position == 0.0
    assert "only nearly S-R-S but for an offset wrist, a_6 = " in own.report.notes[-1]
    np.testing.assert_allclose(own.forward(q)[0], chain.forward(q), rtol=0, atol=1e-12)
    length = 5e-3
    with pytest.warns(UserWarning, match="not quite the arm of its file: .* at the tip") as warned:
        arm = aa.Arm.from_urdf(text, length_tolerance=length, angle_tolerance=5e-3)
    assert warned[0].filename == __file__
    report = arm.report
    assert report is not None and report.notes == (str(warned[0].message),) == arm.geometry.notes
    assert 1e-4 < report.residual_position <= length
    apart = np.linalg.norm((arm.forward(q)[0] - chain.forward(q))[:, :3, 3], axis=-1)
    assert 0.5 * report.residual_position < apart.max() <= report.residual_position


def beside(length: float, angle: float = 0.0) -> str:
    """Return the URDF of an arm whose axes 1 and 3 meet axis 2 `length` (m) apart, turned by `angle` (rad)
    there.
    """
    chain = broken_chain(1, shift(0, length, 0) @ turn(X, angle))
    return write_chain(
        replace(chain, joints=tuple(replace(j, lower=-3.0, upper=3.0) for j in chain.joints)), "a"
    )


DOORS = {"gen3": (0.01175, 0.0), "tilted": (0.013, 4e-4), "a hair": (0.0009, 0.0), "far": (0.13, 0.0)}


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", DOORS)
def test_a_near_arm_keeps_its_chain_and_is_idealised_only_where_asked(name: str) -> None:
    """`from_urdf` of a near arm keeps its chain; fit="srs" makes it ideal, warns and states the residual."""
    text = beside(*DOORS[name])
    chain = read_urdf(text)
    if name == "far":
        for fit_to in ("own", "srs"):
            with pytest.raises(ModelError) as caught:
                aa.Arm.from_urdf(text, fit=fit_to)
            assert not re.findall(r"_tolerance=|fit=", str(caught.value))  # nothing takes it
        return
    q = np.random.default_rng(1).uniform(-3, 3, (300, 7))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        own = aa.Arm.from_urdf(text)
    assert own.kind == "srs_chain" and own.deviation.position_max > 1e-4
    np.testing.assert_allclose(own.forward(q, on_error="nan")[0], chain.forward(q), rtol=0, atol=1e-12)
    with pytest.warns(UserWarning, match="not quite the arm of its file: .* at the tip") as caught:
        ideal = aa.Arm.from_urdf(text, fit="srs")
    assert ideal.kind == "srs" and ideal.report is not None
    assert len(caught) == 1 and caught[0].filename == __file__
    assert str(caught[0].message) in ideal.report.notes and ideal.geometry.notes == ideal.report.notes
    assert f"{1e3 * ideal.report.residual_position:.4g} mm" in str(caught[0].message)
    apart = np.linalg.norm((ideal.forward(q)[0] - chain.forward(q))[:, :3, 3], axis=-1).max()
    assert 1e-4 < apart <= ideal.report.residual_position * (1 + 1e-6)
    with pytest.raises(ModelError) as refused:
        aa.Arm.from_urdf(text, fit="srs", length_tolerance=1e-4, angle_tolerance=1e-4)
    assert refused.value.near and 'fit="own" takes it as it is' in str(refused.value)


ODD = {
    # frames before joints, near, which doors are named
    "axes 2 and 3": ({2: shift(0.04, 0, 0.1)}, None, True),
    "wrist alone": ({6: shift(0.08, 0, 0)}, None, True),
    "wrist and shoulder": ({1: shift(0.014, 0, 0), 2: shift(0.006, 0, 0.08), 6: shift(0.046, 0, 0)}, None,
     True),
    "both far": ({1: shift(0.07, 0, 0), 6: shift(0.06, 0, 0)}, None, True),
    "thirty in two ways": ({1: shift(0.03, 0, 0), 2: shift(-0.03, 0, 0.1)}, None, True),
    "beyond": ({1: shift(0.2, 0, 0), 6: shift(0.13, 0, 0)}, False, False),
    "13 mm": ({1: shift(0, 0.013, 0)}, True, True), "0.3 deg alone": ({5: turn(X, 5e-3)}, True, True),
    "13 mm and 0.02 deg": ({1: shift(0, 0.013, 0) @ turn(X, 4e-4)}, True, True),
    "29 mm": ({2: shift(0, 0.029, 0)}, True, True), "50 mm": ({2: shift(0, 0.05, 0)}, True, True),
    "51 mm": ({2: shift(0, 0.051, 0)}, False, None), "1.9 deg": ({6: turn(X, np.radians(1.9))}, True, True),
    "2.1 deg": ({6: turn(X, np.radians(2.1))}, False, None),
}  # fmt: skip


@pytest.mark.turns(8)
@pytest.mark.slow
@pytest.mark.parametrize("name", ODD)
def test_every_door_that_a_refusal_names_takes_the_file_with_the_error_that_it_names(name: str) -> None:
    """Each call that a refusal names takes the file, with an error no larger than it names."""
    frames, near, named = ODD[name]
    chain = broken_chain(0, np.eye(4))
    joints = list(chain.joints)
    for at, frame in frames.items():
        joints[at] = replace(joints[at], origin=joints[at].origin @ frame)
    chain = replace(chain, joints=tuple(replace(j, lower=-3.0, upper=3.0) for j in joints))
    text = write_chain(chain, "odd")
    with pytest.raises(ModelError) as caught:
        aa.Arm.from_urdf(text, fit="srs", length_tolerance=2e-5, angle_tolerance=1e-5)
    why, *doors = str(caught.value).splitlines()
    assert all(reason in why for reason in caught.value.reasons)
    assert near is None or caught.value.near is near is ("but near it: nothing is off by more than" in why)
    assert named is None or bool(doors) is named
    q = np.random.default_rng(1).uniform(-3, 3, (300, 7))
    for door in doors:
        given = {key: float(value) for key, value in re.findall(r"(\w+_tolerance)=([^ ,)]+)", door)}
        off = re.search(r"up to (\S+) mm and \S+ (?:deg|rad) at the tip", door)
        fit: Literal["own", "srs"] = "own" if 'fit="own"' in door else "srs"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            arm = aa.Arm.from_urdf(text, **given, fit=fit)
        apart = 1e3 * np.linalg.norm((arm.forward(q)[0] - chain.forward(q))[:, :3, 3], axis=-1).max()
        said = 0.0 if off is None else float(off[1])
        assert apart <= 1.01 * said + 1e-9, door
        if near and off is not None and arm.report is not None:
            assert said == pytest.approx(1e3 * arm.report.residual_position, rel=1e-2)


def test_a_real_file_that_is_near_keeps_its_chain() -> None:
    """`from_urdf` of real near files keeps their chain; fit="srs" with a small tolerance raises."""
    for file in (model("kinova_gen3_7dof"), case("15_tilt_0.02_deg_and_13_mm.urdf")):
        with pytest.raises(ModelError, match='fit="own" takes it as it is'):
            aa.Arm.from_urdf(file, fit="srs", length_tolerance=1e-4)
        assert aa.Arm.from_urdf(file).geometry.chain is not None


def test_a_joint_that_moves_the_base_is_noted() -> None:
    """`from_urdf` notes a joint below the base."""
    text = PLAIN.with_(lower=-1, upper=1).to_urdf()
    lift = (
        '<link name="foot"/><joint name="lift" type="prismatic"><parent link="foot"/><child link="base"/>'
        '<axis xyz="0 0 1"/><limit lower="0" upper="0.4" velocity="1" effort="1"/></joint>'
    )
    lifted = text.replace("</robot>", f"{lift}</robot>")
    note = "joint 'lift' moves the base 'base': no part of the arm"
    for base in (None, "base"):
        assert aa.Arm.from_urdf(lifted, base).report.notes == (note,)
    assert aa.Arm.from_urdf(text).report.notes == ()
    assert aa.Arm.from_urdf(FR3.to_urdf().replace("</robot>", f"{lift}</robot>")).geometry.notes == (note,)


def test_a_joint_that_moves_the_base_of_a_model_is_noted() -> None:
    """`read_mjcf` notes a joint below the base."""
    need("mujoco")
    slide = (
        '<joint name="lift" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    )
    for inside, notes in ((slide, ("joint 'lift' moves the base 'torso': no part of the arm",)), ("", ())):
        text = hinges(0, 0).replace('<body name="torso">', f'<body name="torso">{inside}')
        assert read_mjcf(text, base="torso", tip="tip").notes == notes


def test_limits_of_a_file_that_cannot_be_meant_are_warned_of() -> None:
    """`from_urdf` and `load` warn once of limits that are all 0, or look like degrees."""
    none = re.sub(r'(lower|upper)="[^"]*"', r'\1="0"', PLAIN.with_(lower=-1, upper=1).to_urdf())
    degrees = none.replace('lower="0"', 'lower="-170"').replace('upper="0"', 'upper="170"')
    for text, said in ((none, "all limits are 0 to 0"), (degrees, "limits look like degrees")):
        for door in (aa.Arm.from_urdf, aa.Arm.load):
            with pytest.warns(UserWarning, match=said) as caught:
                arm = door(text)
            assert (
                len(caught) == 1
                and caught[0].filename == __file__
                and str(caught[0].message) in arm.geometry.notes
            )


def test_an_offset_arm_is_not_idealised():
    """`from_urdf` of an offset arm keeps the offset; fit="srs" needs a large tolerance and warns."""
    assert aa.Arm.from_urdf(FR3.to_urdf()).geometry.a_6 == pytest.approx(FR3.geometry.a_6)
    with pytest.raises(ModelError, match='fit="own" takes it: it is S-R-S but for an offset wrist'):
        aa.Arm.from_urdf(FR3.to_urdf(), fit="srs", length_tolerance=0.01)
    with pytest.warns(UserWarning, match="not quite the arm of its file: .* at the tip"):
        assert aa.Arm.from_urdf(FR3.to_urdf(), fit="srs").kind == "srs"
    with pytest.raises(InputError, match="fit is 'exact', wanted"):
        aa.Arm.from_urdf(FR3.to_urdf(), fit="exact")  # type: ignore[arg-type]  # wrong on purpose


# every door leads to the same arm, whatever its kind


KINDS = {
    "kuka_iiwa7_r800": ("srs", "arm_angle"),
    "barrett_wam7": ("srs", "arm_angle"),
    "franka_fr3": ("offset_wrist", "joint_7"),
    "willow_garage_pr2_left": ("offset_shoulder", "joint_1"),
}


@pytest.mark.parametrize("name", KINDS)
def test_each_door_gives_the_arm_of_the_file(name: str, tmp_path: Path) -> None:
    """`load` of a path, text, bytes or object gives the arm of every kind, with or without ends."""
    arm = aa.Arm.load(name)
    assert (arm.kind, arm.redundancy) == KINDS[name] and arm == aa.Arm.from_catalogue(name)
    text = arm.to_urdf()
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    chain = read_urdf(text, "base", "tip")
    q = np.random.default_rng(0).uniform(-3, 3, (200, 7))
    np.testing.assert_allclose(arm.forward(q, on_error="nan")[0], chain.forward(q), rtol=0, atol=1e-12)
    writes = {"to_xml": lambda: text}, {"write_xml_string": lambda: text.encode()}
    sources: tuple[Any, ...] = (
        path,
        str(path),
        text,
        text.encode(),
        *(SimpleNamespace(**one) for one in writes),
    )
    for source in sources:
        for ends in ((), ("base", "tip")):
            again = aa.Arm.load(source, *ends)
            assert (again.kind, again.redundancy) == KINDS[name] and again.report is not None
            np.testing.assert_allclose(
                again.forward(q, on_error="nan")[0], chain.forward(q), rtol=0, atol=1e-12
            )
            assert np.array_equal([again.lower, again.upper], [arm.lower, arm.upper])
    middle = np.clip(0.0, arm.lower + 0.4, arm.upper - 0.4)
    poses = arm.forward(middle + 0.1 * q[:5])[0]
    found = again.solve(poses)
    assert found.ok.all()
    np.testing.assert_allclose(arm.forward(found.q)[0], poses, rtol=0, atol=1e-9)


@pytest.mark.parametrize("door", ["load", "from_mjcf"])
def test_a_model_of_mujoco_is_the_arm_of_its_bodies(door: str, tmp_path: Path) -> None:
    """`load` and `from_mjcf` of a model give the kind and MuJoCo's own poses."""
    mujoco = need("mujoco")
    for beside_6, beside_2, kind in ((0, 0, "srs"), (0.08, 0, "offset_wrist"), (0, 0.002, "srs_chain")):
        xml = hinges(beside_6, beside_2)
        model_of = mujoco.MjModel.from_xml_string(xml)
        path = tmp_path / "arm.xml"
        path.write_text(xml)
        sources: list[Any] = [xml, path, str(path)]
        if door == "load":
            sources += [mujoco.MjSpec.from_string(xml), xml.encode()]
        data = mujoco.MjData(model_of)
        for source in sources:
            arm = getattr(aa.Arm, door)(source, "torso", "tip")
            assert arm.kind == kind and arm.redundancy == (
                "joint_7" if kind == "offset_wrist" else "arm_angle"
            )
            for q in np.random.default_rng(0).uniform(-1.5, 1.5, (5, 7)):
                data.qpos[:] = q
                mujoco.mj_kinematics(model_of, data)
                pose = arm.forward(q)[0]
                np.testing.assert_allclose(pose[:3, 3], data.body("tip").xpos, rtol=0, atol=1e-12)
                np.testing.assert_allclose(pose[:3, :3].ravel(), data.body("tip").xmat, rtol=0, atol=1e-12)


def hinges(beside_6: float, beside_2: float) -> str:
    """Return the MJCF of seven hinges: axis 7 is `beside_6` (m) off axis 6, axis 3 meets axis 2 `beside_2`
    off axis 1.
    """
    bodies, ends = "", ""
    axes = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
    for i, (z, axis) in enumerate(zip((0.3, 0, 0, 0.4, 0, 0.4, 0), axes, strict=True)):
        joint = f'<joint name="j{i}" axis="{axis}"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        bodies += f'<body name="b{i}" pos="{beside_6 * (i == 6)} {beside_2 * (i == 2)} {z}">{joint}'
        ends += "</body>"
    arm = f'{bodies}<body name="tip" pos="0 0 0.1"/>{ends}'
    return f'<mujoco><worldbody><body name="torso">{arm}</body></worldbody></mujoco>'


def test_what_is_no_arm_is_told_at_the_door(tmp_path: Path) -> None:
    """`load` refuses unknown names, missing files and other types, and says so."""
    with pytest.raises(InputError, match=r"no robot 'franka_fr33'; did you mean 'franka_fr3'"):
        aa.Arm.load("franka_fr33")
    for missing in (tmp_path / "none.urdf", str(tmp_path / "none.urdf"), "none.urdf"):
        with pytest.raises(ModelError, match=r"none\.urdf: no such file"):
            aa.Arm.load(missing)
    for nothing in (0, 3, None, object()):  # 0 is the standard input, were it opened
        with pytest.raises(InputError, match=r"^source is .*, wanted the path of a file"):
            aa.Arm.load(nothing)  # type: ignore[arg-type]  # wrong on purpose


def test_a_nearly_srs_arm_is_fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """`from_urdf` of a nearly S-R-S arm calls `fit` once."""
    calls = []
    monkeypatch.setattr(
        "armangle.models.detect.fit", lambda *given, **more: calls.append(given) or fit(*given, **more)
    )
    chain = broken_chain(5, shift(0.001, 0.001, 0.0) @ turn(X, 1e-3))
    assert aa.Arm.from_urdf(write_chain(chain, "broken")).kind == "srs_chain"
    assert len(calls) == 1
