"""Where a plan begins, and what it may cost: starts as robots have them, and limits of many turns."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.brute_force import planar_motion, turned_at_standing_tool
from support.calibrated import calibrated
from support.draw import COUNT, count, generator
from support.moves import DENSE, just_inside, limited, line, moved, proven, refused, slopes_hold
from support.planned_arms import IIWA

import armangle as aa

CALM = np.array([0.1, 0.6, 0.2, -1.2, 0.3, 0.8, 0.5])


def plain_line(start: np.ndarray = CALM) -> aa.Line:
    """A line of 15 cm from joints of the iiwa."""
    return line(IIWA, start, [0.05, 0.12, -0.07])


HURRIED: dict[str, list[list[float]]] = {  # joints at the start and at the end of a line
    "kuka_iiwa14_r820": [  # the start's interval parts at once: its other half alone leads on
        [-0.394, 0.0312, -0.8427, -1.4479, 1.6806, -0.1854, 2.9121],
        [-0.4904, 0.0664, -0.928, -1.785, 1.4269, 0.1391, 2.785],
    ],
    "yaskawa_sia5d": [  # joint 1 is on a limit, which one side of the arm angle leaves
        [-np.pi, 0.7968, -0.0348, -1.1431, 0.5487, -0.0503, 1.5117],
        [-3.1342, 0.8184, -0.0406, -1.1316, 0.5483, -0.0389, 1.5102],
    ],
}


@pytest.mark.parametrize("name", HURRIED)
@pytest.mark.parametrize("off", [0.0, 1e-6])
def test_next_to_a_singular_wrist_the_way_on_is_found(name: str, off: float) -> None:
    """A plan with a singularity margin is found from a start where joints turn fast with the arm angle."""
    arm = aa.Arm.from_catalogue(name).with_(singularity_margin=0.02)
    ends = np.add(HURRIED[name], [off, 0, 0, 0, 0, 0, 0])
    path = aa.plan(arm, aa.Line(*arm.forward(ends)[0]), start=ends[0])
    assert path.certified, path.explain()
    assert np.abs(path.q[0] - ends[0]).max() <= 1e-9


@pytest.mark.parametrize("off", [0.005, 0.011, 0.02, 0.03, 0.045])
@pytest.mark.parametrize("which", ["start", "goal"])
def test_a_start_beside_the_first_pose_is_taken_to_it(off: float, which: str) -> None:
    """A start or goal near the path's pose is moved onto it by at most START_GAP."""
    rng = np.random.default_rng(7)
    way = plain_line()
    path = way if which == "start" else aa.Line(way.end, way.start)
    for _ in range(6):
        beside = CALM + rng.uniform(-1, 1, 7) * off
        result = aa.plan(IIWA, path, **{which: beside}, samples=20)
        assert result.certified, result.explain()
        at = result.q[0 if which == "start" else -1]
        assert np.abs(at - beside).max() <= aa.motion.planning.START_GAP
        np.testing.assert_allclose(IIWA.forward(at)[0], way.start, atol=1e-12)


@pytest.mark.parametrize("off", [1e-4, 1e-2])
@pytest.mark.parametrize("which", ["start", "goal"])
@pytest.mark.parametrize("name", ["aldebaran_romeo_right", "jvrc1_left", "openarm_v10"])
def test_an_elbow_just_past_straight_is_taken_to_its_other_side(name: str, which: str, off: float) -> None:
    """A start or goal with the elbow past straight is moved to the side that the path needs."""
    arm = aa.Arm.from_catalogue(name)
    straight = (arm.geometry.delta - arm.geometry.offsets[3]) * arm.geometry.signs[3]
    way = 1.0 if arm.upper[3] - straight > straight - arm.lower[3] else -1.0
    middle = 0.5 * (np.maximum(arm.lower, -2.0) + np.minimum(arm.upper, 2.0)) + 0.3
    bent = np.clip(middle, arm.lower + 0.2, arm.upper - 0.2)
    past = bent.copy()
    past[3], bent[3] = straight - way * off, straight + way * 0.8
    ends = arm.forward(past)[0], arm.forward(bent)[0]
    result = aa.plan(arm, aa.Line(*(ends if which == "start" else ends[::-1])), **{which: past}, samples=20)
    assert result.ok, result.explain()
    at = result.q[0 if which == "start" else -1]
    assert np.abs(at - past).max() <= aa.motion.planning.START_GAP
    assert (way * (result.q[:, 3] - straight) >= 0).all()


