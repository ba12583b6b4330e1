"""Arguments as arrays: shapes, broadcasting, and the errors that say what is wrong with them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from numbers import Integral
from typing import Any, NoReturn, TypeVar

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

PathLike = str | os.PathLike[str]
AnyArray = TypeVar("AnyArray", bound=NDArray[Any])

JOINTS: int = _core.JOINTS
CONFIGURATIONS: int = _core.CONFIGURATIONS
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


def one_pose(name: str, value: ArrayLike) -> Floats:
    """Return a read-only copy (4, 4) of one rigid transform; positions in m."""
    pose = np.array(as_floats(name, value, (4, 4)), order="C")
    if pose.ndim != 2:
        raise ShapeError(f"{name} has shape {pose.shape}, wanted (4, 4)")
    report = _core.check_transforms(pose[None])
    if report:
        raise_problem(report, (), name)
    return frozen(pose)


def one_posture(name: str, value: ArrayLike) -> Floats:
    """Return a read-only copy (7,) of one posture, finite and no batch; rad."""
    joints = np.array(as_floats(name, value, (JOINTS,)), order="C")
    if joints.ndim != 1:
        raise ShapeError(f"{name} has shape {joints.shape}, wanted ({JOINTS},)")
    check_angles(name, joints)
    return frozen(joints)


def chosen(name: str, value: str, options: Sequence[str]) -> int:
    """Return which of the options `value` is."""
    if not isinstance(value, str) or value not in options:
        raise InputError(f"{name} is {value!r:.100}, wanted one of {', '.join(map(repr, options))}")
    return options.index(value)


def frozen(array: AnyArray) -> AnyArray:
    """Return the array, which from now on cannot be written to."""
    array.setflags(write=False)
    return array


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


def raise_problem(report: Report, batch: Shape, name: str = "pose", joints: str = "q") -> NoReturn:
    """Raise the error that a report of the core stands for.

    `name` is the argument that it is about, `joints` that of joint values where both are given.
    """
    code, flat, value = report
    problem = _core.PROBLEMS[code]
    index = np.unravel_index(flat, batch) if batch else ()
    at = f"[{', '.join(str(int(i)) for i in index)}]" if index else ""
    raise _error(problem, joints if problem == "joints_not_finite" else name, at, value)


def _error(problem: str, name: str, at: str, value: float) -> ArmangleError:
    """Return the error of a problem with an argument, or with psi or gc, at an index written as text."""
    where = name + at
    match problem:
        case "pose_not_finite":
            return NotFiniteError(f"{where} holds {value}, wanted finite numbers")
        case "pose_last_row":
            return NotRotationError(f"{where} has {value:g} in its last row, wanted 0 0 0 1")
        case "pose_not_rotation":
            return NotRotationError(
                f"the rotation of {where} is not orthonormal: |RᵀR - I| is {value:.3g}, wanted at "
                f"most {_core.ROTATION_TOLERANCE:g}; armangle.nearest_rotation(pose) gives the nearest one"
            )
        case "pose_reflection":
            return NotRotationError(f"the rotation of {where} is a reflection: its determinant is -1")
        case "psi_not_finite":
            return _bad_angle(f"psi{at} is {value}", value)
        case "gc_range":
            return ConfigurationError(f"gc{at} is {int(value)}, wanted an integer from 0 to 7")
        case "joints_not_finite":
            return _bad_angle(f"{where} holds {value}", value)
        case "joint_limit":
            return LimitError(f"joint {int(value)} of the solution of {where} is outside its limits")
        case "folded":
            return UnreachableError(
                f"the wrist of {where} lies on the shoulder: "
                "the arm is folded and the arm angle is not defined"
            )
        case "unreachable":
            return UnreachableError(f"{where} is out of reach by {value * MILLIMETRES:.6g} mm")
    return ArmangleError(problem)
