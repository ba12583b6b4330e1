"""Laws of paths: ends, speed, derivatives, and what is refused."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from support.moves import refused

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
    """A path of every kind, each with its name."""
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
        ("segments", aa.Segments(three())),
        ("blended", aa.Segments(three(), blend=0.3)),
        ("blended to the middles", aa.Segments(three(), blend=9.0)),
    ]


def three() -> list[aa.Path]:
    """A line, an arc and a screw, each from where the one before it ends."""
    a, b, c, via = frame(1), frame(2), frame(3), frame(4)[:3, 3]
    return [aa.Line(a, b), aa.CircularArc(b, via, c), aa.Screw(c, [0.1, 0.4, 0.2], [0.3, 0.2, -1], 1.5, 0.2)]


ALL = pytest.mark.parametrize("path", [p for _, p in paths()], ids=[n for n, _ in paths()])


@ALL
def test_every_pose_is_a_rotation_and_a_position(path: aa.Path) -> None:
    """`Path.pose` of each kind of path is a rigid pose."""
    poses = path.pose(S)
    product = np.swapaxes(poses[:, :3, :3], 1, 2) @ poses[:, :3, :3]
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=4e-15)
    assert (poses[:, 3] == [0, 0, 0, 1]).all()


@ALL
def test_derivatives_are_limits_of_differences(path: aa.Path) -> None:
    """`Path.derivative` of order 1, 2, 3 equals finite differences."""
    h = 1e-5
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
    """`pose` and `derivative` take s of any shape, with the same poses as one by one."""
    batch = path.pose(S.reshape(1, -1))
    assert batch.shape == (1, len(S), 4, 4)
    assert np.array_equal(path.pose(S[7]), batch[0, 7])
    assert path.derivative(0.5).shape == (6,)


def test_both_ends_are_met_evenly() -> None:
    """Lines and arcs meet both ends at an even speed, and an arc passes its middle point."""
    for name in ("line", "half turn", "arc"):
        path: Any = dict(paths())[name]
        np.testing.assert_allclose(path.pose(0.0), path.start, atol=1e-15)
        np.testing.assert_allclose(path.pose(1.0), path.end, atol=1e-14)
        speed = path.derivative(S)
        if name != "arc":
            relative = path.start[:3, :3].T @ path.end[:3, :3]
            angle = np.arccos(np.clip((np.trace(relative) - 1) / 2, -1, 1))
            np.testing.assert_allclose(np.linalg.norm(speed[:, 3:], axis=1), angle, rtol=1e-12)
            continue
        np.testing.assert_allclose(
            np.linalg.norm(speed[:, :3], axis=1), np.linalg.norm(speed[0, :3]), rtol=1e-12
        )
        away = path.pose(np.linspace(0, 1, 20001))[:, :3, 3] - frame(2)[:3, 3]
        assert np.linalg.norm(away, axis=1).min() < 1e-3  # it passes through its middle point


def test_a_screw_of_two_turns_comes_back_shifted_along_its_axis() -> None:
    start = frame(4)
    path = aa.Screw(start, [1.0, 2.0, 3.0], [0.0, 0.0, 5.0], 4 * np.pi, advance=0.25)
    shifted = start.copy()
    shifted[2, 3] += 0.25
    np.testing.assert_allclose(path.pose(1.0), shifted, atol=1e-14)


def test_waypoints_are_met_and_straight_between() -> None:
    """`Waypoints` passes its poses at even s, in straight lines, with breaks there."""
    poses = np.stack([frame(k) for k in range(5)])
    path = aa.Waypoints(poses)
    np.testing.assert_allclose(path.pose(np.arange(5) / 4), poses, atol=4e-15)
    np.testing.assert_allclose(path.pose(0.125)[:3, 3], (poses[0] + poses[1])[:3, 3] / 2, atol=1e-15)
    assert np.array_equal(path.breaks, np.arange(5) / 4)
    assert len(path) == 5
    assert repr(path) == "<Waypoints of 5 poses>"


def test_a_rotation_that_is_nearly_one_is_replaced_by_the_nearest() -> None:
    """Paths take a rotation that is off by 2e-7, and use `nearest_rotation` of it."""
    rough = frame(6)
    rough[:3, :3] *= 1 + 2e-7
    near = aa.Waypoints(np.stack([rough, frame(7)])).pose(0.0)
    np.testing.assert_allclose(near, aa.nearest_rotation(rough), atol=1e-13)


@pytest.mark.parametrize("tilt", [1e-9, 1e-6, 1e-3, 1.0, *(np.pi - np.array([1e-3, 1e-6, 1e-9, 0]))])
def test_shortest_rotations_of_every_size_arrive(tilt: float) -> None:
    """A Line with a rotation of any size up to π meets its end and turns by at most π."""
    for seed in range(20):
        start, end = frame(seed), frame(seed)
        axis = np.random.default_rng(seed).normal(size=3)
        path = aa.Screw(start, start[:3, 3], axis, tilt)
        end = path.pose(1.0)
        line = aa.Line(start, end)
        np.testing.assert_allclose(line.pose(1.0), end, atol=1e-14)
        assert np.linalg.norm(line.derivative(0.0)[3:]) <= np.pi + 1e-12


def test_refusals() -> None:
    """Paths refuse bad arguments and say which; adding a number is a TypeError."""
    a, b = frame(1), frame(2)
    torn, line = 2 * b - np.diag([0, 0, 0, 1.0]), aa.Line(a, b)
    for said, call, *words in (
        (r"s holds 1\.5, wanted numbers in \[0, 1\]", line.pose, [0.0, 1.5]),
        ("order is 4, wanted 1, 2 or 3", line.derivative, 0.0, 4),
        ("orientation is 'carried', wanted one of 'shortest', 'fixed'", aa.Line, a, b, "carried"),
        ("start and end are one point", aa.CircularArc, a, a[:3, 3] + 0.1, a),
        ("start, via and end lie on a line", aa.CircularArc, a, (a + b)[:3, 3] / 2, b),
        ("direction is zero", aa.Screw, a, [0, 0, 0], [0, 0, 0], 1.0),
        (r"angle \(rad\) is 2000, wanted a number", aa.Screw, a, [0, 0, 0], [0, 0, 1], 2e3),
        (r"start has shape \(1, 4, 4\), wanted \(4, 4\)", aa.Line, a[None], b),
        (r"via has shape \(1, 3\), wanted \(3,\)", aa.CircularArc, a, [[0, 0, 0]], b),
        (r"point is .*, wanted finite numbers", aa.Screw, a, [np.nan, 0, 0], [0, 0, 1], 1.0),
        ("the rotation of end is not orthonormal", aa.Line, a, torn),
        (r"poses has shape \(0, 4, 4\), wanted \(N, 4, 4\)", aa.Waypoints, np.empty((0, 4, 4))),
        (r"the rotation of pose\[1\] is not orthonormal", aa.Waypoints, np.stack([a, torn])),
        ("path 1 begins .* from where the one before it ends", line.__add__, aa.Line(frame(3), a)),
        ("wanted a list of Line, CircularArc, Screw", aa.Segments, []),
        ("path 0 has blends already", aa.Segments, [aa.Segments(three(), 0.1)], 0.1),
        ("one for each of 3 corners", aa.Segments, pick(), [0.05, 0.0]),
        ("blend", aa.Segments, pick(), [0.05, -1.0, 0.0]),
    ):
        refused(aa.InputError, said, call, *words)
    with pytest.raises(TypeError):
        line + 3  # type: ignore[operator]  # wrong on purpose


# -- several paths -----------------------------------------------------------------------------------


def both_sides(path: aa.Path, order: int) -> tuple[np.ndarray, np.ndarray]:
    """The derivatives just before and just behind the inner breaks of a path."""
    inner = path.breaks[1:-1]
    return path.derivative(np.nextafter(inner, 0), order), path.derivative(inner, order)


@pytest.mark.parametrize("blend", [1e-3, 0.3, 9.0])
def test_blends_are_twice_differentiable_and_plain_corners_are_not(blend: float) -> None:
    """Segments with blend are continuous with two derivatives; without, the first one jumps."""
    path = aa.Segments(three(), blend=blend)
    inner = path.breaks[1:-1]
    np.testing.assert_allclose(path.pose(np.nextafter(inner, 0)), path.pose(inner), atol=1e-12)
    for order in (1, 2):
        before, after = both_sides(path, order)
        changing = np.abs(path.derivative(np.linspace(0, 1, 5001), order + 1)).max()
        rounding_of_s = 1e-14
        np.testing.assert_allclose(before, after, rtol=1e-12, atol=rounding_of_s * changing)
    before, after = both_sides(aa.Segments(three()), 1)
    assert np.abs(before - after).max(axis=1).min() > 0.1


def angle_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The angle (rad) between rotations (..., 3, 3), for small ones too."""
    return 2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=(-2, -1)) / np.sqrt(8), 0, 1))


