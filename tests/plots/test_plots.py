"""The plots: each is drawn, and its artists hold the numbers that the library gives."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.calibrated import calibrated
from support.moves import refused
from support.needs import need

import armangle as aa

matplotlib = need("matplotlib")
matplotlib.use("Agg")
plt = need("matplotlib.pyplot")
from armangle import colours, plots  # noqa: E402 - after the backend is chosen
from armangle.viewer.scene import segment_colours  # noqa: E402 - after the backend is chosen

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
WAM = aa.Arm.from_catalogue("barrett_wam7")
LOOK = np.random.default_rng(7).uniform(-np.pi, np.pi, 200)
# Faria et al. (2018), Eq. (37).
PAPER_Q = np.radians([-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812])
POSE, PSI, GC = IIWA.forward(PAPER_Q)
BODIED = IIWA.with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
LAMP = aa.Ball(IIWA.elbow(IIWA.inverse(POSE, PSI + 0.8, GC, limits=False)), 0.05, name="lamp")
CAGE = aa.Scene([aa.Ball(IIWA.frames(np.zeros(7))[1, :3, 3], 0.2, name="cage")])


@pytest.fixture(autouse=True)
def _closed_figures() -> Iterator[None]:
    """Draw and close all figures after each test."""
    yield
    for number in plt.get_fignums():
        plt.figure(number).draw_without_rendering()
    plt.close("all")


def _poses(count: int) -> np.ndarray:
    """Return the paper's straight line of 0.25 m along the tool's z axis."""
    poses = np.repeat(POSE[None], count, axis=0)
    poses[:, :3, 3] += np.linspace(0, 0.25, count)[:, None] * POSE[:3, 2]
    return poses


def _path(alpha: float = 20.0, count: int = 60) -> aa.JointPath:
    """A path followed along `_poses(count)` under Repulsion(alpha)."""
    return aa.follow(IIWA, _poses(count), start=PAPER_Q, policy=aa.Repulsion(alpha=alpha))


def _labels(ax: object) -> set[str]:
    """The labels of the legend entries of an axes."""
    return set(ax.get_legend_handles_labels()[1])


def _figure_labels(ax: object) -> set[str]:
    """The texts of all legends of an axes' figure."""
    return {text.get_text() for legend in ax.figure.legends for text in legend.get_texts()}


@pytest.mark.parametrize("arm", [IIWA, WAM], ids=lambda arm: arm.name)
def test_arm_frames_draws_the_frames_where_they_are(arm: aa.Arm) -> None:
    """`plots.arm_frames` labels frames 0 to 7, and draws shoulder, elbow, wrist and tool where they are."""
    q = np.array([0.3, 0.5, 0.2, 1.2, 0.1, 0.5, 0.0])
    ax = plots.arm_frames(arm, q)
    names = [text.get_text() for text in ax.texts]
    assert [n for n in names if n != "tool"] == [f"{{{i}}}" for i in range(8)]
    drawn = np.array(ax.lines[0].get_data_3d()).T
    np.testing.assert_allclose(drawn[-1], arm.forward(q)[0][:3, 3], atol=1e-12)
    np.testing.assert_allclose(drawn[[1, 3, 5]], arm.frames(q)[[1, 3, 5], :3, 3], atol=1e-12)
    assert ax.get_xlabel() == "x (m)"


def test_the_skeleton_has_the_lengths_of_the_arm() -> None:
    """The links that `plots.arm_frames` draws have the arm's lengths."""
    points = np.array(plots.arm_frames(WAM, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]).lines[0].get_data_3d()).T
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    wanted = [
        WAM.geometry.d_bs,
        WAM.geometry.d_se,
        abs(WAM.geometry.a_3),
        abs(WAM.geometry.a_4),
        WAM.geometry.d_ew,
        WAM.geometry.d_wf,
    ]
    np.testing.assert_allclose(lengths[:6], wanted, atol=1e-12)


def test_stick_figure_colours_the_circle_as_the_arcs_say() -> None:
    """`plots.stick_figure` colours the elbow's circle by the joints that block it."""
    ax = plots.stick_figure(IIWA, PAPER_Q)
    assert {"feasible", "blocked by joint 1", "blocked by joint 5", "elbow"} == _labels(ax)
    parts = {line.get_color(): line for line in ax.lines if line.get_label().startswith("blocked")}
    piece = np.array(parts[plots.JOINT_COLOURS[4]].get_data_3d()).T
    blocked = (~IIWA.feasible(POSE, GC, per_joint=True)[4]).intervals[0]
    ends = IIWA.frames(IIWA.inverse(POSE, blocked, GC, limits=False))[:, 3, :3, 3]
    np.testing.assert_allclose(piece[[0, -1]], ends, atol=2e-3)
    assert len(plots.stick_figure(IIWA, PAPER_Q, elbow_circle=False).lines) == 3


