"""Arms with an offset wrist or shoulder: both doors, arcs and the nearest beside a dense grid, bad input."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from support.delicate import delicate_offset
from support.draw import SEED, count

import armangle as aa
from armangle.models.catalogue import offset_catalogue
from armangle.models.chain import Chain, chain_of
from armangle.models.description import OffsetDescription
from armangle.models.one_offset import describe_offset_chain

CATALOGUE = offset_catalogue()


def random_arm(rng: np.random.Generator, *, mirrored: bool, widest: float = 6.0) -> aa.Arm:
    """Return an arm with an offset wrist (shoulder if `mirrored`) of random lengths, signs, base and tool,
    and joint ranges of at most `widest` (rad).
    """
    middle, half = rng.uniform(-2, 2, 7), rng.uniform(0.2, widest / 2, 7)
    frames = [aa.pose(rng.uniform(-1, 1, 3), rpy=rng.uniform(-3, 3, 3)) for _ in range(2)]
    elbow = rng.uniform(-0.1, 0.1, 2) * rng.integers(0, 2)
    return aa.Arm(
        **{"a_1" if mirrored else "a_6": rng.uniform(0.01, 0.15) * rng.choice([-1, 1])},
        d_bs=rng.uniform(-0.5, 0.5), d_se=rng.uniform(0.2, 0.4), d_ew=rng.uniform(0.2, 0.4),
        d_wf=rng.uniform(-0.2, 0.2), a_3=elbow[0], a_4=elbow[1], signs=rng.choice([-1, 1], 7),
        offsets=rng.uniform(-2, 2, 7), lower=middle - half, upper=middle + half,
        base=frames[0], tool=frames[1],
    )  # fmt: skip


def arms() -> list[aa.Arm]:
    """Return the catalogue's and some random arms, every other one mirrored."""
    rng = np.random.default_rng(5)
    return [aa.Arm.from_catalogue(n) for n in CATALOGUE] + [
        random_arm(rng, mirrored=bool(k % 2), widest=6.0 if k < 4 else 14.0) for k in range(6)
    ]


ARMS = arms()


def within(arm: aa.Arm, rng: np.random.Generator, count: int) -> Any:
    """Return random joints (count, 7) within the limits, of joints without limits within ±7 rad."""
    return rng.uniform(np.maximum(arm.lower, -7.0), np.minimum(arm.upper, 7.0), (count, 7))


def numbers(arm: aa.Arm) -> OffsetDescription:
    """Return the description of an arm, as read from a file."""
    return OffsetDescription(**{f.name: arm._number(f.name) for f in fields(OffsetDescription)})


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm._rows.name)
def test_forward_is_the_chain_of_its_rows(arm: aa.Arm) -> None:
    """`forward` is the product of the arm's description as a chain, and psi its free joint but for turns."""
    q = np.random.default_rng(0).uniform(-3, 3, (200, 7))
    pose, free, _ = arm.forward(q)
    np.testing.assert_allclose(pose, chain_of(numbers(arm)).forward(q), rtol=0, atol=1e-13)
    turns = (free - q[:, arm._free_joint - 1]) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm._rows.name)
