// Postures of an arm with an offset where its free joint tells too little of them: looked for in the joints.
//
//     theta_2 = 0 or pi       joints 1 and 3 turn about one axis and share a turn
//     S on axis 5             joints 1, 2, 3 and 5 turn about S and share one
//     folds, stretched elbow  the free joint has too few digits
//
// At such a place a start is chosen, with the cheapest shares of the turn, and put on its pose by
// limits/solve_locally.hpp.
#pragma once

#include "../limits/nearest_search.hpp"
#include "cells.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// How postures are looked for beside the arcs.
struct OffsetJointSearchTuning {
    /// Off straight (rad), or S off axis 5 (of the reach): nearer, joints may share a turn.
    double shared = 1e-5;
    /// A place at which a joint is farther off straight than this (rad) is no place of a shared turn.
    double far = 1e-3;
    /// Gauss-Newton steps to where theta_2 is nearest to 0, each no longer than `longest` (rad).
    int steps = 8;
    double longest = 0.02;
    /// Of a slope taken as a difference (rad).
    double difference = 1e-7;
    /// How far a start may be beyond a limit (rad).
    double beyond = 1e-3;
    /// Off straight (rad): nearer, the cheapest shares of a turn need no finish.
    double exact = 1e-10;
    /// Starts nearer to each other than this (rad) are one, and postures nearer than `basin` end in one.
    double same = 1e-8, basin = 1e-4;
    /// Rounds of solve_locally() for one pose.
    int rounds = 200;
};

namespace detail {

/// Searches postures of one pose where the free joint does not determine them well. Options are in the order
/// of the formulas; joints given to callbacks are in the robot's order.
class OffsetJointSearch {
public:
    /// Keeps references to arm and pose (with an exact rotation) and attracts each joint to the seed's value,
    /// or to the middle of its range, by the weights of the metric.
    OffsetJointSearch(const OffsetArm& arm, const Pose<double>& exact,
                      const NearestOptions& in_order) noexcept
        : arm_(arm), pose_(exact), branches_(in_order.branches), rounds_(tuning_.rounds) {
        for (int j = 0; j < joints; ++j) {
            const int k = robot_joint(arm, j);
            pull_.near[k] = in_order.near ? in_order.near[j] : arm.rest.joint_middle[j];
            pull_.weight[k] = in_order.weight[j];
        }
    }

    /// The value of the free joint near `free` at which joints of a branch rotate about a common axis; NaN if
    /// there is none.
    double shared(int gc, double free) const noexcept {
        const OffsetMotion<> m = offset_motion(arm_, pose_, gc);
        const OffsetWrist<double> wrist = wrist_at(m, free);
        const double reach = arm_.rest.reach, least = tuning_.shared * reach;
        if (!(wrist.excess <= least)) return not_a_number;
        if (abs(wrist.g) <= least && abs(wrist.t) <= least) return free;
        if (!(wrist.inside >= -least * reach)) return not_a_number;
        double lean[2];
        if (!(leaning(m, free, lean) <= tuning_.far)) return not_a_number;
        const double at = straightest(m, free);
        return leaning(m, at, lean) <= tuning_.shared ? at : not_a_number;
    }

    /// Whether S is on axis 5 at both ends and the middle of [lower, upper] of the free joint, so that joints
    /// 1, 2, 3 and 5 rotate about S.
    bool is_shared(int gc, double lower, double upper) const noexcept {
        const OffsetMotion<> m = offset_motion(arm_, pose_, gc);
        const double least = tuning_.shared * arm_.rest.reach;
        for (const double free : {lower, 0.5 * (lower + upper), upper}) {
            const OffsetWrist<double> wrist = wrist_at(m, free);
            if (!(abs(wrist.g) <= least && abs(wrist.t) <= least)) return false;
        }
        return true;
    }

    /// Calls take(free) for the values of the free joint at which S may be on axis 5: those with t = 0.
    template <class Take>
    void across_axis_6(int gc, const Take& take) const noexcept {
        const OffsetMotion<> m = offset_motion(arm_, pose_, gc);
        const double y = -dot(m.flange.y, m.from_shoulder), x = dot(m.flange.x, m.from_shoulder);
        for (const double side : {1.0, -1.0})
            if (x != 0 || y != 0) take(to_q(arm_.rest, 6, atan2(side * y, side * x)));
    }

