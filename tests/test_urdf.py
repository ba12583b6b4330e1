"""Reading and writing URDF: chains against other readers, and every message."""

from __future__ import annotations

import dataclasses
import re
from types import ModuleType

import numpy as np
import pytest
from chain import MODELS, RandomArm, model, pose_error, skip_or_fail, urdf_forward, urdf_of

import armangle.urdf
from armangle._chain import chain_of
from armangle.description import ArmDescription
from armangle.detect import describe_chain
from armangle.errors import LimitError, ShapeError, UrdfError
from armangle.urdf import read_urdf, urdf_candidates, write_urdf

EXACT = 1e-9
REAL = (
    "kuka_iiwa7_r800",
    "kuka_iiwa14_r820_official",
    "kuka_iiwa14_rosi",
    "schunk_lwa4d",
    "kinova_gen3_7dof",
    "rokae_xmate_er3_pro",
    "realman_rm75",
    "franka_panda",
    "rethink_sawyer",
    "yaskawa_sia5d",
    "openarm_v10",
    "ufactory_xarm7",
)


def pinocchio() -> ModuleType:
    try:
        import pinocchio as pin
    except ImportError:
        skip_or_fail("pinocchio (pip package pin) is not installed")
    return pin


def pin_forward(pin, model, base: str, tip: str, q: dict[str, float]):
    """Return the pose of tip in base; a continuous joint takes two numbers in pinocchio."""
    data = model.createData()
    vector = pin.neutral(model)
    for name, angle in q.items():
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 2:
            vector[joint.idx_q : joint.idx_q + 2] = np.cos(angle), np.sin(angle)
        else:
            vector[joint.idx_q] = angle
    pin.framesForwardKinematics(model, data, vector)
    frames = [data.oMf[model.getFrameId(name, pin.FrameType.BODY)] for name in (base, tip)]
    return (frames[0].inverse() * frames[1]).homogeneous


def simple(joints: str = "", count: int = 7, links: str = "", **change: str) -> str:
    """Return a straight chain l0 .. l<count>, with text of some joints changed by name."""
    text = ['<robot name="simple">']
    text += [f'<link name="l{i}"/>' for i in range(count + 1)]
    for i in range(1, count + 1):
        name = f"j{i}"
        plain = (
            f'<joint name="{name}" type="revolute"><parent link="l{i - 1}"/><child link="l{i}"/>'
            '<origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="-1" upper="2"/></joint>'
        )
        text.append(change.get(name, plain))
    return "\n".join([*text, links, joints, "</robot>"])


def joint(name: str, parent: str, child: str, kind: str = "revolute", inside: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f"{inside}</joint>"
    )


LIMIT = '<limit lower="-1" upper="2"/>'


@pytest.mark.parametrize("name", REAL)
def test_real_chain_is_the_plain_one(name):
    path = model(name)
    chain = read_urdf(path)
    names = [j.name for j in chain.joints]
    for q in np.random.default_rng(0).uniform(-np.pi, np.pi, (20, 7)):
        own = urdf_forward(path.read_text(), chain.tip, dict(zip(names, q, strict=True)))
        assert max(pose_error(chain.forward(q), own)) <= EXACT


@pytest.mark.parametrize("name", REAL)
def test_real_chain_is_pinocchios(name):
    pin = pinocchio()
    path = model(name)
    chain = read_urdf(path)
    robot = pin.buildModelFromXML(path.read_text())
    names = [j.name for j in chain.joints]
    for q in np.random.default_rng(0).uniform(-np.pi, np.pi, (20, 7)):
        other = pin_forward(pin, robot, chain.base, chain.tip, dict(zip(names, q, strict=True)))
        assert max(pose_error(chain.forward(q), other)) <= EXACT


