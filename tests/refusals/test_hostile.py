"""Hostile numbers, memory and types are answered right, or refused by an error of armangle."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from support.threads import in_threads

import armangle as aa

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])


@pytest.mark.parametrize(
    ("d_se", "d_ew"), [(0.4, 0.399), (0.4, 0.3999), (0.4, 0.399999), (1e-3, 10), (1e-6, 10)]
)
def test_the_pose_holds_whatever_the_lengths(d_se: float, d_ew: float) -> None:
    """`inverse` gives back the pose for unequal lengths, also stretched and folded."""
    arm = aa.Arm(d_bs=0.34, d_se=d_se, d_ew=d_ew, d_wf=0.126)
    q = np.random.default_rng(1).uniform(-3, 3, (1800, 7))
    q[:, 3] = np.repeat([0.0, 1e-9, np.pi, np.pi + 1e-9, np.pi - 1e-6, 1.0], 300)
    pose, psi, gc = arm.forward(q)
    back, _, _ = arm.forward(arm.inverse(pose, psi, gc, limits=False))
    assert np.abs(back - pose).max() <= 1e-14 * max(1.0, d_ew)


def test_a_reach_that_ends_before_the_shoulder_is_no_folded_arm() -> None:
    """A pose at the shoulder of an arm with unequal links is out of reach, by 200 mm."""
    arm = aa.Arm(d_bs=0.34, d_se=0.4, d_ew=0.6, d_wf=0.0)
    pose = np.eye(4)
    pose[2, 3] = 0.34
    assert arm.feasible(pose, 0).status is aa.Status.UNREACHABLE
    with pytest.raises(aa.UnreachableError, match="out of reach by 200 mm"):
        arm.inverse(pose, 0.0, 0, limits=False)


def test_a_far_base_does_not_refuse_the_stretched_arm() -> None:
    """`inverse` gives back the pose of stretched arms on a base a kilometre away."""
    base = np.eye(4)
    base[:3, 3] = 1000.0, -700.0, 300.0
    arm = IIWA.with_(base=base)
    q = np.random.default_rng(2).uniform(-1, 1, (300, 7))
    q[:, 3] = 0.0
    pose, psi, gc = arm.forward(q)
    assert np.abs(arm.forward(arm.inverse(pose, psi, gc, limits=False))[0] - pose).max() <= 1e-11


def test_stationary_values_are_found_beside_a_singularity() -> None:
    """`joint_function` of joint 1 near a singularity has both stationary psi.

    The slope changes sign at each.
    """
    arm = aa.Arm(d_bs=0.34, d_se=0.4, d_ew=0.3, d_wf=0.0)
    pose = arm.forward([1.92455373, 0, -3.12512316, np.pi + 1e-7, -0.08357272, 0, np.pi - 1e-7])[0]
    f = aa.gradients.joint_function(arm, pose, 2, 1)
    assert f.kind == "stationary" and len(f.stationary) == 2
    for psi in f.stationary:
        assert f.derivative(psi - 1e-3) * f.derivative(psi + 1e-3) < 0


def test_a_packed_record_array_is_read_right() -> None:
    """`inverse` and `feasible` read gc from a field of a packed record array."""
    pose, psi, gc = IIWA.forward(np.tile(Q, (4, 1)))
    packed = np.zeros(4, dtype=[("gc", "i8"), ("flag", "u1")])
    packed["gc"], packed["flag"] = gc, 5
    assert np.array_equal(
        IIWA.inverse(pose, psi, packed["gc"], limits=False), IIWA.inverse(pose, psi, gc, limits=False)
    )
    assert IIWA.feasible(pose, packed["gc"]) == IIWA.feasible(pose, gc)


def test_a_pose_inside_a_packed_message_is_read_right() -> None:
    """`step` and `Tracker.step` read an unaligned pose and point."""
    q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    message = np.zeros((), dtype=[("flag", "u1"), ("pose", "f8", (4, 4)), ("point", "f8", 3)])
    message["pose"], message["point"] = IIWA.forward(q)[0], [1.0, 0.0, 1.0]
    assert not message["pose"].flags.aligned
    assert aa.step(IIWA, q, message["pose"]).status.name == "OK"
    tracker = aa.Tracker(IIWA)
    tracker.start(q)
    assert tracker.step(message["pose"]).status.name == "FOLLOWING"
    assert tracker.step(message["pose"], message["point"]).status.name == "FOLLOWING"


def test_out_may_share_memory_with_the_arguments() -> None:
    """`inverse` with `out` overlapping `seed` gives what it gives otherwise."""
    rng = np.random.default_rng(0)
    arm = aa.Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
    pose, psi, gc = arm.forward(rng.uniform(-60, 60, (64, 7)))
    seeds = rng.uniform(-60, 60, (65, 7))
    want = arm.inverse(pose, psi, gc, seed=seeds[:-1].copy(), limits=False)
    assert np.array_equal(arm.inverse(pose, psi, gc, seed=seeds[:-1], out=seeds[1:], limits=False), want)
    assert np.array_equal(seeds[1:], want)


def test_numbers_of_numpy_are_numbers() -> None:
    """Policies and thread counts may be numbers of NumPy."""
    pose = IIWA.forward(Q)[0]
    policy = aa.Repulsion(K=np.float32(0.5), alpha=np.int64(20))
    assert aa.step(IIWA, Q, pose, policy=policy).status is aa.Status.OK
    assert np.array_equal(in_threads(np.int64(2), lambda: IIWA.forward(Q))[0], pose)


def test_equal_values_have_equal_hashes() -> None:
    """Arc sets and arms that differ in the sign of zero alone are equal, with equal hashes."""
    pairs = [
        (aa.ArcSet([[0.0, 1.0]]), aa.ArcSet([[-0.0, 1.0]])),
        (IIWA.with_(lower=[-0.0] * 7), IIWA.with_(lower=[0.0] * 7)),
    ]
    for a, b in pairs:
        assert a == b and hash(a) == hash(b)


def test_copies_of_a_path_are_read_only() -> None:
    """Pickled and deep copies of a JointPath are equal and read-only."""
    pose = IIWA.forward(Q)[0]
    path = aa.follow(IIWA, [pose] * 3, start=Q)
    for other in (pickle.loads(pickle.dumps(path)), copy.deepcopy(path)):
        assert np.array_equal(other.q, path.q)
        assert not other.q.flags.writeable


def test_a_damaged_pickle_of_arcs_is_refused() -> None:
    """`ArcSet.__setstate__` refuses counts that do not fit the arcs."""
    shape, count, *rest = aa.ArcSet([[0.0, 1.0]]).__getstate__()
    damaged = aa.ArcSet.__new__(aa.ArcSet)
    with pytest.raises(aa.InputError, match="do not belong together"):
        damaged.__setstate__((shape, np.full_like(count, 1000), *rest))
