"""`ik`, `fk`, `robots` and `inspect` of a Franka: the same words, joint 7 in place of the arm angle."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import armangle as aa
from armangle.cli.main import main

FR3 = aa.OffsetArm.from_catalogue("franka_fr3")
Q = "10,20,10,-110,15,110,30"
START = np.radians([10, 20, 10, -110, 15, 110, 30])
POSE = "0.4,0.1,0.5,0,1,0,0"


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    status = main(list(words))
    out = capsys.readouterr()
    return status, out.out, out.err


@pytest.fixture
def urdf(tmp_path: Path) -> str:
    file = tmp_path / "fr3.urdf"
    file.write_text(FR3.to_urdf())
    return str(file)


@pytest.mark.parametrize("source", ["catalogue", "file"])
def test_ik_is_the_nearest_posture(capsys: pytest.CaptureFixture[str], urdf: str, source: str) -> None:
    arm = ("--robot", "franka_fr3") if source == "catalogue" else ("--urdf", urdf)
    status, text, _ = run(capsys, "ik", *arm, "--pose", POSE, "--near", Q, "--json")
    found = json.loads(text)
    assert status == 0 and found["free_joint"] == 7 and found["status"] == "OK"
    pose = FR3.forward(found["q"])[0]
    np.testing.assert_allclose(pose[:3, 3], [0.4, 0.1, 0.5], atol=1e-9)
    near = np.radians([float(x) for x in Q.split(",")])
    best = FR3.solve(pose, near)
    assert abs(best.distance - found["distance"]) < 1e-9
    status, text, _ = run(capsys, "ik", *arm, "--pose", POSE, "--near", Q)
    assert status == 0 and "joint 7 takes the place of psi" in text


def test_fk_says_pose_and_free_joint(capsys: pytest.CaptureFixture[str]) -> None:
    status, text, _ = run(capsys, "fk", "--robot", "franka_fr3", *Q.split(","), "--json")
    said = json.loads(text)
    q = np.radians([float(x) for x in Q.split(",")])
    pose, free, gc = FR3.forward(q)
    np.testing.assert_allclose(said["matrix"], pose, atol=1e-12)
    assert status == 0 and abs(said["free"] - free) < 1e-12 and said["gc"] == gc
    status, text, _ = run(capsys, "fk", "--robot", "franka_fr3", *Q.split(","))
    assert status == 0 and "joint 7 30.0000 deg" in text
    status, _, err = run(capsys, "fk", "--robot", "franka_fr3", "0", "0", "0", "0", "0", "0", "0")
    assert status == 1 and "joint 4" in err


def test_why_there_is_none_and_what_does_not_go(capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, "ik", "--robot", "franka_fr3", "--pose", "3,0,0,1,0,0,0")
    assert status == 1 and "out of reach" in err
    for words in (("--psi", "10", "--gc", "0"), ("--explain",), ("--all",), ("--outside", "nearest")):
        status, _, err = run(capsys, "ik", "--robot", "franka_fr3", "--pose", POSE, *words)
        assert status == 2 and "no arm angle" in " ".join(err.split())


def test_other_commands_name_the_door(capsys: pytest.CaptureFixture[str], urdf: str) -> None:
    status, _, err = run(capsys, "arcs", "--robot", "franka_fr3", "--pose", POSE)
    assert status == 2 and "armangle.OffsetArm" in " ".join(err.split())
    status, text, _ = run(capsys, "robots")
    assert status == 0 and "franka_fr3" in text


def test_commands_that_take_such_an_arm_are_named(
    capsys: pytest.CaptureFixture[str], urdf: str, tmp_path: Path
) -> None:
    line, picture = str(tmp_path / "line.csv"), str(tmp_path / "x.png")
    aa.save(np.repeat(FR3.forward(START)[0][None], 3, axis=0), line)
    joints = str(tmp_path / "joints.csv")
    aa.save(aa.follow(FR3, aa.load_poses(line), start=START), joints)
    taken = {
        "ik": ("--pose", POSE), "fk": (*Q.split(","),), "follow": (line, "--start", Q), "track": (line,),
        "retime": (joints, "--acceleration", "200"),
    }  # fmt: skip
    refused = {
        "arcs": ("--pose", POSE), "plan": (line,), "view": (), "plot": ("map", line, "-o", picture),
        "place": (line, "--x", "0,1", "--y", "0,1"), "reach": (str(tmp_path / "x.zarr"), "--spacing", "0.1"),
    }  # fmt: skip
    *first, last = taken
    named = f"on the command line {', '.join(first)} and {last}"
    for arm in (("--robot", "franka_fr3"), ("--urdf", urdf)):
        for command, words in taken.items():
            status, _, err = run(capsys, command, *words, *arm)
            assert status == 0, err
        for command, words in refused.items():
            status, _, err = run(capsys, command, *words, *arm)
            assert status == 2 and named in " ".join(err.split()), command
    status, text, _ = run(capsys, "inspect", urdf)
    assert status == 0 and f"for {', '.join(first)} and {last}: joint 7" in " ".join(text.split())


def test_robots_shows_what_is_known_of_one(capsys: pytest.CaptureFixture[str]) -> None:
    status, text, _ = run(capsys, "robots", "robotis_ai_worker_left")
    words = " ".join(text.split())
    assert status == 0 and "Source: MuJoCo model (ffw_bg2)" in words and "a_6 88.5" in words
    assert "Note: velocity not trusted: the source has none" in words
    facts = json.loads(run(capsys, "robots", "fetch", "--json")[1])
    assert (facts["name"], facts["a_1"], facts["joint_names"][0]) == ("fetch", 0.117, "shoulder_pan_joint")


def test_options_of_the_file_reach_the_arm(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "continuous.urdf"
    file.write_text(FR3.to_urdf().replace('type="revolute"', 'type="continuous"'))
    ask = ("ik", "--urdf", str(file), "--pose", POSE, "--json")
    status, text, err = run(capsys, *ask)
    assert status == 0 and not FR3.within_limits(json.loads(text)["q"])
    assert err.count("NOT used") == 7 and err.startswith("armangle: joint ") and "arguments.py" not in err
    status, text, err = run(capsys, *ask, "--continuous-limits", "use")
    assert status == 0 and FR3.within_limits(json.loads(text)["q"]) and err == ""
    status, _, err = run(capsys, *ask, "--inexact")
    assert status == 2 and "--inexact does not go with" in err and "--length-tolerance" in err


def test_tolerances_reach_the_arm(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "bent.urdf"
    text = FR3.to_urdf()
    at = text.index("<axis", text.index('"joint_4"'))
    file.write_text(text[:at] + '<axis xyz="0 0.001 1"/>' + text[text.index("/>", at) + 2 :])
    ask = ("ik", "--urdf", str(file), "--pose", POSE, "--json")
    status, _, err = run(capsys, *ask)
    said = " ".join(err.split())
    assert status == 2 and "--length-tolerance" in said
    at = said.index("--length", said.index("OffsetArm takes it"))
    options = said[at : said.index(")", at)].split()
    status, out, err = run(capsys, *ask, *options)
    assert status == 0 and json.loads(out)["status"] == "OK"
    assert err.startswith("armangle: not quite the arm of its file")


def test_inspect_shows_what_the_arm_is(capsys: pytest.CaptureFixture[str], urdf: str, tmp_path: Path) -> None:
    status, text, err = run(capsys, "inspect", urdf)
    said = " ".join(text.split())
    assert status == 0 and err == "" and "S-R-S but for an offset wrist" in said
    assert "d_bs 333, d_se 316, d_ew 384, d_wf 107" in said and "a_6 88" in said
    assert "position agrees with the file within 0.000000 mm" in said and "armangle.OffsetArm" in said
    assert "joint_4 -174.30 -8.70" in said
    found = json.loads(run(capsys, "inspect", urdf, "--json")[1])
    assert (found["srs"], found["offset"], found["toml"]) == (False, "wrist", None)
    assert found["a_6"] == FR3.a_6 and found["residual_position"] < 1e-9 and found["reach"] == FR3.reach
    status, _, err = run(capsys, "inspect", urdf, "-o", str(tmp_path / "fr3.toml"))
    assert status == 2 and "-o writes S-R-S arms" in err
    shoulder = tmp_path / "shoulder.urdf"
    shoulder.write_text(FR3.with_(a_1=0.1, a_6=0.0).to_urdf())
    status, text, _ = run(capsys, "inspect", str(shoulder))
    assert status == 0 and "S-R-S but for an offset shoulder" in text and "joint 1 takes" in text


@pytest.fixture
def line(tmp_path: Path) -> str:
    """A file of 41 poses of a straight line of 0.1 m from the joints Q."""
    poses = np.repeat(FR3.forward(START)[0][None], 41, axis=0)
    poses[:, 1, 3] += np.linspace(0.0, 0.1, 41)
    aa.save(poses, tmp_path / "line.csv")
    return str(tmp_path / "line.csv")


def test_follow_is_that_of_python(capsys: pytest.CaptureFixture[str], line: str, tmp_path: Path) -> None:
    ask = ("follow", line, "--robot", "franka_fr3", "--start", Q)
    joints = str(tmp_path / "joints.csv")
    status, text, err = run(capsys, *ask, "--policy", "hold", "-o", joints)
    assert status == 0 and "joint 7 first 30.0000 deg" in " ".join(text.split()), err
    path = aa.follow(FR3, aa.load_poses(line), start=START, policy=aa.Hold())
    np.testing.assert_allclose(aa.load_joints(joints).q, path.q, rtol=0, atol=1e-9)
    assert json.loads(run(capsys, *ask, "--json")[1])["free_joint"] == 7
    timed = ("retime", joints, "--robot", "franka_fr3", "--acceleration", "200", "--json")
    found = json.loads(run(capsys, *timed)[1])
    assert found["duration"] == pytest.approx(
        aa.retime(path, acceleration=np.radians(200)).duration, rel=1e-3
    )
    for words, said in (
        (("--scene", "x.toml"), "--scene does not go with FR3"),
        (("--roll", "free"), "roll= is not made for an OffsetArm"),
        (("--carry", "elbow"), "carry= is not made for an OffsetArm"),
    ):
        status, _, err = run(capsys, *ask, *words)
        assert status == 2 and said.lower() in " ".join(err.split()).lower().replace("franka_fr3", "fr3")


def test_track_is_the_tracker(capsys: pytest.CaptureFixture[str], line: str) -> None:
    ask = ("track", line, "--robot", "franka_fr3", "--rate", "50")
    status, text, _ = run(capsys, *ask, "--start", Q, "--json")
    found = json.loads(text)
    tracker = aa.Tracker(FR3, 1 / 50)
    tracker.start(START)
    ticks = [tracker.step(pose) for pose in aa.load_poses(line)]
    assert status == 0 and found["distance"]["max"] == pytest.approx(max(tick.distance for tick in ticks))
    found = json.loads(run(capsys, *ask, "--json")[1])
    first = FR3.solve(aa.load_poses(line)[0]).q
    np.testing.assert_allclose(found["start"], first, rtol=0, atol=1e-9)
    assert run(capsys, *ask)[0] == 0
    pose = ("ik", *ask[2:4], "--pose", "0.4,0.1,0.5,0,1,0,0")
    for option, value in (("--body", "90,80"), ("--hand", "30"), ("--clearance", "5")):
        for command in (ask, pose):
            status, _, err = run(capsys, *command, option, value)
            assert status == 2 and f"{option} does not go with" in err


def test_no_command_prints_a_raw_warning(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "iiwa.urdf"
    text = aa.Arm.from_catalogue("kuka_iiwa7_r800").to_urdf()
    file.write_text(text.replace('type="revolute"', 'type="continuous"'))
    for _ in range(2):
        status, _, err = run(capsys, "body", str(file))
        assert status == 2 and err.count("NOT used") == 7 and "UserWarning" not in err  # each is said once
