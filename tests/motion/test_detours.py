"""`Tracker(detours=)`: whether the tool may leave the hand, unasked, to find another way."""

from __future__ import annotations

import numpy as np
import pytest
from support.moves import begun

import armangle as aa

IIWA = aa.Arm.from_catalogue("kuka_iiwa14_r820")
ARM = IIWA.with_(
    body=aa.Body.bones(upper_arm=0.08, forearm=0.07),
    hand=[aa.Capsule([0, 0, 0.02], [0, 0, 0.08], 0.04, name="gripper")],
)
TABLE = aa.Box(aa.pose([0.6, 0, -0.05]), [1.2, 1.6, 0.1], name="table")
WALL = aa.Box(aa.pose([0.55, -0.25, 0.2]), [0.5, 0.04, 0.4], name="wall")
SCENE = aa.Scene([TABLE, WALL], clearance=0.02)
HAND = aa.pose([0.5, 0, 0.3], rpy=[np.pi, 0, 0])
START = ARM.with_(scene=SCENE).solve(HAND, seed=np.radians([0, 40, 0, -90, 0, 50, 0])).q
DT = 0.004


def behind_the_wall(detours: bool) -> tuple[set[aa.Tracking], float, aa.types.Tracked]:
    """Track a hand that goes through the wall and rests; return all statuses, the tool's greatest height (m)
    and the last cycle.
    """
    tracker = begun(START, ARM.with_(scene=SCENE), DT, detours=detours)
    seen, highest = set(), 0.0
    for k in range(round(12.0 / DT)):
        hand = HAND.copy()
        hand[1, 3] = -0.25 * min(max(k * DT - 1.0, 0.0), 2.0)
        now = tracker.step(hand)
        seen.add(now.status)
        highest = max(highest, float(ARM.forward(now.q)[0][2, 3]))
    return seen, highest, now


def test_with_detours_it_goes_round() -> None:
    """A tracker with detours leads the tool over the wall (TURNING) and then follows the hand."""
    seen, highest, now = behind_the_wall(detours=True)
    assert aa.Tracking.TURNING in seen and now.status == aa.Tracking.FOLLOWING
    assert highest > 0.6  # over the wall, the hand at 0.3 m


def test_without_detours_it_stays_as_near_as_it_comes_and_says_so() -> None:
    """A tracker without detours rests before the wall: NEAREST because of CLEARANCE to the wall."""
    seen, highest, now = behind_the_wall(detours=False)
    assert aa.Tracking.TURNING not in seen
    assert (now.status, now.why) == (aa.Tracking.NEAREST, aa.Status.CLEARANCE)
    assert now.pair is not None and now.pair[0] == "wall"
    assert np.abs(now.velocity).max() < 1e-3 and highest < 0.5


def test_a_branch_that_is_asked_for_is_gone_to_all_the_same() -> None:
    """Without detours `reconfigure` still brings the arm into another branch."""
    tracker = begun(START, IIWA, DT, detours=False)
    hand = IIWA.forward(START)[0]
    to = tracker.step(hand).gc ^ 4
    for _ in range(3000):
        now = tracker.step(hand, reconfigure=to)
        if now.gc == to and now.status == aa.Tracking.FOLLOWING:
            break
    assert (now.gc, now.status) == (to, aa.Tracking.FOLLOWING)


@pytest.mark.parametrize("value", [0, 1, "no", None])
def test_detours_is_a_bool(value: object) -> None:
    """`Tracker` refuses `detours` that is no bool."""
    with pytest.raises(aa.InputError, match="detours"):
        aa.Tracker(IIWA, detours=value)  # type: ignore[arg-type]  # wrong on purpose
