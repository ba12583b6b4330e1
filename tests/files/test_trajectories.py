"""A saved trajectory comes back, from every format; what cannot be one is refused with its place."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.refused import not_refused

import armangle as aa
from armangle.files.trajectories import TrajectoryTable

NAMES = ",".join(f"{name}{i}" for name in ("q", "qd", "qdd") for i in range(1, 8))
JOINTS = tuple(f"A{i}" for i in range(1, 8))


def table(rows: int = 50, names: tuple[str, ...] = JOINTS) -> TrajectoryTable:
    """Return a random trajectory of that many rows."""
    rng = np.random.default_rng(rows)
    t = np.cumsum(rng.integers(1, 10**7, rows)) * 1e-9
    q, qd, qdd = rng.normal(size=(3, rows, 7))
    return TrajectoryTable(t, np.linspace(0, 1, rows), q, qd, qdd, names)


@pytest.mark.parametrize("ending", ["csv", "npz", "json", "yaml"])
def test_what_is_saved_comes_back(tmp_path: Path, ending: str) -> None:
    """`load_trajectory` reads what `save` wrote, q, qd and qdd to the bit, read-only."""
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
        joints = aa.io.load_joints(tmp_path / f"a.{ending}")
        assert np.array_equal(joints.q, saved.q) and joints.trajectory is not None
        assert np.array_equal(joints.trajectory.t, saved.t) and np.array_equal(
            joints.trajectory.qdd, saved.qdd
        )
    with pytest.raises(ValueError, match="read-only"):
        found.t[0] = 1.0


def test_load_joints_of_joints_alone_has_none_and_of_yaml_says_who_reads_it(tmp_path: Path) -> None:
    """`load_joints` of q1..q7 has no trajectory; of YAML it names `load_trajectory`."""
    path = tmp_path / "a.csv"
    path.write_text("t,q1,q2,q3,q4,q5,q6,q7\n0,1,2,3,4,5,6,7\n")
    assert aa.io.load_joints(path).trajectory is None
    aa.io.save(table(), tmp_path / "a.yaml")
    with pytest.raises(aa.ModelError, match="a trajectory, which load_trajectory reads"):
        aa.io.load_joints(tmp_path / "a.yaml")
    with pytest.raises(aa.InputError, match="a trajectory without joint names cannot be saved as"):
        aa.io.save(table(names=()), tmp_path / "b.yaml")


def row(t: str, rest: str = "0") -> str:
    """Return a line of CSV: t, and `rest` in the other 21 columns."""
    return f"{t}{f',{rest}' * 21}\n"


CSV = [
    ("t,q1,q2,q3,q4,q5,q6,q7\n", "missing column qd1, qd2"), (f"t,{NAMES}\n" + row("inf"), "t is inf"),
    (f"t,{NAMES}\n" + row("0") + row("0"), ":3: t is 0 after 0"),
    (f"t,{NAMES}\n" + row("soon"), "t is 'soon'"),
    (f"t,{NAMES}\n" + row("0") + row("1", "nan"), ":3: q1 is nan"),
]  # fmt: skip
JSON: list[tuple[dict[str, Any], str]] = [
    ({"qd": None}, "missing 'qd'"), ({"t": [0.0]}, "has 2 rows and t has 1"),
    ({"t": [1.0, 0.0]}, "row 1: t is 0 after 1"), ({"qdd": [[0.0] * 7, [None] * 7]}, "row 1: qdd1 is nan"),
    ({"q": [[0.0] * 6] * 2}, r"q has shape \(2, 6\), wanted numbers of shape \(N, 7\)"),
]  # fmt: skip
YAML = [
    (r"positions: \[", "positions: [1, ", "no list of 7 numbers"),
    (r"velocities: \[", 'velocities: ["a", ', "no list of 7 numbers"),
    (r"time_from_start: \{sec", "time_from_start: {second", "wanted {sec: .., nanosec: ..}"),
    ("positions", "places", "no JointTrajectory"), ("joint_names", "names", "no JointTrajectory"),
    (r"joint_names: \[", "joint_names: [1, ", "no list of 7 words"),
    (r"(positions: \[)[^,]*", r"\g<1>" + 400 * "9", "q1 is inf"),  # a whole number without end
]  # fmt: skip


def test_what_is_no_trajectory(tmp_path: Path) -> None:
    """`load_trajectory` refuses faulty and missing files with their places."""
    files: list[tuple[str, str | bytes | None, str]] = [
        (f"c{k}.csv", text, said) for k, (text, said) in enumerate(CSV)
    ]
    good = {"t": [0.0, 1.0], **{name: [[0.0] * 7] * 2 for name in ("q", "qd", "qdd")}}
    for k, (change, said) in enumerate(JSON):
        blocks = {name: value for name, value in (good | change).items() if value is not None}
        files.append((f"j{k}.json", json.dumps(blocks), said))
    aa.io.save(table(3), tmp_path / "good.yaml")
    text = (tmp_path / "good.yaml").read_text()
    files += [(f"y{k}.yaml", re.sub(old, new, text), said) for k, (old, new, said) in enumerate(YAML)]
    files += [(f"none.{ending}", None, "no such file") for ending in ("csv", "npz", "json", "yaml")]
    files.append(("bytes.yaml", b"\xff\xfe", "not UTF-8"))
    for name, content, _ in files:
        if content is not None:
            (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    assert not_refused(
        (aa.ModelError, f"{name}.*{said}", lambda name=name: aa.io.load_trajectory(tmp_path / name))
        for name, _, said in files
    ) == []  # fmt: skip
