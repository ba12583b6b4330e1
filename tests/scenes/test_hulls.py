"""Convex hulls as obstacles and in the hand: as their boxes and balls are, and as every triangle says."""

from __future__ import annotations

from itertools import combinations, product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.draw import count, generator

import armangle as aa

Floats = NDArray[np.float64]
BONES = aa.Body.bones(upper_arm=0.07, forearm=0.06, plates=True)
SPHERES = aa.Body({
    1: [aa.Capsule([0.03, 0.1, 0.06], [0.03, -0.02, 0.06], 0.03)],
    3: [aa.Ball([0.03, -0.1, 0.04], 0.05), aa.Ball([0, 0, 0], 0.08)],
    4: [aa.Capsule([0.02, 0.05, 0.1], [0.03, -0.06, 0.18], 0.03)],
    6: [aa.Ball([0.04, 0.05, 0.05], 0.04)],
})  # fmt: skip
ARMS = [aa.Arm.from_catalogue(name) for name in ("kuka_iiwa7_r800", "barrett_wam7", "openarm_v10")]
CUBE = np.array(list(product((-0.5, 0.5), repeat=3)))


def place(arm: aa.Arm, rng: np.random.Generator) -> Floats:
    """A frame (4, 4) at random within reach of the links."""
    along = rng.normal(size=3)
    shoulder = arm.frames(np.zeros(7))[1, :3, 3]
    middle = shoulder + along / np.linalg.norm(along) * rng.uniform(0.15, 0.5)
    return np.asarray(aa.pose(middle, rpy=rng.uniform(-3, 3, 3)))


def posed(arm: aa.Arm, rng: np.random.Generator) -> tuple[Any, Any, Any]:
    """A random pose of the arm with its psi and gc."""
    return arm.forward(rng.uniform(np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0)))


def of_box(frame: Floats, size: Floats) -> Floats:
    """The corners (8, 3) of a box."""
    return (CUBE * size) @ frame[:3, :3].T + frame[:3, 3]


@pytest.mark.parametrize("body", [BONES, SPHERES], ids=["bones", "spheres"])
def test_a_box_by_its_corners_is_the_box(body: aa.Body) -> None:
    """The hull of a box's corners has the arcs and distances of the box."""
    rng, blocked = generator(1), 0
    for k in range(count(60)):
        arm = ARMS[k % 3].with_(body=body)
        frame, radius = place(arm, rng), float(rng.choice([0.0, 0.03]))
        size = rng.uniform(0, 0.3, 3) * (rng.random(3) > 0.2)  # a plate, a rod, a point among them
        corners = rng.permutation(of_box(frame, size))
        box, hull = aa.Scene([aa.Box(frame, size, radius)]), aa.Scene([aa.Hull(corners, radius)])
        pose, psi, gc = posed(arm, rng)
        one, other = arm._clear(pose, gc, box), arm._clear(pose, gc, hull)
        assert one.count == other.count and one.status == other.status
        assert np.allclose(one.intervals, other.intervals, rtol=0, atol=1e-9)
        blocked += one.count > 0 and not one.is_full
        asked = psi + np.linspace(-3, 3, 20)
        near, same = (
            arm.clearance(arm.inverse(pose, asked, gc, limits=False), scene) for scene in (box, hull)
        )
        assert np.allclose(near.distance, same.distance, rtol=0, atol=1e-12)
        apart = near.distance > 0
        assert np.allclose(near.psi_rate[apart], same.psi_rate[apart], rtol=0, atol=1e-6)
    assert blocked > 8


def test_one_point_is_a_ball_and_two_are_a_capsule() -> None:
    """Hulls of one point and of points on a line have the arcs of a ball and a capsule."""
    rng, arm = generator(2), ARMS[1].with_(body=BONES)
    for _ in range(20):
        a, b = place(arm, rng)[:3, 3], place(arm, rng)[:3, 3]
        pose, _, gc = posed(arm, rng)
        for round_shape, hull in (
            (aa.Ball(a, 0.06), aa.Hull([a], 0.06)),
            (aa.Capsule(a, b, 0.03), aa.Hull([b, a, (a + b) / 2], 0.03)),
        ):
            one, other = (arm._clear(pose, gc, aa.Scene([shape])) for shape in (round_shape, hull))
            assert np.allclose(one.intervals, other.intervals, rtol=0, atol=1e-9)


