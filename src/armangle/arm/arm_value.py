"""The arm as a value: its numbers, checked, compared, copied and printed."""

from __future__ import annotations

import math
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._arrays import Floats, Ints, as_floats, as_number, check_angles
from ..errors import InputError, LimitError, NotFiniteError, ShapeError
from ..models.description import JOINTS, ImportReport
from ..poses import as_transform

LEAST_LINK = 1e-6  # m: of upper arm and forearm; a shorter one is a mistake of units


def _seven(name: str, value: ArrayLike | None, default: float, *, infinite: bool = False) -> Floats:
    array = np.full(JOINTS, default) if value is None else as_floats(name, value, (JOINTS,)).copy()
    if array.shape != (JOINTS,):
        raise ShapeError(f"{name} has shape {array.shape}, wanted ({JOINTS},)")
    bad = np.isnan(array) if infinite else ~np.isfinite(array)
    if bad.any():
        at = int(np.argmax(bad))
        raise NotFiniteError(
            f"{name}[{at}] is {array[at]}, wanted a {'real' if infinite else 'finite'} number"
        )
    array.setflags(write=False)
    return array


def _length(name: str, value: float, low: float = -_core.LENGTH_LIMIT) -> float:
    return as_number(f"{name} (m)", value, low, _core.LENGTH_LIMIT)


def _check_link(what: str, along: str, across: str, values: dict[str, Any]) -> None:
    """Raise where the upper arm or forearm, slanted by its elbow offset, has no length."""
    length = math.hypot(values[along], values[across])
    if length < LEAST_LINK:
        raise InputError(
            f"{along} (m) is {values[along]:g} and {across} is {values[across]:g}: "
            f"the {what} is {length:g} m long, wanted at least {LEAST_LINK:g}"
        )


class _KeywordsAlone:
    """Says so where values come without names; a base, so that the signature stays that of ``__init__``."""

    __slots__ = ()

    def __new__(cls, *unnamed: object, **_: object) -> Self:
        if unnamed:
            raise TypeError(
                f"Arm takes keywords alone, but {len(unnamed)} values came without: "
                "wanted Arm(d_bs=..., d_se=..., d_ew=..., d_wf=..., ...)"
            )
        return super().__new__(cls)


class ArmValue(_KeywordsAlone):
    """The numbers of an arm, frozen; `Arm` adds what can be asked of them."""

    __slots__ = (
        "_core", "a_3", "a_4", "acceleration", "base", "d_bs", "d_ew", "d_se", "d_wf", "import_report",
        "joint_names", "lower", "name", "notes", "offsets", "signs", "tool", "upper", "velocity",
    )  # fmt: skip

    name: str
    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    a_3: float
    a_4: float
    lower: Floats
    upper: Floats
    signs: Ints
    offsets: Floats
    base: Floats
    tool: Floats
    velocity: Floats
    acceleration: Floats
    joint_names: tuple[str, ...]
    notes: tuple[str, ...]
    import_report: ImportReport | None
    _core: Any

    def __init__(
        self,
        *,
        d_bs: float,
        d_se: float,
        d_ew: float,
        d_wf: float,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        a_3: float = 0.0,
        a_4: float = 0.0,
        signs: ArrayLike | None = None,
        offsets: ArrayLike | None = None,
        base: ArrayLike | None = None,
        tool: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        name: str = "arm",
        joint_names: tuple[str, ...] | None = None,
        notes: tuple[str, ...] = (),
        import_report: ImportReport | None = None,
    ) -> None:
        values: dict[str, Any] = {
            "name": name,
            "d_bs": _length("d_bs", d_bs),
            "d_se": _length("d_se", d_se, 0.0),
            "d_ew": _length("d_ew", d_ew, 0.0),
            "d_wf": _length("d_wf", d_wf),
            "a_3": _length("a_3", a_3),
            "a_4": _length("a_4", a_4),
            "lower": _seven("lower", lower, -np.inf, infinite=True),
            "upper": _seven("upper", upper, np.inf, infinite=True),
            "offsets": _seven("offsets", offsets, 0.0),
            "velocity": _seven("velocity", velocity, np.inf, infinite=True),
            "acceleration": _seven("acceleration", acceleration, np.inf, infinite=True),
            "base": as_transform("base", base),
            "tool": as_transform("tool", tool),
            "joint_names": _checked_names(name, joint_names),
            "notes": (notes,) if isinstance(notes, str) else tuple(notes),
            "import_report": import_report,
        }
        _check_link("upper arm", "d_se", "a_3", values)
        _check_link("forearm", "d_ew", "a_4", values)
        sign = _seven("signs", signs, 1.0)
        _check_joints(values, sign)
        values["signs"] = sign.astype(np.int64)
        values["signs"].setflags(write=False)
        lengths = np.array([values[k] for k in ("d_bs", "d_se", "d_ew", "d_wf", "a_3", "a_4")])
        joints = np.concatenate([sign, values["offsets"], values["lower"], values["upper"]])
        values["_core"] = _core.Arm(lengths, joints, values["base"], values["tool"])
        for key, value in values.items():
            object.__setattr__(self, key, value)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"Arm is frozen: {name} cannot be set; use with_()")

    def with_(self, **changes: Any) -> Self:
        """Return a copy with some constructor arguments changed, such as ``tool=`` or ``lower=``."""
        return type(self)(**{**self._arguments(), **changes})

    def _arguments(self) -> dict[str, Any]:
        return {key: getattr(self, key) for key in ArmValue.__slots__ if key != "_core"}

    @property
    def reach(self) -> float:
        """Greatest distance shoulder-wrist, m."""
        return float(self._core.reach)

    @property
    def inner_reach(self) -> float:
        """Least distance shoulder-wrist, m."""
        return float(self._core.inner_reach)

    @property
    def delta(self) -> float:
        """Model angle θ4 of the stretched arm, rad; 0 without elbow offset."""
        return float(self._core.delta)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ArmValue):
            return NotImplemented
        mine, theirs = self._arguments(), other._arguments()
        skip = {"import_report", "notes"}
        return all(np.array_equal(mine[k], theirs[k]) for k in mine if k not in skip)

    def __hash__(self) -> int:
        return hash((self.name, self.d_bs, self.d_se, self.d_ew, self.d_wf, (self.lower + 0.0).tobytes()))

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (type(self), self._arguments())

    def __repr__(self) -> str:
        shown = [f"{k}={getattr(self, k)!r}" for k in ("d_bs", "d_se", "d_ew", "d_wf")]
        shown += [f"{k}={getattr(self, k)!r}" for k in ("a_3", "a_4") if getattr(self, k)]
        defaults = _arm_defaults()
        for key, default in defaults.items():
            value = getattr(self, key)
            if not np.array_equal(value, default):
                shown.append(f"{key}={_list_text(value)}")
        shown.append(f"name={self.name!r}")
        if self.joint_names != _joint_names():
            shown.append(f"joint_names={self.joint_names!r}")
        return f"Arm({', '.join(shown)})"


