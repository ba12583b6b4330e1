"""Known robots: one TOML file each, read on request.

Lengths are metres. Angles and speeds are degrees under keys that end in ``_deg``, rad and rad/s under keys
without it. Frames are matrices of three rows; a fourth row may follow. Every file states in words the origin
of its numbers and the revision with which they were compared, the frame of the tip, and untrusted numbers.
"""

from __future__ import annotations

import math
import os
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from .. import _opening
from .._arrays import JOINTS
from ..errors import InputError, ModelError
from .description import ELBOW_OFFSETS, END_OFFSETS, FRAMES, LENGTHS, ArmDescription, OffsetDescription

ROBOTS = Path(__file__).with_name("robots")

_ANGLES, _OPTIONAL_ANGLES = ("lower", "upper"), ("offsets", "velocity")
_WORDS = ("title", "source", "tip")
_DOUBTS = ("lengths", "limits", "velocity")
_TOML_PLACE = re.compile(r"\s*\(at line (\d+), column (\d+)\)")
_SHORT, _LONG = 6, 10  # decimals
_SAME = 1e-12  # m or rad: error of an import's numbers from the intended ones
_LARGEST = 1e9  # upper bound of lengths in m and angles in degrees


@dataclass(frozen=True, eq=False)
class CatalogueEntry:
    """One robot of the catalogue.

    `name` to request it; `title`, maker and type; `source`, origin of the numbers, in words; `revision`, the
    commit or release of the source with which they were compared, empty if they were not; `tip`, its frame in
    words; `description`, whose notes list untrusted numbers. `lengths_trusted`, `limits_trusted` and
    `velocity_trusted` are False if the source is doubtful.
    """

    name: str
    title: str
    source: str
    revision: str
    tip: str
    description: ArmDescription
    lengths_trusted: bool
    limits_trusted: bool
    velocity_trusted: bool


def catalogue(search: str = "") -> tuple[str, ...]:
    """Return the names of the known robots, sorted.

    Parameters
    ----------
    search : str, optional
        Words, in any order and case: only names that contain all of them.

    Returns
    -------
    tuple of str
        Names for ``Arm.load``; the maker comes first, an arm of a pair ends with its side.

    >>> "kuka_iiwa7_r800" in catalogue(), "franka_fr3" in catalogue()
    (True, True)
    >>> catalogue("kuka iiwa")
    ('kuka_iiwa14_r820', 'kuka_iiwa7_r800')
    """
    words = _words(search)
    return tuple(name for name in sorted(_files("**")) if all(word in name for word in words))


def srs_catalogue() -> tuple[str, ...]:
    """Return the names of the S-R-S arms, sorted."""
    return tuple(sorted(_files(".")))


def offset_catalogue() -> tuple[str, ...]:
    """Return the names of the arms with an offset wrist or shoulder, sorted."""
    return tuple(sorted(_files("offset")))


@cache
def _files(folder: str) -> dict[str, Path]:
    """Return the files of robots by name, listed once; `folder` is a pattern below that of the robots."""
    return {path.stem: path for path in ROBOTS.glob(f"{folder}/*.toml")}


def is_file_or_text(source: str) -> bool:
    """Return whether a string is XML text or looks like a path, and is no name of the catalogue."""
    return source not in catalogue() and ("<" in source or "/" in source or "." in source or "\\" in source)


def _words(text: str) -> list[str]:
    """Return the words of a text in lower case."""
    return re.findall(r"[a-z0-9]+", text.lower())


def load_robot(name: str) -> CatalogueEntry:
    """Return an arm of the catalogue, S-R-S or with an offset wrist or shoulder; or raise with similar names.

    >>> load_robot("kuka_iiwa7_r800").description.d_bs
    0.34
    """
    files = _files("**")
    if name not in files:
        known = sorted(files)
        near = _near(str(name), known)
        makers = sorted({robot.partition("_")[0] for robot in known})
        hint = f"did you mean {' or '.join(map(repr, near))}?" if near else f"it has {', '.join(makers)}"
        raise InputError(f"the catalogue has no robot {name!r}; {hint}")
    return read_robot(files[name])


def _near(name: str, known: Sequence[str]) -> list[str]:
    """Return the names with all words of `name`; otherwise similar spellings or most words."""
    words = [word for word in _words(name) if len(word) > 1 or word.isdigit()]
    held = {robot: sum(word in robot for word in words) for robot in known}
    most = max(held.values())
    fullest = [robot for robot in known if most and held[robot] == most]
    alike = get_close_matches(name, known, n=3)
    chosen = fullest if most == len(words) else alike or fullest
    return sorted(chosen, key=lambda robot: alike.index(robot) if robot in alike else len(alike))


