"""Reach maps of own chains: what is found holds, what is excluded holds nothing, the rest is counted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from support import draw
from support.calibrated import calibrated
from support.chain_law import walked, wrapped
from support.families import CHAINS, of
from support.moves import refused
from support.needs import need

import armangle as aa
from armangle.reach import voxels
from armangle.reach.filling import fill_tile
from armangle.reach.store import make_store

need("zarr")
Array = np.ndarray
BASE = aa.pose([0.1, 0.2, 0.3], rpy=[0.4, -0.3, 0.5])
TOOL = aa.pose([0.05, 0.02, 0.1], rpy=[0.3, 0.2, 0.1])


def freed(arm: aa.Arm, *joints: int) -> aa.Arm:
    """The arm whose joints (1..7) have no limits."""
    lower, upper = arm.lower.copy(), arm.upper.copy()
    for joint in joints:
        lower[joint - 1], upper[joint - 1] = -np.inf, np.inf
    return arm.with_(lower=lower, upper=upper)


def cells(arm: aa.Arm, six: Array, margin: float = 0.0) -> dict[str, Array]:
    """The fields of cells whose middles are the poses of these coordinates (n, 6)."""
    size = np.array([0.02, 0.02, 0.05, 0.05])
    out: dict[str, Array] = {name: np.zeros(len(six), np.uint8) for name in ("gc", "yaw", "roll", "unproven")}
    out["freedom"] = np.zeros(len(six), np.float32)
    for k, (r, z, tilt, turn) in enumerate(six[:, :4]):
        made = {name: values[k : k + 1].reshape(1, 1, 1) for name, values in out.items()}
        arm._handle.map_cells(
            np.array([[r, z]]), np.array([tilt]), np.array([turn]), size, margin, made["gc"], made["freedom"],
            made["yaw"], made["roll"], None, made["unproven"], 1,
        )  # fmt: skip
    return out


def coordinates(arm: aa.Arm, poses: Array) -> Array:
    """The six numbers of poses (n, 4, 4)."""
    out = np.empty((len(poses), 6))
    arm._handle.reduced_of_poses(poses, out)
    return out


def poses_of(arm: aa.Arm, six: Array) -> Array:
    """The poses of six numbers (n, 6)."""
    out = np.empty((len(six), 4, 4))
    arm._handle.poses_of_reduced(np.ascontiguousarray(six), out)
    return out


def drawn(arm: aa.Arm, rng: np.random.Generator, count: int) -> Array:
    """Six numbers (count, 6) of random poses whose wrist may be in reach, or a little beyond."""
    distance = arm._handle.reduced_distances()[1] * rng.uniform(0.05, 1.05, count)
    cone, tilt = np.arccos(rng.uniform(-1, 1, (2, count)))
    angles = rng.uniform(-np.pi, np.pi, (count, 3))
    return np.column_stack([distance * np.sin(cone), distance * np.cos(cone), tilt, angles])


def joints_within(arm: aa.Arm, rng: np.random.Generator, count: int) -> Array:
    """Random joints (count, 7) within the limits; of every other row some of joints 2, 4 and 6 are near the
    middle of their circle, where branches meet, if the limits permit it.
    """
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    q = rng.uniform(lower, upper, (count, 7))
    zero = -arm.geometry.signs * arm.geometry.offsets
    zero[3] += arm.geometry.signs[3] * arm.geometry.delta
    for joint in (1, 3, 5):
        some = (np.arange(count) % 2 == 0) & (rng.random(count) < 0.5)
        away = 10.0 ** rng.uniform(-4, -1, some.sum()) * rng.choice([-1, 1], some.sum())
        q[some, joint] = zero[joint] + away
    return np.asarray(q[(q >= lower).all(axis=1) & (q <= upper).all(axis=1)])


def search(arm: aa.Arm, pose: Array, rng: np.random.Generator, starts: int = 60, steps: int = 60) -> Array:
    """Joints (n, 7) within the limits that hold a pose: by damped steps from random joints, each cut to the
    limits; it uses nothing of the package but the numbers of the arm.
    """
    lower, upper = np.maximum(arm.lower, -2 * np.pi), np.minimum(arm.upper, 2 * np.pi)
    q = rng.uniform(lower, upper, (starts, 7))
    for step in range(steps + 1):
        at, axes, points = walked(arm, q)
        spin = pose[:3, :3] @ np.swapaxes(at[:, :3, :3], 1, 2)
        vee = 0.5 * np.stack([spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0],
                              spin[:, 1, 0] - spin[:, 0, 1]], axis=1)  # fmt: skip
        left = np.concatenate([pose[:3, 3] - at[:, :3, 3], vee], axis=1)
        if step == steps:
            break
        rows = np.concatenate([np.cross(axes, at[:, None, :3, 3] - points), axes], axis=2)
        square = np.swapaxes(rows, 1, 2) @ rows + 1e-8 * np.eye(6)
        move = (rows @ np.linalg.solve(square, left[..., None]))[..., 0]
        size = np.abs(move).max(axis=1, keepdims=True)
        q = np.clip(q + move * np.minimum(1.0, 0.5 / np.maximum(size, 1e-300)), lower, upper)
    return np.asarray(q[(np.abs(at - pose).max(axis=(1, 2)) < 1e-9)])


@of(CHAINS)
def test_the_six_numbers_of_a_pose_are_those_of_its_own_axes(arm: aa.Arm) -> None:
    """Coordinates and poses are inverse; turns about the arm's own axes 1 and 7 change azimuth and roll."""
    arm = arm.with_(base=BASE, tool=TOOL)
    rng = draw.generator(16, 60)
    q = rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (50, 7))
    six = coordinates(arm, arm.forward(q)[0])
    assert np.allclose(poses_of(arm, six), arm.forward(q)[0], atol=1e-13)
    moved = q.copy()
    moved[:, [0, 6]] += rng.uniform(-1, 1, (50, 2))
    turned = coordinates(arm, arm.forward(moved)[0])
    np.testing.assert_allclose(turned[:, :4], six[:, :4], rtol=0, atol=2e-13)
    angles = arm.geometry.signs[[0, 6]] * (moved - q)[:, [0, 6]]
    np.testing.assert_allclose(wrapped(turned[:, 4:] - six[:, 4:] - angles), 0.0, rtol=0, atol=2e-12)
    inner, outer = arm._handle.reduced_distances()
    distance = np.hypot(six[:, 0], six[:, 1])
    assert (distance <= outer).all() and (distance >= inner).all()


