// The joint velocities that a control cycle may choose, such that every joint can still brake.
#pragma once

#include "../limits/feasible.hpp"
#include "../limits/relaxed.hpp"
#include "../scene/clear.hpp"
#include "guard.hpp"
#include "jerk.hpp"
#include "tracker_options.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The state of a tracked arm: its joints, their velocities, and the bounds of the next cycle.
class TrackerBounds {
protected:
    /// Computes the bounds of each joint, narrower limits within which configurations are preferred, and the
    /// scene with larger clearances.
    TrackerBounds(const Arm& arm, const TrackerOptions& options) noexcept
        : arm_(arm), options_(options), hand_(options.hand) {
        for (int j = 0; j < joints; ++j) {
            bound_[j] = jerk_bounds(options.velocity[j], options.acceleration[j], options.jerk[j]);
            has_jerk_ |= bound_[j].has_jerk();
        }
        Limits soft = arm.limits;
        for (int j = 0; j < joints; ++j) {
            const double room = min(TrackerTuning::soft, 0.1 * (soft.upper[j] - soft.lower[j]));
            soft.lower[j] += room;
            soft.upper[j] -= room;
        }
        plain_ = limit_table(arm, parted(arm.limits));
        clear_ = limit_table(arm, soft, options.singularity_margin);
        if (options.scene) {
            kept_ = soft_ = *options.scene;
            kept_.clearance += GuardTuning::standoff;
            soft_.clearance += max(options.soft_clearance, GuardTuning::standoff);
        }
    }

    /// One control cycle: its length, the present frames, and the range of the next velocities.
    struct Tick {
        double dt;
        Chain now;
        Configuration<double> gc{};
        Limits limits{};                                // joint 4 on its side of the stretched arm
        double lower[joints] = {}, upper[joints] = {};  // rad/s: range of the next velocity
        Guard* guard = nullptr;                         // set if there are obstacles
        const Towards* elbow = nullptr;
        bool there = false;  // the end effector is at the target ...
        bool rests = false;  // ... and theta_2 or theta_6 is 0
    };

    /// The length (s) of a cycle: the given one, or that of the options.
    double seconds(double dt) const noexcept { return dt > 0 && dt < infinity ? dt : options_.dt; }

    /// If the limits of a joint are a whole revolution apart, narrows them slightly, so that an arc ends
    /// there: no motion across the limit exists.
    static Limits parted(Limits limits) noexcept {
        for (int j = 0; j < joints; ++j) {
            const double over = limits.upper[j] - limits.lower[j] - two_pi + TrackerTuning::seam;
            if (!(over > 0 && over <= 2.0 * TrackerTuning::seam)) continue;
            limits.lower[j] += 0.5 * over;
            limits.upper[j] -= 0.5 * over;
        }
        return limits;
    }

    /// The velocity of the target; 0 if it rests.
    Twist target_velocity() const noexcept { return fixed_ ? Twist{} : speed_; }

    /// The largest displacement (rad) of one joint to a configuration.
    double farthest_move(const Joints& to) const noexcept {
        double farthest = 0;
        for (int j = 0; j < joints; ++j) farthest = max(farthest, abs(to.q[j] - q_.q[j]));
        return farthest;
    }

    /// The bend (rad) of joint 4 from the stretched arm, positive on the side on which it is kept.
    double bent() const noexcept { return side_ * detail::elbow_bend(arm_, q_.q[3]); }

    /// The side of the stretched arm (+1, -1) on which joint 4 is kept: its present one. If it is nearly
    /// stretched and limits leave little range there, the other one.
    double side_to_keep() const noexcept {
        const double bend = detail::elbow_bend(arm_, q_.q[3]), own = bend < 0 ? -1.0 : 1.0;
        const double straight = q_.q[3] - arm_.sign[3] * bend;
        const double above = arm_.limits.upper[3] - straight, below = straight - arm_.limits.lower[3];
        const bool up = arm_.sign[3] * own > 0;
        const double room = up ? above : below, other = up ? below : above;
        return abs(bend) <= TrackerTuning::level && room < TrackerTuning::scant && room < other ? -own : own;
    }

    /// The bend (rad) from the stretched arm that joint 4 must keep from now on. It is smaller than the
    /// margin at rest if the arm started nearer.
    double bend_to_keep() const noexcept {
        Limits limits = arm_.limits;
        const bool has_margin = keep_on_side(arm_, 3, q_.q[3], side_, options_.still_margin, limits);
        return has_margin ? min(max(bent(), 0.0), options_.still_margin) : options_.still_margin;
    }

    /// The branch of a configuration, with the elbow sign that is kept.
    Configuration<double> branch(const Chain& now) const noexcept {
        Configuration<double> out = configuration(arm_, now.theta);
        out.elbow = side_;
        return out;
    }