    /// Searches postures near values [lower, upper] of the free joint. share(joints) sets joints 1 and 3 to
    /// the cheapest values with the same sum; worth(joints) tells whether a posture near them may cost less
    /// than the best; take(joints, gc) receives a posture. False if the rounds are used up.
    template <class Share, class Worth, class Take>
    bool look(int gc, double lower, double upper, const Share& share, const Worth& worth,
              const Take& take) noexcept {
        const OffsetMotion<> m = offset_motion(arm_, pose_, gc);
        try_at(gc, m, straightest(m, 0.5 * (lower + upper)), share, worth, take);
        try_at(gc, m, lower, share, worth, take);
        if (upper > lower) {
            try_at(gc, m, 0.5 * (lower + upper), share, worth, take);
            try_at(gc, m, upper, share, worth, take);
        }
        return rounds_ > 0;
    }

    /// If a posture is at a place where the free joint has too few digits, keeps it for finish(); where
    /// joints 1 and 3 rotate about one axis, also with their cheapest shares.
    template <class Share, class Worth, class Take>
    void begin(int gc, const Joints& at, const Share& share, const Worth& worth, const Take& take) noexcept {
        for (int bit = 0; bit < 3; ++bit) {
            const BranchMeeting m = meeting(bit);
            if (abs(sin_cos(to_theta(arm_.own, m.joint, at.q[m.joint]) - m.zero).sin) > tuning_.shared)
                continue;
            if (bit == 0) {
                Joints shared = at;
                share(shared);
                solve_start_and_turns(gc, shared, true, worth, take);
            }
            return solve_start_and_turns(gc, at, true, worth, take);
        }
    }

    /// Improves the prepared postures to the nearest ones to the seed, unless worth() rejects them. False if
    /// the rounds are used up, or there were as many prepared postures as fit, so that some may be missing.
    template <class Worth, class Take>
    bool finish(const Worth& worth, const Take& take) noexcept {
        for (int i = 0; i < left_; ++i) {
            const int gc = later_[i].gc;
            const Joints& on = later_[i].at;
            bool known = !worth(on);
            for (int k = 0; k < i; ++k)
                known = known || (later_[k].done && largest_move(on.q, later_[k].at.q) <= tuning_.basin);
            if (known) continue;
            later_[i].done = true;
            const Relaxed at = solve_locally_attracted(arm_, sides_of(gc, on), on, pose_, pull_, rounds_);
            if (meets(arm_, at)) offer(at.at, take);
        }
        return rounds_ > 0 && left_ < most_left;
    }

private:
    /// The wrist at a value of the free joint.
    OffsetWrist<double> wrist_at(const OffsetMotion<>& m, double free) const noexcept {
        return offset_wrist(arm_, m, sin_cos(to_theta(arm_.rest, 6, free)));
    }

