"""Laws of refusals: what is said to be the reason is the reason, and what is said to help helps."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence

import numpy as np
import pytest
from support.moves import limited, line, moved, refused
from support.planned_arms import IIWA, TURNING, random_arm

import armangle as aa


def refused_poses(count: int) -> list[tuple[aa.Arm, np.ndarray, aa.types.Branch]]:
    """`count` branches, each with its arm and pose, that are within reach and impossible by joint limits."""
    out: list[tuple[aa.Arm, np.ndarray, aa.types.Branch]] = []
    seed = 0
    while len(out) < count:
        rng = np.random.default_rng(seed)
        seed += 1
        arm = random_arm(rng)
        free = arm.with_(lower=None, upper=None)
        pose = free.forward(rng.uniform(-2.5, 2.5, 7))[0]
        out.extend(
            (arm, pose, b) for b in arm.explain(pose).branches if b.verdict == aa.types.Verdict.IMPOSSIBLE
        )
    return out[:count]


CASES = refused_poses(60)
AMID = np.array([0.3, 0.6, 0.2, -1.4, 0.4, 0.9, 0.5])


def test_verdicts_are_those_of_the_feasible_arcs() -> None:
    """`explain` calls a branch ok where `feasible` has an arc, with the same status."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        arm = random_arm(rng)
        pose = arm.with_(lower=None, upper=None).forward(rng.uniform(-2.5, 2.5, 7))[0]
        arcs = arm.feasible(pose, np.arange(8))
        diagnosis = arm.explain(pose)
        assert [b.ok for b in diagnosis.branches] == (~np.asarray(arcs.is_empty)).tolist()
        assert [b.status for b in diagnosis.branches] == np.asarray(arcs.status).tolist()
        assert diagnosis.ok == (not np.all(arcs.is_empty))


def common(sets: aa.ArcSet, joints: Sequence[int]) -> aa.ArcSet:
    """What the arcs of these joints (1..7) have in common."""
    out = aa.ArcSet([[-np.pi, np.pi]])
    for joint in joints:
        out = out & sets[joint - 1]
    return out


def opened(arm: aa.Arm, opening: aa.types.Opening, extra: float) -> aa.Arm:
    """The arm with the limit that `opening` names moved outward by `extra` (rad)."""
    limits = {"lower": arm.lower, "upper": arm.upper}
    sign = 1 if opening.side == "upper" else -1
    at = float(limits[opening.side][opening.joint - 1])
    return limited(arm, opening.joint - 1, **{opening.side: at + sign * extra})


def test_the_blocking_joints_block_and_no_fewer_do() -> None:
    """The arcs of the joints in `blocking` have nothing in common; without any one of them they have."""
    for arm, pose, branch in CASES:
        sets = arm.feasible(pose, branch.gc, per_joint=True)
        assert branch.blocking
        assert common(sets, branch.blocking).is_empty
        for joint in branch.blocking:
            assert not common(sets, [j for j in branch.blocking if j != joint]).is_empty


def test_an_opening_opens_a_little_less_does_not_and_no_other_limit_does() -> None:
    """With a limit wider by `opening.extra` the branch holds the pose, with less not, and limits without
    opening do not help.
    """
    seen = 0
    for k, (arm, pose, branch) in enumerate(CASES):
        assert [o.extra for o in branch.openings] == sorted(o.extra for o in branch.openings)
        for opening in branch.openings:
            seen += 1
            for share, wanted in ((1e-6, False), (-1e-6, True)):
                assert bool(opened(arm, opening, opening.extra - share).explain(pose)[branch.gc].ok) == wanted
        named = {(o.joint, o.side) for o in branch.openings}
        for joint, side in itertools.product(range(1, 8), ("lower", "upper")) if k < 20 else ():
            if (joint, side) not in named:
                other = aa.types.Opening(joint, side, 0.0)
                assert not opened(arm, other, 2 * np.pi).explain(pose)[branch.gc].ok
    assert seen > 50


