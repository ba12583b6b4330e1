// The reachable pose nearest to an unreachable command: first by reach, which depends on joint 4 alone, then
// by the other limits.
//
// The wrist's distance r from the shoulder depends on joint 4 alone: r^2 = La^2 + Lb^2 + 2 La Lb cos(theta_4
// - delta). Joint 4's interval on one side of the stretched arm is therefore an interval of r. Moving the
// wrist along its ray from the shoulder into it changes the position by the gap and keeps the rotation. With
// this orientation no configuration is nearer. If limits forbid all arm angles of that pose too, a
// Gauss-Newton method within the limits minimizes sqrt(|dp|^2 + (length angle)^2).
#pragma once

#include <array>

#include "../arm/joint_quadratic.hpp"
#include "../arm/jacobian.hpp"
#include "../circle/inverse.hpp"
#include "../numbers/twist.hpp"
#include "feasible.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The least and greatest distance (m) of the wrist from the shoulder.
struct ReachShell {
    double inner, outer;
};

/// Parameters of the reachable command nearest to an unreachable one.
struct RelaxedTuning {
    static constexpr int rounds = 15;               // Gauss-Newton rounds
    static constexpr double longest = 0.5;          // rad: largest move of a joint in one round
    static constexpr double damping = 1e-9;         // added to H, in m^2/rad^2
    static constexpr double smallest_move = 1e-13;  // rad: smaller moves count as none
    static constexpr double side_slack =
        1e-6;  // rad that a hinge may be on the other side of a branch to keep
};

namespace detail {

/// The bend (rad, in [0, pi]) of the elbow at which the wrist has this distance (m) from the shoulder; 0
/// beyond reach.
inline double bend_of(const Arm& arm, double distance) noexcept {
    const double gone = arm.reach * arm.reach - distance * distance;
    return 2.0 * std::asin(min(sqrt(max(gone, 0.0) / (4.0 * arm.upper_arm * arm.forearm)), 1.0));
}

}  // namespace detail

/// Restricts the limits of a joint (0..6) to one side of a value q_0, where theta is larger (+1) or smaller
/// (-1), at most pi away and at least `margin` (rad) from both ends. Returns false, and changes nothing, if
/// its limits permit no such value.
inline bool limit_to_side(const Arm& arm, int joint, double q_0, double side, double margin,
                          Limits& limits) noexcept {
    const double a = q_0 + arm.sign[joint] * side * margin, b = q_0 + arm.sign[joint] * side * (pi - margin);
    const double lower = max(limits.lower[joint], min(a, b)), upper = min(limits.upper[joint], max(a, b));
    if (lower > upper) return false;
    limits.lower[joint] = lower;
    limits.upper[joint] = upper;
    return true;
}

/// Restricts joint 2, 4 or 6 (`hinge`: 1, 3 or 5) in `limits` to the positive or negative side (+1, -1) of
/// its singular position, in the revolution of the value q and at least `margin` (rad) from it. Returns
/// false, and changes nothing, if the limits permit no such value.
inline bool keep_on_side(const Arm& arm, int hinge, double q, double side, double margin,
                         Limits& limits) noexcept {
    const double straight = q - arm.sign[hinge] * detail::bend(arm, hinge, q);
    return limit_to_side(arm, hinge, straight, side, margin, limits);
}

/// A zero of a model angle at which two branches meet. They meet half a turn further too.
struct BranchMeeting {
    int joint;                // of the robot, 0..6
    double zero;              // rad, theta
    bool is_singular = true;  // whether a singularity margin is kept from there
};

/// Where branches meet whose index differs in bit 0, 1 or 2. The bit is set if the sine of theta - zero is
/// negative.
using BranchMeetings = std::array<BranchMeeting, 3>;

/// The meetings of an S-R-S arm: theta_2, theta_4 - delta and theta_6 are 0.
inline BranchMeetings branch_meetings(const Arm& arm) noexcept {
    return {{{1, 0.0}, {3, arm.delta_angle}, {5, 0.0}}};
}

/// Restricts the joints of singular postures to at least `margin` (rad) from there, on the sides and in the
/// revolutions that q has. Returns false, perhaps with some joints restricted, if the limits permit no such
/// configuration.
inline bool keep_off_singular(const Arm& arm, const BranchMeetings& meetings, const double* q, double margin,
                              Limits& limits) noexcept {
    for (const auto& [joint, zero, is_singular] : meetings) {
        const double off = detail::off_angle(arm, joint, zero, q[joint]), side = off < 0 ? -1.0 : 1.0;
        if (is_singular && !limit_to_side(arm, joint, q[joint] - arm.sign[joint] * off, side, margin, limits))
            return false;
    }
    return true;
}

/// The limits with the joints at which branches meet restricted to at least `margin` (rad) from there, on the
/// side that q has, if their own limits permit. Without a margin this applies to the elbow alone. If a branch
/// is requested (0..7; -1: none), each of these joints that has its sign, or nearly, keeps it.
inline Limits on_these_sides(const Arm& arm, const BranchMeetings& meetings, const double* q, double margin,
                             int gc) noexcept {
    Limits out = arm.limits;
    for (int i = 0; i < 3; ++i) {
        const auto& [joint, zero, is_singular] = meetings[static_cast<std::size_t>(i)];
        const double off = detail::off_angle(arm, joint, zero, q[joint]), kept = is_singular ? margin : 0.0;
        const double own = off < 0 ? -1.0 : 1.0, asked = gc >> i & 1 ? -1.0 : 1.0;
        const bool stays = gc >= 0 && off * asked > -RelaxedTuning::side_slack;
        const double side = stays ? asked : own, apart = stays ? max(kept, tolerance::angle) : kept;
        if (stays || i == 1 || kept > 0)
            limit_to_side(arm, joint, q[joint] - arm.sign[joint] * off, side, apart, out);
    }
    return out;
}

