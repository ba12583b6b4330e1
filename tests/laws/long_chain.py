"""The law of proven arcs on as many samples as there is time for: python tests/laws/long_chain.py [s] [seed].

All arms of the catalogue with links off by 0.1 to 2 mm and 0.1 to 5 mrad, limits of their own and such as
mislead. A posture is what a walk along the chain says it is; they come from the inverse and from Newton with
random starts.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from armangle.models.catalogue import srs_catalogue

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.chain_law import Verdict, cases, judge

BATCH, ANGLES = len(srs_catalogue()), 150


def main(seconds: float, seed: int) -> int:
    """Judge random cases for `seconds`, print what is wrong, and return how much."""
    start, total, circles, proven, batches = time.monotonic(), Verdict(), 0, 0, 0
    while time.monotonic() - start < seconds:
        rng = np.random.default_rng([80, seed])
        for case in cases(seed, BATCH):
            verdict = judge(case, rng, ANGLES)
            total.add(verdict)
            circles += 1
            proven += int(float(case.arm.feasible(case.pose, case.gc).unproven) == 0.0)
            for line in verdict.wrong:
                print(f"seed {seed}: {line}", flush=True)
        seed, batches = seed + 1, batches + 1
        if batches % 20 == 0:
            report(total, circles, proven)
    report(total, circles, proven)
    return len(total.wrong)


def report(total: Verdict, circles: int, proven: int) -> None:
    """Print the numbers so far, of so many circles (a pose in a branch) and how many of them are proven
    whole.
    """
    print(
        f"{total.samples} samples of {circles} circles ({100 * proven / circles:.2f} % proven completely), "
        f"{total.decided} decided, {total.inside} of them in arcs, "
        f"{total.by_newton} by Newton from anywhere, {total.unproven} left out as unproven, "
        f"{len(total.wrong)} wrong",
        flush=True,
    )


if __name__ == "__main__":
    given = [float(word) for word in sys.argv[1:]]
    sys.exit(1 if main(given[0] if given else 600.0, int(given[1]) if len(given) > 1 else 1000) else 0)
