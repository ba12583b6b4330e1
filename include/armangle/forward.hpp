// Forward kinematics: q -> pose, with the frames that psi and the Jacobian need. Eq. (1), (40)-(46).
#pragma once

#include "arm.hpp"
#include "configuration.hpp"
#include "lane.hpp"

namespace armangle {

/// Axes and origins of the joints in the base frame of the DH rows, and the flange.
struct Chain {
    double theta[joint_slots];
    Vec3<double> axis[joints];    // z_{i-1}: what joint i turns about
    Vec3<double> origin[joints];  // a point of that axis
    Vec3<double> z3;              // third column of 0R3: the elbow axis
    Pose<double> flange;          // 0T7
};

namespace detail {

/// frame * i-1_T_i of eq. (1), where alpha = twist * pi/2.
inline Pose<double> dh_step(const Pose<double>& from, const SinCos<double>& theta, int twist, double d, double a) noexcept {
    const auto& [x, y, z] = from.rotation;
    const Vec3<double> x_new = x * theta.cos + y * theta.sin;
    const Vec3<double> across = y * theta.cos - x * theta.sin;
    Pose<double> to;
    to.rotation.x = x_new;
    to.rotation.y = twist == 0 ? across : (twist > 0 ? z : -z);
    to.rotation.z = twist == 0 ? z : (twist > 0 ? -across : across);
    to.position = mul_add(z, d, from.position);
    if (a != 0) to.position = mul_add(x_new, a, to.position);
    return to;
}

}  // namespace detail

/// The chain at joint values q (rad, robot coordinates). Table 1 with a_3 and a_4.
inline Chain chain(const Arm& arm, const double* q) noexcept {
    constexpr int twist[joints] = {-1, 1, 1, -1, -1, 1, 0};
    const double d[joints] = {arm.d_bs, 0, arm.d_se, 0, arm.d_ew, 0, arm.d_wf};
    const double a[joints] = {0, 0, arm.a_3, arm.a_4, 0, 0, 0};
    using Slots = Lane<joint_slots>;
    double padded[joint_slots] = {}, sine[joint_slots], cosine[joint_slots];
    for (int i = 0; i < joints; ++i) padded[i] = q[i];
    const Slots theta = model_angle(Slots::load(padded), Slots::load(arm.joint_sign), Slots::load(arm.joint_offset));
    const SinCos<Slots> sc = sin_cos(theta);
    sc.sin.store(sine);
    sc.cos.store(cosine);
    Chain out;
    theta.store(out.theta);
    Pose<double> frame = identity_pose();
    for (int i = 0; i < joints; ++i) {
        out.axis[i] = frame.rotation.z;
        out.origin[i] = frame.position;
        frame = detail::dh_step(frame, {sine[i], cosine[i]}, twist[i], d[i], a[i]);
        if (i == 2) out.z3 = frame.rotation.z;
    }
    out.flange = frame;
    return out;
}

/// GC of model angles, eq. (2); the elbow's relative to the stretched arm.
inline Configuration<double> configuration(const Arm& arm, const double* theta) noexcept {
    const auto sign = [](double angle) { return wrap(angle) < 0 ? -1.0 : 1.0; };
    return {sign(theta[1]), sign(theta[3] - arm.delta_angle), sign(theta[5])};
}

}  // namespace armangle
