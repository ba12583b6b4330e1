"""Scenes about arms whose values are proven in cells: an offset wrist or shoulder, an own chain."""

from __future__ import annotations

import pickle
import re
from typing import Any

import numpy as np
import pytest
from scenes.test_chain_scenes import ALL_LINKS, BASE, BONES, CHAINS, away, obstacles, questions
from support.calibrated import ARMS, calibrated
from support.chains import read_urdf
from support.draw import count
from support.touching import distances, least_distance

import armangle as aa
from armangle.models.chain import rotation_about

SLACK = 3e-9
"""m: what is nearer than that to the clearance may be said to touch."""
ROUNDING = 1e-12
TOOL = aa.pose([0.02, 0.05, 0.1], rpy=[0.4, 0.0, 1.0])
FR3, PR2 = map(aa.Arm.from_catalogue, ("franka_fr3", "willow_garage_pr2_left"))
FAMILIES = {
    "franka_fr3": FR3,
    "ufactory_xarm7": aa.Arm.from_catalogue("ufactory_xarm7"),
    "fetch": aa.Arm.from_catalogue("fetch"),
    "on another base": FR3.with_(base=BASE, tool=TOOL, name="FR3 upside"),
    "shoulder on another base": PR2.with_(base=BASE, tool=TOOL, name="PR2 upside"),
    "own chain": ARMS["kuka_iiwa7_r800 1.0 mm"],
    "franka_fr3 on its own chain": calibrated("franka_fr3", 1.0, 1.0),
    "fetch on its own chain": calibrated("fetch", 1.0, 1.0),
}
FREE = {name: arm for name, arm in FAMILIES.items() if arm.redundancy != "arm_angle"}
HOME = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
BODIES = {"bones": BONES, "all links": ALL_LINKS}
EVERY = pytest.mark.parametrize("arm", FAMILIES.values(), ids=FAMILIES.keys())
MADE = FAMILIES | {f"chain {name}": arm for name, arm in CHAINS.items()}
MORE = pytest.mark.parametrize("arm", MADE.values(), ids=MADE.keys())
EVERY_FREE = pytest.mark.parametrize("arm", FREE.values(), ids=FREE.keys())
EACH_BODY = pytest.mark.parametrize("body", BODIES.values(), ids=BODIES.keys())


def room(arm: aa.Arm, q: Any, scene: aa.Scene) -> Any:
    """The least distance at joints (..., 7) minus the clearance, m, by plain distances."""
    return least_distance(arm, q, scene) - scene.clearance


def held(arm: aa.Arm, pose: Any, psi: Any, gc: int) -> Any:
    """Joints (n, 7) at values psi (n,) of the free parameter; NaN without a solution."""
    return arm.inverse(np.broadcast_to(pose, (len(psi), 4, 4)), psi, gc, on_error="nan", limits=False)


def obstacle_ends(arcs: aa.ArcSet) -> list[tuple[float, aa.types.ArcEnd]]:
    """The ends of a set that obstacles make, each with its value."""
    rows = zip(arcs.intervals, arcs.ends, strict=True) if arcs.ends else ()
    pairs = [pair for row, ends in rows for pair in zip(row, ends, strict=False)]
    return [(float(psi), end) for psi, end in pairs if end.side == "obstacle"]


@pytest.mark.turns(6)
@EACH_BODY
@MORE
def test_a_value_is_feasible_if_and_only_if_it_keeps_limits_and_clear(arm: aa.Arm, body: aa.Body) -> None:
    """`feasible` in a scene holds psi that keep limits and clearance by plain distances, but for
    `unproven`.
    """
    inside = outside = unproven = 0
    for made, _, pose, _, gc, scene, rng in questions(arm, body, 21):
        own, arcs = made.feasible(pose, gc), made.with_(scene=scene).feasible(pose, gc)
        ends = arcs.intervals.ravel() if arcs.ends else np.empty(0)
        beside = [ends + sign * 10 ** rng.uniform(-8, -2, ends.shape) for sign in (-1, 1)]
        psi = np.concatenate([rng.uniform(-np.pi, np.pi, 300), ends, *beside])
        q = held(made, pose, psi, gc)
        there = np.isfinite(q[:, 0])
        psi, left = psi[there], room(made, q[there], scene)
        said, kept = arcs.contains(psi), own.contains(psi)
        assert not (said & ~kept & (away(own, psi) > 1e-9)).any()
        at_end = away(arcs, psi) <= 1e-9
        assert (left[said & ~at_end] >= -ROUNDING).all()
        assert (left[said & at_end] >= -SLACK).all()
        lost = kept & ~said & ~at_end & (left > SLACK)
        assert not lost.any() or arcs.unproven > 0
        assert arcs.unproven < 1e-6 or made.geometry.chain is not None
        inside += int(said.sum())
        outside += int((kept & ~said).sum())
        unproven += int((lost & (away(own, psi) > 1e-6) & (away(arcs, psi) > 1e-6)).sum())
        shapes = {
            *scene.names,
            *(pair for named in distances(made, q[there][:1], scene)[1] for pair in named),
        }
        assert {name for _, end in obstacle_ends(arcs) for name in (end.obstacle, end.link)} <= shapes
    assert inside > 50 and outside > 50 and unproven <= 0.01 * outside


