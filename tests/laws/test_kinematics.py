"""Forward, inverse, Jacobian and self-motion: laws over arms, regimes and batch shapes."""

from __future__ import annotations

import numpy as np
import pytest
from support import draw
from support.laws import JOINT, POSE, gap, is_regular
from support.strategies import (
    Array,
    all_arms,
    arms,
    bends,
    finite_limits,
    frame,
    in_every_regime,
    joint_values,
    postures,
    unlimited,
)  # fmt: skip

import armangle as aa

N = draw.count(200)
any_arm = pytest.mark.parametrize("arm", all_arms(), ids=lambda arm: arm.name)
SHAPES = [(), (1,), (5,), (3, 4), (2, 1, 3)]
EMPTY = [(0,), (2, 0), (0, 3)]


def sample(arm: aa.Arm, regime: str, seed: int = 0, n: int = N) -> tuple[Array, Array, Array, Array]:
    """At most n joints of a regime, and their pose, psi and gc."""
    q = postures(arm, regime, n, seed)
    return q, *arm.forward(q)


@pytest.mark.turns(2)
@pytest.mark.core
@any_arm
@in_every_regime
def test_the_pose_is_kept(arm: aa.Arm, regime: str) -> None:
    """`forward` of `inverse` gives the pose, in its branch and at any psi in all branches."""
    q, pose, psi, gc = sample(arm, regime)
    back = arm.inverse(pose, psi, gc, seed=q, limits=False)
    assert gap(arm.forward(back, on_error="nan")[0], pose) <= POSE
    rows = arm.inverse(pose, draw.generator(5).uniform(-10, 10, len(pose)), limits=False)
    assert gap(arm.forward(rows, on_error="nan")[0], pose[:, None]) <= POSE


@pytest.mark.core
@any_arm
@in_every_regime
def test_joints_come_back(arm: aa.Arm, regime: str) -> None:
    """`inverse` of `forward` gives the joints back, if they are not singular."""
    free = unlimited(arm)
    q, pose, psi, gc = sample(free, regime, seed=2)
    regular = is_regular(arm, q, pose)
    assert gap(free.inverse(pose, psi, gc, seed=q, limits=False)[regular], q[regular]) <= JOINT


@pytest.mark.turns(2)
@any_arm
@pytest.mark.parametrize("regime", ["uniform", "on_limit"])
def test_joints_within_limits_come_back_within_limits(arm: aa.Arm, regime: str) -> None:
    """`inverse` of `forward` gives joints back within limits, if they are not singular."""
    q, pose, psi, gc = sample(arm, regime, seed=3)
    regular = is_regular(arm, q, pose)
    assert regular.any()
    back = arm.inverse(pose, psi, gc, seed=q, limits=False)[regular]
    assert gap(back, q[regular]) <= JOINT
    assert arm.within_limits(back, tol=JOINT).all()


@any_arm
def test_rows_without_gc_are_the_configurations(arm: aa.Arm) -> None:
    """`inverse` without gc has a row for each branch, which `forward` confirms."""
    q, pose, psi, _ = sample(arm, "uniform", seed=4)
    rows = arm.inverse(pose, psi, limits=False)
    for gc in range(8):
        assert np.array_equal(rows[:, gc], arm.inverse(pose, psi, gc, limits=False))
    regular = is_regular(arm, q, pose)  # else rounding may turn the sign of a bend that is 0
    _, psi_again, gc_again = arm.forward(rows[regular])
    assert np.array_equal(gc_again, np.broadcast_to(np.arange(8), gc_again.shape))
    turned = np.abs(np.sin((psi_again - psi[regular, None]) / 2)).max(initial=0)
    assert turned <= JOINT


@any_arm
def test_the_index_is_the_signs(arm: aa.Arm) -> None:
    """gc is the signs of the sines of theta_2, theta_4 - delta and theta_6, and back."""
    q, _, _, gc = sample(arm, "uniform", seed=5)
    sines = np.sin(bends(arm, q))
    clear = (np.abs(sines) > 1e-12).all(-1)
    assert np.array_equal(aa.gc_signs(gc)[clear], np.sign(sines)[clear])
    assert np.array_equal(aa.gc_index(aa.gc_signs(gc)), gc)


def test_the_index_counts_zero_as_positive() -> None:
    """A sine of 0 or -0.0 counts as positive in gc, and the least below 0 as negative."""
    arm = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1)
    assert arm.forward(np.zeros(7))[2] == 0
    assert arm.forward([0, np.pi, 0, 1, 0, -0.0, 0])[2] == 0
    assert arm.forward([0, -1e-300, 0, -1e-3, 0, -1e-300, 0])[2] == 7


