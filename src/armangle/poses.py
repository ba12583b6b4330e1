"""Rotations nearest to given matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, as_floats, raise_problem
from .errors import InputError, NotFiniteError, ShapeError

ROUNDING = 4e-15  # of a rotation that is as exact as double precision makes it


def nearest_rotation(pose: ArrayLike) -> Floats:
    """Return poses with each 3x3 block replaced by the nearest rotation matrix.

    Parameters
    ----------
    pose : array_like, shape (..., 4, 4)
        Homogeneous matrices, position in m; the 3x3 blocks may be off by rounding or by calibration.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        The same positions with proper rotations (least squares, by the singular value decomposition).

    Raises
    ------
    ShapeError, NotFiniteError
        If the shape is not (..., 4, 4), or a number is not finite.

    Examples
    --------
    >>> float(nearest_rotation(np.diag([1.001, 1.0, 1.0, 1.0]))[0, 0])
    1.0
    """
    out = as_floats("pose", pose, (4, 4)).copy()
    if not np.isfinite(out).all():
        raise NotFiniteError("pose holds NaN or infinity, wanted finite numbers")
    u, _, vt = np.linalg.svd(out[..., :3, :3])
    flip = np.ones((*out.shape[:-2], 3))
    flip[..., 2] = np.linalg.det(u @ vt)
    out[..., :3, :3] = (u * flip[..., None, :]) @ vt
    return out


def _orthonormality_error(frame: Floats) -> float:
    rotation = frame[:3, :3]
    return float(np.abs(rotation.T @ rotation - np.eye(3)).max())


def as_transform(name: str, value: ArrayLike | None) -> Floats:
    frame = np.eye(4) if value is None else as_floats(name, value, (4, 4)).copy()
    if frame.shape != (4, 4):
        raise ShapeError(f"{name} has shape {frame.shape}, wanted (4, 4)")
    problem, number = _core.check_transform(frame)
    if problem:
        try:
            raise_problem((problem, 0, number), ())
        except InputError as error:
            raise type(error)(str(error).replace("pose", name)) from None
    if _orthonormality_error(frame) > ROUNDING:  # else kept to the bit, so that a copy is the same arm
        frame = nearest_rotation(frame)
    frame.setflags(write=False)
    return frame
