"""The feasible map: the feasible arm angles along a path, and the joints that block others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import CONFIGURATIONS, JOINTS, Floats, as_codes, as_poses
from .._core import Wanted
from ..arm.arcs import ArcSet
from ..arm.arm import Arm
from ..arm.configuration import gc_signs
from ..arm.skeleton import unsolved
from ..colours import BLACK, FREE, FULL_TURN, JOINT_COLOURS, MID, OBSTACLE, PALE, unjoined, wrapped_degrees
from ..errors import InputError
from ..motion.joint_path import JointPath
from ..status import Status
from .style import angle_ticks, grid_axes, redundancy_label

_SEAM = 0.4  # pt
_FULL = np.array([[[-np.pi, np.pi]]])
_SIDES = ("left", "center", "right")  # of a name: it stays within its panel
_ISLAND: dict[str, Any] = {"hatch": "....", "edgecolors": OBSTACLE, "linewidths": 0.0}
_NOT_KNOWN: dict[str, Any] = {"facecolor": "white", "edgecolor": MID, "hatch": "///", "lw": 0}


def feasible_map(
    motion: JointPath | tuple[Arm, ArrayLike],
    *,
    gc: int | Sequence[int] | None = None,
    ax: Any = None,
) -> Any:
    """Draw the feasible arm angles along a path, and the joint or obstacle that blocks the others.

    Light green is feasible; other cells have the colour of the lowest blocking joint. Arm angles blocked by
    the arm's `scene` alone are dark, those blocked by a joint too are dotted, with the obstacle's name. For
    an arm that is not S-R-S, grey cells have no solution, and pale ones are unproven. Each column is exact
    for its pose; a row of a path whose pose is NaN, and so unknown, is hatched.

    Parameters
    ----------
    motion : JointPath, or (Arm, poses of shape (N, 4, 4))
        A path, whose curve is drawn in the panel of its global configuration; or poses alone.
    gc : int or sequence of int, optional
        Global configurations 0..7, one panel each; all eight by default.
    ax : axes or array of axes, optional
        As many as global configurations; a new figure, with a legend, by default.

    Returns
    -------
    matplotlib axes for one global configuration, else ndarray of axes

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    InputError
        If the poses are not (N, 4, 4), or gc is not in 0..7.
    """
    curve = motion if isinstance(motion, JointPath) else None
    arm, poses = (motion.arm, motion.poses) if isinstance(motion, JointPath) else motion
    frames = as_poses("poses", poses)
    if frames.ndim != 3 or not len(frames):
        raise InputError(f"poses has shape {frames.shape}, wanted (N, 4, 4) with N > 0")
    s = curve.s if curve is not None else np.linspace(0.0, 1.0, len(frames))
    posed = np.asarray(np.isfinite(frames).all(axis=(1, 2)) | (curve is None))  # poses alone must be finite
    wanted = as_codes("gc", np.atleast_1d(range(CONFIGURATIONS) if gc is None else gc), CONFIGURATIONS)
    one = len(wanted) == 1
    panels = grid_axes(ax, len(wanted), min(4, len(wanted)), (6.4, 4.2) if one else (3.0, 2.6),
                       sharex=True, sharey=True)  # fmt: skip
    for panel, index in zip(panels, wanted.tolist(), strict=True):
        _map_panel(panel, arm, s, frames, posed, index)
        if curve is not None:
            _draw_curve(panel, curve, index)
    for k, panel in enumerate(panels):
        if k % 4 == 0:
            panel.set_ylabel(redundancy_label(arm))
        if k + 4 >= len(panels):
            panel.set_xlabel("path parameter s")
    if ax is None:
        _map_legend(
            panels[0].figure, curve is not None, bool(posed.all()), arm.scene is not None,
            arm.kind != "srs",
            4 if one else 5,
        )  # fmt: skip
    return panels[0] if one else panels


def _map_panel(
    panel: Any,
    arm: Arm,
    s: Floats,
    poses: Floats,
    posed: NDArray[np.bool_],
    gc: int,
) -> None:
    """Draw the map of one branch: blocked arm angles over s in the colour of the blocking joint."""
    edges = np.concatenate([s[:1], 0.5 * (s[1:] + s[:-1]), s[-1:]])
    if len(s) == 1:
        edges = s[0] + np.array([-0.5, 0.5])
    sides = np.stack([edges[:-1], edges[1:]], axis=1)
    each = arm.feasible(poses[posed], gc, per_joint=True)
    unproven, none = arm._left_out(poses[posed], gc, Wanted.JOINTS), unsolved(arm, poses[posed], gc)
    clear = None if arm.scene is None else arm._clear(poses[posed], gc, arm.scene)
    if clear is not None:
        islands = (~clear)._less(none)
        _cells(panel, islands.intervals, sides[posed], OBSTACLE)
    _cells(panel, arm._left_out(poses[posed], gc).intervals, sides[posed], PALE)
    for joint in range(JOINTS, 0, -1):
        blocked = (~each[:, joint - 1])._less(unproven[:, joint - 1])
        _cells(panel, blocked.intervals, sides[posed], JOINT_COLOURS[joint - 1])
    if clear is not None:
        _cells(panel, islands.intervals, sides[posed], "none", _ISLAND)
        _name_islands(panel, clear, islands, sides[posed].mean(axis=1))
    lost = np.isin(each[:, 0].status, (Status.UNREACHABLE, Status.FOLDED))
    _cells(panel, _FULL, sides[posed][lost], MID)
    _cells(panel, none.intervals, sides[posed], MID)
    for left, right in sides[~posed]:
        panel.axvspan(left, right, **_NOT_KNOWN)
    signs = "".join("+" if sign > 0 else "−" for sign in gc_signs(gc))
    panel.set_title(f"GC {gc} ({signs})", fontsize=9)
    panel.set_xlim(edges[0], edges[-1])
    panel.set_ylim(-180, 180)
    panel.set_facecolor(FREE)
    angle_ticks(panel.yaxis)


def _name_islands(panel: Any, clear: ArcSet, blocked: ArcSet, s: Floats) -> None:
    """Write each obstacle's name where the arc that it blocks is widest."""
    widest: dict[str, tuple[float, float, float]] = {}
    for at in range(len(s)):
        for (lower, upper), names in zip(blocked[at], _names(clear, blocked, at), strict=True):
            found = (upper - lower, float(s[at]), float(wrapped_degrees(np.array(0.5 * (lower + upper)))))
            for name in names:
                widest[name] = max(widest.get(name, found), found)
    for name, (_, at_s, middle) in widest.items():
        share = (at_s - s[0]) / max(float(s[-1] - s[0]), np.finfo(float).tiny)
        panel.text(
            at_s, middle, name, ha=_SIDES[round(2 * share)], va="center", fontsize=8, zorder=6,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
        )  # fmt: skip


