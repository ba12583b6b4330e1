"""Laws of the tracker on nearly S-R-S arms: the true tool is where the hand is, and all bounds hold."""

from __future__ import annotations

import numpy as np
import pytest
from support import streams
from support.calibrated import ARMS, Array, calibrated
from support.draw import generator

import armangle as aa

DT = 0.004
FASTEST, HARDEST = 2.0, 20.0
NAMES = ("kuka_iiwa7_r800 0.1 mm", "kuka_iiwa7_r800 2.0 mm", "openarm_v10 1.0 mm", "yaskawa_sia5d 1.0 mm")
EVERY = pytest.mark.parametrize("name", NAMES)


def tracker_at(arm: aa.Arm, q: Array, hand: aa.HandFilter | None = None) -> aa.Tracker:
    tracker = aa.Tracker(arm, DT, filter=hand, velocity=FASTEST, acceleration=HARDEST)
    tracker.start(q)
    return tracker


def waved(pose: Array, ticks: int, size: float) -> Array:
    """A hand that moves slowly about a pose."""
    t = DT * np.arange(ticks)
    out = np.broadcast_to(pose, (ticks, 4, 4)).copy()
    out[:, :3, 3] += size * np.column_stack([np.sin(1.3 * t), np.sin(0.9 * t), np.sin(1.7 * t)])
    turns = size * np.column_stack([np.sin(t), np.sin(0.8 * t), np.sin(0.5 * t)])
    out[:, :3, :3] = streams.rotation(turns + 1e-300) @ out[:, :3, :3]
    return out


@EVERY
def test_the_true_tool_follows_a_slow_hand_to_rounding(name: str) -> None:
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
    # the naive loop tracks with the nominal arm, and misses by the deviation
    naive = tracker_at(arm.nominal, start)
    for hand in hands:
        last = naive.step(hand)
    assert np.linalg.norm((arm.forward(last.q)[0] - hands[-1])[:3, 3]) > 1e4 * ticks[-1].distance


@EVERY
def test_bounds_hold_whatever_the_hand_does(name: str) -> None:
    arm = ARMS[name]
    rng = generator(41)
    start = streams.posture(arm)
    tracker = tracker_at(arm, start, aa.HandFilter())
    q, before = tracker.q, np.zeros(7)
    for _ in range(40):
        hand = arm.forward(rng.uniform(arm.lower, arm.upper))[0].copy()
        hand[:3, 3] += rng.normal(size=3) * rng.choice([0.0, 0.02, 1.0])
        if rng.random() < 0.1:
            hand[0, 0] = np.nan
        for _ in range(25):
            now = tracker.step(hand)
            speed = (now.q - q) / DT
            assert (now.q >= arm.lower).all() and (now.q <= arm.upper).all()
            assert np.abs(speed).max() <= FASTEST + 1e-9
            assert np.abs(speed - before).max() <= HARDEST * DT + 1e-9
            q, before = now.q, speed


def test_a_hand_that_stands_is_reached_and_a_far_one_approached() -> None:
    arm = ARMS["kuka_iiwa7_r800 2.0 mm"]
    start = streams.posture(arm)
    tracker = tracker_at(arm, start)
    goal = start + np.array([0.2, 0.1, -0.1, 0.15, 0.2, -0.1, 0.3])
    hand = arm.forward(goal)[0]
    for _ in range(1000):
        now = tracker.step(hand)
    assert now.status == aa.Tracking.FOLLOWING and np.abs(arm.forward(now.q)[0] - hand).max() <= 1e-8
    far = hand.copy()
    far[0, 3] += 3.0
    for _ in range(1500):
        now = tracker.step(far)
    assert now.status == aa.Tracking.NEAREST and now.gap > 1.0


def test_without_deviation_it_is_the_exact_arms_tracker() -> None:
    exact, near = aa.Arm.from_catalogue("kuka_iiwa7_r800"), calibrated("kuka_iiwa7_r800", 0.0, 0.0)
    start = streams.posture(exact)
    hands = waved(exact.forward(start)[0], 300, 0.1)[1:]  # the first stands where both tools are, to rounding
    one, other = tracker_at(exact, start), tracker_at(near, start)
    for hand in hands:
        a, b = one.step(hand), other.step(hand)
        assert np.abs(a.q - b.q).max() <= 1e-9 and a.status == b.status
