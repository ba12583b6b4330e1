"""Distances of an arm to its obstacles, as values."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .._arrays import FloatOrArray, Floats, Ints, NameOrArray, frozen
from .._values import by_content
from .ready import Ready


@by_content
class Clearance(NamedTuple):
    """The nearest pair of obstacle and link at given configurations.

    ``distance (...)`` between their surfaces, m; negative on contact, except for a half-space at least minus
    the sum of the two radii. ``obstacle (...)`` and ``link (...)`` are their names, for a batch arrays of
    objects; None if there is no pair at all (the distance is then infinite). ``psi_rate (...)`` is the
    derivative of the distance by the arm angle, m/rad. ``points (..., 2, 3)`` are the nearest points of the
    two surfaces, of the link and of the obstacle, m, in the frame that poses are given in; NaN without a
    pair.
    """

    distance: FloatOrArray
    obstacle: NameOrArray
    link: NameOrArray
    psi_rate: FloatOrArray
    points: Floats


def clearance_of(ready: Ready, numbers: Floats, pairs: Ints) -> Clearance:
    """Return the core's numbers (..., 8) and pair codes (...) as a `Clearance` with names."""
    named = [ready.names.pair(code) or (None, None) for code in pairs.ravel().tolist()]
    points = frozen(numbers[..., 2:].reshape(*pairs.shape, 2, 3).copy())
    if not pairs.shape:
        obstacle, link = named[0]
        return Clearance(float(numbers[0]), obstacle, link, float(numbers[1]), points)
    columns: list[Any] = []
    for k in range(2):
        column = np.empty(len(named), dtype=object)
        column[:] = [pair[k] for pair in named]
        columns.append(frozen(column.reshape(pairs.shape)))
    return Clearance(
        frozen(numbers[..., 0].copy()), columns[0], columns[1], frozen(numbers[..., 1].copy()), points
    )


@by_content
class Widest(NamedTuple):
    """The feasible, collision-free arm angles, and the one with the largest distance.

    ``arcs`` of shape (...), as from `Arm.feasible`; ``psi (...)`` rad; ``nearest`` is the nearest pair there,
    of those whose distance depends on the arm angle. psi is NaN if the limits permit nothing, or links are so
    deep in obstacles that even their cores collide at every arm angle. If the distance is below the scene's
    clearance, the difference is missing. With fields psi is the best to within two hundredths of a spacing.
    """

    arcs: Any
    psi: FloatOrArray
    nearest: Clearance
