"""A tracker at a home posture moves its joints no more than damped least squares by hand do."""

from __future__ import annotations

import numpy as np
import pytest
from support.moves import begun
from support.strategies import Array

import armangle as aa

RATE, SWING, COUNT = 500, 0.03, 1500  # ticks a second, m and rad/s, ticks
HOMES = [
    ("kuka_iiwa14_r820", [0, 0, 0, -90, 0, 90, 0]),
    ("kuka_iiwa14_r820", [0, 30, 0, -60, 0, 0, 0]),
    ("realman_rm75_b", [0, 0, 0, 90, 0, 90, 0]),
    ("schunk_lwa4d", [0, 0, 0, 90, 0, 90, 0]),
]


def hands(pose: Array, way: Array) -> Array:
    """The poses of a hand that swings out and back along `way` without turning."""
    out = np.repeat(pose[None], COUNT, axis=0)
    out[:, :3, 3] += SWING * np.sin(np.arange(COUNT) / RATE)[:, None] * way
    return out


def by_hand(arm: aa.Arm, q: Array, poses: Array) -> Array:
    """The joints (n + 1, 7) of damped least squares with two rounds a cycle."""
    rows = [q]
    for pose in poses:
        q = rows[-1].copy()
        for _ in range(2):
            here, J = arm.forward(q, on_error="nan")[0], arm.jacobian(q)
            turn = 0.5 * sum(np.cross(here[:3, i], pose[:3, i]) for i in range(3))
            off = np.concatenate([pose[:3, 3] - here[:3, 3], turn])
            q = q + J.T @ np.linalg.solve(J @ J.T + 1e-6 * np.eye(6), off)
        rows.append(q)
    return np.array(rows)


@pytest.mark.turns(4)
@pytest.mark.parametrize(("name", "home"), HOMES)
@pytest.mark.parametrize("way", [[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.3, -1.0, 0.5]])
def test_from_home_joints_go_the_least_way(name: str, home: list[float], way: list[float]) -> None:
    """From home a tracker's joints travel at most 1.3 times as far as those of damped least squares."""
    arm, q = aa.Arm.from_catalogue(name), np.radians(home)
    poses = hands(arm.forward(q, on_error="nan")[0], np.array(way))
    tracker = begun(q, arm, 1 / RATE)
    ticks = [tracker.step(pose) for pose in poses]
    rows = np.array([q, *(tick.q for tick in ticks)])
    assert max(tick.distance for tick in ticks[300:]) <= 1e-9  # it is caught up with
    wanted = by_hand(arm, q, poses)
    moves, least = (np.abs(np.diff(each, axis=0)) for each in (rows, wanted))
    assert moves.sum() <= 1.3 * least.sum()
    assert moves.sum(axis=0).max() <= least.sum(axis=0).max() + np.radians(8)
    assert moves.max() * RATE <= 3 * least.max() * RATE