def test_what_is_said_of_a_pose_speaks_of_no_path() -> None:
    """The sentences of the branches of a pose name neither a path nor an s."""
    pose = IIWA.forward(AMID)[0]
    for at in (pose, aa.pose([9.0, 0.0, 0.0])):
        for branch in IIWA.explain(at).branches:
            assert not re.search(r"path|curve|s =|nan", branch.explain())


def test_out_of_reach_says_by_how_much_and_from_where() -> None:
    """The diagnosis of a plan that leaves the reach gives s_from and the excess (m); rows before it are
    solved.
    """
    pose = IIWA.forward(AMID)[0]
    path = aa.Line(pose, moved(pose, [1.0, 0.0, 0.0]), "fixed")
    result = aa.plan(IIWA, path)
    branch = result.diagnosis[2]
    assert branch.verdict == aa.types.Verdict.UNREACHABLE and branch.s_to == 1.0
    wrist = path.pose([branch.s_from, 1.0])[:, :3] @ [0, 0, -0.126, 1.0] - [0, 0, 0.34]
    distance = np.linalg.norm(wrist, axis=1)
    assert abs(distance[0] - 0.8) < 1e-4 and abs(distance[1] - 0.8 - branch.excess) < 1e-9
    assert "mm" in result.explain() and "out of reach" in result.explain()
    done = result.status == aa.Status.OK
    assert np.isfinite(result.q[done]).all() and np.isnan(result.q[~done]).all()
    assert result.s[done].max() <= result.diagnosis.reached
    refused(aa.PathError, "out of reach", result.raise_for_status)
    beyond = result.at([0.0, 1.0])
    assert np.isfinite(beyond.q[0]).all() and np.isnan(beyond.q[1]).all() and beyond.gc[1] == -1


def test_an_impossible_place_of_a_path_has_no_feasible_arc() -> None:
    """If the diagnosis of a plan says IMPOSSIBLE, `feasible` is empty at s_from and at s_to."""
    found = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        arm = random_arm(rng)
        q = rng.uniform(arm.lower, arm.upper)
        path = aa.Line(arm.forward(q)[0], arm.forward(rng.uniform(arm.lower, arm.upper))[0])
        result = aa.plan(arm, path, start=q)
        branch = result.diagnosis[int(arm.forward(q)[2])]
        if branch.verdict != aa.types.Verdict.IMPOSSIBLE:
            continue
        found += 1
        middle = 0.5 * (branch.s_from + branch.s_to)
        assert all(arm.feasible(path.pose(s), branch.gc).is_empty for s in (branch.s_from, branch.s_to))
        assert branch.blocking and not result.certified and np.isfinite(middle)
    assert found > 3


def test_a_dead_end_is_named_with_where_it_closes() -> None:
    """The diagnosis of a plan gives s and psi of a dead end, though `feasible` is nowhere empty."""
    pose = TURNING.forward([0.2, 0.6, 0.1, -1.3, 0.2, 0.9, 0.0])[0]
    path = aa.Screw(pose, pose[:3, 3], pose[:3, 2], 2.2 * 2 * np.pi)
    result = aa.plan(TURNING, path, gc=2)
    branch = result.diagnosis[2]
    assert branch.verdict == aa.types.Verdict.DEAD_END
    assert 0 < branch.s_from <= branch.s_to < 1
    assert branch.nearest_psi in TURNING.feasible(path.pose(branch.s_to), 2)
    assert result.diagnosis.reached == branch.reached == branch.s_from
    assert not any(TURNING.feasible(path.pose(s), 2).is_empty for s in np.linspace(0, 1, 200))


