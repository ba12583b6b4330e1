"""Laws of a plan's curve: an optimum of its objective, and never worse than an arm angle that is held."""

from __future__ import annotations

import numpy as np
import pytest
from support.brute_optimum import descend, search
from support.draw import count
from support.moves import line
from support.naive_plans import KINDS
from support.naive_plans import case as naive_case
from support.plan_objective import EVEN, free_lines, length, planned, reversals, terms
from support.planned_arms import IIWA, random_arm

import armangle as aa

IIWA_14 = aa.Arm.from_catalogue("kuka_iiwa14_r820")
FAILED = {"singular": (10, 74, 186, 602), "limits": (123, 531), "long": (65,), "weights": (45, 725)}
POSTURE = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])


def case(seed: int) -> tuple[aa.Arm, aa.Path, np.ndarray | None]:
    """A random arm, a short path from joints within its limits, and these joints or None."""
    rng = np.random.default_rng(seed)
    arm = random_arm(rng)
    q = rng.uniform(arm.lower + 0.15, arm.upper - 0.15)
    shift = rng.normal(size=3)
    path: aa.Path = line(arm, q, shift * rng.uniform(0.02, 0.25) / np.linalg.norm(shift))
    if rng.integers(0, 3) == 0:
        first = arm.forward(q)[0]
        path = aa.Screw(first, first[:3, 3] + shift * 0.1, rng.normal(size=3), rng.uniform(-1, 1))
    return arm, path, q if rng.integers(0, 3) else None


@pytest.mark.parametrize("kind", KINDS)
def test_never_worse_than_the_naive(kind: str) -> None:
    """A plan costs no more than a constant psi in either reference, or `Centre`, where these are feasible."""
    compared = 0
    for seed in (*FAILED.get(kind, ()), *range(5000, 5000 + 8 * count(2), 8)):
        asked = naive_case(seed + (KINDS.index(kind) if seed >= 5000 else 0))
        naive = [(asked.cost(q), name) for name, q in asked.naive()]
        if not naive:
            continue
        compared += 1
        result = asked.plan(samples=20)
        assert result.certified, (asked, naive)
        best = result.diagnosis.branches[0]
        assert asked.cost(planned(result)) <= min(naive)[0] * (1 + 1e-6), (seed, min(naive), best)
    assert compared or count(2) == 2


@pytest.mark.turns(10)
@pytest.mark.slow
@pytest.mark.parametrize("seed", [1040, 1248, 1463, 1497, 1680, 1932, 2149, 5001, 5008])
def test_no_dearer_than_brute_force(seed: int) -> None:
    """A plan costs at most 2 % more than dynamic programming on 720 psi and a descent."""
    asked = naive_case(seed, ("short", "long", "margins", "corner")[seed % 4])
    way = search(asked)
    if way is None or not asked.keeps(q := descend(asked, way)):
        return
    result = asked.plan(samples=20)
    assert result.certified, result.explain()
    assert asked.cost(planned(result)) <= 1.02 * asked.cost(q)


def test_smooth_and_short_on_free_lines_where_the_arm_angle_could_be_held() -> None:
    """Plans of free lines are no longer in the joints, nor reverse more often, than a constant psi."""
    ratios, turns = [], []
    for q, path, hold in free_lines(IIWA_14, 0.2, 12):
        result = aa.plan(IIWA_14, path, start=q)
        assert result.certified
        ratios.append(np.linalg.norm(np.diff(result.q, axis=0)) / np.linalg.norm(np.diff(hold.q, axis=0)))
        turns.append(reversals(result.q) - reversals(hold.q))
    assert np.median(ratios) < 1.0
    assert max(ratios) < 1.02
    assert np.median(turns) <= 0


@pytest.mark.parametrize("seed", [3, 4, 5, 7, 13, 60, 61, 83])
def test_the_cost_said_is_that_of_the_curve_and_no_nearby_curve_has_less(seed: int) -> None:
    """The diagnosis states the plan's cost, and bumps of psi do not make it smaller."""
    arm, path, start = case(seed)
    result = aa.plan(arm, path, start=start)
    if not result.certified:
        return
    best = result.diagnosis.branches[0]
    own = terms(arm, path, planned(result)).total
    assert best.cost == pytest.approx(own, rel=2e-3)
    assert best.stationarity < 1e-8
    rng = np.random.default_rng(seed)
    here, poses = result.at(EVEN), path.pose(EVEN)
    for _ in range(6):
        at, width = rng.uniform(0, 1), rng.uniform(0.1, 0.5)
        bump = np.exp(-(((EVEN - at) / width) ** 2)) * (EVEN if start is not None else 1.0)
        for size in (-0.02, 0.02):
            q = arm.inverse(poses, here.psi + size * bump, here.gc, seed=here.q, limits=False)
            moved = terms(arm, path, q).total
            assert moved > own * (1 - 1e-5)


