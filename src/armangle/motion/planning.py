"""Plans of whole paths: a certified motion, or the reason why there is none."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import (
    JOINTS,
    Floats,
    as_floats,
    as_number,
    as_poses,
    hint_degrees,
    one_posture,
)
from .._core import ANGLE_TOLERANCE, LARGEST_ANGLE, PLAN_WORK, PROOF_WORK, Wish
from .._progress import Progress, as_progress, in_parts, part, progressing
from .._threads import thread_count
from ..arm.allowed import Allowed, one_allowed
from ..arm.arcs import ArcSet
from ..arm.arm import MOST_MARGIN, Arm, check_arm
from ..arm.diagnosis import ARM_ANGLE, Branch, Diagnosis, Verdict, branch_of
from ..arm.joint_map import to_q
from ..arm.keywords import names_keywords
from ..arm.question import branch_bits
from ..arm.roll import Roll, last_margin
from ..errors import InputError, SceneError
from ..scenes.moving import ready_each, scenes_at
from ..scenes.ready import Ready
from ..scenes.scene import Scene, no_scene
from ..status import Status
from .curves import Curve
from .joint_path import ROW_STEP, JointPath, blank_rows, even_parameters, rows_between
from .kinds import check_plan, planned_arm
from .options import free_roll, positive
from .paths import Path, Waypoints, as_path, sample_count
from .policies import Towards
from .rolling import Rating, best_planned, is_laddered, rate

START_GAP = 0.05
HELD = 1e-6  # m: largest deviation of the end effector between rows of a certified plan
_MOST_WEIGHT = 1e6
_STANDS_FOR, _MOST_PARTS = 0.002, 256  # m that an obstacle moves in its part of a path; parts
_FASTEST = 1e3  # m
_WISHES = 1025  # samples of a function of s


@dataclass(frozen=True)
class Objective:
    """The weights of a plan: a sum of integrals along the path, s from 0 to 1; smaller is better.

    A weight multiplies its term and nothing else, so more weight never makes the term larger at the optimum.
    Margins scale with the angle by which the path turns the arm (ℓ, rad): by ℓ² if that is more than 1, by (2
    ℓ)² if that is less, otherwise by 1. So a long path is weighed like its parts, and a short one is no
    reason to swing away from a limit.

    Parameters
    ----------
    limits, singularities : float
        Weights, >= 0, of (0.2 / d - 0.2 / enough)² for every distance d (rad) to a joint limit or to a
        singularity (θ2, θ6 at 0 or π) below `enough`. Joint 4's are left out, because they depend on the
        path, not on the arm angle. Limits hold for every weight.
    travel : float
        Weight, >= 0, of Σ (dq/ds)²: even joint motion without detours.
    enough : float
        Distance beyond which margins cost nothing, rad; 0 ignores margins.
    psi : float
        Weight, >= 0, of 2 - 2 cos(ψ - ψ target): the distance of the arm angle from its target, if there is
        one. Times ℓ², at least 1: also over a short path the arm moves to its target.
    duration : float
        Weight, >= 0, of the time (s) that joint velocities need: at each s the largest of all joints, as the
        norm of order 8 of |dq/ds| / u over the joints. u is the arm's velocity, or √(a ℓ) if less: the speed
        that an acceleration a reaches over the ℓ rad by which the path turns the arm. Times ℓ, so that a path
        is weighed like its parts. A plan of weight 0, and plans whose travel weighs at least 0.1 and 1 times
        this weight, are made too. The result is the one that velocities and accelerations let pass fastest:
        it is never slower than the plan of weight 0. Jerk is ignored. `retime` returns the actual time.
    acceleration : float, array_like of shape (7,), optional
        Joint accelerations of `duration`, rad/s², > 0: those later given to `retime`. None: the arm's own;
        arms in the catalogue have none, and then velocities alone count.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    limits: float = 1.0
    singularities: float = 1.0
    travel: float = 1.0
    enough: float = 0.35
    psi: float = 1.0
    duration: float = 0.0
    acceleration: ArrayLike | None = None

    def __post_init__(self) -> None:
        for name in ("limits", "singularities", "travel", "psi", "duration"):
            as_number(name, getattr(self, name), 0.0, _MOST_WEIGHT)
        as_number("enough (rad)", self.enough, 0.0, MOST_MARGIN)
        if self.acceleration is not None:
            hardest = positive("acceleration", self.acceleration)
            one = np.ndim(self.acceleration) == 0
            object.__setattr__(self, "acceleration", float(hardest[0]) if one else tuple(hardest.tolist()))


