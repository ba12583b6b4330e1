// The loop for hands, joysticks, cameras and policies: every tick a posture, whatever the command.
//
//   command -> hand (filter) -> goal: exact arcs, else the reach clamp and its arcs, else the least
//   relaxation
//                            -> move: exact inside the box of moves that the bounds allow, else least squares
//
// The bounds are kept by the joints alone: |v| <= velocity, |v - v_before| <= acceleration dt, and after
// every tick v^2 / (2 acceleration) <= the room to each limit, so that braking is possible whatever the next
// ticks last: braking by dt' covers (v - a dt') dt' and leaves (v - a dt')^2 / 2a <= v^2 / 2a - that.
//
// The branch is read off the joints: the arm passes through theta_2 = 0 and theta_6 = 0, where two branches
// meet. Joint 4 stays on its side of the stretched arm.
#pragma once

#include <optional>
#include <type_traits>

#include "../limits/settled.hpp"
#include "../scene/clear.hpp"
#include "elbow_choice.hpp"
#include "guard.hpp"
#include "hand_filter.hpp"
#include "jerk.hpp"
#include "leaving.hpp"
#include "saved.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What a tick did.
enum class Tracking : std::uint8_t {
    FOLLOWING,  // the tool is where the hand is
    LAGGING,    // on its way, as fast as the bounds allow
    NEAREST,    // the hand is out of reach: at, or on the way to, the nearest pose
    HELD,       // no sample to believe: on as predicted
    TURNING,    // on its way to another posture, joint by joint: the tool leaves the hand
    RETURNING,  // a joint stands outside its limits, or a link touches, where the arm began: on its way out
};

/// The bounds of a tracker, and what it keeps clear of.
struct TrackerOptions {
    double dt = 0.004;            // s
    double velocity[joints];      // rad/s; infinite: no bound
    double acceleration[joints];  // rad/s^2; infinite: no bound
    double jerk[joints] = {infinity, infinity, infinity, infinity,
                           infinity, infinity, infinity};  // rad/s^3; infinite: no bound
    double length = 0.2;                                   // m that a radian counts as
    double still_margin = 0.05;                            // rad off straight that joint 4 keeps at rest
    double elbow_margin = 0.35;       // rad off straight that it keeps while the hand is fast
    double singularity_margin = 0.0;  // rad off theta_2, theta_6 = 0 where arcs allow it
    double soft_clearance = 0.02;     // m more than the scene's that the elbow keeps where arcs allow it
    bool detours = true;              // whether the tool may leave the hand unasked, to find another way
    const Scene* scene = nullptr;     // obstacles that links keep clear of; lives as long as the tracker
    HandFilter hand;
};

/// What a tick is given. A pose that is none, or a null, holds the hand as predicted.
struct Command {
    const Pose<double>* pose = nullptr;
    const Towards* elbow = nullptr;      // where the elbow is wanted: a point or a direction; null: no matter
    double dt = 0;                       // s of this tick; 0: that of the options
    int reconfigure = -1;                // 0..7: go to this branch, through what lies between
    const Pose<double>* seen = nullptr;  // moves the hand to where this arm sees it; null: it stays
    Vec3<double> drift{};                // m/s: of that place while the hand stays
};

/// What a tick returns: the next joints, and how far they leave the hand.
struct Tracked {
    double q[joint_slots];
    double velocity[joints];  // rad/s, (q - q before) / dt
    Tracking status;
    double distance;  // m, of the tool from the hand: sqrt(|dp|^2 + (length angle)^2)
    double gap;       // m by which the hand's wrist is outside what joint 4 reaches
    double psi;       // in (-pi, pi]
    int gc;
    Status why;  // what keeps the tool from the hand
    Tag pair;    // where that is an obstacle: it and the link; 0: none
};

namespace track_rule {
inline constexpr double exact = 1e-9;       // m: a tool this near is there
inline constexpr double rounding = 2e-15;   // rad: what a sum of joint values may round away
inline constexpr double outside = 1e-9;     // rad: joints this far out of the box were rounded there
inline constexpr double soft = 0.05;        // rad kept off limits where arcs allow it
inline constexpr double braking = 0.6;      // share of the acceleration that an approach is planned with
inline constexpr double direct = 1.0;       // the same where the tool's position alone comes nearer
inline constexpr double assured = 0.2;      // share that is left, however hard the hand brakes
inline constexpr double aside = 0.1;        // of `length`: what a radian counts as beside position alone
inline constexpr double turning = 0.3;      // the same of psi
inline constexpr double ticks = 3.0;        // an approach ends no faster than geometrically over so many
inline constexpr double regular = 1e-4;     // of H, m^2/rad^2
inline constexpr double damping = 2e-3;     // the same in addition, of a tool that is late
inline constexpr double late = 0.0015;      // m from the hand at which all of it is added
inline constexpr double preview = 0.15;     // s ahead for which psi is chosen
inline constexpr double fast = 0.1;         // m/s of the wrist at which the elbow's margin is full
inline constexpr double trembling = 0.05;   // s over which its velocity is averaged for that
inline constexpr double growing = 0.1;      // s over which that margin grows
inline constexpr double shrinking = 2.0;    // s over which it shrinks
inline constexpr double beyond = 1e-6;      // rad out of limits at which a posture is none
inline constexpr double seam = 2e-6;        // rad between limits a whole turn apart
inline constexpr double negligible = 1e-4;  // rad of that margin
inline constexpr double crossing = 0.3;     // rad of theta_2, theta_6 within which both branches are weighed
inline constexpr double leap = 3.0;         // m/s: a goal that moves faster has jumped
inline constexpr double standing = 0.02;    // rad/s: joints slower than this, for a stall, stand
inline constexpr double stall = 0.3;        // s of standing away from a goal after which the arm turns to it
inline constexpr double lively = 0.02;      // m: a hand that has moved farther makes a new case
inline constexpr double slow = 0.1;         // m/s: a hand slower than this is waited for with ways round ...
inline constexpr double patience = 1.0;     // s without coming nearer to it by ...
inline constexpr double progress = 0.1;     // ... this share, which are a stall beside obstacles
inline constexpr double turned = 0.05;      // rad from the goal's posture at which turning is over
inline constexpr double irregular = 0.7;    // sine of theta_2, theta_6 below which psi is turned less ...
inline constexpr double shut = 0.05;        // ... and joints go on by the least way, ...
inline constexpr double roomy = 0.15;       // ... rad off limits
inline constexpr double remote = 1.0;       // rad: a posture from which a joint is farther is not beside it
inline constexpr double near = 0.1;    // rad within which a posture that is nearer to the hand is gone to ...
inline constexpr double pays = 1e-3;   // ... and m that it has to be nearer for each rad, where it is not
inline constexpr double level = 0.01;  // rad off straight within which joint 4 has no side of its own ...
inline constexpr double scant = 0.6;   // ... at a start, where limits leave it less than that
inline constexpr double worth = 0.005;  // m that another start of the relaxation must gain
inline constexpr double strayed = 0.1;  // m: a hand this far from where it was makes a way to it void
inline constexpr double gain = 1e-4;    // m nearer to a hand at rest, for which more time is given
inline constexpr double calm = 1e-3;    // rad of the elbow's margin above that at rest, which is none
inline constexpr double led = 0.02;     // rad nearer to a hint for which an arm leaves theta_2, theta_6 = 0
inline constexpr int turns = 8;         // to postures that are tried for a hand
inline constexpr int ways = 2, most_ways = 600;  // round an obstacle that are tried in a tick, and in all
inline constexpr int rounds = 6, starts = 16;    // of the relaxation in one tick
}  // namespace track_rule

