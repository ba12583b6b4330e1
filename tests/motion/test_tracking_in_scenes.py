"""The laws of a tracker among obstacles: nothing touches, in ticks and between them, whatever the command."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from support import draw, streams
from support.clutter import CLEARANCE, GRIP, between, cluttered, distance, started, with_body
from support.moves import begun, moved, refused
from support.ticks import DT, check_bounds, check_jerk, hostile, settled

import armangle as aa

Array = NDArray[np.float64]

ARMS = ("kuka_iiwa14_r820", "realman_rm75_b", "openarm_v10")
STANDOFF = 1e-4  # m more than the clearance at which an approach ends
TICKS = 100_000 if draw.COUNT else 6_000


@pytest.fixture(params=ARMS)
def arm(request: pytest.FixtureRequest) -> aa.Arm:
    """An arm with a collision model and a ball as gripper, each of three in turn."""
    return with_body(request.param)


@pytest.mark.turns(2)
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    ("name", "jerk"), [*((name, None) for name in ARMS), (ARMS[0], 100.0), (ARMS[0], 5e3)]
)
def test_hostile_ticks_touch_nothing_and_keep_the_bounds(name: str, jerk: float | None, seed: int) -> None:
    """A tracker in a scene keeps clearance and bounds for hostile targets, and names a pair if blocked."""
    arm, rng = with_body(name), np.random.default_rng([draw.SEED, seed])
    start = streams.posture(arm)
    scene = cluttered(arm, start, rng)
    tracker = started(arm, scene, start, filter=rng.choice(np.array([None, aa.HandFilter()])), jerk=jerk)
    q, times = [tracker.q], []
    while len(times) < TICKS // 2:
        pose = hostile(arm, rng)
        for _ in range(rng.integers(1, 400)):
            dt = DT * (1.0 if rng.random() < 0.5 else rng.uniform(0.1, 5.0))
            now = tracker.step(pose, dt=dt)
            assert (now.pair is not None) == (now.why in (aa.Status.CLEARANCE, aa.Status.POSE_BLOCKED))
            q.append(now.q)
            times.append(dt)
    joints = np.array(q)
    if jerk:
        check_jerk(arm, joints, np.array(times), jerk)
    else:
        check_bounds(arm, joints, np.array(times))
    assert distance(arm, scene, between(joints)).min() >= CLEARANCE
    assert np.ptp(joints, axis=0).max() > 0.5, "it moves"


def hostile_run(arm: aa.Arm, scene: aa.Scene, rng: np.random.Generator, ticks: int) -> Array:
    """The joints of at least `ticks` cycles of a tracker in a scene, for hostile targets."""
    tracker = started(arm, scene, streams.posture(arm))
    q = [tracker.q[None]]
    while sum(map(len, q)) < ticks:
        q.append(tracker.run(np.repeat(hostile(arm, rng)[None], rng.integers(50, 300), axis=0)))
    return np.concatenate(q)


@pytest.mark.parametrize("corners", [5, 30])
def test_hulls_that_stand_and_hulls_that_are_held_touch_nothing(corners: int) -> None:
    """A tracker with a hull as tool keeps its clearance among hulls, and comes near to them."""
    rng = np.random.default_rng([draw.SEED, corners])
    plain = with_body("kuka_iiwa14_r820")
    start = streams.posture(plain)
    held = aa.Hull([0.0, 0.0, 0.1] + 0.05 * rng.normal(size=(corners, 3)), 0.005, name="tool")
    arm = plain.with_(hand=[held])
    middle = arm.forward(start)[0][:3, 3]
    standing: list[aa.Hull] = []
    nearest: list[float] = []
    while len(standing) < 8:
        at = middle + 0.2 * rng.normal(size=3)
        one = aa.Hull(at + 0.08 * rng.normal(size=(corners, 3)), name=f"stone {len(standing)}")
        if distance(arm, aa.Scene([*standing, one]), start) > 0.02:
            standing.append(one)
    scene = aa.Scene(standing, clearance=CLEARANCE)
    q = hostile_run(arm, scene, rng, TICKS // 3)
    assert distance(arm, scene, between(q)).min() >= CLEARANCE - 1e-12
    for stone in standing:
        tracker = started(arm, scene, start)
        into = arm.forward(start)[0]
        into[:3, 3] = np.mean(stone.points, axis=0)
        rooms = distance(arm, scene, between(tracker.run(np.repeat(into[None], 500, axis=0))))
        assert rooms.min() >= CLEARANCE - 1e-12
        nearest.append(rooms.min())
    assert min(nearest) < CLEARANCE + 0.01, "some came near"


def test_what_a_field_tells_of_is_not_touched() -> None:
    """A tracker whose scene is a distance field keeps clear of the balls that the field was made of."""
    rng = np.random.default_rng(draw.SEED)
    arm = with_body("kuka_iiwa14_r820")
    middle = arm.forward(streams.posture(arm))[0][:3, 3]
    origin, spacing = middle - 0.4, 0.02
    nodes = origin + spacing * np.stack(np.meshgrid(*[np.arange(41.0)] * 3, indexing="ij"), axis=-1)
    centres = middle + np.array([[0.2, 0.0, 0.0], [0.0, 0.25, 0.05], [0.0, -0.2, 0.0]])
    far = np.linalg.norm(nodes[..., None, :] - centres, axis=-1).min(-1) - 0.05
    scene = aa.Scene([aa.Field(far, origin, spacing, name="room")], clearance=CLEARANCE)
    truth = aa.Scene([aa.Ball(at, 0.05) for at in centres], clearance=CLEARANCE)
    q = hostile_run(arm, scene, rng, TICKS // 3)
    assert distance(arm, truth, between(q)).min() >= CLEARANCE


def stopped(arm: aa.Arm, scene: aa.Scene, start: Array, poses: Array) -> Array:
    """The joints of a tracker without scene, which stay for good at the last row before a collision."""
    q = begun(start, arm, DT).run(poses)
    touching = distance(arm, scene, q) < CLEARANCE
    if touching.any():
        first = np.argmax(touching)
        q[first:] = q[max(first - 1, 0)]
    return q


def clear_posture(arm: aa.Arm, scene: aa.Scene, start: Array, rng: np.random.Generator) -> Array:
    """Random joints in the branch of `start` that keep the clearance."""
    own, there = arm.forward(start)[2], start
    while np.array_equal(there, start) or distance(arm, scene, there) < CLEARANCE + 0.01:
        away = start + rng.uniform(-1, 1, 7) * [1.5, 1.0, 1.5, 0.9, 1.5, 1.0, 1.5]
        there = away.clip(arm.lower + 0.05, arm.upper - 0.05)
        there = start if arm.forward(there)[2] != own else there
    return there


def kept(arm: aa.Arm, scene: aa.Scene, rows: list[Array]) -> None:
    """Check that rows of joints keep bounds and clearance, between the rows too."""
    joints = np.array(rows)
    check_bounds(arm, joints, np.full(len(joints) - 1, DT))
    assert distance(arm, scene, between(joints)).min() >= CLEARANCE


@pytest.mark.slow
def test_hands_are_followed_without_a_touch_and_nearer_than_by_stopping(arm: aa.Arm) -> None:
    """In a scene a tracker keeps its clearance and, but for 2 mm, is as near to the hand as one that
    stops.
    """
    errors = []
    start = streams.posture(arm)
    for scenario, seed in itertools.product(["inside", "fast", "beyond", "limits"], range(2)):
        scene = cluttered(arm, start, np.random.default_rng(seed))
        stream = streams.stream(arm, scenario, seed, seconds=6.0, noise=False)
        q = started(arm, scene, start).run(stream.true)
        assert distance(arm, scene, between(q)).min() >= CLEARANCE
        ways = q, stopped(arm, scene, start, stream.true)
        errors.append([np.sqrt((streams.errors(arm, x, stream.true)[0] ** 2).mean()) for x in ways])
    ours, hand = np.transpose(errors)
    assert (ours <= hand + 2e-3).all()
    assert ours.mean() <= hand.mean() * 1.02


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_no_chatter_at_rest_whatever_the_command(arm: aa.Arm, seed: int) -> None:
    """In a scene no joint of a tracker oscillates for a hand at rest; it may slide along an obstacle."""
    rng = np.random.default_rng([seed, 5])
    start = streams.posture(arm)
    scene = cluttered(arm, start, rng)
    tracker = started(arm, scene, start)
    pose = hostile(arm, rng)
    before = settled(tracker, pose, 30.0)
    q = np.concatenate([tracker.q[None], tracker.run(np.repeat(pose[None], 2500, axis=0))])
    moves = np.abs(np.diff(q, axis=0)).sum(0)
    assert (moves - np.abs(q[-1] - q[0])).max() < 1e-6
    assert moves.max() < 0.05
    assert tracker.step(pose).distance <= before.distance + 1e-9


def wall(arm: aa.Arm, start: Array, beyond: float) -> tuple[aa.Scene, Array]:
    """A scene of a wall `beyond` (m) in front of the gripper, and the tool's pose."""
    tool = arm.forward(start)[0].copy()
    grip = tool[:3, 3] + 0.12 * tool[:3, 2]
    facing = -tool[:3, 2]
    floor = aa.HalfSpace(facing, facing @ grip - GRIP - beyond, name="wall")
    return aa.Scene([floor], clearance=CLEARANCE), tool


