"""Where a pose has no posture: `fallback="nearest_pose"` finds that of the nearest pose the arm can take."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from support import draw, streams
from support.calibrated import calibrated
from support.threads import in_threads

import armangle as aa

Array = NDArray[np.float64]

LENGTH = 0.2
POSES, SEARCHED = (400, 400) if draw.COUNT else (30, 15)
STARTS, ROUNDS = 200, 60
ARM_OF = {name: aa.Arm.from_catalogue(name) for name in ("kuka_iiwa14_r820", "realman_rm75_b")}
OFFSET = {name: aa.Arm.from_catalogue(name) for name in ("franka_fr3", "fetch", "willow_garage_pr2_right")}
CHAIN = {"calibrated iiwa": calibrated("kuka_iiwa7_r800", 1.0, 1.0)}
EVERY = {**ARM_OF, **OFFSET, **CHAIN, "calibrated Franka": calibrated("franka_fr3", 1.0, 1.0)}
OUT_OF_REACH = (aa.Status.UNREACHABLE, aa.Status.FOLDED, aa.Status.ELBOW_LIMIT)
KINDS = ("reach", "limits", "edge", "inner")


@pytest.fixture(params=list(ARM_OF))
def arm(request: pytest.FixtureRequest) -> aa.Arm:
    """An S-R-S arm, each of two in turn."""
    return ARM_OF[request.param]


@pytest.fixture(params=list(EVERY))
def any_arm(request: pytest.FixtureRequest) -> aa.Arm:
    """An arm of every kind, each in turn."""
    return EVERY[request.param]


def drawn(arm: aa.Arm, rng: np.random.Generator, count: int) -> Array:
    """Random joints (count, 7) within the limits, of joints without limits within ±π."""
    return rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (count, 7))


def at_edges(arm: aa.Arm, q: Array, rng: np.random.Generator) -> Array:
    """The joints with some replaced by limits or, for joints 2, 4 and 6, by their singular value."""
    straight = np.clip(
        arm.geometry.signs * (np.eye(7)[3] * arm.geometry.delta - arm.geometry.offsets), arm.lower, arm.upper
    )
    q = np.where((rng.random(q.shape) < 0.4) & (np.arange(7) % 2 == 1), straight, q)
    end = np.where(rng.random(q.shape) < 0.5, np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi))
    return np.where(rng.random(q.shape) < 0.3, end, q)


def outside(arm: aa.Arm, rng: np.random.Generator, kind: str, count: int = POSES) -> Array:
    """`count` poses without a solution: out of reach, beyond limits, next to singular ones or limits, or near
    the shoulder, as `kind` (of KINDS) says.
    """
    found = np.empty((0, 4, 4))
    while len(found) < count:
        q = drawn(arm, rng, 4 * count)
        poses = arm.forward(at_edges(arm, q, rng) if kind == "edge" else q)[0].copy()
        turns, shift = rng.normal(size=(len(poses), 3)), 0.3 * rng.normal(size=(len(poses), 3))
        if kind == "reach":
            poses[:, :3, 3] += shift
            turns *= 0.5
        if kind == "edge":
            size = 10.0 ** rng.uniform(-9, -1, (len(poses), 1))
            poses[:, :3, 3] += size * shift
            turns *= size
        if kind == "inner":
            shoulder = (arm.base @ np.array([0, 0, arm.geometry.d_bs, 1.0]))[:3]
            poses[:, :3, 3] = shoulder + 0.4 * rng.random((len(poses), 1)) * (poses[:, :3, 3] - shoulder)
        poses[:, :3, :3] = streams.rotation(turns) @ poses[:, :3, :3]
        found_now = arm.solve(poses)
        status = np.asarray(found_now.status)
        wanted = ~np.asarray(found_now.ok)
        if kind == "reach":
            wanted &= np.isin(status, OUT_OF_REACH)
        if kind == "limits":
            wanted &= status == aa.Status.LIMITS
        found = np.concatenate([found, poses[wanted]])
    return found[:count]


def apart(arm: aa.Arm, q: Array, poses: Array) -> tuple[Array, Array]:
    """How far postures (n, 7) are from poses: moves (n, 3) in m, and turns (n, 3) in rad."""
    there = arm.forward(q)[0]
    relative = poses[:, :3, :3] @ np.swapaxes(there[:, :3, :3], 1, 2)
    axis = np.stack([relative[:, 2, 1] - relative[:, 1, 2], relative[:, 0, 2] - relative[:, 2, 0],
                     relative[:, 1, 0] - relative[:, 0, 1]], axis=-1)  # fmt: skip
    size = np.linalg.norm(axis, axis=-1, keepdims=True)
    angle = np.arctan2(size, np.trace(relative, axis1=1, axis2=2)[:, None] - 1)
    return poses[:, :3, 3] - there[:, :3, 3], axis * angle / np.maximum(size, 1e-12)


def distances(arm: aa.Arm, q: Array, poses: Array, length: float) -> Array:
    """Distances (n,) of joints (n, 7) from poses, m; `length` (m) converts rotation to m."""
    moves, turns = apart(arm, q, poses)
    return np.sqrt((moves**2).sum(-1) + length**2 * (turns**2).sum(-1))


def searched(arm: aa.Arm, poses: Array, length: float, rng: np.random.Generator) -> Array:
    """The least distance (n,) from each pose, `length` (m) for 1 rad, that damped least squares within limits
    finds from STARTS starts.
    """
    wanted = np.repeat(poses, STARTS, axis=0)
    q = drawn(arm, rng, len(wanted))
    weight = np.r_[np.ones(3), np.full(3, length)]
    off, damping = distances(arm, q, wanted, length), np.full(len(wanted), 1e-3)
    for _ in range(ROUNDS):
        J = arm.jacobian(q) * weight[:, None]
        error = np.concatenate(apart(arm, q, wanted), axis=1) * weight
        slope = np.einsum("nij,ni->nj", J, error)
        free = ~(((q <= arm.lower) & (slope < 0)) | ((q >= arm.upper) & (slope > 0)))
        J = J * free[:, None, :]
        H = np.einsum("nki,nkj->nij", J, J) + damping[:, None, None] * np.eye(7)
        step = np.linalg.solve(H, np.einsum("nij,ni->nj", J, error)[..., None])[..., 0]
        trial = np.clip(q + np.clip(step, -0.5, 0.5), arm.lower, arm.upper)
        new = distances(arm, trial, wanted, length)
        better = new < off
        q[better], off[better] = trial[better], new[better]
        damping = np.where(better, damping * 0.3, damping * 5).clip(1e-9, 1e3)
    return off.reshape(-1, STARTS).min(1)


@pytest.mark.turns(2)
def test_a_pose_with_a_posture_is_solved_as_ever(any_arm: aa.Arm) -> None:
    """For poses with a solution fallback="nearest_pose" changes nothing in `solve`."""
    arm, rng = any_arm, np.random.default_rng(0)
    q = drawn(arm, rng, 100)
    poses, seeds = arm.forward(q)[0], q + 0.1 * rng.normal(size=q.shape)
    for plain, other in zip(
        arm.solve(poses, seed=seeds), arm.solve(poses, seed=seeds, fallback="nearest_pose"), strict=True
    ):
        assert np.array_equal(plain, other)


@pytest.mark.turns(8)
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_no_search_from_many_starts_comes_nearer(any_arm: aa.Arm, kind: str) -> None:
    """`solve(fallback="nearest_pose")` is within 1 mm of a search in 99 %, of position if it keeps the
    orientation.
    """
    arm, rng = any_arm, np.random.default_rng([draw.SEED, len(kind)])
    poses = outside(arm, rng, kind, SEARCHED)
    found = arm.solve(poses, fallback="nearest_pose")
    assert np.array_equal(found.status, arm.solve(poses).status)
    assert (arm.limit_margin(found.q) >= -1e-9).all()
    moves, turns = apart(arm, found.q, poses)
    held = np.linalg.norm(turns, axis=1) < 1e-7
    assert held.mean() > 0.3 or kind != "reach"
    late = np.linalg.norm(moves, axis=1) - searched(arm, poses, 20.0, rng)
    assert np.abs(found.pose - arm.forward(found.q)[0]).max() < 1e-12
    assert np.abs(found.gap - distances(arm, found.q, poses, LENGTH)).max() < 1e-7
    near = distances(arm, found.q, poses, LENGTH) - searched(arm, poses, LENGTH, rng)
    excess = np.where(held, late, near)
    assert (excess >= 1e-3).sum() <= max(1, SEARCHED // 100)
    assert np.median(excess) < 1e-4


def test_a_wrist_out_of_reach_is_drawn_along_its_ray(arm: aa.Arm) -> None:
    """Out of reach the nearest pose of the same orientation moves the wrist straight to the edge of reach."""
    rng = np.random.default_rng(draw.SEED)
    poses = outside(arm, rng, "reach")
    found = arm.solve(poses, fallback="nearest_pose")
    moves, turns = apart(arm, found.q, poses)
    held = np.linalg.norm(turns, axis=1) < 1e-7
    shoulder = (arm.base @ np.array([0, 0, arm.geometry.d_bs, 1.0]))[:3]
    flange = poses @ np.linalg.inv(arm.tool)
    wrist = flange[:, :3, 3] - arm.geometry.d_wf * flange[:, :3, 2]
    ray = wrist - shoulder
    far = np.linalg.norm(ray, axis=1)
    bend = np.array([np.clip(0.0, arm.lower[3], arm.upper[3]), arm.lower[3], arm.upper[3]])
    reach = np.sqrt(
        arm.geometry.d_se**2 + arm.geometry.d_ew**2 + 2 * arm.geometry.d_se * arm.geometry.d_ew * np.cos(bend)
    )
    gap = np.maximum(far - reach.max(), reach.min() - far)
    assert held.sum() > 10
    assert np.abs(np.linalg.norm(moves, axis=1) - gap)[held].max() < 1e-12
    assert np.abs(np.cross(moves, ray))[held].max() < 1e-9


@pytest.mark.parametrize("arm", OFFSET.values(), ids=list(OFFSET))
def test_an_offset_arm_out_of_reach_is_drawn_to_its_edge(arm: aa.Arm) -> None:
    """Out of reach the nearest pose of an offset arm is at the distance that `explain` gives."""
    rng = np.random.default_rng(draw.SEED)
    poses = outside(arm, rng, "reach")
    found = arm.solve(poses, fallback="nearest_pose")
    moves, turns = (np.linalg.norm(x, axis=1) for x in apart(arm, found.q, poses))
    held = turns < 1e-7
    edge = np.array([arm.explain(pose).nearest_gap for pose in poses])
    stretched = (
        np.abs(arm.geometry.signs[3] * found.q[:, 3] + arm.geometry.offsets[3] - arm.geometry.delta) < 1e-4
    )
    assert (held & stretched).sum() > 5
    assert (moves >= edge - 1e-9)[held].all()
    assert np.abs(moves - edge)[held & stretched].max() < 1e-6


@pytest.mark.turns(3)
def test_batches_threads_and_seeds(any_arm: aa.Arm) -> None:
    """`solve(fallback="nearest_pose")` is the same one by one, many and in threads, and states distance and
    gap.
    """
    arm, rng = any_arm, np.random.default_rng(2)
    each = 4 if draw.COUNT else 1
    poses = np.stack([outside(arm, rng, kind, each) for kind in ("reach", "limits")])
    seeds = drawn(arm, rng, 2 * each).reshape(2, each, 7)
    many = in_threads(2, lambda: arm.solve(poses, seed=seeds, fallback="nearest_pose"))
    assert many.q.shape == (2, each, 7)
    for i in np.ndindex(2, each):
        one = arm.solve(poses[i], seed=seeds[i], fallback="nearest_pose")
        assert np.array_equal(one.q, many.q[i])
        assert one.distance == pytest.approx(np.linalg.norm(one.q - seeds[i]))
        stretched = abs(one.q[3]) < 1e-6  # of either branch
        assert stretched or one.gc == arm.forward(one.q)[2]
        assert not one.ok
        assert "q=[" in repr(one) and f"gap={one.gap:.6g}" in repr(one)


def test_never_worse_than_the_pose_within_reach_and_a_clamp(arm: aa.Arm) -> None:
    """The nearest pose is no farther than that of joints of `inverse` clamped to the limits."""
    rng = np.random.default_rng(draw.SEED)
    poses = outside(arm, rng, "limits")
    found = arm.solve(poses, fallback="nearest_pose")
    naive = [np.clip(arm.inverse(pose, psi, gc, limits=False), arm.lower, arm.upper)
             for pose in poses for psi in (0.0, 2.0) for gc in range(8)]  # fmt: skip
    theirs = distances(arm, np.array(naive), np.repeat(poses, 16, axis=0), LENGTH).reshape(-1, 16).min(1)
    assert (distances(arm, found.q, poses, LENGTH) <= theirs + 1e-9).all()


@pytest.mark.turns(2)
@pytest.mark.parametrize("kind", ["reach", "limits"])
@pytest.mark.parametrize("arm", [*ARM_OF.values(), *CHAIN.values()], ids=[*ARM_OF, *CHAIN])
def test_the_singularity_margin_holds_beside_the_pose_too(arm: aa.Arm, kind: str) -> None:
    """`solve(fallback="nearest_pose")` keeps singularity margin and limits, its gap mostly no smaller."""
    margin = 0.2
    rng = np.random.default_rng([draw.SEED, 3])
    poses = outside(arm, rng, kind)
    found = arm.with_(singularity_margin=margin).solve(poses, fallback="nearest_pose")
    free = arm.solve(poses, fallback="nearest_pose")
    assert np.isfinite(found.q).all()
    theta = (
        arm.geometry.signs * found.q
        + arm.geometry.offsets
        - np.where(np.arange(7) == 3, arm.geometry.delta, 0.0)
    )
    assert (np.abs(np.sin(theta[:, [1, 3, 5]])) >= np.sin(margin) - 1e-12).all()
    assert (arm.limit_margin(found.q) >= -1e-9).all()
    assert np.abs(found.gap - distances(arm, found.q, poses, LENGTH)).max() < 1e-7
    held, held_free = (np.linalg.norm(apart(arm, one.q, poses)[1], axis=1) < 1e-7 for one in (found, free))
    alike = held == held_free  # one that keeps its orientation may be farther than one that does not
    assert (found.gap >= free.gap - 1e-3)[alike].mean() > 0.95  # a margin only takes away; both are local


def test_a_pose_that_only_the_margin_forbids_gets_its_nearest_neighbour(arm: aa.Arm) -> None:
    """A pose within the singularity margin gets a pose less than 1 cm away that keeps it."""
    straight = arm.geometry.signs * (np.array([0, 0, 0, arm.geometry.delta, 0, 0, 0]) - arm.geometry.offsets)
    q = np.array([0.3, 0.7, 0.2, straight[3] + 0.02 * arm.geometry.signs[3], 0.1, 0.8, 0.1])
    pose = arm.forward(q)[0]
    found = arm.with_(singularity_margin=0.1).solve(pose, seed=q, fallback="nearest_pose")
    assert found.status is aa.Status.ELBOW_MARGIN
    assert 0 < found.gap < 0.01
    assert abs(np.sin(arm.geometry.signs[3] * (found.q[3] - straight[3]))) >= np.sin(0.1)
    none = arm.with_(singularity_margin=1.5).solve(pose, seed=q, fallback="nearest_pose")
    assert none.status is aa.Status.ELBOW_MARGIN  # which limits may leave nothing of


@pytest.mark.turns(2)
@pytest.mark.parametrize("kind", ["reach", "limits"])
@pytest.mark.parametrize("arm", [*ARM_OF.values(), *OFFSET.values()], ids=[*ARM_OF, *OFFSET])
def test_explain_names_what_solve_finds(arm: aa.Arm, kind: str) -> None:
    """`explain` gives the solution of `solve(fallback="nearest_pose")`, and its distance and angle."""
    rng = np.random.default_rng([draw.SEED, 4])
    poses = outside(arm, rng, kind, POSES if arm.kind == "srs" else 5)
    for margin in (0.0, 0.2) if arm.kind == "srs" else (0.0,):
        found = arm.with_(singularity_margin=margin).solve(poses, fallback="nearest_pose")
        moves, turns = (np.linalg.norm(x, axis=1) for x in apart(arm, found.q, poses))
        for i, pose in enumerate(poses):
            said = arm.with_(singularity_margin=margin).explain(pose)
            row = found.row(i)
            assert said.instead is not None and not said.ok
            assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(said.instead, row, strict=True))
            assert abs(said.instead_moved - moves[i]) < 1e-12 and abs(said.instead_turned - turns[i]) < 1e-7
            said_at = ", ".join(f"{x:.6g}" for x in row.pose[:3, 3])
            assert f"{1e3 * moves[i]:.4g} mm" in said.explain() and said_at in said.explain()
            if turns[i] > 2e-5:  # else it is the one within reach, which is named once, or farther
                assert f"{np.degrees(turns[i]):.3g}°" in said.explain().splitlines()[-1]
    held = arm.explain(arm.forward(drawn(arm, rng, 1)[0])[0])
    assert held.ok and held.instead is None and np.isnan(held.instead_moved)


def test_explain_names_nothing_where_the_margin_leaves_no_posture(arm: aa.Arm) -> None:
    """`explain` names no nearest pose if limits leave nothing outside the margin."""
    lower, upper = arm.lower.copy(), arm.upper.copy()
    straight = -arm.geometry.signs[5] * arm.geometry.offsets[5]
    lower[5], upper[5] = straight - 0.1, straight + 0.1
    stiff = arm.with_(lower=lower, upper=upper)
    said = stiff.with_(singularity_margin=0.2).explain(stiff.forward(0.5 * (lower + upper) + 0.05)[0])
    assert not said.ok and said.instead is None and "nearest pose" not in said.explain()


@pytest.mark.parametrize(("name", "position", "turn", "least"), [
    ("iit_icub_right", (0.0713, 0.3475, 0.3039), (0.0932, -2.1678, -0.8565), 0.1236),
    ("openloong_right", (-0.0698, -0.7922, 0.4175), (0.7008, 1.4311, 0.4528), 0.0318),
    ("fourier_gr2t2v2_left", (-0.1128, 0.6229, 0.4876), (0.5174, -0.0763, 1.9854), 0.1345),
])  # fmt: skip
def test_a_start_that_is_far_at_first_may_lead_nearest(
    name: str, position: tuple[float, ...], turn: tuple[float, ...], least: float
) -> None:
    """`solve(fallback="nearest_pose")` has gaps no larger than those known for three difficult poses."""
    pose = np.eye(4)
    pose[:3, :3] = streams.rotation(np.array([turn]))[0]
    pose[:3, 3] = position
    found = aa.Arm.from_catalogue(name).solve(pose, fallback="nearest_pose")
    assert found.status == aa.Status.LIMITS
    assert found.gap <= least
