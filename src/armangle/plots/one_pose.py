"""One pose: the redundancy circle and the joints over the arm angle. Figs. 4-9, 11."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import JOINTS, one_pose
from .._core import Wanted
from ..arm.arcs import ArcSet
from ..arm.arm import Arm
from ..arm.skeleton import unsolved
from ..colours import BLACK, FREE, JOINT_COLOURS, MID, OBSTACLE, PALE, VERMILION, pieces, unjoined
from ..errors import InputError, UnreachableError
from ..gradients import joint_function
from ..status import STATUSES, Status
from .style import UNPROVEN, angle_ticks, grid_axes, polar_axes, redundancy_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SAMPLES = 1441
_INNER, _STEP, _WIDTH = 2.0, 1.0, 0.84
_ALL_WIDTH = 1.5


def circle(
    arm: Arm,
    pose: ArrayLike,
    gc: int,
    *,
    psi: float | None = None,
    allowed: ArcSet | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the redundancy circle: a ring for each joint's Ψ_i, and Ψ_all outside.

    Blocked pieces have the colour of the blocking joint; in the outer ring a piece that several joints block
    is divided among them. For an arm that is not S-R-S hatched pieces are unproven, and grey ones have no
    solution. ψ = 0 is at the top, positive counterclockwise.

    The arm's `scene` has its own ring. Each blocked arc there has the names of the obstacles at its ends, and
    is dark in the outer ring. If the scene has a soft clearance, arm angles that only keep the hard one are
    paler in its ring.

    Parameters
    ----------
    arm : Arm
    pose : array_like, shape (4, 4)
        Tool frame, position in m.
    gc : int
        Global configuration 0..7.
    psi : float, optional
        Arm angle to mark, rad.
    allowed : ArcSet of shape (), optional
        Arcs given by the user; angles outside them are grey in the outer ring.
    ax : matplotlib polar axes, optional
        The axes to draw on; a new figure by default.

    Returns
    -------
    matplotlib polar axes

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    ArmangleError
        As `Arm.feasible`.

    Source: Faria et al. (2018), Figs. 4, 11, Eq. (25).
    """
    frame = one_pose("pose", pose)
    each, scene = arm.feasible(frame, gc, per_joint=True), arm.scene
    open_each = arm._left_out(frame, gc, Wanted.JOINTS)
    polar = polar_axes(ax)
    none = unsolved(arm, frame, gc)
    for joint in range(1, JOINTS + 1):
        _ring(polar, each[joint - 1], open_each[joint - 1], none, joint)
    outer = _INNER + (JOINTS + (scene is not None)) * _STEP + 0.35
    every = arm.feasible(frame, gc)
    blocks = ((~each[i])._less(open_each[i])._less(none) for i in range(JOINTS))
    blocked = dict(zip(JOINT_COLOURS, blocks, strict=True))
    if scene is not None:
        clear = calm = arm._clear(frame, gc, scene)
        if scene.soft > 0:
            loose = arm.with_(lower=-np.inf, upper=np.inf, singularity_margin=0.0)
            calm = loose._arcs(frame, gc, Wanted.SOFT, (), scene)
        open_clear = arm._left_out(frame, gc, Wanted.CLEAR)
        blocked[OBSTACLE] = (~clear)._less(open_clear)._less(none)
        _obstacle_ring(polar, clear, calm, open_clear, none)
    if allowed is not None:
        blocked[MID] = ~allowed
    elif arm.redundancy != "arm_angle":
        blocked[MID] = none
    _outer_ring(polar, blocked, outer)
    open_all = arm._left_out(frame, gc)
    _arcs(polar, open_all, outer, _ALL_WIDTH, FREE, MID, UNPROVEN)
    feasible = every if allowed is None else every & allowed
    _arcs(polar, feasible, outer, _ALL_WIDTH, FREE, BLACK)
    _mark_singular(polar, arm, frame, gc, every)
    _dress_circle(polar, outer + _ALL_WIDTH, gc, every, feasible)
    if psi is not None:
        polar.plot([psi, psi], [_INNER, outer + _ALL_WIDTH], color=BLACK, lw=1.6, label="ψ")
        polar.plot([psi], [outer + _ALL_WIDTH], "o", color=BLACK, ms=6, clip_on=False)
    _circle_legend(polar, arm, allowed is not None, made=ax is None)
    return polar  # type: ignore[no-any-return]  # matplotlib types it loosely


def _arcs(
    polar: Any, arcs: ArcSet, base: float, width: float, face: str, edge: str, hatch: str | None = None
) -> None:
    """Draw arcs of a ring, which begins at radius `base`, in these colours."""
    whole = arcs.is_full  # a bar all around would have a seam
    for lower, upper in arcs:
        polar.bar(
            0.5 * (lower + upper), width, upper - lower, base, color=face, edgecolor=edge,
            linewidth=0.0 if whole else 0.6, hatch=hatch,
        )  # fmt: skip
    for radius in (base, base + width) if whole else ():
        polar.plot(np.linspace(-np.pi, np.pi, 361), np.full(361, radius), color=edge, lw=0.6)