def test_every_posture_is_met_again_and_every_answer_holds_the_pose(arm: aa.Arm) -> None:
    """`inverse` of `forward` gives the joints back, and joints of other branches hold the pose."""
    q = within(arm, np.random.default_rng(1), 2000)
    pose, free, gc = arm.forward(q)
    again = arm.inverse(pose, free, gc, seed=q, limits=False)
    assert np.median(np.abs(again - q).max(axis=1)) < 1e-13
    assert np.abs(again - q).max() < 1e-6  # beside singular postures alone
    np.testing.assert_allclose(arm.forward(again)[0], pose, rtol=0, atol=1e-10)
    others = arm.inverse(pose[:, None], free[:, None], np.arange(8), on_error="nan", limits=False)
    there = np.isfinite(others[..., 0])
    back, _, branch = arm.forward(others[there])
    np.testing.assert_allclose(
        back, np.broadcast_to(pose[:, None], (2000, 8, 4, 4))[there], rtol=0, atol=1e-10
    )
    assert (branch == np.broadcast_to(np.arange(8), there.shape)[there]).mean() > 0.999


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm._rows.name)
def test_arcs_are_those_of_a_dense_grid(arm: aa.Arm) -> None:
    """`feasible` agrees with the limits of `inverse` on a grid."""
    rng = np.random.default_rng(2)
    pose, free, gc = arm.forward(within(arm, rng, 6))
    sets = arm.feasible(pose)
    assert sets.shape == (6, 8)
    assert sets.unproven.max() < 1e-5
    own = arm.feasible(pose, gc)
    assert (own.contains(free) | (own.unproven > 1e-7)).all()
    values = rng.uniform(-np.pi, np.pi, (6, 8, 400))
    q = arm.inverse(pose[:, None, None], values, np.arange(8)[:, None], on_error="nan", limits=False)
    margin = np.full(values.shape, -1.0)
    there = np.isfinite(q[..., 0])
    margin[there] = arm.limit_margin(q[there])
    said = np.moveaxis(np.array([sets.contains(values[..., k]) for k in range(400)]), 0, -1)
    unlike = said != (margin >= 0)
    near = np.zeros_like(unlike)
    for i, j, k in np.argwhere(unlike):  # an end within rounding decides nothing
        ends = arm.feasible(pose[i], j).intervals.reshape(-1)
        gap = np.abs((ends - values[i, j, k] + np.pi) % (2 * np.pi) - np.pi)
        near[i, j, k] = (gap < 1e-7).any() or float(sets.unproven[i, j]) > 1e-7
    assert not (unlike & ~near).any()


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm._rows.name)
def test_an_end_is_a_joint_at_its_limit_a_fold_or_the_end_of_the_reach(arm: aa.Arm) -> None:
    """Each end of an arc that is proven names a joint at its limit, or one that is singular."""
    pose, _, gc = arm.forward(within(arm, np.random.default_rng(3), 40))
    folded = 5 if arm._free_joint == 7 else 3
    for i, ends in enumerate(arm.feasible(pose, gc).ends):
        for lower, upper in filter(None, ends):
            for end in (lower, upper):
                if end.side == "unproven":
                    continue
                assert end.joint is not None
                if end.side == "singular":
                    assert end.joint in (folded, 4)
                    theta = (
                        arm._rows.geometry.signs[end.joint - 1] * end.value
                        + arm._rows.geometry.offsets[end.joint - 1]
                    )
                    bend = np.cos(theta) if end.joint == folded else np.sin(theta - arm._rows.geometry.delta)
                    assert abs(bend) < 1e-5, i
                else:
                    limit = getattr(arm._rows, end.side)[end.joint - 1]
                    assert abs(end.value - limit) < 1e-9, i


EDGE = {
    "yaskawa_sia50d": [[2.782217570669447, 1.0993, -2.2, 1.5616, -0.0429, -0.01, 2.8587]],
    "willow_garage_pr2_right": [
        [-0.8822075129563085, 0.5278048189704504, -1.8717561185038851, -0.005994225778336466,
         -2.9832760451812703, -1.3146440392484628, -2.950896129846968],
        [-0.8797758818439705, 0.5190833185524342, -1.8371190260942964, -0.0066384027896413105,
         -3.049288515355732, -1.3354062157626976, -3.0099600280593752],
    ],
}  # fmt: skip
"""Joints, and a seed or none: a thousandth of the circle has postures; first branches took all the time."""


@pytest.mark.parametrize("name", EDGE)
def test_all_branches_together_are_as_near_as_each_alone(name: str) -> None:
    """At the edge of reach `solve` is as near as the nearest of `solve(gc=gc)`."""
    arm, rng = aa.Arm.from_catalogue(name), np.random.default_rng(8)
    q = EDGE[name][0] + np.concatenate([np.zeros((1, 7)), rng.normal(0, 1e-3, (15, 7))])
    near = q + rng.normal(0, 0.1, q.shape)
    near[0] = EDGE[name][-1] if len(EDGE[name]) > 1 else near[0]
    pose = arm.forward(q)[0]
    alone = [arm.solve(pose, near, gc=gc).distance for gc in range(8)]
    assert (arm.solve(pose, near).distance <= np.nanmin(alone, axis=0) + 1e-9).all()


def test_beside_straight_joints_a_posture_as_near_as_that_of_the_pose_is_found() -> None:
    """`solve` near singularities always holds pose and limits, and misses nearer joints in at most 1 of 40
    cases.
    """
    wrong = []
    for number in range(count(300)):
        case = delicate_offset(number, SEED, ARMS[number % len(ARMS)])
        faults = case.faults()
        assert not {"beyond", "missed"} & set(faults), (str(case), faults)
        wrong += [(str(case), faults)] if faults else []
    assert len(wrong) <= count(300) / 40, wrong


