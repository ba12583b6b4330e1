"""Imports point one way: a module may use what is below it, never what is above."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

SOURCES = Path(__file__).parent.parent / "src" / "armangle"
LAYERS = [
    ["_core", "_cpu"],
    ["errors"],
    ["_extras"],
    ["status", "_arrays", "description"],
    ["urdf", "mjcf", "_catalogue", "detect", "arcs", "configuration", "joint_function", "diagnosis",
     "paths", "_curve", "_chain", "_axes", "_residual", "_urdf_joint", "_urdf_write", "_urdf_xml"],
    ["_rotations", "_arm_value"],
    ["_arm_kinematics"],
    ["_arm_limits"],
    ["arm"],
    ["policies"],
    ["joint_path"],
    ["_bounds", "_along", "_timing", "_step_options", "planning"],
    ["stepping"],
    ["following"],
    ["_toppra", "_ruckig", "trajectory"],
    ["_tool_speed"],
    ["retiming"],
    ["io", "_ros", "_blocks", "_csv", "_joint_rows", "_quaternions", "_replace", "_sheets", "_tables",
     "_motion", "_skeleton"],
    ["plots", "viewer"],
    ["demo"],
    ["cli"],
]  # fmt: skip
LEVEL = {name: k for k, layer in enumerate(LAYERS) for name in layer}
FAMILIES = {"_plots": "plots", "_viewer": "viewer"}


def level(name: str) -> int | None:
    """Height of a module of the package; None for the package itself."""
    for family, home in FAMILIES.items():
        if name.startswith(family):
            return LEVEL[home]
    return LEVEL.get(name)


def imported(path: Path) -> set[str]:
    """First names of the modules of the package that a file imports, also within its functions."""
    depth = len(path.relative_to(SOURCES).parts)
    out = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level == depth:
            names = [node.module] if node.module else [alias.name for alias in node.names]
            out |= {name.split(".")[0] for name in names}
    return out


FILES = [path for path in sorted(SOURCES.rglob("*.py")) if path.name not in ("__init__.py", "__main__.py")]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCES)))
def test_imports_point_down(path: Path) -> None:
    own = level(path.relative_to(SOURCES).parts[0].removesuffix(".py"))
    assert own is not None, f"{path.name} has no place in the order of imports"
    for name in imported(path):
        other = level(name)
        assert other is None or other <= own, f"{path.name} imports {name}, which is above it"
