"""Steps, motions and solutions that keep clear of a scene."""

from __future__ import annotations

import numpy as np
import pytest
from support.draw import count, generator
from support.touching import least_distance

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.06, forearm=0.05))
Q = np.radians([20, 45, 10, -80, 10, 60, 0])
POSE, PSI, GC = ARM.forward(Q)
LINE = np.tile(POSE, (200, 1, 1))
LINE[:, 1, 3] += np.linspace(0.0, 0.1, 200)
LAMP = aa.Scene([aa.Ball([0.28, 0.26, 0.6], 0.06, name="lamp")], clearance=0.01)


def least(q: np.ndarray, scene: aa.Scene) -> float:
    """The distance (m) of the nearest pair over joints (..., 7)."""
    return float(least_distance(ARM, q, scene).min())


def test_a_motion_goes_round_what_holding_psi_touches() -> None:
    """`follow` in a scene keeps the clearance where a constant psi collides."""
    held = ARM.inverse(LINE, PSI, GC, limits=False)
    assert least(held, LAMP) < 0.0
    path = aa.follow(ARM.with_(scene=LAMP), LINE, start=Q)
    assert path.ok and least(path.q, LAMP) >= 0.01 - 1e-9
    assert path.explain() == f"All {len(LINE)} poses are solved within all limits and collision-free."
    assert least(aa.follow(ARM, LINE, start=Q, policy=aa.Hold()).q, LAMP) < 0.0


def test_follow_is_step_in_a_loop_bit_for_bit() -> None:
    path = aa.follow(ARM.with_(scene=LAMP), LINE[:50], start=Q)
    q = Q
    for k in range(50):
        now = aa.step(ARM.with_(scene=LAMP), q, LINE[k])
        assert now.status == aa.Status.OK
        q = now.q
        assert np.array_equal(q, path.q[k])


def test_a_scene_is_what_its_arcs_are_as_allowed() -> None:
    """`step` and `resolve` in a scene equal those with `allowed` = its clear arcs."""
    for pose in LINE[::20]:
        arcs = ARM._clear(pose, GC, LAMP)
        by_scene, by_arcs = aa.step(ARM.with_(scene=LAMP), Q, pose), aa.step(ARM, Q, pose, allowed=arcs)
        assert np.array_equal(by_scene.q, by_arcs.q)
        found = aa.resolve(ARM.with_(scene=LAMP), pose, PSI, GC), aa.resolve(ARM, pose, PSI, GC, allowed=arcs)
        assert found[0] == found[1]
    both = aa.step(ARM.with_(scene=LAMP), Q, POSE, allowed=aa.ArcSet([[PSI - 0.2, PSI + 0.2]]))
    assert both.status == aa.Status.OK


def test_where_nothing_is_clear_the_status_says_so_and_nothing_moves() -> None:
    """If no psi is clear `step` and `follow` say CLEARANCE or POSE_BLOCKED, and joints stay."""
    around = aa.Scene([aa.Ball([0, 0, 0.34], 0.2, name="cage")])
    now = aa.step(ARM.with_(scene=around), Q, POSE)
    assert now.status == aa.Status.CLEARANCE and np.array_equal(now.q, Q)
    assert aa.follow(ARM.with_(scene=around), LINE[:3], start=Q).status.tolist() == [15, 11, 11]
    blocked = ARM.with_(hand=[aa.Ball([0, 0, 0], 0.1)])
    floor = aa.Scene([aa.HalfSpace([0, 0, 1], POSE[2, 3])])
    assert aa.step(blocked.with_(scene=floor), Q, POSE).status == aa.Status.POSE_BLOCKED


def test_an_obstacle_on_the_elbow_is_left_at_once_or_the_status_says_clearance() -> None:
    """`step` from a collision leaves it if one step suffices; else CLEARANCE, or OUTSIDE with "stop"."""
    elbow = ARM.elbow(Q)
    small = aa.Scene([aa.Ball(elbow + np.array([0.0, 0.0, 0.05]), 0.001)])
    large = aa.Scene([aa.Ball(elbow + np.array([0.0, 0.0, 0.05]), 0.2)])
    assert not ARM._clear(POSE, GC, small).contains(PSI)
    out = aa.step(ARM.with_(scene=small), Q, POSE, max_joint_step=0.5)
    assert out.status == aa.Status.OK and least(out.q, small) > -1e-9
    assert aa.step(ARM.with_(scene=large), Q, POSE).status == aa.Status.CLEARANCE
    stop = aa.Repulsion(outside="stop")
    assert aa.step(ARM.with_(scene=small), Q, POSE, policy=stop).status == aa.Status.OUTSIDE


