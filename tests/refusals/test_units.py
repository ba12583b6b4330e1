"""Numbers that were probably meant in degrees or mm give a warning; legitimate ones do not."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
FR3 = aa.Arm.from_catalogue("franka_fr3")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
POSE, PSI, GC = ARM.forward(Q)
TURN = 2 * np.pi


def shifted(x: float) -> np.ndarray[Any, Any]:
    """Return a frame at (x, 0, 0)."""
    out = np.eye(4)
    out[0, 3] = x
    return out


CALLS: dict[str, tuple[Callable[[float], Any], float, float]] = {
    "inverse": (lambda x: ARM.inverse(POSE, x, GC, limits=False), PSI + TURN, 58.0),
    "inverse, every branch": (lambda x: ARM.inverse(POSE, x, limits=False, on_error="nan"), PSI + TURN, 58.0),
    "inverse, some": (
        lambda x: ARM.inverse(np.stack([POSE, POSE]), [PSI, x], [GC, GC], limits=False),
        PSI + TURN,
        -58.0,
    ),
    "inverse, offset": (lambda x: FR3.inverse(POSE, x, GC, limits=False, on_error="nan"), 3.0, 58.0),
    "self_motion": (lambda x: ARM.self_motion(POSE, x, GC), PSI + TURN, 58.0),
    "resolve": (lambda x: aa.resolve(ARM, POSE, x, GC), PSI + TURN, 58.0),
    "Towards": (lambda x: aa.Towards(psi=x), TURN, 58.0),
    "ArcSet": (lambda x: aa.ArcSet([[0.5 * x, x]]), TURN, 120.0),
    "step": (lambda x: aa.step(ARM, Q, POSE, max_joint_step=x), 3.0, 10.0),
    "follow": (lambda x: aa.follow(ARM, POSE[None], start=Q, max_joint_step=x), 3.0, 10.0),
    "tool": (lambda x: ARM.with_(tool=shifted(x)), 0.2, 200.0),
    "Arm": (lambda x: aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1, tool=shifted(x)), 1.0, 120.0),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_number_in_another_unit_is_warned_of(name: str) -> None:
    """Each call warns of a number that looks like degrees or mm, and not of a plausible one."""
    call, meant, other = CALLS[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        call(meant)
    unit = "mm" if name in ("tool", "Arm") else "degrees"
    with pytest.warns(UserWarning, match=unit) as told:
        call(other)
    assert f"{abs(other):g}" in str(told[0].message)


def test_a_base_may_stand_far_away_as_that_of_a_mobile_robot_in_a_map() -> None:
    """A base 5 km from the origin is no length in mm."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ARM.with_(base=shifted(5000.0))


def test_no_bound_is_no_unit() -> None:
    """An infinite max_joint_step, and tools set anew, give no warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert aa.step(ARM, Q, POSE, max_joint_step=np.inf).ok
        ARM.with_(tool=shifted(0.2)).with_(tool=shifted(0.1))
