"""What bad input gets: its class, and a message that names argument, index and value."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from support.refused import Row, not_refused
from support.threads import in_threads

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.3, 0.6, -0.2, 1.3, 0.4, 0.9, 0.1])
POSE, PSI, GC = ARM.forward(Q)
BATCH = np.repeat(POSE[None], 3, axis=0)
LENGTHS = {"d_bs": 0.3, "d_se": 0.4, "d_ew": 0.4, "d_wf": 0.1}
FREE = partial(ARM.inverse, limits=False)


def changed(array: Any, index: Any, value: float) -> np.ndarray:
    """A copy with one entry changed."""
    out = np.array(array, dtype=float)
    out[index] = value
    return out


def made(**arguments: Any) -> Callable[[], Any]:
    """A call of `Arm` with some arguments changed."""
    return lambda: aa.Arm(**{**LENGTHS, **arguments})


MIRRORED = POSE @ np.diag([1.0, 1.0, -1.0, 1.0])
SKEW = changed(POSE, (0, 0), POSE[0, 0] + 1e-3)
FAR = changed(POSE, (0, 3), 2.0)
DOWN = ARM.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0]

SHAPES: list[tuple[str, Callable[[], Any]]] = [
    (r"^q has shape \(6,\), wanted \(..., 7\)", lambda: ARM.forward(np.zeros(6))),
    (r"q has shape \(6,\)", lambda: ARM.frames(np.zeros(6))),
    (r"^pose has shape \(3, 3\), wanted \(..., 4, 4\)", lambda: FREE(np.eye(3), 0.0, 0)),
    (r"pose \(3,\), psi \(2,\), gc \(\)", lambda: FREE(BATCH, [1.0, 2.0], 0)),
    (r"^out .* shape \(3, 7\)", lambda: FREE(BATCH, 0.0, 0, out=np.empty((3, 6)))),
    (r"^signs has shape \(2,\), wanted \(..., 3\)", lambda: aa.gc_index([1, 1])),
    (r"^pose has shape \(3, 4, 4\), wanted \(4, 4\)", lambda: aa.gradients.joint_function(ARM, BATCH, 0, 1)),
    (r"^upper has shape \(6,\)", made(upper=np.ones(6))),
    (r"^lower has shape \(6,\), wanted \(7,\), or a number", made(lower=[-2.0] * 6)),
    ("follow takes sequences", lambda: aa.step(ARM, Q, BATCH)),
    (r"^allowed has shape \(2,\), wanted \(\) or \(3,\)",
     lambda: aa.follow(ARM, BATCH, start=Q, allowed=ARM.feasible(BATCH[:2], GC))),
    (r"^poses has shape \(4, 4\), wanted \(N, 4, 4\)", lambda: aa.follow(ARM, POSE, start=Q)),
    (r"^start has shape \(2, 7\), wanted \(7,\)", lambda: aa.follow(ARM, BATCH, start=[Q, Q])),
    (r"^intervals has shape \(3,\)", lambda: aa.ArcSet([1.0, 2.0, 3.0])),
    (r"^psi of shape \(2,\)", lambda: ARM.feasible(BATCH, GC).contains([1.0, 2.0])),
    ("do not broadcast", lambda: ARM.feasible(BATCH, GC) & ARM.feasible(BATCH[:2], GC)),
    ("index them", lambda: list(ARM.feasible(BATCH, GC))),
    (r"pose \(3,\), gc \(\), point .*\(2,\)", lambda: ARM.psi_towards(BATCH, GC, np.zeros((2, 3)))),
    (r"^reference has shape \(1, 3\), wanted \(3,\)", lambda: ARM.with_(reference=[[0.0, 0, 1]])),
]  # fmt: skip
VALUES: list[tuple[str, Callable[[], Any]]] = [
    (r"^pose\[1\] holds nan", lambda: FREE(changed(BATCH, (1, 0, 3), np.nan), 0.0, 0)),
    (r"^pose\[2\] holds inf", lambda: ARM.feasible(changed(BATCH, (2, 0, 0), np.inf), 0)),
    (r"^psi\[1\] is nan", lambda: FREE(BATCH, [0.0, np.nan, 1.0], 0)),
    (r"^q\[1\] holds nan", lambda: ARM.forward([Q, changed(Q, 3, np.nan)])),
    (r"^q\[1\] holds nan", lambda: ARM.frames([Q, changed(Q, 3, np.nan)])),
    ("^seed holds inf", lambda: FREE(POSE, 0.0, 0, seed=changed(Q, 2, np.inf))),
    (r"rotation of pose\[1\] .* 1e-06", lambda: FREE([POSE, SKEW], 0.0, 0)),
    ("rotation of pose is a reflection.* -1", lambda: FREE(MIRRORED, 0.0, 0)),
    ("^pose has 2 in its last row", lambda: FREE(changed(POSE, (3, 3), 2), 0, 0)),
    ("^pose has -?0.* in its last row.* transposed", lambda: ARM.solve(POSE.T)),
    (r"^pose\[0\] has .* in its last row.* transposed", lambda: ARM.solve(np.swapaxes(BATCH, 1, 2))),
    (r"^gc\[1\] is -1, .* 0 to 7", lambda: ARM.feasible(POSE, [0, -1])),
    *((f"^gc has type {kind}", lambda kind=kind: ARM.feasible(BATCH[:0], np.empty(0, kind)))
      for kind in ("bool", "float64")),
    ("with_ is 'limit_margin', wanted one of 'd_bs', .*'singularity_margin'",
     lambda: ARM.with_(limit_margin=1)),  # type: ignore[call-arg]  # wrong on purpose
    ("^gc has type float64", lambda: FREE(POSE, 0.0, 1.0)),
    (r"^lower\[2\] is 1 and upper\[2\] is -1",
     made(lower=changed(-np.ones(7), 2, 1), upper=changed(np.ones(7), 2, -1))),
    (r"^lower\[0\] is nan", made(lower=changed(-np.ones(7), 0, np.nan))),
    (r"^signs\[3\] is 2", made(signs=changed(np.ones(7), 3, 2))),
    (r"^velocity\[1\] is 0", made(velocity=changed(np.ones(7), 1, 0))),
    (r"^dt is missing", lambda: aa.resolve(ARM, POSE, PSI, GC, policy=aa.Repulsion(rate=1.0))),
    (r"pose\[1\] is not orthonormal", lambda: aa.follow(ARM, [POSE, SKEW], start=Q)),
    (r"^intervals\[0, 1\] is nan", lambda: aa.ArcSet([[0.0, np.nan]])),
    (r"^intervals\[1\] is \[2.0, 1.0\]", lambda: aa.ArcSet([[0, 1], [2, 1.0]])),
    (r"17 arcs, wanted at most 16", lambda: aa.ArcSet(np.arange(17)[:, None] * 0.2 + [[0, 0.1]])),
    (r"^d_se \(m\) is 1e-160 .* 1e-160 m", lambda: aa.Arm(d_bs=0, d_se=1e-160, d_ew=1e-160, d_wf=0)),
    *((f"^{key} .* is 0 and {beside} is 0: the {link} is 0 m", made(**{key: 0.0}))
      for key, beside, link in (("d_ew", "a_4", "forearm"), ("d_se", "a_3", "upper arm"))),
    ("the upper arm is .* at least 1e-06", made(d_se=9e-7)),
    ("the upper arm is .* at least 1e-06", made(d_se=5e-7, a_3=5e-7)),
    ("^threads is 2147483648", lambda: in_threads(2**31, lambda: ARM.forward(Q))),
    ("^singularity_margin", lambda: aa.step(ARM.with_(singularity_margin=np.array([0.0, 0.0])), Q, POSE)),
    (r"^gc is \[2\]", lambda: aa.step(ARM, Q, POSE, gc=[2])),
    ("^carry is", lambda: aa.step(ARM, Q, POSE, carry=["psi"])),
    ("^on_fail is", lambda: aa.follow(ARM, [POSE], start=Q, on_fail=np.array(["stop", "hold"]))),
    ("^limits is", lambda: ARM.inverse(POSE, 0.0, 0, limits=np.array(["nan", "raise"]))),
    ("^signs is", lambda: aa.gc_index(["a", "b", "c"])), ("^signs is", lambda: aa.gc_index([1j, -1j, 1])),
    ("^joint_names is", lambda: ARM.with_(joint_names=("a",))),
    ("^joint_names is", lambda: ARM.with_(joint_names=("a",) * 7)),
    ("^name is 5", lambda: ARM.with_(name=5)),
    *(("exactly one", lambda w=w: ARM.psi_towards(POSE, GC, **w))
      for w in ({}, {"point": [0, 0, 1], "direction": "up"})),
    ("^direction is 'north', wanted one of 'up'", lambda: ARM.psi_towards(POSE, GC, direction="north")),
    ("^direction is zero", lambda: ARM.psi_towards(POSE, GC, direction=[[0, 0, 1], [0, 0, 0]])),
    ("^point is 'up', .* direction=", lambda: ARM.psi_towards(POSE, GC, "up")),
    ("^point holds 5000, .*1000", lambda: ARM.psi_towards(POSE, GC, [0, 0, 5000.0])),
    *(("^inverse takes a pose and psi.*seed=q", lambda g=g: FREE(POSE, *g)) for g in ((), (None, GC))),
    ("^weight is .* >= 0", lambda: ARM.solve(POSE, seed=Q, weight=[-1, 1, 1, 1, 1, 1, 1])),
    (r"^weight has shape \(2,\)", lambda: ARM.solve(POSE, seed=Q, weight=[1, 2])),
    ("^gc holds nothing", lambda: ARM.solve(POSE, seed=Q, gc=[])),
    ("0.00138", lambda: ARM.solve(np.round(DOWN, 3), seed=Q)),
    *((f"{door} of an Arm takes no {word}=: ",
       lambda door=door, word=word: getattr(ARM, door)(POSE, **{word: 0.1}))
      for door in ("solve", "solutions") for word in ("psi", "near", "q0", "on_error", "limits", "scene",
       "threads")),
    (r"solutions of an Arm takes no roll=: solve\(", lambda: ARM.solutions(POSE, roll="free")),
    (r"solve of an Arm takes no elbow=: psi_towards\(", lambda: ARM.solve(POSE, elbow="up")),
    *(("^fallback is 'nearest_pose'", lambda k=k: ARM.solve(POSE, fallback="nearest_pose", **k))
      for k in ({"gc": 2}, {"allowed": aa.ArcSet([[0.0, 1.0]])})),
    ("^length is 0", lambda: ARM.solve(POSE, fallback="nearest_pose", length=0.0)),
    *((f"^plan takes no {word}=", lambda word=word: aa.plan(ARM, [POSE, POSE], **{word: aa.Hold()}))
      for word in ("policy", "seed", "velocity", "lookahead")),
]  # fmt: skip
OTHERS: list[Row] = [
    (aa.UnreachableError, r"^pose is out of reach by [0-9.]+ mm", lambda: FREE(FAR, 0.0, 0)),
    (aa.UnreachableError, r"^pose\[0\] is out of reach by", lambda: FREE([FAR], 0.0, 0)),
    (aa.UnreachableError, "out of reach", lambda: aa.gradients.joint_function(ARM, FAR, 0, 1)),
    (aa.LimitError, "joint 7 of the solution of pose",
     lambda: ARM.with_(upper=[*ARM.upper[:6], 0.05]).inverse(POSE, PSI, GC)),
]  # fmt: skip


def test_bad_input_is_named() -> None:
    """Bad shapes and values raise, with argument, index and value in the message."""
    rows: list[Row] = [(aa.InputError, pattern, call) for pattern, call in (*SHAPES, *VALUES)]
    assert not_refused([*rows, *OTHERS]) == []
    with pytest.raises(TypeError, match="unexpected"):
        aa.plan(ARM, [POSE, POSE], nonsense=1)  # type: ignore[call-arg]  # wrong on purpose
    with pytest.raises(TypeError, match="unexpected"):
        ARM.solve(POSE, nonsense=1)


TILTED = ARM.with_tool(aa.pose([0.0, 0.0, 0.1], rpy=[0.3, 0.0, 0.0]))
ASKED: list[Callable[[Any], Any]] = [
    lambda pose: FREE(pose, PSI, GC), lambda pose: FREE(pose, [PSI, 0.0], GC), lambda pose: FREE(pose, PSI),
    lambda pose: ARM.self_motion(pose, [PSI, 0.0], GC), lambda pose: aa.gradients.inverse(ARM, pose, PSI, GC),
    lambda pose: ARM.feasible(pose, GC), lambda pose: ARM.feasible(pose, [0, 1]), ARM.feasible,
    lambda pose: ARM.psi_towards(pose, [0, 1], direction="up"),
    lambda pose: ARM.solve(pose, seed=Q), lambda pose: ARM.solve(pose, seed=Q, weight=2.0),
    lambda pose: ARM.solve(pose, seed=Q, roll="free"), lambda pose: TILTED.solve(pose, seed=Q, roll="free"),
    lambda pose: ARM.solve(pose, seed=Q, fallback="nearest_pose"), lambda pose: ARM.solutions(pose, seed=Q),
    lambda pose: ARM.solve(pose, prefer="margin"), ARM.reachable, ARM.freedom,
    lambda pose: ARM.feasible_turns(pose, about="base"), lambda pose: ARM.feasible_turns(pose, about="tool"),
    lambda pose: aa.kuka.from_e1(ARM, pose, 0.2, [0, 1]), lambda pose: aa.kuka.e1_arcs(ARM, pose, 2),
]  # fmt: skip


def test_a_pose_is_named_by_its_own_place() -> None:
    """A single bad pose is named without an index; of a batch with that in the caller's array."""
    batch = np.repeat(np.repeat(POSE[None, None], 3, axis=1), 2, axis=0)[..., None, :, :]
    batch[1, 2, 0] = SKEW
    for ask in ASKED:
        alone = (SKEW, changed(POSE, (0, 3), np.nan), MIRRORED)
        rows: list[Row] = [(aa.InputError, r"^(?!.*pose\[)", lambda p=p, ask=ask: ask(p)) for p in alone]
        place = r"rotation of pose\[1, 2(, 0)?\] is not"
        assert not_refused([*rows, (aa.InputError, place, lambda ask=ask: ask(batch))]) == []


