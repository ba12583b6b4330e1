"""Laws of followed paths between their rows: limits are kept there too, timed or not."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.calibrated import calibrated
from support.draw import COUNT, generator
from support.moves import limited, line, refused
from support.needs import need

import armangle as aa
from armangle.motion.kinds import curve_through
from armangle.timing.motion import breaks

ARMS: dict[str, Any] = {
    "kuka_iiwa7_r800": aa.Arm.from_catalogue("kuka_iiwa7_r800"),
    "openarm_v10": aa.Arm.from_catalogue("openarm_v10"),
    "calibrated": calibrated("realman_rm75_b", 1.0, 1.0, seed=2),
    "franka_fr3": aa.Arm.from_catalogue("franka_fr3"),
}
need("scipy")
DENSE = np.linspace(0.0, 1.0, 5001)
KEPT = 1e-8
RIDING = [1.26221, -0.49796, -1.75243, 0.25599, 1.40474, 1.52206, -1.85793]
"""Where a path with the elbow up rides on the limits of an iiwa 7."""


def rows(arm: Any, q: Any, shift: Any, count: int = 80) -> Any:
    """Poses along a line from joints."""
    return line(arm, q, shift).pose(np.linspace(0, 1, count))


def passed(arm: Any, q: Any) -> float:
    """The largest violation of a limit by joints (..., 7), rad; negative within all."""
    return float(np.maximum(arm.lower - q, q - arm.upper).max())


def riding() -> aa.JointPath:
    """A followed path that rides along the limits of an iiwa 7."""
    arm = ARMS["kuka_iiwa7_r800"]
    poses = rows(arm, RIDING, [0.1108, 0.2563, -0.1097])[::4]
    return aa.follow(arm, poses, start=RIDING, policy=aa.Towards(direction="up"))


def followed(arm: Any, n: int, seed: int) -> Iterator[aa.JointPath]:
    """Yield n followed paths of one branch along random lines, under policies in turn."""
    rng = generator(seed)
    policies = [aa.Hold(), aa.Repulsion(K=0.1, alpha=20.0), aa.Towards(direction="up")]
    if arm.kind.startswith("offset"):
        policies.pop()
    while n > 0:
        q = 0.95 * rng.uniform(np.maximum(arm.lower, -3.1), np.minimum(arm.upper, 3.1))
        shift = rng.normal(size=3)
        poses = rows(arm, q, 0.3 * shift / np.linalg.norm(shift))
        path = aa.follow(arm, poses, start=q, policy=policies[n % len(policies)])
        if path.ok and len(set(path.gc.tolist())) == 1:
            n -= 1
            yield path


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ARMS)
def test_limits_are_kept_between_rows(name: str) -> None:
    """`at` of a followed path keeps limits and poses between rows, or refuses in at most 4 of 40."""
    arm = ARMS[name]
    more = refused = 0
    for path in followed(arm, 40, 3):
        try:
            at = path.at(DENSE)
        except aa.PathError as error:
            refused += 1
            assert "passes its limit by" in str(error)
            continue
        known = np.isfinite(at.q).all(axis=1)
        assert passed(arm, at.q[known]) <= KEPT
        assert np.abs(arm.forward(at.q[known])[0] - at.pose[known]).max() <= 1e-9
        np.testing.assert_allclose(path.at(path.s).q, path.q, atol=1e-6)
        more += len(breaks(path)) > len(path)
    assert more >= 2 and refused <= 4


@pytest.mark.turns(2)
@pytest.mark.parametrize("given", [{}, {"jerk": 500.0}, {"tolerance": 1e-4}], ids=str)
def test_a_timed_path_keeps_the_limits_that_it_rides_on(given: dict[str, float]) -> None:
    """`retime` of a path that rides on limits keeps them, on the path within its tolerance."""
    path = riding()
    arm = path.arm
    timed = aa.retime(path, acceleration=5.0, sample=1e-3, **given)
    assert passed(arm, timed.q) <= KEPT
    off = timed.deviation
    assert np.hypot(off.position, 0.2 * off.rotation) <= given.get("tolerance", 1e-4 if given else 0.0)
    curve, _ = curve_through(
        arm, path._straight(np.arange(len(path))), path.s, path.q, path.psi, path.gc.astype(np.int64)
    )
    straight = curve.at(arm._handle, DENSE).q
    assert passed(arm, straight) > 10 * KEPT
    away = arm.forward(np.clip(straight, arm.lower, arm.upper))[0] - path.at(DENSE).pose
    assert np.linalg.norm(away[:, :3, 3], axis=1).max() > 1e-5
    if "jerk" in given:
        for name in ("kuka_iiwa7_r800", "openarm_v10"):
            for one in followed(ARMS[name], 4 if COUNT else 1, 17):
                assert passed(one.arm, aa.retime(one, acceleration=5.0, jerk=200.0, sample=5e-3).q) <= KEPT


def test_a_limit_that_no_arm_angle_keeps_is_named() -> None:
    """`at` and `join` of a path whose joint 4 breaks its limit between rows raise, and name it."""
    arm = ARMS["kuka_iiwa7_r800"]
    q = np.array([[turn, 0.6, 0.0, arm.lower[3] + 0.02, 0.0, 0.9, 0.0] for turn in (-0.5, 0.5)])
    path = aa.follow(arm, arm.forward(q)[0], start=q[0], max_joint_step=2.0)
    assert path.ok
    refused(aa.PathError, r"behind row 0 joint 4 passes its limit by .* deg", path.at, 0.5)
    refused(aa.PathError, "joint 4 passes its limit", aa.join, [path])
    np.testing.assert_array_equal(path.status, aa.Status.OK)


HOME = np.radians([0.0, 0.0, 0.0, -90.0, 0.0, 90.0, 0.0])
HOMES: dict[str, Any] = {
    "kuka_iiwa7_r800": ARMS["kuka_iiwa7_r800"],
    "calibrated": calibrated("kuka_iiwa7_r800", 0.5, 0.5, seed=1),
}


@pytest.mark.turns(12)
@pytest.mark.parametrize("name", HOMES)
@pytest.mark.parametrize("count", [10, 60, 300])
@pytest.mark.parametrize("shift", [(0.0, 0.2, 0.05), (-0.1, -0.2, 0.05), (0.1, 0.0, 0.1)], ids=str)
def test_joints_do_not_sweep_round_between_rows_at_home(name: str, count: int, shift: Any) -> None:
    """From θ2 = 0 `at` of a followed path moves no joint far beyond its rows, and `retime` takes
    under 5 s.
    """
    arm = HOMES[name]
    path = aa.follow(arm, rows(arm, HOME, shift, count), start=HOME)
    if not path.ok:
        pytest.skip("no path to look at")
    at = path.at(DENSE)
    row = np.clip(np.searchsorted(path.s, DENSE, side="right") - 1, 0, len(path) - 2)
    low, high = np.minimum(path.q[row], path.q[row + 1]), np.maximum(path.q[row], path.q[row + 1])
    assert np.maximum(low - at.q, at.q - high).max() <= 0.01 + np.abs(np.diff(path.q, axis=0)).max()
    assert np.abs(arm.forward(at.q, on_error="nan")[0] - at.pose).max() <= 1e-9
    timed = aa.retime(path, velocity=1.0, acceleration=4.0, sample=1e-3)
    assert timed.duration < 5.0 and np.abs(np.diff(timed.q, axis=0)).max() / 1e-3 <= 1.05


def test_a_plan_from_home_is_timed_from_its_rows() -> None:
    """A path made of a plan's rows from θ2 = 0, with gc of the other branch at row 0, is like the plan."""
    arm = HOMES["kuka_iiwa7_r800"]
    plan = aa.plan(arm, line(arm, HOME, (0.0, 0.2, 0.05)), start=HOME, samples=60)
    columns = {name: getattr(plan, name) for name in ("q", "psi", "gc", "status", "margin", "residual")}
    columns["gc"] = np.where(np.arange(len(plan)) == 0, 3, 2)
    found = aa.JointPath(arm=arm, s=plan.s, poses=plan.poses, **columns)
    assert np.abs(found.at(DENSE).q - plan.at(DENSE).q).max() < 0.05


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", HOMES)
@pytest.mark.parametrize("hinge", [1, 5])
@pytest.mark.parametrize("count", [20, 100])
def test_a_path_through_a_hinge_at_0_has_values_between_its_rows(name: str, hinge: int, count: int) -> None:
    """Rows through θ2 or θ6 = 0 have smooth joints on their poses between them; across the elbow `at`
    raises.
    """

    arm = HOMES[name]
    middle = np.array([0.3, 0.5, 0.2, -1.3, 0.4, 0.7, 0.1])
    middle[hinge] = 0.0
    q, forth = np.array([middle, middle]), np.array([0.02, 0.0, 0.03, 0.02, -0.03, 0.0, 0.01])
    forth[hinge] = 0.15
    q = middle + np.linspace(-1, 1, count)[:, None] * forth
    path = aa.JointPath.from_joints(arm, q, between="tool")
    assert set(path.gc.tolist()) == {int(path.gc[0]), int(path.gc[0]) ^ (1 if hinge == 1 else 4)}
    at = path.at(DENSE)
    straight = np.stack([np.interp(DENSE, path.s, q[:, j]) for j in range(7)], axis=1)
    assert np.abs(at.q - straight).max() <= 2e-3
    np.testing.assert_allclose(path.at(path.s).q, q, atol=1e-6)
    assert np.abs(arm.forward(at.q, on_error="nan")[0] - at.pose).max() <= 1e-9
    timed = aa.retime(path, velocity=1.0, acceleration=4.0)
    assert timed.duration < 2.0
    sides = np.array([[0, 0.4, 0, elbow, 0, 0.9, 0.0] for elbow in (-1.0, 1.0)])
    over = aa.JointPath.from_joints(arm, sides, between="tool")
    refused(aa.PathError, "the branch changes", lambda: over.at(0.5))


