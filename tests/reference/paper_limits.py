"""Sections 5 and 6 of the paper, equation by equation: (25)-(36), as printed.

A linear function ``a sin psi + b cos psi + c`` of the redundancy circle is a triple (a, b, c).
The printed half-angle forms are evaluated as they stand: a zero denominator gives NaN or
infinity under the arctan, and no real root gives NaN. Angles are in radians.

Source: Faria et al. (2018), see ``paper``.
"""

import numpy as np
from numpy.typing import NDArray

from reference.paper import Array

Linear = tuple[float, float, float]
"""Coefficients (a, b, c) of a sin psi + b cos psi + c."""

Interval = tuple[float, float]
"""Lower and upper end of arm angles within [-pi, pi], rad."""

Matrices = tuple[Array, Array, Array]
"""A, B, C of Eq. (15) or (20), each (3, 3)."""


def _half_angle(numerator: Array, denominator: float) -> Array:
    """2 arctan(numerator / denominator) with IEEE division by zero."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return 2 * np.arctan(numerator / np.float64(denominator))


def _plus_minus_root(square: float) -> Array:
    """The two square roots, + first, shape (2,); NaN for a negative number."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.array([1.0, -1.0]) * np.sqrt(np.float64(square)))


def linear(coefficients: Linear, psi: float | Array) -> NDArray[np.float64]:
    """Value of a sin psi + b cos psi + c, the shape of psi."""
    a, b, c = coefficients
    return np.asarray(a * np.sin(psi) + b * np.cos(psi) + c)


def pivot_coefficients(joint: int, shoulder: Matrices, wrist: Matrices) -> tuple[Linear, Linear]:
    """Numerator and denominator (n, d) of tan theta_i of joint 1, 3, 5 or 7, each (a, b, c) of Eq. (26), from
    Eqs. (17), (19), (22), (24).
    """
    row, column, sign = {
        1: ((1, 0), (1, 1), (1, 1)),
        3: ((2, 2), (2, 0), (-1, -1)),
        5: ((1, 0), (2, 2), (1, 1)),
        7: ((2, 2), (1, 0), (1, -1)),
    }[joint]
    a, b, c = shoulder if joint < 4 else wrist
    first, second = (
        (s * float(a[i, j]), s * float(b[i, j]), s * float(c[i, j]))
        for i, j, s in zip(row, column, sign, strict=True)
    )
    return first, second


def hinge_coefficients(joint: int, shoulder: Matrices, wrist: Matrices) -> Linear:
    """Coefficients (a, b, c) of joint 2 or 6 in Eqs. (18), (23) for Eq. (27)."""
    a, b, c = shoulder if joint == 2 else wrist
    i, j = (2, 1) if joint == 2 else (2, 2)
    return float(a[i, j]), float(b[i, j]), float(c[i, j])


def intersect(first: list[Interval], second: list[Interval]) -> list[Interval]:
    """Intersection of two unions of intervals on [-pi, pi], Eq. (25).

    Erratum (Fig. 11): arm angles live on a circle; an interval that holds +-pi is cut in two
    here, and (36) then repels from the cut.
    """
    pairs = [(max(a, c), min(b, d)) for a, b in first for c, d in second]
    return sorted(pair for pair in pairs if pair[0] <= pair[1])


def pivot_angle(n: Linear, d: Linear, gc_k: int, psi: float | Array) -> NDArray[np.float64]:
    """Pivot joint angle theta_i(psi), i = 1, 3, 5, 7, rad, Eq. (26)."""
    return np.asarray(np.arctan2(gc_k * linear(n, psi), gc_k * linear(d, psi)))


def hinge_angle(h: Linear, gc_k: int, psi: float | Array) -> NDArray[np.float64]:
    """Hinge joint angle theta_i(psi), i = 2, 6, rad, Eq. (27)."""
    return np.asarray(gc_k * np.arccos(np.clip(linear(h, psi), -1.0, 1.0)))


def pivot_derivative(n: Linear, d: Linear, gc_k: int, psi: float) -> float:
    """Derivative of a pivot joint angle by u, v and their slopes, Eq. (28)."""
    u, v = gc_k * linear(n, psi), gc_k * linear(d, psi)
    u_slope = gc_k * (n[0] * np.cos(psi) - n[1] * np.sin(psi))
    v_slope = gc_k * (d[0] * np.cos(psi) - d[1] * np.sin(psi))
    return float(v * u_slope / (v**2 + u**2) - u * v_slope / (v**2 + u**2))


def turning_coefficients(n: Linear, d: Linear, gc_k: int) -> Linear:
    """Coefficients (a_t, b_t, c_t) below Eq. (29).

    Erratum: u and v both carry GC_k, so that their product does not; (29) has the wrong sign
    for GC_k = -1.
    """
    a_t = gc_k * (n[2] * d[1] - n[1] * d[2])
    b_t = gc_k * (n[0] * d[2] - n[2] * d[0])
    c_t = gc_k * (n[0] * d[1] - n[1] * d[0])
    return a_t, b_t, c_t


