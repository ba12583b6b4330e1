"""The nearest pair, its rate and its points; and the arm angle that keeps farthest away."""

from __future__ import annotations

import numpy as np
import pytest
from support.calibrated import calibrated
from support.draw import count, generator
from support.threads import in_threads
from support.touching import distances, least_distance

import armangle as aa

BONES = aa.Body.bones(upper_arm=0.05, forearm=0.04, plates=True)
ARM = aa.Arm.from_catalogue("barrett_wam7").with_(body=BONES)
WRITTEN = ARM.with_(base=aa.pose([0.2, 0.1, -0.3], rpy=[0.1, 0.4, 0.2]))


def shapes(rng: np.random.Generator) -> list[object]:
    """One shape of each kind near the shoulder."""
    near = WRITTEN.frames(np.zeros(7))[1, :3, 3]
    places = near + rng.normal(size=(3, 3)) * 0.5
    return [
        aa.Ball(places[0], 0.05, name="ball"),
        aa.Capsule(places[1], places[1] + rng.normal(size=3) * 0.2, 0.03, name="rod"),
        aa.Box(aa.pose(places[2], rpy=rng.uniform(-3, 3, 3)), rng.uniform(0, 0.3, 3), 0.01, name="box"),
        aa.HalfSpace([0.2, 0.1, 1], -0.9, name="floor"),
    ]


def test_the_nearest_pair_is_that_of_all_distances() -> None:
    """`clearance` gives distance, pair, points and psi_rate of the nearest pair."""
    rng = generator(1)
    for _ in range(count(20)):
        scene = aa.Scene(shapes(rng))
        q = rng.uniform(-1.5, 1.5, 7)
        pose, psi, gc = WRITTEN.forward(q)
        apart, names = distances(WRITTEN, WRITTEN.inverse(pose, psi, gc, limits=False), scene)
        near = WRITTEN.clearance(WRITTEN.inverse(pose, psi, gc, limits=False), scene)
        assert abs(near.distance - apart.min()) < 1e-9
        assert (near.obstacle, near.link) == names[int(np.argmin(apart))]
        if near.distance > 0:
            assert abs(np.linalg.norm(near.points[0] - near.points[1]) - near.distance) < 1e-12
        step = 1e-6
        before, after = (
            WRITTEN.clearance(WRITTEN.inverse(pose, psi + s, gc, limits=False), scene) for s in (-step, step)
        )
        if before.obstacle == after.obstacle and before.link == after.link and near.distance > 0:
            assert abs((after.distance - before.distance) / (2 * step) - near.psi_rate) < 1e-5


@pytest.mark.parametrize("link", [1, 2, 5, 6])
@pytest.mark.parametrize("bend", [0.0, 1e-10, 1e-6])
def test_where_two_joints_share_a_turn_the_joints_themselves_are_judged(link: int, bend: float) -> None:
    """At a straight joint 2 or 6 psi does not tell where a part off the axis is: `clearance` is that of q,
    and neither `solve`, `solutions` nor `step` takes joints that collide.
    """
    q = np.array([0.787, 0.5, -0.762, -1.478, 0.583, -0.82, 0.397])
    q[1 if link < 3 else 5] = bend
    for bare in (aa.Arm.from_catalogue("kuka_iiwa7_r800"), calibrated("kuka_iiwa7_r800", 1.0, 1.0)):
        arm = bare.with_(body=aa.Body({link: [aa.Ball([0.05, 0.06, 0.1], 0.03)]}))
        at = (arm.frames(q)[link] @ [0.05, 0.06, 0.1, 1.0])[:3]
        arm = arm.with_(scene=aa.Scene([aa.Ball(at, 0.03)]))
        near, pose = arm.clearance(q), arm.frames(q)[7] @ arm.tool
        assert (
            abs(near.distance + 0.06) < 1e-9 and abs(near.distance - least_distance(arm, q, arm.scene)) < 1e-9
        )
        best, moved = arm.solve(pose, seed=q), aa.step(arm, q, pose)
        assert not best.ok or least_distance(arm, best.q, arm.scene) > -1e-8
        assert not moved.ok or least_distance(arm, moved.q, arm.scene) > -1e-8
        found = arm.solutions(pose, seed=q)
        assert all(least_distance(arm, np.asarray(one.q), arm.scene) > -1e-8 for one in found)


