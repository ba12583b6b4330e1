"""Optional packages: imported where they are used, and how to get those that are missing."""

from __future__ import annotations

import importlib
from typing import Any

from .errors import MissingExtraError


def needed(package: str, purpose: str, extra: str) -> Any:
    """Return a package of an extra.

    Parameters
    ----------
    package : str
        What to import.
    purpose : str
        What cannot be done without it, such as "the viewer needs".
    extra : str
        The extra that brings it.

    Raises
    ------
    MissingExtraError
        With the line that installs the extra.
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise MissingExtraError(
            f"{purpose} the package {package.split('.')[0]}: pip install 'armangle[{extra}]' "
            f"(from a clone: pip install '.[{extra}]')"
        ) from error
