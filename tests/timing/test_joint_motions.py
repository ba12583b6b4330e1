"""Motions that are led by the joints: from posture to posture, and splines through rows."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from support.moves import moved, refused
from support.needs import need

import armangle as aa
from armangle.motion.joint_path import Between
from armangle.timing import rounding
from armangle.timing.motion import breaks

Floats = NDArray[np.float64]
ARM = aa.Arm.from_catalogue("kuka_iiwa14_r820")
OFFSET = aa.Arm.from_catalogue("franka_fr3")
A = 5.0


def kept(found: aa.Trajectory, velocity: Floats, a: float, j: float | None) -> None:
    """Check that a trajectory keeps bounds (rad/s, rad/s², rad/s³) between its rows, and rests at
    both ends.
    """
    t = np.linspace(0.0, found.duration, 2001)
    h = t[1]
    speed = np.diff(found.at(t).q, axis=0) / h
    change = np.diff(speed, axis=0) / h
    assert (np.abs(speed) <= velocity * (1 + 1e-6)).all()
    assert np.abs(change).max() <= a * 1.002
    if j is not None:
        assert np.abs(np.diff(change, axis=0)).max() / h <= j * 1.01
    assert np.abs(found.qd[[0, -1]]).max() < 1e-9


@pytest.fixture
def rng() -> np.random.Generator:
    """Return the same draws for every test, whatever ran before."""
    return np.random.default_rng(7)


def ramp(v: float, a: float, j: float) -> float:
    """Return the time that a ramp from rest to speed v takes, without acceleration at both ends.

    Its jerk is j, its acceleration up to a if it comes to that.
    """
    return v / a + a / j if v * j >= a * a else 2 * np.sqrt(v / j)


def least_time(way: Floats, velocity: Floats, a: float, j: float) -> float:
    """Return the least duration of a straight way of joints: the greatest speed by halving."""
    v, a, j = (
        float((bound / np.maximum(way, 1e-100)).min()) for bound in (velocity, np.full(7, a), np.full(7, j))
    )
    if v * ramp(v, a, j) <= 1:
        return 2 * ramp(v, a, j) + (1 - v * ramp(v, a, j)) / v
    low, high = 0.0, v
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if middle * ramp(middle, a, j) < 1 else (low, middle)
    return 2 * ramp(low, a, j)


def pair(rng: np.random.Generator, arm: aa.Arm, size: float) -> Floats:
    """Random joints, and others at the share `size` of the way from there to the next random ones."""
    first, last = (
        rng.uniform(arm.lower * 0.9, arm.upper * 0.9, (2, 7))
        if arm is ARM
        else rng.uniform(arm.lower * 0.9 + arm.upper * 0.1, arm.upper * 0.9 + arm.lower * 0.1, (2, 7))
    )
    return np.array([first, first + size * (last - first)])


@pytest.mark.turns(8)
@pytest.mark.parametrize("arm", [ARM, OFFSET], ids=["srs", "offset"])
@pytest.mark.parametrize("size", [1.0, 0.05, 1e-3])
@pytest.mark.parametrize("j", [None, 50.0, 500.0])
@pytest.mark.parametrize("n", [2, 60])
def test_from_posture_to_posture_takes_what_its_slowest_joint_needs(
    rng: np.random.Generator, arm: aa.Arm, size: float, j: float | None, n: int
) -> None:
    """`retime` of a straight joint motion takes the least time of its slowest joint, with rows between or
    not.
    """
    for _ in range(3):
        ends = pair(rng, arm, size)
        q = ends[0] + np.linspace(0, 1, n)[:, None] * (ends[1] - ends[0])
        path = aa.JointPath.from_joints(arm, q, between="joints")
        found = aa.retime(path, acceleration=A, jerk=j)
        least = least_time(np.abs(ends[1] - ends[0]), arm.velocity, A, 1e15 if j is None else j)
        assert found.duration == pytest.approx(least, rel=2e-3 if j is None else 1e-5)
        assert np.abs(found.q[[0, -1]] - ends).max() < 1e-12
        kept(found, arm.velocity, A, j)


def test_joints_go_straight_and_the_tool_where_they_take_it(rng: np.random.Generator) -> None:
    """from_joints(between="joints"): q is linear between rows; pose, psi and gc are `forward` of it."""
    q = np.cumsum(rng.normal(0, 0.3, (6, 7)), axis=0) * [1, 0.5, 1, 0.5, 1, 0.5, 1]
    rows = np.sort(np.append(rng.uniform(0, 1, 4), [0.0, 1.0]))
    path = aa.JointPath.from_joints(ARM, q, s=rows, between="joints")
    s = np.linspace(0, 1, 501)
    here = path.at(s)
    assert np.allclose(
        here.q, np.stack([np.interp(s, rows, joint) for joint in q.T], axis=1), rtol=0, atol=1e-15
    )
    pose, psi, gc = ARM.forward(here.q)
    assert np.array_equal(here.pose, pose) and np.array_equal(here.psi, psi) and np.array_equal(here.gc, gc)
    inner = s[(np.abs(s[:, None] - rows).min(axis=1) > 1e-3)]
    h = 1e-6
    slope = (path.at(inner + h).q - path.at(inner - h).q) / (2 * h)
    d = path.derivatives(inner)
    assert np.allclose(d[:, 0], slope, rtol=0, atol=1e-6) and not d[:, 1:].any()


def test_corners_are_stops_or_rounded_within_the_tolerance() -> None:
    """`retime` of joint rows stops at corners, or rounds them within the tolerance in no more time."""
    q = np.array(
        [[0, 0.5, 0, -1.2, 0, 0.6, 0], [0.5, 0.7, 0, -1.0, 0, 0.6, 0.3], [0.4, 0.3, 0.3, -1.4, 0.2, 0.9, 0]]
    )
    path = aa.JointPath.from_joints(ARM, q, between="joints")
    ways = np.abs(np.diff(q, axis=0))
    stops = aa.retime(path, acceleration=A, jerk=50.0, tolerance=0.0)
    assert stops.duration == pytest.approx(
        sum(least_time(way, ARM.velocity, A, 50.0) for way in ways), rel=1e-5
    )
    for j in (None, 50.0):
        rounded = aa.retime(path, acceleration=A, jerk=j, tolerance=5e-3)
        assert rounded.duration <= stops.duration * (1 + 1e-9) and rounded.deviation.position <= 5e-3
        kept(rounded, ARM.velocity, A, j)


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("j", [None, 200.0])
def test_a_larger_tolerance_is_made_use_of(rng: np.random.Generator, j: float | None) -> None:
    """`retime` with a larger tolerance takes less time, and states its deviation within a factor of 2."""
    walk = np.array([0, 0.5, 0, -1.2, 0, 0.7, 0]) + np.cumsum(rng.normal(0, 0.12, (7, 7)), axis=0)
    path = aa.JointPath.from_joints(ARM, walk, between="joints")
    durations = [aa.retime(path, velocity=1.5, acceleration=A, jerk=j, tolerance=0.0, cycle=0).duration]
    for tolerance in (1e-3, 1e-2):
        found = aa.retime(path, velocity=1.5, acceleration=A, jerk=j, tolerance=tolerance)
        at = found.at(np.linspace(0, found.duration, 3001))
        away = np.linalg.norm((ARM.forward(at.q)[0] - path.at(at.s).pose)[:, :3, 3], axis=1).max()
        assert 0.5 * found.deviation.position <= away <= found.deviation.position <= tolerance
        kept(found, np.full(7, 1.5), A, j)
        durations.append(found.duration)
    assert found.deviation.position > 2e-3
    assert durations[1] <= durations[0] and durations[2] < 0.95 * durations[1]


@pytest.mark.turns(2)
@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_a_tolerance_that_is_too_small_to_be_used_is_a_stop(
    rng: np.random.Generator, tolerance: float
) -> None:
    """`retime` with a tolerance of 1e-6 or 1e-9 m is no slower than with stops, and keeps it."""
    walk = np.array([0, 0.5, 0, -1.2, 0, 0.7, 0]) + np.cumsum(rng.normal(0, 0.1, (20, 7)), axis=0)
    path = aa.JointPath.from_joints(ARM, walk, between="joints")
    nodes = np.linspace(0, 1, 20)
    curve = rounding.rounded(path, nodes, tolerance)
    assert curve is None or len(breaks(curve[0])) < 3000
    found, stops = (aa.retime(path, acceleration=2.0, tolerance=x) for x in (tolerance, 0.0))
    assert found.duration <= stops.duration * (1 + 1e-6)
    assert found.deviation.position <= tolerance


@pytest.mark.turns(2)
@pytest.mark.parametrize("end", ["start", "goal"])
def test_a_singular_home_is_left_within_the_tolerance(end: str) -> None:
    """`retime` of a plan from or to a singular home refuses without tolerance, and keeps the one given."""
    arm = aa.Arm.from_catalogue("openarm_v10")
    home = np.radians([0.0, 0, 0, 90, 0, 0, 0])
    pose = arm.forward(home)[0]
    away = moved(pose, [0.06, -0.05, 0.06])
    path = aa.plan(arm, aa.Line(pose, away) if end == "start" else aa.Line(away, pose), **{end: home})
    refused(aa.PathError, "tolerance= rounds that", lambda: aa.retime(path, velocity=2.0, acceleration=A))
    for j, tolerance in ((None, 1e-4), (100.0, 1e-4), (100.0, 1e-3)):
        found = aa.retime(path, velocity=2.0, acceleration=A, jerk=j, tolerance=tolerance)
        at = found.at(np.linspace(0, found.duration, 3001))
        away_from = np.linalg.norm((arm.forward(at.q)[0] - path.at(at.s).pose)[:, :3, 3], axis=1).max()
        assert 0 < away_from <= found.deviation.position <= tolerance
        np.testing.assert_allclose(found.q[0 if end == "start" else -1], home, atol=1e-9)
        assert found.duration < 1.5
        kept(found, np.full(7, 2.0), A, j)


@pytest.mark.turns(2)
@pytest.mark.parametrize("j", [None, 50.0])
def test_a_spline_is_met_and_takes_as_long_however_many_rows_it_has(
    rng: np.random.Generator, j: float | None
) -> None:
    """A spline meets its rows, and `retime` takes as long for 40 rows as for 640."""
    knots = np.array([0, 0.5, 0, -1.2, 0, 0.7, 0]) + rng.normal(0, 0.25, (6, 7))
    smooth = need("scipy.interpolate").CubicSpline(np.linspace(0, 1, 6), knots)
    found = []
    for n in (40, 160, 640):
        q = smooth(np.linspace(0, 1, n))
        path = aa.JointPath.from_joints(ARM, q, between="spline")
        assert np.abs(path.at(path.s).q - q).max() < 1e-12
        found.append(aa.retime(path, acceleration=A, jerk=j))
        kept(found[-1], ARM.velocity, A, j)
    assert np.ptp([each.duration for each in found]) < 0.02 * found[-1].duration
    few = smooth(np.linspace(0, 1, 20))
    straight = aa.retime(aa.JointPath.from_joints(ARM, few, between="joints"), acceleration=A, jerk=j)
    assert straight.duration > 1.5 * found[0].duration


def test_a_spline_of_straight_rows_is_the_straight_way() -> None:
    """`retime` of a spline through straight rows takes as long as of straight joints."""
    q = np.linspace([0, 0.5, 0, -1.2, 0, 0.6, 0], [1, 0.2, 0.3, -1.5, 0.6, 0.9, -1], 30)
    one, other = (
        aa.retime(aa.JointPath.from_joints(ARM, q, between=how), acceleration=A, jerk=200.0).duration
        for how in ("joints", "spline")
    )
    assert one == pytest.approx(other, rel=1e-6)


def test_a_spline_that_passes_a_limit_is_refused_and_straight_joints_are_not() -> None:
    """from_joints refuses a spline beyond a limit between rows; straight joints keep it."""
    q = np.tile(np.array([0, 0.5, 0, -1.2, 0, 0.6, 0.0]), (6, 1))
    q[2:4, 1] = ARM.upper[1] - [1e-4, 2e-4]
    with pytest.raises(
        aa.PathError, match="behind row 2 a spline through the rows takes joint 2 past its limit by"
    ):
        aa.JointPath.from_joints(ARM, q, between="spline")
    path = aa.JointPath.from_joints(ARM, q, between="joints")
    assert (path.at(np.linspace(0, 1, 1001)).q <= ARM.upper).all()


@pytest.mark.parametrize("between", ["joints", "spline"])
def test_the_speed_of_the_tool_is_held(between: Between) -> None:
    """`retime(tool_speed=)` of joint motions keeps the tool's speed but for the ramps."""
    q = np.linspace([0, 0.5, 0, -1.2, 0, 0.6, 0], [0.6, 0.7, 0.3, -1.0, 0.1, 0.9, -0.3], 12)
    q[:, 3] += 0.1 * np.sin(np.linspace(0, np.pi, 12)) * (between == "spline")
    path = aa.JointPath.from_joints(ARM, q, between=between)
    found = aa.retime(path, acceleration=A, tool_speed=0.1)
    assert found.speed_lost is None
    t = np.linspace(0.1, 0.9, 500) * found.duration
    h = 1e-5
    here = ARM.forward(found.at(t).q)[0][:, :3, 3]
    there = ARM.forward(found.at(t + h).q)[0][:, :3, 3]
    assert np.linalg.norm(there - here, axis=1) / h == pytest.approx(np.full(500, 0.1), rel=2e-3)


