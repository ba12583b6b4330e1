"""search.hpp against a dense grid; the glue of contrib/moveit against headers that stand in for MoveIt's."""

from __future__ import annotations

import subprocess
from pathlib import Path

from support.needs import missing, need_tool

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
STRICT = ["-std=c++20", "-O1", "-Wall", "-Wextra", "-Wconversion", "-Werror", f"-I{ROOT / 'include'}"]


def printed(source: Path, folder: Path, *flags: str) -> dict[str, int]:
    """Return the lines "name count" of a program made of a source."""
    program = folder / source.stem
    subprocess.run([need_tool("g++"), *STRICT, *flags, str(source), "-o", str(program)], check=True)
    run = subprocess.run([str(program)], capture_output=True, text=True, check=True)
    return {name: int(count) for name, count in (line.split() for line in run.stdout.splitlines())}


def test_search_is_never_worse_than_a_grid_and_ends_with_a_proof(tmp_path: Path) -> None:
    counts = printed(HERE / "cpp" / "search.cpp", tmp_path)
    wrong = {name: count for name, count in counts.items() if name.startswith("wrong_")}
    assert len(wrong) == 8 and not any(wrong.values()), counts
    assert counts["narrow"] > 30 and counts["held"] == counts["beyond"] == 60 and counts["accepted"] > 20
    assert counts["shown"] > 10 * counts["refused"]


def test_the_glue_of_moveit_answers_what_moveit_asks(tmp_path: Path) -> None:
    """Against headers that stand in for MoveIt's: the glue's own logic, not its build."""
    eigen = Path("/usr/include/eigen3")
    if not (eigen / "Eigen" / "Geometry").is_file():
        missing("no Eigen in /usr/include/eigen3")
    flags = [f"-I{HERE / 'moveit_standin'}", f"-isystem{eigen}"]
    counts = printed(HERE / "cpp" / "moveit_plugin.cpp", tmp_path, *flags)
    assert counts["wrong"] == 0 and counts["right"] >= 19, counts
