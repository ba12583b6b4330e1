// For an unreachable pose: the configuration of the nearest reachable pose.
//
//   1. The wrist of an S-R-S arm moves on its ray from the shoulder into joint 4's reach and keeps its
//      rotation. No configuration with that rotation is nearer. Newton's method does that for other arms.
//   2. If limits permit no solution there: the least sqrt(|dp|^2 + (length angle)^2) that Newton's method
//      finds within them. It starts where it is nearest: all branches and arm angles of the nominal arm.
#pragma once

#include "nearest_search.hpp"
#include "approach.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the nearest reachable pose.
struct NearestOutsideTuning {
    static constexpr double straight = 1e-7;  // rad: distance of joint 4 from straight, 1e-15 of the reach
    static constexpr double inside = 1e-9;    // rad: added to a margin, so that rounding does not violate it
    static constexpr int psis = 16;           // number of arm angles tried in each branch
    static constexpr int kept = 16;           // number of starts that are continued: the nearest, ...
    static constexpr int scouted = 8;         // ... and the nearest after a few rounds
    static constexpr int few = 3;             // Newton rounds for scouting
    static constexpr int rounds = 30;         // Newton rounds to the end
    static constexpr double same =
        ApproachTuning{}.same;  // m: starts whose results are this close are equally good
};

namespace detail {

/// The starts with the smallest distances, unsorted.
template <int Kept>
struct Starts {
    Joints at[Kept];
    double distance[Kept];

    /// Begins without any start configuration.
    Starts() noexcept {
        for (double& d : distance) d = infinity;
    }

    /// Keeps a start if its distance is among the smallest.
    void offer(const Joints& q, double off) noexcept {
        int worst = 0;
        for (int i = 1; i < Kept; ++i)
            if (distance[i] > distance[worst]) worst = i;
        if (!(off < distance[worst])) return;
        at[worst] = q;
        distance[worst] = off;
    }
};

/// The distance (rad) of joints from the seed in the chosen metric; NaN without a seed or for the metric
/// margin.
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

/// Writes to `out` the limits around q within which the joints of singular postures keep a margin (rad) from
/// there; false if no joints within the limits do. An arm that has its own margin keeps that.
template <class A>
bool limits_about(const A& arm, const Joints& q, double margin, Limits& out) noexcept {
    if constexpr (requires { limits_about(arm, q.q, out); }) {
        return limits_about(arm, q.q, out);
    } else {
        const Arm& rows = nominal(arm);
        out = rows.limits;
        return !(margin > 0) || keep_off_singular(rows, branch_meetings(rows), q.q, margin, out);
    }
}

/// Searches the nearest configuration to an unreachable pose from many starts: arm angles of all branches of
/// the nominal arm at the pose moved into its reach, for each sign of the elbow, and the seed.
template <class A>
class OutsideSearch {
public:
    /// Keeps its arguments (which must outlive it) for nearest(). Without a seed the search begins at the
    /// middles of the joint ranges. `length` (m) is the position error that counts like 1 rad.
    OutsideSearch(const A& arm, double margin, const Pose<double>& asked, const NearestOptions& options,
                  double length) noexcept
        : arm_(arm), rows_(nominal(arm)), margin_(margin), asked_(asked), options_(options), length_(length) {
        for (int j = 0; j < joints; ++j) seed_.q[j] = options.near ? options.near[j] : rows_.joint_middle[j];
    }

    /// Adds as starts the seed and configurations of the poses moved into reach, one pose for each sign of
    /// the elbow.
    void begin(const Pose<double> (&drawn)[2]) noexcept {
        offer(seed_);
        for (int gc = 0; gc < configurations; ++gc) {
            const bool other_side = configuration(gc).elbow < 0;
            const SelfMotion<double> m = self_motion(rows_, drawn[other_side], gc);
            for (int i = 0; i < NearestOutsideTuning::psis; ++i) {
                const SinCos<double> psi = sin_cos(two_pi / NearestOutsideTuning::psis * i);
                offer(joints_within_limits(rows_, directions(m, psi), seed_.q));
            }
        }
    }

    /// Finds the nearest configuration with the orientation of the pose; false if there is none, or if a
    /// limit other than joint 4's keeps it from the position.
    bool parallel(Joints& out) const noexcept {
        Least least;
        bool held = false;
        each([&](const Joints& q, const Limits& about) {
            const Parallel end =
                approach_parallel(arm_, about, q, asked_, least.distance - NearestOutsideTuning::same);
            if (end.kept && least.takes(end.gap, largest_move(end.at.q, seed_.q))) {
                out = end.at;
                held = end.held;
            }
        });
        return least.distance < infinity && !held;
    }

    /// Finds the nearest configuration; false if the margin permits none.
    bool nearest(Joints& out) const noexcept {
        Least least;
        each([&](const Joints& q, const Limits& about) {
            const Relaxed end = approach(arm_, about, q, asked_, length_, NearestOutsideTuning::rounds);
            if (least.takes(end.distance, largest_move(end.at.q, seed_.q))) out = end.at;
        });
        return least.distance < infinity;
    }

private:
    /// The least distance (m); of equal ones, the one with the least joint move (rad).
    struct Least {
        double distance = infinity, move = infinity;

        /// Stores the distance `off` and the joint motion `moved` if they are better than those stored, and
        /// returns whether they are. Among equal distances the shorter motion is better.
        bool takes(double off, double moved) noexcept {
            const bool better = off < distance - NearestOutsideTuning::same;
            if (!better && !(off < distance + NearestOutsideTuning::same && moved < move)) return false;
            distance = min(distance, off);
            move = moved;
            return true;
        }
    };

