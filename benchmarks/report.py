"""Tables, and their place in README.md: what a program prints stands between its own two markers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

README = Path(__file__).parent / "README.md"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table; the first column is left-aligned, the others right-aligned."""
    lines = [head, [":--", *("--:" for _ in head[1:])], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def write(section: str, text: str) -> None:
    """Put a text between ``<!-- section -->`` and ``<!-- /section -->`` of the README.

    Raises
    ------
    ValueError
        If the README lacks the markers.
    """
    before, opening, rest = README.read_text(encoding="utf-8").partition(f"<!-- {section} -->\n")
    _, closing, after = rest.partition(f"<!-- /{section} -->")
    if not opening or not closing:
        raise ValueError(f"{README} has no markers for {section!r}")
    README.write_text(f"{before}{opening}{text}\n{closing}{after}", encoding="utf-8")
