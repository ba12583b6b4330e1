"""Arms by an integer key, for operators of torch and XLA, which cannot take objects.

`Kept` is the common base class of both.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np

from ._arrays import chosen
from .arm.arm import Arm, check_arm
from .errors import InputError, UnsupportedError
from .models.description import ELBOW_OFFSETS, END_OFFSETS, LENGTHS

Array: TypeAlias = Any  # a torch.Tensor or a jax.Array, known to type checkers only if installed

_ARMS: dict[int, Arm] = {}


def keep(arm: Arm) -> int:
    """Keep an arm for the lifetime of the process and return its key, the same in every process.

    Compiled functions hold the key. In a process that does not know it, they fail instead of using another
    arm.
    """
    check_arm(arm)
    lengths = [getattr(arm.geometry, name) for name in (*LENGTHS, *ELBOW_OFFSETS, *END_OFFSETS)]
    parts = [
        [*lengths, arm.singularity_margin],
        arm.geometry.signs,
        arm.geometry.offsets,
        arm.lower,
        arm.upper,
        arm.base.ravel(),
        arm.tool.ravel(),
        np.ravel([] if arm.geometry.chain is None else arm.geometry.chain),
    ]
    numbers = np.concatenate([np.asarray(part, dtype=np.float64) for part in parts])
    digest = hashlib.sha256(numbers.tobytes() + repr(arm.geometry.reference).encode()).digest()
    key = int.from_bytes(digest[:8], "little") >> 1  # fits into a signed integer of 64 bits
    _ARMS.setdefault(key, arm)
    return key


def kept(key: int) -> Arm:
    """Return the arm of a key; raise if this process has not kept one."""
    arm = _ARMS.get(key)
    if arm is None:
        raise InputError(
            "this process does not know the arm of a compiled function: make its Kinematics first"
        )
    return arm


def common_batch(broadcast: Callable[..., Any], **shapes: Any) -> Any:
    """Return the batch shape of arguments, by a library's own function; raise if there is none."""
    try:
        return broadcast(*shapes.values())
    except (RuntimeError, ValueError):
        listed = ", ".join(f"{name} {tuple(shape)}" for name, shape in shapes.items())
        raise InputError(f"batch shapes do not broadcast: {listed}") from None


@dataclass(frozen=True)
class Kept:
    """An arm whose functions take and return arrays of another library."""

    arm: Arm
    _key: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_key", keep(self.arm))

    def solve(
        self, pose: Array, seed: Array | None = None, *, prefer: Literal["seed", "margin"] = "seed"
    ) -> tuple[Array, Array, Array, Array]:
        """Return the solution of `Arm.solve`, with the derivative of its joints.

        The derivative follows one solution. The solution jumps where another branch, arm angle or turn is
        equally good, and its slope changes where a joint reaches a limit: there the derivative is that of the
        solution returned. It is NaN at a shoulder, elbow or wrist singularity, and if nothing determines the
        arm angle, for example if joint 4 alone decides the largest margin.

        Parameters
        ----------
        pose : array, shape (..., 4, 4)
            Pose of the end effector, position in m.
        seed : array, shape (..., 7), optional
            Present joint values, rad. Without it `prefer` is "margin".
        prefer : "seed" or "margin"
            Nearest to the seed, or the largest distance to the nearest joint limit.

        Returns
        -------
        q : array, shape (..., 7)
            Joint values, rad, within the limits; NaN without a solution.
        psi : array, shape (...)
            Arm angle, rad; it has no derivative (that of ``forward(q)`` has).
        gc : array of integers, shape (...)
            Global configuration 0..7, -1 without a solution.
        ok : array of bool, shape (...)
            Whether there is a solution.

        Raises
        ------
        InputError, UnsupportedError
            UnsupportedError for an arm with a scene.
        """
        if self.arm.scene is not None:
            raise UnsupportedError("solve is not made for an arm with a scene here: use Arm.solve")
        widest = chosen("prefer", prefer, ("seed", "margin")) == "margin" or seed is None
        q, psi, gc = self._solve(pose, None if widest else seed)
        return q, psi, gc, gc >= 0

    def freedom(self, pose: Array) -> Array:
        """Return the total length of a pose's feasible intervals over all branches: `Freedom.total`.

        Parameters
        ----------
        pose : array, shape (..., 4, 4)
            Pose of the end effector, position in m.

        Returns
        -------
        array, shape (...)
            rad. Its gradient is 0 for an unreachable pose, because the value does not contain the distance to
            a reachable one. It is NaN if an end of an arc does not move smoothly, as in
            `armangle.gradients.freedom`.

        Raises
        ------
        InputError
            Also the errors of `inverse` for a pose.
        """
        return self._freedom(pose)

    def limit_margin(self, q: Array) -> Array:
        """Return the distance to the nearest joint limit.

        Parameters
        ----------
        q : array, shape (..., 7)
            Joint values, rad.

        Returns
        -------
        array, shape (...)
            rad; negative outside, inf without limits.

        Raises
        ------
        InputError
            Also the errors of `forward` for joints.
        """
        return self._limit_margin(q)

    def _solve(self, pose: Array, seed: Array | None) -> tuple[Array, Array, Array]:
        """Return q, psi and gc of `solve`: nearest to the seed, or the largest margin without one."""
        raise NotImplementedError

    def _freedom(self, pose: Array) -> Array:
        """See `freedom`."""
        raise NotImplementedError

    def _limit_margin(self, q: Array) -> Array:
        """See `limit_margin`."""
        raise NotImplementedError
