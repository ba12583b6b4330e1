"""Where a formula of the paper slips: what it gives, and what holds instead."""

from dataclasses import replace

import numpy as np
import pytest
from reference import mended, mended_arcs, mended_joints, paper
from reference import paper_limits as limits
from reference.mended_arm import Arm, iiwa7, pose_of, with_limits, wrap
from reference.paper import IIWA7, Array

ARM = iiwa7()
START = paper.THETA_START
STRAIGHT = np.array([0.4, 0.9, -0.3, 0.0, 0.2, 0.8, 0.1])
"""A stretched posture of iiwa 7, rad, shape (7,)."""


def ring_of(arm: Arm, q: Array) -> mended.Circle:
    """Redundancy circle through joint coordinates (7,)."""
    pose, _, gc = mended.forward(arm, q)
    return mended.circle(arm, pose, gc)


def pivot_terms(ring: mended.Circle, joint: int) -> tuple[limits.Linear, limits.Linear]:
    """Coefficients (n, d) of Eq. (26), without GC sign, from a mended circle."""
    shoulder = ring.shoulder[0], ring.shoulder[1], ring.shoulder[2]
    return limits.pivot_coefficients(joint, shoulder, (ring.wrist[0], ring.wrist[1], ring.wrist[2]))


def pose_error(q: Array, pose: Array) -> float:
    """Largest difference of the entries of two poses, m or 1."""
    return float(np.abs(pose_of(ARM, q) - pose).max())


@pytest.mark.parametrize(("d_ew", "is_half"), [(0.4, True), (0.3, False)])
def test_section_3_1_centre_of_the_circle_is_half_way_only_for_equal_links(
    d_ew: float, is_half: bool
) -> None:
    arm = replace(ARM, d_ew=d_ew)
    pose, _, gc = mended.forward(arm, START)
    p = mended.wrist_vector(arm, pose)
    elbows = [
        arm.d_se * mended.on_circle(mended.circle(arm, pose, gc).shoulder, psi)[:, 1]
        for psi in np.linspace(-np.pi, np.pi, 8, endpoint=False)
    ]
    fraction = np.mean(elbows, axis=0) @ p / (p @ p)
    holds = (arm.d_se**2 - arm.d_ew**2 + p @ p) / (2 * p @ p)
    assert fraction == pytest.approx(holds, abs=1e-14)
    assert (abs(fraction - paper.circle_centre_fraction()) < 1e-14) == is_half


def test_gc_3_of_the_example_counts_the_negative_signs_of_shoulder_and_elbow() -> None:
    assert [mended.gc_signs(k) for k in range(8)] == [
        (1, 1, 1),
        (-1, 1, 1),
        (1, -1, 1),
        (-1, -1, 1),
        (1, 1, -1),
        (-1, 1, -1),
        (1, -1, -1),
        (-1, -1, -1),
    ]
    assert mended.gc_index(ARM, START) == 3


def test_eq_4_loses_half_the_digits_on_a_nearly_straight_arm() -> None:
    errors = []
    for ulps in range(1, 41):
        n = ARM.reach - ulps * np.spacing(0.5)
        holds = np.sqrt(8 * (ARM.reach - n) / ARM.reach)
        printed = paper.theta_4(np.array([0.0, 0.0, n]), 1, IIWA7)
        errors.append((abs(printed / holds - 1), abs(mended.elbow(ARM, n, 1)[0] / holds - 1)))
    assert max(e[0] for e in errors) > 0.01
    assert max(e[1] for e in errors) < 1e-14


def test_eq_5_with_the_axis_of_the_nomenclature_blanks_a_plain_pose() -> None:
    p = np.array([0.0, 0.5, 0.0])
    third_column_of_0r1 = paper.chain_transforms(np.zeros(7), IIWA7)[1][:3, 2]
    assert third_column_of_0r1 == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)
    assert paper.theta_1_virtual(p, np.array([0.0, 1.0, 0.0])) == 0.0
    assert paper.theta_1_virtual(p, np.array([0.0, 0.0, 1.0])) == np.pi / 2
    assert mended.reference_axis(ARM, p) == pytest.approx([1.0, 0.0, 0.0])


