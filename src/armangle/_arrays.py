"""Arguments as arrays: shapes, broadcasting, and errors for invalid ones."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterable, Sequence
from enum import Enum
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import Problem
from .errors import (
    ArmangleError,
    InputError,
    LimitError,
    NoSolutionError,
    UnreachableError,
    shortened,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
# One value of one pose, an array of a batch. Type checkers cannot know which, and would refuse what only one
# of the two has, such as `round(distance, 3)` and `psi[0]`.
FloatOrArray = Any
IntOrArray = Any
BoolOrArray = Any
StatusOrArray = Any
NameOrArray = Any
Shape = tuple[int, ...]
AnyHandle = _core.Arm | _core.ChainArm | _core.OffsetArm | _core.OffsetChain

PathLike = str | os.PathLike[str]
AnyEnum = TypeVar("AnyEnum", bound=Enum)
AnyArray = TypeVar("AnyArray", bound=NDArray[Any])

JOINTS: int = _core.JOINTS
CONFIGURATIONS: int = _core.CONFIGURATIONS
MILLIMETRES = 1e3
MOST_THREADS = 1024
TURN = 2 * np.pi


def as_floats(name: str, value: ArrayLike, tail: Shape = (), meaning: str = "") -> Floats:
    """Return `value` as float64 of shape (..., *tail), each element contiguous; `name` is for errors.

    `meaning` describes an element in errors.
    """
    array = _numbers(name, value, tail, meaning)
    if array.ndim < len(tail) or array.shape[array.ndim - len(tail) :] != tail:
        raise InputError(f"{name} has shape {array.shape}, wanted {shape_text(tail)}{meaning}")
    return _aligned(array.astype(np.float64, copy=False), tail)


def as_poses(name: str, value: ArrayLike, arm: _core.Arm | None = None) -> Floats:
    """Return poses as float64 (..., 4, 4); pose objects of other libraries are accepted, see `matrix_of`.

    With `arm`, poses of fewer digits (float32) are corrected for rounding: rotations are made exact, and a
    pose just out of reach, or beyond the limit of joint 4, is moved onto it (not for an arm with an offset).
    """
    array = _numbers(name, matrix_of(value), (4, 4))
    if array.shape[-2:] != (4, 4):
        raise InputError(f"{name} has shape {array.shape}, wanted (..., 4, 4){looks_like(name, array.shape)}")
    poses = _aligned(array.astype(np.float64, copy=False), (4, 4))
    if arm is not None and array.dtype.kind == "f" and array.dtype.itemsize < poses.itemsize:
        arm.correct_poses_many(poses, float(np.finfo(array.dtype).eps))
    return poses


def shaped_if_empty(value: ArrayLike, tail: Shape) -> ArrayLike:
    """Return an empty list or tuple as an array of no elements of shape `tail`, anything else as it is."""
    return np.empty((0, *tail)) if isinstance(value, (list, tuple)) and not value else value


def check_source(value: object, *kinds: type) -> None:
    """Raise unless `value` is a path or a text that is not empty, or one of `kinds`; no file is read."""
    if not isinstance(value, (str, os.PathLike, *kinds)) or value == "":
        raise InputError(f"source is {value!r:.50}, wanted the path of a file, or its XML text")


def matrix_of(value: Any) -> Any:
    """Return the matrices (..., 4, 4) of an object that has them under another name, or of a list of such.

    The name is ``homogeneous`` in pinocchio, ``as_matrix()`` in SciPy, ``A`` in spatialmath; other objects
    pass.
    """
    if hasattr(value, "__array__"):
        return value
    if isinstance(value, (list, tuple)):
        return [matrix_of(item) for item in value] if value and not _plain(value[0]) else value
    for name in ("homogeneous", "as_matrix", "A"):
        found = getattr(value, name, None)
        if found is not None:
            return found() if callable(found) else found
    return value


def millimetres(length: float) -> str:
    """Return a length in m as text: 0.01234 is 12.34 mm, 800 are 800000 mm."""
    shown = f"{length * MILLIMETRES:.4g}"
    return f"{length * MILLIMETRES:.0f} mm" if "e+" in shown else f"{shown} mm"


def _plain(value: Any) -> bool:
    """Return whether a value is a number, list or array."""
    return isinstance(value, (list, tuple, np.ndarray, float, int, np.number))


def looks_like(name: str, shape: Shape) -> str:
    """Return the probable meaning of a shape that is not a pose's, and the call that makes poses from it."""
    if shape[-2:] == (3, 4):
        return f": without its last row; armangle.pose({name}[..., 3], matrix={name}[..., :3])"
    if shape[-2:] == (3, 3):
        return f": a rotation without a position; armangle.pose([x, y, z], matrix={name})"
    if shape[-1:] == (7,):
        quaternion = f"wxyz={name}[..., 3:]) where the real part is first, xyzw= where it is last"
        return f": it looks like x y z and a quaternion; armangle.pose({name}[..., :3], {quaternion}"
    if shape[-1:] == (6,):
        angles = f"rpy={name}[..., 3:]) for roll pitch yaw, rotvec= for an axis times its angle"
        return f": it looks like x y z and three angles; armangle.pose({name}[..., :3], {angles}"
    if shape[-1:] == (3,):
        return f": a position without an orientation; armangle.pose({name})"
    return ""