@of(CHAINS)
def test_no_posture_is_excluded(arm: aa.Arm) -> None:
    """The cell of the pose of any joints within the limits, near singularities too, says that their branch
    reaches it, or that this is not proven.
    """
    rng = draw.generator(16, 61)
    q = joints_within(arm, rng, draw.count(80))
    pose, _, gc = arm.forward(q, on_error="nan")
    made = cells(arm, coordinates(arm, pose))
    branch = np.asarray(gc)
    assert (((made["gc"] | made["unproven"]) >> branch) & 1 == 1).all()
    assert (made["gc"] & made["unproven"] == 0).all()
    assert ((made["gc"] >> branch) & 1).mean() > 0.8


@of(CHAINS)
def test_what_is_found_holds_and_what_is_excluded_holds_nothing(arm: aa.Arm) -> None:
    """Each branch in `gc` has joints that hold the pose to 1e-9 within the limits; where all branches are
    excluded, a search from random joints finds none.
    """
    rng, bare = draw.generator(16, 62), freed(arm, 1, 7)
    six = drawn(arm, rng, draw.count(60 if draw.COUNT else 40))
    made, poses = cells(arm, six), poses_of(arm, six)
    found, excluded = made["gc"] != 0, (made["gc"] | made["unproven"]) == 0
    assert found.sum() > 8 and excluded.sum() > 8
    for k in np.flatnonzero(found):
        best = bare.solve(poses[k], seed=np.clip(0.0, bare.lower, bare.upper))
        assert best.ok and (best.q >= bare.lower - 1e-9).all() and (best.q <= bare.upper + 1e-9).all()
        assert np.abs(walked(bare, best.q[None])[0][0] - poses[k]).max() < 1e-9
        assert bare.freedom(poses[k]).gc & ~(made["gc"][k] | made["unproven"][k]) == 0
    for k in np.flatnonzero(excluded):
        assert len(search(bare, poses[k], rng)) == 0
    reached = [k for k in np.flatnonzero(found)[:8] if len(search(bare, poses[k], rng))]
    assert len(reached) > 4  # the search finds what is there


@of(CHAINS)
def test_shares_of_azimuths_and_rolls_are_not_more_than_there_are(arm: aa.Arm) -> None:
    """`yaw` and `roll` are the proven turns about the own axes, rounded down, of an arm whose other end turns
    freely.
    """
    rng = draw.generator(16, 63)
    six = drawn(arm, rng, draw.count(12))
    made, poses = cells(arm, six), poses_of(arm, six)
    for name, free, about in (("yaw", 7, "base"), ("roll", 1, "tool")):
        turns = freed(arm, free).feasible_turns(poses, about=about)
        most = np.asarray(turns.measure + turns.unproven) / (2 * np.pi)
        assert (made[name] / 255 <= most + 1e-9).all()
        full = np.asarray(turns.is_full) & (made["gc"] != 0)
        assert (made[name][full & (made["unproven"] == 0)] >= 254).all()
        assert (made[name][made["gc"] != 0] > 0).mean() > 0.5


