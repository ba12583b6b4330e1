"""The command line: what is printed and written, and the exit status."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from support.calibrated import calibrated
from support.needs import need

import armangle as aa
from armangle.cli import arguments, main
from armangle.cli.tables import WIDTH
from armangle.poses import rows_from_poses

ROBOT = ("--robot", "kuka_iiwa7_r800")
START_DEG = [-5.4101, -26.4986, -48.1542, -61.65, 152.6198, 114.4466, 8.1812]
Q = ",".join(map(str, START_DEG))
POSE = "-0.117424,-0.146412,1.020287,0.425538,-0.432663,0.352360,0.712434"
FAR = "2,0,0,1,0,0,0"
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def line(tmp_path: Path) -> Path:
    """A file of 21 poses, 0.05 m along the tool's z axis from the paper's start."""
    arm = aa.Arm.from_catalogue(ROBOT[1])
    pose = arm.forward(np.radians(START_DEG))[0]
    poses = np.repeat(pose[None], 21, axis=0)
    poses[:, :3, 3] += np.linspace(0, 0.05, 21)[:, None] * pose[:3, 2]
    aa.save(poses, tmp_path / "line.csv")
    return tmp_path / "line.csv"


def out(capsys: Capture, *words: str, status: int = 0) -> str:
    """Run a command, check its status and the width of its lines, and return what it printed."""
    assert main(words) == status
    text = capsys.readouterr().out
    if "--json" not in words:
        lines = [line for line in text.splitlines() if " " in line.strip()]  # a path alone may be longer
        assert max(map(len, lines), default=0) <= WIDTH
    return text


def test_robots(capsys: Capture) -> None:
    text = out(capsys, "robots")
    assert all(name in text for name in aa.catalogue())
    assert "reach: greatest distance of the wrist from the shoulder" in text
    listed = json.loads(out(capsys, "robots", "--json"))
    assert [entry["name"] for entry in listed] == list(aa.catalogue())
    found = out(capsys, "robots", "Fourier", "left")
    assert [name for name in aa.catalogue() if name in found] == list(aa.catalogue("left fourier"))
    assert "Source:" in out(capsys, "robots", "iiwa7")
    for name in aa.catalogue():
        assert name in out(capsys, "robots", name)
        facts = json.loads(out(capsys, "robots", name, "--json"))
        arm = aa.Arm.from_catalogue(name)
        assert facts["reach"] == arm.reach and facts["lower"] == arm.lower.tolist()


def test_what_is_not_proven_is_said(capsys: Capture, tmp_path: Path) -> None:
    arm = calibrated("kuka_iiwa7_r800", 2.0, 5.0)
    file = tmp_path / "calibrated.urdf"
    file.write_text(arm.to_urdf())
    named = ("--urdf", str(file), "--inexact")
    q = [*START_DEG[:5], 0.05, START_DEG[6]]  # axes 5 and 7 are nearly one: branches meet
    words = ("--q", ",".join(map(str, q)))
    read = aa.Arm.from_urdf(file, exact=False)
    pose, _, gc = read.forward(np.radians(q))
    arcs = read.feasible(pose, gc)
    assert arcs.unproven > 0.01
    measure = f"{np.degrees(arcs.unproven):.2f} deg of gc {gc}"
    assert main(["arcs", *named, *words]) == 0
    shown = capsys.readouterr()
    assert "not proven beyond" in shown.out and "None" not in shown.out and measure in shown.err
    (facts,) = json.loads(out(capsys, "arcs", *named, *words, "--json"))
    assert facts["unproven"] == pytest.approx(float(arcs.unproven))
    facts = json.loads(out(capsys, "arcs", *named, *words, "--joint", "--json"))
    assert [entry["unproven"] for entry in facts] == read.joint_feasible(pose, gc).unproven.tolist()
    row = ",".join(f"{v:.17g}" for v in rows_from_poses(pose[None])[0])
    near = ("--pose", row, "--near", ",".join(map(str, np.array(q) + 0.5)))
    assert read.solve(pose, near=np.radians(np.array(q) + 0.5)).status == aa.Status.UNPROVEN
    assert "not proven that no posture is nearer" in " ".join(out(capsys, "ik", *named, *near).split())
    assert main(["ik", *named, *near, "--all"]) == 0
    assert measure in " ".join(capsys.readouterr().err.split())
    facts = json.loads(out(capsys, "ik", *named, *near, "--all", "--json"))
    assert facts["unproven"] == pytest.approx(read.feasible_all(pose).unproven.tolist())
    assert main(["arcs", *ROBOT, "--q", Q]) == 0
    assert capsys.readouterr().err == ""


def test_what_is_not_proven_of_many_poses_is_said(capsys: Capture, tmp_path: Path) -> None:
    arm = calibrated("kuka_iiwa7_r800", 2.0, 5.0)
    (tmp_path / "calibrated.urdf").write_text(arm.to_urdf())
    q = np.radians([*START_DEG[:5], 0.05, START_DEG[6]])
    aa.save(arm.forward(np.array([q, np.radians(START_DEG)]))[0], tmp_path / "two.csv")
    near = ",".join(map(str, np.degrees(q) + 0.5))
    named = ("--urdf", str(tmp_path / "calibrated.urdf"), "--inexact", "--near", near)
    text = out(capsys, "ik", *named, "--pose", str(tmp_path / "two.csv"))
    assert "UNPROVEN, 1 pose:" in text


def test_a_branch_without_a_certain_posture_leaves_the_others(capsys: Capture, tmp_path: Path) -> None:
    arm = calibrated("kuka_iiwa7_r800", 2.0, 5.0)
    (tmp_path / "calibrated.urdf").write_text(arm.to_urdf())
    named = ("--urdf", str(tmp_path / "calibrated.urdf"), "--inexact")
    arm = aa.Arm.from_urdf(tmp_path / "calibrated.urdf", exact=False)
    pose, psi, _ = arm.forward(np.radians([*START_DEG[:3], -0.5, *START_DEG[4:]]))  # nearly stretched
    rows = arm.inverse_all(pose, psi, unreachable="nan")
    lost = np.flatnonzero(np.isnan(rows).any(axis=1))
    assert 0 < len(lost) < 8
    row = ",".join(f"{v:.17g}" for v in rows_from_poses(pose[None])[0])
    words = ("ik", *named, "--pose", row, "--psi", f"{np.degrees(psi):.15g}")
    status = int(not (np.isfinite(rows).all(axis=1) & arm.within_limits(np.nan_to_num(rows))).any())
    assert main([*words, "--all"]) == status
    shown = capsys.readouterr()
    assert f"gc {', '.join(map(str, lost))}: Branches meet here" in " ".join(shown.err.split())
    told = json.loads(out(capsys, *words, "--all", "--json", status=status))["q"]
    np.testing.assert_allclose(np.array(told, dtype=float), rows, atol=1e-6)
    assert main([*words, "--gc", str(lost[0])]) == 1
    said = capsys.readouterr().err
    assert "Branches meet here" in said and "unreachable" not in said


def test_fk_and_ik_are_inverse(capsys: Capture) -> None:
    text = out(capsys, "fk", *ROBOT, *map(str, START_DEG))
    assert "58.5882 deg" in text and "3 (shoulder -, elbow -, wrist +)" in text
    assert out(capsys, "fk", *ROBOT, Q) == text
    row = text.splitlines()[text.splitlines().index("x,y,z,qw,qx,qy,qz") + 1]
    text = out(capsys, "ik", *ROBOT, "--pose", row, "--psi", "58.58816", "--gc", "3")
    shown = [float(line.split()[2]) for line in text.splitlines()[-7:]]
    assert shown == pytest.approx(START_DEG, abs=2e-3)


def test_json_is_in_radians(capsys: Capture) -> None:
    fk = json.loads(out(capsys, "fk", *ROBOT, Q, "--json"))
    assert np.degrees(fk["psi"]) == pytest.approx(58.58816372916817) and fk["gc"] == 3
    pose = ",".join(map(repr, fk["pose"]))
    words = ("--pose", pose, "--psi", repr(float(np.degrees(fk["psi"]))))
    ik = json.loads(out(capsys, "ik", *ROBOT, *words, "--gc", "3", "--json"))
    assert np.degrees(ik["q"]) == pytest.approx(START_DEG) and ik["status"] == "OK"
    every = json.loads(out(capsys, "ik", *ROBOT, *words, "--all", "--json"))
    assert every["q"][3] == pytest.approx(ik["q"]) and every["within_limits"].count(True) == 6


def test_ik_all_marks_what_is_outside(capsys: Capture) -> None:
    lines = out(capsys, "ik", *ROBOT, "--pose", POSE, "--psi", "58.5882", "--all").splitlines()[-8:]
    assert [line.split()[0] for line in lines] == list("01234567")
    assert ["*" in line for line in lines] == [False, False, True, False, False, False, True, False]


def test_ik_says_why_not(capsys: Capture) -> None:
    assert main(["ik", *ROBOT, "--pose", POSE, "--psi", "30", "--gc", "3"]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "psi 30.00 deg is not feasible: joint 5 is 5.7" in said
    assert "beyond its lower limit. Feasible with gc 3: [-22.82, 24.88], [42.70, 322.07] deg." in said
    assert main(["ik", *ROBOT, "--pose", FAR, "--psi", "0", "--gc", "0"]) == 1
    assert "out of reach by 1253.57 mm" in " ".join(capsys.readouterr().err.split())
    assert main(["ik", *ROBOT, "--pose", FAR, "--psi", "0", "--all"]) == 1
    assert "out of reach by 1253.57 mm" in " ".join(capsys.readouterr().err.split())


def test_ik_without_psi_is_the_nearest_posture(capsys: Capture) -> None:
    text = " ".join(out(capsys, "ik", *ROBOT, "--pose", POSE, "--near", Q).split())
    assert "psi 58.5" in text and "gc 3" in text
    assert "nearest to --near: 0.00 deg from it (root of the sum of squares)" in text
    text = " ".join(out(capsys, "ik", *ROBOT, "--pose", POSE).split())
    assert "nearest to the middle of the joint ranges: " in text
    words = ("ik", *ROBOT, "--pose", POSE, "--near", "0,0,0,0,0,0,0", "--metric", "max")
    assert "nearest to --near: no joint is further than" in " ".join(out(capsys, *words).split())
    only = json.loads(out(capsys, "ik", *ROBOT, "--pose", POSE, "--gc", "5", "--json"))
    assert only["gc"] == 5


def test_ik_outside_is_the_nearest_pose(capsys: Capture) -> None:
    words = ("ik", *ROBOT, "--pose", "1.2,0,0.5,1,0,0,0", "--outside", "nearest")
    assert main(words) == 1  # the pose itself has no posture
    said = capsys.readouterr()
    assert "out of reach" in " ".join(said.err.split())
    assert main((*words, "--json")) == 1
    facts = json.loads(capsys.readouterr().out)
    arm = aa.Arm.from_catalogue(ROBOT[1])
    found = arm.solve(aa.pose([1.2, 0.0, 0.5]), facts["near"], outside="nearest")
    assert facts["q"] == found.q.tolist() and facts["gap"] == found.gap > 0.1
    assert f"{1e3 * found.gap:.4g} mm from the one asked" in said.out
    assert main((*words[:-2], "--psi", "0", "--gc", "0", *words[-2:])) == 2


def test_ik_near_is_solve(capsys: Capture) -> None:
    arm, near = aa.Arm.from_catalogue(ROBOT[1]), np.radians([10.0, 30, -20, -80, 5, 40, 0])
    words = ("ik", *ROBOT, "--pose", POSE, "--near", "10,30,-20,-80,5,40,0", "--json")
    for metric in ("l2", "max"):
        shown = json.loads(out(capsys, *words, "--metric", metric))
        pose = arguments.pose("--pose", POSE)
        found = arm.solve(pose, near, metric=metric)
        assert shown["q"] == pytest.approx(found.q) and shown["gc"] == found.gc and shown["status"] == "OK"
        assert shown["distance"] == pytest.approx(found.distance) and shown["metric"] == metric
        assert shown["near"] == pytest.approx(near)
        every = json.loads(out(capsys, *words, "--metric", metric, "--all"))
        assert len(every["q"]) == len(arm.solutions(pose, near)) and every["q"][0] == pytest.approx(found.q)
        assert every["distance"] == sorted(every["distance"])


def test_ik_all_without_psi_lists_each_branch_and_arc(capsys: Capture) -> None:
    text = out(capsys, "ik", *ROBOT, "--pose", POSE, "--near", Q, "--all")
    assert "one posture for each branch and arc, nearest to --near" in text
    rows = [line.split() for line in text.splitlines()[3:]]
    assert rows[0][0] == "3" and [float(row[-2]) for row in rows] == sorted(float(row[-2]) for row in rows)


@pytest.mark.parametrize("more", [(), ("--all",), ("--json",), ("--near", Q)], ids=str)
def test_ik_near_says_why_not(capsys: Capture, more: tuple[str, ...]) -> None:
    assert main(["ik", *ROBOT, "--pose", FAR, *more]) == 1
    assert "out of reach by 1253.57 mm" in " ".join(capsys.readouterr().err.split())


def test_ik_near_of_a_file(capsys: Capture, line: Path, tmp_path: Path) -> None:
    to = tmp_path / "q.csv"
    text = out(capsys, "ik", *ROBOT, "--pose", str(line), "--near", Q, "-o", str(to))
    assert text.startswith("nearest to --near") and text.count("OK") == 20
    back, poses = aa.load_joints(to), aa.load_poses(line)
    arm = aa.Arm.from_catalogue(ROBOT[1])
    assert len(back) == 21 and (back.status == aa.Status.OK).all()
    assert np.abs(back.q - arm.solve(poses, near=np.radians(START_DEG)).q).max() < 1e-6
    poses[4, 0, 3] += 3
    aa.save(poses, tmp_path / "far.csv")
    assert main(["ik", *ROBOT, "--pose", str(tmp_path / "far.csv")]) == 1
    assert "1 of 21 poses fail; pose 4: pose is out of reach" in " ".join(capsys.readouterr().err.split())


def test_ik_of_a_file(capsys: Capture, line: Path, tmp_path: Path) -> None:
    to = tmp_path / "q.csv"
    text = out(capsys, "ik", *ROBOT, "--pose", str(line), "--psi", "90", "--gc", "3", "-o", str(to))
    assert len(text.splitlines()) == 22
    back = aa.load_joints(to)
    assert len(back) == 21 and (back.status == aa.Status.OK).all() and np.allclose(back.psi, np.pi / 2)
    assert main(["fk", *ROBOT, str(to), "-o", str(tmp_path / "again.npz")]) == 0
    said = capsys.readouterr()
    assert "90.0000" in said.out and said.err.replace("\n", "") == f"wrote {tmp_path / 'again.npz'}"
    assert np.abs(aa.load_poses(tmp_path / "again.npz") - aa.load_poses(line)).max() < 1e-12
    words = ("ik", *ROBOT, "--pose", str(line), "--psi", "35", "--gc", "3", "-o", str(to))
    assert main(words) == 1
    assert "21 of 21 poses fail; pose 0: psi 35.00 deg is not feasible" in " ".join(
        capsys.readouterr().err.split()
    )
    assert (aa.load_joints(to).status == aa.Status.OUTSIDE).all()


def test_fk_outside_the_limits(capsys: Capture) -> None:
    out(capsys, "fk", *ROBOT, "0", "150", "0", "0", "0", "-130", "0", status=1)
    assert main(["fk", *ROBOT, "0,150,0,0,0,-130,0"]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert (
        "joint 2 is 30.0000 deg beyond its upper limit, joint 6 is 10.0000 deg beyond its lower limit" in said
    )


def test_arcs(capsys: Capture) -> None:
    text = out(capsys, "arcs", *ROBOT, "--q", Q)
    assert "joint 1 lower -170.0" in text and "322.0673" in text and "gc 3: shoulder -" in text
    facts = json.loads(out(capsys, "arcs", *ROBOT, "--q", Q, "--json"))
    assert np.degrees(facts[0]["intervals"]) == pytest.approx(
        np.array([[-22.82, 24.88], [42.70, 322.07]]), abs=5e-3
    )
    assert facts[0]["ends"][0][0] == {"joint": 1, "side": "lower", "value": pytest.approx(np.radians(-170))}
    assert [f["gc"] for f in json.loads(out(capsys, "arcs", *ROBOT, "--pose", POSE, "--json"))] == list(
        range(8)
    )
    each = out(capsys, "arcs", *ROBOT, "--q", Q, "--joint")
    assert each.count("full circle") == 5 and "3 q7" in each
    assert "joint 5 upper" in out(capsys, "arcs", *ROBOT, "--q", Q, "--gc", "0", "--joint", "5")
    for more in ((), ("--gc", "2"), ("--joint",)):  # the reason alone, once
        assert out(capsys, "arcs", *ROBOT, "--pose", FAR, *more, status=1) == ""
    facts = json.loads(out(capsys, "arcs", *ROBOT, "--pose", FAR, "--json", status=1))
    assert [fact["status"] for fact in facts] == ["UNREACHABLE"] * 8
    assert main(["arcs", *ROBOT, "--pose", FAR, "--gc", "2"]) == 1
    assert "no feasible arm angle. pose is out of reach by 1253.57 mm" in " ".join(
        capsys.readouterr().err.split()
    )


def test_arcs_keep_a_singularity_margin(capsys: Capture) -> None:
    words = ("arcs", *ROBOT, "--q", "0,10,0,-60,0,50,0", "--json")
    free = json.loads(out(capsys, *words))[0]["intervals"]
    kept = json.loads(out(capsys, *words, "--singularity-margin", "30"))[0]["intervals"]
    assert np.diff(kept).sum() < np.diff(free).sum()


@pytest.mark.parametrize(
    "words",
    [
        ("ik", "--pose", "line.csv", "--psi", "90", "--gc", "3"),
        ("follow", "line.csv", "--start", Q),
        ("plan", "line.csv"),
    ],
    ids=lambda words: words[0],
)
def test_what_is_written_is_said(
    words: tuple[str, ...], capsys: Capture, line: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(line.parent)
    for more in ((), ("--json",)):
        assert main([*words, *ROBOT, "-o", "joints.csv", *more]) == 0
        assert capsys.readouterr().err == "wrote joints.csv\n"


def test_one_pose_is_not_several(capsys: Capture, line: Path, tmp_path: Path) -> None:
    aa.save(aa.load_poses(line)[:1], tmp_path / "one.csv")
    text = out(capsys, "follow", str(tmp_path / "one.csv"), *ROBOT, "--start", Q)
    assert "1  pose\n" in text and "The one pose is solved within all limits." in text
    far = aa.load_poses(line)[:1] + 9 * np.eye(4, k=3)
    aa.save(far, tmp_path / "far.csv")
    assert main(["follow", str(tmp_path / "far.csv"), *ROBOT, "--start", Q]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert said.startswith("armangle: The one pose is not solved.") and "out of reach" in said
    assert main(["ik", "--pose", str(tmp_path / "far.csv"), "--psi", "0", "--gc", "0", *ROBOT]) == 1
    assert capsys.readouterr().err.startswith("armangle: pose is out of reach")


@pytest.mark.parametrize("ending", [".csv", ".npz", ".json"])
def test_follow(capsys: Capture, line: Path, tmp_path: Path, ending: str) -> None:
    to = tmp_path / f"q{ending}"
    text = out(
        capsys, "follow", str(line), *ROBOT, "--start", Q, "-o", str(to), "--alpha", "50", "--K", "0.05"
    )
    assert "All 21 poses are solved within all limits." in text
    arm = aa.Arm.from_catalogue(ROBOT[1])
    policy = aa.Repulsion(K=0.05, alpha=50)
    path = aa.follow(arm, aa.load_poses(line), start=np.radians(START_DEG), policy=policy)
    assert np.array_equal(aa.load_joints(to).q, path.q)


def test_follow_reports_where_it_fails(capsys: Capture, line: Path, tmp_path: Path) -> None:
    to = tmp_path / "q.csv"
    words = ["follow", str(line), *ROBOT, "--start", Q, "-o", str(to), "--max-joint-step", "0.01", "--json"]
    assert main(words) == 1
    said = capsys.readouterr()
    assert json.loads(said.out)["status"] == {"OK": 1, "JOINT_JUMP": 1, "NOT_REACHED": 19}
    assert "pose 1 (s = 0.05) is the first that is not." in " ".join(said.err.split())
    assert aa.load_joints(to).status[1] == aa.Status.JOINT_JUMP


@pytest.mark.parametrize(
    ("options", "policy"),
    [
        (("--policy", "hold"), "Hold(outside='nearest')"),
        (("--policy", "centre", "--K", "0.01"), "Centre(K=0.01, rate=None, outside='nearest')"),
        (("--rate", "1", "--dt", "0.01"), "Repulsion(K=0.1, alpha=20.0, rate=1.0, outside='nearest')"),
        (("--outside", "stop"), "Repulsion(K=0.1, alpha=20.0, rate=None, outside='stop')"),
        (
            ("--policy", "towards", "--psi", "90", "--K", "0.05"),
            f"Towards(psi={np.pi / 2}, point=None, direction=None, K=0.05, rate=None, outside='nearest')",
        ),
        (
            ("--policy", "towards", "--direction", "up"),
            "Towards(psi=None, point=None, direction='up', K=0.1, rate=None, outside='nearest')",
        ),
        (
            ("--policy", "towards", "--direction=0,-1,0", "--rate", "2", "--dt", "0.01"),
            "Towards(psi=None, point=None, direction=(0.0, -1.0, 0.0), K=0.1, rate=2.0, outside='nearest')",
        ),
        (
            ("--policy", "towards", "--point=0.1,0.2,0.3"),
            "Towards(psi=None, point=(0.1, 0.2, 0.3), direction=None, K=0.1, rate=None, outside='nearest')",
        ),
    ],
)
def test_follow_with_policies(capsys: Capture, line: Path, options: tuple[str, ...], policy: str) -> None:
    facts = json.loads(out(capsys, "follow", str(line), *ROBOT, "--start", Q, "--json", *options))
    assert facts["policy"] == policy and facts["status"] == {"OK": 21}


def test_inspect_and_what_it_saves(capsys: Capture, tmp_path: Path) -> None:
    arm = aa.Arm.from_catalogue("openarm_v10")
    (tmp_path / "arm.urdf").write_text(arm.to_urdf())
    assert main(["inspect", str(tmp_path / "arm.urdf")]) == 0
    text = capsys.readouterr().out
    assert "S-R-S" in text and "\nd_se = 0.22\n" in text
    report = json.loads(out(capsys, "inspect", str(tmp_path / "arm.urdf"), "--json"))
    assert report["srs"] is True and report["residual_position"] < 1e-9
    to = tmp_path / "own.toml"
    assert main(["inspect", str(tmp_path / "arm.urdf"), "-o", str(to)]) == 0
    assert "wrote" in capsys.readouterr().err
    words = ("0.1,0.2,0.3,20,0.5,0.6,0.7", "--json")
    wanted = json.loads(out(capsys, "fk", "--robot", "openarm_v10", *words))["pose"]
    for source in (("--robot", str(to)), ("--urdf", str(tmp_path / "arm.urdf"))):
        assert json.loads(out(capsys, "fk", *source, *words))["pose"] == pytest.approx(wanted)


def near_urdf(tmp_path: Path) -> str:
    """Write an arm whose joint 2 sits 12 mm beside axis 1, and return its name."""
    text = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1, velocity=[1] * 7).to_urdf()
    first, rest = text.split('<joint name="joint_2"', 1)
    rest = re.sub(r'xyz="[^"]*"', 'xyz="0.012 0 0.3"', rest, count=1)
    (tmp_path / "near.urdf").write_text(f'{first}<joint name="joint_2"{rest}')
    return str(tmp_path / "near.urdf")


@pytest.mark.slow
def test_inspect_advises_options_that_there_are(capsys: Capture, tmp_path: Path) -> None:
    file = near_urdf(tmp_path)
    assert main(["inspect", file]) == 1
    said = " ".join(capsys.readouterr().err.split())
    advised = re.search(r"--length-tolerance (\S+)\) the S-R-S arm fitted to it is taken", said)
    assert advised is not None
    options = ["--length-tolerance", advised[1], "--angle-tolerance", "0.01"]
    text = out(capsys, "inspect", file, *options, "-o", str(tmp_path / "near.toml"))
    assert "arm: the S-R-S arm fitted to it" in text and "position agrees with the file within" in text
    q = "10,20,30,-40,50,60,70"
    near = out(capsys, "fk", "--urdf", file, "--length-tolerance", advised[1], q)
    assert near == out(capsys, "fk", "--urdf", file, "--length-tolerance", "50", q)
    assert "joint 1" in out(capsys, "fk", "--urdf", file, q)  # as it is: an arm with an offset shoulder
    assert main(["fk", *ROBOT, "--length-tolerance", "1", q]) == 2
    assert "--length-tolerance goes with --urdf" in capsys.readouterr().err
    for words in (["--length-tolerance", "200"], ["--length-tolerance", "-1"], ["--angle-tolerance", "90"]):
        assert main(["inspect", file, *words]) == 2


@pytest.mark.slow
def test_inspect_shows_the_chain_that_a_near_file_keeps(capsys: Capture, tmp_path: Path) -> None:
    file = near_urdf(tmp_path)
    assert main(["inspect", file]) == 1
    assert "exact=False (on the command line --inexact) takes" in " ".join(capsys.readouterr().err.split())
    text = " ".join(out(capsys, "inspect", file, "--inexact").split())
    assert "the S-R-S arm fitted to it" in text and "branches merge within" in text and "--robot" not in text
    said = json.loads(out(capsys, "inspect", file, "--inexact", "--json"))
    assert said["near"] and not said["srs"] and said["deviation"]["position_max"] > 1e-4
    assert 0.5 < said["proven_share"] <= 1 and f"at {100 * said['proven_share']:.3g} % of 50" in text
    assert main(["inspect", file, "--inexact", "-o", str(tmp_path / "x.toml")]) == 2
    assert "-o writes exact S-R-S arms" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "x.toml").exists()


def test_limits_of_continuous_joints_are_not_passed_over(capsys: Capture, tmp_path: Path) -> None:
    text = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1, lower=[-1] * 7, upper=[1] * 7).to_urdf()
    (tmp_path / "arm.urdf").write_text(text.replace('type="revolute"', 'type="continuous"'))
    file = str(tmp_path / "arm.urdf")
    to = ["-o", str(tmp_path / "arm.toml")]
    assert "note: joint 'joint_1' is continuous" in " ".join(out(capsys, "inspect", file, *to).split())
    report = json.loads(out(capsys, "inspect", file, "--json"))
    assert any("NOT used" in line for line in report["notes"])
    assert main(["fk", "--urdf", file, "0,0,0,0,0,0,0"]) == 0
    assert "joint 'joint_7' is continuous" in " ".join(capsys.readouterr().err.split())
    used = out(capsys, "inspect", file, "--continuous-limits", "use", *to)
    assert "57.30" in used and "used all the same" in " ".join(used.split())


def test_inspect_lists_near_chains_with_their_residual(capsys: Capture, tmp_path: Path) -> None:
    text = Path(near_urdf(tmp_path)).read_text()
    links = text[text.index("<link") : text.index("</robot>")]
    names = {part.split('"')[0] for part in links.split('name="')[1:]}
    for name in names:
        links = links.replace(f'"{name}"', f'"{name}_b"')
    (tmp_path / "two.urdf").write_text(text.replace("</robot>", links + "</robot>"))
    assert main(["inspect", str(tmp_path / "two.urdf")]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--base base --tip tip near S-R-S: off by 12 mm, 0 deg; nearest arm within" in said


def test_inspect_shows_signs_zeros_and_frames(capsys: Capture, tmp_path: Path) -> None:
    made = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1, lower=[-3.0] * 7, upper=[2.5] * 7)
    tool = np.eye(4)
    tool[:3, 3] = 0.01, 0.0, 0.2
    made = made.with_(signs=[1, 1, -1, 1, 1, 1, 1], offsets=[0, 0, 0, 0, np.pi / 4, 0, 0], tool=tool)
    (tmp_path / "arm.urdf").write_text(made.to_urdf())
    assert main(["inspect", str(tmp_path / "arm.urdf")]) == 0
    text = capsys.readouterr().out
    arm = aa.Arm.from_urdf(tmp_path / "arm.urdf")
    assert "reach mm, shoulder to wrist: 800" in text and str(arm.import_report).splitlines()[2] in text
    assert "base x,y,z,qw,qx,qy,qz: identity" in text and "tool x,y,z,qw,qx,qy,qz: 0.01,0,0,1,0,0,0" in text
    heads, *rows = text.split("joint  name")[1].splitlines()[:8]
    assert " ".join(heads.split()) == "lower deg upper deg sign zero deg"
    assert [row.split()[-2:] for row in rows] == [
        [f"{sign:+d}", f"{np.degrees(zero):.2f}"] for sign, zero in zip(arm.signs, arm.offsets, strict=True)
    ]
    assert "45.00" in text and "-1 " in text


def test_an_mjcf_is_read_as_a_urdf_is(
    capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    z, y, back = "0 0 1", "0 1 0", "0 -1 0"
    bodies = "".join(
        f'<body name="l{i}" pos="0 0 {up}"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        f'<joint name="q{i}" axis="{axis}" range="-2 2" limited="true"/>'
        for i, (up, axis) in enumerate([(0.3, z), (0, y), (0, z), (0.4, back), (0.4, z), (0, y), (0, z)])
    )
    (tmp_path / "arm.xml").write_text(
        f'<!-- made --><mujoco model="made"><compiler angle="radian"/><worldbody>{bodies}{"</body>" * 7}'
        "</worldbody></mujoco>"
    )
    file = str(tmp_path / "arm.xml")
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "mujoco", None)
        for words in (("inspect", file), ("fk", "--urdf", file, "0,0,0,0,0,0,0")):
            assert main(words) == 2
            said = " ".join(capsys.readouterr().err.split())
            assert "pip install 'armangle[mujoco]' (from a clone: pip install '.[mujoco]')" in said
    need("mujoco")
    assert main(["inspect", file]) == 0
    text = capsys.readouterr().out
    assert "made: S-R-S" in text and " world to l6" in " ".join(text.split())
    assert "d_bs 300, d_se 400, d_ew 400" in text
    assert "l6" in json.loads(out(capsys, "inspect", file, "--tip", "l6", "--json"))["tip"]
    found = json.loads(out(capsys, "fk", "--urdf", file, "--tip", "l6", "10,20,30,40,50,60,70", "--json"))
    arm = aa.Arm.from_mjcf(file)
    assert found["matrix"] == arm.forward(np.radians([10, 20, 30, 40, 50, 60, 70]))[0].tolist()


def test_outcomes_are_names_in_json(capsys: Capture) -> None:
    facts = json.loads(out(capsys, "ik", *ROBOT, "--pose", FAR, "--explain", "--json", status=1))
    assert {branch["status"] for branch in facts["branches"]} == {"UNREACHABLE"}
    assert all(branch["verdict"] == "UNREACHABLE" for branch in facts["branches"])


def test_nothing_in_nothing_out(capsys: Capture, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("x,y,z,qw,qx,qy,qz\n")
    (tmp_path / "q.csv").write_text("q1,q2,q3,q4,q5,q6,q7\n")
    poses, to = str(tmp_path / "p.csv"), str(tmp_path / "out.csv")
    out(capsys, "follow", poses, *ROBOT, "--start", "0,20,0,-60,0,60,0", "-o", to)
    assert aa.load_joints(to).q.shape == (0, 7)
    out(capsys, "ik", *ROBOT, "--pose", poses, "--psi", "0", "--gc", "0", "-o", to)
    assert aa.load_joints(to).q.shape == (0, 7)
    out(capsys, "fk", *ROBOT, str(tmp_path / "q.csv"), "-o", to)
    assert aa.load_poses(to).shape == (0, 4, 4)


def test_an_arm_without_limits(capsys: Capture, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1).to_urdf())
    words = ("--urdf", str(tmp_path / "arm.urdf"), "--pose", "0.3,0,0.6,1,0,0,0", "--gc", "0")
    assert out(capsys, "ik", *words, "--psi", "20").count("none") == 21
    assert json.loads(out(capsys, "ik", *words, "--psi", "20", "--json"))["margin"] == "inf"
    assert "full circle" in out(capsys, "arcs", *words)


@pytest.mark.parametrize(
    ("q", "words"),
    [
        ("0,0,0,180,0,0,0", "The wrist lies on the shoulder: the arm angle is not defined there."),
        ("0,30,0,0,0,30,0", "The elbow is stretched or folded to within the singularity margin."),
    ],
)
def test_arcs_say_why_there_are_none(capsys: Capture, q: str, words: str) -> None:
    assert main(["arcs", *ROBOT, "--q", q, "--singularity-margin", "5"]) == 1
    assert words in " ".join(capsys.readouterr().err.split())


def test_a_folded_arm_has_no_arm_angle(capsys: Capture) -> None:
    text = out(capsys, "fk", *ROBOT, "0", "0", "0", "180", "0", "0", "0", status=1)
    assert "not defined: the wrist lies on the shoulder" in text and "-0.000000" not in text
    assert json.loads(out(capsys, "fk", *ROBOT, "0,0,0,180,0,0,0", "--json", status=1))["psi"] is None


def test_plan(capsys: Capture, line: Path, tmp_path: Path) -> None:
    to = tmp_path / "planned.csv"
    facts = json.loads(out(capsys, "plan", str(line), *ROBOT, "--start", Q, "-o", str(to), "--json"))
    path = aa.plan(aa.Arm.from_catalogue(ROBOT[1]), aa.load_poses(line), start=np.radians(START_DEG))
    assert facts["certified"] is path.certified is True
    assert facts["gc"] == path.gc[0]
    np.testing.assert_array_equal(aa.load_joints(to).q, path.q)
    assert "proven between" in out(capsys, "plan", str(line), *ROBOT)


def test_plan_writes_as_many_rows_as_asked(capsys: Capture, line: Path, tmp_path: Path) -> None:
    to, arm = tmp_path / "planned.npz", aa.Arm.from_catalogue(ROBOT[1])
    out(capsys, "plan", str(line), *ROBOT, "--samples", "57", "-o", str(to))
    assert np.array_equal(aa.load_joints(to).q, aa.plan(arm, aa.load_poses(line), samples=57).q)
    assert main(["plan", str(line), *ROBOT, "--samples", "1"]) == 2
    assert "samples is 1, wanted an integer from 2 to 10000000" in capsys.readouterr().err


def test_plan_puts_rows_between_and_rounds_corners(capsys: Capture, line: Path, tmp_path: Path) -> None:
    to, arm = tmp_path / "planned.npz", aa.Arm.from_catalogue(ROBOT[1])
    poses = aa.load_poses(line)[::10]
    poses[-1, :3, 3] += (0.0, 0.05, 0.0)
    few = tmp_path / "few.csv"
    aa.save(poses, few)
    out(capsys, "plan", str(few), *ROBOT, "--step", "2", "-o", str(to))
    found = aa.load_joints(to).q
    assert np.abs(np.diff(found, axis=0)).max() <= np.radians(2) + 1e-12 and len(found) > len(poses)
    assert np.array_equal(found, aa.plan(arm, aa.load_poses(few)).finer(np.radians(2)).q)
    text = out(capsys, "plan", str(few), *ROBOT, "--blend", "8", "-o", str(to))
    assert "Corners are rounded by at most" in " ".join(text.split())
    assert np.array_equal(aa.load_joints(to).q, aa.plan(arm, aa.load_poses(few), blend=0.008).q)
    assert main(["plan", str(few), *ROBOT, "--step", "0"]) == 2
    assert "wanted more than 0" in " ".join(capsys.readouterr().err.split())
    assert main(["plan", str(few), *ROBOT, "--step", "1e-9"]) == 2
    assert "--step is 1e-09 deg, wanted at least 6e-05 deg" in " ".join(capsys.readouterr().err.split())


def test_plan_says_when_rows_lie_far_apart(capsys: Capture, tmp_path: Path) -> None:
    """Joints that go straight over tens of degrees take the tool off a line between."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    first = np.asarray(arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0])
    last = first.copy()
    last[1, 3] -= 0.4
    aa.save(np.stack([first, last]), tmp_path / "two.csv")
    asked = ["plan", str(tmp_path / "two.csv"), "--robot", "kuka_iiwa7_r800"]
    assert main(asked) == 0
    said = capsys.readouterr()
    assert "largest joint step" in said.out
    assert "--step 1 adds rows" in " ".join(said.err.split())
    assert main([*asked, "--step", "1"]) == 0
    assert "adds rows" not in capsys.readouterr().err


