"""Rows of refusals: one test asks them all, and names each row that is not refused as it says."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Any

import armangle as aa

Row = tuple[type[Exception], str, Callable[[], Any]]


def not_refused(rows: Iterable[Row]) -> list[str]:
    """Return sentences on rows (error class, pattern of its message, call) whose call does not raise so."""
    wrong = []
    for k, (error, pattern, call) in enumerate(rows):
        try:
            value = call()
        except error as raised:
            if not isinstance(raised, aa.ArmangleError):
                wrong.append(f"row {k}, {pattern!r}: {raised!r} is none of armangle")
            elif not re.search(pattern, str(raised)):
                wrong.append(f"row {k}, {pattern!r}: says {raised}")
        except Exception as raised:
            wrong.append(f"row {k}, {pattern!r}: {raised!r}, wanted {error.__name__}")
        else:
            wrong.append(f"row {k}, {pattern!r}: not refused but {value!r}")
    return wrong
