"""Shapes, scenes and bodies are frozen values; what is wrong with them is said at once."""

from __future__ import annotations

import dataclasses
import pickle
from typing import Any

import numpy as np
import pytest
from support.refused import Row, not_refused

import armangle as aa
from armangle.models.catalogue import srs_catalogue

SCOPE = {name: getattr(aa, name) for name in ("Ball", "Capsule", "Box", "HalfSpace", "Scene", "Body", "Arm")}
VALUES = [
    aa.Ball([1, 2, 3], 0.1),
    aa.Capsule([0, 0, 0], [0, 0, 1], 0.1, name="post"),
    aa.Box(aa.pose([0, 0, 1], rpy=[0.1, 0.2, 0.3]), [1, 2, 3], 0.01, name="box"),
    aa.HalfSpace([0, 0, 1], 0.2),
    aa.Scene([aa.Ball([1, 2, 3], 0.1, name="lamp")], clearance=0.1, ignore=[("lamp", "upper_arm")]),
    aa.Body({3: [aa.Ball([0, 0, 0], 0.1)], 4: [aa.Capsule([0, 0, 0], [0, 0, 0.1], 0.2)]}),
    aa.Body.bones(upper_arm=0.1, forearm=0.09, plates=True),
]
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_a_value_is_frozen_and_its_repr_pastes_back(value: Any) -> None:
    assert eval(repr(value), SCOPE) == value
    assert hash(value) == hash(pickle.loads(pickle.dumps(value)))
    assert pickle.loads(pickle.dumps(value)) == value
    with pytest.raises(dataclasses.FrozenInstanceError):
        value.name = "other"


def test_an_arm_keeps_its_body_and_hand() -> None:
    """An S-R-S arm keeps model and gripper in pickles, repr and `with_tool`."""
    arm = ARM.with_(body=VALUES[5]).with_(hand=[VALUES[2]])
    again = pickle.loads(pickle.dumps(arm))
    assert again == arm and again.body == VALUES[5] and again.hand == (VALUES[2],)
    assert eval(repr(arm), {**SCOPE}) == arm
    assert arm != ARM and arm.with_(body=None).with_(hand=[]) == ARM
    assert arm.with_tool(np.eye(4)).body == arm.body


def test_bones_say_what_they_leave_bare() -> None:
    """The notes of `Body.bones` and of a guessed model say that flange and tool have no shapes."""
    for body in (
        aa.Body.bones(upper_arm=0.09, forearm=0.08),
        aa.Arm.from_catalogue("openarm_v10").with_(body="guessed").body,
    ):
        assert body is not None and "the flange and the tool: arm.with_(hand=...) does" in body.notes[-1]


@pytest.mark.parametrize("name", srs_catalogue())
def test_any_arm_has_a_guessed_body_that_says_so(name: str) -> None:
    """`with_(body="guessed")` gives a body of bones, marked as not trusted."""
    arm = aa.Arm.from_catalogue(name).with_(body="guessed")
    assert arm.body is not None and not arm.body.trusted
    radius = round(0.12 * (arm.geometry.d_se + arm.geometry.d_ew), 4)
    assert arm.body == aa.Body.bones(upper_arm=radius, forearm=radius, plates=True)
    assert "not measured: not trusted" in arm.body.notes[0] and f"{1e3 * radius:g} mm" in arm.body.notes[0]
    best = arm.solve(arm.forward(np.clip(np.full(7, 0.7), arm.lower, arm.upper))[0], prefer="margin")
    far = aa.Scene([aa.Ball([0, 0, 50.0], 0.1)])
    assert arm._clear(best.pose, best.gc, far).is_full
    assert arm.with_(body="guessed") == arm and arm.with_(body=None).body is None
    assert aa.Body.bones(upper_arm=0.1, forearm=0.1).trusted


def test_names_are_those_given_or_kind_and_place() -> None:
    """A scene names shapes without a name by kind and place."""
    box = aa.Box(np.eye(4), [1, 1, 1], name="b")
    scene = aa.Scene([aa.Ball([0, 0, 0], 1), box, aa.HalfSpace([0, 0, 1], 0)])
    assert scene.names == ("ball_0", "b", "half_space_2")


ARRAYS = [
    aa.Cloud([[1, 2, 3], [4, 5, 6]], 0.1, name="seen"),
    aa.Hull([[1, 2, 3], [4, 5, 6]], 0.1),
    aa.Field(np.zeros((2, 3, 4)), [1, 2, 3], 0.1, name="seen"),
]


