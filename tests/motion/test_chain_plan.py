"""Laws of plans of nearly S-R-S arms: what is certified holds for the true joints, between the rows too."""

from __future__ import annotations

import numpy as np
import pytest
from support.calibrated import ARMS, Array, calibrated, postures
from support.draw import count, generator
from support.laws import POSE, gap
from support.moves import DENSE, limited, line, proven, slopes_hold
from support.strategies import bends

import armangle as aa

EVERY = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())

START = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
LEAD = 22
"""Of a stretch's numbers, the joint that leads it."""


def lines(arm: aa.Arm, n: int, *seed: int) -> list[tuple[Array, aa.Line]]:
    """At most n random joints, each with a line of about a decimetre from their pose."""
    shifts = generator(*seed, 1).normal(size=(n, 3))
    out = [(q, line(arm, q, 0.05 * shift)) for q, shift in zip(postures(arm, n, *seed), shifts, strict=True)]
    return [(q, way) for q, way in out if np.isfinite(arm.forward(q, on_error="nan")[1])]


def margins(arm: aa.Arm, q: Array) -> Array:
    """The least distance (rad) of joints to their limits."""
    return np.minimum(q - arm.lower, arm.upper - q).min(axis=-1)


@pytest.mark.turns(10)
@pytest.mark.slow
@EVERY
def test_what_is_certified_holds_between_the_rows(arm: aa.Arm) -> None:
    """A plan of a calibrated arm meets its poses; if certified, also keeps limits and branch between the
    rows.
    """
    whole = 0
    for _, way in lines(arm, 10, 31):
        path = aa.plan(arm, way)
        if not path.ok:
            assert not path.certified and path.first_failure is not None
            continue
        assert gap(arm.forward(path.q)[0], path.poses) <= POSE and path.residual.max() <= POSE
        if not path.certified:
            assert len(path.uncertified)
            continue
        whole += 1
        at = proven(path)
        assert margins(arm, at.q).min() >= 0.0 and np.abs(np.diff(at.q, axis=0)).max() < 0.2
        assert (arm.forward(at.q)[2] == at.gc).all()
    assert whole >= 1


def test_limits_beside_the_nominal_joints_are_kept_by_the_true_ones() -> None:
    """A plan of a calibrated arm keeps limits that the true joints of its nominal arm's plan violate."""
    arm, careless = ARMS["kuka_iiwa7_r800 2.0 mm"], aa.Objective(limits=0, singularities=0)
    way = line(arm, START, (0.0, 0.15, 0.05))
    free = aa.plan(arm.deviation.nominal, way, objective=careless, gc=2).q
    for joint, side in ((0, "lower"), (4, "lower"), (4, "upper"), (6, "upper")):
        ends = {"lower": free[:, joint].min() + 0.03, "upper": free[:, joint].max() - 0.03}
        tight = limited(arm, joint, **{side: ends[side]})
        naive, path = (
            aa.plan(one, way, objective=careless, gc=2) for one in (tight.deviation.nominal, tight)
        )
        true = tight.inverse(naive.poses, naive.psi, naive.gc, seed=naive.q, limits=False)
        assert path.certified and margins(tight, path.at(DENSE).q).min() >= 0.0
        assert margins(tight, true).min() < 0.0


def test_arcs_that_are_allowed_are_kept() -> None:
    """`plan` of a calibrated arm keeps `allowed` in its own psi."""
    arm, window = ARMS["kuka_iiwa7_r800 1.0 mm"], aa.ArcSet([[0.1, 0.6]])
    inside = aa.plan(arm, line(arm, START, (0.0, 0.2, 0.05)), allowed=window)
    assert inside.certified and window.contains(inside.at(DENSE).psi).all()


