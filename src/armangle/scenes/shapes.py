"""Shapes of obstacles, links and grippers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._arrays import Floats, frozen
from .._core import SolidKind
from .._values import fill
from ..errors import SceneError
from ..poses import as_transform

LARGEST = _core.LENGTH_LIMIT  # m: a longer length is not in metres
Point = tuple[float, float, float]

THICK = 1.0  # m: a link, or a point of a cloud, with a larger radius was meant in mm
_NO_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def _numbers(shape: str, name: str, value: ArrayLike, wanted: str) -> NDArray[Any]:
    """Return an array of real numbers; raise for anything else."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiu":
            raise TypeError
    except (TypeError, ValueError):
        raise SceneError(shape, name, value, wanted) from None
    return array


def _point(shape: str, name: str, value: ArrayLike) -> Point:
    """Return three finite numbers (m); raise for anything else."""
    array = _numbers(shape, name, value, "three numbers (m)").astype(np.float64)
    if array.shape != (3,):
        raise SceneError(shape, name, value, f"three numbers (m), not shape {array.shape}")
    if not (np.abs(array) <= LARGEST).all():
        raise SceneError(shape, name, array.tolist(), f"finite numbers within ±{LARGEST:g} m")
    x, y, z = array.tolist()
    return x, y, z


def _length(shape: str, name: str, value: float, *, positive: bool = False, signed: bool = False) -> float:
    """Return a length in m, ≥ 0 (> 0 if `positive`, of any sign if `signed`); raise for anything else."""
    low = -LARGEST if signed else 0.0
    try:
        if isinstance(value, (str, bytes, bool)):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(shape, name, value, "a number (m)") from None
    if not low <= number <= LARGEST or (positive and number == 0):
        bracket = "(" if positive else "["
        raise SceneError(shape, name, number, f"a length in {bracket}{low:g}, {LARGEST:g}] m")
    return number


def _thin(shape: str, name: str, radius: float) -> None:
    """Raise for a radius (m) so large that it was probably meant in mm."""
    if radius > THICK:
        raise SceneError(shape, name, radius, "a radius in m: was this in mm?")


def _named(shape: str, name: str | None) -> str | None:
    """Return the name of a shape; raise unless it is text or None."""
    if name is not None and (not isinstance(name, str) or not name.strip()):
        raise SceneError(shape, "name", name, "a word, or None")
    return name


@dataclass(frozen=True)
class Ball:
    """A ball.

    Parameters
    ----------
    center : array_like, shape (3,)
        m, in the frame of the shape's owner: for a scene, the frame that poses are given in.
    radius : float
        m, >= 0; for a link > 0.
    name : str, optional
        Name of its obstacle, or its link, in results.

    Raises
    ------
    SceneError

    Examples
    --------
    >>> from armangle import Ball
    >>> Ball([0.4, 0, 0.5], 0.1, name="lamp")
    Ball(center=(0.4, 0.0, 0.5), radius=0.1, name='lamp')
    """

    center: Point
    radius: float
    name: str | None = None

    def __init__(self, center: ArrayLike, radius: float, *, name: str | None = None) -> None:
        """Check the numbers."""
        fill(self, center=_point("Ball", "center", center), radius=_length("Ball", "radius", radius))
        fill(self, name=_named("Ball", name))

    def _row(self) -> list[float]:
        """Return the shape as the core's numbers."""
        return [SolidKind.BALL.value, self.radius, *self.center, *self.center, *_NO_AXES]

    def _thickness(self) -> float:
        """Return the smallest extent, m."""
        return 2 * self.radius


@dataclass(frozen=True)
class Capsule:
    """All points within a radius of a segment: a rod with round ends.

    Parameters
    ----------
    begin, end : array_like, shape (3,)
        The segment, m.
    radius : float
        m, >= 0; for a link > 0.
    name : str, optional

    Raises
    ------
    SceneError
    """

    begin: Point
    end: Point
    radius: float
    name: str | None = None

    def __init__(self, begin: ArrayLike, end: ArrayLike, radius: float, *, name: str | None = None) -> None:
        """Check the numbers."""
        fill(self, begin=_point("Capsule", "begin", begin), end=_point("Capsule", "end", end))
        fill(self, radius=_length("Capsule", "radius", radius), name=_named("Capsule", name))

    def _row(self) -> list[float]:
        """Return the shape as the core's numbers; a ball if both ends coincide."""
        if self.begin == self.end:
            return Ball(self.begin, self.radius)._row()
        return [SolidKind.CAPSULE.value, self.radius, *self.begin, *self.end, *_NO_AXES]

    def _thickness(self) -> float:
        """Return the smallest extent, m."""
        return 2 * self.radius


