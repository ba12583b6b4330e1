"""Plans that keep clear of a scene, between their rows too."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.draw import count, generator
from support.touching import least_distance

import armangle as aa

BARE = aa.Arm.from_catalogue("kuka_iiwa7_r800")
ARM = BARE.with_(body=aa.Body.bones(upper_arm=0.06, forearm=0.05))
THIN = BARE.with_(body=aa.Body.bones(upper_arm=0.0002, forearm=0.0002))
Q = np.radians([20, 45, 10, -80, 10, 60, 0])
POSE, PSI, GC = ARM.forward(Q)
LINE = np.tile(POSE, (200, 1, 1))
LINE[:, 1, 3] += np.linspace(0.0, 0.1, 200)
LAMP = aa.Scene([aa.Ball([0.28, 0.26, 0.6], 0.06, name="lamp")], clearance=0.01)
DENSE = np.linspace(0.0, 1.0, 2001)


def least(arm: aa.Arm, q: np.ndarray, scene: aa.Scene) -> float:
    """The distance (m) of the nearest pair over joints (..., 7)."""
    return float(least_distance(arm, q, scene).min())


def line(rng: np.random.Generator) -> tuple[aa.Line, np.ndarray]:
    """A line of 0.25 m from random joints, and these joints."""
    q = rng.uniform(BARE.lower, BARE.upper) * 0.7
    begin = BARE.forward(q)[0]
    end, way = begin.copy(), rng.normal(size=3)
    end[:3, 3] += 0.25 * way / np.linalg.norm(way)
    return aa.Line(begin, end), q


def clutter(rng: np.random.Generator, n: int) -> list[Any]:
    """n shapes of all kinds around the arm, none near its shoulder."""
    shapes: list[Any] = []
    while len(shapes) < n:
        centre = np.array([0, 0, 0.34]) + rng.normal(size=3) * 0.35
        if np.linalg.norm(centre - [0, 0, 0.34]) < 0.2:
            continue
        shapes.append([
            aa.Ball(centre, rng.uniform(0.001, 0.06)),
            aa.Capsule(centre, centre + rng.normal(size=3) * 0.15, rng.uniform(0.001, 0.03)),
            aa.Box(aa.pose(centre, rpy=rng.uniform(-3, 3, 3)), rng.uniform(0.0, 0.15, 3), 0.002),
        ][rng.integers(3)])  # fmt: skip
    return shapes


@pytest.mark.parametrize("asked", [{}, {"start": Q}, {"gc": int(GC)}], ids=["free", "start", "gc"])
def test_a_plan_goes_round_what_the_plan_without_a_scene_touches(asked: dict[str, Any]) -> None:
    """A plan in a scene is certified and clear where one without collides."""
    without, path = aa.plan(ARM, LINE, **asked), aa.plan(ARM.with_(scene=LAMP), LINE, **asked)
    assert without.certified and least(ARM, without.at(DENSE).q, LAMP) < 0.0
    assert path.certified and least(ARM, path.at(DENSE).q, LAMP) >= 0.01
    assert path.diagnosis is not None and path.diagnosis.branches[0].stationarity < 1e-8
    held = ARM.inverse(LINE, PSI, GC, limits=False)  # the naive way
    assert least(ARM, held, LAMP) < 0.0


def test_a_certified_plan_never_touches_and_is_there_wherever_holding_psi_is() -> None:
    """Plans in a scene keep clear by plain distances, and fail only where no constant psi leads."""
    rng = generator(11)
    for k in range(count(5)):
        path, q = line(rng)
        scene = aa.Scene(clutter(rng, 6), clearance=0.002)
        if not aa.plan(ARM, path).ok:
            continue
        found = aa.plan(ARM.with_(scene=scene), path)
        if found.ok:
            assert found.certified and least(ARM, found.at(DENSE).q, scene) >= 0.002, k
            assert (ARM.clearance(found.q, scene).distance >= 0.002).all()
            continue
        poses = path.pose(DENSE[::20])
        for gc in range(8):
            for psi in np.linspace(-np.pi, np.pi, 18, endpoint=False):
                held = ARM.inverse(poses, psi, gc, seed=q, limits=False)
                smooth = np.abs(np.diff(held, axis=0)).max() < 0.3
                kept = ARM.within_limits(held).all() and smooth
                assert not (kept and least(ARM, held, scene) > 0.003), (k, gc, psi)


def on_the_elbow(path: aa.JointPath, s: float, off: float) -> np.ndarray:
    """A point `off` (m) from a point of the upper arm's axis at s, across its motion."""
    frames = ARM.frames(path.at(s).q)
    shoulder, elbow = frames[1, :3, 3], frames[3, :3, 3]
    along = elbow - shoulder
    ahead = ARM.frames(path.at(s + 1e-5).q)[3, :3, 3] - elbow
    across = np.cross(along, ahead)
    return elbow - 0.3 * along + off * across / np.linalg.norm(across)


