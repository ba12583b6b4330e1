"""Reading MJCF: chains against MuJoCo's own kinematics, and every message."""

from __future__ import annotations

import re
import sys
from types import ModuleType

import numpy as np
import pytest
from support.chain import RandomArm, dh_forward, pose_error
from support.needs import need

from armangle.errors import FileFormatError, MissingExtraError
from armangle.models.detect import describe_chain
from armangle.models.mjcf import mjcf_candidates, read_mjcf

EXACT = 1e-9
INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


@pytest.fixture
def mujoco() -> ModuleType:
    return need("mujoco")


def text_of(values) -> str:
    return " ".join(repr(float(value)) for value in values)


def mjcf_of(arm: RandomArm, rng: np.random.Generator) -> str:
    """Return the MJCF of a made arm: random body frames, joint positions and references."""
    points, directions = arm.axes()
    tip = dh_forward(arm, np.zeros(7))
    opening, closing, parent = [], [], np.eye(4)
    for i in range(7):
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        body = np.eye(4)
        body[:3, :3] = rotation(quaternion)
        body[:3, 3] = rng.uniform(-1, 1, 3)
        step = np.linalg.inv(parent) @ body
        place = np.linalg.inv(body)[:3] @ [*(points[i] + rng.uniform() * directions[i]), 1.0]
        limit = f'limited="true" range="-{i + 1} {i + 2}"' if i % 2 else 'limited="false"'
        opening.append(
            f'<body name="b{i}" pos="{text_of(step[:3, 3])}" quat="{text_of(quat(step[:3, :3]))}">'
            f'<joint name="j{i}" type="hinge" pos="{text_of(place)}" {limit} '
            f'axis="{text_of(body[:3, :3].T @ directions[i])}"/>{INERTIA}'
        )
        closing.append("</body>")
        parent = body
    step = np.linalg.inv(parent) @ tip
    site = f'<site name="tip" pos="{text_of(step[:3, 3])}" quat="{text_of(quat(step[:3, :3]))}"/>'
    return model_of("".join(opening) + site + "".join(closing))


def model_of(world: str, rest: str = "") -> str:
    return (
        '<mujoco model="made"><compiler angle="radian" autolimits="false"/>'
        f"<worldbody>{world}</worldbody>{rest}</mujoco>"
    )


