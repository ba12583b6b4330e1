// The goal of a control cycle: where the end effector and the joints should be, and whether they can be there
// at the end of the cycle.
#pragma once

#include "../limits/solve_locally.hpp"
#include "elbow_choice.hpp"
#include "leaving.hpp"
#include "tracker_bounds.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Chooses the goal: exact arcs, else the target moved into reach and its arcs, else the least relaxation.
class TrackerGoal : protected TrackerBounds {
protected:
    /// `other_body`: the arm that moves has other links than `arm`, which chooses the goals.
    TrackerGoal(const Arm& arm, const TrackerOptions& options, bool other_body) noexcept
        : TrackerBounds(arm, options), other_body_(other_body) {}

    /// The goal of a cycle: a reachable pose, and a configuration that solves it.
    struct Goal {
        Pose<double> pose;
        Joints at;
        double psi = 0, gap = 0;
        Status why = Status::OK;
        bool is_nearby = false;       // it is near the present one
        bool posture_only = false;    // the pose may have no arc: only this configuration
        int gc = 0;                   // of that configuration
        Status blocked = Status::OK;  // or why obstacles leave no solution of the pose
        Tag pair = 0;                 // a pair that blocks, if one is known; 0: none
    };

    /// Computes the goal; true, with the joints of the next cycle in `next`, if they can be there. If the
    /// elbow bends fast enough, the goal may be at the end of the reach; otherwise the elbow keeps its
    /// margin.
    bool pursue(const Tick& t, Goal& goal, Joints& next) noexcept {
        const Pose<double>& wanted = wanted_;
        const Circle<double> c = circle(arm_, flange_pose(arm_, wanted));
        grow_margin(t, c);
        crossing_ = Crossing{};
        if (turning_to_ < 0) crossing_ = crossing_ahead(arm_, t.gc, hand_, t.now.z3, q_.q, options_.velocity);
        const bool in_branch = turning_to_ < 0 || turning_to_ == index(t.gc);
        const double still = options_.still_margin, margin = max(margin_, ahead_);
        const bool posture = within(t, c, margin, goal);
        if (t.rests && turning_to_ < 0 && !(goal.gap > 0) && rest_or_leave(t, c, goal, next)) return true;
        if (in_branch && goal.gap > 0) {
            Goal nearer;
            if (within(t, c, still, nearer) && !(nearer.gap > 0) && exact(t, nearer, next)) {
                goal = nearer;
                return true;
            }
        }
        goal.is_nearby =
            posture && is_near_singular(t) && goal.blocked == Status::OK && solve_nearby(t, goal);
        if (posture && !nearby_is_as_close(t, c, goal))
            relaxing_ = false;
        else
            relax(t, elbow_turns(t) ? one_side(elbow_side(t), margin) : t.limits, goal);
        if (!in_branch) return false;
        if (fixed_ && is_at_rest() && !t.elbow && stays_there(t, goal, next)) return true;
        return exact(t, goal, next) || (!(goal.gap > 0) && stays_there(t, goal, next));
    }

    /// Whether the end effector is already at the target and the joints may stay; if so, writes them to
    /// `goal` and `next`. The limits may end just here and leave an arc of width 0.
    bool stays_there(const Tick& t, Goal& goal, Joints& next) const noexcept {
        if (!t.there || goal.blocked != Status::OK || !taken(t, q_.q, next)) return false;
        goal = Goal{};
        goal.pose = wanted_;
        goal.at = q_;
        goal.gc = index(t.gc);
        goal.psi = arm_angle(triad(arm_, t.now.flange), t.now.z3);
        return true;
    }

    /// Whether only the elbow's margin keeps the goal from the target, and the goal's configuration is far
    /// away while a nearby one is about as close to the target.
    bool nearby_is_as_close(const Tick& t, const Circle<double>& c, const Goal& goal) const noexcept {
        if (!(goal.gap > 0) || turning_to_ >= 0 || goal.blocked != Status::OK) return false;
        const ReachShell all = reach_shell(arm_, kept_on(side_, 0.0));
        if (max(c.distance - all.outer, all.inner - c.distance) > TrackerTuning::worth) return false;
        if (farthest_move(goal.at) <= TrackerTuning::remote) return false;
        const Relaxed beside = relaxed(arm_, t.limits, q_, wanted_, options_.length, TrackerTuning::rounds);
        return beside.distance <=
               size(difference(goal.pose, wanted_), options_.length) + TrackerTuning::worth;
    }

