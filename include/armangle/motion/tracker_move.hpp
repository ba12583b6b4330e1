// The move of a control cycle: towards its goal, straight to another configuration, or to rest.
#pragma once

#include "resting_choice.hpp"
#include "tracker_goal.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Moves towards the goal within the bounds, and finds ways around what stops the arm.
class TrackerMove : protected TrackerGoal {
protected:
    using TrackerGoal::TrackerGoal;

    /// The distance (m) from a pose to the target; one radian counts as options.length.
    double distance_to_target(const Pose<double>& hand) const noexcept {
        return size(difference(hand, hand_.pose()), options_.length);
    }

    /// Writes joints that move towards the goal as far as the bounds allow to `next`: first the end effector,
    /// then the configuration.
    void approach(const Tick& t, const Goal& goal, Joints& next) noexcept {
        const Pose<double> here = user_pose(arm_, t.now.flange);
        const Twist lead = goal_velocity(t, goal), rest = difference(here, goal.pose) - lead * t.dt;
        const double late = min(size(rest, options_.length) / TrackerTuning::late, 1.0);
        const double damping = TrackerTuning::regular + late * TrackerTuning::damping;
        const Jacobian J = jacobian(arm_, q_.q);
        const double length = options_.length;
        const auto equations = [&](const Twist& move, double metres) {
            return detail::normal_equations(J, move, metres, damping);
        };
        double gain[joints], way[joints], v[joints];
        JointQuadratic p = equations(acceleration_, length);
        const Unbounded free(p);
        free.minimise(p.g, gain);
        const auto pace_of = [&](const Twist& move, double share) {
            double d[joints];
            free.minimise(equations(move, length).g, d);
            return pace(d, gain, share, t.dt);
        };
        const auto pace_of_position = [&](const Twist& move, double share) {
            const JointQuadratic alone = equations(move, TrackerTuning::aside * length);
            double d[joints];
            Unbounded(alone).minimise(alone.g, d);
            return pace(d, gain, share, t.dt);
        };
        // A target at rest is reached soonest if all joints arrive together. A moving one stays nearer if
        // position does not wait for the joints that rotate the tool.
        const Pace turning = pace_of(fixed_ ? rest : Twist{{}, rest.angular}, TrackerTuning::braking),
                   moving = fixed_ ? turning : pace_of_position({rest.linear, {}}, TrackerTuning::direct);
        const Twist nearer{rest.linear * moving.k, rest.angular * turning.k};
        for (int j = 0; j < joints; ++j) way[j] = goal.at.q[j] - q_.q[j];
        p = equations(lead + nearer, length);
        const double k = pace(way, t.dt).k;
        for (int j = 0; j < joints; ++j) p.g[j] += damping * k * way[j];
        free.minimise(p.g, v);
        if (has_jerk_) {  // on the approach velocity, which falls as the end effector comes nearer
            const Twist closing = twist(J, v_) - lead;
            double falls[joints];
            free.minimise(equations({closing.linear * (moving.power * moving.k),
                                     closing.angular * (turning.power * turning.k)},
                                    length)
                              .g,
                          falls);
            for (int j = 0; j < joints; ++j) gain[j] -= falls[j];
        }
        least_squares(t, p, gain, v);
        watch(t, goal, size(rest + lead * t.dt, options_.length));
        go(t, v, next);
    }

