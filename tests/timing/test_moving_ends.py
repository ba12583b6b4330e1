"""A motion may begin and end while it moves: as fast as asked, within every bound, or it is said why not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.calibrated import calibrated
from support.draw import generator
from support.needs import need

import armangle as aa

need("scipy")
need("highspy")

A = 4.0
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
FRANKA = aa.Arm.from_catalogue("franka_fr3")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
READY = np.array([0.1, -0.6, 0.2, -2.2, 0.1, 1.9, 0.7])


def line(arm: Any, q: Any) -> aa.Line:
    start = arm.forward(q)[0]
    goal = start.copy()
    goal[:3, 3] += [0.1, -0.15, -0.1]
    return aa.Line(start, goal)


PATHS = {
    "planned": aa.plan(ARM, line(ARM, Q), start=Q),
    "followed": aa.follow(FRANKA, line(FRANKA, READY), start=READY, samples=30),
    "spline": aa.JointPath.from_joints(
        ARM, Q + 0.3 * np.sin(np.linspace(0.0, 2.0, 40))[:, None] * np.linspace(0.5, 1.0, 7), between="spline"
    ),
    "joints": aa.JointPath.from_joints(ARM, np.stack([Q, Q + np.linspace(-0.3, 0.3, 7)]), between="joints"),
}


def ends(path: aa.JointPath) -> Any:
    """Directions of the joints at both ends, the fastest of them 1."""
    rates = [path.derivatives(s)[0] for s in (0.0, np.nextafter(1.0, 0.0))]
    return [rate / np.abs(rate).max() for rate in rates]


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("speeds", [(0.2, 0.0), (0.0, 0.3), (0.5, 0.4)])
def test_it_begins_and_ends_as_asked_within_every_bound(name: str, speeds: tuple[float, float]) -> None:
    path, arm = PATHS[name], PATHS[name].arm
    start, goal = (v * way for v, way in zip(speeds, ends(path), strict=True))
    found = aa.retime(path, acceleration=A, start=start, goal=goal, sample=1e-3)
    np.testing.assert_allclose(found.qd[0], start, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.qd[-1], goal, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.q[[0, -1]], path.q[[0, -1]], rtol=0, atol=1e-9)
    assert (np.abs(found.qd) <= arm.velocity * 1.001).all()
    inner = np.linspace(0.0, found.duration, 5001)
    assert np.abs(np.diff(found.at(inner).qd, axis=0)).max() <= 1.01 * A * (inner[1] + 1e-3)
    assert found.duration < aa.retime(path, acceleration=A).duration


JERK = 40.0
CALIBRATED = calibrated("kuka_iiwa14_r820", 1.0, 1.0)
JERKED = PATHS | {"calibrated": aa.plan(CALIBRATED, line(CALIBRATED, Q), start=Q)}


@pytest.mark.parametrize("name", JERKED)
def test_the_jerk_is_bounded_from_and_to_a_motion(name: str) -> None:
    """Any velocities along the path at both ends: within every bound at 10 001 times, and exact ends."""
    path, rng = JERKED[name], generator(42, 7, len(name))
    start, goal = (v * way for v, way in zip(rng.uniform(0.0, 0.35, 2), ends(path), strict=True))
    found = aa.retime(path, acceleration=A, jerk=JERK, start=start, goal=goal)
    keeps(found)
    np.testing.assert_allclose(found.qd[[0, -1]], [start, goal], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.q[[0, -1]], path.q[[0, -1]], rtol=0, atol=1e-9)


def keeps(found: aa.Trajectory) -> None:
    """Look at all bounds at 10 001 times; jerks as differences of accelerations too."""
    t = np.linspace(0.0, found.duration, 10_001)
    at = found.at(t)
    assert (np.abs(at.qd) <= 1.001 * found.path.arm.velocity).all()
    assert np.abs(at.qdd).max() <= 1.002 * A
    assert np.abs(np.diff(at.qdd, axis=0)).max() <= 1.003 * JERK * t[1]


@pytest.mark.parametrize("seed", range(2))
def test_a_motion_with_bounded_jerk_goes_on_where_another_one_is(seed: int) -> None:
    """Both halves take what the whole takes, from and to its velocities and accelerations."""
    rng = generator(42, 8, seed)
    q = Q + np.linspace(0.0, 1.0, 2)[:, None] * rng.uniform(-0.6, 0.6, 7)
    bounds: Any = {"acceleration": A, "jerk": JERK}
    whole = aa.retime(aa.JointPath.from_joints(ARM, q, between="joints"), **bounds)
    here = whole.at(rng.uniform(0.2, 0.8) * whole.duration)
    now = here.qd, here.qdd
    rest = aa.retime(aa.JointPath.from_joints(ARM, [here.q, q[1]], between="joints"), start=now, **bounds)
    before = aa.retime(aa.JointPath.from_joints(ARM, [q[0], here.q], between="joints"), goal=now, **bounds)
    assert before.duration + rest.duration == pytest.approx(whole.duration, rel=5e-3)
    for found, row in ((rest, 0), (before, -1)):
        keeps(found)
        np.testing.assert_allclose(found.qd[row], here.qd, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.qdd[row], here.qdd, rtol=0, atol=1e-6)


@pytest.mark.parametrize("tolerance", [1e-4, 5e-3])
def test_rounded_corners_leave_the_ends_as_they_are(tolerance: float) -> None:
    path = PATHS["followed"]
    start, goal = (0.2 * way for way in ends(path))
    found = aa.retime(path, acceleration=A, start=start, goal=goal, tolerance=tolerance)
    np.testing.assert_allclose(found.qd[[0, -1]], [start, goal], rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_a_motion_goes_on_where_another_one_is(seed: int) -> None:
    """Two halves, timed one after the other from the speed in the middle, take what the whole takes."""
    rng = generator(42, seed)
    q = Q + np.linspace(0.0, 1.0, 2)[:, None] * rng.uniform(-0.6, 0.6, 7)
    whole = aa.retime(aa.JointPath.from_joints(ARM, q, between="joints"), acceleration=A)
    here = whole.at(rng.uniform(0.2, 0.8) * whole.duration)
    rest = aa.retime(
        aa.JointPath.from_joints(ARM, [here.q, q[1]], between="joints"), acceleration=A, start=here.qd
    )
    before = aa.retime(
        aa.JointPath.from_joints(ARM, [q[0], here.q], between="joints"), acceleration=A, goal=here.qd
    )
    assert before.duration + rest.duration == pytest.approx(whole.duration, rel=5e-3)


def test_what_cannot_be_braked_or_leads_elsewhere_is_said() -> None:
    path = PATHS["joints"]
    way, _ = ends(path)
    length = np.abs(path.q[1] - path.q[0]).max()
    most = np.sqrt(2 * A * length)
    bounds: Any = {"velocity": 10.0, "acceleration": A}
    assert aa.retime(path, start=0.995 * most * way, **bounds).duration > 0
    with pytest.raises(aa.PathError, match=r"cannot be braked .* start= .*: 95.[0-9]+ % of them"):
        aa.retime(path, start=1.05 * most * way, **bounds)
    with pytest.raises(aa.PathError, match="cannot be brought up"):
        aa.retime(path, goal=1.05 * most * way, **bounds)
    with pytest.raises(aa.InputError, match="start does not lead along the path"):
        aa.retime(path, start=-0.1 * way, **bounds)
    with pytest.raises(aa.InputError, match=r"goal\[0\] is .* above the bound of joint 1, 0.1 rad/s"):
        aa.retime(path, goal=way, velocity=0.1, acceleration=A)
    with pytest.raises(aa.InputError, match="start has accelerations, which may jump without jerk="):
        aa.retime(path, start=[0.1 * way, 0.1 * way], **bounds)
    with pytest.raises(aa.InputError, match="goal has accelerations and no velocity"):
        aa.retime(path, goal=[0.0 * way, 0.1 * way], jerk=50.0, **bounds)
    with pytest.raises(aa.InputError, match=r"start\[1\]\[0\] is .* above the bound of joint 1"):
        aa.retime(path, start=[0.1 * way, 1.1 * A * way], jerk=50.0, **bounds)
    with pytest.raises(aa.InputError, match="start does not lead along the path: of the accelerations"):
        aa.retime(path, start=[0.1 * way, A * np.eye(7)[0]], jerk=50.0, **bounds)
    with pytest.raises(aa.PathError, match="cannot be braked"):
        aa.retime(path, start=1.05 * most * way, jerk=50.0, **bounds)
    with pytest.raises(aa.PathError, match="accelerations and jerks would have to be"):
        aa.retime(path, start=[0.98 * most * way, 0.0 * way], jerk=20.0, **bounds)
    with pytest.raises(aa.InputError, match="start"):
        aa.retime(path, start=way[:6], **bounds)
    with pytest.raises(aa.InputError, match="goal is not finite"):
        aa.retime(path, goal=np.full(7, np.nan), **bounds)
    still = aa.JointPath.from_joints(ARM, [Q, Q])
    with pytest.raises(aa.InputError, match="joints have no speed along the path"):
        aa.retime(still, start=0.1 * way, **bounds)
