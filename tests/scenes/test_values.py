"""Shapes, scenes and bodies are frozen values; what is wrong with them is said at once."""

from __future__ import annotations

import dataclasses
import pickle
from typing import Any

import numpy as np
import pytest

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
    arm = ARM.with_(body=VALUES[5]).with_(hand=[VALUES[2]])
    again = pickle.loads(pickle.dumps(arm))
    assert again == arm and again.body == VALUES[5] and again.hand == (VALUES[2],)
    assert eval(repr(arm), {**SCOPE}) == arm
    assert arm != ARM and arm.with_(body=None).with_(hand=[]) == ARM
    assert arm.with_tool(np.eye(4)).body == arm.body


def test_bones_say_what_they_leave_bare_and_what_was_meant_in_mm() -> None:
    for body in (
        aa.Body.bones(upper_arm=0.09, forearm=0.08),
        aa.Arm.from_catalogue("openarm_v10").with_(body="guessed").body,
    ):
        assert body is not None and "the flange and the tool: arm.with_(hand=...) does" in body.notes[-1]
    with pytest.raises(aa.SceneError, match=r"upper_arm is 70\.0, wanted a radius in m: was this in mm\?"):
        aa.Body.bones(upper_arm=70, forearm=60)


@pytest.mark.parametrize("name", srs_catalogue())
def test_any_arm_has_a_guessed_body_that_says_so(name: str) -> None:
    arm = aa.Arm.from_catalogue(name).with_(body="guessed")
    assert arm.body is not None and not arm.body.trusted
    radius = round(0.12 * (arm.d_se + arm.d_ew), 4)
    assert arm.body == aa.Body.bones(upper_arm=radius, forearm=radius, plates=True)
    assert "not measured: not trusted" in arm.body.notes[0] and f"{1e3 * radius:g} mm" in arm.body.notes[0]
    best = arm.solve(arm.forward(np.clip(np.full(7, 0.7), arm.lower, arm.upper))[0], prefer="margin")
    far = aa.Scene([aa.Ball([0, 0, 50.0], 0.1)])
    assert arm._clear(best.pose, best.gc, far).is_full
    assert arm.with_(body="guessed") == arm and arm.with_(body=None).body is None
    assert aa.Body.bones(upper_arm=0.1, forearm=0.1).trusted


def test_names_are_those_given_or_kind_and_place() -> None:
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
    again = pickle.loads(pickle.dumps(value))
    assert again == value and hash(again) == hash(value)
    assert all(value != other for other in ARRAYS if other is not value)
    assert type(value).__name__ in repr(value) and len(repr(value)) < 90
    with pytest.raises(dataclasses.FrozenInstanceError):
        value.name = "other"
    held = value.distance if isinstance(value, aa.Field) else value.points
    with pytest.raises(ValueError, match="read-only"):
        held[0] = 0


