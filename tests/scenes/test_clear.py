"""Arcs that a scene leaves, against distances of the postures of `inverse`."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from support.draw import count, generator
from support.threads import in_threads
from support.touching import distances, least_distance

import armangle as aa

BONES = aa.Body.bones(upper_arm=0.07, forearm=0.06, plates=True)
SPHERES = aa.Body({
    2: [aa.Ball([0, 0, 0.1], 0.06)],
    3: [aa.Ball([0.03, -0.1, 0.04], 0.05), aa.Ball([0, 0, 0], 0.08)],
    4: [aa.Capsule([0, 0, -0.05], [0, 0, 0.05], 0.06),
        aa.Capsule([0.02, 0.05, 0.1], [0.03, -0.06, 0.18], 0.03)],
    5: [aa.Capsule([0, 0.02, 0], [0, 0.09, 0], 0.05)],
})  # fmt: skip
SWINGING = aa.Body({
    1: [aa.Capsule([0.03, 0.1, 0.06], [0.03, -0.02, 0.06], 0.03)],
    2: [aa.Ball([0.05, 0.06, 0.1], 0.04), aa.Capsule([-0.05, 0.02, 0.1], [-0.04, 0, 0.2], 0.03)],
    3: [aa.Ball([0.03, -0.1, 0.04], 0.05)],
    5: [aa.Capsule([0.06, -0.1, 0.02], [0.05, -0.04, 0.03], 0.04)],
    6: [aa.Ball([0.04, 0.05, 0.05], 0.04)],
})  # fmt: skip
OFFSET = aa.Arm(
    d_bs=0.3, d_se=0.31, d_ew=0.28, d_wf=0.1, a_3=0.02, a_4=-0.03, d_4=0.06,
    base=aa.pose([0.4, -0.2, 0.7], rpy=[0.3, 1.2, -0.5]), tool=aa.pose([0.02, 0.05, 0.1], rpy=[0.4, 0, 1]),
)  # fmt: skip
CATALOGUE = ("kuka_iiwa7_r800", "barrett_wam7", "yaskawa_sia5d", "openarm_v10")
TURNED = OFFSET.with_(reference="stereographic").with_(name="another zero")
ARMS = [*map(aa.Arm.from_catalogue, CATALOGUE), OFFSET, TURNED]
BODIES = {"bones": BONES, "spheres": SPHERES, "swinging": SWINGING}


def shoulder(arm: aa.Arm) -> Any:
    """The position (3,) of the shoulder, m."""
    return arm.frames(np.zeros(7))[1, :3, 3]


def obstacle(arm: aa.Arm, rng: np.random.Generator, kind: int) -> Any:
    """A random shape within reach of the links: ball, capsule, box or half-space for kind 0 to 3."""
    along = rng.normal(size=3)
    centre = shoulder(arm) + along / np.linalg.norm(along) * rng.uniform(0.2, 1.1) * arm.geometry.d_se * 1.6
    radius = rng.uniform(0.0, 0.08)
    if kind == 0:
        return aa.Ball(centre, radius)
    if kind == 1:
        return aa.Capsule(centre, centre + rng.normal(size=3) * 0.15, radius)
    if kind == 2:
        return aa.Box(aa.pose(centre, rpy=rng.uniform(-3, 3, 3)), rng.uniform(0, 0.3, 3), radius)
    return aa.HalfSpace(along, float(along @ (shoulder(arm) - 0.4 * along)) / np.linalg.norm(along))


def posed(arm: aa.Arm, rng: np.random.Generator, gc: int) -> tuple[Any, int]:
    """A pose that the arm reaches within its limits, and `gc` unchanged."""
    span = np.where(np.isfinite(arm.lower), arm.lower, -3.0), np.where(np.isfinite(arm.upper), arm.upper, 3.0)
    return arm.forward(rng.uniform(*span))[0], gc


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.core
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_a_psi_is_clear_if_and_only_if_no_link_touches(arm: aa.Arm, body: str) -> None:
    """The arcs clear of a scene hold psi exactly where all links keep the clearance."""
    rng = generator(1, len(arm.name))
    arm = arm.with_(body=BODIES[body])
    for k in range(count(8)):
        pose, gc = posed(arm, rng, k % 8)
        kept = float(rng.choice([0.0, 0.015]))
        scene = aa.Scene([obstacle(arm, rng, (k + j) % 4) for j in range(1 + k % 3)], clearance=kept)
        arcs = arm._clear(pose, gc, scene)
        psi = rng.uniform(-np.pi, np.pi, 60)
        limits = arcs.intervals.ravel() if arcs.ends else np.empty(0)
        beside = [limits + sign * 10 ** rng.uniform(-8.9, -3) for sign in (-1, 1)]
        psi = np.concatenate([psi, *beside])
        least = least_distance(arm, arm.inverse(pose, psi, gc, limits=False), scene)
        near = np.array([np.min(np.abs(np.angle(np.exp(1j * (limits - x)))), initial=9.0) for x in psi])
        wrong = (arcs.contains(psi) != (least >= kept)) & (near > 1e-9) & (np.abs(least - kept) > 1e-14)
        assert not wrong.any(), (k, psi[wrong], least[wrong] - kept)


@pytest.mark.turns(4)
@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_an_end_is_where_the_named_pair_is_as_near_as_is_asked(arm: aa.Arm) -> None:
    """At each end of an arc in a scene its named pair is exactly at the clearance, and none is nearer."""
    rng = generator(2, len(arm.name))
    checked = 0
    for k in range(count(16)):
        body = [BONES, SPHERES, SWINGING][k % 3]
        arm = arm.with_(body=body)
        pose, gc = posed(arm, rng, k % 8)
        scene = aa.Scene([obstacle(arm, rng, (k + j) % 4) for j in range(3)], clearance=0.01)
        arcs = arm._clear(pose, gc, scene)
        for (lower, upper), pair in zip(arcs, arcs.ends, strict=True):
            for psi, end in zip((lower, upper), pair, strict=False):
                apart, names = distances(arm, arm.inverse(pose, psi, gc, limits=False), scene)
                assert abs(apart.min() - 0.01) < 1e-12
                told = {(end.obstacle, end.link), (end.link, end.obstacle)}
                mine = [apart[i] for i, name in enumerate(names) if name in told]
                assert abs(min(mine) - 0.01) < 1e-12
                assert (end.joint, end.side) == (None, "obstacle") and np.isnan(end.value)
                checked += 1
    assert checked > 5


@pytest.mark.parametrize("links", [(0, 1), (7, 6)])
def test_a_ball_on_the_first_or_last_axis_blocks_the_pose_with_either_link(links: tuple[int, int]) -> None:
    """A ball on axis 1 or 7 blocks alike as a shape of the link on either side of that axis."""
    rng, arm, blocked = generator(15), OFFSET, 0
    for k in range(40):
        q = rng.uniform(-1.5, 1.5, 7)
        pose, _, gc = arm.forward(q)
        frames, told = arm.frames(q)[list(links)], []
        place = frames[0, :3, 3] + 0.07 * frames[0, :3, 2]
        other = aa.Ball(place + rng.normal(size=3) * 0.06, 0.02, name="lamp")
        for link, frame in zip(links, frames, strict=True):
            ball = aa.Ball(np.round(frame[:3, :3].T @ (place - frame[:3, 3]), 12), 0.05)  # on the axis
            told.append(arm.with_(body=aa.Body({link: [ball]}))._clear(pose, gc, aa.Scene([other])))
        assert told[0].status == told[1].status and told[0].is_full == told[1].is_full, k
        if told[0].is_empty:
            assert [one.blocking for one in told] == [("lamp", f"link_{link}") for link in links]
            assert told[0].status == aa.Status.POSE_BLOCKED
            blocked += 1
    assert 5 < blocked < 35


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("near", [0.0, 1e-9, 1e-6, 1e-3])
def test_links_that_swing_fast_beside_a_singular_posture(near: float) -> None:
    """Near theta_2 = 0 arcs in a scene agree with plain distances."""
    arm = ARMS[0].with_(body=SWINGING)
    rng = generator(12)
    for k in range(6):
        pose, psi, gc = arm.forward([0.4 * k, near, 0.3, -1.2, 0.4, 0.9, 0.1])
        scene = aa.Scene([aa.Ball(shoulder(arm) + rng.normal(size=3) * 0.12, 0.03) for _ in range(3)])
        arcs = arm._clear(pose, gc, scene)
        asked = np.concatenate([psi + np.geomspace(1e-7, 1, 30), psi - np.geomspace(1e-7, 1, 30)])
        least = least_distance(arm, arm.inverse(pose, asked, gc, limits=False), scene)
        wrong = (arcs.contains(asked) != (least >= 0)) & (np.abs(least) > 1e-8)
        assert not wrong.any(), (near, k, asked[wrong] - psi, least[wrong])


def circle_of_a_ball(arm: aa.Arm, pose: Any, gc: int) -> tuple[Any, Any, Any]:
    """Shoulder, unit direction to the wrist, and elbow at psi = 0, for the circle of the elbow."""
    frames = arm.frames(arm.inverse(pose, 0.0, gc, limits=False))
    along = frames[5, :3, 3] - frames[1, :3, 3]
    return frames[1, :3, 3], along / np.linalg.norm(along), frames[3, :3, 3]


@pytest.mark.parametrize("side", [-1, 1])
def test_tangent_from_both_sides(side: int) -> None:
    """Arcs are full, empty or blocked right where a ball just touches the elbow's circle."""
    arm = ARMS[0].with_(body=aa.Body({3: [aa.Ball([0, 0, 0], 0.05, name="elbow")]}))
    pose = arm.forward([0.3, 0.7, 0.2, -1.3, 0.4, 0.8, 0.1])[0]
    start, along, elbow = circle_of_a_ball(arm, pose, 0)
    foot = start + along * ((elbow - start) @ along)
    across = (elbow - foot) / np.linalg.norm(elbow - foot)
    radius = float(np.linalg.norm(elbow - foot))
    least, greatest = 0.1, 2 * radius + 0.1
    centre = foot + across * (radius + 0.1)
    beside = arm._clear(pose, 0, aa.Scene([aa.Ball(centre, least * (1 + side * 1e-13) - 0.05)]))
    assert bool(beside.is_full) == (side < 0)
    around = arm._clear(pose, 0, aa.Scene([aa.Ball(centre, greatest * (1 + side * 1e-13) - 0.05, name="b")]))
    assert bool(around.is_empty) == (side > 0)
    assert around.blocking == (("b", "elbow") if side > 0 else None)
    on_axis = arm._clear(pose, 0, aa.Scene([aa.Ball(foot, radius * (1 + side * 1e-12) - 0.05)]))
    assert bool(on_axis.is_empty) == (side > 0) and bool(on_axis.is_full) == (side < 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "ends",
    [
        ((0.2, 0.1), (0.4, 0.1)),
        ((0.2, -0.1), (0.4, 0.1)),
        ((0.2, 0.0), (0.4, 0.0)),
        ((0.2, 0.0), (0.4, 0.1)),
        ((0.0, 0.0), (0.1, 0.2)),
        ((0.3, 0.1), (0.3, 0.1)),
    ],
    ids=["parallel", "crossing", "on the line", "from the line", "from the shoulder", "ball"],
)
def test_segments_of_the_arm_plane_in_exact_places(ends: Any) -> None:  # fmt: skip
    """Arcs agree with plain distances for links in special positions to the axis shoulder-wrist."""
    bare = ARMS[0]
    pose = bare.forward([0.3, 0.7, 0.2, -1.3, 0.4, 0.8, 0.1])[0]
    start, along, elbow = circle_of_a_ball(bare, pose, 0)
    across = (elbow - start) - along * ((elbow - start) @ along)
    across /= np.linalg.norm(across)
    frame = bare.frames(bare.inverse(pose, 0.0, 0, limits=False))[4]
    begin, end = ((start + along * w + across * r - frame[:3, 3]) @ frame[:3, :3] for w, r in ends)
    arm = bare.with_(body=aa.Body({4: [aa.Capsule(begin, end, 0.05)]}))
    beside = np.cross(along, across)
    seen = 0
    for w in (0.0, 0.2, 0.3, 0.55):
        for off in (0.0, 0.04, 0.05, 0.1, 0.2):
            at = start + along * w + (across + 0.3 * beside) * off
            for shape in (
                aa.Ball(at, 0.03), aa.Ball(at, 0.0), aa.Capsule(at, at + 0.1 * along, 0.02),
                aa.Box(aa.pose(at), [0.05, 0.0, 0.1], 0.01),
            ):  # fmt: skip
                arcs = arm._clear(pose, 0, aa.Scene([shape]))
                psi = np.linspace(-np.pi, np.pi, 73)
                least = least_distance(arm, arm.inverse(pose, psi, 0, limits=False), aa.Scene([shape]))
                wrong = (arcs.contains(psi) != (least >= 0)) & (np.abs(least) > 1e-9)
                assert not wrong.any(), (shape, psi[wrong], least[wrong])
                seen += not bool(arcs.is_full)
    assert seen > 10


