"""The representation of a KUKA LBR's controller: pose as X Y Z A B C, E1, Status and Turn.

E1 is the value of axis A3, as in the taught frames of Sunrise projects, and not the arm angle. Status gives
the branch: bit 0 is set if the wrist is behind axis 1 (overhead), bit 1 if A4 < 0, bit 2 if A6 < 0. Turn has
a bit for each axis, set if its value is negative. For arms without elbow offsets whose joints are 0 when the
arm is stretched: iiwa, Med, LBR 4.

Examples
--------
>>> import armangle as aa
>>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
>>> q = [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]
>>> frame = aa.kuka.to_frame(arm, q)
>>> frame.status, frame.turn, round(frame.e1, 6)
(2, 8, 0.2)
>>> aa.kuka.from_frame(arm, frame).round(9).tolist()
[0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import (
    JOINTS,
    FloatOrArray,
    Floats,
    IntOrArray,
    Ints,
    as_codes,
    as_floats,
    as_poses,
    broadcast,
    check_angles,
    chosen,
)
from ._core import ANGLE_TOLERANCE
from ._threads import thread_count
from ._values import by_content
from .arm.arcs import ArcSet
from .arm.arm import ON_ERROR, Arm, OnError, check_arm
from .arm.offset import as_srs
from .errors import InputError, NoSolutionError, UnreachableError
from .poses import pose as _pose
from .status import STATUSES, Status

__all__ = [
    "KukaFrame",
    "abc",
    "e1_arcs",
    "from_e1",
    "from_frame",
    "pose",
    "status",
    "text",
    "to_e1",
    "to_frame",
    "turn",
]

_STATUSES, _TURNS = 8, 1 << JOINTS
_A1, _A2, _A3, _A4, _A5, _A6, _A7 = range(JOINTS)


@by_content
class KukaFrame(NamedTuple):
    """A configuration in the controller's representation.

    ``pose (4, 4)`` of the end effector, m; ``e1`` value of A3, rad; ``status`` 0..7; ``turn`` 0..127.
    """

    pose: Floats
    e1: float
    status: int
    turn: int


def _checked(arm: Arm) -> Arm:
    """Return the arm; raise unless it has the structure that these controllers assume."""
    check_arm(arm)
    if not as_srs(arm, "kuka")._handle.is_kuka:
        raise InputError(
            f"arm {arm.name or ''} has elbow offsets (a_3, a_4, d_4) or zero offsets of joints: E1, Status "
            "and Turn are known for arms without them, as iiwa, Med and LBR 4"
        )
    return arm


def _codes(arm: Arm, q: ArrayLike) -> Ints:
    """Return Status and Turn of joints, (..., 2)."""
    joints = as_floats("q", q, (JOINTS,))
    out = np.empty((*joints.shape[:-1], 2), np.int64)
    _checked(arm)._handle.kuka_codes(joints, out, thread_count())
    return out


def status(arm: Arm, q: ArrayLike) -> IntOrArray:
    """Return the Status of joints: +1 wrist behind axis 1, +2 A4 < 0, +4 A6 < 0.

    Parameters
    ----------
    arm : Arm
    q : array_like, shape (..., 7)
        Joint values, rad.

    Returns
    -------
    int64, shape (...)

    Raises
    ------
    InputError
    """
    return _codes(arm, q)[..., 0][()]


def turn(arm: Arm, q: ArrayLike) -> IntOrArray:
    """Return the Turn of joints: bit i - 1 is set if axis i is negative.

    Parameters, errors and shape as for `status`.
    """
    return _codes(arm, q)[..., 1][()]


def to_e1(arm: Arm, q: ArrayLike) -> FloatOrArray:
    """Return E1 of joints: the value of A3, rad.

    Parameters
    ----------
    arm : Arm
    q : array_like, shape (..., 7)
        Joint values, rad.

    Returns
    -------
    float64, shape (...)

    Raises
    ------
    InputError
    """
    joints = as_floats("q", q, (JOINTS,))
    _checked(arm)._handle.check_joints(joints, "q")
    return joints[..., 2].copy()[()]


def from_e1(
    arm: Arm,
    pose: ArrayLike,
    e1: ArrayLike,
    status: ArrayLike,
    *,
    seed: ArrayLike | None = None,
    on_error: OnError = "raise",
) -> Floats:
    """Return the joints of a pose with A3 at E1 and the given Status: in closed form, and unique.

    Parameters
    ----------
    arm : Arm
    pose : array_like, shape (..., 4, 4)
        Pose of the end effector, position in m.
    e1 : array_like, shape (...)
        Value of A3, rad.
    status : array_like of int, shape (...)
        0..7.
    seed : array_like, shape (..., 7), optional
        For joints of more than a turn, the turn nearest to it is used. It determines the turn of A1 if A2 is
        0. If A6 is 0, A5 and A7 rotate about one axis; if A2 and A4 are, A1 and A5 do. Then A5 or A1 takes
        its value if all can keep their limits. Without a seed that A5 or A1 is the middle of its range.
    on_error : "raise" or "nan"
        What to do without a solution.

    Returns
    -------
    ndarray, shape (..., 7)
        Joint values, rad. Limits are not enforced: check them with `Arm.within_limits`; `e1_arcs` returns the
        E1 within them.

    Raises
    ------
    InputError
    UnreachableError
        If the pose is out of reach.
    NoSolutionError
        If the pose is within reach, but not with that A3.
    """
    values, near = as_floats("e1", e1), None if seed is None else as_floats("seed", seed, (JOINTS,))
    check_angles("e1", values)
    own = _checked(arm)
    joints = np.zeros((*values.shape, JOINTS))
    joints[..., _A3] = values
    own._handle.check_joints(joints, "e1")
    given = [
        ("pose", as_poses("pose", pose, own._handle), 2),
        ("e1", values, 0),
        ("status", as_codes("status", status, _STATUSES), 0),
    ]
    if near is not None:
        own._handle.check_joints(near, "seed")
        given.append(("seed", near, 1))
    batch, arrays = broadcast(given)
    out, codes = np.empty((*batch, JOINTS)), np.empty(batch, np.int64)
    wound = arrays[3] if near is not None else None
    arm._handle.kuka_inverse(arrays[0], arrays[1], arrays[2], wound, out, codes, thread_count())
    if chosen("on_error", on_error, ON_ERROR) == "raise" and (codes != Status.OK).any():
        at = tuple(int(i) for i in np.argwhere(codes != Status.OK)[0])
        why = STATUSES[int(codes[at])]
        where = f"pose{list(at)}: " if at else ""
        if why is not Status.LIMITS:
            raise UnreachableError(f"{where}{why.sentence}")
        value, wanted = float(arrays[1][at]), int(arrays[2][at])
        raise NoSolutionError(
            f"{where}no solution of status {wanted} has A3 at E1 = {np.degrees(value):.4f} deg: the wrist "
            "would lie beside the plane of the upper arm by more than its distance from axis 1"
        )
    return out


def e1_arcs(arm: Arm, pose: ArrayLike, status: ArrayLike) -> ArcSet:
    """Return the values of E1 for which a pose has a solution with this Status within all limits.

    Exact, from the feasible arm angles. Within 1e-6 rad of A2 = 0, but not at it, accurate to that width.

    Parameters
    ----------
    arm : Arm
    pose : array_like, shape (..., 4, 4)
        Tool frame, position in m.
    status : array_like of int, shape (...)
        0..7.

    Returns
    -------
    ArcSet, shape (...)
        Arcs of E1, rad; if empty, ``status`` gives the reason.

    Raises
    ------
    InputError
    """
    named = [
        ("pose", as_poses("pose", pose, _checked(arm)._handle), 2),
        ("status", as_codes("status", status, _STATUSES), 0),
    ]
    batch, (poses, wanted) = broadcast(named)
    columns = arm._handle.kuka_e1_arcs(np.ascontiguousarray(poses), np.ascontiguousarray(wanted).reshape(-1))
    return ArcSet._from_core(batch, columns)


def to_frame(arm: Arm, q: ArrayLike) -> KukaFrame:
    """Return a configuration in the controller's representation.

    Parameters
    ----------
    arm : Arm
    q : array_like, shape (7,)
        Joint values, rad.

    Returns
    -------
    KukaFrame

    Raises
    ------
    InputError
    """
    joints = as_floats("q", q, (JOINTS,))
    if joints.ndim != 1:
        raise InputError(f"q has shape {joints.shape}, wanted ({JOINTS},): a frame is one configuration")
    codes = _codes(arm, joints)
    tool = arm.forward(joints, on_error="nan")[0]
    return KukaFrame(tool, float(joints[2]), int(codes[0]), int(codes[1]))


def from_frame(arm: Arm, frame: KukaFrame, *, seed: ArrayLike | None = None) -> Floats:
    """Return the joints (7,) of a frame: pose, E1 and Status determine them, and Turn must agree.

    If A6 is 0, A5 and A7 rotate about one axis, and if A2 and A4 are, A1 and A5 do. A frame does not give
    their shares: they have the signs of Turn within their limits, A1 and A5 as in the seed if possible.

    Parameters
    ----------
    arm : Arm
    frame : KukaFrame
        Or a tuple of pose, E1 (rad), Status, Turn.
    seed : array_like, shape (7,), optional
        As in `from_e1`.

    Raises
    ------
    InputError, UnreachableError, NoSolutionError
        As `from_e1`; InputError too if the configuration has another Turn: the tool or base is not that of
        the frame, or A6 is 0 (A2 and A4 are) and no share of A5 and A7 (A1 and A5) has these signs within
        their limits.
    """
    try:
        tool, e1, wanted, turns = frame
    except (TypeError, ValueError):
        raise InputError("frame is no KukaFrame, wanted pose, E1, Status and Turn") from None
    bits = int(as_codes("turn", turns, _TURNS))
    q = from_e1(arm, tool, e1, wanted, seed=seed)
    own = int(turn(arm, q))
    straight = np.abs(np.sin(q)) <= ANGLE_TOLERANCE
    upright, wrist = straight[_A2] and straight[_A4], straight[_A6]
    open_axes = ([_A1] if upright else []) + ([_A5] if upright or wrist else []) + ([_A7] if wrist else [])
    if any((own ^ bits) >> i & 1 for i in open_axes):
        near = None if seed is None else np.ascontiguousarray(as_floats("seed", seed, (JOINTS,)))
        if arm._handle.kuka_share_turns(q, near, bits):
            own = int(turn(arm, q))
    differ = [i for i in range(JOINTS) if (own ^ bits) >> i & 1 and abs(q[i]) > ANGLE_TOLERANCE]
    if differ and set(differ) <= set(open_axes):
        where = [f"A{i + 1}" for i in ([_A2, _A4] if upright else []) + ([_A6] if wrist else [])]
        what = [f"A{i + 1}" for i in open_axes]
        raise InputError(
            f"turn is {bits}, but {_listed(where)} {'is' if len(where) == 1 else 'are'} 0, where "
            f"{_listed(what)} turn one axis: within their limits no share of it has these signs"
        )
    if differ:
        wrong = ", ".join(f"A{i + 1}" for i in differ)
        raise InputError(
            f"turn is {bits}, but pose, E1 and Status give {own}: {wrong} differ; is tool or base another?"
        )
    return q


def _listed(names: list[str]) -> str:
    """Return names as text with "and" before the last."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def pose(xyz: ArrayLike, abc: ArrayLike) -> Floats:
    """Return the pose (..., 4, 4) of X Y Z (m) and A B C (rad): turns about z, then the new y, then x.

    Parameters
    ----------
    xyz : array_like, shape (..., 3)
        m; the controller shows millimetres.
    abc : array_like, shape (..., 3)
        rad; the controller shows degrees.

    Raises
    ------
    InputError
    """
    angles = as_floats("abc", abc, (3,))
    check_angles("abc", angles)
    return _pose(xyz, rpy=angles[..., ::-1])