def test_a_hand_beyond_a_wall_is_followed_along_it_as_near_as_can_be() -> None:
    """A tracker slides along a wall as near to the hand as possible, NEAREST and POSE_BLOCKED."""
    arm = with_body("kuka_iiwa14_r820")
    start = streams.posture(arm)
    scene, tool = wall(arm, start, 0.05)
    tracker = started(arm, scene, start)
    for aside in (0.0, 0.1, -0.1):
        now = settled(tracker, moved(tool, 0.2 * tool[:3, 2] + aside * tool[:3, 1]), 6.0)
        assert (now.status, now.why) == (aa.Tracking.NEAREST, aa.Status.POSE_BLOCKED)
        assert now.pair == ("wall", "grip")
        room = distance(arm, scene, now.q) - CLEARANCE
        assert 0 <= room <= 3 * STANDOFF
        depth = 0.2 - 0.05 + CLEARANCE
        assert now.distance <= depth + 2e-3, "no farther than with the orientation kept"
    now = settled(tracker, tool, 3.0)
    assert (now.status, now.pair) == (aa.Tracking.FOLLOWING, None)


def test_the_elbow_goes_round_what_stands_in_its_way_while_the_tool_follows() -> None:
    """A tracker's elbow avoids a ball on its way while the tool stays on the hand exactly."""
    arm = with_body("kuka_iiwa14_r820")
    start = streams.posture(arm)
    ticks = 1000
    share = np.linspace(0, 1, ticks)
    poses = np.repeat(arm.forward(start)[0][None], ticks, axis=0)
    poses[:, 1, 3] += 0.2 * share**3 * (10 - 15 * share + 6 * share**2)
    plain = begun(start, arm, DT)
    free = plain.run(poses)
    elbow = arm.elbow(free[-1])
    aside = np.cross(elbow - arm.elbow(start), [0, 0, 1.0])
    post = aa.Ball(elbow + aside / np.linalg.norm(aside) * 0.03, 0.03, name="post")
    scene = aa.Scene([post], clearance=CLEARANCE)
    assert distance(arm, scene, free).min() < 0 < CLEARANCE < distance(arm, scene, start)
    q = started(arm, scene, start).run(poses)
    assert distance(arm, scene, between(q)).min() >= CLEARANCE
    metres, radians = streams.errors(arm, q, poses)
    assert np.maximum(metres, radians).max() < 1e-8


