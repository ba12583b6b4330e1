"""The package imports names when they are first used, all of them, and modules hide none."""

from __future__ import annotations

import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import armangle as aa


def test_the_package_is_lazy() -> None:
    code = "import armangle, sys; armangle.UnreachableError; dir(armangle); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    modules = set(done.stdout.split())
    assert "armangle.errors" in modules
    assert not {"numpy", "armangle.arm", "armangle._core"} & modules


def test_the_package_is_whole() -> None:
    assert set(aa._HOME) == set(aa.__all__) and set(aa.__all__) <= set(dir(aa))
    assert len(aa.__all__) == len(set(aa.__all__))
    names: dict[str, object] = {}
    exec("from armangle import *", names)
    for name in aa.__all__:
        assert names[name] is getattr(aa, name)
    with pytest.raises(AttributeError, match="module 'armangle' has no attribute 'nothing'"):
        aa.nothing  # noqa: B018 - to look it up is the test


def test_type_checkers_see_what_the_interpreter_sees() -> None:
    source = Path(aa.__file__).read_text()
    typed = source.split("if TYPE_CHECKING:")[1].split("\n# ")[0]
    for module, names in aa._HOMES.items():
        block = typed.split(f"from .{module} import")[1].split("from .")[0]
        assert set(block.replace("(", "").replace(")", "").replace(",", " ").split()) == set(names.split())


def test_no_module_hides_a_public_name() -> None:
    modules = [m.name for m in pkgutil.iter_modules(aa.__path__) if not m.name.startswith("_")]
    assert not set(modules) & set(aa.__all__)
    for name in modules:
        importlib.import_module(f"armangle.{name}")
    assert not [name for name in aa.__all__ if isinstance(getattr(aa, name), ModuleType)]
