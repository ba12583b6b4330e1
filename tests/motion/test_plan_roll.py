"""Plans whose roll is free: joint 7 stays, the tool's axis is held, and no roll costs less."""

from __future__ import annotations

import numpy as np
import pytest
from support import moves
from support.draw import count, generator
from support.moves import moved, slopes_hold
from support.planned_arms import IIWA, random_arm

import armangle as aa

DENSE = np.linspace(0, 1, 3001)
TRAVEL = aa.Objective(limits=0, singularities=0, travel=1)
POSTURE = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])


def along_axis_7(arm: aa.Arm) -> aa.Arm:
    """The arm with a tool whose z axis is axis 7."""
    return arm.with_(tool=aa.pose([0, 0, 0.13]))


def lines(seed: int, number: int) -> list[tuple[aa.Arm, np.ndarray, aa.Line]]:
    """Random arms, joints within their limits, and lines of some cm from there."""
    rng = generator(16, 40, seed)
    found = []
    for _ in range(number):
        arm = along_axis_7(random_arm(rng))
        q = rng.uniform(arm.lower + 0.15, arm.upper - 0.15)
        found.append((arm, q, moves.line(arm, q, rng.uniform(-0.15, 0.15, 3))))
    return found


def travel(q: np.ndarray) -> float:
    """What joints 1 to 6 travel: the integral of |dq/ds|²."""
    return float((np.diff(q[:, :6], axis=0) ** 2).sum() * (len(q) - 1))


@pytest.mark.turns(2)
@pytest.mark.parametrize("seed", range(6))
def test_joint_7_stays_and_the_axis_is_held(seed: int) -> None:
    """A plan with free roll keeps joint 7 and the tool's z axis and position."""
    whole = 0
    for arm, q, path in lines(seed, count(4)):
        result = aa.plan(arm, path, start=q, roll="free", samples=30)
        if not result.ok:
            continue
        whole += result.certified
        at = result.at(DENSE)
        assert np.ptp(at.q[:, 6]) == 0 and at.q[0, 6] == q[6] and np.abs(at.q[0] - q).max() < 1e-8
        np.testing.assert_allclose(at.pose[:, :3, 2:], path.pose(DENSE)[:, :3, 2:], atol=1e-11)
        np.testing.assert_allclose(arm.forward(at.q)[0], at.pose, atol=1e-12)
        np.testing.assert_allclose(arm.forward(result.q)[0], result.poses, atol=1e-12)
        np.testing.assert_allclose(arm.limit_margin(result.q), result.margin, atol=1e-12)
        assert arm.within_limits(at.q).all() or not result.certified
        slopes_hold(result, [0.31, 0.77])
    assert whole


def test_no_roll_that_is_asked_moves_the_other_joints_less() -> None:
    """With free roll joints 1 to 6 travel no more than with the path's roll, or in `follow`."""
    compared = 0
    for arm, q, path in lines(11, count(12)):
        free = aa.plan(arm, path, start=q, roll="free", objective=TRAVEL, samples=20)
        asked = aa.plan(arm, path, start=q, objective=TRAVEL, samples=20)
        followed = aa.follow(arm, path, start=q, roll="free", policy=aa.Hold(), samples=200)
        if asked.certified:
            assert free.certified, free.explain()
            compared += 1
            assert travel(free.at(DENSE).q) <= travel(asked.at(DENSE).q) * (1 + 1e-6)
        one_branch = followed.ok and (followed.gc == followed.gc[0]).all()
        if one_branch and np.abs(np.diff(followed.q, axis=0)).max() < 0.05:
            assert free.certified, free.explain()
            compared += 1
            assert travel(free.at(DENSE).q) <= travel(followed.q) * (1 + 1e-3)
    assert compared > 4


def test_whatever_roll_the_path_asks_the_joints_are_the_same() -> None:
    """With free roll a path that spins the tool is planned like one that does not."""
    arm = along_axis_7(IIWA)
    first = arm.forward(POSTURE)[0]
    centre, axis = first[:3, 3], first[:3, 2]
    still = aa.Screw(first, centre, axis, 0.0, advance=0.12)
    drill = aa.Screw(first, centre, axis, 12 * np.pi, advance=0.12)
    assert not aa.plan(arm, drill, start=POSTURE).ok
    plain, turned = (aa.plan(arm, path, start=POSTURE, roll="free") for path in (still, drill))
    assert plain.certified and turned.certified
    np.testing.assert_allclose(turned.at(DENSE).q[-1, 6], POSTURE[6])
    assert travel(turned.at(DENSE).q) == pytest.approx(travel(plain.at(DENSE).q), rel=0.05)


def test_without_start_joint_7_stands_in_the_middle_and_times_hold() -> None:
    """With free roll and no start joint 7 is at the middle of its limits, and stays there in `retime`; with a
    goal it is where the goal has it.
    """
    pytest.importorskip("scipy")
    arm = along_axis_7(IIWA)
    first = arm.forward(POSTURE)[0]
    last = moved(first, [0.05, 0.1, -0.1])
    result = aa.plan(arm, aa.Line(first, last), roll="free")
    assert result.certified
    assert (result.q[:, 6] == 0).all()
    timed = aa.retime(result, acceleration=5.0)
    assert (timed.qd[:, 6] == 0).all()
    back = aa.plan(arm, np.array([last, first]), goal=POSTURE, roll="free")
    assert back.certified and (back.q[:, 6] == POSTURE[6]).all()


def test_what_a_free_roll_is_not_for() -> None:
    """`plan` with free roll refuses a start and goal whose joint 7 differ, or are outside limits or
    margin.
    """
    first = IIWA.forward(POSTURE)[0]
    with pytest.raises(aa.InputError, match=r"in start and goal it is 0\.3 rad apart"):
        aa.plan(IIWA, first[None], start=POSTURE, goal=np.append(POSTURE[:6], 0.8), roll="free")
    with pytest.raises(aa.InputError, match="joint 7 of start stands outside its limits"):
        aa.plan(IIWA, first[None], start=np.append(POSTURE[:6], 5.0), roll="free")
    near = np.append(POSTURE[:6], IIWA.upper[6] - 0.01)
    with pytest.raises(aa.InputError, match=r"joint 7 of start stays 0\.01 off"):
        aa.plan(IIWA, first[None], start=near, limit_margin=0.05, roll="free")


@pytest.mark.parametrize("room", [(2, 5), (0.05, 6.28), (3.2, 3.2), (7, 8), (-6, -3.3), (-9, 1)])
def test_joint_7_stays_within_a_range_beyond_half_a_turn(room: tuple[float, float]) -> None:
    """A plan with free roll keeps limits of joint 7 that are not around 0, or beyond ±π."""
    lower, upper = IIWA.lower.copy(), IIWA.upper.copy()
    lower[6], upper[6] = room
    arm = IIWA.with_(lower=lower, upper=upper)
    q = [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, room[0]]
    first = arm.forward(q)[0]
    last = first + 0.05 * np.eye(4)[:, [3, 3, 3, 2]] * [0, 0, 0, 1]
    for ends in ({}, {"start": q}):
        result = aa.plan(arm, aa.Line(first, last), roll="free", **ends)
        assert result.certified and arm.within_limits(result.q, 1e-9).all()
