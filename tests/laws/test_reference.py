"""Other references of psi: the same postures under another number, on every arm and in every regime."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support import draw
from support.laws import JOINT, POSE, circle_gap, gap, is_regular
from support.strategies import Array, all_arms, in_every_regime, postures, unlimited

import armangle as aa

any_arm = pytest.mark.parametrize("arm", all_arms(), ids=lambda arm: arm.name)
REFERENCES: list[Any] = ["stereographic", (1.0, 0.0, 0.0), (0.3, -2.0, 0.5)]
any_reference = pytest.mark.parametrize("reference", REFERENCES, ids=str)
IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])


@pytest.mark.turns(6)
@pytest.mark.slow
@any_arm
@in_every_regime
def test_the_round_trip_holds(arm: aa.Arm, regime: str) -> None:
    """With any reference `inverse` of `forward` holds pose and joints; pose and gc do not depend on it."""
    for reference in REFERENCES:
        other = unlimited(arm).with_(reference=reference)
        q = postures(arm, regime, draw.count(60), 1)
        pose, psi, gc = other.forward(q)
        back = other.inverse(pose, psi, gc, seed=q, limits=False)
        assert gap(other.forward(back, on_error="nan")[0], pose) <= POSE
        regular = is_regular(arm, q, pose)
        assert gap(back[regular], q[regular]) <= JOINT
        assert np.array_equal(pose, arm.forward(q)[0]) and np.array_equal(gc, arm.forward(q)[2])


@any_arm
def test_one_angle_of_the_pose_turns_one_psi_into_the_other(arm: aa.Arm) -> None:
    """Psi of two references differ by one angle for each pose."""
    for reference in REFERENCES:
        free, other = unlimited(arm), unlimited(arm).with_(reference=reference)
        q = postures(arm, "uniform", draw.count(60), 2)
        pose, psi, _ = free.forward(q)
        shift = other.forward(q)[1] - psi
        angles = draw.generator(1).uniform(-np.pi, np.pi, len(q))
        there = free.inverse(pose, angles, limits=False)
        here = other.inverse(pose, angles + shift, limits=False)
        clear = is_regular(arm, there, pose[:, None]).all(axis=-1)
        assert clear.any()
        assert circle_gap(there[clear], here[clear]).max(initial=0) <= JOINT


@pytest.mark.turns(6)
@pytest.mark.slow
@any_arm
def test_feasible_sets_are_the_same_postures(arm: aa.Arm) -> None:
    """`feasible` with another reference is the same set, shifted by that angle."""
    for reference in REFERENCES:
        other = arm.with_(reference=reference)
        q = postures(arm, "uniform", draw.count(40), 3)
        pose, psi, gc = arm.forward(q)
        shift = other.forward(q)[1] - psi
        mine, theirs = arm.feasible(pose, gc), other.feasible(pose, gc)
        assert np.array_equal(mine.is_full, theirs.is_full)
        grid = np.linspace(-np.pi, np.pi, 90, endpoint=False)
        for p in range(len(q)):
            ends = np.concatenate([[100.0], mine[p].intervals.ravel()])
            sure = circle_gap(grid[:, None], ends).min(axis=-1) > 1e-6
            sure |= bool(mine.is_full[p])
            assert np.array_equal(mine[p].contains(grid)[sure], theirs[p].contains(grid + shift[p])[sure])
            assert theirs[p].measure == pytest.approx(mine[p].measure, abs=1e-6)


@any_arm
def test_the_axis_of_joint_1_as_a_vector_is_the_base(arm: aa.Arm) -> None:
    """The reference of the base's z axis as a vector gives the default psi."""
    other = arm.with_(reference=arm.base[:3, 2])
    q = postures(arm, "uniform", draw.count(60), 4)
    regular = is_regular(arm, q, arm.forward(q)[0])
    assert circle_gap(other.forward(q)[1], arm.forward(q)[1])[regular].max() <= 1e-9


