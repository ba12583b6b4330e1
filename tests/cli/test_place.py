"""``armangle place``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import armangle as aa
from armangle.cli.main import main

ROBOT = ("--robot", "openarm_v10")


@pytest.fixture
def grasps(tmp_path: Path) -> str:
    """Tools that point down about a table."""
    rng = np.random.default_rng(5)
    turns = np.stack([np.zeros(12), np.full(12, np.pi), rng.uniform(-3, 3, 12)], axis=-1)
    file = tmp_path / "grasps.csv"
    aa.io.save(aa.pose(rng.uniform([-0.3, -0.3, 0.2], [0.3, 0.3, 0.3], (12, 3)), rpy=turns), file)
    return str(file)


def test_the_best_bases_are_listed(grasps: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["place", grasps, *ROBOT, "--x", "-0.2,0.2", "--y", "-0.2,0.2", "--step", "0.1"]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert "best yaw deg" in shown and "not held from the first of these:" in shown
    assert main([*words, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    found = aa.place(
        aa.Arm.from_catalogue("openarm_v10"),
        aa.io.load_poses(grasps),
        np.linspace(-0.2, 0.2, 5),
        np.linspace(-0.2, 0.2, 5),
    )
    assert np.allclose(facts["reached"], found.reached) and np.allclose(facts["yaw"], found.yaw)
    assert facts["missed"] == [{"pose": k, "status": why.name} for k, why in found.missed()]
    assert facts["best"]["x"] == pytest.approx(found.best()[0, 3])


def test_nothing_in_reach_is_status_1(grasps: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["place", grasps, *ROBOT, "--x", "9,9", "--y", "0,0"]) == 1
    said = capsys.readouterr()
    assert "no pose can be held from any of these positions" in said.err
    assert "yaw" not in said.out and "not held from any of these positions:" in said.out


@pytest.mark.parametrize(("words", "said"), [
    (("--x", "1"), "--x is '1', wanted FROM,TO"),
    (("--x", "1,0"), "wanted FROM <= TO"),
    (("--step", "0"), "--step is 0, wanted metres above 0"),
    (("--step", "1e-7"), "positions along --x, wanted at most"),
])  # fmt: skip
def test_bad_input(
    words: tuple[str, ...], said: str, grasps: str, capsys: pytest.CaptureFixture[str]
) -> None:
    given = {"--x": "0,1", "--y": "0,1"} | dict([words])
    assert main(["place", grasps, *ROBOT, *(word for pair in given.items() for word in pair)]) == 2
    assert said in capsys.readouterr().err
