"""Plans of arms with an offset, own chains too: where a dense search finds a way, and proven."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from support import draw
from support.calibrated import calibrated, off, own_links
from support.gradients import named
from support.offset_search import can_follow, straight_lines
from support.touching import distances

import armangle as aa

ARMS = ["franka_fr3", "ufactory_xarm7", "willow_garage_pr2_left", "fetch"]
EVERY = [*ARMS, "calibrated franka_fr3", "calibrated fetch"]
PLACES = np.linspace(0.0, 1.0, 20_001)
EVEN = np.linspace(0.0, 1.0, 41)
ARM = aa.Arm.from_catalogue("franka_fr3")
READY = [0.1, -0.6, 0.2, -2.2, 0.1, 1.9, 0.7]


@cache
def planned(name: str) -> list[aa.JointPath]:
    """Return plans of lines of 0.4 m that a dense search can follow."""
    arm = named(name)  # the dense search of an own chain takes 20 times as long
    count, places = (16, 121) if name in ARMS else (8, 121) if draw.COUNT else (3, 31)
    lines = [line for _, line in straight_lines(arm, count, 0.4, seed=2)]
    lines = [line for line in lines if can_follow(arm, line.pose(EVEN), places)]
    return [aa.plan(arm, line) for line in lines]


@cache
def turned() -> aa.JointPath:
    """Return a plan of an FR3 from READY, along 30 poses that shift and turn."""
    s = np.linspace(0.0, 1.0, 30)[:, None]
    first = ARM.forward(READY)[0]
    return aa.plan(ARM, first @ aa.pose(s * [0.1, 0.15, -0.1], rotvec=s * [0.2, 0.1, -0.15]), start=READY)


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", EVERY)
def test_what_a_dense_search_can_follow_is_planned_and_proven(name: str) -> None:
    """`plan` certifies all paths of an offset arm that a dense search can follow."""
    paths = planned(name)
    assert len(paths) >= (5 if name in ARMS else 3)
    assert all(path.ok and path.certified and not len(path.uncertified) for path in paths)


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", EVERY)
def test_what_is_certified_holds_between_the_rows(name: str) -> None:
    """Between the rows, a certified plan has pose, limits, gc and psi."""
    for path in planned(name)[:4]:
        between = path.at(PLACES)
        pose, _, gc = path.arm.forward(between.q)
        assert path.path is not None
        np.testing.assert_allclose(pose, path.path.pose(PLACES), rtol=0, atol=1e-9)
        assert path.arm.limit_margin(between.q).min() >= 0
        assert (gc == path.gc[0]).all() and (between.gc == path.gc[0]).all()
        assert np.abs(np.diff(between.q, axis=0)).max() < 0.01
        free = between.q[:, int(path.arm.redundancy[-1]) - 1]
        np.testing.assert_allclose(np.cos(free - between.psi), 1.0, rtol=0, atol=1e-12)
        np.testing.assert_allclose(path.at(path.s).q, path.q, rtol=0, atol=1e-12)


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ARMS)
def test_only_allowed_values_of_the_free_joint_are_used(name: str) -> None:
    """Plans use only `allowed` values of the free joint (if it is a function, at their rows), or say that the
    start or all values lie outside.
    """
    asked, narrower = [], 0
    for path in planned(name)[:4]:
        gc, psi = int(path.gc[0]), path.at(PLACES).psi
        middle = 0.5 * (psi.min() + psi.max())
        half = 0.4 * (psi.max() - psi.min()) + 0.05  # of a small range more than it uses, of a large one less
        allowed = aa.ArcSet([[middle - half, middle + half]])
        narrower += not allowed.contains(psi).all()
        for of_user in (allowed, lambda pose, allowed=allowed: asked.append(pose) or allowed):
            found = aa.plan(path.arm, path.path, gc=gc, allowed=of_user)
            if found.ok:
                assert found.certified and allowed.contains(found.at(found.s).psi).all()
                assert callable(of_user) or allowed.contains(found.at(PLACES).psi).all()
            else:
                assert not np.isin(0, found.diagnosis[gc].blocking)
        nowhere = aa.plan(path.arm, path.path, allowed=aa.ArcSet(np.empty((0, 2))))
        assert not nowhere.ok and "within allowed=" in nowhere.explain()
        elsewhere = aa.ArcSet([[psi[0] + 0.3, psi[0] + 0.6]])
        start = aa.plan(path.arm, path.path, start=path.q[0], allowed=elsewhere)
        assert not start.ok and "the start lies outside allowed=" in start.explain()
    assert asked and narrower


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", ARMS)
def test_a_plan_whose_duration_weighs_is_never_slower(name: str) -> None:
    """Plans with Objective(duration) take no longer after `retime` than without, and some less."""
    gained = []
    for path in planned(name)[:3]:
        arm = path.arm.with_(velocity=2.0, acceleration=8.0)
        times = []
        for weight in (0.0, 1.0, 100.0):
            found = aa.plan(arm, path.path, gc=int(path.gc[0]), objective=aa.Objective(duration=weight))
            assert found.certified
            times.append(aa.retime(found).duration)
        assert max(times[1:]) <= times[0] * (1 + 2e-3)
        gained.append(times[2] / times[0])
    assert min(gained) < 0.99


def test_joints_travel_less_than_where_the_free_joint_is_held() -> None:
    """`plan` for travel alone moves joints less than `follow` with the free joint held."""
    poses = turned().poses
    held = aa.follow(ARM, poses, start=READY)
    travel = aa.plan(ARM, poses, start=READY, objective=aa.Objective(limits=0.0, singularities=0.0))
    assert held.ok and travel.certified

    def way(path: aa.JointPath) -> float:
        """The sum of squared joint steps of a path."""
        return float((np.diff(path.at(EVEN).q, axis=0) ** 2).sum())

    assert way(travel) < 0.99 * way(held)


def test_where_there_is_no_way_it_says_which_limit_would_have_to_move() -> None:
    """The diagnosis names joint 4 as blocking, and by how much its limit must be wider."""
    poses = turned().poses
    lower, upper = np.array(ARM.lower), np.array(ARM.upper)
    upper[3] = turned().q[:, 3].min() - 0.1
    path = aa.plan(ARM.with_(upper=upper), poses, gc=7)
    assert not path.ok and not path.certified and path.diagnosis is not None
    branch = path.diagnosis[7]
    assert branch.verdict.name == "IMPOSSIBLE" and branch.blocking == (4,)
    assert "no value of joint 7 keeps all limits" in path.explain()
    opening = next(each for each in branch.openings if (each.joint, each.side) == (4, "upper"))
    for more, holds in ((opening.extra, True), (0.95 * opening.extra, False)):
        wider = upper.copy()
        wider[3] += more
        arm = ARM.with_(lower=lower, upper=wider)
        s = np.linspace(branch.s_from, branch.s_to, 9)
        held = [int(arm.feasible(pose, 7).count) > 0 for pose in aa.Waypoints(poses).pose(s)]
        assert all(held) == holds


def test_out_of_reach_it_says_how_far() -> None:
    """The diagnosis of a plan that leaves the reach gives the excess (m); rows before it are solved."""
    poses = turned().poses.copy()
    poses[:, 0, 3] += np.linspace(0.0, 1.5, 30)
    path = aa.plan(ARM, poses, start=READY)
    assert path.diagnosis is not None
    branch = path.diagnosis[7]
    assert not path.ok and branch.verdict.name == "UNREACHABLE" and branch.excess > 0.5
    assert 0 < branch.reached < branch.s_from < 1
    solved = path.status == aa.Status.OK
    assert 0 < solved.sum() < 30 and ARM.within_limits(path.q[solved]).all()


BONES = aa.Body.bones(0.05, 0.05)
NEAR = 0.01
"""Clearance of the scenes, m."""


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", EVERY)
def test_a_plan_about_obstacles_is_clear_between_the_rows(name: str) -> None:
    """A plan in a scene that succeeds keeps its clearance, by plain distances, also where the one without
    obstacles does not.
    """
    rng, detours = np.random.default_rng(8), 0
    bare = named(name).with_(body=BONES)
    for without in planned(name)[:4]:
        rows = without.at(EVEN)
        elbow = bare.frames(rows.q)[20, 3, :3, 3]
        aside = rng.normal(size=3)
        aside *= 0.09 / np.linalg.norm(aside)
        scene = aa.Scene([aa.Ball(elbow + aside, 0.03, name="lamp")], clearance=NEAR)
        path = aa.plan(bare.with_(scene=scene), without.path)
        if not path.ok:
            assert path.diagnosis is not None
            assert not any(branch.ok for branch in path.diagnosis.branches)
            continue
        between = path.at(PLACES)
        assert path.certified and distances(bare, between.q, scene, NEAR)[0].min() >= NEAR
        assert path.arm.limit_margin(between.q).min() >= 0
        detours += distances(bare, rows.q, scene, NEAR)[0].min() < NEAR
    assert detours >= 2  # the plan without obstacles touches them


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", EVERY)
def test_a_plan_among_what_moves_is_clear_at_every_moment(name: str) -> None:
    """A plan with `scene` a function of s, if it succeeds, keeps its clearance from the scene of each s."""
    rng, detours, bare = np.random.default_rng(9), 0, named(name).with_(body=BONES)
    for without in planned(name)[:3]:
        elbow = bare.frames(without.at([0.5]).q)[0, 3, :3, 3]
        way = rng.normal(size=3)
        way *= 0.4 / np.linalg.norm(way)

        def passing(s: float, elbow: np.ndarray = elbow, way: np.ndarray = way) -> aa.Scene:
            """The scene at s: a ball that passes the elbow."""
            at = elbow + (s - 0.35) * way
            return aa.Scene([aa.Ball(at, 0.03, name="lamp")], clearance=NEAR)

        path = aa.plan(bare, without.path, scene=passing, obstacle_speed=0.4)
        places = np.linspace(0.0, 1.0, 401 if draw.COUNT else 101)
        gone = places[:, None] * way
        near = [
            distances(bare, each.at(places).q, passing(0.0), NEAR, gone)[0].min()
            for each in ((without, path) if path.ok else (without,))
        ]
        detours += path.ok and near[0] < NEAR
        if path.ok:
            assert path.certified and near[1] >= NEAR
        else:
            assert path.diagnosis is not None
            assert not any(branch.ok for branch in path.diagnosis.branches)
    assert detours
    still = passing(0.3)
    one = aa.plan(bare.with_(scene=still), without.path)
    same = aa.plan(bare, without.path, scene=lambda s: still, obstacle_speed=0.0)
    np.testing.assert_array_equal(one.q, same.q)


def test_obstacles_that_leave_no_way_are_named() -> None:
    """`explain` of a plan that obstacles block names the obstacle."""
    path = turned()
    middle = path.at([0.5]).pose[0, :3, 3]
    held = ARM.with_(body=BONES, hand=[aa.Ball([0, 0, 0.0], 0.05, name="gripper")])
    shut = aa.plan(held.with_(scene=aa.Scene([aa.Ball(middle, 0.02, name="lamp")])), turned().poses)
    assert not shut.ok and "lamp" in shut.explain()
    elbow = ARM.frames(READY)[3, :3, 3]
    begun = aa.plan(
        ARM.with_(body=BONES, scene=aa.Scene([aa.Ball(elbow, 0.05, name="lamp")])),
        turned().poses,
        start=READY,
    )
    assert not begun.ok and "lamp" in begun.explain()


@pytest.mark.parametrize("name", ["franka_fr3", "willow_garage_pr2_left"])
def test_where_one_solution_only_just_keeps_the_clearance_a_plan_is_undecided(name: str) -> None:
    """Where one solution keeps exactly the clearance, and no other does, `plan` is undecided."""
    start = {"franka_fr3": READY}.get(name, [0.4, 0.5, 0.6, -1.3, 0.4, -0.8, 0.3])
    arm = named(name).with_(body=aa.Body.bones(upper_arm=0.05, forearm=0.04))
    (pose, _, gc), lamp = arm.forward(start), aa.Ball(np.add(arm.elbow(start), [0.0, -0.15, 0.05]), 0.03)
    lit = arm.with_(scene=aa.Scene([lamp]))
    kept = float(lit.clearance(lit.solve(pose, gc=int(gc), prefer="clearance").q).distance)
    path = aa.plan(arm.with_(scene=aa.Scene([lamp], clearance=kept)), [pose, pose], gc=int(gc))
    assert not path.ok and path.diagnosis is not None
    assert path.diagnosis.branches[0].verdict.name == "UNRESOLVED" and path.diagnosis.branches[0].given_up


def test_an_interrupt_ends_it() -> None:
    """What `progress` raises ends `plan`."""

    def stop(done: int, total: int) -> None:
        """Raise KeyboardInterrupt."""
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        aa.plan(ARM, turned().poses, progress=stop)


@pytest.mark.parametrize("name", ["franka_fr3", "fetch"])
def test_a_plan_begins_at_its_start_where_a_branch_has_several_solutions(name: str) -> None:
    """A plan from joints that solve the first pose begins there, though `inverse` without them finds others
    with the same value of the free joint.
    """
    arm, begun = calibrated(name, 20.0, 10.0), 0
    q = np.random.default_rng(2).uniform(np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0), (1000, 7))
    pose, psi, gc = arm.forward(q)
    other = np.abs(arm.inverse(pose, psi, gc, limits=False, on_error="nan") - q).max(axis=1) > 1e-3
    assert other.sum() > 8
    for start, first in zip(q[other][:3], pose[other], strict=False):
        last = first.copy()
        last[:3, 3] += 1e-3
        path = aa.plan(arm, aa.Line(first, last), start=start)
        assert path.diagnosis is not None and path.diagnosis.branches[0].verdict.name != "START"
        begun += path.ok
        if path.ok:
            np.testing.assert_allclose(path.at([0.0]).q[0], start, rtol=0, atol=1e-9)
    assert begun >= 1


def test_a_path_may_end_on_a_limit_and_a_start_beyond_it_is_refused() -> None:
    """A line to a pose that is reached with joint 4 on its limit alone is planned; a start with a joint one
    turn beyond its limits is refused.
    """
    first = [2.2853981634, 1.1767581521515926, 1.827341087903327, -1.8158852274491875, -1.4974519945673646]
    last = [2.2853981634, 1.0325245311176057, 2.375973606346308, -2.3213, -1.2829788723099191]
    for arm in (named("willow_garage_pr2_left"), named("calibrated willow_garage_pr2_left")):
        ends = arm.forward([[*first, -1.1156, 1.968], [*last, -1.5596197682229274, 1.7245845335353904]])[0]
        assert aa.plan(arm, ends).certified
    for arm in (ARM, named("calibrated franka_fr3")):
        poses = arm.forward(np.add(READY, [[0.0], [0.05]]))[0]
        beyond = aa.plan(arm, poses, start=np.add(READY, [2 * np.pi, 0, 0, 0, 0, 0, 0]))
        assert not beyond.ok and "beyond the upper one of joint 1" in beyond.explain()


PINCHED = (  # joints and ways (m) of an xArm 7 on which an interval of the start's branch shrinks to a point
    ([0.217, -1.446, -0.203, 2.776, -0.716, -0.131, 0.206], [0.039, 0.112, -0.348]),
    ([-2.753, 1.19, -0.841, 2.817, 0.954, 2.255, 1.875], [0.177, -0.001, 0.173]),
)


@pytest.mark.parametrize(("start", "way"), PINCHED)
def test_a_curve_without_a_solution_between_the_samples_is_no_plan(start: Any, way: Any) -> None:
    """`plan` fails with UNRESOLVED and NO_POSTURE if the only interval shrinks to a point between samples."""

    arm = aa.Arm.from_catalogue("ufactory_xarm7")
    ends = np.stack([arm.forward(start)[0]] * 2)
    ends[1, :3, 3] += way
    path = aa.plan(arm, ends, start=start)
    assert not path.ok and path.diagnosis is not None
    branch = path.diagnosis[int(arm.forward(start)[2])]
    assert branch.verdict.name == "UNRESOLVED" and branch.status is aa.Status.NO_POSTURE
    assert "leads through a fold" in path.explain()
    near = branch.s_from + np.linspace(-1e-2, 1e-2, 2001)
    arcs = arm.feasible(aa.Waypoints(ends).pose(near), branch.gc)
    widths = np.diff(arcs.intervals, axis=-1)[..., 0]
    widths[np.arange(widths.shape[1]) >= np.asarray(arcs.count)[:, None]] = np.inf
    assert widths.min() < 1e-4


def test_a_plan_beside_a_fold_does_not_end_at_another_solution_of_its_goal() -> None:
    """On an own chain one value of the free joint has two solutions beside a fold: a plan ends at the given
    one, or is not ok.
    """
    arm = aa.Arm.from_catalogue("fetch")
    arm = arm.with_(chain=off(own_links(arm), 1.0, 1.0, np.random.default_rng(17)))
    start = [-0.819325758721958, -0.16197959373824566, -4.49525372066633, 0.060315198154306165]
    start += [2.5040509046030133, 0.2273484619161595, -2.1833868558741054]
    goal = [-1.079805608918027, -0.3495613692506395, -4.71238898038469, 0.11267115736311631]
    goal += [1.3693780948707692, 0.3412298817948881, 0.09976422875263768]
    path = aa.plan(arm, aa.Line(*arm.forward([start, goal])[0]), start=start, goal=goal)
    assert not path.ok or np.abs(path.q[[0, -1]] - [start, goal]).max() <= 1e-7
