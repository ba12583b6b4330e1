"""Which chains of a robot are offered: by walking up from every joint, S-R-S ones first."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np
import pytest
from support.chain import RandomArm, joint_xml, pose_error, random_frame, rpy, urdf_forward
from support.chains import read_urdf, urdf_candidates

from armangle import Arm
from armangle.errors import ModelError
from armangle.models.candidates import Candidate, listed

LIMIT = '<limit lower="-2" upper="2" velocity="1"/>'
STRAIGHT = ((0, 0, 0.3), (0, 0, 0), (0, 0, 0.2), (0, 0, 0.2), (0, 0, 0.2), (0, 0, 0.19), (0, 0, 0))


def origin(xyz: Sequence[float], angles: Sequence[float] = (0, 0, 0)) -> str:
    """Return an <origin>."""
    return f'<origin xyz="{" ".join(map(repr, xyz))}" rpy="{" ".join(map(repr, angles))}"/>'


def arm(
    name: str, base: str, count: int = 7, places: Sequence[Sequence[float]] = STRAIGHT, rest: str = ""
) -> str:
    """Return links and joints of a straight arm of `count` joints on the link `base`, and `rest`
    after them.
    """
    text, parent = [], base
    for i in range(count):
        link, axis = f"{name}_{i + 1}", "0 1 0" if i % 2 else "0 0 1"
        inside = f'{origin(places[i % 7])}<axis xyz="{axis}"/>{LIMIT}'
        text.append(f'<link name="{link}"/>' + joint_xml(f"{name}_j{i + 1}", parent, link, inside=inside))
        parent = link
    return "".join(text) + rest


def robot(*parts: str) -> str:
    """Return a URDF of these parts."""
    return f'<robot name="made"><link name="foot"/>{"".join(parts)}</robot>'


def under(kind: str, link: str = "torso", parent: str = "foot", name: str = "lift") -> str:
    """Return the link `link` on a joint `name` of this kind to `parent`."""
    return f'<link name="{link}"/>' + joint_xml(name, parent, link, kind, LIMIT + '<axis xyz="0 0 1"/>')


def fixed(link: str, parent: str) -> str:
    """Return a link with a fixed joint to its parent."""
    return f'<link name="{link}"/>' + joint_xml(f"{link}_on_{parent}", parent, link, "fixed")


def ends(text: str) -> list[tuple[str, str]]:
    """Return base and tip of each candidate."""
    return [(one.base, one.tip) for one in urdf_candidates(text)]


GRIPPER = under("prismatic", "finger", "a_7", "slide")
HINGED = under("revolute", "jaw", "a_7", "jaw_hinge")
FINGERS = under("revolute", "f", "a_7", "f_hinge") + under("revolute", "g", "a_7", "g_hinge")
MIMIC = '<link name="m"/>' + joint_xml("mimic", "a_7", "m", "revolute", LIMIT + '<mimic joint="a_j1"/>')
SIX = arm("a", "foot", 6)
F1, HEAD, WAIST = (
    under("revolute", "f", "a_6", "f1"),
    under("revolute", "head", "a_1", "neck"),
    under("revolute"),
)
TORSO_A, BOTH = arm("a", "torso"), [("torso", "a_7"), ("torso", "b_7")]
WHOLE: dict[str, tuple[str, list[tuple[str, str]]]] = {
    "root": (robot(arm("a", "foot")), [("foot", "a_7")]),
    "fixed links": (robot(fixed("plate", "foot"), arm("a", "plate"), fixed("hand", "a_7"),
      fixed("tcp", "hand")),
                    [("foot", "tcp")]),
    "lift": (robot(under("prismatic"), TORSO_A), [("torso", "a_7")]),
    "free base": (robot(under("floating"), TORSO_A), [("torso", "a_7")]),
    "planar base": (robot(under("planar"), TORSO_A), [("torso", "a_7")]),
    "waist of two arms": (robot(WAIST, TORSO_A, arm("b", "torso")), BOTH),
    "waist of one arm": (robot(WAIST, TORSO_A), [("torso", "a_7")]),
    "waist and head": (robot(WAIST, under("revolute", "head", "torso", "neck"), TORSO_A), [("torso", "a_7")]),
    **{name: (robot(arm("a", "foot", rest=rest)), [("foot", "a_7")]) for name, rest in (
        ("gripper", GRIPPER), ("gripper of one hinge", HINGED), ("hand", FINGERS), ("mimic", MIMIC),
        ("head on link 1", HEAD),
        ("head of two joints on link 1", under("revolute", "pan", "a_1", "neck")
         + under("revolute", "tilt", "pan", "neck_tilt")))},
    "arm of six with a hand of two fingers": (robot(SIX, F1, under("revolute", "g", "a_6", "g1")), []),
    "arm of six with a finger that another mimics": (
        robot(SIX, F1, MIMIC.replace("a_7", "a_6").replace("a_j1", "f1")), []),
    "arm of six with a finger that turns and one that slides": (
        robot(SIX, F1, under("prismatic", "g", "a_6", "g1")), []),
    "arm of six": (robot(WAIST, arm("a", "torso", 6), arm("b", "torso", 6)), []),
    "arm of five on two joints": (
        robot(WAIST, under("revolute", "chest", "torso", "pitch"), arm("a", "chest", 5)), [("foot", "a_5")]),
}  # fmt: skip


@pytest.mark.parametrize("case", WHOLE)
def test_the_arm_is_offered_whatever_carries_it_and_whatever_it_carries(case: str) -> None:
    """`urdf_candidates` finds the arm among torsos, heads, grippers and second arms."""
    text, wanted = WHOLE[case]
    found = urdf_candidates(text)
    assert ends(text) == wanted
    assert [one.rank() for one in found] == [0 if one.tip != "a_5" else 3 for one in found]
    if len(found) == 1 and found[0].rank() == 0:
        assert [joint.name for joint in read_urdf(text).joints] == [f"a_j{i}" for i in range(1, 8)]


def test_exact_chains_come_first_then_near_ones_with_their_residual() -> None:
    """`urdf_candidates` ranks an S-R-S arm before a near one, with its residual.

    One that is neither near nor an offset arm is last.
    """
    near = [list(place) for place in STRAIGHT]
    near[1], near[6] = [0.012, 0, 0], [0.001, 0, 0]  # at both ends: no offset arm
    odd = [list(place) for place in STRAIGHT]
    odd[1], odd[6] = [0.2, 0, 0], [0.1, 0, 0]
    text = robot(arm("odd", "foot", places=odd), arm("near", "foot", places=near), arm("a", "foot"))
    found = urdf_candidates(text)
    assert [one.tip for one in found] == ["a_7", "near_7", "odd_7"]
    assert [one.rank() for one in found] == [0, 2, 3]
    assert found[0].verdict() == "S-R-S" and found[2].verdict() == "not S-R-S"
    assert re.fullmatch(
        r"near S-R-S: off by 12 mm, 0 deg; nearest arm within 2\d\.\d+ mm", found[1].verdict()
    )
    assert read_urdf(text).tip == "a_7"  # the only one that is S-R-S


def bent(*lengths: tuple[int, float]) -> list[list[float]]:
    """Return the places of a straight arm of which joints (from 0) are shifted by lengths (m) along x."""
    places = [list(place) for place in STRAIGHT]
    for joint, length in lengths:
        places[joint][0] = length
    return places


@pytest.mark.parametrize(
    ("other", "said"),
    [(bent((1, 0.02), (6, 0.01)), "near S-R-S"), (bent((1, 0.2), (6, 0.1)), "not S-R-S")],
)
def test_the_arm_that_was_not_taken_is_noted(other: list[list[float]], said: str) -> None:
    """`from_urdf` takes the S-R-S arm of two, and notes the other unless a tip is named."""
    text = robot(under("revolute"), arm("a", "torso"), arm("b", "torso", places=other))
    arm_a = Arm.from_urdf(text)
    assert arm_a.report is not None and arm_a.report.tip == "a_7"
    (note,) = [note for note in arm_a.report.notes if "'b_7'" in note]
    assert said in note and "'a_7'" in note
    named = Arm.from_urdf(text, tip="a_7").report
    assert named is not None and not any("b_7" in note for note in named.notes)


def test_the_lowest_link_above_several_tips_is_taken_with_a_note() -> None:
    """`from_urdf` with several fixed tips takes the link above them, and notes them."""
    hand = fixed("flange", "a_7") + fixed("tool0", "a_7")
    report = Arm.from_urdf(robot(arm("a", "foot", rest=hand))).report
    assert report is not None and report.tip == "a_7"
    assert len([note for note in report.notes if "'flange', 'tool0'" in note and "'a_7'" in note]) == 1


@pytest.mark.turns(2)
@pytest.mark.parametrize("places", [STRAIGHT, bent((1, 0.02), (6, 0.01))])
@pytest.mark.parametrize("fingers", [1, 2])
def test_a_tip_behind_fingers_is_told_the_tip_that_works(
    places: Sequence[Sequence[float]], fingers: int
) -> None:
    """`from_urdf` with a finger as tip raises, and names the tip that works."""
    hand = under("revolute", "f1", "a_7", "grasp") + "".join(
        under("revolute", f"f{i + 1}", f"f{i}", f"knuckle{i}") for i in range(1, fingers)
    )
    with pytest.raises(
        ModelError, match=rf"{7 + fingers} rotating joints lead to 'f{fingers}'.* to 'a_7' \("
    ):
        Arm.from_urdf(robot(arm("a", "foot", places=places, rest=hand)), tip=f"f{fingers}")


def test_of_eight_joints_without_an_arm_in_them_both_runs_are_offered() -> None:
    """`from_urdf` of eight joints without an arm raises, and names both runs of seven."""
    text = robot(arm("a", "foot", places=bent((1, 0.2), (5, 0.2)), rest=HINGED))
    for ends in ({}, {"tip": "jaw"}):
        with pytest.raises(ModelError, match=r"name .*candidates: 'foot' to 'a_7' .*; 'a_1' to 'jaw' "):
            Arm.from_urdf(text, **ends)


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        (LIMIT + '<mimic joint="a_j3"/>', "of the 7 from 'foot' to 'a_7' joint 'a_j5' mimics joint 'a_j3'"),
        ("hinge", "of the 7 from 'foot' to 'a_7' joint 'a_j5' has unknown type 'hinge'"),
        ("prismatic", "the longest run has 4, from 'foot' to 'a_4': a_j1, a_j2, a_j3, a_j4"),
    ],
)
def test_a_joint_that_breaks_the_only_chain_is_named(inside: str, said: str) -> None:
    """`from_urdf` raises, and names the joint that mimics, is unknown or slides."""
    text = robot(arm("a", "foot"))
    at = text.index('name="a_j5"')
    if inside in ("hinge", "prismatic"):
        text = text[:at] + text[at:].replace('type="revolute"', f'type="{inside}"', 1)
    else:
        text = text[:at] + text[at:].replace(LIMIT, inside, 1)
    with pytest.raises(ModelError, match=re.escape(said)):
        Arm.from_urdf(text)


def test_a_link_that_is_not_there_is_said_where_it_breaks_the_chain() -> None:
    """`from_urdf` raises, and names a missing link that breaks the chain."""
    text = robot(arm("a", "foot")).replace('<link name="a_4"/>', "")
    with pytest.raises(ModelError, match="names a link 'a_4' that is not there"):
        Arm.from_urdf(text)


def test_two_exact_arms_have_to_be_named() -> None:
    """`read_urdf` of two S-R-S arms raises unless base or tip is named."""
    text = robot(under("revolute"), arm("a", "torso"), arm("b", "torso"))
    with pytest.raises(
        ModelError, match="not unique, name them; candidates: 'torso' to 'a_7' \\(S-R-S\\); 'tor"
    ):
        read_urdf(text)
    assert (read_urdf(text, tip="b_7").base, read_urdf(text, base="torso", tip="a_7").tip) == ("torso", "a_7")


def test_a_base_asks_for_the_chains_from_there() -> None:
    """`read_urdf(base=)` finds the chain from there, or raises and names the others."""
    text = robot(under("revolute"), fixed("chest", "torso"), arm("a", "chest"), arm("b", "torso", 6))
    assert [one.base for one in urdf_candidates(text, "chest")] == ["chest"]
    assert read_urdf(text, base="chest").tip == "a_7"
    message = "begins at 'a_1', walking up from every joint; the file has 'torso' to 'a_7' (S-R-S)"
    with pytest.raises(ModelError, match=re.escape(message)):
        read_urdf(text, base="a_1")


def test_a_generated_arm_is_found_on_any_tree() -> None:
    """Arms in random frames on random trees: the right joints, and the file's own kinematics."""
    for seed in range(60):
        found_on_a_tree(seed)


