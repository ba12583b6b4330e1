"""``armangle reach``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.maps import ARMS, digest, small_tiles
from support.needs import need

from armangle.cli.main import main

need("zarr")
SIZE = ("--spacing", "0.1", "--angle", "20")


@pytest.mark.parametrize("name", ARMS)
def test_parts_then_the_rest_then_a_look(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    small_tiles(monkeypatch, 2**11)
    whole, place = str(tmp_path / "whole.zarr"), str(tmp_path / "a.zarr")
    assert main(["reach", whole, "--robot", name, *SIZE]) == 0
    assert main(["reach", place, "--robot", name, *SIZE, "--part", "1/3"]) == 0
    assert main(["reach", place, "--part", "2/3"]) == 0
    capsys.readouterr()
    assert main(["reach", place, "--json"]) == 1
    facts = json.loads(capsys.readouterr().out)
    assert facts["robot"] == name and 0 < len(facts["missing"]) < facts["tiles"]
    assert main(["reach", place]) == 1
    assert "--resume makes the rest" in capsys.readouterr().err
    assert main(["reach", place, "--resume"]) == 0
    shown = capsys.readouterr().out
    assert "100 mm apart" in shown and "9 x 18 directions of axis 7, 20 deg apart" in shown
    assert digest(Path(place)) == digest(Path(whole))
    assert main(["reach", place, "--verify"]) == 0
    assert "are as they were written" in capsys.readouterr().out
    next(file for file in (Path(place) / "gc" / "c").rglob("*") if file.is_file()).write_bytes(b"x")
    assert main(["reach", place, "--verify"]) == 1
    assert "not as written:" in capsys.readouterr().err
    assert main(["reach", place, "--resume"]) == 0
    assert digest(Path(place)) == digest(Path(whole))


@pytest.mark.parametrize(("words", "said"), [
    (("none.zarr",), "there is no reach map"),
    (("none.zarr", "--spacing", "0.1"), "--spacing does not go with"),
    (("none.zarr", "--singularity-margin", "1"), "--singularity-margin does not go with"),
    (("none.zarr", "--robot", "openarm_v10", "--verify"), "takes no arm"),
    (("a.zarr", "--robot", "openarm_v10", "--part", "4/3"), "wanted (i, n) with 1 <= i <= n"),
    (("a.zarr", "--robot", "openarm_v10", "--part", "x"), "--part is 'x', wanted I/N"),
    (("a.zarr", "--robot", "openarm_v10", "--fields", "gc,speed"), "fields holds 'speed'"),
    (("a.zarr", "--robot", "openarm_v10", "--scheduler", "here"), "scheduler is 'here'"),
])  # fmt: skip
def test_bad_input(
    words: tuple[str, ...], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name, *rest = words
    assert main(["reach", str(tmp_path / name), *rest]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert not any(tmp_path.iterdir())


def test_an_interrupted_map_says_how_to_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("armangle.cli.commands.reach.reach_map", interrupted)
    assert main(["reach", str(tmp_path / "a.zarr"), "--robot", "openarm_v10", *SIZE]) == 130
    assert "the same command goes on" in capsys.readouterr().err
