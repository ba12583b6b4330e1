"""``armangle robots`` and ``inspect``: arms, poses of joints, collision models."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.calibrated import calibrated
from support.chain import simple_urdf
from support.needs import need

import armangle as aa
from armangle.models.catalogue import srs_catalogue

from .conftest import START, Cli

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
FR3 = aa.Arm.from_catalogue("franka_fr3")
Q = "10,20,30,-40,50,60,70"
RAD = np.radians([10, 20, 30, -40, 50, 60, 70])
SHAPE = '<collision><geometry><cylinder radius="0.07" length="0.3"/></geometry></collision>'


def with_shape(arm: aa.Arm) -> str:
    """The URDF of an arm with a cylinder at link_3."""
    return arm.to_urdf().replace('<link name="link_3" />', f'<link name="link_3">{SHAPE}</link>')


def twice(text: str) -> str:
    """Return a URDF with a second copy of its chain, its names with _b."""
    root = text[text.index("<link") : text.index("</robot>")]
    for name in {part.split('"')[0] for part in root.split('name="')[1:]}:
        root = root.replace(f'"{name}"', f'"{name}_b"')
    return text.replace("</robot>", root + "</robot>")


def moved(arm: Any, joint: str, tag: str) -> str:
    """The URDF of an arm, the element `tag` (an origin or axis) put in for that of a joint."""
    text = arm.to_urdf()
    at = text.index(f"<{tag.split()[0][1:]}", text.index(f'"{joint}"'))
    return str(text[:at] + tag + text[text.index("/>", at) + 2 :])


def test_robots(cli: Cli) -> None:
    """`armangle robots` lists the catalogue, and finds entries by words of them."""
    listed = cli("robots").out
    assert all(name in listed for name in (*srs_catalogue(), "franka_fr3"))
    facts = cli("robots --json").facts
    assert [entry["name"] for entry in facts] == list(aa.catalogue())
    assert all(entry["reach"] == aa.Arm.from_catalogue(entry["name"]).geometry.reach for entry in facts)
    found = cli("robots Fourier left").out
    assert [name for name in srs_catalogue() if name in found] == list(aa.catalogue("left fourier"))
    assert "franka_fr3" in cli("robots franka").out and "Source:" in cli("robots xarm").out
    assert "Source:" in cli("robots iiwa7").out
    assert "Source: MuJoCo model (ffw_bg2)" in cli("robots robotis_ai_worker_left").text
    facts = cli("robots fetch --json").facts
    assert (facts["name"], facts["a_1"], facts["joint_names"][0]) == ("fetch", 0.117, "shoulder_pan_joint")


# -- the kind of a file ----------------------------------------------------------------------------------

KINDS = {
    "srs": ARM.to_urdf,
    "offset_wrist": FR3.to_urdf,
    "offset_shoulder": lambda: FR3.with_(a_1=0.1, a_6=0.0).to_urdf(),
    "srs_chain": lambda: calibrated("kuka_iiwa7_r800", 1.0, 1.0).to_urdf(),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_of_any_kind_is_read_written_and_asked(kind: str, cli: Cli) -> None:
    """`armangle inspect` of a URDF of each kind names it; what it writes has the same poses."""
    Path("arm.urdf").write_text(KINDS[kind]())
    ran = cli("inspect arm.urdf --json -o again.urdf")
    joint = {"offset_wrist": "joint_7", "offset_shoulder": "joint_1"}.get(kind, "arm_angle")
    assert (ran.facts["kind"], ran.facts["redundancy"]) == (kind, joint) and "wrote again.urdf" in ran.err
    poses = [cli(f"inspect {file} --joints {Q} --json").facts["pose"] for file in ("arm.urdf", "again.urdf")]
    assert poses[0] == pytest.approx(poses[1], abs=1e-12)
    toml = cli("inspect arm.urdf -o arm.toml")
    assert (toml.status == 0) is (kind == "srs") is Path("arm.toml").exists()
    if kind == "srs":
        assert cli(f"inspect arm.toml --joints {Q} --json").facts["pose"] == pytest.approx(poses[0], abs=1e-9)
        assert "lengths mm: d_bs" in toml.out and cli("inspect arm.urdf -o arm.txt").status == 2


def test_a_file_is_fitted_only_where_asked(cli: Cli) -> None:
    """`armangle inspect` keeps a file's own chain unless --fit names another kind within bounds."""
    Path("near.urdf").write_text(KINDS["srs_chain"]())
    Path("bent.urdf").write_text(moved(FR3, "joint_4", '<axis xyz="0 0.001 1"/>'))
    exact = aa.Arm.from_urdf("near.urdf").forward(RAD)[0]
    told = cli(f"inspect near.urdf --joints {Q} --json")
    assert np.allclose(told.facts["matrix"], exact, rtol=0, atol=1e-12) and "own chain is kept" in told.err
    for file, fit, kind in (
        ("near.urdf", "srs", "srs_fitted"), ("near.urdf", "own,20,1", "srs_chain"),
        ("bent.urdf", "own,5,1", "offset_wrist"),
    ):  # fmt: skip
        facts = cli(f"inspect {file} --fit {fit} --json").facts
        assert facts["kind"] == kind and facts["residual_position"] < 0.02
    assert 0.5 < cli("inspect near.urdf --json").facts["proven_share"] <= 1
    assert cli("inspect near.urdf --fit srs -o fitted.urdf").status == 0
    assert cli("inspect fitted.urdf --json").facts["kind"] == "srs"
    assert cli("inspect near.urdf --fit srs,0.1,0.001").status == 1
    for fit in ("exact", "srs,5", "srs,200,1", "srs,-1,1", "srs,5,90"):
        assert cli(f"inspect near.urdf --fit {fit}").status == 2
    facts = cli("inspect bent.urdf --json").facts
    assert facts["kind"] == "offset_wrist_chain" and 0 <= facts["proven_share"] < 1
    assert "offset wrist" in cli("inspect bent.urdf").text and cli("ik --robot bent.urdf {PF}").status == 0
    ran = cli("inspect kuka_iiwa7_r800 --fit srs")
    assert ran.status == 2 and "--fit does not go with kuka_iiwa7_r800" in ran.text
    ran = cli("ik --robot near.urdf {POSE} --explain")
    assert ran.status == 0 and "solved within all limits" in ran.text


