"""The <origin> of a URDF: where a joint or a shape is, and zero where that is not said."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..._arrays import Floats
from ...poses import pose
from ..chain import from_rpy


def origin(read: Callable[[str, int], Floats | None]) -> Floats:
    """Return the pose (4, 4) of an <origin>.

    Parameters
    ----------
    read : callable
        Gives so many numbers of an attribute, None where absent: three of "xyz" in m, three of "rpy", roll,
        pitch and yaw about fixed axes in rad, or, in their place, four of "quat_xyzw", a quaternion.

    Raises
    ------
    ValueError
        Both orientations are given, or a quaternion of no length.
    """
    xyz, rpy, quaternion = read("xyz", 3), read("rpy", 3), read("quat_xyzw", 4)
    place = np.zeros(3) if xyz is None else xyz
    if quaternion is None:
        return from_rpy(place, np.zeros(3) if rpy is None else rpy)
    if rpy is not None:
        raise ValueError("has rpy and quat_xyzw, wanted one of them")
    length = float(np.linalg.norm(quaternion))
    if not length:
        raise ValueError("has a quat_xyzw of no length")
    return pose(place, xyzw=quaternion / length)
