"""Distance fields as obstacles: never nearer than the truth, and kept off by less than a spacing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.draw import count, generator

import armangle as aa

Floats = NDArray[np.float64]
LOST = 0.87 + 0.07
"""Of a spacing: half of a cell's diagonal, and what a search along a link gives up."""
BODY = aa.Body({
    1: [aa.Ball([0.03, 0.1, 0.06], 0.04)],
    3: [aa.Capsule([0, -0.4, 0], [0, 0, 0], 0.06), aa.Ball([0, 0, 0], 0.08)],
    4: [aa.Capsule([0, 0, 0], [0, 0, 0.4], 0.05), aa.Capsule([0.02, 0.05, 0.1], [0.03, -0.06, 0.18], 0.03)],
    5: [aa.Capsule([0.06, -0.1, 0.02], [0.05, -0.04, 0.03], 0.04)],
})  # fmt: skip
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=BODY)
TURNED = ARM.with_(base=aa.pose([0.2, 0.1, -0.3], rpy=[0.1, 0.4, 0.2]))


def grid(low: Any, size: Any, spacing: float) -> Floats:
    """The nodes (a, b, c, 3) of a grid from `low` over at least `size` (m)."""
    shape = np.ceil(np.asarray(size) / spacing).astype(int) + 1
    axes = [start + spacing * np.arange(n) for start, n in zip(low, shape, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def of_balls(
    centres: Floats, radius: float, spacing: float, rng: np.random.Generator, noise: float
) -> aa.Field:
    """The distance field of balls, up to `noise` (m) below the truth and cut off at 0.25 m."""
    low = centres.min(axis=0) - radius - 0.16  # more than any link's radius: see Field
    nodes = grid(low, centres.max(axis=0) + radius + 0.16 - low, spacing)
    apart = np.linalg.norm(nodes[..., None, :] - centres, axis=-1).min(axis=-1) - radius
    told = np.minimum(apart, 0.25) - rng.uniform(0, 1, apart.shape) * noise
    return aa.Field(told, low, spacing, name="seen")


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_what_a_field_leaves_lies_between_the_balls_and_larger_balls(noise: float) -> None:
    """Arcs of a field lie within those of its balls, and hold those of balls larger by LOST."""
    rng, some = generator(1), 0
    for k in range(count(12)):
        arm = [ARM, TURNED][k % 2]
        shoulder = arm.frames(np.zeros(7))[1, :3, 3]
        spacing = float(rng.choice([0.01, 0.02]))
        centres = shoulder + rng.normal(size=(1 + k % 3, 3)) * 0.25
        field = of_balls(centres, 0.05, spacing, rng, noise)
        pose, _, gc = arm.forward(rng.uniform(-1.8, 1.8, 7))
        ignore = [(f"link_{i}", f"link_{j}") for i, j in ((1, 3), (1, 4), (1, 5), (3, 5))]
        shapes = [[aa.Ball(c, r) for c in centres] for r in (0.05, 0.05 + LOST * spacing + noise)]
        truth, kept, found = (
            arm._clear(pose, gc, aa.Scene(listed, ignore=ignore)) for listed in (*shapes, [field])
        )
        assert (found & ~truth).measure < 1e-9, k
        assert (kept & ~found).measure < 1e-5, k
        some += 0 < found.measure < 6.2
    assert some > 2


def test_the_nearest_of_a_field_is_a_lower_bound_with_a_direction() -> None:
    """`clearance` to a field is at most the true distance and less by under LOST spacings."""
    rng = generator(2)
    for _ in range(count(20)):
        centre = ARM.frames(np.zeros(7))[1, :3, 3] + rng.normal(size=3) * 0.4
        nodes = grid(centre - 0.45, [0.9] * 3, 0.02)
        field = aa.Field(np.linalg.norm(nodes - centre, axis=-1) - 0.1, centre - 0.45, 0.02)
        pose, psi, gc = ARM.forward(rng.uniform(-1.5, 1.5, 7))
        ball = ARM.clearance(
            ARM.inverse(pose, psi, gc, limits=False), aa.Scene([aa.Ball(centre, 0.1, name="seen")])
        )
        near = ARM.clearance(ARM.inverse(pose, psi, gc, limits=False), aa.Scene([field]))
        if ball.obstacle != "seen":
            continue
        assert ball.distance - LOST * 0.02 <= near.distance <= ball.distance + 1e-12
        if 0.03 < ball.distance < 0.3:
            assert np.linalg.norm(near.points[1] - ball.points[1]) < 0.05


@pytest.mark.turns(2)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_arcs_distances_and_the_widest_arm_angle_are_of_one_surface(noise: float) -> None:
    """For a field, arcs and widest psi agree with `clearance` but for a part of the spacing."""
    rng, ends, beyond = generator(7), 0, 0
    ignore = [(f"link_{i}", f"link_{j}") for i, j in ((1, 3), (1, 4), (1, 5), (3, 5))]
    for k in range(count(24)):
        arm, spacing = [ARM, TURNED][k % 2], float(rng.choice([0.01, 0.03]))
        shoulder = arm.frames(np.zeros(7))[1, :3, 3]
        field = of_balls(shoulder + rng.normal(size=(1 + k % 3, 3)) * 0.25, 0.05, spacing, rng, noise)
        scene = aa.Scene([field], clearance=float(rng.choice([0.0, 0.02])), ignore=ignore)
        pose, _, gc = arm.forward(rng.uniform(-1.8, 1.8, 7))
        arcs, own = arm._clear(pose, gc, scene), arm.feasible(pose, gc)
        limits = np.empty(0) if arcs.is_full else arcs.intervals.ravel()
        beside = limits + rng.choice([-1, 1], (9, len(limits))) * 10 ** rng.uniform(-5, -2, (9, len(limits)))
        psi = np.concatenate([rng.uniform(-np.pi, np.pi, 400), beside.ravel()])
        poses = np.tile(pose, (len(psi), 1, 1))
        over = (
            np.asarray(
                arm.clearance(arm.inverse(poses, psi, np.full(len(psi), gc), limits=False), scene).distance
            )
            - scene.clearance
        )
        within = arcs.contains(psi)
        assert over[within].min(initial=1.0) > -0.01 * spacing - 1e-6, k
        assert over[~within].max(initial=-1.0) < 0.25 * spacing + 1e-6, k
        ends += len(limits)
        widest = arm._widest(pose, gc, scene)
        allowed = over[own.contains(psi)]
        if np.isfinite(widest.psi) and len(allowed):
            told = widest.nearest.distance - scene.clearance
            assert told >= allowed.max() - 0.26 * spacing, k
            beyond += told > 0
    assert ends > 4 and beyond > 1


def test_arcs_and_distances_of_a_coarse_field_that_was_cut_off_agree() -> None:
    """For a field of two nodes an edge, all 0, arcs agree with `clearance`."""
    rng, near = generator(9), 0
    for _ in range(count(30)):
        spacing = rng.uniform(0.2, 0.4)
        origin = np.array([0, 0, 0.34]) + rng.normal(size=3) * 0.3 - spacing / 2
        scene = aa.Scene([aa.Field(np.zeros((2, 2, 2)), origin, spacing)])
        pose, _, gc = ARM.forward(rng.uniform(-1.8, 1.8, 7))
        psi = np.linspace(-np.pi, np.pi, 181)
        free = ARM._clear(pose, gc, scene).contains(psi)
        over = ARM.clearance(ARM.inverse(np.tile(pose, (181, 1, 1)), psi, gc, limits=False), scene).distance
        assert over[free].min(initial=1.0) > -0.01 * spacing - 1e-6
        assert over[~free].max(initial=-1.0) < 0.25 * spacing + 1e-6
        near += 0 < free.sum() < len(psi)
    assert near > 3


def test_what_a_noisy_node_forgets_its_neighbours_tell() -> None:
    """A field with nodes that are far too low has the distances of the true field but for 0.04 m."""
    nodes = grid([0.2, -0.2, 0.3], [0.4] * 3, 0.02)
    told = np.linalg.norm(nodes - [0.4, 0.0, 0.5], axis=-1) - 0.05
    holes = np.where(generator(8).random(told.shape) < 0.2, -1.0, told)
    pose, psi, gc = ARM.forward(np.radians([20, 45, 10, -80, 10, 60, 0]))
    q = ARM.inverse(pose, psi, gc, limits=False)
    fields = (aa.Field(field, [0.2, -0.2, 0.3], 0.02) for field in (told, holes))
    whole, less = (ARM.clearance(q, aa.Scene([field])) for field in fields)
    assert whole.distance - 0.04 < less.distance <= whole.distance


def test_outside_its_grid_a_field_is_free() -> None:
    """A field of negative nodes is as near as the box of its grid, but for 4 mm."""

    field = aa.Field(np.full((3, 3, 3), -1.0), [0.4, 0.4, 0.4], 0.05, name="block")
    box = aa.Box(aa.pose([0.45, 0.45, 0.45]), [0.1, 0.1, 0.1], name="block")
    rng = generator(3)
    for _ in range(30):
        pose, psi, gc = ARM.forward(rng.uniform(-1.5, 1.5, 7))
        one, other = (
            ARM.clearance(ARM.inverse(pose, psi, gc, limits=False), aa.Scene([shape]))
            for shape in (field, box)
        )
        if one.distance > 0.01:
            assert other.distance - 0.004 < one.distance <= other.distance + 1e-12


def test_what_the_hand_holds_keeps_off_a_field() -> None:
    """A gripper shape in a field is POSE_BLOCKED as by its ball, or by one larger by 0.02 m."""
    rng, blocked = generator(4), 0
    for k in range(40):
        pose, _, gc = ARM.forward(rng.uniform(-1.5, 1.5, 7))
        centre = pose[:3, 3] + rng.normal(size=3) * 0.12
        nodes = grid(centre - 0.15, [0.3] * 3, 0.01)
        field = aa.Field(np.linalg.norm(nodes - centre, axis=-1) - 0.05, centre - 0.15, 0.01, name="seen")
        corners = np.array([[x, y, z] for x in (-0.03, 0.03) for y in (-0.05, 0.05) for z in (0, 0.1)])
        held = [
            aa.Box(aa.pose([0, 0, 0.05]), [0.06, 0.1, 0.1]),
            aa.Hull(corners),
            aa.Ball([0, 0, 0.05], 0.04),
        ]
        arm = ARM.with_(body=None).with_(hand=[held[k % 3]])
        near = arm._clear(pose, gc, aa.Scene([field]))
        truth = arm._clear(pose, gc, aa.Scene([aa.Ball(centre, 0.05)]))
        wider = arm._clear(pose, gc, aa.Scene([aa.Ball(centre, 0.05 + 0.02)]))
        touches = [each.status == aa.Status.POSE_BLOCKED for each in (truth, near, wider)]
        assert touches == sorted(touches), (k, touches)
        blocked += touches[0]
    assert blocked > 5


def test_a_plan_round_a_field_is_proven_and_clear_of_the_truth() -> None:
    """A certified plan in the scene of a field keeps clear of the ball that the field was made of."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.07, forearm=0.06))
    q = np.radians([20, 45, 10, -80, 10, 60, 0])
    pose, _, _ = arm.forward(q)
    centre = arm.frames(q)[3, :3, 3] + [0.02, 0.2, 0.0]
    nodes = grid(centre - 0.3, [0.6] * 3, 0.02)
    field = aa.Field(np.linalg.norm(nodes - centre, axis=-1) - 0.06, centre - 0.3, 0.02, name="seen")
    poses = np.tile(pose, (60, 1, 1))
    poses[:, 1, 3] += np.linspace(0, 0.1, 60)
    path = aa.plan(arm.with_(scene=aa.Scene([field])), poses, start=q)
    assert path.ok and path.certified
    rows = path.at(np.linspace(0, 1, 2001))
    truth = aa.Scene([aa.Ball(centre, 0.06)])
    assert arm.clearance(rows.q, truth).distance.min() > 0


def test_a_field_is_written_and_read(tmp_path: Path) -> None:
    """`load_field` reads an .npz with distance, origin and spacing, and refuses others."""
    distance = np.arange(24.0).reshape(2, 3, 4) * 1e-3
    np.savez(tmp_path / "seen.npz", distance=distance, origin=[0.1, 0.2, 0.3], spacing=0.05)
    field = aa.io.load_field(tmp_path / "seen.npz", name="seen")
    assert field == aa.Field(distance, [0.1, 0.2, 0.3], 0.05, name="seen")
    assert field != aa.Field(distance, [0.1, 0.2, 0.3], 0.06, name="seen")
    (tmp_path / "broken.npz").write_bytes(b"nothing")
    np.savez(tmp_path / "less.npz", distance=distance, spacing=0.05)
    np.savez(tmp_path / "more.npz", distance=distance, origin=[0, 0, 0], spacing=[0.05, 0.05, 0.05])
    for name, wanted in (
        ("none.npz", "no such file"), ("seen.npy", "ending in .npz"), ("broken.npz", "can be read"),
        ("less.npz", "it holds no origin"), ("more.npz", "one number as spacing"),
    ):  # fmt: skip
        with pytest.raises(aa.errors.SceneError, match=wanted):
            aa.io.load_field(tmp_path / name)
