"""The loop for teleoperation, joysticks, cameras and policies: joints in every control cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import (
    JOINTS,
    Floats,
    as_flag,
    as_floats,
    as_number,
    as_poses,
    chosen,
    many_poses,
    one_branch,
    one_posture,
)
from .._core import Wish
from .._progress import Progress, as_progress, progressing
from .._values import by_content
from ..arm.arm import Arm, check_arm
from ..arm.keywords import names_keywords
from ..arm.wish import DIRECTIONS, Direction
from ..errors import InputError, SceneError
from ..scenes.ready import Ready, make_ready
from ..scenes.scene import Scene
from ..status import STATUSES, Named, Status
from .kinds import tracker_of
from .options import LONGEST_STEP, Bound, as_seconds, joint_bound, positive


class _Tracking(Named):
    """State of a `Tracker` after a control cycle.

    FOLLOWING: the end effector is at the target, within 1e-9 m. LAGGING: it approaches the target as fast as
    bounds and obstacles allow. NEAREST: the target is out of reach, or no way to it was found: at, or on the
    way to, the nearest pose. HELD: no sample is accepted: it continues as predicted. TURNING: it moves in
    joint space to the branch of `reconfigure`, to a solution of a target at rest, out of a corner of the
    limits, or around an obstacle: the end effector leaves the target. RETURNING: a joint violates its limits,
    or a link collides, since `start`: it is leaving that state.
    """


if TYPE_CHECKING:
    from .._core import Tracking as Tracking
else:  # the core alone holds names and numbers; pickled as armangle's own
    Tracking = _Tracking("Tracking", {one.name: one.value for one in _core.Tracking}, module=__name__)
    Tracking.__doc__ = _Tracking.__doc__

_TRACKINGS = tuple(Tracking)
_MOST_MARGIN = 1.0  # rad
_MOST_CLEARANCE = 10.0  # m
_LONGEST = 1e3  # m, upper bound for the length of a radian
_POINT = 3
_KEYWORDS = {
    "policy": "the arm angle is its own choice; step(pose, elbow=) or elbow_direction= hints at another",
    "psi": "step(pose, elbow=) or elbow_direction= hints at an arm angle",
    **dict.fromkeys(("start", "seed", "q0"), "start(q) says where the arm stands"),
    "rate": "dt= is the time of a tick, s",
    "max_joint_step": "velocity= bounds the joints, rad/s",
}


@by_content
class Tracked(NamedTuple):
    """Result of one control cycle.

    ``q (7,)`` rad; ``velocity (7,)`` rad/s, ``(q - q before) / dt``, with which a position controller tracks
    far better; ``status`` a `Tracking`: FOLLOWING, LAGGING, NEAREST, HELD, TURNING or RETURNING (see there);
    ``distance`` of the end effector from the target, m, ``sqrt(|dp|² + (length·angle)²)``. The target is the
    output of the `HandFilter` if there is one (`HandFilter.smooth`). ``gap`` by which the target's wrist is
    outside joint 4's reach, m; ``psi`` rad in (-π, π]; ``gc`` 0..7. ``why`` is a `Status`: why the end
    effector is not at the target, BAD_INPUT if the target or the elbow's target is invalid. ``pair`` are the
    names (obstacle, link) of the blocking pair if ``why`` is CLEARANCE or POSE_BLOCKED, otherwise None.
    """

    q: Floats
    velocity: Floats
    status: Tracking
    distance: float
    gap: float
    psi: float
    gc: int
    why: Status
    pair: tuple[str, str] | None = None

    @property
    def ok(self) -> bool:
        """Whether the end effector follows the target: the status is FOLLOWING."""
        return self.status == Tracking.FOLLOWING


@dataclass(frozen=True)
class HandFilter:
    """Filter for target samples: a critically damped filter, and rejection of outliers.

    Constant velocities are followed without lag, an acceleration a with a lag of about a / omega². If samples
    are rarer than cycles, each of them makes that estimate jump. Its correction is spread over one of their
    periods (25 ms at most), critically damped too, so that no velocity jumps.

    Parameters
    ----------
    omega : float
        Bandwidth, 1/s, > 0; infinite: samples are used unfiltered.
    patience : float
        Time that a jump must last to be accepted, s, >= 0; 0: every sample is accepted.
    jump : float
        A sample further from its prediction is a jump, m, > 0.
    turn : float
        The same for its rotation, rad, > 0.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    >>> HandFilter(omega=30.0).patience
    0.12
    """

    omega: float = 40.0
    patience: float = 0.12
    jump: float = 0.04
    turn: float = 0.35

    def __post_init__(self) -> None:
        """Check that the numbers are in their ranges."""
        as_number("omega", self.omega, 0.0, np.inf, low_open=True)
        as_number("patience", self.patience, 0.0, LONGEST_STEP)
        as_number("jump", self.jump, 0.0, np.inf, low_open=True)
        as_number("turn", self.turn, 0.0, np.inf, low_open=True)

    def smooth(self, poses: ArrayLike, dt: float) -> Floats:
        """Return the target that a `Tracker` with this filter uses at each of the samples (n, 4, 4).

        Parameters
        ----------
        poses : array_like, shape (n, 4, 4)
            One sample a cycle; a sample equal to the one before, or an invalid one, counts as missing. Before
            the first pose the identity is returned.
        dt : float
            Time of a control cycle, s.

        Raises
        ------
        InputError

        Examples
        --------
        >>> HandFilter().smooth(np.repeat(np.eye(4)[None], 3, axis=0), 0.01).shape
        (3, 4, 4)
        """
        samples = many_poses("poses", poses, wanted="(n, 4, 4)")
        out = np.empty_like(samples)
        time = as_seconds(dt)
        _core.smooth_hand(self.omega, self.patience, self.jump, self.turn, samples, time, out)
        return out


_AS_THEY_COME = HandFilter(omega=np.inf, patience=0.0)


class Tracker:
    """Follows a person's hand, a joystick, a camera or a policy: joints in every control cycle.

    Not to be confused with `step`, which rejects poses that it cannot reach exactly. A tracker moves to the
    nearest pose that it can reach, never stops while a better one is reachable, and never jumps. It follows
    the target exactly if it can. If bounds forbid that, the end effector follows as fast as they allow. If
    the wrist is out of reach, it stops at the reach and keeps the orientation. If limits forbid the pose, it
    moves where no small move comes nearer. While the target moves, the branch is constant, except at
    theta_2 = 0 and theta_6 = 0, where two branches meet and the arm passes through.

    Without obstacles the arm reaches a constant target exactly and stays there, from any start and after any
    history, if any branch has a solution within the limits with joint 4 at least 0.05 rad from straight and
    folded. If a target has rested for a second and the arm comes no nearer, the arm moves straight in joint
    space (TURNING) to a solution near in time. It keeps this choice until the target moves. If there is no
    solution, the arm comes to rest as near as was found. For an arm with an offset there are rare
    exceptions. For one with an offset and its own chain, a cycle that looks for another solution takes some
    milliseconds, the others take some 0.1 ms.

    The joints returned satisfy ``|v| <= velocity`` and ``|v - v before| <= acceleration·dt`` with ``v = (q -
    q before) / dt``, and can always brake before their limits. With `jerk` they satisfy ``|a - a before| <=
    jerk·dt`` too, ``a = (v - v before) / dt``, to rounding.

    Set moving obstacles between cycles: ``tracker.scene = ...``.

    A tracker can be copied and pickled while it runs: the copy continues like the original. Trackers of equal
    arms, options and states are equal.

    With obstacles the arm never collides, in cycles and between them: a motion is used only if it *and*
    braking after it are proven to keep the scene's clearance. The elbow moves around obstacles while the end
    effector follows. If the end effector itself is blocked, it slides along as near to the target as it can,
    and ``pair`` names the blocking pair. If the arm is blocked although another configuration of its branch
    reaches the target, it searches a way there: some 600 through a random configuration. It takes the first
    that is proven collision-free (TURNING); if there is none, the status is NEAREST until the target moves.

    Parameters
    ----------
    arm : Arm
        Its `scene` are the obstacles for links and gripper; its `singularity_margin` is the distance from
        theta_2 = 0 and theta_6 = 0 at which the arm angle is chosen if possible.
    dt : float
        Time of a control cycle, s. Values like ms cause a warning, as do velocities and accelerations like
        degrees.
    velocity : array_like, shape (7,), a number, True or None
        Largest joint velocities, rad/s, > 0; True: the arm's own; None: unbounded.
    acceleration : array_like, shape (7,), a number, True or None
        Largest joint accelerations, rad/s², > 0. Arms in the catalogue have none, so the default is a
        cautious 10 rad/s² for every joint.
    jerk : array_like, shape (7,), a number or None
        Largest joint jerks, rad/s³, > 0; None: unbounded. A smaller bound makes the motion smoother and
        later: with a bound below acceleration / 0.1 s an arm takes a tenth of a second to begin to brake.
    filter : HandFilter, optional
        For samples with noise or outliers, or slower than the loop. None: samples are used unfiltered.
    length : float
        Metres that count as one radian when position and rotation are compared, m.
    elbow_margin : float
        Distance of joint 4 from straight while the target moves, rad; at rest it may come within 0.05 rad. It
        bends further, up to 0.8 rad, in time for a target that comes closer faster than joint 4 could follow.
    soft_clearance : float
        Additional distance beyond the scene's clearance that the arm angle keeps if possible, m.
    detours : bool
        Whether the arm may go to another branch for a target at rest, and search a way around obstacles, with
        the status TURNING. It moves as fast as the bounds allow, and the end effector may go far from the
        target. False: a target at rest is reached if the branch in which the arm was when the target came to
        rest has a solution; otherwise the arm stays as near as it comes, except for `reconfigure`.

    Raises
    ------
    InputError, SceneError

    Examples
    --------
    >>> arm = Arm.from_catalogue("kuka_iiwa14_r820")
    >>> tracker = Tracker(arm, dt=0.004)
    >>> _ = tracker.start([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    >>> pose = arm.forward(tracker.q)[0].copy()
    >>> pose[2, 3] += 0.01
    >>> for _ in range(100):
    ...     now = tracker.step(pose)
    >>> now.status.name
    'FOLLOWING'
    """

    _leader: Ready | None = None  # the scene, prepared for the arm beside the true one

    @names_keywords(None, _KEYWORDS)
    def __init__(
        self,
        arm: Arm,
        dt: float = 0.004,
        velocity: Bound = True,
        acceleration: Bound = 10.0,
        filter: HandFilter | None = None,
        *,
        jerk: ArrayLike | None = None,
        length: float = 0.2,
        elbow_margin: float = 0.35,
        soft_clearance: float = 0.02,
        detours: bool = True,
    ) -> None:
        """Check the numbers and create the control loop; it begins with `start`."""
        check_arm(arm)
        if filter is not None and not isinstance(filter, HandFilter):
            raise InputError(f"filter is {filter!r:.50}, wanted a HandFilter or None")
        hand = filter or _AS_THEY_COME
        still = 0.05
        numbers = [
            as_seconds(dt),
            as_number("length", length, 0.0, _LONGEST, low_open=True),
            still,
            as_number("elbow_margin", elbow_margin, still, _MOST_MARGIN),
            arm.singularity_margin,
            hand.omega,
            hand.patience,
            hand.jump,
            hand.turn,
            as_number("soft_clearance", soft_clearance, 0.0, _MOST_CLEARANCE),
            float(as_flag("detours", detours)),
        ]
        fastest = joint_bound(arm, "velocity", _each("velocity", velocity), arm.velocity)
        hardest = joint_bound(arm, "acceleration", _each("acceleration", acceleration), arm.acceleration)
        sharpest = np.full(JOINTS, np.inf) if jerk is None else positive("jerk", jerk)
        given = np.concatenate([numbers, fastest, hardest, sharpest])
        self._make(arm, given)

    def _make(self, arm: Arm, given: Floats) -> None:
        """Create the control loop for an arm from checked numbers."""
        ready = arm._ready
        self._name_pair = None if ready is None else ready.names.pair
        about = None if ready is None else ready.handle
        self._core = tracker_of(arm, given, lambda nominal: self._leading(nominal, arm.scene), about)
        self._arm, self._given = arm, given
        self._dt = float(given[0])
        self._names = Tracked, _TRACKINGS, STATUSES, self._name_pair
        self._started = False

    def _leading(self, nominal: Arm, scene: Scene | None) -> _core.Scene | None:
        """Return the scene prepared for the arm whose tracker leads that of another kind, or None."""
        if scene is None:
            return None
        self._leader = make_ready(nominal, scene, self._leader)
        return self._leader.handle

    @property
    def arm(self) -> Arm:
        """The controlled arm."""
        return self._arm

    @property
    def scene(self) -> Scene | None:
        """The obstacles for links and gripper; may be set while the tracker runs, for moving obstacles.

        Each cycle, and braking after it, is proven collision-free with the present scene; an arm at rest
        gives way. The future motion of obstacles is unknown: increase the clearance by their possible motion
        while the arm brakes. Links nearer than the clearance are no error. They move away, at about 5 cm/s,
        without any pair coming nearer (RETURNING), or stay if they are too deep for that.
        """
        return self._arm.scene

    @scene.setter
    def scene(self, scene: Scene | None) -> None:
        if scene == self._arm.scene:
            return
        arm, started, saved = self._arm.with_(scene=scene), self._started, self._saved()
        self._make(arm, self._given)
        self._core.restore(saved)
        self._core.look_again()
        self._started = started

    @property
    def dt(self) -> float:
        """Time of a control cycle, s."""
        return self._dt

    @property
    def q(self) -> Floats:
        """The present joints (7,), rad; raise before `start`."""
        self._check_started()
        return np.array(self._core.q)

    def start(self, q: ArrayLike, *, outside: Literal["refuse", "escape"] = "refuse") -> Tracker:
        """Start at rest at the joints `q` (7,), rad.

        Joints outside their limits move back within the bounds on velocity and acceleration; until then the
        status of a cycle is RETURNING. Nothing jumps.

        Parameters
        ----------
        q : array_like, shape (7,)
        outside : "refuse" or "escape"
            If links are nearer to obstacles than the clearance of the scene: raise before any motion; or move
            them away slowly, without any pair coming nearer, with the status RETURNING.

        Returns
        -------
        Tracker
            Itself, so that ``Tracker(arm, dt=0.01).start(q).step(pose)`` is one control cycle.

        Raises
        ------
        InputError
            Also if a joint is more than a turn outside its limits.
        SceneError
            If links collide, or, with "escape", are too deep for a known way out.
        """
        chosen("outside", outside, ("refuse", "escape"))
        joints = one_posture("q", q, self._arm._handle)
        self._core.start(joints)
        self._started = False
        self._check_clear(escaping=outside == "escape")
        self._started = True
        return self

    def _check_clear(self, escaping: bool) -> None:
        """Raise if the start is in collision, or with `escaping` if it is too deep in one to leave it."""
        if self._name_pair is None:
            return
        room, core, number = self._core.nearest_pair(0.0)
        if room >= 0 or (escaping and core > 0):
            return
        obstacle, link = cast(tuple[str, str], self._name_pair(number))
        wanted = "joints at which nothing touches" + ("" if core > 0 else ", or not so deep")
        raise SceneError(
            "Tracker.start", "q", np.array(self._core.q).round(6).tolist(),
            f"{wanted}: {link!r} is {-room:.4g} m nearer to {obstacle!r} than the clearance",
        )  # fmt: skip

    def _check_started(self) -> None:
        """Raise unless `start` was called."""
        if not self._started:
            raise InputError("the tracker has not begun: call start(q) first, with the joints where they are")

    def step(
        self,
        pose: ArrayLike | None,
        elbow: ArrayLike | None = None,
        *,
        elbow_direction: Direction | None = None,
        dt: float | None = None,
        reconfigure: int | None = None,
    ) -> Tracked:
        """Return the joints of the next cycle. Neither geometry nor invalid samples raise.

        Parameters
        ----------
        pose : array_like, shape (4, 4), or None
            The target: pose of the end effector, position in m. None, NaN, or a matrix that is not a rigid
            transform count as a missing sample.
        elbow : array_like, shape (3,), optional
            A point, m, that the elbow should be near: for example a tracker on the operator's elbow. Its
            weight falls towards the line from shoulder to wrist. With NaN it counts as missing, and ``why``
            of the cycle is BAD_INPUT.
        elbow_direction : array_like, shape (3,), or a word, optional
            Instead of `elbow`: a direction in the frame that poses are given in, of any length, or "up",
            "down", "left", "right", "forward", "back". Its weight falls towards the line from shoulder to
            wrist. NaN and zeros count as for `elbow`.
        dt : float, optional
            Time of this cycle, s, if different from the others.
        reconfigure : int, optional
            Branch 0..7 to go to from this cycle on, through configurations off the target. A branch that
            cannot reach the target, or not as nearly as the arm's own, is rejected: the arm stays, and
            ``why`` of this cycle is LIMITS. The same happens if the target moves out of its reach on the way.

        Returns
        -------
        Tracked

        Raises
        ------
        InputError

        Examples
        --------
        >>> arm = Arm.from_catalogue("kuka_iiwa14_r820")
        >>> tracker = Tracker(arm)
        >>> _ = tracker.start([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
        >>> far = arm.forward(tracker.q)[0].copy()
        >>> far[0, 3] += 5.0
        >>> tracker.step(far).why.name
        'UNREACHABLE'
        """
        self._check_started()
        plain: Tracked | None
        if elbow is elbow_direction is dt is reconfigure is None:
            plain = self._core.step_hand(pose, self._names)
            if plain is not None:
                return plain
        time = self._dt if dt is None else as_seconds(dt)
        branch = -1 if reconfigure is None else one_branch("reconfigure", reconfigure)
        hint, wish = _hint(elbow, elbow_direction)
        plain = self._core.step_one(pose, self._names, hint, wish, time, branch)
        if plain is not None:
            return plain
        frame = None if pose is None else np.ascontiguousarray(as_poses("pose", pose))
        if frame is not None and frame.ndim != 2:
            raise InputError(f"pose has shape {frame.shape}, wanted (4, 4); run takes sequences")
        if hint is not None:
            name = "elbow" if wish == Wish.POINT else "elbow_direction"
            hint = np.ascontiguousarray(as_floats(name, hint, (_POINT,)))
            if hint.ndim != 1:
                raise InputError(f"{name} has shape {hint.shape}, wanted (3,)")
        converted: Tracked = self._core.step_one(frame, self._names, hint, wish, time, branch)
        return converted

    def run(self, poses: ArrayLike, *, progress: Progress | bool | None = None) -> Floats:
        """Return the joints (n, 7), rad, of a cycle for each of the poses (n, 4, 4): a whole stream.

        ``progress`` is called some times a second as (done, total); True draws a bar. A run ended by Ctrl-C
        leaves the tracker unchanged.

        Raises
        ------
        InputError

        Examples
        --------
        >>> arm = Arm.from_catalogue("kuka_iiwa14_r820")
        >>> tracker = Tracker(arm)
        >>> _ = tracker.start([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
        >>> tracker.run(np.repeat(arm.forward(tracker.q)[0][None], 5, axis=0)).shape
        (5, 7)
        """
        self._check_started()
        stream = many_poses("poses", poses, wanted="(n, 4, 4)")
        out = np.empty((len(stream), JOINTS))
        with progressing(as_progress(progress)):
            self._core.run(stream, out)
        return out

    def _saved(self) -> Floats:
        """Return the numbers that one cycle passes to the next."""
        out = np.empty(self._core.saved_size)
        self._core.save(out)
        return out

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (type(self), self._arm, self._given, self._started, self._saved())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Tracker):
            return NotImplemented
        return (
            (type(self), self._started) == (type(other), other._started)
            and self._arm == other._arm
            and np.array_equal(self._given, other._given)
            and np.array_equal(self._saved(), other._saved(), equal_nan=True)
        )

    __hash__ = None  # type: ignore[assignment]  # it changes with every cycle

    def __repr__(self) -> str:
        return f"<Tracker of {self._arm.name or 'an arm'}, dt = {self._dt:g} s>"


def _rebuilt(kind: type[Tracker], arm: Arm, given: Floats, started: bool, saved: Floats) -> Tracker:
    """Return the tracker of a copy or a pickle, with the saved numbers."""
    tracker = kind.__new__(kind)
    tracker._make(arm, given)
    tracker._core.restore(saved)
    tracker._started = started
    return tracker


def _each(name: str, bound: Bound) -> Bound:
    """Return one number as seven; other bounds are unchanged."""
    if bound is None or isinstance(bound, bool) or np.ndim(bound) != 0:
        return bound
    return np.full(JOINTS, as_floats(name, bound))


def _hint(elbow: ArrayLike | None, direction: Direction | None) -> tuple[ArrayLike | None, Wish]:
    """Return the target of the elbow, and its kind: a point (m; None without a target) or a direction."""
    if direction is None:
        return elbow, Wish.POINT
    if elbow is not None:
        raise InputError("elbow and elbow_direction are given, wanted one of them or none")
    if isinstance(direction, str):
        return DIRECTIONS[chosen("elbow_direction", direction, DIRECTIONS)], Wish.DIRECTION
    return direction, Wish.DIRECTION