def test_no_grid_is_farther_from_the_obstacles() -> None:
    """`solve(prefer="clearance")` is the farthest of all branches and psi; it takes batches, and refuses
    other wishes.
    """
    rng, poses, seeds = generator(4), [], []
    arm = WRITTEN.with_(scene=aa.Scene(shapes(rng), clearance=0.001))
    while len(poses) < count(6):
        q = rng.uniform(arm.lower, arm.upper) * 0.6
        if arm.clearance(q).distance > 0.002:
            poses.append(arm.forward(q)[0])
            seeds.append(q)
    batch = arm.solve(np.stack(poses), seeds, prefer="clearance")
    for k, (pose, q) in enumerate(zip(poses, seeds, strict=True)):
        found = arm.solve(pose, q, prefer="clearance")
        assert found.ok and found == batch.row(k) and arm.within_limits(found.q)
        np.testing.assert_allclose(arm.forward(found.q)[0], pose, rtol=0, atol=1e-9)
        assert found.distance == pytest.approx(np.linalg.norm(found.q - q), abs=1e-12)
        best = arm.clearance(found.q).distance
        intervals = arm.feasible(pose)
        for gc in range(8):
            psi = np.linspace(-np.pi, np.pi, 181)
            psi = psi[intervals[gc].contains(psi)]
            if len(psi):
                room = arm.clearance(arm.inverse(pose, psi, gc, limits=False)).distance
                assert room.max() <= best + 1e-6
        assert arm.solve(pose, gc=found.gc, prefer="clearance").gc == found.gc
    far = poses[0].copy()
    far[0, 3] += 5.0
    none = arm.solve(far, prefer="clearance")
    assert (none.ok, none.status, none.gc) == (False, aa.Status.UNREACHABLE, -1) and np.isnan(none.q).all()
    bare = WRITTEN.with_(scene=aa.Scene([]))
    assert bare.solve(poses[0], prefer="clearance").ok
    for wrong in ({"weight": 1.0}, {"metric": "max"}, {"roll": "free"}, {"allowed": aa.ArcSet([(0.0, 1.0)])}):
        with pytest.raises(aa.InputError):
            arm.solve(poses[0], prefer="clearance", **wrong)
    with pytest.raises(aa.InputError):
        WRITTEN.solve(poses[0], prefer="clearance")


@pytest.mark.slow
def test_what_swings_is_as_near_as_its_distances_say() -> None:
    """`clearance` of links with shapes off their axes equals plain distances, psi_rate differences."""
    body = aa.Body({
        1: [aa.Capsule([0.05, 0.1, 0.06], [0.06, -0.02, 0.06], 0.03, name="one")],
        2: [aa.Ball([0.06, 0.05, 0.1], 0.04, name="two")], 3: [aa.Ball([0, -0.1, 0.05], 0.05, name="three")],
        5: [aa.Ball([0.15, -0.15, 0.02], 0.04, name="five")],
        6: [aa.Ball([0.04, 0.05, 0.05], 0.04, name="six")],
    })  # fmt: skip
    rng, seen = generator(7), set()
    arm = WRITTEN.with_(body=body)
    for _ in range(count(40)):
        scene = aa.Scene([s for s in shapes(rng) if not isinstance(s, aa.HalfSpace)])
        pose, psi, gc = arm.forward(rng.uniform(-1.5, 1.5, 7))
        apart, names = distances(arm, arm.inverse(pose, psi, gc, limits=False), scene)
        near = arm.clearance(arm.inverse(pose, psi, gc, limits=False), scene)
        assert abs(near.distance - apart.min()) < 1e-9
        assert {near.obstacle, near.link} == set(names[int(np.argmin(apart))])
        seen |= {near.link, near.obstacle}
        before, after = (
            arm.clearance(arm.inverse(pose, psi + s, gc, limits=False), scene) for s in (-1e-6, 1e-6)
        )
        if {before.link, after.link} == {near.link} and before.obstacle == after.obstacle:
            slope = (after.distance - before.distance) / 2e-6
            assert near.distance < 0 or abs(slope - near.psi_rate) < 1e-4 * max(1, abs(slope))
    assert {"one", "two", "five", "six"} <= seen


