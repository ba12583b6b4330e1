"""The core laws on every instruction set that this processor has."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.programs import counts

from armangle import _core, _cpu

ROOT = Path(__file__).resolve().parents[2]


OTHERS = [level for level in _core.LEVELS if _cpu.supports(level) and level != _core.ISA]


@pytest.mark.turns(2)
@pytest.mark.parametrize("level", OTHERS or [_core.ISA])
def test_the_core_laws_hold(level: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """core_laws.cpp finds no fault with the flags of the other levels that this processor has."""
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    flags = importlib.import_module("run_cpp").level_flags(level)
    found = counts("core_laws", *flags, compiler="g++")
    assert {found[name] for name in ("pose_lost", "joints_lost", "bits_differ", "wrong")} == {0}, found
    assert found["regular"] > 1000 and found["inside"] > 10_000 and found["outside"] > 10_000
    assert found["width"] == {"avx512": 8, "avx2": 4}.get(level, 2)


def refusal(has: set[str], isa: str | None, monkeypatch: pytest.MonkeyPatch) -> str:
    """What the import says on a processor with the instruction sets `has`, and ARMANGLE_ISA set to `isa`."""
    monkeypatch.setattr(_cpu, "supports", has.__contains__)
    monkeypatch.delenv("ARMANGLE_ISA", raising=False)
    if isa:
        monkeypatch.setenv("ARMANGLE_ISA", isa)
    with pytest.raises(ImportError) as caught:
        _core._load()
    return str(caught.value)


def test_a_level_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """The import refuses a level that the processor or the build lacks."""
    assert "--force-reinstall --no-deps ." in refusal(set(), None, monkeypatch)  # on another processor
    assert f"ARMANGLE_ISA is {_core.ISA!r}, but this" in refusal(set(), _core.ISA, monkeypatch)
    monkeypatch.setattr(_core, "find_spec", lambda name, package: name == f"._core_{_core.ISA}")
    other = next(level for level in _core.LEVELS if level != _core.ISA)
    assert f"ARMANGLE_ISA is {other!r}, but built" in refusal(set(_core.LEVELS), other, monkeypatch)


def test_the_portable_level_serves_where_the_best_is_missing() -> None:
    """On a processor with the lowest level alone the import takes that (in a process of its own)."""
    folder = Path(_cpu.__file__).parent
    worst = [level for level in _core.LEVELS if list(folder.glob(f"_core_{level}.*"))][-1]
    code = (
        f"from armangle import _cpu; _cpu.supports = {{{worst!r}}}.__contains__; "
        "import armangle; armangle.Arm; print(armangle.ISA)"
    )
    environment = {name: value for name, value in os.environ.items() if name != "ARMANGLE_ISA"}
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert run.stdout == f"{worst}\n", run.stderr


def test_an_unknown_level_is_refused() -> None:
    """An unknown ARMANGLE_ISA is refused with those that exist."""
    run = subprocess.run(
        [sys.executable, "-c", "import armangle; armangle.Arm"],
        env={**os.environ, "ARMANGLE_ISA": "mmx"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "ARMANGLE_ISA is 'mmx', wanted one of avx512, avx2, sse2, base" in run.stderr
