"""The core of a nearly S-R-S arm: its functions, unsupported ones, and chains that are too far off."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Never

import numpy as np

from .. import _core
from .._arrays import MILLIMETRES, Floats
from ..errors import InputError, UnreachableError, UnsupportedError
from ..models.axes import MAX_ANGLE, MAX_LENGTH
from ..models.description import ELBOW_OFFSETS, LENGTHS
from .any_arm import AnyArm
from .joint_map import to_theta

_ELBOW = 3
_MOST_OFF = np.array([MAX_LENGTH, MAX_ANGLE])
_NOTHING = 0.02  # of `_MOST_OFF`: a smaller tool is within the accuracy of a calibration
_ASKED = {
    "joint_function": "gradients.joint_function",
    "is_kuka": "aa.kuka",
}


def refusing(unsupported: Callable[[str], UnsupportedError]) -> Callable[[object, str], Never]:
    """Return the `__getattr__` of a core arm: a missing function raises an error with its public name."""

    def missing(self: object, name: str) -> Never:
        """Raise `unsupported` for the function of the core; AttributeError for __names__."""
        if name.startswith("__"):
            raise AttributeError(name)
        raise unsupported(_ASKED.get(name, name.removesuffix("_many")))

    return missing


NOMINAL = "arm.deviation.nominal, the S-R-S arm beside it, whose joints miss the true poses by arm.deviation"


def unsupported(what: str, instead: str = NOMINAL) -> UnsupportedError:
    """Return the error of a function that does not support an arm with a chain."""
    return UnsupportedError(f"{what} is not made for an arm with a chain of its own: use {instead}")


class ChainHandle(_core.ChainArm):
    """A core arm with its own chain; unsupported functions raise an error with their name."""

    __getattr__ = refusing(unsupported)


def check_chain(name: str, handle: _core.ChainArm | _core.OffsetChain) -> None:
    """Raise if a link of a chain is not near the nominal one."""
    off = np.array(handle.deviations)
    if (off <= _MOST_OFF * (1.0 + 1e-9)).all():
        return
    at = int(np.argmax((off / _MOST_OFF).max(axis=1)))
    length, angle = off[at, 0] * MILLIMETRES, math.degrees(off[at, 1])
    raise InputError(
        f"chain[{at}] of {name!r} is {length:.4g} mm and {angle:.4g} deg "
        f"from the nominal link, wanted at most {MAX_LENGTH * MILLIMETRES:g} mm and "
        f"{math.degrees(MAX_ANGLE):.3g} deg: is it in the joint coordinates of the other numbers? "
        "Of a table: is it of dh_chain's other order, modified=True or False, and the same axes positive?"
    )


def edge_of_reach(arm: AnyArm, pose: Floats) -> str:
    """Return " It is at the edge of reach ..." if the elbow of an own chain is so straight at a pose that
    branches merge, or its nominal S-R-S arm does not reach the pose; otherwise "", as for other kinds.
    """
    if not isinstance(arm._handle, _core.ChainArm):
        return ""
    nominal = arm._nominal
    try:
        q = nominal.inverse(pose, 0.0, 0, limits=False)
    except UnreachableError as error:
        return f" It is at the edge of reach, or beyond: of the S-R-S arm beside the chain the {error}."
    bend = abs(float(to_theta(nominal._handle, q)[_ELBOW]) - nominal.geometry.delta) % (2 * math.pi)
    straight = min(bend, 2 * math.pi - bend) <= arm.deviation.bands[1]
    return " It is at the edge of reach: the elbow is straight." if straight else ""


def leaves_out(bare: ChainHandle | None, whole: ChainHandle, at: int) -> bool:
    """Return whether a link of a chain is far from the nominal one because a frame is missing there: in
    `whole`, which has it, the distance is less than half. True if `bare` is None: the chain is too far off.
    """
    if bare is None:
        return True
    without, given = (float((core.deviations[at] / _MOST_OFF).max()) for core in (bare, whole))
    return 2.0 * given < without > _NOTHING


def check_kept_chain(changes: Iterable[str]) -> None:
    """Raise if a change names a number of the nominal arm alone, which would not change the chain."""
    nominal = {*LENGTHS, *ELBOW_OFFSETS, "a_1", "a_6", "signs", "offsets"}
    changed = [name for name in changes if name in nominal]
    if changed:
        raise InputError(
            f"with_({changed[0]}=...) would change the S-R-S arm beside the chain and no pose: "
            "give the new chain= with it, or ask it of arm.deviation.nominal"
        )


def moved_ends(chain: Floats, old: tuple[Floats, Floats], new: tuple[Floats, Floats]) -> Floats:
    """Return the links of a chain for new frames of base and tool, each given as (base, tool)."""
    out = chain.copy()
    out[0] = new[0] @ np.linalg.solve(old[0], chain[0])
    out[-1] = chain[-1] @ np.linalg.solve(old[1], new[1])
    return out
