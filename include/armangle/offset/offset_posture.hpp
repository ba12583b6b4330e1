// The two doors of an arm with an offset wrist: forward, q -> (pose, free, GC), and inverse, (pose, free, GC)
// -> q.
#pragma once

#include "../arm/jacobian.hpp"
#include "../circle/nearest_pose.hpp"
#include "../numbers/jet.hpp"
#include "../numbers/rotations.hpp"
#include "offset_motion.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What forward kinematics says of a posture: `free` is the free joint's value (rad, robot coordinates) as an
/// angle in (-pi, pi].
struct OffsetPosture {
    Pose<double> pose;
    double free;
    int gc;
};

/// The number of a posture that says where the elbow is.
inline double redundancy(const OffsetPosture& posture) noexcept { return posture.free; }

/// q -> (pose, free, GC).
inline OffsetPosture forward(const OffsetArm& arm, const double* q) noexcept {
    double theta[joints];
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    for (int j = 0; j < joints; ++j) theta[j] = to_theta(arm.rest, j, q[robot_joint(arm, j)]);
    const double free = wrap(q[robot_joint(arm, 6)]);
    return {frame[joints] * arm.own.tool, free <= -pi ? pi : free, index(offset_branch(arm, theta))};
}

/// The geometric Jacobian of the tool at the robot's joint values, as the user sees it: rows 0-2 linear
/// velocity, rows 3-5 angular velocity, a column for each joint.
inline Jacobian jacobian(const OffsetArm& arm, const double* q) noexcept {
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    const Vec3<double> tip = (frame[joints] * arm.own.tool).position;
    Jacobian out;
    for (int j = 0; j < joints; ++j) {
        const Vec3<double> axis = frame[j].rotation.z * arm.own.sign[j];
        const Vec3<double> linear = cross(axis, tip - frame[j].position);
        const double column[6] = {linear.x, linear.y, linear.z, axis.x, axis.y, axis.z};
        for (int k = 0; k < 6; ++k) out.entry[k][j] = column[k];
    }
    return out;
}

/// Directions in the order of the robot's joints.
inline Directions<double> in_robot_order(const OffsetArm& arm, const Directions<double>& d) noexcept {
    Directions<double> out = d;
    for (int j = 0; j < joints; ++j) {
        out.y[robot_joint(arm, j)] = d.y[j];
        out.x[robot_joint(arm, j)] = d.x[j];
    }
    return out;
}

namespace detail {

/// theta_5 where g = 0, S on axis 5: joints 3 and 5 turn about that axis as they like. It is the seed's where
/// that is of the branch, else 0 or pi.
inline SinCos<double> free_theta_5(const OffsetArm& arm, const OffsetMotion<>& m,
                                   const double* seed) noexcept {
    const double side = m.branch.wrist;
    if (!seed) return {0.0, side};
    const SinCos<double> wanted = sin_cos(to_theta(arm.rest, 4, seed[robot_joint(arm, 4)]));
    return wanted.cos * side > 0 ? wanted : SinCos<double>{0.0, side};
}

/// theta_1 where theta_2 is no more than `straight` (a sine) off 0 or pi, and joints 1 and 3 turn about one
/// axis: the seed's, theta_3 takes the rest.
inline void share_turn(const OffsetArm& arm, const double* seed, double straight,
                       Directions<double>& d) noexcept {
    if (!seed || !(abs(d.y[1]) <= straight)) return;
    const SinCos<double> a = sin_cos(to_theta(arm.rest, 0, seed[robot_joint(arm, 0)]));
    const double flip = d.x[1] < 0 ? -1.0 : 1.0;  // about opposite axes they take from one another
    const double back = d.y[0] * a.cos - d.x[0] * a.sin, along = d.x[0] * a.cos + d.y[0] * a.sin;
    const double y = d.y[2] * along + flip * d.x[2] * back, x = d.x[2] * along - flip * d.y[2] * back;
    d.y[0] = a.sin;
    d.x[0] = a.cos;
    d.y[2] = y;
    d.x[2] = x;
}

}  // namespace detail

/// The angles of a pose (its rotation exact), a value of the free joint and a branch, as directions in the
/// robot's order, where the status is OK: else UNREACHABLE (the wrist, at this value of the free joint),
/// NO_POSTURE (axis 5 cannot be square to axis 6 there) or NEAR_SINGULAR (every direction of axis 5 would
/// do).
inline Status directions(const OffsetArm& arm, const Pose<double>& exact, double free, int gc,
                         const double* seed, Directions<double>& out) noexcept {
    const OffsetMotion<> m = offset_motion(arm, exact, gc);
    const SinCos<double> theta_7 = sin_cos(to_theta(arm.rest, 6, free));
    const OffsetWrist<double> wrist = offset_wrist(arm, m, theta_7);
    if (!(wrist.excess <= tolerance::reach * arm.rest.size)) return Status::UNREACHABLE;
    const double square = wrist.length * wrist.length, across = square - wrist.t * wrist.t;
    if (!(wrist.inside >= -tolerance::vanishing * square)) return Status::NO_POSTURE;
    if (!(across > tolerance::touching * square)) return Status::NEAR_SINGULAR;
    Directions<double> d;
    if (abs(wrist.g) > tolerance::folded * arm.rest.reach)
        d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, 0.0)));
    else
        d = directions(m, wrist, theta_7, detail::free_theta_5(arm, m, seed), 0.0);
    detail::share_turn(arm, seed, tolerance::one_axis, d);
    out = in_robot_order(arm, d);
    return Status::OK;
}

