"""Pictures of the guides: an obstacle as arcs, a plan around a dead end, what armangle.plots draws."""

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
    planned = aa.plan(ARM, poses, start=TORN, gc=2)
    figure = Figure(figsize=(8.8, 3.4))
    titles = (f"follow: ends at pose {stepped.first_failure}", "plan: the whole path, proven")
    for place, motion, title in zip((121, 122), (stepped, planned), titles, strict=True):
        ax = figure.add_subplot(place)
        plots.feasible_map(motion, gc=2, ax=ax)
        ax.set_title(title, fontsize=9)
    figure.tight_layout()
    return figure


BODIED = ARM.with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
CELL = aa.Scene(
    [
        aa.Ball([0.28, 0.26, 0.6], 0.05, name="lamp"),
        aa.Box(aa.pose([0.5, -0.5, 0.6]), [0.4, 0.3, 0.02], name="shelf"),
        aa.HalfSpace([0, 0, 1], 0.0, name="floor"),
    ],
    clearance=0.01,
)
"""The arm and the scene of the page on obstacles."""


def distance_of_a_scene() -> Figure:
    """How near the links come to the scene of the page on obstacles, over psi."""
    pose, psi, gc = BODIED.forward(BESIDE)
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    plots.clearance_profile(BODIED.with_(scene=CELL), pose, int(gc), psi=float(psi), ax=figure.add_subplot())
    return figure


def map_of_a_scene() -> Figure:
    """The arm angles along the path of the page on obstacles, and the plan round the lamp."""
    pose, _, gc = BODIED.forward(BESIDE)
    poses = np.tile(pose, (200, 1, 1))
    poses[:, 1, 3] += np.linspace(0.0, 0.1, 200)
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    planned = aa.plan(BODIED.with_(scene=CELL), poses, gc=int(gc))
    plots.feasible_map(planned, gc=int(gc), ax=figure.add_subplot())
    return figure


PICTURES = {
    "distance_of_a_scene": distance_of_a_scene,
    "map_of_a_scene": map_of_a_scene,
    "obstacle_circle": obstacle_circle,
    "circle_of_arcs": circle_of_arcs,
    "map_of_a_plan": map_of_a_plan,
}
