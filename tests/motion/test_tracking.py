"""The laws of the tracker: no freeze, no jump, exact where it can be; of its bounds test_tracking_jerk.py."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from support import streams
from support.moves import begun, moved, refused
from support.ticks import DT, HARDEST, check_bounds, hostile, settled

import armangle as aa

Array = NDArray[np.float64]

ARMS = ("kuka_iiwa14_r820", "realman_rm75_b", "openarm_v10")
STILL = 0.05  # rad off straight that joint 4 keeps at rest
ARM_OF = {name: aa.Arm.from_catalogue(name) for name in ARMS}


def tracker_at(arm: aa.Arm, q: Array, **options: object) -> aa.Tracker:
    """A tracker of 4 ms at rest at joints q."""
    return begun(q, arm, DT, **options)


@pytest.fixture(params=ARMS)
def arm(request: pytest.FixtureRequest) -> aa.Arm:
    """An S-R-S arm, each of three in turn."""
    return ARM_OF[request.param]


@pytest.mark.slow
@pytest.mark.parametrize(("scenario", "dt"), zip(streams.SCENARIOS, 2 * [0.01, 0.004, 0.001], strict=True))
def test_streams_keep_the_bounds(arm: aa.Arm, scenario: str, dt: float) -> None:
    """A tracker with a filter keeps its bounds in a stream of any kind."""
    stream = streams.stream(arm, scenario, 3, dt=dt, seconds=6.0)
    tracker = begun(streams.posture(arm), arm, dt, filter=aa.HandFilter())
    q = np.concatenate([tracker.q[None], tracker.run(stream.samples)])
    check_bounds(arm, q, np.full(len(q) - 1, dt))


def test_a_lost_sample_with_a_hint_of_whole_numbers_is_held(arm: aa.Arm) -> None:
    """A tracker without a pose is HELD, with an elbow hint of integers too."""
    tracker = tracker_at(arm, streams.posture(arm))
    for hint in ([0, 0, 1], np.array([0, 0, 1])):  # an array of integers is converted first
        assert tracker.step(None, hint).status is aa.Tracking.HELD


def test_run_is_step_in_a_loop(arm: aa.Arm) -> None:
    """`Tracker.run` gives the joints of `Tracker.step` in a loop."""
    stream = streams.stream(arm, "glitch", 1, seconds=3.0)
    start = streams.posture(arm)
    one = tracker_at(arm, start, filter=aa.HandFilter())
    other = tracker_at(arm, start, filter=aa.HandFilter())
    looped = np.array([one.step(pose).q for pose in stream.samples])
    assert np.array_equal(looped, other.run(stream.samples))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_a_smooth_hand_inside_is_followed_exactly(arm: aa.Arm, seed: int) -> None:
    """A tracker is exact in over 90 % of the cycles in which a smooth hand is in reach."""
    stream = streams.stream(arm, "inside", seed, seconds=20.0, noise=False)
    velocity = streams.VELOCITY.get(arm.name)
    q = tracker_at(arm, streams.posture(arm), velocity=velocity).run(stream.true)
    metres, radians = streams.errors(arm, q, stream.true)
    ok = streams.judged(arm, stream.true, DT)
    assert ((metres + radians)[ok] < 1e-8).mean() > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_no_chatter_at_rest_whatever_the_command(arm: aa.Arm, seed: int) -> None:
    """A tracker comes to rest for a hand at rest of any kind."""
    rng = np.random.default_rng([seed, 5])
    tracker = tracker_at(arm, streams.posture(arm))
    pose = hostile(arm, rng)
    settled(tracker, pose, 30.0)
    q = np.concatenate([tracker.q[None], tracker.run(np.repeat(pose[None], 2500, axis=0))])
    assert np.abs(np.diff(q, axis=0)).sum() < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_the_tool_returns_to_exact_after_the_hand_was_out_of_reach(arm: aa.Arm, seed: int) -> None:
    """A tracker is FOLLOWING again at most 0.1 s and 2.5 times what the slowest joint needs for its way alone
    after the hand is back in reach.
    """
    rng = np.random.default_rng(seed)
    start = streams.posture(arm)
    tracker = tracker_at(arm, start)
    home = arm.forward(start)[0]
    away = moved(home, 2.0 * rng.normal(size=3))
    out = settled(tracker, away, 1.0)
    assert out.status == aa.Tracking.NEAREST
    ticks = 1
    while tracker.step(home).status != aa.Tracking.FOLLOWING:
        ticks += 1
        assert ticks < 5.0 / DT
    way, braking = np.abs(tracker.q - out.q), np.abs(out.velocity) / HARDEST
    slowest = np.maximum(2 * np.sqrt(way / HARDEST), way / arm.velocity + arm.velocity / HARDEST) + braking
    assert ticks * DT < 2.5 * slowest.max() + 0.1


def test_out_of_reach_the_gap_is_that_of_joint_4_and_the_rotation_is_held() -> None:
    """Out of reach a tracker keeps the rotation, and `gap` is the distance that joint 4 leaves."""
    arm = ARM_OF["kuka_iiwa14_r820"]
    start = streams.posture(arm)
    home = arm.forward(start)[0]
    shoulder = np.array([0, 0, arm.geometry.d_bs])
    outer = np.sqrt(
        arm.geometry.d_se**2
        + arm.geometry.d_ew**2
        + 2 * arm.geometry.d_se * arm.geometry.d_ew * np.cos(STILL)
    )
    for far in (0.3, 0.6, 1.5):
        away = moved(home, far * (home[:3, 3] - shoulder) / np.linalg.norm(home[:3, 3] - shoulder))
        now = settled(tracker_at(arm, start), away, 12.0)
        wrist = away[:3, 3] - arm.geometry.d_wf * away[:3, 2]
        assert now.status == aa.Tracking.NEAREST
        assert now.why == aa.Status.UNREACHABLE
        assert now.gap == pytest.approx(np.linalg.norm(wrist - shoulder) - outer, abs=1e-12)
        assert now.distance == pytest.approx(now.gap, abs=1e-9)
        reached = arm.forward(now.q)[0]
        assert np.abs(reached[:3, :3] - away[:3, :3]).max() < 1e-9


def test_single_outliers_do_not_disturb_the_tool(arm: aa.Arm) -> None:
    """Outliers of 0.3 m move the tool of a tracker with a filter by less than 5 mm."""
    plain = streams.stream(arm, "inside", 2, seconds=20.0)
    hit = plain.samples.copy()
    rng = np.random.default_rng(0)
    for k in rng.choice(np.flatnonzero(plain.fresh)[50:-50], 12, replace=False):
        until = k + 1 + np.argmax(plain.fresh[k + 1 :])
        hit[k:until, :3, 3] += 0.3 * rng.normal(size=3)
    start = streams.posture(arm)
    one = tracker_at(arm, start, filter=aa.HandFilter()).run(plain.samples)
    other = tracker_at(arm, start, filter=aa.HandFilter()).run(hit)
    apart = arm.forward(one)[0][:, :3, 3] - arm.forward(other)[0][:, :3, 3]
    assert np.linalg.norm(apart, axis=1).max() < 5e-3


@pytest.mark.parametrize("lost", [1, 2, 7])
@pytest.mark.parametrize("name", [*ARMS, "franka_fr3"])
def test_a_lost_sample_leaves_no_false_status(name: str, lost: int) -> None:
    """A tracker is HELD in exactly the cycles without sample, and FOLLOWING only within 1e-9 m of the
    hand.
    """
    arm: aa.Arm = ARM_OF[name] if name in ARM_OF else aa.Arm.from_catalogue(name).with_(velocity=3.0)
    start = streams.posture(ARM_OF[name]) if name in ARM_OF else 0.5 * (arm.lower + arm.upper) + 0.1
    tracker = begun(start, arm, DT)
    pose, seen = arm.forward(start)[0].copy(), set()
    for tick in range(160):
        if tick < 60:
            pose[1, 3] += 1e-4
        missing = 60 <= tick < 60 + lost or 90 <= tick < 90 + lost
        lost_one = None if tick % 2 else np.full((4, 4), np.nan)
        now = tracker.step(lost_one if missing else pose)
        off = np.linalg.norm(arm.forward(now.q)[0][:3, 3] - pose[:3, 3])
        assert (now.status == aa.Tracking.HELD) == missing
        assert missing or now.distance >= off * (1 - 1e-9) - 1e-12
        assert now.status != aa.Tracking.FOLLOWING or off <= 1e-9
        seen.add(now.status)
    assert now.status == aa.Tracking.FOLLOWING
    assert {aa.Tracking.HELD, aa.Tracking.FOLLOWING} <= seen


def test_speed_is_that_of_the_samples_whatever_was_lost_between() -> None:
    """A tracker follows an even hand to 1e-6 m though every fifth sample is lost."""
    arm = ARM_OF["kuka_iiwa14_r820"]
    start = streams.posture(arm)
    poses = np.repeat(arm.forward(start)[0][None], 300, axis=0)
    poses[:, 1, 3] += np.clip(np.arange(300) - 20, 0, None) * 4e-4
    samples = poses.copy()
    samples[::5] = np.nan
    q = tracker_at(arm, start).run(samples)
    metres, _ = streams.errors(arm, q, poses)
    assert metres[150:].max() < 1e-6


def swung(dt: float, count: int, rate: int) -> tuple[Array, Array]:
    """The poses of a hand that swings 0.1 m at 0.3 Hz, and the index of the latest sample at each cycle."""
    t = dt * np.arange(count)
    true = np.repeat(np.eye(4)[None], count, axis=0)
    true[:, 1, 3] = 0.1 * np.minimum(t / 2, 1) ** 2 * np.sin(2 * np.pi * 0.3 * t)
    return true, np.floor(np.floor(t * rate + 1e-9) / rate / dt + 1e-9).astype(int)


@pytest.mark.parametrize(("rate", "off", "noisy"), [(30, 1.5, 2.0), (90, 0.8, 3.0), (250, 0.4, 6.0)])
def test_samples_rarer_than_ticks_make_no_velocity_jump(rate: int, off: float, noisy: float) -> None:
    """A filter spreads what a sample corrects: acceleration (RMS, m/s²) and error stay small.

    `off` is the error in mm RMS; `noisy` the acceleration with noise of 0.4 mm.
    """
    true, latest = swung(0.002, 5000, rate)
    for noise, most in ((0.0, 0.8), (4e-4, noisy)):
        seen = true.copy()
        seen[:, 1, 3] += np.random.default_rng(0).normal(0, noise, len(true))
        y = aa.HandFilter().smooth(seen[latest], 0.002)[500:, 1, 3]
        assert np.sqrt((np.diff(y, n=2) ** 2).mean()) / 0.002**2 < most
        assert noise or np.sqrt(((y - true[500:, 1, 3]) ** 2).mean()) < 1e-3 * off


@pytest.mark.parametrize(("rate", "most"), [(15, 3e-3), (10, 4e-3)])
def test_a_device_slower_than_the_loop_is_no_hand_that_rests(rate: int, most: float) -> None:
    """A filter fed at 10 or 15 Hz in a loop of 250 Hz is off by at most 3 or 4 mm RMS."""
    true, latest = swung(DT, 2500, rate)
    smooth = aa.HandFilter(omega=20.0, patience=0.0).smooth(true[latest], DT)
    assert np.sqrt(((smooth - true)[500:, 1, 3] ** 2).mean()) < most


def test_a_jump_that_lasts_is_believed() -> None:
    """A tracker with a filter is HELD at a jump of the hand, and follows when it lasts."""
    arm = ARM_OF["kuka_iiwa14_r820"]
    start = streams.posture(arm)
    tracker = tracker_at(arm, start, filter=aa.HandFilter(patience=0.12))
    pose = moved(arm.forward(start)[0], np.array([0, 0.2, 0]))
    assert tracker.step(pose).status == aa.Tracking.HELD
    assert settled(tracker, pose, 3.0).status == aa.Tracking.FOLLOWING


def through(arm: aa.Arm, q: Array, joint: int, seconds: float) -> Array:
    """Poses of joints q of which one swings smoothly through 0 to its negative."""
    s = np.linspace(0, 1, round(seconds / DT))
    swing = np.repeat(q[None], len(s), axis=0)
    swing[:, joint] = q[joint] * (1 - 2 * s**3 * (10 - 15 * s + 6 * s**2))
    return np.asarray(arm.forward(swing)[0])


@pytest.mark.parametrize("joint", [1, 5])
def test_the_arm_passes_through_where_branches_meet(joint: int) -> None:
    """A tracker is within 0.1 mm of a hand on whose way theta_2 or theta_6 passes 0."""
    arm = ARM_OF["kuka_iiwa14_r820"]
    worst = []
    for seed in range(8):
        wide = 0.2 * np.random.default_rng(seed).normal(size=7) * (seed > 0)
        q = np.radians([10.0, 30.0, 20.0, -80.0, 30.0, 30.0, 10.0]) + wide
        if np.abs(np.sin(q[6 - joint])) < 0.1:  # the other one is singular all the way
            continue
        poses = through(arm, q, joint, 3.0)
        metres, radians = streams.errors(arm, tracker_at(arm, q).run(poses), poses)
        worst.append(np.maximum(metres, 0.2 * radians).max())
    assert np.max(worst) < 1e-4


def test_a_crossing_is_foreseen() -> None:
    """A tracker passes theta_6 = 0 from any psi into the other branch, its largest errors on average 3 mm."""

    arm = ARM_OF["kuka_iiwa14_r820"]
    worst, branches = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        q = np.radians([10.0, 40.0, 20.0, -80.0, 30.0, 40.0, 10.0]) + 0.15 * rng.normal(size=7)
        swing = through(arm, q, 5, 1.6)
        poses = np.concatenate([np.repeat(swing[:1], 50, axis=0), swing, np.repeat(swing[-1:], 100, axis=0)])
        _, psi, gc = arm.forward(q)
        start = arm.inverse(poses[0], psi + rng.uniform(-0.6, 0.6), gc, seed=q, limits=False)
        joints = tracker_at(arm, start).run(poses)
        metres, radians = streams.errors(arm, joints, poses)
        worst.append(np.maximum(metres, 0.2 * radians).max())
        branches.append(arm.forward(joints[-1])[2] == gc ^ 4)
    assert np.mean(worst) < 3e-3
    assert all(branches), "the arm went through, not round"


def test_an_elbow_that_bends_already_is_not_bent_too_far() -> None:
    """A tracker is off by less than 9.5 mm RMS of a hand that comes in from near the reach."""
    arm = ARM_OF["kuka_iiwa14_r820"]
    start = streams.posture(arm)
    home, reach = arm.forward(start)[0], arm.geometry.d_se + arm.geometry.d_ew
    flange = home @ np.linalg.inv(arm.tool)
    out = flange[:3, 3] - arm.geometry.d_wf * flange[:3, 2] - (arm.base @ [0, 0, arm.geometry.d_bs, 1])[:3]
    near = np.linalg.norm(out)
    s = np.linspace(0, 1, round(2.0 / DT))
    going = near + (0.95 * reach - near) * s**3 * (10 - 15 * s + 6 * s**2)
    speed = np.minimum(1.5 * DT * np.arange(1, 200), 0.3)
    coming = going[-1] - DT * np.cumsum(speed)
    coming = coming[coming > 0.75 * reach]
    distances = np.concatenate([going, np.full(round(1.0 / DT), going[-1]), coming])
    poses = np.repeat(home[None], len(distances), axis=0)
    poses[:, :3, 3] += (distances - near)[:, None] * out / near
    metres, _ = streams.errors(arm, tracker_at(arm, start).run(poses), poses)
    assert np.abs(metres[: -len(coming)]).max() < 1e-8
    assert np.sqrt((metres[-len(coming) :] ** 2).mean()) < 9.5e-3


@pytest.mark.parametrize("kind", ["point", "direction"])
def test_an_elbow_hint_turns_the_elbow_and_leaves_the_tool(arm: aa.Arm, kind: str) -> None:
    """A tracker's `elbow` or `elbow_direction` turns psi to the feasible one nearest to it, the tool
    standing.
    """
    start = streams.posture(arm)
    pose, _, gc = arm.forward(start)
    tracker = tracker_at(arm, start)
    shoulder = (arm.base @ np.array([0, 0, arm.geometry.d_bs, 1.0]))[:3]
    elbow = arm.elbow(start)
    hint = elbow + (0.2 if kind == "point" else 0.1) * streams.rotation(np.array([[0.3, 0.2, 0.4]]))[0, 0]
    if kind == "direction":
        hint = hint - shoulder
    named = {"elbow" if kind == "point" else "elbow_direction": hint}
    for _ in range(2500):
        now = tracker.step(pose, **named)  # type: ignore[arg-type]  # one of the two
        assert now.distance < 1e-9
    wished = arm.psi_towards(pose, gc, **{kind: hint})
    nearest = arm.feasible(pose, gc).nearest(wished)
    assert abs(np.angle(np.exp(1j * (now.psi - nearest)))) < 0.01


@pytest.mark.parametrize("hint", ["shoulder", "wrist", "nan"])
@pytest.mark.parametrize("kind", ["elbow", "elbow_direction"])
def test_an_elbow_hint_that_says_nothing_moves_nothing(hint: str, kind: str) -> None:
    """An elbow hint on the axis shoulder-wrist, or of NaN, changes nothing in a tracker's step."""
    arm = ARM_OF["kuka_iiwa14_r820"]
    start = streams.posture(arm)
    pose = arm.forward(start)[0]
    tracker, shoulder = tracker_at(arm, start), np.array([0.0, 0.0, arm.geometry.d_bs])
    point = {
        "shoulder": shoulder,
        "wrist": pose[:3, 3] - arm.geometry.d_wf * pose[:3, 2],
        "nan": np.full(3, np.nan),
    }
    given = point[hint] - (shoulder if kind == "elbow_direction" else 0.0)
    now = tracker.step(pose, **{kind: given})
    assert np.abs(now.q - tracker_at(arm, start).step(pose).q).max() < 1e-15


