"""What is said of orientations that are none, and of arrays that are no poses but look like something."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support.refused import Row, not_refused

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
POSE, PSI, GC = ARM.forward(Q)
UNIT = [1.0, 0.0, 0.0, 0.0]


ORIENTATIONS: list[tuple[dict[str, Any], str]] = [
    ({"wxyz": UNIT, "rpy": [0, 0, 0]}, "wxyz and rpy"),
    ({"wxyz": [UNIT, [1, 1, 0, 0]]}, "wxyz[1] has length 1.41421356"),
    ({"xyzw": [0, 0, 0, 0]}, "xyzw has length 0"),
    ({"wxyz": [1 + 2e-6, 0, 0, 0]}, "wxyz has length 1.000002"),
    ({"xyzw": [0, 0, 1]}, "xyzw has shape (3,), wanted (..., 4)"),
    ({"rpy": UNIT}, "rpy has shape (4,), wanted (..., 3)"),
    ({"rotvec": 1.0}, "rotvec has shape (), wanted (..., 3)"), ({"rpy": [0, np.nan, 0]}, "rpy holds nan"),
    *(({"rpy": value}, f"rpy holds {holds}. Angles are in rad: were these")
      for value, holds in (([180.0, 0.0, 0.0], 180), ([[0.0, 0.0, 0.1], [0.0, -90.0, 0.0]], -90))),
    *(({"rotvec": value}, "rotvec turns by 90. Angles are in rad: were these")
      for value in ([0.0, 0.0, 90.0], [[0.0, 0.0, 0.1], [54.0, 72.0, 0.0]])),
    *(({"xyz": np.zeros(shape)}, words) for shape, words in (
        ((7,), "pose(xyz[..., :3], wxyz=xyz"), ((5, 6), "pose(xyz[..., :3], rpy=xyz"),
        ((4, 4), "a pose already"))),
    ({"rotvec": [0, 0, 1e7]}, "rotvec turns by 1e+07"), ({"wxyz": [np.inf, 0, 0, 0]}, "wxyz holds inf"),
    ({"matrix": 2 * np.eye(3)}, "rotation of matrix is not orthonormal"),
    ({"matrix": np.eye(4)}, "matrix has shape (4, 4), wanted (..., 3, 3)"),
    ({"matrix": -np.eye(3)}, "rotation of matrix is a reflection"),
    ({"xyz": np.zeros((3, 3)), "rpy": np.zeros((2, 3))}, "xyz (3,), the orientation (2,)"),
    ({"xyz": [0, 0, 0, 1]}, "xyz has shape (4,), wanted (..., 3)"),
    ({"xyz": [[0, 0, 0], [0, 0, np.nan]]}, "xyz[1, 2] is nan"),
    *(({name: UNIT}, f"given {name}=") for name in ("quat", "euler", "R")),
    ({"unnamed": UNIT}, "given unnamed="),
]  # fmt: skip


def test_an_orientation_that_is_none_is_named() -> None:
    """`pose` refuses bad positions and orientations with the argument's name, and takes several turns."""
    rows: list[Row] = []
    for given, message in ORIENTATIONS:
        arguments = {"xyz": [0.0, 0.0, 0.0], **given}
        rows.append((aa.InputError, re.escape(message), lambda arguments=arguments: aa.pose(**arguments)))
    rows += [(aa.InputError, "given without a name", lambda: aa.pose([0, 0, 0], UNIT))]
    rows += [(aa.InputError, r"as arm.forward returns \(pose, psi, gc\)", lambda: ARM.solve(ARM.forward(Q)))]
    assert not_refused(rows) == []
    aa.pose([0, 0, 0], rpy=[0.0, 0.0, 8 * np.pi])
    aa.pose([0, 0, 0], rotvec=[9.0, 0.0, 0.0])


