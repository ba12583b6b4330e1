"""The policy Towards: to the wished arm angle, or elbow, as near as the arcs allow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.laws import circle_gap
from support.moves import refused
from support.strategies import TURN, Array, arms, postures, unlimited

import armangle as aa
from armangle import Status

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
START = np.array([0.3, 0.6, -0.2, 1.3, 0.4, 0.9, 0.1])
POSE, PSI, GC = IIWA.forward(START)


def own_arc(arcs: aa.ArcSet, psi: float) -> tuple[float, float]:
    """The arc of one set that psi is on, moved by whole turns so that it holds psi itself."""
    if arcs.is_full:
        return psi - np.pi, psi + np.pi
    low, high = min(arcs, key=lambda arc: max((psi - arc[0]) % TURN - (arc[1] - arc[0]), 0.0))
    low = psi - (psi - low + 1e-9) % TURN + 1e-9
    return low, low + (high - min(arcs, key=lambda arc: circle_gap(arc[0], low))[0])


def cases() -> list[tuple[aa.Arm, Array, Array, Array]]:
    """Arms with the (poses, psi, gc) of joints within limits, and last an arm whose circles are all full."""
    drawn = [(arm, *arm.forward(postures(arm, "uniform", 40, 1))) for arm in arms()]
    free = unlimited(IIWA)
    return [*drawn, (free, *free.forward(postures(IIWA, "uniform", 40, 1)))]


def test_the_wish_or_the_nearest_end_and_never_another_arc() -> None:
    """`resolve` with Towards(K=1) gives the wish if it is on psi's arc, else the nearest end of that arc."""
    rng = np.random.default_rng(2)
    reached = waited = 0
    for arm, pose, psi, gc in cases():
        arcs = arm.feasible(pose, gc)
        for _ in range(3):
            wish = float(rng.uniform(-9, 9))
            now = aa.resolve(arm, pose, psi, gc, policy=aa.Towards(psi=wish, K=1.0))
            assert (now.status == Status.OK).all()
            for p in np.flatnonzero(arcs.contains(psi)):
                low, high = own_arc(arcs[p], psi[p])
                if (wish - low) % TURN <= high - low:
                    reached += 1
                    assert circle_gap(now.psi[p], wish) <= 1e-14
                else:
                    waited += 1
                    end = low if circle_gap(low, wish) < circle_gap(high, wish) else high
                    assert circle_gap(now.psi[p], end) <= 1e-9
    assert min(reached, waited) >= 500


@pytest.mark.parametrize("K", [0.0, 0.25, 1.0])
def test_a_share_of_the_way_is_gone_within_the_arc(K: float) -> None:
    """`resolve` with Towards(K) goes the share K of the way to where K = 1 leads, within the arc."""
    rng = np.random.default_rng(4)
    for arm, pose, psi, gc in cases()[::3]:
        arcs = arm.feasible(pose, gc)
        wish = float(rng.uniform(-9, 9))
        ends = aa.resolve(arm, pose, psi, gc, policy=aa.Towards(psi=wish, K=1.0)).psi
        now = aa.resolve(arm, pose, psi, gc, policy=aa.Towards(psi=wish, K=K)).psi
        assert arcs.contains(now).all()
        for p in np.flatnonzero(arcs.contains(psi)):
            low, high = own_arc(arcs[p], psi[p])
            way = (ends[p] - psi[p] + np.pi) % TURN - np.pi  # or the other way round
            other = way - np.sign(way) * TURN
            if not low - 1e-9 <= psi[p] + way <= high + 1e-9:
                way = other
            assert circle_gap(now[p], psi[p] + K * way) <= 1e-9


def test_on_the_full_circle_it_goes_the_shorter_way_and_at_a_rate_by_its_law() -> None:
    """`resolve` with Towards takes the shorter way on a full circle; with rate= it decays as
    exp(-rate dt).
    """
    free = unlimited(IIWA)
    for wish in (-3.0, -1.0, 2.5, 3.1, 12.0):
        now = aa.resolve(free, POSE, 3.0, GC, policy=aa.Towards(psi=wish, K=0.5))
        assert circle_gap(now.psi, 3.0) == pytest.approx(circle_gap(wish, 3.0) / 2, abs=1e-13)
        assert circle_gap(now.psi, wish) == pytest.approx(circle_gap(wish, 3.0) / 2, abs=1e-13)
    psi = aa.resolve(IIWA, POSE, PSI, GC, policy=aa.Towards(psi=PSI + 0.4, rate=2.0), dt=1.0).psi
    assert circle_gap(psi, PSI + 0.4) == pytest.approx(0.4 * np.exp(-2.0), abs=1e-12)


WISHES = [{"point": [0.3, 0.8, 0.4]}, {"direction": "up"}, {"direction": [1, -1, 0.2]}]


@pytest.mark.parametrize("wish", WISHES)
def test_an_elbow_wished_somewhere_goes_there(wish: dict[str, Any]) -> None:
    """`resolve` with Towards(point or direction) equals one with the psi of `psi_towards`, or Hold if that is
    NaN.
    """
    policy = aa.Towards(**wish, K=1.0)
    for arm, pose, psi, gc in cases():
        wanted = arm.psi_towards(pose, gc, **wish, on_error="nan")
        now = aa.resolve(arm, pose, psi, gc, policy=policy)
        for p in range(0, len(psi), 4):
            same = psi[p] if np.isnan(wanted[p]) else None
            one = aa.Hold() if same is not None else aa.Towards(psi=wanted[p], K=1.0)
            assert now.psi[p] == aa.resolve(arm, pose[p], psi[p], gc[p], policy=one).psi


