"""Arcs against the distances of coal: another library, other formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.draw import count, generator
from support.needs import need

import armangle as aa

BODY = aa.Body({
    1: [aa.Ball([0.03, 0.1, 0.05], 0.03)],
    2: [aa.Capsule([0.03, 0.04, 0.05], [-0.02, 0.05, 0.2], 0.04)],
    3: [aa.Capsule([0.02, -0.25, 0.01], [0.01, -0.02, -0.02], 0.05)],
    4: [aa.Capsule([0.01, 0.02, 0.05], [-0.02, 0.03, 0.2], 0.04), aa.Ball([0, 0.02, 0], 0.06)],
    5: [aa.Ball([0.04, -0.05, 0.03], 0.04)],
    6: [aa.Capsule([0.03, 0.02, 0.02], [0.04, -0.02, 0.06], 0.03)],
})  # fmt: skip
NEAR = 1e-9
"""rad beside an end, and m: nearer than that coal's own rounding decides."""


def exact_request(coal: Any) -> Any:
    """A distance request for coal with a tolerance of 1e-14 m instead of 1e-6 m."""
    request = coal.DistanceRequest()
    request.gjk_tolerance, request.gjk_max_iterations = 1e-14, 1000
    return request


def placed(coal: Any, frame: NDArray[np.float64], shape: Any) -> tuple[Any, Any]:
    """A ball, capsule or box given in `frame`, as a shape of coal with its transform."""
    if isinstance(shape, aa.Ball):
        return coal.Sphere(shape.radius), coal.Transform3s(
            np.eye(3), frame[:3, :3] @ shape.center + frame[:3, 3]
        )
    if isinstance(shape, aa.Box):
        place = frame @ np.array(shape.pose)
        return coal.Box(*shape.size), coal.Transform3s(place[:3, :3], place[:3, 3])
    begin, end = (frame[:3, :3] @ p + frame[:3, 3] for p in (shape.begin, shape.end))
    along = (end - begin) / np.linalg.norm(end - begin)
    side = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    side /= np.linalg.norm(side)
    turn = np.column_stack([side, np.cross(along, side), along])
    return coal.Capsule(shape.radius, float(np.linalg.norm(end - begin))), coal.Transform3s(
        turn, (begin + end) / 2
    )


def obstacle(rng: np.random.Generator, arm: aa.Arm, kind: int) -> Any:
    """A random ball, capsule or box (kind 0, 1, 2) within reach."""
    along = rng.normal(size=3)
    middle = arm.frames(np.zeros(7))[1, :3, 3] + along / np.linalg.norm(along) * rng.uniform(0.25, 0.8)
    if kind == 0:
        return aa.Ball(middle, rng.uniform(0.02, 0.1))
    if kind == 1:
        return aa.Capsule(middle, middle + rng.normal(size=3) * 0.15, rng.uniform(0.02, 0.06))
    return aa.Box(aa.pose(middle, rpy=rng.uniform(-3, 3, 3)), rng.uniform(0.05, 0.3, 3))


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "barrett_wam7", "yaskawa_sia5d", "openarm_v10"])
def test_no_arm_angle_is_judged_other_than_by_coal(name: str) -> None:
    """The arcs clear of a scene hold psi exactly where coal finds no contact."""
    coal = need("coal")
    arm, rng = aa.Arm.from_catalogue(name).with_(body=BODY), generator(1, len(name))
    request, asked, free = exact_request(coal), 0, 0
    ignore = [(f"link_{i}", f"link_{j}") for i in range(1, 7) for j in range(i + 1, 7)]
    for k in range(count(6)):
        scene = aa.Scene([obstacle(rng, arm, (k + j) % 3) for j in range(3)], ignore=ignore)
        pose = arm.forward(rng.uniform(np.maximum(arm.lower, -2.5), np.minimum(arm.upper, 2.5)))[0]
        arcs = arm._clear(pose, k % 8, scene)
        psi = rng.uniform(-np.pi, np.pi, 24)
        limits = arcs.intervals.ravel() if arcs.ends else np.empty(0)
        psi = np.concatenate([psi, limits + 1e-6, limits - 1e-6])
        obstacles = [placed(coal, np.eye(4), shape) for shape in scene.shapes]
        for angle, frames in zip(psi, arm.frames(arm.inverse(pose, psi, k % 8, limits=False)), strict=True):
            least = np.inf
            for link, shapes in BODY.links:
                for mine in (placed(coal, frames[link], shape) for shape in shapes):
                    for other in obstacles:
                        least = min(least, coal.distance(*mine, *other, request, coal.DistanceResult()))
                        asked += 1
            inside = bool(arcs.contains(angle))
            near = np.min(np.abs(np.angle(np.exp(1j * (limits - angle)))), initial=9.0)
            assert inside == (least > 0) or near < NEAR or abs(least) < NEAR, (name, k, angle, least)
            free += inside
    assert asked > 1000 and free > 20
