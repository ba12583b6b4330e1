"""``armangle body``, and ``--scene`` of the commands that keep clear."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.calibrated import calibrated

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
    return aa.Arm.from_catalogue("kuka_iiwa7_r800").with_body(aa.Body.bones(upper_arm=0.09, forearm=0.08))


def test_arcs_name_the_obstacle_and_the_link(cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["arcs", *ROBOT, "--q", Q, "--scene", cell, "--body", "90,80"]
    assert main(words) == 0
    assert "forearm at lamp" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)[0]
    pose, _, gc = arm().forward(np.radians([float(x) for x in Q.split(",")]))
    wanted = arm().feasible(pose, gc, scene=aa.load_scene(cell))
    assert np.allclose(facts["intervals"], wanted.intervals, rtol=0, atol=1e-12)
    assert {"obstacle", "link"} <= set(facts["ends"][0][1]) | set(facts["ends"][0][0])


def test_a_clearance_is_that_of_the_scene(cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["arcs", *ROBOT, "--q", Q, "--scene", cell, "--body", "90,80", "--clearance", "20", "--json"]
    assert main(words) == 0
    facts = json.loads(capsys.readouterr().out)[0]
    pose, _, gc = arm().forward(np.radians([float(x) for x in Q.split(",")]))
    lamp = aa.load_scene(cell).shapes[0]
    wanted = arm().feasible(pose, gc, scene=aa.Scene([lamp], clearance=0.02)).intervals
    assert np.allclose(facts["intervals"], wanted, rtol=0, atol=1e-12)
    assert np.abs(wanted - arm().feasible(pose, gc, scene=aa.Scene([lamp])).intervals).max() > 0.01


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
    scene = aa.load_scene(table)
    q = np.radians([0, 40, 0, -100, 0, 40, 0])
    low = tooled.forward(q)[0]
    for rise in (-0.05, 0.05):
        pose = low.copy()
        pose[2, 3] = 0.2 + 0.03 + rise / 10
        file = tmp_path / "pose.csv"
        aa.save(pose[None], file)
        near = ",".join(str(x) for x in np.degrees(q))
        words = ["ik", *ROBOT, "--tool", TOOL, "--pose", str(file), "--near", near, "--scene", str(table)]
        status = main([*words, "--body", "90,80", "--hand", hand, "--json"])
        said = capsys.readouterr()
        facts = json.loads(said.out)
        facts = facts[0] if isinstance(facts, list) else facts
        wanted = tooled.with_hand([drill]).solve(pose, near=q, scene=scene)
        assert (status == 0) is wanted.ok is (rise > 0)
        assert "nothing covers" not in said.err
        if wanted.ok:
            assert np.allclose(facts["q"], wanted.q, rtol=0, atol=1e-9)
        assert main([*words, "--body", "90,80"]) == 0  # the tool is in the table for all that the arm knows
        assert "nothing covers" in (err := capsys.readouterr().err) and "--hand does" in err


@pytest.mark.parametrize(
    ("hand", "why"),
    [
        ("0.03", "in mm: was this in m"),
        ("30,40", "a RADIUS in mm"),
        ("half_space.toml", "wanted Ball, Capsule, Box, Hull"),
        ("kept.toml", "of the scene, not of a hand"),
        ("none.toml", "none.toml"),
    ],
)
def test_a_hand_that_is_none_is_refused(
    tmp_path: Path, cell: str, hand: str, why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "half_space.toml").write_text("[[half_space]]\nnormal = [0, 0, 1]\noffset = 0")
    (tmp_path / "kept.toml").write_text(f"clearance = 0.01\n{CELL}")
    given = str(tmp_path / hand) if hand.endswith(".toml") else hand
    words = ["arcs", *ROBOT, "--q", Q, "--body", "90,80", "--hand", given]
    assert main([*words, "--scene", cell]) == 2
    assert why in " ".join(capsys.readouterr().err.split())
    assert main(["arcs", *ROBOT, "--q", Q, "--hand", "30"]) == 2
    assert "--hand goes with --scene" in capsys.readouterr().err


def test_ik_and_follow_keep_clear(tmp_path: Path, cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    q = np.radians([float(x) for x in Q.split(",")])
    pose = arm().forward(q)[0]
    scene = aa.load_scene(cell)
    poses = tmp_path / "poses.csv"
    aa.save(np.tile(pose, (3, 1, 1)), poses)
    words = ["ik", *ROBOT, "--pose", str(poses), "--near", Q, "--scene", cell, "--body", "90,80", "--json"]
    assert main(words) == 0
    found = json.loads(capsys.readouterr().out)
    assert arm().clearance(pose, found["psi"][0], found["gc"][0], scene).distance > -1e-9
    words = ["follow", str(poses), *ROBOT, "--start", Q, "--scene", cell, "--body", "90,80"]
    out = tmp_path / "out.csv"
    assert main([*words, "-o", str(out)]) == 0
    for row in aa.load_joints(out).q:
        at, angle, branch = arm().forward(row)
        assert arm().clearance(at, angle, branch, scene).distance > -1e-9


def test_plan_keeps_clear_and_is_proven(
    tmp_path: Path, cell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    q = np.radians([float(x) for x in Q.split(",")])
    first = arm().forward(q)[0]
    last = first.copy()
    last[:3, 3] += [0.0, 0.05, 0.03]
    poses, out = tmp_path / "poses.csv", tmp_path / "out.csv"
    aa.save(aa.Line(first, last).pose(np.linspace(0, 1, 20)), poses)
    words = ["plan", str(poses), *ROBOT, "--start", Q, "--json", "-o", str(out)]
    assert main([*words, "--scene", cell, "--body", "90,80"]) == 0
    assert json.loads(capsys.readouterr().out)["certified"]
    scene = aa.load_scene(cell)
    for row in aa.load_joints(out).q:
        at, angle, branch = arm().forward(row)
        assert arm().clearance(at, angle, branch, scene).distance > -1e-9
    assert main([*words, "--roll", "free"]) == 0
    assert np.abs(aa.load_joints(out).q[:, 6] - q[6]).max() < 1e-6


def test_a_refusal_names_who_blocks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    post = tmp_path / "post.toml"
    post.write_text('[[ball]]\nname = "post"\ncenter = [0, 0.12, 0.34]\nradius = 0.06\n')
    pose = arm().forward(np.radians([float(x) for x in Q.split(",")]))[0]
    poses = tmp_path / "poses.csv"
    aa.save(pose[None], poses)
    words = ["arcs", *ROBOT, "--q", Q, "--scene", str(post), "--body", "90,80"]
    assert main(words) == 1
    assert "No arm angle keeps clear" in capsys.readouterr().err
    shown = capsys.readouterr()
    text = ",".join(f"{x:.17g}" for x in aa.load_poses(poses)[0][:3, 3])
    assert main(
        ["ik", *ROBOT, "--pose", f"{text},0,1,0,0", "--explain", "--scene", str(post), "--body", "90,80"]
    )
    shown = capsys.readouterr()
    assert "post" in shown.out


def test_a_body_is_printed_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str], cell: str) -> None:
    text = aa.Arm.from_catalogue("kuka_iiwa7_r800").to_urdf()
    shape = '<collision><geometry><cylinder radius="0.07" length="0.3"/></geometry></collision>'
    robot, body = tmp_path / "robot.urdf", tmp_path / "body.toml"
    robot.write_text(text.replace('<link name="link_3" />', f'<link name="link_3">{shape}</link>'))
    assert main(["body", str(robot), "-o", str(body)]) == 0
    assert "litres" in capsys.readouterr().out
    assert aa.load_body(body) == aa.Body.from_urdf(robot)
    assert main(["body", str(robot), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["shapes"][0]["name"] == "link_3"
    for words in (["--urdf", str(robot)], [*ROBOT, "--body", str(body)], [*ROBOT, "--body", str(robot)]):
        assert main(["arcs", *words, "--q", Q, "--scene", cell]) == 0
    bare = tmp_path / "bare.urdf"
    bare.write_text(text)
    assert main(["body", str(bare)]) == 2
    assert "collision shapes" in capsys.readouterr().err


def test_a_body_of_a_chain_is_asked_as_its_refusal_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], cell: str
) -> None:
    text = calibrated("kuka_iiwa7_r800", 1.0, 1.0).to_urdf()
    shape = '<collision><geometry><cylinder radius="0.07" length="0.3"/></geometry></collision>'
    robot, body = tmp_path / "robot.urdf", tmp_path / "body.toml"
    robot.write_text(text.replace('<link name="link_3" />', f'<link name="link_3">{shape}</link>'))
    assert main(["body", str(robot)]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--inexact" in said and "-tolerance" not in said
    assert main(["body", str(robot), "--inexact", "-o", str(body)]) == 0
    assert aa.load_body(body) == aa.Body.from_urdf(robot, exact=False)
    for more in ([], ["--body", str(body)]):
        assert main(["arcs", "--urdf", str(robot), "--inexact", "--q", Q, "--scene", cell, *more]) == 0


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--scene", "CELL"], "--scene needs the shape of the arm's links: --body 90,80"),
        (["--body", "90,80"], "--body goes with --scene"),
        (["--clearance", "20"], "--clearance goes with --scene"),
        (["--scene", "CELL", "--body", "90,80", "--clearance", "-1"], "Scene: clearance is -0.001"),
        (["--scene", "CELL", "--body", "90,80", "--clearance", "x"], "'x' is not a number"),
        (["--scene", "CELL", "--body", "90"], "--body has 1 numbers, wanted 2"),
        (["--scene", "CELL", "--body", "90,x"], "'x' is not a number"),
        (["--scene", "CELL", "--body", "90,80", "--joint", "2"], "--scene does not go with --joint"),
        (["--scene", "none.toml", "--body", "90,80"], "none.toml"),
    ],
)
def test_what_does_not_go_together_is_said(
    words: list[str], why: str, cell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["arcs", *ROBOT, "--q", Q, *(cell if word == "CELL" else word for word in words)]) == 2
    assert why in capsys.readouterr().err


def test_a_scene_that_does_not_fit_the_arm_is_named_by_its_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "cell.toml"
    for text, why in (
        (CELL.replace("0.05", "50.0"), "lamp: thickness is 100.0"),
        ('ignore = [["x", "upper_arm"]]\n' + CELL, "Scene: ignore[0] is 'x'"),
    ):
        path.write_text(text)
        for body in ("90,80", "guessed"):
            assert main(["arcs", *ROBOT, "--q", Q, "--scene", str(path), "--body", body]) == 2
            assert "cell.toml: " + why in " ".join(capsys.readouterr().err.split())