def parked(arm: aa.Arm, rng: np.random.Generator, many: int) -> Any:
    """Return random joints of which most are at a limit or at a multiple of a quarter turn of theta."""
    q = within(arm, rng, many)
    lower, upper = np.maximum(arm.lower, -7.0), np.minimum(arm.upper, 7.0)
    quarter = arm.geometry.signs * (np.pi / 2 * rng.integers(-2, 3, q.shape) - arm.geometry.offsets)
    kind = rng.uniform(size=q.shape)
    q = np.where((kind < 0.5) & (lower <= quarter) & (quarter <= upper), quarter, q)
    return np.where(kind > 0.7, np.where(rng.uniform(size=q.shape) < 0.5, lower, upper), q)


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_what_inverse_answers_beside_an_end_is_on_its_pose(arm: aa.Arm) -> None:
    """`inverse` next to folds, the stretched elbow and the edge of reach holds the pose, or is NaN."""
    rng = np.random.default_rng(23)
    q = parked(arm, rng, count(200))
    off = 10.0 ** rng.uniform(-13, -4, q.shape) * rng.choice([-1, 0, 1], q.shape)
    pose, free, gc = arm.forward(q + off)
    again = arm.inverse(pose, free, gc, limits=False)  # the exact value has an answer
    np.testing.assert_allclose(arm.forward(again)[0], pose, rtol=0, atol=1e-11)
    beside = free[:, None] + 10.0 ** rng.uniform(-15, -3, (len(q), 30)) * rng.choice([-1, 1], (len(q), 30))
    branch = np.where(rng.uniform(size=beside.shape) < 0.7, gc[:, None], rng.integers(0, 8, beside.shape))
    found = arm.inverse(pose[:, None], beside, branch, limits=False, on_error="nan")
    there = np.isfinite(found[..., 0])
    assert 0.1 < there.mean() < 1
    wanted = np.broadcast_to(pose[:, None], (*there.shape, 4, 4))[there]
    np.testing.assert_allclose(arm.forward(found[there])[0], wanted, rtol=0, atol=1e-11)


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_of_a_parked_posture_nothing_nearer_is_missed_where_the_answer_says_ok(arm: aa.Arm) -> None:
    """A solution OK of parked joints is no farther than these joints, but for 1e-6 rad."""
    rng = np.random.default_rng(17)
    q = parked(arm, rng, count(60))
    seed = np.where(
        np.arange(len(q))[:, None] % 2, within(arm, rng, len(q)), q + rng.normal(0, 0.05, q.shape)
    )
    seed = np.clip(seed, arm.lower, arm.upper)
    found = arm.solve(arm.forward(q)[0], seed)
    farther = found.distance - np.linalg.norm(q - seed, axis=1)
    proven = found.status == aa.Status.OK
    assert proven.mean() > 0.2 and farther[proven].max() < 1e-6
    assert found.ok.all() and (farther < 1e-6).mean() > 0.9  # what is not proven is the nearest nearly always


@pytest.mark.turns(2)
@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_of_a_parked_posture_on_further_limits_nothing_nearer_is_missed(arm: aa.Arm) -> None:
    """With limits moved onto parked joints, where arcs are narrowest, a solution OK is no farther than these
    joints.
    """
    rng = np.random.default_rng(29)
    missed = []
    for q in parked(arm, rng, count(150)):
        spare = 4.0 * rng.integers(0, 2)  # more than a turn
        lower, upper = np.maximum(arm.lower, -7.0) - spare, np.minimum(arm.upper, 7.0) + spare
        side = rng.integers(0, 4, 7)
        lower, upper = np.where(side == 0, q, lower), np.where(side == 1, q, upper)
        own = arm.with_(lower=np.where(upper - lower < 0.1, q - 1.0, lower), upper=upper)
        seed = np.clip(q + rng.normal(size=7) * 10.0 ** rng.uniform(-9, 0), own.lower, own.upper)
        found = own.solve(own.forward(q)[0], seed)
        assert found.ok or found.status == aa.Status.NEAR_SINGULAR, q.tolist()  # axis 5 anywhere
        if found.status == aa.Status.OK and found.distance - np.linalg.norm(q - seed) > 1e-6:
            missed.append((q.tolist(), seed.tolist(), found.distance))
    assert not missed


