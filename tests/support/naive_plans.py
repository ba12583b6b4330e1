"""What a user would try instead of a plan: an arm angle held, or pulled to the middle of its arc."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

import armangle as aa

from .plan_objective import terms
from .planned_arms import IIWA, random_arm

SAMPLES = 2001
EVEN = np.linspace(0, 1, SAMPLES)
ROWS, STEP = 10, 0.2
"""A joint that moves further in so many samples, a 200th of the path, has jumped, rad."""
KINDS = ("short", "long", "singular", "limits", "corner", "weights", "margins", "goal")


@dataclass
class Case:
    """A path, and the arguments of a plan along it."""

    kind: str
    seed: int
    arm: aa.Arm
    path: aa.Path
    start: np.ndarray | None = None
    goal: np.ndarray | None = None
    objective: aa.Objective = field(default_factory=aa.Objective)
    limit_margin: float = 0.0
    singularity_margin: float = 0.0

    def plan(self, samples: int | None = None) -> aa.JointPath:
        """Return the plan."""
        return aa.plan(
            self.arm.with_(singularity_margin=self.singularity_margin), self.path,
            start=self.start, goal=self.goal, objective=self.objective,
            limit_margin=self.limit_margin, samples=samples,
        )  # fmt: skip

    def cost(self, q: np.ndarray) -> float:
        """Return the objective of joints at equal steps of s, by simple sums."""
        weights = self.objective
        found = terms(self.arm, self.path, q, weights.enough, self.limit_margin, self.singularity_margin)
        return (
            weights.travel * found.travel
            + weights.limits * found.limits
            + weights.singularities * found.singularities
        )

    def keeps(self, q: np.ndarray) -> bool:
        """Return whether joints (N, 7) are within limits and margins and do not jump."""
        room = np.minimum(q - self.arm.lower, self.arm.upper - q).min()
        theta = (
            self.arm.geometry.signs * q
            + self.arm.geometry.offsets
            - np.array([0, 0, 0, self.arm.geometry.delta, 0, 0, 0])
        )
        clear = np.arcsin(np.abs(np.sin(theta[:, [1, 3, 5]]))).min()
        return bool(
            room >= self.limit_margin + 1e-9
            and clear >= max(self.singularity_margin, 1e-5)
            and np.abs(np.diff(q[::ROWS], axis=0)).max() <= STEP
        )

    def naive(self) -> Iterator[tuple[str, np.ndarray]]:
        """Yield simple motions that are feasible: their names and joints (SAMPLES, 7)."""
        for name, q in self._tried():
            ends = [(self.start, q[0]), (self.goal, q[-1])]
            arrives = all(want is None or np.abs(want - at).max() < 1e-6 for want, at in ends)
            if arrives and np.isfinite(q).all() and self.keeps(q):
                yield name, q

    def _tried(self) -> Iterator[tuple[str, np.ndarray]]:
        """Yield simple motions and their names: constant arm angles of two references, and with a start those
        of `follow` with `Centre`.
        """
        poses = self.path.pose(EVEN)
        first = self.start
        for reference in ("base axis", "stereographic"):
            seen = self.arm if reference == "base axis" else self.arm.with_(reference="stereographic")
            if first is None:
                angles, branches = np.linspace(-np.pi, np.pi, 9)[1:], range(8)
            else:
                angles, branches = np.array([seen.forward(first)[1]]), [int(seen.forward(first)[2])]
            for gc in branches:
                for psi in angles:
                    q = seen.inverse(poses, float(psi), gc, seed=first, on_error="nan", limits=False)
                    q = np.unwrap(q, axis=0)
                    near = (self.arm.lower + self.arm.upper) / 2 if first is None else first
                    if np.isfinite(near).all():
                        q = q + 2 * np.pi * np.round((near - q[0]) / (2 * np.pi))
                    yield f"psi {psi:.3f} in GC {gc}, {reference}", q
        if first is None:
            return
        for rate in (1.0, 10.0, 100.0):
            policy = aa.Centre(rate=rate)
            done = aa.follow(self.arm, poses, start=first, policy=policy, dt=1.0 / SAMPLES)
            if done.ok:
                yield f"centre {rate:g}", done.q


def case(seed: int, kind: str | None = None) -> Case:
    """Return a random case drawn from a seed, of this kind; of KINDS[seed % 8] by default."""
    rng = np.random.default_rng([713, seed])
    kind = kind or KINDS[seed % len(KINDS)]
    arm = random_arm(rng) if kind in ("short", "weights", "margins", "corner") else IIWA
    q = rng.uniform(arm.lower + 0.15, arm.upper - 0.15)
    if kind == "singular":
        joint = rng.choice([1, 5])
        q[joint] = np.radians(rng.choice([0, 1e-3, 0.01, 0.1, 1, 3])) * rng.choice([-1, 1])
    if kind == "limits":
        joint, off = rng.integers(0, 7), 10.0 ** rng.uniform(-4, -1)
        q[joint] = arm.lower[joint] + off if rng.integers(0, 2) else arm.upper[joint] - off
    out = Case(kind, seed, arm, _path(arm, q, kind, rng), q if rng.integers(0, 3) else None)
    if kind in ("singular", "limits", "goal"):
        out.start = q
    if kind == "weights":
        limits, singularities = rng.choice([0.0, 0.01, 1.0, 100.0], 2)
        out.objective = aa.Objective(
            limits=limits, singularities=singularities, travel=float(rng.choice([0.01, 1.0, 100.0])),
            enough=float(rng.choice([0.0, 0.05, 0.35, 1.0])),
        )  # fmt: skip
    if kind == "margins":
        out.limit_margin, out.singularity_margin = rng.uniform(0, 0.14), rng.uniform(0, 0.2)
    if kind == "goal":
        reached = list(out.naive())
        out.goal = reached[rng.integers(len(reached))][1][-1] if reached else None
    return out


def _path(arm: aa.Arm, q: np.ndarray, kind: str, rng: np.random.Generator) -> aa.Path:
    """A random path of this kind from joints q."""
    first = arm.forward(q)[0]
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    shift = way * (rng.uniform(0.25, 0.7) if kind == "long" else rng.uniform(0.02, 0.25))
    if kind != "corner" and rng.integers(0, 3) == 0:
        return aa.Screw(first, first[:3, 3] + shift, rng.normal(size=3), rng.uniform(-1, 1))
    last = first.copy()
    last[:3, 3] += shift
    line = aa.Line(first, last)
    if kind != "corner":
        return line
    end = last.copy()
    end[:3, 3] += rng.normal(size=3) * 0.1
    return aa.Segments([line, aa.Line(last, end)], blend=float(rng.choice([0.0, 0.02])))
