"""Parts of 3-D plots: a skeleton, axes of one scale."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arrays import Floats
from ..colours import PALE

_ROOM = 1.06
_LEAST_RANGE = 0.55


def extent(points: Floats) -> float:
    """Return the largest extent of points (n, 3) along an axis, m."""
    return float(np.ptp(points, axis=0).max())


def draw_sticks(space: Any, points: Floats, colour: str, *, lw: float, label: str = "_") -> None:
    """Draw the corners (n, 3) of an arm as connected lines, joints round, tool square."""
    space.plot(*points.T, color=colour, lw=lw, solid_capstyle="round", solid_joinstyle="round", label=label)
    space.plot(*points[[0, 1, 3, 5, 6]].T, "o", color=colour, ms=lw + 2)
    space.plot(*points[-1:].T, "s", color=colour, ms=lw + 2)


def finish_space(space: Any, points: Floats, view: tuple[float, float] | None = None) -> None:
    """Give the axes one scale around points (n, 3), and labels in m; `view` is (azimuth,
    elevation) in deg.
    """
    size = extent(points)
    middle = 0.5 * (points.max(axis=0) + points.min(axis=0))
    ranges = np.maximum(np.ptp(points, axis=0), _LEAST_RANGE * size) * _ROOM
    for axis, at, span in zip("xyz", middle, ranges, strict=True):
        getattr(space, f"set_{axis}lim")(at - 0.5 * span, at + 0.5 * span)
        getattr(space, f"set_{axis}label")(f"{axis} (m)")
        side = getattr(space, f"{axis}axis")
        side.set_pane_color((1.0, 1.0, 1.0, 0.0))
        side.set_major_locator(_locator(span / ranges.max()))
        side._axinfo["grid"]["color"] = PALE
    space.set_box_aspect(ranges, zoom=0.95)
    if view is not None:
        space.view_init(azim=view[0], elev=view[1])
    space.tick_params(labelsize=8)
    if space.get_legend_handles_labels()[1]:
        space.legend(loc="center left", bbox_to_anchor=(1.04, 0.5), frameon=False, fontsize=9)


def _locator(share: float) -> Any:
    """Return ticks for an axis; `share` is its length relative to the longest axis."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(max(2, round(6 * share)))
