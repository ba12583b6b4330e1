// For an unreachable pose: the configuration of the nearest reachable pose.
//
//   1. The wrist moves on its ray from the shoulder into joint 4's reach; the rotation is kept. No
//      configuration with that rotation is nearer.
//   2. If limits permit no arm angle there: the least sqrt(|dp|^2 + (length angle)^2) that Gauss-Newton finds
//      within the limits. The best closed-form starts are used: all branches, all arm angles, joints clamped.
#pragma once

#include "nearest.hpp"
#include "relaxed.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace outside_rule {
inline constexpr double straight = 1e-7;  // rad: distance of joint 4 from straight, 1e-15 of the reach
inline constexpr double inside = 1e-9;    // rad: added to a margin, so that rounding does not violate it
inline constexpr int psis = 16;           // number of arm angles tried in each branch
inline constexpr int kept = 16;           // number of starts that are continued: the nearest, ...
inline constexpr int scouted = 8;         // ... and the nearest after a few rounds
inline constexpr int few = 3;             // Gauss-Newton rounds for scouting
inline constexpr int rounds = 30;         // Gauss-Newton rounds to the end
inline constexpr double same = 1e-9;      // m: starts whose results are this close are equally good
}  // namespace outside_rule

namespace detail {

/// The starts with the smallest distances, unsorted.
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

/// Distance of joints from the seed in the chosen metric; NaN without a seed.
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

/// The limits within which no hinge comes nearer to straight or folded than a margin (rad); false if there
/// are none.
inline bool limits_about(const Arm& arm, const Joints& q, double margin, Limits& out) noexcept {
    out = arm.limits;
    return !(margin > 0) || keep_off_singular(arm, q.q, margin, out);
}

/// The nearest configuration from the best starts about the poses moved into reach, one for each side of the
/// stretched arm. gc is -1 if the margin permits none.
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

/// nearest_posture, or without a solution the configuration of the nearest reachable pose, with the reason in
/// its status. `length` converts one radian to metres. All branches and arm angles are used. The margin of
/// `limits` still holds; if it permits no configuration, the result is empty.
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
