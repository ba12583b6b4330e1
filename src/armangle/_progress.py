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

PARTS = 1000
"""What calls count in that are made of unequal parts."""
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


@contextmanager
def in_parts(progress: Progress | None) -> Iterator[Progress]:
    """Let the parts of this block tell how far the whole is: in thousandths that never fall, 1000 at its end.

    Who asked in this thread is told where there is no `progress`; calls of the core in the block tell nobody.
    """
    asked = _core.exchange_progress(None)
    whole: Progress | None = asked if progress is None else progress
    most = -1

    def tell(done: int, total: int) -> None:
        nonlocal most
        share = min(PARTS * done // total, PARTS - 1)
        if whole is not None and share > most:
            most = share
            whole(share, PARTS)

    try:
        yield tell
        if whole is not None:
            whole(PARTS, PARTS)
    finally:
        _core.exchange_progress(asked)


def part(progress: Progress, k: int, of: int) -> Progress:
    """Return what part k of `of` equal ones tells."""
    return lambda done, total: progress(k * total + done, of * total)
