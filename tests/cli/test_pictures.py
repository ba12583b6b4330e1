"""``armangle plot`` and ``armangle view``: what they write, serve and refuse."""

from __future__ import annotations

import socket
from pathlib import Path

import numpy as np
import pytest
from support.needs import need

import armangle as aa
from armangle.cli import main, paper_example

ROBOT = ("--robot", "kuka_iiwa7_r800")
Q = ("--q", "-5.4101,-26.4986,-48.1542,-61.65,152.6198,114.4466,8.1812")
POSE = ("--pose", "-0.117424,-0.146412,1.020287,0.425538,-0.432663,0.352360,0.712434")
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with poses.csv and joints.csv, the paper's line in 20 poses."""
    arm, start, poses = paper_example.example()
    aa.save(poses[::13], tmp_path / "poses.csv")
    aa.save(aa.follow(arm, poses[::13], start=start, max_joint_step=np.inf), tmp_path / "joints.csv")
    return tmp_path


PNG, SVG, PDF = (".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")


@pytest.mark.slow
@pytest.mark.parametrize(("words", "kind"), [
    (("circle", *Q), PNG),
    (("circle", *Q), SVG),
    (("circle", *Q), PDF),
    (("circle", *POSE, "--gc", "3", "--psi", "58", "--singularity-margin", "5"), PNG),
    (("profiles", *Q), SVG),
    (("profiles", *POSE, "--gc", "4"), PDF),
    (("path", "joints.csv"), PNG),
    (("map", "joints.csv", "--gc", "3"), SVG),
    (("map", "poses.csv"), PDF),
])  # fmt: skip
def test_pictures_are_written(
    words: tuple[str, ...], kind: tuple[str, bytes], files: Path, capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    ending, begin = kind
    monkeypatch.chdir(files)
    assert main(["plot", *words, *ROBOT, "-o", f"picture{ending}"]) == 0
    assert (files / f"picture{ending}").read_bytes().startswith(begin)
    assert capsys.readouterr().err == f"wrote picture{ending}\n"


@pytest.mark.slow
@pytest.mark.parametrize("on_fail", ["skip", "stop"])
def test_rows_that_are_not_solved_are_gaps_in_the_picture(
    on_fail: str, files: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    from armangle import plots

    arm, start, poses = paper_example.example()
    poses = poses[::13].copy()
    poses[8:11, 2, 3] += 9.0
    aa.save(aa.follow(arm, poses, start=start, max_joint_step=np.inf, on_fail=on_fail), files / "gap.csv")
    drawn = {}
    for name, function in (("path", "path"), ("map", "feasible_map")):
        plot = getattr(plots, function)
        monkeypatch.setattr(
            plots, function, lambda *a, _plot=plot, _name=name, **k: drawn.setdefault(_name, _plot(*a, **k))
        )
        assert main(["plot", name, str(files / "gap.csv"), *ROBOT, "-o", str(files / "a.png")]) == 0
        said = " ".join(capsys.readouterr().err.split())
        assert "pose 8 (s = 0.4211) is the first that is not" in said and "out of reach" in said
    last = 11 if on_fail == "skip" else len(poses)
    for panel in drawn["path"]:
        assert np.isnan(panel.lines[0].get_ydata()[8:last]).all()
        assert np.isfinite(panel.lines[0].get_ydata()[last:]).all()
    assert drawn["path"][0].get_xlim() == (0, 1)
    assert "fails" in [line.get_label() for line in drawn["path"][0].lines]
    assert all(len(panel.patches) == last - 8 for panel in drawn["map"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("circle",), "plot circle needs --q, or --pose with --gc"),
        (("circle", *POSE), "--pose needs --gc"),
        (("profiles", "joints.csv", *Q), "plot profiles takes no file"),
        (("path",), "plot path needs a file of joints"),
        (("map",), "plot map needs a file of joints or poses"),
        (("map", "joints.csv", *Q), "--q does not go with plot map"),
        (("path", "joints.csv", "--psi", "3"), "--psi does not go with plot path"),
        (("map", "words.csv"), "neither joints (words.csv"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_plot_says_what_is_missing(
    words: tuple[str, ...], message: str, files: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(files)
    (files / "words.csv").write_text("a,b\n1,2\n")
    assert main(["plot", *words, *ROBOT, "-o", "picture.png"]) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not (files / "picture.png").exists()


def test_an_unknown_ending_is_refused(files: Path, capsys: Capture) -> None:
    assert main(["plot", "circle", *Q, *ROBOT, "-o", str(files / "a.doc")]) == 2
    assert "unknown ending, wanted one of .png, .svg, .pdf" in " ".join(capsys.readouterr().err.split())


def test_a_pose_out_of_reach_has_no_profiles(files: Path, capsys: Capture) -> None:
    words = ["--pose", "2,0,0,1,0,0,0", "--gc", "0", *ROBOT, "-o", str(files / "a.png")]
    assert main(["plot", "profiles", *words]) == 1
    assert "out of reach by" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        ("--demo",),
        ROBOT,
        (*ROBOT, "--path", "joints.csv"),
        (*ROBOT, "--path", "poses.csv"),
        (*ROBOT, "--path", "poses.csv", "--start", Q[1]),
        ("--urdf", "arm.urdf"),
    ],
    ids=" ".join,
)
def test_view_serves_until_interrupted(
    words: tuple[str, ...], files: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    need("viser")
    from armangle.viewer import Viewer

    def interrupt(viewer: Viewer) -> None:
        assert (viewer.state.motion is not None) == ("--path" in words or "--demo" in words)
        raise KeyboardInterrupt

    monkeypatch.setattr(Viewer, "wait", interrupt)
    monkeypatch.chdir(files)
    (files / "arm.urdf").write_text(aa.Arm.from_catalogue(ROBOT[1]).to_urdf())
    assert main(["view", *words, "--port", "0"]) == 0
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
    assert main(["view", "--urdf", str(files / "arm.xml"), "--port", "0"]) == 0
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
    assert main(["view", "--urdf", str(path), "--port", "0"]) == 0
    err = " ".join(capsys.readouterr().err.split())
    assert err.count("1 mesh is drawn as capsules; the first: link_3_0: gone.stl: no such file") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "view needs --robot NAME, --urdf FILE or --demo"),
        (("--demo", *ROBOT), "--demo brings its own arm, start and path"),
        ((*ROBOT, "--path", "words.csv"), "neither joints (words.csv"),
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
        assert main(["view", *ROBOT, "--port", str(port)]) == 2
    assert f"port {port} of 127.0.0.1 is taken" in " ".join(capsys.readouterr().err.split())
