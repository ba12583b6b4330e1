"""Paths of the end effector: a line, an arc, a screw, through poses, or several in sequence."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import (
    Floats,
    about_z,
    as_floats,
    as_number,
    as_whole,
    chosen,
    frozen,
    many_poses,
    one_pose,
    warn,
)
from .._values import by_content, fill
from ..errors import InputError

LineOrientation = Literal["shortest", "fixed"]
ArcOrientation = Literal["shortest", "fixed", "carried"]
_WIDE = 1.0  # m: larger than any corner of such an arm
_LARGEST_TURN = 1e3  # rad
_ORDERS = 3
SAMPLES = 200
MOST_SAMPLES = 10_000_000
RADIAN: float = _core.RADIAN
"""Metres that count as one radian in the size of a motion."""


def _vector(name: str, value: ArrayLike) -> Floats:
    """Return three finite numbers, read-only."""
    vector = np.array(as_floats(name, value, (3,)), order="C")
    if vector.ndim != 1:
        raise InputError(f"{name} has shape {vector.shape}, wanted (3,)")
    if not np.isfinite(vector).all():
        raise InputError(f"{name} is {vector.tolist()}, wanted finite numbers")
    return frozen(vector)


class Path:
    """A motion of the end effector over s in [0, 1]: the base of lines, arcs, screws and waypoints."""

    _segments: Floats

    @property
    def breaks(self) -> Floats:
        """The s where one piece ends and the next begins, including 0 and 1, shape (k,)."""
        return np.append(self._segments[:, 0], 1.0)

    def __add__(self, other: Path) -> Segments:
        """Return this path followed by another, as `Segments`."""
        if not isinstance(other, Path):
            return NotImplemented
        return Segments((self, other))

    def pose(self, s: ArrayLike) -> Floats:
        """Return the pose of the end effector.

        Parameters
        ----------
        s : array_like, shape (...)
            Path parameter in [0, 1].

        Returns
        -------
        ndarray, shape (..., 4, 4)
            Poses, positions in m.

        Raises
        ------
        InputError
            If an s is not in [0, 1].
        """
        at = checked_parameters(s)
        out = np.empty((at.size, 4, 4))
        _core.path_poses(self._segments, np.ascontiguousarray(at).reshape(-1), out)
        return out.reshape(*at.shape, 4, 4)

    def derivative(self, s: ArrayLike, order: int = 1) -> Floats:
        """Return the twist along the path, or its derivatives, with respect to s.

        Parameters
        ----------
        s : array_like, shape (...)
            Path parameter in [0, 1]; where two pieces join, the later one counts.
        order : 1, 2 or 3
            1: velocity and angular velocity per unit of s; 2 and 3: their first and second derivatives.

        Returns
        -------
        ndarray, shape (..., 6)
            First for the end effector's origin (m), then for the rotation (rad), in the frame of the poses.

        Raises
        ------
        InputError
            If an s is not in [0, 1], or the order is not 1, 2 or 3.
        """
        if order not in range(1, _ORDERS + 1):
            raise InputError(f"order is {order!r:.100}, wanted 1, 2 or 3")
        at = checked_parameters(s)
        out = np.empty((at.size, _ORDERS, 6))
        _core.path_derivatives(self._segments, np.ascontiguousarray(at).reshape(-1), out)
        return out[:, order - 1].reshape(*at.shape, 6)


class Deviation(NamedTuple):
    """Largest deviation of a path with rounded corners from the path with corners, and vice versa.

    ``position`` m and ``rotation`` rad: both hold at once, for one and the same pose of it.
    """

    position: float
    rotation: float


NO_DEVIATION = Deviation(0.0, 0.0)


@by_content
class Chain(Path):
    """Segments in the core's format: the path of a joint path, or of a rolled path."""

    def __init__(self, segments: Floats, deviation: Deviation) -> None:
        """Keep segments and how far rounded corners are off."""
        self._segments = frozen(segments)
        self.deviation = deviation


def rolled(path: Path, roll: float, rate: float) -> Path:
    """Return a path that also rotates about its own z axes, by roll + rate s (rad); a single pose by roll."""
    if isinstance(path, Waypoints) and len(path) == 1:
        return Waypoints(np.asarray(path.poses) @ about_z([roll]))
    out = np.empty_like(path._segments)
    _core.path_rolled(np.ascontiguousarray(path._segments), roll, rate, out)
    return Chain(out, deviation_of(path))


def deviation_of(path: Path | None) -> Deviation:
    """Return the largest deviation of a path's rounded corners from the given path."""
    return path.deviation if isinstance(path, (Segments, Chain)) else NO_DEVIATION


def greatest(deviations: Iterable[Deviation]) -> Deviation:
    """Return the largest position (m) and the largest rotation (rad) of several deviations."""
    return Deviation(*(max(column) for column in zip(NO_DEVIATION, *deviations, strict=True)))


def checked_parameters(s: ArrayLike) -> Floats:
    """Return path parameters as an array, each in [0, 1]."""
    at = as_floats("s", s)
    bad = ~((at >= 0) & (at <= 1))
    if bad.any():
        raise InputError(f"s holds {at[bad].flat[0]:g}, wanted numbers in [0, 1]")
    return at


