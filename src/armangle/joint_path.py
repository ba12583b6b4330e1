"""JointPath: a motion in joint space along poses, as `follow` and `plan` return it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, Ints
from .arm import Arm
from .errors import PathError
from .status import STATUSES, Status


@dataclass(frozen=True, eq=False, repr=False)
class JointPath:
    """A motion along poses: one row a pose. Arrays are read-only; rows not reached are NaN, gc -1.

    Parameters
    ----------
    arm : Arm
        The arm that moves.
    s : ndarray, shape (N,)
        Path parameter in [0, 1].
    poses : ndarray, shape (N, 4, 4)
        Tool frames asked for, m.
    q : ndarray, shape (N, 7)
        Joint values, rad, lifted continuously over ±π.
    psi : ndarray, shape (N,)
        Arm angle, rad, lifted continuously.
    gc : ndarray of int64, shape (N,)
        Global configuration of each row.
    status : ndarray of int8, shape (N,)
        `Status` of each row.
    margin : ndarray, shape (N,)
        Least distance of a joint to one of its limits, rad.
    residual : ndarray, shape (N,)
        Distance of the tool's origin from its pose, m.
    certified : bool
        Whether limits are proven between the rows too; never by `follow`.
    diagnosis : object or None
        Why there is no path, from `plan`.
    """

    arm: Arm
    s: Floats
    poses: Floats
    q: Floats
    psi: Floats
    gc: Ints
    status: NDArray[np.int8]
    margin: Floats
    residual: Floats
    certified: bool = False
    diagnosis: Any = None

    def __post_init__(self) -> None:
        for name in ("s", "poses", "q", "psi", "gc", "status", "margin", "residual"):
            array = getattr(self, name).view()
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.s)

    @property
    def ok(self) -> bool:
        """Whether every pose is solved within all limits."""
        return bool((self.status == Status.OK).all())

    @property
    def first_failure(self) -> int | None:
        """Index of the first row that is not OK, or None."""
        bad = np.flatnonzero(self.status != Status.OK)
        return int(bad[0]) if len(bad) else None

    def explain(self) -> str:
        """Return in words whether the path holds, and if not, where and why it fails."""
        at = self.first_failure
        if at is None:
            return f"All {len(self)} poses are solved within all limits."
        done = int((self.status == Status.OK).sum())
        sentence = STATUSES[self.status[at]].sentence
        where = f"pose {at} (s = {self.s[at]:.4g}) is the first that is not"
        return f"{done} of {len(self)} poses are solved; {where}. {sentence}"

    def raise_for_status(self) -> None:
        """Raise `PathError` with the explanation, unless the path is ok."""
        if not self.ok:
            raise PathError(self.explain())

    def __repr__(self) -> str:
        state = "ok" if self.ok else f"fails at row {self.first_failure}"
        return f"<JointPath of {len(self)} poses, {state}>"
