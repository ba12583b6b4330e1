// The loop for teleoperation, joysticks, cameras and policies: every control cycle returns a configuration.
//
//   command -> target (filter) -> goal: exact arcs, else the target moved into reach and its arcs, else the
//   least relaxation
//                              -> move: exact inside the box of moves within the bounds, else least squares
//
// The joints alone guarantee the bounds: |v| <= velocity, |v - v_before| <= acceleration dt. After every
// cycle v^2 / (2 acceleration) <= the room to each limit. So braking is possible however long the next cycles
// are: braking by dt' covers (v - a dt') dt' and leaves (v - a dt')^2 / 2a <= v^2 / 2a - that.
//
// The joints determine the branch: the arm may pass through theta_2 = 0 and theta_6 = 0, where two meet.
// Joint 4 stays on its side of the stretched arm.
#pragma once

#include <optional>
#include <type_traits>

#include "saved.hpp"
#include "tracker_move.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The loop of an arm, whose body may differ from it; see Tracker.
class TrackerLoop : protected TrackerMove {
public:
    /// Starts at rest at joints q, with the target at the end effector. Joints outside their limits are moved
    /// back, within the bounds, by the cycles that follow.
    void start(const double* q) noexcept { start(q, user_pose(arm_, chain(arm_, q).flange)); }

    /// Starts at rest at joints q with the target `hand`, away from the end effector.
    void start(const double* q, const Pose<double>& hand) noexcept {
        for (int j = 0; j < joints; ++j) {
            q_.q[j] = q[j];
            v_[j] = a_[j] = 0;
        }
        q_.q[joints] = 0;
        stopping_rate_ = 1.0 / options_.dt;
        margin_ = options_.still_margin;
        wrist_speed_ = {};
        side_ = side_to_keep();
        least_bend_ = bend_to_keep();
        relaxing_ = false;
        stalled_at_ = q_;
        forget();
        tried_ = 0;
        barred_ = 0;
        draw_ = 1;
        arrived_ = given_up_ = false;
        choice_ = {};
        end_detour();
        escaping_ = options_.scene && nearest_pair(0.0).room < 0;
        goal_pose_ = user_pose(arm_, chain(arm_, q_.q).flange);
        hand_.start(hand);
        before_ = hand;
        hinted_ = {};
    }

    /// The present joint values (rad).
    const double* q() const noexcept { return q_.q; }
    /// The arm that it moves.
    const Arm& arm() const noexcept { return arm_; }
    /// Calls `visit` for the state that one cycle passes to the next, to save or restore it (saved.hpp).
    template <class Visit>
    void each_number(Visit& visit) {
        hand_.each_number(visit);
        choice_.each_number(visit);
        visit.all(q_, relaxed_, v_, a_, stopping_rate_, wrist_speed_, margin_, side_, least_bend_, ahead_,
                  asked_, stalled_at_, stalled_for_, nearest_, waited_, hinted_, before_, fixed_, arrived_,
                  given_up_, closest_, idle_, relaxing_, searching_, tried_, tried_for_, waypoint_,
                  detour_target_, barred_, draw_, escaping_, goal_pose_, goal_at_, goal_gap_);
        visit.within(goal_why_, 0, status_count - 1);
        visit.within(turning_to_, -1, configurations - 1);
        visit.within(waypoint_count_, 0, 2);
    }

    /// Prepares for changed obstacles after a state was restored: the next cycle treats the target as moved,
    /// so that an arm at rest avoids them. A motion in progress continues, since each cycle has its own
    /// proof.
    void look_again() noexcept {
        tried_ = 0;
        barred_ = 0;
        hinted_.target.x = infinity;
        escaping_ = options_.scene && nearest_pair(0.0).room < 0;
    }

    /// The accepted target, in the frame that poses are given in.
    const Pose<double>& hand() const noexcept { return hand_.pose(); }

