"""Motion over time: a trajectory with its derivatives, and a tracker with its target."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import JOINTS, Floats, as_number
from ..arm.arm import Arm
from ..colours import BLUE, CURVES, GREEN, MID, ORANGE, SKY, VERMILION
from ..errors import InputError
from ..files.trajectories import TrajectoryTable
from ..motion.options import LONGEST_STEP, Bound, joint_bound
from ..motion.tracking import Tracked, Tracking
from ..timing.trajectory import Trajectory
from .motions import Timed, arm_of, draw_limits
from .style import grid_axes

RATES = ("q", "qd", "qdd")
_UNITS = {"q": "deg", "qd": "deg/s", "qdd": "deg/s²"}
_HEADS = {"q": "joint value", "qd": "velocity", "qdd": "acceleration"}
_STATUS_COLOURS = {
    Tracking.FOLLOWING: GREEN, Tracking.LAGGING: SKY, Tracking.NEAREST: ORANGE, Tracking.HELD: MID,
    Tracking.TURNING: BLUE, Tracking.RETURNING: VERMILION,
}  # fmt: skip
_MM = 1e3


def trajectory(
    trajectory: Trajectory | TrajectoryTable, *, arm: Arm | None = None, velocity: Bound = None,
    acceleration: Bound = None, ax: Any = None,
) -> Any:  # fmt: skip
    """Draw joint values, velocities and accelerations over time, with their limits.

    Parameters
    ----------
    trajectory : Trajectory or TrajectoryTable
        The result of `retime` or `load_trajectory`.
    arm : Arm, optional
        The arm of a file's joints, which the file does not contain; required for such.
    velocity, acceleration : float, array_like of shape (7,), or True, optional
        Bounds to draw, rad/s and rad/s²; by default those of the arm, if any; True raises if it has none.
    ax : array of 21 axes, optional
        Seven rows of q, qd, qdd; a new figure by default.

    Returns
    -------
    ndarray of matplotlib axes, shape (21,)

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    InputError
        If it is not a trajectory, a file's arm is missing, or a bound is invalid.
    """
    if not isinstance(trajectory, Timed):
        raise InputError(f"trajectory is a {type(trajectory).__name__}, wanted a Trajectory")
    arm = arm_of("trajectory", trajectory, arm)
    fastest = arm.velocity if velocity is None else joint_bound(arm, "velocity", velocity, arm.velocity)
    hardest = (
        arm.acceleration
        if acceleration is None
        else joint_bound(arm, "acceleration", acceleration, arm.acceleration)
    )
    bounds = {"q": (arm.lower, arm.upper), "qd": (-fastest, fastest), "qdd": (-hardest, hardest)}
    panels = grid_axes(ax, len(RATES) * JOINTS, len(RATES), (3.6, 1.25), sharex=True)
    for k, panel in enumerate(panels):
        joint, rate = divmod(k, len(RATES))
        name = RATES[rate]
        lower, upper = (np.degrees(bound[joint]) for bound in bounds[name])
        drawn = np.degrees(getattr(trajectory, name)[:, joint])
        panel.plot(trajectory.t, drawn, color=CURVES[0], lw=1.5)
        draw_limits(panel, lower, upper)
        panel.margins(x=0)
        panel.set_ylabel(f"{name[0]}{joint + 1} ({_UNITS[name]})" if rate == 0 else "")
        if joint == 0:
            panel.set_title(f"{_HEADS[name]} ({_UNITS[name]})", fontsize=10)
        if joint == JOINTS - 1:
            panel.set_xlabel("time (s)")
    if ax is None:
        panels[0].figure.suptitle(f"{arm.name or 'arm'}: {trajectory.duration:.3g} s", fontsize=11)
    return panels


def tracking(
    ticks: Sequence[Tracked], dt: float, *, velocity: ArrayLike | None = None, ax: Any = None
) -> Any:
    """Draw how a tracker follows: distance to the target and its gap beyond reach (mm), velocities, psi.

    The background shows the status of each cycle.

    Parameters
    ----------
    ticks : list or tuple of Tracked
        Consecutive results of `Tracker.step`.
    dt : float
        Time of a control cycle, s.
    velocity : float or array_like, shape (7,), optional
        Bounds on joint velocities, rad/s: velocities are then drawn as shares of them.
    ax : array of 3 axes, optional
        For distance, velocities and arm angle; a new figure by default.

    Returns
    -------
    ndarray of matplotlib axes, shape (3,)

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    InputError
        If there is no cycle, or a number is invalid.
    """
    if not isinstance(ticks, (list, tuple)) or not ticks or not all(isinstance(t, Tracked) for t in ticks):
        raise InputError("ticks is empty or holds something else, wanted a list of Tracked")
    step = as_number("dt", dt, 0.0, LONGEST_STEP, low_open=True)
    t = np.asarray(step * np.arange(1.0, len(ticks) + 1))
    panels = grid_axes(ax, 3, 1, (8.0, 2.1), sharex=True)
    away, gap = (np.array([getattr(tick, name) for tick in ticks]) * _MM for name in ("distance", "gap"))
    panels[0].plot(t, away, color=BLUE, lw=1.6, label="distance from the hand")
    if gap.max() > 0:
        panels[0].plot(t, gap, color=VERMILION, lw=1.3, ls="--", label="hand beyond reach")
    panels[0].set_ylabel("distance (mm)")
    panels[0].set_ylim(bottom=0)
    _speeds(panels[1], t, np.stack([tick.velocity for tick in ticks]), velocity)
    panels[2].plot(t, np.degrees(np.unwrap([tick.psi for tick in ticks])), color=BLUE, lw=1.6)
    panels[2].set_ylabel("ψ (deg)")
    panels[2].set_xlabel("time (s)")
    statuses = np.array([int(tick.status) for tick in ticks])
    for panel in panels:
        panel.set_xlim(0.0, t[-1])
        _shade(panel, np.asarray(t - step), t, statuses)
    _legends(panels)
    return panels


def _speeds(panel: Any, t: Floats, speeds: Floats, velocity: ArrayLike | None) -> None:
    """Draw the joint velocities, as shares of their bounds if these are given."""
    unit = np.radians(1.0) * np.ones(JOINTS)
    if velocity is not None:
        unit = np.broadcast_to(np.asarray(velocity, dtype=float), (JOINTS,)) / 100
        for end in (-100, 100):
            panel.axhline(end, color=VERMILION, lw=1.1, ls="--")
    for joint in range(JOINTS):
        panel.plot(t, speeds[:, joint] / unit[joint], color=CURVES[joint], lw=1.1, label=f"q{joint + 1}")
    panel.set_ylabel("speed (deg/s)" if velocity is None else "speed (% of bound)")


def _shade(panel: Any, begin: Any, end: Any, statuses: Any) -> None:
    """Colour the background of each time span by the status of its cycles."""
    cuts = np.flatnonzero(np.diff(statuses)) + 1
    for first, last in zip([0, *cuts], [*cuts, len(statuses)], strict=True):
        status = Tracking(statuses[first])
        panel.axvspan(
            begin[first], end[last - 1], color=_STATUS_COLOURS[status], alpha=0.35, lw=0, zorder=0,
            label=status.name,
        )  # fmt: skip


def _legends(panels: Any) -> None:
    """Put each panel's legend beside it: statuses beside the first, joints beside the second."""
    for panel in panels[:2]:
        shown = dict(zip(*panel.get_legend_handles_labels()[::-1], strict=True))
        if panel is not panels[0]:
            shown = {label: handle for label, handle in shown.items() if label.startswith("q")}
        panel.legend(
            shown.values(), shown.keys(), loc="upper left", bbox_to_anchor=(1.01, 1.03), frameon=False,
            fontsize=8, labelspacing=0.25,
        )  # fmt: skip