@pytest.mark.parametrize("name", REAL)
def test_real_limits_are_pinocchios(name):
    pin = pinocchio()
    path = model(name)
    robot = pin.buildModelFromXML(path.read_text())
    for j in read_urdf(path).joints:
        other = robot.joints[robot.getJointId(j.name)]
        if other.nq == 2:
            assert (j.lower, j.upper) == (-np.inf, np.inf)
        else:
            assert j.lower == pytest.approx(robot.lowerPositionLimit[other.idx_q], abs=1e-12)
            assert j.upper == pytest.approx(robot.upperPositionLimit[other.idx_q], abs=1e-12)
        assert j.velocity == pytest.approx(robot.velocityLimit[other.idx_v], abs=1e-12)


@pytest.mark.parametrize("seed", range(60))
def test_generated_and_written_chains_are_pinocchios(seed):
    pin = pinocchio()
    rng = np.random.default_rng(seed)
    made = RandomArm(rng, elbow_offset=seed % 2 == 1, right_angles=seed % 4 >= 2)
    text = urdf_of(made, rng, clutter=False)
    arm, _ = describe_chain(read_urdf(text, "root", "tip"))
    models = [
        (pin.buildModelFromXML(text), "root"),
        (pin.buildModelFromXML(write_urdf(arm)), "base"),
    ]
    for q in rng.uniform(-np.pi, np.pi, (3, 7)):
        named = dict(zip(arm.joint_names, q, strict=True))
        for robot, base in models:
            other = pin_forward(pin, robot, base, "tip", named)
            assert max(pose_error(chain_of(arm).forward(q), other)) <= EXACT


def test_limits_speeds_and_names_come_along():
    made = RandomArm(np.random.default_rng(5))
    chain = read_urdf(urdf_of(made, np.random.default_rng(6)), "root", "tip")
    assert [j.name for j in chain.joints] == [f"to_l{i}" for i in range(7)]
    assert [j.velocity for j in chain.joints] == [1, 2, 3, 4, 5, 6, 7]
    limits = {(j.lower, j.upper) for j in chain.joints}
    assert (-np.inf, np.inf) in limits
    assert limits <= {(-np.inf, np.inf), *((-i - 1.0, i + 2.0) for i in range(7))}


def test_forward_takes_batches():
    chain = read_urdf(simple())
    q = np.random.default_rng(0).uniform(-1, 1, (2, 3, 7))
    poses = chain.forward(q)
    assert poses.shape == (2, 3, 4, 4)
    np.testing.assert_allclose(poses[1, 2], chain.forward(q[1, 2]), atol=1e-15)


def test_text_bytes_and_path_are_the_same(tmp_path):
    path = tmp_path / "arm.urdf"
    text = '<?xml version="1.0" encoding="utf-8"?>\n' + simple().replace("simple", "Größe")
    path.write_text(text, encoding="utf-8")
    chains = [read_urdf(source) for source in (path, str(path), text, text.encode(), "\n " + text)]
    assert {chain.name for chain in chains} == {"Größe"}
    assert [chain.source for chain in chains] == [str(path)] * 2 + ["XML text"] * 3
    assert {tuple(j.name for j in chain.joints) for chain in chains} == {
        tuple(f"j{i}" for i in range(1, 8))
    }


def test_what_urdf_leaves_out_has_its_defaults():
    bare = joint("j1", "l0", "l1", inside='<limit upper="2"/>')
    chain = read_urdf(simple(j1=bare))
    first = chain.joints[0]
    np.testing.assert_array_equal(first.origin, np.eye(4))
    np.testing.assert_array_equal(first.axis, [1, 0, 0])
    assert (first.lower, first.upper, first.velocity) == (0.0, 2.0, np.inf)


def test_joints_off_the_path_are_ignored():
    clutter = joint("finger", "l7", "f", "prismatic", '<limit lower="x"/>')
    clutter += joint("arm2", "l0", "g", "hinge", '<axis xyz="0 0 0"/>')
    clutter += '<transmission name="t"><joint name="j1"/></transmission><gazebo><link/></gazebo>'
    text = simple(clutter, links='<link name="f"/><link name="g"/>')
    assert urdf_candidates(text) == (("l0", "l7"),)
    assert len(read_urdf(text).joints) == 7


