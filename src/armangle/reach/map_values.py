"""The values of one field of a reach map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .store import Store


class MapValues:
    """A field of a map, indexed by cells like a Zarr array; errors name a damaged tile.

    Parameters
    ----------
    store : Store
    name : str
        Name of the field.

    Attributes
    ----------
    array : zarr.Array
        The array itself, for libraries that accept one.
    """

    def __init__(self, store: Store, name: str) -> None:
        """Keep the store and the name of the field."""
        self._store, self._name = store, name
        self.array: Any = store.arrays[name]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Cells along r, z, tilt and turn."""
        return self._store.grid.shape

    @property
    def ndim(self) -> int:
        """Four."""
        return len(self.shape)

    @property
    def dtype(self) -> np.dtype[Any]:
        """The stored type."""
        stored: np.dtype[Any] = np.dtype(self.array.dtype)
        return stored

    def __getitem__(self, index: Any) -> Any:
        """Return values as an array; reads only the tiles that hold them.

        Raises
        ------
        ModelError
            If one of these is damaged.
        IndexError
            If the cells do not exist.
        """
        try:
            return self.array[index]
        except IndexError:
            raise
        except Exception:  # a damaged file, in the words of a codec or the file system
            self._store.check_readable(self._name)
            raise

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """Return all values; they are always read, so the result is a copy."""
        if copy is False:
            raise ValueError("values of a map are read from its store, which makes a copy")
        return np.asarray(self[:], dtype)

    def __repr__(self) -> str:
        """Return the names of field and map."""
        return f"<MapValues of {self._name!r}: {' x '.join(map(str, self.shape))} of {self.dtype}>"