DEGREES = np.degrees(Q)
FRANKA = aa.Arm.from_catalogue("franka_fr3")
OF_FRANKA = np.array([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])


def test_degrees_are_suspected_where_joints_are_beyond_a_turn() -> None:
    """Joints more than a turn outside the limits are refused, for every metric and fallback."""
    calls: list[Callable[[], Any]] = [
        *(lambda k=k: ARM.solve(POSE, seed=DEGREES, **k)
          for k in ({"metric": "max"}, {"fallback": "nearest_pose"}, {"roll": "free"})),
        lambda: ARM.solve(BATCH, seed=[Q, Q, DEGREES]), lambda: ARM.solutions(POSE, seed=DEGREES),
        lambda: FRANKA.solve(FRANKA.forward(OF_FRANKA)[0], seed=np.degrees(OF_FRANKA)),
        lambda: aa.plan(ARM, BATCH, start=DEGREES), lambda: aa.plan(ARM, BATCH, goal=DEGREES),
        lambda: aa.kuka.from_frame(ARM, (POSE, 30.0, 0, 0)),
    ]  # fmt: skip
    beyond = r"more than a turn outside the limits.*were these degrees\?"
    assert not_refused((aa.InputError, beyond, call) for call in calls) == []


def test_a_turn_beyond_the_limits_is_taken() -> None:
    """`solve` takes a seed a turn outside the limits, and without limits any."""
    wound = Q + np.array([2 * np.pi, 0, 0, 0, 0, 0, -2 * np.pi])  # an encoder that counts turns
    assert np.array_equal(ARM.solve(POSE, seed=wound).q, ARM.solve(POSE, seed=wound, weight=1.0).q)
    free = ARM.with_(lower=-np.inf, upper=np.inf)
    assert free.solve(POSE, seed=DEGREES).ok  # without limits any number of turns is a posture


