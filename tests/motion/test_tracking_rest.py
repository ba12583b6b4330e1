"""A command that does not move brings every arm to rest: on the hand, or as near as its branch allows."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from support import draw
from support.moves import begun, moved
from support.ticks import DT, check_bounds, named

import armangle as aa

Array = NDArray[np.float64]

STILL = 0.05  # rad off straight, and off folded, that joint 4 keeps at rest
SECONDS = 45.0
HANDS = draw.count(2, len(aa.catalogue()))

# Starts, and postures whose tool is where the hand is, that made the arm turn for ever.
ENDLESS = {
    "kuka_iiwa7_r800": (
        "1.6306 -0.8724 -2.9542 0.7339 0.295 1.6432 -1.4406",
        "-2.4148 -1.2014 0.1111 -2.0405 0.0731 0.2019 -2.2032",
    ),
    "kuka_iiwa14_r820": (
        "1.2175 -0.3049 1.4764 1.9054 -2.5426 1.0293 1.4972",
        "-1.7013 0.4929 -0.1072 2.0215 -0.7497 -0.9298 1.5253",
    ),
    "yaskawa_sia5d": (
        "1.9773 0.5699 -2.2839 1.9774 -0.8619 0.143 -0.4439",
        "-2.3976 0.2331 -0.6563 1.0485 0.6129 0.4564 -0.9855",
    ),
    "iit_icub_left": (
        "-0.5234 0.4791 -0.2247 0.1619 0.6885 0.0174 0.0581",
        "-0.7092 0.1898 0.259 1.3713 0.1011 -0.8607 -0.3432",
    ),
    "human_arm_left": (
        "2.625 1.0705 -0.6244 1.1387 0.3815 0.686 -0.2526",
        "2.9852 -0.241 1.7034 2.0285 -0.0276 1.275 0.2996",
    ),
    "barrett_wam7": (
        "1.143 1.5024 0.146 0.7583 -0.6708 1.3595 -1.0435",
        "-1.5224 -0.1831 -0.0056 0.4432 -0.4635 1.172 0.3174",
    ),
    "franka_fr3": (
        "2.5271 0.751 1.3833 -0.2307 -1.3037 1.5752 -0.4672",
        "1.5873 0.8128 2.3681 -2.2606 1.2055 1.4876 -2.5573",
    ),
}


def at_rest(arm: aa.Arm, start: Array, hand: Array) -> aa.types.Tracked:
    """Check that a tracker comes to rest for a hand at rest, and return its last result."""
    known = np.isfinite(arm.velocity).all()
    tracker = begun(start, arm, DT, velocity=True if known else 3.0)
    ticks = round((SECONDS + 7.0 / (arm.velocity.min() if known else 3.0)) / DT)
    q = tracker.run(np.repeat(hand[None], ticks, axis=0))
    least = 1e-7 if arm.kind.startswith("offset") else 1e-9  # rad in 2 s; a correction settles geometrically
    assert np.abs(np.diff(q[-500:], axis=0)).sum() < least
    if known:
        check_bounds(arm, np.concatenate([start[None], q]), np.full(ticks, DT))
    now = tracker.step(hand)
    assert now.status in (aa.Tracking.FOLLOWING, aa.Tracking.NEAREST)
    assert (now.status == aa.Tracking.FOLLOWING) == (now.distance <= 1e-9)
    return now


@pytest.mark.parametrize("name", ENDLESS)
def test_what_turned_for_ever_comes_to_rest(name: str) -> None:
    """Trackers come to rest from pairs of start and hand that are difficult."""
    start, there = (np.array(text.split(), float) for text in ENDLESS[name])
    arm = named(name)
    at_rest(arm, start, arm.forward(there)[0])


@pytest.mark.turns(6)
@pytest.mark.parametrize("name", aa.catalogue())
def test_every_constant_hand_brings_the_arm_to_rest(name: str) -> None:
    """Trackers of all arms come to rest, and on the hand if their branch holds it."""
    arm = named(name)
    rng = draw.generator(*name.encode())
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    room = 0.02 * (upper - lower)
    for _ in range(HANDS):
        start, there = rng.uniform(lower + room, upper - room, (2, 7))
        hand = np.asarray(arm.forward(there)[0])
        now = at_rest(arm, start, hand)
        if now.status == aa.Tracking.FOLLOWING or arm.kind.startswith("offset"):
            continue
        arcs = arm.feasible(hand, now.gc)
        if arcs.is_empty:
            continue
        held = arm.inverse(hand, arcs.nearest(now.psi), now.gc, seed=now.q, limits=False)
        bend = arm.geometry.signs[3] * held[3] + arm.geometry.offsets[3] - arm.geometry.delta
        assert abs(np.sin(bend)) < np.sin(STILL), "the arm stands although its branch holds the hand"


@pytest.mark.parametrize("name", ["human_arm_left", "barrett_wam7"])
def test_a_hand_with_a_folded_elbow_is_reached(name: str) -> None:
    """A tracker reaches a hand at which the elbow is bent by 2.4 to 2.6 rad."""
    arm = aa.Arm.from_catalogue(name)
    of = arm.geometry
    side = 1.0 if of.signs[3] * (arm.lower[3] + arm.upper[3]) > 0 else -1.0
    for bend in (2.4, 2.5, 2.6):
        there = 0.5 * (arm.lower + arm.upper) + 0.1
        there[3] = of.signs[3] * (side * bend + of.delta - of.offsets[3])
        assert arm.within_limits(there)
        start = there.copy()
        start[3] -= side * of.signs[3]
        assert at_rest(arm, start, arm.forward(there)[0]).status == aa.Tracking.FOLLOWING


def test_a_hand_that_moves_again_is_followed_again() -> None:
    """A tracker at rest near a hand out of reach follows a hand that is back at the tool."""
    start, there = (np.array(text.split(), float) for text in ENDLESS["iit_icub_left"])
    arm = aa.Arm.from_catalogue("iit_icub_left")
    tracker = begun(start, arm, DT)
    far = moved(arm.forward(there)[0], 1.0)
    for _ in range(5000):
        now = tracker.step(far)
    assert now.status == aa.Tracking.NEAREST
    back = arm.forward(now.q)[0]
    for _ in range(2500):
        now = tracker.step(back)
    assert now.status == aa.Tracking.FOLLOWING


@pytest.mark.parametrize("turn", [0.4, 0.7, 1.4, 1.7, 2.9])
def test_a_hand_that_spun_faster_than_it_is_seen_and_stands_is_at_rest(turn: float) -> None:
    """A tracker with a filter comes to rest after a hand that turned by up to 2.9 rad a cycle."""
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    start = np.array([0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.5])
    hand = arm.forward(start)[0]
    tracker = begun(start, arm, 0.004, acceleration=10.0, filter=aa.HandFilter(omega=20.0, patience=0.0))
    for k in range(60):
        cosine, sine = np.cos(turn * k), np.sin(turn * k)
        spun = hand.copy()
        spun[:3, :3] = hand[:3, :3] @ [[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]
        tracker.step(spun)
    q = tracker.run(np.repeat(hand[None], 5000, axis=0))
    assert np.ptp(q[-500:], axis=0).max() < 1e-3
    assert tracker.step(hand).status == aa.Tracking.FOLLOWING


@pytest.mark.parametrize("rate", [5, 10, 50, 500])
def test_a_hand_that_stops_dead_is_at_rest_at_its_last_sample(rate: int) -> None:
    """A tracker with a filter rests on the last sample of a hand that stops, at any rate."""
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    start = np.array([0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.5])
    tracker = begun(start, arm, 0.002, acceleration=10.0, filter=aa.HandFilter())
    hand = arm.forward(start)[0]
    for k in range(1000):
        if k % (500 // rate) == 0:
            hand = hand.copy()
            hand[1, 3] += 0.05 / rate
        tracker.step(hand)
    q = tracker.run(np.repeat(hand[None], 2500, axis=0))
    assert np.ptp(q[-500:], axis=0).max() < 1e-6
    np.testing.assert_allclose(arm.forward(q[-1])[0], hand, atol=1e-6)
