"""Shapes: of obstacles, of links, and of what the hand holds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import Floats, frozen
from .._core import SolidKind
from ..errors import SceneError
from ..poses import as_transform

LARGEST = _core.LENGTH_LIMIT  # m: beyond it a length is not in metres
Point = tuple[float, float, float]

THICK = 1.0  # m: a link, or a point of a cloud, with a larger radius was meant in mm
_NO_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def _point(shape: str, name: str, value: ArrayLike) -> Point:
    """Return three finite numbers, m."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiu":
            raise TypeError
    except (TypeError, ValueError):
        raise SceneError(shape, name, value, "three numbers (m)") from None
    array = array.astype(np.float64)
    if array.shape != (3,):
        raise SceneError(shape, name, value, f"three numbers (m), not shape {array.shape}")
    if not (np.abs(array) <= LARGEST).all():
        raise SceneError(shape, name, array.tolist(), f"finite numbers within ±{LARGEST:g} m")
    x, y, z = array.tolist()
    return x, y, z


def _length(shape: str, name: str, value: float, *, positive: bool = False, signed: bool = False) -> float:
    """Return a finite number >= 0 (> 0 where `positive`, any where `signed`), m."""
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
    """Refuse a radius that no link and no point of a cloud has."""
    if radius > THICK:
        raise SceneError(shape, name, radius, "a radius in m: was this in mm?")


def _named(shape: str, name: str | None) -> str | None:
    if name is not None and (not isinstance(name, str) or not name.strip()):
        raise SceneError(shape, "name", name, "a word, or None")
    return name


@dataclass(frozen=True)
class Ball:
    """A ball.

    Parameters
    ----------
    center : array_like, shape (3,)
        m, in the frame of what holds the shape: of a scene, the frame that poses are given in.
    radius : float
        m, >= 0; of a link > 0.
    name : str, optional
        Names its obstacle, or its link, in results.

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
        _set(self, center=_point("Ball", "center", center), radius=_length("Ball", "radius", radius))
        _set(self, name=_named("Ball", name))

    def _row(self) -> list[float]:
        return [SolidKind.BALL.value, self.radius, *self.center, *self.center, *_NO_AXES]

    def _thickness(self) -> float:
        """Return the least extent, m."""
        return 2 * self.radius


@dataclass(frozen=True)
class Capsule:
    """All points within a radius of a segment: a rod with round ends.

    Parameters
    ----------
    begin, end : array_like, shape (3,)
        The segment, m.
    radius : float
        m, >= 0; of a link > 0.
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
        _set(self, begin=_point("Capsule", "begin", begin), end=_point("Capsule", "end", end))
        _set(self, radius=_length("Capsule", "radius", radius), name=_named("Capsule", name))

    def _row(self) -> list[float]:
        if self.begin == self.end:
            return Ball(self.begin, self.radius)._row()
        return [SolidKind.CAPSULE.value, self.radius, *self.begin, *self.end, *_NO_AXES]

    def _thickness(self) -> float:
        return 2 * self.radius


@dataclass(frozen=True)
class Box:
    """A box, its edges rounded by a radius.

    Parameters
    ----------
    pose : array_like, shape (4, 4)
        Frame of the box, its origin in the middle, position in m.
    size : array_like, shape (3,)
        Whole edges along the axes of that frame, m, >= 0.
    radius : float
        m, >= 0: all points within it of the box of `size` belong to the shape.
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
        frame = as_transform("pose", pose)
        _point("Box", "pose", frame[:3, 3])
        edges = _point("Box", "size", size)
        if min(edges) < 0:
            raise SceneError("Box", "size", edges, "edges >= 0 (m)")
        _set(self, pose=tuple(map(tuple, frame.tolist())), size=edges)
        _set(self, radius=_length("Box", "radius", radius), name=_named("Box", name))

    def _row(self) -> list[float]:
        frame: Floats = np.array(self.pose)
        half = (edge / 2 for edge in self.size)
        return [SolidKind.BOX.value, self.radius, *frame[:3, 3], *half, *frame[:3, :3].T.ravel()]

    def _thickness(self) -> float:
        return min(self.size) + 2 * self.radius


@dataclass(frozen=True)
class HalfSpace:
    """All points behind a plane: a floor, a wall, a ceiling.

    Parameters
    ----------
    normal : array_like, shape (3,)
        Direction, of any length, from the plane into what is free.
    offset : float
        Free is where ``normal . x >= offset`` for the normal of length 1, m.
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
        vector = np.array(_point("HalfSpace", "normal", normal))
        size = float(np.linalg.norm(vector))
        if size == 0:
            raise SceneError("HalfSpace", "normal", vector.tolist(), "a direction")
        _set(self, normal=_point("HalfSpace", "normal", vector / size))
        _set(self, offset=_length("HalfSpace", "offset", offset, signed=True), name=_named("HalfSpace", name))

    def _row(self) -> list[float]:
        return [SolidKind.HALF_SPACE.value, 0.0, *self.normal, self.offset, 0.0, 0.0, *_NO_AXES]

    def _thickness(self) -> float:
        return 0.0