WRONG: list[tuple[Any, str]] = [
    (lambda: aa.Ball([0, 0, float("nan")], 0.1), r"Ball: center is \[0.0, 0.0, nan\], wanted finite"),
    (lambda: aa.Ball([0, 0], 0.1), r"Ball: center is \[0, 0\], wanted three numbers \(m\), not shape \(2,\)"),
    (lambda: aa.Ball("x", 0.1), "Ball: center is 'x', wanted three numbers"),
    (lambda: aa.Ball([0, 0, 0], -0.1), r"Ball: radius is -0.1, wanted a length in \[0, 1000\] m"),
    (lambda: aa.Ball([0, 0, 0], "x"), "Ball: radius is 'x', wanted a number"),
    (lambda: aa.Ball([0, 0, 0], "0.1"), "Ball: radius is '0.1', wanted a number"),
    (lambda: aa.Ball([0, 0, 0], True), "Ball: radius is True, wanted a number"),
    (lambda: aa.Ball([0, 0, 0], 0.1, name=3), "Ball: name is 3, wanted a word"),
    (lambda: aa.Ball([2500.0, 0, 0], 0.1), "wanted finite numbers within ±1000 m"),
    (lambda: aa.Capsule([0, 0, 0], [0, 0, np.inf], 0.1), "Capsule: end is"),
    (lambda: aa.Hull([]), r"Hull: points is \(0,\), wanted points \(m\), an array of shape \(N, 3\)"),
    (lambda: aa.Hull([[0, 0, 0], [0, np.nan, 0]]), r"Hull: points\[1\] is \[0.0, nan, 0.0\], wanted finite"),
    (lambda: aa.Hull([[0, 0, 1e6]]), r"Hull: points\[0\] is .* wanted finite numbers within ±1000 m"),
    (lambda: aa.Hull([[0, 0, 0]], -0.1), "Hull: radius is -0.1"),
    (lambda: aa.Field(np.zeros((2, 2)), [0, 0, 0], 0.1), r"Field: distance is \(2, 2\), wanted distances"),
    (lambda: aa.Field(np.zeros((2, 2, 1)), [0, 0, 0], 0.1), "each at least 2"),
    (lambda: aa.Field(np.zeros((2, 2, 2)), [0, 0, 0], 0.0), "Field: spacing is 0.0, wanted a length in"),
    (lambda: aa.Field(np.full((2, 2, 2), np.nan), [0, 0, 0], 1), r"Field: distance\[\(0, 0, 0\)\] is nan"),
    (lambda: aa.Field(np.zeros((2, 2, 2)), [999, 0, 0], 1), "Field: origin is"),
    (lambda: aa.Field(50.0 * np.arange(64).reshape(4, 4, 4) % 400, [0, 0, 0], 0.05), "change no faster"),
    (lambda: aa.Box(np.eye(4), [1, -1, 1]), r"Box: size is \(1.0, -1.0, 1.0\), wanted edges >= 0"),
    (lambda: aa.HalfSpace([0, 0, 0], 1), "HalfSpace: normal is .*, wanted a direction"),
    (lambda: aa.Scene("x"), "Scene: shapes is 'x', wanted a sequence of Ball, Capsule, Box, HalfSpace"),
    (lambda: aa.Scene([3]), r"Scene: shapes\[0\] is 3, wanted Ball"),
    (lambda: aa.Scene([VALUES[0], VALUES[0]]).names, None),
    (lambda: aa.Scene([VALUES[1], VALUES[1]]), r"shapes\[1\]: name is 'post', wanted a name that no other"),
    (lambda: aa.Scene([], clearance=-1), "Scene: clearance is -1.0"),
    (lambda: aa.Scene([], ignore=["ab"]), r"Scene: ignore\[0\] is 'ab', wanted pairs of names"),
    (lambda: aa.Body({}), r"Body: links is {}, wanted a mapping of at least one DH frame \(0..7\) to balls"),
    (lambda: aa.Body({8: [VALUES[0]]}), "Body: links is 8, wanted a DH frame, an integer from 0 to 7"),
    (lambda: aa.Body({3: [VALUES[2]]}), r"Body link 3: shapes\[0\] is Box.*, wanted Ball, Capsule"),
    (lambda: aa.Body({3: [aa.Ball([0, 0, 0], 0.0)]}), r"Body link 3: shapes\[0\] is .*, wanted a radius > 0"),
    (lambda: aa.Body.bones(upper_arm=0.0, forearm=0.1), r"Body.bones: upper_arm is 0.0, wanted a length in"),
    (lambda: aa.Body({3: [aa.Ball([0, 0, 0], 90)]}), r"Body link 3: shapes\[0\].radius is 90.0, .* in mm\?"),
    (lambda: aa.Cloud([[0, 0, 0]], 5), r"Cloud: radius is 5.0, wanted a radius in m: was this in mm\?"),
    (lambda: ARM.with_(body=3), r"arm: body is 3, wanted an armangle\.Body, as Body\(.*\), or None"),
    (lambda: ARM.with_(hand=[VALUES[3]]), r"hand: shapes\[0\] is HalfSpace.*, wanted Ball, Capsule, Box"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "message"), WRONG, ids=[str(k) for k in range(len(WRONG))])
def test_what_is_wrong_is_said(make: Any, message: str | None) -> None:
    if message is None:
        make()
        return
    with pytest.raises(aa.SceneError, match=message) as caught:
        make()
    assert isinstance(caught.value, aa.InputError)
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value) and again.shape == caught.value.shape


def test_the_pose_of_a_box_is_refused_as_any_pose() -> None:
    with pytest.raises(aa.InputError, match=r"^pose has shape \(3, 3\), wanted \(..., 4, 4\): a rotation"):
        aa.Box(np.eye(3), [1, 1, 1])
    with pytest.raises(aa.InputError, match=r"^pose has 3 in its last row"):
        aa.Box(3 * np.eye(4), [1, 1, 1])


