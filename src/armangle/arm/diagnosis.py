"""Why a pose or path is rejected: structured findings for each branch, and their sentences."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Literal

from .. import _core
from .._arrays import MILLIMETRES, Floats, frozen, millimetres
from .._values import by_content
from ..scenes.ready import Ready
from ..status import STATUSES, Status
from .solution import Solution

_ANCHOR = "lies where no arm angle gives it; or it is singular, and no path from it was found."

_NOT_NOMINAL = (
    "lies where the nominal arm, which is searched, has no such configuration: branches of the true "
    "chain meet nearby; `follow` may continue from here."
)

ARM_ANGLE = "arm_angle"
"""The free number of an arm that is S-R-S, or nearly so (`Arm.redundancy`)."""
_SEEN = 1e-3  # degrees: a smaller turn is not mentioned


class _Finding(IntEnum):
    """Outcome of one branch (global configuration)."""


if TYPE_CHECKING:
    from .._core import Verdict as Verdict
else:  # the core alone holds names and numbers; pickled as armangle's own
    Verdict = _Finding("Verdict", {verdict.name: verdict.value for verdict in _core.Verdict}, module=__name__)


@dataclass(frozen=True)
class Opening:
    """A joint limit that, widened alone, would leave an arm angle: at a pose, or everywhere on a path.

    Parameters
    ----------
    joint : int
        Joint 1..7.
    side : "lower" or "upper"
        Which of its limits.
    extra : float
        How much it must be widened, rad; for a path about 1 % more than the least.
    """

    joint: int
    side: Literal["lower", "upper"]
    extra: float


_ELSEWHERE = "Plan without start=, and move to where that path begins."


@by_content
@dataclass(frozen=True, eq=False)
class Branch:
    """The findings about one branch.

    Parameters
    ----------
    gc : int
        Global configuration 0..7.
    verdict : Verdict
        OK: there is a path. UNREACHABLE: the wrist is out of reach. IMPOSSIBLE: at some s no arm angle is
        within all limits and collision-free. Both are exact. DEAD_END: every section has arm angles, but the
        search found none that continues the path; this is not proven. START, GOAL: that configuration
        violates limits, is in another branch, collides, or is singular, so that no arm angle gives it; or it
        belongs to a true chain and its nominal arm does not have it (`status` NO_CONVERGENCE). UNRESOLVED:
        the sections connect, but every curve tried through them violates a limit between, or leads through a
        fold (`status` NO_POSTURE), or where branches of an own chain meet and nothing is proven
        (NEAR_SINGULAR); or only the nominal arm of an own chain is proven to have no solution
        (NO_CONVERGENCE); or the search was given up (`given_up`).
    status : Status
        The status of the poses in question.
    s_from, s_to : float
        Range of the path parameter in question; both 0 for a single pose.
    excess : float
        Distance beyond the reach, m, the largest in the range.
    reached : float
        The s up to which a path leads from the start.
    margin : float
        Smallest distance to limits and singularities along its curve, of those that depend on the arm angle,
        rad; NaN without a path. Evaluated densely for the curve returned, at a few places for others.
    elbow_margin : float
        The same for joint 4, which does not depend on the arm angle.
    cost : float
        The `Objective` of its curve; smaller is better. Branches with a path are ranked by it.
    stationarity : float
        The share of the objective that another Newton step would save, 0 at an optimum. For the curve
        returned it is below 1e-8, unless only that one was proven; for others it is less accurate. NaN if
        joint 1 or 5 leads past a singularity: such a curve is chosen by its travel.
    nearest_psi : float
        Where a dead end closes: the feasible arm angle nearest to the last one, rad; otherwise NaN.
    blocking : tuple of int
        Joints 1..7 whose limits together leave no arm angle; without any one of them they would.
    openings : tuple of Opening
        Single limits that would leave one if wider, least first. For START and GOAL: the limits that the
        configuration violates, and by how much.
    touching : tuple of (str, str), or None
        The obstacle and link that block it. For IMPOSSIBLE the pair that is too near at the arm angle with
        the largest distance, on a path at the nearest place of the range. For START and GOAL the nearest pair
        there. For DEAD_END a pair that bounds the arc in which the path ends.
    short : float
        How much nearer than the scene's clearance that pair is, m: the largest of some places in the range.
        NaN if it does not depend on the arm angle.
    sections : int
        Number of places on the path at which feasible arcs were computed.
    given_up : bool
        For UNRESOLVED: whether the search reached the limit of work for one plan.
    through : tuple of int
        Other global configurations that the path, or the path to a DEAD_END, uses. It crosses at θ2 = 0 or θ6
        = 0, where two branches coincide. The margins are then those to limits alone.
    turns : tuple of (int, float)
        For START and GOAL, and for a DEAD_END soon after, with θ2 and θ6 both at 0 or π within 0.001 rad,
        where the end effector can move in some directions alone. Entries are joint 1 and joint 5, each with
        the angle that it must turn alone before the end effector moves, rad, while joint 3 (7) turns back as
        far. Only turns within the limits are listed. The end effector is at rest meanwhile.
    elsewhere : bool
        Whether the start, or the goal, is in another branch: then this finding is not the reason for a
        missing path.
    scene : bool
        Whether obstacles were considered, so that possible arm angles are also collision-free.
    path : bool
        Whether it concerns a path, or one pose.
    redundancy : str
        Which number is free, as `Arm.redundancy`. For an arm with an offset wrist or shoulder the value of a
        joint takes the place of the arm angle in all these findings.
    """

    gc: int
    verdict: Verdict
    status: Status = Status.OK
    s_from: float = 0.0
    s_to: float = 0.0
    excess: float = 0.0
    reached: float = 0.0
    margin: float = math.nan
    elbow_margin: float = math.nan
    cost: float = math.nan
    stationarity: float = math.nan
    nearest_psi: float = math.nan
    blocking: tuple[int, ...] = ()
    openings: tuple[Opening, ...] = ()
    touching: tuple[str, str] | None = None
    short: float = math.nan
    sections: int = 0
    given_up: bool = False
    through: tuple[int, ...] = ()
    turns: tuple[tuple[int, float], ...] = ()
    elsewhere: bool = False
    scene: bool = False
    path: bool = True
    redundancy: str = ARM_ANGLE

    @property
    def ok(self) -> bool:
        """Whether there is a path, or for one pose a solution, in this branch."""
        return self.verdict == Verdict.OK

    def explain(self) -> str:
        """Return in words whether there is a path, or a solution of one pose, and if not, why."""
        where = ""
        if self.path and self.verdict not in (Verdict.OK, Verdict.START, Verdict.GOAL):
            where = f" from s = {self.s_from:.4g} to {self.s_to:.4g}"
        said = self._sentence(where)
        if self.redundancy != ARM_ANGLE:
            joint = self.redundancy.replace("_", " ")
            said = said.replace("arm angles", f"values of {joint}").replace("arm angle", f"value of {joint}")
        return f"GC {self.gc}: {said}"

    def _sentence(self, where: str) -> str:
        """Return the finding in words; `where` is the part of the path, "" at a pose."""
        match self.verdict:
            case Verdict.OK:
                if not self.path:
                    return f"solved within all limits{' and collision-free' if self.scene else ''}."
                least = max(math.degrees(min(self.margin, self.elbow_margin)), 0.0)
                if self.through:
                    others = ", ".join(map(str, self.through))
                    way = f"the whole path is possible, passing through GC {others}"
                    return f"{way}, {least:.3g}° from the nearest limit."
                return f"the whole path is possible, {least:.3g}° from the nearest limit or singularity."
            case Verdict.UNREACHABLE:
                if self.status == Status.FOLDED:
                    return f"the wrist lies on the shoulder{where}; no arm angle is defined there."
                return f"the wrist is out of reach{where}, by up to {millimetres(self.excess)}."
            case Verdict.IMPOSSIBLE if self.status in (Status.CLEARANCE, Status.POSE_BLOCKED):
                return self._blocked(where)
            case Verdict.IMPOSSIBLE if self.status == Status.NOT_ALLOWED:
                return f"no arm angle within allowed= is feasible{where}."
            case Verdict.IMPOSSIBLE if self.status == Status.NO_POSTURE:
                return f"the wrist is within reach{where}, but no value of the free joint gives a solution."
            case Verdict.IMPOSSIBLE:
                return f"no arm angle keeps all limits{where}: {self._why()}"
            case Verdict.DEAD_END if self.turns:
                return f"the start {self._shut('leave only after it turns')}"
            case Verdict.DEAD_END:
                ahead = f"a dead end at s = {self.s_from:.4g}"
                if self.touching is not None:
                    ahead = f"{ahead}, because {self.touching[1]} is too near to {self.touching[0]}"
                if self.through:
                    ahead = f"{ahead}, after a change to GC {', '.join(map(str, self.through))}"
                otherwise = "" if self.s_from > 0 else f" {_ELSEWHERE}"
                return f"{ahead}: from this start the search found no way on.{otherwise}"
            case Verdict.START if self.turns:
                return f"the start {self._shut('leave only after it turns')} {_ELSEWHERE}"
            case Verdict.GOAL if self.turns:
                otherwise = "Plan without goal=, and turn the joints at the end."
                return f"the goal {self._shut('arrive only before it turns')} {otherwise}"
            case Verdict.START:
                return f"the start {self._anchor()}"
            case Verdict.GOAL:
                return f"the goal {self._anchor()}"
            case Verdict.UNRESOLVED if self.given_up:
                return (
                    f"the search was stopped, so nothing is proven: {self.sections} sections were searched, "
                    f"from the start as far as s = {self.reached:.4g}."
                )
            case Verdict.UNRESOLVED if not self.path:
                return STATUSES[self.status].sentence
            case Verdict.UNRESOLVED if self.status == Status.NEAR_SINGULAR:
                return (
                    f"every tested curve enters a region where branches of the arm's own chain meet{where}."
                )
            case Verdict.UNRESOLVED if self.status == Status.NO_CONVERGENCE:
                return f"only the nominal arm, which is searched, is proven to have no solution{where}."
            case Verdict.UNRESOLVED if self.status == Status.NO_POSTURE:
                return f"every tested curve leads through a fold, where there is no solution{where}."
            case Verdict.UNRESOLVED:
                broken = "collides or violates" if self.status == Status.CLEARANCE else "violates"
                return f"every tested curve {broken} a limit between the samples{where}."

    def _anchor(self) -> str:
        """Return in words why the start or the goal of a path is not in this branch."""
        if self.elsewhere:
            return "belongs to another global configuration."
        if self.status == Status.NOT_ALLOWED:
            return "lies outside allowed=."
        if self.status == Status.NEAR_SINGULAR:
            return "lies nearer to a singularity than the requested margin."
        if self.status == Status.NO_CONVERGENCE:
            return _NOT_NOMINAL
        if self.status == Status.JOINT_JUMP:
            return "has a joint a whole turn from where the path arrives."
        if self.status == Status.LIMITS and self.openings:
            return f"lies outside the limits, {self._beyond()}."
        if self.touching is None:
            return _ANCHOR
        obstacle, link = self.touching
        if math.isnan(self.short):
            return f"is blocked: {link} collides with {obstacle}."
        return f"is blocked: {link} is {self.short * MILLIMETRES:.3g} mm too near to {obstacle}."

    def _shut(self, way: str) -> str:
        """Return in words the turns at rest that a path through θ2 = θ6 = 0 requires; `way` is the verb."""
        turns = ", or ".join(
            f"joint {joint} by {math.degrees(turn):.3g}° (and joint {joint + 2} back by as much)"
            for joint, turn in self.turns
        )
        singular = "has a shoulder and a wrist singularity at once (θ2 and θ6)"
        return f"{singular}: along this path the end effector can {way} at rest: {turns}."

    def _beyond(self) -> str:
        """Return in words by how much the start or the goal is outside limits, the largest excess first."""
        worst = sorted(self.openings, key=lambda opening: -opening.extra)
        parts = [f"{math.degrees(o.extra):.3g}° beyond the {o.side} one of joint {o.joint}" for o in worst]
        return ", ".join(parts)

    def _blocked(self, where: str) -> str:
        """Return in words which obstacle or margin forbids every arm angle; `where`: the part of the path."""
        sentence = STATUSES[self.status].sentence
        if self.touching is None:
            return f"{sentence[0].lower()}{sentence[1:-1]}{where}."
        obstacle, link = self.touching
        if self.status == Status.POSE_BLOCKED:
            there = where if self.path else " at this pose"
            return f"{link} collides with {obstacle}{there} at every arm angle."
        up_to = "up to " if self.path else ""
        by = "" if math.isnan(self.short) else f" {up_to}{self.short * MILLIMETRES:.3g} mm"
        return f"within the limits {link} is{by} too near to {obstacle}{where} at every arm angle."

    def _why(self) -> str:
        """Return in words which joint limits or margins leave no arm angle."""
        if self.status in (Status.ELBOW_MARGIN, Status.NO_POSTURE, Status.NEAR_SINGULAR):
            return STATUSES[self.status].sentence
        names = " and ".join(map(str, self.blocking))
        alone = len(self.blocking) == 1
        parts = [f"joint {names} is the reason" if alone else f"joints {names} exclude each other"]
        if not self.blocking:
            parts = ["the joints' feasible arm angles are single values, and no two are equal"]
        parts += [f"{_wider(opening)} would suffice" for opening in self.openings[:2]]
        return "; ".join(parts) + "."


def _wider(opening: Opening) -> str:
    """Return in words by how much a joint limit would have to move to leave a solution."""
    limit = f"the {opening.side} limit of joint {opening.joint}"
    return f"{math.degrees(opening.extra):.3g}° more of {limit}"


@by_content
@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """Findings for each permitted branch: those of a path best first, those of a pose by GC.

    Parameters
    ----------
    branches : tuple of Branch
        One a global configuration.
    path : bool
        Whether it concerns a path, or one pose.
    nearest : ndarray, shape (4, 4), or None
        For one pose: the nearest one of the same orientation within reach, ignoring joint limits; the pose
        itself if it is reachable. Position in m.
    nearest_gap : float
        Distance to it, m; NaN for a path.
    instead : Solution or None
        For one pose that no branch reaches within its limits: ``solve(pose, fallback="nearest_pose")``, the
        configuration of the nearest pose within them, ignoring the scene. None if a branch reaches the pose,
        though a scene may block it, and if the singularity margin permits no configuration at all.
    instead_moved, instead_turned : float
        Distance of its pose from the requested one, m and rad; NaN without it.
    note : str
        Further information on the findings, as a sentence, or "".
    """

    branches: tuple[Branch, ...]
    path: bool = True
    nearest: Floats | None = field(default=None, compare=False)
    nearest_gap: float = field(default=math.nan, compare=False)
    instead: Solution | None = field(default=None, compare=False)
    instead_moved: float = field(default=math.nan, compare=False)
    instead_turned: float = field(default=math.nan, compare=False)
    note: str = ""

    def __post_init__(self) -> None:
        if self.nearest is not None:
            frozen(self.nearest)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.__post_init__()  # the array of a copy is read-only too

    @property
    def ok(self) -> bool:
        """Whether any branch has a path, or for one pose a solution."""
        return any(branch.ok for branch in self.branches)

    @property
    def reached(self) -> float:
        """The s up to which the path can be followed from the start: its longest feasible part."""
        return max((1.0 if branch.ok else branch.reached for branch in self.branches), default=0.0)

    def __repr__(self) -> str:
        return self.explain()

    def __getitem__(self, gc: int) -> Branch:
        for branch in self.branches:
            if branch.gc == gc:
                return branch
        raise KeyError(gc)

    def explain(self) -> str:
        """Return the findings in words, one line a branch, most important first.

        Branches with the same finding share one line; so do branches to which the start or goal does not
        belong. If the same limits block several branches, the line says which wider limit would help in
        which.
        """
        lines: dict[str, list[Branch]] = {}
        others = []
        for branch in sorted(self.branches, key=lambda b: b.elsewhere):
            shut = branch.verdict == Verdict.IMPOSSIBLE
            reason = self._said(replace(branch, openings=()) if shut else branch)
            if branch.elsewhere and reason not in lines and lines:
                others.append(branch.gc)
            else:
                lines.setdefault(reason, []).append(branch)
        head = [f"GC {_numbers(alike)}: {self._line(alike)}" for alike in lines.values()]
        if others:
            which = ", ".join(map(str, others))
            head.append(f"GC {which}: another global configuration than that of the start or goal.")
        if self.path and not self.ok and any(b.verdict == Verdict.UNRESOLVED for b in self.branches):
            head.append(f"A path was found up to s = {self.reached:.4g}; one that leads farther may exist.")
        elif self.path and not self.ok:
            head.append(f"The path can be followed up to s = {self.reached:.4g}.")
        if self.note:
            head.append(self.note)
        return "\n".join([*head, *self._nearest_poses()])

    def _said(self, branch: Branch) -> str:
        """Return a sentence on whether a branch has a path, and if not, why, without the branch's number."""
        return branch.explain().split(": ", 1)[1]

    def _line(self, alike: list[Branch]) -> str:
        """Return the common reason why several branches have no path, and which wider limits help each."""
        if len(set(map(self._said, alike))) == 1:
            return self._said(alike[0])
        least: dict[tuple[int, str], Opening] = {}
        for opening in sorted((o for branch in alike for o in branch.openings), key=lambda o: o.extra):
            least.setdefault((opening.joint, opening.side), opening)
        parts = [self._said(replace(alike[0], openings=()))[:-1]]
        for wider in map(_wider, list(least.values())[:2]):
            where = [branch for branch in alike if wider in map(_wider, branch.openings)]
            parts.append(f"{wider} would suffice in GC {_numbers(where)}")
        return "; ".join(parts) + "."

    def _nearest_poses(self) -> list[str]:
        """Return in words the poses that the arm can reach instead, each one once."""
        out, place = [], "The nearest pose within {} is {} away: x, y, z = {} m{}"

        def at(pose: Floats) -> str:
            """Return the position of a pose as "x, y, z" in m."""
            return ", ".join(f"{value:.6g}" for value in pose[:3, 3])

        drawn = millimetres(self.nearest_gap)
        if self.nearest is not None and self.nearest_gap > 0:
            out.append(place.format("reach, in the same orientation,", drawn, at(self.nearest), "."))
        if self.instead is None:
            return out
        moved, turned = millimetres(self.instead_moved), math.degrees(self.instead_turned)
        if turned >= _SEEN:
            away = f"{moved} and {turned:.3g}°"
            out.append(place.format("the limits that was found", away, at(self.instead.pose), "."))
        elif not out or moved != drawn:
            out.append(
                place.format("the limits, in the same orientation,", moved, at(self.instead.pose), ".")
            )
        return out


