"""The page of supported robots says what each kind of arm can do: its table is compared with the calls."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.calibrated import calibrated
from support.needs import need

import armangle as aa

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8")
NO, YES, PROVEN = "–", "yes", "proven"
ARMS = {
    "srs": aa.Arm.load("kuka_iiwa7_r800"),
    "srs_chain": calibrated("kuka_iiwa7_r800", 0.5, 0.5),
    "offset_wrist": aa.Arm.load("franka_fr3"),
    "offset_shoulder": aa.Arm.load("fetch"),
    "offset_wrist_chain": calibrated("franka_fr3", 0.5, 0.5),
    "offset_shoulder_chain": calibrated("fetch", 0.5, 0.5),
}


class At:
    """An arm at ordinary joints `q` with pose, psi and gc there; `next` is 1 mm off, `far` out of reach."""

    def __init__(self, kind: str) -> None:
        self.arm = ARMS[kind]
        middle = (np.clip(self.arm.lower, -3.0, 3.0) + np.clip(self.arm.upper, -3.0, 3.0)) / 2
        self.q = middle + np.array([0.3, -0.35, 0.25, 0.3, 0.2, 0.4, 0.15])
        self.pose, self.psi, self.gc = self.arm.forward(self.q)
        self.next = self.pose.copy()
        self.next[0, 3] += 1e-3
        self.far = self.pose.copy()
        self.far[:3, 3] += 9.0
        self.scene = aa.Scene([aa.Ball([3.0, 3.0, 3.0], 0.1, name="lamp")])

    def guarded(self) -> aa.Arm:
        """Return the arm with a body, and an obstacle far away."""
        return self.arm.with_(scene=self.scene, body=aa.Body.bones(0.05, 0.05))


def proven_arcs(arcs: aa.ArcSet) -> bool:
    """Whether nothing of the arcs is unproven."""
    return float(np.sum(arcs.unproven)) == 0.0


def solved(found: aa.Solution) -> bool:
    """Whether the status is OK."""
    return found.status == aa.Status.OK


def tracked(tracker: aa.Tracker, at: At) -> None:
    """Start a tracker and step it once."""
    tracker.start(at.q).step(at.next)


def mapped(at: At) -> None:
    """Make a small reach map."""
    need("zarr")
    with tempfile.TemporaryDirectory() as folder:
        aa.reach_map(at.arm, f"{folder}/map.zarr", spacing=0.5, tilt=1.0, progress=False)


def drawn(at: At) -> None:
    """Draw the elbow's circle."""
    need("matplotlib")
    from armangle import plots

    plots.circle(at.arm, at.pose, int(at.gc))


def viewed(at: At) -> None:
    """Make a viewer's state."""
    need("viser")
    from armangle import viewer

    viewer.ViewerState(at.arm)


def of_torch(at: At) -> None:
    """Make torch's functions of the arm."""
    need("torch")
    aa.torch.Kinematics(at.arm)


def of_jax(at: At) -> None:
    """Make jax's functions of the arm, and call one."""
    need("jax")
    aa.jax.Kinematics(at.arm).inverse(at.pose, at.psi, at.gc)


