"""Two joints on their limits at once: what the arm stands in, every function holds, and paths lead on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.draw import count, generator
from support.moves import line

import armangle as aa
from armangle.models.catalogue import srs_catalogue

NAMES = ("kuka_iiwa7_r800", "kuka_iiwa14_r820", "realman_rm75_b", "openarm_v10")
ARMS = {name: aa.Arm.from_catalogue(name) for name in NAMES}


def at_two_limits(rng: np.random.Generator, arm: aa.Arm) -> np.ndarray:
    """Random joints within the limits, two of them exactly on one."""
    q = rng.uniform(arm.lower, arm.upper)
    for j in rng.permutation(7)[:2]:
        q[j] = rng.choice([arm.lower[j], arm.upper[j]])
    return q


def drawn(seed: int, own: int) -> list[tuple[aa.Arm, np.ndarray]]:
    """At least `own` pairs of an arm and joints of which two are exactly on limits."""
    rng = generator(seed)
    return [(arm := ARMS[str(rng.choice(NAMES))], at_two_limits(rng, arm)) for _ in range(count(own))]


def test_the_arm_angle_of_a_corner_is_feasible_beside_wider_arcs() -> None:
    """The psi of joints with two on limits is in `feasible` to 1e-6 rad, also if wider arcs lie elsewhere."""
    beside = 0
    for arm, q in drawn(1, 2000):
        pose, psi, gc = arm.forward(q)
        arcs = arm.feasible(pose, gc)
        if abs(np.sin(q[[1, 3, 5]])).min() < 1e-2:  # psi has too few digits there
            continue
        off = np.angle(np.exp(1j * (arcs.nearest(psi) - psi)))
        assert abs(off) < 1e-6, (arm.name, q.tolist())  # where a joint turns back psi has half the digits
        every = arm.feasible(pose)[gc]
        np.testing.assert_array_equal(every.intervals, arcs.intervals)
        widths = np.diff(arcs.intervals, axis=1)
        beside += bool(widths.min() < 1e-9 < widths.max())
    assert beside > 40


def test_the_pose_that_the_arm_stands_in_is_held() -> None:
    """With two joints on limits `step` and `follow` to the own pose succeed, and `solve` gives the joints
    back.
    """
    for arm, q in drawn(2, 1000):
        pose = arm.forward(q)[0]
        for wish in ({}, {"velocity": 1.0, "dt": 0.01}, {"fallback": "nearest_pose"}):
            step = aa.step(arm, q, pose, **wish)
            assert step.status == aa.Status.OK, (arm.name, q.tolist(), wish, step.why.name)
        assert aa.follow(arm, [pose, pose], start=q).ok
        assert arm.solve(pose, seed=q).q.tolist() == q.tolist()


def test_a_plan_begins_and_ends_on_limits() -> None:
    """With two joints on limits a plan stands still there; certified plans from or to there keep limits and
    ends.
    """
    moved = 0
    for arm, q in drawn(3, 12):
        pose = arm.forward(q)[0]
        if abs(np.sin(q[[1, 3, 5]])).min() < 1e-2:
            continue
        stood = aa.plan(arm, np.array([pose, pose]), start=q)
        assert stood.ok, (arm.name, q.tolist(), stood.explain())
        inside = arm.forward(q + 0.02 * (0.5 * (arm.lower + arm.upper) - q))[0]
        for way, end in ((aa.Line(pose, inside), "start"), (aa.Line(inside, pose), "goal")):
            path = aa.plan(arm, way, **{end: q})
            if not path.certified:
                continue
            moved += 1
            dense = path.at(np.linspace(0, 1, 501))[0]
            assert arm.within_limits(dense, 1e-9).all()
            np.testing.assert_allclose(dense[0 if end == "start" else -1], q, atol=1e-9)
    assert moved > 12


def test_what_grows_out_of_a_corner_leads_on() -> None:
    """A plan from limits is certified if one psi is feasible at s = 0 and none of the later arcs holds it."""
    arm = ARMS["openarm_v10"]
    text = (
        ".16054518660224026 .8322806936967597 -.4104782077718374 .726976824943495 1.6 -.5214458799459318 1.6"
    )
    q = np.clip(np.array(text.split(), float), arm.lower, arm.upper)  # joints 5 and 7 on their limits
    assert aa.plan(arm, line(arm, q, [0.02, -0.01, 0.01]), start=q).certified


STRAIGHT = (
    ("openarm_v10", "1.45 -2 -1.507 1.6e-12 2 0 2", "0 0 0 .0032 0 0 0"),
    ("realman_rm75_b", "-1.18 -3 -4 .01243 2.16 -1.29 -1.02", "3.2e-5 0 0 1.2e-5 2.3e-6 -6.6e-5 -5.1e-6"),
    ("kuka_iiwa14_r820", "-2.95 -3 -2.61 3.37e-5 .886 3 -.832", "7.7e-7 0 4.4e-5 -2.5e-5 2.1e-5 0 -3.1e-5"),
    ("kuka_iiwa7_r800", "1.695 -3 -4 2.6e-10 .289 1.734 -4", "0 0 0 -3.96e-4 0 0 0"),
)
"""Postures with an elbow about straight and joints on their limits (drawn in to them), and moves."""


@pytest.mark.parametrize(("name", "start", "move"), STRAIGHT)
def test_a_small_move_beside_a_straight_elbow_is_a_step(name: str, start: str, move: str) -> None:
    """`step` reaches a pose next to a straight elbow within limits and 0.2 rad."""
    arm = ARMS[name]
    q = np.clip(np.array(start.split(), float), arm.lower, arm.upper)
    to = np.clip(q + np.array(move.split(), float), arm.lower, arm.upper)
    pose = arm.forward(to)[0]
    step = aa.step(arm, q, pose)
    assert step.status == aa.Status.OK
    assert np.abs(step.q - q).max() <= 0.2 and arm.within_limits(step.q)
    np.testing.assert_allclose(arm.forward(step.q)[0], pose, atol=1e-12)


STANDS = (
    # an elbow all but straight, where psi has too few digits
    ("kuka_iiwa7_r800", "-1.2602545634041284 -1.8099978047803367 -.9853122063846094 .00017961632709395658 -3 -1.7017371227985942 4"),  # noqa: E501  # a row
    ("kuka_iiwa7_r800", "2.8366907800293575 -3 3 -.0018504284910343394 2.6506080848670504 -1.8865572261376027 -1.3136224854265752"),  # noqa: E501  # a row
    ("openarm_v10", "3.489658503988659 1e-6 1.5112962073658585 1e-6 .8930656181869097 -.7853981633974483 1.5707963267948966"),  # noqa: E501  # a row
    ("kuka_iiwa7_r800", "2.5606969084343962 -.07242817031731574 2.9670597283903602 0 .8264076974840608 -1e-9 3.0543261909900767"),  # noqa: E501  # a row
    ("realman_rm75_b", "3.100001457514768 .01 -2.9657917332225066 1e-6 -1.8976230024129936 -2.2329916982940654 1.4884981084189866"),  # noqa: E501  # a row
    # joint 6 turns back at its limit; the elbow is well bent
    ("openarm_v10", "4 .8976674527033486 .34332311275454663 .5568870356777469 -2 3 -.09662766247155452"),
    # an elbow that is straight at another theta_4 than 0
    ("rokae_ar5_left", "-1.5489 .7584 -4 .06958452847011021 1.4518 .38052 1.0471975511965976"),
)  # fmt: skip
"""Postures with joints on their limits (drawn in to them)."""
BOUNDS = {"dt": 0.01, "velocity": 2.0, "velocity_now": np.zeros(7)}


@pytest.mark.parametrize("asked", [{}, BOUNDS, BOUNDS | {"acceleration": 5.0}], ids=["free", "speed", "both"])
@pytest.mark.parametrize(("name", "text"), STANDS)
def test_a_posture_on_its_limits_is_held_for_good(name: str, text: str, asked: dict[str, Any]) -> None:
    """Steps with Hold keep the joints on their limits; beside a straight elbow no step goes to another branch
    or to arcs without psi.
    """
    arm = aa.Arm.from_catalogue(name)
    q = now = np.clip(np.array(text.split(), float), arm.lower, arm.upper)
    pose, psi, gc = arm.forward(q)
    assert aa.step(arm, q, pose, **asked).status == aa.Status.OK
    for _ in range(50):
        step = aa.step(arm, now, pose, policy=aa.Hold(), **asked)
        assert step.status == aa.Status.OK and np.abs(step.q - q).max() < 1e-9
        now = step.q
    assert aa.follow(arm, [pose, pose], start=q).ok
    if abs(np.sin(q[3])) < 0.1 and not asked:
        assert aa.step(arm, q, pose, gc=gc ^ 1).status != aa.Status.OK
        assert aa.step(arm, q, pose, allowed=aa.ArcSet([[0.1, 0.2]])).status != aa.Status.OK
    if q[5] == arm.upper[5]:
        arcs = arm.feasible(pose, gc)
        assert len(arcs) == 2 and abs(arcs.nearest(psi) - psi) < 1e-6
        assert arm.freedom(pose).arcs == arm.feasible(pose).count.sum()


def test_the_arm_holds_what_it_stands_in_whatever_the_catalogue() -> None:
    """`step` to the own pose is OK for every S-R-S arm with one to three joints on limits."""
    rng = generator(4)
    for name in srs_catalogue():
        arm = aa.Arm.from_catalogue(name)
        lower, upper = np.maximum(arm.lower, -20), np.minimum(arm.upper, 20)
        for joints in (1, 2, 3):
            for _ in range(count(20)):
                q = rng.uniform(lower, upper)
                for j in rng.permutation(7)[:joints]:
                    q[j] = rng.choice([lower[j], upper[j]])
                assert aa.step(arm, q, arm.forward(q)[0]).status == aa.Status.OK, (name, q.tolist())


def test_small_moves_with_two_hinges_about_straight_are_steps() -> None:
    """With the elbow and theta_2 or theta_6 near 0, at most 8 % of small moves are refused as steps."""
    rng, refused, moves = generator(5), 0, count(600)
    for _ in range(moves):
        arm = ARMS[str(rng.choice(NAMES))]
        q = rng.uniform(arm.lower, arm.upper)
        for j, largest in ((3, -5.5), (int(rng.choice([1, 5])), -2)):  # an elbow that may bend to either side
            q[j] = np.clip(rng.normal(0, 10 ** rng.uniform(-12, largest)), arm.lower[j], arm.upper[j])
        move = np.clip(rng.normal(size=7) * 10 ** rng.uniform(-8, -1.5), -0.19, 0.19)
        pose = arm.forward(np.clip(q + move, arm.lower, arm.upper))[0]
        step = aa.step(arm, q, pose)
        refused += step.status != aa.Status.OK
        if step.status == aa.Status.OK:
            assert np.abs(step.q - q).max() <= 0.2 + 1e-12 and arm.within_limits(step.q)
            np.testing.assert_allclose(arm.forward(step.q)[0], pose, atol=1e-12)
    assert refused <= 0.08 * moves, refused


def test_from_beyond_its_limits_a_step_with_straight_hinges_comes_back_or_is_refused() -> None:
    """A step from beyond a limit that is OK ends within all limits, at most 0.2 rad away."""
    rng, arm = generator(6), ARMS["kuka_iiwa7_r800"]
    for _ in range(count(200)):
        q = rng.uniform(arm.lower, arm.upper)
        q[3], q[int(rng.choice([1, 5]))] = rng.normal(0, 1e-7), rng.normal(0, 1e-3)
        q[2] = arm.upper[2] + rng.choice([0.1, 0.3])
        step = aa.step(arm, q, arm.forward(q + 1e-4 * rng.normal(size=7))[0])
        if step.status == aa.Status.OK:
            assert arm.within_limits(step.q) and np.abs(step.q - q).max() <= 0.2 + 1e-12
