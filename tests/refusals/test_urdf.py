"""Every message of the URDF reader, with the names in it."""

from __future__ import annotations

import importlib.util
import re

import pytest
from support.chain import LIMIT, joint_xml, simple_urdf
from support.chains import read_urdf, urdf_candidates
from support.refused import Row, not_refused

import armangle as aa
import armangle.models.urdf.reading
from armangle.errors import ModelError

BOMB = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>' + simple_urdf()
ONE = joint_xml("a", "l0", "z")


def third(kind: str = "revolute", inside: str = "", limit: str = LIMIT) -> str:
    """A simple chain whose joint j3 has this type, and `limit` and `inside` as its elements."""
    return simple_urdf(j3=joint_xml("j3", "l2", "l3", kind, limit + inside))


EIGHTH = {"joints": joint_xml("j8", "l7", "l8", "continuous"), "links": '<link name="l8"/>'}
SLIDE = joint_xml("j1", "l0", "l1", "prismatic", LIMIT)
REFUSED: list[tuple[str | bytes, str]] = [
    (BOMB, "DOCTYPE"), (simple_urdf() + "<", "not XML: "), (b"", "not XML: "),
    (b"<?xml version='1.0' encoding='no-such'?><robot name='a'/>", "not XML"),
    ("<robot name='\ud800'/>", "not XML"),
    ("<mujoco/>", "the outer element is <mujoco>, wanted <robot>"),
    (simple_urdf('<xacro:macro name="a"/><xacro:a/>'), "<xacro:a> calls a macro"),
    (simple_urdf('<xacro:include filename="f"/><xacro:a/>'), "<xacro:a> calls a macro"),
    (simple_urdf(f'<xacro:unless value="1">{ONE}</xacro:unless>'), "<xacro:unless> decides on a joint"),
    (simple_urdf(f'<xacro:if value="1"><xacro:unless value="0"/>{ONE}</xacro:if>'),
     "<xacro:if> decides on a joint"),
    (simple_urdf('<xacro:if value="1"><xacro:if value="1"><link name="z"/></xacro:if></xacro:if>'),
     "<xacro:if> decides on a link"),
    (simple_urdf(f"<xacro:nowhere_defined>{ONE}</xacro:nowhere_defined>"),
     "<xacro:nowhere_defined> holds a joint"),
    (third("${t}"), "joint 'j3': <joint type='${t}'> is an expression"),
    (third(inside="<xacro:axis/>"), "joint 'j3' holds <xacro:axis>"),
    (third(inside='<origin xyz="0 0 ${a}"/>'), "joint 'j3': <origin xyz='0 0 ${a}'> is an expression"),
    ('<robot><xacro:macro name="a"><link name="l0"/></xacro:macro></robot>', "no link outside <xacro:macro>"),
    (simple_urdf("<joint/>"), "a <joint> has no name"),
    (simple_urdf('<link name="l3"/>'), "'l3' is there twice"),
    (simple_urdf(j3='<joint name="j3" type="fixed"/>'), "joint 'j3' has no <parent link"),
    (simple_urdf(j3=joint_xml("j3", "l2", "zz", inside=LIMIT)),
     "roots are 'l0' and 'l3'; joint 'j3' names a link 'zz' that is not there"),
    (simple_urdf(joint_xml("a", "l0", "l5")), "link 'l5' hangs on two joints, 'j5' and 'a'"),
    (third("fixed"), "6 moving joints from 'l0' to 'l7', wanted 7: j1, j2, j4, j5, j6, j7"),
    (third("prismatic"), "joint 'j3' on the path is prismatic"),
    (third("floating"), "'j3' on the path is floating"),
    (third("planar"), "'j3' on the path is planar"), (third("hinge"), "has unknown type 'hinge'"),
    (third(inside='<mimic joint="j1"/>'), "joint 'j3' on the path mimics joint 'j1'"),
    (third(limit=""), "'j3' has no limits"), (third(limit='<limit velocity="1"/>'), "'j3' has no limits"),
    (third(limit='<limit lower="1" upper="-1"/>'), "joint 'j3': lower limit 1 is above upper limit -1"),
    (third(inside='<axis xyz="0 0 0"/>'), "joint 'j3' has a zero axis"),
    (third(inside='<axis xyz="0 0 up"/>'), "joint 'j3': <axis xyz='0 0 up'> is not 3 numbers"),
    (third(limit='<limit lower="low" upper="1"/>'), "joint 'j3': <limit lower='low'> is not 1 number"),
    (third(limit='<limit lower="nan" upper="1"/>'), "joint 'j3': <limit lower='nan'> is not finite"),
    (third(inside='<origin xyz="0 1"/>'), "joint 'j3': <origin xyz='0 1'> has 2 numbers, wanted 3"),
    (third(inside='<origin rpy="0 nan 0"/>'), "joint 'j3': <origin rpy='0 nan 0'> is not finite"),
    (third(inside='<origin xyz="0 inf 0"/>'), "joint 'j3': <origin xyz='0 inf 0'> is not finite"),
    (third(inside='<origin xyz="0 0 400"/>'), "joint 'j3' lies 400 m away"),
]  # fmt: skip
EIGHT = [
    (simple_urdf(**EIGHTH),
     "8 moving joints from 'l0' to 'l8', wanted 7: j1, j2, j3, j4, j5, j6, j7, j8; base='l1'"),
    (simple_urdf(**EIGHTH, j1=SLIDE),
     "joint 'j1' on the path is prismatic, wanted revolute; base='l1' leaves the"),
]  # fmt: skip


