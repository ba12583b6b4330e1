"""A sequence of steps along poses."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import JOINTS, as_poses, chosen, named, one_posture
from ..arm.allowed import Allowed, allowed_arcs
from ..arm.arm import Arm
from ..errors import InputError, ShapeError
from .joint_path import JointPath, blank_rows, even_parameters
from .options import (
    CARRIES,
    Bound,
    Carry,
    checked_options,
    core_policy,
    no_bounds,
    step_bounds,
)
from .policies import Policy
from .stepping import DEFAULT_POLICY

OnFail = Literal["stop", "hold", "skip"]
_ON_FAIL = named(_core.OnFail)


def follow(
    arm: Arm,
    poses: ArrayLike,
    *,
    start: ArrayLike,
    gc: int | None = None,
    policy: Policy = DEFAULT_POLICY,
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
    frames = np.ascontiguousarray(as_poses("poses", poses, arm._handle))
    if frames.ndim != 3:
        raise ShapeError(f"poses has shape {frames.shape}, wanted (N, 4, 4)")
    joints = one_posture("start", start)
    failing = _ON_FAIL[chosen("on_fail", on_fail, _ON_FAIL)]
    native = core_policy(policy, dt)
    branch, kept, most, margin = checked_options(gc, carry, max_joint_step, singularity_margin)
    window = _window(lookahead, len(frames))
    options = _core.FollowOptions(
        native, branch, CARRIES[kept], most, margin, on_fail=failing, lookahead=window
    )
    bounds = no_bounds() if window else None
    if velocity is not None or acceleration is not None:
        before = np.zeros(JOINTS) if velocity_now is None else velocity_now
        bounds = step_bounds(arm, velocity, acceleration, before, dt)
    n = len(frames)
    count = psi = None
    if allowed is not None and n:
        arcs = allowed_arcs(allowed, frames)
        if arcs.shape not in ((), (n,)):
            raise ShapeError(f"allowed has shape {arcs.shape}, wanted () or ({n},)")
        count, psi = arcs._count, arcs._psi
    rows = blank_rows(n)
    columns = tuple(rows[name] for name in ("q", "psi", "gc", "status", "margin", "residual"))
    arm._handle.follow_all(joints, frames, options, count, psi, bounds, columns)
    return JointPath(arm=arm, s=even_parameters(n), poses=frames.copy(), start=joints, **rows)


def _window(lookahead: int, n: int) -> int:
    """Return how many poses to look ahead, no more than there are."""
    if isinstance(lookahead, bool) or not isinstance(lookahead, int) or lookahead < 0:
        raise InputError(f"lookahead is {lookahead!r}, wanted a number of poses, 0 or more")
    return min(lookahead, n)
