"""How much freedom a pose has, as a value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from .._values import by_content
from ..status import Status


@by_content
class Freedom(NamedTuple):
    """Which branches hold a pose, and over how much of their circles.

    ``gc (...)`` uint8, bit k set where global configuration k holds the pose; ``total (...)`` and
    ``widest (...)`` measure of all feasible arcs and of the longest one, rad; ``arcs (...)`` uint8, how many
    there are; ``status (...)`` a `Status`, of a batch its codes as int8: OK, or what stands in the way in the
    branch that comes nearest to holding the pose. ``total``, ``widest`` and ``arcs`` are those of
    `Arm.feasible`. A bit says that the branch has a posture: one held at isolated arm angles alone, or,
    where two joints are one axis for every arm angle, by another share of their turn than `Arm.inverse`
    takes, has its bit set, and no length.
    """

    gc: np.uint8 | NDArray[np.uint8]
    total: np.float64 | Floats
    widest: np.float64 | Floats
    arcs: np.uint8 | NDArray[np.uint8]
    status: Status | NDArray[np.int8]

    @property
    def ok(self) -> bool | NDArray[np.bool_]:
        """Whether any branch holds the pose, shape (...)."""
        held = np.asarray(self.gc) != 0
        return held if held.ndim else bool(held)