@pytest.mark.turns(4)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_the_deviation_bounds_position_and_rotation_at_once(seed: int) -> None:
    """Each pose of blended segments is within `deviation` of one and the same pose of the sharp path."""
    a, b, c, d = (frame(20 + 4 * seed + k) for k in range(4))
    parts = [aa.Line(a, b), aa.CircularArc(b, frame(90 + seed)[:3, 3], c), aa.Line(c, d)]
    round_, plain = aa.Segments(parts, blend=0.25), aa.Segments(parts).pose(np.linspace(0, 1, 20_001))
    share = []
    for s in np.linspace(0, 1, 301):
        here = round_.pose(s)
        away = np.linalg.norm(plain[:, :3, 3] - here[:3, 3], axis=1) / round_.deviation.position
        turned = angle_between(plain[:, :3, :3], here[:3, :3]) / round_.deviation.rotation
        share.append(np.maximum(away, turned).min())
    assert 0.1 < max(share) <= 1.02


def test_the_deviation_at_a_right_angle_is_attained() -> None:
    """The deviation that `Segments` states for a blended right angle is attained at the corner."""
    a, b, c = (np.eye(4) for _ in range(3))
    b[0, 3], c[:2, 3] = 0.4, (0.4, 0.3)
    path = aa.Segments([aa.Line(a, b), aa.Line(b, c)], blend=0.1)
    s = np.append(np.linspace(0, 1, 20_001), path.breaks[1:3].mean())
    points = path.pose(s)[:, :3, 3]
    off = np.minimum(np.abs(points[:, 1]), np.abs(points[:, 0] - 0.4)).max()
    assert off == pytest.approx(3 / 16 * 0.1, rel=1e-12)  # of the tool from its way ...
    missed = np.linalg.norm(points - b[:3, 3], axis=1).min()  # ... and by more the corner is missed
    assert missed == pytest.approx(path.deviation.position, rel=1e-12)
    assert path.deviation == (pytest.approx(3 / 16 * np.sqrt(2) * 0.1), 0.0)
    far = np.linalg.norm(points - b[:3, 3], axis=1) > 0.1 + 1e-9
    assert (np.minimum(np.abs(points[:, 1]), np.abs(points[:, 0] - 0.4))[far] < 1e-15).all()
    assert np.abs(np.diff(path.derivative(np.linspace(0, 1, 9)), axis=0)).max() > 0.1