def test_lookahead_goes_round_a_dead_end_made_by_obstacles() -> None:
    """`follow` with lookahead avoids a pocket of balls in which it ends without."""
    line = np.tile(POSE, (200, 1, 1))
    line[:, 1, 3] += np.linspace(0.0, 0.3, 200)
    places = [[0.2763, 0.1045, 0.4830], [0.2085, 0.2854, 0.4624], [0.3333, 0.2607, 0.4953]]
    pocket = aa.Scene([aa.Ball(p, r) for p, r in zip(places, (0.0172, 0.0497, 0.0158), strict=True)])
    near, far = (
        aa.follow(ARM.with_(scene=pocket), line, start=Q, policy=aa.Hold(), max_joint_step=0.02, lookahead=n)
        for n in (0, 150)
    )
    assert not near.ok and near.status[-1] == aa.Status.NOT_REACHED
    assert aa.Status.CLEARANCE in near.status
    assert far.ok and least(far.q, pocket) > -1e-9


@pytest.mark.slow
def test_a_solution_is_clear_and_no_clear_posture_is_nearer() -> None:
    """`solve` in a scene is clear and as near as any clear joints on a grid; `solutions` begins with it."""
    rng = generator(3)
    grid = np.linspace(-np.pi, np.pi, 721)
    for _ in range(count(4)):
        near = rng.uniform(ARM.lower, ARM.upper) * 0.7
        pose = ARM.forward(rng.uniform(ARM.lower, ARM.upper) * 0.7)[0]
        places = rng.normal(size=(4, 3)) * 0.3 + [0, 0, 0.4]
        scene = aa.Scene([aa.Ball(place, 0.06) for place in places])
        q = ARM.inverse(np.broadcast_to(pose, (721, 4, 4)), grid, seed=near, limits=False).reshape(-1, 7)
        q = q[ARM.within_limits(q)]
        q = q[least_distance(ARM, q, scene) > 0] if len(q) else q
        for metric in ("l2", "max"):
            found = ARM.with_(scene=scene).solve(pose, seed=near, metric=metric)
            if found.status != aa.Status.OK:
                assert not len(q)
                continue
            assert least(found.q, scene) > -1e-9
            cost = np.linalg.norm(q - near, axis=-1) if metric == "l2" else np.abs(q - near).max(axis=-1)
            assert found.distance <= cost.min(initial=np.inf) + 1e-9
            every = ARM.with_(scene=scene).solutions(pose, seed=near, metric=metric)
            assert every[0].distance == found.distance
            assert all(least(one.q, scene) > -1e-9 for one in every)
            assert ARM.with_(scene=scene).solve(pose, prefer="margin").margin >= found.margin - 1e-9


def test_a_seed_that_touches_is_no_solution() -> None:
    """`solve` returns a seed that is clear, and other joints for one that collides."""
    on = aa.Scene([aa.Ball(ARM.elbow(Q), 0.05)])
    assert np.array_equal(ARM.solve(POSE, seed=Q).q, Q)
    away = ARM.with_(scene=on).solve(POSE, seed=Q)
    assert away.status == aa.Status.OK and away.distance > 0.1 and least(away.q, on) > -1e-9
    free = aa.Scene([aa.Ball([2.0, 0, 0], 0.05)])
    assert np.array_equal(ARM.with_(scene=free).solve(POSE, seed=Q).q, Q)