    /// If theta_2 or theta_6 is 0 and the end effector at the target, makes it the goal and writes joints to
    /// `next`: the present ones, or the neighbours of that joint rotated until psi can move towards the
    /// elbow's target. False if the joints move too fast.
    bool rest_or_leave(const Tick& t, const Circle<double>& c, Goal& goal, Joints& next) const noexcept {
        goal = Goal{};
        goal.pose = wanted_;
        goal.at = q_;
        goal.gc = index(t.gc);
        goal.psi = arm_angle(c, t.now.z3);
        double lower[joints], upper[joints];
        for (int j = 0; j < joints; ++j) {
            lower[j] = t.lower[j] * t.dt;
            upper[j] = t.upper[j] * t.dt;
        }
        const Leaving way = t.elbow ? way_on(t, c, goal.psi) : Leaving{};
        if (way.gc >= 0 && has_arrived(way, lower, upper) && taken(t, way.to.q, next)) return true;
        const double share = way.gc < 0 ? 0.0 : share_within(way, pace(way.d, t.dt).k * t.dt, lower, upper);
        Joints wanted = q_;
        for (int j = 0; j < joints; ++j) wanted.q[j] += min(max(share * way.d[j], lower[j]), upper[j]);
        const Pose<double> there = user_pose(arm_, chain(arm_, wanted.q).flange);
        return size(difference(there, wanted_), options_.length) <= TrackerTuning::exact &&
               taken(t, wanted.q, next);
    }

    /// The joint motion out of the singularity that brings psi nearest to the elbow's target; gc -1 if none
    /// brings it nearer.
    Leaving way_on(const Tick& t, const Circle<double>& c, double held) const noexcept {
        Leaving best;
        double missed = infinity;
        for (int flip = 0; flip < 4; ++flip) {
            if ((flip & 1 && !is_singular(t.now, 0)) || (flip & 2 && !is_singular(t.now, 1))) continue;
            Configuration<double> gc = t.gc;
            if (flip & 1) gc.shoulder = -gc.shoulder;
            if (flip & 2) gc.wrist = -gc.wrist;
            const SelfMotion<double> m = self_motion(arm_, c, gc);
            const ElbowChoice hint = hinted_psi(arm_, m, *t.elbow);
            ArcSet arcs;
            if (feasible(m, joint_functions(m), plain_, arcs) != Status::OK) continue;
            if (options_.scene) {
                const ArcSet own = arcs;
                if (keep_clear(arm_, kept_, m, own, arcs) != Status::OK) continue;
            }
            const double way = hint.confidence * wrap(hint.psi - held);
            missed = min(missed, abs(way));
            offer_ways_on(arm_, m, arcs, t.now, held, held + way, q_.q, best);
        }
        return best.missed < missed - TrackerTuning::led ? best : Leaving{};
    }

    /// Whether theta_2 or theta_6 is nearly 0 and psi has no target. There the neighbouring joints move far
    /// while psi hardly changes.
    bool is_near_singular(const Tick& t) const noexcept {
        const double bend = min(abs(sin_cos(t.now.theta[1]).sin), abs(sin_cos(t.now.theta[5]).sin));
        return bend <= TrackerTuning::shut && !t.elbow && turning_to_ < 0;
    }

    /// Replaces the goal's configuration by the solution of its pose next to the present joints. False,
    /// without a change, if none is found or a joint is near a limit there.
    bool solve_nearby(const Tick& t, Goal& goal) const noexcept {
        Attraction near;
        for (int j = 0; j < joints; ++j) {
            near.weight[j] = 1.0;
            near.near[j] = q_.q[j];
        }
        int rounds = LocalSolveTuning::rounds;
        const double share = LocalSolveTuning::share * arm_.size * arm_.size;
        const Relaxed about = solve_locally(arm_, t.limits, q_, goal.pose, near, share, rounds);
        const Relaxed found = solve_locally(arm_, t.limits, about.at, goal.pose, near, 0.0, rounds);
        if (!meets(arm_, found) || limit_margin(arm_.limits, joint_lanes(found.at.q)) < TrackerTuning::roomy)
            return false;
        const Chain there = chain(arm_, found.at.q);
        goal.at = found.at;
        goal.psi = arm_angle(triad(arm_, there.flange), there.z3);
        goal.gc = index(configuration(arm_, there.theta));
        return true;
    }

