"""Poses as seven numbers: position and unit quaternion, and back."""

from __future__ import annotations

import numpy as np

from ._arrays import Floats

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
