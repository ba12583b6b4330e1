"""Whatever gives a motion, all that takes one takes it: timed, saved, drawn, joined, copied, continued."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import draw
from support.calibrated import calibrated
from support.moves import begun, moved
from support.needs import need
from support.strategies import Array

import armangle as aa

need("scipy")
need("highspy")
need("matplotlib").use("Agg")
plt = need("matplotlib.pyplot")

ARMS: dict[str, aa.Arm] = {
    "exact": aa.Arm.from_catalogue("kuka_iiwa7_r800"),
    "calibrated": calibrated("kuka_iiwa7_r800", 1.0, 1.0),
    "offset wrist": aa.Arm.from_catalogue("franka_fr3"),
    "offset shoulder": aa.Arm.from_catalogue("willow_garage_pr2_left"),
}
READY = {
    "exact": [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5],
    "calibrated": [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5],
    "offset wrist": [0.1, -0.6, 0.2, -2.2, 0.1, 1.9, 0.7],
    "offset shoulder": [0.4, 0.5, 0.6, -1.3, 0.4, -0.8, 0.3],
}
SHIFT = np.array([0.01, 0.02, -0.03])
SWING = np.array([0.02, 0.15, -0.03, 0.05, 0.02, 0.04, -0.02])
ROWS = 15
Motions = dict[str, Callable[[Path], aa.JointPath]]


def through(arm: aa.Arm, q: Array, joint: int, angle: float = 0.0) -> Array | None:
    """Rows that pass `angle` of a joint's theta; None if limits forbid it."""
    middle = q.copy()
    middle[joint - 1] = arm.geometry.signs[joint - 1] * (angle - arm.geometry.offsets[joint - 1])
    way = 0.3 * SWING
    way[joint - 1] = 0.1
    found = middle + np.linspace(-0.97, 1.0, ROWS)[:, None] * way
    return found if arm.within_limits(found).all() else None


def motions(arm: aa.Arm, start: list[float]) -> Motions:
    """Functions of a folder by name that make motions of every kind of an arm from joints `start`."""
    q = np.array(start)
    a = arm.forward(q)[0]
    b = moved(a, SHIFT)
    rows = q + np.linspace(0.0, 1.0, ROWS)[:, None] * SWING
    hold: Any = {"start": q, "policy": aa.Hold()}
    given: dict[str, Array] = {
        "smooth rows": q + np.sin(np.linspace(0.0, 2.0, ROWS))[:, None] * SWING,
        "rows with a corner": np.concatenate([rows, rows[-2::-1]]),
        "one row": q[None],
        "two equal rows": np.stack([q, q]),
        "fifty equal rows": np.repeat(q[None], 50, axis=0),
    }
    for joint, angle in ((2, 0.0), (6, 0.0), (5, 0.5 * np.pi)):
        passing = through(arm, q, joint, angle)
        if passing is not None:
            given[f"through theta_{joint} = {angle:.3g}"] = passing

    def again(path: aa.JointPath, folder: Path) -> aa.JointPath:
        """The path after saving and loading it."""
        aa.io.save(path, folder / "again.csv")
        table = aa.io.load_joints(folder / "again.csv")
        return aa.JointPath.from_joints(arm, table.q, s=table.s, status=table.status)

    out: Motions = {
        "follow a line": lambda _: aa.follow(arm, aa.Line(a, b), samples=ROWS, **hold),
        "follow a line of no length": lambda _: aa.follow(arm, aa.Line(a, a), samples=5, **hold),
        "follow one pose": lambda _: aa.follow(arm, a[None], **hold),
        "join there and back": lambda _: aa.join(
            [
                aa.follow(arm, aa.Line(a, b), samples=ROWS, **hold),
                aa.follow(arm, aa.Line(b, b), start=aa.follow(arm, aa.Line(a, b), samples=ROWS, **hold).q[-1],
                          policy=aa.Hold(), samples=3),
            ]
        ),
        "finer": lambda _: aa.JointPath.from_joints(arm, rows, between="tool").finer(0.005),
        "read again": lambda folder: again(aa.follow(arm, aa.Line(a, b), samples=ROWS, **hold), folder),
    }  # fmt: skip
    if not arm.kind.startswith("offset"):
        out["plan a line"] = lambda _: aa.plan(arm, aa.Line(a, b), start=q)
        out["plan to where it is"] = lambda _: aa.plan(arm, aa.Line(a, a), start=q)
    for name, each in given.items():
        for between in ("tool", "joints", "spline", None):
            key = f"{name}, {between}"
            out[key] = lambda _, e=each, how=between: aa.JointPath.from_joints(arm, e, between=how)  # type: ignore[misc]  # defaults bind the loop's values
        if "through" in name:
            out[f"follow {name}"] = lambda _, e=each: aa.follow(  # type: ignore[misc]  # defaults bind the loop's values
                arm, arm.forward(e)[0], start=e[0], policy=aa.Hold()
            )
    return out


