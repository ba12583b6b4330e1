"""Plants random faults in a copy of the installed package, one by one, and runs the tests of the faulty file.

``python tools/mutants.py COUNT SEED`` prints each mutant, killed or not, and how many were killed.
A survivor is a missing test or dead code; the exit status is then 1.
"""

from __future__ import annotations

import ast
import copy
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "src" / "armangle"
TESTS = ROOT / "tests"
LEFT_OUT = ("package", "reference", "support")  # folders of tests that need compilers, or hold no test
MOST_FILES = 6  # of tests for a mutant: those named after its file first, then its room's and its users'
LONGEST = 900  # seconds for the tests of a mutant, after which it counts as killed: the fault hangs
SWAPPED: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.GtE, ast.LtE: ast.Lt, ast.Gt: ast.LtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or,
    ast.Or: ast.And, ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """A file of the package, the line of the fault, what it says there and says then, and the faulty text."""

    file: Path
    line: int
    before: str
    after: str
    text: str


def faults_of(node: ast.AST) -> Iterator[Callable[[ast.AST], ast.AST]]:
    """Yield functions that change a copy of a node for the worse and return it."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPPED:
        yield lambda n: _with(n, ops=[SWAPPED[type(n.ops[0])](), *n.ops[1:]])  # type: ignore[attr-defined]  # the test above tells the kind of node
    if isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign)) and type(node.op) in SWAPPED:
        yield lambda n: _with(n, op=SWAPPED[type(n.op)]())  # type: ignore[attr-defined]  # the test above tells the kind of node
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub)):
        yield lambda n: n.operand  # type: ignore[attr-defined]  # the test above tells the kind of node
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield lambda n: _with(n, value=not n.value)  # type: ignore[attr-defined]  # the test above tells the kind of node
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        yield lambda n: _with(n, value=n.value + 1)  # type: ignore[attr-defined]  # the test above tells the kind of node
    if isinstance(node, (ast.If, ast.IfExp)):
        yield lambda n: _with(n, test=ast.UnaryOp(ast.Not(), n.test))  # type: ignore[attr-defined]  # the test above tells the kind of node


def _with(node: ast.AST, **changed: object) -> ast.AST:
    for name, value in changed.items():
        setattr(node, name, value)
    return node


def places(tree: ast.Module) -> list[tuple[ast.AST, str, int | None]]:
    """Return parent, field and index of every node of code that runs; annotations do not."""
    found = []
    waiting: list[ast.AST] = [tree]
    while waiting:
        parent = waiting.pop()
        for field, value in ast.iter_fields(parent):
            if field in ("annotation", "returns", "decorator_list"):
                continue
            for index, child in enumerate(value) if isinstance(value, list) else [(None, value)]:
                if isinstance(child, ast.AST) and not _for_types(child):
                    found.append((parent, field, index))
                    waiting.append(child)
    return found


def _for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)


def mutants(count: int, seed: int) -> list[Mutant]:
    """Return faults drawn at random from all that there could be in the package."""
    every = []
    for path in sorted(SOURCES.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for place, (parent, field, index) in enumerate(places(tree)):
            node = getattr(parent, field) if index is None else getattr(parent, field)[index]
            every += [(path, place, kind) for kind, _ in enumerate(faults_of(node))]
    return [_mutant(*one) for one in random.Random(seed).sample(every, count)]


def _mutant(path: Path, place: int, kind: int) -> Mutant:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    parent, field, index = places(tree)[place]
    node = getattr(parent, field) if index is None else getattr(parent, field)[index]
    faulty = list(faults_of(node))[kind](copy.deepcopy(node))
    if index is None:
        setattr(parent, field, faulty)
    else:
        getattr(parent, field)[index] = faulty
    text = ast.unparse(ast.fix_missing_locations(tree))
    said = [ast.unparse(one).splitlines()[0] for one in (node, faulty)]
    return Mutant(path.relative_to(SOURCES), node.lineno, *said, text)  # type: ignore[attr-defined]  # the test above tells the kind of node


def tests_of(file: Path) -> list[Path]:
    """Return the test files that use a file of the package: by its module, its public names, its room."""
    module = ".".join(["armangle", *file.with_suffix("").parts]).removesuffix(".__init__")
    tree = ast.parse((SOURCES / file).read_text(encoding="utf-8"))
    names = {n.name for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.ClassDef))}
    public = [name for name in names if not name.startswith("_") and len(name) > 3]
    uses = re.compile("|".join([re.escape(module) + r"\b", *(rf"\b{name}\b" for name in public)]))
    room = file.parts[0].removesuffix(".py")
    ranks = {}
    for path in sorted(TESTS.rglob("test_*.py")):
        where = path.relative_to(TESTS).parts[0]
        if where in LEFT_OUT or path.name == "test_browser.py":
            continue
        text = path.read_text(encoding="utf-8")
        rank = (
            len(uses.findall(text))
            + 5 * (module in text)
            + 3 * (where == room)
            + 9 * (file.stem in path.stem)
        )
        if rank:
            ranks[path] = rank
    return sorted(ranks, key=lambda path: -ranks[path])[:MOST_FILES]


def kills(mutant: Mutant, package: Path) -> bool:
    """Return whether a test fails on the mutant in a copy of the package."""
    target = package / mutant.file
    kept = target.read_bytes()
    target.write_text(mutant.text, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", "not slow"]
    try:
        done = subprocess.run(
            [*command, *tests_of(mutant.file)], cwd=ROOT, capture_output=True, timeout=LONGEST,
            env={**os.environ, "PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"},
        )  # fmt: skip
        return done.returncode != 0
    except subprocess.TimeoutExpired:
        return True
    finally:
        target.write_bytes(kept)


def main() -> int:
    """Run the mutants and print what became of them."""
    count, seed = int(sys.argv[1]), int(sys.argv[2])
    installed = subprocess.run(
        [sys.executable, "-c", "import armangle; print(armangle.__path__[0])"],
        cwd="/", capture_output=True, text=True, check=True,
    ).stdout.strip()  # fmt: skip
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder) / "armangle"
        shutil.copytree(installed, package, ignore=shutil.ignore_patterns("__pycache__"))
        for mutant in mutants(count, seed):
            killed = kills(mutant, package)
            survivors += not killed
            where = f"{mutant.file}:{mutant.line}"
            print(
                f"{'killed  ' if killed else 'SURVIVED'} {where}: {mutant.before} -> {mutant.after}",
                flush=True,
            )
    print(f"{count - survivors} of {count} mutants killed")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
