"""The glossary: every public class has its word, and no page says a word that it refuses."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

import armangle as aa

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "docs" / "glossary.md"
OTHERS_NAMES = {"glossary.md", "conventions.md"}  # which say what the rest of the world calls it
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("docs/*/*.md")]
    if path.name not in OTHERS_NAMES and not {"_made", "gallery", "_build"} & set(path.parts)
)
WORDS = GLOSSARY.read_text(encoding="utf-8").partition("## Words")[2]
ROWS = [
    [cell.strip() for cell in line.strip("| ").split(" |")] for line in re.findall(r"^\|.*\|$", WORDS, re.M)
][2:]
NAMED = {name for row in ROWS for name in re.findall(r"`([\w.]+)`", row[1])}
FORBIDDEN = [word for row in ROWS if len(row) > 3 for word in row[3].split(", ") if word]
CORE = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "include").rglob("*.hpp"))


def test_the_table_is_read() -> None:
    assert len(ROWS) >= 40 and len(FORBIDDEN) >= 8
    assert len({row[0] for row in ROWS}) == len(ROWS)


def test_every_public_class_has_its_word() -> None:
    classes = {name for name in aa.__all__ if inspect.isclass(getattr(aa, name))}
    values = {name for name in classes if not issubclass(getattr(aa, name), Exception)}
    assert values <= NAMED, values - NAMED


@pytest.mark.parametrize("name", sorted(NAMED))
def test_every_name_in_the_table_exists(name: str) -> None:
    last = name.rsplit(".", 1)[-1]
    public = hasattr(aa, last) or hasattr(aa.Arm, last)
    assert public or re.search(rf"\b{last}\b", CORE), name


@pytest.mark.parametrize("page", PAGES)
def test_pages_use_one_word_for_one_thing(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    found = [word for word in FORBIDDEN if re.search(rf"\b{word}s?\b", text, re.IGNORECASE)]
    assert not found, f"{page} says {found}; docs/glossary.md has the word for it"
