"""Plain C++: one action a statement, no conditional within a conditional, no line beyond 110 columns."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
WIDTH = 110
FOLDERS = ("include", "bindings", "examples/cpp", "fuzz", "benchmarks/cpp", "tests/package")
FILES = [
    path.relative_to(ROOT)
    for folder in FOLDERS
    for ending in ("hpp", "cpp")
    for path in sorted((ROOT / folder).rglob(f"*.{ending}"))
]
PLAIN = [path for path in FILES if path.parts[0] in ("include", "bindings")]


def code_of(text: str) -> str:
    """The text with comments, strings and preprocessor lines blanked; every line keeps its place."""

    def blank(match: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " ", match[0])

    text = re.sub(r"//[^\n]*|/\*.*?\*/", blank, text, flags=re.S)
    text = re.sub(r'"(?:\\.|[^"\\\n])*"', lambda m: '"' + "_" * (len(m[0]) - 2) + '"', text)
    return re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", blank, text, flags=re.M)


DECLARATION = re.compile(
    r"(?:const|static|constexpr|inline|auto|using|template|struct|enum|case|public|private)\b"
    r"|[\w:]+(?:<[^;=]*>)?[&*]* [&*]*\w+\s*(?:=|\{|\[|\(|,|$)"
)
HEAD = re.compile(r"(?:(?:if|for|while)\s*\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)|else\b)\s*")


def chained(code: str) -> Iterator[int]:
    """Numbers of the lines on which a statement begins that has a comma between two actions.

    Such as `a = x, b = y;` and `return a = x, b;`.
    """
    before, begun = "", (0, "")
    for number, line in enumerate(code.splitlines(), 1):
        part = line.strip()
        within = before.startswith("enum ") or re.search(r"[\w>]\{$|= \{$", before)  # a list of values
        begins = not before or (before.endswith((";", "{", "}", ")", ":", "else")) and not within)
        before = part or before
        begun = (number, part) if begins else (begun[0], f"{begun[1]} {part}")
        if not part.endswith(";"):
            continue
        number, statement = begun
        while head := HEAD.match(statement):
            statement = statement[head.end() :]
        if re.match(r"[:,?]", statement):
            continue
        returned = statement.startswith("return ")
        statement = statement.removeprefix("return ")
        if not returned and DECLARATION.match(statement):
            continue
        first = outermost_comma(statement)
        if first is not None and re.search(r"[^=<>!]=[^=]|\)$", statement[:first].strip()):
            yield number


def outermost_comma(statement: str) -> int | None:
    """The place of the first comma outside all brackets, or None."""
    depth = 0
    for at, c in enumerate(statement):
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            return at
    return None


def nested(code: str) -> Iterator[int]:
    """Lines with a conditional inside another one's condition or arms."""
    for match in re.finditer(r"\?", code):
        depth = 0
        for k in range(match.start() + 1, len(code)):
            c = code[k]
            depth += (c in "([{") - (c in ")]}")
            if depth < 0 or (c in ";," and depth == 0):
                break
            if c == "?":
                yield code.count("\n", 0, k) + 1
                break


def test_one_action_a_statement_and_lines_that_fit() -> None:
    """C++ has no line beyond WIDTH; include/ and bindings/ have no chained action or nested conditional."""
    texts = {path: (ROOT / path).read_text(encoding="utf-8") for path in FILES}
    plain = {path: code_of(texts[path]) for path in PLAIN}
    assert not [f"{path}:{line}: a comma" for path, code in plain.items() for line in chained(code)]
    assert not [
        f"{path}:{line}: a conditional within one" for path, code in plain.items() for line in nested(code)
    ]
    lines = ((path, n, line) for path, text in texts.items() for n, line in enumerate(text.splitlines(), 1))
    assert not [f"{path}:{n}: too long" for path, n, line in lines if len(line) > WIDTH]


WRONG = (
    "a = 1, b = 2;", "void f() {\n    if (x) a.b[i] += 1, c(d);\n}", "return value = x, Problem::y;",
    "first.push(1), second.push(2);", "a.first = 1,\n    a.second = 2;", "join(a),\n    join(b);",
)  # fmt: skip
RIGHT = (
    "const double a = 1, b = 2;", "double x, y;", "int a[] = {1, 2};", "return {a = b, b};",
    "for (int i = 0, n = 2; i < n; ++i) h(i, i);", "enum class E {\n    a = 0,\n    b = 1,\n};",
    "const Cell out{\n    f(a), b};",
)  # fmt: skip


def test_what_is_put_wrong_is_seen_and_what_is_plain_passes() -> None:
    """`chained` and `nested` find the faults of WRONG, and none in RIGHT."""
    assert [wrong for wrong in WRONG if not list(chained(code_of(wrong)))] == []
    assert list(nested("x = a ? b : (c ? d : e);"))
    assert [right for right in RIGHT if [*chained(code_of(right)), *nested(code_of(right))]] == []


PYTHON = [
    path
    for folder in ("benchmarks", "docs", "examples", "fuzz", "src", "tests", "tools")
    for path in sorted((ROOT / folder).rglob("*.py"))
]
SILENCED = re.compile(r"# (?:noqa(?:: [A-Z]+\d+(?:, [A-Z]+\d+)*)?|type: ignore(?:\[[\w, -]+\])?)(?P<why>.*)")


def reasonless(text: str) -> list[int]:
    """Lines that silence a tool and do not say why."""
    lines = enumerate(text.splitlines(), 1)
    return [n for n, line in lines for found in SILENCED.finditer(line) if not found["why"].strip(" -#")]


def test_what_silences_a_tool_says_why() -> None:
    """Every noqa and type: ignore gives a reason."""
    found = {path: reasonless(path.read_text(encoding="utf-8")) for path in PYTHON}
    assert not {str(path.relative_to(ROOT)): lines for path, lines in found.items() if lines}


def test_a_reason_that_is_missing_is_seen() -> None:
    """`reasonless` finds lines that silence a tool without a reason."""
    noqa, ignore = "# no" + "qa: B009", "# type" + ": ignore[arg-type]"
    assert reasonless(f"x = 1  {noqa}") == [1]
    assert reasonless(f"x = 1\ny = 2  {ignore}") == [2]
    assert not reasonless(f"x = 1  {noqa} - of the core's alone\ny = 2  {ignore}  # wrong on purpose")
