"""Imports and includes point down: architecture.toml has the order of the rooms, for both languages."""

from __future__ import annotations

import ast
import os
import re
import tomllib
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src" / "armangle"
HEADERS = ROOT / "include" / "armangle"
ORDER = tomllib.loads((ROOT / "architecture.toml").read_text(encoding="utf-8"))
FACES = {"__init__", "__main__"}


def places(layers: list[dict[str, Any]]) -> dict[str, tuple[int, int]]:
    """Layer and place within it of each room; rooms that stand beside others have place 0."""
    found: dict[str, tuple[int, int]] = {}
    for height, layer in enumerate(layers):
        for place, room in enumerate(layer.get("ordered", ())):
            found[room] = (height, place)
        for room in layer.get("rooms", ()):
            found[room] = (height, 0)
    return found


PYTHON, CORE = places(ORDER["python"]), places(ORDER["core"])


def may_use(places: dict[str, tuple[int, int]], own: str, other: str) -> bool:
    """Whether a room may use another: itself, and what is below."""
    return own == other or places[other] < places[own]


def imported(path: Path) -> set[str]:
    """Rooms of the package that a file imports, also within its functions."""
    package = path.relative_to(SOURCES).parts[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = package[: len(package) - node.level + 1]
            inner = (*base, *(node.module.split(".") if node.module else ()))
            found |= {inner[0]} if inner else {alias.name for alias in node.names}
    return found


def imported_files(path: Path) -> set[Path]:
    """Files of the package that a file imports, for types alone and within its functions too."""
    package = path.parent
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not (isinstance(node, ast.ImportFrom) and node.level):
            continue
        inner = package.joinpath(*[".."] * (node.level - 1), *(node.module or "").split("."))
        named = [inner] if node.module else [inner / alias.name for alias in node.names]
        for place in map(Path, map(os.path.normpath, named)):
            found |= {file for file in (place.with_suffix(".py"), place / "__init__.py") if file.is_file()}
    return found


def python_room(path: Path) -> str:
    """The room of a Python file: its folder, or its name."""
    return path.relative_to(SOURCES).parts[0].removesuffix(".py")


def included(path: Path) -> list[Path]:
    """Headers of the library that a header includes, from the library's folder on."""
    names = re.findall(r'#include "([^"]+\.hpp)"', path.read_text(encoding="utf-8"))
    return [Path(os.path.normpath(path.parent / name)).relative_to(HEADERS) for name in names]


def core_room(path: Path) -> str:
    """The folder of a header (path within include/armangle), else its name, with or without ending."""
    if len(path.parts) > 1:
        return path.parts[0]
    return path.name if path.name in CORE else path.stem


FILES = [path for path in sorted(SOURCES.rglob("*.py")) if path.parent != SOURCES or path.stem not in FACES]
CORE_FILES = [path.relative_to(HEADERS) for path in sorted(HEADERS.rglob("*.hpp"))]


def pointing_up() -> list[str]:
    """Sentences on the imports and includes that do not point down."""
    wrong = []
    for path in FILES:
        own = python_room(path)
        wrong += [f"{path.name} of {own} imports {other}" for other in imported(path) & set(PYTHON)
                  if not may_use(PYTHON, own, other)]  # fmt: skip
    for path in CORE_FILES:
        wrong += [f"{path} includes {header}" for header in included(HEADERS / path)
                  if not may_use(CORE, core_room(path), core_room(header))]  # fmt: skip
    return wrong


def test_imports_and_includes_point_down() -> None:
    """Every file's room is in architecture.toml, and imports and includes point down."""
    assert {python_room(path) for path in FILES} <= set(PYTHON), "a room has no place in architecture.toml"
    assert {core_room(path) for path in CORE_FILES} <= set(CORE), "a room has no place in architecture.toml"
    assert pointing_up() == []


def test_no_file_imports_itself_through_others() -> None:
    """Imports within the package have no circle."""
    graph = {path: imported_files(path) for path in FILES}
    assert sum(map(len, graph.values())) > len(FILES)
    TopologicalSorter(graph).prepare()  # raises where files import one another in a circle


def test_what_is_included_from_outside_is_there() -> None:
    """Headers that C++ outside `include/` includes exist."""
    folders = ("bindings", "benchmarks", "contrib", "docs", "examples", "fuzz", "tests")
    paths = [path for folder in folders for path in (ROOT / folder).rglob("*.[ch]pp")]
    named = {(path, name) for path in paths if "_build" not in path.parts
             for name in re.findall(r"#include <armangle/([^>]+)>", path.read_text("utf-8"))}  # fmt: skip
    assert len(named) > 10 and not {(path, name) for path, name in named if not (HEADERS / name).is_file()}


def test_every_room_exists() -> None:
    """Each room of architecture.toml has a file or folder."""
    for room in PYTHON:
        assert list(SOURCES.glob(f"{room}*")), f"architecture.toml names {room}, which is not there"
    for room in CORE:
        assert list(HEADERS.glob(f"{room}*")), f"architecture.toml names {room}, which is not there"


ALLOWED = {
    ("files", "arm"): True, ("arm", "files"): False, ("plots", "viewer"): False, ("errors", "_core"): True,
    ("_core", "errors"): False,
}  # fmt: skip
IN_CORE = {("plan", "motion"): False, ("numbers", "arm"): False, ("plan", "circle"): True}


def test_the_order_refuses_what_points_up() -> None:
    """`may_use` allows and refuses known pairs of rooms."""
    for places_of, pairs in ((PYTHON, ALLOWED), (CORE, IN_CORE)):
        assert {pair: may_use(places_of, *pair) for pair in pairs} == pairs


def test_a_line_put_wrong_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`imported` sees an import within a function, which `may_use` refuses."""
    folder = tmp_path / "models"
    folder.mkdir()
    wrong = folder / "wrong.py"
    wrong.write_text("def late():\n    from ..arm.arm import Arm\n")
    monkeypatch.setattr(f"{__name__}.SOURCES", tmp_path)
    assert imported(wrong) == {"arm"} and not may_use(PYTHON, python_room(wrong), "arm")


@pytest.mark.parametrize("pattern, home", [(r"std::vector", "plan"), (r"std::thread", "batch")])
def test_claims_hold_by_folder(pattern: str, home: str) -> None:
    """Of the headers, those of `plan/` alone name std::vector, those of `batch/` alone std::thread."""
    found = {path for path in CORE_FILES if re.search(pattern, (HEADERS / path).read_text(encoding="utf-8"))}
    assert {core_room(path) for path in found} == {home}, found


STARTS_THREADS = re.compile(r"\b(?:Thread|ThreadPoolExecutor|ProcessPoolExecutor|start_new_thread)\(")


def test_threads_start_where_the_page_says() -> None:
    """Three files of the Python package start threads or processes, and docs/architecture.md names them."""
    found = {
        path.relative_to(SOURCES).as_posix()
        for path in FILES
        if STARTS_THREADS.search(path.read_text("utf-8"))
    }
    assert found == {"reach/filling.py", "viewer/server.py", "cli/screen.py"}
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in page for name in found)


def test_single_files_of_the_package_are_told() -> None:
    """docs/architecture.md names the files that lie beside the folders, but for those of the lowest layer."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    ground = set(ORDER["python"][0]["ordered"])
    for path in FILES:
        if path.parent == SOURCES and path.stem not in ground:
            assert f"`{path.name}`" in page, path.name


JOINT_MAP = re.compile(r"\bsigns(?:\[[^\]]*\])? \*|\* (?:\w+\.)*signs\b(?!\[:)")


def test_the_joint_map_stands_in_one_place() -> None:
    """No Python file of the package multiplies by `signs`: theta = s q + o is asked of `joint_map.hpp`."""
    assert JOINT_MAP.search("theta = arm.signs * q + arm.offsets")
    assert JOINT_MAP.search("(theta - offset) * self.signs") and JOINT_MAP.search("arm.signs[joint] * angle")
    assert not [path for path in FILES if JOINT_MAP.search(path.read_text(encoding="utf-8"))]


FIRST_GUESS = {
    "include/armangle/circle/forward.hpp": "inline Posture forward(",
    "include/armangle/circle/inverse.hpp": "inline Inverse inverse(",
    "include/armangle/arm/limits.hpp": "inline double limit_margin(",
    "include/armangle/arm/joint_map.hpp": "return sign * q + offset;",
    "include/armangle/arm/jacobian.hpp": "inline Jacobian jacobian(",
    "include/armangle/limits/cone.hpp": "struct Cone {",
    "include/armangle/motion/step.hpp": "Status choose_windings(",
    "include/armangle/chain/chain_arm.hpp": "struct ChainArm {",
    "include/armangle/batch/parallel.hpp": "std::thread",
    "src/armangle/models/urdf/origin.py": "def origin(",
    "src/armangle/colours.py": "JOINT_COLOURS =",
    "src/armangle/timing/grid.py": "def grid(",
    "src/armangle/timing/motion.py": "class Motion(Protocol)",
    "src/armangle/files/replacing.py": "def replacing(",
}
"""What a newcomer looks for, in the file whose name is the first guess, and in no other."""


def test_the_first_guess_is_right() -> None:
    """What a newcomer looks for is in the file of `FIRST_GUESS`."""
    texts = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
             for path in (*(HEADERS / path for path in CORE_FILES), *FILES)}  # fmt: skip
    for name, begin in FIRST_GUESS.items():
        holds = {
            path for path, text in texts.items() if Path(path).suffix == Path(name).suffix and begin in text
        }
        assert name in holds
        rooms = {Path(other).parts[2] for other in holds - {name}}
        assert rooms <= {"chain", "offset", "kuka.hpp", "kdl.hpp"}, f"{begin} also in {holds - {name}}"


