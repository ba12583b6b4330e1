"""Whether a pose has a posture: every function says the same, beside straight hinges and locks too."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from support import draw
from support.delicate import delicate
from support.strategies import Array, arms

import armangle as aa
from armangle.models.catalogue import srs_catalogue

LOCKABLE = [0, 1, 2, 4, 5, 6]
OFF = [0.0, *(10.0**-k for k in range(4, 14))]
"""How far a hinge is off straight, rad."""

DOORS: dict[str, Callable[[aa.Arm, Array, Array], object]] = {
    "reachable": lambda arm, pose, near: arm.reachable(pose),
    "freedom": lambda arm, pose, near: arm.freedom(pose).gc != 0,
    "explain": lambda arm, pose, near: arm.explain(pose).ok,
    "feasible": lambda arm, pose, near: not np.all(arm.feasible(pose).is_empty),
    "turns of the base": lambda arm, pose, near: arm.feasible_turns(pose, about="base").contains(0.0),
    "turns of the tool": lambda arm, pose, near: arm.feasible_turns(pose, about="tool").contains(0.0),
    "solve": lambda arm, pose, near: arm.solve(pose).ok,
    "solve near": lambda arm, pose, near: arm.solve(pose, seed=near).ok,
    "solve max": lambda arm, pose, near: arm.solve(pose, seed=near, metric="max").ok,
    "farthest from limits": lambda arm, pose, near: arm.solve(pose, prefer="margin").ok,
    "solutions": lambda arm, pose, near: len(arm.solutions(pose, seed=near)) > 0,
}


def answers(arm: aa.Arm, pose: Array, near: Array) -> dict[str, bool]:
    """Whether each function of DOORS says that the pose has a solution."""
    return {name: bool(ask(arm, pose, near)) for name, ask in DOORS.items()}


def beside_straight(rng: np.random.Generator, arm: aa.Arm, locks: int) -> tuple[aa.Arm, Array, Array]:
    """Return an arm with `locks` joints locked, a pose that it holds, singular or nearly, and a
    random seed.
    """
    low, high = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    q = rng.uniform(low, high)
    for hinge in (1, 3, 5):
        straight = arm.geometry.delta if hinge == 3 else rng.choice([0.0, np.pi])
        theta = straight + rng.choice([-1, 1]) * rng.choice(OFF)
        value = arm.geometry.signs[hinge] * (theta - arm.geometry.offsets[hinge])
        value = (value + np.pi) % (2 * np.pi) - np.pi
        if rng.random() < 0.6 and low[hinge] <= value <= high[hinge]:
            q[hinge] = value
    lower, upper = arm.lower.copy(), arm.upper.copy()
    locked = rng.choice(LOCKABLE, locks, replace=False)
    lower[locked] = upper[locked] = q[locked]
    boxed = arm.with_(lower=lower, upper=upper)
    return boxed, boxed.forward(q, on_error="nan")[0], rng.uniform(low, high)


@pytest.mark.turns(4)
@pytest.mark.parametrize("locks", [0, 1, 2, 3])
def test_a_pose_that_a_posture_within_the_limits_has_is_held(locks: int) -> None:
    """All functions say that a pose has a solution, near singularities and with locks; 2 % may all
    deny it.
    """
    # Where two of shoulder, elbow and wrist are straight and a joint is locked, the search in the joints is
    # local and may miss the posture: then all doors agree that there is none.
    rng = draw.generator(71 + locks)
    missed, split = [], []
    count = draw.count(120)
    for i in range(count):
        arm = arms()[i % len(arms())]
        boxed, pose, near = beside_straight(rng, arm, locks)
        said = answers(boxed, pose, near)
        if not all(said.values()):
            missed.append(i)
        if len({said[name] for name in ("reachable", "freedom", "feasible", "solve", "solve near")}) > 1:
            split.append((i, arm.name, said))
    assert split == []
    assert len(missed) <= 0.02 * count * (locks > 0)


@pytest.mark.slow
def test_delicate_poses_are_held_by_every_door() -> None:
    """All functions agree on whether delicate poses have a solution, and 99 % have."""
    count, missed = draw.count(300), 0
    for number in range(count):
        case = delicate(number, 7)
        said = answers(case.arm, case.pose, case.near)
        missed += not all(said.values())
        assert said["reachable"] == said["freedom"] == said["feasible"] == said["solve"], str(case)
    assert missed <= 0.01 * count


@pytest.mark.parametrize("shift", [1e-12, 1e-9])
def test_a_lock_beside_the_posture_is_refused_by_every_door(shift: float) -> None:
    """All functions agree on a pose with two joints locked by 1e-12 or 1e-9 rad beside it."""
    rng = draw.generator(79)
    for arm in arms()[::2]:
        q = rng.uniform(np.maximum(arm.lower, -3), np.minimum(arm.upper, 3))
        lower, upper = arm.lower.copy(), arm.upper.copy()
        lower[[0, 1]] = upper[[0, 1]] = q[[0, 1]] + np.array([shift, -shift])
        boxed = arm.with_(lower=lower, upper=upper)
        pose = boxed.forward(q)[0]
        said = {
            name: bool(DOORS[name](boxed, pose, q)) for name in ("reachable", "freedom", "feasible", "solve")
        }
        assert len(set(said.values())) == 1, (arm.name, said)


def on_limits_beside_straight(rng: np.random.Generator, arm: aa.Arm) -> Array:
    """Return random joints, one or two bends a little off singular, and two or three joints on limits."""
    low, high = np.maximum(arm.lower, -2 * np.pi), np.minimum(arm.upper, 2 * np.pi)
    q = rng.uniform(low, high)
    for hinge in rng.choice([1, 3, 5], rng.integers(1, 3), replace=False):
        straight = arm.geometry.delta if hinge == 3 else rng.choice([0.0, np.pi])
        theta = straight + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-5.5, -0.5)
        value = arm.geometry.signs[hinge] * (theta - arm.geometry.offsets[hinge])
        if low[hinge] <= value <= high[hinge]:
            q[hinge] = value
    for joint in rng.choice(7, rng.integers(2, 4), replace=False):
        q[joint] = rng.choice([low[joint], high[joint]])
    return q


def test_joints_on_their_limits_beside_straight_hold_their_pose() -> None:
    """All functions say that a pose has a solution, near singularities with joints on limits."""
    rng = draw.generator(84)
    for i in range(draw.count(400)):
        arm = arms()[i % len(arms())]
        q = on_limits_beside_straight(rng, arm)
        pose, _, gc = arm.forward(q)
        said = answers(arm, pose, q)
        assert all(said.values()), (arm.name, q.tolist(), said)
        assert not arm.feasible(pose, arm.solve(pose, seed=q).gc).is_empty, (arm.name, q.tolist(), gc)


# fmt: off
KNOWN = {
    "openarm_v10": [0.770978362673137, -1.6993015817807537, -1.2613695015580428, 4.8159879955626015e-05,
                    1.5707963267948966, 0.7853981633974483, 1.565992779571435],
    "realman_rm75_b": [-2.564140468377953, 2.2680030030890714, -0.6981474828714367, 7.394075232574683e-05,
                       -1.3578919970418732, 2.2329916982940654, -3.6194040892696853],
    "fourier_gr2t2_left": [0.8878244757497886, 0.34166910505839154, 0.24143567412847644,
                           -9.449572376505997e-05, 1.8318975828932482, 0.6108652381980153,
                           -0.9588838910456846],
}
"""Postures whose elbow is 5e-5 to 1e-4 rad off straight; doors said that there is none."""
ONE_TURN = [-1.5231330716625766, 0.17453292519943295, 1.5760204640799453, -0.31810494310516974,
            0.39048148249814263, -1.779886462696855, -3.141592653589793]
# fmt: on


@pytest.mark.parametrize("name", KNOWN)
def test_a_known_posture_on_limits_is_held_by_every_door(name: str) -> None:
    """All functions say that the pose of three difficult joint configurations has a solution."""
    arm, q = aa.Arm.from_catalogue(name), np.array(KNOWN[name])
    assert all(answers(arm, arm.forward(q)[0], q).values())


def test_a_winding_that_holds_at_one_psi_alone_is_the_nearest() -> None:
    """`solve` finds joint 7 at -π, where its range of one turn ends an arc."""
    rng = draw.generator(89)
    arm, q = aa.Arm.from_catalogue("rainbow_rby1_leader_right"), np.array(ONE_TURN)
    for near in q + 1e-4 * rng.normal(size=(20, 7)):
        found = arm.solve(arm.forward(q)[0], seed=near)
        assert found.distance <= np.linalg.norm(near - q) * (1 + 1e-9)


@pytest.mark.parametrize("beyond", [0.0, 1e-13, 1e-12, 1e-10, 9e-10, 1e-8])
def test_an_elbow_a_little_beyond_its_limit_is_judged_alike_by_every_door(beyond: float) -> None:
    """All functions accept joint 4 up to 1e-13 rad beyond its limit, and deny it from 1e-12 on."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.array([0.1, 0.4, 0.2, arm.lower[3] - beyond, 0.3, 0.8, 0.5])
    said = answers(arm, arm.forward(q)[0], q + 0.1)
    assert set(said.values()) == {beyond <= 1e-13}, said


