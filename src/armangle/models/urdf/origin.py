"""The <origin> of a URDF: where a joint or a shape is, and zero where that is not said."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..._arrays import Floats
from ..chain import from_rpy


def origin(read: Callable[[str], Floats | None]) -> Floats:
    """Return the pose (4, 4) of an <origin>.

    Parameters
    ----------
    read : callable
        Gives the three numbers of an attribute, None where absent: of "xyz" in m, and of "rpy", roll, pitch
        and yaw about fixed axes in rad.
    """
    xyz, rpy = read("xyz"), read("rpy")
    zero = np.zeros(3)
    return from_rpy(zero if xyz is None else xyz, zero if rpy is None else rpy)
