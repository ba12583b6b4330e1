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

#include "../limits/solve_locally.hpp"
#include "../scene/clear.hpp"
#include "elbow_choice.hpp"
#include "guard.hpp"
#include "hand_filter.hpp"
#include "jerk.hpp"
#include "leaving.hpp"
#include "resting_choice.hpp"
#include "saved.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// State of the motion after a control cycle.
enum class Tracking : std::uint8_t {
    FOLLOWING,  // the end effector is at the target
    LAGGING,    // approaching the target as fast as the bounds allow
    NEAREST,    // the target is out of reach: at, or on the way to, the nearest pose
    HELD,       // no accepted sample: continuing as predicted
    TURNING,    // moving to another configuration in joint space: the end effector leaves the target
    RETURNING,  // a joint violates its limits, or a link collides, since the start: leaving that state
};

/// The bounds of a tracker, and the obstacles that it avoids.
struct TrackerOptions {
    double dt = 0.004;            // s
    double velocity[joints];      // rad/s; infinite: unbounded
    double acceleration[joints];  // rad/s^2; infinite: unbounded
    double jerk[joints] = {infinity, infinity, infinity, infinity,
                           infinity, infinity, infinity};  // rad/s^3; infinite: unbounded
    double length = 0.2;                                   // m that count as one radian
    double still_margin = 0.05;                            // rad from straight that joint 4 keeps at rest
    double elbow_margin = 0.35;       // rad from straight that it keeps while the target is fast
    double singularity_margin = 0.0;  // rad from theta_2, theta_6 = 0, if arcs allow it
    double soft_clearance = 0.02;     // m beyond the scene's clearance that the elbow keeps if arcs allow it
    bool detours = true;              // whether the end effector may leave the target to find another way
    const Scene* scene = nullptr;     // obstacles to avoid; must outlive the tracker
    HandFilter hand;
};

/// Input of a control cycle. If the pose is null or invalid, the target continues as predicted.
struct Command {
    const Pose<double>* pose = nullptr;
    const Towards* elbow = nullptr;      // point or direction for the elbow; null: free
    double dt = 0;                       // s of this cycle; 0: that of the options
    int reconfigure = -1;                // 0..7: go to this branch, through configurations off the target
    const Pose<double>* seen = nullptr;  // the target pose relative to this arm; null: unchanged
    Vec3<double> drift{};                // m/s: motion of that pose while the target is constant
};

/// Result of a control cycle: the next joints, and their distance from the target.
struct Tracked {
    double q[joint_slots];
    double velocity[joints];  // rad/s, (q - q before) / dt
    Tracking status;
    double distance;  // m from the end effector to the target: sqrt(|dp|^2 + (length angle)^2)
    double gap;       // m by which the target's wrist is outside joint 4's reach
    double psi;       // in (-pi, pi]
    int gc;
    Status why;  // why the end effector is not at the target
    Tag pair;    // if an obstacle is the reason: obstacle and link; 0: none
};

namespace tracker_tuning {
inline constexpr double exact = 1e-9;       // m: within this distance the end effector is at its target
inline constexpr double rounding = 2e-15;   // rad: error that a sum of joint values may have
inline constexpr double outside = 1e-9;     // rad: joints this far outside the box are rounding errors
inline constexpr double soft = 0.05;        // rad from limits that is kept if arcs allow it
inline constexpr double braking = 0.6;      // share of the acceleration that an approach assumes
inline constexpr double direct = 1.0;       // the same if only the position comes nearer
inline constexpr double assured = 0.2;      // share that always remains, however hard the target brakes
inline constexpr double aside = 0.1;        // of `length`: metres a radian counts beside position alone
inline constexpr double turning = 0.3;      // the same of psi
inline constexpr double ticks = 3.0;        // an approach ends no faster than geometrically over so many
inline constexpr double regular = 1e-4;     // added to H, m^2/rad^2
inline constexpr double damping = 2e-3;     // added as well if the end effector is late
inline constexpr double late = 0.0015;      // m from the target at which all of it is added
inline constexpr double preview = 0.15;     // s ahead for which psi is chosen
inline constexpr double fast = 0.1;         // m/s of the wrist at which the elbow's margin is full
inline constexpr double trembling = 0.05;   // s over which the wrist's velocity is averaged for that
inline constexpr double growing = 0.1;      // s in which that margin grows
inline constexpr double shrinking = 2.0;    // s in which it shrinks
inline constexpr double beyond = 1e-6;      // a configuration violating a limit by more (rad) is rejected
inline constexpr double seam = 2e-6;        // rad between limits a whole turn apart
inline constexpr double negligible = 1e-4;  // rad of that margin
inline constexpr double crossing = 0.3;     // rad of theta_2, theta_6 within which both branches are compared
inline constexpr double leap = 3.0;         // m/s: a goal that moves faster has jumped
inline constexpr double standing = 0.02;    // rad/s: slower joints count as standing in a stall
inline constexpr double stall = 0.3;        // s of standing away from a goal before the arm turns to it
inline constexpr double lively = 0.02;      // m: a target that has moved farther starts a new case
inline constexpr double slow = 0.1;         // m/s: for a slower target the arm tries detours after ...
inline constexpr double patience = 1.0;     // s without coming nearer by ...
inline constexpr double progress = 0.1;     // ... this share, which is a stall near obstacles
inline constexpr double turned = 0.05;      // rad from the goal's configuration at which turning ends
inline constexpr double irregular = 0.7;    // |sin| of theta_2, theta_6 below which psi turns less ...
inline constexpr double shut = 0.05;        // ... and joints move by the least amount, ...
inline constexpr double roomy = 0.15;       // ... rad from limits
inline constexpr double remote = 1.0;       // rad: a configuration with a joint farther away is not nearby
inline constexpr double near = 0.1;     // rad within which a configuration nearer to the target is taken ...
inline constexpr double pays = 1e-3;    // ... and m that it must gain for each rad beyond
inline constexpr double level = 0.01;   // rad from straight within which joint 4 has no side ...
inline constexpr double scant = 0.6;    // ... at a start, if limits leave it less than that
inline constexpr double worth = 0.005;  // m that another start of the relaxation must gain
inline constexpr double strayed = 0.1;  // m: a target that has moved this far invalidates a way to it
inline constexpr double gain = 1e-4;    // m nearer to a resting target for which time is extended
inline constexpr double calm = 1e-3;    // rad of the elbow's margin above that at rest, negligible
inline constexpr double led = 0.02;     // rad nearer to the elbow's target worth leaving theta_2, theta_6 = 0
inline constexpr int turns = 8;         // configurations that are tried for one target
inline constexpr int ways = 2, most_ways = 600;  // ways around an obstacle tried in a cycle, and in all
inline constexpr int rounds = 6, starts = 16;    // of the relaxation in one cycle
}  // namespace tracker_tuning