def test_a_name_begins_with_its_folder_s_only_where_its_type_does() -> None:
    """A file whose name begins with its folder's defines a type of that name."""
    for path in (*HEADERS.rglob("*.hpp"), *SOURCES.rglob("*.py")):
        if path.parent not in (HEADERS, SOURCES) and path.stem.startswith(
            (f"{path.parent.name}_", f"{path.parent.name}s_")
        ):
            name = "".join(word.capitalize() for word in path.stem.split("_"))
            text = path.read_text(encoding="utf-8")
            assert re.search(rf"\b(?:struct|class) {name}\b", text), f"{path} defines no {name}"


# Headers named after a subject, not after the one thing they define; fronts and adapters.
SUBJECTS = {
    "scalar", "registers", "linalg", "angles", "arrays", "joints", "joint_map", "reference_plane", "path",
    "armangle", "plan", "kdl", "version", "offset", "begin", "end", "jerk", "saved",
}  # fmt: skip


def test_a_header_defines_what_it_is_named_after() -> None:
    """`x.hpp` defines x, X, or the plural or singular of one of them, unless x is one of SUBJECTS."""
    for path in (path for path in CORE_FILES if path.stem not in SUBJECTS):
        ones = (path.stem, "".join(word.capitalize() for word in path.stem.split("_")))
        names = {
            form for one in ones for form in (one, f"{one}s", one.removesuffix("s"), one.removesuffix("es"))
        }
        either = "|".join(sorted(names))
        code = re.sub(r"//[^\n]*", "", (HEADERS / path).read_text(encoding="utf-8"))
        kind = r"(?:struct|class|concept|namespace)\s+(?:\[\[\w+\]\]\s+)?(?:armangle::)?"
        assert re.search(rf"{kind}(?:{either})\b|\b(?:{either})\(", code), f"{path} defines none of {names}"


OPENING = {"open", "read_bytes", "read_text", "write_bytes", "write_text"}
OPEN_FILES = {"_opening.py", "files/replacing.py", "cli/main.py"}
"""To be read; to be written; a table of the package itself; the null device in place of a closed pipe."""


def opens_files(text: str) -> bool:
    """Whether a source calls `open` or a method of paths that reads or writes."""
    calls = [node.func for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
    names = {call.id for call in calls if isinstance(call, ast.Name)} & {"open"}
    return bool(names | {call.attr for call in calls if isinstance(call, ast.Attribute)} & OPENING)


def test_files_are_opened_in_one_place_to_be_read() -> None:
    """Only the files of `OPEN_FILES` open files."""
    found = {path for path in FILES if opens_files(path.read_text(encoding="utf-8"))}
    assert {path.relative_to(SOURCES).as_posix() for path in found} == OPEN_FILES
    assert opens_files("Path('a').read_text()") and opens_files("open('a')")
    assert not opens_files("'open(a)'") and not opens_files("shown.update()")
