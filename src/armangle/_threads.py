"""The number of threads for batches: one setting for all calls of the library."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from ._arrays import as_threads

_always: int | None = None
_here: ContextVar[int | None] = ContextVar("armangle_threads", default=None)


def set_threads(n: int) -> None:
    """Set the number of threads of all further calls. Results are bitwise the same for any number.

    By default, batches of queries use one thread; `plan`, `place` and `reach_map` use all cores.

    Parameters
    ----------
    n : int
        1 or more, or 0 for all cores.

    Raises
    ------
    InputError
    """
    global _always  # one setting for the process
    _always = as_threads(n)


@contextmanager
def threads(n: int) -> Iterator[None]:
    """Use this number of threads in this block, and in this thread or task alone.

    Parameters
    ----------
    n : int
        1 or more, or 0 for all cores.

    Raises
    ------
    InputError

    Examples
    --------
    >>> import armangle as aa
    >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    >>> with aa.threads(2):
    ...     pose, psi, gc = arm.forward([[0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]] * 100)
    """
    token = _here.set(as_threads(n))
    try:
        yield
    finally:
        _here.reset(token)


def thread_count(unset: int = 1) -> int:
    """Return the number of threads to use, 0 for all cores; `unset` if the user has not set one."""
    here = _here.get()
    chosen = _always if here is None else here
    return unset if chosen is None else chosen
