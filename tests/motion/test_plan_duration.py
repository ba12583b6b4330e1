"""An objective of duration: never slower than without, nor than an arm angle held; more weight, less time."""

from __future__ import annotations

import numpy as np
import pytest
from support.draw import COUNT, count
from support.moves import line, proven, refused
from support.plan_objective import free_lines
from support.planned_arms import IIWA

import armangle as aa

pytest.importorskip("scipy")
DURATION_ALONE = aa.Objective(travel=0, limits=0, singularities=0, duration=1.0)
POSTURE = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])
SAME = 1 + 2e-3
"""Two grids of s give times that differ by less."""


@pytest.mark.turns(3)
@pytest.mark.slow
@pytest.mark.parametrize("length, acceleration", [(0.2, 5.0), (0.2, 50.0), (0.5, 50.0)])
def test_never_slower_than_without_nor_than_an_angle_held(length: float, acceleration: float) -> None:
    """With Objective(duration) `retime` takes no longer than without, nor than a constant psi."""
    arm = IIWA.with_(acceleration=acceleration)
    gained = []
    for q, path, held in free_lines(IIWA, length, count(4 if COUNT else 2)):
        plain, fast = (
            aa.plan(arm, path, start=q, objective=aa.Objective(duration=weight)) for weight in (0.0, 100.0)
        )
        assert plain.certified and fast.certified
        by_hand = aa.retime(held, acceleration=acceleration).duration
        times = aa.retime(plain).duration, aa.retime(fast).duration
        assert times[1] <= times[0] * SAME
        alone = aa.plan(arm, path, start=q, objective=DURATION_ALONE)
        assert alone.certified
        assert max(times[1], aa.retime(alone).duration) <= by_hand * 1.02
        gained.append(times[1] / times[0])
    assert min(gained) < 0.99


@pytest.mark.turns(2)
@pytest.mark.parametrize(
    "name, q, shift",
    [
        ("kuka_iiwa7_r800", "2.1087 -0.2012 0.3024 -0.1678 1.4696 -1.3949 -0.9332", "0.0871 0.227 -0.1556"),
        ("openarm_v10", "-0.1232 -0.816 0.2795 0.3676 -1.1012 -0.2038 0.4914", "0.1451 0.0559 -0.1983"),
    ],
)
def test_duration_alone_takes_no_longer_than_an_angle_held(name: str, q: str, shift: str) -> None:
    """With duration alone in the objective a plan takes at most 2 % longer than a constant psi."""
    arm = aa.Arm.from_catalogue(name).with_(acceleration=5.0)
    start = np.array(q.split(), dtype=float)
    path = line(arm, start, np.array(shift.split(), dtype=float))
    planned = aa.plan(arm, path, start=start, objective=DURATION_ALONE)
    assert planned.certified
    for measured in (arm, arm.with_(reference="stereographic")):
        held = aa.follow(measured, path, start=start, policy=aa.Hold(), samples=200)
        assert not held.ok or aa.retime(planned).duration <= 1.02 * aa.retime(held).duration


def test_a_curve_that_bends_sharply_is_not_taken_for_a_fast_one() -> None:
    """A plan with a large weight of duration takes no longer than one without."""
    arm = IIWA.with_(acceleration=5.0)
    start = np.array([-1.52591, -0.34765, -2.346, -0.79589, -0.37414, -1.32057, 0.65074])
    path = line(arm, start, np.array([0.00451, -0.19471, 0.04546]))
    plain, fast = (aa.plan(arm, path, start=start, objective=aa.Objective(duration=w)) for w in (0.0, 100.0))
    assert aa.retime(fast).duration <= aa.retime(plain).duration * SAME


def test_more_weight_never_takes_longer() -> None:
    """The more weight on duration, the sooner `retime` of the plan ends."""
    arm = IIWA.with_(acceleration=50.0)
    path = line(arm, POSTURE, np.array([0.05, -0.35, 0.1]))
    times = [
        aa.retime(aa.plan(arm, path, start=POSTURE, objective=aa.Objective(duration=weight))).duration
        for weight in (0.0, 0.1, 1.0, 10.0, 100.0, 1000.0)
    ]
    assert (np.diff(times) <= 2e-3 * np.array(times[:-1])).all(), times
    assert times[-1] < 0.98 * times[0], times


