"""Redundancy resolution, step and follow: equation (36), continuity, windings, allowed arcs."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from reference import mended_arcs
from support import draw
from support.brute_force import planar_motion
from support.laws import circle_gap, gap
from support.moves import along, in_a_loop, limited, moved, refused
from support.strategies import TURN, Array, arms, bends, joint_values, postures, unlimited

import armangle as aa
from armangle import Status

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
START = np.array([0.3, 0.6, -0.2, 1.3, 0.4, 0.9, 0.1])
SHIFT = [0.03, -0.15, 0.05]
POLICIES = [
    aa.Repulsion(), aa.Repulsion(K=1.0, alpha=5), aa.Repulsion(K=0.02, alpha=100), aa.Hold(),
    aa.Centre(K=0.3), aa.Centre(K=1.0), aa.Towards(psi=2.0, K=0.3), aa.Towards(point=[0.3, 0.8, 0.4], K=1.0),
    aa.Towards(direction="up"),
]  # fmt: skip
any_policy = pytest.mark.parametrize("policy", POLICIES, ids=repr)


def line(arm: aa.Arm, q: Array, shift: Any, count: int) -> Array:
    """Poses from that of q on, moved by `shift` (m) in all, without turning, (count, 4, 4)."""
    return along(arm.forward(q)[0], shift, count)


@pytest.mark.parametrize("on_fail", ["stop", "hold", "skip"])
@pytest.mark.parametrize("carry", ["psi", "elbow"])
@any_policy
def test_follow_is_step_in_a_loop_bit_for_bit(policy: aa.Repulsion, carry: str, on_fail: str) -> None:
    """`follow` has the joints, gc, margins and statuses of `step` in a loop, also out of reach."""
    poses = line(IIWA, START, SHIFT, 40)
    poses[20:23, 0, 3] += 3.0  # out of reach
    path = in_a_loop(IIWA, poses, START, on_fail, policy=policy, carry=carry, max_joint_step=3.0)
    assert not path.ok and path.first_failure == 20 and path.status[20] == Status.UNREACHABLE


def test_a_step_is_a_named_tuple_like_any_other() -> None:
    """A Step can be pickled and replaced, and has no hash."""
    now = aa.step(IIWA, START, IIWA.forward(START)[0])
    again = pickle.loads(pickle.dumps(now))
    assert type(again) is aa.types.Step and again[1:5] == now[1:5] and (again.q == now.q).all()
    assert now._fields == ("q", "psi", "gc", "status", "margin", "velocity", "why")
    assert now._replace(gc=7).gc == 7
    refused(TypeError, "unhashable", lambda: hash(now))


@any_policy
def test_a_path_reaches_its_poses_within_limits_and_without_jumps(policy: aa.Repulsion) -> None:
    """`follow` holds poses and limits without jumps, and states residual and margin rightly."""
    path = aa.follow(IIWA, line(IIWA, START, SHIFT, 60), start=START, policy=policy, max_joint_step=3.0)
    assert path.ok
    path.raise_for_status()
    assert path.residual.max() <= 1e-12
    assert gap(IIWA.forward(path.q)[0], path.poses) <= 1e-12
    assert IIWA.within_limits(path.q, tol=1e-9).all()
    assert np.array_equal(path.margin, IIWA.limit_margin(path.q))
    assert np.abs(np.diff(path.q, axis=0)).max() <= 3.0
    assert np.abs(np.diff(path.psi)).max() < np.pi
    assert path.s[[0, -1]].tolist() == [0.0, 1.0]
    assert not path.certified


def feasible_samples() -> list[tuple[aa.Arm, Array, Array, Array]]:
    """16 arms, each with the (poses, psi, gc) of random joints within its limits."""
    return [(arm, *arm.forward(postures(arm, "uniform", 40, 1))) for arm in arms()[:16]]


@any_policy
def test_resolution_never_leaves_its_arc(policy: aa.Repulsion) -> None:
    """`resolve` returns a psi on the arc that the given psi is on, and OK if there is an arc."""
    rng = np.random.default_rng(2)
    for arm, pose, own, gc in feasible_samples():
        arcs = arm.feasible(pose, gc)
        for psi in (own, rng.uniform(-9, 9, own.shape)):
            now = aa.resolve(arm, pose, psi, gc, policy=policy)
            good = now.status == Status.OK
            assert np.array_equal(good, ~arcs.is_empty)
            assert arcs.contains(now.psi)[good].all()
            inside = arcs.contains(psi) & good
            for p in np.flatnonzero(inside):
                mine = [a for a in arcs[p] if (psi[p] - a[0] + 1e-9) % TURN <= a[1] - a[0] + 2e-9]
                assert any((now.psi[p] - low + 1e-9) % TURN <= high - low + 2e-9 for low, high in mine)


@pytest.mark.parametrize("K", [0.0, 0.02, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("alpha", [5.0, 20.0, 100.0])
@pytest.mark.parametrize("outside", ["nearest", "stop"])
def test_resolution_is_equation_36(K: float, alpha: float, outside: str) -> None:
    """`resolve` with Repulsion gives the psi of the second implementation of Eq. (36)."""
    rng = np.random.default_rng(3)
    for arm, pose, own, gc in feasible_samples()[::4]:
        arcs = arm.feasible(pose, gc)
        for psi in (own, rng.uniform(-9, 9, own.shape)):
            policy = aa.Repulsion(K=K, alpha=alpha, outside=outside)
            now = aa.resolve(arm, pose, psi, gc, policy=policy)
            for p in range(0, len(pose), 3):
                whole = mended_arcs.FULL if arcs.is_full[p] else list(arcs[p])
                wanted = mended_arcs.resolve(psi[p], whole, K, alpha, outside)
                if wanted is None:
                    assert now.status[p] == (Status.LIMITS if arcs.is_empty[p] else Status.OUTSIDE)
                    assert circle_gap(now.psi[p], psi[p]) <= 1e-14
                else:
                    assert circle_gap(now.psi[p], wanted) <= 1e-12


@pytest.mark.parametrize("rule", [aa.Centre(rate=2.0), aa.Towards(psi=0.3, rate=2.0)])
def test_a_rate_does_not_depend_on_the_step_time(rule: aa.Centre) -> None:
    """`resolve` with rate= leads as far in 10 steps as in 1000, and is K = 1 - exp(-rate dt)."""
    pose, _, gc = IIWA.forward(START)
    low, high = next(iter(IIWA.feasible(pose, gc)))
    ends = []
    for steps in (10, 1000):
        psi = low + 0.9 * (high - low)
        for _ in range(steps):
            psi = aa.resolve(IIWA, pose, psi, gc, policy=rule, dt=1.0 / steps).psi
        ends.append(float(psi))
    assert circle_gap(ends[0], ends[1]) <= 1e-12
    one = aa.resolve(IIWA, pose, low + 0.1, gc, policy=aa.Repulsion(rate=3.0, alpha=20), dt=0.1)
    same = aa.resolve(IIWA, pose, low + 0.1, gc, policy=aa.Repulsion(K=-np.expm1(-0.3), alpha=20))
    assert one.psi == same.psi


def beside_the_axis(offset: float) -> tuple[Array, Array]:
    """A start, and poses that carry the wrist past the base axis at a distance `offset` (m)."""
    q = np.array([0.0, -0.5, 0.0, 1.6, 0.0, 0.6, 0.0])
    pose = IIWA.forward(q)[0].copy()
    wrist = pose[:3, 3] - 0.126 * pose[:3, 2]
    poses = np.repeat(pose[None], 121, axis=0)
    poses[:, 0, 3] += np.linspace(-0.03, 0.03, 121) - wrist[0]
    poses[:, 1, 3] += offset - wrist[1]
    starts = IIWA.inverse(poses[0], np.linspace(-3, 3, 61), 2, limits=False)
    clearest = np.abs(np.sin(bends(IIWA, starts))).min(axis=-1).argmax()
    return starts[clearest], poses


@any_policy
def test_a_policy_that_asks_for_too_much_is_shortened(policy: aa.Repulsion) -> None:
    """`step` to the own pose is OK with every policy, and no joint moves by more than 0.2 rad."""
    rng = np.random.default_rng(11)
    q = rng.uniform(IIWA.lower, IIWA.upper, (500, 7))
    poses, _, _ = IIWA.forward(q)
    for k in range(len(q)):
        now = aa.step(IIWA, q[k], poses[k], policy=policy)
        assert now.status is Status.OK
        assert np.abs(now.q - q[k]).max() <= 0.2
        assert np.abs(IIWA.forward(now.q)[0] - poses[k]).max() <= 1e-12


def test_a_shortened_step_goes_as_far_as_it_may() -> None:
    """A step whose policy asks for more moves a joint by the largest step exactly."""
    pose, _, gc = IIWA.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    near_the_end = IIWA.feasible(pose, gc).intervals[0, 0] + 0.05
    q = IIWA.inverse(pose, near_the_end, gc, limits=False)
    wish = aa.resolve(IIWA, pose, near_the_end, gc).psi
    now = aa.step(IIWA, q, pose)
    assert now.status is Status.OK
    assert near_the_end < now.psi < wish
    assert 0.2 - 1e-9 <= np.abs(now.q - q).max() <= 0.2
    whole = aa.step(IIWA, q, pose, max_joint_step=np.inf)
    assert whole.psi == wish


HOMES = [
    [0, 0, 0, -90, 0, 90, 0], [0, 0, 0, 90, 0, -90, 0], [0, 45, 0, -90, 0, 0, 0], [30, 0, 20, -90, 0, 60, 0],
    [30, 0.001, 20, -90, 0, 60, 0], [30, 40, 20, -90, 10, -0.1, 0], [0, 0, 0, 0, 0, 0, 0],
]  # fmt: skip
DIRECTIONS = np.array([d for d in np.ndindex(3, 3, 3) if d != (1, 1, 1)]) - 1.0


@pytest.mark.parametrize("home", HOMES, ids=str)
@pytest.mark.parametrize("carry", ["psi", "elbow"])
def test_a_posture_on_a_singularity_is_stepped_to_and_from(home: list[float], carry: str) -> None:
    """`step` holds a home posture, and `follow` leaves it in 26 directions."""
    q = np.radians(home)
    own = aa.step(IIWA, q, IIWA.forward(q)[0], policy=aa.Hold(), carry=carry)
    assert own.status is Status.OK
    assert np.abs(own.q - q).max() <= 1e-12
    if home[3] == 0:  # the stretched arm can only draw in
        return
    for direction in DIRECTIONS:
        poses = line(IIWA, q, 0.1 * direction / np.linalg.norm(direction), 200)
        path = aa.follow(IIWA, poses, start=q, carry=carry)
        assert path.ok
        assert np.abs(np.diff(np.vstack([q, path.q]), axis=0)).max() <= 0.2
        assert path.residual.max() <= 1e-12


@pytest.mark.turns(2)
@pytest.mark.parametrize("hinge", [1, 5])
@pytest.mark.parametrize("off", [0.0, 1e-16, 1e-14, 1e-12, 1e-10, 1e-8])
def test_any_posture_beside_a_singularity_steps_to_its_own_pose(hinge: int, off: float) -> None:
    """`step` to the own pose is OK near theta_2 or theta_6 = 0, in limits of 0.05 rad."""
    rng = np.random.default_rng(6)
    for arm in arms()[::3]:
        for q in postures(arm, "uniform", 6):
            q[hinge] = joint_values(arm, np.full((1, 7), off * rng.choice([-1, 1])))[0, hinge]
            boxed = arm.with_(lower=q - 0.05, upper=q + 0.05)
            now = aa.step(boxed, q, boxed.forward(q)[0], policy=aa.Hold())
            assert now.status is Status.OK
            assert np.abs(now.q - q).max() <= 0.05
            assert gap(boxed.forward(now.q)[0], boxed.forward(q)[0]) <= 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("carry", ["psi", "elbow"])
def test_branches_that_meet_are_passed_through_as_smoothly_as_the_joints_can(carry: str) -> None:
    """`follow` of planar lines gives the planar motion through theta_2 or theta_6 = 0, unless gc is given."""
    rng, crossed = np.random.default_rng(5), 0
    while crossed < 4:
        path, way = planar_motion(IIWA, rng)
        poses = path.pose(np.linspace(0, 1, len(way)))
        crosses = bool((np.sign(way[0, [1, 5]]) != np.sign(way[-1, [1, 5]])).any())
        crossed += crosses
        for policy in (aa.Repulsion(), aa.Hold()):
            found = aa.follow(IIWA, poses, start=way[0], policy=policy, carry=carry)
            assert found.ok and np.abs(found.q - way).max() <= 1e-9
            assert (len(set(found.gc)) > 1) == crosses
        if crosses:  # the branch that is asked for is kept
            held = aa.follow(IIWA, poses, start=way[0], gc=int(IIWA.forward(way[0])[2]), carry=carry)
            assert set(held.gc[held.status == Status.OK]) == {held.gc[0]}


@pytest.mark.parametrize("offset", [1e-3, 3e-4, 0.0])
def test_a_wrist_that_passes_the_base_axis_is_followed_smoothly(offset: float) -> None:
    """`follow` past the base axis is ok with either `carry`, in steps of at most 0.2 rad."""
    start, poses = beside_the_axis(offset)
    arm = unlimited(IIWA)
    held = aa.follow(arm, poses, start=start)
    elbow = aa.follow(arm, poses, start=start, carry="elbow")
    assert held.ok and elbow.ok
    assert np.abs(np.diff(held.q, axis=0)).max() <= 0.2


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "rokae_xmate_er7_pro", "barrett_wam7"])
@pytest.mark.parametrize("away", [0.1, 0.003])
def test_a_step_to_a_near_posture_is_found(name: str, away: float) -> None:
    """`step` is OK if joints within limits and `max_joint_step` hold the pose."""
    arm = aa.Arm.from_catalogue(name)
    rng = np.random.default_rng(4)
    low, high = np.maximum(arm.lower, -TURN), np.minimum(arm.upper, TURN)
    tried = 0
    while tried < draw.count(120):
        q = rng.uniform(low, high)
        if rng.random() < 0.3:
            at = rng.integers(7)
            q[at] = rng.choice([low[at], high[at]])  # beside a limit, or the end of the turns
        near = q + rng.uniform(-away, away, 7)
        if not arm.within_limits(near):
            continue
        tried += 1
        assert aa.step(arm, q, arm.forward(near)[0]).status is Status.OK


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "barrett_wam7", "simple_humanoid_left"])
@pytest.mark.parametrize("bounded", [False, True])
def test_a_step_to_a_near_posture_beyond_the_straight_elbow_is_found(name: str, bounded: bool) -> None:
    """`step` crosses the straight elbow if its own side has no solution, unless a gc or margin forbids it."""
    arm = aa.Arm.from_catalogue(name)
    rng = np.random.default_rng(5)
    low, high = np.maximum(arm.lower, -TURN), np.minimum(arm.upper, TURN)
    straight = (arm.geometry.delta - arm.geometry.offsets[3]) / arm.geometry.signs[3]
    turned = 0
    for _ in range(draw.count(120)):
        q = rng.uniform(low, high)
        at = rng.choice([0, 1, 2, 4, 5, 6], 2, replace=False)
        q[at] = np.where(rng.random(2) < 0.5, low[at], high[at])
        off = rng.choice([0.0, 10.0 ** rng.uniform(-9, -1)]) * rng.choice([-1.0, 1.0])
        q[3] = straight + off
        move = rng.uniform(-0.2, 0.2, 7)
        move[3] = -np.copysign(rng.uniform(abs(off), 0.2), off)
        near = np.clip(q + move, low, high)
        bounds = {"dt": 0.02, "velocity": 10.0, "max_joint_step": 0.2} if bounded else {}
        now = aa.step(arm, q, arm.forward(near)[0], **bounds)
        assert now.status is Status.OK
        assert np.abs(now.q - q).max() <= 0.2 and arm.within_limits(now.q)
        assert np.abs(arm.forward(now.q)[0] - arm.forward(near)[0]).max() <= 1e-9
        if (now.q[3] - straight) * off < 0 and abs(off) > 1e-3:  # only where its own side has none
            turned += 1
            for kept, gc in ((arm, int(arm.forward(q)[2])), (arm.with_(singularity_margin=1e-4), None)):
                held = aa.step(kept, q, arm.forward(near)[0], **bounds, gc=gc)
                assert held.status is not Status.OK or (held.q[3] - straight) * off > 0
    assert turned > 0


@pytest.mark.parametrize("joint", [0, 1, 2, 4, 5, 6])
@any_policy
def test_a_motion_with_a_locked_joint_is_followed(policy: aa.Repulsion, joint: int) -> None:
    """`follow` with a locked joint is ok and, unless that is joint 3, repeats the motion of its poses."""
    arm = limited(IIWA, joint, START[joint], START[joint])
    move = np.where(np.arange(7) == joint, 0, [0.3, 0.2, -0.3, 0.2, 0.3, -0.2, 0.4])
    way = START + np.linspace(0, 1, 40)[:, None] * move
    for lookahead in (0, 10):
        path = aa.follow(arm, arm.forward(way)[0], start=START, policy=policy, lookahead=lookahead)
        assert path.ok
        assert np.abs(path.q[:, joint] - START[joint]).max() <= 1e-11
        assert np.abs(np.diff(path.q, axis=0)).max() <= 0.2
        if joint != 2:  # where two of its arm angles meet, joint 3 may go on with either
            assert np.abs(path.q - way).max() <= 1e-9


@pytest.mark.parametrize("offset", [1e-4, 0.0])
def test_beside_the_base_axis_psi_cannot_be_held_and_the_elbow_can(offset: float) -> None:
    """Past the base axis `follow` with Hold lets psi turn; carry="elbow" moves joints by 0.05 rad."""
    start, poses = beside_the_axis(offset)
    arm = unlimited(IIWA)  # so that nothing but the reference plane is in question
    options = {"start": start, "policy": aa.Hold()}
    by_psi = aa.follow(arm, poses, **options)
    assert by_psi.ok  # holding the number would be a jump of about pi in one step: it gives way
    assert np.ptp(by_psi.psi) > 1.0
    assert np.abs(np.diff(by_psi.q, axis=0)).max() <= 0.2
    by_elbow = aa.follow(arm, poses, carry="elbow", **options)
    assert by_elbow.ok
    assert np.abs(np.diff(by_elbow.q, axis=0)).max() <= 0.05
    assert by_elbow.residual.max() <= 1e-12


def turned(pose: Array, angle: Any) -> Array:
    """Poses turned by angles (...), rad, about the tool's own z axis."""
    angles = np.mod(angle, TURN)
    return pose @ aa.pose(np.zeros((*angles.shape, 3)), rotvec=angles[..., None] * [0.0, 0.0, 1.0])