@any_arm
@in_every_regime
def test_the_jacobian_is_the_difference_quotient(arm: aa.Arm, regime: str) -> None:
    """`jacobian` equals differences of `forward`."""
    q = postures(arm, regime, draw.count(20), 6)
    step = 1e-6
    jacobian = arm.jacobian(q)
    for j in range(7):
        e = step * np.eye(7)[j]
        ahead, behind = (arm.forward(q + s * e, on_error="nan")[0] for s in (1, -1))
        linear = (ahead - behind)[:, :3, 3] / (2 * step)
        here = arm.forward(q, on_error="nan")[0][:, :3, :3]
        turn = (ahead - behind)[:, :3, :3] / (2 * step) @ here.swapaxes(1, 2)
        angular = np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=-1)
        assert gap(jacobian[:, :, j], np.concatenate([linear, angular], axis=-1)) <= 1e-8


@any_arm
@in_every_regime
def test_self_motion_leaves_the_tool(arm: aa.Arm, regime: str) -> None:
    """The Jacobian takes `self_motion` to 0, and joint 4 does not move."""
    _, pose, psi, gc = sample(arm, regime, seed=7)
    rate = arm.self_motion(pose, psi, gc)
    posture = arm.inverse(pose, psi, gc, limits=False)
    finite = np.where(np.isfinite(rate), rate, 0.0)
    moved = np.abs(np.einsum("nij,nj->ni", arm.jacobian(posture), finite)).max(axis=-1)
    long = arm.geometry.reach + np.linalg.norm(arm.tool[:3, 3]) + np.linalg.norm(arm.base[:3, 3])
    size = max(1.0, long) * np.maximum(1.0, np.abs(rate).max(axis=-1))
    # rounding of the pose is 1 / |sin| as large in the joints of a bend, and the rates move the tool by that
    sine = np.abs(np.sin(bends(arm, posture)))[:, [0, 2]].min(axis=-1)
    known = sine >= 1e-5
    assert (moved[known] <= 1e-12 * size[known] / sine[known]).all()
    assert np.isfinite(rate[known]).all()
    assert np.array_equal(rate[:, 3], np.zeros(len(rate)))


@any_arm
@in_every_regime
def test_self_motion_is_the_difference_quotient(arm: aa.Arm, regime: str) -> None:
    """`self_motion` equals differences of `inverse` along psi."""
    free = unlimited(arm)
    q, pose, psi, gc = sample(free, regime, seed=8)
    regular = np.abs(np.sin(bends(arm, q)))[:, [0, 2]].min(-1) > 1e-2
    pose, psi, gc = pose[regular], psi[regular], gc[regular]
    step = 1e-5
    here = free.inverse(pose, psi, gc, limits=False)
    ahead, behind = (free.inverse(pose, psi + s * step, gc, seed=here, limits=False) for s in (1, -1))
    assert gap((ahead - behind) / (2 * step), free.self_motion(pose, psi, gc)) <= 1e-3


def test_self_motion_where_it_does_not_exist() -> None:
    """`self_motion` is finite if singular for all psi, and infinite or beyond 1e6 if for one."""
    arm = aa.Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
    straight = arm.forward(np.zeros(7))  # on the whole circle: a convention, finite
    rate = arm.self_motion(*straight)
    assert np.isfinite(rate).all()
    assert gap(arm.jacobian(arm.inverse(*straight, limits=False)) @ rate, np.zeros(6)) <= 1e-12
    at = arm.forward([0.3, 0.0, 0.2, -1.0, 0.4, 0.7, 0.0])  # theta_2 = 0 at one psi only
    rate = arm.self_motion(*at)
    assert np.isinf(rate[:3]).all() or np.abs(rate[:3]).max() > 1e6
    assert np.isfinite(rate[3:]).all()


def _wide(arm: aa.Arm) -> aa.Arm:
    """The arm with limits several revolutions wide."""
    lower, upper = finite_limits(arm)
    return arm.with_(lower=lower - 14, upper=upper + 15)


@any_arm
def test_a_seed_chooses_the_winding(arm: aa.Arm) -> None:
    """`inverse` with a seed gives each joint the turn nearest to the seed."""
    wide = _wide(arm)
    rng = draw.generator(9)
    q = postures(arm, "uniform", N, 9) + 2 * np.pi * rng.integers(-1, 2, (N, 7))
    pose, psi, gc = wide.forward(q)
    regular = is_regular(arm, q, pose)
    seed = q + rng.uniform(-3, 3, q.shape)
    assert gap(wide.inverse(pose, psi, gc, seed=seed, limits=False)[regular], q[regular]) <= JOINT