def inside(points: Floats, corners: Floats) -> NDArray[np.bool_]:
    """Whether points (..., 3) are in the hull, as in a tetrahedron of four of the corners."""
    out = np.zeros(points.shape[:-1], dtype=bool)
    for four in combinations(corners, 4):
        edges = np.array(four[1:]) - four[0]
        if abs(np.linalg.det(edges)) > 1e-12:
            share = np.linalg.solve(edges.T, (points - four[0])[..., None])[..., 0]
            out |= (share >= 0).all(axis=-1) & (share.sum(axis=-1) <= 1)
    return out


def from_triangles(points: Floats, corners: Floats) -> Floats:
    """Distances of points (..., 3) from the hull of corners: to every triangle of three of them."""
    out = np.full(points.shape[:-1], np.inf)
    for a, b in combinations(corners, 2):
        share = np.clip(((points - a) @ (b - a)) / ((b - a) @ (b - a)), 0, 1)
        out = np.minimum(out, np.linalg.norm(points - a - share[..., None] * (b - a), axis=-1))
    for a, b, c in combinations(corners, 3):
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        within = np.ones(points.shape[:-1], dtype=bool)
        for start, end in ((a, b), (b, c), (c, a)):
            within &= np.cross(end - start, points - start) @ normal >= 0
        out = np.minimum(out, np.where(within, np.abs((points - a) @ normal), np.inf))
    return np.where(inside(points, corners), 0.0, out)


def least(begin: Floats, end: Floats, corners: Floats) -> Floats:
    """Distances (...) of segments (..., 3) from the hull of corners."""
    low, high = np.zeros(begin.shape[:-1]), np.ones(begin.shape[:-1])

    def at(share: Floats) -> Floats:
        """The distances at shares of the segments."""
        return from_triangles(begin + share[..., None] * (end - begin), corners)

    for _ in range(60):
        left, right = (2 * low + high) / 3, (low + 2 * high) / 3
        nearer = at(left) <= at(right)
        low, high = np.where(nearer, low, left), np.where(nearer, right, high)
    return np.minimum(at((low + high) / 2), np.minimum(at(low), at(high)))


@pytest.mark.slow
@pytest.mark.core
def test_arcs_of_a_hull_are_what_its_triangles_say() -> None:
    """Arcs next to a hull agree with distances from all triangles of its corners."""
    rng, ends = generator(3), 0
    for k in range(count(6)):
        arm = ARMS[k % 3].with_(body=aa.Body.bones(upper_arm=0.06, forearm=0.05))
        pose, psi, gc = posed(arm, rng)
        elbow = arm.elbow(arm.inverse(pose, psi + 1.0, gc, limits=False))  # on the way of the links
        corners = elbow + rng.normal(size=3) * 0.05 + rng.normal(size=(5, 3)) * 0.12
        middle = rng.dirichlet(np.ones(5), size=3) @ corners  # points within change nothing
        scene = aa.Scene([aa.Hull(np.concatenate([middle, corners]), name="wedge")], clearance=0.01)
        arcs = arm._clear(pose, gc, scene)
        limits = np.empty(0) if arcs.is_full else arcs.intervals.ravel()
        psi = np.concatenate([rng.uniform(-np.pi, np.pi, 12), limits, limits - 1e-6, limits + 1e-6])
        frames = arm.frames(arm.inverse(pose, psi, gc, limits=False))
        upper = frames[:, 3, :3, :3] @ [-arm.geometry.a_3, -arm.geometry.d_se, 0] + frames[:, 3, :3, 3]
        foot = frames[:, 3, :3, :3] @ [-arm.geometry.a_3, 0, 0] + frames[:, 3, :3, 3]
        wrist = frames[:, 4, :3, :3] @ [0, 0, arm.geometry.d_ew] + frames[:, 4, :3, 3]
        apart = np.minimum(
            least(upper, foot, corners) - 0.06, least(frames[:, 4, :3, 3], wrist, corners) - 0.05
        )
        near = np.array([np.min(np.abs(np.angle(np.exp(1j * (limits - x)))), initial=9.0) for x in psi])
        wrong = (arcs.contains(psi) != (apart >= 0.01)) & (near > 1e-9)
        assert not wrong.any(), (k, psi[wrong], apart[wrong])
        assert np.abs(apart[near == 0] - 0.01).max(initial=0) < 1e-12
        ends += len(limits)
    assert ends > 2


