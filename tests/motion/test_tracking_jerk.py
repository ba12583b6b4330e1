"""The law of a tracker's bounds, on arms of all kinds, with a bound on jerk and without: every row keeps it.

The checker takes differences of the rows that were returned; it knows nothing of the core.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from support import draw, streams
from support.moves import begun, moved
from support.ticks import ARMS, DT, check_bounds, check_jerk, command, differences, hostile, settled, start_of

import armangle as aa

Array = NDArray[np.float64]

JERKS = (20.0, 300.0, 5000.0)
TICKS = 60_000 if draw.COUNT else 4_000


@pytest.mark.turns(16)
@pytest.mark.parametrize("jerk", [None, *JERKS])
@pytest.mark.parametrize("irregular", [False, True])
@pytest.mark.parametrize("name", ARMS)
def test_hostile_hands_never_break_a_bound(name: str, irregular: bool, jerk: float | None) -> None:
    """A tracker keeps limits, velocity, acceleration and jerk for hostile targets, lost samples and uneven
    dt.
    """
    arm = ARMS[name]
    rng = np.random.default_rng([draw.SEED, int(jerk or 0), irregular])
    tracker = begun(start_of(arm), arm, DT, filter=rng.choice(np.array([None, aa.HandFilter()])), jerk=jerk)
    q, times = [tracker.q], []
    while len(times) < TICKS * (1 if jerk else 2):
        pose: Array | None = command(arm, rng)
        if rng.random() < 0.1:
            pose = None
        elbow = rng.choice(np.array([None, 1])) and rng.normal(size=3)
        branch = int(rng.integers(8)) if jerk and rng.random() < 0.2 else None
        for _ in range(rng.integers(1, 300)):
            dt = DT * rng.uniform(0.1, 5.0) if irregular and rng.random() < 0.5 else DT
            now = tracker.step(pose, elbow, dt=dt, reconfigure=branch)
            branch = None
            assert now.distance >= 0
            q.append(now.q)
            times.append(dt)
    joints = np.array(q)
    if jerk:
        check_jerk(arm, joints, np.array(times), jerk)
        return
    check_bounds(arm, joints, np.array(times))
    if arm.kind == "srs":
        bend = arm.geometry.signs[3] * joints[:, 3] + arm.geometry.offsets[3] - arm.geometry.delta
        bend = np.mod(bend + np.pi, 2 * np.pi) - np.pi
        assert (np.sign(bend) == np.sign(bend[0])).all(), "the elbow went through straight"


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ARMS)
def test_joints_pressed_to_their_limits_stop_there_at_rest(name: str) -> None:
    """A tracker keeps its bounds for a target that runs along one joint beyond its limit."""
    arm = ARMS[name]
    for joint, end in itertools.product(range(7), (-1.0, 1.0)):
        start = start_of(arm)
        tracker = begun(start, arm, DT, jerk=100.0, detours=False)
        rows = [tracker.q]
        limit = arm.upper[joint] if end > 0 else arm.lower[joint]
        for share in np.linspace(0.0, 1.3, 250):
            to = start.copy()
            to[joint] += share * (limit - start[joint])
            rows.append(tracker.step(arm.forward(to)[0]).q)
        rows.extend(tracker.run(np.repeat(arm.forward(to)[0][None], 500, axis=0)))
        check_jerk(arm, np.array(rows), np.full(len(rows) - 1, DT), 100.0)


@pytest.mark.turns(2)
@pytest.mark.parametrize(
    "jerk", [None, 100.0, *JERKS[1:], np.array([7500, 3750, 5000, 6250, 7500, 10000, 10000.0])]
)
@pytest.mark.parametrize("name", ARMS)
def test_a_target_at_rest_is_met_exactly_without_swinging(name: str, jerk: float | Array | None) -> None:
    """A tracker meets a pose at rest exactly, with any jerk bound, and then stands."""
    arm = ARMS[name]
    home = arm.forward(start_of(arm))[0]
    for by in ([0.02, 0.05, -0.03], [-0.08, 0.0, 0.06]):
        target = moved(home, by)
        tracker = begun(start_of(arm), arm, DT, jerk=jerk)
        now = settled(tracker, target, 6.0)
        assert (now.status, now.why) == (aa.Tracking.FOLLOWING, aa.Status.OK) and now.distance <= 1e-9
        q = np.concatenate([tracker.q[None], tracker.run(np.repeat(target[None], 500, axis=0))])
        assert np.abs(np.diff(q, axis=0)).sum() < 1e-9


@pytest.mark.parametrize("name", ARMS)
def test_a_smooth_hand_is_followed_exactly_within_the_jerk(name: str) -> None:
    """A tracker with a jerk bound is exact in over 90 % of the cycles behind a smooth hand."""
    arm = ARMS[name]
    start = start_of(arm)
    t = DT * np.arange(1500)
    poses = np.repeat(arm.forward(start)[0][None], len(t), axis=0)
    poses[:, :3, 3] += 0.03 * np.sin(2.0 * t)[:, None] * np.array([1.0, -0.5, 0.7])
    tracker = begun(start, arm, DT, jerk=5000.0)
    q = np.concatenate([tracker.q[None], tracker.run(poses)])
    check_jerk(arm, q, np.full(len(t), DT), 5000.0)
    off = np.linalg.norm(arm.forward(q[1:])[0][:, :3, 3] - poses[:, :3, 3], axis=1)
    assert np.mean(off[250:] < 1e-8) > 0.9


@pytest.mark.parametrize("name", ["iiwa 14", "FR3"])
def test_joints_that_begin_outside_their_limits_come_in(name: str) -> None:
    """A tracker with a jerk bound brings a joint from beyond its limit within it, without turning back."""
    arm = ARMS[name]
    start = start_of(arm)
    start[5] = arm.upper[5] + 0.2
    tracker = begun(start, arm, DT, jerk=200.0)
    pose = arm.forward(start_of(arm))[0]
    q = np.array([start, *(tracker.step(pose).q for _ in range(1000))])
    *_, j, _, _, j_off = differences(q, np.full(1000, DT))
    assert (np.abs(j) <= 200.0 * (1 + 1e-12) + j_off).all()
    outside = q[:, 5] > arm.upper[5]
    assert not outside[-1]
    assert (np.diff(q[outside, 5]) <= 0).all()


def test_no_bound_on_jerk_is_none_and_jerk_alone_bounds_too() -> None:
    """jerk=None or infinite changes no bit; a jerk bound holds without acceleration or velocity bounds."""
    arm = ARMS["iiwa 14"]
    samples = streams.stream(arm, "glitch", 1, seconds=3.0).samples
    free, *rows = (
        begun(start_of(arm), arm, DT, **options).run(samples)
        for options in ({}, {"jerk": None}, {"jerk": np.full(7, np.inf)})
    )
    assert all(np.array_equal(free, each) for each in rows)
    for missing in ("acceleration", "velocity"):
        rng = np.random.default_rng([draw.SEED, len(missing)])
        tracker = begun(start_of(arm), arm, DT, jerk=300.0, **{missing: None})
        q = [tracker.q[None]]
        q += [tracker.run(np.repeat(hostile(arm, rng)[None], 150, axis=0)) for _ in range(10)]
        joints = np.concatenate(q)
        *_, j, _, _, j_off = differences(joints, np.full(len(joints) - 1, DT))
        assert (np.abs(j) <= 300.0 * (1 + 1e-12) + j_off).all()
        assert ((joints >= arm.lower) & (joints <= arm.upper)).all()