_DEFAULT_OBJECTIVE = Objective()
_START = "start= are the joints that it begins with"
_TIMES = "retime(path, velocity=, acceleration=) gives it times; Objective(duration=) weighs them"
_KEYWORDS = {
    "policy": "psi= is a wish for the arm angle, and objective= weighs it; follow(poses, policy=) does",
    "seed": _START,
    "q0": _START,
    "dt": "samples= is the number of rows; retime(path, sample=) gives them times",
    "velocity": _TIMES,
    "acceleration": _TIMES,
    "lookahead": "it sees the whole path; follow(lookahead=) sees some poses ahead",
    "max_joint_step": f"without samples= rows are added where a joint would move more than {ROW_STEP} rad",
}


@names_keywords(None, _KEYWORDS)
def plan(
    arm: Arm,
    path: Path | Sequence[Path] | ArrayLike,
    *,
    blend: ArrayLike = 0.0,
    start: ArrayLike | None = None,
    goal: ArrayLike | None = None,
    gc: int | Iterable[int] | None = None,
    psi: ArrayLike | Callable[[Floats], ArrayLike] | Towards | None = None,
    objective: Objective = _DEFAULT_OBJECTIVE,
    samples: int | None = None,
    limit_margin: float = 0.0,
    allowed: Allowed | None = None,
    scene: Callable[[float], Scene] | None = None,
    obstacle_speed: float | None = None,
    roll: Roll = "pose",
    progress: Progress | bool | None = None,
) -> JointPath:
    """Return a motion along the whole path, certified between its rows; or the reason for none.

    Not to be confused with `follow`, which moves from pose to pose and may run into dead ends.

    The end effector stays exactly on the path, to rounding. The plan chooses the arm angle, the branch and
    turns, and the roll if it is free. Only `blend` leaves the path, at its corners.

    For each global configuration the exact feasible arcs at adaptively chosen s form a tube, and a search
    finds the best path through it. From that, and from constant arm angles, a twice differentiable arm angle
    descends to an optimum of the objective. The best global configuration is proven by interval arithmetic.
    ``certified`` means that the limits (and the requested margins) hold and the motion is collision-free on
    all of [0, 1], not at the rows alone. For an arm with its own chain the arm angle is that of the nominal
    arm's plan; joints, derivatives and certificate are those of the true chain.

    For an arm with an offset wrist or shoulder the free joint takes the place of the arm angle, in ``psi=``
    and in the result. The search uses a grid of each feasible interval; its best path descends to an optimum
    and is proven in the same way. The path stays in one global configuration.

    Parameters
    ----------
    arm : Arm
    path : Line, CircularArc, Screw, Waypoints, a list of them, or array_like of shape (N, 4, 4)
        Path of the end effector; positions in m. Poses are `Waypoints`, a list is `Segments`.
    blend : float, or array_like of shape (corners,)
        Rounding of the path's corners, from this far before to this far after them, m: position and rotation
        become twice differentiable. One for all, or one for each, 0 for an exact corner, as at a pick.
        ``deviation`` of the result is the largest deviation from the path, or from a corner.
    start, goal : array_like, shape (7,), optional
        Joints at s = 0 and s = 1, rad. They fix the global configuration, the arm angle and the turns there;
        without them the best are chosen. They must belong to the path's first and last pose, within 0.05 rad:
        the row there is the nearest solution of that pose.
    gc : int or iterable of int, optional
        Global configurations to consider; all by default.
    psi : float, array_like of shape (n,), function or Towards, optional
        Target for the arm angle, rad: one for the whole path; n of them at equal steps of s from 0 to 1,
        linear between; a function of s that takes an array; or a `Towards`, of which only the target counts.
        The plan comes as near as `objective` weighs it.
    objective : Objective
    samples : int, optional
        Rows of the result, at equal steps of s, 2 to 10^7. By default the rows are at exactly the given poses
        (`JointPath.finer` inserts more), or 200 for any other path and if corners are rounded: then more are
        inserted where a joint would move more than 0.2 rad between two.
    limit_margin : float
        Distance to every finite joint limit, rad.
    allowed : ArcSet of shape (), or function (4, 4) -> ArcSet, optional
        Arcs of psi given by the user. A set is the same for the whole path, and ``certified`` covers it. A
        function of the pose is called wherever the search looks: nothing is known between.
    scene : function s -> Scene, optional
        Moving obstacles instead of the arm's own: their places at s in [0, 1]. It needs `obstacle_speed`, and
        the obstacles must have the same names at every s. If the whole path can keep a scene's ``soft`` too,
        it does; otherwise the plan uses ``clearance`` alone.
    obstacle_speed : float, optional
        Largest motion of any point of an obstacle, m per unit of s (its distance over the whole path, if
        even), >= 0. With it ``certified`` covers all s of a moving scene: the path is cut into equal parts,
        and the obstacles at the middle of each represent it. The clearance grows by their possible motion, by
        2 mm or less if 256 parts suffice.
    roll : "pose" or "free"
        "free": joint 7 keeps its value in `start` (or `goal`), or else the middle of its limits, and poses
        have any roll about axis 7: drills, welding torches, suction cups. No roll is tried, because joints 1
        to 6 do not depend on it. ``certified`` covers them, and ``poses`` and `JointPath.at` give the poses
        reached. If the tool's z axis is not axis 7, or the arm has an offset, rolls are tried: 72 constant
        turns about it; if no search leads along one, turns that grow linearly along the path. With `start` or
        `goal` the roll there is theirs, and 73 equally spaced rates up to half a turn are tried. Searches
        rate them until at most 3/4 of the request's budget of work is spent; then they are planned in the
        order of cost, up to the first that no other can undercut. Rolls between are not tried. If no roll is
        feasible, the diagnosis is that of the one that comes furthest.
    progress : function (done, total), or bool, optional
        Called some times a second with the number of finished thousandths: branches searched, choices proven,
        rolls tried; True: a bar on stderr.

    Returns
    -------
    JointPath
        Geometry never raises: ``ok``, ``certified``, ``uncertified``, ``diagnosis`` describe the result.

    Raises
    ------
    InputError
        If a number is out of range, or `start` (`goal`) belongs to another pose. With ``roll="free"`` about
        axis 7: if start and goal have different values of joint 7. If the objective weighs duration without
        any bound: neither the arm nor the objective has one.
    SceneError
        If the arm has no collision model, or the scene names an unknown link.
    UnsupportedError
        For a nearly S-R-S arm on its own chain if obstacles move.

    Source: Faria et al. (2018), Eqs. (12)-(35), over a whole path.
    """
    check_arm(arm)
    with in_parts(as_progress(progress)) as tell:
        whole = as_path(path, blend)
        if whole is None:
            frames = as_poses("path", cast("ArrayLike", path), arm._handle)
            if frames.ndim != 3:
                raise InputError(f"path has shape {frames.shape}, wanted a Path, or poses (N, 4, 4)")
            if len(frames) == 0:
                return _empty(arm)
            points = Waypoints(frames)
            whole = as_path(points, blend) or points
        if not isinstance(objective, Objective):
            raise InputError(f"objective is {objective!r:.100}, wanted an Objective")
        check_plan(arm, scene)
        rows = _rows(whole, samples)
        kept = _limit_margin(arm, limit_margin)
        first = None if start is None else one_posture("start", start, arm._handle)
        last = None if goal is None else one_posture("goal", goal, arm._handle)
        arm._handle.check_poses(whole.pose(rows), "path")
        laddered = is_laddered(arm, roll) or (roll == "free" and arm.redundancy != ARM_ANGLE)
        kept_roll: Roll = "pose" if laddered else roll
        standing, more = _standing(arm.scene, scene, obstacle_speed)
        planned_for = planned_arm(arm)
        along = ready_each(planned_for, _kept_off(standing, more))
        handle, last_joint = _with_roll(arm, kept_roll, first, last, scene or arm.scene, kept)
        request = _Request(
            arm=arm, handle=handle, rows=rows, dense=samples is None and not isinstance(whole, Waypoints),
            ends=(first, last), branches=branch_bits(gc), weights=_weights(arm, objective), kept=kept,
            wished=_wished(psi), allowed=allowed, along=along,
            calm=ready_each(planned_for, _kept_off(standing, more, soft=True)), moving=scene,
            truth=arm._needed(arm.scene).handle if planned_for is not arm and along else None,
            roll=kept_roll, last_joint=last_joint,
        )  # fmt: skip
        if laddered:
            return best_planned(arm, whole, first, last, request, tell)
        return request.planned(whole, tell)