def test_it_is_joined_to_a_line_and_timed_as_one() -> None:
    """A joint motion joined with a planned line is retimed as one, and stays on the line."""
    home, near = np.radians([[0, 10, 0, -90, 0, 80, 0], [20, 30, 5, -80, 0, 60, 10]])
    begin = ARM.forward(near)[0]
    end = begin.copy()
    end[1, 3] += 0.15
    approach = aa.JointPath.from_joints(ARM, [home, near], between="joints")
    line = aa.plan(ARM, aa.Line(begin, end), start=near)
    both = aa.join([approach, line])
    assert both.ok and not both.certified
    found = aa.retime(both, acceleration=A, jerk=50.0, tool_speed=0.1, tolerance=0.0)
    kept(found, ARM.velocity, A, 50.0)
    behind = both.at(np.linspace(approach.s[-1] * 0 + 1 / (len(line)), 1, 200))
    straight = behind.pose[:, [0, 2], 3] - begin[[0, 2], 3]
    assert np.abs(straight).max() < 1e-9
    again = aa.join([line, aa.JointPath.from_joints(ARM, [line.q[-1], home], between="joints")])
    assert aa.retime(again, acceleration=A).duration > 0


@pytest.mark.parametrize("between", ["tool", "joints", "spline"])
def test_a_posture_of_no_arm_angle_and_a_repeated_row_are_no_obstacles(between: Between) -> None:
    """`retime` takes rows to theta_2 = theta_6 = 0 with a repeated row; joints in the least time."""
    q = np.linspace([0.3, 0.5, 0, -1.2, 0, 0.6, 0], [0.3, -0.5, 0, -1.2, 0, -0.6, 0.2], 21)
    q = np.insert(q, 7, q[7], axis=0)
    if between == "tool":
        q = q[:12]
    path = aa.JointPath.from_joints(ARM, q, between=between)
    found = aa.retime(path, acceleration=A, tolerance=1e-3)
    if between == "joints":
        assert found.duration == pytest.approx(
            least_time(np.abs(q[-1] - q[0]), ARM.velocity, A, 1e12), rel=2e-3
        )
    assert np.abs(found.q[-1] - q[-1]).max() < 1e-9


