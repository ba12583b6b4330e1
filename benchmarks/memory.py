"""Peak memory of a batch over what goes in and what comes out; each in a process of its own (Linux).

    python benchmarks/memory.py [--write]

The kernel's own high-water mark of resident memory is cleared before the call and read after it, so that
C++ and Python, arrays and temporaries all count. Goal: input + output + 1 MB.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import machine
import numpy as np
import report
import workloads

import armangle as aa

GOAL = 1.0  # MB over input and output
MB = 1e6
KINDS = ("forward", "inverse", "feasible", "follow")
COUNT = 500_000
# glibc gives arrays back at once, so that none is reused unseen
EXACT_FREEING = {"MALLOC_MMAP_THRESHOLD_": "65536"}


def status(field: str) -> float:
    """Return a field of /proc/self/status, MB."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith(field + ":"):
            return float(line.split()[1]) * 1024 / MB
    raise SystemExit(f"/proc/self/status has no {field}")


def bytes_of(value: object) -> int:
    """Return the bytes of all arrays that a result keeps."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, tuple):
        return sum(bytes_of(part) for part in value)
    slots = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
    parts = [getattr(value, name, None) for name in {*slots, *getattr(value, "__dict__", {})}]
    return sum(part.nbytes for part in parts if isinstance(part, np.ndarray))


def prepare(kind: str, count: int) -> tuple[int, Callable[[], object]]:
    """Return the bytes of the input, and the call."""
    robot = workloads.arm()
    if kind == "follow":
        start, path = workloads.path_poses(count)
        return path.nbytes, lambda: aa.follow(robot, path, start=start)
    q = workloads.postures(count)
    if kind == "forward":
        return q.nbytes, lambda: robot.forward(q)
    pose, psi, gc = (np.asarray(part) for part in robot.forward(q))
    if kind == "inverse":
        return pose.nbytes + psi.nbytes + gc.nbytes, lambda: robot.inverse(pose, psi, gc, limits=False)
    return pose.nbytes + gc.nbytes, lambda: robot.feasible(pose, gc)


def measure(kind: str, count: int) -> None:
    """Print input, output and what the call needed beyond the input, MB; in a process of its own."""
    prepare(kind, 10)[1]()  # what is loaded or made once
    given, call = prepare(kind, count)
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # sets VmHWM to VmRSS
    before = status("VmRSS")
    result = call()
    print(given / MB, bytes_of(result) / MB, status("VmHWM") - before)


def run(kind: str) -> list[str]:
    """Return one line of the table."""
    command = [sys.executable, __file__, "--measure", kind]
    printed = subprocess.run(
        command, capture_output=True, text=True, check=True, env={**os.environ, **EXACT_FREEING}
    ).stdout
    given, returned, needed = (float(word) for word in printed.split())
    over = needed - returned
    verdict = "yes" if over <= GOAL else "no"
    return [f"{kind}, {COUNT:,} poses", *(f"{x:.1f}" for x in (given, returned, over)), verdict]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--measure", choices=KINDS, help=argparse.SUPPRESS)
    parser.add_argument("--write", action="store_true", help="put the table into README.md")
    options = parser.parse_args()
    if options.measure:
        measure(options.measure, COUNT)
        return
    head = ["peak memory, MB", "input", "output", "over both", f"≤ {GOAL:g} MB"]
    result = f"{machine.describe()}.\n\n" + report.table(head, [run(kind) for kind in KINDS])
    print(result)
    if options.write:
        report.write("memory", result)


if __name__ == "__main__":
    main()
