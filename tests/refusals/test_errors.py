"""What bad input gets: every message of the core names argument, index, value and what was wanted."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support.threads import in_threads

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.3, 0.6, -0.2, 1.3, 0.4, 0.9, 0.1])
POSE, PSI, GC = ARM.forward(Q)
BATCH = np.repeat(POSE[None], 3, axis=0)
LENGTHS = {"d_bs": 0.3, "d_se": 0.4, "d_ew": 0.4, "d_wf": 0.1}


def changed(array: Any, index: Any, value: float) -> np.ndarray:
    """A copy with one entry changed."""
    out = np.array(array, dtype=float)
    out[index] = value
    return out


def made(**arguments: Any) -> Callable[[], Any]:
    """A constructor call with some arguments changed."""
    return lambda: aa.Arm(**{**LENGTHS, **arguments})


MIRRORED = POSE @ np.diag([1.0, 1.0, -1.0, 1.0])
SKEW = changed(POSE, (0, 0), POSE[0, 0] + 1e-3)
FAR = changed(POSE, (0, 3), 2.0)
NEAR = changed(POSE, (slice(0, 3), 3), 0) + changed(np.zeros((4, 4)), (2, 3), 0.34)

CASES: list[tuple[type[Exception], str, Callable[[], Any]]] = [
    (aa.InputError, r"q has shape \(6,\), wanted \(..., 7\)", lambda: ARM.forward(np.zeros(6))),
    (aa.InputError, r"pose has shape \(3, 3\), wanted \(..., 4, 4\)",
     lambda: ARM.inverse(np.eye(3), 0.0, 0)),
    (aa.InputError, r"do not broadcast: pose \(3,\), psi \(2,\), gc \(\)",
     lambda: ARM.inverse(BATCH, [1.0, 2.0], 0, limits=False)),
    (aa.InputError, r"out is no writable C-contiguous float64 array of shape \(3, 7\)",
     lambda: ARM.inverse(BATCH, 0.0, 0, out=np.empty((3, 6)), limits=False)),
    (aa.InputError, r"pose\[1\] holds nan",
     lambda: ARM.inverse(changed(BATCH, (1, 0, 3), np.nan), 0.0, 0, limits=False)),
    (aa.InputError, r"pose\[2\] holds inf", lambda: ARM.feasible(changed(BATCH, (2, 0, 0), np.inf), 0)),
    (aa.InputError, r"psi\[1\] is nan", lambda: ARM.inverse(BATCH, [0.0, np.nan, 1.0], 0, limits=False)),
    (aa.InputError, r"q\[1\] holds nan", lambda: ARM.forward([Q, changed(Q, 3, np.nan)])),
    (aa.InputError, r"seed holds inf",
     lambda: ARM.inverse(POSE, 0.0, 0, seed=changed(Q, 2, np.inf), limits=False)),
    (aa.InputError,
     r"rotation of pose\[1\] is not orthonormal: .*wanted at most 1e-06; armangle.nearest_rotation",
     lambda: ARM.inverse([POSE, SKEW], 0.0, 0, limits=False)),
    (aa.InputError, r"the rotation of pose is a reflection: its determinant is -1",
     lambda: ARM.inverse(MIRRORED, 0.0, 0, limits=False)),
    (aa.InputError, r"pose has 2 in its last row, wanted 0 0 0 1",
     lambda: ARM.inverse(changed(POSE, (3, 3), 2), 0, 0, limits=False)),
    (aa.InputError, r"gc is 8, wanted an integer from 0 to 7",
     lambda: ARM.inverse(POSE, 0.0, 8, limits=False)),
    (aa.InputError, r"gc\[1\] is -1, wanted an integer from 0 to 7",
     lambda: ARM.feasible(POSE, [0, -1])),
    (aa.InputError, r"gc has type float64, wanted integers",
     lambda: ARM.inverse(POSE, 0.0, 1.0, limits=False)),
    (aa.InputError, r"gc is 9, wanted integers from 0 to 7", lambda: aa.gc_signs(9)),
    (aa.InputError, r"wanted \+1 or -1 in every entry", lambda: aa.gc_index([1, 0, 1])),
    (aa.InputError, r"signs has shape \(2,\), wanted \(..., 3\)", lambda: aa.gc_index([1, 1])),
    (aa.UnreachableError, r"pose is out of reach by [0-9.]+ mm",
     lambda: ARM.inverse(FAR, 0.0, 0, limits=False)),
    (aa.UnreachableError, r"pose\[0\] is out of reach by", lambda: ARM.inverse([FAR], 0.0, 0, limits=False)),
    (aa.LimitError, r"joint 7 of the solution of pose is outside its limits",
     lambda: ARM.with_(upper=[*ARM.upper[:6], 0.05]).inverse(POSE, PSI, GC)),
    (aa.InputError, r"limits is 'no', wanted True or False",
     lambda: ARM.inverse(POSE, 0.0, 0, limits="no")),
    (aa.InputError, r"threads is -1, wanted an integer",
     lambda: in_threads(-1, lambda: ARM.inverse(BATCH, 0.0, 0, limits=False))),
    (aa.InputError, r"singularity_margin \(rad\) is 2, wanted a number in \[0, 1.5\]",
     lambda: ARM.with_(singularity_margin=2).feasible(POSE, 0)),
    (aa.InputError, r"joint is 8, wanted an integer from 1 to 7",
     lambda: aa.gradients.joint_function(ARM, POSE, 0, 8)),
    (aa.InputError, r"pose has shape \(3, 4, 4\), wanted \(4, 4\)",
     lambda: aa.gradients.joint_function(ARM, BATCH, 0, 1)),
    (aa.UnreachableError, r"out of reach", lambda: aa.gradients.joint_function(ARM, FAR, 0, 1)),
    (aa.InputError, r"d_se .* is 0 and a_3 is 0: the upper arm is 0 m long, wanted at least", made(d_se=0)),
    (aa.InputError, r"d_ew .* is -0.1, wanted a number in \[0, 1000\]", made(d_ew=-0.1)),
    (aa.InputError, r"d_bs .* is nan, wanted a number in", made(d_bs=np.nan)),
    (aa.InputError, r"lower\[2\] is 1 and upper\[2\] is -1, wanted lower <= upper",
     made(lower=changed(-np.ones(7), 2, 1), upper=changed(np.ones(7), 2, -1))),
    (aa.InputError, r"lower\[0\] is nan", made(lower=changed(-np.ones(7), 0, np.nan))),
    (aa.InputError, r"upper has shape \(6,\)", made(upper=np.ones(6))),
    (aa.InputError, r"signs\[3\] is 2, wanted \+1 or -1", made(signs=changed(np.ones(7), 3, 2))),
    (aa.InputError,
     r"velocity\[1\] is 0, wanted a positive number", made(velocity=changed(np.ones(7), 1, 0))),
    (aa.InputError, r"the rotation of tool is not orthonormal", made(tool=SKEW)),
    (aa.InputError, r"the rotation of base is a reflection", made(base=MIRRORED)),
    (aa.InputError, r"kuka_iiwa7_r800", lambda: aa.Arm.from_catalogue("kuka_iiwa7_r80")),
    (aa.InputError, r"K is 1.5, wanted a number in \[0, 1\]", lambda: aa.Repulsion(K=1.5)),
    (aa.InputError, r"K is -0.1, wanted a number in", lambda: aa.Centre(K=-0.1)),
    (aa.InputError, r"alpha is 0, wanted a number in \(0", lambda: aa.Repulsion(alpha=0)),
    (aa.InputError, r"rate is -1, wanted a number in", lambda: aa.Centre(rate=-1)),
    (aa.InputError, r"is 'far', wanted 'nearest', 'stop' or 'escape'", lambda: aa.Hold(outside="far")),
    (aa.InputError, r"dt is missing", lambda: aa.resolve(ARM, POSE, PSI, GC, policy=aa.Repulsion(rate=1.0))),
    (aa.InputError, r"dt is 0, wanted a number in \(0",
     lambda: aa.step(ARM, Q, POSE, policy=aa.Centre(rate=1.0), dt=0)),
    (aa.InputError, r"carry is 'hand', wanted one of 'psi', 'elbow'",
     lambda: aa.step(ARM, Q, POSE, carry="hand")),
    (aa.InputError, r"max_joint_step is 0, wanted a number in \(0",
     lambda: aa.step(ARM, Q, POSE, max_joint_step=0)),
    (aa.InputError, r"gc is 8, wanted an integer from 0 to 7", lambda: aa.step(ARM, Q, POSE, gc=8)),
    (aa.InputError, r"q_now holds nan", lambda: aa.step(ARM, changed(Q, 0, np.nan), POSE)),
    (aa.InputError, r"follow takes sequences", lambda: aa.step(ARM, Q, BATCH)),
    (aa.InputError, r"allowed", lambda: aa.step(ARM, Q, POSE, allowed=lambda pose: 3)),
    (aa.InputError, r"allowed", lambda: aa.follow(ARM, BATCH, start=Q, allowed=3)),
    (aa.InputError, r"allowed has shape \(2,\), wanted \(\) or \(3,\)",
     lambda: aa.follow(ARM, BATCH, start=Q, allowed=ARM.feasible(BATCH[:2], GC))),
    (aa.InputError, r"poses has shape \(4, 4\), wanted \(N, 4, 4\)", lambda: aa.follow(ARM, POSE, start=Q)),
    (aa.InputError, r"start has shape \(2, 7\), wanted \(7,\)", lambda: aa.follow(ARM, BATCH, start=[Q, Q])),
    (aa.InputError, r"on_fail is 'go', wanted one of 'stop', 'hold', 'skip'",
     lambda: aa.follow(ARM, BATCH, start=Q, on_fail="go")),
    (aa.InputError, r"pose\[1\] is not orthonormal", lambda: aa.follow(ARM, [POSE, SKEW], start=Q)),
    (aa.InputError, r"intervals has shape \(3,\)", lambda: aa.ArcSet([1.0, 2.0, 3.0])),
    (aa.InputError, r"intervals\[0, 1\] is nan", lambda: aa.ArcSet([[0.0, np.nan]])),
    (aa.InputError, r"intervals\[1\] is \[2.0, 1.0\], wanted upper >= lower",
     lambda: aa.ArcSet([[0, 1], [2, 1.0]])),
    (aa.InputError, r"holds 17 arcs, wanted at most 16",
     lambda: aa.ArcSet(np.arange(17)[:, None] * 0.2 + [[0, 0.1]])),
    (aa.InputError, r"psi is nan", lambda: aa.ArcSet([[0, 1]]).contains(np.nan)),
    (aa.InputError, r"psi of shape \(2,\) does not broadcast",
     lambda: ARM.feasible(BATCH, GC).contains([1.0, 2.0])),
    (aa.InputError, r"do not broadcast", lambda: ARM.feasible(BATCH, GC) & ARM.feasible(BATCH[:2], GC)),
    (aa.InputError, r"index them", lambda: list(ARM.feasible(BATCH, GC))),
    (aa.InputError, r"pose holds NaN", lambda: aa.nearest_rotation(changed(POSE, (0, 0), np.nan))),
    (aa.InputError, r"q is not an array of real numbers", lambda: ARM.forward(["a"] * 7)),
]  # fmt: skip


@pytest.mark.parametrize(("error", "message", "call"), CASES, ids=[message for _, message, _ in CASES])
def test_bad_input_is_named(error: type[Exception], message: str, call: Callable[[], Any]) -> None:
    with pytest.raises(error) as raised:
        call()
    assert re.search(message, str(raised.value)), str(raised.value)
    assert isinstance(raised.value, aa.ArmangleError)


TILTED = ARM.with_tool(aa.pose([0.0, 0.0, 0.1], rpy=[0.3, 0.0, 0.0]))
ASKED: dict[str, Callable[[Any], Any]] = {
    "inverse": lambda pose: ARM.inverse(pose, PSI, GC, limits=False),
    "inverse, many psi": lambda pose: ARM.inverse(pose, [PSI, 0.0], GC, limits=False),
    "inverse_all": lambda pose: ARM.inverse(pose, PSI, limits=False),
    "self_motion": lambda pose: ARM.self_motion(pose, [PSI, 0.0], GC),
    "inverse_derivative": lambda pose: aa.gradients.inverse(ARM, pose, PSI, GC),
    "feasible": lambda pose: ARM.feasible(pose, GC),
    "feasible, many gc": lambda pose: ARM.feasible(pose, [0, 1]),
    "feasible_all": lambda pose: ARM.feasible(pose),
    "psi_towards": lambda pose: ARM.psi_towards(pose, [0, 1], direction="up"),
    "solve": lambda pose: ARM.solve(pose, seed=Q),
    "solve, weighted": lambda pose: ARM.solve(pose, seed=Q, weight=2.0),
    "solve, free roll": lambda pose: ARM.solve(pose, seed=Q, roll="free"),
    "solve, free roll of a tilted tool": lambda pose: TILTED.solve(pose, seed=Q, roll="free"),
    "solve, nearest": lambda pose: ARM.solve(pose, seed=Q, fallback="nearest_pose"),
    "solutions": lambda pose: ARM.solutions(pose, seed=Q),
    "best": lambda pose: ARM.solve(pose, prefer="margin"),
    "reachable": lambda pose: ARM.reachable(pose),
    "freedom": lambda pose: ARM.freedom(pose),
    "feasible_yaw": lambda pose: ARM.feasible_turns(pose, about="base"),
    "feasible_roll": lambda pose: ARM.feasible_turns(pose, about="tool"),
    "from_e1": lambda pose: aa.kuka.from_e1(ARM, pose, 0.2, [0, 1]),
    "e1_arcs": lambda pose: aa.kuka.e1_arcs(ARM, pose, 2),
}


@pytest.mark.parametrize("name", ASKED)
def test_a_pose_is_named_by_its_own_place(name: str) -> None:
    """One pose has none, whatever it is asked with; of a batch it is where the caller's array has it."""
    for pose in (SKEW, changed(POSE, (0, 3), np.nan), MIRRORED):
        with pytest.raises(aa.InputError) as raised:
            ASKED[name](pose)
        assert "pose[" not in str(raised.value)
    batch = np.repeat(np.repeat(POSE[None, None], 3, axis=1), 2, axis=0)[..., None, :, :]
    batch[1, 2, 0] = SKEW
    with pytest.raises(aa.InputError, match=r"rotation of pose\[1, 2(, 0)?\] is not"):
        ASKED[name](batch)


