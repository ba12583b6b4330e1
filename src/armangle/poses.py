"""Poses from common notations, and the rotations nearest to given matrices."""

from __future__ import annotations

from typing import Never

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, as_floats, as_poses, broadcast, frozen, looks_like, one_pose
from ._core import Orientation
from .errors import InputError

ROUNDING = 4e-15  # of a rotation that is exact in double precision


_ORIENTATIONS = {
    "wxyz": (Orientation.WXYZ, 4, ": a unit quaternion, the real part first"),
    "xyzw": (Orientation.XYZW, 4, ": a unit quaternion, the real part last"),
    "rpy": (Orientation.RPY, 3, ": roll pitch yaw, rad"),
    "rotvec": (Orientation.ROTVEC, 3, ": an axis times the angle about it, rad"),
}
_CONVENTIONS = (
    "wxyz= (a quaternion, the real part first), xyzw= (the real part last), rpy= (rad, about the fixed axes "
    "x, then y, then z), rotvec= (axis times angle, rad) or matrix= (3 x 3)"
)
_MOST_TURNS = {"rpy": 8 * np.pi, "rotvec": 4 * np.pi}
"""Larger angles are degrees rather than intended turns, rad."""


def pose(
    xyz: ArrayLike,
    *unnamed: Never,
    wxyz: ArrayLike | None = None,
    xyzw: ArrayLike | None = None,
    rpy: ArrayLike | None = None,
    rotvec: ArrayLike | None = None,
    matrix: ArrayLike | None = None,
    **unknown: Never,
) -> Floats:
    """Return poses (..., 4, 4) from positions and orientations.

    Give one orientation, or none for the identity. Batch shapes are broadcast.

    Parameters
    ----------
    xyz : array_like, shape (..., 3)
        Positions, m.
    wxyz : array_like, shape (..., 4), optional
        Unit quaternions, the real part first: MuJoCo, Drake, path files of this library.
    xyzw : array_like, shape (..., 4), optional
        Unit quaternions, the real part last: ROS, SciPy, pinocchio. Lengths are accepted within 1e-6 of 1,
        and made exactly 1.
    rpy : array_like, shape (..., 3), optional
        Roll, pitch, yaw, rad: rotations about the *fixed* axes x, then y, then z, as in URDF: R = Rz(yaw)
        Ry(pitch) Rx(roll). Each within ±8π: larger values are probably degrees.
    rotvec : array_like, shape (..., 3), optional
        Axis times angle, rad, at most two turns long: larger values are probably degrees.
    matrix : array_like, shape (..., 3, 3), optional
        Rotation matrices, orthonormal within 1e-6; kept unchanged.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        Homogeneous matrices, position in m.

    Raises
    ------
    InputError
        If two orientations are given, or one without a name from above; if a quaternion is not unit, or
        angles look like degrees.

    Examples
    --------
    >>> pose([0.5, 0.0, 0.4], rpy=[0.0, 0.0, np.pi / 2]).round(12).tolist()[0]
    [0.0, -1.0, 0.0, 0.5]
    >>> pose([[0.5, 0.0, 0.4], [0.5, 0.1, 0.4]], wxyz=[0.0, 1.0, 0.0, 0.0]).shape
    (2, 4, 4)
    """
    if unnamed or unknown:
        given_as = ", ".join(f"{name}=" for name in unknown) or "without a name"
        raise InputError(f"the orientation is given {given_as}, wanted by its convention: {_CONVENTIONS}")
    named = {"wxyz": wxyz, "xyzw": xyzw, "rpy": rpy, "rotvec": rotvec, "matrix": matrix}
    given = {name: value for name, value in named.items() if value is not None}
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} are given, wanted one orientation, or none for the identity")
    places = as_floats("xyz", xyz, (3,), _instead_of_positions(xyz) or ": positions, m")
    if not np.isfinite(places).all():
        at = [int(i) for i in np.argwhere(~np.isfinite(places))[0]]
        raise InputError(f"xyz{at} is {places[tuple(at)]}, wanted finite numbers in m")
    if not given:
        turns = np.eye(4)
    for name, value in given.items():
        turns = _turns(name, value)
    batch, (shifts, turns) = broadcast([("xyz", places, 1), ("the orientation", turns, 2)])
    out = np.empty((*batch, 4, 4))
    out[...] = turns
    out[..., :3, 3] = shifts
    return out