@any_reference
def test_a_step_that_carries_the_elbow_does_not_depend_on_the_reference(reference: Any) -> None:
    """`follow` with carry="elbow", `plan` and `solve` give the same joints with any reference."""
    other = IIWA.with_(reference=reference)
    poses = np.repeat(IIWA.forward(Q)[0][None], 30, axis=0)
    poses[:, 2, 3] += np.linspace(0, 0.05, 30)
    for policy in (aa.Repulsion(), aa.Centre(K=0.1), aa.Towards(direction="up", K=0.2)):
        one, two = (aa.follow(a, poses, start=Q, policy=policy, carry="elbow") for a in (IIWA, other))
        assert one.ok and two.ok
        assert gap(one.q, two.q) <= 1e-9
        assert circle_gap(two.psi, other.forward(two.q)[1]).max() <= 1e-9
    path = aa.plan(other, poses)
    assert path.ok and circle_gap(path.psi, other.forward(path.q)[1]).max() <= 1e-9
    found = other.solve(poses[3], seed=Q)
    assert gap(found.q, IIWA.solve(poses[3], seed=Q).q) <= 1e-9
    assert circle_gap(found.psi, other.forward(found.q)[1]) <= 1e-9
    shift = other.forward(found.q)[1] - IIWA.forward(found.q)[1]
    up = [a.psi_towards(poses[3], found.gc, direction="up") for a in (IIWA, other)]
    assert circle_gap(up[1], up[0] + shift) <= 1e-12


@any_reference
def test_arcs_and_wishes_that_are_given_turn_with_the_reference(reference: Any) -> None:
    """`allowed` and Towards in psi of another reference give the same solutions."""
    other, rng = IIWA.with_(reference=reference), draw.generator(7)
    found = 0
    for q, near in zip(postures(IIWA, "uniform", 40, 5), postures(IIWA, "uniform", 40, 6), strict=True):
        pose, psi, gc = IIWA.forward(q)
        shift = other.forward(q)[1] - psi
        low, wish = rng.uniform(-np.pi, np.pi, 2)
        answers = []
        for arm, off in ((IIWA, 0.0), (other, shift)):
            begin = (low + off + np.pi) % (2 * np.pi) - np.pi
            allowed = aa.ArcSet([[begin, begin + 1.0]])
            to = aa.Towards(psi=wish + off, K=1.0)
            answers.append(
                (
                    arm.solve(pose, near, gc=gc, allowed=allowed).q,
                    arm.solve(pose, near, gc=gc, allowed=allowed, metric="max").distance,
                    arm.solve(pose, prefer="margin").margin,
                    arm.solutions(pose, near).distance,
                    aa.step(arm, q, pose, policy=to, max_joint_step=10.0).q,
                )
            )
        for one, two in zip(*answers, strict=True):
            np.testing.assert_allclose(one, two, rtol=0, atol=1e-7)
        found += bool(np.isfinite(answers[0][0]).all())
    assert found > 10


def around(height: float, radius: float) -> Array:
    """Poses of the iiwa whose wrist goes around the base axis at `height` above the shoulder and
    `radius`, m.
    """
    turn = np.linspace(-np.pi, np.pi, 25)
    poses = np.zeros((25, 4, 4)) + np.eye(4)
    poses[:, 0, 3], poses[:, 1, 3] = radius * np.cos(turn), radius * np.sin(turn)
    poses[:, 2, 3] = 0.34 + 0.126 + height
    return poses


def elbow_spread(arm: aa.Arm, poses: Array) -> float:
    """The largest distance along an axis between elbows at psi = 0.3, m."""
    elbows = arm.elbow(arm.inverse(poses, 0.3, 0, limits=False))
    return float(np.ptp(elbows, axis=0).max())


def test_stereographic_is_singular_below_the_shoulder_alone() -> None:
    """With the stereographic reference psi is continuous above the shoulder, and not below."""
    other = IIWA.with_(reference="stereographic")
    assert elbow_spread(other, around(0.6, 1e-6)) <= 1e-5 < 0.1 < elbow_spread(IIWA, around(0.6, 1e-6))
    assert elbow_spread(other, around(-0.6, 1e-6)) > 0.1
    # straight above, both are the convention's
    above = around(0.6, 0.0)[0]
    assert gap(other.inverse(above, 0.3, 0, limits=False), IIWA.inverse(above, 0.3, 0, limits=False)) <= 1e-12
    for height in (0.6, -0.6):
        for radius in (0.0, 1e-9, 1e-7, 1e-5, 1e-3):
            poses = around(height, radius)
            assert gap(other.forward(other.inverse(poses, 1.1, 0, limits=False))[0], poses) <= POSE


def test_the_reference_is_part_of_the_arm() -> None:
    for reference in ("stereographic", (0.5, 1.0, -0.25)):
        other = IIWA.with_(reference=reference)
        assert other.geometry.reference == reference and other != IIWA
        assert eval(repr(other), {"Arm": aa.Arm}).geometry.reference == reference
        assert other.with_(reference="base") == IIWA
    assert IIWA.with_(reference=[0, 0, 8]).geometry.reference == (0.0, 0.0, 1.0)
    assert IIWA.geometry.reference == "base" and "reference" not in repr(IIWA)
