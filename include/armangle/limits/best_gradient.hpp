// Gradient by the pose of the largest distance to the joint limits over all branches and psi.
//
// At the best solution some distances m_k of joints to limits are equally small, and no psi increases all of
// them. So weights >= 0 of sum 1 exist with sum weight_k dm_k/dpsi = 0. The margin then changes by sum
// weight_k dm_k/d(v, omega) at constant psi. That is one m_k if it is stationary in psi, or two m_k that
// change in opposite directions. Source: J. M. Danskin, The theory of max-min (1967). Where a joint at the
// margin to a singular posture stops psi, psi follows that joint.
#pragma once

#include <optional>

#include "../circle/derivatives.hpp"
#include "nearest_search.hpp"
#include "relaxed.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Whether theta_2 or theta_6 is 0 or pi. Its two neighbours then rotate around one axis, which happens at no
/// nearby pose.
inline bool shares_a_turn(const Arm& arm, const double* q) noexcept {
    bool shares = false;
    for (const int j : hinge_joint) shares |= abs(sin_cos(to_theta(arm, j, q[j])).sin) <= tolerance::angle;
    return shares;
}

/// Whether a joint (0..6) does not move with psi: index 3, joint 4, alone.
inline bool is_fixed_by_pose(const Arm&, int joint) noexcept { return joint == 3; }

namespace detail {

/// Derivatives at the psi near the best one where the derivative of joint j (0..6) with respect to psi is 0.
/// A search that compares values knows this psi to half the digits only. The secant method refines it.
/// Returns `d` if no such psi is near, as for j = 3.
template <class AnyArm>
Derivatives at_its_top(const AnyArm& arm, const Pose<double>& pose, const Nearest& best, int j,
                       Derivatives d) noexcept {
    constexpr double aside = 1e-7, near = 1e-3;
    constexpr int psi = joints - 1, rounds = 10;
    double before = best.psi + aside, now = best.psi;
    double slope_before = inverse_derivative(arm, pose, before, best.gc, best.q).entry[j][psi];
    for (int round = 0; round < rounds; ++round) {
        const double slope = d.entry[j][psi];
        const double next = now - slope * (now - before) / (slope - slope_before);
        if (slope == 0 || !(abs(next - best.psi) < near)) break;
        const Derivatives there = inverse_derivative(arm, pose, next, best.gc, best.q);
        if (!(abs(there.entry[j][psi]) < abs(slope))) break;
        before = now;
        slope_before = slope;
        now = next;
        d = there;
    }
    return d;
}

/// Whether a psi next to that of `best` has at least the margin `least` (rad), as happens if joint 4 alone
/// decides.
template <class AnyArm>
bool is_as_good_nearby(const AnyArm& arm, const Pose<double>& pose, const Nearest& best,
                       double least) noexcept {
    constexpr double aside = 1e-5;
    for (const double psi : {best.psi - aside, best.psi + aside}) {
        const Inverse found = inverse(arm, pose, psi, best.gc, best.q);
        if (is_solved(found.status) && found.margin > least - tolerance::angle) return true;
    }
    return false;
}

/// The distance (rad) of a joint to one of its limits; it changes by `sign` times the change of the joint.
struct LimitEnd {
    int joint;
    double sign, distance;