    /// The limits with joint 4 restricted to one side of the stretched arm, at least `margin` (rad) from it,
    /// if they permit that.
    Limits kept_on(double side, double margin) const noexcept {
        Limits out = arm_.limits;
        keep_on_side(arm_, 3, q_.q[3], side, margin, out);
        return out;
    }

    /// Stores in t the limits, and the joint velocities of this cycle within the bounds after which every
    /// joint can still brake. A joint outside its limits must return, at least so fast that it could just
    /// come to rest at the limit.
    void box(Tick& t) const noexcept {
        const Limits& limits = t.limits = elbow_turns(t) ? arm_.limits : kept_on(side_, least_bend_);
        for (int j = 0; j < joints; ++j) {
            if (bound_[j].has_jerk()) {
                box_of_jerk(t, j);
                continue;
            }
            const double a = options_.acceleration[j], most = options_.velocity[j];
            const double change = max(a * t.dt - TrackerTuning::rounding / t.dt, 0.0);
            const double down = fastest(q_.q[j] - limits.lower[j], a, t.dt),
                         up = fastest(limits.upper[j] - q_.q[j], a, t.dt);
            t.lower[j] = max(-min(most, down), v_[j] - change);
            t.upper[j] = min(min(most, up), v_[j] + change);
            const double over = q_.q[j] - arm_.limits.upper[j], under = arm_.limits.lower[j] - q_.q[j];
            if (over > 0)
                t.upper[j] = min(t.upper[j], max(v_[j] - change, -min(most, fastest(over, a, t.dt))));
            if (under > 0)
                t.lower[j] = max(t.lower[j], min(v_[j] + change, min(most, fastest(under, a, t.dt))));
            if (!(t.lower[j] <= t.upper[j])) {  // only by rounding: brake
                const double slower = v_[j] > 0 ? v_[j] - change : v_[j] + change;
                t.lower[j] = t.upper[j] = slower;
            }
        }
    }

    /// Stores in t the velocities that joint j (0..6) with bounded jerk may have next. A joint that cannot
    /// stop within its limits stops as soon as it can.
    void box_of_jerk(Tick& t, int j) const noexcept {
        const JerkBounds& b = bound_[j];
        const double v = v_[j], a = a_[j], dt = t.dt, change = b.jerk * dt;
        double& lower = t.lower[j];
        double& upper = t.upper[j];
        lower = v + max(a - change, -b.acceleration) * dt;
        upper = v + min(a + change, b.acceleration) * dt;
        upper = max(min(upper, fastest_easing(b, v, dt)), lower);
        lower = min(max(lower, -fastest_easing(b, -v, dt)), upper);
        const auto fastest_up = [&](double room) {
            const double way = max(room - TrackerTuning::rounding, detail::stopping(b, v, a).way);
            return fastest_stopping(b, v, way, dt, lower, upper);
        };
        const auto fastest_down = [&](double room) {
            const double way = max(room - TrackerTuning::rounding, detail::stopping(b, -v, -a).way);
            return -fastest_stopping(b, -v, way, dt, -upper, -lower);
        };
        const double down = fastest_down(q_.q[j] - t.limits.lower[j]),
                     up = fastest_up(t.limits.upper[j] - q_.q[j]);
        const double over = q_.q[j] - arm_.limits.upper[j], under = arm_.limits.lower[j] - q_.q[j];
        const double in_down = over > 0 ? fastest_down(over) : up,
                     in_up = under > 0 ? fastest_up(under) : down;
        upper = min(up, in_down);
        lower = min(max(down, in_up), upper);
    }

    /// Changes the velocities v (rad/s) so that joints with bounded jerk do not overshoot. `ahead` (rad/s^2)
    /// is how the requested velocity continues to change.
    void ease(const Tick& t, const double (&ahead)[joints], double (&v)[joints]) const noexcept {
        for (int j = 0; j < joints; ++j) {
            const JerkBounds& b = bound_[j];
            if (!b.has_jerk()) continue;
            const double on = min(max(ahead[j], -b.acceleration), b.acceleration);
            const double left = v[j] - v_[j] - on * t.dt;
            const double a = on + copysign(detail::easing(abs(left), b.jerk, t.dt), left);
            v[j] = min(max(v_[j] + a * t.dt, t.lower[j]), t.upper[j]);
        }
    }

    /// The largest velocity v with v dt + v^2 / 2a <= room; 0 without room, infinite with infinite room.
    static double fastest(double room, double a, double dt) noexcept {
        if (!(room > 0)) return 0.0;
        if (!(room < infinity)) return infinity;
        return 2.0 * room / (dt + sqrt(dt * dt + 2.0 * room / a));
    }

