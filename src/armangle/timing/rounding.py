r"""A smooth joint curve near the corners of a path, which a bound on jerk requires.

q  |          corner         Postures of the path on both sides of every corner, and none at it: a cubic
   |           /\            spline through them cuts the corner. They lie as far from it as the tolerance
   |    o--o--o  o--o----o   lets them, and the next ones farther.
   +---------------------- s
"""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats
from .._values import by_content
from ..arm.arm import Arm
from ..errors import PathError
from ..models.axes import rotation_angle
from ..motion.curves import JointSpline
from ..motion.joint_path import MOST_PASSED
from ..motion.paths import RADIAN, Deviation
from .motion import Motion

LOOKED_AT, SURE = np.array([0.1, 0.3, 0.5, 0.7, 0.9]), 0.9
"""Places between two nodes where the deviation is sampled, and the share of its maximum that they show."""
ROUNDS, NEAREST = 60, 1e-4
"""Largest number of rounds that move nodes nearer to the corners, or insert some; smallest share of the first
distance.
"""
SOME_PARTS = 4
"""Number of parts of a distance between them before they have come that near."""
CLOSEST = 1e-6
"""Distance in s of nodes inserted where the deviation is still too large, as where joints move fast."""
SHRINK = 0.5, 0.95
"""Factor by which nodes come nearer in a round: least and greatest."""
APART = 3.0
"""Factor of the distance from a corner to the next node."""
KEPT = 1e-8
"""A smaller limit violation counts as none, rad."""
INSIDE = 1.2
"""Distance inside a limit at which nodes are placed, relative to the curve's violation."""
PUT = 1.0
"""Share of the tolerance (m, for rad) for that distance; beyond it nodes come nearer first."""
LONGEST = 1 / 8
"""Least distance of nodes, in s."""
Slopes = tuple[Floats | None, Floats | None]


@by_content
class Rounded:
    """A cubic spline through configurations of a joint path: twice differentiable, without corners.

    Not to be confused with `Segments`, whose blends are poses: these are joints, so that a followed path can
    be timed. `breaks` (K,) are the s of its nodes, from 0 to 1; `inside` (7,) is the distance inside the
    limits for all but the first and the last node, rad; `slopes` are q' at the ends, as for `JointSpline`.
    """

    leads_the_tool = True

    def __init__(
        self, motion: Motion, breaks: Floats, inside: ArrayLike = 0.0, slopes: Slopes = (None, None)
    ) -> None:
        """Make the spline through the configurations at s `breaks`; but for the ends, `inside` the limits.

        These limits are the arm's, or the range of the configurations where it exceeds them.
        """
        self._motion, self.breaks = motion, breaks
        q = np.array(motion.at(breaks).q)
        self._low = np.minimum(motion.arm.lower, q.min(axis=0))  # a path may begin outside its limits
        self._high = np.maximum(motion.arm.upper, q.max(axis=0))
        q[1:-1] = np.clip(q[1:-1], self._low + inside, self._high - inside)
        self._curve = JointSpline(motion.arm, breaks, q, 0, np.empty((0, 0)), slopes=slopes)

    @property
    def arm(self) -> Arm:
        """The arm that moves."""
        return self._motion.arm

    @property
    def path(self) -> Any:
        """The end effector's path with corners."""
        return self._motion.path

    @property
    def between(self) -> str:
        """The motion between rows, as `JointPath.between`."""
        return str(getattr(self._motion, "between", "tool"))

    def at(self, s: ArrayLike, /) -> Any:
        """Return a value with the field q, (..., 7) rad."""
        return SimpleNamespace(q=self._curve.spline(s))

    def derivatives(self, s: ArrayLike, /) -> Floats:
        """Return q', q'', q''' with respect to s, (..., 3, 7)."""
        return self._curve.derivatives(None, np.asarray(s))

    def _tool(self, q: Floats) -> Floats:
        """Return the pose of the end effector at joints q."""
        return np.asarray(self.arm.forward(q, on_error="nan")[0])

    def deviations(self) -> tuple[Floats, Floats]:
        """Return the largest deviation (m, rad) of the end effector between each two nodes, from samples."""
        s = self.breaks[:-1, None] + np.diff(self.breaks)[:, None] * LOOKED_AT
        here, there = (self._tool(q) for q in (self.at(s).q, self._motion.at(s).q))
        away = np.linalg.norm((here - there)[..., :3, 3], axis=-1)
        return away.max(axis=1) / SURE, rotation_angle(here - there).max(axis=1) / SURE

    def passed(self) -> Floats:
        """Return by how much (rad) each joint exceeds a limit between each two nodes, (K - 1, 7)."""
        return self._curve.passed(self._low, self._high)


