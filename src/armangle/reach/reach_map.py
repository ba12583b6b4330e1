"""Maps of what an arm reaches: made, resumed, verified, read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats, PathLike, as_floats, as_number, as_poses
from .._progress import Progress, as_progress
from ..arm.arm import Arm
from ..arm.freedom import Freedom
from ..arm.near import unsupported
from ..arm.offset import as_srs
from ..errors import InputError, needed
from .filling import check_scheduler, fill_here, fill_on_cluster
from .grid import Grid
from .map_values import MapValues
from .store import FIELDS, USUAL, Store, address, make_store
from .voxels import ORIENTATIONS, Voxels, voxels_of

_COORDINATES = 6
_LEAST_SPACING, _LEAST_ANGLE, _MOST_ANGLE = 1e-4, math.radians(0.1), math.pi / 2
_MOST_CELLS = 10**13
_DRAWN_AT_ONCE = 100_000
_MOST_SAMPLES = 100_000_000  # 12.8 GB
_VAIN = 100  # draws of so many in which nothing is reached, before sampling is given up


class ReachMap:
    """A map of what an arm reaches, in a Zarr store.

    A pose of an S-R-S arm is four numbers that joints 2 to 6 see, and two that joints 1 and 7 alone see:
    the azimuth of the wrist about axis 1, and the roll about axis 7. The map is a grid over the four: ``r``
    and ``z``, m, the wrist beside axis 1 and above the shoulder along it; ``tilt``, rad, of axis 7 against
    the line from shoulder to wrist; ``turn``, rad, of axis 7 about that line, 0 in the plane with axis 1 and
    away from it. So it holds for every tool, mounting, azimuth and roll at once.

    Its fields, at the middle of each cell: ``gc`` (uint8), bit k set where global configuration k holds it
    at some azimuth and roll; ``freedom`` (float16), the measure of the arm angles that joints 2 to 6 leave,
    rad, over all branches; ``yaw`` and ``roll`` (uint8), the share of the azimuths (of the rolls) at which
    it is held at some roll (some azimuth), in 255ths and rounded down, so that 255 is every one.
    A cell says nothing of the places between the middles; `at` does, exactly, without the table. Where it
    was asked for, ``proven`` (uint8) is certain of the whole cell: 1 that every pose in it is held at some
    azimuth and roll, 2 that none is, 0 that nothing is known.

    Parameters
    ----------
    path : str or path
        The folder of the store, or an address that fsspec knows, such as ``"s3://bucket/arm.zarr"``.

    Raises
    ------
    ModelError
        If there is no map.
    MissingExtraError
        Without zarr: ``pip install 'armangle[reach]'``.
    """

    def __init__(self, path: PathLike) -> None:
        self._store = Store(path)

    @property
    def path(self) -> str:
        """Where it is."""
        return self._store.place

    @property
    def arm(self) -> Arm:
        """The arm, without body, hand and scene, and with the `singularity_margin` of the map."""
        return self._store.arm

    @property
    def fields(self) -> tuple[str, ...]:
        """What it holds of a cell."""
        return self._store.fields

    @property
    def spacing(self) -> float:
        """Between cells along r and z, m."""
        return self._store.grid.spacing

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Cells along r, z, tilt and turn."""
        return self._store.grid.shape

    @property
    def axes(self) -> dict[str, Floats]:
        """Middles of the cells along ``r``, ``z`` (m), ``tilt`` and ``turn`` (rad)."""
        return dict(self._store.grid.axes)

    @property
    def tiles(self) -> int:
        """How many tiles it is made of: a tile is what is computed and written at once."""
        return self._store.grid.tiles

    @property
    def missing(self) -> tuple[int, ...]:
        """The tiles that are not made yet; `reach_map` with the same arguments makes them."""
        return self._store.missing()

    def resume(
        self,
        *,
        part: tuple[int, int] | None = None,
        scheduler: Any = None,
        progress: Progress | bool | None = None,
    ) -> ReachMap:
        """Make the tiles that are missing, and return the map: `reach_map` without its arguments.

        Parameters
        ----------
        part, scheduler, progress
            As in `reach_map`.

        Raises
        ------
        InputError, OutputError, MissingExtraError
            As `reach_map`.
        """
        first, of = _checked_run(part, scheduler, progress)
        tiles = [tile for tile in self._store.missing() if tile % of == first - 1]
        if scheduler is None:
            fill_here(self._store, tiles, as_progress(progress))
        else:
            fill_on_cluster(self._store, tiles, scheduler, as_progress(progress))
        return self

    def verify(self, progress: Progress | bool | None = None) -> tuple[int, ...]:
        """Return the tiles whose values are not those that were written, by their check sums.

        They lose their marks, so that they are ``missing`` and the next run makes them again.

        Parameters
        ----------
        progress : function (done, total) or bool
            Told after each tile; True draws a bar on stderr.
        """
        told, wrong = as_progress(progress), []
        for tile, broken in self._store.broken():
            wrong += [tile] if broken else []
            if told is not None:
                told(tile + 1, self.tiles)
        return tuple(wrong)

    def values(self, field: str) -> MapValues:
        """Return a field, read by cells like an array: ``values("gc")[3, 40]`` reads that place alone.

        Parameters
        ----------
        field : str
            One of `fields`.

        Returns
        -------
        MapValues
            Of `shape`; its ``array`` is the Zarr array. Reading a damaged tile raises `ModelError`.
        """
        return MapValues(self._store, _checked_field(field, self.fields))

    def section(self, field: str = "gc") -> Floats:
        """Return the mean of a field over all directions of axis 7, for each place of the wrist.

        Directions count by their solid angle. Of ``gc`` it is the share of directions that are held at some
        azimuth and roll; of ``freedom`` rad; of ``yaw`` and ``roll`` shares of the circle; of ``proven`` the
        share of directions whose whole cells are proven to be held.

        Parameters
        ----------
        field : str
            One of `fields`.

        Returns
        -------
        ndarray, shape (r, z)

        Raises
        ------
        ModelError
            If a tile is damaged: `verify` unmarks it, `resume` makes it again.
        """
        name = _checked_field(field, self.fields)
        grid = self._store.grid
        weight = np.sin(grid.axes["tilt"])
        weight = weight / (weight.sum() * grid.turns)
        out = np.zeros(grid.shape[:2])
        for tile in range(grid.tiles):
            window = grid.window(tile)
            held = self._store.read_field(name, tile)
            values = {"gc": held != 0, "proven": held == 1}.get(name, held)
            out[window] = np.einsum("rzij,i->rz", values, weight, dtype=np.float64)
        return out / 255.0 if name in ("yaw", "roll") else out

    def at(self, pose: ArrayLike) -> Freedom:
        """Return how much freedom a pose has: by closed form, exactly, and never from the table.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.

        Returns
        -------
        Freedom
            What `Arm.freedom` says, with the map's margin and all limits.
        """
        return self.arm.freedom(pose)

    def pose(self, coordinates: ArrayLike) -> Floats:
        """Return poses of the tool by the numbers of the map.

        Parameters
        ----------
        coordinates : array_like, shape (..., 6)
            r, z (m), tilt, turn, azimuth of the wrist about axis 1, roll about axis 7 (rad).

        Returns
        -------
        ndarray, shape (..., 4, 4)

        Raises
        ------
        InputError
        """
        numbers = as_floats("coordinates", coordinates, (_COORDINATES,))
        if not np.isfinite(numbers).all() or not (np.hypot(numbers[..., 0], numbers[..., 1]) > 0).all():
            raise InputError("coordinates hold a number that is not finite, or the wrist on the shoulder")
        flat = np.ascontiguousarray(numbers).reshape(-1, _COORDINATES)
        out = np.empty((len(flat), 4, 4))
        self.arm._handle.poses_of_reduced(flat, out)
        return out.reshape((*numbers.shape[:-1], 4, 4))

    def coordinates(self, pose: ArrayLike) -> Floats:
        """Return r, z (m), tilt, turn, azimuth and roll (rad) of poses: `pose` the other way round.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.

        Returns
        -------
        ndarray, shape (..., 6)
            The azimuth is 0 where the wrist lies on axis 1, the turn where axis 7 points along the line from
            shoulder to wrist.

        Raises
        ------
        InputError
        """
        poses = as_poses("pose", pose, self.arm._handle)
        out = np.empty((*poses.shape[:-2], _COORDINATES))
        self.arm._handle.reduced_of_poses(poses, out)
        return out

    def voxels(self, spacing: float = 0.1, *, orientations: int = ORIENTATIONS) -> Voxels:
        """Return where in space the tool can be, and with which share of all orientations.

        By closed form, with all limits, the arm's tool and its base: not from the table, whose numbers are
        of the wrist and of some azimuth and roll.

        Parameters
        ----------
        spacing : float
            Edge of a voxel, m.
        orientations : int
            How many to ask at each, spread evenly over all rotations.

        Returns
        -------
        Voxels

        Raises
        ------
        InputError
        """
        return voxels_of(self.arm, spacing, orientations)

    def sample(self, n: int, seed: int = 0) -> Floats:
        """Return poses drawn from all those that the arm holds, each as likely as any other.

        Exactly so: poses are drawn evenly over position and rotation, and those that `Arm.reachable` refuses
        are drawn again. The table, whose cells only sample, plays no part.

        Parameters
        ----------
        n : int
            How many, 100 million at most: ask again with another seed for more.
        seed : int
            The same seed draws the same poses.

        Returns
        -------
        ndarray, shape (n, 4, 4)

        Raises
        ------
        InputError
            If n or the seed is no whole number, or nothing is found that the arm reaches.
        """
        for name, value in (("n", n), ("seed", seed)):
            whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
            if not whole or value < 0:
                raise InputError(f"{name} is {value!r:.50}, wanted an integer, 0 or more")
        if n > _MOST_SAMPLES:
            raise InputError(f"n is {n}, wanted at most {_MOST_SAMPLES} at once: another seed draws more")
        out = np.empty((n, 4, 4))
        count = vain = 0
        draws = self._draws(np.random.default_rng(int(seed)))
        while count < n:
            some = next(draws)
            vain = vain + 1 if not len(some) else 0
            if vain == _VAIN:
                raise InputError(f"n is {n}, and of {_VAIN * _DRAWN_AT_ONCE} poses drawn the arm holds none")
            out[count : count + len(some)] = some[: n - count]
            count += len(some)
        return out

    def _draws(self, rng: np.random.Generator) -> Iterator[Floats]:
        """Draw poses whose wrist is anywhere in the reach, and yield those that are held."""
        arm = self.arm
        while True:
            drawn = rng.random((_DRAWN_AT_ONCE, _COORDINATES))
            distance = np.cbrt(arm.inner_reach**3 + drawn[:, 0] * (arm.reach**3 - arm.inner_reach**3))
            height = 2 * drawn[:, 1] - 1
            beside = distance * np.sqrt(1 - height**2)
            angles = 2 * np.pi * drawn[:, 3:] - np.pi
            tilt = np.arccos(1 - 2 * drawn[:, 2])
            poses = self.pose(np.column_stack([beside, distance * height, tilt, angles]))
            yield poses[np.asarray(arm.reachable(poses))]

    def to_xarray(self) -> Any:
        """Return the map as an xarray Dataset, whose values are read when they are used.

        Raises
        ------
        MissingExtraError
            Without xarray.
        """
        xarray = needed("xarray", "to_xarray() needs", "reach")
        return xarray.open_dataset(self.path, engine="zarr", consolidated=False, chunks=None)

    def __repr__(self) -> str:
        """Return what it is of and how much of it is made."""
        done = self.tiles - len(self.missing)
        cells = " x ".join(map(str, self.shape))
        return f"<ReachMap of {self.arm.name}: {cells} cells, {done} of {self.tiles} tiles made, {self.path}>"


