"""What a test needs beyond the package: a module, a program, robot files. The one way of skipping.

Where ARMANGLE_NO_SKIP is set everything is promised to be there, and what is missing is a failure.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import pytest

NO_SKIP = "ARMANGLE_NO_SKIP"
MODELS_FOLDER = "ARMANGLE_MODELS"
ROOT = Path(__file__).resolve().parents[2]
MODELS = Path(os.environ.get(MODELS_FOLDER, ROOT.parent / "shared" / "models"))


def missing(reason: str) -> NoReturn:
    """Skip the test or module because something is missing; fail if no test may be skipped."""
    if os.environ.get(NO_SKIP):
        pytest.fail(f"{reason}, and {NO_SKIP} is set")
    pytest.skip(reason, allow_module_level=True)


class _Later(ModuleType):
    """A module that is imported when something of it is asked for.

    Most workers collect its tests and run none.
    """

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # what pytest asks of everything that it collects
            raise AttributeError(name)
        return getattr(importlib.import_module(self.__name__), name)


def need(name: str) -> ModuleType:
    """Return a module that the package itself does not need, imported when first used; skip without it."""
    try:
        found = importlib.util.find_spec(name)
    except ImportError:
        found = None
    if found is None:
        missing(f"{name} cannot be imported")
    return _Later(name)


def need_tool(name: str) -> str:
    """Return the path of a program, or skip."""
    path = shutil.which(name)
    if path is None:
        missing(f"{name} is not installed")
    return path


def no_models(reason: str) -> NoReturn:
    """Skip because robot files are missing; fail if ARMANGLE_MODELS says where they are."""
    if MODELS_FOLDER in os.environ:
        missing(reason)
    pytest.skip(f"{reason} (set {MODELS_FOLDER})")


def case(name: str) -> Path:
    """Return the path of a small file with a peculiarity of real robot files, or skip."""
    path = MODELS.with_name("cases") / name
    if not path.is_file():
        pytest.skip(f"no file {path}")
    return path


def model(name: str) -> Path:
    """Return the path of the real robot file `name`.urdf, or skip."""
    path = MODELS / f"{name}.urdf"
    if not path.is_file():
        no_models(f"no robot file {path}")
    return path