@pytest.mark.parametrize("seed", range(3))
def test_psi_is_continuous_under_hints_that_jump(arm: aa.Arm, seed: int) -> None:
    """However an elbow hint jumps, a tracker's elbow moves no faster than joints 1 to 3 may."""
    rng = np.random.default_rng(seed)
    stream = streams.stream(arm, "inside", seed, seconds=6.0, noise=False)
    tracker = tracker_at(arm, streams.posture(arm))
    before = arm.elbow(tracker.q)
    fastest = arm.velocity[:3].sum() * (arm.geometry.d_se + abs(arm.geometry.a_3)) * DT
    hint = rng.normal(size=3)
    for i, pose in enumerate(stream.true):
        if i % 40 == 0:
            hint = rng.normal(size=3)
        tracker.step(pose, elbow_direction=hint)
        elbow = arm.elbow(tracker.q)
        assert np.linalg.norm(elbow - before) <= fastest
        before = elbow


@pytest.mark.parametrize("gc", range(8))
def test_reconfigure_leads_to_another_branch_within_the_bounds(gc: int) -> None:
    """`reconfigure` leads a tracker into any branch, TURNING meanwhile, within its bounds."""
    arm = ARM_OF["kuka_iiwa14_r820"]
    start = streams.posture(arm)
    pose = arm.forward(start)[0]
    tracker = tracker_at(arm, start)
    q, statuses = [tracker.q], []
    for _ in range(3000):
        now = tracker.step(pose, reconfigure=gc if len(q) == 1 else None)
        q.append(now.q)
        statuses.append(now.status)
    check_bounds(arm, np.array(q), np.full(len(q) - 1, DT))
    assert now.gc == gc
    assert now.status == aa.Tracking.FOLLOWING
    turning = np.array(statuses) == aa.Tracking.TURNING
    other = gc != arm.forward(start)[2]
    assert turning.any() == other, "leaving the hand is announced"
    assert (np.diff(np.flatnonzero(turning)) == 1).all()


