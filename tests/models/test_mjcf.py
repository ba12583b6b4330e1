"""Reading MJCF: chains against MuJoCo's own kinematics, and every message."""

from __future__ import annotations

import re
import subprocess
import sys
from types import ModuleType

import numpy as np
import pytest
from support.chain import RandomArm, dh_forward, pose_error
from support.chains import mjcf_candidates, read_mjcf
from support.needs import need
from support.refused import not_refused

from armangle.errors import ModelError
from armangle.models.detect import describe_chain

EXACT = 1e-9
INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


@pytest.fixture
def mujoco() -> ModuleType:
    """The module mujoco, or skip."""
    return need("mujoco")


def text_of(values) -> str:
    """Numbers as text, with blanks between."""
    return " ".join(repr(float(value)) for value in values)


def mjcf_of(arm: RandomArm, rng: np.random.Generator) -> str:
    """Return the MJCF of a made arm: random body frames, joints at random points of their axes, limits."""
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
    """Return the MJCF of a world."""
    return (
        '<mujoco model="made"><compiler angle="radian" autolimits="false"/>'
        f"<worldbody>{world}</worldbody>{rest}</mujoco>"
    )


def rotation(q) -> np.ndarray:
    """The rotation (3, 3) of a quaternion (w, x, y, z)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quat(matrix) -> np.ndarray:
    """Return the quaternion (w, x, y, z) of a rotation: an eigenvector of the largest eigenvalue of k."""
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
    """Return the pose of a body or site that MuJoCo computes."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:7] = q
    mujoco.mj_kinematics(model, data)
    found = getattr(data, kind)(name)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = found.xmat.reshape(3, 3), found.xpos
    return pose


@pytest.mark.turns(2)
@pytest.mark.parametrize("part", range(4))
def test_generated_arm_is_found(mujoco, part):
    """`read_mjcf` and `describe_chain` find random arms with MuJoCo's own poses."""
    for seed in range(part, 60, 4):
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
    """`read_mjcf` gives limits of limited joints, infinite ones for others, and no velocities."""
    rng = np.random.default_rng(0)
    joints = read_mjcf(mjcf_of(RandomArm(rng), rng), tip="b6").joints
    assert [j.lower for j in joints] == [-np.inf, -2, -np.inf, -4, -np.inf, -6, -np.inf]
    assert [j.upper for j in joints] == [np.inf, 3, np.inf, 5, np.inf, 7, np.inf]
    assert {j.velocity for j in joints} == {np.inf}


def test_several_joints_of_a_body_and_references_count(mujoco):
    """`read_mjcf` of bodies with several joints and references has MuJoCo's own poses."""
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
    """The MJCF of `count` bodies in one another, each with `joint`, and `top` in the last."""
    opening = [f'<body name="b{i}">{joint.format(i)}{INERTIA}' for i in range(1, count + 1)]
    return "".join(opening) + top + "</body>" * count


FLANGE = '<body name="{}"/>'


def test_candidates_end_at_the_last_fixed_body(mujoco):
    """`mjcf_candidates` end at the last fixed body, or at the last joint's body if several are fixed to it,
    which they list as `ends`; six joints give none, eight two.
    """
    for world, found in (
        (tower(7), [("b7", ["b7"])]), (tower(7, FLANGE.format("flange")), [("flange", ["flange"])]),
        (tower(7, FLANGE.format("flange") + FLANGE.format("camera")), [("b7", ["flange", "camera"])]),
        (tower(8), [("b7", ["b7"]), ("b8", ["b8"])]), (tower(6), []),
    ):  # fmt: skip
        assert [(one.tip, list(one.ends)) for one in mjcf_candidates(model_of(world))] == found


