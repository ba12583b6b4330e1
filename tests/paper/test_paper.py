"""Every equation of the paper holds where the paper says so, and agrees with ``mended``.

What the paper gets wrong is in ``test_errata``; that the mended formulas are those of the library, on all
arms, is a law of ``laws/test_feasible``.
"""

import inspect
from collections.abc import Callable

import numpy as np
import pytest
from reference import mended, mended_arcs, mended_joints, paper
from reference import paper_limits as limits
from reference.mended_arm import frames, iiwa7, wrap
from reference.paper import IIWA7, Array

ARM = iiwa7()
POSTURES = list(np.random.default_rng(2018).uniform(ARM.lower, ARM.upper, (12, 7)))
"""Joint angles of iiwa 7 within its limits, rad, each (7,): no special posture among them."""

PIVOTS = [1, 3, 5, 7]
HINGES = [2, 6]


def postures(law: Callable[..., None]) -> Callable[..., None]:
    """Make one test of a law for all postures; what fails is told with its posture."""

    def of_all(**given: int) -> None:
        """Check the law at each posture."""
        for theta in POSTURES:
            try:
                law(theta, **given)
            except AssertionError as wrong:
                wrong.add_note(f"at theta = {theta.tolist()}")
                raise

    asked = inspect.signature(law)
    of_all.__name__, of_all.__doc__ = law.__name__, law.__doc__
    of_all.__signature__ = asked.replace(parameters=list(asked.parameters.values())[1:])
    return of_all


def close(actual: object, wanted: object, tolerance: float = 1e-12) -> bool:
    """Whether two arrays agree to an absolute tolerance."""
    return bool(np.allclose(np.asarray(actual), np.asarray(wanted), rtol=0, atol=tolerance))


def same_angles(actual: Array, wanted: Array, tolerance: float = 1e-9) -> bool:
    """Whether two sets of angles (n,) agree on the circle, in any order."""
    gaps = np.abs(wrap(np.subtract.outer(np.asarray(actual), np.asarray(wanted))))
    return bool((gaps.min(axis=0) < tolerance).all() and (gaps.min(axis=1) < tolerance).all())


def signs_of(theta: Array) -> tuple[int, int, int]:
    """Signs +1 or -1 (GC_2, GC_4, GC_6) of joint angles theta (7,); 0 gives +1."""
    return mended.gc_signs(mended.gc_index(ARM, theta))


def matrices(theta: Array) -> tuple[limits.Matrices, limits.Matrices]:
    """A, B, C of shoulder and wrist by Eqs. (15) and (20) for the pose of joint angles (7,)."""
    return paper.circle_matrices(paper.chain_transforms(theta, IIWA7)[7], signs_of(theta)[1], IIWA7)


def slope(theta: Array, joint: int, psi: float) -> float:
    """Central difference of theta_i(psi) by the inverse kinematics, rad per rad."""
    pose, step = paper.chain_transforms(theta, IIWA7)[7], 1e-5
    ends = [paper.inverse(pose, psi + h, signs_of(theta), IIWA7) for h in (-step, step)]
    return float(wrap(ends[1] - ends[0])[joint - 1] / (2 * step))


@postures
def test_eq_1_and_table_1_give_the_chain_of_elementary_motions(theta: Array) -> None:
    ours = paper.chain_transforms(theta, IIWA7)
    assert close(ours, frames(ARM, theta), 1e-14)


def test_eq_1_with_a_link_length_moves_along_the_turned_x_axis() -> None:
    moved = paper.link_transform(0.3, 0.7, 0.2, 0.5)[:3, 3]
    assert close(moved, [0.2 * np.cos(0.3), 0.2 * np.sin(0.3), 0.5], 1e-16)


def test_eq_2_is_plus_one_at_zero() -> None:
    assert [paper.configuration_sign(x) for x in (-1e-300, -0.0, 0.0, 2.0)] == [-1, 1, 1, 1]


@postures
def test_eq_3_links_shoulder_and_wrist(theta: Array) -> None:
    chain = paper.chain_transforms(theta, IIWA7)
    p_26 = paper.shoulder_wrist_vector(chain[7], IIWA7)
    assert close(p_26, chain[6][:3, 3] - chain[2][:3, 3], 1e-15)


@postures
def test_eq_4_recovers_the_elbow_angle(theta: Array) -> None:
    p_26 = paper.shoulder_wrist_vector(paper.chain_transforms(theta, IIWA7)[7], IIWA7)
    gc_4 = signs_of(theta)[1]
    angle = paper.theta_4(p_26, gc_4, IIWA7)
    assert close(angle, theta[3])
    assert close(angle, mended.elbow(ARM, float(np.linalg.norm(p_26)), gc_4)[0])


