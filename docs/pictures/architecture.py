"""The picture of the layers, drawn from architecture.toml, which the tests of imports and includes read."""

import tomllib
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from .space import BLACK, BLUE, GREEN, GREY

ORDER = Path(__file__).parents[2] / "architecture.toml"
WIDTH, HEIGHT, GAP = 10.0, 1.0, 0.14
TITLES = {"core": "include/armangle", "python": "src/armangle"}


def _layer(ax: Any, layer: dict[str, Any], bottom: float, colour: str) -> None:
    """One floor: its rooms side by side, what it is about written below them."""
    rooms = [*layer.get("ordered", ()), *layer.get("rooms", ())]
    width = (WIDTH - GAP * (len(rooms) - 1)) / len(rooms)
    for place, room in enumerate(rooms):
        left = place * (width + GAP)
        box = FancyBboxPatch(
            (left, bottom + 0.34),
            width,
            0.58,
            boxstyle="round,pad=0,rounding_size=0.1",
            facecolor=colour,
            alpha=0.22,
        )
        ax.add_patch(box)
        ax.text(left + width / 2, bottom + 0.63, room, ha="center", va="center", fontsize=9.5, color=BLACK)
    ax.text(0.0, bottom + 0.17, layer["about"], ha="left", va="center", fontsize=7.5, color=GREY)


def layers() -> Figure:
    """Both houses, the ground floor below: a room may use what lies on lower floors."""
    order = tomllib.loads(ORDER.read_text(encoding="utf-8"))
    figure = Figure(figsize=(11.0, 5.4), layout="constrained")
    tallest = max(len(layers) for layers in order.values())
    for place, ((root, layers_of), colour) in enumerate(zip(order.items(), (BLUE, GREEN), strict=True)):
        ax = figure.add_subplot(1, len(order), place + 1)
        for floor, layer in enumerate(layers_of):
            _layer(ax, layer, floor * HEIGHT, colour)
        ax.set(xlim=(-0.1, WIDTH + 0.1), ylim=(0.0, tallest * HEIGHT))
        ax.set_title(TITLES[root], fontsize=11, loc="left")
        ax.set_axis_off()
    return figure


PICTURES = {"layers": layers}
