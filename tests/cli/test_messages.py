"""What the command line says to stderr: filled on a terminal alone, and no name broken anywhere."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import redirect_stderr
from pathlib import Path

import pytest

import armangle as aa
from armangle.cli import main
from armangle.cli.messages import keep_whole, note, paragraph
from armangle.cli.tables import WIDTH

from .conftest import Screen

ROBOT = ("--robot", "kuka_iiwa7_r800")
GOOD = "0,20,0,-60,0,60,0"
SOURCES = Path(aa.__file__).parent / "cli"
LONG = "-".join(["part"] * 30)
NAMES = {
    "hyphens": f"{LONG}.csv",
    "blanks": f"{'a b  c ' * 20}.csv",
    "quotes": f"it's {LONG} it's.csv",
    "tabs": f"tab\tand {LONG}.csv",
    "lines": f"a\u2028b\x0c{LONG} c.csv",
}


@pytest.fixture(params=[True, False], ids=["terminal", "pipe"])
def screen(request: pytest.FixtureRequest) -> Screen:
    """A stream that is a terminal, and one that is not."""
    return Screen(request.param)


def status(screen: Screen, words: Sequence[str]) -> int:
    """Run a command line with stderr on this screen; return its exit status."""
    with redirect_stderr(screen):  # type: ignore[type-var]  # as much of a stream as is needed
        return main(words)


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
@pytest.mark.parametrize(
    "words",
    [["track"], ["plan"], ["place", "--x=0,1", "--y=0,1"], ["plan", "--policy", "hold", "--start", GOOD]],
)
def test_the_name_of_a_file_is_never_broken(words: list[str], name: str, screen: Screen) -> None:
    """Messages hold the name of a missing file in one piece, however long."""
    assert status(screen, [*words, f"no such folder/{name}", *ROBOT]) == 2
    assert repr(f"no such folder/{name}")[1:-1] in screen.text


@pytest.mark.parametrize("width", range(1, 100, 7))
@pytest.mark.parametrize("name", ["'the elbow joint'", '"the elbow joint"', "'b  c'"])
def test_what_is_quoted_is_never_broken(width: int, name: str) -> None:
    """`paragraph` breaks no line within quotes, and changes no word."""
    text = f"{'w' * width} file's link {name}, [{name}] has no axis; {'word ' * 30}"
    filled = paragraph(text)
    assert filled.count(name) == 2
    assert filled.split() == text.split()


def test_a_pipe_gets_one_line_a_message_and_a_terminal_lines_that_fit(screen: Screen) -> None:
    """`note` writes one line into a pipe, and lines of at most WIDTH on a terminal."""
    with redirect_stderr(screen):  # type: ignore[type-var]  # as much of a stream as is needed
        note("a remark " * 30)
    lines = screen.text.splitlines()
    assert (len(lines) > 1 and max(map(len, lines)) <= WIDTH) if screen.terminal else len(lines) == 1


@pytest.mark.parametrize("words", [
    ["plan", "x.csv", *ROBOT, "--gc", "y" * 99], ["nonsense" * 20], ["ik", *ROBOT, "--pose", "1,2"],
])  # fmt: skip
def test_every_error_is_said_in_the_same_way(words: list[str], screen: Screen) -> None:
    """Errors of any command have exit status 2 and begin with armangle; in a pipe they are one line."""
    assert status(screen, words) == 2
    said = screen.text[screen.text.rindex("armangle") :]
    assert screen.terminal or len(said.splitlines()) == 1


def test_words_of_one_command_line_are_not_kept_for_the_next() -> None:
    """`keep_whole` keeps only the last words given to it in one piece."""
    keep_whole([f"{'word ' * 20}"])
    assert len(paragraph("word " * 20).splitlines()) == 1
    keep_whole([])
    assert len(paragraph("word " * 20).splitlines()) == 2


def test_nothing_else_prints_to_stderr() -> None:
    r"""The sources of the command line print to stderr by `note` alone, but for signs of life (\\r)."""
    for path in SOURCES.rglob("*.py"):
        prints = re.findall(r"print\((.*)file=sys\.stderr", path.read_text(encoding="utf-8"))
        assert path.name == "messages.py" or all("\\r" in line for line in prints), path