def test_a_box_without_extent_is_what_is_left_of_it() -> None:
    """A box of size 0 in some directions has the arcs of a ball, capsule or flat hull."""
    rng, arm = generator(14), ARMS[1].with_(body=SPHERES)
    for k in range(count(10)):
        pose, gc = posed(arm, rng, k % 8)
        frame = aa.pose(obstacle(arm, rng, 0).center, rpy=rng.uniform(-3, 3, 3))
        end = frame[:3, 3] + 0.1 * frame[:3, 0], frame[:3, 3] - 0.1 * frame[:3, 0]
        plate = frame[:3, 3] + np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) @ frame[:3, :2].T * 0.1
        for box, same in ((aa.Box(frame, [0, 0, 0], 0.05), aa.Ball(frame[:3, 3], 0.05)),
                          (aa.Box(frame, [0.2, 0, 0], 0.05), aa.Capsule(*end, 0.05)),
                          (aa.Box(frame, [0.2, 0.2, 0], 0.05), aa.Hull(plate, 0.05))):  # fmt: skip
            one, other = arm._clear(pose, gc, aa.Scene([box])), arm._clear(pose, gc, aa.Scene([same]))
            assert one.status == other.status and one.count == other.count
            assert np.allclose(one.intervals, other.intervals, rtol=0, atol=1e-9)


