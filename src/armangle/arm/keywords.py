"""Errors for a keyword that belongs to another method, or arguments in another order."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from inspect import signature
from typing import ParamSpec, TypeVar

from ..errors import InputError
from ..scenes.scene import Scene

_Asked = ParamSpec("_Asked")
_Answer = TypeVar("_Answer")


def names_keywords(
    kind: str | None, hints: Mapping[str, str]
) -> Callable[[Callable[_Asked, _Answer]], Callable[_Asked, _Answer]]:
    """Return a decorator that checks the keywords of methods of `kind` (None: of functions).

    A keyword that they do not accept raises an error with its hint; so does a `Scene` without a keyword.
    """

    def called(door: Callable[_Asked, _Answer]) -> str:
        """Return a function's name for error messages."""
        owner = door.__qualname__.removesuffix(".__init__")
        return owner if kind is None else f"{door.__name__} of an {kind}"

    def decorated(door: Callable[_Asked, _Answer]) -> Callable[_Asked, _Answer]:
        """Return the function with the check of its keywords before it."""
        known = signature(door).parameters

        @wraps(door)
        def asked(*args: _Asked.args, **keywords: _Asked.kwargs) -> _Answer:
            """Check the keywords, then call the function."""
            for name in keywords:
                if name in hints and name not in known:
                    raise InputError(f"{called(door)} takes no {name}=: {hints[name].format(name=name)}")
            if any(isinstance(given, Scene) for given in args):
                raise InputError(
                    f"{called(door)} takes no scene: arm.with_(scene=...) is an arm that keeps it"
                )
            return door(*args, **keywords)

        return asked

    return decorated
