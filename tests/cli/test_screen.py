"""What the command line imports, its help, its tables and colours."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

import armangle as aa
from armangle.cli import main
from armangle.cli import screen as output
from armangle.cli.main import COMMANDS
from armangle.cli.tables import WIDTH, paint, plain_text, table

from .conftest import Screen

Capture = pytest.CaptureFixture[str]


def imported_by(code: str) -> set[str]:
    """Return the modules that a fresh interpreter has after some code."""
    script = f"import sys\ntry:\n    {code}\nexcept SystemExit:\n    pass\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.split("\n"))


# -- what is imported ------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", [["--help"], ["-h"], [], ["nonsense"]])
def test_help_imports_neither_numpy_nor_matplotlib(words: list[str]) -> None:
    """The help and bad words of the command line import no numpy, matplotlib or core."""
    modules = imported_by(f"from armangle.cli import main; main({words!r})")
    assert "armangle.cli.main" in modules
    assert not {"numpy", "matplotlib"} & modules
    assert not any(name.startswith("armangle._core") for name in modules)


def test_only_pictures_import_matplotlib() -> None:
    """`armangle demo` without pictures imports no matplotlib."""
    assert "matplotlib" not in imported_by("from armangle.cli import main; main(['demo'])")


def test_python_m_runs_it() -> None:
    """`python -m armangle --version` prints version and instruction set."""
    done = subprocess.run([sys.executable, "-m", "armangle", "--version"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout == f"armangle {aa.__version__} ({aa.ISA})\n"


# -- help ------------------------------------------------------------------------------------------------


def test_the_help_lists_every_command(capsys: Capture) -> None:
    """`armangle --help` lists every command; no words at all are status 2."""
    assert main(["--help"]) == 0
    listed = capsys.readouterr().out
    assert all(f"\n  {name} " in listed for name in COMMANDS)
    assert main([]) == 2


# -- tables ----------------------------------------------------------------------------------------------


def test_a_long_last_column_is_wrapped() -> None:
    """`table` wraps a long last column within WIDTH."""
    text = plain_text(table(["a", "b"], [["1", "word " * 40]], left=(1,)))
    assert max(map(len, text.splitlines())) <= WIDTH and len(text.splitlines()) > 3


def test_colour_does_not_count() -> None:
    """`table` aligns columns as if there were no colour."""
    rows = [["1", paint("22", "red")], ["333", "4"]]
    assert plain_text(table(["a", "b"], rows)).splitlines() == ["  a   b", "  1  22", "333   4"]


@pytest.mark.parametrize(
    ("terminal", "environment", "coloured"),
    [(True, {}, True), (False, {}, False), (True, {"NO_COLOR": "1"}, False), (True, {"TERM": "dumb"}, False)],
)
def test_colour_is_for_terminals(
    monkeypatch: pytest.MonkeyPatch, terminal: bool, environment: dict[str, str], coloured: bool
) -> None:
    """Output has colour on a terminal alone, and not with NO_COLOR or a dumb one."""
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    screen = Screen(terminal)
    monkeypatch.setattr(sys, "stdout", screen)
    assert main(["robots"]) == 0
    assert ("\x1b[" in screen.text) == coloured


def test_a_terminal_without_unicode_is_served(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bars are drawn in ASCII on a stream that has no more."""
    screen = Screen(False, "ascii")
    monkeypatch.setattr(sys, "stdout", screen)
    assert main(["ik", "--intervals", "--robot", "kuka_iiwa7_r800", "--joints", "0,20,0,-60,0,60,0"]) == 0
    assert "########" in screen.text and "#.." in screen.text


@pytest.mark.parametrize("terminal", [True, False])
def test_long_work_shows_life_on_a_terminal_and_wipes_it(
    monkeypatch: pytest.MonkeyPatch, terminal: bool
) -> None:
    """`progress` writes on a terminal alone, and wipes what it wrote."""
    monkeypatch.setattr(output, "_PATIENCE", 0.01)
    monkeypatch.setattr(output, "_BLINK", 0.01)
    screen = Screen(terminal)
    monkeypatch.setattr(sys, "stderr", screen)
    with output.progress("counting"):
        time.sleep(0.2)
    assert ("\rcounting ... 0." in screen.text) == terminal
    assert screen.text == "" or screen.text.endswith(" \r")
