"""The inverse on any array of the array API: NumPy, torch, JAX, on a GPU too; their autograd goes through it.

The formulas of Faria et al. (2018), Eqs. (2), (12)-(24), for arms without elbow offsets, whose arm angle is
measured from the base axis. On a CPU the core is some sixty times quicker; this runs where the arrays
are. It checks nothing: out of reach it gives NaN.

    pip install array-api-compat
"""

from __future__ import annotations

from typing import Any

import array_api_compat
import numpy as np

import armangle as aa


def inverse(arm: aa.Arm, pose: Any, psi: Any, gc: Any) -> Any:
    """Return joints (..., 7) within (-pi, pi] of the zero of each, of pose (..., 4, 4), psi and gc (...)."""
    xp = array_api_compat.array_namespace(pose)

    def constant(value: Any) -> Any:
        return xp.asarray(np.asarray(value).tolist(), dtype=pose.dtype, device=array_api_compat.device(pose))

    def sign(bit: int) -> Any:
        return xp.astype(1 - 2 * ((gc >> bit) & 1), pose.dtype)

    def turned(theta: Any, twist: int) -> Any:
        """One DH row: about z, then by twist quarter turns about x."""
        s, c, o, one = xp.sin(theta), xp.cos(theta), xp.zeros_like(theta), xp.ones_like(theta)
        rows = [[c, o, twist * s], [s, o, -twist * c], [o, twist * one, o]]
        return xp.stack([xp.stack(row, axis=-1) for row in rows], axis=-2)

    g = arm.geometry
    flange = constant(np.linalg.inv(arm.base)) @ pose @ constant(np.linalg.inv(arm.tool))
    rotation = flange[..., :3, :3]
    p = flange[..., :3, 3] - g.d_wf * rotation[..., :3, 2] - constant([0.0, 0.0, g.d_bs])
    square = xp.sum(p * p, axis=-1)
    n, across = xp.sqrt(square), xp.sqrt(p[..., 0] ** 2 + p[..., 1] ** 2)
    shoulder, elbow, wrist = sign(0), sign(1), sign(2)
    bend = elbow * xp.acos((square - g.d_se**2 - g.d_ew**2) / (2 * g.d_se * g.d_ew))
    lean = elbow * xp.acos((square + g.d_se**2 - g.d_ew**2) / (2 * g.d_se * n))
    first = xp.atan2(p[..., 1], p[..., 0]), xp.atan2(across, p[..., 2]) + lean
    at_zero = turned(first[0], -1) @ turned(first[1], 1) @ turned(xp.zeros_like(n), 1)
    w, o = p / n[..., None], xp.zeros_like(n)
    cross = xp.stack([o, -w[..., 2], w[..., 1], w[..., 2], o, -w[..., 0], -w[..., 1], w[..., 0], o], axis=-1)
    cross = xp.reshape(cross, (*n.shape, 3, 3))
    s, c = xp.sin(psi)[..., None, None], xp.cos(psi)[..., None, None]
    upper = (constant(np.eye(3)) + s * cross + (1 - c) * (cross @ cross)) @ at_zero
    lower = xp.matrix_transpose(upper @ turned(bend, -1)) @ rotation
    theta_1 = xp.atan2(shoulder * upper[..., 1, 1], shoulder * upper[..., 0, 1])
    theta_2 = shoulder * xp.acos(upper[..., 2, 1])
    s, c = xp.sin(theta_1), xp.cos(theta_1)
    theta_3 = xp.atan2(
        c * upper[..., 1, 0] - s * upper[..., 0, 0], s * upper[..., 0, 2] - c * upper[..., 1, 2]
    )
    theta_5 = xp.atan2(wrist * lower[..., 1, 2], wrist * lower[..., 0, 2])
    theta_6 = wrist * xp.acos(lower[..., 2, 2])
    s, c = xp.sin(theta_5), xp.cos(theta_5)
    theta_7 = xp.atan2(
        c * lower[..., 1, 0] - s * lower[..., 0, 0], c * lower[..., 1, 1] - s * lower[..., 0, 1]
    )
    theta = xp.stack([theta_1, theta_2, theta_3, bend, theta_5, theta_6, theta_7], axis=-1)
    free = constant(g.signs) * (theta - constant(g.offsets))
    return free - 2 * xp.pi * xp.round(free / (2 * xp.pi))


if __name__ == "__main__":
    iiwa = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.random.default_rng(0).uniform(iiwa.lower, iiwa.upper, (10_000, 7))
    frames, psis, gcs = iiwa.forward(q)
    off = np.abs(inverse(iiwa, frames, psis, gcs) - q).max(axis=1)
    print(f"median {np.median(off):.1e} rad, worst {off.max():.1e} rad off the joints of the poses")