DEGREES = np.degrees(Q)
FRANKA = aa.Arm.from_catalogue("franka_fr3")
OF_FRANKA = np.array([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])


@pytest.mark.parametrize(
    "call",
    [
        lambda: ARM.solve(POSE, seed=DEGREES),
        lambda: ARM.solve(BATCH, seed=[Q, Q, DEGREES]),
        lambda: ARM.solve(POSE, seed=DEGREES, metric="max"),
        lambda: ARM.solve(POSE, seed=DEGREES, fallback="nearest_pose"),
        lambda: ARM.solve(POSE, seed=DEGREES, roll="free"),
        lambda: ARM.solutions(POSE, seed=DEGREES),
        lambda: FRANKA.solve(FRANKA.forward(OF_FRANKA)[0], seed=np.degrees(OF_FRANKA)),
        lambda: aa.Tracker(ARM, dt=0.01).start(DEGREES),
        lambda: aa.plan(ARM, BATCH, start=DEGREES),
        lambda: aa.plan(ARM, BATCH, goal=DEGREES),
        lambda: aa.kuka.from_e1(ARM, POSE, 30.0, 0),
        lambda: aa.kuka.from_frame(ARM, (POSE, 30.0, 0, 0)),
    ],
)
def test_degrees_are_suspected_where_joints_are_beyond_a_turn(call: Callable[[], Any]) -> None:
    with pytest.raises(aa.InputError, match=r"more than a turn outside the limits.*were these degrees\?"):
        call()