def _numbers(name: str, value: ArrayLike, tail: Shape, meaning: str = "") -> NDArray[Any]:
    """Return a value as an array of real numbers; raise with a hint for anything else."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiu" or _masked(name, value):
            raise TypeError
    except (TypeError, ValueError, RuntimeError):  # torch raises RuntimeError
        hint = _masked(name, value) or _tensor(name, value) or _posture(name, value)
        wanted = f"wanted shape {shape_text(tail)}{meaning}"
        raise InputError(hint or f"{name} is not an array of real numbers, {wanted}") from None
    return array


def _masked(name: str, value: Any) -> str:
    """Return an error text if some elements of an array are masked; "" otherwise."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        return f"{name} has masked elements, which are no numbers: fill them, or leave them out"
    return ""


def _posture(name: str, value: Any) -> str:
    """Return an error text if a value is the whole result of `forward`; "" otherwise."""
    if isinstance(value, tuple) and len(value) == 3 and np.shape(value[0])[-2:] == (4, 4):
        return f"{name} is a tuple of three, as arm.forward returns (pose, psi, gc): wanted the first of them"
    return ""


def _tensor(name: str, value: Any) -> str:
    """Return an error text with the right call if a value is another library's array; "" otherwise."""
    kinds = type(value).__mro__
    libraries = {kind.__module__.partition(".")[0] for kind in kinds}
    if libraries & {"jax", "jaxlib"} and any("Tracer" in kind.__name__ for kind in kinds):
        return (
            f"{name} is a JAX tracer, wanted numbers in memory: "
            "armangle.jax.Kinematics(arm) works inside jit, grad and vmap; call what it has not outside them"
        )
    if "torch" in libraries:
        calls = [".detach()"] if getattr(value, "requires_grad", False) else []
        device = str(getattr(value, "device", "cpu"))
        calls += [".cpu()"] if device != "cpu" else []
        if calls:
            why = "a tensor with gradients" if device == "cpu" else f"a tensor on {device}"
            traced = ", or armangle.torch.Kinematics(arm), through which gradients go" * (
                ".detach()" in calls
            )
            return f"{name} is {why}, wanted numbers in memory: {name}{''.join(calls)}{traced}"
    if "cupy" in libraries:
        return f"{name} is an array on a GPU, wanted numbers in memory: {name}.get()"
    return ""


def _aligned(array: Floats, tail: Shape) -> Floats:
    """Return an array whose elements of shape `tail` are contiguous and aligned; a copy if necessary."""
    step = array.itemsize
    for axis in range(1, len(tail) + 1):
        if array.strides[-axis] != step and array.shape[-axis] > 1:
            return array.copy()
        step *= array.shape[-axis]
    whole = array.flags.aligned and all(stride % 8 == 0 for stride in array.strides)
    return array if whole else array.copy()


def one_pose(name: str, value: ArrayLike, arm: _core.Arm | None = None) -> Floats:
    """Return a read-only copy (4, 4) of one rigid transform; positions in m; `arm` as in `as_poses`."""
    pose = np.array(as_poses(name, value, arm), order="C")
    if pose.ndim != 2:
        raise InputError(f"{name} has shape {pose.shape}, wanted (4, 4)")
    _core.check_transforms(pose, name)
    return frozen(pose)


def many_poses(
    name: str, value: ArrayLike, arm: _core.Arm | None = None, wanted: str = "(N, 4, 4)"
) -> Floats:
    """Return poses (N, 4, 4), contiguous; positions in m; `arm` as in `as_poses`; errors say `wanted`."""
    poses = np.ascontiguousarray(as_poses(name, value, arm))
    if poses.ndim != 3:
        raise InputError(f"{name} has shape {poses.shape}, wanted {wanted}")
    return poses