    /// Records the distance (m) of the end effector from the target after a cycle of dt (s; 0: that of the
    /// options). Does nothing while the target moves. For a target at rest that is not reached in time,
    /// takes one step of the search for a solution, and turns to the one that was found, or without one to
    /// the nearest configuration.
    void record_distance(double distance, double dt) noexcept {
        if (!fixed_) return;
        const double time = seconds(dt);
        choice_.rested += time;
        if (turning_to_ < 0) idle_ += time;
        const bool met = distance <= TrackerTuning::exact && closest_ > 0;
        const bool nearer = distance < closest_ - TrackerTuning::gain ||
                            distance < (1.0 - TrackerTuning::progress) * closest_;
        if (met || nearer) {
            closest_ = met ? 0.0 : distance;
            idle_ = 0;
        }
        const bool busy = asked_ || (options_.scene && turning_to_ >= 0);
        if (distance <= TrackerTuning::exact || busy || choice_.rested < TrackerTuning::patience) return;
        if (choice_.state == RestingChoice::open) ask_next_branch();
        const bool holds = goal_why_ == static_cast<int>(Status::OK), idle = idle_ >= TrackerTuning::patience;
        if (choice_.state == RestingChoice::found && (!holds || idle)) take_choice();
        if (choice_.state == RestingChoice::none && idle && !arrived_ && !given_up_ && !options_.scene) {
            choice_.at = goal_at_;  // no branch has a solution: the nearest that was found
            choice_.why = goal_why_;
            choice_.gap = goal_gap_;
            take_choice();
        }
    }

    /// The nearest pair of the present configuration among those within `reach` (m) of the clearance; its
    /// `pair` is 0 if there is none. The room allows for rounding: joints at the end of an arc may touch by
    /// that.
    NearestPair nearest_pair(double reach) const noexcept {
        NearestPair out = nearest_pair_of_body(reach);
        out.room += StraightMoveTuning::rounded;
        return out;
    }

protected:
    using TrackerMove::TrackerMove;
    TrackerLoop(const TrackerLoop&) noexcept = default;
    TrackerLoop& operator=(const TrackerLoop&) noexcept = default;
    ~TrackerLoop() = default;

    /// Computes the next cycle without recording the distance to the target. Call record_distance() with that
    /// distance afterwards; it depends on the tool.
    Tracked cycle(const Command& command, Guard* guard) noexcept {
        const bool valid =
            command.pose && is_rigid(*command.pose) && norm(command.pose->position) <= tolerance::length;
        Tick t{seconds(command.dt), chain(arm_, q_.q)};
        const bool misled = command.elbow && !says_something(*command.elbow);
        t.elbow = misled ? nullptr : command.elbow;
        t.gc = branch(t.now);
        hand_.tick(valid ? command.pose : nullptr, t.dt);
        see(command);
        t.there =
            size(difference(user_pose(arm_, t.now.flange), wanted_), options_.length) <= TrackerTuning::exact;
        t.rests = t.there && is_singular(t.now);
        if (command.reconfigure >= 0 && command.reconfigure < configurations &&
            command.reconfigure != index(t.gc)) {
            end_detour();
            forget();
            turning_to_ = command.reconfigure;
            choice_ = {};
            choice_.home = command.reconfigure;
            asked_ = true;
            given_up_ = false;
        }
        const bool refused = asked_ && !worth_a_turn(t);
        if (refused) {
            end_detour();
            forget();
            choice_.home = own_branch(t);
        }
        box(t);
        if (guard) guard->begin(q_.q, v_, a_, t.dt, t.limits, stopping_rate_);
        t.guard = guard;
        Goal goal;
        Joints next;
        note_target_motion(t);
        const bool there =
            choice_.state == RestingChoice::taken ? pursue_choice(t, goal, next) : pursue(t, goal, next);
        arrived_ = there && !given_up_;
        goal_at_ = goal.at;
        goal_why_ = static_cast<int>(goal.why);
        goal_gap_ = goal.gap;
        if (given_up_) {
            come_to_rest(t, next);
        } else if (there) {
            fixed_ ? record_arrival() : forget();
            end_detour();
            given_up_ = fixed_ && makes_no_progress(goal);
        } else if (turning_to_ >= 0) {
            follow_waypoints(t, goal, next);
        } else {
            approach(t, goal, next);
        }
        goal_pose_ = goal.pose;
        if (t.guard) stopping_rate_ = t.guard->rate();
        Tracked out = finish(t, goal, next, valid, misled);
        if (refused && out.why != Status::BAD_INPUT) out.why = Status::LIMITS;
        return out;
    }

private:
    /// The branch of joints q in the numbering of the body.
    virtual int branch_of_body(const double* q) const noexcept = 0;
    /// The nearest pair of the body at its joints among those within `reach` (m) of the clearance.
    virtual NearestPair nearest_pair_of_body(double reach) const noexcept = 0;
    /// The share of the straight motion of the body by d (rad) from its joints that is proven collision-free.
    virtual double proven_share(const double (&d)[joints]) const noexcept = 0;
    /// The collision-free solution of the body in branch gc within `limits`, near options.near by
    /// options.weight; options.branches permits gc alone.
    virtual Nearest solution_at_rest(const Limits& limits, const Pose<double>& target, int gc,
                                     const NearestOptions& options) const noexcept = 0;

