"""The singularity margin of every kind of arm: what it keeps, where, and that it takes nothing else.

The reference is forward kinematics, the Jacobian or a dense grid of `inverse`, never another query.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from support.families import CALIBRATED, EXACT, of, within
from support.gradients import moved

import armangle as aa

NAMES = ("franka_fr3", "ufactory_xarm7", "willow_garage_pr2_right", "fetch")
MARGINS = (0.02, 0.4)
OFFSET = [aa.Arm.from_catalogue(name) for name in NAMES]
EVERY = of(EXACT, OFFSET)
BOTH = pytest.mark.parametrize("margin", MARGINS)


def hinges(arm: aa.Arm) -> list[int]:
    """Return the joints (from 0) that a margin keeps bent: theta_2 and theta_6, or the one that has no offset
    beside it, and last the elbow.
    """
    if arm.redundancy == "arm_angle":
        return [1, 5, 3]
    return [5, 3] if arm.geometry.a_1 else [1, 3]


def sines(arm: aa.Arm, q: Any) -> Any:
    """Return how far joints (..., 7) are from singular: |sin| of the bend of each of `hinges`."""
    zero = np.where(np.arange(7) == 3, arm.geometry.delta, 0.0)
    theta = arm.geometry.signs * q + arm.geometry.offsets - zero
    return np.abs(np.sin(theta[..., hinges(arm)]))


def keeps(arm: aa.Arm, q: Any, margin: float, slack: float = 1e-9) -> Any:
    """Return whether joints keep a margin."""
    return (sines(arm, q) >= np.sin(margin) - slack).all(axis=-1)


def apart(arm: aa.Arm, rng: np.random.Generator, count: int, margin: float) -> Any:
    """Return at most `count` joint values within the limits that keep a margin (rad)."""
    q = within(arm, rng, 40 * count)
    return q[keeps(arm, q, margin)][:count]


def close(arm: aa.Arm, rng: np.random.Generator, count: int) -> Any:
    """Return `count` joint values within the limits, nearer to singular ones than most."""
    q = within(arm, rng, 40 * count)
    return q[np.argsort(sines(arm, q).min(axis=-1))[: 4 * count : 4]]


def grid_of(arm: aa.Arm, pose: Any, count: int, **seed: Any) -> Any:
    """Return a grid of the free joint, and the joints of each branch there; NaN beyond the limits."""
    free = np.linspace(-np.pi, np.pi, count)
    return free, arm.inverse(pose, free, np.arange(8)[:, None], on_error="nan", **seed)


@of(OFFSET)
def test_the_other_joints_are_singular_where_a_margin_is_kept_and_at_folds(arm: aa.Arm) -> None:
    """The determinant of the Jacobian without the free joint is the product of both links' lengths, both
    sines, and a factor that is 0 at a fold.
    """
    q = within(arm, np.random.default_rng(1), 500)
    g, shoulder = arm.geometry, bool(arm.geometry.a_1)
    theta = g.signs * q + g.offsets
    upper = (-g.a_4, -g.a_3, g.d_ew) if shoulder else (g.a_3, g.a_4, g.d_se)
    across = upper[0] * np.cos(theta[:, 3]) + upper[2] * np.sin(theta[:, 3]) + upper[1]
    fold = across * np.cos(theta[:, 2 if shoulder else 4])
    others = np.delete(arm.jacobian(q), 0 if shoulder else 6, axis=-1)
    lengths = np.hypot(g.d_se, g.a_3) * np.hypot(g.d_ew, g.a_4)
    said = lengths * sines(arm, q).prod(axis=-1) * np.abs(fold)
    np.testing.assert_allclose(np.abs(np.linalg.det(others)), said, rtol=0, atol=1e-13)


@pytest.mark.turns(2)
@EVERY
@BOTH
def test_intervals_are_the_values_of_a_grid_that_keep_the_margin(arm: aa.Arm, margin: float) -> None:
    kept = arm.with_(singularity_margin=margin)
    taken = 0
    for pose in arm.forward(close(arm, np.random.default_rng(2), 12))[0]:
        free, q = grid_of(arm, pose, 900)
        arcs = kept.feasible(pose)
        for gc in range(8):
            ends = arcs.intervals[gc][: arcs.count[gc]]
            told = (free[:, None] - ends[:, 0]) % (2 * np.pi) <= np.diff(ends)[:, 0]
            far = (np.abs(np.sin((free[:, None] - ends.reshape(1, -1)) / 2)) > 1e-6).all(axis=-1)
            there = np.isfinite(q[gc, :, 0])
            known = there & far & (np.abs(sines(arm, q[gc]) - np.sin(margin)) > 1e-9).all(axis=-1)
            np.testing.assert_array_equal(told.any(axis=-1)[known], keeps(arm, q[gc][known], margin, 0.0))
            assert not told.any(axis=-1)[far & ~there].any()
            taken += int((~keeps(arm, q[gc][known], margin, 0.0)).sum())
        each = kept.feasible(pose, int(np.argmax(arcs.count)), per_joint=True)
        own = arm.feasible(pose, int(np.argmax(arcs.count)), per_joint=True)
        others = [joint for joint in range(7) if joint not in hinges(arm)]
        np.testing.assert_array_equal(each.measure[others], own.measure[others])
    assert taken > 0


@EVERY
@BOTH
def test_an_end_at_the_margin_says_singular(arm: aa.Arm, margin: float) -> None:
    kept, seen = arm.with_(singularity_margin=margin), 0
    for pose in arm.forward(close(arm, np.random.default_rng(3), 40))[0]:
        for gc in range(8):
            for pair in kept.feasible(pose, gc).ends:
                for end in pair:
                    if end.side != "singular" or end.joint - 1 not in hinges(arm):
                        continue
                    q = np.zeros(7)
                    q[end.joint - 1] = end.value
                    sine = sines(arm, q)[hinges(arm).index(end.joint - 1)]
                    seen += abs(sine - np.sin(margin)) < 1e-6
    assert seen > 0


@pytest.mark.turns(2)
@EVERY
@BOTH
def test_every_solution_keeps_the_margin_and_none_of_a_grid_is_nearer(arm: aa.Arm, margin: float) -> None:
    rng = np.random.default_rng(4)
    kept = arm.with_(singularity_margin=margin)
    pose, seed = arm.forward(within(arm, rng, 12))[0], within(arm, rng, 12)
    arcs, has = kept.feasible(pose), kept.freedom(pose)
    held = (arcs.count > 0).any(axis=-1)
    np.testing.assert_array_equal(kept.reachable(pose), held)
    np.testing.assert_array_equal(has.arcs, arcs.count.sum(axis=-1))
    asked: tuple[dict[str, Any], ...] = ({}, {"metric": "max"}, {"prefer": "margin"}, {"roll": "free"})
    for how in asked:
        found = kept.solve(pose, seed, **how)
        assert keeps(arm, found.q[found.ok], margin).all() and arm.within_limits(found.q[found.ok]).all()
        if "roll" not in how:
            np.testing.assert_array_equal(found.ok, held)
            np.testing.assert_allclose(arm.forward(found.q[held])[0], pose[held], rtol=0, atol=1e-10)
    nearest = kept.solve(pose, seed)
    for i in np.flatnonzero(held):
        every = kept.solutions(pose[i], seed[i])
        assert len(every) == arcs.count[i].sum() and every[0].distance == nearest.distance[i]
        assert keeps(arm, np.array([one.q for one in every]), margin).all()
        _, q = grid_of(arm, pose[i], 900, seed=seed[i])
        cost = np.linalg.norm(q - seed[i], axis=-1)[keeps(arm, q, margin, 0.0)]
        assert nearest.distance[i] <= np.nanmin(cost, initial=np.inf) + 1e-9
    far = pose.copy()
    far[:, :3, 3] += rng.normal(scale=0.6, size=(12, 3))
    beside = kept.solve(far, seed, fallback="nearest_pose")
    there = np.isfinite(beside.q[:, 0])
    assert there.any() and keeps(arm, beside.q[there], margin).all()


@EVERY
@BOTH
def test_steps_and_paths_keep_the_margin(arm: aa.Arm, margin: float) -> None:
    rng = np.random.default_rng(5)
    kept = arm.with_(singularity_margin=margin)
    done = 0
    for k, start in enumerate(apart(arm, rng, 6, margin)):
        poses = np.tile(arm.forward(start)[0], (50, 1, 1))
        poses[:, :3, 3] += np.linspace(0.0, 0.25, 50)[:, None] * rng.normal(size=3)
        how: dict[str, Any] = ({}, {"policy": aa.Hold()}, {"policy": aa.Centre()})[k % 3]
        path = aa.follow(kept, poses, start=start, **how)
        ok = np.asarray(path.status) == aa.Status.OK.value
        assert keeps(arm, path.q[ok], margin).all()
        theta = arm.geometry.signs * np.vstack([start, path.q[ok]]) + arm.geometry.offsets
        assert len(set(np.sign(np.sin(theta[:, hinges(arm)[0]])))) == 1
        done += int(ok.sum())
        now = aa.step(kept, start, poses[-1], max_joint_step=0.3, fallback="nearest_pose")
        assert keeps(arm, now.q, margin)
    assert done > 60


@pytest.mark.turns(2)
@EVERY
def test_a_plan_keeps_the_margin_at_every_point(arm: aa.Arm) -> None:
    rng, planned = np.random.default_rng(6), 0
    kept = arm.with_(singularity_margin=0.25)
    for start in apart(arm, rng, 9, 0.25):
        ends = np.stack([arm.forward(start)[0]] * 2)
        ends[1, :3, 3] += 0.15 * rng.normal(size=3)
        path = aa.plan(kept, ends, start=start)
        if not path.ok:
            continue
        planned += 1
        assert path.certified and keeps(arm, path.at(np.linspace(0, 1, 2000)).q, 0.25).all()
    assert planned > 1
    near = within(arm, rng, 400)
    near = near[~keeps(arm, near, 0.25)][0]
    refused = aa.plan(kept, arm.forward(near)[0][None].repeat(2, axis=0), start=near)
    said = "nearer to (a singularity than the requested|stretched or folded than the singularity) margin"
    assert not refused.ok and re.search(said, refused.explain())


@pytest.mark.turns(2)
@of(CALIBRATED)
def test_arcs_solutions_and_plans_of_a_calibrated_arm_keep_the_margin(arm: aa.Arm) -> None:
    rng, kept = np.random.default_rng(10), arm.with_(singularity_margin=0.3)
    start, seed = apart(arm, rng, 12, 0.3), within(arm, rng, 12)
    pose, _, gc = arm.forward(start)
    found = kept.solve(pose, seed)
    assert (
        found.ok.all()
        and keeps(arm, found.q, 0.3).all()
        and not keeps(arm, arm.solve(pose, seed).q, 0.3).all()
    )
    for one, branch in zip(pose, gc, strict=True):
        arcs, wide = kept.feasible(one, branch), arm.feasible(one, branch)
        assert arcs.measure <= wide.measure
        for lower, upper in arcs.intervals:
            q = arm.inverse(one, np.linspace(lower, upper, 50), branch, on_error="nan", limits=False)
            assert keeps(arm, q[np.isfinite(q[:, 0])], 0.3).all()
    certified = 0
    for one, q in zip(pose, start, strict=True):
        path = aa.plan(kept, np.stack([one, moved(one, np.array([0.05, 0.05, -0.05, 0, 0, 0]))]), start=q)
        certified += path.certified
        assert not path.certified or keeps(arm, path.at(np.linspace(0, 1, 2000)).q, 0.3).all()
    assert certified > 1


@pytest.mark.turns(2)
@EVERY
def test_turns_explain_maps_and_trackers_keep_the_margin(arm: aa.Arm) -> None:
    rng = np.random.default_rng(7)
    kept = arm.with_(singularity_margin=0.3)
    pose = arm.forward(apart(arm, rng, 6, 0.3))[0]
    turns = kept.feasible_turns(pose, about="tool")
    assert turns.contains(np.zeros(6)).all()
    for angle in rng.uniform(-np.pi, np.pi, 20):
        turn = aa.pose([0, 0, 0], rpy=[0, 0, angle])
        back = np.linalg.inv(arm.tool)
        told = turns.contains(np.full(6, angle))
        np.testing.assert_array_equal(told, kept.reachable(pose @ back @ turn @ arm.tool))
    for one in arm.forward(within(arm, rng, 8))[0]:
        arcs, said = kept.feasible(one), kept.explain(one)
        assert [branch.ok for branch in said.branches] == (arcs.count > 0).tolist()
    near = within(arm, rng, 400)
    near = near[~keeps(arm, near, 0.3)][:20]
    only = [one for one in arm.forward(near)[0] if not kept.reachable(one)]
    assert not any(kept.explain(one).ok for one in only)
    tracker = aa.Tracker(kept, dt=0.01).start(apart(arm, rng, 1, 0.3)[0])
    assert tracker.step(arm.forward(tracker.q)[0]).status.name == "FOLLOWING"


@EVERY
def test_derivatives_are_those_of_the_arm_with_its_margin(arm: aa.Arm) -> None:
    rng, h = np.random.default_rng(8), 1e-6
    kept, checked = arm.with_(singularity_margin=0.5), 0
    pose, seed = arm.forward(apart(arm, rng, 120, 0.5))[0], within(arm, rng, 120)
    twist = rng.normal(size=(120, 6))
    slopes = aa.gradients.solve(kept, pose, seed)
    ahead, behind = moved(pose, h * twist), moved(pose, -h * twist)
    q = kept.solve(pose, seed).q
    rate = (kept.solve(ahead, seed).q - kept.solve(behind, seed).q) / (2 * h)
    told = np.einsum("nij,nj->ni", slopes[..., :6], twist)
    for i in np.flatnonzero(np.isfinite(told).all(axis=-1) & (np.abs(rate).max(axis=-1) < 30)):
        at_margin = np.abs(sines(arm, q[i]) - np.sin(0.5)).min() < 1e-8
        checked += at_margin
        assert not at_margin or np.abs(told[i] - rate[i]).max() < 1e-3 * (1 + np.abs(rate[i]).max())
    assert checked > 1


@EVERY
def test_without_a_margin_an_arm_is_as_it_was(arm: aa.Arm) -> None:
    back = arm.with_(singularity_margin=0.3).with_(singularity_margin=0.0)
    rng = np.random.default_rng(9)
    q = within(arm, rng, 10)
    pose, seed = arm.forward(q)[0], within(arm, rng, 10)
    assert back == arm and hash(back) == hash(arm) and arm != arm.with_(singularity_margin=0.3)
    np.testing.assert_array_equal(back.feasible(pose).intervals, arm.feasible(pose).intervals)
    np.testing.assert_array_equal(back.solve(pose, seed).q, arm.solve(pose, seed).q)
    held: aa.Arm = eval(repr(arm.with_(singularity_margin=0.3)), {"Arm": aa.Arm, **vars(aa)})
    assert held.singularity_margin == 0.3 and held == arm.with_(singularity_margin=0.3)
    assert held.feasible(pose).measure.sum() < arm.feasible(pose).measure.sum()
