"""`Tracker(detours=)`: whether the tool may leave the hand, unasked, to find another way."""

from __future__ import annotations

import numpy as np
import pytest

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa14_r820").with_body(aa.Body.bones(upper_arm=0.07, forearm=0.06))
START, END = np.radians([[-25, 30, 0, -80, 0, 70, 0], [25, 30, 0, -80, 0, 70, 0]])
DT = 0.004


def farthest(detours: bool, seconds: float = 12.0) -> tuple[set[aa.Tracking], float, aa.Tracked]:
    """A hand that goes through a post and rests behind it: statuses, and how far the tool came from it."""
    first, last = ARM.forward(START)[0], ARM.forward(END)[0]
    middle = ARM.forward(0.5 * (START + END))[0]
    post = aa.Box(aa.pose(middle[:3, 3]), [0.4, 0.06, 0.5], name="post")
    tracker = aa.Tracker(ARM, DT, scene=aa.Scene([post], clearance=0.01), detours=detours)
    tracker.start(START)
    seen, far = set(), 0.0
    for k in range(round(seconds / DT)):
        hand = first.copy()
        hand[:3, 3] += min(k * DT / 2, 1.0) * (last - first)[:3, 3]
        now = tracker.step(hand)
        seen.add(now.status)
        if k * DT > 3.0:
            far = max(far, float(np.linalg.norm(ARM.forward(now.q)[0][:3, 3] - hand[:3, 3])))
    return seen, far, now


def test_without_detours_it_stays_as_near_as_it_comes_and_says_so() -> None:
    seen, far, now = farthest(detours=False)
    assert aa.Tracking.TURNING not in seen
    assert (now.status, now.why) == (aa.Tracking.NEAREST, aa.Status.CLEARANCE)
    assert np.abs(now.velocity).max() < 1e-3 and far < 0.4


def test_a_branch_that_is_asked_for_is_gone_to_all_the_same() -> None:
    tracker = aa.Tracker(ARM, DT, detours=False)
    tracker.start(START)
    hand = ARM.forward(START)[0]
    to = tracker.step(hand).gc ^ 4
    for _ in range(3000):
        now = tracker.step(hand, reconfigure=to)
        if now.gc == to and now.status == aa.Tracking.FOLLOWING:
            break
    assert (now.gc, now.status) == (to, aa.Tracking.FOLLOWING)


@pytest.mark.parametrize("value", [0, 1, "no", None])
def test_it_is_yes_or_no(value: object) -> None:
    with pytest.raises(aa.InputError, match="detours"):
        aa.Tracker(ARM, detours=value)  # type: ignore[arg-type]  # wrong on purpose
