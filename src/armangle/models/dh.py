"""A chain from a Denavit-Hartenberg table, for example from a calibration."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import JOINTS, as_flag, as_floats
from ..errors import InputError
from ..poses import as_transform
from .chain import FloatArray, rotation_about, translation
from .report import LONGEST_LINK

_MOST_TURNED = 4.0 * np.pi
_X, _Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def dh_chain(
    rows: ArrayLike,
    *,
    modified: bool = False,
    base: ArrayLike | None = None,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return the chain of a Denavit-Hartenberg table, for `Arm`'s ``chain=``.

    Parameters
    ----------
    rows : array_like, shape (7, 4)
        For each joint a (m), alpha (rad), d (m) and the zero offset of theta (rad); theta = q + offset.
    modified : bool
        False: row i is ``Rz(theta) Tz(d) Tx(a) Rx(alpha)``, Denavit and Hartenberg's own order; True:
        ``Rx(alpha) Tx(a) Rz(theta) Tz(d)``, Craig's.
    base, tool : array_like, shape (4, 4), optional
        Frame of the first row in the frame that poses are given in; frame of the tip in the last one.

    Returns
    -------
    ndarray, shape (8, 4, 4)
        ``L0 Rz(q1) L1 ... Rz(q7) L7`` is the pose of the tip; positions in m.

    Raises
    ------
    InputError
        If an argument is not of that shape and finite, or angles above 4π or lengths above 10 m look like
        degrees or mm.

    Examples
    --------
    >>> half = np.pi / 2
    >>> a, d = np.zeros(7), np.array([0.34, 0, 0.4, 0, 0.4, 0, 0.126])
    >>> alpha = np.array([-half, half, half, -half, -half, half, 0])
    >>> links = dh_chain(np.column_stack([a, alpha, d, np.zeros(7)]))
    >>> links.shape, links[1, 2, 3].item()
    ((8, 4, 4), 0.34)
    """
    table = as_floats("rows", rows, (JOINTS, 4))
    if table.ndim != 2:
        raise InputError(f"rows has shape {table.shape}, wanted {(JOINTS, 4)}")
    if not np.isfinite(table).all():
        raise InputError(f"rows holds {table[~np.isfinite(table)][0]}, wanted finite numbers")
    _refuse_other_units(table)
    craig = as_flag("modified", modified)
    links = np.array([np.eye(4)] * (JOINTS + 1))
    links[0] = as_transform("base", np.eye(4) if base is None else base)
    for row, (a, alpha, d, offset) in enumerate(table):
        across = rotation_about(_X, alpha) @ translation([a, 0.0, 0.0])
        turned, along = rotation_about(_Z, offset), translation([0.0, 0.0, d])
        links[row] = links[row] @ across @ turned if craig else links[row] @ turned
        links[row + 1] = along if craig else along @ across
    links[JOINTS] = links[JOINTS] @ as_transform("tool", np.eye(4) if tool is None else tool)
    return links


def _refuse_other_units(table: FloatArray) -> None:
    """Raise if an angle is above 4π or a length beyond that of any link: probably degrees or mm."""
    units = (
        ("a", 0, LONGEST_LINK, "lengths are in m: was this in mm?"),
        ("alpha", 1, _MOST_TURNED, "angles are in rad: were these degrees?"),
        ("d", 2, LONGEST_LINK, "lengths are in m: was this in mm?"),
        ("offset of theta", 3, _MOST_TURNED, "angles are in rad: were these degrees?"),
    )
    for name, column, most, asked in units:
        row = int(np.argmax(np.abs(table[:, column])))
        if abs(table[row, column]) > most:
            raise InputError(f"rows[{row}] has {name} {table[row, column]:g}; {asked}")
