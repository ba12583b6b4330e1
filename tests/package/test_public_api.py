"""The public names exist, are documented and typed; values are frozen, and their repr pastes back."""

from __future__ import annotations

import dataclasses
import doctest
import enum
import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.needs import need, need_tool
from support.strategies import arms

import armangle as aa

ROOT = Path(__file__).parents[2]
SCOPE = {cls.__name__: cls for cls in (aa.Arm, aa.ArcSet, aa.Repulsion, aa.Hold, aa.Centre, aa.Towards)}
POLICIES = [aa.Repulsion(0.2, 7), aa.Repulsion(rate=2.0), aa.Hold("stop"), aa.Centre(0.3)]
POLICIES += [aa.Towards(psi=0.2), aa.Towards(point=[1, 2, 3], rate=1.0), aa.Towards(direction="up")]
PUBLIC = {name: getattr(aa, name) for name in aa.__all__}
for module in (aa.io, aa.types, aa.gradients):
    PUBLIC |= {name: getattr(module, name) for name in module.__all__ if name not in PUBLIC}
NAMES = [name for name, value in PUBLIC.items() if not isinstance(value, str)]


def members() -> Iterator[tuple[str, Any]]:
    """Public names, and the public functions and properties of public classes."""
    for name in NAMES:
        value = PUBLIC[name]
        yield name, value
        if inspect.isclass(value) and not issubclass(value, Exception):
            for key, member in vars(value).items():
                public = inspect.isfunction(member) or isinstance(member, property | classmethod)
                if public and not key.startswith("_"):
                    yield f"{name}.{key}", getattr(value, key) if isinstance(member, classmethod) else member


MEMBERS = dict(members())
FUNCTIONS = {name: f for name, f in MEMBERS.items() if inspect.isfunction(f) or inspect.ismethod(f)}


def modules() -> list[str]:
    """Every module below armangle that is pure Python, private ones too."""
    found = [m.name for m in pkgutil.walk_packages(aa.__path__, "armangle.")]
    return [name for name in found if not name.rsplit(".", 1)[1].startswith(("_core_", "_cpu", "__main__"))]


def fields(value: type) -> set[str]:
    """What an object of a public class shows beside its methods; an enumeration's names have a table."""
    annotated = {name for cls in value.__mro__ for name in getattr(cls, "__annotations__", {})}
    own = annotated if value.__module__.startswith("armangle") else set()
    return {name for name in own | set(getattr(value, "_fields", ())) if not name.startswith("_")}


VALUES = [
    name
    for name in NAMES
    if inspect.isclass(PUBLIC[name]) and not issubclass(PUBLIC[name], (Exception, enum.Enum))
]


def test_every_field_is_in_the_docstring() -> None:
    """Each field of a public class is named in its docstring."""
    found = {name: fields(PUBLIC[name]) for name in VALUES}
    assert {"geometry", "report"} <= found["Arm"]
    assert "d_bs" in found["Geometry"] and "x" in found["Placement"]
    assert sum(map(len, found.values())) > 100
    texts = {name: f"{PUBLIC[name].__doc__} {PUBLIC[name].__init__.__doc__}" for name in VALUES}
    missing = [(name, field) for name in VALUES for field in found[name]
               if not re.search(rf"\b{field}\b", texts[name])]  # fmt: skip
    assert not missing


def test_every_name_is_documented() -> None:
    """The first line of every public member's docstring ends with a full stop or a colon."""
    texts = {name: inspect.getdoc(v.fget if isinstance(v, property) else v) for name, v in MEMBERS.items()}
    assert [
        n for n, text in texts.items() if not (text or "").partition("\n")[0].rstrip().endswith((".", ":"))
    ] == []


def test_every_function_is_typed_and_states_the_shape_of_its_arrays() -> None:
    """Public functions have annotations, and those that take arrays state shapes."""
    empty, bare = inspect.Parameter.empty, []
    for name, function in FUNCTIONS.items():
        signature, text = inspect.signature(function), inspect.getdoc(function) or ""
        given = [p for p in signature.parameters.values() if p.name not in ("self", "cls")]
        arrays = "Parameters\n" in text and any("ArrayLike" in str(p.annotation) for p in given)
        if signature.return_annotation is empty or any(p.annotation is empty for p in given):
            bare.append(f"{name} is not typed")
        if arrays and "shape" not in text:
            bare.append(f"{name} states no shape")
    assert not bare


def test_no_module_bears_the_name_of_a_public_function() -> None:
    """No module hides a public function, all modules imported."""
    found = modules()
    for name in found:
        try:
            importlib.import_module(name)
        except ImportError as error:
            assert isinstance(error, aa.MissingExtraError) or "mujoco" in str(error), name
    public = {name for name in aa.__all__ if inspect.isfunction(getattr(aa, name))}
    assert not public & {name.split(".")[1] for name in found}, "a module would hide a function"
    assert all(callable(getattr(aa, name)) for name in public)


def test_the_repr_of_an_arm_and_of_a_policy_is_itself() -> None:
    """`eval` of the repr of an arm or policy is equal to it; policies are frozen."""
    for arm in arms():
        again = eval(repr(arm), SCOPE)
        assert again == arm and hash(again) == hash(arm)
        assert arm.with_() == arm and arm.with_(d_se=arm.geometry.d_se + 0.1) != arm
    for policy in POLICIES:
        assert eval(repr(policy), SCOPE) == policy
        with pytest.raises(dataclasses.FrozenInstanceError):
            policy.outside = "stop"  # type: ignore[union-attr]  # of any of them


def test_a_path_is_a_frozen_value() -> None:
    """The field `q` of a JointPath, and a number in it, cannot be set."""
    arm = arms()[3]
    q = (arm.lower + arm.upper) / 2 + 0.3
    path = aa.follow(arm, arm.forward(q)[0][None], start=q)
    with pytest.raises(dataclasses.FrozenInstanceError):
        path.q = np.zeros((1, 7))
    with pytest.raises(ValueError, match="read-only"):
        path.q[0, 0] = 1.0


@pytest.mark.parametrize("name", modules())
def test_the_examples_in_the_docstrings_hold(name: str) -> None:
    """Doctests of every module pass."""
    assert doctest.testmod(need(name), optionflags=doctest.NORMALIZE_WHITESPACE).failed == 0


CPP = (
    "include/armangle", "include/armangle/*", "bindings", "examples/cpp", "fuzz", "tests/package/*",
    "benchmarks/cpp",
)  # fmt: skip
SOURCES = sorted(str(path) for folder in CPP for path in ROOT.glob(f"{folder}/*.[ch]pp"))
EXAMPLES = sorted(str(path) for path in ROOT.glob("examples/**/*.py"))  # as the programs of users are checked
LINT = {
    "ruff": ["ruff", "check", "."],
    "mypy": ["mypy", "--strict", "src", *EXAMPLES],
    "clang-format": ["clang-format", "--dry-run", "--Werror", *SOURCES],
}


@pytest.mark.parametrize("command", LINT.values(), ids=LINT)
def test_the_sources_pass(command: list[str]) -> None:
    """ruff, mypy and clang-format find no fault in the sources."""
    tool = Path(sys.executable).with_name(command[0])
    path = str(tool) if tool.exists() else need_tool(command[0])
    if command[0] == "mypy":  # it reads the stub of the core, which no checkout holds
        need("nanobind")
        core = Path(aa._core.__file__).parent, f"_core_{aa.ISA}", ROOT / "src/armangle/_core.pyi"
        subprocess.run([sys.executable, ROOT / "bindings" / "stub.py", *core], check=True)
    run = subprocess.run([path, *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-1000:]