def pace(arm: aa.Arm, q: np.ndarray) -> float:
    """The mean over rows of the 8-norm of joint speeds relative to their bounds."""
    slow = np.abs(np.diff(q, axis=0) * (len(q) - 1) / arm.velocity)
    return float(((slow**8).sum(axis=1) ** 0.125).mean())


def test_what_is_no_bound_is_refused() -> None:
    """Objective refuses bad accelerations; `plan` refuses duration for an arm without bounds."""
    for wrong in (0.0, -1.0, np.nan, [1.0, 2.0], "fast", True):
        refused(aa.ArmangleError, "acceleration", aa.Objective, duration=1.0, acceleration=wrong)
    plain = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1)
    first, asked = plain.forward(POSTURE)[0][None], aa.Objective(duration=1.0)
    refused(aa.InputError, "states no velocity or acceleration", aa.plan, plain, first, objective=asked)
    assert aa.plan(plain.with_(velocity=1.0), first, objective=asked).ok
    assert aa.plan(plain, first, objective=aa.Objective(duration=1.0, acceleration=2.0)).ok


@pytest.mark.parametrize("shift", [(0.05, -0.25, 0.1), (-0.1, 0.1, 0.2)])
def test_no_nearby_curve_has_less(shift: tuple[float, ...]) -> None:
    """Bumps of psi do not make the mean pace of a plan with weight on duration smaller."""
    path = line(IIWA, POSTURE, np.array(shift))
    asked = aa.Objective(limits=0, singularities=0, travel=1e-3, duration=10.0)
    result = aa.plan(IIWA, path, start=POSTURE, objective=asked)
    assert result.certified
    s = np.linspace(0, 1, 2001)
    here, poses = result.at(s), path.pose(s)
    own = pace(IIWA, here.q)
    rng = np.random.default_rng(3)
    for _ in range(8):
        at, width = rng.uniform(0, 1), rng.uniform(0.15, 0.5)
        bump = np.exp(-(((s - at) / width) ** 2)) * s
        for size in (-0.02, 0.02):
            q = IIWA.inverse(poses, here.psi + size * bump, here.gc, seed=here.q, limits=False)
            assert pace(IIWA, q) > own * (1 - 1e-3)


@pytest.mark.parametrize("hardest", [5.0, (5.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)])
def test_accelerations_of_the_objective_are_as_the_arms_own(hardest: float | tuple[float, ...]) -> None:
    """Objective(acceleration) has the effect of the arm's own; it compares, hashes and prints."""
    path = line(IIWA, POSTURE, np.array([0.05, -0.35, 0.1]))
    asked, plain = aa.Objective(duration=100.0, acceleration=hardest), aa.Objective(duration=100.0)
    given = aa.plan(IIWA, path, start=POSTURE, objective=asked)
    stated = aa.plan(IIWA.with_(acceleration=hardest), path, start=POSTURE, objective=plain)
    speeds = aa.plan(IIWA, path, start=POSTURE, objective=plain)
    assert np.array_equal(given.q, stated.q)
    assert not np.array_equal(given.q, speeds.q)
    assert asked == aa.Objective(duration=100.0, acceleration=np.array(hardest))
    assert hash(asked) == hash(aa.Objective(duration=100.0, acceleration=hardest))
    assert eval(repr(asked), {"Objective": aa.Objective}) == asked


def test_a_path_of_a_micrometre_is_planned_too() -> None:
    """A plan of a line of a micrometre is certified, with any objective."""
    arm = aa.Arm.from_catalogue("kuka_med14_r820")
    start = np.array([-2.96705, 1.151162, 0.824783, 1.303275, 0.552313, -0.307864, -1.165612])
    way = line(arm, start, [1.1e-6, -7e-7, 8e-7])
    for objective in (aa.Objective(), aa.Objective(duration=100, acceleration=5.0)):
        proven(aa.plan(arm, way, start=start, psi=1.7429, objective=objective), start)
