"""One request, one budget of work: whatever plans it takes, they share it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support.calibrated import calibrated
from support.moves import line
from support.planned_arms import IIWA

import armangle as aa
from armangle import _core

TORCH = aa.pose([0.05, 0.0, 0.2], rpy=[0.0, np.radians(45), 0.0])
POSTURE = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
WAY = [0.05, 0.12, -0.07]


def cluttered(arm: aa.Arm, soft: float = 0.0) -> aa.Arm:
    """The arm among five balls around the way from `POSTURE`, none nearer than 3 cm to it."""
    arm = arm.with_(body=aa.Body.bones(upper_arm=0.05, forearm=0.04))
    rng, tip = np.random.default_rng(5), arm.forward(POSTURE)[0][:3, 3]
    balls: list[aa.Ball] = []
    while len(balls) < 5:
        ball = aa.Ball(tip + 0.3 * rng.normal(size=3), 0.05, name=f"ball {len(balls)}")
        if arm.with_(scene=aa.Scene([ball])).clearance(POSTURE).distance > 0.03:
            balls.append(ball)
    return arm.with_(scene=aa.Scene(balls, clearance=0.01, soft=soft))


def asked(arm: aa.Arm, monkeypatch: pytest.MonkeyPatch, request: Callable[[], object]) -> list[list[int]]:
    """The work that each plan of the core got for a request, and what it left."""
    out: list[list[int]] = []
    kind = type(arm._handle)
    plain = kind.plan_path

    def counted(*args: Any) -> Any:
        """Plan, and keep the work before and after."""
        found = plain(*args)
        out.append([args[-2], found[8]])
        return found

    monkeypatch.setattr(kind, "plan_path", counted)
    request()
    return out


@pytest.mark.parametrize(
    "arm", [IIWA, aa.Arm.from_catalogue("franka_fr3"), calibrated("kuka_iiwa7_r800", 1, 1)]
)
@pytest.mark.parametrize("roll", ["pose", "free"])
def test_all_plans_of_a_request_share_its_work(
    arm: aa.Arm, roll: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No plan gets more work than those before it left, and all of them take little more than there is."""
    arm = cluttered(arm.with_(tool=TORCH), soft=0.02)
    path = line(arm, POSTURE, WAY)
    plans = asked(arm, monkeypatch, lambda: aa.plan(arm, path, start=POSTURE, roll=roll, samples=5))
    left = _core.PLAN_WORK
    for given, after in plans:
        assert given <= left
        left -= given - after
    assert len(plans) > (roll == "free") and left > -0.2 * _core.PLAN_WORK
    assert aa.plan(arm, path, start=POSTURE, roll=roll, samples=5).certified