def _ring(polar: Any, feasible: ArcSet, unproven: ArcSet, unsolved: ArcSet, joint: int) -> None:
    """Draw the ring of one joint: feasible, blocked, unproven and unsolved arm angles."""
    base = _INNER + (joint - 1) * _STEP
    _arcs(polar, feasible, base, _WIDTH, FREE, PALE)
    blocked = (~feasible)._less(unproven)._less(unsolved)
    _arcs(polar, blocked, base, _WIDTH, JOINT_COLOURS[joint - 1], BLACK)
    _arcs(polar, unsolved, base, _WIDTH, MID, PALE)
    _arcs(polar, unproven, base, _WIDTH, FREE, MID, UNPROVEN)


def _obstacle_ring(polar: Any, clear: ArcSet, calm: ArcSet, unproven: ArcSet, unsolved: ArcSet) -> None:
    """Draw the ring of obstacles: blocked arcs with names, and paler the clear ones that are not `calm`."""
    base = _INNER + JOINTS * _STEP
    _arcs(polar, calm, base, _WIDTH, FREE, PALE)
    _arcs(polar, clear & ~calm, base, _WIDTH, MID, PALE)
    _arcs(polar, unsolved, base, _WIDTH, MID, PALE)
    blocked = (~clear)._less(unsolved)
    _arcs(polar, blocked._less(unproven), base, _WIDTH, OBSTACLE, BLACK)
    _arcs(polar, unproven, base, _WIDTH, FREE, MID, UNPROVEN)
    every = [*blocked.ends] if not blocked.is_full else [()]
    for (lower, upper), ends in zip(blocked, every, strict=True):
        names = dict.fromkeys(end.obstacle for end in ends) or dict.fromkeys((clear.blocking or [None])[:1])
        text = ", ".join(name for name in names if name)
        seen = [*ArcSet([[lower, upper]])._less(unproven)]
        lower, upper = max(seen, key=lambda arc: arc[1] - arc[0], default=(lower, upper))
        polar.text(0.5 * (lower + upper), base + _WIDTH / 2, text, ha="center", va="center", fontsize=7,
                   color=FREE)  # fmt: skip


def _outer_ring(polar: Any, blocked: dict[str, ArcSet], base: float) -> None:
    """Draw the outer ring, each piece divided among the colours of all that block it."""
    ends = [angle for arcs in blocked.values() for arc in arcs for angle in arc]
    cuts = np.unique(np.concatenate([(np.array(ends) + np.pi) % (2 * np.pi) - np.pi, [-np.pi, np.pi]]))
    for lower, upper in pairwise(cuts):
        middle = 0.5 * (lower + upper)
        here = [colour for colour, arcs in blocked.items() if middle in arcs]
        for k, colour in enumerate(here):
            share = _ALL_WIDTH / len(here)
            polar.bar(middle, share, upper - lower, base + k * share, color=colour, linewidth=0)


def _mark_singular(polar: Any, arm: Arm, pose: Any, gc: int, every: ArcSet) -> None:
    """Mark on each joint's ring of an S-R-S arm the arm angles at which the joint jumps or has a corner."""
    if every.status in (Status.UNREACHABLE, Status.FOLDED) or arm.kind != "srs":
        return
    for joint in range(1, JOINTS + 1):
        for angle in joint_function(arm, pose, gc, joint).singular:
            polar.plot([angle], [_INNER + (joint - 0.58) * _STEP], "x", color=BLACK, ms=7, mew=2)


def _dress_circle(polar: Any, radius: float, gc: int, every: ArcSet, feasible: ArcSet) -> None:
    """Draw ticks, title and the limits of the circle's plot."""
    polar.set_theta_zero_location("N")
    polar.set_ylim(0, radius)
    polar.set_yticks([])
    polar.spines["polar"].set_visible(False)
    polar.set_thetagrids(
        range(0, 360, 30), [f"{a if a <= 180 else a - 360}°".replace("-", "−") for a in range(0, 360, 30)]
    )
    polar.grid(color=PALE, lw=0.6)
    polar.set_axisbelow(True)
    free = np.degrees(feasible.measure)
    text = f"GC {gc}\n{free:.1f}° free" if feasible.count else f"GC {gc}\nnone"
    polar.text(0, 0, text, ha="center", va="center", fontsize=9)
    title = "redundancy circle, ψ in degrees"
    if not every.count:
        title += f"\n{every.status.sentence}"
    if every.unproven > 0:
        title += f"\n{np.degrees(every.unproven):.1f}° not proven"
    polar.set_title(title, fontsize=10)