def reach_map(
    arm: Arm,
    path: PathLike,
    *,
    spacing: float = 0.02,
    tilt: float = math.radians(5.0),
    fields: Iterable[str] = USUAL,
    part: tuple[int, int] | None = None,
    scheduler: Any = None,
    progress: Progress | bool | None = None,
) -> ReachMap:
    """Make a map of what an arm reaches, or go on with one: what is there already is not made again.

    Killed at any moment and called again with the same arguments, it leaves the same bytes as if it had never
    been. Any number of processes, on any machines with the same instruction set, may work on one map.

    Parameters
    ----------
    arm : Arm
        Its `scene` is not asked.
    path : str or path
        A folder that is made, or an address that fsspec knows.
    spacing : float
        Between places of the wrist, m; 1e-4 at least.
    tilt : float
        Between directions of axis 7, rad, 0.1° to 90°; a little less where it is no whole part of π.
    fields : of "gc", "freedom", "yaw", "roll", "proven"
        What to hold of each cell: see `ReachMap`. What is proven takes ten to a hundred times as long, and is
        much of the map only where cells are small: 10 mm and 1°.
    part : (int, int), optional
        ``(i, n)``, 1 <= i <= n: the i-th of n shares alone, for the task i of a batch system's array.
    scheduler : distributed.Client or str, optional
        A Dask cluster, or the address of its scheduler, that makes the tiles; extra ``cluster``.
    progress : function (done, total) or bool
        Told after each tile; True draws a bar on stderr.

    Returns
    -------
    ReachMap
        Its ``missing`` is empty unless `part` left some.

    Raises
    ------
    InputError
        If an argument is not usable, or the path holds a map of another arm, grid, margin or instruction
        set, or something else.
    OutputError
        If it cannot be written, as where the disk is full; what was made stays, and the same call goes on.
    MissingExtraError
        Without zarr: ``pip install 'armangle[reach]'``.

    Examples
    --------
    >>> import armangle as aa
    >>> arm = aa.Arm.from_catalogue("openarm_v10")
    >>> found = aa.reach_map(arm, "openarm.zarr", spacing=0.05)  # doctest: +SKIP
    >>> found.missing, found.section("yaw").shape                # doctest: +SKIP
    ((), (9, 18))
    """
    if not isinstance(arm, Arm):
        raise InputError(f"arm is {type(arm).__name__}, wanted an Arm")
    if as_srs(arm, "reach_map").chain is not None:
        raise unsupported("reach_map")
    gap = as_number("spacing", spacing, _LEAST_SPACING, arm.reach)
    angle = as_number("tilt", tilt, _LEAST_ANGLE, _MOST_ANGLE)
    names = _names(fields)
    _checked_run(part, scheduler, progress)  # before anything is written
    grid = Grid.of(arm.reach, gap, angle)
    address(path)
    if grid.cells > _MOST_CELLS:
        raise InputError(f"spacing and tilt make {grid.cells:.3g} cells, wanted at most {_MOST_CELLS:.0e}")
    place = make_store(arm, path, grid, names).place
    return ReachMap(place).resume(part=part, scheduler=scheduler, progress=progress)