def test_turning_the_tool_three_times_exhausts_the_windings_of_joint_7() -> None:
    """`follow` of three turns ends with WINDING_EXHAUSTED at the limit of joint 7, joints not wrapped."""
    arm = limited(IIWA, 6, -TURN, TURN)
    turns = np.linspace(0, 3 * TURN, 301)
    path = aa.follow(arm, turned(arm.forward(START)[0], turns), start=START, policy=aa.Hold())
    at = path.first_failure
    assert path.status[at] == Status.WINDING_EXHAUSTED
    held = START[6] + turns < TURN
    assert held[:at].sum() == held.sum() < at  # then the elbow turns, as far as that helps
    assert gap(path.q[held, 6], START[6] + turns[held]) <= 1e-9  # lifted, not wrapped
    assert gap(path.q[at - 1, 6], TURN) <= 1e-9
    assert "joint 7 would pass its upper limit of 360 deg by" in path.explain()
    assert (path.status[at + 1 :] == Status.NOT_REACHED).all()


def test_a_joint_of_less_than_a_turn_that_must_change_its_winding_is_at_its_limit() -> None:
    """`step` past joint 7's limit is LIMITS, and OK only if a joint may move by a turn."""
    q, policy = START.copy(), aa.Hold()
    q[6] = np.radians(174)
    pose = turned(
        IIWA.forward(q)[0], np.radians(12)
    )  # to 186 degrees: the only posture within limits is -174
    assert aa.step(IIWA, q, pose, policy=policy).status is Status.LIMITS
    said = aa.follow(IIWA, [pose], start=q, policy=policy).explain()
    assert "joint 7 would pass its upper limit of 175 deg by 11 deg" in said
    free = aa.step(IIWA, q, pose, policy=policy, max_joint_step=10.0)
    assert free.status is Status.OK and IIWA.within_limits(free.q, tol=1e-9)


