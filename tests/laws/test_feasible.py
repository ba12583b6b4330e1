"""Feasible arcs: feasible <=> within limits, ends on their limits, margins, and a second implementation."""

from __future__ import annotations

import numpy as np
import pytest
from reference import mended as reference
from reference import mended_arcs, mended_arm, mended_joints
from reference.mended_arm import Arm as MendedArm
from support import draw
from support.laws import BEND_OF, EPS, JOINT, PIVOTS, Verdict, circle_gap, classify, gap, members
from support.limit_cases import ANGLES, POSES, Case, cases
from support.strategies import (
    TURN,
    Array,
    arms,
    bends,
    generated_arm,
    joint_values,
    postures,
    unlimited,
)
from support.threads import in_threads

import armangle as aa
from armangle._core import Wanted
from armangle.models.catalogue import srs_catalogue

END = 1e-11
"""A joint at the end of an arc is this near to the limit that made the end, rad."""

WHOLE_CIRCLE = [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0], [0, np.pi, 1]]
"""theta_2, theta_4 - delta, theta_6 (rad) of arms straight up, candles, bent and stretched ones."""


def tally(seed: int, count: int) -> Verdict:
    """The verdicts of `count` cases as one."""
    verdicts = [classify(c.arm, c.pose, c.gc, c.psi) for c in cases(seed, count)]
    wrong = [line for verdict in verdicts for line in verdict.wrong]
    return Verdict(sum(v.samples for v in verdicts), sum(v.clear for v in verdicts), wrong)


@pytest.mark.core
def test_feasible_is_within_limits() -> None:
    """`feasible` agrees with the joints' limits in all samples, over all arms and regimes."""
    found = tally(seed=1, count=draw.count(100))
    assert found.wrong == []
    assert found.clear > 0.5 * found.samples


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("bend", WHOLE_CIRCLE, ids=str)
def test_poses_that_are_singular_for_every_psi(bend: list[float]) -> None:
    """`feasible` agrees with limits at poses that are singular for every psi."""
    rng = draw.generator(3)
    for arm in (
        aa.Arm.from_catalogue("kuka_iiwa7_r800"),
        aa.Arm.from_catalogue("barrett_wam7"),
        generated_arm(2),
    ):
        theta = rng.choice([0, np.pi / 2, -np.pi / 2, np.pi, 0.3, -2.0], (POSES, 7))
        theta[:, [1, 3, 5]] = np.array(bend) + np.array([0, arm.geometry.delta, 0])
        q = joint_values(arm, theta)
        free = unlimited(arm)
        pose, psi, gc = free.forward(q, on_error="nan")
        known = ~np.isnan(psi)
        for _ in range(40):
            width = rng.choice([1e-3, 0.5, 2, 3.5, 6], 7)
            lower = q[rng.integers(POSES)] - rng.choice([0.0, 1e-6, 0.2], 7) * rng.choice([1, -1])
            limited = arm.with_(lower=lower, upper=lower + width)
            angles = rng.uniform(-np.pi, np.pi, (known.sum(), ANGLES))
            assert classify(limited, pose[known], gc[known], angles).wrong == []


def limit_ends(case: Case) -> list[tuple[float, str]]:
    """For every end of each joint's arcs how far it is off beyond the bound (rad; > 0 is wrong), and words
    for it.
    """
    arcs = case.arm.feasible(case.pose, case.gc, per_joint=True)
    found = [
        (p, psi, end)
        for p, rows in enumerate(arcs.ends)
        for j, pairs in enumerate(rows)
        for pair, interval in zip(pairs, arcs.intervals[p, j], strict=False)
        for psi, end in zip(interval, pair, strict=False)
    ]
    if not found:
        return []
    at, psi, ends = (list(column) for column in zip(*found, strict=True))
    joint = np.array([end.joint for end in ends]) - 1
    free, row = unlimited(case.arm), np.arange(len(joint))
    q = free.inverse(case.pose[at], psi, case.gc[at], limits=False)
    slope = np.abs(free.self_motion(case.pose[at], psi, case.gc[at]))[row, joint]
    sine = np.abs(np.sin(bends(case.arm, q)))[row, BEND_OF[joint]]
    jump = np.array([end.side == "singular" for end in ends])
    blur = np.where(PIVOTS[joint], 16 * EPS * (slope + 1 / np.maximum(sine, 1e-300)), 16 * EPS * slope)
    off = np.where(jump, sine, circle_gap(q[row, joint], np.array([end.value for end in ends])))
    excess = off - np.where(jump, np.sqrt(EPS), END + blur)  # a jump is passed within rounding of psi
    return [(float(excess[i]), f"{ends[i]} at {psi[i]!r}, off {off[i]:.3g}, blur {blur[i]:.3g}") for i in row]