def one_posture(name: str, value: ArrayLike, arm: AnyHandle | None = None) -> Floats:
    """Return a read-only copy (7,) of one finite configuration without batch axes; rad, checked for `arm`."""
    joints = np.array(as_floats(name, value, (JOINTS,)), order="C")
    if joints.ndim != 1:
        raise InputError(f"{name} has shape {joints.shape}, wanted ({JOINTS},)")
    check_angles(name, joints)
    if arm is not None:
        arm.check_joints(joints, name)
    return frozen(joints)


def one_or_seven(name: str, value: ArrayLike) -> Floats:
    """Return seven numbers; a scalar applies to all joints."""
    numbers = as_floats(name, value)
    if numbers.ndim == 0:
        return np.full(JOINTS, float(numbers))
    if numbers.shape != (JOINTS,):
        raise InputError(f"{name} has shape {numbers.shape}, wanted ({JOINTS},), or a number for all joints")
    return numbers


def named(kind: type[AnyEnum]) -> dict[str, AnyEnum]:
    """Return the members of an enumeration by their names in lower case."""
    return {member.name.lower(): member for member in kind}


def chosen(name: str, value: str, options: Iterable[str]) -> str:
    """Return `value`, which must be one of the options, as a plain string."""
    listed = [*options]
    if not isinstance(value, str) or value not in listed:
        raise InputError(f"{name} is {value!r:.100}, wanted one of {', '.join(map(repr, listed))}")
    return listed[listed.index(value)]


def frozen(array: AnyArray) -> AnyArray:
    """Return the array after making it read-only."""
    array.setflags(write=False)
    return array


def as_gc(value: ArrayLike) -> Ints:
    """Return branch numbers as int64; their range is not checked here."""
    array = np.asarray(value)
    typed = array.size or hasattr(value, "dtype")  # an empty list has no type
    if array.dtype.kind not in "iu" and typed:
        raise InputError(f"gc has type {array.dtype}, wanted integers from 0 to 7")
    index: Ints = array.astype(np.int64, copy=False)
    return index if all(stride % 8 == 0 for stride in index.strides) else index.copy()


def as_codes(name: str, value: ArrayLike, count: int) -> Ints:
    """Return integers as int64; raise unless each is in 0..count - 1."""
    wanted = f"wanted integers from 0 to {count - 1}"
    try:
        given = np.asarray(value)
    except ValueError:  # a ragged list
        given = np.asarray(object())
    if given.dtype.kind not in "iu":
        nested = isinstance(value, Iterable) and not isinstance(value, str)
        raise InputError(f"{name} is {type(value).__name__ if nested else repr(value)[:40]}, {wanted}")
    wrong = given[(given < 0) | (given >= count)]
    if wrong.size:
        raise InputError(f"{name} is {wrong.flat[0]}, {wanted}")
    return given.astype(np.int64)


def one_branch(name: str, value: int) -> int:
    """Return one branch number, 0 to 7."""
    index = np.asarray(value)
    if index.dtype.kind not in "iu" or index.ndim or not 0 <= index < CONFIGURATIONS:
        raise InputError(f"{name} is {value!r:.50}, wanted an integer from 0 to 7")
    return int(index)


def number_in(text: str) -> float:
    """Return the number that a word of a file denotes, as in other programs; raise `ValueError` for no
    number.

    Only Python accepts 1_000, and digits of every script.
    """
    if "_" in text or not text.isascii():
        raise ValueError(f"could not convert string to float: {text!r:.50}")
    return float(text)


def hint_degrees(name: str, angles: Floats, most: float = _core.LIKELY_DEGREES) -> None:
    """Warn if the largest finite angle (rad) was probably given in degrees: it is larger than `most`, rad."""
    sizes = np.abs(angles)
    sizes = np.where(np.isfinite(sizes), sizes, 0.0)
    if sizes.max(initial=0.0) > most:
        verb = "holds" if sizes.ndim else "is"
        warn(f"{name} {verb} {angles.flat[sizes.argmax()]:g}, wanted rad: were these degrees?")


