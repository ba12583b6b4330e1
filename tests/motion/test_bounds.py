"""Laws of `step` and `follow` under bounds: what is OK keeps them, and what can keep them is found."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from support import draw
from support.calibrated import ARMS as CALIBRATED
from support.calibrated import calibrated
from support.moves import along, begun, in_a_loop, moved, refused
from support.strategies import REGIMES, Array, arms, postures

import armangle as aa
from armangle.models.catalogue import srs_catalogue

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
HOME = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
SPEED = np.full(7, 1.5)
AT = np.radians([10, 40, 0, -80, 0, 60, 0])
ROUNDING = 1e-12

OFFSET = tuple(map(aa.Arm.from_catalogue, ("franka_fr3", "willow_garage_pr2_right", "fetch")))
STREAMED = (
    *map(aa.Arm.from_catalogue, ("kuka_iiwa7_r800", "openarm_v10", "rokae_xmate_er7_pro")), *OFFSET,
    calibrated("kuka_iiwa7_r800", 1.0, 1.0),
)  # fmt: skip

each_arm = pytest.mark.parametrize("arm", arms(), ids=lambda arm: arm.name)
each_regime = pytest.mark.parametrize("regime", REGIMES)


def posed(arm: aa.Arm, q: Array, move: Array) -> Array:
    """The pose at joints q + move."""
    return np.asarray(arm.forward(q + move, on_error="nan")[0])


def line(q: Array, shift: tuple[float, float, float], n: int) -> Array:
    """n poses with fixed orientation on the line from q's own pose by `shift` (m).

    The first is half a step from it, the last at its end.
    """
    return along(moved(IIWA.forward(q)[0], 0.5 / n * np.array(shift)), (1 - 0.5 / n) * np.array(shift), n)


def brakes(arm: aa.Arm, q: Array, velocity: Array, acceleration: Array, dt: float) -> bool:
    """Whether every joint can come to rest within its limits, step by step."""
    q, velocity = q.copy(), velocity.copy()
    while np.any(velocity != 0):
        velocity = np.sign(velocity) * np.maximum(np.abs(velocity) - acceleration * dt, 0)
        q += velocity * dt
    return bool(np.all((q >= arm.lower - 1e-8) & (q <= arm.upper + 1e-8)))


# -- the guarantee -----------------------------------------------------------------------------------


@pytest.mark.turns(8)
@pytest.mark.slow
@each_arm
@each_regime
def test_what_is_ok_keeps_the_bounds(arm: aa.Arm, regime: str) -> None:
    """A step that is OK reaches the pose, keeps limits and bounds and can still brake; any other step
    brakes.
    """
    rng = np.random.default_rng(REGIMES.index(regime))
    done = 0
    for q in postures(arm, regime, 12):
        dt = 10 ** rng.uniform(-3, -1)
        fastest, hardest = rng.uniform(0.5, 3, 7), rng.uniform(1, 20, 7)
        now = rng.uniform(-0.4, 0.4, 7)
        pose = posed(arm, q, (now + rng.uniform(-0.9, 0.9, 7) * hardest * dt) * dt)
        for policy in (aa.Repulsion(K=0.7), aa.Hold(), aa.Centre(K=0.5)):
            found = aa.step(
                arm, q, pose, policy=policy, dt=dt, velocity=fastest, acceleration=hardest, velocity_now=now
            )
            if found.status == aa.Status.OK:
                done += 1
                velocity = (found.q - q) / dt
                assert np.all(np.abs(velocity) <= fastest)
                assert np.all(np.abs(velocity - now) <= hardest * dt)
                assert np.all(arm.within_limits(found.q, tol=1e-9))
                assert brakes(arm, found.q, velocity, hardest, dt)
                assert np.abs(arm.forward(found.q)[0] - pose).max() < 1e-11
            else:  # a joint that can brake no more before its limit is stopped by it
                stopped = (found.q <= arm.lower) | (found.q >= arm.upper)
                assert np.all((np.abs(found.velocity - now) <= hardest * dt * (1 + 1e-9)) | stopped)
                assert np.all(np.abs(found.velocity) <= np.maximum(fastest, np.abs(now)))
                assert arm.limit_margin(found.q) >= min(arm.limit_margin(q), 0) - ROUNDING
    assert done or regime in ("on_limit", "folded", "singular", "near_singular", "at_reach")


def test_the_nearest_arm_angle_to_the_wish_is_taken() -> None:
    """Of the arm angles within the velocity bounds `step` takes the one nearest to the policy's."""
    rng = np.random.default_rng(7)
    circle = np.linspace(-np.pi, np.pi, 4000, endpoint=False)
    binding = 0
    for q in postures(IIWA, "uniform", 30):
        dt = 0.01
        pose = posed(IIWA, q, rng.uniform(-0.3, 0.3, 7) * dt)
        policy = aa.Centre(K=1.0)
        _, psi, gc = IIWA.forward(q)
        found = aa.step(IIWA, q, pose, policy=policy, dt=dt, velocity=SPEED)
        wish = aa.resolve(IIWA, pose, psi, gc, policy=policy).psi
        if found.status != aa.Status.OK or found.gc != gc:
            continue
        near = circle * 0.05 + found.psi
        all_q = IIWA.inverse(np.broadcast_to(pose, (len(near), 4, 4)), near, gc, limits=False)
        turned = (all_q - q + np.pi) % (2 * np.pi) - np.pi
        kept = near[np.all(np.abs(turned) <= SPEED * dt, axis=1) & IIWA.within_limits(all_q)]
        away = np.abs((kept - wish + np.pi) % (2 * np.pi) - np.pi)
        mine = abs((found.psi - wish + np.pi) % (2 * np.pi) - np.pi)
        assert mine <= away.min() + 1e-9
        binding += mine > 1e-6
    assert binding > 10


