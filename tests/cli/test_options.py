"""Options: how many there are, their help, their order, and what is said of bad ones."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armangle as aa
from armangle.cli.main import COMMANDS, command_parser
from armangle.cli.tables import WIDTH

from .conftest import Cli

MOST_COMMANDS, MOST_OPTIONS, MOST_WORDS = 10, 120, 25


def options_of(command: str) -> list[Any]:
    """The options of a command, without --help."""
    return [one for one in command_parser(command)._actions if one.option_strings and one.dest != "help"]


def test_there_are_few_commands_and_options() -> None:
    """The command line has at most MOST_COMMANDS commands and MOST_OPTIONS options."""
    assert len(COMMANDS) <= MOST_COMMANDS
    assert sum(len(options_of(command)) for command in COMMANDS) <= MOST_OPTIONS


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_is_short_and_has_an_example(command: str, cli: Cli) -> None:
    """The help of each command fits, has an example, and no sentence longer than MOST_WORDS."""
    text = cli(f"{command} --help").out
    assert f"example:\n  armangle {command}" in text and max(map(len, text.splitlines())) <= WIDTH
    assert not any(word in text for word in ("eq.", "figure", "section"))
    helps = [one.help for one in options_of(command)]
    assert all(helps)
    description = text.split("\n\n")[1]
    for said in (description, *helps):
        assert all(len(part.split()) <= MOST_WORDS for part in re.split(r"[.;:] |\.$", said))


# -- what is refused -------------------------------------------------------------------------------------

START = "0,20,0,-60,0,60,0"
ONE = "plan path.csv {R}"
STEP = f"{ONE} --start {START} --policy"
CELL = "--scene cell.toml --body 90,80"
BAD = {
    "inspekt": "there is no command 'inspekt'; did you mean 'inspect'?",
    "xyz": "there is no command 'xyz'; the commands are demo, robots",
    "ik {POSE}": "the following arguments are required: --robot",
    "inspect kuka_iiwa7_r800 --joints 1,2": "--joints has 2 numbers, wanted 7: q1,..,q7 in degrees",
    "inspect kuka_iiwa7_r800 --joints 1,2,3,4,5,6,x": "--joints: 'x' is not a number, wanted q1,..,q7",
    "inspect kuka_iiwa7_r800 --joints 1,2,3,4,5,6,inf": "--joints: 'inf' is not finite",
    "inspect kuka_iiwa7_r800 --links a,b": "--links does not go with kuka_iiwa7_r800",
    "inspect kuka_iiwa7_r800 --kuka": "--kuka does not go with the arm alone: give --joints",
    "inspect kuka_iiwa7_r800 --plot a.png --joints {Q}": "--plot draws a motion: give --joints FILE",
    "inspect kuka_iiwa": "no robot 'kuka_iiwa'; did you mean 'kuka_iiwa7_r800'",
    "inspect no.toml": "no.toml: no such file",
    "inspect no.urdf": "no.urdf: no such file",
    "inspect kuka_iiwa7_r800 --joints {Q} -o a.txt": "ending '.txt' is not known, wanted one of .csv, .npz, .json",  # noqa: E501  # a row of the table
    "inspect kuka_iiwa7_r800 --joints {Q} -o no/a.csv": "no/a.csv: cannot be written: No such file or directory",  # noqa: E501  # a row of the table
    "inspect franka_fr3 --joints {QF} --kuka": "--kuka does not go with franka_fr3",
    "inspect kuka_iiwa7_r800 --tool 0,0": "--tool has 2 numbers, wanted x,y,z or x,y,z,qw,qx,qy,qz",
    "inspect kuka_iiwa7_r800 --tool 0,0,150": "--tool is 0,0,150, a place in m: was this in mm?",
    "inspect kuka_iiwa7_r800 --tool 0,0,0.1,0,0,0,2": "--tool: the quaternion has length 2",
    "inspect kuka_iiwa7_r800 --tool a,b,c": "--tool: 'a' is not a number",
    "robots kuca": "the catalogue has no robot 'kuca'",
    "ik {R}": "one of the arguments --pose --kuka --joints is required",
    "ik {R} --pose 1,2,3": "--pose has 3 numbers, wanted 7: x,y,z,qw,qx,qy,qz",
    "ik {R} --pose 0,0,1,1,1,0,0": "wanted 1 within 1e-06; made unit it is 0.70710678,0.70710678,0,0",
    "ik {R} --pose 0,0,1,0,0,0,0": "--pose: the quaternion has length 0, wanted 1 within 1e-06",
    "ik {R} --pose no.csv": "no.csv: no such file",
    "ik {R} {POSE} --psi abc": "argument --psi: 'abc' is not a number",
    "ik {R} {POSE} --gc 8": "argument --gc: invalid choice: 8",
    "ik {R} {POSE} --psi 0": "--psi needs --gc or --all",
    "ik {R} {POSE} --seed 1": "--seed has 1 numbers, wanted 7",
    "ik {R} {POSE} --seed 0,0,720,0,0,0,0": "--seed: joint 3 is 720 deg, 550 deg outside its",
    "ik {FR3} {PF} --seed 0,0,0,-900,0,0,0": "--seed: joint 4 is -900 deg",
    "ik {R} {POSE} --metric l3": "argument --metric: invalid choice: 'l3'",
    "ik {R} {POSE} --fallback nearest": "argument --fallback: invalid choice: 'nearest'",
    "ik {R} {POSE} --all -o a.csv": "--output does not go with --all",
    "ik {R} {POSE} --psi 0 --gc 0 --metric l2": "--metric does not go with --psi",
    "ik {R} {POSE} --psi 0 --gc 0 --fallback nearest_pose": "--fallback does not go with --psi",
    "ik {R} {FAR} --explain --psi 3": "--psi does not go with --explain",
    "ik {R} {POSE} --intervals --seed {Q}": "--seed does not go with --intervals",
    "ik {R} {POSE} --intervals 8": "argument --intervals: '8' is no joint, wanted 1..7 or joints",
    "ik {R} {POSE} --intervals --singularity-margin 100": "--singularity-margin: 100 deg, wanted 0 to 85.94 deg",  # noqa: E501  # a row of the table
    "ik {R} {POSE} --intervals --plot a.png": "--plot needs --gc",
    "ik {R} --intervals --pose poses.csv": "--intervals of a file is a picture: --plot FILE",
    "ik {R} --intervals --pose words.csv --plot a.png": "words.csv",
    "ik {R} --kuka 1,2,3": "holds 3 numbers",
    "ik {R} --kuka 1,2,3,4,5,6,7,x": "wanted numbers",
    "ik {R} --kuka 400,0,500,0,180,0,10,2 --gc 1": "--gc does not go with --kuka",
    "ik {R} --kuka 400,0,500,0,180,0,10,9": "status is 9",
    "plan poses.csv {FR3} --start {QF} --policy hold,carry=elbow": "carry= is not made for an arm",
    f"ik {{R}} --intervals --joints {{Q}} {CELL.split(' --body')[0]}": "--scene needs the shape of the arm's links",  # noqa: E501  # a row of the table
    "ik {R} {POSE} --body 90,80": "--body goes with --scene",
    "ik {R} {POSE} --clearance 20": "--clearance goes with --scene",
    "ik {R} {POSE} --gripper 30": "--gripper goes with --scene",
    f"ik {{R}} {{POSE}} {CELL} --clearance -1": "Scene: clearance is -0.001",
    f"ik {{R}} {{POSE}} {CELL} --clearance x": "'x' is not a number",
    "ik {R} {POSE} --scene cell.toml --body 90": "--body has 1 numbers, wanted 2",
    "ik {R} {POSE} --scene cell.toml --body 0.09,0.08": "in mm: was this in m?",
    f"ik {{R}} {{POSE}} {CELL} --psi 3 --gc 0": "--scene does not go with --psi",
    f"ik {{R}} {{POSE}} {CELL} --intervals 2": "--scene does not go with --intervals of a joint",
    f"ik {{R}} {{POSE}} {CELL} --gripper 0.03": "in mm: was this in m",
    f"ik {{R}} {{POSE}} {CELL} --gripper 30,40": "a RADIUS in mm",
    f"ik {{R}} {{POSE}} {CELL} --gripper half_space.toml": "wanted Ball, Capsule, Box, Hull",
    f"ik {{R}} {{POSE}} {CELL} --gripper kept.toml": "of the scene, not of a gripper",
    f"ik {{R}} {{POSE}} {CELL} --gripper none.toml": "none.toml",
    "ik {R} {POSE} --scene large.toml --body 90,80": "large.toml: lamp: thickness is 100.0",
    "ik {R} {POSE} --scene large.toml --body guessed": "large.toml: lamp: thickness is 100.0",
    "ik {R} {POSE} --scene none.toml --body 90,80": "none.toml",
    ONE: "path.csv: no such file",
    f"{ONE} --start 0,0,0,0,0,0,-900": "--start: joint 7 is -900 deg, 725 deg",
    f"{ONE} --goal 720,0,0,0,0,0,0": "--goal: joint 1 is 720 deg, 550 deg",
    f"{ONE} --limit-margin 200": "--limit-margin: 200 deg, wanted 0 to 180 deg",
    f"{ONE} --limit-margin 130": "--limit-margin is 130.00 deg, wanted at most 120.00: half of the narrowest",
    f"{ONE} --step 0": "argument --step: 0 deg, wanted more than 0",
    f"{ONE} --step 1e-9": "--step is 1e-09 deg, wanted at least 6e-05 deg",
    f"{ONE} --psi north": "wanted one of 'up'",
    f"{ONE} --psi axis:1,2,3": "--psi is 'axis:1,2,3', wanted DEG, up, down",
    f"{ONE} --psi point:1,2": "--psi point has 2 numbers, wanted 3: x,y,z",
    f"{ONE} --acceleration 300": "--acceleration goes with --duration",
    "plan poses.csv {R} --samples 1": "samples is 1, wanted an integer from 2 to 10000000",
    f"plan poses.csv {{R}} --start {START}": "rad \\(",
    f"{ONE} --policy hold": "--policy needs --start",
    f"{STEP} best": "--policy is 'best', wanted one of repulsion, hold",
    f"{STEP} repulsion,K=2": "K is 2.0, wanted a number in [0, 1]",
    f"{STEP} repulsion,alpha=0": "alpha is 0.0, wanted a number in (0, 1e+06]",
    f"{STEP} hold,K=1": "--policy hold has no 'K', wanted one of outside",
    f"{STEP} centre,alpha=1": "--policy centre has no 'alpha'",
    f"{STEP} repulsion,outside=far": "outside is 'far', wanted nearest or stop",
    f"{STEP} repulsion,K=x": "--policy: K: 'x' is not a number",
    f"{STEP} repulsion,rate=1,K=1": "K per pose and rate per second are the same",
    f"{STEP} repulsion,rate=1": "give the time from pose to pose, dt",
    f"{STEP} repulsion --psi 1": "--psi does not go with --policy repulsion",
    f"{STEP} towards": "--policy towards needs a wish",
    f"{STEP} hold --goal {START}": "--goal does not go with --policy",
    f"{ONE} --start 0,150,0,0,0,0,0 --policy hold": "--start is outside the limits: joint 2 is 30.0000 deg",
    "plan bad.csv {R}": "bad.csv:3:7: qz is 'a', wanted a number",
    "place poses.csv {R} --x 1 --y 0,1": "--x is '1', wanted FROM,TO",
    "place poses.csv {R} --x 1,0 --y 0,1": "wanted FROM <= TO",
    "place poses.csv {R} --x 0,1 --y 0,1 --step 0": "--step is 0, wanted metres above 0",
    "place poses.csv {R} --x 0,1 --y 0,1 --step 1e-7": "positions along --x, wanted at most",
    "view joints.csv": "a FILE needs --robot: without it view shows the demo",
    "view --start {Q}": "--start needs --robot",
    "view {R} --start 0,130,0,0,0,0,0": "joint 2 is 10.0000 deg beyond its upper limit",
    "view {R} words.csv": "neither joints (words.csv",
    "plan a.csv {R} b.csv": "unrecognized arguments: b.csv",
    "view {R} --address :x": "--address is ':x', wanted HOST:PORT",
    "--threads x robots": "argument --threads: invalid int value",
}


@pytest.fixture
def files(tmp_path: Path) -> None:
    """Write the files that the command lines of this file name."""
    (tmp_path / "words.csv").write_text("a,b\n1,2\n")
    (tmp_path / "bad.csv").write_text("x,y,z,qw,qx,qy,qz\n0,0,1,1,0,0,0\n0,0,1,1,0,0,a\n")
    (tmp_path / "poses.csv").write_text("x,y,z,qw,qx,qy,qz\n0.4,0.1,0.5,0,1,0,0\n")
    cell = '[[ball]]\nname = "lamp"\ncenter = [0.28, 0.26, 0.6]\nradius = 0.05\n'
    (tmp_path / "cell.toml").write_text(cell)
    (tmp_path / "large.toml").write_text(cell.replace("0.05", "50.0"))
    (tmp_path / "kept.toml").write_text(f"clearance = 0.01\n{cell}")
    (tmp_path / "half_space.toml").write_text("[[half_space]]\nnormal = [0, 0, 1]\noffset = 0")


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize("words", BAD)
def test_bad_input_is_one_message_and_status_2(words: str, cli: Cli, tmp_path: Path) -> None:
    """Each bad command line has exit status 2, its message, no other output and no new file."""
    before = {file.name for file in tmp_path.iterdir()}
    ran = cli(words)
    assert ran.status == 2 and ran.out == "" and "Traceback" not in ran.err
    assert BAD[words].replace("\\", "") in ran.text
    assert {file.name for file in tmp_path.iterdir()} == before


# -- order, screens --------------------------------------------------------------------------------------


@pytest.mark.parametrize("parts", [
    ("inspect", "kuka_iiwa7_r800", "--joints j.csv", "-o out.csv"),
    ("plan", "p.csv", "{R}", f"--start {START}"),
    ("inspect", "kuka_iiwa7_r800", "--joints -1,2,-.3,4,5,6,7", "--json"),
])  # fmt: skip
def test_files_and_options_go_in_any_order(parts: tuple[str, ...], cli: Cli) -> None:
    """The order of files and options changes no output."""
    q = np.radians([float(word) for word in START.split(",")]) + np.outer(
        np.linspace(0, 0.02, 3), np.eye(7)[0]
    )
    aa.io.save(aa.Arm.from_catalogue("kuka_iiwa7_r800").forward(q)[0], "p.csv")
    np.savetxt("j.csv", q, delimiter=",", header=",".join(f"q{i}" for i in range(1, 8)), comments="")
    ran = [cli(" ".join([parts[0], *rest])) for rest in permutations(parts[1:])]
    assert {(one.status, one.out) for one in ran} == {(0, ran[0].out)}


def test_an_unwritable_screen_and_a_reader_that_has_seen_enough() -> None:
    """A full output is an error of status 2, a closed pipe is none."""
    robots = [sys.executable, "-m", "armangle", "robots"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(robots, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 2
    assert done.stderr == b"armangle: cannot write the output: No space left on device\n"
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(robots, stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")


def test_an_interrupt_is_quiet(monkeypatch: pytest.MonkeyPatch, cli: Cli) -> None:
    """An interrupt ends a command with status 130 and no output."""

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("armangle.cli.commands.robots.load_robot", interrupted)
    assert cli("robots") == (130, "", "")
