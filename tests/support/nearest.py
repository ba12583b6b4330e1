"""Questions that `solve` is tried on, and the naive way beside it: a dense grid, then polished."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import armangle as aa
from armangle.models.catalogue import srs_catalogue

from .strategies import Array, generated_arm

GOLDEN = (np.sqrt(5) - 1) / 2
POLISHES = 60
SLACK = 1e-14  # rad beyond a limit, of rounding: more would let the grid pass an end that solve keeps


@dataclass(frozen=True)
class Case:
    """Arguments of `solve`, numbered."""

    number: int
    arm: aa.Arm
    pose: Array
    near: Array
    weight: Array
    metric: Literal["l2", "max"]
    prefer: Literal["seed", "margin"]
    gc: tuple[int, ...] = tuple(range(8))
    allowed: aa.ArcSet | None = None
    singularity_margin: float = 0.0
    straight: tuple[int, ...] = ()
    """Which of joints 2, 4, 6 are exactly singular in the posture that the pose came from, counted from 0."""

    def kinds(self) -> list[str]:
        """Return in words what makes the case hard."""
        arm = self.arm
        hard = {
            "with an offset elbow": bool(arm.geometry.a_3 or arm.geometry.a_4),
            "with limits of one sign": bool(((arm.lower > 0) | (arm.upper < 0)).any()),
            "with a range over a turn": bool((arm.upper - arm.lower > 2 * np.pi).any()),
            "exactly singular": bool(self.straight),
        }
        return [kind for kind, is_so in hard.items() if is_so]

    def __str__(self) -> str:
        return f"{self.number}-{self.prefer}-{self.metric}"

    def _asked(self) -> dict[str, Any]:
        """Return the keyword arguments of `solve`."""
        return {
            "metric": self.metric, "weight": self.weight, "prefer": self.prefer, "gc": self.gc,
            "allowed": self.allowed,
        }  # fmt: skip

    def keeping(self) -> aa.Arm:
        """Return the arm with the case's singularity margin."""
        return self.arm.with_(singularity_margin=self.singularity_margin)

    def solve(self) -> aa.Solution:
        """Solve the case."""
        return self.keeping().solve(self.pose, self.near, **self._asked())

    def solutions(self) -> aa.types.Solutions:
        """Return all solutions of the case."""
        return self.keeping().solutions(self.pose, self.near, **self._asked())

    def arcs(self) -> aa.ArcSet:
        """Return the permitted arm angles of each of the 8 branches, whatever `gc`."""
        arcs = self.keeping().feasible(self.pose)
        return arcs if self.allowed is None else arcs & self.allowed

    def costs(self, q: Array) -> Array:
        """Return the costs of joint values (..., 7); infinite outside the limits."""
        within = self.arm.within_limits(q, SLACK)
        if self.prefer == "margin":
            return np.where(within, -self.arm.limit_margin(q), np.inf)
        off = np.sqrt(self.weight) * np.abs(q - self.near)
        cost = np.linalg.norm(off, axis=-1) if self.metric == "l2" else off.max(axis=-1)
        return np.where(within, cost, np.inf)


def cost_of(case: Case, found: aa.Solution) -> float:
    """Return the cost of a solution."""
    return float(-found.margin if case.prefer == "margin" else found.distance)


def least_beside(case: Case, count: int) -> float:
    """Return the least cost that `solve` finds over `count` poses that differ from the case's by rounding.

    Within 1e-11 rad of a singular arm angle joints turn by so much that the pose's last digit decides.
    """
    rng = np.random.default_rng(case.number)
    least = np.inf
    for _ in range(count):
        pose = case.pose.copy()
        pose[:3] *= 1 + rng.choice([-1, 0, 1], size=(3, 4)) * np.finfo(float).eps / 2
        found = replace(case, pose=pose).solve()
        least = min(least, cost_of(case, found) if found.ok else np.inf)
    return least


def _arm(rng: np.random.Generator, number: int) -> aa.Arm:
    """An arm of the catalogue, or one with random lengths, offsets, signs and limits."""
    if number % 6 == 0:
        return aa.Arm.from_catalogue("kuka_iiwa7_r800")
    if number % 6 == 1:
        return aa.Arm.from_catalogue(str(rng.choice(srs_catalogue())))
    arm = generated_arm(int(rng.integers(1 << 30)))
    if number % 6 > 3:
        return arm
    # limits of one sign, of more than a turn, or none
    middle, half = rng.uniform(-2, 2, 7), rng.uniform(0.3, 4.5, 7)
    middle[3], half[3] = (arm.lower[3] + arm.upper[3]) / 2, (arm.upper[3] - arm.lower[3]) / 2
    half = np.where((rng.random(7) < 0.1) & (np.arange(7) != 3), np.inf, half)
    return arm.with_(lower=middle - half, upper=middle + half)