@dataclass
class _Request:
    """A checked request: what all its plans share, and the work that they may still take."""

    arm: Arm
    handle: Any
    rows: Floats
    dense: bool  # rows are added between those
    ends: tuple[Floats | None, Floats | None]
    branches: int
    weights: Floats
    kept: float
    wished: tuple[Wish, Floats | None]
    allowed: Allowed | None
    along: list[Ready]
    calm: list[Ready]  # with the soft clearance too; empty if there is none
    moving: Callable[[float], Scene] | None
    truth: Any
    roll: Roll
    last_joint: float
    work: int = PLAN_WORK

    @property
    def spent(self) -> bool:
        """Whether the searches of its plans have taken all their work."""
        return self.work <= PROOF_WORK

    def _ask(
        self, path: Path, along: list[Ready], ends: tuple[Floats | None, Floats | None], tell: Progress,
        leave: int = 0, rate_only: bool = False,
    ) -> Any:  # fmt: skip
        """Return the core's plan of a path for these scenes and ends, which leaves this much work."""
        with progressing(tell):
            found = self.handle.plan_path(
                path._segments, self.rows, *ends, self.branches, self.weights, self.arm.singularity_margin,
                self.kept, *self.wished, [each.handle for each in along], *_asked(self.allowed, path),
                self.last_joint, self.truth, thread_count(0), self.work - leave, rate_only,
            )  # fmt: skip
        self.work = found[8] + leave
        return found

    def rated(self, path: Path, tell: Progress) -> Rating | None:
        """Return the rating of a path; None if only a quarter of the work is left, which is for plans."""
        kept = PLAN_WORK // 4
        if self.work <= kept:
            return None
        found = self._ask(path, self.along, self.ends, tell, kept - PROOF_WORK, rate_only=True)
        return rate(self._branches(found[7]))

    def _branches(self, reports: list[Any]) -> tuple[Branch, ...]:
        """Return what the core reports of the branches."""
        ready = self.along[0] if self.along else None
        return tuple(branch_of(report, ready, self.arm.redundancy) for report in reports)

    def planned(self, path: Path, tell: Progress) -> JointPath:
        """Return the plan of a path, within the work that is left."""
        arm, ends = self.arm, self.ends
        for k, along in enumerate(scenes := [self.calm, self.along] if self.calm else [self.along]):
            leave = self.work // 2 if k + 1 < len(scenes) else 0
            found = self._ask(path, along, ends, part(tell, k, len(scenes)), leave)
            if found[0] and len(found[4]) == 0:
                break
        for taken in (_taken, _past_straight) if self.roll == "pose" else ():
            if self.spent or (found[0] and max(found[5], found[6]) <= START_GAP):
                break
            held = (taken(arm, path.pose(0.0), ends[0]), taken(arm, path.pose(1.0), ends[1]))
            if all(q is each for q, each in zip(ends, held, strict=True)):
                continue
            again = self._ask(path, self.along, held, tell)
            if again[0] or (taken is _taken and max(again[5], again[6]) <= START_GAP):
                found, ends = again, held
        ok, branch, plane, stretches, open_, start_gap, goal_gap, reports, _, *chain = found
        for name, joints, gap in zip(("start", "goal"), ends, (start_gap, goal_gap), strict=True):
            if gap > START_GAP:
                _check_within(arm, name, joints)
                off, most = (f"{angle:.3g} rad ({np.degrees(angle):.3g} deg)" for angle in (gap, START_GAP))
                way = "begin it with a Line from" if name == "start" else "end it with a Line to"
                raise InputError(
                    f"{name} belongs to another pose than the path's: a joint is {off} off, wanted at most "
                    f"{most}; {way} arm.forward({name})[0]"
                )
        branches = self._branches(reports)
        verdicts = (Verdict.START, Verdict.GOAL)
        said = ok or any(branch.status == Status.LIMITS and branch.verdict in verdicts for branch in branches)
        note = "" if said else _outside(arm, start=ends[0], goal=ends[1])
        ended = any(branch.verdict in verdicts and not branch.elsewhere for branch in branches)
        if (
            not (ok or note or self.spent)
            and ended
            and ends[0] is not None
            and ends[1] is not None
            and self._ask(path, self.along, (ends[0], None), tell)[0]
        ):
            note = "A path leads from the start to another solution of the last pose: plan without goal=."
        diagnosis = Diagnosis(branches, note=note)
        curve = Curve(path._segments, stretches, plane, branch, self.roll, *chain) if len(stretches) else None
        rows = self.rows
        if curve is not None and self.dense:
            led = rows <= curve.end
            rows = np.append(rows_between(arm, curve, rows[led], ROW_STEP), rows[~led])
        beside = tuple(scenes_at(self.moving or arm.scene, rows.tolist()))
        return _result(arm, path, rows, curve, diagnosis, ok, open_, beside)


