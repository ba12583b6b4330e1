"""Time a calibrated arm beside the exact arm that it nearly is.

    python benchmarks/near.py [--rounds 9] [--urdf FILE ...] [--write]

An iiwa 7 whose links are off by what a calibration finds, and the arms of files that are only nearly S-R-S;
random postures within the limits, one thread, CPU time. A row is the median of the rounds, and its ratio to
the exact iiwa's row of the same round. Of arcs the first number is the mean of the poses, the second their
median; those near to a singularity take longest. The last column is how much of the circles is proven, how
many are whole, and how near to merging branches (theta_2, theta_4 - delta, theta_6 = 0 or pi) each of the
others comes.
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
from numpy.typing import NDArray

import armangle as aa

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.calibrated import calibrated

INVERSE, ARCS, STEPS, SOLVES = 20_000, 1000, 400, 200
EXACT = "nothing: exact"
ARC_ROW = "arcs of one branch, mean; median"
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


def drawn(arm: aa.Arm, count: int) -> Floats:
    """Return random postures within the limits, a turn where there is none."""
    lower = np.where(np.isfinite(arm.lower), arm.lower, -np.pi)
    upper = np.where(np.isfinite(arm.upper), arm.upper, np.pi)
    return np.random.default_rng(7).uniform(lower, upper, (count, 7))


def works(arm: aa.Arm) -> list[Work]:
    """Return what is timed, and of how many poses each is."""
    q = drawn(arm, INVERSE)
    pose, psi, gc = arm.forward(q, on_error="nan")
    start = np.array([0.1, 0.6, 0.2, -1.4, 0.3, 0.9, 0.5])
    poses, few = along(arm, start), slice(0, ARCS)

    def steps() -> None:
        at = start
        for target in poses:
            at = aa.step(arm, at, target).q

    return [
        ("inverse, batch", lambda: arm.inverse(pose, psi, gc, on_error="nan", limits=False), len(q)),
        (ARC_ROW, lambda: arm.feasible(pose[few], gc[few]), ARCS),
        ("`step`, one at a time", steps, STEPS),
        ("`solve` near a posture", lambda: arm.solve(pose[:SOLVES], q[:SOLVES] + 0.03), SOLVES),
    ]


def microseconds(work: Callable[[], object], units: int) -> float:
    """Return CPU time of one unit, µs."""
    start = time.thread_time_ns()
    work()
    return (time.thread_time_ns() - start) / units / 1e3


def farthest_from_merging(arm: aa.Arm, pose: Floats, gc: NDArray[np.int64]) -> float:
    """Return how near (rad) each of these circles comes to where branches merge: the largest of them.

    Where theta_2, theta_4 - delta or theta_6 is 0 or pi, on the true chain.
    """
    psi = np.linspace(-np.pi, np.pi, 2000)
    farthest = 0.0
    for one, branch in zip(pose, gc, strict=True):
        theta = (
            arm.geometry.signs * arm.inverse(one, psi, branch, on_error="nan", limits=False)
            + arm.geometry.offsets
        )
        theta[:, 3] -= arm.geometry.delta
        sines = np.abs(np.sin(theta[np.isfinite(theta).all(axis=1), 1:6:2]))
        farthest = max(farthest, float(np.arcsin(sines.min(initial=0.0 if sines.size == 0 else 1.0))))
    return farthest


def of_arcs(arm: aa.Arm) -> tuple[float, str]:
    """Return the median time of the arcs of a pose, each asked a hundred times, and what is proven."""
    pose, _, gc = arm.forward(drawn(arm, ARCS), on_error="nan")
    same = [np.repeat(one[None], 100, axis=0) for one in pose]
    taken = [microseconds(lambda k=k: arm.feasible(same[k], gc[k]), 100) for k in range(ARCS)]
    left = np.asarray(arm.feasible(pose, gc).unproven) if arm.geometry.chain is not None else np.zeros(ARCS)
    share = f"{100 * (1 - left.mean() / (2 * np.pi)):.2f} %, {100 * (left == 0).mean():.1f} % whole"
    if left.any():
        off = farthest_from_merging(arm, pose[left > 0], gc[left > 0])
        share += f", the others within {np.degrees(off):.2g}°"
    return float(np.median(taken)), share


def main() -> None:
    """Print the table, or write it into the README."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--urdf", nargs="*", default=[], help="files of arms that are only nearly S-R-S")
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    args = parser.parse_args()
    arms = {EXACT: workloads.arm()}
    arms |= {f"{mm} mm, {mrad} mrad": calibrated("kuka_iiwa7_r800", mm, mrad) for mm, mrad in CLASSES}
    arms |= {Path(file).stem: aa.Arm.from_urdf(file) for file in args.urdf}
    every = {name: works(arm) for name, arm in arms.items()}
    times: dict[tuple[str, str], list[float]] = {}
    for _ in range(args.rounds):
        for name, rows in every.items():
            for what, work, units in rows:
                times.setdefault((name, what), []).append(microseconds(work, units))
    arcs = {name: of_arcs(arm) for name, arm in arms.items()}
    lines = []
    for name in arms:
        for what, _, _ in every[name]:
            taken = np.array(times[name, what])
            us, ratio = f"{np.median(taken):.3g}", f"{np.median(taken / np.array(times[EXACT, what])):.3g}"
            proven = ""
            if what == ARC_ROW:
                median, proven = arcs[name]
                us, ratio = f"{us}; {median:.3g}", f"{ratio}; {median / arcs[EXACT][0]:.3g}"
            lines.append([name, what, us, ratio, proven])
    head = ["off by", "one thread, through Python", "µs", "times the exact arm's", "proven"]
    text = f"{machine.describe()}\n\n{report.table(head, lines)}"
    print(text)
    if args.write:
        report.write("near", text)


if __name__ == "__main__":
    main()
