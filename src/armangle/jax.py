"""The kinematics as functions of JAX, on the CPU: under jit, vmap, scan, grad and jvp.

The core computes the numbers, called by XLA without Python in between. Results have the dtype of the
arguments; the arithmetic is in float64, also if JAX uses its default float32.

A compiled function cannot raise for its numbers. If the geometry has no solution, or numbers are not finite,
the result is NaN, as usual in JAX. A matrix that is not a rigid transform, and a gc outside 0..7, end the
computation with XLA's error and the reason.

A derivative by a pose is along rigid motions: tangents of the (..., 4, 4) matrix are projected onto them, and
gradients lie along them. A requested derivative that does not exist is NaN: for joints 1-3 (5-7) if θ2 (θ6)
is 0 or π; by the pose for all joints if the elbow is stretched or folded, and for all but joint 4 if psi
jumps; with an offset for all but the free joint, as at a fold. Results that the loss does not use have no
effect. There is no second derivative.

Examples
--------
>>> import armangle as aa, jax, jax.numpy as jnp
>>> arm = aa.jax.Kinematics(aa.Arm.from_catalogue("kuka_iiwa7_r800"))
>>> q = jnp.array([0.1, 1.4, 0.2, -0.9, 0.3, 0.8, 0.5])
>>> pose, psi, gc = jax.jit(arm.forward)(q)
>>> slope = jax.grad(lambda psi: arm.limit_margin(arm.inverse(pose, psi, gc)))(psi)
>>> round(float(slope), 3)                                       # which way psi leads from the nearest limit
-0.086
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from . import _core
from ._arrays import JOINTS, shape_text
from ._kept import Kept, common_batch
from .errors import InputError, MissingExtraError, needed

__all__ = ["Kinematics"]

Array: TypeAlias = Any  # jax.Array, known to type checkers only if jax is installed

jax = needed("jax", "armangle.jax needs", "jax")
if not hasattr(jax, "ffi"):
    raise MissingExtraError(f"armangle.jax needs jax 0.5 or newer, this is {jax.__version__}")
jnp = needed("jax.numpy", "armangle.jax needs", "jax")
needed("jax.extend.core", "armangle.jax needs", "jax")
ad = needed("jax.interpreters.ad", "armangle.jax needs", "jax")
batching = needed("jax.interpreters.batching", "armangle.jax needs", "jax")
mlir = needed("jax.interpreters.mlir", "armangle.jax needs", "jax")

for _name, _target in _core.xla_targets().items():
    jax.ffi.register_ffi_target(f"armangle_{_name}", _target, platform="cpu")


@dataclass(frozen=True)
class Kinematics(Kept):
    """An arm whose functions take and return JAX arrays.

    Attributes
    ----------
    arm : Arm
        Of any kind. It is kept for the lifetime of the process, because compiled functions may use it. The
        arm angle of an arm with an offset wrist or shoulder is the value of its free joint.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        self.arm._handle.keep(self._key)

    def forward(self, q: Array) -> tuple[Array, Array, Array]:
        """Return pose, arm angle and global configuration of joint values, as `Arm.forward`.

        Parameters
        ----------
        q : Array, shape (..., 7)
            Joint values, rad.

        Returns
        -------
        pose : Array, shape (..., 4, 4)
            Pose of the end effector, position in m.
        psi : Array, shape (...)
            Arm angle in (-π, π], rad; NaN if it does not exist.
        gc : Array of int32, shape (...)
            Global configuration 0..7.

        Raises
        ------
        InputError
        """
        pose, psi, gc = _forward(self._key, _array("q", q, (JOINTS,)))
        return pose, psi, gc

    def inverse(self, pose: Array, psi: Array, gc: Array) -> Array:
        """Return the one configuration that a pose, an arm angle and a global configuration define.

        Parameters
        ----------
        pose : Array, shape (..., 4, 4)
            Pose of the end effector, position in m.
        psi : Array, shape (...)
            Arm angle, rad.
        gc : Array of integers, shape (...)
            Global configuration 0..7.

        Returns
        -------
        Array, shape (..., 7)
            Joint values, rad, in the dtype of `pose`; NaN out of reach. Limits are not enforced: see
            `limit_margin`.

        Raises
        ------
        InputError
        """
        poses = _array("pose", pose, (4, 4))
        angles, branches = _array("psi", psi, ()).astype(poses.dtype), jnp.asarray(gc)
        if not jnp.issubdtype(branches.dtype, jnp.integer):
            raise InputError(f"gc has type {branches.dtype}, wanted integers from 0 to 7")
        shapes = {"pose": poses.shape[:-2], "psi": angles.shape, "gc": branches.shape}
        batch = common_batch(jnp.broadcast_shapes, **shapes)
        return _inverse(
            self._key,
            jnp.broadcast_to(poses, (*batch, 4, 4)),
            jnp.broadcast_to(angles, batch),
            jnp.broadcast_to(branches.astype(jnp.int32), batch),
        )

    def _solve(self, pose: Array, seed: Array | None) -> tuple[Array, Array, Array]:
        """See `Kept.solve`."""
        poses = _array("pose", pose, (4, 4))
        seeds = jnp.zeros(JOINTS, poses.dtype) if seed is None else _array("seed", seed, (JOINTS,))
        batch = common_batch(jnp.broadcast_shapes, pose=poses.shape[:-2], seed=seeds.shape[:-1])
        what = (self._key, self.arm.singularity_margin, "solve_margin" if seed is None else "solve")
        given = jnp.broadcast_to(poses, (*batch, 4, 4)), jnp.broadcast_to(seeds, (*batch, JOINTS))
        q, psi, gc = _solve(what, given[0], given[1].astype(poses.dtype))
        return q, psi, gc

    def _freedom(self, pose: Array) -> Array:
        """See `Kept.freedom`."""
        return _freedom((self._key, self.arm.singularity_margin), _array("pose", pose, (4, 4)))

    def _limit_margin(self, q: Array) -> Array:
        """See `Kept.limit_margin`."""
        return _limit_margin(self._key, _array("q", q, (JOINTS,)))


