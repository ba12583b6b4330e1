"""C++ users: the headers alone, and a project that finds the installed package, with g++ and clang++."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support import draw
from support.needs import missing, need_tool
from support.programs import SMALL

import armangle as aa

ROOT = Path(__file__).resolve().parents[2]
INCLUDE = ROOT / "include"
CONSUMER = ROOT / "tests" / "package" / "consumer"
EXAMPLES = ROOT / "examples" / "cpp"
PACKAGE = Path(aa.__file__).parent
HEADERS = sorted(str(path.relative_to(INCLUDE / "armangle")) for path in INCLUDE.rglob("*.hpp"))
ALONE = [header for header in HEADERS if header != "kdl.hpp" and "names" not in header]
COMPILERS = ("g++", "clang++")
X86 = platform.machine() in ("x86_64", "AMD64")
LEVELS = ("x86-64", "x86-64-v3", "x86-64-v4") if X86 else ("native",)
WARNINGS = ["-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-Wsign-conversion", "-Wold-style-cast"]
STRICT = ["-std=c++20", *WARNINGS, "-Werror"]
UMBRELLAS = ("armangle.hpp", "plan.hpp", "offset.hpp", "search.hpp", "kuka.hpp")
# Plain words that <windows.h>, <X11/Xlib.h>, <curses.h> and their like define away.
FOREIGN_MACROS = re.findall(
    r"\w+",
    """
    near far small hyper min max NEAR FAR IN OUT OPTIONAL ERROR TRUE FALSE CONST VOID BOOL interface
    pascal cdecl DELETE STRICT PURE IGNORE INFINITE ABSOLUTE RELATIVE NO_ERROR DIFFERENCE TRANSPARENT
    OPAQUE ALTERNATE WINDING DOMAIN OVERFLOW UNDERFLOW SING PLOSS TLOSS DrawText GetObject SendMessage
    CreateWindow Yield Bool Status None Success Always Never True False Complex Convex Nonconvex
    Opposite Above Below Unsorted Full Expose FocusIn FocusOut KeyPress GrayScale CurrentTime BadValue
    BadMatch InputOutput StaticColor Button1 OK ERR MIN MAX check verify require signals slots emit
    foreach unix linux major minor nil YES NO
    """,
)
PROGRAMS = [*sorted(EXAMPLES.glob("*.cpp")), ROOT / "fuzz" / "plan.cpp"]
BARE = ["-fno-exceptions", "-fno-rtti"]
START_DEG = [-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812]


def run(*command: object, cwd: Path | None = None) -> str:
    """Return what a command prints on stdout; if it fails, so does the test, with all its output."""
    done = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def table(printed: str) -> dict[str, list[list[float]]]:
    """Return lines 'name number number ...' by name, lists of their numbers; 'status' is left out."""
    out: dict[str, list[list[float]]] = {}
    for line in printed.splitlines():
        name, *rest = line.split()
        if name != "status":
            out.setdefault(name, []).append([float(x) for x in rest])
    return out


@pytest.fixture(scope="module", params=COMPILERS)
def compiler(request: pytest.FixtureRequest) -> str:
    """Each compiler in turn."""
    return need_tool(request.param)


def included(header: str) -> set[str]:
    """Return what a header itself includes: ours by their names in HEADERS, others as they are written."""
    text = (INCLUDE / "armangle" / header).read_text()
    names = re.findall(r'^#include [<"](?:armangle/)?(.+)[>"]$', text, re.MULTILINE)
    near = [os.path.normpath(Path(header).parent / name) for name in names]
    return {ours if ours in HEADERS else name for ours, name in zip(near, names, strict=True)}


def orders(most: int) -> list[list[str]]:
    """Return orders of all headers: each comes behind what it includes, and by turns ahead of the rest.

    A header that compiles ahead of another does not need it: the orders show as many such pairs as they can.
    """
    direct = {header: included(header) for header in ALONE}
    behind: dict[str, set[str]] = {name: set() for name in set(direct).union(*direct.values())}
    for _ in range(len(direct)):
        behind |= {name: direct[name].union(*(behind[other] for other in direct[name])) for name in direct}
    left = {name: set(behind) - behind[name] - {name} for name in direct}
    found = []
    for _ in range(most):
        order: list[str] = []
        while ahead := sorted(set(behind).difference(order)):
            with_it = {name: (behind[name] | {name}).difference(order) for name in ahead}
            shown = {name: len(left.get(name, set()).difference(order, with_it[name])) for name in ahead}
            best = max(ahead, key=lambda name: shown[name] / len(with_it[name]) ** 0.5)
            order += sorted(with_it[best], key=lambda name: (len(behind[name]), name))
        for place, name in enumerate(order):
            left.get(name, set()).difference_update(order[place:])
        found.append([name for name in order if name in direct])
    return found


BOTH = [(compiler, level) for level in LEVELS for compiler in COMPILERS]
WAYS = BOTH if draw.COUNT else [("g++", LEVELS[0]), ("clang++", LEVELS[-1])]
COUNT = len(WAYS) + (len(ALONE) if draw.COUNT else 0)


@cache
def units() -> list[list[str]]:
    """Return what each unit includes: all headers in some order, or one alone."""
    return orders(len(WAYS)) + [[header] for header in ALONE]


@pytest.mark.parametrize("number", range(COUNT))
def test_headers_need_only_what_they_include_behind_foreign_macros(number: int, tmp_path: Path) -> None:
    """Headers in several orders compile behind FOREIGN_MACROS with strict warnings, and leave these as they
    are; `min` and `max` the standard library removes itself.

    g++ takes the least instruction set and clang++ the best. The examples behind all headers use the
    templates. `make thorough` takes both compilers for each set, and compiles each header alone too.
    """
    lines = [f"#undef {word}\n#define {word} )) macro ((" for word in FOREIGN_MACROS]
    lines += [f"#include <armangle/{header}>" for header in units()[number] for _ in range(2)]
    kept = [word for word in FOREIGN_MACROS if word not in ("min", "max")]
    lines += [f"#ifndef {word}\n#error {word}\n#endif\n#undef {word}" for word in kept]
    if number < len(WAYS):
        lines += ['#pragma GCC diagnostic ignored "-Wreturn-type"']  # allowed in `main` alone
        lines += [f'#undef main\n#define main {path.stem}\n#include "{path}"' for path in PROGRAMS]
    source = tmp_path / "headers.cpp"
    source.write_text("\n".join(lines) + "\n")
    compiler, level = WAYS[number % len(WAYS)]
    more = [f"-march={level}", *(["-Wcomma"] if compiler == "clang++" else [])]
    run(need_tool(compiler), *STRICT, *BARE, *more, f"-I{INCLUDE}", "-fsyntax-only", source)


@pytest.mark.turns(4)
@pytest.mark.parametrize("header", UMBRELLAS)
def test_an_older_standard_is_one_error_that_names_the_one_needed(header: str, compiler: str) -> None:
    """C++17 gets one error, which says that C++20 is needed."""
    command = [compiler, "-std=c++17", f"-I{INCLUDE}", "-fsyntax-only", "-x", "c++", "-"]
    program = f"#include <armangle/{header}>\narmangle::Arm arm;\n"
    done = subprocess.run(command, input=program, capture_output=True, text=True)
    assert done.returncode != 0
    (error,) = [line for line in done.stderr.splitlines() if "error:" in line]
    assert "armangle needs C++20" in error


def test_fast_math_is_refused() -> None:
    """g++ with -ffast-math gets an error of armangle.hpp that asks for IEEE arithmetic."""
    ends = ["-Wfatal-errors", "-fsyntax-only", "-x", "c++", "-"]
    command = [need_tool("g++"), "-std=c++20", "-ffast-math", f"-I{INCLUDE}", *ends]
    program = "#include <armangle/armangle.hpp>\n"
    done = subprocess.run(command, input=program, capture_output=True, text=True)
    assert done.returncode != 0
    assert "armangle needs IEEE arithmetic" in done.stderr


# -- the pages ------------------------------------------------------------------------------------------


FENCE = re.compile(r"^```cpp\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LISTINGS = [
    pytest.param(code, compiler, id=f"{page}-{number}-{compiler}")
    for page in ("README.md", "docs/guides/ros_cpp.md")
    for number, code in enumerate(FENCE.findall((ROOT / page).read_text(encoding="utf-8")))
    for compiler in (COMPILERS if draw.COUNT else COMPILERS[number % 2 :][:1])
]


@pytest.mark.parametrize(("code", "compiler"), LISTINGS)
def test_a_listing_compiles_as_printed(code: str, compiler: str, tmp_path: Path) -> None:
    """A C++ listing of the pages compiles with strict warnings, and a whole program runs and prints; ROS is a
    stand-in, and KDL the library itself.

    Compilers take turns; `make thorough` takes both.
    """
    if "kdl.hpp" in code and not Path("/usr/include/kdl/chainiksolver.hpp").is_file():
        missing("orocos-kdl is not installed (Debian: liborocos-kdl-dev)")
    source = tmp_path / "listing.cpp"
    source.write_text(code)
    standin = ROOT / "tests" / "package" / "ros_standin"
    system = ["-isystem", standin, "-isystem", "/usr/include/eigen3"]
    if "int main" not in code:
        run(need_tool(compiler), *STRICT, f"-I{INCLUDE}", *system, "-fsyntax-only", source)
        return
    run(need_tool(compiler), *STRICT, *SMALL, f"-I{INCLUDE}", *system, source, "-o", tmp_path / "listing")
    assert run(tmp_path / "listing")


# -- where a project finds the package -----------------------------------------------------------------


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return where CMake finds the package as it is installed from the sources, and moved since."""
    folder = tmp_path_factory.mktemp("source")
    run(need_tool("cmake"), "-S", ROOT, "-B", folder / "build", f"-DCMAKE_INSTALL_PREFIX={folder / 'first'}")
    run(need_tool("cmake"), "--install", folder / "build")
    return (folder / "first").rename(folder / "then")


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return where CMake finds the package within the Python package: a copy.

    Nothing in it names the place where it was made.
    """
    if not (PACKAGE / "cmake" / "armangleConfig.cmake").is_file():
        missing(f"{PACKAGE} is no installed wheel: it holds no CMake files")
    copied = tmp_path_factory.mktemp("package") / "armangle"
    for part in ("include", "cmake"):
        shutil.copytree(PACKAGE / part, copied / part)
    texts = [path.read_text() for path in copied.rglob("*.cmake")]
    assert texts and not any(str(PACKAGE) in text for text in texts)
    return copied


def build(
    project: Path, root: Path, compiler: str, folder: Path, program: str, *options: str, flags: str = ""
) -> Path:
    """Build one program of a CMake project against the package at `root`; return its path."""
    found = [f"-Darmangle_ROOT={root}", f"-DCMAKE_CXX_COMPILER={compiler}", "-DCMAKE_BUILD_TYPE="]
    given = f"-DCMAKE_CXX_FLAGS={' '.join([*SMALL, flags])}"
    run(need_tool("cmake"), "-S", project, "-B", folder, *found, given, *options)
    run(need_tool("cmake"), "--build", folder, "--target", program)
    return folder / program


# -- examples: the numbers of the Python side ---------------------------------------------------------


@pytest.fixture(scope="module")
def arm() -> aa.Arm:
    """The KUKA iiwa7."""
    return aa.Arm.from_catalogue("kuka_iiwa7_r800")


@pytest.fixture(scope="module")
def examples(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the compiled examples, built as a user's project does that takes no warning.

    `make thorough` optimises them as users do, with g++. `.ci/run` lets no warning pass of the core.
    """
    flags = " ".join([*STRICT, *BARE, *(["-O3"] if draw.COUNT else [])])
    compiler, folder = need_tool("g++" if draw.COUNT else "clang++"), tmp_path_factory.mktemp("examples")
    return build(EXAMPLES, package, compiler, folder, "all", flags=flags).parent


