"""`follow(lookahead=n)`: dead ends that the window sees are avoided wherever there is a way around them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.brute_force import planar_motion
from support.draw import count, generator
from support.moves import along, refused
from support.strategies import Array, arms, frame

import armangle as aa

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
# On this line the feasible arc splits at pose 34; the part that holds psi closes at pose 48, another stays.
FORKED = np.radians([110.0, -70, 20, -30, -90, -20, -20])
FORK, CLOSED = 34, 48
AMID = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])


def line(q: Array, shift: tuple[float, float, float], n: int = 60) -> Array:
    """n poses on a straight line with fixed orientation, beginning at the pose of q."""
    return along(IIWA.forward(q)[0], shift, n)


FORKED_LINE = line(FORKED, (0.1, 0.2, -0.5))


def lifted(psi: float, lower: float) -> float:
    """psi plus the whole turns that put it into [lower, lower + 2π), but for rounding."""
    return float(lower + (psi - lower + 1e-9) % (2 * np.pi) - 1e-9)


def reached(path: aa.JointPath) -> int:
    """The number of rows that are OK before the first that is not."""
    return len(path) if path.ok else int(path.first_failure or 0)


def reached_by_brute_force(arm: aa.Arm, poses: Array, q: Array, step: Array, grid: int) -> int:
    """How many poses brute force reaches from q in its branch within limits: psi on a grid, no joint moving
    more than `step` (7,) a pose, and every place that is reached followed.
    """
    gc = arm.forward(q)[2]
    psi = np.linspace(-np.pi, np.pi, grid, endpoint=False)
    before = q[None]
    for k, pose in enumerate(poses):
        here = arm.inverse(np.broadcast_to(pose, (grid, 4, 4)), psi, gc, on_error="nan", limits=False)
        here = here[np.all((here >= arm.lower) & (here <= arm.upper), axis=1)]
        before = here[(np.abs(here[:, None] - before) <= step).all(axis=2).any(axis=1)]
        if len(before) == 0:
            return k
    return len(poses)


def narrow_arm(rng: np.random.Generator) -> aa.Arm:
    """The iiwa with random symmetric limits of 40 to 170 degrees."""
    half = np.radians(rng.uniform(40, 170, 7))
    return IIWA.with_(lower=-half, upper=half)


def turned(start: Array, axis: Array, angle: float, way: Array, n: int) -> Array:
    """n poses from a first one, shifted along `way` (m) and turned about `axis` evenly."""
    poses, share = along(start, way, n), np.linspace(0, angle, n)[:, None]
    turns = aa.pose(np.zeros((n, 3)), rotvec=share * axis / np.linalg.norm(axis))
    poses[:, :3, :3] = turns[:, :3, :3] @ start[:3, :3]
    return poses


def bent_line(arm: aa.Arm, rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Random joints, and n poses from their own on a line along which the tool turns."""
    q = rng.uniform(0.8 * arm.lower, 0.8 * arm.upper)
    start, goal = arm.forward(q)[0], frame(rng)
    way = 0.5 * (goal[:3, 3] - start[:3, 3])
    return q, turned(start, rng.normal(size=3), rng.uniform(0, 3), way, n)