def test_how_fast_a_start_is_left_does_not_count() -> None:
    """A plan may leave a start near a limit within a few of its 10000 rows."""
    near = CALM.copy()
    near[6] = IIWA.upper[6] - 0.001
    hurried = aa.Objective(limits=1e6)
    result = aa.plan(IIWA, plain_line(near), start=near, samples=10000, objective=hurried)
    assert result.certified
    assert np.abs(result.derivatives(1e-5)[0]).max() > 1e3
    np.testing.assert_allclose(result.q[0], near, atol=1e-9)


def wide(limits: dict[int, float]) -> aa.Arm:
    """The iiwa with other limits, deg, of some joints (1 to 7)."""
    arm = IIWA
    for joint, limit in limits.items():
        arm = limited(arm, joint - 1, -np.radians(limit), np.radians(limit))
    return arm


@pytest.mark.slow
@pytest.mark.parametrize("limit", [360, 540, 720, 1080, np.inf])
def test_many_turns_lose_nothing(limit: float) -> None:
    """With limits of many turns a plan costs no more than with the arm's own limits."""
    arm = wide(dict.fromkeys((1, 3, 5, 7), limit))
    if np.isinf(limit):  # on one side, of every joint
        arm = IIWA.with_(lower=np.full(7, -np.inf), upper=np.full(7, 3.0))
    result = aa.plan(arm, plain_line())
    assert result.certified
    own = aa.plan(IIWA, plain_line()).diagnosis.branches[0]
    assert result.diagnosis.branches[0].cost <= own.cost * (1 + 1e-6)


def test_turns_that_a_path_uses_up_are_found() -> None:
    """A plan for five turns of the tool begins with joint 7 far from its middle."""
    arm = wide({7: 1000})
    first = arm.forward(CALM)[0]
    path = aa.Screw(first, first[:3, 3], first[:3, 2], 10 * np.pi)
    result = aa.plan(arm, path)
    assert result.certified, result.explain()
    assert result.q[0, 6] < -10 and result.q[-1, 6] > 10


def test_the_hardest_limits_stay_within_200_megabytes() -> None:
    """Plans with a joint in a range of 2e-5 rad need less than 200 MB, in a process of their own."""
    program = """
import numpy as np, armangle as aa
from support.moves import DENSE, just_inside, limited, line, moved, proven, refused, slopes_hold
def peak():  # ru_maxrss would be that of the process that started this one, where it is larger
    return next(int(line.split()[1]) / 1024 for line in open("/proc/self/status") if line.startswith("VmHWM"))
arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
q = np.array([0.1, 0.6, 0.2, -1.2, 0.3, 0.8, 0.5])
poses = line(arm, q, [0.05, 0.12, -0.07]).pose(np.linspace(0, 1, 250))
aa.plan(arm, poses[:3])
before = peak()
for joint in (2, 4):
    aa.plan(limited(arm, joint, q[joint] - 1e-5, q[joint] + 1e-5), poses, start=q)
    print(peak() - before)
"""
    folder = {"PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env=os.environ | folder
    )
    assert max(map(float, done.stdout.split())) < 200, done.stdout


HOMES = np.radians(
    [[0, 0, 0, -90, 0, 90, 0], [0, 0, 0, 90, 0, -90, 0], [0, 45, 0, -90, 0, 0, 0], [30, 0, 20, -90, 0, 60, 0]]
)


FROM_HOME: list[tuple[aa.Arm, np.ndarray, float]] = [
    *((IIWA, home, tilt) for home in HOMES for tilt in (0.0, 1e-9, 1e-3, 0.01, 0.1)),
    *((calibrated(name, 1.0, 1.0, seed=1), np.radians([0, 30 * at, 0, -90, 0, 90 * (not at), 0]), 0.0)
      for name, at in (("kuka_iiwa7_r800", 0), ("kuka_iiwa14_r820", 1), ("realman_rm75_b", 0))),
]  # fmt: skip


