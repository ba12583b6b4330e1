"""The viewer without a browser: what it shows, refuses and says."""

from __future__ import annotations

import json
import socket
import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

import armangle as aa
from armangle import demo
from armangle._motion import motion_of, motions_along
from armangle._viewer_controls import gc_name
from armangle._viewer_meshes import solids_of
from armangle._viewer_panels import (
    arcs_panel,
    joints_panel,
    map_image,
    map_panel,
    png,
    reasons_panel,
    status_panel,
)
from armangle._viewer_scene import figure_segments, segment_colours
from armangle._viewer_solids import capsule, capsules
from armangle._viewer_ways import ways_between
from armangle.io import load_joints, save
from armangle.viewer import Viewer, ViewerState

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
PAPER_ARM, PAPER_Q, PAPER_POSES = demo.example()
WAM = aa.Arm.from_catalogue("barrett_wam7")


def _paper() -> ViewerState:
    return ViewerState(PAPER_ARM, PAPER_Q)


@pytest.mark.parametrize("name", aa.catalogue())
def test_every_arm_begins_bent_and_within_its_limits(name: str) -> None:
    state = ViewerState(aa.Arm.from_catalogue(name))
    assert state.arm.within_limits(state.q)
    theta = state.arm.signs * state.q + state.arm.offsets
    assert np.abs(np.sin(theta[[1, 5]])).min() > 0.2
    assert abs(np.sin(theta[3] - state.arm.delta)) > 0.2
    assert not state.arcs.is_empty
    assert state.reason(state.gc) is None


def test_an_arm_without_limits_begins_too() -> None:
    state = ViewerState(aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1))
    assert state.reasons() == [None] * 8