def test_a_straight_arm_has_all_or_nothing() -> None:
    """With the elbow straight the arcs in a scene are full or empty."""
    arm = ARMS[0].with_(body=aa.Body.bones(upper_arm=0.05, forearm=0.05))
    pose, _, gc = arm.forward([0.3, 0.7, 0.2, 0.0, 0.4, 0.8, 0.1])
    start, along, _ = circle_of_a_ball(arm, pose, int(gc))
    beside = np.cross(along, [0, 0, 1.0])
    beside /= np.linalg.norm(beside)
    for distance, full in ((0.101, True), (0.099, False)):
        for share in (0.0, 0.3, 0.5, 0.9):
            scene = aa.Scene([aa.Ball(start + along * share * 0.8 + beside * distance, 0.05)])
            arcs = arm._clear(pose, gc, scene)
            assert bool(arcs.is_full) == full and bool(arcs.is_empty) != full
    assert arm._clear(pose, gc, scene).status == aa.Status.CLEARANCE


def test_a_needle_and_a_near_miss() -> None:
    """A psi is clear 50 µm off a shape, and not clear 50 µm into it."""
    arm = ARMS[0].with_(body=aa.Body.bones(upper_arm=0.05, forearm=0.04))
    pose, _, gc = arm.forward([0.3, 0.7, 0.2, -1.3, 0.4, 0.8, 0.1])
    frames = arm.frames(arm.inverse(pose, 0.4, gc, limits=False))
    side = frames[4, :3, 0]
    middle = (frames[4, :3, 3] + frames[5, :3, 3]) / 2
    for radius in (0.0, 0.001):
        for gap in (-50e-6, 50e-6):
            touch = middle + side * (0.04 + radius + gap)
            plate = aa.pose(touch + 0.1 * side, matrix=frames[4, :3, :3])
            for shape in (
                aa.Ball(touch, radius),
                aa.Capsule(touch, touch + 0.1 * side, radius),
                aa.Box(plate, [0.2, 0, 0], radius),
            ):
                arcs = arm._clear(pose, gc, aa.Scene([shape]))
                assert bool(arcs.contains(0.4)) == (gap > 0), (shape, gap)