def found_on_a_tree(seed: int) -> None:
    """Check that an arm in random frames on a random tree is found, alone, with the file's own kinematics."""
    rng = np.random.default_rng(seed)
    made = RandomArm(rng, elbow_offset=seed % 2 == 1, right_angles=seed % 4 >= 2)
    points, directions = made.axes()
    text, parent, last = ['<robot name="r"><link name="root"/>'], "root", np.eye(4)
    kinds = rng.choice(["revolute", "prismatic", "floating", "continuous"], rng.integers(0, 4))
    for i, kind in enumerate(kinds):
        text.append(under(kind, f"low{i}", parent, f"below{i}"))
        parent = f"low{i}"
    if len(kinds):  # a second branch: what is below the arm is no part of it
        text.append(under("revolute", "head", parent, "neck"))
    for i in range(7):
        frame = random_frame(rng, 0.3)
        frame[:3, 3] = points[i]
        step = np.linalg.inv(last) @ frame
        axis = frame[:3, :3].T @ directions[i]
        inside = origin(step[:3, 3].tolist(), rpy(step)) + LIMIT
        inside += f'<axis xyz="{" ".join(map(repr, axis.tolist()))}"/>'
        text.append(f'<link name="l{i}"/>' + joint_xml(f"q{i}", parent, f"l{i}", inside=inside))
        parent, last = f"l{i}", frame
    text.append(under(rng.choice(["prismatic", "revolute", "fixed"]), "hand", parent, "wrist"))
    whole = "".join(text) + "</robot>"
    found = [one for one in urdf_candidates(whole) if one.rank() == 0]
    assert [one.joints for one in found] == [tuple(f"q{i}" for i in range(7))]
    chain = read_urdf(whole)
    zero = {f"below{i}": 0.0 for i in range(len(kinds))} | {"wrist": 0.0}
    q = rng.uniform(-2, 2, 7)
    named = zero | {f"q{i}": value for i, value in enumerate(q)}
    own = np.linalg.inv(urdf_forward(whole, chain.base, zero)) @ urdf_forward(whole, chain.tip, named)
    assert max(pose_error(chain.forward(q), own)) <= 1e-9


