"""Maps of an arm's reach: computed, resumed, verified, read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import Floats, PathLike, as_floats, as_number, as_poses, as_whole
from .._progress import Progress, as_progress
from ..arm.arm import Arm, check_arm
from ..arm.chain import unsupported
from ..arm.freedom import Freedom
from ..arm.offset import OffsetArm
from ..arm.offset_chain import unsupported as unsupported_offset_chain
from ..errors import InputError, needed
from .filling import check_scheduler, fill_here, fill_on_cluster
from .grid import Grid
from .map_values import MapValues
from .store import FIELDS, USUAL, Store, address, make_store
from .voxels import ORIENTATIONS, Voxels, voxels_of

_COORDINATES = 6
_LEAST_SPACING, _LEAST_ANGLE, _MOST_ANGLE = 1e-4, math.radians(0.1), math.pi / 2
_MOST_CELLS = 10**13
_DRAWN_AT_ONCE = 10_000
_TRIED_AT_ONCE = 100  # of them: a slow arm then tries few more than it keeps
_MOST_SAMPLES = 100_000_000  # 12.8 GB
_VAIN = 10_000_000  # poses drawn without a reachable one before sampling gives up


class ReachMap:
    """A map of an arm's reach, in a Zarr store.

    A pose of an S-R-S arm has four numbers that determine joints 2 to 6, and two that affect joints 1 and 7
    alone: the azimuth of the wrist about axis 1, and the roll about axis 7. The map is a grid over the four.
    ``r`` and ``z``, m, are the wrist's distance from axis 1 and its height above the shoulder along it.
    ``tilt``, rad, is the angle of axis 7 to the line from shoulder to wrist. ``turn``, rad, is the turn of
    axis 7 about that line, 0 in the plane with axis 1 and away from it. So it is valid for every tool,
    mounting, azimuth and roll at once.

    Its fields at the middle of each cell are these. ``gc`` (uint8): bit k is set if global configuration k
    reaches it at some azimuth and roll. ``freedom`` (float16): length of the arm angles that joints 2 to 6
    permit, rad, over all branches. ``yaw`` and ``roll`` (uint8): share of the azimuths (rolls) at which it is
    reachable at some roll (azimuth), in 255ths and rounded down, so that 255 is all. A cell says nothing of
    the places between the middles; `at` does, exactly, without the table. The optional field ``proven``
    (uint8) is certain for the whole cell: 1 every pose in it is reachable at some azimuth and roll, 2 none
    is, 0 unknown.

    An arm with an offset wrist or shoulder has the same four numbers, counted from the same points: the
    wrist is the point of axis 7 that is d_wf from the flange, the shoulder the point of axis 1 at d_bs. Its
    ``freedom`` is that of the free joint. An arm on its own chain has those of its own axes 1 and 7, and
    `coordinates` counts them. Its fields hold what is found or proven, and one more, always there with
    ``gc``, says what is not: ``unproven`` (uint8), bit k is set if branch k is neither found to reach the
    middle nor excluded.

    Parameters
    ----------
    path : str or path
        The folder of the store, or an address for fsspec, such as ``"s3://bucket/arm.zarr"``.

    Raises
    ------
    ModelError
        If there is no map.
    MissingExtraError
        Without zarr: ``pip install 'armangle[reach]'``.
    """

    def __init__(self, path: PathLike) -> None:
        """Open the map of a store."""
        self._store = Store(path)

    @property
    def path(self) -> str:
        """Its location."""
        return self._store.place

    @property
    def arm(self) -> Arm:
        """The arm with the map's `singularity_margin`, without collision model, gripper and scene."""
        return self._store.arm

    @property
    def fields(self) -> tuple[str, ...]:
        """The fields of each cell."""
        return self._store.fields

    @property
    def spacing(self) -> float:
        """Distance of cells along r and z, m."""
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
        """Number of tiles: a tile is computed and written at once."""
        return self._store.grid.tiles

    @property
    def missing(self) -> tuple[int, ...]:
        """The tiles that are not computed yet; `reach_map` with the same arguments computes them."""
        return self._store.missing()

    def resume(
        self,
        *,
        part: tuple[int, int] | None = None,
        scheduler: Any = None,
        progress: Progress | bool | None = None,
    ) -> ReachMap:
        """Compute the missing tiles, and return the map: `reach_map` without its arguments.

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
        """Return the tiles whose values differ from those written, according to their check sums.

        They lose their marks, so that they are ``missing`` and the next run computes them again.

        Parameters
        ----------
        progress : function (done, total) or bool
            Called after each tile; True draws a bar on stderr.
        """
        told, wrong = as_progress(progress), []
        for tile, broken in self._store.broken():
            wrong += [tile] if broken else []
            if told is not None:
                told(tile + 1, self.tiles)
        return tuple(wrong)

    @property
    def unproven(self) -> int:
        """Number of cells whose middle is neither found to be reachable nor excluded, of the tiles computed.

        0 unless the arm has its own chain. Raises `ModelError` if a tile is damaged.
        """
        if "unproven" not in self.fields:
            return 0
        return sum(int(self._held("unproven", tile).sum()) for tile in range(self.tiles))

    def _held(self, name: str, tile: int) -> NDArray[Any]:
        """Return what a section adds up of a tile: for a field of bits or codes, 1 or 0 for each cell."""
        values = self._store.read_field(name, tile)
        if name == "unproven":
            values = (values != 0) & (self._store.read_field("gc", tile) == 0)
        elif name in ("gc", "proven"):
            values = values == 1 if name == "proven" else values != 0
        return values

    def values(self, field: str) -> MapValues:
        """Return a field, indexed by cells like an array: ``values("gc")[3, 40]`` reads that place alone.

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
        """Return the mean of a field over all directions of axis 7, for each wrist position.

        Directions are weighted by their solid angle. For ``gc`` it is the share of directions that are
        reachable at some azimuth and roll; for ``freedom`` rad; for ``yaw`` and ``roll`` shares of the
        circle; for ``proven`` the share of directions whose whole cells are proven reachable; for
        ``unproven`` of those that are neither found to be reachable nor excluded. Tiles that are not computed
        yet count as 0.

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
            If a tile is damaged: `verify` removes its mark, `resume` computes it again.
        """
        name = _checked_field(field, self.fields)
        grid = self._store.grid
        weight = np.sin(grid.axes["tilt"])
        weight = weight / (weight.sum() * grid.turns)
        out = np.zeros(grid.shape[:2])
        for tile in range(grid.tiles):
            values = self._held(name, tile)
            out[grid.window(tile)] = np.einsum("rzij,i->rz", values, weight, dtype=np.float64)
        return out / 255.0 if name in ("yaw", "roll") else out

    def at(self, pose: ArrayLike) -> Freedom:
        """Return the freedom of a pose: in closed form, exactly, and never from the table.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.

        Returns
        -------
        Freedom
            The result of `Arm.freedom`, with the map's margin and all limits.
        """
        return self.arm.freedom(pose)

    def pose(self, coordinates: ArrayLike) -> Floats:
        """Return poses of the end effector from the coordinates of the map.

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
            If a number is not finite, or the wrist is on the shoulder.
        """
        numbers = as_floats("coordinates", coordinates, (_COORDINATES,))
        if not np.isfinite(numbers).all() or not (np.hypot(numbers[..., 0], numbers[..., 1]) > 0).all():
            raise InputError("coordinates hold a number that is not finite, or the wrist on the shoulder")
        flat = np.ascontiguousarray(numbers).reshape(-1, _COORDINATES)
        out = np.empty((len(flat), 4, 4))
        self.arm._handle.poses_of_reduced(flat, out)
        return out.reshape((*numbers.shape[:-1], 4, 4))

    def coordinates(self, pose: ArrayLike) -> Floats:
        """Return r, z (m), tilt, turn, azimuth and roll (rad) of poses: the inverse of `pose`.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.

        Returns
        -------
        ndarray, shape (..., 6)
            The azimuth is 0 if the wrist lies on axis 1, the turn is 0 if axis 7 is along the line from
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
        """Return the positions that the end effector reaches, with the share of all orientations at each.

        In closed form, with all limits, the arm's tool and its base; not from the table, which describes the
        wrist at some azimuth and roll.

        Parameters
        ----------
        spacing : float
            Edge of a voxel, m.
        orientations : int
            Number of orientations tried at each, spread evenly over all rotations.

        Returns
        -------
        Voxels

        Raises
        ------
        InputError
        """
        return voxels_of(self.arm, spacing, orientations)

    def sample(self, n: int, seed: int = 0) -> Floats:
        """Return random poses from all those that the arm reaches, uniformly distributed.

        Poses are drawn uniformly over position and rotation, and those that `Arm.reachable` rejects are drawn
        again. The table, whose cells are samples, is not used.

        Parameters
        ----------
        n : int
            Number of poses, at most 100 million: for more call again with another seed.
        seed : int
            The same seed gives the same poses.

        Returns
        -------
        ndarray, shape (n, 4, 4)

        Raises
        ------
        InputError
            If n or the seed is not an integer of 0 or more, n is too large, or no reachable pose is found.
        """
        for name, value in (("n", n), ("seed", seed)):
            as_whole(name, value, 0, math.inf, "an integer, 0 or more")
        if n > _MOST_SAMPLES:
            raise InputError(f"n is {n}, wanted at most {_MOST_SAMPLES} at once: another seed draws more")
        out = np.empty((n, 4, 4))
        count = vain = 0
        draws = self._draws(np.random.default_rng(int(seed)))
        while count < n:
            some = next(draws)
            vain = vain + _TRIED_AT_ONCE if not len(some) else 0
            if vain == _VAIN:
                raise InputError(f"n is {n}, and of {_VAIN} poses drawn the arm holds none")
            out[count : count + len(some)] = some[: n - count]
            count += len(some)
        return out

    def _draws(self, rng: np.random.Generator) -> Iterator[Floats]:
        """Yield poses drawn uniformly among those with the wrist in reach, without the unreachable ones."""
        arm = self.arm
        inner, outer = arm._handle.reduced_distances()
        while True:
            drawn = rng.random((_DRAWN_AT_ONCE, _COORDINATES))
            distance = np.cbrt(inner**3 + drawn[:, 0] * (outer**3 - inner**3))
            height = 2 * drawn[:, 1] - 1
            beside = distance * np.sqrt(1 - height**2)
            angles = 2 * np.pi * drawn[:, 3:] - np.pi
            tilt = np.arccos(1 - 2 * drawn[:, 2])
            poses = self.pose(np.column_stack([beside, distance * height, tilt, angles]))
            for first in range(0, _DRAWN_AT_ONCE, _TRIED_AT_ONCE):
                some = poses[first : first + _TRIED_AT_ONCE]
                yield some[np.asarray(arm.reachable(some))]

    def to_xarray(self) -> Any:
        """Return the map as an xarray Dataset that reads values when they are used.

        Raises
        ------
        MissingExtraError
            Without xarray.
        """
        xarray = needed("xarray", "to_xarray() needs", "reach")
        return xarray.open_dataset(self.path, engine="zarr", consolidated=False, chunks=None)

    def __repr__(self) -> str:
        """Return the arm of the map and the share of computed tiles."""
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
    """Compute a map of an arm's reach, or continue one: existing tiles are not computed again.

    If it is killed at any moment and called again with the same arguments, the result has the same bytes as
    without interruption. Any number of processes with the same instruction set may work on one map.

    Parameters
    ----------
    arm : Arm
        Of any kind. Its `scene` is ignored.
    path : str or path
        A folder to create, or an address for fsspec.
    spacing : float
        Distance of wrist positions, m; at least 1e-4.
    tilt : float
        Angle between directions of axis 7, rad, 0.1° to 90°; slightly less if it does not divide π.
    fields : of "gc", "freedom", "yaw", "roll", "proven", "unproven"
        Fields of each cell: see `ReachMap`. ``unproven`` brings ``gc``, and is 0 unless the arm has its own
        chain, whose map always has both. ``proven`` takes ten to a hundred times as long, and decides many
        cells only if they are small: 10 mm and 1°.
    part : (int, int), optional
        ``(i, n)``, 1 <= i <= n: the i-th of n shares alone, for task i of a batch system's array.
    scheduler : distributed.Client or str, optional
        A Dask cluster, or the address of its scheduler, that computes the tiles; extra ``cluster``.
    progress : function (done, total) or bool
        Called after each tile; True draws a bar on stderr.

    Returns
    -------
    ReachMap
        Its ``missing`` is empty unless `part` left some.

    Raises
    ------
    InputError
        If an argument is invalid, or the path holds a map of another arm, grid, margin, fields, armangle
        version or instruction set, or something else.
    OutputError
        If it cannot be written, for example to a full disk; finished tiles stay, and the same call continues.
    UnsupportedError
        If `fields` names ``proven``, and the arm has its own chain.
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
    check_arm(arm)
    gap = as_number("spacing", spacing, _LEAST_SPACING, arm.geometry.reach)
    angle = as_number("tilt", tilt, _LEAST_ANGLE, _MOST_ANGLE)
    own = arm.geometry.chain is not None
    names = _names(fields, own)
    if own and "proven" in names:
        lacks = unsupported_offset_chain if isinstance(arm, OffsetArm) else unsupported
        raise lacks("reach_map(fields='proven')")
    _checked_run(part, scheduler, progress)  # before anything is written
    grid = Grid.of(arm._handle.reduced_distances()[1], gap, angle, slow=arm.kind != "srs")
    address(path)
    if grid.cells > _MOST_CELLS:
        raise InputError(f"spacing and tilt make {grid.cells:.3g} cells, wanted at most {_MOST_CELLS:.0e}")
    place = make_store(arm, path, grid, names).place
    return ReachMap(place).resume(part=part, scheduler=scheduler, progress=progress)