def _circle_legend(polar: Any, arm: Arm, user: bool, *, made: bool) -> None:
    """Draw the legend; `user`: arcs are given as allowed; `made`: in a new figure, outside the axes."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Patch(fc=JOINT_COLOURS[j], ec=BLACK, lw=0.6, label=f"joint {j + 1} blocks (ring {j + 1})")
        for j in range(JOINTS)
    ]
    handles.append(Patch(fc=FREE, ec=BLACK, lw=0.6, label="feasible"))
    if arm.kind != "srs":
        handles.append(Patch(fc=FREE, ec=MID, lw=0.6, hatch=UNPROVEN, label="not proven"))
    if arm.redundancy != "arm_angle":
        handles.append(Patch(fc=MID, label="no solution"))
    scene = arm.scene
    if scene is not None:
        handles.append(Patch(fc=OBSTACLE, label=f"an obstacle blocks (ring {JOINTS + 1})"))
    if scene is not None and scene.soft > 0:
        handles.append(Patch(fc=MID, label="within the soft clearance"))
    if user:
        handles.append(Patch(fc=MID, label="not allowed by the user"))
    handles.append(Line2D([], [], marker="x", color=BLACK, ls="", mew=2, label="singular"))
    handles += [line for line in polar.lines if line.get_label() == "ψ"]
    options: dict[str, Any] = {
        "handles": handles, "frameon": False, "fontsize": 9, "title_fontsize": 9,
        "title": "rings: joints 1 to 7 from the inside\nouter ring: all of them",
    }  # fmt: skip
    if made:
        polar.figure.legend(loc="outside right center", **options)
    else:
        polar.legend(loc="center left", bbox_to_anchor=(1.12, 0.5), **options)


def clearance_profile(
    arm: Arm, pose: ArrayLike, gc: int, *, psi: float | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the distance between links and obstacles over the arm angle.

    The curve is that of the nearest pair; its colour tells the obstacle, and the dashed line is the scene's
    clearance. The shaded arm angles are exactly those that the scene blocks, or, if the arm is not S-R-S, is
    not proven not to block.

    Parameters
    ----------
    arm : Arm
        With a scene.
    pose : array_like, shape (4, 4)
        Tool frame, position in m.
    gc : int
        Global configuration 0..7.
    psi : float, optional
        Arm angle to mark, rad.
    ax : matplotlib axes, optional
        The axes to draw on; a new figure by default.

    Returns
    -------
    matplotlib axes

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    UnreachableError
        If the pose is out of reach.
    ArmangleError
        As `Arm.clearance`.
    """
    frame = one_pose("pose", pose)
    angles = np.linspace(-np.pi, np.pi, _SAMPLES)
    q = arm.inverse(frame, angles, gc, limits=False, on_error="raise" if arm.kind == "srs" else "nan")
    known = np.isfinite(q).all(axis=-1)
    if not known.any():
        raise UnreachableError(f"pose: {STATUSES[int(np.asarray(arm.feasible(frame, gc).status))].sentence}")
    near, scene, none = arm.clearance(q[known]), arm.scene, unsolved(arm, frame, gc)
    assert scene is not None  # otherwise `clearance` has raised
    panel = grid_axes(ax, 1, 1, (6.4, 4.0))[0]
    for lower, upper in pieces((~arm._clear(frame, gc, scene))._less(none).intervals):
        panel.axvspan(lower, upper, color=OBSTACLE, alpha=0.22, lw=0)
    names = list(dict.fromkeys(np.asarray(near.obstacle).tolist()))
    for k, name in enumerate(names):
        shown = np.full(known.shape, np.nan)
        shown[known] = np.where(near.obstacle == name, near.distance, np.nan)
        panel.plot(np.degrees(angles), shown, color=JOINT_COLOURS[k % JOINTS], lw=2.0, label=name)
    panel.axhline(scene.clearance, color=VERMILION, lw=1.2, ls="--", label="clearance")
    if psi is not None:
        panel.axvline(np.degrees(psi), color=BLACK, lw=1.2, ls="-.", label="ψ")
    panel.set_xlim(-180, 180)
    angle_ticks(panel.xaxis)
    panel.set_xlabel(redundancy_label(arm))
    panel.set_ylabel("nearest distance (m)")
    panel.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return panel  # type: ignore[no-any-return]  # matplotlib types it loosely