def rotation(q) -> np.ndarray:
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quat(matrix) -> np.ndarray:
    """Return the quaternion of a rotation: the eigenvector of its largest eigenvalue."""
    m = matrix
    k = np.array(
        [
            [m.trace(), m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [0, m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [0, 0, m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [0, 0, 0, m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    return np.linalg.eigh(k, UPLO="U")[1][:, -1]


def own_pose(mujoco: ModuleType, text: str, q, kind: str, name: str) -> np.ndarray:
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:7] = q
    mujoco.mj_kinematics(model, data)
    found = getattr(data, kind)(name)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = found.xmat.reshape(3, 3), found.xpos
    return pose


@pytest.mark.parametrize("seed", range(60))
def test_generated_arm_is_found(mujoco, seed):
    rng = np.random.default_rng(seed)
    made = RandomArm(rng, elbow_offset=seed % 2 == 1, right_angles=seed % 4 >= 2)
    text = mjcf_of(made, rng)
    chain = read_mjcf(text, tip="tip")
    arm, report = describe_chain(chain)
    assert (report.source, report.base, report.tip) == ("XML text", "world", "tip")
    assert (chain.name, arm.joint_names) == ("made", tuple(f"j{i}" for i in range(7)))
    assert report.residual_position <= EXACT
    for q in rng.uniform(-np.pi, np.pi, (3, 7)):
        own = own_pose(mujoco, text, q, "site", "tip")
        assert max(pose_error(chain.forward(q), own)) <= EXACT
        assert max(pose_error(dh_forward(arm, q), own)) <= EXACT


def test_limits_come_along(mujoco):
    rng = np.random.default_rng(0)
    joints = read_mjcf(mjcf_of(RandomArm(rng), rng), tip="b6").joints
    assert [j.lower for j in joints] == [-np.inf, -2, -np.inf, -4, -np.inf, -6, -np.inf]
    assert [j.upper for j in joints] == [np.inf, 3, np.inf, 5, np.inf, 7, np.inf]
    assert {j.velocity for j in joints} == {np.inf}


def test_several_joints_of_a_body_and_references_count(mujoco):
    hinge = '<joint name="a{0}" type="hinge" axis="{1}" pos="0 0 .{0}" ref="0.{0}"/>'
    axes = ("0 0 1", "0 1 0", "1 0 0", "0 1 1", "1 1 0", "1 0 1", "1 1 1")
    hinges = [hinge.format(i + 1, axis) for i, axis in enumerate(axes)]
    inner = f'<body name="in" pos="0 0 1" euler="1 2 3">{"".join(hinges[3:])}{INERTIA}</body>'
    text = model_of(f'<body name="out" pos="1 0 0">{"".join(hinges[:3])}{INERTIA}{inner}</body>')
    chain = read_mjcf(text)
    assert (chain.base, chain.tip) == ("world", "in")
    for q in np.random.default_rng(1).uniform(-3, 3, (5, 7)):
        assert max(pose_error(chain.forward(q), own_pose(mujoco, text, q, "body", "in"))) <= EXACT


def tower(count: int, top: str = "", joint: str = '<joint name="h{}" axis="0 0 1"/>') -> str:
    opening = [f'<body name="b{i}">{joint.format(i)}{INERTIA}' for i in range(1, count + 1)]
    return "".join(opening) + top + "</body>" * count


FLANGE = '<body name="{}"/>'


@pytest.mark.parametrize(
    ("world", "found"),
    [
        (tower(7), [("b7", ["b7"])]),
        (tower(7, FLANGE.format("flange")), [("flange", ["flange"])]),
        (tower(7, FLANGE.format("flange") + FLANGE.format("camera")), [("b7", ["flange", "camera"])]),
        (tower(8), []),
        (tower(6), []),
    ],
)
def test_candidates_end_at_the_last_fixed_body(mujoco, world, found):
    assert [(one.tip, list(one.ends)) for one in mjcf_candidates(model_of(world))] == found


@pytest.mark.parametrize(
    ("world", "ends", "message"),
    [
        (tower(7), ("no", None), "no body 'no' (base); the bodies are: world, b1, b2"),
        (tower(7), (None, "no"), "no body 'no' (tip); the bodies are: world, b1, b2"),
        (tower(7), ("b3", "b1"), "no path down from body 'b3' to 'b1'"),
        (tower(6), (None, None), "no chain of 7 rotating joints is found, walking up"),
        (
            tower(7, FLANGE.format("x") + FLANGE.format("y")),
            (None, None),
            "candidates: 'world' to 'b7' (not S-R-S; or tip x, y)",
        ),
        (tower(6), (None, "b6"), "6 hinges from 'world' to 'b6', wanted 7: h1, h2, h3, h4, h5, h6"),
        (
            tower(8),
            ("world", "b8"),
            "h8; base='b1' leaves the last 7: then arm.with_(base=T @ arm.base) puts the arm into the frame",
        ),
        (tower(7), ("b7", "b7"), "0 hinges from 'b7' to 'b7', wanted 7: none"),
        (
            tower(7, joint='<joint name="h{}" type="slide"/>'),
            (None, "b7"),
            "joint 'h1' on the path is slide, wanted hinge",
        ),
        (tower(1, joint="<freejoint/>"), (None, "b1"), "joint 'joint_0' on the path is free"),
    ],
)
def test_refusals_name_what_is_wrong(mujoco, world, ends, message):
    with pytest.raises(FileFormatError, match=re.escape(message)) as caught:
        read_mjcf(model_of(world), *ends)
    assert str(caught.value).startswith("XML text: ")


def test_a_coupled_joint_is_refused(mujoco):
    rest = '<equality><joint joint1="h3" joint2="h1"/></equality>'
    with pytest.raises(FileFormatError, match="joint 'h3' on the path is coupled to another joint"):
        read_mjcf(model_of(tower(7), rest), tip="b7")


def test_unreadable_models_are_refused(mujoco, tmp_path):
    with pytest.raises(FileFormatError, match=r"nowhere\.xml: no such file"):
        read_mjcf(tmp_path / "nowhere.xml")
    with pytest.raises(FileFormatError, match="mujoco refuses it: "):
        read_mjcf("<mujoco><nonsense/></mujoco>")
    path = tmp_path / "arm.xml"
    path.write_text(model_of(tower(7)))
    assert read_mjcf(path).source == str(path)


def test_without_mujoco_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'armangle\[mujoco\]'"):
        read_mjcf("<mujoco/>")