/// Joints that follow a hand tick by tick within bounds on speed and acceleration;
/// docs/theory/motion/tracker.md. A `Body` is what keeps clear of obstacles, the arm itself or the true chain
/// that it stands for, and `about` the scene that is made ready for it; the options' scene is the arm's own,
/// and says where to go.
template <class Body = Arm>
class Tracker {
public:
    Tracker(const Arm& arm, const TrackerOptions& options) noexcept
        requires std::is_same_v<Body, Arm>
        : Tracker(arm, options, arm, options.scene) {}
    Tracker(const Arm& arm, const TrackerOptions& options, const Body& body, const Scene* about) noexcept
        : arm_(arm), body_(body), about_(about), options_(options), hand_(options.hand) {
        for (int j = 0; j < joints; ++j) {
            bound_[j] = jerk_bounds(options.velocity[j], options.acceleration[j], options.jerk[j]);
            has_jerk_ |= bound_[j].has_jerk();
        }
        Limits soft = arm.limits;
        for (int j = 0; j < joints; ++j) {
            const double room = min(track_rule::soft, 0.1 * (soft.upper[j] - soft.lower[j]));
            soft.lower[j] += room;
            soft.upper[j] -= room;
        }
        plain_ = limit_table(arm, parted(arm.limits));
        clear_ = limit_table(arm, soft, options.singularity_margin);
        if (options.scene) {
            kept_ = soft_ = *options.scene;
            kept_.clearance += guard_rule::standoff;
            soft_.clearance += max(options.soft_clearance, guard_rule::standoff);
        }
        double middle[joint_slots];
        for (int j = 0; j < joint_slots; ++j) middle[j] = arm.joint_middle[j];
        start(middle);
    }

    /// At rest at q; joints outside their limits are led into them, within the bounds.
    void start(const double* q) noexcept { start(q, user_pose(arm_, chain(arm_, q).flange)); }

    /// The same with the hand elsewhere than the tool.
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
        stood_ = q_;
        forget();
        tried_ = 0;
        barred_ = 0;
        draw_ = 1;
        arrived_ = given_up_ = false;
        home_ = index(branch(chain(arm_, q_.q)));
        astray_ = 0;
        rest();
        escaping_ = options_.scene && nearest_pair(0.0).room < 0;
        goal_pose_ = user_pose(arm_, chain(arm_, q_.q).flange);
        hand_.start(hand);
        before_ = hand;
        hinted_ = {};
    }

    const double* q() const noexcept { return q_.q; }
    const Arm& arm() const noexcept { return arm_; }

    /// What a tick leaves to the next (saved.hpp).
    template <class Visit>
    void each_number(Visit& visit) {
        hand_.each_number(visit);
        visit.all(q_, relaxed_, v_, a_, stopping_rate_, wrist_speed_, margin_, side_, least_bend_, ahead_,
                  asked_, astray_, stood_, stood_for_, nearest_, waited_, hinted_, before_, fixed_, arrived_,
                  given_up_, closest_, idle_, relaxing_, searching_, tried_, tried_for_, leg_, sought_,
                  barred_, draw_, escaping_, goal_pose_);
        visit.within(turning_to_, -1, configurations - 1);
        visit.within(home_, 0, configurations - 1);
        visit.within(legs_, 0, 2);
    }
    /// The nearest pair of the present posture, of those nearer than `reach` (m) more than the clearance;
    /// where room is left to rounding: joints from the end of an arc may touch by that.
    NearestPair nearest_pair(double reach) const noexcept {
        NearestPair out = StraightMove(body_, *about_).nearest_pair(q_.q, reach);
        out.room += straight_rule::rounded;
        return out;
    }
    /// Among other obstacles than when it was saved: the next tick takes the hand for one that has moved, so
    /// that an arm at rest gives way. A way that was found is gone on with, as ticks are proven themselves.
    void look_again() noexcept {
        tried_ = 0;
        barred_ = 0;
        hinted_.target.x = infinity;
        escaping_ = options_.scene && nearest_pair(0.0).room < 0;
    }
    /// The hand as it is believed, in the frame that poses are given in.
    const Pose<double>& hand() const noexcept { return hand_.pose(); }

    Tracked step(const Command& command) noexcept {
        const Tracked out = tick(command);
        note(out.distance, command.dt);
        return out;
    }

    /// The same without a note of how far the tool is from the hand, which note() then takes, as it is true
    /// of another tool.
    Tracked tick(const Command& command) noexcept {
        const bool valid =
            command.pose && is_rigid(*command.pose) && norm(command.pose->position) <= tolerance::length;
        Tick t{seconds(command.dt), chain(arm_, q_.q)};
        const bool misled = command.elbow && !says_something(*command.elbow);
        t.elbow = misled ? nullptr : command.elbow;
        t.gc = branch(t.now);
        hand_.tick(valid ? command.pose : nullptr, t.dt);
        see(command);
        t.there =
            size(difference(user_pose(arm_, t.now.flange), wanted_), options_.length) <= track_rule::exact;
        t.rests = t.there && is_singular(t.now);
        if (command.reconfigure >= 0 && command.reconfigure < configurations &&
            command.reconfigure != index(t.gc)) {
            rest();
            forget();
            turning_to_ = home_ = command.reconfigure;
            asked_ = true;
            given_up_ = false;
        }
        const bool refused = asked_ && !worth_a_turn(t);
        if (refused) stay(t);
        std::optional<Guard<Body>> guard;
        box(t);
        if (options_.scene) {
            guard.emplace(body_, *about_, options_.acceleration, has_jerk_ ? bound_ : nullptr);
            guard->begin(q_.q, v_, a_, t.dt, t.limits, stopping_rate_);
            t.guard = &*guard;
        }
        Goal goal;
        Joints next;
        heed_hand(t);
        const bool there = seek(t, goal, next);
        arrived_ = there && !given_up_;
        if (goes_home(t, goal)) {
            turn(t, goal, next);
        } else if (given_up_) {
            stand(t, next);
        } else if (there) {
            fixed_ ? meet() : forget();
            rest();
            given_up_ = fixed_ && creeps(goal);
        } else if (turning_to_ >= 0) {
            turn(t, goal, next);
        } else {
            approach(t, goal, next);
        }
        goal_pose_ = goal.pose;
        if (t.guard) stopping_rate_ = t.guard->rate();
        Tracked out = finish(t, goal, next, valid, misled);
        if (turning_to_ < 0 && goal.why == Status::OK && out.distance <= track_rule::worth)
            home_ = index(branch(chain(arm_, q_.q)));
        if (refused && out.why != Status::BAD_INPUT) out.why = Status::LIMITS;
        return out;
    }

    void note(double distance, double dt) noexcept {
        if (!fixed_) return;
        if (turning_to_ < 0) idle_ += seconds(dt);
        const bool met = distance <= track_rule::exact && closest_ > 0;
        if (!met && !(distance < closest_ - track_rule::gain)) return;
        closest_ = met ? 0.0 : distance;
        idle_ = 0;
    }

