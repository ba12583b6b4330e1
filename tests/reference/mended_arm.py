"""General S-R-S arm: joint coordinates, frames, pose and Jacobian, without the paper's slips.

Model angles theta (the paper's) belong to the joint coordinates q of the robot by
``theta_i = signs_i q_i + offsets_i``. Two lateral elbow offsets a_3, a_4 widen Table 1 of the
paper; shoulder and wrist stay spherical. The pose is ``base @ 0T7(theta) @ tool``. Angles are
in radians, lengths in metres, joints are numbered 1 to 7.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ANGLE_TOLERANCE = 1e-9
"""The one angular tolerance of membership in limits and arcs, rad."""

_TWISTS = np.pi / 2 * np.array([-1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 0.0])


def _unlimited(sign: float) -> Array:
    """Infinite limits (7,) of this sign."""
    return np.full(7, sign * np.inf)


@dataclass(frozen=True)
class Arm:
    """Lengths (m), joint map, limits on q (rad, shape (7,)) and fixed frames (4, 4) of an arm."""

    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    a_3: float = 0.0
    a_4: float = 0.0
    signs: Array = field(default_factory=lambda: np.ones(7))
    offsets: Array = field(default_factory=lambda: np.zeros(7))
    lower: Array = field(default_factory=lambda: _unlimited(-1.0))
    upper: Array = field(default_factory=lambda: _unlimited(1.0))
    base: Array = field(default_factory=lambda: np.eye(4))
    tool: Array = field(default_factory=lambda: np.eye(4))

    @property
    def upper_arm(self) -> float:
        """Distance from shoulder to the axis of joint 4, m."""
        return float(np.hypot(self.a_3, self.d_se))

    @property
    def forearm(self) -> float:
        """Distance from the axis of joint 4 to the wrist, m."""
        return float(np.hypot(self.a_4, self.d_ew))

    @property
    def reach(self) -> float:
        """Greatest distance from shoulder to wrist, whatever the limits, m."""
        return self.upper_arm + self.forearm

    @property
    def straight_angle(self) -> float:
        """Model angle theta_4 of the stretched arm (delta), rad."""
        cross = self.d_se * self.a_4 - self.a_3 * self.d_ew
        return float(np.arctan2(cross, self.a_3 * self.a_4 + self.d_se * self.d_ew))

    @property
    def model_limits(self) -> tuple[Array, Array]:
        """Limits on the model angles theta, rad, two arrays (7,)."""
        ends = self.signs * np.stack([self.lower, self.upper]) + self.offsets
        return ends.min(axis=0), ends.max(axis=0)


def iiwa7() -> Arm:
    """KUKA LBR iiwa 7 R800: lengths and limits from its data sheet, flange as tool."""
    limit = np.radians([170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0])
    return Arm(0.34, 0.4, 0.4, 0.126, lower=-limit, upper=limit)


def with_limits(arm: Arm, lower: Array, upper: Array) -> Arm:
    """The same arm with other limits on q, rad, shape (7,)."""
    return replace(arm, lower=np.asarray(lower, float), upper=np.asarray(upper, float))


def wrap(angle: float | Array) -> NDArray[np.float64]:
    """Angle brought to (-pi, pi], rad, the shape of its input; one already there is unchanged."""
    turns = np.ceil(np.asarray(angle) / (2 * np.pi) - 0.5)
    return np.asarray(angle - 2 * np.pi * turns)


def model_angles(arm: Arm, q: Array) -> Array:
    """Model angles theta of joint coordinates q, rad, shape (..., 7)."""
    return arm.signs * q + arm.offsets


def _joint_winding(value: float, lower: float, upper: float, seed: float | None) -> float:
    """Turn of one joint coordinate (rad) that its range, then the seed or the middle, asks for."""
    middle = (lower + upper) / 2 if np.isfinite(lower) and np.isfinite(upper) else 0.0
    wanted = middle if seed is None else seed
    near = [wanted] + [end for end in (lower, upper) if np.isfinite(end)]
    turns = {int(np.rint((x - value) / (2 * np.pi))) + step for x in near for step in (-1, 0, 1)}
    candidates = [value + 2 * np.pi * k for k in sorted(turns)]

    def rank(candidate: float) -> tuple[float, float]:
        """How far (rad) a candidate is outside the limits, then from the wish."""
        outside = max(lower - candidate, candidate - upper, 0.0)
        return (outside if outside > ANGLE_TOLERANCE else 0.0, abs(candidate - wanted))

    return min(candidates, key=rank)


def joint_coordinates(arm: Arm, theta: Array, seed: Array | None = None) -> Array:
    """Joint coordinates q of model angles, rad, shape (..., 7), each with the right winding.

    The winding lies within the limits; of several the one nearest to the seed (7,), without a
    seed nearest to the middle of the range (0 for an infinite one); of none the one nearest to
    the range.
    """
    q = np.array(arm.signs * (theta - arm.offsets))
    for index in np.ndindex(q.shape):
        i = index[-1]
        near = None if seed is None else float(seed[i])
        q[index] = _joint_winding(float(q[index]), float(arm.lower[i]), float(arm.upper[i]), near)
    return q


def frames(arm: Arm, theta: Array) -> Array:
    """Frames 0T0, ..., 0T7 of model angles (7,), without base and tool, shape (8, 4, 4)."""
    a = [0.0, 0.0, arm.a_3, arm.a_4, 0.0, 0.0, 0.0]
    d = [arm.d_bs, 0.0, arm.d_se, 0.0, arm.d_ew, 0.0, arm.d_wf]
    chain = [np.eye(4)]
    for i, angle in enumerate(theta):
        turn, shift, twist = np.eye(4), np.eye(4), np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        shift[:3, 3] = [a[i], 0.0, d[i]]
        ca, sa = np.cos(_TWISTS[i]), np.sin(_TWISTS[i])
        twist[1:3, 1:3] = [[ca, -sa], [sa, ca]]
        chain.append(chain[-1] @ turn @ shift @ twist)
    return np.stack(chain)


def pose_of(arm: Arm, q: Array) -> Array:
    """Pose of the tool frame of joint coordinates (7,), shape (4, 4)."""
    return np.asarray(arm.base @ frames(arm, model_angles(arm, q))[7] @ arm.tool)


def flange_pose(arm: Arm, pose: Array) -> Array:
    """0T7 of a tool pose: base and tool taken off, shape (4, 4)."""
    return np.linalg.inv(arm.base) @ pose @ np.linalg.inv(arm.tool)
