"""What `solve`, `solutions` and `best` are asked: arguments checked and handed to the core."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, Protocol

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
    as_threads,
    broadcast,
    chosen,
)
from .._progress import Progress, as_progress, progressing
from ..errors import ConfigurationError, InputError, NotFiniteError, ShapeError
from ..scenes.ready import Ready
from ..scenes.scene import Scene
from ..status import SOLVED
from .allowed import Allowed, allowed_arcs
from .solution import Solution, Solutions

MetricName = Literal["l2", "max"]
Prefer = Literal["near", "margin"]
Beyond = Literal["refuse", "nearest"]

METRICS: dict[str, Any] = {"l2": _core.Metric.L2, "max": _core.Metric.MAX}
PREFER = ("near", "margin")
_BEYOND = ("refuse", "nearest")
_LONGEST = 1e3  # m, of what a radian counts as


class Answering(Protocol):
    """What is asked of an arm."""

    lower: Floats
    upper: Floats
    _handle: _core.Arm

    def forward(self, q: Floats, *, undefined: Any) -> tuple[Floats, Any, Any]: ...
    def _scene(self, scene: Scene | None) -> Ready | None: ...


class Question:
    """A batch of poses and what is wanted of their postures."""

    def __init__(
        self, arm: Answering, pose: ArrayLike, near: ArrayLike | None, metric: str, weight: ArrayLike | None,
        prefer: str, gc: int | Iterable[int] | None, allowed: Allowed | None, scene: Scene | None,
        singularity_margin: float, threads: int, length: float = 0.0, progress: Progress | bool | None = None,
    ) -> None:  # fmt: skip
        named = [("pose", as_poses("pose", pose, arm._handle), 2)]
        if near is not None:
            seed = as_floats("near", near, (JOINTS,))
            named.append(("near", seed, 1))
        self.batch, arrays = broadcast(named)
        self.poses: Floats = np.ascontiguousarray(arrays[0])
        kind = METRICS[chosen("metric", metric, METRICS)]
        margin = as_number("singularity_margin", singularity_margin, 0.0, _core.MOST_MARGIN)
        if chosen("prefer", prefer, PREFER) == "margin" or near is None:
            kind = _core.Metric.MARGIN
        self.near = np.ascontiguousarray(arrays[1]).reshape(-1, JOINTS) if near is not None else None
        self.options = _core.SolveOptions(kind, weights_of(weight), branch_bits(gc), margin, length)
        self.arm, self.handle = arm, arm._handle
        self.threads = as_threads(threads)
        self.progress = as_progress(progress)
        ready = arm._scene(scene)
        self.scene = None if ready is None else ready.handle
        self.allowed: tuple[Any, Any] = (None, None)
        if allowed is not None:
            arcs = allowed_arcs(allowed, arrays[0])
            if arcs.shape not in ((), self.batch):
                raise ShapeError(
                    f"allowed has shape {arcs.shape}, wanted () or that of the poses, {self.batch}"
                )
            self.allowed = (arcs._count, arcs._psi)

    def solve(self) -> Solution:
        """Return the nearest posture of each pose."""
        q = np.empty((*self.batch, JOINTS))
        psi, distance, margin, gap = (np.empty(self.batch) for _ in range(4))
        gc, status = np.empty(self.batch, np.int64), np.empty(self.batch, np.int8)
        with progressing(self.progress):
            self.handle.solve_many(
                self.poses, self.near, self.options, *self.allowed, q, psi, gc, distance, status, margin, gap,
                self.threads, self.scene,
            )  # fmt: skip
        unsolved = ~np.isin(status, SOLVED)
        pose, beside = self.poses.copy(), unsolved & np.isfinite(gap)
        pose[unsolved] = np.nan
        if beside.any():
            pose[beside] = self.arm.forward(q[beside], undefined="nan")[0]
        every = Solution(q, psi, gc, distance, status, margin, gap, pose)
        return every if self.batch else every.row(())

    def solutions(self) -> Solutions:
        """Return the nearest posture of each branch and arc of each pose."""
        with progressing(self.progress):
            columns = self.handle.solutions_many(
                self.poses, self.near, self.options, *self.allowed, self.threads, self.scene
            )
        return Solutions(self.batch, columns, self.poses)


def relaxing_length(outside: Beyond, length: float, *narrowed: object) -> float:
    """Return how many metres a radian counts as where a pose has no posture; 0 where none is sought."""
    metres = as_number("length", length, 0.0, _LONGEST, low_open=True)
    if chosen("outside", outside, _BEYOND) == "refuse":
        return 0.0
    if any(one is not None for one in narrowed):
        raise InputError(
            "outside is 'nearest', which takes all branches and arm angles: not with gc, allowed or scene"
        )
    return metres


def weights_of(weight: ArrayLike | None) -> Floats:
    """Return seven weights, one for all joints or one each."""
    if weight is None:
        return np.ones(JOINTS)
    given = as_floats("weight", weight)
    if given.shape not in ((), (JOINTS,)):
        raise ShapeError(f"weight has shape {given.shape}, wanted ({JOINTS},) or one number")
    weights = np.ascontiguousarray(np.broadcast_to(given, (JOINTS,)))
    if not np.isfinite(weights).all():
        raise NotFiniteError(f"weight is {weights.tolist()}, wanted finite numbers")
    if (weights < 0).any() or not weights.any():
        raise InputError(f"weight is {weights.tolist()}, wanted numbers >= 0, at least one of them positive")
    return weights


def branch_bits(gc: int | Iterable[int] | None) -> int:
    """Return a bit for each global configuration that may be used."""
    if gc is None:
        return (1 << CONFIGURATIONS) - 1
    given = [*gc] if isinstance(gc, Iterable) else [gc]
    if not given:
        raise ConfigurationError("gc holds nothing: wanted integers from 0 to 7, or None for all of them")
    wanted = as_gc(given)
    if wanted.ndim != 1 or not wanted.size or ((wanted < 0) | (wanted >= CONFIGURATIONS)).any():
        raise ConfigurationError(f"gc is {gc!r}, wanted an integer from 0 to 7, or several of them")
    return int(np.bitwise_or.reduce(1 << wanted))