@any_policy
@pytest.mark.parametrize("carry", ["psi", "elbow"])
def test_on_any_status_but_ok_nothing_moves(policy: aa.Repulsion, carry: str) -> None:
    """A step that is not OK returns the given joints, with their psi, gc and margin."""
    pose, psi, gc = IIWA.forward(START)
    far, turned_over = pose.copy(), pose.copy()
    far[:3, 3] *= 3
    turned_over[:3, :3] = -turned_over[:3, :3] @ np.diag([1, 1, -1.0])
    seen = set()
    for target, options in (
        (far, {}), (turned_over, {}), (pose, {"gc": gc ^ 5}), (pose, {"allowed": aa.ArcSet()}),
    ):  # fmt: skip
        now = aa.step(IIWA, START, target, policy=policy, carry=carry, **options)
        assert now.status is not Status.OK and np.array_equal(now.q, START)
        assert (now.psi, now.gc, now.margin) == (psi, gc, IIWA.limit_margin(START))
        seen.add(now.status)
    assert len(seen) >= 2


def test_allowed_arcs_are_kept_and_their_ends_say_user() -> None:
    """`feasible & allowed` has ends of side "user", and `resolve` keeps `allowed`."""
    pose, psi, gc = IIWA.forward(START)
    own = aa.ArcSet([[psi - 0.2, psi + 0.3]])
    both = IIWA.feasible(pose, gc) & own
    assert {(end.joint, end.side) for pair in both.ends for end in pair} == {(None, "user")}
    assert all(np.isnan(end.value) for pair in both.ends for end in pair)
    centre = aa.resolve(IIWA, pose, psi, gc, policy=aa.Centre(K=1.0), allowed=own)
    assert circle_gap(centre.psi, psi + 0.05) <= 1e-12
    assert aa.resolve(IIWA, pose, psi, gc, allowed=aa.ArcSet()).status is Status.NOT_ALLOWED
    assert aa.resolve(IIWA, pose, psi + 1, gc, policy=aa.Hold("stop"), allowed=own).status is Status.OUTSIDE


