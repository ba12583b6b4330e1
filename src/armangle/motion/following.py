"""A sequence of steps along poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import JOINTS, Floats, about_z, as_whole, chosen, many_poses, named, one_posture
from .._progress import Progress, as_progress, in_parts, progressing
from ..arm.allowed import Allowed, allowed_arcs
from ..arm.arm import Arm, check_arm
from ..arm.question import Fallback
from ..arm.roll import Roll, last_margin
from ..errors import InputError
from ..scenes.moving import Scenes, ready_each, scenes_at
from ..scenes.scene import Scene, no_scene
from .joint_path import JointPath, blank_rows, even_parameters
from .kinds import check_step
from .options import (
    CARRIES,
    UNBOUNDED,
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

    A local rule may run into a dead end: an arc that closes while another remains. With ``lookahead=n`` every
    step sees at least n poses beyond its own (2n at most). If steps without lookahead would miss one of them,
    psi stays where all of them remain reachable. No joint then moves further from pose to pose than
    `max_joint_step` and `velocity` allow; the policy is repelled from the ends of that part, not of the arc.
    **A dead end inside the window is avoided if there is a way around it from the configuration at which it
    comes into sight**, with one per cent of the speed in reserve. If there is none, the motion goes as far as
    it can. Bounds on acceleration hold as without lookahead, but the prediction only reserves half of the
    speed for them: a way around may then be missed. Two things are not predicted. One is the turns left to a
    joint with more than one. The other is a branch that meets this one at θ₂ = 0 or θ₆ = 0: it is used where
    the own one ends. `plan` sees the whole path.

    Parameters
    ----------
    arm : Arm
    poses : array_like of shape (N, 4, 4), Line, CircularArc, Screw, or a list of them
        Poses of the end effector, position in m. The first is reached by a step from `start`. A path is
        followed at `samples` poses, at equal steps of s, and where its pieces join.
    start : array_like, shape (7,)
        Joints before the first pose, rad.
    gc, policy, dt, carry, max_joint_step, fallback
        As in `step`; `dt` is the time from pose to pose.
    roll : "pose" or "free"
        As in `step`: joint 7 keeps its value in `start`, and `JointPath.poses` are the poses reached. If the
        tool's z axis is not axis 7, 73 rolls about it are tried. They start from that of `start` and change
        linearly along the path by up to half a turn. The result is the one with the most solved poses, among
        those the one with the least joint travel.
    allowed : ArcSet of shape () or (N,), or function (4, 4) -> ArcSet, optional
        Arcs given by the user, intersected.
    scene : sequence of N Scenes, or function s -> Scene, optional
        Moving obstacles instead of the arm's own: one scene a pose, or a function of s in [0, 1], called once
        a pose before any motion. Each row avoids the obstacles at its time, and with `lookahead` the coming
        poses those at theirs.
    on_fail : "stop", "hold" or "skip"
        What to do if a step does not reach its pose: end there (later rows are NaN, NOT_REACHED); keep the
        result of the step and continue, with bounds as far as they allow (PARTIAL), otherwise at rest; or
        leave its row NaN and continue. An empty row has the step's ``why`` as its status.
    velocity, acceleration
        As in `step`; every OK row respects them.
    velocity_now : array_like, shape (7,), optional
        Joint velocities before the first step, rad/s; at rest by default. They continue from row to row.
    lookahead : int
        Poses beyond the present one that every step sees, 0 or more.
    blend, samples
        For a path, as in `plan`.

    Returns
    -------
    JointPath
        One row a pose, each with a status. Geometry never raises.

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
    path, s, frames = _sampled(arm._handle, poses, blend, samples)
    joints = one_posture("start", start)
    laddered, told = is_laddered(arm, roll), as_progress(progress)
    if laddered and len(frames):

        def followed(rung: Rung, tell: Progress) -> JointPath:
            """Return the motion along the path with this roll."""
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
    hint_step(max_joint_step)
    window = _window(lookahead, len(frames))
    check_step(arm, roll, carry, policy, allowed)
    options = _core.FollowOptions(
        native, branch, CARRIES[kept], most, margin, time, beyond == "nearest",
        on_fail=failing, lookahead=window,
    )  # fmt: skip
    bounds = UNBOUNDED if window else None
    if velocity is not None or acceleration is not None:
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
    handle: _core.Arm, poses: Path | Sequence[Path] | ArrayLike, blend: ArrayLike, samples: int | None
) -> tuple[Path | None, Floats, Floats]:
    """Return path, s (N,) and poses (N, 4, 4); the path is None for poses without `blend` and `samples`."""
    path = as_path(poses, blend)
    if path is None:
        frames = many_poses("poses", cast("ArrayLike", poses), handle)
        if not np.any(blend) and samples is None:
            return None, even_parameters(len(frames)), frames
        points = Waypoints(frames)
        path = as_path(points, blend) or points
    s = np.union1d(np.linspace(0.0, 1.0, sample_count(samples)), path.breaks)
    return path, s, path.pose(s)


def _window(lookahead: int, n: int) -> int:
    """Return the number of poses to look ahead, at most all of them."""
    return min(as_whole("lookahead", lookahead, 0, np.inf, "a number of poses, 0 or more"), n)
