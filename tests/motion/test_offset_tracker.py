"""The tracker of an arm with an offset wrist or shoulder: on the hand where it can be, within bounds."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from motion.test_offset_steps import ARMS, FR3, READY, motion
from support.calibrated import calibrated

import armangle as aa


def run(tracker: aa.Tracker, poses: Any) -> list[aa.types.Tracked]:
    """The results of a tracker's cycles for poses (n, 4, 4)."""
    return [tracker.step(pose) for pose in poses]


def keeps_bounds(arm: aa.Arm, q0: Any, ticks: list[aa.types.Tracked], dt: float, hardest: float) -> None:
    """Check speeds, accelerations and limits of the joints of cycles that begin at rest at q0."""
    q = np.vstack([q0, *(now.q for now in ticks)])
    v = np.vstack([np.zeros(7), np.diff(q, axis=0) / dt])
    assert (np.abs(v) <= arm.velocity + 1e-9).all()
    assert (np.abs(np.diff(v, axis=0)) <= hardest * dt + 1e-9).all()
    assert (arm.limit_margin(q) >= -1e-9).all()


FETCH = calibrated("fetch", 1.0, 1.0)
CHAINS = [
    calibrated("franka_fr3", 1.0, 1.0),
    calibrated("franka_fr3", 20.0, 10.0),
    FETCH.with_(lower=np.maximum(FETCH.lower, -3.0), upper=np.minimum(FETCH.upper, 3.0)),
]


@pytest.mark.turns(2)
@pytest.mark.parametrize("arm", [*ARMS, *CHAINS], ids=lambda arm: f"{arm.name} {arm.kind}")
def test_a_slow_hand_is_followed_exactly_and_bounds_are_kept(arm: aa.Arm) -> None:
    """A tracker keeps its bounds, and is on the hand to 1e-9 m whenever it says FOLLOWING."""
    arm = arm.with_(velocity=np.minimum(arm.velocity, 3.0))
    following = late = nearest = total = 0
    for seed in range(4):
        poses, q = motion(arm, np.random.default_rng(seed), 1500, 0.3)
        tracker = aa.Tracker(arm, dt=0.004)
        tracker.start(q[0])
        ticks = run(tracker, poses)
        keeps_bounds(arm, q[0], ticks, 0.004, 10.0)
        for now, pose in zip(ticks[::25], poses[::25], strict=True):
            reached, free, gc = arm.forward(now.q)
            assert now.gc == gc and abs(np.angle(np.exp(1j * (now.psi - free)))) < 1e-12
            off = np.linalg.norm(reached[:3, 3] - pose[:3, 3])
            if now.status == aa.Tracking.FOLLOWING:
                assert off <= 1e-9
            assert off <= now.distance + 1e-9
        late += sum(now.why is aa.Status.NO_CONVERGENCE for now in ticks)
        following += sum(now.status == aa.Tracking.FOLLOWING for now in ticks)
        nearest += sum(now.status == aa.Tracking.NEAREST for now in ticks)
        total += len(ticks)
    assert following >= 0.8 * (total - nearest) and late <= 0.03 * total


def test_a_far_hand_stops_the_tool_at_the_reach_and_a_jump_is_a_motion() -> None:
    """A tracker rests NEAREST to a hand out of reach, and follows again after the hand jumps back."""
    tracker = aa.Tracker(FR3, dt=0.004)
    tracker.start(READY)
    far = FR3.forward(READY)[0].copy()
    far[0, 3] += 2.0
    ticks = run(tracker, [far] * 3000)
    keeps_bounds(FR3, READY, ticks, 0.004, 10.0)
    assert ticks[-1].status == aa.Tracking.NEAREST and ticks[-1].why is aa.Status.UNREACHABLE
    assert np.abs(ticks[-1].velocity).max() < 1e-3
    back = FR3.forward(READY)[0]
    ticks = run(tracker, [back] * 2500)
    keeps_bounds(FR3, tracker.q, ticks[-1:], 0.004, 10.0)
    assert ticks[-1].status == aa.Tracking.FOLLOWING and ticks[-1].distance < 1e-9


def test_what_is_no_pose_moves_nothing_wrong() -> None:
    """A tracker stays where it is for a pose of NaN and for no poses."""
    tracker = aa.Tracker(FR3, dt=0.004)
    tracker.start(READY)
    now = tracker.step(np.full((4, 4), np.nan))
    assert np.isfinite(now.q).all() and np.abs(now.q - READY).max() < 1e-9
    np.testing.assert_array_equal(tracker.run(np.empty((0, 4, 4))), np.empty((0, 7)))


@pytest.mark.parametrize("arm", CHAINS, ids=lambda arm: f"{arm.name} {arm.kind}")
def test_a_target_at_rest_is_reached_by_the_true_arm_and_a_copy_goes_on_alike(arm: aa.Arm) -> None:
    """A calibrated arm's tracker reaches a pose exactly, and a copy of it returns the same joints to
    the bit.
    """
    rng, reached = np.random.default_rng(4), 0
    arm = arm.with_(velocity=np.minimum(arm.velocity, 3.0))
    lower, upper = np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0)
    for start, goal in 0.5 * (lower + upper) + 0.4 * (upper - lower) * rng.uniform(-1, 1, (3, 2, 7)):
        pose, tracker = arm.forward(goal)[0], aa.Tracker(arm, dt=0.004).start(start)
        ticks = run(tracker, [pose] * 1000)
        other = copy.deepcopy(tracker)
        ticks += run(tracker, [pose] * 1500)
        np.testing.assert_array_equal(
            [now.q for now in run(other, [pose] * 1500)], [now.q for now in ticks[1000:]]
        )
        keeps_bounds(arm, start, ticks, 0.004, 10.0)
        last = ticks[-1]
        off = np.linalg.norm(arm.forward(last.q)[0][:3, 3] - pose[:3, 3])
        assert off <= last.distance + 1e-9
        reached += last.status == aa.Tracking.FOLLOWING and off < 1e-9
    assert reached >= 2  # the other is still on its way
