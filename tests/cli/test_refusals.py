"""What the command line says to bad input: one message on stderr, status 2, no traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.chain import simple_urdf

import armangle as aa
from armangle.cli import main

ROBOT = ["--robot", "kuka_iiwa7_r800"]
ZEROS = ["0"] * 7
POSE = ["--pose", "0,0,1,1,0,0,0"]
IK = ["ik", *ROBOT, "--gc", "0", "--psi", "0"]
FOLLOW = ["follow", "path.csv", *ROBOT, "--start"]
GOOD = "0,20,0,-60,0,60,0"

BAD_WORDS = {
    ("fkk",): "there is no command 'fkk'; did you mean 'fk'?",
    ("xyz",): "there is no command 'xyz'; the commands are demo, robots",
    ("fk", *ZEROS): "one of the arguments --robot --urdf is required",
    ("fk", *ROBOT, "1", "2"): "Q has 2 numbers, wanted 7: q1,..,q7 in degrees",
    ("fk", *ROBOT, "1,2,3,4,5,6,x"): "Q: 'x' is not a number, wanted q1,..,q7 in degrees",
    ("fk", *ROBOT, "1,2,3,4,5,6,inf"): "Q: 'inf' is not finite",
    ("fk", *ROBOT, "--base", "a", *ZEROS): "--base goes with --urdf, not with --robot",
    ("fk", *ROBOT, "--tip", "a", *ZEROS): "--tip goes with --urdf, not with --robot",
    ("fk", "--robot", "kuka_iiwa", *ZEROS): "no robot 'kuka_iiwa'; did you mean 'kuka_iiwa7_r800'",
    ("fk", "--robot", "no.toml", *ZEROS): "no.toml: no such file",
    ("fk", "--urdf", "no.urdf", *ZEROS): "no.urdf: no such file",
    ("fk", *ROBOT, "--urdf", "a", *ZEROS): "not allowed with argument",
    (
        "fk",
        *ROBOT,
        "-o",
        "a.txt",
        *ZEROS,
    ): "a.txt: ending '.txt' is not known, wanted one of .csv, .npz, .json",
    ("fk", *ROBOT, "-o", "no/a.csv", *ZEROS): "no/a.csv: cannot be written: No such file or directory",
    ("robots", "kuca"): "the catalogue has no robot 'kuca'",
    (*IK,): "one of the arguments --pose --kuka is required",
    (*IK, "--pose", "1,2,3"): "--pose has 3 numbers, wanted 7: x,y,z,qw,qx,qy,qz",
    (
        *IK,
        "--pose",
        "0,0,1,1,1,0,0",
    ): "the quaternion has length 1.414214, wanted 1 within 1e-06; made unit it is 0.70710678,0.70710678,0,0",
    (*IK, "--pose", "0,0,1,0,0,0,0"): "--pose: the quaternion has length 0, wanted 1 within 1e-06",
    (*IK, "--pose", "no.csv"): "no.csv: no such file",
    (*IK, *POSE, "--psi", "abc"): "argument --psi: 'abc' is not a number",
    (*IK, *POSE, "--psi", "nan"): "argument --psi: 'nan' is not finite",
    (*IK, *POSE, "--gc", "8"): "argument --gc: invalid choice: 8",
    (*IK, *POSE, "--seed", "1"): "--seed has 1 numbers, wanted 7",
    ("ik", *ROBOT, *POSE, "--psi", "0"): "--psi needs --gc or --all; without --psi the nearest posture",
    ("ik", *ROBOT, *POSE, "--seed", GOOD): "--seed goes with --psi; without an arm angle wanted --near",
    ("ik", *ROBOT, *POSE, "--near", "1,2"): "--near has 2 numbers, wanted 7: q1,..,q7 in degrees",
    ("ik", *ROBOT, *POSE, "--near", "0,0,720,0,0,0,0"): "--near: joint 3 is 720 deg, 550 deg outside its",
    ("ik", "--robot", "franka_fr3", *POSE, "--near", "0,0,0,-900,0,0,0"): "--near: joint 4 is -900 deg",
    ("plan", "path.csv", *ROBOT, "--start", "0,0,0,0,0,0,-900"): "--start: joint 7 is -900 deg, 725 deg",
    ("plan", "path.csv", *ROBOT, "--goal", "720,0,0,0,0,0,0"): "--goal: joint 1 is 720 deg, 550 deg",
    ("ik", *ROBOT, *POSE, "--metric", "l3"): "argument --metric: invalid choice: 'l3'",
    ("ik", *ROBOT, *POSE, "--all", "-o", "a.csv"): "leave it out for a file of poses or for -o",
    (*IK, *POSE, "--near", GOOD): "--near, --metric, --outside, --roll go without --psi",
    ("ik", *ROBOT, *POSE, "--psi", "0", "--all", "-o", "a.csv"): "--all takes one pose and prints it",
    ("arcs", *ROBOT): "one of the arguments --pose --q is required",
    ("arcs", *ROBOT, *POSE, "--joint", "8"): "argument --joint: invalid choice: 8",
    (
        "arcs",
        *ROBOT,
        *POSE,
        "--singularity-margin",
        "100",
    ): "argument --singularity-margin: 100 deg, wanted 0 to 85.94 deg",
    (*FOLLOW, GOOD, "--singularity-margin", "-1"): "--singularity-margin: -1 deg, wanted 0 to 85.94 deg",
    (*FOLLOW, GOOD, "--max-joint-step", "0"): "argument --max-joint-step: 0 deg, wanted more than 0 deg",
    ("plan", "path.csv", *ROBOT, "--limit-margin", "200"): "--limit-margin: 200 deg, wanted 0 to 180 deg",
    (
        "plan",
        "path.csv",
        *ROBOT,
        "--limit-margin",
        "130",
    ): "--limit-margin is 130.00 deg, wanted at most 120.00: half of the narrowest range",
    ("view", *ROBOT, "--start", "0,130,0,0,0,0,0"): "joint 2 is 10.0000 deg beyond its upper limit",
    (*FOLLOW, GOOD): "path.csv: no such file",
    (*FOLLOW, "1,2"): "--start has 2 numbers, wanted 7",
    (
        *FOLLOW,
        "0,150,0,0,0,0,0",
    ): "--start is outside the limits: joint 2 is 30.0000 deg beyond its upper limit",
    (*FOLLOW, GOOD, "--K", "2"): "K is 2.0, wanted a number in [0, 1]",
    (*FOLLOW, GOOD, "--alpha", "0"): "alpha is 0.0, wanted a number in (0, 1e+06]",
    (*FOLLOW, GOOD, "--policy", "hold", "--K", "1"): "--K does not go with --policy hold",
    (*FOLLOW, GOOD, "--policy", "centre", "--alpha", "1"): "--alpha does not go with --policy centre",
    (*FOLLOW, GOOD, "--psi", "1"): "--psi does not go with --policy repulsion",
    (*FOLLOW, GOOD, "--policy", "towards"): "no wish given, wanted one of psi, point, direction",
    (*FOLLOW, GOOD, "--policy", "towards", "--point", "1,2"): "--point has 2 numbers, wanted 3: x,y,z",
    (*FOLLOW, GOOD, "--policy", "towards", "--direction", "north"): "wanted one of 'up'",
    (*FOLLOW, GOOD, "--rate", "1", "--K", "1"): "--K and --rate are one and the same",
    ("inspect", "no.urdf"): "no.urdf: no such file",
}


@pytest.mark.parametrize("words", BAD_WORDS, ids=" ".join)
def test_bad_input(
    words: tuple[str, ...],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    said = capsys.readouterr()
    assert BAD_WORDS[words] in " ".join(said.err.split())
    assert said.out == "" and list(tmp_path.iterdir()) == []


def test_bad_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "p.csv"
    file.write_text("x,y,z,qw,qx,qy,qz\n0,0,1,1,0,0,0\n0,0,1,1,0,0,a\n")
    assert main([*FOLLOW[:1], str(file), *FOLLOW[2:], GOOD]) == 2
    assert "p.csv:3:7: qz is 'a', wanted a number" in " ".join(capsys.readouterr().err.split())
    aa.save(aa.Arm.from_catalogue(ROBOT[1]).forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0], file)
    assert main([*FOLLOW[:1], str(file), *FOLLOW[2:], GOOD, "--rate", "1"]) == 2
    assert "--rate is per second" in capsys.readouterr().err
    joints = tmp_path / "q.csv"
    joints.write_text("q1,q2,q3,q4,q5,q6,q7\n0,0,0,nan,0,0,0\n")
    assert main(["fk", *ROBOT, str(joints)]) == 2
    assert "row 0 has no joint values, wanted a motion without gaps" in " ".join(
        capsys.readouterr().err.split()
    )


def test_an_arm_that_is_not_srs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1).to_urdf()
    (tmp_path / "good.urdf").write_text(text)
    assert main(["inspect", str(tmp_path / "good.urdf")]) == 0
    (tmp_path / "bad.urdf").write_text(simple_urdf())
    capsys.readouterr()
    assert main(["inspect", str(tmp_path / "bad.urdf"), "--json"]) == 1
    said = capsys.readouterr()
    assert '"srs": false' in said.out and "is not S-R-S" in " ".join(said.err.split())
    assert main(["fk", "--urdf", str(tmp_path / "bad.urdf"), *ZEROS]) == 2


def test_several_chains_are_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1).to_urdf()
    root = text[text.index("<link") : text.index("</robot>")]
    names = {part.split('"')[0] for part in root.split('name="')[1:]}
    second = root
    for name in names:
        second = second.replace(f'"{name}"', f'"{name}_b"')
    (tmp_path / "two.urdf").write_text(text.replace("</robot>", second + "</robot>"))
    assert main(["inspect", str(tmp_path / "two.urdf")]) == 2
    said = capsys.readouterr().err
    listed = "name base and tip; chains of seven rotating joints: --base base --tip tip S-R-S --base"
    assert listed in " ".join(said.split())
    pairs = [line.split()[:4] for line in said.splitlines() if line.startswith("  --base")]
    assert len(pairs) == 2
    assert all(main(["inspect", str(tmp_path / "two.urdf"), *pair]) == 0 for pair in pairs)
    assert main(["inspect", str(tmp_path / "two.urdf"), "--base", pairs[1][1]]) == 0


def test_an_unwritable_screen() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "armangle", "robots"], stdout=full, stderr=subprocess.PIPE
        )
    assert done.returncode == 2
    assert done.stderr == b"armangle: cannot write the output: No space left on device\n"


def test_a_reader_that_has_seen_enough() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([sys.executable, "-m", "armangle", "robots"], stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")


def test_an_interrupt_is_quiet(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("armangle.cli.commands.robots.load_robot", interrupted)
    assert main(["robots"]) == 130
    assert capsys.readouterr().err == ""
