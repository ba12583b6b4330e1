"""Laws of `step` and `follow` for every kind of arm: bounds, lookahead, and wishes for the elbow.

A draw of joints within the bounds is the witness that a step exists; the reference is forward kinematics.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.calibrated import ARMS as CALIBRATIONS
from support.families import CALIBRATED, EXACT, OFFSET, OFFSET_CHAIN, of
from support.moves import in_a_loop, moved
from support.strategies import arms

import armangle as aa

POLICIES: Any = (aa.Repulsion(), aa.Hold(), aa.Centre(K=0.3))
FOLLOWED = [*EXACT[:1], *CALIBRATED, *OFFSET, *OFFSET_CHAIN]
DT = 0.01
EVERY = of(FOLLOWED)
MORE = of(FOLLOWED, list(CALIBRATIONS.values()))
BEYOND = (aa.Status.UNREACHABLE, aa.Status.FOLDED, aa.Status.ELBOW_LIMIT, aa.Status.LIMITS)
NAMED = (aa.Status.PARTIAL, aa.Status.LIMITS, aa.Status.NEAR_SINGULAR, aa.Status.NO_CONVERGENCE)


def within(arm: aa.Arm, rng: np.random.Generator, share: float = 0.9) -> Any:
    """Return joints well within the limits; those of a joint without limits within ±π."""
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    return 0.5 * (lower + upper) + 0.5 * share * (upper - lower) * rng.uniform(-1, 1, 7)


def keeps(arm: aa.Arm, q: Any, now: Any, before: Any, fastest: Any, hardest: Any) -> None:
    """Check bounds and limits of a step `now` from q at the velocity `before`; a joint that can brake no more
    before its limit is stopped by it.
    """
    velocity = (now.q - q) / DT
    stopped = (now.q <= arm.lower) | (now.q >= arm.upper)
    assert (np.abs(velocity) <= np.maximum(fastest, np.abs(before)) + 1e-12).all()
    assert ((np.abs(velocity - before) <= hardest * DT + 1e-12) | stopped).all()
    assert arm.limit_margin(now.q) >= min(float(arm.limit_margin(q)), 0.0) - 1e-12


def on_pose(arm: aa.Arm, q: Any, pose: Any) -> bool:
    """Whether joints hold a pose to 1e-9."""
    return bool(np.abs(arm.forward(q, on_error="nan")[0] - pose).max() < 1e-9)


@pytest.mark.turns(2)
@MORE
def test_a_walk_under_bounds_keeps_them_and_is_ok_only_on_its_pose(arm: aa.Arm) -> None:
    """Bounded steps to a target that jumps keep their bounds, and are OK only on the target's pose."""
    rng, arrived, partly = np.random.default_rng(1), 0, 0
    for k in range(6):
        q, before = within(arm, rng), np.zeros(7)
        fastest, hardest = rng.uniform(0.3, 2.0, 7), rng.uniform(2.0, 20.0, 7)
        goal = arm.forward(q, on_error="nan")[0]
        for i in range(40):
            if i % 10 == 0:
                goal = moved(goal, rng.normal(scale=2e-3 * arm.geometry.reach, size=3))
            now = aa.step(
                arm, q, goal, policy=POLICIES[k % 3], dt=DT, velocity=fastest, acceleration=hardest,
                velocity_now=before,
            )  # fmt: skip
            keeps(arm, q, now, before, fastest, hardest)
            if now.ok:
                assert on_pose(arm, now.q, goal)
            assert now.ok or now.status in NAMED
            arrived, partly = arrived + now.ok, partly + (now.status is aa.Status.PARTIAL)
            q, before = now.q, now.velocity
    assert arrived > 5 and partly > 10


@pytest.mark.turns(2)
@of(OFFSET, CALIBRATED, OFFSET_CHAIN, list(arms()))
def test_a_move_within_the_bounds_shows_that_a_step_exists(arm: aa.Arm) -> None:
    """If some joints within the bounds hold the pose, the bounded step is OK."""
    rng, tried = np.random.default_rng(2), 0
    for k in range(40):
        q, before = within(arm, rng), rng.uniform(-0.3, 0.3, 7)
        hardest = rng.uniform(2, 20, 7)
        speed = np.clip(before + 0.95 * rng.uniform(-1, 1, 7) * hardest * DT, -1.4, 1.4)
        pose = arm.forward(q + speed * DT, on_error="nan")[0]
        now = aa.step(
            arm, q, pose, policy=POLICIES[k % 3], dt=DT, velocity=1.5, acceleration=hardest,
            velocity_now=before,
        )  # fmt: skip
        keeps(arm, q, now, before, 1.5, hardest)
        tried += 1
        assert now.ok and on_pose(arm, now.q, pose), (now.status, now.why)
    assert tried == 40