@pytest.mark.turns(4)
@pytest.mark.slow
@each_arm
@each_regime
def test_bounds_that_do_not_bind_change_nothing(arm: aa.Arm, regime: str) -> None:
    """`step` with infinite velocity bounds gives the same joints and psi as without bounds."""
    free = np.full(7, np.inf)
    for q in postures(arm, regime, 6):
        pose = posed(arm, q, np.full(7, 1e-3))
        plain = aa.step(arm, q, pose, max_joint_step=1.0)
        bound = aa.step(arm, q, pose, max_joint_step=1.0, dt=1.0, velocity=free)
        if plain.status == aa.Status.OK:
            assert bound.status == aa.Status.OK
            assert np.array_equal(bound.q, plain.q)
            assert bound.psi == plain.psi


# -- a loop of steps is follow -----------------------------------------------------------------------


@pytest.mark.parametrize("on_fail", ["stop", "hold", "skip"])
@pytest.mark.parametrize("hardest", [None, 4.0, 40.0])
def test_follow_is_step_in_a_loop_bit_for_bit(on_fail: Any, hardest: float | None) -> None:
    """`follow` has the joints, gc, margins and statuses of `step` in a loop, also where it fails."""
    poses, dt = line(HOME, (0.1, -0.2, 0.15), 80), 0.02
    poses[30] = poses[29]
    poses[40, :3, 3] += 0.05
    options: dict[str, Any] = {"dt": dt, "velocity": SPEED, "policy": aa.Repulsion(K=0.3, alpha=3.0)}
    if hardest is not None:
        options["acceleration"] = np.full(7, hardest)
    start = (IIWA.inverse(poses[1], *IIWA.forward(HOME)[1:], seed=HOME, limits=False) - HOME) / dt
    assert not in_a_loop(IIWA, poses, HOME, on_fail, velocity_now=start, **options).ok


def test_follow_starts_at_rest_and_carries_the_velocity() -> None:
    """`follow` keeps acceleration bounds from rest on, where it would exceed them without."""
    t = np.linspace(0, 1, 200)
    ramp = t**3 * (10 - 15 * t + 6 * t * t)
    poses = np.repeat(IIWA.forward(HOME)[0][None], 200, axis=0)
    poses[:, :3, 3] += ramp[:, None] * np.array([0.05, -0.1, 0.08])
    dt, hardest = 0.01, np.full(7, 4.0)
    rule = aa.Repulsion(K=1.0, alpha=4.0)
    path = aa.follow(IIWA, poses, start=HOME, dt=dt, velocity=SPEED, acceleration=hardest, policy=rule)
    assert path.ok
    velocity = np.diff(np.vstack([HOME, path.q]), axis=0) / dt
    assert np.all(np.abs(velocity) <= SPEED)
    change = np.diff(np.vstack([np.zeros(7), velocity]), axis=0) / dt
    assert np.all(np.abs(change) <= hardest * (1 + ROUNDING))
    free = aa.follow(IIWA, poses, start=HOME, policy=rule)
    assert np.abs(np.diff(np.diff(free.q, axis=0), axis=0)).max() / dt**2 > 4.0


