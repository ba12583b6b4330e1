"""ArcSet: closed arcs on the circle of the arm angle, for one pose or a batch of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._arrays import (
    BoolOrArray,
    FloatOrArray,
    Floats,
    IntOrArray,
    Ints,
    Shape,
    StatusOrArray,
    as_floats,
    check_angles,
    frozen,
    hint_degrees,
    shaped_if_empty,
)
from .._core import SetOperation, Side
from .._values import without_truth
from ..errors import InputError
from ..scenes.ready import PairNames, Ready
from ..status import STATUSES, Status

EndSide = Literal["lower", "upper", "singular", "user", "obstacle", "unproven"]
_WORDS: dict[Side, EndSide | None] = {
    Side.NONE: None, Side.LOWER: "lower", Side.UPPER: "upper", Side.USER: "user",
    Side.NEAR_MARGIN: "singular", Side.FAR_MARGIN: "singular",
    Side.NEAR_SINGULAR: "singular", Side.FAR_SINGULAR: "singular", Side.OBSTACLE: "obstacle",
    Side.UNPROVEN: "unproven",
}  # fmt: skip


@dataclass(frozen=True)
class ArcEnd:
    """The cause of one end of an arc.

    Parameters
    ----------
    joint : int or None
        Joint 1..7, or None for an end that no joint causes.
    side : "lower", "upper", "singular", "user", "obstacle" or "unproven"
        The limit reached there; a singularity or its margin; an arc given by the user; an obstacle of a scene
        with which a link would collide; or, for an arm that is not exactly S-R-S, the end of the proven part.
    value : float
        The value of that joint there, rad in robot coordinates; NaN without a joint.
    obstacle, link : str or None
        The two that would collide.
    """

    joint: int | None
    side: EndSide
    value: float
    obstacle: str | None = None
    link: str | None = None

    def __repr__(self) -> str:
        who = "" if self.obstacle is None else f", obstacle={self.obstacle!r}, link={self.link!r}"
        return f"ArcEnd(joint={self.joint}, side={self.side!r}, value={self.value!r}{who})"


_ARRAYS = ("_count", "_psi", "_joint", "_side", "_value", "_status")
_OF_SCENES = ("_pair", "_blocking", "_coarse", "_names")
_COLUMNS = {name: index for index, name in enumerate((*_ARRAYS, *_OF_SCENES[:3]))}  # of the core
Names = tuple[tuple[str, str] | None, ...]


def _nested(items: list[Any], shape: Shape) -> Any:
    """Return a flat list as nested lists of a shape; for () its only item."""
    if not shape:
        return items[0]
    if len(shape) == 1:
        return items
    size = math.prod(shape[1:])
    return [_nested(items[i * size : (i + 1) * size], shape[1:]) for i in range(shape[0])]


class _Pairs(NamedTuple):
    """The core's pair numbers of a batch, in the columns that a few poses have (`_core.ArcsOfFew`)."""

    pair: Ints
    blocking: Ints
    coarse: NDArray[np.int8]

    def column(self, index: int) -> Any:
        """Return one column by its index in the core's columns."""
        return self[index - len(_ARRAYS)]


def _named(pair: Ints, blocking: Ints, names: PairNames) -> tuple[Ints, Ints, Names]:
    """Return pair codes of ends, and of whole sets, as indices into a list of names; -1 (no pair) stays."""
    known, place = np.unique(np.concatenate([pair.ravel(), blocking]), return_inverse=True)
    none = int((known < 0).sum())
    place = place.ravel() - none
    listed = tuple(names.pair(int(code)) for code in known[none:])
    return place[: pair.size].reshape(pair.shape), place[pair.size :], listed


def _pairs_of(arcs: ArcSet) -> Ints:
    """Return a copy of the pair index of each arc end; -1 everywhere without a scene."""
    return np.full(arcs._psi.shape, -1) if arcs._pair is None else arcs._pair.copy()


def _coarse_of(arcs: ArcSet) -> NDArray[np.int8]:
    """Return for each set whether it lacks narrow arcs for want of memory, as 0 or 1."""
    return np.zeros(len(arcs._count), dtype=np.int8) if arcs._coarse is None else arcs._coarse