@pytest.mark.parametrize("kind", ["ball", "capsule", "box"])
def test_a_needle_between_rows_is_seen_and_a_near_miss_is_certified(kind: str) -> None:
    """The certificate sees an obstacle of 1 mm between rows, and holds for one that is 2 µm clear."""
    path = aa.plan(THIN, LINE, start=Q)
    curve: Any = path.curve
    arrays = curve.segments, curve.stretches, curve.plane, curve.gc, 0.0
    rows = np.linspace(0.0, 1.0, 12)
    for s in np.linspace(0.04, 0.96, count(6)):
        for off, holds in ((0.0004, False), (0.0012 + 50e-6, True), (0.0012 + 2e-6, True)):
            at = on_the_elbow(path, s, off)
            far = at + 100 * (at - on_the_elbow(path, s, 0.0)) * (off > 0)
            shape = {
                "ball": aa.Ball(at, 0.001),
                "capsule": aa.Capsule(at, far, 0.001),
                "box": aa.Box(aa.pose(at), [0.0, 0.0, 0.0], 0.001),
            }[kind]
            scene = aa.Scene([shape])
            dense = least(THIN, path.at(np.clip(s + np.linspace(-0.02, 0.02, 801), 0, 1)).q, scene)
            assert (dense >= 0) == holds
            assert holds or least(THIN, path.at(rows).q, scene) > 0  # no row sees it
            open_, touched = THIN._handle.certify_curve(*arrays, THIN._needed(scene).handle)
            assert (len(open_) == 0) == holds
            assert len(touched) == 0 if holds else abs(touched[0, 0] - s) < 0.05


def test_what_blocks_every_psi_for_a_thousandth_of_the_way_is_found() -> None:
    """A plan fails at a needle in the wrist's way, and names s, pair and branch."""
    wrist, across = POSE[:3, 3] - POSE[:3, 2] * BARE.geometry.d_wf, np.array([0.0, 0.1, 0.0])
    for s in (0.1234, 0.5004, 0.876):
        scene = aa.Scene([aa.Ball(wrist + s * across, 0.0001, name="needle")])
        found = aa.plan(THIN.with_(scene=scene), aa.Line(LINE[0], LINE[-1]))
        assert not found.ok and found.diagnosis is not None
        for branch in found.diagnosis.branches:
            assert branch.verdict == aa.types.Verdict.IMPOSSIBLE and branch.touching == ("needle", "forearm")
            assert abs(branch.s_from - s) < 0.01 and branch.reached < s
        assert "too near to needle from s = " in found.diagnosis.explain()


def test_a_scene_that_blocks_the_start_says_so() -> None:
    """`explain` of a plan whose start or goal collides names pair and distance."""
    scene = aa.Scene([aa.Ball(ARM.elbow(Q), 0.05, name="post")])
    found = aa.plan(ARM.with_(scene=scene), LINE, start=Q)
    assert not found.ok and np.isnan(found.q).all() and found.diagnosis is not None
    branch = found.diagnosis[int(GC)]
    assert branch.verdict == aa.types.Verdict.START and branch.status == aa.Status.CLEARANCE
    assert branch.touching == ("post", "upper_arm") and branch.short == pytest.approx(0.11)
    said = f"GC {int(GC)}: the start is blocked: upper_arm is 110 mm too near to post."
    assert found.explain().splitlines()[0] == said and found.status[0] == aa.Status.CLEARANCE
    goal = aa.plan(ARM.with_(scene=scene), LINE[::-1], goal=Q)
    assert not goal.ok and goal.explain().startswith(f"GC {int(GC)}: the goal is blocked: upper_arm")