LIKE_POSES: list[tuple[Any, str]] = [
    (np.zeros((5, 7)), "pose(pose[..., :3], wxyz=pose[..., 3:])"),
    (np.zeros(6), "pose(pose[..., :3], rpy=pose[..., 3:])"),
    (POSE[:3], "armangle.pose(pose[..., 3], matrix=pose[..., :3])"),
    (POSE[:3, :3], "armangle.pose([x, y, z], matrix=pose)"), (np.zeros(3), "armangle.pose(pose)"),
]  # fmt: skip


def asked(array: Any) -> tuple[Callable[[], Any], ...]:
    """Calls of every kind with an array that is no pose."""
    tracker = aa.Tracker(ARM, 0.01)
    tracker.start(Q)
    return (
        lambda: ARM.inverse(array, PSI, GC, limits=False), lambda: ARM.inverse(array, PSI, limits=False),
        lambda: ARM.feasible(array, GC), lambda: ARM.feasible(array),
        lambda: ARM.feasible(array, GC, per_joint=True), lambda: ARM.self_motion(array, PSI, GC),
        lambda: aa.gradients.joint_function(ARM, array, GC, 1), lambda: ARM.explain(array),
        lambda: aa.nearest_rotation(array), lambda: aa.resolve(ARM, array, PSI, GC),
        lambda: aa.step(ARM, Q, array), lambda: tracker.step(array),
    )  # fmt: skip


def test_an_array_that_is_no_pose_is_told_what_it_looks_like() -> None:
    """Arrays that look like positions, rows or matrices are refused with the call that makes poses."""
    for array, advice in LIKE_POSES:
        assert not_refused((aa.InputError, re.escape(advice), call) for call in asked(array)) == []


def test_the_advice_names_the_argument_and_is_right() -> None:
    """`follow` and `plan` refuse rows of position and quaternion with the call that makes poses,
    which works.
    """
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
    """Masked arrays are refused if an element is masked."""
    pose, psi, gc = ARM.forward(Q)
    masked = np.ma.masked_greater(np.stack([pose, pose]), 0.9)
    joints = np.ma.array(Q, mask=np.arange(7) == 2)
    calls: list[Callable[[], Any]] = [
        lambda: ARM.inverse(masked, psi, gc, limits=False), lambda: ARM.solve(pose, seed=joints),
        lambda: ARM.inverse(masked[0], psi, gc, limits=False), lambda: ARM.forward(joints),
        lambda: aa.step(ARM, joints, pose),
    ]  # fmt: skip
    assert not_refused((aa.InputError, "has masked elements", call) for call in calls) == []
    assert np.array_equal(ARM.forward(np.ma.array(Q))[0], pose)


ELSEWHERE = [
    (fake("torch", "Tensor", requires_grad=True, device="cpu"), "pose.detach(), or armangle.torch.Kine"),
    (fake("torch", "Tensor", requires_grad=False, device="cuda:0"),
     "cuda:0, wanted numbers in memory: pose.cpu()"),
    (fake("torch.nn.parameter", "Parameter", requires_grad=True, device="cuda:0"),
     "pose.detach().cpu(), or arm"),
    (fake("jax._src.interpreters.partial_eval", "DynamicJaxprTracer"), "armangle.jax.Kinematics(arm)"),
    (fake("cupy", "ndarray"), "pose.get()"), (fake("elsewhere", "Thing"), "wanted shape (..., 4, 4)"),
]  # fmt: skip


def test_an_array_without_numbers_in_memory_is_told_how_to_get_them() -> None:
    """Arrays of torch, jax and cupy without numbers in memory are refused with what gives them."""
    for value, message in ELSEWHERE:
        calls = (
            lambda value=value: ARM.inverse(value, PSI, GC, limits=False),
            lambda value=value: ARM.feasible(value, GC), lambda value=value: aa.step(ARM, Q, value),
        )  # fmt: skip
        rows: list[Row] = [(aa.InputError, f"^pose is .*{re.escape(message)}", call) for call in calls]
        ours = re.escape(message.replace("pose", "q").replace("4, 4", "7"))
        assert (
            not_refused([*rows, (aa.InputError, f"^q is .*{ours}", lambda value=value: ARM.forward(value))])
            == []
        )
