"""Distance fields from NPZ files."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

from .._arrays import PathLike
from ..errors import ModelError, SceneError
from ..scenes.shapes import Field
from .archive_blocks import read_blocks

_ARRAYS = ("distance", "origin", "spacing")


def load_field(path: PathLike, *, name: str | None = None) -> Field:
    """Return the distance field of an NPZ file.

    Parameters
    ----------
    path : path
        ``.npz`` with ``distance`` (I, J, K), ``origin`` (3,) and ``spacing``, all in m, as for `Field`.
    name : str, optional
        The field's name; None without it.

    Returns
    -------
    Field

    Raises
    ------
    SceneError
        If the ending is another, or the file cannot be read, lacks an array, or holds no valid field.

    Examples
    --------
    >>> import armangle as aa, numpy as np
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> file = Path(mkdtemp()) / "seen.npz"
    >>> np.savez(file, distance=np.full((5, 6, 7), 0.3), origin=[0.2, 0.0, 0.1], spacing=0.05)
    >>> aa.io.load_field(file, name="seen")
    Field(<5 x 6 x 7 nodes>, origin=(0.2, 0.0, 0.1), spacing=0.05, name='seen')
    """
    if Path(path).suffix.lower() != ".npz":
        _fail(path, "a file ending in .npz")
    try:
        held = read_blocks(path)
    except ModelError as error:
        _fail(path, f"an NPZ file that can be read ({error})")
    for key in _ARRAYS:
        if key not in held:
            _fail(path, f"arrays {', '.join(_ARRAYS)}: it holds no {key}")
    if held["spacing"].size != 1 or held["spacing"].dtype.kind not in "fiu":
        _fail(path, f"one number as spacing, not {held['spacing'].dtype} of shape {held['spacing'].shape}")
    return Field(held["distance"], held["origin"], float(held["spacing"].reshape(())), name=name)


def _fail(path: PathLike, wanted: str) -> NoReturn:
    """Raise the error of a file that holds no distance field."""
    raise SceneError("Field", "path", str(path), wanted)