    /// The velocity of the end effector for joint velocities v.
    static Twist twist(const Jacobian& J, const double (&v)[joints]) noexcept {
        double rows[6] = {};
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < joints; ++j) rows[i] += J.entry[i][j] * v[j];
        return {{rows[0], rows[1], rows[2]}, {rows[3], rows[4], rows[5]}};
    }

    /// Writes the velocities (rad/s) in the box of this cycle that minimize a quadratic cost to v, which
    /// holds the start, with collision-free braking if there are obstacles. `ahead` (rad/s^2) is how the
    /// requested velocity continues to change.
    void least_squares(const Tick& t, const JointQuadratic& p, const double (&ahead)[joints],
                       double (&v)[joints]) const noexcept {
        if (!t.guard) {
            minimise(p, t.lower, t.upper, v);
            return ease(t, ahead, v);
        }
        t.guard->minimise(p, t.lower, t.upper, v);
        ease(t, ahead, v);
        t.guard->restrain(v);
    }

    /// Detects a stall: the end effector stops, or comes no nearer, although its goal is reachable, because
    /// of a joint limit or an obstacle. The arm then moves to the goal's configuration, or to another one of
    /// its pose, by a collision-free way. `off` (m) is the distance from the goal: for a moving target only a
    /// large one counts. If all attempts for a resting target fail, the arm stops. Does nothing for a resting
    /// target without obstacles.
    void watch(const Tick& t, const Goal& goal, double off) noexcept {
        if (fixed_ && !t.guard) return;  // see the choice for a target at rest
        const bool counts = fixed_ || off > TrackerTuning::worth, still = has_stalled(t);
        const bool stuck = no_nearer(t, off) || still;
        if (stuck && counts) searching_ = true;
        if (!searching_) return;
        if (detours_exhausted() || goal.blocked != Status::OK) {
            if (t.guard && !options_.detours && tried_ == 0) {  // find the obstacle
                ++tried_;
                tried_for_ = hand_.pose();
                barred_ = 0;
                t.guard->clear(q_.q, goal.at.q, barred_);
            }
            given_up_ = fixed_ && idle_ >= TrackerTuning::patience;
        } else if (t.guard) {
            search(t, goal);
        } else {
            if (tried_ == 0) tried_for_ = hand_.pose();
            tried_ += TrackerTuning::most_ways / TrackerTuning::turns;
            turn_to(goal.at, goal.gc);
        }
    }

    /// Starts a straight joint motion to a configuration of branch gc.
    void turn_to(const Joints& at, int gc) noexcept {
        waypoint_[0] = at;
        waypoint_count_ = 1;
        turning_to_ = gc;
        detour_target_ = hand_.pose();
        searching_ = false;
        forget();
    }

    /// Whether the end effector has come no nearer to the goal of a slow target for some time; `off` (m): its
    /// distance.
    bool no_nearer(const Tick& t, double off) noexcept {
        waited_ += t.dt;
        const bool fast = size(speed_, options_.length) > TrackerTuning::slow;
        if (off < (1.0 - TrackerTuning::progress) * nearest_ || (fast && !fixed_)) {
            nearest_ = off;
            waited_ = 0;
        }
        return waited_ >= TrackerTuning::patience;
    }

    /// Whether all detours have been tried for a resting target, or none is permitted.
    bool detours_exhausted() const noexcept {
        return tried_ >= TrackerTuning::most_ways || !(options_.detours || asked_);
    }

    /// Tests some detours to solutions of the goal's pose, the first straight and the others through a random
    /// configuration, and begins one that is collision-free.
    void search(const Tick& t, const Goal& goal) noexcept {
        const SelfMotion<double> m = self_motion(arm_, circle(arm_, flange_pose(arm_, goal.pose)), t.gc);
        ArcSet own, arcs;
        make_empty(arcs);
        if (!goal.posture_only && detail::moving_joints(m, joint_functions(m), plain_, own) == Status::OK)
            keep_clear(arm_, kept_, m, own, arcs);
        if (tried_ == 0) {
            barred_ = 0;
            tried_for_ = hand_.pose();
        }
        for (int k = 0; k < TrackerTuning::ways; ++k) {
            const bool first = tried_++ == 0;
            Tag other = 0, &pair = first ? barred_ : other;
            Joints to = goal.at, via = q_;
            if (!first && !arcs.empty())
                to = joints_within_limits(arm_, directions(m, sin_cos(drawn(arcs))), q_.q);
            const double share = drawn(), width = 0.7 * drawn();
            for (int j = 0; j < joints && !first; ++j) {
                const double low = t.limits.lower[j], high = t.limits.upper[j];
                const double room = min(high - low, two_pi);
                via.q[j] += share * (to.q[j] - q_.q[j]) + width * room * (drawn() - 0.5);
                via.q[j] = min(max(via.q[j], low), high);
            }
            if (!t.guard->clear(q_.q, via.q, pair) || !t.guard->clear(via.q, to.q, pair)) continue;
            turn_to(to, index(t.gc));
            waypoint_[waypoint_count_++] = via;
            return;
        }
        if (detours_exhausted()) searching_ = false;
    }

    /// The next pseudo-random number in [0, 1).
    double drawn() noexcept {
        draw_ = draw_ * 1664525u + 1013904223u;
        return (draw_ >> 8) * 0x1p-24;
    }

    /// A random angle (rad) that is uniformly distributed in the arcs; NaN if there are none.
    double drawn(const ArcSet& arcs) noexcept {
        if (arcs.full) return two_pi * drawn();
        double all = 0;
        for (int i = 0; i < arcs.count; ++i) all += arcs.arc[i].upper - arcs.arc[i].lower;
        double left = all * drawn();
        for (int i = 0; i < arcs.count; ++i) {
            const double width = arcs.arc[i].upper - arcs.arc[i].lower;
            if (left <= width || i + 1 == arcs.count) return arcs.arc[i].lower + min(left, width);
            left -= width;
        }
        return not_a_number;
    }

    /// Ends the joint motion to another configuration: forgets its waypoints.
    void end_detour() noexcept {
        turning_to_ = -1;
        asked_ = false;
        waypoint_count_ = 0;
        searching_ = false;
    }

    /// Whether no joint has moved noticeably for the time of a stall.
    bool has_stalled(const Tick& t) noexcept {
        constexpr double lasting = TrackerTuning::stall;
        for (int j = 0; j < joints; ++j) {
            const double possible = 0.25 * min(min(options_.velocity[j], lasting * options_.acceleration[j]),
                                               0.5 * lasting * lasting * options_.jerk[j]);  // from rest
            const double slowest = min(TrackerTuning::standing, possible);
            if (abs(q_.q[j] - stalled_at_.q[j]) <= slowest * lasting) continue;
            stalled_at_ = q_;
            stalled_for_ = 0;
            searching_ = false;
            return false;
        }
        stalled_for_ += t.dt;
        return stalled_for_ >= TrackerTuning::stall;
    }

    /// Records that the end effector is at its goal and the target at rest, so that moving away counts as no
    /// progress.
    void record_arrival() noexcept { nearest_ = stalled_for_ = 0; }

    /// Whether the end effector has been at its goal for a while, which is not the target, without coming
    /// nearer to the target.
    bool makes_no_progress(const Goal& goal) const noexcept {
        const bool calm = margin_ - options_.still_margin < TrackerTuning::calm;
        const bool is_hand = size(difference(goal.pose, wanted_), options_.length) <= TrackerTuning::exact;
        return calm && !is_hand && closest_ > TrackerTuning::exact && idle_ >= TrackerTuning::patience;
    }

    /// Resets the stall detection: counts neither time nor progress so far.
    void forget() noexcept {
        stalled_for_ = 0;
        waited_ = 0;
        nearest_ = infinity;
    }

    /// Writes the next joints of a straight joint motion to `next`: to a configuration of the goal, chosen in
    /// the first cycle, or along the detour that was found. The path of the end effector is free.
    void follow_waypoints(const Tick& t, const Goal& goal, Joints& next) noexcept {
        if (waypoint_count_ == 0) {
            waypoint_[waypoint_count_++] = goal.at;
            detour_target_ = hand_.pose();
        }
        double way[joints], v[joints], slowing[joints], longest = 0;
        const Joints& to = waypoint_[waypoint_count_ - 1];
        for (int j = 0; j < joints; ++j) {
            way[j] = to.q[j] - q_.q[j];
            longest = max(longest, abs(way[j]));
        }
        const Pace at = pace(way, t.dt);
        const double k = at.k;
        if (longest < TrackerTuning::turned) {
            if (waypoint_count_ > 1) {
                --waypoint_count_;
            } else if (!fixed_) {
                end_detour();
            }
        }
        for (int j = 0; j < joints; ++j) {
            v[j] = min(max(k * way[j], t.lower[j]), t.upper[j]);
            slowing[j] = -at.power * k * v_[j];
        }
        ease(t, slowing, v);
        if (t.guard) {
            JointQuadratic p{};
            for (int j = 0; j < joints; ++j) {
                p.H[j][j] = 1.0;
                p.g[j] = k * way[j];
            }
            least_squares(t, p, slowing, v);
        }
        const bool chosen = choice_.state == RestingChoice::taken;
        if (!(chosen && !t.guard) && has_stalled(t)) {  // an obstacle blocks nevertheless
            if (chosen) choice_.state = RestingChoice::left;
            if (t.guard) tried_ += TrackerTuning::most_ways / (asked_ ? 1 : TrackerTuning::turns);
            tried_for_ = hand_.pose();
            end_detour();
            forget();
        }
        go(t, v, next);
    }

    /// Writes joints that come to rest to `next`, because all attempts for a resting target failed.
    void come_to_rest(const Tick& t, Joints& next) noexcept {
        double v[joints];
        const double none[joints] = {};
        for (int j = 0; j < joints; ++j) v[j] = min(max(0.0, t.lower[j]), t.upper[j]);
        ease(t, none, v);
        if (t.guard) t.guard->restrain(v);
        go(t, v, next);
    }

    /// The velocity of the goal; 0 if it has jumped.
    Twist goal_velocity(const Tick& t, const Goal& goal) const noexcept {
        if (goal.why == Status::OK) return speed_;
        const Twist speed = difference(goal_pose_, goal.pose) * (1.0 / t.dt);
        const bool leapt = !(size(speed, options_.length) < TrackerTuning::leap);
        return leapt ? Twist{} : speed;
    }

    bool asked_ = false;  // by the operator
    RestingChoice choice_;
    Joints stalled_at_{};     // where the arm stands, or last stood
    double stalled_for_ = 0;  // s for which it has, away from its goal
    double nearest_ = 0;      // m: smallest distance to its goal ...
    double waited_ = 0;       // ... and s since
    bool given_up_ = false;
    double closest_ = infinity, idle_ = 0;          // m: smallest distance to it, and s since
    bool searching_ = false;                        // for a way around an obstacle
    int tried_ = 0;                                 // detours tried since the target moved ...
    Pose<double> tried_for_ = identity_pose();      // ... from here
    int waypoint_count_ = 0;                        // remaining legs of the way that was found
    Joints waypoint_[2]{};                          // the last leg first
    Pose<double> detour_target_ = identity_pose();  // the target for which it was found, unfiltered
    Tag barred_ = 0;                                // the pair that blocks the straight way
    std::uint32_t draw_ = 1;
    Pose<double> goal_pose_ = identity_pose();
};

}  // namespace armangle

#include "../names/end.hpp"
