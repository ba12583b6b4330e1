"""The core of a nearly S-R-S arm: what it answers, what it refuses, and when it is too far off."""

from __future__ import annotations

import math
from typing import Never

import numpy as np

from .. import _core
from .._arrays import MILLIMETRES, Floats
from ..errors import InputError
from ..models.detect import MAX_ANGLE, MAX_LENGTH

_ASKED = {
    "feasible_one": "feasible",
    "feasible_many": "feasible",
    "psi_towards_many": "psi_towards",
    "joint_function": "joint_function",
    "explain_pose": "explain",
    "turns_many": "feasible_yaw or feasible_roll",
    "end_slopes_one": "feasible_derivative",
    "is_kuka": "aa.kuka",
}


class NearHandle(_core.NearArm):
    """A core arm with its own chain; what is not made for it is refused by name."""

    def __getattr__(self, name: str) -> Never:
        if name.startswith("__"):
            raise AttributeError(name)
        raise unsupported(_ASKED.get(name, name.removesuffix("_many")))


def unsupported(what: str) -> InputError:
    """Return the error of a function that has no answer for an arm with a chain."""
    return InputError(
        f"{what} is not made for an arm with a chain of its own: use arm.nominal, the S-R-S arm beside it, "
        "whose joints miss the true poses by arm.deviation"
    )


def check_near(name: str, handle: NearHandle) -> None:
    """Raise where a link of a chain is not near the nominal one."""
    off = np.array(handle.deviations)
    if (off <= (MAX_LENGTH, MAX_ANGLE)).all():
        return
    at = int(np.argmax((off / (MAX_LENGTH, MAX_ANGLE)).max(axis=1)))
    length, angle = off[at, 0] * MILLIMETRES, math.degrees(off[at, 1])
    raise InputError(
        f"chain[{at}] of {name!r} is {length:.4g} mm and {angle:.4g} deg "
        f"from the nominal link, wanted at most {MAX_LENGTH * MILLIMETRES:g} mm and "
        f"{math.degrees(MAX_ANGLE):.3g} deg: is it in the joint coordinates of the other numbers?"
    )


def moved_ends(chain: Floats, old: tuple[Floats, Floats], new: tuple[Floats, Floats]) -> Floats:
    """Return a chain whose base and tool have changed."""
    out = chain.copy()
    out[0] = new[0] @ np.linalg.solve(old[0], chain[0])
    out[-1] = chain[-1] @ np.linalg.solve(old[1], new[1])
    return out
