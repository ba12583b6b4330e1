"""Arguments of `solve`, `solutions` and `best`: checked and passed to the core."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import (
    CONFIGURATIONS,
    JOINTS,
    Floats,
    as_floats,
    as_gc,
    as_number,
    as_poses,
    broadcast,
    chosen,
)
from .._progress import Progress, as_progress, progressing
from .._threads import thread_count
from ..errors import InputError
from ..status import is_solved
from .allowed import Allowed, allowed_arcs
from .any_arm import AnyArm
from .solution import Solution, Solutions

MetricName = Literal["l2", "max"]
Prefer = Literal["seed", "margin", "clearance"]
Fallback = Literal["nearest_pose"] | None

METRICS: dict[str, Any] = {"l2": _core.Metric.L2, "max": _core.Metric.MAX}
PREFER = ("seed", "margin", "clearance")
_FALLBACK = ("nearest_pose",)
_LONGEST = 1e3  # m, upper bound for the length of a radian


class Question:
    """A batch of poses and the conditions for their solutions."""

    def __init__(
        self, arm: AnyArm, pose: ArrayLike, seed: ArrayLike | None, metric: str, weight: ArrayLike | None,
        prefer: str, gc: int | Iterable[int] | None, allowed: Allowed | None, length: float = 0.0,
        progress: Progress | bool | None = None,
    ) -> None:  # fmt: skip
        """Check all conditions and broadcast poses and seeds to one batch."""
        named = [("pose", as_poses("pose", pose, arm._handle), 2)]
        if seed is not None:
            named.append(("seed", as_floats("seed", seed, (JOINTS,)), 1))
        self.batch, arrays = broadcast(named)
        self.poses: Floats = np.ascontiguousarray(arrays[0])
        kind = METRICS[chosen("metric", metric, METRICS)]
        if chosen("prefer", prefer, PREFER) == "margin" or seed is None:
            kind = _core.Metric.MARGIN
        self.near = np.ascontiguousarray(arrays[1]).reshape(-1, JOINTS) if seed is not None else None
        self.options = _core.SolveOptions(
            kind, weights_of(weight), branch_bits(gc), arm.singularity_margin, length
        )
        self.arm, self.handle = arm, arm._handle
        self.threads = thread_count()
        self.progress = as_progress(progress)
        self.scene = None if arm._ready is None else arm._ready.handle
        self.allowed: tuple[Any, Any] = (None, None)
        if allowed is not None:
            arcs = allowed_arcs(allowed, arrays[0])
            if arcs.shape not in ((), self.batch):
                raise InputError(
                    f"allowed has shape {arcs.shape}, wanted () or that of the poses, {self.batch}"
                )
            self.allowed = (arcs._count, arcs._psi)

    def solve(self) -> Solution:
        """Return for each pose the solution that the conditions rate best."""
        q = np.empty((*self.batch, JOINTS))
        psi, distance, margin, gap = (np.empty(self.batch) for _ in range(4))
        gc, status = np.empty(self.batch, np.int64), np.empty(self.batch, np.int8)
        with progressing(self.progress):
            self.handle.solve_many(
                self.poses, self.near, self.options, *self.allowed, q, psi, gc, distance, status, margin, gap,
                self.threads, self.scene,
            )  # fmt: skip
        unsolved = ~is_solved(status)
        pose, beside = self.poses.copy(), unsolved & np.isfinite(gap)
        pose[unsolved] = np.nan
        if beside.any():
            pose[beside] = self.arm.forward(q[beside], on_error="nan")[0]
        every = Solution(q, psi, gc, distance, status, margin, gap, pose)
        return every if self.batch else every.row(())

    def solutions(self) -> Solutions:
        """Return for each pose the best solution of each branch and arc."""
        with progressing(self.progress):
            columns = self.handle.solutions_many(
                self.poses, self.near, self.options, *self.allowed, self.threads, self.scene
            )
        return Solutions(self.batch, columns, self.poses)


def relaxing_length(fallback: Fallback, length: float, *narrowed: object) -> float:
    """Return `length` (m), which counts like 1 rad; 0 without fallback, which excludes all `narrowed`."""
    metres = as_number("length", length, 0.0, _LONGEST, low_open=True)
    if fallback is None:
        return 0.0
    chosen("fallback", fallback, _FALLBACK)
    if any(one is not None for one in narrowed):
        raise InputError(
            "fallback is 'nearest_pose', which takes all branches and arm angles: not with gc, allowed or "
            "obstacles"
        )
    return metres


def widest_solution(arm: Any, pose: ArrayLike, seed: ArrayLike | None, gc: Any) -> Solution:
    """Return the solution of each pose with the largest distance to the obstacles of the arm's scene.

    If that search fails although a solution exists, as at an isolated arm angle, it is that of `Arm.solve`.
    """
    if arm.scene is None:
        raise InputError("prefer is 'clearance', which needs obstacles: arm.with_(scene=...)")
    bits = branch_bits(gc)
    branches = np.array([k for k in range(CONFIGURATIONS) if bits >> k & 1])
    other = arm.solve(pose, seed, gc=gc)
    poses = as_poses("pose", pose, arm._handle)
    poses = np.broadcast_to(poses, (*np.shape(other.status), 4, 4))
    found = arm._widest(poses[..., None, :, :], branches, arm.scene)
    room, psi = np.asarray(found.nearest.distance), np.asarray(found.psi)
    room = np.where((np.asarray(found.arcs.count) > 0) & np.isfinite(psi), room, -np.inf)
    best = room.argmax(axis=-1)[..., None]

    def taken(column: Any) -> Any:
        """Return the column's entry at the best branch of each pose."""
        return np.take_along_axis(column, best, axis=-1)[..., 0]

    ok, branch = np.asarray(taken(room) > -np.inf), branches[best[..., 0]]
    q = arm.inverse(poses, np.where(ok, taken(psi), 0.0), branch, seed=seed, on_error="nan")
    ok = np.asarray(ok & np.isfinite(q[..., 0]))
    apart = np.full(ok.shape, np.nan) if seed is None else np.linalg.norm(q - np.asarray(seed), axis=-1)
    margin = arm.limit_margin(np.where(ok[..., None], q, 0.0))
    mine = q, taken(psi), branch, apart, np.int8(0), margin, 0.0, poses
    columns = []
    for column, its in zip(mine, other, strict=True):
        its = np.asarray(its)
        columns.append(np.where(ok[(..., *[None] * (its.ndim - ok.ndim))], column, its))
    every = Solution(*columns)
    return every._replace(status=columns[4].astype(np.int8)) if ok.ndim else every.row(())