def test_a_chain_that_cannot_be_read_is_offered_as_such() -> None:
    """A candidate with a zero axis is called unreadable, and `read_urdf` raises."""
    text = robot(arm("a", "foot")).replace('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', 1)
    (found,) = urdf_candidates(text)
    assert (found.verdict(), found.rank()) == ("cannot be read", 3)
    with pytest.raises(ModelError, match="joint 'a_j2' has a zero axis"):
        read_urdf(text)


def test_long_lists_of_names_are_cut() -> None:
    """Messages name the first of many links and how many more there are."""
    assert listed(["a", "b"]) == "a, b"
    assert listed([f"link_{i}" for i in range(300)], 3) == "link_0, link_1, link_2, and 297 more"
    many = robot(*(fixed(f"part_{i}", "foot") for i in range(300)))
    with pytest.raises(ModelError, match="and 281 more") as caught:
        read_urdf(many, tip="nowhere")
    assert len(str(caught.value)) < 400


def test_a_body_with_many_ends_names_the_link_where_they_part() -> None:
    """A candidate with many fixed ends has the link above as its tip, and names some of them."""
    hand = fixed("palm", "a_7") + "".join(fixed(f"pad_{i}", "palm") for i in range(6))
    (found,) = urdf_candidates(robot(arm("a", "foot", rest=hand)))
    assert isinstance(found, Candidate)
    assert (found.tip, len(found.ends)) == ("palm", 6)
    assert str(found) == "'foot' to 'palm' (S-R-S; or tip pad_0, pad_1, pad_2, pad_3, and 2 more)"
    assert read_urdf(robot(arm("a", "foot", rest=hand)), tip="palm").tip == "palm"


