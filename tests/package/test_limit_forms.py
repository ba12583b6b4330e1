"""The forms of the limits of offset arms in C++: 0 at a joint's own angle within their bound; their roots."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from support.needs import need_tool

ROOT = Path(__file__).resolve().parents[2]
COMPILER = os.environ.get("CXX", "g++")
FORMS = range(1, 7)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, float]:
    need_tool(COMPILER)
    program = tmp_path_factory.mktemp("limit_forms") / "forms"
    source = [f"-I{ROOT / 'include'}", str(ROOT / "tests" / "package" / "cpp" / "limit_forms.cpp")]
    flags = ["-std=c++20", "-O1", "-ffp-contract=off"]
    subprocess.run([COMPILER, *flags, *source, "-o", str(program)], check=True)
    printed = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    return {name: float(value) for name, value in (line.split() for line in printed.splitlines())}


@pytest.mark.parametrize("joint", FORMS)
def test_a_form_vanishes_at_its_joint_s_own_angle_within_its_bound(
    found: dict[str, float], joint: int
) -> None:
    assert 0 < found[f"form_{joint}"] <= 1


def test_the_bound_is_small_beside_the_form(found: dict[str, float]) -> None:
    assert 0 < found["vacuous"] < 1e-6


def test_every_root_is_enclosed_and_alone_at_nearly_all_postures(found: dict[str, float]) -> None:
    assert found["missed"] == 0
    assert found["ordinary"] > 4000
    assert found["unsettled"] < 0.01 * found["ordinary"]
