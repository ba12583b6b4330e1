"""A smooth curve in the joints through the postures of a path with corners: what a bound on jerk needs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats
from ..arm.arm import Arm
from ..arm.offset import OffsetArm
from ..errors import PathError
from ..motion.curves import JointSpline
from ..motion.joint_path import MOST_PASSED
from ..motion.paths import RADIAN, Deviation
from .motion import Motion

LOOKED_AT, SURE = np.array([0.1, 0.3, 0.5, 0.7, 0.9]), 0.9
"""Where between two nodes it is looked at how far off the tool is, and what share of the most shows there."""
HALVINGS = 12
"""How often nodes come closer to one another at most."""
KEPT = 1e-8
"""A limit passed by less is kept, rad."""
INSIDE = 1.2
"""How far inside a limit postures are put, of what the curve through them would pass it by."""
PUT = 1.0
"""Share of the tolerance (m, for rad) that they may be put inside by; else nodes come nearer first."""
LONGEST = 1 / 32
"""Of s, between the first nodes."""
_ROOT_8 = np.sqrt(8.0)  # of |R - S| to 2 sin(half the angle)


class Rounded:
    """A cubic spline through postures of a joint path: twice differentiable, without corners.

    Not to be confused with `Segments`, whose blends are poses: these are joints, so that a path that has
    been followed can be timed.

    Parameters
    ----------
    motion : JointPath
        What is smoothed.
    breaks : ndarray, shape (K,)
        The s of the postures, from 0 to 1.
    inside : ndarray, shape (7,)
        How far inside the limits all but the first and the last posture are put, rad.
    """

    def __init__(self, motion: Motion, breaks: Floats, inside: ArrayLike = 0.0) -> None:
        self._motion, self.breaks = motion, breaks
        q = np.array(motion.at(breaks).q)
        self._low = np.minimum(motion.arm.lower, q.min(axis=0))  # a path may begin outside its limits
        self._high = np.maximum(motion.arm.upper, q.max(axis=0))
        q[1:-1] = np.clip(q[1:-1], self._low + inside, self._high - inside)
        self._curve = JointSpline(motion.arm, breaks, q, 0, np.empty((0, 0)))

    @property
    def arm(self) -> Arm | OffsetArm:
        """The arm that moves."""
        return self._motion.arm

    @property
    def path(self) -> Any:
        """Where the tool would go with corners."""
        return self._motion.path

    @property
    def leads_the_tool(self) -> bool:
        """Whether the tool goes where the joints take it: True."""
        return True

    def at(self, s: ArrayLike, /) -> Any:
        """Return a value with the field q, (..., 7) rad."""
        return SimpleNamespace(q=self._curve.spline(s))

    def derivatives(self, s: ArrayLike, /) -> Floats:
        """Return q', q'', q''' with respect to s, (..., 3, 7)."""
        return self._curve.derivatives(None, np.asarray(s))

    def _tool(self, q: Floats) -> Floats:
        if isinstance(self.arm, OffsetArm):
            return np.asarray(self.arm.forward(q)[0])
        return np.asarray(self.arm.forward(q, undefined="nan")[0])

    def deviations(self) -> tuple[Floats, Floats]:
        """Return by how much the tool is off between each two nodes at most, m and rad, (K - 1,) each."""
        s = self.breaks[:-1, None] + np.diff(self.breaks)[:, None] * LOOKED_AT
        here, there = (self._tool(q) for q in (self.at(s).q, self._motion.at(s).q))
        away = np.linalg.norm(here[..., :3, 3] - there[..., :3, 3], axis=-1)
        chord = np.linalg.norm(here[..., :3, :3] - there[..., :3, :3], axis=(-2, -1)) / _ROOT_8
        return away.max(axis=1) / SURE, 2 * np.arcsin(np.minimum(chord, 1.0)).max(axis=1) / SURE

    def passed(self) -> Floats:
        """Return by how much joints pass their limits between each two nodes at most, (K - 1, 7) rad."""
        return self._curve.passed(self._low, self._high)


def rounded(motion: Motion, corners: Floats, tolerance: float) -> tuple[Motion, Deviation]:
    """Return the motion without corners, and by how much at most the tool is off.

    Parameters
    ----------
    motion : JointPath
    corners : ndarray, shape (K,)
        Where q' jumps, and both ends: the first nodes, with halves where they lie far apart. More halves
        follow where the tool is off too far.
    tolerance : float
        What the tool may be off, m; a radian counts as `RADIAN` m.

    Raises
    ------
    MissingExtraError
    PathError
        If a joint passes its limit however near the nodes lie.

    Where the path rides on a limit the curve would pass it: by as much postures are put inside.
    """
    nodes = corners
    while (long := np.diff(nodes) > LONGEST).any():
        nodes = np.union1d(nodes, (nodes[:-1] + np.diff(nodes) / 2)[long])
    for _ in range(HALVINGS):
        found = Rounded(motion, nodes)
        if KEPT < (beyond := found.passed()).max() <= PUT * tolerance:
            found = Rounded(motion, nodes, INSIDE * beyond.max(axis=0))
            beyond = found.passed()
        position, rotation = found.deviations()
        off = (np.hypot(position, RADIAN * rotation) > tolerance) | (beyond > KEPT).any(axis=1)
        if not off.any():
            break
        near = off | np.append(off[1:], False) | np.append(False, off[:-1])
        nodes = np.union1d(nodes, (nodes[:-1] + np.diff(nodes) / 2)[near])
    if beyond.max() > MOST_PASSED:
        k, joint = np.unravel_index(beyond.argmax(), beyond.shape)
        raise PathError(
            f"no timing is found: where corners are rounded, at s = {found.breaks[k]:.6g}, joint {joint + 1} "
            f"passes its limit by {np.degrees(beyond.max()):.3g} deg; leave jerk= and tolerance= out, or plan"
        )
    return found, Deviation(float(position.max()), float(rotation.max()))