@postures
def test_eqs_5_and_7_bring_the_virtual_wrist_to_the_real_one(theta: Array) -> None:
    p_26 = paper.shoulder_wrist_vector(paper.chain_transforms(theta, IIWA7)[7], IIWA7)
    gc_4 = signs_of(theta)[1]
    virtual = paper.virtual_frames(p_26, gc_4, IIWA7)
    wrist = virtual[4][:3, 3] + IIWA7.d_ew * virtual[4][:3, 2] - virtual[2][:3, 3]
    assert close(wrist, p_26)
    beta = mended.elbow(ARM, float(np.linalg.norm(p_26)), gc_4)[1]
    assert close(virtual[3][:3, :3], mended.virtual_rotation(ARM, p_26, beta))


def test_eq_5_is_zero_on_the_base_axis() -> None:
    axis = np.array([0.0, 0.0, 1.0])
    assert paper.theta_1_virtual(np.array([0.0, 0.0, 0.7]), axis) == 0.0
    assert paper.theta_1_virtual(np.array([0.0, 0.1, 0.7]), axis) == np.pi / 2


@postures
def test_eq_6_is_the_angle_at_the_shoulder(theta: Array) -> None:
    chain = paper.chain_transforms(theta, IIWA7)
    p_26 = paper.shoulder_wrist_vector(chain[7], IIWA7)
    p_24 = chain[4][:3, 3] - chain[2][:3, 3]
    cosine = p_24 @ p_26 / np.linalg.norm(p_24) / np.linalg.norm(p_26)
    assert close(np.cos(paper.phi(p_26, IIWA7)), cosine)


@postures
def test_eqs_8_and_9_are_parallel_to_the_elbow_axis(theta: Array) -> None:
    chain = paper.chain_transforms(theta, IIWA7)
    normal = paper.sew_normal(*(chain[k][:3, 3] for k in (2, 4, 6)))
    assert close(normal / np.linalg.norm(normal), signs_of(theta)[1] * chain[3][:3, 2])


@postures
def test_eqs_10_and_11_agree_with_the_arctangent_of_the_elbow_axes(theta: Array) -> None:
    pose, psi, signs = paper.forward(theta, IIWA7)
    mended_pose, mended_psi, gc = mended.forward(ARM, theta)
    assert close(pose, mended_pose, 1e-15)
    assert close(psi, mended_psi, 1e-10)
    assert signs == mended.gc_signs(gc)


@postures
def test_eqs_12_to_14_turn_the_virtual_arm_into_the_real_one(theta: Array) -> None:
    """R_psi times the virtual rotations 0R3 and 0R4 are the rotations of the chain."""

    chain = paper.chain_transforms(theta, IIWA7)
    p_26 = paper.shoulder_wrist_vector(chain[7], IIWA7)
    virtual = paper.virtual_frames(p_26, signs_of(theta)[1], IIWA7)
    r_psi = paper.redundancy_rotation(p_26, mended.arm_angle(ARM, theta))
    for k in (3, 4):
        real = paper.real_rotation(r_psi, virtual[k][:3, :3])
        assert close(real, chain[k][:3, :3])


def test_eq_14_is_a_rotation_by_psi_about_the_wrist_vector() -> None:
    axis, psi = np.array([0.3, -0.5, 0.4]), 1.1
    rotation = paper.redundancy_rotation(axis, psi)
    assert close(rotation @ rotation.T, np.eye(3), 1e-15)
    assert close(rotation @ axis, axis, 1e-15)
    across = np.cross(axis, [1.0, 0.0, 0.0])
    assert close(mended.angle_about(axis / np.linalg.norm(axis), across, rotation @ across), psi)


@postures
def test_eqs_15_and_20_trace_both_rotations_over_the_circle(theta: Array) -> None:
    pose = paper.chain_transforms(theta, IIWA7)[7]
    shoulder, wrist = matrices(theta)
    ring = mended.circle(ARM, pose, mended.gc_index(ARM, theta))
    assert close(shoulder, ring.shoulder)
    assert close(wrist, ring.wrist)
    for psi in (-2.0, 0.0, 1.3):
        chain = paper.chain_transforms(paper.inverse(pose, psi, signs_of(theta), IIWA7), IIWA7)
        terms = np.array([np.sin(psi), np.cos(psi), 1.0])
        assert close(np.tensordot(terms, shoulder, 1), chain[3][:3, :3])
        assert close(np.tensordot(terms, wrist, 1), chain[4][:3, :3].T @ chain[7][:3, :3])


@postures
def test_eqs_16_and_21_are_elements_of_the_chain(theta: Array) -> None:
    chain = paper.chain_transforms(theta, IIWA7)
    pairs = [
        (paper.shoulder_rotation_elements(theta), chain[3][:3, :3]),
        (paper.wrist_rotation_elements(theta), chain[4][:3, :3].T @ chain[7][:3, :3]),
    ]
    for printed, whole in pairs:
        known = np.isfinite(printed)
        assert known.sum() == 5
        assert close(printed[known], whole[known])


