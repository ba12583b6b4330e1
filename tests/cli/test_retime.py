"""``armangle retime``, completions, and what ``plan`` says in degrees."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from support.moves import along
from support.needs import need

import armangle as aa
from armangle.cli.main import COMMANDS, SHELLS

from .conftest import Cli

need("scipy")
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
START = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
RETIME = "retime joints.csv {R}"


@pytest.fixture(autouse=True)
def joints(cli: Cli) -> aa.JointPath:
    """A path of 11 rows along 0.1 m, also in joints.csv, and its poses in poses.csv."""
    path = aa.follow(ARM, along(ARM.forward(START)[0], [0, 0, -0.1], 11), start=START)
    aa.io.save(path, "joints.csv")
    aa.io.save(path.poses, "poses.csv")
    return path


@pytest.mark.parametrize("ending", ["csv", "npz", "json", "yaml"])
def test_a_joint_file_becomes_a_trajectory_within_its_bounds(
    joints: aa.JointPath, ending: str, cli: Cli
) -> None:
    """`armangle retime` writes a trajectory within its bounds, with the file's first and last joints."""
    words = f"{RETIME} --acceleration 300 --velocity 60"
    said = cli(f"{words} -o out.{ending}")
    assert said.status == 0 and said.err.startswith("wrote ") and "fastest deg/s" in said.out
    found, facts = aa.io.load_trajectory(f"out.{ending}"), cli(f"{words} --json").facts
    assert np.degrees(np.abs(found.qd)).max() <= 60 * 1.002
    assert np.degrees(np.abs(found.qdd)).max() <= 300 * 1.002
    assert np.abs(found.q[[0, -1]] - joints.q[[0, -1]]).max() < 1e-9
    assert facts["duration"] == pytest.approx(found.duration, abs=1e-9) and facts["rows"] == len(found)


@pytest.mark.parametrize("door", ["", "--policy repulsion"])
def test_a_motion_from_home_keeps_its_bounds_from_its_file(door: str, cli: Cli) -> None:
    """`armangle retime` of a plan from θ2 = 0, where two branches meet, keeps its bounds between rows."""
    aa.io.save(
        along(ARM.forward(np.radians([0.0, 0, 0, -90, 0, 90, 0]))[0], [0.0, 0.2, 0.05], 60), "path.csv"
    )
    assert cli(f"plan path.csv {{R}} {door} --start 0,0,0,-90,0,90,0 -o joints.csv").status == 0
    assert cli(f"{RETIME} --acceleration 300 --sample 0.002 -o out.csv").status == 0
    found = aa.io.load_trajectory("out.csv")
    assert found.t[-1] < 2.0
    assert (np.abs(np.diff(found.q, axis=0)).max(axis=0) / 0.002 <= ARM.velocity * 1.002).all()
    hardest = np.abs(np.diff(found.q, 2, axis=0)).max() / 0.002**2
    assert np.degrees(hardest) <= 300 * 1.6  # and a corner's jump within a cycle of 1 ms


def test_units_that_are_mistaken_are_asked_about(cli: Cli) -> None:
    """Numbers that look like another unit get a message that asks; refused angles are said in degrees too."""
    assert "was this mm/s?" in cli(f"{RETIME} --acceleration 300 --tool-speed 200").text
    plan = f"plan poses.csv {{R}} --start {','.join(f'{x:g}' for x in START)} --policy repulsion"
    assert "were these rad?" in cli(plan).text
    assert "were these rad" not in cli("plan poses.csv {R} --policy repulsion --start 1,2,3,4,5,6,0").text
    said = cli("plan poses.csv {R} --start 0,0,0,-60,0,60,0")
    assert said.status == 2 and re.search(r"rad \([\d.]+ deg\) off, wanted at most .*\(2.86 deg\)", said.text)


def test_seven_bounds_and_the_jerk(cli: Cli) -> None:
    """`armangle retime` takes seven bounds; with a bound on the jerk it takes longer."""
    fast = cli(f"{RETIME} --acceleration {','.join(['200'] * 7)} --json").facts["duration"]
    assert cli(f"{RETIME} --acceleration 200 --jerk 5000 --json").facts["duration"] > fast