def test_a_turn_beyond_the_limits_is_taken() -> None:
    wound = Q + np.array([2 * np.pi, 0, 0, 0, 0, 0, -2 * np.pi])  # an encoder that counts turns
    assert np.array_equal(ARM.solve(POSE, seed=wound).q, ARM.solve(POSE, seed=wound, weight=1.0).q)
    free = ARM.with_(lower=-np.inf, upper=np.inf)
    assert free.solve(POSE, seed=DEGREES).ok  # without limits any number of turns is a posture


def test_one_limit_serves_all_joints() -> None:
    arm = aa.Arm(**LENGTHS, lower=-2.0, upper=2.5, velocity=1.0, acceleration=5)
    assert arm.lower.tolist() == [-2.0] * 7 and arm.upper.tolist() == [2.5] * 7
    assert arm == aa.Arm(**LENGTHS, lower=[-2.0] * 7, upper=[2.5] * 7, velocity=[1.0] * 7, acceleration=5.0)
    with pytest.raises(
        aa.InputError, match=r"lower has shape \(6,\), wanted \(7,\), or a number for all joints"
    ):
        aa.Arm(**LENGTHS, lower=[-2.0] * 6)


def test_the_ends_of_arcs_are_within_the_limits() -> None:
    """By the tolerance that decides everywhere; the last bit is asked for."""
    rng = np.random.default_rng(4)
    q = rng.uniform(ARM.lower, ARM.upper, (200, 7))
    pose, _, gc = ARM.forward(q)
    arcs = ARM.feasible(pose, gc)
    ended = [k for k in range(len(q)) if not arcs[k].is_full and not arcs[k].is_empty]
    ends = np.concatenate(
        [ARM.inverse(pose[k], arcs[k].intervals.ravel(), gc[k], limits=False) for k in ended]
    )
    assert len(ends) > 100 and np.all(ARM.within_limits(ends))
    assert not np.all(ARM.within_limits(ends, tol=0.0))
    assert not ARM.within_limits(np.where(np.arange(7) == 2, ARM.upper + 2e-9, Q))


