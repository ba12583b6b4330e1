"""Laws of `plan` for every kind of arm: ends, margins, wishes, derivatives, times, refusals."""

from __future__ import annotations

import itertools
import pickle
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.draw import generator
from support.families import tolerance
from support.gradients import named
from support.laws import gap
from support.moves import limited, refused

import armangle as aa

AMID = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])
READY = {
    "kuka_iiwa7_r800": AMID,
    "calibrated kuka_iiwa7_r800": AMID,
    "franka_fr3": np.array([0.1, -0.6, 0.2, -2.2, 0.1, 1.9, 0.7]),
    "willow_garage_pr2_left": np.array([0.4, 0.5, 0.6, -1.3, 0.4, -0.8, 0.3]),
}
OWN = "calibrated franka_fr3"  # a plan of it takes 20 times as long
READY[OWN] = READY["franka_fr3"]
EVERY = pytest.mark.parametrize("name", READY)
QUICK = pytest.mark.parametrize("name", [name for name in READY if name != OWN])
PLACES = np.linspace(0.0, 1.0, 1001)


@cache
def turned(name: str) -> aa.JointPath:
    """Return a plan from READY along 30 poses that shift and turn."""
    arm, s = named(name), np.linspace(0.0, 1.0, 30)[:, None]
    first = arm.forward(READY[name])[0]
    path = aa.plan(
        arm, first @ aa.pose(s * [0.05, 0.08, -0.05], rotvec=s * [0.2, 0.1, -0.15]), start=READY[name]
    )
    assert path.certified, path.explain()
    return path


@EVERY
def test_rows_are_at_exactly_the_poses_and_at_agrees_with_them(name: str) -> None:
    """A plan's rows hold the given poses, and `at` gives the rows back, for s of any shape; the same plan
    again, or its copy, has the same joints.
    """
    path, arm = turned(name), turned(name).arm
    assert gap(arm.forward(path.q)[0], path.poses) <= tolerance(arm)
    assert gap(path.at(path.s).q, path.q) <= 1e-12
    assert path.at(0.3).q.shape == (7,) and path.at(np.zeros((2, 3))).pose.shape == (2, 3, 4, 4)
    again = aa.plan(arm, path.poses, start=READY[name])
    assert np.array_equal(again.q, path.q) and np.array_equal(again.poses, path.poses)
    assert np.array_equal(pickle.loads(pickle.dumps(path)).at(PLACES).q, path.at(PLACES).q)


@EVERY
def test_derivatives_are_limits_of_differences_and_do_not_leap(name: str) -> None:
    """A plan's derivatives equal finite differences; q' and q'' are continuous at the knots."""
    path, h = turned(name), 1e-6
    s = np.linspace(0.01, 0.99, 97)
    exact = path.derivatives(s)
    first = (path.at(s + h).q - path.at(s - h).q) / (2 * h)
    np.testing.assert_allclose(exact[:, 0], first, rtol=1e-6, atol=1e-6)
    assert path.curve is not None
    knots = path.curve.knots[1:-1]
    smooth = np.abs(s[:, None] - knots).min(axis=1, initial=1.0) > 2 * h
    higher = (path.derivatives(s + h) - path.derivatives(s - h)) / (2 * h)
    np.testing.assert_allclose(exact[smooth, 1:], higher[smooth, :2], rtol=1e-3, atol=1e-2)
    before, behind = path.derivatives(knots - 1e-9)[:, :2], path.derivatives(knots + 1e-9)[:, :2]
    assert gap(before, behind) <= 1e-5 * np.abs(exact).max()


@QUICK
def test_it_begins_at_the_start_ends_at_the_goal_and_goes_on_from_there(name: str) -> None:
    """A plan keeps `start` and `goal`, and the next one begins at its last row."""
    path = turned(name)
    assert gap(path.q[0], READY[name]) <= 1e-10
    back = aa.plan(path.arm, path.poses[::-1], start=path.q[-1], goal=READY[name])
    assert back.certified and gap(back.q[[0, -1]], np.stack([path.q[-1], READY[name]])) <= 1e-9


MEETINGS = (("calibrated kuka_iiwa7_r800", 3, 24, 3), (OWN, 4, 2, 0), (OWN, 3, 2, 1))
"""Arms, a joint (0 to 6) with whose angle two branches meet, how many plans are asked, how many begin."""


@pytest.mark.turns(2)
@pytest.mark.parametrize(("name", "joint", "plans", "least"), MEETINGS)
def test_where_branches_meet_a_plan_begins_at_its_start_and_is_one_motion(
    name: str, joint: int, plans: int, least: int
) -> None:
    """From a start where two branches meet, and its branch holds a second solution, a plan begins there and
    leaves it without a jump.
    """
    arm, rng, begun = named(name), generator(5), 0
    low, high = np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0)
    meet = {3: arm.geometry.delta, 4: 0.5 * np.pi}[joint]
    for _ in range(plans):
        start = rng.uniform(low, high)
        start[joint] = arm.geometry.signs[joint] * (meet - arm.geometry.offsets[joint])
        ends = arm.forward([start, np.clip(start + rng.normal(size=7) * 0.1, low, high)], on_error="nan")[0]
        path = aa.plan(arm, aa.Line(*ends), start=start)
        if not path.ok:
            continue
        begun += 1
        assert gap(path.q[0], start) <= 1e-9
        assert gap(path.at([1e-14, 1e-11]).q, start) <= (1e-6 if path.certified else 1e-3)
    assert begun >= least


