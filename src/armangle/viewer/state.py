"""What the viewer shows and may do, without any browser: posture, arcs, reasons, motion."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import CONFIGURATIONS, JOINTS, Floats, one_posture
from ..arm.arcs import ArcSet
from ..arm.arm import Arm, nearest_rotation
from ..arm.configuration import gc_signs
from ..arm.skeleton import blockers, elbow_points, first_blocker, skeleton
from ..errors import ConfigurationError, InputError, LimitError, NotFiniteError, ShapeError
from ..motion.following import follow
from ..motion.joint_path import JointPath
from ..motion.paths import Line
from ..motion.policies import Policy, Repulsion
from ..status import STATUSES, Status

_CIRCLE_SAMPLES = 181
_LARGEST_MOVE = 1.0  # rad: eq. (36) may act at full strength, but no joint flips over
_SHORT = {
    Status.UNREACHABLE: "out of reach",
    Status.FOLDED: "folded",
    Status.ELBOW_LIMIT: "joint 4 blocks",
    Status.ELBOW_MARGIN: "elbow singular",
}


@dataclass(frozen=True)
class Answer:
    """What became of a wish: whether it was met in full, and a sentence for the screen."""

    ok: bool
    text: str


@dataclass(frozen=True)
class ElbowCircle:
    """The elbow's circle as line segments: ends (n, 2, 3) in m, and the joint 1..7 that blocks, or 0."""

    segments: Floats
    blocker: Any