def _numbers(branches: list[Branch]) -> str:
    """Return the numbers of branches, separated by commas."""
    return ", ".join(str(branch.gc) for branch in branches)


def branch_of(report: tuple[Any, ...], ready: Ready | None = None, redundancy: str = ARM_ANGLE) -> Branch:
    """Return the core's report about one branch of a plan or a pose, a tuple, as a `Branch`.

    `ready`: the scene, for the names of shapes that are too near; None without obstacles.

    `redundancy`: which number of the arm is free (`Arm.redundancy`).
    """
    gc, verdict, status, s_from, s_to, excess, reached, margin, elbow, cost, still, psi, *rest = report
    blocking, openings, sections, given_up, through, pair, short, elsewhere, turns = rest
    found = [Opening(joint, "upper" if upper else "lower", extra) for joint, upper, extra in openings]
    return Branch(
        gc=gc, verdict=Verdict(verdict), status=STATUSES[status], s_from=s_from, s_to=s_to, excess=excess,
        reached=reached, margin=margin, elbow_margin=elbow, cost=cost, stationarity=still, nearest_psi=psi,
        blocking=tuple(joint for joint in range(1, 8) if blocking >> (joint - 1) & 1),
        openings=tuple(sorted(found, key=lambda o: o.extra)), sections=sections, given_up=given_up,
        through=tuple(other for other in range(8) if through >> other & 1),
        touching=None if ready is None else ready.names.pair(pair), short=short, elsewhere=elsewhere,
        turns=tuple((joint, turn) for joint, turn in zip((1, 5), turns, strict=True) if not math.isnan(turn)),
        scene=ready is not None, redundancy=redundancy,
    )  # fmt: skip
