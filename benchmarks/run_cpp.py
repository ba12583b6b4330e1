"""Build cpp/bench.cpp once per instruction set, with the flags of the library itself, and run it.

python benchmarks/run_cpp.py [--levels avx512,avx2,sse2] [--rounds 21] [--calls 1000000] [--write]
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import tempfile
from pathlib import Path

import machine
import report

from armangle import _cpu

HERE = Path(__file__).parent
ROOT = HERE.parent
NAMES = {
    "inverse": "inverse (paper: Inverse Kinematics)",
    "arcs_one_gc": "arcs of one GC (paper: Compute Intervals)",
    "full_step": "full step (paper: Full Algorithm)",
    "forward": "forward: pose, psi, GC",
    "arcs_all_gc": "arcs of all 8 GC",
    "inverse_batch": "inverse, batch of 10 000, per pose",
    "solve": "solve, all branches, a seed anywhere",
    "solve_near": "solve, a seed within 0.05 rad a joint",
    "solve_max": "solve by the largest move, a seed anywhere",
    "solve_best": "best: the largest least margin",
    "solutions": "solutions: one for each branch and arc",
}
GOALS = {
    "inverse": 0.6, "arcs_one_gc": 1.8, "full_step": 2.5, "arcs_all_gc": 8.0,
    "solve": 60.0, "solve_near": 60.0,
}  # fmt: skip
BATCH_GOALS = {"avx512": 0.25, "avx2": 0.45}
PAPER = {  # Table 2, µs: mean, standard deviation, maximum of 10 000 poses, as printed there
    "inverse": {"C++": ("2.247", "1.228", "32.00"), "MATLAB": ("230.3", "21.93", "642.0")},
    "arcs_one_gc": {"C++": ("10.51", "2.015", "37.00"), "MATLAB": ("822.3", "88.61", "misprinted")},
    "full_step": {"C++": ("12.74", "2.103", "43.00"), "MATLAB": ("1132", "77.65", "3345")},
    "solve": {},  # the paper has none
}


def level_flags(level: str) -> list[str]:
    """Return the flags that bindings/CMakeLists.txt gives to a level, as g++ takes them."""
    text = (ROOT / "bindings" / "CMakeLists.txt").read_text(encoding="utf-8")
    named = dict(re.findall(r"^ *set\((\w+) ([^)]*)\)", text, re.MULTILINE))
    common = re.search(r"target_compile_options\(\$\{target\} PRIVATE ([^)]*)\)", text)
    if f"flags_{level}" not in named or common is None:
        raise SystemExit(f"bindings/CMakeLists.txt names no flags for level {level!r}")
    flags = re.sub(r"\$\{(\w+)\}", lambda name: named[name[1]], common[1].replace("${level}", level))
    return flags.replace("SHELL:", "").replace('"', "").split()


def run_level(level: str, rounds: int, calls: int) -> dict[str, list[str]]:
    """Build and run one level; return its lines, by their first words."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "bench"
        source = [f"-I{ROOT / 'include'}", str(HERE / "cpp" / "bench.cpp"), "-o", str(program)]
        compiler = os.environ.get("CXX", "g++")
        subprocess.run([compiler, "-std=c++20", *level_flags(level), *source], check=True)
        command = [program, str(rounds), str(calls)]
        printed = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = [line.split() for line in printed.stdout.splitlines()]
    return {" ".join(w[:2]) if w[0] in ("throughput", "calls") else w[0]: w for w in lines}


def throughput_rows(results: dict[str, dict[str, list[str]]]) -> list[list[str]]:
    """Return one row a kind of work, two columns a level."""
    rows = []
    for key, name in NAMES.items():
        row = [name]
        for lines in results.values():
            ns, yd = (float(x) for x in lines[f"throughput {key}"][2:])
            row += [f"{ns:.1f}", f"{yd:.2f}"]
        if key == "inverse_batch":
            goal = ", ".join(f"{BATCH_GOALS[k]} ({k})" for k in results if k in BATCH_GOALS)
        else:
            goal = f"{GOALS[key]}" if key in GOALS else ""
        rows.append([*row, goal])
    return rows


def calls_rows(lines: dict[str, list[str]]) -> list[list[str]]:
    """Return Table 2's rows, ours and the paper's, in µs."""
    rows = []
    for key, paper in PAPER.items():
        figures = [f"{float(x) / 1000:.3g}" for x in lines[f"calls {key}"][2:]]
        rows.append([NAMES[key], *figures])
        rows += [[f"— paper, {language}, 2014", *said, "", "", "", ""] for language, said in paper.items()]
    return rows


def text(results: dict[str, dict[str, list[str]]]) -> str:
    """Return the section of the README."""
    columns = [word for level in results for word in (f"{level}, ns", "yd")]
    best = next(iter(results))
    yards = ", ".join(f"{lines['yard'][1]} ns ({level})" for level, lines in results.items())
    head = ["mean of 10 000", "std. dev.", "max", "median", "p99", "worst of 10⁶", "slowest pose"]
    ok = float(results[best]["steps_ok"][1])
    return "\n".join(
        [
            f"{machine.describe()}.\n1 yd = {yards}.",
            "",
            report.table(["C++, one core, throughput", *columns, "goal, yd"], throughput_rows(results)),
            "",
            report.table([f"one call after another, µs ({best})", *head], calls_rows(results[best])),
            "",
            f"10 000 random feasible poses of an iiwa 7; {ok:.2%} of the full steps end with OK.",
        ]
    )


def main() -> None:
    """Run the levels that this processor has."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--levels", default="avx512,avx2,sse2,base")
    parser.add_argument("--rounds", type=int, default=21)
    parser.add_argument("--calls", type=int, default=1_000_000)
    parser.add_argument("--write", action="store_true", help="put the tables into README.md")
    options = parser.parse_args()
    levels = [level for level in options.levels.split(",") if _cpu.supports(level)]
    results = {level: run_level(level, options.rounds, options.calls) for level in levels}
    print(text(results))
    if options.write:
        report.write("cpp", text(results))


if __name__ == "__main__":
    main()