def test_joints_that_are_known_are_a_motion() -> None:
    """from_joints makes a path of joints, with NaN and limits in its status, and refuses bad s and status."""
    arm = HOMES["kuka_iiwa7_r800"]
    given = next(followed(arm, 1, 31))
    made = aa.JointPath.from_joints
    again = made(arm, given.q, between="tool")
    assert again.ok and np.abs(again.at(DENSE).q - given.at(DENSE).q).max() <= 1e-6
    q = given.q.copy()
    q[3], q[5, 1] = np.nan, arm.upper[1] + 0.1
    broken = made(arm, q)
    assert broken.status[3] == aa.Status.NOT_REACHED and broken.status[5] == aa.Status.LIMITS
    assert np.isnan(broken.poses[[3, 5]]).all() and not broken.ok
    said = made(arm, q, status=given.status).status  # no word of a file makes joints keep limits
    assert said[5] == aa.Status.LIMITS and (np.delete(said == given.status, 5)).all()
    refused(aa.PathError, "no row has joint values", made, arm, np.full((3, 7), np.nan))
    for wrong in (given.s[::-1], given.s[:-1], 2 * given.s):
        refused(aa.InputError, "s holds", made, arm, given.q, s=wrong)
    refused(aa.InputError, "status has shape", made, arm, given.q, status=given.status[1:])


