"""Nothing that a control loop calls allocates: a C++ program with counting allocators shows it."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from support.needs import need_tool

ROOT = Path(__file__).resolve().parents[2]
COMPILER = os.environ.get("CXX", "g++")


@pytest.fixture(scope="module")
def counts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, int]:
    need_tool(COMPILER)
    program = tmp_path_factory.mktemp("no_allocation") / "count"
    source = [f"-I{ROOT / 'include'}", str(ROOT / "tests" / "package" / "cpp" / "no_allocation.cpp")]
    flags = ["-std=c++20", "-O0", "-ffp-contract=off", "-pthread"]
    subprocess.run([COMPILER, *flags, *source, "-o", str(program)], check=True)
    printed = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    lines = [line.split() for line in printed.splitlines()[1:]]
    return {name: int(count) for name, count in lines}


def test_the_counter_counts(counts: dict[str, int]) -> None:
    assert counts["counter"] >= 1


NAMES = """make_arm limit_table forward jacobian inverse feasible feasible_all nearest step follow
bounded_step lookahead scene tracker chain_arm near_inverse near_feasible near_follow"""


def test_nothing_else_allocates(counts: dict[str, int]) -> None:
    assert {name: counts[name] for name in NAMES.split()} == dict.fromkeys(NAMES.split(), 0)
