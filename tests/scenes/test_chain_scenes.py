"""Scenes about arms that are only nearly S-R-S: arcs, distances and motions of the true links."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.calibrated import ARMS, calibrated
from support.draw import count, generator
from support.touching import least_distance

import armangle as aa

THINNEST = 0.06
BONES = aa.Body.bones(upper_arm=0.07, forearm=THINNEST, plates=True)
ALL_LINKS = aa.Body({
    1: [aa.Capsule([0.0, 0.1, 0.0], [0.03, -0.02, 0.06], 0.03)],
    2: [aa.Ball([0.05, 0.06, 0.1], 0.04), aa.Capsule([0, 0, 0.1], [0, 0, 0.2], 0.05)],
    3: [aa.Ball([0.03, -0.1, 0.04], 0.05)],
    4: [aa.Capsule([0.02, 0.05, 0.1], [0.03, -0.06, 0.18], 0.03)],
    5: [aa.Capsule([0.06, -0.1, 0.02], [0.05, -0.04, 0.03], 0.04)],
    6: [aa.Ball([0.04, 0.05, 0.05], 0.04)],
})  # fmt: skip
BODIES = {"bones": BONES, "all links": ALL_LINKS}
BASE = aa.pose([0.4, -0.2, 0.7], rpy=[0.3, 1.2, -0.5])
CHAINS = {
    name: ARMS[name] for name in ("kuka_iiwa7_r800 0.1 mm", "barrett_wam7 1.0 mm", "openarm_v10 2.0 mm")
}
CHAINS["on another base"] = CHAINS["barrett_wam7 1.0 mm"].with_(base=BASE)


def obstacles(arm: aa.Arm, rng: np.random.Generator, how_many: int) -> list[Any]:
    """`how_many` shapes within reach of the links, ball, capsule, box and half-space in turn."""
    shoulder, out = arm.frames(np.zeros(7))[1, :3, 3], []
    for kind in range(how_many):
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        centre = shoulder + along * rng.uniform(0.2, 0.8) * arm.geometry.reach
        radius = rng.uniform(0.0, 0.08)
        match (kind + how_many) % 4:
            case 0:
                out.append(aa.Ball(centre, radius))
            case 1:
                out.append(aa.Capsule(centre, centre + rng.normal(size=3) * 0.15, radius))
            case 2:
                size = rng.uniform(0, 0.3, 3)
                out.append(aa.Box(aa.pose(centre, rpy=rng.uniform(-3, 3, 3)), size, radius))
            case _:
                out.append(aa.HalfSpace(along, float(along @ (shoulder - 0.4 * arm.geometry.reach * along))))
    return out


def questions(arm: aa.Arm, body: aa.Body, seed: int) -> Any:
    """Yield the arm with `body`, joints, their pose, psi and gc, a scene, and the generator."""
    rng = generator(seed, len(arm.name))
    arm = arm.with_(body=body)
    span = np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0)
    for k in range(count(9)):
        q = rng.uniform(*span)
        scene = aa.Scene(obstacles(arm, rng, 1 + k % 3), clearance=float(rng.choice([0.0, 0.015])))
        yield arm, q, *arm.forward(q), scene, rng


def away(arcs: aa.ArcSet, psi: Any) -> Any:
    """The distance (rad) of each angle from the nearest end of a set; 9 if it has none."""
    ends = arcs.intervals.ravel() if arcs.ends else np.empty(0)
    return np.array([np.min(np.abs(np.angle(np.exp(1j * (ends - x)))), initial=9.0) for x in psi])


def test_without_deviation_the_arcs_are_those_of_the_exact_arm() -> None:
    """In a scene a chain that deviates by nothing has the arcs and distances of the plain arm."""
    exact = aa.Arm.from_catalogue("barrett_wam7")
    same = calibrated("barrett_wam7", 0.0, 0.0)
    for body in BODIES.values():
        for arm, _, pose, psi, gc, scene, _ in questions(same, body, 2):
            plain = exact.with_(body=body)
            for found, wanted in (
                (arm._clear(pose, gc, scene), plain._clear(pose, gc, scene)),
                (arm.with_(scene=scene).feasible(pose, gc), plain.with_(scene=scene).feasible(pose, gc)),
            ):
                assert _apart(found, wanted) <= found.unproven + 1e-5
            near, there = (
                arm.clearance(arm.inverse(pose, psi, gc, limits=False), scene),
                plain.clearance(plain.inverse(pose, psi, gc, limits=False), scene),
            )
            assert abs(near.distance - there.distance) < 1e-9
            assert {near.obstacle, near.link} == {there.obstacle, there.link}


def _apart(one: aa.ArcSet, other: aa.ArcSet) -> float:
    """The length (rad) in which two sets of arcs differ."""
    return float((one & ~other).measure + (other & ~one).measure)


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800 1.0 mm", "openarm_v10 2.0 mm"])
def test_a_certified_plan_touches_nothing_between_its_rows(name: str) -> None:
    """A certified plan of a calibrated arm keeps the clearance by plain distances, between rows too."""
    certified = 0
    for made, q, pose, _, _, scene, rng in questions(ARMS[name], BONES, 6):
        found = made.with_(scene=scene).solve(pose, seed=q)
        if not found.ok:
            continue
        ahead = aa.pose(0.05 * rng.normal(size=3)) @ pose
        path = aa.plan(made.with_(scene=scene), aa.Line(pose, ahead))
        if not path.ok:
            continue
        s = np.linspace(0.0, 1.0, 1001)
        apart = least_distance(made, path.at(s).q, scene)
        if path.certified:
            certified += 1
            assert (apart >= scene.clearance - 1e-9).all()
        else:
            assert len(path.uncertified)
    assert certified >= 1


def test_no_plan_leads_past_an_obstacle_that_is_too_near_to_the_true_link_0() -> None:
    """An obstacle that has the clearance from link 0 of the nominal arm but not from the true one blocks."""
    made, base = ARMS["kuka_iiwa7_r800 2.0 mm"], {0: [aa.Capsule([0, 0, 0], [0, 0, 0.1], 0.08)]}
    arm, rng, seen = made.with_(body=aa.Body({**base, 4: [aa.Ball([0, 0, 0], 0.05)]})), generator(7), 0
    only_base = made.with_(body=aa.Body(base)), made.deviation.nominal.with_(body=aa.Body(base))
    for _ in range(count(12)):
        x, y = rng.normal(size=2)
        ball = aa.Ball(np.array([x, y, 0.0]) * 0.2 / np.hypot(x, y) + [0, 0, 0.05], 0.05, name="ball")
        q = np.array([np.arctan2(-y, -x), 0.5, 0.1, -1.2, 0.2, 0.7, 0.3])
        true, nominal = (float(one.clearance(q, aa.Scene([ball])).distance) for one in only_base)
        pose = arm.forward(q)[0]
        scene = aa.Scene([ball], clearance=(true + nominal) / 2)
        path = aa.plan(arm.with_(scene=scene), aa.Line(pose, aa.pose([0, 0, 0.01]) @ pose))
        assert path.ok == (true > nominal)
        seen += true < nominal
        if not path.ok:
            assert {branch.status for branch in path.diagnosis.branches} <= {
                aa.Status.POSE_BLOCKED, aa.Status.UNREACHABLE, aa.Status.LIMITS,
            }  # fmt: skip
    assert seen
