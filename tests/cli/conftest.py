"""A command line as one string, run in a folder of its own with the files that commands read."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import armangle as aa
from armangle.cli import main
from armangle.cli.tables import WIDTH

START = np.radians([-5.4101, -26.4986, -48.1542, -61.65, 152.6198, 114.4466, 8.1812])
NAMES = {
    "R": "--robot kuka_iiwa7_r800",
    "Q": "-5.4101,-26.4986,-48.1542,-61.65,152.6198,114.4466,8.1812",
    "POSE": "--pose -0.117424,-0.146412,1.020287,0.425538,-0.432663,0.352360,0.712434",
    "FAR": "--pose 2,0,0,1,0,0,0",
    "FR3": "--robot franka_fr3",
    "QF": "10,20,10,-110,15,110,30",
    "PF": "--pose 0.4,0.1,0.5,0,1,0,0",
}


class Ran(NamedTuple):
    """What a command line did: exit status, stdout, stderr."""

    status: int
    out: str
    err: str

    @property
    def text(self) -> str:
        """All of stdout and stderr, each run of white space as one blank."""
        return " ".join(f"{self.out} {self.err}".split())

    @property
    def facts(self) -> Any:
        """What --json printed, as Python objects."""
        return json.loads(self.out)


class Screen:
    """A stream that keeps what is written; it says whether it is a terminal, and has an encoding."""

    def __init__(self, terminal: bool, encoding: str = "utf-8") -> None:
        self.text, self.terminal, self.encoding = "", terminal, encoding

    def write(self, text: str) -> int:
        text.encode(self.encoding)
        self.text += text
        return len(text)

    def isatty(self) -> bool:
        return self.terminal

    def flush(self) -> None:
        pass


Cli = Callable[..., Ran]


@pytest.fixture
def cli(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Cli:
    """Return a function that runs a command line; {R} and the like stand for `NAMES`. It checks line
    widths.
    """
    monkeypatch.chdir(tmp_path)

    def run(line: str) -> Ran:
        status = main(shlex.split(line.format(**NAMES)))
        out, err = capsys.readouterr()
        wide = [
            row for row in out.splitlines()
            if " " in row.strip() and " = " not in row and not row.startswith(("KUKA", "/"))
        ]  # fmt: skip
        if {"--json", "--print-completion", "place"} & set(line.split()):
            wide = []
        assert max(map(len, wide), default=0) <= WIDTH
        return Ran(status, out, err)

    return run


@pytest.fixture
def line(tmp_path: Path) -> np.ndarray[Any, Any]:
    """Write line.csv: 21 poses, 0.05 m along the tool's z axis from the paper's start; and return them."""
    pose = aa.Arm.from_catalogue("kuka_iiwa7_r800").forward(START)[0]
    poses = np.repeat(pose[None], 21, axis=0)
    poses[:, :3, 3] += np.linspace(0, 0.05, 21)[:, None] * pose[:3, 2]
    aa.io.save(poses, tmp_path / "line.csv")
    return aa.io.load_poses(tmp_path / "line.csv")