def test_bounds_are_the_arms_own_or_a_number_for_every_joint() -> None:
    """Bounds given as True are the arm's, as a number for all joints."""
    pose = posed(IIWA, HOME, np.full(7, 0.01))
    still: dict[str, Any] = {"dt": 0.01, "velocity_now": np.zeros(7)}
    arm = IIWA.with_(velocity=2.0, acceleration=5)
    assert arm.velocity.tolist() == [2.0] * 7 and arm.acceleration.tolist() == [5.0] * 7
    for one, other in (
        ({"velocity": True}, {"velocity": IIWA.velocity}),
        ({"velocity": 2.0, "acceleration": 9}, {"velocity": [2.0] * 7, "acceleration": [9.0] * 7}),
    ):
        a, b = (aa.step(IIWA, HOME, pose, **given, **still) for given in (one, other))
        assert a.status == b.status and np.array_equal(a.q, b.q)
    hard = aa.step(arm, HOME, pose, acceleration=True, **still)
    assert (hard.status, hard.why) == (aa.Status.PARTIAL, aa.Status.ACCELERATION_LIMIT)
    rows = [aa.follow(IIWA, pose[None], start=HOME, dt=0.01, velocity=v).q for v in (2.0, np.full(7, 2.0))]
    assert np.array_equal(*rows)
    for bad in (0.0, -1.0, np.nan):
        refused(aa.ArmangleError, "velocity", IIWA.with_, velocity=bad)
    one_fast = aa.step(IIWA, AT, moved(IIWA.forward(AT)[0], [0.1, -0.2, 0.1]), dt=0.01, velocity=True)
    assert one_fast.status is aa.Status.PARTIAL
    assert np.abs(one_fast.velocity / IIWA.velocity).max() == pytest.approx(1.0, abs=1e-9)


# -- reasons -----------------------------------------------------------------------------------------


def test_each_bound_has_its_status() -> None:
    """`step` states in `why` which bound shortened it."""
    bent = HOME + 0.05 * np.eye(7)[3]
    pose = IIWA.forward(bent)[0]
    still: dict[str, Any] = {"dt": 0.01, "velocity_now": np.zeros(7)}
    assert aa.step(IIWA, HOME, pose, velocity=np.full(7, 4.0), dt=0.01).why == aa.Status.VELOCITY_LIMIT
    assert aa.step(IIWA, HOME, pose, velocity=np.full(7, 6.0), dt=0.01).status == aa.Status.OK
    hard = aa.step(IIWA, HOME, pose, acceleration=np.full(7, 400.0), **still)
    assert (hard.status, hard.why) == (aa.Status.PARTIAL, aa.Status.ACCELERATION_LIMIT)
    assert aa.step(IIWA, HOME, pose, acceleration=np.full(7, 600.0), **still).status == aa.Status.OK
    leap = aa.step(IIWA, HOME, pose, velocity=np.full(7, 6.0), dt=0.01, max_joint_step=0.04)
    assert (leap.status, leap.why) == (aa.Status.PARTIAL, aa.Status.JOINT_JUMP)
    assert 0.04 - 1e-9 <= np.abs(leap.q - HOME).max() <= 0.04
    leap = aa.step(IIWA, HOME, pose, dt=0.01, max_joint_step=0.04)
    assert (leap.status, leap.why) == (aa.Status.JOINT_JUMP, aa.Status.JOINT_JUMP)
    assert np.array_equal(leap.q, HOME)
    assert np.array_equal(leap.velocity, np.zeros(7))


def test_a_joint_too_fast_to_brake_before_its_limit_brakes() -> None:
    """`step` brakes fully if the acceleration is too small for the limit ahead."""
    near = HOME.copy()
    near[3] = IIWA.lower[3] + 0.02
    now = np.array([0, 0, 0, -0.5, 0, 0, 0])
    pose = posed(IIWA, near, 0.01 * now)
    slow: dict[str, Any] = {"dt": 0.01, "velocity_now": now}
    braked = aa.step(IIWA, near, pose, acceleration=np.full(7, 3.0), **slow)
    assert (braked.status, braked.why) == (aa.Status.PARTIAL, aa.Status.ACCELERATION_LIMIT)
    assert abs(braked.velocity[3] - (-0.5 + 3.0 * 0.01)) <= 1e-9
    assert aa.step(IIWA, near, pose, acceleration=np.full(7, 30.0), **slow).status == aa.Status.OK


# -- as far as it can --------------------------------------------------------------------------------


def run(pose: Array, q: Array, dt: float, ticks: int, **options: Any) -> tuple[list[aa.types.Step], Array]:
    """`ticks` steps at the arm's velocities towards one pose, and the largest acceleration, rad/s²."""
    steps, velocity, hardest = [], np.zeros(7), 0.0
    for _ in range(ticks):
        more = {"velocity_now": velocity} if "acceleration" in options else {}
        now = aa.step(IIWA, q, pose, dt=dt, velocity=True, **options, **more)
        assert np.array_equal(now.velocity, (now.q - q) / dt)
        hardest = max(hardest, np.abs(now.velocity - velocity).max() / dt)
        q, velocity = now.q, now.velocity
        steps.append(now)
    return steps, np.array(hardest)


