"""Laws of `retime`: on the path, within every bound, no slower than it must, honest about speed."""

from __future__ import annotations

import warnings
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support import draw
from support.moves import moved, refused
from support.needs import need
from support.strategies import CATALOGUE, Array

import armangle as aa
from armangle.motion.joint_path import Between
from armangle.timing.fastest import _Course

need("scipy")
need("highspy")

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(acceleration=np.full(7, 5.0))
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
JERK = np.full(7, 50.0)
MUCH = np.full(7, 1e6)


def shifted(*shift: float) -> Array:
    """The pose of Q moved by x, y, z (m)."""
    return moved(ARM.forward(Q)[0], shift)


def curve_of_poses(n: int) -> Array:
    """n poses along a curve from the pose of Q."""
    t = np.linspace(0, 1, n)
    poses = np.repeat(shifted(0, 0, 0)[None], n, axis=0)
    poses[:, :3, 3] += np.stack([0.1 * t, 0.1 * np.sin(3 * t), -0.1 * t], axis=1)
    return poses


class Straight:
    """q = Q + s * way: what is optimal is known in closed form."""

    def __init__(self, way: Array) -> None:
        """A path from Q by `way` (7,), rad."""
        self.arm, self.way = ARM, way
        self.path = SimpleNamespace(breaks=np.array([0.0, 1.0]), derivative=self._tool)

    def at(self, s: Any, /) -> Any:
        """The joints at s."""
        return SimpleNamespace(q=Q + np.asarray(s)[..., None] * self.way)

    def derivatives(self, s: Any, /) -> Array:
        """The derivatives (..., 3, 7): `way`, and 0."""
        out = np.zeros((*np.shape(s), 3, 7))
        out[..., 0, :] = self.way
        return out

    def _tool(self, s: Array, order: int = 1) -> Array:
        """The derivative of the tool's path: 1 m along x."""
        return np.asarray([1.0, 0, 0, 0, 0, 0]) * np.ones((len(s), 1)) * (order == 1)


LINE = aa.plan(ARM, aa.Line(shifted(0, 0, 0), shifted(0.1, -0.2, 0.1)), start=Q)
BENT = aa.plan(ARM, curve_of_poses(12), start=Q)
STEPS = aa.follow(ARM, curve_of_poses(12), start=Q)

paths = pytest.mark.parametrize("path", [LINE, BENT, STEPS], ids=["line", "poses", "followed"])
ways = pytest.mark.parametrize(
    "options",
    [{}, {"jerk": JERK}, {"tool_speed": 0.05}, {"jerk": JERK, "tool_speed": 0.02}],
    ids=["fastest", "jerk", "speed", "jerk and speed"],
)


# -- laws --------------------------------------------------------------------------------------------


@pytest.mark.turns(6)
@pytest.mark.slow
@paths
@ways
def test_it_stays_on_the_path_from_rest_to_rest_within_every_bound(
    path: aa.JointPath, options: dict[str, Any]
) -> None:
    """`retime` keeps path, bounds and deviation at 10 000 times, from rest to rest."""
    found = aa.retime(path, **options)
    times = np.linspace(0, found.duration, 10_000)
    at = found.at(times)
    assert np.all(np.diff(at.s) >= 0) and at.s[0] == 0 and at.s[-1] == pytest.approx(1, abs=1e-9)
    pose, off = ARM.forward(at.q)[0], found.deviation
    away = pose - path.at(at.s).pose
    assert np.linalg.norm(away[:, :3, 3], axis=1).max() <= max(off.position, 1e-12)
    turned = np.linalg.norm(away[:, :3, :3], axis=(1, 2)).max() / np.sqrt(2)
    assert turned <= max(off.rotation, 1e-12)
    assert max(off) == 0 or (path is not LINE and "jerk" in options)
    assert np.hypot(off.position, 0.2 * off.rotation) <= 1e-4
    assert np.abs(at.qd[[0, -1]]).max() < 1e-6 and found.t[-1] == found.duration
    rows = found.at(found.t)
    assert np.array_equal(rows.q, found.q) and np.array_equal(rows.qdd, found.qdd)
    assert np.all(np.abs(at.qd) <= ARM.velocity * (1 + 1e-4))
    assert np.all(np.abs(at.qdd) <= 5.0 * (1 + 1e-4))
    if "jerk" in options:
        assert (np.abs(np.diff(at.qdd, axis=0)) / np.diff(times)[:, None]).max() <= 50.0 * (1 + 5e-3)
    if "tool_speed" in options:
        tool = np.linalg.norm(np.diff(pose[:, :3, 3], axis=0), axis=1) / np.diff(times)
        assert tool.max() <= options["tool_speed"] * (1 + 1e-3)


