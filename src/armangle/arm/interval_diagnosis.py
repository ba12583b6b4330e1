"""Why no branch of an arm holds a pose, from its proven intervals: for arms that are not exactly S-R-S."""

from __future__ import annotations

from typing import Literal

import numpy as np

from .._arrays import CONFIGURATIONS, JOINTS, Floats
from .._core import Wanted
from ..status import STATUSES, Status
from .any_arm import AnyArm
from .arcs import ArcSet
from .diagnosis import Branch, Opening, Verdict

_SIDES: tuple[tuple[Literal["lower", "upper"], float], ...] = (("lower", -np.inf), ("upper", np.inf))


def branches_by_intervals(arm: AnyArm, pose: Floats) -> tuple[Branch, ...]:
    """Return for each branch of an arm without obstacles whether its limits permit a pose; if not, why.

    If a branch is UNREACHABLE, its excess is that of the nominal arm.
    """
    arcs = arm.feasible(pose)
    return tuple(_branch_of(arm, pose, gc, arcs) for gc in range(CONFIGURATIONS))


def _branch_of(arm: AnyArm, pose: Floats, gc: int, arcs: ArcSet) -> Branch:
    """Return whether a branch has a solution within the limits, and if not, why."""
    status = STATUSES[int(np.asarray(arcs.status)[gc])]
    if np.asarray(arcs.count)[gc] > 0:
        best = arm.solve(pose, prefer="margin", gc=gc)
        return Branch(gc, Verdict.OK, margin=float(best.margin))
    if status == Status.NEAR_SINGULAR or np.asarray(arcs.unproven)[gc] > 0:
        found = arm.solve(pose, np.clip(0.0, arm.lower, arm.upper), gc=gc)
        if found.ok:
            return Branch(gc, Verdict.OK)
        if status == Status.NEAR_SINGULAR:
            return Branch(gc, Verdict.UNRESOLVED, status)
    if status == Status.UNREACHABLE:
        gap = arm._nominal._handle.nearest_pose(pose, np.empty((4, 4)))
        return Branch(gc, Verdict.UNREACHABLE, status, excess=float(gap))
    if status != Status.LIMITS:
        return Branch(gc, Verdict.IMPOSSIBLE, status)
    blocking, openings = _blocking(arm, pose, gc), _openings(arm, pose, gc)
    return Branch(gc, Verdict.IMPOSSIBLE, status, blocking=blocking, openings=openings)


def _blocking(arm: AnyArm, pose: Floats, gc: int) -> tuple[int, ...]:
    """Return joints whose limits together leave nothing, each of them needed; () if limits alone do not."""
    left = arm.feasible(pose, gc, per_joint=True) | arm._left_out(pose, gc, Wanted.JOINTS)
    counts, ends = np.asarray(left.count), left.intervals
    sets = [ArcSet(ends[joint][: counts[joint]]) for joint in range(JOINTS)]

    def is_shut(joints: list[int]) -> bool:
        """Return whether the limits of these joints (from 0) together permit no arm angle."""
        open_ = ArcSet([(-np.pi, np.pi)])
        for joint in joints:
            open_ = open_ & sets[joint]
        return bool(open_.is_empty)

    needed = list(range(JOINTS))
    if not is_shut(needed):  # the rest is excluded by cells of all joints, or meets at single angles alone
        return ()
    for joint in range(JOINTS):
        fewer = [one for one in needed if one != joint]
        if is_shut(fewer):
            needed = fewer
    return tuple(joint + 1 for joint in needed)


def _openings(arm: AnyArm, pose: Floats, gc: int) -> tuple[Opening, ...]:
    """Return single limits that would leave a solution if they were moved out, the least first."""
    found = []
    for joint in range(JOINTS):
        for side, far in _SIDES:
            limits = getattr(arm, side)
            if not np.isfinite(limits[joint]):
                continue
            moved, seed = limits.copy(), np.clip(0.0, arm.lower, arm.upper)
            moved[joint], seed[joint] = far, limits[joint]
            wider = arm.with_(**{side: moved})
            nearest = wider.solve(pose, seed, weight=np.eye(JOINTS)[joint], gc=gc)
            if nearest.ok:
                found.append(Opening(joint + 1, side, float(nearest.distance)))
    return tuple(sorted(found, key=lambda opening: opening.extra))
