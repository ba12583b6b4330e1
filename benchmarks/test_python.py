"""The goal table's rows for pytest-benchmark, to compare one state of the code with another:

    pytest benchmarks/test_python.py --benchmark-autosave
    pytest benchmarks/test_python.py --benchmark-compare

Times are of the whole work named; ``extra_info`` holds ns and yd a unit. Not part of the test suite.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
pytest.importorskip("pytest_benchmark")

import workloads
from pytest_benchmark.fixture import BenchmarkFixture
from workloads import Workload
from yardstick import Yardstick

ROWS = [*workloads.goal_rows(), *workloads.batches(threads=2)]
NAMES = [row.name for row in ROWS[:-2]] + [f"{row.name}, two threads" for row in ROWS[-2:]]


@pytest.fixture(scope="module")
def yard() -> Yardstick:
    q = workloads.postures(5000)
    return Yardstick(q, np.asarray(workloads.arm().forward(q)[1]))


@pytest.mark.parametrize("row", ROWS, ids=NAMES)
def test_row(benchmark: BenchmarkFixture, yard: Yardstick, row: Workload) -> None:
    benchmark(row.work)
    ns = 1e9 * benchmark.stats.stats.median / row.units
    benchmark.extra_info["ns a unit"] = ns
    benchmark.extra_info["yd a unit"] = ns / np.median([yard.ns() for _ in range(5)])


def test_yard(benchmark: BenchmarkFixture, yard: Yardstick) -> None:
    benchmark(yard.walk)