@pytest.mark.parametrize("name", ["limits", "singularities", "travel"])
def test_more_weight_never_makes_a_term_larger(name: str) -> None:
    """The more a term of the objective weighs, the smaller it is in the plan."""
    q, shift, gc = np.array([1.59, 0.4, -1.12, -1.13, -1.26, 0.4, -1.38]), [0.0, -0.3, 0.0], 0
    if name == "singularities":
        q, shift, gc = POSTURE, [0.05, -0.35, 0.1], 2
    path = line(IIWA, q, np.array(shift))
    values = []
    for weight in (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0):
        result = aa.plan(IIWA, path, gc=gc, objective=aa.Objective(**{name: weight}, enough=1.2))
        assert result.certified
        values.append(getattr(terms(IIWA, path, planned(result), enough=1.2), name))
    assert (np.diff(values) <= 1e-4 * np.array(values[:-1]) + 1e-9).all(), values
    assert values[-1] < 0.95 * values[0], values


def test_the_common_scale_of_weights_makes_no_difference() -> None:
    """Weights that are all scaled scale the cost of a plan and change nothing else."""
    arm = aa.Arm.from_catalogue("realman_rm75_b")
    first = arm.forward([-1.23, 1.429, 2.261, -0.594, -1.033, 0.746, 2.427])[0]
    last = first.copy()
    last[:3, 3] = [0.033, -0.202, 0.0]
    path = aa.CircularArc(first, [0.157, -0.367, 0.054], last, "fixed")
    found = []
    for scale in (1e-3, 1.0, 1e3):
        of = aa.Objective(travel=scale, limits=1e-3 * scale, singularities=1e-3 * scale)
        branch = aa.plan(arm, path, gc=0, objective=of).diagnosis.branches[0]
        assert branch.stationarity < 1e-6
        found.append(branch.cost / scale)
    np.testing.assert_allclose(found, found[1], rtol=1e-6)


def test_a_goal_is_not_left_and_returned_to() -> None:
    """Plans to the end of a motion at constant psi reverse no joint more than twice beyond it."""
    for q, path, hold in free_lines(IIWA_14, 0.2, 6):
        result = aa.plan(IIWA_14, path, start=q, goal=hold.q[-1])
        assert result.certified
        assert reversals(result.q) <= reversals(hold.q) + 2
        assert np.ptp(result.psi) < np.ptp(hold.psi) + np.radians(6)


def test_the_margin_said_is_that_of_the_curve() -> None:
    """The diagnosis states the least distance of a plan to limits (not of joint 4) and to theta_2, theta_6 =
    0.
    """
    for seed in range(12):
        arm, path, start = case(seed)
        result = aa.plan(arm, path, start=start)
        if not result.certified:
            continue
        best = result.diagnosis.branches[0]
        q = planned(result)
        theta = np.abs(arm.geometry.signs * q + arm.geometry.offsets)[:, [1, 5]]
        moving = [0, 1, 2, 4, 5, 6]
        limits = np.minimum(q - arm.lower, arm.upper - q)[:, moving].min()
        true = min(limits, theta.min(), (np.pi - theta).min())
        assert best.margin == pytest.approx(true, abs=np.radians(0.1))


def test_paths_are_weighed_by_what_they_turn() -> None:
    """`length` of a path grows with its translation, and of a rotation is its angle."""
    short = length(IIWA, line(IIWA, POSTURE, np.array([0.002, -0.005, 0.0])))
    assert length(IIWA, line(IIWA, POSTURE, np.array([0.02, -0.05, 0.0]))) == pytest.approx(
        10 * short, rel=0.05
    )
    turn = aa.Screw(IIWA.forward(POSTURE)[0], [0.5, 0.0, 0.5], [0.0, 0.0, 1.0], 2.0)
    assert length(IIWA, turn) == pytest.approx(2.0, rel=0.01)
