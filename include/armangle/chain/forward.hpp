// The forward kinematics of a nearly S-R-S arm: frames, Jacobian and posture of its own chain, eq. (1) with
// links in place of DH rows.
#pragma once

#include <initializer_list>

#include "../arm/jacobian.hpp"
#include "../circle/forward.hpp"
#include "chain_arm.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Calls visit(k, frame) with the true frame of joint k + 1 before its rotation, for k = 0..6, and with the
/// pose of the end effector for k = 7; angle[k] is theta_{k+1}.
template <class T, class Visit>
ARMANGLE_INLINE void walk_links(const ChainArm& arm, const SinCos<T>* angle, const Visit& visit) noexcept {
    Pose<T> frame = spread<T>(arm.link[0]);
    for (int k = 0; k < joints; ++k) {
        visit(k, frame);
        frame = turned_about_z(frame, angle[k]) * spread<T>(arm.link[k + 1]);
    }
    visit(joints, frame);
}

/// The true pose of the end effector, in the frame that poses are given in, for the sines and cosines of
/// theta.
template <class T>
ARMANGLE_INLINE Pose<T> tip(const ChainArm& arm, const SinCos<T>* angle) noexcept {
    Pose<T> out;
    walk_links(arm, angle, [&out](int k, const Pose<T>& frame) noexcept {
        if (k == joints) out = frame;
    });
    return out;
}

/// Writes the sines and cosines of seven angles (rad) to `out`.
inline void sin_cos_all(const double* theta, SinCos<double> (&out)[joints]) noexcept {
    const SinCos<JointLanes> both = sin_cos(joint_lanes(theta));
    for (int j = 0; j < joints; ++j) out[j] = {both.sin[j], both.cos[j]};
}

/// Writes the model angles theta (rad) of seven joint values to `theta`.
inline void theta_of(const Arm& arm, const double* q, double (&theta)[joints]) noexcept {
    for (int j = 0; j < joints; ++j) theta[j] = to_theta(arm, j, q[j]);
}

/// The smallest distance (rad) of theta_2, theta_4 - delta and theta_6 from 0 and pi at joint values q.
inline double singular_distance(const Arm& nominal, const double* q) noexcept {
    double theta[joints], least = infinity;
    theta_of(nominal, q, theta);
    for (const int j : {1, 3, 5}) {
        const double off = abs(wrap(theta[j] - (j == 3 ? nominal.delta_angle : 0.0)));
        least = min(least, min(off, pi - off));
    }
    return least;
}

/// The elbow axis z_3 of the nominal arm, in its base frame: eq. (15), the third column of 0R3.
template <class T>
ARMANGLE_INLINE Vec3<T> elbow_axis(const SinCos<T>* a) noexcept {
    return {a[0].cos * a[1].cos * a[2].sin + a[0].sin * a[2].cos,
            a[0].sin * a[1].cos * a[2].sin - a[0].cos * a[2].cos, -(a[1].sin * a[2].sin)};
}

}  // namespace detail

/// Writes the true frames 0..7 at joint values q to `out`, in the frame that poses are given in: joint i
/// rotates about the z axis of frame i - 1, and frame 7 times the tool is the pose.
inline void frames(const ChainArm& arm, const double* q, Pose<double> (&out)[joints + 1]) noexcept {
    double theta[joints];
    SinCos<double> angle[joints];
    detail::theta_of(arm.nominal, q, theta);
    detail::sin_cos_all(theta, angle);
    detail::walk_links(arm, angle, [&out](int k, const Pose<double>& frame) noexcept { out[k] = frame; });
    out[joints] = out[joints] * arm.nominal.tool_inverse;
}

/// The pose of the end effector at joint values q, in the frame that poses are given in.
inline Pose<double> tool_pose(const ChainArm& arm, const double* q) noexcept {
    double theta[joints];
    SinCos<double> angle[joints];
    detail::theta_of(arm.nominal, q, theta);
    detail::sin_cos_all(theta, angle);
    return detail::tip(arm, angle);
}

/// The position of the elbow: the origin of true frame 3 (m, in the frame of poses).
inline Vec3<double> elbow_position(const ChainArm& arm, const double* q) noexcept {
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    return frame[3].position;
}

/// The geometric Jacobian of the true chain, of the end effector in the frame that poses are given in, as
/// that of an S-R-S arm.
inline Jacobian jacobian(const ChainArm& arm, const double* q) noexcept {
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    return detail::jacobian_of(arm.nominal, frame);
}

/// The pose, psi and GC of joint values q of the true chain. GC is that of the nominal arm at the same theta;
/// psi is measured by its elbow axis from the reference plane of the true pose.
inline Posture forward(const ChainArm& arm, const double* q) noexcept {
    double theta[joint_slots] = {};
    SinCos<double> angle[joints];
    for (int j = 0; j < joints; ++j) theta[j] = to_theta(arm.nominal, j, q[j]);
    detail::sin_cos_all(theta, angle);
    Posture out;
    out.pose = detail::tip(arm, angle);
    const Triad<double> on = triad(arm.nominal, flange_pose(arm.nominal, out.pose));
    out.psi = is_folded(on) ? not_a_number : arm_angle(on, detail::elbow_axis(angle));
    out.gc = index(configuration(arm.nominal, theta));
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