@pytest.mark.parametrize(
    ("start", "error", "message"),
    [
        (np.zeros(6), aa.ShapeError, "q has shape"),
        (np.zeros((2, 7)), aa.ShapeError, "q has shape"),
        (np.full(7, np.nan), aa.NotFiniteError, "wanted finite joint values"),
        ([0, 3, 0, 0, 0, 0, 0], aa.LimitError, "joint 2 is 3 rad, outside its limits"),
    ],
)
def test_a_start_that_is_no_posture_is_refused(start: object, error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        ViewerState(IIWA, start)


# -- the arm angle -----------------------------------------------------------------------------------


def test_set_psi_turns_the_elbow_and_keeps_the_tool() -> None:
    state = _paper()
    pose, gc = state.pose.copy(), state.gc
    for psi in np.radians([60, 100, 170, 200, 300, 320]):
        assert state.set_psi(psi).ok
        np.testing.assert_allclose(state.pose, pose, atol=1e-12)
        assert np.isclose(np.exp(1j * state.psi), np.exp(1j * psi))
        assert state.gc == gc
        assert state.arm.within_limits(state.q, tol=1e-9)


def test_set_psi_stops_at_the_limit_and_names_the_joint() -> None:
    state = _paper()
    answer = state.set_psi(np.radians(34.0))
    assert not answer.ok
    assert answer.text == state.message == "ψ = 34.0° is blocked by joint 5."
    assert np.degrees(state.psi) == pytest.approx(42.70, abs=0.01)
    assert state.arm.within_limits(state.q, tol=1e-9)
    assert "blocked by joint 1." in state.set_psi(np.radians(-30.0)).text
    with pytest.raises(aa.NotFiniteError, match="psi is nan"):
        state.set_psi(np.nan)


# -- the tool ----------------------------------------------------------------------------------------


def test_set_pose_goes_there_continuously_and_within_limits() -> None:
    state = _paper()
    wanted = PAPER_POSES[-1]
    assert state.set_pose(wanted).ok
    np.testing.assert_allclose(state.pose, wanted, atol=1e-9)
    assert state.gc == 3
    assert state.arm.within_limits(state.q, tol=1e-9)


def test_set_pose_accepts_the_rounding_of_a_browser() -> None:
    state = _paper()
    assert state.set_pose(PAPER_POSES[20].astype(np.float32)).ok
    with pytest.raises(aa.ShapeError, match="pose has shape"):
        state.set_pose(PAPER_POSES[:2])


def test_set_pose_stops_where_it_must_and_says_why() -> None:
    state = _paper()
    far = state.pose.copy()
    far[:3, 3] = [0.0, 0.0, 5.0]
    answer = state.set_pose(far)
    assert not answer.ok
    assert answer.text
    assert state.arm.within_limits(state.q, tol=1e-9)
    assert np.linalg.norm(state.pose[:3, 3]) < 1.4


def test_the_policy_of_eq_36_moves_psi_while_the_tool_is_dragged() -> None:
    held, repelled = _paper(), _paper()
    held.policy = aa.Hold()
    repelled.policy = aa.Repulsion(K=0.3, alpha=5)
    for state in (held, repelled):
        assert state.set_pose(PAPER_POSES[100]).ok
    arcs = repelled.arcs
    assert np.abs(np.diff(arcs.nearest([held.psi, repelled.psi]))) > 0.1


def test_ways_between_are_short_and_end_exactly() -> None:
    first, last = IIWA.forward(np.array([[0.1, 0.4, 0, -1, 0, 1, 0], [0.9, 0.8, 0.5, -1.5, 1, 1, 2.0]]))[0]
    poses = ways_between(first, last)
    np.testing.assert_array_equal(poses[-1], aa.nearest_rotation(last))
    steps = np.diff(np.concatenate([first[None], poses])[:, :3, 3], axis=0)
    assert np.linalg.norm(steps, axis=1).max() < 0.0101
    turns = np.einsum("nji,njk->nik", poses[:-1, :3, :3], poses[1:, :3, :3])
    assert (np.trace(turns, axis1=1, axis2=2) > 1 + 2 * np.cos(np.radians(2.01))).all()
    half = first.copy()
    half[:3, :3] = first[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    assert len(ways_between(first, half)) == 90
    assert len(ways_between(first, first)) == 1


# -- configurations ----------------------------------------------------------------------------------


def test_reasons_agree_with_the_arcs_and_buttons_with_reasons() -> None:
    rng = np.random.default_rng(1)
    arm = aa.Arm.from_catalogue("openarm_v10")
    for _ in range(30):
        state = ViewerState(arm, rng.uniform(arm.lower, arm.upper))
        arcs = [arm.feasible(state.pose, gc) for gc in range(8)]
        assert [reason is None for reason in state.reasons()] == [not a.is_empty for a in arcs]
        for gc in range(8):
            assert (state.short_reason(gc) is None) == (state.reason(gc) is None)
            answer = state.set_gc(gc)
            assert answer.ok == (not arcs[gc].is_empty)
            assert answer.ok == (state.gc == gc)
            if not answer.ok:
                assert answer.text.startswith(f"GC {gc}: ")
    with pytest.raises(aa.ConfigurationError, match="gc is 8"):
        state.set_gc(8)


def test_reasons_name_the_joint() -> None:
    narrow = IIWA.with_(
        lower=np.where(np.arange(7) == 5, 0.0, IIWA.lower), upper=np.where(np.arange(7) == 3, 2.0, IIWA.upper)
    )
    narrow = narrow.with_(lower=np.where(np.arange(7) == 3, 0.0, narrow.lower))
    state = ViewerState(narrow, [0.1, 0.4, 0.2, 1.2, 0.3, 0.8, 0.5])
    assert state.gc == 0
    assert state.reason(4) == "Joint 6 is outside its limits at every ψ."
    assert state.short_reason(4) == "joint 6 blocks"
    assert state.reason(2) == aa.Status.ELBOW_LIMIT.sentence
    assert state.short_reason(2) == "joint 4 blocks"
    panel = reasons_panel(state)
    assert '<div data-gc="4"><b>GC 4</b>: Joint 6 is outside' in panel


def test_limits_that_block_together_are_all_named() -> None:
    found = None
    rng = np.random.default_rng(0)
    arm = aa.Arm.from_catalogue("openarm_v10")
    while found is None:
        state = ViewerState(arm, rng.uniform(arm.lower, arm.upper))
        found = next((r for r in state.reasons() if r is not None and r.startswith("Joints")), None)
    assert found.endswith("together block every ψ.")
    assert "limits leave no ψ" in [state.short_reason(gc) for gc in range(8)]


def test_ghosts_reach_the_same_tool() -> None:
    state = _paper()
    ghosts = state.ghosts()
    assert set(ghosts) == {gc for gc in range(8) if state.reason(gc) is None} - {3}
    for figure in ghosts.values():
        np.testing.assert_allclose(figure[-1], state.pose[:3, 3], atol=1e-9)
    assert figure_segments(list(ghosts.values())).shape == (7 * len(ghosts), 2, 3)


def test_the_elbow_circle_says_who_blocks() -> None:
    state = _paper()
    circle = state.elbow_circle()
    assert set(circle.blocker.tolist()) == {0, 1, 5}
    elbow = state.arm.frames(state.q)[3, :3, 3]
    assert np.linalg.norm(circle.segments[:, 0] - elbow, axis=1).min() < 0.01
    colours = segment_colours(circle.blocker)
    assert colours.shape == circle.segments.shape
    assert len(np.unique(colours.reshape(-1, 3), axis=0)) == 3


# -- motion, export, reset ---------------------------------------------------------------------------


def _motion(alpha: float = 20.0) -> aa.JointPath:
    return aa.follow(
        PAPER_ARM, PAPER_POSES, start=PAPER_Q, policy=aa.Repulsion(alpha=alpha), max_joint_step=np.inf
    )


def test_a_motion_is_played_row_by_row() -> None:
    state, motion = _paper(), _motion()
    assert not state.seek(0).ok
    assert state.set_motion(motion).ok
    for row in (0, 100, 250):
        assert state.seek(row).ok
        np.testing.assert_allclose(state.q, motion.q[row])
    assert state.seek(9999).ok
    assert state.row == 250
    with pytest.raises(aa.InputError, match="the motion is of"):
        ViewerState(WAM).set_motion(motion)


def test_rows_that_were_not_solved_leave_the_arm_where_it_is() -> None:
    poses = PAPER_POSES.copy()
    poses[100:, :3, 3] += 3.0
    motion = aa.follow(PAPER_ARM, poses, start=PAPER_Q, max_joint_step=np.inf)
    state = _paper()
    answer = state.set_motion(motion)
    assert not answer.ok
    assert "pose 100" in answer.text
    state.seek(99)
    q = state.q.copy()
    assert not state.seek(150).ok
    np.testing.assert_array_equal(state.q, q)
    assert "Pose 150: " in state.message
    nothing = aa.follow(PAPER_ARM, poses[100:], start=PAPER_Q)
    with pytest.raises(aa.InputError, match="no solved row"):
        state.set_motion(nothing)


def test_export_is_json_of_the_posture_and_reset_goes_home() -> None:
    state = _paper()
    state.set_psi(2.0)
    facts = json.loads(state.export())
    assert facts["robot"] == "kuka_iiwa7_r800"
    assert facts["gc_signs"] == [-1, -1, 1]
    np.testing.assert_array_equal(facts["q"], state.q)
    np.testing.assert_allclose(
        PAPER_ARM.inverse(facts["pose"], facts["psi"], facts["gc"]), state.q, atol=1e-9
    )
    assert facts["margin"] == pytest.approx(PAPER_ARM.limit_margin(state.q))
    assert state.reset().ok
    np.testing.assert_allclose(state.q, PAPER_Q)
    state.set_joints(np.full(7, 0.3))
    np.testing.assert_allclose(state.q, 0.3)
    free = ViewerState(aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1))
    assert json.loads(free.export())["margin"] is None


def test_a_joint_file_becomes_a_motion(tmp_path: Path) -> None:
    motion = _motion()
    save(motion, tmp_path / "joints.csv")
    again = motion_of(PAPER_ARM, load_joints(tmp_path / "joints.csv"))
    np.testing.assert_allclose(again.q, motion.q)
    np.testing.assert_allclose(again.psi, motion.psi, atol=1e-9)
    np.testing.assert_allclose(again.margin, motion.margin, atol=1e-12)
    (tmp_path / "none.csv").write_text("q1,q2,q3,q4,q5,q6,q7\n" + ",".join(["nan"] * 7) + "\n")
    with pytest.raises(aa.PathError, match="no row of the joint file"):
        motion_of(PAPER_ARM, load_joints(tmp_path / "none.csv"))


def test_poses_become_motions_of_every_configuration() -> None:
    motions = motions_along(PAPER_ARM, PAPER_POSES)
    assert {"GC 0", "GC 3"} <= set(motions)
    assert [m.ok for m in motions.values()] == sorted((m.ok for m in motions.values()), reverse=True)
    assert all((m.gc[m.gc >= 0] == int(name[-1])).all() for name, m in motions.items())
    assert list(motions_along(PAPER_ARM, PAPER_POSES, PAPER_Q)) == ["from the start"]
    with pytest.raises(aa.PathError, match="no global configuration"):
        motions_along(PAPER_ARM, PAPER_POSES + np.diag([0, 0, 0, 0.0]) + 9 * np.eye(4, k=3))


# -- panels ------------------------------------------------------------------------------------------


def test_panels_hold_the_numbers() -> None:
    state = _paper()
    assert "GC 3, ψ = 58.6°" in status_panel(state)
    arcs = arcs_panel(state)
    assert "joint 1" in arcs
    assert "joint 5" in arcs
    assert "joint 3" not in arcs
    assert joints_panel(state).count("data-joint") == 7
    assert "152.6°" in joints_panel(state)
    assert reasons_panel(state).count("data-gc") == sum(r is not None for r in state.reasons())
    free = ViewerState(aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1))
    assert "no joint blocks" in arcs_panel(free)
    assert "limits" in joints_panel(free)
    assert gc_name(3) == "GC 3 (− − +)"