@any_arm
def test_without_a_seed_the_middle_of_the_range_is_near(arm: aa.Arm) -> None:
    """`inverse` without a seed gives each joint the turn nearest to the middle of its range."""
    wide = _wide(arm)
    _, pose, psi, gc = sample(arm, "uniform", seed=10)
    middle = (wide.lower + wide.upper) / 2
    assert np.array_equal(
        wide.inverse(pose, psi, gc, limits=False), wide.inverse(pose, psi, gc, seed=middle, limits=False)
    )
    assert (np.abs(wide.inverse(pose, psi, gc, limits=False) - middle) <= np.pi + JOINT).all()
    free = unlimited(arm).inverse(pose, psi, gc, limits=False)
    assert (np.abs(free) <= np.pi + JOINT).all()
    assert gap(np.sin(free - wide.inverse(pose, psi, gc, limits=False)), np.zeros((N, 7))) <= JOINT


def test_a_range_beyond_half_a_turn_is_no_full_turn() -> None:
    """`inverse` finds a joint below -180 degrees if its range goes there."""
    arm = aa.Arm.from_catalogue("barrett_wam7")  # joint 5: -260.7 to 71.62 degrees
    q = np.radians([10, 20, 30, 90, -200, 40, 50.0])
    pose, psi, gc = arm.forward(q)
    assert gap(arm.inverse(pose, psi, gc, limits=False), q) <= JOINT
    assert gap(unlimited(arm).inverse(pose, psi, gc, limits=False)[4] - q[4], 2 * np.pi) <= JOINT


def test_outside_every_winding_the_nearest_to_the_range_is_returned() -> None:
    """`inverse` gives a joint that no turn brings within limits the turn nearest to them."""
    narrow = aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1, lower=[3.2] + 6 * [-3], upper=[3.7] + 6 * [3])
    for angle, wanted in ((1.0, 1.0 + 2 * np.pi), (0.0, 2 * np.pi), (-2.9, -2.9 + 4 * np.pi - 2 * np.pi)):
        q = np.array([angle, 0.5, 0.2, 0.9, 0.1, 0.7, 0.3])
        back = narrow.inverse(*narrow.forward(q), limits=False)
        low, high = 3.2 - back[0], back[0] - 3.7
        for turn in (-2 * np.pi, 2 * np.pi):
            assert max(low, high) <= max(low - turn, high + turn) + JOINT
        assert abs(np.sin((back[0] - wanted) / 2)) <= JOINT


def answers(arm: aa.Arm, q: Array, pose: Array, psi: Array, gc: Array) -> list[Array]:
    """All other functions of an arm at joints."""
    return [
        arm.inverse(pose, psi, gc, limits=False),
        arm.inverse(pose, psi, gc, seed=q, limits=False),
        arm.jacobian(q),
        arm.inverse(pose, psi, limits=False),
        arm.self_motion(pose, psi, gc),
        arm.limit_margin(q),
        arm.within_limits(q),
        arm.frames(q),
        arm.elbow(q),
        arm.psi_towards(pose, gc, direction="up"),
    ]


@pytest.mark.turns(4)
@pytest.mark.core
@any_arm
@pytest.mark.parametrize("shape", SHAPES + EMPTY, ids=str)
def test_batches_are_their_elements_bit_for_bit(arm: aa.Arm, shape: tuple[int, ...]) -> None:
    count = int(np.prod(shape))
    flat = postures(arm, "uniform", max(count, 1), 11)[:count]
    q = flat.reshape(*shape, 7)
    pose, psi, gc = arm.forward(q)
    assert (pose.shape, psi.shape, gc.shape) == ((*shape, 4, 4), shape, shape)
    assert (pose.dtype, psi.dtype, gc.dtype) == (np.float64, np.float64, np.int64)
    outputs = [pose, psi, gc, *answers(arm, q, pose, psi, gc)]
    for index in np.ndindex(shape):
        one = arm.forward(q[index])
        for many, single in zip(outputs, [*one, *answers(arm, q[index], *one)], strict=True):
            assert np.array_equal(many[index], single)
    assert [np.shape(x) for x in outputs[3:6]] == [(*shape, 7), (*shape, 7), (*shape, 6, 7)]
    wanted = [(*shape, 8, 7), (*shape, 7), shape, shape, (*shape, 8, 4, 4), (*shape, 3), shape]
    assert [np.shape(x) for x in outputs[6:]] == wanted


