"""Arms by an integer key, for operators of torch and XLA, which cannot take objects.

`Kept` is the common base class of both.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from ._arrays import chosen
from .arm.arm import Arm
from .arm.chain import unsupported
from .errors import InputError, UnsupportedError

Array: TypeAlias = Any  # a torch.Tensor or a jax.Array, known to type checkers only if installed

_ARMS: dict[int, Arm] = {}


def keep(arm: Arm, asked: str) -> int:
    """Keep an arm for the lifetime of the process and return its key, the same in every process.

    Errors call the caller `asked`. Compiled functions hold the key. In a process that does not know it, they
    fail instead of using another arm.
    """
    if not isinstance(arm, Arm):
        raise InputError(f"arm is {type(arm).__name__}, wanted an Arm")
    if arm.kind == "srs_chain":
        raise unsupported(asked)
    lengths = [
        arm.geometry.d_bs,
        arm.geometry.d_se,
        arm.geometry.d_ew,
        arm.geometry.d_wf,
        arm.geometry.a_3,
        arm.geometry.a_4,
        arm.geometry.d_4,
        arm.geometry.a_1,
        arm.geometry.a_6,
        arm.singularity_margin,
    ]
    parts = [
        lengths,
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
    """Return the arm of a key."""
    arm = _ARMS.get(key)
    if arm is None:
        raise InputError(
            "this process does not know the arm of a compiled function: make its Kinematics first"
        )
    return arm


def is_widest(arm: Arm, seed: Array | None, prefer: str) -> bool:
    """Return whether `solve` is to find the largest margin, not the nearest to a seed; raise for a scene."""
    if arm.scene is not None:
        raise UnsupportedError("solve is not made for an arm with a scene here: use Arm.solve")
    return chosen("prefer", prefer, ("seed", "margin")) == "margin" or seed is None


@dataclass(frozen=True)
class Kept:
    """An arm whose functions take and return arrays of another library."""

    arm: Arm
    _key: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_key", keep(self.arm, type(self).__module__))

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

    def _freedom(self, pose: Array) -> Array:
        """See `freedom`."""
        raise NotImplementedError

    def _limit_margin(self, q: Array) -> Array:
        """See `limit_margin`."""
        raise NotImplementedError
