"""The law of a plan beside the naive, on many paths: python tests/laws/long_plans.py [paths] [seed].

Where an arm angle held (in either reference) or `Centre` keeps what is asked, the plan is certified, its
objective is no more than theirs, and in the median its joints turn back no more than twice more often.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.naive_plans import EVEN, KINDS, Case, case
from support.plan_objective import reversals

ROUNDING = 1e-6
TURNS = 2


def excess(asked: Case) -> tuple[float, int, str]:
    """Return the share by which a plan costs more than the best naive motion (infinite if it fails, NaN if
    there is none), how many more times its joints reverse, and that motion's name.
    """
    naive = [(asked.cost(q), name, q) for name, q in asked.naive()]
    if not naive:
        return np.nan, 0, ""
    least, name, _ = min(naive, key=lambda one: one[0])
    result = asked.plan(samples=20)
    if not result.certified:
        return np.inf, 0, name
    q = result.at(EVEN).q
    turns = reversals(q) - min(reversals(other) for _, _, other in naive)
    return asked.cost(q) / max(least, 1e-9) - 1.0, turns, name


def main(paths: int, seed: int) -> int:
    """Print every path on which a plan is dearer; return 1 if there is one or joints reverse more often, else
    0.
    """
    worse, compared, turns = 0, 0, []
    for at in range(seed, seed + paths):
        asked = case(at)
        more, back, name = excess(asked)
        if np.isnan(more):
            continue
        compared += 1
        turns.append(back)
        if more > ROUNDING:
            worse += 1
            print(f"case {at} ({asked.kind}): dearer by {more:.2g} than {name}", flush=True)
    middle = np.median(turns) if turns else np.nan
    print(f"{paths} paths of {len(KINDS)} kinds, {compared} with a naive motion, {worse} plans dearer; "
          f"reversals beyond the best naive: median {middle:g}, at most {max(turns, default=0)}")  # fmt: skip
    return int(worse > 0 or middle > TURNS)


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    sys.exit(main(given[0] if given else 1000, given[1] if len(given) > 1 else 0))
