"""A tracker that is copied or pickled while it runs goes on bit for bit like the original."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest
from support import streams
from support.clutter import cluttered, with_body
from support.moves import begun, refused
from support.ticks import ARMS, command, start_of

import armangle as aa

WAYS: dict[str, Callable[[aa.Tracker], aa.Tracker]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda tracker: pickle.loads(pickle.dumps(tracker)),
}
EVERY_WAY = pytest.mark.parametrize("way", WAYS)


def go_on_alike(one: aa.Tracker, other: aa.Tracker, arm: aa.Arm, seed: int) -> None:
    """Check that two trackers give equal results for the same commands."""
    rng = np.random.default_rng(seed)
    for _ in range(6):
        pose = command(arm, rng)
        elbow = rng.normal(size=3)
        branch = int(rng.integers(8)) if rng.random() < 0.5 else None
        for _ in range(rng.integers(1, 120)):
            now, then = (tracker.step(pose, elbow, reconfigure=branch) for tracker in (one, other))
            branch = None
            for a, b in zip(now, then, strict=True):
                np.testing.assert_array_equal(a, b)


@pytest.mark.turns(16)
@EVERY_WAY
@pytest.mark.parametrize("jerk", [None, 300.0])
@pytest.mark.parametrize("name", ARMS)
def test_the_copy_goes_on_like_the_original(name: str, jerk: float | None, way: str) -> None:
    """A copied or pickled tracker equals the original and returns the same results to the bit."""
    arm = ARMS[name]
    rng = np.random.default_rng(3)
    tracker = begun(start_of(arm), arm, filter=aa.HandFilter(), jerk=jerk)
    for seed in range(3):
        pose = command(arm, rng)
        for _ in range(rng.integers(1, 200)):
            tracker.step(pose)
        other = WAYS[way](tracker)
        assert other == tracker and other is not tracker
        assert other.arm == arm and other.dt == tracker.dt
        go_on_alike(tracker, other, arm, seed)
        assert other == tracker
        tracker.step(arm.forward(start_of(arm))[0])
        other.step(None)
        assert other != tracker


@EVERY_WAY
def test_a_copy_in_a_scene_goes_on_like_the_original(way: str) -> None:
    rng = np.random.default_rng(8)
    arm = with_body("kuka_iiwa14_r820")
    start = streams.posture(arm)
    tracker = begun(start, arm.with_(scene=cluttered(arm, start, rng)), jerk=500.0)
    tracker.run(np.repeat(command(arm, rng)[None], 60, axis=0))
    other = WAYS[way](tracker)
    assert other == tracker
    go_on_alike(tracker, other, arm, 1)


@EVERY_WAY
def test_a_copy_of_a_tracker_that_has_not_started_has_not_started(way: str) -> None:
    tracker = WAYS[way](aa.Tracker(ARMS["iiwa 14"]))
    refused(aa.InputError, "start", lambda: tracker.step(None))


def test_trackers_are_equal_by_what_they_are_and_where_they_stand() -> None:
    """Trackers compare by arm, options and state, and have no hash."""
    arm = ARMS["iiwa 14"]
    one, other = aa.Tracker(arm), aa.Tracker(arm)
    assert one == other
    one.start(start_of(arm))
    assert one != other
    other.start(start_of(arm))
    assert one == other
    assert one != aa.Tracker(arm, dt=0.01)
    assert one != aa.Tracker(ARMS["OpenArm"])
    assert one != "a tracker"
    with pytest.raises(TypeError):
        hash(one)