    /// The branch of the present configuration, in the numbering of the body.
    int own_branch(const Tick& t) const noexcept { return other_body_ ? branch_of_body(q_.q) : index(t.gc); }

    /// Whether the straight joint motion to a configuration is proven collision-free.
    bool is_way(const double* to) const noexcept {
        if (!options_.scene) return true;
        double d[joints];
        for (int j = 0; j < joints; ++j) d[j] = to[j] - q_.q[j];
        return !(proven_share(d) < 1.0);
    }

    /// Whether a target for the elbow is usable: a finite point, or a direction that is not 0.
    static bool says_something(const Towards& hint) noexcept {
        const double size = norm(hint.target);
        return size < infinity && (hint.wish == Wish::point || size > 0);
    }

    /// Sets the target of this cycle to the filtered one; `seen` in the command moves it to this arm's frame.
    void see(const Command& command) noexcept {
        wanted_ = hand_.pose();
        speed_ = hand_.velocity();
        acceleration_ = hand_.acceleration();
        if (!command.seen) return;
        const Pose<double>& seen = *command.seen;
        wanted_ = seen * wanted_;
        speed_ = {seen.rotation * speed_.linear + command.drift, seen.rotation * speed_.angular};
        acceleration_ = {seen.rotation * acceleration_.linear, seen.rotation * acceleration_.angular};
    }

    /// If the target has moved, discards what earlier attempts found.
    void note_target_motion(const Tick& t) noexcept {
        const Towards hint = t.elbow ? *t.elbow : Towards{};
        const double speed = size(hand_.velocity(), options_.length), moved = distance_to_target(before_);
        fixed_ = max(speed, moved) <= TrackerTuning::exact && norm(hint.target - hinted_.target) == 0 &&
                 hint.wish == hinted_.wish;
        hinted_ = hint;
        before_ = hand_.pose();
        given_up_ = given_up_ && fixed_;
        if (!fixed_) {
            closest_ = infinity;
            idle_ = 0;
            const int home = moved > TrackerTuning::exact ? own_branch(t) : choice_.home;
            choice_ = {};
            choice_.home = home;
        }
        if (tried_ > 0 && distance_to_target(tried_for_) > TrackerTuning::lively) tried_ = 0;
        if (waypoint_count_ == 0 || !(distance_to_target(detour_target_) > TrackerTuning::strayed)) return;
        if (asked_) {
            waypoint_count_ = 0;
        } else {
            end_detour();
        }
    }

    /// Whether a branch has a solution for the target, or for the nearest pose within joint 4's reach. The
    /// branch is the requested one, else the arm's own.
    bool holds_hand(const Tick& t, Goal& goal) noexcept {
        if (!within(t, circle(arm_, flange_pose(arm_, wanted_)), options_.still_margin, goal)) return false;
        const double q_4 = goal.at.q[3];
        return q_4 >= arm_.limits.lower[3] - TrackerTuning::outside &&
               q_4 <= arm_.limits.upper[3] + TrackerTuning::outside;
    }

    /// Whether the requested branch reaches the target, or comes as near as the arm's own branch.
    bool worth_a_turn(const Tick& t) noexcept {
        Goal there, here;
        if (!holds_hand(t, there)) return false;
        if (!(there.gap > 0)) return true;
        const int to = turning_to_;
        turning_to_ = -1;
        const bool nearer = holds_hand(t, here) && here.gap < there.gap - TrackerTuning::exact;
        turning_to_ = to;
        return !nearer;
    }

    /// Searches the next branch (0..7) for a collision-free solution of the target with a collision-free
    /// straight way, and keeps it if the joints reach it sooner than those of the branches before. Without
    /// detours only the home branch counts. After the last branch the choice is found, or none.
    void ask_next_branch() noexcept {
        const int gc = choice_.asked++;
        const bool may = options_.detours || gc == choice_.home;
        const double side = configuration(gc).elbow;
        const Pose<double>& target = hand_.pose();
        NearestOptions options;
        options.near = q_.q;
        options.branches = 1u << gc;
        for (int j = 0; j < joints; ++j)
            if (options_.velocity[j] < infinity)
                options.weight[j] = 1.0 / (options_.velocity[j] * options_.velocity[j]);
        if (may) {
            const Nearest one = solution_at_rest(kept_on(side, options_.still_margin), target, gc, options);
            if (is_solved(one.status) && one.distance < choice_.cost && is_way(one.q)) {
                choice_.cost = one.distance;
                for (int j = 0; j < joint_slots; ++j) choice_.at.q[j] = one.q[j];
            }
        }
        if (choice_.asked < configurations) return;
        choice_.state = choice_.cost < infinity ? RestingChoice::found : RestingChoice::none;
    }