def test_a_path_may_go_up_before_it_goes_down():
    extra = joint("mount", "l0", "b", "fixed", '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>')
    text = simple(extra, links='<link name="b"/>')
    q = np.linspace(-1, 1, 7)
    expected = np.linalg.inv(urdf_forward(text, "b", {})) @ read_urdf(text, "l0", "l7").forward(q)
    np.testing.assert_allclose(read_urdf(text, "b", "l7").forward(q), expected, atol=1e-12)


def test_a_path_may_be_walked_against_the_joints():
    made = RandomArm(np.random.default_rng(3))
    text = urdf_of(made, np.random.default_rng(4))
    q = np.linspace(-1, 1, 7)
    there, back = read_urdf(text, "root", "tip"), read_urdf(text, "tip", "root")
    assert [j.name for j in back.joints] == [j.name for j in there.joints][::-1]
    np.testing.assert_allclose(back.forward(q[::-1]) @ there.forward(q), np.eye(4), atol=1e-12)


def test_candidates_end_at_the_last_fixed_link():
    extra = joint("f1", "l7", "flange", "fixed") + joint("f2", "flange", "tool0", "fixed")
    extra += joint("f3", "flange", "camera", "fixed")
    extra += joint("finger", "tool0", "x", "revolute", LIMIT)
    names = ("flange", "tool0", "camera", "x")
    text = simple(extra, links="".join(f'<link name="{n}"/>' for n in names))
    assert urdf_candidates(text) == (("l0", "tool0"), ("l0", "camera"))
    assert read_urdf(text, tip="camera").base == "l0"
    with pytest.raises(UrdfError, match="not unique, name them; candidates: 'l0' to 'tool0', 'l0'"):
        read_urdf(text)


def test_a_speed_of_zero_is_none():
    with_speed = joint("j2", "l1", "l2", inside='<limit lower="-1" upper="1" velocity="0"/>')
    chain = read_urdf(simple(j2=with_speed))
    assert chain.joints[1].velocity == np.inf
    assert chain.notes == ("velocity of joint 'j2' is 0: taken as not given",)