def pick() -> list[aa.Path]:
    """Four lines: across, down to a part and up again, across."""
    points = np.array([[0.45, 0, 0.3], [0.55, 0, 0.3], [0.55, 0, 0.2], [0.55, 0, 0.35], [0.55, 0.1, 0.35]])
    poses = np.stack([aa.pose(point, rpy=[np.pi, 0, 0]) for point in points])
    return [aa.Line(a, b) for a, b in itertools.pairwise(poses)]


def test_how_far_a_corner_that_turns_back_is_missed_is_said() -> None:
    """`deviation` is the distance by which a blend misses a corner that turns back."""
    path = aa.Segments(pick(), blend=0.05)
    lowest = path.pose(np.linspace(0, 1, 20_001))[:, 2, 3].min()
    assert lowest - 0.2 == pytest.approx(3 / 8 * 0.05, abs=1e-6)
    assert path.deviation.position == pytest.approx(3 / 8 * 0.05, rel=1e-12)


def test_each_corner_has_a_blend_of_its_own() -> None:
    """Segments, `plan` and `follow` take one blend a corner; a blend of 0 meets its corner."""
    path, part = aa.Segments(pick(), blend=[0.05, 0.0, 0.03]), pick()[1].pose(1.0)
    s = np.append(path.breaks, np.linspace(0, 1, 20_001))
    points = path.pose(s)[:, :3, 3]
    assert np.linalg.norm(points - part[:3, 3], axis=1).min() < 1e-15
    for corner, blend, there in ((pick()[0], 0.05, s < 0.4), (pick()[2], 0.03, s > 0.5)):
        missed = np.linalg.norm(points[there] - corner.pose(1.0)[:3, 3], axis=1)
        assert missed.min() == pytest.approx(3 / 16 * np.sqrt(2) * blend, rel=1e-5)
    assert path.deviation.position == pytest.approx(3 / 16 * np.sqrt(2) * 0.05, rel=1e-12)
    assert "blend=[0.05, 0.0, 0.03]" in repr(path)
    stacked = np.stack([line.pose(0.0) for line in pick()] + [pick()[-1].pose(1.0)])
    of_poses = aa.Segments([aa.Waypoints(stacked)], blend=[0.05, 0.0, 0.03])
    np.testing.assert_allclose(of_poses.pose(s), path.pose(s), atol=1e-15)
    met = aa.plan(ARM, pick(), blend=[0.05, 0.0, 0.05])  # a plan meets a pick, and rounds the rest
    assert met.certified
    assert np.linalg.norm(met.at(met.path.breaks).pose[:, :3, 3] - part[:3, 3], axis=1).min() < 1e-15
    assert aa.follow(ARM, pick(), start=met.q[0], blend=[0.05, 0.0, 0.05], samples=400).ok


