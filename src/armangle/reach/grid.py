"""The cells of a reach map: wrist positions, directions of axis 7; and their tiles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .._arrays import Floats, frozen

AXES = ("r", "z", "tilt", "turn")
_CELLS = 2**20  # least number of cells of a tile in closed form: some tenths of a second of one core
_MOST_CELLS = 2**23  # largest number of cells of a tile: memory of one thread, nine bytes each
_TILES = 4096  # wanted maximum: each tile is one file for every field


@dataclass(frozen=True)
class Grid:
    """A grid over the four numbers of a pose that determine joints 2 to 6, in tiles of `side` x `side`.

    `spacing`, distance between wrist positions, m; `tilts` and `turns`, number of tilts in [0, π] and turns
    in [-π, π], whose values are those at the middles of the cells; `side`, wrist positions along r, and along
    z, in one tile; `across` and `along`, tiles along r and along z.
    """

    spacing: float
    tilts: int
    turns: int
    side: int
    across: int
    along: int

    @classmethod
    def of(cls, reach: float, spacing: float, angle: float, *, slow: bool = False) -> Grid:
        """Return a grid of wrists up to `reach` (m): cells of `spacing` (m) and at most `angle` (rad).

        If cells are slow, as they are unless the arm is S-R-S, tiles are as small as their number permits.
        """
        tilts = max(1, math.ceil(math.pi / angle * (1 - 1e-12)))
        half = max(1, math.ceil(reach / spacing * (1 - 1e-12)))
        cells = 2 * half * half * 2 * tilts * tilts
        wanted = min(max(0 if slow else _CELLS, cells // _TILES), _MOST_CELLS)
        side = max(1, min(half, math.isqrt(wanted // (2 * tilts * tilts))))
        across = math.ceil(half / side)
        side = math.ceil(half / across)
        return cls(spacing, tilts, 2 * tilts, side, across, 2 * across)

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Cells along r, z, tilt and turn."""
        return self.across * self.side, self.along * self.side, self.tilts, self.turns

    @property
    def tile(self) -> tuple[int, int, int, int]:
        """Cells of a tile along each axis."""
        return self.side, self.side, self.tilts, self.turns

    @property
    def tiles(self) -> int:
        """Number of tiles."""
        return self.across * self.along

    @property
    def cells(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    @property
    def steps(self) -> Floats:
        """Size of a cell along each axis, m, m, rad, rad."""
        return np.array([self.spacing, self.spacing, math.pi / self.tilts, 2 * math.pi / self.turns])

    @cached_property
    def axes(self) -> dict[str, Floats]:
        """Middles of the cells along each axis, m and rad; those of z and turn are symmetric about 0."""
        _, heights, _, turns = self.shape
        first = 0.5, 0.5 * (1 - heights), 0.5, 0.5 * (1 - turns)
        return {
            name: frozen((np.arange(count, dtype=np.float64) + start) * step)
            for name, count, start, step in zip(AXES, self.shape, first, self.steps.tolist(), strict=True)
        }

    def window(self, tile: int) -> tuple[slice, slice]:
        """Return the slices of a tile's wrist positions along r and z."""
        i, j = divmod(tile, self.along)
        return slice(i * self.side, (i + 1) * self.side), slice(j * self.side, (j + 1) * self.side)

    def places(self, tile: int) -> Floats:
        """Return r and z of a tile's wrist positions, shape (side * side, 2), m."""
        r, z = self.window(tile)
        both = np.meshgrid(self.axes["r"][r], self.axes["z"][z], indexing="ij")
        return np.ascontiguousarray(np.stack(both, axis=-1)).reshape(-1, 2)
