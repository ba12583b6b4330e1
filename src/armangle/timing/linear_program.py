"""Consecutive linear programs, solved by HiGHS: each starts from the solution of the previous one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import errors
from .._arrays import Floats
from ..errors import PathError


def needed(name: str) -> Any:
    """Return a package of the extra ``time``; raise `MissingExtraError` without it."""
    return errors.needed(name, "timing needs", "time")


class Basis(NamedTuple):
    """The basis of a solution: status of variables and rows."""

    columns: list[Any]
    rows: list[Any]


class LinearProgram:
    """The z in [lowest, highest] of least cost with rows z <= 1; rows may be added to a solved program.

    `cost`, `lowest`, `highest` (N,); `rows`, a sparse matrix (M, N); `basis` of a program with these
    variables and the first of these rows, whose numbers may differ.
    """

    def __init__(
        self, cost: Floats, rows: Any, lowest: Floats, highest: Floats, basis: Basis | None = None
    ) -> None:
        """Build the program that minimizes cost @ z; `basis` is where the solver begins."""
        highspy = needed("highspy")
        self._lowest, self._highest = lowest, highest
        self._solver = _silent(highspy)
        program = highspy.HighsLp()
        program.num_col_, program.num_row_ = len(cost), rows.shape[0]
        program.col_cost_ = cost / np.abs(cost).max()
        program.col_lower_, program.col_upper_ = lowest, highest
        program.row_lower_, program.row_upper_ = self._ends(rows.shape[0])
        matrix = program.a_matrix_
        matrix.format_ = highspy.MatrixFormat.kRowwise
        matrix.start_, matrix.index_, matrix.value_ = rows.indptr, rows.indices, rows.data
        self._solver.passModel(program)
        if basis is not None:
            begin = highspy.HighsBasis()
            free = [highspy.HighsBasisStatus.kBasic] * (rows.shape[0] - len(basis.rows))
            begin.col_status, begin.row_status = basis.columns, basis.rows + free
            begin.valid, begin.alien = True, False
            self._solver.setBasis(begin)

    @staticmethod
    def _ends(count: int) -> tuple[Floats, Floats]:
        """Return the lower and upper bounds of `count` rows: none and 1."""
        return np.full(count, -np.inf), np.ones(count)

    def add(self, rows: Any) -> None:
        """Add rows."""
        low, high = self._ends(rows.shape[0])
        begins = rows.indptr[:-1].astype(np.int32)
        places = rows.indices.astype(np.int32)
        self._solver.addRows(len(low), low, high, rows.nnz, begins, places, rows.data)

    def solved(self) -> Floats:
        """Return the solution z; raise `PathError` if there is none."""
        if not self._is_solved():
            self._solver.clearSolver()  # restart: the basis may have been misleading
            if not self._is_solved():  # time does not stop the program: a slow timing respects all bounds
                raise PathError(
                    "no timing is found: the linear programs of the path are too badly scaled; where it "
                    "begins or ends with hinges at 0, tolerance= or jerk= rounds that"
                )
        z = np.array(self._solver.getSolution().col_value)
        return np.asarray(np.clip(z, self._lowest, self._highest))

    def _is_solved(self) -> bool:
        """Solve the program and return whether the solver found the optimum."""
        self._solver.run()
        return bool(self._solver.getModelStatus() == needed("highspy").HighsModelStatus.kOptimal)

    @property
    def basis(self) -> Basis:
        """Return the basis of the last solution."""
        found = self._solver.getBasis()
        return Basis(list(found.col_status), list(found.row_status))


def _silent(highspy: Any) -> Any:
    """Return a solver that prints nothing, not even its banner, which appears at its first own call."""

    class Silent(highspy.Highs):  # type: ignore[misc]  # the package is an extra, and Any without it
        def enableCallbacks(self) -> Any:
            """Switch the solver's output off at its first own call."""
            self.setOptionValue("output_flag", False)
            return super().enableCallbacks()

    solver = Silent()
    solver.setOptionValue("output_flag", False)
    solver.setOptionValue("parallel", "off")
    solver.setOptionValue("simplex_dual_edge_weight_strategy", 1)  # Devex
    return solver
