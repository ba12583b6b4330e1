"""Distances the plain way: of each link of a posture, from `Arm.frames`, by searching along its segment."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import armangle as aa

Floats = NDArray[np.float64]
Told = tuple[Floats, list[tuple[str, str]]]
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


def from_core(points: Floats, shape: Any) -> Floats:
    """Distances of points (..., 3) from a shape's core: point, segment, box (0 inside), half-space (negative
    inside).
    """
    if isinstance(shape, aa.Ball):
        return np.linalg.norm(points - shape.center, axis=-1)
    if isinstance(shape, aa.HalfSpace):
        return points @ np.array(shape.normal) - shape.offset
    if isinstance(shape, aa.Box):
        frame = np.array(shape.pose)
        inside = np.abs((points - frame[:3, 3]) @ frame[:3, :3])
        return np.linalg.norm(np.maximum(inside - np.array(shape.size) / 2, 0.0), axis=-1)
    begin, along = np.array(shape.begin), np.array(shape.end) - shape.begin
    square = max(float(along @ along), 1e-300)
    share = np.clip(((points - begin) @ along) / square, 0.0, 1.0)
    return np.linalg.norm(points - begin - share[..., None] * along, axis=-1)


def least_along(core: Any, far: float | Floats, begin: Floats, end: Floats, *others: Floats) -> Floats:
    """The least value of the convex function core(points, *others), of slope at most 1, on each segment (...,
    3).

    If the value in the middle less half the length reaches `far`, that lower bound.
    """

    out = np.array(core((begin + end) / 2, *others) - np.linalg.norm(end - begin, axis=-1) / 2)
    near = out < far
    start, along, rest = begin[near], (end - begin)[near], [other[near] for other in others]
    low, high = np.zeros(start.shape[:-1]), np.ones(start.shape[:-1])

    def at(share: Floats) -> Floats:
        """The function at shares of the segments."""
        distance: Floats = core(start + share[..., None] * along, *rest)
        return distance

    for _ in range(80 if near.any() else 0):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        nearer = at(left) <= at(right)
        low, high = np.where(nearer, low, left), np.where(nearer, right, high)
    out[near] = np.minimum(np.minimum(at(np.zeros_like(low)), at(np.ones_like(low))), at((low + high) / 2))
    return out


def segment_distance(begin: Floats, end: Floats, shape: Any, far: float | Floats = np.inf) -> Floats:
    """Distances of segments (..., 3) from a shape's surface, negative within its radius; beyond `far` lower
    bounds.
    """
    radius = getattr(shape, "radius", 0.0)
    return least_along(lambda points: from_core(points, shape), far + radius, begin, end) - radius


def ends(shape: aa.Ball | aa.Capsule) -> tuple[Floats, Floats]:
    """The end points of the core of a ball or capsule."""
    if isinstance(shape, aa.Ball):
        return np.array(shape.center), np.array(shape.center)
    return np.array(shape.begin), np.array(shape.end)


def moved(frame: Floats, point: Floats) -> Floats:
    """A point given in frames (..., 4, 4), in the base."""
    return frame[..., :3, :3] @ point + frame[..., :3, 3]


def distances(
    arm: aa.Arm, q: Floats, scene: aa.Scene, far: float | Floats = np.inf, gone: float | Floats = 0.0
) -> Told:
    """Distances (..., pairs) between links and obstacles and between links, and the names of the pairs.

    At joints (..., 7), with the obstacles moved by `gone` (..., 3), m. Links side by side, and pairs that
    the scene lets touch, are left out. Of those that are farther than `far`, m, a lower bound beyond it is
    enough.
    """
    frames = arm.frames(q)
    assert arm.body is not None
    rods = arm.body._shapes(arm.geometry)
    places = [tuple(moved(frames[..., link, :, :], p) for p in ends(rod)) for link, rod in rods]
    columns, names = [], []
    for (link, rod), (begin, end) in zip(rods, places, strict=True):
        for obstacle, shape in zip(scene.names, scene.shapes, strict=True):
            columns.append(segment_distance(begin - gone, end - gone, shape, far + rod.radius) - rod.radius)
            names.append((obstacle, rod.name or f"link_{link}"))
    for i, (link, rod) in enumerate(rods):
        for k, (other, shape) in enumerate(rods[:i]):
            pair = (shape.name or f"link_{other}", rod.name or f"link_{link}")
            if abs(link - other) > 1 and not {pair, pair[::-1]} & set(scene.ignore):
                radii = rod.radius + shape.radius
                columns.append(least_along(from_segment, far + radii, *places[i], *places[k]) - radii)
                names.append(pair)
    return np.stack(columns, axis=-1), names


def least_distance(arm: aa.Arm, q: Floats, scene: aa.Scene) -> Floats:
    """The least of the distances at joints (..., 7): of pairs that may have it alone these are computed."""
    assert arm.body is not None
    longest = max(np.linalg.norm(np.subtract(*ends(rod))) for _, rod in arm.body._shapes(arm.geometry))
    beyond = distances(arm, q, scene, -np.inf)[0].min(axis=-1)  # less by at most half the rod of that pair
    return np.asarray(distances(arm, q, scene, beyond + longest / 2)[0].min(axis=-1))


def from_segment(points: Floats, begin: Floats, end: Floats) -> Floats:
    """Distances of points (..., 3) from segments."""
    along = end - begin
    square = np.maximum((along * along).sum(-1), 1e-300)
    foot = np.clip(((points - begin) * along).sum(-1) / square, 0.0, 1.0)
    return np.linalg.norm(points - begin - foot[..., None] * along, axis=-1)