def abc(pose: ArrayLike) -> Floats:
    """Return A, B, C (..., 3) of poses, rad: A and C in (-π, π], B in [-π/2, π/2]; C is 0 if B is ±π/2.

    Parameters
    ----------
    pose : array_like, shape (..., 4, 4)

    Raises
    ------
    InputError
    """
    frames = as_poses("pose", pose)
    r = frames[..., :3, :3]
    level = np.hypot(r[..., 0, 0], r[..., 1, 0])
    b = np.arctan2(-r[..., 2, 0], level)
    upright = level < 1e-9  # only A - C (or A + C) is determined
    a = np.where(upright, np.arctan2(-r[..., 0, 1], r[..., 1, 1]), np.arctan2(r[..., 1, 0], r[..., 0, 0]))
    c = np.where(upright, 0.0, np.arctan2(r[..., 2, 1], r[..., 2, 2]))
    return np.stack([a, b, c], axis=-1)


def text(frame: KukaFrame) -> str:
    """Return a frame in the format of a pendant, in millimetres and degrees.

    Examples
    --------
    >>> print(text(KukaFrame(pose([0.5, 0, 0.3], [0, 3.14159265358979, 0]), 0.2, 2, 8)))
    X 500.000, Y 0.000, Z 300.000, A 180.0000, B 0.0000, C 180.0000, E1 11.4592, Status 2, Turn 8
    """
    x, y, z = 1e3 * frame.pose[:3, 3]
    a, b, c = np.degrees(abc(frame.pose))
    return (
        f"X {x:.3f}, Y {y:.3f}, Z {z:.3f}, A {a:.4f}, B {b:.4f}, C {c:.4f}, E1 {np.degrees(frame.e1):.4f}, "
        f"Status {frame.status}, Turn {frame.turn}"
    )
