"""Starts and goals with theta2 and theta6 both at 0: which lines the tool can leave them along, and how."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from support.draw import count, generator
from support.planned_arms import IIWA

import armangle as aa

DENSE = np.linspace(0, 1, 5001)
HOMES = np.radians([[0, 0, 0, -90, 0, 0, 0], [20, 0, -30, -90, 10, 0, 15], [-40, 0, 25, -60, 50, 0, -25]])
JOINTS = [(1, 3), (5, 7)]
"""That share a turn."""


def line(q: np.ndarray, shift: np.ndarray) -> aa.Line:
    """A line of the tool from a posture of the iiwa."""
    first = IIWA.forward(q)[0]
    last = first.copy()
    last[:3, 3] += shift
    return aa.Line(first, last)


def blocked(q: np.ndarray) -> np.ndarray:
    """The direction in which no joint speeds move the tool without turning it: the least left singular
    vector of the Jacobian."""
    left, sizes, _ = np.linalg.svd(IIWA.jacobian(q))
    assert sizes[5] < 1e-12 < sizes[4]
    return np.asarray(left[:3, 5] / np.linalg.norm(left[:3, 5]))


def check_proven(result: aa.JointPath) -> None:
    """A certified motion, on its path, within limits, without a leap."""
    assert result.certified, result.explain()
    here = result.at(DENSE)
    np.testing.assert_allclose(IIWA.forward(here.q)[0], here.pose, atol=1e-12)
    assert IIWA.within_limits(here.q).all()
    speed = np.abs(result.derivatives(DENSE)[:, 0]).max()
    assert np.abs(np.diff(here.q, axis=0)).max() <= 1.5 * speed / (len(DENSE) - 1)


@pytest.mark.parametrize("home", HOMES, ids=["home", "turned", "further"])
@pytest.mark.parametrize("length", [0.01, 0.1])
def test_lines_in_the_plane_that_is_not_blocked(home: np.ndarray, length: float) -> None:
    """The tool can move in two directions of three there, and does so calmly; back it comes as well."""
    out, rng = blocked(home), generator(13)
    shifts = list(rng.normal(size=(count(4), 3)))
    if not home.any():
        shifts += [np.array([x, 0, z]) for x, z in itertools.product((-1, 0, 1), repeat=2) if x or z]
    for shift in shifts:
        within = shift - shift @ out * out
        there = line(home, length * within / np.linalg.norm(within))
        gone = aa.plan(IIWA, there, start=home)
        back = aa.plan(IIWA, aa.Line(there.end, there.start), goal=home)
        for result, end in ((gone, 0), (back, -1)):
            check_proven(result)
            np.testing.assert_allclose(result.q[end], home, atol=1e-9)
            assert np.abs(np.diff(result.q, axis=0)).max() < 0.1 * length
        for result, s in ((gone, [0.0, 1e-9]), (back, [1.0, 1 - 1e-9])):
            at_end, beside = result.derivatives(np.array(s))[:, 0]
            np.testing.assert_allclose(at_end, beside, atol=1e-6)
            h = 1e-3 * (1 - 2 * s[0])
            slope = (4 * result.at(s[0] + h).q - result.at(s[0] + 2 * h).q - 3 * result.at(s[0]).q) / (2 * h)
            np.testing.assert_allclose(at_end, slope, atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("home", HOMES, ids=["home", "turned", "further"])
@pytest.mark.parametrize("end", ["start", "goal"])
def test_other_lines_name_the_turn_on_the_spot(home: np.ndarray, end: str) -> None:
    """A refusal is a law: two thirds of the turn named lead nowhere either, the whole of it does."""
    rng = generator(17)
    for _ in range(count(4)):
        shift = rng.normal(size=3)
        path = line(home, 0.08 * shift / np.linalg.norm(shift))
        if end == "goal":
            path = aa.Line(path.end, path.start)
        refused = aa.plan(IIWA, path, **{end: home}, samples=50)
        if not aa.plan(IIWA, path, samples=2).ok:
            continue
        assert not refused.ok
        assert refused.diagnosis is not None
        own = refused.diagnosis[2]
        assert [joint for joint, _ in own.turns] == [1, 5]
        for (joint, turn), (_, back) in zip(own.turns, JOINTS, strict=True):
            assert f"joint {joint} by {np.degrees(turn):.3g}° (joint {back} back as far)" in own.explain()
            for share in (1.0, 2 / 3):
                turned = home.copy()
                turned[[joint - 1, back - 1]] += np.array([share, -share]) * turn
                np.testing.assert_allclose(IIWA.forward(turned)[0], IIWA.forward(home)[0], atol=1e-12)
                result = aa.plan(IIWA, path, **{end: turned}, samples=50)
                assert result.ok == (share == 1)
                if result.ok:
                    check_proven(result)


def test_a_turn_is_named_within_the_limits() -> None:
    home, path = HOMES[0], line(HOMES[0], np.array([0.05, 0.03, -0.1]))
    refused = aa.plan(IIWA, path, start=home)
    assert refused.diagnosis is not None
    free = dict(refused.diagnosis[2].turns)
    lower, upper = IIWA.lower.copy(), IIWA.upper.copy()
    lower[0], upper[0], lower[4], upper[4] = -0.3, 0.3, -0.1, 0.1
    tight = aa.plan(IIWA.with_(lower=lower, upper=upper), path, start=home)
    assert abs(free[1]) > 0.3 and abs(free[5]) > 0.1
    assert tight.diagnosis is not None and tight.diagnosis[2].turns == ()


def test_a_limit_just_inside_where_a_joint_is_drawn_to_is_not_certified() -> None:
    """Joints beside a hinge that is shut are proven by the slopes of their directions."""
    home = HOMES[1]
    out = blocked(home)
    within = np.array([0.1, 0.0, 0.05]) - np.array([0.1, 0.0, 0.05]) @ out * out
    x = aa.plan(IIWA, line(home, within), start=home).curve
    assert x is not None and x.stretches[0, 22] in (1, 5)
    beside = (5, 7) if x.stretches[0, 22] == 1 else (1, 3)
    for joint, inset in itertools.product(beside, (1e-6, -1e-3)):
        q = x.at(IIWA._handle, np.array([0.0, x.knots[1]])).q[:, joint - 1]
        side = "lower" if q[1] > q[0] else "upper"
        limits = {"lower": IIWA.lower.copy(), "upper": IIWA.upper.copy()}
        limits[side][joint - 1] = q[0] + (inset if side == "lower" else -inset)
        open_, _ = IIWA.with_(**limits)._handle.certify_curve(x.segments, x.stretches, x.plane, x.gc, 0.0)
        assert (len(open_) > 0 and open_[0, 0] == 0) == (inset > 0)
