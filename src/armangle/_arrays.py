"""Arguments as arrays: shapes, broadcasting, and the errors that say what is wrong with them."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .errors import (
    ArmangleError,
    ConfigurationError,
    InputError,
    LimitError,
    NotFiniteError,
    NotRotationError,
    ShapeError,
    UnreachableError,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shape = tuple[int, ...]
Report = tuple[int, int, float]

MILLIMETRES = 1e3
MOST_THREADS = 1024


def as_floats(name: str, value: ArrayLike, tail: Shape = ()) -> Floats:
    """Return `value` as float64 of shape (..., *tail), each element contiguous; `name` is for errors."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiu":
            raise TypeError
        array = array.astype(np.float64, copy=False)
    except (TypeError, ValueError):
        raise InputError(f"{name} is not an array of real numbers, wanted shape {shape_text(tail)}") from None
    if array.ndim < len(tail) or array.shape[array.ndim - len(tail) :] != tail:
        raise ShapeError(f"{name} has shape {array.shape}, wanted {shape_text(tail)}")
    step = array.itemsize
    for axis in range(1, len(tail) + 1):
        if array.strides[-axis] != step and array.shape[-axis] > 1:
            return np.ascontiguousarray(array)
        step *= array.shape[-axis]
    return array if all(stride % 8 == 0 for stride in array.strides) else array.copy()


def as_gc(value: ArrayLike) -> Ints:
    """Return `value` as int64; the range 0..7 is checked where it is used."""
    array = np.asarray(value)
    if array.dtype.kind not in "iu":
        raise ConfigurationError(f"gc has type {array.dtype}, wanted integers from 0 to 7")
    index: Ints = array.astype(np.int64, copy=False)
    return index if all(stride % 8 == 0 for stride in index.strides) else index.copy()


def as_number(name: str, value: float, low: float, high: float, *, low_open: bool = False) -> float:
    """Return `value` as a float within [low, high] (low excluded where `low_open`)."""
    wanted = f"a number in {'(' if low_open else '['}{low:g}, {high:g}]"
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} is {value!r:.50}, wanted {wanted}") from None
    if not low <= number <= high or (low_open and number == low):
        raise InputError(f"{name} is {number:g}, wanted {wanted}")
    return number


def check_angles(name: str, angles: Floats) -> None:
    """Raise where an angle is not finite, or so large that one turn of it has no digits left."""
    bad = ~(np.abs(angles) <= _core.LARGEST_ANGLE)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        value = float(angles[index])
        raise _bad_angle(f"{name}{list(index) if index else ''} is {value}", value)


def _bad_angle(what: str, value: float) -> ArmangleError:
    if np.isfinite(value):
        return InputError(f"{what}, wanted an angle in rad within ±{_core.LARGEST_ANGLE:g}")
    return NotFiniteError(f"{what}, wanted finite angles in rad")


def shape_text(tail: Shape) -> str:
    """Return a shape with leading batch axes as text: (..., 4, 4)."""
    return f"({', '.join(['...', *map(str, tail)])})" if tail else "(...)"


def broadcast(named: Sequence[tuple[str, NDArray[Any], int]]) -> tuple[Shape, list[NDArray[Any]]]:
    """Return the common batch shape of (name, array, inner axes) and the arrays broadcast to it."""
    shapes = [array.shape[: array.ndim - inner] for _, array, inner in named]
    if shapes.count(shapes[0]) == len(shapes):
        return shapes[0], [array for _, array, _ in named]
    try:
        batch = np.broadcast_shapes(*shapes)
    except ValueError:
        listed = ", ".join(f"{name} {shape}" for (name, _, _), shape in zip(named, shapes, strict=True))
        raise ShapeError(f"batch shapes do not broadcast: {listed}") from None
    out = []
    for _, array, inner in named:
        tail = array.shape[array.ndim - inner :]
        out.append(np.broadcast_to(array, batch + tail))
    return batch, out


def output(out: Floats | None, shape: Shape) -> Floats:
    """Return `out`, checked, or a new float64 array of `shape`."""
    if out is None:
        return np.empty(shape)
    ok = isinstance(out, np.ndarray) and out.dtype == np.float64 and out.shape == shape
    if not (ok and out.flags.c_contiguous and out.flags.writeable):
        raise ShapeError(f"out is no writable C-contiguous float64 array of shape {shape}")
    return out


def as_threads(threads: int) -> int:
    """Return a thread count: 1 or more, or 0 for all cores."""
    whole = isinstance(threads, Integral) and not isinstance(threads, bool)
    if not whole or not 0 <= threads <= MOST_THREADS:
        wanted = f"an integer: 0 for all cores, or 1 to {MOST_THREADS}"
        raise InputError(f"threads is {threads!r}, wanted {wanted}")
    return int(threads)


def raise_problem(report: Report, batch: Shape, *, joints: str = "q") -> NoReturn:
    """Raise the error that a report of the core stands for; `joints` names the joint argument."""
    code, flat, value = report
    index = np.unravel_index(flat, batch) if batch else ()
    where = f"[{', '.join(str(int(i)) for i in index)}]" if index else ""
    raise _error(_core.PROBLEMS[code], where, value, joints)


def _error(problem: str, where: str, value: float, joints: str) -> ArmangleError:
    match problem:
        case "pose_not_finite":
            return NotFiniteError(f"pose{where} holds {value}, wanted finite numbers")
        case "pose_last_row":
            return NotRotationError(f"pose{where} has {value:g} in its last row, wanted 0 0 0 1")
        case "pose_not_rotation":
            return NotRotationError(
                f"the rotation of pose{where} is not orthonormal: |RᵀR - I| is {value:.3g}, wanted at "
                f"most {_core.ROTATION_TOLERANCE:g}; armangle.nearest_rotation(pose) gives the nearest one"
            )
        case "pose_reflection":
            return NotRotationError(f"the rotation of pose{where} is a reflection: its determinant is -1")
        case "psi_not_finite":
            return _bad_angle(f"psi{where} is {value}", value)
        case "gc_range":
            return ConfigurationError(f"gc{where} is {int(value)}, wanted an integer from 0 to 7")
        case "joints_not_finite":
            return _bad_angle(f"{joints}{where} holds {value}", value)
        case "joint_limit":
            return LimitError(f"joint {int(value)} of the solution of pose{where} is outside its limits")
        case "folded":
            return UnreachableError(
                f"the wrist of {joints if joints == 'q' else 'pose'}{where} lies on the shoulder: "
                "the arm is folded and the arm angle is not defined"
            )
        case "unreachable":
            return UnreachableError(f"pose{where} is out of reach by {value * MILLIMETRES:.6g} mm")
    return ArmangleError(problem)
