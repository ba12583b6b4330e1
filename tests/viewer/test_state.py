"""The viewer without a browser: what it shows, refuses and says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.calibrated import calibrated
from support.moves import moved, refused

import armangle as aa
from armangle.cli.motions import motion_of, motions_along
from armangle.files.tables import load_joints, save
from armangle.models.catalogue import srs_catalogue
from armangle.viewer import ViewerState
from armangle.viewer.controls import slider_range
from armangle.viewer.entry import pose_of_text, text_of_pose
from armangle.viewer.opening import opening_posture
from armangle.viewer.panels import arcs_panel, reasons_panel
from armangle.viewer.scene import figure_segments, segment_colours
from armangle.viewer.state import ways_between

from .conftest import PAPER_ARM, PAPER_POSES, PAPER_Q, paper, paper_motion

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
WAM = aa.Arm.from_catalogue("barrett_wam7")


def _well_inside(arm: aa.Arm) -> None:
    """Check that `opening_posture` keeps min(0.6 rad, a quarter of the range) from limits and singularity."""
    q = opening_posture(arm)
    least = np.minimum(0.6, 0.25 * (arm.upper - arm.lower)) - 1e-9
    assert (np.minimum(q - arm.lower, arm.upper - q) >= least).all()
    theta = arm.geometry.signs * q + arm.geometry.offsets - np.array([0, 0, 0, arm.geometry.delta, 0, 0, 0])
    away = np.abs((theta + np.pi / 2) % np.pi - np.pi / 2)  # from the multiples of pi
    assert (away >= least)[[1, 3, 5]].all()
    np.testing.assert_array_equal(opening_posture(arm), q)


@pytest.mark.parametrize("name", srs_catalogue())
def test_every_arm_begins_bent_and_well_inside_its_limits(name: str) -> None:
    """`ViewerState` of every S-R-S arm of the catalogue begins bent and well inside its limits."""
    state = ViewerState(aa.Arm.from_catalogue(name))
    _well_inside(state.arm)
    np.testing.assert_array_equal(state.q, opening_posture(state.arm))
    assert not state.arcs.is_empty
    assert state.reason(state.gc) is None
    assert state.policy is None and state.target is None


def test_any_limits_have_a_posture_well_inside() -> None:
    """`opening_posture` is bent and well inside random limits, and one-sided ones."""
    rng = np.random.default_rng(3)
    for _ in range(300):
        middle, half = rng.uniform(-9, 9, 7), rng.choice([0.0, 1e-3, 0.3, 1.0, 2.5, 9.0], 7)
        _well_inside(
            IIWA.with_(
                a_3=0.05, a_4=-0.04, lower=middle - half, upper=middle + half,
                signs=rng.choice([-1, 1], 7), offsets=rng.uniform(-3, 3, 7),
            )
        )  # fmt: skip
    one_sided = IIWA.with_(lower=np.full(7, 4.0), upper=np.full(7, np.inf))
    _well_inside(one_sided)
    assert (opening_posture(one_sided) < 4.0 + 2 * np.pi).all()


FREE = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1)


def test_an_arm_without_limits_begins_too() -> None:
    """`ViewerState` takes an arm without limits."""
    state = ViewerState(FREE)
    assert state.reasons() == [None] * 8 and json.loads(state.export())["margin"] is None


@pytest.mark.parametrize(
    ("start", "error", "message"),
    [
        (np.zeros(6), aa.InputError, "q has shape"),
        (np.zeros((2, 7)), aa.InputError, "q has shape"),
        (np.full(7, np.nan), aa.InputError, "wanted finite angles"),
        ([0, 3, 0, 0, 0, 0, 0], aa.LimitError, "joint 2 is 3 rad, outside its limits"),
    ],
)
def test_a_start_that_is_no_posture_is_refused(start: object, error: type, message: str) -> None:
    """`ViewerState` refuses a start of other shape, NaN or outside the limits, and a rate without dt."""
    refused(error, message, ViewerState, IIWA, start)
    refused(aa.InputError, "dt is missing", ViewerState, IIWA, policy=aa.Repulsion(rate=2.0))


OFFSET = [aa.Arm.load(name) for name in ("franka_fr3", "ufactory_xarm7", "willow_garage_pr2_left", "fetch")]
OFFSET += [calibrated("franka_fr3", 1.0, 1.0), calibrated("fetch", 1.0, 1.0)]


@pytest.mark.parametrize("made", OFFSET, ids=lambda arm: f"{arm.name} {arm.kind}")
def test_an_arm_with_an_offset_is_moved_over_its_free_joint(made: aa.Arm) -> None:
    """`set_psi` of an offset arm turns its free joint and keeps the tool, or says why not."""
    arm = made.with_(body="guessed")
    scene = aa.Scene([aa.Box(aa.pose([0.9, 0.4, 0.9]), [0.1, 0.1, 0.1], name="box")])
    state = ViewerState(arm.with_(scene=scene))
    free = 0 if arm.redundancy == "joint_1" else 6
    said = set()
    for psi in np.linspace(-3.0, 3.0, 13):
        pose, answer = state.pose, state.set_psi(float(psi))
        said.add(answer.text)
        assert answer.ok == (abs(state.psi - psi) < 1e-9) and state.q[free] == pytest.approx(state.psi)
        np.testing.assert_allclose(arm.forward(state.q)[0], pose, atol=1e-9)
        assert arm.within_limits(state.q, 1e-9)
    assert "" in said and len(said) > 1
    nearer = moved(state.pose, [0.0, 0.0, -0.02])
    assert state.set_pose(nearer).ok and np.allclose(state.pose, nearer, atol=1e-6)
    assert not state.set_pose(moved(nearer, [3.0, 0.0, 0.0])).ok and "mm short of it" in state.message
    if made.geometry.chain is None:  # the intervals of a chain leave out what is not proven
        assert state.reason(state.gc) is None
    for gc, figure in state.ghosts().items():
        assert gc != state.gc and figure.shape == (9, 3)
    circle, points = state.elbow_circle(), arm.elbow(state.q)
    assert np.isfinite(circle.segments).all() and np.linalg.norm(circle.segments - points, axis=-1).max() < 2
    assert "no solution" in arcs_panel(state)
    answer = state.move_box("box", aa.pose(arm.elbow(state.q)))
    assert not answer.ok and "box" in answer.text


# -- one joint ---------------------------------------------------------------------------------------


def test_a_joint_moves_alone_and_the_rest_follows_from_it() -> None:
    """`set_joint` moves one joint; pose, psi and gc are those of `forward`."""
    rng = np.random.default_rng(5)
    for arm in (IIWA, WAM, aa.Arm.from_catalogue("openarm_v10")):
        state = ViewerState(arm)
        for joint in (*range(1, 8), *range(1, 8)):
            wanted = state.q.copy()
            wanted[joint - 1] = rng.uniform(arm.lower[joint - 1], arm.upper[joint - 1])
            assert state.set_joint(joint, wanted[joint - 1]).ok
            np.testing.assert_array_equal(state.q, wanted)
            pose, psi, gc = arm.forward(wanted)
            np.testing.assert_array_equal(state.pose, pose)
            assert (state.psi, state.gc) == (psi, gc)


def test_a_joint_stops_at_its_limit_or_where_it_would_fold_the_arm_and_says_so() -> None:
    """`set_joint` stops at a limit, and refuses a fold, with a message."""
    state = ViewerState(IIWA)
    answer = state.set_joint(4, -2.5)
    assert not answer.ok and answer.text == "Joint 4 stops at its limit −120.0°."
    assert state.q[3] == IIWA.lower[3]
    refused(aa.InputError, "joint is 8", state.set_joint, 8, 0.0)
    refused(aa.InputError, "joint 2 is nan", state.set_joint, 2, np.nan)
    state = ViewerState(FREE)
    q = state.q.copy()
    answer = state.set_joint(4, np.pi)
    assert not answer.ok and answer.text == state.message != ""
    np.testing.assert_array_equal(state.q, q)


def test_a_joint_slider_spans_its_limits_to_a_tenth_of_a_degree() -> None:
    """`slider_range` is the limits in tenths of a degree; where one is infinite, a turn."""
    assert slider_range(-2.0, 1.0) == (-114.5, 57.2)
    assert slider_range(-1.396263, 0.785398) == (-80.0, 45.0)  # as files write them
    assert slider_range(np.radians(-170.0), np.radians(170.0)) == (-170.0, 170.0)
    assert slider_range(-np.inf, np.inf) == (-360.0, 360.0)
    assert slider_range(9.0, np.inf) == (515.7, 875.6)


# -- the arm angle -----------------------------------------------------------------------------------


def test_set_psi_turns_the_elbow_and_keeps_the_tool() -> None:
    """`set_psi` reaches each psi, and keeps pose, gc and limits."""
    state = paper()
    pose, gc = state.pose.copy(), state.gc
    for psi in np.radians([60, 100, 170, 200, 300, 320]):
        assert state.set_psi(psi).ok
        np.testing.assert_allclose(state.pose, pose, atol=1e-12)
        assert np.isclose(np.exp(1j * state.psi), np.exp(1j * psi))
        assert state.gc == gc
        assert state.arm.within_limits(state.q, tol=1e-9)


def test_set_psi_stops_at_the_limit_and_names_the_joint() -> None:
    """`set_psi` beyond a limit stops there and names the joint."""
    state = paper()
    answer = state.set_psi(np.radians(34.0))
    assert not answer.ok
    assert answer.text == state.message == "ψ = 34.0° is blocked by joint 5."
    assert np.degrees(state.psi) == pytest.approx(42.70, abs=0.01)
    assert state.arm.within_limits(state.q, tol=1e-9)
    assert "blocked by joint 1." in state.set_psi(np.radians(-30.0)).text
    refused(aa.InputError, "psi is nan", lambda: state.set_psi(np.nan))


# -- the tool ----------------------------------------------------------------------------------------


def test_set_pose_goes_there_continuously_and_within_limits() -> None:
    """`set_pose` reaches the pose in the same gc; out of reach it says so and stays within limits."""
    state, wanted = paper(), PAPER_POSES[-1]
    assert state.set_pose(wanted).ok
    np.testing.assert_allclose(state.pose, wanted, atol=1e-9)
    assert state.gc == 3 and state.arm.within_limits(state.q, tol=1e-9)
    state = paper()
    assert state.set_pose(PAPER_POSES[20].astype(np.float32)).ok  # the rounding of a browser
    refused(aa.InputError, "pose has shape", state.set_pose, PAPER_POSES[:2])
    far = state.pose.copy()
    far[:3, 3] = [0.0, 0.0, 5.0]
    answer = state.set_pose(far)
    assert not answer.ok and answer.text
    assert state.arm.within_limits(state.q, tol=1e-9) and np.linalg.norm(state.pose[:3, 3]) < 1.4


def test_a_refused_target_is_kept_until_the_next_wish() -> None:
    """`target` holds a refused pose until any other wish."""
    state = ViewerState(IIWA)
    far = moved(state.pose, [2.0, 0.0, 0.0])
    wishes = (
        lambda: state.set_pose(state.pose),
        lambda: state.set_joint(1, 0.3),
        lambda: state.set_psi(state.psi),
        lambda: state.set_gc(state.gc),
        state.reset,
    )
    for wish in wishes:
        assert not state.set_pose(far).ok
        assert state.target is not None
        np.testing.assert_array_equal(state.target, aa.nearest_rotation(far))
        assert np.abs(state.pose - far).max() > 0.1 and state.message
        assert wish().ok
        assert state.target is None


@pytest.mark.parametrize("policy", [None, aa.Hold()])
def test_a_dragged_arm_follows_and_its_elbow_does_not_run_off(policy: aa.Hold | None) -> None:
    """`set_pose` nearby is met, psi changing little as a tracker does, or not at all when held."""
    rng, turned = np.random.default_rng(11), []
    for _ in range(40):
        state = ViewerState(IIWA, policy=policy)
        psi, wanted = state.psi, moved(state.pose, rng.uniform(-0.15, 0.15, 3))
        if state.set_pose(wanted).ok:
            np.testing.assert_allclose(state.pose, wanted, atol=1e-9)
            turned.append(abs(state.psi - psi))
    assert len(turned) == 40 if policy is None else len(turned) > 30
    if policy is None:
        assert np.median(turned) < np.radians(10) and max(turned) < np.radians(45)
    else:
        assert max(turned) < 1e-9


def test_out_of_reach_it_goes_to_the_nearest_pose_and_says_how_far_it_is() -> None:
    """`set_pose` out of reach states the distance left, no more than with Hold, and can go home."""
    rng = np.random.default_rng(5)
    for _ in range(10):
        state = ViewerState(IIWA)
        home, far = state.pose.copy(), state.pose.copy()
        way = rng.normal(size=3)
        far[:3, 3] += 1.5 * way / np.linalg.norm(way)
        answer = state.set_pose(far)
        assert not answer.ok
        short = np.linalg.norm(far[:3, 3] - state.pose[:3, 3])
        assert f"The tool is {1e3 * short:.0f} mm short of it." in answer.text
        steps = ViewerState(IIWA, policy=aa.Hold())
        steps.set_pose(far)
        assert short <= np.linalg.norm(far[:3, 3] - steps.pose[:3, 3]) + 1e-6  # no worse than stopping
        assert IIWA.within_limits(state.q)
        assert state.set_pose(home).ok
        np.testing.assert_allclose(state.pose, home, atol=1e-9)


def test_the_policy_of_eq_36_moves_psi_while_the_tool_is_dragged() -> None:
    """`set_pose` under Repulsion ends at another psi than under Hold."""
    held, repelled = paper(), paper()
    held.policy = aa.Hold()
    repelled.policy = aa.Repulsion(K=0.3, alpha=5)
    for state in (held, repelled):
        assert state.set_pose(PAPER_POSES[100]).ok
    arcs = repelled.arcs
    assert np.abs(np.diff(arcs.nearest([held.psi, repelled.psi]))) > 0.1


def test_ways_between_are_short_and_end_exactly() -> None:
    """`ways_between` two poses has steps of at most 1 cm and 2 degrees."""
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


def test_reasons_agree_with_the_arcs() -> None:
    """`reasons` and `set_gc` refuse exactly the gc whose arcs are empty."""
    rng = np.random.default_rng(1)
    arm = aa.Arm.from_catalogue("openarm_v10")
    for _ in range(30):
        state = ViewerState(arm, rng.uniform(arm.lower, arm.upper))
        arcs = [arm.feasible(state.pose, gc) for gc in range(8)]
        assert [reason is None for reason in state.reasons()] == [not a.is_empty for a in arcs]
        for gc in range(8):
            answer = state.set_gc(gc)
            assert answer.ok == (not arcs[gc].is_empty)
            assert answer.ok == (state.gc == gc)
            if not answer.ok:
                assert answer.text.startswith(f"GC {gc}: ")
    refused(aa.InputError, "gc is 8", lambda: state.set_gc(8))


def test_reasons_name_the_joint() -> None:
    """`reason` names the joint that is outside at every psi, and the panel lists each reason once."""
    narrow = IIWA.with_(
        lower=np.where(np.arange(7) == 5, 0.0, IIWA.lower), upper=np.where(np.arange(7) == 3, 2.0, IIWA.upper)
    )
    narrow = narrow.with_(lower=np.where(np.arange(7) == 3, 0.0, narrow.lower))
    state = ViewerState(narrow, [0.1, 0.4, 0.2, 1.2, 0.3, 0.8, 0.5])
    assert state.gc == 0
    assert state.reason(4) == "Joint 6 is outside its limits at every ψ."
    assert state.reason(2) == aa.Status.ELBOW_LIMIT.sentence
    panel = reasons_panel(state)
    same = [str(gc) for gc in range(8) if state.reason(gc) == state.reason(4)]
    assert f'<div data-gc="{" ".join(same)}"><b>GC {", ".join(same)}</b>: Joint 6 is outside' in panel


def test_limits_that_block_together_are_all_named() -> None:
    """`reasons` says of limits of several joints that these together block every psi."""
    found = None
    rng = np.random.default_rng(0)
    arm = aa.Arm.from_catalogue("openarm_v10")
    while found is None:
        state = ViewerState(arm, rng.uniform(arm.lower, arm.upper))
        found = next((r for r in state.reasons() if r is not None and r.startswith("Joints")), None)
    assert found.endswith("together block every ψ.")


def test_ghosts_reach_the_same_tool() -> None:
    """`ghosts` are the other feasible gc, at the same tool."""
    state = paper()
    ghosts = state.ghosts()
    assert set(ghosts) == {gc for gc in range(8) if state.reason(gc) is None} - {3}
    for figure in ghosts.values():
        np.testing.assert_allclose(figure[-1], state.pose[:3, 3], atol=1e-9)
    assert figure_segments(list(ghosts.values())).shape == (7 * len(ghosts), 2, 3)


def test_the_elbow_circle_says_who_blocks() -> None:
    """`elbow_circle` has parts that are free or blocked by joint 1 or 5, in three colours, and passes E."""
    state = paper()
    circle = state.elbow_circle()
    assert set(circle.blocker.tolist()) == {0, 1, 5}
    elbow = state.arm.frames(state.q)[3, :3, 3]
    assert np.linalg.norm(circle.segments[:, 0] - elbow, axis=1).min() < 0.01
    colours = segment_colours(circle.blocker)
    assert colours.shape == circle.segments.shape
    assert len(np.unique(colours.reshape(-1, 3), axis=0)) == 3


# -- motion, export, reset ---------------------------------------------------------------------------


def test_a_motion_is_played_row_by_row() -> None:
    """`set_motion` and `seek` show a motion's rows; a motion of another arm is refused."""
    state, motion = paper(), paper_motion()
    assert not state.seek(0).ok
    assert state.set_motion(motion).ok
    for row in (0, 100, 250):
        assert state.seek(row).ok
        np.testing.assert_allclose(state.q, motion.q[row])
    assert state.seek(9999).ok
    assert state.row == 250
    refused(aa.InputError, "the motion is of", lambda: ViewerState(WAM).set_motion(motion))


