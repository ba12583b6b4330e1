"""The status of a step that is not OK names the true reason: what would have to go for a step to be there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.strategies import TURN, Array, unlimited

import armangle as aa
from armangle import Status

ARMS = ("kuka_iiwa7_r800", "openarm_v10", "barrett_wam7")
MOST = 0.2
PSI = np.linspace(-np.pi, np.pi, 1440, endpoint=False)
IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])


def turned(q: Array, angle: float) -> Array:
    """The pose of joints q with the tool turned by `angle` (rad) about its own z axis."""
    return IIWA.forward(q)[0] @ aa.pose([0, 0, 0], rpy=[0, 0, angle])


def moves(arm: aa.Arm, q: Array, pose: Array) -> tuple[Array, Array]:
    """The largest joint move (n,) to the pose for each psi and branch on q's side of the straight elbow, and
    the joints (n, 7) there, up to 2π nearest to q.
    """
    gc = arm.forward(q)[2] ^ np.array([0, 1, 4, 5])
    there = arm.inverse(pose, PSI, gc[:, None], limits=False).reshape(-1, 7)
    near = there + TURN * np.round((q - there) / TURN)
    return np.abs(near - q).max(axis=1), near


def inside(arm: aa.Arm, q: Array) -> Array:
    """Whether rows of joints (n, 7) are within the limits."""
    return np.asarray((q >= arm.lower - 1e-9).all(axis=1) & (q <= arm.upper + 1e-9).all(axis=1))


def steps(name: str, count: int) -> Any:
    """Yield arm, joints, one often close to a limit, and the pose of joints within 0.25 rad of them."""
    arm = aa.Arm.from_catalogue(name)
    rng = np.random.default_rng(len(name))
    lower, upper = np.maximum(arm.lower, -TURN), np.minimum(arm.upper, TURN)
    for _ in range(count):
        q = rng.uniform(lower, upper)
        at = rng.integers(7)
        q[at] = rng.choice([lower[at] + 0.01, upper[at] - 0.01, q[at]])
        pose = unlimited(arm).forward(q + rng.uniform(-0.25, 0.25, 7))[0]
        yield arm, q, pose


@pytest.mark.turns(3)
@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_a_status_is_what_brute_force_finds(name: str) -> None:
    """If `step` says JOINT_JUMP or LIMITS, a grid of psi shows that this is what forbids the step."""
    seen = {Status.OK: 0, Status.JOINT_JUMP: 0, Status.LIMITS: 0}
    for arm, q, pose in steps(name, 700):
        now = aa.step(arm, q, pose)
        most, near = moves(arm, q, pose) if now.status != Status.UNREACHABLE else (np.empty(0), np.empty(0))
        seen[now.status] = seen.get(now.status, 0) + 1
        if now.status == Status.OK:
            assert np.abs(now.q - q).max() <= MOST
        if now.status == Status.JOINT_JUMP:  # whatever the limits, the pose forces more
            assert most.min() > MOST - 1e-6
            own = int(arm.forward(q)[2])  # without limits the other side of the elbow may have one
            assert aa.step(unlimited(arm), q, pose, gc=own).status == Status.JOINT_JUMP
        if now.status in (Status.LIMITS, Status.WINDING_EXHAUSTED):
            assert not (inside(arm, near) & (most < MOST - 1e-6)).any()
            wide = aa.step(unlimited(arm), q, pose).status
            some = arm.feasible(pose, arm.forward(q)[2]).status
            assert wide == Status.OK or some == Status.LIMITS
    assert seen[Status.OK] > 100
    assert seen[Status.JOINT_JUMP] > 5
    assert seen[Status.LIMITS] > 5


@pytest.mark.turns(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_nothing_is_refused_that_brute_force_finds(name: str) -> None:
    """Where `step` is refused no joints on a grid of psi are within limits and one step."""
    refused = 0
    for arm, q, pose in steps(name, 700):
        now = aa.step(arm, q, pose)
        if now.status == Status.OK or now.status == Status.UNREACHABLE:
            continue
        refused += 1
        most, near = moves(arm, q, pose)
        assert not (inside(arm, near) & (most < MOST - 1e-6)).any(), now.status
    assert refused > 20


@pytest.mark.parametrize("name", ARMS)
def test_not_allowed_is_what_the_callers_arcs_alone_forbid(name: str) -> None:
    """`step` is NOT_ALLOWED only if it is OK without `allowed` or no allowed psi is feasible."""
    rng = np.random.default_rng(3)
    seen = 0
    for arm, q, pose in steps(name, 400):
        free = aa.step(arm, q, pose)
        lower = rng.uniform(-np.pi, np.pi)
        allowed = aa.ArcSet([[lower, lower + rng.uniform(0.01, 2.0)]])
        now = aa.step(arm, q, pose, allowed=allowed)
        if now.status == Status.NOT_ALLOWED:
            seen += 1
            own = arm.feasible(pose, now.gc)
            assert free.status == Status.OK or (own & allowed).is_empty
        elif free.status == Status.OK:
            assert now.status == Status.OK
            assert now.psi in allowed or min(abs(now.psi - e) for a in allowed for e in a) < 1e-9
    assert seen > 30


def test_a_hand_rolled_past_its_limit_is_told_of_the_limit() -> None:
    """`follow` of a tool that rolls on ends with LIMITS, and `explain` names joint 7 and its limit."""
    q = np.array([0.3, 0.6, -0.2, 1.3, 0.4, 0.9, IIWA.upper[6] - 1e-4])
    path = aa.follow(IIWA, [turned(q, np.radians(k)) for k in np.arange(0, 360, 0.5)], start=q)
    assert path.status[path.first_failure or 0] == Status.LIMITS
    assert "joint 7 would pass its upper limit of 175 deg by" in path.explain()
    assert "jump" not in path.explain().lower()


def test_arcs_of_the_caller_that_leave_nothing_are_named_in_step_follow_and_resolve() -> None:
    """With `allowed` outside all arcs `step`, `follow` and `resolve` are NOT_ALLOWED."""
    pose, psi, gc = IIWA.forward(Q)
    elsewhere = ~IIWA.feasible(pose, gc)
    none = aa.ArcSet() if elsewhere.is_empty else elsewhere & aa.ArcSet([[0.0, 1e-9]])
    assert IIWA.feasible(pose, gc).measure > 1
    for allowed in (none, lambda pose: none):
        assert aa.step(IIWA, Q, pose, allowed=allowed).status is Status.NOT_ALLOWED
        assert aa.follow(IIWA, pose[None], start=Q, allowed=allowed).status[0] == Status.NOT_ALLOWED
        assert aa.resolve(IIWA, pose, psi, gc, allowed=allowed).status is Status.NOT_ALLOWED
    many = aa.resolve(IIWA, np.stack([pose, pose]), psi, gc, allowed=none).status
    assert np.asarray(many).tolist() == [Status.NOT_ALLOWED] * 2
    assert "caller" in aa.follow(IIWA, pose[None], start=Q, allowed=none).explain()


def test_what_fails_without_the_callers_arcs_keeps_its_own_reason() -> None:
    """A pose out of reach is UNREACHABLE with any `allowed`."""
    pose, psi, gc = IIWA.forward(Q)
    far = pose.copy()
    far[0, 3] += 3.0
    assert aa.resolve(IIWA, far, psi, gc, allowed=aa.ArcSet()).status is Status.UNREACHABLE
    assert aa.step(IIWA, Q, far, allowed=aa.ArcSet()).status is Status.UNREACHABLE
