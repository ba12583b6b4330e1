"""The package imports names when they are first used, all of them, and modules hide none."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import armangle as aa


def test_the_package_is_lazy() -> None:
    """Errors and `dir` of the package import neither numpy nor the core."""
    code = "import armangle, sys; armangle.UnreachableError; dir(armangle); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    modules = set(done.stdout.split())
    assert "armangle.errors" in modules
    assert not {"numpy", "armangle.arm", "armangle._core"} & modules


def test_the_package_is_whole() -> None:
    """`import *` gives all public names, and another name raises AttributeError."""
    assert set(aa._HOME) == set(aa.__all__) and set(aa.__all__) <= set(dir(aa))
    assert len(aa.__all__) == len(set(aa.__all__))
    names: dict[str, object] = {}
    exec("from armangle import *", names)
    for name in aa.__all__:
        assert names[name] is getattr(aa, name)
    with pytest.raises(AttributeError, match="module 'armangle' has no attribute 'nothing'"):
        aa.nothing  # noqa: B018 - to look it up is the test


def test_type_checkers_see_what_the_interpreter_sees() -> None:
    """The package's stub imports each name from the module that holds it."""
    tree = ast.parse(Path(aa.__file__).with_suffix(".pyi").read_text())
    seen = {
        alias.asname: node.module
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }
    assert seen == aa._HOME


def test_dir_shows_public_names_and_modules_alone() -> None:
    """`dir` is the public names and modules, which can be used without an import."""
    assert dir(aa) == sorted({*aa.__all__, *aa._MODULES})
    code = "import armangle; armangle.plots.circle; armangle.viewer.ViewerState; armangle.errors.InputError"
    subprocess.run([sys.executable, "-c", code], check=True)