@pytest.mark.turns(6)
@pytest.mark.parametrize(("mm", "mrad"), [(0.5, 0.5), (2.0, 2.0), (4.0, 5.0)])
@pytest.mark.parametrize("end", ["start", "goal"])
def test_beside_a_straight_elbow_a_plan_begins_at_the_start(mm: float, mrad: float, end: str) -> None:
    """Most plans of a calibrated arm from or to joints near a straight elbow succeed, and keep these; others
    name the limits.
    """
    arm = calibrated("kuka_iiwa14_r820", mm, mrad, seed=3)
    rng = generator(77)
    kept = moved = 0
    for _ in range(30):
        q = rng.uniform(arm.lower, arm.upper) * 0.8
        q[3] = rng.choice([-1, 1]) * rng.uniform(0.005, 0.15)
        pose = arm.forward(q, on_error="nan")[0]
        away = pose.copy()
        away[:3, 3] *= 0.95
        way = aa.Line(pose, away) if end == "start" else aa.Line(away, pose)
        path = aa.plan(arm, way, **{end: q})
        if not path.ok:
            assert "no arm angle keeps all limits" in path.explain() or "violates a limit" in path.explain()
            continue
        kept += 1
        moved += path.curve.base is not None
        assert gap(path.q[0 if end == "start" else -1], q) <= 1e-9
        at = path.at(DENSE)
        assert gap(arm.forward(at.q)[0], way.pose(DENSE)) <= POSE
        if path.certified:
            assert margins(arm, at.q).min() >= 0.0
            assert np.abs(np.diff(at.q, axis=0)).max() < 0.2
        _, psi, gc = arm.forward(at.q)
        assert np.abs(np.sin(0.5 * (at.psi - psi))).max() <= 1e-9 and (gc == at.gc).all()
        slopes_hold(path, np.linspace(0.2, 0.8, 7), atol=1e-6)
    assert kept >= 24 and moved >= 2


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "openarm_v10"])
def test_a_start_on_a_limit_is_within_the_limits(name: str) -> None:
    """A plan of a calibrated arm may start on a limit, though its nominal arm is beyond it there."""
    arm = calibrated(name, 2.0, 3.0, seed=1)
    rng = generator(31)
    begun = 0
    for _ in range(40):
        q = rng.uniform(arm.lower, arm.upper) * 0.9
        joint = rng.integers(7)
        q[joint] = (arm.lower, arm.upper)[rng.integers(2)][joint]
        away = q + rng.uniform(-0.15, 0.15, 7)
        away[joint] = q[joint] + 0.1 * np.sign(0.5 * (arm.lower + arm.upper) - q)[joint]
        if not (np.abs(q - np.clip(q, arm.lower, arm.upper)).max() == 0 and arm.within_limits(away)):
            continue
        pose, goal = (arm.forward(x, on_error="nan")[0] for x in (q, away))
        path = aa.plan(arm, aa.Line(pose, goal), start=q)
        assert "outside the limits" not in path.explain()
        if path.ok:
            begun += 1
            assert gap(path.q[0], q) <= 1e-9 and margins(arm, path.q).min() >= -1e-9
    assert begun >= 10


def test_what_leads_changes_without_a_jump() -> None:
    """Where another joint becomes a plan's parameter, joints and derivatives are continuous."""
    rng = generator(5)
    changes = 0
    for seed in range(24):
        arm = calibrated("kuka_iiwa7_r800", 1.0, 1.0, seed=seed)
        first = np.radians([0.0, 0.0, 0.0, -90.0, 0.0, 70.0, 0.0]) + rng.uniform(-0.03, 0.03, 7)
        last = first.copy()
        hinge = (1, 5)[seed % 2]
        first[hinge], last[hinge] = -0.3, 0.3
        last[3] += 0.2
        way = aa.Line(arm.forward(first)[0], arm.forward(last)[0])
        path = aa.plan(arm, way, start=first)
        assert path.ok and gap(arm.forward(path.at(DENSE).q)[0], way.pose(DENSE)) <= POSE
        lead, end = path.curve.stretches[:, LEAD], path.curve.stretches[:, 1]
        for s in end[:-1][np.diff(lead) != 0]:
            changes += 1
            before, after = s - 1e-9, s + 1e-9
            assert gap(path.at(before).q, path.at(after).q) <= 1e-7
            slope = path.derivatives(before)[0]
            assert gap(slope, path.derivatives(after)[0]) <= 1e-5 * (1 + np.abs(slope).max())
    assert changes >= 4


def test_without_deviation_the_plan_is_the_exact_one() -> None:
    """`plan` of a chain without deviation is that of the exact arm."""
    exact, arm = aa.Arm.from_catalogue("kuka_iiwa7_r800"), calibrated("kuka_iiwa7_r800", 0.0, 0.0)
    for _, way in lines(exact, 6, 33):
        a, b = (aa.plan(one.with_(singularity_margin=0.05), way) for one in (exact, arm))
        assert a.ok == b.ok and a.certified == b.certified
        if a.ok:
            assert gap(a.q, b.q) <= 1e-10 and gap(a.at(DENSE).q, b.at(DENSE).q) <= 1e-10
            expected = a.derivatives(DENSE)
            assert gap(expected, b.derivatives(DENSE)) <= 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("name", ["openarm_v10 1.0 mm", "yaskawa_sia5d 1.0 mm"])
def test_all_rows_of_a_plan_from_beside_the_margin_keep_it(name: str) -> None:
    """Plans that begin or end just outside the singularity margin keep it in all rows, certified or not."""
    arm, rng, solved = ARMS[name].with_(singularity_margin=0.3), generator(87), 0
    for k in range(count(24)):
        q, joint = rng.uniform(arm.lower, arm.upper), (1, 3, 5)[k % 3]
        bend = bends(arm, q)[joint // 2]
        q[joint] += arm.geometry.signs[joint] * (np.copysign(0.3 + 10.0 ** rng.uniform(-5, -1), bend) - bend)
        ends = np.array([q, np.clip(q + rng.normal(size=7) * 0.1, arm.lower, arm.upper)])
        if not arm.within_limits(q) or np.abs(np.sin(bends(arm, q))).min() < np.sin(0.3):
            continue
        path = aa.plan(arm, aa.Line(*arm.forward(ends)[0]), start=q)
        if path.ok:
            solved += 1
            assert np.abs(np.sin(bends(arm, path.q))).min() > np.sin(0.3) - 1e-8
    assert solved > 2
