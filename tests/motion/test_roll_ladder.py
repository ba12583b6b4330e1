"""Paths whose roll is free about an axis that is not axis 7: no roll that is tried by hand is better."""

from __future__ import annotations

import numpy as np
import pytest
from support.calibrated import calibrated
from support.draw import count, generator
from support.moves import along, line, moved, refused, slopes_hold
from support.planned_arms import IIWA

import armangle as aa
from armangle._progress import Progress
from armangle.motion.rolling import best_planned, ladder, rate

TORCH = aa.pose([0.05, 0.0, 0.2], rpy=[0.0, np.radians(45), 0.0])
"""A welding torch: its wire leans by 45 degrees against axis 7."""
ARMS = (IIWA.with_(tool=TORCH), aa.Arm.from_catalogue("openarm_v10").with_(tool=TORCH))
OFFSET = tuple(aa.Arm.from_catalogue(name).with_(tool=TORCH) for name in ("franka_fr3", "ufactory_xarm7"))
POSTURE = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
DENSE = np.linspace(0, 1, 301)


def rolled(frame: np.ndarray, angle: float) -> np.ndarray:
    """A frame rotated about its z axis."""
    return frame @ aa.pose([0, 0, 0], rpy=[0, 0, angle])


def both(path: aa.Line, angle: float, back: bool = False) -> aa.Line:
    """The line, reversed if `back`, both ends rolled by `angle` (rad) about their z axes."""
    ends = rolled(path.start, angle), rolled(path.end, angle)
    return aa.Line(*(ends[::-1] if back else ends))


def seam(arm: aa.Arm, rng: np.random.Generator) -> tuple[np.ndarray, aa.Line]:
    """Random joints within the limits, and a line of some cm from their pose."""
    q = rng.uniform(arm.lower + 0.2, arm.upper - 0.2)
    return q, line(arm, q, rng.uniform(-0.1, 0.1, 3))


def cost(plan: aa.JointPath) -> float:
    """The least cost of the branches that are ok in a plan's diagnosis; infinite if none is."""
    return min((branch.cost for branch in plan.diagnosis.branches if branch.ok), default=np.inf)


def the_wire_is_held(plan: aa.JointPath, path: aa.Path) -> None:
    """Check that a plan keeps position and z axis of the path, and the limits."""
    at = plan.at(DENSE)
    np.testing.assert_allclose(at.pose[:, :3, 2:], path.pose(DENSE)[:, :3, 2:], atol=1e-11)
    np.testing.assert_allclose(plan.arm.forward(at.q)[0], at.pose, atol=1e-11)
    assert plan.arm.within_limits(at.q, 1e-9).all()


@pytest.mark.turns(4)
@pytest.mark.parametrize("arm", [*ARMS, *OFFSET, aa.Arm.from_catalogue("franka_fr3")])
def test_no_roll_by_hand_costs_less(arm: aa.Arm) -> None:
    """A plan with free roll costs no more than plans at 12 fixed rolls."""
    rng, compared = generator(16, 50), 0
    for _ in range(count(2)):
        _, path = seam(arm, rng)
        free = aa.plan(arm, path, roll="free", samples=20)
        for angle in np.radians(np.arange(0, 360, 30)):
            by_hand = aa.plan(arm, both(path, angle), samples=20)
            if by_hand.certified:
                assert free.certified and cost(free) <= cost(by_hand) * (1 + 1e-9)
                compared += 1
        if free.ok:
            the_wire_is_held(free, path)
    assert compared > 3


@pytest.mark.turns(4)
@pytest.mark.parametrize("arm", [*ARMS[::-1], *OFFSET])
def test_the_roll_begins_and_ends_with_what_is_given(arm: aa.Arm) -> None:
    """A plan with free roll keeps a start or goal.

    It costs no more than one that keeps the given posture's roll all along.
    """
    rng, proven = generator(16, 51), 0
    for _ in range(count(2)):
        q, path = seam(arm, rng)
        for end, back in (("start", False), ("goal", True)):
            held = both(path, -0.7, back)
            free = aa.plan(arm, held, roll="free", samples=30, **{end: q})
            plain = aa.plan(arm, both(path, 0.0, back), samples=30, **{end: q})
            assert free.ok or not plain.ok
            if plain.certified:
                assert free.certified and cost(free) <= cost(plain) * (1 + 1e-9)
            if free.certified:
                proven += 1
                the_wire_is_held(free, held)
                np.testing.assert_allclose(free.q[-1 if back else 0], q, atol=1e-8)
                slopes_hold(free, [0.31, 0.77])
    assert proven > 1


def test_both_ends_given_fix_the_roll_at_both() -> None:
    """A plan with free roll keeps start and goal of different rolls."""
    q, other = POSTURE, POSTURE + np.array([0.05, 0.02, -0.04, 0.03, 0.1, -0.05, 0.3])
    arm = ARMS[0]
    first, last = arm.forward(q)[0], arm.forward(other)[0]
    path = aa.Line(rolled(first, 0.4), rolled(last, -0.3))
    free = aa.plan(arm, path, start=q, goal=other, roll="free")
    assert free.certified
    the_wire_is_held(free, path)
    np.testing.assert_allclose(free.q[[0, -1]], [q, other], atol=1e-8)