def test_a_batch_is_each_of_its_poses() -> None:
    """`clearance` of many joints equals that of each."""
    rng = generator(2)
    scene = aa.Scene(shapes(rng))
    poses, psi, gc = WRITTEN.forward(rng.uniform(-1.5, 1.5, (2, 5, 7)))
    many = in_threads(2, lambda: WRITTEN.clearance(WRITTEN.inverse(poses, psi, gc, limits=False), scene))
    assert many.distance.shape == (2, 5) and many.points.shape == (2, 5, 2, 3)
    for at in np.ndindex(2, 5):
        one = WRITTEN.clearance(WRITTEN.inverse(poses[at], psi[at], gc[at], limits=False), scene)
        assert one == aa.types.Clearance(*(column[at] for column in many))


def test_without_obstacles_nothing_is_near() -> None:
    """`clearance` without obstacles is infinite, and the arcs are full."""
    pose, psi, gc = ARM.forward(np.full(7, 0.3))
    near = ARM.clearance(ARM.inverse(pose, psi, gc, limits=False), aa.Scene())
    assert near.distance == np.inf and near.obstacle is None and near.link is None
    assert np.isnan(near.points).all()
    assert ARM._clear(pose, gc, aa.Scene()).is_full


def test_where_nothing_is_reached_nothing_is_near() -> None:
    """For a pose out of reach the widest psi and its nearest pair are NaN and None."""
    near, gc = ARM.forward(np.full(7, 0.3))[::2]
    far = near.copy()
    far[0, 3] += 5.0
    found = ARM._widest(np.stack([far, near]), gc, aa.Scene([aa.Ball([1.0, 1.0, 1.0], 0.1)]))
    assert found.nearest.obstacle.tolist() == [None, "ball_0"]
    for value in (found.psi, found.nearest.distance, found.nearest.psi_rate, found.nearest.points):
        rows = np.isfinite(value).reshape(2, -1)
        assert not rows[0].any() and rows[1].all()


@pytest.mark.parametrize("seed", range(6))
def test_no_arm_angle_is_wider(seed: int) -> None:
    """The widest psi is at least as far from obstacles as any on a grid within limits."""
    rng = generator(3, seed)
    scene = aa.Scene(shapes(rng), clearance=0.01)
    span = np.maximum(WRITTEN.lower, -1.5), np.minimum(WRITTEN.upper, 1.5)
    pose, _, gc = WRITTEN.forward(rng.uniform(*span))
    found = WRITTEN._widest(pose, gc, scene)
    own = WRITTEN.feasible(pose, gc)
    grid = np.linspace(-np.pi, np.pi, 2001)
    grid = grid[own.contains(grid)]
    every = WRITTEN.clearance(
        WRITTEN.inverse(np.broadcast_to(pose, (len(grid), 4, 4)), grid, gc, limits=False), scene
    ).distance
    assert own.contains(found.psi)
    assert found.nearest.distance >= every.max() - 1e-9
    assert found.arcs == WRITTEN.with_(scene=scene).feasible(pose, gc)
    assert (found.nearest.distance < 0.01) == bool(found.arcs.is_empty)