@EVERY
def test_a_step_under_bounds_moves_wherever_one_without_them_does(arm: aa.Arm) -> None:
    """Where a step without bounds is OK, the bounded one is OK or PARTIAL, and moves."""
    rng, partly = np.random.default_rng(3), 0
    for k in range(40):
        q = within(arm, rng)
        pose = arm.forward(q + rng.uniform(-0.1, 0.1, 7), on_error="nan")[0]
        asked: dict[str, Any] = {"policy": POLICIES[k % 3], "dt": DT, "max_joint_step": 0.2}
        free = aa.step(arm, q, pose, **asked)
        now = aa.step(arm, q, pose, velocity=1.0, acceleration=10.0, velocity_now=np.zeros(7), **asked)
        keeps(arm, q, now, np.zeros(7), 1.0, 10.0)
        if not free.ok:
            continue
        assert now.status in (aa.Status.OK, aa.Status.PARTIAL)
        partly += now.status is aa.Status.PARTIAL
        assert np.abs(now.q - q).max() > 0
        assert now.ok or now.why in (aa.Status.VELOCITY_LIMIT, aa.Status.ACCELERATION_LIMIT)
    assert partly > 20


@pytest.mark.turns(12)
@pytest.mark.slow
@MORE
@pytest.mark.parametrize("acceleration", [None, 3.0])
def test_a_target_aside_is_come_to_and_rested_on(arm: aa.Arm, acceleration: float | None) -> None:
    """Bounded steps to a pose nearby are OK or PARTIAL, and end at rest on it."""
    rng = np.random.default_rng(4)
    for _ in range(3):
        q, before = within(arm, rng, 0.6), np.zeros(7)
        there = arm.forward(q + rng.uniform(-0.03, 0.03, 7))[0]
        for _ in range(600):
            now = aa.step(
                arm, q, there, policy=aa.Hold(), dt=DT, velocity=1.0, acceleration=acceleration,
                velocity_now=before,
            )  # fmt: skip
            assert now.status in (aa.Status.OK, aa.Status.PARTIAL)
            keeps(arm, q, now, before, 1.0, acceleration or np.inf)
            q, before = now.q, now.velocity
        assert now.ok and on_pose(arm, q, there) and np.abs(before).max() < 1e-6


@pytest.mark.turns(2)
@MORE
@pytest.mark.parametrize(
    "bounds", [{}, {"velocity": 1.0, "acceleration": 8.0, "dt": DT}], ids=["free", "bounded"]
)
def test_follow_is_a_loop_of_steps(arm: aa.Arm, bounds: dict[str, Any]) -> None:
    """`follow` is `step` in a loop, and rows that are OK hold pose and limits in steps below 0.2 rad."""
    rng = np.random.default_rng(5)
    q = within(arm, rng, 0.6)
    shifts = np.cumsum(rng.normal(scale=1e-3, size=(25, 3)), axis=0)
    poses = np.array([moved(arm.forward(q)[0], shift) for shift in shifts])
    done = in_a_loop(arm, poses, q, "hold", **bounds)
    ok = done.status == aa.Status.OK
    assert np.abs(arm.forward(done.q[ok], on_error="nan")[0] - poses[ok]).max(initial=0) < 1e-10
    assert arm.within_limits(done.q).all() and np.abs(np.diff(done.q, axis=0)).max() <= 0.2 + 1e-12
    assert ok.any() or bounds


