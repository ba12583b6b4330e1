"""The paper's example: golden numbers of section 6.2, the table, the files."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np
import pytest
from support.needs import need

import armangle as aa
from armangle.cli import paper_example

from .conftest import Cli

NAMES = ("alpha5_K0.1", "alpha20_K0.1", "alpha100_K0.1", "alpha20_K0.02", "alpha20_K0.5")

POSE_38 = [
    [-0.2634, -0.9112, -0.3166, -0.1174],
    [0.3014, -0.3895, 0.8703, -0.1464],
    [-0.9164, 0.1338, 0.3773, 1.0203],
]
GOAL_39 = [-0.1966, 0.0712, 1.1146]


def test_the_example_is_the_papers() -> None:
    """`paper_example.example` has the pose, psi, gc and goal that the paper prints."""
    arm, start, poses = paper_example.example()
    pose, psi, gc = arm.forward(start)
    assert np.array_equal(poses[0], pose) and poses.shape == (251, 4, 4)
    assert pose[:3] == pytest.approx(np.array(POSE_38), abs=5.1e-5)
    assert poses[-1, :3, 3] == pytest.approx(GOAL_39, abs=5.1e-5)
    assert float(np.degrees(psi)) == pytest.approx(58.5882, abs=5e-5) and gc == 3


def test_the_runs_hold_the_limits_and_the_pose() -> None:
    """All runs of the example keep pose and limits, and end as far from the limit as alpha and K say."""
    ends = {}
    for policy in paper_example.POLICIES:
        made = paper_example.run(policy)
        assert made.path.ok and (made.path.gc == 3).all() and made.seconds_per_pose > 0
        assert made.path.arm.within_limits(made.path.q).all() and made.path.residual.max() < 1e-12
        ends[made.name] = made.path.psi[-1]
    assert tuple(ends) == NAMES
    # The wider (alpha) or stronger (K) the repulsion, the further from the limit it ends.
    assert ends["alpha5_K0.1"] > ends["alpha20_K0.1"] > ends["alpha100_K0.1"]
    assert ends["alpha20_K0.5"] > ends["alpha20_K0.1"] > ends["alpha20_K0.02"]


def test_the_table(cli: Cli) -> None:
    """`armangle demo` prints a row a run, and what to try next."""
    ran = cli("demo")
    assert ran.status == 0 and "psi 58.5882 deg, GC 3" in ran.out
    assert ran.out.index("straight line") < ran.out.index("the paper")  # plain words first
    assert "armangle demo -o demo" in ran.out and "\n  armangle view\n" in ran.out
    assert max(map(len, ran.out.splitlines())) <= 80
    rows = [line.split() for line in ran.out.splitlines() if line[:5].strip().isdigit()]
    assert [f"alpha{row[0]}_K{row[1]}" for row in rows] == list(NAMES)
    assert all(row[2] == "58.5882" and row[4] == "3" for row in rows)


@pytest.mark.slow
def test_the_files(cli: Cli) -> None:
    """`armangle demo -o` writes joints and pictures of all runs, and the poses."""
    need("matplotlib")
    facts, folder = cli("demo -o new/demo --json").facts, Path("new/demo")
    assert [run["name"] for run in facts["runs"]] == list(NAMES)
    assert {file.name for file in folder.iterdir()} == {Path(file).name for file in facts["files"]}
    for name in NAMES:
        assert len(aa.io.load_joints(folder / f"{name}.csv")) == 251
    for name in (*NAMES, "overview"):
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert len(aa.io.load_poses(folder / "poses.csv")) == 251


def test_what_to_open_and_to_try_is_said_and_works(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command that `armangle demo -o` advises runs and solves all poses."""
    figure = pytest.importorskip("matplotlib.figure", reason="pip install 'armangle[plot]'")
    monkeypatch.setattr(figure.Figure, "savefig", lambda self, to, **_: to.write(b"as in test_the_files"))
    ran = cli("demo -o here")
    assert ran.status == 0 and Path("here/overview.png").is_file() and "Open here/overview.png" in ran.out
    (planned,) = [line.strip() for line in ran.out.splitlines() if line.startswith("  armangle plan")]
    assert cli(planned.removeprefix("armangle ")).status == 0
    assert aa.io.load_joints(planned.split()[-1]).status.max() == aa.Status.OK


def test_the_curves_begin_where_the_dots_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the example's pictures every curve begins at the dot of the start."""
    figure = pytest.importorskip("matplotlib.figure", reason="pip install 'armangle[plot]'")
    drawn = []
    monkeypatch.setattr(figure.Figure, "savefig", lambda self, *_, **__: drawn.append(self))
    runs = [paper_example.run(policy) for policy in paper_example.POLICIES]
    for made in runs:
        paper_example.draw(made, io.BytesIO())
    paper_example.draw_overview(runs, io.BytesIO())
    for picture, panels in zip(drawn, [8] * len(runs) + [2], strict=True):
        assert len(picture.axes) == panels
        for panel in picture.axes:
            (dot,) = [line for line in panel.lines if line.get_label() == "start"]
            curves = [line for line in panel.lines if len(line.get_xdata()) > 250]
            assert curves
            for curve in curves:
                np.testing.assert_allclose(curve.get_xydata()[0], dot.get_xydata()[0], atol=1e-9)
            left, right = panel.get_xlim()
            assert left < dot.get_xdata()[0] < right


def test_without_matplotlib_the_numbers_are_written(monkeypatch: pytest.MonkeyPatch, cli: Cli) -> None:
    """`armangle demo -o` without matplotlib writes the numbers and says what to install."""
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    ran = cli("demo -o here")
    assert ran.status == 0 and "pip install 'armangle[plot]'" in ran.text
    assert {file.name for file in Path("here").iterdir()} == {f"{name}.csv" for name in (*NAMES, "poses")}
    ran = cli("demo -o here/poses.csv")
    assert ran.status == 2 and "poses.csv: cannot be made: File exists" in ran.text
