"""``--scene``: what the commands that take it keep clear of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import armangle as aa

from .conftest import Cli

DEGREES = "20,45,10,-80,10,60,0"
Q = np.radians([float(x) for x in DEGREES.split(",")])
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
POSE, _, GC = ARM.forward(Q)
SCENE = "--scene cell.toml --body 90,80"
INTERVALS = f"ik --intervals {{R}} --joints {DEGREES}"


@pytest.fixture(autouse=True)
def lamp(cli: Cli) -> aa.Scene:
    """Write the scene file cell.toml, a ball, and return its scene."""
    Path("cell.toml").write_text('[[ball]]\nname = "lamp"\ncenter = [0.28, 0.26, 0.6]\nradius = 0.05\n')
    return aa.io.load_scene("cell.toml")


def clear_of(scene: aa.Scene, rows: np.ndarray) -> bool:
    """Whether no shape reaches 1e-9 m into another at any row (the scene's clearance is not asked)."""
    return all(ARM.clearance(row, scene).distance > -1e-9 for row in rows)


@pytest.mark.parametrize("clearance", [0.0, 0.02])
def test_arcs_name_the_obstacle_and_the_link_and_keep_the_clearance(
    clearance: float, lamp: aa.Scene, cli: Cli
) -> None:
    """`ik --intervals --scene` gives the intervals of `feasible` in the scene, and names who blocks."""
    words = f"{INTERVALS} {SCENE} --clearance {1e3 * clearance}"
    assert "forearm at lamp" in cli(words).out
    (facts,) = cli(f"{words} --json").facts
    bare, wanted = (
        ARM.with_(scene=aa.Scene(lamp.shapes, clearance=room)).feasible(POSE, GC) for room in (0.0, clearance)
    )
    assert np.allclose(facts["intervals"], wanted.intervals, rtol=0, atol=1e-12)
    assert (np.abs(wanted.intervals - bare.intervals).max() > 0.01) == (clearance > 0)
    assert {"obstacle", "link"} <= set(facts["ends"][0][1]) | set(facts["ends"][0][0])


TOOL = "--tool 0,0,0.12,0.7071067811865476,0.7071067811865476,0,0"


@pytest.mark.parametrize("hand", ["30", "hand.toml"])
def test_a_hand_is_kept_off_too(hand: str, cli: Cli) -> None:
    """`ik --gripper`, a rod from tip to tool or shapes in the tool's frame, solves as `Arm.solve` does."""
    Path("table.toml").write_text('[[box]]\nname = "table"\nsize = [2, 2, 0.04]\nposition = [0, 0, 0.18]\n')
    Path("hand.toml").write_text(
        "[[capsule]]\nbegin = [0, -0.12, 0]\nend = [0, 0, 0]\nradius = 0.03\nname = 'drill'"
    )
    tooled = ARM.with_tool(aa.pose([0, 0, 0.12], rpy=[np.pi / 2, 0, 0]))
    armed = tooled.with_(hand=[aa.Capsule([0, -0.12, 0], [0, 0, 0], 0.03)])
    q = np.radians([0, 40, 0, -100, 0, 40, 0])
    near = ",".join(str(x) for x in np.degrees(q))
    words = f"ik {{R}} {TOOL} --pose pose.csv --seed {near} --scene table.toml --body 90,80"
    for rise in (-0.05, 0.05):
        pose = tooled.forward(q)[0].copy()
        pose[2, 3] = 0.2 + 0.03 + rise / 10
        aa.io.save(pose[None], "pose.csv")
        said = cli(f"{words} --gripper {hand} --json")
        facts = said.facts[0] if isinstance(said.facts, list) else said.facts
        wanted = armed.with_(scene=aa.io.load_scene("table.toml")).solve(pose, seed=q)
        assert (said.status == 0) is wanted.ok is (rise > 0) and "nothing covers" not in said.err
        assert not wanted.ok or np.allclose(facts["q"], wanted.q, rtol=0, atol=1e-9)
        bare = cli(words)  # the tool is in the table for all that the arm knows
        assert bare.status == 0 and "nothing covers" in bare.text and "--gripper does" in bare.text


def test_ik_and_follow_keep_clear(lamp: aa.Scene, cli: Cli) -> None:
    """`ik` and `plan --policy` with --scene give joints free of collisions."""
    aa.io.save(np.tile(POSE, (3, 1, 1)), "poses.csv")
    assert clear_of(lamp, cli(f"ik {{R}} --pose poses.csv --seed {DEGREES} {SCENE} --json").facts["q"])
    assert cli(f"plan poses.csv --policy repulsion {{R}} --start {DEGREES} {SCENE} -o out.csv").status == 0
    assert clear_of(lamp, aa.io.load_joints("out.csv").q)


def test_plan_keeps_clear_and_is_proven(lamp: aa.Scene, cli: Cli) -> None:
    """`plan --scene` is certified and free of collisions; --roll free leaves joint 7 alone."""
    last = POSE + 0
    last[:3, 3] += [0.0, 0.05, 0.03]
    aa.io.save(aa.Line(POSE, last).pose(np.linspace(0, 1, 20)), "poses.csv")
    words = f"plan poses.csv {{R}} --start {DEGREES} --json -o out.csv"
    assert cli(f"{words} {SCENE}").facts["certified"]
    assert clear_of(lamp, aa.io.load_joints("out.csv").q)
    assert cli(f"{words} --roll free").status == 0
    assert np.abs(aa.io.load_joints("out.csv").q[:, 6] - Q[6]).max() < 1e-6


def test_a_refusal_names_who_blocks(cli: Cli) -> None:
    """`ik --intervals` and `--explain` with no way around an obstacle say so."""
    Path("cell.toml").write_text('[[ball]]\nname = "post"\ncenter = [0, 0.12, 0.34]\nradius = 0.06\n')
    ran = cli(f"{INTERVALS} {SCENE}")
    assert ran.status == 1 and "No arm angle keeps clear" in ran.text
    place = ",".join(f"{x:.17g}" for x in POSE[:3, 3])
    ran = cli(f"ik {{R}} --pose {place},0,1,0,0 --explain {SCENE}")
    assert ran.status == 1 and "post" in ran.out


def test_an_arm_with_an_offset_keeps_clear_too(lamp: aa.Scene, cli: Cli) -> None:
    """`ik --intervals --scene` of an offset arm gives the intervals of `feasible` in the scene."""
    q = np.array([0.3, 0.3, 0.2, -1.6, 0.1, 2.0, 0.4])
    arm = aa.Arm.from_catalogue("franka_fr3").with_(body=aa.Body.bones(upper_arm=0.06, forearm=0.06))
    among, (pose, _, gc) = arm.with_(scene=lamp), arm.forward(q)
    joints = ",".join(map(str, np.degrees(q)))
    words = f"ik --robot franka_fr3 --joints {joints} --scene cell.toml --body 60,60 --json"
    (facts,) = cli(f"{words} --intervals").facts
    wanted = among.feasible(pose, gc)
    assert wanted != arm.feasible(pose, gc)
    assert np.allclose(facts["intervals"], wanted.intervals, rtol=0, atol=1e-9)