@EVERY
def test_on_any_status_but_ok_nothing_moves(arm: aa.Arm) -> None:
    """A step out of reach, too far or without an allowed psi says so, and returns the given joints."""
    q = within(arm, np.random.default_rng(8), 0.5)
    pose, psi, gc = arm.forward(q)
    far, leap = moved(pose, [5.0, 0.0, 0.0]), arm.forward(q + 0.6)[0]
    none = aa.ArcSet([[psi + 1.0, psi + 1.1]]) & ~arm.feasible(pose, gc)
    nowhere, too_far = {aa.Status.UNREACHABLE}, {aa.Status.JOINT_JUMP, aa.Status.LIMITS}
    for target, allowed, why in (
        (far, None, nowhere), (leap, None, too_far), (pose, none, {aa.Status.NOT_ALLOWED}),
    ):  # fmt: skip
        now = aa.step(arm, q, target, allowed=allowed)
        assert now.status in why and now.why is now.status and np.array_equal(now.q, q)
        assert (now.psi, now.gc, now.margin) == (psi, gc, arm.limit_margin(q))
    path = aa.follow(arm, np.stack([pose, far]), start=q)
    assert not path.ok and path.first_failure == 1 and "out of reach" in path.explain()
    assert aa.follow(arm, np.empty((0, 4, 4)), start=q).q.shape == (0, 7)


@EVERY
def test_a_wish_for_psi_is_met_within_what_is_allowed(arm: aa.Arm) -> None:
    """Steps with Towards(psi) bring psi to the wish, or to the end of `allowed` before it, and keep the
    pose; a wish too far for one step is shortened.
    """
    q = within(arm, np.random.default_rng(9), 0.3)
    pose, psi, gc = arm.forward(q)
    low, high = next((a, b) for a, b in arm.feasible(pose, gc) if 0 <= (psi - a) % (2 * np.pi) <= b - a)
    room = (psi - low) % (2 * np.pi), high - low - (psi - low) % (2 * np.pi)
    wish = float(psi + (min(0.4, 0.8 * room[1]) if room[1] > room[0] else -min(0.4, 0.8 * room[0])))
    half = aa.ArcSet([sorted((float(psi), float(0.5 * (psi + wish))))])
    for allowed, there in ((None, wish), (half, 0.5 * (psi + wish))):
        here = q
        for _ in range(60):
            now = aa.step(arm, here, pose, policy=aa.Towards(psi=wish, K=0.3), allowed=allowed)
            assert now.ok and on_pose(arm, now.q, pose) and np.abs(now.q - here).max() <= 0.2
            here = now.q
        assert abs(np.angle(np.exp(1j * (now.psi - there)))) < 1e-6


@pytest.mark.turns(8)
@EVERY
def test_a_wish_for_the_elbow_is_met_and_the_tool_stays(arm: aa.Arm) -> None:
    """Steps with Towards(direction or point) keep the pose, and in most cases reach the best psi of their
    arc.
    """
    rng, met = np.random.default_rng(6), 0
    for k in range(8):
        q = within(arm, rng, 0.7)
        pose, _, gc = arm.forward(q)
        wish: dict[str, Any] = (
            {"direction": rng.normal(size=3)} if k % 2 else {"point": arm.elbow(within(arm, rng))}
        )
        best = float(arm.psi_towards(pose, gc, **wish, on_error="nan"))
        arcs, psi = arm.feasible(pose, gc), float(arm.forward(q)[1])
        for _ in range(60):
            now = aa.step(arm, q, pose, policy=aa.Towards(**wish, K=0.3))
            assert now.ok and on_pose(arm, now.q, pose)
            q = now.q
        ends = arcs.intervals[: arcs.count]
        holds = [a - 1e-9 <= x <= b + 1e-9 for a, b in ends for x in (psi, psi + 2 * np.pi, psi - 2 * np.pi)]
        at = [np.round((0.5 * (a + b) - best) / (2 * np.pi)) * 2 * np.pi + best for a, b in ends]
        own = [i for i in range(len(ends)) if any(holds[3 * i : 3 * i + 3])]
        if len(own) != 1 or int(arm.forward(q)[2]) != gc:
            continue
        goal = np.clip(at[own[0]], *ends[own[0]])
        met += abs(np.angle(np.exp(1j * (now.psi - goal)))) < 1e-3
    assert met >= (4 if arm in OFFSET_CHAIN else 5)  # more of their starts lie where nothing is proven