/// Joints that follow a target in control cycles within bounds on velocity and acceleration;
/// docs/background/paths.md. The `Body` must avoid obstacles: the arm itself or the true chain that it
/// represents. `about` is the scene prepared for it. The options' scene is the arm's own and determines where
/// to go.
template <class Body = Arm>
class Tracker {
public:
    /// Prepares the tracking loop of an arm, which must outlive it.
    Tracker(const Arm& arm, const TrackerOptions& options) noexcept
        requires std::is_same_v<Body, Arm>
        : Tracker(arm, options, arm, options.scene) {}
    /// Prepares the loop for an arm whose true links are those of `body`, among the obstacles `about`.
    Tracker(const Arm& arm, const TrackerOptions& options, const Body& body, const Scene* about) noexcept
        : arm_(arm), body_(body), about_(about), options_(options), hand_(options.hand) {
        for (int j = 0; j < joints; ++j) {
            bound_[j] = jerk_bounds(options.velocity[j], options.acceleration[j], options.jerk[j]);
            has_jerk_ |= bound_[j].has_jerk();
        }
        Limits soft = arm.limits;
        for (int j = 0; j < joints; ++j) {
            const double room = min(tracker_tuning::soft, 0.1 * (soft.upper[j] - soft.lower[j]));
            soft.lower[j] += room;
            soft.upper[j] -= room;
        }
        plain_ = limit_table(arm, parted(arm.limits));
        clear_ = limit_table(arm, soft, options.singularity_margin);
        if (options.scene) {
            kept_ = soft_ = *options.scene;
            kept_.clearance += guard_tuning::standoff;
            soft_.clearance += max(options.soft_clearance, guard_tuning::standoff);
        }
        double middle[joint_slots];
        for (int j = 0; j < joint_slots; ++j) middle[j] = arm.joint_middle[j];
        start(middle);
    }

    /// Starts at rest at joints q, with the target at the end effector. Joints outside their limits are moved
    /// back within the bounds.
    void start(const double* q) noexcept { start(q, user_pose(arm_, chain(arm_, q).flange)); }

    /// Starts at rest at joints q with a target away from the end effector.
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
        rest();
        escaping_ = options_.scene && nearest_pair(0.0).room < 0;
        goal_pose_ = user_pose(arm_, chain(arm_, q_.q).flange);
        hand_.start(hand);
        before_ = hand;
        hinted_ = {};
    }

    const double* q() const noexcept { return q_.q; }
    const Arm& arm() const noexcept { return arm_; }

    /// The state that one cycle passes to the next (saved.hpp).
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
    /// The nearest pair of the present configuration among those within `reach` (m) beyond the clearance. Its
    /// room allows for rounding: joints at the end of an arc may touch by that.
    NearestPair nearest_pair(double reach) const noexcept {
        NearestPair out = StraightMove(body_, *about_).nearest_pair(q_.q, reach);
        out.room += straight_move_tuning::rounded;
        return out;
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

    /// Advances one control cycle and returns its result.
    Tracked step(const Command& command) noexcept {
        const Tracked out = tick(command);
        note(out.distance, command.dt);
        return out;
    }

    /// Computes the next cycle without recording the distance to the target. Call note() with that distance
    /// afterwards; it depends on the tool.
    Tracked tick(const Command& command) noexcept {
        const bool valid =
            command.pose && is_rigid(*command.pose) && norm(command.pose->position) <= tolerance::length;
        Tick t{seconds(command.dt), chain(arm_, q_.q)};
        const bool misled = command.elbow && !says_something(*command.elbow);
        t.elbow = misled ? nullptr : command.elbow;
        t.gc = branch(t.now);
        hand_.tick(valid ? command.pose : nullptr, t.dt);
        see(command);
        t.there = size(difference(user_pose(arm_, t.now.flange), wanted_), options_.length) <=
                  tracker_tuning::exact;
        t.rests = t.there && is_singular(t.now);
        if (command.reconfigure >= 0 && command.reconfigure < configurations &&
            command.reconfigure != index(t.gc)) {
            rest();
            forget();
            turning_to_ = command.reconfigure;
            choice_ = {};
            choice_.home = command.reconfigure;
            asked_ = true;
            given_up_ = false;
        }
        const bool refused = asked_ && !worth_a_turn(t);
        if (refused) {
            rest();
            forget();
            choice_.home = own_branch(t);
        }
        std::optional<Guard<Body>> guard;
        box(t);
        if (options_.scene) {
            guard.emplace(body_, *about_, options_.acceleration, has_jerk_ ? bound_ : nullptr);
            guard->begin(q_.q, v_, a_, t.dt, t.limits, stopping_rate_);
            t.guard = &*guard;
        }
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
            stand(t, next);
        } else if (there) {
            fixed_ ? meet() : forget();
            rest();
            given_up_ = fixed_ && makes_no_progress(goal);
        } else if (turning_to_ >= 0) {
            turn(t, goal, next);
        } else {
            approach(t, goal, next);
        }
        goal_pose_ = goal.pose;
        if (t.guard) stopping_rate_ = t.guard->rate();
        Tracked out = finish(t, goal, next, valid, misled);
        if (refused && out.why != Status::BAD_INPUT) out.why = Status::LIMITS;
        return out;
    }

    /// Records the distance to the target. For a target at rest that is not reached in time, takes one step
    /// of the search for a solution, and turns to the one that was found.
    void note(double distance, double dt) noexcept {
        if (!fixed_) return;
        const double time = seconds(dt);
        choice_.rested += time;
        if (turning_to_ < 0) idle_ += time;
        const bool met = distance <= tracker_tuning::exact && closest_ > 0;
        const bool nearer = distance < closest_ - tracker_tuning::gain ||
                            distance < (1.0 - tracker_tuning::progress) * closest_;
        if (met || nearer) {
            closest_ = met ? 0.0 : distance;
            idle_ = 0;
        }
        const bool busy = asked_ || (options_.scene && turning_to_ >= 0);
        if (distance <= tracker_tuning::exact || busy || choice_.rested < tracker_tuning::patience) return;
        if (choice_.state == RestingChoice::open) ask_next_branch();
        const bool holds = goal_why_ == static_cast<int>(Status::OK),
                   idle = idle_ >= tracker_tuning::patience;
        if (choice_.state == RestingChoice::found && (!holds || idle)) take_choice();
        if (choice_.state == RestingChoice::none && idle && !arrived_ && !given_up_ && !options_.scene) {
            choice_.at = goal_at_;  // no branch has a solution: the nearest that was found
            choice_.why = goal_why_;
            choice_.gap = goal_gap_;
            take_choice();
        }
    }

