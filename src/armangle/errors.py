"""All errors of armangle, derived from :class:`ArmangleError`.

Messages state the fault, the place, the value, and the permitted values.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

_LONGEST = 4000  # characters of a message
_MIDDLE = " ... ({} characters) ... "


def shortened(text: str, longest: int = _LONGEST) -> str:
    """Return a text, with its middle removed if it is longer than `longest` characters.

    >>> shortened("abcdefghij" * 4, 34)
    'abcdefg ... (30 characters) ... ij'
    """
    if len(text) <= longest:
        return text
    middle = _MIDDLE.format(len(text) - longest)
    middle = _MIDDLE.format(len(text) - longest + len(middle))
    kept = max(longest - len(middle), 0)
    tail = kept // 4
    return text[: kept - tail] + middle + text[len(text) - tail :]


class ArmangleError(Exception):
    """Base of every error raised by armangle; the middle of a very long message is removed."""

    def __init__(self, *arguments: object) -> None:
        """Shorten very long texts."""
        super().__init__(*(shortened(x) if isinstance(x, str) else x for x in arguments))


class InputError(ArmangleError, ValueError):
    """An argument is invalid."""


class ModelError(InputError):
    """A file has invalid contents: a robot, scene, table or map.

    The message begins with file, line and column; ``reasons`` lists why armangle does not solve an arm, most
    important first.
    """

    reasons: tuple[str, ...]
    near: bool
    source: str | None
    line: int | None
    column: int | None

    def __init__(
        self,
        message: str,
        reasons: tuple[str, ...] = (),
        near: bool = False,
        *,
        source: str | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        """Put the place in the file in front of the message."""
        shown = source if source is None or source.isprintable() else repr(source)
        where = [str(part) for part in (shown, line, column) if part is not None]
        super().__init__(f"{':'.join(where)}: {message}" if where else message)
        self.reasons, self.near = reasons, near
        self.source, self.line, self.column = source, line, column


class UnsupportedError(ArmangleError, NotImplementedError):
    """A function does not support this kind of arm; the message names an alternative."""


class NoSolutionError(ArmangleError):
    """The geometry has no solution: base of the four classes below."""


class UnreachableError(NoSolutionError):
    """A pose is out of the reach of the arm."""


class LimitError(NoSolutionError):
    """Joint limits or margins leave no solution, or joint values violate the limits."""


class CollisionError(NoSolutionError):
    """Obstacles leave no solution."""


class PathError(NoSolutionError):
    """A path is not solved at every pose; the message says where and why."""


class Words(str):
    """Text that appears in a message without quotes."""

    __repr__ = str.__str__


class SceneError(InputError):
    """A shape, scene or collision model is invalid; ``shape``, ``name``, ``value`` identify the fault."""

    shape: str
    name: str
    value: Any

    def __init__(self, shape: str, name: str, value: Any, wanted: str) -> None:
        """Make the message from the shape, the argument, its value and what was wanted."""
        super().__init__(f"{shape}: {name} is {value!r:.200}, wanted {wanted}")
        self.shape = shape
        self.name = name
        self.value = value

    def __reduce__(self) -> tuple[Any, ...]:
        return _remade, (type(self), self.args[0], self.__dict__)


def _remade(kind: type[SceneError], message: str, attributes: dict[str, Any]) -> SceneError:
    """Return a copy of an error from its message and attributes (for pickle)."""
    new = kind.__new__(kind, message)
    new.args = (message,)
    new.__dict__.update(attributes)
    return new


class MissingExtraError(ArmangleError, ImportError):
    """An optional package is required; the message names the extra to install."""


class OutputError(ArmangleError, OSError):
    """A result cannot be written to the given place, or the viewer cannot serve at its port."""


def has_package(package: str) -> bool:
    """Return whether a package of an extra is installed."""
    return importlib.util.find_spec(package) is not None


def needed(package: str, purpose: str, extra: str) -> Any:
    """Return a package of an extra, by its name.

    `purpose` is the feature that requires it, such as "the viewer needs". Raises `MissingExtraError` with the
    command that installs `extra`.
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise MissingExtraError(
            f"{purpose} the package {package.split('.')[0]}: pip install 'armangle[{extra}]' "
            f"(from a clone: pip install '.[{extra}]')"
        ) from error