def test_free_is_lighter_and_wider_than_whatever_blocks() -> None:
    """In plots, viewer and page the colour of what is free is lighter than whatever blocks, and wider."""

    def light(colour: str) -> float:
        """Relative luminance (IEC 61966-2-1 and ITU-R BT.709), 0 to 1."""
        rgb = np.array(matplotlib.colors.to_rgb(colour))
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    assert light(colours.FREE) > 0.6 > light(colours.OBSTACLE) + 0.5
    for joint in set(colours.JOINT_COLOURS) - {colours.YELLOW}:  # joint 4 blocks a whole circle or nothing
        assert light(colours.FREE) > light(joint) + 0.15
    assert colours.FREE_WIDTH >= 2 * colours.BLOCKED_WIDTH
    lines = {line.get_label(): line for line in plots.stick_figure(IIWA, PAPER_Q).lines}
    free, blocked = lines["feasible"], lines["blocked by joint 1"]
    assert free.get_color() == colours.FREE and free.get_linewidth() >= 2 * blocked.get_linewidth()
    shown = segment_colours(np.arange(9))[:, 0].astype(int)  # 0: free, 1 to 7: joints, 8: an obstacle
    assert (np.abs(shown[1:] - shown[0]).max(axis=1) > 60).all()
    page = Path(__file__).parents[2] / "docs" / "browser" / "demo.js"
    if not page.exists():
        pytest.skip("the pages are not here")
    assert f"FREE = '{colours.FREE}', OBSTACLE = '{colours.OBSTACLE}'" in page.read_text(encoding="utf-8")


def test_virtual_arm_shows_both_elbows_and_psi() -> None:
    """`plots.virtual_arm` draws the real and virtual arm, both elbows and psi."""
    ax = plots.virtual_arm(IIWA, PAPER_Q)
    assert {"real arm", "virtual arm (ψ = 0)", "ψ = 58.6°", "half-plane ψ = 0"} <= _labels(ax)
    lines = {line.get_label(): np.array(line.get_data_3d()).T for line in ax.lines}
    virtual = IIWA.frames(IIWA.inverse(POSE, 0.0, GC, limits=False))
    np.testing.assert_allclose(lines["virtual arm (ψ = 0)"][3], virtual[3, :3, 3], atol=1e-12)
    assert {text.get_text() for text in ax.texts} == {"S", "W", "E", "Eᵛ"}


@pytest.mark.parametrize("arm", [IIWA, WAM], ids=lambda arm: arm.name)
def test_virtual_plane_has_true_lengths_and_angles(arm: aa.Arm) -> None:
    """`plots.virtual_plane` draws the upper arm and the wrist at their true distances and angle."""
    q = np.array([0.3, -0.5, 0.2, 1.2, 0.1, 0.5, 0.0])
    pose, _, gc = arm.forward(q)
    virtual = arm.inverse(pose, 0.0, gc, limits=False)
    points = plots.virtual_plane(arm, q).lines[0].get_xydata()
    assert np.linalg.norm(points[1]) == pytest.approx(arm.geometry.d_se, abs=1e-12)
    theta_2 = arm.geometry.signs[1] * virtual[1] + arm.geometry.offsets[1]
    assert abs(np.arctan2(*points[1])) == pytest.approx(abs(theta_2), abs=1e-9)
    wrist = arm.frames(q)[5, :3, 3] - arm.frames(q)[1, :3, 3]
    assert np.linalg.norm(points[-1]) == pytest.approx(np.linalg.norm(wrist), abs=1e-12)


def _wedges(ax: object, colour: str) -> float:
    """Return the total angle (rad) of bars of a colour in the outer ring."""
    wanted = matplotlib.colors.to_rgba(colour)
    bars = [bar for bar in ax.patches if bar.get_facecolor() == wanted and bar.get_y() > 9]
    return sum(bar.get_width() for bar in bars)