@ways
def test_velocities_and_accelerations_are_the_derivatives_of_q(options: dict[str, Any]) -> None:
    """qd and qdd of a trajectory equal differences of q."""
    found = aa.retime(LINE, **options)
    times = np.linspace(0, found.duration, 20_001)
    at = found.at(times)
    middle, step = slice(1, -1), times[1]
    slope = (at.q[2:] - at.q[:-2]) / (2 * step)
    assert np.abs(slope - at.qd[middle]).max() < 5.0 * step
    bend = (at.qd[2:] - at.qd[:-2]) / (2 * step)
    near = np.abs(bend - at.qdd[middle]).max(axis=1)
    assert np.quantile(near, 0.9) < 0.05


@pytest.mark.parametrize("length", [0.01, 0.3, 2.0])
def test_a_straight_motion_in_joints_is_as_fast_as_can_be(length: float) -> None:
    """`retime` of a straight joint motion is within 2 % of the least time; with jerk within 0.1 % of
    Ruckig.
    """
    path, v, a = Straight(np.array([1.0, 0.2, -0.3, 0.1, 0, 0, 0.5]) * length), 1.0, 2.0
    found = aa.retime(path, velocity=v, acceleration=a)
    best = length / v + v / a if length > v * v / a else 2 * np.sqrt(length / a)
    assert best * (1 - 1e-6) <= found.duration <= best * 1.02
    ruckig = need("ruckig")
    found = aa.retime(path, velocity=v, acceleration=a, jerk=8.0)
    asked, exact = ruckig.InputParameter(1), ruckig.Trajectory(1)
    asked.target_position, asked.max_velocity = [length], [v]
    asked.max_acceleration, asked.max_jerk = [a], [8.0]
    ruckig.Ruckig(1).calculate(asked, exact)
    assert exact.duration * (1 - 1e-6) <= found.duration <= exact.duration * 1.001


@pytest.mark.turns(3)
@paths
def test_twice_the_bounds_is_faster_and_four_times_the_acceleration_half_the_time(path: aa.JointPath) -> None:
    """`retime` with four times the acceleration, and no other bound, takes half the time."""
    slow = aa.retime(path, velocity=MUCH, acceleration=np.full(7, 2.0), cycle=0)
    fast = aa.retime(path, velocity=MUCH, acceleration=np.full(7, 8.0), cycle=0)
    assert fast.duration == pytest.approx(slow.duration / 2, rel=1e-3)


# -- corners -----------------------------------------------------------------------------------------


def test_it_stops_at_corners_and_a_cycle_rounds_them_in_time() -> None:
    """`retime(cycle=0)` stops at corners; a longer cycle takes less time."""
    stops = aa.retime(BENT, cycle=0)
    inner = BENT.path.breaks[1:-1] if BENT.path is not None else BENT.s[1:-1]
    at = stops.at(np.linspace(0, stops.duration, 20_000))
    for s in inner:
        near = np.abs(at.s - s) < 1e-5
        assert near.any()
        assert np.abs(at.qd[near]).max() < 0.02
    durations = [aa.retime(BENT, cycle=cycle).duration for cycle in (0.002, 0.01, 0.05)]
    assert stops.duration > durations[0] > durations[1] > durations[2]


def test_jumps_of_velocity_at_corners_fit_in_the_cycle() -> None:
    """Velocities of `retime(cycle=)` jump at corners by at most acceleration times cycle."""
    cycle = 0.01
    found = aa.retime(BENT, cycle=cycle)
    at = found.at(np.linspace(0, found.duration, 50_001))
    jump = np.abs(np.diff(at.qd, axis=0)).max(axis=0)
    assert np.all(jump <= 5.0 * (cycle + 3 * found.duration / 50_000) * 1.01)


# -- bounded jerk ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_followed_line_is_no_chain_of_stops() -> None:
    """`retime` with jerk of a followed line in 200 rows takes at most 1.4 times as long as without."""
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    q = np.radians([0, 40, 20, -80, 0, 60, 0])
    first = arm.forward(q)[0]
    last = first.copy()
    last[1, 3] += 0.2
    poses = aa.Line(first, last).pose(np.linspace(0, 1, 200))
    path = aa.follow(arm, poses, start=q, policy=aa.Hold())
    free, found = (aa.retime(path, acceleration=10.0, **given) for given in ({}, {"jerk": 100.0}))
    assert free.duration <= found.duration <= 1.4 * free.duration
    assert found.deviation.position < 1e-9
    stops = aa.retime(aa.follow(arm, poses[:20], start=q, policy=aa.Hold()), acceleration=10.0, jerk=100.0,
                      tolerance=0.0)  # fmt: skip
    assert stops.deviation == (0.0, 0.0)
    assert stops.duration > 2 * found.duration


