"""Pictures in files, for the commands with ``--plot``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files.replacing import replacing
from .messages import note
from .screen import progress

_DOTS = 150


def draw(name: str, output: str, *values: Any, **options: Any) -> None:
    """Draw with a function of `plots` into a file, without a display."""
    from .. import plots
    from ..plots.style import pyplot

    plt = pyplot()
    plt.switch_backend("Agg")
    with progress(f"drawing {output}"):
        write_picture(getattr(plots, name)(*values, **options), output)
    plt.close("all")
    note(f"wrote {output}")


def write_picture(axes: Any, output: str) -> None:
    """Write the figure of axes in the format of the file's ending."""
    first = axes if hasattr(axes, "figure") else axes[0]
    ending = Path(output).suffix.lower().lstrip(".")
    known = first.figure.canvas.get_supported_filetypes()
    if ending not in known:
        raise InputError(f"{output}: unknown ending, wanted one of .png, .svg, .pdf")
    with replacing(output) as file:
        first.figure.savefig(file, format=ending, dpi=_DOTS)
