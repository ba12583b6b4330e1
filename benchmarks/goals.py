"""Measure every goal through Python in one process, interleaved, and print the table of what is reached.

    python benchmarks/goals.py [--rounds 15] [--write]        (ARMANGLE_ISA=avx2 for another instruction set)

Each piece of work stands between two yards of its own; a row's figure is the median of the rounds' ratios.
Times are CPU time, in which other programs' turns do not count; two threads are compared with one by the
least wall times of all rounds.
"""

from __future__ import annotations

import argparse
import os
import threading
import time
from collections.abc import Callable

import machine
import numpy as np
import report
import workloads
from workloads import Workload
from yardstick import Yardstick

import armangle as aa

THREAD_GOAL = 1.8
THREADS = 2
LONG_WALK = 8  # about as long as a batch


def nanoseconds(work: Workload, clock: Callable[[], int]) -> float:
    """Return the time of one unit, ns."""
    start = clock()
    work.work()
    return (clock() - start) / work.units


def measure(rows: list[Workload], yard: Yardstick, rounds: int) -> list[tuple[float, float]]:
    """Return (ns, yd) of each row: medians over rounds in which the rows take turns."""
    for row in rows:
        row.work()
    ns, ratio = np.empty((rounds, len(rows))), np.empty((rounds, len(rows)))
    for i in range(rounds):
        for j, row in enumerate(rows):
            before = yard.ns()
            ns[i, j] = nanoseconds(row, time.thread_time_ns)
            ratio[i, j] = 2 * ns[i, j] / (before + yard.ns())
    return list(zip(np.median(ns, axis=0), np.median(ratio, axis=0), strict=True))


def two_walks(yard: Yardstick, threads: int) -> float:
    """Return the time of two long walks, ns: one after another, or at once."""

    def walk() -> None:
        for _ in range(LONG_WALK):
            yard.walk()

    others = [threading.Thread(target=walk) for _ in range(threads - 1)]
    start = time.perf_counter_ns()
    for other in others:
        other.start()
    for _ in range(THREADS - len(others)):
        walk()
    for other in others:
        other.join()
    return time.perf_counter_ns() - start


def measure_threads(yard: Yardstick, rounds: int) -> list[tuple[str, float]]:
    """Return how many times faster two threads are than one: the machine itself, then each batch.

    Of the least times of all rounds: a second thread needs a second core, and neighbours take it away most of
    the time.
    """
    one, two = workloads.batches(1), workloads.batches(THREADS)
    for row in [*one, *two]:
        row.work()
    least = np.full((1 + len(one), 2), np.inf)
    for _ in range(rounds):
        now = [[two_walks(yard, 1), two_walks(yard, THREADS)]]
        now += [
            [nanoseconds(row, time.perf_counter_ns) for row in pair] for pair in zip(one, two, strict=True)
        ]
        least = np.minimum(least, now)
    names = ["the yard itself: what the machine gives", *(row.name for row in one)]
    return list(zip(names, (least[:, 0] / least[:, 1]).tolist(), strict=True))


def goal_row(row: Workload, ns: float, yd: float) -> list[str]:
    """Return one line of the table."""
    goal = row.goals.get(aa.ISA, row.goals.get(""))
    verdict = "" if goal is None else ("yes" if yd <= goal else "no")
    return [row.name, f"{ns:.1f}", f"{yd:.2f}", "" if goal is None else f"≤ {goal}", verdict]


def text(rounds: int) -> str:
    """Measure; return the section of the README."""
    q = workloads.postures(5000)
    yard = Yardstick(q, np.asarray(workloads.arm().forward(q)[1]))
    rows = workloads.goal_rows()
    lines = [goal_row(row, *figures) for row, figures in zip(rows, measure(rows, yard, rounds), strict=True)]
    length = np.median([yard.ns() for _ in range(rounds)])
    faster = [
        [name, f"{ratio:.2f} ×", "" if i == 0 else f"≥ {THREAD_GOAL} ×", "" if i == 0 else verdict(ratio)]
        for i, (name, ratio) in enumerate(measure_threads(yard, 4 * rounds))
    ]
    return "\n".join(
        [
            f"{machine.describe()}.\nLevel {aa.ISA}, 1 yd = {length:.1f} ns, medians of {rounds} rounds.",
            "",
            report.table(["through Python, one thread", "ns", "yd", "goal, yd", "reached"], lines),
            "",
            report.table([f"{THREADS} threads against 1", "faster", "goal", "reached"], faster),
        ]
    )


def verdict(ratio: float) -> str:
    """Return whether two threads are as much faster as wanted."""
    return "yes" if ratio >= THREAD_GOAL else "no"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--write", action="store_true", help="put the tables into README.md")
    options = parser.parse_args()
    if os.cpu_count() == 1:
        print("one core: the rows of two threads say nothing here")
    result = text(options.rounds)
    print(result)
    if options.write:
        report.write(f"python {aa.ISA}", result)


if __name__ == "__main__":
    main()