def test_a_psi_that_misses_a_limit_by_rounding_hides_no_other_branch() -> None:
    """All functions find other branches if in one a joint misses its limit by 1e-11 rad."""
    lower, upper = np.full(7, -20.0), np.full(7, 20.0)
    upper[1] = -1.9551160965300827 - 1e-11
    lower[1] = -np.pi - 1.9551160965300827
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(lower=lower, upper=upper)
    pose = arm.forward([0.11463003966964003, -1.3369397334568125, -1.6658320759555836, 1.2569232432042035,
                        2.849121332277387, 2.0124444809153954, 2.85170523148728])[0]  # fmt: skip
    assert all(answers(arm, pose, np.clip(np.zeros(7), lower, upper)).values())


def test_arcs_that_are_allowed_hold_a_posture_with_the_elbow_on_its_limit() -> None:
    """`solve(allowed=)` finds a solution with joint 4 on its limit."""
    arm = aa.Arm.from_catalogue("iit_icub_right")
    q = np.array([-0.7449001066524454, 1.6874133492406107, 0.9729595639878998, arm.lower[3],
                  0.6620135762411244, -0.8002783411282164, -0.23939449817202732])  # fmt: skip
    far = [0.5166889570520279, 2.261397042854509, -0.5061898460899659, 2.005196988404407,
           -0.0523821694905896, -0.2893157813552, 0.18583641181595387]  # fmt: skip
    pose, psi, gc = arm.forward(q)
    allowed = aa.ArcSet([[psi - 0.1, psi + 0.1]])
    assert arm.solve(pose, seed=far, gc=gc, allowed=allowed, metric="max").ok


