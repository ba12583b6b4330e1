"""Laws of the tracker on nearly S-R-S arms: the true tool is where the hand is, and all bounds hold."""

from __future__ import annotations

import numpy as np
import pytest
from support import streams
from support.calibrated import ARMS, Array, calibrated
from support.moves import begun, moved
from support.ticks import DT, settled

import armangle as aa

FASTEST, HARDEST = 2.0, 20.0
NAMES = ("kuka_iiwa7_r800 0.1 mm", "kuka_iiwa7_r800 2.0 mm", "openarm_v10 1.0 mm", "yaskawa_sia5d 1.0 mm")
EVERY = pytest.mark.parametrize("name", NAMES)


def tracker_at(arm: aa.Arm, q: Array) -> aa.Tracker:
    """A tracker of 4 ms at rest at joints q, with this file's bounds."""
    return begun(q, arm, DT, velocity=FASTEST, acceleration=HARDEST)


def waved(pose: Array, ticks: int, size: float) -> Array:
    """The poses (ticks, 4, 4) of a hand that moves about a pose by up to `size` (m, rad)."""
    t = DT * np.arange(ticks)
    out = np.broadcast_to(pose, (ticks, 4, 4)).copy()
    out[:, :3, 3] += size * np.column_stack([np.sin(1.3 * t), np.sin(0.9 * t), np.sin(1.7 * t)])
    turns = size * np.column_stack([np.sin(t), np.sin(0.8 * t), np.sin(0.5 * t)])
    out[:, :3, :3] = streams.rotation(turns + 1e-300) @ out[:, :3, :3]
    return out


@EVERY
def test_the_true_tool_follows_a_slow_hand_to_rounding(name: str) -> None:
    """A calibrated arm's tracker is FOLLOWING a slow hand in 99 % of the cycles, and then within 1e-8."""
    arm = ARMS[name]
    start = streams.posture(arm)
    tracker = tracker_at(arm, start)
    hands = waved(arm.forward(start)[0], 600, 0.03)
    ticks = [tracker.step(hand) for hand in hands]
    following = np.array([tick.status == aa.Tracking.FOLLOWING for tick in ticks])
    assert following[50:].mean() >= 0.99
    for tick, hand in zip(ticks, hands, strict=True):
        pose, psi, gc = arm.forward(tick.q)
        assert tick.gc == gc and abs(tick.psi - psi) <= 1e-9
        if tick.status == aa.Tracking.FOLLOWING:
            assert np.abs(pose - hand).max() <= 1e-8 and tick.distance <= 1e-9


def test_a_hand_that_is_far_is_approached() -> None:
    """A calibrated arm's tracker is NEAREST to a hand out of reach."""
    arm = ARMS["kuka_iiwa7_r800 2.0 mm"]
    start = streams.posture(arm)
    now = settled(tracker_at(arm, start), moved(arm.forward(start)[0], [3.0, 0, 0]), 6.0)
    assert now.status == aa.Tracking.NEAREST and now.gap > 1.0


def test_without_deviation_it_is_the_exact_arms_tracker() -> None:
    """With a chain that deviates by nothing, a tracker returns the joints of the plain arm's."""
    exact, near = aa.Arm.from_catalogue("kuka_iiwa7_r800"), calibrated("kuka_iiwa7_r800", 0.0, 0.0)
    start = streams.posture(exact)
    hands = waved(exact.forward(start)[0], 300, 0.1)[1:]  # the first stands where both tools are, to rounding
    one, other = tracker_at(exact, start), tracker_at(near, start)
    for hand in hands:
        a, b = one.step(hand), other.step(hand)
        assert np.abs(a.q - b.q).max() <= 1e-9 and a.status == b.status