def test_arguments_broadcast() -> None:
    """The arguments of `inverse` broadcast."""
    arm = arms()[0]
    q, pose, _, _ = sample(arm, "uniform", seed=12, n=4)
    psi, gc = np.linspace(-9, 9, 5)[:, None, None], np.array([[1], [6]])
    out = arm.inverse(pose, psi, gc, seed=q[0], limits=False)
    assert out.shape == (5, 2, 4, 7)
    for i, j, k in np.ndindex(5, 2, 4):
        assert np.array_equal(
            out[i, j, k], arm.inverse(pose[k], psi[i, 0, 0], gc[j, 0], seed=q[0], limits=False)
        )


def test_strided_and_reversed_arrays_are_their_copies() -> None:
    """`inverse` and `forward` take strided, reversed, Fortran and byte-swapped arrays and lists."""
    arm = arms()[3]
    q, pose, psi, gc = sample(arm, "uniform", seed=13, n=40)
    plain = arm.inverse(pose, psi, gc, limits=False)
    assert np.array_equal(arm.inverse(pose[::-2], psi[::-2], gc[::-2], limits=False), plain[::-2])
    turned = np.asfortranarray(pose)
    assert np.array_equal(arm.inverse(turned, psi, gc, limits=False), plain)
    assert np.array_equal(arm.forward(np.asfortranarray(q))[0], pose)
    assert np.array_equal(arm.inverse(pose.tolist(), psi.tolist(), gc.tolist(), limits=False), plain)
    assert np.array_equal(arm.inverse(pose.astype(">f8"), psi, gc.astype(np.uint8), limits=False), plain)


def test_a_wrist_on_the_shoulder_has_no_arm_angle() -> None:
    """With the wrist on the shoulder psi is NaN on request, else `forward` and `inverse` raise."""
    arm = aa.Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
    q = joint_values(arm, np.array([0.1, 0.2, 0.3, np.pi, 0.5, 0.6, 0.7]))
    pose, psi, _ = arm.forward(q, on_error="nan")
    assert np.isnan(psi)
    with pytest.raises(aa.UnreachableError, match="lies on the shoulder: the arm is folded"):
        arm.forward(q)
    with pytest.raises(aa.UnreachableError, match="lies on the shoulder: the arm is folded"):
        arm.inverse(pose, 0.0, 0, limits=False)
    assert np.isnan(arm.inverse(pose, 0.0, 0, on_error="nan", limits=False)).all()


TWIST = (-np.pi / 2, np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, np.pi / 2, 0.0)


def dh(theta: float, alpha: float, d: float, a: float) -> Array:
    """Return the transform (4, 4) of a row of DH parameters, Eq. (1)."""
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


@any_arm
def test_frames_are_those_of_the_dh_rows(arm: aa.Arm) -> None:
    """`frames` are the products of the rows of DH parameters."""
    d = (arm.geometry.d_bs, 0, arm.geometry.d_se, arm.geometry.d_4, arm.geometry.d_ew, 0, arm.geometry.d_wf)
    a = (0, 0, arm.geometry.a_3, arm.geometry.a_4, 0, 0, 0)
    q = np.random.default_rng(3).uniform(-2, 2, (6, 7))
    frames = arm.frames(q)
    for one, joints in zip(frames, q, strict=True):
        by_hand = [arm.base]
        for theta, row in zip(
            arm.geometry.signs * joints + arm.geometry.offsets, zip(TWIST, d, a, strict=True), strict=True
        ):
            by_hand.append(by_hand[-1] @ dh(theta, *row))
        assert gap(one, np.array(by_hand)) <= 2e-14
    assert gap(frames[:, 7] @ arm.tool, arm.forward(q)[0]) <= 1e-14


@any_arm
def test_a_tool_is_mounted_on_the_present_tip(arm: aa.Arm) -> None:
    """`with_tool` mounts on the present tip, `with_(tool=)` replaces the tool."""
    rng = np.random.default_rng(5)
    tool, q = frame(rng), rng.uniform(-2, 2, (200, 7))
    longer = arm.with_tool(tool)
    assert gap(longer.forward(q)[0], arm.forward(q)[0] @ tool) <= 2e-14
    assert longer.with_(tool=arm.tool) == arm and arm.with_tool(np.linalg.inv(tool)) != longer
    assert np.array_equal(arm.with_(tool=tool).frames(q), arm.frames(q))
    assert gap(arm.with_(tool=tool).tool, tool) <= 1e-15
