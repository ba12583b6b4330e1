// Where a pose has no posture: the posture of the nearest pose that the arm can take.
//
//   1. the pose drawn along the shoulder's ray into what joint 4 reaches, its rotation kept: no posture with
//      that rotation comes nearer;
//   2. where limits leave no arm angle there either: the least sqrt(|dp|^2 + (length angle)^2) that
//      Gauss-Newton methods find in the box of the limits, from the best of closed-form starts: all branches,
//      arm angles all round, joints clamped to their limits.
#pragma once

#include "nearest.hpp"
#include "relaxed.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace outside_rule {
inline constexpr double straight = 1e-7;  // rad off straight that joint 4 keeps: 1e-15 of the reach
inline constexpr double inside = 1e-9;    // rad: so much more than a margin, which rounding would break
inline constexpr int psis = 16;           // arm angles of a branch
inline constexpr int kept = 16;           // starts that are followed: the nearest, ...
inline constexpr int scouted = 8;         // ... and those that are nearest after a few rounds
inline constexpr int few = 3;             // of Gauss-Newton
inline constexpr int rounds = 30;         // the same to the end
inline constexpr double same = 1e-9;      // m: starts that end this near one another end equally well
}  // namespace outside_rule

namespace detail {

/// The starts with the least distances, in no order.
template <int Kept>
struct Starts {
    Joints at[Kept];
    double distance[Kept];

    Starts() noexcept {
        for (double& d : distance) d = infinity;
    }

    void offer(const Joints& q, double off) noexcept {
        int worst = 0;
        for (int i = 1; i < Kept; ++i)
            if (distance[i] > distance[worst]) worst = i;
        if (!(off < distance[worst])) return;
        at[worst] = q;
        distance[worst] = off;
    }
};

/// How far joints are from the seed in the metric asked; NaN without one.
inline double joint_distance(const double* q, const NearestOptions& options) noexcept {
    if (!options.near || options.metric == Metric::margin) return not_a_number;
    double sum = 0, largest = 0;
    for (int j = 0; j < joints; ++j) {
        const double d = q[j] - options.near[j], square = options.weight[j] * d * d;
        sum += square;
        largest = max(largest, square);
    }
    return sqrt(options.metric == Metric::max ? largest : sum);
}

/// The limits that a posture may move in without a hinge coming nearer to straight or folded than a margin
/// (rad); false where there are none.
inline bool limits_about(const Arm& arm, const Joints& q, double margin, Limits& out) noexcept {
    out = arm.limits;
    return !(margin > 0) || keep_off_singular(arm, q.q, margin, out);
}

/// The least relaxation from the best of the starts about the poses drawn into reach, one for each side of
/// the stretched arm; gc is -1 where the margin leaves none.
inline Nearest least_relaxation(const Arm& arm, double margin, const Pose<double>& asked,
                                const Pose<double> (&drawn)[2], const NearestOptions& options,
                                double length) noexcept {
    Starts<outside_rule::kept> starts;
    Starts<outside_rule::scouted> scouts;
    Limits about;
    const auto offer = [&](Joints q) {
        Twist rest;
        for (int j = 0; j < joints; ++j) q.q[j] = min(max(q.q[j], arm.limits.lower[j]), arm.limits.upper[j]);
        if (!limits_about(arm, q, margin, about)) return;
        for (int j = 0; j < joints; ++j) q.q[j] = min(max(q.q[j], about.lower[j]), about.upper[j]);
        starts.offer(q, distance(arm, q.q, asked, length, rest));
        const Relaxed soon = relaxed(arm, about, q, asked, length, outside_rule::few);
        scouts.offer(soon.at, soon.distance);
    };
    Joints seed{};
    for (int j = 0; j < joints; ++j) seed.q[j] = options.near ? options.near[j] : arm.joint_middle[j];
    offer(seed);
    for (int gc = 0; gc < configurations; ++gc) {
        const bool other_side = configuration(gc).elbow < 0;
        const SelfMotion<double> m = self_motion(arm, drawn[other_side], gc);
        for (int i = 0; i < outside_rule::psis; ++i) {
            const SinCos<double> psi = sin_cos(two_pi / outside_rule::psis * i);
            offer(joints_within_limits(arm, directions(m, psi), seed.q));
        }
    }
    Nearest best{};
    best.gc = -1;
    double least = infinity, move = infinity;
    const auto follow = [&](const Joints& q, double off) {
        if (!(off < infinity)) return;
        limits_about(arm, q, margin, about);
        const Relaxed end = relaxed(arm, about, q, asked, length, outside_rule::rounds);
        const double moved = largest_move(end.at.q, seed.q);
        const bool better = end.distance < least - outside_rule::same;
        const bool as_good = end.distance < least + outside_rule::same && moved < move;
        if (!better && !as_good) return;
        least = min(least, end.distance);
        move = moved;
        for (int j = 0; j < joint_slots; ++j) best.q[j] = end.at.q[j];
    };
    for (int i = 0; i < outside_rule::kept; ++i) follow(starts.at[i], starts.distance[i]);
    for (int i = 0; i < outside_rule::scouted; ++i) follow(scouts.at[i], scouts.distance[i]);
    if (!(least < infinity)) return best;
    const Posture at = forward(arm, best.q);
    best.psi = at.psi;
    best.gc = at.gc;
    best.distance = joint_distance(best.q, options);
    best.margin = limit_margin(arm.limits, best.q);
    return best;
}

}  // namespace detail

/// nearest_posture, or where that has none the posture of the nearest pose that the arm can take, whose
/// status says why; `length` is how many metres a radian counts as. All branches and arm angles are used. The
/// margin of `limits` holds there too; where it leaves no posture at all, the result is none.
inline Nearest nearest_outside(const Arm& arm, const LimitTable& limits, const Pose<double>& asked,
                               const NearestOptions& options, double length) noexcept {
    const Nearest exact = nearest_posture(arm, limits, asked, options);
    if (exact.status == Status::OK) return exact;
    const Pose<double> now = chain(arm, options.near ? options.near : arm.joint_middle).flange;
    const double off = max(outside_rule::straight, limits.margin + outside_rule::inside);
    Pose<double> drawn[2] = {asked, asked};
    double gap[2] = {infinity, infinity};
    for (int side = 0; side < 2; ++side) {
        Limits one = arm.limits;
        const double sign = side == 0 ? 1.0 : -1.0;
        if (!keep_on_side(arm, 3, arm.joint_middle[3], sign, off, one)) continue;
        const Drawn in = drawn_in_reach(arm, reach_shell(arm, one), asked, now);
        drawn[side] = in.pose;
        gap[side] = in.gap;
    }
    const int nearer = gap[0] <= gap[1] ? 0 : 1;
    Nearest out = nearest_posture(arm, limits, drawn[nearer], options);
    if (out.status != Status::OK)
        out = detail::least_relaxation(arm, limits.margin, asked, drawn, options, length);
    if (out.gc < 0) return exact;
    out.status = exact.status;
    Twist rest;
    out.gap = detail::distance(arm, out.q, asked, length, rest);
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