def test_every_end_is_on_the_limit_that_made_it() -> None:
    """At each end of a joint's arcs the joint is at the limit named, or singular."""
    # Where the joint turns fast with psi, or its bend vanishes, rounding of psi and pose moves it by
    # 16 eps (|dq/dpsi| + 1 / |sin|): that is allowed on top of 1e-11.
    found = [end for case in cases(seed=4, count=draw.count(150)) for end in limit_ends(case)]
    assert len(found) > 6_000
    assert [what for excess, what in found if excess > 0] == []


def test_an_end_names_its_limit() -> None:
    """An end of a joint's arcs names that joint, and the value of its limit."""
    for case in cases(seed=12, count=20):
        each = case.arm.feasible(case.pose, case.gc, per_joint=True)
        for rows in each.ends:
            for j, pairs in enumerate(rows):
                for end in (end for pair in pairs for end in pair if end.side != "singular"):
                    assert end.joint == j + 1
                    assert end.value == (case.arm.lower if end.side == "lower" else case.arm.upper)[j]


@pytest.mark.parametrize("margin", [1e-4, 0.01, 0.1, 0.5])
def test_the_singularity_margin_keeps_the_bends(margin: float) -> None:
    """`feasible` with singularity_margin holds the psi at which all three bends keep it."""
    rng = draw.generator(5)
    for arm in arms()[::3]:
        free = unlimited(arm)
        for regime in ("uniform", "near_singular", "singular"):
            pose, _, gc = free.forward(postures(arm, regime, draw.count(30), 5))
            psi = rng.uniform(-np.pi, np.pi, (len(pose), 60))
            arcs = free.with_(singularity_margin=margin).feasible(pose, gc)
            sines = np.abs(np.sin(bends(arm, free.inverse(pose[:, None], psi, gc[:, None], limits=False))))
            clear = (np.abs(sines - np.sin(margin)) > 1e-9).all(-1)
            kept = (sines >= np.sin(margin)).all(-1)
            assert np.array_equal(members(arcs, psi)[clear], kept[clear])
            bent = sines[:, 0, 1] >= np.sin(margin) + 1e-9
            assert not (arcs.status[bent] == aa.Status.ELBOW_MARGIN).any()
            assert (arcs.status[sines[:, 0, 1] < np.sin(margin) - 1e-9] == aa.Status.ELBOW_MARGIN).all()


def avoiding(arm: aa.Arm, pose: Array, gc: int, width: float, discriminant: float = 1e-3) -> aa.ArcSet:
    """The arcs that the paper's avoidance of singularities leaves: without `width` (rad) on each side of the
    psi of Eq. (31) of joints whose discriminant in Eq. (30) is at most `discriminant` in size.
    """
    return arm._arcs(pose, gc, Wanted.BRANCH, (), None, paper=(width, discriminant))


def test_the_margin_of_the_paper_removes_arcs_around_singular_psi() -> None:
    """The paper's avoidance removes `width` on both sides of a singular psi, and nothing elsewhere."""
    arm = unlimited(aa.Arm.from_catalogue("kuka_iiwa7_r800"))
    pose, psi, gc = arm.forward(np.radians([10, 0, 20, 70, 30, 60, 10.0]))
    width = 0.1
    arcs = avoiding(arm, pose, gc, width)
    assert abs((~arcs).measure - 2 * width) <= JOINT
    assert psi not in arcs
    assert abs(circle_gap(arcs.nearest(psi), psi) - width) <= 1e-6
    assert {end.side for pair in arcs.ends for end in pair} == {"singular"}
    assert avoiding(arm, pose, gc, width, 0.0).measure >= TURN - 2 * width - JOINT
    elsewhere = arm.forward(np.radians([10, 40, 20, 70, 30, 60, 10.0]))
    assert avoiding(arm, elsewhere[0], elsewhere[2], width).is_full


def test_infinite_limits_and_a_full_turn_are_the_full_circle() -> None:
    for arm in arms()[::4]:
        pose, _, _ = arm.forward(postures(arm, "uniform", 5, 6))
        gc = np.arange(8)[:, None]
        assert unlimited(arm).feasible(pose, gc).is_full.all()
        turning = arm.with_(lower=np.full(7, 1.0), upper=np.full(7, 1.0 + TURN))
        assert turning.feasible(pose, gc).is_full.all()


