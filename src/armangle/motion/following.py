"""A sequence of steps along poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import JOINTS, Floats, about_z, as_poses, chosen, named, one_posture
from .._progress import Progress, as_progress, in_parts, progressing
from ..arm.allowed import Allowed, allowed_arcs
from ..arm.arm import Arm
from ..arm.offset import OffsetArm
from ..arm.question import Fallback
from ..arm.roll import Roll, last_margin
from ..errors import InputError
from ..scenes.moving import Scenes, ready_each, scenes_at
from ..scenes.scene import Scene, no_scene
from .joint_path import JointPath, blank_rows, even_parameters
from .options import (
    CARRIES,
    Bound,
    Carry,
    check_arm,
    check_chain,
    check_offset,
    checked_options,
    core_policy,
    free_roll,
    no_bounds,
    outside_of,
    step_bounds,
    without_last,
)
from .paths import Path, Waypoints, as_path, rolled, sample_count
from .policies import Policy
from .rolling import Rung, best_followed, is_laddered
from .stepping import DEFAULT_POLICY

OnFail = Literal["stop", "hold", "skip"]
_ON_FAIL = named(_core.OnFail)


def follow(
    arm: Arm,
    poses: Path | Sequence[Path] | ArrayLike,
    *,
    start: ArrayLike,
    gc: int | None = None,
    policy: Policy = DEFAULT_POLICY,
    dt: float | None = None,
    carry: Carry = "psi",
    max_joint_step: float | None = None,
    allowed: Allowed | None = None,
    scene: Scenes | None = None,
    on_fail: OnFail = "stop",
    velocity: Bound = None,
    acceleration: Bound = None,
    velocity_now: ArrayLike | None = None,
    fallback: Fallback = None,
    roll: Roll = "pose",
    lookahead: int = 0,
    blend: ArrayLike = 0.0,
    samples: int | None = None,
    progress: Progress | bool | None = None,
) -> JointPath:
    """Return the motion along a sequence of poses: `step` in a loop, bit for bit, in C++.

    A local rule runs into dead ends: an arc that closes while another remains. With ``lookahead=n`` every
    step sees at least n poses beyond its own (2n at most). Where steps that see nothing ahead would not hold
    them all, psi is kept where all of them can still be reached, moving no joint further from pose to pose
    than `max_joint_step` and `velocity` allow; the policy is then repelled from the ends of that part, not of
    the arc. **A dead end inside the window is
    avoided if there is a way around it from the posture at which it comes into sight**, with one per cent
    of the speed to spare. Where there is none, the motion goes as far as it can. Bounds on acceleration
    are kept as without lookahead, but met ahead only by keeping half of the speed back: a way around may
    then be missed. The turns left to a joint with more than one are not foreseen, nor is another branch that
    meets this one at θ₂ = 0 or θ₆ = 0: it is taken where the own one ends. `plan` sees the whole path.

    Parameters
    ----------
    arm : Arm
    poses : array_like of shape (N, 4, 4), Line, CircularArc, Screw, or a list of them
        Tool frames, position in m. The first is stepped to from `start`. A path is followed at `samples`
        poses, evenly in s, and where its pieces join.
    start : array_like, shape (7,)
        Joints before the first pose, rad.
    gc, policy, dt, carry, max_joint_step, fallback
        As in `step`; `dt` is the time from pose to pose.
    roll : "pose" or "free"
        As in `step`: joint 7 stays where `start` has it, and `JointPath.poses` are those that are held. Where
        the tool's z axis is not axis 7, 73 rolls about it are tried, from that of `start` growing or falling
        evenly along the path by up to half a turn; taken is the one that is followed furthest, and of those
        the one on which joints travel least.
    allowed : ArcSet of shape () or (N,), or function (4, 4) -> ArcSet, optional
        Arcs of the user's own, intersected.
    scene : sequence of N Scenes, or function s -> Scene, optional
        Obstacles that move, in place of the arm's own: one scene a pose, or a function of s in [0, 1], called
        once a pose before anything moves. Each row keeps clear of the obstacles at its time, and with
        `lookahead` the poses ahead of those at theirs.
    on_fail : "stop", "hold" or "skip"
        What to do with a pose that its step does not reach: end there (rows behind are NaN, NOT_REACHED);
        keep what the step led to, with bounds as far as they allow (PARTIAL), else the posture as it was, and
        go on; or leave its row NaN and go on. A row left open has the step's ``why`` as its status.
    velocity, acceleration
        As in `step`; every OK row keeps them.
    velocity_now : array_like, shape (7,), optional
        Joint velocities before the first step, rad/s; at rest by default. They are carried from row to row.
    lookahead : int
        Poses beyond the present one that every step sees, 0 or more.
    blend, samples
        Of a path, as in `plan`.

    Returns
    -------
    JointPath
        One row a pose, each with a status. Never raises on geometry.

    Raises
    ------
    InputError

    Source: Faria et al. (2018), Fig. 10, Eq. (36).
    """
    check_arm(arm)
    if isinstance(scene, Scene):
        raise no_scene(
            scene, "obstacles that move: arm.with_(scene=...) keeps clear of those that stand", "follow"
        )
    path, s, frames = _sampled(None if isinstance(arm, OffsetArm) else arm._handle, poses, blend, samples)
    joints = one_posture("start", start)
    laddered, told = not isinstance(arm, OffsetArm) and is_laddered(arm, roll), as_progress(progress)
    if laddered and len(frames):

        def followed(rung: Rung, tell: Progress) -> JointPath:
            turned = frames @ about_z(rung[0] + rung[1] * s) if path is None else rolled(path, *rung)
            return follow(
                arm, turned, start=joints, gc=gc, policy=policy, dt=dt, carry=carry,
                max_joint_step=max_joint_step, allowed=allowed, scene=scene,
                on_fail=on_fail, velocity=velocity, acceleration=acceleration, velocity_now=velocity_now,
                fallback=fallback, lookahead=lookahead,
                samples=None if path is None else samples, progress=tell,
            )  # fmt: skip

        with in_parts(told) as tell:
            return best_followed(arm, path or Waypoints(frames), joints, followed, tell)
    failing = _ON_FAIL[chosen("on_fail", on_fail, _ON_FAIL)]
    native = core_policy(policy, dt)
    branch, kept, most, margin, time, beyond = checked_options(
        gc, carry, max_joint_step, arm.singularity_margin, dt, outside_of(fallback)
    )
    window = _window(lookahead, len(frames))
    if isinstance(arm, OffsetArm):
        check_offset(
            policy, scene=scene, velocity=velocity, acceleration=acceleration, fallback=fallback, roll=roll,
            carry=carry, lookahead=lookahead,
        )  # fmt: skip
    elif arm.chain is not None:
        check_chain(fallback, lookahead)
    options = _core.FollowOptions(
        native, branch, CARRIES[kept], most, margin, time, beyond == "nearest",
        on_fail=failing, lookahead=window,
    )  # fmt: skip
    bounds = no_bounds() if window else None
    if not isinstance(arm, OffsetArm) and (velocity is not None or acceleration is not None):
        before = np.zeros(JOINTS) if velocity_now is None else velocity_now
        bounds = step_bounds(arm, velocity, acceleration, before, dt)
    n = len(frames)
    count = psi = None
    if allowed is not None and n:
        arcs = allowed_arcs(allowed, frames)
        if arcs.shape not in ((), (n,)):
            raise InputError(f"allowed has shape {arcs.shape}, wanted () or ({n},)")
        count, psi = arcs._count, arcs._psi
    rows = blank_rows(n)
    columns = tuple(rows[name] for name in ("q", "psi", "gc", "status", "margin", "residual"))
    if isinstance(arm, OffsetArm):
        with progressing(told):
            arm._handle.follow_all(joints, frames, options, count, psi, None, columns, [])
        return JointPath(arm=arm, s=s, poses=frames, start=joints, path=path, **rows)
    scenes = scenes_at(arm.scene if scene is None else scene, s.tolist())
    about = [each.handle for each in ready_each(arm, scenes)]
    free = None if laddered else free_roll(arm, roll, "start", joints, scenes or None)
    if free is not None and bounds is not None:
        bounds = without_last(bounds)
    with progressing(told):
        (free or arm._handle).follow_all(joints, frames, options, count, psi, bounds, columns, about)
    held = frames.copy()
    if free is not None:
        path, done = None, np.isfinite(rows["q"][:, 0])
        rows["margin"] = np.minimum(rows["margin"], last_margin(arm, rows["q"]))
        held[done] = arm.forward(rows["q"][done], on_error="nan")[0]
    return JointPath(arm=arm, s=s, poses=held, start=joints, path=path, scenes=tuple(scenes), **rows)


def _sampled(
    handle: _core.Arm | None, poses: Path | Sequence[Path] | ArrayLike, blend: ArrayLike, samples: int | None
) -> tuple[Path | None, Floats, Floats]:
    """Return the path, its s and its poses (N, 4, 4) there; of poses that are given no path."""
    path = as_path(poses, blend)
    if path is None:
        frames = np.ascontiguousarray(as_poses("poses", cast("ArrayLike", poses), handle))
        if frames.ndim != 3:
            raise InputError(f"poses has shape {frames.shape}, wanted (N, 4, 4)")
        if not np.any(blend) and samples is None:
            return None, even_parameters(len(frames)), frames
        points = Waypoints(frames)
        path = as_path(points, blend) or points
    s = np.union1d(np.linspace(0.0, 1.0, sample_count(samples)), path.breaks)
    return path, s, path.pose(s)


def _window(lookahead: int, n: int) -> int:
    """Return how many poses to look ahead, no more than there are."""
    if isinstance(lookahead, bool) or not isinstance(lookahead, int) or lookahead < 0:
        raise InputError(f"lookahead is {lookahead!r}, wanted a number of poses, 0 or more")
    return min(lookahead, n)