def left(arm: aa.Arm, q: Any, pose: Any) -> tuple[Any, Any]:
    """The move (m) and the turn (rad) from the end effector at joints q to a pose."""
    there = arm.forward(q, on_error="nan")[0]
    turn = pose[:3, :3] @ there[:3, :3].T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    size = float(np.linalg.norm(axis))
    return pose[:3, 3] - there[:3, 3], axis * np.arctan2(size, np.trace(turn) - 1) / max(size, 1e-300)


@pytest.mark.turns(2)
@pytest.mark.parametrize("bounds", [{}, {"velocity": 1.5, "dt": DT}], ids=["free", "bounded"])
@EVERY
def test_out_of_reach_it_comes_to_rest_where_no_small_move_leads_nearer(
    arm: aa.Arm, bounds: dict[str, Any]
) -> None:
    """Steps with fallback="nearest_pose" rest where the distance has no slope, with or without bounds."""
    rng, level, reached = np.random.default_rng(7), 0, 0
    for k in range(40):
        q = within(arm, rng, 0.8)
        shift = rng.normal(size=3)
        shift *= (2.0, 0.4)[k % 2] * arm.geometry.reach / np.linalg.norm(shift)
        pose = moved(arm.forward(q)[0], shift)
        if reached == 12 or arm.solve(pose).ok or np.any(arm.feasible(pose).unproven):
            continue
        reached += 1
        for _ in range(1200):
            now = aa.step(arm, q, pose, policy=aa.Hold(), fallback="nearest_pose", **bounds)
            assert (now.status, now.why) in [(aa.Status.PARTIAL, why) for why in BEYOND]
            assert np.abs(now.q - q).max() <= (1.5 * DT if bounds else 0.2) + 1e-12
            assert arm.limit_margin(now.q) >= -1e-12
            went, q = np.abs(now.q - q).max(), now.q
            if went < 1e-12:
                break
        assert went < 1e-12
        move, turn = left(arm, q, pose)
        J = arm.jacobian(q)[:, (q > arm.lower + 1e-7) & (q < arm.upper - 1e-7) & (np.arange(7) != 3)]
        if np.linalg.norm(turn) < 1e-8:  # with this orientation
            level += 1
            keeping = J[3:]
            J = J - J @ np.linalg.pinv(keeping, rcond=1e-9) @ keeping
        slope = move @ J[:3] + 0.2**2 * turn @ J[3:]
        assert np.abs(slope).max(initial=0.0) < 1e-3 * np.linalg.norm(move)
    assert reached == 12 and level > 3


def narrow(arm: aa.Arm, rng: np.random.Generator, q: Any) -> aa.Arm:
    """Return the arm with tighter limits around joints, so that following runs into dead ends."""
    room = rng.uniform(0.3, 1.1, 7)
    return arm.with_(lower=np.maximum(arm.lower, q - room), upper=np.minimum(arm.upper, q + room))


@pytest.mark.turns(4)
@pytest.mark.slow
@EVERY
def test_lookahead_saves_many_and_harms_none(arm: aa.Arm) -> None:
    """`follow` with lookahead keeps poses, limits and steps, and reaches at least as many rows as without."""
    saved, window = 0, 12 if arm in CALIBRATED else 30
    for seed in range(24 if arm in CALIBRATED else 16):
        rng = np.random.default_rng(seed)
        q = within(arm, rng, 0.6)
        tight = narrow(arm, rng, q)
        pose = tight.forward(q)[0]
        shift = rng.normal(size=3)
        shift *= 0.25 / np.linalg.norm(shift)
        poses = np.array([moved(pose, s * shift) for s in np.linspace(0.0, 1.0, window)])
        asked: dict[str, Any] = {"start": q, "policy": aa.Hold(), "max_joint_step": 0.15}
        plain, ahead = (aa.follow(tight, poses, lookahead=n, **asked) for n in (0, window))
        rows = ahead.status == aa.Status.OK
        assert np.abs(tight.forward(ahead.q[rows], on_error="nan")[0] - poses[rows]).max(initial=0) < 1e-9
        assert tight.within_limits(ahead.q[rows], 1e-9).all()
        steps = np.diff(np.vstack([q, ahead.q[: int(rows.sum())]]), axis=0)
        assert np.abs(steps).max(initial=0) <= 0.15
        assert rows.sum() >= (plain.status == aa.Status.OK).sum()
        saved += rows.sum() > (plain.status == aa.Status.OK).sum()
    assert saved >= 1