def test_the_statuses_of_empty_arcs() -> None:
    """The status of an empty set names reach, fold, elbow, margin or limits."""
    arm = aa.Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
    q = np.array([0.1, 0.5, 0.2, 1.2, 0.3, 0.8, 0.4])
    pose, _, gc = arm.forward(q)
    far, folded = pose.copy(), arm.forward(np.where(np.arange(7) == 3, np.pi, q), on_error="nan")[0]
    far[0, 3] += 2
    assert arm.feasible(far, gc).status is aa.Status.UNREACHABLE
    assert arm.feasible(folded, gc).status is aa.Status.FOLDED
    elbow = arm.with_(lower=[*3 * [-3], 1.3, *3 * [-3]], upper=3 * np.ones(7))
    assert elbow.feasible(pose, gc).status is aa.Status.ELBOW_LIMIT
    assert arm.with_(singularity_margin=1.4).feasible(pose, gc).status is aa.Status.ELBOW_MARGIN
    boxed = arm.with_(lower=np.full(7, 2.0), upper=np.full(7, 2.01)).with_(lower=[*3 * [2], 1.1, *3 * [2]])
    assert boxed.feasible(pose, gc).status is aa.Status.LIMITS
    assert arm.feasible(pose, gc).status is aa.Status.OK
    each = elbow.feasible(pose, gc, per_joint=True)
    assert [aa.Status(code).name for code in each.status] == [*3 * ["OK"], "ELBOW_LIMIT", *3 * ["OK"]]


def test_batches_and_threads_are_their_elements() -> None:
    """`feasible` of a batch, with any number of threads, equals that of each pose and branch."""
    case = next(cases(seed=8, count=1))
    gc = np.arange(8)[:, None]
    batch = case.arm.feasible(case.pose, gc)
    assert batch.shape == (8, len(case.pose))
    for threads in (0, 2, 5, 99):
        again = in_threads(threads, lambda: case.arm.feasible(case.pose, gc))
        assert again == batch
        assert again.ends == batch.ends
    for i, j in np.ndindex(*batch.shape):
        one = case.arm.feasible(case.pose[j], i)
        assert one == batch[i, j]
        assert one.ends == batch[i, j].ends == batch.ends[i][j]
        assert one.status == batch.status[i, j]


@pytest.mark.parametrize("shape", [(0,), (0, 3), (2, 0)], ids=str)
def test_empty_batches(shape: tuple[int, ...]) -> None:
    """`feasible` of no poses has the right shapes, and so have its operators."""
    arm = arms()[0]
    pose, gc = np.empty((*shape, 4, 4)), np.empty(shape, dtype=np.int64)
    for arcs, wanted in (
        (arm.feasible(pose, gc), shape),
        (arm.feasible(pose, gc, per_joint=True), (*shape, 7)),
    ):
        assert {arcs.shape, arcs.count.shape, arcs.measure.shape, arcs.is_full.shape, arcs.status.shape} == {
            wanted
        }
        assert arcs.intervals.shape == (*wanted, 0, 2)
        assert len(arcs.ends) == shape[0]
        assert all(len(row) == wanted[1] for row in arcs.ends)
        assert (~arcs & arcs | arcs).shape == wanted
        assert arcs.contains(np.empty(wanted)).shape == wanted


HINGES = [1, 5]


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("joint", [0, 1, 2, 4, 5, 6])
@pytest.mark.parametrize("half_range", [0.0, 0.5e-9, 1e-8])
def test_a_locked_joint_leaves_isolated_psi(joint: int, half_range: float) -> None:
    """With a locked joint `feasible` has arcs of no width where the joint has its value; `step` and `solve`
    are OK.
    """
    rng = draw.generator(13)
    some = arms()[::2]
    for arm in some:
        count = draw.count(3, arms=len(some))
        for q in rng.uniform(np.maximum(arm.lower, -6), np.minimum(arm.upper, 6), (count, 7)):
            lower, upper = arm.lower.copy(), arm.upper.copy()
            lower[joint], upper[joint] = q[joint] - half_range, q[joint] + half_range
            locked = arm.with_(lower=lower, upper=upper)
            pose, psi, gc = locked.forward(q)
            arcs, alone = locked.feasible(pose, gc), locked.feasible(pose, gc, per_joint=True)[joint]
            assert arcs.status is aa.Status.OK
            # where the joint turns back at its locked value, two psi are one: rounding parts them by its root
            for found in (arcs, alone):
                gap = circle_gap(found.nearest(psi), psi)
                assert psi in found or gap * max(gap, rate(locked, pose, psi, gc, joint)) <= 1e-12
            assert alone.count in (1, 2)
            assert locked.feasible(pose)[int(gc)] == arcs
            assert (alone & arcs).count == arcs.count
            assert aa.step(locked, q, pose).status is aa.Status.OK
            assert locked.solve(pose, seed=q).status is aa.Status.OK
            if half_range > 0:
                continue
            assert arcs.measure == 0.0
            assert arcs.nearest(psi + 0.1) in arcs
            for at, ends in zip(arcs.intervals[:, 0], arcs.ends, strict=True):
                assert {end.joint for end in ends} == {joint + 1}
                off = circle_gap(locked.inverse(pose, at, gc, seed=q, limits=False)[joint], q[joint])
                assert off <= 1e-12 + 16 * EPS * rate(locked, pose, at, gc, joint)


