"""Files and options of a command line go in any order."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

import armangle as aa
from armangle.cli import main

ROBOT = ("--robot", "kuka_iiwa7_r800")
START = "0,20,5,-60,0,60,0"


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A joint file and a pose file of one motion, in the working folder."""
    monkeypatch.chdir(tmp_path)
    q = np.radians([float(word) for word in START.split(",")]) + np.linspace(0, 0.02, 3)[:, None]
    heading = ",".join(f"q{i}" for i in range(1, 8))
    np.savetxt("j.csv", q, delimiter=",", header=heading, comments="")
    aa.save(aa.Arm.from_catalogue(ROBOT[1]).forward(q)[0], "p.csv")


COMMANDS = {
    "fk": [("j.csv",), ROBOT, ("-o", "out.csv")],
    "follow": [("p.csv",), ROBOT, ("--start", START)],
    "plan": [("p.csv",), ROBOT, ("-o", "out.csv")],
}


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize("command", COMMANDS)
def test_any_order(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = set()
    for parts in permutations(COMMANDS[command]):
        assert main([command, *(word for part in parts for word in part)]) == 0
        said.add(capsys.readouterr().out)
    assert len(said) == 1


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize("words", [
    ("path", *ROBOT, "-o", "a.svg", "j.csv"),
    (*ROBOT, "path", "-o", "a.svg", "j.csv"),
    ("path", "j.csv", *ROBOT, "-o", "a.svg"),
], ids=" ".join)  # fmt: skip
def test_plot_takes_its_file_anywhere(words: tuple[str, ...]) -> None:
    assert main(["plot", *words]) == 0
    assert Path("a.svg").stat().st_size > 0


def test_joints_around_an_option(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", "1", "-2", "3", *ROBOT, "-4", "5", "6", "7"]) == 0
    around = capsys.readouterr().out
    assert main(["fk", *ROBOT, "1", "-2", "3", "-4", "5", "6", "7"]) == 0
    assert capsys.readouterr().out == around


def test_one_file_too_many(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", "path", "a.csv", *ROBOT, "b.csv", "-o", "c.png"]) == 2
    assert "unrecognized arguments: b.csv" in capsys.readouterr().err