@pytest.mark.slow
def test_a_way_round_is_found_or_that_there_is_none_is_said() -> None:
    """Amid 14 obstacles a tracker reaches 90 % of the hands that its branch can hold, and is NEAREST to
    others.
    """
    arm = with_body("kuka_iiwa14_r820")
    start = streams.posture(arm)
    rng, ends, turned = np.random.default_rng(0), [], 0
    for _ in range(34 if draw.COUNT else 10):
        scene = cluttered(arm, start, rng, 14)
        tracker, q = started(arm, scene, start), [start]
        for _ in range(3):
            hand = arm.forward(clear_posture(arm, scene, start, rng))[0]
            for _ in range(6000):
                now = tracker.step(hand)
                q.append(now.q)
                turned += now.status == aa.Tracking.TURNING
                if now.status == aa.Tracking.FOLLOWING:
                    break
            ends.append(now.status)
            if now.status == aa.Tracking.NEAREST:
                assert now.why in (aa.Status.CLEARANCE, aa.Status.LIMITS)
        kept(arm, scene, q)
    assert turned and set(ends) <= {aa.Tracking.FOLLOWING, aa.Tracking.NEAREST}
    assert ends.count(aa.Tracking.FOLLOWING) >= 0.9 * len(ends)


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("swing", [0.008, 0.0])
def test_a_hand_that_trembles_is_led_round_too(swing: float) -> None:
    """A tracker with a filter comes as near to a hand with noise or swing as to one at rest."""
    arm = with_body("kuka_iiwa14_r820")
    start = streams.posture(arm)
    turned, farther = 0, []
    for seed in (12, 14):
        rng = np.random.default_rng([seed, 8])
        scene = cluttered(arm, start, rng, 14)
        calm, shaken = started(arm, scene, start), np.random.default_rng(seed)
        for _ in range(2):
            hand = arm.forward(clear_posture(arm, scene, start, rng))[0]
            tracker = started(arm, scene, calm.q, filter=aa.HandFilter())
            calm.run(np.repeat(hand[None], 3000, axis=0))
            q = [tracker.q]
            for k in range(4000):
                if k % 3 == 0:
                    pose = moved(streams.noisy(hand[None], shaken)[0], [swing * np.sin(1.5 * k * DT), 0, 0])
                now = tracker.step(pose)
                q.append(now.q)
                turned += now.status == aa.Tracking.TURNING
            kept(arm, scene, q)
            farther.append(now.distance - calm.step(hand).distance)
    assert turned and max(farther) < 3e-3 + swing, farther


