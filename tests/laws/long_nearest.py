"""The law of `solve` on as many cases as there is time for: python tests/laws/long_nearest.py [s] [seed].

No posture on a grid of 4001 arm angles in all eight branches, the best of them polished by 60 golden
sections, is nearer than the one that `solve` returns. Where one is, by no more than `solve` itself gains when
the pose is rounded another way, the case is counted apart.

Between batches: postures at and beside singular ones, with locked joints and tight limits, each solved from
its pose (support/delicate.py). What is told is never beyond a limit nor off the pose; how often a posture as
near as the one that the pose came from is missed is counted.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.delicate import delicate
from support.nearest import Case, brute_force, cases, cost_of, least_beside

BATCH, GRID, POSES = 200, 4001, 200
DELICATE = 400
ROUNDING = 1e-10


def excess(case: Case, best: float) -> float:
    """Return by how much `solve` costs more than `best` (negative: less); infinite if it finds none, NaN if
    neither does.
    """
    found = case.solve()
    if not found.ok:
        return np.inf if best < np.inf else np.nan
    return cost_of(case, found) - best


def beside_singular(seed: int, counts: Counter[str]) -> int:
    """Count faults of `solve` near singularities in `counts`; print solutions off limits or pose, and return
    how many.
    """
    never = 0
    for number in range(DELICATE):
        case = delicate(number, seed)
        faults = case.faults()
        counts.update(["delicate", *faults])
        if {"beyond", "missed"} & set(faults):
            never += 1
            print(f"seed {seed}, delicate case {case}: {faults}", flush=True)
    return never


def main(seconds: float, seed: int) -> int:
    """Compare `solve` with a grid for `seconds`, print every case that the grid solves better, and return how
    many.
    """
    beside: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    start, tried, without, rounded, worse, most = time.monotonic(), 0, 0, 0, 0, -np.inf
    while time.monotonic() - start < seconds:
        for case in cases(BATCH, seed):
            kinds.update(case.kinds())
            best = brute_force(case, GRID)
            more = excess(case, best)
            tried, without = tried + 1, without + np.isnan(more)
            if not more > ROUNDING:
                most = np.fmax(most, more)
            elif least_beside(case, POSES) <= best + ROUNDING:
                rounded += 1
                print(
                    f"seed {seed}, case {case}: dearer by {more:g}, within the rounding of its pose",
                    flush=True,
                )
            else:
                worse += 1
                print(f"seed {seed}, case {case}: dearer by {more:g}", flush=True)
        worse += beside_singular(seed, beside)
        seed += 1
        counts = f"{without} without a posture, {rounded} decided by rounding, {worse} worse"
        of = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        print(f"{tried} cases ({of}), {counts}; the others at most {most:.1e}; {dict(beside)}", flush=True)
    return worse


if __name__ == "__main__":
    given = [float(word) for word in sys.argv[1:]]
    sys.exit(1 if main(given[0] if given else 600.0, int(given[1]) if len(given) > 1 else 1000) else 0)
