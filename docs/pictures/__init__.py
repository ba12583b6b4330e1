"""The pictures of the pages, each a function that returns a figure, drawn from what the library computes."""

from collections.abc import Callable
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from . import architecture, conventions, howto, theory

PICTURES: dict[str, Callable[[], Figure]] = (
    conventions.PICTURES | theory.PICTURES | howto.PICTURES | architecture.PICTURES
)

STYLE = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.hashsalt": "armangle",
    "svg.fonttype": "path",
    "figure.dpi": 100.0,
    "savefig.facecolor": "white",
}


def draw_all(folder: Path) -> None:
    """Write every picture as SVG into a folder."""
    folder.mkdir(exist_ok=True)
    with matplotlib.rc_context(STYLE):
        for name, draw in PICTURES.items():
            figure = draw()
            flat = all(ax.name != "3d" for ax in figure.axes)  # a 3-D box is larger than what is drawn in it
            box = "tight" if flat else None
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None}, bbox_inches=box)
