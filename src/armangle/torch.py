"""The kinematics as operators of torch, on the CPU, with gradients: needs torch 2.4 or newer.

The core computes the numbers; torch adds autograd, ``torch.compile`` without a graph break, and
``torch.func.vmap``. Results have the dtype of the arguments; the arithmetic is in float64.

A gradient by a pose is a (..., 4, 4) tensor, and only its part along rigid motions is meaningful. Chained
through the computation of the pose, it gives the right gradient; added to the pose it leaves the rigid
motions. There is no second derivative.

Examples
--------
>>> import armangle as aa, torch
>>> arm = aa.torch.Kinematics(aa.Arm.from_catalogue("kuka_iiwa7_r800"))
>>> q = torch.tensor([0.1, 1.4, 0.2, -0.9, 0.3, 0.8, 0.5], dtype=torch.float64)
>>> pose, psi, gc = arm.forward(q)
>>> psi.requires_grad_()
tensor(0.2046, dtype=torch.float64, requires_grad=True)
>>> arm.limit_margin(arm.inverse(pose, psi, gc)).backward()     # which way psi leads from the nearest limit
>>> psi.grad
tensor(-0.0864, dtype=torch.float64)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from . import _core, gradients
from ._arrays import JOINTS, as_floats, as_poses, chosen, shape_text
from ._kept import Kept, common_batch, kept
from .arm.arm import ON_ERROR, OnError
from .errors import InputError, MissingExtraError, needed

__all__ = ["Kinematics"]

Tensor: TypeAlias = Any  # torch.Tensor, known to type checkers only if torch is installed

torch = needed("torch", "armangle.torch needs", "torch")
if not hasattr(torch.library, "custom_op"):
    raise MissingExtraError(f"armangle.torch needs torch 2.4 or newer, this is {torch.__version__}")


@dataclass(frozen=True)
class Kinematics(Kept):
    """An arm whose functions take and return tensors, with gradients.

    Attributes
    ----------
    arm : Arm
        Of any kind. It is kept for the lifetime of the process, because compiled functions may use it. The
        arm angle of an arm with an offset wrist or shoulder is the value of its free joint.
    """

    def forward(self, q: Tensor, *, on_error: OnError = "raise") -> tuple[Tensor, Tensor, Tensor]:
        """Return pose, arm angle and global configuration of joint values, as `Arm.forward`.

        Parameters
        ----------
        q : Tensor, shape (..., 7)
            Joint values, rad.
        on_error : "raise" or "nan"
            What to do if the arm angle does not exist, or its gradient is requested where it jumps. The
            gradient of the pose exists everywhere.

        Returns
        -------
        pose : Tensor, shape (..., 4, 4)
            Pose of the end effector, position in m.
        psi : Tensor, shape (...)
            Arm angle in (-π, π], rad.
        gc : Tensor of int64, shape (...)
            Global configuration 0..7; it has no gradient.

        Raises
        ------
        InputError, UnreachableError
        """
        nan = chosen("on_error", on_error, ON_ERROR) == "nan"
        pose, psi, gc = torch.ops.armangle.forward(_joints(q), self._key, nan)
        return pose, psi, gc

    def inverse(self, pose: Tensor, psi: Tensor, gc: Tensor | int, *, on_error: OnError = "raise") -> Tensor:
        """Return the one configuration that a pose, an arm angle and a global configuration define.

        Parameters
        ----------
        pose : Tensor, shape (..., 4, 4)
            Pose of the end effector, position in m.
        psi : Tensor, shape (...)
            Arm angle, rad.
        gc : Tensor of integers, shape (...), or int
            Global configuration 0..7.
        on_error : "raise" or "nan"
            What to do if the geometry has no solution, or a requested gradient does not exist: that of joints
            1-3 (5-7) if θ2 (θ6) is 0 or π, and by the pose that of all joints if the elbow is stretched or
            folded and of all but joint 4 if psi jumps; with an offset that of all but the free joint, as at a
            fold. "raise" raises UnreachableError in `backward`, "nan" makes the gradient of that element NaN.

        Returns
        -------
        Tensor, shape (..., 7)
            Joint values, rad, in the dtype of `pose`; limits are not enforced, see `limit_margin`. A joint or
            an element that the loss does not use has no effect, whatever its gradient.

        Raises
        ------
        InputError, UnreachableError
        """
        nan = chosen("on_error", on_error, ON_ERROR) == "nan"
        poses, angles = _tensor("pose", pose, (4, 4)), _tensor("psi", psi, (), of=pose)
        branches = torch.as_tensor(gc)
        if branches.is_floating_point() or branches.is_complex() or branches.dtype == torch.bool:
            raise InputError(f"gc has type {branches.dtype}, wanted integers from 0 to 7")
        if poses.shape[:-2] == angles.shape == branches.shape and branches.dtype == torch.int64:
            return torch.ops.armangle.inverse(poses, angles, branches, self._key, nan)
        shapes = {"pose": poses.shape[:-2], "psi": angles.shape, "gc": branches.shape}
        batch = common_batch(torch.broadcast_shapes, **shapes)
        given = poses.expand(*batch, 4, 4), angles.expand(batch), branches.to(torch.int64).expand(batch)
        return torch.ops.armangle.inverse(*given, self._key, nan)

    def _solve(self, pose: Tensor, seed: Tensor | None) -> tuple[Tensor, Tensor, Tensor]:
        """See `Kept.solve`."""
        poses = _tensor("pose", pose, (4, 4))
        seeds = poses.new_zeros(JOINTS) if seed is None else _joints(seed)
        batch = common_batch(torch.broadcast_shapes, pose=poses.shape[:-2], seed=seeds.shape[:-1])
        given = poses.expand(*batch, 4, 4), seeds.expand(*batch, JOINTS)
        q, psi, gc = torch.ops.armangle.solve(*given, self._key, seed is None)
        return q, psi, gc

    def _freedom(self, pose: Tensor) -> Tensor:
        """See `Kept.freedom`."""
        return torch.ops.armangle.freedom(_tensor("pose", pose, (4, 4)), self._key)

    def _limit_margin(self, q: Tensor) -> Tensor:
        """See `Kept.limit_margin`."""
        return torch.ops.armangle.limit_margin(_joints(q), self._key)


def _tensor(name: str, value: Tensor, tail: tuple[int, ...], of: Tensor = None) -> Tensor:
    """Return a tensor of real numbers of shape (..., *tail) in memory; numbers too if `of` is given."""
    if of is not None and isinstance(value, (int, float)):
        value = torch.as_tensor(value, dtype=of.dtype)
    if not isinstance(value, torch.Tensor):
        raise InputError(f"{name} is {type(value).__name__}, wanted a torch.Tensor")
    if value.dtype not in (torch.float64, torch.float32):
        raise InputError(f"{name} has type {value.dtype}, wanted torch.float64 or torch.float32")
    if value.device.type != "cpu":
        raise InputError(f"{name} is a tensor on {value.device}, wanted numbers in memory: {name}.cpu()")
    if value.ndim < len(tail) or tuple(value.shape[value.ndim - len(tail) :]) != tail:
        raise InputError(f"{name} has shape {tuple(value.shape)}, wanted {shape_text(tail)}")
    return value


def _joints(q: Tensor) -> Tensor:
    """Return joints as a checked tensor (..., 7)."""
    return _tensor("q", q, (7,))


# -- the operators -------------------------------------------------------------------------------------


def _given(tensor: Tensor) -> Any:
    """Return the numbers of a tensor as an array."""
    return tensor.detach().numpy()


def _double(tensor: Tensor, inner: int = 0) -> Any:
    """Return the numbers of a tensor as float64, with its `inner` last axes contiguous."""
    return as_floats("gradient", _given(tensor), tuple(tensor.shape[tensor.ndim - inner :]))


def _as(dtype: Any, array: Any) -> Tensor:
    """Return an array as a contiguous tensor of this type."""
    return torch.as_tensor(array).to(dtype).contiguous()


def _how(nan: bool) -> OnError:
    """Return the word of `on_error` for a flag."""
    return "nan" if nan else "raise"


def _forward(q: Tensor, arm: int, nan: bool) -> tuple[Tensor, Tensor, Tensor]:
    """Return pose, psi and gc of joints; `arm` is a key of `kept`."""
    pose, psi, gc = kept(arm).forward(_given(q), on_error=_how(nan))
    return _as(q.dtype, pose), _as(q.dtype, psi), torch.as_tensor(gc)


def _forward_pullback(q: Tensor, by_pose: Tensor, by_psi: Tensor, arm: int, nan: bool) -> Tensor:
    """Return the gradient by q for gradients by pose and by psi."""
    out = np.empty(q.shape)
    kept(arm)._handle.forward_pullback_many(_double(q, 1), _double(by_pose, 2), _double(by_psi), out, nan)
    return _as(q.dtype, out)


def _inverse(pose: Tensor, psi: Tensor, gc: Tensor, arm: int, nan: bool) -> Tensor:
    """Return joints of poses, arm angles and branches."""
    given = _given(pose), _given(psi), _given(gc)
    return _as(pose.dtype, kept(arm).inverse(*given, limits=False, on_error=_how(nan)))


def _inverse_pullback(
    pose: Tensor, psi: Tensor, gc: Tensor, by_q: Tensor, arm: int, nan: bool
) -> tuple[Tensor, Tensor]:
    """Return the gradients by pose and psi for a gradient by q."""
    known = kept(arm)
    by_pose, by_psi = np.empty(pose.shape), np.empty(psi.shape)
    poses = as_poses("pose", _given(pose), known._handle)
    given = poses, _double(psi), _given(gc), _double(by_q, 1)
    known._handle.inverse_pullback_many(*given, by_pose, by_psi, nan)
    return _as(pose.dtype, by_pose), _as(psi.dtype, by_psi)


def _freedom(pose: Tensor, arm: int) -> Tensor:
    """Return the total length of the feasible intervals of each pose, rad."""
    return _as(pose.dtype, kept(arm).freedom(_given(pose)).total)


def _freedom_pullback(pose: Tensor, by_total: Tensor, arm: int) -> Tensor:
    """Return the gradient by pose for a gradient by the freedom."""
    known, poses = kept(arm), as_poses("pose", _given(pose), kept(arm)._handle)
    steepness = _double(by_total)[..., None]
    slope = gradients.freedom(known, poses)
    by_pose = np.empty(poses.shape)
    _core.pose_gradient_many(poses, np.where(steepness == 0, 0.0, steepness * slope), by_pose)
    return _as(pose.dtype, by_pose)


def _solve(pose: Tensor, seed: Tensor, arm: int, widest: bool) -> tuple[Tensor, Tensor, Tensor]:
    """Return q, psi and gc of the solution for each pose."""
    found = kept(arm).solve(_given(pose), None if widest else _given(seed))
    q, psi, gc = (np.asarray(column) for column in (found.q, found.psi, found.gc))
    return _as(pose.dtype, q), _as(pose.dtype, psi), torch.as_tensor(gc)


def _solve_pullback(
    pose: Tensor, seed: Tensor, by_q: Tensor, arm: int, widest: bool
) -> tuple[Tensor, Tensor]:
    """Return the gradients by pose and seed for a gradient by q."""
    known, change = kept(arm), _double(by_q, 1)[..., None]
    poses = as_poses("pose", _given(pose), known._handle)
    slopes = gradients.solve(known, poses, None if widest else _given(seed))
    by = np.where(change == 0, 0.0, change * slopes).sum(-2)
    by_pose = np.empty(poses.shape)
    _core.pose_gradient_many(poses, np.ascontiguousarray(by[..., :6]), by_pose)
    return _as(pose.dtype, by_pose), _as(seed.dtype, by[..., 6:])


def _limit_margin(q: Tensor, arm: int) -> Tensor:
    """Return the distance to the nearest joint limit, rad."""
    return _as(q.dtype, kept(arm).limit_margin(_given(q)))


def _limit_margin_pullback(q: Tensor, by_margin: Tensor, arm: int) -> Tensor:
    """Return the gradient by q for a gradient by the limit margin."""
    return _as(q.dtype, _double(by_margin)[..., None] * gradients.limit_margin(kept(arm), _given(q)))


def _define(name: str, schema: str, function: Any, shapes: Any) -> Any:
    """Define and return an operator: its CPU function, its shapes for tracing, and its rule for vmap."""
    operator = torch.library.custom_op(f"armangle::{name}", function, mutates_args=(), schema=schema)

    def mapped(info: Any, axes: Any, *given: Any) -> Any:
        """Return the results for arguments with a batch axis (the rule of vmap)."""
        moved = [
            value if not isinstance(value, torch.Tensor)
            else value.expand(info.batch_size, *value.shape) if axis is None
            else value.movedim(axis, 0)
            for value, axis in zip(given, axes, strict=True)
        ]  # fmt: skip
        found = operator(*moved)
        return found, (0,) * len(found) if isinstance(found, tuple) else 0

    operator.register_fake(shapes)
    operator.register_vmap(mapped)
    return operator


def _differentiate(operator: Any, pullback: Any, undefined: tuple[int, ...] = ()) -> None:
    """Define the gradient of an operator, whose arguments are tensors and then numbers.

    `pullback` is an operator of the same tensors, the gradients by the results and the same numbers; it
    returns the gradients by the first tensors. Results `undefined` have no gradient.
    """

    def keep(ctx: Any, inputs: Any, output: Any) -> None:
        """Keep what the gradient needs."""
        tensors = [value for value in inputs if isinstance(value, torch.Tensor)]
        ctx.numbers = inputs[len(tensors) :]
        ctx.save_for_backward(*tensors)
        if undefined:
            ctx.mark_non_differentiable(*(output[k] for k in undefined))

    def backward(ctx: Any, *by: Tensor) -> Any:
        """Return the gradients by all arguments."""
        tensors = ctx.saved_tensors
        found = pullback(*tensors, *(x for k, x in enumerate(by) if k not in undefined), *ctx.numbers)
        every = found if isinstance(found, tuple) else (found,)
        return (*every, *[None] * (len(tensors) + len(ctx.numbers) - len(every)))

    operator.register_autograd(backward, setup_context=keep)


def _like(k: int) -> Any:
    """Return a function that gives an empty tensor like its argument k."""
    return lambda *given: torch.empty_like(given[k], memory_format=torch.contiguous_format)


def _tail(inner: int, *tail: int) -> Any:
    """Return a function that gives an empty tensor: batch axes of its first argument, then shape `tail`."""
    return lambda lead, *_: lead.new_empty((*lead.shape[: lead.ndim - inner], *tail))


def _three(inner: int, *tail: int) -> Any:
    """Return a function that gives an empty tensor as `_tail` does, and empty psi and gc beside it."""
    first = _tail(inner, *tail)

    def shapes(lead: Tensor, *_: Any) -> Any:
        """Return the three tensors."""
        batch = lead.shape[: lead.ndim - inner]
        return first(lead), lead.new_empty(batch), lead.new_empty(batch, dtype=torch.int64)

    return shapes


def _pulled_shapes(pose: Tensor, other: Tensor, *_: Any) -> Any:
    """Return empty gradients by two tensors."""
    return _like(0)(pose), _like(0)(other)


_differentiate(
    _define(
        "forward", "(Tensor q, int arm, bool nan) -> (Tensor, Tensor, Tensor)", _forward, _three(1, 4, 4)
    ),
    _define(
        "forward_pullback", "(Tensor q, Tensor by_pose, Tensor by_psi, int arm, bool nan) -> Tensor",
        _forward_pullback, _like(0),
    ),
    undefined=(2,),
)  # fmt: skip
_differentiate(
    _define(
        "inverse", "(Tensor pose, Tensor psi, Tensor gc, int arm, bool nan) -> Tensor", _inverse, _tail(2, 7)
    ),
    _define(
        "inverse_pullback",
        "(Tensor pose, Tensor psi, Tensor gc, Tensor by_q, int arm, bool nan) -> (Tensor, Tensor)",
        _inverse_pullback, _pulled_shapes,
    ),
)  # fmt: skip
_differentiate(
    _define(
        "solve", "(Tensor pose, Tensor seed, int arm, bool widest) -> (Tensor, Tensor, Tensor)",
        _solve, _three(2, 7),
    ),
    _define(
        "solve_pullback", "(Tensor pose, Tensor seed, Tensor by_q, int arm, bool widest) -> (Tensor, Tensor)",
        _solve_pullback, _pulled_shapes,
    ),
    undefined=(1, 2),
)  # fmt: skip
_differentiate(
    _define("freedom", "(Tensor pose, int arm) -> Tensor", _freedom, _tail(2)),
    _define(
        "freedom_pullback", "(Tensor pose, Tensor by_total, int arm) -> Tensor", _freedom_pullback, _like(0)
    ),
)
_differentiate(
    _define("limit_margin", "(Tensor q, int arm) -> Tensor", _limit_margin, _tail(1)),
    _define(
        "limit_margin_pullback", "(Tensor q, Tensor by_margin, int arm) -> Tensor",
        _limit_margin_pullback, _like(0),
    ),
)  # fmt: skip