@pytest.mark.parametrize("value", ARRAYS, ids=lambda value: type(value).__name__)
def test_a_shape_of_many_numbers_is_a_value_too(value: Any) -> None:
    """Clouds, hulls and fields compare, hash, pickle, have short reprs and are read-only."""
    again = pickle.loads(pickle.dumps(value))
    assert again == value and hash(again) == hash(value)
    assert all(value != other for other in ARRAYS if other is not value)
    assert type(value).__name__ in repr(value) and len(repr(value)) < 90
    with pytest.raises(dataclasses.FrozenInstanceError):
        value.name = "other"
    held = value.distance if isinstance(value, aa.Field) else value.points
    with pytest.raises(ValueError, match="read-only"):
        held[0] = 0


BALL, BOX = VALUES[0], VALUES[2]
WRONG: list[tuple[str, Any]] = [
    (r"Ball: center is \[0.0, 0.0, nan\]", lambda: aa.Ball([0, 0, float("nan")], 0.1)),
    (r"Ball: center is \[0, 0\], .* shape \(2,\)", lambda: aa.Ball([0, 0], 0.1)),
    ("Ball: center is 'x'", lambda: aa.Ball("x", 0.1)), ("1000 m", lambda: aa.Ball([2500.0, 0, 0], 0.1)),
    *((f"Ball: radius is {value!r}", lambda value=value: aa.Ball([0, 0, 0], value))
      for value in (-0.1, "x", "0.1", True)),
    ("Ball: name is 3", lambda: aa.Ball([0, 0, 0], 0.1, name=3)),
    ("Capsule: end is", lambda: aa.Capsule([0, 0, 0], [0, 0, np.inf], 0.1)),
    (r"Hull: points is \(0,\), .* \(N, 3\)", lambda: aa.Hull([])),
    ("Hull: radius", lambda: aa.Hull([[0, 0, 0]], -0.1)),
    (r"Hull: points\[1\] is \[0.0, nan, 0.0\]", lambda: aa.Hull([[0, 0, 0], [0, np.nan, 0]])),
    (r"Hull: points\[0\] is .*1000 m", lambda: aa.Hull([[0, 0, 1e6]])),
    (r"Field: distance is \(2, 2\)", lambda: aa.Field(np.zeros((2, 2)), [0, 0, 0], 0.1)),
    ("at least 2", lambda: aa.Field(np.zeros((2, 2, 1)), [0, 0, 0], 0.1)),
    ("Field: spacing is 0.0", lambda: aa.Field(np.zeros((2, 2, 2)), [0, 0, 0], 0.0)),
    (r"Field: distance\[\(0, 0, 0\)\] is nan", lambda: aa.Field(np.full((2, 2, 2), np.nan), [0, 0, 0], 1)),
    ("Field: origin is", lambda: aa.Field(np.zeros((2, 2, 2)), [999, 0, 0], 1)),
    ("no faster", lambda: aa.Field(50.0 * np.arange(64).reshape(4, 4, 4) % 400, [0, 0, 0], 0.05)),
    (r"Box: size is \(1.0, -1.0, 1.0\)", lambda: aa.Box(np.eye(4), [1, -1, 1])),
    ("HalfSpace: normal is", lambda: aa.HalfSpace([0, 0, 0], 1)),
    ("Scene: shapes is 'x'", lambda: aa.Scene("x")),
    (r"Scene: shapes\[0\] is 3", lambda: aa.Scene([3])),
    (r"shapes\[1\]: name is 'post'", lambda: aa.Scene([VALUES[1], VALUES[1]])),
    ("Scene: clearance is -1.0", lambda: aa.Scene([], clearance=-1)),
    (r"Scene: ignore\[0\] is 'ab'", lambda: aa.Scene([], ignore=["ab"])),
    ("Body: links is {}", lambda: aa.Body({})),
    ("Body: links is 8", lambda: aa.Body({8: [BALL]})),
    (r"Body link 3: shapes\[0\] is Box", lambda: aa.Body({3: [BOX]})),
    (r"Body link 3: shapes\[0\] is .*radius > 0", lambda: aa.Body({3: [aa.Ball([0, 0, 0], 0.0)]})),
    (r"Body link 3: shapes\[0\].radius is 90.0, .* in mm\?", lambda: aa.Body({3: [aa.Ball([0, 0, 0], 90)]})),
    ("Body.bones: upper_arm is 0.0", lambda: aa.Body.bones(upper_arm=0.0, forearm=0.1)),
    (r"upper_arm is 70\.0, .* in mm\?", lambda: aa.Body.bones(upper_arm=70, forearm=60)),
    (r"Cloud: points\[2\] is \[6.0, inf, 8.0\]",
     lambda: aa.Cloud([[0, 1, 2], [3, 4, 5], [6, np.inf, 8]], 0.1)),
    (r"points\[1\] is .*1000 m", lambda: aa.Cloud([[0, 1, 2], [3000, 4, 5]], 0.1)),
    (r"Cloud: radius is 5.0, .* in mm\?", lambda: aa.Cloud([[0, 0, 0]], 5)),
    ("arm: body is 3", lambda: ARM.with_(body=3)), ("hand: shapes", lambda: ARM.with_(hand=[VALUES[3]])),
    ("arm: body is None", lambda: ARM._clear(np.eye(4), 0, aa.Scene([BALL]))),
    ("scene is None", lambda: ARM.with_(body=VALUES[5])._clear(np.eye(4), 0, None)),
    ("scene is 3", lambda: ARM.with_(body=VALUES[5]).with_(scene=3).feasible(np.eye(4), 0)),
    (r"drill: thickness is 60\.0",
     lambda: ARM.with_(hand=[aa.Ball([0, 0, 100], 30, name="drill")])._clear(np.eye(4), 0, aa.Scene([]))),
    *((rf"Scene: ignore\[0\] is .* {what}",
      lambda pair=pair: ARM.with_(body=VALUES[6])._clear(np.eye(4), 0,
       aa.Scene([aa.Ball([1, 2, 3], 0.1, name="lamp")], ignore=[pair])))
      for pair, what in ((("shelf", "upper_arm"), "obstacle"), (("lamp", "elbow"), "link"))),
]  # fmt: skip
GUESSED, LIST = ARM.with_(body="guessed"), [aa.Ball([0, 0, 5], 0.1)]
OF_INPUT: list[tuple[str, Any]] = [
    (r"^pose has shape \(3, 3\)", lambda: aa.Box(np.eye(3), [1, 1, 1])),
    ("^pose has 3 in its last row", lambda: aa.Box(3 * np.eye(4), [1, 1, 1])),
    (r"a list of shapes.*Scene\(\[", lambda: aa.step(GUESSED.with_(scene=LIST), np.zeros(7), np.eye(4))),
    (
        "a list of shapes.*one for each",
        lambda: aa.follow(GUESSED, np.eye(4)[None], start=np.zeros(7), scene=LIST),
    ),
]
MILLIMETRES: list[tuple[str, Any]] = [
    ("table: thickness is 40.0", aa.Scene([aa.Box(aa.pose([600, 0, 200]), [800, 900, 40], name="table")])),
    ("ball_0: thickness is 200.0, .*12.7 m", aa.Scene([aa.Ball([600, 0, 200], 100)])),
    ("capsule_0: thickness is 60.0", aa.Scene([aa.Capsule([600, 0, 200], [600, 0, 400], 30)])),
    ("hull_0: thickness", aa.Scene([aa.Hull(np.eye(3)[[0, 1, 2, 2]] * 400 + [[0], [0], [0], [300]])])),
    ("field_0: thickness is 160.0", aa.Scene([aa.Field(np.full((9, 9, 9), 50.0), [0, 0, 0], 20)])),
    ("Scene: clearance is 20.0, .*5.06 m", aa.Scene([], clearance=20)),
    ("Scene: soft is 30.0", aa.Scene([], soft=30)),
]  # fmt: skip


