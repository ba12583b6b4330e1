"""Laws of every kind of arm: S-R-S, with elbow offsets, calibrated, with an offset wrist or shoulder.

The reference is forward kinematics, a difference or a dense grid, never another query.
"""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from support.calibrated import ARMS as CALIBRATIONS
from support.calibrated import calibrated, off_singular, plain_forward
from support.chain import turn
from support.draw import count
from support.families import (
    ARMS,
    CALIBRATED,
    CHAINS,
    CLOSED,
    OFFSET,
    OFFSETS,
    of,
    regular,
    tolerance,
    within,
)  # fmt: skip
from support.laws import circle_gap, gap
from support.moves import moved

import armangle as aa

EVERY = [*ARMS, *OFFSETS, *CALIBRATIONS.values()]
FAR = calibrated("franka_fr3", 20.0, 10.0)
Z = np.array([0.0, 0.0, 1.0])


@of(EVERY, [FAR])
def test_forward_frames_and_the_elbow_are_those_of_the_links_multiplied_in_order(arm: aa.Arm) -> None:
    """`forward` is the product of the arm's links, and each joint turns the frames after it about the z axis
    of the frame before, and no other; psi of an arm with an offset is its free joint.
    """
    q = within(arm, np.random.default_rng(17), 50)
    (pose, psi, gc), frames = arm.forward(q), arm.frames(q)
    assert gap(pose, np.array([plain_forward(arm, row) for row in q])) <= 1e-14
    assert gap(frames[:, 7] @ arm.tool, pose) <= 1e-14
    assert gap(arm.elbow(q), frames[:, 3, :3, 3]) == 0.0
    assert gap(gc, arm.deviation.nominal.forward(q)[2]) == 0
    if arm.redundancy != "arm_angle":
        assert circle_gap(psi, q[:, int(arm.redundancy[-1]) - 1]).max() <= 1e-15
    for joint in range(7):
        spun, axis = arm.frames(q + 0.7 * np.eye(7)[joint]), frames[:, joint]
        spin = axis @ turn(Z, 0.7 * arm.geometry.signs[joint]) @ np.linalg.inv(axis)
        assert gap(spun[:, : joint + 1], frames[:, : joint + 1]) <= 1e-14
        assert gap(spun[:, joint + 1 :], spin[:, None] @ frames[:, joint + 1 :]) <= 1e-13


@of(EVERY, [FAR])
def test_every_posture_is_met_again_and_every_answer_holds_its_pose(arm: aa.Arm) -> None:
    """`inverse` of `forward` gives the joints back, and those of all branches hold pose, psi and branch. Of
    an own chain without an offset it is NaN in under 1 %, next to where branches meet. Limits leave the rows
    that keep them.
    """
    own, rng = arm.geometry.chain is not None, np.random.default_rng(18)
    q = within(arm, rng, count(400 if own else 2000))
    pose, psi, gc = arm.forward(q)
    again = arm.inverse(pose, psi, gc, seed=q, on_error="nan", limits=False)
    solved, off = np.isfinite(again[:, 0]), np.abs(again - q).max(axis=1)
    nearly = own and arm.redundancy == "arm_angle"
    assert solved.mean() >= 0.99 if nearly else solved.all() and off.max() < 1e-6
    assert (off[solved] < 1e-6).mean() > 0.9
    assert np.median(off[solved]) < 1e-13
    if arm.redundancy == "arm_angle":
        clear = off_singular(arm, q, np.radians(10.0))
        assert solved[clear].all() and off[clear].max() <= 1e-9
    rows = arm.inverse(pose, psi, on_error="nan", limits=False)
    there = np.isfinite(rows[..., 0])
    row, branch = np.nonzero(there)
    for one, met in (
        (arm.forward(again[solved]), (pose[solved], psi[solved], gc[solved])),
        (arm.forward(rows[there]), (pose[row], psi[row], branch)),
    ):
        assert gap(one[0], met[0]) <= tolerance(arm)
        assert circle_gap(one[1], met[1]).max() <= 1e-11
        assert (one[2] == met[2]).mean() > (1 - 1e-9 if own else 0.999)
    margin, kept = arm.limit_margin(rows[there]), np.isfinite(arm.inverse(pose, psi, on_error="nan")[there])
    decided = np.abs(margin) > 1e-9
    assert (kept[decided, 0] == (margin > 0)[decided]).all() and 0 < kept.mean() < 1


