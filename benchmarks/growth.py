"""How cost grows with the number of poses, from 1 to 10⁶: a table, and a plot in growth.png.

    python benchmarks/growth.py [--most 1000000] [--write]

Needs matplotlib.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import machine
import matplotlib
import numpy as np
import report
import workloads
from yardstick import Yardstick

import armangle as aa

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.ticker import FuncFormatter

PICTURE = Path(__file__).parent / "growth.png"
ROUNDS, LEAST_TIME = 7, 2e6  # repeated until a measurement lasts this many ns
LIGHT, WIDTH, HEIGHT, DOTS = "0.85", 7.0, 4.2, 150

Maker = Callable[[int], Callable[[], object]]


def makers(most: int) -> dict[str, Maker]:
    """Return for each kind of work a function that prepares it for N poses."""
    robot = workloads.arm()
    q = workloads.postures(most)
    pose, psi, gc = robot.forward(q)
    psi, gc = np.asarray(psi), np.asarray(gc)
    start, path = workloads.path_poses(most)
    return {
        "forward": lambda n: lambda: robot.forward(q[:n]),
        "inverse": lambda n: lambda: robot.inverse(pose[:n], psi[:n], gc[:n], limits=False),
        "feasible": lambda n: lambda: robot.feasible(pose[:n], gc[:n]),
        "follow": lambda n: lambda: aa.follow(robot, path[:n], start=start),
    }


def time_a_pose(work: Callable[[], object], count: int) -> float:
    """Return ns of CPU time a pose: the median of rounds of as many calls as can be timed."""
    start = time.thread_time_ns()
    work()
    calls = max(1, int(LEAST_TIME / max(1, time.thread_time_ns() - start)))
    rounds = []
    for _ in range(ROUNDS):
        start = time.thread_time_ns()
        for _ in range(calls):
            work()
        rounds.append((time.thread_time_ns() - start) / calls / count)
    return float(np.median(rounds))


def sizes(most: int) -> list[int]:
    """Return 1, 3, 10, 30, ... up to the most."""
    return [n for power in range(8) for n in (10**power, 3 * 10**power) if n <= most]


def draw(counts: list[int], ns: dict[str, list[float]], yard: float) -> None:
    """Draw ns a pose over N, log-log, with the yard as a line."""
    figure, axes = plt.subplots(figsize=(WIDTH, HEIGHT), layout="constrained")
    for name, values in ns.items():
        axes.loglog(counts, values, marker="o", markersize=3, label=name)
    axes.axhline(yard, color="0.4", linestyle="--", linewidth=1)
    axes.annotate("1 yd: 7 atan2 + 1 sincos", (counts[-1], yard), ha="right", va="bottom", color="0.3")
    axes.set_xlabel("poses in one call, N")
    axes.set_ylabel("time a pose, ns")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    axes.grid(color=LIGHT)
    axes.set_axisbelow(True)
    axes.legend(frameon=False)
    figure.savefig(PICTURE, dpi=DOTS)


def text(most: int, write: bool) -> str:
    """Measure, draw; return the section of the README."""
    counts, prepared = sizes(most), makers(most)
    q = workloads.postures(5000)
    yard = Yardstick(q, np.asarray(workloads.arm().forward(q)[1]))
    ns: dict[str, list[float]] = {name: [] for name in prepared}
    lengths: list[float] = []
    for count in counts:
        lengths.append(yard.ns())
        for name, prepare in prepared.items():
            ns[name].append(time_a_pose(prepare(count), count))
    length = float(np.median(lengths))
    if write:
        draw(counts, ns, length)
    rows = [[f"{n:,}", *(f"{ns[name][i]:.1f}" for name in ns)] for i, n in enumerate(counts)]
    return "\n".join(
        [
            f"{machine.describe()}.\nLevel {aa.ISA}, one thread, 1 yd = {length:.1f} ns.",
            "",
            report.table(["poses in one call", *(f"{name}, ns a pose" for name in ns)], rows),
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--most", type=int, default=1_000_000)
    parser.add_argument(
        "--write", action="store_true", help="put the table into README.md and draw growth.png"
    )
    options = parser.parse_args()
    result = text(options.most, options.write)
    print(result)
    if options.write:
        report.write("growth", result)


if __name__ == "__main__":
    main()
