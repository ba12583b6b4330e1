"""Laws of paths: ends, speed, derivatives, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import armangle as aa

S = np.linspace(0, 1, 41)


def frame(seed: int) -> np.ndarray:
    """A random rigid transform, shape (4, 4)."""
    rng = np.random.default_rng(seed)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    out = np.eye(4)
    out[:3, :3] = rotation * np.sign(np.linalg.det(rotation))
    out[:3, 3] = rng.normal(size=3)
    return out


def paths() -> list[tuple[str, aa.Path]]:
    a, b, c = frame(1), frame(2), frame(3)
    half = a.copy()
    half[:3, :3] = a[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    return [
        ("line", aa.Line(a, b)),
        ("fixed line", aa.Line(a, b, "fixed")),
        ("half turn", aa.Line(a, half)),
        ("arc", aa.CircularArc(a, b[:3, 3], c)),
        ("fixed arc", aa.CircularArc(a, b[:3, 3], c, "fixed")),
        ("carried arc", aa.CircularArc(a, b[:3, 3], c, "carried")),
        ("screw", aa.Screw(a, b[:3, 3], [0.3, 0.2, -1.0], 7.5, advance=0.4)),
        ("straight screw", aa.Screw(a, b[:3, 3], [0.0, 0.0, 2.0], 0.0, advance=0.4)),
        ("waypoints", aa.Waypoints(np.stack([a, b, b, c, a]))),
        ("one pose", aa.Waypoints(a[None])),
    ]


ALL = pytest.mark.parametrize("path", [p for _, p in paths()], ids=[n for n, _ in paths()])


@ALL
def test_every_pose_is_a_rotation_and_a_position(path: aa.Path) -> None:
    poses = path.pose(S)
    product = np.swapaxes(poses[:, :3, :3], 1, 2) @ poses[:, :3, :3]
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=4e-15)
    assert (poses[:, 3] == [0, 0, 0, 1]).all()


@ALL
def test_derivatives_are_limits_of_differences(path: aa.Path) -> None:
    h = 1e-4
    inner = np.array([0.13, 0.31, 0.44, 0.68, 0.93])
    before, here, after = path.pose(inner - h), path.pose(inner), path.pose(inner + h)
    speed = path.derivative(inner)
    np.testing.assert_allclose((after - before)[:, :3, 3] / (2 * h), speed[:, :3], atol=2e-5)
    spin = (after - before)[:, :3, :3] / (2 * h) @ np.swapaxes(here[:, :3, :3], 1, 2)
    axial = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
    np.testing.assert_allclose(axial, speed[:, 3:], atol=2e-5)
    for order in (1, 2):
        rate = (path.derivative(inner + h, order) - path.derivative(inner - h, order)) / (2 * h)
        np.testing.assert_allclose(rate, path.derivative(inner, order + 1), atol=1e-3)


@ALL
def test_one_s_and_a_batch_agree(path: aa.Path) -> None:
    batch = path.pose(S.reshape(1, -1))
    assert batch.shape == (1, len(S), 4, 4)
    assert np.array_equal(path.pose(S[7]), batch[0, 7])
    assert path.derivative(0.5).shape == (6,)


@pytest.mark.parametrize("name", ["line", "half turn", "arc"])
def test_both_ends_are_met(name: str) -> None:
    path = dict(paths())[name]
    assert isinstance(path, (aa.Line, aa.CircularArc))
    np.testing.assert_allclose(path.pose(0.0), path.start, atol=1e-15)
    np.testing.assert_allclose(path.pose(1.0), path.end, atol=1e-14)


def test_the_rotation_of_a_line_is_the_shortest_and_even() -> None:
    path = aa.Line(frame(1), frame(2))
    relative = path.pose(0.0)[:3, :3].T @ path.pose(1.0)[:3, :3]
    angle = np.arccos((np.trace(relative) - 1) / 2)
    np.testing.assert_allclose(np.linalg.norm(path.derivative(S)[:, 3:], axis=1), angle, rtol=1e-12)


def test_an_arc_passes_through_its_three_points_at_one_distance() -> None:
    a, via, c = frame(1), frame(2)[:3, 3], frame(3)
    points = aa.CircularArc(a, via, c).pose(np.linspace(0, 1, 20001))[:, :3, 3]
    assert np.linalg.norm(points - via, axis=1).min() < 1e-3
    speed = np.linalg.norm(aa.CircularArc(a, via, c).derivative(S)[:, :3], axis=1)
    np.testing.assert_allclose(speed, speed[0], rtol=1e-12)


def test_a_screw_of_two_turns_comes_back_shifted_along_its_axis() -> None:
    start = frame(4)
    path = aa.Screw(start, [1.0, 2.0, 3.0], [0.0, 0.0, 5.0], 4 * np.pi, advance=0.25)
    shifted = start.copy()
    shifted[2, 3] += 0.25
    np.testing.assert_allclose(path.pose(1.0), shifted, atol=1e-14)


def test_waypoints_are_met_and_straight_between() -> None:
    poses = np.stack([frame(k) for k in range(5)])
    path = aa.Waypoints(poses)
    np.testing.assert_allclose(path.pose(np.arange(5) / 4), poses, atol=4e-15)
    np.testing.assert_allclose(path.pose(0.125)[:3, 3], (poses[0] + poses[1])[:3, 3] / 2, atol=1e-15)
    assert np.array_equal(path.breaks, np.arange(5) / 4)
    assert len(path) == 5
    assert repr(path) == "<Waypoints of 5 poses>"


def test_a_rotation_that_is_nearly_one_is_replaced_by_the_nearest() -> None:
    rough = frame(6)
    rough[:3, :3] *= 1 + 2e-7
    near = aa.Waypoints(np.stack([rough, frame(7)])).pose(0.0)
    np.testing.assert_allclose(near, aa.nearest_rotation(rough), atol=1e-13)


@pytest.mark.parametrize("tilt", [1e-9, 1e-6, 1e-3, 1.0, *(np.pi - np.array([1e-3, 1e-6, 1e-9, 0]))])
def test_shortest_rotations_of_every_size_arrive(tilt: float) -> None:
    for seed in range(20):
        start, end = frame(seed), frame(seed)
        axis = np.random.default_rng(seed).normal(size=3)
        path = aa.Screw(start, start[:3, 3], axis, tilt)
        end = path.pose(1.0)
        line = aa.Line(start, end)
        np.testing.assert_allclose(line.pose(1.0), end, atol=1e-14)
        assert np.linalg.norm(line.derivative(0.0)[3:]) <= np.pi + 1e-12


def test_refusals() -> None:
    a, b = frame(1), frame(2)
    with pytest.raises(aa.InputError, match=r"s holds 1\.5, wanted numbers in \[0, 1\]"):
        aa.Line(a, b).pose([0.0, 1.5])
    with pytest.raises(aa.InputError, match="order is 4, wanted 1, 2 or 3"):
        aa.Line(a, b).derivative(0.0, 4)
    with pytest.raises(aa.InputError, match="orientation is 'carried', wanted one of 'shortest', 'fixed'"):
        aa.Line(a, b, "carried")  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(aa.InputError, match="start, via and end lie on a line, wanted three points"):
        aa.CircularArc(a, (a + b)[:3, 3] / 2, b)
    with pytest.raises(aa.InputError, match="direction is zero, wanted a direction"):
        aa.Screw(a, [0, 0, 0], [0, 0, 0], 1.0)
    with pytest.raises(aa.InputError, match=r"angle \(rad\) is 2000, wanted a number"):
        aa.Screw(a, [0, 0, 0], [0, 0, 1], 2e3)
    with pytest.raises(aa.ShapeError, match=r"start has shape \(1, 4, 4\), wanted \(4, 4\)"):
        aa.Line(a[None], b)
    with pytest.raises(aa.ShapeError, match=r"via has shape \(1, 3\), wanted \(3,\)"):
        aa.CircularArc(a, [[0, 0, 0]], b)
    with pytest.raises(aa.NotFiniteError, match=r"point is .*, wanted finite numbers"):
        aa.Screw(a, [np.nan, 0, 0], [0, 0, 1], 1.0)
    with pytest.raises(aa.NotRotationError, match="the rotation of end is not orthonormal"):
        aa.Line(a, 2 * b - np.diag([0, 0, 0, 1.0]))
    with pytest.raises(aa.ShapeError, match=r"poses has shape \(0, 4, 4\), wanted \(N, 4, 4\)"):
        aa.Waypoints(np.empty((0, 4, 4)))
    with pytest.raises(aa.NotRotationError, match=r"the rotation of pose\[1\] is not orthonormal"):
        aa.Waypoints(np.stack([a, 2 * b - np.diag([0, 0, 0, 1.0])]))