def test_circle_draws_the_complement_of_each_joint() -> None:
    """In `plots.circle` the bars of each joint add up to what the joint blocks."""
    ax = plots.circle(IIWA, POSE, GC, psi=PSI)
    for joint in range(1, 8):
        wanted = (~IIWA.feasible(POSE, GC, per_joint=True)[joint - 1]).measure
        assert _wedges(ax, plots.JOINT_COLOURS[joint - 1]) == pytest.approx(float(wanted), abs=1e-9)
    free = f"GC 3\n{np.degrees(IIWA.feasible(POSE, GC).measure):.1f}° free"
    assert [text.get_text() for text in ax.texts] == [free]
    assert "joint 5 blocks (ring 5)" in _figure_labels(ax)
    np.testing.assert_allclose(ax.lines[-1].get_xdata(), [PSI])


def test_figures_of_a_true_chain_hold_its_own_numbers() -> None:
    """Pictures of a calibrated arm hold the numbers of its own functions."""
    arm = calibrated("kuka_iiwa7_r800", 1.0, 1.0).with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
    pose, psi, gc = arm.forward(PAPER_Q)
    ax = plots.circle(arm, pose, gc, psi=psi)
    for joint in range(1, 8):
        wanted = (~arm.feasible(pose, gc, per_joint=True)[joint - 1]).measure
        assert _wedges(ax, plots.JOINT_COLOURS[joint - 1]) == pytest.approx(float(wanted), abs=1e-9)
    for panel, joint in zip(plots.joint_profiles(arm, pose, gc), (1, 2, 3, 5, 6, 7), strict=True):
        angles, q = panel.lines[0].get_data()
        known = np.isfinite(angles) & np.isfinite(q)
        wanted = arm.inverse(pose, np.radians(angles[known]), gc, limits=False)[:, joint - 1]
        np.testing.assert_allclose(np.radians(q[known]), wanted, atol=1e-9)
        assert panel.get_title() == f"joint {joint}"
    scene = aa.Scene([aa.Ball(arm.elbow(arm.inverse(pose, psi + 0.8, gc, limits=False)), 0.05, name="lamp")])
    assert "lamp" in [text.get_text() for text in plots.circle(arm.with_(scene=scene), pose, gc).texts]
    lines = plots.clearance_profile(arm.with_(scene=scene), pose, gc).lines
    (x, y) = next(line.get_data() for line in lines if line.get_label() == "lamp")
    shown = np.isfinite(y)
    near = arm.clearance(arm.inverse(pose, np.radians(x[shown]), gc, limits=False), scene).distance
    np.testing.assert_allclose(near, y[shown], atol=1e-9)
    assert plots.arm_frames(arm, PAPER_Q) is not None and plots.stick_figure(arm, PAPER_Q) is not None
    poses = np.tile(pose, (3, 1, 1))
    poses[:, 2, 3] += [0.0, 0.01, 0.02]
    plots.feasible_map((arm.with_(scene=scene), poses), gc=gc)
    plots.path(aa.follow(arm, poses, start=PAPER_Q))


def test_what_is_not_proven_is_told_from_what_a_joint_blocks() -> None:
    """Pictures hatch what is unproven, apart from what joints block."""
    arm = calibrated("kuka_iiwa7_r800", 2.0, 5.0)
    q = PAPER_Q.copy()
    q[5] = np.radians(0.05)  # axes 5 and 7 are nearly one: branches meet
    pose, _, gc = arm.forward(q)
    every, each = arm.feasible(pose, gc), arm.feasible(pose, gc, per_joint=True)
    left_out = float(every.unproven)
    assert left_out > 0.01 and arm._left_out(pose, gc).measure == pytest.approx(left_out, abs=1e-9)
    ax = plots.circle(arm, pose, gc)
    hatched = [bar for bar in ax.patches if bar.get_hatch()]
    for ring, wanted in [*((k + 2.0, each[k].unproven) for k in range(7)), (9.35, every.unproven)]:
        drawn = sum(bar.get_width() for bar in hatched if bar.get_y() == pytest.approx(ring))
        assert drawn == pytest.approx(float(wanted), abs=1e-9)
    for joint in range(1, 8):
        wanted = (~each[joint - 1]).measure - each[joint - 1].unproven
        assert _wedges(ax, plots.JOINT_COLOURS[joint - 1]) == pytest.approx(float(wanted), abs=1e-8)
    exact = plots.circle(IIWA, POSE, GC)
    assert "not proven" in _figure_labels(ax) and "not proven" not in _figure_labels(exact)
    assert f"{np.degrees(left_out):.1f}° not proven" in ax.get_title()
    assert "not proven" in _labels(plots.stick_figure(arm, q))
    panel = plots.joint_profiles(arm, pose, gc, joints=(1,))[0]
    assert "not proven" in _figure_labels(panel) and any(patch.get_hatch() for patch in panel.patches)
    assert "not proven" in _figure_labels(plots.feasible_map((arm, pose[None]), gc=int(gc)))