def test_a_hull_in_the_hand_is_the_box_of_its_corners() -> None:
    """A hull as gripper has the arcs (to 1e-9 rad) and distances (1e-12 m) of the box with its corners."""
    rng, blocked = generator(4), set()
    arm = ARMS[0].with_(body=BONES)
    for k in range(60):
        size, radius = rng.uniform(0.05, 0.4, 3), float(rng.choice([0.0, 0.02]))
        frame = np.asarray(aa.pose([0, 0, 0.2], rpy=rng.uniform(-3, 3, 3)))
        box = arm.with_(hand=[aa.Box(frame, size, radius, name="part")])
        hull = arm.with_(hand=[aa.Hull(of_box(frame, size), radius, name="part")])
        pose, psi, gc = posed(arm, rng)
        there = place(arm, rng)
        there[:3, 3] = pose[:3, 3] + rng.normal(size=3) * 0.3
        shape = [
            aa.Ball(there[:3, 3], 0.05), aa.Box(there, [0.1, 0.2, 0.05]),
            aa.Capsule(there[:3, 3], there[:3, 0], 0.05), aa.HalfSpace([0.1, 0.2, 1], pose[2, 3] - 0.3),
            aa.Hull(of_box(there, np.array([0.1, 0.2, 0.05]))),
        ][k % 5]  # fmt: skip
        scene = aa.Scene([shape])
        one, other = box._clear(pose, gc, scene), hull._clear(pose, gc, scene)
        assert one.status == other.status and one.count == other.count
        assert np.allclose(one.intervals, other.intervals, rtol=0, atol=1e-9)
        near, same = (
            each.clearance(each.inverse(pose, psi, gc, limits=False), scene).distance for each in (box, hull)
        )
        assert abs(near - same) < 1e-12
        blocked.add((one.status.name, k % 5))
    assert len(blocked) > 6


def test_what_the_hand_holds_may_not_lie_within_an_obstacle_however_sharp_both_are() -> None:
    """A gripper within a larger or around a smaller obstacle blocks the pose, at distance 0."""
    corners = CUBE * 0.1
    pose, psi, gc = ARMS[0].forward([0, 0.6, 0, -1.4, 0, 0.9, 0])
    for held in (aa.Box(np.eye(4), [0.1, 0.1, 0.1], name="part"), aa.Hull(corners, name="part")):
        arm = ARMS[0].with_(hand=[held])
        middle = pose[:3, 3]
        for shape in (
            aa.Box(aa.pose(middle), [0.3, 0.3, 0.3], name="case"), aa.Hull(3 * corners + middle, name="case"),
            aa.Box(aa.pose(middle), [0.01, 0.01, 0.01], name="case"), aa.Hull([middle], name="case"),
            aa.Ball(middle, 0.0, name="case"), aa.Capsule(middle, middle + 0.4, 0.0, name="case"),
        ):  # fmt: skip
            arcs = arm._clear(pose, gc, aa.Scene([shape]))
            assert arcs.status == aa.Status.POSE_BLOCKED and arcs.blocking == ("case", "part"), shape
            assert arm.clearance(arm.inverse(pose, psi, gc, limits=False), aa.Scene([shape])).distance == 0


def test_a_plan_round_a_hull_is_proven_and_clear_between_its_rows() -> None:
    """A certified plan keeps clear of a hull; one that starts in it fails and names it."""
    arm = ARMS[0].with_(body=BONES)
    q = np.radians([20, 45, 10, -80, 10, 60, 0])
    pose, _, _ = arm.forward(q)
    from_elbow = np.array([[0.0, 0.0, -0.2], [0.15, 0.02, -0.18], [0.0, 0.02, -0.1], [0.05, 0.02, -0.3]])
    corners = arm.elbow(q) + from_elbow
    scene = aa.Scene([aa.Hull(corners, name="wedge")], clearance=0.005)
    poses = np.tile(pose, (60, 1, 1))
    poses[:, 1, 3] += np.linspace(0, 0.12, 60)
    path = aa.plan(arm.with_(scene=scene), poses, start=q)
    assert path.ok and path.certified
    rows = path.at(np.linspace(0, 1, 2001))
    assert arm.clearance(rows.q, scene).distance.min() >= 0.005
    touching = aa.Scene([aa.Hull(corners + np.array([0, 0, 0.1]), name="wedge")])
    refused = aa.plan(arm.with_(scene=touching), poses, start=q)
    assert not refused.ok and not refused.certified and "wedge" in refused.explain()
