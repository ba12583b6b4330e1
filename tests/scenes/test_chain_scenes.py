"""Scenes about arms that are only nearly S-R-S: arcs, distances and motions of the true links."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.calibrated import ARMS, calibrated
from support.draw import count, generator
from support.touching import distances

import armangle as aa

THINNEST = 0.06
BONES = aa.Body.bones(upper_arm=0.07, forearm=THINNEST, plates=True)
ALL_LINKS = aa.Body({
    1: [aa.Capsule([0.0, 0.1, 0.0], [0.03, -0.02, 0.06], 0.03)],
    2: [aa.Ball([0.05, 0.06, 0.1], 0.04), aa.Capsule([0, 0, 0.1], [0, 0, 0.2], 0.05)],
    3: [aa.Ball([0.03, -0.1, 0.04], 0.05)],
    4: [aa.Capsule([0.02, 0.05, 0.1], [0.03, -0.06, 0.18], 0.03)],
    5: [aa.Capsule([0.06, -0.1, 0.02], [0.05, -0.04, 0.03], 0.04)],
    6: [aa.Ball([0.04, 0.05, 0.05], 0.04)],
})  # fmt: skip
BODIES = {"bones": BONES, "all links": ALL_LINKS}
BASE = aa.pose([0.4, -0.2, 0.7], rpy=[0.3, 1.2, -0.5])
CHAINS = {
    name: ARMS[name] for name in ("kuka_iiwa7_r800 0.1 mm", "barrett_wam7 1.0 mm", "openarm_v10 2.0 mm")
}
CHAINS["on another base"] = CHAINS["barrett_wam7 1.0 mm"].with_(base=BASE)
EVERY = pytest.mark.parametrize("arm", CHAINS.values(), ids=CHAINS.keys())
MOST_OFF = 1e-6  # rad: so near an end a psi may be left out
SLACK = 3e-9  # m


def obstacles(arm: aa.Arm, rng: np.random.Generator, how_many: int) -> list[Any]:
    """Shapes within reach of the links, of all kinds in turn."""
    shoulder, out = arm.frames(np.zeros(7))[1, :3, 3], []
    for kind in range(how_many):
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        centre = shoulder + along * rng.uniform(0.2, 0.8) * arm.reach
        radius = rng.uniform(0.0, 0.08)
        match (kind + how_many) % 4:
            case 0:
                out.append(aa.Ball(centre, radius))
            case 1:
                out.append(aa.Capsule(centre, centre + rng.normal(size=3) * 0.15, radius))
            case 2:
                size = rng.uniform(0, 0.3, 3)
                out.append(aa.Box(aa.pose(centre, rpy=rng.uniform(-3, 3, 3)), size, radius))
            case _:
                out.append(aa.HalfSpace(along, float(along @ (shoulder - 0.4 * arm.reach * along))))
    return out


def questions(arm: aa.Arm, body: aa.Body, seed: int) -> Any:
    """Poses of random postures, and scenes about them."""
    rng = generator(seed, len(arm.name))
    arm = arm.with_(body=body)
    span = np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0)
    for k in range(count(9)):
        q = rng.uniform(*span)
        scene = aa.Scene(obstacles(arm, rng, 1 + k % 3), clearance=float(rng.choice([0.0, 0.015])))
        yield arm, q, *arm.forward(q), scene, rng


def apart_at(arm: aa.Arm, pose: Any, psi: Any, gc: int, scene: aa.Scene) -> Any:
    """The least distance at each arm angle, m; NaN where there is no posture."""
    q = arm.inverse(np.broadcast_to(pose, (len(psi), 4, 4)), psi, gc, on_error="nan", limits=False)
    there, out = np.isfinite(q[:, 0]), np.full(len(psi), np.nan)
    out[there] = distances(arm, q[there], scene)[0].min(axis=-1)
    return out


def away(arcs: aa.ArcSet, psi: Any) -> Any:
    """How far angles are from the ends of a set, rad."""
    ends = arcs.intervals.ravel() if arcs.ends else np.empty(0)
    return np.array([np.min(np.abs(np.angle(np.exp(1j * (ends - x)))), initial=9.0) for x in psi])


@pytest.mark.slow
@pytest.mark.parametrize("body", BODIES)
@EVERY
def test_what_is_clear_is_clear_and_what_is_left_out_touches(arm: aa.Arm, body: str) -> None:
    asked = lost = 0
    for made, _, pose, _, gc, scene, rng in questions(arm, BODIES[body], 1):
        own, arcs = made.feasible(pose, gc), made.with_(scene=scene).feasible(pose, gc)
        psi = np.concatenate([rng.uniform(-np.pi, np.pi, 300), arcs.intervals.ravel() if arcs.ends else []])
        inside = arcs.contains(psi)
        assert not (inside & ~own.contains(psi)).any()
        least = apart_at(made, pose, psi, gc, scene)
        assert (least[inside] >= scene.clearance - 1e-12).all()
        out = own.contains(psi) & ~inside & (away(arcs, psi) > MOST_OFF) & (away(own, psi) > MOST_OFF)
        asked += out.sum()
        lost += (least[out] > scene.clearance + SLACK).sum()
        assert lost == 0 or arcs.unproven > 0
        assert all(end.obstacle in (*scene.names, *_links(made)) for end in _obstacle_ends(arcs))
    assert asked > 100 and lost <= 0.01 * asked


def _links(arm: aa.Arm) -> set[str]:
    shapes = arm.body._shapes(arm.d_se, arm.d_ew, arm.a_3, arm.a_4, arm.d_4)
    return {shape.name or f"link_{link}" for link, shape in shapes}


def _obstacle_psi(arcs: aa.ArcSet) -> Any:
    rows = zip(arcs.intervals, arcs.ends, strict=True) if arcs.ends else ()
    return np.array(
        [psi for row, ends in rows for psi, end in zip(row, ends, strict=True) if end.side == "obstacle"]
    )


def _obstacle_ends(arcs: aa.ArcSet) -> list[Any]:
    return [end for pair in arcs.ends for end in pair if end.side == "obstacle"]


def test_without_deviation_the_arcs_are_those_of_the_exact_arm() -> None:
    exact = aa.Arm.from_catalogue("barrett_wam7")
    same = calibrated("barrett_wam7", 0.0, 0.0)
    for body in BODIES.values():
        for arm, _, pose, psi, gc, scene, _ in questions(same, body, 2):
            plain = exact.with_(body=body)
            for found, wanted in (
                (arm._clear(pose, gc, scene), plain._clear(pose, gc, scene)),
                (arm.with_(scene=scene).feasible(pose, gc), plain.with_(scene=scene).feasible(pose, gc)),
            ):
                assert _apart(found, wanted) <= found.unproven + 1e-5
            near, there = (
                arm.clearance(arm.inverse(pose, psi, gc, limits=False), scene),
                plain.clearance(plain.inverse(pose, psi, gc, limits=False), scene),
            )
            assert abs(near.distance - there.distance) < 1e-9
            assert {near.obstacle, near.link} == {there.obstacle, there.link}


def _apart(one: aa.ArcSet, other: aa.ArcSet) -> float:
    return float((one & ~other).measure + (other & ~one).measure)


@pytest.mark.turns(2)
@pytest.mark.slow
@EVERY
def test_distances_are_those_of_the_true_links(arm: aa.Arm) -> None:
    for body in BODIES.values():
        for made, q, pose, psi, gc, scene, _ in questions(arm, body, 3):
            apart, names = distances(made, q, scene)
            near = made.clearance(made.inverse(pose, psi, gc, limits=False), scene)
            assert abs(near.distance - apart.min()) < 1e-8
            assert {near.obstacle, near.link} == set(names[int(np.argmin(apart))])
            if near.distance > 0:
                assert abs(np.linalg.norm(near.points[0] - near.points[1]) - near.distance) < 1e-9
            beside = [
                made.clearance(made.inverse(pose, psi + step, gc, limits=False), scene)
                for step in (-1e-6, 1e-6)
            ]
            pair = near.obstacle, near.link
            if near.distance > 0 and all((one.obstacle, one.link) == pair for one in beside):
                slope = (beside[1].distance - beside[0].distance) / 2e-6
                assert abs(slope - near.psi_rate) < 1e-4 * max(1.0, abs(slope))


@pytest.mark.turns(2)
@pytest.mark.slow
@EVERY
def test_no_arm_angle_is_wider(arm: aa.Arm) -> None:
    for made, _, pose, _, gc, scene, _ in questions(arm, BONES, 7):
        found = made._widest(pose, gc, scene)
        own = made.feasible(pose, gc)
        if own.is_empty:
            assert np.isnan(found.psi)
            continue
        grid = np.linspace(-np.pi, np.pi, 1001)
        grid = grid[own.contains(grid)]
        every = apart_at(made, pose, grid, gc, scene)
        if np.isnan(found.psi):  # the cores of links are inside something at every psi
            assert np.nanmax(every) < -0.99 * THINNEST and found.arcs.is_empty
            continue
        assert own.contains(found.psi) and found.arcs == made.with_(scene=scene).feasible(pose, gc)
        assert found.nearest.distance >= np.nanmax(every) - 1e-6 - own.unproven
        at = distances(made, made.inverse(pose, found.psi, gc, limits=False), scene)[0].min()
        assert abs(at - found.nearest.distance) < 1e-8


@pytest.mark.slow
@EVERY
def test_solve_step_and_follow_keep_clear(arm: aa.Arm) -> None:
    refused = 0
    for made, q, pose, _, _, scene, _ in questions(arm, BONES, 4):
        found = made.with_(scene=scene).solve(pose, seed=q)
        every = made.with_(scene=scene).feasible(pose)
        if not found.ok:
            assert np.all(every.is_empty)
            refused += 1
            continue
        assert every[found.gc].contains(found.psi)
        assert distances(made, found.q, scene)[0].min() >= scene.clearance - 1e-9
        assert np.abs(made.forward(found.q)[0] - pose).max() < 1e-11
        many = made.with_(scene=scene).solutions(pose, seed=q)
        assert abs(many[0].distance - found.distance) < 1e-9
        ahead = pose.copy()
        ahead[2, 3] += 1e-3
        taken = aa.step(made.with_(scene=scene), found.q, ahead, dt=0.1)
        if taken.status is aa.Status.OK:
            assert distances(made, taken.q, scene)[0].min() >= scene.clearance - 1e-9
            path = aa.follow(made.with_(scene=scene), np.stack([pose, ahead]), start=found.q)
            assert path.ok
            assert (distances(made, path.q, scene)[0].min(axis=-1) >= scene.clearance - 1e-9).all()
    assert refused < count(9)


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800 1.0 mm", "openarm_v10 2.0 mm"])
def test_a_certified_plan_touches_nothing_between_its_rows(name: str) -> None:
    certified = 0
    for made, q, pose, _, _, scene, rng in questions(ARMS[name], BONES, 6):
        found = made.with_(scene=scene).solve(pose, seed=q)
        if not found.ok:
            continue
        ahead = aa.pose(0.05 * rng.normal(size=3)) @ pose
        path = aa.plan(made.with_(scene=scene), aa.Line(pose, ahead))
        if not path.ok:
            continue
        s = np.linspace(0.0, 1.0, 1001)
        apart = distances(made, path.at(s).q, scene)[0].min(axis=-1)
        if path.certified:
            certified += 1
            assert (apart >= scene.clearance - 1e-9).all()
        else:
            assert len(path.uncertified)
    assert certified >= 1


@pytest.mark.slow
def test_the_naive_way_keeps_the_nominal_links_clear_and_touches() -> None:
    """Ends of the nominal arm's arcs: there the true links are nearer to what they touch than asked."""
    short = [0.0]
    asked = [each for seed in range(5, 13) for each in questions(ARMS["openarm_v10 2.0 mm"], BONES, seed)]
    for arm, _, pose, _, gc, scene, _ in asked:
        apart = apart_at(
            arm, pose, _obstacle_psi(arm.nominal.with_(scene=scene).feasible(pose, gc)), gc, scene
        )
        short += (scene.clearance - apart[np.isfinite(apart)]).tolist()
        kept = apart_at(arm, pose, _obstacle_psi(arm.with_(scene=scene).feasible(pose, gc)), gc, scene)
        assert (np.abs(kept - scene.clearance) < 1e-6).all()
    assert max(short) > 1e-4


