"""No target is left: a tracker reaches a constant target exactly and holds it, after any history."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from support import draw
from support.calibrated import ARMS as CALIBRATED
from support.moves import begun

import armangle as aa

Array = NDArray[np.float64]

DT = 0.01
MARGIN = 0.06  # rad off straight, and off folded: joint 4 keeps 0.05 of it at rest
BEYOND = 30.0  # s longer than the joints' velocities need
ARMS = {name: aa.Arm.from_catalogue(name) for name in aa.catalogue()} | {
    f"{name} calibrated": CALIBRATED[f"{name} 1.0 mm"] for name in ("kuka_iiwa7_r800", "openarm_v10")
}
PAIRS = draw.count(1, 4 * len(ARMS))

# Starts, earlier targets with their number of cycles, and targets that an arm left though a branch held them.
LEFT = {
    "openarm_v10": (
        "3.37713 -0.37796 -1.39982 2.30524 1.31489 0.48038 -0.72309",
        ("-0.01679 0.50426 -0.28763 1.80127 -1.28489 -0.62677 0.20564", 121),
        "0.18772 1.25853 0.44419 1.17306 -1.29894 -0.42945 0.84741",
    ),
    "rainbow_rby1_leader_right": (
        "1.33557 -2.19458 -1.01781 0.04765 0.14492 -1.46588 1.75242",
        ("-0.71831 -1.42804 -2.50382 -1.71896 1.83071 2.00009 3.00477", 264),
        "-2.61889 -0.35355 0.75948 -0.11854 0.66936 -1.23450 1.83363",
    ),
    "franka_fer": (
        "1.30648 1.30227 -0.22713 -1.48188 1.53115 1.92317 0.69744",
        None,
        "-1.53292 1.67853 0.78790 -1.11886 1.42077 2.95220 -2.34160",
    ),
    "franka_fr3": (
        "-2.44709 0.96090 -1.52990 -2.94557 0.74606 4.10807 -2.09513",
        None,
        "-0.70673 0.95895 -0.11741 -1.35373 0.99286 2.28213 2.78776",
    ),
}


def drawn(arm: aa.Arm, rng: np.random.Generator, count: int) -> Array:
    """At most `count` random joints within the limits whose elbow is bent."""
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    room = 0.02 * (upper - lower)
    q = rng.uniform(lower + room, upper - room, (4 * count + 40, 7))
    bend = arm.geometry.signs[3] * q[:, 3] + arm.geometry.offsets[3] - arm.geometry.delta
    return q[np.abs(np.sin(bend)) > np.sin(MARGIN)][:count]


def at_rest(arm: aa.Arm, start: Array, **options: bool) -> aa.Tracker:
    """A tracker at rest at the start; 3 rad/s if the arm states no velocities."""
    known = np.isfinite(arm.velocity).all()
    return begun(start, arm, DT, velocity=True if known else 3.0, **options)


def check_reached(tracker: aa.Tracker, there: Array) -> None:
    """Check that a tracker reaches the pose of joints `there` in time, and holds it exactly."""
    arm = tracker.arm
    fastest = arm.velocity if np.isfinite(arm.velocity).all() else np.full(7, 3.0)
    needed = (np.abs(there - tracker.q) / fastest).max()
    target = np.asarray(arm.forward(there)[0])
    tracker.run(np.repeat(target[None], round((needed + BEYOND) / DT), axis=0))
    for _ in range(20):
        now = tracker.step(target)
        assert (now.status, now.why) == (aa.Tracking.FOLLOWING, aa.Status.OK), now
        assert now.distance <= 1e-9


@pytest.mark.turns(6)
@pytest.mark.parametrize("detours", [True, False])
@pytest.mark.parametrize("name", ARMS)
def test_a_constant_target_is_reached_and_held(name: str, detours: bool) -> None:
    """A tracker reaches a constant target and holds it; without detours if its present branch holds it."""
    arm = ARMS[name]
    rng = draw.generator(*name.encode(), detours)
    for pair in range(2 * PAIRS):
        start, before = drawn(arm, rng, 2)
        tracker = at_rest(arm, start, detours=detours)
        if pair % 2:
            earlier = np.asarray(arm.forward(before)[0])
            tracker.run(np.repeat(earlier[None], rng.integers(10, 300), axis=0))
        targets = drawn(arm, rng, 1 if detours else 500)
        if not detours:
            targets = targets[arm.forward(targets)[2] == arm.forward(tracker.q)[2]]
        if len(targets):
            check_reached(tracker, targets[0])


@pytest.mark.parametrize("name", LEFT)
def test_targets_that_were_left_are_reached(name: str) -> None:
    """A tracker reaches four difficult targets and holds them."""
    arm = aa.Arm.from_catalogue(name)
    start, earlier, there = LEFT[name]
    tracker = at_rest(arm, np.array(start.split(), float))
    if earlier is not None:
        pose = arm.forward(np.array(earlier[0].split(), float))[0]
        tracker.run(np.repeat(pose[None], earlier[1], axis=0))
    check_reached(tracker, np.array(there.split(), float))


def test_a_target_without_a_solution_brings_the_arm_to_rest_without_detours_too() -> None:
    """Without detours a tracker rests, NEAREST, for a target out of reach."""
    arm = aa.Arm.from_catalogue("franka_fr3")
    rng = draw.generator(29)
    for start, there in zip(drawn(arm, rng, 4), drawn(arm, rng, 4), strict=True):
        target = np.array(arm.forward(there)[0])
        target[:3, 3] *= 1.5 / np.linalg.norm(target[:3, 3])
        tracker = at_rest(arm, start, detours=False)
        q = tracker.run(np.repeat(target[None], 3000, axis=0))
        assert np.abs(np.diff(q[-100:], axis=0)).max() < 1e-9
        assert tracker.step(target).status == aa.Tracking.NEAREST
