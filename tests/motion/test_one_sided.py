"""A straight elbow bends to the side that its limits leave: by steps, by a tracker, and along a plan."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from support.draw import generator
from support.moves import Array, begun, moved

import armangle as aa
from armangle.models.catalogue import srs_catalogue


def straight(arm: aa.Arm) -> float:
    """The joint value q_4 (rad) of a straight elbow."""
    return float(arm.geometry.signs[3] * (arm.geometry.delta - arm.geometry.offsets[3]))


def one_sided() -> list[tuple[aa.Arm, float]]:
    """S-R-S arms whose joint 4 has room on one side of the straight elbow only, and that side as a sign of
    q_4.
    """
    out = []
    for arm in map(aa.Arm.from_catalogue, srs_catalogue()):
        above, below = float(arm.upper[3]) - straight(arm), straight(arm) - float(arm.lower[3])
        bare = 0 <= min(above, below) < 0.01 < max(above, below) and arm.geometry.a_3 == arm.geometry.a_4 == 0
        if bare or arm.name in ("pollen_reachy2_left", "fourier_gr2t2_left"):  # these have hardly more
            out.append((arm, 1.0 if above > below else -1.0))
    return out


each_arm = pytest.mark.parametrize(("arm", "side"), one_sided(), ids=lambda value: getattr(value, "name", ""))


ROMEO = [0.15137640446, 0.46824608777, 2.0809154347, 0, -0.32950646557, -0.13521416816, -0.44923353052]
REACHY = [-2.41481704695, 2.60610536332, 2.13198512918, 0, 0.32602725217, 0.59456195696, 1.05061772382]
FAILED = {"aldebaran_romeo_left": ROMEO, "pollen_reachy2_left": REACHY}
"""Where a plan bent it to the other side."""


def starts(arm: aa.Arm, side: float) -> list[Array]:
    """Joints with the elbow straight, and off to the side without room as far as the limits allow it."""
    rng, out = generator(8), []
    for off in (0.0, 1e-4, 3e-3):
        q = np.clip(rng.uniform(-0.3, 0.3, 7), arm.lower + 0.01, arm.upper - 0.01)
        q[3] = straight(arm) - off * side
        if arm.within_limits(q):
            out.append(q)
    assert out
    return out


@pytest.mark.turns(4)
@each_arm
@pytest.mark.parametrize("acceleration", [np.inf, 8.0])
def test_by_steps(arm: aa.Arm, side: float, acceleration: float) -> None:
    """Bounded steps from a straight elbow bend it to the side with room and reach the pose."""
    rng = np.random.default_rng(8)
    for start in starts(arm, side):
        goal = start + rng.uniform(-0.01, 0.01, 7)
        goal[3] = straight(arm) + 0.02 * side
        pose, q, v = arm.forward(goal)[0], start, np.zeros(7)
        for _ in range(3000):
            taken = aa.step(arm, q, pose, velocity=0.6, acceleration=acceleration, velocity_now=v, dt=1e-3)
            assert taken.status in (aa.Status.OK, aa.Status.PARTIAL), taken.status
            assert arm.within_limits(taken.q)
            still = np.abs(taken.q - q).max() < 1e-9
            q, v = taken.q, taken.velocity
            if taken.status == aa.Status.OK and still:
                break
        np.testing.assert_allclose(arm.forward(q)[0], pose, atol=1e-6)


@each_arm
def test_by_a_tracker(arm: aa.Arm, side: float) -> None:
    """A tracker from a straight elbow bends it to the side with room and follows the hand."""
    for start in starts(arm, side):
        away = start + 0.2 * np.array([1, -1, 1, 0, -1, 1, -1])
        there = np.clip(away, arm.lower + 0.05, arm.upper - 0.05)
        there[3] = straight(arm) + side
        share = 0.5 * (1 - np.cos(np.linspace(0, np.pi, 1000)))
        hands = arm.forward(start + share[:, None] * (there - start))[0]
        tracker = begun(start, arm, 0.004, velocity=2.0)
        tracker.run(np.concatenate([hands, np.repeat(hands[-1:], 1000, axis=0)]))
        assert tracker.step(hands[-1]).status == aa.Tracking.FOLLOWING


@pytest.mark.turns(4)
@each_arm
@pytest.mark.parametrize("end", ["start", "goal"])
def test_along_a_plan(arm: aa.Arm, side: float, end: str) -> None:
    """A plan that starts or ends at a straight elbow is certified, whatever the sign of a rounding error of
    q_4.
    """
    postures = [starts(arm, side)[0], np.array(FAILED.get(arm.name, [0.2, 0.4, 0.3, 0, 0.1, 0.3, 0.2]))]
    for q, zero in itertools.product(postures, (0.0, -0.0, 1e-16, -1e-16)):
        q[3] = straight(arm) + zero
        first = arm.forward(q)[0]
        out = first[:3, 3] - arm.frames(q)[1, :3, 3]
        last = moved(first, -0.05 * out / np.linalg.norm(out))
        path = aa.Line(first, last) if end == "start" else aa.Line(last, first)
        result = aa.plan(arm, path, **{end: q})
        assert result.certified, (arm.name, q.tolist(), result.explain())
        np.testing.assert_allclose(result.q[0 if end == "start" else -1], q, atol=1e-7)