def test_a_file_of_no_kind(cli: Cli) -> None:
    """`armangle inspect` of a chain of no kind says why, and `ik` refuses it."""
    Path("bad.urdf").write_text(simple_urdf())
    ran = cli("inspect bad.urdf --json")
    assert ran.status == 1 and ran.facts["kind"] is None and "is not S-R-S" in ran.text
    assert cli(f"inspect bad.urdf --joints {Q}").status == 1
    assert cli("ik --robot bad.urdf {POSE}").status == 2


def test_several_chains_are_listed_with_the_option_that_names_them(cli: Cli) -> None:
    """`armangle inspect` of two chains lists the --links that choose one."""
    Path("two.urdf").write_text(twice(aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1).to_urdf()))
    ran = cli("inspect two.urdf")
    options = [row.split()[:2] for row in ran.err.splitlines() if row.startswith("  --links")]
    assert ran.status == 2 and len(options) == 2
    assert all(cli(f"inspect two.urdf {' '.join(one)}").status == 0 for one in options)
    assert cli(f"inspect two.urdf --links {options[1][1].split(',')[0]},").status == 0
    assert cli("inspect two.urdf --links base").status == 2
    first, rest = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1).to_urdf().split('<joint name="joint_2"', 1)
    rest = re.sub(r'xyz="[^"]*"', 'xyz="0.012 0 0.3"', rest, count=1)
    Path("two.urdf").write_text(twice(f'{first}<joint name="joint_2"{rest}'))
    assert "near S-R-S: off by" in cli("inspect two.urdf").text