def test_eq_10_has_no_sign_at_pi() -> None:
    normal, p_26 = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.7])
    assert paper.arm_angle(normal, -normal, p_26) == 0.0
    assert mended.angle_about(np.array([0.0, 0.0, 1.0]), normal, -normal) == np.pi


def test_eqs_8_to_11_have_no_arm_angle_on_a_straight_arm() -> None:
    along = np.array([0.0, 0.0, 0.4])
    assert not paper.sew_normal(np.zeros(3), along, 2 * along).any()
    pose, psi, gc = mended.forward(ARM, STRAIGHT)
    assert np.abs(mended.inverse(ARM, pose, psi, gc) - STRAIGHT).max() < 1e-7
    assert pose_error(mended.inverse(ARM, pose, psi, gc), pose) < 1e-14


def test_eq_15_needs_the_transpose_in_c_s() -> None:
    w = mended.wrist_vector(ARM, pose_of(ARM, START))
    w /= np.linalg.norm(w)
    with pytest.raises(ValueError, match="matmul"):
        np.matmul(w[:, None], w[:, None])
    ring = ring_of(ARM, START)
    _, b_s, c_s = ring.shoulder
    rotation = b_s + c_s
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-14)
    scalar_product = b_s + (w @ w) * rotation
    assert np.abs(scalar_product @ scalar_product.T - np.eye(3)).max() > 0.5


@pytest.mark.parametrize("joint", [2, 6])
def test_eqs_19_and_24_lose_the_pose_near_a_singular_posture(joint: int) -> None:
    worst: dict[float, tuple[float, float]] = {}
    for tilt in (1e-3, 1e-9, 0.0):
        errors = []
        for q in np.random.default_rng(19).uniform(-2.0, 2.0, (40, 7)):
            q[joint - 1] = tilt
            pose, psi, gc = mended.forward(ARM, q)
            printed = paper.inverse(pose, psi, mended.gc_signs(gc), IIWA7)
            holds = mended.inverse(ARM, pose, psi, gc)
            errors.append((pose_error(printed, pose), pose_error(holds, pose)))
        worst[tilt] = (max(e[0] for e in errors), max(e[1] for e in errors))
    assert worst[1e-3][0] < 1e-11
    assert 1e-8 < worst[1e-9][0] < 1e-5
    assert worst[0.0][0] > 0.1
    assert max(holds for _, holds in worst.values()) < 1e-14


@pytest.mark.parametrize("joint", [1, 3, 5, 7])
def test_eq_29_has_the_wrong_sign_for_a_negative_configuration(joint: int) -> None:
    q = START.copy()
    q[5] = -abs(q[5])
    ring = ring_of(ARM, q)
    n, d = pivot_terms(ring, joint)
    holds = limits.pivot_derivative(n, d, -1, 0.7)
    assert holds == pytest.approx(mended_joints.derivative(ring, joint, 0.7), rel=1e-9)
    assert limits.pivot_derivative_short(n, d, -1, 0.7) == pytest.approx(-holds, rel=1e-9)


def test_eq_30_loses_the_other_stationary_point_when_one_is_at_pi() -> None:
    t = (0.25, 0.5, 0.5)
    other = 2 * np.arctan(-2.0)
    printed = limits.pivot_stationary(t)
    assert printed[0] == np.pi
    assert np.isnan(printed[1])
    assert sorted(wrap(np.array(mended_joints.roots(np.array(t))))) == pytest.approx([other, np.pi])


def test_eq_31_is_undefined_where_the_shoulder_is_singular_for_a_positive_elbow() -> None:
    q = START.copy()
    q[1], q[3] = 0.0, abs(q[3])
    assert abs(mended.arm_angle(ARM, q)) == pytest.approx(np.pi, abs=1e-14)
    t = limits.turning_coefficients(*pivot_terms(ring_of(ARM, q), 1), 1)
    assert t[1] - t[2] == pytest.approx(0.0, abs=1e-15)
    assert t[0] == pytest.approx(0.0, abs=1e-15)
    assert np.isnan(limits.singular_arm_angle((0.0, t[1], t[1])))