def _array(name: str, value: Any, tail: tuple[int, ...]) -> Array:
    """Return an array of float32 or float64 of shape (..., *tail)."""
    try:
        array = jnp.asarray(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} is not an array of real numbers, wanted shape {shape_text(tail)}") from None
    if jnp.issubdtype(array.dtype, jnp.integer):
        array = array.astype(float)
    if array.dtype not in (np.float32, np.float64):
        raise InputError(f"{name} has type {array.dtype}, wanted float32 or float64")
    if array.ndim < len(tail) or array.shape[array.ndim - len(tail) :] != tail:
        raise InputError(f"{name} has shape {array.shape}, wanted {shape_text(tail)}")
    return array


def _call(name: str, key: int, shapes: Any, *given: Array, margin: float = 0.0) -> Any:
    """Return the results of a handler of the core; `shapes` are (shape, dtype) of each result."""
    results = tuple(jax.ShapeDtypeStruct(shape, dtype) for shape, dtype in shapes)
    function = jax.ffi.ffi_call(f"armangle_{name}", results, vmap_method="broadcast_all")
    found = function(*given, arm=np.int64(key), margin=np.float64(margin))
    return found if len(found) > 1 else found[0]


class _LinearMap:
    """A linear function of its last arguments, and its transpose, given as two functions.

    Neither lets unused results have an effect, however steep they are: a matrix product would turn 0 times
    infinity into NaN. All arguments and results have the same leading batch axes. JAX's own
    `custom_derivatives.linear_call` would serve, but does not support vmap.
    """

    def __init__(self, name: str, fixed: int, push: Any, pull: Any) -> None:
        """Keep the function `push`, its transpose `pull`, and how many leading arguments are not linear."""
        self._name, self._fixed, self._push, self._pull = name, fixed, push, pull

    @functools.cached_property
    def _primitive(self) -> Any:
        """The primitive of JAX, registered on first use."""
        made = jax.extend.core.Primitive(f"armangle_{self._name}")
        made.multiple_results = True
        made.def_impl(self._push)
        made.def_abstract_eval(lambda *given, **about: jax.make_jaxpr(
            functools.partial(self._push, **about))(*given).out_avals)  # fmt: skip
        mlir.register_lowering(made, mlir.lower_fun(self._push, multiple_results=True))
        batching.primitive_batchers[made] = self._mapped
        ad.primitive_transposes[made] = self._transposed
        return made

    def __call__(self, *given: Array, **about: Any) -> list[Array]:
        return list(self._primitive.bind(*given, **about))

    def _mapped(self, given: Any, axes: Any, **about: Any) -> Any:
        """Return the results for arguments with a batch axis (the rule of vmap)."""
        size = next(x.shape[axis] for x, axis in zip(given, axes, strict=True) if axis is not None)
        whole = [
            jnp.broadcast_to(x, (size, *x.shape)) if axis is None else jnp.moveaxis(x, axis, 0)
            for x, axis in zip(given, axes, strict=True)
        ]
        found = self._primitive.bind(*whole, **about)
        return found, [0] * len(found)

    def _transposed(self, changes: Any, *given: Any, **about: Any) -> Any:
        """Return the transpose applied to the cotangents (the rule of reverse mode)."""
        if all(type(change) is ad.Zero for change in changes):
            return [None] * len(given)
        back = [ad.instantiate_zeros(change) for change in changes]
        return [None] * self._fixed + list(self._pull(*given[: self._fixed], *back, **about))


