"""Laws of plan: what it returns is on the path and within limits between all rows, and it misses nothing."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from support import draw
from support.brute_force import finds_a_way, margins
from support.planned_arms import IIWA, TURNING, random_arm

import armangle as aa

DENSE = np.linspace(0, 1, 10001)
THREE_DEGREES = np.radians(3)
CASES = draw.count(10)  # of a block


def random_case(seed: int) -> tuple[aa.Arm, aa.Path, np.ndarray | None]:
    """An arm, a path that begins at a posture within limits, and that posture or None."""
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
            last = first.copy()
            last[:3, 3] += rng.normal(size=3) * 0.2
            path = aa.Line(first, last, "fixed")
    return arm, path, q if rng.integers(0, 2) else None


def check_continuous(result: aa.JointPath, s: np.ndarray, depth: int = 3) -> None:
    """Where joints move far from one s to the next, a closer look shows smaller moves: fast, not broken."""
    moves = np.abs(np.diff(result.at(s).q, axis=0)).max(axis=1)
    for at in np.flatnonzero(moves > 0.3):
        assert depth > 0, s[at]
        check_continuous(result, np.linspace(s[at], s[at + 1], 200), depth - 1)


def check_whole(result: aa.JointPath) -> None:
    """A path that is ok is on its poses, in the branches named, continuous and within limits, everywhere."""
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


@pytest.mark.slow
@pytest.mark.parametrize("block", range(6))
def test_random_paths_against_brute_force(block: int) -> None:
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
        ways = [gc for gc in branches if finds_a_way(arm, path, gc, THREE_DEGREES, start)]
        assert ways == [], (seed, result.explain())
    assert min(seen.values()) > 0


def test_the_papers_example() -> None:
    q = np.radians([-160.0, -54.0, -99.0, -69.0, -92.0, 93.0, -139.0])
    first = IIWA.forward(q)[0]
    last = first.copy()
    last[:3, 3] += [0.02, -0.05, 0.04]
    result = aa.plan(IIWA, aa.Line(first, last), start=q)
    assert result.certified
    check_whole(result)
    assert result.gc[0] == 3


@pytest.mark.parametrize("offset", [0.0, 1e-7, 1e-4])
def test_over_the_base_axis_the_joints_hardly_move(offset: float) -> None:
    first = np.eye(4)
    first[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    first[:3, 3] = [0.026, offset, 0.85]
    last = first.copy()
    last[0, 3] += 0.2
    poses = aa.Line(first, last).pose(np.linspace(0, 1, 101))
    result = aa.plan(IIWA, poses)
    assert result.certified
    check_whole(result)
    assert np.abs(np.diff(result.q, axis=0)).max() < 0.005
    assert np.abs(np.diff(result.psi)).max() > 1.0  # the paper's psi turns there all the same
    np.testing.assert_allclose(
        IIWA.inverse(result.poses, result.psi, result.gc, limits=False), result.q, atol=1e-9
    )
    aside = IIWA.inverse(poses[0], result.psi[0] + 1.0, result.gc[0], limits=False)
    stepped = aa.follow(IIWA, poses, start=aside)
    assert stepped.ok
    assert np.abs(np.diff(stepped.q, axis=0)).max() < 0.03  # where psi cannot be held, the elbow is


@pytest.mark.parametrize("turns", [1.2, 1.7, -1.4])
def test_a_tool_that_turns_more_than_once(turns: float) -> None:
    q = np.array([0.2, 0.6, 0.1, -1.3, 0.2, 0.9, -np.sign(turns) * 5.5])
    pose = TURNING.forward(q)[0]
    path = aa.Screw(pose, pose[:3, 3], pose[:3, 2], turns * 2 * np.pi)
    for start in (None, q):
        result = aa.plan(TURNING, path, start=start)
        assert result.certified
        check_whole(result)
        assert abs(abs(result.q[-1, 6] - result.q[0, 6]) - abs(turns) * 2 * np.pi) < 1.0
    wrong_winding = q + np.array([0, 0, 0, 0, 0, 0, np.sign(turns) * 2 * np.pi])
    if abs(turns) > 1.5:
        refused = aa.plan(TURNING, path, start=wrong_winding)
        assert not refused.ok
        assert 0 < refused.diagnosis.reached < 1


def test_a_tool_that_turns_farther_than_the_joint_is_refused() -> None:
    pose = TURNING.forward([0.2, 0.6, 0.1, -1.3, 0.2, 0.9, 0.0])[0]
    result = aa.plan(TURNING, aa.Screw(pose, pose[:3, 3], pose[:3, 2], 2.5 * 2 * np.pi))
    assert not result.ok
    assert not result.certified
    free = TURNING.with_(lower=None, upper=None)
    endless = aa.plan(free, aa.Screw(pose, pose[:3, 3], pose[:3, 2], 4.5 * 2 * np.pi))
    assert endless.certified
    check_whole(endless)


def excursions(count: int, turns: int) -> tuple[aa.Screw, np.ndarray]:
    """A tool that goes round a wide circle `turns` times, and s at which it is always in the same place."""
    pose = IIWA.forward([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])[0]
    point = pose[:3, 3] + [0.0, 0.0, 0.3]
    return aa.Screw(pose, point, [1.0, 0.0, 0.0], turns * 2 * np.pi), np.arange(count + 1) / count


@pytest.mark.parametrize("turns", [1, 8, 40])
def test_limits_crossed_only_between_coarse_samples_are_never_certified(turns: int) -> None:
    path, s = excursions(turns, turns)
    q = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])
    _, psi, gc = IIWA.forward(q)
    rows = np.tile(q, (len(s), 1))
    kept = np.full(len(s), psi), np.full(len(s), gc)
    plane, stretches, _ = IIWA._handle.curve_through(path._segments, s, rows, *kept)
    open_, _ = IIWA._handle.certify_curve(path._segments, stretches, plane, int(gc), 0.0)
    assert open_.tolist() == [[0.0, 1.0]]
    assert not aa.plan(IIWA, path, samples=turns + 1).ok


def test_a_curve_that_skips_the_joints_of_its_path_is_not_certified() -> None:
    q = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])
    pose, psi, gc = IIWA.forward(q)
    path = aa.Waypoints(np.repeat(pose[None], 9, axis=0))
    for s, proven in ((np.arange(9) / 8, True), (np.array([0.0, 0.3, 1.0]), False)):
        rows = np.tile(q, (len(s), 1))
        kept = np.full(len(s), psi), np.full(len(s), gc)
        plane, stretches, _ = IIWA._handle.curve_through(path._segments, s, rows, *kept)
        open_, _ = IIWA._handle.certify_curve(path._segments, stretches, plane, int(gc), 0.0)
        assert (len(open_) == 0) == proven


@pytest.mark.parametrize("seed", range(40))
def test_a_limit_put_just_inside_what_a_curve_needs_is_never_certified(seed: int) -> None:
    arm, path, start = random_case(seed)
    result = aa.plan(arm, path, start=start, samples=20)
    if not result.ok or result.curve is None:
        return
    curve, rng = result.curve, np.random.default_rng(seed)
    arrays = curve.segments, curve.stretches, curve.plane
    q = result.at(DENSE).q
    joint = int(rng.integers(0, 7))
    extreme = q[:, joint].argmax()
    if q[extreme, joint] - q[0, joint] < 1e-3:
        return
    upper = arm.upper.copy()
    upper[joint] = q[extreme, joint] - 1e-6
    tight = arm.with_(upper=upper)
    open_, _ = tight._handle.certify_curve(*arrays, curve.gc, 0.0)
    assert any(low <= DENSE[extreme] <= high for low, high in open_)
    upper[joint] = q[extreme, joint] + 1e-2
    if result.certified:
        loose = arm.with_(upper=np.minimum(upper, arm.upper))
        open_, _ = loose._handle.certify_curve(*arrays, curve.gc, 0.0)
        assert len(open_) == 0


def test_margins_asked_are_kept_between_the_rows() -> None:
    q = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])
    first = IIWA.forward(q)[0]
    last = first.copy()
    last[:3, 3] += [0.05, -0.35, 0.1]
    margin = np.radians(8)
    result = aa.plan(IIWA.with_(singularity_margin=margin), aa.Line(first, last), limit_margin=margin)
    assert result.certified
    assert margins(IIWA, result.at(DENSE).q).min() > margin


def test_start_and_goal_are_met_with_their_windings() -> None:
    q0 = np.array([0.2, 0.6, 0.1, -1.3, 0.2, 0.9, -4.0])
    pose, psi, gc = TURNING.forward(q0)
    q1 = TURNING.inverse(pose, psi + 0.8, gc, seed=q0, limits=False)
    result = aa.plan(TURNING, np.stack([pose, pose]), start=q0, goal=q1)
    assert result.certified
    np.testing.assert_allclose(result.q, [q0, q1], atol=1e-9)


def test_one_pose_equal_poses_and_none() -> None:
    pose = IIWA.forward([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])[0]
    one = aa.plan(IIWA, pose[None])
    assert one.certified and one.q.shape == (1, 7)
    np.testing.assert_allclose(IIWA.forward(one.q[0])[0], pose, atol=1e-12)
    same = aa.plan(IIWA, np.repeat(pose[None], 6, axis=0))
    assert same.certified and np.abs(np.diff(same.q, axis=0)).max() < 0.05
    none = aa.plan(IIWA, np.empty((0, 4, 4)))
    assert none.ok and len(none) == 0 and not none.certified and len(none.uncertified) == 0
    assert repr(none) == "<JointPath of 0 poses, ok>" and none.explain() == "There is no pose."


def plain_line() -> aa.Line:
    """A line that the iiwa follows easily."""
    ends = [[0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5], [0.5, 0.5, 0.2, -1.2, 0.4, 0.9, 0.2]]
    return aa.Line(*IIWA.forward(ends)[0])


def test_rows_are_at_exactly_the_poses_and_at_agrees_with_them() -> None:
    poses = plain_line()
    given = poses.pose(np.linspace(0, 1, 30))
    result = aa.plan(IIWA, given)
    assert np.array_equal(result.poses, given)
    np.testing.assert_allclose(IIWA.forward(result.q)[0], given, atol=1e-12)
    assert np.array_equal(result.at(result.s).q, result.q)
    assert result.at(0.3).q.shape == (7,)
    assert result.at(np.zeros((2, 3))).pose.shape == (2, 3, 4, 4)
    assert len(aa.plan(IIWA, poses, samples=17)) == 17


def test_derivatives_in_closed_form_are_limits_of_differences() -> None:
    result = aa.plan(IIWA, plain_line())
    assert result.curve is not None
    knots, h = result.curve.knots, 1e-5
    s = np.linspace(0.01, 0.99, 301)
    s = s[np.abs(s[:, None] - knots).min(axis=1) > 2 * h]
    exact = result.derivatives(s)
    first = (result.at(s + h).q - result.at(s - h).q) / (2 * h)
    np.testing.assert_allclose(exact[:, 0], first, atol=1e-6)
    for order in (1, 2):
        rate = (result.derivatives(s + h) - result.derivatives(s - h))[:, order - 1] / (2 * h)
        np.testing.assert_allclose(exact[:, order], rate, rtol=1e-4, atol=1e-3)
    across = result.derivatives(knots[1:-1] + 1e-9) - result.derivatives(knots[1:-1] - 1e-9)
    assert np.abs(across[:, 0]).max() < 1e-5  # q' and q'' are continuous over the knots
    assert np.abs(across[:, 1]).max() < 1e-2


def test_results_are_the_same_every_time_and_survive_pickling() -> None:
    one, two = aa.plan(IIWA, plain_line()), aa.plan(IIWA, plain_line())
    assert np.array_equal(one.q, two.q)
    again = pickle.loads(pickle.dumps(one.curve))
    assert np.array_equal(again.at(IIWA._handle, one.s).q, one.q)


def test_paths_of_follow_have_values_between_their_rows() -> None:
    q = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])
    first = IIWA.forward(q)[0]
    last = first.copy()
    last[:3, 3] += [0.03, -0.1, 0.05]
    poses = aa.Line(first, last).pose(np.linspace(0, 1, 40))
    path = aa.follow(IIWA, poses, start=q)
    here = path.at(DENSE)
    np.testing.assert_allclose(IIWA.forward(here.q)[0], here.pose, atol=1e-12)
    np.testing.assert_allclose(path.at(path.s).q, path.q, atol=1e-9)
    assert not path.certified
    poses[20:, 0, 3] += 1.0
    with pytest.raises(aa.PathError, match="the path has no values between its rows"):
        aa.follow(IIWA, poses, start=q).at(0.5)


def test_refusals() -> None:
    q = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])
    pose = IIWA.forward(q)[0]
    path = aa.Waypoints(pose[None])
    other = q + np.array([0, 0.3, 0, 0.2, 0, 0, 0])
    with pytest.raises(aa.InputError, match="start belongs to another pose than the path's: a joint is"):
        aa.plan(IIWA, path, start=other)
    beyond = q + np.array([0, 0, 0, 0, 0, 0, 4.0])
    with pytest.raises(aa.InputError, match=r"start: joint 7 is 4\.5 rad .*82\.83 deg outside its limits"):
        aa.plan(IIWA, path, start=beyond)
    with pytest.raises(aa.InputError, match="goal belongs to another pose"):
        aa.plan(IIWA, path, goal=other)
    with pytest.raises(aa.InputError, match=r"start has shape \(1, 7\), wanted \(7,\)"):
        aa.plan(IIWA, path, start=q[None])
    with pytest.raises(aa.InputError, match=r"goal\[0\] is nan, wanted finite angles in rad"):
        aa.plan(IIWA, path, goal=q * np.nan)
    with pytest.raises(aa.InputError, match="gc is 8, wanted integers from 0 to 7"):
        aa.plan(IIWA, path, gc=8)
    with pytest.raises(aa.InputError, match="samples is 1, wanted an integer from 2 to 10000000"):
        aa.plan(IIWA, aa.Line(pose, pose), samples=1)
    with pytest.raises(aa.InputError, match="samples is 10000000000, wanted an integer from 2 to 10000000"):
        aa.plan(IIWA, aa.Line(pose, pose), samples=10**10)
    with pytest.raises(aa.InputError, match=r"path has shape \(4, 4\), wanted a Path, or poses \(N, 4, 4\)"):
        aa.plan(IIWA, pose)
    with pytest.raises(aa.InputError, match=r"limit_margin \(rad\) is 2\.5, wanted at most 2\.0944"):
        aa.plan(IIWA, path, limit_margin=2.5)
    with pytest.raises(aa.InputError, match="travel is -1, wanted a number"):
        aa.Objective(travel=-1)


@pytest.mark.parametrize("shift", [(0.1, 0, 0), (0, 0.1, 0), (0, 0, -0.1), (-0.1, 0.05, -0.1)])
@pytest.mark.parametrize(
    "q",
    [
        (0.3, 0, 0.2, -1.2, 0.3, 0.8, 0.1),
        (0, 0, 0, -1.2, 0, 0.8, 0),
        (0.3, 0.4, 0.2, -1.2, 0.3, 0, 0.1),
        (0, 0, 0, 0, 0, 0, 0),
        (0.2, 0.5, 0.3, 0, 0.4, 0.6, 0),
    ],
)
def test_a_singular_start_is_held_or_refused(q: tuple[float, ...], shift: tuple[float, ...]) -> None:
    first = IIWA.forward(q)[0]
    last = first.copy()
    last[:3, 3] += shift
    result = aa.plan(IIWA, aa.Line(first, last), start=q)
    if result.ok:
        assert np.abs(result.at([0.0, 1e-6]).q - q).max() <= 0.01
    else:
        assert result.explain()


def test_what_is_not_proven_is_said() -> None:
    """An arm stretched straight up is left infinitely fast, by joints that share their turn: not proven."""
    start = np.zeros(7)
    first = IIWA.forward(start, on_error="nan")[0]
    last = IIWA.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0]
    result = aa.plan(IIWA, aa.Line(first, last), start=start)
    assert result.ok and not result.certified
    assert "Between them it is not proven for s from 0 to " in result.explain()