def test_circle_shows_what_the_user_forbids_and_what_is_singular() -> None:
    """`plots.circle` shows what `allowed` forbids in grey, and singular psi as crosses."""
    ax = plots.circle(IIWA, POSE, 0, allowed=aa.ArcSet([[-1.0, 2.5]]))
    assert "not allowed by the user" in _figure_labels(ax)
    assert _wedges(ax, "#7F7F7F") == pytest.approx(2 * np.pi - 3.5, abs=1e-9)
    q = np.array([0.4, 0.0, 0.5, 1.0, 0.3, 0.8, 0.2])
    pose, psi, gc = IIWA.forward(q)
    crosses = [line for line in plots.circle(IIWA, pose, gc).lines if line.get_marker() == "x"]
    assert crosses
    assert any(abs(np.angle(np.exp(1j * (line.get_xdata()[0] - psi)))) < 1e-6 for line in crosses)


def test_obstacles_have_a_ring_and_names_of_their_own() -> None:
    """`plots.circle` in a scene has a ring of what obstacles block, with their names."""
    scene = aa.Scene([LAMP, aa.HalfSpace([0, 0, 1], 0.0)])
    blocked = ~BODIED._clear(POSE, GC, scene)
    assert blocked.count == 1
    ax = plots.circle(BODIED.with_(scene=scene), POSE, GC, psi=PSI)
    dark = [bar for bar in ax.patches if bar.get_facecolor()[:3] == (64 / 255,) * 3]
    assert min(bar.get_y() for bar in dark) == 9.0 and len(dark) >= 2
    assert dark[0].get_width() == pytest.approx(blocked.measure)
    assert [text.get_text() for text in ax.texts if text.get_text() == "lamp"] == ["lamp"]
    ax = plots.circle(BODIED.with_(scene=CAGE), POSE, GC)
    assert "cage" in [text.get_text() for text in ax.texts]


@pytest.mark.parametrize("soft", [0.0, 0.04, 9.0])
def test_what_keeps_the_hard_clearance_alone_is_paler(soft: float) -> None:
    """`plots.circle` draws psi within the soft clearance alone in a paler grey."""
    clear = BODIED._clear(POSE, GC, aa.Scene([LAMP], clearance=0.01))
    ax = plots.circle(BODIED.with_(scene=aa.Scene([LAMP], clearance=0.01, soft=soft)), POSE, GC)
    grey = [bar for bar in ax.patches if bar.get_facecolor()[:3] == (127 / 255,) * 3]
    widths = [bar.get_width() for bar in grey if bar.get_y() == 9.0]
    calm = ~aa.ArcSet([[-4, 4]])
    if soft < 1:
        calm = BODIED._clear(POSE, GC, aa.Scene([LAMP], clearance=0.01 + soft))
    assert sum(widths) == pytest.approx(clear.measure - calm.measure, abs=1e-9)
    assert (sum(widths) > 0.05) == (soft > 0)
    assert ("within the soft clearance" in _figure_labels(ax)) == (soft > 0)


def _dotted(ax: object) -> list:
    """The collections of an axes that are hatched with dots."""
    return [c for c in ax.collections if getattr(c, "get_hatch", lambda: None)() == "...."]


def test_a_map_shows_what_obstacles_block_with_their_names() -> None:
    """`plots.feasible_map` in a scene hatches what obstacles block, with their names."""
    poses = np.tile(POSE, (5, 1, 1))
    poses[:, 2, 3] += np.linspace(0, 0.02, 5)
    scene = aa.Scene([LAMP, aa.Ball([5, 0, 0], 0.1, name="far")])
    ax = plots.feasible_map((BODIED.with_(scene=scene), poses), gc=GC)
    areas = [path.get_extents() for c in _dotted(ax) for path in c.get_paths()]
    drawn = sum(np.radians(box.height) * box.width for box in areas)
    blocked = (~BODIED._clear(poses, GC, scene)).measure
    assert drawn == pytest.approx(np.average(blocked, weights=[1, 2, 2, 2, 1]), rel=1e-6)
    assert [text.get_text() for text in ax.texts] == ["lamp"]
    assert "an obstacle blocks" in _figure_labels(ax)
    assert not _dotted(plots.feasible_map((BODIED, poses), gc=GC))
    ax = plots.feasible_map((BODIED.with_(scene=CAGE), poses), gc=GC)
    assert [text.get_text() for text in ax.texts] == ["cage"]