    /// Moves the target into joint 4's reach with this margin (rad), and stores pose and configuration in
    /// `goal`; false if limits permit no configuration there.
    bool within(const Tick& t, const Circle<double>& c, double margin, Goal& goal) noexcept {
        const Pose<double>& wanted = wanted_;
        const Limits limits = one_side(elbow_side(t), margin);
        const MovedIntoReach drawn = move_into_reach(arm_, reach_shell(arm_, limits), wanted, t.now.flange);
        goal.pose = drawn.pose;
        goal.gap = drawn.gap;
        goal.why = drawn.gap > 0 ? reason(c) : Status::OK;
        return posture_of(t, goal);
    }

    /// Increases the elbow's margin while the wrist is fast, and bends the elbow in time for a target that
    /// comes closer.
    void grow_margin(const Tick& t, const Circle<double>& c) noexcept {
        const Vec3<double> wrist = c.w * c.distance, from_base = wrist + Vec3<double>{0, 0, arm_.d_bs};
        const Twist hand = target_velocity();
        const Vec3<double> arm_to_hand =
            arm_.base.rotation * from_base + arm_.base.position - wanted_.position;
        const Vec3<double> speed =
            arm_.base_inverse.rotation * (hand.linear + cross(hand.angular, arm_to_hand));
        wrist_speed_ = wrist_speed_ + (speed - wrist_speed_) * -std::expm1(-t.dt / TrackerTuning::trembling);
        const double share = min(norm(wrist_speed_) / TrackerTuning::fast, 1.0);
        const double wanted =
            options_.still_margin + share * max(options_.elbow_margin - options_.still_margin, 0.0);
        const double lasting = wanted > margin_ ? TrackerTuning::growing : TrackerTuning::shrinking;
        margin_ += (wanted - margin_) * -std::expm1(-t.dt / lasting);
        if (abs(wanted - margin_) < TrackerTuning::negligible) margin_ = wanted;
        ahead_ = bend_ahead(arm_, wrist, wrist_speed_, side_ * arm_.sign[3] * v_[3], options_.velocity[3],
                            options_.acceleration[3]);
    }

    /// The reason why the target's wrist is out of reach: FOLDED, UNREACHABLE for any joint 4, ELBOW_LIMIT
    /// for this arm's, or else ELBOW_MARGIN, the bend that is kept.
    Status reason(const Circle<double>& c) const noexcept {
        if (is_folded(c)) return Status::FOLDED;
        if (is_unreachable(c)) return Status::UNREACHABLE;
        const ReachShell limits = reach_shell(arm_, kept_on(side_, 0.0));
        const bool beyond = c.distance < limits.inner || c.distance > limits.outer;
        return beyond ? Status::ELBOW_LIMIT : Status::ELBOW_MARGIN;
    }

    /// Finds the configuration for the goal's pose; false if limits permit none. Near theta_2 = 0 and theta_6
    /// = 0 both branches are compared.
    bool posture_of(const Tick& t, Goal& goal) const noexcept {
        const Circle<double> c = circle(arm_, flange_pose(arm_, goal.pose));
        double least = infinity;
        const auto offer_all = [&](bool avoid) {
            if (turning_to_ >= 0) return offer(t, c, configuration(turning_to_), avoid, least, goal);
            if (arrived_ && fixed_) offer(t, c, t.gc, avoid, least, goal);
            if (least < infinity) return;
            const bool shoulder = abs(wrap(t.now.theta[1])) < TrackerTuning::crossing,
                       wrist = abs(wrap(t.now.theta[5])) < TrackerTuning::crossing;
            for (int flip = 0; flip < 4; ++flip) {
                if ((flip & 1 && !shoulder) || (flip & 2 && !wrist)) continue;
                Configuration<double> gc = t.gc;
                if (flip & 1) gc.shoulder = -gc.shoulder;
                if (flip & 2) gc.wrist = -gc.wrist;
                offer(t, c, gc, avoid, least, goal);
            }
        };
        offer_all(options_.scene != nullptr);
        if (least < infinity) {
            goal.blocked = Status::OK;
            goal.pair = 0;
        } else if (goal.blocked != Status::OK) {
            offer_all(false);
            goal.why = goal.blocked;
            // pairs have the numbers of the body's scene
            if (t.guard && (!goal.pair || other_body_)) goal.pair = t.guard->nearest_at(goal.at.q);
        }
        return least < infinity;
    }

