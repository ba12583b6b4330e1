"""The proof of a stretch of a path in C++: it proves nothing that samples refute, and misses nothing."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from support.needs import need_tool

ROOT = Path(__file__).resolve().parents[2]
COMPILER = os.environ.get("CXX", "g++")
FAMILIES = ["offset", "exact"]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, int]:
    need_tool(COMPILER)
    program = tmp_path_factory.mktemp("prove_stretch") / "prove_stretch"
    source = [f"-I{ROOT / 'include'}", str(ROOT / "tests" / "package" / "cpp" / "prove_stretch.cpp")]
    flags = ["-std=c++20", "-O1", "-ffp-contract=off"]
    subprocess.run([COMPILER, *flags, *source, "-o", str(program)], check=True)
    printed = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    return {name: int(value) for name, value in (line.split() for line in printed.splitlines())}


@pytest.mark.parametrize("family", FAMILIES)
def test_nothing_that_samples_refute_is_proven(found: dict[str, int], family: str) -> None:
    assert found[f"proven_{family}"] > 500
    assert found[f"wrong_{family}"] == 0


@pytest.mark.parametrize("family", FAMILIES)
def test_what_keeps_clear_of_limits_and_folds_is_proven(found: dict[str, int], family: str) -> None:
    assert found[f"kept_{family}"] > 300
    assert found[f"missed_{family}"] == 0


@pytest.mark.parametrize("family", FAMILIES)
def test_what_is_said_to_be_broken_is(found: dict[str, int], family: str) -> None:
    assert found[f"broken_{family}"] > 100
    assert found[f"untrue_{family}"] == 0