def test_a_clearance_profile_is_the_distance_of_the_nearest() -> None:
    """`plots.clearance_profile` draws `clearance` over psi, and marks what is blocked."""
    scene = aa.Scene([LAMP, aa.HalfSpace([0, 0, 1], 0, name="floor")], clearance=0.02)
    ax = plots.clearance_profile(BODIED.with_(scene=scene), POSE, GC, psi=PSI)
    lines = {line.get_label(): line for line in ax.lines}
    assert {"lamp", "clearance", "ψ"} <= set(lines)
    x, y = np.radians(lines["lamp"].get_xdata()), lines["lamp"].get_ydata()
    shown = np.isfinite(y)
    np.testing.assert_allclose(
        BODIED.clearance(BODIED.inverse(POSE, x[shown], GC, limits=False), scene).distance,
        y[shown],
        atol=1e-12,
    )
    (span,) = [patch for patch in ax.patches if patch.get_alpha() == 0.22]
    blocked = (~BODIED._clear(POSE, GC, scene)).intervals[0]
    width = np.radians(span.get_extents().transformed(ax.transData.inverted()).width)
    assert width == pytest.approx(blocked[1] - blocked[0], rel=1e-6)


def test_circle_says_why_there_is_none() -> None:
    """`plots.circle` of a pose out of reach states the reason."""
    far = POSE.copy()
    far[:3, 3] *= 3
    ax = plots.circle(IIWA, far, GC)
    assert aa.Status.UNREACHABLE.sentence in ax.get_title()
    assert "none" in ax.texts[0].get_text()


def test_joint_profiles_are_the_inverse() -> None:
    """`plots.joint_profiles` draws `inverse` over psi, with limits."""
    panels = plots.joint_profiles(IIWA, POSE, GC, psi=PSI)
    assert len(panels) == 6
    for panel, joint in zip(panels, (1, 2, 3, 5, 6, 7), strict=True):
        psi, q = panel.lines[0].get_data()
        known = np.isfinite(psi)
        wanted = IIWA.inverse(POSE, np.radians(psi[known]), GC, limits=False)[:, joint - 1]
        np.testing.assert_allclose(np.radians(q[known]), wanted, atol=1e-9)
        limits = [line.get_ydata()[0] for line in panel.lines if line.get_linestyle() == "--"]
        bounds = np.degrees([IIWA.lower[joint - 1], IIWA.upper[joint - 1]])
        np.testing.assert_allclose(limits, bounds)
        assert panel.get_ylabel() == f"q{joint} (deg)"
    assert {"limit", "stationary", "singular", "blocked by this joint", "ψ"} == _figure_labels(panels[0])


def test_repulsion_is_equation_36() -> None:
    """`plots.repulsion` draws the change of psi by Eq. (36)."""
    lower, upper, gain, alpha = -0.4, 1.1, 0.3, 7.0
    ax = plots.repulsion(aa.Repulsion(K=gain, alpha=alpha), arc=(lower, upper))
    psi, change = np.radians(ax.lines[0].get_data())
    share = (psi - lower) / (upper - lower)
    wanted = gain * (upper - lower) / 2 * (np.exp(-alpha * share) - np.exp(-alpha * (1 - share)))
    np.testing.assert_allclose(change, wanted, atol=1e-12)
    assert _labels(ax) == {"α = 7, K = 0.3", "ends of the arc"}


def test_repulsion_names_every_policy() -> None:
    """`plots.repulsion` labels every policy, and refuses Towards(direction) and bad arcs."""
    policies = [aa.Repulsion(rate=2.0), aa.Hold(), aa.Centre(K=0.2), aa.Centre(rate=3.0)]
    policies += [aa.Towards(psi=0.5, K=0.2), aa.Towards(psi=0.5, rate=1.0)]
    names = _labels(plots.repulsion(policies, dt=0.01))
    assert {"towards 28.65°, K = 0.2", "towards 28.65°, rate 1 1/s"} < names
    with pytest.raises(aa.InputError, match="whose wish is an arm angle only at a pose: wanted psi="):
        plots.repulsion(aa.Towards(direction="up"))
    assert {"α = 20, rate 2 1/s", "hold", "centre, K = 0.2", "centre, rate 3 1/s"} < names
    assert len(_labels(plots.repulsion())) == 5
    for arc in ((1.0, 1.0), (0.0, 7.0)):
        refused(aa.InputError, "less than a turn apart", plots.repulsion, arc=arc)


