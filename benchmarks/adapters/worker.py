"""Run one peer on the problems: ``python -m adapters.worker MODULE PROBLEMS.npz URDF OUT.npz SECONDS``.

Every call is timed by itself. A row ends when its share of the time is used up.
"""

from __future__ import annotations

import importlib
import sys
import time
from pathlib import Path

import numpy as np

from .contract import Arcs, Batch, Floats, Problem, Solver

WARM_UP = 10
ARC_POSES = 1000
BATCH_ROUNDS = 7


def run_solver(row: Solver, problem: Problem, seeds: str, limit: float) -> dict[str, Floats]:
    """Return joints (M, 7) and times (M,) in ns of the M poses that the time sufficed for."""
    start = problem.near if seeds == "near" else problem.far
    for i in range(WARM_UP):
        row.solve(i, problem.poses[i], start[i])
    joints, times = [], []
    end = time.perf_counter() + limit
    for i, (pose, seed) in enumerate(zip(problem.poses, start, strict=True)):
        before = time.perf_counter_ns()
        answer = row.solve(i, pose, seed)
        times.append(time.perf_counter_ns() - before)
        joints.append(np.full(7, np.nan) if answer is None else np.asarray(answer, dtype=float))
        if time.perf_counter() > end:
            break
    return {"joints": np.array(joints), "times": np.array(times, dtype=float)}


def run_batch(row: Batch, problem: Problem) -> dict[str, Floats]:
    """Return joints (N, 7), and the time a pose of each round."""
    row.solve(problem.poses)
    times = []
    for _ in range(BATCH_ROUNDS):
        before = time.perf_counter_ns()
        joints = row.solve(problem.poses)
        times.append((time.perf_counter_ns() - before) / len(problem.poses))
    return {"joints": joints, "times": np.array(times)}


def run_arcs(row: Arcs, problem: Problem, limit: float) -> dict[str, Floats]:
    """Return the number of arcs of each pose, their total length (rad), and times."""
    row.find(problem.poses[0])
    counts, lengths, times = [], [], []
    end = time.perf_counter() + limit
    for pose in problem.poses[:ARC_POSES]:
        before = time.perf_counter_ns()
        branches = row.find(pose)
        times.append(time.perf_counter_ns() - before)
        ends = np.concatenate([np.reshape(branch, (-1, 2)) for branch in branches])
        ends = ends[~np.isnan(ends[:, 0])]
        counts.append(len(ends))
        lengths.append(float(np.sum(ends[:, 1] - ends[:, 0])))
        if time.perf_counter() > end:
            break
    return {
        "arcs": np.array(counts, dtype=float),
        "length": np.array(lengths),
        "times": np.array(times, dtype=float),
    }


def main() -> None:
    module, problems, urdf, out, seconds = sys.argv[1:6]
    problem = Problem(urdf=Path(urdf), **np.load(problems))
    rows = importlib.import_module(f"adapters.{module}").make(problem)
    limit = float(seconds) / len(rows)
    results: dict[str, Floats] = {}
    for name, row in rows.items():
        if isinstance(row, Solver):
            runs = {f"{name}|{s}": run_solver(row, problem, s, limit / len(row.seeds)) for s in row.seeds}
        elif isinstance(row, Batch):
            runs = {f"{name}|batch": run_batch(row, problem)}
        else:
            runs = {f"{name}|arcs": run_arcs(row, problem, limit)}
        results |= {f"{key}|{what}": value for key, run in runs.items() for what, value in run.items()}
    np.savez(out, **results)


if __name__ == "__main__":
    main()