@dataclass(frozen=True)
class Box:
    """A box with edges rounded by a radius.

    Parameters
    ----------
    pose : array_like, shape (4, 4)
        Frame of the box, its origin in the middle, position in m.
    size : array_like, shape (3,)
        Full edge lengths along the axes of that frame, m, >= 0.
    radius : float
        m, >= 0: all points within this distance of the box of `size` belong to the shape.
    name : str, optional

    Raises
    ------
    SceneError, InputError

    Examples
    --------
    >>> import armangle as aa
    >>> table = aa.Box(aa.pose([0.6, 0, 0.2]), [0.8, 1.2, 0.04], name="table")
    >>> table.size
    (0.8, 1.2, 0.04)
    """

    pose: tuple[tuple[float, ...], ...]
    size: Point
    radius: float = 0.0
    name: str | None = None

    def __init__(
        self, pose: ArrayLike, size: ArrayLike, radius: float = 0.0, *, name: str | None = None
    ) -> None:
        """Check the numbers."""
        frame = as_transform("pose", pose)
        _point("Box", "pose", frame[:3, 3])
        edges = _point("Box", "size", size)
        if min(edges) < 0:
            raise SceneError("Box", "size", edges, "edges >= 0 (m)")
        fill(self, pose=tuple(map(tuple, frame.tolist())), size=edges)
        fill(self, radius=_length("Box", "radius", radius), name=_named("Box", name))

    def _row(self) -> list[float]:
        """Return the shape as the core's numbers."""
        frame: Floats = np.array(self.pose)
        half = (edge / 2 for edge in self.size)
        return [SolidKind.BOX.value, self.radius, *frame[:3, 3], *half, *frame[:3, :3].T.ravel()]

    def _thickness(self) -> float:
        """Return the smallest extent, m."""
        return min(self.size) + 2 * self.radius


@dataclass(frozen=True)
class HalfSpace:
    """All points behind a plane: a floor, a wall, a ceiling.

    Parameters
    ----------
    normal : array_like, shape (3,)
        Direction, of any length, from the plane into free space.
    offset : float
        Free space is ``normal . x >= offset`` for the normal of length 1, m.
    name : str, optional

    Raises
    ------
    SceneError

    Examples
    --------
    >>> from armangle import HalfSpace
    >>> HalfSpace([0, 0, 2], 0.1, name="floor").normal
    (0.0, 0.0, 1.0)
    """

    normal: Point
    offset: float
    name: str | None = None

    def __init__(self, normal: ArrayLike, offset: float, *, name: str | None = None) -> None:
        """Check the numbers; the normal is made of length 1."""
        vector = np.array(_point("HalfSpace", "normal", normal))
        size = float(np.linalg.norm(vector))
        if size == 0:
            raise SceneError("HalfSpace", "normal", vector.tolist(), "a direction")
        fill(self, normal=_point("HalfSpace", "normal", vector / size))
        fill(self, offset=_length("HalfSpace", "offset", offset, signed=True), name=_named("HalfSpace", name))

    def _row(self) -> list[float]:
        """Return the shape as the core's numbers."""
        return [SolidKind.HALF_SPACE.value, 0.0, *self.normal, self.offset, 0.0, 0.0, *_NO_AXES]

    def _thickness(self) -> float:
        """Return 0 as smallest extent (m): it has no size that could be in wrong units."""
        return 0.0


def _points(shape: str, points: ArrayLike) -> Floats:
    """Return points (N, 3), m, as a read-only copy; raise for anything else."""
    wanted = "points (m), an array of shape (N, 3) with N >= 1"
    array = _numbers(shape, "points", points, wanted)
    if array.ndim != 2 or array.shape[1] != 3 or not len(array):
        raise SceneError(shape, "points", array.shape, wanted)
    held = frozen(array.astype(np.float64))
    bad = ~(np.abs(held) <= LARGEST).all(axis=1)
    if bad.any():
        at = int(bad.argmax())
        raise SceneError(shape, f"points[{at}]", held[at].tolist(), f"finite numbers within ±{LARGEST:g} m")
    return held


