"""A reach map in a Zarr store: its arm and grid, its tiles, and which of them are complete.

A tile is written field by field, then marked by a check sum of its values. Both are independent of who writes
them, when and how often. A run that is killed loses its unfinished tiles, and any number of processes may
work on one store.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import PathLike
from .._core import ISA, __version__
from ..arm.arm import Arm
from ..errors import InputError, MissingExtraError, ModelError, OutputError, needed
from .grid import AXES, Grid

FIELDS = {"gc": "u1", "freedom": "f2", "yaw": "u1", "roll": "u1", "proven": "u1", "unproven": "u1"}
"""Fields that a map may have, with their stored types."""

USUAL = ("gc", "freedom", "yaw", "roll")
"""Fields of a map by default."""

_FORMAT = 1
_OLDEST = (3, 1, 3)  # of zarr: earlier versions write files in place
_MARK = "done"
_MORE = ("yaw", "roll", "proven", "unproven")  # fields that are computed on request only
_LEFT_OUT = ("body", "hand", "notes")  # of an arm: a map does not depend on these
_UNITS = {"r": "m", "z": "m", "tilt": "rad", "turn": "rad", "freedom": "rad", "yaw": "1/255", "roll": "1/255"}
_LEFT_OVER = "*.partial"  # unfinished files of a killed process

Tile = dict[str, NDArray[Any]]


class Store:
    """The Zarr group of one map, with its arm and grid."""

    def __init__(self, place: PathLike) -> None:
        """Open the map at a folder, or at an address that fsspec knows.

        Raises `ModelError` if there is no map, `MissingExtraError` without zarr.
        """
        self.place = address(place)
        group = _group(self.place)
        if group is None or not group.attrs:
            raise ModelError("there is no reach map", source=self.place)
        self.facts: dict[str, Any] = dict(group.attrs)
        if self.facts.get("format") != _FORMAT:
            raise ModelError(
                f"format is {self.facts.get('format')!r}, wanted {_FORMAT}: no reach map of this version",
                source=self.place,
            )
        self._group = group
        try:
            self.grid = Grid(**self.facts["grid"])
            self.fields: tuple[str, ...] = tuple(self.facts["fields"])
            float(self.facts["singularity_margin"])
        except (KeyError, TypeError, ValueError) as error:
            raise ModelError(f"zarr.json says no map: {error}", source=self.place) from None

    @cached_property
    def arm(self) -> Arm:
        """The arm, without collision model, gripper and scene."""
        numbers = {name: _from_json(value) for name, value in self.facts["arm"].items()}
        return Arm(**numbers, singularity_margin=self.facts["singularity_margin"])

    @cached_property
    def arrays(self) -> dict[str, Any]:
        """The fields as Zarr arrays."""
        with _zarr().config.set({"array.write_empty_chunks": True}):  # otherwise zarr checks each chunk
            try:
                return {name: self._group[name] for name in self.fields}
            except Exception as error:  # a missing file, or one that is not an array
                what = "a field's own zarr.json cannot be read: remove the folder and make the map again"
                raise ModelError(f"{what} ({error})", source=self.place) from error

    @cached_property
    def _marks(self) -> Any:
        """The array of marks: for each tile 0 if it is missing, else the check sum of its values."""
        return self._group[_MARK]

    # -- tiles -------------------------------------------------------------------------------------------
    def computed(self, tile: int) -> Tile:
        """Return the values of a tile's cells, computed from the arm."""
        grid = self.grid
        places = grid.places(tile)
        cells = (len(places), grid.tilts, grid.turns)
        made: Tile = {"gc": np.empty(cells, np.uint8), "freedom": np.empty(cells, np.float32)}
        made |= {name: np.empty(cells, np.uint8) for name in _MORE if name in self.fields}
        self.arm._handle.map_cells(
            places, grid.axes["tilt"], grid.axes["turn"], grid.steps, self.arm.singularity_margin,
            made["gc"], made["freedom"], made.get("yaw"), made.get("roll"), made.get("proven"),
            made.get("unproven"), 1,
        )  # fmt: skip
        return {name: made[name].astype(FIELDS[name], copy=False).reshape(grid.tile) for name in self.fields}

    def write(self, tile: int, values: Tile) -> None:
        """Store the values of a tile and then, as proof that it is complete, its check sum."""
        with self.writing():
            for name, array in self.arrays.items():
                array[self.grid.window(tile)] = values[name]
            self._marks[tile] = _check_sum(values.values())

    def read(self, tile: int) -> Tile:
        """Return the stored values of a tile; raise `ModelError` if one of its files is damaged."""
        return {name: self.read_field(name, tile) for name in self.fields}

    def read_field(self, name: str, tile: int) -> NDArray[Any]:
        """Return the stored values of one field of a tile; raise `ModelError` if the file is damaged."""
        with self.reading(f"tile {tile} of field {name!r}"):
            values: NDArray[Any] = self.arrays[name][self.grid.window(tile)]
        return values

    def check_readable(self, name: str) -> None:
        """Raise `ModelError` with the first tile of a field that cannot be read, if there is one."""
        for tile in range(self.grid.tiles):
            self.read_field(name, tile)

    def fill(self, tile: int) -> None:
        """Compute and write a tile, unless it is marked.

        Raises `InputError` if this process uses another instruction set than the one that began the map,
        `OutputError` if the store cannot be written.
        """
        if self.facts["isa"] != ISA:
            raise _of_another(self.place, "isa", self.facts["isa"], ISA)
        if not self._mark(tile):
            self.write(tile, self.computed(tile))

    # -- marks -------------------------------------------------------------------------------------------
    def missing(self) -> tuple[int, ...]:
        """Return the indices of the tiles that are not computed yet, or whose mark cannot be read."""
        return tuple(k for k, mark in enumerate(self._all_marks()) if not mark)

    def broken(self) -> Iterator[tuple[int, bool]]:
        """Yield each tile with a mark and whether its values differ; the mark of a wrong one is removed."""
        for tile, mark in enumerate(self._all_marks()):
            if not mark:
                continue
            try:
                wrong = _check_sum(self.read(tile).values()) != mark
            except ModelError:
                wrong = True
            if wrong:
                with self.writing():
                    self._marks[tile] = 0
            yield tile, wrong

    def _all_marks(self) -> list[int]:
        """Return the marks of all tiles; 0 for one that cannot be read."""
        try:
            return [int(mark) for mark in self._marks[:]]
        except Exception:  # one of them cannot be read
            return [self._mark(tile) for tile in range(self.grid.tiles)]

    def _mark(self, tile: int) -> int:
        """Return the stored mark of a tile: the check sum of its values.

        0 if there is no mark or it cannot be read. The tile itself is not read.
        """
        try:
            return int(self._marks[tile])
        except Exception:  # a damaged mark counts as missing
            return 0

    def sweep(self, before: float) -> None:
        """Remove unfinished files that killed processes left before a time (s, of the system's clock)."""
        if "://" in self.place:
            return
        for file in Path(self.place).rglob(_LEFT_OVER):
            try:
                if file.stat().st_mtime < before:
                    file.unlink()
            except OSError:  # another process was faster, or the folder is read-only
                continue

    @contextmanager
    def reading(self, what: str) -> Iterator[None]:
        """Replace Zarr's error by one that names the damaged part of the store and its repair."""
        try:
            yield
        except Exception as error:  # any error of zarr, a codec or the file system for a damaged file
            advice = "verify() names what is damaged and resume() makes it again, as do --verify and --resume"
            raise ModelError(
                f"{what} is damaged, {error}: {advice} of armangle reach", source=self.place
            ) from error

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Replace the file system's error by one that says that the store cannot be written."""
        try:
            yield
        except OSError as error:
            raise OutputError(f"{self.place}: cannot be written: {error.strerror or error}") from error