def test_eq_32_loses_an_arm_angle_when_the_other_is_at_pi() -> None:
    n, d = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    printed = limits.pivot_limit_arm_angles(n, d, 1, 0.0)
    assert printed[0] == np.pi
    assert np.isnan(printed[1])
    found = mended_joints.roots(np.array(n))
    assert sorted(np.abs(wrap(np.array(found)))) == pytest.approx([0.0, np.pi])


def test_eq_32_cannot_tell_plus_from_minus_ninety_degrees() -> None:
    n, d = (0.4, 0.1, 0.2), (0.2, 0.5, -0.3)
    printed = [limits.pivot_limit_arm_angles(n, d, 1, x) for x in (-np.pi / 2, np.pi / 2)]
    assert sorted(printed[0]) == pytest.approx(sorted(printed[1]), abs=1e-12)
    assert limits.pivot_angle(n, d, 1, printed[0]) == pytest.approx([np.pi / 2] * 2)


def test_eq_32_meets_the_opposite_angle_three_times_out_of_four_in_the_example() -> None:
    lower, upper = ARM.model_limits
    ring = ring_of(ARM, START)
    offsets = []
    for joint in (1, 3, 5, 7):
        low, high = float(lower[joint - 1]), float(upper[joint - 1])
        n, d = pivot_terms(ring, joint)
        gc_k = mended_joints.joint_sign(ring, joint)
        for limit in (low, high):
            printed = limits.pivot_limit_arm_angles(n, d, gc_k, limit)
            offsets += list(np.abs(wrap(limits.pivot_angle(n, d, gc_k, printed) - limit)))
        arcs = mended_arcs.pivot_arcs(ring, joint, low, high)
        for psi in [] if arcs == mended_arcs.FULL else np.ravel(arcs):
            theta = mended.model_solution(ring, float(psi))[joint - 1]
            assert min(abs(wrap(theta - low)), abs(wrap(theta - high))) < 1e-12
    assert sorted(offsets) == pytest.approx([0.0] * 4 + [np.pi] * 12, abs=1e-9)


@pytest.mark.parametrize("joint", [2, 6])
def test_eq_33_has_the_wrong_sign_for_a_negative_configuration(joint: int) -> None:
    q = START.copy()
    q[5] = -abs(q[5])
    ring = ring_of(ARM, q)
    a, b, c = (float(x) for x in mended_joints.hinge_function(ring, joint))
    ends = [mended.model_solution(ring, 0.7 + h)[joint - 1] for h in (-1e-5, 1e-5)]
    holds = (ends[1] - ends[0]) / 2e-5
    assert mended_joints.derivative(ring, joint, 0.7) == pytest.approx(holds, rel=1e-6)
    assert limits.hinge_derivative((a, b, c), -1, 0.7) == pytest.approx(-holds, rel=1e-6)


@pytest.mark.parametrize("b", [0.5, -0.5])
def test_eq_34_loses_the_stationary_point_at_0_when_the_other_is_at_pi(b: float) -> None:
    printed = limits.hinge_stationary((0.0, b, 0.1))
    assert np.isnan(printed).sum() == 1
    assert np.nanmax(np.abs(printed)) == np.pi
    found = mended_joints.roots(np.array([-b, 0.0, 0.0]))
    assert sorted(np.abs(wrap(np.array(found)))) == pytest.approx([0.0, np.pi])


def test_theta_2_is_always_stationary_at_0_and_pi() -> None:
    """The wrist lies in the reference plane, so that (34) meets a = 0 at every pose."""
    for q in np.random.default_rng(34).uniform(ARM.lower, ARM.upper, (20, 7)):
        assert mended_joints.hinge_function(ring_of(ARM, q), 2)[0] == pytest.approx(0, abs=1e-15)


