"""Time a calibrated arm beside the exact arm that it nearly is.

    python benchmarks/near.py [--rounds 9] [--write]

An iiwa 7 whose links are off by what a calibration finds, random postures within the limits, one thread, CPU
time. A row is the median of the rounds, and its ratio to the exact arm's row of the same round. The last
column is how much of the circles is proven.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import machine
import numpy as np
import report
import workloads

import armangle as aa

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.calibrated import calibrated

INVERSE, ARCS, STEPS = 20_000, 1000, 400
STEP = 1e-4  # m: of the tool, from one step to the next
CLASSES = ((0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (2.0, 5.0))
"""Links are off by so many mm and mrad."""

Floats = workloads.Floats
Work = tuple[str, Callable[[], object], int]


def along(arm: aa.Arm, start: Floats) -> Floats:
    """Return poses on a line from that of a posture, there and back."""
    poses = np.repeat(np.asarray(arm.forward(start)[0])[None], STEPS, axis=0)
    poses[:, 0, 3] += STEP * (STEPS / 2 - np.abs(np.arange(STEPS) - STEPS / 2))
    return poses


def works(arm: aa.Arm, q: Floats) -> list[Work]:
    """Return what is timed, and of how many poses each is."""
    pose, psi, gc = arm.forward(q, undefined="nan")
    start = np.array([0.1, 0.6, 0.2, -1.4, 0.3, 0.9, 0.5])
    poses, few = along(arm, start), slice(0, ARCS)

    def steps() -> None:
        at = start
        for target in poses:
            at = aa.step(arm, at, target).q

    return [
        ("inverse, batch", lambda: arm.inverse(pose, psi, gc, unreachable="nan"), len(q)),
        ("arcs of one branch, batch", lambda: arm.feasible(pose[few], gc[few]), ARCS),
        ("`step`, one at a time", steps, STEPS),
        ("`solve` near a posture", lambda: arm.solve(pose[:200], q[:200] + 0.03), 200),
    ]


def microseconds(work: Callable[[], object], units: int) -> float:
    """Return CPU time of one unit, µs."""
    start = time.thread_time_ns()
    work()
    return (time.thread_time_ns() - start) / units / 1e3


def main() -> None:
    """Print the table, or write it into the README."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    args = parser.parse_args()
    exact = workloads.arm()
    q = workloads.postures(INVERSE)
    arms = {"nothing, exact": exact} | {
        f"{mm} mm, {mrad} mrad": calibrated("kuka_iiwa7_r800", mm, mrad) for mm, mrad in CLASSES
    }
    every = {name: works(arm, q) for name, arm in arms.items()}
    times: dict[tuple[str, str], list[float]] = {}
    for _ in range(args.rounds):
        for name, rows in every.items():
            for what, work, units in rows:
                times.setdefault((name, what), []).append(microseconds(work, units))
    lines = []
    for name, arm in arms.items():
        arcs = arm.feasible(*(part[:ARCS] for part in arm.forward(q, undefined="nan")[::2]))
        left = np.asarray(arcs.unproven) if arm.chain is not None else np.zeros(ARCS)
        proven = f"{100 * (1 - left.mean() / (2 * np.pi)):.3f} %, {100 * (left == 0).mean():.1f} % whole"
        for what, _, _ in every[name]:
            taken = np.array(times[name, what])
            ratio = np.median(taken / np.array(times["nothing, exact", what]))
            lines.append([name, what, f"{np.median(taken):.3g}", f"{ratio:.3g}", proven if "arcs" in what else ""])
    head = ["iiwa 7, links off by", "one thread, through Python", "µs", "times the exact arm's", "proven"]
    text = f"{machine.describe()}\n\n{report.table(head, lines)}"
    print(text)
    if args.write:
        report.write("near", text)


if __name__ == "__main__":
    main()