@pytest.mark.turns(2)
@EVERY_FREE
def test_all_branches_at_once_are_the_same(arm: aa.Arm) -> None:
    """`feasible` of all branches in a scene equals that of each branch."""
    for made, _, pose, _, _, scene, _ in questions(arm, BONES, 22):
        every = made.with_(scene=scene).feasible(pose)
        for gc in range(8):
            one = made.with_(scene=scene).feasible(pose, gc)
            assert every[gc].status == one.status
            assert every[gc].blocking == one.blocking
            assert ((every[gc] & ~one) | (one & ~every[gc])).measure < 1e-8


@pytest.mark.turns(4)
@EVERY
def test_an_end_of_an_obstacle_is_where_its_pair_comes_to_the_clearance(arm: aa.Arm) -> None:
    """At each end that an obstacle makes its pair is at the clearance, and none is nearer."""
    checked = 0
    asked = [one for body in BODIES.values() for one in questions(arm, body, 23)]
    for made, _, pose, _, _, scene, _ in asked:
        every = made.with_(scene=scene).feasible(pose)
        for gc in range(8):
            for psi, end in obstacle_ends(every[gc]):
                apart, names = distances(made, held(made, pose, [psi], gc)[0], scene)
                mine = [apart[i] for i, name in enumerate(names) if {*name} == {end.obstacle, end.link}]
                assert abs(min(mine) - scene.clearance) < 1e-7
                assert apart.min() >= scene.clearance - SLACK
                checked += 1
    assert checked > 3


@pytest.mark.turns(4)
@EACH_BODY
@MORE
def test_distances_are_those_of_the_true_links(arm: aa.Arm, body: aa.Body) -> None:
    """`clearance` gives distance, pair, points and psi_rate as plain distances of the true links do."""
    for made, q, pose, psi, gc, scene, _ in questions(arm, body, 24):
        apart, names = distances(made, q, scene)
        near = made.clearance(q, scene)
        assert abs(near.distance - apart.min()) < 1e-8
        assert {near.obstacle, near.link} in [{*names[i]} for i in np.flatnonzero(apart < apart.min() + 1e-8)]
        if near.distance > 0:
            assert abs(np.linalg.norm(near.points[0] - near.points[1]) - near.distance) < 1e-9
        step = 1e-6
        beside = held(made, pose, [psi - step, psi + step], gc)
        if not np.isfinite(beside).all() or near.distance < 0:
            continue
        one, other = made.clearance(beside, scene).distance
        pairs = made.clearance(beside, scene)
        if {*pairs.obstacle, *pairs.link} == {near.obstacle, near.link}:
            slope, share = (other - one) / (2 * step), 1e-4 if made.kind == "srs_chain" else 1e-3
            assert abs(slope - near.psi_rate) < share * max(1.0, abs(slope))


