"""Progress of a long call: passed to a user's function, or drawn as a bar."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from . import _core
from .errors import InputError

Progress = Callable[[int, int], object]
"""Called with the number of finished elements and their total."""

PARTS = 1000
"""The total of calls whose parts are unequal."""
_WIDTH = 30


class Bar:
    """A bar on stderr, removed at the end; `what` is written before it."""

    def __init__(self, what: str = "") -> None:
        """Start the clock."""
        self.what = what
        self.began = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        line = f"{self.what}{bar(done, total, time.monotonic() - self.began)}"
        end = f"\r{' ' * len(line)}\r" if done >= total else ""
        print(f"\r{line}{end}", end="", file=sys.stderr, flush=True)


def bar(done: int, total: int, seconds: float) -> str:
    """Return a share as a bar, with the elapsed and the estimated remaining seconds.

    No remaining time if nothing is done yet; all is done if the total is 0.

    >>> bar(1, 2, 3.0)
    '###############............... 50 %, 3.0 s, 3 s left'
    """
    share = done / total if total else 1.0
    full = round(_WIDTH * share)
    left = f", {seconds * (1 - share) / share:.0f} s left" if share else ""
    return f"{'#' * full}{'.' * (_WIDTH - full)} {100 * share:.0f} %, {seconds:.1f} s{left}"


def as_progress(progress: Progress | bool | None) -> Progress | None:
    """Return the function of `progress`: itself, a bar (True), or None (None, False); raise for others."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return Bar()
    if not callable(progress):
        raise InputError(f"progress is {progress!r:.50}, wanted a function (done, total), True or False")
    return progress


@contextmanager
def progressing(progress: Progress | None) -> Iterator[None]:
    """Let the core report progress in this block to a function, some times a second; None changes nothing."""
    if progress is None:  # the caller's function stays
        yield
        return
    before = _core.exchange_progress(progress)
    try:
        yield
    finally:
        _core.exchange_progress(before)


@contextmanager
def in_parts(progress: Progress | None) -> Iterator[Progress]:
    """Let the parts of this block report the progress of the whole: rising thousandths, 1000 at its end.

    Without `progress` the function of this thread is called; calls of the core in the block report nothing.
    """
    asked = _core.exchange_progress(None)
    whole: Progress | None = asked if progress is None else progress
    most = -1

    def tell(done: int, total: int) -> None:
        """Report the share of the whole that is done, if it has grown."""
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
    """Return the progress function of part k (from 0) of `of` equal parts."""
    return lambda done, total: progress(k * total + done, of * total)
