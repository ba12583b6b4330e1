"""The headers as CUDA device code: the inverse compiles, in few registers and without memory of its own."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MOST_REGISTERS = 96


def test_the_inverse_is_device_code(tmp_path: Path) -> None:
    """nvcc compiles the inverse with at most MOST_REGISTERS registers and without memory of its own."""
    nvcc = shutil.which("nvcc")
    if nvcc is None:
        pytest.skip("nvcc is not installed")
    kernel = ROOT / "tests/package/cpp/device.cu"
    run = subprocess.run(
        [nvcc, "-std=c++20", "-arch=sm_90", "--expt-relaxed-constexpr", "-I", str(ROOT / "include"),
         "-Xptxas", "-v", "-cubin", str(kernel), "-o", str(tmp_path / "device.cubin")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    said = run.stdout + run.stderr
    assert run.returncode == 0, said
    assert "calling a __host__ function" not in said  # what would end the thread where it runs
    registers = int(re.search(r"Used (\d+) registers", said)[1])
    assert 40 < registers <= MOST_REGISTERS, said
    assert "0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads" in said, said