    /// Stores the solution of one branch in `goal` if its squared joint motion (rad^2) is below `least`,
    /// which it then replaces; `avoid`: only if it is collision-free.
    void offer(const Tick& t, const Circle<double>& c, const Configuration<double>& gc, bool avoid,
               double& least, Goal& goal) const noexcept {
        const SelfMotion<double> m = self_motion(arm_, c, gc);
        const double psi = choose_psi(t, m, avoid, goal);
        if (is_nan(psi)) return;
        const Joints at = joints_within_limits(arm_, directions(m, sin_cos(psi)), q_.q);
        if (!within_limits(arm_.limits, at.q, TrackerTuning::beyond)) return;  // at hinge 0 psi is inaccurate
        double cost = 0;
        for (int j = 0; j < joints; ++j) cost += (at.q[j] - q_.q[j]) * (at.q[j] - q_.q[j]);
        if (!(cost < least)) return;
        least = cost;
        goal.at = at;
        goal.psi = psi;
        goal.gc = index(gc);
    }

    /// Chooses psi on a self-motion. It starts at the least joint motion and moves towards the elbow's
    /// target, a crossing of theta_2 or theta_6 = 0, or the middles of the joint ranges. Keeps away from
    /// limits, singularities and obstacles; NaN if limits or obstacles permit no psi.
    double choose_psi(const Tick& t, const SelfMotion<double>& m, bool avoid, Goal& goal) const noexcept {
        const JointFunctions<double> f = joint_functions(m);
        ArcSet arcs, clear;
        if (detail::moving_joints(m, f, plain_, arcs) != Status::OK) return not_a_number;
        detail::moving_joints(m, f, clear_, clear);
        if (avoid && !keep_clear_parts(m, arcs, clear, goal)) return not_a_number;
        const double carried = psi_carried(arm_, m, f, t.now.z3, q_.q, options_.velocity);
        ElbowChoice hint{0.0, 0.0};
        if (t.elbow) hint = hinted_psi(arm_, m, *t.elbow);
        const double own = crossing_.ahead ? wrap(arm_angle(m.circle, crossing_.axis) - carried)
                                           : regular(t) * wrap(foreseen(m, carried) - carried);
        const double turn = hint.confidence * wrap(hint.psi - carried) + (1.0 - hint.confidence) * own;
        return in_clear_part(arcs, clear, carried, carried + turn);
    }

    /// Removes the colliding parts of `arcs` and `clear`; false, with the reason in the goal, if nothing of
    /// `arcs` remains.
    bool keep_clear_parts(const SelfMotion<double>& m, ArcSet& arcs, ArcSet& clear,
                          Goal& goal) const noexcept {
        Cleared open;
        armangle::clear(arm_, kept_, m, open);
        const ArcSet own = arcs, calm = clear;
        intersect(own, open.arcs, arcs);
        if (arcs.empty()) {
            goal.blocked = open.status == Status::OK ? Status::CLEARANCE : open.status;
            goal.pair = open.blocking;
            return false;
        }
        armangle::clear(arm_, soft_, m, open);
        intersect(calm, open.arcs, clear);
        return true;
    }

    /// A factor that falls from 1 to 0 as theta_2 or theta_6 comes near 0 or pi, where psi is left as it is.
    static double regular(const Tick& t) noexcept {
        const double sine = min(abs(sin_cos(t.now.theta[1]).sin), abs(sin_cos(t.now.theta[5]).sin));
        const double share = min(sine / TrackerTuning::irregular, 1.0);
        return share * share;
    }

    /// The psi nearest to `wish`: in the part `clear` of the arc that contains `held`, else in that arc, else
    /// in any; NaN if there is none.
    static double in_clear_part(const ArcSet& arcs, const ArcSet& clear, double held, double wish) noexcept {
        const Place place = find(arcs, held);
        if (place.index < 0) return nearest(arcs, wish);
        if (arcs.full) return clear.empty() ? wrap(wish) : nearest(clear, wish);
        ArcSet here, both;
        make_empty(here);
        here.arc[here.count++] = arcs.arc[place.index];
        intersect(here, clear, both);
        return nearest(both.empty() ? here : both, wish);
    }

