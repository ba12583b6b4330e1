// Derivative of the solution from nearest_posture() by the pose and by the seed.
//
// The search chooses psi, and the joints follow: dq = (dq/dx) dx + (dq/dpsi) dpsi, with x the twist of the
// pose. The implicit function theorem gives dpsi from the condition that determines psi:
//
//   a joint at its limit                 q_j(x, psi) = limit
//   the least distance to the seed       g = sum w_j (q_j - seed_j) dq_j/dpsi = 0
//   the largest margin, of two joints    m_a(x, psi) = m_b(x, psi)
//   the largest margin, of one joint     dq_j/dpsi = 0
//
// psi of an arm with an offset is its free joint.
//
// The last three need second derivatives: Rates on Dual numbers give them. If another branch, psi or turn is
// equally good, or the condition changes, the solution jumps or bends: the derivative is that of one side.
#pragma once

#include "best_gradient.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The derivatives of a solution's joints, row j for joint j + 1: with respect to the twist (v, omega) of the
/// pose (rad/m, rad/rad) and to the seven values of the seed (rad/rad).
struct SolutionDerivative {
    static constexpr int columns = 6 + joints;
    double entry[joints][columns];
};

/// Writes the derivatives of dq_j/dpsi for each joint with respect to the twist and to psi to `out`, in the
/// seven columns of Derivatives, at a solution of a pose.
inline void slope_derivatives(const Arm& arm, const Pose<double>& pose, const Nearest& at,
                              double (&out)[joints][joints]) noexcept {
    const auto variable = [](int k) {
        double lanes[Dual::variables] = {};
        lanes[k] = 1.0;
        return Dual::Partials::load(lanes);
    };
    const Pose<Dual> moved = detail::moving(pose, {variable(0), variable(1), variable(2)},
                                            {variable(3), variable(4), variable(5)});
    const Pose<Dual> flange = flange_pose(arm, moved);
    const Configuration<double> sign = configuration(at.gc);
    const Configuration<Dual> branch{sign.shoulder, sign.elbow, sign.wrist};
    const Rates<Dual> r =
        rates(arm, flange, self_motion(arm, circle(arm, flange), branch), sin_cos(Dual(at.psi, variable(6))));
    for (int j = 0; j < joints; ++j) {
        Dual one[joints];
        for (int k = 0; k < joints; ++k) one[k] = Dual(k == j ? 1.0 : 0.0);
        double lanes[Dual::variables];
        pulled(arm, r, one).psi.partial.store(lanes);
        for (int k = 0; k < joints; ++k) out[j][k] = lanes[k];
    }
}

namespace detail {

/// The derivatives of a solution's psi with respect to the twist and to the seed.
struct PsiSlope {
    double by[SolutionDerivative::columns] = {};

    /// Sets the derivative of psi such that a condition f = 0 stays fulfilled, given the derivatives of f
    /// with respect to twist and psi.
    void hold(const double* f_by_twist, double f_by_psi) noexcept {
        for (int k = 0; k < 6; ++k) by[k] = -f_by_twist[k] / f_by_psi;
    }
};

/// Computes the derivative of psi for the solution nearest to a seed; false if no condition determines psi.
template <class AnyArm>
bool nearest_slope(const AnyArm& arm, double singularity_margin, const Pose<double>& pose,
                   const Nearest& best, const NearestOptions& options, const Derivatives& d,
                   PsiSlope& out) noexcept {
    double cost_slope = 0;
    for (int j = 0; j < joints; ++j)
        cost_slope += options.weight[j] * (best.q[j] - options.near[j]) * d.entry[j][6];
    const int stopped = stopped_joint(arm, singularity_margin, best.q, d, cost_slope);
    double by[joints][joints];
    slope_derivatives(arm, pose, best, by);
    double cross[joints] = {};  // derivatives of cost_slope by twist and psi
    for (int j = 0; j < joints; ++j)
        for (int k = 0; k < joints; ++k)
            cross[k] += options.weight[j] *
                        (d.entry[j][k] * d.entry[j][6] + (best.q[j] - options.near[j]) * by[j][k]);
    // At the least distance the slope is 0 up to the accuracy of psi; else a joint must have stopped psi.
    const bool is_level = abs(cost_slope) <= tolerance::angle * (1.0 + abs(cross[6]));
    if (stopped >= 0 && !is_level) {
        out.hold(d.entry[stopped], d.entry[stopped][6]);
        return true;
    }
    if (!is_level || !(cross[6] > 0)) return false;
    out.hold(cross, cross[6]);
    for (int j = 0; j < joints; ++j) out.by[6 + j] = options.weight[j] * d.entry[j][6] / cross[6];
    return true;
}

/// Computes the derivative of psi for the solution with the largest margin. False at a fold of an arm with an
/// offset, and if joint 4 alone decides, because then all psi are equal.
template <class AnyArm>
bool widest_slope(const AnyArm& arm, double singularity_margin, const Pose<double>& pose, const Nearest& best,
                  const Derivatives& d, PsiSlope& out) noexcept {
    const Deciding who = deciding(nominal(arm), best.q, d);
    if (who.rising && who.falling) {
        double between[joints];
        for (int k = 0; k < joints; ++k) between[k] = who.rising->slope(d, k) - who.falling->slope(d, k);
        out.hold(between, between[6]);
        return true;
    }
    if (!who.flattest || is_fixed_by_pose(arm, who.flattest->joint)) return false;
    const double growth = who.flattest->slope(d, 6);
    const int stopped = stopped_joint(arm, singularity_margin, best.q, d, -growth);
    if (stopped >= 0) {
        out.hold(d.entry[stopped], d.entry[stopped][6]);
        return true;
    }
    double by[joints][joints];
    slope_derivatives(arm, pose, best, by);
    const double (&row)[joints] = by[who.flattest->joint];
    // The best psi costs less than a neighbour by more than the search tells: it is off the level place of
    // the parabola by that much at most, unless a fold ends psi before.
    if (!(growth * growth <= 2.0 * abs(row[6]) * NearestTuning::gain)) return false;
    out.hold(row, row[6]);
    return true;
}

}  // namespace detail

/// The derivative of a solution from nearest_posture() with these options, limits and margin (rad), for
/// metric l2 with a seed, or margin, whose columns for the seed are 0. NaN if its status is not OK, if a
/// joint has no derivative (theta_2 or theta_6 at 0 or pi, stretched or folded elbow), or if nothing
/// determines psi.
template <class AnyArm>
SolutionDerivative solution_derivative(const AnyArm& arm, double singularity_margin, const Pose<double>& pose,
                                       const Nearest& best, const NearestOptions& options) noexcept {
    SolutionDerivative out;
    for (auto& row : out.entry)
        for (double& entry : row) entry = not_a_number;
    if (best.status != Status::OK) return out;
    const Derivatives d = inverse_derivative(arm, pose, best.psi, best.gc, best.q);
    if (d.status != Status::OK || detail::is_at_fold(arm, d) || shares_a_turn(arm, best.q)) return out;
    detail::PsiSlope psi;
    const bool is_fixed = options.metric == Metric::margin
                              ? detail::widest_slope(arm, singularity_margin, pose, best, d, psi)
                              : detail::nearest_slope(arm, singularity_margin, pose, best, options, d, psi);
    if (!is_fixed) return out;
    for (int j = 0; j < joints; ++j)
        for (int k = 0; k < SolutionDerivative::columns; ++k) {
            const double held = k < 6 ? d.entry[j][k] : 0.0;
            const double entry = held + d.entry[j][6] * psi.by[k];
            out.entry[j][k] = abs(entry) < infinity ? entry : not_a_number;
        }
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