@pytest.mark.slow
def test_corners_are_rounded_no_further_than_said() -> None:
    """`retime` with jerk rounds corners by at most the deviation that it states and the tolerance."""
    corner = [shifted(0, 0, 0), shifted(0, -0.1, 0), shifted(0.02, -0.2, 0)]
    lines = [aa.Line(*corner[:2]), aa.Line(*corner[1:])]
    path = aa.follow(ARM, lines, start=Q, policy=aa.Hold(), samples=25)
    durations = []
    for tolerance in (3e-5, 1e-3):
        found = aa.retime(path, jerk=JERK, tolerance=tolerance)
        at = found.at(np.linspace(0, found.duration, 5001))
        away = np.linalg.norm((ARM.forward(at.q)[0] - path.at(at.s).pose)[:, :3, 3], axis=1).max()
        assert 0.3 * found.deviation.position < away <= found.deviation.position <= tolerance
        assert "Corners are rounded by at most" in found.explain()
        assert np.abs(at.qdd).max() <= 5.0 * (1 + 1e-6)
        durations.append(found.duration)
    assert max(durations) < aa.retime(path, jerk=JERK, tolerance=0.0).duration
    loose = aa.retime(path, tolerance=1e-3)
    assert loose.deviation.position > 0
    assert loose.duration <= aa.retime(path, cycle=0).duration


def walk(seed: int, rows: int, size: float) -> aa.JointPath:
    """A path through random joints."""
    return aa.JointPath.from_joints(
        ARM, np.cumsum(np.vstack([Q, np.random.default_rng(seed).normal(size=(rows, 7)) * size]), axis=0)
    )


def waypoints() -> aa.JointPath:
    """A plan through random positions."""
    poses = np.repeat(ARM.forward(Q)[0][None], 60, axis=0)
    poses[1:, :3, 3] += np.random.default_rng(0).normal(size=(59, 3)) * 0.05
    return aa.plan(ARM, poses, start=Q)


def back() -> aa.JointPath:
    """A plan to a point and back."""
    return aa.plan(ARM, np.stack([shifted(0, 0, 0), shifted(0.1, 0, 0), shifted(0.0, 0.001, 0)]), start=Q)


def one_by_one() -> aa.JointPath:
    """A path in which the joints move one after another."""
    q = np.radians([0, 30, 0, -90, 0, 60, 0]) + 0.15 * np.tril(np.ones((4, 7)), -1)
    return aa.JointPath.from_joints(ARM, q, between="joints")


CORNERS: list[tuple[Any, dict[str, Any]]] = [
    (back, {"jerk": 50.0, "tolerance": 1e-5}),  # rounding would creep round the turn
    (lambda: walk(1, 9, 0.05), {"velocity": 0.5, "acceleration": 10.0, "jerk": 200.0}),
    # of a joint that rests, the rest of its way is nothing but rounding: that is no end of the motion
    (one_by_one, {"velocity": 1.0, "tolerance": 1e-2}),
    (one_by_one, {"velocity": 1.0, "tolerance": 1e-4}),
    (waypoints, {"velocity": 1.0, "tolerance": 1e-3}),  # a first grid is too coarse for such bends
]


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize(("made", "asked"), CORNERS)
def test_rounding_corners_is_not_slower_than_stopping_at_them(made: Any, asked: dict[str, Any]) -> None:
    """`retime` with a tolerance takes no longer than with stops."""
    path = made()
    found, stops = aa.retime(path, **asked), aa.retime(path, **asked | {"tolerance": 0.0})
    assert 0.5 < found.duration <= 1.001 * stops.duration
    assert found.deviation == (0.0, 0.0) or made is not back
    if asked.get("velocity") == 0.5:
        assert found.duration < 2.2 * aa.retime(path, velocity=0.5, acceleration=10.0).duration


def test_one_number_bounds_all_joints_and_infinity_none() -> None:
    """`retime` takes one number as bound of all joints, and infinity as none."""
    many = aa.retime(LINE, velocity=np.full(7, 1.5), acceleration=np.full(7, 4.0), jerk=np.full(7, 40.0))
    one = aa.retime(LINE, velocity=1.5, acceleration=4.0, jerk=40.0)
    assert np.array_equal(many.q, one.q)
    assert aa.retime(LINE).duration == aa.retime(LINE, jerk=np.inf).duration
    path = aa.JointPath.from_joints(ARM, [Q, Q + 0.1, Q + 0.1 * np.eye(7)[1]], between="spline")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        free = aa.retime(path, velocity=np.inf, jerk=50.0)
    assert free.duration <= aa.retime(path, velocity=1.0, jerk=50.0).duration * 1.001