def test_a_start_that_touches_is_refused_or_led_out() -> None:
    """A tracker refuses a start within the clearance, or with outside="escape" leaves it, RETURNING."""
    arm = with_body("kuka_iiwa14_r820")
    start = streams.posture(arm)
    scene, tool = wall(arm, start, -0.01)
    tracker = aa.Tracker(arm.with_(scene=scene), DT)
    with pytest.raises(aa.SceneError, match=r"'grip' is 0\.02 m nearer to 'wall' than the clearance"):
        tracker.start(start)
    refused(aa.InputError, "has not begun", lambda: tracker.step(tool))
    tracker.start(start, outside="escape")
    rooms, statuses = [float(distance(arm, scene, start))], []
    for _ in range(1500):
        now = tracker.step(tool)
        rooms.append(float(distance(arm, scene, now.q)))
        statuses.append(now.status)
        if now.status == aa.Tracking.RETURNING:
            assert (now.why, now.pair) == (aa.Status.CLEARANCE, ("wall", "grip"))
    returning = np.array(statuses) == aa.Tracking.RETURNING
    assert np.diff(rooms).min() >= -1e-9 or not returning[np.argmin(np.diff(rooms))]
    assert np.array_equal(returning, np.array(rooms[1:]) < CLEARANCE)
    assert not returning[-1]
    deep, _ = wall(arm, start, -0.2)
    refused(aa.SceneError, "nearer to 'wall'", lambda: aa.Tracker(arm.with_(scene=deep), DT).start(start))


