"""Laws of the arcs of nearly S-R-S arms: in them all limits hold, out of them one breaks, ends are limits."""

from __future__ import annotations

import numpy as np
import pytest
from support.calibrated import ARMS, Array, off, postures
from support.draw import generator
from support.laws import circle_gap

import armangle as aa
from armangle.models.chain import chain_of, links_of

CLEAR = 1e-9  # rad of a joint: nearer to a limit nothing is decided
EVERY = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())


def within(arm: aa.Arm, q: Array) -> float:
    """Least distance (rad) of joints to their limits up to multiples of 2π; negative beyond."""
    middle, half = 0.5 * (arm.lower + arm.upper), 0.5 * (arm.upper - arm.lower)
    return float(np.where(half >= np.pi, np.inf, half - circle_gap(q, middle)).min())


@EVERY
def test_ends_are_the_true_joints_at_their_limits(arm: aa.Arm) -> None:
    """At each end of an arc of a calibrated arm its named joint is at its limit, or the end is unproven."""
    q = postures(arm, 20, 23)
    pose, _, gc = arm.forward(q)
    met = 0
    for i in range(len(q)):
        arcs = arm.feasible(pose[i], gc[i])
        for (lower, upper), ends in zip(arcs.intervals, arcs.ends, strict=True):
            for psi, end in zip((lower, upper), ends, strict=True):
                if end.joint is None:
                    assert end.side == "unproven" and arcs.unproven > 0.0
                    continue
                at = arm.inverse(pose[i], psi, gc[i], on_error="nan", limits=False)[end.joint - 1]
                if np.isfinite(at):
                    assert circle_gap(at, end.value) <= 1e-10
                    met += 1
    assert met > 10


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "openarm_v10", "yaskawa_sia5d"])
def test_without_deviation_the_arcs_are_the_exact_ones(name: str) -> None:
    """With a chain that deviates by nothing the arcs are those of the plain arm."""
    arm = aa.Arm.from_catalogue(name)
    near = arm.with_(chain=links_of(chain_of(arm._description())))
    pose, _, gc = arm.forward(postures(arm, 30, 26))
    compared = 0
    for i in range(len(pose)):
        exact, proven = arm.feasible(pose[i], gc[i]), near.feasible(pose[i], gc[i])
        if proven.unproven > 0.0:
            continue
        difference = (exact & ~proven).measure + (proven & ~exact).measure
        assert difference <= 1e-9 * (1 + exact.count)
        compared += 1
    assert compared >= 25


def test_an_arc_ends_where_its_branch_does() -> None:
    """`inverse` has joints all along the arcs of a pose near a stretched elbow."""
    arm = ARMS["iit_icub_left 2.0 mm"]
    q = np.random.default_rng([22, 78]).uniform(arm.lower, arm.upper, (79, 7))[78]
    pose = arm.forward(q)[0]
    for branch in range(8):
        arcs = arm.feasible(pose, branch)
        for lower, upper in arcs.intervals:
            joints = arm.inverse(pose, np.linspace(lower, upper, 200), branch, on_error="nan", limits=False)
            assert np.isfinite(joints[1:-1]).all(), (branch, lower, upper)


def test_shapes_joints_and_branches() -> None:
    """`feasible` of a calibrated arm: shapes, per_joint, all branches, and singularity margin."""
    arm = ARMS["openarm_v10 1.0 mm"]
    pose, _, gc = arm.forward(postures(arm, 3, 28))
    one, all_gc, each = arm.feasible(pose, gc), arm.feasible(pose), arm.feasible(pose, gc, per_joint=True)
    assert one.shape == (3,) and all_gc.shape == (3, 8) and each.shape == (3, 7)
    assert one.unproven.shape == (3,) and aa.ArcSet([[0.0, 1.0]]).unproven == 0.0
    for i in range(3):
        assert all_gc[i, int(gc[i])].intervals.tolist() == one[i].intervals.tolist()
        if all_gc[i].unproven.max() == 0.0 and each[i].unproven.max() == 0.0:
            together = each[i, 0]
            for joint in range(1, 7):
                together = together & each[i, joint]
            assert abs(together.measure - one[i].measure) <= 1e-8
    wide = arm.feasible(pose[0], gc[0])
    kept = arm.with_(singularity_margin=0.3).feasible(pose[0], gc[0])
    assert kept.measure <= wide.measure
    for psi in np.linspace(-3, 3, 40):
        if psi in kept:
            theta = arm.geometry.signs * arm.inverse(pose[0], psi, gc[0], limits=False) + arm.geometry.offsets
            theta[3] -= arm.geometry.delta
            assert (np.abs(np.sin(theta[1:6:2])) >= np.sin(0.3) - 1e-9).all()


def test_a_joint_goes_through_the_gap_of_a_range_of_nearly_a_turn() -> None:
    """Arcs end on both sides of the gap between limits of nearly ±π, and `inverse` there breaks a limit."""
    arm = ARMS["kuka_iiwa7_r800 1.0 mm"]
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[[0, 2, 4, 6]], upper[[0, 2, 4, 6]] = -np.pi + 0.01, np.pi - 0.01
    wide = arm.with_(lower=lower, upper=upper)
    pose, psi, gc = wide.forward(postures(wide, 40, 30))
    gaps = 0
    for i in range(len(pose)):
        arcs = wide.feasible(pose[i], gc[i])
        assert psi[i] in arcs
        for (_, before), (after, _), ends, next_ends in zip(
            arcs.intervals, arcs.intervals[1:], arcs.ends, arcs.ends[1:], strict=False
        ):
            if ends[1].joint is None or ends[1].joint != next_ends[0].joint or after - before > 0.1:
                continue
            inside = wide.inverse(pose[i], np.linspace(before, after, 7)[1:-1], gc[i], limits=False)
            assert all(within(wide, row) < 0 for row in inside)
            for end, at in ((ends[1], before), (next_ends[0], after)):
                joint = wide.inverse(pose[i], at, gc[i], limits=False)[end.joint - 1]
                assert circle_gap(joint, end.value) <= 1e-10
            gaps += ends[1].side != next_ends[0].side  # through it, and not back out of it
    assert gaps > 10


def test_a_locked_joint_leaves_isolated_angles() -> None:
    """With a locked joint `feasible` of a calibrated arm has an arc of no width at its psi."""
    base = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    links = off(links_of(chain_of(base._description())), 0.5, 0.5, generator(29))
    q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    arm = base.with_(chain=links)
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[2] = upper[2] = q[2]
    locked = arm.with_(lower=lower, upper=upper)
    pose, psi, gc = locked.forward(q)
    arcs = locked.feasible(pose, gc)
    assert any(abs(a - psi) <= 1e-9 and abs(b - psi) <= 1e-9 for a, b in arcs.intervals)


def test_reasons_of_empty_sets() -> None:
    """The status of an empty set of a calibrated arm names reach, elbow, margin or limits."""
    arm = ARMS["kuka_iiwa7_r800 1.0 mm"]
    pose, _, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    far = pose.copy()
    far[0, 3] += 2.0
    assert arm.feasible(far, gc).status == aa.Status.UNREACHABLE
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[3], upper[3] = 0.5, 1.0
    assert arm.with_(lower=lower, upper=upper).feasible(pose, 2).status == aa.Status.ELBOW_LIMIT
    assert arm.with_(singularity_margin=1.4).feasible(pose, gc).status == aa.Status.ELBOW_MARGIN
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[0], upper[0] = 3.0, 3.1
    assert arm.with_(lower=lower, upper=upper).feasible(pose, gc).status == aa.Status.LIMITS
