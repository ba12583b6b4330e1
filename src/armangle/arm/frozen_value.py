"""What is set once, when it is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class FrozenValue:
    """A value whose attributes are set when it is made and never after."""

    __slots__ = ()

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} is frozen: {name} cannot be set; use with_()")

    def _fill(self, values: Mapping[str, Any]) -> None:
        """Set the attributes of a value that is being made."""
        for name, value in values.items():
            object.__setattr__(self, name, value)