def test_plan_with_a_wish(capsys: Capture, line: Path, tmp_path: Path) -> None:
    to, arm = tmp_path / "planned.npz", aa.Arm.from_catalogue(ROBOT[1])
    for words, wish in (
        (["--psi", "40"], np.radians(40)),
        (["--direction", "up"], aa.Towards(direction="up")),
    ):
        out(capsys, "plan", str(line), *ROBOT, *words, "-o", str(to))
        assert np.array_equal(aa.load_joints(to).q, aa.plan(arm, aa.load_poses(line), psi=wish).q)
    assert main(["plan", str(line), *ROBOT, "--psi", "40", "--direction", "up"]) == 2


def test_plan_counts_with_the_accelerations_given(capsys: Capture, line: Path, tmp_path: Path) -> None:
    to, arm = tmp_path / "planned.npz", aa.Arm.from_catalogue(ROBOT[1])
    words = ["plan", str(line), *ROBOT, "--duration", "100"]
    out(capsys, *words, "--acceleration", "300", "-o", str(to))
    asked = aa.Objective(duration=100.0, acceleration=np.radians(300))
    assert np.array_equal(aa.load_joints(to).q, aa.plan(arm, aa.load_poses(line), objective=asked).q)
    assert main(words) == 0
    assert "the arm states no accelerations" in capsys.readouterr().err
    assert main(["plan", str(line), *ROBOT, "--acceleration", "300"]) == 2
    assert "--acceleration is of --duration" in capsys.readouterr().err
    assert main([*words, "--acceleration", "0"]) == 2


