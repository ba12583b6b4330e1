"""What a release is made of says the same everywhere: version, dependencies, licence, Python versions."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from support.needs import need

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
VERSION = re.search(r'ARMANGLE_VERSION "([^"]+)"', (ROOT / "include/armangle/version.hpp").read_text())


@pytest.fixture(scope="module")
def recipe() -> Any:
    """The recipe of conda."""
    return need("yaml").safe_load((ROOT / "contrib" / "conda" / "recipe.yaml").read_text(encoding="utf-8"))


def plain(requirement: str) -> str:
    """A requirement without blanks."""
    return requirement.replace(" ", "")


def test_the_recipe_of_conda_says_what_the_project_says(recipe: Any) -> None:
    """The conda recipe has the version of version.hpp, and requirements and licence of pyproject.toml."""
    assert VERSION and recipe["context"]["version"] == VERSION[1]
    needs = {name: {plain(r) for r in recipe["requirements"][name]} for name in ("host", "run")}
    assert {plain(r) for r in PROJECT["build-system"]["requires"]} <= needs["host"]
    assert {plain(r) for r in PROJECT["project"]["dependencies"]} <= needs["run"]
    python = f"python{PROJECT['project']['requires-python']}"
    assert python in needs["host"] and python in needs["run"]
    assert recipe["about"]["license"] == PROJECT["project"]["license"]
    assert recipe["about"]["license_file"] == PROJECT["project"]["license-files"]
    assert all((ROOT / name).is_file() for name in recipe["about"]["license_file"])


def test_wheels_are_for_every_python_that_is_promised() -> None:
    """cibuildwheel is told to begin at the lowest Python, and to build all levels and two architectures."""
    wheels = PROJECT["tool"]["cibuildwheel"]
    lowest = int(PROJECT["project"]["requires-python"].removeprefix(">=3."))
    assert wheels["build"].split()[0] == f"cp3{lowest}-*"
    assert wheels["environment"]["ARMANGLE_LEVELS"] == "all"
    assert set(wheels["linux"]["archs"]) == {"x86_64", "aarch64"}


def test_the_package_of_moveit_has_the_version() -> None:
    """contrib/moveit/package.xml has the version of version.hpp."""
    text = (ROOT / "contrib" / "moveit" / "package.xml").read_text(encoding="utf-8")
    assert VERSION and f"<version>{VERSION[1]}</version>" in text
