"""Motions: eq. (36), and arm angle and joints along a path. Figs. 12, 13."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from .._arrays import JOINTS, Floats, unwrap_known
from ..arm.arcs import ArcSet
from ..arm.arm import Arm, check_arm
from ..arm.skeleton import alike
from ..colours import CURVES, PALE, VERMILION
from ..errors import InputError
from ..files.tables import JointTable
from ..files.trajectories import TrajectoryTable
from ..motion.joint_path import JointPath
from ..motion.options import core_policy
from ..motion.policies import Centre, Policy, Repulsion, Towards
from ..timing.trajectory import Trajectory
from .style import flat_axes, grid_axes, outer_legend, shared_legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ARC = (-np.pi / 2, np.pi / 2)
_SAMPLES = 801

Timed = Trajectory | TrajectoryTable
Shown = JointPath | JointTable | Timed
Paths = Shown | Mapping[str, Shown] | Sequence[Shown]

LEAST_SPAN = 1.0  # deg


def repulsion(
    policies: Policy | Sequence[Policy] = (),
    *,
    arc: tuple[float, float] = _ARC,
    dt: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the change of the arm angle by policies in one step, over the arm angle on its arc.

    Parameters
    ----------
    policies : policy or sequence of policies
        By default `Repulsion` with α = 5, 10, 20, 50 and K = 0.1, as the paper varies α.
    arc : (lower, upper)
        The feasible arc, rad, shorter than a turn.
    dt : float, optional
        Time of the step, s; required for a policy with ``rate=``.
    ax : matplotlib axes, optional
        The axes to draw on; a new figure by default.

    Returns
    -------
    matplotlib axes

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    InputError
        If the arc is empty or a whole turn, dt is missing, or a `Towards` has no psi.

    Source: Faria et al. (2018), Fig. 12, Eq. (36).
    """
    lower, upper = map(float, arc)
    if not 0 < upper - lower < 2 * np.pi:
        raise InputError(f"arc is [{lower:g}, {upper:g}] rad, wanted lower < upper, less than a turn apart")
    chosen = [policies] if not isinstance(policies, Sequence) else list(policies)
    chosen = chosen or [Repulsion(K=0.1, alpha=alpha) for alpha in (5.0, 10.0, 20.0, 50.0)]
    axes = flat_axes(ax, (7.4, 4.0))
    psi = np.linspace(lower, upper, _SAMPLES)
    for k, policy in enumerate(chosen):
        change = _change(policy, ArcSet([[lower, upper]]), psi, dt)
        axes.plot(np.degrees(psi), np.degrees(change), color=CURVES[k % len(CURVES)], lw=1.8,
                  label=_policy_text(policy))  # fmt: skip
    for end, label in ((lower, "ends of the arc"), (upper, "_")):
        axes.axvline(np.degrees(end), color=VERMILION, lw=1.2, ls="--", label=label)
    axes.axhline(0, color=PALE, lw=0.8, zorder=0)
    axes.set_xlabel("arm angle before the step, ψ(t−1) (deg)")
    axes.set_ylabel("change in one step, Δψ (deg)")
    outer_legend(axes)
    return axes


def _change(policy: Policy, arcs: ArcSet, psi: Floats, dt: float | None) -> Floats:
    """Return by how much a policy moves each psi in a step of dt s, rad in [-pi, pi); NaN: no answer."""
    out, code = np.empty(len(psi)), np.empty(len(psi), dtype=np.int8)
    index = np.zeros(len(psi), dtype=np.int64)
    if isinstance(policy, Towards) and policy.psi is None:
        raise InputError(f"policies holds {policy!r}, whose wish is an arm angle only at a pose: wanted psi=")
    policy_now, angles = core_policy(policy, dt), np.ascontiguousarray(psi)
    _core.resolve_many(policy_now, arcs._count, arcs._psi, None, None, index, angles, None, out, code)
    return (out - psi + np.pi) % (2 * np.pi) - np.pi


def _policy_text(policy: Policy) -> str:
    """Return a policy and its numbers as text for a legend."""
    match policy:
        case Repulsion(rate=None):
            return f"α = {policy.alpha:g}, K = {policy.K:g}"
        case Repulsion():
            return f"α = {policy.alpha:g}, rate {policy.rate:g} 1/s"
        case Centre(rate=None):
            return f"centre, K = {policy.K:g}"
        case Centre():
            return f"centre, rate {policy.rate:g} 1/s"
        case Towards(psi=float() | int() as psi, rate=None):
            return f"towards {np.degrees(psi):.4g}°, K = {policy.K:g}"
        case Towards(psi=float() | int() as psi):
            return f"towards {np.degrees(psi):.4g}°, rate {policy.rate:g} 1/s"
    return "hold"


