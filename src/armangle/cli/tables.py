"""Tables and colours for a terminal of 80 columns."""

from __future__ import annotations

import os
import re
import textwrap
from collections.abc import Iterable, Sequence
from typing import TextIO

WIDTH = 80
_GAP = "  "
_COLOURS = {"bold": 1, "dim": 2, "red": 31, "green": 32, "yellow": 33}
_ESCAPE = re.compile(r"\x1b\[[0-9;]*m")


def colourful(stream: TextIO) -> bool:
    """Return whether a stream is a terminal that should be given colours (https://no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def paint(text: str, colour: str) -> str:
    """Return text in a colour; `plain_text` takes it off again.

    >>> plain_text(paint("warm", "red"))
    'warm'
    """
    return f"\x1b[{_COLOURS[colour]}m{text}\x1b[0m"


def plain_text(text: str) -> str:
    """Return text without colours."""
    return _ESCAPE.sub("", text)


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], *, left: Iterable[int] = ()) -> str:
    """Return rows under bold headings, numbers to the right, the columns `left` to the left.

    The last column is wrapped where the table would pass 80 columns.

    >>> print(plain_text(table(["gc", "psi"], [["3", "58.5882"], ["4", "-1.5"]])))
    gc      psi
     3  58.5882
     4     -1.5
    """
    body = [list(row) for row in rows]
    lines = [[paint(heading, "bold") if heading else "" for heading in headings], *body]
    width = [max(len(plain_text(line[k])) for line in lines) for k in range(len(headings))]
    room = WIDTH - sum(width[:-1]) - len(_GAP) * (len(width) - 1)
    to_left = set(left)
    out = []
    for line in lines:
        head = [_padded(cell, width[k], k in to_left) for k, cell in enumerate(line[:-1])]
        fits = len(plain_text(line[-1])) <= room
        pieces = [line[-1]] if fits else textwrap.wrap(plain_text(line[-1]), room)
        for piece in pieces:
            last = _padded(piece, min(width[-1], room), len(width) - 1 in to_left)
            out.append(_GAP.join([*head, last]).rstrip())
            head = [" " * w for w in width[:-1]]
    return "\n".join(out)


def _padded(cell: str, width: int, left: bool) -> str:
    """Return a cell's text with blanks up to a width, which colours do not count towards."""
    space = " " * (width - len(plain_text(cell)))
    return cell + space if left else space + cell