def as_whole(name: str, value: int, low: int, high: float, wanted: str = "") -> int:
    """Return an integer from `low` to `high`; raise for anything else, also for True and False."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or not low <= value <= high:
        raise InputError(f"{name} is {value!r:.100}, wanted {wanted or f'an integer from {low} to {high}'}")
    return int(value)


def as_number(name: str, value: float, low: float, high: float, *, low_open: bool = False) -> float:
    """Return `value` as a float within [low, high] (low excluded if `low_open`)."""
    wanted = f"a number in {'(' if low_open else '['}{low:g}, {high:g}]"
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} is {value!r:.50}, wanted {wanted}") from None
    if not low <= number <= high or (low_open and number == low):
        raise InputError(f"{name} is {number:g}, wanted {wanted}")
    return number


def check_angles(name: str, angles: Floats) -> None:
    """Raise if an angle (rad) is not finite or so large that rounding spoils it."""
    bad = ~(np.abs(angles) <= _core.LARGEST_ANGLE)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        value = float(angles[index])
        raise _bad_angle(f"{name}{list(index) if index else ''} is {value}", value)


def _bad_angle(what: str, value: float) -> ArmangleError:
    """Return the error of an angle that is not finite or too large."""
    if np.isfinite(value):
        return InputError(f"{what}, wanted an angle in rad within ±{_core.LARGEST_ANGLE:g}")
    return InputError(f"{what}, wanted finite angles in rad")


def shape_text(tail: Shape) -> str:
    """Return a shape with leading batch axes as text: (..., 4, 4)."""
    return f"({', '.join(['...', *map(str, tail)])})" if tail else "(...)"


def broadcast(named: Sequence[tuple[str, NDArray[Any], int]]) -> tuple[Shape, list[NDArray[Any]]]:
    """Return the common batch shape of (name, array, inner axes) and the arrays broadcast to it."""
    shapes = [array.shape[: array.ndim - inner] for _, array, inner in named]
    if shapes.count(shapes[0]) == len(shapes):
        return shapes[0], [array for _, array, _ in named]
    batches = [shape for shape in shapes if shape]
    if batches.count(batches[0]) == len(batches):
        return batches[0], [
            array if shape else _repeated(array, batches[0])
            for shape, (_, array, _) in zip(shapes, named, strict=True)
        ]
    try:
        batch = np.broadcast_shapes(*shapes)
    except ValueError:
        listed = ", ".join(f"{name} {shape}" for (name, _, _), shape in zip(named, shapes, strict=True))
        raise InputError(f"batch shapes do not broadcast: {listed}") from None
    out = []
    for _, array, inner in named:
        tail = array.shape[array.ndim - inner :]
        out.append(np.broadcast_to(array, batch + tail))
    return batch, out


def _repeated(element: NDArray[Any], batch: Shape) -> NDArray[Any]:
    """Return one element as a batch of equal ones, without copying it."""
    strides = (0,) * len(batch) + element.strides
    return np.ndarray(batch + element.shape, element.dtype, element, 0, strides)


def unwrap_known(psi: Floats) -> None:
    """Remove jumps by 2π between the finite arm angles (N,), rad, in place."""
    known = np.isfinite(psi)
    psi[known] = np.unwrap(psi[known])


def output(out: Floats | None, shape: Shape) -> Floats:
    """Return `out`, checked, or a new float64 array of `shape`."""
    if out is None:
        return np.empty(shape)
    ok = isinstance(out, np.ndarray) and out.dtype == np.float64 and out.shape == shape
    if not (ok and out.flags.c_contiguous and out.flags.writeable):
        raise InputError(f"out is no writable C-contiguous float64 array of shape {shape}")
    return out


def as_threads(threads: int) -> int:
    """Return a thread count: 1 or more, or 0 for all cores."""
    wanted = f"an integer: 0 for all cores, or 1 to {MOST_THREADS}"
    return as_whole("threads", threads, 0, MOST_THREADS, wanted)


def as_flag(name: str, value: object) -> bool:
    """Return True or False; rejects everything else."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} is {value!r}, wanted True or False")
    return bool(value)


_HINDRANCES = {
    1: "where the wrist lies so that its arm angle jumps",
    2: "where θ2 is 0 or π and joints 1 to 3 turn without bound",
    4: "where the elbow is stretched or folded and the joints turn without bound",
    6: "where θ6 is 0 or π and joints 5 to 7 turn without bound",
    7: "which has no solution",
    8: "where joints turn without bound (a fold, a straight elbow, or two joints on one axis)",
}