# arms with an offset wrist or shoulder


FR3 = Arm.from_catalogue("franka_fr3")
SHOULDER = Arm(a_1=0.117, d_bs=0.3, d_se=0.35, d_ew=0.32, d_wf=0.15, lower=[-2] * 7, upper=[2] * 7)


def inside(text: str, name: str, base: str) -> str:
    """Return links and joints of a URDF, renamed with `name_` and fixed to the link `base`."""
    renamed = re.sub(r'(name|link)="([^"]*)"', rf'\1="{name}_\2"', text[text.index("<link") :])
    return renamed.removesuffix("</robot>\n").replace("</robot>", "") + joint_xml(
        f"{name}_on", base, f"{name}_base", "fixed"
    )


@pytest.mark.parametrize(("one", "end"), [(FR3, "wrist"), (SHOULDER, "shoulder")])
def test_chains_of_offset_arms_are_called_what_they_are(one: Arm, end: str) -> None:
    """`urdf_candidates` calls offset arms so, and `from_urdf` takes the one that is named."""
    text = robot(inside(one.to_urdf(), "l", "foot"), inside(one.to_urdf(), "r", "foot"))
    verdicts = [found.verdict() for found in urdf_candidates(text)]
    assert verdicts == [f"offset {end}"] * 2
    with pytest.raises(ModelError, match=f"not unique, name them; candidates: .*offset {end}"):
        Arm.from_urdf(text)
    assert Arm.from_urdf(text, tip="r_tip").geometry.joint_names[0] == f"r_{one.geometry.joint_names[0]}"


