// From one start: the configuration within limits whose pose is nearest to an unreachable one, for any arm
// that has frames and a Jacobian.
//
// Newton's method, with the limits as a box. The rest r = p* - p stays large out of reach, so that its second
// derivatives count: without them the method oscillates at a stretched elbow. With the axes z_i, the columns
// l_i of the linear velocity and the rotation vector w of the rest, f = (|r|^2 + length^2 |w|^2) / 2 has
//
//     df/dq_i       = -(r . l_i + length^2 w . z_i)
//     d2f/dq_i dq_j = l_i . l_j - r . (z_i x l_j) + length^2 (k z_i . z_j
//                     + (1 - k) (w . z_i)(w . z_j) / |w|^2 - w . (z_i x z_j) / 2),    i <= j,
//
// where k = |w|/2 cot(|w|/2). If this matrix is not positive definite, that of Gauss-Newton takes its place.
// A round that comes no nearer is repeated in a smaller box. Source: J. Nocedal, S. Wright, Numerical
// Optimization (2006), chapters 4 and 17.
#pragma once

#include "relaxed.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of approach and approach_parallel.
struct ApproachTuning {
    double longest = 0.5;     // rad: largest move of a joint in one round
    double damping = 1e-9;    // added to the second derivatives, in squares of the arm's size
    double still = 1e-12;     // rad: shorter moves count as none
    double parallel = 1e-10;  // rad: orientations this close are equal
    double pull = 1e-6;       // a limit holds back if it does so by more than this share of size times gap
    int rounds = 30;          // rounds to the end
    double stiff = 30.0;      // m that a radian of a kept orientation counts, in sizes of the arm plus gaps
    int turns = 24;           // times that a kept orientation is corrected
    double same = 1e-9;       // m: configurations whose distances are this close are equally near
};

namespace detail {

/// Returns as H the second derivatives of f, half the squared distance to a pose, with respect to the joints,
/// with `damping` on the diagonal, and as g the negative first derivatives. `rest` is the twist that remains;
/// 1 rad of it counts `length` (m).
inline JointQuadratic second_derivatives(const Jacobian& J, const Twist& rest, double length,
                                         double damping) noexcept {
    const double square = length * length;
    const Vec3<double>&r = rest.linear, &w = rest.angular;
    const double angle = norm(w), half = 0.5 * angle;
    const double k = angle > 1e-4 ? half * std::cos(half) / std::sin(half) : 1.0 - half * half / 3.0;
    const double along = angle > 1e-4 ? (1.0 - k) / (angle * angle) : 1.0 / 12.0;
    Vec3<double> z[joints], l[joints];
    double turn[joints];
    JointQuadratic out;
    for (int i = 0; i < joints; ++i) {
        l[i] = {J.entry[0][i], J.entry[1][i], J.entry[2][i]};
        z[i] = {J.entry[3][i], J.entry[4][i], J.entry[5][i]};
        turn[i] = dot(w, z[i]);
        out.g[i] = dot(r, l[i]) + square * turn[i];
    }
    for (int i = 0; i < joints; ++i) {
        const Vec3<double> r_z = cross(r, z[i]), w_z = cross(w, z[i]);  // r . (z x l) = (r x z) . l
        for (int j = i; j < joints; ++j) {
            const double moved = dot(l[i], l[j]) - dot(r_z, l[j]);
            const double turned = k * dot(z[i], z[j]) + along * turn[i] * turn[j] - 0.5 * dot(w_z, z[j]);
            out.H[i][j] = out.H[j][i] = moved + square * turned + (i == j ? damping : 0.0);
        }
    }
    return out;
}

/// Whether a symmetric matrix is positive definite.
inline bool is_convex(const JointQuadratic& p) noexcept {
    double L[joints][joints], whole[joints], pivot[joints];
    for (int a = 0; a < joints; ++a) {
        double rest = p.H[a][a];
        for (int b = 0; b < a; ++b) {
            whole[b] = p.H[a][b];
            for (int k = 0; k < b; ++k) whole[b] -= whole[k] * L[b][k];
            L[a][b] = whole[b] / pivot[b];
            rest -= whole[b] * L[a][b];
        }
        if (!(rest > 0)) return false;
        pivot[a] = rest;
    }
    return true;
}

}  // namespace detail