def test_more_gaps_than_a_set_holds_leave_the_widest() -> None:
    """A set of at most 16 arcs is marked `coarse` if there were more, and all it holds is clear."""
    arm = ARMS[0].with_(body=aa.Body({3: [aa.Ball([0, 0, 0], 0.002)]}))
    pose = arm.forward([0.3, 0.7, 0.2, -1.3, 0.4, 0.8, 0.1])[0]
    places = arm.elbow(arm.inverse(pose, np.linspace(-3, 3, 100), 0, limits=False))
    scene = aa.Scene([aa.Ball(place, 0.002) for place in places])
    arcs = arm._clear(pose, 0, scene)
    assert 1 < arcs.count <= 16 and arcs.coarse
    assert (arcs & ~aa.ArcSet([[0, 1]])).coarse and pickle.loads(pickle.dumps(arcs)).coarse
    few = aa.Scene(scene.shapes[:5])
    assert not arm._clear(pose, 0, few).coarse and not arm.feasible(pose, 0).coarse
    told = [arm._clear(np.stack([pose] * 3), 0, each).coarse.tolist() for each in (scene, few)]
    assert told == [[True] * 3, [False] * 3] and arm._clear(np.stack([pose] * 2), 0, scene)[1].coarse
    psi = np.linspace(-np.pi, np.pi, 3000)
    inside = arcs.contains(psi)
    assert inside.any()
    assert least_distance(arm, arm.inverse(pose, psi[inside], 0, limits=False), scene).min() > -1e-9


