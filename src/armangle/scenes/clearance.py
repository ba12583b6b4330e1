"""How near an arm is to what stands about it, as a value."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, Ints, frozen
from .._values import by_content
from .ready import Ready


@by_content
class Clearance(NamedTuple):
    """The nearest pair of obstacle and link at postures.

    ``distance (...)`` between their surfaces, m; where they meet it is negative, as deep as the radii of the
    two reach at most. ``obstacle (...)`` and ``link (...)`` are their names, for a batch arrays of objects,
    None where there is no pair at all (the distance is then infinite). ``psi_rate (...)`` is what the
    distance gains with the arm angle, m/rad. ``points (..., 2, 3)`` are the nearest points of the two
    surfaces, of the link and of the obstacle, m, in the frame that poses are given in; NaN without a pair.
    """

    distance: float | Floats
    obstacle: str | NDArray[np.object_] | None
    link: str | NDArray[np.object_] | None
    psi_rate: float | Floats
    points: Floats


def clearance_of(ready: Ready, numbers: Floats, pairs: Ints) -> Clearance:
    """Return the value behind the core's numbers (..., 8) and pairs (...)."""
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
    """The arm angles that keep all limits and clear of a scene, and of them the one farthest from it.

    ``arcs`` of shape (...), as of `Arm.feasible`; ``psi (...)`` rad; ``nearest`` is the pair that is nearest
    there, of those that the arm angle can move away. Where the limits leave nothing, or links stand so deep
    in obstacles that none of the arm angles is clear even of their cores, psi is NaN. A distance below the
    scene's clearance says by how much a refusal fails. Among fields psi is the best to within two hundredths
    of a spacing.
    """

    arcs: Any
    psi: float | Floats
    nearest: Clearance