def test_path_draws_psi_and_joints_with_limits() -> None:
    """`plots.path` draws psi and joints of several paths, with limits."""
    motions = {f"α = {alpha:g}": _path(alpha) for alpha in (5.0, 20.0)}
    panels = plots.path(motions)
    assert len(panels) == 8
    for k, motion in enumerate(motions.values()):
        np.testing.assert_allclose(panels[0].lines[k].get_ydata(), np.degrees(motion.psi))
        for joint in range(7):
            np.testing.assert_allclose(panels[1 + joint].lines[k].get_ydata(), np.degrees(motion.q[:, joint]))
    assert {"α = 5", "α = 20", "limit"} == _figure_labels(panels[0])
    assert panels[7].get_xlabel() == "path parameter s"
    assert panels[0].figure.get_suptitle() == IIWA.name


def test_path_marks_where_it_fails() -> None:
    """`plots.path` marks the row at which a path fails."""
    poses = _poses(60)
    poses[30:, :3, 3] *= 3
    motion = aa.follow(IIWA, poses, start=PAPER_Q)
    panels = plots.path([motion])
    marks = [line for line in panels[0].lines if line.get_linestyle() == ":"]
    assert marks[0].get_xdata()[0] == pytest.approx(motion.s[motion.first_failure])
    assert "path 1 fails" in _figure_labels(panels[0])


def test_path_draws_a_trajectory_over_time() -> None:
    """`plots.path` draws trajectories over time, and refuses a mix with paths without times, or an array."""
    pytest.importorskip("scipy", reason="retime needs scipy: pip install 'armangle[time]'")
    moves = {
        f"{v} rad/s": aa.retime(_path(), velocity=np.full(7, v), acceleration=np.full(7, 9.0)) for v in (1, 3)
    }
    for alone in moves.values():
        panels = plots.path(alone)
        assert panels[7].get_xlabel() == "time (s)"
        assert panels[0].get_xlim() == (0.0, alone.duration)
        for k, panel in enumerate(panels):
            np.testing.assert_array_equal(panel.lines[0].get_xdata(), alone.t)
            drawn = np.radians(panel.lines[0].get_ydata())
            if k:
                np.testing.assert_allclose(drawn, alone.q[:, k - 1])
            else:
                psi = alone.path.at(alone.s).psi
                np.testing.assert_allclose(np.exp(1j * drawn), np.exp(1j * psi), atol=1e-9)
                assert np.abs(np.diff(drawn)).max() < np.pi
    assert set(moves) < _figure_labels(plots.path(moves)[0])
    with pytest.raises(aa.InputError, match="some paths have times and some have not"):
        plots.path([_path(), *moves.values()])
    with pytest.raises(aa.InputError, match="path 2 is a ndarray, wanted a JointPath or a Trajectory"):
        plots.path([_path(), np.zeros(7)])


def _inside(ax: object, s: float, psi_degrees: float) -> str | None:
    """Return the colour of the uppermost cell at a point, None where none is."""
    found = None
    for collection in ax.collections:
        if any(path.contains_point((s, psi_degrees)) for path in collection.get_paths()):
            found = matplotlib.colors.to_hex(collection.get_facecolor()[0]).upper()
    return found


@pytest.mark.parametrize("gc", [0, 3, 4])
def test_feasible_map_is_what_the_arcs_say(gc: int) -> None:
    """`plots.feasible_map` has the colour of the first joint that blocks, none where psi is feasible."""
    motion = _path(count=12)
    ax = plots.feasible_map(motion, gc=gc)
    rng = np.random.default_rng(gc)
    for row in rng.integers(0, 12, 60):
        psi = rng.uniform(-np.pi, np.pi)
        each = IIWA.feasible(motion.poses[row], gc, per_joint=True)
        blocking = [j for j in range(7) if psi not in each[j]]
        inward = 1e-6 * (0.5 - motion.s[row])
        wanted = plots.JOINT_COLOURS[blocking[0]].upper() if blocking else None
        assert _inside(ax, motion.s[row] + inward, np.degrees(psi)) == wanted
    assert ("chosen ψ(s)" in _labels(ax)) == (gc == 3)


def test_feasible_map_of_all_configurations() -> None:
    """`plots.feasible_map` of a path draws eight titled panels, and its psi in the panel of its gc."""
    panels = plots.feasible_map(_path(count=10))
    assert [panel.get_title() for panel in panels][:2] == ["GC 0 (+++)", "GC 1 (−++)"]
    assert len(panels) == 8
    assert {"feasible", "no solution", "joint 7 blocks", "chosen ψ(s)"} < _figure_labels(panels[0])
    psi = panels[3].lines[-2].get_ydata()
    np.testing.assert_allclose(psi, np.degrees(_path(count=10).psi))