def test_one_limit_serves_all_joints() -> None:
    """A number as limit, velocity or acceleration of `Arm` holds for all joints."""
    arm = aa.Arm(**LENGTHS, lower=-2.0, upper=2.5, velocity=1.0, acceleration=5)
    assert arm.lower.tolist() == [-2.0] * 7 and arm.upper.tolist() == [2.5] * 7
    assert arm == aa.Arm(**LENGTHS, lower=[-2.0] * 7, upper=[2.5] * 7, velocity=[1.0] * 7, acceleration=5.0)


def test_the_ends_of_arcs_are_within_the_limits() -> None:
    """The ends of `feasible` are `within_limits` by its default tolerance, not all with tol=0."""
    q = np.random.default_rng(4).uniform(ARM.lower, ARM.upper, (200, 7))
    pose, _, gc = ARM.forward(q)
    arcs = ARM.feasible(pose, gc)
    ended = [k for k in range(len(q)) if not arcs[k].is_full and not arcs[k].is_empty]
    ends = np.concatenate([FREE(pose[k], arcs[k].intervals.ravel(), gc[k]) for k in ended])
    assert len(ends) > 100 and np.all(ARM.within_limits(ends))
    assert not np.all(ARM.within_limits(ends, tol=0.0))
    assert not ARM.within_limits(np.where(np.arange(7) == 2, ARM.upper + 2e-9, Q))


