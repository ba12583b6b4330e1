"""Follow random lines beside ssik: with the start given, and with the start left open.

    python benchmarks/beside_ssik.py [--lines 100] [--seed 324460] [--write]

Needs ``pip install ssik``. Lines of 5 to 50 cm of a KUKA iiwa 7, 200 poses each, from postures 5 degrees
inside the limits. A line is done if all rows are on their poses and within the limits, judged here from the
joints alone; the largest step of a joint from row to row, and the least distance of a joint to its limits,
are over the lines done. The last columns compare with `plan`, with the same start or with none, on the lines
that both do.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import machine
import numpy as np
import report
import workloads

import armangle as aa

ROWS, INSIDE = 200, np.radians(5.0)
SHORTEST, LONGEST = 0.05, 0.5  # m
DEFAULT, WIDE = aa.Objective(), aa.Objective(travel=0.01, enough=np.radians(60.0))
ON_POSE, WITHIN = 1e-6, 1e-6  # m and entries of the rotation; rad

Floats = workloads.Floats
Way = Callable[[Floats, Floats], "list[Floats]"]
"""Joints (200, 7) along poses from a start: those of every answer there is."""


def ways(arm: aa.Arm) -> dict[str, tuple[bool, Way]]:
    """Return what is compared: whether the start is given, and the way."""
    import ssik

    peer = ssik.Manipulator.from_prebuilt("iiwa7")

    def tracker(poses: Floats, start: Floats) -> list[Floats]:
        one = peer.tracker(start)
        return [np.array([one.update(pose).q for pose in poses])]

    def tracks(poses: Floats, start: Floats | None) -> list[Floats]:
        try:
            found = peer.solve_path(poses, q0=start)
        except ValueError:  # no branch at the first pose
            return []
        return [found.q(label) for label in found.tracks]

    def planned(poses: Floats, start: Floats | None, objective: aa.Objective = DEFAULT) -> list[Floats]:
        line = aa.Line(poses[0], poses[-1])
        return [aa.plan(arm, line, start=start, objective=objective, samples=ROWS).q]

    return {
        "`plan(start=)`": (True, planned),
        "`follow`": (True, lambda poses, start: [aa.follow(arm, poses, start=start).q]),
        "ssik `Tracker`": (True, tracker),
        "ssik `solve_path(q0=)`": (True, tracks),
        "`plan`": (False, lambda poses, start: planned(poses, None)),
        "`plan`, margins up to 60° wanted": (False, lambda poses, start: planned(poses, None, WIDE)),
        "ssik `solve_path`, best of all starts": (False, lambda poses, start: tracks(poses, None)),
    }


def room(arm: aa.Arm, q: Floats) -> float:
    """Return the least distance of joints (N, 7) to their limits, rad."""
    return float(np.minimum(q - arm.lower, arm.upper - q).min())


def done(arm: aa.Arm, poses: Floats, q: Floats) -> bool:
    """Return whether joints hold all poses within the limits."""
    if len(q) != len(poses) or not np.isfinite(q).all() or room(arm, q) < -WITHIN:
        return False
    return bool(np.abs(arm.forward(q)[0] - poses).max() < ON_POSE)


def lines(arm: aa.Arm, count: int, seed: int) -> list[tuple[Floats, Floats]]:
    """Return the poses of random lines, each with the posture that it begins in."""
    rng, out = np.random.default_rng(seed), []
    for _ in range(count):
        start = rng.uniform(arm.lower + INSIDE, arm.upper - INSIDE)
        first = arm.forward(start)[0]
        way, last = rng.normal(size=3), first.copy()
        last[:3, 3] += rng.uniform(SHORTEST, LONGEST) * way / np.linalg.norm(way)
        out.append((aa.Line(first, last).pose(np.linspace(0, 1, ROWS)), start))
    return out


def main() -> None:
    """Print the table, or write it into the README."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--lines", type=int, default=100)
    parser.add_argument("--seed", type=int, default=324460)
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    args = parser.parse_args()
    arm = workloads.arm()
    drawn = lines(arm, args.lines, args.seed)
    every = ways(arm)
    step, margin, taken = (np.full((len(every), len(drawn)), np.nan) for _ in range(3))
    for k, (poses, start) in enumerate(drawn):
        for i, (_, way) in enumerate(every.values()):
            before = time.process_time()
            answers = way(poses, start)
            taken[i, k] = 1e3 * (time.process_time() - before)
            held = [q for q in answers if done(arm, poses, q)]
            if held:
                best = max(held, key=lambda q: room(arm, q))
                margin[i, k] = np.degrees(room(arm, best))
                step[i, k] = np.abs(np.diff(best, axis=0)).max()
    rows = []
    names = list(every)
    for i, (name, (given, _)) in enumerate(every.items()):
        own, plan = np.isfinite(margin[i]), names.index("`plan(start=)`" if given else "`plan`")
        both = own & np.isfinite(margin[plan])
        beside = ["", "", ""]
        if i != plan and both.any():
            beside = [
                f"{both.sum()}",
                " : ".join(f"{np.median(margin[k][both]):.1f}" for k in (i, plan)),
                " : ".join(f"{step[k][both].max():.3f}" for k in (i, plan)),
            ]
        of_own = ["", ""]
        if own.any():
            of_own = [
                f"{np.median(margin[i][own]):.1f}, {np.percentile(margin[i][own], 10):.1f}",
                f"{np.percentile(step[i][own], 90):.3f}, {step[i][own].max():.3f}",
            ]
        start = "given" if given else "open"
        rows.append([name, start, f"{own.sum()}", *of_own, f"{np.median(taken[i]):.2g}", *beside])
    head = [f"{len(drawn)} lines", "start", "done", "margin, °: median, p10", "row step, rad: p90, most",
            "CPU, ms", "done by both", "margin there, its : `plan`'s", "most row step there"]  # fmt: skip
    text = f"{machine.describe()}\n\n{report.table(head, rows)}"
    print(text)
    if args.write:
        report.write("ssik", text)


if __name__ == "__main__":
    main()