    /// Adds as starts the joints q, moved within the limits, and the joints after a few steps from them
    /// towards the pose. Nothing if the limits with their margin permit no such joints.
    void offer(Joints q) noexcept {
        Twist rest;
        Limits about;
        for (int j = 0; j < joints; ++j)
            q.q[j] = min(max(q.q[j], rows_.limits.lower[j]), rows_.limits.upper[j]);
        if (!limits_about(arm_, q, margin_, about)) return;
        for (int j = 0; j < joints; ++j) q.q[j] = min(max(q.q[j], about.lower[j]), about.upper[j]);
        starts_.offer(q, distance(arm_, q.q, asked_, length_, rest));
        const Relaxed soon = approach(arm_, about, q, asked_, length_, NearestOutsideTuning::few);
        scouts_.offer(soon.at, soon.distance);
    }

    /// Calls follow(start, limits) with the starts that are continued.
    template <class Follow>
    void each(const Follow& follow) const noexcept {
        const auto one = [&](const Joints& q, double off) {
            Limits about;
            if (!(off < infinity)) return;
            limits_about(arm_, q, margin_, about);
            follow(q, about);
        };
        for (int i = 0; i < NearestOutsideTuning::kept; ++i) one(starts_.at[i], starts_.distance[i]);
        for (int i = 0; i < NearestOutsideTuning::scouted; ++i) one(scouts_.at[i], scouts_.distance[i]);
    }

    const A& arm_;
    const Arm& rows_;
    double margin_;
    const Pose<double>& asked_;
    const NearestOptions& options_;
    double length_;
    Joints seed_{};
    Starts<NearestOutsideTuning::kept> starts_;
    Starts<NearestOutsideTuning::scouted> scouts_;
};

}  // namespace detail

namespace detail {

/// A pose with its wrist moved into the nominal arm's reach, for each sign of the elbow.
struct MovedForEachElbow {
    Pose<double> pose[2];
    double gap[2] = {infinity, infinity};  // m; infinite if limits permit no such elbow

    /// Moves the asked pose towards that of `near` until its wrist is in reach, for each sign of the elbow.
    MovedForEachElbow(const Arm& rows, double margin, const Pose<double>& asked, const double* near) noexcept
        : pose{asked, asked} {
        const Pose<double> now = chain(rows, near ? near : rows.joint_middle).flange;
        const double off = max(NearestOutsideTuning::straight, margin + NearestOutsideTuning::inside);
        for (int side = 0; side < 2; ++side) {
            Limits one = rows.limits;
            const double sign = side == 0 ? 1.0 : -1.0;
            if (!keep_on_side(rows, 3, rows.joint_middle[3], sign, off, one)) continue;
            const MovedIntoReach in = move_into_reach(rows, reach_shell(rows, one), asked, now);
            pose[side] = in.pose;
            gap[side] = in.gap;
        }
    }
};

/// The result for a configuration that does not solve the pose; `status` is the reason.
template <class A>
Nearest approximate_result(const A& arm, const Joints& q, Status status, const Pose<double>& asked,
                           const NearestOptions& options, double length) noexcept {
    Nearest out{};
    Twist rest;
    for (int j = 0; j < joints; ++j) out.q[j] = q.q[j];
    const auto at = forward(arm, out.q);
    out.psi = redundancy(at);
    out.gc = at.gc;
    out.status = status;
    out.distance = joint_distance(out.q, options);
    out.margin = limit_margin(nominal(arm).limits, out.q);
    out.gap = distance(arm, out.q, asked, length, rest);
    return out;
}

}  // namespace detail

/// The result of nearest_posture() or, if the pose has no solution, the configuration of the nearest
/// reachable pose, with the reason in its status. `length` (m) converts one radian to metres. If limits
/// forbid the pose moved into reach too, all branches and arm angles are searched. The margin of `limits`
/// still holds; if it permits no configuration, the result is empty.
inline Nearest nearest_outside(const Arm& arm, const LimitTable& limits, const Pose<double>& asked,
                               const NearestOptions& options, double length) noexcept {
    const Nearest exact = nearest_posture(arm, limits, asked, options);
    if (is_solved(exact.status)) return exact;
    const detail::MovedForEachElbow drawn(arm, limits.margin, asked, options.near);
    const int nearer = drawn.gap[0] <= drawn.gap[1] ? 0 : 1;
    Nearest out = nearest_posture(arm, limits, drawn.pose[nearer], options);
    if (is_solved(out.status)) {
        Twist rest;
        out.status = exact.status;
        out.gap = detail::distance(arm, out.q, asked, length, rest);
        return out;
    }
    detail::OutsideSearch search(arm, limits.margin, asked, options, length);
    Joints at{};
    search.begin(drawn.pose);
    return search.nearest(at) ? detail::approximate_result(arm, at, exact.status, asked, options, length)
                              : exact;
}

/// For any other kind of arm, the configuration of the reachable pose nearest to one without a solution;
/// `exact` states the reason, and is returned if the margin permits no configuration. The result is a local
/// minimum, the best of many starts. The orientation is kept unless a limit other than joint 4's forbids
/// that.
template <class A>
Nearest nearest_outside(const A& arm, double margin, const Nearest& exact, const Pose<double>& asked,
                        const NearestOptions& options, double length) noexcept {
    const Pose<double> command{orthonormal(asked.rotation), asked.position};
    detail::OutsideSearch search(arm, margin, command, options, length);
    Joints at{};
    search.begin(detail::MovedForEachElbow(nominal(arm), margin, command, options.near).pose);
    const bool found = search.parallel(at) || search.nearest(at);
    return found ? detail::approximate_result(arm, at, exact.status, command, options, length) : exact;
}

}  // namespace armangle

#include "../names/end.hpp"