def _refusal(problem: Problem, name: str, index: Shape, value: float) -> ArmangleError:
    """Return the error of a problem that the core found in the argument `name`, with its batch index.

    Problems with psi and gc are found together with those of the pose, and have their own names.
    """
    branch = ""
    if name == "branch":  # row k of all eight
        name, index, branch = "pose", index[:-1], f", gc {index[-1]}"
    at = str(list(index)) if index else ""
    where = f"{name}{at}{branch}"
    match problem:
        case Problem.POSE_NOT_FINITE:
            return InputError(f"{where} holds {value}, wanted finite numbers")
        case Problem.POSE_LAST_ROW:
            return InputError(
                f"{where} has {value:g} in its last row, wanted 0 0 0 1: is the matrix transposed? "
                "The position belongs into the last column"
            )
        case Problem.POSE_NOT_ROTATION:
            return InputError(
                f"the rotation of {where} is not orthonormal: |RᵀR - I| is {value:.3g}, wanted at "
                f"most {_core.ROTATION_TOLERANCE:g}; armangle.nearest_rotation(pose) gives the nearest one"
            )
        case Problem.POSE_REFLECTION:
            return InputError(f"the rotation of {where} is a reflection: its determinant is -1")
        case Problem.POSE_TOO_FAR:
            return InputError(f"{where} lies {value:.3g} m away, wanted at most {_core.FARTHEST:g} m")
        case Problem.POSE_IN_MILLIMETRES:
            return InputError(
                f"{where} lies {value:.6g} m away, far beyond all lengths of the arm. "
                "Positions are in m: was this in mm?"
            )
        case Problem.PSI_NOT_FINITE:
            return _bad_angle(f"psi{at} is {value}", value)
        case Problem.GC_RANGE:
            return InputError(f"gc{at} is {int(value)}, wanted an integer from 0 to 7")
        case Problem.JOINTS_NOT_FINITE:
            return _bad_angle(f"{where} holds {value}", value)
        case Problem.JOINTS_IN_DEGREES:
            return InputError(
                f"{where} holds {value:g}, more than a turn outside the limits of its joint. "
                "Joints are in rad: were these degrees?"
            )
        case Problem.JOINT_LIMIT:
            return LimitError(f"joint {int(value)} of the solution of {where} is outside its limits")
        case Problem.FOLDED:
            return UnreachableError(
                f"the wrist of {where} lies on the shoulder: "
                "the arm is folded and the arm angle is not defined"
            )
        case Problem.STILL:
            return UnreachableError(f"the arm is stretched or folded at {where}: psi does not move its elbow")
        case Problem.ON_AXIS:
            return UnreachableError(
                f"every psi at {where} is as good: the point lies on the axis shoulder-wrist, or the "
                "direction along it"
            )
        case Problem.NOT_UNIT:
            order = " ".join(name)
            return InputError(
                f"{where} has length {value:.9g}, wanted a unit quaternion {order} "
                f"within {_core.UNIT_TOLERANCE:g}"
            )
        case Problem.UNREACHABLE:
            return UnreachableError(f"{where} is out of reach by {value * MILLIMETRES:.6g} mm")
        case Problem.ON_END:
            return UnreachableError(
                f"every psi at {where} is as good: the point lies on the shoulder, or on the wrist of an arm "
                "with an offset shoulder"
            )
        case Problem.NO_POSTURE:
            return UnreachableError(f"{where}: this branch has no solution there")
        case Problem.NEAR_SINGULAR | Problem.NO_CONVERGENCE:
            return NoSolutionError(
                f'{where}: {_core.Status[problem.name].sentence} on_error="nan" gives NaN there; '
                "solve(pose, seed=q) finds a solution if there is one."
            )
        case Problem.NO_DERIVATIVE:
            return UnreachableError(
                f"there is no gradient at {where}, {_HINDRANCES[int(value)]}: leave that element out of what "
                'is differentiated, or take NaN for it with on_error="nan"'
            )
    return ArmangleError(problem.name)


_core.on_refusal(_refusal)


def about_z(angles: ArrayLike) -> Floats:
    """Return the poses (..., 4, 4) that rotate about z by angles (...), rad."""
    turn = np.asarray(angles, dtype=np.float64)
    out = np.tile(np.eye(4), (*turn.shape, 1, 1))
    out[..., 0, 0] = out[..., 1, 1] = np.cos(turn)
    out[..., 1, 0] = np.sin(turn)
    out[..., 0, 1] = -out[..., 1, 0]
    return out


def warn(text: str) -> None:
    """Give a warning that points at the line outside this package that called it."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("armangle"):
        level, frame = level + 1, frame.f_back
    warnings.warn(shortened(text), UserWarning, stacklevel=level)