@pytest.mark.parametrize("which", ["start", "goal"])
def test_an_end_that_touches_is_the_first_reason_whatever_else_there_is(which: str) -> None:
    """`explain` begins with a start or goal that collides, even if the path also leaves the reach."""
    wrist = POSE[:3, 3] - POSE[:3, 2] * BARE.geometry.d_wf
    far = np.tile(POSE, (50, 1, 1))
    far[:, 0, 3] += np.linspace(0.0, 1.5, 50)
    for path in (LINE, far):
        asked: Any = {which: Q}
        for shape in (
            aa.Ball(wrist + np.array([0.0, 0.03, 0.0]), 0.03, name="post"),
            aa.Ball(ARM.elbow(Q), 0.05),
        ):
            scene = aa.Scene([shape], clearance=0.01)
            found = aa.plan(ARM.with_(scene=scene), path if which == "start" else path[::-1], **asked)
            near = ARM.clearance(ARM.inverse(POSE, PSI, GC, limits=False), scene)
            short = 1e3 * (0.01 - float(near.distance))
            said = f"the {which} is blocked: {near.link} is {short:.3g} mm too near to {near.obstacle}."
            assert found.explain().splitlines()[0] == f"GC {int(GC)}: {said}"
            assert found.diagnosis is not None and len(found.explain().splitlines()) <= 3


def test_the_reason_for_a_range_says_by_how_much_it_is_shut_at_its_worst() -> None:
    """The diagnosis of a blocked range gives the largest distance missing over the range."""
    rng, seen = generator(17), 0
    for _ in range(count(5)):
        path, _ = line(rng)
        at = path.pose(rng.uniform(0.1, 0.9))
        wrist = at[:3, 3] - at[:3, 2] * BARE.geometry.d_wf
        off = rng.normal(size=3)
        radius = rng.uniform(0.02, 0.1)
        scene = aa.Scene([aa.Ball(wrist + off / np.linalg.norm(off) * 0.08, radius)], clearance=0.01)
        found = aa.plan(ARM.with_(scene=scene), path)
        assert found.diagnosis is not None
        for branch in found.diagnosis.branches:
            if branch.verdict != aa.types.Verdict.IMPOSSIBLE or branch.status != aa.Status.CLEARANCE:
                continue
            poses = path.pose(np.linspace(branch.s_from, branch.s_to, 41))
            short = 0.0
            for pose in poses:
                arcs = BARE.feasible(pose, branch.gc)
                psi = np.linspace(-np.pi, np.pi, 181)
                psi = psi[[p in arcs for p in psi]]
                if len(psi):
                    room = ARM.clearance(
                        ARM.inverse(pose, psi, branch.gc, limits=False), scene
                    ).distance.max()
                    short = max(short, 0.01 - float(room))
            seen += 1
            assert branch.short == pytest.approx(short, abs=2e-3)
            assert f"up to {1e3 * branch.short:.3g} mm too near" in branch.explain()
    assert seen


@pytest.mark.parametrize("end", ["start", "goal"])
def test_a_solution_that_ends_at_an_obstacle_is_planned_from_with_proof(end: str) -> None:
    """A plan starts or ends at joints exactly at the clearance, and keeps it but for 2e-9 m."""
    rng, met = generator(37), 0
    while met < count(10):
        pose = BARE.forward(Q + rng.uniform(-0.6, 0.6, 7))[0]
        near = Q + rng.uniform(-0.6, 0.6, 7)
        free = ARM.solve(pose, seed=near)
        if free.status != aa.Status.OK:
            continue
        post = aa.Ball(ARM.elbow(free.q) + 0.06 * rng.normal(size=3), 0.04, name="post")
        scene = aa.Scene([post], clearance=0.01)
        found = ARM.with_(scene=scene).solve(pose, seed=near)
        if found.status != aa.Status.OK or abs(least(ARM, found.q[None], scene) - 0.01) > 1e-9:
            continue
        met += 1
        away, way = pose.copy(), rng.normal(size=3)
        away[:3, 3] += 0.05 * way / np.linalg.norm(way)
        path = aa.Line(pose, away) if end == "start" else aa.Line(away, pose)
        plan = aa.plan(ARM.with_(scene=scene), path, **{end: found.q})
        assert plan.ok == plan.certified, plan.explain()
        assert not plan.ok or least(ARM, plan.at(DENSE).q, scene) >= 0.01 - 2e-9
        assert plan.ok or "blocked" not in plan.explain()


