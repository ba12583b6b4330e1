"""The arm in space: DH frames, and the stick figure with its elbow circle. Fig. 1."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import JOINTS, Floats, one_posture
from ..arm.arm import Arm
from ..arm.skeleton import NOT_PROVEN, blocker_of, corners, elbow_points, skeleton
from ..colours import BLACK, BLOCKED_WIDTH, BLUE, FREE, FREE_WIDTH, GREEN, JOINT_COLOURS, MID, PALE, VERMILION
from .space import draw_sticks, extent, finish_space
from .style import check_drawn, space_axes

_SAMPLES = 721
_AXIS_SHARE = 0.09
_NEAR, _ASIDE = 0.13, 0.3
_TINY = 1e-12
# Matplotlib's own viewpoint: azimuth -60, elevation 30 degrees.
_TO_VIEWER, _RIGHT = np.array([0.433, -0.75, 0.5]), np.array([0.866, 0.5, 0.0])


def arm_frames(arm: Arm, q: ArrayLike | None = None, *, ax: Any = None) -> Any:
    """Draw the arm with its DH frames 0..7 and the tool frame.

    Frames that share an origin are drawn next to each other, each connected to it by a thin line.

    Parameters
    ----------
    arm : Arm
    q : array_like, shape (7,), optional
        Joint values, rad; zero by default.
    ax : matplotlib 3-D axes, optional
        The axes to draw on; a new figure by default.

    Returns
    -------
    matplotlib 3-D axes

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    InputError
        If q is not seven finite numbers.
    UnsupportedError
        If the arm has an offset wrist or shoulder.

    Source: Faria et al. (2018), Fig. 1, Table 1.
    """
    check_drawn(arm)
    joints = one_posture("q", np.zeros(JOINTS) if q is None else q)
    space = space_axes(ax)
    points, frames = skeleton(arm, joints), arm.frames(joints)
    size = extent(points)
    draw_sticks(space, points, MID, lw=4)
    before = frames[0, :3, 3]
    for members in _neighbours(frames[:, :3, 3], _NEAR * size):
        way = np.cross(_TO_VIEWER, frames[members[0], :3, 3] - before)
        way /= max(float(np.linalg.norm(way)), _TINY)
        before = frames[members[0], :3, 3]
        for k, i in enumerate(members):
            aside = frames[i, :3, 3] + (k - 0.5 * (len(members) - 1)) * _ASIDE * size * way
            _frame(space, frames[i], aside, size * _AXIS_SHARE, f"{{{i}}}")
    tip = frames[7] @ arm.tool
    if np.linalg.norm(tip[:3, 3] - frames[7, :3, 3]) > 1e-6 * size:
        _frame(space, tip, tip[:3, 3], size * _AXIS_SHARE, "tool")
    for colour, name in zip((VERMILION, GREEN, BLUE), "xyz", strict=True):
        space.plot([], [], [], color=colour, lw=2, label=name)
    around = np.array([[1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]]) * 0.3 * size
    finish_space(space, np.vstack([points, *(points[[0, 6]] + way for way in around)]))
    space.set_title(f"{arm.name}: DH frames 0 to 7", fontsize=10)
    return space


def _neighbours(origins: Floats, near: float) -> list[list[int]]:
    """Return groups of consecutive frames whose origins (n, 3) are within `near` (m) of the group's first."""
    runs = [[0]]
    for i in range(1, len(origins)):
        if np.linalg.norm(origins[i] - origins[runs[-1][0]]) <= near:
            runs[-1].append(i)
        else:
            runs.append([i])
    return runs


def _frame(space: Any, frame: Floats, origin: Floats, length: float, name: str) -> None:
    """Draw the axes of a frame at `origin` with its name, and a thin line from where the frame really is."""
    space.plot(*np.array([frame[:3, 3], origin]).T, color=BLACK, lw=0.6, ls=":")
    for column, colour in enumerate((VERMILION, GREEN, BLUE)):
        space.plot(*np.array([origin, origin + length * frame[:3, column]]).T, color=colour, lw=2)
    label = origin + 0.55 * length * _emptiest_way(frame)
    space.text(*label, name, fontsize=9, ha="center", va="center")


def _emptiest_way(frame: Floats) -> Floats:
    """Return, of 16 unit vectors across the line of sight, the one farthest from the axes of a frame."""
    angle = np.arange(0.0, 2 * np.pi, np.pi / 8)[:, None]
    ways: Floats = np.cos(angle) * _RIGHT + np.sin(angle) * np.cross(_TO_VIEWER, _RIGHT)
    nearest: Floats = (ways @ frame[:3, :3]).max(axis=1)
    return np.array(ways[nearest.argmin()])


def stick_figure(
    arm: Arm,
    q: ArrayLike,
    *,
    elbow_circle: bool = True,
    ax: Any = None,
) -> Any:
    """Draw the arm as a stick figure, with its elbow circle coloured by the blocking joint.

    Parameters
    ----------
    arm : Arm
    q : array_like, shape (7,)
        Joint values, rad.
    elbow_circle : bool
        Whether to draw the circle: a light, wide band if feasible, otherwise a line in the colour of the
        lowest blocking joint; pale grey without a proof. The elbow of an arm with an offset moves on a
        closed curve, or on pieces of one.
    ax : matplotlib 3-D axes, optional
        The axes to draw on; a new figure by default.

    Returns
    -------
    matplotlib 3-D axes

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    InputError
        If q is not seven finite numbers.
    UnreachableError
        If the arm is folded and has no circle.
    """
    joints = one_posture("q", q)
    points = skeleton(arm, joints)
    space = space_axes(ax)
    draw_sticks(space, corners(arm, joints), MID, lw=5)
    shown = points
    if elbow_circle:
        pose, psi, gc = arm.forward(joints)
        circle = _coloured_circle(space, arm, pose, int(gc))
        shown = np.vstack([points, circle[np.isfinite(circle).all(axis=1)]])
        space.plot(*points[3:4].T, "o", color=BLACK, ms=9, mfc="white", mew=2, label="elbow")
        space.set_title(f"{arm.name}: GC {gc}, ψ = {np.degrees(psi):.1f}°".replace("-", "−"), fontsize=10)
    finish_space(space, shown)
    return space


def _coloured_circle(space: Any, arm: Arm, pose: Floats, gc: int) -> Floats:
    """Draw the elbow circle in pieces of one colour each; return its points."""
    psi = np.linspace(-np.pi, np.pi, _SAMPLES)
    circle = elbow_points(arm, pose, gc, psi)
    middles = 0.5 * (psi[1:] + psi[:-1])
    who = blocker_of(arm, pose, gc, middles)
    drawn = {
        0: ("feasible", FREE, FREE_WIDTH),
        NOT_PROVEN: ("not proven", PALE, BLOCKED_WIDTH),
        **{
            k + 1: (f"blocked by joint {k + 1}", colour, BLOCKED_WIDTH)
            for k, colour in enumerate(JOINT_COLOURS)
        },
    }
    seen: set[int] = set()
    cuts = [0, *(np.flatnonzero(np.diff(who)) + 1).tolist(), len(who)]
    for begin, end in pairwise(cuts):
        code = int(who[begin])
        name, colour, width = drawn[code]
        label = "_" if code in seen else name
        space.plot(*circle[begin : end + 1].T, color=colour, lw=width, label=label)
        seen.add(code)
    return circle
