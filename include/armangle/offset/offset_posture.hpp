// Kinematics of an arm with an offset wrist or shoulder: forward, q -> (pose, free, GC), and inverse, (pose,
// free, GC) -> q.
#pragma once

#include "../arm/jacobian.hpp"
#include "../circle/nearest_pose.hpp"
#include "../numbers/jet.hpp"
#include "../numbers/rotations.hpp"
#include "offset_motion.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The result of forward kinematics: `free` is the value of the free joint (rad, robot coordinates), wrapped
/// to (-pi, pi].
struct OffsetPosture {
    Pose<double> pose;
    double free;
    int gc;
};

/// The free joint's value (rad), under the name that all kinds of arm share for their redundant parameter.
inline double redundancy(const OffsetPosture& posture) noexcept { return posture.free; }

/// Forward kinematics: pose, free joint and branch of joint values q (rad).
inline OffsetPosture forward(const OffsetArm& arm, const double* q) noexcept {
    double theta[joints];
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    for (int j = 0; j < joints; ++j) theta[j] = to_theta(arm.rest, j, q[robot_joint(arm, j)]);
    const double free = wrap(q[robot_joint(arm, 6)]);
    return {frame[joints] * arm.own.tool, free <= -pi ? pi : free, index(offset_branch(arm, theta))};
}

/// The geometric Jacobian of the end effector at joint values q, in the user's frame: rows 0-2 linear, rows
/// 3-5 angular velocity, one column a joint.
inline Jacobian jacobian(const OffsetArm& arm, const double* q) noexcept {
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    return detail::jacobian_of(arm.own, frame);
}

/// Reorders directions to the order of the robot's joints.
inline Directions<double> in_robot_order(const OffsetArm& arm, const Directions<double>& d) noexcept {
    Directions<double> out = d;
    for (int j = 0; j < joints; ++j) {
        out.y[robot_joint(arm, j)] = d.y[j];
        out.x[robot_joint(arm, j)] = d.x[j];
    }
    return out;
}

namespace detail {

/// Chooses theta_5 (sine and cosine) if g = 0: the shoulder lies on axis 5, so that joints 3 and 5 rotate
/// around one axis. It is the seed's if that belongs to the branch, else 0 or pi.
inline SinCos<double> free_theta_5(const OffsetArm& arm, const OffsetMotion<>& m,
                                   const double* seed) noexcept {
    const double side = m.branch.wrist;
    if (!seed) return {0.0, side};
    const SinCos<double> wanted = sin_cos(to_theta(arm.rest, 4, seed[robot_joint(arm, 4)]));
    return wanted.cos * side > 0 ? wanted : SinCos<double>{0.0, side};
}

/// If |sin theta_2| is at most `straight`, joints 1 and 3 rotate around one axis: in d, theta_1 becomes the
/// seed's and theta_3 takes the rest. Otherwise, or if `seed` is null, d is unchanged.
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

/// Joints `first` and `last` (0..6) rotate around one axis, so that the pose determines theta_last + way *
/// theta_first alone, way = 1 or -1. Moves as little turn as possible from one to the other for both to be
/// within their limits; changes nothing if no share is.
[[gnu::noinline, gnu::cold]] inline void share_within(const Arm& arm, int first, int last, double way,
                                                      double* q) noexcept {
    const Limits& limits = arm.limits;
    const double sign[] = {arm.sign[first], -way * arm.sign[last]};
    const double slacks[] = {0.0, tolerance::isolated};
    for (const double slack : slacks) {
        double least = infinity, to[2] = {q[first], q[last]};
        for (int m = -2; m <= 2; ++m)
            for (int n = -2; n <= 2; ++n) {
                const int joint[] = {first, last}, turns[] = {m, n};
                double lower = -pi, upper = pi;
                for (int k = 0; k < 2; ++k) {
                    const double at = q[joint[k]] + two_pi * turns[k];
                    const double a = sign[k] * (limits.lower[joint[k]] - slack - at),
                                 b = sign[k] * (limits.upper[joint[k]] + slack - at);
                    lower = max(lower, min(a, b));
                    upper = min(upper, max(a, b));
                }
                const double moved = min(max(0.0, lower), upper);
                if (!(lower <= upper && abs(moved) < least)) continue;
                least = abs(moved);
                for (int k = 0; k < 2; ++k) to[k] = q[joint[k]] + two_pi * turns[k] + sign[k] * moved;
            }
        if (!(least < infinity)) continue;
        q[first] = to[0];
        q[last] = to[1];
        return;
    }
}

}  // namespace detail

