"""The examples run by themselves, as a reader would run them, and are short."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.needs import need

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("[0-9][0-9]_*.py"))
PICTURES = sorted((Path(__file__).parents[2] / "examples" / "pictures").glob("*.py"))
MOST_LINES = 60
PICTURE_LINES = 15


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs_without_a_word_of_complaint(example: Path, tmp_path: Path) -> None:
    if "import mujoco" in example.read_text(encoding="utf-8"):
        need("mujoco")
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONWARNINGS": "error::DeprecationWarning:__main__"}
    command = [sys.executable, str(example)]
    ran = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0 and ran.stdout, ran.stderr


@pytest.mark.turns(5)
@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.stem)
def test_a_picture_is_drawn_by_fifteen_lines(picture: Path, tmp_path: Path) -> None:
    """The pages draw all of them too."""
    drawing = (
        f"import runpy, matplotlib.pyplot as plt; runpy.run_path({str(picture)!r}); plt.savefig('a.png')"
    )
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONWARNINGS": "error::DeprecationWarning:__main__"}
    command = [sys.executable, "-c", drawing]
    ran = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "a.png").stat().st_size > 10_000


def test_examples_are_short_and_numbered_without_a_gap() -> None:
    for picture in PICTURES:
        code = picture.read_text(encoding="utf-8").split('"""')[2]
        assert len([line for line in code.splitlines() if line.strip()]) <= PICTURE_LINES, picture
    assert all(len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES for path in EXAMPLES)
    assert [int(path.name[:2]) for path in EXAMPLES] == list(range(1, len(EXAMPLES) + 1))