def turning_line(arm: aa.Arm, rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Random joints, and n poses from their own on a line of up to 0.6 m with a turn of up to 3 rad."""
    q = rng.uniform(arm.lower, arm.upper) * 0.8
    axis, way = rng.normal(size=3), rng.normal(size=3)
    way *= rng.uniform(0.1, 0.6) / np.linalg.norm(way)
    return q, turned(arm.forward(q)[0], axis, rng.uniform(0, 3), way, n)


# -- a dead end that a window sees, and one that none does -------------------------------------------


def test_the_arc_forks_and_the_part_that_holds_psi_closes() -> None:
    """FORKED_LINE is as this file needs it: its arc splits at FORK, and `follow` ends where its part
    closes.
    """
    plain = aa.follow(IIWA, FORKED_LINE, start=FORKED)
    gc = int(plain.gc[0])
    arcs = IIWA.feasible(FORKED_LINE, gc)
    assert arcs.count[FORK - 1] < arcs.count[FORK]
    held = [arcs[k].intervals for k in range(reached(plain))]
    width = [
        next(b - a for a, b in arc if a - 1e-9 <= lifted(psi, a) <= b + 1e-9)
        for arc, psi in zip(held, plain.psi, strict=False)
    ]
    assert FORK < reached(plain) <= CLOSED
    assert width[-1] < 0.1 < 0.4 < width[FORK]
    assert not arcs.is_empty.any()


@pytest.mark.parametrize("policy", [aa.Repulsion(), aa.Hold()])
@pytest.mark.parametrize("window", [15, 30, 60, 1000])
def test_a_window_that_sees_the_dead_end_avoids_it(policy: Any, window: int) -> None:
    """`follow` passes FORKED_LINE with a lookahead of 15 poses or more, and not with 0 or 1."""
    assert not aa.follow(IIWA, FORKED_LINE, start=FORKED, policy=policy).ok
    path = aa.follow(IIWA, FORKED_LINE, start=FORKED, policy=policy, lookahead=window)
    assert path.ok
    assert np.abs(np.diff(path.q, axis=0)).max() <= 0.2
    assert np.all(IIWA.within_limits(path.q, tol=1e-9))
    assert np.abs(IIWA.forward(path.q)[0] - FORKED_LINE).max() < 1e-12
    assert not aa.follow(IIWA, FORKED_LINE, start=FORKED, policy=aa.Hold(), lookahead=1).ok  # too late


def test_a_dead_end_without_a_way_around_is_run_into_as_late_as_can_be() -> None:
    """`follow` with lookahead ends at the first pose at which no arm angle is feasible."""
    poses = line(AMID, (0.6, 0.2, 0.2))
    empty = int(np.argmax(IIWA.feasible(poses, 0).is_empty))
    assert 0 < empty < len(poses)
    path = aa.follow(IIWA, poses, start=AMID, lookahead=len(poses))
    assert reached(path) == empty and path.status[empty] == aa.Status.UNREACHABLE


# -- laws --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(24))
def test_it_goes_as_far_as_brute_force_finds_a_way(seed: int) -> None:
    """`follow` with lookahead reaches at least as many poses as a search on a grid."""
    rng = np.random.default_rng(seed)
    arm = narrow_arm(rng)
    q, poses = bent_line(arm, rng, 60)
    limit = float(rng.choice([0.06, 0.12, 0.25]))
    path = aa.follow(arm, poses, start=q, max_joint_step=limit, lookahead=60)
    assert reached(path) >= reached_by_brute_force(arm, poses, q, np.full(7, 0.98 * limit), 500)


def test_a_gap_of_the_tube_that_closes_between_probes_is_seen() -> None:
    """`follow` reaches what a grid reaches also if a gap between two arcs lies between two probes of psi."""
    rng = np.random.default_rng(2060)
    half = np.radians(rng.uniform(40, 170, 7))
    half[[1, 3, 5]] = np.minimum(half[[1, 3, 5]], 2.09)
    arm = IIWA.with_(lower=-half, upper=half)
    q, poses = turning_line(arm, rng, 120)
    path = aa.follow(arm, poses, start=q, max_joint_step=0.03, lookahead=120)
    assert reached(path) >= reached_by_brute_force(arm, poses, q, np.full(7, 0.98 * 0.03), 1000)


def test_it_saves_many_and_harms_none() -> None:
    """`follow` with lookahead reaches at least as many poses as without, and often more."""
    saved = 0
    for seed in range(count(80)):
        rng = np.random.default_rng(seed)
        arm = narrow_arm(rng)
        q, poses = bent_line(arm, rng, 60)
        gc = int(arm.forward(q)[2])
        plain, ahead = (reached(aa.follow(arm, poses, start=q, gc=gc, lookahead=n)) for n in (0, 60))
        assert reached(aa.follow(arm, poses, start=q, lookahead=60)) >= ahead >= plain
        saved += ahead > plain
    assert saved > 10


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("arm", arms(), ids=lambda arm: arm.name)
def test_every_row_is_a_step_on_its_pose(arm: aa.Arm) -> None:
    """`follow` with lookahead keeps step and velocities in each row, limits and pose in each that is OK."""
    rng = np.random.default_rng(3)
    dt, fastest = 0.02, rng.uniform(2, 6, 7)
    for _ in range(6):
        q, poses = bent_line(
            arm.with_(lower=np.maximum(arm.lower, -7), upper=np.minimum(arm.upper, 7)), rng, 80
        )
        path = aa.follow(arm, poses, start=q, dt=dt, velocity=fastest, lookahead=10, on_fail="hold")
        rows = path.status == aa.Status.OK
        move = np.diff(np.vstack([q, path.q]), axis=0)
        assert np.all(np.abs(move / dt) <= fastest)
        assert np.abs(move).max() <= 0.2
        assert np.all(arm.within_limits(path.q[rows], tol=1e-9))
        assert np.abs(arm.forward(path.q[rows])[0] - poses[rows]).max(initial=0) < 1e-11


def test_accelerations_are_kept_though_not_foreseen() -> None:
    """`follow` with lookahead passes a dead end within velocities and accelerations."""
    poses = line(FORKED, (0.1, 0.2, -0.5), 3000)
    dt, hardest = 0.005, np.full(7, 20.0)
    slow = np.linspace(0, 1, 3000) ** 2 * (3 - 2 * np.linspace(0, 1, 3000))
    poses[:, :3, 3] = poses[0, :3, 3] + slow[:, None] * np.array([0.1, 0.2, -0.5])
    options: dict[str, Any] = {"dt": dt, "velocity": True, "acceleration": hardest, "policy": aa.Hold()}
    assert not aa.follow(IIWA, poses, start=FORKED, **options).ok
    path = aa.follow(IIWA, poses, start=FORKED, lookahead=1500, **options)
    velocity = np.diff(np.vstack([FORKED, path.q]), axis=0) / dt
    change = np.diff(np.vstack([np.zeros(7), velocity]), axis=0) / dt
    done = reached(path)
    assert np.all(np.abs(velocity[:done]) <= IIWA.velocity)
    assert np.all(np.abs(change[:done]) <= hardest * (1 + 1e-12))
    assert path.ok


def test_a_narrow_arc_is_never_missed() -> None:
    """`follow` with lookahead reaches an arc of 1e-4 rad, all that is allowed from half of the poses on."""
    q, poses = AMID, line(AMID, (0.0, 0.05, 0.0), 60)
    gap = aa.ArcSet([(1.0, 1.0001)])
    full = aa.ArcSet([(-4.0, 4.0)])
    gate = {poses[k].tobytes(): gap for k in range(30, 60)}

    def allowed(pose: Any) -> aa.ArcSet:
        """The allowed arcs of a pose."""
        return gate.get(np.asarray(pose).tobytes(), full)

    options: dict[str, Any] = {"start": q, "allowed": allowed, "policy": aa.Hold(), "max_joint_step": 0.05}
    assert reached(aa.follow(IIWA, poses, **options)) == 30
    path = aa.follow(IIWA, poses, lookahead=60, **options)
    assert path.ok
    assert np.all((path.psi[30:] >= 1 - 1e-9) & (path.psi[30:] <= 1.0001 + 1e-9))


def test_a_joint_does_not_go_round_behind_its_limits() -> None:
    """`follow` with a step wider than the gap between joint 7's limits does not cross that gap."""
    q = np.radians([-100.0, 80, 140, 100, 0, 20, -60])
    path = aa.follow(IIWA, line(q, (0.0, -0.2, 0.0)), start=q, lookahead=60, max_joint_step=0.3)
    assert path.ok
    assert np.abs(np.diff(path.q, axis=0)).max() <= 0.3


def test_without_dead_ends_nothing_changes() -> None:
    """If `follow` is OK without lookahead, it gives the same joints with it, also in the arm's plane, where
    theta_2 or theta_6 passes 0.
    """
    rng, crossed = generator(5), 0
    cases = [(IIWA.with_(lower=None, upper=None), line(AMID, (0.0, 0.1, 0.05)), AMID)]
    for _ in range(count(40)):
        path, q = planar_motion(IIWA, rng)
        crossed += bool((q[:, [1, 5]].min(axis=0) * q[:, [1, 5]].max(axis=0) < 0).any())
        cases.append((IIWA, path.pose(np.linspace(0, 1, len(q))), q[0]))
    for arm, poses, start in cases:
        plain, ahead = (aa.follow(arm, poses, start=start, lookahead=n) for n in (0, 20))
        assert ahead.ok >= plain.ok and (not plain.ok or np.array_equal(plain.q, ahead.q))
    assert crossed >= 8 and aa.follow(*cases[0][:2], start=AMID).ok


def test_a_single_pose_and_none_and_bad_windows() -> None:
    """`follow` with lookahead takes one pose and none, and refuses what is no number of poses."""
    assert aa.follow(IIWA, FORKED_LINE[:1], start=FORKED, lookahead=5).ok
    assert len(aa.follow(IIWA, FORKED_LINE[:0], start=FORKED, lookahead=5)) == 0
    for bad in (-1, 1.5, True, None, "3"):
        said = "wanted a number of poses, 0 or more"
        refused(aa.InputError, said, aa.follow, IIWA, FORKED_LINE, start=FORKED, lookahead=bad)