def off(now: aa.types.Step, pose: Array) -> float:
    """The largest difference of an entry between the pose of a step's joints and a pose."""
    return float(np.abs(IIWA.forward(now.q)[0] - pose).max())


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("policy", [aa.Repulsion(), aa.Hold(), aa.Centre(rate=5.0)], ids=repr)
@pytest.mark.parametrize("dt", [1e-3, 4e-3, 0.01, 0.05])
@pytest.mark.parametrize("shift", [[0, 0.005, 0], [0.1, -0.2, 0.1], [1e-5, 0, 0]], ids=str)
def test_a_target_aside_is_come_to_and_rested_on(policy: aa.Repulsion, dt: float, shift: list[float]) -> None:
    """Bounded steps reach a displaced pose, PARTIAL until then, and stay on it."""
    q, pose = AT, moved(IIWA.forward(AT)[0], shift)
    ticks = int(1.2 / dt)
    steps, _ = run(pose, q, dt, ticks, policy=policy)
    assert steps[-1].status is aa.Status.OK and off(steps[-1], pose) < 1e-12
    steps, hardest = run(pose, q, dt, ticks, policy=policy, acceleration=10.0)
    assert hardest <= 10.0 * (1 + 1e-9)
    at = [now.status for now in steps].index(aa.Status.OK)
    resting = max(4, int(0.1 / dt))
    assert all(now.status is aa.Status.OK for now in steps[at + resting :])  # no chatter
    assert off(steps[-1], pose) < 1e-12
    for now in steps[:at]:
        assert now.status is aa.Status.PARTIAL
        assert now.why in (aa.Status.ACCELERATION_LIMIT, aa.Status.VELOCITY_LIMIT, aa.Status.JOINT_JUMP)


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("fallback", [None, "nearest_pose"])
@pytest.mark.parametrize("acceleration", [None, 10.0])
@pytest.mark.parametrize("arm", STREAMED, ids=lambda arm: f"{arm.name} {arm.kind}")
def test_a_hostile_stream_breaks_no_bound(arm: aa.Arm, acceleration: float | None, fallback: Any) -> None:
    """`step` toward jumping poses keeps velocity, acceleration and limits."""
    rng = np.random.default_rng(3)
    dt, fastest = 0.004, np.where(np.isfinite(arm.velocity), arm.velocity, 2.0)
    low, high = np.maximum(arm.lower, -6), np.minimum(arm.upper, 6)
    q, velocity = rng.uniform(low, high), np.zeros(7)
    seen = set()
    for tick in range(draw.count(1500)):
        if tick % 40 == 0:
            pose = arm.forward(rng.uniform(low, high))[0].copy()
            pose[:3, 3] += rng.choice([0.0, 0.02, 1.0]) * rng.normal(size=3)
        bounds = {} if acceleration is None else {"acceleration": acceleration, "velocity_now": velocity}
        now = aa.step(arm, q, pose, dt=dt, velocity=fastest, fallback=fallback, **bounds)
        assert np.all(np.abs(now.velocity) <= fastest)
        if acceleration is not None:
            assert np.abs(now.velocity - velocity).max() <= acceleration * dt * (1 + 1e-9)
        assert arm.limit_margin(now.q) >= -ROUNDING
        if now.status is aa.Status.OK:
            assert np.abs(arm.forward(now.q)[0] - pose).max() < 1e-9
        elif now.status is not aa.Status.PARTIAL and acceleration is None:
            assert np.array_equal(now.q, q)
        q, velocity = now.q, now.velocity
        seen.add(now.status)
    assert aa.Status.PARTIAL in seen
    assert fallback is None or seen <= {aa.Status.OK, aa.Status.PARTIAL}


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3])
def test_noise_does_not_lock_a_bounded_loop(noise: float) -> None:
    """Steps of bounded velocity and acceleration from joints with `noise` (rad), in cycles of uneven length,
    end at the pose within 1e-9 m and 5 times the noise.
    """
    rng = np.random.default_rng(8)
    for _ in range(draw.count(4)):
        q = rng.uniform(0.6 * IIWA.lower, 0.6 * IIWA.upper)
        q[[1, 3, 5]] = 0.6, -1.2, 0.8
        poses = line(q, tuple(rng.uniform(-0.1, 0.1, 3)), 250)
        velocity = np.zeros(7)
        for pose in [*poses, *[poses[-1]] * 100]:
            dt = 0.01 * rng.uniform(0.5, 1.5)
            now = aa.step(
                IIWA, q + rng.normal(0, 1, 7) * noise, pose, dt=dt, velocity=True, acceleration=15.0,
                velocity_now=velocity,
            )  # fmt: skip
            q, velocity = now.q, now.velocity
        assert np.linalg.norm(IIWA.forward(q)[0][:3, 3] - pose[:3, 3]) <= 1e-9 + 5 * noise