def test_a_type_that_is_an_expression_is_refused_with_its_line_where_links_are_guessed():
    """A joint type that is a xacro expression is refused with its line, unless it is off the named path."""
    text = simple_urdf(j3=joint_xml("j3", "l2", "l3", "${t}", LIMIT))
    for ask in (read_urdf, urdf_candidates):
        with pytest.raises(ModelError, match=r"joint 'j3': <joint type='.{4}'> is an expression") as caught:
            ask(text)
        assert caught.value.line == 1 + text[: text.index('name="j3"')].count("\n")
    off_the_path = simple_urdf(joint_xml("finger", "l7", "f", "${t}") + '<link name="f"/>')
    assert len(read_urdf(off_the_path, "l0", "l7").joints) == 7
    named = '<transmission name="t"><joint name="j1"/></transmission>'
    assert read_urdf(simple_urdf(f'<xacro:if value="1">{named}</xacro:if>'), "l0", "l7").tip == "l7"


def test_what_is_neither_path_nor_text_is_refused_by_name():
    """Readers of URDF and MJCF refuse a source that is neither path nor text."""
    readers = aa.Arm.from_urdf, aa.Body.from_urdf, aa.Arm.from_mjcf
    assert not_refused(
        (aa.InputError, "^source is .*, wanted the path", lambda read=read, source=source: read(source))
        for read in (readers if importlib.util.find_spec("mujoco") else readers[:2])
        for source in (None, 5, 0.5, [], {}, object(), "")
    ) == []  # fmt: skip


def test_bad_text_is_refused_with_the_name():
    """`read_urdf` refuses faulty text, with joint or link in the message."""
    rows: list[Row] = []
    for cases, tip in ((REFUSED, "l7"), (EIGHT, "l8")):
        rows += [(ModelError, f"^XML text:(?s:.*){re.escape(message)}", lambda text=text,
          tip=tip: read_urdf(text, "l0", tip))
                 for text, message in cases]  # fmt: skip
    assert not_refused(rows) == []
    with pytest.raises(ModelError) as caught:
        read_urdf("<mujoco/>")
    assert caught.value.source == "XML text"


ENDS = [
    ("nowhere", "l7", "no link 'nowhere' (base); the links are: l0, l1, l2"),
    ("l0", "nowhere", "no link 'nowhere' (tip); the links are: l0, l1, l2"),
    (None, "nowhere", "no link 'nowhere' (tip)"), ("nowhere", None, "no link 'nowhere' (base)"),
    ("l0", "island", "no path from 'l0' to 'island': their roots are 'l0' and 'island'"),
    ("l1", None, "no chain of 7 rotating joints begins at 'l1'"),
    (None, "l77", "no link 'l77' (tip); did you mean 'l7'"),
    (None, "l6", "6 moving joints from 'l0' to 'l6', wanted 7: j1, j2, j3, j4, j5, j6"),
    ("l3", "l3", "0 moving joints from 'l3' to 'l3', wanted 7: none"),
]  # fmt: skip


def test_bad_ends_are_refused_with_the_choices():
    """`read_urdf` refuses a base and tip that make no chain of 7, with what there is."""
    text = simple_urdf(links='<link name="island"/>')
    rows = [(text, re.escape(message), (base, tip)) for base, tip, message in ENDS]
    rows.append(('<robot><link name="alone"/></robot>', "no chain of 7 rotating joints", ()))
    loop = '<robot><link name="a"/><link name="b"/>' + joint_xml("one", "a", "b", "fixed")
    loop += joint_xml("two", "b", "a", "fixed") + "</robot>"
    rows += [(loop, "closes a loop at link 'a'", ends) for ends in (("a", None), (None, "a"), ("a", "b"))]
    assert not_refused(
        (ModelError, message, lambda text=text, ends=ends: read_urdf(text, *ends)) for text, message,
        ends in rows
    ) == []  # fmt: skip


def test_the_place_in_the_file_is_named(tmp_path):
    """`read_urdf` names file, line and column."""
    path = tmp_path / "arm.urdf"
    path.write_text("<robot>\n <link name='a'/>\n  <link/>\n</robot>")
    with pytest.raises(ModelError) as caught:
        read_urdf(path)
    assert str(caught.value) == f"{path}:3:3: a <link> has no name"
    assert (caught.value.line, caught.value.column) == (3, 3)


def test_bad_paths_are_refused(tmp_path, monkeypatch):
    """`read_urdf` refuses missing files, folders and more than MAX_BYTES."""
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
