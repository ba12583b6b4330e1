"""The catalogue: every entry, entries against the files they come from, and every message."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest
from support.chain import dh_forward, pose_error, shift, urdf_forward
from support.chains import read_urdf
from support.needs import model
from support.refused import not_refused

from armangle import Arm
from armangle.errors import InputError, ModelError
from armangle.models.catalogue import (
    CatalogueEntry,
    catalogue,
    load_robot,
    offset_catalogue,
    read_robot,
    robot_toml,
    srs_catalogue,
)
from armangle.models.chain import chain_of
from armangle.models.description import ArmDescription, OffsetDescription
from armangle.models.detect import describe_chain
from armangle.models.one_offset import describe_offset_chain
from armangle.models.urdf import write_urdf
from armangle.models.urdf.writing import write_chain

EXACT_ARMS = {
    # name: d_bs, d_se, d_ew, d_wf in m, signs
    "kuka_iiwa7_r800": (0.34, 0.4, 0.4, 0.126, "+++++++"),
    "kuka_iiwa14_r820": (0.36, 0.42, 0.4, 0.126, "+++++++"),
    "kuka_med7_r800": (0.34, 0.4, 0.4, 0.126, "+++++++"),
    "kuka_med14_r820": (0.3595, 0.42, 0.4, 0.126, "+++++++"),
    "kuka_lwr4_plus": (0.3105, 0.4, 0.39, 0.078, "+-+-+-+"),
    "mitsubishi_pa10": (0.315, 0.45, 0.5, 0.08, "+++-+++"),
    "schunk_lwa4d": (0.24, 0.328, 0.323, 0.0824, "+++-+++"),
    "rokae_xmate_er3_pro": (0.3426, 0.3929, 0.3656, 0.2509, "+++-+++"),
    "rokae_xmate_er7_pro": (0.404, 0.3929, 0.3656, 0.2509, "+++-+++"),
    "realman_rm75_b": (0.2405, 0.256, 0.21, 0.144, "+++-+++"),
    "yaskawa_sia10d": (0.36, 0.36, 0.36, 0.155, "++++---"),
    "yaskawa_sia20d": (0.41, 0.49, 0.42, 0.18, "++++---"),
    "openarm_v10": (0.1225, 0.22, 0.216, 0.0205, "++++++-"),
    "human_arm_right": (0.21, 0.276, 0.287, 0.0, "++-+--+"),
    "human_arm_left": (0.21, 0.276, 0.287, 0.0, "-++++-+"),
    "agilex_nero": (0.138, 0.31, 0.27, 0.0235, "+-+++++"),
    "elephant_myarm_300_pi": (0.165, 0.11, 0.126, 0.056, "+++++-+"),
    "yaskawa_sia30d": (0.598, 0.875, 0.61, 0.217, "++++---"),
    "aldebaran_romeo_left": (0.1721, 0.205, 0.1823, 0.0, "+-+++-+"),
    "aldebaran_romeo_right": (0.1721, 0.205, 0.1823, 0.0, "-++-+++"),
    "simple_humanoid_left": (0.21, 0.263, 0.247, 0.0, "++-+--+"),
    "simple_humanoid_right": (0.21, 0.263, 0.247, 0.0, "-+-+--+"),
    "fourier_gr2t2_left": (0.23, 0.2555, 0.2185, 0.0, "++-+--+"),
    "fourier_gr2t2_right": (0.23, 0.2555, 0.2185, 0.0, "-+-+--+"),
    "fourier_gr2t2d_left": (0.23, 0.34, 0.261, 0.0, "++-+--+"),
    "fourier_gr2t2d_right": (0.23, 0.34, 0.261, 0.0, "-+-+--+"),
    "fourier_gr2t2v2_left": (0.23, 0.2555, 0.21955, 0.0, "++-+--+"),
    "fourier_gr2t2v2_right": (0.23, 0.2555, 0.21955, 0.0, "-+-+--+"),
    "schunk_lwa4p_extended": (0.2305, 0.4536, 0.2986, 0.0, "+-+++-+"),
    "galaxea_r1_pro_left": (0.154765, 0.31, 0.25805, 0.0, "++-+--+"),
    "galaxea_r1_pro_right": (0.154765, 0.31, 0.25805, 0.0, "-+-+--+"),
}
OFFSET_ARMS = {
    "barrett_wam7": (0.346, 0.55, 0.3, 0.06, 0.045, -0.045),
    "yaskawa_sia5d": (0.31, 0.27, 0.27, 0.145, 0.085, -0.06),
    "rokae_ar5_left": (0.1745, 0.314, 0.272, 0.0, 0.01, -0.01),
    "rokae_ar5_right": (0.1745, 0.314, 0.272, 0.0, 0.01, -0.01),
    "rainbow_rby1_left": (0.23412, 0.276, 0.256, 0.1548, 0.031, -0.031),
    "rainbow_rby1_right": (0.23412, 0.276, 0.256, 0.1548, 0.031, -0.031),
    "rainbow_rby1_leader_left": (0.140955, 0.196, 0.1765, 0.0, 0.031, -0.031),
    "rainbow_rby1_leader_right": (0.140955, 0.196, 0.1765, 0.0, 0.031, -0.031),
    "pollen_reachy2_left": (0.19025, 0.28, 0.0, 0.1, 0.0, -0.28),
    "iit_icub_left": (0.10786, 0.15228, 0.1373, 0.0, -0.015, 0.015),
    "iit_icub_right": (0.10786, 0.15228, 0.1373, 0.0, 0.015, -0.015),
    "iit_icub_2_5_right": (0.10699, 0.15906, 0.1423, 0.02505, 0.015, -0.015),
    "jvrc1_left": (0.24, 0.305, 0.239, 0.0, 0.004, -0.004),
    "jvrc1_right": (0.24, 0.305, 0.239, 0.0, 0.004, -0.004),
    "openloong_left": (0.2026, 0.3, 0.30025, 0.0008, -0.024, 0.024),
    "openloong_right": (0.2026, 0.3, 0.30025, 0.0008, -0.024, 0.024),
    "kinova_movo": (0.18125, 0.41, 0.31105, 0.26375, 0.0, 0.0, 0.0114),
}
FILES = {
    # name: file, tip of the entry in the tip of the file, position (m) and rotation (rad) agreed
    "kuka_iiwa7_r800": ("kuka_iiwa7_r800", 0.0, 1e-9, 1e-9),
    "kuka_iiwa14_r820": ("kuka_iiwa14_r820_official", -0.026, 1e-9, 1e-9),
    "schunk_lwa4d": ("schunk_lwa4d", 0.0, 1e-9, 1e-9),
    "rokae_xmate_er3_pro": ("rokae_xmate_er3_pro", 0.0, 1e-9, 1e-9),
    "realman_rm75_b": ("realman_rm75", 0.0, 6e-6, 2.6e-5),
    "openarm_v10": ("openarm_v10", 0.0, 1.001e-6, 1e-9),
    "yaskawa_sia5d": ("yaskawa_sia5d", 0.0, 1e-9, 1e-7),
}
LENGTHS = ("d_bs", "d_se", "d_ew", "d_wf")


def test_names_are_those_of_the_known_robots():
    assert srs_catalogue() == tuple(sorted([*EXACT_ARMS, *OFFSET_ARMS]))
    assert catalogue() == tuple(sorted([*srs_catalogue(), *SPECIAL_ARMS]))


def test_words_find_names():
    """`catalogue(words)` returns the names that hold all words."""
    assert len(catalogue()) >= 35
    assert catalogue("") == catalogue()
    assert catalogue("Yaskawa") == tuple(f"yaskawa_sia{model}d" for model in ("10", "20", "30", "50", "5"))
    assert catalogue("right rainbow") == ("rainbow_rby1_leader_right", "rainbow_rby1_right")
    assert catalogue("sia-5") == ("yaskawa_sia50d", "yaskawa_sia5d")
    assert catalogue("openarm 10") == ("openarm_v10",)
    assert catalogue("no such arm") == ()


def test_entries_have_their_numbers():
    """Every S-R-S entry has its published lengths and signs."""
    for name, (*lengths, signs) in EXACT_ARMS.items():
        arm = load_robot(name).description
        assert [getattr(arm, key) for key in LENGTHS] == pytest.approx(lengths, abs=5e-5), name
        assert (arm.a_3, arm.a_4) == (0.0, 0.0)
        assert "".join("+" if sign > 0 else "-" for sign in arm.signs) == signs, name
    for name, numbers in OFFSET_ARMS.items():
        arm = load_robot(name).description
        lengths = [getattr(arm, key) for key in (*LENGTHS, "a_3", "a_4", "d_4")]
        assert lengths == pytest.approx([*numbers, 0.0][:7], abs=5e-6), name


@pytest.mark.parametrize("name", catalogue())
def test_entry_says_what_it_is_and_what_was_compared(name):
    """Every entry has title, source, tip and limits, and a revision or a note of distrust."""
    entry = load_robot(name)
    assert isinstance(entry, CatalogueEntry) and entry.name == entry.description.name == name
    assert min(len(entry.title), len(entry.source), len(entry.tip)) > 8 and "://" not in entry.source
    arm = entry.description
    assert all(low < high for low, high in zip(arm.lower, arm.upper, strict=True))
    assert all(speed > 0.5 * math.radians(24) for speed in arm.velocity)
    doubts = (entry.lengths_trusted, entry.limits_trusted, entry.velocity_trusted)
    assert len(arm.notes) == doubts.count(False)
    # it was compared with a revision of its source, or is not trusted
    assert bool(entry.revision) == bool(re.search(r"\b[0-9a-f]{8}\b|release \d+\.\d+\.\d+$", entry.revision))
    assert entry.revision or not entry.limits_trusted
    assert entry.revision or not entry.lengths_trusted or name in offset_catalogue()
    speeds = [speed for speed in arm.velocity if math.isfinite(speed)]
    assert max(speeds, default=0.0) < 10.0 or not entry.velocity_trusted


def test_doubtful_numbers_are_marked():
    """Entries with doubtful lengths or velocities are not trusted, and noted."""
    assert not load_robot("rokae_xmate_er7_pro").lengths_trusted
    assert not load_robot("openarm_v10").velocity_trusted
    assert not load_robot("human_arm_right").velocity_trusted
    assert all(note.startswith("velocity not") for note in load_robot("openarm_v10").description.notes)


@pytest.mark.parametrize("name", FILES)
def test_entry_is_the_arm_of_its_file(name):
    """Every entry of FILES has the poses of its file, within the bounds stated there."""
    file, tip, position, rotation = FILES[name]
    path = model(file)
    chain = read_urdf(path)
    arm = load_robot(name).description
    names = [joint.name for joint in chain.joints]
    for q in np.random.default_rng(0).uniform(-np.pi, np.pi, (100, 7)):
        own = urdf_forward(path.read_text(), chain.tip, dict(zip(names, q, strict=True)))
        off, turned = pose_error(dh_forward(arm, q), own @ shift(0, 0, tip))
        assert off <= position
        assert turned <= rotation


def test_limits_and_speeds_that_sources_gave_newly():
    """Limits and velocities of some entries are those of their newer sources, or not trusted."""
    arm = load_robot("schunk_lwa4p_extended").description
    stops = [(-270, 270), (-110, 110), (-170, 170), (-150, 150), (-170, 170), (-140, 170), (-215, 127)]
    margin = math.radians(4)  # the source keeps 0.02 rad off its stops, and rounds these down to 0.01 rad
    for lower, upper, (low, high) in zip(arm.lower, arm.upper, stops, strict=True):
        assert math.radians(low) < lower < math.radians(low) + margin
        assert math.radians(high) - margin < upper < math.radians(high)
    assert arm.velocity == pytest.approx([0.66, 1.57, 1.57, 1.57, 1.57, 2.09, 2.09], abs=1e-3)
    speeds = load_robot("realman_rm75_b").description.velocity
    assert max(speeds) <= 3.14 and not load_robot("realman_rm75_b").velocity_trusted
    assert not load_robot("rokae_xmate_er3_pro").lengths_trusted
    myarm = load_robot("elephant_myarm_300_pi").description
    assert myarm.upper[3] <= 1.3089 and myarm.lower[1] >= -1.2217
    assert not load_robot("rainbow_rby1_left").limits_trusted
    assert not load_robot("rainbow_rby1_right").limits_trusted


@pytest.mark.parametrize("name", FILES)
def test_entry_has_the_limits_of_its_file(name):
    """Every entry of FILES has the limits of its file, and its velocities, or none larger if not trusted."""
    joints = read_urdf(model(FILES[name][0])).joints
    arm = load_robot(name).description
    tolerance = math.radians(0.003)
    assert arm.lower == pytest.approx([joint.lower for joint in joints], abs=tolerance)
    assert arm.upper == pytest.approx([joint.upper for joint in joints], abs=tolerance)
    speeds = [joint.velocity for joint in joints]
    if load_robot(name).velocity_trusted:
        assert arm.velocity == pytest.approx(speeds, rel=1e-3)
    else:
        assert all(own <= its * (1 + 1e-3) for own, its in zip(arm.velocity, speeds, strict=True))


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", srs_catalogue())
def test_entry_goes_through_urdf_and_toml_unchanged(name, tmp_path):
    """Every S-R-S entry written as URDF or TOML is read back unchanged."""
    arm = load_robot(name).description
    again, report = describe_chain(read_urdf(write_urdf(arm)))
    for key in (*LENGTHS, "a_3", "a_4", "d_4"):
        assert getattr(again, key) == pytest.approx(getattr(arm, key), abs=1e-9)
    assert again.signs == arm.signs
    assert again.offsets == pytest.approx(arm.offsets, abs=1e-9)
    np.testing.assert_allclose(again.base, arm.base, atol=1e-9)
    np.testing.assert_allclose(again.tool, arm.tool, atol=1e-9)
    assert (again.lower, again.upper) == (arm.lower, arm.upper)
    assert again.velocity == arm.velocity
    assert again.joint_names == arm.joint_names
    assert report.residual_position <= 1e-9
    written = toml_trip(arm, tmp_path / f"{name}.toml")
    for field in dataclasses.fields(arm):
        if field.name != "notes":
            np.testing.assert_array_equal(getattr(written, field.name), getattr(arm, field.name))


def test_written_toml_reads_back_whatever_the_numbers(tmp_path):
    """`robot_toml` of odd names, frames and infinite limits is read back."""
    rng = np.random.default_rng(4)
    arm = ArmDescription(
        *rng.uniform(0.1, 1, 6),
        name="odd",
        offsets=tuple(rng.uniform(-3, 3, 7)),
        base=shift(1, 2, 3),
        lower=(-np.inf, *rng.uniform(-3, 0, 6)),
        upper=(np.inf, *rng.uniform(0, 3, 6)),
        joint_names=('"', "\\", "\n", "é", "5", "6", "7"),
        notes=("first\nsecond",),
    )
    again = toml_trip(arm, tmp_path / "odd.toml")
    assert again.joint_names == arm.joint_names
    q = rng.uniform(-3, 3, 7)
    np.testing.assert_allclose(chain_of(again).forward(q), chain_of(arm).forward(q), atol=1e-14)
    np.testing.assert_allclose(again.lower, arm.lower, rtol=1e-15)


def toml_trip(arm: ArmDescription, path) -> ArmDescription:
    """Return the arm after writing it as TOML and reading it."""
    path.write_text(robot_toml(arm, title="Some arm", source="a test", tip='the "tip"'), "utf-8")
    entry = read_robot(path)
    assert (entry.title, entry.source, entry.tip) == ("Some arm", "a test", 'the "tip"')
    return entry.description


def test_short_decimals_are_written_as_such(tmp_path):
    """`robot_toml` writes numbers within 1e-12 of a short decimal as that decimal."""
    frame = np.eye(4)
    frame[:3, 3] = 3.0e-23, 0.1 + 2e-13, -4e-14
    arm = ArmDescription(
        0.24 + 5e-13, 0.4, 1 / 3, 0.1 + 2e-12, tool=frame, lower=(-3.0,) * 7,
        upper=(math.radians(170) + 3e-13,) * 7, offsets=(1e-13,) * 7, velocity=(math.inf,) * 7,
    )  # fmt: skip
    again = toml_trip(arm, tmp_path / "short.toml")
    text = (tmp_path / "short.toml").read_text("utf-8")
    for line in ("d_bs = 0.24", f"d_ew = {1 / 3!r}", f"d_wf = {0.1 + 2e-12!r}", "    [0.0, 0.0, 1.0, 0.0],"):
        assert line in text.splitlines()
    assert "[1.0, 0.0, 0.0, 0.0],\n    [0.0, 1.0, 0.0, 0.1]" in text
    assert "upper_deg = [170.0, 170.0" in text and "offsets_deg = [0.0, 0.0" in text
    assert f"lower_deg = [{math.degrees(-3.0)!r}, " in text
    for field in dataclasses.fields(ArmDescription):
        if field.name not in ("name", "joint_names", "notes", "reference"):
            ours, theirs = getattr(arm, field.name), getattr(again, field.name)
            if ours is None:
                assert theirs is None
                continue
            np.testing.assert_allclose(theirs, ours, rtol=0, atol=1e-12)


PLAIN = """\
title = "An arm"
source = "a test"
tip = "flange"
d_bs = 0.3
d_se = 0.4
d_ew = 0.4
d_wf = 0.1
signs = [1, 1, 1, 1, 1, 1, 1]
lower_deg = [-1, -1, -1, -1, -1, -1, -inf]
upper_deg = [1, 1, 1, 1, 1, 1, inf]
"""


def test_the_least_a_file_needs(tmp_path):
    """`read_robot` of the fewest keys has default velocities, name and limits."""
    path = tmp_path / "plain.toml"
    path.write_text(PLAIN)
    arm = read_robot(path).description
    assert arm.name == "plain"
    assert arm.velocity == (math.inf,) * 7
    assert arm.upper[6] == math.inf
    assert arm.upper[0] == math.radians(1)


def test_a_file_may_have_an_offset_wrist_and_angles_in_rad(tmp_path):
    """A robot file with a_1 or a_6 is an arm with an offset; keys without _deg are in rad."""
    path = tmp_path / "offset.toml"
    path.write_text(PLAIN.replace("_deg", "").replace("d_wf", "a_6 = 0.05\nd_wf"))
    arm = read_robot(path).description
    assert isinstance(arm, OffsetDescription) and (arm.a_1, arm.a_6) == (0.0, 0.05)
    assert (arm.lower[0], arm.upper[0]) == (-1.0, 1.0)
    path.write_text(PLAIN.replace("d_wf", "a_1 = 0.05\nd_wf"))
    assert Arm._from_description(read_robot(path).description).kind == "offset_shoulder"


MALFORMED = [
    ("d_bs = 0.3", "d_bs = = 0.3", "arm.toml:4:8: not TOML"),
    ("d_bs = 0.3\n", "", "arm.toml: d_bs is missing"),
    ("d_bs = 0.3", 'd_bs = "0.3"', "arm.toml:4: d_bs has '0.3'"),
    ("d_bs = 0.3", "d_bs = true", "d_bs has True"),
    ("d_bs = 0.3", "d_bs = nan", "d_bs has nan"), ('"flange"', '" "', "arm.toml:3: tip is ' '"),
    ("d_bs = 0.3", "d_bs = 0.3\nd_sw = 1", "arm.toml:5: d_sw is not a key; did you mean d_"),
    ("d_bs = 0.3", "d_bs = 0.3\ncolour = 1", "arm.toml:5: colour is not a key"),
    ("signs = [1, 1, ", "signs = [1, 2, ", "signs is [1, 2, 1, 1, 1, 1, 1]"),
    ("signs = [1, 1, ", "signs = [1, ", "signs is [1, 1, 1, 1, 1, 1], wanted 7"),
    ("signs = ", "offsets_deg = [inf, 0, 0, 0, 0, 0, 0]\nsigns = ", "offsets_deg has inf"),
    ("upper_deg = [1,", "upper_deg = [-2,", "arm.toml:9: lower_deg is above upper_deg at jo"),
    ("tip", "joint_names = [1, 2, 3, 4, 5, 6, 7]\ntip", "joint_names is [1, 2, 3, 4, 5, 6, 7]"),
    ("tip", "base = [[1, 0, 0], [1]]\ntip", "arm.toml:3: base is not a 4x4 matrix"),
    ("tip", f"tool = {[[0, 0, 0, 1]] * 5}\ntip", "arm.toml:3: tool is not a 4x4 matrix"),
    ("tip", "limits_trusted = 1\ntip", "limits_trusted is 1"),
    ("tip", "limits_trusted = false\ntip", "limits_reason is missing"),
]  # fmt: skip
UNKNOWN = {
    "kuka_iiwa7": "no robot 'kuka_iiwa7'; did you mean 'kuka_iiwa7_r800'",
    "iiwa7": "no robot 'iiwa7'; did you mean 'kuka_iiwa7_r800'?",
    "KUKA LBR iiwa 7": "mean 'kuka_iiwa7_r800'?",
    "kuka": "did you mean 'kuka_iiwa14_r820' or 'kuka_iiwa7_r800' or 'kuka_lwr4_plus' or 'kuka_med",
    "fourier left": "did you mean 'fourier_gr2t2_left' or 'fourier_gr2t2d_left'",
    "kuka_iiva7_r800": "did you mean 'kuka_iiwa7_r800'", "zzz": "no robot 'zzz'; it has agilex, aldebaran",
    "../robots/openarm_v10": "no robot '../robots/openarm_v10'; did you mean",
}  # fmt: skip


def test_what_is_no_entry_is_refused_with_its_line_or_near_names(tmp_path):
    """`read_robot` and `load_robot` raise with the line of a fault, or names that are near."""
    path, wrong = tmp_path / "arm.toml", []
    for old, new, message in MALFORMED:
        path.write_text(PLAIN.replace(old, new, 1))
        wrong += not_refused([(ModelError, re.escape(message), lambda: read_robot(path))])
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    rows = [
        (ModelError, r"nowhere\.toml: no such file", lambda: read_robot(tmp_path / "nowhere.toml")),
        (ModelError, "cannot be read: ", lambda: read_robot(tmp_path)),
        (ModelError, "not UTF-8 text", lambda: read_robot(tmp_path / "bytes.toml")),
        *(
            (InputError, re.escape(said), lambda name=name: load_robot(name))
            for name, said in UNKNOWN.items()
        ),
    ]
    assert wrong + not_refused(rows) == []


SPECIAL_ARMS = {
    # name: d_bs, d_se, d_ew, d_wf, a_1, a_3, a_4, a_6 in m
    "franka_fer": (0.333, 0.316, 0.384, 0.107, 0.0, 0.0825, -0.0825, 0.088),
    "franka_fr3": (0.333, 0.316, 0.384, 0.107, 0.0, 0.0825, -0.0825, 0.088),
    "ufactory_xarm7": (0.267, 0.293, 0.3425, 0.097, 0.0, 0.0525, -0.0775, -0.076),
    "willow_garage_pr2_left": (0.0, 0.4, 0.321, 0.18, 0.1, 0.0, 0.0, 0.0),
    "willow_garage_pr2_right": (0.0, 0.4, 0.321, 0.18, 0.1, 0.0, 0.0, 0.0),
    "fetch": (0.40858, 0.352, 0.3215, 0.30495, 0.117, 0.0, 0.0, 0.0),
    "yaskawa_sia50d": (0.54, 0.875, 0.61, 0.35, 0.145, 0.0, 0.0, 0.0),
    "realman_gen72": (0.218, 0.28, 0.2525, 0.0905, 0.0, 0.04, -0.019, 0.067),
    "robotis_ai_worker_left": (0.2275, 0.3, 0.253, 0.0, 0.0, 0.041004, -0.041004, 0.0885),
    "robotis_ai_worker_right": (0.2275, 0.3, 0.253, 0.0, 0.0, 0.041004, -0.041004, 0.0885),
}
SPECIAL_FILES = {
    "franka_fer": ("franka_panda", "panda_link8"),
    "ufactory_xarm7": ("ufactory_xarm7", "link_eef"),
}


def test_arms_with_an_offset_wrist_or_shoulder_have_their_numbers():
    """Each offset entry has its published lengths, ordered limits; velocities are plausible iff trusted."""

    assert offset_catalogue() == tuple(sorted(SPECIAL_ARMS))
    for name, lengths in SPECIAL_ARMS.items():
        entry = load_robot(name)
        arm = entry.description
        assert tuple(getattr(arm, key) for key in (*LENGTHS, "a_1", "a_3", "a_4", "a_6")) == lengths
        assert all(low < high for low, high in zip(arm.lower, arm.upper, strict=True))
        assert all(1.0 < speed < 10.0 for speed in arm.velocity) == entry.velocity_trusted


@pytest.mark.parametrize("name", SPECIAL_ARMS)
def test_an_offset_arm_goes_through_urdf_unchanged(name):
    """Every offset entry written as URDF is read back unchanged."""
    arm = load_robot(name).description
    chain = chain_of(arm)
    again, _ = describe_offset_chain(read_urdf(write_chain(chain, name)), angle=1e-9, length=1e-9)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (100, 7))
    np.testing.assert_allclose(chain_of(again).forward(q), chain.forward(q), rtol=0, atol=1e-12)
    assert (again.lower, again.upper, again.joint_names) == (arm.lower, arm.upper, arm.joint_names)


@pytest.mark.parametrize("name", SPECIAL_FILES)
def test_an_offset_arm_is_the_arm_of_its_file(name):
    """Every entry of SPECIAL_FILES has the poses of its file within 7e-6 m and 3e-5 rad."""
    file, tip = SPECIAL_FILES[name]
    path = model(file)
    arm, chain = chain_of(load_robot(name).description), read_urdf(path, tip=tip, offset=True)
    names = [joint.name for joint in chain.joints]
    for q in np.random.default_rng(0).uniform(-np.pi, np.pi, (100, 7)):
        own = urdf_forward(path.read_text(), chain.tip, dict(zip(names, q, strict=True)))
        off, turned = pose_error(arm.forward(q), own)
        assert off <= 7e-6 and turned <= 3e-5