def test_allowed_as_a_function_is_asked_at_each_pose() -> None:
    """`follow` calls `allowed` once with each pose, and equals `step` with those arcs."""
    poses = line(IIWA, START, [0.05, 0, 0.05], 20)
    psi = IIWA.forward(START)[1]
    asked = []

    def allowed(pose: Array) -> aa.ArcSet:
        """The allowed arcs of a pose, which is kept in `asked`."""
        asked.append(pose.copy())
        return aa.ArcSet([[psi - 0.1, psi + 0.1 + pose[0, 3] * 0.01]])

    by_function = aa.follow(IIWA, poses, start=START, allowed=allowed)
    assert np.array_equal(asked, poses)
    sets = [allowed(pose) for pose in poses]
    q = START
    for k, arcs in enumerate(sets):
        now = aa.step(IIWA, q, poses[k], allowed=arcs)
        assert np.array_equal(now.q, by_function.q[k])
        assert now.psi in arcs
        q = now.q


def test_a_gc_can_be_asked_for() -> None:
    """`step(gc=)` leads an arm without limits into any branch at the same psi."""
    arm = unlimited(IIWA)
    pose, psi, gc = arm.forward(START)
    for other in range(8):
        now = aa.step(arm, START, pose, gc=other, policy=aa.Hold(), max_joint_step=20.0)
        assert (now.status, now.gc) == (Status.OK, other)
        assert np.array_equal(arm.forward(now.q)[2], other)
        assert circle_gap(now.psi, psi) <= 1e-14
    assert aa.step(arm, START, pose).gc == gc