def takers(path: aa.JointPath, folder: Path, turn: int) -> Iterator[str]:
    """Check every function that takes a motion; yield the name of each before its turn.

    Of file formats and pictures one takes its turn, as the number `turn` says; `make thorough` takes all.
    """

    def turns(*all_of_them: Any) -> Any:
        """All of these, or the one whose turn it is."""
        return all_of_them if draw.COUNT else all_of_them[turn % len(all_of_them) :][:1]

    arm, still = path.arm, np.ptp(path.q, axis=0).max() <= 1e-9
    yield "at"
    s = np.linspace(0.0, 1.0, 41)
    here = path.at(s)
    assert np.isfinite(here.q).all()
    np.testing.assert_allclose(here.q[[0, -1]], path.q[[0, -1]], rtol=0, atol=1e-6)
    tool = arm.forward(here.q, on_error="nan")[0]
    if path.between == "tool":
        np.testing.assert_allclose(tool, here.pose, rtol=0, atol=1e-9)
    yield "derivatives"
    assert np.isfinite(path.derivatives(s[1:-1])).all()
    yield "finer"
    assert np.abs(np.diff(path.finer(0.05).q, axis=0)).max(initial=0.0) <= 0.05 + 1e-6
    yield "retime"
    for jerk in (None, 100.0):
        motion = aa.retime(path, acceleration=5.0, jerk=jerk)
        assert (motion.duration == 0) == still and not np.abs(motion.qd[[0, -1]]).max() > 1e-9
        np.testing.assert_allclose(motion.at(motion.t).q, motion.q, rtol=0, atol=1e-9)
        np.testing.assert_allclose(motion.q[[0, -1]], path.q[[0, -1]], rtol=0, atol=1e-6)
        assert motion.explain()
    yield "save and load a trajectory"
    for ending in turns("csv", "npz", "json", "yaml"):
        aa.io.save(motion, folder / f"motion.{ending}")
        np.testing.assert_allclose(aa.io.load_trajectory(folder / f"motion.{ending}").q, motion.q, atol=1e-12)
    yield "save and load rows"
    for ending in turns("csv", "npz", "json"):
        aa.io.save(path, folder / f"rows.{ending}")
        np.testing.assert_allclose(aa.io.load_joints(folder / f"rows.{ending}").q, path.q, atol=1e-12)
    yield "draw"
    for picture, of in turns((aa.plots.path, path), (aa.plots.path, motion), (aa.plots.trajectory, motion)):
        picture(of)
    plt.close("all")
    yield "copy"
    for value in (path, motion):
        for other in (copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
            assert (other == value) is True and (other != value) is False
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(path)).at(s).q, here.q)
    yield "explain"
    assert path.explain()
    yield "join"
    there = aa.JointPath.from_joints(arm, path.q[-1:] + np.array([[0.0], [0.01]]), between="joints")
    both = aa.join([path, there])
    np.testing.assert_allclose(both.at([0.0, 1.0]).q, [path.q[0], there.q[-1]], rtol=0, atol=1e-6)
    yield "continue"
    pose = path.poses[-1].copy()
    pose[0, 3] -= 1e-3
    assert aa.follow(arm, pose[None], start=path.q[-1]).ok
    tracker = begun(path.q[-1], arm, dt=0.01)
    assert np.isfinite(tracker.step(pose).q).all()


MOTIONS = {kind: motions(ARMS[kind], READY[kind]) for kind in ARMS}
ALL = [(kind, name) for kind in ARMS for name in MOTIONS[kind]]


@pytest.mark.turns(34)
@pytest.mark.parametrize(("turn", "kind", "name"), [(turn, *one) for turn, one in enumerate(ALL)])
def test_what_gives_a_motion_gives_it_to_all_that_take_one(
    turn: int, kind: str, name: str, tmp_path: Path
) -> None:
    """Every kind of motion passes all functions that take a motion."""
    path = MOTIONS[kind][name](tmp_path)
    assert path.ok, path.explain()
    step = "made"
    try:
        for taker in takers(path, tmp_path, turn):
            step = taker
    except aa.ArmangleError as error:
        pytest.fail(f"{step}: {error}")
