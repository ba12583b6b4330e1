"""The soft clearance: kept where it can be, without ever giving up the hard one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.draw import count, generator

import armangle as aa

Floats = NDArray[np.float64]
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.07, forearm=0.06))
HARD, SOFT = 0.01, 0.04


def balls(rng: np.random.Generator, n: int) -> list[aa.Ball]:
    """n random balls around the shoulder, none on it."""
    along = rng.normal(size=(n, 3))
    along *= rng.uniform(0.3, 0.6, (n, 1)) / np.linalg.norm(along, axis=1, keepdims=True)
    return [aa.Ball(way, 0.05) for way in along + np.array([0, 0, 0.34])]


def cases(seed: int) -> Any:
    """Yield joints that are 1 to 8 cm clear of a scene, their pose and gc, and the scene's shapes."""
    rng, found = generator(seed), 0
    while found < count(12):
        q = rng.uniform(ARM.lower, ARM.upper) * 0.7
        shapes = balls(rng, 3)
        pose, psi, gc = ARM.forward(q)
        near = ARM.clearance(ARM.inverse(pose, psi, gc, limits=False), aa.Scene(shapes))
        if HARD < near.distance < 0.08:
            found += 1
            yield q, pose, gc, shapes


@pytest.mark.parametrize("policy", [aa.Repulsion(), aa.Hold(), aa.Centre()], ids=repr)
def test_resolve_is_the_step_s_arm_angle_with_a_soft_clearance_too(policy: Any) -> None:
    """`resolve` with a soft clearance gives the psi of `step`, and another than without."""
    differ = 0
    for q, pose, gc, shapes in cases(5):
        scene = aa.Scene(shapes, clearance=HARD, soft=SOFT)
        psi = float(ARM.forward(q)[1])
        found = aa.resolve(ARM.with_(scene=scene), np.stack([pose, pose]), psi, gc, policy=policy)
        taken = aa.step(ARM.with_(scene=scene), q, pose, gc=gc, policy=policy, max_joint_step=3.0)
        beside = np.abs(np.sin(q[[1, 5]])).min() < 0.25  # there a step keeps near the present posture
        if taken.status == aa.Status.OK and not beside:
            assert abs(np.angle(np.exp(1j * (found.psi - taken.psi)))).max() < 1e-12
        hard = aa.resolve(ARM.with_(scene=aa.Scene(shapes, clearance=HARD)), pose, psi, gc, policy=policy)
        differ += abs(hard.psi - found.psi[0]) > 1e-6
    assert differ > 1


@pytest.mark.parametrize("policy", [aa.Repulsion(), aa.Hold(), aa.Repulsion(outside="stop")], ids=repr)
def test_it_is_reached_where_the_arc_holds_it_and_the_hard_one_is_never_left(policy: Any) -> None:
    """`follow` at one pose reaches the soft clearance if its arc has it, stays there, and keeps the
    hard one.
    """
    reached = 0
    for q, pose, gc, shapes in cases(1):
        scene = aa.Scene(shapes, clearance=HARD, soft=SOFT)
        poses = np.tile(pose, (150, 1, 1))
        path = aa.follow(ARM.with_(scene=scene), poses, start=q, policy=policy, max_joint_step=0.05)
        assert path.ok, path.explain()
        apart = ARM.clearance(ARM.inverse(poses, path.psi, path.gc, limits=False), scene).distance
        assert apart.min() >= HARD - 1e-12
        assert np.abs(np.diff(path.q, axis=0)).max() <= 0.05 + 1e-12
        psi = float(ARM.forward(q)[1])
        hard = ARM.with_(scene=aa.Scene(shapes, clearance=HARD)).feasible(pose, gc)
        soft = ARM.with_(scene=aa.Scene(shapes, clearance=HARD + SOFT)).feasible(pose, gc)
        here = [arc for arc in hard if psi in aa.ArcSet([arc])] if not hard.is_full else list(hard)
        both = aa.ArcSet(np.array(here[:1])) & soft
        if both.count:
            assert apart[-1] >= HARD + SOFT - 1e-9
            inside = apart >= HARD + SOFT - 1e-9
            assert inside[int(inside.argmax()) :].all()  # once there, it stays
            reached += not inside[0]
    assert reached > 1