def test_empty_and_single_paths() -> None:
    """`follow` takes no pose and one."""
    none = aa.follow(IIWA, np.empty((0, 4, 4)), start=START)
    assert none.ok and none.q.shape == (0, 7)
    one = aa.follow(IIWA, IIWA.forward(START)[0][None], start=START, policy=aa.Hold())
    assert gap(one.q[0], START) <= 1e-12 and one.s.tolist() == [0.0]


def test_a_failed_path_says_where_and_by_how_much() -> None:
    """A failed `follow` names pose, joint and amount, and what helps; degrees are refused."""
    pose, hold = IIWA.forward(START)[0], aa.Hold()
    path = aa.follow(IIWA, line(IIWA, START, [3.0, 0, 0], 50), start=START, max_joint_step=1.0)
    refused(aa.PathError, f"pose {path.first_failure} .* is the first that is not", path.raise_for_status)
    assert Status(path.status[path.first_failure]).sentence in path.explain()
    beyond = START.copy()
    beyond[0] = IIWA.upper[0] + 0.3
    away = IIWA.forward(START + np.eye(7)[0])[0]
    for poses, start, options, said in (
        ([pose, moved(pose, [3.0, 0, 0])], START, {"policy": hold}, "Pose is out of reach by"),
        ([pose, moved(pose, [0, 0, -0.02])], START, {"policy": hold, "max_joint_step": 1e-3}, "held, joint "),
        ([pose], beyond, {}, "Joint 1 starts 17.19 deg outside its limits."),
        ([away, pose], START, {}, "Begin at arm.solve(poses[0], seed=start).q."),
    ):  # fmt: skip
        assert said in aa.follow(IIWA, poses, start=start, **options).explain()
    degrees = np.degrees(START)
    refused(aa.InputError, r"start holds .* were these degrees\?", aa.follow, IIWA, [pose], start=degrees)
    refused(aa.InputError, r"q_now holds .*were these degrees\?", aa.step, IIWA, degrees, pose)
    assert aa.follow(IIWA, [away], start=IIWA.solve(away, seed=START).q).ok
    path = aa.follow(IIWA, [pose, away], start=START)
    assert path.first_failure == 1 and "Begin at" not in path.explain()