def address(place: PathLike) -> str:
    """Return an absolute folder, or an address with its scheme unchanged."""
    if not isinstance(place, (str, os.PathLike)) or not str(place) or "\0" in str(place):
        raise InputError(f"path is {place!r:.50}, wanted a folder, or an address that fsspec knows")
    text = str(place)
    return text if "://" in text else str(Path(text).absolute())


def make_store(arm: Arm, place: PathLike, grid: Grid, names: tuple[str, ...]) -> Store:
    """Return the store of a map; create it if there is none.

    Raises `InputError` if the place holds a different map, one of another armangle version, or something
    else; `OutputError` if it cannot be written.
    """
    facts: dict[str, Any] = {
        "format": _FORMAT, "armangle": __version__, "isa": ISA, "arm": _to_json(arm), "grid": asdict(grid),
        "fields": list(names), "singularity_margin": arm.singularity_margin,
    }  # fmt: skip
    where = address(place)
    try:
        group = _group(where)
        if group is None or not group.attrs:
            _make(where, facts, grid)
    except OSError as error:
        raise OutputError(f"{where}: cannot be written: {error.strerror or error}") from error
    store = Store(where)
    for name, wanted in facts.items():
        had = store.facts.get(name)
        if had != wanted:
            raise _of_another(where, name, had, wanted)
    return store


def _of_another(place: str, name: str, had: Any, wanted: Any) -> InputError:
    """Return the error for a map that was begun with another `name`, such as arm, grid or version."""
    if isinstance(had, dict) and isinstance(wanted, dict):
        names = [key for key in wanted if had.get(key) != wanted[key]]
        what = f"{name} that differs in {', '.join(names)}"
    else:
        what = f"{name} {had!r}, not {wanted!r}"
    more = f"; ARMANGLE_ISA={had} takes those instructions here" if name == "isa" else ""
    return InputError(f"{place} is a map with {what}: give another place, or what it was begun with{more}")


