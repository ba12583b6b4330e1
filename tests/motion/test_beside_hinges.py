"""Laws of steps beside θ2 = 0 and θ6 = 0: no joint sweeps round that the motion does not ask to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.calibrated import calibrated
from support.draw import generator
from support.moves import line

import armangle as aa

ARMS: dict[str, Any] = {
    name: aa.Arm.from_catalogue(name) for name in ("kuka_iiwa7_r800", "yaskawa_sia30d", "realman_rm75_b")
} | {"calibrated": calibrated("kuka_iiwa7_r800", 0.5, 0.5, seed=1)}
SWEEP, DRIFT = 2.0, 0.01
BODY = aa.Body.bones(upper_arm=0.04, forearm=0.04)
FLOOR = aa.Scene([aa.HalfSpace([0, 0, 1], -2.0)])
RULE = aa.Repulsion(K=0.1, alpha=1.0)


def starts(arm: Any, n: int, seed: int, open_: float = 0.0) -> Any:
    """Yield n random joints, joint 2 or 6 at `open_` (rad), 1, 3, 5, 7 often at 0, each with a move (m)."""
    rng = generator(seed)
    for k in range(n):
        q = np.where(rng.random(7) < 0.5, 0.0, rng.uniform(-0.6, 0.6, 7))
        q[3] = rng.uniform(0.6, 1.8) * rng.choice([-1, 1])
        q[[1, 5] if k % 2 else [5, 1]] = open_, rng.uniform(0.3, 0.9)
        yield q, rng.normal(size=3) * 0.08


def lines(arm: Any, rows: int, n: int, seed: int, open_: float = 0.0) -> Any:
    """Yield start joints and `rows` poses along a line from them."""
    for q, shift in starts(arm, n, seed, open_):
        yield q, line(arm, q, shift).pose(np.linspace(0, 1, rows))


@pytest.mark.turns(6)
@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("rows", [30, 300])
@pytest.mark.parametrize(
    ("open_", "kept"),
    [(0.0, {}), (0.0, {"scene": FLOOR}), (0.05, {"singularity_margin": 0.02})],
    ids=["alone", "scene", "margin"],
)
def test_a_followed_line_steps_hardly_farther_than_the_nearest_postures(
    name: str, rows: int, open_: float, kept: dict[str, Any]
) -> None:
    """While θ2 or θ6 is near 0, a step of `follow` is at most 2.2 times that to the nearest solution, plus
    0.01 rad.
    """
    arm = ARMS[name].with_(body=BODY)
    compared = 0
    for q, poses in lines(arm, rows, 12, 5, open_):
        path = aa.follow(arm.with_(**kept), poses, start=q)
        # while the hinge that was 0 is about 0 still
        sine = np.abs(np.sin(path.q[:, [1, 5]])).min(axis=1)
        last = int(np.argmax(np.append(sine, 1.0) > 0.15))
        if not path.ok or last < 3:
            continue
        now = q
        for i, pose in enumerate(poses[:last]):
            beside = arm.solve(pose, seed=now)
            least = np.abs(beside.q - now).max()
            if np.abs(np.sin(beside.q[[1, 5]])).min() < kept.get("singularity_margin", 0.0):
                break  # that goes through the margin
            assert np.abs(path.q[i] - now).max() <= 1.1 * SWEEP * least + DRIFT + 1e-9
            now = path.q[i]
        compared += 1
    assert compared >= 3


def test_a_policy_that_names_an_arm_angle_keeps_it() -> None:
    """`follow` with Hold from θ2 or θ6 = 0 keeps psi in over 90 % of the rows."""
    arm = ARMS["kuka_iiwa7_r800"]
    for q, poses in lines(arm, 300, 6, 8):
        path = aa.follow(arm, poses, start=q, policy=aa.Hold())
        still = np.abs(np.diff(np.unwrap(path.psi))) < 1e-9
        assert not path.ok or still[10:].mean() > 0.9


def test_a_pose_that_stands_lets_the_policy_go_on() -> None:
    """At a repeated pose `follow` ends at an arm angle that `resolve` keeps, in steps of at most 0.01 rad."""
    arm = ARMS["kuka_iiwa7_r800"]
    q = np.array([0.3, 0.05, -0.4, -1.5, 0.2, 0.9, 0.0])
    pose = arm.forward(q)[0]
    path = aa.follow(arm, np.repeat(pose[None], 4000, axis=0), start=q, policy=RULE)
    assert path.ok and np.abs(np.diff(path.q, axis=0)).max() <= DRIFT + 1e-9
    settled = aa.resolve(arm, pose, float(path.psi[-1]), int(path.gc[-1]), policy=RULE)
    assert abs(settled.psi - path.psi[-1]) < 1e-6


@pytest.mark.parametrize("asked", [{}, {"policy": aa.Hold()}, {"velocity": 1.0, "dt": 0.01}])
@pytest.mark.parametrize("scene", [None, FLOOR], ids=["alone", "scene"])
@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "yaskawa_sia30d"])
def test_a_step_to_the_pose_of_a_home_posture_moves_nothing(
    name: str, scene: aa.Scene | None, asked: dict[str, Any]
) -> None:
    """`step` to the pose of singular joints leaves them within 1e-7 rad."""
    arm = ARMS[name].with_(body=BODY, scene=scene)
    for q, _ in starts(arm, 40, 5):
        if np.abs(np.sin(q[[1, 5]])).max() > 0:
            now = aa.step(arm, q, arm.forward(q, on_error="nan")[0], **asked)
            assert now.status == aa.Status.OK and np.abs(now.q - q).max() < 1e-7


@pytest.mark.parametrize("policy", [aa.Hold(), aa.Repulsion()], ids=["hold", "repulsion"])
def test_where_an_arc_closes_no_leap_leads_to_another_branch(policy: Any) -> None:
    """`follow` ends with LIMITS though another branch is 0.1 rad away, and steps by less than 0.05 rad
    before.
    """
    arm = ARMS["realman_rm75_b"]
    start = np.array([1.75, 0.43, 1.91, 1.35, -0.04, -1.73, -1.15])
    way = line(arm, start, [0.24, -0.3, 0.01])
    path = aa.follow(arm, way.pose(np.linspace(0, 1, 4000)), start=start, policy=policy)
    reached = int(np.argmax(path.status != aa.Status.OK))
    assert 3000 < reached < 3200
    assert path.status[reached] == aa.Status.LIMITS
    assert np.abs(np.diff(path.q[:reached], axis=0)).max() < 0.05
    assert aa.plan(arm, way, start=start).certified


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "yaskawa_sia30d", "realman_rm75_b"])
def test_a_change_of_branch_keeps_the_tool_as_near_to_its_way_as_it_moves(name: str) -> None:
    """Halfway through a change of branch in `follow` the tool is off its chord by at most the chord's
    length.
    """
    whole = ARMS[name]
    changes = 0
    for q, poses in lines(whole, 400, 60, 11, 0.03):
        room = np.array([0.2, 9, 9, 9, 0.2, 9, 9])  # to the limits of joints that turn beside a hinge
        arm = whole.with_(lower=np.maximum(whole.lower, q - room), upper=np.minimum(whole.upper, q + room))
        path = aa.follow(arm, poses, start=q, policy=aa.Hold())
        rows = path.q[path.status == aa.Status.OK]
        for k in np.flatnonzero(np.diff(path.gc[: len(rows)])):
            here, middle, there = arm.forward(np.stack([rows[k], (rows[k] + rows[k + 1]) / 2, rows[k + 1]]))[
                0
            ]
            way = np.linalg.norm(there[:3, 3] - here[:3, 3])
            assert np.linalg.norm(middle[:3, 3] - (here[:3, 3] + there[:3, 3]) / 2) <= way + 1e-9
            changes += 1
    assert changes > 0


@pytest.mark.parametrize("rows", [991, 9901])
def test_a_policy_that_gave_way_is_caught_up_with_in_many_steps(rows: int) -> None:
    """As θ2 opens from 0 along a line, `follow` is OK with steps below 0.03 rad, however dense the rows."""
    arm = aa.Arm.from_catalogue("yaskawa_sia20d")
    start = np.array(
        [0.6186745594880452, -1e-9, -1.2360950786998193, -1.277975394339605, -2.4791962343738163,
         -0.8306789911966053, 3.058743402669175]
    )  # fmt: skip
    first = np.asarray(arm.forward(start)[0])
    last = first.copy()
    last[:3, 3] = 0.25114361926582446, -0.21158061396582242, 1.2044138098743973
    path = aa.follow(arm, aa.Line(first, last).pose(np.linspace(0, 1, rows)), start=start)
    assert path.ok
    assert np.abs(np.diff(path.q, axis=0)).max() < 0.03


@pytest.mark.parametrize("name", ARMS)
def test_a_policy_acts_where_a_hinge_is_open_and_the_pose_stands(name: str) -> None:
    """With |sin θ2| above 0.16, `step` with Repulsion to the own pose moves joints in most cases."""
    arm = ARMS[name]
    rng = generator(4)
    moved = 0
    for sine in np.linspace(0.16, 0.26, 40):
        q = rng.uniform(-0.6, 0.6, 7)
        q[[1, 3, 5]] = np.arcsin(sine), -1.2, 0.8
        found = aa.step(arm, q, arm.forward(q)[0], policy=RULE)
        moved += bool(found.status == aa.Status.OK and np.abs(found.q - q).max() > 1e-6)
    assert moved > 30