def test_an_exact_arm_of_a_file_comes_before_one_with_an_offset() -> None:
    """`from_urdf` takes the S-R-S arm of two, unless the offset arm's tip is named."""
    text = robot(inside(FR3.to_urdf(), "l", "foot"), arm("a", "foot"))
    assert [found.rank() for found in urdf_candidates(text)] == [0, 1]
    assert Arm.from_urdf(text).geometry.joint_names[0] == "a_j1"
    assert Arm.from_urdf(text, tip="l_tip").geometry.joint_names[0] == "l_joint_1"


def test_a_calibrated_arm_is_near_one_with_its_residual() -> None:
    """`urdf_candidates` calls a calibrated offset arm near one, with its residual."""
    text = FR3.to_urdf().replace('xyz="0.0825 0.0 0.316"', 'xyz="0.0825 0.0005 0.316"')
    assert text != FR3.to_urdf()
    pair = robot(inside(text, "l", "foot"), inside(text, "r", "foot"), arm("a", "foot"))
    found = urdf_candidates(pair)
    assert [one.rank() for one in found] == [0, 2, 2]
    said = re.fullmatch(r"near an offset wrist: within (\S+) mm", found[1].verdict())
    assert said is not None and 0.5 <= float(said[1]) < 2
    hinged = robot(inside(text, "l", "foot"), under("revolute", "jaw", "l_tip", "jaw_hinge"))
    with pytest.warns(UserWarning, match="not quite the arm of its file"):
        read = Arm.from_urdf(hinged, length_tolerance=2e-3, angle_tolerance=1e-3)
    assert read.geometry.joint_names[0] == "l_joint_1"


def test_an_offset_arm_stands_between_hinges() -> None:
    """`from_urdf` finds an offset arm on up to two hinges and with a hinged gripper."""
    q = np.array([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])
    for waists, gripper in product(range(3), (False, True)):
        links = ["foot", *(f"w_{i}" for i in range(waists))]
        parts = [under("revolute", below, above, f"{below}_j") for above, below in pairwise(links)]
        jaw = [under("revolute", "jaw", "l_tip", "jaw_hinge")] if gripper else []
        read = Arm.from_urdf(robot(*parts, inside(FR3.to_urdf(), "l", links[-1]), *jaw))
        assert read.geometry.joint_names == tuple(f"l_{name}" for name in FR3.geometry.joint_names)
        np.testing.assert_allclose(read.forward(q)[0], FR3.forward(q)[0], rtol=0, atol=1e-9)