def test_reset_goes_back_to_where_it_began_and_to_the_first_row_of_a_motion() -> None:
    state, motion = ViewerState(PAPER_ARM), paper_motion()
    begun = state.q.copy()
    state.set_joint(2, 0.3)
    assert state.reset().ok
    np.testing.assert_array_equal(state.q, begun)
    state.set_motion(motion)
    begun = state.q.copy()
    np.testing.assert_array_equal(begun, motion.q[0])
    state.seek(77)
    state.set_gc(0)
    assert state.reset().ok
    np.testing.assert_array_equal(state.q, begun)
    assert (state.row, state.gc, state.message) == (0, 3, "")


def test_a_motion_begins_at_its_first_solved_row() -> None:
    """`set_motion` shows the first row that is solved."""
    poses = PAPER_POSES.copy()
    poses[:4, :3, 3] += 3.0
    motion = aa.follow(PAPER_ARM, poses, start=PAPER_Q, on_fail="skip", max_joint_step=np.inf)
    state = paper()
    assert not state.set_motion(motion).ok
    assert state.row == 4
    np.testing.assert_array_equal(state.q, motion.q[4])


# -- the tool by numbers -----------------------------------------------------------------------------


def test_a_pose_goes_through_its_text() -> None:
    """`pose_of_text` reads what `text_of_pose` wrote, in m or mm."""
    rng = np.random.default_rng(2)
    for pose in PAPER_ARM.forward(rng.uniform(-1.5, 1.5, (50, 7)))[0]:
        again = pose_of_text(*text_of_pose(pose), PAPER_ARM)
        np.testing.assert_allclose(again, pose, atol=3e-4)
    metres = pose_of_text("0.4, -0.1, 0.5", "180 0 90", PAPER_ARM)
    np.testing.assert_allclose(pose_of_text("400 -100 500mm", "180 0 90 deg", PAPER_ARM), metres)
    np.testing.assert_allclose(metres[:3, :3], [[0, 1, 0], [1, 0, 0], [0, 0, -1]], atol=1e-15)


