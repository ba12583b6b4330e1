"""Time a Franka's solver beside its naive way and beside an iiwa's, in yards.

    python benchmarks/offset.py [--rounds 9] [--write]

Random postures of an FR3 within its limits, one thread, CPU time; a row is the median of the rounds. A yard
is what benchmarks/README.md says. The naive way is a grid of values of joint 7 in all eight branches, its
nearest posture within the limits taken: what is published as analytic inverse kinematics of these arms takes
a value of joint 7 as given. The last column is by how much its distance exceeds that of `solve` at most.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import machine
import numpy as np
import report
import workloads
from yardstick import Yardstick

import armangle as aa

INVERSE, ARCS, SOLVES, STEPS, GRIDS = 20_000, 200, 200, 400, (100, 1000)
GRID_POSES = 20
STEP = 1e-3  # m: of the tool, from one step to the next

Floats = workloads.Floats


def along(arm: aa.Arm, count: int) -> tuple[Floats, Floats]:
    """Return a start and poses on a line, there and back."""
    start = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 2.0, 0.5])
    pose = arm.forward(start)[0]
    poses = np.repeat(pose[None], count, axis=0)
    share = count / 2 - np.abs(np.arange(count) - count / 2)
    poses[:, 0, 3] += STEP * share
    return start, poses


def naive(arm: aa.Arm, pose: Floats, near: Floats, grid: int) -> float:
    """Return the distance of the nearest posture of a grid of joint 7 in all branches, inf without one."""
    free = np.linspace(-np.pi, np.pi, grid, endpoint=False)
    q = arm.inverse(pose, free, np.arange(8)[:, None], seed=near, on_error="nan")
    return float(np.sqrt(np.nanmin(((q - near) ** 2).sum(-1), initial=np.inf)))


def nanoseconds(work: Callable[[], object], units: int) -> float:
    """Return CPU time of one unit, ns."""
    start = time.thread_time_ns()
    work()
    return (time.thread_time_ns() - start) / units


def main() -> None:
    """Print the table, or write it into the README."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    args = parser.parse_args()
    rng = np.random.default_rng(2021)
    arm, iiwa = aa.Arm.from_catalogue("franka_fr3"), workloads.arm()
    q, p = rng.uniform(arm.lower, arm.upper, (INVERSE, 7)), workloads.postures(INVERSE)
    pose, free, gc = arm.forward(q)
    other, psi, branch = iiwa.forward(p)
    near = q + rng.normal(0, 0.05, q.shape)
    start, poses = along(arm, STEPS)
    few, held = slice(0, SOLVES), aa.Hold()
    rows: list[tuple[str, Callable[[], object], int]] = [
        ("inverse at a value of joint 7, batch", lambda: arm.inverse(pose, free, gc, limits=False), INVERSE),
        (
            "`Arm.inverse` of an iiwa 7, batch",
            lambda: iiwa.inverse(other, psi, branch, limits=False),
            INVERSE,
        ),
        ("intervals of one branch", lambda: arm.feasible(pose[:ARCS], gc[:ARCS]), ARCS),
        ("intervals of all branches", lambda: arm.feasible(pose[:ARCS]), ARCS),
        ("`solve` near a posture", lambda: arm.solve(pose[few], near[few]), SOLVES),
        ("`solve` for the middles of the ranges", lambda: arm.solve(pose[few]), SOLVES),
        ("`follow`, free joint held, a pose", lambda: aa.follow(arm, poses, start=start, policy=held), STEPS),
        ("`follow`, repelled from ends, a pose", lambda: aa.follow(arm, poses, start=start), STEPS),
    ]
    for grid in GRIDS:
        rows.append(
            (
                f"grid of {grid} x 8 near a posture",
                lambda n=grid: [naive(arm, pose[i], near[i], n) for i in range(GRID_POSES)],
                GRID_POSES,
            )
        )
    stick = Yardstick(p, np.asarray(psi))
    times: dict[str, list[float]] = {name: [] for name, _, _ in rows}
    yards: dict[str, list[float]] = {name: [] for name, _, _ in rows}
    for _ in range(args.rounds):
        for name, work, units in rows:
            before = stick.ns()
            taken = nanoseconds(work, units)
            times[name].append(taken)
            yards[name].append(taken / (0.5 * (before + stick.ns())))
    exact = np.asarray(arm.solve(pose[:GRID_POSES], near[:GRID_POSES]).distance)
    lines = []
    for name, _, _ in rows:
        more = ""
        if name.startswith("grid"):
            grid = int(name.split()[2])
            found = np.array([naive(arm, pose[i], near[i], grid) for i in range(GRID_POSES)])
            more = f"{(found - exact).min():.1e} to {(found - exact).max():.2g}"
        lines.append([name, f"{np.median(times[name]) / 1e3:.3g}", f"{np.median(yards[name]):.3g}", more])
    head = ["FR3, one thread, through Python", "µs", "yd", "farther than `solve`, rad"]
    text = f"{machine.describe()}\n\n{report.table(head, lines)}"
    print(text)
    if args.write:
        report.write("offset", text)


if __name__ == "__main__":
    main()