def test_poses_in_millimetres_are_suspected() -> None:
    """Poses 1000 times too far are refused with a hint at mm; 10 times is UNREACHABLE."""
    pose = IIWA.forward(START)[0].copy()
    pose[:3, 3] *= 1000
    for call in (
        lambda: IIWA.inverse(pose, 0.0, 0), lambda: IIWA.explain(pose), lambda: IIWA.solve(pose),
        lambda: aa.follow(IIWA, [pose], start=START),
    ):  # fmt: skip
        refused(aa.InputError, r"^pose.* m away, .*was this in mm\?", call)
    pose[:3, 3] /= 100  # 10 times as far as it can be is a mistake, but not that one
    assert "out of reach" in IIWA.explain(pose).explain()
    with pytest.raises(aa.UnreachableError, match=r"arm.explain.pose. says by how much"):
        IIWA.solve(pose).raise_for_status()


def test_a_velocity_that_is_not_known_is_shared_and_cannot_be_written() -> None:
    """A step without dt has a read-only velocity of NaN."""
    pose = IIWA.forward(START)[0]
    now = aa.step(IIWA, START, pose)
    assert np.isnan(now.velocity).all() and now.velocity.shape == (7,)
    refused(ValueError, "read-only", now.velocity.__setitem__, 0, 1.0)
    assert np.isfinite(aa.step(IIWA, START, pose, dt=0.01).velocity).all()
