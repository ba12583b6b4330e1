"""Small reach maps for tests: made here, or in a process of its own that can be killed."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import armangle as aa
from armangle.reach import grid

ARMS = ("openarm_v10", "human_arm_left")
"""Joints 1 and 7 of these turn less than fully: what assumes more is right on an iiwa and wrong here."""
CELLS = 2**15

_SCRIPT = """
import sys
import armangle as aa
from armangle.reach import grid
grid._CELLS = int(sys.argv[3])
aa.reach_map(aa.Arm.from_catalogue(sys.argv[1]), sys.argv[2], spacing={spacing}, tilt={tilt}, threads=2)
"""


def small_tiles(monkeypatch: pytest.MonkeyPatch, cells: int = CELLS) -> None:
    """Make tiles of about so many cells."""
    monkeypatch.setattr(grid, "_CELLS", cells)


def made(name: str, place: Path, *, spacing: float = 0.05, tilt: float = 0.2, **options: Any) -> aa.ReachMap:
    """A map of a few tiles."""
    return aa.reach_map(aa.Arm.from_catalogue(name), place, spacing=spacing, tilt=tilt, **options)


def process(name: str, place: Path, *, spacing: float, tilt: float) -> subprocess.Popen[str]:
    """A process, of a group of its own, that makes a map."""
    script = _SCRIPT.format(spacing=spacing, tilt=tilt)
    words = [sys.executable, "-c", script, name, str(place), str(CELLS)]
    return subprocess.Popen(words, start_new_session=True, stderr=subprocess.PIPE, text=True)


def digest(place: Path) -> str:
    """The bytes of all files of a store, and their names."""
    sums = hashlib.sha256()
    for file in sorted(place.rglob("*")):
        if file.is_file():
            sums.update(str(file.relative_to(place)).encode() + b"\0" + file.read_bytes())
    return sums.hexdigest()
