"""``--plot`` and ``armangle view``: what they write, serve and refuse."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.needs import need

import armangle as aa
from armangle.cli import main, paper_example

from .conftest import Cli

ROBOT = ("--robot", "kuka_iiwa7_r800")
Q = ("--joints", "-5.4101,-26.4986,-48.1542,-61.65,152.6198,114.4466,8.1812")
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with poses.csv and joints.csv, the paper's line in 20 poses."""
    arm, start, poses = paper_example.example()
    aa.io.save(poses[::13], tmp_path / "poses.csv")
    (tmp_path / "cell.toml").write_text("[[ball]]\nname = 'lamp'\ncenter = [0.9, 0.9, 0.6]\nradius = 0.05\n")
    aa.io.save(aa.follow(arm, poses[::13], start=start, max_joint_step=np.inf), tmp_path / "joints.csv")
    return tmp_path


PNG, SVG, PDF = (".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")


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
def test_pictures_are_written(words: str, kind: tuple[str, bytes], files: Path, cli: Cli) -> None:
    ending, begin = kind
    ran = cli(f"{words} --plot picture{ending}")
    assert ran.status == 0 and f"wrote picture{ending}\n" in ran.err
    assert (files / f"picture{ending}").read_bytes().startswith(begin)


@pytest.mark.slow
@pytest.mark.parametrize("on_fail", ["skip", "stop"])
def test_rows_that_are_not_solved_are_gaps_in_the_picture(
    on_fail: str, files: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    from armangle import plots

    arm, start, poses = paper_example.example()
    poses = poses[::13].copy()
    poses[8:11, 2, 3] += 9.0
    aa.io.save(aa.follow(arm, poses, start=start, max_joint_step=np.inf, on_fail=on_fail), files / "gap.csv")
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


def test_an_unknown_ending_is_refused(files: Path, cli: Cli) -> None:
    assert "unknown ending, wanted one of .png, .svg, .pdf" in cli("ik {R} {POSE} --plot a.doc").text


@pytest.mark.parametrize(
    "words",
    [
        (),
        ROBOT,
        (*ROBOT, "joints.csv"),
        (*ROBOT, "poses.csv"),
        (*ROBOT, "poses.csv", "--start", Q[1]),
        ("--robot", "arm.urdf"),
    ],
    ids=" ".join,
)
def test_view_serves_until_interrupted(
    words: tuple[str, ...], files: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    need("viser")
    from armangle.viewer import Viewer

    def interrupt(viewer: Viewer) -> None:
        assert (viewer.state.motion is not None) == (
            words == () or any(word.endswith(".csv") for word in words)
        )
        raise KeyboardInterrupt

    monkeypatch.setattr(Viewer, "wait", interrupt)
    monkeypatch.chdir(files)
    (files / "arm.urdf").write_text(aa.Arm.from_catalogue(ROBOT[1]).to_urdf())
    assert main(["view", *words, "--address", ":0"]) == 0
    assert capsys.readouterr().out.startswith("kuka_iiwa7_r800: http://127.0.0.1:")


def test_view_shows_an_mjcf_as_capsules(
    files: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    need("viser")
    need("mujoco")
    from armangle.viewer import Viewer

    monkeypatch.setattr(Viewer, "wait", lambda _: None)
    z, y = "0 0 1", "0 1 0"
    axes = [(0.3, z), (0, y), (0, z), (0.4, y), (0.4, z), (0, y), (0, z)]
    bodies = "".join(
        f'<body pos="0 0 {up}"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint axis="{axis}"/>'
        for up, axis in axes
    )
    text = f'<mujoco model="made"><worldbody>{bodies}{"</body>" * 7}</worldbody></mujoco>'
    (files / "arm.xml").write_text(text)
    assert main(["view", "--robot", str(files / "arm.xml"), "--address", ":0"]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("made: http://127.0.0.1:") and said.err == ""


def test_view_draws_an_unreadable_mesh_as_capsule_and_says_so_once(
    files: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    need("viser")
    from armangle.viewer import Viewer

    monkeypatch.setattr(Viewer, "wait", lambda _: None)
    visual = '<visual><geometry><mesh filename="gone.stl"/></geometry></visual>'
    text = aa.Arm.from_catalogue(ROBOT[1]).to_urdf()
    path = files / "arm.urdf"
    path.write_text(text.replace('<link name="link_3" />', f'<link name="link_3">{visual}</link>'))
    assert main(["view", "--robot", str(path), "--address", ":0"]) == 0
    err = " ".join(capsys.readouterr().err.split())
    assert err.count("1 mesh is drawn as capsules; the first: link_3_0: gone.stl: no such file") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((*ROBOT, "words.csv"), "neither joints (words.csv"),
        ((*ROBOT, "--start", "0,130,0,0,0,0,0"), "joint 2 is 10.0000 deg beyond its upper limit"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_view_says_what_is_wrong(
    words: tuple[str, ...], message: str, files: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(files)
    (files / "words.csv").write_text("a,b\n1,2\n")
    assert main(["view", *words]) == 2
    assert message in " ".join(capsys.readouterr().err.split())


def test_view_refuses_a_busy_port(capsys: Capture) -> None:
    need("viser")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert main(["view", *ROBOT, "--address", f":{port}"]) == 2
    assert f"port {port} of 127.0.0.1 is taken" in " ".join(capsys.readouterr().err.split())
