"""Derivatives of an arm's functions: by the pose, by the arm angle and by the joints.

The derivative of `Arm.forward` is `Arm.jacobian` with `psi` as a seventh row; that of `Arm.inverse` by psi is
`Arm.self_motion`. psi of an arm with an offset wrist or shoulder is the value of its free joint. All take
arms of every kind but `joint_function`, which raises `UnsupportedError` for all but exact S-R-S arms.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import JOINTS, Floats, as_floats, as_poses, as_whole, chosen, one_branch, one_pose
from ._threads import thread_count
from .arm.arcs import ArcSet
from .arm.arm import ON_ERROR, Arm, OnError
from .arm.joint_function import JointFunction
from .arm.question import METRICS, Prefer, branch_bits, weights_of
from .errors import UnsupportedError

__all__ = ["feasible", "freedom", "inverse", "joint_function", "limit_margin", "margin", "psi", "solve"]


def inverse(
    arm: Arm,
    pose: ArrayLike,
    psi: ArrayLike,
    gc: ArrayLike,
    *,
    on_error: OnError = "raise",
) -> Floats:
    """Return the derivative of the joints of `inverse` with respect to the pose and the arm angle.

    Parameters
    ----------
    arm : Arm
    pose : array_like, shape (..., 4, 4)
        Pose of the end effector, position in m.
    psi : array_like, shape (...)
        Arm angle, rad.
    gc : array_like of int, shape (...)
        Global configuration 0..7.
    on_error : "raise" or "nan"
        What to do if the geometry has no solution.

    Returns
    -------
    ndarray, shape (..., 7, 7)
        dq: columns 0-2 by the velocity of the end effector's origin (rad/m), 3-5 by the angular velocity
        (rad/rad), both in the frame that poses are given in, and column 6 by psi, which is `Arm.self_motion`.
        The inverse of `jacobian` with `psi` as a seventh row. Infinite if a derivative does not exist: for
        joints 1-3 (5-7) if θ2 (θ6) is 0 or π; in columns 0-5 for all joints if the elbow is stretched or
        folded, and for all but joint 4 if psi jumps (the wrist over the base axis). For other arms
        that is where the matrix has no inverse, for example at a fold, and then for all but the free joint.

    Raises
    ------
    As `inverse`.

    Examples
    --------
    >>> import armangle as aa
    >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    >>> q = [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]
    >>> both = np.vstack([arm.jacobian(q), aa.gradients.psi(arm, q)])
    >>> slopes = aa.gradients.inverse(arm, *arm.forward(q))
    >>> bool(np.allclose(slopes @ both, np.eye(7), rtol=0, atol=1e-12))
    True
    """
    batch, (poses, angles, branches) = arm._postures(pose, psi, gc)
    out = np.empty((*batch, JOINTS, JOINTS))
    nan = chosen("on_error", on_error, ON_ERROR) == "nan"
    arm._handle.inverse_derivative_many(poses, angles, branches, out, nan, thread_count())
    return out


def psi(arm: Arm, q: ArrayLike) -> Floats:
    """Return the derivative of the arm angle with respect to the joints.

    Parameters
    ----------
    arm : Arm
    q : array_like, shape (..., 7)
        Joint values, rad.

    Returns
    -------
    ndarray, shape (..., 7)
        dψ/dq, rad/rad, for the arm's own reference plane; inf if ψ does not exist, or jumps: for the psi of
        the base axis if the wrist lies on it.

    Raises
    ------
    InputError
    """
    return arm._of_joints(arm._handle.psi_gradient_many, q, (JOINTS,))


def feasible(arm: Arm, pose: ArrayLike, gc: int) -> tuple[ArcSet, Floats]:
    """Return the feasible arcs of one pose, and the derivatives of their ends with respect to the pose.

    Parameters
    ----------
    arm : Arm
    pose : array_like, shape (4, 4)
        Tool frame, position in m.
    gc : int
        Global configuration 0..7.

    Returns
    -------
    ArcSet, ndarray of shape (k, 2, 6)
        The arcs of `feasible`; for the lower and upper end of each, dψ by the velocity of the end effector's
        origin (rad/m) and by its angular velocity (rad/rad). NaN if an end does not move smoothly: the full
        circle has no end, a jump no slope, an arc appears where a joint only touches its limit, and where a
        proof ends nothing is known.

    Raises
    ------
    InputError, UnsupportedError
        UnsupportedError for an arm with a scene.
    """
    frame = one_pose("pose", pose, arm._handle)
    branch = one_branch("gc", gc)
    _refuse_scene(arm, "feasible")
    arcs = arm.feasible(frame, branch)
    out = np.full((int(arcs.count), 2, 6), np.nan)
    arm._handle.end_slopes_one(frame, branch, arm.singularity_margin, out)
    return arcs, out


def limit_margin(arm: Arm, q: ArrayLike) -> Floats:
    """Return the derivative of `limit_margin` with respect to the joints.

    Parameters
    ----------
    arm : Arm
    q : array_like, shape (..., 7)
        Joint values, rad.

    Returns
    -------
    ndarray, shape (..., 7)
        rad/rad: +1 or -1 at the joint whose limit is nearest, the first of several; 0 elsewhere, and without
        limits.

    Raises
    ------
    InputError
    """
    joints = as_floats("q", q, (JOINTS,))
    out = np.empty(joints.shape)
    getattr(arm, "_rows", arm)._handle.limit_margin_gradient_many(joints, out)  # only limits are used
    return out


def freedom(arm: Arm, pose: ArrayLike) -> Floats:
    """Return the derivative of the total of `freedom` with respect to the pose.

    Parameters
    ----------
    arm : Arm
    pose : array_like, shape (..., 4, 4)
        Tool frame, position in m.

    Returns
    -------
    ndarray, shape (..., 6)
        By the velocity of the end effector's origin (rad/m) and by its angular velocity (rad/rad), in the
        frame that poses are given in: the slopes of all upper ends of intervals minus those of all lower
        ends, over all branches; obstacles are ignored. 0 for an unreachable pose, or with whole circles
        alone; NaN if an end does not move smoothly.

    Raises
    ------
    InputError
    """
    poses = as_poses("pose", pose, arm._handle)
    out = np.empty((*poses.shape[:-2], 6))
    arm._handle.freedom_gradient_many(poses, arm.singularity_margin, out, thread_count())
    return out


def margin(arm: Arm, pose: ArrayLike, *, gc: int | Iterable[int] | None = None) -> Floats:
    """Return the derivative of the margin of ``solve(pose, prefer="margin")`` with respect to the pose.

    At that solution psi cannot increase the distance of the joint nearest to a limit, or two joints are
    equally near and psi moves them in opposite directions, or a joint at the singularity margin stops psi.
    The gradient is theirs, with psi following. The margin has a kink if two branches or arm angles are
    equally good, or a third joint is equally near: there the gradient is that of one side, and a step may
    lead to the other.

    Parameters
    ----------
    arm : Arm
        Without a `scene`.
    pose : array_like, shape (..., 4, 4)
        Tool frame, position in m.
    gc : int or iterable of int, optional
        As in `solve`.

    Returns
    -------
    ndarray, shape (..., 6)
        By the velocity of the end effector's origin (rad/m) and by its angular velocity (rad/rad), in the
        frame that poses are given in. NaN if the pose is unreachable, or a deciding joint has no derivative
        (`inverse`), or a fold ends psi. NaN also if that solution has θ2 or θ6 at 0 or π, unless joint 4
        alone decides: two joints share a turn only there, so the margin jumps.

    Raises
    ------
    As `Arm.solve`, and UnsupportedError for an arm with a scene.

    Examples
    --------
    >>> import armangle as aa
    >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    >>> pose = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0]
    >>> slope, higher = aa.gradients.margin(arm, pose), pose.copy()
    >>> higher[2, 3] += 1e-6
    >>> before, after = (arm.solve(x, prefer="margin").margin for x in (pose, higher))
    >>> bool(abs(after - before - 1e-6 * slope[2]) < 1e-10)
    True
    """
    gradient_many = arm._handle.best_gradient_many
    _refuse_scene(arm, "margin")
    best = arm.solve(pose, prefer="margin", gc=gc)
    poses = as_poses("pose", pose, arm._handle)
    out = np.empty((*poses.shape[:-2], 6))
    given = np.asarray(best.q), np.asarray(best.psi), np.asarray(best.gc, dtype=np.int64)
    gradient_many(poses, arm.singularity_margin, *given, out, thread_count())
    return out


def solve(
    arm: Arm,
    pose: ArrayLike,
    seed: ArrayLike | None = None,
    *,
    weight: ArrayLike | None = None,
    prefer: Prefer = "seed",
    gc: int | Iterable[int] | None = None,
) -> Floats:
    """Return the derivative of the joints of ``arm.solve`` with respect to the pose and the seed.

    The derivative follows one solution. The solution jumps where another branch, arm angle or turn is equally
    good, and its slope changes where a joint reaches a limit: there the derivative is that of the solution
    that `solve` returns.

    Parameters
    ----------
    arm : Arm
        Without a `scene`.
    pose : array_like, shape (..., 4, 4)
        Tool frame, position in m.
    seed, weight, gc
        As in `Arm.solve`.
    prefer : "seed" or "margin"
        As in `Arm.solve`. The solution with the largest margin does not depend on the seed.

    Returns
    -------
    ndarray, shape (..., 7, 13)
        Row j is joint j + 1: columns 0-2 by the velocity of the end effector's origin (rad/m), 3-5 by the
        angular velocity (rad/rad), both in the frame that poses are given in, and 6-12 by the joints of the
        seed (rad/rad). NaN without a solution, at a shoulder, elbow or wrist singularity or a fold, and if
        nothing determines the arm angle, for example if joint 4 alone decides the largest margin.

    Raises
    ------
    As `Arm.solve`, and UnsupportedError for an arm with a scene.

    Examples
    --------
    >>> import armangle as aa
    >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    >>> seed = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    >>> pose, higher = arm.forward(seed + 0.1)[0], arm.forward(seed + 0.1)[0]
    >>> higher[2, 3] += 1e-6
    >>> slope = aa.gradients.solve(arm, pose, seed)[:, 2]
    >>> moved = arm.solve(higher, seed).q - arm.solve(pose, seed).q
    >>> bool(np.abs(moved - 1e-6 * slope).max() < 1e-10)
    True
    """
    derivative_many = arm._handle.solution_derivative_many
    if chosen("prefer", prefer, ("seed", "margin")) == "seed" and seed is None:
        prefer = "margin"
    _refuse_scene(arm, "solve")
    found = arm.solve(pose, seed, weight=weight, prefer=prefer, gc=gc)
    poses = as_poses("pose", pose, arm._handle)
    near = np.zeros(JOINTS) if seed is None else as_floats("seed", seed, (JOINTS,))
    metric = METRICS["l2"] if prefer == "seed" else _core.Metric.MARGIN
    options = _core.SolveOptions(metric, weights_of(weight), branch_bits(gc), arm.singularity_margin, 0.0)
    out = np.empty((*np.shape(found.psi), JOINTS, 6 + JOINTS))
    given = np.asarray(found.q), np.asarray(found.psi), np.asarray(found.gc, dtype=np.int64)
    derivative_many(poses, near, options, *given, out, thread_count())
    return out


def joint_function(arm: Arm, pose: ArrayLike, gc: int, joint: int) -> JointFunction:
    """Return one joint as a function of the arm angle, at a fixed pose and global configuration.

    Parameters
    ----------
    arm : Arm
    pose : array_like, shape (4, 4)
        Tool frame, position in m.
    gc : int
        Global configuration 0..7.
    joint : int
        Joint 1..7.

    Returns
    -------
    JointFunction

    Raises
    ------
    InputError, UnreachableError

    Source: Faria et al. (2018), Eqs. (26)-(31), (33), (34).
    """
    frame = one_pose("pose", pose, arm._handle)
    index = one_branch("gc", gc)
    number = as_whole("joint", joint, 1, JOINTS)
    return JointFunction(arm._handle.joint_function(frame, index, number - 1), (arm, frame, index), number)


def _refuse_scene(arm: Arm, name: str) -> None:
    """Raise UnsupportedError if the arm has a scene: ends at obstacles have no derivatives."""
    if arm.scene is not None:
        raise UnsupportedError(
            f"gradients.{name} is not made for an arm with a scene: use arm.with_(scene=None)"
        )