@pytest.mark.parametrize(
    ("xyz", "rpy", "message"),
    [
        ("", "0 0 0", "x y z has 0 numbers, wanted three in m, or in mm"),
        ("1 2", "0 0 0", "x y z has 2 numbers"),
        ("a 2 3", "0 0 0", "x y z is 'a 2 3', wanted three numbers"),
        ("nan 0 0", "0 0 0", "x y z is 'nan 0 0', wanted three finite"),
        ("0 0 0.5", "0 0", "roll pitch yaw has 2 numbers, wanted three in degrees"),
        ("0 0 0.5", "0 0 inf", "roll pitch yaw is '0 0 inf', wanted three finite"),
        ("400 0 500", "0 0 0", "x y z is 640.3 m from the base and the arm reaches 0.8 m"),
    ],
)
def test_numbers_that_are_no_pose_are_refused(xyz: str, rpy: str, message: str) -> None:
    """`pose_of_text` refuses missing, infinite and far numbers."""
    with pytest.raises(aa.InputError, match=message):
        pose_of_text(xyz, rpy, PAPER_ARM)


def test_rows_that_were_not_solved_leave_the_arm_where_it_is() -> None:
    """`seek` to an unsolved row leaves the arm and says why."""
    poses = PAPER_POSES.copy()
    poses[100:, :3, 3] += 3.0
    motion = aa.follow(PAPER_ARM, poses, start=PAPER_Q, max_joint_step=np.inf)
    state = paper()
    answer = state.set_motion(motion)
    assert not answer.ok
    assert "pose 100" in answer.text
    state.seek(99)
    q = state.q.copy()
    assert not state.seek(150).ok
    np.testing.assert_array_equal(state.q, q)
    assert "Pose 150: " in state.message
    nothing = aa.follow(PAPER_ARM, poses[100:], start=PAPER_Q)
    refused(aa.InputError, "no solved row", lambda: state.set_motion(nothing))


