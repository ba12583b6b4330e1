"""What an arm reaches: a pose, a cell of a map, a base position, in yards; whole maps in seconds, bytes.

    python benchmarks/reach.py [--rounds 15] [--maps] [--write]

Each piece of work stands between two yards of its own, as in goals.py. --maps also makes maps, each in a
process of its own so that its memory is its own, and takes a minute or two.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import machine
import numpy as np
import report
import workloads
from goals import goal_row, measure
from support.threads import in_threads
from workloads import Floats, Workload
from yardstick import Yardstick

import armangle as aa
from armangle.reach.grid import Grid
from armangle.reach.store import USUAL, make_store

POSES, MARGIN_POSES, PLACED = 50_000, 2_000, 200
ARMS = {"iiwa 7": "kuka_iiwa7_r800", "OpenArm": "openarm_v10"}
REACHABLE_GOAL = {"iiwa 7": 1.2, "OpenArm": 2.7}
FINE = (0.01, 5.0)  # m, degrees: the map whose time and size are goals
MANY = (0.0057, 5.0)  # some 10^8 cells
LONG_TILES = 2**22  # cells: a second of one worker, for the comparison of schedulers


def in_the_ball(arm: aa.Arm, count: int) -> Floats:
    """Return poses whose wrist is even in the ball of the reach, their rotations even too."""
    rng = np.random.default_rng(16)
    place = rng.normal(size=(count, 3))
    place *= (
        arm.geometry.reach * np.cbrt(rng.random((count, 1))) / np.linalg.norm(place, axis=1, keepdims=True)
    )
    turned = rng.normal(size=(count, 4))
    poses = aa.pose(np.zeros((count, 3)), wxyz=turned / np.linalg.norm(turned, axis=1, keepdims=True))
    poses[:, :3, 3] = place + [0.0, 0.0, arm.geometry.d_bs] + arm.geometry.d_wf * poses[:, :3, 2]
    return arm.base @ poses @ arm.tool


def cells_of(name: str, arm: aa.Arm, fields: tuple[str, ...], goal: float) -> Workload:
    """Return the making of one tile of a map, without the store."""
    grid = Grid.of(arm.geometry.reach, arm.geometry.reach / 12, np.radians(5.0))
    axes, places = grid.axes, np.concatenate([grid.places(tile) for tile in range(grid.tiles)])
    cells = (len(places), grid.tilts, grid.turns)
    gc, freedom = np.empty(cells, np.uint8), np.empty(cells, np.float32)
    yaw, roll = (np.empty(cells, np.uint8) if field in fields else None for field in ("yaw", "roll"))
    handle = arm._handle

    def work() -> object:
        return handle.map_cells(
            places, axes["tilt"], axes["turn"], grid.steps, 0.0, gc, freedom, yaw, roll, None, None, 1
        )

    goals = {"": goal} if goal else {}
    return Workload(f"a cell of a map, {', '.join(fields)}, {name}", gc.size, work, goals)


def asked(what: str, ask: Callable[[Floats], object], poses: Floats, name: str, goal: float) -> Workload:
    """Return a question of `Arm` over poses."""
    return Workload(f"{what}, {name}", len(poses), lambda: ask(poses), {"": goal})


def placing(arm: aa.Arm, poses: Floats, name: str) -> Workload:
    """Return `place` over a small floor."""
    line = np.linspace(-0.3, 0.3, 10)
    pairs = len(line) ** 2 * len(poses)
    work = f"place, a pose from a position, {name}"
    return Workload(work, pairs, lambda: in_threads(1, lambda: aa.place(arm, poses, line, line)), {"": 2.5})


def rows() -> list[Workload]:
    """Return what is timed in yards."""
    out = []
    for name, catalogued in ARMS.items():
        arm = aa.Arm.from_catalogue(catalogued)
        poses = in_the_ball(arm, POSES)
        out += [
            asked("freedom", arm.freedom, poses, name, 3.0),
            asked("reachable", arm.reachable, poses, name, REACHABLE_GOAL[name]),
            asked("turns about the base", partial(arm.feasible_turns, about="base"), poses, name, 3.0),
            asked("turns about the tool", partial(arm.feasible_turns, about="tool"), poses, name, 3.0),
            asked("best", partial(arm.solve, prefer="margin"), poses[:MARGIN_POSES], name, 25.0),
            placing(arm, poses[:PLACED], name),
            cells_of(name, arm, ("gc", "freedom"), 1.0),
            cells_of(name, arm, USUAL, 0.0),
        ]
    return out


def make(spacing: float, degrees: float, threads: int, how: str, place: str) -> None:
    """Make one map and print its cells, seconds, megabytes on disk and in memory."""
    arm = workloads.arm()
    started = time.perf_counter()
    if how == "compute":
        store = make_store(arm, place, Grid.of(arm.geometry.reach, spacing, np.radians(degrees)), USUAL, 0.0)
        started = time.thread_time()
        for tile in range(store.grid.tiles):
            store.computed(tile)
        seconds, cells = time.thread_time() - started, store.grid.cells
    elif how == "write":
        store = make_store(arm, place, Grid.of(arm.geometry.reach, spacing, np.radians(degrees)), USUAL, 0.0)
        values = [store.computed(tile) for tile in range(store.grid.tiles)]
        started = time.process_time()
        for tile, made in enumerate(values):
            store.write(tile, made)
        seconds, cells = time.process_time() - started, store.grid.cells
    elif how == "dask":
        seconds, cells = by_one_worker(arm, spacing, degrees, place)
    else:
        found = in_threads(
            threads, lambda: aa.reach_map(arm, place, spacing=spacing, tilt=np.radians(degrees))
        )
        seconds, cells = time.perf_counter() - started, int(np.prod(found.shape))
    disk = sum(file.stat().st_size for file in Path(place).rglob("*") if file.is_file())
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(cells, seconds, disk / 1e6, memory)


def by_one_worker(arm: aa.Arm, spacing: float, degrees: float, place: str) -> tuple[float, int]:
    """Make a map by one Dask worker that runs already; return seconds and cells."""
    import distributed

    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        client.run(__import__, "armangle.reach.filling")  # the worker has begun
        started = time.perf_counter()
        found = aa.reach_map(arm, place, spacing=spacing, tilt=np.radians(degrees), scheduler=client)
        return time.perf_counter() - started, int(np.prod(found.shape))


def run(spacing: float, degrees: float, threads: int, how: str, tile: int = 0) -> tuple[float, ...]:
    """Return what `make` prints, of a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        words = [
            sys.executable,
            __file__,
            "--make",
            f"{spacing},{degrees},{threads},{how},{folder}/a.zarr,{tile}",
        ]
        return tuple(
            map(float, subprocess.run(words, check=True, capture_output=True, text=True).stdout.split())
        )


