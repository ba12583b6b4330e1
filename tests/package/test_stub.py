"""The type stub of the compiled core, as checked in, is that of the core as built."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from support.needs import need

ROOT = Path(__file__).resolve().parents[2]


def test_the_stub_is_that_of_the_core() -> None:
    """`tools/stubs.py --check` finds the checked-in stub equal to the core's."""
    need("nanobind")
    command = [sys.executable, str(ROOT / "tools" / "stubs.py"), "--check"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
