"""The law of a tracker with a bound on jerk: every row keeps it, and no joint runs into a limit.

The checker takes differences of the rows that were returned; it knows nothing of the core.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from motion.test_offset_steps import FR3, READY
from motion.test_tracking_in_scenes import CLEARANCE, between, cluttered, distance, with_body
from numpy.typing import NDArray
from support import draw, streams
from support.calibrated import ARMS as CALIBRATED
from support.ticks import DT, HARDEST, hostile, moved, random_rotation, settled

import armangle as aa

Array = NDArray[np.float64]

ARMS: dict[str, aa.Arm] = {
    "iiwa 14": aa.Arm.from_catalogue("kuka_iiwa14_r820"),
    "OpenArm": aa.Arm.from_catalogue("openarm_v10"),
    "iiwa 7, 2 mm": CALIBRATED["kuka_iiwa7_r800 2.0 mm"],
    "FR3": FR3,
}
JERKS = (20.0, 300.0, 5000.0)
TICKS = 60_000 if draw.COUNT else 4_000


def start_of(arm: aa.Arm) -> Array:
    return np.array(READY) if arm.kind.startswith("offset") else streams.posture(arm)


def command(arm: aa.Arm, rng: np.random.Generator) -> Array:
    if not arm.kind.startswith("offset"):
        return hostile(arm, rng)
    pose = arm.forward(rng.uniform(arm.lower, arm.upper))[0].copy()
    kind = rng.integers(3)
    if kind == 0:
        pose[:3, :3] = random_rotation(rng)
        pose[:3, 3] = rng.normal(size=3) * rng.choice([0.3, 1.0, 5.0])
    elif kind == 1:
        pose[rng.integers(3), rng.integers(4)] = np.nan
    return pose


def differences(q: Array, dt: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Velocity, acceleration and jerk of rows that begin at rest, and what rounding makes of each."""
    step = dt[:, None]
    ulp = np.spacing(np.abs(q).max())
    v = np.diff(q, axis=0) / step
    v_off = 2 * ulp / step
    before = np.concatenate([np.zeros((1, 7)), v[:-1]])
    a = (v - before) / step
    a_off = (v_off + np.concatenate([v_off[:1], v_off[:-1]])) / step
    before = np.concatenate([np.zeros((1, 7)), a[:-1]])
    j = (a - before) / step
    return v, a, j, v_off, a_off, (a_off + np.concatenate([a_off[:1], a_off[:-1]])) / step


def check_jerk(arm: aa.Arm, q: Array, dt: Array, jerk: object, hardest: object = HARDEST) -> None:
    v, a, j, v_off, a_off, j_off = differences(q, dt)
    assert np.isfinite(q).all()
    assert (q >= arm.lower).all()
    assert (q <= arm.upper).all()
    assert (np.abs(v) <= arm.velocity * (1 + 1e-12) + v_off).all()
    assert (np.abs(a) <= np.asarray(hardest) * (1 + 1e-12) + a_off).all()
    assert (np.abs(j) <= np.asarray(jerk) * (1 + 1e-12) + j_off).all()


@pytest.mark.parametrize("jerk", JERKS)
@pytest.mark.parametrize("irregular", [False, True])
@pytest.mark.parametrize("name", ARMS)
def test_hostile_hands_never_break_a_bound(name: str, irregular: bool, jerk: float) -> None:
    arm = ARMS[name]
    rng = np.random.default_rng([draw.SEED, int(jerk), irregular])
    hand = rng.choice(np.array([None, aa.HandFilter()]))
    tracker = aa.Tracker(arm, DT, filter=hand, jerk=jerk)
    tracker.start(start_of(arm))
    q, times = [tracker.q], []
    while len(times) < TICKS:
        pose: Array | None = command(arm, rng)
        if rng.random() < 0.1:
            pose = None
        elbow = rng.choice(np.array([None, 1])) and rng.normal(size=3)
        branch = int(rng.integers(8)) if rng.random() < 0.2 else None
        for _ in range(rng.integers(1, 300)):
            dt = DT * rng.uniform(0.2, 5.0) if irregular and rng.random() < 0.5 else DT
            now = tracker.step(pose, elbow, dt=dt, reconfigure=branch)
            branch = None
            assert now.distance >= 0
            q.append(now.q)
            times.append(dt)
    check_jerk(arm, np.array(q), np.array(times), jerk)


@pytest.mark.parametrize("name", ARMS)
def test_joints_pressed_to_their_limits_stop_there_at_rest(name: str) -> None:
    """A target that runs along one joint to its limit and beyond, each way."""
    arm = ARMS[name]
    for joint, end in itertools.product(range(7), (-1.0, 1.0)):
        start = start_of(arm)
        tracker = aa.Tracker(arm, DT, jerk=100.0, detours=False)
        tracker.start(start)
        rows = [tracker.q]
        limit = arm.upper[joint] if end > 0 else arm.lower[joint]
        for share in np.linspace(0.0, 1.3, 250):
            to = start.copy()
            to[joint] += share * (limit - start[joint])
            rows.append(tracker.step(arm.forward(to)[0]).q)
        rows.extend(tracker.run(np.repeat(arm.forward(to)[0][None], 500, axis=0)))
        check_jerk(arm, np.array(rows), np.full(len(rows) - 1, DT), 100.0)