def test_numbers_of_the_file_are_shown(cli: Cli) -> None:
    """`armangle inspect` prints reach, base, tool, lengths, signs and offsets."""
    arm = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1, lower=[-3.0] * 7, upper=[2.5] * 7)
    tool = aa.pose([0.01, 0.0, 0.2])
    arm = arm.with_(signs=[1, 1, -1, 1, 1, 1, 1], offsets=[0, 0, 0, 0, np.pi / 4, 0, 0], tool=tool)
    Path("arm.urdf").write_text(arm.to_urdf())
    ran = cli("inspect arm.urdf")
    assert "reach mm, shoulder to wrist: 800" in ran.text and "base x,y,z,qw,qx,qy,qz: identity" in ran.text
    assert "tool x,y,z,qw,qx,qy,qz: 0.01,0,0,1,0,0,0" in ran.text and "\nd_se = 0.4\n" in ran.out
    rows = ran.out.split("joint  name")[1].splitlines()[1:8]
    wanted = [
        [f"{s:+d}", f"{np.degrees(zero):.2f}"]
        for s, zero in zip(arm.geometry.signs, arm.geometry.offsets, strict=True)
    ]
    assert [row.split()[-2:] for row in rows] == wanted


@pytest.mark.parametrize("arm", [ARM, FR3])
def test_limits_of_continuous_joints_are_told_of(arm: Any, cli: Cli) -> None:
    """`armangle inspect` says that limits of continuous joints are not used, and uses them where asked."""
    Path("arm.urdf").write_text(arm.to_urdf().replace('type="revolute"', 'type="continuous"'))
    ran = cli(f"inspect arm.urdf --joints {Q}")
    assert ran.err.count("NOT used") == 7 and "armangle inspect FILE --continuous-limits use" in ran.text
    assert "UserWarning" not in ran.err
    assert any("NOT used" in x for x in cli("inspect arm.urdf --json").facts["notes"])
    assert cli("inspect arm.urdf --continuous-limits use -o used.urdf").status == 0
    facts = cli("inspect used.urdf --json").facts
    assert facts["lower"] == pytest.approx(arm.lower.tolist())
    assert cli("inspect kuka_iiwa7_r800 --continuous-limits use").status == 2


def test_an_mjcf_is_read_as_a_urdf_is(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    """`armangle inspect` reads an MJCF file; without mujoco it says what to install."""
    z, y, back = "0 0 1", "0 1 0", "0 -1 0"
    bodies = "".join(
        f'<body name="l{i}" pos="0 0 {up}"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        f'<joint name="q{i}" axis="{axis}" range="-2 2" limited="true"/>'
        for i, (up, axis) in enumerate([(0.3, z), (0, y), (0, z), (0.4, back), (0.4, z), (0, y), (0, z)])
    )
    Path("arm.xml").write_text(
        f'<!-- made --><mujoco model="made"><compiler angle="radian"/><worldbody>{bodies}{"</body>" * 7}'
        "</worldbody></mujoco>"
    )
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "mujoco", None)
        for words in ("inspect arm.xml", f"inspect arm.xml --joints {Q}", "ik --robot arm.xml {POSE}"):
            ran = cli(words)
            assert ran.status == 2 and "pip install 'armangle[mujoco]'" in ran.text
    need("mujoco")
    assert "made: S-R-S" in cli("inspect arm.xml").out
    assert "l6" in cli("inspect arm.xml --links ,l6 --json").facts["tip"]
    found = cli(f"inspect arm.xml --links ,l6 --joints {Q} --json").facts["matrix"]
    assert found == aa.Arm.from_mjcf("arm.xml").forward(RAD)[0].tolist()


# -- the pose of joints ----------------------------------------------------------------------------------


def test_the_pose_of_joints(cli: Cli) -> None:
    """`armangle inspect --joints` gives pose, psi and gc, and says which limits are exceeded."""
    ran = cli("inspect kuka_iiwa7_r800 --joints {Q}")
    assert "58.5882 deg" in ran.out and "3 (shoulder -, elbow -, wrist +)" in ran.out
    row = ran.out.splitlines()[ran.out.splitlines().index("x,y,z,qw,qx,qy,qz") + 1]
    back = cli(f"ik {{R}} --pose {row} --psi 58.58816 --gc 3 --json").facts["q"]
    assert back == pytest.approx(START, abs=1e-4)
    facts = cli("inspect kuka_iiwa7_r800 --joints {Q} --json").facts
    assert np.degrees(facts["psi"]) == pytest.approx(58.58816372916817) and facts["gc"] == 3
    facts = cli("inspect franka_fr3 --joints {QF} --json").facts
    pose, free, gc = FR3.forward(np.radians([10, 20, 10, -110, 15, 110, 30]))
    assert facts["matrix"] == pose.tolist() and (facts["psi"], facts["gc"]) == (float(free), int(gc))
    for joints in ("0,150,0,0,0,-130,0", "0,0,0,180,0,0,0"):
        ran = cli(f"inspect kuka_iiwa7_r800 --joints {joints}")
        assert ran.status == 1 and "beyond its upper limit" in ran.text and "-0.000000" not in ran.out
    assert "not defined" in ran.out
    assert cli("inspect kuka_iiwa7_r800 --joints 0,0,0,180,0,0,0 --json").facts["psi"] is None