def _make(place: str, facts: dict[str, Any], grid: Grid) -> None:
    """Write the arrays without values; the description comes last, and makes it a valid map."""
    _check_free(place)
    zarr = _zarr()
    codecs = zarr.codecs.ZstdCodec(level=1), zarr.codecs.Crc32cCodec()
    for name in facts["fields"]:
        _array(place, name, grid.shape, grid.tile, FIELDS[name], AXES, codecs)
    for name, middles in grid.axes.items():
        _array(place, name, middles.shape, middles.shape, "f8", (name,), None)[:] = middles
    _array(place, _MARK, (grid.tiles,), (1,), "u4", ("tile",), None)
    zarr.open_group(_zarr_store(place), mode="a").attrs.put(facts)


def _array(
    place: str, name: str, shape: tuple[int, ...], chunks: tuple[int, ...], kind: str,
    axes: tuple[str, ...], codecs: Any,
) -> Any:  # fmt: skip
    """Create and return an array of the store, all 0; an equal one of a killed run is kept and returned."""
    zarr = _zarr()
    try:
        return zarr.create_array(
            _zarr_store(place), name=name, shape=shape, chunks=chunks, dtype=kind, fill_value=0,
            compressors=codecs, dimension_names=axes,
            attributes={"units": _UNITS[name]} if name in _UNITS else {},
        )  # fmt: skip
    except zarr.errors.ContainsArrayError:
        old = zarr.open_array(_zarr_store(place), path=name, mode="r+")
        if (old.shape, old.chunks, old.dtype) != (shape, chunks, np.dtype(kind)):
            raise InputError(
                f"{place} holds the beginning of another map: remove it, or give another place"
            ) from None
        return old


def _check_free(place: str) -> None:
    """Raise if a folder holds anything but the beginning of a map."""
    if "://" in place:
        return
    folder = Path(place)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{place} is a file, wanted a folder for a Zarr store")
    known = {*FIELDS, *AXES, _MARK, "zarr.json"}
    strange = sorted({entry.name for entry in folder.iterdir()} - known) if folder.exists() else []
    strange = [name for name in strange if not name.endswith(".partial")]
    if strange:
        raise InputError(f"{place} holds {strange[0]!r} and no reach map: give a folder that does not exist")


def _group(place: str) -> Any:
    """Return the Zarr group at a place, or None."""
    zarr = _zarr()
    if "://" not in place and not Path(place, "zarr.json").exists():
        return None
    try:
        return zarr.open_group(_zarr_store(place), mode="r+")
    except FileNotFoundError:
        return None
    except Exception as error:
        raise ModelError(f"no Zarr group: {error}", source=place) from error


def _zarr_store(place: str) -> Any:
    """Return the store object of zarr for a folder or an address."""
    storage = _zarr().storage
    return storage.FsspecStore.from_url(place) if "://" in place else storage.LocalStore(place)


def _zarr() -> Any:
    """Return the module zarr; raise if it is missing or too old."""
    zarr = needed("zarr", "a reach map needs", "reach")
    needed("zarr.storage", "a reach map needs", "reach")
    version = tuple(int(part) for part in zarr.__version__.split(".")[:3] if part.isdigit())
    if version < _OLDEST:
        wanted = ".".join(map(str, _OLDEST))
        raise MissingExtraError(f"a reach map needs zarr {wanted} or newer, and here is {zarr.__version__}")
    return zarr


def _check_sum(arrays: Any) -> int:
    """Return the CRC-32 of a tile's values; 1 instead of 0, which stands for a missing tile."""
    sum_so_far = 0
    for values in arrays:
        sum_so_far = zlib.crc32(np.ascontiguousarray(values).view(np.uint8).data, sum_so_far)
    return sum_so_far or 1


def _to_json(arm: Arm) -> dict[str, Any]:
    """Return the data of an arm that a map depends on, in words and numbers; infinities as text."""
    names = [field.name for field in fields(arm._described) if field.name not in _LEFT_OUT]
    numbers = {name: arm._number(name) for name in names}
    return {name: _plain(value) for name, value in numbers.items() if value is not None}


def _plain(value: Any) -> Any:
    """Return a value as JSON can hold it: arrays as lists, infinities as text."""
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value


def _from_json(value: Any) -> Any:
    """Return a value that `_plain` wrote: text "inf" as number, lists with text as tuples."""
    if isinstance(value, list):
        rows = [_from_json(one) for one in value]
        return tuple(rows) if any(isinstance(one, str) for one in rows) else rows
    return float(value) if value in ("inf", "-inf") else value
