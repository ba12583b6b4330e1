"""Values that are set once, on creation."""

from __future__ import annotations


class FrozenValue:
    """A value whose attributes are set on creation and never change."""

    __slots__ = ()

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} is frozen: {name} cannot be set; use with_()")
