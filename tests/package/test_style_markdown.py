"""Markdown: one sentence a line, 120 columns at most, so that a diff shows the sentence that changed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COLUMNS = 120
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in ("*.md", "docs/**/*.md", "benchmarks/*.md")
    for path in ROOT.glob(pattern)
    if not {"_build", "_made", "gallery"} & set(path.parts)
)
FENCE = re.compile(r"\s*(`{3,}|~{3,})(\{(?:figure|note|tip|warning|important)\})?")
# Code, formulas and the addresses of links: a full stop in them ends no sentence.
OPAQUE = re.compile(r"(`+).*?\1|\$[^$]+\$|\]\([^)]*\)")
SHORT = re.compile(r"\b(?:e\.g|i\.e|cf|[Ee]qs?|[Ff]igs?|al|vs|ca|approx|[A-Z])\.[\"')*_]*$")
SENTENCE_END = re.compile(r"[.!?][\"')*_]*(?= +(?:[\"'(]*[A-Z0-9θψφΔ*]|\[|armangle\b))")


def prose(text: str) -> Iterator[tuple[int, str]]:
    """Lines that are sentences, with their numbers: no code, formula, table, heading, option or comment."""
    fence, is_prose = "", True
    for number, line in enumerate(text.splitlines(), start=1):
        opening = FENCE.match(line)
        if fence:
            if line.strip() == fence or (fence == "$$" and "$$" in line):
                fence, is_prose = "", True
                continue
        elif opening:
            fence, is_prose = opening[1], bool(opening[2])
            continue
        elif "$$" in line:
            if line.count("$$") == 1:
                fence, is_prose = "$$", False
            continue
        if is_prose and not re.match(r"\s*(?:\||#|<|:[\w-]+:|\[[^\]]+\]:|\(.*\)=$)", line):
            yield number, line


def joined(line: str) -> str | None:
    """What stands before a second sentence that begins on the same line, or None."""
    plain = OPAQUE.sub(lambda found: "X" * len(found[0]), re.sub(r"^\s*\d+\. ", "", line))
    for end in SENTENCE_END.finditer(plain):
        if not SHORT.search(plain[: end.end()]):
            return plain[: end.end()]
    return None


@pytest.mark.parametrize("name", PAGES)
def test_lines_are_sentences_and_fit(name: str) -> None:
    """Each line of prose holds one sentence and at most COLUMNS."""
    lines = list(prose((ROOT / name).read_text(encoding="utf-8")))
    too_long = [f"{name}:{number}: {len(line)} columns" for number, line in lines if len(line) > COLUMNS]
    two = [f"{name}:{number}: a sentence after {joined(line)!r}" for number, line in lines if joined(line)]
    assert not too_long + two, "\n".join(too_long + two)


@pytest.mark.parametrize("name", PAGES)
def test_links_have_words(name: str) -> None:
    """No link has an empty text, which Sphinx fills in and a plain reader does not."""
    assert "[](" not in (ROOT / name).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("line", "is_joined"),
    [
        ("One sentence. Another one.", True),
        ("- It holds (always). So does this.", True),
        ("A figure (fig. 10) and Eq. (36) after Faria et al. (2018).", False),
        ("`a. B` and [x](y.md) and $a. B$ are no ends.", False),
        ("1. An item of a list.", False),
    ],
)
def test_two_sentences_on_a_line_are_seen(line: str, is_joined: bool) -> None:
    """`joined` finds a second sentence on a line."""
    assert (joined(line) is not None) == is_joined


def test_code_and_formulas_are_left_alone() -> None:
    """`prose` leaves out code, formulas, tables and options, and keeps captions."""
    code = "```sh\na. B\n```\n$$\na. B\n$$\n| a. B |\n"
    text = f"Words.\n{code}```{{figure}} x.svg\n:alt: A. B\nA caption.\n```\nEnd."
    assert [line for _, line in prose(text)] == ["Words.", "A caption.", "End."]


FIGURE = re.compile(r"\d (?:[nµu]s|[kMGT]B)\b")
COMMAND = re.compile(r"benchmarks/|`make [a-z]+`")
OF_THE_PAPER = "docs/background/errata.md"


def figures(text: str) -> list[str]:
    """Lines with a measured time or size, on a page that names no command that prints it."""
    return [] if COMMAND.search(text) else [line for _, line in prose(text) if FIGURE.search(line)]


@pytest.mark.parametrize("name", [name for name in PAGES if name != OF_THE_PAPER])
def test_a_page_of_figures_names_what_prints_them(name: str) -> None:
    """A page with measured times or sizes names the command that prints them."""
    entries = (ROOT / name).read_text(encoding="utf-8")
    for part in entries.split("\n- ") if name == "CHANGELOG.md" else [entries]:
        assert not figures(part), f"{name}: {figures(part)} of no command"


def test_a_figure_of_no_command_is_seen() -> None:
    """`figures` finds times and sizes without a command."""
    assert figures("It takes 3 µs.") and figures("A store of 30 MB.")
    assert not figures("It takes 3 µs: `python benchmarks/goals.py`.") and not figures("Every 3 mm.")
