"""Text output of the command line: one function for stderr, and no line break inside a path or name."""

from __future__ import annotations

import re
import sys
import textwrap
from collections.abc import Iterable
from functools import partial

from .tables import WIDTH

_QUOTED = r"""(?<![^\s(\[=])(?:'[^']*'|"[^"]*")"""
_HELD = {ord(blank): 0xE000 + k for k, blank in enumerate(" \t\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029")}
_RELEASED = {held: blank for blank, held in _HELD.items()}
_given: list[str] = []


def keep_whole(words: Iterable[str]) -> None:
    """Store the words of a command line: `paragraph` never breaks a path with blanks among them."""
    _given[:] = sorted((word for word in words if re.search(r"\s", word)), key=len, reverse=True)


def note(text: str) -> None:
    """Print a remark or an error to stderr; filled to the width on a terminal, unchanged elsewhere."""
    print(paragraph(text) if sys.stderr.isatty() else text, file=sys.stderr)


def paragraph(text: str) -> str:
    """Return text filled to 80 columns, line by line.

    Lines end at blanks only, so options and paths stay whole. Quoted names and words of the command line keep
    their inner blanks.

    >>> len(paragraph("word " * 40).splitlines())
    3
    >>> paragraph("word " * 13 + "--angle-tolerance").splitlines()[1]
    '--angle-tolerance'
    >>> paragraph("word " * 14 + "there is no 'joint of the elbow'").splitlines()[1]
    "no 'joint of the elbow'"
    """
    whole = re.compile("|".join([*map(re.escape, _given), _QUOTED]))
    held = whole.sub(lambda name: name[0].translate(_HELD), text)
    fill = partial(textwrap.fill, width=WIDTH, break_long_words=False, break_on_hyphens=False)
    lines = map(fill, held.split("\n"))
    return "\n".join(lines).translate(_RELEASED)
