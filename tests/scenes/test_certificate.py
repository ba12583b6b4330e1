"""The certificate of what swings, own links and the hand: it turns at the least distance there is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.draw import count, generator
from support.touching import distances, ends, from_segment, least_along, least_distance, moved

import armangle as aa

Floats = NDArray[np.float64]
BARE = aa.Arm.from_catalogue("kuka_iiwa7_r800")
SWINGING = aa.Body({
    1: [aa.Capsule([0.05, 0.1, 0.06], [0.05, -0.02, 0.06], 0.03, name="one")],
    2: [aa.Ball([0.07, 0.06, 0.1], 0.03, name="two")],
    5: [aa.Capsule([0.06, -0.1, 0.02], [0.05, -0.04, 0.03], 0.03, name="five")],
    6: [aa.Ball([0.06, 0.05, 0.05], 0.03, name="six")],
})  # fmt: skip
PAIRS = [("one", "five"), ("one", "six"), ("two", "five"), ("two", "six")]
DENSE = np.linspace(0.0, 1.0, 2001)
MISS = 20e-6  # m


def curve(rng: np.random.Generator, arm: aa.Arm) -> aa.JointPath | None:
    """A plan without a scene along a line of 0.2 m; None if it fails."""
    q = rng.uniform(BARE.lower, BARE.upper) * 0.6
    begin = arm.forward(q)[0]
    end, way = begin.copy(), rng.normal(size=3)
    end[:3, 3] += 0.2 * way / np.linalg.norm(way)
    path = aa.plan(arm, aa.Line(begin, end), samples=30)
    return path if path.ok else None


def certifies(path: aa.JointPath, arm: aa.Arm, scene: aa.Scene) -> tuple[bool, Any]:
    """Whether a plan's curve is certified in a scene, and the intervals of s that are not clear."""
    made: Any = path.curve
    arrays = made.segments, made.stretches, made.plane, made.gc, 0.0
    left, touched = arm._handle.certify_curve(*arrays, arm._needed(scene).handle)
    return len(left) == 0 and len(touched) == 0, touched


def turns_at(path: aa.JointPath, arm: aa.Arm, shapes: list[Any], ignore: Any, apart: Floats) -> None:
    """Check that the certificate holds with a clearance just below the least of `apart`, and not just
    above.
    """
    least, at = float(apart.min()), DENSE[int(apart.argmin())]
    below, above = (aa.Scene(shapes, clearance=least + off, ignore=ignore) for off in (-MISS, MISS))
    assert certifies(path, arm, below)[0], least
    proven, touched = certifies(path, arm, above)
    assert not proven
    assert not len(touched) or np.abs(np.asarray(touched)[:, 0] - at).min() < 0.2


@pytest.mark.parametrize("kind", ["ball", "capsule", "box", "hull"])
def test_what_swings_against_what_stands(kind: str) -> None:
    """A plan's certificate turns at the least distance of swinging links from an obstacle of each kind."""
    rng, done = generator(1, len(kind)), 0
    arm = BARE.with_(body=SWINGING)
    while done < count(3):
        path = curve(rng, arm)
        if path is None:
            continue
        q = path.at(DENSE).q
        beside = arm.frames(q[len(q) // 2])[rng.choice([1, 2, 5, 6]), :3, 3] + rng.normal(size=3) * 0.15
        corners = beside + rng.normal(size=(6, 3)) * 0.03
        shape = {
            "ball": aa.Ball(beside, 0.02), "capsule": aa.Capsule(beside, corners[0], 0.01),
            "box": aa.Box(aa.pose(beside), [0.05, 0.02, 0.03]), "hull": aa.Hull(corners),
        }[kind]  # fmt: skip
        scene = aa.Scene([shape], ignore=PAIRS)
        if kind == "hull":  # its distances are those of arms of a body without own pairs
            rows = path.at(DENSE)
            apart = arm.clearance(rows.q, scene).distance
        else:
            apart = least_distance(arm, q, scene)
        if apart.min() > MISS:
            turns_at(path, arm, [shape], PAIRS, apart)
            done += 1


def test_own_links_against_each_other() -> None:
    """A plan's certificate turns at the least distance of each pair of own links."""
    body = aa.Body({
        1: [aa.Capsule([0.05, 0.1, 0.06], [0.05, -0.02, 0.06], 0.03, name="one")],
        3: [aa.Capsule([0.04, -0.3, 0], [0.03, -0.05, 0.02], 0.05, name="three")],
        5: [aa.Capsule([0.06, -0.1, 0.02], [0.05, -0.04, 0.03], 0.03, name="five")],
        6: [aa.Ball([0.06, 0.05, 0.05], 0.03, name="six")],
    })  # fmt: skip
    arm, rng, seen = BARE.with_(body=body), generator(2), set()
    for _ in range(count(4)):
        path = curve(rng, arm)
        if path is None:
            continue
        apart, names = distances(arm, path.at(DENSE).q, aa.Scene())
        for k, name in enumerate(names):
            others = [pair for pair in names if pair != name]
            if apart[:, k].min() > MISS:
                turns_at(path, arm, [], others, apart[:, k])
                seen.add(name)
    assert len(seen) == 5, seen


def test_the_hand_against_what_stands_and_against_the_upper_arm() -> None:
    """A plan's certificate turns at the least distance of the gripper from obstacle and upper arm."""
    rod = aa.Capsule([0.02, 0, 0.05], [-0.3, 0.05, 0.1], 0.02, name="rod")
    upper = aa.Body({3: [aa.Capsule([0.02, -0.35, 0], [0, -0.05, 0], 0.06, name="upper")]})
    arm, rng, done = BARE.with_(body=upper).with_(hand=[rod]), generator(3), 0
    while done < count(4):
        path = curve(rng, arm)
        if path is None:
            continue
        rows = path.at(DENSE)
        frames = arm.frames(rows.q)
        held = tuple(moved(rows.pose, p) for p in ends(rod))
        mine = tuple(moved(frames[:, 3], p) for p in ends(upper.links[0][1][0]))
        apart = least_along(from_segment, np.inf, *held, *mine) - 0.08
        lamp = aa.Ball(rows.pose[1000, :3, 3] + rng.normal(size=3) * 0.2, 0.03)
        for one in (*held, *mine):
            assert one.shape == (len(DENSE), 3)
        at = np.broadcast_to(lamp.center, held[0].shape)
        for rod_ends, radius in ((held, 0.02), (mine, 0.06)):
            apart = np.minimum(apart, least_along(from_segment, np.inf, at, at, *rod_ends) - radius - 0.03)
        if apart.min() > MISS:
            turns_at(path, arm, [lamp], (), apart)
            done += 1