@dataclass
class ViewerState:
    """The arm that is shown, moved only within its limits.

    Parameters
    ----------
    arm : Arm
    start : array_like, shape (7,), optional
        Joints to begin with and to reset to, rad, within the limits; the middle of each range by default,
        with elbow and wrist bent.
    policy : Repulsion, Hold or Centre
        How the arm angle moves while the tool is dragged.

    Raises
    ------
    ShapeError, NotFiniteError
        If start is not seven finite numbers.
    LimitError
        If start is outside the limits.
    """

    arm: Arm
    start: ArrayLike | None = None
    policy: Policy = field(default_factory=Repulsion)

    q: Floats = field(init=False)
    pose: Floats = field(init=False)
    psi: float = field(init=False)
    gc: int = field(init=False)
    arcs: ArcSet = field(init=False)
    message: str = field(init=False, default="")
    motion: JointPath | None = field(init=False, default=None)
    row: int = field(init=False, default=0)
    _home: Floats = field(init=False)

    def __post_init__(self) -> None:
        self._home = bent_posture(self.arm) if self.start is None else self._checked(self.start)
        self.reset()

    def _checked(self, q: ArrayLike) -> Floats:
        joints = one_posture("q", q)
        outside = np.flatnonzero((joints < self.arm.lower - 1e-9) | (joints > self.arm.upper + 1e-9))
        if len(outside):
            at = int(outside[0])
            raise LimitError(f"joint {at + 1} is {joints[at]:g} rad, outside its limits")
        return joints

    def _take(self, q: Floats) -> None:
        self.q = np.array(q)
        pose, psi, gc = self.arm.forward(self.q)
        self.pose, self.psi, self.gc = pose, float(psi), int(gc)
        self.arcs = self.arm.feasible(self.pose, self.gc)

    def _say(self, ok: bool, text: str) -> Answer:
        self.message = text
        return Answer(ok, text)

    # -- wishes --------------------------------------------------------------------------------------

    def reset(self) -> Answer:
        """Go back to the joints of the beginning."""
        self._take(self._home)
        return self._say(True, "")

    def set_joints(self, q: ArrayLike) -> Answer:
        """Go to joints within the limits, at once.

        Raises
        ------
        ShapeError, NotFiniteError, LimitError
        """
        self._take(self._checked(q))
        return self._say(True, "")

    def set_pose(self, pose: ArrayLike) -> Answer:
        """Move the tool towards a pose: in small steps, the arm angle by eq. (36), as far as it goes.

        Parameters
        ----------
        pose : array_like, shape (4, 4)
            Tool frame, position in m; its rotation may be off by rounding.

        Returns
        -------
        Answer
            Not ok where the arm had to stop on the way: why, in words.
        """
        wanted = nearest_rotation(pose)
        if wanted.ndim != 2:
            raise ShapeError(f"pose has shape {wanted.shape}, wanted (4, 4)")
        path = follow(
            self.arm, ways_between(self.pose, wanted), start=self.q, policy=self.policy, carry="elbow",
            max_joint_step=_LARGEST_MOVE,
        )  # fmt: skip
        solved = np.flatnonzero(path.status == Status.OK)
        if len(solved):
            self._take(path.q[solved[-1]])
        if path.ok:
            return self._say(True, "")
        failure = path.first_failure
        status = STATUSES[path.status[failure if failure is not None else -1]]
        return self._say(False, self._why(path.poses[failure or 0], self.gc, status))

    def set_psi(self, psi: float) -> Answer:
        """Turn the elbow to an arm angle (rad), or to the nearest that is feasible; the tool stays."""
        angle = float(psi)
        if not np.isfinite(angle):
            raise NotFiniteError(f"psi is {angle}, wanted a finite angle in rad")
        if self.arcs.is_empty:
            return self._say(False, self.arcs.status.sentence)  # type: ignore[union-attr]  # of one pose: a Status
        if angle in self.arcs:
            self._turn_to(angle)
            return self._say(True, "")
        who = [str(j + 1) for j in np.flatnonzero(blockers(self.arm, self.pose, self.gc, angle))]
        self._turn_to(float(self.arcs.nearest(angle)))
        joints = f"joint{'s' * (len(who) > 1)} {', '.join(who)}"
        return self._say(False, f"ψ = {np.degrees(angle):.1f}° is blocked by {joints}.".replace("-", "−"))

    def _turn_to(self, psi: float) -> None:
        self._take(self.arm.inverse(self.pose, psi, self.gc, seed=self.q))

    def set_gc(self, gc: int) -> Answer:
        """Jump to another global configuration at the same pose and the nearest feasible arm angle.

        Raises
        ------
        ConfigurationError
            If gc is not an integer from 0 to 7.
        """
        if gc not in range(CONFIGURATIONS):
            raise ConfigurationError(f"gc is {gc!r}, wanted an integer from 0 to 7")
        reason = self.reason(gc)
        if reason is not None:
            return self._say(False, f"GC {gc}: {reason}")
        psi = self.arm.feasible(self.pose, gc).nearest(self.psi)
        self._take(self.arm.inverse(self.pose, psi, gc, seed=self.q))
        return self._say(True, "")

    # -- what can be said of it ----------------------------------------------------------------------

    def reason(self, gc: int) -> str | None:
        """Return why a global configuration has no solution at the pose, None where it has one."""
        arcs = self.arm.feasible(self.pose, gc)
        if not arcs.is_empty:
            return None
        return self._why(self.pose, gc, Status(int(arcs.status)))

    def short_reason(self, gc: int) -> str | None:
        """Return `reason` in two or three words, for a button."""
        arcs = self.arm.feasible(self.pose, gc)
        if not arcs.is_empty:
            return None
        status = Status(int(arcs.status))
        if status != Status.LIMITS:
            return _SHORT[status]
        each = self.arm.joint_feasible(self.pose, gc)
        alone = [j + 1 for j in range(JOINTS) if bool(each[j].is_empty)]
        return f"joint {alone[0]} blocks" if alone else "limits leave no ψ"

    def reasons(self) -> list[str | None]:
        """Return `reason` for each of the eight global configurations."""
        return [self.reason(gc) for gc in range(CONFIGURATIONS)]

    def _why(self, pose: Floats, gc: int, status: Status) -> str:
        if status != Status.LIMITS:
            return status.sentence
        each = self.arm.joint_feasible(pose, gc)
        alone = [str(j + 1) for j in range(JOINTS) if bool(each[j].is_empty)]
        if alone:
            return f"Joint {alone[0]} is outside its limits at every ψ."
        some = [str(j + 1) for j in range(JOINTS) if not bool(each[j].is_full)]
        return f"Joints {', '.join(some)} together block every ψ."

    def elbow_circle(self) -> ElbowCircle:
        """Return the elbow's circle at the pose and configuration, each piece with who blocks it."""
        psi = np.linspace(-np.pi, np.pi, _CIRCLE_SAMPLES)
        points = elbow_points(self.arm, self.pose, self.gc, psi)
        blocked = blockers(self.arm, self.pose, self.gc, 0.5 * (psi[1:] + psi[:-1]))
        return ElbowCircle(np.stack([points[:-1], points[1:]], axis=1), first_blocker(blocked))

    def ghosts(self) -> dict[int, Floats]:
        """Return the stick figures (8, 3), m, of the other configurations that have a solution."""
        out = {}
        for gc in range(CONFIGURATIONS):
            arcs = self.arm.feasible(self.pose, gc)
            if gc != self.gc and not arcs.is_empty:
                out[gc] = skeleton(self.arm, self.arm.inverse(self.pose, arcs.nearest(self.psi), gc))
        return out

    def export(self) -> str:
        """Return the posture as JSON: robot, q (rad), psi (rad), gc, pose (m), margin (rad)."""
        margin = float(self.arm.limit_margin(self.q))
        facts = {
            "robot": self.arm.name, "q": self.q.tolist(), "psi": self.psi, "gc": self.gc,
            "gc_signs": gc_signs(self.gc).tolist(), "pose": self.pose.tolist(),
            "margin": margin if np.isfinite(margin) else None,
        }  # fmt: skip
        return json.dumps(facts, indent=1, allow_nan=False)

    # -- a motion ------------------------------------------------------------------------------------

    def set_motion(self, motion: JointPath) -> Answer:
        """Take a motion to play and go to its first row.

        Raises
        ------
        InputError
            If it is another arm's, or no row of it is solved.
        """
        self.check_motion(motion)
        self.motion = motion
        answer = self.seek(0)
        return answer if motion.ok else self._say(False, motion.explain())

    def check_motion(self, motion: JointPath) -> None:
        """Raise `InputError` if a motion is another arm's, or no row of it is solved."""
        if motion.arm != self.arm:
            raise InputError(f"the motion is of {motion.arm.name!r}, wanted one of {self.arm.name!r}")
        if not np.isfinite(motion.q).all(axis=1).any():
            raise InputError("the motion has no solved row, wanted at least one")

    def seek(self, row: int) -> Answer:
        """Go to a row of the motion; a row that was not solved leaves the arm where it is."""
        if self.motion is None:
            return self._say(False, "There is no motion to play.")
        self.row = min(max(int(row), 0), len(self.motion) - 1)
        q = self.motion.q[self.row]
        if not np.isfinite(q).all():
            return self._say(False, f"Pose {self.row}: {STATUSES[self.motion.status[self.row]].sentence}")
        self._take(q)
        return self._say(True, "")