def test_an_arm_without_a_body_cannot_be_asked() -> None:
    scene = aa.Scene([VALUES[0]])
    with pytest.raises(aa.SceneError, match=r"arm: body is None, wanted a body: arm.with_\(body=Body.bones"):
        ARM._clear(np.eye(4), 0, scene)
    with pytest.raises(aa.SceneError, match="scene is None, wanted an armangle"):
        ARM.with_(body=VALUES[5])._clear(np.eye(4), 0, None)
    with pytest.raises(aa.SceneError, match="scene is 3, wanted an armangle"):
        ARM.with_(body=VALUES[5]).with_(scene=3).feasible(np.eye(4), 0)


IN_ANOTHER_ORDER = [
    (lambda arm, q, scene: aa.step(arm.with_(scene=[aa.Ball([0, 0, 5], 0.1)]), q, np.eye(4)),
     r"a list of shapes, wanted an armangle.Scene; of shapes one is made by Scene\(\[...\]\)"),
    (lambda arm, q, scene: aa.follow(arm, np.eye(4)[None], start=q, scene=[aa.Ball([0, 0, 5], 0.1)]),
     r"a list of shapes, wanted one Scene for all poses, or one for each; of shapes one is made by"),
]  # fmt: skip


@pytest.mark.parametrize(("ask", "why"), IN_ANOTHER_ORDER, ids=[str(k) for k in range(len(IN_ANOTHER_ORDER))])
def test_what_is_asked_in_another_order_is_told_the_right_one(ask: Any, why: str) -> None:
    with pytest.raises(aa.InputError, match=why):
        ask(ARM.with_(body="guessed"), np.zeros(7), aa.Scene([VALUES[0]]))


MILLIMETRES = [
    ([aa.Box(aa.pose([600, 0, 200]), [800, 900, 40], name="table")], {}, "table: thickness is 40.0"),
    ([aa.Ball([600, 0, 200], 100)], {}, "ball_0: thickness is 200.0, wanted at most 12.7 m"),
    ([aa.Capsule([600, 0, 200], [600, 0, 400], 30)], {}, "capsule_0: thickness is 60.0"),
    ([aa.Hull(np.eye(3)[[0, 1, 2, 2]] * 400 + [[0], [0], [0], [300]])], {}, "hull_0: thickness is"),
    ([aa.Field(np.full((9, 9, 9), 50.0), [0, 0, 0], 20)], {}, "field_0: thickness is 160.0"),
    ([], {"clearance": 20}, "Scene: clearance is 20.0, wanted at most 5.06 m for such an arm: was this in"),
    ([], {"soft": 30}, "Scene: soft is 30.0"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("shapes", "kept", "why"), MILLIMETRES, ids=[str(k) for k in range(len(MILLIMETRES))]
)
def test_a_scene_in_millimetres_is_refused(shapes: list[Any], kept: dict[str, float], why: str) -> None:
    arm, scene = ARM.with_(body="guessed"), aa.Scene(shapes, **kept)
    for ask in (
        lambda: arm._clear(np.eye(4), 0, scene),
        lambda: arm.clearance(arm.inverse(np.eye(4), 0.0, 0, limits=False), scene),
    ):
        with pytest.raises(aa.SceneError, match=why):
            ask()


def test_a_hand_in_millimetres_is_refused_and_a_large_floor_is_not() -> None:
    with pytest.raises(aa.SceneError, match=r"drill: thickness is 60\.0"):
        ARM.with_(hand=[aa.Ball([0, 0, 100], 30, name="drill")])._clear(np.eye(4), 0, aa.Scene([]))
    floor = aa.Scene([aa.Box(aa.pose([0, 0, -0.5]), [400, 400, 1.0])], ignore=[("box_0", "upper_arm")])
    pose, _, gc = ARM.forward(np.radians([0, 30, 0, -60, 0, 40, 0]))
    assert ARM.with_(body="guessed")._clear(pose, gc, floor).status is aa.Status.OK


def test_names_in_ignore_must_be_known() -> None:
    arm = ARM.with_(body=VALUES[6])
    for pair, what in ((("shelf", "upper_arm"), "obstacle"), (("lamp", "elbow"), "link")):
        scene = aa.Scene([aa.Ball([1, 2, 3], 0.1, name="lamp")], ignore=[pair])
        with pytest.raises(aa.SceneError, match=rf"Scene: ignore\[0\] is .*, wanted the name of an? {what}"):
            arm._clear(np.eye(4), 0, scene)
