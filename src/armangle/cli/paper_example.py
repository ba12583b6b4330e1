"""The paper's example (section 6.2): a straight line that begins near the limits, stepped along by eq. (36).

The paper's text fixes the robot, the joints (37), the distance, K = 0.1 for varying α and α = 20 for varying
K. It does not give the varying values and the number of poses: they are chosen here.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass, replace
from typing import Any, BinaryIO

import numpy as np

from .. import plots
from .._arrays import Floats
from ..arm.arm import Arm
from ..colours import (
    BLACK,
    GREEN,
    JOINT_COLOURS,
    PURPLE,
    SKY,
    VERMILION,
    unjoined,
    wrapped_degrees,
)
from ..motion.following import follow
from ..motion.joint_path import JointPath
from ..motion.policies import Repulsion
from ..plots.style import pyplot, shared_legend

ROBOT = "kuka_iiwa7_r800"
START_DEG = (-5.4101, -26.4986, -48.1542, -61.65, 152.6198, 114.4466, 8.1812)
DISTANCE = 0.25
POSES = 251
ALPHAS = (5.0, 20.0, 100.0)
STRENGTHS = (0.02, 0.1, 0.5)
_K, _ALPHA = 0.1, 20.0
POLICIES = (
    *(Repulsion(K=_K, alpha=alpha) for alpha in ALPHAS),
    *(Repulsion(K=K, alpha=_ALPHA) for K in STRENGTHS if K != _K),
)

_REPEATS = 25
_SIZE, _WIDE = (9.0, 9.0), (11.0, 5.6)
_BEFORE = -1.0 / (POSES - 1)  # s of the start: one step before the first pose
_CURVES = (BLACK, VERMILION, GREEN, PURPLE, SKY)  # none of the colours of joints 1 and 5, which block
_ROOM = 0.02  # of the line, to the left of the start
_DPI = 120
_GRID = 721
_ROOM_DEG = 25.0
_WORDS = {(5.0, _K): "from afar", (_ALPHA, _K): "near a limit", (100.0, _K): "at a limit only",
          (_ALPHA, 0.02): "near a limit, weakly", (_ALPHA, 0.5): "near a limit, strongly"}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Run:
    """One run of the example.

    Its `policy`, with K and α, and the `path` that results; `start`, joints (37) before the first pose, rad,
    with arm angle `psi_start`, rad, and `gc_start` there; `seconds_per_pose`, the median of repeated runs,
    measured during this run.
    """

    policy: Repulsion
    path: JointPath
    start: Floats
    psi_start: float
    gc_start: int
    seconds_per_pose: float

    @property
    def name(self) -> str:
        """Name of the run's files, without ending."""
        return f"alpha{self.policy.alpha:g}_K{self.policy.K:g}"

    @property
    def words(self) -> str:
        """The settings in words."""
        return _WORDS[self.policy.alpha, self.policy.K]

    @property
    def largest_step(self) -> float:
        """Largest change of a joint between poses, including the start, rad."""
        return float(np.abs(np.diff(np.vstack([self.start, self.path.q]), axis=0)).max())


def example() -> tuple[Arm, Floats, Floats]:
    """Return the arm, the joints (37) (7,), rad, and the poses (251, 4, 4) from (38) to (39).

    Examples
    --------
    >>> arm, start, poses = example()
    >>> poses[-1, :3, 3].round(4).tolist()
    [-0.1966, 0.0712, 1.1146]
    """
    arm = Arm.from_catalogue(ROBOT)
    start = np.radians(START_DEG)
    pose = arm.forward(start)[0]
    poses = np.repeat(pose[None], POSES, axis=0)
    poses[:, :3, 3] += np.linspace(0.0, DISTANCE, POSES)[:, None] * pose[:3, 2]
    return arm, start, poses


def run(policy: Repulsion) -> Run:
    """Return the example stepped with a policy.

    The paper has no largest joint step, so none is set: with K = 0.5 the first step would exceed the default.

    Examples
    --------
    >>> made = run(Repulsion(K=0.1, alpha=20))
    >>> round(float(np.degrees(made.psi_start)), 4), made.gc_start, made.path.ok
    (58.5882, 3, True)
    """
    arm, start, poses = example()
    _, psi, gc = arm.forward(start)
    took = []
    for _ in range(_REPEATS):
        began = time.perf_counter()
        path = follow(arm, poses, start=start, policy=policy, max_joint_step=np.inf)
        took.append(time.perf_counter() - began)
    return Run(policy, path, start, float(psi), int(gc), statistics.median(took) / POSES)