@pytest.mark.turns(2)
@pytest.mark.parametrize("begun", [False, True])
def test_where_no_roll_that_stays_holds_one_that_turns_is_found(begun: bool) -> None:
    """With free roll a path that spins the tool is planned, though with fixed rolls it fails."""
    arm = ARMS[1]
    first = arm.forward(np.radians([20, 10, 10, 80, 5, 5, 10]))[0]
    path = aa.Screw(first, first[:3, 3], first[:3, 2], 6 * np.pi, advance=0.03)
    for angle in np.radians([0, 180]):
        start = rolled(first, angle)
        assert not aa.plan(arm, aa.Screw(start, path.point, path.direction, path.angle, path.advance)).ok
    free = aa.plan(arm, path, start=arm.solve(rolled(first, 0.5)).q if begun else None, roll="free")
    assert free.certified
    the_wire_is_held(free, path)


def test_poses_one_and_many() -> None:
    """`plan` and `follow` with free roll take one pose, many, and none; `step` with this tool refuses free
    roll.
    """
    arm = ARMS[0]
    poses = along(arm.forward(POSTURE)[0], [0.0, 0.1, 0.05], 7)
    for given in (poses, poses[:1], poses[:2]):
        for ends in ({}, {"start": POSTURE}):
            free = aa.plan(arm, given, roll="free", **ends)
            assert free.certified and len(free) == len(given)
            np.testing.assert_allclose(free.poses[:, :3, 2:], given[:, :3, 2:], atol=1e-12)
        walked = aa.follow(arm, given, start=POSTURE, roll="free")
        assert walked.ok and len(walked) == len(given)
        np.testing.assert_allclose(arm.forward(walked.q)[0], walked.poses, atol=1e-11)
    assert len(aa.plan(arm, np.empty((0, 4, 4)), roll="free")) == 0
    assert len(aa.follow(arm, np.empty((0, 4, 4)), start=POSTURE, roll="free")) == 0
    refused(aa.InputError, "take a whole path", aa.step, arm, POSTURE, poses[0], roll="free")


@pytest.mark.turns(4)
@pytest.mark.parametrize("arm", [*ARMS, OFFSET[0], calibrated("franka_fr3", 1.0, 1.0)])
def test_a_followed_path_comes_as_far_as_with_its_own_roll(arm: aa.Arm) -> None:
    """`follow` with free roll reaches at least as many rows as without."""
    rng, further = generator(16, 52), 0
    for _ in range(count(8)):
        q, path = seam(arm, rng)
        long = aa.Line(path.start, path.end + 4 * (path.end - path.start))
        free, plain = (aa.follow(arm, long, start=q, roll=roll, samples=60) for roll in ("free", "pose"))
        done = free.status == aa.Status.OK
        assert done.sum() >= (plain.status == aa.Status.OK).sum()
        further += done.sum() > (plain.status == aa.Status.OK).sum()
        np.testing.assert_allclose(free.poses[:, :3, 2:], long.pose(free.s)[:, :3, 2:], atol=1e-11)
        np.testing.assert_allclose(arm.forward(free.q[done])[0], free.poses[done], atol=1e-11)
    assert further


def test_obstacles_see_each_roll_of_the_ladder() -> None:
    """`solve` with free roll finds a roll at which a shape on the tool is clear."""
    hand = [aa.Capsule([0.0, 0.0, -0.1], [0.12, 0.0, -0.1], 0.02, name="cable")]
    arm = IIWA.with_(tool=TORCH).with_(hand=hand)
    first = arm.forward(POSTURE)[0]
    beside = first @ np.array([0.1, 0.0, -0.1, 1.0])
    scene = aa.Scene([aa.Ball(beside[:3], 0.02, name="post")], clearance=0.005)
    assert not arm.with_(scene=scene).solve(first, seed=POSTURE).ok
    found = arm.with_(scene=scene).solve(first, seed=POSTURE, roll="free")
    assert found.ok and arm.clearance(found.q, scene).distance >= 0.005 - 1e-9


def test_a_calibrated_arm_has_the_ladder_for_any_tool() -> None:
    """`solve` and `plan` of a calibrated arm with free roll keep the tool's z axis."""
    arm = calibrated("kuka_iiwa7_r800", 1.0, 1.0)
    for armed in (arm, arm.with_(tool=TORCH)):
        pose = armed.forward(POSTURE)[0]
        asked = rolled(pose, 1.0)
        free, plain = (armed.solve(asked, seed=POSTURE, roll=roll) for roll in ("free", "pose"))
        assert free.ok and not plain.distance <= free.distance
        np.testing.assert_allclose(armed.forward(free.q)[0], free.pose, atol=1e-11)
        np.testing.assert_allclose(free.pose[:3, 2:], asked[:3, 2:], atol=1e-11)
        last = moved(asked, [0.0, 0.08, 0.05])
        planned = aa.plan(armed, aa.Line(asked, last), start=POSTURE, roll="free", samples=20)
        assert planned.certified
        np.testing.assert_allclose(armed.forward(planned.q)[0], planned.poses, atol=1e-10)
        np.testing.assert_allclose(planned.poses[:, :3, 2], np.tile(asked[:3, 2], (20, 1)), atol=1e-10)