@of(ARMS, [FAR])
def test_the_urdf_of_an_arm_is_the_same_arm(arm: aa.Arm) -> None:
    """`from_urdf` and `load` of an arm's URDF give its kind, its lengths and its poses."""
    q = within(arm, np.random.default_rng(19), 20)
    doors = (aa.Arm.from_urdf, aa.Arm.load)
    for read in (door(arm.to_urdf()) for door in (doors if arm.geometry.chain is None else doors[1:])):
        assert (read.kind, read.redundancy) == (arm.kind, arm.redundancy) and read.report is not None
        assert gap(read.forward(q)[0], arm.forward(q)[0]) <= 1e-12
        if arm.geometry.chain is None:
            assert (read.geometry.d_se, read.geometry.d_ew) == (arm.geometry.d_se, arm.geometry.d_ew)


@of(ARMS)
def test_out_of_reach_every_question_says_so(arm: aa.Arm) -> None:
    """Status, error and `explain` of a pose 5 m away say that it is out of reach; `inverse` may be NaN."""
    pose = moved(arm.forward(within(arm, np.random.default_rng(20), 1)[0])[0], [5.0, 0.0, 0.0])
    found = arm.solve(pose)
    assert not found.ok and found.gc == -1 and np.isnan(found.q).all()
    assert found.status is arm.feasible(pose, 0).status is arm.freedom(pose).status is aa.Status.UNREACHABLE
    assert (arm.feasible(pose).status == aa.Status.UNREACHABLE).all()
    none = arm.solutions(pose[None])
    assert none.count == [0] and none.status == [aa.Status.UNREACHABLE]
    with pytest.raises(aa.UnreachableError, match=r"out of reach.* arm\.explain\(pose\) says"):
        found.raise_for_status()
    assert "out of reach" in arm.explain(pose).explain()
    with pytest.raises(aa.UnreachableError, match="out of reach"):
        arm.inverse(pose, 0.0, 0, limits=False)
    assert np.isnan(arm.inverse(pose, 0.0, 0, on_error="nan", limits=False)).all()


@of(ARMS)
def test_no_poses_are_answered(arm: aa.Arm) -> None:
    """Functions take no poses and no joints."""
    none = np.empty((0, 4, 4))
    assert arm.forward(np.empty((0, 7)))[0].shape == (0, 4, 4)
    assert arm.feasible(none, np.empty(0, dtype=int)).shape == (0,)
    assert arm.solve(none, seed=np.zeros(7)).q.shape == (0, 7)
    assert arm.solve(np.empty((3, 0, 4, 4)), prefer="margin").psi.shape == (3, 0)
    assert arm.solutions(none, seed=np.zeros(7)).q.shape == (0, 0, 7)


@of(ARMS)
def test_a_joint_beyond_its_limits_is_an_error_unless_limits_are_left_out(arm: aa.Arm) -> None:
    """`inverse` beyond limits raises LimitError, unless limits=False; `solve` finds nothing there."""
    q = regular(arm, np.random.default_rng(21), 1)[0]
    pose, psi, gc = arm.forward(q)
    tight = arm.with_(lower=q + 0.05, upper=q + 0.06)
    with pytest.raises(aa.LimitError, match="outside its limits"):
        tight.inverse(pose, psi, gc)
    assert gap(tight.inverse(pose, psi, gc, limits=False), q) <= 1e-9
    found = tight.solve(pose)
    assert not found.ok and found.gc == -1 and np.isnan(found.q).all()


@of(OFFSET, CHAINS)
@pytest.mark.parametrize("joint", range(7))
def test_with_a_locked_joint_its_posture_is_found(arm: aa.Arm, joint: int) -> None:
    """With a joint locked `feasible` has an end at the psi of joints that hold the pose, or they are amid an
    interval, and `solve` finds them.
    """
    for q in within(arm, np.random.default_rng(11), 6):
        lower, upper = arm.lower.copy(), arm.upper.copy()
        lower[joint] = upper[joint] = q[joint]
        locked = arm.with_(lower=lower, upper=upper)
        pose, psi, gc = locked.forward(q)
        assert locked.solve(pose, seed=q).distance < 1e-6
        arcs = locked.feasible(pose, gc)
        assert psi in arcs or circle_gap(arcs.nearest(psi), psi) <= 1e-9 or arcs.unproven > 0


