"""The viewer without a browser: what it shows, refuses and says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import armangle as aa
from armangle.cli import paper_example
from armangle.cli.motions import motion_of, motions_along
from armangle.files.tables import load_joints, save
from armangle.viewer import ViewerState
from armangle.viewer.panels import (
    reasons_panel,
)
from armangle.viewer.scene import figure_segments, segment_colours
from armangle.viewer.state import ways_between

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
PAPER_ARM, PAPER_Q, PAPER_POSES = paper_example.example()
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
        (np.full(7, np.nan), aa.NotFiniteError, "wanted finite angles"),
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
    np.testing.assert_array_equal(poses[-1], last)
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
    assert (again.status == motion.status).all() and again.ok
    (tmp_path / "none.csv").write_text("q1,q2,q3,q4,q5,q6,q7\n" + ",".join(["nan"] * 7) + "\n")
    with pytest.raises(aa.PathError, match="no row of the joint file"):
        motion_of(PAPER_ARM, load_joints(tmp_path / "none.csv"))


def test_rows_of_a_joint_file_that_are_not_solved_stay_in_its_motion(tmp_path: Path) -> None:
    poses = PAPER_POSES.copy()
    poses[100:110, 2, 3] += 9.0
    for on_fail, first in (("skip", 110), ("stop", len(poses))):
        motion = aa.follow(PAPER_ARM, poses, start=PAPER_Q, on_fail=on_fail)
        save(motion, tmp_path / "joints.csv")
        again = motion_of(PAPER_ARM, load_joints(tmp_path / "joints.csv"))
        np.testing.assert_array_equal(again.status, motion.status)
        np.testing.assert_array_equal(again.gc, motion.gc)
        np.testing.assert_allclose(again.q, motion.q)
        np.testing.assert_allclose(again.psi, motion.psi, atol=1e-9)
        assert np.isnan(again.q[100:first]).all() and np.isnan(again.poses[100:first]).all()
        assert motion.explain().startswith(again.explain())  # which lacks by how much the pose is missed
    poses[100:110] = PAPER_POSES[200:210]  # a jump
    motion = aa.follow(PAPER_ARM, poses, start=PAPER_Q, on_fail="hold")
    save(motion, tmp_path / "joints.csv")
    again = motion_of(PAPER_ARM, load_joints(tmp_path / "joints.csv"))
    held = motion.status != aa.Status.OK
    assert motion.first_failure == 100 and np.isfinite(again.q).all()
    assert np.isnan(again.poses[held]).all() and np.isfinite(again.poses[~held]).all()
    assert motion.explain().startswith(again.explain())


def test_poses_become_motions_of_every_configuration() -> None:
    motions = motions_along(PAPER_ARM, PAPER_POSES)
    assert {"GC 0", "GC 3"} <= set(motions)
    assert [m.ok for m in motions.values()] == sorted((m.ok for m in motions.values()), reverse=True)
    assert all((m.gc[m.gc >= 0] == int(name[-1])).all() for name, m in motions.items())
    assert list(motions_along(PAPER_ARM, PAPER_POSES, PAPER_Q)) == ["from the start"]
    with pytest.raises(aa.PathError, match="no global configuration"):
        motions_along(PAPER_ARM, PAPER_POSES + np.diag([0, 0, 0, 0.0]) + 9 * np.eye(4, k=3))
