"""A tracker that starts on the hand stays there: its elbow about straight, joints at their limits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from support import calibrated, draw
from support.moves import begun
from support.ticks import DT, named

import armangle as aa
from armangle.models.catalogue import srs_catalogue

Array = NDArray[np.float64]

SPEED = 2.0  # rad/s
LENGTH = 0.2  # m that a radian counts as
BENT = 0.06  # rad off straight: the elbow's margin at rest, and a little more
OFF = 1e-7  # m: what an arc cosine rounds a turn by, and more
TREMBLE = 3e-5  # m
MARGIN = 0.025  # m that an elbow's margin costs which grows with a hand that trembles
TICKS = 500
STARTS = draw.count(6, 60)


def straight(arm: aa.Arm, rng: np.random.Generator) -> Array:
    """Random joints with a nearly straight elbow, half of the others at a limit, and theta_2 or theta_6 near
    0.
    """
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    q = rng.uniform(lower, upper)
    off = rng.choice([0.0, 0.0, 0.0, 1e-12, 1e-9, 1e-6, 1e-3], size=7)
    ends = np.where(rng.random(7) < 0.5, arm.lower + off, arm.upper - off)
    q = np.where((rng.random(7) < 0.5) & np.isfinite(ends), ends, q)
    for hinge, about in ((1, 0.2), (3, 1.0), (5, 0.2)):
        if rng.random() > about:
            continue
        bend = rng.choice([rng.uniform(-BENT, BENT), 10 ** rng.uniform(-9, -2)])
        q[hinge] = arm.geometry.signs[hinge] * (bend - arm.geometry.offsets[hinge])
    return np.clip(q, arm.lower, arm.upper)


def off_hand(arm: aa.Arm, q: Array, hand: Array) -> Array:
    """The distance (n,) of the tools of rows (n, 7) from a hand, m, with 0.2 m for 1 rad."""
    tools = arm.forward(q)[0]
    cosine = 0.5 * (np.einsum("nij,ij->n", tools[:, :3, :3], hand[:3, :3]) - 1)
    turn = np.arccos(np.clip(cosine, -1, 1))
    return np.hypot(np.linalg.norm(tools[:, :3, 3] - hand[:3, 3], axis=-1), LENGTH * turn)


def farthest(arm: aa.Arm, rng: np.random.Generator, tremble: float = 0.0) -> float:
    """The largest distance (m) of the tool from a hand that stands at it at first, with noise
    `tremble` (m).
    """
    out = 0.0
    for _ in range(STARTS):
        start = straight(arm, rng)
        hand = arm.forward(start)[0]
        hands = np.repeat(hand[None], TICKS, axis=0)
        if tremble:
            hands[:, :3, 3] += rng.normal(0, tremble, (TICKS, 3))
        tracker = begun(start, arm, DT, velocity=SPEED)
        out = max(out, float(off_hand(arm, tracker.run(hands), hand).max()))
    return out


@pytest.mark.turns(6)
@pytest.mark.parametrize("name", aa.catalogue())
def test_a_hand_at_the_tool_is_not_left(name: str) -> None:
    """A tracker that starts on the hand, the elbow nearly straight, stays within 1e-7 m."""
    assert farthest(named(name), draw.generator(*name.encode(), 1)) <= OFF


@pytest.mark.parametrize("name", ["kuka_iiwa14_r820", "yaskawa_sia20d", "openarm_v10", "barrett_wam7"])
def test_a_hand_at_the_tool_is_not_left_by_a_calibrated_arm(name: str) -> None:
    """A tracker of a calibrated arm stays within OFF of a hand at rest at the tool."""
    assert farthest(calibrated.calibrated(name, 1.0, 2.0), draw.generator(*name.encode(), 2)) <= OFF


@pytest.mark.turns(6)
@pytest.mark.parametrize("name", srs_catalogue())
def test_a_hand_that_trembles_at_the_tool_is_not_left(name: str) -> None:
    """A tracker stays within MARGIN of a hand that trembles at the tool."""
    assert farthest(named(name), draw.generator(*name.encode(), 3), TREMBLE) <= MARGIN


@pytest.mark.parametrize("name", ["kuka_iiwa14_r820", "realman_rm75_b", "openarm_v10"])
@pytest.mark.parametrize("bend", [0.08, 0.15, 0.25])
def test_a_hand_that_trembles_near_the_reach_is_not_drawn_back(name: str, bend: float) -> None:
    """A tracker is within 1 mm RMS of a hand with noise of 0.1 mm near the reach."""
    arm = aa.Arm.from_catalogue(name)
    start = 0.5 * (np.maximum(arm.lower, -2.0) + np.minimum(arm.upper, 2.0)) + 0.3
    start[3] = arm.geometry.signs[3] * (bend - arm.geometry.offsets[3])
    hand = arm.forward(start)[0]
    hands = np.repeat(hand[None], 1500, axis=0)
    hands[:, :3, 3] += np.random.default_rng(0).normal(0, 1e-4, (1500, 3))
    tracker = begun(start, arm, DT)
    rows = tracker.run(hands)
    assert np.sqrt((off_hand(arm, rows[750:], hand) ** 2).mean()) <= 1e-3


@pytest.mark.parametrize("name", ["kuka_iiwa14_r820", "realman_rm75_b", "openarm_v10", "franka_fr3"])
def test_an_arm_at_rest_on_the_hand_does_not_stir(name: str) -> None:
    """A tracker that starts on the hand moves no joint by a bit."""
    arm = named(name)
    rng = draw.generator(*name.encode(), 4)
    start = rng.uniform(arm.lower, arm.upper)
    hand = arm.forward(start)[0]
    tracker = begun(start, arm, DT, velocity=SPEED)
    for _ in range(50):
        now = tracker.step(hand)
        assert now.status == aa.Tracking.FOLLOWING
    assert np.abs(now.q - start).max() == 0


def test_a_hand_that_is_reached_late_is_not_given_up_on_arrival() -> None:
    """A tracker that turns for long before it reaches the hand is FOLLOWING then."""
    arm = aa.Arm.from_catalogue("rokae_ar5_right")
    first, last = arm.lower, arm.upper
    start = [first[0], 1.761, first[2], -0.0361, 0.604, first[5], -0.759]
    there = np.array([last[0], -0.001, last[2], 0.0087, last[4], 1.0462, first[6]])
    tracker = begun(start, arm, 0.01, velocity=SPEED)
    hand = arm.forward(there)[0]
    tracker.run(np.repeat(hand[None], 7000, axis=0))
    assert tracker.step(hand).status == aa.Tracking.FOLLOWING


@pytest.mark.parametrize("dt", [0.004, 0.01])
def test_no_turn_goes_to_a_posture_beyond_a_limit(dt: float) -> None:
    """Near θ6 = 0, joints at limits, a tracker reaches the hand and is never TURNING."""
    arm = aa.Arm.from_catalogue("human_arm_right")
    first, last = arm.lower, arm.upper
    start = np.array([last[0], 1.9391, 1.3635, 1.7979, 2.2446, first[5], last[6]])
    hand = arm.forward([3.0955, 1.9631, 1.2745, 1.7149, 2.3287, first[5], 0.7282])[0]
    tracker = begun(start, arm, dt, velocity=SPEED)
    ticks = [tracker.step(hand) for _ in range(round(3 / dt))]
    assert all(tick.status != aa.Tracking.TURNING for tick in ticks)
    assert ticks[-1].status == aa.Tracking.FOLLOWING
