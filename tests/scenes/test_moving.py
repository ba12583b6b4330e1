"""Obstacles that move while the arm does: step by step, and with a proof between samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.07, forearm=0.06))
Q = np.radians([20, 45, 10, -80, 10, 60, 0])
POSE, PSI, GC = ARM.forward(Q)
ELBOW = ARM.elbow(Q)
POSES = np.tile(POSE, (60, 1, 1))
POSES[:, 1, 3] += np.linspace(0.0, 0.1, len(POSES))
S = np.linspace(0.0, 1.0, len(POSES))
WAY = 0.5
"""m that the ball moves over the path."""


def passing(s: float) -> aa.Scene:
    """The scene at s: a ball that passes where the elbow is."""
    return aa.Scene([aa.Ball(np.add(ELBOW, [0.0, 0.3 - WAY * s, 0.02]), 0.04, name="ball")], clearance=0.01)


def least(path: aa.JointPath, s: Any) -> float:
    """The least distance (m) over a motion at all of s (n,), each with the scene of that s."""
    rows = path.at(s)
    return min(
        float(ARM.clearance(ARM.inverse(pose, psi, gc, limits=False), passing(float(at))).distance)
        for at, pose, psi, gc in zip(s, rows.pose, rows.psi, rows.gc, strict=True)
    )


def test_follow_is_step_in_a_loop_with_the_scene_of_each_pose_bit_for_bit() -> None:
    """`follow` with a function or list of scenes equals `step` with each, and keeps the clearance."""
    path = aa.follow(ARM, POSES, start=Q, scene=passing)
    assert path.ok
    q = Q
    for at, pose in enumerate(POSES):
        now = aa.step(ARM.with_(scene=passing(S[at])), q, pose)
        np.testing.assert_array_equal(path.q[at], now.q)
        q = now.q
    same = aa.follow(ARM, POSES, start=Q, scene=[passing(s) for s in S])
    np.testing.assert_array_equal(path.q, same.q)
    apart = [ARM.clearance(ARM.inverse(p, a, g, limits=False), passing(s)).distance for p, a, g, s in
             zip(POSES, path.psi, path.gc, S, strict=True)]  # fmt: skip
    assert min(apart) >= 0.01 - 1e-12
    alone = aa.follow(ARM.with_(scene=passing(0.0)), POSES, start=Q)
    touched = [ARM.clearance(ARM.inverse(p, a, g, limits=False), passing(s)).distance for p, a, g, s in
               zip(POSES, alone.psi, alone.gc, S, strict=True)]  # fmt: skip
    assert min(touched) < 0.0, "the ball is in the way of who does not see it move"


def test_looking_ahead_sees_where_obstacles_will_be() -> None:
    """`follow` with lookahead keeps clear of a ball that moves along the elbow's circle; without it ends."""
    poses = np.tile(POSE, (40, 1, 1))

    def closing(s: float) -> aa.Scene:
        """The scene at s: a ball that moves along the circle of the elbow, through its present place."""
        ball = ARM.elbow(ARM.inverse(POSE, PSI + 0.9 - 1.2 * s, GC, limits=False))
        return aa.Scene([aa.Ball(ball, 0.05, name="ball")])

    blind = aa.follow(ARM, poses, start=Q, scene=closing, policy=aa.Hold(outside="stop"))
    assert not blind.ok and np.asarray(blind.status)[blind.first_failure or 0] != aa.Status.OK
    seen = aa.follow(ARM, poses, start=Q, scene=closing, policy=aa.Hold(), lookahead=20, max_joint_step=0.1)
    assert seen.ok, seen.explain()
    for s, psi, gc in zip(np.linspace(0, 1, 40), seen.psi, seen.gc, strict=True):
        assert ARM.clearance(ARM.inverse(POSE, psi, gc, limits=False), closing(s)).distance >= -1e-12