def test_eq_35_loses_an_arm_angle_when_the_other_is_at_pi() -> None:
    limit = 0.5 * np.pi
    cosine = float(np.cos(limit))
    h = (0.25, 0.5, cosine + 0.5)
    printed = limits.hinge_limit_arm_angles(h, limit)
    other = 2 * np.arctan(-2.0)
    assert np.nanmin(np.abs(wrap(printed - np.pi))) < 1e-15
    assert not np.any(np.abs(wrap(printed - other)) < 0.1)
    found = np.array(mended_joints.roots(np.array([h[0], h[1], h[2] - cosine])))
    assert sorted(wrap(found)) == pytest.approx([other, np.pi])
    assert limits.hinge_angle(h, 1, found) == pytest.approx([limit, limit])


@pytest.mark.parametrize(
    ("bounds", "limit", "rule_holds"),
    [((-1.0, 1.0), 1.0, True), ((-1.0, 1.0), -1.0, True), ((0.5, 1.0), 0.5, False)],
)
def test_sign_rule_of_section_5_needs_limits_on_both_sides_of_zero(
    bounds: tuple[float, float], limit: float, rule_holds: bool
) -> None:
    for derivative in (1.0, -1.0):
        after = limit + 1e-3 * derivative
        leaves = not mended_arcs.angle_allowed(after, *bounds)
        assert (limits.leaves_limits(limit, derivative) == leaves) == rule_holds


def test_section_5_1_3_takes_a_constant_joint_for_an_indeterminate_one() -> None:
    ring = ring_of(ARM, STRAIGHT)
    n, d = pivot_terms(ring, 1)
    t = limits.turning_coefficients(n, d, 1)
    assert t[0] ** 2 + t[1] ** 2 - t[2] ** 2 == pytest.approx(0.0, abs=1e-15)
    circle = mended.model_solution(ring, np.linspace(-3, 3, 20))
    assert np.abs(circle[:, 0] - STRAIGHT[0]).max() < 1e-7
    assert not ring.shoulder_locked


def test_section_5_1_3_calls_most_plain_poses_nearly_singular() -> None:
    near = 0
    for q in np.random.default_rng(5).uniform(ARM.lower, ARM.upper, (400, 7)):
        ring = ring_of(ARM, q)
        tests = [limits.turning_coefficients(*pivot_terms(ring, joint), 1) for joint in (1, 3, 5, 7)]
        near += any(abs(a**2 + b**2 - c**2) < 0.05 for a, b, c in tests)
    assert 0.55 < near / 400 < 0.75


def test_section_5_2_a_hinge_without_slope_is_constant() -> None:
    ring = ring_of(ARM, STRAIGHT)
    a, b, c = mended_joints.hinge_function(ring, 2)
    assert np.hypot(a, b) < 1e-7
    assert np.isnan(limits.hinge_stationary((0.0, 0.0, float(c)))).all()
    circle = mended.model_solution(ring, np.linspace(-3, 3, 20))
    assert np.abs(circle[:, 1] - STRAIGHT[1]).max() < 1e-7


def test_section_5_without_the_elbow_passes_a_pose_that_has_no_solution() -> None:
    upper = ARM.upper.copy()
    upper[3] = -1.2
    arm = with_limits(ARM, ARM.lower, upper)
    pose = pose_of(arm, START)
    others = [arcs for i, arcs in enumerate(mended_arcs.joint_arcs(arm, pose, 3)) if i != 3]
    assert mended_arcs.measure(mended_arcs.intersect(others)) > 5.0
    assert mended_arcs.feasible(arm, pose, 3) == ("ELBOW_LIMIT", [])
    assert mended_arcs.feasible_by_sampling(arm, pose, 3) == []


def test_figure_11_intervals_cut_at_pi_repel_from_nothing() -> None:
    cut = limits.intersect([(-np.pi, np.pi)], [(-np.pi, -0.7), (0.7, np.pi)])
    psi = np.pi - 0.01
    printed = limits.new_arm_angle(psi, cut[1], 0.5, 20.0)
    holds = mended_arcs.resolve(psi, [(0.7, 2 * np.pi - 0.7)], 0.5, 20.0)
    assert psi - printed > 0.4
    assert holds == pytest.approx(psi, abs=1e-3)
    free = limits.new_arm_angle(psi, (-np.pi, np.pi), 0.5, 20.0)
    assert psi - free > 1.0
    assert mended_arcs.resolve(psi, mended_arcs.FULL, 0.5, 20.0) == psi