def _points(shape: str, points: ArrayLike) -> Floats:
    """Return points (N, 3), N >= 1, as a frozen copy."""
    wanted = "points (m), an array of shape (N, 3) with N >= 1"
    try:
        array = np.asarray(points)
        if array.dtype.kind not in "fiu":
            raise TypeError
    except (TypeError, ValueError):
        raise SceneError(shape, "points", points, wanted) from None
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
    """Points with a radius: what `Cloud` and `Hull` hold."""

    points: Floats
    radius: float
    name: str | None

    def __init__(self, points: ArrayLike, radius: float, *, name: str | None = None) -> None:
        shape = type(self).__name__
        _set(self, points=_points(shape, points), radius=_length(shape, "radius", radius))
        _set(self, name=_named(shape, name))

    def _thickness(self) -> float:
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
    """Many points, each a ball of the same radius: what a camera sees.

    One obstacle with one name. The points are sorted once, where a scene is asked first, so that millions of
    them may be far away at little cost.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        m, N >= 1; a copy is kept.
    radius : float
        m, >= 0: half the spacing of the points or more, for a surface without holes.
    name : str, optional

    Raises
    ------
    SceneError
        Naming the first point that is not finite, or too far away to be in metres.

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
        super().__init__(points, radius, name=name)
        _thin("Cloud", "radius", self.radius)

    def _thickness(self) -> float:
        return 0.0  # its points may lie anywhere

    def _row(self) -> list[float]:
        return [SolidKind.BALL.value, self.radius, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, *_NO_AXES]


class Hull(_Points):
    """The convex hull of points, rounded by a radius: a wedge, a pyramid, any convex mesh by its corners.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Its corners, m, N >= 1, in any order; a copy is kept. Points within change nothing, but each costs
        time. Fewer than four, or all in a plane, are a plate, a rod or a ball, solid by the radius.
    radius : float
        m, >= 0: all points within it of the hull belong to the shape.
    name : str, optional

    Raises
    ------
    SceneError
        Without points; or naming the first that is not finite, or too far away to be in metres.

    Examples
    --------
    >>> import armangle as aa
    >>> aa.Hull([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], name="wedge")
    Hull(<4 points>, radius=0.0, name='wedge')
    """

    def __init__(self, points: ArrayLike, radius: float = 0.0, *, name: str | None = None) -> None:
        super().__init__(points, radius, name=name)

    def _middle(self) -> Floats:
        return np.asarray((self.points.min(axis=0) + self.points.max(axis=0)) / 2)

    def _corners(self) -> Floats:
        """Return the corners as the core takes them: from the middle."""
        return np.unique(self.points, axis=0) - self._middle()

    def _row(self) -> list[float]:
        return [SolidKind.HULL.value, self.radius, *self._middle().tolist(), 0.0, 0.0, 0.0, *_NO_AXES]


@dataclass(frozen=True, eq=False)
class Field:
    """A distance field: at the nodes of a grid, how far away the obstacle is at least.

    Between nodes a distance can be smaller than at them by how far they are, and that is taken off: of the
    truth up to about a spacing. So the arm keeps off by that much more, and never by less. Arcs
    (`Arm.feasible`), distances (`Arm.clearance`) and ``solve(prefer="clearance")`` are of that one surface: a
    distance at an arm angle that is left is at most a hundredth of a spacing below the scene's clearance, at
    one that is not at most a quarter above; ends of arcs are where it is met. All that the field tells of
    lies within the grid; the space outside is free. Let the grid reach beyond the obstacle by the radius of
    the links and `clearance`: farther outside it can only tell how far its border is.

    Parameters
    ----------
    distance : array_like, shape (I, J, K)
        m, at ``origin + spacing * (i, j, k)``, I, J, K >= 2; a lower bound of the distance from there to the
        obstacle, negative or 0 in it. A distance that was cut off above will do. A copy is kept.
    origin : array_like, shape (3,)
        Place of the first node, m.
    spacing : float
        Of neighbouring nodes, m, > 0.
    name : str, optional

    Raises
    ------
    SceneError
        Naming the first node whose distance is not finite; or where most neighbours differ by more than
        they are apart, as distances in another unit do.

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
        wanted = "distances (m), an array of shape (I, J, K), each at least 2"
        try:
            array = np.asarray(distance)
            if array.dtype.kind not in "fiu":
                raise TypeError
        except (TypeError, ValueError):
            raise SceneError("Field", "distance", distance, wanted) from None
        if array.ndim != 3 or min(array.shape) < 2:
            raise SceneError("Field", "distance", array.shape, wanted)
        held = frozen(array.astype(np.float64))
        bad = ~(np.abs(held) <= LARGEST)
        if bad.any():
            at = tuple(int(i) for i in np.unravel_index(int(bad.argmax()), held.shape))
            raise SceneError(
                "Field", f"distance[{at}]", float(held[at]), f"a finite number within ±{LARGEST:g} m"
            )
        _set(self, distance=held, origin=_point("Field", "origin", origin))
        _set(self, spacing=_length("Field", "spacing", spacing, positive=True), name=_named("Field", name))
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
        half = self.spacing * (np.array(self.distance.shape) - 1) / 2
        middle = (half + self.origin).tolist()
        return [SolidKind.FIELD.value, 0.0, *middle, *half.tolist(), *_NO_AXES]

    def _thickness(self) -> float:
        return float(self.spacing * (min(self.distance.shape) - 1))


_TOO_STEEP = 1.001

Shape = Ball | Capsule | Box | HalfSpace | Hull | Cloud | Field
SHAPES = (Ball, Capsule, Box, HalfSpace, Hull, Cloud, Field)
RODS = (Ball, Capsule)
HOLDABLE = (Ball, Capsule, Box, Hull)


def _set(shape: object, **values: object) -> None:
    for name, value in values.items():
        object.__setattr__(shape, name, value)
