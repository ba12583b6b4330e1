"""Forward, arm angle and inverse of a general S-R-S arm, right also where the paper is not.

Built on ``mended_arm`` (joint map, frames) and used by ``mended_arcs`` (feasible arcs,
redundancy resolution). ``psi`` is the arm angle, ``gc`` the index 0 to 7 of the global
configuration, with a set bit for every negative sign: 1 shoulder, 2 elbow, 4 wrist.
Equations are numbered as in the paper (Faria et al. 2018).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reference.mended_arm import (
    Arm,
    Array,
    flange_pose,
    frames,
    joint_coordinates,
    model_angles,
    pose_of,
    wrap,
)

AXIS_TOLERANCE = 1e-7
"""Distance of the wrist from the base axis, in parts of the reach, below which azimuth is 0."""

REACH_SLACK = 64 * np.finfo(float).eps
"""Part of the reach by which rounding may put a stretched or folded arm out of reach."""

CIRCLE_TOLERANCE = 1e-13
"""Size of the entries of a rotation matrix that count as zero on the whole circle."""


class NoSolutionError(ValueError):
    """The wrist is too far, too near, or exactly in the shoulder."""


def gc_signs(gc: int) -> tuple[int, int, int]:
    """Signs (GC_2, GC_4, GC_6), each +1 or -1, of an index 0 to 7."""
    return 1 - 2 * (gc & 1), 1 - (gc & 2), 1 - (gc & 4) // 2


def gc_index(arm: Arm, theta: Array) -> int:
    """Index 0 to 7 of the global configuration of model angles (7,), Eq. (2).

    Joint 4 is counted from the stretched arm, which is at 0 only without elbow offsets.
    """
    bent = theta[[1, 3, 5]] - np.array([0.0, arm.straight_angle, 0.0])
    return int((wrap(bent) < 0) @ np.array([1, 2, 4]))


def wrist_vector(arm: Arm, flange: Array) -> Array:
    """Vector from shoulder to wrist of 0T7 in its own base axes, m, shape (3,), Eq. (3)."""
    return np.asarray(flange[:3, 3] - np.array([0.0, 0.0, arm.d_bs]) - arm.d_wf * flange[:3, 2])


def elbow(arm: Arm, n: float, gc_4: int) -> tuple[float, float]:
    """Elbow angle theta_4 and shoulder angle beta (rad) at wrist distance n (m), Eqs. (4), (6).

    ``beta`` turns the shoulder-wrist line into the y axis of frame 3, about the elbow axis.
    Raises ``NoSolutionError`` outside the reach and for n = 0.
    """
    longest, shortest = arm.reach, abs(arm.upper_arm - arm.forearm)
    slack = REACH_SLACK * longest
    if n == 0 or n > longest + slack or n < shortest - slack:
        raise NoSolutionError(f"wrist at {n} m, reach is {shortest} to {longest} m")
    stretch = max(longest - n, 0.0) * (longest + n)
    fold = max(n - shortest, 0.0) * (n + shortest)
    eta = 2 * np.arctan2(np.sqrt(stretch), np.sqrt(fold))
    x = (arm.upper_arm - arm.forearm) + 2 * arm.forearm * np.cos(eta / 2) ** 2
    y = gc_4 * arm.forearm * np.sin(eta)
    beta = np.arctan2(arm.a_3, arm.d_se) - np.arctan2(y, x)
    return float(wrap(arm.straight_angle + gc_4 * eta)), float(beta)


def reference_axis(arm: Arm, p: Array) -> Array:
    """Elbow axis of the reference plane: horizontal, normal to the wrist vector p, Eq. (5)."""
    r = np.hypot(p[0], p[1])
    horizontal = p[:2] / r if r > AXIS_TOLERANCE * arm.reach else np.array([1.0, 0.0])
    axis = np.array([horizontal[1], -horizontal[0], 0.0])
    w = p / np.linalg.norm(p)
    axis -= (axis @ w) * w
    return np.asarray(axis / np.linalg.norm(axis))


def virtual_rotation(arm: Arm, p: Array, beta: float) -> Array:
    """Rotation 0R3 of the arm at psi = 0, shape (3, 3), Eqs. (5)-(7) without angles."""
    w, z = p / np.linalg.norm(p), reference_axis(arm, p)
    across = np.cross(w, z)
    x = w * np.sin(beta) + across * np.cos(beta)
    y = w * np.cos(beta) - across * np.sin(beta)
    return np.stack([x, y, z], axis=1)


def angle_about(w: Array, start: Array, end: Array) -> float:
    """Angle (rad) from start to end, both normal to the unit vector w, about w."""
    return float(np.arctan2(w @ np.cross(start, end), start @ end))


def arm_angle(arm: Arm, q: Array) -> float:
    """Arm angle psi of joint coordinates (7,), rad, in place of Eqs. (8)-(11).

    By the elbow axis instead of the normal of the plane shoulder-elbow-wrist: exact at 0 and
    pi, and defined on a straight arm.
    """
    chain = frames(arm, model_angles(arm, q))
    p = wrist_vector(arm, chain[7])
    return angle_about(p / np.linalg.norm(p), reference_axis(arm, p), chain[3, :3, 2])


def forward(arm: Arm, q: Array) -> tuple[Array, float, int]:
    """Tool pose (4, 4), arm angle psi (rad) and gc index of joint coordinates (7,)."""
    return pose_of(arm, q), arm_angle(arm, q), gc_index(arm, model_angles(arm, q))


@dataclass(frozen=True)
class Circle:
    """Redundancy circle of one pose and global configuration, Eqs. (15) and (20).

    ``shoulder`` and ``wrist`` stack the matrices A, B, C of 0R3(psi) and 4R7(psi), (3, 3, 3);
    the flags say that theta_2 (theta_6) is 0 or pi on the whole circle.
    """

    signs: tuple[int, int, int]
    theta_4: float
    shoulder: Array
    wrist: Array

    @property
    def shoulder_locked(self) -> bool:
        """Whether theta_1 is undefined at every psi (arm straight up or down)."""
        return bool(np.abs(self.shoulder[:, :2, 1]).max() <= CIRCLE_TOLERANCE)

    @property
    def wrist_locked(self) -> bool:
        """Whether theta_5 is undefined at every psi (hand in line with the forearm)."""
        return bool(np.abs(self.wrist[:, :2, 2]).max() <= CIRCLE_TOLERANCE)


def circle(arm: Arm, pose: Array, gc: int) -> Circle:
    """Redundancy circle of a tool pose (4, 4) and gc index; ``NoSolutionError`` out of reach."""
    flange = flange_pose(arm, pose)
    p = wrist_vector(arm, flange)
    signs = gc_signs(gc)
    theta_4, beta = elbow(arm, float(np.linalg.norm(p)), signs[1])
    virtual = virtual_rotation(arm, p, beta)
    w = p / np.linalg.norm(p)
    along = np.outer(w, w)
    turn = np.cross(np.eye(3), w)
    shoulder = np.stack([turn @ virtual, (np.eye(3) - along) @ virtual, along @ virtual])
    c4, s4 = np.cos(theta_4), np.sin(theta_4)
    r_34 = np.array([[c4, 0.0, -s4], [s4, 0.0, c4], [0.0, -1.0, 0.0]])
    wrist = r_34.T @ shoulder.transpose(0, 2, 1) @ flange[:3, :3]
    return Circle(signs, theta_4, shoulder, wrist)


def on_circle(coefficients: Array, psi: float | Array) -> NDArray[np.float64]:
    """Value at psi (...) of sin, cos and constant terms stacked on axis 0, shape (..., *rest)."""
    terms = np.stack([np.sin(psi), np.cos(psi), np.ones_like(psi)], axis=-1)
    return np.tensordot(terms, coefficients, axes=1)


def _unit(x: Array, y: Array, sign: int, locked: bool) -> tuple[Array, Array]:
    """Direction sign (x, y) of unit length; (1, 0) where there is none, or everywhere if `locked`."""
    length = np.hypot(x, y)
    lost = (length == 0) | locked
    divisor = np.where(lost, 1.0, length)
    return np.where(lost, 1.0, sign * x / divisor), np.where(lost, 0.0, sign * y / divisor)


def model_solution(ring: Circle, psi: float | Array) -> Array:
    """Model angles at arm angles psi (...), rad in [-pi, pi], shape (..., 7), for (17)-(24).

    Joints 3 and 7 are solved with joints 1 and 5 given, so that what those lose near a
    singular posture is not lost to the pose.
    """
    m, n = on_circle(ring.shoulder, psi), on_circle(ring.wrist, psi)
    g2, _, g6 = ring.signs
    c1, s1 = _unit(m[..., 0, 1], m[..., 1, 1], g2, ring.shoulder_locked)
    c5, s5 = _unit(n[..., 0, 2], n[..., 1, 2], g6, ring.wrist_locked)
    theta = [
        np.arctan2(s1, c1),
        g2 * np.arctan2(np.hypot(m[..., 0, 1], m[..., 1, 1]), m[..., 2, 1]),
        np.arctan2(c1 * m[..., 1, 0] - s1 * m[..., 0, 0], s1 * m[..., 0, 2] - c1 * m[..., 1, 2]),
        np.full_like(c1, ring.theta_4),
        np.arctan2(s5, c5),
        g6 * np.arctan2(np.hypot(n[..., 0, 2], n[..., 1, 2]), n[..., 2, 2]),
        np.arctan2(c5 * n[..., 1, 0] - s5 * n[..., 0, 0], c5 * n[..., 1, 1] - s5 * n[..., 0, 1]),
    ]
    return np.stack(theta, axis=-1)


def inverse(arm: Arm, pose: Array, psi: float, gc: int, seed: Array | None = None) -> Array:
    """Joint coordinates (7,) of a tool pose, arm angle and gc index, rad, section 4.

    Limits only choose the winding, see ``joint_coordinates``.
    """
    return joint_coordinates(arm, model_solution(circle(arm, pose, gc), psi), seed)
