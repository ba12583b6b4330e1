"""Where a plan begins, and what it may cost: starts as robots have them, and limits of many turns."""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import pytest
from support.planned_arms import IIWA

import armangle as aa

CALM = np.array([0.1, 0.6, 0.2, -1.2, 0.3, 0.8, 0.5])
MOST_SECONDS, MOST_MEGABYTES = 2.0, 200


def plain_line(start: np.ndarray = CALM) -> aa.Line:
    """15 cm from a posture of the iiwa."""
    first = IIWA.forward(start)[0]
    last = first.copy()
    last[:3, 3] += [0.05, 0.12, -0.07]
    return aa.Line(first, last)


@pytest.mark.parametrize("off", [0.005, 0.011, 0.02, 0.03, 0.045])
@pytest.mark.parametrize("which", ["start", "goal"])
def test_a_start_beside_the_first_pose_is_taken_to_it(off: float, which: str) -> None:
    rng = np.random.default_rng(7)
    line = plain_line()
    path = line if which == "start" else aa.Line(line.end, line.start)
    for _ in range(6):
        beside = CALM + rng.uniform(-1, 1, 7) * off
        result = aa.plan(IIWA, path, **{which: beside}, samples=20)
        assert result.certified, result.explain()
        at = result.q[0 if which == "start" else -1]
        assert np.abs(at - beside).max() <= aa.motion.planning.START_GAP
        np.testing.assert_allclose(IIWA.forward(at)[0], line.start, atol=1e-12)


def test_how_fast_a_start_is_left_does_not_count() -> None:
    """Of many rows the first is a short way: a posture near its limit is left within a few of them."""
    near = CALM.copy()
    near[6] = IIWA.upper[6] - 0.001
    hurried = aa.Objective(limits=1e5)
    result = aa.plan(IIWA, plain_line(near), start=near, samples=10000, objective=hurried)
    assert result.certified
    assert np.abs(result.derivatives(1e-5)[0]).max() > 1e3
    np.testing.assert_allclose(result.q[0], near, atol=1e-9)


def wide(limits: dict[int, float]) -> aa.Arm:
    """The iiwa with other limits, deg, of some joints."""
    lower, upper = IIWA.lower.copy(), IIWA.upper.copy()
    for joint, limit in limits.items():
        lower[joint - 1], upper[joint - 1] = -np.radians(limit), np.radians(limit)
    return IIWA.with_(lower=lower, upper=upper)


@pytest.mark.parametrize("limit", [360, 540, 720, 1080])
def test_many_turns_cost_little_and_lose_nothing(limit: float) -> None:
    arm = wide(dict.fromkeys((1, 3, 5, 7), limit))
    before = time.process_time()
    result = aa.plan(arm, plain_line())
    assert time.process_time() - before < MOST_SECONDS
    assert result.certified
    own = aa.plan(IIWA, plain_line()).diagnosis.branches[0]
    assert result.diagnosis.branches[0].cost <= own.cost * (1 + 1e-6)


def test_turns_that_a_path_uses_up_are_found() -> None:
    """Five turns of the tool about its axis: joint 7 must begin more than two turns before its middle."""
    arm = wide({7: 1000})
    first = arm.forward(CALM)[0]
    path = aa.Screw(first, first[:3, 3], first[:3, 2], 10 * np.pi)
    result = aa.plan(arm, path)
    assert result.certified, result.explain()
    assert result.q[0, 6] < -10 and result.q[-1, 6] > 10


def test_infinite_limits_on_one_side_cost_little() -> None:
    arm = IIWA.with_(lower=np.full(7, -np.inf), upper=np.full(7, 3.0))
    before = time.process_time()
    assert aa.plan(arm, plain_line().pose(np.linspace(0, 1, 250))).certified
    assert time.process_time() - before < MOST_SECONDS


def test_the_hardest_limits_stay_within_a_budget_of_memory() -> None:
    """In a process of its own, whose peak is its own."""
    program = """
import resource, time, numpy as np, armangle as aa
def peak(): return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
q = np.array([0.1, 0.6, 0.2, -1.2, 0.3, 0.8, 0.5])
first = arm.forward(q)[0]
last = first.copy()
last[:3, 3] += [0.05, 0.12, -0.07]
poses = aa.Line(first, last).pose(np.linspace(0, 1, 250))
aa.plan(arm, poses[:3])
before = peak()
for joint in (2, 4):
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[joint], upper[joint] = q[joint] - 1e-5, q[joint] + 1e-5
    now = time.process_time()
    aa.plan(arm.with_(lower=lower, upper=upper), poses, start=q)
    print(time.process_time() - now, peak() - before)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    for seconds, megabytes in (map(float, line.split()) for line in done.stdout.splitlines()):
        assert seconds < MOST_SECONDS and megabytes < MOST_MEGABYTES, done.stdout
