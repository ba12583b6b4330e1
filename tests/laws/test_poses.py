"""Laws of poses made of positions and orientations, and of poses that other libraries make."""

from __future__ import annotations

import contextlib
import importlib
import operator
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import armangle as aa

N = 500
TIGHT: dict[str, Any] = {"rtol": 0, "atol": 4e-15}


def unit(rng: np.random.Generator, *shape: int) -> np.ndarray[Any, Any]:
    """Random unit vectors along the last axis of `shape`."""
    x = rng.normal(size=shape)
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def test_every_pose_is_a_rigid_transform_at_its_place() -> None:
    """`aa.pose` gives rigid transforms at xyz for every form of orientation."""
    rng = np.random.default_rng(1)
    xyz, quaternion, angles = rng.normal(size=(N, 3)), unit(rng, N, 4), rng.uniform(-9, 9, (N, 3))
    vectors = 0.8 * angles  # at most two turns long
    for given in ({"wxyz": quaternion}, {"xyzw": quaternion}, {"rpy": angles}, {"rotvec": vectors}, {}):
        poses = aa.pose(xyz, **given)
        r = poses[:, :3, :3]
        assert_allclose(r.swapaxes(1, 2) @ r, np.broadcast_to(np.eye(3), r.shape), **TIGHT)
        assert (np.linalg.det(r) > 0).all()
        assert (poses[:, :3, 3] == xyz).all()
        assert (poses[:, 3] == (0, 0, 0, 1)).all()


def test_the_real_part_is_where_the_name_says_and_both_signs_are_one_rotation() -> None:
    """`aa.pose` reads wxyz and xyzw in their order, and -q as q."""
    q = unit(np.random.default_rng(2), N, 4)
    one = aa.pose(np.zeros(3), wxyz=q)
    assert (one == aa.pose(np.zeros(3), xyzw=q[:, [1, 2, 3, 0]])).all()
    assert (one == aa.pose(np.zeros(3), wxyz=-q)).all()


def product(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Hamilton's product of quaternions (n, 4), the real parts first."""
    v, w = a[:, 1:], b[:, 1:]
    real = a[:, 0] * b[:, 0] - (v * w).sum(axis=1)
    rest = a[:, :1] * w + b[:, :1] * v + np.cross(v, w)
    return np.column_stack([real, rest])


def test_the_product_of_quaternions_is_the_product_of_their_rotations() -> None:
    """The rotation of a product of quaternions is the product of their rotations."""
    rng = np.random.default_rng(3)
    a, b = unit(rng, N, 4), unit(rng, N, 4)
    both = aa.pose(np.zeros(3), wxyz=a) @ aa.pose(np.zeros(3), wxyz=b)
    assert_allclose(aa.pose(np.zeros(3), wxyz=product(a, b)), both, **TIGHT)


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-12, 1e-8, 1e-3, 1.0, np.pi, 12.0])
def test_a_rotation_vector_keeps_its_axis_and_turns_by_its_length(size: float) -> None:
    """`aa.pose(rotvec=)` keeps the vector, and equals the quaternion of that angle."""
    rng = np.random.default_rng(4)
    axis = unit(rng, N, 3)
    turn = aa.pose(np.zeros(3), rotvec=size * axis)[:, :3, :3]
    assert_allclose((turn @ axis[..., None])[..., 0], axis, **TIGHT)
    half = 0.5 * size
    quaternion = np.column_stack([np.full(N, np.cos(half)), np.sin(half) * axis])
    assert_allclose(turn, aa.pose(np.zeros(3), wxyz=quaternion)[:, :3, :3], rtol=0, atol=1e-15 * (4 + size))


def test_roll_pitch_yaw_are_turns_about_fixed_axes_x_then_y_then_z() -> None:
    rpy = np.random.default_rng(5).uniform(-4, 4, (N, 3))
    turn = [aa.pose(np.zeros(3), rotvec=rpy[:, [i]] * np.eye(3)[i]) for i in range(3)]
    assert_allclose(aa.pose(np.zeros(3), rpy=rpy), turn[2] @ turn[1] @ turn[0], **TIGHT)
    # a turn about z last is a turn of everything: its axis stays the frame's own z of the world
    assert_allclose(
        aa.pose([0, 0, 0], rpy=[np.pi / 2, 0, np.pi / 2])[:3, :3], [[0, 0, 1], [1, 0, 0], [0, 1, 0]], **TIGHT
    )


