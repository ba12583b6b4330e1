"""Balls and capsules that provably contain a solid.

A rod is convex: it contains a box, a cylinder or a triangle if it contains the corners (rims). A closed mesh
is cut by planes across at most two directions u and v. A point of the solid in one of the cells lies on a
line along u x v, which stays in the cell and leaves the solid through its surface on both sides. So a rod
that contains the surface in the cell contains all of the solid there, hollow or not.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats

_ROUNDING = 1e-9  # by which a radius is enlarged, at least as many metres
_STEPS = 60  # steps towards the centre of a smallest ball
_SHARES = (0.3, 0.4, 0.5, 0.6, 0.7)  # of a cell, where it may be cut
_WORTH = 0.97  # a cut must leave less than this share of the volume
_WIDER = (1.0, 1.05, 1.15, 1.3)  # factors of the least radius for a direction that are tried


class Rod(NamedTuple):
    """A capsule, or a ball if both ends coincide; m."""

    begin: Floats
    end: Floats
    radius: float

    @property
    def length(self) -> float:
        """Distance of its ends, m."""
        return float(np.linalg.norm(self.end - self.begin))

    @property
    def volume(self) -> float:
        """Volume in cubic metres."""
        return float(np.pi * self.radius**2 * (self.length + 4.0 / 3.0 * self.radius))

    def distances(self, points: Floats) -> Floats:
        """Return the distances (N,) of points (N, 3) to the segment between its ends, m."""
        along = self.end - self.begin
        square = max(float(along @ along), 1e-300)
        share = np.clip((points - self.begin) @ along / square, 0.0, 1.0)
        return np.asarray(np.linalg.norm(points - self.begin - share[:, None] * along, axis=1))

    def excess(self, points: Floats) -> float:
        """Return how far (m) the farthest of points (N, 3) is outside; 0 or less if all are inside."""
        return float(self.distances(points).max() - self.radius)


def around(points: Floats) -> Rod:
    """Return a small rod that contains points (N, 3): the best of some along their principal axes."""
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2] if len(points) > 2 else np.eye(3)
    centre = _middle(points)
    rods = [_holding(points, centre, centre)]
    for axis in axes:
        along = points @ axis
        across = points - along[:, None] * axis
        foot = _middle(across)
        foot -= axis * (foot @ axis)
        off = np.linalg.norm(across - foot, axis=1)
        for wider in _WIDER:
            cap = np.sqrt(np.maximum((wider * off.max()) ** 2 - off**2, 0.0))
            begin, end = float((along + cap).min()), float((along - cap).max())
            if begin > end:
                begin = end = (begin + end) / 2
            rods.append(_holding(points, foot + begin * axis, foot + end * axis))
    return min(rods, key=lambda rod: rod.volume)


def _holding(points: Floats, begin: Floats, end: Floats) -> Rod:
    """Return the thinnest rod about a segment that contains points (N, 3), thicker by rounding."""
    radius = Rod(begin, end, 0.0).excess(points)
    return Rod(begin, end, radius * (1.0 + _ROUNDING) + _ROUNDING)


def _middle(points: Floats) -> Floats:
    """Return nearly the centre (3,) of the smallest ball that contains points (N, 3).

    Source: Badoiu and Clarkson, Smaller core-sets for balls (2003).
    """
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    for step in range(1, _STEPS):
        farthest = points[((points - centre) ** 2).sum(axis=1).argmax()]
        centre = centre + (farthest - centre) / (step + 1) ** 1.5
    return np.asarray(centre, dtype=np.float64)


def cover_cylinder(radius: float, length: float, most: int) -> list[Rod]:
    """Return at most `most` rods that contain a cylinder about the z axis, centred at the origin; lengths in
    m.
    """
    best: list[Rod] = []
    for pieces in range(1, most + 1):
        half = length / pieces / 2
        rods = [_rims(radius, half, -length / 2 + (2 * k + 1) * half) for k in range(pieces)]
        if not best or sum(r.volume for r in rods) < _WORTH * sum(r.volume for r in best):
            best = rods
    return best


def _rims(radius: float, half: float, height: float) -> Rod:
    """Return nearly the smallest rod on the z axis that contains a cylinder of length 2 `half` with its
    middle at z = `height`, m.
    """
    rods = []
    for back in np.linspace(0.0, half, 30):
        end = np.array([0.0, 0.0, half - back])
        reach = float(np.hypot(radius, back)) * (1.0 + _ROUNDING)
        rods.append(Rod(np.array([0.0, 0.0, height]) - end, np.array([0.0, 0.0, height]) + end, reach))
    return min(rods, key=lambda rod: rod.volume)


def cover_box(size: Floats, most: int) -> list[Rod]:
    """Return at most `most` rods that contain a box about the origin with edge lengths (3,), m."""
    return cover_mesh(*box_mesh(size), most)


def box_mesh(size: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Return corners (8, 3) and triangles (12, 3) of a box about the origin with edge lengths (3,), m."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.asarray(size) / 2
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))]
    return corners, np.array(faces, dtype=np.int64)


def cover_mesh(vertices: Floats, faces: NDArray[np.int64], most: int) -> list[Rod]:
    """Return at most `most` rods that together contain a closed mesh and its interior.

    `vertices` (V, 3), m; `faces` (F, 3), closed: see `open_edges`.
    """
    triangles = vertices[faces]
    corners = triangles.reshape(-1, 3)
    directions = np.linalg.svd(corners - corners.mean(axis=0), full_matrices=False)[2][:2]
    cells = [(triangles, around(corners))]
    done: list[Rod] = []
    while cells and len(cells) + len(done) < most:
        at = max(range(len(cells)), key=lambda k: cells[k][1].volume)
        triangles, rod = cells.pop(at)
        best = min(_cuts(triangles, directions), key=_volume, default=None)
        if best is None or _volume(best) > _WORTH * rod.volume:
            done.append(rod)
        else:
            cells += best
    return done + [rod for _, rod in cells]


Cell = tuple[Floats, Rod]


def _volume(cells: tuple[Cell, Cell]) -> float:
    """Return the volume of the rods of two cells, m³."""
    return cells[0][1].volume + cells[1][1].volume


def _cuts(triangles: Floats, directions: Floats) -> Iterator[tuple[Cell, Cell]]:
    """Yield ways to cut a cell's triangles in two, each half with the rod that contains it."""
    for normal in directions:
        height = triangles @ normal
        low, high = float(height.min()), float(height.max())
        for share in _SHARES:
            halves = cut(triangles, normal, low + share * (high - low))
            if min(map(len, halves)):
                below, above = ((half, around(half.reshape(-1, 3))) for half in halves)
                yield below, above


