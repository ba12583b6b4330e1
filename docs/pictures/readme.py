"""The picture of the README, kept as a file because a README is read where nothing is built.

Written by ``python docs/pictures/readme.py``.
"""

from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

START = np.radians([-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812])
TARGET = Path(__file__).parents[1] / "_static" / "readme.png"


def draw() -> plt.Figure:
    """The paper's posture (37) with its elbow circle, and the feasible map of the paper's line."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    pose, _, gc = arm.forward(START)
    poses = np.tile(pose, (251, 1, 1))
    poses[:, :3, 3] += np.linspace(0.0, 0.25, 251)[:, None] * pose[:3, 2]
    path = aa.follow(arm, poses, start=START)
    figure = plt.figure(figsize=(9.6, 3.6))
    left = figure.add_axes((-0.04, -0.12, 0.46, 1.24), projection="3d")
    plots.stick_figure(arm, START, ax=left)
    left.set_axis_off()
    left.set_title("")
    if left.get_legend():
        left.get_legend().remove()
    right = figure.add_axes((0.46, 0.17, 0.52, 0.72))
    plots.feasible_map(path, gc=int(gc), ax=right)
    right.set_title("coloured: a joint forbids this arm angle; line: the one chosen", fontsize=9)
    return figure


if __name__ == "__main__":
    matplotlib.use("agg")
    draw().savefig(TARGET, dpi=100, pil_kwargs={"optimize": True})
