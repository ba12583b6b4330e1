// Forward kinematics, q -> (pose, psi, GC).
//
//     forward(arm, q)   -> Posture {pose, psi, gc}   eq. (1)-(11)
//
// inverse.hpp has the inverse.
#pragma once

#include "../arm/configuration.hpp"
#include "../arm/frames.hpp"
#include "circle.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Result of forward kinematics.
struct Posture {
    Pose<double> pose;  // in the user's frame
    double psi;         // NaN if the wrist coincides with the shoulder
    int gc;             // 0..7
};

/// The arm angle of a configuration (rad; NaN if the wrist coincides with the shoulder), under the name that
/// all kinds of arm share for their redundant parameter.
inline double redundancy(const Posture& posture) noexcept { return posture.psi; }

/// Forward kinematics: pose, psi and branch of joint values q (rad). psi is measured on the computed pose, so
/// that the inverse uses the same circle.
inline Posture forward(const Arm& arm, const double* q) noexcept {
    const Chain chain_now = chain(arm, q);
    Posture out;
    out.pose = user_pose(arm, chain_now.flange);
    const Triad<double> c = triad(arm, flange_pose(arm, out.pose));
    out.psi = is_folded(c) ? not_a_number : arm_angle(c, chain_now.z3);
    out.gc = index(configuration(arm, chain_now.theta));
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
