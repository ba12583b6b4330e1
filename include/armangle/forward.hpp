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

namespace detail {

/// Walks the DH rows at joint values q: visit(i, 0Ti) for i = 0..7; theta is stored on the way. Table 1 with a_3 and a_4.
template <class Visit>
void walk(const Arm& arm, const double* q, double* theta_out, const Visit& visit) noexcept {
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
    theta.store(theta_out);
    Pose<double> frame = identity_pose();
    for (int i = 0; i < joints; ++i) {
        visit(i, frame);
        frame = dh_step(frame, {sine[i], cosine[i]}, twist[i], d[i], a[i]);
    }
    visit(joints, frame);
}

}  // namespace detail

/// The chain at joint values q (rad, robot coordinates).
inline Chain chain(const Arm& arm, const double* q) noexcept {
    Chain out;
    detail::walk(arm, q, out.theta, [&out](int i, const Pose<double>& frame) {
        if (i == 3) out.z3 = frame.rotation.z;
        if (i == joints) {
            out.flange = frame;
            return;
        }
        out.axis[i] = frame.rotation.z;
        out.origin[i] = frame.position;
    });
    return out;
}

/// The DH frames 0..7 at joint values q, in the frame that poses are given in: base 0Ti; the last is the flange, without the tool.
inline void frames(const Arm& arm, const double* q, Pose<double> (&out)[joints + 1]) noexcept {
    double theta[joint_slots];
    detail::walk(arm, q, theta, [&](int i, const Pose<double>& frame) { out[i] = arm.has_base ? arm.base * frame : frame; });
}

/// GC of model angles, eq. (2); the elbow's relative to the stretched arm.
inline Configuration<double> configuration(const Arm& arm, const double* theta) noexcept {
    const auto sign = [](double angle) { return wrap(angle) < 0 ? -1.0 : 1.0; };
    return {sign(theta[1]), sign(theta[3] - arm.delta_angle), sign(theta[5])};
}

}  // namespace armangle