def test_errors_are_those_of_python_too() -> None:
    """InputError is a ValueError, MissingExtraError an ImportError, OutputError an OSError."""
    pairs = ((aa.InputError, ValueError), (aa.MissingExtraError, ImportError), (aa.OutputError, OSError))
    assert all(issubclass(ours, theirs) for ours, theirs in pairs)


def test_a_pose_off_by_less_than_a_millionth_is_solved_as_given() -> None:
    """`inverse` takes a rotation off by 4e-7; `nearest_rotation` mends a worse one."""
    assert np.isfinite(FREE(changed(POSE, (0, 0), POSE[0, 0] + 4e-7), PSI, GC)).all()
    exact = aa.nearest_rotation(SKEW)
    assert np.abs(exact[:3, :3].T @ exact[:3, :3] - np.eye(3)).max() <= 1e-14
    assert np.isfinite(FREE(exact, PSI, GC)).all()


def test_unreachable_and_limits_may_be_nan_instead() -> None:
    """`inverse` with on_error="nan" gives NaN out of reach and outside the limits."""
    out = FREE([POSE, FAR], PSI, GC, on_error="nan")
    assert np.isfinite(out[0]).all() and np.isnan(out[1]).all()
    tight = ARM.with_(upper=[*ARM.upper[:6], 0.05])
    outside = ~tight.within_limits(np.nan_to_num(FREE(POSE, PSI)), tol=1e-9)
    assert np.array_equal(np.isnan(tight.inverse(POSE, PSI, on_error="nan")).all(-1), outside)


