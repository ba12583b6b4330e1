"""Laws of what is wished of a plan's arm angle: the nearer the more it weighs, in every form of the wish."""

from __future__ import annotations

import numpy as np
import pytest
from support.moves import line, refused
from support.plan_objective import EVEN
from support.planned_arms import IIWA

import armangle as aa

POSTURE = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])
PATH = line(IIWA, POSTURE, np.array([0.05, -0.2, 0.1]))
PSI = float(IIWA.forward(POSTURE)[1])
KEEN = aa.Objective(psi=1e4)


def off(result: aa.JointPath, wished: np.ndarray) -> float:
    """The mean of 2 - 2 cos(psi - wished) along a plan."""
    assert result.certified
    return float((2 - 2 * np.cos(result.at(EVEN).psi - wished)).mean())


def wave(s: np.ndarray) -> np.ndarray:
    """A wished psi at s that oscillates within the arcs."""
    return PSI + 0.3 * np.sin(5 * s)


@pytest.mark.parametrize(
    "wish", [PSI + 0.4, wave, wave(np.linspace(0, 1, 200))], ids=["one", "function", "many"]
)
def test_a_wish_that_weighs_enough_is_kept(wish: object) -> None:
    """A plan keeps a wished psi, one, a function of s or many, if Objective(psi) is large."""
    wished = wave(EVEN) if not isinstance(wish, float) else np.full(len(EVEN), wish)
    free = aa.plan(IIWA, PATH, gc=2, psi=wish, objective=KEEN)  # type: ignore[arg-type]  # any of the three
    assert off(free, wished) < 1e-4
    held = aa.plan(IIWA, PATH, start=POSTURE, psi=wish, objective=KEEN)  # type: ignore[arg-type]  # as above
    np.testing.assert_allclose(held.q[0], POSTURE, atol=1e-9)
    assert abs(held.psi[-1] - wished[-1]) < 0.01
    assert held.diagnosis.branches[0].stationarity < 1e-8


@pytest.mark.parametrize("direction", ["up", "left", (0.3, -0.4, 0.2)])
def test_the_elbow_goes_where_it_is_wished(direction: object) -> None:
    """A plan with psi=Towards(direction) brings the elbow as far that way as limits allow."""
    towards = aa.Towards(direction=direction)  # type: ignore[arg-type]  # a word or a vector
    result = aa.plan(IIWA, PATH, gc=2, psi=towards, objective=KEEN)
    unit = np.array({"up": (0, 0, 1), "left": (0, 1, 0)}.get(str(direction), direction), dtype=float)
    here = result.at(EVEN)
    wished = IIWA.psi_towards(here.pose, 2, direction=direction)  # type: ignore[arg-type]  # as above
    plain = aa.plan(IIWA, PATH, gc=2).at(EVEN)
    assert (IIWA.elbow(here.q) @ unit).mean() >= (IIWA.elbow(plain.q) @ unit).mean()
    assert off(result, wished) < 0.01 or result.margin.min() < 0.3  # as far as the limits let it


def test_a_point_and_the_place_of_the_elbow_are_one_wish() -> None:
    """A plan with psi=Towards(point) keeps the psi of `psi_towards` for that point."""
    point = IIWA.elbow(POSTURE) + np.array([0.0, 0.1, 0.0])
    result = aa.plan(IIWA, PATH, gc=2, psi=aa.Towards(point=point), objective=KEEN)
    here = result.at(EVEN)
    assert off(result, IIWA.psi_towards(here.pose, 2, point)) < 1e-3


def test_more_weight_never_takes_the_arm_angle_farther_off() -> None:
    """The more Objective(psi) weighs, the nearer a plan is to the wished psi."""
    for wish in (PSI + 1.0, PSI - 2.5, aa.Towards(direction="down")):
        wished = wish if isinstance(wish, float) else IIWA.psi_towards(PATH.pose(EVEN), 2, direction="down")
        values = [
            off(aa.plan(IIWA, PATH, start=POSTURE, psi=wish, objective=aa.Objective(psi=weight)), wished)
            for weight in (0.0, 0.1, 1.0, 10.0, 100.0)
        ]
        assert (np.diff(values) <= 1e-4 * np.array(values[:-1]) + 1e-9).all(), values
        assert values[-1] < values[0]


def test_a_weight_of_0_is_no_wish() -> None:
    """`plan` with a psi of weight 0 is the plan without."""
    alone = aa.plan(IIWA, PATH, start=POSTURE)
    assert np.array_equal(
        aa.plan(IIWA, PATH, start=POSTURE, psi=1.0, objective=aa.Objective(psi=0)).q, alone.q
    )


@pytest.mark.parametrize("tool", [None, aa.pose([0.0, 0.05, 0.1], rpy=[0.2, 0.1, 0.0])])
def test_a_wish_is_of_the_arms_own_reference_base_and_tool(tool: np.ndarray | None) -> None:
    """A wish for a plan is measured in the arm's own reference, base and tool."""
    arm = IIWA.with_(base=aa.pose([0.1, 0.2, 0.3], rpy=[0.3, 0.2, 0.1]), reference="stereographic")
    arm = arm if tool is None else arm.with_tool(tool)
    path, psi = line(arm, POSTURE, np.array([0.05, -0.1, 0.1])), float(arm.forward(POSTURE)[1])
    assert off(aa.plan(arm, path, gc=2, psi=psi, objective=KEEN), np.full(len(EVEN), psi)) < 1e-5
    up = aa.plan(arm, path, gc=2, psi=aa.Towards(direction="forward"), objective=KEEN)
    assert off(up, arm.psi_towards(path.pose(EVEN), 2, direction="forward")) < 0.05


@pytest.mark.parametrize(
    ("psi", "error"),
    [
        ([], aa.errors.InputError), (np.zeros((2, 2)), aa.errors.InputError),
        (np.nan, aa.errors.InputError), (1e9, aa.errors.InputError),
        (lambda s: 1.0, aa.errors.InputError), ("up", aa.errors.ArmangleError),
    ],
)  # fmt: skip
def test_what_is_no_wish_is_refused(psi: object, error: type[Exception]) -> None:
    """`plan` refuses a psi that is neither angles nor a function of all s nor Towards."""
    refused(error, "psi", lambda: aa.plan(IIWA, PATH, psi=psi))  # type: ignore[arg-type]  # wrong on purpose


def test_a_word_is_told_where_it_belongs() -> None:
    """`plan(psi="up")` says to write Towards(direction="up")."""
    with pytest.raises(aa.InputError, match=r"wanted rad, or Towards\(direction='up'\) for the elbow"):
        aa.plan(IIWA, np.eye(4)[None], psi="up")