    /// A factor k (1/s) of a velocity k d towards a goal d (rad, or m) away, such that every joint can stop
    /// there; k |d| falls with this power of |d|.
    struct Pace {
        double k, power;

        /// Lowers the factor k to `other` with its power, unless it is lower already.
        void at_most(double other, double its_power) noexcept {
            if (!(other < k)) return;
            k = other;
            power = its_power;
        }
    };

    /// The factor k (1/s) such that velocities k d, with d (rad) the way to go of each joint, let all joints
    /// brake in time.
    Pace pace(const double (&d)[joints], double dt) const noexcept {
        Pace out{1.0 / (TrackerTuning::ticks * dt), 1.0};
        for (int j = 0; j < joints; ++j) {
            const double way = abs(d[j]);
            if (!(way > 0)) continue;
            brake(out, j, way, TrackerTuning::braking * options_.acceleration[j]);
            out.at_most(options_.velocity[j] / way, 0.0);
        }
        return out;
    }

    /// Computes how fast the displacements d of the joints along a part of the end effector's path can be
    /// made with a share of the accelerations; the box of the cycle bounds the velocities. A joint that
    /// reaches its greatest velocity before it must brake slows no other. A goal that accelerates by `gain`
    /// (rad/s^2) changes the deceleration that is available.
    Pace pace(const double (&d)[joints], const double (&gain)[joints], double share,
              double dt) const noexcept {
        Pace out{1.0 / (TrackerTuning::ticks * dt), 1.0};
        for (int j = 0; j < joints; ++j) {
            const double way = abs(d[j]), a = options_.acceleration[j], v = options_.velocity[j];
            const double away = d[j] > 0 ? gain[j] : -gain[j];
            const double hard = min(max(share * a + away, TrackerTuning::assured * a), a);
            if (way > 0 && 2.0 * hard * way < v * v) brake(out, j, way, hard);
        }
        return out;
    }

    /// Lowers the factor k of a velocity k way so that joint j (0..6), `way` (rad > 0) from its goal, can
    /// still stop: v^2 <= 2 hard way (hard: rad/s^2) and, if its jerk is at most J, v^3 <= braking J way^2.
    void brake(Pace& out, int j, double way, double hard) const noexcept {
        out.at_most(sqrt(2.0 * hard / way), 0.5);
        if (bound_[j].has_jerk())
            out.at_most(std::cbrt(TrackerTuning::braking * bound_[j].jerk / way), 2.0 / 3.0);
    }

    /// Whether no joint moved in the previous cycle.
    bool is_at_rest() const noexcept {
        double fastest = 0;
        for (int j = 0; j < joints; ++j) fastest = max(fastest, abs(v_[j]));
        return !(fastest > 0);
    }

    /// Whether the requested branch has the other sign of the elbow.
    bool elbow_turns(const Tick& t) const noexcept {
        return turning_to_ >= 0 && configuration(turning_to_).elbow != t.gc.elbow;
    }

    /// The side of the stretched arm (+1, -1) on which the goal lies.
    double elbow_side(const Tick& t) const noexcept { return elbow_turns(t) ? -side_ : side_; }

    /// The limits with joint 4 on one side of the stretched arm, at least `margin` (rad) from it if its own
    /// limits permit, otherwise the margin at rest. From the folded arm it always keeps the margin at rest.
    Limits one_side(double side, double margin) const noexcept {
        Limits out = kept_on(side, options_.still_margin), narrow = out;
        keep_on_side(arm_, 3, q_.q[3], side, margin, narrow);
        if (arm_.sign[3] * side > 0) {
            out.lower[3] = narrow.lower[3];
        } else {
            out.upper[3] = narrow.upper[3];
        }
        return out;
    }

    /// Writes the joints after one cycle at velocities v (rad/s) to `next`.
    void go(const Tick& t, const double (&v)[joints], Joints& next) const noexcept {
        for (int j = 0; j < joints; ++j) next.q[j] = q_.q[j] + v[j] * t.dt;
        next.q[joints] = 0;
    }

    Arm arm_;
    TrackerOptions options_;
    Hand hand_;
    Twist speed_, acceleration_;  // of the target
    LimitTable plain_, clear_;
    Joints q_{}, relaxed_{};
    JerkBounds bound_[joints] = {};
    bool has_jerk_ = false;  // any joint
    double v_[joints] = {};
    double a_[joints] = {};  // rad/s^2
    double side_ = 1;        // of the stretched arm, on which joint 4 is kept
    double least_bend_ = 0;  // rad from straight that joint 4 must keep
    int turning_to_ = -1;    // branch approached in joint space; -1: none
    bool fixed_ = false;     // target and elbow's target at rest; for such a target:
    Scene kept_{}, soft_{};  // the scene with the required clearances, and with the soft ones
};

}  // namespace armangle

#include "../names/end.hpp"