def test_names_from_files_are_text_and_never_markup() -> None:
    state = ViewerState(IIWA.with_(name="<script>x</script>"))
    state.message = "<b>"
    assert "<script>" not in status_panel(state)
    assert "&lt;b&gt;" in status_panel(state)


def test_the_map_is_a_png_of_who_blocks() -> None:
    motion = _motion()
    image = map_image(motion)
    assert image.startswith("data:image/png;base64,iVBOR")
    panel = map_panel(motion, image, 125)
    assert "s = 0.500, pose 126 of 251" in panel
    assert panel.count("<polyline") == 2
    assert map_panel(motion, image, 0).count("<circle") == 1


def test_png_can_be_read_back() -> None:
    cells = np.arange(6, dtype=np.uint8).reshape(2, 3) % 3
    data = png(cells, ("#000000", "#FF0000", "#00FF7F"))
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, found = 8, {}
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        name, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length]) == (zlib.crc32(name + body),)
        found[name] = body
        at += 12 + length
    assert struct.unpack(">IIBBBBB", found[b"IHDR"]) == (3, 2, 8, 3, 0, 0, 0)
    rows = np.frombuffer(zlib.decompress(found[b"IDAT"]), dtype=np.uint8).reshape(2, 4)
    np.testing.assert_array_equal(rows, np.hstack([np.zeros((2, 1)), cells]))
    assert found[b"PLTE"] == bytes([0, 0, 0, 255, 0, 0, 0, 255, 127])


