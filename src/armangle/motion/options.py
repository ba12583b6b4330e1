"""Options that `step` and `follow` share, in the core's format, and the user's arcs."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import (
    JOINTS,
    Floats,
    as_floats,
    as_number,
    chosen,
    hint_degrees,
    named,
    one_branch,
    one_or_seven,
    warn,
)
from ..arm.arm import Arm
from ..arm.question import Fallback
from ..arm.roll import ROLLS, Roll, check_free_roll, is_along_axis_7, last_margin
from ..errors import InputError
from .policies import POLICIES, Policy

Carry = Literal["psi", "elbow"]
Options = tuple[int | None, Carry, float | None, float, float | None, str]

MAX_JOINT_STEP: float = _core.MAX_JOINT_STEP
LONGEST_STEP: float = _core.LONGEST_STEP
"""Longest time of a step, s."""
_LONG_STEP = 1.0  # s: a longer step was probably not meant in s
_LIKE_DEGREES = {"velocity": (40.0, "rad/s"), "acceleration": (200.0, "rad/s²")}
"""Larger finite bounds were probably not meant in rad: no joint of such an arm is so fast."""

CARRIES = named(_core.Carry)


def checked_options(
    gc: int | None, carry: Carry, max_joint_step: float | None, margin: float, dt: float | None, outside: str
) -> Options:  # fmt: skip
    """Return options in the core's types, or raise; `margin` (rad) and `outside` are returned unchecked."""
    kept: Carry = "elbow" if chosen("carry", carry, CARRIES) == "elbow" else "psi"
    if gc is not None:
        gc = one_branch("gc", gc)
    if max_joint_step is not None:
        max_joint_step = as_number("max_joint_step", max_joint_step, 0.0, np.inf, low_open=True)
    if dt is not None:
        dt = as_number("dt", dt, 0.0, LONGEST_STEP, low_open=True)
    return gc, kept, max_joint_step, margin, dt, outside


def hint_step(max_joint_step: float | None) -> None:
    """Warn if the largest move of a joint (rad) was probably given in degrees: more than half a turn."""
    if isinstance(max_joint_step, (float, int)) and np.pi < max_joint_step <= _core.LARGEST_ANGLE:
        hint_degrees("max_joint_step", np.asarray(max_joint_step), np.pi)


def outside_of(fallback: Fallback) -> str:
    """Return the core's word for what happens at a pose out of reach."""
    if fallback is None:
        return "refuse"
    chosen("fallback", fallback, ("nearest_pose",))
    return "nearest"


def as_seconds(dt: float) -> float:
    """Return the time of a step, s, and warn if it looks like another unit; `InputError` if it is no time."""
    if isinstance(dt, bool):
        raise InputError(f"dt is {dt}, wanted a time in s")
    time = as_number("dt", dt, 0.0, LONGEST_STEP, low_open=True)
    if time > _LONG_STEP:
        warn(f"dt is {time:g} s, long for one step: was it in ms, or a rate in Hz?")
    return time


def free_roll(arm: Arm, roll: Roll, name: str, joints: Floats, scene: object) -> Any:
    """Return the core's arm whose joint 7 stays if the roll is free, else None; errors call joints `name`.

    Raises `InputError` if the tool's z axis is not axis 7, joint 7 violates its limits, or a shape in the
    scene would turn.
    """
    if chosen("roll", roll, ROLLS) == "pose":
        return None
    if not is_along_axis_7(arm):
        raise InputError(
            "roll is 'free': a single step can only roll about axis 7, and the tool's z axis is not axis 7; "
            "arm.solve takes it, pose by pose, follow and plan take a whole path"
        )
    check_free_roll(arm, scene)
    if last_margin(arm, joints) < 0:
        raise InputError(
            f"roll is 'free', and joint 7 of {name} stands outside its limits, where it would stay"
        )
    return arm._handle.with_free_roll()


def core_policy(policy: Policy, dt: float | None) -> Any:
    """Return a policy in the core's format, for a step of `dt` s."""
    if not isinstance(policy, POLICIES):
        raise InputError(f"policy is {policy!r}, wanted Repulsion, Hold, Centre or Towards")
    return policy._native(dt)


Bound = ArrayLike | bool | None

UNBOUNDED = np.concatenate([[1.0], np.full(2 * JOINTS, np.inf), np.zeros(JOINTS)])
"""Bounds for the core that limit nothing."""


def joint_bound(arm: Arm, name: str, value: Bound, stated: Floats) -> Floats:
    """Return a bound for each joint (7,): infinite for None, `stated`, the arm's own, for True, else `value`.

    Raises `InputError` if it is NaN, negative or 0, or True and the arm has none.
    """
    if value is None or value is False:
        return np.full(JOINTS, np.inf)
    if value is True:
        if np.isinf(stated).all():
            raise InputError(
                f"{name} is the arm's own, and {arm.name or 'the arm'} states none: "
                f"give {name}=, one number for all joints or seven"
            )
        return stated
    return positive(name, value)


def positive(name: str, value: ArrayLike) -> Floats:
    """Return one number or seven, > 0, as (7,), and warn if they look like degrees; or raise `InputError`."""
    bound = one_or_seven(name, value)
    if np.isnan(bound).any():
        raise InputError(f"{name} holds nan, wanted numbers > 0")
    if not (bound > 0).all():
        raise InputError(f"{name} holds {bound.min():g}, wanted numbers > 0")
    suspicious, unit = _LIKE_DEGREES.get(name, (np.inf, ""))
    largest = bound[bound < np.inf].max(initial=0.0)
    if largest > suspicious:
        warn(f"{name} holds {largest:g}, wanted {unit}: were these degrees?")
    return bound


def step_bounds(
    arm: Arm, velocity: Bound, acceleration: Bound, velocity_now: ArrayLike | None, dt: float | None
) -> Floats:
    """Return dt (s), largest velocities and accelerations, and present velocities as the core's (22,)."""
    fastest = joint_bound(arm, "velocity", velocity, arm.velocity)
    hardest = joint_bound(arm, "acceleration", acceleration, arm.acceleration)
    if velocity_now is None:
        if np.isfinite(hardest).any():
            raise InputError("a bound on acceleration needs velocity_now, the velocities before the step")
        velocity_now = np.zeros(JOINTS)
    now = finite_seven("velocity_now", velocity_now)
    if dt is None:
        raise InputError("bounds on velocity and acceleration need dt, the time of a step in s")
    return np.concatenate([[as_seconds(dt)], fastest, hardest, now])


def finite_seven(name: str, value: ArrayLike) -> Floats:
    """Return seven joint velocities, finite, rad/s; or raise `InputError`."""
    speeds = as_floats(name, value, (JOINTS,))
    if speeds.ndim != 1:
        raise InputError(f"{name} has shape {speeds.shape}, wanted ({JOINTS},)")
    if not np.isfinite(speeds).all():
        raise InputError(f"{name} is not finite, wanted 7 numbers in rad/s")
    return speeds


def without_last(bounds: Floats) -> Floats:
    """Return bounds with 0 for the present velocity of joint 7, which does not move."""
    out = bounds.copy()
    out[-1] = 0.0
    return out