SLIDES = tower(7, joint='<joint name="h{}" type="slide"/>')
REFUSED = [
    (tower(7), ("no", None), "no body 'no' (base); the bodies are: world, b1, b2"),
    (tower(7), (None, "no"), "no body 'no' (tip); the bodies are: world, b1, b2"),
    (tower(7), ("b3", "b1"), "no path down from body 'b3' to 'b1'"),
    (tower(6), (None, None), "no chain of 7 rotating joints"),
    (tower(8), (None, "b8"), "8 rotating joints lead to 'b8'"),
    (tower(6), (None, "b6"), "6 hinges from 'world' to 'b6', wanted 7: h1, h2, h3, h4, h5, h6"),
    (tower(8), ("world", "b8"), "h8; base='b1' leaves the last 7"),
    (tower(7), ("b7", "b7"), "0 hinges from 'b7' to 'b7', wanted 7: none"),
    (SLIDES, (None, "b7"), "joint 'h1' on the path is slide"),
    (tower(1, joint="<freejoint/>"), (None, "b1"), "joint 'joint_0' on the path is free"),
]  # fmt: skip


def test_refusals_name_what_is_wrong(mujoco, tmp_path):
    """`read_mjcf` refuses wrong ends, chains, joints and files, and says what is wrong."""
    assert not_refused([
        *((ModelError, f"^XML text: .*{re.escape(said)}", lambda world=world,
          ends=ends: read_mjcf(model_of(world), *ends))
          for world, ends, said in REFUSED),
        (ModelError, r"nowhere\.xml: no such file", lambda: read_mjcf(tmp_path / "nowhere.xml")),
        (ModelError, "mujoco refuses it: ", lambda: read_mjcf("<mujoco><nonsense/></mujoco>")),
    ]) == []  # fmt: skip
    path = tmp_path / "arm.xml"
    path.write_text(model_of(tower(7)))
    assert read_mjcf(path).source == str(path)


@pytest.mark.parametrize(
    ("partner", "said"), [('joint2="h1"', "is coupled to joint 'h1'"), ("", "is held still by an equality")]
)
def test_a_joint_is_bound_by_an_equality_that_is_switched_on(mujoco, partner, said):
    """`read_mjcf` refuses a joint that an active equality binds."""

    def text(active):
        """The model with the equality active or not."""
        rest = f'<equality><joint joint1="h3" {partner} active="{active}"/></equality>'
        return model_of(tower(7), rest)

    for ends in ((None, None), (None, "b7"), ("world", "b7")):
        with pytest.raises(ModelError, match=f"joint 'h3' (on the path )?{said}"):
            read_mjcf(text("true"), *ends)
        assert read_mjcf(text("false"), *ends).notes == ()


ARM = tower(7, '<site name="tip"/>', '<joint name="h{}" axis="0 0 1" range="-2 2" limited="true"/>')


SERVO = '<actuator><{} joint="h4" {} ctrllimited="true" ctrlrange="-{} {}"/></actuator>'
AFFINE = 'biastype="affine" gainprm="6" biasprm="0 -3 0" gear="2"'
BOUND = {
    '<equality><connect body1="b5" body2="b2" anchor="0 0 0"/></equality>': ["h3", "h4", "h5"],
    '<equality><weld site1="tip" site2="low"/></equality>': [f"h{i}" for i in range(3, 8)],
    '<equality><weld body1="b5" body2="b2" active="false"/></equality>': [],
    SERVO.format("position", 'kp="9"', 1, 1): ["h4"], SERVO.format("position", 'kp="9"', 2, 2): [],
    SERVO.format("motor", "", 1, 1): [], SERVO.format("general", AFFINE, 1, 1): ["h4"],
}  # fmt: skip


def test_what_bounds_joints_in_another_part_is_noted_once(mujoco):
    """`read_mjcf` notes equalities, servos and tendons that bound the arm's joints, once each."""
    low = ARM.replace('<body name="b3">', '<site name="low"/><body name="b3">')
    for rest, bound in BOUND.items():
        notes = read_mjcf(model_of(low, rest), tip="tip").notes
        named = [name for name in (f"h{i}" for i in range(1, 8)) if any(repr(name) in n for n in notes)]
        assert len(notes) == bool(bound) and named == bound, rest
    for limited in ("true", "false"):  # a tendon
        rest = (
            f'<tendon><fixed limited="{limited}" range="-1 1"><joint joint="h2" coef="1"/></fixed></tendon>'
        )
        notes = read_mjcf(model_of(ARM, rest), tip="tip").notes
        assert ["tendon" in note for note in notes] == [True] * (limited == "true")


