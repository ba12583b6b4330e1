// How psi of a nearly S-R-S arm changes with its joints, forward() on dual numbers, and its proven intervals
// with the pose.
#pragma once

#include "../limits/end_slopes.hpp"
#include "../numbers/dual.hpp"
#include "../numbers/jet.hpp"
#include "../self_motion/inverse_pullback.hpp"
#include "step.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// None of the joints (0..6) has psi as its value: -1.
constexpr int psi_joint(const ChainArm&) noexcept { return -1; }

/// True for joint 4 (3), which moves with psi only as far as the chain is off its nominal arm.
constexpr bool is_fixed_by_pose(const ChainArm&, int joint) noexcept { return joint == 3; }

/// The postures of a nearly S-R-S arm in which branches meet, by the joints of its nominal arm.
inline BranchMeetings branch_meetings(const ChainArm& arm) noexcept { return branch_meetings(arm.nominal); }

namespace detail {

/// psi (rad) of joints whose angles are given.
template <class T>
T psi_of(const ChainArm& arm, const SinCos<T>* angle) noexcept {
    const Triad<T> on = triad(arm.nominal, flange_pose(arm.nominal, tip(arm, angle)));
    const Vec3<T> axis = elbow_axis(angle);
    return atan2(dot(on.e, axis), dot(on.z, axis));
}

/// The joint angle theta (rad) of joint j at q, with its derivative with respect to q.
inline Dual theta_along(const ChainArm& arm, int j, double q) noexcept {
    double lanes[Dual::variables] = {};
    lanes[j] = arm.nominal.sign[j];
    return {to_theta(arm.nominal, j, q), Dual::Partials::load(lanes)};
}

}  // namespace detail

/// Writes the gradient dpsi/dq at joints q (rad/rad) to `out`; infinite if psi does not exist or jumps there.
inline void psi_gradient(const ChainArm& arm, const double* q, double (&out)[joints]) noexcept {
    SinCos<Dual> angle[joints];
    for (int j = 0; j < joints; ++j) angle[j] = sin_cos(detail::theta_along(arm, j, q[j]));
    double partial[Dual::variables];
    detail::psi_of(arm, angle).partial.store(partial);
    const Triad<double> on = triad(arm.nominal, flange_pose(arm.nominal, tool_pose(arm, q)));
    const bool exists = !is_folded(on) && !is_reference_lost(arm.nominal, on.w, on.distance);
    for (int j = 0; j < joints; ++j) out[j] = exists && abs(partial[j]) < infinity ? partial[j] : infinity;
}

/// Writes the change of the gradient of psi at joints q along joint velocities u to `out`.
inline void psi_gradient_change(const ChainArm& arm, const double* q, const double* u,
                                double (&out)[joints]) noexcept {
    SinCos<Jet<Dual, 1>> angle[joints];
    for (int j = 0; j < joints; ++j) {
        Jet<Dual, 1> theta(detail::theta_along(arm, j, q[j]));
        theta.coefficient[1] = Dual(arm.nominal.sign[j] * u[j]);
        angle[j] = sin_cos(theta);
    }
    double partial[Dual::variables];
    detail::psi_of(arm, angle).coefficient[1].partial.store(partial);
    for (int j = 0; j < joints; ++j) out[j] = partial[j];
}

/// Writes the gradient of the total of freedom() within the limits of a view of the arm with respect to the
/// twist (v, omega) of the pose to `out`; NaN if an end does not move smoothly, as where a proof ends.
inline void freedom_gradient(const ChainArm& arm, const Pose<double>& pose, const ChainSteps& view,
                             double (&out)[6]) noexcept {
    for (double& slope : out) slope = 0;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    ProvenArcs found;
    for (int gc = 0; gc < configurations; ++gc) {
        view.arcs(exact, gc, view.rows().limits, found);
        add_length_slope(arm, pose, gc, found.arcs, out);
    }
}

}  // namespace armangle

#include "../names/end.hpp"