    /// The psi near the given one whose joints will be far from their limits at the predicted target.
    double foreseen(const SelfMotion<double>& m, double psi) const noexcept {
        const Twist hand = target_velocity();
        if (turning_to_ >= 0 || size(hand, options_.length) * TrackerTuning::preview < tolerance::angle)
            return psi;
        const Pose<double> there = moved_by(wanted_, hand * TrackerTuning::preview);
        const SelfMotion<double> ahead = self_motion(arm_, circle(arm_, flange_pose(arm_, there)), m.gc);
        if (is_folded(ahead.circle) || is_unreachable(ahead.circle)) return psi;
        const auto axis = [](const Triad<double>& on, double angle) {
            const SinCos<double> at = sin_cos(angle);
            return combine(on.z, at.cos, on.e, at.sin);
        };
        const double then = arm_angle(ahead.circle, axis(m.circle, psi));
        const double turn = turn_to_room(arm_, ahead, then, q_.q, options_.singularity_margin);
        return arm_angle(m.circle, axis(ahead.circle, then + turn));
    }

    /// If limits forbid every arm angle of the goal, finds a configuration that no small change brings nearer
    /// to the target. The search starts at the previous one, or at the best closed-form solution clamped to
    /// the limits.
    void relax(const Tick& t, const Limits& limits, Goal& goal) noexcept {
        const Pose<double>& wanted = wanted_;
        goal.why = Status::LIMITS;
        Twist rest;
        const Joints before = relaxing_ ? relaxed_ : q_;
        Joints from = before;
        double least = detail::distance(arm_, before.q, wanted, options_.length, rest);
        if (relaxing_) {
            least -= TrackerTuning::worth;
            const double here = detail::distance(arm_, q_.q, wanted, options_.length, rest);
            if (here < least) {
                least = here;
                from = q_;
            }
        }
        const SelfMotion<double> m = self_motion(arm_, circle(arm_, flange_pose(arm_, goal.pose)), t.gc);
        for (int i = 0; i < TrackerTuning::starts; ++i) {
            const SinCos<double> at = sin_cos(two_pi / TrackerTuning::starts * i);
            Joints one = joints_within_limits(arm_, directions(m, at), q_.q);
            for (int j = 0; j < joints; ++j) one.q[j] = min(max(one.q[j], limits.lower[j]), limits.upper[j]);
            const double off = detail::distance(arm_, one.q, wanted, options_.length, rest);
            if (!(off < least)) continue;
            least = off;
            from = one;
        }
        const Relaxed found = relaxed(arm_, limits, from, wanted, options_.length, TrackerTuning::rounds);
        const double here = detail::distance(arm_, q_.q, wanted, options_.length, rest),
                     way = farthest_move(found.at);
        const bool pays = way <= TrackerTuning::near || here - found.distance > TrackerTuning::pays * way;
        relaxed_ = pays ? found.at : q_;
        relaxing_ = true;
        goal.at = relaxed_;
        const Chain there = chain(arm_, relaxed_.q);
        goal.pose = user_pose(arm_, there.flange);
        goal.psi = arm_angle(triad(arm_, there.flange), there.z3);
        goal.gc = index(configuration(arm_, there.theta));
        goal.posture_only = true;
    }

    /// Writes joints that solve the goal's pose within the bounds of this cycle to `next`; false if there are
    /// none.
    bool exact(const Tick& t, const Goal& goal, Joints& next) const noexcept {
        if (goal.blocked != Status::OK) return false;
        if (goal.posture_only) return taken(t, goal.at.q, next);
        Limits narrow;
        for (int j = 0; j < joints; ++j) {
            narrow.lower[j] = q_.q[j] + t.lower[j] * t.dt;
            narrow.upper[j] = q_.q[j] + t.upper[j] * t.dt;
        }
        if (goal.is_nearby && taken(t, goal.at.q, next)) return true;
        const LimitTable table = limit_table(arm_, narrow);
        const Circle<double> c = circle(arm_, flange_pose(arm_, goal.pose));
        const auto crosses = [&](int j) {
            const ThetaRange range = theta_range(arm_, narrow, j);
            const double middle = wrap(0.5 * (range.lower + range.upper));
            return abs(middle) <= 0.5 * (range.upper - range.lower);
        };
        const bool shoulder = crosses(1), wrist = crosses(5);
        for (int flip = 0; flip < 4; ++flip) {
            if ((flip & 1 && !shoulder) || (flip & 2 && !wrist)) continue;
            Configuration<double> gc = t.gc;
            if (flip & 1) gc.shoulder = -gc.shoulder;
            if (flip & 2) gc.wrist = -gc.wrist;
            if (exact_in(t, self_motion(arm_, c, gc), table, goal.psi, next)) return true;
        }
        return false;
    }

