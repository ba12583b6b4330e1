"""The core laws on every instruction set that was built and that this processor has."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from armangle import _core, _cpu

TESTS = Path(__file__).parents[1]
LAWS = ["laws/test_kinematics.py", "laws/test_feasible.py"]


def why_not(level: str) -> str | None:
    """Why a level cannot be run here, or None."""
    if not list(Path(_cpu.__file__).parent.glob(f"_core_{level}.*")):
        return f"the level {level} was not built"
    if not _cpu.supports(level):
        return f"this processor lacks {level}"
    return None


@pytest.mark.parametrize("level", _core.LEVELS)
def test_the_core_laws_hold(level: str) -> None:
    reason = why_not(level)
    if reason:
        pytest.skip(reason)
    command = [sys.executable, "-m", "pytest", "-q", "-m", "core", "-p", "no:cacheprovider", *LAWS]
    run = subprocess.run(
        command,
        cwd=TESTS,
        env={**os.environ, "ARMANGLE_ISA": level},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout[-4000:] + run.stderr[-2000:]


def test_at_least_one_level_is_built() -> None:
    assert any(why_not(level) is None for level in _core.LEVELS)


def test_an_unknown_level_is_refused() -> None:
    run = subprocess.run(
        [sys.executable, "-c", "import armangle; armangle.Arm"],
        env={**os.environ, "ARMANGLE_ISA": "mmx"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "ARMANGLE_ISA is 'mmx', wanted one of avx512, avx2, sse2, base" in run.stderr