def path(paths: Paths, *, arm: Arm | None = None, ax: Any = None) -> Any:
    """Draw arm angle and joints along a path, or over time, with the joints' limits.

    For an arm with an offset wrist or shoulder the arm angle is the value of joint 7 or 1.

    Parameters
    ----------
    paths : JointPath or Trajectory, or mapping of names to them, or sequence of them
        One motion, or several of the same arm to compare: all with times, or all without. A `JointPath` is
        drawn over its path parameter s, a `Trajectory` over its time in s. Results of `load_joints` and
        `load_trajectory` are drawn in the same way.
    arm : Arm, optional
        The arm of a file's joints, which the file does not contain; required for such.
    ax : array of 8 axes, optional
        For the arm angle and joints 1..7; a new figure, with a legend, by default.

    Returns
    -------
    ndarray of matplotlib axes, shape (8,)

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    InputError
        If there is no path, the paths belong to different arms, only some have times, or the arm of a file is
        missing.

    Source: Faria et al. (2018), Fig. 13.
    """
    named, arm = _named(paths, arm)
    panels = grid_axes(ax, 1 + JOINTS, 2, (4.2, 1.9), sharex=True)
    for k, (name, motion) in enumerate(named.items()):
        colour, label = CURVES[k % len(CURVES)], name or "_"
        x = _abscissa(motion)
        rows = np.vstack([_arm_angle(motion, arm), motion.q.T])
        for panel, row in zip(panels, rows, strict=True):
            panel.plot(x, np.degrees(row), color=colour, lw=1.7, label=label)
        at = motion.first_failure if isinstance(motion, JointPath) else None
        if at is not None:
            panels[0].axvline(x[at], color=colour, lw=1.2, ls=":", label=f"{name} fails".strip())
    first = next(iter(named.values()))
    panels[0].set_ylabel("ψ (deg)" if arm.redundancy == "arm_angle" else f"ψ, {arm.redundancy} (deg)")
    for joint, panel in enumerate(panels[1:], start=1):
        panel.set_ylabel(f"q{joint} (deg)")
        draw_limits(panel, np.degrees(arm.lower[joint - 1]), np.degrees(arm.upper[joint - 1]))
    ends = np.concatenate(
        [_abscissa(motion)[[0, -1]] for motion in named.values() if len(motion)] or [np.arange(2.0)]
    )
    for panel in panels:
        panel.margins(x=0)
        if ends.min() < ends.max():  # the whole request, so that an incomplete path is visible
            panel.set_xlim(ends.min(), ends.max())
    for panel in panels[-2:]:
        panel.set_xlabel("time (s)" if isinstance(first, Timed) else "path parameter s")
    if ax is None:
        panels[0].figure.suptitle(arm.name, fontsize=11)
        shared_legend(panels, 5)
    return panels


def _named(paths: Paths, arm: Arm | None) -> tuple[dict[str, Shown], Arm]:
    """Return the motions by name, and their common arm."""
    named: dict[str, Shown]
    if isinstance(paths, Shown):
        named = {"": paths}
    elif isinstance(paths, Mapping):
        named = dict(paths)
    else:
        named = {f"path {k + 1}": motion for k, motion in enumerate(paths)}
    if not named:
        raise InputError("paths is empty, wanted at least one JointPath or Trajectory")
    for name, motion in named.items():
        if not isinstance(motion, Shown):
            raise InputError(f"{name} is a {type(motion).__name__}, wanted a JointPath or a Trajectory")
    arms = [arm_of(name or "paths", motion, arm) for name, motion in named.items()]
    first, *others = named.values()
    if not all(alike(other, arms[0]) for other in arms):
        raise InputError("paths are of different arms, wanted one arm: its limits are drawn")
    if any(isinstance(motion, Timed) != isinstance(first, Timed) for motion in others):
        raise InputError("some paths have times and some have not, wanted all Trajectory or all JointPath")
    return named, arms[0]


def arm_of(name: str, motion: Shown, given: Arm | None) -> Arm:
    """Return the arm of a motion: its own, or the given one if the motion was read from a file."""
    if isinstance(motion, JointPath):
        return motion.arm
    if isinstance(motion, Trajectory):
        return motion.path.arm
    if given is None:
        raise InputError(f"{name} is a {type(motion).__name__}, which does not say its arm: wanted arm= too")
    check_arm(given)
    return given


def _abscissa(motion: Shown) -> Floats:
    """Return the abscissa of a motion: time, s, or the path parameter."""
    return motion.t if isinstance(motion, Timed) else motion.s


def _arm_angle(motion: Shown, arm: Arm) -> Floats:
    """Return the arm angle, or value of the free joint, of each row, rad, without jumps by 2π."""
    if isinstance(motion, JointPath):
        return motion.psi
    solved = np.isfinite(motion.q).all(axis=1)
    psi = np.full(len(motion.q), np.nan)
    psi[solved] = arm.forward(motion.q[solved], on_error="nan")[1]
    unwrap_known(psi)
    return psi


def draw_limits(panel: Any, lower: float, upper: float) -> None:
    """Draw the limits (in the unit of the panel) that are near its curve, and shade the area behind them."""
    low, high = panel.get_ylim()
    room = max(high - low, LEAST_SPAN)  # rounding of a resting joint must not look like a curve
    low, high = min(low, 0.5 * (low + high - room)), max(high, 0.5 * (low + high + room))
    for limit, sign in ((lower, -1), (upper, 1)):
        if not low - 1.5 * room <= limit <= high + 1.5 * room:
            continue
        panel.axhline(limit, color=VERMILION, lw=1.2, ls="--", label="limit")
        panel.axhspan(limit, limit + sign * 1e4, color=VERMILION, alpha=0.12, lw=0)
        low, high = min(low, limit - 0.08 * room), max(high, limit + 0.08 * room)
    panel.set_ylim(low, high)