LEAPING = (
    "-.27671417359821815 1.5707963267948966 .27787009012862063 -.319458937234933 -.1669592159454496 "
    ".6108652381980153 .5275642719229428"
)


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ["fourier_gr2t2d_left", "openarm_v10"])
def test_a_leap_in_what_is_not_proven_is_rounded_or_refused(name: str) -> None:
    """`retime` of a plan that leaps where it is not certified refuses, or rounds that within its bounds."""
    arm = aa.Arm.from_catalogue(name).with_(reference="stereographic" if "left" in name else "base")
    start = np.array(LEAPING.split(), float) if "left" in name else np.radians([0, 0, 0, 90.0, 0, 0, 0])
    first = arm.forward(start, on_error="nan")[0]
    way: aa.Path = aa.Line(first, moved(first, [0, 0.1, 0]))
    if "left" in name:
        axis = [-1.3587816162432897, -0.4821619858014781, 0.14599538682914573]
        point = [0.1355545622029429, 0.8116207841885943, 0.5182057825746922]
        way = aa.Screw(first, point, axis, 0.02053303265870824)
    path = aa.plan(arm, way, start=start, samples=87)
    assert path.ok and not path.certified
    said = "not proven, joint 5 leaps" if "left" in name else "tolerance= or jerk= rounds that"
    refused(aa.PathError, said, aa.retime, path, acceleration=A)
    for given in ({"tolerance": 1e-4}, {"jerk": 100.0}):
        kept(aa.retime(path, acceleration=A, **given), arm.velocity, A, given.get("jerk"))