# -- solids ------------------------------------------------------------------------------------------


def test_a_capsule_is_closed_and_of_its_radius() -> None:
    begin, end = np.array([0.1, 0.2, 0.3]), np.array([0.1, 0.7, 0.9])
    vertices, faces = capsule(begin, end, 0.05)
    axis = (end - begin) / np.linalg.norm(end - begin)
    along = np.clip((vertices - begin) @ axis, 0, np.linalg.norm(end - begin))
    distance = np.linalg.norm(vertices - begin - along[:, None] * axis, axis=1)
    np.testing.assert_allclose(distance, 0.05, atol=1e-12)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    volume = np.einsum("ij,ij->i", corners[:, 0] - begin, normals).sum() / 6
    length = np.linalg.norm(end - begin)
    assert volume == pytest.approx(np.pi * 0.05**2 * (length + 4 / 3 * 0.05), rel=0.03)


@pytest.mark.parametrize("arm", [IIWA, WAM], ids=lambda arm: arm.name)
def test_capsules_move_with_the_arm(arm: aa.Arm) -> None:
    q = np.random.default_rng(2).uniform(-1, 1, 7)
    frames = arm.frames(q)
    solids = {solid.name: solid for solid in capsules(arm)}
    assert ("elbow_in" in solids) == (arm is WAM)
    hand = solids["hand"]
    placed = hand.vertices @ frames[hand.frame, :3, :3].T + frames[hand.frame, :3, 3]
    middle = 0.5 * (placed.max(axis=0) + placed.min(axis=0))
    np.testing.assert_allclose(middle, frames[[5, 7], :3, 3].mean(axis=0), atol=2e-3)


_STL = "solid t\n" + "".join(
    f"facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n"
    for corners in (
        "vertex 0 0 0\nvertex 0 0.1 0\nvertex 0.1 0 0\n",
        "vertex 0 0 0\nvertex 0.1 0 0\nvertex 0 0 0.1\n",
        "vertex 0 0 0\nvertex 0 0 0.1\nvertex 0 0.1 0\n",
        "vertex 0.1 0 0\nvertex 0 0.1 0\nvertex 0 0 0.1\n",
    )
)  # fmt: skip


def _urdf(tmp_path: Path, visuals: dict[str, str]) -> Path:
    """Write the iiwa as URDF with visuals on links."""
    text = IIWA.to_urdf()
    for link, visual in visuals.items():
        plain = f'<link name="{link}" />'
        assert plain in text
        text = text.replace(plain, f'<link name="{link}"><visual>{visual}</visual></link>')
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    return path


def _links(path: Path) -> list[str]:
    return [line.split('"')[1] for line in path.read_text().splitlines() if "<link " in line]