def test_why_there_is_no_solution() -> None:
    """`solve` in a scene gives the status that says why; `explain` names the pair, and of CLEARANCE the
    missing distance.
    """
    around = aa.Scene([aa.Ball([0, 0.09, 0.34], 0.06, name="post")], clearance=0.005)
    assert ARM.with_(scene=around).solve(POSE, seed=Q).status == aa.Status.CLEARANCE
    why = ARM.with_(scene=around).explain(POSE)
    assert not why.ok
    branch = why[int(GC)]
    assert branch.status == aa.Status.CLEARANCE and branch.touching == ("post", "upper_arm")
    assert branch.short == pytest.approx(0.005 + 0.03, abs=1e-9)
    assert "within the limits upper_arm is 35 mm too near to post at every arm angle." in why.explain()
    assert why.instead is None and "nearest pose" not in why.explain()  # the pose is within the limits
    hand = ARM.with_(hand=[aa.Ball([0, 0, 0], 0.1, name="grip")])
    floor = aa.Scene([aa.HalfSpace([0, 0, 1], POSE[2, 3], name="floor")])
    assert hand.with_(scene=floor).solve(POSE, seed=Q).status == aa.Status.POSE_BLOCKED
    assert (
        "grip collides with floor at this pose at every arm angle."
        in hand.with_(scene=floor).explain(POSE).explain()
    )
    beside = ARM.with_(scene=LAMP).explain(POSE)
    assert beside.ok and "solved within all limits and collision-free." in beside.explain()
    with pytest.raises(
        aa.NoSolutionError, match="No arm angle keeps clear of the obstacles within all limits"
    ):
        ARM.with_(scene=around).solve(POSE, seed=Q).raise_for_status()


@pytest.mark.parametrize("bounded", [False, True])
def test_escape_leads_out_and_never_nearer(bounded: bool) -> None:
    """`follow` with outside="escape" never comes nearer to what it collides with, and mostly gets clear."""
    rng = generator(5)
    out = aa.Repulsion(outside="escape")
    how = {"velocity": 2.0, "dt": 0.01} if bounded else {"max_joint_step": 0.02}
    tried = escaped = 0
    for _ in range(count(30)):
        q = rng.uniform(ARM.lower, ARM.upper) * 0.6
        pose, psi, gc = ARM.forward(q)
        elbow = ARM.elbow(q) + rng.normal(size=3) * 0.04
        beside = elbow + rng.normal(size=3) * 0.1
        scene = aa.Scene([aa.Ball(elbow, 0.05, name="post"), aa.Ball(beside, 0.04)])
        arcs = ARM.with_(scene=scene).feasible(pose, gc)
        if arcs.status != aa.Status.OK or arcs.contains(psi):
            continue
        tried += 1
        assert (
            aa.step(ARM.with_(scene=scene), q, pose, **how).status == aa.Status.CLEARANCE
        )  # refuses by itself
        path = aa.follow(ARM.with_(scene=scene), np.tile(pose, (300, 1, 1)), start=q, policy=out, **how)
        done = np.isfinite(path.psi)
        inside = done & (path.status == aa.Status.CLEARANCE)
        gaps = least_distance(ARM, path.q[inside], scene)
        assert (np.diff(gaps) >= -1e-9).all() and (gaps < 0).all()
        most = 0.02 + 1e-9
        assert np.abs(np.diff(path.q[done], axis=0, prepend=q[None])).max(initial=0.0) <= most
        if (path.status == aa.Status.OK).any():
            escaped += 1
            first = int((path.status == aa.Status.OK).argmax())
            assert least(path.q[first], scene) > -1e-9 and (path.status[first:] == aa.Status.OK).all()
            assert np.abs(ARM.forward(path.q[: first + 1])[0] - pose).max() < 1e-9  # the tool stays
    assert tried >= 5 and escaped >= 0.5 * tried


def test_an_escape_is_reported_and_where_there_is_no_way_out_nothing_moves() -> None:
    """A step with outside="escape" moves with status CLEARANCE, and stays if there is no way out."""
    on = aa.Scene([aa.Ball(ARM.elbow(Q), 0.05, name="post")])
    out = aa.Hold(outside="escape")
    now = aa.step(ARM.with_(scene=on), Q, POSE, policy=out, max_joint_step=0.02)
    assert now.status == aa.Status.CLEARANCE and now.why == aa.Status.OK
    assert 0.019 < np.abs(now.q - Q).max() <= 0.02 and least(now.q, on) > least(Q, on)
    assert np.array_equal(aa.step(ARM.with_(scene=on), Q, POSE, max_joint_step=0.02).q, Q)
    cage = aa.Scene([aa.Ball([0, 0, 0.34], 0.2, name="cage")])
    held = aa.step(ARM.with_(scene=cage), Q, POSE, policy=out)
    assert held.status == held.why == aa.Status.CLEARANCE and np.array_equal(held.q, Q)
    assert aa.step(ARM, Q, POSE, policy=out).q == pytest.approx(aa.step(ARM, Q, POSE, policy=aa.Hold()).q)