@pytest.mark.parametrize(
    "jerk", [100.0, *JERKS[1:], np.array([7500, 3750, 5000, 6250, 7500, 10000, 10000.0])]
)
@pytest.mark.parametrize("name", ARMS)
def test_a_target_at_rest_is_met_exactly_without_swinging(name: str, jerk: float | Array) -> None:
    arm = ARMS[name]
    start = start_of(arm)
    home = arm.forward(start)[0]
    for by in ([0.02, 0.05, -0.03], [-0.08, 0.0, 0.06]):
        target = moved(home, np.array(by))
        tracker = aa.Tracker(arm, DT, jerk=jerk)
        tracker.start(start)
        now = settled(tracker, target, 6.0)
        assert now.status == aa.Tracking.FOLLOWING
        q = np.concatenate([tracker.q[None], tracker.run(np.repeat(target[None], 500, axis=0))])
        assert np.abs(np.diff(q, axis=0)).sum() < 1e-9


@pytest.mark.parametrize("name", ARMS)
def test_a_smooth_hand_is_followed_exactly_within_the_jerk(name: str) -> None:
    arm = ARMS[name]
    start = start_of(arm)
    t = DT * np.arange(1500)
    poses = np.repeat(arm.forward(start)[0][None], len(t), axis=0)
    poses[:, :3, 3] += 0.03 * np.sin(2.0 * t)[:, None] * np.array([1.0, -0.5, 0.7])
    tracker = aa.Tracker(arm, DT, jerk=5000.0)
    tracker.start(start)
    q = np.concatenate([tracker.q[None], tracker.run(poses)])
    check_jerk(arm, q, np.full(len(t), DT), 5000.0)
    off = np.linalg.norm(arm.forward(q[1:])[0][:, :3, 3] - poses[:, :3, 3], axis=1)
    assert np.mean(off[250:] < 1e-8) > 0.9


@pytest.mark.parametrize("jerk", [100.0, 5000.0])
@pytest.mark.parametrize("seed", range(2))
def test_nothing_touches_among_obstacles(seed: int, jerk: float) -> None:
    rng = np.random.default_rng([draw.SEED, seed])
    arm = with_body("kuka_iiwa14_r820")
    start = streams.posture(arm)
    scene = cluttered(arm, start, rng)
    tracker = aa.Tracker(arm.with_(scene=scene), DT, jerk=jerk)
    tracker.start(start)
    q, times = [tracker.q], []
    while len(times) < TICKS // 2:
        pose = hostile(arm, rng)
        for _ in range(rng.integers(1, 300)):
            dt = DT * (1.0 if rng.random() < 0.5 else rng.uniform(0.2, 5.0))
            q.append(tracker.step(pose, dt=dt).q)
            times.append(dt)
    joints = np.array(q)
    check_jerk(arm, joints, np.array(times), jerk)
    assert distance(arm, scene, between(joints)).min() >= CLEARANCE
    assert np.ptp(joints, axis=0).max() > 0.5, "it moves"


@pytest.mark.parametrize("name", ["iiwa 14", "FR3"])
def test_joints_that_begin_outside_their_limits_come_in(name: str) -> None:
    arm = ARMS[name]
    start = start_of(arm)
    start[5] = arm.upper[5] + 0.2
    tracker = aa.Tracker(arm, DT, jerk=200.0)
    tracker.start(start)
    pose = arm.forward(start_of(arm))[0]
    q = np.array([start, *(tracker.step(pose).q for _ in range(1000))])
    *_, j, _, _, j_off = differences(q, np.full(1000, DT))
    assert (np.abs(j) <= 200.0 * (1 + 1e-12) + j_off).all()
    outside = q[:, 5] > arm.upper[5]
    assert not outside[-1]
    assert (np.diff(q[outside, 5]) <= 0).all()


def test_no_bound_on_jerk_is_none() -> None:
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    stream = streams.stream(arm, "glitch", 1, seconds=3.0)
    rows = []
    for options in ({}, {"jerk": None}, {"jerk": np.full(7, np.inf)}):
        tracker = aa.Tracker(arm, DT, **options)  # type: ignore[arg-type]  # keywords by name
        tracker.start(streams.posture(arm))
        rows.append(tracker.run(stream.samples))
    assert np.array_equal(rows[0], rows[1])
    assert np.array_equal(rows[0], rows[2])


@pytest.mark.parametrize("missing", ["acceleration", "velocity"])
def test_jerk_alone_bounds_too(missing: str) -> None:
    arm = ARMS["iiwa 14"]
    rng = np.random.default_rng([draw.SEED, len(missing)])
    tracker = aa.Tracker(arm, DT, jerk=300.0, **{missing: None})  # type: ignore[arg-type]  # keywords by name
    tracker.start(streams.posture(arm))
    q = [tracker.q[None]]
    for _ in range(10):
        q.append(tracker.run(np.repeat(hostile(arm, rng)[None], 150, axis=0)))
    rows = np.concatenate(q)
    *_, j, _, _, j_off = differences(rows, np.full(len(rows) - 1, DT))
    assert (np.abs(j) <= 300.0 * (1 + 1e-12) + j_off).all()
    assert ((rows >= arm.lower) & (rows <= arm.upper)).all()
