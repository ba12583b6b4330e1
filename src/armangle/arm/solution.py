"""The nearest solution of a pose, as a value; and one for each branch and arc."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._arrays import JOINTS, BoolOrArray, FloatOrArray, Floats, IntOrArray, Ints, StatusOrArray, frozen
from .._values import by_content
from ..errors import CollisionError, InputError, LimitError, NoSolutionError, UnreachableError
from ..status import STATUSES, Status, is_solved

_KINDS: dict[Status, type[NoSolutionError]] = {
    **dict.fromkeys((Status.UNREACHABLE, Status.FOLDED, Status.NO_POSTURE), UnreachableError),
    **dict.fromkeys(
        (Status.ELBOW_LIMIT, Status.ELBOW_MARGIN, Status.LIMITS, Status.NEAR_SINGULAR), LimitError
    ),
    **dict.fromkeys((Status.CLEARANCE, Status.POSE_BLOCKED), CollisionError),
}
_HINT = "arm.explain(pose) says by how much, and what would help."
_HINTS = {
    Status.NOT_ALLOWED: "arm.feasible(pose) has the arm angles of every branch that limits leave.",
}
"""Functions that explain a status, called like `solve`."""


@by_content
class Solution(NamedTuple):
    """A solution of a pose with its cost, or the reason for none.

    ``q (..., 7)`` rad; ``psi (...)`` rad in (-π, π]; ``gc (...)`` 0..7; ``distance (...)`` to the seed in the
    chosen metric, rad, NaN without a seed; ``status (...)`` a `Status`, for a batch int8 codes; ``margin
    (...)`` distance to the nearest joint limit, rad; ``pose (..., 4, 4)`` that q solves, and ``gap (...)`` by
    which it differs from the requested one, ``sqrt(|dp|² + (length·angle)²)``, m. If the status is OK, the
    pose is the requested one, but for a free roll, and the gap 0. The same holds for UNPROVEN: near
    singularities, where no proof excludes a nearer solution. Otherwise the numbers are NaN and gc is -1; with
    ``fallback="nearest_pose"`` they are those of the nearest pose.

    It is a tuple of these eight fields, so that ``q, psi, *_ = solution``. `row` gives one pose of a batch.
    """

    q: Floats
    psi: FloatOrArray
    gc: IntOrArray
    distance: FloatOrArray
    status: StatusOrArray
    margin: FloatOrArray
    gap: FloatOrArray
    pose: Floats

    @property
    def ok(self) -> BoolOrArray:
        """Whether there is a solution, shape (...)."""
        found = is_solved(self.status)
        return found if found.ndim else bool(found)

    def row(self, index: int | tuple[int, ...]) -> Solution:
        """Return the solution of one pose of a batch.

        Not to be confused with ``solution[index]``, which is one of the eight fields.

        Parameters
        ----------
        index : int or tuple of int
            The pose: one integer for each axis of the batch.

        Returns
        -------
        Solution
            Of one pose.

        Raises
        ------
        InputError
            If the index does not select one pose of the batch.

        Examples
        --------
        >>> import armangle as aa
        >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
        >>> q = np.array([[0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5], [0.2, 0.5, 0.1, -1.1, 0.2, 0.7, 0.4]])
        >>> two = arm.solve(arm.forward(q)[0], seed=q)
        >>> two.row(1).gc, len(two)
        (2, 8)
        """
        codes = np.asarray(self.status)
        at = index if isinstance(index, tuple) else (index,)
        whole = all(isinstance(i, (int, np.integer)) and not isinstance(i, bool) for i in at)
        known = whole and len(at) == codes.ndim
        if not known or not all(-n <= i < n for i, n in zip(at, codes.shape, strict=True)):
            raise InputError(
                f"index is {index!r:.50}, wanted that of one pose of a batch of shape {codes.shape}"
            )
        one = [np.asarray(column)[at] for column in self]
        q, psi, gc, distance, status, margin, gap, pose = one
        return Solution(
            q, float(psi), int(gc), float(distance), STATUSES[int(status)], float(margin), float(gap), pose
        )

    def raise_for_status(self) -> Solution:
        """Return the solution itself; raise if a pose has none.

        Raises
        ------
        UnreachableError, LimitError, CollisionError, NoSolutionError
            If there is no solution because of the reach, limits and margins, obstacles, or the caller's
            conditions.
        """
        codes = np.asarray(self.status)
        bad = np.argwhere(~is_solved(codes))
        if not len(bad):
            return self
        at = tuple(int(i) for i in bad[0])
        status = STATUSES[int(codes[at])]
        where = f"pose{list(at)}: " if at else ""
        more = f" ({len(bad)} of {codes.size} poses have none)" if at else ""
        raise _KINDS.get(status, NoSolutionError)(
            f"{where}{status.sentence}{more} {_HINTS.get(status, _HINT)}"
        )

    def __repr__(self) -> str:
        """Return the fields of one pose to six digits; for a batch the number of poses with a solution."""
        codes = np.asarray(self.status)
        if codes.ndim:
            found = int(is_solved(codes).sum())
            return f"<Solution of a batch {codes.shape}: {found} of {codes.size} poses have a solution>"
        if not np.isfinite(self.q).all():
            return f"<Solution: none, {self.status}>"
        joints = ", ".join(f"{x:.6g}" for x in self.q)
        off = "" if self.ok else f", gap={self.gap:.6g}"
        return (
            f"Solution(q=[{joints}], psi={self.psi:.6g}, gc={self.gc}, distance={self.distance:.6g}, "
            f"status={self.status}, margin={self.margin:.6g}{off})"
        )


@by_content
class Solutions:
    """The nearest solution of each branch and arc of a pose, by rising distance.

    With ``prefer="margin"``: by falling margin. For one pose a sequence of `Solution`.

    Attributes
    ----------
    count : int or ndarray of int64, shape (...)
        Their number.
    q : ndarray, shape (..., k, 7)
        Joint values, rad; k is the largest count. Rows beyond a pose's count are NaN.
    psi, distance, margin : ndarray, shape (..., k)
        Arm angle in (-π, π], distance to the seed in the chosen metric (NaN without a seed), distance to the
        nearest limit; rad.
    gc : ndarray of int64, shape (..., k)
        Global configurations; -1 beyond the count.
    status : Status, or ndarray of int8, shape (...)
        The reason if there are none; UNPROVEN if a nearer one is not excluded (`Solution`); otherwise OK.
    """

    __slots__ = ("_pose", "count", "distance", "gc", "margin", "psi", "q", "status")

    def __init__(self, shape: tuple[int, ...], columns: tuple[Any, ...], pose: Floats) -> None:
        """Arrange the core's flat solutions of each pose in padded arrays, read-only."""
        self._pose = frozen(pose.copy())
        count, q, psi, gc, distance, margin, status = columns
        width = int(count.max(initial=0))
        filled = np.arange(width) < count[:, None]

        def table(values: NDArray[Any], blank: float, *tail: int) -> NDArray[Any]:
            """Return a flat column of solutions as an array (poses, most solutions), padded with `blank`."""
            out = np.full((len(count), width, *tail), blank, values.dtype)
            out[filled] = values
            return frozen(out.reshape((*shape, width, *tail)))

        self.q: Floats = table(q, np.nan, JOINTS)
        self.psi: Floats = table(psi, np.nan)
        self.gc: Ints = table(gc, -1)
        self.distance: Floats = table(distance, np.nan)
        self.margin: Floats = table(margin, np.nan)
        counts, codes = count.reshape(shape), status.reshape(shape)
        self.count: IntOrArray = frozen(counts) if shape else int(counts)
        self.status: StatusOrArray = frozen(codes) if shape else STATUSES[int(codes)]

    @property
    def ok(self) -> BoolOrArray:
        """Whether there is a solution, shape (...)."""
        found = np.asarray(self.count) > 0
        return found if found.ndim else bool(found)

    def __len__(self) -> int:
        """Return the number of solutions of one pose."""
        return self._one("len()")

    def __iter__(self) -> Iterator[Solution]:
        """Iterate over the solutions of one pose, the nearest first."""
        return (self[k] for k in range(self._one("iteration")))

    def __getitem__(self, k: int) -> Solution:
        """Return solution k of one pose."""
        number = range(self._one("[]"))[k]
        return Solution(
            self.q[number], float(self.psi[number]), int(self.gc[number]), float(self.distance[number]),
            STATUSES[int(np.asarray(self.status))], float(self.margin[number]), 0.0, self._pose,
        )  # fmt: skip

    def _one(self, what: str) -> int:
        """Return the number of solutions; raise for a batch, where `what` has no meaning."""
        if isinstance(self.count, int):
            return self.count
        raise TypeError(f"{what} is of the solutions of one pose, these are of a batch {self.count.shape}")

    def __repr__(self) -> str:
        if not isinstance(self.count, int):
            return f"<Solutions of {self.count.size} poses, {int(self.count.sum())} solutions>"
        if not self.count:
            return f"<Solutions: none, {self.status}>"
        return f"<Solutions: {self.count}, branches {sorted({int(g) for g in self.gc})}>"