def test_what_the_arm_angle_does_not_move_blocks_the_pose() -> None:
    arm = ARMS["kuka_iiwa7_r800 1.0 mm"].with_(body=BONES).with_(hand=[aa.Ball([0, 0, 0.05], 0.05)])
    pose, psi, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    at_hand = aa.Scene([aa.Ball((pose @ [0, 0, 0.05, 1])[:3], 0.02, name="cup")])
    arcs = arm.with_(scene=at_hand).feasible(pose, gc)
    assert arcs.is_empty and arcs.status is aa.Status.POSE_BLOCKED and arcs.blocking == ("cup", "hand")
    assert arm.with_(scene=at_hand).solve(pose).status is aa.Status.POSE_BLOCKED
    assert arm.clearance(arm.inverse(pose, psi, gc, limits=False), at_hand).distance == pytest.approx(-0.07)
    around = aa.Scene([aa.Ball(arm.frames([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[3, :3, 3], 1.0, name="all")])
    assert arm._clear(pose, gc, around).status is aa.Status.POSE_BLOCKED
    assert arm.with_(hand=[])._clear(pose, gc, around).status is aa.Status.CLEARANCE
    assert arm._clear(pose, gc, aa.Scene()) == arm.with_(lower=[-9] * 7, upper=[9] * 7).feasible(pose, gc)


HOME = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800 0.1 mm", "kuka_iiwa7_r800 2.0 mm"])
def test_a_tracker_never_touches_with_the_true_links(name: str) -> None:
    """A hand drags the tool along and then through a ball; the nominal arm's tracker touches it."""
    arm, touched, stood, followed = ARMS[name].with_(body=BONES), 0, 0, 0
    pose, wrist = arm.forward(HOME)[0], arm.frames(HOME)[5, :3, 3]
    for way in np.array([[0, 1, 0], [0, -1, 0], [0.6, 0.8, 0], [0.6, -0.8, 0]]):
        ball = aa.Ball(wrist + 0.28 * way, 0.1, name="ball")
        scene = aa.Scene([ball], clearance=0.01)
        hands = np.repeat(pose[None], 700, axis=0)
        hands[:, :3, 3] += 0.15 * 0.004 * np.arange(700)[:, None] * way
        trackers = [
            aa.Tracker(one.with_(scene=scene), dt=0.004, velocity=2.0, acceleration=20.0)
            for one in (arm, arm.nominal)
        ]
        for tracker in trackers:
            tracker.start(HOME)
        ticks = [trackers[0].step(hand) for hand in hands]
        q = np.array([now.q for now in ticks])
        assert distances(arm, q, scene)[0].min() >= scene.clearance - 1e-9
        touched += int(distances(arm, trackers[1].run(hands), scene)[0].min() < scene.clearance - 1e-9)
        follows = np.array([now.status is aa.Tracking.FOLLOWING for now in ticks])
        assert np.abs(arm.forward(q[follows])[0] - hands[follows]).max() < 1e-8
        followed += int(follows.sum())
        pairs = [now.pair for now in ticks if now.pair is not None]
        stood += len(pairs)
        assert {pair[0] for pair in pairs} <= {"ball"}
    assert followed > 300
    assert stood > 50
    assert touched > 0 or not name.endswith("2.0 mm")


def test_a_tracker_refuses_to_start_where_the_true_links_touch() -> None:
    arm = ARMS["kuka_iiwa7_r800 1.0 mm"].with_(body=BONES)
    beside_elbow = arm.frames(HOME)[3, :3, 3] + np.array([0.0, 0.0, 0.12])
    tracker = aa.Tracker(arm.with_(scene=aa.Scene([aa.Ball(beside_elbow, 0.06, name="lamp")])))
    with pytest.raises(aa.SceneError, match="lamp"):
        tracker.start(HOME)
    tracker.start(HOME, outside="escape")
    assert tracker.step(arm.forward(HOME)[0]).status is aa.Tracking.RETURNING
