// The geometric Jacobian: velocity of the end effector per joint velocity, one column a joint.
#pragma once

#include "frames.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Six rows, seven columns, per rad/s of q. Rows 0-2 are the linear velocity of the end effector's origin,
/// rows 3-5 the angular velocity.
struct Jacobian {
    double entry[6][joints];
};

namespace detail {

/// Stores the Jacobian column of a joint (0..6) that rotates around the unit vector `axis`; `lever` (m) leads
/// from the axis to the end effector's origin.
inline void put_column(Jacobian& to, int joint, const Vec3<double>& axis,
                       const Vec3<double>& lever) noexcept {
    const Vec3<double> linear = cross(axis, lever);
    const double column[6] = {linear.x, linear.y, linear.z, axis.x, axis.y, axis.z};
    for (int k = 0; k < 6; ++k) to.entry[k][joint] = column[k];
}

/// The Jacobian of an arm whose joint i (0..6) rotates around the z axis of frame[i], with its end effector
/// behind frame[7]: of frames in the user's frame, and the signs and the tool of `rows`.
inline Jacobian jacobian_of(const Arm& rows, const Pose<double> (&frame)[joints + 1]) noexcept {
    const Vec3<double> tip = (frame[joints] * rows.tool).position;
    Jacobian out;
    for (int i = 0; i < joints; ++i)
        put_column(out, i, frame[i].rotation.z * rows.sign[i], tip - frame[i].position);
    return out;
}

}  // namespace detail

/// Geometric Jacobian of the end effector at joint values q (rad), in the user's frame: rows 0-2 linear, rows
/// 3-5 angular velocity.
inline Jacobian jacobian(const Arm& arm, const double* q) noexcept {
    double theta[joint_slots];
    Pose<double> frame[joints + 1];
    detail::walk(arm, joint_lanes(q), theta,
                 [&frame](int i, const Pose<double>& at) noexcept { frame[i] = at; });
    const Vec3<double> tip = (frame[joints] * arm.tool).position;
    Jacobian out;
    for (int i = 0; i < joints; ++i) {
        const Vec3<double> axis = arm.base.rotation * (frame[i].rotation.z * arm.sign[i]);
        const Vec3<double> lever = arm.base.rotation * (tip - frame[i].position);
        detail::put_column(out, i, axis, lever);
    }
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