@pytest.mark.parametrize("name", ["openarm_v10", "jvrc1_right"])
def test_a_branch_that_cannot_hold_the_hand_is_refused(name: str) -> None:
    """`reconfigure` to a branch that cannot hold the hand leaves the tracker on it, with reason LIMITS."""
    arm = aa.Arm.from_catalogue(name)
    start = streams.posture(arm)
    pose, _, own = arm.forward(start)
    impossible = [gc for gc in range(8) if gc != own and arm.feasible(pose, gc).is_empty]
    assert impossible
    for gc in impossible:
        tracker = tracker_at(arm, start, velocity=2.0)
        first = tracker.step(pose, reconfigure=gc)
        assert (first.status, first.why) == (aa.Tracking.FOLLOWING, aa.Status.LIMITS), gc
        for _ in range(250):
            now = tracker.step(pose)
            assert (now.status, now.why, now.gc) == (aa.Tracking.FOLLOWING, aa.Status.OK, own), gc


@pytest.mark.turns(2)
@pytest.mark.parametrize("asked", [True, False], ids=["asked for another branch", "asked for none"])
@pytest.mark.parametrize("seed", range(10))
def test_a_hand_that_leaps_is_met_in_its_own_branch(seed: int, asked: bool) -> None:
    """A tracker meets a hand that jumps to where only the first branch holds it, in a turn to another too."""
    rng = np.random.default_rng(seed)
    arm = aa.Arm.from_catalogue(rng.choice(["openarm_v10", "jvrc1_right"]))
    drawn = rng.uniform(arm.lower, arm.upper, (400, 7))
    poses, _, own = arm.forward(drawn)
    holds = np.array([[not arm.feasible(pose, gc).is_empty for gc in range(8)] for pose in poses])
    at, gc = next((i, g) for i in range(400) for g in range(8) if holds[i, g] and g != own[i])
    then = next(i for i in range(400) if own[i] == own[at] and not holds[i, gc])
    tracker = tracker_at(arm, drawn[at], velocity=2.0)
    q = [tracker.q]
    for k in range(5000):
        now = tracker.step(poses[at if k < 100 else then], reconfigure=gc if asked and k == 0 else None)
        q.append(now.q)
        assert k >= 100 or now.status == (aa.Tracking.TURNING if asked else aa.Tracking.FOLLOWING)
        assert k != 100 or not asked or now.why == aa.Status.LIMITS
    check_bounds(arm.with_(velocity=np.full(7, 2.0)), np.array(q), np.full(len(q) - 1, DT))
    assert np.abs(np.diff(q[-250:], axis=0)).max() < 1e-9
    assert now.distance < 5e-3


