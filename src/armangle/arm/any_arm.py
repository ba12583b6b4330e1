"""The part of `Arm` that other files of this folder use, which cannot import it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from .._arrays import Floats
from .._core import Wanted
from ..scenes.ready import Built
from .arcs import ArcSet
from .geometry import Geometry
from .solution import Solution


class AnyArm(Built, Protocol):
    """The functions that an arm must have; `Arm` documents them."""

    lower: Floats
    upper: Floats
    tool: Floats
    singularity_margin: float

    @property
    def geometry(self) -> Geometry:
        """Its lengths and its chain."""

    @property
    def redundancy(self) -> str:
        """The meaning of psi."""

    @property
    def deviation(self) -> Any:
        """How far its chain is off its nominal arm, with the angles in which branches merge."""

    @property
    def _nominal(self) -> AnyArm:
        """The arm that defines psi and gc."""

    @property
    def solve(self) -> Callable[..., Solution]:
        """The nearest solution of a pose."""

    @property
    def with_(self) -> Callable[..., Any]:
        """The arm with other numbers."""

    def __hash__(self) -> int: ...
    def forward(self, q: Floats, *, on_error: Any) -> tuple[Floats, Any, Any]: ...
    def inverse(self, pose: Floats, psi: Any, gc: Any, *, limits: bool, on_error: Any = ...) -> Floats: ...
    def within_limits(self, q: Floats, tol: float) -> Any: ...
    def feasible(self, pose: Any, gc: Any = None, *, per_joint: bool = False) -> ArcSet: ...
    def _left_out(self, pose: Any, gc: Any, wanted: Wanted = ...) -> ArcSet: ...