@of(ARMS)
def test_the_self_motion_is_a_difference_along_psi_and_leaves_the_tool(arm: aa.Arm) -> None:
    """`self_motion` equals differences of `inverse` along psi, and the Jacobian takes it to 0."""
    q = regular(arm, np.random.default_rng(1), 40)
    pose, psi, gc = arm.forward(q)
    rate = arm.self_motion(pose, psi, gc)
    ahead, behind = (arm.inverse(pose, psi + s, gc, seed=q, limits=False) for s in (1e-6, -1e-6))
    np.testing.assert_allclose(rate, (ahead - behind) / 2e-6, rtol=1e-5, atol=1e-6)
    moved = np.einsum("nij,nj->ni", arm.jacobian(q), rate)
    np.testing.assert_allclose(moved, 0.0, atol=1e-9 * (1 + np.abs(rate).max()))


@of(ARMS)
def test_the_jacobian_is_the_slope_of_forward(arm: aa.Arm) -> None:
    """The columns of `jacobian` are differences of `forward`, as speeds of the tool's position and turn."""
    for q in within(arm, np.random.default_rng(14), 5):
        ahead, behind = (arm.forward(q + sign * 1e-6 * np.eye(7))[0] for sign in (1, -1))
        slope = (ahead - behind) / 2e-6
        turn = slope[:, :3, :3] @ arm.forward(q)[0][:3, :3].T
        rows = np.vstack([slope[:, :3, 3].T, turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]])
        np.testing.assert_allclose(arm.jacobian(q), rows, rtol=0, atol=1e-8)


@of(ARMS)
def test_the_slope_of_the_limit_margin_is_that_of_its_joints(arm: aa.Arm) -> None:
    """`gradients.limit_margin` equals differences of `limit_margin`."""
    for q in within(arm, np.random.default_rng(0), 20):
        ahead, behind = (arm.limit_margin(q + s * 1e-7 * np.eye(7)) for s in (1, -1))
        np.testing.assert_allclose(aa.gradients.limit_margin(arm, q), (ahead - behind) / 2e-7, atol=1e-6)


@of(ARMS)
def test_an_arm_is_a_value_and_a_copy_keeps_what_is_not_changed(arm: aa.Arm) -> None:
    """Copies by `pickle` and `repr` are equal; a tool and a base are mounted; limits change no pose."""
    twin = pickle.loads(pickle.dumps(arm))
    assert twin == arm and hash(twin) == hash(arm) and arm != arm.with_(name="other")
    assert eval(repr(arm), {"Arm": aa.Arm}) == arm
    q = within(arm, np.random.default_rng(15), 20)
    pose, psi, _ = arm.forward(q)
    tool, base = aa.pose([0.0, 0.02, 0.1], rpy=[0.1, 0.2, 0.3]), aa.pose([0.5, 0.0, 1.0], rpy=[0.0, 0.3, 0.0])
    np.testing.assert_allclose(arm.with_tool(tool).forward(q)[0], pose @ tool, rtol=0, atol=1e-13)
    moved = arm.with_(base=base @ arm.base).forward(q)
    np.testing.assert_allclose(moved[0], base @ pose, rtol=0, atol=1e-13)
    np.testing.assert_allclose(moved[1], psi, rtol=0, atol=1e-9)
    narrow = arm.with_(lower=np.maximum(arm.lower, -1.0), upper=np.maximum(arm.upper, 0.0))
    np.testing.assert_array_equal(narrow.forward(q)[0], pose)
    assert narrow.geometry == arm.geometry


@of(CLOSED, CALIBRATED)
def test_a_posture_is_its_own_nearest_and_not_where_its_branch_is_left_out(arm: aa.Arm) -> None:
    """`solve` of the pose of its seed gives the seed back to the bit; without its branch, another or none."""
    q = within(arm, np.random.default_rng(16), 50)
    pose, _, gc = arm.forward(q)
    found = arm.solve(pose, seed=q)
    np.testing.assert_array_equal(found.q, q)
    np.testing.assert_array_equal(found.gc, gc)
    assert (found.distance == 0).all()
    other = arm.solve(pose[0], seed=q[0], gc=[k for k in range(8) if k != gc[0]])
    assert not other.ok or other.gc != gc[0]


@of(OFFSET)
def test_the_free_joint_moves_at_its_own_rate_and_where_there_is_none_it_is_infinite(arm: aa.Arm) -> None:
    """`self_motion` of an offset arm is 1 for the free joint, and very large at singularities."""
    q = within(arm, np.random.default_rng(2), 20)
    free = int(arm.redundancy[-1]) - 1
    np.testing.assert_allclose(arm.self_motion(*arm.forward(q))[:, free], 1.0, rtol=0, atol=1e-14)
    hinge = 1 if free == 6 else 5
    q[:, hinge] = -arm.geometry.signs[hinge] * arm.geometry.offsets[hinge]
    assert (np.abs(arm.self_motion(*arm.forward(q))[:, [hinge - 1, hinge + 1]]) > 1e6).all()


