"""Joint angles and their slopes as functions of the arm angle, in place of Eqs. (26)-(34).

Pivot joints (1, 3, 5, 7) are atan2 of two linear functions of the redundancy circle, hinge
joints (2, 6) the arccos of one. A linear function is an array (3,) of the coefficients of
sin psi, cos psi and 1. Angles are model angles in radians.
"""

import numpy as np

from reference.mended import Circle, circle, model_solution, on_circle
from reference.mended_arm import Arm, Array

PIVOTS = (1, 3, 5, 7)
HINGES = (2, 6)


def joint_sign(ring: Circle, joint: int) -> int:
    """GC sign that goes with a joint: of the shoulder for 1 to 3, of the wrist for 5 to 7."""
    return ring.signs[0] if joint < 4 else ring.signs[2]


def pivot_functions(ring: Circle, joint: int) -> tuple[Array, Array]:
    """Linear functions (U, V), each (3,), with theta = atan2(U, V), for joint 1, 3, 5 or 7.

    Eqs. (17), (19), (22), (24) with their GC sign; where joint 1 (5) is undefined on the whole
    circle it is 0 and joint 3 (7) takes all of the turn.
    """
    m, n, g = ring.shoulder, ring.wrist, joint_sign(ring, joint)
    if (ring.shoulder_locked and joint < 4) or (ring.wrist_locked and joint > 4):
        constant = np.array([0.0, 0.0, 1.0])
        return {
            1: (0 * constant, constant),
            3: (m[:, 1, 0], -m[:, 1, 2]),
            5: (0 * constant, constant),
            7: (n[:, 1, 0], n[:, 1, 1]),
        }[joint]
    return {
        1: (g * m[:, 1, 1], g * m[:, 0, 1]),
        3: (-g * m[:, 2, 2], -g * m[:, 2, 0]),
        5: (g * n[:, 1, 2], g * n[:, 0, 2]),
        7: (g * n[:, 2, 1], -g * n[:, 2, 0]),
    }[joint]


def hinge_function(ring: Circle, joint: int) -> Array:
    """Linear function H, shape (3,), with cos theta = H, for joint 2 or 6, Eqs. (18), (23)."""
    return ring.shoulder[:, 2, 1] if joint == 2 else ring.wrist[:, 2, 2]


def turning_function(u: Array, v: Array) -> Array:
    """Linear function V U' - U V', shape (3,): the slope of atan2(U, V) up to U^2 + V^2.

    In place of (a_t, b_t, c_t) of Eq. (29); no GC sign of its own.
    """
    return np.array([u[2] * v[1] - u[1] * v[2], u[0] * v[2] - u[2] * v[0], u[0] * v[1] - u[1] * v[0]])


def roots(f: Array) -> list[float]:
    """Arm angles in [-2 pi, 2 pi] where a linear function (3,) is zero, two, or none.

    Both always come from one arctangent and one arccosine; the half-angle forms (30), (31),
    (32), (34), (35) divide by zero where a root is at pi.
    """
    a, b, c = (float(x) for x in f)
    amplitude = np.hypot(a, b)
    if amplitude <= 1e-15 or abs(c) > amplitude:
        return []
    middle, half = np.arctan2(a, b), np.arccos(-c / amplitude)
    return [float(middle - half), float(middle + half)]


def derivative(ring: Circle, joint: int, psi: float) -> float:
    """Slope d theta / d psi of a joint, in place of Eqs. (28), (29), (33); NaN where singular."""
    if joint == 4:
        return 0.0
    if joint in PIVOTS:
        u, v = pivot_functions(ring, joint)
        top = float(on_circle(turning_function(u, v), psi))
        bottom = float(on_circle(u, psi) ** 2 + on_circle(v, psi) ** 2)
    else:
        if ring.shoulder_locked if joint == 2 else ring.wrist_locked:
            return 0.0
        h = hinge_function(ring, joint)
        top = float(h[1] * np.sin(psi) - h[0] * np.cos(psi))
        bottom = float(np.sin(model_solution(ring, psi)[joint - 1]))
    return top / bottom if bottom else float("nan")


def stationary(ring: Circle, joint: int) -> list[float]:
    """Arm angles where the slope of a joint is zero, in place of Eqs. (30) and (34), rad."""
    if joint in HINGES:
        h = hinge_function(ring, joint)
        return roots(np.array([-h[1], h[0], 0.0]))
    return roots(turning_function(*pivot_functions(ring, joint)))


def self_motion(arm: Arm, pose: Array, psi: float, gc: int) -> Array:
    """Slopes dq/dpsi of all joints at a tool pose, shape (7,); NaN where singular."""
    ring = circle(arm, pose, gc)
    return np.asarray(arm.signs * np.array([derivative(ring, joint, psi) for joint in range(1, 8)]))
