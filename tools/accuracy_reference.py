"""Forward kinematics and arm angle in 50-digit arithmetic, from the definitions alone."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

import armangle as aa

Floats = NDArray[np.float64]

mpmath.mp.dps = 50
ALPHA = (-1, 1, 1, -1, -1, 1, 0)
ON_AXIS = mpmath.mpf("1e-7")


def _dh(theta: Any, alpha: int, d: float, a: float) -> Any:
    c, s, x, z = mpmath.cos(theta), mpmath.sin(theta), 1 - abs(alpha), alpha
    return mpmath.matrix(
        [[c, -s * x, s * z, a * c], [s, c * x, -c * z, a * s], [0, z, x, d], [0, 0, 0, 1]]
    )


def frames(arm: aa.Arm, q: Floats) -> list[Any]:
    """Return 0T0 .. 0T7 of Table 1, Eq. (1)."""
    d = (arm.d_bs, 0, arm.d_se, 0, arm.d_ew, 0, arm.d_wf)
    a = (0, 0, arm.a_3, arm.a_4, 0, 0, 0)
    out = [mpmath.eye(4)]
    for i in range(7):
        theta = int(arm.signs[i]) * mpmath.mpf(q[i]) + mpmath.mpf(arm.offsets[i])
        out.append(out[-1] * _dh(theta, ALPHA[i], mpmath.mpf(d[i]), mpmath.mpf(a[i])))
    return out


def chain_error(arm: aa.Arm, q: Floats, pose: Floats) -> float:
    """Return the largest error of an entry of a pose (arm without base and tool)."""
    exact = frames(arm, q)[7]
    return float(max(abs(exact[i, j] - mpmath.mpf(pose[i, j])) for i in range(3) for j in range(4)))


def _cross(a: list[Any], b: list[Any]) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: list[Any], b: list[Any]) -> Any:
    return sum((x * y for x, y in zip(a, b, strict=True)), mpmath.mpf(0))


def psi_error(arm: aa.Arm, pose: Floats, q: Floats, psi: float) -> float:
    """Return the distance of an arm angle from that of the elbow axis of q on the circle of `pose`, rad."""
    m = [[mpmath.mpf(float(x)) for x in row] for row in pose]
    p = [m[i][3] - m[i][2] * mpmath.mpf(arm.d_wf) - (mpmath.mpf(arm.d_bs) if i == 2 else 0) for i in range(3)]
    n, r = mpmath.sqrt(_dot(p, p)), mpmath.sqrt(p[0] ** 2 + p[1] ** 2)
    w = [x / n for x in p]
    if r > ON_AXIS * mpmath.mpf(arm.reach):
        z = [p[1] / r, -p[0] / r, mpmath.mpf(0)]
    else:
        across = [w[0] * w[1], w[1] ** 2 - 1, w[2] * w[1]]
        size = mpmath.sqrt(_dot(across, across))
        z = [x / size for x in across]
    elbow = frames(arm, q)[3]
    z3 = [elbow[i, 2] for i in range(3)]
    exact = mpmath.atan2(_dot(w, _cross(z, z3)), _dot(z, z3))
    apart = mpmath.mpf(float(psi)) - exact
    return float(abs(apart - 2 * mpmath.pi * mpmath.nint(apart / (2 * mpmath.pi))))