def test_input_errors_are_value_errors() -> None:
    assert issubclass(aa.InputError, ValueError)
    assert issubclass(aa.MissingExtraError, ImportError)
    assert issubclass(aa.OutputError, OSError)


def test_a_pose_off_by_less_than_a_millionth_is_solved_as_given() -> None:
    almost = POSE.copy()
    almost[0, 0] += 4e-7
    assert np.isfinite(ARM.inverse(almost, PSI, GC, limits=False)).all()
    exact = aa.nearest_rotation(SKEW)
    assert np.abs(exact[:3, :3].T @ exact[:3, :3] - np.eye(3)).max() <= 1e-14
    assert np.isfinite(ARM.inverse(exact, PSI, GC, limits=False)).all()


def test_unreachable_and_limits_may_be_nan_instead() -> None:
    out = ARM.inverse([POSE, FAR], PSI, GC, on_error="nan", limits=False)
    assert np.isfinite(out[0]).all()
    assert np.isnan(out[1]).all()
    tight = ARM.with_(upper=[*ARM.upper[:6], 0.05])
    rows = tight.inverse(POSE, PSI, on_error="nan")
    assert np.array_equal(
        np.isnan(rows).all(-1),
        ~tight.within_limits(np.nan_to_num(ARM.inverse(POSE, PSI, limits=False)), tol=1e-9),
    )