def test_an_arm_is_frozen() -> None:
    """Attributes and arrays of an Arm cannot be set."""
    with pytest.raises(AttributeError, match="d_se"):
        ARM.geometry.d_se = 1.0
    with pytest.raises(ValueError, match="read-only"):
        ARM.lower[0] = 1.0


NAMES = {
    "ik": r"solve\(pose, seed=q\)", "closest": r"solve\(pose, seed=q\)", "fkine": r"forward\(q\)",
    "nullspace": r"self_motion\(pose, psi, gc\)", "jacob0": r"jacobian\(q\)", "plan": r"armangle.plan\(arm",
    "limits": "lower and upper", "colour": "'colour'$",
}  # fmt: skip


def test_names_of_other_libraries_are_told_their_name_here() -> None:
    """An unknown attribute raises an AttributeError with the name that is meant."""
    words = {
        "solve": r"arm\.solve$", "inverse": r"arm\.inverse$", "plann": "'plann'$",
        "load": r"armangle\.Arm\.load$", "from_urdf": r"armangle\.Arm\.from_urdf$",
    }  # fmt: skip
    for owner, names in ((ARM, NAMES), (aa, words)):
        for name, hint in names.items():
            with pytest.raises(AttributeError, match=hint) as error:
                getattr(owner, name)
            assert error.value.name == name or name in words  # Python suggests what is alike
            assert not hasattr(owner, name) and getattr(owner, name, None) is None