/// Writes the directions of all joints, in the robot's order, for a pose with an exact rotation, a value of
/// the free joint and a branch to `out`. The seed (joint values, or null) decides how joints about one axis
/// share a turn. Returns OK, or UNREACHABLE (the wrist, at this value of the free joint), NO_POSTURE (axis 5
/// cannot be orthogonal to axis 6 there) or NEAR_SINGULAR (axis 5 may have any direction); then `out` is
/// unchanged.
inline Status directions(const OffsetArm& arm, const Pose<double>& exact, double free, int gc,
                         const double* seed, Directions<double>& out) noexcept {
    const OffsetMotion<> m = offset_motion(arm, exact, gc);
    const SinCos<double> theta_7 = sin_cos(to_theta(arm.rest, 6, free));
    OffsetWrist<double> wrist = offset_wrist(arm, m, theta_7);
    const double rounding = tolerance::reach * arm.rest.size;
    if (!(wrist.excess <= rounding)) return Status::UNREACHABLE;
    const double across = hypot(wrist.u, wrist.v);
    if (across < abs(wrist.g))  // g^2 - t^2 = u^2 + v^2 - h^2, here with more digits
        wrist.inside = (across - wrist.h) * (across + wrist.h);
    if (!(wrist.inside >= 0) && !(take_fold(arm, wrist) <= rounding)) return Status::NO_POSTURE;
    if (!(across * across > tolerance::touching * wrist.length * wrist.length)) return Status::NEAR_SINGULAR;
    Directions<double> d;
    if (abs(wrist.g) > tolerance::folded * arm.rest.reach)
        d = directions(m, wrist, theta_7, sqrt(wrist.inside));
    else
        d = directions(m, wrist, theta_7, detail::free_theta_5(arm, m, seed), 0.0);
    detail::share_turn(arm, seed, tolerance::one_axis, d);
    out = in_robot_order(arm, d);
    return Status::OK;
}

/// Inverse kinematics: joint values of (pose, free joint, branch gc), each in the revolution within its
/// limits nearest to the seed, or to the middle of its range without one. Otherwise they are NaN, with a
/// status of directions() or BAD_INPUT.
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
    if (seed || out.margin >= 0) return out;
    // joints 1 and 3 about one axis; 3 and 5 where an elbow without offsets is stretched
    const bool plain = arm.rest.a_3 == 0 && arm.rest.a_4 == 0;
    for (int j = 1; j <= 3; j += 2) {
        const int hinge = robot_joint(arm, j);
        if ((j == 3 && !plain) || !(abs(d.y[hinge]) <= tolerance::one_axis)) continue;
        const double way = d.x[hinge] < 0 ? -1.0 : 1.0;
        detail::share_within(arm.own, robot_joint(arm, j - 1), robot_joint(arm, j + 1), way, out.q);
    }
    out.margin = limit_margin(arm.own.limits, out.q);
    return out;
}

/// Computes theta of all joints, in the order of the formulas, with derivatives with respect to the free
/// joint, at a value that has a solution, or over cells of such values.
template <class T, int N>
void angles_along(const OffsetArm& arm, const OffsetMotion<>& m, const Jet<T, N>& free,
                  Jet<T, N> (&theta)[joints]) noexcept {
    using J = Jet<T, N>;
    const SinCos<J> theta_7 = sin_cos(J(arm.rest.sign[6]) * free + J(arm.rest.offset[6]));
    const OffsetWrist<J> wrist = offset_wrist(arm, m, theta_7);
    const Directions<J> d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, J(0.0))));
    for (int j = 0; j < joints; ++j) theta[j] = atan2(d.y[j], d.x[j]);
}

/// The derivatives dq/d(free joint) at a fixed pose, in `q` (rad/rad). Infinite where they do not exist: for
/// joints that rotate around one axis at theta_2 = 0 or pi, and at a fold. Without a solution, NaN and the
/// status of inverse().
inline Inverse self_motion_rate(const OffsetArm& arm, const Pose<double>& pose, double free,
                                int gc) noexcept {
    Inverse out = inverse(arm, pose, free, gc);
    if (out.status != Status::OK) return out;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    Jet<double, 1> theta[joints];
    angles_along(arm, offset_motion(arm, exact, gc), Jet<double, 1>::variable(free), theta);
    const bool one_axis = abs(sin_cos(theta[1].value()).sin) <= tolerance::rounding;
    for (int j = 0; j < joints; ++j) {
        const double rate = arm.rest.sign[j] * theta[j].coefficient[1];
        out.q[robot_joint(arm, j)] = is_nan(rate) || (one_axis && (j == 0 || j == 2)) ? infinity : rate;
    }
    return out;
}

/// The distance (m) of the wrist beyond the reach, or inside the inner reach, at a value of the free joint;
/// <= 0 if reachable.
inline double reach_excess(const OffsetArm& arm, const Pose<double>& pose, double free) noexcept {
    const OffsetMotion<> m = offset_motion(arm, Pose<double>{orthonormal(pose.rotation), pose.position}, 0);
    return offset_wrist(arm, m, sin_cos(to_theta(arm.rest, 6, free))).excess;
}

/// By how much (m) a pose is out of reach at the best value of the free joint; <= 0 if it is in reach.
inline double reach_excess(const OffsetArm& arm, const Pose<double>& pose) noexcept {
    const OffsetMotion<> m = offset_motion(arm, Pose<double>{orthonormal(pose.rotation), pose.position}, 0);
    const Vec3<double>& s = m.from_shoulder;
    const double fixed = dot(s, s) + arm.a_6 * arm.a_6;
    const double swing = 2.0 * abs(arm.a_6) * hypot(dot(m.flange.x, s), dot(m.flange.y, s));
    const double nearest = sqrt(max(fixed - swing, 0.0)), farthest = sqrt(fixed + swing);
    return max(nearest - arm.rest.reach, arm.rest.inner_reach - farthest);
}

/// The nearest reachable pose with the same orientation, ignoring joint limits, and its distance (m) from the
/// given one. The wrist moves along its line from the shoulder, at the value of the free joint with the least
/// distance.
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
