"""Outcomes of path functions: one value and one sentence each."""

from __future__ import annotations

from enum import IntEnum

from . import _core

_OF_NUMBERS = tuple("bcdoxXneEfFgG%")


class Status(IntEnum):
    """What became of a pose: an int that prints as its name; ``sentence`` says it in words.

    >>> f"{Status.LIMITS}: {Status.LIMITS:d}"
    'LIMITS: 5'
    """

    OK = 0
    UNREACHABLE = 1
    FOLDED = 2
    ELBOW_LIMIT = 3
    ELBOW_MARGIN = 4
    LIMITS = 5
    OUTSIDE = 6
    JOINT_JUMP = 7
    WINDING_EXHAUSTED = 8
    VELOCITY_LIMIT = 9
    ACCELERATION_LIMIT = 10
    NOT_REACHED = 11
    BAD_INPUT = 12
    NOT_ALLOWED = 13

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return format(int(self) if spec[-1:] in _OF_NUMBERS else self.name, spec)

    @property
    def sentence(self) -> str:
        """The outcome as one sentence."""
        return str(_core.SENTENCES[self])


STATUSES = tuple(Status)
