"""The laws of offset arms on many cases: python tests/laws/long_offset.py [cases] [seed], `make offset`.

Random arms with signs, zero offsets, base and tool, every other one mirrored. Of `cases` postures each is
met again by its own branch; of `cases` / 20 sets of arcs every value drawn is judged as the inverse judges
it; of `cases` / 125 questions nothing on a grid of all branches is nearer than `solve`. As many questions are
asked beside straight joints and folds (support/delicate.py): the answer is never beyond a limit nor off the
pose; how often a posture as near as the one that the pose came from is missed is counted.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.delicate import delicate_offset
from support.families import random_offset

import armangle as aa
from armangle.models.catalogue import offset_catalogue

POSTURES_AN_ARM, SETS_AN_ARM, VALUES, QUESTIONS_AN_ARM, GRID = 500, 48, 365, 4, 4001
NEAR_AN_END = 1e-7  # rad: nearer to an end than this rounding decides


@dataclass
class Counts:
    """Numbers of what was compared, and of what was wrong."""

    postures: int = 0
    off: float = 0.0
    lost: int = 0
    sets: int = 0
    values: int = 0
    misjudged: int = 0
    unproven: int = 0
    widest: float = 0.0
    questions: int = 0
    farther: int = 0
    delicate: Counter[str] = field(default_factory=Counter)


def an_arm(rng: np.random.Generator, k: int) -> aa.Arm:
    """The k-th random arm: every other one mirrored, every third with a range of up to 14 rad."""
    return random_offset(rng, mirrored=bool(k % 2), widest=6.0 if k % 3 else 14.0)


def look_at_postures(arm: aa.Arm, rng: np.random.Generator, counts: Counts) -> None:
    """Count random joints that `inverse` of their own pose, free joint and branch does not hold."""
    q = rng.uniform(arm.lower, arm.upper, (POSTURES_AN_ARM, 7))
    pose, free, gc = arm.forward(q)
    again = arm.inverse(pose, free, gc, seed=q, on_error="nan", limits=False)
    met = np.isfinite(again[:, 0])
    counts.postures += len(q)
    counts.lost += int((~met).sum())
    counts.off = max(counts.off, float(np.abs(arm.forward(again[met])[0] - pose[met]).max()))


def look_at_arcs(arm: aa.Arm, rng: np.random.Generator, counts: Counts) -> None:
    """Count random values of the free joint on which arcs and `inverse` disagree."""
    poses = arm.forward(rng.uniform(arm.lower, arm.upper, (SETS_AN_ARM // 8, 7)))[0]
    sets = arm.feasible(poses)
    counts.sets += SETS_AN_ARM
    counts.unproven += int((sets.unproven > NEAR_AN_END).sum())
    counts.widest = max(counts.widest, float(sets.unproven.max()))
    free = rng.uniform(-np.pi, np.pi, (SETS_AN_ARM // 8, 8, VALUES))
    q = arm.inverse(poses[:, None, None], free, np.arange(8)[:, None], on_error="nan")
    inside = np.isfinite(q[..., 0])
    said = np.moveaxis(np.array([sets.contains(free[..., k]) for k in range(VALUES)]), 0, -1)
    counts.values += free.size
    for i, j, k in np.argwhere(said != inside):
        ends = sets[int(i), int(j)].intervals.reshape(-1)
        gap = np.abs((ends - free[i, j, k] + np.pi) % (2 * np.pi) - np.pi)
        decided = not (gap < NEAR_AN_END).any() and not float(sets.unproven[i, j]) > NEAR_AN_END
        counts.misjudged += int(decided)


def look_at_nearest(arm: aa.Arm, rng: np.random.Generator, counts: Counts) -> None:
    """Count poses for which a grid of the free joint is nearer to the seed than `solve`."""
    q = rng.uniform(arm.lower, arm.upper, (QUESTIONS_AN_ARM, 7))
    near = np.where(
        np.arange(QUESTIONS_AN_ARM)[:, None] % 2,
        q + rng.normal(0, 0.1, q.shape),
        rng.uniform(arm.lower, arm.upper, q.shape),
    )
    poses = arm.forward(q)[0]
    found = arm.solve(poses, near)
    free = np.linspace(-np.pi, np.pi, GRID)
    for i in range(QUESTIONS_AN_ARM):
        grid = arm.inverse(poses[i], free, np.arange(8)[:, None], seed=near[i], on_error="nan")
        least = np.sqrt(np.nanmin(((grid - near[i]) ** 2).sum(-1), initial=np.inf))
        counts.questions += 1
        counts.farther += int(not found.distance[i] <= least + 1e-9)


def look_beside_straight(arm: aa.Arm, number: int, seed: int, counts: Counts) -> None:
    """Count faults of `solve` near singularities, and print solutions off limits or pose."""
    for k in range(QUESTIONS_AN_ARM):
        case = delicate_offset(QUESTIONS_AN_ARM * number + k, seed, arm)
        faults = case.faults()
        counts.delicate.update(["asked", *faults])
        if {"beyond", "missed"} & set(faults):
            print(f"seed {seed}, delicate case {case}: {faults}", flush=True)


def main(cases: int, seed: int) -> int:
    """Compare until all numbers reach their share of `cases`, print them, and return how many were wrong."""
    rng, counts, k = np.random.default_rng(seed), Counts(), 0
    catalogue = [aa.Arm.from_catalogue(name) for name in offset_catalogue()]
    while min(counts.postures / cases, 20 * counts.sets / cases, 125 * counts.questions / cases) < 1:
        arm = an_arm(rng, k)
        if counts.postures < cases:
            look_at_postures(arm, rng, counts)
        if 20 * counts.sets < cases:
            look_at_arcs(arm, rng, counts)
        if 125 * counts.questions < cases:
            look_at_nearest(arm, rng, counts)
            named = catalogue[k % len(catalogue)] if k % 2 else arm
            look_beside_straight(named, k, seed, counts)
        k += 1
    print(
        f"{k} arms: {counts.postures} postures, pose off by {counts.off:.1g} at most, {counts.lost} not met"
    )
    print(
        f"{counts.values} values in {counts.sets} sets: {counts.misjudged} misjudged; {counts.unproven} sets "
        f"with more than 1e-7 rad unproven, the most {counts.widest:.1g} rad"
    )
    print(f"{counts.questions} questions: {counts.farther} answered farther than a grid of {GRID} x 8")
    print(f"beside straight joints: {dict(counts.delicate)}")
    never = counts.delicate["beyond"] + counts.delicate["missed"]
    return counts.lost + counts.misjudged + counts.farther + never


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    sys.exit(1 if main(given[0] if given else 200_000, given[1] if len(given) > 1 else 0) else 0)
