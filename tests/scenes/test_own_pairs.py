"""Own links that are proven never to meet are left out, and nothing changes by it but the time."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray
from support.draw import count, generator

import armangle as aa
from armangle.scenes import ready
from armangle.scenes.ready import link_pairs, make_ready, never_nearer

Floats = NDArray[np.float64]
NAMES = ["kuka_iiwa7_r800", "barrett_wam7", "yaskawa_sia5d", "openarm_v10"]


def body_of(rng: np.random.Generator) -> aa.Body:
    """A collision model with two balls and a capsule on every link."""
    links = {}
    for frame in range(8):
        ball = aa.Ball(rng.normal(size=3) * 0.05, rng.uniform(0.02, 0.06))
        begin = rng.normal(size=3) * 0.06
        rod = aa.Capsule(begin, begin + rng.normal(size=3) * 0.05, rng.uniform(0.02, 0.05))
        links[frame] = [ball, rod, aa.Ball([0, 0, rng.uniform(0, 0.1)], 0.05)]
    return aa.Body(links)


def distances(arm: aa.Arm, q: Floats) -> Floats:
    """The least distance (n, n) of each two shapes of the model over joints (m, 7), from points along
    both.
    """
    frames = arm.frames(q)
    share = np.linspace(0, 1, 9)[:, None]
    points, radii = [], []
    for frame, shape in never_nearer(arm)[0]:
        assert isinstance(shape, aa.Ball | aa.Capsule)
        begin, end = (shape.center,) * 2 if isinstance(shape, aa.Ball) else (shape.begin, shape.end)
        along = np.array(begin) + share * np.subtract(end, begin)
        at = frames[:, frame]
        points.append(along @ at[:, :3, :3].transpose(0, 2, 1) + at[:, None, :3, 3])
        radii.append(shape.radius)
    out = np.empty((len(radii), len(radii)))
    for i, one in enumerate(points):
        for j, other in enumerate(points):
            apart = np.linalg.norm(one[:, :, None] - other[:, None], axis=-1).min()
            out[i, j] = apart - radii[i] - radii[j]
    return out


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", NAMES)
def test_no_posture_brings_shapes_nearer_than_is_proven(name: str) -> None:
    """The proven lower bounds of own pairs hold at random joints, and are not far below."""
    rng = generator(31, len(name))
    arm = aa.Arm.from_catalogue(name).with_(body=body_of(rng))
    _, proven = never_nearer(arm)
    met = distances(arm, rng.uniform(-np.pi, np.pi, (count(400), 7)))
    known = proven > -np.inf
    assert known.sum() > 60 and (proven == proven.T).all()
    assert (proven[known] <= met[known]).all()
    assert (proven[known] >= 0.3 * met[known]).sum() > 20


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", NAMES)
def test_arcs_are_the_same_bit_for_bit_without_the_proof(name: str) -> None:
    """Arcs are the same to the bit if no own pair is left out."""
    rng = generator(32, len(name))
    arm = aa.Arm.from_catalogue(name).with_(body=body_of(rng))
    blocked = 0
    for clearance in (0.0, 0.03):
        scene = aa.Scene([aa.Ball([0.3, 0.1, 0.6], 0.1)], clearance=clearance)
        ready = make_ready(arm, scene)
        asked = make_ready(arm, scene, ready._replace(apart=np.full_like(ready.apart, -np.inf)))
        assert (ready.apart > clearance).any()
        pose, _, gc = arm.forward(rng.uniform(-2, 2, (count(40), 7)))
        own = arm.with_(scene=scene)
        arcs = own._clear(pose, gc, scene)
        object.__setattr__(own, "_ready", asked)
        whole = own._clear(pose, gc, scene)
        for k in range(len(gc)):
            assert arcs[k].status is whole[k].status
            assert str(arcs[k].ends) == str(whole[k].ends)  # their values are NaN
            assert np.array_equal(arcs[k].intervals, whole[k].intervals)
            blocked += not arcs[k].is_full
    assert blocked > 10


def test_pairs_say_which_are_proven_which_are_asked_and_which_are_let_touch() -> None:
    """`link_pairs` gives the bound of proven pairs, None for others, and which are ignored."""
    balls = {
        1: [aa.Ball([0, 0.05, 0], 0.05)],
        3: [aa.Ball([0, 0, 0], 0.05)],
        5: [aa.Ball([0, 0, 0.05], 0.05)],
    }
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body(balls, ignore=[("link_3", "link_5")]))
    pairs = {pair.links: pair for pair in link_pairs(arm)}
    assert list(pairs) == [("link_1", "link_3"), ("link_1", "link_5"), ("link_3", "link_5")]
    near = pairs["link_1", "link_3"].apart
    assert near is not None and 0.1 < near <= 0.25  # 0.25 m: d_se of 0.4 m less the radii and 0.05 m
    assert pairs["link_1", "link_5"].apart is None  # a folded elbow brings the wrist to the shoulder
    assert [pair.ignored for pair in pairs.values()] == [False, False, True]


def test_shapes_that_are_always_near_are_so_in_all_postures() -> None:
    """A pair that is said to be always too near is so at random joints."""
    rng, seen = generator(33), 0
    for name in NAMES * 3:
        arm = aa.Arm.from_catalogue(name).with_(body=body_of(rng))
        scene = aa.Scene(clearance=float(rng.uniform(0.0, 0.1)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            ready = make_ready(arm, scene)
        code, most = ready.handle.always_near(arm._handle)
        pair = ready.names.pair(code)
        if pair is None:
            continue
        links = [shape.name or f"link_{frame}" for frame, shape in never_nearer(arm)[0]]
        own = np.ix_(*[[k for k, link in enumerate(links) if link == one] for one in pair])
        for q in rng.uniform(-np.pi, np.pi, (count(8), 1, 7)):
            assert distances(arm, q)[own].min() <= most + 0.008  # points along the rods: a part of 0.1 m more
        assert most < scene.clearance
        seen += 1
    assert seen > 3


def test_a_hand_that_overlaps_the_forearm_is_named() -> None:
    """A gripper that overlaps the forearm in all postures is warned of, unless the pair is ignored."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
    hand = [aa.Capsule([0, 0, 0], [0, 0, 0.15], 0.06, name="drill")]
    q = np.radians([20, 45, 10, -80, 10, 60, 0])
    pose, _, gc = arm.forward(q)
    with pytest.warns(UserWarning, match=r"drill and forearm of this arm overlap by at least 14 mm, in"):
        assert arm.with_(hand=hand)._clear(pose, gc, aa.Scene()).is_empty
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not arm.with_(hand=hand)._clear(pose, gc, aa.Scene(ignore=[("drill", "forearm")])).is_empty


def test_an_arm_measures_its_own_links_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """An arm computes the bounds of its own pairs once for all scenes, with the same distances as a
    new arm.
    """
    measured = []
    honest = ready.never_nearer
    monkeypatch.setattr(ready, "never_nearer", lambda arm: measured.append(arm) or honest(arm))
    rng = generator(32)
    body, q = body_of(rng), rng.uniform(-1, 1, (20, 7))
    scenes = [aa.Scene([aa.Ball([0.4, 0.1 * k, 0.5], 0.1)]) for k in range(3)]
    for name in ("kuka_iiwa7_r800", "franka_fr3"):
        arm = aa.Arm.from_catalogue(name).with_(body=body)
        measured.clear()
        found = [arm.clearance(q, scene).distance for scene in scenes]
        found += [arm.with_(scene=scene).clearance(q).distance for scene in scenes]
        assert len(measured) == 1, name
        for k, distance in enumerate(found):
            fresh = aa.Arm.from_catalogue(name).with_(body=body, scene=scenes[k % 3])
            assert np.array_equal(distance, fresh.clearance(q).distance)