def test_a_plan_among_what_moves_is_certified_and_never_touches_between_its_rows() -> None:
    """A plan with scene= a function keeps the clearance at each s from the scene of that s."""
    path = aa.plan(ARM, POSES, start=Q, scene=passing, obstacle_speed=WAY)
    assert path.ok and path.certified, path.explain()
    assert least(path, np.linspace(0.0, 1.0, 2001)) >= 0.01
    still = aa.plan(ARM.with_(scene=passing(0.0)), POSES, start=Q)
    assert still.ok and least(still, np.linspace(0.0, 1.0, 201)) < 0.0, "else nothing is in the way"


def test_a_plan_asks_for_the_scene_of_each_part_once() -> None:
    """`plan` calls scene= once for each part of 4 mm of obstacle motion and once for each row."""
    asked: list[float] = []

    def counted(s: float) -> aa.Scene:
        """The scene at s, which is kept in `asked`."""
        asked.append(s)
        return passing(s)

    path = aa.plan(ARM, POSES, start=Q, scene=counted, obstacle_speed=WAY)
    parts = int(np.ceil(WAY / 0.004))
    assert path.ok and len(asked) == parts + len(POSES)


@pytest.mark.slow
def test_no_way_among_what_moves_is_proven_or_explained() -> None:
    """A plan among many moving obstacles is certified or has a diagnosis."""
    arm = ARM.with_(body=aa.Body.bones(upper_arm=0.06, forearm=0.05))
    rng = np.random.default_rng([5, 2])
    q = rng.uniform(arm.lower, arm.upper) * 0.7
    begin = arm.forward(q)[0]
    end, way = begin.copy(), rng.normal(size=3)
    end[:3, 3] += 0.25 * way / np.linalg.norm(way)
    drawn: list[Any] = []
    while len(drawn) < 12:
        centre = np.array([0.0, 0.0, 0.34]) + rng.normal(size=3) * 0.35
        if np.linalg.norm(centre - [0.0, 0.0, 0.34]) >= 0.2:
            shape = rng.integers(3), rng.uniform(0.001, 0.06), rng.normal(size=3) * 0.15
            turned = rng.uniform(-3, 3, 3), rng.uniform(0.0, 0.15, 3), rng.normal(size=3)
            drawn.append((centre, *shape, *turned))

    def scene(s: float) -> aa.Scene:
        """The obstacles at s."""
        shapes: list[Any] = []
        for centre, kind, radius, along, rpy, size, to in drawn:
            at = centre + (s - 0.5) * to / np.linalg.norm(to)
            shapes.append([
                aa.Ball(at, radius), aa.Capsule(at, at + along, radius / 2),
                aa.Box(aa.pose(at, rpy=rpy), size, 0.002),
            ][kind])  # fmt: skip
        return aa.Scene(shapes, clearance=0.002)

    for start in (None, q):
        found = aa.plan(arm, aa.Line(begin, end), start=start, scene=scene, obstacle_speed=1.0)
        assert found.certified or found.diagnosis is not None


def test_what_moves_and_shuts_the_way_is_named() -> None:
    """`explain` of a plan that a moving obstacle blocks names it."""

    def falling(s: float) -> aa.Scene:
        """The scene at s."""
        return aa.Scene([aa.Ball([0.0, 0.3 - 0.25 * s, 0.34], 0.08, name="post")])

    path = aa.plan(ARM, POSES, start=Q, scene=falling, obstacle_speed=0.25)
    assert not path.ok and "post" in path.explain()


def test_a_scene_that_stands_as_a_function_is_that_scene() -> None:
    """A plan with a constant function as scene equals one with that scene."""
    one = aa.plan(ARM.with_(scene=passing(0.2)), POSES, start=Q)
    other = aa.plan(ARM, POSES, start=Q, scene=lambda s: passing(0.2), obstacle_speed=0.0)
    np.testing.assert_array_equal(one.q, other.q)
    assert one.certified == other.certified