@pytest.mark.turns(20)
@pytest.mark.slow
@pytest.mark.parametrize(("arm", "home", "tilt"), FROM_HOME)
def test_every_line_from_a_home_posture(arm: aa.Arm, home: np.ndarray, tilt: float) -> None:
    """Plans from home postures in 26 directions, and back, are certified and even."""
    start = home.copy()
    start[1 if home[1] == 0 else 5] = np.radians(tilt)
    ways = [np.array(d) for d in itertools.product((-1, 0, 1), repeat=3) if any(d)]
    for way in ways[:: 1 if COUNT else 4 if tilt == 0 else 6]:
        there = line(arm, start, 0.1 * way / np.linalg.norm(way))
        result = aa.plan(arm, there, start=start, samples=100)
        proven(result, start)
        assert np.abs(np.diff(result.q, axis=0)).max() < (0.02 if tilt < 1e-6 else 0.12)
        if tilt == 0:
            proven(aa.plan(arm, aa.Line(there.end, there.start), goal=start, samples=20), goal=start)


def test_a_way_from_home_is_found_however_many_rows_are_asked() -> None:
    """Plans of an OpenArm from θ2 = θ6 = 0 end alike for any `samples`."""
    arm = aa.Arm.from_catalogue("openarm_v10")
    rng = np.random.default_rng(3)
    for elbow in (90, 60):
        start = np.radians([0, 0, 0, elbow, 0, 0, 0])
        first = np.asarray(arm.forward(start)[0])
        for _ in range(4):
            last = first.copy()
            way = rng.normal(size=3)
            last[:3, 3] += 0.08 * way / np.linalg.norm(way)
            found = [aa.plan(arm, aa.Line(first, last), start=start, samples=n) for n in (2, 7, 50, 200, 333)]
            assert all(path.ok and path.q[0] == pytest.approx(start, abs=1e-9) for path in found)
            ends = np.array([path.q[-1] for path in found])
            assert np.ptp(ends, axis=0).max() < 0.01


@pytest.mark.parametrize("name", ["human_arm_left", "fourier_gr2t2_left", "galaxea_r1_pro_right"])
def test_a_free_plan_begins_with_the_arm_hanging_straight(name: str) -> None:
    """Where a plan with start leads from an arm hanging straight, one without start does."""
    arm = aa.Arm.from_catalogue(name)
    first = arm.forward(np.zeros(7))[0]
    rng = generator(5)
    for _ in range(5):
        last = first.copy()
        shift = rng.normal(size=3)
        outward = first[:3, 3] - arm.frames(np.zeros(7))[1, :3, 3]
        last[:3, 3] += 0.08 * shift / np.linalg.norm(shift) * -np.sign(shift @ outward)
        way = aa.Line(first, last)
        if aa.plan(arm, way, start=np.zeros(7)).ok:
            result = aa.plan(arm, way)
            assert result.ok, result.explain()
            assert np.abs(arm.forward(result.q)[0] - result.poses).max() < 1e-9


@pytest.mark.parametrize(("name", "text", "to", "asked"), [
    # a curve without joints was taken for one that is not proven: from this pose joint 1 cannot lead on
    ("simple_humanoid_left", "-.6050560801789915 1.6361016772885728 -.9813283651458146 0 -1.763707985202538 "
     "1.2982570805763118 1.0914565611217246",
     [0.02276728333166986, -0.07988904097440973, 0.05918945802999513],
     ()),
    # with theta_6 = 0 a limit of joint 5 opens at a single arm angle, and for no larger room
    ("yaskawa_sia5d", "-2.9397336249553474 .13351555769018164 -.7739007722896383 -.5690245240884177 0 0 .94",
     aa.pose([0.0, 0.02, 0.04], rotvec=[0.1, -0.05, 0.05]), ("start",)),
])  # fmt: skip
def test_a_plan_that_was_refused_or_had_no_joints(
    name: str, text: str, to: Any, asked: tuple[str, ...]
) -> None:
    """Plans from two difficult poses are ok and have joints in all rows."""
    arm, q = aa.Arm.from_catalogue(name), np.array(text.split(), float)
    first = arm.forward(q)[0]
    last = moved(first, to) if len(to) == 3 else first @ to
    result = aa.plan(arm, aa.Line(first, last), **dict.fromkeys(asked, q))
    assert result.ok and np.isfinite(result.q).all()
    assert result.certified or name == "yaskawa_sia5d"


