// The arm angle psi of a posture. Eq. (8)-(11), by the elbow axis: full precision at 0 and pi, defined on a straight arm.
#pragma once

#include "circle.hpp"
#include "../arm/forward.hpp"

namespace armangle {

/// psi of an elbow axis z_3 on a circle, in (-pi, pi].
inline double arm_angle(const Triad<double>& c, const Vec3<double>& z3) noexcept {
    const double psi = atan2(dot(c.e, z3), dot(c.z, z3));  // w . (z x z3) = z3 . (w x z)
    return psi <= -pi ? pi : psi;
}

/// What forward kinematics says of a posture.
struct Posture {
    Pose<double> pose;  // as the user sees it
    double psi;         // NaN where the wrist lies on the shoulder
    int gc;             // 0..7
};

/// q -> (pose, psi, GC). The triad is taken from the pose, so that the inverse sees the same one.
inline Posture forward(const Arm& arm, const double* q) noexcept {
    const Chain chain_now = chain(arm, q);
    Posture out;
    out.pose = user_pose(arm, chain_now.flange);
    const Triad<double> c = triad(arm, flange_pose(arm, out.pose));
    out.psi = is_folded(arm, c) ? not_a_number : arm_angle(c, chain_now.z3);
    out.gc = index(configuration(arm, chain_now.theta));
    return out;
}

}  // namespace armangle