ArmValue.__init__.__qualname__ = "Arm"  # the name that Python's own messages on arguments begin with


def _rebuild(kind: type[ArmValue], arguments: dict[str, Any]) -> ArmValue:
    return kind(**arguments)


def _checked_names(name: str, joint_names: tuple[str, ...] | None) -> tuple[str, ...]:
    """Return the names of the joints; seven different ones, or the default."""
    if not isinstance(name, str):
        raise InputError(f"name is {name!r}, wanted a string")
    names = _joint_names() if joint_names is None else tuple(joint_names)
    if len(names) != JOINTS or len({*names}) != JOINTS or not all(isinstance(n, str) for n in names):
        raise InputError(f"joint_names is {joint_names!r}, wanted {JOINTS} different strings")
    return names


def _joint_names() -> tuple[str, ...]:
    return tuple(f"joint_{i}" for i in range(1, JOINTS + 1))


def _arm_defaults() -> dict[str, NDArray[Any]]:
    infinite = np.full(JOINTS, np.inf)
    return {
        "lower": -infinite, "upper": infinite, "signs": np.ones(JOINTS), "offsets": np.zeros(JOINTS),
        "base": np.eye(4), "tool": np.eye(4), "velocity": infinite, "acceleration": infinite,
    }  # fmt: skip


def _list_text(value: NDArray[Any]) -> str:
    """Return an array as Python source; infinities as float('inf')."""
    return (
        repr(value.tolist())
        .replace("-inf", "-float('inf')")
        .replace(" inf", " float('inf')")
        .replace("[inf", "[float('inf')")
    )


def _check_joints(values: dict[str, Any], sign: Floats) -> None:
    """Raise where the seven signs, limits or bounds contradict each other."""
    if not np.all(np.abs(sign) == 1):
        at = int(np.argmax(np.abs(sign) != 1))
        raise InputError(f"signs[{at}] is {sign[at]:g}, wanted +1 or -1")
    for name in ("lower", "upper", "offsets"):
        check_angles(name, np.where(np.isinf(values[name]), 0.0, values[name]))
    lower, upper = values["lower"], values["upper"]
    crossed = ~(lower <= upper) | (lower == np.inf) | (upper == -np.inf)
    if crossed.any():
        at = int(np.argmax(crossed))
        raise LimitError(
            f"lower[{at}] is {lower[at]:g} and upper[{at}] is {upper[at]:g}, wanted lower <= upper"
        )
    for name in ("velocity", "acceleration"):
        if not (values[name] > 0).all():
            at = int(np.argmax(~(values[name] > 0)))
            raise LimitError(f"{name}[{at}] is {values[name][at]:g}, wanted a positive number")
