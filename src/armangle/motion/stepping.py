"""Redundancy resolution, and one step of a control loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import (
    JOINTS,
    BoolOrArray,
    FloatOrArray,
    Floats,
    StatusOrArray,
    as_floats,
    as_gc,
    as_poses,
    broadcast,
    check_angles,
    hint_degrees,
    one_posture,
)
from .._values import by_content
from ..arm.allowed import Allowed, allowed_arcs, one_allowed
from ..arm.arm import Arm, check_arm
from ..arm.offset import as_srs
from ..arm.question import Fallback
from ..arm.roll import Roll, last_margin
from ..errors import InputError
from ..status import STATUSES, Status, is_solved
from .kinds import check_step
from .options import (
    Bound,
    Carry,
    checked_options,
    core_policy,
    free_roll,
    hint_step,
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

    psi: FloatOrArray
    status: StatusOrArray

    @property
    def ok(self) -> BoolOrArray:
        """Whether there is a next arm angle, shape (...); a bool for one pose."""
        found = is_solved(self.status)
        return found if found.ndim else bool(found)


@by_content
class Step(NamedTuple):
    """Result of one step.

    OK, or UNPROVEN for an own chain: the joints solve the pose. PARTIAL: they are as near to it as bounds, or
    the reach, allow. CLEARANCE with `why` OK: they solve the pose while leaving a collision (a policy's
    ``outside="escape"``). With any other status nothing moves; if accelerations are bounded, joints brake.

    ``q (7,)`` rad, continuous with the present joints; ``psi`` rad in (-π, π]; ``gc`` 0..7, which changes if
    the joints passed θ₂ = 0 or θ₆ = 0; ``status``; ``margin`` distance to the nearest joint limit, rad;
    ``velocity (7,)`` rad/s, ``(q - q_now) / dt``, without `dt` NaN and read-only; ``why`` a `Status`: the
    reason why q does not solve the pose, otherwise OK.
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
        """Whether the joints solve the pose: the status is OK, or UNPROVEN for an own chain."""
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
        Present arm angle, rad, any real number.
    gc : array_like of int, shape (...)
        Global configuration 0..7.
    policy : Repulsion, Hold, Centre or Towards
        The rule that moves the arm angle on its arc.
    dt : float, optional
        Time of the step, s; required for a policy with ``rate=``.
    allowed : ArcSet or function (4, 4) -> ArcSet, optional
        Arcs given by the user, intersected: task-space obstacles (the paper's section 6).

    Returns
    -------
    Resolution
        ``psi`` float64 (...) in (-π, π] and ``status``; if no arc is feasible psi is the given one and the
        status gives the reason.

    Raises
    ------
    ArmangleError
        As `Arm.feasible`; `InputError` if dt is missing; `UnsupportedError` for an offset wrist or shoulder.

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
    hint_degrees("psi", angles)
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

    It computes the feasible arcs at the new pose, the next arm angle by the policy, and the closed-form
    inverse. Checks make the motion continuous: q is on the turns nearest to `q_now`. If a joint has no turn
    left, or would move more than `max_joint_step`, the status says so and nothing moves. If θ₂ or θ₆ passes
    0, two branches meet and the joints continue into the other one. The condition is that the straight joint
    motion keeps the end effector as near to its path as it moves. They pass through a straight elbow only if
    no other step exists.

    With bounds the arm angle is the one nearest to the policy's target whose joints respect them. **A result
    with OK or PARTIAL respects them**, measured on the joints: ``v = (q - q_now) / dt`` has ``|v| <=
    velocity`` and ``|v - velocity_now| <= acceleration * dt``; and every joint can still brake before its
    limit. (If that is impossible from the given `velocity_now`, the joint brakes as hard as it may.)

    If no arm angle does, ``why`` is the first condition whose removal permits one: NOT_ALLOWED, CLEARANCE,
    ACCELERATION_LIMIT, VELOCITY_LIMIT, WINDING_EXHAUSTED, LIMITS, and JOINT_JUMP if none does. So
    VELOCITY_LIMIT means that the pose is too far for one step even without the bound on acceleration, which
    may slow this very step more. With bounds the step then moves as far towards a solution of the pose as
    they allow, all joints along one straight line, and the following steps come to rest on the pose: PARTIAL.
    Without bounds nothing moves; with obstacles neither, because that line may not be collision-free.

    For an arm with an offset wrist or shoulder psi is the value of joint 7 or 1, and branches meet at θ₂ = 0,
    at the stretched elbow and at the fold; ``carry`` is not supported.

    Parameters
    ----------
    arm : Arm
    q_now : array_like, shape (7,)
        Present joints, rad.
    pose : array_like, shape (4, 4)
        Target pose of the end effector, position in m.
    gc : int, optional
        Global configuration 0..7 of the result. By default that of `q_now`, or one that meets it within the
        step at θ₂ = 0 or θ₆ = 0. The other side of the elbow is used if one step passes through straight and
        its own side has no solution within the step, unless the arm's `singularity_margin` separates the two.
    policy : Repulsion, Hold, Centre or Towards
        Near θ2 = 0 or θ6 = 0, where joints next to that hinge would sweep around, `Repulsion` yields to the
        solution nearest to `q_now`.
    dt : float, optional
        Time of the step, s; required for a policy with ``rate=``, for bounds, and for ``velocity``.
    carry : "psi" or "elbow"
        The quantity kept between poses before the policy acts: the number psi (the paper), or the elbow axis
        itself, which stays steady if the wrist passes near the base axis. If one gives no step, the other is
        tried.
    max_joint_step : float, optional
        Largest move of a joint, rad; by default 0.2, or 20 rad/s for `dt` below 10 ms. If a policy requests
        more, the result is the arm angle nearest to its target that fits, in any arc. A larger move required
        by the pose alone is JOINT_JUMP, by a limit LIMITS or WINDING_EXHAUSTED, by `allowed` NOT_ALLOWED.
    allowed : ArcSet or function (4, 4) -> ArcSet, optional
        Arcs given by the user, intersected.
    velocity : float, array_like of shape (7,), or True, optional
        Largest joint velocities, rad/s, > 0; a number for all joints; True: the arm's own, ``arm.velocity``.
        Requires `dt`.
    acceleration : float, array_like of shape (7,), or True, optional
        Largest joint accelerations, rad/s², > 0; True: ``arm.acceleration``. With `dt` and `velocity_now`.
    velocity_now : array_like, shape (7,), optional
        Joint velocities of the previous step, rad/s.
    fallback : None or "nearest_pose"
        If no arm angle of the pose is within reach and limits: return the status; or move to the nearest
        pose, PARTIAL. That is the pose of the same orientation with its wrist moved into joint 4's reach. If
        limits forbid that too, it is one from which no small joint move comes nearer (``sqrt(|dp|² + (0.2 m ·
        angle)²)``). An own chain or an arm with an offset finds both from its present joints, so a nearer
        pose may exist far from them. The arm's `singularity_margin` is kept on the way, on the joints'
        present sides of the singularities. With a scene nothing moves.
    roll : "pose" or "free"
        "free": joint 7 is constant, and the pose has any roll about axis 7: drills, welding torches, suction
        cups. This roll moves joint 7 least, and no pose is rejected for its roll. The tool's z axis must be
        axis 7. If psi is joint 7 it is constant too, and neither `allowed` nor ``Towards(psi=)`` applies.

    Returns
    -------
    Step
        Geometry never raises: see ``status``. Joints more than a turn outside their limits raise an
        InputError: they were probably not meant in rad.

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
    hint_step(max_joint_step)
    bare = allowed is None and velocity is None and acceleration is None
    if (
        bare
        and type(arm) is Arm
        and arm.scene is None
        and arm.geometry.chain is None
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
    arcs = None, None
    if allowed is not None:
        arcs = one_allowed(allowed, as_poses("pose", pose, arm._handle))
    bounds = None
    check_step(arm, roll, carry, policy, allowed)
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
    now = _asked(core_step, arm._handle, q_now, pose, native, given, others)
    if roll == "pose":
        return now
    return now._replace(margin=min(now.margin, float(last_margin(arm, now.q))))


def _asked(
    core_step: Callable[..., Step | None], handle: _core.Arm, q_now: ArrayLike, pose: ArrayLike,
    native: Any, given: tuple[Any, ...], rest: tuple[Any, ...],
) -> Step:  # fmt: skip
    """Return the core's step; options `given` that it cannot read directly are converted first, or raise."""
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