def _forward_push(q: Array, dq: Array, *, key: int) -> list[Array]:
    """Return the changes of pose and psi for a change dq."""
    batch = q.shape[:-1]
    return list(_call("forward_push", key, [((*batch, 4, 4), q.dtype), (batch, q.dtype)], q, dq))


def _forward_pull(q: Array, by_pose: Array, by_psi: Array, *, key: int) -> list[Array]:
    """Return the gradient by q for gradients by pose and by psi."""
    return [_call("forward_pull", key, [(q.shape, q.dtype)], q, by_pose, by_psi)]


def _inverse_push(
    pose: Array, psi: Array, gc: Array, moved: Array, turned: Array, *, key: int
) -> list[Array]:
    """Return the change of q for the changes `moved` of pose and `turned` of psi."""
    shape = (*psi.shape, JOINTS)
    return [_call("inverse_push", key, [(shape, pose.dtype)], pose, psi, gc, moved, turned)]


def _inverse_pull(pose: Array, psi: Array, gc: Array, by_q: Array, *, key: int) -> list[Array]:
    """Return the gradients by pose and psi for a gradient by q."""
    shapes = [(pose.shape, pose.dtype), (psi.shape, pose.dtype)]
    return list(_call("inverse_pull", key, shapes, pose, psi, gc, by_q))


def _product_push(slope: Array, change: Array) -> list[Array]:
    """Return the sum of slope times change over the last axis; 0 times infinity counts as 0."""
    return [jnp.where(change == 0, 0, slope * change).sum(-1)]


def _product_pull(slope: Array, by: Array) -> list[Array]:
    """Return the gradient by the change; 0 times infinity counts as 0."""
    return [jnp.where(by[..., None] == 0, 0, slope * by[..., None])]


_forward_map = _LinearMap("forward_push", 1, _forward_push, _forward_pull)
_inverse_map = _LinearMap("inverse_push", 3, _inverse_push, _inverse_pull)
_product_map = _LinearMap("product", 1, _product_push, _product_pull)


def _twist(pose: Array, moved: Array) -> Array:
    """Return the twist (v, ω), m and rad, of a change of a pose: v = dp, ω from dR Rᵀ."""
    turned = moved[..., :3, :3] @ jnp.swapaxes(pose[..., :3, :3], -1, -2)
    skew = 0.5 * (turned - jnp.swapaxes(turned, -1, -2))
    omega = jnp.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    return jnp.concatenate([moved[..., :3, 3], omega], axis=-1)


def _forward_value(key: int, q: Array) -> Any:
    """Return pose, psi and gc of joints."""
    batch = q.shape[:-1]
    shapes = (((*batch, 4, 4), q.dtype), (batch, q.dtype), (batch, np.int32))
    return _call("forward", key, shapes, q)