    /// Computes sin(theta_2) (cos theta_1, sin theta_1), which is smooth where theta_2 is 0 or pi; returns
    /// its length.
    double leaning(const OffsetMotion<>& m, double free, double (&out)[2]) const noexcept {
        const SinCos<double> theta_7 = sin_cos(to_theta(arm_.rest, 6, free));
        const OffsetWrist<double> wrist = offset_wrist(arm_, m, theta_7);
        const Directions<double> d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, 0.0)));
        const double size = d.y[1] / hypot(d.y[0], d.x[0]);
        out[0] = size * d.x[0];
        out[1] = size * d.y[0];
        return abs(d.y[1]);
    }
    /// The value near `free` of the free joint at which theta_2 is nearest to 0 or pi.
    double straightest(const OffsetMotion<>& m, double free) const noexcept {
        double now[2], then[2], best = free, least = infinity;
        for (int pass = 0; pass < tuning_.steps; ++pass) {
            const double size = leaning(m, free, now);
            if (!(size < least)) break;
            least = size;
            best = free;
            leaning(m, free + tuning_.difference, then);
            const double x = then[0] - now[0], y = then[1] - now[1];
            const double move = (now[0] * x + now[1] * y) / (x * x + y * y) * tuning_.difference;
            if (!(abs(move) < tuning_.longest)) break;
            free -= move;
        }
        return best;
    }

    /// Gives the posture at a value of the free joint to take(); if S is on axis 5, the cheapest of the
    /// postures there.
    template <class Share, class Worth, class Take>
    void try_at(int gc, const OffsetMotion<>& m, double free, const Share& share, const Worth& worth,
                const Take& take) noexcept {
        const SinCos<double> theta_7 = sin_cos(to_theta(arm_.rest, 6, free));
        const OffsetWrist<double> wrist = offset_wrist(arm_, m, theta_7);
        const double least = tuning_.shared * arm_.rest.reach;
        const auto start = [&](const Directions<double>& d, double straight) {
            Joints out = joints_within_limits(arm_.own, in_robot_order(arm_, d), pull_.near);
            if (abs(d.y[1]) <= straight) share(out);
            return out;
        };
        if (!(abs(wrist.g) <= least && abs(wrist.t) <= least)) {
            const Directions<double> d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, 0.0)));
            const bool near_fold = wrist.inside <= least * arm_.rest.reach;
            solve_start_and_turns(gc, start(d, tuning_.shared), !(abs(d.y[1]) <= tuning_.exact), worth, take);
            if (near_fold) solve_start_and_turns(gc, start(d, tuning_.far), true, worth, take);
            return;
        }
        Joints at[parts];
        double cost[parts];
        const auto turned = [&](double theta_5, Joints& to) {
            to = start(directions(m, wrist, theta_7, sin_cos(theta_5), 0.0), tuning_.shared);
            double out = local_cost(pull_, 1.0, to.q, 0.0);
            for (int j = 0; j < joints; ++j) {
                const double beyond =
                    max(arm_.own.limits.lower[j] - to.q[j], to.q[j] - arm_.own.limits.upper[j]);
                if (beyond > 0) out += beyond * beyond / tuning_.shared;
            }
            return out;
        };
        for (int k = 0; k < parts; ++k) cost[k] = turned(two_pi * k / parts, at[k]);
        bool found = false;
        for (int k = 0; k < parts; ++k) {
            const double before = cost[(k + parts - 1) % parts], behind = cost[(k + 1) % parts];
            if (!(cost[k] <= before && cost[k] < behind)) continue;
            double cheapest = cost[k], theta_5 = two_pi * k / parts;
            for (double step = pi / parts; step > tuning_.shared * tuning_.shared; step *= 0.5)
                for (const double to : {theta_5 - step, theta_5 + step}) {
                    Joints there;
                    const double then = turned(to, there);
                    if (!(then < cheapest)) continue;
                    cheapest = then;
                    theta_5 = to;
                    at[k] = there;
                    break;
                }
            if (!within_limits(arm_.own.limits, at[k].q, tuning_.beyond)) continue;
            found = true;
            solve_start_and_turns(gc, at[k], false, worth, take);
        }
        if (found) return;
        solve_start_and_turns(
            gc, start(directions(m, wrist, theta_7, free_theta_5(arm_, m, pull_.near), 0.0), tuning_.shared),
            true, worth, take);
    }

    /// Moves a start onto the pose, see solve_start(). If adding 2 pi to joints brings them nearer to the
    /// seed and beyond a limit by rounding only, starts there too.
    template <class Worth, class Take>
    void solve_start_and_turns(int gc, const Joints& start, bool rough, const Worth& worth,
                               const Take& take) noexcept {
        int joint[joints], count = 0;
        double other[joints];
        for (int j = 0; j < joints; ++j)
            for (const double turn : {-two_pi, two_pi}) {
                const double q = start.q[j] + turn;
                if (abs(q - pull_.near[j]) < abs(start.q[j] - pull_.near[j]) &&
                    q >= arm_.own.limits.lower[j] - tuning_.beyond &&
                    q <= arm_.own.limits.upper[j] + tuning_.beyond) {
                    joint[count] = j;
                    other[count++] = q;
                }
            }
        for (int chosen = (1 << count) - 1; chosen >= 0; --chosen) {
            Joints at = start;
            for (int k = 0; k < count; ++k)
                if (chosen >> k & 1) at.q[joint[k]] = other[k];
            solve_start(gc, at, rough, worth, take);
        }
    }
    /// Moves a start onto the pose, gives the posture to take(), and keeps it for finish() if it is `rough`.
    /// Nothing if that fails, worth() rejects the start, or a start near it was tried.
    template <class Worth, class Take>
    void solve_start(int gc, const Joints& start, bool rough, const Worth& worth, const Take& take) noexcept {
        if (!is_finite(start.q) || !worth(start)) return;
        for (int i = 0; i < tried_; ++i)
            if (largest_move(start.q, start_[i].q) <= tuning_.same) return;
        start_[tried_ < most_starts ? tried_++ : most_starts - 1] = start;
        const Relaxed on = solve_locally(arm_, sides_of(gc, start), start, pose_, {}, 0.0, rounds_);
        if (!meets(arm_, on)) return;
        offer(on.at, take);
        if (rough && left_ < most_left) later_[left_++] = {gc, on.at, false};
    }
    /// Gives a posture to take() if its branch is permitted.
    template <class Take>
    void offer(const Joints& at, const Take& take) const noexcept {
        const int own = permitted_branch(forward(arm_, at.q).gc, at);
        if (branches_ >> own & 1u) take(at, own);
    }

    /// The place where the branches differ in bit `bit` (0..2) of their number.
    BranchMeeting meeting(int bit) const noexcept {
        return branch_meetings(arm_)[static_cast<std::size_t>(bit)];
    }

    /// The branch `gc` of a posture if it is requested; otherwise a requested branch that the posture belongs
    /// to as well, because a sine that tells them apart is 0 up to rounding; `gc` if there is none.
    int permitted_branch(int gc, const Joints& at) const noexcept {
        // nearer, a posture is of both branches; a bend is the root of a rounding
        const double root = sqrt(2.0 * tolerance::stretched);
        int both = 0;
        for (int bit = 0; bit < 3; ++bit) {
            const BranchMeeting m = meeting(bit);
            const double sine = sin_cos(to_theta(arm_.own, m.joint, at.q[m.joint]) - m.zero).sin;
            if (abs(sine) <= (bit == 0 ? tolerance::singular : root)) both |= 1 << bit;
        }
        for (int flip = 0; flip < configurations; ++flip)
            if ((flip & ~both) == 0 && (branches_ >> (gc ^ flip) & 1u)) return gc ^ flip;
        return gc;
    }

    /// The limits of the arm around a posture, with its singularity margin, narrowed to the side of each
    /// branch sign if not all branches are permitted.
    Limits sides_of(int gc, const Joints& at) const noexcept {
        Limits out;
        limits_about(arm_, at.q, out);
        if ((branches_ & ((1u << configurations) - 1)) == (1u << configurations) - 1) return out;
        const OffsetBranch branch = configuration(gc);
        const double side[] = {branch.shoulder, branch.elbow, branch.wrist};
        for (int bit = 0; bit < 3; ++bit) {
            const BranchMeeting m = meeting(bit);
            const double off = off_angle(arm_.own, m.joint, m.zero, at.q[m.joint]);
            limit_to_side(arm_.own, m.joint, at.q[m.joint] - arm_.own.sign[m.joint] * off, side[bit], 0.0,
                          out);
        }
        return out;
    }

    const OffsetArm& arm_;
    const Pose<double>& pose_;
    const OffsetJointSearchTuning tuning_{};
    const unsigned branches_;
    static constexpr int most_starts = 32, parts = 32;  // of the circle of theta_5
    Attraction pull_;                                   // in the robot's order
    int rounds_, tried_ = 0;
    Joints start_[most_starts];
    struct Later {
        int gc;
        Joints at;
        bool done;
    };
    static constexpr int most_left = 32;
    int left_ = 0;
    Later later_[most_left];
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