    /// Writes the joints of the next cycle on one self-motion to `next`: within the bounds, with psi nearest
    /// to `wish`. False if there are none.
    bool exact_in(const Tick& t, const SelfMotion<double>& m, const LimitTable& table, double wish,
                  Joints& next) const noexcept {
        static constexpr double inside[] = {0, 1e-6, 1e-3, 0.1, 0.5};  // shares of the distance to the middle
        const JointFunctions<double> f = joint_functions(m);
        ArcSet arcs;
        if (feasible(m, f, table, arcs) != Status::OK) return false;
        if (options_.scene) {
            const ArcSet own = arcs;
            if (keep_clear(arm_, kept_, m, own, arcs) != Status::OK) return false;
        }
        const double psi = nearest(arcs, turned(t, m, f, wish));
        const Place place = find(arcs, psi);
        if (place.index < 0) return false;
        const Arc& arc = arcs.arc[place.index];
        const double middle = arcs.full ? place.psi : 0.5 * (arc.lower + arc.upper);
        for (const double share : inside) {
            const double at = place.psi + share * (middle - place.psi);
            if (taken(t, joints_near(arm_, directions(m, sin_cos(at)), q_.q).q, next)) return true;
        }
        return false;
    }

    /// The psi (rad) of the next cycle on the way to `wish`, moved no farther than lets it come to rest
    /// there.
    double turned(const Tick& t, const SelfMotion<double>& m, const JointFunctions<double>& f,
                  double wish) const noexcept {
        const double held = psi_carried(arm_, m, f, t.now.z3, q_.q, options_.velocity),
                     way = wrap(wish - held);
        const Joints slope = rate(arm_, f, sin_cos(held));
        double most = infinity, hardest = infinity, jerk = infinity;
        for (int j = 0; j < joints; ++j) {
            most = min(most, 0.5 * options_.velocity[j] / abs(slope.q[j]));
            hardest = min(hardest, TrackerTuning::turning * options_.acceleration[j] / abs(slope.q[j]));
            jerk = min(jerk, TrackerTuning::turning * options_.jerk[j] / abs(slope.q[j]));
        }
        double speed = min(most, sqrt(2.0 * hardest * abs(way)));
        if (jerk < infinity) speed = min(speed, std::cbrt(jerk * way * way));
        if (t.elbow || is_nearly_singular(t.now))
            speed = min(speed, speed_near_singular(arm_, m, f, t.now, held, way, q_.q, v_, options_.velocity,
                                                   options_.acceleration, TrackerTuning::turning));
        return held + copysign(min(abs(way) / TrackerTuning::ticks, speed * t.dt), way);
    }

    /// Whether the bounds permit these joints next. Violations by rounding alone are corrected in `next`.
    bool taken(const Tick& t, const double* wanted, Joints& next) const noexcept {
        for (int j = 0; j < joints; ++j) {
            const double move = wanted[j] - q_.q[j], least = t.lower[j] * t.dt, most = t.upper[j] * t.dt;
            if (!(move >= least - TrackerTuning::outside && move <= most + TrackerTuning::outside))
                return false;
            next.q[j] = wanted[j];
            if (move < least) next.q[j] = q_.q[j] + least;
            if (move > most) next.q[j] = q_.q[j] + most;
        }
        next.q[joints] = 0;
        if (!t.guard) return true;
        double v[joints];
        for (int j = 0; j < joints; ++j) v[j] = (next.q[j] - q_.q[j]) / t.dt;
        return t.guard->allows(v);
    }

    Pose<double> wanted_ = identity_pose();  // the target relative to this arm
    Vec3<double> wrist_speed_{};             // m/s: velocity of the target's wrist, averaged
    double margin_ = 0;                      // rad from straight that joint 4 keeps at the target's speed
    double ahead_ = 0;                       // the same, in time for the target
    Crossing crossing_;
    bool arrived_ = false;  // the last cycle was at its goal
    bool relaxing_ = false;
    bool other_body_;  // the body is not the arm itself: its branches and pairs have their own numbers
};

}  // namespace armangle

#include "../names/end.hpp"
