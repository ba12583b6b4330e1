"""The arm on its own chain whose nominal arm has an offset wrist or shoulder, as a calibrated Franka."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Never

from numpy.typing import ArrayLike

from .. import _core
from .._values import fill
from ..errors import UnsupportedError
from ..scenes.scene import Scene
from .arm import KINDS, Arm
from .chain import check_chain, refusing
from .numbers import checked_chain
from .offset import INSTEAD, OffsetArm

NOMINAL = "arm.deviation.nominal, the arm with an offset beside it, whose joints miss the true poses"


def unsupported(what: str, instead: str = "") -> UnsupportedError:
    """Return the error of a function that does not support an own chain with an offset nominal arm."""
    hint = instead or INSTEAD.get(what, f"use {NOMINAL}")
    return UnsupportedError(
        f"{what} is not made for an arm on its own chain with an offset wrist or shoulder: {hint}"
    )


class OffsetChainHandle(_core.OffsetChain):
    """A core arm of this kind; unsupported functions raise an error with their name."""

    __getattr__ = refusing(unsupported)


class OffsetChainArm(OffsetArm):
    """An `Arm` on its own chain, nearly one with an offset wrist or shoulder.

    Created by the constructors of `Arm`, and by ``Arm(a_1=..., chain=...)`` and ``Arm(a_6=..., chain=...)``.
    The free joint is a joint of the arm itself, so psi is exactly its value; gc is that of the nominal arm at
    the same joints.
    """

    __slots__ = ()

    def __init__(self, *unnamed: Never, chain: ArrayLike, **numbers: Any) -> None:
        """Check numbers and chain, create the core's arm, and prepare its obstacles."""
        links, scene = checked_chain(chain), numbers.pop("scene", None)
        assert links is not None
        _refuse_margin(numbers.get("singularity_margin"))
        super().__init__(*unnamed, **numbers)
        handle = OffsetChainHandle(*self._core_numbers(), links)
        check_chain(self.name, handle)
        own = replace(self.geometry, chain=links)
        fill(self, geometry=own, _handle=handle, scene=scene)
        if scene is not None:
            fill(self, _ready=self._prepared(scene))

    def _keeping(self, scene: Scene | None, singularity_margin: float) -> Arm:
        """See `Arm._keeping`; raise for a singularity margin."""
        _refuse_margin(singularity_margin)
        return super()._keeping(scene, singularity_margin)


KINDS.append(OffsetChainArm)


def _refuse_margin(margin: float | None) -> None:
    """Raise for a singularity margin other than 0 or None, which this kind of arm does not have."""
    if margin:
        raise unsupported("singularity_margin=", "with_(lower=..., upper=...) is the margin that it has")
