"""Laws of plan: what it returns is on the path and within limits between all rows, and it misses nothing."""

from __future__ import annotations

import numpy as np
import pytest
from support import draw
from support.brute_force import finds_a_way
from support.calibrated import ARMS as CALIBRATED
from support.moves import along, just_inside, line, moved, refused
from support.planned_arms import IIWA, TURNING, random_arm

import armangle as aa

DENSE = np.linspace(0, 1, 10001)
AMID = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])
CASES = draw.count(10)  # of a block


def random_case(seed: int) -> tuple[aa.Arm, aa.Path, np.ndarray | None]:
    """A random arm and path that begins at joints within the limits, and these joints or None."""
    rng = np.random.default_rng(seed)
    arm = random_arm(rng)
    q = rng.uniform(arm.lower + 0.05, arm.upper - 0.05)
    first = arm.forward(q)[0]
    path: aa.Path
    match rng.integers(0, 3):
        case 0:
            other = np.clip(q + rng.uniform(-0.7, 0.7, 7), arm.lower, arm.upper)
            path = aa.Line(first, arm.forward(other)[0])
        case 1:
            point = first[:3, 3] + rng.normal(size=3) * 0.15
            path = aa.Screw(first, point, rng.normal(size=3), rng.uniform(-2.5, 2.5), rng.uniform(-0.1, 0.1))
        case _:
            last = moved(first, rng.normal(size=3) * 0.2)
            path = aa.Line(first, last, "fixed")
    return arm, path, q if rng.integers(0, 2) else None


def check_continuous(result: aa.JointPath, s: np.ndarray, depth: int = 3) -> None:
    """Check by a closer look, `depth` times, that joints that move far between two s do not leap."""
    moves = np.abs(np.diff(result.at(s).q, axis=0)).max(axis=1)
    for at in np.flatnonzero(moves > 0.3):
        assert depth > 0, s[at]
        check_continuous(result, np.linspace(s[at], s[at + 1], 200), depth - 1)


def check_whole(result: aa.JointPath) -> None:
    """Check that a path that is ok is on its poses, continuous, within limits and in the branches it
    names.
    """
    arm, here = result.arm, result.at(DENSE)
    np.testing.assert_allclose(arm.forward(here.q)[0], here.pose, atol=1e-12)
    assert arm.within_limits(here.q, tol=1e-9).all()
    check_continuous(result, DENSE)
    if result.certified:
        assert len(result.uncertified) == 0
        assert (arm.forward(here.q)[2] == here.gc).all()
        assert result.diagnosis is not None
        first = result.diagnosis[int(result.gc[0])]
        assert set(here.gc.tolist()) - {first.gc} == set(first.through)
        assert arm.within_limits(here.q).all()


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("block", range(6))
def test_random_paths_against_brute_force(block: int) -> None:
    """A plan that is ok is whole; if it is not, a search on a grid 3 degrees within limits finds no way."""
    seen = {"whole": 0, "refused": 0}
    for seed in range(CASES * block, CASES * (block + 1)):
        arm, path, start = random_case(seed)
        result = aa.plan(arm, path, start=start, samples=50)
        if result.ok:
            seen["whole"] += 1
            check_whole(result)
            if start is not None:
                np.testing.assert_allclose(result.q[0], start, atol=1e-9)
            continue
        seen["refused"] += 1
        branches = range(8) if start is None else [int(arm.forward(start)[2])]
        ways = [gc for gc in branches if finds_a_way(arm, path, gc, np.radians(3), start)]
        assert ways == [], (seed, result.explain())
    assert min(seen.values()) > 0


def test_the_papers_example() -> None:
    """The paper's posture and a line from there: certified, in branch 3."""
    q = np.radians([-160.0, -54.0, -99.0, -69.0, -92.0, 93.0, -139.0])
    result = aa.plan(IIWA, line(IIWA, q, [0.02, -0.05, 0.04]), start=q)
    assert result.certified
    check_whole(result)
    assert result.gc[0] == 3