CALLS: dict[str, tuple[Callable[[At], Any], ...]] = {
    "`arm.forward`, `frames`, `elbow`, `jacobian`, `limit_margin`": (
        lambda at: at.arm.forward(at.q),
        lambda at: at.arm.frames(at.q),
        lambda at: at.arm.elbow(at.q),
        lambda at: at.arm.jacobian(at.q),
        lambda at: at.arm.limit_margin(at.q),
    ),
    "`arm.inverse`": (lambda at: at.arm.inverse(at.pose, at.psi, at.gc),),
    "`arm.feasible`, with `scene` too": (
        lambda at: proven_arcs(at.arm.feasible(at.pose, at.gc)),
        lambda at: proven_arcs(at.guarded().feasible(at.pose, at.gc)),
    ),
    "`arm.feasible` with `singularity_margin`": (
        lambda at: proven_arcs(at.arm.with_(singularity_margin=0.02).feasible(at.pose, at.gc)),
    ),
    "`arm.solve`, with `scene` too": (
        lambda at: solved(at.arm.solve(at.pose, seed=at.q + 0.05)),
        lambda at: solved(at.guarded().solve(at.pose, seed=at.q + 0.05)),
    ),
    '`arm.solve(prefer="margin")`, `arm.solve(roll="free")`': (
        lambda at: solved(at.arm.solve(at.pose, prefer="margin")),
        lambda at: solved(at.arm.solve(at.pose, seed=at.q, roll="free")),
    ),
    '`arm.solve(fallback="nearest_pose")`': (
        lambda at: at.arm.solve(at.far, seed=at.q, fallback="nearest_pose"),
    ),
    "`arm.solutions`": (lambda at: at.arm.solutions(at.pose, seed=at.q),),
    "`arm.reachable`, `freedom`": (
        lambda at: at.arm.reachable(at.pose),
        lambda at: at.arm.freedom(at.pose),
    ),
    "`arm.explain`": (lambda at: at.arm.explain(at.pose),),
    "`arm.feasible_turns`": (lambda at: at.arm.feasible_turns(at.pose, about="base"),),
    "`arm.self_motion`, `psi_towards`, `clearance`": (
        lambda at: at.arm.self_motion(at.pose, at.psi, at.gc),
        lambda at: at.arm.psi_towards(at.pose, at.gc, direction="up"),
        lambda at: at.guarded().clearance(at.q),
    ),
    "`aa.step`, `aa.follow`, with bounds, `aa.Towards` and `lookahead` too": (
        lambda at: aa.step(at.arm, at.q, at.next),
        lambda at: aa.step(at.arm, at.q, at.next, velocity=1.0, dt=0.01),
        lambda at: aa.step(at.arm, at.q, at.next, policy=aa.Towards(direction="up")),
        lambda at: aa.follow(at.arm, [at.pose, at.next], start=at.q),
        lambda at: aa.follow(at.arm, [at.pose, at.next], start=at.q, lookahead=1),
    ),
    '`aa.step(fallback="nearest_pose")`': (
        lambda at: aa.step(at.arm, at.q, at.far, fallback="nearest_pose"),
    ),
    '`aa.follow(roll="free")`': (lambda at: aa.follow(at.arm, [at.pose, at.next], start=at.q, roll="free"),),
    '`aa.plan(roll="free")`': (
        lambda at: aa.plan(at.arm, aa.Line(at.pose, at.next), start=at.q, roll="free"),
    ),
    "`aa.plan`, with `scene` too": (
        lambda at: aa.plan(at.arm, aa.Line(at.pose, at.next), start=at.q).certified,
        lambda at: aa.plan(at.guarded(), aa.Line(at.pose, at.next), start=at.q).certified,
    ),
    "`aa.Tracker`": (lambda at: tracked(aa.Tracker(at.arm, dt=0.01, velocity=1.0), at),),
    "`aa.Tracker` with `scene`": (lambda at: tracked(aa.Tracker(at.guarded(), dt=0.01, velocity=1.0), at),),
    "`aa.JointPath.from_joints`, `aa.retime`": (
        lambda at: aa.retime(
            aa.JointPath.from_joints(at.arm, [at.q, at.q + 0.01]), velocity=1.0, acceleration=5.0
        ),
    ),
    "`aa.place`": (lambda at: aa.place(at.arm, at.pose[None], [0.0], [0.0]),),
    "`aa.reach_map`": (mapped,),
    "`aa.kuka`, `aa.gradients.joint_function`": (
        lambda at: aa.kuka.to_frame(at.arm, at.q),
        lambda at: aa.gradients.joint_function(at.arm, at.pose, at.gc, 1),
    ),
    "`aa.gradients` without `joint_function`": (
        lambda at: aa.gradients.feasible(at.arm, at.pose, at.gc),
        lambda at: aa.gradients.freedom(at.arm, at.pose),
        lambda at: aa.gradients.inverse(at.arm, at.pose, at.psi, at.gc),
        lambda at: aa.gradients.limit_margin(at.arm, at.q),
        lambda at: aa.gradients.margin(at.arm, at.pose),
        lambda at: aa.gradients.psi(at.arm, at.q),
        lambda at: aa.gradients.solve(at.arm, at.pose, at.q + 0.05),
    ),
    "`aa.torch`, `aa.jax`": (of_torch, of_jax),
    "`armangle.plots.circle`, `feasible_map`, `stick_figure`": (drawn,),
    "`armangle view`": (viewed,),
}


def table() -> tuple[list[str], dict[str, list[str]]]:
    """The kinds, and the cells of each row of the page's table by its call."""
    lines = [line for line in PAGE.splitlines() if line.startswith("| ")]
    begin = next(number for number, line in enumerate(lines) if line.startswith("| call |"))
    rows = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines[begin:]]
    return [kind.strip("`") for kind in rows[0][1:]], {row[0]: row[1:] for row in rows[1:]}


KINDS, ROWS = table()


def test_the_table_has_every_kind_and_every_call() -> None:
    """The page's table has the kinds of ARMS and the calls of CALLS."""
    assert set(KINDS) == set(ARMS) and [ARMS[kind].kind for kind in KINDS] == KINDS
    assert set(ROWS) == set(CALLS)
    assert {cell for row in ROWS.values() for cell in row} <= {NO, YES, PROVEN}


@pytest.mark.turns(4)
@pytest.mark.parametrize("kind", ARMS)
@pytest.mark.parametrize("row", CALLS)
def test_the_table_is_true(row: str, kind: str) -> None:
    """Each call works for a kind as its cell says: not supported, yes, or proven."""
    said, at = ROWS[row][KINDS.index(kind)], At(kind)
    for call in CALLS[row]:
        if said == NO:
            with pytest.raises(aa.UnsupportedError):
                call(at)
        else:
            answer = call(at)
            assert said == YES or answer is not False