@pytest.mark.slow
def test_planar_lines_pass_where_two_branches_meet() -> None:
    """Plans of lines in the arm's plane pass theta_2 or theta_6 = 0 with no larger step than the planar
    motion.
    """
    rng, crossed = generator(5), 0
    for _ in range(count(60 if COUNT else 40)):
        path, q = planar_motion(IIWA, rng)
        meets = bool((q[:, [1, 5]].min(axis=0) * q[:, [1, 5]].max(axis=0) < 0).any())
        result = aa.plan(IIWA, path, start=q[0], samples=len(q))
        proven(result, q[0])
        if meets:
            crossed += 1
            assert np.abs(np.diff(result.q, axis=0)).max() <= np.abs(np.diff(q, axis=0)).max() * (1 + 1e-9)
            assert result.diagnosis[int(result.gc[0])].through
    assert crossed >= 10


@pytest.mark.turns(4)
@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 0.01, 0.1, 1.0])
def test_refusals_of_singular_starts_are_not_refuted(tilt: float) -> None:
    """If `plan` finds no way from a start near theta_2 or theta_6 = 0, none is certified from joints that the
    self-motion reaches from there either.

    At exactly 0 joint 1 (5) may turn by itself as long as the tool has not begun to move; a plan, which
    follows s from the first, has no row for that, and so the law leaves it out.
    """
    move = 0.4 if tilt else 0.02
    rng = generator(11, int(1000 * tilt))
    for _ in range(count(12)):
        start = rng.uniform(IIWA.lower + 0.1, IIWA.upper - 0.1)
        joint = rng.choice([1, 5])
        start[joint] = np.radians(tilt) * rng.choice([-1, 1])
        shift = rng.normal(size=3)
        path = line(IIWA, start, 0.1 * shift / np.linalg.norm(shift))
        result = aa.plan(IIWA, path, start=start, samples=50)
        if result.ok:
            proven(result, start)
        elif aa.plan(IIWA, path, samples=2).ok:
            for q in turned_at_standing_tool(IIWA, start, move):
                assert not aa.plan(IIWA, path, start=q, samples=2).certified, (start, q)


def test_a_limit_just_inside_what_a_crossing_needs_is_not_certified() -> None:
    """A plan from home is not certified with a limit just inside its joints' range, and is just outside."""
    for home, shift in itertools.product(HOMES[[0, 3]], [[0.07, 0.03, 0.0], [-0.05, 0.04, 0.05]]):
        result = aa.plan(IIWA, line(IIWA, home, shift), start=home)
        assert result.certified and just_inside(result, where=lambda at: at > 0) > 3


def test_a_crossing_that_leaps_is_not_certified() -> None:
    """A curve whose stretch has the other root or another branch, so that joints leap, is not certified."""
    result = aa.plan(IIWA, line(IIWA, HOMES[0], [0.1, 0.0, 0.0]), start=HOMES[0])
    assert result.curve is not None
    x = result.curve
    led = np.flatnonzero(x.stretches[:, 22])
    assert len(led) and np.isin(x.stretches[led, 22], [1, 5]).all()
    for column, value in ((23, -x.stretches[led[-1], 23]), (2, x.stretches[led[-1], 2] + 1e-6)):
        broken = x.stretches.copy()
        broken[led[-1], column] = value
        curve = type(x)(x.segments, broken, x.plane, x.gc)
        ends = curve.at(IIWA._handle, broken[led[-1], :2] + [1e-12, -1e-12])
        broken[led[-1], 6:13], broken[led[-1], 14:21] = ends.q
        open_, _ = IIWA._handle.certify_curve(x.segments, broken, x.plane, x.gc, 0.0)
        assert len(open_)