def test_the_posture_example_prints_the_numbers_of_python(arm: aa.Arm, examples: Path) -> None:
    """examples/cpp/posture prints psi, gc, position, joints and arcs of Python."""
    printed = table(run(examples / "posture"))
    pose, psi, gc = arm.forward(np.radians(START_DEG))
    assert printed["psi_deg"][0][0] == pytest.approx(58.58816372916817, abs=1e-11)
    assert printed["psi_deg"][0][0] == pytest.approx(np.degrees(psi), abs=1e-11)
    assert printed["gc"] == [[3.0]] and gc == 3
    assert printed["position_m"][0] == pytest.approx(pose[:3, 3].tolist(), abs=1e-14)
    assert printed["q_deg"][0] == pytest.approx(START_DEG, abs=1e-11)
    assert printed["arc_deg"] == [
        pytest.approx(np.degrees(arc).tolist(), abs=1e-10) for arc in arm.feasible(pose, gc)
    ]


def test_the_follow_example_prints_the_numbers_of_python(arm: aa.Arm, examples: Path) -> None:
    """examples/cpp/follow prints the last joints, and psi and margins of all poses, of `follow`."""
    printed = table(run(examples / "follow"))
    pose = arm.forward(np.radians(START_DEG))[0]
    poses = np.repeat(pose[None], 101, axis=0)
    poses[:, :3, 3] += 0.25 * np.linspace(0, 1, 101)[:, None] * pose[:3, 2]
    path = aa.follow(arm, poses, start=np.radians(START_DEG), policy=aa.Repulsion(K=0.1, alpha=20.0))
    assert path.ok
    assert printed["q_deg"][0] == pytest.approx(np.degrees(path.q[-1]).tolist(), abs=1e-9)
    rows = np.column_stack([np.arange(101), np.degrees(path.psi), np.degrees(path.margin)])
    assert np.allclose(printed["pose"], rows, rtol=0, atol=1e-9)


