"""A tracker whose scene is set while it runs: obstacles that come, go and move."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest
from support import draw, streams
from support.calibrated import ARMS as CALIBRATED
from support.clutter import BODY, CLEARANCE, between, cluttered, distance, with_body
from support.moves import Array, moved
from support.ticks import DT, hostile, settled

import armangle as aa

ARMS = {
    "exact": with_body("kuka_iiwa14_r820"),
    "own chain": CALIBRATED["kuka_iiwa7_r800 2.0 mm"].with_(body=BODY),
}
EVERY = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
FAR = aa.Scene([aa.Ball([3.0, 0.0, 0.0], 0.1, name="far")], clearance=CLEARANCE)


def begun(arm: aa.Arm, scene: aa.Scene | None, **options: object) -> aa.Tracker:
    """A tracker of 4 ms in this scene, at rest at `streams.posture`."""
    tracker = aa.Tracker(arm.with_(scene=scene), DT, **options)  # type: ignore[arg-type]  # any options
    tracker.start(streams.posture(arm))
    return tracker


@pytest.mark.turns(2)
@EVERY
@pytest.mark.parametrize("jerk", [None, 300.0])
def test_scenes_that_come_while_the_arm_stands_are_not_touched(arm: aa.Arm, jerk: float | None) -> None:
    """A tracker whose scene is replaced keeps the clearance of the new one."""
    rng = np.random.default_rng([draw.SEED, 4])
    tracker, passed = begun(arm, FAR, jerk=jerk), 0
    for _ in range(draw.count(4)):
        scene = cluttered(arm, tracker.q, rng)
        tracker.scene = scene
        assert tracker.scene is scene and tracker.arm == arm.with_(scene=scene)
        q = [tracker.q]
        for _ in range(3):
            pose = hostile(arm, rng)
            for _ in range(150):
                now = tracker.step(pose)
                assert now.pair is None or now.pair[0] != "far"
                q.append(now.q)
        assert distance(arm, scene, between(np.array(q))).min() >= CLEARANCE
        passed += np.ptp(q, axis=0).max() > 0.1
        hand = arm.forward(tracker.q)[0]
        assert np.abs(settled(tracker, hand, 30.0).velocity).max() < 1e-6
    assert passed


@EVERY
def test_the_same_scene_changes_no_bit(arm: aa.Arm) -> None:
    """Setting a tracker's scene to itself, a copy, or others and back changes no bit of its results."""
    start = streams.posture(arm)
    scene = cluttered(arm, start, np.random.default_rng(5))
    stream = streams.stream(arm, "inside", 1, seconds=2.0).samples
    for sets in ([scene], [pickle.loads(pickle.dumps(scene))], [FAR, None, scene]):
        one, other = (begun(arm, scene, filter=aa.HandFilter()) for _ in range(2))
        for pose in stream[:: 1 + len(sets) // 2]:
            for each in sets:
                other.scene = each
            now, then = one.step(pose), other.step(pose)
            for a, b in zip(now, then, strict=True):
                np.testing.assert_array_equal(a, b)
        assert one == other and pickle.loads(pickle.dumps(other)) == one


def approached(
    arm: aa.Arm, scenes: Callable[[float], aa.Scene], seconds: float
) -> tuple[Array, Array, Array]:
    """The joints of a tracker whose hand stands while obstacles move, as `scenes` of time (s) says, and for
    every fifth cycle the clearance of the arm and that of an arm that stays.
    """
    tracker = begun(arm, FAR)
    start = tracker.q
    hand, q, rooms = arm.forward(start)[0], [], []
    for k in range(round(seconds / DT)):
        tracker.scene = scene = scenes(k * DT)
        q.append(tracker.step(hand).q)
        if k % 5 == 0:
            rooms.append(distance(arm, scene, np.array([q[-1], start])))
    return np.array(q), *np.array(rooms).T


@EVERY
def test_the_elbow_gives_way_to_what_comes_while_the_tool_stays(arm: aa.Arm) -> None:
    """A tracker's elbow keeps clear of a ball that moves at 5 cm/s, the tool staying on the hand."""
    start = streams.posture(arm)
    hand, psi, gc = arm.forward(start)
    elbow = arm.elbow(start)
    way = arm.elbow(arm.inverse(hand, psi + 0.1, gc, seed=start)) - elbow
    way /= np.linalg.norm(way)
    q, rooms, stood = approached(
        arm, lambda t: aa.Scene([aa.Ball(elbow + (0.05 * t - 0.15) * way, 0.03)], clearance=0.02), 6.0
    )
    assert stood.min() < 0 and rooms.min() >= 0.02
    assert np.abs(arm.forward(q)[0] - hand).max() < 1e-8


def test_the_tool_gives_way_and_comes_back() -> None:
    """A tracker's tool keeps clear of a wall that comes at 3 cm/s, and is back on the hand when it
    has gone.
    """
    arm = ARMS["exact"]
    start = streams.posture(arm)
    hand = arm.forward(start)[0]
    facing = -hand[:3, 2]

    def wall(t: float) -> aa.Scene:
        """The scene at a time (s): a wall that comes, stays and goes."""
        beyond = 0.2 - 0.03 * min(t, 4.0, max(9.0 - t, 0.0))
        return aa.Scene([aa.HalfSpace(facing, facing @ hand[:3, 3] - beyond)], clearance=0.02)

    q, rooms, stood = approached(arm, wall, 12.0)
    assert stood.min() < -0.05 and rooms.min() > 0.019
    assert np.abs(arm.forward(q[-1])[0] - hand).max() < 1e-8


def test_what_is_near_now_is_named_and_left() -> None:
    """A tracker names the pair that blocks in its present scene, and is RETURNING from a new wall too
    near.
    """
    arm = ARMS["exact"]
    tracker = begun(arm, FAR)
    hand = arm.forward(tracker.q)[0]
    into, facing = moved(hand, 0.3 * hand[:3, 2]), -hand[:3, 2]

    def wall(name: str, beyond: float) -> aa.HalfSpace:
        """A wall with this name, `beyond` (m) in front of the hand."""
        return aa.HalfSpace(facing, facing @ hand[:3, 3] - beyond, name=name)

    far = [aa.Ball([3.0, 0.0, k], 0.1, name=f"far {k}") for k in range(5)]
    tracker.scene = aa.Scene([*far, wall("wall", 0.28)], clearance=CLEARANCE)
    now = settled(tracker, into, 4.0)
    assert now.status == aa.Tracking.NEAREST and now.pair == ("wall", "grip")
    near = aa.Scene([wall("near", 0.275)], clearance=CLEARANCE)
    tracker.scene = near
    rooms = [float(distance(arm, near, tracker.q))]
    while rooms[-1] < CLEARANCE:
        now = tracker.step(into)
        assert (now.status, now.pair) == (aa.Tracking.RETURNING, ("near", "grip")) or len(rooms) > 1
        rooms.append(float(distance(arm, near, now.q)))
        assert rooms[-1] >= rooms[-2] - 1e-9 and len(rooms) < 500
    assert len(rooms) > 2
    tracker.scene = None
    assert settled(tracker, hand, 4.0).status == aa.Tracking.FOLLOWING


@pytest.mark.parametrize("name", ["kuka_iiwa14_r820", "franka_fr3"])
def test_a_scene_that_does_not_fit_changes_nothing(name: str) -> None:
    """A tracker refuses a scene without a collision model or of a wrong type, and stays as it was."""
    arm = aa.Arm.from_catalogue(name)
    bare = aa.Tracker(arm, dt=0.01).start(0.5 * (arm.lower + arm.upper) + 0.1)
    before = copy.copy(bare)
    with pytest.raises(aa.SceneError, match="body"):
        bare.scene = FAR
    with pytest.raises(aa.SceneError):
        bare.scene = "a scene"  # type: ignore[assignment]  # as a user may
    assert bare.scene is None and bare == before