def rounded(
    motion: Motion,
    corners: Floats,
    tolerance: float,
    steep: tuple[bool, bool] = (False, False),
    slopes: Slopes = (None, None),
) -> tuple[Motion, Deviation] | None:
    """Return the motion without corners, and its largest deviation; None if that is too large.

    `corners` (K,) are the s where q' jumps, and both ends; `tolerance` is the permitted deviation of the end
    effector, m, where a radian counts as `RADIAN` m. `steep`: whether joints have no finite rate along the
    path at its start, and at its end; as at a corner, the curve is straight up to the next node. `slopes`
    (7,) is q' at a moving end, which is then that of the curve too.

    If the path follows a limit the curve would violate it: nodes are placed inside by that amount. Raises
    `MissingExtraError`, and `PathError` if a joint violates its limit however near the nodes are.
    """
    room = np.diff(corners)
    reach = np.zeros(len(corners))
    reach[1:-1] = np.minimum(np.minimum(room[:-1], room[1:]), LONGEST) / 2
    reach[[0, -1]] = np.where(steep, np.minimum(room[[0, -1]], LONGEST) / 2, 0.0)
    cut = np.flatnonzero(reach)
    least, parts, put = NEAREST * reach[cut], np.ceil(room / LONGEST).astype(int), np.empty(0)
    for _ in range(ROUNDS):
        nodes = np.union1d(_nodes(corners, reach, parts), put)
        found = Rounded(motion, nodes, slopes=slopes)
        if KEPT < (beyond := found.passed()).max() <= PUT * tolerance:
            found = Rounded(motion, nodes, INSIDE * beyond.max(axis=0), slopes)
            beyond = found.passed()
        position, rotation = found.deviations()
        off, passed = np.hypot(position, RADIAN * rotation), np.asarray((beyond > KEPT).any(axis=1))
        bad = (off > tolerance) | passed
        if not bad.any():
            break
        at = np.maximum(np.searchsorted(nodes, corners[cut]) - 1, 0)
        nearer = bad[at] & (reach[cut] > least)
        between = np.unique(np.searchsorted(corners, nodes[:-1][bad], side="right") - 1)
        some = between[parts[between] < SOME_PARTS]
        wide = bad & (np.diff(nodes) > CLOSEST)
        if nearer.any():
            share = np.where(passed, SHRINK[0], np.clip(tolerance / np.maximum(off, tolerance), *SHRINK))
            reach[cut] *= np.where(nearer, share[at], 1.0)
        elif len(some):
            parts[some] *= 2
        elif (reach[cut] > least).any():
            reach[cut] *= SHRINK[0]
        elif wide.any():
            put = np.union1d(put, (nodes[:-1] + np.diff(nodes) / 2)[wide])
        else:
            break
    if beyond.max() > MOST_PASSED:
        k, joint = np.unravel_index(beyond.argmax(), beyond.shape)
        raise PathError(
            f"no timing is found: where corners are rounded, at s = {found.breaks[k]:.6g}, joint {joint + 1} "
            f"passes its limit by {np.degrees(beyond.max()):.3g} deg; leave jerk= and tolerance= out, or plan"
        )
    if (off > tolerance).any():
        return None
    return found, Deviation(float(position.max()), float(rotation.max()))


def _nodes(corners: Floats, reach: Floats, parts: Any) -> Floats:
    """Return the s of the spline's nodes: on both sides of each corner at its reach, and evenly between."""
    out = [corners[:1]]
    for k, (first, last) in enumerate(pairwise(corners.tolist())):
        rows = first + np.array(_between(last - first, float(reach[k]), float(reach[k + 1])))
        if reach[k]:
            out.append(rows[:1])
        out += [np.linspace(low, high, parts[k] + 1)[1:] for low, high in pairwise(rows.tolist())]
    if reach[-1]:
        out.append(corners[-1:])
    return np.concatenate(out)


def _between(room: float, left: float, right: float) -> list[float]:
    """Return the nodes between two corners `room` apart, with reaches `left` and `right` (0 at an end of the
    path), as distances from the first.
    """
    after, before = [left], [room - right]
    while left and APART * after[-1] <= room / 2:
        after.append(APART * after[-1])
    while right and room - APART * (room - before[0]) >= room / 2:
        before.insert(0, room - APART * (room - before[0]))
    if left and right and before[0] - after[-1] < min(after[-1], room - before[0]) / 2:
        return [*after[:-1], (after[-1] + before[0]) / 2, *before[1:]]
    return after + before
