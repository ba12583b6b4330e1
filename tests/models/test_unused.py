"""Parts of a URDF that bound or place joints: read, or noted once; and what else a file may be written in."""

from __future__ import annotations

import re

import numpy as np
import pytest
from support.chain import joint_xml, simple_urdf
from support.chains import read_urdf
from support.refused import not_refused

from armangle import Arm, Body
from armangle.errors import ModelError

SOFT = '<safety_controller soft_lower_limit="{}" soft_upper_limit="{}" k_velocity="1"/>'
PLAIN = Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1, velocity=1)
NARROW = '<limit lower="-2" upper="2" velocity="1"/>'
CONTROL = (
    '<ros2_control name="c" type="system"><joint name="{}"><command_interface name="{}">'
    '<param name="min">{}</param><param name="max">{}</param></command_interface></joint></ros2_control>'
)


def with_joint(inside: str, name: str = "j3", kind: str = "revolute", more: str = "") -> str:
    """Return a URDF in which the joint `name` has this content and `more` follows."""
    number = int(name[1:])
    return simple_urdf(more, **{name: joint_xml(name, f"l{number - 1}", f"l{number}", kind, inside)})


NOTED = [
    (with_joint(NARROW + SOFT.format(-1, 1)), "'j3' -1 to 1"),
    (with_joint(NARROW + SOFT.format(-2, 2)), None),
    (with_joint(NARROW + SOFT.format(-3, 1.9)), "'j3' -3 to 1.9"),
    (with_joint(NARROW + SOFT.format("a", "b")), "a to b"),
    (with_joint(SOFT.format(-1, 1), kind="continuous"), "'j3' -1 to 1"),
    (with_joint(NARROW, more=CONTROL.format("j3", "position", -1, 1)), "'j3' -1 to 1"),
    (with_joint(NARROW, more=CONTROL.format("j3", "position", -2, 2)), None),
    (with_joint(NARROW, more=CONTROL.format("j3", "velocity", -1, 1)), None),
    (with_joint(NARROW, more=CONTROL.format("finger", "position", -1, 1)), None),
    (with_joint('<limit lower="-2" upper="2" velocity="1" acceleration="3" jerk="9"/>'), "acceleration"),
    (with_joint('<limit upper="2" velocity="1"/>'), "'j3' states no lower limit"),
    (with_joint(NARROW + '<axis xyz="0 0 1"/><axis xyz="0 1 0"/>'), "'j3' has more than one <axis>"),
    (with_joint(NARROW, more='<drake:joint name="x"/>'), "<drake:joint> in line"),
    (with_joint(NARROW, more='<loop_joint name="x"/>'), "<loop_joint> in line"),
]  # fmt: skip


def test_a_part_that_is_not_used_is_noted_once() -> None:
    """`read_urdf` notes each part that bounds or moves joints and is not used, once."""
    for text, said in NOTED:
        notes = read_urdf(text.replace("<robot", '<robot xmlns:drake="d"', 1), "l0", "l7").notes
        assert len(notes) == (said is not None) and (said is None or said in notes[0]), (said, notes)


def test_soft_limits_of_many_joints_are_one_note() -> None:
    """`read_urdf` notes soft limits of all joints in one note."""
    text = simple_urdf().replace("</joint>", SOFT.format(-0.5, 0.5) + "</joint>")
    (note,) = read_urdf(text, "l0", "l7").notes
    assert all(repr(f"j{i}") in note for i in range(1, 8))


def test_the_first_of_two_parts_counts() -> None:
    """`read_urdf` takes the first of two axes of a joint."""
    twice = with_joint(NARROW + '<axis xyz="0 0 1"/><axis xyz="0 1 0"/>')
    np.testing.assert_array_equal(read_urdf(twice, "l0", "l7").joints[2].axis, [0, 0, 1])


def test_a_quaternion_places_a_joint_as_its_angles_do() -> None:
    """`read_urdf` reads quat_xyzw of an origin, of any length, as its angles."""
    angles = with_joint(NARROW + '<origin xyz="1 2 3" rpy="0 0 1.2"/>')
    half = 0.6
    quaternion = f"0 0 {5 * np.sin(half)!r} {5 * np.cos(half)!r}".replace("np.float64(", "").replace(")", "")
    as_quaternion = with_joint(NARROW + f'<origin xyz="1 2 3" quat_xyzw="{quaternion}"/>')
    one, other = (read_urdf(text, "l0", "l7").joints[2].origin for text in (angles, as_quaternion))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-15)