def _instead_of_positions(xyz: ArrayLike) -> str:
    """Return what an argument without positions probably is, as the end of an error; "" if unknown."""
    try:
        shape = np.shape(xyz)
    except ValueError:  # a ragged list
        return ""
    return ": it is a pose already" if shape[-2:] == (4, 4) else looks_like("xyz", shape)


def _turns(name: str, value: ArrayLike) -> Floats:
    """Return poses at the origin with the orientations given as the argument `name`."""
    if name == "matrix":
        rotations = as_floats(name, value, (3, 3), ": rotation matrices")
        turns = np.zeros((*rotations.shape[:-2], 4, 4))
        turns[..., :3, :3] = rotations
        turns[..., 3, 3] = 1.0
        _core.check_transforms(turns, name)
        return turns
    kind, width, meaning = _ORIENTATIONS[name]
    numbers = as_floats(name, value, (width,), meaning)
    if name in _MOST_TURNS and numbers.size:
        with np.errstate(over="ignore"):
            angles = numbers if name == "rpy" else np.linalg.norm(numbers, axis=-1)
        most = angles.flat[int(np.abs(angles).argmax())]
        if _MOST_TURNS[name] < abs(most) < np.inf:
            what = "holds" if name == "rpy" else "turns by"
            raise InputError(f"{name} {what} {most:g}. Angles are in rad: were these degrees?")
    turns = np.empty((*numbers.shape[:-1], 4, 4))
    _core.rotations_many(kind, numbers, turns, name)
    return turns


def nearest_rotation(pose: ArrayLike) -> Floats:
    """Return poses with each 3x3 block replaced by the nearest rotation matrix.

    Parameters
    ----------
    pose : array_like, shape (..., 4, 4)
        Homogeneous matrices, position in m; the 3x3 blocks may have errors of rounding or calibration.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        The same positions with proper rotations (least squares, by the singular value decomposition).

    Raises
    ------
    InputError
        If the shape is not (..., 4, 4), or a number is not finite.

    Examples
    --------
    >>> float(nearest_rotation(np.diag([1.001, 1.0, 1.0, 1.0]))[0, 0])
    1.0
    """
    out = as_poses("pose", pose).copy()
    if not np.isfinite(out).all():
        raise InputError("pose holds NaN or infinity, wanted finite numbers")
    u, _, vt = np.linalg.svd(out[..., :3, :3])
    flip = np.ones((*out.shape[:-2], 3))
    flip[..., 2] = np.linalg.det(u @ vt)
    out[..., :3, :3] = (u * flip[..., None, :]) @ vt
    return out


def as_transform(name: str, value: ArrayLike) -> Floats:
    """Return one rigid transform (4, 4), read-only, its rotation exact to rounding; position in m."""
    frame = one_pose(name, value)
    turn = frame[:3, :3]
    if (
        np.abs(turn.T @ turn - np.eye(3)).max() > ROUNDING
    ):  # otherwise kept to the bit: a copy is the same arm
        frame = nearest_rotation(frame)
    return frozen(frame)


COLUMNS = ("x", "y", "z", "qw", "qx", "qy", "qz")
UNIT_TOLERANCE: float = _core.UNIT_TOLERANCE
"""Largest deviation of a quaternion's length from 1: the error of six printed digits."""


def poses_from_rows(rows: Floats, out: Floats | None = None) -> Floats:
    """Return poses (N, 4, 4) of rows (N, 7) = x, y, z (m), qw, qx, qy, qz.

    Quaternions are made exactly unit, and must be nearly unit. `out`, if given, is written and returned.

    Examples
    --------
    >>> poses_from_rows(np.array([[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]]))[0].tolist()[0]
    [-1.0, 0.0, 0.0, 1.0]
    """
    poses = np.empty((len(rows), 4, 4)) if out is None else out
    _core.rotations_many(Orientation.WXYZ, rows[:, 3:], poses, "wxyz")
    poses[:, :3, 3] = rows[:, :3]
    return poses


def rows_from_poses(poses: Floats) -> Floats:
    """Return rows (N, 7) = x, y, z (m), qw, qx, qy, qz of poses (N, 4, 4), qw >= 0.

    Of the four ways to compute a quaternion from a matrix each row uses the one with the largest divisor
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