def test_batches_broadcast_and_an_element_does_not_depend_on_its_batch() -> None:
    """`aa.pose` broadcasts positions and orientations, and equals single calls."""
    rng = np.random.default_rng(6)
    xyz, rpy = rng.normal(size=(5, 1, 3)), rng.normal(size=(4, 3))
    poses = aa.pose(xyz, rpy=rpy)
    assert poses.shape == (5, 4, 4, 4)
    for i in range(5):
        for j in range(4):
            assert (poses[i, j] == aa.pose(xyz[i, 0], rpy=rpy[j])).all()
    assert aa.pose(np.empty((0, 3))).shape == (0, 4, 4)
    assert (aa.pose([1, 2, 3], matrix=np.eye(3)) == aa.pose([1, 2, 3])).all()


def test_pinocchio_reads_the_same_rotations() -> None:
    """Pinocchio's rotations by quaternion, roll-pitch-yaw and vector equal those of `aa.pose`."""
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(7)
    for q, rpy, v in zip(unit(rng, 50, 4), rng.normal(size=(50, 3)), rng.normal(size=(50, 3)), strict=True):
        assert_allclose(aa.pose(v, xyzw=q), pin.XYZQUATToSE3(np.r_[v, q]).homogeneous, **TIGHT)
        assert_allclose(aa.pose(v, rpy=rpy)[:3, :3], pin.rpy.rpyToMatrix(rpy), **TIGHT)
        assert_allclose(aa.pose(v, rotvec=rpy)[:3, :3], pin.exp3(rpy), **TIGHT)


# -- poses that other libraries make -----------------------------------------------------------------


def holder(name: str, matrix: np.ndarray[Any, Any], called: bool = False) -> Any:
    """An object of another library that holds a pose under a name of its own."""
    held = (lambda self, dtype=None, copy=None: matrix) if called else matrix
    return type("Foreign", (), {name: held})()


KINDS = [("homogeneous", False), ("as_matrix", True), ("A", False), ("__array__", True)]
"""As pinocchio.SE3, RigidTransform of scipy, spatialmath.SE3, and what NumPy reads by itself."""
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
POSE, PSI, GC = ARM.forward(Q)


def outcomes(pose: Any) -> list[Any]:
    """The results of every function that takes a pose."""
    resolved, stepped = aa.resolve(ARM, pose, PSI, GC), aa.step(ARM, Q, pose)
    return [
        ARM.inverse(pose, PSI, GC), ARM.inverse(pose, PSI), ARM.self_motion(pose, PSI, GC),
        ARM.feasible(pose, GC).intervals, ARM.feasible(pose).intervals,
        ARM.feasible(pose, GC, per_joint=True).intervals,
        aa.gradients.joint_function(ARM, pose, GC, 1).value(0.3),
        aa.nearest_rotation(pose), resolved.psi, stepped.q, aa.follow(ARM, [pose, pose], start=Q).q,
        aa.plan(ARM, [pose, pose]).q, aa.Line(pose, pose).pose(0.5), ARM.with_tool(pose).tool,
        ARM.explain(pose).explain(), aa.follow(ARM, [POSE], start=Q, allowed=None).q,
    ]  # fmt: skip


@pytest.mark.parametrize(("name", "called"), KINDS)
def test_a_pose_of_another_library_is_the_matrix_it_holds(name: str, called: bool) -> None:
    """All functions take objects that hold a pose as other libraries name it."""
    for got, want in zip(outcomes(holder(name, POSE, called)), outcomes(POSE), strict=True):
        np.testing.assert_array_equal(got, want)
    poses = ARM.forward(np.stack([Q, Q + 0.1, Q - 0.1]))[0]
    np.testing.assert_array_equal(ARM.feasible(holder(name, poses, called)).count, ARM.feasible(poses).count)


def test_poses_of_pinocchio_scipy_and_spatialmath_pass() -> None:
    """All functions take poses of pinocchio, scipy and spatialmath, as far as installed."""
    makers: list[Any] = []
    for library, member in (("pinocchio", "SE3"), ("scipy.spatial.transform", "RigidTransform.from_matrix"),
                            ("spatialmath", "SE3")):  # fmt: skip
        with contextlib.suppress(ImportError, AttributeError):
            makers.append(operator.attrgetter(member)(importlib.import_module(library)))
    if not makers:
        pytest.skip("none of pinocchio, scipy 1.16, spatialmath is installed")
    for make in makers:
        matrix = np.asarray(aa.nearest_rotation(POSE))
        foreign = make(matrix)
        for got, want in zip(outcomes(foreign), outcomes(matrix), strict=True):
            if not isinstance(got, str):
                assert_allclose(got, want, rtol=0, atol=1e-12, err_msg=str(make))