def rate(arm: aa.Arm, pose: np.ndarray, psi: float, gc: int, joint: int) -> float:
    """How fast (rad/rad) a joint (from 0) turns with psi there."""
    return float(abs(unlimited(arm).self_motion(pose, psi, gc)[joint]))


def test_a_joint_locked_where_it_stops_turning_leaves_its_psi() -> None:
    """With a joint locked at its extreme over psi `feasible` holds that psi."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    pose, _, gc = arm.forward([0.3, 0.6, -0.2, -1.3, 0.4, 0.9, 0.1])
    for joint in (0, 5):
        turning = aa.gradients.joint_function(arm, pose, gc, joint + 1)
        for psi in turning.stationary:
            q = arm.inverse(pose, psi, gc, limits=False)
            lower, upper = np.full(7, -np.pi), np.full(7, np.pi)
            lower[joint] = upper[joint] = q[joint]
            found = arm.with_(lower=lower, upper=upper).feasible(pose, gc)
            assert found.count >= 1
            assert circle_gap(found.intervals, psi).max() <= 1e-7
            assert abs(arm.inverse(pose, found.intervals[0, 0], gc, limits=False)[joint] - q[joint]) <= 1e-12


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("width", [0.5, 0.01])
@pytest.mark.parametrize("off", [0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9])
def test_a_posture_amid_its_limits_beside_a_singular_one_has_arcs(off: float, width: float) -> None:
    """`feasible` holds the psi of joints amid their limits, theta_2 or theta_6 near 0."""
    rng = draw.generator(14)
    some = arms()[::3]
    for arm in some:
        for hinge in HINGES:
            theta = rng.uniform(-2.5, 2.5, (draw.count(4, arms=len(some)), 7))
            theta[:, [1, 5]] = rng.uniform(0.3, 1.5, (len(theta), 2)) * rng.choice([-1, 1], (len(theta), 2))
            theta[:, 3] = arm.geometry.delta + rng.uniform(0.4, 1.5, len(theta)) * rng.choice(
                [-1, 1], len(theta)
            )
            theta[:, hinge] = off * rng.choice([-1, 1], len(theta))
            for q in joint_values(arm, theta):
                boxed = arm.with_(lower=q - width, upper=q + width)
                pose, psi, gc = boxed.forward(q)
                assert psi in boxed.feasible(pose, gc)
                assert psi in boxed.feasible(pose)[int(gc)]


def test_where_two_joints_are_one_axis_their_sum_must_fit() -> None:
    """With theta_2 = 0 psi is feasible if the limits of joints 1 and 3 permit their sum."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.array([0.4, 0.0, 0.7, -1.2, 0.3, 0.8, 0.5])
    pose, psi, gc = arm.forward(q)
    for shift, fits in ((0.0, True), (0.009, True), (0.011, False)):
        middle = q + np.array([shift, 0, shift, 0, 0, 0, 0])
        boxed = arm.with_(lower=middle - 0.01, upper=middle + 0.01)
        assert (psi in boxed.feasible(pose, gc)) == fits


def mended(arm: aa.Arm) -> MendedArm:
    """The same arm for the second implementation."""
    lengths = ("d_bs", "d_se", "d_ew", "d_wf", "a_3", "a_4")
    names = (*lengths, "signs", "offsets", "lower", "upper", "base", "tool")
    return MendedArm(**{name: arm._number(name) for name in names})


