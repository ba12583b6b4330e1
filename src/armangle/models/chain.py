"""A serial chain of rotating joints from a robot file, and its forward kinematics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .description import ArmDescription, OffsetDescription

FloatArray = NDArray[np.float64]

_QUARTER_TURN_X = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
_QUARTER_TURN_BACK_X = _QUARTER_TURN_X.T


@dataclass(frozen=True, eq=False)
class Joint:
    """One rotating joint of a chain.

    `name` in the source; `origin` (4, 4), its frame at q = 0 in that of the joint before it (in the base
    link, for the first); `axis` (3,), unit vector of positive rotation in its own frame; limits `lower` and
    `upper`, rad, and largest `velocity`, rad/s, infinite if there is none, or it is unknown.
    """

    name: str
    origin: FloatArray
    axis: FloatArray
    lower: float = float("-inf")
    upper: float = float("inf")
    velocity: float = float("inf")


@dataclass(frozen=True, eq=False)
class Chain:
    """The joints from a base link to a tip link; fixed joints are merged into the frames.

    `name` of the robot; names of the links `base` and `tip`; `joints` from base to tip; `tip_origin` (4, 4),
    frame of the tip link in that of the last joint; `source`, origin of the chain in words; `notes` of the
    reader.
    """

    name: str
    base: str
    tip: str
    joints: tuple[Joint, ...]
    tip_origin: FloatArray
    source: str = "text"
    notes: tuple[str, ...] = ()

    def forward(self, q: ArrayLike) -> FloatArray:
        """Return the poses (..., 4, 4) of the tip link in the base link at joints (..., n), rad."""
        return self.frames(q)[-1]

    def frames(self, q: ArrayLike) -> list[FloatArray]:
        """Return the frames (..., 4, 4) of the joints, not turned by their own angle, and of the tip link."""
        angles = np.asarray(q, dtype=np.float64)
        pose, frames = np.broadcast_to(np.eye(4), (*angles.shape[:-1], 4, 4)), list[FloatArray]()
        for index, joint in enumerate(self.joints):
            frames.append(np.asarray(pose @ joint.origin))
            pose = frames[-1] @ rotation_about(joint.axis, angles[..., index])
        return [*frames, np.asarray(pose @ self.tip_origin, dtype=np.float64)]

    def swept(self, q: FloatArray, joint: int, angles: FloatArray) -> FloatArray:
        """Return the poses (n, k, 4, 4) of the tip link at joints `q` (n, joints), rad, but for that of index
        `joint`, which is at `angles` (n, k), rad.
        """
        frames = self.frames(q)
        turns = rotation_about(self.joints[joint].axis, angles - q[:, joint, None])
        after = np.linalg.solve(frames[joint], frames[-1])
        return np.asarray(frames[joint][:, None] @ turns @ after[:, None])

    def lines(self) -> tuple[FloatArray, FloatArray]:
        """Return the joint axes at q = 0 in the base link: points (n, 3), one on each, m, and unit vectors
        (n, 3).
        """
        frames = self.frames(np.zeros(len(self.joints)))[:-1]
        directions = [frame[:3, :3] @ joint.axis for frame, joint in zip(frames, self.joints, strict=True)]
        return np.array([frame[:3, 3] for frame in frames]), np.array(directions)


def chain_of(arm: ArmDescription) -> Chain:
    """Return the chain of an arm: its own, or that of its lengths: joint i rotates about the z axis of DH
    frame i-1.

    Source: Faria et al. (2018), Table 1 and Eq. (1), with a_3, a_4 and d_4 added, and a_1 or a_6.
    """
    if arm.chain is None:
        origins = [arm.base, *(_link(arm, row) for row in range(7))]
        origins[7] = origins[7] @ arm.tool
        senses = [float(sign) for sign in arm.signs]
    else:
        origins, senses = list(arm.chain), [1.0] * 7
    joints = tuple(
        Joint(
            name=arm.joint_names[i],
            origin=origins[i],
            axis=np.array([0.0, 0.0, senses[i]]),
            lower=arm.lower[i],
            upper=arm.upper[i],
            velocity=arm.velocity[i],
        )
        for i in range(7)
    )
    return Chain(arm.name, "base", "tip", joints, origins[7])


def links_of(chain: Chain) -> FloatArray:
    """Return the fixed transforms L0..L7 (8, 4, 4) with tip pose = L0 Rz(q1) L1 ... Rz(q7) L7."""
    turns = [_onto(joint.axis) for joint in chain.joints]
    befores = [np.eye(4), *(turn.T for turn in turns)]
    origins = [*(joint.origin for joint in chain.joints), chain.tip_origin]
    afters = [*turns, np.eye(4)]
    return np.array([b @ o @ a for b, o, a in zip(befores, origins, afters, strict=True)])


def _onto(axis: FloatArray) -> FloatArray:
    """Return a rotation (4, 4) whose z axis is a unit vector (3,)."""
    start = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(start, axis)
    x /= np.linalg.norm(x)
    turn = np.eye(4)
    turn[:3, :3] = np.column_stack([x, np.cross(axis, x), axis])
    return turn


def _link(arm: ArmDescription, row: int) -> FloatArray:
    """Return the transform (4, 4) from DH frame `row` to the next, with the joint between them at 0."""
    step = translation([0.0, 0.0, (arm.d_bs, 0.0, arm.d_se, arm.d_4, arm.d_ew, 0.0, arm.d_wf)[row]])
    a_1, a_6 = (arm.a_1, arm.a_6) if isinstance(arm, OffsetDescription) else (0.0, 0.0)
    step[0, 3] = (a_1, 0.0, arm.a_3, arm.a_4, 0.0, a_6, 0.0)[row]
    back, on = _QUARTER_TURN_BACK_X, _QUARTER_TURN_X
    twist = (back, on, on, back, back, on, np.eye(4))[row]
    return rotation_about(np.array([0.0, 0.0, 1.0]), np.float64(arm.offsets[row])) @ step @ twist


def rotation_about(axis: FloatArray, angle: FloatArray | np.float64) -> FloatArray:
    """Return the homogeneous rotation (..., 4, 4) about a unit axis (3,) by angles (...), rad."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine = np.sin(angle)[..., None, None]
    versine = (2.0 * np.sin(np.asarray(angle) / 2.0) ** 2)[..., None, None]
    turn = np.zeros((*np.shape(angle), 4, 4))
    turn[..., :3, :3] = np.eye(3) + sine * cross + versine * (cross @ cross)
    turn[..., 3, 3] = 1.0
    return turn


def translation(xyz: ArrayLike) -> FloatArray:
    """Return the homogeneous translation (4, 4) by ``xyz`` (3,), m."""
    shift = np.eye(4)
    shift[:3, 3] = xyz
    return shift


def rigid_inverse(pose: FloatArray) -> FloatArray:
    """Return the inverse (4, 4) of a homogeneous matrix whose 3x3 block is a rotation."""
    inverse = np.eye(4)
    inverse[:3, :3] = pose[:3, :3].T
    inverse[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return inverse


def to_rpy(pose: FloatArray) -> tuple[float, float, float]:
    """Return roll, pitch, yaw (rad) of a frame (4, 4); exact to rounding also at pitch 90 deg.

    Yaw is computed first and roll from the remainder, so that an ill-conditioned yaw does not spoil the
    product.
    """
    r = pose[:3, :3]
    pitch = np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0]))
    yaw = np.arctan2(r[1, 0], r[0, 0])
    sine, cosine = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(sine * r[0, 2] - cosine * r[1, 2], cosine * r[1, 1] - sine * r[0, 1])
    return float(roll), float(pitch), float(yaw)