@pytest.mark.turns(4)
@MORE
def test_solve_is_the_nearest_that_is_clear(arm: aa.Arm) -> None:
    """`solve` in a scene keeps limits and clearance, and no clear joints on a grid are nearer."""
    solved = refused = 0
    for made, q, pose, _, _, scene, rng in questions(arm, BONES, 25):
        among = made.with_(scene=scene)
        seed = np.clip(q + rng.normal(size=7) * 0.4, made.lower, made.upper)
        found, every = among.solve(pose, seed=seed), among.feasible(pose)
        if not found.ok:
            assert np.all(every.is_empty), found.status
            proven = (aa.Status.CLEARANCE, aa.Status.POSE_BLOCKED, aa.Status.LIMITS)
            assert found.status in proven or (arm.geometry.chain is not None and np.sum(every.unproven) > 0)
            refused += 1
            continue
        solved += 1
        proven = found.status is aa.Status.OK
        assert proven or (made.geometry.chain is not None and found.status is aa.Status.UNPROVEN)
        assert room(made, found.q, scene) >= -SLACK
        assert np.abs(made.forward(found.q)[0] - pose).max() < 1e-9
        assert made.within_limits(found.q)
        for gc in range(8):  # nothing that was tried is nearer
            psi = np.concatenate([
                np.linspace(a, b, 200) for a, b in np.atleast_2d(every[gc].intervals) if np.isfinite(a)
            ] or [np.empty(0)])  # fmt: skip
            if not len(psi) or not proven:
                continue
            near = np.broadcast_to(seed, (len(psi), 7))
            tried = made.inverse(np.broadcast_to(pose, (len(psi), 4, 4)), psi, gc, seed=near, on_error="nan")
            far = np.linalg.norm(tried - seed, axis=-1)
            assert not (far < found.distance - 1e-8).any()
        assert (
            every[int(found.gc)].contains(float(found.psi))
            or away(every[int(found.gc)], [float(found.psi)]) < 1e-6
        )
        home = among.solve(pose, seed=found.q)
        assert home.distance < 1e-9
    assert solved > 2


@pytest.mark.turns(4)
@EVERY_FREE
def test_every_solution_keeps_clear_and_none_is_nearer_than_solve(arm: aa.Arm) -> None:
    """`solutions`, and `solve` with allowed= or prefer="margin", keep clear; none is better than `solve`."""
    found = 0
    for made, q, pose, _, _, scene, rng in questions(arm, BONES, 27):
        among, allowed = made.with_(scene=scene), aa.ArcSet([[-1.5, 1.5]])
        seed = np.clip(q + rng.normal(size=7) * 0.4, made.lower, made.upper)
        nearest, each = among.solve(pose, seed=seed), among.solutions(pose, seed=seed)
        assert nearest.ok == each.ok
        assert not nearest.ok or abs(each.distance.min() - nearest.distance) < 1e-6
        narrowed = among.solve(pose, seed=seed, allowed=allowed)
        assert not narrowed.ok or allowed.contains(narrowed.psi)
        widest = among.solve(pose, prefer="margin")
        assert widest.ok == nearest.ok
        assert not widest.ok or widest.margin >= each.margin.max() - 1e-6
        for one in [*each, *(x for x in (narrowed, widest) if x.ok)]:
            assert room(made, one.q, scene) >= -SLACK and made.within_limits(one.q)
            assert np.abs(made.forward(one.q)[0] - pose).max() < 1e-9
            found += 1
    assert found > 10


@pytest.mark.turns(8)
@MORE
def test_prefer_clearance_is_the_farthest_from_the_obstacles(arm: aa.Arm) -> None:
    """`solve(prefer="clearance")` is as far from obstacles as any psi on a grid."""
    asked = 0
    for made, q, pose, _, gc, scene, _ in questions(arm, BONES, 26):
        among = made.with_(scene=scene)
        found = among.solve(pose, seed=q, prefer="clearance", gc=gc)
        arcs = among.feasible(pose, gc)
        if not found.ok or arcs.is_empty:
            assert found.ok == arcs.ok
            continue
        psi = np.concatenate([np.linspace(a, b, 300) for a, b in arcs.intervals])
        best = np.nanmax(room(made, held(made, pose, psi, gc), scene))
        assert room(made, found.q, scene) >= best - 1e-6 - made.feasible(pose, gc).unproven
        asked += 1
    assert asked > 1