def test_what_a_file_says_between_its_rows(cli: Cli) -> None:
    """`armangle retime` takes a plain file as a spline, or as --between says; a plan's own file knows."""
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    rows = np.linspace([0, 0.5, 0, -1.2, 0, 0.6, 0], [1, 0.2, 0.3, -1.5, 0.6, 0.9, -1], 50)
    names = ",".join(f"q{i}" for i in range(1, 8))
    np.savetxt("plain.csv", rows, delimiter=",", header=names, comments="")
    found = {}
    for more in ("", "--between tool", "--between joints", "--between spline"):
        said = cli(f"retime plain.csv --robot {arm.name} --acceleration 300 --json {more}").facts
        assert ("spline" in said["explanation"]) is (more in ("", "--between spline"))
        found[more] = said["duration"]
    straight = aa.JointPath.from_joints(arm, rows[[0, -1]], between="joints")
    least = aa.retime(straight, acceleration=np.radians(300)).duration
    assert found["--between joints"] == pytest.approx(least, rel=2e-3)
    assert found[""] == found["--between spline"] == pytest.approx(least, rel=2e-3)
    assert found["--between tool"] > 1.5 * least
    aa.io.save(aa.plan(arm, aa.Line(*arm.forward(rows[[0, 5]])[0]), start=rows[0]), "own.csv")
    ran = cli(f"retime own.csv --robot {arm.name} --acceleration 300 --json")
    assert ran.status == 0 and "--between" not in ran.err


@pytest.mark.parametrize(("words", "message"), [
    ("", "--acceleration is missing: the arm states none; wanted deg/s^2"),
    ("--acceleration 1,2,3", "--acceleration has 3 numbers, wanted 7"),
    ("--acceleration 0", "--acceleration holds 0, wanted numbers > 0 in deg/s^2"),
    ("--acceleration 9 --velocity fast", "--velocity: 'fast' is not a number"),
    ("--acceleration 9 --jerk -1", "--jerk holds -1, wanted numbers > 0 in deg/s^3"),
])  # fmt: skip
def test_bounds_that_are_none(words: str, message: str, cli: Cli) -> None:
    """`armangle retime` refuses missing and bad bounds with exit status 2."""
    said = cli(f"{RETIME} {words}")
    assert said.status == 2 and message in said.text


@pytest.mark.slow
def test_the_trajectory_is_drawn_and_corners_may_be_kept(cli: Cli) -> None:
    """`armangle retime` draws --plot; with --tolerance 0 it keeps corners and takes longer."""
    need("matplotlib")
    words = f"{RETIME} --acceleration 300 --jerk 3000 --between tool --json"
    facts, kept = cli(f"{words} --plot a.svg").facts, cli(f"{words} --tolerance 0").facts
    assert 0 < facts["deviation"]["position"] <= 1e-4 and "<svg" in Path("a.svg").read_text()
    assert kept["deviation"] == {"position": 0.0, "rotation": 0.0} and kept["duration"] > facts["duration"]


@pytest.mark.parametrize("shell", SHELLS)
def test_completions_know_commands_and_options(shell: str, cli: Cli) -> None:
    """`--print-completion` names the commands and options."""
    need("shtab")
    script = cli(f"--print-completion {shell}").out
    assert all(name in script for name in COMMANDS if name != "view") and "singularity-margin" in script


def test_without_its_package_completions_say_what_to_install(
    monkeypatch: pytest.MonkeyPatch, cli: Cli
) -> None:
    """`--print-completion` without shtab says what to install."""
    monkeypatch.setitem(sys.modules, "shtab", None)
    for shell, said in (("bash", "pip install 'armangle[completion]'"), ("fish", "invalid choice: 'fish'")):
        ran = cli(f"--print-completion {shell}")
        assert ran.status == 2 and said in ran.text
