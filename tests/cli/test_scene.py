"""``--scene``: what the commands that take it keep clear of."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import armangle as aa
from armangle.cli.main import main

ROBOT = ("--robot", "kuka_iiwa7_r800")
Q = "20,45,10,-80,10,60,0"
CELL = '[[ball]]\nname = "lamp"\ncenter = [0.28, 0.26, 0.6]\nradius = 0.05\n'


@pytest.fixture
def cell(tmp_path: Path) -> str:
    path = tmp_path / "cell.toml"
    path.write_text(CELL)
    return str(path)


def arm() -> aa.Arm:
    return aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))


def test_arcs_name_the_obstacle_and_the_link(cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["ik", "--intervals", *ROBOT, "--joints", Q, "--scene", cell, "--body", "90,80"]
    assert main(words) == 0
    assert "forearm at lamp" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)[0]
    pose, _, gc = arm().forward(np.radians([float(x) for x in Q.split(",")]))
    wanted = arm().with_(scene=aa.io.load_scene(cell)).feasible(pose, gc)
    assert np.allclose(facts["intervals"], wanted.intervals, rtol=0, atol=1e-12)
    assert {"obstacle", "link"} <= set(facts["ends"][0][1]) | set(facts["ends"][0][0])


def test_a_clearance_is_that_of_the_scene(cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "ik",
        "--intervals",
        *ROBOT,
        "--joints",
        Q,
        "--scene",
        cell,
        "--body",
        "90,80",
        "--clearance",
        "20",
        "--json",
    ]
    assert main(words) == 0
    facts = json.loads(capsys.readouterr().out)[0]
    pose, _, gc = arm().forward(np.radians([float(x) for x in Q.split(",")]))
    lamp = aa.io.load_scene(cell).shapes[0]
    wanted = arm().with_(scene=aa.Scene([lamp], clearance=0.02)).feasible(pose, gc).intervals
    assert np.allclose(facts["intervals"], wanted, rtol=0, atol=1e-12)
    assert np.abs(wanted - arm().with_(scene=aa.Scene([lamp])).feasible(pose, gc).intervals).max() > 0.01


TABLE = '[[box]]\nname = "table"\nsize = [2, 2, 0.04]\nposition = [0, 0, 0.18]\n'
TOOL = "0,0,0.12,0.7071067811865476,0.7071067811865476,0,0"


@pytest.mark.parametrize("hand", ["30", "hand.toml"])
def test_a_hand_is_kept_off_too(tmp_path: Path, hand: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A rod from the tip to the tool's place, or shapes in the frame of the tool: here the same ones."""
    table = tmp_path / "table.toml"
    table.write_text(TABLE)
    if hand == "hand.toml":
        hand = str(tmp_path / hand)
        Path(hand).write_text(
            "[[capsule]]\nbegin = [0, -0.12, 0]\nend = [0, 0, 0]\nradius = 0.03\nname = 'drill'"
        )
    tooled = arm().with_tool(aa.pose([0, 0, 0.12], rpy=[np.pi / 2, 0, 0]))
    drill = aa.Capsule([0, -0.12, 0], [0, 0, 0], 0.03)
    scene = aa.io.load_scene(table)
    q = np.radians([0, 40, 0, -100, 0, 40, 0])
    low = tooled.forward(q)[0]
    for rise in (-0.05, 0.05):
        pose = low.copy()
        pose[2, 3] = 0.2 + 0.03 + rise / 10
        file = tmp_path / "pose.csv"
        aa.io.save(pose[None], file)
        near = ",".join(str(x) for x in np.degrees(q))
        words = ["ik", *ROBOT, "--tool", TOOL, "--pose", str(file), "--seed", near, "--scene", str(table)]
        status = main([*words, "--body", "90,80", "--gripper", hand, "--json"])
        said = capsys.readouterr()
        facts = json.loads(said.out)
        facts = facts[0] if isinstance(facts, list) else facts
        wanted = tooled.with_(hand=[drill]).with_(scene=scene).solve(pose, seed=q)
        assert (status == 0) is wanted.ok is (rise > 0)
        assert "nothing covers" not in said.err
        if wanted.ok:
            assert np.allclose(facts["q"], wanted.q, rtol=0, atol=1e-9)
        assert main([*words, "--body", "90,80"]) == 0  # the tool is in the table for all that the arm knows
        assert "nothing covers" in (err := capsys.readouterr().err) and "--gripper does" in err


def test_ik_and_follow_keep_clear(tmp_path: Path, cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    q = np.radians([float(x) for x in Q.split(",")])
    pose = arm().forward(q)[0]
    scene = aa.io.load_scene(cell)
    poses = tmp_path / "poses.csv"
    aa.io.save(np.tile(pose, (3, 1, 1)), poses)
    words = ["ik", *ROBOT, "--pose", str(poses), "--seed", Q, "--scene", cell, "--body", "90,80", "--json"]
    assert main(words) == 0
    found = json.loads(capsys.readouterr().out)
    assert arm().clearance(found["q"][0], scene).distance > -1e-9
    words = [
        "plan",
        str(poses),
        "--policy",
        "repulsion",
        *ROBOT,
        "--start",
        Q,
        "--scene",
        cell,
        "--body",
        "90,80",
    ]
    out = tmp_path / "out.csv"
    assert main([*words, "-o", str(out)]) == 0
    for row in aa.io.load_joints(out).q:
        assert arm().clearance(row, scene).distance > -1e-9


def test_plan_keeps_clear_and_is_proven(
    tmp_path: Path, cell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    q = np.radians([float(x) for x in Q.split(",")])
    first = arm().forward(q)[0]
    last = first.copy()
    last[:3, 3] += [0.0, 0.05, 0.03]
    poses, out = tmp_path / "poses.csv", tmp_path / "out.csv"
    aa.io.save(aa.Line(first, last).pose(np.linspace(0, 1, 20)), poses)
    words = ["plan", str(poses), *ROBOT, "--start", Q, "--json", "-o", str(out)]
    assert main([*words, "--scene", cell, "--body", "90,80"]) == 0
    assert json.loads(capsys.readouterr().out)["certified"]
    scene = aa.io.load_scene(cell)
    for row in aa.io.load_joints(out).q:
        assert arm().clearance(row, scene).distance > -1e-9
    assert main([*words, "--roll", "free"]) == 0
    assert np.abs(aa.io.load_joints(out).q[:, 6] - q[6]).max() < 1e-6


def test_a_refusal_names_who_blocks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    post = tmp_path / "post.toml"
    post.write_text('[[ball]]\nname = "post"\ncenter = [0, 0.12, 0.34]\nradius = 0.06\n')
    pose = arm().forward(np.radians([float(x) for x in Q.split(",")]))[0]
    poses = tmp_path / "poses.csv"
    aa.io.save(pose[None], poses)
    words = ["ik", "--intervals", *ROBOT, "--joints", Q, "--scene", str(post), "--body", "90,80"]
    assert main(words) == 1
    assert "No arm angle keeps clear" in capsys.readouterr().err
    shown = capsys.readouterr()
    text = ",".join(f"{x:.17g}" for x in aa.io.load_poses(poses)[0][:3, 3])
    assert main(
        ["ik", *ROBOT, "--pose", f"{text},0,1,0,0", "--explain", "--scene", str(post), "--body", "90,80"]
    )
    shown = capsys.readouterr()
    assert "post" in shown.out
