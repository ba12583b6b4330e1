"""A planner that tests every posture of a fine grid: slow, plain, and independent of arcs and tubes."""

from __future__ import annotations

import numpy as np

import armangle as aa

STEPS, GRID, MOVE = 120, 180, 0.35


def margins(arm: aa.Arm, q: np.ndarray) -> np.ndarray:
    """Least distance to limits and singularities of joints (..., 7), rad; negative outside."""
    theta = arm.signs * q + arm.offsets
    sines = np.abs(np.sin(theta[..., [1, 3, 5]] - [0.0, arm.delta, 0.0]))
    limits = np.minimum(q - arm.lower, arm.upper - q).min(axis=-1)
    return np.minimum(limits, np.arcsin(sines).min(axis=-1))


def finds_a_way(arm: aa.Arm, path: aa.Path, gc: int, margin: float, start: np.ndarray | None = None) -> bool:
    """Whether postures on a grid of psi join up from s = 0 to 1, all `margin` (rad) within their limits."""
    grid = np.linspace(-np.pi, np.pi, GRID, endpoint=False)
    before = live = None
    for s in np.linspace(0, 1, STEPS):
        pose = path.pose(s)
        try:
            q = arm.inverse(pose, grid, gc)
        except aa.UnreachableError:
            return False
        good = margins(arm, q) >= margin
        if before is None:
            if start is not None:
                good &= np.abs(q - start).max(axis=1) < MOVE
        else:
            near = np.abs(q[:, None] - before[None]).max(axis=2) < MOVE
            good &= (near & live[None]).any(axis=1)
        if not good.any():
            return False
        before, live = q, good
    return True
