"""Every message of the URDF reader, with the names in it."""

from __future__ import annotations

import importlib.util
import re

import pytest
from support.chain import LIMIT, joint_xml, simple_urdf

import armangle as aa
import armangle.models.urdf.reading
from armangle.errors import ModelError
from armangle.models.urdf import read_urdf, urdf_candidates

BOMB = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>' + simple_urdf()
REFUSED = {
    "doctype": (BOMB, "a DOCTYPE is refused: a robot needs none"),
    "xml": (simple_urdf() + "<", "not XML: "),
    "empty": (b"", "not XML: no element found"),
    "robot": ("<mujoco/>", "not a robot: the outer element is <mujoco>, wanted <robot>"),
    "macro": (
        simple_urdf('<xacro:macro name="a"/><xacro:a/>'),
        "<xacro:a> calls a macro: this is xacro, not URDF; run xacro first: xacro FILE.urdf.xacro",
    ),
    "include": (simple_urdf('<xacro:include filename="f"/><xacro:a/>'), "<xacro:a> calls a macro: this"),
    "condition": (
        simple_urdf(f'<xacro:unless value="1">{joint_xml("a", "l0", "z")}</xacro:unless>'),
        "<xacro:unless> decides on a joint: this is xacro",
    ),
    "condition about a condition that is over": (
        simple_urdf(f'<xacro:if value="1"><xacro:unless value="0"/>{joint_xml("a", "l0", "z")}</xacro:if>'),
        "<xacro:if> decides on a joint: this is xacro",
    ),
    "condition in a condition": (
        simple_urdf('<xacro:if value="1"><xacro:if value="1"><link name="z"/></xacro:if></xacro:if>'),
        "<xacro:if> decides on a link: this is xacro",
    ),
    "call of a macro that is not here, about a joint": (
        simple_urdf(f"<xacro:nowhere_defined>{joint_xml('a', 'l0', 'z')}</xacro:nowhere_defined>"),
        "<xacro:nowhere_defined> holds a joint: this is xacro",
    ),
    "type": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", "${t}", LIMIT)),
        "joint 'j3': <joint type='${t}'> is an expression of xacro; run xacro first",
    ),
    "inside a joint": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside=LIMIT + "<xacro:axis/>")),
        "joint 'j3' holds <xacro:axis>: this is xacro, not URDF",
    ),
    "expression": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside=LIMIT + '<origin xyz="0 0 ${a}"/>')),
        "joint 'j3': <origin xyz='0 0 ${a}'> is an expression of xacro; run xacro first",
    ),
    "macros alone": (
        '<robot><xacro:macro name="a"><link name="l0"/></xacro:macro></robot>',
        "no link outside <xacro:macro>: this is xacro",
    ),
    "unnamed": (simple_urdf("<joint/>"), "a <joint> has no name"),
    "twice": (simple_urdf('<link name="l3"/>'), "link 'l3' is there twice"),
    "no parent": (
        simple_urdf(j3='<joint name="j3" type="fixed"/>'),
        "joint 'j3' has no <parent link",
    ),
    "lost link": (
        simple_urdf(j3=joint_xml("j3", "l2", "zz", inside=LIMIT)),
        "their roots are 'l0' and 'l3'; joint 'j3' names a link 'zz' that is not there: left out",
    ),
    "two parents": (
        simple_urdf(joint_xml("a", "l0", "l5")),
        "link 'l5' hangs on two joints, 'j5' and 'a'",
    ),
    "six": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", "fixed")),
        "6 moving joints from 'l0' to 'l7', wanted 7: j1, j2, j4, j5, j6, j7",
    ),
    "eight": (
        simple_urdf(joint_xml("j8", "l7", "l8", "continuous"), links='<link name="l8"/>'),
        "8 moving joints from 'l0' to 'l8', wanted 7: j1, j2, j3, j4, j5, j6, j7, j8; base='l1' leaves the "
        "last 7: then arm.with_(base=T @ arm.base) puts the arm into the frame of 'l0', T being the pose of "
        "'l1' in it",
    ),
    "lift": (
        simple_urdf(
            joint_xml("j8", "l7", "l8", "continuous"),
            links='<link name="l8"/>',
            j1=joint_xml("j1", "l0", "l1", "prismatic", LIMIT),
        ),
        "joint 'j1' on the path is prismatic, wanted revolute; base='l1' leaves the last 7",
    ),
    "prismatic": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", "prismatic", LIMIT)),
        "joint 'j3' on the path is prismatic, wanted revolute",
    ),
    "floating": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", "floating")),
        "'j3' on the path is floating",
    ),
    "planar": (simple_urdf(j3=joint_xml("j3", "l2", "l3", "planar")), "'j3' on the path is planar"),
    "unknown": (simple_urdf(j3=joint_xml("j3", "l2", "l3", "hinge")), "has unknown type 'hinge'"),
    "mimic": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", "revolute", LIMIT + '<mimic joint="j1"/>')),
        "joint 'j3' on the path mimics joint 'j1'",
    ),
    "no limits": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3")),
        "revolute joint 'j3' has no limits (lower, upper)",
    ),
    "no bounds": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside='<limit velocity="1"/>')),
        "revolute joint 'j3' has no limits (lower, upper)",
    ),
    "reversed": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside='<limit lower="1" upper="-1"/>')),
        "joint 'j3': lower limit 1 is above upper limit -1",
    ),
    "zero axis": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside=LIMIT + '<axis xyz="0 0 0"/>')),
        "joint 'j3' has a zero axis",
    ),
    "words": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside=LIMIT + '<axis xyz="0 0 up"/>')),
        "joint 'j3': <axis xyz='0 0 up'> is not 3 numbers",
    ),
    "word": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside='<limit lower="low" upper="1"/>')),
        "joint 'j3': <limit lower='low'> is not 1 number",
    ),
    "count": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside=LIMIT + '<origin xyz="0 1"/>')),
        "joint 'j3': <origin xyz='0 1'> has 2 numbers, wanted 3",
    ),
    "nan": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside=LIMIT + '<origin rpy="0 nan 0"/>')),
        "joint 'j3': <origin rpy='0 nan 0'> is not finite",
    ),
    "infinite": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside=LIMIT + '<origin xyz="0 inf 0"/>')),
        "joint 'j3': <origin xyz='0 inf 0'> is not finite",
    ),
    "nan limit": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside='<limit lower="nan" upper="1"/>')),
        "joint 'j3': <limit lower='nan'> is not finite",
    ),
    "absurd": (
        simple_urdf(j3=joint_xml("j3", "l2", "l3", inside=LIMIT + '<origin xyz="0 0 400"/>')),
        "joint 'j3' lies 400 m away, absurd for an arm (wanted metres, at most 100)",
    ),
}


