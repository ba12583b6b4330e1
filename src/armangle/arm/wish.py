"""The elbow's target: a point or a direction, in the form that the core accepts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import Floats, as_floats, chosen
from .._core import Wish
from ..errors import InputError

DIRECTIONS = {
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "forward": (1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0),
}
"""Words for directions in the frame that poses are given in: x forward, y left, z up."""

Direction = ArrayLike | str


def as_wish(point: ArrayLike | None, direction: Direction | None) -> tuple[Wish, Floats]:
    """Return the kind of target, and its point (m) or direction of any length as float64 (..., 3).

    Raises `InputError` if not exactly one is given, the direction has no length, or the point is not finite
    in metres.
    """
    if (point is None) == (direction is None):
        raise InputError(
            f"point is {point!r:.50} and direction is {direction!r:.50}, wanted exactly one of them"
        )
    if isinstance(point, str):
        raise InputError(f"point is {point!r:.50}, wanted x, y, z in m; a word is a direction=")
    if point is not None:
        places = _finite("point", point)
        if not (np.abs(places) <= _core.LENGTH_LIMIT).all():
            raise InputError(f"point holds {np.abs(places).max():g}, wanted m within ±{_core.LENGTH_LIMIT:g}")
        return Wish.POINT, places
    if isinstance(direction, str):
        return Wish.DIRECTION, np.array(DIRECTIONS[chosen("direction", direction, DIRECTIONS)])
    along = _finite("direction", direction)
    size = np.abs(along).max(axis=-1, keepdims=True, initial=0.0)
    if not (size > 0).all():
        raise InputError("direction is zero, wanted a direction")
    return Wish.DIRECTION, along / size


def _finite(name: str, value: Any) -> Floats:
    """Return vectors (..., 3) as float64; raise unless all numbers are finite."""
    vectors = as_floats(name, value, (3,))
    if not np.isfinite(vectors).all():
        raise InputError(f"{name} is {vectors.tolist()!s:.100}, wanted finite numbers")
    return vectors