def test_the_poses_of_a_joint_file(line: np.ndarray[Any, Any], cli: Cli) -> None:
    """`armangle inspect --joints FILE` writes poses, of an empty file none; a row of NaN is refused."""
    cli("ik {R} --pose line.csv --psi 90 --gc 3 -o q.csv")
    ran = cli("inspect kuka_iiwa7_r800 --joints q.csv -o again.npz")
    assert ran.status == 0 and "90.0000" in ran.out and ran.err == "wrote again.npz\n"
    assert np.abs(aa.io.load_poses("again.npz") - line).max() < 1e-12
    Path("none.csv").write_text("q1,q2,q3,q4,q5,q6,q7\n")
    assert cli("inspect kuka_iiwa7_r800 --joints none.csv -o none.npz").status == 0
    assert aa.io.load_poses("none.npz").shape == (0, 4, 4)
    Path("gap.csv").write_text("q1,q2,q3,q4,q5,q6,q7\n0,0,0,nan,0,0,0\n")
    assert "row 0 has no joint values" in cli("inspect kuka_iiwa7_r800 --joints gap.csv").text


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "franka_fr3"])
@pytest.mark.parametrize(("words", "tool"), [
    ("0.1,-0.02,0.3", aa.pose([0.1, -0.02, 0.3])),
    ("-0.1,0,0.2,0.6,0.8,0,0", aa.pose([-0.1, 0, 0.2], wxyz=[0.6, 0.8, 0, 0])),
])  # fmt: skip
def test_a_tool_is_mounted_on_the_tip(name: str, words: str, tool: Any, cli: Cli) -> None:
    """`armangle inspect --tool` gives the pose of `Arm.with_tool`."""
    arm = (ARM if "kuka" in name else FR3).with_tool(tool)
    told = cli(f"inspect {name} --joints {Q} --tool {words} --json").facts["matrix"]
    assert np.allclose(told, arm.forward(RAD)[0], rtol=0, atol=1e-12)


# -- the collision model ---------------------------------------------------------------------------------


@pytest.mark.turns(2)
@pytest.mark.parametrize("arm", [ARM, calibrated("kuka_iiwa7_r800", 1.0, 1.0)])
def test_a_collision_model_is_shown_and_written(arm: aa.Arm, cli: Cli) -> None:
    """`armangle inspect --body` shows and writes the model of `Body.from_urdf`, which `ik` takes."""
    Path("robot.urdf").write_text(with_shape(arm))
    Path("cell.toml").write_text('[[ball]]\nname = "lamp"\ncenter = [0.28, 0.26, 0.6]\nradius = 0.05\n')
    ran = cli("inspect robot.urdf --body 4 -o body.toml")
    assert "1 shape" in ran.out and "litres" in ran.out and "wrote body.toml" in ran.err
    assert aa.io.load_body("body.toml") == aa.Body.from_urdf("robot.urdf", shapes=4)
    facts = cli("inspect robot.urdf --body --json").facts
    assert len(facts["shapes"]) == sum(len(shapes) for _, shapes in aa.Body.from_urdf("robot.urdf").links)
    for more in ("", "--body body.toml"):
        words = f"ik --intervals --robot robot.urdf --joints {Q} --scene cell.toml {more}"
        assert cli(words).status in (0, 1)
    assert cli("inspect robot.urdf --body 4,hulls").status == 0
    for bad in ("x", "4,all", "0"):
        assert cli(f"inspect robot.urdf --body {bad}").status == 2
    assert cli("inspect kuka_iiwa7_r800 --body").status == 2