def pivot_derivative_short(n: Linear, d: Linear, gc_k: int, psi: float) -> float:
    """Derivative of a pivot joint angle after simplification, Eq. (29)."""
    squares = linear(n, psi) ** 2 + linear(d, psi) ** 2
    return float(linear(turning_coefficients(n, d, gc_k), psi) / squares)


def pivot_stationary(t: Linear) -> Array:
    """Stationary arm angles of a pivot joint from (a_t, b_t, c_t), rad, shape (2,), Eq. (30).

    Erratum: b_t = c_t divides by zero; one root is then pi and the other one is lost.
    """
    a_t, b_t, c_t = t
    return _half_angle(a_t + _plus_minus_root(a_t**2 + b_t**2 - c_t**2), b_t - c_t)


def stationary_count(t: Linear) -> int:
    """Number of stationary points by the sign of a_t^2 + b_t^2 - c_t^2, section 5.1.

    The list of the three cases is missing from the text at hand and is reconstructed from the
    headings 5.1.1 to 5.1.3: two stationary points, none, and one "indeterminate" arm angle.
    Erratum: zero also belongs to a joint that does not move, and "close to zero" is common.
    """
    a_t, b_t, c_t = t
    return 1 + int(np.sign(a_t**2 + b_t**2 - c_t**2))


def singular_arm_angle(t: Linear) -> float:
    """Singular arm angle of a pivot joint, rad, Eq. (31).

    Erratum: undefined for b_t = c_t (psi = pi), which is where theta_2 = 0 always lies when
    theta_4 is positive.
    """
    a_t, b_t, c_t = t
    return float(_half_angle(np.array([a_t]), b_t - c_t)[0])


def pivot_limit_arm_angles(n: Linear, d: Linear, gc_k: int, limit: float) -> Array:
    """Arm angles at which a pivot joint meets a limit, rad, shape (2,), Eq. (32).

    Erratum: tan(limit) also finds limit +- pi and does not tell pi/2 from -pi/2; a_p = 0
    divides by zero, one root is then pi and the other one is lost.
    """
    tangent = np.tan(limit)
    a_p = gc_k * ((d[2] - d[1]) * tangent + (n[1] - n[2]))
    b_p = 2 * gc_k * (d[0] * tangent - n[0])
    c_p = gc_k * ((d[1] + d[2]) * tangent - (n[1] + n[2]))
    return _half_angle(-b_p + _plus_minus_root(b_p**2 - 4 * a_p * c_p), 2 * a_p)


def leaves_limits(theta: float, derivative: float) -> bool:
    """Whether the joint leaves its range as psi grows past a limit, sections 5.1.3 and 5.2.

    Erratum: "same sign of angle and derivative" says so only if lower < 0 < upper.
    """
    return bool(np.sign(theta) == np.sign(derivative))


def hinge_derivative(h: Linear, gc_k: int, psi: float) -> float:
    """Derivative of a hinge joint angle, Eq. (33).

    Erratum: sin(theta_i) of (27) already has the sign GC_k; with both, GC_k = -1 comes out
    with the wrong sign.
    """
    slope = h[0] * np.cos(psi) - h[1] * np.sin(psi)
    return float(-gc_k * slope / np.sin(hinge_angle(h, gc_k, psi)))


def hinge_stationary(h: Linear) -> Array:
    """Stationary arm angles of a hinge joint, rad, shape (2,), Eq. (34).

    Erratum: a = 0 divides by zero, and so it is for theta_2 at every pose, with psi = 0 and
    psi = pi stationary; for a = b = 0 the angle is constant, not stationary at "one" point.
    """
    a, b, _ = h
    return _half_angle(-b + _plus_minus_root(a**2 + b**2), a)


def hinge_limit_arm_angles(h: Linear, limit: float) -> Array:
    """Arm angles at which a hinge joint meets a limit, rad, shape (2,), Eq. (35).

    Erratum: cos(limit) + b - c = 0 divides by zero; one root is then pi, the other one lost.
    """
    a, b, c = h
    cosine = np.cos(limit)
    return _half_angle(a + _plus_minus_root(a**2 + b**2 - (c - cosine) ** 2), cosine + b - c)


def new_arm_angle(psi: float, interval: Interval, k: float, alpha: float) -> float:
    """Next arm angle, repelled from the ends of the interval that holds psi, rad, Eq. (36)."""
    lower, upper = interval
    width = upper - lower
    from_lower = np.exp(-alpha * (psi - lower) / width)
    from_upper = np.exp(-alpha * (upper - psi) / width)
    return float(psi + k * width / 2 * (from_lower - from_upper))