    /// Starts a straight joint motion to the chosen solution, where the arm stays until the target moves.
    void take_choice() noexcept {
        choice_.state = RestingChoice::taken;
        turn_to(choice_.at, index(configuration(arm_, chain(arm_, choice_.at.q).theta)));
        given_up_ = false;
    }

    /// Sets the chosen solution as the goal; true if the joints of the next cycle can be there.
    bool pursue_choice(const Tick& t, Goal& goal, Joints& next) noexcept {
        grow_margin(t, circle(arm_, flange_pose(arm_, wanted_)));
        const Chain there = chain(arm_, choice_.at.q);
        goal.why = static_cast<Status>(choice_.why);
        goal.pose = goal.why == Status::OK ? wanted_ : user_pose(arm_, there.flange);
        goal.at = choice_.at;
        goal.gap = choice_.gap;
        goal.gc = index(configuration(arm_, there.theta));
        goal.psi = arm_angle(triad(arm_, there.flange), there.z3);
        goal.posture_only = true;
        if (!exact(t, goal, next)) return false;
        if (t.elbow) choice_.state = RestingChoice::left;  // from here psi goes to the elbow's target
        return true;
    }

    /// Sets velocity (rad/s) and acceleration of joint j (0..6) after a cycle. With bounded jerk a violation
    /// of the box by rounding is corrected: the rounding of a position, divided by dt^2, could make a stop
    /// impossible.
    void go_on(const Tick& t, int j, double v) noexcept {
        const double wanted = min(max(v, t.lower[j]), t.upper[j]);
        if (bound_[j].has_jerk() && abs(wanted - v) * t.dt <= TrackerTuning::rounding) v = wanted;
        a_[j] = (v - v_[j]) / t.dt;
        v_[j] = v;
    }

    /// Makes `next` the present joints and returns the result of the cycle; `valid`: the command has a pose,
    /// `misled`: its hint for the elbow is invalid.
    Tracked finish(const Tick& t, const Goal& goal, const Joints& next, bool valid, bool misled) noexcept {
        Tracked out{};
        bool fastest = false, outside = false;
        for (int j = 0; j < joints; ++j) {
            const double to =
                min(max(next.q[j], min(arm_.limits.lower[j], q_.q[j])), max(arm_.limits.upper[j], q_.q[j]));
            outside |= to < arm_.limits.lower[j] || to > arm_.limits.upper[j];
            const double v = (to - q_.q[j]) / t.dt;
            q_.q[j] = out.q[j] = to;
            out.velocity[j] = v;
            go_on(t, j, v);
            fastest |= abs(v_[j]) >= options_.velocity[j] * (1.0 - TrackerTuning::exact);
        }
        const double bend = detail::elbow_bend(arm_, q_.q[3]);
        if (abs(bend) > TrackerTuning::level) side_ = bend < 0 ? -1.0 : 1.0;
        if (bent() >= options_.still_margin) least_bend_ = options_.still_margin;
        const Chain now = chain(arm_, q_.q);
        const Pose<double> tool = user_pose(arm_, now.flange);
        out.distance = size(difference(tool, wanted_), options_.length);
        out.gap = goal.gap;
        const Triad<double> on = triad(arm_, flange_pose(arm_, tool));
        out.psi = arm_angle(on, now.z3);
        out.gc = index(configuration(arm_, now.theta));
        out.status = out.distance <= TrackerTuning::exact ? Tracking::FOLLOWING : Tracking::LAGGING;
        out.why = out.status == Tracking::FOLLOWING ? Status::OK : goal.why;
        if (out.status == Tracking::LAGGING && goal.why != Status::OK) out.status = Tracking::NEAREST;
        if (out.status == Tracking::LAGGING)
            out.why = fastest ? Status::VELOCITY_LIMIT : Status::ACCELERATION_LIMIT;
        const Tag met = t.guard ? t.guard->blocking() : 0;
        if (out.status == Tracking::LAGGING && met) out.why = Status::CLEARANCE;
        const bool waits = met && waited_ >= TrackerTuning::patience;  // a way may still be found
        const bool ended =
            given_up_ || waits || (detours_exhausted() && stalled_for_ >= TrackerTuning::stall);
        if (out.status == Tracking::LAGGING && ended) {
            out.status = Tracking::NEAREST;
            out.why = met || barred_ ? Status::CLEARANCE : Status::LIMITS;
        }
        if (hand_.held()) out.status = Tracking::HELD;
        if (turning_to_ >= 0) out.status = Tracking::TURNING;
        if (outside) {
            out.status = Tracking::RETURNING;
            out.why = Status::LIMITS;
        }
        if (escaping_) {
            const NearestPair nearest = nearest_pair(0.0);
            escaping_ = nearest.room < 0;
            if (escaping_) {
                out.status = Tracking::RETURNING;
                out.why = Status::CLEARANCE;
                out.pair = nearest.pair;
            }
        }
        if (!valid || misled) out.why = Status::BAD_INPUT;
        if (out.why != Status::CLEARANCE && out.why != Status::POSE_BLOCKED) return out;
        if (!escaping_) out.pair = goal.pair ? goal.pair : met;
        if (!out.pair) out.pair = barred_;
        return out;
    }