@dataclass(frozen=True, eq=False)
class _Points:
    """Points with a radius, the base of `Cloud` and `Hull`."""

    points: Floats
    radius: float
    name: str | None

    def __init__(self, points: ArrayLike, radius: float, *, name: str | None = None) -> None:
        """Check the numbers."""
        shape = type(self).__name__
        fill(self, points=_points(shape, points), radius=_length(shape, "radius", radius))
        fill(self, name=_named(shape, name))

    def _thickness(self) -> float:
        """Return the smallest extent along an axis, m."""
        return float(np.ptp(self.points, axis=0).min()) + 2 * self.radius

    def __repr__(self) -> str:
        return (
            f"{type(self).__name__}(<{len(self.points)} points>, radius={self.radius!r}, name={self.name!r})"
        )

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        assert isinstance(other, _Points)
        same = (self.radius, self.name) == (other.radius, other.name)
        return same and np.array_equal(self.points, other.points)

    def __hash__(self) -> int:
        return hash((len(self.points), (self.points[0] + 0.0).tobytes(), self.radius, self.name))

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self), name=self.name), (self.points, self.radius)


class Cloud(_Points):
    """Many points, each a ball of the same radius, for example from a camera.

    One obstacle with one name. The points are sorted once, at the first query of a scene, so that millions of
    distant points cost little.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        m, N >= 1; a copy is kept.
    radius : float
        m, >= 0: at least half the spacing of the points, for a surface without holes.
    name : str, optional

    Raises
    ------
    SceneError
        With the first point that is not finite, or too far away to be in metres.

    See Also
    --------
    load_cloud : from NPZ, NPY, CSV, PLY and PCD files.

    Examples
    --------
    >>> import armangle as aa, numpy as np
    >>> aa.Cloud(np.random.default_rng(1).normal(size=(1000, 3)), 0.01, name="seen")
    Cloud(<1000 points>, radius=0.01, name='seen')
    """

    def __init__(self, points: ArrayLike, radius: float, *, name: str | None = None) -> None:
        """Check the numbers."""
        super().__init__(points, radius, name=name)
        _thin("Cloud", "radius", self.radius)

    def _thickness(self) -> float:
        """Return 0: a cloud may be of any size."""
        return 0.0  # its points may be anywhere

    def _row(self) -> list[float]:
        """Return the core's numbers of a cloud, whose points are given separately."""
        return [SolidKind.BALL.value, self.radius, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, *_NO_AXES]


class Hull(_Points):
    """The convex hull of points, rounded by a radius: a wedge, a pyramid, any convex mesh by its corners.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Its corners, m, N >= 1, in any order; a copy is kept. Inner points change nothing but cost time. Fewer
        than four points, or points in one plane, are a plate, a rod or a ball, solid by the radius.
    radius : float
        m, >= 0: all points within this distance of the hull belong to the shape.
    name : str, optional

    Raises
    ------
    SceneError
        Without points; or with the first point that is not finite, or too far away to be in metres.

    Examples
    --------
    >>> import armangle as aa
    >>> aa.Hull([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], name="wedge")
    Hull(<4 points>, radius=0.0, name='wedge')
    """

    def __init__(self, points: ArrayLike, radius: float = 0.0, *, name: str | None = None) -> None:
        """Check the numbers."""
        super().__init__(points, radius, name=name)

    def _middle(self) -> Floats:
        """Return the middle of the points' bounding box, m."""
        return np.asarray((self.points.min(axis=0) + self.points.max(axis=0)) / 2)

    def _corners(self) -> Floats:
        """Return the corners relative to the middle, for the core."""
        return np.unique(self.points, axis=0) - self._middle()

    def _row(self) -> list[float]:
        """Return the core's numbers of a hull, whose corners are given separately."""
        return [SolidKind.HULL.value, self.radius, *self._middle().tolist(), 0.0, 0.0, 0.0, *_NO_AXES]


