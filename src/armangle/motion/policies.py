"""Redundancy policies: how the arm angle moves on its feasible arc. Eq. (36)."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from numbers import Real
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import Floats, chosen, hint_degrees, named
from .._values import fill
from ..arm.wish import Direction, as_wish
from ..errors import InputError

Outside = Literal["nearest", "stop", "escape"]
_LONGEST = 1e9  # s, of a step
_OUTSIDE = named(_core.Outside)


def _check_number(name: str, value: float, low: float, high: float, low_open: bool) -> None:
    """Raise unless a number is between `low` (without itself if `low_open`) and `high`."""
    real = isinstance(value, Real) and not isinstance(value, bool)
    if not real or not low <= value <= high or (low_open and value == low):
        bracket = "(" if low_open else "["
        raise InputError(f"{name} is {value!r}, wanted a number in {bracket}{low:g}, {high:g}]")


def _gain(rate: float, dt: float | None) -> float:
    """Return the share K = 1 - exp(-rate dt) of the way per step, for a rate (1/s) and a step of dt (s).

    Raises `InputError` without dt.
    """
    if dt is None:
        raise InputError("dt is missing: a policy with rate= needs the time of a step in s")
    _check_number("dt", dt, 0.0, _LONGEST, True)
    return float(_core.gain(rate, dt))


class Policy:
    """What chooses the next arm angle: `Repulsion`, `Hold`, `Centre` or `Towards`.

    Its value is its arguments: copies, pickles and the core's object are made from them.
    """

    def _native(self, dt: float | None) -> Any:
        """Return the core's policy for a step of `dt` s."""
        raise NotImplementedError

    def __reduce__(self) -> tuple[Any, ...]:
        named = fields(self)  # type: ignore[arg-type]  # of the dataclasses below
        return type(self), tuple(getattr(self, f.name) for f in named if f.init)


class _Rated(Policy):
    """A policy with a strength K per step, or a rate per second."""

    K: float
    rate: float | None
    outside: Outside
    _fixed: Any

    def _fix(self) -> None:
        """Make the core's policy of K; raise unless K, the rate and `outside` are valid."""
        _check_number("K", self.K, 0.0, 1.0, False)
        if self.rate is not None:
            _check_number("rate", self.rate, 0.0, 1e9, False)
        chosen("outside", self.outside, _OUTSIDE)
        fill(self, _fixed=self._of_gain(self.K))

    def _of_gain(self, K: float) -> Any:
        """Return the core's policy with the strength K per step."""
        raise NotImplementedError

    def _native(self, dt: float | None) -> Any:
        """Return the core's policy for a step of `dt` s."""
        return self._fixed if self.rate is None else self._of_gain(_gain(self.rate, dt))


@dataclass(frozen=True)
class Repulsion(_Rated):
    """Repels the arm angle from both ends of its arc, which a full circle lacks; Eq. (36).

    Not to be confused with `Centre`, which pulls towards the middle from everywhere: with a large `alpha`
    this one does not move the arm angle until an end is near.

    Parameters
    ----------
    K : float
        Strength per step, in [0, 1]. The arm angle never leaves its arc.
    alpha : float
        Range of the repulsion, > 0: the larger, the nearer to an end it begins.
    rate : float, optional
        Strength per second (1/s), instead of K: K = 1 - exp(-rate·dt), independent of the step time.
    outside : "nearest", "stop" or "escape"
        If the arm angle lies in no arc: move to the nearer end in one step, or stop with a status. With
        "escape" steps in a `scene` leave a collision in as many steps as needed: CLEARANCE until then.

    Raises
    ------
    InputError
        If a parameter is out of range.

    Source: Faria et al. (2018), Eq. (36).
    """

    K: float = 0.1
    alpha: float = 20.0
    rate: float | None = None
    outside: Outside = "nearest"
    _fixed: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        _check_number("alpha", self.alpha, 0.0, 1e6, True)
        self._fix()

    def _of_gain(self, K: float) -> Any:
        """Return the core's policy with the strength K per step."""
        return _core.Policy(_core.Rule.REPULSION, K, self.alpha, _OUTSIDE[self.outside])


@dataclass(frozen=True)
class Hold(Policy):
    """Keeps the arm angle constant while it is feasible.

    Parameters
    ----------
    outside : "nearest", "stop" or "escape"
        As for `Repulsion`.

    Raises
    ------
    InputError
        If `outside` is none of these.
    """

    outside: Outside = "nearest"
    _fixed: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        chosen("outside", self.outside, _OUTSIDE)
        fill(self, _fixed=_core.Policy(_core.Rule.HOLD, 0.0, 1.0, _OUTSIDE[self.outside]))

    def _native(self, dt: float | None) -> Any:
        """Return the core's policy; `dt` has no influence."""
        return self._fixed


