// Link frames at joint values q: the DH rows of table 1 multiplied in order. Eq. (1), (40)-(46).
#pragma once

#include "joint_map.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A joint configuration in the base frame of the DH rows.
struct Chain {
    double theta[joint_slots];
    Vec3<double> z3;      // third column of 0R3: the elbow axis
    Pose<double> flange;  // 0T7
};

namespace detail {

/// The DH step of eq. (1), with alpha = twist * pi/2: from * Rot_z(theta) Trans(a, 0, d) Rot_x(alpha).
template <int twist, class T>
ARMANGLE_INLINE Pose<T> dh_step(const Pose<T>& from, const T& sine, const T& cosine, double d,
                                double a) noexcept {
    const auto& [x, y, z] = from.rotation;
    const Vec3<T> across = combine(y, cosine, x, -sine);
    Pose<T> to;
    to.rotation.x = combine(x, cosine, y, sine);
    if constexpr (twist == 0) {
        to.rotation.y = across;
        to.rotation.z = z;
    } else {
        to.rotation.y = twist > 0 ? z : -z;
        to.rotation.z = twist > 0 ? -across : across;
    }
    to.position = d != 0 ? mul_add(z, T(d), from.position) : from.position;
    if (a != 0) to.position = mul_add(to.rotation.x, T(a), to.position);
    return to;
}

/// Multiplies the DH rows for these joint angles (sine and cosine) and calls visit(i, 0Ti) for i = 0..7.
/// Table 1 with a_3, a_4 and d_4.
template <class T, class Visit>
ARMANGLE_INLINE void walk(const Arm& arm, const SinCos<T>* angle, const Visit& visit) noexcept {
    Pose<T> frame = spread<T>(identity_pose());
    visit(0, frame);
    visit(1, frame = dh_step<-1>(frame, angle[0].sin, angle[0].cos, arm.d_bs, 0.0));
    visit(2, frame = dh_step<1>(frame, angle[1].sin, angle[1].cos, 0.0, 0.0));
    visit(3, frame = dh_step<1>(frame, angle[2].sin, angle[2].cos, arm.d_se, arm.a_3));
    visit(4, frame = dh_step<-1>(frame, angle[3].sin, angle[3].cos, arm.d_4, arm.a_4));
    visit(5, frame = dh_step<-1>(frame, angle[4].sin, angle[4].cos, arm.d_ew, 0.0));
    visit(6, frame = dh_step<1>(frame, angle[5].sin, angle[5].cos, 0.0, 0.0));
    visit(7, frame = dh_step<0>(frame, angle[6].sin, angle[6].cos, arm.d_wf, 0.0));
}

/// Multiplies the DH rows at joint values q (rad), calls visit(i, 0Ti) for i = 0..7, and writes the model
/// angles theta (rad) to `theta_out`.
template <class Visit>
ARMANGLE_INLINE void walk(const Arm& arm, const JointLanes& q, double* theta_out,
                          const Visit& visit) noexcept {
    double s[joint_slots], c[joint_slots];
    const JointLanes theta = to_theta(q, JointLanes::load(arm.sign), JointLanes::load(arm.offset));
    const SinCos<JointLanes> both = sin_cos(theta);
    both.sin.store(s);
    both.cos.store(c);
    theta.store(theta_out);
    SinCos<double> angle[joints];
    for (int j = 0; j < joints; ++j) angle[j] = {s[j], c[j]};
    walk(arm, angle, visit);
}

/// The flange pose 0T7 for model angles theta (sine and cosine).
template <class T>
ARMANGLE_INLINE Pose<T> nominal_flange(const Arm& arm, const SinCos<T>* angle) noexcept {
    Pose<T> out;
    walk(arm, angle, [&out](int i, const Pose<T>& frame) noexcept {
        if (i == joints) out = frame;
    });
    return out;
}

}  // namespace detail

/// Computes elbow axis, flange pose and theta at joint values q (rad, robot coordinates).
ARMANGLE_INLINE Chain chain(const Arm& arm, const JointLanes& q) noexcept {
    Chain out;
    detail::walk(arm, q, out.theta, [&out](int i, const Pose<double>& frame) noexcept {
        if (i == 3) out.z3 = frame.rotation.z;
        if (i == joints) out.flange = frame;
    });
    return out;
}

/// Computes elbow axis, flange pose and theta at an array of seven joint values (rad).
inline Chain chain(const Arm& arm, const double* q) noexcept { return chain(arm, joint_lanes(q)); }

/// Pose of the end effector at joint values q, in the user's frame.
inline Pose<double> tool_pose(const Arm& arm, const double* q) noexcept {
    return user_pose(arm, chain(arm, q).flange);
}

/// Writes the DH frames 0..7 at joint values q to `out`, in the frame that poses are given in: base 0Ti. The
/// last one is the flange, without the tool.
inline void frames(const Arm& arm, const double* q, Pose<double> (&out)[joints + 1]) noexcept {
    double theta[joint_slots];
    detail::walk(arm, joint_lanes(q), theta,
                 [&](int i, const Pose<double>& frame) { out[i] = arm.has_base ? arm.base * frame : frame; });
}

/// The elbow E at joint values q (m), in the frame that poses are given in. E is the point of joint 4's axis
/// nearest to the shoulder and the origin of DH frame 3. |S-E| is La, also for an offset elbow.
inline Vec3<double> elbow_position(const Arm& arm, const double* q) noexcept {
    double theta[joint_slots];
    Vec3<double> out{};
    detail::walk(arm, joint_lanes(q), theta, [&](int i, const Pose<double>& frame) noexcept {
        if (i == 3) out = arm.has_base ? (arm.base * frame).position : frame.position;
    });
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
