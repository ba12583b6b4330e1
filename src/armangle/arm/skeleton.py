"""The arm as points in space, and the joints that block its elbow; for plots and the viewer."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import JOINTS, Floats, as_floats
from .._core import Wanted
from ..scenes.scene import Scene
from .arcs import ArcSet
from .arm import Arm

SHOULDER, ELBOW, WRIST = 1, 3, 5
BY_OBSTACLE, NOT_PROVEN = JOINTS + 1, JOINTS + 2
"""Blockers that are no joint: an obstacle, or a missing proof for an arm that is not S-R-S."""


def skeleton(arm: Arm, q: ArrayLike) -> Floats:
    """Return the corners (..., 8, 3) of the stick figure at joints (..., 7), rad.

    Base, shoulder, the end of d_se, elbow, the start of d_ew, wrist, flange, tool; m, in the frame that poses
    are given in. Points 2, 3 and 4 coincide if the elbow has no offset (a_3, a_4, d_4). The ninth corner of
    an offset wrist or shoulder is in `corners` alone.
    """
    frames = arm.frames(q)
    points = frames[..., [0, 1, 3, 3, 4, 5, 7, 7], :3, 3]
    points[..., 2, :] -= arm.geometry.a_3 * frames[..., 3, :3, 0]
    points[..., 7, :] = (frames[..., 7, :, :] @ arm.tool)[..., :3, 3]
    return points


def elbow_points(arm: Arm, pose: ArrayLike, gc: int, psi: ArrayLike) -> Floats:
    """Return the positions (..., 3) of the elbow on its circle at arm angles (...), rad.

    m, in the frame that poses are given in. NaN without a solution, for an arm that is not S-R-S; raises
    `UnreachableError` if the pose (4, 4) is out of reach of an S-R-S arm.
    """
    if arm.kind == "srs":
        return arm.elbow(arm.inverse(pose, psi, gc, limits=False))
    q = arm.inverse(pose, psi, gc, limits=False, on_error="nan")
    known = np.isfinite(q).all(axis=-1)
    points = np.full((*known.shape, 3), np.nan)
    points[known] = arm.elbow(q[known])
    return points


def blockers(arm: Arm, poses: ArrayLike, gc: ArrayLike, psi: ArrayLike) -> NDArray[np.bool_]:
    """Return for each joint whether its limits forbid an arm angle, (..., 7).

    `psi` (...), rad, broadcasts with `poses` (..., 4, 4) and `gc` (...). True if joint i + 1 violates its
    limits (or margins) there; all True out of reach. False if that is not proven for an arm that is not
    S-R-S: `unproven`. Raises as `Arm.feasible`.
    """
    each = arm.feasible(poses, gc, per_joint=True)
    angles = as_floats("psi", psi)[..., None]
    blocked: NDArray[np.bool_] = np.logical_not(each.contains(angles))
    if arm.kind == "srs":
        return blocked
    unproven = arm._left_out(poses, gc, Wanted.JOINTS).contains(angles)
    blocked &= np.logical_not(unproven)
    return blocked


def unproven(arm: Arm, poses: ArrayLike, gc: ArrayLike, psi: ArrayLike) -> NDArray[np.bool_]:
    """Return whether an arm angle is in the part that is proven neither feasible nor blocked."""
    left_out = arm._left_out(poses, gc)
    return np.asarray(left_out.contains(as_floats("psi", psi)), dtype=np.bool_)


def unsolved(arm: Arm, poses: ArrayLike, gc: ArrayLike) -> ArcSet:
    """Return the values of the free joint without any solution, in or out of limits, for each pose.

    It is empty for an arm with an arm angle, whose circle is whole.
    """
    if arm.redundancy == "arm_angle":
        return ArcSet._empty(arm._branches(poses, gc)[0])
    loose = arm.with_(lower=-np.inf, upper=np.inf, scene=None)
    return (~loose.feasible(poses, gc))._less(loose._left_out(poses, gc))


def corners(arm: Arm, q: ArrayLike) -> Floats:
    """Return the 8 points of `skeleton` (..., n, 3), m; 9 with the corner of an offset wrist or shoulder."""
    points = skeleton(arm, q)
    if arm.redundancy == "arm_angle":
        return points
    frames = arm.frames(q)
    if arm.geometry.a_1:
        turned = frames[..., 1, :3, 3] - arm.geometry.a_1 * frames[..., 1, :3, 0]
        return np.insert(points, SHOULDER, turned, axis=-2)
    return np.insert(points, WRIST + 1, frames[..., 6, :3, 3], axis=-2)


def alike(one: Arm, other: Arm) -> bool:
    """Return whether two arms are equal except for their obstacles and singularity margin."""
    return one.with_(scene=None, singularity_margin=0.0) == other.with_(scene=None, singularity_margin=0.0)


def blocker_of(
    arm: Arm, poses: ArrayLike, gc: ArrayLike, psi: Floats, scene: Scene | None = None
) -> NDArray[np.int64]:
    """Return what forbids each arm angle, shape (...): the lowest joint 1..7, else `NOT_PROVEN`, else
    `BY_OBSTACLE` (with a scene); 0 for nothing. Arguments are those of `blockers`.
    """
    blocked = blockers(arm, poses, gc, psi)
    who = np.where(blocked.any(axis=-1), blocked.argmax(axis=-1) + 1, 0)
    who = np.where((who == 0) & unproven(arm, poses, gc, psi), NOT_PROVEN, who)
    if scene is not None:
        clear = arm._clear(poses, gc, scene).contains(psi)
        who = np.where((who == 0) & np.logical_not(clear), BY_OBSTACLE, who)
    return who
