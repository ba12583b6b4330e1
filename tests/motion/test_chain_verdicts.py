"""Laws of why a nearly S-R-S arm has no plan: the reason named holds for its true joints and links."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.calibrated import ARMS, Array
from support.draw import count, generator
from support.moves import DENSE
from support.touching import least_distance

import armangle as aa
from armangle import Status
from armangle.types import Verdict

BONES = aa.Body.bones(upper_arm=0.05, forearm=0.04)
PSI = np.linspace(-np.pi, np.pi, 720, endpoint=False)
NOT_SEARCHED = (Status.OUTSIDE, Status.NO_CONVERGENCE)
"""Reasons for a refused end that the search gives, not the joints."""


def beside_a_box(arm: aa.Arm, rng: np.random.Generator) -> tuple[aa.Arm, Array, float] | None:
    """The arm with a box about its elbow, joints, and what they have more than the clearance, m: often less
    than the links are off.
    """
    q = rng.uniform(0.9 * arm.lower, 0.9 * arm.upper)
    pose = aa.pose(arm.elbow(q) + rng.normal(size=3) * 0.15, rpy=rng.uniform(-3, 3, 3))
    scene = aa.Scene([aa.Box(pose, rng.uniform(0.02, 0.1, 3), name="box")])
    distance = float(arm.clearance(q, scene).distance)
    room = float(rng.choice([-1, 1, 1]) * 10.0 ** rng.uniform(-6, -2))
    if distance - room < 0.002 or not np.isfinite(distance):
        return None
    return arm.with_(scene=aa.Scene(scene.shapes, clearance=distance - room)), q, room


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800 1.0 mm", "openarm_v10 1.0 mm", "yaskawa_sia5d 2.0 mm"])
def test_given_joints_beside_a_box_are_refused_if_the_true_links_are_too_near(name: str) -> None:
    """A start or a goal is refused for its clearance exactly if `clearance` says that it lacks it."""
    rng, certified, refused = generator(91, len(name)), 0, 0
    for k in range(count(16)):
        drawn = beside_a_box(ARMS[name].with_(body=BONES), rng)
        if drawn is None:
            continue
        arm, q, room = drawn
        pose, _, gc = arm.forward(q)
        other = aa.pose(rng.normal(size=3) * 0.01) @ pose
        ends: Any = {"start": q} if k % 2 else {"goal": q}
        path = aa.plan(arm, aa.Line(pose, other) if k % 2 else aa.Line(other, pose), gc=int(gc), **ends)
        own = path.diagnosis[int(gc)]
        if room < 0:
            refused += 1
            assert (own.verdict, own.status) == (Verdict.START if k % 2 else Verdict.GOAL, Status.CLEARANCE)
            assert abs(own.short + room) < 1e-9
            assert own.touching is not None
            continue
        assert own.verdict not in (Verdict.START, Verdict.GOAL) or own.status in NOT_SEARCHED
        certified += path.certified
        if path.ok:
            assert np.abs(path.q[0 if k % 2 else -1] - q).max() < 1e-9
            assert least_distance(arm, path.q, arm.scene).min() >= arm.scene.clearance - 1e-8
        if path.certified:
            assert least_distance(arm, path.at(DENSE).q, arm.scene).min() >= arm.scene.clearance - 1e-9
    assert certified >= 2
    assert refused >= 2


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800 1.0 mm", "barrett_wam7 1.0 mm", "yaskawa_sia5d 2.0 mm"])
def test_where_a_plan_says_impossible_a_grid_finds_no_joints(name: str) -> None:
    """A path that ends beside a limit of joint 4 is IMPOSSIBLE only where no arm angle has joints within the
    limits; if the true chain arrives it is not impossible there.
    """
    arm, rng, proven, arrive = ARMS[name], generator(92, len(name)), 0, 0
    for _ in range(count(24)):
        q = rng.uniform(arm.lower, arm.upper)
        limit, inward = (arm.lower[3], 1) if rng.random() < 0.5 else (arm.upper[3], -1)
        inside = rng.choice([-1, 1]) * 10.0 ** rng.uniform(-3.5, -1.5)
        q[3] = limit + inward * inside
        begin = q.copy()
        begin[3] += inward * 0.1
        ends, _, gc = arm.forward(np.array([begin, q]), on_error="nan")
        if not np.isfinite(ends).all() or gc[0] != gc[1]:
            continue
        path = aa.plan(arm, aa.Line(*ends), start=begin, gc=int(gc[0]))
        own = path.diagnosis[int(gc[0])]
        if own.verdict not in (Verdict.IMPOSSIBLE, Verdict.UNREACHABLE):
            arrive += inside > 0
            continue
        proven += 1
        for s in np.linspace(own.s_from, own.s_to, 3):
            found = arm.inverse(path.path.pose(s), PSI, int(gc[0]), limits=False, on_error="nan")
            assert not ((found > arm.lower) & (found < arm.upper)).all(axis=-1).any(), (s, inside)
    assert proven >= 2
    assert arrive >= 2
