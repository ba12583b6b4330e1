"""Where the viewer begins, and how a dragged tool gets from pose to pose."""

from __future__ import annotations

import numpy as np

from .._arrays import Floats
from ..arm.arm import Arm, nearest_rotation
from ..quaternions import poses_from_rows, rows_from_poses

_REACH_STEP = 0.01  # m of the tool in one step of a drag
_TURN_STEP = np.radians(2.0)  # rad of the tool in one step of a drag
_MOST_STEPS = 200
_BENT = (0.6, 1.3, 0.6)  # rad from straight: joints 2, 4, 6
_ASIDE = (0.0, 0.35, 0.3)  # rad from the middle: joints 1, 3, 5, so that no link lies in a common plane
_ROOM = 0.2  # rad to the nearest limit that is worth a better bend


def bent_posture(arm: Arm) -> Floats:
    """Return joints (7,), rad, within the limits, with shoulder, elbow and wrist bent enough to be seen."""
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    middle = np.where(lower <= upper, 0.5 * (lower + upper), np.clip(0.0, arm.lower, arm.upper))
    middle[[0, 2, 4]] += _ASIDE
    best, best_bend = middle, -np.inf
    for signs in np.ndindex(2, 2, 2):
        theta = arm.signs * middle + arm.offsets
        theta[[1, 3, 5]] = np.where(np.array(signs) == 0, 1.0, -1.0) * _BENT
        theta[3] += arm.delta
        q = np.clip(arm.signs * (theta - arm.offsets), arm.lower, arm.upper)
        reached = arm.signs * q + arm.offsets - np.array([0, 0, 0, arm.delta, 0, 0, 0])
        room = float(np.minimum(q - arm.lower, arm.upper - q).min())
        bend = float(np.abs(np.sin(reached[[1, 3, 5]])).min()) + min(room, _ROOM)
        if bend > best_bend + 1e-9:
            best, best_bend = q, bend
    return np.clip(best, arm.lower, arm.upper)


def ways_between(first: Floats, last: Floats) -> Floats:
    """Return poses (N, 4, 4) from `first` (left out) to `last`, near enough to each other to step along."""
    way = last[:3, 3] - first[:3, 3]
    turn = _rotation_vector(first[:3, :3].T @ last[:3, :3])
    wanted = max(np.linalg.norm(way) / _REACH_STEP, np.linalg.norm(turn) / _TURN_STEP, 1.0)
    count = int(min(np.ceil(wanted), _MOST_STEPS))
    share = np.arange(1, count + 1)[:, None] / count
    poses = _turned(share * turn)
    poses[:, :3, :3] = first[:3, :3] @ poses[:, :3, :3]
    poses[:, :3, 3] = first[:3, 3] + share * way
    poses[-1] = last
    return nearest_rotation(poses)


def _rotation_vector(rotation: Floats) -> Floats:
    """Return axis times angle (rad) of a rotation (3, 3)."""
    pose = np.eye(4)
    pose[:3, :3] = rotation
    w, *xyz = rows_from_poses(pose[None])[0, 3:]
    sine = float(np.linalg.norm(xyz))
    return np.array(xyz) * (2 * np.arctan2(sine, w) / sine if sine > 0 else 0.0)


def _turned(vectors: Floats) -> Floats:
    """Return poses (N, 4, 4) at the origin turned by rotation vectors (N, 3)."""
    half = 0.5 * np.linalg.norm(vectors, axis=1)[:, None]
    axis = vectors / np.maximum(2 * half, np.finfo(float).tiny)
    return poses_from_rows(np.hstack([np.zeros_like(vectors), np.cos(half), np.sin(half) * axis]))