@pytest.mark.parametrize("seed", range(4))
def test_a_start_outside_the_limits_is_said_and_led_in_within_the_bounds(arm: aa.Arm, seed: int) -> None:
    """From beyond limits a tracker is RETURNING until all joints are within, within its bounds."""
    rng = np.random.default_rng(seed)
    start = streams.posture(arm)
    beyond = rng.permutation(7)[: rng.integers(1, 4)]
    off = np.where(rng.random(7) < 0.5, arm.lower - rng.uniform(0.01, 1.0, 7), arm.upper + 0.5)
    start[beyond] = off[beyond]
    tracker = tracker_at(arm, start)
    assert np.array_equal(tracker.q, start), "nothing has moved yet"
    home = arm.forward(streams.posture(arm))[0]
    q, statuses = [tracker.q], []
    for _ in range(3000):
        now = tracker.step(home)
        q.append(now.q)
        statuses.append((now.status, now.why))
    positions = np.array(q)
    v = np.diff(positions, axis=0, prepend=positions[:1]) / DT
    assert (np.abs(v) <= arm.velocity * (1 + 1e-9)).all()
    assert (np.abs(np.diff(v, axis=0)) <= HARDEST * DT * (1 + 1e-9)).all()
    outside = ((positions < arm.lower) | (positions > arm.upper)).any(1)
    said = np.array([status == aa.Tracking.RETURNING for status, _ in statuses])
    assert np.array_equal(said, outside[1:])
    assert {why for status, why in statuses if status == aa.Tracking.RETURNING} == {aa.Status.LIMITS}
    way = np.maximum(arm.lower - start, start - arm.upper).max()
    assert said.sum() * DT <= 2 * np.sqrt(way / HARDEST) + way / arm.velocity.min() + 0.1
    assert not outside[-1]