def draw(made: Run, file: BinaryIO) -> None:
    """Write a PNG of arm angle and joints along the path, with limits, as in Fig. 13.

    The start is drawn one step before the first pose, so that the first step is visible. Raises
    `MissingExtraError` without matplotlib.
    """
    figure = _figure(_SIZE)
    panels = plots.path(from_start(made), ax=figure.subplots(4, 2, sharex=True))
    _shade_infeasible(panels[0], made)
    for panel, value in zip(panels, (made.psi_start, *made.start), strict=True):
        panel.plot(_BEFORE, np.degrees(value), "o", ms=5, color=BLACK, clip_on=False, zorder=5, label="start")
        panel.grid(lw=0.4, alpha=0.5)
        panel.set_xlim(-_ROOM * (1.0 - _BEFORE), 1.0)
    shared_legend(panels, 3)
    figure.suptitle(f"The elbow is pushed off the joint limits: {made.words} (α = {made.policy.alpha:g}, "
                    f"K = {made.policy.K:g})\nwhile the tool moves {DISTANCE:g} m along a line")  # fmt: skip
    figure.savefig(file, format="png", dpi=_DPI)


def draw_overview(runs: list[Run], file: BinaryIO) -> None:
    """Write a PNG of all runs: their arm angles with the blocked ones, and their margins.

    Raises `MissingExtraError` without matplotlib.
    """
    figure = _figure(_WIDE)
    from matplotlib.patches import Patch

    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    arm, gc = runs[0].path.arm, runs[0].gc_start
    plots.feasible_map((arm, runs[0].path.poses), gc=gc, ax=left)
    for made, colour in zip(runs, _CURVES, strict=True):
        path = from_start(made)
        label = f"{made.words} (α = {made.policy.alpha:g}, K = {made.policy.K:g})"
        s, psi = unjoined(path.s, wrapped_degrees(path.psi))
        left.plot(s, psi, color="white", lw=4.5)
        left.plot(s, psi, color=colour, lw=2.0)
        right.plot(path.s, np.degrees(path.margin), color=colour, lw=2.0, label=label)
    first = runs[0]
    before = [np.degrees(angle) for angle in (first.psi_start, arm.limit_margin(first.start))]
    for panel, value in zip((left, right), before, strict=True):
        panel.plot(_BEFORE, value, "o", color=BLACK, ms=6, zorder=5, clip_on=False, label="start")
        panel.set_xlim(-_ROOM * (1.0 - _BEFORE), 1.0)
        panel.set_xlabel("share of the line")
    left.set_title("Arm angles: light green is free, other colours are blocked by a joint", fontsize=10)
    right.set_title("Distance to the nearest joint limit", fontsize=10)
    right.set_ylabel("least margin (deg)")
    right.set_ylim(bottom=0.0)
    right.grid(lw=0.4, alpha=0.5)
    blocked = ~arm.feasible(first.path.poses, gc, per_joint=True).is_full.all(axis=0)
    keys = [Patch(fc=JOINT_COLOURS[k], label=f"joint {k + 1} blocks") for k in np.flatnonzero(blocked)]
    figure.legend(handles=[*right.get_legend_handles_labels()[0], *keys], loc="outside lower center", ncols=3,
                  frameon=False)  # fmt: skip
    figure.suptitle(f"One straight line of {DISTANCE:g} m, {len(runs)} ways to keep off the joint limits")
    figure.savefig(file, format="png", dpi=_DPI)


def _figure(size: tuple[float, float]) -> Any:
    """Return a new figure; the error for a missing matplotlib tells how to install it."""
    pyplot()
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout="constrained")


def from_start(made: Run) -> JointPath:
    """Return the path with the start one step before it, so that the first step is visible."""
    path = made.path
    before: dict[str, Any] = {
        "s": _BEFORE, "q": made.start, "psi": made.psi_start, "gc": made.gc_start,
        "margin": path.arm.limit_margin(made.start),
    }  # fmt: skip
    rows: dict[str, Any] = {
        name: np.concatenate(
            [np.asarray(before.get(name, getattr(path, name)[0]))[None], getattr(path, name)]
        )
        for name in ("s", "poses", "q", "psi", "gc", "status", "margin", "residual")
    }
    return replace(path, **rows)


def _shade_infeasible(panel: Any, made: Run) -> None:
    """Shade the infeasible arm angles of each pose in a panel of arm angle over s."""
    path = made.path
    shown = np.degrees([made.psi_start, *path.psi])
    low, high = shown.min() - _ROOM_DEG, shown.max() + _ROOM_DEG
    grid = np.linspace(low, high, _GRID)
    inside = path.arm.feasible(path.poses, path.gc).contains(np.radians(grid)[:, None])
    blocked = ~np.asarray(inside)
    if blocked.any():
        panel.contourf(path.s, grid, blocked, levels=[0.5, 1.5], colors=[VERMILION], alpha=0.12)
        panel.contour(
            path.s, grid, blocked, levels=[0.5], colors=[VERMILION], linestyles="--", linewidths=1.2
        )
    panel.set_ylim(low, high)