NOTHING = {
    'rpy="0 0 0" quat_xyzw="0 0 0 1"': "has rpy and quat_xyzw",
    'quat_xyzw="0 0 0 0"': "quat_xyzw of no length",
    'quat_xyzw="0 0 1"': "has 3 numbers, wanted 4",
    'xyz="0 0 1_0"': "<origin xyz='0 0 1_0'> is not 3 numbers",
    'xyz="0 0 \u0661"': "is not 3 numbers", 'xyz="0\u00a00 1"': "is not 3 numbers",
}  # fmt: skip


def test_origins_that_mean_nothing_are_refused() -> None:
    """`read_urdf` refuses origins with bad numbers, or with rpy and quat_xyzw, and says why."""
    assert not_refused(
        (ModelError, re.escape(said),
         lambda origin=origin: read_urdf(with_joint(f"{NARROW}<origin {origin}/>"), "l0", "l7"))
        for origin, said in NOTHING.items()
    ) == []  # fmt: skip


@pytest.mark.parametrize("still", [["j3"], ["j1", "j6"]])
def test_joints_without_range_are_named(still: list[str]) -> None:
    """`from_urdf` warns of joints whose limits are 0 to 0, and names them."""
    text = PLAIN.with_(lower=-2, upper=2).to_urdf()
    for name in still:
        at = text.index(f'name="joint_{name[1]}"')
        text = text[:at] + text[at:].replace('lower="-2.0" upper="2.0"', 'lower="0" upper="0"', 1)
    with pytest.warns(UserWarning, match="limits"):
        arm = Arm.from_urdf(text)
    assert arm.report is not None
    (note,) = arm.report.notes
    assert all(f"'joint_{name[1]}'" in note for name in still)


def test_limits_of_rad_that_are_read_as_degrees_are_noted() -> None:
    """`from_urdf` warns of limits so small that they look like rad taken for degrees."""
    arm = PLAIN.with_(lower=np.radians(-2.4), upper=np.radians(2.4))
    with pytest.warns(UserWarning, match="look like rad"):
        report = Arm.from_urdf(arm.to_urdf()).report
    assert report is not None and len(report.notes) == 1


def test_a_comment_may_be_in_any_encoding() -> None:
    """`read_urdf` reads a file with a comment in another encoding, with a note if it is not declared."""
    for codec in ("gbk", "latin-1", "shift_jis", "utf-8"):
        for declared in (None, "utf-8", "itself"):
            read_with_a_comment(codec, declared)


def read_with_a_comment(codec: str, declared: str | None) -> None:
    """Check that a URDF with a comment in `codec` is read, whatever encoding it declares."""
    word = {"latin-1": "Gr\u00f6\u00dfe"}.get(codec, "\u6a5f\u68b0")
    body = simple_urdf("<visual/>").replace("<robot", f"<!-- {word} -->\n<robot", 1)
    head = "" if declared is None else f'<?xml version="1.0" encoding="{declared}"?>\n'
    text = head.replace("itself", codec).encode() + body[body.index("<!--") :].encode(codec)
    chain = read_urdf(text, "l0", "l7")
    known = codec == "utf-8" or declared == "itself"
    assert [joint.name for joint in chain.joints] == [f"j{i}" for i in range(1, 8)]
    assert len(chain.notes) == (not known)


def test_names_in_another_encoding_stay_apart_and_shapes_are_found() -> None:
    """`Body.from_urdf` finds the shapes of a link named in another encoding."""
    text = PLAIN.to_urdf()
    text = text[text.index("<robot") :]
    ball = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
    named = text.replace("link_1", "\u00e4").replace("link_2", "\u00f6")
    named = named.replace('<link name="\u00e4" />', f'<link name="\u00e4">{ball}</link>')
    assert "sphere" in named
    body = Body.from_urdf(named.encode("latin-1"))
    assert len(body.links) == 1


def test_an_encoding_that_does_not_exist_is_named() -> None:
    """`read_urdf` refuses an unknown encoding."""
    with pytest.raises(ModelError, match="unknown encoding"):
        read_urdf(b'<?xml version="1.0" encoding="klingon"?>' + simple_urdf().encode())
