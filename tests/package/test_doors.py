"""Each target of the Makefile does what its help says: what it names is there, what it sets has effect."""

from __future__ import annotations

import importlib.util
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.needs import need_tool

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
TEXT = (ROOT / "Makefile").read_text(encoding="utf-8")
HELP = dict(re.findall(r"^([a-z-]+):.*?## (.*)$", TEXT, re.MULTILINE))
FOLDERS = (
    "contrib/", "tests/", "tools/", "docs", "benchmarks/", "examples/", "fuzz/", ".ci/", "include/",
    "bindings/",
)  # fmt: skip
PROGRAMS = ("fuzz/*.py", "tests/*/long_*.py", "tools/*.py", "benchmarks/*.py")
DRAWN = """
from laws.test_kinematics import sample
from support.strategies import arms
q = sample(arms()[0], "uniform")[0]
print(len(q), q[0, 0])
"""


def commands(target: str, *settings: str) -> str:
    """What make would run for a target."""
    return make("-n", "-B", f"PYTHON={sys.executable}", *settings, target)


def make(*words: str) -> str:
    """What make prints, also where a make runs this test."""
    of_make = ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")
    alone = {name: value for name, value in os.environ.items() if name not in of_make}
    command = [need_tool("make"), *words]
    return subprocess.run(command, cwd=ROOT, env=alone, capture_output=True, text=True, check=True).stdout


def named_files(text: str) -> set[str]:
    """Words of commands that name a file or a pattern of files of this repository, not one that is made."""
    words = [word.split("=")[-1].strip("'\"") for word in text.replace("\\\n", " ").split()]
    return {word for word in words if word.startswith(FOLDERS) and "_build" not in word}


def test_every_target_has_its_line_of_help() -> None:
    """Every target of the Makefile is phony and has its line in `make help`."""
    phony = set(re.search(r"^\.PHONY: (.*)$", TEXT, re.MULTILINE)[1].split())
    assert phony == set(HELP)
    assert set(re.findall(r"^([a-z-]+):", TEXT, re.MULTILINE)) == phony
    assert [line.split()[0] for line in make("help").splitlines()] == list(HELP)


def test_what_a_target_names_is_there() -> None:
    """Files that the commands of a target name exist."""
    for target in HELP:
        named = named_files(commands(target))
        assert named or target in ("help", "wheels", "manylinux"), f"make {target} names nothing"
        missing = [name for name in named if not list(ROOT.glob(name))]
        assert not missing, f"make {target} names {missing}, which are not there"
    assert "-m pytest" in commands("check")