def test_out_of_reach_it_brakes_or_goes_to_the_nearest_pose() -> None:
    """A bounded step to a pose out of reach brakes, or with "nearest_pose" rests at the stretched arm."""
    q = np.radians([10, 40, 0, -80, 0, 60, 0])
    pose = IIWA.forward(q)[0].copy()
    shoulder = np.array([0, 0, IIWA.geometry.d_bs])
    along = pose[:3, 3] - IIWA.geometry.d_wf * pose[:3, 2] - shoulder
    pose[:3, 3] += 2.0 * along / np.linalg.norm(along)
    moving = np.array([0.3, -0.2, 0, 0, 0, 0.1, 0])
    now = aa.step(IIWA, q, pose, dt=0.01, acceleration=10.0, velocity_now=moving)
    assert (now.status, now.why) == (aa.Status.UNREACHABLE, aa.Status.UNREACHABLE)
    assert np.abs(now.velocity - np.array([0.2, -0.1, 0, 0, 0, 0, 0])).max() <= 1e-12
    assert now.gc == IIWA.forward(now.q)[2] and abs(now.psi - IIWA.forward(now.q)[1]) <= 1e-12
    steps, _ = run(pose, q, 0.01, 400, acceleration=10.0, fallback="nearest_pose", policy=aa.Hold())
    assert {(now.status, now.why) for now in steps} == {(aa.Status.PARTIAL, aa.Status.UNREACHABLE)}
    last = IIWA.forward(steps[-1].q)[0]
    gap = np.linalg.norm(along) + 2.0 - IIWA.geometry.d_se - IIWA.geometry.d_ew
    assert np.linalg.norm(last[:3, 3] - pose[:3, 3]) == pytest.approx(gap, abs=1e-9)
    assert np.abs(last[:3, :3] - pose[:3, :3]).max() <= 1e-9
    assert np.abs(steps[-1].velocity).max() == 0.0


@pytest.mark.parametrize(
    ("name", "seed"),
    [("galaxea_r1_pro_left", 107), ("kinova_movo", 116), ("openloong_left", 124),
     ("pollen_reachy2_left", 126), ("yaskawa_sia5d", 143), ("barrett_wam7", 339)],
)  # fmt: skip
def test_with_the_elbow_carried_it_comes_to_rest_on_the_pose(name: str, seed: int) -> None:
    """Bounded steps with carry="elbow" reach the pose and stay on it, near theta_2 = 0 too."""
    arm, rng = aa.Arm.from_catalogue(name), np.random.default_rng(seed)
    low, high = np.clip(arm.lower, -3, 3), np.clip(arm.upper, -3, 3)
    q = low + (high - low) * rng.uniform(0.05, 0.95, 7)
    pose, velocity, statuses = (
        arm.forward(low + (high - low) * rng.uniform(0.05, 0.95, 7))[0],
        np.zeros(7),
        [],
    )
    bounds: dict[str, Any] = {"dt": 0.01, "velocity": 1.5, "acceleration": 10.0, "carry": "elbow"}
    for _ in range(900):
        now = aa.step(arm, q, pose, velocity_now=velocity, **bounds)
        q, velocity = now.q, now.velocity
        statuses.append(now.status)
    assert set(statuses[-300:]) == {aa.Status.OK}


@pytest.mark.parametrize("acceleration", [None, 10.0])
def test_a_branch_that_is_asked_is_kept_on_the_way_to_the_nearest_pose(acceleration: float | None) -> None:
    """Steps towards a pose out of reach keep the signs of shoulder and wrist of a given `gc`; of an arm with
    an offset while they are UNREACHABLE.
    """
    short = 0
    for seed, arm in enumerate([*map(aa.Arm.from_catalogue, srs_catalogue()), *OFFSET]):
        rng = np.random.default_rng(seed)
        low, high = np.clip(arm.lower, -3, 3), np.clip(arm.upper, -3, 3)
        q, target = low + (high - low) * rng.uniform(0.05, 0.95, (2, 7))
        pose, gc, velocity = arm.forward(target)[0], int(arm.forward(q)[2]), np.zeros(7)
        pose[:3, 3] *= 1.3
        for _ in range(500):
            bounds = {} if acceleration is None else {"acceleration": acceleration, "velocity_now": velocity}
            now = aa.step(arm, q, pose, gc=gc, fallback="nearest_pose", dt=0.02, velocity=1.5, **bounds)
            velocity, went, q = now.velocity, np.abs(now.q - q).max(), now.q
            # a straight joint motion to a solution passes joint 5 of an arm with an offset through its fold
            if arm.kind == "srs" or now.why is aa.Status.UNREACHABLE:
                assert (int(arm.forward(q)[2]) ^ gc) & 5 == 0, arm.name
            if now.status == aa.Status.OK or went < 1e-10:
                break
        short += now.status == aa.Status.PARTIAL
    assert short > 20, short


