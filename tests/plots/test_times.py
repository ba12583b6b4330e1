"""Pictures over time: trajectories with their rates, and how a tracker follows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.moves import begun, line, refused
from support.needs import need

import armangle as aa
from armangle import plots

need("matplotlib").use("Agg")

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])


@pytest.fixture
def timed() -> aa.Trajectory:
    """A line of 19 cm in time."""
    need("scipy")
    return aa.retime(aa.plan(ARM, line(ARM, Q, [-0.1, -0.15, 0.05]), start=Q), acceleration=5.0)


def test_a_trajectory_is_drawn_with_its_rates_and_limits(timed: aa.Trajectory) -> None:
    """`plots.trajectory` draws q, qd and qdd of each joint over time, with given bounds."""
    panels = plots.trajectory(timed, acceleration=5.0)
    assert len(panels) == 21
    for joint in range(7):
        for rate, name in enumerate(("q", "qd", "qdd")):
            curve = panels[3 * joint + rate].lines[0]
            np.testing.assert_array_equal(curve.get_xdata(), timed.t)
            np.testing.assert_allclose(curve.get_ydata(), np.degrees(getattr(timed, name)[:, joint]))
    hard = np.abs(timed.qdd).max(axis=0).argmax()
    drawn = {round(float(line.get_ydata()[0]), 6) for line in panels[3 * hard + 2].lines[1:]}
    assert drawn == {round(side * np.degrees(5.0), 6) for side in (-1, 1)}
    low, high = panels[3 * hard + 2].get_ylim()
    assert low < -np.degrees(5.0) < np.degrees(5.0) < high
    assert panels[-1].get_xlabel() == "time (s)"
    bare = plots.trajectory(timed)  # the arm states no acceleration: no line
    assert all(len(panel.lines) == 1 for panel in bare[2::3])


def test_what_files_hold_is_drawn_as_what_was_saved(timed: aa.Trajectory, tmp_path: Path) -> None:
    """`plots.path` and `plots.trajectory` draw tables of files, given the arm, like what was saved."""
    aa.io.save(timed, tmp_path / "motion.npz")
    aa.io.save(timed.path, tmp_path / "joints.npz")
    saved = aa.io.load_trajectory(tmp_path / "motion.npz")
    pairs = [
        (plots.path(timed), plots.path(saved, arm=ARM)),
        (plots.path(timed.path), plots.path(aa.io.load_joints(tmp_path / "joints.npz"), arm=ARM)),
        (plots.trajectory(timed), plots.trajectory(saved, arm=ARM)),
    ]
    for panels, again in pairs:
        for panel, other in zip(panels, again, strict=True):
            assert panel.get_xlabel() == other.get_xlabel()
            np.testing.assert_allclose(panel.lines[0].get_xydata(), other.lines[0].get_xydata(), atol=1e-9)
    for draw in (plots.path, plots.trajectory):
        with pytest.raises(aa.InputError, match="is a TrajectoryTable, which does not say its arm: wanted"):
            draw(saved)
        with pytest.raises(aa.InputError, match="arm is str, wanted an Arm"):
            draw(saved, arm="kuka_iiwa7_r800")  # type: ignore[operator]  # wrong on purpose


def test_what_is_no_trajectory_is_refused(timed: aa.Trajectory) -> None:
    """`plots.trajectory` refuses a path without times, bad bounds and too few axes."""
    with pytest.raises(aa.InputError, match="trajectory is a JointPath, wanted a Trajectory"):
        plots.trajectory(timed.path)  # type: ignore[arg-type]  # wrong on purpose
    refused(aa.InputError, "velocity holds -1", lambda: plots.trajectory(timed, velocity=-1.0))
    refused(aa.InputError, "wanted 21", lambda: plots.trajectory(timed, ax=plots.trajectory(timed)[:3]))


def ticks(far: float) -> list[aa.types.Tracked]:
    """What a tracker returns for a hand that moves `far` (m) sideways and back, in 300 steps of 0.01 s."""
    tracker = begun(Q, ARM, dt=0.01)
    first = ARM.forward(Q)[0]
    out = []
    for share in np.sin(np.linspace(0, np.pi, 300)) ** 2:
        hand = first.copy()
        hand[:2, 3] += far * share * np.array([0.8, 0.3])
        out.append(tracker.step(hand))
    return out


def test_tracking_shows_distance_speeds_and_what_became_of_each_tick() -> None:
    """`plots.tracking` draws distance, gap, speeds and the status of each tick."""
    run = ticks(0.8)
    panels = plots.tracking(run, 0.01, velocity=ARM.velocity)
    away = 1e3 * np.array([tick.distance for tick in run])
    np.testing.assert_allclose(panels[0].lines[0].get_ydata(), away)
    np.testing.assert_allclose(panels[0].lines[1].get_ydata(), 1e3 * np.array([tick.gap for tick in run]))
    shares = np.stack([tick.velocity for tick in run]) / ARM.velocity * 100
    curves = [line for line in panels[1].lines if len(line.get_xdata()) == len(run)]
    np.testing.assert_allclose([curve.get_ydata() for curve in curves], shares.T)
    assert np.abs(shares).max() <= 100 * (1 + 1e-9)
    spans = [patch for patch in panels[0].patches if patch.get_label() in aa.Tracking.__members__]
    assert sum(patch.get_width() for patch in spans) == pytest.approx(3.0)
    time = {
        name: sum(p.get_width() for p in spans if p.get_label() == name) for name in aa.Tracking.__members__
    }
    for name in aa.Tracking.__members__:
        assert time[name] == pytest.approx(0.01 * sum(tick.status.name == name for tick in run))
    assert time["NEAREST"] > 0.5


def test_a_hand_within_reach_is_not_drawn_beyond_it() -> None:
    """`plots.tracking` of a hand within reach draws no gap; without limits, speeds in deg/s."""
    panels = plots.tracking(ticks(0.01), 0.01)
    assert [line.get_label() for line in panels[0].lines] == ["distance from the hand"]
    assert panels[1].get_ylabel() == "speed (deg/s)"


@pytest.mark.parametrize("bad", [[], [3], None, "ticks"])
def test_no_ticks_are_refused(bad: object) -> None:
    """`plots.tracking` refuses what is no list of results of a tracker, and dt = 0."""
    with pytest.raises(aa.InputError, match="ticks is empty or holds something else"):
        plots.tracking(bad, 0.01)  # type: ignore[arg-type]  # wrong on purpose
    refused(aa.InputError, "dt", lambda: plots.tracking(ticks(0.0)[:1], 0.0))
