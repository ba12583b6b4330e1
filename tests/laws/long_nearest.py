"""The law of `solve` on as many cases as there is time for: python tests/laws/long_nearest.py [s] [first seed].

No posture on a grid of 4001 arm angles in all eight branches, the best of them polished by 60 golden sections,
is nearer than the one that `solve` returns.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.nearest import Case, brute_force, cases

BATCH, GRID = 200, 4001
ROUNDING = 1e-10


def excess(case: Case) -> float:
    """Return by how much `solve` costs more than the grid (negative: less); NaN where neither has a posture."""
    best = brute_force(case, GRID)
    found = case.solve()
    if not found.ok:
        return np.inf if best < np.inf else np.nan
    return float(-found.margin if case.prefer == "margin" else found.distance) - best


def main(seconds: float, seed: int) -> int:
    """Run until the time is over; print every case that the grid solves better, and return how many."""
    start, tried, without, worse, most = time.monotonic(), 0, 0, 0, -np.inf
    while time.monotonic() - start < seconds:
        for case in cases(BATCH, seed):
            more = excess(case)
            tried, without, most = tried + 1, without + np.isnan(more), np.fmax(most, more)
            if more > ROUNDING:
                worse += 1
                print(f"seed {seed}, case {case}: dearer by {more:g}", flush=True)
        seed += 1
        print(f"{tried} cases, {without} without a posture, {worse} worse, at most {most:.1e}", flush=True)
    return worse


if __name__ == "__main__":
    given = [float(word) for word in sys.argv[1:]]
    sys.exit(1 if main(given[0] if given else 600.0, int(given[1]) if len(given) > 1 else 1000) else 0)
