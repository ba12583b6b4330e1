"""The optimum of a plan by brute force: dynamic programming on a grid of psi and s, then a descent."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import armangle as aa

from .naive_plans import EVEN, Case
from .needs import need
from .plan_objective import margin_scale, nearness, singular

GRID, STEPS, WINDOW = 720, 60, 24
"""Arm angles, steps of s, and how many angles psi may go on in one of them."""
MOVE = 0.6
"""Most that a joint moves in one step, rad."""
MOVING = [0, 1, 2, 4, 5, 6]


class Best(NamedTuple):
    """The cheapest way on the grid: its branch, and psi (stereographic, lifted) at the steps."""

    cost: float
    gc: int
    psi: np.ndarray


def near(case: Case, q: np.ndarray) -> np.ndarray:
    """The cost (...) of joints (..., 7) for being near limits (but those of joint 4) and the singularities of
    joints 2 and 6; infinite beyond limits or margins.
    """
    arm, weights = case.arm, case.objective
    hinges = np.abs(np.angle(np.exp(1j * (arm.geometry.signs * q + arm.geometry.offsets)[..., [1, 5]])))
    room = np.concatenate([q - arm.lower, arm.upper - q], axis=-1) - case.limit_margin
    free = room[..., MOVING + [7 + j for j in MOVING]]
    clear = np.concatenate([hinges, np.pi - hinges], axis=-1) - case.singularity_margin
    inside = (room > 1e-6).all(axis=-1) & (clear > 1e-4).all(axis=-1)
    cost = weights.limits * nearness(free, weights.enough)
    return np.where(inside, cost + weights.singularities * singular(clear, weights.enough), np.inf)


def shares(case: Case) -> np.ndarray:
    """The weights (STEPS + 1,) of the costs of `near` in the integral over s."""
    out = np.full(STEPS + 1, margin_scale(case.arm, case.path) / STEPS)
    out[[0, -1]] /= 2
    return out


def search(case: Case) -> Best | None:
    """The best path on the grid over all branches, or from the start in its branch; None if there is none.
    The goal of the case is ignored.
    """
    arm = case.arm.with_(reference="stereographic")
    branches = range(8) if case.start is None else [int(arm.forward(case.start)[2])]
    found = [way for gc in branches if (way := _in_branch(case, arm, gc)) is not None]
    return min(found, key=lambda way: way.cost, default=None)


def _in_branch(case: Case, arm: aa.Arm, gc: int) -> Best | None:
    """The best path on the grid in one branch by dynamic programming; None if there is none."""
    grid = np.linspace(-np.pi, np.pi, GRID, endpoint=False)
    poses = case.path.pose(np.linspace(0, 1, STEPS + 1))
    weight, own = case.objective.travel * STEPS, shares(case)
    back: list[np.ndarray] = []
    for k, pose in enumerate(poses):
        q = arm.inverse(pose, grid, gc, on_error="nan", limits=False)
        if k == 0 and case.start is not None:
            q = np.broadcast_to(case.start, q.shape)
        if not np.isfinite(q).all():
            return None
        here = near(case, q) * own[k]
        if k == 0:
            cost, before = here, q
            continue
        best, way = np.full(GRID, np.inf), np.zeros(GRID, int)
        shifts = range(-WINDOW, WINDOW + 1) if k > 1 or case.start is None else [0]
        for shift in shifts:
            at = (np.arange(GRID) + shift) % GRID
            step = q - before[at]
            total = cost[at] + weight * (step**2).sum(axis=1)
            better = (total < best) & (np.abs(step).max(axis=1) < MOVE)
            best[better], way[better] = total[better], at[better]
        back.append(way)
        cost, before = best + here, q
    if not np.isfinite(cost).any():
        return None
    at = int(np.argmin(cost))
    least, psi = float(cost[at]), [grid[at]]
    for way in reversed(back):
        at = int(way[at])
        psi.append(grid[at])
    if case.start is not None:
        psi[-1] = float(arm.forward(case.start)[1])
    return Best(least, gc, np.unwrap(psi[::-1]))


def descend(case: Case, way: Best) -> np.ndarray:
    """The joints (SAMPLES, 7) of the path after Gauss-Newton steps on psi that begin at `way`."""
    arm, weight, own = case.arm.with_(reference="stereographic"), case.objective.travel * STEPS, shares(case)
    s, probe, fixed = np.linspace(0, 1, STEPS + 1), 1e-4, case.start is not None
    poses, psi, damping = case.path.pose(s), way.psi, 1e-3

    def joints(angles: np.ndarray) -> np.ndarray:
        """The joints at arm angles (STEPS + 1,); with a start also without jumps by 2π."""
        q = arm.inverse(poses, angles, way.gc, limits=False)
        if case.start is not None:
            q[0] = case.start
        return np.unwrap(q, axis=0) if fixed else q

    def total(q: np.ndarray) -> float:
        """The objective of joints at the steps."""
        return float(weight * (np.diff(q, axis=0) ** 2).sum() + (near(case, q) * own).sum())

    energy = total(joints(psi))
    for _ in range(80):
        q, over, under = joints(psi), joints(psi + probe), joints(psi - probe)
        slope = (over - under) / (2 * probe)
        here, above, below = (near(case, x) * own for x in (q, over, under))
        gradient = np.nan_to_num((above - below) / (2 * probe), posinf=0, neginf=0)
        curved = np.nan_to_num((above + below - 2 * here) / probe**2, posinf=0, neginf=0)
        hessian, step = np.diag(np.maximum(curved, 0)), np.diff(q, axis=0)
        gradient[:-1] -= 2 * weight * (step * slope[:-1]).sum(axis=1)
        gradient[1:] += 2 * weight * (step * slope[1:]).sum(axis=1)
        size, k = 2 * weight * (slope**2).sum(axis=1), np.arange(STEPS)
        hessian[k, k] += size[:-1]
        hessian[k + 1, k + 1] += size[1:]
        hessian[k, k + 1] -= 2 * weight * (slope[:-1] * slope[1:]).sum(axis=1)
        hessian[k + 1, k] = hessian[k, k + 1]
        if fixed:
            gradient[0] = hessian[0, 1:] = hessian[1:, 0] = 0
            hessian[0, 0] = 1
        gain = 0.0
        for _ in range(6):
            move = -np.linalg.solve(hessian + np.diag(damping * np.diag(hessian) + 1e-9), gradient)
            move *= min(1.0, 0.3 / max(np.abs(move).max(), 1e-12))
            gain = energy - total(joints(psi + move))
            if gain > 0:
                psi, energy, damping = psi + move, energy - gain, max(damping * 0.2, 1e-8)
                break
            damping *= 10
        if not gain > 1e-7 * energy:
            break
    smooth = need("scipy.interpolate").CubicSpline(s, psi)(EVEN)
    return np.unwrap(arm.inverse(case.path.pose(EVEN), smooth, way.gc, limits=False), axis=0)
