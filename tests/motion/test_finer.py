"""`JointPath.finer`: rows between the rows of a motion."""

from __future__ import annotations

import numpy as np
import pytest
from support.moves import refused
from support.strategies import Array

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.6, 0.3, 0.8, 0.5])
SHIFTS = ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.15, 0.0), (0.0, 0.15, 0.1))


def corners() -> Array:
    """Four poses, for a path with corners."""
    poses = np.repeat(ARM.forward(Q)[0][None], len(SHIFTS), axis=0)
    poses[:, :3, 3] += SHIFTS
    return poses


def motion(kind: str) -> aa.JointPath:
    """A motion by `plan`, by `follow`, or through joint rows, "joints" or "spline"."""
    if kind == "plan":
        return aa.plan(ARM, corners(), start=Q)
    if kind == "follow":
        return aa.follow(ARM, corners(), start=Q, max_joint_step=2.0)
    between = "joints" if kind == "joints" else "spline"
    return aa.JointPath.from_joints(ARM, [Q, Q + 0.3, Q - 0.2, Q - 0.2], between=between)


@pytest.mark.parametrize("kind", ["plan", "follow", "joints", "spline"])
@pytest.mark.parametrize("step", [0.2, 0.03])
def test_no_joint_moves_farther_and_the_rows_stay(kind: str, step: float) -> None:
    """`finer(step)` keeps all rows and adds some, so that no joint moves by more than `step` (rad)."""
    path = motion(kind)
    found = path.finer(step)
    assert np.abs(np.diff(path.q, axis=0)).max() > step
    assert np.abs(np.diff(found.q, axis=0)).max() <= step + 1e-12
    rows = np.searchsorted(found.s, path.s)
    for name in ("s", "q", "psi", "gc", "poses", "margin", "residual", "status"):
        assert np.array_equal(getattr(found, name)[rows], getattr(path, name)), name
    np.testing.assert_allclose(ARM.forward(found.q)[0], found.poses, atol=1e-9)
    assert np.abs(np.diff(found.psi)).max() < 1  # lifted on
    np.testing.assert_allclose(found.margin, ARM.limit_margin(found.q), atol=1e-12)
    assert found.certified == path.certified and found.ok
    s = np.linspace(0, 1, 77)
    assert np.array_equal(found.at(s).q, path.at(s).q)
    assert len(found.finer(step)) == len(found)


def test_an_arm_angle_that_turns_round_is_lifted_on() -> None:
    """In `finer` psi goes on beyond a turn without jumps of 2π."""
    arm = ARM.with_(lower=np.full(7, -20.0), upper=np.full(7, 20.0))
    q = arm.inverse(
        np.repeat(arm.forward(Q)[0][None], 40, axis=0), np.linspace(0, 3 * np.pi, 40), 2, limits=False
    )
    path = aa.JointPath.from_joints(arm, np.unwrap(q, axis=0))
    found = path.finer(0.05)
    assert np.ptp(found.psi) == pytest.approx(3 * np.pi, abs=1e-6)
    assert np.abs(np.diff(found.psi)).max() < 0.2


def test_a_scene_that_moves_stands_from_row_to_row() -> None:
    """`finer` gives each new row a scene, and keeps scenes and clearances of the old ones."""
    arm = ARM.with_(body=aa.Body.bones(upper_arm=0.05, forearm=0.05))
    scenes = [aa.Scene([aa.Ball([2.0 + k, 0, 0], 0.1, name="ball")]) for k in range(len(SHIFTS))]
    path = aa.follow(arm, corners(), start=Q, max_joint_step=2.0, scene=scenes)
    found = path.finer()
    rows = np.searchsorted(found.s, path.s)
    assert len(found.scenes) == len(found) > len(path)
    assert [found.scenes[k] for k in rows] == list(path.scenes)
    assert np.array_equal(found.clearance[rows], path.clearance)


def test_what_cannot_be_made_finer_is_refused() -> None:
    """`finer` refuses steps out of range, too many rows, and paths that are not solved or empty."""
    for step in (0.0, -1.0, 1e-7, 7.0, np.nan):
        refused(aa.InputError, "step", motion("plan").finer, step)
    arm = ARM.with_(lower=np.full(7, -7.0), upper=np.full(7, 7.0))
    path = aa.JointPath.from_joints(arm, [np.full(7, -6.0), np.full(7, 6.0)], between="joints")
    refused(aa.InputError, "more than 10000000 rows", path.finer, 1e-6)
    poses = corners()
    poses[2, 0, 3] = 3.0
    refused(aa.PathError, "out of reach", aa.plan(ARM, poses, start=Q).finer)
    refused(aa.PathError, "", aa.plan(ARM, poses[:0]).finer)
    assert len(aa.plan(ARM, poses[:1], start=Q).finer()) == 1
