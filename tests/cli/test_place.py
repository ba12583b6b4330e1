"""``armangle place``; what it refuses is in test_options.py."""

from __future__ import annotations

import numpy as np
import pytest

import armangle as aa

from .conftest import Cli

PLACE = "place grasps.csv --robot openarm_v10"


@pytest.fixture(autouse=True)
def grasps(cli: Cli) -> np.ndarray:
    """Poses of tools that point down around a table's middle, also in grasps.csv."""
    rng = np.random.default_rng(5)
    turns = np.stack([np.zeros(12), np.full(12, np.pi), rng.uniform(-3, 3, 12)], axis=-1)
    aa.io.save(aa.pose(rng.uniform([-0.3, -0.3, 0.2], [0.3, 0.3, 0.3], (12, 3)), rpy=turns), "grasps.csv")
    return aa.io.load_poses("grasps.csv")


@pytest.mark.turns(2)
@pytest.mark.parametrize("robot", ["openarm_v10", "franka_fr3"])
def test_the_best_bases_are_listed(robot: str, grasps: np.ndarray, cli: Cli) -> None:
    """`armangle place` gives the bases, yaws and missed poses of `place`."""
    words = f"place grasps.csv --robot {robot} --x -0.2,0.2 --y -0.2,0.2 --step 0.1"
    shown, facts = cli(words), cli(f"{words} --json").facts
    assert shown.status == 0 and "best yaw deg" in shown.out
    axis = np.linspace(-0.2, 0.2, 5)
    found = aa.place(aa.Arm.from_catalogue(robot), grasps, axis, axis)
    assert np.allclose(facts["reached"], found.reached) and np.allclose(facts["yaw"], found.yaw)
    assert bool(found.missed()) == ("not held from the first" in shown.out)
    assert facts["missed"] == [{"pose": k, "status": why.name} for k, why in found.missed()]
    assert facts["best"]["x"] == pytest.approx(found.best()[0, 3])


def test_nothing_in_reach_is_status_1(cli: Cli) -> None:
    """`armangle place` has exit status 1 if no base reaches a pose."""
    said = cli(f"{PLACE} --x 9,9 --y 0,0")
    assert said.status == 1 and "no pose can be held from any of these positions" in said.err
    assert "yaw" not in said.out and "not held from any of these positions:" in said.out