def read_robot(path: str | os.PathLike[str]) -> CatalogueEntry:
    """Return the robot of a TOML file; its name is that of the file.

    Raises `ModelError` with file and line: no such file, not TOML, a key that is missing, unknown or of the
    wrong type.
    """
    path = Path(path)

    def fail(why: str) -> NoReturn:
        """Raise the error of a file that cannot be read."""
        raise ModelError(why, source=str(path))

    text = _opening.text_of(path, _opening.TABLES, fail)
    try:
        table = _opening.parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise _toml_error(str(error), str(path)) from None
    except ValueError as error:
        fail(str(error))
    try:
        return _Reader(str(path), text, table).entry(path.stem)
    except ModelError:
        raise
    except ValueError:  # more digits than Python writes into a message
        fail("holds a whole number that is too long")


def robot_toml(arm: ArmDescription, *, title: str, source: str, tip: str) -> str:
    """Return the text of a TOML file that `read_robot` reads as the same S-R-S arm: a_1 and a_6 are not
    written.

    `title` is maker and type, `source` the origin of the numbers, `tip` the frame of the tip. Numbers within
    1e-12 (m, rad) of a short decimal are written as that. Notes of the arm become comments. Accelerations,
    ``reference``, ``body`` and ``hand`` are left out. Raises `InputError` if the arm has its own chain, which
    such a file cannot hold.
    """
    if arm.chain is not None:
        raise InputError(
            "a robot file holds exact S-R-S arms, and this one has a chain of its own: write a URDF"
        )
    lines = [f"# {line}" for note in arm.notes for line in note.splitlines()]
    words = dict(zip(_WORDS, (title, source, tip), strict=True))
    lines += [f"{key} = {_toml_text(value)}" for key, value in words.items()]
    lengths = (*LENGTHS, *(key for key in ELBOW_OFFSETS if getattr(arm, key)))
    lines += [f"{key} = {_short(getattr(arm, key))!r}" for key in lengths]
    lines.append(f"signs = {[int(sign) for sign in arm.signs]}")
    for name in (*_OPTIONAL_ANGLES, *_ANGLES):
        lines.append(f"{name}_deg = [{', '.join(_degrees_text(v) for v in getattr(arm, name))}]")
    lines.append(f"joint_names = [{', '.join(_toml_text(name) for name in arm.joint_names)}]")
    for key in FRAMES:
        frame = getattr(arm, key)
        if not np.array_equal(frame, np.eye(4)):
            rows = "".join(f"    {[_short(value) for value in row]},\n" for row in frame)
            lines.append(f"{key} = [\n{rows}]")
    return "\n".join(lines) + "\n"


def _toml_error(message: str, source: str) -> ModelError:
    """Return the error of a file that is not TOML, with the place removed from the message."""
    place = _TOML_PLACE.search(message)
    line, column = (int(place[1]), int(place[2])) if place else (None, None)
    message = f"not TOML: {_TOML_PLACE.sub('', message)}"
    return ModelError(message, source=source, line=line, column=column)


def _toml_text(value: str) -> str:
    """Return a TOML basic string."""
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped) + '"'


def _degrees_text(angle: float) -> str:
    """Return an angle (rad) as text in degrees, rounded if that converts back to the same angle."""
    degrees = _short(math.degrees(angle), math.degrees(_SAME))
    rounded = round(degrees, _LONG) if math.isfinite(degrees) else degrees
    return repr(rounded if math.radians(rounded) == angle else degrees)


def _short(value: float, same: float = _SAME) -> float:
    """Return a number rounded to few decimals if that changes it by at most `same`, else the number."""
    rounded = round(float(value), _SHORT) + 0.0 if math.isfinite(value) else value
    return float(rounded if abs(rounded - value) <= same else value)