def test_a_refusal_says_by_how_much() -> None:
    """If no psi is clear, the widest one tells the distance that is missing."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.05, forearm=0.05))
    pose, _, gc = arm.forward([0.3, 0.7, 0.2, -1.3, 0.4, 0.8, 0.1])
    start = arm.frames(np.zeros(7))[1, :3, 3]
    scene = aa.Scene([aa.Ball(start + np.array([0, 0.08, 0]), 0.05, name="post")])
    assert arm._clear(pose, gc, scene).status == aa.Status.CLEARANCE
    assert arm._clear(pose, gc, scene).blocking == ("post", "upper_arm")
    found = arm._widest(pose, gc, scene)
    assert found.nearest.distance == pytest.approx(-0.02, abs=1e-9)


def test_limits_that_leave_nothing_leave_no_widest() -> None:
    """If limits leave no psi, the widest is NaN without a pair."""
    pose, _, gc = ARM.forward(np.full(7, 0.3))
    narrow = ARM.with_(lower=np.full(7, 2.0), upper=np.full(7, 2.1))
    found = narrow._widest(pose, gc, aa.Scene([aa.Ball([0, 0, 1], 0.1)]))
    assert np.isnan(found.psi) and np.isnan(found.nearest.distance) and found.nearest.obstacle is None


def test_the_widest_beside_a_box_that_no_needle_of_a_link_is_proven_clear_of() -> None:
    """Next to a box of special shape the widest psi is as far as any on a grid."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.05, forearm=0.045))
    pose, _, gc = arm.forward([-1.92, 1.64, -2.01, 1.33, -1.72, 1.315, -0.55])
    frame = aa.pose([-0.0755, -0.3947, 0.3366], rotvec=[1, 0, 0])
    scene = aa.Scene([aa.Box(frame, (0.1, 0.2, 0.05))])
    found = arm._widest(pose, gc, scene)
    arcs = arm.with_(scene=scene).feasible(pose, gc)
    psi = np.linspace(-np.pi, np.pi, 721)
    sampled = max(
        float(arm.clearance(arm.inverse(pose, p, gc, limits=False), scene).distance)
        for p in psi[arcs.contains(psi)]
    )
    assert found.psi in arcs and found.nearest.distance >= sampled - 1e-9


def test_a_pair_that_rests_does_not_decide_between_arm_angles() -> None:
    """The widest psi is chosen by pairs that psi moves; only if there is none by one at rest."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
    pose, _, gc = arm.forward(np.radians([20, 45, 10, -80, 10, 60, 0]))
    floor = aa.Scene([aa.HalfSpace([0, 0, 1], 0.0)])
    shoulder = arm._widest(pose, gc, floor).nearest  # all that is near is at rest
    assert shoulder.link == "upper_arm" and shoulder.distance == pytest.approx(0.34 - 0.09, abs=1e-12)
    arm = arm.with_(hand=[aa.Capsule([0, 0, 0], [0, 0, 0.15], 0.03, name="drill")])
    lamp = aa.Ball([0.28, 0.26, 0.6], 0.05, name="lamp")
    scene, lamp_alone = aa.Scene([lamp]), aa.Scene([lamp], ignore=[("drill", "forearm")])
    rest = 0.126 - 0.08 - 0.03  # from the wrist to the flange, less both radii
    found = arm._widest(pose, gc, scene)
    assert arm.clearance(arm.inverse(pose, found.psi, gc, limits=False), scene).distance == pytest.approx(
        rest, abs=2e-9
    )
    assert (found.nearest.obstacle, found.nearest.link) == ("lamp", "forearm")
    grid = np.linspace(-np.pi, np.pi, 4001)
    grid = grid[arm.feasible(pose, gc).contains(grid)]
    poses = np.broadcast_to(pose, (len(grid), 4, 4))
    resting = arm.clearance(arm.inverse(poses, grid, gc, limits=False), scene).distance > rest - 1e-9
    apart = arm.clearance(arm.inverse(poses, grid, gc, limits=False), lamp_alone).distance
    assert found.nearest.distance >= apart[resting].max() - 1e-9 > rest + 0.1