@pytest.mark.turns(4)
@MORE
def test_steps_keep_clear(arm: aa.Arm) -> None:
    """`step` and `follow` in a scene keep the clearance and the pose; a step that fails keeps the joints."""
    taken = 0
    for made, q, pose, _, _, scene, rng in questions(arm, BONES, 27):
        among = made.with_(scene=scene)
        found = among.solve(pose, seed=q)
        if not found.ok:
            continue
        ahead = aa.pose(1e-3 * rng.normal(size=3)) @ pose
        for policy in (aa.Repulsion(), aa.Hold(), aa.Centre()):
            now = aa.step(among, found.q, ahead, policy=policy, dt=0.1)
            if now.status is not aa.Status.OK:
                assert (now.q == found.q).all()
                continue
            taken += 1
            assert room(made, now.q, scene) >= -SLACK
            assert np.abs(made.forward(now.q)[0] - ahead).max() < 1e-9
        path = aa.follow(among, np.stack([pose, ahead]), start=found.q)
        solved = np.isfinite(path.q[:, 0])
        assert (room(made, path.q[solved], scene) >= -SLACK).all()
        assert (path.clearance[solved] >= scene.clearance - SLACK).all()
    assert taken > 3


def test_a_step_stops_at_a_wall_that_moves_in() -> None:
    """`follow` with a ball that comes nearer keeps the clearance in all rows that are OK, and gives way."""
    arm = FR3.with_(body=BONES)
    q = np.array([0.3, 0.3, 0.2, -1.6, 0.1, 2.0, 0.4])
    pose, elbow = arm.forward(q)[0], arm.elbow(q)
    poses = np.repeat(pose[None], 30, axis=0)
    scenes = [
        aa.Scene([aa.Ball(elbow + np.array([0, 0.5 - 0.02 * k, 0]), 0.1, name="ball")], clearance=0.02)
        for k in range(30)
    ]
    path = aa.follow(arm, poses, start=q, scene=scenes, on_fail="hold")
    rows = np.flatnonzero(path.status == aa.Status.OK.value)
    assert len(rows) > 5
    for k in rows:
        assert room(arm, path.q[k], scenes[k]) >= -SLACK
    assert np.abs(path.q[rows] - q).max() > 0.01


@pytest.mark.parametrize("name", ["franka_fr3", "own chain"])
def test_what_no_joint_moves_blocks_the_pose(name: str) -> None:
    """A gripper in an obstacle is POSE_BLOCKED; an arm within one is CLEARANCE, and its pose still
    reachable.
    """
    arm = FAMILIES[name].with_(body=BONES, hand=[aa.Ball([0, 0, 0.05], 0.05)])
    q = HOME if name == "own chain" else 0.5 * (arm.lower + arm.upper)
    pose, _, gc = arm.forward(q)
    cup = aa.Scene([aa.Ball((pose @ [0, 0, 0.05, 1])[:3], 0.02, name="cup")])
    arcs = arm.with_(scene=cup).feasible(pose, gc)
    assert arcs.is_empty and arcs.status is aa.Status.POSE_BLOCKED and arcs.blocking == ("cup", "hand")
    assert arm.with_(scene=cup).solve(pose, seed=q).status is aa.Status.POSE_BLOCKED
    assert aa.step(arm.with_(scene=cup), q, pose).status is aa.Status.POSE_BLOCKED
    assert arm.clearance(q, cup).distance == pytest.approx(-0.07)
    around = aa.Scene([aa.Ball(arm.elbow(q), 0.6, name="all")])
    bare = arm.with_(hand=[], scene=around)
    every = bare.feasible(pose)
    assert np.all(every.is_empty) and every[int(gc)].status is aa.Status.CLEARANCE
    assert bare.solve(pose, seed=q).status is aa.Status.CLEARANCE
    assert not bare.solve(pose, seed=q).ok and arm.reachable(pose) and bare.reachable(pose)


def test_the_arm_keeps_body_hand_and_scene() -> None:
    """An offset arm keeps model, gripper and scene in `with_`, pickles, hash and repr."""
    scene = aa.Scene([aa.Ball([0.5, 0.0, 0.5], 0.1, name="lamp")], clearance=0.01)
    arm = FAMILIES["fetch"].with_(body=BONES, hand=[aa.Ball([0, 0, 0.05], 0.05)], scene=scene)
    assert arm.scene == scene and arm.body == BONES and len(arm.hand) == 1
    assert pickle.loads(pickle.dumps(arm)) == arm and hash(arm) == hash(pickle.loads(pickle.dumps(arm)))
    assert arm != arm.with_(scene=None) and arm.with_(scene=None).with_(scene=scene) == arm
    assert arm.with_(lower=arm.lower - 0.1).scene == scene
    rebuilt: Any = eval(repr(arm), {"Arm": aa.Arm, **vars(aa)})
    assert rebuilt.scene == scene and rebuilt.body == arm.body
    with pytest.raises(aa.SceneError, match="body"):
        FAMILIES["fetch"].with_(scene=scene)
    assert arm.with_(singularity_margin=0.1).scene == scene