/// (pose, free, GC) -> q, each joint on the turn within its limits that is nearest to the seed, or to the
/// middle of its range. Else a status of directions(), or BAD_INPUT.
inline Inverse inverse(const OffsetArm& arm, const Pose<double>& pose, double free, int gc,
                       const double* seed = nullptr) noexcept {
    constexpr double no = not_a_number;
    Inverse out{{no, no, no, no, no, no, no, 0.0}, Status::BAD_INPUT, no};
    if (gc < 0 || gc >= configurations || !(abs(free) <= tolerance::largest_angle)) return out;
    if (!is_rigid(pose) || (seed && !is_finite(seed))) return out;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    Directions<double> d;
    out.status = directions(arm, exact, free, gc, seed, d);
    if (out.status != Status::OK) return out;
    const Joints found = joints_within_limits(arm.own, d, seed);
    for (int j = 0; j < joints; ++j) out.q[j] = found.q[j];
    out.margin = limit_margin(arm.own.limits, out.q);
    return out;
}

/// theta of all joints, in the order of the formulas, with derivatives by the free joint, at a value of it
/// that has a posture.
template <int N>
void angles_along(const OffsetArm& arm, const OffsetMotion<>& m, double free,
                  Jet<double, N> (&theta)[joints]) noexcept {
    using J = Jet<double, N>;
    const SinCos<J> theta_7 = sin_cos(J(arm.rest.sign[6]) * J::variable(free) + J(arm.rest.offset[6]));
    const OffsetWrist<J> wrist = offset_wrist(arm, m, theta_7);
    const Directions<J> d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, J(0.0))));
    for (int j = 0; j < joints; ++j) theta[j] = atan2(d.y[j], d.x[j]);
}

/// dq/d(free joint) at a fixed pose, in `q` (rad/rad): the motion that leaves the tool where it is. Infinite
/// where it does not exist: of joints whose axes meet at theta_2 = 0 or pi, and at a fold. Else a status of
/// inverse().
inline Inverse self_motion_rate(const OffsetArm& arm, const Pose<double>& pose, double free,
                                int gc) noexcept {
    Inverse out = inverse(arm, pose, free, gc);
    if (out.status != Status::OK) return out;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    Jet<double, 1> theta[joints];
    angles_along(arm, offset_motion(arm, exact, gc), free, theta);
    for (int j = 0; j < joints; ++j) {
        const double rate = arm.rest.sign[j] * theta[j].coefficient[1];
        out.q[robot_joint(arm, j)] = is_nan(rate) ? infinity : rate;
    }
    return out;
}

/// By how much a value of the free joint puts the wrist beyond the reach, or inside the inner reach (m).
inline double reach_excess(const OffsetArm& arm, const Pose<double>& pose, double free) noexcept {
    const OffsetMotion<> m = offset_motion(arm, Pose<double>{orthonormal(pose.rotation), pose.position}, 0);
    return offset_wrist(arm, m, sin_cos(to_theta(arm.rest, 6, free))).excess;
}

/// The same at the value of the free joint at which it is least; the wrist's distance from the shoulder has
/// one sine.
inline double reach_excess(const OffsetArm& arm, const Pose<double>& pose) noexcept {
    const OffsetMotion<> m = offset_motion(arm, Pose<double>{orthonormal(pose.rotation), pose.position}, 0);
    const Vec3<double>& s = m.from_shoulder;
    const double fixed = dot(s, s) + arm.a_6 * arm.a_6;
    const double swing = 2.0 * abs(arm.a_6) * hypot(dot(m.flange.x, s), dot(m.flange.y, s));
    const double nearest = sqrt(max(fixed - swing, 0.0)), farthest = sqrt(fixed + swing);
    return max(nearest - arm.rest.reach, arm.rest.inner_reach - farthest);
}

/// The nearest pose of the same orientation within reach, ignoring limits, and its distance (m) from this
/// one: the wrist moves along its line from the shoulder, at the value of the free joint at which it has
/// least to go.
inline NearestPose nearest_within_reach(const OffsetArm& arm, const Pose<double>& pose) noexcept {
    const double gap = reach_excess(arm, pose);
    if (!(gap > 0)) return {pose, 0.0};
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const OffsetMotion<> m = offset_motion(arm, exact, 0);
    const Vec3<double>& s = m.from_shoulder;
    const double along_x = dot(s, m.flange.x), along_y = dot(s, m.flange.y), size = hypot(along_x, along_y);
    const Vec3<double> flat =
        size > 0 ? m.flange.x * (along_x / size) + m.flange.y * (along_y / size) : m.flange.x;
    const double nearest = norm(s - flat * abs(arm.a_6)), sign = nearest > arm.rest.reach ? 1.0 : -1.0;
    const Vec3<double> w = s - flat * (sign * abs(arm.a_6));
    const double length = norm(w);
    Vec3<double> shift = (length > 0 ? w * (1.0 / length) : Vec3<double>{0, 0, 1}) * (-sign * gap);
    if (arm.mirrored) shift = -(flange_pose(arm.own, exact).rotation * (half_turn_about_x.rotation * shift));
    if (arm.own.has_base) shift = arm.own.base.rotation * shift;
    return {{pose.rotation, pose.position + shift}, gap};
}

}  // namespace armangle

#include "../names/end.hpp"