def test_a_plan_keeps_the_soft_clearance_where_the_whole_path_can() -> None:
    """A plan keeps `soft` if all of it can, else plans as without."""
    s = np.linspace(0.0, 1.0, 501)
    shape = passing(0.45).shapes
    for soft, kept in ((0.03, True), (0.6, False)):
        path = aa.plan(ARM.with_(scene=aa.Scene(shape, clearance=0.01, soft=soft)), POSES, start=None)
        assert path.ok and path.certified
        rows = path.at(s)
        apart = ARM.clearance(rows.q, aa.Scene(shape)).distance.min()
        assert apart >= 0.01 and (apart >= 0.01 + soft) == kept
    hard = aa.plan(ARM.with_(scene=aa.Scene(shape, clearance=0.01)), POSES)
    np.testing.assert_array_equal(path.q, hard.q)


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"scene": passing}, "give obstacle_speed"),
        ({"scene": passing(0.0), "obstacle_speed": 1.0}, r"with_\(scene="),
        ({"obstacle_speed": 1.0}, "no function of s"),
        ({"scene": passing, "obstacle_speed": -1.0}, "obstacle_speed"),
        ({"scene": [passing(0.0)] * len(S)}, "a list of 60, wanted a function of s"),
        ({"scene": lambda s: None, "obstacle_speed": 1.0}, r"scene\[0\]"),
        ({"scene": lambda s: aa.Scene([aa.Ball([0, 0, 2], 0.1, name=f"b{s:.2f}")]), "obstacle_speed": 1.0},
         "those of the first"),
    ],
)  # fmt: skip
def test_what_a_plan_cannot_certify_is_refused(options: dict[str, Any], why: str) -> None:
    """`plan` refuses a moving scene without obstacle_speed, of a wrong type, or with changing names."""
    with pytest.raises(aa.InputError, match=why):
        aa.plan(ARM, POSES, **options)


def test_a_follow_needs_a_scene_for_each_pose() -> None:
    """`follow` raises a SceneError for a list of another length, a function that returns no scene, and the
    name of a file.
    """
    for scene, why in (([passing(0.0)], "is 1, wanted one Scene by itself for all poses, or one for each"),
                       ([3] * 60, r"scene\[0\]"),
                       (lambda s: 3, r"scene\[0\]"), ("cell", r"load_scene\(")):  # fmt: skip
        with pytest.raises(aa.errors.SceneError, match=why):
            aa.follow(ARM, POSES, start=Q, scene=scene)  # type: ignore[arg-type]  # wrong on purpose


def test_a_motion_says_how_near_it_came_and_to_what() -> None:
    """`clearance` and `closest` of a motion are those of its rows; NaN and None without a scene."""
    path = aa.follow(ARM, POSES, start=Q, scene=passing)
    apart = [ARM.clearance(ARM.inverse(p, a, g, limits=False), passing(s)) for p, a, g, s in
             zip(POSES, path.psi, path.gc, S, strict=True)]  # fmt: skip
    np.testing.assert_array_equal(path.clearance, [near.distance for near in apart])
    at = int(np.argmin(path.clearance))
    assert path.closest == (S[at], "ball", apart[at].link)
    planned = aa.plan(ARM, POSES, start=Q, scene=passing, obstacle_speed=WAY)
    assert planned.clearance.min() >= 0.01 and planned.closest is not None and planned.closest[1] == "ball"
    still = aa.plan(ARM.with_(scene=passing(0.0)), POSES, start=Q)
    one = ARM.clearance(still.q, passing(0.0)).distance
    np.testing.assert_allclose(still.clearance, one, rtol=0, atol=1e-12)
    alone = aa.follow(ARM, POSES, start=Q)
    assert np.isnan(alone.clearance).all() and alone.closest is None
    shut = aa.follow(ARM, POSES, start=Q, scene=lambda s: passing(s) if s < 0.5 else aa.Scene(
        [aa.Ball([0.0, 0.1, 0.34], 0.08, name="post")]))  # fmt: skip
    assert not shut.ok
    np.testing.assert_array_equal(np.isnan(shut.clearance), np.isnan(shut.psi))
