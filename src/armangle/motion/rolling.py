"""Free roll about a tool axis other than axis 7: a ladder of rolls, each with its own path.

Joints 1 to 6 depend on such a roll, so it must be chosen. Every rung is a whole path, followed or planned
with exact arcs like any other. Its frames turn about their own z axes by ``roll + rate s``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import product
from typing import Protocol, cast

import numpy as np

from .._arrays import Floats, chosen
from .._progress import Progress, part
from ..arm.arm import Arm
from ..arm.diagnosis import Branch
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

_ORDER = ((6, np.inf), (3, 3), (1, 1), (1, np.inf))
"""The order of the rungs: each pair is a stride and how far from the best so far rungs are rated in it."""

_NOTHING = 1e-24
"""Cost of a plan that costs only rounding, as with a constant end effector: none can cost less."""

Rung = tuple[float, float]
Rating = tuple[bool, float]
"""A sort key of searches, lower is better: whether none leads along a path; its cost, or how far it comes."""


class Request(Protocol):
    """A request for a plan, with the work that all plans made for it may take."""

    @property
    def spent(self) -> bool:
        """Whether searches have taken their work."""

    def rated(self, path: Path, tell: Progress) -> Rating | None:
        """Return the rating of a path; None if the work of ratings is taken."""

    def planned(self, path: Path, tell: Progress) -> JointPath:
        """Return the plan of a path."""


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
    arm: Arm, path: Path, start: Floats | None, goal: Floats | None, request: Request, tell: Progress
) -> JointPath:
    """Return the best plan of the tried rolls: certified, then of the lowest cost, or else the one that comes
    furthest. If no search leads along a constant roll, growing ones are tried (without start and goal).
    """
    constant = ladder(arm, path, start, goal)
    held, furthest = _held(arm, path, constant)
    rungs = sorted(held, key=lambda rung: rung[::-1]) or [furthest]
    rated: dict[Rung, Rating] = {}
    _rate(path, _around_best(rungs, rated), len(rungs), rated, request, part(tell, 0, 4))
    count = len(constant) - len(rungs) + len(rated)
    if start is None and goal is None and all(rating[0] for rating in rated.values()):
        growing = [(float(roll), float(rate)) for rate, roll in product(_GROWING, _STEP * np.arange(LADDER))]
        some = _held(arm, path, growing)[0][:LADDER]
        _rate(path, some, len(some), rated, request, part(tell, 1, 4))
    tried = sorted(rated.items(), key=lambda each: each[1])
    every: list[JointPath] = []
    for k, (rung, rating) in enumerate(tried):
        least = (False, False, max(rating[1], _NOTHING))
        if every and (request.spent or min(map(_worth, every)) <= least):
            break
        every.append(request.planned(rolled(path, *rung), part(part(tell, 1, 2), k, len(tried))))
    best = min(every, key=_worth)
    if best.ok or best.diagnosis is None:
        return best
    return replace(best, diagnosis=replace(best.diagnosis, note=_NOTE.format(count)))


def _around_best(rungs: list[Rung], rated: dict[Rung, Rating]) -> Iterator[Rung]:
    """Yield each rung once, in `_ORDER`; `rated` are the ratings of those so far."""
    for stride, reach in _ORDER:
        best = rungs.index(min(rated, key=lambda rung: rated[rung], default=rungs[0]))
        near = np.arange(0, len(rungs), stride)
        near = near[np.argsort(np.abs(near - best), kind="stable")]
        yield from (rungs[k] for k in near.tolist() if abs(k - best) <= reach and rungs[k] not in rated)


def _rate(
    path: Path, rungs: Iterable[Rung], total: int, rated: dict[Rung, Rating], request: Request, tell: Progress
) -> None:
    """Rate `total` rungs, up to one that costs nothing, or as far as the work of the request leads."""
    for k, rung in enumerate(rungs):
        rating = request.rated(rolled(path, *rung), part(tell, k, total))
        if rating is None:
            return
        rated[rung] = rating
        if rating <= (False, _NOTHING):
            return


def rate(branches: tuple[Branch, ...]) -> Rating:
    """Return the rating of a search."""
    costs = [branch.cost for branch in branches if branch.ok]
    come = max((max(branch.reached, branch.s_from) for branch in branches), default=0.0)
    return not costs, min(costs) if costs else -come


def _worth(result: JointPath) -> tuple[bool, bool, float]:
    """Return a sort key, lower is better: solved, then certified, then by cost, or by how far it comes."""
    branches = result.diagnosis.branches if result.diagnosis is not None else ()
    return not result.ok, not result.certified, rate(branches)[1]


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