def test_what_is_wrong_is_said() -> None:
    """Shapes, scenes and models refuse bad values with what is wrong; SceneError pickles."""
    q = GUESSED.inverse(np.eye(4), 0.0, 0, limits=False)
    rows: list[Row] = [(aa.SceneError, said, make) for said, make in WRONG]
    rows += [(aa.InputError, said, make) for said, make in OF_INPUT]
    for said, scene in MILLIMETRES:
        rows.append((aa.SceneError, said, lambda scene=scene: GUESSED._clear(np.eye(4), 0, scene)))
        rows.append((aa.SceneError, said, lambda scene=scene: GUESSED.clearance(q, scene)))
    assert not_refused(rows) == []
    assert aa.Scene([BALL, BALL]).names == ("ball_0", "ball_1")
    with pytest.raises(aa.SceneError) as caught:
        aa.Ball([0, 0], 0.1)
    again = pickle.loads(pickle.dumps(caught.value))
    assert isinstance(again, aa.InputError) and str(again) == str(caught.value)
    assert again.shape == caught.value.shape


def test_a_large_floor_is_not_in_millimetres() -> None:
    """A floor of 400 m is not taken for one in mm."""
    floor = aa.Scene([aa.Box(aa.pose([0, 0, -0.5]), [400, 400, 1.0])], ignore=[("box_0", "upper_arm")])
    pose, _, gc = ARM.forward(np.radians([0, 30, 0, -60, 0, 40, 0]))
    assert GUESSED._clear(pose, gc, floor).status is aa.Status.OK