@pytest.mark.turns(2)
@pytest.mark.parametrize("seed", [4, 10])
def test_acceleration_does_not_leap_at_stops_between_short_and_long_ways(seed: int) -> None:
    """At stops between very short and long ways `retime` keeps its jerk bound."""
    rng = np.random.default_rng(seed)
    sizes = 10 ** rng.uniform(-7, -0.5, (int(rng.integers(5, 45)), 1))
    rows = np.clip(np.cumsum(0.4 * rng.normal(size=(len(sizes), 7)) * sizes, axis=0), -1.5, 1.5)
    rows += np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    motion = aa.JointPath.from_joints(ARM, np.clip(rows, ARM.lower, ARM.upper), between="joints")
    found = aa.retime(motion, acceleration=9.73, jerk=2.0, tolerance=1e-5)
    stops = found.timing.t[1:-1, None] + np.linspace(-1e-6, 1e-6, 41)
    changes = np.diff(found.at(np.clip(stops, 0.0, found.duration)).qdd, axis=1)
    assert np.abs(changes).max() <= 2.0 * 5.1e-8 + 1e-7


def test_rows_that_are_no_motion_are_said() -> None:
    """from_joints and `retime` refuse wrong words, rows beyond limits, and rows that need `between`."""
    rest = np.array([0, 0.5, 0, -1.2, 0, 0.6, 0.0])
    with pytest.raises(aa.InputError, match="between is 'line', wanted"):
        aa.JointPath.from_joints(ARM, [rest, rest + 0.1], between="line")  # type: ignore[arg-type]  # a wrong word
    for between in ("joints", "spline"):
        path = aa.JointPath.from_joints(ARM, [rest], between=between)
        assert np.array_equal(path.at(0.0).q, rest)
        outside = aa.JointPath.from_joints(ARM, [rest, rest + 3], between=between)
        refused(aa.PathError, "outside its limits", aa.retime, outside, acceleration=A)
    with pytest.raises(aa.PathError, match="or between='joints'"):
        aa.JointPath.from_joints(ARM, [rest, -rest]).at(0.5)