def _checked_field(name: str, known: tuple[str, ...]) -> str:
    if name not in known:
        raise InputError(f"field is {name!r:.50}, wanted one of {', '.join(map(repr, known))}")
    return name


def _names(fields: Iterable[str]) -> tuple[str, ...]:
    """Return the names of fields in the order of the store."""
    given = [fields] if isinstance(fields, str) else fields
    try:
        wanted = {*given}
    except TypeError:
        raise InputError(f"fields is {fields!r:.50}, wanted some of {', '.join(FIELDS)}") from None
    strange = [name for name in wanted if name not in FIELDS]
    if strange or not wanted:
        what = repr(strange[0])[:50] if strange else "nothing"
        raise InputError(f"fields holds {what}, wanted some of {', '.join(FIELDS)}")
    return tuple(name for name in FIELDS if name in wanted)


def _checked_run(
    part: tuple[int, int] | None, scheduler: Any, progress: Progress | bool | None
) -> tuple[int, int]:
    """Return which share of how many is asked, counted from 1; raise where a run is not usable as asked."""
    as_progress(progress)
    if scheduler is not None:
        check_scheduler(scheduler)
    if part is None:
        return 1, 1
    whole = isinstance(part, (tuple, list)) and len(part) == 2
    whole = whole and all(isinstance(one, int) and not isinstance(one, bool) for one in part)
    if not whole or not 1 <= part[0] <= part[1]:
        raise InputError(f"part is {part!r:.50}, wanted (i, n) with 1 <= i <= n")
    return part[0], part[1]
