"""Laws of solve and solutions on nearly S-R-S arms: no dense grid of the true inverse finds better."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.calibrated import ARMS, calibrated
from support.draw import count, generator
from support.nearest import Case, brute_force, cost_of

import armangle as aa
from armangle.arm.question import MetricName

GRID = 301
ROUNDING = 1e-10
EVERY = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())


def cases(arm: aa.Arm, n: int, seed: int) -> list[Case]:
    """Return cases with random poses, seeds, metrics and options."""
    rng = generator(seed)
    out = []
    for number in range(n):
        q, near = rng.uniform(arm.lower, arm.upper, (2, 7))
        if number % 2:
            near = q + rng.normal(0, 0.05, 7)
        metric: Any = ("l2", "max", "l2")[number % 3]
        prefer: Any = "margin" if number % 5 == 4 else "seed"
        weight = rng.uniform(0, 2, 7) if number % 4 == 3 else np.ones(7)
        out.append(Case(number, arm, arm.forward(q)[0], near, weight, metric, prefer))
    return out


@EVERY
def test_no_grid_of_the_true_inverse_finds_a_nearer_posture(arm: aa.Arm) -> None:
    """`solve` of a calibrated arm is as near as any psi of a grid, within limits and on the pose."""
    for case in cases(arm, count(2), 31):
        found, best = case.solve(), brute_force(case, GRID)
        if not found.ok:
            assert best == np.inf, (case.number, found.status, best)
            continue
        assert cost_of(case, found) <= best + ROUNDING, case.number
        assert arm.within_limits(found.q, 1e-9)
        pose, psi, gc = arm.forward(found.q)
        assert np.abs(pose - case.pose).max() <= 1e-12
        assert gc == found.gc and abs(psi - found.psi) % (2 * np.pi) <= 1e-9


def beside_singular(arm: aa.Arm, n: int, seed: int) -> Any:
    """Joints (n, 7) some 0.01 rad from theta_2, theta_4 - delta or theta_6 = 0, where branches merge."""
    rng = generator(seed)
    q = rng.uniform(arm.lower, arm.upper, (n, 7))
    for row in range(n):
        joint = (1, 3, 5)[row % 3]
        theta = rng.normal(0, 0.01) + (arm.geometry.delta if joint == 3 else 0.0)
        q[row, joint] = arm.geometry.signs[joint] * (theta - arm.geometry.offsets[joint])
    return q


@pytest.mark.parametrize("mm", [0.1, 1.0])
@pytest.mark.parametrize("metric", ["l2", "max"])
def test_where_branches_merge_nothing_known_is_nearer_or_the_answer_says_so(
    mm: float, metric: MetricName
) -> None:
    """Near singularities `solve` of a calibrated arm is UNPROVEN if joints that are known are nearer."""
    arm = calibrated("kuka_iiwa7_r800", mm, mm)
    q = beside_singular(arm, count(45), 36)
    near = q + generator(37).normal(0, 0.02, q.shape)
    pose = arm.forward(q, on_error="nan")[0]
    found = arm.solve(pose, near, metric=metric)
    off = np.abs(q - near).max(axis=1) if metric == "max" else np.linalg.norm(q - near, axis=1)
    farther = found.distance > off + 1e-9
    proven = found.status == aa.Status.OK
    assert not (proven & farther).any(), np.flatnonzero(proven & farther)
    assert set(found.status.tolist()) == {aa.Status.OK, aa.Status.UNPROVEN}
    assert found.ok.all() and found.raise_for_status() is found and np.array_equal(found.pose, pose)
    assert np.abs(arm.forward(found.q, on_error="nan")[0] - pose).max() <= 1e-12
    assert arm.within_limits(found.q).all()
    if metric == "l2":  # joints settled from the seed find what arm angles do not
        assert farther.mean() < 0.1


def test_an_answer_that_is_not_proven_is_an_answer() -> None:
    """A solution that is UNPROVEN is ok, has joints, and does not raise."""
    arm = calibrated("kuka_iiwa7_r800", 1.0, 1.0)
    q = beside_singular(arm, 9, 38)
    pose, near = arm.forward(q, on_error="nan")[0], q + 0.01
    every = arm.solve(pose, near)
    at = int(np.flatnonzero(every.status == aa.Status.UNPROVEN)[0])
    one = arm.solve(pose[at], near[at])
    assert one.status is aa.Status.UNPROVEN and one.ok and one.raise_for_status() is one
    assert np.array_equal(one.q, every.q[at]) and np.array_equal(one.pose, pose[at])
    assert "status=UNPROVEN" in repr(one) and "gap" not in repr(one)


@pytest.mark.parametrize("name", ["yaskawa_sia30d", "human_arm_right"])
def test_a_joint_at_the_end_of_its_whole_turn_is_found(name: str) -> None:
    """`solve` finds joints at the limit of a joint of a whole turn for a seed beyond it."""
    arm = calibrated(name, 0.1, 0.1)
    round_it = np.flatnonzero(arm.upper - arm.lower >= 2 * np.pi - 1e-4)
    assert len(round_it)
    rng = generator(35)
    for _ in range(count(30)):
        q = rng.uniform(arm.lower, arm.upper)
        joint, upper = rng.choice(round_it), rng.random() < 0.5
        q[joint] = arm.upper[joint] if upper else arm.lower[joint]
        near = q + rng.normal(0, 0.1, 7)
        near[joint] = q[joint] + (1 if upper else -1) * rng.uniform(0.05, 0.5)
        found = arm.solve(arm.forward(q)[0], near)
        assert found.distance <= np.linalg.norm(q - near) + ROUNDING