def test_a_crossing_has_derivatives() -> None:
    """Derivatives of a plan from home equal finite differences; q' and q'' are continuous at the knots."""
    result = aa.plan(IIWA, line(IIWA, HOMES[0], [0.06, 0.05, -0.04]), start=HOMES[0])
    inner, s = result.curve.knots[1:-1], np.linspace(0.01, 0.99, 211)
    slopes_hold(result, s[np.abs(s[:, None] - result.curve.knots).min(axis=1) > 2e-6], atol=1e-6)
    across = result.derivatives(inner + 1e-9) - result.derivatives(inner - 1e-9)
    assert np.abs(across[:, 0]).max() < 1e-4 and np.abs(across[:, 1]).max() < 1e-1


def test_a_singularity_margin_leaves_no_crossing() -> None:
    """With a singularity margin no plan begins at home, where theta_2 = 0."""
    arm = IIWA.with_(singularity_margin=0.01)
    assert not aa.plan(arm, line(arm, HOMES[0], [0.1, 0, 0]), start=HOMES[0]).ok


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("joint", [1, 2, 3, 5, 6, 7])
@pytest.mark.parametrize("room", [0.0, 1e-9, 1e-7, 1e-5, 1e-4])
def test_a_locked_joint_leads(joint: int, room: float) -> None:
    """Where a plan leads with 2e-4 rad of room for a joint, one leads with less and with none."""
    rng, done = generator(21, joint), 0
    for _ in range(3):
        q = rng.uniform(-1, 1, 7)
        q[[1, 3, 5]] = 0.6, -1.2, 0.9
        way, at = line(IIWA, q, rng.normal(size=3) * 0.03), q[joint - 1]
        # a box of a hundredth of a degree, which arcs can follow, says whether there is a way
        if not aa.plan(limited(IIWA, joint - 1, at - 2e-4, at + 2e-4), way, start=q, samples=30).certified:
            continue
        done += 1
        result = aa.plan(limited(IIWA, joint - 1, at - room, at + room), way, start=q, samples=30)
        assert np.abs(proven(result, q).q[:, joint - 1] - at).max() <= room + 1e-9
    assert done


def test_no_joint_leaps_between_rows_that_are_left_to_plan() -> None:
    """Without `samples` a plan has so many rows that no joint moves farther than ROW_STEP."""
    rng = generator(31)
    for _ in range(count(30)):
        start = rng.uniform(IIWA.lower + 0.09, IIWA.upper - 0.09)
        shift = rng.normal(size=3)
        result = aa.plan(IIWA, line(IIWA, start, shift * rng.uniform(0.05, 0.5)), start=start)
        assert not result.certified or np.abs(np.diff(result.q, axis=0)).max() <= aa.motion.planning.ROW_STEP
    first = wide({7: 7000}).forward(CALM)[0]
    turns = aa.plan(wide({7: 7000}), aa.Screw(first, first[:3, 3], first[:3, 2], 20 * np.pi), start=CALM)
    assert turns.certified and len(turns) > 200
    assert np.abs(np.diff(turns.q, axis=0)).max() <= aa.motion.planning.ROW_STEP


@pytest.mark.parametrize("samples", [2, 10, 30, 200])
def test_joints_that_share_a_turn_all_along_hold_the_tool_between_rows(samples: int) -> None:
    """A plan at one pose with theta_2 = 0 turns joints 1 and 3 against each other, and holds the tool."""
    arm = aa.Arm.from_catalogue("rokae_ar5_left")
    q = np.array([-2.99, 0.0, 1.98, 1.89, 2.49, 0.0, -0.3])
    pose = arm.forward(q)[0]
    turned = q + np.array([0.2, 0, -0.2, 0, 0, 0, 0])
    result = aa.plan(arm, aa.Line(pose, pose), start=q, goal=turned, samples=samples)
    assert result.certified, result.explain()
    here = result.at(DENSE).q
    assert np.ptp(here[:, 0]) > 0.1
    np.testing.assert_allclose(arm.forward(here)[0], np.broadcast_to(pose, (len(here), 4, 4)), atol=1e-14)
    np.testing.assert_allclose(here[:, 0] + here[:, 2], q[0] + q[2], atol=1e-13)


@pytest.mark.parametrize("word", ["policy", "seed", "dt", "velocity"])
def test_plan_says_which_argument_to_give(word: str) -> None:
    """`plan` names the argument to use for one that belongs to other calls."""
    refused(aa.InputError, f"plan takes no {word}=: ", aa.plan, IIWA, plain_line(), **{word: 0.1})
    refused(TypeError, "unexpected", aa.plan, IIWA, plain_line(), nonsense=1)