/// The range of wrist distances that joint 4 permits within these limits, on one side of the stretched arm.
inline ReachShell reach_shell(const Arm& arm, const Limits& limits) noexcept {
    const double a = detail::wrist_distance(arm, detail::elbow_bend(arm, limits.lower[3])),
                 b = detail::wrist_distance(arm, detail::elbow_bend(arm, limits.upper[3]));
    return {min(a, b), max(a, b)};
}

/// A pose with its wrist moved into a range of distances from the shoulder.
struct MovedIntoReach {
    Pose<double> pose;  // in the user's frame
    double gap;         // m, from the commanded wrist to the shell; 0 inside
};

/// Moves the wrist of a pose along its ray from the shoulder into the range. `now` is the current flange
/// pose; its ray is used if the wrist coincides with the shoulder.
inline MovedIntoReach move_into_reach(const Arm& arm, const ReachShell& shell, const Pose<double>& command,
                                      const Pose<double>& now) noexcept {
    Pose<double> flange = flange_pose(arm, command);
    const Triad<double> t = triad(arm, flange);
    const double kept = min(max(t.distance, shell.inner), shell.outer), gap = abs(t.distance - kept);
    if (!(gap > tolerance::reach * arm.size)) return {command, 0.0};
    const Vec3<double> ray = is_folded(t) ? triad(arm, now).w : t.w;
    flange.position = flange.position + ray * (kept - t.distance);
    return {user_pose(arm, flange), gap};
}

/// A configuration and its distance from a command.
struct Relaxed {
    Joints at;
    double distance;  // m
};

namespace detail {

/// The distance (m) of the end effector at q from a pose; one radian counts `length` (m). `rest` becomes the
/// motion from there to the pose.
template <class A>
double distance(const A& arm, const double* q, const Pose<double>& command, double length,
                Twist& rest) noexcept {
    rest = difference(tool_pose(arm, q), command);
    return size(rest, length);
}

/// The normal equations of a step to the pose that the twist `rest` leaves: H = J' W J + damping, g = J' W
/// rest; one radian counts `length` (m).
inline JointQuadratic normal_equations(const Jacobian& J, const Twist& rest, double length,
                                       double damping) noexcept {
    const double w = length * length, weight[6] = {1, 1, 1, w, w, w};
    const double r[6] = {rest.linear.x,  rest.linear.y,  rest.linear.z,
                         rest.angular.x, rest.angular.y, rest.angular.z};
    JointQuadratic out;
    for (int i = 0; i < joints; ++i) {
        out.g[i] = 0;
        for (int k = 0; k < 6; ++k) out.g[i] += J.entry[k][i] * weight[k] * r[k];
        for (int j = 0; j <= i; ++j) {
            double sum = i == j ? damping : 0.0;
            for (int k = 0; k < 6; ++k) sum += J.entry[k][i] * weight[k] * J.entry[k][j];
            out.H[i][j] = out.H[j][i] = sum;
        }
    }
    return out;
}

}  // namespace detail

/// From `start`, within the limits and in at most `rounds`: the configuration from which no small change
/// comes nearer to the pose `command`, or the best one when the rounds end. One radian counts `length` (m).
template <class A>
Relaxed relaxed(const A& arm, const Limits& limits, const Joints& start, const Pose<double>& command,
                double length, int rounds = RelaxedTuning::rounds) noexcept {
    Relaxed best{start, 0};
    for (int j = 0; j < joints; ++j) best.at.q[j] = min(max(start.q[j], limits.lower[j]), limits.upper[j]);
    Twist rest;
    best.distance = detail::distance(arm, best.at.q, command, length, rest);
    double damping = RelaxedTuning::damping;
    for (int round = 0; round < rounds; ++round) {
        const JointQuadratic p = detail::normal_equations(jacobian(arm, best.at.q), rest, length, damping);
        double lower[joints], upper[joints], move[joints] = {}, longest = 0;
        for (int j = 0; j < joints; ++j) {
            lower[j] = max(limits.lower[j] - best.at.q[j], -RelaxedTuning::longest);
            upper[j] = min(limits.upper[j] - best.at.q[j], RelaxedTuning::longest);
        }
        minimise(p, lower, upper, move);
        Relaxed next = best;
        for (int j = 0; j < joints; ++j) {
            next.at.q[j] = min(max(best.at.q[j] + move[j], limits.lower[j]), limits.upper[j]);
            longest = max(longest, abs(move[j]));
        }
        if (!(longest > RelaxedTuning::smallest_move)) break;
        Twist next_rest;
        next.distance = detail::distance(arm, next.at.q, command, length, next_rest);
        if (next.distance < best.distance) {
            best = next;
            rest = next_rest;
            damping = max(0.1 * damping, RelaxedTuning::damping);
        } else {
            damping *= 100.0;
        }
    }
    return best;
}

}  // namespace armangle

#include "../names/end.hpp"
