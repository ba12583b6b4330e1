"""The law of feasible arcs on as many samples as there is time for: python tests/laws/long_laws.py [s]."""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.laws import classify
from support.limit_cases import cases

BATCH = 500


def main(seconds: float) -> int:
    """Compare arcs with limits for `seconds`, print every misclassified sample, and return how many there
    are.
    """
    start, seed, samples, clear, wrong = time.monotonic(), 1000, 0, 0, 0
    while time.monotonic() - start < seconds:
        for case in cases(seed, BATCH):
            verdict = classify(case.arm, case.pose, case.gc, case.psi)
            samples, clear, wrong = (
                samples + verdict.samples,
                clear + verdict.clear,
                wrong + len(verdict.wrong),
            )
            for line in verdict.wrong:
                print(f"seed {seed}: {line}", flush=True)
        seed += 1
        print(f"{samples} samples, {clear} with all joints clear of their limits, {wrong} wrong", flush=True)
    return wrong


if __name__ == "__main__":
    sys.exit(1 if main(float(sys.argv[1]) if len(sys.argv) > 1 else 600.0) else 0)
