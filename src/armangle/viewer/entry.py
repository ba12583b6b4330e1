"""The tool's pose as typed numbers: position in m or mm, roll, pitch and yaw in degrees."""

from __future__ import annotations

import math

import numpy as np

from .._arrays import Floats, number_in
from ..arm.arm import Arm
from ..errors import InputError
from ..models.chain import to_rpy
from ..poses import pose

_FAR = 10.0  # times the reach: a larger distance has another unit


def text_of_pose(pose: Floats) -> tuple[str, str]:
    """Return a pose (4, 4) as two texts: x y z in m to 0.1 mm, roll pitch yaw in degrees to 0.01.

    >>> text_of_pose(np.eye(4))
    ('0.0000 0.0000 0.0000', '0.00 0.00 0.00')
    """
    place = " ".join(f"{round(value, 4) + 0.0:.4f}" for value in pose[:3, 3].tolist())
    return place, " ".join(f"{round(math.degrees(angle), 2) + 0.0:.2f}" for angle in to_rpy(pose))


def pose_of_text(xyz: str, rpy: str, arm: Arm) -> Floats:
    """Return the pose (4, 4) of two texts.

    `xyz` is three numbers in m, or in mm with "mm" after them, separated by blanks or commas; `rpy` is roll,
    pitch and yaw about the fixed x, y and z axes, in degrees. Raises `InputError` if a text is not three
    finite numbers, or the position is beyond ten times the arm's reach: then it has another unit.

    >>> arm = Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1)
    >>> pose_of_text("400, 0, 500 mm", "0 0 90", arm)[:3, 3].tolist()
    [0.4, 0.0, 0.5]
    """
    unit = 0.001 if xyz.strip().endswith("mm") else 1.0
    place = unit * _three("x y z", xyz.strip().rstrip("m"), "in m, or in mm: 400 0 500 mm")
    angles = _three("roll pitch yaw", rpy.strip().removesuffix("deg").removesuffix("°"), "in degrees")
    far = float(np.linalg.norm(place - arm.base[:3, 3]))
    if far > _FAR * arm.geometry.reach:
        raise InputError(
            f"x y z is {far:.4g} m from the base and the arm reaches {arm.geometry.reach:.3g} m; "
            f"with mm behind the numbers they are mm: 400 0 500 mm"
        )
    return pose(place, rpy=np.radians(angles))


def _three(name: str, text: str, wanted: str) -> Floats:
    """Return three finite numbers."""
    words = text.replace(",", " ").split()
    try:
        values = np.array([number_in(word) for word in words])
    except ValueError:
        raise InputError(f"{name} is {text.strip()!r}, wanted three numbers {wanted}") from None
    if len(values) != 3:
        raise InputError(f"{name} has {len(values)} numbers, wanted three {wanted}")
    if not np.isfinite(values).all():
        raise InputError(f"{name} is {text.strip()!r}, wanted three finite numbers {wanted}")
    return values