_REACH_STEP = 0.01  # m of the tool in one step of a drag
_TURN_STEP = np.radians(2.0)  # rad of the tool in one step of a drag
_MOST_STEPS = 200
_BENT = (0.6, 1.3, 0.6)  # rad from straight: joints 2, 4, 6
_ASIDE = (0.0, 0.35, 0.3)  # rad from the middle: joints 1, 3, 5, so that no link lies in a common plane
_ROOM = 0.2  # rad to the nearest limit that is worth a better bend


def bent_posture(arm: Arm) -> Floats:
    """Return joints (7,), rad, within the limits, with shoulder, elbow and wrist bent enough to be seen."""
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    middle = np.where(lower <= upper, 0.5 * (lower + upper), np.clip(0.0, arm.lower, arm.upper))
    middle[[0, 2, 4]] += _ASIDE
    best, best_bend = middle, -np.inf
    for signs in np.ndindex(2, 2, 2):
        theta = arm.signs * middle + arm.offsets
        theta[[1, 3, 5]] = np.where(np.array(signs) == 0, 1.0, -1.0) * _BENT
        theta[3] += arm.delta
        q = np.clip(arm.signs * (theta - arm.offsets), arm.lower, arm.upper)
        reached = arm.signs * q + arm.offsets - np.array([0, 0, 0, arm.delta, 0, 0, 0])
        room = float(np.minimum(q - arm.lower, arm.upper - q).min())
        bend = float(np.abs(np.sin(reached[[1, 3, 5]])).min()) + min(room, _ROOM)
        if bend > best_bend + 1e-9:
            best, best_bend = q, bend
    return np.clip(best, arm.lower, arm.upper)


def ways_between(first: Floats, last: Floats) -> Floats:
    """Return poses (N, 4, 4) from `first` (left out) to `last`, near enough to each other to step along."""
    line = Line(first, last)
    twist = line.derivative(0.0)
    way, turn = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
    count = int(min(np.ceil(max(way / _REACH_STEP, turn / _TURN_STEP, 1.0)), _MOST_STEPS))
    poses = line.pose(np.arange(1, count + 1) / count)
    poses[-1] = last
    return poses
