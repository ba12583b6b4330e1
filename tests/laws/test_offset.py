"""Arms with an offset wrist or shoulder, own chains too: arcs and the nearest beside a grid, bad input."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.calibrated import ARMS as CALIBRATIONS
from support.calibrated import calibrated, description, plain_forward
from support.delicate import delicate_offset
from support.draw import SEED, count
from support.families import MIRRORED, OFFSET_CHAIN, OFFSETS, of, within
from support.laws import circle_gap, gap

import armangle as aa
from armangle.models.catalogue import offset_catalogue
from armangle.models.chain import Chain, chain_of
from armangle.models.one_offset import describe_offset_chain

CATALOGUE = offset_catalogue()
Q = np.array([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])
FR3 = aa.Arm.from_catalogue("franka_fr3")
OWN = [*OFFSET_CHAIN, calibrated("franka_fr3", 20.0, 10.0)]


@of(OFFSETS, OWN)
def test_arcs_are_those_of_a_dense_grid(arm: aa.Arm) -> None:
    """`feasible` agrees with the limits of `inverse` on a grid; of an own chain it may lack as much as is
    unproven.
    """
    rng, own = np.random.default_rng(2), arm.geometry.chain is not None
    pose, free, gc = arm.forward(within(arm, rng, 6, 7.0))
    sets, mine = arm.feasible(pose), arm.feasible(pose, gc)
    assert sets.shape == (6, 8) and sets.measure.sum() > 0.05
    assert own or sets.unproven.max() < 1e-5
    assert (mine.contains(free) | (mine.unproven > 1e-7)).all()
    samples = 120 if own else 400
    values = rng.uniform(-np.pi, np.pi, (6, 8, samples))
    q = arm.inverse(pose[:, None, None], values, np.arange(8)[:, None], on_error="nan", limits=False)
    margin = np.full(values.shape, -1.0)
    there = np.isfinite(q[..., 0])
    margin[there] = arm.limit_margin(q[there])
    assert not there[sets.status == aa.Status.NO_POSTURE].any()
    said = np.moveaxis(np.array([sets.contains(values[..., k]) for k in range(samples)]), 0, -1)
    unlike = said != (margin >= 0)
    for i, j, k in np.argwhere(unlike):  # an end within rounding decides nothing
        near = (circle_gap(sets[i, j].intervals.reshape(-1), values[i, j, k]) < 1e-7).any()
        assert near or (float(sets.unproven[i, j]) > 1e-7 and not (own and said[i, j, k]))
    assert (unlike.mean(axis=-1) <= np.asarray(sets.unproven) / (2.0 * np.pi) + 0.1).all()


@of(OFFSETS, list(CALIBRATIONS.values()))
def test_an_end_is_a_joint_at_its_limit_a_fold_or_the_end_of_the_reach(arm: aa.Arm) -> None:
    """Each end of an arc that is proven names a joint at its limit, also by `inverse`, or one that is
    singular.
    """
    pose, _, gc = arm.forward(within(arm, np.random.default_rng(3), 40, 7.0))
    folded, met = 5 if arm.redundancy == "joint_7" else 3, 0
    arcs, g = arm.feasible(pose, gc), arm.geometry
    for i, row in enumerate(arcs.ends):
        at_ends = zip(arcs[i].intervals, row, strict=False)
        for psi, end in (each for at, pair in at_ends if pair for each in zip(at, pair, strict=True)):
            if end.side == "unproven":
                assert arcs.unproven[i] > 0.0
                continue
            joint = end.joint - 1
            if end.side == "singular":
                assert end.joint in (folded, 4)
                theta = g.signs[joint] * end.value + g.offsets[joint]
                assert abs(np.cos(theta) if end.joint == folded else np.sin(theta - g.delta)) < 1e-5, i
                continue
            assert abs(end.value - getattr(arm, end.side)[joint]) < 1e-9, i
            at = arm.inverse(pose[i], psi, gc[i], on_error="nan", limits=False)[joint]
            assert np.isnan(at) or circle_gap(at, end.value) <= 1e-10
            met += np.isfinite(at)
    assert met > 10


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
        case = delicate_offset(number, SEED, OFFSETS[number % len(OFFSETS)])
        faults = case.faults()
        assert not {"beyond", "missed"} & set(faults), (str(case), faults)
        wrong += [(str(case), faults)] if faults else []
    assert len(wrong) <= count(300) / 40, wrong


def parked(arm: aa.Arm, rng: np.random.Generator, many: int) -> Any:
    """Return random joints of which most are at a limit or at a multiple of a quarter turn of theta."""
    q = within(arm, rng, many, 7.0)
    lower, upper = np.maximum(arm.lower, -7.0), np.minimum(arm.upper, 7.0)
    quarter = arm.geometry.signs * (np.pi / 2 * rng.integers(-2, 3, q.shape) - arm.geometry.offsets)
    kind = rng.uniform(size=q.shape)
    q = np.where((kind < 0.5) & (lower <= quarter) & (quarter <= upper), quarter, q)
    return np.where(kind > 0.7, np.where(rng.uniform(size=q.shape) < 0.5, lower, upper), q)


@of(OFFSETS)
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


@pytest.mark.turns(2)
@of(OFFSETS)
def test_of_a_parked_posture_nothing_nearer_is_missed_where_the_answer_says_ok(arm: aa.Arm) -> None:
    """A solution OK of parked joints is no farther than these joints, but for 1e-6 rad."""
    rng = np.random.default_rng(17)
    q = parked(arm, rng, count(60))
    seed = np.where(
        np.arange(len(q))[:, None] % 2, within(arm, rng, len(q), 7.0), q + rng.normal(0, 0.05, q.shape)
    )
    seed = np.clip(seed, arm.lower, arm.upper)
    found = arm.solve(arm.forward(q)[0], seed)
    farther = found.distance - np.linalg.norm(q - seed, axis=1)
    proven = found.status == aa.Status.OK
    assert proven.mean() > 0.2 and farther[proven].max() < 1e-6
    assert found.ok.all() and (farther < 1e-6).mean() > 0.9  # what is not proven is the nearest nearly always


@pytest.mark.turns(4)
@of(OFFSETS)
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


@pytest.mark.turns(4)
@of(OFFSETS)
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


@of(OFFSETS)
def test_a_chain_of_joints_is_read_back(arm: aa.Arm) -> None:
    """`describe_offset_chain` gives back the offset arm that a chain was made of."""
    chain = chain_of(description(arm))
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
    rows = description(OFFSETS[0])
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


@pytest.mark.parametrize("name", CATALOGUE)
@pytest.mark.parametrize("what", ["shoulder on axis 5", "joints 1 and 3 on one axis"])
def test_where_two_joints_turn_about_one_axis_the_seed_decides(name: str, what: str) -> None:
    """At singularities `inverse` with a seed gives its joints back, and holds the pose without."""
    arm = aa.Arm.from_catalogue(name)
    rows = arm._rows
    # theta_2 and theta_5, or theta_6 and theta_3
    hinge, fold = (1, 4) if arm.redundancy == "joint_7" else (5, 2)
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


def test_a_copy_with_changes_keeps_the_rest() -> None:
    """`with_` and `with_tool` of an offset arm change what is asked and keep the rest."""
    arm = FR3.with_(lower=FR3.lower + 0.1, acceleration=10.0, name="mine")
    assert arm.name == "mine" and arm.geometry.a_6 == FR3.geometry.a_6 and (arm.acceleration == 10.0).all()
    np.testing.assert_array_equal(arm.lower, FR3.lower + 0.1)
    np.testing.assert_array_equal(arm.velocity, FR3.velocity)
    assert repr(FR3) == "Arm.from_catalogue('franka_fr3')"
    assert "a_6 88, d_bs 333" in str(FR3) and "a_1 117" in str(MIRRORED)
    other = FR3.with_(a_1=0.1, a_6=0.0)
    assert other.redundancy == "joint_1" and other.forward(Q)[1] == Q[0]


@pytest.mark.parametrize("name", offset_catalogue())
def test_the_doors_of_the_catalogue_are_those_of_any_arm(name: str) -> None:
    """`from_catalogue` and `load` give every offset arm, with its kind and free joint."""
    arm = aa.Arm.from_catalogue(name)
    assert name in aa.catalogue() and aa.Arm.load(name) == arm and eval(repr(arm), {"Arm": aa.Arm}) == arm
    assert (arm.kind, arm.redundancy) in {("offset_wrist", "joint_7"), ("offset_shoulder", "joint_1")}
    q = within(arm, np.random.default_rng(0), 20)
    psi = arm.forward(q)[1]
    np.testing.assert_allclose(psi, q[:, 6 if arm.redundancy == "joint_7" else 0], rtol=0, atol=1e-12)


def test_a_name_or_keyword_that_there_is_not_is_said() -> None:
    """Attributes and keywords that do not exist are refused with a hint."""
    with pytest.raises(AttributeError, match="'Arm' object has no attribute 'postures'"):
        FR3.postures  # noqa: B018 - the name alone is asked
    with pytest.raises(aa.InputError, match="'d_sw', wanted one of 'd_bs', "):
        FR3.with_(d_sw=0.1)
    with pytest.raises(TypeError, match=r"Arm\(\) missing 3 required keyword-only arguments: 'd_se'"):
        aa.Arm(a_6=0.088, d_bs=0.3)
    with pytest.raises(aa.InputError, match="solve of an Arm takes no near=: "):
        FR3.solve(np.eye(4), near=Q)
    with pytest.raises(TypeError, match="unexpected keyword argument 'nonsense'"):
        FR3.solve(np.eye(4), nonsense=1)


@pytest.mark.turns(2)
@of(OWN)
def test_solve_holds_the_pose_and_a_proven_answer_is_the_nearest_of_a_grid(arm: aa.Arm) -> None:
    """`solve` holds pose and limits, and if OK is as near as any value of a grid."""
    q = within(arm, np.random.default_rng(4), 30)
    rng = np.random.default_rng(5)
    seed = np.clip(q + rng.normal(0.0, 0.2, q.shape), arm.lower, arm.upper)
    pose = arm.forward(q)[0]
    found = arm.solve(pose, seed)
    assert found.ok.mean() > 0.9
    reached = np.array([plain_forward(arm, row) for row in found.q[found.ok]])
    assert gap(reached, pose[found.ok]) <= 4e-12
    assert arm.within_limits(found.q[found.ok]).all()
    np.testing.assert_allclose(found.distance, np.linalg.norm(found.q - seed, axis=1), atol=1e-12)
    psi = np.linspace(-np.pi, np.pi, 150)
    every = arm.inverse(pose[:, None, None], psi, np.arange(8)[:, None], on_error="nan")
    grid = np.linalg.norm(every - seed[:, None, None], axis=-1)
    least = np.nanmin(np.where(np.isnan(grid), np.inf, grid), axis=(1, 2))
    proven = found.status == aa.Status.OK
    assert proven.any() or arm is OWN[-1]  # 20 mm leave a nearer one possible in every case
    assert (found.distance[proven] <= least[proven] + 1e-9).all()
    known = arm.solve(pose, q)
    np.testing.assert_allclose(known.q[known.ok], q[known.ok], rtol=0, atol=1e-6)


def test_a_chain_far_from_its_rows_is_rejected() -> None:
    """`with_(chain=)` refuses links too far from the nominal ones."""
    arm = OWN[0]
    with pytest.raises(aa.InputError, match="from the nominal link"):
        arm.deviation.nominal.with_(chain=arm.with_tool(aa.pose([0.0, 0.0, 0.5])).geometry.chain)


@of(OWN)
def test_no_posture_beside_the_best_has_a_larger_margin(arm: aa.Arm) -> None:
    """No value of the free joint next to that of `solve(prefer="margin")` has a larger margin."""
    pose = arm.forward(within(arm, np.random.default_rng(6), 40))[0]
    found = arm.solve(pose, prefer="margin")
    pose, q, psi, gc, margin = (x[found.ok] for x in (pose, found.q, found.psi, found.gc, found.margin))
    slope = aa.gradients.inverse(arm, pose, psi, gc, on_error="nan")
    smooth = np.abs(slope).max(axis=(1, 2)) < 20.0
    assert smooth.sum() > 10
    for aside in (-1e-6, -3e-8, 3e-8, 1e-6):
        beside = arm.inverse(pose, psi + aside, gc, seed=q, limits=False, on_error="nan")[smooth]
        distance = np.minimum(beside - arm.lower, arm.upper - beside).min(axis=1)
        assert (distance <= margin[smooth] + 1e-12).all(), aside
