"""Arcs permitted by the caller: one set for all poses, or a function of the pose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core
from .._arrays import Floats
from ..errors import InputError
from .arcs import ArcSet

Allowed = ArcSet | Callable[[Floats], ArcSet]


def one_allowed(allowed: Allowed, pose: Floats) -> tuple[Any, Any]:
    """Return the number of arcs and their ends (n, 2), rad, that `allowed` gives for one pose."""
    arcs = _checked(allowed_arcs(allowed, pose))
    return arcs._count, arcs._psi


def allowed_arcs(allowed: Allowed, poses: Floats) -> ArcSet:
    """Return the arm angles that the user allows for poses (..., 4, 4): one set, or one for each pose."""
    if isinstance(allowed, ArcSet):
        return _few(allowed)
    if not callable(allowed):
        raise InputError(f"allowed is {allowed!r}, wanted an ArcSet or a function of a pose")
    sets = [_checked(allowed(pose)) for pose in poses.reshape(-1, 4, 4)]
    arrays = [
        np.concatenate([getattr(arcs, name) for arcs in sets])
        for name in ("_count", "_psi", "_joint", "_side", "_value", "_status")
    ]
    return ArcSet._from_core(poses.shape[:-2], tuple(arrays))


def _checked(arcs: object) -> ArcSet:
    """Return the arcs that the user's function gave for one pose; raise if it gave anything else."""
    if not isinstance(arcs, ArcSet) or arcs.shape:
        raise InputError(f"allowed gives {arcs!r}, wanted an ArcSet of shape ()")
    return _few(arcs)


def _few(arcs: ArcSet) -> ArcSet:
    """Return the set, or array of sets, itself.

    InputError if one has more than 16 arcs, which an intersection could not hold.
    """
    most = _core.ARC_CAPACITY // 2
    if (arcs._count > most).any():
        raise InputError(f"allowed holds {int(arcs._count.max())} arcs, wanted at most {most}")
    return arcs
