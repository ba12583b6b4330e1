"""Rows of a joint file: the meaning of their columns, and invalid values."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from .._arrays import CONFIGURATIONS, JOINTS, Floats
from ..status import SOLVED, Status

JOINT_COLUMNS = tuple(f"q{i}" for i in range(1, JOINTS + 1))
OPTIONAL = ("s", "psi", "gc", "margin")
NO_GC = -1

_NAMES = {status.name: status for status in Status}
_S, _PSI, _GC, _ = range(JOINTS, JOINTS + len(OPTIONAL))

Fault = tuple[int, str, str]
"""Row, column and fault."""


def row_fault(numbers: Floats, words: list[str] | None, given: Collection[str]) -> Fault | None:
    """Return row, column and text of a fault of joint rows, each checked by itself; None if they have none.

    `numbers` (N, 11) are the columns q1..q7 and `OPTIONAL`, NaN if the file has none; `words` the status of
    each row, or None; `given` the columns of the file.
    """
    q, s, psi, gc = numbers[:, :JOINTS], numbers[:, _S], numbers[:, _PSI], numbers[:, _GC]
    if np.isinf(q).any():
        row, k = (int(i) for i in np.argwhere(np.isinf(q))[0])
        return row, JOINT_COLUMNS[k], f"{JOINT_COLUMNS[k]} is {q[row, k]}, wanted a joint value in rad"
    if "s" in given and not np.isfinite(s).all():
        row = int(np.argmin(np.isfinite(s)))
        return row, "s", f"s is {s[row]}, wanted a finite number"
    if np.isinf(psi).any():
        row = int(np.argmax(np.isinf(psi)))
        return row, "psi", f"psi is {psi[row]}, wanted an arm angle in rad"
    good = np.isnan(gc) | np.isin(gc, np.arange(NO_GC, CONFIGURATIONS))
    if not good.all():
        row = int(np.argmin(good))
        return row, "gc", f"gc is {gc[row]:g}, wanted a whole number from 0 to 7, or -1 for none"
    return None if words is None else _status_fault(q, words)


def _status_fault(q: Floats, words: list[str]) -> Fault | None:
    """Return the first row whose status is unknown, or is OK without all joints; None if there is none."""
    for row, word in enumerate(words):
        if word not in _NAMES:
            return row, "status", f"status is {word!r}, wanted one of {', '.join(_NAMES)}"
    solved = np.array([_NAMES[word] in SOLVED for word in words], dtype=np.bool_)
    missing = np.isnan(q) & solved[:, None]
    if missing.any():
        row, k = (int(i) for i in np.argwhere(missing)[0])
        return row, JOINT_COLUMNS[k], f"{JOINT_COLUMNS[k]} is nan in a row with status OK"
    return None


def unsaid_fault(numbers: Floats, status: NDArray[np.int8]) -> Fault | None:
    """Return the first row with status OK that lacks psi or gc although other OK rows have it, else None.

    A file without any psi or gc is valid.
    """
    ok = np.isin(status, SOLVED)
    gc = np.where(numbers[:, _GC] == NO_GC, np.nan, numbers[:, _GC])
    for name, column in (("psi", numbers[:, _PSI]), ("gc", gc)):
        missing = np.isnan(column) & ok
        if missing.any() and not missing[ok].all():
            row = int(np.argmax(missing))
            return row, name, f"{name} is missing in a row with status OK, and other rows have it"
    return None


def codes(numbers: Floats, words: list[str] | None) -> NDArray[np.int8]:
    """Return the `Status` of each row from its word; without words, OK if it has joints, else NOT_REACHED."""
    if words is not None:
        return np.array([_NAMES[word] for word in words], dtype=np.int8)
    solved = np.isfinite(numbers[:, :JOINTS]).all(axis=1)
    return np.where(solved, Status.OK, Status.NOT_REACHED).astype(np.int8)