def test_blends_of_neighbours_meet_in_the_middle_of_a_short_piece() -> None:
    """Blends of `Segments` at both ends of a short piece meet in its middle."""
    poses = np.stack([np.eye(4)] * 4)
    poses[:, :3, 3] = [[0, 0, 0], [0.5, 0, 0], [0.5, 0.02, 0], [0, 0.02, 0]]
    path = aa.Segments([aa.Waypoints(poses)], blend=0.1)
    middle = np.array([0.5, 0.01, 0])
    points = path.pose(path.breaks)[:, :3, 3]
    assert np.linalg.norm(points - middle, axis=1).min() < 1e-14
    assert len(path.breaks) == 5  # line, two blends, line: nothing is left between the blends


def test_plain_segments_are_the_paths_one_after_the_other() -> None:
    """`Segments` without blend, or paths added, are the paths in turn."""
    path, parts = aa.Segments(three()), three()
    for k, (low, high) in enumerate(zip(path.breaks[:-1], path.breaks[1:], strict=True)):
        np.testing.assert_allclose(path.pose(low + (high - low) * S[:-1]), parts[k].pose(S[:-1]), atol=1e-14)
    assert path.deviation == (0, 0)
    added = parts[0] + parts[1] + parts[2]
    np.testing.assert_allclose(added.pose(S), path.pose(S), atol=1e-14)


def test_pieces_that_stand_still_are_left_out_unless_all_do() -> None:
    """Segments leave out pieces without motion; if all are, the path stands still."""
    line = aa.Line(frame(1), frame(2))
    stay = aa.Waypoints(frame(2)[None])
    np.testing.assert_array_equal(aa.Segments([line, stay], 0.1).pose(S), line.pose(S))
    still = aa.Segments([stay, stay])
    np.testing.assert_allclose(still.pose(S), np.broadcast_to(frame(2), (len(S), 4, 4)), atol=4e-15)


# -- moved along -------------------------------------------------------------------------------------

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])


def corner() -> list[aa.Path]:
    """Two lines with a turn of the tool in the second, within reach."""
    a, b, c = (ARM.forward(Q)[0].copy() for _ in range(3))
    b[:3, 3] += [0.0, -0.15, 0.05]
    c[:3, 3] += [0.1, -0.15, -0.05]
    c[:3, :3] = c[:3, :3] @ aa.pose([0, 0, 0], rotvec=[0.0, 0.3, 0.2])[:3, :3]
    return [aa.Line(a, b), aa.Line(b, c)]


def test_a_plan_round_a_corner_is_proven_and_smooth_in_the_joints() -> None:
    """Plans round a corner are certified; with blend, q' and q'' are continuous at its breaks."""
    found, sharp = (aa.plan(ARM, corner(), start=Q, blend=blend) for blend in (0.04, 0.0))
    assert found.certified and sharp.certified and sharp.deviation == (0, 0)
    assert found.deviation == found.path.deviation and found.deviation.position > 0.007
    assert "Corners are rounded by at most 11.1 mm and 0.97" in found.explain()
    before, after, turn, turned = (
        path.derivatives(s)
        for path in (found, sharp)
        for s in (np.nextafter(path.path.breaks[1:-1], 0), path.path.breaks[1:-1])
    )
    for order in (0, 1):
        most = np.abs(after[:, order]).max()
        np.testing.assert_allclose(before[:, order], after[:, order], atol=1e-6 * most)
    assert np.abs(turn - turned)[:, 0].max() > 0.1


def test_samples_are_rows_of_waypoints_too_and_without_them_the_poses() -> None:
    """Without `samples` a plan of poses has a row for each pose, with `blend` 200."""
    poses = np.stack([corner()[0].pose(0.0), corner()[0].pose(1.0), corner()[1].pose(1.0)])
    three_rows, many = aa.plan(ARM, poses, start=Q), aa.plan(ARM, poses, start=Q, samples=101)
    assert (len(three_rows), len(many)) == (3, 101)
    np.testing.assert_array_equal(three_rows.poses, poses)
    np.testing.assert_allclose(many.poses[50], poses[1], atol=1e-15)
    assert len(aa.plan(ARM, poses, start=Q, blend=0.01)) == 200


@pytest.mark.parametrize("blend", [0.0, 0.04])
def test_follow_goes_along_a_list_and_stays_on_it_between_its_rows(blend: float) -> None:
    """`follow` along a list of paths is on the path between its rows too."""
    found = aa.follow(ARM, corner(), start=Q, blend=blend, samples=120)
    path = aa.Segments(corner(), blend)
    assert found.ok
    assert set(path.breaks) <= set(found.s)
    at = found.at(np.linspace(0, 1, 777))
    np.testing.assert_allclose(ARM.forward(at.q)[0], path.pose(np.linspace(0, 1, 777)), atol=1e-12)
    same = aa.follow(ARM, path.pose(found.s), start=Q)
    assert np.array_equal(same.q, found.q)
