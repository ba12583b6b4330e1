"""Joint functions: value, derivative, stationary and singular values, and the paper's case."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from support.laws import circle_gap, gap
from support.strategies import REGIMES, Array, arms, bends, postures, unlimited

import armangle as aa

PSI = np.linspace(-np.pi, np.pi, 181)[1:]


def functions(regime: str, count: int = 3) -> Iterator[tuple[aa.Arm, Array, int, aa.types.JointFunction]]:
    """Yield arm (every second one, without limits), pose, gc and joint function, of all joints at `count`
    poses of a regime.
    """
    for arm in arms()[::2]:
        free = unlimited(arm)
        pose, _, gc = free.forward(postures(arm, regime, count, 21))
        for frame, index in zip(pose, gc, strict=True):
            for joint in range(1, 8):
                yield free, frame, int(index), aa.gradients.joint_function(free, frame, int(index), joint)


@pytest.mark.parametrize("shape", [(), (0,), (2, 3)], ids=str)
def test_a_batch_is_its_elements(shape: tuple[int, ...]) -> None:
    """`value` and `derivative` of a joint function take psi of any shape."""
    pose, _, gc = arms()[0].forward(np.full(7, 0.3))
    function = aa.gradients.joint_function(arms()[0], pose, gc, 3)
    psi = np.random.default_rng(1).uniform(-9, 9, shape)
    for answer in (function.value, function.derivative):
        assert np.shape(answer(psi)) == shape
        assert all(answer(psi)[index] == answer(psi[index]) for index in np.ndindex(shape))


@pytest.mark.parametrize("regime", REGIMES)
def test_the_value_is_the_inverse_and_the_derivative_the_self_motion(regime: str) -> None:
    """`JointFunction.value` equals `inverse`, and `derivative` `self_motion`, to the bit."""
    for arm, pose, gc, function in functions(regime):
        j = function.joint - 1
        assert np.array_equal(function.value(PSI), arm.inverse(pose, PSI, gc, limits=False)[:, j])
        assert np.array_equal(function.derivative(PSI), arm.self_motion(pose, PSI, gc)[:, j])


def test_the_value_lies_in_the_turn_within_the_limits() -> None:
    """`JointFunction.value` has the turn of `inverse`, of an arm whose limits are not around 0."""
    arm = aa.Arm.from_catalogue("barrett_wam7")
    pose, psi, gc = arm.forward(postures(arm, "uniform", 1, 22)[0])
    for joint in range(1, 8):
        assert (
            aa.gradients.joint_function(arm, pose, gc, joint).value(psi)
            == arm.inverse(pose, psi, gc, limits=False)[joint - 1]
        )


def test_the_derivative_is_the_difference_quotient() -> None:
    """`JointFunction.derivative` equals differences of `value`."""
    step = 1e-6
    for arm, pose, gc, function in functions("uniform"):
        sine = np.abs(np.sin(bends(arm, arm.inverse(pose, PSI, gc, limits=False))))[:, [0, 2]].min(-1)
        psi = PSI[sine > 0.05]
        change = function.value(psi + step) - function.value(psi - step)
        quotient = (np.mod(change + np.pi, 2 * np.pi) - np.pi) / (2 * step)
        assert gap(quotient, function.derivative(psi)) <= 1e-6


@pytest.mark.parametrize("regime", ["uniform", "near_singular", "at_reach"])
def test_the_derivative_vanishes_at_stationary_values_and_nowhere_else(regime: str) -> None:
    """`derivative` is 0 at `stationary` and changes sign only there or at `singular`."""
    for _, _, _, function in functions(regime):
        slope = function.derivative(PSI)
        scale = np.abs(slope[np.isfinite(slope)]).max(initial=0)
        stationary = function.stationary
        assert stationary.shape in ((0,), (1,), (2,))
        assert ((stationary > -np.pi) & (stationary <= np.pi)).all()
        if function.kind == "constant":
            assert scale <= 1e-3
            continue
        assert gap(function.derivative(stationary), np.zeros(len(stationary))) <= 1e-6 * max(scale, 1.0)
        if function.kind == "monotonic":
            assert (slope > 0).all() or (slope < 0).all()
        turns = np.flatnonzero(np.sign(slope[:-1]) * np.sign(slope[1:]) < 0)
        special = np.concatenate([stationary, function.singular])
        for k in turns:
            assert circle_gap(special, (PSI[k] + PSI[k + 1]) / 2).min() <= 0.03


def test_a_pivot_jumps_by_half_a_turn_at_a_singular_value_and_a_hinge_has_a_corner() -> None:
    """At a singular psi joints 1 and 3 jump by half a turn, and joint 2 has a corner."""
    arm = unlimited(aa.Arm.from_catalogue("kuka_iiwa7_r800"))
    pose, psi, gc = arm.forward([0.3, 0.0, 0.2, -1.0, 0.4, 0.7, 0.1])  # theta_2 = 0 at this psi alone
    for joint, jump in ((1, np.pi), (3, np.pi), (2, 0.0)):
        function = aa.gradients.joint_function(arm, pose, gc, joint)
        assert function.kind == "singular"
        assert circle_gap(function.singular, psi).max() <= 1e-6
        before, after = function.value(function.singular[0] + np.array([-1e-4, 1e-4]))
        assert circle_gap(after - before, jump) <= 1e-3
    slopes = aa.gradients.joint_function(arm, pose, gc, 2).derivative(psi + np.array([-1e-4, 1e-4]))
    assert slopes[0] == pytest.approx(-slopes[1], abs=1e-3)
    assert {aa.gradients.joint_function(arm, pose, gc, joint).kind for joint in (5, 6, 7)} <= {
        "stationary",
        "monotonic",
    }


def test_the_four_kinds() -> None:
    """Joint functions have four kinds; joint 4 is constant."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    kinds = {function.kind for regime in REGIMES for *_, function in functions(regime)}
    assert kinds == {"stationary", "monotonic", "singular", "constant"}
    pose, _, gc = arm.forward(np.radians([10, 20, 30, 40, 50, 60, 70.0]))
    assert aa.gradients.joint_function(arm, pose, gc, 4).kind == "constant"
    straight = arm.forward(np.radians([10, 20, 30, 0, 50, 60, 70.0]))
    kinds = [aa.gradients.joint_function(arm, straight[0], straight[2], joint).kind for joint in (1, 2, 3)]
    assert kinds == ["constant", "constant", "monotonic"]
