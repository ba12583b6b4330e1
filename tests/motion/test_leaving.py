"""From where theta_2 = 0 or theta_6 = 0, home postures among them, the elbow goes where it is wished."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.moves import begun

import armangle as aa
from armangle.models.catalogue import srs_catalogue

Array = NDArray[np.float64]

DT = 0.01
ROOM = 0.1  # rad that the wish is off the ends of its arc
STARTS = {
    "home": [0, 0, 0, -np.pi / 2, 0, np.pi / 2, 0],
    "shoulder": [0.5, 0, 0, -1.4, 0.3, 1.0, 0],
    "wrist": [0.3, 0.6, 0.2, -1.2, 0, 0, 0.2],
}


def wishes(arm: aa.Arm, pose: Array, gc: int, psi: float, start: str) -> list[float]:
    """Arm angles on both sides of psi to which an arc of one branch leads on without a gap."""
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
    """An arm of the catalogue, each of four in turn."""
    return aa.Arm.from_catalogue(request.param)


@pytest.mark.turns(24)
@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("by", ["tracker", "step", "bounded step"])
@pytest.mark.parametrize("off", [0, 1e-9, 1e-7, 1e-5, 1e-3, 1e-2])
def test_a_wish_from_where_two_branches_meet_is_met(arm: aa.Arm, start: str, by: str, off: float) -> None:
    """From θ2 or θ6 near 0, tracker and steps reach a wished psi while the tool stands."""
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
    """Track a pose with a wished arm angle; return the joints (1001, 7) from q on."""
    tracker = begun(q, arm, DT, velocity=2.0, acceleration=10.0)
    base = (arm.base @ np.array([0, 0, arm.geometry.d_bs, 1.0]))[:3]
    elbow = arm.elbow(arm.inverse(pose, wish, arm.forward(q)[2], limits=False))
    ticks = [tracker.step(pose, elbow_direction=elbow - base) for _ in range(1000)]
    assert all(t.status == aa.Tracking.FOLLOWING for t in ticks)
    return np.array([q, *(t.q for t in ticks)])


def stepped(arm: aa.Arm, q: Array, pose: Array, wish: float, bounded: bool) -> Array:
    """Step to a pose towards a wished arm angle; return the joints (1001, 7) from q on."""
    rows, velocity = [q], np.zeros(7)
    bounds: dict[str, Any] = {"dt": DT, "velocity": 2.0, "acceleration": 10.0} if bounded else {}
    for _ in range(1000):
        given = {**bounds, "velocity_now": velocity} if bounded else {}
        now = aa.step(arm, rows[-1], pose, policy=aa.Towards(psi=wish), **given)
        assert now.status == aa.Status.OK
        velocity = now.velocity
        rows.append(now.q)
    return np.array(rows)


@pytest.mark.parametrize(("name", "degrees"), [
    ("kuka_iiwa14_r820", [0, 0, 45, 90, 0, 45, 0]), ("kuka_iiwa14_r820", [45, 0, -45, -90, 0, 90, 0]),
    ("kuka_iiwa7_r800", [0, -45, 0, -90, 0, 0, 45]), ("realman_rm75_b", [0, 0, 0, -90, 0, 90, 0]),
    ("human_arm_left", [0, 0, 0, 90, 0, -90, 0]), ("human_arm_left", [0, 90, 0, 90, 0, -90, 0]),
])  # fmt: skip
def test_a_hand_that_stands_where_branches_meet_moves_nothing(name: str, degrees: list[float]) -> None:
    """A tracker at a home posture whose hand stands moves no joint."""
    arm, q = aa.Arm.from_catalogue(name), np.radians(degrees)
    tracker = begun(q, arm, 0.004, velocity=2.0)
    pose = arm.forward(q)[0]
    for _ in range(500):
        now = tracker.step(pose)
        assert now.status == aa.Tracking.FOLLOWING
    np.testing.assert_allclose(now.q, q, atol=1e-12)


@pytest.mark.parametrize(("name", "q", "wish"), [
    ("kuka_iiwa7_r800", [0.62, 0, -2.29, -1.18, 0, -0.283, 0], 2.4764),  # in the branch that meets
    ("barrett_wam7", [0, -1.5, 0, -0.376, 0, 0, -0.968], 5.2481),
    ("kuka_iiwa14_r820", [0, 0, -1.67, -1.57, 0, 0, 1.44], 1.82),
    ("kuka_iiwa7_r800", [0, -1.276, -0.417, -0.773, 0, 0, -2.853], 3.9747),  # one pivot at its limit
    ("yaskawa_sia10d", [0.46, -0.835, 0, -1.375, 0.681, 0, -2.766], 2.02),
    ("fourier_gr2t2v2_left", [0, 1.5707963268048966, 0.05284408618314007, -0.17421247398261341, 0,
                              -0.1219033927541826, 0], -0.19184937740222702),  # theta_2 = 1e-11
])  # fmt: skip
def test_a_step_leaves_by_the_way_that_leads_to_its_wish(name: str, q: list[float], wish: float) -> None:
    """Steps with Towards(psi) from θ2 or θ6 near 0 come to rest at psi."""
    arm, now = aa.Arm.from_catalogue(name), np.array(q)
    pose = arm.forward(now)[0]
    for _ in range(500):
        step = aa.step(arm, now, pose, policy=aa.Towards(psi=wish))
        assert step.status == aa.Status.OK
        move, now = np.abs(step.q - now).max(), step.q
    assert abs(np.angle(np.exp(1j * (step.psi - wish)))) <= 1e-6
    assert move <= 1e-9


@pytest.mark.parametrize("off", [0.0, 1e-11])
@pytest.mark.parametrize("longest", [0.02, 0.2])
def test_the_middle_of_an_arc_leads_no_joint_round_for_ever(off: float, longest: float) -> None:
    """Steps with Centre at θ6 = 0 come to rest, though joint 7's limits end the way to the middle."""
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    q = np.array([-2.718, 0.8238, 2.4703, 0.7597, 0.0, off, 1.6856])
    pose, _, gc = arm.forward(q)
    for _ in range(1000):
        now = aa.step(arm, q, pose, gc=int(gc), policy=aa.Centre(K=0.05), max_joint_step=longest)
        assert now.status == aa.Status.OK
        move, q = np.abs(now.q - q).max(), now.q
    assert move <= 1e-6


