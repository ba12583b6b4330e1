"""``armangle reach``."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.calibrated import calibrated
from support.maps import ARMS, digest, small_tiles
from support.needs import need

import armangle as aa

from .conftest import Cli

need("zarr")
SIZE = "--spacing 0.1 --angle 20"


@pytest.mark.parametrize("name", ARMS)
def test_parts_then_the_rest_then_a_look(name: str, cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    """`armangle reach` makes a map in parts, says what is missing, resumes, verifies and mends."""
    small_tiles(monkeypatch, 2**11)
    assert cli(f"reach whole.zarr --robot {name} {SIZE}").status == 0
    assert cli(f"reach a.zarr --robot {name} {SIZE} --part 1/3").status == 0
    assert cli("reach a.zarr --part 2/3").status == 0
    ran = cli("reach a.zarr --json")
    assert ran.status == 1 and ran.facts["robot"] == name
    assert 0 < len(ran.facts["missing"]) < ran.facts["tiles"]
    ran = cli("reach a.zarr")
    assert ran.status == 1 and "--resume makes the rest" in ran.err
    ran = cli("reach a.zarr --resume")
    assert ran.status == 0 and "100 mm apart" in ran.out
    assert "9 x 18 directions of axis 7, 20 deg apart" in ran.out
    assert digest(Path("a.zarr")) == digest(Path("whole.zarr"))
    ran = cli("reach a.zarr --verify")
    assert ran.status == 0 and "are as they were written" in ran.out
    next(file for file in Path("a.zarr/gc/c").rglob("*") if file.is_file()).write_bytes(b"x")
    ran = cli("reach a.zarr --verify")
    assert ran.status == 1 and "not as written:" in ran.err
    assert cli("reach a.zarr --resume").status == 0
    assert digest(Path("a.zarr")) == digest(Path("whole.zarr"))


def test_a_map_of_an_own_chain_says_what_is_not_proven(cli: Cli) -> None:
    """`armangle reach` of a calibrated arm prints how many cells are neither reached nor excluded."""
    Path("near.urdf").write_text(calibrated("fetch", 1.0, 1.0).to_urdf())
    size = "--spacing 0.4 --angle 60 --fields gc"
    ran = cli(f"reach a.zarr --robot near.urdf {size}")
    found = aa.ReachMap("a.zarr")
    assert ran.status == 0 and found.fields == ("gc", "unproven") and found.unproven > 0
    cells = 6 * 3 * int(found.shape[0] * found.shape[1])
    assert f"{found.unproven} of {cells} cells neither reached nor excluded" in ran.out
    assert cli("reach a.zarr --json").facts["unproven"] == found.unproven
    assert cli("reach a.zarr --verify").status == 0


@pytest.mark.parametrize(("words", "said"), [
    ("none.zarr", "there is no reach map"),
    ("none.zarr --spacing 0.1", "--spacing does not go with"),
    ("none.zarr --singularity-margin 1", "--singularity-margin does not go with"),
    ("none.zarr --robot openarm_v10 --verify", "takes no arm"),
    ("a.zarr --robot openarm_v10 --part 4/3", "wanted (i, n) with 1 <= i <= n"),
    ("a.zarr --robot openarm_v10 --part x", "--part is 'x', wanted I/N"),
    ("a.zarr --robot openarm_v10 --fields gc,speed", "fields holds 'speed'"),
    ("a.zarr --robot openarm_v10 --scheduler here", "scheduler is 'here'"),
])  # fmt: skip
def test_bad_input(words: str, said: str, cli: Cli) -> None:
    """`armangle reach` refuses bad options with exit status 2 and writes nothing."""
    ran = cli(f"reach {words}")
    assert ran.status == 2 and said in ran.text and not any(Path().iterdir())


def test_an_interrupted_map_says_how_to_go_on(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    """`armangle reach`, interrupted, says that the same command goes on."""

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("armangle.cli.commands.reach.reach_map", interrupted)
    ran = cli(f"reach a.zarr --robot openarm_v10 {SIZE}")
    assert ran.status == 130 and "the same command goes on" in ran.err
