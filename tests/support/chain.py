"""Plain chains for the import tests: own forward kinematics, own URDF texts.

No kinematics here comes from the package: two ways to one pose that do not share a line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from armangle.models.chain import Chain, Joint

Array = NDArray[np.float64]

ALPHAS = np.array([-1, 1, 1, -1, -1, 1, 0]) * np.pi / 2


def turn(axis: Array, angle: float) -> Array:
    """Return the homogeneous rotation (4, 4) about a unit axis by Rodrigues' formula."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = (float(v) for v in axis)
    k = 1 - c
    return np.array([
        [c + k * x * x, k * x * y - s * z, k * x * z + s * y, 0],
        [k * x * y + s * z, c + k * y * y, k * y * z - s * x, 0],
        [k * x * z - s * y, k * y * z + s * x, c + k * z * z, 0],
        [0, 0, 0, 1],
    ])  # fmt: skip


def shift(x: float, y: float, z: float) -> Array:
    """Return a homogeneous translation (m)."""
    frame = np.eye(4)
    frame[:3, 3] = x, y, z
    return frame


def frame_from(origin: ElementTree.Element | None) -> Array:
    """Return the frame (4, 4) of an ``<origin>``, the identity of None."""
    if origin is None:
        return np.eye(4)
    xyz = [float(v) for v in origin.get("xyz", "0 0 0").split()]
    roll, pitch, yaw = (float(v) for v in origin.get("rpy", "0 0 0").split())
    ex, ey, ez = np.eye(3)
    return shift(*xyz) @ turn(ez, yaw) @ turn(ey, pitch) @ turn(ex, roll)


def urdf_forward(text: str, tip: str, q: dict[str, float]) -> Array:
    """Return the pose of a link in its root link at joints by name, by multiplying the joints of the file."""
    joints = {j.find("child").get("link"): j for j in ElementTree.fromstring(text).iter("joint")}
    pose = np.eye(4)
    while tip in joints:
        joint = joints[tip]
        step = frame_from(joint.find("origin"))
        if joint.get("type") != "fixed":
            element = joint.find("axis")
            axis = np.array([float(v) for v in element.get("xyz").split()])
            step = step @ turn(axis / np.linalg.norm(axis), q[joint.get("name")])
        pose = step @ pose
        tip = joint.find("parent").get("link")
    return pose


def dh_forward(arm: Any, q: Array) -> Array:
    """Return base * DH(s q + o) * tool of an object with the fields of a description."""
    pose = np.array(arm.base)
    a = (0, 0, arm.a_3, arm.a_4, 0, 0, 0)
    d = (arm.d_bs, 0, arm.d_se, arm.d_4, arm.d_ew, 0, arm.d_wf)
    for i in range(7):
        theta = arm.signs[i] * q[i] + arm.offsets[i]
        pose = pose @ turn(np.eye(3)[2], theta) @ shift(a[i], 0, d[i])
        pose = pose @ turn(np.eye(3)[0], ALPHAS[i])
    return pose @ arm.tool


def pose_error(one: Array, other: Array) -> tuple[float, float]:
    """Return the distance (m) and the angle (rad) between two poses."""
    chord = np.linalg.norm(one[:3, :3] - other[:3, :3]) / np.sqrt(8)
    return float(np.linalg.norm(one[:3, 3] - other[:3, 3])), float(2 * np.arcsin(min(chord, 1)))


def random_frame(rng: np.random.Generator, size: float = 1.0, right_angles: bool = False) -> Array:
    """Return a random frame; with ``right_angles`` its rotation is a product of quarter rotations."""
    frame = shift(*rng.uniform(-size, size, 3))
    if right_angles:
        for axis in rng.permutation(np.eye(3)):
            frame = frame @ turn(axis, rng.integers(4) * np.pi / 2)
        return frame
    axis = rng.normal(size=3)
    return frame @ turn(axis / np.linalg.norm(axis), rng.uniform(-np.pi, np.pi))


def rpy(frame: Array) -> tuple[float, float, float]:
    """Return roll, pitch, yaw (rad) of a frame."""
    r = frame[:3, :3]
    reach = np.hypot(r[0, 0], r[1, 0])
    if reach < 1e-7:
        return 0.0, float(np.arctan2(-r[2, 0], reach)), float(np.arctan2(-r[0, 1], r[1, 1]))
    roll, yaw = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(r[1, 0], r[0, 0])
    return float(roll), float(np.arctan2(-r[2, 0], reach)), float(yaw)