def test_no_roll_of_a_fine_scan_has_a_nearer_posture() -> None:
    """`solve` with free roll is as near to its seed as the best of 720 rolls."""
    arm = ARMS[0]
    rng = generator(16, 53)
    q, near = rng.uniform(arm.lower, arm.upper, (2, count(20), 7))
    poses = arm.forward(q)[0]
    free = arm.solve(poses, seed=near, roll="free")
    turned = poses[:, None] @ np.array(
        [rolled(np.eye(4), angle) for angle in np.radians(np.arange(0, 360, 0.5))]
    )
    scanned = np.nanmin(arm.solve(turned, seed=near[:, None]).distance, axis=1)
    assert free.ok.all() and (free.distance <= scanned + 1e-9).all()
    np.testing.assert_allclose(arm.forward(free.q)[0], free.pose, atol=1e-11)
    np.testing.assert_allclose(free.pose[:, :3, 2:], poses[:, :3, 2:], atol=1e-11)
    one = arm.solve(poses[3], seed=near[3], roll="free")
    assert one.q.tolist() == free.q[3].tolist()


def test_a_posture_that_one_roll_alone_leaves_is_found() -> None:
    """`solve` with free roll finds a small range of rolls near the reach; out of reach it fails."""
    arm = IIWA.with_(tool=aa.pose([0.08, 0.0, 0.25], rpy=[0.0, np.pi / 4, 0.0]))
    q = [-0.2302, -0.7394, 2.4932, 0.0261, -1.4955, 1.3209, -0.0056]
    asked = rolled(arm.forward(q)[0], 2.6429)
    assert arm.solve(asked, seed=q, roll="free").ok
    assert not arm.solve(aa.pose([3.0, 0.0, 0.0]), seed=q, roll="free").ok


def test_of_rolls_that_all_fail_the_furthest_is_told_of() -> None:
    """A plan with free roll that fails tells of the roll that leads furthest, and how many were tried."""
    arm = IIWA.with_(tool=aa.pose([0.08, 0.0, 0.25], rpy=[0.0, np.pi / 4, 0.0]))
    first, last = (aa.pose([0.5, y, 0.15], rpy=[np.pi, 0, 0]) for y in (-0.15, 0.95))
    free = aa.plan(arm, aa.Line(first, last), roll="free")
    assert not free.ok and free.diagnosis.reached > 0.9
    assert "Of 72 rolls about the tool's z axis that were tried" in free.explain()


class Asked:
    """A request of plans with 5 rows, rated by such plans; `most` is the number of plans that it permits."""

    def __init__(self, most: int) -> None:
        """Begin without plans."""
        self.most = most
        self.rates: list[aa.JointPath] = []
        self.plans: list[aa.JointPath] = []

    @property
    def spent(self) -> bool:
        """Whether no more plans are permitted."""
        return len(self.plans) >= self.most

    def rated(self, path: aa.Path, tell: Progress) -> tuple[bool, float]:
        """Return the rating of a plan, which is kept in `rates`."""
        self.rates.append(aa.plan(ARMS[0], path, samples=5, progress=tell))
        return rate(self.rates[-1].diagnosis.branches)

    def planned(self, path: aa.Path, tell: Progress) -> aa.JointPath:
        """Return a plan, which is kept in `plans`."""
        self.plans.append(aa.plan(ARMS[0], path, samples=5, progress=tell))
        return self.plans[-1]


def test_a_tool_that_stands_takes_the_first_roll_that_costs_nothing() -> None:
    """`best_planned` rates rolls until one costs nothing, and reports progress that rises."""
    pose = ARMS[0].forward(POSTURE)[0]
    path = aa.Line(pose, pose)
    asked, told = Asked(72), list[int]()
    best = best_planned(ARMS[0], path, None, None, asked, lambda done, total: told.append(done))
    assert best.certified and cost(best) < 1e-24 and len(asked.plans) == 1
    assert all(not plan.certified or cost(plan) > 1e-24 for plan in asked.rates[:-1])
    assert len(asked.rates) < len(ladder(ARMS[0], path, None, None)) and told == sorted(told) and told
    result = aa.plan(ARMS[0], path, roll="free")
    assert result.certified
    np.testing.assert_allclose(result.q[0], best.q[0], atol=1e-12)


@pytest.mark.parametrize("most", [1, 72])
def test_rolls_are_planned_in_the_order_of_cost(most: int) -> None:
    """`best_planned` plans the roll of least cost first, and no more once the work is spent."""
    _, path = seam(ARMS[0], generator(16, 54))
    asked = Asked(most)
    best = best_planned(ARMS[0], path, None, None, asked, lambda done, total: None)
    costs = sorted(cost(plan) for plan in asked.rates if plan.ok)
    assert len(costs) > 1 and best.certified and len(asked.plans) <= most
    assert cost(asked.plans[0]) == costs[0] and cost(best) == costs[0]
