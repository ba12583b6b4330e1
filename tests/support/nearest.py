"""Questions that `solve` is tried on, and the naive way beside it: a dense grid, then polished."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

import armangle as aa

from .strategies import Array, generated_arm

GOLDEN = (np.sqrt(5) - 1) / 2
POLISHES = 60


@dataclass(frozen=True)
class Case:
    """One question; `number` says which."""

    number: int
    arm: aa.Arm
    pose: Array
    near: Array
    weight: Array
    metric: Literal["l2", "max"]
    prefer: Literal["near", "margin"]

    def __str__(self) -> str:
        return f"{self.number}-{self.prefer}-{self.metric}"

    def solve(self) -> aa.Solution:
        return self.arm.solve(
            self.pose, self.near, metric=self.metric, weight=self.weight, prefer=self.prefer
        )

    def solutions(self) -> aa.Solutions:
        return self.arm.solutions(
            self.pose, self.near, metric=self.metric, weight=self.weight, prefer=self.prefer
        )

    def costs(self, q: Array) -> Array:
        """Return what postures (..., 7) cost; infinite beyond the limits."""
        within = self.arm.within_limits(q, 1e-11)
        if self.prefer == "margin":
            return np.where(within, -self.arm.limit_margin(q), np.inf)
        off = np.sqrt(self.weight) * np.abs(q - self.near)
        cost = np.linalg.norm(off, axis=-1) if self.metric == "l2" else off.max(axis=-1)
        return np.where(within, cost, np.inf)


def _arm(rng: np.random.Generator, number: int) -> aa.Arm:
    """The iiwa, one of the catalogue, or an arm of any lengths, offsets, signs and limits."""
    if number % 6 == 0:
        return aa.Arm.from_catalogue("kuka_iiwa7_r800")
    if number % 6 == 1:
        return aa.Arm.from_catalogue(str(rng.choice(aa.catalogue())))
    arm = generated_arm(int(rng.integers(1 << 30)))
    if number % 6 > 3:
        return arm
    # limits of one sign, of more than a turn, or none
    middle, half = rng.uniform(-2, 2, 7), rng.uniform(0.3, 4.5, 7)
    middle[3], half[3] = (arm.lower[3] + arm.upper[3]) / 2, (arm.upper[3] - arm.lower[3]) / 2
    half = np.where((rng.random(7) < 0.1) & (np.arange(7) != 3), np.inf, half)
    return arm.with_(lower=middle - half, upper=middle + half)


def cases(count: int, seed: int) -> list[Case]:
    """Return random cases: seeds anywhere or beside the posture, poses regular, singular, stretched."""
    out: list[Case] = []
    for number in range(count):
        rng = np.random.default_rng([number, seed, 77])
        arm = _arm(rng, number)
        low, high = np.maximum(arm.lower, -4.0), np.minimum(arm.upper, 4.0)
        q, near = rng.uniform(low, high, (2, 7))
        straight = arm.signs * (np.array([0, 0, 0, arm.delta, 0, 0, 0]) - arm.offsets)
        singular = {1: [1], 2: [5], 3: [1, 5], 4: [1, 3]}.get(int(rng.integers(12)), [])
        q[singular] = straight[singular]
        if rng.random() < 0.25:
            near = q + rng.normal(0, 0.05, 7)
        pose = arm.forward(q, undefined="nan")[0]
        weight = rng.uniform(0, 2, 7) if rng.random() < 0.3 else np.ones(7)
        metric: Any = rng.choice(["l2", "l2", "max"])
        prefer: Any = rng.choice(["near", "near", "near", "margin"])
        out.append(Case(number, arm, pose, near, weight, str(metric), str(prefer)))  # type: ignore[arg-type]
    return out


def brute_force(case: Case, grid: int) -> float:
    """Return the least cost on a grid of psi in all branches, its best points polished by golden section."""
    psi = np.linspace(-np.pi, np.pi, grid, endpoint=False)
    step = 2 * np.pi / grid
    arm, best = case.arm, np.inf
    two = np.isfinite(arm.lower) & np.isfinite(arm.upper)
    seed = np.where(two, (np.where(two, arm.lower, 0.0) + np.where(two, arm.upper, 0.0)) / 2, 0.0)
    seed = seed if case.prefer == "margin" else case.near

    def at(gc: int, angle: Array) -> Array:
        poses = np.broadcast_to(case.pose, (*angle.shape, 4, 4))
        return case.costs(arm.inverse(poses, angle, gc, seed=seed, unreachable="nan"))

    for gc in range(8):
        arcs = arm.feasible(case.pose, gc)
        if arcs.is_empty:
            continue
        on_grid = np.where(arcs.contains(psi), at(gc, psi), np.inf)
        ends = at(gc, arcs.intervals.ravel())
        best = min(best, float(on_grid.min()), float(ends.min()))
        low = np.flatnonzero((on_grid <= np.roll(on_grid, 1)) & (on_grid <= np.roll(on_grid, -1)))
        low = low[on_grid[low] < best + 0.2][:40]
        if not len(low):
            continue
        a, b = psi[low] - step, psi[low] + step
        for _ in range(POLISHES):
            x, y = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
            fx, fy = (np.where(arcs.contains(z), at(gc, z), np.inf) for z in (x, y))
            left = fx < fy
            a, b = np.where(left, a, x), np.where(left, y, b)
            best = min(best, float(fx.min()), float(fy.min()))
    return best
