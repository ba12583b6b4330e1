"""What a peer's row is, and what all of them are given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

TOLERANCE = 1e-6  # m and rad: what iterative solvers are asked for
ITERATIONS = 100  # of one attempt
ATTEMPTS = 10  # the seed, then random joints


@dataclass(frozen=True)
class Problem:
    """The arm as numbers and as a URDF from ``base`` to ``tip``; psi and gc of the poses."""

    urdf: Path
    lower: Floats
    upper: Floats
    poses: Floats  # (N, 4, 4)
    near: Floats  # (N, 7): the posture of the pose, disturbed
    far: Floats  # (N, 7): random joints
    psi: Floats
    gc: NDArray[np.int64]


@dataclass(frozen=True)
class Solver:
    """``solve(i, pose, seed)`` returns joints (7,), or None; ``seeds`` says which seeds make sense."""

    solve: Callable[[int, Floats, Floats], Floats | None]
    seeds: tuple[str, ...] = ("near", "far")


@dataclass(frozen=True)
class Batch:
    """``solve(poses)`` returns joints (N, 7) of all poses at once, NaN where there is none."""

    solve: Callable[[Floats], Floats]


@dataclass(frozen=True)
class Arcs:
    """``find(pose)`` returns the arcs within the limits of each branch, in any order."""

    find: Callable[[Floats], list[Floats]]


def with_restarts(
    attempt: Callable[[Floats], Floats | None], problem: Problem, seed: Floats, index: int
) -> Floats | None:
    """Return the first answer of attempts from the seed, then from random joints."""
    answer = attempt(seed)
    if answer is not None:
        return answer
    random = np.random.default_rng(index)
    for _ in range(ATTEMPTS - 1):
        answer = attempt(random.uniform(problem.lower, problem.upper))
        if answer is not None:
            return answer
    return None


class Locked:
    """Values at which to lock a joint so that a six-joint solver can be used, and their order."""

    def __init__(self, problem: Problem, joint: int, count: int = 16) -> None:
        self.values = np.linspace(problem.lower[joint], problem.upper[joint], count + 2)[1:-1]
        self._start, self._step = float(self.values[0]), float(self.values[1] - self.values[0])
        self._order = [np.argsort(np.abs(self.values - value)).tolist() for value in self.values]

    def outward(self, value: float) -> list[int]:
        """Return indices from the value nearest to the given one outward."""
        at = round((value - self._start) / self._step)
        return self._order[min(max(at, 0), len(self._order) - 1)]


def first_within(problem: Problem, candidates: Floats) -> Floats | None:
    """Return the first row that is within the limits."""
    inside = ((candidates >= problem.lower) & (candidates <= problem.upper)).all(axis=1)
    at = int(inside.argmax())
    return candidates[at] if inside[at] else None
