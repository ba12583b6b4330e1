"""The picture of the README, kept as a file because a README is read where nothing is built.

Written by ``python docs/pictures/readme.py``.
"""

from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
POSTURE = np.radians([10.0, 30.0, 20.0, -100.0, 30.0, 80.0, 0.0])
OTHERS = np.radians([-50.0, 75.0, 140.0])
"""Arm angles of the same pose that are drawn pale."""
DARK, PALE = "#44546A", "#C9D1DC"
TARGET = Path(__file__).parents[1] / "_static" / "readme.png"


def _links(space: Any, q: Any, colour: str, width: float) -> Any:
    """Draw base, shoulder, elbow, wrist and flange; return these points (5, 3)."""
    points = ARM.frames(q)[[0, 1, 3, 5, 7], :3, 3]
    space.plot(*points.T, color=colour, lw=width, solid_capstyle="round", solid_joinstyle="round")
    return points


def _foot(space: Any) -> None:
    """Draw the plate that the arm stands on."""
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    space.plot(0.12 * np.cos(turn), 0.12 * np.sin(turn), 0.0 * turn, color=DARK, lw=3)


def draw() -> plt.Figure:
    """An arm, three more solutions of the same pose, and the circle of its elbow."""
    figure = plt.figure(figsize=(8.4, 4.3))
    space = figure.add_axes((-0.17, -0.24, 0.92, 1.38), projection="3d", computed_zorder=False)
    pose, _, gc = ARM.forward(POSTURE)
    for psi in OTHERS:
        _links(space, ARM.inverse(pose, psi, int(gc), limits=False), PALE, 5)
    plots.stick_figure(ARM, POSTURE, ax=space)
    handles, names = space.get_legend_handles_labels()
    space.get_legend().remove()
    points = _links(space, POSTURE, DARK, 9)
    space.plot(*points[1:4].T, "o", color=DARK, ms=12, mfc="white", mew=3)
    _foot(space)
    for name, point, shift in zip(
        ("base", "shoulder", "elbow", "wrist", "tool"),
        points,
        ((0.0, -0.20, 0.02), (0.0, -0.15, 0.0), (0.0, -0.13, 0.0), (0.0, 0.08, 0.06), (0.0, 0.09, -0.03)),
        strict=True,
    ):
        space.text(*(point + shift), name, ha="center", va="center", fontsize=15, zorder=9)
    space.set_axis_off()
    space.set_title("")
    space.view_init(azim=-35, elev=18)
    words = {"feasible": "feasible"}
    words |= {f"blocked by joint {j}": f"joint {j} beyond its limit" for j in range(1, 8)}
    drawn = dict(zip(names, handles, strict=True))
    shown = [(drawn[name], text) for name, text in words.items() if name in drawn]
    figure.legend(
        *zip(*shown, strict=True),
        title="The circle of the elbow\nwhile the tool is still:",
        alignment="left",
        loc="center left",
        bbox_to_anchor=(0.54, 0.62),
        frameon=False,
        fontsize=15,
        title_fontproperties={"size": 15, "weight": "bold"},
    )
    figure.text(0.561, 0.18, "pale: other solutions\nof the same pose", fontsize=15, color="#6B7688")
    return figure


if __name__ == "__main__":
    matplotlib.use("agg")
    draw().savefig(TARGET, dpi=130, facecolor="white", pil_kwargs={"optimize": True})