@pytest.mark.turns(2)
@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_every_end_and_middle_of_an_arc_has_a_posture(arm: aa.Arm) -> None:
    """`inverse` has joints at all ends and middles of arcs near parked joints."""
    rng = np.random.default_rng(31)
    q = parked(arm, rng, count(60))
    q = np.clip(
        q + 10.0 ** rng.uniform(-13, -4, q.shape) * rng.choice([-1, 0, 1], q.shape), arm.lower, arm.upper
    )
    pose = arm.forward(q)[0]
    arcs = arm.feasible(pose)
    for i in range(len(q)):
        for gc in range(8):
            ends = np.asarray(arcs[i, gc].intervals).reshape(-1, 2)
            at = np.concatenate([ends[:, 0], ends[:, 1], ends.mean(axis=1)])
            found = arm.inverse(pose[i], at, np.full(len(at), gc), limits=False, on_error="nan")
            assert np.isfinite(found).all(), (q[i].tolist(), gc)
            wide = np.repeat(ends[None, :, 1] - ends[None, :, 0] > 1e-3, 3, axis=0).ravel()
            assert (arm.limit_margin(found[-len(ends) :][wide[-len(ends) :]]) > 0).all()


def test_a_seed_at_the_end_of_the_turns_is_answered_on_its_turn() -> None:
    """`solve` for joints on limits is as near as these joints, not a turn away."""
    arm = aa.Arm.from_catalogue("ufactory_xarm7")
    low, high = arm.lower, arm.upper
    q = np.array([low[0], high[1], -5.4160479797624861, 1.5993588557151199, high[4], low[5], high[6]])
    seed = q + np.array([0, 0, 0.10686, -0.031, 0, 0, 0])
    assert arm.solve(arm.forward(q)[0], seed).distance < np.linalg.norm(q - seed) + 1e-9


@pytest.mark.parametrize("joint", range(7))
def test_a_locked_joint_keeps_its_posture(joint: int) -> None:
    """With a locked joint `solve` finds joints that hold the pose."""
    arm = aa.Arm.from_catalogue("franka_fr3")
    for q in within(arm, np.random.default_rng(11), 6):
        lower, upper = arm._rows.lower.copy(), arm._rows.upper.copy()
        lower[joint] = upper[joint] = q[joint]
        locked = arm.with_(lower=lower, upper=upper)
        assert locked.solve(locked.forward(q)[0], seed=q).distance < 1e-6


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm._rows.name)
def test_a_chain_of_joints_is_read_back(arm: aa.Arm) -> None:
    """`describe_offset_chain` gives back the offset arm that a chain was made of."""
    chain = chain_of(numbers(arm))
    found, report = describe_offset_chain(chain, angle=1e-9, length=1e-9)
    assert report.residual_position <= 1e-9 and report.residual_rotation <= 1e-9
    offset = max(abs(arm.geometry.a_1), abs(arm.geometry.a_6))
    assert (report.shoulder_miss if arm.geometry.a_1 else report.wrist_miss) == pytest.approx(
        offset, abs=1e-9
    )
    q = np.random.default_rng(8).uniform(-3, 3, (50, 7))
    np.testing.assert_allclose(chain_of(found).forward(q), chain.forward(q), atol=1e-10)
    assert abs(abs(found.a_1) - abs(arm.geometry.a_1)) < 1e-10
    assert abs(abs(found.a_6) - abs(arm.geometry.a_6)) < 1e-10


def test_what_has_offsets_at_both_ends_or_elsewhere_is_refused() -> None:
    """`describe_offset_chain` refuses offsets at both ends, and axes that miss elsewhere."""
    rows = numbers(ARMS[0])
    both = chain_of(replace(rows, a_1=0.05, a_6=0.088))
    with pytest.raises(aa.ModelError, match="both ends"):
        describe_offset_chain(both, angle=1e-5, length=1e-5)
    bent = chain_of(replace(rows, a_1=0.0, a_6=0.088))
    joints = list(bent.joints)
    origin = joints[2].origin.copy()
    origin[:3, 3] += 0.01 * origin[:3, 0]
    joints[2] = type(joints[2])(joints[2].name, origin, joints[2].axis)
    with pytest.raises(aa.ModelError, match="miss"):
        describe_offset_chain(
            Chain(bent.name, "base", "tip", tuple(joints), bent.tip_origin), angle=1e-5, length=1e-5
        )


