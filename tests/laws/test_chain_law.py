"""The law of `make chain` on a few circles, and what it found."""

from __future__ import annotations

import numpy as np
import pytest
from support.calibrated import ARMS, NAMES, calibrated, off_singular, postures
from support.chain_law import Case, Verdict, cases, drawn, judge
from support.draw import count, generator

from armangle.models.catalogue import srs_catalogue


@pytest.mark.slow
def test_proven_arcs_beside_brute_force() -> None:
    """Arcs of calibrated arms agree with joints by brute force in all decided samples."""
    total, rng = Verdict(), generator(81)
    for case in cases(1, count(len(srs_catalogue()))):
        total.add(judge(case, rng, 60))
    assert not total.wrong, total.wrong[:3]
    assert total.inside > 200 and total.decided > 1500 and total.by_newton > 50


@pytest.mark.parametrize(
    ("seed", "number", "name"),
    [
        (1283, 3, "barrett_wam7"), (5184, 37, "schunk_lwa4d"), (5342, 37, "schunk_lwa4d"),
        (30088, 9, "fourier_gr2t2v2_left"),
    ],
)  # fmt: skip
def test_a_psi_with_two_postures_of_one_branch_is_left_out(seed: int, number: int, name: str) -> None:
    """Where a psi has two solutions in one branch, of which one breaks a limit, the arcs leave it out as
    unproven.
    """
    case = drawn(seed, number, name)
    assert case is not None and not judge(case, generator(84), 300).wrong
    assert case.arm.feasible(case.pose, case.gc).unproven > 0


def test_the_inverse_leads_all_over_an_arc_beside_a_singularity() -> None:
    """`inverse` has joints all along the arcs of four poses near singularities."""
    asked = [drawn(3, 29, "rainbow_rby1_leader_right"), drawn(90007, 14, "iit_icub_left")]
    asked.append(drawn(90026, 32, "realman_rm75_b"))
    arm = ARMS["iit_icub_left 2.0 mm"]
    pose = arm.forward(np.random.default_rng([22, 78]).uniform(arm.lower, arm.upper, (79, 7))[78])[0]
    asked += [Case(arm, f"branch {gc}", pose, gc) for gc in range(8)]
    for case in asked:
        assert case is not None
        for lower, upper in case.arm.feasible(case.pose, case.gc).intervals:
            psi = np.linspace(lower, upper, 500)[1:-1]
            q = case.arm.inverse(case.pose, psi, case.gc, on_error="nan", limits=False)
            assert np.isfinite(q).all(), (case.name, lower, upper)


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("size", [0.1, 1.0])
def test_circles_off_the_singular_are_proven_all_round(name: str, size: float) -> None:
    """Arcs of a calibrated arm are proven whole if no psi is within 2 degrees of a singularity."""
    arm, psi, off = calibrated(name, size, size), np.linspace(-np.pi, np.pi, 500), 0
    poses, _, branch = arm.forward(postures(arm, count(300), 85))
    left = np.asarray(arm.feasible(poses, branch).unproven)
    assert left.mean() < 0.03 * 2 * np.pi
    for pose, gc, lost in zip(poses, branch, left, strict=True):
        q = arm.inverse(pose, psi, gc, on_error="nan", limits=False)
        if np.isfinite(q).all() and off_singular(arm, q, np.radians(2)).all():
            assert lost == 0.0
            off += 1
    assert off > 0.3 * len(poses)


@pytest.mark.parametrize("name", ["kinova_movo", "kuka_iiwa7_r800"])
def test_narrow_limits_about_a_joint_keep_its_arm_angle(name: str) -> None:
    """Limits of 0.01 rad about a joint leave its arm angle, or count it as unproven, also of an elbow with a
    gap d_4; within each interval `inverse` keeps them.
    """
    arm, rng, kept, asked = calibrated(name, 1.0, 1.0), generator(86), 0, count(42)
    for k in range(asked):
        q, joint = rng.uniform(-2.5, 2.5, 7), k % 7
        lower, upper = np.full((2, 7), [[-np.inf], [np.inf]])
        lower[joint], upper[joint] = q[joint] - 0.01, q[joint] + 0.01
        narrow = arm.with_(lower=lower, upper=upper)
        pose, psi, gc = narrow.forward(q)
        arcs = narrow.feasible(pose, gc)
        assert psi in arcs or arcs.unproven > 0
        kept += psi in arcs
        middles = arcs.intervals.mean(axis=1)
        assert np.isfinite(narrow.inverse(pose, middles, gc, on_error="nan")).all()
    assert kept > 0.8 * asked