def _hinge_postures(arm: aa.Arm, rng: np.random.Generator) -> Iterator[Array]:
    """Yield postures at which the axes beside joint 2, or 6, are one: theta there is 0, or pi."""
    q = rng.uniform(np.maximum(arm.lower, -3.1), np.minimum(arm.upper, 3.1))
    for joint in (1, 5):
        for value in np.arange(-8, 9) * np.pi / 8:
            at = q.copy()
            at[joint] = value
            axes = arm.jacobian(at)[3:]
            parallel = abs(axes[:, joint - 1] @ axes[:, joint + 1]) > 1 - 1e-12
            if arm.lower[joint] <= value <= arm.upper[joint] and parallel:
                yield at


def test_a_step_that_is_ok_holds_the_pose_whichever_way_the_axes_of_a_hinge_point() -> None:
    """A step that is OK holds the pose where the axes next to joint 2 or 6 are parallel or opposite."""
    rng, held = np.random.default_rng(5), 0
    for name in srs_catalogue():
        arm = aa.Arm.from_catalogue(name)
        for q in (at for _ in range(6) for at in _hinge_postures(arm, rng)):
            pose = arm.forward(q)[0]
            for policy in (aa.Centre(), aa.Towards(direction="up")):
                found = aa.step(arm, q, pose, policy=policy)
                if found.status == aa.Status.OK:
                    held += 1
                    assert np.abs(arm.forward(found.q)[0] - pose).max() < 1e-9, name
    assert held > 300