def cases(count: int, seed: int) -> list[Case]:
    """Return random cases: poses regular, singular or stretched, seeds anywhere or near a solution."""
    out: list[Case] = []
    for number in range(count):
        rng = np.random.default_rng([number, seed, 77])
        arm = _arm(rng, number)
        low, high = np.maximum(arm.lower, -4.0), np.minimum(arm.upper, 4.0)
        q, near = rng.uniform(low, high, (2, 7))
        straight = arm.geometry.signs * (
            np.array([0, 0, 0, arm.geometry.delta, 0, 0, 0]) - arm.geometry.offsets
        )
        singular = {1: [1], 2: [5], 3: [1, 5], 4: [1, 3]}.get(int(rng.integers(12)), [])
        q[singular] = straight[singular]
        if rng.random() < 0.25:
            near = q + rng.normal(0, 0.05, 7)
        pose = arm.forward(q, on_error="nan")[0]
        weight = rng.uniform(0, 2, 7) if rng.random() < 0.3 else np.ones(7)
        metric: Any = str(rng.choice(["l2", "l2", "max"]))
        prefer: Any = str(rng.choice(["seed", "seed", "seed", "margin"]))
        out.append(Case(number, arm, pose, near, weight, metric, prefer, straight=tuple(singular)))
    return out


def narrowed(case: Case) -> Case:
    """Return the case with a random choice of branches, allowed arcs (or all) and singularity margin
    (or 0).
    """
    rng = np.random.default_rng([case.number, 5])
    gc = tuple(np.flatnonzero(rng.random(8) < 0.5).tolist()) or (int(rng.integers(8)),)
    lower = rng.uniform(-np.pi, np.pi, 2)
    arcs = aa.ArcSet(np.stack([lower, lower + rng.uniform(0.2, 2.0, 2)], axis=-1))
    margin = float(rng.choice([0.0, 0.05, 0.4]))
    return replace(case, gc=gc, allowed=arcs if rng.random() < 0.7 else None, singularity_margin=margin)


def brute_force(case: Case, grid: int) -> float:
    """Return the least cost on `grid` arm angles in the case's branches, improved by golden section; infinite
    if there is none.
    """
    psi = np.linspace(-np.pi, np.pi, grid, endpoint=False)
    arm, arcs = case.arm, case.arcs()
    gc = np.array([one for one in case.gc if not arcs[one].is_empty], dtype=np.int64)
    if not len(gc):
        return np.inf
    two = np.isfinite(arm.lower) & np.isfinite(arm.upper)
    middle = (np.where(two, arm.lower, 0.0) + np.where(two, arm.upper, 0.0)) / 2
    seed = middle if case.prefer == "margin" else case.near

    def at(gc: NDArray[np.int64], angle: Array) -> Array:
        """The costs at arm angles in branches."""
        return case.costs(arm.inverse(case.pose, angle, gc, seed=seed, on_error="nan", limits=False))

    on_grid = np.where(arcs[gc][:, None].contains(psi), at(gc[:, None], psi), np.inf)
    least = on_grid.min()
    for one in gc:
        least = min(least, at(one, arcs[one].intervals.ravel()).min())
    valleys = (on_grid <= np.roll(on_grid, 1, axis=1)) & (on_grid <= np.roll(on_grid, -1, axis=1))
    row, column = np.nonzero(valleys & (on_grid < least + 0.2))
    if not len(row):
        return float(least)
    branch, here = gc[row], arcs[gc[row]]
    a, b = psi[column] - 2 * np.pi / grid, psi[column] + 2 * np.pi / grid
    for _ in range(POLISHES):
        tried = np.stack([b - GOLDEN * (b - a), a + GOLDEN * (b - a)])
        cost = np.where(here.contains(tried), at(branch, tried), np.inf)
        left = cost[0] < cost[1]
        a, b = np.where(left, a, tried[0]), np.where(left, tried[1], b)
        least = min(least, cost.min())
    return float(least)