@pytest.mark.parametrize("bounds", [{}, {"velocity": 2.0, "dt": 0.01}], ids=["free", "bounded"])
def test_on_its_way_to_the_nearest_pose_it_keeps_the_singularity_margin(bounds: dict[str, Any]) -> None:
    """Steps with fallback="nearest_pose" keep limits and the margin of shoulder, elbow and wrist."""
    rng = np.random.default_rng(17)
    margin = 0.2
    arm = IIWA.with_(singularity_margin=margin)
    beyond = 0
    for _ in range(40):
        q = rng.uniform(IIWA.lower, IIWA.upper)
        if np.abs(np.sin(q[[1, 3, 5]])).min() < np.sin(margin) + 1e-3:
            continue
        pose = IIWA.forward(rng.uniform(IIWA.lower, IIWA.upper))[0].copy()
        pose[:3, 3] *= 1.5
        for _ in range(60):
            now = aa.step(arm, q, pose, policy=aa.Hold(), fallback="nearest_pose", **bounds)
            beyond += now.status is aa.Status.PARTIAL
            assert np.abs(np.sin(now.q[[1, 3, 5]])).min() >= np.sin(margin) - 1e-12
            assert IIWA.within_limits(now.q)
            q = now.q
    assert beyond > 500


@pytest.mark.parametrize("arm", STREAMED, ids=lambda arm: f"{arm.name} {arm.kind}")
def test_beyond_its_limits_it_comes_as_near_as_small_moves_lead(arm: aa.Arm) -> None:
    """Steps with fallback="nearest_pose" to a tool rolled too far rest where no small move comes nearer."""
    q = np.radians([10, 40, 0, -80, 0, 60, 170])
    rolled = arm.forward(q)[0] @ aa.pose([0, 0, 0], rpy=[0, 0, np.radians(100)])
    tight = arm.with_(lower=q - 0.2, upper=q + np.array([0.2] * 6 + [0.05]))
    why = aa.Status.UNREACHABLE if arm.kind == "offset_shoulder" else aa.Status.LIMITS
    assert aa.step(tight, q, rolled).status is why
    now = aa.step(tight, q, rolled, fallback="nearest_pose")
    assert (now.status, now.why) == (aa.Status.PARTIAL, why)
    for _ in range(20):
        now = aa.step(tight, now.q, rolled, fallback="nearest_pose")
    again = aa.step(tight, now.q, rolled, fallback="nearest_pose")
    assert np.abs(again.q - now.q).max() <= 1e-9  # at rest there

    def distance(joints: Array) -> float:
        """The distance (m) of joints' pose from the target, with 0.2 m for 1 rad."""
        here = arm.forward(joints)[0]
        turn = np.arccos(np.clip((np.trace(here[:3, :3].T @ rolled[:3, :3]) - 1) / 2, -1, 1))
        return float(np.hypot(np.linalg.norm(here[:3, 3] - rolled[:3, 3]), 0.2 * turn))

    rng = np.random.default_rng(9)
    for move in rng.normal(0, 1e-3, (200, 7)):
        assert distance(np.clip(now.q + move, tight.lower, tight.upper)) >= distance(now.q) - 1e-9
    assert distance(now.q) < distance(q)


