"""The viewer's state and actions, without any browser: joints, arcs, reasons, motion."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import CONFIGURATIONS, JOINTS, Floats, one_branch, one_posture
from ..arm.arcs import ArcSet
from ..arm.arm import Arm, nearest_rotation
from ..arm.configuration import gc_signs
from ..arm.skeleton import alike, blocker_of, blockers, corners, elbow_points, unproven, unsolved
from ..errors import InputError, LimitError, SceneError, UnreachableError
from ..motion.following import follow
from ..motion.joint_path import JointPath
from ..motion.options import core_policy
from ..motion.paths import Line
from ..motion.policies import Hold, Policy
from ..motion.tracking import Tracker, Tracking
from ..scenes.clearance import Clearance
from ..scenes.scene import Scene
from ..scenes.shapes import Box
from ..status import STATUSES, Status
from .opening import opening_posture

_CIRCLE_SAMPLES = 181
_LARGEST_MOVE = 1.0  # rad: a policy may act at full strength, but no joint may jump
_TICK, _FASTEST, _HARDEST = 0.02, 3.0, 30.0  # s, rad/s, rad/s²: of the tracker that follows the gizmo
_MOST_TICKS = 500
_AT_REST, _RESTING_TICKS = 1e-3, 60  # rad/s; cycles, because a stalled arm goes on after a second
_ROUNDING = 1e-9  # rad: limit violation by rounding
_TOUCH = 1e-9  # m below the clearance by rounding


def degrees_text(value: float, digits: int = 1) -> str:
    """Return an angle (rad) in degrees for the screen.

    >>> degrees_text(-0.1)
    '−5.7°'
    """
    return f"{round(float(np.degrees(value)), digits) + 0.0:.{digits}f}°".replace("-", "−")


@dataclass(frozen=True)
class Answer:
    """Result of an action: whether it was completed, and a sentence for the screen."""

    ok: bool
    text: str


@dataclass(frozen=True)
class ElbowCircle:
    """The elbow's circle as line segments: ends (n, 2, 3) in m, and their blockers, as of `blocker_of`."""

    segments: Floats
    blocker: Any