def _names(clear: ArcSet, blocked: ArcSet, at: int) -> list[set[str]]:
    """Return the obstacles that end each blocked arc at row `at`; of a full circle the one that blocks."""
    if not blocked[at].is_full:
        return [{end.obstacle for end in ends if end.obstacle} for ends in blocked[at].ends]
    alone = clear.blocking[at]
    return [{alone[0]} if alone else set()]


def _cells(
    panel: Any, intervals: Floats, sides: Floats, colour: str, more: dict[str, Any] | None = None
) -> None:
    """Draw arcs (N or 1, k, 2), rad, of N columns (N, 2) as rectangles; `more` are options of their edges."""
    from matplotlib.collections import PolyCollection

    arcs = np.degrees(np.broadcast_to(intervals, (len(sides), *intervals.shape[1:])))
    over = arcs - FULL_TURN
    both = np.concatenate([arcs, np.where(over[..., 1:] > -FULL_TURN / 2, over, np.nan)], axis=1)
    row, k = np.nonzero(~np.isnan(both[..., 0]))
    low, high = np.clip(both[row, k].T, -FULL_TURN / 2, FULL_TURN / 2)
    left, right = sides[row].T
    corners = np.stack([left, low, right, low, right, high, left, high], axis=-1).reshape(-1, 4, 2)
    # Edges have the same colour: between touching cells a scaled picture would show white lines.
    edged = more or {"edgecolors": colour, "linewidths": _SEAM}
    panel.add_collection(PolyCollection(list(corners), facecolors=colour, antialiaseds=False, **edged))


def _draw_curve(panel: Any, curve: JointPath, gc: int) -> None:
    """Draw the chosen arm angle over s where the motion is in this branch."""
    psi = np.where(curve.gc == gc, curve.psi, np.nan)
    if not np.isfinite(psi).any():
        return
    s, degrees = unjoined(curve.s, wrapped_degrees(psi))
    panel.plot(s, degrees, color="white", lw=4.0, zorder=3)
    panel.plot(s, degrees, color=BLACK, lw=2.0, zorder=4, label="chosen ψ(s)")
    first = np.flatnonzero(np.isfinite(degrees))[:1]
    panel.plot(s[first], degrees[first], "o", color=BLACK, ms=6, zorder=5)


def _map_legend(figure: Any, curve: bool, whole: bool, obstacles: bool, chain: bool, columns: int) -> None:
    """Draw the legend of a map; the flags say which entries it needs."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Patch(fc=FREE, ec=BLACK, lw=0.6, label="feasible")]
    handles += [Patch(fc=colour, label=f"joint {k + 1} blocks") for k, colour in enumerate(JOINT_COLOURS)]
    handles.append(Patch(fc=MID, label="no solution"))
    if chain:
        handles.append(Patch(fc=PALE, label="not proven"))
    if obstacles:
        handles.append(Patch(fc=OBSTACLE, label="an obstacle blocks"))
        handles.append(Patch(fc="white", ec=OBSTACLE, lw=0, hatch="....", label="an obstacle too"))
    if not whole:
        handles.append(Patch(label="not solved, pose not known", **_NOT_KNOWN))
    if curve:
        handles.append(Line2D([], [], color=BLACK, lw=2, marker="o", label="chosen ψ(s)"))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False, fontsize=9)
