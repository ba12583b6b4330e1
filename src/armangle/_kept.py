"""Arms by a number that stands for them where an object cannot go: in operators of torch and XLA.

`Kept` is what the classes of both have in common.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from ._arrays import chosen
from .arm.arm import Arm
from .arm.near import unsupported
from .arm.offset import as_srs
from .errors import InputError, UnsupportedError

Array: TypeAlias = (
    Any  # a torch.Tensor or a jax.Array, which type checkers know only where they are installed
)

_ARMS: dict[int, Arm] = {}


def keep(arm: Arm, asked: str) -> int:
    """Return the number of an arm, the same in every process, and keep the arm for as long as this one lives.

    Compiled functions hold the number. Loaded by a process that does not know it, they fail instead of taking
    another arm.
    """
    if not isinstance(arm, Arm):
        raise InputError(f"arm is {type(arm).__name__}, wanted an Arm")
    if as_srs(arm, asked).chain is not None:
        raise unsupported(asked)
    lengths = [arm.d_bs, arm.d_se, arm.d_ew, arm.d_wf, arm.a_3, arm.a_4, arm.d_4, arm.singularity_margin]
    parts = [lengths, arm.signs, arm.offsets, arm.lower, arm.upper, arm.base.ravel(), arm.tool.ravel()]
    numbers = np.concatenate([np.asarray(part, dtype=np.float64) for part in parts])
    digest = hashlib.sha256(numbers.tobytes() + repr(arm.reference).encode()).digest()
    key = int.from_bytes(digest[:8], "little") >> 1  # a signed integer of 64 bits holds it
    _ARMS.setdefault(key, arm)
    return key


def kept(key: int) -> Arm:
    """Return the arm of a number."""
    arm = _ARMS.get(key)
    if arm is None:
        raise InputError(
            "this process does not know the arm of a compiled function: make its Kinematics first"
        )
    return arm


def is_widest(arm: Arm, seed: Array | None, prefer: str) -> bool:
    """Return whether `solve` asks for the largest margin, not for the solution nearest to a seed."""
    if arm.scene is not None:
        raise UnsupportedError("solve is not made for an arm with a scene here: use Arm.solve")
    return chosen("prefer", prefer, ("seed", "margin")) == "margin" or seed is None


@dataclass(frozen=True)
class Kept:
    """An arm whose functions take and give arrays of another library."""

    arm: Arm
    _key: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_key", keep(self.arm, type(self).__module__))

    def freedom(self, pose: Array) -> Array:
        """Return over how much of their circles all branches together hold a pose: `Freedom.total`.

        Parameters
        ----------
        pose : array, shape (..., 4, 4)
            Tool frame, position in m.

        Returns
        -------
        array, shape (...)
            rad. Its gradient is 0 where a pose is not held, since how far it is from being held is not in it,
            and NaN where an end of an arc does not move smoothly, as in `armangle.gradients.freedom`.

        Raises
        ------
        InputError
            And what `inverse` raises of a pose.
        """
        return self._freedom(pose)

    def limit_margin(self, q: Array) -> Array:
        """Return the least distance of a joint to one of its limits.

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
            And what `forward` raises of joints.
        """
        return self._limit_margin(q)

    def _freedom(self, pose: Array) -> Array:
        raise NotImplementedError

    def _limit_margin(self, q: Array) -> Array:
        raise NotImplementedError
