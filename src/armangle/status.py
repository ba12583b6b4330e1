"""Statuses: one value and one sentence for each outcome."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _core

_OF_NUMBERS = tuple("bcdoxXneEfFgG%")


class Named(IntEnum):
    """An int that prints as its name."""

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return format(int(self) if spec[-1:] in _OF_NUMBERS else self.name, spec)


class _Outcome(Named):
    """The outcome for a pose: an int that prints as its name; ``sentence`` explains it.

    It has no truth value, because OK is the number 0: use ``.ok`` of a result.

    >>> f"{Status.LIMITS}: {Status.LIMITS:d}"
    'LIMITS: 5'
    """

    def __bool__(self) -> bool:
        raise TypeError(f"a Status has no truth value: ask .ok of the result, or compare, status == {self!s}")

    @property
    def sentence(self) -> str:
        """The outcome as one sentence."""
        return _core.Status(self.value).sentence


if TYPE_CHECKING:
    from ._core import Status as Status
else:  # the core alone holds names, numbers and sentences; pickled as armangle's own
    Status = _Outcome("Status", {status.name: status.value for status in _core.Status}, module=__name__)
    _SAID = "\n".join(f"{status.name}: {status.sentence}" for status in Status)
    Status.__doc__ = f"What became of a pose: an int that prints as its name.\n\n{_SAID}"

STATUSES = tuple(Status)
_IS_SOLVED = np.array([_core.Status(status.value).solved for status in STATUSES])
SOLVED = tuple(status for status in STATUSES if _core.Status(status.value).solved)
"""Statuses of a configuration that solves the pose within all limits."""


def is_solved(status: Status | NDArray[np.integer[Any]]) -> NDArray[np.bool_]:
    """Return which of the codes are in `SOLVED`, (...)."""
    return np.asarray(_IS_SOLVED[status])