BOMB = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>' + simple()
REFUSED = {
    "doctype": (BOMB, "a DOCTYPE is refused: a robot needs none"),
    "xml": (simple() + "<", "not XML: "),
    "empty": (b"", "not XML: no element found"),
    "robot": ("<mujoco/>", "not a robot: the outer element is <mujoco>, wanted <robot>"),
    "xacro": (
        simple('<xacro:macro name="a"/>'),
        "this is xacro, not URDF (<xacro:macro>); run xacro first: xacro FILE.urdf.xacro",
    ),
    "unnamed": (simple("<joint/>"), "a <joint> has no name"),
    "twice": (simple('<link name="l3"/>'), "link 'l3' is there twice"),
    "no parent": (simple(j3='<joint name="j3" type="fixed"/>'), "joint 'j3' has no <parent link"),
    "lost link": (simple(joint("a", "l0", "zz")), "joint 'a' names a link 'zz' that is not there"),
    "two parents": (
        simple(joint("a", "l0", "l5")),
        "link 'l5' hangs on two joints, 'j5' and 'a'",
    ),
    "six": (
        simple(j3=joint("j3", "l2", "l3", "fixed")),
        "6 moving joints from 'l0' to 'l7', wanted 7: j1, j2, j4, j5, j6, j7",
    ),
    "eight": (
        simple(joint("j8", "l7", "l8", "continuous"), links='<link name="l8"/>'),
        "8 moving joints from 'l0' to 'l8', wanted 7: j1, j2, j3, j4, j5, j6, j7, j8",
    ),
    "prismatic": (
        simple(j3=joint("j3", "l2", "l3", "prismatic", LIMIT)),
        "joint 'j3' on the path is prismatic, wanted revolute",
    ),
    "floating": (simple(j3=joint("j3", "l2", "l3", "floating")), "'j3' on the path is floating"),
    "planar": (simple(j3=joint("j3", "l2", "l3", "planar")), "'j3' on the path is planar"),
    "unknown": (simple(j3=joint("j3", "l2", "l3", "hinge")), "has unknown type 'hinge'"),
    "mimic": (
        simple(j3=joint("j3", "l2", "l3", "revolute", LIMIT + '<mimic joint="j1"/>')),
        "joint 'j3' on the path mimics another joint",
    ),
    "no limits": (
        simple(j3=joint("j3", "l2", "l3")),
        "revolute joint 'j3' has no limits (lower, upper)",
    ),
    "no bounds": (
        simple(j3=joint("j3", "l2", "l3", inside='<limit velocity="1"/>')),
        "revolute joint 'j3' has no limits (lower, upper)",
    ),
    "reversed": (
        simple(j3=joint("j3", "l2", "l3", inside='<limit lower="1" upper="-1"/>')),
        "joint 'j3': lower limit 1 is above upper limit -1",
    ),
    "speed": (
        simple(j3=joint("j3", "l2", "l3", inside='<limit lower="0" upper="1" velocity="-2"/>')),
        "joint 'j3': velocity -2 is negative",
    ),
    "zero axis": (
        simple(j3=joint("j3", "l2", "l3", inside=LIMIT + '<axis xyz="0 0 0"/>')),
        "joint 'j3' has a zero axis",
    ),
    "words": (
        simple(j3=joint("j3", "l2", "l3", inside=LIMIT + '<axis xyz="0 0 up"/>')),
        "joint 'j3': <axis xyz='0 0 up'> is not 3 numbers",
    ),
    "word": (
        simple(j3=joint("j3", "l2", "l3", inside='<limit lower="low" upper="1"/>')),
        "joint 'j3': <limit lower='low'> is not 1 number",
    ),
    "count": (
        simple(j3=joint("j3", "l2", "l3", inside=LIMIT + '<origin xyz="0 1"/>')),
        "joint 'j3': <origin xyz='0 1'> has 2 numbers, wanted 3",
    ),
    "nan": (
        simple(j3=joint("j3", "l2", "l3", inside=LIMIT + '<origin rpy="0 nan 0"/>')),
        "joint 'j3': <origin rpy='0 nan 0'> is not finite",
    ),
    "infinite": (
        simple(j3=joint("j3", "l2", "l3", inside='<limit lower="-inf" upper="1"/>')),
        "joint 'j3': <limit lower='-inf'> is not finite",
    ),
    "absurd": (
        simple(j3=joint("j3", "l2", "l3", inside=LIMIT + '<origin xyz="0 0 400"/>')),
        "joint 'j3' lies 400 m away, absurd for an arm (wanted metres, at most 100)",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_text_is_refused_with_the_name(case):
    text, message = REFUSED[case]
    last = "l8" if case == "eight" else "l7"
    with pytest.raises(UrdfError, match=re.escape(message)) as caught:
        read_urdf(text, "l0", last)
    assert str(caught.value).startswith("XML text:")
    assert caught.value.source == "XML text"


@pytest.mark.parametrize(
    ("base", "tip", "message"),
    [
        ("nowhere", "l7", "no link 'nowhere' (base); the links are: l0, l1, l2"),
        ("l0", "nowhere", "no link 'nowhere' (tip); the links are: l0, l1, l2"),
        (None, "nowhere", "no link 'nowhere' (tip); the links are: l0"),
        ("nowhere", None, "no link 'nowhere' (base); the links are: l0"),
        ("l0", "island", "no path from 'l0' to 'island': their roots are 'l0' and 'island'"),
        ("l1", None, "no link is reached through exactly 7 rotating joints from 'l1'; name base"),
        (None, "l6", "6 moving joints from 'l0' to 'l6', wanted 7: j1, j2, j3, j4, j5, j6"),
        ("l3", "l3", "0 moving joints from 'l3' to 'l3', wanted 7: none"),
    ],
)
def test_bad_ends_are_refused_with_the_choices(base, tip, message):
    text = simple(links='<link name="island"/>')
    with pytest.raises(UrdfError, match=re.escape(message)):
        read_urdf(text, base, tip)


def test_no_arm_at_all_is_said():
    with pytest.raises(UrdfError, match="no link is reached through exactly 7 rotating joints;"):
        read_urdf('<robot><link name="alone"/></robot>')


@pytest.mark.parametrize("ends", [("a", None), (None, "a"), ("a", "b")])
def test_a_loop_is_refused(ends):
    text = '<robot><link name="a"/><link name="b"/>'
    text += joint("one", "a", "b", "fixed") + joint("two", "b", "a", "fixed") + "</robot>"
    with pytest.raises(UrdfError, match="closes a loop at link 'a'"):
        read_urdf(text, *ends)


def test_the_place_in_the_file_is_named(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text("<robot>\n <link name='a'/>\n  <link/>\n</robot>")
    with pytest.raises(UrdfError) as caught:
        read_urdf(path)
    assert str(caught.value) == f"{path}:3:3: a <link> has no name"
    assert (caught.value.line, caught.value.column) == (3, 3)


def test_bad_paths_are_refused(tmp_path, monkeypatch):
    with pytest.raises(UrdfError, match=r"nowhere\.urdf: no such file"):
        read_urdf(tmp_path / "nowhere.urdf")
    with pytest.raises(UrdfError, match="cannot be read: Is a directory"):
        read_urdf(tmp_path)
    with pytest.raises(
        UrdfError, match=r"arm.urdf.xacro: this is xacro, not URDF; run xacro first"
    ):
        read_urdf("arm.urdf.xacro")
    monkeypatch.setattr(armangle.urdf, "MAX_BYTES", 2**20)
    path = tmp_path / "large.urdf"
    path.write_bytes(b"<" * 3 * 2**20)
    for source in (path, path.read_bytes()):
        with pytest.raises(UrdfError, match="3 MiB is absurd for a robot, wanted at most 1 MiB"):
            read_urdf(source)


def described(**change: object) -> ArmDescription:
    plain = ArmDescription("arm", d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1)
    return dataclasses.replace(plain, **change)


def test_written_limits_speeds_and_names_come_back():
    names = ("tool", "a b", "<&>", '"', "é", "6", "7")
    arm = described(
        name="a & b",
        joint_names=names,
        lower=(-1.0, -np.inf, -np.pi, 0.1, -1e-3, -6.0, -np.inf),
        upper=(1.0, np.inf, np.pi, 0.2, 1e-3, 6.5, np.inf),
        velocity=(1.0, 2.0, np.inf, 1 / 3, 4.0, 5.0, np.inf),
    )
    chain = read_urdf(write_urdf(arm), "base", "tip")
    assert chain.name == "a & b"
    assert tuple(j.name for j in chain.joints) == names
    assert tuple(j.lower for j in chain.joints) == arm.lower
    assert tuple(j.upper for j in chain.joints) == arm.upper
    assert tuple(j.velocity for j in chain.joints) == arm.velocity


def test_a_limit_on_one_side_cannot_be_written():
    arm = described(lower=(-1.0, *(-np.inf,) * 6))
    with pytest.raises(LimitError, match=r"joint 'joint_1' has limits \[-1, inf\]; URDF cannot"):
        write_urdf(arm)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"signs": (1, 1)}, "signs has 2 entries, wanted 7"),
        ({"base": np.eye(3)}, r"base has shape \(3, 3\), wanted \(4, 4\)"),
    ],
)
def test_a_description_has_its_shapes(change, message):
    with pytest.raises(ShapeError, match=message):
        described(**change)


def test_every_real_file_is_covered():
    if not MODELS.is_dir():
        skip_or_fail(f"no robot files in {MODELS} (set ARMANGLE_MODELS)")
    assert {path.stem for path in MODELS.glob("*.urdf")} == set(REAL)
