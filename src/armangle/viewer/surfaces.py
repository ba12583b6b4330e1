"""Surfaces of shapes: of obstacles, and of an arm's collision model."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arrays import Floats
from ..scenes.shapes import Ball, Box, Capsule, Cloud, Field, HalfSpace, Hull, Shape

_SEGMENTS, _RINGS = 32, 16
MOST_POINTS = 100_000
"""Largest number of points of a cloud that are drawn."""
_PLATE = 1.5  # edge of a half-space's plate, in units of the reach
_SMALLEST = 0.004  # m: smallest size of points


def surface(shape: Shape, size: float) -> tuple[Floats, Any]:
    """Return vertices (V, 3), m, and faces (F, 3) of a shape with a surface.

    A half-space is a plate of its plane, in proportion to `size`, the reach of the arm, m.
    """
    match shape:
        case HalfSpace():
            return _plate(shape, size)
        case Box():
            frame: Floats = np.array(shape.pose)
            corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T * shape.size
            vertices, faces = _rounded(corners, shape.radius)
            return vertices @ frame[:3, :3].T + frame[:3, 3], faces
        case Ball():
            return _rounded(np.array([shape.center]), shape.radius)
        case Capsule():
            return _rounded(np.array([shape.begin, shape.end]), shape.radius)
        case Hull():
            return _rounded(shape.points, shape.radius)
    raise TypeError(f"{type(shape).__name__} has points and no surface")


def lowest(shape: Shape) -> float:
    """Return the lowest z of a drawn shape, m; of a half-space its offset if it is a floor, else infinity.

    A cloud or field counts by its drawn points, without radius; infinity if it draws none.
    """
    if isinstance(shape, HalfSpace):
        return shape.offset if shape.normal[2] == 1.0 else np.inf
    drawn = points_of(shape)[0] if isinstance(shape, Cloud | Field) else surface(shape, 1.0)[0]
    return float(drawn[:, 2].min(initial=np.inf))


def points_of(shape: Cloud | Field) -> tuple[Floats, float]:
    """Return points (N, 3) for drawing a cloud or a field, m, and their size.

    At most `MOST_POINTS`, evenly chosen: of a cloud, or of a field's nodes within a spacing of the obstacle.
    """
    if isinstance(shape, Cloud):
        every = -(-len(shape.points) // MOST_POINTS)
        return shape.points[::every], max(2.0 * shape.radius, _SMALLEST)
    at = np.argwhere(shape.distance <= shape.spacing)
    every = max(-(-len(at) // MOST_POINTS), 1)
    points: Floats = at[::every] * shape.spacing + np.array(shape.origin)
    return points, max(0.5 * shape.spacing, _SMALLEST)


def _rounded(corners: Floats, radius: float) -> tuple[Floats, Any]:
    """Return the surface of a rounded convex hull: in each direction its farthest corner, plus the radius."""
    height = np.linspace(-np.pi / 2, np.pi / 2, _RINGS)[:, None]
    turn = (np.arange(_SEGMENTS) + 0.5) * (2 * np.pi / _SEGMENTS)
    width = np.cos(height)
    width[[0, -1]] = 0.0  # a pole is one point at the centre of a fan of faces, not a ring of corners
    way = np.stack(
        np.broadcast_arrays(width * np.cos(turn), width * np.sin(turn), np.sin(height)), axis=-1
    ).reshape(-1, 3)
    vertices = corners[np.argmax(way @ corners.T, axis=1)] + radius * way
    row = np.arange(_RINGS - 1)[:, None] * _SEGMENTS
    here, after = np.arange(_SEGMENTS), (np.arange(_SEGMENTS) + 1) % _SEGMENTS
    a, b, c, d = (
        corner.ravel()
        for corner in (row + here, row + after, row + _SEGMENTS + here, row + _SEGMENTS + after)
    )
    return vertices, np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])


def _plate(plane: HalfSpace, size: float) -> tuple[Floats, Any]:
    """Return vertices and faces of a square of the plane of a half-space, with edges in proportion to `size`
    (m).
    """
    normal = np.array(plane.normal)
    side = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    side *= _PLATE * size / np.linalg.norm(side)
    other = np.cross(normal, side)
    foot = plane.offset * normal
    return foot + np.array([side + other, other - side, -side - other, side - other]), np.array(
        [[0, 1, 2], [0, 2, 3]]
    )