def test_why_there_is_none() -> None:
    """Status and errors of an offset arm out of reach or within tiny limits name the reason."""
    arm = aa.Arm.from_catalogue("franka_fr3")
    far = aa.pose([3.0, 0, 0])
    assert arm.solve(far).status is aa.Status.UNREACHABLE
    assert arm.feasible(far, 0).status is aa.Status.UNREACHABLE
    with pytest.raises(aa.UnreachableError, match=r"out of reach.* arm\.explain\(pose\) says"):
        arm.solve(far).raise_for_status()
    assert {aa.Status(int(code)) for code in arm.feasible(far).status} == {aa.Status.UNREACHABLE}
    with pytest.raises(aa.UnreachableError, match="out of reach"):
        arm.inverse(far, 0.0, 0, limits=False)
    assert np.isnan(arm.inverse(far, 0.0, 0, on_error="nan", limits=False)).all()
    q = [0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5]
    tiny = np.full(7, 0.01)
    locked = aa.Arm(a_6=0.088, d_bs=0.333, d_se=0.316, d_ew=0.384, d_wf=0.107, lower=-tiny, upper=tiny)
    found = locked.solve(arm.forward(q)[0])
    assert not found.ok and found.gc == -1 and np.isnan(found.q).all()


def test_bad_numbers_are_refused() -> None:
    """Arm refuses offsets at both ends, with d_4, or NaN; a wrong name gets a hint."""
    lengths = {"d_bs": 0.3, "d_se": 0.3, "d_ew": 0.3, "d_wf": 0.1}
    with pytest.raises(aa.InputError, match="wanted one of them"):
        aa.Arm(a_1=0.1, a_6=0.1, **lengths)
    with pytest.raises(aa.InputError, match="a_6"):
        aa.Arm(a_6=float("nan"), **lengths)
    with pytest.raises(aa.UnsupportedError, match="d_4"):
        aa.Arm(a_6=0.1, d_4=0.1, **lengths)
    with pytest.raises(aa.InputError, match="franka_fr3"):
        aa.Arm.from_catalogue("franka")


def test_empty_batches() -> None:
    """Functions of an offset arm take no poses."""
    arm, none = ARMS[0], np.empty((0, 4, 4))
    assert arm.solve(none).q.shape == (0, 7)
    assert arm.feasible(none, np.empty(0, dtype=int)).shape == (0,)
    assert arm.forward(np.empty((0, 7)))[0].shape == (0, 4, 4)


@pytest.mark.parametrize("name", CATALOGUE)
@pytest.mark.parametrize("what", ["shoulder on axis 5", "joints 1 and 3 on one axis"])
def test_where_two_joints_turn_about_one_axis_the_seed_decides(name: str, what: str) -> None:
    """At singularities `inverse` with a seed gives its joints back, and holds the pose without."""
    arm = aa.Arm.from_catalogue(name)
    rows = arm._rows
    hinge, fold = (1, 4) if arm._free_joint == 7 else (5, 2)  # theta_2 and theta_5, or theta_6 and theta_3
    q = np.random.default_rng(12).uniform(-2.5, 2.5, (200, 7))
    told = np.ones(200, dtype=bool)
    if what == "shoulder on axis 5":  # a_3 cos + d_se sin + a_4 = 0, of which a Franka's is at q4 = 0
        reach, lean = (
            np.hypot(rows.geometry.a_3, rows.geometry.d_se),
            np.arctan2(rows.geometry.a_3, rows.geometry.d_se),
        )
        q[:, 3] = rows.geometry.signs[3] * (
            -np.arcsin(rows.geometry.a_4 / reach) - lean - rows.geometry.offsets[3]
        )
    else:
        q[:, hinge] = rows.geometry.signs[hinge] * (
            np.array([0.0, np.pi])[np.arange(200) % 2] - rows.geometry.offsets[hinge]
        )
        theta = rows.geometry.signs * q + rows.geometry.offsets
        blurred = np.sin(theta[:, 3] - rows.geometry.delta) * np.cos(
            theta[:, fold]
        )  # rounding of the hinge is so much more
        told = np.abs(blurred) > 0.02
        assert told.mean() > 0.8
    pose, free, gc = arm.forward(q)
    again = arm.inverse(pose, free, gc, seed=q, limits=False)
    np.testing.assert_allclose(arm.forward(again)[0], pose, rtol=0, atol=1e-10)
    np.testing.assert_allclose(np.angle(np.exp(1j * (again - q)))[told], 0.0, atol=1e-5)
    without = arm.inverse(pose, free, gc, limits=False)
    np.testing.assert_allclose(arm.forward(without)[0], pose, rtol=0, atol=1e-10)
