"""``armangle plan``: a planned path, and one of --policy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.moves import begun

import armangle as aa

from .conftest import START, Cli

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
FR3 = aa.Arm.from_catalogue("franka_fr3")
Rows = np.ndarray[Any, Any]

PLANS = {
    "": {},
    "--start {Q}": {"start": START},
    "--samples 57": {"samples": 57},
    "--psi 40": {"psi": np.radians(40)},
    "--psi up": {"psi": aa.Towards(direction="up")},
    "--psi direction:0,-1,0": {"psi": aa.Towards(direction=[0.0, -1.0, 0.0])},
    "--psi point:0.1,0.2,0.3": {"psi": aa.Towards(point=[0.1, 0.2, 0.3])},
    "--blend 8": {"blend": 0.008},
    "--gc 3 --limit-margin 1": {"gc": 3, "limit_margin": np.radians(1.0)},
    "--duration 100 --acceleration 300": {
        "objective": aa.Objective(duration=100.0, acceleration=np.radians(300))},
}  # fmt: skip


@pytest.mark.parametrize("words", PLANS)
def test_what_is_written_is_the_plan_of_python(words: str, line: Rows, cli: Cli) -> None:
    """`armangle plan` writes the joints of `plan` with the same options."""
    ran = cli(f"plan line.csv {{R}} -o q.npz --json {words}")
    path = aa.plan(ARM, line, **PLANS[words])
    assert ran.status == 0 and ran.facts["certified"] is path.certified is True
    np.testing.assert_array_equal(aa.io.load_joints("q.npz").q, path.q)


def test_rows_are_added_until_no_joint_moves_more(line: Rows, cli: Cli) -> None:
    """`armangle plan --step` writes the rows of `JointPath.finer`."""
    first, last = line[0], line[0].copy()
    last[1, 3] -= 0.2
    aa.io.save(np.stack([first, last]), "two.csv")
    ran = cli("plan two.csv {R}")
    assert "largest joint step" in ran.out and "--step 1 adds rows" in ran.text
    ran = cli("plan two.csv {R} --step 2 -o q.npz")
    assert "adds rows" not in ran.text
    found = aa.io.load_joints("q.npz").q
    assert np.abs(np.diff(found, axis=0)).max() <= np.radians(2) + 1e-12 and len(found) > 2
    assert np.array_equal(found, aa.plan(ARM, np.stack([first, last])).finer(np.radians(2)).q)


POLICIES: dict[str, tuple[aa.Policy, dict[str, Any]]] = {
    "repulsion": (aa.Repulsion(), {}),
    "repulsion,alpha=50,K=0.05": (aa.Repulsion(K=0.05, alpha=50.0), {}),
    "repulsion,rate=1,dt=0.01": (aa.Repulsion(rate=1.0), {"dt": 0.01}),
    "repulsion,outside=stop,carry=elbow": (aa.Repulsion(outside="stop"), {"carry": "elbow"}),
    "hold": (aa.Hold(), {}),
    "centre,K=0.01": (aa.Centre(K=0.01), {}),
    "towards,K=0.05 --psi 90": (aa.Towards(psi=np.pi / 2, K=0.05), {}),
    "towards --psi up": (aa.Towards(direction="up"), {}),
    "towards,rate=2,dt=0.01 --psi direction:0,-1,0": (
        aa.Towards(direction=[0.0, -1, 0], rate=2.0),
        {"dt": 0.01},
    ),
    "towards --psi point:0.1,0.2,0.3": (aa.Towards(point=[0.1, 0.2, 0.3]), {}),
}


@pytest.mark.parametrize("words", POLICIES)
def test_a_policy_steps_as_follow_does(words: str, line: Rows, cli: Cli) -> None:
    """`armangle plan --policy` writes exactly the joints of `follow`, and reports the policy."""
    policy, options = POLICIES[words]
    ran = cli(f"plan line.csv {{R}} --start {{Q}} -o q.npz --json --policy {words}")
    path = aa.follow(ARM, line, start=START, policy=policy, **options)
    assert ran.facts["policy"] == repr(policy) and ran.facts["status"] == {"OK": 21}
    np.testing.assert_array_equal(aa.io.load_joints("q.npz").q, path.q)


def test_an_arm_with_an_offset_is_stepped_alike(cli: Cli) -> None:
    """`armangle plan`, `retime` and `track` of an offset arm give what the functions of Python give."""
    start = np.radians([10, 20, 10, -110, 15, 110, 30])
    poses = np.repeat(FR3.forward(start)[0][None], 41, axis=0)
    poses[:, 1, 3] += np.linspace(0.0, 0.1, 41)
    aa.io.save(poses, "line.csv")
    ran = cli("plan line.csv {FR3} --start {QF} --policy hold -o q.csv")
    assert ran.status == 0 and "joint 7 first 30.0000 deg" in ran.text
    path = aa.follow(FR3, poses, start=start, policy=aa.Hold())
    np.testing.assert_allclose(aa.io.load_joints("q.csv").q, path.q, rtol=0, atol=1e-9)
    ran = cli("plan line.csv {FR3} --start {QF} -o planned.npz --json")
    planned = aa.plan(FR3, poses, start=start)
    assert ran.facts["certified"] is planned.certified is True and ran.facts["redundancy"] == "joint_7"
    np.testing.assert_allclose(aa.io.load_joints("planned.npz").q, planned.q, rtol=0, atol=1e-9)
    hurried = cli("plan line.csv {FR3} --start {QF} --duration 100 --acceleration 200 --json").facts
    assert hurried["certified"] is True
    found = cli("retime q.csv {FR3} --acceleration 200 --json").facts["duration"]
    assert found == pytest.approx(aa.retime(path, acceleration=np.radians(200)).duration, rel=1e-3)
    facts = cli("track line.csv {FR3} --rate 50 --start {QF} --json").facts
    tracker = begun(start, FR3, 1 / 50)
    assert facts["distance"]["max"] == pytest.approx(max(tracker.step(pose).distance for pose in poses))
    first = cli("track line.csv {FR3} --rate 50 --json").facts["start"]
    np.testing.assert_allclose(first, FR3.solve(poses[0]).q, rtol=0, atol=1e-9)


def test_where_there_is_no_way_the_reason_is_said(line: Rows, cli: Cli) -> None:
    """`armangle plan` names the first row that is not solved and why; one and no pose are fine."""
    ran = cli("plan line.csv {R} --start {Q} --policy repulsion --step 0.01 -o q.csv --json")
    assert ran.status == 1 and ran.facts["status"] == {"OK": 1, "JOINT_JUMP": 1, "NOT_REACHED": 19}
    assert "pose 1 (s = 0.05) is the first that is not." in ran.text
    assert aa.io.load_joints("q.csv").status[1] == aa.Status.JOINT_JUMP
    line[-1, 0, 3] += 3.0
    aa.io.save(line, "far.csv")
    for words in ("", "--start {Q} --policy hold,on_fail=skip"):
        ran = cli(f"plan far.csv {{R}} {words}")
        assert ran.status == 1 and "out of reach" in ran.text
    aa.io.save(line[:1], "one.csv")
    ran = cli("plan one.csv {R} --start {Q} --policy hold")
    assert "1 pose" in ran.text and "The one pose is solved within all limits." in ran.text
    Path("none.csv").write_text("x,y,z,qw,qx,qy,qz\n")
    assert cli("plan none.csv {R} --start {Q} --policy hold -o none.npz").status == 0
    assert aa.io.load_joints("none.npz").q.shape == (0, 7)
    assert "the arm states no accelerations" in cli("plan line.csv {R} --duration 100").err
