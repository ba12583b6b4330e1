"""Arms with an offset wrist or shoulder: their numbers, from a chain of joints."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from .._arrays import millimetres
from ..errors import ModelError
from .axes import (
    MAX_ANGLE,
    MAX_LENGTH,
    NEAR_ANGLE,
    NEAR_LENGTH,
    above,
    angle_about,
    differs,
    exceeds,
    rotation_angle,
    rounded,
    tolerances,
    worst_difference,
)
from .chain import Chain, FloatArray, chain_of, rigid_inverse
from .description import OffsetDescription

ANGLE_TOLERANCE = 5e-5  # rad: error of files that write right angles to five digits
LENGTH_TOLERANCE = 2e-5  # m
_SINES = (-1.0, 1.0, 1.0, -1.0, -1.0, 1.0)  # of the twists alpha_1 ... alpha_6 between neighbouring axes
_POSTURES = np.random.default_rng(5).uniform(-np.pi, np.pi, (8, 7))  # test of exactness
_SQUARE = 0.2  # cosine: neighbouring axes further from perpendicular belong to another kind of arm


def offset_hint(chain: Chain) -> str:
    """Return how to import a chain as an arm with one offset wrist or shoulder, in words; "" if none."""
    try:
        whole = _read(chain)
    except ModelError:
        return ""
    found = _with_one_offset(whole)
    off = _off(chain, found)
    length, angle = (float(above(most)) for most in _accepting(off))
    if max(abs(found.a_1), abs(found.a_6)) <= length:
        return ""  # the error's handler removes the offset too, and leaves an S-R-S arm
    if _within(off, LENGTH_TOLERANCE, ANGLE_TOLERANCE):
        return f'fit="own" takes it: it is S-R-S but for {_kind(found)}.'
    if not _within((length, angle), MAX_LENGTH, MAX_ANGLE):
        return ""
    return (
        f'fit="own" with {tolerances(*_accepting(off))} takes it as S-R-S but for {_kind(found)}: '
        f"that arm differs by up to {differs(off)} at the tip."
    )


def offset_end(chain: Chain) -> tuple[str, float]:
    """Return where the one offset of a chain is, "shoulder" or "wrist", and the distance of such an arm from
    the chain at the tip, m: 0 within a file's rounding. ("", NaN) if it is not even near one.
    """
    try:
        found = _with_one_offset(_read(chain))
    except ModelError:
        return "", math.nan
    end, offset = ("shoulder", found.a_1) if found.a_1 else ("wrist", found.a_6)
    apart = chain_of(found).forward(_POSTURES) - chain.forward(_POSTURES)
    off = float(np.linalg.norm(apart[..., :3, 3], axis=-1).max()), float(rotation_angle(apart).max())
    if _within(off, LENGTH_TOLERANCE, ANGLE_TOLERANCE) and abs(offset) > LENGTH_TOLERANCE:
        return end, 0.0
    if not _within(off, NEAR_LENGTH, NEAR_ANGLE) or abs(offset) <= NEAR_LENGTH:
        return "", math.nan
    off = _off(chain, found)
    return (end, off[0]) if _within(off, NEAR_LENGTH, NEAR_ANGLE) else ("", math.nan)


def _with_one_offset(found: OffsetDescription) -> OffsetDescription:
    """Return the arm with the smaller of a_1 and a_6 set to 0."""
    return replace(found, a_1=0.0) if abs(found.a_1) <= abs(found.a_6) else replace(found, a_6=0.0)


def _off(chain: Chain, found: OffsetDescription) -> tuple[float, float]:
    """Return the largest deviation (m, rad) between the tips of a chain and an arm."""
    return worst_difference(chain, chain_of(found))


def _within(off: tuple[float, float], length: float, angle: float) -> bool:
    """Return whether a deviation (m, rad) is within tolerances."""
    return not exceeds(off[0], length) and not exceeds(off[1], angle)


def _kind(found: OffsetDescription) -> str:
    """Return in words where the offset is, and its length in mm."""
    if found.a_1:
        return f"an offset shoulder, a_1 = {millimetres(abs(found.a_1))}"
    return f"an offset wrist, a_6 = {millimetres(abs(found.a_6))}"


def _accepting(off: tuple[float, float]) -> tuple[float, float]:
    """Return the tolerances (m, rad) with which a deviation (m, rad) is accepted, not rounded."""
    return max(off[0], LENGTH_TOLERANCE), max(off[1], ANGLE_TOLERANCE)


def _read(chain: Chain) -> OffsetDescription:
    """Return the arm whose axes are those of the chain, neighbours made perpendicular, with any
    a_1 and a_6; raise `ModelError` if they are far from perpendicular.
    """
    points, axes = chain.lines()
    signs = np.ones(7)
    z = axes.copy()
    feet = np.empty((6, 2, 3))  # of the common normal of axes i and i + 1, on either of them
    for i in range(6):
        if abs(axes[i] @ axes[i + 1]) > _SQUARE:
            raise ModelError(
                f"{chain.source}: axes {i + 1} and {i + 2} are not square: "
                "not an arm with one offset wrist or shoulder"
            )
        feet[i] = _common_normal(points[i], axes[i], points[i + 1], axes[i + 1])
    for i, way in ((2, feet[2, 0] - feet[1, 1]), (4, feet[4, 0] - feet[3, 1])):  # d_3 and d_5 are positive
        signs[i] = -1.0 if way @ z[i] < 0 else 1.0
    base = chain.joints[0].origin
    tip = chain.forward(np.zeros(7))
    foot = points[0] - (points[0] @ z[0]) * z[0]  # of axis 1, nearest to the origin of the base
    signs[0] = -1.0 if (feet[0, 0] - foot) @ z[0] < 0 else 1.0
    signs[6] = -1.0 if (tip[:3, 3] - feet[5, 1]) @ z[6] < 0 else 1.0
    z = z * signs[:, None]
    x = np.array([np.cross(z[i], z[i + 1]) * _SINES[i] for i in range(6)])
    x /= np.linalg.norm(x, axis=1)[:, None]
    a = np.einsum("ij,ij->i", feet[:, 1] - feet[:, 0], x)
    d = [(feet[i, 0] - feet[i - 1, 1]) @ z[i] for i in range(1, 6)]
    first = base[:3, 0] - z[0] * (base[:3, 0] @ z[0])
    if np.linalg.norm(first) < 0.5:
        first = base[:3, 1] - z[0] * (base[:3, 1] @ z[0])
    first /= np.linalg.norm(first)
    frame = _frame(first, z[0], foot)
    turns = [angle_about(z[i], x[i - 1] if i else first, x[i]) for i in range(6)]
    last = _frame(x[5], z[6], feet[5, 1])
    along = float((tip[:3, 3] - feet[5, 1]) @ z[6])
    last[:3, 3] += along * z[6]
    return OffsetDescription(
        d_bs=rounded((feet[0, 0] - foot) @ z[0]), d_se=rounded(d[1]), d_ew=rounded(d[3]),
        d_wf=rounded(along),
        a_1=rounded(a[0]), a_3=rounded(a[2]), a_4=rounded(a[3]), a_6=rounded(a[5]),
        lower=tuple(j.lower for j in chain.joints), upper=tuple(j.upper for j in chain.joints),
        velocity=tuple(j.velocity for j in chain.joints),
        signs=tuple(int(s) for s in signs), offsets=(*turns, 0.0),
        base=frame, tool=rigid_inverse(last) @ tip,
        name=chain.name, joint_names=tuple(j.name for j in chain.joints),
    )  # fmt: skip


def _common_normal(p: FloatArray, u: FloatArray, r: FloatArray, v: FloatArray) -> FloatArray:
    """Return the nearest points (2, 3) of the lines p + a u and r + b v, which are not parallel."""
    along = np.linalg.solve(
        np.array([[u @ u, -(u @ v)], [u @ v, -(v @ v)]]), np.array([(r - p) @ u, (r - p) @ v])
    )
    return np.array([p + along[0] * u, r + along[1] * v])


def _frame(x: FloatArray, z: FloatArray, origin: FloatArray) -> FloatArray:
    """Return the frame (4, 4) with these x and z axes and origin (m)."""
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2], frame[:3, 3] = x, np.cross(z, x), z, origin
    return frame
