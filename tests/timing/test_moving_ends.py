"""A motion may begin and end while it moves: as fast as asked, within every bound, or it is said why not."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from support.calibrated import calibrated
from support.draw import generator
from support.moves import line, refused
from support.needs import need

import armangle as aa

need("scipy")
need("highspy")

A = 4.0
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
FRANKA = aa.Arm.from_catalogue("franka_fr3")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
READY = np.array([0.1, -0.6, 0.2, -2.2, 0.1, 1.9, 0.7])


SHIFT = [0.1, -0.15, -0.1]
CALIBRATED = calibrated("kuka_iiwa14_r820", 1.0, 1.0)
PATHS = {
    "planned": lambda: aa.plan(ARM, line(ARM, Q, SHIFT), start=Q),
    "followed": lambda: aa.follow(FRANKA, line(FRANKA, READY, SHIFT), start=READY, samples=30),
    "spline": lambda: aa.JointPath.from_joints(
        ARM, Q + 0.3 * np.sin(np.linspace(0.0, 2.0, 40))[:, None] * np.linspace(0.5, 1.0, 7), between="spline"
    ),
    "joints": lambda: aa.JointPath.from_joints(
        ARM, np.stack([Q, Q + np.linspace(-0.3, 0.3, 7)]), between="joints"
    ),
    "calibrated": lambda: aa.plan(CALIBRATED, line(CALIBRATED, Q, SHIFT), start=Q),
}


@cache
def path_of(name: str) -> aa.JointPath:
    """Return a path of PATHS."""
    return PATHS[name]()


def ends(path: aa.JointPath) -> Any:
    """The directions of the joints at both ends of a path, scaled so that the fastest joint has ±1."""
    rates = [path.derivatives(s)[0] for s in (0.0, np.nextafter(1.0, 0.0))]
    return [rate / np.abs(rate).max() for rate in rates]


@pytest.mark.turns(6)
@pytest.mark.parametrize("name", [name for name in PATHS if name != "calibrated"])
@pytest.mark.parametrize("speeds", [(0.2, 0.0), (0.0, 0.3), (0.5, 0.4)])
def test_it_begins_and_ends_as_asked_within_every_bound(name: str, speeds: tuple[float, float]) -> None:
    """`retime(start=, goal=)` has these velocities at its ends, and keeps its bounds."""
    path, arm = path_of(name), path_of(name).arm
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


@pytest.mark.turns(6)
@pytest.mark.parametrize("name", PATHS)
def test_the_jerk_is_bounded_from_and_to_a_motion(name: str) -> None:
    """`retime(start=, goal=, jerk=)` has these velocities at its ends, and keeps its bounds."""
    path, rng = path_of(name), generator(42, 7, len(name))
    start, goal = (v * way for v, way in zip(rng.uniform(0.0, 0.35, 2), ends(path), strict=True))
    found = aa.retime(path, acceleration=A, jerk=JERK, start=start, goal=goal)
    keeps(found, JERK)
    np.testing.assert_allclose(found.qd[[0, -1]], [start, goal], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.q[[0, -1]], path.q[[0, -1]], rtol=0, atol=1e-9)


def keeps(found: aa.Trajectory, jerk: float | None = None) -> None:
    """Check velocity, acceleration A and jerk of a trajectory at 10 001 times."""
    t = np.linspace(0.0, found.duration, 10_001)
    at = found.at(t)
    assert (np.abs(at.qd) <= 1.001 * found.path.arm.velocity).all()
    assert np.abs(at.qdd).max() <= 1.002 * A
    assert jerk is None or np.abs(np.diff(at.qdd, axis=0)).max() <= 1.003 * jerk * t[1]


@pytest.mark.turns(4)
@pytest.mark.parametrize(("jerk", "seed"), [(None, 0), (None, 1), (None, 2), (JERK, 0), (JERK, 1)])
def test_a_motion_goes_on_where_another_one_is(jerk: float | None, seed: int) -> None:
    """Two halves retimed to and from the velocities between them take as long as the whole."""
    rng = generator(42, *([8] if jerk else []), seed)
    q = Q + np.linspace(0.0, 1.0, 2)[:, None] * rng.uniform(-0.6, 0.6, 7)

    def timed(rows: Any, **ends: Any) -> aa.Trajectory:
        """The trajectory through rows of joints with moving ends."""
        path = aa.JointPath.from_joints(ARM, rows, between="joints")
        return aa.retime(path, acceleration=A, jerk=jerk, **ends)

    whole = timed(q)
    here = whole.at(rng.uniform(0.2, 0.8) * whole.duration)
    now = (here.qd, here.qdd) if jerk else here.qd
    rest, before = timed([here.q, q[1]], start=now), timed([q[0], here.q], goal=now)
    assert before.duration + rest.duration == pytest.approx(whole.duration, rel=5e-3)
    for found, row in ((rest, 0), (before, -1)):
        np.testing.assert_allclose(found.qd[row], here.qd, rtol=0, atol=1e-9)
        if jerk:
            keeps(found, jerk)
            np.testing.assert_allclose(found.qdd[row], here.qdd, rtol=0, atol=1e-6)


@pytest.mark.parametrize("tolerance", [1e-4, 5e-3])
def test_rounded_corners_leave_the_ends_as_they_are(tolerance: float) -> None:
    """`retime(start=, goal=, tolerance=)` has exactly these velocities at its ends."""
    path = path_of("followed")
    start, goal = (0.2 * way for way in ends(path))
    found = aa.retime(path, acceleration=A, start=start, goal=goal, tolerance=tolerance)
    np.testing.assert_allclose(found.qd[[0, -1]], [start, goal], rtol=0, atol=1e-9)


def test_what_cannot_be_braked_or_leads_elsewhere_is_said() -> None:
    """`retime` refuses velocities at its ends that are too fast or not along the path, and says why."""
    path = path_of("joints")
    way, _ = ends(path)
    fast = np.sqrt(2 * A * np.abs(path.q[1] - path.q[0]).max()) * way
    bounds: dict[str, Any] = {"velocity": 10.0, "acceleration": A}
    assert aa.retime(path, start=0.995 * fast, **bounds).duration > 0
    for error, said, given in (
        (aa.PathError, r"cannot be braked .* start= .*: 95.[0-9]+ % of them", {"start": 1.05 * fast}),
        (aa.PathError, "cannot be brought up", {"goal": 1.05 * fast}),
        (aa.PathError, "cannot be braked", {"start": 1.05 * fast, "jerk": 50.0}),
        (aa.PathError, "accelerations and jerks", {"start": [0.98 * fast, 0.0 * way], "jerk": 20.0}),
        (aa.InputError, "start does not lead along the path", {"start": -0.1 * way}),
        (aa.InputError, r"goal\[0\] is .* bound of joint 1, 0.1 rad/s", {"goal": way, "velocity": 0.1}),
        (aa.InputError, "start has accelerations.* jerk=", {"start": [0.1 * way, 0.1 * way]}),
        (aa.InputError, "goal .* no velocity", {"goal": [0.0 * way, 0.1 * way], "jerk": 50.0}),
        (aa.InputError, r"start\[1\]\[0\] is .* joint 1", {"start": [way / 10, 1.1 * A * way], "jerk": 50.0}),
        (aa.InputError, "the accelerations", {"start": [0.1 * way, A * np.eye(7)[0]], "jerk": 50.0}),
        (aa.InputError, "start", {"start": way[:6]}),
        (aa.InputError, "goal is not finite", {"goal": way * np.nan}),
    ):  # fmt: skip
        refused(error, said, aa.retime, path, **bounds | given)
    still = aa.JointPath.from_joints(ARM, [Q, Q])
    refused(aa.InputError, "no speed along the path", aa.retime, still, start=0.1 * way, **bounds)
