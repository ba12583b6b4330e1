"""The examples run by themselves, as a reader would run them, and are short."""

import os
import subprocess
import sys
from pathlib import Path

from support import draw
from support.needs import need

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("[0-9][0-9]_*.py"))
PICTURES = sorted((Path(__file__).parents[2] / "examples" / "pictures").glob("*.py"))
MOST_LINES = 60
PICTURE_LINES = 15
PRINTS = """
import contextlib, io, runpy, sys
for path in sys.argv[1:]:
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        runpy.run_path(path, run_name="__main__")
    assert printed.getvalue(), path
"""
DRAWS = """
import runpy, sys, matplotlib.pyplot as plt
for path in sys.argv[1:]:
    runpy.run_path(path, run_name="__main__")
    plt.savefig("a.png")
    plt.close("all")
    assert open("a.png", "rb").seek(0, 2) > 10_000, path
"""


def run(code: str, paths: list[Path], folder: Path) -> None:
    """Run code on files in a folder; a deprecation warning or an error fails the test."""
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONWARNINGS": "error::DeprecationWarning:__main__"}
    command = [sys.executable, "-c", code, *map(str, paths)]
    ran = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr


def test_examples_run_without_a_word_of_complaint(tmp_path: Path) -> None:
    """Every example runs and prints something."""
    need("mujoco")
    run(PRINTS, EXAMPLES, tmp_path)


def test_pictures_are_drawn_by_fifteen_lines(tmp_path: Path) -> None:
    """Scripts of pictures draw: every fifth here, all in `make thorough` and for the pages."""
    run(DRAWS, PICTURES if draw.COUNT else PICTURES[::5], tmp_path)


def test_examples_are_short_and_numbered_without_a_gap() -> None:
    """Pictures have at most 15 lines of code, examples 60 lines and numbers without a gap."""
    for picture in PICTURES:
        code = picture.read_text(encoding="utf-8").split('"""')[2]
        assert len([line for line in code.splitlines() if line.strip()]) <= PICTURE_LINES, picture
    assert all(len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES for path in EXAMPLES)
    assert [int(path.name[:2]) for path in EXAMPLES] == list(range(1, len(EXAMPLES) + 1))