def weights_of(weight: ArrayLike | None) -> Floats:
    """Return seven weights, from one for all joints or one each."""
    if weight is None:
        return np.ones(JOINTS)
    given = as_floats("weight", weight)
    if given.shape not in ((), (JOINTS,)):
        raise InputError(f"weight has shape {given.shape}, wanted ({JOINTS},) or one number")
    weights = np.ascontiguousarray(np.broadcast_to(given, (JOINTS,)))
    if not np.isfinite(weights).all():
        raise InputError(f"weight is {weights.tolist()}, wanted finite numbers")
    if (weights < 0).any() or not weights.any():
        raise InputError(f"weight is {weights.tolist()}, wanted numbers >= 0, at least one of them positive")
    return weights


def branch_bits(gc: int | Iterable[int] | None) -> int:
    """Return permitted branches as a number whose bit gc is set for branch gc; None permits all."""
    if gc is None:
        return (1 << CONFIGURATIONS) - 1
    given = [*gc] if isinstance(gc, Iterable) else [gc]
    if not given:
        raise InputError("gc holds nothing: wanted integers from 0 to 7, or None for all of them")
    wanted = as_gc(given)
    if wanted.ndim != 1 or not wanted.size or ((wanted < 0) | (wanted >= CONFIGURATIONS)).any():
        raise InputError(f"gc is {gc!r}, wanted an integer from 0 to 7, or several of them")
    return int(np.bitwise_or.reduce(1 << wanted))
