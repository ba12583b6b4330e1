// The two doors of an arm with an offset wrist: forward, q -> (pose, free, GC), and inverse, (pose, free, GC)
// -> q.
#pragma once

#include "../arm/jacobian.hpp"
#include "../numbers/rotations.hpp"
#include "offset_motion.hpp"

namespace armangle {

/// What forward kinematics says of a posture: `free` is the free joint's value (rad, robot coordinates) as an
/// angle in (-pi, pi].
struct OffsetPosture {
    Pose<double> pose;
    double free;
    int gc;
};

/// q -> (pose, free, GC).
inline OffsetPosture forward(const OffsetArm& arm, const double* q) noexcept {
    double theta[joint_slots];
    Pose<double> frame[joints + 1];
    frames(arm, q, theta, frame);
    const double free = wrap(q[robot_joint(arm, 6)]);
    return {user_pose(arm, frame[joints]), free <= -pi ? pi : free, index(offset_branch(arm, theta))};
}

/// The geometric Jacobian of the tool at the robot's joint values, as the user sees it: rows 0-2 linear
/// velocity, rows 3-5 angular velocity, a column for each joint.
inline Jacobian jacobian(const OffsetArm& arm, const double* q) noexcept {
    double theta[joint_slots];
    Pose<double> frame[joints + 1];
    frames(arm, q, theta, frame);
    // of a mirrored arm the frames are those of the links seen from the flange: C F^-1 C brings them to the
    // base
    const Pose<double> tip = user_pose(arm, frame[joints]);
    const Pose<double> flange = arm.mirrored ? mirrored_pose(frame[joints]) : frame[joints];
    Jacobian out;
    for (int j = 0; j < joints; ++j) {
        Pose<double> at = frame[j];
        double turn = arm.rest.sign[j];
        if (arm.mirrored) {
            at = flange * half_turn_about_x * at;
            turn = -turn;
        }
        at = arm.base * at;
        const Vec3<double> axis = at.rotation.z * turn;
        const Vec3<double> linear = cross(axis, tip.position - at.position);
        const double column[6] = {linear.x, linear.y, linear.z, axis.x, axis.y, axis.z};
        for (int k = 0; k < 6; ++k) out.entry[k][robot_joint(arm, j)] = column[k];
    }
    return out;
}

/// The robot's joints of theta in the order of the formulas: each on the turn within its limits that is
/// nearest to the seed, or to the middle of its range.
inline void put_joints(const OffsetArm& arm, const double* theta, const double* seed, double* q) noexcept {
    const Arm& rest = arm.rest;
    for (int j = 0; j < joints; ++j) {
        const int k = robot_joint(arm, j);
        const double near = seed ? seed[k] : rest.joint_middle[j];
        q[k] = to_q(theta[j], rest.sign[j], rest.offset[j], rest.limits.lower[j], rest.limits.upper[j], near);
    }
}

/// (pose, free, GC) -> q. Else UNREACHABLE (the wrist, at this value of the free joint), NO_POSTURE (axis 5
/// cannot be perpendicular to axis 6 there), or BAD_INPUT.
inline Inverse inverse(const OffsetArm& arm, const Pose<double>& pose, double free, int gc,
                       const double* seed = nullptr) noexcept {
    constexpr double no = not_a_number;
    Inverse out{{no, no, no, no, no, no, no, 0.0}, Status::BAD_INPUT, no};
    if (gc < 0 || gc >= configurations || !(abs(free) <= tolerance::largest_angle)) return out;
    if (!is_rigid(pose) || (seed && !is_finite(seed))) return out;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const OffsetMotion m = offset_motion(arm, exact, gc);
    const SinCos<double> theta_7 = sin_cos(to_theta(arm.rest, 6, free));
    const OffsetWrist<double> wrist = offset_wrist(arm, m, theta_7);
    out.status = Status::UNREACHABLE;
    if (!(wrist.excess <= tolerance::reach * arm.rest.size)) return out;
    out.status = Status::NO_POSTURE;
    const double g2 = wrist.g * wrist.g;
    if (!(wrist.inside >= -tolerance::vanishing * g2) || !(abs(wrist.g) > tolerance::folded * arm.rest.reach))
        return out;
    const Directions<double> d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, 0.0)));
    double theta[joint_slots];
    angles(d).store(theta);
    put_joints(arm, theta, seed, out.q);
    out.status = Status::OK;
    out.margin = limit_margin(arm.limits, out.q);
    return out;
}

}  // namespace armangle
