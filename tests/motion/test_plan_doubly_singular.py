"""Starts and goals with theta2 and theta6 both at 0: which lines the tool can leave them along, and how."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from support.draw import count, generator
from support.moves import limited, line, proven
from support.planned_arms import IIWA

import armangle as aa

HOMES = np.radians([[0, 0, 0, -90, 0, 0, 0], [20, 0, -30, -90, 10, 0, 15], [-40, 0, 25, -60, 50, 0, -25]])
JOINTS = [(1, 3), (5, 7)]
"""That share a turn."""


def blocked(q: np.ndarray) -> np.ndarray:
    """The unit direction (3,) in which no joint speeds move the tool without turning it."""
    left, sizes, _ = np.linalg.svd(IIWA.jacobian(q))
    assert sizes[5] < 1e-12 < sizes[4]
    return np.asarray(left[:3, 5] / np.linalg.norm(left[:3, 5]))


@pytest.mark.turns(6)
@pytest.mark.parametrize("home", HOMES, ids=["home", "turned", "further"])
@pytest.mark.parametrize("length", [0.01, 0.1])
def test_lines_in_the_plane_that_is_not_blocked(home: np.ndarray, length: float) -> None:
    """Plans along directions that are not blocked are certified and even, from home and back."""
    out, rng = blocked(home), generator(13)
    shifts = list(rng.normal(size=(count(4), 3)))
    if not home.any():
        shifts += [np.array([x, 0, z]) for x, z in itertools.product((-1, 0, 1), repeat=2) if x or z]
    for shift in shifts:
        within = shift - shift @ out * out
        there = line(IIWA, home, length * within / np.linalg.norm(within))
        gone = aa.plan(IIWA, there, start=home)
        back = aa.plan(IIWA, aa.Line(there.end, there.start), goal=home)
        proven(gone, start=home), proven(back, goal=home)
        for result, s, h in ((gone, 0.0, 1e-3), (back, 1.0, -1e-3)):
            assert np.abs(np.diff(result.q, axis=0)).max() < 0.1 * length
            at_end, beside = result.derivatives([s, s + 1e-6 * h])[:, 0]
            np.testing.assert_allclose(at_end, beside, atol=1e-6)
            slope = (4 * result.at(s + h).q - result.at(s + 2 * h).q - 3 * result.at(s).q) / (2 * h)
            np.testing.assert_allclose(at_end, slope, atol=1e-4)


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("home", HOMES, ids=["home", "turned", "further"])
@pytest.mark.parametrize("end", ["start", "goal"])
def test_other_lines_name_the_turn_on_the_spot(home: np.ndarray, end: str) -> None:
    """A plan along a blocked direction fails; after the turns that it names a plan leads, after two thirds
    none.
    """
    rng = generator(17)
    for _ in range(count(2)):
        shift = rng.normal(size=3)
        path = line(IIWA, home, 0.08 * shift / np.linalg.norm(shift), back=end == "goal")
        refused = aa.plan(IIWA, path, **{end: home}, samples=50)
        if not aa.plan(IIWA, path, samples=2).ok:
            continue
        own = refused.diagnosis[2]
        assert not refused.ok and [joint for joint, _ in own.turns] == [1, 5]
        for (joint, turn), (_, back) in zip(own.turns, JOINTS, strict=True):
            assert f"joint {joint} by {np.degrees(turn):.3g}° (and joint {back} back" in own.explain()
            for share in (1.0, 2 / 3):
                turned = home.copy()
                turned[[joint - 1, back - 1]] += np.array([share, -share]) * turn
                np.testing.assert_allclose(IIWA.forward(turned)[0], IIWA.forward(home)[0], atol=1e-12)
                result = aa.plan(IIWA, path, **{end: turned}, samples=50)
                assert result.ok == (share == 1)
                if result.ok:
                    proven(result)


def test_a_turn_is_named_within_the_limits() -> None:
    """The diagnosis names no turns on the spot that the limits forbid."""
    home, path = HOMES[0], line(IIWA, HOMES[0], [0.05, 0.03, -0.1])
    free = dict(aa.plan(IIWA, path, start=home).diagnosis[2].turns)
    tight = limited(limited(IIWA, 0, -0.3, 0.3), 4, -0.1, 0.1)
    assert abs(free[1]) > 0.3 and abs(free[5]) > 0.1
    assert aa.plan(tight, path, start=home).diagnosis[2].turns == ()


def test_a_limit_just_inside_where_a_joint_is_drawn_to_is_not_certified() -> None:
    """A limit just inside where joints next to a singular hinge go is not certified, a wider one is."""
    home, shift = HOMES[1], np.array([0.1, 0.0, 0.05])
    out = blocked(home)
    x = aa.plan(IIWA, line(IIWA, home, shift - shift @ out * out), start=home).curve
    assert x is not None and x.stretches[0, 22] in (1, 5)
    beside = (5, 7) if x.stretches[0, 22] == 1 else (1, 3)
    for joint, inset in itertools.product(beside, (1e-6, -1e-3)):
        q = x.at(IIWA._handle, np.array([0.0, x.knots[1]])).q[:, joint - 1]
        side = {"lower": q[0] + inset} if q[1] > q[0] else {"upper": q[0] - inset}
        arm = limited(IIWA, joint - 1, **side)
        open_, _ = arm._handle.certify_curve(x.segments, x.stretches, x.plane, x.gc, 0.0)
        assert (len(open_) > 0 and open_[0, 0] == 0) == (inset > 0)