@by_content
@dataclass(frozen=True, eq=False)
class Line(Path):
    """A straight line at constant speed.

    Parameters
    ----------
    start, end : array_like, shape (4, 4)
        Poses of the end effector, positions in m.
    orientation : "shortest" or "fixed"
        The frame takes the shortest rotation to that of `end`, at constant speed, or keeps that of `start`.

    Raises
    ------
    InputError
    """

    start: ArrayLike
    end: ArrayLike
    orientation: LineOrientation = "shortest"
    _segments: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        chosen("orientation", self.orientation, ("shortest", "fixed"))
        start, end = one_pose("start", self.start), one_pose("end", self.end)
        out = np.empty((1, _core.SEGMENT_WIDTH))
        _core.path_line(start, end, self.orientation == "fixed", out)
        fill(self, start=start, end=end, _segments=out)


@by_content
@dataclass(frozen=True, eq=False)
class CircularArc(Path):
    """A circular arc from one pose through a point to another, at constant speed.

    Parameters
    ----------
    start : array_like, shape (4, 4)
        Pose of the end effector at s = 0, position in m.
    via : array_like, shape (3,)
        A point of the arc between its ends, m.
    end : array_like, shape (4, 4)
        Pose at s = 1; its orientation is used for "shortest" alone.
    orientation : "shortest", "fixed" or "carried"
        The shortest rotation to that of `end`; that of `start`; or rotated along with the arc.

    Raises
    ------
    InputError
        If an argument is invalid, or the three points lie on a line.
    """

    start: ArrayLike
    via: ArrayLike
    end: ArrayLike
    orientation: ArcOrientation = "shortest"
    _segments: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        chosen("orientation", self.orientation, ("shortest", "fixed", "carried"))
        start, via, end = one_pose("start", self.start), _vector("via", self.via), one_pose("end", self.end)
        points = [np.ascontiguousarray(frame[:3, 3]) for frame in (start, end)]
        centre, axis, angle = _core.arc_through(points[0], via, points[1])
        if angle == 0 and np.array_equal(points[0], points[1]):
            raise InputError("start and end are one point, wanted two of a circle: a whole one is two arcs")
        if angle == 0:
            raise InputError("start, via and end lie on a line, wanted three points of a circle")
        out = np.empty((1, _core.SEGMENT_WIDTH))
        goal = end if self.orientation == "shortest" else None
        carried = self.orientation == "carried"
        _core.path_screw(start, np.array(centre), np.array(axis), angle, 0.0, carried, goal, out)
        fill(self, start=start, via=via, end=end, _segments=out)


@by_content
@dataclass(frozen=True, eq=False)
class Screw(Path):
    """A rotation of the end effector about a fixed axis with an advance along it, at constant speed.

    Parameters
    ----------
    start : array_like, shape (4, 4)
        Pose of the end effector at s = 0, position in m.
    point : array_like, shape (3,)
        A point of the axis, m.
    direction : array_like, shape (3,)
        Direction of the axis, of any length.
    angle : float
        Rotation, rad, up to ±1000: also more than one turn.
    advance : float
        Distance along the axis over the whole path, m.

    Raises
    ------
    InputError
        If an argument is invalid, the direction vanishes, or a number is out of range.
    """

    start: ArrayLike
    point: ArrayLike
    direction: ArrayLike
    angle: float
    advance: float = 0.0
    _segments: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        start, point = one_pose("start", self.start), _vector("point", self.point)
        direction = _vector("direction", self.direction)
        length = float(np.linalg.norm(direction))
        if length == 0:
            raise InputError("direction is zero, wanted a direction")
        angle = as_number("angle (rad)", self.angle, -_LARGEST_TURN, _LARGEST_TURN)
        advance = as_number("advance (m)", self.advance, -_core.LENGTH_LIMIT, _core.LENGTH_LIMIT)
        out = np.empty((1, _core.SEGMENT_WIDTH))
        _core.path_screw(start, point, direction / length, angle, advance, True, None, out)
        fill(self, start=start, point=point, direction=direction, angle=angle, advance=advance, _segments=out)


@by_content
@dataclass(frozen=True, eq=False, repr=False)
class Waypoints(Path):
    """Through given poses: straight and by the shortest rotation between neighbours.

    Pose i is at s = i / (N - 1). A single pose is a constant path.

    Parameters
    ----------
    poses : array_like, shape (N, 4, 4)
        Poses of the end effector, positions in m; rotations within 1e-6 of orthonormal are made exact.

    Raises
    ------
    InputError
    """

    poses: ArrayLike
    _segments: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        wanted = "(N, 4, 4) with N of 1 or more"
        poses = many_poses("poses", self.poses, wanted=wanted).copy()
        if len(poses) == 0:
            raise InputError(f"poses has shape {poses.shape}, wanted {wanted}")
        _core.check_transforms(poses, "pose")
        out = np.empty((max(len(poses) - 1, 1), _core.SEGMENT_WIDTH))
        _core.path_waypoints(poses, np.linspace(0, 1, max(len(poses), 2)), out)
        fill(self, poses=frozen(poses), _segments=out)

    def __len__(self) -> int:
        return len(np.asarray(self.poses))

    def __repr__(self) -> str:
        return f"<Waypoints of {len(self)} poses>"