@of(CHAINS)
def test_a_map_keeps_its_chain(arm: aa.Arm, tmp_path: Path) -> None:
    """A map of an arm on a base and with a tool is made, stored with the arm, and read; a tile that another
    process makes from the store alone is equal; sections and counts say what is not proven.
    """
    arm = arm.with_(base=BASE, tool=TOOL)
    options: Any = {"spacing": 0.5, "tilt": 1.2, "fields": ("freedom",)}
    found = aa.reach_map(arm, tmp_path / "a.zarr", **options)
    assert found.arm == arm and found.fields == ("gc", "freedom", "unproven")
    assert found.missing == () and found.verify() == () and found.tiles > 4
    again = aa.ReachMap(tmp_path / "a.zarr")
    assert again.arm == arm and again.arm.geometry.chain is not None
    gc, unproven = (np.asarray(again.values(name)[:]) for name in ("gc", "unproven"))
    assert again.unproven == ((gc == 0) & (unproven != 0)).sum()
    sines = np.sin(again.axes["tilt"])[:, None] / (np.sin(again.axes["tilt"]).sum() * again.shape[3])
    assert np.allclose(again.section("unproven"), (((gc == 0) & (unproven != 0)) * sines).sum(axis=(2, 3)))
    assert (again.section("unproven") + again.section() <= 1 + 1e-12).all() and again.section().max() > 0.2
    store = make_store(arm, tmp_path / "b.zarr", found._store.grid, found.fields)
    fill_tile(store.place, 2)
    for name in found.fields:
        assert np.array_equal(store.read_field(name, 2), found._store.read_field(name, 2))
    other = arm.with_(chain=np.array(arm.geometry.chain) @ aa.pose([1e-9, 0.0, 0.0]))
    refused(aa.InputError, "arm that differs in", lambda: aa.reach_map(other, tmp_path / "a.zarr", **options))
    refused(aa.UnsupportedError, "proven", lambda: aa.reach_map(arm, tmp_path / "c.zarr", fields=("proven",)))


@of(CHAINS)
def test_samples_and_voxels_are_reached(arm: aa.Arm, tmp_path: Path) -> None:
    """`sample` draws poses that the arm reaches, the same for a seed; voxels hold every reached position."""
    arm = arm.with_(base=BASE, tool=TOOL)
    found = aa.reach_map(arm, tmp_path / "a.zarr", spacing=0.5, tilt=1.5, fields=("gc",))
    some = found.sample(12, seed=5)
    assert np.array_equal(some[:5], found.sample(5, seed=5))
    best = arm.solve(some, seed=np.clip(0.0, arm.lower, arm.upper))
    assert best.ok.all() and np.abs(walked(arm, best.q)[0] - some).max() < 1e-9
    six = found.coordinates(some)
    assert np.allclose(found.pose(six), some, atol=1e-12)
    held = found.voxels(0.6, orientations=3)
    turned = aa.pose(np.zeros(3), wxyz=voxels.even_orientations(3))
    for place, share in list(zip(held.position, held.share, strict=True))[:8]:
        turned[:, :3, 3] = place
        assert arm.reachable(turned).mean() == share > 0
    ball = np.empty(4)
    arm._handle.reach_ball(ball)
    q = draw.generator(16, 64).uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (200, 7))
    away = np.linalg.norm(arm.forward(q, on_error="nan")[0][:, :3, 3] - ball[:3], axis=1)
    assert (away <= ball[3]).all() and away.max() > 0.5 * ball[3]


def test_a_margin_to_singularities_is_kept() -> None:
    """Cells of a chain with a margin hold no more than those without it, and mostly less."""
    arm, rng = calibrated("kuka_iiwa7_r800", 1.0, 1.0), draw.generator(16, 65)
    six = drawn(arm, rng, 40)
    without, kept = cells(arm, six), cells(arm, six, 0.5)
    assert (kept["gc"] & ~(without["gc"] | without["unproven"]) == 0).all()
    assert (kept["freedom"] <= without["freedom"] + 1e-5).all()
    assert (kept["freedom"] < without["freedom"] - 0.1).sum() > 4
