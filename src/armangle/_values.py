"""Values compare by content: arrays element for element, NaN equals NaN. Results have no truth value."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import numpy as np

from ._arrays import frozen

Kind = TypeVar("Kind", bound=type)


def same(a: Any, b: Any) -> bool:
    """Return whether two values have the same content; NaN equals NaN in arrays of floats."""
    if a is b:
        return True
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        floats = a.dtype.kind == b.dtype.kind == "f"
        return bool(np.array_equal(a, b, equal_nan=floats))
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return False
    if isinstance(a, (tuple, list)) and isinstance(b, (tuple, list)):
        return len(a) == len(b) and all(map(same, a, b))
    return bool(a == b) or (isinstance(a, float) and isinstance(b, float) and a != a and b != b)


def by_content(kind: Kind) -> Kind:
    """Make objects of a class equal if their content is: a bool, never an array. They have no hash.

    The content is that of a tuple, the fields of a dataclass that take part in comparisons, or all attributes
    except the handle of the core. A class with ``ok`` is a result, which gets no truth value.
    """

    def equals(self: Any, other: object) -> Any:
        """Return whether both objects have the same content."""
        alike = isinstance(other, tuple) if issubclass(kind, tuple) else type(other) is type(self)
        return same(_content(self), _content(other)) if alike else NotImplemented

    def differs(self: Any, other: object) -> Any:
        """Return whether the contents differ."""
        found = equals(self, other)
        return found if found is NotImplemented else not found

    for name, method in (("__eq__", equals), ("__ne__", differs), ("__hash__", None)):
        setattr(kind, name, method)
    return without_truth(kind) if hasattr(kind, "ok") else kind


def fill(value: Any, **fields: Any) -> None:
    """Set fields of a frozen object, while it is made."""
    for name, field in fields.items():
        object.__setattr__(value, name, field)


def freeze(value: Any, *names: str) -> None:
    """Make the arrays of a frozen object read-only, while it is made; the caller's own stay writeable."""
    fill(value, **{name: frozen(getattr(value, name).view()) for name in names})


def without_truth(kind: Kind) -> Kind:
    """Let ``bool()`` and ``if`` raise for a result: they would be True without a solution."""

    def refuse(self: Any) -> bool:
        """Raise an error that names ``.ok``."""
        raise TypeError(f"{type(self).__name__} has no truth value: ask .ok, whether there is a solution")

    kind.__bool__ = refuse  # type: ignore[attr-defined]  # a class has no such attribute for mypy
    return kind


def _content(value: Any) -> list[Any]:
    """Return the parts of an object that count for equality."""
    if isinstance(value, tuple):
        return list(value)
    if is_dataclass(value):
        return [getattr(value, field.name) for field in fields(value) if field.compare]
    names = getattr(type(value), "__slots__", None) or sorted(vars(value))
    return [getattr(value, name) for name in names if name != "_handle"]