@by_content
@dataclass(frozen=True, eq=False, repr=False)
class Segments(Path):
    """Consecutive paths; with `blend`, their corners are rounded.

    Without blends the velocity jumps from piece to piece. With them pose, velocity and acceleration are
    continuous: within `blend` of a corner the end of one piece and the beginning of the next are added, for
    position and rotation alike. `s` is divided by size, ``sqrt(length² + (0.2 m · turn)²)``; constant pieces
    are left out.

    Not to be confused with `Waypoints`, which divide s equally. ``line + arc`` is the same without blend.

    Parameters
    ----------
    paths : sequence of Path
        Each begins where the one before it ends, within 1e-9 m and rad.
    blend : float, or array_like of shape (corners,)
        Length of a blend before and after a corner, m, >= 0; at most to the middle of a piece. One for all,
        or one for each corner between two pieces (legs, for `Waypoints`), 0 for an exact corner.
        ``deviation`` gives the result: the path deviates by at most 3/16 of it, and misses a corner of 90
        degrees by 0.27 of it, a reversal by 3/8.

    Raises
    ------
    InputError
        If there is no path or another object in the list, there is a gap between two paths, the radius is out
        of range, or a path to be blended already has blends.

    Examples
    --------
    >>> a, b, c = (np.eye(4) for _ in range(3))
    >>> b[0, 3], c[:2, 3] = 0.4, (0.4, 0.3)
    >>> corner = Segments([Line(a, b), Line(b, c)], blend=0.1)
    >>> round(corner.deviation.position, 5), corner.breaks.round(3).tolist()
    (0.02652, [0.0, 0.429, 0.714, 1.0])
    """

    paths: Sequence[Path]
    blend: ArrayLike = 0.0
    deviation: Deviation = field(init=False)
    _segments: Floats = field(init=False)

    def __post_init__(self) -> None:
        paths = tuple(self.paths) if isinstance(self.paths, (list, tuple)) else ()
        if not paths or not all(isinstance(path, Path) for path in paths):
            raise InputError(f"paths is {self.paths!r:.100}, wanted a list of Line, CircularArc, Screw, ..")
        radius = as_blend(self.blend)
        if np.max(radius, initial=0.0) > _WIDE:
            warn(f"blend is {np.max(radius):g}, wanted m: was this in mm?")
        for k, path in enumerate(paths):
            blended = isinstance(path, Chain) or (isinstance(path, Segments) and np.any(path.blend))
            if blended and np.any(radius):
                raise InputError(f"paths: path {k} has blends already, wanted blend= of the whole")
        given = np.concatenate([path._segments for path in paths])
        first, gap = _core.path_gap(given)
        if first < len(given):
            owner = int(
                np.searchsorted(np.cumsum([len(path._segments) for path in paths]), first, side="right")
            )
            raise InputError(
                f"paths: path {owner} begins {gap:.3g} m or rad from where the one before it ends, "
                "wanted the same pose"
            )
        corners = len(given) - 1
        if np.ndim(radius) and len(radius) != corners:
            raise InputError(
                f"blend has shape {radius.shape}, wanted one number, or one for each of {corners} corners"
            )
        reach = np.append(np.broadcast_to(radius, corners), 0.0)
        segments, position, rotation = _core.path_joined(given, np.ascontiguousarray(reach, dtype=float))
        off = greatest([Deviation(position, rotation), *map(deviation_of, paths)])
        blend = frozen(radius) if np.ndim(radius) else float(radius)
        fill(self, paths=paths, blend=blend, deviation=off, _segments=frozen(segments))

    def __repr__(self) -> str:
        radius = np.asarray(self.blend, dtype=float)
        rounded = f", blend={radius.round(6).tolist()}" if radius.any() else ""
        return f"<Segments of {len(self.paths)} paths{rounded}>"


def as_blend(blend: ArrayLike) -> Floats:
    """Return radii of blends, shape () or (corners,), m."""
    radius = as_floats("blend (m)", blend)
    if radius.ndim > 1:
        raise InputError(f"blend has shape {radius.shape}, wanted one number, or one for each corner")
    for value in radius.reshape(-1).tolist():
        as_number("blend (m)", value, 0.0, _core.LENGTH_LIMIT)
    return radius


def as_path(path: Any, blend: ArrayLike = 0.0) -> Path | None:
    """Return a path, or several as one, with its corners rounded; None for other objects."""
    radius = as_blend(blend)
    if isinstance(path, (list, tuple)) and path and all(isinstance(each, Path) for each in path):
        return Segments(path, radius)
    if isinstance(path, Path):
        return Segments((path,), radius) if radius.ndim or radius > 0 else path
    return None


def sample_count(samples: int | None) -> int:
    """Return the requested number of rows, `SAMPLES` by default."""
    return SAMPLES if samples is None else as_whole("samples", samples, 2, MOST_SAMPLES)
