"""Reachability: a section through a reach map, and spheres at the positions of the end effector."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arm.arm import Arm
from ..arm.skeleton import skeleton
from ..colours import BLACK
from .space import draw_sticks, finish_space
from .style import check_drawn, flat_axes, space_axes

if TYPE_CHECKING:
    from ..reach.reach_map import ReachMap
    from ..reach.voxels import Voxels

_LABELS = {
    "gc": "share of directions held",
    "freedom": "mean freedom of the arm angle (rad)",
    "yaw": "mean share of azimuths",
    "roll": "mean share of rolls",
    "proven": "share of directions proven to be held",
    "unproven": "share of directions neither held nor excluded",
}
_LARGEST = 60.0  # pt², of a sphere where every orientation is reachable


def reach(found: ReachMap, field: str = "gc", *, ax: Any = None) -> Any:
    """Draw the mean of a field over all directions of axis 7, for each wrist position.

    Parameters
    ----------
    found : ReachMap
    field : str
        One of its fields: `ReachMap.section`.
    ax : axes, optional
        A new figure by default.

    Returns
    -------
    matplotlib axes
        A half plane through axis 1, in metres from the shoulder; white is unreachable. The title of an own
        chain's map says how many cells are neither held nor excluded.

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    InputError
        If the map has no such field.
    """
    values = found.section(field)
    panel = flat_axes(ax, (4.8, 6.0))
    r, z = found.axes["r"], found.axes["z"]
    held = panel.pcolormesh(r, z, np.where(values > 0, values, np.nan).T, cmap="viridis", vmin=0.0)
    if ax is None:
        panel.figure.colorbar(held, ax=panel, label=_LABELS[field])
    panel.plot(0.0, 0.0, "o", color=BLACK, ms=5, label="shoulder")
    panel.set_aspect("equal")
    panel.set_xlabel("wrist beside axis 1 (m)")
    panel.set_ylabel("wrist above the shoulder (m)")
    title = f"{found.arm.name or 'arm'}, {1e3 * found.spacing:g} mm"
    if "unproven" in found.fields:
        title += f"\n{found.unproven} of {math.prod(found.shape)} cells not proven"
    panel.set_title(title, fontsize=9)
    return panel


def voxels(found: Voxels, arm: Arm | None = None, *, ax: Any = None) -> Any:
    """Draw voxels as spheres: larger and lighter for more orientations.

    Parameters
    ----------
    found : Voxels
        The result of `ReachMap.voxels`.
    arm : Arm, optional
        Drawn too, at zero joints.
    ax : 3-D axes, optional
        A new figure by default.

    Returns
    -------
    matplotlib axes

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    UnsupportedError
        If the arm has an offset wrist or shoulder.
    """
    if arm is not None:
        check_drawn(arm)
    space = space_axes(ax)
    shown = space.scatter(
        *found.position.T, c=found.share, s=_LARGEST * found.share, cmap="viridis", vmin=0.0, alpha=0.5, lw=0
    )
    points = found.position
    if arm is not None:
        corners = skeleton(arm, np.zeros(7))
        draw_sticks(space, corners, BLACK, lw=3.0)
        points = np.concatenate([points, corners])
    if len(points):
        finish_space(space, points)
    if ax is None:
        space.figure.colorbar(shown, ax=space, label="share of orientations held", shrink=0.7)
    return space