@postures
def test_eqs_17_to_19_and_22_to_24_recover_each_joint(theta: Array) -> None:
    chain = paper.chain_transforms(theta, IIWA7)
    r_03, r_47 = chain[3][:3, :3], chain[4][:3, :3].T @ chain[7][:3, :3]
    gc_2, _, gc_6 = signs_of(theta)
    upper = [f(r_03, gc_2) for f in (paper.theta_1, paper.theta_2, paper.theta_3)]
    lower = [f(r_47, gc_6) for f in (paper.theta_5, paper.theta_6, paper.theta_7)]
    assert close(upper, theta[:3])
    assert close(lower, theta[4:])


@postures
def test_section_4_inverts_section_3_in_all_eight_configurations(theta: Array) -> None:
    pose, psi, _ = mended.forward(ARM, theta)
    for gc in range(8):
        solution = paper.inverse(pose, psi, mended.gc_signs(gc), IIWA7)
        assert close(solution, mended.model_solution(mended.circle(ARM, pose, gc), psi), 1e-9)
        found_pose, found_psi, found_gc = mended.forward(ARM, solution)
        assert close(found_pose, pose)
        assert close(found_psi, psi, 1e-9)
        assert found_gc == gc


def test_eq_25_intersects_unions_of_intervals() -> None:
    first, second = [(-3.0, -1.0), (0.0, 2.0)], [(-2.0, 0.5), (1.0, 3.0)]
    wanted = [(-2.0, -1.0), (0.0, 0.5), (1.0, 2.0)]
    assert limits.intersect(first, second) == wanted
    assert close(mended_arcs.intersect([first, second]), wanted, 1e-15)


@pytest.mark.parametrize("joint", PIVOTS + HINGES)
@postures
def test_eqs_26_and_27_are_the_inverse_joint_by_joint(theta: Array, joint: int) -> None:
    pose, signs = paper.chain_transforms(theta, IIWA7)[7], signs_of(theta)
    gc_k = signs[0] if joint < 4 else signs[2]
    for psi in (-2.5, 0.4, 3.0):
        if joint in PIVOTS:
            value = limits.pivot_angle(*limits.pivot_coefficients(joint, *matrices(theta)), gc_k, psi)
        else:
            value = limits.hinge_angle(limits.hinge_coefficients(joint, *matrices(theta)), gc_k, psi)
        assert close(value, paper.inverse(pose, psi, signs, IIWA7)[joint - 1])


@pytest.mark.parametrize("joint", PIVOTS)
@postures
def test_eqs_28_and_29_are_the_slope_of_a_pivot(theta: Array, joint: int) -> None:
    n, d = limits.pivot_coefficients(joint, *matrices(theta))
    gc_k = signs_of(theta)[0 if joint < 4 else 2]
    ring = mended.circle(ARM, paper.chain_transforms(theta, IIWA7)[7], mended.gc_index(ARM, theta))
    for psi in (-1.9, 0.2, 2.4):
        full = limits.pivot_derivative(n, d, gc_k, psi)
        assert full == pytest.approx(slope(theta, joint, psi), rel=1e-5, abs=1e-8)
        assert full == pytest.approx(mended_joints.derivative(ring, joint, psi), rel=1e-9)
        assert limits.pivot_derivative_short(n, d, 1, psi) == pytest.approx(full, rel=1e-9)


@pytest.mark.parametrize("joint", PIVOTS)
@postures
def test_eq_30_finds_the_stationary_points_of_a_pivot(theta: Array, joint: int) -> None:
    n, d = limits.pivot_coefficients(joint, *matrices(theta))
    t = limits.turning_coefficients(n, d, 1)
    found = limits.pivot_stationary(t)
    ring = mended.circle(ARM, paper.chain_transforms(theta, IIWA7)[7], mended.gc_index(ARM, theta))
    wanted = mended_joints.stationary(ring, joint)
    assert limits.stationary_count(t) == len(wanted)
    if wanted:
        assert same_angles(found, np.array(wanted))
        assert all(close(limits.pivot_derivative(n, d, 1, psi), 0.0, 1e-8) for psi in found)
    else:
        assert np.isnan(found).all()


@pytest.mark.parametrize(("zero", "joint"), [(1, 1), (1, 3), (5, 5), (5, 7)])
def test_eq_31_finds_the_arm_angle_of_a_singular_posture(zero: int, joint: int) -> None:
    theta = POSTURES[0].copy()
    theta[zero], theta[3] = 0.0, -abs(theta[3])
    n, d = limits.pivot_coefficients(joint, *matrices(theta))
    t = limits.turning_coefficients(n, d, 1)
    assert close(t[0] ** 2 + t[1] ** 2 - t[2] ** 2, 0.0, 1e-15)
    assert close(limits.singular_arm_angle(t), mended.arm_angle(ARM, theta), 1e-9)