COLLINEAR = [name for name in srs_catalogue() if name.startswith(("jvrc1", "openloong", "rainbow"))]
"""Arms with an offset elbow whose axes 3 and 5 are one line at theta_4 = 0."""
# fmt: off
ONE_LINE = {
    "jvrc1_left": [1.0471975511965976, 1.6871052319297688, -0.7365069056147894, 0.0, -1.9198621771937625,
                   -1.356619800628554, 1.939115584088833],
    "rainbow_rby1_right": [2.21603675566144, -2.1748746322915493, -0.7528976473158953, 0.0,
                           2.684231744562438, 0.04032549775904326, 2.9670597283903604],
}
# fmt: on


@pytest.mark.parametrize("name", ONE_LINE)
def test_a_joint_that_only_rounding_moves_does_not_break_its_limit(name: str) -> None:
    """Where axes 3 and 5 are one line `feasible` holds psi with other joints on their limits."""
    arm, q = aa.Arm.from_catalogue(name), np.array(ONE_LINE[name])
    pose, psi, gc = arm.forward(q)
    assert arm.feasible(pose, gc).contains(psi)


def test_where_axes_3_and_5_are_one_line_arcs_hold_the_posture_of_the_pose() -> None:
    """Where axes 3 and 5 are one line `feasible`, `solve` and the others hold the pose's own joints."""
    rng = draw.generator(97)
    for i in range(draw.count(400)):
        arm = aa.Arm.from_catalogue(COLLINEAR[i % len(COLLINEAR)])
        low, high = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
        q = rng.uniform(low, high)
        for joint in rng.choice(7, rng.integers(1, 3), replace=False):
            q[joint] = rng.choice([low[joint], high[joint]])
        q[3] = -arm.geometry.signs[3] * arm.geometry.offsets[3]
        pose, psi, gc = arm.forward(q)
        arcs = arm.feasible(pose, gc)
        assert arcs.contains(psi), (arm.name, q.tolist())
        for lower, upper in arcs.intervals:
            beside = arm.inverse(pose, np.linspace(lower, upper, 9), gc, limits=False)
            assert arm.within_limits(beside, 1e-9).all(), (arm.name, q.tolist())
        found = arm.solve(pose, seed=q)
        assert np.abs(found.q - q).max() <= 1e-12, (arm.name, q.tolist())
        assert all(answers(arm, pose, rng.uniform(low, high)).values()), (arm.name, q.tolist())