def test_without_bounds_or_dt_the_largest_step_follows_dt() -> None:
    """Without bounds the largest joint step grows with dt, unless `max_joint_step` is given."""
    q = np.radians([10, 40, 0, -80, 0, 60, 0])
    pose = posed(IIWA, q, np.array([0.05, 0, 0, 0, 0, 0, 0]))
    assert aa.step(IIWA, q, pose, policy=aa.Hold()).status is aa.Status.OK
    assert np.isnan(aa.step(IIWA, q, pose, policy=aa.Hold()).velocity).all()
    slow = aa.step(IIWA, q, pose, policy=aa.Hold(), dt=0.01)
    assert slow.status is aa.Status.OK
    assert slow.velocity[0] == pytest.approx(5.0, abs=1e-9)
    assert aa.step(IIWA, q, pose, policy=aa.Hold(), dt=1e-3).status is aa.Status.JOINT_JUMP
    assert aa.step(IIWA, q, pose, policy=aa.Hold(), dt=1e-3, max_joint_step=0.2).status is aa.Status.OK
    assert aa.follow(IIWA, pose[None], start=q, policy=aa.Hold(), dt=1e-3).status[0] == aa.Status.JOINT_JUMP


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"dt": 0.0}, "dt is 0"),
        ({"dt": -1.0}, "dt is -1"),
        ({"fallback": "near"}, "fallback is 'near', wanted"),
        ({"velocity": SPEED}, "need dt"),
        ({"velocity": SPEED, "dt": 0.0}, "dt is 0"),
        ({"velocity": SPEED[:3], "dt": 1.0}, r"velocity has shape \(3,\), wanted \(7,\), or a number"),
        ({"velocity": np.ones((2, 7)), "dt": 1.0}, r"velocity has shape \(2, 7\)"),
        ({"velocity": -SPEED, "dt": 1.0}, "velocity holds -1.5"),
        ({"velocity": SPEED * np.nan, "dt": 1.0}, "velocity holds nan"),
        ({"velocity": "fast", "dt": 1.0}, "velocity is not an array"),
        ({"acceleration": True, "dt": 1.0}, "acceleration is the arm's own"),
        ({"acceleration": SPEED, "dt": 1.0}, "needs velocity_now"),
        ({"acceleration": SPEED, "dt": 1.0, "velocity_now": [1, 2]}, r"velocity_now has shape \(2,\)"),
        ({"velocity": SPEED, "dt": 1.0, "velocity_now": np.ones((2, 7))}, r"velocity_now has shape \(2, 7\)"),
        ({"velocity": SPEED, "dt": 1.0, "velocity_now": np.full(7, np.inf)}, "velocity_now is not finite"),
    ],
)
def test_bad_bounds_are_refused(options: dict[str, Any], said: str) -> None:
    """`step` refuses these options with this message."""
    refused(aa.InputError, said, aa.step, IIWA, HOME, IIWA.forward(HOME)[0], **options)


def test_numbers_that_look_like_another_unit_are_warned_of() -> None:
    """Velocities in degrees and dt in ms warn at the caller's line; plausible numbers do not."""
    pose = posed(IIWA, HOME, np.full(7, 0.01))
    path = aa.plan(IIWA, aa.Line(IIWA.forward(HOME)[0], pose), start=HOME)
    degrees, ms = r"holds \d+, wanted rad/s²?: were these degrees\?", r"dt is 4 s, long .*: was it in ms, or"
    tracker = begun(HOME, IIWA)
    for text, call in (
        (ms, lambda: aa.Tracker(IIWA, 4)),
        (ms, lambda: tracker.step(pose, dt=4)),
        (ms, lambda: aa.HandFilter().smooth(pose[None], 4)),
        (ms, lambda: aa.step(IIWA, HOME, pose, dt=4, velocity=True)),
        (ms, lambda: aa.follow(IIWA, pose[None], start=HOME, dt=4, velocity=2.0)),
        (degrees, lambda: aa.Tracker(IIWA, velocity=98)),
        (degrees, lambda: aa.Tracker(IIWA, velocity=[98, 98, np.inf, 1, 1, 1, 1])),
        (degrees, lambda: aa.Tracker(IIWA, acceleration=np.full(7, 570.0))),
        (degrees, lambda: aa.step(IIWA, HOME, pose, dt=0.01, velocity=98)),
        (degrees, lambda: aa.follow(IIWA, pose[None], start=HOME, dt=0.01, velocity=98)),
        (degrees, lambda: aa.retime(path, velocity=98, acceleration=5.0)),
    ):
        with pytest.warns(UserWarning, match=text) as caught:
            call()
        assert [one.filename for one in caught] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        aa.Tracker(IIWA, 1.0, velocity=np.inf, acceleration=100.0)
        aa.step(IIWA, HOME, pose, dt=0.5, velocity=31.0)  # rainbow_rby1 states 30


def test_a_hand_that_comes_back_elsewhere_is_gone_to_at_once() -> None:
    """`follow` is within 20 mm of poses that left the reach at most 60 rows after they return."""
    arm, q = aa.Arm.from_catalogue("kuka_iiwa14_r820"), np.radians([0, 0, 0, -90, 0, 90, 0])
    t = np.arange(400) * 0.02
    poses = np.tile(arm.forward(q)[0], (len(t), 1, 1))
    ways = [0.1 * np.cos(t) - 0.1, 0.3 * np.sin(t) * np.minimum(1, t), -0.1 * (1 - np.cos(0.7 * t))]
    poses[:, :3, 3] += np.stack(ways, axis=1)
    gap = [k for k, pose in enumerate(poses) if not arm.solve(pose, seed=q).ok]
    path = aa.follow(arm, poses, start=q, on_fail="hold", dt=0.02, velocity=True, acceleration=10.0)
    off = np.linalg.norm((arm.forward(path.q, on_error="nan")[0] - poses)[:, :3, 3], axis=1)
    assert len(gap) > 50 and off.max() < 0.45
    assert off[: gap[0]].max() < 0.02 and off[gap[-1] + 60 :].max() < 0.02


