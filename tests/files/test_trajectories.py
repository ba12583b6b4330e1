"""A saved trajectory comes back, from every format; what cannot be one is refused with its place."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import armangle as aa
from armangle.files.trajectories import TrajectoryTable

NAMES = ",".join(f"{name}{i}" for name in ("q", "qd", "qdd") for i in range(1, 8))
JOINTS = tuple(f"A{i}" for i in range(1, 8))


def table(rows: int = 50, names: tuple[str, ...] = JOINTS) -> TrajectoryTable:
    rng = np.random.default_rng(rows)
    t = np.cumsum(rng.integers(1, 10**7, rows)) * 1e-9
    q, qd, qdd = rng.normal(size=(3, rows, 7))
    return TrajectoryTable(t, np.linspace(0, 1, rows), q, qd, qdd, names)


@pytest.mark.parametrize("ending", ["csv", "npz", "json", "yaml"])
def test_what_is_saved_comes_back(tmp_path: Path, ending: str) -> None:
    saved = table()
    aa.io.save(saved, tmp_path / f"a.{ending}")
    found = aa.io.load_trajectory(tmp_path / f"a.{ending}")
    for name in ("q", "qd", "qdd"):
        assert np.array_equal(getattr(found, name), getattr(saved, name))
    assert np.allclose(found.t, saved.t, rtol=0, atol=1e-15 if ending == "yaml" else 0)
    if ending == "yaml":
        assert found.joint_names == JOINTS
        assert np.isnan(found.s).all()
    else:
        assert np.array_equal(found.s, saved.s)
    with pytest.raises(ValueError, match="read-only"):
        found.t[0] = 1.0


@pytest.mark.parametrize("ending", ["csv", "npz", "json"])
def test_load_joints_of_a_trajectory_has_its_times(tmp_path: Path, ending: str) -> None:
    saved = table()
    aa.io.save(saved, tmp_path / f"a.{ending}")
    found = aa.io.load_joints(tmp_path / f"a.{ending}")
    assert np.array_equal(found.q, saved.q)
    assert found.trajectory is not None
    assert np.array_equal(found.trajectory.t, saved.t)
    assert np.array_equal(found.trajectory.qdd, saved.qdd)


def test_load_joints_of_joints_alone_has_none_and_of_yaml_says_who_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,q1,q2,q3,q4,q5,q6,q7\n0,1,2,3,4,5,6,7\n")
    assert aa.io.load_joints(path).trajectory is None
    aa.io.save(table(), tmp_path / "a.yaml")
    with pytest.raises(aa.ModelError, match="a trajectory, which load_trajectory reads"):
        aa.io.load_joints(tmp_path / "a.yaml")
    with pytest.raises(aa.InputError, match="a trajectory without joint names cannot be saved as"):
        aa.io.save(table(names=()), tmp_path / "b.yaml")


def row(t: str, rest: str = "0") -> str:
    return f"{t}{f',{rest}' * 21}\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,q1,q2,q3,q4,q5,q6,q7\n", "missing column qd1, qd2"),
        (f"t,{NAMES}\n" + row("0") + row("0"), "line 3: t is 0 after 0, wanted times that rise"),
        (f"t,{NAMES}\n" + row("0") + row("1", "nan"), "line 3: q1 is nan, wanted a finite number"),
        (f"t,{NAMES}\n" + row("inf"), "t is inf, wanted a finite number"),
        (f"t,{NAMES}\n" + row("soon"), "t is 'soon', wanted a number"),
    ],
)
def test_a_csv_that_is_no_trajectory(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(aa.ModelError, match=re.escape(message.removeprefix("line 3: "))) as raised:
        aa.io.load_trajectory(tmp_path / "a.csv")
    assert not message.startswith("line") or raised.value.line == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"qd": None}, "missing 'qd'"),
        ({"t": [0.0]}, "has 2 rows and t has 1"),
        ({"t": [1.0, 0.0]}, "row 1: t is 0 after 1, wanted times that rise"),
        ({"qdd": [[0.0] * 7, [None] * 7]}, "row 1: qdd1 is nan, wanted a finite number"),
        ({"q": [[0.0] * 6] * 2}, "q has shape (2, 6), wanted numbers of shape (N, 7)"),
    ],
)
def test_a_json_that_is_no_trajectory(tmp_path: Path, change: dict[str, object], message: str) -> None:
    good = {"t": [0.0, 1.0], **{name: [[0.0] * 7] * 2 for name in ("q", "qd", "qdd")}}
    blocks = {name: value for name, value in (good | change).items() if value is not None}
    (tmp_path / "a.json").write_text(json.dumps(blocks))
    with pytest.raises(aa.ModelError, match=re.escape(message)):
        aa.io.load_trajectory(tmp_path / "a.json")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("positions: [", "positions: [1, ", "is no list of 7 numbers"),
        ("velocities: [", 'velocities: ["a", ', "is no list of 7 numbers"),
        ("time_from_start: {sec", "time_from_start: {second", "wanted {sec: .., nanosec: ..}"),
        ("positions", "places", "no JointTrajectory as armangle.io.save writes it"),
        ("joint_names", "names", "no JointTrajectory as armangle.io.save writes it"),
        ("joint_names: [", "joint_names: [1, ", "is no list of 7 words"),
    ],
)
def test_a_yaml_that_is_no_trajectory(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "a.yaml"
    aa.io.save(table(3), path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(aa.ModelError, match=re.escape(message)):
        aa.io.load_trajectory(path)


def test_a_yaml_with_an_endless_integer(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    aa.io.save(table(3), path)
    path.write_text(re.sub(r"(positions: \[)[^,]*", r"\g<1>" + 400 * "9", path.read_text()))
    with pytest.raises(aa.ModelError, match="q1 is inf, wanted a finite number"):
        aa.io.load_trajectory(path)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    for ending in ("csv", "npz", "json", "yaml"):
        with pytest.raises(aa.ModelError, match="no such file"):
            aa.io.load_trajectory(tmp_path / f"none.{ending}")
    (tmp_path / "a.yaml").write_bytes(b"\xff\xfe")
    with pytest.raises(aa.ModelError, match="not UTF-8"):
        aa.io.load_trajectory(tmp_path / "a.yaml")