def _taken(arm: Arm, pose: Floats, q: Floats | None) -> Floats | None:
    """Return the solution of a pose nearest to joints q within limits, if at most `START_GAP` away; else q.

    It helps near θ2 = 0 or θ6 = 0, where the arm angle of the joints does not give that pose.
    """
    if q is None or not arm.within_limits(q):
        return q
    nearest = arm.with_(scene=None, singularity_margin=0.0).solve(pose, seed=q)
    away = np.abs(nearest.q - q).max()
    return nearest.q if ANGLE_TOLERANCE < away <= START_GAP else q


def _past_straight(arm: Arm, pose: Floats, q: Floats | None) -> Floats | None:
    """Return the solution of a pose nearest to joints with the elbow on its other side; otherwise the joints.

    Used only if the limits of joint 4 end less than `START_GAP` beyond the stretched arm on this side, so
    that the arm can hardly bend there.
    """
    if q is None:
        return q
    straight = to_q(arm._handle, np.full(JOINTS, arm.geometry.delta))[3]
    if (arm.upper[3] - straight if q[3] > straight else straight - arm.lower[3]) >= START_GAP:
        return q
    own = int(arm.forward(q, on_error="nan")[2])
    others = [gc for gc in range(8) if (gc ^ own) & 2]
    nearest = arm.with_(scene=None, singularity_margin=0.0).solve(pose, seed=q, gc=others)
    return nearest.q if nearest.ok and np.abs(nearest.q - q).max() <= START_GAP else q


