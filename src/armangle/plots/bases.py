"""Base placement: the reached weight from each position, and the best yaw."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._arrays import Floats
from ..colours import BLACK, JOINT_COLOURS
from .style import flat_axes

if TYPE_CHECKING:
    from ..reach.placement import Placement

_ARROWS = 21  # largest number along each side


def placement(found: Placement, *, ax: Any = None) -> Any:
    """Draw the weight of reached poses for each base position, and the best yaw there.

    Parameters
    ----------
    found : Placement
        The result of `armangle.place`.
    ax : axes, optional
        A new figure by default.

    Returns
    -------
    matplotlib axes
        Seen from above, in metres. Dark is more. An arrow points along the base's x axis at the best yaw, and
        is omitted if every yaw is equally good. The cross is `Placement.best`, dots are the poses.

    Raises
    ------
    MissingExtraError
        Without matplotlib.
    """
    panel = flat_axes(ax, (7.0, 5.6))
    x, y = found.x, found.y
    held = panel.pcolormesh(
        _edges(x),
        _edges(y),
        found.reached.T,
        cmap="Blues",
        vmin=0.0,
        vmax=max(float(found.weight.sum()), 1e-9),
    )
    if ax is None:
        panel.figure.colorbar(held, ax=panel, label="held (sum of weights)")
    every = [slice(None, None, -(-len(line) // _ARROWS)) for line in (x, y)]
    yaw, chosen = found.yaw[every[0], every[1]], (found.stretch < 2 * np.pi - 1e-6) & (found.reached > 0)
    shown = chosen[every[0], every[1]]
    across, along = np.meshgrid(x[every[0]], y[every[1]], indexing="ij")
    panel.quiver(
        across[shown], along[shown], np.cos(yaw[shown]), np.sin(yaw[shown]),
        pivot="mid", scale=1.4 * _ARROWS, width=0.004, color=BLACK,
    )  # fmt: skip
    if len(found.poses):
        panel.plot(
            *found.poses[:, :2, 3].T, ".", color=JOINT_COLOURS[0], ms=4, mew=0, label="poses", zorder=3
        )
    best = found.best()
    panel.plot(*best[:2, 3], "x", color=JOINT_COLOURS[5], ms=10, mew=2.5, label="best base", zorder=4)
    panel.set_aspect("equal")
    panel.set_xlabel("x (m)")
    panel.set_ylabel("y (m)")
    panel.set_title(f"{found.arm.name or 'arm'}: {found}".replace(", which", ",\nwhich"), fontsize=9)
    panel.legend(loc="upper right", fontsize=8)
    return panel


def _edges(line: Floats) -> Floats:
    """Return the borders between cells centred at rising positions (m); one position gets a cell of 0.1 m."""
    if len(line) == 1:
        return np.array([line[0] - 0.05, line[0] + 0.05])
    middle = 0.5 * (line[1:] + line[:-1])
    return np.concatenate([[2 * line[0] - middle[0]], middle, [2 * line[-1] - middle[-1]]])
