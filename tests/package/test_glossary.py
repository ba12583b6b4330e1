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
CORE = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "include").rglob("*.hpp"))


def test_the_table_is_read() -> None:
    assert len(ROWS) >= 40
    assert len({row[0] for row in ROWS}) == len(ROWS)


def test_every_public_class_has_its_word() -> None:
    classes = {name for name in aa.__all__ if inspect.isclass(getattr(aa, name))}
    values = {name for name in classes if not issubclass(getattr(aa, name), Exception)}
    assert values <= NAMED, values - NAMED


@pytest.mark.parametrize("name", sorted(NAMED))
def test_every_name_in_the_table_exists(name: str) -> None:
    last = name.rsplit(".", 1)[-1]
    public = any(hasattr(home, last) for home in (aa, aa.Arm, aa.io, aa.types, aa.gradients))
    assert public or re.search(rf"\b{last}\b", CORE), name
