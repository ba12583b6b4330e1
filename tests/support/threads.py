"""A call with so many threads."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import armangle as aa

Answer = TypeVar("Answer")


def in_threads(n: int, call: Callable[[], Answer]) -> Answer:
    """Return the result of a call with n threads."""
    with aa.threads(n):
        return call()
