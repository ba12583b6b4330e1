"""The redundancy left to a pose, as a value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._arrays import BoolOrArray, FloatOrArray, IntOrArray, StatusOrArray
from .._values import by_content


@by_content
class Freedom(NamedTuple):
    """Which branches reach a pose, and over how much of their circles.

    ``gc (...)`` uint8, bit k set if global configuration k reaches the pose; ``total (...)`` and ``widest
    (...)`` length of all feasible arcs and of the longest one, rad; ``arcs (...)`` uint8, their number;
    ``unproven (...)`` length, rad, of what is proven neither way and not counted: not 0 on own chains alone.
    ``status (...)`` is a `Status`, for a batch int8 codes: OK, or the obstruction in the branch nearest to a
    solution. ``total``, ``widest`` and ``arcs`` are those of `Arm.feasible`. A set bit means that the branch
    has a solution. Some such solutions have no length: those at isolated arm angles alone, and those whose
    two joints about one axis share their turn differently from `Arm.inverse`.
    """

    gc: IntOrArray
    total: FloatOrArray
    widest: FloatOrArray
    arcs: IntOrArray
    unproven: FloatOrArray
    status: StatusOrArray

    @property
    def ok(self) -> BoolOrArray:
        """Whether any branch reaches the pose, shape (...)."""
        held = np.asarray(self.gc) != 0
        return held if held.ndim else bool(held)
