"""Reading and writing URDF: chains against other readers, and what the writer keeps."""

from __future__ import annotations

import dataclasses
from types import ModuleType

import numpy as np
import pytest
from support.chain import LIMIT, RandomArm, joint_xml, pose_error, simple_urdf, urdf_forward, urdf_of
from support.chains import read_urdf, urdf_candidates
from support.needs import MODELS, model, need, no_models
from support.refused import not_refused

from armangle.errors import InputError, LimitError
from armangle.models.chain import chain_of
from armangle.models.description import ArmDescription
from armangle.models.detect import describe_chain
from armangle.models.urdf import write_urdf

pytestmark = pytest.mark.filterwarnings("ignore:joint .* is continuous")

EXACT = 1e-9
REAL = (
    "kuka_iiwa7_r800", "kuka_iiwa14_r820_official", "kuka_iiwa14_rosi", "schunk_lwa4d", "kinova_gen3_7dof",
    "rokae_xmate_er3_pro", "realman_rm75", "franka_panda", "rethink_sawyer", "yaskawa_sia5d", "openarm_v10",
    "ufactory_xarm7",
)  # fmt: skip


def pinocchio() -> ModuleType:
    """The module pinocchio, or skip."""
    return need("pinocchio")  # the package is called pin


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


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", REAL)
def test_real_chain_is_the_plain_one(name):
    """`read_urdf` of real files gives the poses of joints multiplied in order."""
    path = model(name)
    chain = read_urdf(path)
    names = [j.name for j in chain.joints]
    for q in np.random.default_rng(0).uniform(-np.pi, np.pi, (20, 7)):
        own = urdf_forward(path.read_text(), chain.tip, dict(zip(names, q, strict=True)))
        assert max(pose_error(chain.forward(q), own)) <= EXACT


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", REAL)
def test_real_chain_and_its_limits_are_pinocchios(name):
    """`read_urdf` of real files gives pinocchio's poses, limits and velocities."""
    pin, path = pinocchio(), model(name)
    chain, robot = read_urdf(path), pin.buildModelFromXML(path.read_text())
    names = [j.name for j in chain.joints]
    for q in np.random.default_rng(0).uniform(-np.pi, np.pi, (20, 7)):
        other = pin_forward(pin, robot, chain.base, chain.tip, dict(zip(names, q, strict=True)))
        assert max(pose_error(chain.forward(q), other)) <= EXACT
    for j in chain.joints:
        other = robot.joints[robot.getJointId(j.name)]
        if other.nq == 2:
            assert (j.lower, j.upper) == (-np.inf, np.inf)
        else:
            assert j.lower == pytest.approx(robot.lowerPositionLimit[other.idx_q], abs=1e-12)
            assert j.upper == pytest.approx(robot.upperPositionLimit[other.idx_q], abs=1e-12)
        assert j.velocity == pytest.approx(robot.velocityLimit[other.idx_v], abs=1e-12)


@pytest.mark.turns(2)
@pytest.mark.parametrize("part", range(4))
def test_generated_and_written_chains_are_pinocchios(part):
    """Random arms, read and written as URDF, have pinocchio's poses."""
    pin = pinocchio()
    for seed in range(part, 60, 4):
        rng = np.random.default_rng(seed)
        made = RandomArm(rng, elbow_offset=seed % 2 == 1, right_angles=seed % 4 >= 2)
        text = urdf_of(made, rng, clutter=False)
        arm, _ = describe_chain(read_urdf(text, "root", "tip"))
        models = [(pin.buildModelFromXML(text), "root"), (pin.buildModelFromXML(write_urdf(arm)), "base")]
        for q in rng.uniform(-np.pi, np.pi, (3, 7)):
            named = dict(zip(arm.joint_names, q, strict=True))
            for robot, base in models:
                other = pin_forward(pin, robot, base, "tip", named)
                assert max(pose_error(chain_of(arm).forward(q), other)) <= EXACT, seed


def test_limits_speeds_and_names_come_along():
    """`read_urdf` gives limits, velocities and names; continuous joints have no limits."""
    made = RandomArm(np.random.default_rng(5))
    chain = read_urdf(urdf_of(made, np.random.default_rng(6)), "root", "tip")
    assert [j.name for j in chain.joints] == [f"to_l{i}" for i in range(7)]
    assert [j.velocity for j in chain.joints] == [1, 2, 3, 4, 5, 6, 7]
    limits = {(j.lower, j.upper) for j in chain.joints}
    assert (-np.inf, np.inf) in limits
    assert limits <= {(-np.inf, np.inf), *((-i - 1.0, i + 2.0) for i in range(7))}


def test_forward_takes_batches():
    chain = read_urdf(simple_urdf())
    q = np.random.default_rng(0).uniform(-1, 1, (2, 3, 7))
    poses = chain.forward(q)
    assert poses.shape == (2, 3, 4, 4)
    np.testing.assert_allclose(poses[1, 2], chain.forward(q[1, 2]), atol=1e-15)