def test_an_arm_is_frozen() -> None:
    with pytest.raises(AttributeError, match="Arm is frozen: d_se cannot be set"):
        ARM.d_se = 1.0
    with pytest.raises(ValueError, match="read-only"):
        ARM.lower[0] = 1.0


@pytest.mark.parametrize("word", ["policy", "seed", "velocity", "lookahead"])
def test_plan_says_which_function_takes_what_it_does_not(word: str) -> None:
    pose = ARM.forward(Q)[0]
    with pytest.raises(aa.InputError, match=rf"plan takes no {word}=: \w"):
        aa.plan(ARM, [pose, pose], **{word: aa.Hold()})
    with pytest.raises(TypeError, match="unexpected"):
        aa.plan(ARM, [pose, pose], nonsense=1)  # type: ignore[call-arg]  # wrong on purpose


def test_a_pose_alone_has_no_inverse_and_is_told_what_has() -> None:
    pose, _, gc = ARM.forward(Q)
    for given in ((), (None, gc)):
        with pytest.raises(aa.InputError, match=r"inverse takes a pose and psi.*solve\(pose, seed=q\)"):
            ARM.inverse(pose, *given, limits=False)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ik", r"'Arm' object has no attribute 'ik': solve\(pose, seed=q\) finds the nearest"),
        ("closest", r"solve\(pose, seed=q\)"),
        ("fkine", r"forward\(q\)"),
        ("nullspace", r"self_motion\(pose, psi, gc\)"),
        ("jacob0", r"jacobian\(q\)"),
        ("plan", r"it is a function: armangle.plan\(arm, ...\)"),
        ("limits", "lower and upper"),
        ("colour", "no attribute 'colour'$"),
    ],
)
def test_names_of_other_libraries_are_told_their_name_here(name: str, words: str) -> None:
    with pytest.raises(AttributeError, match=words) as error:
        getattr(ARM, name)
    assert error.value.name == name  # so that Python suggests what is spelled alike
    assert not hasattr(ARM, name) and getattr(ARM, name, None) is None


def test_methods_that_are_sought_in_the_package_are_told_to_be_of_an_arm() -> None:
    for name in ("solve", "inverse", "forward", "feasible"):
        with pytest.raises(AttributeError, match=rf"no attribute '{name}': it is of an Arm, arm.{name}$"):
            getattr(aa, name)
    wrong = "plann"
    with pytest.raises(AttributeError, match=rf"no attribute '{wrong}'$") as error:
        getattr(aa, wrong)
    assert error.value.name == wrong  # so that Python suggests what is spelled alike