def test_without_room_it_is_as_if_there_were_none() -> None:
    """A soft clearance that no psi has changes nothing in `step`."""
    for q, pose, gc, shapes in cases(2):
        plain, wide = (aa.Scene(shapes, clearance=HARD, soft=soft) for soft in (0.0, 2.0))
        one, other = (aa.step(ARM.with_(scene=scene), q, pose, gc=gc) for scene in (plain, wide))
        assert (one.q == other.q).all() and one.status == other.status


def test_a_soft_clearance_of_0_changes_no_bit() -> None:
    """`follow` with soft=0 gives the joints of a scene without it."""
    for q, pose, _, shapes in cases(3):
        poses = np.tile(pose, (10, 1, 1))
        poses[:, 0, 3] += np.linspace(0, 0.01, 10)
        one, other = (
            aa.follow(ARM.with_(scene=aa.Scene(shapes, clearance=HARD, **soft)), poses, start=q)
            for soft in ({}, {"soft": 0.0})
        )
        assert np.array_equal(one.q, other.q, equal_nan=True)


@pytest.mark.parametrize("lookahead", [0, 20])
def test_along_a_path_the_hard_clearance_is_kept_and_more_is_kept_than_without(lookahead: int) -> None:
    """`follow` keeps the hard clearance, and with `soft` more rows keep that too."""
    gained = []
    for q, pose, _, shapes in cases(4):
        poses = np.tile(pose, (80, 1, 1))
        poses[:, 2, 3] += np.linspace(0, 0.08, 80)
        scenes = [aa.Scene(shapes, clearance=HARD, soft=soft) for soft in (0.0, SOFT)]
        paths = [aa.follow(ARM.with_(scene=scene), poses, start=q, lookahead=lookahead) for scene in scenes]
        if not all(path.ok for path in paths):
            continue
        apart = [ARM.clearance(path.q, aa.Scene(shapes)).distance for path in paths]
        assert min(one.min() for one in apart) >= HARD - 1e-12
        gained.append(float((apart[1] >= HARD + SOFT).mean() - (apart[0] >= HARD + SOFT).mean()))
    assert len(gained) > 3 and np.mean(gained) >= 0 and max(gained) > 0, gained


def test_the_policy_goes_on_from_the_soft_end_so_that_repulsion_is_no_nearer_than_without() -> None:
    """With `soft` a path by Repulsion does not end nearer to obstacles than without, but for 1 cm."""
    for q, pose, _, shapes in cases(5):
        poses = np.tile(pose, (100, 1, 1))
        poses[:, 1, 3] += np.linspace(0, 0.05, 100)
        scenes = [aa.Scene(shapes, clearance=HARD, soft=soft) for soft in (0.0, SOFT)]
        paths = [aa.follow(ARM.with_(scene=scene), poses, start=q) for scene in scenes]
        if all(path.ok for path in paths):
            ends = [(path.psi[-1], path.gc[-1]) for path in paths]
            last = [
                ARM.clearance(ARM.inverse(poses[-1], psi, gc, limits=False), scenes[0]).distance
                for psi, gc in ends
            ]
            assert last[1] >= min(last[0] - 0.01, HARD + SOFT - 1e-9), last


def test_a_scene_file_states_the_soft_clearance(tmp_path: Any) -> None:
    """`load_scene` reads `soft`, which may not be negative."""
    text = "clearance = 0.01\nsoft = 0.04\n[[ball]]\ncenter = [0, 0, 1]\nradius = 0.1"
    (tmp_path / "cell.toml").write_text(text)
    wanted = aa.Scene([aa.Ball([0, 0, 1], 0.1)], clearance=0.01, soft=0.04)
    assert aa.io.load_scene(tmp_path / "cell.toml") == wanted
    with pytest.raises(aa.errors.SceneError, match=r"Scene: soft is -0\.1"):
        aa.Scene(soft=-0.1)