    /// The derivative of this distance by column k of the joints' derivatives.
    double slope(const Derivatives& d, int k) const noexcept { return sign * d.entry[joint][k]; }
};

/// Among the smallest distances to limits: the one that rises fastest with psi, the one that falls fastest,
/// and the one that changes least.
struct Deciding {
    std::optional<LimitEnd> rising, falling, flattest;
    double least = infinity;  // rad
};

/// The limits whose distances determine the margin at q, where the joints have the derivatives d. Joints
/// without two finite limits are left out.
inline Deciding deciding(const Arm& arm, const double* q, const Derivatives& d) noexcept {
    constexpr int psi = joints - 1;
    LimitEnd side[2 * joints];
    int count = 0;
    Deciding out;
    for (int j = 0; j < joints; ++j) {
        const double lower = arm.limits.lower[j], upper = arm.limits.upper[j];
        if (!(upper - lower < infinity)) continue;
        side[count++] = {j, 1.0, q[j] - lower};
        side[count++] = {j, -1.0, upper - q[j]};
        out.least = min(out.least, min(q[j] - lower, upper - q[j]));
    }
    for (int i = 0; i < count; ++i) {
        const LimitEnd& s = side[i];
        const double now = s.slope(d, psi), steepness = abs(now) < infinity ? abs(now) : 0.0;
        // psi is known to the tolerance, so a steep joint is only known to its slope times that
        if (s.distance > out.least + tolerance::angle * (1.0 + steepness)) continue;
        if (!out.flattest || abs(now) < abs(out.flattest->slope(d, psi))) out.flattest = s;
        if (now > 0 && (!out.rising || now > out.rising->slope(d, psi))) out.rising = s;
        if (now < 0 && (!out.falling || now < out.falling->slope(d, psi))) out.falling = s;
    }
    return out;
}

/// Whether a fold of an arm that has folds is as near as psi is known: beside one a joint moves with psi as
/// one over the root of the distance from it.
template <class AnyArm>
bool is_at_fold(const AnyArm& arm, const Derivatives& d) noexcept {
    bool out = false;
    if constexpr (requires { psi_joint(arm); })
        for (const auto& row : d.entry) out |= row[6] * row[6] * tolerance::angle > 1.0;
    return out;
}

/// The joint (0 to 6; the first) that stops psi while the cost would still fall: at its limit, or at the
/// margin to a singular posture; -1 if none does. cost_slope is the cost's derivative with respect to psi.
template <class AnyArm>
int stopped_joint(const AnyArm& any, double singularity_margin, const double* q, const Derivatives& d,
                  double cost_slope) noexcept {
    const Arm& arm = nominal(any);
    for (int j = 0; j < joints; ++j) {
        const double along = cost_slope > 0 ? -d.entry[j][6] : d.entry[j][6];  // dq_j for falling cost
        const double near = tolerance::angle * (1.0 + abs(along));
        if (along < 0 && q[j] - arm.limits.lower[j] <= near) return j;
        if (along > 0 && arm.limits.upper[j] - q[j] <= near) return j;
        if (singularity_margin == 0) continue;
        for (const auto& [joint, zero, is_singular] : branch_meetings(any)) {
            if (joint != j || !is_singular) continue;
            const SinCos<double> at = sin_cos(to_theta(arm, j, q[j]) - zero);
            const double off = atan2(at.sin, abs(at.cos));  // from the nearer of 0 and pi
            const double closing = along * arm.sign[j] * (at.cos < 0 ? -1.0 : 1.0) * (off < 0 ? -1.0 : 1.0);
            if (closing < 0 && abs(off) - singularity_margin <= near) return j;
        }
    }
    return -1;
}

}  // namespace detail

/// Writes to `out` the gradient, by the twist (v, omega) of the pose (rad/m, rad/rad), of the margin of the
/// best solution from nearest_posture() with Metric::margin. If several branches, arm angles or pairs of
/// joints are equally good, the gradient is that of the given solution. `margin` (rad) is the singularity
/// margin. It is NaN if there is no solution, a deciding joint has no derivative, or a fold ends psi. It is
/// also NaN if theta_2 or theta_6 is 0 or pi, unless joint 4 alone decides: two joints share a turn only
/// there, so the margin jumps or has no slope. Otherwise it is 0 without limits.
template <class AnyArm>
void best_gradient(const AnyArm& arm, double margin, const Pose<double>& pose, const Nearest& best,
                   double (&out)[6]) noexcept {
    for (double& slope : out) slope = not_a_number;
    if (best.status != Status::OK) return;
    Derivatives d = inverse_derivative(arm, pose, best.psi, best.gc, best.q);
    if (d.status != Status::OK || detail::is_at_fold(arm, d)) return;
    constexpr int psi = joints - 1;
    detail::Deciding who = detail::deciding(nominal(arm), best.q, d);
    double share = 1.0, growth = 0.0;
    int stopped = -1;
    const bool by_the_elbow = who.flattest && is_fixed_by_pose(arm, who.flattest->joint);
    if (shares_a_turn(arm, best.q) &&
        !(by_the_elbow && detail::is_as_good_nearby(arm, pose, best, who.least)))
        return;
    if (who.rising && who.falling) {
        const double up = who.rising->slope(d, psi), down = who.falling->slope(d, psi);
        share = down / (down - up);
    } else if (who.flattest) {
        who.rising = who.falling = who.flattest;
        growth = who.flattest->slope(d, psi);
        if (!(abs(growth) <= tolerance::angle))
            stopped = detail::stopped_joint(arm, margin, best.q, d, -growth);
        if (stopped < 0) {
            d = detail::at_its_top(arm, pose, best, who.flattest->joint, d);
            if (!(abs(who.flattest->slope(d, psi)) <= tolerance::angle)) return;
        }
    }
    for (int k = 0; k < 6; ++k) {
        double sum = 0;
        if (who.flattest) sum = share * who.rising->slope(d, k) + (1.0 - share) * who.falling->slope(d, k);
        if (stopped >= 0) sum -= growth * d.entry[stopped][k] / d.entry[stopped][psi];
        out[k] = abs(sum) < infinity ? sum : not_a_number;
    }
}

}  // namespace armangle

#include "../names/end.hpp"
