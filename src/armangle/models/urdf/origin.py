"""The <origin> of a URDF: the pose of a joint or shape, the identity if it is missing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..._arrays import Floats
from ...poses import pose


def origin(read: Callable[[str, int], Floats | None]) -> Floats:
    """Return the pose (4, 4) of an <origin>.

    `read` returns so many numbers of an attribute, None if it is missing: three of "xyz" in m, three of
    "rpy", roll, pitch and yaw about fixed axes in rad, or instead four of "quat_xyzw", a quaternion. Raises
    `ValueError` if both orientations are given, or the quaternion is zero.
    """
    xyz, rpy, quaternion = read("xyz", 3), read("rpy", 3), read("quat_xyzw", 4)
    place = np.zeros(3) if xyz is None else xyz
    if quaternion is None:
        return pose(place, rpy=rpy)
    if rpy is not None:
        raise ValueError("has rpy and quat_xyzw, wanted one of them")
    length = float(np.linalg.norm(quaternion))
    if not length:
        raise ValueError("has a quat_xyzw of no length")
    return pose(place, xyzw=quaternion / length)