def test_meshes_of_a_urdf_are_drawn_where_the_file_puts_them(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    links = _links(_urdf(tmp_path, {}))
    (tmp_path / "my_robot" / "meshes").mkdir(parents=True)
    (tmp_path / "my_robot" / "meshes" / "tip.stl").write_text(_STL + "endsolid t\n")
    mesh = '<geometry><mesh filename="package://my_robot/meshes/tip.stl" scale="2 2 2"/></geometry>'
    visual = f'<origin xyz="0.01 0.02 0.03" rpy="0.1 0.2 0.3"/>{mesh}'
    pink = '<material name="m"><color rgba="1 0 0.5 1"/></material>'
    box = f'<geometry><box size="0.1 0.2 0.3"/></geometry>{pink}'
    path = _urdf(tmp_path, {links[3]: visual, links[0]: box})
    arm = aa.Arm.from_urdf(path)
    solids, note = solids_of(arm, path)
    assert note == ""
    own = {solid.name: solid for solid in solids}
    assert own[f"{links[0]}_0"].colour == (255, 0, 128)
    np.testing.assert_allclose(np.ptp(own[f"{links[0]}_0"].vertices, axis=0), [0.1, 0.2, 0.3], atol=1e-9)
    assert np.ptp(own[f"{links[3]}_0"].vertices, axis=0).max() > 0.19
    assert own[f"{links[3]}_0"].frame == 3
    assert "upper_arm" not in own
    assert "forearm" in own


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("package://nowhere/none.stl", "no such file"),
        ("http://127.0.0.1:9/a.stl", "only local files are read"),
        ("broken.stl", ""),
        ("a.unknown", ""),
    ],
)
def test_an_unreadable_mesh_is_a_capsule_and_said_once(tmp_path: Path, name: str, why: str) -> None:
    pytest.importorskip("trimesh")
    (tmp_path / "broken.stl").write_bytes(b"\x00" * 10)
    (tmp_path / "a.unknown").write_text("x")
    links = _links(_urdf(tmp_path, {}))
    visual = f'<geometry><mesh filename="{name}"/></geometry>'
    path = _urdf(tmp_path, {links[2]: visual, links[3]: visual})
    solids, note = solids_of(aa.Arm.from_urdf(path), path)
    assert note.startswith(f"2 meshes are drawn as capsules; the first: {links[2]}_0: ")
    assert why in note
    assert {solid.name for solid in solids} == {solid.name for solid in capsules(IIWA)}


# -- the server, as far as no browser is needed -----------------------------------------------------------


def test_without_viser_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(aa.MissingExtraError, match=r"pip install 'armangle\[view\]'"):
        Viewer(_paper())


def test_a_busy_port_is_refused_by_its_number() -> None:
    pytest.importorskip("viser")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(aa.PortError, match=f"port {port} of .* is taken"):
            Viewer(_paper(), port=port)
    with pytest.raises(aa.PortError, match="port is 70000"):
        Viewer(_paper(), port=70000)
    with pytest.raises(aa.PortError, match=r"192\.0\.2\.1 cannot be had"):
        Viewer(_paper(), port=8080, host="192.0.2.1")


def test_it_serves_this_machine_alone_and_prints_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("viser")
    viewer = Viewer(_paper(), port=0)
    try:
        assert viewer.url.startswith("http://127.0.0.1:")
        assert viewer.note == ""
    finally:
        viewer.stop()
    viewer.wait()
    assert capsys.readouterr().out == ""


def test_a_hand_that_is_faster_than_the_arm_is_not_pulled_back() -> None:
    pytest.importorskip("viser")
    viewer = Viewer(_paper(), port=0)
    try:
        slider = viewer.controls.psi

        def moved_on_meanwhile() -> None:
            viewer.controls._turn()
            slider.value = 120.0

        slider.value = 100.0
        viewer.act(moved_on_meanwhile)
        assert slider.value == 120.0
        assert np.degrees(viewer.state.psi) == pytest.approx(100.0)
        slider.value = 34.0
        viewer.act(viewer.controls._turn)
        assert slider.value == pytest.approx(42.7)
    finally:
        viewer.stop()


def test_play_runs_to_the_end_and_stops() -> None:
    pytest.importorskip("viser")
    poses = PAPER_POSES[:6]
    run = aa.follow(PAPER_ARM, poses, start=PAPER_Q)
    viewer = Viewer(ViewerState(PAPER_ARM), {"short": run}, port=0)
    try:
        np.testing.assert_allclose(viewer.state.q, run.q[0])
        viewer.controls.set_playing(True)
        for _ in range(100):
            if not viewer.controls.playing:
                break
            viewer._stopped.wait(0.05)
        assert viewer.state.row == 5
        assert not viewer.controls.playing
    finally:
        viewer.stop()