@pytest.mark.core
def test_feasible_with_a_scene_is_both() -> None:
    """`feasible` in a scene is `feasible` without it & the clear arcs, one, many and in threads."""
    rng, arm = generator(9), ARMS[0].with_(body=BONES)
    scene = aa.Scene([obstacle(arm, rng, k % 4) for k in range(4)])
    poses = np.stack([posed(arm, rng, 0)[0] for _ in range(20)])
    gc = np.arange(20) % 8
    both = arm.with_(scene=scene).feasible(poses, gc)
    apart = arm.feasible(poses, gc) & arm._clear(poses, gc, scene)
    assert both == apart
    assert repr(both.ends) == repr(apart.ends)
    plain = arm.feasible(poses, gc)  # names of pairs are kept beside a set that has none
    assert repr((both & plain).ends) == repr(both.ends) == repr((plain & both).ends)
    assert both != plain and both[:10] != both[10:] and both[:10] == both[:10]
    every = in_threads(2, lambda: arm.with_(scene=scene).feasible(poses))
    for k in range(20):
        assert every[k, gc[k]] == both[k]
        one = arm.with_(scene=scene).feasible(poses[k], int(gc[k]))
        assert one == both[k] and repr(one.ends) == repr(both[k].ends) and one.status == both.status[k]


