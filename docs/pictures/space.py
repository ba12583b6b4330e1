"""Stick figures in space: what several pictures share."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import armangle as aa

Array = NDArray[np.float64]

BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILION, PURPLE, GREY = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7", "#8A8A8A",
)  # fmt: skip
"""The palette of Okabe and Ito, and a grey: told apart by colour-blind readers too."""

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
START = np.radians([-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812])
"""The posture of Eq. (37)."""


def box_axes(figure: Figure, position: Any, low: Array, high: Array, view: tuple[float, float]) -> Any:
    """Return 3-D axes with equal scales, limits (3,) in m and a view (elevation, azimuth) in degrees."""
    ax = figure.add_subplot(position, projection="3d", computed_zorder=False)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_box_aspect(high - low, zoom=1.5)
    ax.view_init(*view)
    ax.set_axis_off()
    return ax


def draw_arm(
    ax: Any, q: Array, *, arm: aa.Arm = ARM, colour: str = BLACK, width: float = 4.0, alpha: float = 1.0
) -> Array:
    """Draw base, shoulder, elbow, wrist and flange as a stick figure; return these points (5, 3)."""
    points = arm.frames(q)[[0, 1, 3, 5, 7], :3, 3]
    ax.plot(
        *points.T,
        color=colour,
        lw=width,
        alpha=alpha,
        solid_capstyle="round",
        solid_joinstyle="round",
        zorder=3,
    )
    ax.plot(
        *points[1:4].T, "o", color=colour, ms=1.6 * width, mfc="white", mew=0.4 * width, alpha=alpha, zorder=4
    )
    return points


def draw_frame(ax: Any, frame: Array, size: float = 0.12, names: str | None = None) -> None:
    """Draw the axes of a frame: x, y, z in vermilion, green, blue."""
    for axis, colour in enumerate((VERMILION, GREEN, BLUE)):
        tip = frame[:3, 3] + size * frame[:3, axis]
        ax.plot(*np.stack([frame[:3, 3], tip]).T, color=colour, lw=1.8, zorder=6)
        if names:
            ax.text(
                *(frame[:3, 3] + 1.25 * size * frame[:3, axis]),
                f"{'xyz'[axis]}$_{names}$",
                color=colour,
                fontsize=8,
            )


def draw_polygon(ax: Any, points: Array, colour: str, alpha: float) -> None:
    """Fill a flat polygon (n, 3)."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    ax.add_collection3d(Poly3DCollection([points], facecolor=colour, edgecolor="none", alpha=alpha, zorder=1))


def turned(vector: Array, axis: Array, angle: float | Array) -> Array:
    """Vectors turned about a unit axis by angles in rad, shape (..., 3)."""
    angles = np.asarray(angle)[..., None]
    along = axis * (axis @ vector)
    return along + (vector - along) * np.cos(angles) + np.cross(axis, vector) * np.sin(angles)