def _standing(
    still: Scene | None, scene: Callable[[float], Scene] | None, speed: float | None
) -> tuple[list[Scene], float]:
    """Return the scene at the middle of each equal part of the path, and the largest motion (m) off it; for
    no moving `scene` the arm's own, `still`, if any, and 0.
    """
    if scene is None:
        if speed is not None:
            raise InputError("obstacle_speed is of a scene that moves, and scene is no function of s")
        return scenes_at(still, []), 0.0
    if not callable(scene):
        wanted = "a function of s, with obstacle_speed; obstacles that stand: arm.with_(scene=...)"
        raise no_scene(scene, wanted, "plan")
    if speed is None:
        raise InputError(
            "scene is a function of s, and nothing is known of it between the s asked: nothing could be "
            "certified; give obstacle_speed, the most that a point of an obstacle moves, m per unit of s"
        )
    most = as_number("obstacle_speed (m per unit of s)", speed, 0.0, _FASTEST)
    parts = int(np.clip(np.ceil(most / (2 * _STANDS_FOR)), 1, _MOST_PARTS))
    every = scenes_at(scene, ((np.arange(parts) + 0.5) / parts).tolist())
    for at, each in enumerate(every):
        if each.names != every[0].names:
            raise SceneError(f"scene[{at}]", "names", each.names, f"those of the first, {every[0].names}")
    return every, most / (2 * parts)


def _kept_off(scenes: list[Scene], more: float, *, soft: bool = False) -> list[Scene]:
    """Return scenes with the clearance larger by `more` (m); `soft`: also by their soft clearance.

    If no scene has a soft clearance, there are none for `soft`.
    """
    if soft and not any(each.soft for each in scenes):
        return []
    if not (more or soft):
        return scenes
    return [replace(each, clearance=each.clearance + more + soft * each.soft, soft=0.0) for each in scenes]


