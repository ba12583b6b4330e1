// Gradients the way back: what a function of the results falls by, as a gradient by what was given.
//
// A gradient by the sixteen entries of a pose counts along motions of a rigid body alone, dp = v and
// dR = omega x R. Of the gradients that agree there the one of least size is given.
#pragma once

#include "../numbers/arrays.hpp"
#include "derivatives.hpp"
#include "forward.hpp"

namespace armangle {

/// The gradient by the twist (v, omega) of a pose from that by its entries, 4x4 row by row.
inline void twist_gradient(const Pose<double>& pose, const double* by_entry, double (&by_twist)[6]) noexcept {
    const Pose<double> g = load_pose(by_entry);
    const auto& [x, y, z] = pose.rotation;
    const Vec3<double> omega = cross(x, g.rotation.x) + cross(y, g.rotation.y) + cross(z, g.rotation.z);
    const double all[6] = {g.position.x, g.position.y, g.position.z, omega.x, omega.y, omega.z};
    for (int k = 0; k < 6; ++k) by_twist[k] = all[k];
}

/// The least gradient by the entries of a pose whose part along motions is the gradient by the twist.
inline void pose_gradient(const Pose<double>& pose, const double (&by_twist)[6], double* by_entry) noexcept {
    // the sum of x cross (a cross x) over three orthonormal x is 2 a
    const Vec3<double> half = Vec3<double>{by_twist[3], by_twist[4], by_twist[5]} * 0.5;
    const Mat3<double> turned{cross(half, pose.rotation.x), cross(half, pose.rotation.y),
                              cross(half, pose.rotation.z)};
    store_pose({turned, {by_twist[0], by_twist[1], by_twist[2]}}, by_entry);
    by_entry[15] = 0;
}

/// The gradient by the joints of forward() from those by the entries of its pose and by its psi.
inline void forward_pullback(const Arm& arm, const double* q, const double* by_pose, double by_psi,
                             double (&by_q)[joints]) noexcept {
    const Jacobian j = jacobian(arm, q);
    double by_twist[6];
    twist_gradient(forward(arm, q).pose, by_pose, by_twist);
    double of_psi[joints] = {};
    if (by_psi != 0) psi_gradient(arm, q, of_psi);  // nobody asks for it, however steep it is
    for (int i = 0; i < joints; ++i) {
        by_q[i] = by_psi != 0 ? by_psi * of_psi[i] : 0.0;
        for (int k = 0; k < 6; ++k) by_q[i] += by_twist[k] * j.entry[k][i];
    }
}

/// The gradient by the entries of the pose and by psi of inverse() from that by its joints. A joint that
/// nobody asks for counts nothing, however steep it is; NaN where there is no posture.
inline void inverse_pullback(const Arm& arm, const Pose<double>& pose, double psi, int gc, const double* by_q,
                             double* by_pose, double& by_psi) noexcept {
    double by_twist[joints] = {};
    bool asked = false;
    for (int j = 0; j < joints; ++j) asked |= by_q[j] != 0;
    if (asked) {
        const Derivatives d = inverse_derivative(arm, pose, psi, gc);
        for (int j = 0; j < joints; ++j)
            if (by_q[j] != 0)
                for (int k = 0; k < joints; ++k) by_twist[k] += by_q[j] * d.entry[j][k];
    }
    const double along[6] = {by_twist[0], by_twist[1], by_twist[2], by_twist[3], by_twist[4], by_twist[5]};
    pose_gradient(pose, along, by_pose);
    by_psi = by_twist[6];
}

}  // namespace armangle