def test_the_control_loop_does_not_allocate(examples: Path) -> None:
    """examples/cpp/realtime makes 2000 steps without failure or allocation; its worst time is not judged."""
    printed = table(run(examples / "realtime", 2))
    assert printed["steps"] == [[2000.0]]
    assert printed["failed"] == printed["allocations"] == [[0.0]]
    assert printed["worst_us"][0][0] > 0
    print(f"worst step {printed['worst_us'][0][0]:.1f} us, mean {printed['mean_us'][0][0]:.2f} us")


# -- an outside project -----------------------------------------------------------------------------


def test_the_command_line_tells_where_the_cmake_files_are() -> None:
    """`armangle --cmake-dir` prints the folder of the wheel's CMake files, or says that there is none."""
    command = [sys.executable, "-m", "armangle", "--cmake-dir"]
    done = subprocess.run(command, capture_output=True, text=True)
    if (PACKAGE / "cmake").is_dir():
        assert (done.returncode, done.stdout) == (0, f"{PACKAGE.resolve() / 'cmake'}\n")
    else:
        assert done.returncode == 2
        assert "the CMake files come with" in " ".join(done.stderr.split())  # wrapped where a path is long


@pytest.mark.parametrize("compiler", COMPILERS if draw.COUNT else COMPILERS[1:])
def test_an_outside_project_finds_and_uses_the_package(prefix: Path, compiler: str) -> None:
    """A CMake project builds against the installed package, and consumer.cpp finds no fault."""
    run(build(CONSUMER, prefix, need_tool(compiler), prefix.parent / compiler, "consumer"))


@pytest.mark.parametrize("compiler", COMPILERS if draw.COUNT else COMPILERS[1:])
def test_the_kdl_solver_agrees_with_kdl(prefix: Path, compiler: str) -> None:
    """kdl_solver.cpp, built against KDL, finds no fault."""
    if not Path("/usr/include/kdl/chainiksolver.hpp").is_file() and "CMAKE_PREFIX_PATH" not in os.environ:
        missing("orocos-kdl is not installed (Debian: liborocos-kdl-dev)")
    run(build(CONSUMER, prefix, need_tool(compiler), prefix.parent / compiler, "kdl_solver", "-DWITH_KDL=ON"))