@pytest.mark.parametrize(("start", "shift"), [
    (np.radians([0.0, 0, 0, -90, 0, 90, 0]), (0.0, 0.9, 0.3)),
    # a first curve of it breaks a limit early; with more sections there it does not
    (np.array([1.099, 0.0, 1.387, -1.093, -1.154, 1.182, -0.297]), (-0.71, 0.164, -0.528)),
])  # fmt: skip
def test_a_plan_from_home_that_fails_says_how_far_it_leads(
    start: np.ndarray, shift: tuple[float, ...]
) -> None:
    """A plan from home out of reach has rows as far as `follow` leads."""
    way = line(IIWA, start, shift)
    plan = aa.plan(IIWA, way, start=start)
    steps = aa.follow(IIWA, way.pose(plan.s), start=start)
    assert not plan.ok and plan.diagnosis.reached > 0.95 * steps.s[steps.first_failure]
    led_up_to(IIWA, plan, steps)


def led_up_to(arm: aa.Arm, plan: aa.JointPath, steps: aa.JointPath) -> None:
    """Check that a failed plan has rows up to where it leads, on their poses and within limits."""
    done = plan.status == aa.Status.OK
    assert done.sum() > 0.9 * steps.first_failure
    assert plan.diagnosis.reached - 0.01 < plan.s[done].max() <= plan.diagnosis.reached
    assert np.abs(arm.forward(plan.q[done], on_error="nan")[0] - plan.poses[done]).max() < 1e-9
    assert arm.within_limits(plan.q[done]).all()


@pytest.mark.parametrize(
    ("name", "theta_2", "theta_6"), [("kuka_iiwa7_r800", 40, 90), ("realman_rm75_b", 20, -30)]
)
def test_a_plan_that_fails_behind_a_change_of_branch_says_how_far_it_leads(
    name: str, theta_2: float, theta_6: float
) -> None:
    """A plan that ends behind a change of branch names the branch, and has rows as far as `follow` leads."""
    arm = aa.Arm.from_catalogue(name)
    start = np.radians([0, theta_2, 0, -70, 0, theta_6, 0])
    end = np.radians([0, theta_2, 0, -70, 0, 40, 0] if theta_6 < 0 else [0, -theta_2, 0, -70, 0, theta_6, 0])
    first, last = arm.forward(start)[0], arm.forward(end)[0]
    assert aa.plan(arm, aa.Line(first, last), start=start).certified
    path = [aa.Line(first, last), aa.Screw(last, last[:3, 3], last[:3, 2], 4.4 * np.pi)]
    plan = aa.plan(arm, path, start=start)
    assert not plan.ok
    branch = next(branch for branch in plan.diagnosis.branches if not branch.elsewhere)
    assert branch.verdict == aa.types.Verdict.DEAD_END and branch.through
    assert branch.s_from == branch.reached == plan.diagnosis.reached
    assert f"GC {branch.through[0]}" in plan.explain()
    steps = aa.follow(arm, plan.poses, start=start)
    assert not steps.ok and plan.diagnosis.reached > 0.95 * plan.s[steps.first_failure]
    led_up_to(arm, plan, steps)


