"""Distances the plain way: of each link of a posture, from `Arm.frames`, by searching along its segment."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import armangle as aa

Floats = NDArray[np.float64]
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


def from_core(points: Floats, shape: Any) -> Floats:
    """Signed distances of points (..., 3) from a shape's core (point, segment, box, half-space)."""
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


def segment_distance(begin: Floats, end: Floats, shape: Any) -> Floats:
    """Distances of segments (..., 3) from a shape's surface, negative inside: a convex function's least."""
    low, high = np.zeros(begin.shape[:-1]), np.ones(begin.shape[:-1])

    def at(share: Floats) -> Floats:
        return from_core(begin + share[..., None] * (end - begin), shape)

    for _ in range(80):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        nearer = at(left) <= at(right)
        low, high = np.where(nearer, low, left), np.where(nearer, right, high)
    least = np.minimum(np.minimum(at(np.zeros_like(low)), at(np.ones_like(low))), at((low + high) / 2))
    return least - getattr(shape, "radius", 0.0)


def ends(shape: aa.Ball | aa.Capsule) -> tuple[Floats, Floats]:
    """Both ends of a rod."""
    if isinstance(shape, aa.Ball):
        return np.array(shape.center), np.array(shape.center)
    return np.array(shape.begin), np.array(shape.end)


def moved(frame: Floats, point: Floats) -> Floats:
    """A point of frames (..., 4, 4)."""
    return frame[..., :3, :3] @ point + frame[..., :3, 3]


def distances(arm: aa.Arm, q: Floats, scene: aa.Scene) -> tuple[Floats, list[tuple[str, str]]]:
    """Distances (..., pairs) of links 1..6 from obstacles and from one another, and the pairs' names.

    At joints (..., 7). Links side by side, and pairs that the scene lets touch, are left out.
    """
    frames = arm.frames(q)
    assert arm.body is not None
    rods = arm.body._shapes(arm.d_se, arm.d_ew, arm.a_3, arm.a_4, arm.d_4)
    places = [tuple(moved(frames[..., link, :, :], p) for p in ends(rod)) for link, rod in rods]
    columns, names = [], []
    for (link, rod), (begin, end) in zip(rods, places, strict=True):
        for obstacle, shape in zip(scene.names, scene.shapes, strict=True):
            columns.append(segment_distance(begin, end, shape) - rod.radius)
            names.append((obstacle, rod.name or f"link_{link}"))
    for i, (link, rod) in enumerate(rods):
        for k, (other, shape) in enumerate(rods[:i]):
            pair = (shape.name or f"link_{other}", rod.name or f"link_{link}")
            if abs(link - other) > 1 and not {pair, pair[::-1]} & set(scene.ignore):
                columns.append(between(places[i], places[k]) - rod.radius - shape.radius)
                names.append(pair)
    return np.stack(columns, axis=-1), names


def between(one: Any, other: Any) -> Floats:
    """Distances of segments whose ends are (..., 3): of the first, the point nearest to the second."""
    begin, along = other[0], other[1] - other[0]
    square = np.maximum((along * along).sum(-1), 1e-300)
    low, high = np.zeros(begin.shape[:-1]), np.ones(begin.shape[:-1])

    def at(share: Floats) -> Floats:
        point = one[0] + share[..., None] * (one[1] - one[0])
        foot = np.clip(((point - begin) * along).sum(-1) / square, 0.0, 1.0)
        return np.linalg.norm(point - begin - foot[..., None] * along, axis=-1)

    for _ in range(80):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        nearer = at(left) <= at(right)
        low, high = np.where(nearer, low, left), np.where(nearer, right, high)
    return np.minimum(np.minimum(at(np.zeros_like(low)), at(np.ones_like(low))), at((low + high) / 2))