def test_limits_that_are_switched_off_are_noted(mujoco):
    """`read_mjcf` gives infinite limits if `limited` is false, and notes the joints."""
    text = model_of(ARM.replace('limited="true"', 'limited="false"', 2))
    chain = read_mjcf(text, tip="tip")
    assert [joint.upper for joint in chain.joints] == [np.inf] * 2 + [2.0] * 5
    (note,) = chain.notes
    assert "h1, h2" in note and "h3" not in note


PLUGINS = {
    "actuators, each with its own": (
        '<extension><plugin plugin="mujoco.pid"/></extension>',
        "<actuator>" + "".join(
            f'<plugin plugin="mujoco.pid" joint="h{i}"><config key="kp" value="5"/></plugin>'
            for i in range(1, 8)
        ) + "</actuator>",
    ),
    "actuators of one instance": (
        '<extension><plugin plugin="mujoco.pid"><instance name="i"><config key="kp" value="5"/></instance>'
        "</plugin></extension>",
        '<actuator><plugin plugin="mujoco.pid" joint="h1" instance="i"/></actuator>',
    ),
    "a sensor": (
        '<extension><plugin plugin="mujoco.sensor.touch_grid"/></extension>',
        '<sensor><plugin plugin="mujoco.sensor.touch_grid" objtype="site" objname="tip">'
        '<config key="size" value="7 7"/><config key="fov" value="45 45"/></plugin></sensor>',
    ),
    "a geom": (
        '<extension><plugin plugin="mujoco.sdf.torus"><instance name="i"><config key="radius1" value=".4"/>'
        '<config key="radius2" value=".1"/></instance></plugin></extension><asset><mesh name="m">'
        '<plugin instance="i"/></mesh></asset>',
        "",
    ),
}  # fmt: skip
SDF = '<geom type="sdf" mesh="m"><plugin instance="i"/></geom>'


def test_models_with_plugins_are_read_in_a_process_that_lives_on(mujoco, tmp_path):
    """`read_mjcf` of models with plugins does not crash its process."""
    for kind, (before, after) in PLUGINS.items():
        text = model_of(ARM + (SDF if kind == "a geom" else ""), after)
        (tmp_path / f"{kind}.xml").write_text(text.replace("<worldbody>", before + "<worldbody>"))
    paths = [str(tmp_path / f"{kind}.xml") for kind in PLUGINS]
    code = (
        "from armangle.models.mjcf import MjcfModel; "
        f"print(*(len(MjcfModel(path).chain(tip='tip').joints) for path in {paths!r}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.split()) == (0, ["7"] * len(paths)), done.stderr


def test_arms_that_are_attached_are_read(mujoco, tmp_path):
    """`read_mjcf` of attached models has MuJoCo's own poses."""
    rng = np.random.default_rng(3)
    one = mjcf_of(RandomArm(rng), rng).replace(INERTIA, '<geom size=".01"/>')
    (tmp_path / "one.xml").write_text(one.replace("<worldbody>", '<worldbody><body name="foot">').replace(
        "</worldbody>", "</body></worldbody>"))  # fmt: skip
    pair = model_of(
        '<frame pos="0 1 0"><attach model="one" body="foot" prefix="l_"/></frame>'
        '<frame euler="0 0 1"><attach model="one" body="foot" prefix="r_"/></frame>'
    ).replace("<worldbody>", '<asset><model name="one" file="one.xml"/></asset><worldbody>')
    path = tmp_path / "pair.xml"
    path.write_text(pair)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    q = rng.uniform(-1, 1, 7)
    data.qpos[:] = np.tile(q, 2)
    mujoco.mj_kinematics(model, data)
    for side in "lr":
        own = data.site(f"{side}_tip")
        found = read_mjcf(path, "world", f"{side}_tip").forward(q)
        np.testing.assert_allclose(found[:3, 3], own.xpos, rtol=0, atol=EXACT)
        np.testing.assert_allclose(found[:3, :3], own.xmat.reshape(3, 3), rtol=0, atol=EXACT)
