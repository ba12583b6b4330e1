"""C++ programs of `tests/package/cpp`, which print what they count."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from support import draw
from support.needs import need_tool

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "tests" / "package" / "cpp"


QUICK = "clang++" if shutil.which("clang++") else "g++"
"""Needs half of g++'s time where nothing is optimised."""
SMALL = () if draw.COUNT else ("-DARMANGLE_SMALL",)
"""Forces no function inline, which halves the time of a compiler that does not optimise."""


@functools.cache
def counts(name: str, *flags: str, compiler: str = QUICK) -> dict[str, float]:
    """Compile a program of `tests/package/cpp` with $CXX or `compiler`, run it, and return the numbers that
    it prints by name.
    """
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / name
        built = [*flags, *(SMALL if compiler == QUICK else ()), "-std=c++20", "-ffp-contract=off", "-pthread"]
        source = SOURCES / f"{name}.cpp"
        with_it = need_tool(os.environ.get("CXX", compiler))
        subprocess.run([with_it, *built, f"-I{ROOT / 'include'}", source, "-o", program], check=True)
        printed = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    lines = (line.split() for line in printed.splitlines())
    return {words[0]: float(words[1]) for words in lines if len(words) == 2}