/// From `start`, within the limits and in at most `rounds`: the configuration from which no small change
/// comes nearer to the pose `command`, or the best one when the rounds end. One radian counts `length` (m).
template <class A>
Relaxed approach(const A& arm, const Limits& limits, const Joints& start, const Pose<double>& command,
                 double length, int rounds, const ApproachTuning& tuning = {}) noexcept {
    const double unit = nominal(arm).size * nominal(arm).size;
    Relaxed best{start, 0};
    for (int j = 0; j < joints; ++j) best.at.q[j] = min(max(start.q[j], limits.lower[j]), limits.upper[j]);
    Twist rest;
    best.distance = detail::distance(arm, best.at.q, command, length, rest);
    double farthest = tuning.longest;
    Jacobian J = jacobian(arm, best.at.q);
    for (int round = 0; round < rounds; ++round) {
        JointQuadratic p = detail::second_derivatives(J, rest, length, tuning.damping * unit);
        if (!detail::is_convex(p)) p = detail::normal_equations(J, rest, length, tuning.damping * unit);
        double lower[joints], upper[joints], move[joints] = {}, longest = 0;
        for (int j = 0; j < joints; ++j) {
            lower[j] = max(limits.lower[j] - best.at.q[j], -farthest);
            upper[j] = min(limits.upper[j] - best.at.q[j], farthest);
        }
        minimise(p, lower, upper, move);
        Relaxed next = best;
        for (int j = 0; j < joints; ++j) {
            next.at.q[j] = min(max(best.at.q[j] + move[j], limits.lower[j]), limits.upper[j]);
            longest = max(longest, abs(move[j]));
        }
        if (!(longest > tuning.still)) break;
        Twist next_rest;
        next.distance = detail::distance(arm, next.at.q, command, length, next_rest);
        if (next.distance < best.distance) {
            best = next;
            rest = next_rest;
            J = jacobian(arm, best.at.q);
            farthest = min(2.0 * farthest, tuning.longest);
        } else {
            farthest = 0.25 * longest;
        }
    }
    return best;
}

/// A configuration with (nearly) the orientation of a pose.
struct Parallel {
    Joints at;
    double gap;  // m: distance of its position
    bool kept;   // whether its orientation is the pose's
    bool held;   // whether a limit other than joint 4's keeps it from coming nearer
};

/// The configuration within limits, with the orientation of the pose, from which no small change comes nearer
/// to its position. Method of multipliers: the commanded orientation is changed until the one found is that
/// of the pose; if it never is, `kept` is false. If the lower bound of the distance exceeds `enough` (m), the
/// search ends early and `gap` is infinite.
template <class A>
Parallel approach_parallel(const A& arm, const Limits& limits, const Joints& start,
                           const Pose<double>& command, double enough = infinity,
                           const ApproachTuning& tuning = {}) noexcept {
    const double size = nominal(arm).size;
    Pose<double> shown = command;
    Parallel out{start, infinity, false, false};
    Twist rest, from_shown;
    detail::distance(arm, start.q, command, size, rest);
    const double length = tuning.stiff * (size + norm(rest.linear));
    for (int turn = 0; turn < tuning.turns && !out.kept; ++turn) {
        const double turned = length * norm(from_shown.angular);
        out.at = approach(arm, limits, out.at, shown, length, tuning.rounds, tuning).at;
        const double off = detail::distance(arm, out.at.q, shown, length, from_shown);
        if (off * off - turned * turned > enough * enough) return out;
        detail::distance(arm, out.at.q, command, length, rest);
        out.kept = norm(rest.angular) <= tuning.parallel;
        shown.rotation = orthonormal(from_rotation_vector(from_shown.angular) * command.rotation);
    }
    out.gap = norm(rest.linear);
    const Jacobian J = jacobian(arm, out.at.q);
    const JointQuadratic p = detail::second_derivatives(J, from_shown, length, 0.0);
    for (int j = 0; j < joints; ++j) {
        if (j == 3 || !(abs(p.g[j]) > tuning.pull * size * out.gap)) continue;
        const double room = p.g[j] > 0 ? limits.upper[j] - out.at.q[j] : out.at.q[j] - limits.lower[j];
        out.held = out.held || room <= tolerance::angle;
    }
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