@of(CLOSED)
def test_the_intervals_of_a_joint_alone_are_those_of_a_grid(arm: aa.Arm) -> None:
    """`feasible(per_joint=True)` agrees with each joint's limits on a grid."""
    rng = np.random.default_rng(3)
    pose, _, gc = arm.forward(within(arm, rng, 5))
    sets = arm.feasible(pose, gc, per_joint=True)
    every = arm.feasible(pose, per_joint=True)
    assert sets.shape == (5, 7) and every.shape == (5, 8, 7)
    psi = rng.uniform(-np.pi, np.pi, 500)
    q = arm.inverse(pose[:, None], psi, gc[:, None], on_error="nan", limits=False)
    room = np.minimum(q - arm.lower, arm.upper - q)  # NaN where there is none
    told = np.moveaxis(np.array([sets.contains(np.full((5, 7), x)) for x in psi]), 0, 1)
    np.testing.assert_array_equal(told[np.abs(room) > 1e-6], (room >= 0)[np.abs(room) > 1e-6])
    assert not told[np.isnan(room)].any()
    np.testing.assert_array_equal(every.measure[np.arange(5), gc], sets.measure)


@of(CLOSED, CALIBRATED)
def test_what_all_joints_leave_is_what_each_of_them_leaves(arm: aa.Arm) -> None:
    """`feasible` is the intersection of the sets of `feasible(per_joint=True)`."""
    pose, _, gc = arm.forward(within(arm, np.random.default_rng(4), 30))
    each, whole = arm.feasible(pose, gc, per_joint=True), arm.feasible(pose, gc)
    assert each.shape == (30, 7) and whole.shape == whole.unproven.shape == (30,)
    assert np.array_equal(arm.feasible(pose).measure[np.arange(30), gc], whole.measure)
    proven = (whole.unproven == 0) & (each.unproven == 0).all(axis=-1)
    assert proven.mean() > 0.5
    for i in np.flatnonzero(proven):
        both = each[i, 0]
        for joint in range(1, 7):
            both = both & each[i, joint]
        assert abs(both.measure - whole.measure[i]) <= 1e-8


@pytest.mark.turns(2)
@of(CLOSED)
@pytest.mark.parametrize("wish", ["point", "direction"])
def test_no_psi_of_a_grid_brings_the_elbow_nearer(arm: aa.Arm, wish: str) -> None:
    """`psi_towards` a point or direction brings the elbow as near or far as any psi of a grid."""
    rng = np.random.default_rng(5)
    pose, _, gc = arm.forward(within(arm, rng, 25))
    target = arm.elbow(within(arm, rng, 25)) if wish == "point" else rng.normal(size=(25, 3))
    psi = arm.psi_towards(pose, gc, **{wish: target})
    grid = np.concatenate([psi[:, None], np.tile(np.linspace(-np.pi, np.pi, 721), (25, 1))], axis=1)
    q = arm.inverse(pose[:, None], grid, gc[:, None], on_error="nan", limits=False)
    there = np.isfinite(q[..., 0])
    elbow = arm.elbow(np.where(there[..., None], q, 0.0))
    gain = np.einsum("nki,ni->nk", elbow, target)
    if wish == "point":
        gain = -np.linalg.norm(elbow - target[:, None], axis=-1)
    assert there[:, 0].all()
    assert (gain[:, 0] >= np.where(there, gain, -np.inf).max(axis=1) - 1e-9).all()


@of(OFFSET)
def test_where_every_elbow_is_as_good_it_is_said(arm: aa.Arm) -> None:
    """`psi_towards` of an offset arm raises if every elbow is as far from the point, and out of reach.

    With on_error="nan" it is NaN there.
    """
    q = within(arm, np.random.default_rng(6), 1)[0]
    pose, _, gc = arm.forward(q)
    end = arm.frames(q)[1 if arm.geometry.a_6 else 6, :3, 3]
    with pytest.raises(aa.UnreachableError, match="as good"):
        arm.psi_towards(pose, gc, point=end)
    far = pose.copy()
    far[:3, 3] += 5.0
    with pytest.raises(aa.UnreachableError, match=r"out of reach by [0-9.]+ mm"):
        arm.psi_towards(far, gc, direction="up")
    assert np.isnan(arm.psi_towards(far, gc, direction="up", on_error="nan"))


