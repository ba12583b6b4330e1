"""Shapes: of obstacles, of links, and of what the hand holds."""

from __future__ import annotations

from dataclasses import dataclass
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
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(shape, name, value, "a number (m)") from None
    if not low <= number <= LARGEST or (positive and number == 0):
        bracket = "(" if positive else "["
        raise SceneError(shape, name, number, f"a length in {bracket}{low:g}, {LARGEST:g}] m")
    return number


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
    SceneError, ShapeError, NotFiniteError, NotRotationError

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


@dataclass(frozen=True, eq=False)
class Cloud:
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

    points: Floats
    radius: float
    name: str | None = None

    def __init__(self, points: ArrayLike, radius: float, *, name: str | None = None) -> None:
        wanted = "points (m), an array of shape (N, 3) with N >= 1"
        try:
            array = np.asarray(points)
            if array.dtype.kind not in "fiu":
                raise TypeError
        except (TypeError, ValueError):
            raise SceneError("Cloud", "points", points, wanted) from None
        if array.ndim != 2 or array.shape[1] != 3 or not len(array):
            raise SceneError("Cloud", "points", array.shape, wanted)
        held = frozen(array.astype(np.float64))
        bad = ~(np.abs(held) <= LARGEST).all(axis=1)
        if bad.any():
            at = int(bad.argmax())
            raise SceneError(
                "Cloud", f"points[{at}]", held[at].tolist(), f"finite numbers within ±{LARGEST:g} m"
            )
        _set(self, points=held, radius=_length("Cloud", "radius", radius), name=_named("Cloud", name))

    def __repr__(self) -> str:
        return f"Cloud(<{len(self.points)} points>, radius={self.radius!r}, name={self.name!r})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Cloud):
            return NotImplemented
        same = (self.radius, self.name) == (other.radius, other.name)
        return same and np.array_equal(self.points, other.points)

    def __hash__(self) -> int:
        return hash((len(self.points), self.points[0].tobytes(), self.radius, self.name))

    def __reduce__(self) -> tuple[Any, ...]:
        return _cloud, (self.points, self.radius, self.name)

    def _row(self) -> list[float]:
        return [SolidKind.BALL.value, self.radius, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, *_NO_AXES]


def _cloud(points: Floats, radius: float, name: str | None) -> Cloud:
    """Return a cloud that comes back from a pickle."""
    return Cloud(points, radius, name=name)


Shape = Ball | Capsule | Box | HalfSpace | Cloud
SHAPES = (Ball, Capsule, Box, HalfSpace, Cloud)
RODS = (Ball, Capsule)
HOLDABLE = (Ball, Capsule, Box)


def _set(shape: object, **values: object) -> None:
    for name, value in values.items():
        object.__setattr__(shape, name, value)
