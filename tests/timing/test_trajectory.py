"""A trajectory is a frozen value, and is saved as CSV, NPZ, JSON and as a ROS message."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from support.moves import refused
from support.needs import need

import armangle as aa

need("scipy")

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(acceleration=np.full(7, 5.0))
START = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
ENDS = ARM.forward(START)[0][None].repeat(2, axis=0)
ENDS[1, :3, 3] += [0.1, -0.2, 0.1]
LINE = aa.plan(ARM, aa.Line(*ENDS), start=START)


def test_a_trajectory_is_frozen_and_says_what_it_is() -> None:
    """A trajectory is read-only, has a repr, `explain` and rows each `sample`, and refuses times outside."""
    found = aa.retime(LINE, sample=0.1)
    with pytest.raises(ValueError, match="read-only"):
        found.q[0, 0] = 1.0
    with pytest.raises(AttributeError):
        found.t = None  # type: ignore[misc, assignment]  # wrong on purpose
    assert repr(found) == f"<Trajectory of {found.duration:.6g} s, {len(found)} rows>"
    assert found.explain() == f"{found.duration:.6g} s along the path."
    one = found.at(0.3)
    assert (one.s.shape, one.q.shape, one.qd.shape, one.qdd.shape) == ((), (7,), (7,), (7,))
    assert np.allclose(np.diff(found.t[:-1]), 0.1)
    for t in (-0.1, found.duration + 0.1, np.nan):
        refused(aa.InputError, r"t holds .*, wanted times from 0 to", found.at, t)


def test_files(tmp_path: Path) -> None:
    """`io.save` of a trajectory as CSV, NPZ and JSON holds its numbers."""
    found = aa.retime(LINE, sample=0.05)
    for ending in ("csv", "npz", "json", "yaml"):
        aa.io.save(found, tmp_path / f"a.{ending}")
    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    assert list(rows[0]) == ["t", "s", *(f"{n}{i}" for n in ("q", "qd", "qdd") for i in range(1, 8))]
    assert float(rows[3]["qd4"]) == found.qd[3, 3]
    with np.load(tmp_path / "a.npz") as blocks:
        assert np.array_equal(blocks["qdd"], found.qdd)
    assert json.loads((tmp_path / "a.json").read_text())["t"] == found.t.tolist()
    assert np.array_equal(aa.io.load_joints(tmp_path / "a.csv").q, found.q)


def test_yaml_is_a_joint_trajectory_message(tmp_path: Path) -> None:
    """`io.save` of a trajectory as YAML is a JointTrajectory message; joints are refused as YAML."""
    yaml = need("yaml")
    found = aa.retime(LINE, sample=0.05)
    aa.io.save(found, tmp_path / "a.yaml")
    message = yaml.safe_load((tmp_path / "a.yaml").read_text())
    assert set(message) == {"header", "joint_names", "points"}
    assert message["joint_names"] == list(ARM.geometry.joint_names)
    assert len(message["points"]) == len(found)
    for point, t, q, qd, qdd in zip(message["points"], found.t, found.q, found.qd, found.qdd, strict=True):
        assert set(point) == {"positions", "velocities", "accelerations", "effort", "time_from_start"}
        assert point["positions"] == q.tolist()
        assert point["velocities"] == qd.tolist()
        assert point["accelerations"] == qdd.tolist()
        when = point["time_from_start"]
        assert when["sec"] + 1e-9 * when["nanosec"] == pytest.approx(t, abs=1e-9)
    with pytest.raises(aa.InputError, match=r"joints cannot be saved as \.yaml, which is for trajectories"):
        aa.io.save(LINE, tmp_path / "b.yaml")


def test_speeds_that_are_not_trusted_are_said_where_they_are_used() -> None:
    """`retime` with the arm's own doubtful velocities notes it, with given ones not."""
    doubtful = aa.Arm.from_catalogue("rainbow_rby1_right")
    rows = np.linspace(doubtful.lower, doubtful.upper, 12)[5:7]
    path = aa.JointPath.from_joints(doubtful, rows, between="joints")
    own, given = (aa.retime(path, acceleration=1.0, **how) for how in ({}, {"velocity": 0.5}))
    assert len(own.notes) == 1 and own.notes[0] in doubtful.geometry.notes and own.notes[0] in own.explain()
    assert given.notes == () and "trusted" not in given.explain()
    assert aa.retime(LINE).notes == ()