@of(CLOSED)
def test_freedom_and_reachable_are_the_numbers_of_the_intervals(arm: aa.Arm) -> None:
    """`freedom` and `reachable` agree with `feasible` and `solve`."""
    rng = np.random.default_rng(7)
    pose = arm.forward(within(arm, rng, 60))[0]
    pose[::2, :3, 3] += rng.normal(scale=0.3, size=(30, 3))
    arcs, has = arm.feasible(pose), arm.freedom(pose)
    held = arcs.count > 0
    np.testing.assert_array_equal(has.gc >> np.arange(8)[:, None] & 1, held.T)
    np.testing.assert_allclose(has.total, arcs.measure.sum(axis=-1), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(has.arcs, arcs.count.sum(axis=-1))
    np.testing.assert_array_equal(arm.reachable(pose), held.any(axis=-1))
    np.testing.assert_array_equal(arm.reachable(pose), arm.solve(pose, seed=np.zeros(7)).ok)
    assert 5 < (~held.any(axis=-1)).sum() < 55
    one = arm.freedom(pose[0])
    assert (one.gc, one.arcs) == (has.gc[0], has.arcs[0]) and one.status == has.status[0]


def stretched(arm: aa.Arm) -> float:
    """Return the value of joint 4 (rad) at which the arm is stretched."""
    return float(arm.geometry.signs[3] * (arm.geometry.delta - arm.geometry.offsets[3]))


@of([arm for arm in CLOSED if arm.lower[3] <= stretched(arm) <= arm.upper[3]])
def test_a_stretched_arm_is_reachable_where_its_joints_keep_limits_and_margin(arm: aa.Arm) -> None:
    """At a stretched elbow, often of a single psi, limits and margin decide as anywhere."""
    rng, beyond = np.random.default_rng(4), 0
    for k, q in enumerate(within(arm, rng, 24)):
        q[3] = stretched(arm)
        pose, j = arm.forward(q, on_error="nan")[0], rng.choice([1, 4, 5])
        narrow = [np.where(np.arange(7) == j, q + d, end) for d, end in [(-0.1, arm.lower), (0.1, arm.upper)]]
        tight = arm.with_(lower=narrow[0], upper=narrow[1])
        assert tight.solve(pose).ok and (k > 3 or tight.explain(pose).ok)
        away = [np.where(np.arange(7) == j, q + d, end) for d, end in [(0.3, arm.lower), (0.6, arm.upper)]]
        for other in (arm.with_(lower=away[0], upper=away[1]), arm.with_(singularity_margin=0.1)):
            found = other.solve(pose)
            assert bool(other.reachable(pose)) == found.ok == (other.freedom(pose).gc > 0)
            beyond += not found.ok
    assert beyond > 10


def cost(metric: str, arm: aa.Arm, q: Any, seed: Any, weight: Any) -> Any:
    """Return what joints (..., 7) cost by a metric ("l2", "max" or "margin"); infinite if NaN or beyond
    limits.
    """
    off = weight * (q - seed) ** 2
    value = np.sqrt(off.sum(-1)) if metric == "l2" else np.sqrt(off.max(-1))
    room = np.minimum(q - arm.lower, arm.upper - q).min(-1)
    if metric == "margin":
        value = -room
    return np.where(room >= 0, value, np.inf)


def grid_of(arm: aa.Arm, pose: Any, seed: Any, psi: Any) -> Any:
    """Return the joints (n, 8, k, 7) of every branch at a grid of psi (k,), NaN where there are none."""
    return arm.inverse(
        pose[:, None, None],
        psi,
        np.arange(8)[:, None],
        seed=seed[:, None, None],
        on_error="nan",
        limits=False,
    )


@of(CHAINS)
def test_freedom_of_a_chain_counts_its_proven_intervals_and_the_branches_with_a_solution(arm: aa.Arm) -> None:
    """`freedom` of a calibrated arm sums its arcs, and gc holds the branches that `solve` can use."""
    rng = np.random.default_rng(8)
    q = within(arm, rng, 12)
    pose, _, gc = arm.forward(q)
    pose[8:, :3, 3] += 5.0
    arcs, has = arm.feasible(pose), arm.freedom(pose)
    np.testing.assert_allclose(has.total, arcs.measure.sum(axis=-1), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(has.arcs, arcs.count.sum(axis=-1))
    np.testing.assert_allclose(has.unproven, np.sum(arcs.unproven, axis=-1), rtol=1e-12)
    held = has.gc[:, None] >> np.arange(8) & 1
    assert (held[arcs.count > 0] == 1).all()
    assert held[np.arange(8), gc[:8]].sum() >= 7  # one near where branches meet may be missed
    empty = (arcs.count == 0) & (np.asarray(arcs.unproven) == 0)
    assert not held[empty].any() and not has.gc[8:].any()
    np.testing.assert_array_equal(arm.reachable(pose), arm.solve(pose).ok)
    for one, branch in np.argwhere(held == 1):
        assert arm.solve(pose[one], gc=int(branch)).ok
    assert (has.status[8:] == aa.Status.UNREACHABLE).all()
    np.testing.assert_array_equal(has.status == aa.Status.OK, has.gc != 0)


@pytest.mark.turns(2)
@of(CLOSED, CALIBRATED)
@pytest.mark.parametrize("metric", ["l2", "max", "margin"])
def test_no_solution_of_a_grid_costs_less_than_that_of_solve(arm: aa.Arm, metric: str) -> None:
    rng = np.random.default_rng(8)
    q = within(arm, rng, 8)
    seed, weight = within(arm, rng, 8), rng.uniform(0.2, 2.0, 7)
    pose = arm.forward(q)[0]
    asked: dict[str, Any] = (
        {"prefer": "margin"} if metric == "margin" else {"metric": metric, "weight": weight}
    )
    found = arm.solve(pose, seed, **asked)
    proven = (found.status == aa.Status.OK) | (arm.geometry.chain is None)
    assert found.ok.all() and (arm.lower <= found.q).all() and (found.q <= arm.upper).all()
    assert proven.any() and gap(arm.forward(found.q)[0], pose) <= min(tolerance(arm), 1e-11)
    own = cost(metric, arm, found.q, seed, weight)
    np.testing.assert_allclose(-found.margin if metric == "margin" else found.distance, own, atol=1e-12)
    every = cost(
        metric, arm, grid_of(arm, pose, seed, np.linspace(-np.pi, np.pi, 1501)), seed[:, None, None], weight
    )
    if metric == "margin":  # what is sought without a seed
        assert np.array_equal(arm.solve(pose).q, found.q) and np.isnan(found.distance).all()
    known = np.minimum(every.min(axis=(1, 2)), cost(metric, arm, q, seed, weight))
    assert (own <= known + 1e-9)[proven].all()


@pytest.mark.turns(2)
@of(CLOSED, CALIBRATED)
def test_what_is_allowed_is_kept_and_nothing_of_it_is_nearer(arm: aa.Arm) -> None:
    """`solve(allowed=)` keeps it, as near as any allowed psi of a grid, or is NOT_ALLOWED."""
    rng = np.random.default_rng(9)
    q = within(arm, rng, 8)
    pose, psi, _ = arm.forward(q)
    seed = within(arm, rng, 8)
    for i in range(8):
        allowed = aa.ArcSet([(psi[i] - 0.2, psi[i] + 0.1), (psi[i] + 1.0, psi[i] + 1.5)])
        found = arm.solve(pose[i], seed[i], allowed=allowed)
        assert found.ok and (found.psi in allowed)
        by_function = arm.solve(pose[i], seed[i], allowed=lambda _, allowed=allowed: allowed)
        assert np.array_equal(by_function.q, found.q)
        grid = np.linspace(-np.pi, np.pi, 3001)
        grid = grid[allowed.contains(grid)]
        every = cost("l2", arm, grid_of(arm, pose[i : i + 1], seed[i : i + 1], grid)[0], seed[i], np.ones(7))
        assert found.distance <= every.min() + 1e-9 or found.status is aa.Status.UNPROVEN
    arcs = arm.feasible(pose[0])
    free = [~aa.ArcSet(arcs.intervals[k][: arcs.count[k]]) for k in range(8)]
    shut = free[0]
    for one in free[1:]:
        shut = shut & one
    inner = aa.ArcSet([(a + 0.3 * (b - a), b - 0.3 * (b - a)) for a, b in shut.intervals])
    if inner.measure > 1e-3:
        assert arm.solve(pose[0], seed[0], allowed=inner).status is aa.Status.NOT_ALLOWED


@pytest.mark.turns(2)
@of(CLOSED, CALIBRATED)
@pytest.mark.parametrize("prefer", ["seed", "margin"])
def test_there_is_one_solution_for_each_branch_and_interval_the_best_first(arm: aa.Arm, prefer: str) -> None:
    rng = np.random.default_rng(10)
    pose, seed = arm.forward(within(arm, rng, 12))[0], within(arm, rng, 12)
    sols, arcs, first = (
        arm.solutions(pose, seed, prefer=prefer),
        arm.feasible(pose),
        arm.solve(pose, seed, prefer=prefer),
    )
    proven = (arcs.unproven == 0).all(axis=-1)
    assert proven.any()
    np.testing.assert_array_equal(sols.count[proven], arcs.count.sum(axis=-1)[proven])
    if arm.geometry.chain is None:
        np.testing.assert_array_equal(sols.q[:, 0], first.q)
    with pytest.raises(TypeError, match="solutions of one pose"):
        len(sols)
    for i in np.flatnonzero(proven):
        assert np.isnan(sols.q[i, sols.count[i] :]).all() and (sols.gc[i, sols.count[i] :] == -1).all()
        many = arm.solutions(pose[i], seed[i], prefer=prefer)
        rank = [-one.margin if prefer == "margin" else one.distance for one in many]
        assert len(many) == sols.count[i] and (np.diff(rank) >= -1e-9).all()
        places = set()
        for one in many:
            np.testing.assert_allclose(arm.forward(one.q)[0], pose[i], rtol=0, atol=1e-11)
            assert arm.within_limits(one.q)
            ends = arcs.intervals[i, one.gc][: arcs.count[i, one.gc]]
            near = np.abs((one.psi - ends.mean(axis=1) + np.pi) % (2 * np.pi) - np.pi)
            places.add((one.gc, int(np.argmin(near - 0.5 * np.diff(ends)[:, 0]))))
            if prefer == "seed":
                alone = arm.solve(
                    pose[i], seed[i], gc=one.gc, allowed=aa.ArcSet(ends[[places_of(ends, one.psi)]])
                )
                assert one.distance <= alone.distance + 1e-9
        assert len(places) == len(many)


def places_of(ends: Any, psi: float) -> int:
    """Return the index of the interval that holds an angle, or is nearest to it."""
    near = np.abs((psi - ends.mean(axis=1) + np.pi) % (2 * np.pi) - np.pi)
    return int(np.argmin(near - 0.5 * np.diff(ends)[:, 0]))


@pytest.mark.turns(2)
@of(OFFSET)
def test_explain_names_limits_that_block_and_by_how_much_they_must_be_wider(arm: aa.Arm) -> None:
    """In `explain` blocking joints alone block, without any one they do not; openings are enough, less is
    not.
    """
    rng = np.random.default_rng(11)
    pose = arm.forward(within(arm, rng, 40))[0]
    pose[:, :3, 3] += rng.normal(scale=0.15, size=(40, 3))
    free = arm.with_(lower=-np.inf, upper=np.inf)
    seen = 0
    for one in pose:
        arcs, told = arm.feasible(one), arm.explain(one)
        assert [branch.gc for branch in told.branches] == list(range(8))
        for branch in told.branches:
            assert branch.ok == bool(arcs.count[branch.gc] > 0)
            if branch.ok:
                continue
            assert branch.status == arcs.status[branch.gc]
            if branch.status is not aa.Status.LIMITS:
                assert not free.feasible(one, branch.gc).ok
                continue
            seen += 1
            if seen > 25:
                continue
            held = np.isin(np.arange(1, 8), branch.blocking)
            assert held.any() and not only(arm, held).feasible(one, branch.gc).ok
            for joint in branch.blocking:
                assert only(arm, held & (np.arange(1, 8) != joint)).feasible(one, branch.gc).ok
            for opening in branch.openings:
                assert wider(arm, opening, 1e-3).feasible(one, branch.gc).ok
                assert not wider(arm, opening, -1e-4).feasible(one, branch.gc).ok
    assert seen > 25


@of(CHAINS)
def test_explain_of_a_chain_names_limits_that_block_and_by_how_much_they_must_be_wider(arm: aa.Arm) -> None:
    """The limits that `explain` names block alone, and `solve` finds joints once an opening is made."""
    rng = np.random.default_rng(11)
    shut = opened = 0
    for q in within(arm, rng, 8):
        one, low = arm.forward(q)[0], q - 0.5
        low[3] = q[3] + 0.05
        tight = arm.with_(lower=low, upper=q + 0.5)
        arcs, told = tight.feasible(one), tight.explain(one)
        for branch in told.branches:
            if arcs.count[branch.gc] > 0:
                assert branch.ok and branch.margin >= 0
                continue
            if arcs.unproven[branch.gc] == 0:
                assert not branch.ok and branch.status == arcs.status[branch.gc]
            if branch.status is not aa.Status.LIMITS:
                continue
            shut += 1
            assert not tight.solve(one, gc=branch.gc).ok
            if branch.blocking:
                held = np.isin(np.arange(1, 8), branch.blocking)
                assert only(tight, held).feasible(one, branch.gc).measure == 0.0
            for opening in branch.openings[:2]:
                opened += 1
                assert wider(tight, opening, 1e-3).solve(one, gc=branch.gc).ok
    assert shut > 3 and opened > 1


def only(arm: aa.Arm, held: Any) -> aa.Arm:
    """Return the arm with limits only for the joints that are True in `held` (7,)."""
    return arm.with_(lower=np.where(held, arm.lower, -np.inf), upper=np.where(held, arm.upper, np.inf))


def wider(arm: aa.Arm, opening: Any, more: float) -> aa.Arm:
    """Return the arm with one limit moved out by what an opening says and `more` (rad)."""
    by = (opening.extra + more) * np.eye(7)[opening.joint - 1]
    return arm.with_(lower=arm.lower - by) if opening.side == "lower" else arm.with_(upper=arm.upper + by)


@pytest.mark.turns(2)
@of(OFFSET)
def test_the_nearest_pose_within_reach_is_at_its_edge(arm: aa.Arm) -> None:
    """`explain` out of reach gives the nearest pose within reach and its distance."""
    rng = np.random.default_rng(12)
    free = arm.with_(lower=-np.inf, upper=np.inf)
    pose = arm.forward(within(arm, rng, 20))[0]
    pose[:, :3, 3] += rng.normal(scale=2.0, size=(20, 3))
    far = 0
    for one in pose:
        told = arm.explain(one)
        assert told.nearest is not None
        away = told.nearest[:3, 3] - one[:3, 3]
        np.testing.assert_allclose(np.linalg.norm(away), told.nearest_gap, rtol=0, atol=1e-12)
        if told.nearest_gap == 0.0:
            continue
        far += 1
        assert all(branch.excess == told.nearest_gap for branch in told.branches)
        for way in rng.normal(size=(30, 3)):  # nothing nearer is within reach
            other = moved(one, way / np.linalg.norm(way) * told.nearest_gap * 0.999)
            assert (free.feasible(other).status == aa.Status.UNREACHABLE).all()
        beyond = moved(told.nearest, away / told.nearest_gap * 1e-6)
        assert (free.feasible(beyond).status != aa.Status.UNREACHABLE).all()
    assert far > 5


@pytest.mark.turns(2)
@of(ARMS)
@pytest.mark.parametrize("about", ["base", "tool"])
def test_turns_are_those_at_which_the_turned_pose_is_held(arm: aa.Arm, about: Any) -> None:
    """`feasible_turns` holds the angles about axis 1 or 7 at which the turned pose is reachable; of an own
    chain, whose axes are its own, those that are proven.
    """
    own, rng = arm.geometry.chain is not None, np.random.default_rng(13)
    lower, upper = np.maximum(arm.lower, -2.5), np.minimum(arm.upper, 2.5)
    narrow = arm.with_(lower=0.6 * lower + 0.4 * upper, upper=0.2 * lower + 0.8 * upper)
    q = within(narrow, rng, 6)
    pose, frames, looks = narrow.forward(q)[0], narrow.frames(q), 30 if own else 150
    turns = narrow.feasible_turns(pose, about)
    here, left = turns.contains(np.zeros(6)), turns.unproven
    assert turns.shape == (6,) and here.sum() >= (5 if own else 6) and (left[~here] > 0).all()
    assert (turns.ok == (turns.count > 0)).all() and (own or (left == 0).all())
    inside = 0
    for i in range(6):
        angle = rng.uniform(-np.pi, np.pi, looks)
        axis, spin = frames[i, 0 if about == "base" else 6], aa.pose(np.zeros(3), rotvec=angle[:, None] * Z)
        held = np.asarray(narrow.reachable(axis @ spin @ np.linalg.inv(axis) @ pose[i]))
        ends = turns.intervals[i][: turns.count[i]].ravel()
        gap = np.abs((angle[:, None] - ends + np.pi) % (2 * np.pi) - np.pi).min(axis=1, initial=np.pi)
        told = np.array([x in aa.ArcSet(ends.reshape(-1, 2)) for x in angle])
        assert held[told & (gap > 1e-6)].all()
        decided = gap > 1e-6 + left[i]
        np.testing.assert_array_equal(told[decided], held[decided])
        inside += int(held.sum())
    assert 0 < inside < 6 * looks
