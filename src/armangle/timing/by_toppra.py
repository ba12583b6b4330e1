"""Time-optimal timing by toppra: our derivatives of q(s) as its path, two-sided at corners of the path."""

from __future__ import annotations

import logging
from functools import cache
from typing import Any

import numpy as np

from .. import errors
from .._arrays import Floats
from ..errors import PathError
from .grid import Grid
from .trajectory import Timing, from_speeds

HIGHEST = 1e4
"""Greatest square of a scaled path speed; where no joint moves there is none of its own."""
UNBOUND = 1e9
LEAST_DURATION = 1e-6


def needed(name: str) -> Any:
    """Return a package of the extra ``time``.

    Raises
    ------
    MissingExtraError
    """
    return errors.needed(name, "timing needs", "time")


@cache
def _classes() -> tuple[Any, Any]:
    """Return the path and the constraint, derived from toppra's own."""
    base = needed("toppra.interpolator").AbstractGeometricPath
    linear = needed("toppra.constraint").LinearConstraint

    class Along(base):  # type: ignore[misc,valid-type]  # imported only when used
        """q(s) by its derivatives in closed form, never a spline through samples; s in units of `scale`."""

        def __init__(self, g: Grid, scale: float) -> None:
            self.points = (g.s - g.s[0]) * scale
            self._orders = {1: g.after[:, 0] / scale, 2: g.after[:, 1] / scale**2}
            self.path_interval = self.points[[0, -1]]

        dof = 7
        path_interval = np.zeros(2)

        def __call__(self, path_positions: Any, order: int = 0) -> Floats:
            at = np.searchsorted(self.points, path_positions)
            return np.asarray(self._orders[order][at])

    class Bounds(linear):  # type: ignore[misc,valid-type]  # the same
        """Accelerations at both ends of every interval, each from its own side, and squares of speeds."""

        def __init__(self, g: Grid, scale: float, acceleration: Floats, most: Floats) -> None:
            super().__init__()
            self.dof, self.identical, self._format_string = 7, True, "    joints of a closed-form path\n"
            self._rows = _interval_rows(g, scale)
            self._bound = np.minimum(np.tile(acceleration, 4), UNBOUND)
            self._most = np.stack([np.zeros(len(most)), most], axis=1)

        def compute_constraint_params(self, path: Any, gridpoints: Any, *args: Any, **kwargs: Any) -> Any:
            u, x = self._rows
            both = np.vstack([np.eye(14), -np.eye(14)])
            return u, x, np.zeros_like(u), both, self._bound, None, self._most

    return Along, Bounds


def _interval_rows(g: Grid, scale: float) -> tuple[Floats, Floats]:
    """Return the factors of path acceleration and squared speed in the joints' accelerations, (N + 1, 14)."""
    first, second = g.after[:, 0] / scale, g.after[:, 1] / scale**2
    end, bend = np.roll(g.before, -1, axis=0)[:, 0] / scale, np.roll(g.before, -1, axis=0)[:, 1] / scale**2
    step = np.append(np.diff(g.s), 0.0)[:, None] * scale
    end[-1], bend[-1] = first[-1], second[-1]
    return np.hstack([first, end + 2 * step * bend]), np.hstack([second, bend])


def _likely_duration(g: Grid, acceleration: Floats, most: Floats) -> float:
    """Return about how long the motion takes, s: scaled by it, speeds are near 1, as solvers like."""
    step = np.diff(g.s)
    cruise = float(np.sum(step / np.minimum(most[1:], most[:-1])))
    travel = np.sum(np.abs(g.after[:-1, 0]) * step[:, None], axis=0)
    return max(cruise, float(2 * np.sqrt(np.max(travel / acceleration))), LEAST_DURATION)


def fastest(g: Grid, acceleration: Floats, most: Floats) -> Timing:
    """Return the fastest timing from rest to rest, without a stop between.

    Parameters
    ----------
    g : Grid
        s and the derivatives of q.
    acceleration : ndarray, shape (7,)
        rad/s².
    most : ndarray, shape (N + 1,)
        Greatest ds/dt at each s, 1/s.

    Raises
    ------
    MissingExtraError
    PathError
        If there is none that toppra can find.
    """
    path_class, bounds_class = _classes()
    algorithm = needed("toppra.algorithm")
    logging.getLogger("toppra").setLevel(logging.ERROR)
    scale = _likely_duration(g, acceleration, most) / float(g.s[-1] - g.s[0])
    squares = np.minimum((most * scale) ** 2, HIGHEST)
    path = path_class(g, scale)
    solver = algorithm.TOPPRA(
        [bounds_class(g, scale, acceleration, squares)], path, gridpoints=path.points, solver_wrapper="seidel"
    )
    _, speed, _ = solver.compute_parameterization(0.0, 0.0)
    if speed is None or np.isnan(speed).any():
        raise PathError("no timing keeps the bounds along the path: toppra finds none")
    return from_speeds(g.s, np.maximum(speed, 0.0) / scale)
