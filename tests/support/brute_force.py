"""A planner that tests every posture of a fine grid: slow, plain, and independent of arcs and tubes."""

from __future__ import annotations

import numpy as np

import armangle as aa

STEPS, GRID, MOVE = 120, 180, 0.35


def margins(arm: aa.Arm, q: np.ndarray) -> np.ndarray:
    """Least distance (...), rad, of joints (..., 7) to a limit or singularity; negative outside the
    limits.
    """
    theta = arm.geometry.signs * q + arm.geometry.offsets
    sines = np.abs(np.sin(theta[..., [1, 3, 5]] - [0.0, arm.geometry.delta, 0.0]))
    limits = np.minimum(q - arm.lower, arm.upper - q).min(axis=-1)
    return np.minimum(limits, np.arcsin(sines).min(axis=-1))


def finds_a_way(arm: aa.Arm, path: aa.Path, gc: int, margin: float, start: np.ndarray | None = None) -> bool:
    """Whether solutions in branch gc on a grid of psi connect s = 0 and 1 in steps below MOVE, all with at
    least `margin` (rad) to limits and singularities, the first within MOVE of `start` if it is given.
    """
    grid = np.linspace(-np.pi, np.pi, GRID, endpoint=False)
    before = live = None
    for s in np.linspace(0, 1, STEPS):
        pose = path.pose(s)
        try:
            q = arm.inverse(pose, grid, gc, limits=False)
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


def planar_motion(arm: aa.Arm, rng: np.random.Generator) -> tuple[aa.Line, np.ndarray]:
    """A random line in the plane of joints 2, 4, 6, and joints (201, 7) along it from plane trigonometry,
    0.03 rad within the limits; for an arm as the iiwa, without elbow offset, base and tool.
    """
    s, bend = np.linspace(0, 1, 201), [1, 3, 5]
    while True:
        start = np.zeros(7)
        start[bend] = rng.uniform(arm.lower[bend] + 0.05, arm.upper[bend] - 0.05)
        first = arm.forward(start)[0]
        last = first.copy()
        way, length = rng.uniform(0, 2 * np.pi), rng.uniform(0.1, 0.4)
        last[[0, 2], 3] += length * np.array([np.cos(way), np.sin(way)])
        path = aa.Line(first, last)
        pose = path.pose(s)
        wrist = pose[:, :3, 3] - pose[:, :3, 2] * arm.geometry.d_wf - [0, 0, arm.geometry.d_bs]
        cosine = ((wrist**2).sum(axis=1) - arm.geometry.d_se**2 - arm.geometry.d_ew**2) / (
            2 * arm.geometry.d_se * arm.geometry.d_ew
        )
        if (np.abs(cosine) > 0.9995).any():
            continue
        elbow = np.sign(start[3]) * np.arccos(cosine)
        lean = np.arctan2(
            arm.geometry.d_ew * np.sin(elbow), arm.geometry.d_se + arm.geometry.d_ew * np.cos(elbow)
        )
        for sign in (-1, 1):
            q = np.zeros((len(s), 7))
            q[:, 1] = np.unwrap(np.arctan2(wrist[:, 0], wrist[:, 2]) - sign * lean)
            q[:, 3] = elbow
            tool = np.arctan2(pose[:, 0, 2], pose[:, 2, 2])
            for turn in (-1, 1):
                q[:, 5] = np.unwrap(turn * (tool - q[:, 1] - sign * elbow))
                q[:, 5] += start[5] - q[0, 5]
                right = np.abs(q[0] - start).max() < 1e-9 and np.abs(arm.forward(q)[0] - pose).max() < 1e-9
                calm = np.abs(np.diff(q, axis=0)).max() <= 0.1
                if right and calm and np.minimum(q - arm.lower, arm.upper - q).min() > 0.03:
                    return path, q


def turned_at_standing_tool(
    arm: aa.Arm, start: np.ndarray, move: float = 0.4, shown: int = 20
) -> list[np.ndarray]:
    """About `shown` configurations that the self-motion of `start` reaches in both directions, within limits
    and without a step of `move` (rad).
    """
    pose, psi, gc = arm.forward(start)
    found: list[np.ndarray] = []
    for way in (1, -1):
        q = np.asarray(
            arm.inverse(pose, psi + way * np.linspace(0, 2 * np.pi, 4001)[1:], gc, seed=start, limits=False)
        )
        q = np.unwrap(np.vstack([start, q]), axis=0)[1:]
        steps = np.abs(np.diff(np.vstack([start, q]), axis=0)).max(axis=1)
        good = arm.within_limits(q) & (steps < move)
        end = len(q) if good.all() else int(np.argmin(good))
        found.extend(q[:end][:: max(1, end // (shown // 2))])
    return found