@pytest.mark.turns(4)
@pytest.mark.slow
@pytest.mark.parametrize("way", [0.0, 1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize("jerk", [None, 50.0])
def test_standing_tools_and_the_shortest_lines_are_timed(way: float, jerk: float | None) -> None:
    """`retime` of joint motions under a tool that stands, or moves at most 0.1 mm, keeps its bounds."""
    q = Q + np.random.default_rng(0).uniform(-0.3, 0.3, 7)
    first, psi, gc = ARM.forward(q)
    last = moved(first, way * np.array([0.6, -0.48, 0.64]))
    goal = ARM.inverse(last, psi + 0.4, gc, seed=q, limits=False)
    found = aa.retime(aa.plan(ARM, aa.Line(first, last), start=q, goal=goal), jerk=jerk)
    assert len(found.timing.t) < 2000
    at = found.at(np.linspace(0, found.duration, 10_000))
    assert np.abs(at.qd).max() <= ARM.velocity.max() and np.abs(at.qdd).max() <= 5.0 * (1 + 1e-3)
    assert np.abs(at.qd[[0, -1]]).max() < 1e-6
    if jerk is not None:
        assert np.abs(np.diff(at.qdd, axis=0)).max() / (found.duration / 9999) <= jerk * (1 + 5e-3)


@pytest.mark.turns(3)
@pytest.mark.parametrize("way", [1e-9, 1e-8, 1e-7])
def test_lines_of_less_than_a_micrometre_are_timed(way: float) -> None:
    """`retime` of lines of 1 nm to 0.1 µm takes the least time within 1 %."""
    arm, rng = aa.Arm.from_catalogue("kuka_iiwa7_r800"), np.random.default_rng(0)
    for _ in range(6):
        q = rng.uniform(arm.lower * 0.8, arm.upper * 0.8)
        first, shift = arm.forward(q)[0], rng.normal(size=3)
        last = moved(first, way * shift / np.linalg.norm(shift))
        path = aa.follow(arm, aa.Line(first, last), start=q, policy=aa.Hold(), samples=20)
        least = 2 * np.sqrt(np.abs(path.q[-1] - path.q[0]).max() / 5.0)
        assert least * 0.99 <= aa.retime(path, acceleration=5.0).duration <= least * 1.01


# -- tool speed --------------------------------------------------------------------------------------


def test_a_tool_speed_that_can_be_held_is_constant() -> None:
    """`retime` with a tool_speed that can be held moves the tool at it, but for the ramps."""
    found = aa.retime(LINE, tool_speed=0.05)
    assert found.speed_lost is None
    assert "The tool moves at 0.05 m/s but for the ramps at both ends." in found.explain()
    times = np.linspace(0.2 * found.duration, 0.8 * found.duration, 500)
    tool = ARM.forward(found.at(times).q)[0][:, :3, 3]
    speed = np.linalg.norm(np.diff(tool, axis=0), axis=1) / np.diff(times)
    assert np.abs(speed - 0.05).max() < 1e-6


def test_the_first_place_where_a_tool_speed_cannot_be_held() -> None:
    """`retime(tool_speed=)` says at which s and for which joint the speed is first lost."""
    poses, share = np.repeat(shifted(0, 0, 0)[None], 40, axis=0), np.linspace(0, 1, 40)[:, None]
    poses[:, :3, 3] += share * np.array([0.12, 0.06, 0.03])
    far = aa.follow(ARM, poses, start=Q, policy=aa.Hold())
    wanted, length = 0.4, np.linalg.norm([0.12, 0.06, 0.03])
    found = aa.retime(far, velocity=True, acceleration=np.full(7, 1e4), tool_speed=wanted)
    lost = found.speed_lost
    assert lost is not None
    assert lost.bound == "velocity"
    assert f"{wanted:g} m/s cannot be held" in found.explain()
    assert f"joint {lost.joint} would need a velocity" in lost.sentence
    s = np.linspace(0, 1, 20_001)
    needs = np.abs(far.derivatives(s)[:, 0]) * (wanted / length) / ARM.velocity
    assert needs[0].max() < 1
    first = s[np.argmax(needs.max(axis=1) > 1)]
    assert lost.s == pytest.approx(first, abs=2e-3)
    assert lost.joint == int(np.argmax(needs[np.argmax(needs.max(axis=1) > 1)])) + 1


def test_corners_ramps_and_a_tool_at_rest_break_the_tool_speed() -> None:
    """`retime(tool_speed=)` says that a corner, the ramps or a resting tool break the speed."""
    short = aa.follow(ARM, np.stack([shifted(0, 0, 0), shifted(0.004, 0, 0)]), start=Q, policy=aa.Hold())
    spin = [shifted(0, 0, 0) @ aa.pose([0, 0, 0], rpy=[0, 0, angle]) for angle in np.linspace(0, 0.4, 5)]
    turning = aa.follow(ARM, np.stack(spin), start=Q)
    for path, speed, bound, said in (
        (BENT, 0.2, "corner", "the path has a corner: the velocity of joint"),
        (short, 0.2, "ramps", "ramps to and from what is near leave no room"),
        (turning, 0.1, None, "the tool rests while joint"),
    ):
        lost = aa.retime(path, tool_speed=speed).speed_lost
        assert lost is not None and said in lost.sentence and bound in (None, lost.bound)
        assert lost.joint is None or bound != "ramps"
        assert lost.s == 0 or path is not turning


@pytest.mark.turns(4)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_any_arm_and_line_within_two_thousandths(seed: int) -> None:
    """`retime` of random arms and lines keeps its bounds within 0.2 %, or refuses a failed plan."""
    rng = np.random.default_rng(seed)
    arm = aa.Arm.from_catalogue(CATALOGUE[seed % len(CATALOGUE)])
    arm = arm.with_(acceleration=rng.uniform(1, 20, 7), velocity=rng.uniform(1, 3, 7))
    q = rng.uniform(np.maximum(arm.lower, -3), np.minimum(arm.upper, 3)) * 0.8
    start, goal = arm.forward(q)[0], arm.forward(q + rng.uniform(-0.3, 0.3, 7))[0]
    path = aa.plan(arm, aa.Line(start, goal), start=q)
    if not path.ok:
        with pytest.raises(aa.PathError):
            aa.retime(path)
        return
    for options in ({}, {"tool_speed": 0.1}, {"jerk": np.full(7, 100.0)}):
        found = aa.retime(path, **options)  # type: ignore[arg-type]  # any options
        at = found.at(np.linspace(0, found.duration, 10_000))
        assert np.max(np.abs(at.qd) / arm.velocity) <= 1.002
        assert np.max(np.abs(at.qdd) / arm.acceleration) <= 1.002
        assert at.s[-1] == pytest.approx(1, abs=1e-9)


# -- refusals ----------------------------------------------------------------------------------------


def test_what_cannot_be_timed_is_refused() -> None:
    """`retime` refuses what is no solved path, missing bounds and arguments of other calls."""
    bare = aa.follow(ARM.with_(acceleration=None), curve_of_poses(9)[:2], start=Q)
    for error, said, path in (
        (aa.PathError, "solved", aa.follow(ARM, shifted(5, 0, 0)[None], start=Q)),
        (aa.PathError, "the path has no rows", aa.follow(ARM, np.empty((0, 4, 4)), start=Q)),
        (aa.InputError, r"JointPath.from_joints\(arm, q\)", np.zeros((5, 7))),
        (aa.InputError, "path is 3, wanted a JointPath", 3),
        (aa.InputError, "acceleration is the arm's own, .* states none: give acceleration=", bare),
    ):
        refused(error, said, aa.retime, path)
    refused(aa.InputError, "needs a bound on the acceleration", aa.retime, bare, acceleration=None)
    for word in ("dt", "samples", "speed", "duration"):
        refused(aa.InputError, f"retime takes no {word}=: ", aa.retime, LINE, **{word: 0.1})


@pytest.mark.turns(3)
@pytest.mark.parametrize("option", ["velocity", "acceleration", "tool_speed"])
def test_a_motion_of_years_is_refused_before_its_rows_are_made(option: str) -> None:
    """`retime` refuses motions of more than 4 000 000 rows, and bounds too small."""
    path = aa.follow(ARM, curve_of_poses(9)[:2], start=Q)
    bounds = {"velocity": 1.0, "acceleration": 5.0}
    said = r"the motion takes \S+ s, more than 4000000 rows of sample = 0.01"
    with pytest.raises(aa.InputError, match=said):
        aa.retime(path, **bounds | {option: 1e-12})
    assert len(aa.retime(path, **bounds | {option: 1e-4}, sample=10.0)) > 1
    with pytest.raises(aa.InputError, match=rf"{option}.* is 1e-300, wanted"):
        aa.retime(path, **bounds | {option: 1e-300})
    refused(aa.InputError, "wanted a larger sample", lambda: aa.retime(path, **bounds, sample=1e-9))
    with pytest.raises(aa.InputError, match=r"jerk\[0\] is 1e-300, wanted at least 1e-12"):
        aa.retime(path, **bounds, jerk=1e-300)


@pytest.mark.parametrize("options", [{}, {"jerk": JERK}])
def test_a_missing_package_is_named(options: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """`retime` without scipy raises, and names the extra to install."""

    def missing(name: str) -> Any:
        """Fail as an import of a missing package does."""
        raise ImportError(name)

    monkeypatch.setattr("importlib.import_module", missing)
    with pytest.raises(aa.MissingExtraError, match=r"timing needs .*scipy.*pip install 'armangle\[time\]'"):
        aa.retime(LINE, **options)


# -- many rows ---------------------------------------------------------------------------------------


def swing(n: int) -> aa.JointPath:
    """One smooth swing of all joints, in n rows."""
    way = np.array([1, 0.5, -0.3, 0.4, 0.2, -0.6, 0.8])
    q = Q + 0.15 * np.sin(np.linspace(0, 2 * np.pi, n))[:, None] * way
    return aa.JointPath.from_joints(ARM, q, between="tool")


@pytest.mark.parametrize("rows", [1200, 400] if draw.COUNT else [400])
def test_corners_closer_than_a_cycle_count_as_acceleration(rows: int) -> None:
    """In 10 or 20 ms velocities change by at most acceleration times that and a cycle, at many
    corners too.
    """
    path, cycle = swing(rows), 1e-3
    found = aa.retime(path, velocity=3.0, acceleration=1.0, cycle=cycle)
    for w in (0.01, 0.02):
        t = np.linspace(0, found.duration - 2 * w, 20_001)
        before, here, after = (found.at(t + k * w).q for k in range(3))
        assert np.abs(after - 2 * here + before).max() <= 1.01 * w * (w + cycle)
    least = aa.retime(path, velocity=3.0, acceleration=1.0, tolerance=1e-4).duration
    assert found.duration >= 0.999 * least


@pytest.mark.turns(4)
@pytest.mark.parametrize("between", ["joints", "spline"])
@pytest.mark.parametrize("tool_speed", [None, 0.1])
def test_a_looser_bound_on_jerk_makes_no_motion_of_many_turns_slower(
    between: Between, tool_speed: float | None
) -> None:
    """`retime` of 30 turns takes no longer with a looser jerk bound."""
    q = np.radians([0, 0, 0, -90, 0, 60, 0]) + np.where(np.arange(31) % 2, 0.2, -0.2)[:, None] * np.eye(7)[0]
    q[:, 1] += np.linspace(0, 0.17, 31)
    path = aa.JointPath.from_joints(ARM, q, between=between)
    took = [
        aa.retime(path, velocity=1.0, acceleration=5.0, jerk=jerk, tool_speed=tool_speed).duration
        for jerk in (50.0, 1e4, None)
    ]
    assert took[1] <= 1.01 * took[0]
    assert took[2] <= 1.001 * took[1] and took[1] <= 1.03 * took[2]


@pytest.mark.turns(4)
@pytest.mark.parametrize("asked", [{}, {"jerk": 50.0}])
@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_a_spline_through_rows_that_repeat_is_timed_as_it_is(asked: dict[str, float], noise: float) -> None:
    """A spline rests between rows that repeat, and `retime` takes as long as without the repetition."""
    a = np.radians([0, 30, 0, -90, 0, 60, 0])
    b, c = a + np.array([[0.6, 0.2, 0, 0.3, 0, 0, 0], [0.6, -0.4, 0.5, 0, 0, 0.3, 0]])
    path = aa.JointPath.from_joints(ARM, [a, b, b + noise, c, a], between="spline")
    there = path.at(np.linspace(path.s[1], path.s[2], 50)).q
    assert np.abs(there - b).max() <= 2e-5
    np.testing.assert_allclose(path.at(path.s).q, path.q, atol=2e-5)
    timed = aa.retime(path, velocity=1.0, acceleration=5.0, **asked)
    q = timed.at(np.linspace(0, timed.duration, 500)).q
    dense = path.at(np.linspace(0, 1, 8001)).q
    assert np.abs(q[:, None] - dense[None]).max(axis=2).min(axis=1).max() < 1e-3
    once = aa.retime(aa.JointPath.from_joints(ARM, [a, b, c, a], between="spline"),
                     velocity=1.0, acceleration=5.0, **asked)  # fmt: skip
    assert timed.duration == pytest.approx(once.duration, rel=1e-3)


@pytest.mark.turns(2)
@pytest.mark.parametrize(("rows", "cycle"), [(1700, 1e-3), (150, 0.0)])
def test_it_turns_at_more_corners_than_a_grid_has_intervals(
    rows: int, cycle: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`retime` of a zigzag of many rows takes the least time within 2 %."""
    if not cycle:
        monkeypatch.setattr("armangle.timing.grid.MANY", 100)
    q = Q + 0.01 * (np.arange(rows) % 2)[:, None] * np.eye(7)[0]
    path = aa.JointPath.from_joints(ARM, q, between="joints")
    found = aa.retime(path, velocity=1.0, acceleration=4.0, cycle=cycle)
    assert found.duration == pytest.approx((rows - 1) * 2 * np.sqrt(0.01 / 4.0), rel=0.02)


def test_as_many_rows_as_there_may_be_are_timed_as_few() -> None:
    """`retime` of a smooth motion takes as long for 200 rows as for 1500, within 2 %."""
    bounds: dict[str, Any] = {"velocity": 3.0, "acceleration": 1.0, "tolerance": 1e-4}
    durations = [aa.retime(swing(n), **bounds).duration for n in (200, 4000 if draw.COUNT else 1500)]
    assert durations[0] == pytest.approx(durations[1], rel=0.02)


@pytest.mark.turns(4)
@pytest.mark.parametrize("jerk", [50.0, 500.0])
@pytest.mark.parametrize("blend", [0.005, 0.02])
def test_a_tool_speed_is_held_round_a_blended_corner(blend: float, jerk: float) -> None:
    """`retime(tool_speed=)` keeps the speed within 1 % around a blended corner."""
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820").with_tool(aa.pose([0, 0, 0.2]))
    a, b, c = (aa.pose([x, y, 0.12], rpy=[np.pi, 0, 0]) for x, y in ((0.45, -0.15), (0.45, 0), (0.55, 0)))
    path = aa.plan(arm, [aa.Line(a, b), aa.Line(b, c)], blend=blend)
    held = aa.retime(path, tool_speed=0.03, acceleration=5.0, jerk=jerk)
    assert held.speed_lost is None
    t = np.linspace(0.3, held.duration - 0.3, 2000)
    speed = np.linalg.norm(np.diff(arm.forward(held.at(t).q)[0][:, :3, 3], axis=0), axis=1) / np.diff(t)
    assert speed.min() >= 0.99 * 0.03 and speed.max() <= 0.03 * (1 + 1e-6)


@pytest.mark.turns(4)
@pytest.mark.parametrize("asked", [{}, {"jerk": 50.0}, {"jerk": 50.0, "tolerance": 0.0}])
def test_a_row_that_is_repeated_is_no_stop(asked: dict[str, float]) -> None:
    """`retime` takes as long with a row repeated as without, within 0.1 or 0.5 %."""
    differs = 5e-3 if asked == {"jerk": 50.0} else 1e-3
    q = Q + np.radians([[0, 0, 0], [10, 0, 0], [20, 2, 2], [30, 6, 6], [40, 12, 12]]) @ np.eye(7)[[0, 1, 3]]

    def timed(rows: Array, between: Between | None = None) -> aa.Trajectory:
        """The trajectory through rows of joints."""
        path = aa.JointPath.from_joints(ARM, rows, between=between)
        return aa.retime(path, velocity=1.0, acceleration=5.0, **asked)

    once = timed(q).duration
    places = [(0, 1.5e-5), (2, 0.0), (2, 1.5e-5), (4, 0.0)]
    for row, noise in places[len(asked) % 2 :: 2] if asked and not draw.COUNT else places:
        repeated = np.insert(q, row, q[row] - noise, axis=0)
        found = timed(repeated)
        assert found.duration == pytest.approx(once, rel=differs) and found.s[-1] == 1.0
        np.testing.assert_allclose(found.q[[0, -1]], repeated[[0, -1]], atol=1e-12)


@pytest.mark.turns(3)
@pytest.mark.parametrize("between", ["joints", "spline", "tool"])
def test_several_rows_in_turn_that_repeat_one_are_no_stop(between: Between) -> None:
    """`retime` takes as long with two more rows at or near one as without, within 0.1 %."""
    middle, last = Q + np.array([0.2, 0.1, -0.3, 0.2, 0.1, -0.2, 0.4]), Q + 0.1
    for ends in ([], [last]):
        repeated = [[middle + shift for shift in shifts] for shifts in ([], [3e-9, 8e-10], [1e-5, 1.5e-5])]
        once, *took = (
            aa.retime(aa.JointPath.from_joints(ARM, [Q, middle, *rows, *ends], between=between), jerk=20.0)
            for rows in repeated
        )
        assert all(abs(found.duration / once.duration - 1) < 1e-3 for found in took)


@pytest.mark.turns(2)
@pytest.mark.parametrize("rest", [Q, np.zeros(7)])
@pytest.mark.parametrize("between", ["tool", "joints", "spline"])
@pytest.mark.parametrize("jerk", [None, JERK])
def test_joints_that_rest_take_no_time(rest: Array, between: Between, jerk: Array | None) -> None:
    """`retime` of equal rows has duration 0 and one row."""
    for count in (1, 3):
        path = aa.JointPath.from_joints(ARM, [rest] * count, between=between)
        motion = aa.retime(path, jerk=jerk, tool_speed=0.1)
        assert motion.duration == 0 and len(motion) == 1 and np.array_equal(motion.q, [rest])
        here = motion.at([0.0, 0.0])
        assert np.array_equal(here.q, [rest] * 2) and not here.qd.any() and not here.qdd.any()


@pytest.mark.turns(6)
@pytest.mark.parametrize("n", range(12))
def test_the_velocity_at_a_corner_between_equal_legs_jumps_by_what_a_cycle_allows(n: int) -> None:
    """At a corner of a plan joint velocities jump by at most acceleration times cycle."""
    random = np.random.default_rng(n)
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    path = None
    while path is None or not path.ok:
        q = random.uniform(arm.lower * 0.6, arm.upper * 0.6)
        first = arm.forward(q)[0]
        corner, last = first.copy(), first.copy()
        size = random.uniform(0.02, 0.1)
        corner[0, 3] += size
        last[:2, 3] = corner[:2, 3] + [0, size]
        path = aa.plan(arm, [aa.Line(first, corner), aa.Line(corner, last)], start=q)
    found = aa.retime(path, acceleration=5.0)
    low, high = 0.0, found.duration
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if found.at(middle).s < 0.5 else (low, middle)
    h = 2e-5
    before, here, after = found.at(np.array([low - h, low, low + h])).q
    assert np.abs((after - here) - (here - before)).max() / h <= 5.0 * (1e-3 + h) * 1.02


def test_motions_of_several_parts_take_what_these_take() -> None:
    """`retime` with jerk of joined plans takes at most 0.3 % longer than of each alone, together."""
    home = np.radians([0, 15, 0, -85, 0, 80, 0.0])
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    poses = [arm.forward(home)[0]]
    for place in ([0.5, -0.3, 0.45], [0.5, -0.3, 0.21], [0.5, -0.3, 0.45], [0.5, 0.3, 0.45]):
        poses.append(poses[0].copy())
        poses[-1][:3, 3] = place
    parts = []
    for first, last in pairwise(poses):
        parts.append(aa.plan(arm, aa.Line(first, last), start=parts[-1].q[-1] if parts else home))
    whole = aa.retime(aa.join(parts), acceleration=5.0, jerk=50.0).duration
    each = sum(aa.retime(part, acceleration=5.0, jerk=50.0).duration for part in parts)
    assert whole <= 1.003 * each


def test_a_speed_that_drops_at_a_blend_is_no_ramp() -> None:
    """`retime(tool_speed=)` keeps 95 % of the speed at blends of 5 mm, and says so if it loses any."""
    turned, arm = np.diag([-1.0, 1, -1]), aa.Arm.from_catalogue("kuka_iiwa14_r820")
    places = [0.45, -0.3, 0.3], [0.6, -0.1, 0.3], [0.45, 0.3, 0.3]
    corners = [aa.pose(place, matrix=turned) for place in places]
    path = aa.plan(arm, [aa.Line(a, b) for a, b in pairwise(corners)], blend=0.005)
    found = aa.retime(path, acceleration=5.0, jerk=200.0, tool_speed=0.01)
    t = np.linspace(0.0, found.duration, 20_001)
    way = np.diff(arm.forward(found.at(t).q)[0][:, :3, 3], axis=0)
    inner = (np.linalg.norm(way, axis=1) / t[1] / 0.01)[1000:-1000]
    assert inner.min() > 0.95 and np.median(inner) > 0.99
    assert inner.min() > 0.985 or found.speed_lost is not None


def test_a_polygon_of_planned_poses_is_rounded_at_its_corners_alone() -> None:
    """`retime` with jerk of a planned polygon takes at most 10 % longer than of the followed one."""
    turn = np.linspace(0, 2 * np.pi, 60)
    poses = np.tile(aa.pose([0, 0, 0.3], matrix=np.diag([-1.0, 1, -1])), (60, 1, 1))
    poses[:, 0, 3], poses[:, 1, 3] = 0.5 + 0.05 * np.cos(turn), 0.05 * np.sin(turn)
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    planned = aa.plan(arm, poses)
    held = aa.follow(arm, planned.poses, start=planned.q[0])
    one, other = (aa.retime(path, acceleration=5.0, jerk=50.0).duration for path in (planned, held))
    assert one < 1.1 * other


def test_a_place_lies_on_the_side_of_a_node_that_it_is_asked_for() -> None:
    """The parameter r of a stretch of the course rises with s, and its inverse gives s back."""
    course = _Course(0.2, 0.7)
    s = np.linspace(0.2, 0.7, 4001)
    r = course.r(s)
    assert (np.diff(r) > 0).all() and r[0] == 0 and r[-1] == 1
    assert np.abs(course.s(r) - s).max() < 1e-13
    near = 0.2 + np.logspace(-14, -8, 50)  # where s is flat no r is told by its s
    assert np.abs(course.r(near) - np.cbrt((near - 0.2) / 5)).max() < 5.1e-5