def test_export_is_json_of_the_posture_and_reset_goes_home() -> None:
    """`export` gives the posture as JSON; `reset` goes back to the start."""
    state = paper()
    state.set_psi(2.0)
    facts = json.loads(state.export())
    assert facts["robot"] == "kuka_iiwa7_r800"
    assert facts["gc_signs"] == [-1, -1, 1]
    np.testing.assert_array_equal(facts["q"], state.q)
    np.testing.assert_allclose(
        PAPER_ARM.inverse(facts["pose"], facts["psi"], facts["gc"], limits=False), state.q, atol=1e-9
    )
    assert facts["margin"] == pytest.approx(PAPER_ARM.limit_margin(state.q))
    assert state.reset().ok
    np.testing.assert_allclose(state.q, PAPER_Q)


def test_a_joint_file_becomes_a_motion(tmp_path: Path) -> None:
    """`motion_of` the rows of a saved motion is that motion."""
    motion = paper_motion()
    save(motion, tmp_path / "joints.csv")
    again = motion_of(PAPER_ARM, load_joints(tmp_path / "joints.csv"))
    np.testing.assert_allclose(again.q, motion.q)
    np.testing.assert_allclose(again.psi, motion.psi, atol=1e-9)
    np.testing.assert_allclose(again.margin, motion.margin, atol=1e-12)
    assert (again.status == motion.status).all() and again.ok
    (tmp_path / "none.csv").write_text("q1,q2,q3,q4,q5,q6,q7\n" + ",".join(["nan"] * 7) + "\n")
    with pytest.raises(aa.PathError, match="no row has joint values"):
        motion_of(PAPER_ARM, load_joints(tmp_path / "none.csv"))