@without_truth
class ArcSet:
    """Closed arcs on the circle, of shape () for one pose or of the shape of a batch.

    The arcs of one set are disjoint and in rising order. Isolated angles are arcs of width 0 (a locked joint
    leaves one or two). `lower` is in [-π, π), `upper` in [lower, lower + 2π]. The full circle is the one arc
    [-π, π] without ends. Values are frozen.

    Created by `Arm.feasible`, by `ArcSet(intervals)` or by the operators ``&`` (both), ``|`` (either), ``~``
    (closure of the complement).

    Parameters
    ----------
    intervals : array_like, shape (k, 2)
        Arcs [lower, upper] in rad, on any turn, upper >= lower. Overlapping arcs are merged, arcs of 2π or
        more are the full circle, and a point is an arc of width 0. At most 16.

    Raises
    ------
    InputError
        If the shape is not (k, 2), a number is not finite, an upper end is below its lower one, or there are
        more than 16 arcs.

    Examples
    --------
    >>> arcs = ArcSet([[-0.5, 1.0], [2.0, 4.0]])
    >>> 0.0 in arcs, 1.5 in arcs, 3.5 in arcs
    (True, False, True)
    >>> round(float((~arcs).measure + arcs.measure), 12) == round(2 * np.pi, 12)
    True
    """

    __slots__ = (*_ARRAYS, *_OF_SCENES, "_of", "_start", "_unproven", "shape")

    shape: Shape
    _count: Ints
    _psi: Floats
    _joint: NDArray[np.int8]
    _side: NDArray[np.int8]
    _value: Floats
    _status: NDArray[np.int8]
    _start: Ints  # the first arc of each set; computed from the counts on first use
    _pair: Ints | None  # for each end its index in _names; -1: no obstacle; None: no scene
    _blocking: Ints | None  # the same for each set that one pair alone leaves empty
    _coarse: NDArray[np.int8] | None  # the same: whether narrow arcs are missing
    _names: Names  # (obstacle, link)
    _unproven: Floats | None  # of each set, rad; None: everything is proven
    _of: tuple[_core.ArcsOfFew | _Pairs, PairNames | None]  # computes missing values on first use

    def __init__(self, intervals: ArrayLike = ()) -> None:
        psi = as_floats("intervals", shaped_if_empty(intervals, (2,)), (2,))
        if psi.ndim != 2:
            raise InputError(f"intervals has shape {psi.shape}, wanted (k, 2)")
        check_angles("intervals", psi)
        hint_degrees("intervals", psi)
        if (psi[:, 1] < psi[:, 0]).any():
            at = int(np.argmax(psi[:, 1] < psi[:, 0]))
            raise InputError(f"intervals[{at}] is {psi[at].tolist()}, wanted upper >= lower")
        most = _core.ARC_CAPACITY // 2
        if len(psi) > most:
            raise InputError(f"intervals holds {len(psi)} arcs, wanted at most {most}")
        count, arcs = _core.arcs_from(np.array([len(psi)], dtype=np.int64), np.ascontiguousarray(psi))
        full = arcs[:, 1] - arcs[:, 0] >= 2 * np.pi - _core.ANGLE_TOLERANCE
        side = np.where(full[:, None], Side.NONE.value, Side.USER.value).astype(np.int8).repeat(2, axis=1)
        self._keep_arrays((), (count, arcs, np.zeros_like(side), side, np.full(arcs.shape, np.nan), None))
        self._keep_pairs()

    def _keep_arrays(self, shape: Shape, arrays: tuple[Any, ...], unproven: Floats | None = None) -> None:
        """Set the shape and the arrays of arcs, read-only; a missing status is OK if there is an arc, else
        LIMITS.
        """
        *columns, status = arrays
        if status is None:
            status = np.where(columns[0] > 0, Status.OK, Status.LIMITS).astype(np.int8)
        for name, array in zip(_ARRAYS, (*columns, status), strict=True):
            object.__setattr__(self, name, frozen(array))
        object.__setattr__(self, "_unproven", None if unproven is None else frozen(unproven))
        object.__setattr__(self, "shape", shape)

    def _keep_pairs(
        self,
        pair: Ints | None = None,
        blocking: Ints | None = None,
        coarse: NDArray[np.int8] | None = None,
        names: Names = (),
    ) -> None:
        """Set the pairs (obstacle, link) at the arc ends and their names, arrays read-only."""
        for name, found in zip(_OF_SCENES, (pair, blocking, coarse, names), strict=True):
            object.__setattr__(self, name, frozen(found) if isinstance(found, np.ndarray) else found)

    @classmethod
    def _empty(cls, shape: Shape) -> ArcSet:
        """Return a batch of this shape whose sets have no arcs, but status OK."""
        codes = np.zeros(math.prod(shape), dtype=np.int8)
        ends = np.empty((0, 2), dtype=np.int8)
        return cls._from_core(
            shape, (codes.astype(np.int64), np.empty((0, 2)), ends, ends, np.empty((0, 2)), codes)
        )

    @classmethod
    def _from_core(
        cls, shape: Shape, arrays: tuple[Any, ...], ready: Ready | None = None, unproven: Floats | None = None
    ) -> ArcSet:
        """Return the batch of the core's arrays: count, psi, joint, side, value, status, pairs.

        `unproven`: the length (rad) of each set that is proven neither way, and left out. The names of a
        scene's pairs are looked up when they are read.
        """
        new = cls.__new__(cls)
        new._keep_arrays(shape, arrays[: len(_ARRAYS)], unproven)
        pairs = arrays[len(_ARRAYS) :]
        if ready is None:
            new._keep_pairs(*pairs)
        else:
            object.__setattr__(new, "_of", (_Pairs(*pairs), ready.names))
        return new

    @classmethod
    def _of_few(cls, sets: Shape, found: _core.ArcsOfFew, ready: Ready | None = None) -> ArcSet:
        """Return the sets of one pose or of a few; their arrays are created when they are read."""
        new = cls.__new__(cls)
        object.__setattr__(new, "shape", sets if found.rows < 0 else (found.rows, *sets))
        object.__setattr__(new, "_of", (found, None if ready is None else ready.names))
        return new

    if not TYPE_CHECKING:  # a type checker should know the existing attributes

        def __getattr__(self, name: str) -> Any:
            """Return a value on first use: an array of one pose, or the first arc of each set."""
            if name == "_start":
                found = np.zeros(len(self._count) + 1, dtype=np.int64)
                np.cumsum(self._count, out=found[1:])
                frozen(found)
            elif name in _OF_SCENES:
                source, names = self._of
                pair, blocking, coarse = (source.column(_COLUMNS[key]) for key in _OF_SCENES[:3])
                listed: Names = ()
                if names is not None:
                    pair, blocking, listed = _named(pair, blocking, names)
                self._keep_pairs(pair, blocking, coarse, listed)
                return getattr(self, name)
            elif name in _COLUMNS:
                found = self._of[0].column(_COLUMNS[name])
            elif name == "_unproven":
                found = None
            else:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            object.__setattr__(self, name, found)
            return found

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"ArcSet is frozen: {name} cannot be set")

    def __getstate__(self) -> tuple[Any, ...]:
        return tuple(getattr(self, name) for name in ("shape", *_ARRAYS, *_OF_SCENES, "_unproven"))

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        shape, *arrays, pair, blocking, coarse, names, unproven = state
        count, psi = arrays[0], arrays[1]
        known = (count >= 0).all() and (count <= _core.ARC_CAPACITY).all() and count.sum() == len(psi)
        if not known or any(len(array) != len(psi) for array in arrays[2:5]) or len(arrays[5]) != len(count):
            raise InputError("this state is not that of an ArcSet: its arrays do not belong together")
        self._keep_arrays(shape, tuple(array.copy() for array in arrays), unproven)
        self._keep_pairs(pair, blocking, coarse, names)

    # -- properties of a set ----------------------------------------------------------------------

    @property
    def count(self) -> IntOrArray:
        """Number of arcs, int64 of the set's shape."""
        return self._count.reshape(self.shape)[()]

    @property
    def status(self) -> StatusOrArray:
        """Why a set is empty: a `Status` for shape (), int8 codes of the set's shape for a batch."""
        return self._status.reshape(self.shape) if self.shape else STATUSES[self._status[0]]

    @property
    def unproven(self) -> FloatOrArray:
        """Length of the circle that is left out because nothing is proven of it, rad, of the set's shape.

        0 for an arm that is exactly S-R-S. Branches of an own chain merge near singularities, and what
        obstacles leave of any other arm is proven cell by cell (`Arm.feasible`).
        """
        if self._unproven is None:
            return np.zeros(self.shape)[()]
        return self._unproven.reshape(self.shape)[()]

    @property
    def blocking(self) -> Any:
        """The pair (obstacle, link) that leaves a set empty, or None if none does alone; nested lists.

        If the arm is not S-R-S, a pair that collides there, though others may be needed to leave it empty.
        """
        codes = np.full(len(self._count), -1) if self._blocking is None else self._blocking
        return _nested([self._named(int(code)) for code in codes], self.shape)

    @property
    def coarse(self) -> BoolOrArray:
        """Whether obstacles leave more arcs than a set can hold, bool of the set's shape.

        The narrowest are then missing: the set is collision-free, but not complete.
        """
        coarse: NDArray[np.bool_] = (_coarse_of(self) != 0).reshape(self.shape)
        return coarse[()]

    def _named(self, code: int) -> tuple[str, str] | None:
        """Return the names (obstacle, link) of a pair index; None for -1."""
        return self._names[code] if code >= 0 else None

    @property
    def ok(self) -> BoolOrArray:
        """Whether there is an interval, bool of the set's shape."""
        return ~self.is_empty

    @property
    def is_empty(self) -> BoolOrArray:
        """Whether there is no arc, bool of the set's shape."""
        empty: NDArray[np.bool_] = (self._count == 0).reshape(self.shape)
        return empty[()]

    @property
    def is_full(self) -> BoolOrArray:
        """Whether the set is the whole circle, bool of the set's shape."""
        full: NDArray[np.bool_] = self._measure() >= 2 * np.pi - _core.ANGLE_TOLERANCE
        return full.reshape(self.shape)[()]

    @property
    def measure(self) -> FloatOrArray:
        """Total length of the arcs in rad, float64 of the set's shape."""
        return self._measure().reshape(self.shape)[()]

    def _measure(self) -> Floats:
        """Return the total length of each set's arcs, rad, as a flat array."""
        rows = np.repeat(np.arange(len(self._count)), self._count)
        widths = self._psi[:, 1] - self._psi[:, 0]
        return np.bincount(rows, weights=widths, minlength=len(self._count)).astype(np.float64)

    @property
    def intervals(self) -> Floats:
        """The arcs [lower, upper] in rad: (count, 2) for shape (), else (*shape, k, 2), padded with NaN."""
        if not self.shape:
            return self._psi
        most = int(self._count.max(initial=0))
        out = np.full((len(self._count), most, 2), np.nan)
        rows = np.repeat(np.arange(len(self._count)), self._count)
        out[rows, np.arange(len(rows)) - self._start[rows]] = self._psi
        return out.reshape(*self.shape, most, 2)

    @property
    def ends(self) -> Any:
        """The two `ArcEnd` of each interval, () for the full circle; nested lists over a batch's axes."""
        return _nested([self._ends_of(i) for i in range(len(self._count))], self.shape)

    def _ends_of(self, index: int) -> list[tuple[ArcEnd, ...]]:
        """Return the two ends of each arc of one set, by the set's flat index."""
        out: list[tuple[ArcEnd, ...]] = []
        for arc in range(self._start[index], self._start[index + 1]):
            pair = []
            who = (None, None) if self._pair is None else [self._named(int(k)) for k in self._pair[arc]]
            of_arc = zip(self._joint[arc], self._side[arc], self._value[arc], who, strict=True)
            for joint, code, value, names in of_arc:
                side = _WORDS[Side(code)]
                if side is not None:
                    pair.append(ArcEnd(int(joint) or None, side, float(value), *(names or ())))
            out.append(tuple(pair))
        return out

    # -- queries -----------------------------------------------------------------------------------------

    def contains(self, psi: ArrayLike) -> BoolOrArray:
        """Return whether arm angles are in the sets, within 1e-9 rad.

        Parameters
        ----------
        psi : array_like, shape broadcasting with the set's
            Arm angles in rad, any real.

        Returns
        -------
        bool, of the broadcast shape

        Raises
        ------
        InputError
            If an angle is not finite, or the shapes do not broadcast.
        """
        inside: NDArray[np.bool_] = self._query(psi, False) != 0
        return inside[()]

    def nearest(self, psi: ArrayLike) -> FloatOrArray:
        """Return the nearest arm angle in the sets.

        Parameters
        ----------
        psi : array_like, shape broadcasting with the set's
            Arm angles in rad, any real.

        Returns
        -------
        float64, of the broadcast shape
            psi itself, wrapped to (-π, π], if it is in the set. Otherwise the nearest end on the circle, the
            lower one on a tie; NaN if the set is empty.

        Raises
        ------
        InputError
            If an angle is not finite, or the shapes do not broadcast.
        """
        return self._query(psi, True)[()]

    def _query(self, psi: ArrayLike, nearest: bool) -> Floats:
        """Return whether each arm angle is in its set (1 or 0), or the nearest angle in it if `nearest`."""
        angles = as_floats("psi", psi)
        check_angles("psi", angles)
        shape, index, angles = self._pair_with(angles)
        out = np.empty(len(index))
        _core.query(self._count, self._psi, index, angles, out, nearest)
        return out.reshape(shape)

    def _pair_with(self, angles: Floats) -> tuple[Shape, Ints, Floats]:
        """Return the broadcast shape of sets and angles, and each pair as flat set index and angle (rad)."""
        if not self.shape:
            return angles.shape, np.zeros(angles.size, dtype=np.int64), np.ascontiguousarray(angles).ravel()
        index = np.arange(len(self._count)).reshape(self.shape)
        try:
            index, angles = np.broadcast_arrays(index, angles)
        except ValueError:
            raise InputError(
                f"psi of shape {angles.shape} does not broadcast with arcs of shape {self.shape}"
            ) from None
        return index.shape, index.ravel(), np.ascontiguousarray(angles).ravel()

    def __contains__(self, psi: ArrayLike) -> bool:
        self._need_one("in")
        return bool(self.contains(psi))

    def __iter__(self) -> Iterator[tuple[float, float]]:
        self._need_one("iteration")
        return iter([(float(lower), float(upper)) for lower, upper in self._psi])

    def __len__(self) -> int:
        if not self.shape:
            return int(self._count[0])
        return self.shape[0]

    def _need_one(self, what: str) -> None:
        """Raise if this is a batch; `what` names the operation that needs one set."""
        if self.shape:
            raise InputError(f"{what} needs arcs of one pose; these have shape {self.shape}: index them")

    def __getitem__(self, key: Any) -> ArcSet:
        picked = np.arange(len(self._count)).reshape(self.shape)[key]
        index = np.atleast_1d(picked).ravel()
        count = self._count[index]
        behind = np.cumsum(count)
        first = self._start[index] - (behind - count)  # of a set's rows, less those of the sets before it
        rows = np.repeat(first, count) + np.arange(behind[-1] if len(count) else 0)
        return ArcSet._from_core(
            np.shape(picked),
            (count, self._psi[rows], self._joint[rows], self._side[rows], self._value[rows],
             self._status[index], None if self._pair is None else self._pair[rows],
             None if self._blocking is None else self._blocking[index],
             None if self._coarse is None else self._coarse[index], self._names),
            unproven=None if self._unproven is None else self._unproven[index],
        )  # fmt: skip

    # -- algebra -------------------------------------------------------------------------------------

    def __and__(self, other: ArcSet) -> ArcSet:
        return self._combine(SetOperation.INTERSECTION, other)

    def __or__(self, other: ArcSet) -> ArcSet:
        return self._combine(SetOperation.UNION, other)

    def __invert__(self) -> ArcSet:
        return self._combine(SetOperation.COMPLEMENT, self)

    def _combine(self, operation: SetOperation, other: ArcSet) -> ArcSet:
        """Return union, intersection or own complement, broadcast; ends keep their causes, not `unproven`."""
        if not isinstance(other, ArcSet):
            return NotImplemented
        a, b = (np.arange(len(s._count)).reshape(s.shape) for s in (self, other))
        try:
            a, b = np.broadcast_arrays(a, b)
        except ValueError:
            raise InputError(f"arcs of shapes {self.shape} and {other.shape} do not broadcast") from None
        index_a, index_b = a.ravel(), b.ravel()
        together = int((self._count[index_a] + other._count[index_b]).max(initial=0))
        if operation != SetOperation.COMPLEMENT and together > _core.ARC_CAPACITY:
            raise InputError(f"the two sets hold {together} arcs, wanted at most {_core.ARC_CAPACITY}")
        count, psi, source = _core.combine(
            operation, self._count, self._psi, index_a, other._count, other._psi, index_b
        )
        none = source < 0

        def carried(mine: NDArray[Any], theirs: NDArray[Any], empty: float) -> NDArray[Any]:
            """Return for each end of the result the value at the end that it stems from, else `empty`."""
            pool = np.concatenate([mine.ravel(), theirs.ravel(), [empty]]).astype(mine.dtype)
            return pool[np.where(none, -1, source)]

        joint = carried(self._joint, other._joint, 0)
        side = carried(self._side, other._side, 0)
        value = carried(self._value, other._value, np.nan)
        status = None
        if operation == SetOperation.INTERSECTION:
            reason = np.where(self._count[index_a] == 0, self._status[index_a], other._status[index_b])
            reason = np.where(reason == Status.OK, Status.LIMITS, reason)
            status = np.where(count > 0, Status.OK, reason).astype(np.int8)
        names: Names = ()
        pair = None
        if self._pair is not None or other._pair is not None:
            names = (*self._names, *other._names)
            mine, theirs = (_pairs_of(s) for s in (self, other))
            theirs[theirs >= 0] += len(self._names)
            pair = carried(mine, theirs, -1)
        coarse = None
        if operation != SetOperation.COMPLEMENT and not (self._coarse is None and other._coarse is None):
            coarse = _coarse_of(self)[index_a] | _coarse_of(other)[index_b]
        return ArcSet._from_core(a.shape, (count, psi, joint, side, value, status, pair, None, coarse, names))

    def _less(self, other: ArcSet) -> ArcSet:
        """Return the part of this set outside another one, without its isolated angles."""
        left = self & ~other
        wide = left._psi[:, 1] > left._psi[:, 0]
        of = np.repeat(np.arange(len(left._count)), left._count)[wide]
        count = np.bincount(of, minlength=len(left._count)).astype(np.int64)
        ends = (column[wide] for column in (left._psi, left._joint, left._side, left._value))
        pair = None if left._pair is None else left._pair[wide]
        return ArcSet._from_core(
            left.shape, (count, *ends, left._status, pair, None, left._coarse, left._names)
        )

    def __eq__(self, other: object) -> bool:
        """Return whether both have the same shape and exactly the same arcs."""
        if not isinstance(other, ArcSet):
            return NotImplemented
        return (
            self.shape == other.shape
            and np.array_equal(self._count, other._count)
            and np.array_equal(self._psi, other._psi)
        )

    def __hash__(self) -> int:
        return hash((self.shape, self._count.tobytes(), (self._psi + 0.0).tobytes()))

    def __repr__(self) -> str:
        if self.shape:
            return f"<ArcSet of shape {self.shape}, {len(self._psi)} arcs>"
        return f"ArcSet({self._psi.tolist()!r})"