BOUNDED: dict[str, Any] = {"dt": 0.01, "velocity": 2.0}
ARRIVES: list[tuple[str, str, str, int, dict[str, Any]]] = [
    # from gaps: to the end of the gap that is nearer at each step the joints would go to and fro for ever
    ("yaskawa_sia5d", "-2.535587 -.431757 -1.782182 .169791 .570634 .298964 -.598611",
     "2.75829 -.818553 -2.308927 -.016988 -.372781 1.239337 -.179991", 150, BOUNDED | {"policy": aa.Hold()}),
    ("galaxea_r1_pro_left", "-.711101 1.710206 -.424072 -1.478929 -.144542 -.555011 -.467643",
     "1.307385 2.781344 .59447 -1.370385 -1.668692 -.546827 -.515575", 150, BOUNDED | {"policy": aa.Hold()}),
    ("rokae_ar5_right", "-2.680583 -.234334 -2.006781 1.211703 -3.082574 -.07512 -.239533",
     "-2.6935 -.873008 3.000849 2.380173 -.536123 -.670077 -.53773", 150, BOUNDED),
    ("human_arm_right", "2.27826 1.741155 1.146825 .421146 .084321 .067127 .277928",
     "-2.996258 3.065236 2.017538 .894948 2.547834 -.436351 .289985", 150, BOUNDED | {"policy": aa.Hold()}),
    # farther than `max_joint_step`, a calibrated arm too
    *(("kuka_iiwa7_r800 1.0 mm", ".1 .4 .2 -1.2 .3 .8 .5", way, 100, {"dt": 0.01, "velocity": 1.0})
      for way in ("0 .1 0", ".08 0 -.06", "-.05 -.1 .05")),
    # joints 1 and 3 share one turn where θ2 is 0, and the one that stands at its limit cannot
    ("openarm_v10", "-1.2918998039496403 .05 -1.0431160571417677 1.0899526204505743 -.8312266510922368 "
     "-.6084025341896545 -.6997627598601996",
     ".5981416563084545 .5736987397419346 -.55955010053354 -.1565611024339508 .8012348880951171 "
     "-.4418683284769322 .4034538813646579 -.038737997837950774 -.01578648433895854 -.6896536350281333 "
     "-.7239672994028791 .19629073868897265", 300,
     {"dt": 0.1, "velocity": True, "acceleration": 10.0, "policy": aa.Towards(direction="up")}),
    ("openarm_v10", ".8060040088566904 -.7786608470823865 -.26292701652509787 0 .4652765525873672 "
     ".5372230373852276 -1.0333535008803723",
     "-.5205208019934618 .8221855162909758 -.23036725351799633 -.04335139754942785 -.758835165722632 "
     "-.3217563714374724 .5662526191569419 -.18206099414312452 .3914425704427009 .46955704046486607 "
     ".7913841670165498 .46277514529105557", 1000,
     {"dt": 0.03, "velocity": 3.0, "acceleration": 10.0, "policy": aa.Repulsion(rate=2.0)}),
]  # fmt: skip
"""Arms, starts, where to (joints, a way in m, the rows of a pose), steps that suffice, and what is asked."""


@pytest.mark.parametrize(("name", "start", "target", "steps", "asked"), ARRIVES)
def test_it_arrives(name: str, start: str, target: str, steps: int, asked: dict[str, Any]) -> None:
    """Bounded steps reach the target from difficult starts, and are OK or PARTIAL all the way."""
    arm = CALIBRATED[name] if name in CALIBRATED else aa.Arm.from_catalogue(name)
    q, to, velocity = np.array(start.split(), float), np.array(target.split(), float), np.zeros(7)
    if len(to) == 12:
        pose = np.vstack([to.reshape(3, 4), [0, 0, 0, 1]])
    else:
        pose = arm.forward(to)[0] if len(to) == 7 else moved(arm.forward(q)[0], to)
    for _ in range(steps):
        now = aa.step(arm, q, pose, velocity_now=velocity, **asked)
        assert now.status in (aa.Status.OK, aa.Status.PARTIAL)
        q, velocity = now.q, now.velocity
    assert now.status is aa.Status.OK
    np.testing.assert_allclose(arm.forward(q)[0], pose, atol=1e-9)