def _weights(arm: Arm, objective: Objective) -> Floats:
    """Return for the core the weights of an objective, and the joints' largest velocities, accelerations."""
    of = objective
    hardest = arm.acceleration if of.acceleration is None else np.broadcast_to(of.acceleration, JOINTS)
    bounds = [*arm.velocity, *hardest]
    if of.duration > 0 and not np.isfinite(bounds).any():
        raise InputError(
            "objective weighs duration, and the arm states no velocity or acceleration: "
            "Objective(acceleration=...) or arm.with_(velocity=...)"
        )
    return np.array([of.limits, of.singularities, of.travel, of.enough, of.psi, of.duration, *bounds])


def _with_roll(
    arm: Arm, roll: Roll, start: Floats | None, goal: Floats | None, scene: object, kept: float
) -> tuple[Any, float]:
    """Return the core's arm for planning, and joint 7's fixed value (rad) if the roll is free, else 0.

    Raises if that value is nearer to a limit than `kept` (rad), or start and goal have different ones.
    """
    at_rest = np.clip(0.0, arm.lower, arm.upper)
    bounded = np.isfinite(arm.lower) & np.isfinite(arm.upper)
    at_rest[bounded] = 0.5 * (arm.lower[bounded] + arm.upper[bounded])
    name, joints = next(
        ((name, q) for name, q in (("start", start), ("goal", goal)) if q is not None), ("plan", at_rest)
    )
    handle = free_roll(arm, roll, name, joints, scene)
    if handle is None:
        return arm._handle, 0.0
    apart = 0.0 if start is None or goal is None else abs(float(goal[-1] - start[-1]))
    if apart > START_GAP:
        raise InputError(f"roll is 'free': joint 7 stays, and in start and goal it is {apart:.3g} rad apart")
    room = float(last_margin(arm, joints))
    if room < kept:
        raise InputError(
            f"limit_margin (rad) is {kept:g}, and with a free roll joint 7 of {name} stays {room:.3g} off"
        )
    return handle, float(joints[-1])


def _wished(psi: Any) -> tuple[Wish, Floats | None]:
    """Return the kind of the elbow's target, and its numbers: psi over s (rad), a point (m) or a direction.
    These are None without a target.
    """
    if psi is None:
        return Wish.PSI, None
    if isinstance(psi, str):
        raise InputError(f"psi is {psi!r}, wanted rad, or Towards(direction={psi!r}) for the elbow")
    if isinstance(psi, Towards):
        kind, angle, target = psi._wish
        return kind, np.array([angle]) if kind == Wish.PSI else target
    if callable(psi):
        psi = psi(even_parameters(_WISHES))
        if np.shape(psi) != (_WISHES,):
            raise InputError(f"psi of {_WISHES} s has shape {np.shape(psi)}, wanted ({_WISHES},)")
    angles = np.atleast_1d(as_floats("psi", psi))
    if angles.ndim != 1 or not angles.size:
        raise InputError(f"psi has shape {angles.shape}, wanted one number or (n,)")
    if not np.isfinite(angles).all():
        raise InputError(f"psi holds {angles[~np.isfinite(angles)][0]}, wanted finite numbers")
    hint_degrees("psi", angles)
    if np.abs(angles).max() > LARGEST_ANGLE:
        raise InputError(f"psi holds {np.abs(angles).max():g}, wanted rad within ±{LARGEST_ANGLE:g}")
    return Wish.PSI, np.unwrap(angles)


def _asked(allowed: Allowed | None, path: Path) -> tuple[Any, Any, Any]:
    """Return the allowed arcs for the core: their number and ends (rad) if they are the same all along the
    path; else a function of s.
    """
    if allowed is None:
        return None, None, None
    if isinstance(allowed, ArcSet) or not callable(allowed):
        return (*one_allowed(allowed, np.eye(4)), None)
    return None, None, lambda s: one_allowed(allowed, path.pose(s))