def test_the_values_of_a_tick() -> None:
    """The fields of a tracker's result: velocity, psi, gc, status and reason."""
    arm = ARM_OF["kuka_iiwa14_r820"]
    start = streams.posture(arm)
    tracker, home = tracker_at(arm, start), arm.forward(start)[0]
    now = tracker.step(moved(home, np.array([0.0, 0.3, 0.0])).tolist())
    assert np.array_equal(now.velocity, (now.q - start) / DT) and np.array_equal(now.q, tracker.q)
    assert (now.status, now.why) == (aa.Tracking.LAGGING, aa.Status.ACCELERATION_LIMIT)
    _, psi, gc = arm.forward(now.q)
    assert (now.psi, now.gc) == (pytest.approx(psi), gc)
    now = tracker.step(np.full((4, 4), np.nan))
    assert (now.status, now.why) == (aa.Tracking.HELD, aa.Status.BAD_INPUT)
    assert f"{now.status} {now.status:d} {now.status!s}" == "HELD 3 HELD"
    free = tracker_at(arm, start, velocity=None, acceleration=None)  # without bounds a tick is enough
    assert free.step(moved(home, [0.05, 0.1, -0.05])).status == aa.Tracking.FOLLOWING


def test_bad_input_is_refused() -> None:
    """Tracker, HandFilter, `start`, `step` and `run` refuse bad arguments, and say which."""
    arm = ARM_OF["kuka_iiwa14_r820"]
    for said, options in (
        ("dt is 0", {"dt": 0.0}), ("filter is 3", {"filter": 3}),
        ("acceleration holds -1", {"acceleration": -1.0}),
        ("soft_clearance is -1", {"soft_clearance": -1.0}),
        *((f"Tracker takes no {word}=: ", {word: 0.1})
          for word in ("policy", "psi", "start", "seed", "q0", "rate", "max_joint_step")),
    ):  # fmt: skip
        refused(aa.InputError, said, aa.Tracker, arm, **options)  # type: ignore[arg-type]  # wrong on purpose
    refused(aa.InputError, "omega is 0", aa.HandFilter, omega=0.0)
    tracker, eye = aa.Tracker(arm), np.eye(4)
    for early in (lambda: tracker.step(eye), lambda: tracker.run(eye[None]), lambda: tracker.q):
        refused(aa.InputError, r"has not begun: call start\(q\) first", early)
    tracker.start(np.zeros(7))
    step = tracker.step
    refused(aa.InputError, r"pose has shape \(2, 4, 4\), wanted \(4, 4\)", step, np.tile(eye, (2, 1, 1)))
    refused(aa.InputError, r"elbow has shape \(2, 3\), wanted \(3,\)", step, eye, np.zeros((2, 3)))
    refused(aa.InputError, "elbow and elbow_direction", step, eye, np.zeros(3), elbow_direction="up")
    refused(aa.InputError, "elbow_direction is 'sideways'", step, eye, elbow_direction="sideways")
    refused(aa.InputError, "reconfigure is 8, wanted an integer from 0 to 7", step, eye, reconfigure=8)
    refused(aa.InputError, r"poses has shape \(4, 4\), wanted \(n, 4, 4\)", tracker.run, eye)
    degrees = [0.0, 1.0, 0.0, -80.0, 0.0, 10.0, 0.0]
    refused(aa.InputError, "q holds -80, .*were these degrees", tracker.start, degrees)
    refused(aa.InputError, "q", tracker.start, np.full(7, np.nan))