def test_the_hand_is_kept_clear_too() -> None:
    """A plan fails if its gripper meets a needle, and is certified if it misses it by 0.2 mm."""
    holding = ARM.with_(hand=[aa.Capsule([0, 0, 0], [0, 0, 0.1], 0.02, name="drill")])
    needle = aa.Scene([aa.Ball(POSE[:3, 3] + [0, 0.05, 0], 0.001, name="needle")])
    found = aa.plan(holding.with_(scene=needle), LINE)
    assert not found.ok and "drill collides with needle from s = " in str(found.diagnosis)
    away = aa.Scene([aa.Ball(POSE[:3, 3] + [0, 0.05, 0.0212], 0.001)])
    assert aa.plan(holding.with_(scene=away), LINE).certified


def test_arcs_of_the_users_own_are_kept_everywhere() -> None:
    """A plan keeps `allowed`, arcs or a function, and names it as the reason if it leaves nothing."""
    allowed = aa.ArcSet(np.radians([[20, 40]]))
    path = aa.plan(ARM, LINE, allowed=allowed, gc=int(GC))
    assert path.certified and allowed.contains(path.at(DENSE).psi).all()
    asked = aa.plan(ARM, LINE, allowed=lambda pose: allowed, gc=int(GC))
    assert asked.ok and np.array_equal(asked.q, path.q)
    free = aa.plan(ARM, LINE, gc=int(GC))
    assert not allowed.contains(free.psi).all()
    nowhere = aa.plan(ARM, LINE, allowed=aa.ArcSet(np.empty((0, 2))))
    assert not nowhere.ok and "no arm angle within allowed=" in str(nowhere.diagnosis)
    start = aa.plan(ARM, LINE, allowed=aa.ArcSet([[PSI + 0.3, PSI + 0.6]]), start=Q)
    assert not start.ok and "the start lies outside allowed=" in str(start.diagnosis)


def test_a_plan_keeps_allowed_and_a_scene() -> None:
    allowed = aa.ArcSet(np.radians([[-170, 170]]))
    path = aa.plan(ARM.with_(scene=LAMP), LINE, allowed=allowed)
    rows = path.at(DENSE)
    assert path.certified and allowed.contains(rows.psi).all() and least(ARM, rows.q, LAMP) >= 0.01


def test_what_a_function_raises_is_raised() -> None:
    """`plan` passes on what `allowed` raises, and refuses wrong types of `allowed`, scene and model."""

    def broken(pose: np.ndarray) -> aa.ArcSet:
        """Raise an error that names the pose."""
        raise ZeroDivisionError(f"at {pose[1, 3]:.2f}")

    with pytest.raises(ZeroDivisionError, match=r"at 0\."):
        aa.plan(ARM, LINE, allowed=broken)
    with pytest.raises(aa.InputError, match="allowed gives 3, wanted an ArcSet"):
        aa.plan(ARM, LINE, allowed=lambda pose: 3)
    with pytest.raises(aa.InputError, match="allowed is 3, wanted an ArcSet or a function"):
        aa.plan(ARM, LINE, allowed=3)
    with pytest.raises(aa.SceneError, match="body is None, wanted a body"):
        aa.plan(BARE.with_(scene=LAMP), LINE)
    with pytest.raises(aa.SceneError, match="scene is 3, wanted an armangle"):
        aa.plan(ARM.with_(scene=3), LINE)


def test_a_plan_leads_around_a_dead_end_of_obstacles() -> None:
    """`plan` is certified and clear where obstacles make a dead end."""
    slide = np.tile(POSE, (60, 1, 1))
    slide[:, 1, 3] += np.linspace(0.0, 0.3, 60)
    places = [[0.2763, 0.1045, 0.4830], [0.2085, 0.2854, 0.4624], [0.3333, 0.2607, 0.4953]]
    pocket = aa.Scene([aa.Ball(p, r) for p, r in zip(places, (0.0172, 0.0497, 0.0158), strict=True)])
    round_it = aa.plan(
        ARM.with_(scene=pocket), slide, start=Q
    )  # where a local rule is caught: test_motion.py
    assert round_it.certified and least(ARM, round_it.at(DENSE).q, pocket) > 0
