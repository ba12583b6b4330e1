"""``armangle ik``: solutions, feasible intervals, reasons; and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.calibrated import calibrated

import armangle as aa
from armangle.poses import rows_from_poses

from .conftest import NAMES, START, Cli

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
FR3 = aa.Arm.from_catalogue("franka_fr3")
Rows = np.ndarray

SAID = {
    "ik {R} {POSE} --seed {Q}": (0, "psi 58.5", "gc 3", "nearest to --seed: 0.00 deg from it (root of"),
    "ik {R} {POSE}": (0, "nearest to the middle of the joint ranges:"),
    "ik {R} {POSE} --seed 0,0,0,0,0,0,0 --metric max": (0, "nearest to --seed: no joint is further than"),
    "ik {R} {POSE} --psi 58.5882 --all": (0, "outside its limits, all in degrees"),
    "ik {R} {POSE} --psi 30 --gc 3": (1, "psi 30.00 deg is not feasible: joint 5 is 5.7", "lower limit"),
    "ik {R} {FAR}": (1, "out of reach by 1253.57 mm"),
    "ik {R} {FAR} --all": (1, "out of reach by 1253.57 mm"),
    "ik {R} {FAR} --json": (1, "out of reach by 1253.57 mm"),
    "ik {R} {FAR} --psi 0 --gc 0": (1, "out of reach by 1253.57 mm"),
    "ik {R} {FAR} --psi 0 --all": (1, "out of reach by 1253.57 mm"),
    "ik {R} {FAR} --explain": (1, "out of reach, by up to 1254 mm"),
    "ik {R} --pose 500,0,400,1,0,0,0": (2, "armangle: pose lies 640.312 m away"),
    "ik {R} --pose 500,0,400,1,0,0,0 --psi 10 --gc 0": (2, "armangle: pose lies 640.312 m away"),
    "ik {R} --pose 0.2,0,0.4,1,0,0,0 --explain": (1, "The nearest pose within the limits"),
    "ik {R} --intervals {FAR} --gc 2": (1, "no feasible arm angle. pose is out of reach by 1253.57 mm"),
    "ik {R} --intervals --joints {Q}": (0, "joint 1 lower -170.0", "322.0673", "gc 3: shoulder -"),
    "ik {R} --intervals joints --joints {Q}": (0, "3 q7", "full circle"),
    "ik {R} --intervals 5 --joints {Q} --gc 0": (0, "joint 5 upper"),
    "ik {R} --intervals --joints 0,0,0,180,0,0,0 --singularity-margin 5": (1, "wrist lies on the shoulder"),
    "ik {R} --intervals --joints 0,30,0,0,0,30,0 --singularity-margin 5": (1, "elbow", "singularity margin"),
    "ik {FR3} {PF} --seed {QF}": (0, "joint 7"),
    "ik {FR3} {PF} --intervals": (0, "joint 7 0", "joint 2 lower -102.2"),
    "ik {FR3} {FAR}": (1, "out of reach"),
    "ik {R} --kuka 9000,0,500,0,180,0,10,2": (1, "out of reach"),
}


@pytest.mark.parametrize("words", SAID)
def test_what_is_said(words: str, cli: Cli) -> None:
    """`armangle ik` ends with these exit statuses and prints these parts."""
    status, *parts = SAID[words]
    ran = cli(words)
    assert ran.status == status
    for part in parts:
        assert part in ran.text
    assert "None" not in ran.out


@pytest.mark.parametrize("metric", ["l2", "max"])
def test_the_nearest_solution_is_solve(metric: str, cli: Cli) -> None:
    """`armangle ik --seed` gives the solution of `Arm.solve`, and --all a list from the nearest on."""
    seed = np.radians([10.0, 30, -20, -80, 5, 40, 0])
    words = f"ik {{R}} {{POSE}} --seed 10,30,-20,-80,5,40,0 --metric {metric} --json"
    shown, every = cli(words).facts, cli(f"{words} --all").facts
    row = [float(x) for x in NAMES["POSE"].split()[1].split(",")]
    pose = aa.pose(row[:3], wxyz=row[3:])
    found = ARM.solve(pose, seed, metric=metric)  # type: ignore[arg-type]  # one of the two
    assert shown["q"] == pytest.approx(found.q, abs=1e-6) and shown["gc"] == found.gc
    assert shown["distance"] == pytest.approx(found.distance, abs=1e-6) and shown["metric"] == metric
    assert shown["seed"] == pytest.approx(seed) and shown["status"] == "OK"
    assert every["q"][0] == pytest.approx(shown["q"]) and every["distance"] == sorted(every["distance"])
    assert cli("ik {R} {POSE} --gc 5 --json").facts["gc"] == 5


def test_the_nearest_reachable_pose(cli: Cli) -> None:
    """`--fallback nearest_pose` and `--explain` give the solution of `Arm.solve(fallback=)`."""
    words = "ik {R} --pose 1.2,0,0.5,1,0,0,0 --fallback nearest_pose"
    ran, facts = cli(words), cli(f"{words} --json").facts
    found = ARM.solve(aa.pose([1.2, 0.0, 0.5]), facts["seed"], fallback="nearest_pose")
    assert ran.status == 1 and "out of reach" in ran.err  # the pose itself has no solution
    assert facts["q"] == found.q.tolist() and facts["gap"] == found.gap > 0.1
    assert f"{1e3 * found.gap:.4g} mm from the one asked" in ran.text
    instead = cli("ik {R} --pose 0.2,0,0.4,1,0,0,0 --explain --json").facts["instead"]
    best = ARM.solve(aa.pose([0.2, 0, 0.4]), fallback="nearest_pose")
    assert instead["q"] == best.q.tolist() and instead["status"] == best.status.name
    assert cli("ik {R} --pose 0.5,0,0.4,0,0,1,0 --explain --json").facts["instead"] is None
    told = cli("ik {R} {FAR} --explain --json").facts["branches"]
    assert {branch["status"] for branch in told} == {branch["verdict"] for branch in told} == {"UNREACHABLE"}


@pytest.mark.parametrize("source", ["{FR3}", "--robot fr3.urdf"])
def test_an_arm_with_an_offset_is_asked_alike(source: str, cli: Cli) -> None:
    """`armangle ik` of an offset arm, by name or file, solves, repeats by psi and has intervals."""
    Path("fr3.urdf").write_text(FR3.to_urdf())
    found = cli(f"ik {source} {{PF}} --seed {{QF}} --json").facts
    assert found["redundancy"] == "joint_7" and found["status"] == "OK"
    pose = FR3.forward(found["q"])[0]
    np.testing.assert_allclose(pose[:3, 3], [0.4, 0.1, 0.5], atol=1e-9)
    best = FR3.solve(pose, np.radians([10, 20, 10, -110, 15, 110, 30]))
    assert found["distance"] == pytest.approx(best.distance, abs=1e-9)
    psi = f"--psi {np.degrees(found['psi']):.15g} --gc {found['gc']}"
    again = cli(f"ik {source} {{PF}} --seed {{QF}} {psi} --json").facts
    assert again["q"] == pytest.approx(found["q"], abs=1e-9)
    intervals = cli(f"ik {source} {{PF}} --intervals --gc {found['gc']} --json").facts[0]["intervals"]
    assert any(low <= found["psi"] <= high for low, high in intervals)


def test_a_file_of_poses(line: Rows, cli: Cli) -> None:
    """`armangle ik` of a pose file writes all solutions, and counts and names those that fail."""
    ran = cli("ik {R} --pose line.csv --seed {Q} -o q.csv")
    assert ran.out.startswith("nearest to --seed") and ran.out.count("OK") == 20  # and one row is the gap
    back = aa.io.load_joints("q.csv")
    assert np.abs(back.q - ARM.solve(line, seed=START).q).max() < 1e-6 and (back.status == aa.Status.OK).all()
    assert len(cli("ik {R} --pose line.csv --psi 90 --gc 3 -o q.csv").out.splitlines()) == 22
    assert np.allclose(aa.io.load_joints("q.csv").psi, np.pi / 2)
    ran = cli("ik {R} --pose line.csv --psi 35 --gc 3 -o q.csv")
    assert ran.status == 1 and "21 of 21 poses fail; pose 0: psi 35.00 deg is not feasible: joint" in ran.text
    assert (aa.io.load_joints("q.csv").status == aa.Status.OUTSIDE).all()
    line[4, 0, 3] += 3
    aa.io.save(line, "far.csv")
    assert "1 of 21 poses fail; pose 4: pose is out of reach" in cli("ik {R} --pose far.csv").text
    aa.io.save(line[4:5], "one.csv")
    assert cli("ik {R} --pose one.csv --psi 0 --gc 0").err.startswith("armangle: pose is out of reach")


def test_intervals_are_feasible(cli: Cli) -> None:
    """`armangle ik --intervals` gives golden intervals with the joints at their ends."""
    (facts,) = cli("ik {R} --intervals --joints {Q} --json").facts
    assert np.degrees(facts["intervals"]) == pytest.approx(
        np.array([[-22.82, 24.88], [42.70, 322.07]]), abs=5e-3
    )
    assert facts["ends"][0][0] == {"joint": 1, "side": "lower", "value": pytest.approx(np.radians(-170))}
    assert [fact["gc"] for fact in cli("ik {R} --intervals {POSE} --json").facts] == [*range(8)]
    kept = [cli(f"ik {{R}} --intervals --joints 0,10,0,-60,0,50,0 --json {more}").facts[0]["intervals"]
            for more in ("", "--singularity-margin 30")]  # fmt: skip
    assert np.diff(kept[1]).sum() < np.diff(kept[0]).sum()
    for more in ("", "--gc 2", "--intervals joints"):  # the reason alone, once
        ran = cli(f"ik {{R}} {{FAR}} --intervals {more.removeprefix('--intervals')}")
        assert ran.status == 1 and ran.out == ""


def test_what_is_not_proven_is_said(cli: Cli) -> None:
    """`armangle ik` of a calibrated arm says what is not proven."""
    Path("own.urdf").write_text(calibrated("kuka_iiwa7_r800", 2.0, 5.0).to_urdf())
    arm = aa.Arm.from_urdf("own.urdf")
    q = START.copy()
    q[5] = np.radians(0.05)  # axes 5 and 7 are nearly one: branches meet
    at = ",".join(map(str, np.degrees(q)))
    pose, _, gc = arm.forward(q)
    arcs = arm.feasible(pose, gc)
    ran = cli(f"ik --robot own.urdf --intervals --joints {at}")
    assert "not proven beyond" in ran.out and f"{np.degrees(arcs.unproven):.2f} deg of gc {gc}" in ran.text
    assert "own chain is kept" in ran.err
    (facts,) = cli(f"ik --robot own.urdf --intervals --joints {at} --json").facts
    assert facts["unproven"] == pytest.approx(float(arcs.unproven))
    each = cli(f"ik --robot own.urdf --intervals joints --joints {at} --json").facts
    assert [one["unproven"] for one in each] == arm.feasible(pose, gc, per_joint=True).unproven.tolist()
    row = ",".join(f"{v:.17g}" for v in rows_from_poses(pose[None])[0])
    seed = ",".join(map(str, np.degrees(q) + 0.5))
    words = f"ik --robot own.urdf --pose {row} --seed {seed}"
    assert "not proven that no solution is nearer" in cli(words).text
    assert cli(f"{words} --all --json").facts["unproven"] == pytest.approx(
        arm.feasible(pose).unproven.tolist()
    )
    aa.io.save(arm.forward(np.array([q, START]))[0], "two.csv")
    assert "UNPROVEN, 1 pose:" in cli(f"ik --robot own.urdf --pose two.csv --seed {seed}").text


def test_a_branch_without_a_proven_solution_leaves_the_others(cli: Cli) -> None:
    """Of a calibrated arm, nearly stretched, `armangle ik --psi --all` gives the other gc and says which
    branches meet; `--gc` of such a branch exits with 1 and says the same.
    """
    Path("own.urdf").write_text(calibrated("kuka_iiwa7_r800", 2.0, 5.0).to_urdf())
    arm = aa.Arm.from_urdf("own.urdf")
    q = START.copy()
    q[3] = np.radians(-0.5)  # nearly stretched
    pose, psi, _ = arm.forward(q)
    rows = arm.inverse(pose, psi, on_error="nan", limits=False)
    lost = np.flatnonzero(np.isnan(rows).any(axis=1))
    assert 0 < len(lost) < 8
    row = ",".join(f"{v:.17g}" for v in rows_from_poses(pose[None])[0])
    words = f"ik --robot own.urdf --pose {row} --psi {np.degrees(psi):.15g}"
    ran = cli(f"{words} --all")
    assert f"gc {', '.join(map(str, lost))}: Branches meet here" in ran.text
    np.testing.assert_allclose(np.array(cli(f"{words} --all --json").facts["q"], float), rows, atol=1e-6)
    ran = cli(f"{words} --gc {lost[0]}")
    assert ran.status == 1 and "Branches meet here" in ran.text and "unreachable" not in ran.text


def test_an_arm_without_limits(cli: Cli) -> None:
    """`armangle ik` of an arm without limits says none, inf and full circle."""
    Path("arm.urdf").write_text(aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1).to_urdf())
    words = "ik --robot arm.urdf --pose 0.3,0,0.6,1,0,0,0 --gc 0"
    assert cli(f"{words} --psi 20").out.count("none") == 21
    assert cli(f"{words} --psi 20 --json").facts["margin"] == "inf"
    assert "full circle" in cli(f"{words} --intervals").out


def test_a_kuka_frame_there_and_back(cli: Cli) -> None:
    """`armangle ik --kuka` of the frame that `inspect --kuka` prints gives its joints."""
    q = "41.83,36.92,-6.28,-87.49,5.36,55.51,-57.36"
    shown = cli(f"inspect kuka_iiwa7_r800 --kuka --joints {q}").out
    (row,) = [row for row in shown.splitlines() if row.startswith("KUKA")]
    frame = ",".join(word.rsplit(" ", 1)[-1] for word in row.split(","))
    facts = cli(f"ik {{R}} --kuka {frame} --json").facts
    assert np.allclose(np.degrees(facts["q"]), [float(x) for x in q.split(",")], rtol=0, atol=2e-3)
    assert facts["turn"] == 76
    assert "Status 2, Turn 76" in cli(f"ik {{R}} --kuka {frame.rsplit(',', 1)[0]}").out
    facts = cli(f"inspect kuka_iiwa7_r800 --kuka --json --joints {q}").facts["kuka"]
    wanted = aa.kuka.to_frame(ARM, np.radians([float(x) for x in q.split(",")]))
    assert facts == {"e1": wanted.e1, "status": 2, "turn": 76, "abc": aa.kuka.abc(wanted.pose).tolist()}
