"""What is said of orientations that are none, and of arrays that are no poses but look like something."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
POSE, PSI, GC = ARM.forward(Q)
UNIT = [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"wxyz": UNIT, "rpy": [0, 0, 0]}, aa.InputError, "wxyz and rpy are given, wanted one orientation"),
        (
            {"wxyz": [UNIT, [1, 1, 0, 0]]},
            aa.InputError,
            "wxyz[1] has length 1.41421356, wanted a unit quaternion w x y z within 1e-06",
        ),
        ({"xyzw": [0, 0, 0, 0]}, aa.InputError, "xyzw has length 0, wanted a unit quaternion x y z w"),
        ({"wxyz": [1 + 2e-6, 0, 0, 0]}, aa.InputError, "wxyz has length 1.000002"),
        ({"xyzw": [0, 0, 1]}, aa.InputError, "xyzw has shape (3,), wanted (..., 4): a unit quaternion, the "
                                            "real part last"),
        ({"rpy": UNIT}, aa.InputError, "rpy has shape (4,), wanted (..., 3): roll pitch yaw, rad"),
        ({"rotvec": 1.0}, aa.InputError, "rotvec has shape (), wanted (..., 3): an axis times the angle"),
        ({"rpy": [0, np.nan, 0]}, aa.InputError, "rpy holds nan, wanted finite angles in rad"),
        ({"rotvec": [0, 0, 1e7]}, aa.InputError, "rotvec turns by 1e+07. Angles are in rad: were these"),
        ({"wxyz": [np.inf, 0, 0, 0]}, aa.InputError, "wxyz holds inf, wanted finite numbers"),
        ({"matrix": 2 * np.eye(3)}, aa.InputError, "the rotation of matrix is not orthonormal"),
        ({"matrix": np.eye(4)}, aa.InputError, "matrix has shape (4, 4), wanted (..., 3, 3)"),
        ({"matrix": -np.eye(3)}, aa.InputError, "the rotation of matrix is a reflection"),
        ({"rpy": np.zeros((2, 3))}, aa.InputError, "do not broadcast: xyz (3,), the orientation (2,)"),
    ],
)  # fmt: skip
def test_an_orientation_that_is_none_is_named(given: Any, error: type[Exception], message: str) -> None:
    xyz = np.zeros((3, 3)) if "broadcast" in message else [0.0, 0.0, 0.0]
    with pytest.raises(error, match=re.escape(message)):
        aa.pose(xyz, **given)


@pytest.mark.parametrize("given", [{"quat": UNIT}, {"euler": [0, 0, 0]}, {"R": np.eye(3)}])
def test_an_orientation_is_given_by_its_convention(given: Any) -> None:
    (name,) = given
    with pytest.raises(
        aa.InputError, match=rf"given {name}=, wanted by its convention: wxyz= \(a quaternion"
    ):
        aa.pose([0, 0, 0], **given)
    with pytest.raises(aa.InputError, match=r"given without a name, wanted by its convention: .*xyzw="):
        aa.pose([0, 0, 0], given[name])


def test_a_place_that_is_none_is_named() -> None:
    with pytest.raises(aa.InputError, match=re.escape("xyz has shape (4,), wanted (..., 3): positions, m")):
        aa.pose([0, 0, 0, 1])
    with pytest.raises(aa.InputError, match=re.escape("xyz[1, 2] is nan, wanted finite numbers in m")):
        aa.pose([[0, 0, 0], [0, 0, np.nan]])


@pytest.mark.parametrize(
    ("array", "advice"),
    [
        (np.zeros((5, 7)), "pose(pose[..., :3], wxyz=pose[..., 3:]) where the real part is first"),
        (np.zeros(6), "pose(pose[..., :3], rpy=pose[..., 3:]) for roll pitch yaw"),
        (POSE[:3], "armangle.pose(pose[..., 3], matrix=pose[..., :3])"),
        (POSE[:3, :3], "armangle.pose([x, y, z], matrix=pose)"),
        (np.zeros(3), "a position without an orientation; armangle.pose(pose)"),
    ],
)
def test_an_array_that_is_no_pose_is_told_what_it_looks_like(array: Any, advice: str) -> None:
    tracker = aa.Tracker(ARM, 0.01)
    tracker.start(Q)
    for call in (
        lambda: ARM.inverse(array, PSI, GC, limits=False),
        lambda: ARM.inverse(array, PSI, limits=False),
        lambda: ARM.feasible(array, GC),
        lambda: ARM.feasible(array),
        lambda: ARM.feasible(array, GC, per_joint=True),
        lambda: aa.gradients.joint_function(ARM, array, GC, 1),
        lambda: ARM.self_motion(array, PSI, GC),
        lambda: ARM.explain(array),
        lambda: aa.nearest_rotation(array),
        lambda: aa.resolve(ARM, array, PSI, GC),
        lambda: aa.step(ARM, Q, array),
        lambda: tracker.step(array),
    ):
        with pytest.raises(aa.InputError, match=re.escape(advice)):
            call()


def test_the_advice_names_the_argument_and_is_right() -> None:
    rows = np.concatenate([POSE[:3, 3], UNIT])[None]
    with pytest.raises(aa.InputError, match=re.escape("armangle.pose(poses[..., :3], wxyz=poses[..., 3:])")):
        aa.follow(ARM, rows, start=Q)
    with pytest.raises(aa.InputError, match=re.escape("armangle.pose(path[..., :3], wxyz=path[..., 3:])")):
        aa.plan(ARM, rows)
    assert aa.pose(rows[..., :3], wxyz=rows[..., 3:]).shape == (1, 4, 4)
    assert (aa.pose(POSE[:3][..., 3], matrix=POSE[:3][..., :3]) == POSE).all()


# -- arrays of other libraries that hold no numbers here ----------------------------------------------


def fake(module: str, name: str, **attributes: Any) -> Any:
    """An object whose class is of `module`, and that NumPy cannot read."""

    def refuse(self: Any, dtype: Any = None, copy: Any = None) -> Any:
        raise RuntimeError("no numbers here")

    return type(name, (), {"__module__": module, "__array__": refuse, **attributes})()


def test_masked_elements_are_refused() -> None:
    pose, psi, gc = ARM.forward(Q)
    masked = np.ma.masked_greater(np.stack([pose, pose]), 0.9)
    joints = np.ma.array(Q, mask=np.arange(7) == 2)
    for call in (
        lambda: ARM.inverse(masked, psi, gc, limits=False),
        lambda: ARM.inverse(masked[0], psi, gc, limits=False),
        lambda: ARM.solve(pose, seed=joints),
        lambda: ARM.forward(joints),
        lambda: aa.step(ARM, joints, pose),
    ):
        with pytest.raises(aa.InputError, match="has masked elements"):
            call()
    assert np.array_equal(ARM.forward(np.ma.array(Q))[0], pose)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (fake("torch", "Tensor", requires_grad=True, device="cpu"),
         "pose is a tensor with gradients, wanted numbers in memory: pose.detach(), or armangle.torch.Kine"),
        (fake("torch", "Tensor", requires_grad=False, device="cuda:0"),
         "pose is a tensor on cuda:0, wanted numbers in memory: pose.cpu()"),
        (fake("torch.nn.parameter", "Parameter", requires_grad=True, device="cuda:0"),
         "pose is a tensor on cuda:0, wanted numbers in memory: pose.detach().cpu(), or armangle.torch.Kine"),
        (fake("jax._src.interpreters.partial_eval", "DynamicJaxprTracer"),
         "pose is a JAX tracer, wanted numbers in memory: armangle.jax.Kinematics(arm) works inside jit"),
        (fake("cupy", "ndarray"), "pose is an array on a GPU, wanted numbers in memory: pose.get()"),
        (fake("elsewhere", "Thing"), "pose is not an array of real numbers, wanted shape (..., 4, 4)"),
    ],
)  # fmt: skip
def test_an_array_without_numbers_in_memory_is_told_how_to_get_them(value: Any, message: str) -> None:
    for call in (
        lambda: ARM.inverse(value, PSI, GC, limits=False),
        lambda: ARM.feasible(value, GC),
        lambda: aa.step(ARM, Q, value),
    ):
        with pytest.raises(aa.InputError, match=re.escape(message)):
            call()
    with pytest.raises(aa.InputError, match=re.escape(message.replace("pose", "q").replace("4, 4", "7"))):
        ARM.forward(value)
