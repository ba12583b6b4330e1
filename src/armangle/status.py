"""Outcomes of path functions: one value and one sentence each."""

from __future__ import annotations

from enum import IntEnum

from . import _core


class Status(IntEnum):
    """What became of a pose; ``sentence`` says it in words."""

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

    @property
    def sentence(self) -> str:
        """The outcome as one sentence."""
        return str(_core.SENTENCES[self])


STATUSES = tuple(Status)
