"""The core of a nearly S-R-S arm: what it answers, what it refuses, and when it is too far off."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Never

import numpy as np

from .. import _core
from .._arrays import MILLIMETRES, Floats
from ..errors import InputError
from ..models.description import ELBOW_OFFSETS, LENGTHS
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


_NOMINAL = "arm.nominal, the S-R-S arm beside it, whose joints miss the true poses by arm.deviation"


def unsupported(what: str, instead: str = _NOMINAL) -> InputError:
    """Return the error of a function that has no answer for an arm with a chain."""
    return InputError(f"{what} is not made for an arm with a chain of its own: use {instead}")


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


def check_kept_chain(changes: Iterable[str]) -> None:
    """Raise where a change is of the nominal arm alone: the chain, and with it every pose, would stay."""
    nominal = {*LENGTHS, *ELBOW_OFFSETS, "signs", "offsets"}
    changed = [name for name in changes if name in nominal]
    if changed:
        raise InputError(
            f"with_({changed[0]}=...) would change the S-R-S arm beside the chain and no pose: "
            "give the new chain= with it, or ask it of arm.nominal"
        )


def moved_ends(chain: Floats, old: tuple[Floats, Floats], new: tuple[Floats, Floats]) -> Floats:
    """Return a chain whose base and tool have changed."""
    out = chain.copy()
    out[0] = new[0] @ np.linalg.solve(old[0], chain[0])
    out[-1] = chain[-1] @ np.linalg.solve(old[1], new[1])
    return out