def maps() -> str:
    """Make the maps of the goals; return their table."""
    fine, many = run(*FINE, 2, "threads"), run(*MANY, 2, "threads")
    bare, write = run(*FINE, 1, "compute"), run(*FINE, 1, "write")
    long = [run(0.0125, 5.0, 1, how, LONG_TILES) for how in ("threads", "dask", "threads", "dask")]
    share = write[1] / (bare[1] + write[1])
    over = min(long[1][1], long[3][1]) / min(long[0][1], long[2][1]) - 1
    each = 1e6 * many[2] / many[0]
    lines = [
        ["iiwa 7, 10 mm, 5°, two threads: seconds", f"{fine[1]:.1f}", "≤ 60", yes(fine[1] <= 60)],
        [f"the same, {fine[0]:.3g} cells: MB on disk", f"{fine[2]:.1f}", "≤ 60", yes(fine[2] <= 60)],
        ["Zarr's share of the CPU time of a run", f"{share:.1%}", "≤ 10 %", yes(share <= 0.1)],
        ["one Dask worker over one thread, wall", f"{over:+.1%}", "≤ 5 %", yes(over <= 0.05)],
        [f"{many[0]:.3g} cells, two threads: seconds", f"{many[1]:.1f}", "", ""],
        ["the same: MB of memory at the peak", f"{many[3]:.0f}", "≤ 500", yes(many[3] <= 500)],
        ["the same: bytes a cell on disk", f"{each:.2f}", "≤ 2", yes(each <= 2)],
    ]  # fmt: skip
    return report.table(["maps", "", "goal", "reached"], lines)


def yes(reached: bool) -> str:
    """Return the word for it."""
    return "yes" if reached else "no"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--maps", action="store_true", help="make maps too")
    parser.add_argument("--write", action="store_true", help="put the tables into README.md")
    parser.add_argument("--make", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.make:
        spacing, degrees, threads, how, place, tile = options.make.split(",")
        if int(tile):
            from armangle.reach import grid

            grid._CELLS = int(tile)
        return make(float(spacing), float(degrees), int(threads), how, place)
    q = workloads.postures(5000)
    yard = Yardstick(q, np.asarray(workloads.arm().forward(q)[1]))
    timed = rows()
    lines = [
        goal_row(row, *now) for row, now in zip(timed, measure(timed, yard, options.rounds), strict=True)
    ]
    length = np.median([yard.ns() for _ in range(options.rounds)])
    result = "\n".join(
        [
            f"{machine.describe()}, load {os.getloadavg()[0]:.1f}.\nLevel {aa.ISA}, 1 yd = {length:.1f} ns.",
            "",
            report.table(["through Python, one thread", "ns", "yd", "goal, yd", "reached"], lines),
            *(["", maps()] if options.maps else []),
        ]
    )
    print(result)
    if options.write:
        report.write(f"reach {aa.ISA}", result)


if __name__ == "__main__":
    main()
