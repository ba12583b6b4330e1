"""One joint as a function of the arm angle. Eqs. (26)-(31), (33), (34)."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import FloatOrArray, Floats, as_floats, check_angles
from .._values import by_content

Kind = Literal["stationary", "monotonic", "singular", "constant"]
_KINDS: dict[_core.Case, Kind] = {
    _core.Case.STATIONARY: "stationary",
    _core.Case.MONOTONIC: "monotonic",
    _core.Case.SINGULAR: "singular",
    _core.Case.CONSTANT: "constant",
}


@by_content
class JointFunction:
    """q_i(ψ) at a fixed pose and global configuration; created by `armangle.gradients.joint_function`.

    Attributes
    ----------
    joint : int
        The joint i, 1..7.
    """

    __slots__ = ("_handle", "_of", "joint")

    joint: int
    _of: tuple[Any, ...]
    _handle: _core.JointFunction

    def __init__(self, handle: _core.JointFunction, of: tuple[Any, ...], joint: int) -> None:
        """Keep the core's function, the arm, pose and branch that it is of, and the joint 1..7."""
        self._handle, self._of, self.joint = handle, of, joint

    def __reduce__(self) -> tuple[Any, ...]:
        return _remade, (*self._of, self.joint)

    def value(self, psi: ArrayLike) -> FloatOrArray:
        """Return the joint value, as `Arm.inverse` returns it without a seed.

        Parameters
        ----------
        psi : array_like, shape (...)
            Arm angles, rad.

        Returns
        -------
        float64, shape (...)
            rad, in robot coordinates, on the turn within the limits, or else the nearest to them.

        Raises
        ------
        InputError

        Source: Faria et al. (2018), Eqs. (26), (27).
        """
        return self._map(psi, self._handle.value)

    def derivative(self, psi: ArrayLike) -> FloatOrArray:
        """Return dq/dψ.

        Parameters
        ----------
        psi : array_like, shape (...)
            Arm angles, rad.

        Returns
        -------
        float64, shape (...)
            rad/rad; ±inf if θ2 (θ6) is 0 or π at this arm angle alone.

        Raises
        ------
        InputError

        Source: Faria et al. (2018), Eqs. (28), (29), (33).
        """
        return self._map(psi, self._handle.derivative)

    def _map(self, psi: ArrayLike, function: Any) -> FloatOrArray:
        """Return a function of the core, value or derivative, at each arm angle."""
        angles = as_floats("psi", psi)
        check_angles("psi", angles)
        out = np.empty(angles.shape)
        function(angles, out)
        return out[()]

    @property
    def stationary(self) -> Floats:
        """Arm angles where dq/dψ = 0, rad in (-π, π], shape (0..2,). Eqs. (30), (34)."""
        return np.array(self._handle.stationary, dtype=np.float64)

    @property
    def singular(self) -> Floats:
        """Arm angles where the joint jumps by π (1, 3, 5, 7) or has a corner at 0 or π (2, 6). Eq. (31)."""
        return np.array(self._handle.singular, dtype=np.float64)

    @property
    def kind(self) -> Kind:
        """The paper's case: "stationary", "monotonic", "singular"; or "constant"."""
        return _KINDS[self._handle.kind]

    def __repr__(self) -> str:
        return f"<JointFunction of joint {self.joint}, {self.kind}>"


def _remade(arm: Any, pose: Floats, gc: int, joint: int) -> JointFunction:
    """Return the joint function of an arm, pose and branch again (for pickle)."""
    return JointFunction(arm._handle.joint_function(pose, gc, joint - 1), (arm, pose, gc), joint)
