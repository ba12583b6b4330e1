"""Redundancy resolution, one step of a control loop, and a sequence of steps along poses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import Floats, as_floats, as_gc, as_number, broadcast, check_angles, raise_problem
from ._bounds import Bound, no_bounds, step_bounds
from .arcs import ArcSet
from .arm import MOST_MARGIN, Arm
from .configuration import COUNT as CONFIGURATIONS
from .description import JOINTS
from .errors import ConfigurationError, InputError, ShapeError
from .joint_path import JointPath
from .policies import POLICIES, Policy, Repulsion
from .status import STATUSES, Status

Carry = Literal["psi", "elbow"]
OnFail = Literal["stop", "hold", "skip"]
Allowed = ArcSet | Callable[[Floats], ArcSet]

MAX_JOINT_STEP = 0.2
_CARRY = {"psi": 0, "elbow": 1}
_ON_FAIL = ("stop", "hold", "skip")
_DEFAULT_POLICY = Repulsion()
_GC_OF_Q = -1
_new_step = tuple.__new__
_POLICIES = frozenset(POLICIES)


class Resolution(NamedTuple):
    """The next arm angle: ``psi`` in (-π, π], rad, shape (...), and its status (codes for a batch)."""

    psi: Floats | np.float64
    status: NDArray[np.int8] | Status


class Step(NamedTuple):
    """What a step leads to. On any status but OK the posture is the present one: nothing moves.

    ``q (7,)`` rad, continuous with the present joints; ``psi`` rad in (-π, π]; ``gc`` 0..7; ``status``;
    ``margin`` least distance of a joint of q to one of its limits, rad.
    """

    q: Floats
    psi: float
    gc: int
    status: Status
    margin: float


def resolve(
    arm: Arm,
    pose: ArrayLike,
    psi: ArrayLike,
    gc: ArrayLike,
    *,
    policy: Policy = _DEFAULT_POLICY,
    dt: float | None = None,
    allowed: Allowed | None = None,
    singularity_margin: float = 0.0,
) -> Resolution:
    """Return the next arm angle at a pose, from the present one and the feasible arcs.

    Not to be confused with `step`, which starts from joints, checks continuity and returns joints.

    Parameters
    ----------
    arm : Arm
    pose : array_like, shape (..., 4, 4)
        Tool frame, position in m.
    psi : array_like, shape (...)
        Present arm angle, rad, any real.
    gc : array_like of int, shape (...)
        Global configuration 0..7.
    policy : Repulsion, Hold or Centre
        How the arm angle moves on its arc.
    dt : float, optional
        Time of the step, s; needed by a policy with ``rate=``.
    allowed : ArcSet or function (4, 4) -> ArcSet, optional
        Arcs of the user's own, intersected: task-space obstacles (the paper's section 6).
    singularity_margin : float
        As in `Arm.feasible`, rad.

    Returns
    -------
    Resolution
        ``psi`` float64 (...) in (-π, π] and ``status``; where no arc is feasible psi is the given one and the
        status says why.

    Raises
    ------
    ArmangleError
        As `Arm.feasible`; `PolicyError` where dt is missing.

    Source: Faria et al. (2018), Eq. (36).

    Examples
    --------
    >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
    >>> pose, psi, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    >>> resolve(arm, pose, psi, gc).status.name
    'OK'
    """
    angles = as_floats("psi", psi)
    check_angles("psi", angles)
    arcs = arm.feasible(pose, gc, singularity_margin=singularity_margin)
    if allowed is not None:
        poses = np.broadcast_to(as_floats("pose", pose, (4, 4)), (*arcs.shape, 4, 4))
        arcs = arcs & _allowed_arcs(allowed, poses)
    index = np.arange(len(arcs._count)).reshape(arcs.shape)
    shape, pair = broadcast([("arcs", index, 0), ("psi", angles, 0)])
    out, code = np.empty(shape), np.empty(shape, dtype=np.int8)
    flat = out.reshape(-1), code.reshape(-1)
    _core.resolve_many(
        _checked_policy(policy).core_policy(dt), arcs._count, arcs._psi,
        np.ascontiguousarray(pair[0]).reshape(-1), np.ascontiguousarray(pair[1]).reshape(-1), *flat,
    )  # fmt: skip
    reasons = arcs._status[pair[0]]
    code[...] = np.where(reasons != Status.OK, reasons, code)
    return Resolution(out[()], code if shape else STATUSES[code[()]])


def step(
    arm: Arm,
    q_now: ArrayLike,
    pose: ArrayLike,
    *,
    gc: int | None = None,
    policy: Policy = _DEFAULT_POLICY,
    dt: float | None = None,
    carry: Carry = "psi",
    max_joint_step: float | None = None,
    allowed: Allowed | None = None,
    singularity_margin: float = 0.0,
    velocity: Bound = None,
    acceleration: Bound = None,
    velocity_now: ArrayLike | None = None,
) -> Step:
    """Return the joints for the next pose of a control loop: one pass of the paper's figure 10.

    Feasible arcs at the new pose, next arm angle by the policy, closed-form inverse, and the checks that make
    the motion continuous: q is lifted next to `q_now`; a joint whose turns are used up, or a joint that would
    move more than `max_joint_step`, is a status, and the posture stays.

    With bounds the arm angle is the nearest to the policy's wish whose joints keep them. **What is returned
    with OK keeps them**, judged by the joints themselves: ``v = (q - q_now) / dt`` has
    ``|v| <= velocity`` and ``|v - velocity_now| <= acceleration * dt``; and every joint can still brake
    before its limit. Where no arm angle does, the status is VELOCITY_LIMIT, ACCELERATION_LIMIT or JOINT_JUMP.

    Parameters
    ----------
    arm : Arm
    q_now : array_like, shape (7,)
        Present joints, rad.
    pose : array_like, shape (4, 4)
        Tool frame to go to, position in m.
    gc : int, optional
        Global configuration 0..7 of the new posture; that of `q_now` by default.
    policy : Repulsion, Hold or Centre
    dt : float, optional
        Time of the step, s; needed by a policy with ``rate=``.
    carry : "psi" or "elbow"
        What is kept from posture to posture before the policy acts: the number psi (the paper), or the elbow
        axis itself, which stays still where the wrist passes near the base axis.
    max_joint_step : float, optional
        Largest move of a joint, rad; 0.2 by default. A policy that asks for more gets the arm angle nearest
        to its wish that fits; what the pose alone forces beyond it is JOINT_JUMP.
    allowed : ArcSet or function (4, 4) -> ArcSet, optional
        Arcs of the user's own, intersected.
    singularity_margin : float
        As in `Arm.feasible`, rad.
    velocity : array_like, shape (7,), or True, optional
        Greatest joint speeds, rad/s, > 0; True: the arm's own, ``arm.velocity``. Needs `dt`.
    acceleration : array_like, shape (7,), or True, optional
        Greatest joint accelerations, rad/s², > 0; True: ``arm.acceleration``. Needs `dt` and `velocity_now`.
    velocity_now : array_like, shape (7,), optional
        Joint velocities of the step before, rad/s.

    Returns
    -------
    Step
        Never raises on geometry: see ``status``.

    Raises
    ------
    ShapeError, NotFiniteError, NotRotationError, ConfigurationError, PolicyError, InputError

    Source: Faria et al. (2018), Fig. 10, Eq. (36).

    Examples
    --------
    >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
    >>> q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    >>> pose = arm.forward(q)[0].copy()
    >>> pose[2, 3] += 0.001
    >>> step(arm, q, pose).status.name
    'OK'
    """
    native, code, largest, index, margin = _options(gc, policy, dt, carry, max_joint_step, singularity_margin)
    count = psi = None
    if allowed is not None:
        count, psi = _one_allowed(allowed, as_floats("pose", pose, (4, 4)))
    bounds = None
    if velocity is not None or acceleration is not None:
        bounds = step_bounds(arm, velocity, acceleration, velocity_now, dt)
    core_step = arm._core.step_one
    result = core_step(q_now, pose, native, code, largest, index, margin, count, psi, bounds)
    if result is None:
        joints, frame = as_floats("q_now", q_now, (JOINTS,)), as_floats("pose", pose, (4, 4))
        if joints.ndim != 1 or frame.ndim != 2:
            raise ShapeError(
                f"q_now has shape {joints.shape} and pose {frame.shape}, wanted (7,) and (4, 4); "
                "follow takes sequences"
            )
        joints, frame = np.ascontiguousarray(joints), np.ascontiguousarray(frame)
        result = core_step(joints, frame, native, code, largest, index, margin, count, psi, bounds)
    if len(result) == 3:
        raise_problem(result, (), joints="q_now")
    q, angle, index, code, margin = result
    return _new_step(Step, (q, angle, index, STATUSES[code], margin))


def follow(
    arm: Arm,
    poses: ArrayLike,
    *,
    start: ArrayLike,
    gc: int | None = None,
    policy: Policy = _DEFAULT_POLICY,
    dt: float | None = None,
    carry: Carry = "psi",
    max_joint_step: float | None = None,
    allowed: Allowed | None = None,
    singularity_margin: float = 0.0,
    on_fail: OnFail = "stop",
    velocity: Bound = None,
    acceleration: Bound = None,
    velocity_now: ArrayLike | None = None,
    lookahead: int = 0,
) -> JointPath:
    """Return the motion along a sequence of poses: `step` in a loop, bit for bit, in C++.

    A local rule runs into dead ends: an arc that closes while another remains. With ``lookahead=n`` every
    step sees at least n poses beyond its own (2n at most) and keeps psi where all of them can still be
    reached, moving no joint further from pose to pose than `max_joint_step` and `velocity` allow; the
    policy is repelled from the ends of that part, not of the arc. **A dead end inside the window is
    avoided if there is a way around it from the posture at which it comes into sight**, with one per cent
    of the speed to spare. Where there is none, the motion goes as far as it can. Bounds on acceleration
    are kept as without lookahead, but met ahead only by keeping half of the speed back: a way around may
    then be missed. The turns left to a joint with more than one are not foreseen. `plan` sees the whole
    path.

    Parameters
    ----------
    arm : Arm
    poses : array_like, shape (N, 4, 4)
        Tool frames, position in m. The first is stepped to from `start`.
    start : array_like, shape (7,)
        Joints before the first pose, rad.
    gc, policy, dt, carry, max_joint_step, singularity_margin
        As in `step`; `dt` is the time from pose to pose.
    allowed : ArcSet of shape () or (N,), or function (4, 4) -> ArcSet, optional
        Arcs of the user's own, intersected.
    on_fail : "stop", "hold" or "skip"
        What to do with a pose that cannot be stepped to: end there (rows behind are NaN, NOT_REACHED); stay
        in the posture and go on (its row repeats the posture); or leave its row NaN and go on.
    velocity, acceleration
        As in `step`; every OK row keeps them.
    velocity_now : array_like, shape (7,), optional
        Joint velocities before the first step, rad/s; at rest by default. They are carried from row to row,
        and are 0 where the posture stays.
    lookahead : int
        Poses beyond the present one that every step sees, 0 or more.

    Returns
    -------
    JointPath
        One row a pose, each with a status. Never raises on geometry.

    Raises
    ------
    ShapeError, NotFiniteError, NotRotationError, ConfigurationError, PolicyError, InputError

    Source: Faria et al. (2018), Fig. 10, Eq. (36).
    """
    frames = np.ascontiguousarray(as_floats("poses", poses, (4, 4)))
    if frames.ndim != 3:
        raise ShapeError(f"poses has shape {frames.shape}, wanted (N, 4, 4)")
    joints = np.ascontiguousarray(as_floats("start", start, (JOINTS,)))
    if joints.ndim != 1:
        raise ShapeError(f"start has shape {joints.shape}, wanted (7,)")
    check_angles("start", joints)
    if not isinstance(on_fail, str) or on_fail not in _ON_FAIL:
        raise InputError(f"on_fail is {on_fail!r}, wanted one of 'stop', 'hold', 'skip'")
    options = _options(gc, policy, dt, carry, max_joint_step, singularity_margin)
    window = _window(lookahead, len(frames))
    bounds = no_bounds() if window else None
    if velocity is not None or acceleration is not None:
        before = np.zeros(JOINTS) if velocity_now is None else velocity_now
        bounds = step_bounds(arm, velocity, acceleration, before, dt)
    n = len(frames)
    count = psi = None
    if allowed is not None and n:
        arcs = _allowed_arcs(allowed, frames)
        if arcs.shape not in ((), (n,)):
            raise ShapeError(f"allowed has shape {arcs.shape}, wanted () or ({n},)")
        count, psi = arcs._count, arcs._psi
    rows = _empty_rows(n)
    problem = arm._core.follow_all(
        joints, frames, *options, _ON_FAIL.index(on_fail), count, psi, bounds, window, rows["q"],
        rows["psi"], rows["gc"], rows["status"], rows["margin"], rows["residual"],
    )  # fmt: skip
    if problem:
        raise_problem(problem, (n,))
    s = np.linspace(0.0, 1.0, n) if n != 1 else np.zeros(1)
    return JointPath(arm=arm, s=s, poses=frames.copy(), start=joints.copy(), **rows)


def _window(lookahead: int, n: int) -> int:
    """Return how many poses to look ahead, no more than there are."""
    if isinstance(lookahead, bool) or not isinstance(lookahead, int) or lookahead < 0:
        raise InputError(f"lookahead is {lookahead!r}, wanted a number of poses, 0 or more")
    return min(lookahead, n)


def _empty_rows(n: int) -> dict[str, Any]:
    return {
        "q": np.empty((n, JOINTS)), "psi": np.empty(n), "gc": np.empty(n, dtype=np.int64),
        "status": np.empty(n, dtype=np.int8), "margin": np.empty(n), "residual": np.empty(n),
    }  # fmt: skip


def _options(
    gc: int | None,
    policy: Policy,
    dt: float | None,
    carry: Carry,
    max_joint_step: float | None,
    singularity_margin: float,
) -> tuple[Any, int, float, int, float]:
    """Return what the core takes: policy, carry, largest step, gc (-1: that of q), margin."""
    try:
        code = _CARRY[carry]
    except (KeyError, TypeError):
        raise InputError(f"carry is {carry!r}, wanted 'psi' or 'elbow'") from None
    index = _GC_OF_Q
    if gc is not None:
        wanted = as_gc(gc)
        if wanted.ndim or not 0 <= wanted < CONFIGURATIONS:
            raise ConfigurationError(f"gc is {gc!r}, wanted an integer from 0 to 7")
        index = int(wanted)
    largest = MAX_JOINT_STEP
    if max_joint_step is not None:
        largest = as_number("max_joint_step", max_joint_step, 0.0, np.inf, low_open=True)
    margin = singularity_margin
    if type(margin) is not float or margin != 0.0:
        margin = as_number("singularity_margin", margin, 0.0, MOST_MARGIN)
    if policy.__class__ not in _POLICIES:
        policy = _checked_policy(policy)
    return policy.core_policy(dt), code, largest, index, margin


def _checked_policy(policy: Policy) -> Policy:
    if not isinstance(policy, POLICIES):
        raise InputError(f"policy is {policy!r}, wanted Repulsion, Hold or Centre")
    return policy


def _one_allowed(allowed: Allowed, pose: Floats) -> tuple[Any, Any]:
    arcs = _checked(_allowed_arcs(allowed, pose))
    return arcs._count, arcs._psi


def _allowed_arcs(allowed: Allowed, poses: Floats) -> ArcSet:
    """Return the user's arcs for poses (..., 4, 4): one set, or one a pose."""
    if isinstance(allowed, ArcSet):
        return _few(allowed)
    if not callable(allowed):
        raise InputError(f"allowed is {allowed!r}, wanted an ArcSet or a function of a pose")
    sets = [_checked(allowed(pose)) for pose in poses.reshape(-1, 4, 4)]
    arrays = [
        np.concatenate([getattr(arcs, name) for arcs in sets])
        for name in ("_count", "_psi", "_joint", "_side", "_value", "_status")
    ]
    return ArcSet._from_core(poses.shape[:-2], tuple(arrays))


def _checked(arcs: object) -> ArcSet:
    if not isinstance(arcs, ArcSet) or arcs.shape:
        raise InputError(f"allowed gives {arcs!r}, wanted an ArcSet of shape ()")
    return _few(arcs)


def _few(arcs: ArcSet) -> ArcSet:
    """Return the arcs, as few as can be intersected with any feasible ones (up to 16) without loss."""
    most = _core.ARC_CAPACITY // 2
    if (arcs._count > most).any():
        raise InputError(f"allowed holds {int(arcs._count.max())} arcs, wanted at most {most}")
    return arcs