def _forward_jvp(key: int, given: Any, changes: Any) -> Any:
    """Return pose, psi and gc, and their changes for a change of q."""
    (q,), (dq,) = given, changes
    pose, psi, gc = _forward(key, q)
    none = np.zeros(gc.shape, jax.dtypes.float0)
    return (pose, psi, gc), (*_forward_map(q, dq, key=key), none)


def _inverse_value(key: int, pose: Array, psi: Array, gc: Array) -> Any:
    """Return joints of poses, arm angles and branches."""
    return _call("inverse", key, [((*psi.shape, JOINTS), pose.dtype)], pose, psi, gc)


def _inverse_jvp(key: int, given: Any, changes: Any) -> Any:
    """Return joints and their change for changes of pose and psi."""
    (dq,) = _inverse_map(*given, *changes[:2], key=key)
    return _inverse(key, *given), dq


def _solve_value(what: tuple[int, float, str], pose: Array, seed: Array) -> Any:
    """Return q, psi and gc of the solution for each pose; `what` is (arm's key, margin (rad), handler)."""
    key, margin, name = what
    batch = pose.shape[:-2]
    shapes = (((*batch, JOINTS), pose.dtype), (batch, pose.dtype), (batch, np.int32))
    return _call(name, key, shapes, pose, seed, margin=margin)


def _solve_jvp(what: tuple[int, float, str], given: Any, changes: Any) -> Any:
    """Return the solution and the change of its joints for changes of pose and seed."""
    (pose, seed), (moved, dseed) = given, changes
    key, margin, name = what
    q, psi, gc = _solve(what, pose, seed)
    shapes = [((*psi.shape, JOINTS, 6 + JOINTS), pose.dtype)]
    slope = _call(f"{name}_derivative", key, shapes, pose, seed, margin=margin)
    change = jnp.concatenate([_twist(pose, moved), dseed], axis=-1)
    rows = jnp.broadcast_to(change[..., None, :], slope.shape)
    (dq,) = _product_map(slope, rows)
    return (q, psi, gc), (dq, jnp.zeros_like(psi), np.zeros(gc.shape, jax.dtypes.float0))


def _freedom_value(what: tuple[int, float], pose: Array) -> Any:
    """Return the total length of the feasible intervals of each pose, rad, over all branches.

    `what` is (arm's key, singularity margin in rad).
    """
    key, margin = what
    return _call("freedom", key, [(pose.shape[:-2], pose.dtype)], pose, margin=margin)


def _freedom_jvp(what: tuple[int, float], given: Any, changes: Any) -> Any:
    """Return the freedom and its change for a change of pose."""
    (pose,), (moved,) = given, changes
    key, margin = what
    slope = _call("freedom_gradient", key, [((*pose.shape[:-2], 6), pose.dtype)], pose, margin=margin)
    return _freedom(what, pose), _product_map(slope, _twist(pose, moved))[0]


def _limit_margin_value(key: int, q: Array) -> Any:
    """Return the distance to the nearest joint limit, rad."""
    return _call("limit_margin", key, [(q.shape[:-1], q.dtype)], q)


def _limit_margin_jvp(key: int, given: Any, changes: Any) -> Any:
    """Return the limit margin and its change for a change of q."""
    (q,), (dq,) = given, changes
    slope = _call("limit_margin_gradient", key, [(q.shape, q.dtype)], q)
    return _limit_margin(key, q), _product_map(slope, dq)[0]


_forward = jax.custom_jvp(_forward_value, nondiff_argnums=(0,))
_forward.defjvp(_forward_jvp)
_inverse = jax.custom_jvp(_inverse_value, nondiff_argnums=(0,))
_inverse.defjvp(_inverse_jvp)
_solve = jax.custom_jvp(_solve_value, nondiff_argnums=(0,))
_solve.defjvp(_solve_jvp)
_freedom = jax.custom_jvp(_freedom_value, nondiff_argnums=(0,))
_freedom.defjvp(_freedom_jvp)
_limit_margin = jax.custom_jvp(_limit_margin_value, nondiff_argnums=(0,))
_limit_margin.defjvp(_limit_margin_jvp)