def joint_profiles(
    arm: Arm,
    pose: ArrayLike,
    gc: int,
    *,
    joints: Sequence[int] = (1, 2, 3, 5, 6, 7),
    psi: float | None = None,
    ax: Any = None,
) -> Any:
    """Draw joints as functions of the arm angle, with limits, stationary and singular values.

    Arm angles that the joint blocks are shaded.

    Parameters
    ----------
    arm : Arm
    pose : array_like, shape (4, 4)
        Tool frame, position in m.
    gc : int
        Global configuration 0..7.
    joints : sequence of int
        Joints 1..7, one panel each. Joint 4 of an S-R-S arm does not depend on the arm angle.
    psi : float, optional
        Arm angle to mark, rad.
    ax : axes or array of axes, optional
        As many as joints; a new figure, with a legend, by default.

    Returns
    -------
    ndarray of matplotlib axes, shape (len(joints),)

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    UnreachableError
        If the pose is out of reach.
    ArmangleError
        As `armangle.gradients.joint_function`.

    Source: Faria et al. (2018), Figs. 5-9, Eqs. (26)-(35).
    """
    if not joints:
        raise InputError("joints is empty, wanted joints 1..7")
    kind = joint_function if arm.kind == "srs" else _SolvedJoint
    functions = [kind(arm, pose, gc, joint) for joint in joints]
    panels = grid_axes(ax, len(functions), min(3, len(functions)), (3.7, 2.7), sharex=True)
    angles = np.linspace(-np.pi, np.pi, _SAMPLES)
    each, unproven = arm.feasible(pose, gc, per_joint=True), arm._left_out(pose, gc, Wanted.JOINTS)
    none = unsolved(arm, pose, gc)
    for panel, function in zip(panels, functions, strict=True):
        at = function.joint - 1
        _profile(panel, arm, function, angles, (~each[at])._less(unproven[at])._less(none))
        for lower, upper in pieces(unproven[at].intervals):
            panel.axvspan(lower, upper, fc="none", ec=MID, hatch=UNPROVEN, lw=0)
        if psi is not None:
            panel.axvline(np.degrees(psi), color=BLACK, lw=1.2, ls="-.", label="ψ")
    if ax is None:
        _profile_legend(panels, psi is not None, arm.kind != "srs")
    return panels


class _SolvedJoint:
    """One joint of an arm that is not S-R-S over psi: no closed form, so without special values."""

    stationary: tuple[float, ...] = ()
    singular: tuple[float, ...] = ()
    kind = ""

    def __init__(self, arm: Arm, pose: ArrayLike, gc: int, joint: int) -> None:
        """Keep arm, pose, branch and joint 1..7."""
        self.joint = joint
        self.arm, self.pose, self.gc = arm, np.asarray(pose), gc

    def value(self, psi: Any) -> Any:
        """Return the value (rad) of the joint at each arm angle, NaN where there is no solution."""
        poses = np.broadcast_to(self.pose, (len(psi), 4, 4))
        return self.arm.inverse(poses, psi, self.gc, limits=False, on_error="nan")[:, self.joint - 1]


def _profile(panel: Any, arm: Arm, function: Any, angles: Any, blocked: ArcSet) -> None:
    """Draw one joint over the arm angle, with its limits and special values."""
    joint = function.joint
    values = np.degrees(function.value(angles))
    limits = np.degrees([arm.lower[joint - 1], arm.upper[joint - 1]])
    for lower, upper in pieces(blocked.intervals):
        panel.axvspan(lower, upper, color=JOINT_COLOURS[joint - 1], alpha=0.22, lw=0)
    panel.plot(*unjoined(np.degrees(angles), values, 90.0), color=BLACK, lw=1.8)
    for limit in limits[np.isfinite(limits)]:
        panel.axhline(limit, color=VERMILION, lw=1.2, ls="--")
    for psi in function.singular:
        panel.axvline(np.degrees(psi), color=MID, lw=2.0, ls=":", zorder=3)
    if len(function.stationary):
        panel.plot(np.degrees(function.stationary), np.degrees(function.value(function.stationary)), "o",
                   color=BLACK, mfc="white", ms=6)  # fmt: skip
    panel.set_title(f"joint {joint}{': ' * bool(function.kind)}{function.kind}", fontsize=10)
    panel.set_xlim(-180, 180)
    angle_ticks(panel.xaxis)
    panel.set_xlabel(redundancy_label(arm))
    panel.set_ylabel(f"q{joint} (deg)")


def _profile_legend(panels: Any, marked: bool, chain: bool) -> None:
    """Draw the legend of the joints' panels; `marked`: with ψ; `chain`: with unproven arm angles."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Line2D([], [], color=VERMILION, ls="--", lw=1.2, label="limit"),
        Line2D([], [], marker="o", color=BLACK, mfc="white", ls="", label="stationary"),
        Line2D([], [], color=MID, ls=":", label="singular"),
        Patch(fc=MID, alpha=0.35, label="blocked by this joint"),
    ]
    if chain:
        handles.append(Patch(fc="white", ec=MID, lw=0.6, hatch=UNPROVEN, label="not proven"))
    if marked:
        handles.append(Line2D([], [], color=BLACK, ls="-.", lw=1.2, label="ψ"))
    figure = panels[0].figure
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=9)