@pytest.mark.parametrize("away", [0.0, 0.2])
def test_a_start_outside_the_limits_is_called_that(away: float) -> None:
    """`explain` of a plan from beyond a limit says so once, at a home posture too."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.array([0.0, away, away, arm.lower[3] - 0.2, 0.0, 1.5, 0.0])
    text = aa.plan(arm, line(arm, q, 0.05), start=q).explain()
    assert text.count("start lies outside the limits") == 1 and "lower one" in text


@pytest.mark.turns(6)
@pytest.mark.parametrize(
    "home", [[0, 0, 0, -90, 0, 90, 0], [0, 0, 0, -90, 0, 45, 0], [0, 30, 0, -90, 0, 0, 0]]
)
@pytest.mark.parametrize("off", [1e-5, 1e-3, 0.03])
def test_a_start_beside_home_is_taken_to_it(home: list[float], off: float) -> None:
    """A plan from joints read with noise at a home posture is certified and begins within twice the noise."""
    q = np.radians(home)
    way = line(IIWA, q, [-0.05, 0.2, 0.0])
    for noise in generator(int(1e5 * off), 12).uniform(-off, off, (8, 7)):
        path = aa.plan(IIWA, way, start=q + noise)
        assert path.certified and np.abs(path.q[0] - q - noise).max() <= 2 * off


@pytest.mark.parametrize("off", [0.0, 0.01])
def test_leaving_home_takes_hardly_longer_than_holding_the_arm_angle(off: float) -> None:
    """A plan from home takes at most 5 % longer than `follow` with Hold, after `retime`."""
    pytest.importorskip("scipy")
    for theta_2 in (off, -off):
        q = np.array([0, theta_2, 0, -np.pi / 2, 0, np.pi / 2, 0])
        way = line(IIWA, q, [0.0, 0.2, 0.0])
        asked = {"velocity": 1.0, "acceleration": 4.0}
        plan = aa.retime(aa.plan(IIWA, way, start=q), **asked).duration
        held = aa.follow(IIWA, way, start=q, policy=aa.Hold(), samples=300)
        assert plan < 1.05 * aa.retime(held, **asked, tolerance=1e-4).duration


@pytest.mark.parametrize("wish", [0.8, -1.2, aa.Towards(direction="left"), aa.Towards(point=[0, 1, 0.5])])
def test_a_wish_counts_from_home(wish: float | aa.Towards) -> None:
    """The more a wish for psi or the elbow weighs, the nearer a plan from home ends to it."""
    q = np.radians([0, 0, 0, -90, 0, 90, 0])
    way = line(IIWA, q, [0.1, 0.2, -0.15])
    policy = wish if isinstance(wish, aa.Towards) else aa.Towards(psi=wish)
    wanted = aa.follow(IIWA, way, start=q, policy=policy, samples=400).psi[-1]
    gaps = []
    for weight in (0.1, 10, 1000):
        path = aa.plan(IIWA, way, start=q, psi=wish, objective=aa.Objective(psi=weight))
        assert path.certified
        gaps.append(abs(path.psi[-1] - wanted))
    assert gaps[0] > gaps[1] > gaps[2] and gaps[2] < 0.2


def test_limits_that_a_motion_cannot_reach_are_no_work() -> None:
    """Plans of an arm with limits of two turns either way are certified."""
    q = np.array([2.36809146, -1.39585455, -4.58551256, 2.78330457, 0.31861181, -2.38457092, -0.17799813])
    wide = IIWA.with_(lower=np.full(7, -4 * np.pi), upper=np.full(7, 4 * np.pi))
    way = line(IIWA, q, [-0.01036909, 0.06271804, 0.11947449])
    rng = generator(13)
    for _ in range(8):
        assert aa.plan(wide, way).certified
        q = rng.uniform(-2.5, 2.5, 7)
        q[3] = rng.uniform(-2, -0.6)
        way = line(IIWA, q, rng.normal(size=3) * 0.05)


def test_joints_without_a_finite_speed_are_said() -> None:
    """Where a line begins as a square root derivatives are NaN, and `retime` says that no speed is finite."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.radians([-45, 0, 90, -90, 90, -90, -135.0])
    first = arm.forward(q)[0]
    last = first.copy()
    last[0, 3] += 0.2
    path = aa.plan(arm, aa.Line(first, last), start=q)
    assert not path.certified
    assert np.isnan(path.derivatives(0.0)).all() and np.isfinite(path.derivatives(0.01)).all()
    with pytest.raises(aa.PathError, match="joints have no finite speed along the path"):
        aa.retime(path, acceleration=5.0)