def test_rows_of_a_joint_file_that_are_not_solved_stay_in_its_motion(tmp_path: Path) -> None:
    """`motion_of` a saved motion keeps its gaps and held rows, with the same explanation."""
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
    motion = aa.follow(PAPER_ARM, poses, start=PAPER_Q, on_fail="hold", max_joint_step=0.1)
    save(motion, tmp_path / "joints.csv")
    again = motion_of(PAPER_ARM, load_joints(tmp_path / "joints.csv"))
    held = motion.status != aa.Status.OK
    assert motion.first_failure == 100 and np.isfinite(again.q).all()
    assert np.isnan(again.poses[held]).all() and np.isfinite(again.poses[~held]).all()
    assert motion.explain().startswith(again.explain())


def test_poses_become_motions_of_every_configuration() -> None:
    """`motions_along` gives a motion for each gc, whole ones first, or one from a start."""
    motions = motions_along(PAPER_ARM, PAPER_POSES)
    assert {"GC 0", "GC 3"} <= set(motions)
    assert [m.ok for m in motions.values()] == sorted((m.ok for m in motions.values()), reverse=True)
    assert all((m.gc[m.gc >= 0] == int(name[-1])).all() for name, m in motions.items())
    assert list(motions_along(PAPER_ARM, PAPER_POSES, PAPER_Q)) == ["from the start"]
    with pytest.raises(aa.PathError, match="no global configuration"):
        motions_along(PAPER_ARM, PAPER_POSES + np.diag([0, 0, 0, 0.0]) + 9 * np.eye(4, k=3))
