"""Motions of an arm for plots and the viewer: from a joint file, or along poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import CONFIGURATIONS, as_floats
from ..arm.arm import Arm
from ..errors import PathError
from ..files.tables import JointTable
from ..motion.following import follow
from ..motion.joint_path import Between, JointPath


def motion_of(arm: Arm, table: JointTable, between: Between | None = "tool") -> JointPath:
    """Return the rows of a joint file as a motion of an arm, including rows without joints."""
    return JointPath.from_joints(arm, table.q, s=table.s, status=table.status, between=between)


def motions_along(arm: Arm, poses: ArrayLike, start: ArrayLike | None = None) -> dict[str, JointPath]:
    """Return motions along poses (N, 4, 4), m, by name: from joints `start` (7,), rad, or from the middle of
    the widest arc of each GC. First those that reach every pose; the others have the reason.

    Raises `PathError` if no global configuration has a solution at the first pose, or there is no pose.
    """
    frames = as_floats("poses", poses, (4, 4)).reshape(-1, 4, 4)
    if start is not None:
        return {"from the start": follow(arm, frames, start=start)}
    found = {}
    for gc in range(CONFIGURATIONS) if len(frames) else ():
        arcs = arm.feasible(frames[0], gc)
        if not arcs.is_empty:
            lower, upper = arcs.intervals[np.diff(arcs.intervals, axis=1)[:, 0].argmax()]
            q = arm.inverse(frames[0], 0.5 * (lower + upper), gc, limits=False)
            found[f"GC {gc}"] = follow(arm, frames, start=q)
    if not found:
        raise PathError("no global configuration has a solution at the first pose")
    return dict(sorted(found.items(), key=lambda entry: not entry[1].ok))
