"""Laws of the second implementation itself: what other tests may lean on."""

from dataclasses import replace

import numpy as np
import pytest
from reference import mended, mended_arcs, mended_joints
from reference.mended_arm import (
    Arm,
    Array,
    flange_pose,
    frames,
    iiwa7,
    jacobian,
    joint_coordinates,
    model_angles,
    pose_of,
    with_limits,
    within_limits,
    wrap,
)

IIWA = iiwa7()
TURN = 2 * np.pi


def frame(rng: np.random.Generator) -> Array:
    """A random rigid transform, shape (4, 4)."""
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    transform = np.eye(4)
    transform[:3, :3] = rotation * np.sign(np.linalg.det(rotation))
    transform[:3, 3] = rng.normal(size=3)
    return transform


def any_arm(seed: int) -> Arm:
    """Arm with random lengths, elbow offsets, joint map, limits, base and tool."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-2, 2, 7) * rng.integers(0, 2, 7)
    half = rng.uniform(0.3, 4, 7)
    d_bs, d_se, d_ew, d_wf = rng.uniform(0.1, 0.5, 4)
    a_3, a_4 = rng.uniform(-0.1, 0.1, 2) * rng.integers(0, 2)
    return Arm(
        d_bs,
        d_se,
        d_ew,
        d_wf,
        a_3,
        a_4,
        signs=rng.choice([-1.0, 1.0], 7),
        offsets=rng.choice([0.0, np.pi / 2, -np.pi / 2, 0.3], 7),
        lower=middle - half,
        upper=middle + half,
        base=frame(rng),
        tool=frame(rng),
    )


def postures(arm: Arm, seed: int) -> list[Array]:
    """Joint coordinates within limits: plain, nearly and exactly singular, and on limits."""
    rng = np.random.default_rng(seed)
    plain = list(rng.uniform(arm.lower, arm.upper, (4, 7)))
    special = []
    for joints in ([1], [3], [5], [1, 3], [1, 3, 5]):
        for tilt in (0.0, 1e-9):
            theta = model_angles(arm, plain[0])
            theta[joints] = tilt
            if 3 in joints:
                theta[3] += arm.straight_angle
            special.append(joint_coordinates(arm, theta))
    return [*plain, *special, arm.lower, arm.upper]


ARMS = [IIWA, *(any_arm(seed) for seed in range(12))]
arms = pytest.mark.parametrize("arm", ARMS, ids=["iiwa7", *(f"arm{k}" for k in range(12))])


@arms
def test_inverse_gives_back_the_pose_in_every_regime(arm: Arm) -> None:
    for q in postures(arm, 1):
        pose, psi, gc = mended.forward(arm, q)
        found = mended.inverse(arm, pose, psi, gc, seed=q)
        assert np.abs(pose_of(arm, found) - pose).max() < 1e-14


@arms
def test_inverse_gives_back_the_joints_of_plain_postures(arm: Arm) -> None:
    for q in postures(arm, 2)[:4]:
        pose, psi, gc = mended.forward(arm, q)
        assert mended.inverse(arm, pose, psi, gc, seed=q) == pytest.approx(q, abs=1e-11)
        for other in range(8):
            found = mended.forward(arm, mended.inverse(arm, pose, psi, other))
            assert found[0] == pytest.approx(pose, abs=1e-14)
            assert abs(wrap(found[1] - psi)) < 1e-11
            assert found[2] == other


@arms
def test_self_motion_keeps_the_tool_still_and_is_the_slope_of_the_inverse(arm: Arm) -> None:
    for q in postures(arm, 3)[:4]:
        pose, psi, gc = mended.forward(arm, q)
        motion = mended_joints.self_motion(arm, pose, psi, gc)
        scale = max(1.0, float(np.abs(motion).max()))
        assert np.abs(jacobian(arm, q) @ motion).max() < 1e-11 * scale
        ends = [mended.inverse(arm, pose, psi + h, gc, seed=q) for h in (-1e-5, 1e-5)]
        assert (ends[1] - ends[0]) / 2e-5 == pytest.approx(motion, rel=1e-4, abs=1e-6)


@arms
def test_joint_functions_are_the_inverse(arm: Arm) -> None:
    pose, psi, gc = mended.forward(arm, postures(arm, 4)[0])
    ring = mended.circle(arm, pose, gc)
    theta = mended.model_solution(ring, psi)
    for joint in mended_joints.PIVOTS:
        u, v = mended_joints.pivot_functions(ring, joint)
        value = np.arctan2(mended.on_circle(u, psi), mended.on_circle(v, psi))
        assert abs(wrap(value - theta[joint - 1])) < 1e-11
    for joint in mended_joints.HINGES:
        h = mended.on_circle(mended_joints.hinge_function(ring, joint), psi)
        assert np.cos(theta[joint - 1]) == pytest.approx(h, abs=1e-14)


@arms
def test_jacobian_is_the_slope_of_the_pose(arm: Arm) -> None:
    q, step = postures(arm, 5)[0], 1e-6
    exact = jacobian(arm, q)
    for i, nudge in enumerate(step * np.eye(7)):
        slope = (pose_of(arm, q + nudge) - pose_of(arm, q - nudge)) / (2 * step)
        spin = slope[:3, :3] @ pose_of(arm, q)[:3, :3].T
        assert slope[:3, 3] == pytest.approx(exact[:3, i], abs=1e-8)
        assert [spin[2, 1], spin[0, 2], spin[1, 0]] == pytest.approx(exact[3:, i], abs=1e-8)


@arms
@pytest.mark.parametrize("gc_4", [-1, 1])
def test_elbow_and_reference_plane_reach_the_wrist_without_joint_3(arm: Arm, gc_4: int) -> None:
    p = mended.wrist_vector(arm, flange_pose(arm, pose_of(arm, postures(arm, 6)[0])))
    theta_4, beta = mended.elbow(arm, float(np.linalg.norm(p)), gc_4)
    azimuth, elevation = np.arctan2(p[1], p[0]), np.arctan2(np.hypot(p[0], p[1]), p[2]) - beta
    chain = frames(arm, np.array([azimuth, elevation, 0.0, theta_4, 0.0, 0.0, 0.0]))
    assert mended.wrist_vector(arm, chain[7]) == pytest.approx(p, abs=1e-14)
    assert mended.virtual_rotation(arm, p, beta) == pytest.approx(chain[3, :3, :3], abs=1e-14)


def test_elbow_says_what_it_cannot_reach() -> None:
    short = replace(IIWA, d_ew=0.3)
    for arm, n in ((IIWA, 0.0), (IIWA, 0.8 + 1e-9), (short, 0.1 - 1e-9)):
        with pytest.raises(mended.NoSolutionError, match="reach is"):
            mended.elbow(arm, n, 1)
    assert mended.elbow(IIWA, 0.8 + 1e-15, 1)[0] == 0.0
    assert mended.elbow(short, short.d_se - short.d_ew, -1)[0] == pytest.approx(np.pi)


def test_windings_follow_range_then_seed_then_middle() -> None:
    lower, upper = np.radians(-260.7), np.radians(71.6)
    arm = with_limits(IIWA, np.full(7, lower), np.full(7, upper))
    q = joint_coordinates(arm, np.radians([170.0, 71.6, 80.0, -100.0, 95.0, 0.0, -180.0]))
    assert np.degrees(q) == pytest.approx([-190.0, 71.6, 80.0, -100.0, 95.0 - 360, 0.0, -180.0])
    assert list(within_limits(arm, q)) == [True, True, False, True, False, True, True]
    wide = with_limits(IIWA, np.full(7, -TURN), np.full(7, TURN))
    theta = np.full(7, 0.5)
    assert joint_coordinates(wide, theta) == pytest.approx(0.5)
    assert joint_coordinates(wide, theta, seed=np.full(7, -9.0)) == pytest.approx(0.5 - TURN)


def has_narrow_pieces(arcs: mended_arcs.Arcs, width: float) -> bool:
    """Whether an arc or a gap is narrower than a width, rad."""
    gaps = [(b[0] - a[1]) % TURN for a, b in zip(arcs, arcs[1:] + arcs[:1], strict=True)]
    return any(high - low < width for low, high in arcs) or any(gap < width for gap in gaps)


def jumps_at(ring: mended.Circle, psi: Array) -> Array:
    """Whether theta_2 or theta_6 vanishes at an arm angle alone, where other joints jump by half a turn.

    At that very angle they have no value of their own, and rounding picks one.
    """
    here, beside = (np.sin(mended.model_solution(ring, at)[..., [1, 5]]) for at in (psi, psi + 1e-3))
    return ((np.abs(here) < 1e-9) & (np.abs(beside) > 1e-6)).any(axis=-1)


@pytest.mark.slow
@arms
@pytest.mark.parametrize("margin", [0.0, 0.2])
def test_feasible_arcs_are_where_the_joints_keep_their_limits(arm: Arm, margin: float) -> None:
    rng = np.random.default_rng(7)
    for q in postures(arm, 8):
        pose = pose_of(arm, q)
        for gc in range(8):
            status, arcs = mended_arcs.feasible(arm, pose, gc, margin)
            assert (status == "OK") == bool(arcs)
            ends = np.ravel(arcs) if arcs != mended_arcs.FULL else np.zeros(0)
            middles = [0.5 * (low + high) for low, high in arcs]
            psi = np.concatenate([rng.uniform(-np.pi, np.pi, 60), middles, ends + 1e-5, ends - 1e-5])
            if len(ends):
                psi = psi[np.abs(wrap(psi[:, None] - ends)).min(axis=1) > 3e-6]
            ring = mended.circle(arm, pose, gc)
            psi = psi[~jumps_at(ring, psi)]
            tried = mended_arcs.allowed_at(arm, ring, psi, margin)
            assert list(tried) == [mended_arcs.contains(arcs, float(x)) for x in psi]


@pytest.mark.slow
@arms
def test_closed_form_arcs_are_those_found_by_sampling(arm: Arm) -> None:
    compared = 0
    for q in postures(arm, 9)[:4]:
        pose = pose_of(arm, q)
        for gc in range(8):
            status, arcs = mended_arcs.feasible(arm, pose, gc)
            if status in ("OK", "LIMITS") and not has_narrow_pieces(arcs, 0.01):
                sampled = mended_arcs.feasible_by_sampling(arm, pose, gc)
                assert len(sampled) == len(arcs)
                assert np.ravel(sampled) == pytest.approx(np.ravel(arcs), abs=1e-6)
                compared += 1
    assert compared > 0


@arms
def test_forward_of_joints_within_limits_lies_in_its_arcs(arm: Arm) -> None:
    """Also at singular postures and in corners of the limits, but for isolated arm angles."""
    for k, q in enumerate(postures(arm, 10)):
        pose, psi, gc = mended.forward(arm, q)
        arcs = mended_arcs.feasible(arm, pose, gc)[1]
        ring = mended.circle(arm, pose, gc)
        beside = mended_arcs.allowed_at(arm, ring, psi + np.array([-1e-5, 1e-5])).any()
        near = any(mended_arcs.contains(arcs, psi + h) for h in (-1e-6, 0.0, 1e-6))
        assert mended_arcs.contains(arcs, psi) or (k >= 4 and (near or not beside))


def test_locked_joints_are_zero_and_their_partners_take_the_turn() -> None:
    """Lengths without rounding: one ulp short of stretched, the circle is not locked."""
    arm, candle = Arm(0.25, 0.5, 0.5, 0.125), np.array([0.4, 0.0, 0.5, 0.0, 0.3, 0.0, -0.7])
    pose, _, gc = mended.forward(arm, candle)
    ring = mended.circle(arm, pose, gc)
    assert ring.shoulder_locked
    assert ring.wrist_locked
    theta = mended.model_solution(ring, np.linspace(-3, 3, 13))
    assert theta[:, [0, 1, 3, 4, 5]] == pytest.approx(0.0, abs=1e-15)
    assert wrap(theta[:, 2] + theta[:, 6] - 0.5) == pytest.approx(0.0, abs=1e-14)
    assert mended_joints.derivative(ring, 3, 0.3) == pytest.approx(1.0)
    assert mended_joints.derivative(ring, 7, 0.3) == pytest.approx(-1.0)
    assert pose_of(arm, theta[3]) == pytest.approx(pose, abs=1e-15)


def test_a_limit_that_only_touches_neither_opens_nor_closes_an_arc() -> None:
    pose, _, gc = mended.forward(IIWA, np.array([0.3, 0.7, 0.2, -1.2, 0.4, 1.0, 0.5]))
    ring = mended.circle(IIWA, pose, gc)
    a, b, c = mended_joints.hinge_function(ring, 2)
    nearest, farthest = np.arccos(c + np.hypot(a, b)), np.arccos(c - np.hypot(a, b))
    for low, high, wanted in ((nearest, farthest, TURN), (-1.0, nearest, 0.0), (farthest, 3, 0.0)):
        arcs = mended_arcs.hinge_arcs(ring, 2, float(low), float(high), 0.0)
        assert mended_arcs.measure(arcs) == pytest.approx(wanted, abs=2e-4)
        for psi in np.ravel(arcs):
            theta = mended.model_solution(ring, float(psi))[1]
            assert low - 1e-9 <= theta <= high + 1e-9 or abs(psi) == np.pi


def test_margin_ends_where_the_sine_of_a_hinge_is_that_of_the_margin() -> None:
    pose = pose_of(IIWA, np.array([0.3, 0.7, 0.2, -1.2, 0.4, 1.0, 0.5]))
    free, margin = replace(IIWA, lower=np.full(7, -np.inf), upper=np.full(7, np.inf)), 0.75
    status, arcs = mended_arcs.feasible(free, pose, 2, margin)
    assert status == "OK"
    assert arcs != mended_arcs.FULL
    for psi in np.ravel(arcs):
        theta = mended.model_solution(mended.circle(free, pose, 2), psi)
        assert np.abs(np.sin(theta[[1, 5]])).min() == pytest.approx(np.sin(margin), abs=1e-9)
    assert mended_arcs.feasible(free, pose, 2, 1.3) == ("ELBOW_MARGIN", [])


@pytest.mark.parametrize("offset", [0.0, 0.045])
def test_jacobian_loses_rank_at_the_listed_postures_alone(offset: float) -> None:
    arm = replace(IIWA, a_3=offset, a_4=-0.7 * offset)
    straight, right = arm.straight_angle, np.pi / 2
    singular: list[dict[int, float]] = [
        {3: straight},
        {3: straight - np.pi},
        {1: 0.0, 2: right},
        {1: 0.0, 2: -right},
        {5: 0.0, 4: right},
        {5: 0.0, 4: -right},
        {1: 0.0, 5: 0.0},
    ]
    for changes, lost in [*((s, True) for s in singular), ({}, False), ({1: 0.0}, False)]:
        q = np.array([0.4, 0.7, 0.9, 1.1, 0.5, 0.8, 0.6])
        q[list(changes)] = list(changes.values())
        least = np.linalg.svd(jacobian(arm, q), compute_uv=False)[-1]
        assert (least < 1e-15) == lost
        assert lost or least > 0.01


def test_arcs_intersect_on_the_circle() -> None:
    across, left = [(3.0, 3.5)], [(-np.pi, -2.9)]
    assert mended_arcs.intersect([across, left]) == left
    assert mended_arcs.intersect([across, mended_arcs.FULL]) == [pytest.approx((3.0, 3.5))]
    assert mended_arcs.intersect([across, []]) == []
    assert mended_arcs.intersect([[(0.0, 1.0)], [(1.0, 2.0)]]) == []
    assert mended_arcs.intersect([mended_arcs.FULL] * 2) == mended_arcs.FULL


def test_resolution_stays_in_its_arc_and_knows_the_special_cases() -> None:
    arcs = [(-2.0, -1.0), (2.5, 4.0)]
    for psi in np.linspace(2.5, 4.0, 31):
        moved = mended_arcs.resolve(float(psi), arcs, 1.0, 3.0)
        assert moved is not None
        assert mended_arcs.contains([arcs[1]], moved)
    assert mended_arcs.resolve(-0.9, arcs, 0.5, 20.0) == -1.0
    assert mended_arcs.resolve(0.0, [(-2.0, -1.0), (1.0, 2.0)], 0.5, 20.0) == 1.0
    assert mended_arcs.resolve(0.0, arcs, 0.5, 20.0, outside="stop") is None
    assert mended_arcs.resolve(0.0, [], 0.5, 20.0) is None
    assert mended_arcs.resolve(1.0, [(1.0, 1.0)], 0.5, 20.0) == 1.0
    half, whole = mended_arcs.gain_per_step(3.0, 0.1), mended_arcs.gain_per_step(3.0, 0.2)
    assert (1 - half) ** 2 == pytest.approx(1 - whole)


def test_elbow_is_carried_past_the_base_axis_where_psi_is_not() -> None:
    rotation = pose_of(IIWA, np.array([0.3, 0.7, 0.2, -1.2, 0.4, 1.0, 0.5]))[:3, :3]
    poses = np.tile(np.eye(4), (41, 1, 1))
    poses[:, :3, :3] = rotation
    poses[:, :3, 3] = 0.126 * rotation[:, 2] + [1e-4, 0.0, 0.9]
    poses[:, 1, 3] += np.linspace(-0.01, 0.01, 41)
    held = [mended.inverse(IIWA, pose, 0.5, 2) for pose in poses]
    carried = held[:1]
    for pose in poses[1:]:
        psi = mended_arcs.carried_by_elbow(IIWA, carried[-1], pose)
        carried.append(mended.inverse(IIWA, pose, psi, 2, seed=carried[-1]))
    jumps = [np.degrees(np.abs(wrap(np.diff(path, axis=0))).max()) for path in (held, carried)]
    assert jumps[0] == pytest.approx(79, abs=1)
    assert jumps[1] < 1
    _, psi, _ = mended.forward(IIWA, carried[5])
    assert mended_arcs.carried_by_elbow(IIWA, carried[5], poses[5]) == pytest.approx(psi)
