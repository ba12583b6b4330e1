"""Every type and every function of the core has a line that says what it is.

What needs none: an operator; a name that has its line already, as another overload or for another scalar;
what stands right below a function that has one, without a blank line; what makes the type told above it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
CORE = ROOT / "include" / "armangle"
HEADERS = [path.relative_to(CORE) for path in sorted(CORE.rglob("*.hpp"))]
TYPE = re.compile(r"(?:struct|class|enum class)\s+(?:\[\[\w+\]\]\s+)?(\w+)")
FUNCTION = re.compile(r"[\w:<>,&*\[\]\s]*?\b(~?\w+)\(")
LEADING = re.compile(r"template\b[^()]*$|\[\[[^\]]*\]\]$")
NEITHER = ("namespace", "using", "static_assert", "typedef", "extern", "friend")


def definitions(text: str) -> Iterator[tuple[int, str, str, bool]]:
    """Number, name, line, and whether a comment stands above the group, of what begins in column one."""
    told, before = False, ""
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("//"):
            told = True
        elif line.startswith(NEITHER) or not (line or before.startswith(" ")):  # no blank line within a body
            told = False
        elif line[:1].strip() and not line.startswith(("#", "}", ")", "{")) and not LEADING.match(line):
            found = TYPE.match(line) or FUNCTION.match(line.split("=")[0])
            if found and "operator" not in line and ("{" in line or not line.endswith(";")):
                yield number, found[1], line, told
        before = line or before


def untold(text: str, known: frozenset[str] = frozenset()) -> list[str]:
    """Lines and names ("3: f") of definitions in column one that lack a comment, in order.

    This file's head says which need none; nor do names in `known`.
    """
    names, missing, last = set(known), [], ""
    for number, name, line, told in definitions(text):
        makes_the_last = bool(last) and re.search(rf"\b{last}\b", line.split(name + "(")[0]) is not None
        if told or name in names or makes_the_last:
            names.add(name)
        else:
            missing.append(f"{number}: {name}")
        is_type = TYPE.match(line)
        last = is_type[1] if is_type else ""
    return missing


SCALAR = frozenset(
    name for _, name, _, _ in definitions((CORE / "numbers" / "scalar.hpp").read_text(encoding="utf-8"))
)


def test_what_the_core_defines_has_its_line() -> None:
    """No type or function of the headers lacks a comment, but for those named in this file's head."""
    missing = {}
    for path in HEADERS:
        known = SCALAR | {"sin_cos"} if path.parts[0] == "numbers" and path.stem != "scalar" else frozenset()
        missing[str(path)] = untold((CORE / path).read_text(encoding="utf-8"), known)
    assert {path: names for path, names in missing.items() if names} == {}


WRONG = (
    "struct Bare {\n    int x;\n};\n", "inline int bare(int x) noexcept { return x; }\n",
    "template <class T>\nARMANGLE_INLINE T bare(const T& x) noexcept {\n", "enum class Bare : int { a };\n",
    "/// Of another.\nstruct Told {\n};\n\nstruct Bare {\n};\n", "class Bare {\npublic:\n",
)  # fmt: skip
RIGHT = (
    "/// Told.\nstruct Told {\n};\n\ninline Told told_by(int x) noexcept {\n",
    "/// Told.\ntemplate <class T>\nARMANGLE_INLINE T told(const T& x) noexcept {\n",
    "/// Told.\ninline int told(int x) noexcept { return x; }\ninline int told(double x) noexcept {\n",
    "inline Vec3 operator+(const Vec3& a, const Vec3& b) noexcept {\n",
    "inline constexpr double pi = 3.14;\nstruct Later;\nusing Floats = int;\n",
)


def test_a_line_that_is_missing_is_seen_and_what_is_told_passes() -> None:
    """`untold` finds the missing comments of WRONG, and none in RIGHT."""
    for wrong in WRONG:
        assert [name.split()[1].lower() for name in untold(wrong)] == ["bare"], wrong
    assert [right for right in RIGHT if untold(right)] == []