    double stopping_rate_ = 1;               // 1/s: at which all joints can stop collision-free
    Joints goal_at_{};                       // configuration of the last goal ...
    double goal_gap_ = 0;                    // its gap (m)
    int goal_why_ = 0;                       // ... and why it is not the target
    Towards hinted_{};                       // elbow's target in the previous cycle ...
    Pose<double> before_ = identity_pose();  // ... and the target
    bool escaping_ = false;                  // the arm started in collision
};

/// Joints that follow a target in control cycles within bounds on velocity and acceleration;
/// docs/background/paths.md. The `Body` is what must avoid obstacles: the arm itself, or the true chain that
/// it represents, and `about` the scene prepared for it. The options' scene is prepared for the arm and
/// determines where to go.
template <class Body = Arm>
class Tracker final : public TrackerLoop {
public:
    /// A loop of an arm, which it copies, at rest at the middles of the joint ranges. The scene of the
    /// options must outlive it.
    Tracker(const Arm& arm, const TrackerOptions& options) noexcept
        requires std::is_same_v<Body, Arm>
        : Tracker(arm, options, arm, options.scene) {}
    /// A loop of an arm whose true links are those of `body` (it copies both), among the obstacles `about`
    /// (null: none), at rest at the middles of the joint ranges. The scenes must outlive it.
    Tracker(const Arm& arm, const TrackerOptions& options, const Body& body, const Scene* about) noexcept
        : TrackerLoop(arm, options, !std::is_same_v<Body, Arm>), body_(body), about_(about) {
        double middle[joint_slots];
        for (int j = 0; j < joint_slots; ++j) middle[j] = arm.joint_middle[j];
        start(middle);
    }

    /// Advances one control cycle towards the command's target and returns the next joints, their velocities
    /// and status.
    Tracked step(const Command& command) noexcept {
        const Tracked out = tick(command);
        record_distance(out.distance, command.dt);
        return out;
    }

    /// Computes the next cycle without recording the distance to the target. Call record_distance() with that
    /// distance afterwards; it depends on the tool.
    Tracked tick(const Command& command) noexcept {
        if (!options_.scene) return cycle(command, nullptr);
        GuardOf<Body> guard(body_, *about_, options_.acceleration, has_jerk_ ? bound_ : nullptr);
        return cycle(command, &guard);
    }

private:
    /// See TrackerLoop::branch_of_body.
    int branch_of_body(const double* q) const noexcept override { return forward(body_, q).gc; }
    /// See TrackerLoop::nearest_pair_of_body.
    NearestPair nearest_pair_of_body(double reach) const noexcept override {
        return StraightMove(body_, *about_).nearest_pair(q_.q, reach);
    }
    /// See TrackerLoop::proven_share.
    double proven_share(const double (&d)[joints]) const noexcept override {
        Tag pair = 0;
        return StraightMove(body_, *about_).proven(q_.q, d, pair, StraightMoveTuning::many_looks);
    }
    /// See TrackerLoop::solution_at_rest.
    Nearest solution_at_rest(const Limits& limits, const Pose<double>& target, int gc,
                             const NearestOptions& options) const noexcept override {
        std::optional<Scene> around;
        if (about_) {
            around = *about_;
            around->clearance += GuardTuning::standoff;
        }
        return resting_solution(body_, limits, around ? &*around : nullptr, target, gc, options);
    }

    Body body_;
    const Scene* about_;  // prepared for the body
};

}  // namespace armangle

#include "../names/end.hpp"
