"""Public values compare by content with a bool, copy and pickle; a hash is of the content."""

from __future__ import annotations

import copy
import inspect
import pickle
from contextlib import suppress
from enum import Enum
from typing import Any

import numpy as np

import armangle as aa
from armangle import kuka

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.05, forearm=0.05))
FRANKA = aa.Arm.from_catalogue("franka_fr3")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
FRANKA_Q = np.array([0.1, -0.6, 0.2, -2.2, 0.1, 1.9, 0.7])
POSE, PSI, GC = ARM.forward(Q)
SCENE = aa.Scene([aa.Ball([0.6, 0.6, 0.3], 0.1, name="ball")], clearance=0.01)


def made(k: int) -> dict[str, Any]:
    """One of every public value but those in ELSEWHERE, by name, with other content for k = 0 and k = 1."""
    q = Q + 0.01 * k
    pose, psi, gc = ARM.forward(q)
    end = pose.copy()
    end[2, 3] -= 0.01
    via = pose[:3, 3] + [0.01, 0.01, 0.0]
    path = aa.follow(ARM, aa.Line(pose, end), start=q, samples=6)
    table = aa.io.JointTable(path.s, path.q, path.psi, path.gc, path.status, path.margin)
    tracker = aa.Tracker(ARM, dt=0.01)
    tracker.start(q)
    grid = np.stack([pose, end])
    arcs = ARM.feasible(pose, gc)
    seen = pose.copy()
    seen[0, 3] += 9.0 * k
    return {
        "ArcEnd": aa.types.ArcEnd(4, "lower", 0.1 + k),
        "ArcSet": arcs,
        "Arm": ARM.with_(name=str(k)),
        "Ball": aa.Ball([1, 2, k], 0.1),
        "Body": aa.Body.bones(upper_arm=0.05 + 0.01 * k, forearm=0.05),
        "Box": aa.Box(pose, [1, 2, 3]),
        "Branch": ARM.explain(seen).branches[0],
        "Capsule": aa.Capsule([0, 0, 0], [0, 1, k], 0.1),
        "Centre": aa.Centre(K=0.1 + 0.1 * k),
        "ChainDeviation": ARM.with_(name=str(k)).deviation,
        "CircularArc": aa.CircularArc(pose, via, end),
        "Clearance": ARM.clearance(np.stack([q, Q]), SCENE),
        "Cloud": aa.Cloud([[1, 2, k]], 0.1),
        "Deviation": aa.types.Deviation(0.1, k),
        "Diagnosis": ARM.explain(seen),
        "Field": aa.Field(np.full((2, 2, 2), k), [0, 0, 0], 0.1),
        "Freedom": ARM.freedom(np.stack([pose, POSE])),
        "Geometry": ARM.with_(d_bs=0.3 + k).geometry,
        "HalfSpace": aa.HalfSpace([0, 0, 1], k),
        "HandFilter": aa.HandFilter(omega=10.0 + k),
        "Hold": aa.Hold("stop" if k else "nearest"),
        "Hull": aa.Hull([[1, 2, k]], 0.1),
        "JointFunction": aa.gradients.joint_function(ARM, pose, gc, 4),
        "JointPath": path,
        "JointTable": table,
        "KukaFrame": kuka.to_frame(ARM, q),
        "Line": aa.Line(pose, end),
        "Objective": aa.Objective(duration=1.0 + k),
        "Arm with an offset": FRANKA.with_(name=str(k)),
        "Solution of an arm with an offset": FRANKA.solve(
            FRANKA.forward(FRANKA_Q + 0.01 * k)[0], seed=FRANKA_Q
        ),
        "Opening": aa.types.Opening(1, "lower", 0.1 + k),
        "PathPoint": path.at([0.2, 0.4]),
        "Placement": aa.place(ARM, grid, x=[0.0, 0.1], y=[0.0, 0.1]),
        "Repulsion": aa.Repulsion(0.1 + 0.1 * k),
        "Resolution": aa.resolve(ARM, grid, psi, gc),
        "Scene": aa.Scene([aa.Ball([1, 2, k], 0.1)]),
        "Screw": aa.Screw(pose, [0, 0, 0], [0, 0, 1], 0.1),
        "Segments": aa.Segments([aa.Line(pose, end)]),
        "Solution": ARM.solve(grid, seed=q),
        "Solutions": ARM.solutions(pose, seed=q),
        "SpeedLoss": aa.types.SpeedLoss(0.1 * k, 1, "velocity", 2.0),
        "Step": aa.step(ARM, q, end),
        "Towards": aa.Towards(psi=0.1 + 0.1 * k),
        "Tracked": tracker.step(end),
        "Trajectory": aa.retime(path, acceleration=3.0),
        "TrajectoryPoint": aa.retime(path, acceleration=3.0).at([0.0, 0.01]),
        "TrajectoryTable": aa.io.TrajectoryTable(path.s, path.s, path.q, path.q, path.q),
        "Voxels": aa.types.Voxels(pose[None, :3, 3], np.array([0.5]), 0.1, 8),
        "Waypoints": aa.Waypoints(grid),
        "Widest": ARM._widest(pose, gc, SCENE),
    }