def test_no_arm_angle_of_the_arc_is_nearer_to_the_point() -> None:
    """`resolve` with Towards(point) gives the psi on the arc whose elbow is nearest to the point."""
    point = np.array([0.3, 0.8, 0.4])
    for arm, pose, psi, gc in cases():
        arcs = arm.feasible(pose, gc)
        now = aa.resolve(arm, pose, psi, gc, policy=aa.Towards(point=point, K=1.0)).psi
        for p in np.flatnonzero(arcs.contains(psi))[::5]:
            grid = np.append(np.linspace(*own_arc(arcs[p], psi[p]), 101), now[p])
            elbow = arm.elbow(arm.inverse(pose[p], grid, gc[p], limits=False))
            far = np.linalg.norm(elbow - point, axis=-1)
            assert far[-1] <= far.min() + 1e-9


def test_step_and_resolve_wish_alike() -> None:
    """`step` and `resolve` move psi alike under Towards."""
    for wish in ({"psi": 1.2}, {"point": [0.3, 0.8, 0.4]}, {"direction": "up"}):
        policy = aa.Towards(**wish, K=0.7)
        stepped = aa.step(IIWA, START, POSE, policy=policy, max_joint_step=np.inf)
        assert stepped.status is Status.OK
        assert circle_gap(stepped.psi, aa.resolve(IIWA, POSE, PSI, GC, policy=policy).psi) <= 1e-14


def test_following_brings_the_elbow_up_and_keeps_it_there() -> None:
    """`follow` with Towards("up") comes to the feasible psi nearest to the wish and keeps it."""
    poses = np.repeat(POSE[None], 80, axis=0)
    poses[:, :3, 3] += np.linspace(0, 1, 80)[:, None] * [0.03, -0.15, 0.05]
    path = aa.follow(IIWA, poses, start=START, policy=aa.Towards(direction="up", K=0.2))
    assert path.ok
    wanted = IIWA.psi_towards(poses, path.gc, direction="up")
    wanted = IIWA.feasible(poses, path.gc).nearest(wanted)
    assert circle_gap(path.psi, wanted)[40:].max() <= 0.02 < circle_gap(path.psi, wanted)[0]


def test_without_a_wish_the_arm_angle_stays() -> None:
    """`resolve` and `step` keep psi where a direction or point says nothing about the elbow."""
    q = np.array([0.0, 0.6, 0.0, 1.2, 0.0, 0.6, 0.0])  # the wrist over the shoulder: up is along the axis
    pose, psi, gc = IIWA.forward(q)
    assert aa.resolve(IIWA, pose, psi, gc, policy=aa.Towards(direction="up", K=1.0)) == (psi, Status.OK)
    held = aa.step(IIWA, q, pose, policy=aa.Towards(direction="up", K=1.0))
    assert held.status is Status.OK and circle_gap(held.psi, psi) <= 1e-15
    stretched = IIWA.forward(np.zeros(7))[0]
    assert aa.resolve(IIWA, stretched, 0.3, 0, policy=aa.Towards(point=[1.0, 0, 0], K=1.0)).psi == 0.3


def test_outside_every_arc_it_does_as_it_is_told() -> None:
    """Off all arcs Towards goes to the nearest end or is OUTSIDE, as `outside` says."""
    arcs = aa.ArcSet([[PSI + 0.5, PSI + 0.6]])
    for outside, status in (("nearest", Status.OK), ("stop", Status.OUTSIDE)):
        policy = aa.Towards(psi=PSI + 0.6, K=1.0, outside=outside)
        now = aa.resolve(IIWA, POSE, PSI, GC, policy=policy, allowed=arcs)
        assert now.status is status
        assert circle_gap(now.psi, PSI + (0.5 if outside == "nearest" else 0.0)) <= 1e-12


@pytest.mark.parametrize(
    ("wishes", "message"),
    [
        ({}, "no wish given, wanted one of psi, point, direction"),
        ({"psi": "up"}, "psi is 'up', wanted rad, or direction='up' for the elbow"),
        ({"psi": [0.1, 0.2, 0.3]}, r"wanted rad, or point= or direction= for the elbow"),
        ({"psi": 0.1, "direction": "up"}, "psi and direction given, wanted one"),
        ({"point": [[0.0, 0.0, 1.0]]}, r"point has shape \(1, 3\), wanted \(3,\)"),
    ],
)
def test_exactly_one_wish(wishes: dict[str, Any], message: str) -> None:
    """Towards refuses none or two wishes and bad values, and warns of degrees."""
    refused(aa.InputError, message, aa.Towards, **wishes)
    with pytest.warns(UserWarning, match=r"psi is 90, wanted rad: were these degrees\?"):
        aa.Towards(psi=90)


def test_it_is_a_value() -> None:
    """Towards compares, hashes and prints by its values."""
    policy = aa.Towards(point=np.array([0.0, 1, 2]), rate=2.0)
    assert policy == aa.Towards(point=(0.0, 1.0, 2.0), rate=2.0) and hash(policy)
    assert eval(repr(policy), {"Towards": aa.Towards}) == policy