def test_a_solution_that_ends_at_an_obstacle_is_begun_from() -> None:
    """A tracker starts from a solution of `solve` at the clearance exactly, and follows."""
    arm = with_body("kuka_iiwa14_r820")
    rng, met = np.random.default_rng(3), 0
    while met < 8:
        q, near = (streams.posture(arm) + rng.uniform(-0.6, 0.6, (2, 7))).clip(arm.lower, arm.upper)
        pose = arm.forward(q)[0]
        free = arm.solve(pose, seed=near)
        post = aa.Ball(arm.elbow(free.q) + 0.06 * rng.normal(size=3), 0.04, name="post")
        scene = aa.Scene([post], clearance=CLEARANCE)
        found = arm.with_(scene=scene).solve(pose, seed=near)
        if found.status != aa.Status.OK or abs(distance(arm, scene, found.q) - CLEARANCE) > 1e-9:
            continue
        met += 1
        tracker = started(arm, scene, found.q)
        ticks = [tracker.step(pose) for _ in range(500)]
        assert all(now.status != aa.Tracking.RETURNING for now in ticks)
        assert ticks[-1].status == aa.Tracking.FOLLOWING
        joints = between(np.array([found.q, *(now.q for now in ticks)]))
        assert distance(arm, scene, joints).min() >= CLEARANCE - 1e-9


@pytest.mark.parametrize("kind", ["elbow", "elbow_direction"])
def test_a_hint_that_is_none_is_said(kind: str) -> None:
    """A tracker says BAD_INPUT of an elbow hint that is not finite or a zero direction, and follows
    the hand.
    """
    arm = with_body("kuka_iiwa14_r820")
    start = streams.posture(arm)
    tracker = begun(start, arm, DT)
    pose = arm.forward(start)[0]
    for bad in [np.full(3, np.nan), np.array([0.0, np.inf, 0.0]), np.zeros(3)]:
        now = tracker.step(pose, **{kind: bad})  # type: ignore[arg-type]  # one of the two
        said = kind == "elbow_direction" or not np.isfinite(bad).all()
        assert now.status == aa.Tracking.FOLLOWING
        assert now.why == (aa.Status.BAD_INPUT if said else aa.Status.OK)


@pytest.mark.turns(2)
@pytest.mark.parametrize(
    ("name", "seed"), [*((name, seed) for name in ARMS for seed in range(3)), (ARMS[1], 52)]
)
def test_a_constant_hand_among_obstacles_brings_the_arm_to_rest(name: str, seed: int) -> None:
    """In a scene a tracker comes to rest, FOLLOWING or NEAREST, for a hand at rest."""
    arm = with_body(name)
    rng = np.random.default_rng([2, seed])
    start = streams.posture(arm)
    scene = cluttered(arm, start, rng)
    gc = arm.forward(start)[2]
    for _ in range(400):
        there = rng.uniform(arm.lower, arm.upper)
        hand, _, own = arm.forward(there)
        if own == gc and distance(arm, scene, there) > 0.015 and abs(np.sin(there[3])) > 0.15:
            break
    tracker = started(arm, scene, start)
    q = tracker.run(np.repeat(hand[None], round(45.0 / DT), axis=0))
    assert np.abs(np.diff(q[-500:], axis=0)).sum() < 1e-9
    assert tracker.step(hand).status in (aa.Tracking.FOLLOWING, aa.Tracking.NEAREST)
    assert distance(arm, scene, q[::50]).min() >= CLEARANCE


@pytest.mark.parametrize("seed", [1, 3])
def test_obstacles_out_of_the_way_cost_nothing_beside_a_limit(seed: int) -> None:
    """A scene far away makes a tracker at a joint limit at most 10 % less exact."""
    arm = with_body("kuka_iiwa14_r820")
    start = streams.posture(arm)
    stream = streams.stream(arm, "limits", seed, seconds=6.0, noise=False)
    plain = begun(start, arm, DT)
    far = aa.Scene([aa.Ball([3.0, 0.0, 0.0], 0.1)], clearance=CLEARANCE)
    off = [
        np.sqrt((streams.errors(arm, tracker.run(stream.true), stream.true)[0] ** 2).mean())
        for tracker in (plain, started(arm, far, start))
    ]
    assert off[1] < 1.1 * off[0]