@pytest.mark.parametrize("seed", range(3))
def test_rows_are_where_their_s_says(seed: int) -> None:
    """from_joints(s=) has its rows at these s; rows that stand count once, and a leap at one s raises."""
    arm, rng = HOMES["kuka_iiwa7_r800"], generator(seed, 32)
    s = np.concatenate([[0.0], np.sort(rng.random(28)) ** 2, [1.0]])
    way = np.array([1, 0.5, -0.3, 0.4, 0.2, -0.6, 0.8])
    q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]) + 0.15 * np.sin(2 * np.pi * s)[:, None] * way
    path = aa.JointPath.from_joints(arm, q, s=s, between="tool")
    np.testing.assert_allclose(path.at(s).q, q, atol=1e-12)
    np.testing.assert_allclose(path.at(s).pose, path.poses, atol=1e-12)
    stands = np.repeat(np.arange(30), np.where(np.arange(30) == 10, 2, 1))
    again = aa.JointPath.from_joints(arm, q[stands], s=s[stands], between="tool")
    np.testing.assert_allclose(again.at(DENSE).q, path.at(DENSE).q, atol=1e-12)
    leaps = q[stands].copy()
    leaps[11, 2] += 0.1
    with pytest.raises(aa.PathError, match=r"at row 11 joint 3 moves by 0\.1 rad, and s does not"):
        aa.JointPath.from_joints(arm, leaps, s=s[stands], between="tool").at(0.5)


@pytest.mark.turns(4)
@pytest.mark.slow
@pytest.mark.parametrize("shift", [(-0.1, -0.2, 0.05), (0.1, 0.2, 0.05), (0.0, 0.2, 0.05), (-0.05, 0.2, 0)])
def test_bounded_jerk_costs_a_plan_from_home_little_and_its_rows_are_timed_again(shift: Any) -> None:
    """`retime` with jerk of a plan from home takes at most 1.6 times as long, and its rows again as long as
    without.
    """
    arm, bounds = HOMES["kuka_iiwa7_r800"], {"velocity": 1.0, "acceleration": 4.0}
    plan = aa.plan(arm, line(arm, HOME, shift), start=HOME)
    assert plan.certified
    fast, calm = aa.retime(plan, **bounds), aa.retime(plan, **bounds, jerk=40.0, sample=0.004)
    assert calm.duration < 1.6 * fast.duration
    if shift[2] == 0:
        again = aa.retime(aa.JointPath.from_joints(arm, calm.q, s=calm.s), **bounds, tolerance=1e-4)
        assert again.duration < 1.02 * fast.duration


def test_a_locked_joint_stays() -> None:
    """`at` of a path with a locked joint keeps it to 1e-6 rad, or raises and names it."""
    rng = generator(23)
    arm = ARMS["kuka_iiwa7_r800"]
    timed = 0
    for _ in range(30 if COUNT else 15):
        q = 0.9 * rng.uniform(arm.lower, arm.upper)
        joint = rng.choice([0, 1, 2, 4, 5, 6])
        locked = limited(arm, joint, q[joint], q[joint])
        path = aa.follow(locked, rows(locked, q, 0.05 * rng.normal(size=3) / 3), start=q)
        if not path.ok or len(set(path.gc.tolist())) > 1:
            continue
        try:
            at = path.at(DENSE)
        except aa.PathError as error:
            assert f"joint {joint + 1} passes its limit" in str(error)
            continue
        timed += 1
        assert passed(locked, at.q) <= 1e-6
    assert timed >= 8


def test_paths_that_keep_their_limits_are_as_they_were() -> None:
    """A followed path that keeps limits between rows gets no further breaks."""
    arm = ARMS["kuka_iiwa7_r800"]
    q = np.array([0.1, 0.6, 0.2, -1.2, 0.3, 0.8, 0.5])
    path = aa.follow(arm, rows(arm, q, [0.05, 0.1, -0.05]), start=q)
    path.at(0.5)
    assert len(breaks(path)) == len(path)