def _result(
    arm: Arm, path: Path, rows: Floats, curve: Curve | None, diagnosis: Diagnosis, ok: bool, open_: Floats,
    scenes: tuple[Scene, ...],
) -> JointPath:  # fmt: skip
    """Return the planned path at s `rows`, empty after the reached s; `open_` are unproven ranges of s.

    If not `ok`, the first empty row has the reason as its status, and all of [0, 1] is unproven.
    """
    n = len(rows)
    columns = blank_rows(n)
    reached = 0
    if curve is not None:
        done = rows <= curve.end
        reached = int(done.sum())
        placed = curve.at(arm._handle, np.ascontiguousarray(rows[done]))
        for name in ("q", "psi", "gc", "margin", "residual"):
            columns[name][done] = getattr(placed, name)
        columns["status"][done] = Status.OK
    if not ok:
        columns["status"][min(reached, n - 1)] = _reason(diagnosis)
    given = isinstance(path, Waypoints) and np.array_equal(rows, even_parameters(len(path)))
    poses = np.array(path.poses if isinstance(path, Waypoints) and given else path.pose(rows))
    if curve is not None and curve.roll == "free":
        poses[done] = placed.pose
    if curve is not None and ok:
        open_ = np.concatenate([open_, _left_between(arm, curve, rows)])
    return JointPath(
        arm=arm, s=rows, poses=poses, **columns, certified=bool(ok) and len(open_) == 0,
        uncertified=open_ if ok else np.array([[0.0, 1.0]]), diagnosis=diagnosis, path=path, curve=curve,
        scenes=scenes,
    )  # fmt: skip


def _left_between(arm: Arm, curve: Curve, rows: Floats) -> Floats:
    """Return ranges (k, 2) of s between rows in which, at a third, the end effector is not at its pose.

    The proof covers limits and obstacles; if θ2 and θ6 are 0 all along, joints may drift between rows.
    """
    within = (2.0 * rows[:-1] + rows[1:]) / 3.0
    off = curve.at(arm._handle, within).residual > HELD
    return np.stack([rows[:-1][off], rows[1:][off]], axis=-1)


def _reason(diagnosis: Diagnosis) -> Status:
    """Return the reason why no path exists: the status of the branch whose path leads furthest."""
    best = max(diagnosis.branches, key=lambda b: (b.reached, b.verdict != Verdict.GOAL))
    return best.status if best.status != Status.OK else Status.LIMITS


def _rows(path: Path, samples: int | None) -> Floats:
    """Return the s of the rows: of the given poses, or equally spaced."""
    if samples is None and isinstance(path, Waypoints):
        return even_parameters(len(path))
    return np.linspace(0.0, 1.0, sample_count(samples))


def _limit_margin(arm: Arm, value: float) -> float:
    """Return the margin to joint limits, rad; raise if it exceeds half of a joint's range."""
    margin = as_number("limit_margin (rad)", value, 0.0, np.pi)
    narrowest = float((arm.upper - arm.lower).min())
    if 2 * margin > narrowest:
        wanted = f"at most {narrowest / 2:.6g}: half of the narrowest range"
        raise InputError(f"limit_margin (rad) is {margin:g}, wanted {wanted}")
    return margin


def _check_within(arm: Arm, name: str, q: Floats | None) -> None:
    """Raise if a joint is more than `START_GAP` outside its limits; None passes.

    Raises
    ------
    InputError
    """
    if q is None:
        return
    beyond = np.maximum(arm.lower - q, q - arm.upper)
    j = int(beyond.argmax())
    if beyond[j] > START_GAP:
        off, low, high = np.degrees([beyond[j], arm.lower[j], arm.upper[j]])
        raise InputError(
            f"{name}: joint {j + 1} is {q[j]:.6g} rad ({np.degrees(q[j]):.6g} deg), {off:.4g} deg outside "
            f"its limits of {low:.6g} to {high:.6g} deg"
        )


def _outside(arm: Arm, **ends: Floats | None) -> str:
    """Return as a sentence which joint of start or goal is outside its limits; "" if none is."""
    for name, q in ends.items():
        if q is None:
            continue
        beyond = np.maximum(arm.lower - q, q - arm.upper)
        j = int(beyond.argmax())
        if beyond[j] > ANGLE_TOLERANCE:
            side, far = "lower" if q[j] < arm.lower[j] else "upper", np.degrees(beyond[j])
            return f"The {name} lies outside the limits: joint {j + 1} is {far:.3g}° beyond its {side} one."
    return ""


def _empty(arm: Arm) -> JointPath:
    """Return the plan of a path without poses."""
    return JointPath(
        arm=arm, s=np.empty(0), poses=np.empty((0, 4, 4)), **blank_rows(0), uncertified=np.empty((0, 2)),
        diagnosis=Diagnosis(()),
    )  # fmt: skip