def test_a_hand_that_meets_an_obstacle_blocks_the_pose() -> None:
    """A gripper in an obstacle gives POSE_BLOCKED with both names, unless the scene ignores the pair."""
    arm = ARMS[0].with_(body=BONES).with_(hand=[aa.Box(aa.pose([0, 0, 0.1]), [0.1, 0.1, 0.2], name="part")])
    pose, _, gc = arm.forward([0.0, 0.6, 0.0, -1.4, 0.0, 0.9, 0.0])
    tip = moved_tip(pose, 0.2)
    for depth in (1e-9, -1e-9):
        scene = aa.Scene([aa.HalfSpace([0, 0, 1], tip + depth, name="table")])
        arcs = arm._clear(pose, gc, scene)
        assert (arcs.status == aa.Status.POSE_BLOCKED) == (depth > 0)
        assert arcs.blocking == (("table", "part") if depth > 0 else None)
    free = aa.Scene([aa.HalfSpace([0, 0, 1], tip + 0.01, name="table")], ignore=[("table", "part")])
    assert arm._clear(pose, gc, free).status != aa.Status.POSE_BLOCKED


def moved_tip(pose: Any, length: float) -> float:
    """The lowest height (m) of a gripper 0.1 m wide and `length` long."""
    corners = [pose @ [x, y, z, 1.0] for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (0.0, length)]
    return float(min(corner[2] for corner in corners))


def test_what_the_hand_carries_blocks_the_upper_arm_and_not_its_own_link() -> None:
    """A rod in the gripper blocks psi at which it meets the upper arm, and never its own link."""
    rod = aa.Capsule([0, 0, 0.0], [-0.4, 0, 0.0], 0.02, name="rod")
    body = aa.Body({
        3: [aa.Capsule([0, -0.4, 0], [0, 0, 0], 0.08, name="upper")],
        6: [aa.Ball([0, 0, 0.02], 0.05, name="wrist")], 7: [aa.Ball([0, 0, 0], 0.05)],
    })  # fmt: skip
    arm = ARMS[0].with_(body=body).with_(hand=[rod])
    rng, seen = generator(10), set()
    for k in range(300):
        pose, gc = posed(arm, rng, k % 8)
        arcs = arm._clear(pose, gc, aa.Scene())
        seen |= {(end.obstacle, end.link) for pair in arcs.ends for end in pair}
        for (lower, _), _pair in zip(arcs, arcs.ends, strict=True):
            near = arm.clearance(arm.inverse(pose, lower, gc, limits=False), aa.Scene())
            assert abs(near.distance) < 1e-12 or arcs.is_full
    assert ("rod", "upper") in seen
    assert all(link == "upper" for _, link in seen)


def test_base_and_table_may_touch_where_the_scene_says_so() -> None:
    """A base in a table blocks the pose unless the scene ignores the pair."""
    body = aa.Body({0: [aa.Capsule([0, 0, 0.02], [0, 0, 0.15], 0.08)], 3: [aa.Ball([0, -0.2, 0], 0.08)]})
    arm = ARMS[0].with_(body=body)
    pose, _, gc = arm.forward([0.0, 0.6, 0.0, -1.4, 0.0, 0.9, 0.0])
    table = aa.HalfSpace([0, 0, 1], 0.0, name="table")
    blocked = arm._clear(pose, gc, aa.Scene([table]))
    assert blocked.status == aa.Status.POSE_BLOCKED and blocked.blocking == ("table", "link_0")
    assert arm._clear(pose, gc, aa.Scene([table], ignore=[("table", "link_0")])).status == aa.Status.OK


def test_out_of_reach_is_said() -> None:
    """The clear arcs of a pose out of reach are UNREACHABLE."""
    arm = ARMS[0].with_(body=BONES)
    far = aa.pose([3.0, 0, 0])
    assert arm._clear(far, 0, aa.Scene([aa.Ball([0, 0, 1], 0.1)])).status == aa.Status.UNREACHABLE