def test_a_type_that_is_an_expression_is_refused_with_its_line_where_links_are_guessed():
    text = simple_urdf(j3=joint_xml("j3", "l2", "l3", "${t}", LIMIT))
    for ask in (read_urdf, urdf_candidates):
        with pytest.raises(ModelError, match=r"joint 'j3': <joint type='.{4}'> is an expression") as caught:
            ask(text)
        assert caught.value.line == 1 + text[: text.index('name="j3"')].count("\n")
    off_the_path = simple_urdf(joint_xml("finger", "l7", "f", "${t}") + '<link name="f"/>')
    assert len(read_urdf(off_the_path, "l0", "l7").joints) == 7
    named = '<transmission name="t"><joint name="j1"/></transmission>'
    assert read_urdf(simple_urdf(f'<xacro:if value="1">{named}</xacro:if>'), "l0", "l7").tip == "l7"


@pytest.mark.parametrize("source", [None, 5, 0.5, [], {}, object(), ""])
def test_what_is_neither_path_nor_text_is_refused_by_name(source):
    readers = aa.Arm.from_urdf, aa.Arm.from_urdf, aa.Body.from_urdf, aa.Arm.from_mjcf
    for read in readers if importlib.util.find_spec("mujoco") else readers[:3]:
        with pytest.raises(aa.InputError, match=r"source is .*, wanted the path of a file, or its XML text"):
            read(source)


@pytest.mark.parametrize("case", REFUSED)
def test_bad_text_is_refused_with_the_name(case):
    text, message = REFUSED[case]
    last = "l8" if case in ("eight", "lift") else "l7"
    with pytest.raises(ModelError, match=re.escape(message)) as caught:
        read_urdf(text, "l0", last)
    assert str(caught.value).startswith("XML text:")
    assert caught.value.source == "XML text"


@pytest.mark.parametrize(
    ("base", "tip", "message"),
    [
        ("nowhere", "l7", "no link 'nowhere' (base); the links are: l0, l1, l2"),
        ("l0", "nowhere", "no link 'nowhere' (tip); the links are: l0, l1, l2"),
        (None, "nowhere", "no link 'nowhere' (tip); the links are: l0"),
        ("nowhere", None, "no link 'nowhere' (base); the links are: l0"),
        ("l0", "island", "no path from 'l0' to 'island': their roots are 'l0' and 'island'"),
        ("l1", None, "no chain of 7 rotating joints begins at 'l1', walking up from every joint; the file"),
        (None, "l77", "no link 'l77' (tip); did you mean 'l7'"),
        (None, "l6", "6 moving joints from 'l0' to 'l6', wanted 7: j1, j2, j3, j4, j5, j6"),
        ("l3", "l3", "0 moving joints from 'l3' to 'l3', wanted 7: none"),
    ],
)
def test_bad_ends_are_refused_with_the_choices(base, tip, message):
    text = simple_urdf(links='<link name="island"/>')
    with pytest.raises(ModelError, match=re.escape(message)):
        read_urdf(text, base, tip)


def test_no_arm_at_all_is_said():
    with pytest.raises(ModelError, match="no chain of 7 rotating joints is found, walking up from"):
        read_urdf('<robot><link name="alone"/></robot>')


@pytest.mark.parametrize("ends", [("a", None), (None, "a"), ("a", "b")])
def test_a_loop_is_refused(ends):
    text = '<robot><link name="a"/><link name="b"/>'
    text += joint_xml("one", "a", "b", "fixed") + joint_xml("two", "b", "a", "fixed") + "</robot>"
    with pytest.raises(ModelError, match="closes a loop at link 'a'"):
        read_urdf(text, *ends)


def test_the_place_in_the_file_is_named(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text("<robot>\n <link name='a'/>\n  <link/>\n</robot>")
    with pytest.raises(ModelError) as caught:
        read_urdf(path)
    assert str(caught.value) == f"{path}:3:3: a <link> has no name"
    assert (caught.value.line, caught.value.column) == (3, 3)


def test_bad_paths_are_refused(tmp_path, monkeypatch):
    with pytest.raises(ModelError, match=r"nowhere\.urdf: no such file"):
        read_urdf(tmp_path / "nowhere.urdf")
    with pytest.raises(ModelError, match="cannot be read: a folder, wanted a file"):
        read_urdf(tmp_path)
    monkeypatch.setattr(armangle.models.urdf.reading, "MAX_BYTES", 2**20)
    path = tmp_path / "large.urdf"
    path.write_bytes(b"<" * 3 * 2**20)
    for source in (path, path.read_bytes()):
        with pytest.raises(ModelError, match="3 MiB, wanted at most 1 MiB"):
            read_urdf(source)