def test_text_bytes_and_path_are_the_same(tmp_path):
    """`read_urdf` takes a path, text or bytes alike, and names its source."""
    path = tmp_path / "arm.urdf"
    text = '<?xml version="1.0" encoding="utf-8"?>\n' + simple_urdf().replace("simple", "Größe")
    path.write_text(text, encoding="utf-8")
    chains = [read_urdf(source) for source in (path, str(path), text, text.encode(), "\n " + text)]
    assert {chain.name for chain in chains} == {"Größe"}
    assert [chain.source for chain in chains] == [str(path)] * 2 + ["XML text"] * 3
    assert {tuple(j.name for j in chain.joints) for chain in chains} == {tuple(f"j{i}" for i in range(1, 8))}


def test_what_urdf_leaves_out_has_its_defaults():
    """`read_urdf` of a bare joint has an identity origin, the x axis, lower limit 0 and no velocity."""
    bare = joint_xml("j1", "l0", "l1", inside='<limit upper="2"/>')
    chain = read_urdf(simple_urdf(j1=bare))
    first = chain.joints[0]
    np.testing.assert_array_equal(first.origin, np.eye(4))
    np.testing.assert_array_equal(first.axis, [1, 0, 0])
    assert (first.lower, first.upper, first.velocity) == (0.0, 2.0, np.inf)


def test_joints_off_the_path_are_ignored():
    """`read_urdf` and `urdf_candidates` ignore faulty joints off the path."""
    clutter = joint_xml("finger", "l7", "f", "prismatic", '<limit lower="x"/>')
    clutter += joint_xml("arm2", "l0", "g", "hinge", '<axis xyz="0 0 0"/>')
    clutter += '<transmission name="t"><joint name="j1"/></transmission><gazebo><link/></gazebo>'
    text = simple_urdf(clutter, links='<link name="f"/><link name="g"/>')
    assert [(one.base, one.tip) for one in urdf_candidates(text)] == [("l0", "l7")]
    assert len(read_urdf(text).joints) == 7


def test_a_path_may_go_up_before_it_goes_down():
    """`read_urdf` takes a base link from which the path first goes up the tree."""
    extra = joint_xml("mount", "l0", "b", "fixed", '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>')
    text = simple_urdf(extra, links='<link name="b"/>')
    q = np.linspace(-1, 1, 7)
    expected = np.linalg.inv(urdf_forward(text, "b", {})) @ read_urdf(text, "l0", "l7").forward(q)
    np.testing.assert_allclose(read_urdf(text, "b", "l7").forward(q), expected, atol=1e-12)


def test_a_path_may_be_walked_against_the_joints():
    """`read_urdf` from tip to root has the joints in reverse and inverse poses."""
    made = RandomArm(np.random.default_rng(3))
    text = urdf_of(made, np.random.default_rng(4))
    q = np.linspace(-1, 1, 7)
    there, back = read_urdf(text, "root", "tip"), read_urdf(text, "tip", "root")
    assert [j.name for j in back.joints] == [j.name for j in there.joints][::-1]
    np.testing.assert_allclose(back.forward(q[::-1]) @ there.forward(q), np.eye(4), atol=1e-12)


def test_candidates_end_at_the_last_fixed_link():
    """`urdf_candidates` end at the last fixed link above several ends and list these; `read_urdf` says so."""
    extra = joint_xml("f1", "l7", "flange", "fixed") + joint_xml("f2", "flange", "tool0", "fixed")
    extra += joint_xml("f3", "flange", "camera", "fixed")
    extra += joint_xml("finger", "tool0", "x", "prismatic", LIMIT)
    names = ("flange", "tool0", "camera", "x")
    text = simple_urdf(extra, links="".join(f'<link name="{n}"/>' for n in names))
    (found,) = urdf_candidates(text)
    assert (found.base, found.tip, found.ends) == ("l0", "flange", ("tool0", "camera"))
    assert read_urdf(text, tip="camera").base == "l0"
    chain = read_urdf(text)
    assert chain.tip == "flange"
    (note,) = [one for one in chain.notes if "tip" in one]
    assert "'flange'" in note and "'tool0', 'camera'" in note


def described(**change: object) -> ArmDescription:
    """A plain description with these changes."""
    plain = ArmDescription(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1)
    return dataclasses.replace(plain, **change)


def test_written_limits_speeds_and_names_come_back():
    """`write_urdf` and `read_urdf` keep limits, velocities and odd names."""
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


def test_what_no_description_or_no_urdf_can_be_is_refused():
    """Descriptions refuse bad shapes, and `write_urdf` half infinite limits."""
    assert not_refused([
        (LimitError, r"joint 'joint_1' has limits \[-1, inf\]",
         lambda: write_urdf(described(lower=(-1.0, *(-np.inf,) * 6)))),
        (InputError, "signs has 2 entries, wanted 7", lambda: described(signs=(1, 1))),
        (InputError, r"base has shape \(3, 3\), wanted \(4, 4\)", lambda: described(base=np.eye(3))),
    ]) == []  # fmt: skip


def test_every_real_file_is_covered():
    """`REAL` has every URDF file of the models."""
    if not MODELS.is_dir():
        no_models(f"no robot files in {MODELS}")
    assert {path.stem for path in MODELS.glob("*.urdf")} == set(REAL)
