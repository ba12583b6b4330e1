"""The viewer's panels: HTML that holds the numbers, and the small picture of the feasible map."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from support.calibrated import calibrated

import armangle as aa
from armangle.arm.skeleton import NOT_PROVEN
from armangle.cli.motions import motion_of
from armangle.viewer import ViewerState
from armangle.viewer.controls import gc_name
from armangle.viewer.panels import arcs_panel, map_image, map_panel, png, reasons_panel, status_panel

from .conftest import PAPER_ARM, PAPER_POSES, PAPER_Q, paper, paper_motion

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")


def test_panels_hold_the_numbers() -> None:
    """The panels state GC, psi, the joints that end the arcs, and each reason once."""
    state = paper()
    assert "GC 3, ψ = 58.6°" in status_panel(state)
    arcs = arcs_panel(state)
    assert "joint 1" in arcs
    assert "joint 5" in arcs
    assert "joint 3" not in arcs
    assert reasons_panel(state).count("data-gc") == len({r for r in state.reasons() if r is not None})
    free = ViewerState(aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1))
    assert "joint" not in arcs_panel(free)
    assert gc_name(3) == "GC 3 −−+"


def test_what_is_not_proven_is_told_from_what_a_joint_blocks() -> None:
    """For a calibrated arm the panel, the answer and the circle say what is not proven."""
    arm = calibrated("kuka_iiwa7_r800", 2.0, 5.0)
    q = PAPER_Q.copy()
    q[5] = np.radians(0.05)  # axes 5 and 7 are nearly one: branches meet
    state = ViewerState(arm, q)
    open_arc = arm._left_out(state.pose, state.gc).intervals[0]
    assert "not proven" in arcs_panel(state) and "not proven" not in arcs_panel(paper())
    answer = state.set_psi(float(open_arc.mean()))
    assert not answer.ok and answer.text.endswith("is left out: nothing is proven there.")
    assert (state.elbow_circle().blocker == NOT_PROVEN).any()
    assert np.isfinite(state.elbow_circle().segments).all()


def test_names_from_files_are_text_and_never_markup() -> None:
    """Names and messages are escaped in HTML."""
    state = ViewerState(IIWA.with_(name="<script>x</script>"))
    state.message = "<b>"
    assert "<script>" not in status_panel(state)
    assert "&lt;b&gt;" in status_panel(state)


def test_the_map_is_a_png_of_who_blocks() -> None:
    """The map of a motion is a PNG; its panel states the row."""
    motion = paper_motion()
    image = map_image(motion)
    assert image.startswith("data:image/png;base64,iVBOR")
    panel = map_panel(motion, image, 125)
    assert "s = 0.500, pose 126 of 251" in panel
    assert panel.count("<polyline") == 2
    assert map_panel(motion, image, 0).count("<circle") == 1


def test_the_map_of_a_file_with_rows_that_are_not_solved(tmp_path: Path) -> None:
    """The map of a motion with gaps is the same when read from its file."""
    poses = PAPER_POSES.copy()
    poses[100:110, 2, 3] += 9.0
    motion = aa.follow(PAPER_ARM, poses, start=PAPER_Q, on_fail="skip")
    aa.io.save(motion, tmp_path / "gap.csv")
    again = motion_of(PAPER_ARM, aa.io.load_joints(tmp_path / "gap.csv"))
    assert map_image(again) == map_image(motion)  # both have the colour of what is out of reach there


def test_png_can_be_read_back() -> None:
    """`png` writes a valid indexed picture with these cells and colours."""
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