def test_feasible_map_of_poses_alone_greys_what_is_out_of_reach() -> None:
    """`plots.feasible_map` of poses is grey where they are out of reach."""
    poses = _poses(5)
    poses[3:, :3, 3] *= 3
    ax = plots.feasible_map((IIWA, poses), gc=3)
    assert _inside(ax, 0.999, 100.0) == "#7F7F7F"
    assert _inside(ax, 0.001, 100.0) is None
    assert plots.feasible_map((IIWA, poses[:1]), gc=3).get_xlim() == (-0.5, 0.5)


def test_what_cannot_be_drawn_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plots refuse bad arguments, and name the extra if matplotlib is missing."""
    _, ax = plt.subplots()
    other = aa.follow(IIWA.with_(d_bs=0.5), _poses(2), start=PAPER_Q)
    for said, draw, *words in (
        (r"pose has shape \(2, 4, 4\)", plots.circle, IIWA, np.stack([POSE, POSE]), GC),
        (r"q has shape \(2, 7\)", plots.stick_figure, IIWA, np.zeros((2, 7))),
        ("poses has shape", plots.feasible_map, (IIWA, POSE)),
        ("paths is empty", plots.path, {}),
        ("paths are of different arms", plots.path, [_path(count=3), other]),
        ("path 2 is a ndarray, wanted a JointPath", plots.path, [_path(count=3), np.zeros(7)]),
    ):
        refused(aa.InputError, said, draw, *words)
    for said, draw, words, named in (
        ("gc is 8", plots.feasible_map, (_path(count=3),), {"gc": 8}),
        ("wanted a polar one", plots.circle, (IIWA, POSE, GC), {"ax": ax}),
        ("wanted a 3-D one", plots.arm_frames, (IIWA,), {"ax": ax}),
        ("ax holds 1 axes, wanted 2", plots.joint_profiles, (IIWA, POSE, GC), {"joints": [5, 6], "ax": ax}),
        ("joints is empty", plots.joint_profiles, (IIWA, POSE, GC), {"joints": []}),
    ):
        refused(aa.InputError, said, draw, *words, **named)
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    refused(aa.MissingExtraError, r"pip install 'armangle\[plot\]'", plots.repulsion)


def test_given_axes_are_drawn_on_and_returned() -> None:
    """Plots draw on given axes and return them."""
    figure = plt.figure()
    flat = figure.add_subplot(221)
    polar = figure.add_subplot(222, projection="polar")
    space = figure.add_subplot(223, projection="3d")
    assert plots.repulsion(ax=flat) is flat
    assert plots.circle(IIWA, POSE, GC, ax=polar) is polar
    assert plots.stick_figure(IIWA, PAPER_Q, ax=space) is space
    assert plots.feasible_map(_path(count=4), gc=1, ax=flat) is flat
    assert plots.joint_profiles(IIWA, POSE, GC, joints=[5], ax=flat)[0] is flat
    assert not figure.legends


def test_placement_draws_what_is_held_and_the_best_base() -> None:
    """`plots.placement` draws shares, best base, poses and arrows."""
    arm = aa.Arm.from_catalogue("openarm_v10")
    poses = aa.pose(np.random.default_rng(1).uniform(-0.4, 0.4, (20, 3)), rpy=[0.0, np.pi, 0.0])
    found = aa.place(arm, poses, np.linspace(-0.3, 0.3, 7), np.linspace(-0.2, 0.2, 5))
    ax = plots.placement(found)
    drawn = ax.collections[0].get_array()
    assert np.allclose(np.asarray(drawn).reshape(5, 7), found.reached.T)
    marks = {line.get_label(): line for line in ax.lines}
    assert np.allclose(marks["best base"].get_xydata(), found.best()[:2, 3])
    assert len(marks["poses"].get_xydata()) == 20
    arrows = ax.collections[1]
    assert np.allclose(np.hypot(arrows.U, arrows.V), 1.0)
    one = aa.place(arm, [], [0.0], [0.0])
    assert plots.placement(one, ax=plt.subplots()[1]).get_title()


def test_reach_draws_the_section_and_voxels_the_shares(tmp_path: Path) -> None:
    """`plots.reach` and `plots.voxels` draw `section` and `voxels` of a map."""
    need("zarr")
    arm = aa.Arm.from_catalogue("openarm_v10")
    found = aa.reach_map(arm, tmp_path / "a.zarr", spacing=0.1, tilt=0.4)
    ax = plots.reach(found, "yaw")
    drawn = np.asarray(ax.collections[0].get_array()).reshape(found.shape[1], found.shape[0])
    assert np.allclose(np.nan_to_num(drawn), found.section("yaw").T)
    refused(aa.InputError, "field is 'speed', wanted one of 'gc'", lambda: plots.reach(found, "speed"))
    assert "proven" not in ax.get_title()
    near = aa.reach_map(calibrated("kuka_iiwa7_r800", 1.0, 1.0), tmp_path / "b.zarr", spacing=0.4, tilt=1.5)
    assert f"{near.unproven} of {np.prod(near.shape)} cells not proven" in plots.reach(near).get_title()
    voxels = found.voxels(0.2)
    space = plots.voxels(voxels, arm)
    assert np.allclose(space.collections[0].get_array(), voxels.share)


@pytest.mark.parametrize(
    ("name", "start"),
    [
        ("franka_fr3", [0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5]),
        ("willow_garage_pr2_left", [0.4, 0.4, 0.9, -1.3, 0.3, -0.8, 0.5]),
    ],
)
def test_an_offset_arm_is_drawn_over_its_free_joint(name: str, start: list[float]) -> None:
    """Pictures of an offset arm are over its free joint; those of the elbow's circle are refused."""
    arm = aa.Arm.from_catalogue(name)
    pose, psi, gc = arm.forward(start)
    poses = np.repeat(pose[None], 5, axis=0)
    poses[:, 0, 3] += np.linspace(0.0, 0.02, 5)
    found = aa.follow(arm, poses, start=start)
    panels = plots.path(found)
    assert panels[0].get_ylabel() == f"ψ, {arm.redundancy} (deg)"
    np.testing.assert_allclose(panels[0].lines[0].get_ydata(), np.degrees(found.psi))
    np.testing.assert_allclose(panels[4].lines[0].get_ydata(), np.degrees(found.q[:, 3]))

    solved = ~np.isnan(arm.inverse(pose, LOOK, int(gc), limits=False, on_error="nan")[:, 0])
    each = [arm.feasible(pose, int(gc), per_joint=True)[j].contains(LOOK) for j in range(7)]
    ax = plots.feasible_map(found, gc=int(gc))
    for k, angle in enumerate(LOOK):
        blocking = [plots.JOINT_COLOURS[j].upper() for j in range(7) if not each[j][k]]
        wanted = (blocking[0] if blocking else None) if solved[k] else "#7F7F7F"
        assert _inside(ax, 1e-6, np.degrees(angle)) == wanted
    assert ax.get_ylabel() == f"ψ, {arm.redundancy.replace('_', ' ')} (deg)"

    ax = plots.circle(arm, pose, int(gc), psi=float(psi))
    none = float((~arm.with_(lower=-np.inf, upper=np.inf).feasible(pose, int(gc))).measure)
    for joint in range(7):
        blocked = float((~arm.feasible(pose, int(gc), per_joint=True)[joint]).measure) - none
        assert _wedges(ax, plots.JOINT_COLOURS[joint]) == pytest.approx(blocked, abs=1e-9)
    for panel, joint in zip(plots.joint_profiles(arm, pose, int(gc)), (1, 2, 3, 5, 6, 7), strict=True):
        angles, q = panel.lines[0].get_data()
        known = np.isfinite(angles) & np.isfinite(q)
        wanted_q = arm.inverse(pose, np.radians(angles[known]), int(gc), limits=False)[:, joint - 1]
        np.testing.assert_allclose(np.radians(q[known]), wanted_q, atol=1e-9)

    guarded = arm.with_(body="guessed", scene=aa.Scene([aa.Ball([0.9, 0.0, 0.9], 0.05, name="lamp")]))
    assert plots.clearance_profile(guarded, pose, int(gc)).get_legend().get_texts()[0].get_text() == "lamp"
    sticks = plots.stick_figure(arm, start).lines[0].get_data_3d()
    corners = {tuple(np.round(point, 9)) for point in np.transpose(sticks)}
    assert {tuple(np.round(point, 9)) for point in arm.frames(start)[[1, 3, 5, 6], :3, 3]} <= corners
    poses[:, :3, 3] *= 9.0
    refused(aa.UnreachableError, "pose: ", lambda: plots.clearance_profile(guarded, poses[0], int(gc)))
    for draw in (plots.arm_frames, plots.virtual_arm, plots.virtual_plane):
        refused(aa.UnsupportedError, r"plots\.path", lambda draw=draw: draw(arm, start))
