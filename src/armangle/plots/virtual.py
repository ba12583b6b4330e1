"""Real and virtual arm, the reference half-plane and the arm angle. Figs. 2, 3."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats, one_posture
from ..arm.arm import Arm
from ..arm.joint_map import to_theta
from ..arm.skeleton import elbow_points, skeleton
from ..colours import BLACK, GREEN, MID, ORANGE, SKY, VERMILION
from .space import draw_sticks, extent, finish_space
from .style import check_drawn, flat_axes, space_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SAMPLES = 361
_ARC_SAMPLES = 61
_TURN, _RISE = np.radians(15.0), np.radians(40.0)


def virtual_arm(arm: Arm, q: ArrayLike, *, ax: Any = None) -> Any:
    """Draw real and virtual arm, the reference half-plane and the arm angle between them.

    The virtual arm reaches the same pose with ψ = 0, which is θ_3 = 0 for ``reference="base"``; the
    half-plane from the line shoulder-wrist through its elbow is ψ = 0.

    Parameters
    ----------
    arm : Arm
    q : array_like, shape (7,)
        Joint values, rad.
    ax : matplotlib 3-D axes, optional
        The axes to draw on; a new figure by default.

    Returns
    -------
    matplotlib 3-D axes

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    UnsupportedError
        If the arm has an offset wrist or shoulder.
    InputError
        If q is not seven finite numbers.
    UnreachableError
        If the arm is folded and has no arm angle.

    Source: Faria et al. (2018), Figs. 2, 3, Eqs. (3)-(11).
    """
    check_drawn(arm)
    joints = one_posture("q", q)
    pose, psi, gc = arm.forward(joints)
    real, virtual = skeleton(arm, joints), skeleton(arm, arm.inverse(pose, 0.0, gc, limits=False))
    space = space_axes(ax)
    shoulder, wrist, elbow = real[1], real[5], virtual[3]
    axis = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    centre = shoulder + axis * (axis @ (elbow - shoulder))
    _half_plane(space, shoulder, wrist, elbow - centre)
    draw_sticks(space, virtual, SKY, lw=4, label="virtual arm (ψ = 0)")
    draw_sticks(space, real, MID, lw=5, label="real arm")
    circle = elbow_points(arm, pose, int(gc), np.linspace(-np.pi, np.pi, _SAMPLES))
    space.plot(*circle.T, color=BLACK, lw=0.9, ls="--", label="elbow circle")
    turned = elbow_points(arm, pose, int(gc), np.linspace(0.0, float(psi), _ARC_SAMPLES))
    space.plot(*(centre + 0.55 * (turned - centre)).T, color=VERMILION, lw=2.5,
               label=f"ψ = {np.degrees(psi):.1f}°".replace("-", "−"))  # fmt: skip
    for end in (elbow, real[3]):
        space.plot(*np.array([centre, end]).T, color=VERMILION, lw=0.9, ls=":")
    space.plot(*np.array([shoulder, wrist]).T, color=BLACK, lw=1.2, ls="-.", label="shoulder-wrist line")
    size = extent(real)
    for point, name in ((shoulder, "S"), (wrist, "W"), (real[3], "E"), (elbow, "Eᵛ")):
        space.text(*(point + 0.07 * size * _outward(point, centre)), name, fontsize=11, weight="bold")
    view = _viewpoint(axis, (real[3] - centre) + (elbow - centre))
    finish_space(space, np.vstack([real, virtual, circle[np.isfinite(circle).all(axis=1)]]), view)
    space.set_title(f"{arm.name}: GC {gc}, virtual arm and reference half-plane", fontsize=10)
    return space


def _viewpoint(axis: Floats, front: Floats) -> tuple[float, float]:
    """Return azimuth and elevation (deg) from which both elbows and the arm angle are visible."""
    length = float(np.linalg.norm(front))
    front = front / length if length > 0 else np.cross(axis, [0.0, 1.0, 0.0])
    up = axis if axis[2] >= 0 else -axis
    way = np.cos(_TURN) * front + np.sin(_TURN) * np.cross(axis, front) + np.tan(_RISE) * up
    return float(np.degrees(np.arctan2(way[1], way[0]))), float(
        np.degrees(np.arctan2(way[2], np.hypot(way[0], way[1])))
    )


def _outward(point: Floats, centre: Floats) -> Floats:
    """Return the unit vector from a centre to a point; z if both coincide."""
    away = point - centre
    length = np.linalg.norm(away)
    return away / length if length > 0 else np.array([0.0, 0.0, 1.0])


def _half_plane(space: Any, shoulder: Floats, wrist: Floats, out: Floats) -> None:
    """Draw the half-plane from the line shoulder-wrist in direction `out`, at which psi is 0."""
    art3d = importlib.import_module("mpl_toolkits.mplot3d.art3d")
    corners = np.array([shoulder, wrist, wrist + 1.35 * out, shoulder + 1.35 * out])
    space.add_collection3d(
        art3d.Poly3DCollection([corners], facecolor=ORANGE, alpha=0.22, label="half-plane ψ = 0")
    )


def virtual_plane(arm: Arm, q: ArrayLike, *, ax: Axes | None = None) -> Axes:
    """Draw the virtual arm of ``reference="base"`` in its own plane, with the angles that set its elbow.

    Parameters
    ----------
    arm : Arm
    q : array_like, shape (7,)
        Joint values, rad.
    ax : matplotlib axes, optional
        The axes to draw on; a new figure by default.

    Returns
    -------
    matplotlib axes
        Horizontal: distance from the axis of joint 1, m; vertical: height above the shoulder, m.

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    UnsupportedError
        If the arm has an offset wrist or shoulder.
    InputError
        If q is not seven finite numbers.
    UnreachableError
        If the arm is folded and has no virtual arm.

    Source: Faria et al. (2018), Fig. 3, Eqs. (4)-(7).
    """
    check_drawn(arm)
    joints = one_posture("q", q)
    pose, _, gc = arm.forward(joints)
    virtual = arm.inverse(pose, 0.0, gc, limits=False)
    base = arm.frames(virtual)[0]
    points = (skeleton(arm, virtual)[1:6] - base[:3, 3]) @ base[:3, :3]
    theta = to_theta(arm._handle, virtual)
    plane = np.array([np.cos(theta[0]), np.sin(theta[0]), 0.0])
    flat = np.column_stack([points @ plane, points[:, 2] - arm.geometry.d_bs])
    if flat[-1, 0] < -1e-9:
        flat[:, 0] *= -1
    axes = flat_axes(ax, (6.4, 5.2))
    _plane_drawing(axes, flat)
    axes.set_title(f"{arm.name}: GC {gc}, virtual arm in the plane ψ = 0", fontsize=10)
    return axes


def _plane_drawing(axes: Axes, flat: Floats) -> None:
    """Draw the virtual arm and its triangle from points (n, 2) of its plane."""
    shoulder, elbow, wrist = flat[0], flat[2], flat[4]
    size = float(np.ptp(flat, axis=0).max())
    axes.plot(*flat.T, color=SKY, lw=5, solid_capstyle="round", label="virtual arm")
    axes.plot(*np.array([shoulder, wrist]).T, color=BLACK, lw=1.2, ls="-.", label="shoulder-wrist, ‖p‖")
    axes.plot([0, 0], [0, 0.55 * size], color=MID, lw=1.0, ls=":", label="axis of joint 1")
    axes.plot(*flat[[0, 2, 4]].T, "o", color=BLACK, ms=7, mfc="white", mew=1.8)
    to_wrist, to_arm = np.arctan2(*wrist), np.arctan2(*flat[1])
    _arc(axes, 0.0, to_arm, 0.42 * size, VERMILION, "θ2ᵛ: from the axis of joint 1 to the upper arm")
    _arc(axes, to_wrist, to_arm, 0.28 * size, GREEN, "φ (β with an elbow offset): from S-W to the upper arm")
    along = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    out = elbow - along * (along @ elbow)
    ways = (-along, out / max(float(np.linalg.norm(out)), 1e-12), along)
    for point, way, name in zip((shoulder, elbow, wrist), ways, ("S", "Eᵛ", "W"), strict=True):
        axes.annotate(name, point, xytext=20 * way, textcoords="offset points",
                      ha="center", va="center", weight="bold")  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.18)
    axes.set_xlabel("distance from the axis of joint 1 (m)")
    axes.set_ylabel("height above the shoulder (m)")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=1, frameon=False, fontsize=9)


def _arc(axes: Axes, begin: float, end: float, radius: float, colour: str, label: str) -> None:
    """Draw an arc about the origin from angle `begin` to `end` (rad from the vertical axis) with a label."""
    angle = np.linspace(begin, end, _ARC_SAMPLES)
    axes.plot(radius * np.sin(angle), radius * np.cos(angle), color=colour, lw=2, label=label)