def test_plan_says_why_there_is_no_way(capsys: Capture, line: Path, tmp_path: Path) -> None:
    poses = aa.load_poses(line).copy()
    poses[-1, 0, 3] += 3.0
    far = tmp_path / "far.csv"
    aa.save(poses, far)
    assert main(["plan", str(far), *ROBOT, "--limit-margin", "1"]) == 1
    assert "out of reach" in capsys.readouterr().err.replace("\n", " ")


def test_ik_explain(capsys: Capture) -> None:
    far = "2,0,0,1,0,0,0"
    assert main(["ik", *ROBOT, "--pose", far, "--explain"]) == 1
    assert "out of reach, by up to 1254 mm" in capsys.readouterr().out
    assert main(["ik", *ROBOT, "--pose", far, "--explain", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["branches"][7]["gc"] == 7
    assert main(["ik", *ROBOT, "--pose", far, "--explain", "--psi", "3"]) == 2


def test_ik_explain_names_the_nearest_pose_within_the_limits(capsys: Capture) -> None:
    near = "0.2,0,0.4,1,0,0,0"
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    found = arm.solve(aa.pose([0.2, 0, 0.4]), outside="nearest")
    assert not found.ok
    assert main(["ik", *ROBOT, "--pose", near, "--explain"]) == 1
    assert "The nearest pose within the limits" in capsys.readouterr().out
    assert main(["ik", *ROBOT, "--pose", near, "--explain", "--json"]) == 1
    facts = json.loads(capsys.readouterr().out)["instead"]
    assert facts["q"] == found.q.tolist() and facts["gap"] == found.gap
    assert facts["status"] == found.status.name and facts["pose"] == found.pose.tolist()
    assert main(["ik", *ROBOT, "--pose", "0.5,0,0.4,0,0,1,0", "--explain", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["instead"] is None


@pytest.mark.slow
def test_a_chain_that_is_nearly_srs_is_kept_where_asked(capsys: Capture, tmp_path: Path) -> None:
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    half = np.pi / 2
    alpha = [-half, half + 1e-3, half, -half, -half, half, 0.0]
    d = [0.34, 0.0005, 0.4, 0.0, 0.4, 0.0, 0.126]
    mine = arm.with_(chain=aa.dh_chain(np.column_stack([np.zeros(7), alpha, d, np.zeros(7)])))
    file = tmp_path / "mine.urdf"
    file.write_text(mine.to_urdf())
    q = np.radians([10, 20, 30, 40, 50, 60, 70])
    told = json.loads(out(capsys, "fk", "--urdf", str(file), "--inexact", "10,20,30,40,50,60,70", "--json"))
    at = told["pose"]
    assert np.abs(np.array(at[:3]) - mine.forward(q)[0][:3, 3]).max() <= 1e-12
    assert main(["fk", "--urdf", str(file), "10,20,30,40,50,60,70"]) == 2
    assert "but near it" in capsys.readouterr().err
    assert main(["fk", "--robot", "kuka_iiwa7_r800", "--inexact", "10,20,30,40,50,60,70"]) == 2
    assert "--inexact goes with --urdf" in capsys.readouterr().err


def test_what_is_not_made_for_a_chain_names_a_way_of_the_command_line(
    capsys: Capture, tmp_path: Path
) -> None:
    file = tmp_path / "calibrated.urdf"
    file.write_text(calibrated("kuka_iiwa7_r800", 1.0, 1.0).to_urdf())
    words = ("ik", "--urdf", str(file), "--pose", POSE, "--explain")
    assert main([*words, "--inexact"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--length-tolerance and --angle-tolerance in place of --inexact" in said and "arm." not in said
    assert main([*words, "--length-tolerance", "5", "--angle-tolerance", "1"]) == 0
    assert "not quite the arm of its file" in capsys.readouterr().err
    stated = aa.Arm.from_catalogue(ROBOT[1]).to_urdf().replace('type="revolute"', 'type="continuous"')
    file.write_text(stated)
    assert main(["fk", "--urdf", str(file), Q]) == 0
    assert "on the command line --continuous-limits use" in " ".join(capsys.readouterr().err.split())
    assert main(["fk", "--urdf", str(file), Q, "--continuous-limits", "use"]) == 0
    assert capsys.readouterr().err == ""


def test_a_tool_is_mounted_on_the_tip(capsys: Capture) -> None:
    for name, arm in (
        (ROBOT[1], aa.Arm.from_catalogue(ROBOT[1])),
        ("franka_fr3", aa.OffsetArm.from_catalogue("franka_fr3")),
    ):
        q = "10,20,30,-60,20,60,5"
        for words, tool in (
            ("0.1,-0.02,0.3", aa.pose([0.1, -0.02, 0.3])),
            ("-0.1,0,0.2,0.6,0.8,0,0", aa.pose([-0.1, 0, 0.2], wxyz=[0.6, 0.8, 0, 0])),
        ):
            told = json.loads(out(capsys, "fk", "--robot", name, q, "--tool", words, "--json"))
            there = arm.with_tool(tool).forward(np.radians(list(map(float, q.split(",")))))[0]
            row = told["pose"]
            assert np.allclose(aa.pose(row[:3], wxyz=row[3:]), there, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("0,0", "--tool has 2 numbers, wanted x,y,z or x,y,z,qw,qx,qy,qz"),
        ("0,0,150", "--tool is 0,0,150, a place in m: was this in mm?"),
        ("0,0,0.1,0,0,0,2", "--tool: the quaternion has length 2"),
        ("a,b,c", "--tool: 'a' is not a number"),
    ],
)
def test_a_tool_that_is_none_is_refused(capsys: Capture, words: str, why: str) -> None:
    assert main(["fk", *ROBOT, Q, "--tool", words]) == 2
    assert why in " ".join(capsys.readouterr().err.split())