ELSEWHERE = {"Path", "Tracker", "ImportReport", "ReachMap"}
"""Bases, what has a state, and what files alone make."""


def test_a_value_is_its_content() -> None:
    """Public values compare, copy, pickle and hash by content, and every public class is covered."""
    values = made(0), made(0), made(1)
    for name, one in values[0].items():
        same, other = values[1][name], values[2][name]
        twins = [same, copy.copy(one), copy.deepcopy(one), pickle.loads(pickle.dumps(one))]
        for twin in twins:
            assert (one == twin) is True and (one != twin) is False, name
        assert (one == other) is False and (one != other) is True, name
        for stranger in (None, 3, "x", (), [1.0]):
            assert (one == stranger) is False, name
        with suppress(TypeError):  # what cannot be hashed
            assert len({hash(each) for each in (one, *twins)}) == 1, name
    public = {
        name
        for module in (aa, aa.io, aa.types)
        for name in module.__all__
        if inspect.isclass(kind := getattr(module, name)) and not issubclass(kind, (Exception, Enum))
    }
    assert public - set(values[0]) == ELSEWHERE


def test_numbers_that_are_missing_on_both_sides_are_the_same() -> None:
    """Results that hold NaN compare equal to the same results."""
    far = POSE.copy()
    far[0, 3] += 9.0
    none = ARM.solve(far)
    assert np.isnan(none.q).all() and (none == ARM.solve(far)) is True
    assert (none == pickle.loads(pickle.dumps(none))) is True and (none == ARM.solve(POSE)) is False


def test_a_result_is_that_of_its_path_whether_it_was_asked_between_its_rows_or_not() -> None:
    """A path compares equal whether `at` was called or not, and differs by `between`."""
    asked, fresh = (aa.follow(ARM, np.stack([POSE, POSE]), start=Q) for _ in range(2))
    asked.at(0.5)
    assert asked == fresh and pickle.loads(pickle.dumps(asked)) == fresh
    rows = np.stack([Q, Q + 0.1])
    lines, tool = (aa.JointPath.from_joints(ARM, rows, between=how) for how in ("joints", "tool"))
    assert lines != tool and lines == aa.JointPath.from_joints(ARM, rows, between="joints")


def test_every_result_says_whether_it_worked() -> None:
    """`ok` of every result is True for a pose in reach, False out of it, in batches too."""
    arm = aa.Arm.load("kuka_iiwa7_r800")
    q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    pose, psi, gc = arm.forward(q)
    far = pose.copy()
    far[0, 3] += 3.0
    for here, wanted in ((pose, True), (far, False)):
        results = [
            arm.solve(here, seed=q), arm.solutions(here, seed=q), arm.feasible(here, gc), arm.freedom(here),
            arm.explain(here), aa.resolve(arm, here, psi, gc), aa.step(arm, q, here),
            aa.follow(arm, here[None], start=q),
            aa.Tracker(arm, dt=0.01).start(q).step(here),
        ]  # fmt: skip
        assert [bool(result.ok) for result in results] == [wanted] * len(results)
    both = np.stack([pose, far])
    batches = [arm.solve(both), arm.solutions(both), arm.feasible(both, gc), arm.freedom(both)]
    assert all(result.ok.tolist() == [True, False] for result in batches)
