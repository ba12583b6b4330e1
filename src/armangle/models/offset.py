"""Arms with an offset wrist or shoulder: their numbers, from the catalogue and from a chain of joints."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any

import numpy as np

from ..errors import NotSRSError, UnknownRobotError
from .axes import millimetres, worst_difference
from .chain import Chain, FloatArray, chain_of, rigid_inverse, rotation_about
from .description import ArmDescription

ANGLE_TOLERANCE = 5e-5  # rad: what files that write right angles to five digits are off by
LENGTH_TOLERANCE = 2e-5  # m
_SINES = (-1.0, 1.0, 1.0, -1.0, -1.0, 1.0)  # of the twists alpha_1 ... alpha_6 between neighbouring axes
_SQUARE = 0.2  # neighbouring axes further than this from square, as a cosine, are of another kind of arm


@dataclass(frozen=True, eq=False)
class OffsetDescription:
    """The numbers of an arm with one offset more than S-R-S.

    ``rows`` are those of `ArmDescription`; ``a_1`` lies between the axes of joints 1 and 2, ``a_6`` between
    those of joints 6 and 7, m, and one of them is 0.
    """

    rows: ArmDescription
    a_1: float = 0.0
    a_6: float = 0.0


def offset_catalogue() -> tuple[str, ...]:
    """Return the names of the arms with an offset wrist or shoulder whose numbers are here."""
    return tuple(sorted(_tables()))


def load_offset_robot(name: str) -> OffsetDescription:
    """Return the numbers of an arm of `offset_catalogue`."""
    known = _tables()
    if name not in known:
        raise UnknownRobotError(f"there is no offset arm {name!r}; there are: {', '.join(sorted(known))}")
    table = known[name]
    tool = rotation_about(np.array([0.0, 0.0, 1.0]), np.radians(np.float64(table.get("tool_turn_deg", 0.0))))
    rows = ArmDescription(
        d_bs=table["d_bs"],
        d_se=table["d_se"],
        d_ew=table["d_ew"],
        d_wf=table["d_wf"],
        a_3=table["a_3"],
        a_4=table["a_4"],
        signs=tuple(table["signs"]),
        offsets=tuple(np.radians(table["offsets_deg"]).tolist()),
        lower=tuple(table["lower"]),
        upper=tuple(table["upper"]),
        velocity=tuple(table["velocity"]),
        tool=tool,
        name=name,
    )
    return OffsetDescription(rows, table.get("a_1", 0.0), table.get("a_6", 0.0))


def _tables() -> dict[str, Any]:
    return tomllib.loads(files(__package__).joinpath("offset_arms.toml").read_text(encoding="utf-8"))


def describe_offset_chain(chain: Chain, *, angle: float, length: float) -> OffsetDescription:
    """Return the numbers of a chain whose axes are those of an S-R-S arm but for a_1 or a_6.

    The Denavit-Hartenberg rows are read off neighbouring axes, and accepted where their forward kinematics
    is that of the chain within `length` (m) and `angle` (rad).
    """
    if len(chain.joints) != 7:
        raise NotSRSError(f"{chain.source}: the chain has {len(chain.joints)} rotating joints, wanted 7")
    found = _read(chain)
    position, rotation = worst_difference(chain, offset_chain_of(found))
    if position > length or rotation > angle:
        raise NotSRSError(
            f"{chain.source}: not an arm with one offset wrist or shoulder: its nearest rows miss "
            f"its forward kinematics by {millimetres(position)} and {rotation:.3g} rad"
        )
    if abs(found.a_1) <= length and abs(found.a_6) <= length:
        raise NotSRSError(
            f"{chain.source}: has no offset at wrist or shoulder: it is S-R-S, for armangle.Arm"
        )
    if abs(found.a_1) > length and abs(found.a_6) > length:
        raise NotSRSError(
            f"{chain.source}: offsets at both ends, {millimetres(abs(found.a_1))} between axes 1 and 2 and "
            f"{millimetres(abs(found.a_6))} between axes 6 and 7: there is no closed form for both"
        )
    return replace(found, a_1=0.0) if abs(found.a_1) <= length else replace(found, a_6=0.0)


def offset_hint(chain: Chain) -> str:
    """Return which arm a chain is that has one offset wrist or shoulder, as a sentence; else nothing."""
    try:
        found = describe_offset_chain(chain, angle=ANGLE_TOLERANCE, length=LENGTH_TOLERANCE)
    except NotSRSError:
        return ""
    what = (
        f"an offset shoulder, a_1 = {millimetres(abs(found.a_1))}"
        if found.a_1
        else f"an offset wrist, a_6 = {millimetres(abs(found.a_6))}"
    )
    return f"armangle.OffsetArm takes it, from the same file: it is S-R-S but for {what}."


def _read(chain: Chain) -> OffsetDescription:
    """Return the rows of neighbouring axes, each pair taken as square."""
    points, axes = chain.lines()
    signs = np.ones(7)
    z = axes.copy()
    feet = np.empty((6, 2, 3))  # of the common normal of axes i and i + 1, on the one and on the other
    for i in range(6):
        if abs(axes[i] @ axes[i + 1]) > _SQUARE:
            raise NotSRSError(
                f"{chain.source}: axes {i + 1} and {i + 2} are not square: "
                "not an arm with one offset wrist or shoulder"
            )
        feet[i] = _common_normal(points[i], axes[i], points[i + 1], axes[i + 1])
    for i, way in ((2, feet[2, 0] - feet[1, 1]), (4, feet[4, 0] - feet[3, 1])):  # d_3 and d_5 are positive
        signs[i] = -1.0 if way @ z[i] < 0 else 1.0
    base = chain.joints[0].origin
    tip = chain.forward(np.zeros(7))
    foot = points[0] - (points[0] @ z[0]) * z[0]  # of axis 1, beside the origin of the base
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
    offsets = [_angle(first, x[0], z[0]), *(_angle(x[i - 1], x[i], z[i]) for i in range(1, 6)), 0.0]
    last = _frame(x[5], z[6], feet[5, 1])
    along = float((tip[:3, 3] - feet[5, 1]) @ z[6])
    last[:3, 3] += along * z[6]
    rows = ArmDescription(
        d_bs=_rounded((feet[0, 0] - foot) @ z[0]), d_se=_rounded(d[1]), d_ew=_rounded(d[3]),
        d_wf=_rounded(along),
        a_3=_rounded(a[2]), a_4=_rounded(a[3]),
        lower=tuple(j.lower for j in chain.joints), upper=tuple(j.upper for j in chain.joints),
        velocity=tuple(j.velocity for j in chain.joints),
        signs=tuple(int(s) for s in signs), offsets=tuple(_quarters(o) for o in offsets),
        base=frame, tool=rigid_inverse(last) @ tip,
        name=chain.name, joint_names=tuple(j.name for j in chain.joints),
    )  # fmt: skip
    return OffsetDescription(rows, a_1=_rounded(a[0]), a_6=_rounded(a[5]))


def offset_chain_of(found: OffsetDescription) -> Chain:
    """Return the chain of the numbers, the rows' own with a_1 and a_6 put in."""
    chain = chain_of(found.rows)
    joints = list(chain.joints)
    for row, offset in ((1, found.a_1), (6, found.a_6)):
        origin = joints[row].origin.copy()
        origin[:3, 3] += origin[:3, 0] * offset
        joints[row] = replace(joints[row], origin=origin)
    return replace(chain, joints=tuple(joints))


def _common_normal(p: FloatArray, u: FloatArray, r: FloatArray, v: FloatArray) -> FloatArray:
    """Return the nearest points of two lines that are not parallel, (2, 3)."""
    along = np.linalg.solve(
        np.array([[u @ u, -(u @ v)], [u @ v, -(v @ v)]]), np.array([(r - p) @ u, (r - p) @ v])
    )
    return np.array([p + along[0] * u, r + along[1] * v])


def _angle(start: FloatArray, end: FloatArray, axis: FloatArray) -> float:
    return float(np.arctan2(np.cross(start, end) @ axis, start @ end))


def _frame(x: FloatArray, z: FloatArray, origin: FloatArray) -> FloatArray:
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2], frame[:3, 3] = x, np.cross(z, x), z, origin
    return frame


def _quarters(angle: float) -> float:
    """Return an angle without the dust of the file's decimals; whole quarters of a turn exactly."""
    quarter = round(angle / (np.pi / 2))
    return quarter * np.pi / 2 if abs(angle - quarter * np.pi / 2) < 1e-12 else angle


def _rounded(value: float) -> float:
    """Return a number without the dust of the file's decimals."""
    return float(np.round(value, 12)) + 0.0
