"""Pictures of the how-to pages: an obstacle as arcs, a plan around a dead end, what armangle.plots draws."""

import numpy as np
from matplotlib.figure import Figure

import armangle as aa
from armangle import plots

from .space import ARM, START, Array

BESIDE = np.radians([20.0, 45.0, 10.0, -80.0, 10.0, 60.0, 0.0])
"""The posture of the page on obstacles."""
TORN = np.array([1.59, 0.4, -1.12, -1.13, -1.26, 0.4, -1.38])
"""Joints at the start of a line on which step by step leads into a dead end."""


def obstacle_circle() -> Figure:
    """The redundancy circle of a pose with arcs that a user forbids."""
    pose, psi, gc = ARM.forward(BESIDE)
    figure = Figure(figsize=(8.8, 5.4))
    free = ~aa.ArcSet(np.radians([[60.0, 120.0]]))
    plots.circle(ARM, pose, int(gc), psi=float(psi), allowed=free, ax=figure.add_subplot(projection="polar"))
    return figure


def circle_of_arcs() -> Figure:
    """The redundancy circle of the paper's posture."""
    pose, psi, gc = ARM.forward(START)
    figure = Figure(figsize=(8.8, 5.4))
    plots.circle(ARM, pose, int(gc), psi=float(psi), ax=figure.add_subplot(projection="polar"))
    return figure


def drop() -> Array:
    """Poses (201, 4, 4) of a line 0.3 m along -y from the posture TORN."""
    first = ARM.forward(TORN)[0]
    last = first.copy()
    last[1, 3] -= 0.3
    return aa.Line(first, last).pose(np.linspace(0.0, 1.0, 201))


def map_of_a_plan() -> Figure:
    """The same line step by step, which ends in a dead end, and as a whole."""
    poses = drop()
    stepped = aa.follow(ARM, poses, start=TORN, policy=aa.Repulsion(outside="stop"))
    planned = aa.plan(ARM, poses, start=TORN)
    figure = Figure(figsize=(8.8, 3.4))
    titles = (f"follow: ends at pose {stepped.first_failure}", "plan: the whole path, proven")
    for place, motion, title in zip((121, 122), (stepped, planned), titles, strict=True):
        ax = figure.add_subplot(place)
        plots.feasible_map(motion, gc=2, ax=ax)
        ax.set_title(title, fontsize=9)
    figure.tight_layout()
    return figure


PICTURES = {
    "obstacle_circle": obstacle_circle,
    "circle_of_arcs": circle_of_arcs,
    "map_of_a_plan": map_of_a_plan,
}