@dataclass(frozen=True)
class Centre(_Rated):
    """Pulls the arm angle towards the middle of its arc, if it has one, by the share K of the distance.

    Parameters
    ----------
    K : float
        Share per step, in [0, 1].
    rate : float, optional
        Strength per second (1/s), instead of K: K = 1 - exp(-rate·dt).
    outside : "nearest", "stop" or "escape"
        As for `Repulsion`.

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    K: float = 0.1
    rate: float | None = None
    outside: Outside = "nearest"
    _fixed: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self._fix()

    def _of_gain(self, K: float) -> Any:
        """Return the core's policy with the strength K per step."""
        return _core.Policy(_core.Rule.CENTRE, K, 1.0, _OUTSIDE[self.outside])


@dataclass(frozen=True)
class Towards(_Rated):
    """Moves the arm angle to a target within its arc: an arm angle, or a place for the elbow.

    Exactly one of psi, point and direction. The arm angle moves by the share K of the distance and stays on
    its arc; if the target is outside, it waits at the nearer end. On the full circle it takes the shorter
    way. A point or a direction becomes an arm angle at each pose (`Arm.psi_towards`). If all arm angles are
    equally good - arm stretched, point on the axis shoulder-wrist - there is no target, and the arm angle is
    constant.

    Parameters
    ----------
    psi : float, optional
        Arm angle, rad, any real within ±1e6; or
    point : array_like, shape (3,), optional
        Point that the elbow should be near, m, in the frame that poses are given in; or
    direction : array_like, shape (3,), or "up", "down", "left", "right", "forward" or "back", optional
        Direction along which the elbow should be as far as possible, in that frame: x forward, y left, z up.
    K : float
        Share of the distance per step, in [0, 1].
    rate : float, optional
        Strength per second (1/s), instead of K: K = 1 - exp(-rate·dt).
    outside : "nearest", "stop" or "escape"
        As for `Repulsion`.

    Raises
    ------
    InputError
        If not exactly one target is given, it is invalid, or a number is out of range.

    Examples
    --------
    >>> Towards(direction="up", K=1.0)
    Towards(psi=None, point=None, direction='up', K=1.0, rate=None, outside='nearest')
    """

    psi: float | None = None
    point: ArrayLike | None = None
    direction: Direction | None = None
    K: float = 0.1
    rate: float | None = None
    outside: Outside = "nearest"
    _wish: Any = field(init=False, repr=False, compare=False)
    _fixed: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        given = [name for name in ("psi", "point", "direction") if getattr(self, name) is not None]
        if len(given) != 1:
            these = " and ".join(given) or "no wish"
            raise InputError(f"{these} given, wanted one of psi, point, direction")
        fill(self, _wish=self._checked_wish())
        self._fix()

    def _checked_wish(self) -> tuple[_core.Wish, float, Floats]:
        """Return the target in the core's format; point and direction are kept as tuples, or as the word."""
        if isinstance(self.psi, str):
            raise InputError(f"psi is {self.psi!r}, wanted rad, or direction={self.psi!r} for the elbow")
        given: object = self.psi
        if isinstance(given, (list, tuple, np.ndarray)) and len(given) == 3:
            raise InputError(f"psi is {self.psi!r}, wanted rad, or point= or direction= for the elbow")
        if self.psi is not None:
            _check_number("psi", self.psi, -_core.LARGEST_ANGLE, _core.LARGEST_ANGLE, False)
            hint_degrees("psi", np.asarray(self.psi))
            return _core.Wish.PSI, float(self.psi), np.zeros(3)
        kind, target = as_wish(self.point, self.direction)
        name = kind.name.lower()
        if target.ndim != 1:
            raise InputError(f"{name} has shape {target.shape}, wanted (3,)")
        value = getattr(self, name)
        if not isinstance(value, str):
            fill(self, **{name: tuple(np.asarray(value, dtype=float).tolist())})
        return kind, float("nan"), target

    def _of_gain(self, K: float) -> Any:
        """Return the core's policy with the strength K per step."""
        kind, psi, target = self._wish
        return _core.Policy.towards(kind, psi, target, K, _OUTSIDE[self.outside])


POLICIES = (Repulsion, Hold, Centre, Towards)