private:
    struct Tick {
        double dt;
        Chain now;
        Configuration<double> gc{};
        Limits limits{};                                // joint 4 on its side of the stretched arm
        double lower[joints] = {}, upper[joints] = {};  // rad/s: what the next velocity may be
        Guard<Body>* guard = nullptr;                   // where there are obstacles
        const Towards* elbow = nullptr;
        bool there = false;  // the tool is at the hand ...
        bool rests = false;  // ... and theta_2 or theta_6 is 0
    };

    /// Where to go: a pose that the arm can take, and a posture of it.
    struct Goal {
        Pose<double> pose;
        Joints at;
        double psi = 0, gap = 0;
        Status why = Status::OK;
        bool settled = false;         // it is beside the present one
        bool posture_only = false;    // the pose may have no arc: only this posture
        int gc = 0;                   // of that posture
        Status blocked = Status::OK;  // or why obstacles leave no posture of the pose
        Tag pair = 0;                 // the one that blocks all of them alone; 0: none does
    };

    /// Of a tick: as told, or that of the options.
    double seconds(double dt) const noexcept { return dt > 0 && dt < infinity ? dt : options_.dt; }

    /// Whether a hint says something: a point, or a direction that has a length.
    static bool says_something(const Towards& hint) noexcept {
        const double size = norm(hint.target);
        return size < infinity && (hint.wish == Wish::point || size > 0);
    }

    /// Takes the hand, moved by `seen` where that is given.
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

    /// A hand that has moved makes a new case: what was tried for another one does not count.
    void heed_hand(const Tick& t) noexcept {
        const Towards hint = t.elbow ? *t.elbow : Towards{};
        const double speed = size(hand_.velocity(), options_.length);
        fixed_ = max(speed, gone_from(before_)) <= track_rule::exact &&
                 norm(hint.target - hinted_.target) == 0 && hint.wish == hinted_.wish;
        hinted_ = hint;
        before_ = hand_.pose();
        given_up_ = given_up_ && fixed_;
        if (!fixed_) {
            closest_ = infinity;
            idle_ = 0;
        }
        if (tried_ > 0 && gone_from(tried_for_) > track_rule::lively) tried_ = 0;
        if (legs_ == 0 || !(gone_from(sought_) > track_rule::strayed)) return;
        if (asked_) {
            legs_ = 0;
        } else {
            rest();
        }
    }

    double gone_from(const Pose<double>& hand) const noexcept {
        return size(difference(hand, hand_.pose()), options_.length);
    }

    /// Limits a whole turn apart leave every angle, but no way from one to the other: they are drawn in, so
    /// that an arc ends there.
    static Limits parted(Limits limits) noexcept {
        for (int j = 0; j < joints; ++j) {
            const double over = limits.upper[j] - limits.lower[j] - two_pi + track_rule::seam;
            if (!(over > 0 && over <= 2.0 * track_rule::seam)) continue;
            limits.lower[j] += 0.5 * over;
            limits.upper[j] -= 0.5 * over;
        }
        return limits;
    }

    /// How fast the hand goes on: one that does not move leads nowhere, wherever the joints seem to lead it.
    Twist heading() const noexcept { return fixed_ ? Twist{} : speed_; }

    /// How far the joint that has to move farthest is from a posture, rad.
    double farthest_move(const Joints& to) const noexcept {
        double farthest = 0;
        for (int j = 0; j < joints; ++j) farthest = max(farthest, abs(to.q[j] - q_.q[j]));
        return farthest;
    }

    // -- bounds

    /// rad off straight, on the side that joint 4 is kept on.
    double bent() const noexcept { return side_ * detail::elbow_bend(arm_, q_.q[3]); }

    /// The side of the stretched arm (+1, -1) that joint 4 stands on; where it is about straight, and has
    /// little room there, the other one.
    double side_to_keep() const noexcept {
        const double bend = detail::elbow_bend(arm_, q_.q[3]), own = bend < 0 ? -1.0 : 1.0;
        const double straight = q_.q[3] - arm_.sign[3] * bend;
        const double above = arm_.limits.upper[3] - straight, below = straight - arm_.limits.lower[3];
        const bool up = arm_.sign[3] * own > 0;
        const double room = up ? above : below, other = up ? below : above;
        return abs(bend) <= track_rule::level && room < track_rule::scant && room < other ? -own : own;
    }

    /// rad off straight that joint 4 has to keep from here on, where its limits leave its margin: a start may
    /// be nearer.
    double bend_to_keep() const noexcept {
        Limits limits = arm_.limits;
        const bool has_margin = keep_on_side(arm_, 3, q_.q[3], side_, options_.still_margin, limits);
        return has_margin ? min(max(bent(), 0.0), options_.still_margin) : options_.still_margin;
    }

    /// The branch of a posture; about the stretched arm that of the side which joint 4 is kept on.
    Configuration<double> branch(const Chain& now) const noexcept {
        Configuration<double> out = configuration(arm_, now.theta);
        out.elbow = side_;
        return out;
    }

    /// The limits with joint 4 on a side of the stretched arm, where they leave that.
    Limits kept_on(double side, double margin) const noexcept {
        Limits out = arm_.limits;
        keep_on_side(arm_, 3, q_.q[3], side, margin, out);
        return out;
    }

    /// The velocities that keep the bounds and from which every joint can still brake. A joint outside its
    /// limits has to go in, as fast as one that came to rest there.
    void box(Tick& t) const noexcept {
        const Limits& limits = t.limits = elbow_turns(t) ? arm_.limits : kept_on(side_, least_bend_);
        for (int j = 0; j < joints; ++j) {
            if (bound_[j].has_jerk()) {
                box_of_jerk(t, j);
                continue;
            }
            const double a = options_.acceleration[j], most = options_.velocity[j];
            const double change = max(a * t.dt - track_rule::rounding / t.dt, 0.0);
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

    /// The same of a joint whose jerk is bounded. One that cannot stop within a limit, which it then was
    /// never within, stops as soon as it can.
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
            const double way = max(room - track_rule::rounding, detail::stopping(b, v, a).way);
            return fastest_stopping(b, v, way, dt, lower, upper);
        };
        const auto fastest_down = [&](double room) {
            const double way = max(room - track_rule::rounding, detail::stopping(b, -v, -a).way);
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

    /// A velocity that each joint goes on to `wish` with, `ahead` (rad/s^2) being how that goes on to change:
    /// a joint whose jerk is bounded does not overshoot it.
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

    /// The largest v with v dt + v^2 / 2a <= room.
    static double fastest(double room, double a, double dt) noexcept {
        if (!(room > 0)) return 0.0;
        if (!(room < infinity)) return infinity;
        return 2.0 * room / (dt + sqrt(dt * dt + 2.0 * room / a));
    }

    /// The factor k, in 1/s, of an approach k d over moves d with which every joint can stop there, and how
    /// k |d| falls with |d|: as this power of it.
    struct Pace {
        double k, power;

        void at_most(double other, double its_power) noexcept {
            if (!(other < k)) return;
            k = other;
            power = its_power;
        }
    };

    Pace pace(const double (&d)[joints], double dt) const noexcept {
        Pace out{1.0 / (track_rule::ticks * dt), 1.0};
        for (int j = 0; j < joints; ++j) {
            const double way = abs(d[j]);
            if (!(way > 0)) continue;
            brake(out, j, way, track_rule::braking * options_.acceleration[j]);
            out.at_most(options_.velocity[j] / way, 0.0);
        }
        return out;
    }

    /// The same for the moves of a part of the tool's way, whose speeds the box bounds: a joint that reaches
    /// its greatest speed before it has to brake is in nobody's way. It brakes against a goal that itself
    /// speeds up by `gain`, rad/s^2: one that runs away leaves more to brake with, one that slows down less.
    Pace pace(const double (&d)[joints], const double (&gain)[joints], double share,
              double dt) const noexcept {
        Pace out{1.0 / (track_rule::ticks * dt), 1.0};
        for (int j = 0; j < joints; ++j) {
            const double way = abs(d[j]), a = options_.acceleration[j], v = options_.velocity[j];
            const double away = d[j] > 0 ? gain[j] : -gain[j];
            const double hard = min(max(share * a + away, track_rule::assured * a), a);
            if (way > 0 && 2.0 * hard * way < v * v) brake(out, j, way, hard);
        }
        return out;
    }

    /// A joint comes to rest over its way by `hard` (rad/s^2), and in the end with v^3 = j way^2, which takes
    /// a jerk of 2/9 j, and of j where k begins to be constant.
    void brake(Pace& out, int j, double way, double hard) const noexcept {
        out.at_most(sqrt(2.0 * hard / way), 0.5);
        if (bound_[j].has_jerk())
            out.at_most(std::cbrt(track_rule::braking * bound_[j].jerk / way), 2.0 / 3.0);
    }

    // -- the goal

    /// The goal, and the joints of the next tick if they can be there. While the elbow keeps up with the hand
    /// it is followed right up to the reach; else the elbow keeps its margin.
    bool seek(const Tick& t, Goal& goal, Joints& next) noexcept {
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
        goal.settled = posture && is_beside(t) && goal.blocked == Status::OK && settle(t, goal);
        if (posture && !is_beside_hand(t, c, goal))
            relaxing_ = false;
        else
            relax(t, elbow_turns(t) ? one_side(elbow_side(t), margin) : t.limits, goal);
        if (!in_branch) return false;
        if (fixed_ && is_at_rest() && !t.elbow && stays_there(t, goal, next)) return true;
        return exact(t, goal, next) || (!(goal.gap > 0) && stays_there(t, goal, next));
    }

    /// Whether no joint moved in the tick before.
    bool is_at_rest() const noexcept {
        double fastest = 0;
        for (int j = 0; j < joints; ++j) fastest = max(fastest, abs(v_[j]));
        return !(fastest > 0);
    }

    /// Whether the tool is at the hand already, and the joints can stay: limits may end just here, and leave
    /// an arc of no width.
    bool stays_there(const Tick& t, Goal& goal, Joints& next) const noexcept {
        if (!t.there || goal.blocked != Status::OK || !taken(t, q_.q, next)) return false;
        goal = Goal{};
        goal.pose = wanted_;
        goal.at = q_;
        goal.gc = index(t.gc);
        goal.psi = arm_angle(triad(arm_, t.now.flange), t.now.z3);
        return true;
    }

    /// Whether the elbow's margin alone keeps the goal from the hand, and its posture is far, while one
    /// beside the joints is about as near to the hand: limits may leave joint 4 no way to its margin but that
    /// of a joint all round.
    bool is_beside_hand(const Tick& t, const Circle<double>& c, const Goal& goal) const noexcept {
        if (!(goal.gap > 0) || turning_to_ >= 0 || goal.blocked != Status::OK) return false;
        const ReachShell all = reach_shell(arm_, kept_on(side_, 0.0));
        if (max(c.distance - all.outer, all.inner - c.distance) > track_rule::worth) return false;
        if (farthest_move(goal.at) <= track_rule::remote) return false;
        const Relaxed beside = relaxed(arm_, t.limits, q_, wanted_, options_.length, track_rule::rounds);
        return beside.distance <= size(difference(goal.pose, wanted_), options_.length) + track_rule::worth;
    }

    /// Where theta_2 or theta_6 is 0, and the tool at the hand, psi says little of the joints beside that
    /// hinge: they stay as they are, or, where a hint leads on, turn until psi can leave. False where they
    /// move too fast.
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
        return size(difference(there, wanted_), options_.length) <= track_rule::exact &&
               taken(t, wanted.q, next);
    }

    /// The way on that comes nearest to the hint, if one comes nearer.
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
        return best.missed < missed - track_rule::led ? best : Leaving{};
    }

    /// Whether theta_2 or theta_6 is about 0, where joints turn by any angle while psi hardly does, and psi
    /// has nowhere to go.
    bool is_beside(const Tick& t) const noexcept {
        const double bend = min(abs(sin_cos(t.now.theta[1]).sin), abs(sin_cos(t.now.theta[5]).sin));
        return bend <= track_rule::shut && !t.elbow && turning_to_ < 0;
    }

    /// The posture of the goal's pose that the joints are nearest to, if it is found beside them and no joint
    /// is near a limit there.
    bool settle(const Tick& t, Goal& goal) const noexcept {
        Drawing near;
        for (int j = 0; j < joints; ++j) {
            near.weight[j] = 1.0;
            near.near[j] = q_.q[j];
        }
        int rounds = settled_rule::rounds;
        const double share = settled_rule::share * arm_.size * arm_.size;
        const Relaxed about = settled(arm_, t.limits, q_, goal.pose, near, share, rounds);
        const Relaxed found = settled(arm_, t.limits, about.at, goal.pose, near, 0.0, rounds);
        if (!meets(arm_, found) || limit_margin(arm_.limits, joint_lanes(found.at.q)) < track_rule::roomy)
            return false;
        const Chain there = chain(arm_, found.at.q);
        goal.at = found.at;
        goal.psi = arm_angle(triad(arm_, there.flange), there.z3);
        goal.gc = index(configuration(arm_, there.theta));
        return true;
    }

    /// The hand drawn into what joint 4 reaches with this margin, and a posture there; false where limits
    /// leave none.
    bool within(const Tick& t, const Circle<double>& c, double margin, Goal& goal) noexcept {
        const Pose<double>& wanted = wanted_;
        const Limits limits = one_side(elbow_side(t), margin);
        const Drawn drawn = drawn_in_reach(arm_, reach_shell(arm_, limits), wanted, t.now.flange);
        goal.pose = drawn.pose;
        goal.gap = drawn.gap;
        goal.why = drawn.gap > 0 ? reason(c) : Status::OK;
        return posture_of(t, goal);
    }

    /// Whether the branch that is turned to, or else the arm's own, has a posture for the hand, or for the
    /// nearest pose that joint 4 reaches.
    bool holds_hand(const Tick& t, Goal& goal) noexcept {
        if (!within(t, circle(arm_, flange_pose(arm_, wanted_)), options_.still_margin, goal)) return false;
        const double q_4 = goal.at.q[3];
        return q_4 >= arm_.limits.lower[3] - track_rule::outside &&
               q_4 <= arm_.limits.upper[3] + track_rule::outside;
    }

    /// Whether the branch asked for holds the hand, or at least as nearly as the arm's own does.
    bool worth_a_turn(const Tick& t) noexcept {
        Goal there, here;
        if (!holds_hand(t, there)) return false;
        if (!(there.gap > 0)) return true;
        const int to = turning_to_;
        turning_to_ = -1;
        const bool nearer = holds_hand(t, here) && here.gap < there.gap - track_rule::exact;
        turning_to_ = to;
        return !nearer;
    }

    /// The branch asked for cannot hold the hand: the arm stays in its own. One that was on its way there may
    /// be in none that can; it goes to the nearest that does.
    void stay(const Tick& t) noexcept {
        const bool underway = legs_ > 0;
        rest();
        forget();
        home_ = index(t.gc);
        Goal best;
        if (!underway) return;
        if (holds_hand(t, best)) {
            home_ = best.gc;
            return;
        }
        double least = infinity;
        for (int gc = 0; gc < configurations; ++gc) {
            Goal goal;
            turning_to_ = gc;
            if (!holds_hand(t, goal)) continue;
            double way = 0;
            for (int j = 0; j < joints; ++j) way += (goal.at.q[j] - q_.q[j]) * (goal.at.q[j] - q_.q[j]);
            if (!(way < least)) continue;
            least = way;
            best = goal;
        }
        turning_to_ = -1;
        if (!(least < infinity)) return;
        home_ = best.gc;
        turn_to(best.at, best.gc);
    }

    /// Turns back to the branch in which the tool was last on the hand, if it can hold it: the arm passed
    /// through to one that cannot, and the hand has been slow for some time.
    bool goes_home(const Tick& t, const Goal& goal) noexcept {
        const auto stays = [&] {
            return size(speed_, options_.length) <= track_rule::slow &&
                   size(difference(user_pose(arm_, t.now.flange), wanted_), options_.length) >
                       track_rule::worth;
        };
        const bool passed = turning_to_ < 0 && index(t.gc) != home_ && goal.posture_only;
        astray_ = passed && stays() ? astray_ + t.dt : 0;
        if (astray_ < track_rule::patience || weary()) return false;
        Goal there;
        Tag pair = 0;
        turning_to_ = home_;
        const bool holds = !elbow_turns(t) && holds_hand(t, there) && !(there.gap > 0);
        turning_to_ = -1;
        if (!holds || there.blocked != Status::OK) return false;
        if (tried_ == 0) tried_for_ = hand_.pose();
        tried_ += track_rule::most_ways / track_rule::turns;
        if (t.guard && !t.guard->clear(q_.q, there.at.q, pair)) return false;
        given_up_ = false;
        turn_to(there.at, home_);
        return true;
    }

    bool elbow_turns(const Tick& t) const noexcept {
        return turning_to_ >= 0 && configuration(turning_to_).elbow != t.gc.elbow;
    }

    /// The side of the stretched arm where the goal is.
    double elbow_side(const Tick& t) const noexcept { return elbow_turns(t) ? -side_ : side_; }

    /// The limits with joint 4 on its side of the stretched arm, that far off straight where its own limits
    /// leave that, and else as far as at rest; off folded always as at rest.
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

    /// The elbow keeps off straight while the wrist is fast, and bends in time for a wrist that comes in.
    void grow_margin(const Tick& t, const Circle<double>& c) noexcept {
        const Vec3<double> wrist = c.w * c.distance, from_base = wrist + Vec3<double>{0, 0, arm_.d_bs};
        const Twist hand = heading();
        const Vec3<double> arm_to_hand =
            arm_.base.rotation * from_base + arm_.base.position - wanted_.position;
        const Vec3<double> speed =
            arm_.base_inverse.rotation * (hand.linear + cross(hand.angular, arm_to_hand));
        wrist_speed_ = wrist_speed_ + (speed - wrist_speed_) * -std::expm1(-t.dt / track_rule::trembling);
        const double share = min(norm(wrist_speed_) / track_rule::fast, 1.0);
        const double wanted =
            options_.still_margin + share * max(options_.elbow_margin - options_.still_margin, 0.0);
        const double lasting = wanted > margin_ ? track_rule::growing : track_rule::shrinking;
        margin_ += (wanted - margin_) * -std::expm1(-t.dt / lasting);
        if (abs(wanted - margin_) < track_rule::negligible) margin_ = wanted;
        ahead_ = bend_ahead(arm_, wrist, wrist_speed_, side_ * arm_.sign[3] * v_[3], options_.velocity[3],
                            options_.acceleration[3]);
    }

    Status reason(const Circle<double>& c) const noexcept {
        if (is_folded(c)) return Status::FOLDED;
        if (is_unreachable(c)) return Status::UNREACHABLE;
        const ReachShell limits = reach_shell(arm_, kept_on(side_, 0.0));
        const bool beyond = c.distance < limits.inner || c.distance > limits.outer;
        return beyond ? Status::ELBOW_LIMIT : Status::ELBOW_MARGIN;
    }

    /// The posture of the goal's pose to go to; false where limits leave none. Beside theta_2 = 0 and theta_6
    /// = 0 the branch beyond is weighed too.
    bool posture_of(const Tick& t, Goal& goal) const noexcept {
        const Circle<double> c = circle(arm_, flange_pose(arm_, goal.pose));
        double least = infinity;
        const auto offer_all = [&](bool avoid) {
            if (turning_to_ >= 0) return offer(t, c, configuration(turning_to_), avoid, least, goal);
            if (arrived_ && fixed_) offer(t, c, t.gc, avoid, least, goal);
            if (least < infinity) return;
            const bool shoulder = abs(wrap(t.now.theta[1])) < track_rule::crossing,
                       wrist = abs(wrap(t.now.theta[5])) < track_rule::crossing;
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
            // pairs are numbered as the body's scene has them
            if (t.guard && (!goal.pair || !std::is_same_v<Body, Arm>))
                goal.pair = t.guard->nearest_at(goal.at.q);
        }
        return least < infinity;
    }

    /// `avoid`: only where nothing touches.
    void offer(const Tick& t, const Circle<double>& c, const Configuration<double>& gc, bool avoid,
               double& least, Goal& goal) const noexcept {
        const SelfMotion<double> m = self_motion(arm_, c, gc);
        const double psi = choose_psi(t, m, avoid, goal);
        if (is_nan(psi)) return;
        const Joints at = joints_within_limits(arm_, directions(m, sin_cos(psi)), q_.q);
        if (!within_limits(arm_.limits, at.q, track_rule::beyond)) return;  // psi says little at a hinge at 0
        double cost = 0;
        for (int j = 0; j < joints; ++j) cost += (at.q[j] - q_.q[j]) * (at.q[j] - q_.q[j]);
        if (!(cost < least)) return;
        least = cost;
        goal.at = at;
        goal.psi = psi;
        goal.gc = index(gc);
    }

    /// The psi to go to on a self-motion: that of least motion, turned towards the hint, or else to where the
    /// arm will pass through theta_2 or theta_6 = 0, or else to where joints will have room; kept off limits
    /// and singularities, and of obstacles; NaN where limits, or obstacles, leave none.
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

    /// Takes off what touches; false, and why, where nothing is left.
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

    /// 1, and less towards theta_2 and theta_6 = 0, which the arm passes best as it comes.
    static double regular(const Tick& t) noexcept {
        const double sine = min(abs(sin_cos(t.now.theta[1]).sin), abs(sin_cos(t.now.theta[5]).sin));
        const double share = min(sine / track_rule::irregular, 1.0);
        return share * share;
    }

    /// Of the arc that holds the present psi the clear part, else that arc, else any.
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

    /// psi of the elbow whose joints will have room where the hand will be.
    double foreseen(const SelfMotion<double>& m, double psi) const noexcept {
        const Twist hand = heading();
        if (turning_to_ >= 0 || size(hand, options_.length) * track_rule::preview < tolerance::angle)
            return psi;
        const Pose<double> there = moved_by(wanted_, hand * track_rule::preview);
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

    /// No arm angle of the goal is within limits: a posture from which no small move comes nearer to the
    /// hand, from the one of before, or from the best of closed-form starts clamped to the limits.
    void relax(const Tick& t, const Limits& limits, Goal& goal) noexcept {
        const Pose<double>& wanted = wanted_;
        goal.why = Status::LIMITS;
        Twist rest;
        const Joints before = relaxing_ ? relaxed_ : q_;
        Joints from = before;
        double least = detail::distance(arm_, before.q, wanted, options_.length, rest);
        if (relaxing_) {
            least -= track_rule::worth;
            const double here = detail::distance(arm_, q_.q, wanted, options_.length, rest);
            if (here < least) {
                least = here;
                from = q_;
            }
        }
        const SelfMotion<double> m = self_motion(arm_, circle(arm_, flange_pose(arm_, goal.pose)), t.gc);
        for (int i = 0; i < track_rule::starts; ++i) {
            const SinCos<double> at = sin_cos(two_pi / track_rule::starts * i);
            Joints one = joints_within_limits(arm_, directions(m, at), q_.q);
            for (int j = 0; j < joints; ++j) one.q[j] = min(max(one.q[j], limits.lower[j]), limits.upper[j]);
            const double off = detail::distance(arm_, one.q, wanted, options_.length, rest);
            if (!(off < least)) continue;
            least = off;
            from = one;
        }
        const Relaxed found = relaxed(arm_, limits, from, wanted, options_.length, track_rule::rounds);
        const double here = detail::distance(arm_, q_.q, wanted, options_.length, rest),
                     way = farthest_move(found.at);
        const bool pays = way <= track_rule::near || here - found.distance > track_rule::pays * way;
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

    /// A posture of the goal's pose that the bounds allow now; false where there is none.
    bool exact(const Tick& t, const Goal& goal, Joints& next) const noexcept {
        if (goal.blocked != Status::OK) return false;
        if (goal.posture_only) return taken(t, goal.at.q, next);
        Limits narrow;
        for (int j = 0; j < joints; ++j) {
            narrow.lower[j] = q_.q[j] + t.lower[j] * t.dt;
            narrow.upper[j] = q_.q[j] + t.upper[j] * t.dt;
        }
        if (goal.settled && taken(t, goal.at.q, next)) return true;
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

    bool exact_in(const Tick& t, const SelfMotion<double>& m, const LimitTable& table, double wish,
                  Joints& next) const noexcept {
        static constexpr double inside[] = {0, 1e-6, 1e-3, 0.1, 0.5};  // shares of the way to the middle
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

    /// psi one tick further towards a wish, so that it can come to rest there.
    double turned(const Tick& t, const SelfMotion<double>& m, const JointFunctions<double>& f,
                  double wish) const noexcept {
        const double held = psi_carried(arm_, m, f, t.now.z3, q_.q, options_.velocity),
                     way = wrap(wish - held);
        const Joints slope = rate(arm_, f, sin_cos(held));
        double most = infinity, hardest = infinity, jerk = infinity;
        for (int j = 0; j < joints; ++j) {
            most = min(most, 0.5 * options_.velocity[j] / abs(slope.q[j]));
            hardest = min(hardest, track_rule::turning * options_.acceleration[j] / abs(slope.q[j]));
            jerk = min(jerk, track_rule::turning * options_.jerk[j] / abs(slope.q[j]));
        }
        double speed = min(most, sqrt(2.0 * hardest * abs(way)));
        if (jerk < infinity) speed = min(speed, std::cbrt(jerk * way * way));
        if (t.elbow || is_nearly_singular(t.now))
            speed = min(speed, speed_beside(arm_, m, f, t.now, held, way, q_.q, v_, options_.velocity,
                                            options_.acceleration, track_rule::turning));
        return held + copysign(min(abs(way) / track_rule::ticks, speed * t.dt), way);
    }

    /// Whether the bounds allow these joints next, which are then drawn in by what was rounded.
    bool taken(const Tick& t, const double* wanted, Joints& next) const noexcept {
        for (int j = 0; j < joints; ++j) {
            const double move = wanted[j] - q_.q[j], least = t.lower[j] * t.dt, most = t.upper[j] * t.dt;
            if (!(move >= least - track_rule::outside && move <= most + track_rule::outside)) return false;
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

    /// As far towards the goal as the bounds allow: the tool first, the posture with what is left.
    void approach(const Tick& t, const Goal& goal, Joints& next) noexcept {
        const Pose<double> here = user_pose(arm_, t.now.flange);
        const Twist lead = goal_velocity(t, goal), rest = difference(here, goal.pose) - lead * t.dt;
        const double late = min(size(rest, options_.length) / track_rule::late, 1.0);
        const double damping = track_rule::regular + late * track_rule::damping;
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
            const JointQuadratic alone = equations(move, track_rule::aside * length);
            double d[joints];
            Unbounded(alone).minimise(alone.g, d);
            return pace(d, gain, share, t.dt);
        };
        // A hand that stands is met soonest if all joints arrive together. One that goes on is nearer all the
        // while if position does not wait for the joints that turn the tool.
        const Pace turning = pace_of(fixed_ ? rest : Twist{{}, rest.angular}, track_rule::braking),
                   moving = fixed_ ? turning : pace_of_position({rest.linear, {}}, track_rule::direct);
        const Twist nearer{rest.linear * moving.k, rest.angular * turning.k};
        for (int j = 0; j < joints; ++j) way[j] = goal.at.q[j] - q_.q[j];
        p = equations(lead + nearer, length);
        const double k = pace(way, t.dt).k;
        for (int j = 0; j < joints; ++j) p.g[j] += damping * k * way[j];
        free.minimise(p.g, v);
        if (has_jerk_) {  // on what is nearer, which falls as the tool comes nearer
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

    /// How fast joints with velocities v move the tool.
    static Twist twist(const Jacobian& J, const double (&v)[joints]) noexcept {
        double rows[6] = {};
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < joints; ++j) rows[i] += J.entry[i][j] * v[j];
        return {{rows[0], rows[1], rows[2]}, {rows[3], rows[4], rows[5]}};
    }

    /// The least of p in the box, clear of obstacles.
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

    /// A tool that stands still, or comes no nearer, although its goal can be taken is held by a joint at its
    /// limit that has to turn back, or by an obstacle: the arm then turns to the goal's posture, or to
    /// another of its pose, by a way that is clear. A hand that trembles makes an arm that does, so that then
    /// only a tool that is far from its goal, `off` m, counts. When all turns for a hand that does not move
    /// are spent the arm stands.
    void watch(const Tick& t, const Goal& goal, double off) noexcept {
        const bool counts = fixed_ || off > track_rule::worth, still = has_stalled(t);
        const bool stuck = no_nearer(t, off) || still;
        if (stuck && counts) searching_ = true;
        if (!searching_) return;
        if (weary() || goal.blocked != Status::OK) {
            if (t.guard && !options_.detours && tried_ == 0) {  // what is in the way
                ++tried_;
                tried_for_ = hand_.pose();
                barred_ = 0;
                t.guard->clear(q_.q, goal.at.q, barred_);
            }
            given_up_ = fixed_ && idle_ >= track_rule::patience;
        } else if (t.guard) {
            search(t, goal);
        } else {
            if (tried_ == 0) tried_for_ = hand_.pose();
            tried_ += track_rule::most_ways / track_rule::turns;
            turn_to(goal.at, goal.gc);
        }
    }

    /// From now on straight to a posture.
    void turn_to(const Joints& at, int gc) noexcept {
        leg_[0] = at;
        legs_ = 1;
        turning_to_ = gc;
        sought_ = hand_.pose();
        searching_ = false;
        forget();
    }

    /// Whether the tool has come no nearer to the goal of a slow hand for some time.
    bool no_nearer(const Tick& t, double off) noexcept {
        waited_ += t.dt;
        const bool fast = size(speed_, options_.length) > track_rule::slow;
        if (off < (1.0 - track_rule::progress) * nearest_ || (fast && !fixed_)) {
            nearest_ = off;
            waited_ = 0;
        }
        return waited_ >= track_rule::patience;
    }

    /// Whether all ways round have been tried for a hand that has stayed where it is, or none may be.
    bool weary() const noexcept { return tried_ >= track_rule::most_ways || !(options_.detours || asked_); }

    /// Tries some ways to postures of the goal's pose: straight, or by way of a posture drawn between.
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
        for (int k = 0; k < track_rule::ways; ++k) {
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
            leg_[legs_++] = via;
            return;
        }
        if (weary()) searching_ = false;
    }

    /// The next number of a fixed sequence between 0 and 1; an arm angle of some arcs.
    double drawn() noexcept {
        draw_ = draw_ * 1664525u + 1013904223u;
        return (draw_ >> 8) * 0x1p-24;
    }
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

    /// Turns no longer.
    void rest() noexcept {
        turning_to_ = -1;
        asked_ = false;
        legs_ = 0;
        searching_ = false;
    }

    /// Whether no joint has gone anywhere for the time of a stall.
    bool has_stalled(const Tick& t) noexcept {
        constexpr double lasting = track_rule::stall;
        for (int j = 0; j < joints; ++j) {
            const double possible = 0.25 * min(min(options_.velocity[j], lasting * options_.acceleration[j]),
                                               0.5 * lasting * lasting * options_.jerk[j]);  // from rest
            const double slowest = min(track_rule::standing, possible);
            if (abs(q_.q[j] - stood_.q[j]) <= slowest * lasting) continue;
            stood_ = q_;
            stood_for_ = 0;
            searching_ = false;
            return false;
        }
        stood_for_ += t.dt;
        return stood_for_ >= track_rule::stall;
    }

    /// The tool is where it is wanted, and the hand does not move: any leaving counts as no progress.
    void meet() noexcept { nearest_ = stood_for_ = 0; }

    /// Whether the tool is at its goal, which is not the hand, and comes no nearer to the hand.
    bool creeps(const Goal& goal) const noexcept {
        const bool calm = margin_ - options_.still_margin < track_rule::calm;
        const bool is_hand = size(difference(goal.pose, wanted_), options_.length) <= track_rule::exact;
        return calm && !is_hand && closest_ > track_rule::exact && idle_ >= track_rule::patience;
    }

    /// The tool is where it is wanted, or on a new way there.
    void forget() noexcept {
        stood_for_ = 0;
        waited_ = 0;
        nearest_ = infinity;
    }

    /// Straight to a posture of the goal, kept from the first tick on, or along the way that was found,
    /// whatever the tool does on it.
    void turn(const Tick& t, const Goal& goal, Joints& next) noexcept {
        if (legs_ == 0) {
            leg_[legs_++] = goal.at;
            sought_ = hand_.pose();
        }
        double way[joints], v[joints], slowing[joints], longest = 0;
        const Joints& to = leg_[legs_ - 1];
        for (int j = 0; j < joints; ++j) {
            way[j] = to.q[j] - q_.q[j];
            longest = max(longest, abs(way[j]));
        }
        const Pace at = pace(way, t.dt);
        const double k = at.k;
        if (longest < track_rule::turned) {
            if (legs_ > 1) {
                --legs_;
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
        if (has_stalled(t)) {  // an obstacle is in the way all the same
            if (t.guard) tried_ += track_rule::most_ways / (asked_ ? 1 : track_rule::turns);
            tried_for_ = hand_.pose();
            rest();
            forget();
        }
        go(t, v, next);
    }

    /// Comes to rest, and stays: all that was tried for a hand that does not move led nowhere.
    void stand(const Tick& t, Joints& next) noexcept {
        double v[joints];
        const double none[joints] = {};
        for (int j = 0; j < joints; ++j) v[j] = min(max(0.0, t.lower[j]), t.upper[j]);
        ease(t, none, v);
        if (t.guard) t.guard->restrain(v);
        go(t, v, next);
    }

    void go(const Tick& t, const double (&v)[joints], Joints& next) const noexcept {
        for (int j = 0; j < joints; ++j) next.q[j] = q_.q[j] + v[j] * t.dt;
        next.q[joints] = 0;
    }

    /// How fast the goal moves; nothing where it has jumped.
    Twist goal_velocity(const Tick& t, const Goal& goal) const noexcept {
        if (goal.why == Status::OK) return speed_;
        const Twist speed = difference(goal_pose_, goal.pose) * (1.0 / t.dt);
        const bool leapt = !(size(speed, options_.length) < track_rule::leap);
        return leapt ? Twist{} : speed;
    }

    // -- the answer

    /// Takes the velocity of joint j. One whose jerk is bounded keeps the one that was wanted: what rounding
    /// adds to a row, over dt^2, would take it out of the states from which it can stop.
    void go_on(const Tick& t, int j, double v) noexcept {
        const double wanted = min(max(v, t.lower[j]), t.upper[j]);
        if (bound_[j].has_jerk() && abs(wanted - v) * t.dt <= track_rule::rounding) v = wanted;
        a_[j] = (v - v_[j]) / t.dt;
        v_[j] = v;
    }

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
            fastest |= abs(v_[j]) >= options_.velocity[j] * (1.0 - track_rule::exact);
        }
        const double bend = detail::elbow_bend(arm_, q_.q[3]);
        if (abs(bend) > track_rule::level) side_ = bend < 0 ? -1.0 : 1.0;
        if (bent() >= options_.still_margin) least_bend_ = options_.still_margin;
        const Chain now = chain(arm_, q_.q);
        const Pose<double> tool = user_pose(arm_, now.flange);
        out.distance = size(difference(tool, wanted_), options_.length);
        out.gap = goal.gap;
        const Triad<double> on = triad(arm_, flange_pose(arm_, tool));
        out.psi = arm_angle(on, now.z3);
        out.gc = index(configuration(arm_, now.theta));
        out.status = out.distance <= track_rule::exact ? Tracking::FOLLOWING : Tracking::LAGGING;
        out.why = out.status == Tracking::FOLLOWING ? Status::OK : goal.why;
        if (out.status == Tracking::LAGGING && goal.why != Status::OK) out.status = Tracking::NEAREST;
        if (out.status == Tracking::LAGGING)
            out.why = fastest ? Status::VELOCITY_LIMIT : Status::ACCELERATION_LIMIT;
        const Tag met = t.guard ? t.guard->blocking() : 0;
        if (out.status == Tracking::LAGGING && met) out.why = Status::CLEARANCE;
        const bool waits = met && waited_ >= track_rule::patience;  // a way may still be found
        const bool ended = given_up_ || waits || (weary() && stood_for_ >= track_rule::stall);
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
    const Scene* about_;  // made ready for the body
    TrackerOptions options_;
    Hand hand_;
    Pose<double> wanted_ = identity_pose();  // the hand where this arm sees it
    Twist speed_, acceleration_;             // of it
    LimitTable plain_, clear_;
    Joints q_{}, relaxed_{};
    JerkBounds bound_[joints] = {};
    bool has_jerk_ = false;  // one of them
    double v_[joints] = {};
    double a_[joints] = {};       // rad/s^2
    double stopping_rate_ = 1;    // 1/s: by which all joints can stop clear of obstacles
    Vec3<double> wrist_speed_{};  // m/s: of the hand's wrist, averaged
    double margin_ = 0;           // rad off straight that joint 4 keeps while the hand is so fast
    double side_ = 1;             // of the stretched arm, on which joint 4 is kept
    double least_bend_ = 0;       // rad off straight that joint 4 has to keep
    double ahead_ = 0;            // the same, in time for the hand
    Crossing crossing_;
    int turning_to_ = -1;                    // the branch whose posture is gone to joint by joint; -1: none
    bool asked_ = false;                     // for by the operator
    int home_ = 0;                           // the branch in which the tool was last on the hand
    double astray_ = 0;                      // s in another one that cannot hold it
    Joints stood_{};                         // where the arm stands, or last did
    double stood_for_ = 0;                   // s that it has, away from its goal
    double nearest_ = 0;                     // m that the tool has come near to its goal ...
    double waited_ = 0;                      // ... and s since
    Towards hinted_{};                       // of the tick before ...
    Pose<double> before_ = identity_pose();  // ... and the hand
    bool fixed_ = false;                     // neither hand nor hint move; of such a hand:
    bool arrived_ = false;                   // the last tick was at its goal
    bool given_up_ = false;
    double closest_ = infinity, idle_ = 0;  // m that the tool has come near to it, and s since
    bool relaxing_ = false;
    bool searching_ = false;                    // for a way round what the arm stands at
    int tried_ = 0;                             // ways round, since the hand moved ...
    Pose<double> tried_for_ = identity_pose();  // ... from here
    int legs_ = 0;                              // of the way that was found, still to go
    Joints leg_[2]{};                           // the last one first
    Pose<double> sought_ = identity_pose();     // the hand that it was found for, as it was told
    Tag barred_ = 0;                            // who bars the straight way
    std::uint32_t draw_ = 1;
    bool escaping_ = false;  // the arm began where it touches
    Scene kept_{}, soft_{};  // the scene with the clearances that are kept, and kept where possible
    Pose<double> goal_pose_ = identity_pose();
};

}  // namespace armangle

#include "../names/end.hpp"
