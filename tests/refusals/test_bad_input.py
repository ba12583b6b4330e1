"""Every argument of every public function, given nonsense: an `ArmangleError` that names the argument.

The matrix comes from the signatures: a function or an argument without a row here fails the first test.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support.refused import not_refused

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
POSE, PSI, GC = ARM.forward(Q)
TWO = ARM.forward(np.stack([Q, Q + 0.01]))[0]
FR3 = aa.Arm.from_catalogue("franka_fr3")
NAN, INF = float("nan"), float("inf")


def changed(array: np.ndarray[Any, Any], value: float) -> np.ndarray[Any, Any]:
    """Return a copy whose first entry is `value`."""
    out = np.array(array, dtype=float)
    out.flat[0] = value
    return out


WORDS: list[Any] = ["nonsense", None, object(), {"a": 1}]
GIVEN = [word for word in WORDS if word is not None]
HUGE = [1e7, -1e300]
ANGLES: list[Any] = [*WORDS, NAN, INF, *HUGE, 1j, [0.1, "x"], [[0.1], [0.1, 0.2]]]
JOINTS: list[Any] = [*WORDS, 0.1, Q[:6], changed(Q, NAN), changed(Q, -INF), changed(Q, 1e9), [1j] * 7]
ROTATION = POSE[:3, :3]
FAR = POSE.copy()
FAR[1, 3] = 1e300  # finite, but its square is not
POSES: list[Any] = [
    *WORDS, 0.1, POSE[:3], ROTATION, changed(POSE, NAN), changed(POSE, INF), changed(POSE, 2.0),
    np.diag([-1.0, 1, 1, 1]), np.zeros((4, 4)), np.ones((4, 4)), POSE.astype(complex), FAR,
]  # fmt: skip
INDEX: list[Any] = ["nonsense", object(), 8, -1, 2.0, NAN, 10**30, True]
NUMBER: list[Any] = ["nonsense", object(), NAN, 10**400, 1j]
POSITIVE: list[Any] = [*NUMBER, 0.0, -1.0]
CHOICE: list[Any] = ["nonsense", 3, object()]
THREADS: list[Any] = [-1, 1.5, "x", None]
MARGIN: list[Any] = [*NUMBER, -0.1, 2.0, INF]
SEVEN: list[Any] = ["nonsense", object(), 0.1, Q[:6], changed(Q, NAN), Q + 1j]
SEVEN_OR_ONE: list[Any] = [NAN, *(v for v in SEVEN if not isinstance(v, float))]
BOUND: list[Any] = [-0.1, 0.0, *SEVEN_OR_ONE]
POLICY: list[Any] = ["nonsense", 0.5, object(), aa.Repulsion]
ALLOWED: list[Any] = ["nonsense", 0.5, lambda pose: 1]


def started(tracker: aa.Tracker) -> aa.Tracker:
    """Return a tracker at rest at Q."""
    tracker.start(Q)
    return tracker


def in_threads(n: Any) -> None:
    """Enter a block with so many threads."""
    with aa.threads(n):
        pass


METHODS = ("forward", "inverse", "jacobian", "self_motion", "limit_margin", "within_limits", "explain",
           "solve", "solutions", "elbow", "frames", "reachable", "freedom", "feasible",
           "feasible_turns", "with_tool")  # fmt: skip
OF_OFFSET = ("forward", "inverse", "jacobian", "frames", "elbow", "limit_margin", "within_limits", "feasible",
             "solve", "reachable", "freedom", "with_tool")  # fmt: skip
GRADIENTS = ("inverse", "psi", "feasible", "limit_margin", "freedom", "margin", "joint_function")
BALL = aa.Ball([0.4, 0.0, 0.5], 0.1, name="lamp")
SCENE, BODY = aa.Scene([BALL]), aa.Body.bones(upper_arm=0.09, forearm=0.08)
FUNCTIONS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Arm": (aa.Arm, {"d_bs": 0.34, "d_se": 0.4, "d_ew": 0.4, "d_wf": 0.126}),
    "ArcSet": (aa.ArcSet, {"intervals": [[0.0, 1.0]]}),
    "Repulsion": (aa.Repulsion, {}),
    "Hold": (aa.Hold, {}),
    "Centre": (aa.Centre, {}),
    "Towards": (aa.Towards, {}),
    "gc_index": (aa.gc_index, {"signs": [1, 1, 1]}),
    "gc_signs": (aa.gc_signs, {"gc": 3}),
    "nearest_rotation": (aa.nearest_rotation, {"pose": POSE}),
    "dh_chain": (aa.dh_chain, {"rows": np.zeros((7, 4))}),
    "pose": (aa.pose, {"xyz": [0.1, 0.2, 0.3]}),
    "resolve": (aa.resolve, {"arm": ARM, "pose": POSE, "psi": PSI, "gc": GC}),
    "retime": (aa.retime, {"path": aa.follow(ARM, TWO, start=Q), "acceleration": np.ones(7)}),
    "step": (aa.step, {"arm": ARM, "q_now": Q, "pose": POSE}),
    "Tracker": (aa.Tracker, {"arm": ARM}),
    "Tracker.start": (aa.Tracker(ARM).start, {"q": Q}),
    "Tracker.step": (started(aa.Tracker(ARM)).step, {"pose": POSE}),
    "Tracker.run": (started(aa.Tracker(ARM)).run, {"poses": POSE[None]}),
    "HandFilter": (aa.HandFilter, {}),
    "HandFilter.smooth": (aa.HandFilter().smooth, {"poses": POSE[None], "dt": 0.01}),
    "follow": (aa.follow, {"arm": ARM, "poses": POSE[None], "start": Q}),
    "plan": (aa.plan, {"arm": ARM, "path": POSE[None]}),
    "place": (aa.place, {"arm": ARM, "poses": TWO, "x": [0.0], "y": [0.0]}),
    "reach_map": (aa.reach_map, {"arm": ARM, "path": "never.zarr"}),
    "ReachMap": (aa.ReachMap, {"path": "never.zarr"}),
    "Objective": (aa.Objective, {}),
    "Line": (aa.Line, {"start": POSE, "end": POSE}),
    "CircularArc": (aa.CircularArc, {"start": POSE, "via": [1.0, 2.0, 3.0], "end": POSE}),
    "Screw": (aa.Screw, {"start": POSE, "point": [0.0] * 3, "direction": [0.0, 0.0, 1.0], "angle": 1.0}),
    "Waypoints": (aa.Waypoints, {"poses": POSE[None]}),
    "Segments": (aa.Segments, {"paths": [aa.Line(POSE, TWO[1])]}),
    "join": (aa.join, {"paths": [aa.follow(ARM, TWO, start=Q)]}),
    "Path.pose": (aa.Line(POSE, POSE).pose, {"s": 0.5}),
    "Path.derivative": (aa.Line(POSE, POSE).derivative, {"s": 0.5}),
    "Solution.row": (ARM.solve(TWO).row, {"index": 0}),
    "JointPath.at": (aa.plan(ARM, POSE[None]).at, {"s": 0.5}),
    "JointPath.derivatives": (aa.plan(ARM, POSE[None]).derivatives, {"s": 0.5}),
    "JointPath.finer": (aa.plan(ARM, POSE[None]).finer, {}),
    "ArcSet.contains": (aa.ArcSet([[0.0, 1.0]]).contains, {"psi": 0.1}),
    "ArcSet.nearest": (aa.ArcSet([[0.0, 1.0]]).nearest, {"psi": 0.1}),
    "JointFunction.value": (aa.gradients.joint_function(ARM, POSE, GC, 1).value, {"psi": 0.1}),
    "JointFunction.derivative": (aa.gradients.joint_function(ARM, POSE, GC, 1).derivative, {"psi": 0.1}),
    **{f"Arm.{name}": (getattr(ARM, name), {}) for name in METHODS},
    **{f"gradients.{name}": (getattr(aa.gradients, name), {}) for name in GRADIENTS},
    "set_threads": (aa.set_threads, {"n": 1}),
    "threads": (in_threads, {"n": 1}),
    "Ball": (aa.Ball, {"center": [0.0, 0.0, 1.0], "radius": 0.1}),
    "Capsule": (aa.Capsule, {"begin": [0.0] * 3, "end": [0.0, 0.0, 1.0], "radius": 0.1}),
    "Box": (aa.Box, {"pose": POSE, "size": [0.1, 0.2, 0.3]}),
    "HalfSpace": (aa.HalfSpace, {"normal": [0.0, 0.0, 1.0], "offset": 0.1}),
    "Cloud": (aa.Cloud, {"points": [[0.0, 0.0, 1.0]], "radius": 0.1}),
    "Hull": (aa.Hull, {"points": [[0.0, 0.0, 1.0]], "radius": 0.1}),
    "Field": (aa.Field, {"distance": [[[0.1, 0.1]] * 2] * 2, "origin": [0.0, 0.0, 1.0], "spacing": 0.1}),
    "Scene": (aa.Scene, {}),
    "Body": (aa.Body, {"links": {3: [BALL]}}),
    "Body.bones": (aa.Body.bones, {"upper_arm": 0.1, "forearm": 0.1}),
    "offset arm": (aa.Arm, {"a_6": 0.088, "d_bs": 0.34, "d_se": 0.4, "d_ew": 0.4, "d_wf": 0.126}),
    **{f"offset arm, {name}": (getattr(FR3, name), {}) for name in OF_OFFSET},
    "offset arm, inverse": (FR3.inverse, {"pose": POSE, "psi": 0.1, "gc": 0, "on_error": "nan"}),
    "Arm.clearance": (ARM.with_(body=BODY).clearance, {"q": Q, "scene": SCENE}),
    "Arm.psi_towards": (ARM.psi_towards, {"pose": POSE, "gc": GC, "point": [0.0, 0.0, 1.0]}),
    "Arm.psi_towards along": (ARM.psi_towards, {"pose": POSE, "gc": GC, "direction": "up"}),
}
POINTS: list[Any] = [*WORDS, 0.1, [1.0, 2.0], [NAN, 0.0, 0.0], [0.0, INF, 0.0], [[0.0, 0.0, 1.0]], [1j] * 3]
VECTORS: list[Any] = [v for v in POINTS if v is not None and v != [[0.0, 0.0, 1.0]]]
PLACES: list[Any] = [*VECTORS, [0.0, 0.0, 1e4]]
ALONG: list[Any] = [*VECTORS, "north", [0.0, 0.0, 0.0]]
WEIGHT: list[Any] = [*NUMBER, None, -1.0, INF]
VECTOR: list[Any] = ["nonsense", object(), None, [NAN, 0.0], [1j], [1e4], [[0.0]], []]
GOOD = {"arm": ARM, "q": Q, "pose": POSE, "psi": PSI, "gc": GC, "joint": 1, "seed": Q, "about": "base",
        "tool": np.eye(4)}  # fmt: skip
BAD: dict[str, list[Any]] = {
    "q": JOINTS, "q_now": JOINTS, "start": JOINTS, "seed": [v for v in JOINTS if v is not None],
    "pose": POSES, "poses": [*POSES, POSE], "psi": ANGLES, "gc": INDEX, "joint": [*INDEX, 0, None],
    "n": THREADS, "limits": [*CHOICE, None], "per_joint": [*CHOICE, None], "on_error": CHOICE,
    "carry": CHOICE, "about": [*CHOICE, None], "fallback": CHOICE,
    "on_fail": CHOICE, "outside": CHOICE, "singularity_margin": MARGIN, "policy": POLICY,
    "allowed": ALLOWED, "max_joint_step": POSITIVE,
    "tol": NUMBER, "out": [Q[:6].copy(), Q.astype(np.float32), "x", Q.tolist(), np.zeros((7, 2))[:, 0]],
    "d_bs": [*NUMBER, None, INF, 1e4], "d_wf": [*NUMBER, None, INF, 1e4], "a_3": [*NUMBER, INF],
    "a_4": [*NUMBER, INF], "d_4": [*NUMBER, INF],
    "d_se": [*POSITIVE, None, INF, 1e4], "d_ew": [*POSITIVE, None, INF, 1e4],
    "lower": [*SEVEN_OR_ONE, changed(Q, INF), changed(Q, 1e9)],
    "upper": [*SEVEN_OR_ONE, changed(Q, -INF), changed(Q, 1e9)],
    "signs": [*SEVEN, Q, np.zeros(7)], "offsets": [*SEVEN, changed(Q, INF), changed(Q, 1e9)],
    "base": [v for v in POSES if v is not None], "tool": [v for v in POSES if v is not None],
    "velocity": [*BOUND, -Q, np.zeros(7)], "acceleration": [*BOUND, -Q, np.zeros(7)],
    "chain": ["nonsense", object(), 0.1, POSE, [POSE] * 7, [POSE] * 8, changed(np.stack([POSE] * 8), NAN)],
    "rows": [*WORDS, 0.1, np.zeros((6, 4)), np.zeros((2, 7, 4)), changed(np.zeros((7, 4)), NAN)],
    "modified": ["nonsense", None, 1],
    "reference": ["nonsense", object(), 0.1, [1.0, 2.0], [NAN, 0.0, 1.0], [0.0, 0.0, 0.0], [1j] * 3],
    "center": POINTS, "begin": POINTS, "size": [*POINTS, [0.1, -0.1, 0.1]],
    "normal": [*POINTS, [0.0] * 3],
    "points": [None, "x", [], [[]], [0.0] * 3, [[0.0, np.nan, 0.0]], [["x"] * 3]],
    "radius": [*NUMBER, None, -0.1, INF], "offset": [*NUMBER, None, INF, 1e4],
    "clearance": [*NUMBER, -0.1, INF], "soft": [*NUMBER, -0.1, INF],
    "scene": ["nonsense", 3, object(), [BALL]], "ignore": ["nonsense", 3, [1], [("a",)]],
    "shapes": ["nonsense", None, 3, [3], [SCENE]], "body": ["nonsense", 3, object()],
    "plates": ["nonsense", 1, None], "hand": ["nonsense", 3, [3], [SCENE]],
    "links": ["nonsense", None, 3, {}, {8: [BALL]}, {True: [BALL]}],
    "upper_arm": [*POSITIVE, None, INF], "forearm": [*POSITIVE, None, INF],
    "intervals": ["nonsense", object(), [1.0, 2.0, 3.0], [[1.0]], [[2.0, 1.0]], [[NAN, 1.0]], [[0, INF]],
                  [[0, 1e9]], [[0.0, 0.1]] * 17, [[1j, 2]], [[0.0, 1.0], [2.0]]],
    "K": [*NUMBER, -0.1, 1.1, None, True], "alpha": [*POSITIVE, None, True, INF],
    "tool_speed": POSITIVE, "tolerance": [*NUMBER, -0.1, 2.0],
    "cycle": [*NUMBER, -1.0, 2.0], "sample": POSITIVE, "jerk": [*BOUND, -Q],
    "velocity_now": SEVEN, "lookahead": ["nonsense", object(), NAN, -1, 1.5, True, None],
    "rate": [*NUMBER, -1.0, True], "dt": [*POSITIVE, True], "path": [*POSES, POSE],
    "goal": [v for v in JOINTS if v is not None], "objective": ["nonsense", None, 1.0, aa.Objective],
    "samples": ["nonsense", 0, 1, 2.5, True], "limit_margin": [*NUMBER, None, -0.1, 2.2, INF],
    "singularities": WEIGHT, "travel": WEIGHT, "enough": WEIGHT, "end": POSES,
    "orientation": [*CHOICE, None, []], "via": POINTS, "point": POINTS,
    "direction": [*POINTS, [0.0, 0.0, 0.0]], "angle": [*NUMBER, None, INF, 1e4],
    "advance": [*NUMBER, None, INF, 1e4], "s": [*ANGLES, -0.1, 1.1],
    "order": ["nonsense", None, 0, 4, 1.5, NAN],
    "x": [*VECTOR, 0.1], "y": [*VECTOR, 0.1], "z": [*NUMBER, None, INF, 1e4],
    "a_1": [*NUMBER, None, INF, 1e6], "a_6": [*NUMBER, None, INF, 1e6],
    "metric": CHOICE, "prefer": CHOICE, "filter": ["nonsense", 0.5, object(), aa.HandFilter],
    "length": [*POSITIVE, None, INF], "elbow_margin": MARGIN, "reconfigure": INDEX,
    "soft_clearance": [*NUMBER, None, INF, -1.0], "obstacle_speed": [*NUMBER, INF, -1.0],
    "elbow_direction": ["nonsense", object(), 0.1, [1.0, 2.0], [1j] * 3],
    "elbow": ["nonsense", object(), 0.1, [1.0, 2.0], [[0.0, 0.0, 1.0]], [1j] * 3], "omega": [*POSITIVE, None],
    "patience": [*NUMBER, -1.0, None], "jump": [*POSITIVE, None], "turn": [*POSITIVE, None],
    "blend": [*NUMBER, None, -0.1, INF, [0.1] * 5, [[0.1]]], "detours": ["nonsense", None, 0, 1.0],
    "step": [*POSITIVE, None, INF], "progress": ["nonsense", object(), 1.0, 1],
    "paths": ["nonsense", None, 0.5, [], [POSE], [aa.Line(POSE, POSE), 1], aa.Line(POSE, POSE)],
    "weight": ["nonsense", object(), Q[:6], changed(Q, NAN), Q + 1j, -np.ones(7), np.zeros(7)],
}  # fmt: skip
BAD_HERE: dict[tuple[str, str], list[Any]] = {
    **{(name, "point"): PLACES for name in ("Towards", "Arm.psi_towards")},
    **{(name, "direction"): ALONG for name in ("Towards", "Arm.psi_towards along")},
    ("Arm.psi_towards", "direction"): ["up"],
    ("Arm.psi_towards along", "point"): [[0.0, 0.0, 1.0]],
    **{(name, "gc"): [*INDEX, None] for name in ("Arm.psi_towards", "Arm.psi_towards along")},
    ("Solution.row", "index"): [*(v for v in INDEX if v != -1), 2, -3, None, (0, 0), (0.5,)],
    ("Towards", "psi"): [v for v in ANGLES if v is not None],
    ("join", "paths"): ["nonsense", None, 0.5, [], [POSE], [aa.Line(POSE, POSE)], aa.Line(POSE, POSE)],
    ("retime", "path"): ["nonsense", None, 0.5, POSE],
    ("gc_index", "signs"): ["nonsense", object(), None, [1, 1], [1, 1, 0], [1, NAN, 1], 1],
    ("nearest_rotation", "pose"): [*WORDS, 0.1, POSE[:3], changed(POSE, NAN), changed(POSE, INF)],
    ("pose", "unnamed"): [[1.0, 0.0, 0.0, 0.0], None],
    ("pose", "unknown"): [[1.0, 0.0, 0.0, 0.0], None],
    ("pose", "xyz"): [*WORDS, 0.1, [1.0, 2.0], [NAN, 0.0, 0.0], [0.0, INF, 0.0], [1j] * 3],
    **{("pose", name): [*GIVEN, 0.1, [1.0, 2.0], [NAN] * 4, [2.0] * 4, [1j] * 4]
       for name in ("wxyz", "xyzw")},
    **{("pose", name): [v for v in [*ANGLES, [0.0] * 4, [NAN] * 3, [1e9] * 3] if v is not None]
       for name in ("rpy", "rotvec")},
    ("pose", "matrix"): [*GIVEN, 0.1, np.ones((3, 3)), -np.eye(3), POSE, NAN * np.eye(3)],
    # a number stands for all joints, and a sample that is no pose is one that did not come
    **{("Tracker", name): ["nonsense", object(), Q[:6], changed(Q, NAN), Q + 1j, -Q, -1.0]
       for name in ("velocity", "acceleration", "jerk")},
    **{(name, "poses"): [*WORDS, 0.1, POSE[:3], POSE, POSE.astype(complex)]
       for name in ("Tracker.run", "HandFilter.smooth")},
    ("Tracker.step", "pose"): [*GIVEN, 0.1, POSE[:3], TWO, POSE.astype(complex)],
    ("place", "poses"): [*WORDS, 0.1, POSE[:3], POSE, changed(TWO, NAN), TWO.astype(complex)],
    ("place", "weight"): ["nonsense", object(), 1.0, [1.0], [NAN, 1.0], [-1.0, 1.0]],
    **{(name, "path"): [None, object(), 1.0, {"a": 1}, "", "a\0b"] for name in ("reach_map", "ReachMap")},
    **{(name, "roll"): CHOICE for name in ("step", "follow", "plan", "Arm.solve", "offset arm, solve")},
    ("Field", "distance"): [None, "x", [], [[]], [0.0] * 3, np.full((2, 2, 2), NAN), [[["x"] * 2] * 2] * 2],
    ("Field", "origin"): POINTS,
    ("Field", "spacing"): [*POSITIVE, None, INF],
    ("reach_map", "spacing"): [*WORDS, NAN, INF, 0.0, -1.0, 1e-9, 1j],
    ("reach_map", "tilt"): [*WORDS, NAN, INF, 0.0, -1.0, 1e-9, 3.0, 1j],
    ("reach_map", "fields"): [None, object(), 1.0, (), ("gc", "nonsense"), [1j]],
    ("reach_map", "part"): ["nonsense", object(), 1, (1,), (0, 3), (4, 3), (1.0, 3), (True, 3)],
    ("reach_map", "scheduler"): ["nonsense", object(), 1.0, {"a": 1}],
    ("Objective", "limits"): WEIGHT,
    **{(name, "start"): [v for v in JOINTS if v is not None] for name in ("plan", "retime")},
    ("plan", "gc"): [*INDEX, [], [8], ["x"]],
    ("plan", "psi"): ["nonsense", object(), NAN, INF, 1j, [], np.zeros((2, 2)), [0.0, NAN], lambda s: 1.0],
    ("Objective", "psi"): WEIGHT,
    ("Objective", "duration"): WEIGHT,
    **{(name, "start"): POSES for name in ("Line", "CircularArc", "Screw")},
    **{(name, "gc"): [*INDEX, [], [8], ["x"]]
       for name in ("Arm.solve", "Arm.solutions", "gradients.margin", "offset arm, solve")},
    **{
        (name, "gc"): [*INDEX, None]
        for name in ("gc_signs", "resolve", "Arm.self_motion",
                     *(f"gradients.{name}" for name in ("inverse", "feasible", "joint_function")))
    },
}  # fmt: skip
NEEDS: dict[str, dict[str, Any]] = {
    "samples": {"path": aa.Line(POSE, POSE)}, "dt": {"policy": aa.Repulsion(rate=1.0)},
    "velocity_now": {"velocity": np.ones(7), "dt": 0.1},
}  # fmt: skip
FREE = {"arm", "name", "joint_names", "notes", "report"}
"""Values of other kinds, with tests of their own."""
OTHERS = {"catalogue", "save", "load_poses", "load_joints", "load_trajectory"}
OTHERS |= {"load_scene", "load_body", "load_cloud", "load_field"}
"""Files and names: refusals/test_files, models/test_catalogue, files/test_scenes, files/test_opening."""


def test_every_public_function_and_argument_is_in_the_matrix() -> None:
    """`FUNCTIONS` and `BAD` have a row for every public function and argument."""
    named = {name.split(".")[0] for name in FUNCTIONS} | OTHERS
    results = {
        "ArcEnd", "Branch", "ChainDeviation", "Clearance", "Deviation", "Diagnosis", "Freedom",
        "Geometry", "ImportReport",
        "JointFunction", "JointPath", "JointTable", "Opening", "Path", "PathPoint", "Placement", "Resolution",
        "Solution", "Solutions", "SpeedLoss", "Step", "Tracked", "Trajectory", "TrajectoryPoint",
        "TrajectoryTable", "Voxels",
    }  # fmt: skip
    public = {name: getattr(aa, name) for name in aa.__all__}
    faults = {n for n, v in public.items() if isinstance(v, type) and issubclass(v, Exception)}
    constants = {n for n, v in public.items() if not callable(v)} | {"Status", "Tracking", "Verdict"}
    assert set(public) - named - results - faults - constants == set()
    for name, (function, _) in FUNCTIONS.items():
        for parameter in set(inspect.signature(function).parameters) - FREE - set(BAD):
            assert (name, parameter) in BAD_HERE, (name, parameter)


def arguments_of(name: str) -> dict[str, Any]:
    """Arguments that the function takes without complaint."""
    function, good = FUNCTIONS[name]
    return good or {p: GOOD[p] for p in inspect.signature(function).parameters if p in GOOD}


@pytest.mark.slow
@pytest.mark.parametrize("name", FUNCTIONS)
def test_nonsense_raises_an_error_that_names_the_argument(name: str) -> None:
    """Every bad value of every argument raises an ArmangleError that names the argument."""
    function, good = FUNCTIONS[name][0], arguments_of(name)
    taken = inspect.signature(function).parameters
    wrong = []
    for parameter in (p for p in taken if p not in FREE):
        needs = {other: given for other, given in NEEDS.get(parameter, {}).items() if other in taken}
        for value in BAD_HERE.get((name, parameter), BAD.get(parameter, [])):
            said = ""
            try:
                function(**{**good, **needs, parameter: value})
            except aa.ArmangleError as raised:
                said = str(raised)
            except Exception as raised:
                wrong.append(f"{parameter}={value!r}: {raised!r}")
                continue
            if parameter not in said or len(said) >= 600:
                wrong.append(f"{parameter}={value!r}: {said or 'no error'}")
    assert not wrong, "\n".join(wrong)


# -- units -----------------------------------------------------------------------------------------------

OF_JOINTS = {"q", "q_now", "start", "seed", "goal"}
OF_POSES = {"pose", "poses", "path"}
WITHOUT_ARM = {
    *((name, "pose") for name in ("nearest_rotation", "Box")),
    *((name, "poses") for name in ("HandFilter.smooth", "Waypoints")),
    *((name, "start") for name in ("Line", "CircularArc", "Screw")),
    *((name, "path") for name in ("reach_map", "ReachMap", "retime")),
    *(("retime", name) for name in ("start", "goal")),
}
"""What no arm is asked, and so nobody knows how long and how far; files; a motion, and its velocities."""


def in_other_units(value: Any, of_joints: bool) -> Any:
    """Return joints in degrees, or poses in mm."""
    if of_joints:
        return np.degrees(value)
    out = np.array(value)
    out[..., :3, 3] *= 1e3
    return out


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("batch", [False, True])
def test_every_door_asks_for_the_units(name: str, batch: bool) -> None:
    """Joints in degrees and poses in mm, alone or in one row of two, are refused with a question."""
    function, good = FUNCTIONS[name][0], arguments_of(name)
    for parameter in inspect.signature(function).parameters:
        of_joints = parameter in OF_JOINTS
        if not (of_joints or parameter in OF_POSES) or (name, parameter) in WITHOUT_ARM:
            continue
        right = good.get(parameter, Q if of_joints else POSE)
        if batch and np.ndim(right) < (2 if of_joints else 3) and (of_joints or parameter == "pose"):
            right = np.stack([right, right])
        wrong = np.array(in_other_units(right, of_joints))
        if batch and len(wrong) > 1 and np.ndim(wrong) > (1 if of_joints else 2):
            wrong[0] = right[0]  # the other alone
        try:
            function(**{**good, parameter: right})
        except aa.InputError:  # a door for one
            continue
        wanted = "were these degrees" if of_joints else "was this in mm"
        with pytest.raises(aa.InputError, match=rf"^{parameter.removesuffix('s')}.*{wanted}"):
            function(**{**good, parameter: wrong})


def test_every_door_of_kuka_asks_for_the_units() -> None:
    """Functions of `kuka` refuse joints and angles in degrees, and poses in mm, with a question."""
    degrees, mm, asked = np.degrees(Q), in_other_units(POSE, False), r"were these degrees\?|was this in mm\?"
    calls: list[Callable[[], Any]] = [
        *(lambda f=f: f(ARM, degrees)
          for f in (aa.kuka.status, aa.kuka.turn, aa.kuka.to_e1, aa.kuka.to_frame)),
        lambda: aa.kuka.from_e1(ARM, POSE, 0.1, 2, seed=degrees),
        lambda: aa.kuka.from_e1(ARM, POSE, 57.0, 2), lambda: aa.kuka.from_e1(ARM, mm, 0.1, 2),
        lambda: aa.kuka.e1_arcs(ARM, mm, 2), lambda: aa.kuka.from_frame(ARM, (POSE, 30.0, 0, 0)),
    ]  # fmt: skip
    assert not_refused((aa.InputError, asked, call) for call in calls) == []


def test_a_far_pose_and_a_joint_just_outside_are_no_mistake() -> None:
    """A pose 30 reaches away is unreachable, joints 6.2 rad outside the limits are outside: no error."""
    far = POSE.copy()
    far[:3, 3] *= 30 * ARM.geometry.reach / np.linalg.norm(far[:3, 3])
    assert ARM.solve(far).status == aa.Status.UNREACHABLE
    assert not ARM.within_limits(ARM.upper + 6.2)
    assert np.isfinite(ARM.forward(ARM.lower - 6.2)[0]).all()


def comb(teeth: int, phase: float) -> aa.ArcSet:
    """A set of that many arcs of 0.05 rad, evenly spaced, the first at -pi + `phase`."""
    lower = np.linspace(-np.pi, np.pi, teeth, endpoint=False) + phase
    return aa.ArcSet(np.stack([lower, lower + 0.05], axis=-1))


def test_sets_of_more_arcs_than_fit_are_refused_and_none_is_lost() -> None:
    """Operations on sets of more arcs than fit raise; up to 32 keep all, but `allowed` takes 16."""
    both = comb(16, 0.0) | comb(16, 0.12)
    assert both.count == 32
    assert (~both).count == 32
    for operation in (lambda a, b: a | b, lambda a, b: a & b):
        with pytest.raises(aa.InputError, match="the two sets hold 48 arcs, wanted at most 32"):
            operation(both, comb(16, 0.24))
    for call in (
        lambda allowed: aa.step(ARM, Q, POSE, allowed=allowed),
        lambda allowed: aa.follow(ARM, POSE[None], start=Q, allowed=allowed),
        lambda allowed: aa.resolve(ARM, POSE, PSI, GC, allowed=lambda pose: allowed),
    ):
        with pytest.raises(aa.InputError, match="allowed holds 32 arcs, wanted at most 16"):
            call(both)
