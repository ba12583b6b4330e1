"""From where theta_2 = 0 or theta_6 = 0, home postures among them, the elbow goes where it is wished."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import armangle as aa

Array = NDArray[np.float64]

DT = 0.01
ROOM = 0.1  # rad that the wish is off the ends of its arc
STARTS = {
    "home": [0, 0, 0, -np.pi / 2, 0, np.pi / 2, 0],
    "shoulder": [0.5, 0, 0, -1.4, 0.3, 1.0, 0],
    "wrist": [0.3, 0.6, 0.2, -1.2, 0, 0, 0.2],
}


def wishes(arm: aa.Arm, pose: Array, gc: int, psi: float, start: str) -> list[float]:
    """Arm angles to both sides that one branch joins to psi without a gap."""
    branches = (gc, gc ^ (4 if start == "wrist" else 1))
    out = []
    for turn in (-0.8, -0.3, 0.3, 0.8):
        held, wish = psi + 1e-6 * np.sign(turn), psi + turn * (1 + ROOM / abs(turn))
        for branch in branches:
            arcs = arm.feasible(pose, branch)
            whole = [arcs.contains(psi_) for psi_ in np.linspace(held, wish, 500)]
            if arcs.is_full or all(whole):
                out.append(psi + turn)
                break
    return out


@pytest.fixture(params=["kuka_iiwa7_r800", "kuka_iiwa14_r820", "realman_rm75_b", "openarm_v10"])
def arm(request: pytest.FixtureRequest) -> aa.Arm:
    return aa.Arm.from_catalogue(request.param)


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("by", ["tracker", "step", "bounded step"])
@pytest.mark.parametrize("off", [0, 1e-9, 1e-7, 1e-5, 1e-3, 1e-2])
def test_a_wish_from_where_two_branches_meet_is_met(arm: aa.Arm, start: str, by: str, off: float) -> None:
    q = np.array(STARTS[start], float)
    q[5 if start == "wrist" else 1] += off
    if not arm.lower[3] < q[3] < arm.upper[3]:
        q[3] = -q[3]
    q = np.clip(q, arm.lower, arm.upper)
    pose, psi, gc = arm.forward(q)
    here = wishes(arm, pose, int(gc), float(psi), start)
    for wish in here:
        rows = tracked(arm, q, pose, wish) if by == "tracker" else stepped(arm, q, pose, wish, by != "step")
        poses, psis, _ = arm.forward(rows)
        assert np.abs(poses - pose).max() <= 1e-9, "the tool stands"
        assert abs(np.angle(np.exp(1j * (psis[-1] - wish)))) <= 0.02, (arm.name, start, wish)
    assert here or off > 0 or arm.name == "openarm_v10"


def tracked(arm: aa.Arm, q: Array, pose: Array, wish: float) -> Array:
    tracker = aa.Tracker(arm, DT, velocity=2.0, acceleration=10.0)
    tracker.start(q)
    base = (arm.base @ np.array([0, 0, arm.d_bs, 1.0]))[:3]
    elbow = arm.elbow(arm.inverse(pose, wish, arm.forward(q)[2]))
    ticks = [tracker.step(pose, elbow_direction=elbow - base) for _ in range(1000)]
    assert all(t.status == aa.Tracking.FOLLOWING for t in ticks)
    return np.array([q, *(t.q for t in ticks)])


def stepped(arm: aa.Arm, q: Array, pose: Array, wish: float, bounded: bool) -> Array:
    rows, velocity = [q], np.zeros(7)
    bounds: dict[str, Any] = {"dt": DT, "velocity": 2.0, "acceleration": 10.0} if bounded else {}
    for _ in range(1000):
        given = {**bounds, "velocity_now": velocity} if bounded else {}
        now = aa.step(arm, rows[-1], pose, policy=aa.Towards(psi=wish), **given)
        assert now.status == aa.Status.OK
        velocity = now.velocity
        rows.append(now.q)
    return np.array(rows)
