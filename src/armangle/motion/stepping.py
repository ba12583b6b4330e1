"""Redundancy resolution, and one step of a control loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._arrays import JOINTS, Floats, as_floats, as_gc, as_poses, broadcast, check_angles, one_posture
from .._values import by_content
from ..arm.allowed import Allowed, allowed_arcs, one_allowed
from ..arm.arm import Arm
from ..arm.offset import OffsetArm, as_srs
from ..arm.question import Fallback
from ..arm.roll import Roll, last_margin
from ..errors import InputError
from ..status import STATUSES, Status, is_solved
from .options import (
    Bound,
    Carry,
    check_arm,
    check_chain,
    check_offset,
    checked_options,
    core_policy,
    free_roll,
    outside_of,
    step_bounds,
    without_last,
)
from .policies import Policy, Repulsion, Towards

DEFAULT_POLICY = Repulsion()
_DEFAULT_RULE = core_policy(DEFAULT_POLICY, None)
_JUMP = Status.JOINT_JUMP


@by_content
class Resolution(NamedTuple):
    """The next arm angle: ``psi`` in (-π, π], rad, shape (...), and its status (codes for a batch)."""

    psi: Floats | np.float64
    status: NDArray[np.int8] | Status

    @property
    def ok(self) -> bool | NDArray[np.bool_]:
        """Whether there is a next arm angle, shape (...)."""
        found = is_solved(self.status)
        return found if found.ndim else bool(found)


@by_content
class Step(NamedTuple):
    """What a step leads to.

    OK: the posture holds the pose. PARTIAL: it is as far towards it as bounds, or the reach, allow. CLEARANCE
    with `why` OK: it holds the pose and still touches, on its way out (a policy's ``outside="escape"``). On
    any other status nothing moves; where accelerations are bound, every joint brakes.

    ``q (7,)`` rad, continuous with the present joints; ``psi`` rad in (-π, π]; ``gc`` 0..7, another than
    before where the joints passed θ₂ = 0 or θ₆ = 0; ``status``; ``margin`` least distance of a joint of q to
    one of its limits, rad; ``velocity (7,)`` rad/s, ``(q - q_now) / dt``, without `dt` NaN and read-only;
    ``why`` a `Status`: what keeps the posture from the pose, OK where nothing does.
    """

    q: Floats
    psi: float
    gc: int
    status: Status
    margin: float
    velocity: Floats
    why: Status

    @property
    def ok(self) -> bool:
        """Whether the joints hold the pose: the status is OK, or UNPROVEN for an own chain."""
        return bool(is_solved(self.status))


def resolve(
    arm: Arm,
    pose: ArrayLike,
    psi: ArrayLike,
    gc: ArrayLike,
    *,
    policy: Policy = DEFAULT_POLICY,
    dt: float | None = None,
    allowed: Allowed | None = None,
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
    policy : Repulsion, Hold, Centre or Towards
        How the arm angle moves on its arc.
    dt : float, optional
        Time of the step, s; needed by a policy with ``rate=``.
    allowed : ArcSet or function (4, 4) -> ArcSet, optional
        Arcs of the user's own, intersected: task-space obstacles (the paper's section 6).

    Returns
    -------
    Resolution
        ``psi`` float64 (...) in (-π, π] and ``status``; where no arc is feasible psi is the given one and the
        status says why.

    Raises
    ------
    ArmangleError
        As `Arm.feasible`; `InputError` where dt is missing.

    Source: Faria et al. (2018), Eq. (36).

    Examples
    --------
    >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
    >>> pose, psi, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    >>> resolve(arm, pose, psi, gc).status.name
    'OK'
    """
    check_arm(arm)
    as_srs(arm, "resolve")
    angles = as_floats("psi", psi)
    check_angles("psi", angles)
    branch = as_gc(gc)
    arcs = own = arm.feasible(pose, branch)
    kept = arm._keeps_soft(pose, branch, arm.scene)
    if allowed is not None:
        poses = np.broadcast_to(as_poses("pose", pose, arm._handle), (*arcs.shape, 4, 4))
        arcs = own & allowed_arcs(allowed, poses)
    index = np.arange(len(arcs._count)).reshape(arcs.shape)
    native = core_policy(policy, dt)
    named = [("arcs", index, 0), ("psi", angles, 0)]
    if isinstance(policy, Towards) and policy.psi is None:
        wanted = arm.psi_towards(pose, gc, policy.point, direction=policy.direction, on_error="nan")
        named.append(("pose", np.asarray(wanted), 0))
    shape, arrays = broadcast(named)
    out, code = np.empty(shape), np.empty(shape, dtype=np.int8)
    sets, psi_now, *wish = (np.ascontiguousarray(array).reshape(-1) for array in arrays)
    _core.resolve_many(
        native, arcs._count, arcs._psi, *kept, sets, psi_now, wish[0] if wish else None,
        out.reshape(-1), code.reshape(-1),
    )  # fmt: skip
    reasons = np.broadcast_to(np.asarray(own.status), arcs.shape).reshape(-1)[arrays[0]]
    shut = arcs._count[arrays[0]] == 0
    code[...] = np.where(shut, np.where(reasons == Status.OK, Status.NOT_ALLOWED, reasons), code)
    return Resolution(out[()], code if shape else STATUSES[code[()]])


def step(
    arm: Arm,
    q_now: ArrayLike,
    pose: ArrayLike,
    *,
    gc: int | None = None,
    policy: Policy = DEFAULT_POLICY,
    dt: float | None = None,
    carry: Carry = "psi",
    max_joint_step: float | None = None,
    allowed: Allowed | None = None,
    velocity: Bound = None,
    acceleration: Bound = None,
    velocity_now: ArrayLike | None = None,
    fallback: Fallback = None,
    roll: Roll = "pose",
) -> Step:
    """Return the joints for the next pose of a control loop: one pass of the paper's figure 10.

    Feasible arcs at the new pose, next arm angle by the policy, closed-form inverse, and the checks that make
    the motion continuous: q is lifted next to `q_now`; a joint whose turns are used up, or a joint that would
    move more than `max_joint_step`, is a status, and the posture stays. Where θ₂ or θ₆ passes 0, two branches
    meet and the joints go on into the other one, if on the straight way there they keep the tool as near to
    its own way as it moves; through a straight elbow where nothing else is a step.

    With bounds the arm angle is the nearest to the policy's wish whose joints keep them. **What is returned
    with OK or PARTIAL keeps them**, judged by the joints themselves: ``v = (q - q_now) / dt`` has
    ``|v| <= velocity`` and ``|v - velocity_now| <= acceleration * dt``; and every joint can still brake
    before its limit. (Given a `velocity_now` with which a joint cannot, it brakes as hard as it may.)

    Where no arm angle does, ``why`` is the first condition without which one would: NOT_ALLOWED, CLEARANCE,
    ACCELERATION_LIMIT, VELOCITY_LIMIT, WINDING_EXHAUSTED, LIMITS, and JOINT_JUMP if none is. With bounds the
    step then goes as far towards a posture of the pose as they allow, all joints along one straight line, and
    the steps that follow come to rest on the pose: PARTIAL. Without bounds nothing moves, nor with obstacles,
    for nobody knows whether that line is clear.

    For an arm with an offset wrist or shoulder psi is the value of joint 7 or 1, and branches meet at θ₂ = 0,
    at the stretched elbow and at the fold; bounds, ``carry``, ``roll`` and ``fallback`` are not offered.

    Parameters
    ----------
    arm : Arm
    q_now : array_like, shape (7,)
        Present joints, rad.
    pose : array_like, shape (4, 4)
        Tool frame to go to, position in m.
    gc : int, optional
        Global configuration 0..7 of the new posture. By default that of `q_now`, or one that meets it within
        the step at θ₂ = 0 or θ₆ = 0; the other side of the elbow where one step takes it through straight
        and its own side has no posture within the step, unless the arm's `singularity_margin` parts the two.
    policy : Repulsion, Hold, Centre or Towards
        Beside θ2 = 0 or θ6 = 0, where joints next to that hinge would sweep round, `Repulsion` gives way
        to the posture next to `q_now`.
    dt : float, optional
        Time of the step, s; needed by a policy with ``rate=``, by bounds, and for ``velocity``.
    carry : "psi" or "elbow"
        What is kept from posture to posture before the policy acts: the number psi (the paper), or the elbow
        axis itself, which stays still where the wrist passes near the base axis. Where the one is no step,
        the other is tried.
    max_joint_step : float, optional
        Largest move of a joint, rad; by default 0.2, with `dt` below 10 ms 20 rad/s of it. A policy that asks
        for more gets the arm angle nearest to its wish that fits, in whatever arc; what the pose alone forces
        beyond it is JOINT_JUMP, what a limit forces LIMITS or WINDING_EXHAUSTED, what `allowed` forces
        NOT_ALLOWED.
    allowed : ArcSet or function (4, 4) -> ArcSet, optional
        Arcs of the user's own, intersected.
    velocity : float, array_like of shape (7,), or True, optional
        Greatest joint speeds, rad/s, > 0; a number for all joints; True: the arm's own, ``arm.velocity``.
        Needs `dt`.
    acceleration : float, array_like of shape (7,), or True, optional
        Greatest joint accelerations, rad/s², > 0; True: ``arm.acceleration``. Needs `dt` and `velocity_now`.
    velocity_now : array_like, shape (7,), optional
        Joint velocities of the step before, rad/s.
    fallback : None or "nearest_pose"
        If no arm angle of the pose is within reach and limits: say so; or go on to the nearest pose,
        PARTIAL. That is the pose of the same orientation with its wrist drawn into what joint 4 reaches;
        where limits forbid that too, one from which no small move of the joints comes nearer
        (``sqrt(|dp|² + (0.2 m · angle)²)``). The arm's `singularity_margin` is kept on the way, on the sides
        of the singularities on which the joints are.
    roll : "pose" or "free"
        "free": joint 7 stays where it is, and the pose is held with the roll about axis 7 that this makes:
        drills, welding torches, suction cups. Of all rolls it is the one that moves joint 7 least, and none
        is refused for it. The tool's z axis must be axis 7.

    Returns
    -------
    Step
        Never raises on geometry: see ``status``. A jump from joints more than a turn outside their limits is
        an InputError: they were hardly meant in rad.

    Raises
    ------
    InputError

    Source: Faria et al. (2018), Fig. 10, Eq. (36).

    Examples
    --------
    >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
    >>> q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    >>> pose = arm.forward(q)[0].copy()
    >>> pose[2, 3] += 0.001
    >>> step(arm, q, pose).status.name
    'OK'
    >>> pose[2, 3] += 0.02                                    # too far for one tick of 1 ms
    >>> now = step(arm, q, pose, dt=0.001, velocity=True)
    >>> now.status.name, now.why.name
    ('PARTIAL', 'VELOCITY_LIMIT')
    """
    native = _DEFAULT_RULE if policy is DEFAULT_POLICY else core_policy(policy, dt)
    outside = outside_of(fallback)
    bare = allowed is None and velocity is None and acceleration is None
    if (
        bare
        and type(arm) is Arm
        and arm.scene is None
        and arm.chain is None
        and isinstance(roll, str)
        and roll == "pose"
    ):
        plain: Step | None = arm._handle.step_one(
            q_now, pose, native, gc, carry, max_joint_step, arm.singularity_margin, dt, outside,
            None, None, None, Step, STATUSES, None,
        )  # fmt: skip
        if plain is not None and plain.status is not _JUMP:
            return plain
    check_arm(arm)
    given = gc, carry, max_joint_step, arm.singularity_margin, dt, outside
    handle = None if isinstance(arm, OffsetArm) else arm._handle
    arcs = None, None
    if allowed is not None:
        arcs = one_allowed(allowed, as_poses("pose", pose, handle))
    if isinstance(arm, OffsetArm):
        check_offset(
            policy, velocity=velocity, acceleration=acceleration, fallback=fallback, roll=roll, carry=carry
        )  # fmt: skip
        rest = *arcs, None, Step, STATUSES, None
        return _asked(arm._handle.step_one, handle, q_now, pose, native, given, rest)
    bounds = None
    if arm.chain is not None:
        check_chain(fallback)
    if velocity is not None or acceleration is not None:
        bounds = step_bounds(arm, velocity, acceleration, velocity_now, dt)
    about = None if arm._ready is None else arm._ready.handle
    core_step = arm._handle.step_one
    if not isinstance(roll, str) or roll != "pose":
        joints = one_posture("q_now", q_now)
        free = free_roll(arm, roll, "q_now", joints, arm.scene)
        core_step = core_step if free is None else free.step_one
        bounds = bounds if bounds is None else without_last(bounds)
    others = (*arcs, bounds, Step, STATUSES, about)
    now = _asked(core_step, handle, q_now, pose, native, given, others)
    return now if roll == "pose" else now._replace(margin=_least(arm, now))


def _asked(
    core_step: Callable[..., Step | None], handle: _core.Arm | None, q_now: ArrayLike, pose: ArrayLike,
    native: Any, given: tuple[Any, ...], rest: tuple[Any, ...],
) -> Step:  # fmt: skip
    """Return the core's step; what it cannot read as it comes is converted, or refused."""
    plain = core_step(q_now, pose, native, *given, *rest)
    if plain is not None:
        return plain
    options = checked_options(*given)
    joints, frame = as_floats("q_now", q_now, (JOINTS,)), as_poses("pose", pose, handle)
    if joints.ndim != 1 or frame.ndim != 2:
        raise InputError(
            f"q_now has shape {joints.shape} and pose {frame.shape}, wanted (7,) and (4, 4); "
            "follow takes sequences"
        )
    joints, frame = np.ascontiguousarray(joints), np.ascontiguousarray(frame)
    return cast("Step", core_step(joints, frame, native, *options, *rest))


def _least(arm: Arm, now: Step) -> float:
    """Return the margin of a step whose roll is free, joint 7 with it."""
    return min(now.margin, float(last_margin(arm, now.q)))