@dataclass
class ViewerState:
    """The displayed arm, moved only within its limits.

    Parameters
    ----------
    arm : Arm
        A dragged tool or a turned elbow does not collide with its `scene`. Joints turned one by one, and
        moved boxes, may; `touching` reports it.
    start : array_like, shape (7,), optional
        Initial joints, also for reset, rad, within the limits; `opening_posture` by default.
    policy : Repulsion, Hold, Centre or Towards, optional
        Motion of the arm angle while the tool moves. By default the arm moves as a `Tracker` does: to the
        nearest pose if the target is not reachable, with little elbow motion.

    Attributes
    ----------
    q, pose, psi, gc, arcs
        The displayed configuration: joints (rad), tool (4, 4), arm angle (rad), global configuration 0..7,
        and the feasible arm angles there. Always within the limits.
    target : ndarray, shape (4, 4), or None
        The requested tool pose that was not reached, until the next action.
    message : str
        Why the last action was not completed, or "".
    motion : JointPath or None
        The motion being played, and `row`, its present row.
    nearest : Clearance or None
        The nearest pair of link and obstacle; None without a scene.

    Raises
    ------
    InputError
        If start is not seven finite numbers, or the policy has a rate: dragging has no time step.
    LimitError
        If start violates limits.
    """

    arm: Arm
    start: ArrayLike | None = None
    policy: Policy | None = None

    q: Floats = field(init=False)
    pose: Floats = field(init=False)
    psi: float = field(init=False)
    gc: int = field(init=False)
    arcs: ArcSet = field(init=False)
    target: Floats | None = field(init=False, default=None)
    message: str = field(init=False, default="")
    motion: JointPath | None = field(init=False, default=None)
    row: int = field(init=False, default=0)
    nearest: Clearance | None = field(init=False, default=None)
    _home: Floats = field(init=False)
    _home_arm: Arm = field(init=False)
    _home_row: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        if self.policy is not None:
            core_policy(self.policy, None)  # rejects a rate
        self._home_arm = self.arm
        self._home = opening_posture(self.arm) if self.start is None else self._checked(self.start)
        self.reset()

    def _checked(self, q: ArrayLike) -> Floats:
        """Return joints; raise unless they are within the limits."""
        joints = one_posture("q", q)
        lower, upper = self.arm.lower - _ROUNDING, self.arm.upper + _ROUNDING
        outside = np.flatnonzero((joints < lower) | (joints > upper))
        if len(outside):
            at = int(outside[0])
            raise LimitError(f"joint {at + 1} is {joints[at]:g} rad, outside its limits")
        return joints

    def _take(self, q: Floats) -> None:
        """Show a configuration; pose, arm angle and branch follow from its joints."""
        pose, psi, gc = self.arm.forward(q)
        self.q, self.pose, self.psi, self.gc = np.array(q), pose, float(psi), int(gc)
        self._look()
        self.target = None

    def _look(self) -> None:
        """Compute the arcs of the configuration, and its nearest obstacle."""
        self.arcs = self._arcs(self.gc)
        if self.scene is not None:
            self.nearest = self.arm.clearance(self.q)

    def _arcs(self, gc: int) -> ArcSet:
        """Return the feasible arm angles of a branch at the present pose."""
        return self.arm.feasible(self.pose, gc)

    def _say(self, ok: bool, text: str) -> Answer:
        """Keep a sentence for the screen and return it as the answer."""
        self.message = text
        return Answer(ok, text)

    # -- actions -------------------------------------------------------------------------------------

    def reset(self) -> Answer:
        """Return to the start: the first solved row of the motion if any, otherwise `start`; boxes too."""
        self.row, self.arm = self._home_row, self._home_arm
        self._take(self._home)
        return self._say(True, "")

    def set_joint(self, joint: int, value: float) -> Answer:
        """Turn one joint, 1..7, to a value (rad), or to its limit; tool and arm angle follow.

        Returns
        -------
        Answer
            Not ok if the joint stops at its limit, or the configuration has no arm angle: the arm is folded.

        Raises
        ------
        InputError
            If the joint does not exist, or the value is not finite.
        """
        if joint not in range(1, JOINTS + 1):
            raise InputError(f"joint is {joint!r}, wanted an integer from 1 to {JOINTS}")
        if not np.isfinite(value):
            raise InputError(f"joint {joint} is {value}, wanted a finite angle in rad")
        q = self.q.copy()
        q[joint - 1] = np.clip(value, self.arm.lower[joint - 1], self.arm.upper[joint - 1])
        try:
            self._take(q)
        except UnreachableError as error:
            return self._say(False, str(error))
        if abs(q[joint - 1] - value) <= _ROUNDING:
            return self._say(True, "")
        return self._say(False, f"Joint {joint} stops at its limit {degrees_text(q[joint - 1])}.")

    def set_pose(self, pose: ArrayLike) -> Answer:
        """Move the tool to a pose: like a tracker, or in small steps with the arm angle by the policy.

        A tracker ends at the nearest reachable pose, steps end where the next one is impossible.

        Parameters
        ----------
        pose : array_like, shape (4, 4)
            Pose of the end effector, position in m; its rotation may be rounded.

        Returns
        -------
        Answer
            Not ok if the tool is not there, with the reason in words; `target` is then the pose.

        Raises
        ------
        InputError
        """
        wanted = nearest_rotation(pose)
        if wanted.ndim != 2:
            raise InputError(f"pose has shape {wanted.shape}, wanted (4, 4)")
        if self.policy is None:
            return self._track(wanted)
        path = follow(
            self.arm, ways_between(self.pose, wanted), start=self.q, policy=self.policy,
            carry="psi" if isinstance(self.policy, Hold) else "elbow", max_joint_step=_LARGEST_MOVE,
        )  # fmt: skip
        solved = np.flatnonzero(path.status == Status.OK)
        if len(solved):
            self._take(path.q[solved[-1]])
        if path.ok:
            return self._say(True, "")
        self.target = wanted
        failure = path.first_failure
        status = STATUSES[path.status[failure if failure is not None else -1]]
        return self._say(False, self._why(path.poses[failure or 0], self.gc, status))

    def _track(self, wanted: Floats) -> Answer:
        """Show the configuration at which a tracker comes to rest near the pose `wanted`."""
        tracker = Tracker(self.arm, _TICK, _FASTEST, _HARDEST)
        try:
            tracker.start(self.q, outside="escape")
        except SceneError:
            self.target = wanted
            return self._say(False, f"The way out is not known: {self.touching}.")
        resting = 0
        for _ in range(_MOST_TICKS):
            now = tracker.step(wanted)
            resting = resting + 1 if np.abs(now.velocity).max() < _AT_REST else 0
            if now.status == Tracking.FOLLOWING or resting > _RESTING_TICKS:
                break
        self._take(now.q)
        if now.status == Tracking.FOLLOWING:
            return self._say(True, "")
        self.target = wanted
        short = 1e3 * float(np.linalg.norm(wanted[:3, 3] - self.pose[:3, 3]))
        return self._say(
            False, f"{self._why(wanted, self.gc, now.why)} The tool is {short:.0f} mm short of it."
        )

    def set_psi(self, psi: float) -> Answer:
        """Set the arm angle (rad), or (not ok) the nearest feasible one; without any the arm stays."""
        angle = float(psi)
        if not np.isfinite(angle):
            raise InputError(f"psi is {angle}, wanted a finite angle in rad")
        if self.arcs.is_empty:
            return self._say(False, self.arcs.status.sentence)
        if angle in self.arcs:
            self._turn_to(angle)
            return self._say(True, "")
        who = [str(j + 1) for j in np.flatnonzero(blockers(self.arm, self.pose, self.gc, angle))]
        left_out = not who and bool(unproven(self.arm, self.pose, self.gc, angle))
        none = bool(unsolved(self.arm, self.pose, self.gc).contains(angle))
        blocking = f"joint{'s' * (len(who) > 1)} {', '.join(who)}"
        if not who and not left_out and self.scene is not None:
            near = self.arm.clearance(self._at(angle, self.gc))
            blocking = f"{near.obstacle}, which {near.link} would touch"
        self._turn_to(float(self.arcs.nearest(angle)))
        why = "is left out: nothing is proven there" if left_out else f"is blocked by {blocking}"
        why = "has no solution in this branch" if none else why
        return self._say(False, f"ψ = {degrees_text(angle)} {why}.")

    def _turn_to(self, psi: float) -> None:
        """Set the arm angle without moving the tool."""
        self._take(self._at(psi, self.gc))

    def _at(self, psi: float, gc: int) -> Floats:
        """Return the joints of the tool's pose at an arm angle in branch gc; limits are ignored."""
        return self.arm.inverse(self.pose, psi, gc, seed=self.q, limits=False)

    def set_gc(self, gc: int) -> Answer:
        """Jump to another global configuration at the same pose and the nearest feasible arm angle.

        Without a feasible arm angle there the arm stays, and the answer says why.

        Raises
        ------
        InputError
            If gc is not an integer from 0 to 7.
        """
        one_branch("gc", gc)
        reason = self.reason(gc)
        if reason is not None:
            return self._say(False, f"GC {gc}: {reason}")
        self._take(self._at(float(self._arcs(gc).nearest(self.psi)), gc))
        return self._say(True, "")

    def move_box(self, name: str, pose: ArrayLike) -> Answer:
        """Move a box of the scene; the arm stays, even in collision.

        Parameters
        ----------
        name : str
            Name of the box, as in ``scene.names``.
        pose : array_like, shape (4, 4)
            Frame of the box, position in m; its rotation may be off by rounding.

        Returns
        -------
        Answer
            Not ok if a link is now nearer to an obstacle than the clearance.

        Raises
        ------
        InputError
            If the scene has no such box, or the pose is invalid.
        """
        place = nearest_rotation(pose)
        boxes = dict(self.boxes)
        if self.scene is None or name not in boxes:
            raise InputError(
                f"name is {name!r}, wanted a box of the scene: {', '.join(boxes) or 'it has none'}"
            )
        old = boxes[name]
        moved = Box(place, old.size, old.radius, name=old.name)
        shapes = tuple(moved if shape is old else shape for shape in self.scene.shapes)
        return self._take_scene(replace(self.scene, shapes=shapes))

    def set_clearance(self, clearance: float) -> Answer:
        """Set the clearance of the arm to all obstacles, m; the answer says whether it is kept now.

        Raises
        ------
        InputError
            If there is no scene.
        SceneError
            If it is not a length >= 0.
        """
        if self.scene is None:
            raise InputError("there is no scene, wanted one to keep clear of")
        return self._take_scene(replace(self.scene, clearance=clearance))

    def _take_scene(self, scene: Scene) -> Answer:
        """Set another scene, and say whether the arm is in collision now."""
        self.arm = self.arm.with_(scene=scene)
        self._look()
        return self._say(self.touching is None, self.touching or "")

    @property
    def scene(self) -> Scene | None:
        """The obstacles, or None."""
        return self.arm.scene

    @property
    def boxes(self) -> list[tuple[str, Box]]:
        """The boxes of the scene with their names, which `move_box` moves."""
        if self.scene is None:
            return []
        named = zip(self.scene.names, self.scene.shapes, strict=True)
        return [(name, shape) for name, shape in named if isinstance(shape, Box)]

    # -- queries -------------------------------------------------------------------------------------

    @property
    def touching(self) -> str | None:
        """Which link violates the clearance to which obstacle, in words; None if none does."""
        if (
            self.scene is None
            or self.nearest is None
            or self.nearest.distance >= self.scene.clearance - _TOUCH
        ):
            return None
        short = 1e3 * (self.scene.clearance - float(self.nearest.distance))
        return f"{self.nearest.link} is {short:.1f} mm too near to {self.nearest.obstacle}"

    def reason(self, gc: int) -> str | None:
        """Return why a global configuration has no solution at the pose, None if it has one."""
        arcs = self._arcs(gc)
        if not arcs.is_empty:
            return None
        return self._why(self.pose, gc, Status(int(arcs.status)))

    def reasons(self) -> list[str | None]:
        """Return `reason` for each of the eight global configurations: why it has no solution, or None."""
        return [self.reason(gc) for gc in range(CONFIGURATIONS)]

    def _why(self, pose: Floats, gc: int, status: Status) -> str:
        """Return in words why a branch has no solution at a pose."""
        if self.scene is not None and status in (Status.CLEARANCE, Status.POSE_BLOCKED):
            pair = self.arm._clear(pose, gc, self.scene).blocking
            return status.sentence if pair is None else f"{pair[1]} meets {pair[0]} at every ψ."
        if status != Status.LIMITS:
            return status.sentence
        each = self.arm.feasible(pose, gc, per_joint=True)
        alone = [str(j + 1) for j in range(JOINTS) if bool(each[j].is_empty)]
        if alone:
            return f"Joint {alone[0]} is outside its limits at every ψ."
        some = [str(j + 1) for j in range(JOINTS) if not bool(each[j].is_full)]
        return f"Joints {', '.join(some)} together block every ψ."

    def elbow_circle(self) -> ElbowCircle:
        """Return the elbow's circle at the pose and configuration, each piece with its blocker."""
        psi = np.linspace(-np.pi, np.pi, _CIRCLE_SAMPLES)
        points = elbow_points(self.arm, self.pose, self.gc, psi)
        middle = 0.5 * (psi[1:] + psi[:-1])
        who = blocker_of(self.arm, self.pose, self.gc, middle, self.scene)
        segments = np.stack([points[:-1], points[1:]], axis=1)
        whole = np.isfinite(segments).all(axis=(1, 2))
        segments[~whole] = self.arm.elbow(self.q)  # hidden where no solution is proven
        return ElbowCircle(segments, who)

    def ghosts(self) -> dict[int, Floats]:
        """Return by gc the stick figures (n, 3), m, of the other configurations that have a solution."""
        out = {}
        for gc in range(CONFIGURATIONS):
            arcs = self._arcs(gc)
            if gc != self.gc and not arcs.is_empty:
                out[gc] = corners(self.arm, self._at(float(arcs.nearest(self.psi)), gc))
        return out

    def export(self) -> str:
        """Return the configuration as JSON: robot, q (rad), psi (rad), gc, pose (m), margin (rad)."""
        margin = float(self.arm.limit_margin(self.q))
        facts = {
            "robot": self.arm.name, "q": self.q.tolist(), "psi": self.psi, "gc": self.gc,
            "gc_signs": gc_signs(self.gc).tolist(), "pose": self.pose.tolist(),
            "margin": margin if np.isfinite(margin) else None,
        }  # fmt: skip
        return json.dumps(facts, indent=1, allow_nan=False)

    # -- motions -------------------------------------------------------------------------------------

    def set_motion(self, motion: JointPath) -> Answer:
        """Select a motion to play and go to its first solved row, where `reset` returns.

        The answer says whether every row is solved, and if not, why.

        Raises
        ------
        InputError
            If it belongs to another arm, or has no solved row.
        """
        self.check_motion(motion)
        self.motion = motion
        self._home_row = int(np.isfinite(motion.q).all(axis=1).argmax())
        self._home = np.array(motion.q[self._home_row])
        self.reset()
        return self._say(motion.ok, "" if motion.ok else motion.explain())

    def check_motion(self, motion: JointPath) -> None:
        """Raise `InputError` if a motion belongs to another arm, or has no solved row."""
        if not alike(motion.arm, self.arm):
            raise InputError(f"the motion is of {motion.arm.name!r}, wanted one of {self.arm.name!r}")
        if not np.isfinite(motion.q).all(axis=1).any():
            raise InputError("the motion has no solved row, wanted at least one")

    def seek(self, row: int) -> Answer:
        """Go to a row of the motion (clipped to its rows).

        Not ok, with the reason, without a motion or at an unsolved row; the arm then stays.
        """
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


def ways_between(first: Floats, last: Floats) -> Floats:
    """Return poses (N, 4, 4), at most 200, on the straight way from `first` (left out) to `last`."""
    line = Line(first, last)
    twist = line.derivative(0.0)
    way, turn = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
    count = int(min(np.ceil(max(way / _REACH_STEP, turn / _TURN_STEP, 1.0)), _MOST_STEPS))
    poses = line.pose(np.arange(1, count + 1) / count)
    poses[-1] = last
    return poses