@pytest.mark.parametrize("joint", PIVOTS)
@postures
def test_eq_32_finds_where_a_pivot_meets_a_limit(theta: Array, joint: int) -> None:
    n, d = limits.pivot_coefficients(joint, *matrices(theta))
    gc_k, limit = signs_of(theta)[0 if joint < 4 else 2], theta[joint - 1]
    found = limits.pivot_limit_arm_angles(n, d, gc_k, limit)
    assert np.abs(wrap(found - mended.arm_angle(ARM, theta))).min() < 1e-9
    for psi in found:
        assert close(np.sin(limits.pivot_angle(n, d, gc_k, psi) - limit), 0.0, 1e-9)


@pytest.mark.parametrize("joint", HINGES)
@postures
def test_eqs_33_to_35_describe_a_hinge_of_positive_configuration(theta: Array, joint: int) -> None:
    posture = theta.copy()
    posture[joint - 1] = abs(theta[joint - 1])
    h = limits.hinge_coefficients(joint, *matrices(posture))
    for psi in (-1.9, 0.2, 2.4):
        assert limits.hinge_derivative(h, 1, psi) == pytest.approx(
            slope(posture, joint, psi), rel=1e-5, abs=1e-8
        )
    ring = mended.circle(ARM, paper.chain_transforms(posture, IIWA7)[7], mended.gc_index(ARM, posture))
    stationary = limits.hinge_stationary(h)
    assert same_angles(stationary, np.array(mended_joints.stationary(ring, joint)))
    at_limit = limits.hinge_limit_arm_angles(h, posture[joint - 1])
    assert np.abs(wrap(at_limit - mended.arm_angle(ARM, posture))).min() < 1e-9
    assert close(limits.hinge_angle(h, 1, at_limit), posture[joint - 1], 1e-9)


def test_eq_36_repels_from_the_nearer_end_and_rests_in_the_middle() -> None:
    interval = (-0.5, 1.5)
    assert limits.new_arm_angle(0.5, interval, 0.7, 20.0) == 0.5
    at_lower = limits.new_arm_angle(-0.5, interval, 0.7, 20.0)
    assert close(at_lower, -0.5 + 0.7 * (1 - np.exp(-20.0)))
    for psi in np.linspace(-0.5, 1.5, 21):
        moved = limits.new_arm_angle(psi, interval, 1.0, 20.0)
        assert -0.5 <= moved <= 1.5
        assert moved == pytest.approx(mended_arcs.resolve(psi, [interval], 1.0, 20.0), abs=1e-15)


def test_eqs_37_and_38_are_one_posture_of_the_iiwa_7() -> None:
    """Golden: the joints (37) and the pose (38) as printed; psi by two ways, to the last digit."""
    pose, psi, signs = paper.forward(paper.THETA_START, IIWA7)
    assert close(pose, paper.POSE_START, 5e-5)
    assert mended.gc_index(ARM, paper.THETA_START) == 3
    assert signs == mended.gc_signs(3) == (-1, -1, 1)
    assert close(np.degrees(psi), 58.58816372916817, 1e-10)
    assert close(np.degrees(mended.arm_angle(ARM, paper.THETA_START)), 58.58816372916817, 1e-12)


def test_start_of_the_example_has_two_feasible_arcs() -> None:
    """Golden: arcs at (38) in degrees, found in closed form and, apart from it, by trying."""
    pose = paper.chain_transforms(paper.THETA_START, IIWA7)[7]
    status, arcs = mended_arcs.feasible(ARM, pose, 3)
    assert status == "OK"
    assert close(np.degrees(arcs), [[-22.82, 24.88], [42.70, 322.07]], 0.005)
    assert close(arcs, mended_arcs.feasible_by_sampling(ARM, pose, 3), 1e-8)


def test_eq_39_is_eq_38_moved_along_its_own_z_axis() -> None:
    exact = paper.chain_transforms(paper.THETA_START, IIWA7)[7]
    exact[:3, 3] += 0.25 * exact[:3, 2]
    assert close(exact, paper.POSE_GOAL, 5.1e-5)


@postures
def test_eqs_40_to_46_are_eq_1_written_out(theta: Array) -> None:
    product = np.eye(4)
    chain = paper.chain_transforms(theta, IIWA7)
    for printed, frame in zip(paper.appendix_transforms(theta, IIWA7), chain[1:], strict=True):
        product = product @ printed
        assert close(product, frame, 1e-14)
