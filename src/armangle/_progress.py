"""How far a long call is: told to a function of the user's, or drawn as a bar."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from . import _core
from .errors import InputError

Progress = Callable[[int, int], object]
"""Told how many elements are done, and of how many."""

_WIDTH = 30


class Bar:
    """A bar on stderr, which goes when all is done; `what` is written before it."""

    def __init__(self, what: str = "") -> None:
        self.what = what
        self.began = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        line = f"{self.what}{bar(done, total, time.monotonic() - self.began)}"
        end = f"\r{' ' * len(line)}\r" if done >= total else ""
        print(f"\r{line}{end}", end="", file=sys.stderr, flush=True)


def bar(done: int, total: int, seconds: float) -> str:
    """Return a share as a bar, with the seconds that it took and those that it may yet take.

    >>> bar(1, 2, 3.0)
    '###############............... 50 %, 3.0 s, 3 s left'
    """
    share = done / total if total else 1.0
    full = round(_WIDTH * share)
    left = f", {seconds * (1 - share) / share:.0f} s left" if share else ""
    return f"{'#' * full}{'.' * (_WIDTH - full)} {100 * share:.0f} %, {seconds:.1f} s{left}"


def as_progress(progress: Progress | bool | None) -> Progress | None:
    """Return the function that `progress` asks for: itself, a bar, or none."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return Bar()
    if not callable(progress):
        raise InputError(f"progress is {progress!r:.50}, wanted a function (done, total), True or False")
    return progress


@contextmanager
def progressing(progress: Progress | None) -> Iterator[None]:
    """Let the calls of the core in this block tell a function how far they are, some times a second."""
    if progress is None:  # what a caller asked for is left
        yield
        return
    before = _core.exchange_progress(progress)
    try:
        yield
    finally:
        _core.exchange_progress(before)
