"""``armangle retime``, completions, and what ``plan`` says in degrees."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from support.needs import need

import armangle as aa
from armangle.cli import main
from armangle.cli.main import COMMANDS, SHELLS

ROBOT = ("--robot", "kuka_iiwa7_r800")
ARM = aa.Arm.from_catalogue(ROBOT[1])
START = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def joints(tmp_path: Path) -> Path:
    """A joint file of 11 rows along 0.1 m."""
    poses = np.repeat(ARM.forward(START)[0][None], 11, axis=0)
    poses[:, 2, 3] -= np.linspace(0, 0.1, 11)
    aa.io.save(aa.follow(ARM, poses, start=START), tmp_path / "joints.csv")
    return tmp_path / "joints.csv"


@pytest.mark.parametrize("ending", ["csv", "npz", "json", "yaml"])
def test_a_joint_file_becomes_a_trajectory_within_its_bounds(
    joints: Path, ending: str, capsys: Capture
) -> None:
    need("scipy")
    to = joints.with_suffix(f".out.{ending}")
    words = ["retime", str(joints), *ROBOT, "--acceleration", "300", "--velocity", "60", "-o", str(to)]
    assert main(words) == 0
    said = capsys.readouterr()
    assert said.err.startswith("wrote ")
    assert "fastest deg/s" in said.out
    found = aa.io.load_trajectory(to)
    assert np.degrees(np.abs(found.qd)).max() <= 60 * 1.002
    assert np.degrees(np.abs(found.qdd)).max() <= 300 * 1.002
    given = aa.io.load_joints(joints).q
    assert np.abs(found.q[[0, -1]] - given[[0, -1]]).max() < 1e-9
    assert main([*words[:-2], "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["duration"] == pytest.approx(found.duration, abs=1e-9)
    assert facts["rows"] == len(found)


@pytest.mark.parametrize("door", [[], ["--policy", "repulsion"]])
def test_a_motion_from_home_keeps_its_bounds_from_its_file(
    door: list[str], tmp_path: Path, capsys: Capture
) -> None:
    """Home is θ2 = 0: its row is of two branches, and between rows joint 1 would go round."""
    need("scipy")
    home = np.radians([0.0, 0.0, 0.0, -90.0, 0.0, 90.0, 0.0])
    poses = np.repeat(ARM.forward(home)[0][None], 60, axis=0)
    poses[:, :3, 3] += np.linspace(0, 1, 60)[:, None] * np.array([0.0, 0.2, 0.05])
    path, joints, out = (str(tmp_path / name) for name in ("path.csv", "joints.csv", "out.csv"))
    aa.io.save(poses, path)
    assert main(["plan", *door, path, *ROBOT, "--start", "0,0,0,-90,0,90,0", "-o", joints]) == 0
    assert main(["retime", joints, *ROBOT, "--acceleration", "300", "--sample", "0.002", "-o", out]) == 0
    found = aa.io.load_trajectory(out)
    assert found.t[-1] < 2.0
    fastest = np.abs(np.diff(found.q, axis=0)).max(axis=0) / 0.002
    assert (fastest <= ARM.velocity * 1.002).all()
    hardest = np.abs(np.diff(found.q, 2, axis=0)).max() / 0.002**2
    assert np.degrees(hardest) <= 300 * 1.6  # and a corner's jump within a cycle of 1 ms
    capsys.readouterr()


def test_units_that_are_mistaken_are_asked_about(joints: Path, capsys: Capture) -> None:
    need("scipy")
    main(["retime", str(joints), *ROBOT, "--acceleration", "300", "--tool-speed", "200"])
    assert "tool_speed is 200, wanted m/s: was this mm/s?" in capsys.readouterr().err
    rad = ",".join(f"{x:g}" for x in START)
    poses = joints.with_name("poses.csv")
    aa.io.save(ARM.forward(START)[0], poses)
    main(["plan", str(poses), "--policy", "repulsion", *ROBOT, "--start", rad])
    assert "--start is in degrees, the largest is 1.2: were these rad?" in capsys.readouterr().err
    main(["plan", str(poses), "--policy", "repulsion", *ROBOT, "--start", "1,2,3,4,5,6,0"])
    assert "were these rad" not in capsys.readouterr().err
    assert main(["inspect", "arm.urdf"]) == 2
    assert "arm.urdf: no such file" in capsys.readouterr().err


def test_seven_bounds_and_the_jerk(joints: Path, capsys: Capture) -> None:
    need("scipy")
    seven = ",".join(["200"] * 7)
    assert main(["retime", str(joints), *ROBOT, "--acceleration", seven, "--json"]) == 0
    fast = json.loads(capsys.readouterr().out)["duration"]
    assert main(["retime", str(joints), *ROBOT, "--acceleration", "200", "--jerk", "5000", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["duration"] > fast


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "--acceleration is missing: the arm states none; wanted deg/s^2"),
        (("--acceleration", "1,2,3"), "--acceleration has 3 numbers, wanted 7: one number or 7, deg/s^2"),
        (("--acceleration", "0"), "--acceleration holds 0, wanted numbers > 0 in deg/s^2"),
        (("--acceleration", "9", "--velocity", "fast"), "--velocity: 'fast' is not a number"),
        (("--acceleration", "9", "--jerk", "-1"), "--jerk holds -1, wanted numbers > 0 in deg/s^3"),
    ],
)
def test_bounds_that_are_none(joints: Path, words: tuple[str, ...], message: str, capsys: Capture) -> None:
    assert main(["retime", str(joints), *ROBOT, *words]) == 2
    assert message in " ".join(capsys.readouterr().err.split())


def test_plan_says_degrees_of_a_start_that_is_off(joints: Path, capsys: Capture) -> None:
    aa.io.save(ARM.forward(aa.io.load_joints(joints).q)[0], joints.with_name("poses.csv"))
    words = ["plan", str(joints.with_name("poses.csv")), *ROBOT, "--start", "0,0,0,-60,0,60,0"]
    assert main(words) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(r"a joint is [\d.]+ rad \([\d.]+ deg\) off, wanted at most 0.05 rad \(2.86 deg\)", said)


@pytest.mark.parametrize("shell", SHELLS)
def test_completions_know_commands_and_options(shell: str, capsys: Capture) -> None:
    need("shtab")
    assert main(["--print-completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in COMMANDS if name != "view")
    assert "--singularity-margin" in script or "singularity-margin" in script


def test_without_its_package_completions_say_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "shtab", None)
    assert main(["--print-completion", "bash"]) == 2
    assert "pip install 'armangle[completion]'" in " ".join(capsys.readouterr().err.split())
    assert main(["--print-completion", "fish"]) == 2
    assert "invalid choice: 'fish'" in capsys.readouterr().err


@pytest.mark.slow
def test_the_trajectory_is_drawn_and_corners_may_be_kept(joints: Path, capsys: Capture) -> None:
    need("scipy")
    need("matplotlib")
    picture = joints.with_suffix(".svg")
    words = ["retime", str(joints), *ROBOT, "--acceleration", "300", "--jerk", "3000", "--json"]
    words += ["--between", "tool"]
    assert main([*words, "--plot", str(picture)]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert 0 < facts["deviation"]["position"] <= 1e-4
    assert "<svg" in picture.read_text()
    assert main([*words, "--tolerance", "0"]) == 0
    kept = json.loads(capsys.readouterr().out)
    assert kept["deviation"] == {"position": 0.0, "rotation": 0.0}
    assert kept["duration"] > facts["duration"]
