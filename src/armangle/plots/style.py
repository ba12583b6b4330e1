"""Axes and texts that all plots share; their colours are in `armangle.colours`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arm.arm import Arm
from ..arm.offset import unsupported
from ..colours import FULL_TURN
from ..errors import InputError, needed

if TYPE_CHECKING:
    from matplotlib.axes import Axes

UNPROVEN = "////"  # the hatch of values that are proven neither feasible nor blocked


def check_drawn(arm: Arm) -> None:
    """Raise if an arm has no arm angle to draw."""
    if arm.redundancy != "arm_angle":
        raise unsupported("this plot", "plots.path and plots.tracking draw what follow and Tracker return")


def redundancy_label(arm: Arm) -> str:
    """Return the label of an axis with values of psi: the arm angle, or the joint that replaces it."""
    name = "arm angle ψ" if arm.redundancy == "arm_angle" else f"ψ, {arm.redundancy.replace('_', ' ')}"
    return f"{name} (deg)"


def pyplot() -> Any:
    """Return matplotlib.pyplot, or raise with the command to install it."""
    return needed("matplotlib.pyplot", "plots need", "plot")


def flat_axes(ax: Axes | None, size: tuple[float, float] = (6.4, 4.0)) -> Axes:
    """Return `ax`, or the axes of a new figure of `size` (inches)."""
    plt = pyplot()
    return ax if ax is not None else plt.subplots(figsize=size, layout="constrained")[1]


def polar_axes(ax: Axes | None, size: tuple[float, float] = (8.8, 5.8)) -> Any:
    """Return `ax`, which must be polar, or new polar axes."""
    return _projected("polar", "a polar", ax, size)


def space_axes(ax: Any | None, size: tuple[float, float] = (7.2, 6.4)) -> Any:
    """Return `ax`, which must be 3-D, or new 3-D axes."""
    return _projected("3d", "a 3-D", ax, size)


def _projected(name: str, spoken: str, ax: Any | None, size: tuple[float, float]) -> Any:
    """Return `ax`, or new axes of this projection if it is None; raise if it has another projection."""
    plt = pyplot()
    if ax is None:
        return plt.subplots(figsize=size, layout="constrained", subplot_kw={"projection": name})[1]
    if ax.name != name:
        raise InputError(
            f"ax is a {ax.name} axes, wanted {spoken} one: subplot_kw={{'projection': '{name}'}}"
        )
    return ax


def grid_axes(ax: Any | None, count: int, columns: int, panel: tuple[float, float], **shared: bool) -> Any:
    """Return `count` axes as a flat array: the given ones, or a grid of `columns`, each `panel` inches."""
    plt = pyplot()
    if ax is not None:
        given = np.atleast_1d(np.asarray(ax, dtype=object)).ravel()
        if len(given) != count:
            raise InputError(f"ax holds {len(given)} axes, wanted {count}")
        return given
    rows = -(-count // columns)
    size = (panel[0] * columns, panel[1] * rows)
    _, made = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **shared)
    for spare in made.ravel()[count:]:
        spare.remove()
    return made.ravel()[:count]


def angle_ticks(axis: Any, step: float = 90.0) -> None:
    """Put ticks at multiples of `step` degrees on an axis of a full turn."""
    half = FULL_TURN / 2
    axis.set_ticks(np.arange(-half, half + step / 2, step))


def shared_legend(panels: Any, most: int) -> None:
    """Draw one legend for all panels below them, each label once, in at most so many columns."""
    shown: dict[str, Any] = {}
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            shown.setdefault(label, handle)
    if shown:
        panels[0].figure.legend(shown.values(), shown.keys(), loc="outside lower center",
                                ncols=min(len(shown), most), frameon=False)  # fmt: skip


def outer_legend(ax: Any, **options: Any) -> None:
    """Put the legend to the right of the axes, off the data."""
    ax.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0, frameon=False, **options)