@pytest.mark.turns(2)
@EVERY
def test_a_tracker_never_touches(arm: aa.Arm) -> None:
    """A tracker in a scene keeps the clearance, in cycles and between, and names the ball that stops it."""
    made, stood, followed = arm.with_(body=BONES), 0, 0
    q = np.clip(HOME * [1, 1, 1, 1.3, 1, 1, 1], made.lower + 0.2, made.upper - 0.2)
    pose, wrist = made.forward(q)[0], made.frames(q)[5, :3, 3]
    for way in np.array([[0, 1, 0], [0, -1, 0], [0.6, 0.8, 0]])[: count(2)]:
        scene = aa.Scene([aa.Ball(wrist + 0.28 * way, 0.1, name="ball")], clearance=0.01)
        if room(made, q, scene) < 0.01:
            continue
        hands = np.repeat(pose[None], 400, axis=0)
        hands[:, :3, 3] += 0.2 * 0.004 * np.arange(400)[:, None] * way
        tracker = aa.Tracker(made.with_(scene=scene), dt=0.004, velocity=2.0, acceleration=20.0).start(q)
        ticks = [tracker.step(hand) for hand in hands]
        every = np.array([now.q for now in ticks])
        between = np.concatenate([every, 0.5 * (every[1:] + every[:-1])])
        assert room(made, between, scene).min() >= -1e-9
        followed += sum(now.status is aa.Tracking.FOLLOWING for now in ticks)
        stood += sum(now.pair is not None for now in ticks)
        assert {now.pair[0] for now in ticks if now.pair} <= {"ball"}
    assert followed > 50


@pytest.mark.parametrize("name", ["franka_fr3", "own chain"])
def test_a_tracker_refuses_to_start_where_the_links_touch(name: str) -> None:
    """`Tracker.start` raises SceneError at joints in collision."""
    arm = FAMILIES[name].with_(body=BONES)
    q = HOME if name == "own chain" else 0.5 * (arm.lower + arm.upper)
    at_elbow = aa.Scene([aa.Ball(arm.elbow(q) + np.array([0, 0, 0.12]), 0.06, name="lamp")])
    with pytest.raises(aa.SceneError, match="lamp"):
        aa.Tracker(arm.with_(scene=at_elbow)).start(q)


def test_the_questions_are_about_something() -> None:
    """`obstacles` draws all four kinds of shape."""
    arm = FAMILIES["franka_fr3"]
    shapes = obstacles(arm, np.random.default_rng(1), 4)
    assert {type(shape) for shape in shapes} == {aa.Ball, aa.Capsule, aa.Box, aa.HalfSpace}


SPHERE = '<collision><origin xyz="0.01 0.02 0.03"/><geometry><sphere radius="0.04"/></geometry></collision>'


@pytest.mark.parametrize("name", ["franka_fr3", "fetch"])
def test_the_body_of_a_file_moves_with_its_links(name: str) -> None:
    """A sphere of an offset arm's URDF moves with its link in `Body.from_urdf`."""
    text = re.sub(r'<link name="(link_\d)" />', rf'<link name="\1">{SPHERE}</link>', FAMILIES[name].to_urdf())
    arm = aa.Arm.from_urdf(text)
    body = aa.Body.from_urdf(text)
    assert arm.kind == FAMILIES[name].kind and len(body.links) == 7
    chain = read_urdf(text, offset=True)
    q = np.array([0.3, 0.4, -0.2, -1.2, 0.5, 0.9, -0.6])
    frames, link = arm.frames(q), np.eye(4)
    for joint, angle, (frame, shapes) in zip(chain.joints, q, body.links, strict=True):
        link = link @ joint.origin @ rotation_about(joint.axis, np.float64(angle))
        (ball,) = shapes
        assert isinstance(ball, aa.Ball) and ball.radius == 0.04
        np.testing.assert_allclose(
            frames[frame] @ [*ball.center, 1.0], link @ [0.01, 0.02, 0.03, 1.0], rtol=0, atol=1e-9
        )
