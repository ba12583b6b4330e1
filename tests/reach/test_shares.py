"""Shares of what is reached that were counted in other ways: by a grid of arm angles, by another program."""

from __future__ import annotations

import numpy as np
import pytest
from support import draw

import armangle as aa
from armangle.reach.voxels import even_orientations

ORIENTATIONS = 2000
# Of that many even orientations of the flange at a point (m, from the base), those that are held.
HELD = {
    "kuka_iiwa7_r800": ([0.5, 0.0, 0.4], 1762),
    "openarm_v10": ([0.15, 0.25, 0.1], 1096),
    "human_arm_left": ([0.25, 0.15, -0.1], 1119),
}
# Of the poses that joints 2 to 6 reach, the share that the limits of joints 1 and 7 forbid, as counted with
# another implementation and another sample: what a table errs by that takes these joints to turn fully.
FORBIDDEN = {
    "kuka_iiwa7_r800": 0.0, "barrett_wam7": 0.0018, "yaskawa_sia5d": 0.098, "openarm_v10": 0.446,
    "human_arm_left": 0.523,
}  # fmt: skip


def oriented(place: list[float], count: int) -> np.ndarray:
    """Poses at a point, in even orientations."""
    poses = aa.pose(np.zeros(3), wxyz=even_orientations(count))
    poses[:, :3, 3] = place
    return poses


@pytest.mark.parametrize("name", HELD)
def test_the_share_of_orientations_at_a_point(name: str) -> None:
    """`reachable` holds as many even orientations as counted before, and all that a grid of psi holds."""
    arm, (place, golden) = aa.Arm.from_catalogue(name), HELD[name]
    poses = oriented(place, ORIENTATIONS)
    held = np.asarray(arm.reachable(poses))
    assert held.sum() == golden
    psi = np.linspace(-np.pi, np.pi, 720, endpoint=False)
    some = np.arange(0, ORIENTATIONS, 8)
    found = np.zeros(len(some), bool)
    for gc in range(8):
        q = arm.inverse(poses[some, None], psi, gc, on_error="nan", limits=False)
        found |= (np.isfinite(q[..., 0]) & arm.within_limits(np.nan_to_num(q, nan=99.0))).any(axis=1)
    assert not (found & ~held[some]).any()
    thin = arm.freedom(poses[some][held[some] & ~found])  # between two angles of the grid
    assert (thin.widest < 2 * np.pi / 720).all() and len(thin.gc) < 0.02 * len(some)


@pytest.mark.parametrize("name", FORBIDDEN)
def test_what_a_table_errs_by_that_takes_joints_1_and_7_to_turn_fully(name: str) -> None:
    """Limits of joints 1 and 7 forbid the share of poses that was counted otherwise, within 0.02."""
    arm, rng, count = aa.Arm.from_catalogue(name), draw.generator(16, 50), draw.count(20_000)
    place = rng.normal(size=(count, 3))
    place *= (
        arm.geometry.reach * np.cbrt(rng.random((count, 1))) / np.linalg.norm(place, axis=1, keepdims=True)
    )
    turned = rng.normal(size=(count, 4))
    poses = aa.pose(np.zeros(3), wxyz=turned / np.linalg.norm(turned, axis=1, keepdims=True))
    poses[:, :3, 3] = place + [0.0, 0.0, arm.geometry.d_bs] + arm.geometry.d_wf * poses[:, :3, 2]
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[[0, 6]], upper[[0, 6]] = -np.inf, np.inf
    poses = arm.base @ poses @ arm.tool
    table = np.asarray(arm.with_(lower=lower, upper=upper).reachable(poses))
    exact = np.asarray(arm.reachable(poses))
    assert not (exact & ~table).any()
    assert (table & ~exact).sum() / table.sum() == pytest.approx(FORBIDDEN[name], abs=0.02)
    assert (table & ~exact).any() == (FORBIDDEN[name] > 0)