@QUICK
def test_a_start_on_a_limit_is_left(name: str) -> None:
    """A plan may start on a limit, and keeps it."""
    path = turned(name)
    least = READY[name][6]
    held = aa.plan(limited(path.arm, 6, lower=least), path.poses, start=READY[name])
    assert held.ok and (held.certified or held.arm.geometry.chain is not None)
    assert held.q[:, 6].min() >= least - 1e-9


@QUICK
def test_a_margin_and_the_branch_that_are_asked_are_kept(name: str) -> None:
    """A plan for travel alone comes near to limits, and with `limit_margin` keeps it between the rows; its
    branch is `gc`.
    """
    path, gc, travel = turned(name), int(turned(name).gc[0]), aa.Objective(limits=0.0, singularities=0.0)
    free, kept = (
        aa.plan(path.arm, path.poses, gc=gc, limit_margin=margin, objective=travel) for margin in (0.0, 0.2)
    )
    assert free.certified and path.arm.limit_margin(free.at(PLACES).q).min() < 0.1
    assert kept.certified and path.arm.limit_margin(kept.at(PLACES).q).min() >= 0.2 - 1e-9
    assert (kept.gc == gc).all()


@QUICK
def test_a_wish_for_psi_is_met_as_it_is_weighed(name: str) -> None:
    """The more Objective(psi) weighs, the nearer a plan comes to the wished psi, or to the psi of a wished
    place of the elbow.
    """
    path, gc = turned(name), int(turned(name).gc[0])
    point = path.arm.elbow(path.q[0]) + np.array([0.0, 0.1, 0.0])
    number = float(path.psi[0]) + 0.2
    for wish in (number, aa.Towards(point=point)):
        off = []
        for weight in (0.0, 1.0, 1000.0):
            found = aa.plan(path.arm, path.poses, psi=wish, gc=gc, objective=aa.Objective(psi=weight))
            assert found.certified
            here = found.at(PLACES[::25])
            wished = number if wish is number else path.arm.psi_towards(here.pose, gc, point=point)
            off.append(float((2 - 2 * np.cos(here.psi - wished)).mean()))
        assert off[0] > off[1] > off[2] and off[2] < 0.2 * off[0]


@QUICK
def test_it_is_timed_saved_and_blended(name: str, tmp_path: Path) -> None:
    """A plan can be retimed within its bounds, saved and loaded, and its corners rounded."""
    path = turned(name)
    timed = aa.retime(path, velocity=1.0, acceleration=4.0)
    assert (
        np.abs(timed.qd).max() <= 1.0 + 1e-6
        and np.abs(timed.qdd).max() <= 4.0 + 1e-6
        and timed.duration > 0.1
    )
    aa.io.save(path, tmp_path / "joints.npz")
    assert np.array_equal(aa.io.load_joints(tmp_path / "joints.npz").q, path.q)
    corner = path.poses[[0, 15, 29]].copy()
    corner[1, :3, 3] += 0.02
    sharp = aa.plan(path.arm, corner, start=READY[name])
    assert sharp.certified and len(sharp) == 3
    rounded = aa.plan(path.arm, corner, blend=0.02, start=READY[name])
    assert rounded.certified and 0 < rounded.deviation.position < 0.02
    here = rounded.at(PLACES)
    assert gap(path.arm.forward(here.q)[0], here.pose) <= tolerance(path.arm)


@QUICK
def test_one_pose_equal_poses_and_none(name: str) -> None:
    """A plan of one pose, of equal poses, and of none."""
    path = turned(name)
    one = aa.plan(path.arm, path.poses[:1], start=READY[name])
    assert one.certified and len(one) == 1 and gap(one.q[0], READY[name]) <= 1e-9
    same = aa.plan(path.arm, np.repeat(path.poses[:1], 6, axis=0))
    assert same.certified and np.abs(np.diff(same.q, axis=0)).max() < 0.05
    none = aa.plan(path.arm, np.empty((0, 4, 4)))
    assert none.ok and len(none) == 0 and not none.certified and len(none.uncertified) == 0
    assert repr(none) == "<JointPath of 0 poses, ok>" and none.explain() == "There is no pose."


@QUICK
def test_ends_that_are_none_of_the_path_are_refused(name: str) -> None:
    """A start or goal of another pose raises; one beyond limits, a whole turn away or in another branch
    fails, and `explain` says so.
    """
    path, start = turned(name), READY[name]
    refused(aa.InputError, "start belongs to another pose", aa.plan, path.arm, path.poses, start=start + 0.2)
    refused(aa.InputError, "goal belongs to another pose", aa.plan, path.arm, path.poses, goal=start)
    beyond = aa.plan(limited(path.arm, 0, upper=start[0] - 0.05), path.poses, start=start)
    assert not beyond.ok and "beyond the upper one of joint 1" in beyond.explain()
    away = 2 * np.pi * np.eye(7)[4]
    for turns, limit in itertools.product((1, -1), (np.inf, 4 * np.pi)):
        wide = limited(path.arm, 4, lower=-limit, upper=limit)
        turned_goal = aa.plan(wide, path.poses, start=start, goal=path.q[-1] + turns * away)
        assert not turned_goal.ok and "the goal has a joint a whole turn from" in turned_goal.explain()
        assert turned_goal.diagnosis is not None
        assert turned_goal.diagnosis.branches[0].status == aa.Status.JOINT_JUMP
    asked: Any = int(path.gc[0]) ^ 1
    other = aa.plan(path.arm, path.poses, start=start, gc=asked)
    assert not other.ok and "another global configuration" in other.explain()
