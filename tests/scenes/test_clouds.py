"""Clouds: the same arcs as their points as balls, whatever their order and number."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.draw import count, generator
from support.touching import ends, from_segment, least_distance, moved

import armangle as aa

ARM = aa.Arm.from_catalogue("barrett_wam7").with_(base=aa.pose([0.1, 0.2, 0.3], rpy=[0.1, 0.2, 0.3]))
FREE = ARM.with_(lower=np.full(7, -np.inf), upper=np.full(7, np.inf))
"""The same arm without joint limits: its intervals are those that obstacles leave."""
BODY = aa.Body({
    0: [aa.Ball([0, 0, 0.05], 0.05, name="foot")],
    2: [aa.Ball([0.05, 0.03, 0.1], 0.04)],
    3: [aa.Capsule([-ARM.geometry.a_3, -ARM.geometry.d_se, 0], [-ARM.geometry.a_3, 0, 0], 0.05),
        aa.Ball([0, 0, 0], 0.06)],
    4: [aa.Capsule([0.02, 0.05, 0.1], [0.03, -0.06, 0.18], 0.03)],
})  # fmt: skip
BONES = aa.Body.bones(upper_arm=0.06, forearm=0.05, plates=True)
HAND = [aa.Capsule([0, 0, 0], [0, 0, 0.1], 0.04, name="hand")]
SHOULDER = ARM.frames(np.zeros(7))[1, :3, 3]


def seen(rng: np.random.Generator, number: int, near: float = 0.25) -> NDArray[np.float64]:
    """`number` points of a few patches and of dust around, none within `near` (m) of the shoulder."""
    patches = SHOULDER + rng.normal(size=(4, 3)) * 0.4
    points = patches[rng.integers(0, 4, 4 * number)] + rng.normal(size=(4 * number, 3)) * [0.1, 0.1, 0.005]
    points[::5] = SHOULDER + rng.uniform(-1.2, 1.2, (len(points[::5]), 3))
    far = np.linalg.norm(points - SHOULDER, axis=1) > near
    return points[far][:number]


def posed(rng: np.random.Generator, arm: aa.Arm) -> Any:
    """A random pose of the arm."""
    return arm.forward(rng.uniform(np.maximum(arm.lower, -2), np.minimum(arm.upper, 2)))[0]


@pytest.mark.turns(2)
@pytest.mark.parametrize("body", [BODY, BONES], ids=["swinging", "bones"])
@pytest.mark.parametrize("number", [1, 9, 300, 3000])
def test_a_cloud_is_its_points(body: aa.Body, number: int) -> None:
    """A cloud has the arcs, distances and links of its points as balls, in any order."""
    rng = generator(1, number)
    arm = FREE.with_(body=body).with_(hand=HAND)
    about: Any = {"clearance": 0.005, "ignore": [("hand", "forearm")] if body is BONES else []}
    for k in range(count(6 if number < 100 else 2)):
        points = seen(rng, number)
        pose, gc, psi = posed(rng, ARM), k % 8, rng.uniform(-3, 3)
        cloud = aa.Scene([aa.Cloud(points, 0.01, name="seen")], **about)
        balls = aa.Scene([aa.Ball(p, 0.01) for p in points], **about)
        shuffled = aa.Scene([aa.Cloud(rng.permutation(points), 0.01, name="seen")], **about)
        kept, split = arm.with_(scene=cloud), arm.with_(scene=balls)
        one, other = kept.feasible(pose, gc), split.feasible(pose, gc)
        assert one.status == other.status and np.array_equal(one.intervals, other.intervals)
        assert arm.with_(scene=shuffled).feasible(pose, gc) == one
        q = arm.inverse(pose, psi, gc, limits=False)
        near, each = kept.clearance(q), split.clearance(q)
        assert near.distance == each.distance and near.link == each.link
        own = {None, "foot", "hand", "link_2", "link_3"}
        assert near.obstacle == "seen" or near.obstacle in own
        assert {end.obstacle for pair in one.ends for end in pair} <= {"seen", "foot", "hand", "link_2"}


def test_what_groups_leave_out_touches_nothing() -> None:
    """Psi that a cloud leaves are clear of its points by plain distances, and `clearance` agrees."""
    rng = generator(2)
    arm = FREE.with_(body=BONES)
    for k in range(count(2)):
        points = seen(rng, 1500)
        pose = posed(rng, ARM)
        kept = arm.with_(scene=aa.Scene([aa.Cloud(points, 0.015)]))
        arcs = kept.feasible(pose, k % 8)
        psi = rng.uniform(-np.pi, np.pi, 40)
        q = arm.inverse(pose, psi, k % 8, limits=False)
        balls = aa.Scene([aa.Ball(p, 0.015) for p in points[rng.permutation(len(points))[:40]]])
        assert (least_distance(arm, q, balls)[arcs.contains(psi)] > -1e-9).all()
        least = kept.clearance(q).distance
        assert np.array_equal(arcs.contains(psi), least >= 0)


def room(rng: np.random.Generator) -> NDArray[np.float64]:
    """A million points: of a floor, two walls and two things within reach."""
    points = SHOULDER + rng.uniform(-2, 2, (1_000_000, 3))
    points[:400_000, 2] = SHOULDER[2] - 1.1
    points[400_000:700_000, 0] = SHOULDER[0] - 1.2
    points[700_000:900_000, 1] = SHOULDER[1] + 1.3
    things = SHOULDER + np.array([[0.3, 0.1, 0.3], [-0.1, -0.35, 0.3]])
    points[900_000:] = things[rng.integers(0, 2, 100_000)] + rng.normal(size=(100_000, 3)) * 0.01
    return points


def nearest(arm: aa.Arm, q: Any, points: NDArray[np.float64]) -> float:
    """The least distance (m) of points from the links at joints q."""
    assert arm.body is not None
    frames = arm.frames(q)
    rods = arm.body._shapes(arm.geometry)
    return min(
        float(from_segment(points, *(moved(frames[link], p) for p in ends(rod))).min()) - rod.radius
        for link, rod in rods
    )


@pytest.mark.slow
def test_the_ends_of_a_million_points_are_where_the_nearest_of_them_touches() -> None:
    """At the ends of arcs among a million points the nearest one just touches, in any order."""
    rng, arm, checked = generator(4), FREE.with_(body=BONES), 0
    points = room(rng)
    scene, shuffled = (aa.Scene([aa.Cloud(p, 0.004)]) for p in (points, rng.permutation(points)))
    points = points[np.linalg.norm(points - SHOULDER, axis=1) < arm.geometry.reach]
    kept, other = arm.with_(scene=scene), arm.with_(scene=shuffled)
    for k in range(count(10)):
        pose, gc = posed(rng, ARM), k % 8
        arcs = kept.feasible(pose, gc)
        assert other.feasible(pose, gc) == arcs
        for psi in () if arcs.is_full else arcs.intervals.ravel()[:2]:
            checked += 1
            assert abs(nearest(arm, arm.inverse(pose, psi, gc, limits=False), points) - 0.004) < 1e-12
        psi = rng.uniform(-np.pi, np.pi)
        assert k % 4 or bool(arcs.contains(psi)) == (
            nearest(arm, arm.inverse(pose, psi, gc, limits=False), points) >= 0.004
        )
    assert checked > 3


@pytest.mark.parametrize("share", [1 - 1e-9, 1 + 1e-9])
def test_a_point_that_touches_by_a_part_in_a_thousand_million_is_not_culled(share: float) -> None:
    """One point among many blocks psi if it touches by 1e-9, and not if it misses by that."""
    rng, arm = generator(5), FREE.with_(body=BONES)
    pose = posed(rng, ARM)
    psi = 0.3
    frames = arm.frames(arm.inverse(pose, psi, 0, limits=False))
    touch = (frames[4, :3, 3] + frames[5, :3, 3]) / 2 + frames[4, :3, 0] * (0.05 + 0.004) * share
    far = SHOULDER + 3.0 + rng.uniform(0, 1, (100_000, 3))
    arcs = arm.with_(scene=aa.Scene([aa.Cloud(np.vstack([far, touch]), 0.004)])).feasible(pose, 0)
    assert bool(arcs.is_full) == (share > 1)
    assert share > 1 or (not arcs.contains(psi) and arcs.measure > 2 * np.pi - 1e-3)


def test_the_ends_are_those_of_the_nearest_points_after_many_that_are_covered() -> None:
    """At the ends of arcs next to a dense cloud `clearance` is 0."""
    rng = generator(3)
    arm = FREE.with_(body=BONES)
    pose = posed(rng, ARM)
    frames = arm.frames(arm.inverse(pose, 0.3, 0, limits=False))
    middle = (frames[4, :3, 3] + frames[5, :3, 3]) / 2
    points = middle + rng.normal(size=(5000, 3)) * 0.02
    kept = arm.with_(scene=aa.Scene([aa.Cloud(points, 0.0)]))
    arcs = kept.feasible(pose, 0)
    assert not arcs.contains(0.3)
    for psi in arcs.intervals.ravel():
        assert abs(kept.clearance(arm.inverse(pose, psi, 0, limits=False)).distance) < 1e-12


def test_a_cloud_is_a_value() -> None:
    """A cloud compares, hashes, pickles and keeps its own read-only points."""
    points = np.arange(12.0).reshape(4, 3)
    cloud = aa.Cloud(points.astype(np.float32), 0.1, name="seen")
    assert cloud == aa.Cloud(points, 0.1, name="seen") != aa.Cloud(points + 1, 0.1, name="seen")
    assert pickle.loads(pickle.dumps(cloud)) == cloud and hash(cloud) == hash(
        aa.Cloud(points, 0.1, name="seen")
    )
    points[0] = 9.0
    assert cloud.points[0, 0] == 0.0 and not cloud.points.flags.writeable
    assert aa.Scene([cloud]).names == ("seen",)