def _checked_field(name: str, known: tuple[str, ...]) -> str:
    """Return a field's name; raise if the map has no such field."""
    if name not in known:
        raise InputError(f"field is {name!r:.50}, wanted one of {', '.join(map(repr, known))}")
    return name


def _names(fields: Iterable[str], own: bool) -> tuple[str, ...]:
    """Return names of fields in the order of a store, with ``gc`` and ``unproven`` for an own chain, or if
    the latter is asked for; raise for unknown ones.
    """
    given = [fields] if isinstance(fields, str) else fields
    try:
        wanted = {*given}
    except TypeError:
        raise InputError(f"fields is {fields!r:.50}, wanted some of {', '.join(FIELDS)}") from None
    strange = [name for name in wanted if name not in FIELDS]
    if strange or not wanted:
        what = repr(strange[0])[:50] if strange else "nothing"
        raise InputError(f"fields holds {what}, wanted some of {', '.join(FIELDS)}")
    if own or "unproven" in wanted:
        wanted |= {"gc", "unproven"}
    return tuple(name for name in FIELDS if name in wanted)


def _checked_run(
    part: tuple[int, int] | None, scheduler: Any, progress: Progress | bool | None
) -> tuple[int, int]:
    """Return the part as (number from 1, count); raise if part, scheduler or progress are invalid."""
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