@pytest.mark.parametrize("which", ["start", "goal"])
def test_start_or_goal_in_another_branch_or_outside_is_said(which: str) -> None:
    """The diagnosis of a plan says that start or goal is in another branch, beyond a limit, or near
    singular.
    """
    pose, verdict = IIWA.forward(AMID)[0], aa.types.Verdict[which.upper()]
    other = aa.plan(IIWA, pose[None], gc=0, **{which: AMID})
    assert other.diagnosis[0].verdict == verdict and other.diagnosis[0].elsewhere
    outside = np.append(AMID[:6], IIWA.upper[6] + 0.01)
    late = aa.plan(IIWA, IIWA.forward(outside)[0][None], **{which: outside})
    own = late.diagnosis.branches[0]
    assert not late.ok and (own.verdict, own.status) == (verdict, aa.Status.LIMITS)
    assert [(o.joint, o.side) for o in own.openings] == [(7, "upper")]
    assert own.openings[0].extra == pytest.approx(0.01)
    assert [branch.elsewhere for branch in late.diagnosis.branches] == [False] + 7 * [True]
    margin = aa.plan(IIWA.with_(singularity_margin=0.7), pose[None], **{which: AMID}).diagnosis.branches[0]
    assert (margin.verdict, margin.status) == (verdict, aa.Status.NEAR_SINGULAR)


def test_bad_input_and_a_branch_that_was_not_asked_for() -> None:
    """`explain` refuses what is no pose; a diagnosis raises KeyError for a branch that it does not have."""
    with pytest.raises(KeyError):
        aa.types.Diagnosis((aa.types.Branch(gc=0, verdict=aa.types.Verdict.DEAD_END),))[5]
    refused(aa.InputError, r"pose has shape \(1, 4, 4\)", IIWA.explain, np.eye(4)[None])
    refused(aa.InputError, "not orthonormal", IIWA.explain, np.diag([2.0, 1.0, 1.0, 1.0]))


def test_an_openarm_that_hangs_straight_is_told_how_to_begin() -> None:
    """Straight down joints 1, 3 and 5 share an axis: `plan` fails from there and `explain` advises no
    start.
    """
    arm = aa.Arm.from_catalogue("openarm_v10")
    way = line(arm, np.zeros(7), [0, 0, -0.1])
    failed = aa.plan(arm, way, start=np.zeros(7), samples=30)
    assert not failed.ok and "Plan without start=" in failed.explain()
    free = aa.plan(arm, way, samples=30)
    assert free.ok
    np.testing.assert_allclose(arm.forward(free.at(0.0).q)[0], way.start, atol=1e-9)


def test_an_opening_of_a_path_opens_all_of_it_and_is_hardly_more_than_it_takes() -> None:
    """With a plan's first opening all poses have arcs in its branch, with 5 % less some have none."""
    s, seen, seed = np.linspace(0, 1, 1001), 0, 0
    while seen < 20:
        rng = np.random.default_rng([3, seed])
        seed += 1
        arm = random_arm(rng)
        q, way = rng.uniform(arm.lower + 0.05, arm.upper - 0.05), rng.normal(size=3)
        path = line(arm, q, 0.3 * (arm.geometry.d_se + arm.geometry.d_ew) * way / np.linalg.norm(way))
        for branch in aa.plan(arm, path, samples=2).diagnosis.branches:
            if branch.verdict != aa.types.Verdict.IMPOSSIBLE or not branch.openings:
                continue
            seen += 1
            opening = branch.openings[0]
            for share, wanted in ((1.0, True), (1 / 1.05, False)):
                arcs = opened(arm, opening, opening.extra * share).feasible(path.pose(s), branch.gc)
                assert np.asarray(arcs.is_empty).any() != wanted, (seed, opening)


def test_an_elbow_within_the_margin_is_the_reason_whatever_other_joints_are() -> None:
    """In `explain` joint 4 alone blocks branches whose status is ELBOW_LIMIT or ELBOW_MARGIN."""
    arm = aa.Arm.from_catalogue("fourier_gr2t2_right")
    q = np.array([-2.9791830040839286, -0.7969960236974973, -1.2181440680162838, 0.09554176151753335,
                  -1.7617132525291346, 0.6732222893259334, 0.6440776346441188])  # fmt: skip
    told = arm.with_(singularity_margin=0.3).explain(arm.forward(q)[0])
    assert not told.ok
    for branch in told.branches:
        if branch.status in (aa.Status.ELBOW_LIMIT, aa.Status.ELBOW_MARGIN):
            assert branch.blocking == (4,), branch
