"""Arms by a number that stands for them where an object cannot go: in operators of torch and XLA."""

from __future__ import annotations

import hashlib

import numpy as np

from .arm.arm import Arm
from .arm.near import NearHandle, unsupported
from .errors import InputError

_ARMS: dict[int, Arm] = {}


def keep(arm: Arm, asked: str) -> int:
    """Return the number of an arm, the same in every process, and keep the arm for as long as this one lives.

    Compiled functions hold the number. Loaded by a process that does not know it, they fail instead of taking
    another arm.
    """
    if not isinstance(arm, Arm):
        raise InputError(f"arm is {type(arm).__name__}, wanted an Arm")
    if isinstance(arm._handle, NearHandle):
        raise unsupported(asked)
    lengths = [arm.d_bs, arm.d_se, arm.d_ew, arm.d_wf, arm.a_3, arm.a_4, arm.d_4]
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