@pytest.mark.turns(6)
@pytest.mark.parametrize("arm", [arm for arm in arms() if arm.geometry.d_4 == 0], ids=lambda arm: arm.name)
def test_a_second_implementation_finds_the_same_joints_and_slopes(arm: aa.Arm) -> None:
    """Poses, joints and self-motions equal those of the second implementation, if not singular."""
    other, rng = mended(arm), draw.generator(15)
    for regime in ("uniform", "singular", "on_limit"):
        for q in postures(arm, regime, draw.count(4), 15):
            pose, psi, gc = arm.forward(q)
            its_pose, its_psi, its_gc = reference.forward(other, q)
            assert gap(its_pose, pose) <= 1e-13 and gap(mended_arm.pose_of(other, q), pose) <= 1e-13
            regular = np.abs(np.sin(bends(arm, q))).min() > 1e-2
            if not regular:
                back = reference.inverse(other, pose, float(psi), int(gc), seed=q)
                assert gap(mended_arm.pose_of(other, back), pose) <= 1e-12
                continue
            assert circle_gap(its_psi, psi) <= 1e-10 and its_gc == gc
            branch, angle = int(rng.integers(8)), float(rng.uniform(-np.pi, np.pi))
            mine = arm.inverse(pose, angle, branch, seed=q, limits=False)
            if np.abs(np.sin(bends(arm, mine))).min() > 1e-2:
                assert gap(reference.inverse(other, pose, angle, branch, seed=q), mine) <= 1e-9
                slopes = mended_joints.self_motion(other, pose, angle, branch)
                assert np.allclose(slopes, arm.self_motion(pose, angle, branch), rtol=1e-8, atol=1e-9)


def same_arcs(arm: aa.Arm, pose: Array, gc: int, margin: float) -> str | None:
    """Words for how the second implementation's arcs or status differ, or None."""
    status, arcs = mended_arcs.feasible(mended(arm), pose, gc, margin)
    mine = arm.with_(singularity_margin=margin).feasible(pose, gc)
    theirs = aa.ArcSet(arcs)
    apart = (mine & ~theirs).measure + (theirs & ~mine).measure
    if mine.status.name == status and apart <= 1e-6:
        return None
    return (
        f"{arm!r} {pose.tolist()} gc={gc}: {mine} {mine.status.name}, second implementation {theirs} {status}"
    )


@pytest.mark.parametrize("margin", [0.0, 0.05])
def test_a_second_implementation_finds_the_same_arcs(margin: float) -> None:
    """Arcs and status equal those of the second implementation."""
    rng = draw.generator(9)
    said = []
    for arm in arms():
        if (
            arm.geometry.d_4 != 0
        ):  # the second implementation has the paper's lengths alone, and no gap along axis 4
            continue
        for pose in arm.forward(postures(arm, "uniform", 4, 9))[0]:
            said.append(same_arcs(arm, pose, int(rng.integers(8)), margin))
    for case in cases(seed=10, count=30):
        if case.arm.geometry.d_4 != 0:
            continue
        q = unlimited(case.arm).inverse(case.pose, 0.3, case.gc)
        regular = np.abs(np.sin(bends(case.arm, q))).min(-1) > 1e-3
        said += [
            same_arcs(case.arm, pose, int(gc), margin)
            for pose, gc in zip(case.pose[regular][:2], case.gc[regular][:2], strict=True)
        ]
    assert [line for line in said if line] == []


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", srs_catalogue())
@pytest.mark.parametrize("margin", [0.0, 0.1])
def test_all_branches_at_once_are_the_branches_one_by_one(name: str, margin: float) -> None:
    """`feasible` without gc equals that of each branch, out of reach and at theta_2 = 0 too."""
    arm, count = aa.Arm.from_catalogue(name).with_(singularity_margin=margin), 300
    q = np.random.default_rng(7).uniform(
        np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (count, 7)
    )
    q[: count // 10, 1] = -arm.geometry.offsets[1] * arm.geometry.signs[1]  # theta_2 = 0
    pose, _, _ = arm.forward(q)
    pose[-1, :3, 3] += 10.0 * arm.geometry.reach  # out of reach
    together, one_by_one = arm.feasible(pose), arm.feasible(pose[:, None], np.arange(8))
    assert together.shape == (count, 8) and arm.feasible(pose[0]).shape == (8,)
    assert together == one_by_one
    assert np.array_equal(together.status, one_by_one.status)
    assert together[3].ends == one_by_one[3].ends
    assert together[-1, 0].status is aa.Status.UNREACHABLE
