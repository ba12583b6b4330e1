"""Global configuration GC: index 0..7 and the signs of joints 2, 4, 6. Eq. (2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import CONFIGURATIONS, IntOrArray, Ints, as_codes
from ..errors import InputError

_BITS = np.array([1, 2, 4], dtype=np.int64)


def gc_signs(gc: ArrayLike) -> Ints:
    """Return the signs (GC_2, GC_4, GC_6) of a global configuration index.

    Parameters
    ----------
    gc : array_like of int, shape (...)
        Index 0..7 = (θ2 < 0) + 2·(θ4 − δ < 0) + 4·(θ6 < 0), each angle wrapped.

    Returns
    -------
    ndarray of int64, shape (..., 3)
        +1 or -1 for shoulder, elbow, wrist.

    Raises
    ------
    InputError
        If an index is not an integer from 0 to 7.

    Source: Faria et al. (2018), Eq. (2).

    Examples
    --------
    >>> gc_signs(3).tolist()
    [-1, -1, 1]
    """
    index = as_codes("gc", gc, CONFIGURATIONS)
    return np.where(index[..., None] & _BITS, -1, 1)


def gc_index(signs: ArrayLike) -> IntOrArray:
    """Return the global configuration index of signs (GC_2, GC_4, GC_6).

    Parameters
    ----------
    signs : array_like of int, shape (..., 3)
        +1 or -1 for shoulder, elbow, wrist.

    Returns
    -------
    ndarray of int64, shape (...)
        Index 0..7.

    Raises
    ------
    InputError
        If the last axis is not 3, or an entry is neither +1 nor -1.

    Source: Faria et al. (2018), Eq. (2).

    Examples
    --------
    >>> int(gc_index([-1, -1, 1]))
    3
    """
    array = np.asarray(signs)
    if array.dtype.kind not in "fiu":
        raise InputError(f"signs is {signs!r}, wanted +1 or -1 in every entry")
    if array.ndim == 0 or array.shape[-1] != 3:
        raise InputError(f"signs has shape {array.shape}, wanted (..., 3)")
    if not np.all(np.abs(array) == 1):
        raise InputError(f"signs is {signs!r}, wanted +1 or -1 in every entry")
    index: Ints = ((array < 0) * _BITS).sum(axis=-1, dtype=np.int64)
    return index[()]