@dataclass
class RandomArm:
    """An S-R-S arm with random lengths, signs, zeros and frames."""

    rng: np.random.Generator
    elbow_offset: bool = False
    right_angles: bool = False
    d_bs: float = 0.0
    d_se: float = 0.0
    d_ew: float = 0.0
    d_wf: float = 0.0
    a_3: float = 0.0
    a_4: float = 0.0
    d_4: float = 0.0
    signs: Array = field(default_factory=lambda: np.ones(7))
    offsets: Array = field(default_factory=lambda: np.zeros(7))
    base: Array = field(default_factory=lambda: np.eye(4))
    tool: Array = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        rng = self.rng
        self.d_bs, self.d_wf = rng.choice([-1, 0, 1], 2) * rng.uniform(0.05, 0.5, 2)
        self.d_se, self.d_ew = rng.choice([-1, 1], 2) * rng.uniform(0.1, 0.6, 2)
        if self.elbow_offset:
            self.a_3, self.a_4 = rng.uniform(-0.1, 0.1, 2)
        self.signs = rng.choice([-1.0, 1.0], 7)
        quarters = rng.integers(-2, 3, 7) * np.pi / 2
        self.offsets = quarters if self.right_angles else rng.uniform(-np.pi, np.pi, 7)
        self.base = random_frame(rng, 0.5, self.right_angles)
        self.tool = random_frame(rng, 0.2, self.right_angles)

    def axes(self) -> tuple[list[Array], list[Array]]:
        """Return a point and the direction of each joint axis at q = 0."""
        points, directions = [], []
        pose = np.array(self.base)
        a = (0, 0, self.a_3, self.a_4, 0, 0, 0)
        d = (self.d_bs, 0, self.d_se, self.d_4, self.d_ew, 0, self.d_wf)
        for i in range(7):
            points.append(pose[:3, 3])
            directions.append(self.signs[i] * pose[:3, 2])
            pose = pose @ turn(np.eye(3)[2], self.offsets[i]) @ shift(a[i], 0, d[i])
            pose = pose @ turn(np.eye(3)[0], ALPHAS[i])
        return points, directions


def urdf_of(arm: Any, rng: np.random.Generator, clutter: bool = True) -> str:
    """Return a URDF of a :class:`RandomArm` in random frames: ``root`` to ``tip``.

    Joint origins slide along their axes, link frames are turned at random, axes are not unit,
    fixed joints may come between; with `clutter` a finger hangs on the tip and another joint on the root.
    """
    points, directions = arm.axes()
    tip = dh_forward(arm, np.zeros(7))
    text = ['<robot name="random">', '<link name="root"/>']
    parent, parent_frame = "root", np.eye(4)

    def add(name: str, kind: str, frame: Array, inside: str = "") -> None:
        """Append a link and the joint that carries it, at a frame in the root."""
        nonlocal parent, parent_frame
        step = np.linalg.inv(parent_frame) @ frame
        numbers = (" ".join(repr(float(v)) for v in values) for values in (step[:3, 3], rpy(step)))
        text.append(
            f'<link name="{name}"/><joint name="to_{name}" type="{kind}"><parent link="{parent}"/>'
            f'<child link="{name}"/><origin xyz="{next(numbers)}" rpy="{next(numbers)}"/>'
            f"{inside}</joint>"
        )
        parent, parent_frame = name, frame

    for i in range(7):
        if rng.random() < 0.3:
            add(f"spacer_{i}", "fixed", random_frame(rng, 0.5, arm.right_angles))
        frame = random_frame(rng, 0.3, arm.right_angles)
        frame[:3, 3] = points[i] + rng.uniform(-0.5, 0.5) * directions[i]
        axis = rng.uniform(0.5, 2.0) * frame[:3, :3].T @ directions[i]
        inside = '<axis xyz="{!r} {!r} {!r}"/>'.format(*map(float, axis))
        inside += f'<limit lower="-{i + 1}" upper="{i + 2}" velocity="{i + 1}" effort="9"/>'
        add(f"l{i}", rng.choice(["revolute", "continuous"]), frame, inside)
    add("tip", "fixed", tip)
    if clutter:
        add("finger", "prismatic", random_frame(rng), '<limit lower="0" upper="not a number"/>')
        parent, parent_frame = "root", np.eye(4)
        add("other", "revolute", random_frame(rng))
    return "\n".join([*text, "</robot>"])


def simple_urdf(joints: str = "", count: int = 7, links: str = "", **change: str) -> str:
    """Return the URDF of a straight chain l0 .. l<count>, with the XML `links` and `joints` at its end.
    `change` gives the whole XML of some of its joints j1 .. j<count>.
    """
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


def joint_xml(name: str, parent: str, child: str, kind: str = "revolute", inside: str = "") -> str:
    """Return the XML of a joint."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'
    )


LIMIT = '<limit lower="-1" upper="2"/>'


def broken_chain(joint: int, frame, seed: int = 0) -> Chain:
    """Return the chain of a simple arm in which joint `joint` (from 0) and all after it are moved by a frame,
    given in the joint before.
    """
    made = RandomArm(np.random.default_rng(seed), right_angles=True)
    made.base, made.tool, made.offsets = np.eye(4), np.eye(4), np.zeros(7)
    made.d_bs, made.d_se, made.d_ew, made.d_wf = 0.3, 0.4, 0.4, 0.1
    made.signs = np.ones(7)
    points, directions = made.axes()
    joints, last = [], np.eye(4)
    for i in range(7):
        here = shift(*points[i])
        origin = np.linalg.inv(last) @ here
        joints.append(Joint(f"j{i}", frame @ origin if i == joint else origin, directions[i]))
        last = here
    return Chain("broken", "a", "b", tuple(joints), shift(0, 0, 0.1))
