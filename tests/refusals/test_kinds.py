"""What is not made for a kind of arm is refused by its name; `docs/robots.md` and its test have the rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support.calibrated import calibrated

import armangle as aa

Rows = list[tuple[str, Callable[[aa.Arm], Any]]]
WRIST = "is not made for an arm with an offset wrist"
CHAIN = "is not made for an arm with a chain"


def q(arm: aa.Arm) -> Any:
    """Joints amid the limits, cut to 3 rad, plus 0.1 rad."""
    return 0.5 * (np.maximum(arm.lower, -3.0) + np.minimum(arm.upper, 3.0)) + 0.1


def pose(arm: aa.Arm) -> Any:
    """The pose at `q(arm)`."""
    return arm.forward(q(arm))[0]


def steps(said: str, **asked: Any) -> Rows:
    """Rows of calls of `step` and `follow` with these options; a message holds the option, then `said`."""
    return [
        (f"{name}.* {said}", call)
        for name in asked
        for call in (
            lambda arm: aa.step(arm, q(arm), pose(arm), dt=0.01, **asked),
            lambda arm: aa.follow(arm, pose(arm)[None], start=q(arm), dt=0.01, **asked),
        )
    ]


OFFSET: Rows = [
    ("gradients.joint_function", lambda arm: aa.gradients.joint_function(arm, pose(arm), 0, 1)),
    ("d_4", lambda arm: arm.with_(d_4=0.01)),
    ("reference", lambda arm: arm.with_(reference="stereographic")),
    (r"resolve is not made for .*: step", lambda arm: aa.resolve(arm, pose(arm), 0.0, 0)),
]
OWN: Rows = [
    (rf"\b{name}\b.* {CHAIN} of its own: use arm\.", call)
    for name, call in (
        ("gradients.joint_function", lambda arm: aa.gradients.joint_function(arm, pose(arm), 0, 1)),
        ("aa.kuka", lambda arm: aa.kuka.to_e1(arm, q(arm))),
    )
]
BOTH: Rows = [
    ("deviation", lambda arm: arm.deviation.bands),
    ("singularity_margin= is not made for", lambda arm: arm.with_(singularity_margin=0.1)),
    (
        "reach_map.*proven.*use .* the arm with an offset beside it",
        lambda arm: aa.reach_map(arm, "never made", fields="proven"),
    ),
]
MIRRORED = aa.Arm(a_1=0.1, d_bs=0.3, d_se=0.35, d_ew=0.32, d_wf=0.15, lower=[-2.6] * 7, upper=[2.6] * 7)
KINDS: list[tuple[aa.Arm, Rows]] = [
    (aa.Arm.from_catalogue("franka_fr3"), OFFSET),
    (aa.Arm.from_catalogue("franka_fr3"), steps(WRIST, carry="elbow")),
    (MIRRORED, OFFSET),
    (calibrated("kuka_iiwa7_r800", 1.0, 1.0), OWN),
    (calibrated("franka_fr3", 1.0, 1.0), BOTH),
]


@pytest.mark.parametrize(
    ("arm", "said", "call"),
    [pytest.param(arm, *row, id=f"{arm.kind}-{row[0][:30]}") for arm, rows in KINDS for row in rows],
)
def test_what_is_not_made_for_a_kind_is_refused_by_name(arm: aa.Arm, said: str, call: Any) -> None:
    """Functions that are not made for a kind of arm raise UnsupportedError with their name."""
    with pytest.raises(aa.UnsupportedError, match=said):
        call(arm)


def test_a_calibrated_arm_that_leans_is_told_so_first() -> None:
    """`place` of a calibrated arm that leans names the angle of axis 1."""
    arm = calibrated("kuka_iiwa7_r800", 1.0, 1.0)
    leaning = arm.with_(base=aa.pose([0.0, 0.0, 0.0], rpy=[0.3, 0.0, 0.0]))
    with pytest.raises(aa.InputError, match=r"leans axis 1 by 17\.2 deg"):
        aa.place(leaning, pose(leaning)[None], [0.0], [0.0])
