"""Questions where psi has too few digits: beside singular postures, at limits and with locked joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

import armangle as aa
from armangle.models.catalogue import srs_catalogue

from .strategies import Array

OFF = [0.0] + [sign * 10.0**-k for k in range(6, 14) for sign in (1, -1)]
"""How far a hinge is off straight, rad."""

HINGES = ((), (1,), (3,), (5,), (1, 3), (1, 5), (3, 5), (1, 3, 5))
OFFSET_HINGES = ((), (1,), (3,), (4,), (1, 3), (1, 4), (3, 4), (1, 3, 4))
KINDS = ("free", "one locked", "some locked", "all but one locked", "tight", "at a limit")
METRICS = ("l2", "l2", "max", "best")


@dataclass(frozen=True)
class Delicate:
    """A posture `q` within the limits of an arm, its pose, and a seed; `number` says which."""

    number: int
    arm: aa.Arm
    q: Array
    pose: Array
    near: Array
    metric: str
    kind: str
    hinges: tuple[int, ...]

    def __str__(self) -> str:
        beside = "".join(str(hinge + 1) for hinge in self.hinges)
        return f"{self.number}-{self.metric}-{self.kind}-{beside or 'regular'}"

    def solve(self) -> aa.Solution:
        """Solve the pose by the case's metric."""
        if self.metric == "best":
            return self.arm.solve(self.pose, prefer="margin")
        return self.arm.solve(self.pose, self.near, metric="max" if self.metric == "max" else "l2")

    def excess(self, found: aa.Solution) -> float:
        """Return by how much a solution costs more than the configuration that the pose was made from."""
        if self.metric == "best":
            return float(self.arm.limit_margin(self.q) - found.margin)
        off = np.abs(self.q - self.near)
        return float(found.distance - (off.max() if self.metric == "max" else np.linalg.norm(off)))

    def faults(self) -> dict[str, float]:
        """Return the faults of the solution by name and their sizes (rad; of the pose: m); {} if there is
        none.
        """
        found = self.solve()
        if not found.ok:
            return {"none": np.inf}
        beyond = float(np.maximum(self.arm.lower - found.q, found.q - self.arm.upper).max())
        missed = float(np.abs(self.arm.forward(found.q, on_error="nan")[0] - self.pose).max())
        out = {"beyond": beyond} if beyond > 0 else {}
        if missed > 1e-12:
            out["missed"] = missed
        excess = self.excess(found)
        return out | ({"farther": excess} if excess > 1e-6 else {})


@cache
def _catalogue() -> list[aa.Arm]:
    """All S-R-S arms of the catalogue."""
    return [aa.Arm.from_catalogue(name) for name in srs_catalogue()]


def delicate(number: int, seed: int) -> Delicate:
    """Return the case that `number` and `seed` draw: q mostly near singularities or limits, some joints
    locked in some cases; `near` is q, close to it, or anywhere.
    """
    rng = np.random.default_rng([number, seed, 78])
    arm = _catalogue()[int(rng.integers(len(_catalogue())))]
    low, high = np.maximum(arm.lower, -4.0), np.minimum(arm.upper, 4.0)
    q, straight = rng.uniform(low, high), -arm.geometry.signs * arm.geometry.offsets
    straight[3] += arm.geometry.signs[3] * arm.geometry.delta
    hinges = HINGES[int(rng.integers(len(HINGES)))]
    for hinge in hinges:
        q[hinge] = straight[hinge] + rng.choice(OFF)
    q = np.clip(q, arm.lower, arm.upper)
    kind = KINDS[int(rng.integers(len(KINDS)))]
    lower, upper = arm.lower.copy(), arm.upper.copy()
    free = int(rng.integers(7))
    locked = {"one locked": np.arange(7) == free, "some locked": rng.random(7) < 0.5,
              "all but one locked": np.arange(7) != free}.get(kind, np.zeros(7, dtype=bool))  # fmt: skip
    lower, upper = np.where(locked, q, lower), np.where(locked, q, upper)
    if kind == "tight":
        width = 10.0 ** -rng.uniform(0, 8, 7)
        lower, upper = np.maximum(lower, q - width), np.minimum(upper, q + width * rng.random(7))
    if kind == "at a limit":
        lower[free] = max(lower[free], q[free] - rng.choice([0.0, 1e-7, 1e-9, 1e-12]))
    arm = arm.with_(lower=lower, upper=upper)
    beside = q + rng.normal(0, 10.0 ** -rng.uniform(0, 6), 7)
    near = (q, beside, rng.uniform(low, high))[int(rng.integers(3))]
    near = np.clip(near, lower - 6.2, upper + 6.2)
    pose = arm.forward(q, on_error="nan")[0]
    return Delicate(number, arm, q, pose, near, METRICS[int(rng.integers(4))], kind, hinges)


@dataclass(frozen=True)
class DelicateOffset:
    """A posture `q` within the limits of an offset arm, its pose, and a seed."""

    number: int
    arm: aa.Arm
    q: Array
    pose: Array
    near: Array
    hinges: tuple[int, ...]

    def __str__(self) -> str:
        beside = "".join(str(hinge + 1) for hinge in self.hinges)
        return f"{self.number}-{self.arm._rows.name}-{beside or 'regular'}"

    def faults(self) -> dict[str, float]:
        """Return the faults of the solution by name and their sizes (rad; of the pose: m); {} if there is
        none.
        """
        found = self.arm.solve(self.pose, self.near)
        if not found.ok:
            return {"none": np.inf}
        beyond = float(np.maximum(self.arm.lower - found.q, found.q - self.arm.upper).max())
        missed = float(np.abs(self.arm.forward(found.q)[0] - self.pose).max())
        excess = float(found.distance - np.linalg.norm(self.q - self.near))
        wrong = {"beyond": (beyond, 0.0), "missed": (missed, 1e-12), "farther": (excess, 1e-6)}
        return {name: value for name, (value, most) in wrong.items() if value > most}


def delicate_offset(number: int, seed: int, arm: aa.Arm) -> DelicateOffset:
    """Return the case that `number` and `seed` draw: none, some or all of theta_2, elbow and theta_5 of q
    near a singularity; `near` is q, close to it, or anywhere.
    """
    rng = np.random.default_rng([number, seed, 91])
    low, high = np.maximum(arm.lower, -4.0), np.minimum(arm.upper, 4.0)  # of a joint without limits, any
    q = rng.uniform(low, high)
    hinges = OFFSET_HINGES[int(rng.integers(len(OFFSET_HINGES)))]
    zero = {1: 0.0, 3: arm._rows.geometry.delta, 4: np.pi / 2}
    for hinge in hinges:
        joint = hinge if arm.redundancy == "joint_7" else 6 - hinge
        straight = arm._rows.geometry.signs[joint] * (zero[hinge] - arm._rows.geometry.offsets[joint])
        q[joint] = straight + rng.choice(OFF)
    q = np.clip(q, arm.lower, arm.upper)
    beside = q + rng.normal(0, 10.0 ** -rng.uniform(0, 6), 7)
    near = (q, beside, rng.uniform(low, high))[int(rng.integers(3))]
    near = np.clip(near, arm.lower - 6, arm.upper + 6)
    return DelicateOffset(number, arm, q, arm.forward(q)[0], near, hinges)
