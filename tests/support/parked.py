"""Configurations near singularities of shoulder, elbow and wrist, and their self-motions in 50 digits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

import armangle as aa

Array = NDArray[np.float64]

ARMS = (
    "kuka_iiwa7_r800",
    "kuka_lwr4_plus",
    "rokae_xmate_er3_pro",
    "galaxea_r1_pro_right",
    "aldebaran_romeo_right",
    "realman_rm75_b",
    "barrett_wam7",
    "yaskawa_sia10d",
    "jvrc1_left",
    "openarm_v10",
)
"""Arms with wide and narrow ranges, an elbow that bends both ways or one way, with and without offset."""

HINGES = (1, 3, 5)
ALPHA = (-1, 1, 1, -1, -1, 1, 0)
DIGITS = 50


def parked(arm: aa.Arm, rng: np.random.Generator) -> Array:
    """Return joints (7,) within limits with some of joints 2, 4, 6, in half of the cases also the others,
    about 1e-13 to 1e-5 rad from 0 (joint 4: from stretched) if the limits allow it.
    """
    near = np.full(7, rng.random() < 0.5)
    near[list(HINGES)] = rng.random(3) < 0.5
    near[rng.choice(HINGES)] = True
    straight = np.zeros(7)
    straight[3] = arm.geometry.delta
    q = (straight - arm.geometry.offsets) * arm.geometry.signs
    q -= 2 * np.pi * np.round(q / (2 * np.pi))
    near &= (q >= arm.lower - 1e-9) & (q <= arm.upper + 1e-9)  # other joints cannot come near 0
    q += 10.0 ** rng.uniform(-13, -5) * rng.normal(size=7)
    anywhere = rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi))
    return np.clip(np.where(near, q, anywhere), arm.lower, arm.upper)


def at_limit(arm: aa.Arm, rng: np.random.Generator) -> Array:
    """Return joints (7,) with joint 2 or 6 exactly at a limit, and the elbow stretched or about 1e-13 to 1e-5
    rad from it if its limits allow it.
    """
    straight = (arm.geometry.delta - arm.geometry.offsets[3]) * arm.geometry.signs[3]
    q = rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi))
    q[3] = straight - 2 * np.pi * np.round(straight / (2 * np.pi))
    q[3] += rng.choice([0, 1]) * 10.0 ** rng.uniform(-13, -5) * rng.normal()
    hinge = rng.choice([1, 5])
    q[hinge] = rng.choice([arm.lower[hinge], arm.upper[hinge]])
    return np.clip(q, arm.lower, arm.upper)


def _dh(theta: Any, alpha: int, d: float, a: float) -> Any:
    """The DH transform (4, 4) of mpmath numbers; alpha in quarter rotations."""
    c, s, x, z = mpmath.cos(theta), mpmath.sin(theta), 1 - abs(alpha), alpha
    return mpmath.matrix([[c, -s * x, s * z, a * c], [s, c * x, -c * z, a * s], [0, z, x, d], [0, 0, 0, 1]])


def _cross(a: Any, b: Any) -> Any:
    """The cross product."""
    return mpmath.matrix(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
    )


def _columns(*vectors: Any) -> Any:
    """The matrix (3, 3) with these columns."""
    return mpmath.matrix([[v[i] for v in vectors] for i in range(3)])


class SelfMotion:
    """All solutions of the exact pose of a configuration, in many digits, for an arm without d_4, base and
    tool.
    """

    def __init__(self, arm: aa.Arm, q: Array) -> None:
        """Compute the exact pose of joints q."""
        self.arm = arm
        lengths = (
            (arm.geometry.d_bs, 0, arm.geometry.d_se, 0, arm.geometry.d_ew, 0, arm.geometry.d_wf),
            (0, 0, arm.geometry.a_3, arm.geometry.a_4, 0, 0, 0),
        )
        self.d, self.a = ([mpmath.mpf(float(x)) for x in row] for row in lengths)
        self.theta = [
            int(arm.geometry.signs[i]) * mpmath.mpf(float(q[i])) + mpmath.mpf(float(arm.geometry.offsets[i]))
            for i in range(7)
        ]
        frames = [mpmath.eye(4)]
        for i in range(7):
            frames.append(frames[-1] * self._step(i, self.theta[i]))
        self.flange = frames[7][:3, :3]
        span = frames[5][:3, 3] - mpmath.matrix([0, 0, self.d[0]])
        self.w = span / mpmath.norm(span)
        side = mpmath.matrix([1, 0, 0] if abs(self.w[0]) < 0.6 else [0, 1, 0])
        across = _cross(self.w, side)
        self.u = across / mpmath.norm(across)

    def _step(self, joint: int, theta: Any) -> Any:
        """The transform over one joint at model angle theta."""
        return _dh(theta, ALPHA[joint], self.d[joint], self.a[joint])

    def at(self, elbow: int, phi: float) -> Iterator[tuple[int, list[Any]]]:
        """Yield (gc, theta) of the four branches with this elbow sign, without limits.

        phi is the angle about shoulder-wrist, rad, from an arbitrary zero; theta is in mpmath's numbers.
        """
        d, a = self.d, self.a
        delta = mpmath.atan2(d[2] * a[3] - a[2] * d[4], a[2] * a[3] + d[2] * d[4])
        theta_4 = delta + elbow * abs(_wrapped(self.theta[3] - delta))
        c, s = mpmath.cos(theta_4), mpmath.sin(theta_4)
        span = mpmath.matrix([a[2] + a[3] * c - d[4] * s, d[2] + a[3] * s + d[4] * c, 0])
        span /= mpmath.norm(span)
        axis = mpmath.matrix([0, 0, 1])
        u = self.u * mpmath.cos(phi) + _cross(self.w, self.u) * mpmath.sin(phi)
        upper = _columns(self.w, u, _cross(self.w, u)) * _columns(span, axis, _cross(span, axis)).T
        lower = (upper * self._step(3, theta_4)[:3, :3]).T * self.flange
        for shoulder in (1, -1):
            first = _three(upper[0, 1], upper[1, 1], upper[2, 1], shoulder)
            c1, s1 = mpmath.cos(first[0]), mpmath.sin(first[0])
            third = mpmath.atan2(c1 * upper[1, 0] - s1 * upper[0, 0], s1 * upper[0, 2] - c1 * upper[1, 2])
            for wrist in (1, -1):
                fifth = _three(lower[0, 2], lower[1, 2], lower[2, 2], wrist)
                c5, s5 = mpmath.cos(fifth[0]), mpmath.sin(fifth[0])
                last = mpmath.atan2(
                    c5 * lower[1, 0] - s5 * lower[0, 0],
                    c5 * lower[1, 1] - s5 * lower[0, 1],
                )
                gc = (shoulder < 0) + 2 * (elbow < 0) + 4 * (wrist < 0)
                yield gc, [*first, third, theta_4, *fifth, last]

    def within(self, theta: list[Any], inside: float) -> bool:
        """Return whether all joints are inside their limits by at least `inside` (rad)."""
        for j, angle in enumerate(theta):
            q = (angle - mpmath.mpf(float(self.arm.geometry.offsets[j]))) * int(self.arm.geometry.signs[j])
            lower, upper = float(self.arm.lower[j]) + inside, float(self.arm.upper[j]) - inside
            turns = mpmath.ceil((lower - q) / (2 * mpmath.pi)) if np.isfinite(lower) else 0
            if q + 2 * mpmath.pi * turns > upper:
                return False
        return True

    def branches(self, inside: float, samples: int) -> int:
        """Return the sum of 2^gc over branches with a solution at least `inside` (rad) within the limits at
        one of `samples` angles phi.
        """
        held = 0
        for k in range(samples):
            for elbow in (1, -1):
                for gc, theta in self.at(elbow, 2 * mpmath.pi * k / samples):
                    if not held >> gc & 1 and self.within(theta, inside):
                        held |= 1 << gc
        return held


def _three(x: Any, y: Any, z: Any, sign: int) -> tuple[Any, Any]:
    """Azimuth and angle to z of a direction (x, y, z), the second with this sign."""
    return mpmath.atan2(sign * y, sign * x), sign * mpmath.atan2(mpmath.sqrt(x * x + y * y), z)


def _wrapped(angle: Any) -> Any:
    """An angle in [-π, π]."""
    return angle - 2 * mpmath.pi * mpmath.nint(angle / (2 * mpmath.pi))