class _Reader:
    """Checks the table of one file key by key."""

    def __init__(self, source: str, text: str, table: dict[str, Any]) -> None:
        """Keep the file's name, text and table."""
        self.source = source
        self.text = text
        self.table = table

    def entry(self, name: str) -> CatalogueEntry:
        """Return the checked entry; raise at the first wrong key."""
        self.refuse_unknown_keys()
        title, source, tip = (self.words(key) for key in _WORDS)
        revision = self.words("revision") if "revision" in self.table else ""
        doubts = {key: self.doubt(key) for key in _DOUBTS}
        values: dict[str, Any] = {key: self.number(key) for key in LENGTHS}
        values |= {key: self.number(key) for key in (*ELBOW_OFFSETS, *END_OFFSETS) if key in self.table}
        given = [name for name in _OPTIONAL_ANGLES if self.angle_key(name) in self.table]
        values |= {name: self.radians(name) for name in (*_ANGLES, *given)}
        values |= {key: self.frame(key) for key in FRAMES if key in self.table}
        values["signs"] = self.signs()
        if "joint_names" in self.table:
            values["joint_names"] = self.joint_names()
        values["notes"] = tuple(f"{key} not trusted: {why}" for key, why in doubts.items() if why)
        self.check_limits(values["lower"], values["upper"])
        kind = ArmDescription if values.keys().isdisjoint(END_OFFSETS) else OffsetDescription
        trusted = [not doubts[key] for key in _DOUBTS]
        return CatalogueEntry(name, title, source, revision, tip, kind(**values, name=name), *trusted)

    def fail(self, key: str, message: str) -> NoReturn:
        """Raise an error with the line of the key."""
        found = re.search(rf"^\s*{re.escape(key)}\s*=", self.text, re.MULTILINE)
        line = self.text.count("\n", 0, found.end()) + 1 if found else None
        raise ModelError(f"{key} {message}", source=self.source, line=line)

    def refuse_unknown_keys(self) -> None:
        """Raise if the table has a key that no robot file has."""
        known = {*_WORDS, *LENGTHS, *ELBOW_OFFSETS, *END_OFFSETS, *FRAMES}
        known |= {key for name in (*_ANGLES, *_OPTIONAL_ANGLES) for key in (name, f"{name}_deg")}
        known |= {f"{key}_{what}" for key in _DOUBTS for what in ("trusted", "reason")}
        known |= {"signs", "joint_names", "revision"}
        for key in self.table.keys() - known:
            near = get_close_matches(key, known, n=1)
            self.fail(key, f"is not a key{f'; did you mean {near[0]}?' if near else ''}")

    def get(self, key: str) -> Any:
        """Return the value of a key; raise if it is missing."""
        if key not in self.table:
            self.fail(key, "is missing")
        return self.table[key]

    def words(self, key: str) -> str:
        """Return a text that is not empty."""
        value = self.get(key)
        if not isinstance(value, str) or not value.strip():
            self.fail(key, f"is {value!r}, wanted words")
        return value

    def number(self, key: str) -> float:
        """Return a finite number."""
        return self.finite(key, self.get(key))

    def finite(self, key: str, value: Any, allow_infinite: bool = False) -> float:
        """Return a value as a number of at most 1e9, or infinite if allowed; raise for anything else."""
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not (abs(value) <= _LARGEST or (allow_infinite and abs(value) == math.inf)):
            self.fail(key, f"has {value!r:.40}, wanted a finite number")
        return float(value)

    def seven(self, key: str) -> list[Any]:
        """Return a list of seven values."""
        values = self.get(key)
        if not isinstance(values, list) or len(values) != JOINTS:
            self.fail(key, f"is {values!r}, wanted {JOINTS} values")
        return values

    def angle_key(self, name: str) -> str:
        """Return the key of seven angles: the name itself if they are in rad, otherwise that of degrees."""
        return name if name in self.table else f"{name}_deg"

    def radians(self, name: str) -> tuple[float, ...]:
        """Return seven angles in rad; only offsets must be finite."""
        key = self.angle_key(name)
        values = [self.finite(key, value, name != "offsets") for value in self.seven(key)]
        return tuple(values if key == name else map(math.radians, values))

    def signs(self) -> tuple[int, ...]:
        """Return seven signs, each 1 or -1."""
        values = self.seven("signs")
        if any(value not in (1, -1) for value in values):
            self.fail("signs", f"is {values}, wanted 1 or -1 each")
        return tuple(int(value) for value in values)

    def joint_names(self) -> tuple[str, ...]:
        """Return seven names."""
        values = self.seven("joint_names")
        if not all(isinstance(value, str) and value for value in values):
            self.fail("joint_names", f"is {values}, wanted {JOINTS} names")
        return tuple(values)

    def frame(self, key: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return a matrix (4, 4) of finite numbers; without a fourth row in the file it is 0 0 0 1."""
        rows = self.get(key)
        sizes = [isinstance(r, list) and len(r) for r in rows] if isinstance(rows, list) else []
        if sizes not in ([4] * 3, [4] * 4):
            self.fail(key, "is not a 4x4 matrix, or its first three rows")
        frame = np.eye(4)
        frame[: len(rows)] = [[self.finite(key, value) for value in row] for row in rows]
        return frame

    def check_limits(self, lower: tuple[float, ...], upper: tuple[float, ...]) -> None:
        """Raise if a lower limit is above the upper one."""
        for joint, (low, high) in enumerate(zip(lower, upper, strict=True), start=1):
            if low > high:
                self.fail(self.angle_key("lower"), f"is above {self.angle_key('upper')} at joint {joint}")

    def doubt(self, what: str) -> str:
        """Return why the source's lengths, limits or velocities are doubtful; "" if they are trusted."""
        trusted = self.table.get(f"{what}_trusted", True)
        if not isinstance(trusted, bool):
            self.fail(f"{what}_trusted", f"is {trusted!r}, wanted true or false")
        return "" if trusted else self.words(f"{what}_reason")