@dataclass(frozen=True, eq=False)
class Field:
    """A distance field: a grid of lower bounds of the distance to the obstacle.

    Between nodes a distance can be smaller than at them by the distance to the node. This is subtracted, so
    the result is below the truth by up to about a spacing: the arm keeps the required clearance, and up to
    that much more. Arcs (`Arm.feasible`), distances (`Arm.clearance`) and ``solve(prefer="clearance")`` use
    the same surface. A distance at a permitted arm angle is at most a hundredth of a spacing below the
    scene's clearance; at a blocked one at most a quarter above; at ends of arcs they are equal. Everything
    that the field describes lies within the grid; the space outside is free. Extend the grid beyond the
    obstacle by the links' radius plus `clearance`: farther outside the field can only tell the distance to
    its border.

    Parameters
    ----------
    distance : array_like, shape (I, J, K)
        m, at ``origin + spacing * (i, j, k)``, I, J, K >= 2: a lower bound of the distance to the obstacle,
        negative or 0 inside. Distances may be cut off above. A copy is kept.
    origin : array_like, shape (3,)
        Position of the first node, m.
    spacing : float
        Distance of neighbouring nodes, m, > 0.
    name : str, optional

    Raises
    ------
    SceneError
        With the first node whose distance is not finite; or if most neighbours differ by more than their
        distance, as with distances in another unit.

    See Also
    --------
    load_field : from an NPZ file.

    Examples
    --------
    >>> import armangle as aa, numpy as np
    >>> nodes = np.stack(np.meshgrid(*[np.linspace(-0.2, 0.2, 21)] * 3, indexing="ij"), axis=-1)
    >>> aa.Field(np.linalg.norm(nodes, axis=-1) - 0.1, [0.3, -0.2, 0.4], 0.02, name="bulb")
    Field(<21 x 21 x 21 nodes>, origin=(0.3, -0.2, 0.4), spacing=0.02, name='bulb')
    """

    distance: Floats
    origin: Point
    spacing: float
    name: str | None = None

    def __init__(
        self, distance: ArrayLike, origin: ArrayLike, spacing: float, *, name: str | None = None
    ) -> None:
        """Check the numbers: most neighbouring distances must not differ by more than the spacing."""
        wanted = "distances (m), an array of shape (I, J, K), each at least 2"
        array = _numbers("Field", "distance", distance, wanted)
        if array.ndim != 3 or min(array.shape) < 2:
            raise SceneError("Field", "distance", array.shape, wanted)
        held = frozen(array.astype(np.float64))
        bad = ~(np.abs(held) <= LARGEST)
        if bad.any():
            at = tuple(int(i) for i in np.unravel_index(int(bad.argmax()), held.shape))
            raise SceneError(
                "Field", f"distance[{at}]", float(held[at]), f"a finite number within ±{LARGEST:g} m"
            )
        fill(self, distance=held, origin=_point("Field", "origin", origin))
        fill(self, spacing=_length("Field", "spacing", spacing, positive=True), name=_named("Field", name))
        _point("Field", "origin", np.add(self.origin, self.spacing * np.array(held.shape)))
        steps = np.concatenate([np.abs(np.diff(held, axis=axis)).ravel() for axis in range(3)])
        if np.count_nonzero(steps > _TOO_STEEP * self.spacing) > len(steps) / 2:
            steep = f"neighbours that differ by {float(np.median(steps)):.3g} m, {self.spacing:g} m apart"
            raise SceneError(
                "Field", "distance", steep, "distances in m, which change no faster than the place"
            )

    def __repr__(self) -> str:
        nodes = " x ".join(map(str, self.distance.shape))
        return f"Field(<{nodes} nodes>, origin={self.origin!r}, spacing={self.spacing!r}, name={self.name!r})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Field):
            return NotImplemented
        same = (self.origin, self.spacing, self.name) == (other.origin, other.spacing, other.name)
        return same and np.array_equal(self.distance, other.distance)

    def __hash__(self) -> int:
        return hash(
            (self.distance.shape, (self.distance[0] + 0.0).tobytes(), self.origin, self.spacing, self.name)
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(Field, name=self.name), (self.distance, self.origin, self.spacing)

    def _row(self) -> list[float]:
        """Return the core's numbers of a field, whose distances are given separately."""
        half = self.spacing * (np.array(self.distance.shape) - 1) / 2
        middle = (half + self.origin).tolist()
        return [SolidKind.FIELD.value, 0.0, *middle, *half.tolist(), *_NO_AXES]

    def _thickness(self) -> float:
        """Return the smallest edge of the grid, m."""
        return float(self.spacing * (min(self.distance.shape) - 1))


_TOO_STEEP = 1.001

Shape = Ball | Capsule | Box | HalfSpace | Hull | Cloud | Field
SHAPES = (Ball, Capsule, Box, HalfSpace, Hull, Cloud, Field)
RODS = (Ball, Capsule)
HOLDABLE = (Ball, Capsule, Box, Hull)