@pytest.mark.parametrize("dt", [0.001, 0.004, 0.011])
@pytest.mark.parametrize("speed", [0.005, 0.02, 0.05])
def test_a_hand_that_moves_evenly_is_followed_smoothly(dt: float, speed: float) -> None:
    """Behind an even hand joints accelerate by less than 0.1 rad/s² RMS after 1.5 s."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.array([0.1, 0.6, 0.2, -1.2, 0.3, 0.8, 0.5])
    time = np.arange(0, 3.5, dt)
    poses = np.repeat(arm.forward(q)[0][None], len(time), 0)
    poses[:, 1, 3] += speed * time
    tracker = begun(q, arm, dt=dt, acceleration=10.0)
    velocity = np.array([tracker.step(pose).velocity for pose in poses])
    acceleration = np.diff(velocity, axis=0)[int(1.5 / dt) :] / dt
    assert np.sqrt((acceleration**2).mean(axis=0)).max() < 0.1


@pytest.mark.turns(2)
@pytest.mark.parametrize(
    ("rate", "noise", "moved"), [(500, 2e-3, 0.0), (1000, 2e-3, 0.0), (500, 2e-3, 0.1), (90, 2e-3, 0.1)]
)
def test_noise_without_a_filter_costs_no_more_than_steps_by_hand(
    rate: int, noise: float, moved: float
) -> None:
    """Without a filter a tracker is off a noisy hand by at most 1.1 times what `step` is."""
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    start = np.radians([10, 30, 0, -80, 0, 60, 0.0])
    home, dt = arm.forward(start)[0], 1 / rate
    t = np.arange(1, 5 * rate + 1) * dt
    true = np.tile(home, (len(t), 1, 1))
    true[:, 1, 3] += moved * np.sin(0.9 * t)
    seen = true.copy()
    seen[:, :3, 3] += np.random.default_rng(0).normal(0, noise, (len(t), 3))
    tracker = begun(start, arm, dt=dt, acceleration=10.0)
    q, v, off = start, np.zeros(7), np.empty((2, len(t)))
    for k, pose in enumerate(seen):
        now = aa.step(arm, q, pose, dt=dt, velocity=True, acceleration=10.0, velocity_now=v)
        q, v = now.q, now.velocity
        for row, joints in enumerate((tracker.step(pose).q, q)):
            off[row, k] = np.linalg.norm((arm.forward(joints)[0] - true[k])[:3, 3])
    ours, by_hand = np.sqrt((off**2).mean(axis=1))
    assert ours <= 1.1 * by_hand and off[0].max() < 4 * noise