@pytest.mark.turns(2)
@pytest.mark.parametrize("hinge", [1, 5])
@pytest.mark.parametrize("end", ["start", "goal"])
def test_a_home_posture_belongs_to_both_branches_that_may_be_asked(hinge: int, end: str) -> None:
    """From θ2 or θ6 = 0 a plan begins in either of two branches, or says why not."""
    rng, found = np.random.default_rng(3), []
    for _ in range(6):
        home = np.radians([0.0, 40, 0, -90, 0, 60, 0])
        home[hinge] = 0.0
        home[[0, 2, 4, 6]] = rng.uniform(-0.6, 0.6, 4)
        pose, _, gc = IIWA.forward(home)
        away = pose.copy()
        direction = rng.normal(size=3)
        away[:3, 3] += 0.1 * direction / np.linalg.norm(direction)
        way = aa.Line(pose, away) if end == "start" else aa.Line(away, pose)
        branches = [int(gc), int(gc) ^ (1 if hinge == 1 else 4)]
        if not aa.plan(IIWA, way, gc=branches, samples=40, **{end: home}).ok:
            continue
        one = [aa.plan(IIWA, way, gc=branch, samples=40, **{end: home}) for branch in branches]
        found.append([result.certified for result in one])
        for branch, result in zip(branches, one, strict=True):
            if not result.ok:
                assert "another global configuration" not in result.explain()
                continue
            np.testing.assert_allclose(result.q[0 if end == "start" else -1], home, atol=1e-9)
            assert set(IIWA.forward(result.q[1:-1])[2].tolist()) == {branch}
    assert len(found) > 3 and np.any(found, axis=0).all() and np.mean(np.any(found, axis=1)) > 0.8


def test_a_plan_that_fails_is_drawn_as_finely_as_one_that_does_not() -> None:
    """A failed plan has enough rows, as far as it leads, that no joint moves by over 0.2 rad."""
    rng, led = np.random.default_rng(1), []
    middle, half = 0.5 * (IIWA.lower + IIWA.upper), 0.45 * (IIWA.upper - IIWA.lower)
    while len(led) < 12:
        start = middle + half * rng.uniform(-1, 1, 7)
        pose = IIWA.forward(start)[0]
        last = moved(pose, 0.5 * (direction := rng.normal(size=3)) / np.linalg.norm(direction))
        result = aa.plan(IIWA, aa.Line(pose, last), start=start)
        reached = np.isfinite(result.q).all(axis=1)
        if result.ok or reached.sum() < 2:
            continue
        rows = result.q[reached]
        led.append(len(rows) / (1 + 199 * result.s[reached][-1]))
        assert np.abs(np.diff(rows, axis=0)).max() < 0.2001
        assert (np.diff(result.s) > 0).all() and result.s[0] == 0 and result.s[-1] == 1
        assert np.flatnonzero(reached).tolist() == list(range(len(rows)))
    assert max(led) > 1.02, "no path had rows put between"


@pytest.mark.turns(2)
@pytest.mark.parametrize("tilt", [0, 30])
@pytest.mark.parametrize("end", ["start", "goal"])
def test_an_arm_that_stands_across_its_way_leaves_home_as_the_root_of_s(end: str, tilt: float) -> None:
    """A plan of an OpenArm from θ2 = 0 moves its joints as the root of s at first, and holds the pose."""
    arm = aa.Arm.from_catalogue("openarm_v10")
    home = np.radians([0.0, 0, 0, 90, 0, tilt, 0])
    assert np.linalg.svd(arm.jacobian(home))[1][5] < 1e-12
    directions = np.random.default_rng(0).normal(size=(8, 3))
    near = np.geomspace(1e-7, 1e-3, 41)
    for direction in directions / np.linalg.norm(directions, axis=1)[:, None]:
        result = aa.plan(arm, line(arm, home, 0.1 * direction, back=end == "goal"), **{end: home})
        assert result.ok, result.explain()
        assert np.ptp(result.uncertified, axis=1).sum() < 1e-6
        np.testing.assert_allclose(result.q[0 if end == "start" else -1], home, atol=1e-9)
        from_home = np.append(0.0, near)
        q = result.at(from_home if end == "start" else 1 - from_home[::-1]).q
        turned = np.abs(q - home).max(axis=1)[1:] if end == "start" else np.abs(q - home).max(axis=1)[-2::-1]
        assert (turned < 3 * np.sqrt(near)).all()
        here = result.at(DENSE)
        np.testing.assert_allclose(arm.forward(here.q)[0], here.pose, atol=1e-12)
        assert arm.limit_margin(here.q).min() > -1e-9