@pytest.mark.parametrize("offset", [0.0, 1e-7, 1e-4])
def test_over_the_base_axis_the_joints_hardly_move(offset: float) -> None:
    """A plan over the base axis moves joints evenly though psi turns by over 1 rad; `follow` too."""
    first = aa.pose([0.026, offset, 0.85], matrix=[[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    poses = along(first, [0.2, 0, 0], 101)
    result = aa.plan(IIWA, poses)
    assert result.certified
    check_whole(result)
    assert np.abs(np.diff(result.q, axis=0)).max() < 0.005
    assert np.abs(np.diff(result.psi)).max() > 1.0  # the paper's psi turns there all the same
    again = IIWA.inverse(result.poses, result.psi, result.gc, limits=False)
    np.testing.assert_allclose(again, result.q, atol=1e-9)
    aside = IIWA.inverse(poses[0], result.psi[0] + 1.0, result.gc[0], limits=False)
    stepped = aa.follow(IIWA, poses, start=aside)
    assert stepped.ok
    assert np.abs(np.diff(stepped.q, axis=0)).max() < 0.03  # where psi cannot be held, the elbow is


@pytest.mark.turns(2)
@pytest.mark.parametrize("turns", [1.7, 1.2, -1.4])
def test_a_tool_that_turns_more_than_once(turns: float) -> None:
    """Plans turn the tool several times if joint 7's limits allow it, and say if not."""
    q = np.array([0.2, 0.6, 0.1, -1.3, 0.2, 0.9, -np.sign(turns) * 5.5])
    path = turning(TURNING.forward(q)[0], turns)
    for start in (None, q):
        result = aa.plan(TURNING, path, start=start)
        assert result.certified
        check_whole(result)
        assert abs(abs(result.q[-1, 6] - result.q[0, 6]) - abs(turns) * 2 * np.pi) < 1.0
    if abs(turns) > 1.5:
        late = aa.plan(TURNING, path, start=q + np.sign(turns) * 2 * np.pi * np.eye(7)[6])
        assert not late.ok and 0 < late.diagnosis.reached < 1
    farther = aa.plan(TURNING, turning(path.pose(0.0), 2.5))
    assert not farther.ok and not farther.certified
    endless = aa.plan(TURNING.with_(lower=None, upper=None), turning(path.pose(0.0), 4.5))
    assert endless.certified
    check_whole(endless)


def turning(pose: np.ndarray, turns: float) -> aa.Screw:
    """A path on which the tool turns `turns` times about its own z axis."""
    return aa.Screw(pose, pose[:3, 3], pose[:3, 2], turns * 2 * np.pi)


def left_open(path: aa.Path, s: np.ndarray) -> list[list[float]]:
    """The intervals of s where the curve through joints AMID at all these s is not certified."""
    _, psi, gc = IIWA.forward(AMID)
    kept = np.tile(AMID, (len(s), 1)), np.full(len(s), psi), np.full(len(s), gc)
    plane, stretches, _ = IIWA._handle.curve_through(path._segments, s, *kept)
    open_, _ = IIWA._handle.certify_curve(path._segments, stretches, plane, int(gc), 0.0)
    return open_.tolist()


@pytest.mark.parametrize("turns", [1, 8, 40])
def test_what_is_wrong_between_coarse_samples_alone_is_never_certified(turns: int) -> None:
    """Rows that are right do not certify a curve that leaves the path or its limits between them."""
    pose = IIWA.forward(AMID)[0]
    path = aa.Screw(pose, pose[:3, 3] + [0.0, 0.0, 0.3], [1.0, 0.0, 0.0], turns * 2 * np.pi)
    assert left_open(path, np.arange(turns + 1) / turns) == [[0.0, 1.0]]
    assert not aa.plan(IIWA, path, samples=turns + 1).ok
    still = aa.Waypoints(np.repeat(pose[None], 9, axis=0))
    assert not left_open(still, np.arange(9) / 8) and left_open(still, np.array([0.0, 0.3, 1.0]))


@pytest.mark.turns(2)
@pytest.mark.parametrize("seed", range(40))
def test_a_limit_put_just_inside_what_a_curve_needs_is_never_certified(seed: int) -> None:
    """A plan's curve is certified with limits just outside its joints' range, and not just inside."""
    arm, path, start = random_case(seed)
    result = aa.plan(arm, path, start=start, samples=20)
    if result.ok and result.curve is not None:
        moves = np.ptp(result.at(DENSE[::10]).q, axis=0) > 1e-3
        loose = 1e-2 if result.certified else None
        just_inside(result, np.flatnonzero(moves)[seed % 2 :: 2], lambda at: at > 0, loose)


def test_start_and_goal_are_met_with_their_windings() -> None:
    """A plan at one pose meets start and goal, turns of 2π included."""
    q0 = np.array([0.2, 0.6, 0.1, -1.3, 0.2, 0.9, -4.0])
    pose, psi, gc = TURNING.forward(q0)
    q1 = TURNING.inverse(pose, psi + 0.8, gc, seed=q0, limits=False)
    result = aa.plan(TURNING, np.stack([pose, pose]), start=q0, goal=q1)
    assert result.certified
    np.testing.assert_allclose(result.q, [q0, q1], atol=1e-9)


@pytest.mark.parametrize("arm", [IIWA, CALIBRATED["kuka_iiwa7_r800 2.0 mm"]], ids=["exact", "calibrated"])
def test_paths_of_follow_have_values_between_their_rows(arm: aa.Arm) -> None:
    """`at` of a followed motion holds the pose between its rows; of one that failed it raises."""
    poses = along(arm.forward(AMID)[0], [0.03, -0.1, 0.05], 40)
    path = aa.follow(arm, poses, start=AMID)
    here = path.at(DENSE)
    np.testing.assert_allclose(arm.forward(here.q)[0], here.pose, atol=1e-12)
    np.testing.assert_allclose(path.at(path.s).q, path.q, atol=1e-9)
    assert path.ok and not path.certified
    poses[20:, 0, 3] += 1.0
    said = "the path has no values between its rows"
    refused(aa.PathError, said, aa.follow(arm, poses, start=AMID).at, 0.5)


def test_refusals() -> None:
    """`plan` refuses bad arguments, and says which and what was wanted."""
    pose = IIWA.forward(AMID)[0]
    path, still = aa.Waypoints(pose[None]), aa.Line(pose, pose)
    other, beyond = AMID + np.array([0, 0.3, 0, 0.2, 0, 0, 0]), AMID + 4.0 * np.eye(7)[6]
    for said, way, given in (
        ("start belongs to another pose than the path's: a joint is", path, {"start": other}),
        (r"start: joint 7 is 4\.5 rad .*82\.83 deg outside its limits", path, {"start": beyond}),
        ("goal belongs to another pose", path, {"goal": other}),
        (r"start has shape \(1, 7\), wanted \(7,\)", path, {"start": AMID[None]}),
        (r"goal\[0\] is nan, wanted finite angles in rad", path, {"goal": AMID * np.nan}),
        ("gc is 8, wanted an integer from 0 to 7", path, {"gc": 8}),
        ("samples is 1, wanted an integer from 2 to 10000000", still, {"samples": 1}),
        ("samples is 10000000000, wanted an integer from 2 to 10000000", still, {"samples": 10**10}),
        (r"path has shape \(4, 4\), wanted a Path, or poses \(N, 4, 4\)", pose, {}),
        (r"limit_margin \(rad\) is 2\.5, wanted at most 2\.0944", path, {"limit_margin": 2.5}),
    ):
        refused(aa.InputError, said, aa.plan, IIWA, way, **given)
    refused(aa.InputError, "travel is -1, wanted a number", aa.Objective, travel=-1)


@pytest.mark.turns(2)
@pytest.mark.parametrize("shift", [(0.1, 0, 0), (0, 0.1, 0), (0, 0, -0.1), (-0.1, 0.05, -0.1)])
@pytest.mark.parametrize("q", [
    (0.3, 0, 0.2, -1.2, 0.3, 0.8, 0.1), (0, 0, 0, -1.2, 0, 0.8, 0), (0.3, 0.4, 0.2, -1.2, 0.3, 0, 0.1),
    (0, 0, 0, 0, 0, 0, 0), (0.2, 0.5, 0.3, 0, 0.4, 0.6, 0),
])  # fmt: skip
def test_a_singular_start_is_held_or_refused(q: tuple[float, ...], shift: tuple[float, ...]) -> None:
    """A plan from a singular start begins there without a leap, or fails and explains."""
    result = aa.plan(IIWA, line(IIWA, q, shift), start=q)
    assert result.explain()
    assert not result.ok or np.abs(result.at([0.0, 1e-6]).q - q).max() <= 0.01


def test_what_is_not_proven_is_said() -> None:
    """A plan from an arm stretched upward is ok, not certified, and `explain` says where."""
    start = np.zeros(7)
    first = IIWA.forward(start, on_error="nan")[0]
    last = IIWA.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0]
    result = aa.plan(IIWA, aa.Line(first, last), start=start)
    assert result.ok and not result.certified
    assert "Between them it is not proven for s from 0 to " in result.explain()