def cut(triangles: Floats, normal: Floats, height: float) -> tuple[Floats, Floats]:
    """Return the parts of triangles (N, 3, 3) below and above the plane normal · x = height."""
    over = triangles @ normal - height
    sides = over > 0
    count = sides.sum(axis=1)
    below, above = [triangles[count == 0]], [triangles[count == 3]]
    for lone, alone, others in ((1, above, below), (2, below, above)):
        across = count == lone
        corner = (sides if lone == 1 else ~sides)[across].argmax(axis=1)
        turn = (corner[:, None] + np.arange(3)) % 3
        rows = np.arange(len(turn))[:, None]
        points, away = triangles[across][rows, turn], over[across][rows, turn]
        share = away[:, :1] / (away[:, :1] - away[:, 1:])
        at = points[:, :1] + share[..., None] * (points[:, 1:] - points[:, :1])
        alone.append(np.stack([points[:, 0], at[:, 0], at[:, 1]], axis=1))
        others.append(np.stack([at[:, 0], points[:, 1], points[:, 2]], axis=1))
        others.append(np.stack([at[:, 0], points[:, 2], at[:, 1]], axis=1))
    return np.concatenate(below), np.concatenate(above)


def merged(vertices: Floats, faces: NDArray[np.int64]) -> tuple[Floats, NDArray[np.int64]]:
    """Return a mesh with equal corners merged, and without triangles that have two equal corners."""
    unique, index = np.unique(vertices, axis=0, return_inverse=True)
    triangles = index.ravel()[faces]
    a, b, c = triangles.T
    return unique, triangles[(a != b) & (b != c) & (c != a)]


def open_edges(faces: NDArray[np.int64]) -> int:
    """Return the number of edges that are not used equally often in both directions: 0 for a closed mesh."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward = edges[:, 0] < edges[:, 1]
    pairs, index = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    balance = np.bincount(index.ravel(), np.where(forward, 1.0, -1.0), len(pairs))
    return int((balance != 0).sum())
