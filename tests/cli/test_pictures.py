"""``--plot`` and ``armangle view``: what they write, serve and refuse."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.needs import need

import armangle as aa
from armangle.cli import paper_example

from .conftest import Cli


@pytest.fixture(autouse=True)
def files(cli: Cli) -> None:
    """Write poses.csv and joints.csv, the paper's line in 20 poses, and cell.toml, a ball beside the arm."""
    arm, start, poses = paper_example.example()
    aa.io.save(poses[::13], "poses.csv")
    Path("cell.toml").write_text("[[ball]]\nname = 'lamp'\ncenter = [0.9, 0.9, 0.6]\nradius = 0.05\n")
    aa.io.save(aa.follow(arm, poses[::13], start=start, max_joint_step=np.inf), "joints.csv")


PNG, SVG, PDF = (".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize(("words", "kind"), [
    ("ik {R} --intervals --joints {Q}", PNG),
    ("ik {R} --intervals --joints {Q}", SVG),
    ("ik {R} --intervals --joints {Q}", PDF),
    ("ik {R} --intervals {POSE} --gc 3 --psi 58 --singularity-margin 5", PNG),
    ("ik {R} --intervals --joints {Q} --scene cell.toml --body guessed", PNG),
    ("ik {R} --joints {Q} --seed {Q}", SVG),
    ("ik {R} {POSE} --gc 4", PDF),
    ("ik {R} {POSE} --scene cell.toml --body guessed", SVG),
    ("ik {R} --intervals --joints joints.csv --gc 3", SVG),
    ("ik {R} --intervals --pose poses.csv", PDF),
    ("inspect kuka_iiwa7_r800 --joints joints.csv", PNG),
    ("plan poses.csv {R}", PNG),
])  # fmt: skip
def test_pictures_are_written(words: str, kind: tuple[str, bytes], cli: Cli) -> None:
    """`--plot` of each command writes a file of the kind that its ending says."""
    ending, begin = kind
    ran = cli(f"{words} --plot picture{ending}")
    assert ran.status == 0 and f"wrote picture{ending}\n" in ran.err
    assert Path(f"picture{ending}").read_bytes().startswith(begin)


def test_an_unknown_ending_is_refused(cli: Cli) -> None:
    """`--plot` refuses an ending that is no picture."""
    ran = cli("ik {R} {POSE} --plot a.doc")
    assert ran.status == 2 and "unknown ending, wanted one of .png, .svg, .pdf" in ran.text


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("on_fail", ["skip", "stop"])
def test_rows_that_are_not_solved_are_gaps_in_the_picture(
    on_fail: str, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`--plot` of a joint file draws unsolved rows as gaps, and the output names the first."""

    from armangle import plots

    arm, start, poses = paper_example.example()
    poses = poses[::13].copy()
    poses[8:11, 2, 3] += 9.0
    aa.io.save(aa.follow(arm, poses, start=start, max_joint_step=np.inf, on_fail=on_fail), "gap.csv")
    drawn: dict[str, Any] = {}
    for name in ("path", "feasible_map"):
        plot = getattr(plots, name)
        monkeypatch.setattr(
            plots, name, lambda *a, _plot=plot, _name=name, **k: drawn.setdefault(_name, _plot(*a, **k))
        )
    cli("inspect kuka_iiwa7_r800 --joints gap.csv --plot a.png")
    ran = cli("ik {R} --intervals --joints gap.csv --plot a.png")
    assert "pose 8 (s = 0.4211) is the first that is not" in ran.text and "out of reach" in ran.text
    last = 11 if on_fail == "skip" else len(poses)
    for panel in drawn["path"]:
        assert np.isnan(panel.lines[0].get_ydata()[8:last]).all()
        assert np.isfinite(panel.lines[0].get_ydata()[last:]).all()
    assert drawn["path"][0].get_xlim() == (0, 1)
    assert "fails" in [line.get_label() for line in drawn["path"][0].lines]
    assert all(len(panel.patches) == last - 8 for panel in drawn["feasible_map"])


MADE = "".join(
    f'<body pos="0 0 {up}"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint axis="{axis}"/>'
    for up, axis in [(0.3, "0 0 1"), (0, "0 1 0"), (0, "0 0 1"), (0.4, "0 1 0"), (0.4, "0 0 1"), (0, "0 1 0"),
                     (0, "0 0 1")]
)  # fmt: skip


@pytest.mark.parametrize(
    "words",
    ["", "{R}", "{R} joints.csv", "{R} poses.csv", "{R} poses.csv --start {Q}", "--robot arm.urdf",
     "--robot arm.xml"],
)  # fmt: skip
def test_view_serves_until_interrupted(words: str, cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    """`armangle view` serves the demo, an arm, or an arm with a file, until interrupted."""
    need("viser")
    need("mujoco")
    from armangle.viewer import Viewer

    def interrupt(viewer: Viewer) -> None:
        assert (viewer.state.motion is not None) == (not words or ".csv" in words)
        raise KeyboardInterrupt

    monkeypatch.setattr(Viewer, "wait", interrupt)
    Path("arm.urdf").write_text(aa.Arm.from_catalogue("kuka_iiwa7_r800").to_urdf())
    Path("arm.xml").write_text(f'<mujoco model="made"><worldbody>{MADE}{"</body>" * 7}</worldbody></mujoco>')
    ran = cli(f"view {words} --address :0")
    name = "made" if "xml" in words else "kuka_iiwa7_r800"
    assert ran.status == 0 and ran.out.startswith(f"{name}: http://127.0.0.1:")
    assert ran.err == "" or not words.endswith("xml")


def test_view_draws_an_unreadable_mesh_as_capsule_and_says_so_once(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`armangle view` of a URDF with a missing mesh says once that it is drawn as capsules."""
    need("viser")
    from armangle.viewer import Viewer

    monkeypatch.setattr(Viewer, "wait", lambda _: None)
    visual = '<visual><geometry><mesh filename="gone.stl"/></geometry></visual>'
    text = aa.Arm.from_catalogue("kuka_iiwa7_r800").to_urdf()
    Path("arm.urdf").write_text(
        text.replace('<link name="link_3" />', f'<link name="link_3">{visual}</link>')
    )
    ran = cli("view --robot arm.urdf --address :0")
    assert (
        ran.status == 0 and ran.text.count("1 mesh is drawn as capsules; the first: link_3_0: gone.stl") == 1
    )


def test_view_refuses_a_busy_port(cli: Cli) -> None:
    """`armangle view` refuses a port that is taken."""
    need("viser")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        ran = cli(f"view {{R}} --address :{port}")
    assert ran.status == 2 and f"port {port} of 127.0.0.1 is taken" in ran.text