private:
    struct Tick {
        double dt;
        Chain now;
        Configuration<double> gc{};
        Limits limits{};                                // joint 4 on its side of the stretched arm
        double lower[joints] = {}, upper[joints] = {};  // rad/s: range of the next velocity
        Guard<Body>* guard = nullptr;                   // set if there are obstacles
        const Towards* elbow = nullptr;
        bool there = false;  // the end effector is at the target ...
        bool rests = false;  // ... and theta_2 or theta_6 is 0
    };

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
        Tag pair = 0;                 // the pair that alone blocks all of them; 0: none
    };

    /// The length (s) of a cycle: the given one, or that of the options.
    double seconds(double dt) const noexcept { return dt > 0 && dt < infinity ? dt : options_.dt; }

    /// Whether a target for the elbow is usable: a finite point, or a direction that is not 0.
    static bool says_something(const Towards& hint) noexcept {
        const double size = norm(hint.target);
        return size < infinity && (hint.wish == Wish::point || size > 0);
    }

    /// Takes the target from the filter; `seen` in the command moves it to this arm's frame.
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
        fixed_ = max(speed, moved) <= tracker_tuning::exact && norm(hint.target - hinted_.target) == 0 &&
                 hint.wish == hinted_.wish;
        hinted_ = hint;
        before_ = hand_.pose();
        given_up_ = given_up_ && fixed_;
        if (!fixed_) {
            closest_ = infinity;
            idle_ = 0;
            const int home = moved > tracker_tuning::exact ? own_branch(t) : choice_.home;
            choice_ = {};
            choice_.home = home;
        }
        if (tried_ > 0 && distance_to_target(tried_for_) > tracker_tuning::lively) tried_ = 0;
        if (waypoint_count_ == 0 || !(distance_to_target(detour_target_) > tracker_tuning::strayed)) return;
        if (asked_) {
            waypoint_count_ = 0;
        } else {
            rest();
        }
    }

    /// The distance (m) from a pose to the target.
    double distance_to_target(const Pose<double>& hand) const noexcept {
        return size(difference(hand, hand_.pose()), options_.length);
    }

    /// If the limits of a joint are a whole revolution apart, narrows them slightly, so that an arc ends
    /// there: no motion across the limit exists.
    static Limits parted(Limits limits) noexcept {
        for (int j = 0; j < joints; ++j) {
            const double over = limits.upper[j] - limits.lower[j] - two_pi + tracker_tuning::seam;
            if (!(over > 0 && over <= 2.0 * tracker_tuning::seam)) continue;
            limits.lower[j] += 0.5 * over;
            limits.upper[j] -= 0.5 * over;
        }
        return limits;
    }

    /// The velocity of the target; 0 if it rests.
    Twist heading() const noexcept { return fixed_ ? Twist{} : speed_; }

    /// The largest displacement (rad) of one joint to a configuration.
    double farthest_move(const Joints& to) const noexcept {
        double farthest = 0;
        for (int j = 0; j < joints; ++j) farthest = max(farthest, abs(to.q[j] - q_.q[j]));
        return farthest;
    }

    // -- bounds

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
        return abs(bend) <= tracker_tuning::level && room < tracker_tuning::scant && room < other ? -own
                                                                                                  : own;
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

    /// Computes the next joint velocities within the bounds after which every joint can still brake. A joint
    /// outside its limits must return, as fast as if it had come to rest there.
    void box(Tick& t) const noexcept {
        const Limits& limits = t.limits = elbow_turns(t) ? arm_.limits : kept_on(side_, least_bend_);
        for (int j = 0; j < joints; ++j) {
            if (bound_[j].has_jerk()) {
                box_of_jerk(t, j);
                continue;
            }
            const double a = options_.acceleration[j], most = options_.velocity[j];
            const double change = max(a * t.dt - tracker_tuning::rounding / t.dt, 0.0);
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

    /// Computes the velocities that a joint with bounded jerk may have next. A joint that cannot stop within
    /// its limits stops as soon as it can.
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
            const double way = max(room - tracker_tuning::rounding, detail::stopping(b, v, a).way);
            return fastest_stopping(b, v, way, dt, lower, upper);
        };
        const auto fastest_down = [&](double room) {
            const double way = max(room - tracker_tuning::rounding, detail::stopping(b, -v, -a).way);
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

    /// Limits the velocities so that joints with bounded jerk do not overshoot. `ahead` (rad/s^2) is how the
    /// requested velocity continues to change.
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

    /// The largest velocity v with v dt + v^2 / 2a <= room.
    static double fastest(double room, double a, double dt) noexcept {
        if (!(room > 0)) return 0.0;
        if (!(room < infinity)) return infinity;
        return 2.0 * room / (dt + sqrt(dt * dt + 2.0 * room / a));
    }

    /// A factor k (1/s) of a velocity k d towards a goal d rad away, such that every joint can stop there; k
    /// |d| falls with this power of |d|.
    struct Pace {
        double k, power;

        void at_most(double other, double its_power) noexcept {
            if (!(other < k)) return;
            k = other;
            power = its_power;
        }
    };

    /// Computes the factor for the displacements d of all joints.
    Pace pace(const double (&d)[joints], double dt) const noexcept {
        Pace out{1.0 / (tracker_tuning::ticks * dt), 1.0};
        for (int j = 0; j < joints; ++j) {
            const double way = abs(d[j]);
            if (!(way > 0)) continue;
            brake(out, j, way, tracker_tuning::braking * options_.acceleration[j]);
            out.at_most(options_.velocity[j] / way, 0.0);
        }
        return out;
    }

    /// Computes how fast the displacements d of the joints along a part of the end effector's path can be
    /// made, with velocities bounded by the box. A joint that reaches its greatest velocity before it must
    /// brake slows no other. A goal that accelerates by `gain` (rad/s^2) changes the deceleration that is
    /// available.
    Pace pace(const double (&d)[joints], const double (&gain)[joints], double share,
              double dt) const noexcept {
        Pace out{1.0 / (tracker_tuning::ticks * dt), 1.0};
        for (int j = 0; j < joints; ++j) {
            const double way = abs(d[j]), a = options_.acceleration[j], v = options_.velocity[j];
            const double away = d[j] > 0 ? gain[j] : -gain[j];
            const double hard = min(max(share * a + away, tracker_tuning::assured * a), a);
            if (way > 0 && 2.0 * hard * way < v * v) brake(out, j, way, hard);
        }
        return out;
    }

    /// Limits the factor so that joint j stops within `way` (rad) by the deceleration `hard` (rad/s^2). With
    /// bounded jerk, v^3 = j way^2 at the end, which takes a jerk of 2/9 j, and j where k becomes constant.
    void brake(Pace& out, int j, double way, double hard) const noexcept {
        out.at_most(sqrt(2.0 * hard / way), 0.5);
        if (bound_[j].has_jerk())
            out.at_most(std::cbrt(tracker_tuning::braking * bound_[j].jerk / way), 2.0 / 3.0);
    }

    // -- the goal

    /// Computes the goal, and the joints of the next cycle if they can be there. If the elbow bends fast
    /// enough, the goal may be at the end of the reach; otherwise the elbow keeps its margin.
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

    /// Whether no joint moved in the previous cycle.
    bool is_at_rest() const noexcept {
        double fastest = 0;
        for (int j = 0; j < joints; ++j) fastest = max(fastest, abs(v_[j]));
        return !(fastest > 0);
    }

    /// Whether the end effector is already at the target and the joints may stay. The limits may end just
    /// here and leave an arc of width 0.
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
        if (max(c.distance - all.outer, all.inner - c.distance) > tracker_tuning::worth) return false;
        if (farthest_move(goal.at) <= tracker_tuning::remote) return false;
        const Relaxed beside = relaxed(arm_, t.limits, q_, wanted_, options_.length, tracker_tuning::rounds);
        return beside.distance <=
               size(difference(goal.pose, wanted_), options_.length) + tracker_tuning::worth;
    }

    /// If theta_2 or theta_6 is 0 and the end effector at the target, keeps the joints, or rotates the
    /// neighbours of that joint until psi can move towards the elbow's target. False if the joints move too
    /// fast.
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
        return size(difference(there, wanted_), options_.length) <= tracker_tuning::exact &&
               taken(t, wanted.q, next);
    }

    /// The way out of the singularity that comes nearest to the elbow's target; gc -1 if none comes nearer.
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
        return best.missed < missed - tracker_tuning::led ? best : Leaving{};
    }

    /// Whether theta_2 or theta_6 is nearly 0 and psi has no target. There the neighbouring joints move far
    /// while psi hardly changes.
    bool is_near_singular(const Tick& t) const noexcept {
        const double bend = min(abs(sin_cos(t.now.theta[1]).sin), abs(sin_cos(t.now.theta[5]).sin));
        return bend <= tracker_tuning::shut && !t.elbow && turning_to_ < 0;
    }

    /// Finds the solution of the goal's pose nearest to the joints. True if it is nearby and no joint is near
    /// a limit there.
    bool solve_nearby(const Tick& t, Goal& goal) const noexcept {
        Attraction near;
        for (int j = 0; j < joints; ++j) {
            near.weight[j] = 1.0;
            near.near[j] = q_.q[j];
        }
        int rounds = local_solve_tuning::rounds;
        const double share = local_solve_tuning::share * arm_.size * arm_.size;
        const Relaxed about = solve_locally(arm_, t.limits, q_, goal.pose, near, share, rounds);
        const Relaxed found = solve_locally(arm_, t.limits, about.at, goal.pose, near, 0.0, rounds);
        if (!meets(arm_, found) || limit_margin(arm_.limits, joint_lanes(found.at.q)) < tracker_tuning::roomy)
            return false;
        const Chain there = chain(arm_, found.at.q);
        goal.at = found.at;
        goal.psi = arm_angle(triad(arm_, there.flange), there.z3);
        goal.gc = index(configuration(arm_, there.theta));
        return true;
    }

    /// Moves the target into joint 4's reach with this margin (rad), and finds a configuration there; false
    /// if limits permit none.
    bool within(const Tick& t, const Circle<double>& c, double margin, Goal& goal) noexcept {
        const Pose<double>& wanted = wanted_;
        const Limits limits = one_side(elbow_side(t), margin);
        const MovedIntoReach drawn = move_into_reach(arm_, reach_shell(arm_, limits), wanted, t.now.flange);
        goal.pose = drawn.pose;
        goal.gap = drawn.gap;
        goal.why = drawn.gap > 0 ? reason(c) : Status::OK;
        return posture_of(t, goal);
    }

    /// Whether a branch has a solution for the target, or for the nearest pose within joint 4's reach. The
    /// branch is the requested one, else the arm's own.
    bool holds_hand(const Tick& t, Goal& goal) noexcept {
        if (!within(t, circle(arm_, flange_pose(arm_, wanted_)), options_.still_margin, goal)) return false;
        const double q_4 = goal.at.q[3];
        return q_4 >= arm_.limits.lower[3] - tracker_tuning::outside &&
               q_4 <= arm_.limits.upper[3] + tracker_tuning::outside;
    }

    /// Whether the requested branch reaches the target, or comes as near as the arm's own branch.
    bool worth_a_turn(const Tick& t) noexcept {
        Goal there, here;
        if (!holds_hand(t, there)) return false;
        if (!(there.gap > 0)) return true;
        const int to = turning_to_;
        turning_to_ = -1;
        const bool nearer = holds_hand(t, here) && here.gap < there.gap - tracker_tuning::exact;
        turning_to_ = to;
        return !nearer;
    }

    // -- the choice for a target at rest

    /// The branch of the present configuration, in the numbering of the body.
    int own_branch(const Tick& t) const noexcept {
        if constexpr (std::is_same_v<Body, Arm>) {
            return index(t.gc);
        } else {
            return forward(body_, q_.q).gc;
        }
    }

    /// Searches one more branch for the solution that the joints reach in the shortest time.
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
            std::optional<Scene> around;
            if (options_.scene) {
                around = *about_;
                around->clearance += guard_tuning::standoff;
            }
            const Limits limits = kept_on(side, options_.still_margin);
            const Nearest one =
                resting_solution(body_, limits, around ? &*around : nullptr, target, gc, options);
            if (is_solved(one.status) && one.distance < choice_.cost && is_way(one.q)) {
                choice_.cost = one.distance;
                for (int j = 0; j < joint_slots; ++j) choice_.at.q[j] = one.q[j];
            }
        }
        if (choice_.asked < configurations) return;
        choice_.state = choice_.cost < infinity ? RestingChoice::found : RestingChoice::none;
    }

    /// Whether the straight joint motion to a configuration is proven collision-free.
    bool is_way(const double* to) const noexcept {
        if (!options_.scene) return true;
        double d[joints];
        Tag pair = 0;
        for (int j = 0; j < joints; ++j) d[j] = to[j] - q_.q[j];
        return !(StraightMove(body_, *about_).proven(q_.q, d, pair, straight_move_tuning::many_looks) < 1.0);
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

    /// Increases the elbow's margin while the wrist is fast, and bends the elbow in time for a target that
    /// comes closer.
    void grow_margin(const Tick& t, const Circle<double>& c) noexcept {
        const Vec3<double> wrist = c.w * c.distance, from_base = wrist + Vec3<double>{0, 0, arm_.d_bs};
        const Twist hand = heading();
        const Vec3<double> arm_to_hand =
            arm_.base.rotation * from_base + arm_.base.position - wanted_.position;
        const Vec3<double> speed =
            arm_.base_inverse.rotation * (hand.linear + cross(hand.angular, arm_to_hand));
        wrist_speed_ = wrist_speed_ + (speed - wrist_speed_) * -std::expm1(-t.dt / tracker_tuning::trembling);
        const double share = min(norm(wrist_speed_) / tracker_tuning::fast, 1.0);
        const double wanted =
            options_.still_margin + share * max(options_.elbow_margin - options_.still_margin, 0.0);
        const double lasting = wanted > margin_ ? tracker_tuning::growing : tracker_tuning::shrinking;
        margin_ += (wanted - margin_) * -std::expm1(-t.dt / lasting);
        if (abs(wanted - margin_) < tracker_tuning::negligible) margin_ = wanted;
        ahead_ = bend_ahead(arm_, wrist, wrist_speed_, side_ * arm_.sign[3] * v_[3], options_.velocity[3],
                            options_.acceleration[3]);
    }

    /// The reason why the target's wrist is out of reach.
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
            const bool shoulder = abs(wrap(t.now.theta[1])) < tracker_tuning::crossing,
                       wrist = abs(wrap(t.now.theta[5])) < tracker_tuning::crossing;
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
            if (t.guard && (!goal.pair || !std::is_same_v<Body, Arm>))
                goal.pair = t.guard->nearest_at(goal.at.q);
        }
        return least < infinity;
    }

    /// Offers the solution of one branch as the goal's configuration; `avoid`: only if it is collision-free.
    void offer(const Tick& t, const Circle<double>& c, const Configuration<double>& gc, bool avoid,
               double& least, Goal& goal) const noexcept {
        const SelfMotion<double> m = self_motion(arm_, c, gc);
        const double psi = choose_psi(t, m, avoid, goal);
        if (is_nan(psi)) return;
        const Joints at = joints_within_limits(arm_, directions(m, sin_cos(psi)), q_.q);
        if (!within_limits(arm_.limits, at.q, tracker_tuning::beyond))
            return;  // at hinge 0 psi is inaccurate
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

    /// Removes the colliding parts of both sets; false, with the reason in the goal, if nothing remains.
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

    /// A factor from 1 down to 0 towards theta_2 and theta_6 = 0, where psi is not influenced.
    static double regular(const Tick& t) noexcept {
        const double sine = min(abs(sin_cos(t.now.theta[1]).sin), abs(sin_cos(t.now.theta[5]).sin));
        const double share = min(sine / tracker_tuning::irregular, 1.0);
        return share * share;
    }

    /// The psi nearest to `wish`: in the part `clear` of the arc that contains `held`, else in that arc, else
    /// in any.
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
        const Twist hand = heading();
        if (turning_to_ >= 0 || size(hand, options_.length) * tracker_tuning::preview < tolerance::angle)
            return psi;
        const Pose<double> there = moved_by(wanted_, hand * tracker_tuning::preview);
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
            least -= tracker_tuning::worth;
            const double here = detail::distance(arm_, q_.q, wanted, options_.length, rest);
            if (here < least) {
                least = here;
                from = q_;
            }
        }
        const SelfMotion<double> m = self_motion(arm_, circle(arm_, flange_pose(arm_, goal.pose)), t.gc);
        for (int i = 0; i < tracker_tuning::starts; ++i) {
            const SinCos<double> at = sin_cos(two_pi / tracker_tuning::starts * i);
            Joints one = joints_within_limits(arm_, directions(m, at), q_.q);
            for (int j = 0; j < joints; ++j) one.q[j] = min(max(one.q[j], limits.lower[j]), limits.upper[j]);
            const double off = detail::distance(arm_, one.q, wanted, options_.length, rest);
            if (!(off < least)) continue;
            least = off;
            from = one;
        }
        const Relaxed found = relaxed(arm_, limits, from, wanted, options_.length, tracker_tuning::rounds);
        const double here = detail::distance(arm_, q_.q, wanted, options_.length, rest),
                     way = farthest_move(found.at);
        const bool pays = way <= tracker_tuning::near || here - found.distance > tracker_tuning::pays * way;
        relaxed_ = pays ? found.at : q_;
        relaxing_ = true;
        goal.at = relaxed_;
        const Chain there = chain(arm_, relaxed_.q);
        goal.pose = user_pose(arm_, there.flange);
        goal.psi = arm_angle(triad(arm_, there.flange), there.z3);
        goal.gc = index(configuration(arm_, there.theta));
        goal.posture_only = true;
    }

    // -- the move

    /// Finds a solution of the goal's pose within the bounds; false if there is none.
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

    /// Finds the joints on one self-motion within the bounds whose psi is nearest to `wish`; false if there
    /// are none.
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

    /// The psi of the next cycle on the way to `wish`, such that it can come to rest there.
    double turned(const Tick& t, const SelfMotion<double>& m, const JointFunctions<double>& f,
                  double wish) const noexcept {
        const double held = psi_carried(arm_, m, f, t.now.z3, q_.q, options_.velocity),
                     way = wrap(wish - held);
        const Joints slope = rate(arm_, f, sin_cos(held));
        double most = infinity, hardest = infinity, jerk = infinity;
        for (int j = 0; j < joints; ++j) {
            most = min(most, 0.5 * options_.velocity[j] / abs(slope.q[j]));
            hardest = min(hardest, tracker_tuning::turning * options_.acceleration[j] / abs(slope.q[j]));
            jerk = min(jerk, tracker_tuning::turning * options_.jerk[j] / abs(slope.q[j]));
        }
        double speed = min(most, sqrt(2.0 * hardest * abs(way)));
        if (jerk < infinity) speed = min(speed, std::cbrt(jerk * way * way));
        if (t.elbow || is_nearly_singular(t.now))
            speed = min(speed, speed_near_singular(arm_, m, f, t.now, held, way, q_.q, v_, options_.velocity,
                                                   options_.acceleration, tracker_tuning::turning));
        return held + copysign(min(abs(way) / tracker_tuning::ticks, speed * t.dt), way);
    }

    /// Whether the bounds permit these joints next. Violations by rounding alone are corrected in `next`.
    bool taken(const Tick& t, const double* wanted, Joints& next) const noexcept {
        for (int j = 0; j < joints; ++j) {
            const double move = wanted[j] - q_.q[j], least = t.lower[j] * t.dt, most = t.upper[j] * t.dt;
            if (!(move >= least - tracker_tuning::outside && move <= most + tracker_tuning::outside))
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

    /// Moves towards the goal as far as the bounds allow: first the end effector, then the configuration.
    void approach(const Tick& t, const Goal& goal, Joints& next) noexcept {
        const Pose<double> here = user_pose(arm_, t.now.flange);
        const Twist lead = goal_velocity(t, goal), rest = difference(here, goal.pose) - lead * t.dt;
        const double late = min(size(rest, options_.length) / tracker_tuning::late, 1.0);
        const double damping = tracker_tuning::regular + late * tracker_tuning::damping;
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
            const JointQuadratic alone = equations(move, tracker_tuning::aside * length);
            double d[joints];
            Unbounded(alone).minimise(alone.g, d);
            return pace(d, gain, share, t.dt);
        };
        // A target at rest is reached soonest if all joints arrive together. A moving one stays nearer if
        // position does not wait for the joints that rotate the tool.
        const Pace turning = pace_of(fixed_ ? rest : Twist{{}, rest.angular}, tracker_tuning::braking),
                   moving = fixed_ ? turning : pace_of_position({rest.linear, {}}, tracker_tuning::direct);
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

    /// Minimizes a quadratic cost of the velocities in the box, with collision-free braking if there are
    /// obstacles.
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
    /// its pose, by a collision-free way. For an oscillating target, only an end effector far from its goal
    /// (`off`, m) counts. If all attempts for a resting target fail, the arm stops.
    void watch(const Tick& t, const Goal& goal, double off) noexcept {
        if (fixed_ && !t.guard) return;  // see the choice for a target at rest
        const bool counts = fixed_ || off > tracker_tuning::worth, still = has_stalled(t);
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
            given_up_ = fixed_ && idle_ >= tracker_tuning::patience;
        } else if (t.guard) {
            search(t, goal);
        } else {
            if (tried_ == 0) tried_for_ = hand_.pose();
            tried_ += tracker_tuning::most_ways / tracker_tuning::turns;
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
        const bool fast = size(speed_, options_.length) > tracker_tuning::slow;
        if (off < (1.0 - tracker_tuning::progress) * nearest_ || (fast && !fixed_)) {
            nearest_ = off;
            waited_ = 0;
        }
        return waited_ >= tracker_tuning::patience;
    }

    /// Whether all detours have been tried for a resting target, or none is permitted.
    bool detours_exhausted() const noexcept {
        return tried_ >= tracker_tuning::most_ways || !(options_.detours || asked_);
    }

    /// Tries some ways to solutions of the goal's pose: straight, or through a random configuration.
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
        for (int k = 0; k < tracker_tuning::ways; ++k) {
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

    /// A pseudo-random number in [0, 1) and, below, a random arm angle of some arcs.
    double drawn() noexcept {
        draw_ = draw_ * 1664525u + 1013904223u;
        return (draw_ >> 8) * 0x1p-24;
    }
    /// A random value that is uniformly distributed in the arcs.
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

    /// Ends the joint motion to another configuration.
    void rest() noexcept {
        turning_to_ = -1;
        asked_ = false;
        waypoint_count_ = 0;
        searching_ = false;
    }

    /// Whether no joint has moved noticeably for the time of a stall.
    bool has_stalled(const Tick& t) noexcept {
        constexpr double lasting = tracker_tuning::stall;
        for (int j = 0; j < joints; ++j) {
            const double possible = 0.25 * min(min(options_.velocity[j], lasting * options_.acceleration[j]),
                                               0.5 * lasting * lasting * options_.jerk[j]);  // from rest
            const double slowest = min(tracker_tuning::standing, possible);
            if (abs(q_.q[j] - stalled_at_.q[j]) <= slowest * lasting) continue;
            stalled_at_ = q_;
            stalled_for_ = 0;
            searching_ = false;
            return false;
        }
        stalled_for_ += t.dt;
        return stalled_for_ >= tracker_tuning::stall;
    }

    /// Records that the end effector is at its goal and the target at rest, so that moving away counts as no
    /// progress.
    void meet() noexcept { nearest_ = stalled_for_ = 0; }

    /// Whether the end effector has been at its goal for a while, which is not the target, without coming
    /// nearer to the target.
    bool makes_no_progress(const Goal& goal) const noexcept {
        const bool calm = margin_ - options_.still_margin < tracker_tuning::calm;
        const bool is_hand = size(difference(goal.pose, wanted_), options_.length) <= tracker_tuning::exact;
        return calm && !is_hand && closest_ > tracker_tuning::exact && idle_ >= tracker_tuning::patience;
    }

    /// Resets the stall detection.
    void forget() noexcept {
        stalled_for_ = 0;
        waited_ = 0;
        nearest_ = infinity;
    }

    /// Moves in a straight joint motion to a configuration of the goal, chosen in the first cycle, or along
    /// the way that was found. The path of the end effector is free.
    void turn(const Tick& t, const Goal& goal, Joints& next) noexcept {
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
        if (longest < tracker_tuning::turned) {
            if (waypoint_count_ > 1) {
                --waypoint_count_;
            } else if (!fixed_) {
                rest();
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
            if (t.guard) tried_ += tracker_tuning::most_ways / (asked_ ? 1 : tracker_tuning::turns);
            tried_for_ = hand_.pose();
            rest();
            forget();
        }
        go(t, v, next);
    }

    /// Comes to rest, because all attempts for a resting target failed.
    void stand(const Tick& t, Joints& next) noexcept {
        double v[joints];
        const double none[joints] = {};
        for (int j = 0; j < joints; ++j) v[j] = min(max(0.0, t.lower[j]), t.upper[j]);
        ease(t, none, v);
        if (t.guard) t.guard->restrain(v);
        go(t, v, next);
    }

    /// Computes the joints after one cycle at velocities v.
    void go(const Tick& t, const double (&v)[joints], Joints& next) const noexcept {
        for (int j = 0; j < joints; ++j) next.q[j] = q_.q[j] + v[j] * t.dt;
        next.q[joints] = 0;
    }

    /// The velocity of the goal; 0 if it has jumped.
    Twist goal_velocity(const Tick& t, const Goal& goal) const noexcept {
        if (goal.why == Status::OK) return speed_;
        const Twist speed = difference(goal_pose_, goal.pose) * (1.0 / t.dt);
        const bool leapt = !(size(speed, options_.length) < tracker_tuning::leap);
        return leapt ? Twist{} : speed;
    }

    // -- the result

    /// Sets velocity and acceleration of joint j. With bounded jerk it keeps the requested velocity: the
    /// rounding of a position, divided by dt^2, could make a stop impossible.
    void go_on(const Tick& t, int j, double v) noexcept {
        const double wanted = min(max(v, t.lower[j]), t.upper[j]);
        if (bound_[j].has_jerk() && abs(wanted - v) * t.dt <= tracker_tuning::rounding) v = wanted;
        a_[j] = (v - v_[j]) / t.dt;
        v_[j] = v;
    }

    /// Takes the joints of the next cycle and returns what is reported of it.
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
            fastest |= abs(v_[j]) >= options_.velocity[j] * (1.0 - tracker_tuning::exact);
        }
        const double bend = detail::elbow_bend(arm_, q_.q[3]);
        if (abs(bend) > tracker_tuning::level) side_ = bend < 0 ? -1.0 : 1.0;
        if (bent() >= options_.still_margin) least_bend_ = options_.still_margin;
        const Chain now = chain(arm_, q_.q);
        const Pose<double> tool = user_pose(arm_, now.flange);
        out.distance = size(difference(tool, wanted_), options_.length);
        out.gap = goal.gap;
        const Triad<double> on = triad(arm_, flange_pose(arm_, tool));
        out.psi = arm_angle(on, now.z3);
        out.gc = index(configuration(arm_, now.theta));
        out.status = out.distance <= tracker_tuning::exact ? Tracking::FOLLOWING : Tracking::LAGGING;
        out.why = out.status == Tracking::FOLLOWING ? Status::OK : goal.why;
        if (out.status == Tracking::LAGGING && goal.why != Status::OK) out.status = Tracking::NEAREST;
        if (out.status == Tracking::LAGGING)
            out.why = fastest ? Status::VELOCITY_LIMIT : Status::ACCELERATION_LIMIT;
        const Tag met = t.guard ? t.guard->blocking() : 0;
        if (out.status == Tracking::LAGGING && met) out.why = Status::CLEARANCE;
        const bool waits = met && waited_ >= tracker_tuning::patience;  // a way may still be found
        const bool ended =
            given_up_ || waits || (detours_exhausted() && stalled_for_ >= tracker_tuning::stall);
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

    Arm arm_;
    Body body_;
    const Scene* about_;  // prepared for the body
    TrackerOptions options_;
    Hand hand_;
    Pose<double> wanted_ = identity_pose();  // the target relative to this arm
    Twist speed_, acceleration_;             // of the target
    LimitTable plain_, clear_;
    Joints q_{}, relaxed_{};
    JerkBounds bound_[joints] = {};
    bool has_jerk_ = false;  // any joint
    double v_[joints] = {};
    double a_[joints] = {};       // rad/s^2
    double stopping_rate_ = 1;    // 1/s: at which all joints can stop collision-free
    Vec3<double> wrist_speed_{};  // m/s: velocity of the target's wrist, averaged
    double margin_ = 0;           // rad from straight that joint 4 keeps at the target's speed
    double side_ = 1;             // of the stretched arm, on which joint 4 is kept
    double least_bend_ = 0;       // rad from straight that joint 4 must keep
    double ahead_ = 0;            // the same, in time for the target
    Crossing crossing_;
    int turning_to_ = -1;  // branch approached in joint space; -1: none
    bool asked_ = false;   // by the operator
    RestingChoice choice_;
    Joints goal_at_{};                       // configuration of the last goal ...
    double goal_gap_ = 0;                    // its gap (m)
    int goal_why_ = 0;                       // ... and why it is not the target
    Joints stalled_at_{};                    // where the arm stands, or last stood
    double stalled_for_ = 0;                 // s for which it has, away from its goal
    double nearest_ = 0;                     // m: smallest distance to its goal ...
    double waited_ = 0;                      // ... and s since
    Towards hinted_{};                       // elbow's target in the previous cycle ...
    Pose<double> before_ = identity_pose();  // ... and the target
    bool fixed_ = false;                     // target and elbow's target at rest; for such a target:
    bool arrived_ = false;                   // the last cycle was at its goal
    bool given_up_ = false;
    double closest_ = infinity, idle_ = 0;  // m: smallest distance to it, and s since
    bool relaxing_ = false;
    bool searching_ = false;                        // for a way around an obstacle
    int tried_ = 0;                                 // detours tried since the target moved ...
    Pose<double> tried_for_ = identity_pose();      // ... from here
    int waypoint_count_ = 0;                        // remaining legs of the way that was found
    Joints waypoint_[2]{};                          // the last leg first
    Pose<double> detour_target_ = identity_pose();  // the target for which it was found, unfiltered
    Tag barred_ = 0;                                // the pair that blocks the straight way
    std::uint32_t draw_ = 1;
    bool escaping_ = false;  // the arm started in collision
    Scene kept_{}, soft_{};  // the scene with the required clearances, and with the soft ones
    Pose<double> goal_pose_ = identity_pose();
};

}  // namespace armangle

#include "../names/end.hpp"