def test_every_source_in_cpp_is_formatted() -> None:
    """`make format` covers every tracked C++ file."""
    listed = {path for name in named_files(commands("format")) for path in ROOT.glob(name)}
    tracked = subprocess.run(
        [need_tool("git"), "ls-files", "*.cpp", "*.hpp"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert {ROOT / name for name in tracked.stdout.split()} <= listed


def test_every_fuzzer_is_run() -> None:
    """`make fuzz` runs every fuzzer for SECONDS."""
    run = commands("fuzz", "SECONDS=7")
    fuzzers = {path.stem for path in (ROOT / "fuzz").glob("*.cpp")}
    assert fuzzers == set(re.search(r"^FUZZERS = (.*)$", TEXT, re.MULTILINE)[1].split())
    assert "-max_total_time=7" in run and "fuzz/texts.py 7" in run


def test_every_program_beside_the_tests_finds_what_it_imports(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fuzzers, long laws, tools and benchmarks, which `make check` does not run, can be imported."""
    found = [path for place in PROGRAMS for path in sorted(ROOT.glob(place))]
    programs = [path for path in found if not path.stem.startswith("test_")]
    assert len(programs) > 20
    for path in programs:
        monkeypatch.setattr(sys, "path", [str(path.parent), *sys.path])
        spec = importlib.util.spec_from_file_location(f"program_{path.stem}", path)
        monkeypatch.setitem(sys.modules, spec.name, importlib.util.module_from_spec(spec))
        spec.loader.exec_module(sys.modules[spec.name])


def test_the_quick_tests_leave_out_only_what_they_say() -> None:
    """`make test` leaves out two places, `make check` none."""
    left_out = re.findall(r"--ignore=(\S+)", commands("test"))
    assert left_out == ["tests/package", "tests/viewer/test_browser.py"]
    assert "--ignore" not in commands("check") and "--durations=10" in commands("check")


def drawn(settings: dict[str, str]) -> tuple[int, float]:
    """How many postures a law draws under an environment, and the first number of the first."""
    plain = {name: value for name, value in os.environ.items() if not name.startswith("ARMANGLE_LAWS")}
    run = subprocess.run(
        [sys.executable, "-c", DRAWN], cwd=ROOT / "tests", env={**plain, "PYTHONPATH": ".", **settings},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    count, first = run.stdout.split()
    return int(count), float(first)


def laws(*settings: str) -> dict[str, str]:
    """The environment that `make laws` sets."""
    words = shlex.split(commands("laws", *settings))
    return dict(word.split("=", 1) for word in words if word.startswith("ARMANGLE_LAWS"))


def test_laws_draw_the_count_and_the_seed_that_were_asked_for() -> None:
    """`make laws` draws EXAMPLES postures by SEED, the same each time."""
    suite, one = drawn({}), drawn(laws("EXAMPLES=321", "SEED=3"))
    assert suite[0] == 200 and one[0] == 321
    assert drawn(laws("EXAMPLES=321", "SEED=3")) == one
    firsts = {suite[1], one[1], drawn(laws("EXAMPLES=321", "SEED=4"))[1]}
    assert len(firsts) == 3


def test_laws_without_settings_take_the_seed_of_the_day() -> None:
    """`make laws` alone draws 5000 by the date as seed."""
    setting = laws()
    assert setting["ARMANGLE_LAWS_COUNT"] == "5000"
    assert re.fullmatch(r"20\d{6}", setting["ARMANGLE_LAWS_SEED"])


def test_wheels_hold_every_level() -> None:
    """`make wheels`, `manylinux` and `levels` build all instruction sets."""
    for target in ("wheels", "manylinux", "levels"):
        assert "ARMANGLE_LEVELS=all " in commands(target)


@pytest.mark.parametrize("level", ["avx512", "avx2", "sse2", "base"])
def test_the_benchmark_in_cpp_has_the_flags_of_the_library(level: str, tmp_path: Path) -> None:
    """`run_cpp.level_flags` has the library's flags, with -march unless the level is base; g++ takes them."""
    ask = f"import run_cpp; print(*run_cpp.level_flags({level!r}))"
    asked = subprocess.run(
        [sys.executable, "-c", ask], cwd=ROOT / "benchmarks", capture_output=True, text=True, check=True
    )
    flags = asked.stdout.split()
    assert {"-O2", "-ffp-contract=off", "-fno-gcse"} <= set(flags)
    assert any(flag.startswith("-march=") for flag in flags) == (level != "base")
    empty = tmp_path / "empty.cpp"
    empty.write_text("int main() { return 0; }\n", encoding="utf-8")
    host = level == "base" or platform.machine() in ("x86_64", "AMD64")
    if host:
        subprocess.run([need_tool("g++"), *flags, empty, "-o", tmp_path / "empty"], check=True)


@pytest.mark.parametrize("command", ["make demo", "make check"])
def test_the_first_screen_of_the_readme_prints_the_commands(command: str) -> None:
    """The README's first listing has `make demo` and `make check`."""
    first = README.split("\n## ")[0]
    assert re.search(rf"^{command}\b", re.search(r"^```sh\n(.*?)^```", first, re.M | re.S)[1], re.M)


def test_the_continuous_integration_runs_the_command_of_the_readme_and_skips_nothing() -> None:
    """`.ci/run` runs the README's `make check` without skips."""
    run = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    asked = re.search(r"^command=\$\((grep .*)\)$", run, re.M)[1]
    found = subprocess.run(shlex.split(asked), cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert found.strip() == "make check" and run.splitlines()[-1] == "$command"
    assert "export ARMANGLE_NO_SKIP=1" in run.splitlines()


@pytest.mark.parametrize(("target", "extra"), [("demo", "plot"), ("check", "test")])
def test_a_command_makes_its_environment_first(target: str, extra: str) -> None:
    """`make demo` and `make check` first run tools/environment."""
    first, then = commands(target).splitlines()
    assert first == f"tools/environment {extra}" and then.startswith(".venv/bin/")


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """A folder with tools/environment, pyproject.toml and a virtual environment that is Python alone."""
    (tmp_path / "tools").mkdir()
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    shutil.copy(ROOT / "tools" / "environment", tmp_path / "tools")
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    (tmp_path / ".venv" / "bin" / "python").symlink_to(sys.executable)
    return tmp_path


def environment(clone: Path, pip: str) -> subprocess.CompletedProcess[str]:
    """Run tools/environment in the clone with this shell script as `pip`."""
    script = clone / ".venv" / "bin" / "pip"
    script.write_text(f"#!/bin/sh\n{pip}\n", encoding="utf-8")
    script.chmod(0o755)
    others = ("ARMANGLE_PACKAGES", "ARMANGLE_INSTALL")
    alone = {name: value for name, value in os.environ.items() if name not in others}
    command = [clone / "tools" / "environment", "plot"]
    return subprocess.run(command, env=alone, capture_output=True, text=True)


def test_an_environment_that_is_there_is_kept_and_the_log_is_one_line(clone: Path) -> None:
    """With a virtual environment, tools/environment calls pip twice to install (what is needed, then the
    wheel) and once to build the wheel, and shows none of its output.
    """
    done = environment(clone, 'echo "$1 $*" >> asked; echo noise')
    assert done.returncode == 0 and "noise" not in done.stdout + done.stderr
    asked = sorted((clone / "asked").read_text(encoding="utf-8").splitlines())
    assert [line.split()[0] for line in asked] == ["install", "install", "wheel"]
    assert sum(line.endswith(".whl") for line in asked) == 1
    needed = (clone / "build" / "needed.txt").read_text(encoding="utf-8").split()
    assert [re.split(r"\W", name)[0] for name in needed] == ["numpy", "matplotlib"]


@pytest.mark.parametrize(("step", "log"), [("wheel", "compile"), ("install", "install-plot")])
def test_an_install_that_fails_says_why_and_fails(clone: Path, step: str, log: str) -> None:
    """tools/environment fails with pip, shows its output and names the log."""
    done = environment(clone, f"[ $1 != {step} ] || {{ echo no compiler; exit 3; }}")
    assert done.returncode == 1
    assert "no compiler" in done.stderr and f"build/{log}.log" in done.stderr
    assert "no compiler" in (clone / "build" / f"{log}.log").read_text(encoding="utf-8")


def test_a_python_that_is_too_old_is_named_before_any_work(clone: Path, tmp_path: Path) -> None:
    """tools/environment refuses an old Python by name and installs nothing."""
    old = tmp_path / "python3.10"
    old.write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    old.chmod(0o755)
    done = subprocess.run(
        [clone / "tools" / "environment", "plot"],
        env={**os.environ, "PYTHON": str(old)}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 1 and str(old) in done.stderr and "3.11" in done.stderr
    assert not (clone / "build" / "install-plot.log").exists()
