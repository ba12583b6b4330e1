"""Rotations nearest to given matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import Floats, as_floats, frozen, one_pose
from .errors import NotFiniteError

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


def as_transform(name: str, value: ArrayLike) -> Floats:
    """Return one rigid transform (4, 4), read-only, its rotation exact to rounding; position in m."""
    frame = one_pose(name, value)
    if _orthonormality_error(frame) > ROUNDING:  # else kept to the bit, so that a copy is the same arm
        frame = nearest_rotation(frame)
    return frozen(frame)


COLUMNS = ("x", "y", "z", "qw", "qx", "qy", "qz")
UNIT_TOLERANCE = 1e-6
"""How far the length of a quaternion may be from 1: what six printed digits leave."""


def poses_from_rows(rows: Floats, out: Floats | None = None) -> Floats:
    """Return poses (N, 4, 4) of rows (N, 7) = x, y, z (m), qw, qx, qy, qz.

    Quaternions are made exactly unit; that they nearly are is the caller's to check.

    Examples
    --------
    >>> poses_from_rows(np.array([[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]]))[0].tolist()[0]
    [-1.0, 0.0, 0.0, 1.0]
    """
    poses = np.empty((len(rows), 4, 4)) if out is None else out
    w, x, y, z = (rows[:, 3:] / np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)).T
    poses[:, 0, 0] = 1 - 2 * (y * y + z * z)
    poses[:, 0, 1] = 2 * (x * y - w * z)
    poses[:, 0, 2] = 2 * (x * z + w * y)
    poses[:, 1, 0] = 2 * (x * y + w * z)
    poses[:, 1, 1] = 1 - 2 * (x * x + z * z)
    poses[:, 1, 2] = 2 * (y * z - w * x)
    poses[:, 2, 0] = 2 * (x * z - w * y)
    poses[:, 2, 1] = 2 * (y * z + w * x)
    poses[:, 2, 2] = 1 - 2 * (x * x + y * y)
    poses[:, :3, 3] = rows[:, :3]
    poses[:, 3] = (0.0, 0.0, 0.0, 1.0)
    return poses


def rows_from_poses(poses: Floats) -> Floats:
    """Return rows (N, 7) = x, y, z (m), qw, qx, qy, qz of poses (N, 4, 4), qw >= 0.

    Of the four ways to read a quaternion off a matrix each row takes the one with the largest divisor
    (Shepperd 1978), which loses no digits for any rotation.

    Examples
    --------
    >>> rows_from_poses(np.eye(4)[None]).tolist()
    [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]]
    """
    r = poses[:, :3, :3]
    # Four times the outer product of the quaternion (w, x, y, z) with itself: any row is the quaternion.
    outer = np.empty((len(poses), 4, 4))
    trace = r[:, 0, 0] + r[:, 1, 1] + r[:, 2, 2]
    outer[:, 0, 0] = 1 + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        outer[:, i + 1, i + 1] = 1 + 2 * r[:, i, i] - trace
        outer[:, 0, i + 1] = outer[:, i + 1, 0] = r[:, k, j] - r[:, j, k]
        outer[:, i + 1, j + 1] = outer[:, j + 1, i + 1] = r[:, i, j] + r[:, j, i]
    largest = np.argmax(np.diagonal(outer, axis1=1, axis2=2), axis=1)
    quaternion = outer[np.arange(len(poses)), largest]
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    quaternion *= np.where(quaternion[:, :1] < 0, -1.0, 1.0)
    return np.concatenate([poses[:, :3, 3], quaternion + 0.0], axis=1)
