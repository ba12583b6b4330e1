"""Values that are set once, on creation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class FrozenValue:
    """A value whose attributes are set on creation and never change."""

    __slots__ = ()

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} is frozen: {name} cannot be set; use with_()")

    def _fill(self, values: Mapping[str, Any]) -> None:
        """Set attributes by name, once, while the value is made."""
        for name, value in values.items():
            object.__setattr__(self, name, value)
