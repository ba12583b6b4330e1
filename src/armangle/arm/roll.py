"""Free roll of the tool: the value of joint 7, and the supported tools."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from .. import _core
from .._arrays import JOINTS, Floats, about_z, as_poses
from ..errors import InputError
from ..scenes.shapes import RODS
from .any_arm import AnyArm
from .solution import Solution

Roll = Literal["pose", "free"]

ROLLS = ("pose", "free")
LADDER = 72
"""Number of turns about the tool's z axis that are tried if it is not axis 7."""
_FINE, _FINER = 10, 3
"""Number of finer turns between two of them, around the best; and the number of refinements."""

_LAST = JOINTS - 1
_ALONG = 1e-9  # m, rad: largest deviation of the tool's z axis from axis 7


def is_along_axis_7(arm: AnyArm) -> bool:
    """Return whether the tool's z axis is the axis of joint 7, so that a roll changes joint 7 alone.

    False for an arm with its own chain, whose arm angle belongs to the fitted arm.
    """
    return arm.geometry.chain is None and bool(np.abs(arm.tool[:2, 2:]).max() <= _ALONG)


def check_free_roll(arm: AnyArm, scene: object) -> None:
    """Raise if a roll about axis 7 affects collisions, because a configuration does not determine it."""
    turning = _turning(arm) if scene is not None and is_along_axis_7(arm) else None
    if turning is not None:
        raise InputError(
            f"roll is 'free', and {turning}, which is not round about that axis, would turn with it: "
            "not with obstacles"
        )


def _turning(arm: AnyArm) -> str | None:
    """Return the name of a shape of link 7 or the gripper that a roll would move; None if all are round."""
    body = () if arm.body is None else arm.body._shapes(arm.geometry)
    shapes = [(shape.name or "link_7", shape) for frame, shape in body if frame == JOINTS]
    shapes += [(shape.name or "hand", shape) for shape in arm.hand]
    for name, shape in shapes:
        ends = np.array(shape._row()[2:8]).reshape(2, 3)
        if not isinstance(shape, RODS) or np.abs(ends[:, :2]).max() > _ALONG:
            return name
    return None


def last_margin(arm: AnyArm, q: Floats) -> Any:
    """Return the distance of joint 7 to its nearest limit, rad; negative outside."""
    return np.minimum(q[..., _LAST] - arm.lower[_LAST], arm.upper[_LAST] - q[..., _LAST])


def solve_free(
    arm: AnyArm, pose: Any, near: Any, weights: Floats, by_margin: bool, metric: str, ask: Any
) -> Solution:
    """Return the solution of each pose at its best roll; `ask(arm, pose, near, weights)` solves at one.

    The best has the largest limit margin if `by_margin`, otherwise it is nearest to `near` by the metric.
    If the tool's z axis is axis 7, no roll is tried: joints 1 to 6 do not depend on it, or, if joint 7 is the
    free joint, take the same values at another of its values. Joint 7 takes the seed's value, moved into its
    limits, or their middle if `by_margin`.
    """
    if not is_along_axis_7(arm):
        return _on_ladder(arm, pose, near, weights, by_margin, ask)
    kept = weights.copy()
    kept[_LAST] = 0.0
    if not kept.any():
        raise InputError(
            f"weight is {weights.tolist()}, and with a free roll joint 7 stands by itself: "
            "wanted one of the others positive"
        )
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[_LAST], upper[_LAST] = -np.inf, np.inf
    found: Solution = ask(arm.with_(lower=lower, upper=upper), pose, near, kept)
    q = np.array(found.q)
    least, most = arm.lower[_LAST], arm.upper[_LAST]
    seed = np.asarray(0.0 if near is None else np.asarray(near, dtype=np.float64)[..., _LAST])
    middle = 0.5 * (least + most) if np.isfinite(most - least) else np.clip(seed, least, most)
    last = np.broadcast_to(middle if by_margin else np.clip(seed, least, most), q.shape[:-1])
    q[..., _LAST] = np.where(np.isfinite(q[..., 0]), last, np.nan)
    margin = np.minimum(found.margin, last_margin(arm, q))
    extra = np.sqrt(weights[_LAST]) * np.abs(last - seed)
    apart = np.hypot(found.distance, extra) if metric == "l2" else np.maximum(found.distance, extra)
    pose, psi, solved = np.array(found.pose), np.array(found.psi), np.isfinite(q[..., 0])
    pose[solved], psi[solved], _ = arm.forward(q[solved], on_error="nan")
    if q.ndim > 1:
        return found._replace(q=q, psi=psi, margin=margin, distance=apart, pose=pose)
    return found._replace(q=q, psi=float(psi), margin=float(margin), distance=float(apart), pose=pose)


def _on_ladder(arm: AnyArm, pose: Any, near: Any, weights: Floats, by_margin: bool, ask: Any) -> Solution:
    """Return the best solution over `LADDER` equal rolls about the tool's z axis and finer ones near the
    best; ten times as many if none has a solution.
    """
    poses = as_poses("pose", pose, arm._handle)
    _core.check_transforms(poses, "pose")  # before a turn becomes another axis
    seeds = None if near is None else np.asarray(near, dtype=np.float64)
    if seeds is not None and seeds.shape[-1:] == (JOINTS,):
        batch = np.broadcast_shapes(poses.shape[:-2], seeds.shape[:-1])
        poses, seeds = np.broadcast_to(poses, (*batch, 4, 4)), np.broadcast_to(seeds, (*batch, JOINTS))

    def best_of(which: Any, angles: Floats) -> tuple[list[Any], Floats, Floats]:
        """Return for some poses the best of the rolls (..., k), rad: its solution, rating and angle."""
        near_them = None if seeds is None else seeds[which][..., None, :]
        found: Solution = ask(arm, poses[which][..., None, :, :] @ about_z(angles), near_them, weights)
        worth = np.where(found.ok, found.margin if by_margin else -np.asarray(found.distance), -np.inf)
        best = worth.argmax(axis=-1)

        def taken(column: Any) -> Any:
            """Return the column's entry at the best roll of each pose."""
            column = np.asarray(column)
            index = best.reshape(*best.shape, *[1] * (column.ndim - best.ndim))
            return np.take_along_axis(column, index, axis=best.ndim).squeeze(best.ndim)

        return [np.array(taken(column)) for column in found], taken(worth), taken(angles)

    def ladder(rungs: int, like: Floats) -> Floats:
        """Return equally spaced rolls over 2π, rad, for each pose."""
        return np.broadcast_to(np.arange(rungs) * (2 * np.pi / rungs), (*like.shape[:-2], rungs))

    every, worth, at = best_of(..., ladder(LADDER, poses))
    worth, at = np.array(worth), np.array(at)

    def improve(which: Any, angles: Floats) -> None:
        """Try more rolls (rad) for some poses and keep them where they are better."""
        columns, better, there = best_of(which, angles)
        gained = better > worth[which]
        for column, new in zip((*every, worth, at), (*columns, better, there), strict=True):
            kept = column[which]
            kept[gained] = new[gained]
            column[which] = kept

    none = ~np.isfinite(worth)
    if none.any():
        improve(none, ladder(_FINE * LADDER, poses[none]))
    some = np.isfinite(worth)
    width = 2 * np.pi / LADDER
    for _ in range(_FINER if some.any() else 0):
        improve(some, at[some][..., None] + np.linspace(-width, width, 2 * _FINE + 1))
        width /= _FINE
    found = Solution(*every)
    return found if worth.ndim else found.row(())
