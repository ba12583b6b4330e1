"""Free roll about a tool axis other than axis 7: a ladder of rolls, each with its own path.

Joints 1 to 6 depend on such a roll, so it must be chosen. Every rung is a whole path, followed or planned
with exact arcs like any other. Its frames turn about their own z axes by ``roll + rate s``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import cast

import numpy as np

from .._arrays import Floats, chosen
from .._progress import Progress, part
from ..arm.arm import Arm
from ..arm.roll import LADDER, ROLLS, Roll, is_along_axis_7
from ..status import Status
from .joint_path import JointPath
from .paths import Path, rolled

_STEP = 2 * np.pi / LADDER
_TRIED = np.linspace(0.0, 1.0, 33)
"""The s at which a rung is tested before it is planned."""
_GROWING = np.radians([15.0, -15.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0, 180.0, -180.0])
"""Rates of rungs if no constant roll is feasible on the whole path, rad per unit of s."""

_NOTE = "Of {} rolls about the tool's z axis that were tried this is the one that comes furthest."

_NOTHING = (False, False, 1e-24)
"""Cost of a plan that costs only rounding, as with a constant end effector: none can cost less."""

Rung = tuple[float, float]


def is_laddered(arm: Arm, roll: Roll) -> bool:
    """Return whether the roll is free and not about axis 7, so that several rolls are tried."""
    return chosen("roll", roll, ROLLS) == "free" and not is_along_axis_7(arm)


def ladder(arm: Arm, path: Path, start: Floats | None, goal: Floats | None) -> list[Rung]:
    """Return pairs (roll at the start, roll over the path), rad, to try; they fit start and goal if given.

    Rates are about that of the given path, and about the one that cancels the path's own roll.
    """
    first, last = path.pose(np.array([0.0, 1.0]))
    undone = -_rolls(path)
    if start is None and goal is None:
        rates = [0.0] if abs(undone) < _STEP else [0.0, undone]
        return [(float(roll), rate) for rate, roll in product(rates, _STEP * np.arange(LADDER))]
    about = np.round(undone / _STEP) + np.arange(-(LADDER // 2), LADDER // 2 + 1)
    every = np.append(_STEP * about, [0.0, undone])
    begins = None if start is None else _roll(first, arm.forward(start, on_error="nan")[0])
    if goal is None and begins is not None:
        return [(begins, float(rate)) for rate in _by_size(every)]
    ends = _roll(last, arm.forward(cast(Floats, goal), on_error="nan")[0])
    if begins is None:
        return [(ends - float(rate), float(rate)) for rate in _by_size(every)]
    turns = ends - begins + 2 * np.pi * np.arange(-1, 2)
    whole = 2 * np.pi * np.round((undone - ends + begins) / (2 * np.pi))
    return [(begins, float(rate)) for rate in _by_size(np.append(turns, ends - begins + whole))]


def _by_size(rates: Floats) -> Floats:
    """Return each rate once, the slowest first."""
    each = np.unique(rates)
    return each[np.argsort(np.abs(each), kind="stable")]


def _rolls(path: Path) -> float:
    """Return how far the path rotates the end effector about its own z axis, rad."""
    along = path.derivative(_TRIED)[:, 3:]
    rates = (along * path.pose(_TRIED)[:, :3, 2]).sum(axis=1)
    return float(0.5 * (rates[:-1] + rates[1:]).mean())


def _roll(frame: Floats, held: Floats) -> float:
    """Return the rotation (rad) about the z axis of a frame that brings it nearest to another frame."""
    apart = frame[:3, :3].T @ held[:3, :3]
    return float(np.arctan2(apart[1, 0] - apart[0, 1], apart[0, 0] + apart[1, 1]))


def best_planned(
    arm: Arm, path: Path, start: Floats | None, goal: Floats | None,
    planned: Callable[[Path, Progress], JointPath], tell: Progress,
) -> JointPath:  # fmt: skip
    """Return the best plan of the tried rolls: certified, then of the lowest cost. If none is feasible, the
    first that is with a growing roll (without start and goal), or else the one that comes furthest.
    """
    rungs = ladder(arm, path, start, goal)
    held, furthest = _held(arm, path, rungs)
    every: list[JointPath] = []
    tried = held or [furthest]
    for k, rung in enumerate(tried):
        every.append(planned(rolled(path, *rung), part(tell, k, len(tried))))
        if _worth(every[-1]) <= _NOTHING:
            break
    if start is None and goal is None and not any(result.ok for result in every):
        growing = [(float(roll), float(rate)) for rate, roll in product(_GROWING, _STEP * np.arange(LADDER))]
        for rung in _held(arm, path, growing)[0][:LADDER]:
            result = planned(rolled(path, *rung), tell)
            if result.ok:
                return result
    best = min(every, key=_worth)
    if best.ok or best.diagnosis is None:
        return best
    return replace(best, diagnosis=replace(best.diagnosis, note=_NOTE.format(len(rungs))))


def _worth(result: JointPath) -> tuple[bool, bool, float]:
    """Return a sort key, lower is better: solved, then certified, then by cost, or by how far it comes."""
    branches = result.diagnosis.branches if result.diagnosis is not None else ()
    costs = [branch.cost for branch in branches if branch.ok]
    come = max((max(branch.reached, branch.s_from) for branch in branches), default=0.0)
    return not result.ok, not result.certified, min(costs) if costs else -come


def _held(arm: Arm, path: Path, rungs: list[Rung]) -> tuple[list[Rung], Rung]:
    """Return the rolls with which the nominal arm reaches all tested poses, without obstacles: those in one
    branch and with the longest arcs first; and the roll of all `rungs` that comes furthest.
    """
    frames = np.stack([rolled(path, *rung).pose(_TRIED) for rung in rungs])
    free = arm._nominal.freedom(frames)
    least, branches = np.min(free.total, axis=1), np.asarray(free.gc)
    whole = np.bitwise_and.reduce(branches, axis=1) != 0
    order = np.lexsort((-least, ~whole))
    come = np.logical_and.accumulate(branches != 0, axis=1).sum(axis=1)
    return [rungs[k] for k in order.tolist() if branches[k].all()], rungs[int(come.argmax())]


def best_followed(
    arm: Arm, path: Path, start: Floats, followed: Callable[[Rung, Progress], JointPath], tell: Progress
) -> JointPath:
    """Return the path with the most solved rows over all tried rolls; among equals the least joint motion."""
    rungs = ladder(arm, path, start, None)
    results = [followed(rung, part(tell, k, len(rungs))) for k, rung in enumerate(rungs)]

    def worth(result: JointPath) -> tuple[int, float]:
        """Return a sort key, lower is better: solved rows, then the sum of squared joint steps."""
        done = int((result.status == Status.OK).sum())
        moved = np.diff(np.vstack([start, result.q[np.isfinite(result.q[:, 0])]]), axis=0)
        return -done, float((moved**2).sum())

    return min(results, key=worth)
