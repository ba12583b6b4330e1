// One pass of fig. 10, from the present joints to the next: arcs, eq. (36), inverse, and continuity checks.
//
// The step tries in order:
//     - the psi that the policy requests (nearly always)
//     - near theta_2, theta_6 = 0, if that psi sweeps joints around: the solution next to the present one
//     - the nearest psi that one step reaches, in this branch or one that meets it (theta_2, theta_6 = 0),
//     and
//       at last beyond a straight elbow
//     - under bounds: as far towards the pose as they allow; out of reach, if requested: the nearest pose
#pragma once

#include "../circle/forward.hpp"
#include "../circle/inverse.hpp"
#include "../limits/nearest_search.hpp"
#include "../limits/solve_locally.hpp"
#include "bounds.hpp"
#include "leaving.hpp"
#include "pace.hpp"
#include "../scene/straight_move.hpp"
#include "step_options.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of a step.
struct StepTuning {
    static constexpr double length =
        0.2;  // m that count as one radian for the nearest pose if limits forbid all
    static constexpr int halvings = 40;        // bisections of the way out of a blocked arc within the bounds
    static constexpr double straight = 0.05;   // |sin| of theta_2, theta_4, theta_6 below which joints decide
    static constexpr double stretched = 1e-5;  // bend (rad) below which the elbow has no side
    static constexpr double sweep = 2.0;  // times the move to the nearby solution: permitted cost of carrying
                                          // psi
    static constexpr double calm = 0.15;  // ... up to this |sin| of theta_2, theta_6; more above it ...
    static constexpr double awake = 0.21;  // ... and any cost from this one on
    static constexpr double drift = 0.01;  // rad that a policy may move a joint there in addition; more above
    static constexpr double shut = 0.25;   // ... and a whole step from this one on
    static constexpr double turning = 0.3;  // share of the accelerations that slows psi near a hinge
    static constexpr double far = 1.0;      // rad from a joint to its own branch: others may be nearer
};

namespace detail {

/// The psi of the present configuration, carried to the circle of the next pose: the same number, or the psi
/// with the same elbow axis.
inline double carried_psi(const Arm& arm, const Chain& now, const Circle<double>& next,
                          Carry carry) noexcept {
    Triad<double> on = triad(arm, flange_pose(arm, user_pose(arm, now.flange)));
    if (carry == Carry::elbow || is_folded(on)) on = next;
    return arm_angle(on, now.z3);
}

/// Joints, and the distance to the nearest limit.
struct Lifted {
    JointLanes q;
    double margin;
};

/// Writes the joints nearest to q_now and their distance to the limits. A joint with a range below 2 pi moves
/// into its limits, however far; if a joint with a wider range would have to, WINDING_EXHAUSTED. LIMITS if no
/// revolution is within the limits.
ARMANGLE_INLINE Status choose_windings(const Arm& arm, const Directions<double>& d, const JointLanes& q_now,
                                       Lifted& out) noexcept {
    out.q = joints_near(arm, d, q_now);
    out.margin = limit_margin(arm.limits, out.q);
    if (out.margin >= -tolerance::angle) return Status::OK;
    double seed[joint_slots];
    q_now.store(seed);
    const JointLanes inside = JointLanes::load(joints_within_limits(arm, d, seed).q);
    for (int i = 0; i < joints; ++i)
        if (abs(inside[i] - out.q[i]) > pi && !(arm.limits.upper[i] - arm.limits.lower[i] < two_pi))
            return Status::WINDING_EXHAUSTED;
    out.q = inside;
    out.margin = limit_margin(arm.limits, out.q);
    return out.margin >= -tolerance::angle ? Status::OK : Status::LIMITS;
}

/// Fills in the velocities, distance from limits, status and reason of a step whose joints are in `out`.
inline void complete(const Arm& arm, const double* q_now, double dt, Status status, Status why,
                     Step& out) noexcept {
    for (int i = 0; i < joints; ++i) out.velocity[i] = (out.q[i] - q_now[i]) / dt;
    out.margin = limit_margin(arm.limits, out.q);
    out.status = status;
    out.why = why;
}

/// Computes the self-motion of a pose in the branch of the present joints, or in `gc` if it is 0 or more. If
/// the elbow is nearly stretched and the limits of joint 4 permit only its other side, that side is used.
inline SelfMotion<double> motion_from(const Arm& arm, const double* q_now, const Chain& now,
                                      const Pose<double>& pose, int gc) noexcept {
    Configuration<double> branch = gc < 0 ? configuration(arm, now.theta) : configuration(gc);
    const SelfMotion<double> own = self_motion(arm, pose, branch);
    const double bent = elbow_bend(arm, q_now[3]);
    if (gc >= 0 || !(abs(bent) <= StepTuning::straight)) [[likely]]
        return own;
    branch.elbow = -branch.elbow;
    const SelfMotion<double> other = self_motion(arm, pose, branch);
    const auto keeps = [&](const SelfMotion<double>& m) {
        const double q_4 = lift(to_q(arm, 3, atan2(m.elbow.theta_4.sin, m.elbow.theta_4.cos)), q_now[3]);
        return q_4 >= arm.limits.lower[3] - tolerance::angle && q_4 <= arm.limits.upper[3] + tolerance::angle;
    };
    return !keeps(own) && keeps(other) ? other : own;
}

/// The result without motion, with the reason: the present configuration, and psi on the circle of the pose.
[[gnu::noinline]] inline Step stayed(const Arm& arm, const double* q_now, const Chain& now,
                                     const Circle<double>& c, double dt, Status why) noexcept {
    Step out{};
    for (int i = 0; i < joints; ++i) out.q[i] = q_now[i];
    out.psi = carried_psi(arm, now, c, Carry::psi);
    out.gc = index(configuration(arm, now.theta));
    complete(arm, q_now, dt, why, why, out);
    return out;
}

/// The result for bad input: q_now unchanged, psi NaN.
[[gnu::noinline]] inline Step refused(const Arm& arm, const double* q_now, double dt) noexcept {
    Step out{};
    for (int i = 0; i < joints; ++i) out.q[i] = q_now[i];
    out.psi = not_a_number;
    out.gc = -1;
    complete(arm, q_now, dt, Status::BAD_INPUT, Status::BAD_INPUT, out);
    return out;
}

/// A pose in one branch, by reference: its arcs, the part that the caller and obstacles permit, and the psi
/// that the policy requests.
struct Branch {
    const SelfMotion<double>* motion;
    const JointFunctions<double>* functions;
    const ArcSet *own, *asked, *arcs;
    const ArcSet* kept;  // the part on which the policy acts: with the soft clearance, or all of it
    Status status;
    double wish;
};

/// Storage for the data of a branch.
struct BranchParts {
    SelfMotion<double> motion;
    JointFunctions<double> functions;
    ArcSet own, allowed, clear, soft;
};

/// The policy with its target converted to a psi of this self-motion.
inline Policy policy_on(const StepOptions& options, const Arm& arm, const SelfMotion<double>& m) noexcept {
    return options.policy.rule == Rule::towards ? resolved_policy(options.policy, arm, m) : options.policy;
}

/// Computes the arcs of the branch of `parts.motion` and the psi that the policy requests, starting from psi;
/// the status says why there is none. The result refers to `parts`.
inline Branch look(const Arm& arm, const LimitTable& limits, double psi, const StepOptions& options,
                   BranchParts& parts) noexcept {
    parts.functions = joint_functions(parts.motion);
    Branch out{&parts.motion, &parts.functions, &parts.own, &parts.own,
               &parts.own,    &parts.own,       Status::OK, psi};
    out.status = feasible(parts.motion, parts.functions, limits, parts.own);
    if (out.status != Status::OK) return out;
    if (options.allowed) {
        intersect(parts.own, *options.allowed, parts.allowed);
        out.asked = out.arcs = &parts.allowed;
        if (parts.allowed.empty()) out.status = Status::NOT_ALLOWED;
        if (parts.allowed.empty()) return out;
    }
    if (options.scene) {
        out.status = keep_clear(arm, *options.scene, parts.motion, *out.asked, parts.clear);
        out.arcs = &parts.clear;
        if (out.status != Status::OK) return out;
    }
    out.kept = out.arcs;
    const Policy policy = policy_on(options, arm, parts.motion);
    Resolution next = resolve(policy, *out.arcs, psi);
    const bool soft = options.scene && options.scene->soft > 0 && next.status == Status::OK;
    if (soft && keep_soft(arm, *options.scene, parts.motion, *out.arcs, psi, parts.soft)) {
        out.kept = &parts.soft;
        next = resolve_from_nearest_end(policy, parts.soft, psi);
    }
    out.status = next.status;
    out.wish = next.psi;
    return out;
}

/// The psi that the policy requests on the part `ahead` of `arcs`, in the arc that contains psi if possible;
/// NaN if that part is null or empty.
inline double wish_ahead(const ArcSet& arcs, Policy policy, const ArcSet* ahead, double psi) noexcept {
    if (!ahead || ahead->empty()) return not_a_number;
    policy.outside = Outside::nearest;
    const Place place = find(arcs, psi);
    if (place.index < 0 || contains(*ahead, psi)) return resolve(policy, *ahead, psi).psi;
    ArcSet here, near;
    make_empty(here);
    here.arc[here.count++] = arcs.arc[place.index];
    here.full = arcs.full;
    intersect(here, *ahead, near);
    return resolve(policy, near.empty() ? *ahead : near, psi).psi;
}

/// Whether the joints of psi, written to `to`, are a permitted step: in their present revolutions, no longer
/// than `longest` (rad). False if theta_2 or theta_6 is 0 or pi, where psi does not determine their
/// neighbours.
ARMANGLE_INLINE bool is_step(const Arm& arm, const SelfMotion<double>& m, double psi, const JointLanes& here,
                             double longest, Lifted& to) noexcept {
    const Directions<double> d = directions(m, sin_cos(psi));
    if (min(abs(d.y[1]), abs(d.y[5])) <= tolerance::one_axis) [[unlikely]]
        return false;
    return choose_windings(arm, d, here, to) == Status::OK && largest_move(to.q, here) <= longest;
}

/// The step to joints that solve the pose, with psi, branch, velocities and status OK.
ARMANGLE_INLINE Step stepped(const Lifted& to, const double* q_now, double dt, double psi, int gc) noexcept {
    Step out;
    to.q.store(out.q);
    for (int i = 0; i < joints; ++i) out.velocity[i] = (out.q[i] - q_now[i]) / dt;
    out.psi = psi;
    out.gc = gc;
    out.status = out.why = Status::OK;
    out.margin = to.margin;
    return out;
}

/// The smaller |sin| of the angles theta_2 and theta_6 (rad).
inline double singularity_sine(double theta_2, double theta_6) noexcept {
    return min(abs(std::sin(theta_2)), abs(std::sin(theta_6)));
}

/// Whether joints next to a joint 2 or 6 with this |sin| may move far although psi hardly changes and nobody
/// requested it. A policy that holds psi requests it; one that holds the elbow does not.
inline bool may_sweep(double sine, const StepOptions& options) noexcept {
    const Rule rule = options.policy.rule;
    const bool asked = rule != Rule::repulsion && !(rule == Rule::hold && options.carry == Carry::elbow);
    return sine <= StepTuning::shut && !asked;
}

/// Whether the straight joint motion to a configuration of another branch keeps the end effector near its
/// straight path. If not, the change of branch is a jump.
template <class AnyArm>
bool passes(const AnyArm& arm, const double* q_now, const double* q) noexcept {
    double middle[joint_slots] = {};
    for (int j = 0; j < joints; ++j) middle[j] = 0.5 * (q_now[j] + q[j]);
    const Pose<double> here = tool_pose(arm, q_now);
    const Twist way = difference(here, tool_pose(arm, q));
    const Twist off = difference(moved_by(here, way * 0.5), tool_pose(arm, middle));
    return size(off, StepTuning::length) <= size(way, StepTuning::length) + tolerance::angle;
}

/// How far (rad) joints may move near theta_2 = 0 or theta_6 = 0 if psi is carried, while the nearest
/// solution is `least` rad away. The value grows with the |sin| `sine` of that joint and is infinite above a
/// threshold.
inline double damped_move(double sine, double least) noexcept {
    if (sine >= StepTuning::awake) return infinity;
    const double share = (sine - StepTuning::calm) / (StepTuning::awake - StepTuning::calm);
    return StepTuning::sweep * least / (1.0 - max(share, 0.0)) + tolerance::angle;
}

/// How far (rad) a policy may move joints in addition near theta_2 = 0 or theta_6 = 0, at most one step. It
/// grows with the |sin| `sine`, so that a suspended policy catches up in many steps.
inline double damped_drift(double sine, double longest) noexcept {
    const double share = (sine - StepTuning::calm) / (StepTuning::shut - StepTuning::calm);
    const double growth = max(longest / StepTuning::drift, 1.0);
    return StepTuning::drift * std::pow(growth, min(max(share, 0.0), 1.0));
}

/// Whether the policy has a goal for psi (a target or the middle), and theta_2 = 0 or theta_6 = 0 must be
/// left first.
inline bool may_leave(const Chain& now, const Policy& policy) noexcept {
    return (policy.rule == Rule::towards || policy.rule == Rule::centre) && is_singular(now);
}

/// The angle (rad) by which a pose turns about its own z axis to come nearest to the orientation of another.
inline double roll_towards(const Pose<double>& other, const Pose<double>& pose) noexcept {
    const auto &a = other.rotation, &b = pose.rotation;
    return atan2(dot(a.x, b.y) - dot(a.y, b.x), dot(a.x, b.x) + dot(a.y, b.y));
}

/// Whether `why` lies in the pose alone (out of reach, limits, singular, no convergence), so that a step may
/// go to the nearest pose instead.
inline bool is_beyond(Status why) noexcept {
    return why == Status::UNREACHABLE || why == Status::FOLDED || why == Status::ELBOW_LIMIT ||
           why == Status::ELBOW_MARGIN || why == Status::LIMITS || why == Status::NEAR_SINGULAR ||
           why == Status::NO_CONVERGENCE;
}

/// The alternatives that a step tries if the psi that the policy requests cannot be reached.
class StepFallback {
public:
    /// Keeps references to its arguments: joints q_now with frames `now`, from which the usual step is not
    /// permitted.
    StepFallback(const Arm& arm, const LimitTable& limits, const double* q_now, const Chain& now,
                 const StepOptions& options) noexcept
        : arm_(arm),
          limits_(limits),
          q_now_(q_now),
          now_(now),
          options_(options),
          bounds_(options.bounds ? *options.bounds : no_bounds) {}

    /// Tries the alternatives in order and returns the step. `own`, if not null, is the pose in the branch of
    /// the joints, and `psi` the psi that they carry to it; both are computed otherwise.
    Step operator()(const Pose<double>& pose, double psi, const Branch* own) noexcept {
        Step out;
        BranchParts parts;
        branch_[0] = own ? *own : begin(pose, psi, parts);
        const auto taken = [this](Step& to) {
            return !options_.scene || is_clear_as_shared(arm_, *options_.scene, to.q)
                       ? finished(Status::OK, Status::OK, to)
                       : halted(branch_[0].motion->circle, Status::CLEARANCE);
        };
        if (calm(pose, psi, out)) return taken(out);
        if (!own && !may_leave(now_, options_.policy) && plain(out)) return taken(out);
        if (leave(pose, psi, out) || exact(psi, out)) return taken(out);
        if (stand(pose, out)) return taken(out);
        Status why = refusal();
        if (solve_nearby(pose, why, out) || turn_elbow(psi, why, out)) return taken(out);
        const bool blocked = why == Status::LIMITS || why == Status::WINDING_EXHAUSTED;
        const Circle<double>& c = branch_[0].motion->circle;
        if (options_.scene) {  // the way to the solution of another pose may collide
            const bool left = options_.policy.outside == Outside::escape && escape(psi, out);
            return left ? finished(Status::CLEARANCE, Status::OK, out) : halted(c, why);
        }
        const double held = carried_psi(arm_, now_, c, Carry::psi);  // the elbow moves ahead of the joints
        if (options_.bounds && approach(pose, held, blocked ? pi : infinity, out))
            return finished(Status::PARTIAL, why, out);
        if (options_.nearest && is_beyond(why)) return to_nearest(pose, why);
        return halted(c, why);
    }

private:
    /// Computes the pose in the branch of the joints, stored in `parts`, and writes the psi that they carry
    /// to it.
    Branch begin(const Pose<double>& pose, double& psi, BranchParts& parts) const noexcept {
        parts.motion = motion_from(arm_, q_now_, now_, pose, options_.gc);
        psi = carried_psi(arm_, now_, parts.motion.circle, options_.carry);
        return look(arm_, limits_, psi, options_, parts);
    }

    /// Writes the step to the psi that the policy requests to `out`; false if the coming poses restrict psi,
    /// or it is no permitted step.
    bool plain(Step& out) const noexcept {
        const Branch& own = branch_[0];
        if (own.status != Status::OK || options_.ahead) return false;
        const JointLanes here = joint_lanes(q_now_);
        Lifted to;
        if (!is_step(arm_, *own.motion, own.wish, here, options_.max_joint_step, to)) return false;
        out = stepped(to, q_now_, options_.dt, own.wish, index(own.motion->gc));
        return !options_.bounds || keeps(arm_, bounds_, q_now_, out.q, options_.max_joint_step);
    }

    /// Near theta_2 = 0 or theta_6 = 0: writes the solution next to the present one to `out` if the requested
    /// psi would move the neighbouring joints far. If the policy alone requests that, psi moves less. False
    /// if this does not apply.
    bool calm(const Pose<double>& pose, double psi, Step& out) const noexcept {
        const Branch& own = branch_[0];
        if (own.status != Status::OK) return false;
        const double sine = singularity_sine(now_.theta[1], now_.theta[5]);
        if (!may_sweep(sine, options_)) return false;
        const BoundedStep step = bounded(own);
        const double carried = largest_move(step.at(psi).q, q_now_);
        double least = 0;
        if (sine < StepTuning::awake) {
            const int side = index(own.motion->gc) & 2;
            Status why = Status::OK;
            if (!solve_from(now_.theta[3], pose, side, why, out)) return false;
            const bool apart = limits_.margin > 0 && out.gc != index(own.motion->gc);  // by the margin
            if (apart || (limits_.margin > 0 && !contains(*own.arcs, out.psi))) return false;
            least = largest_move(out.q, q_now_);
            if (carried > damped_move(sine, least)) return true;
        }
        const double most =
            max(StepTuning::sweep * least, carried) + damped_drift(sine, options_.max_joint_step);
        if (largest_move(step.at(own.wish).q, q_now_) <= most) return false;
        StepOptions slower = options_;
        slower.max_joint_step = min(options_.max_joint_step, most);
        StepFallback aside(arm_, limits_, q_now_, now_, slower);
        aside.branch_[0] = own;
        return aside.exact(psi, out);
    }

    /// Writes a step to `out` that keeps the present joints, if they solve the pose; otherwise false. Near a
    /// singularity psi may have too few digits for the usual check.
    bool stand(const Pose<double>& pose, Step& out) const noexcept {
        const double length = arm_.size, most = LocalSolveTuning::meets * length;
        if (!(arm_.upper_arm > 0 && arm_.forearm > 0)) return false;  // such an arm has no elbow
        if (limits_.margin > 0 || !(limit_margin(arm_.limits, q_now_) >= -tolerance::angle)) return false;
        if (!(size(difference(user_pose(arm_, now_.flange), pose), length) <= most)) return false;
        if (options_.bounds && !keeps(arm_, bounds_, q_now_, q_now_, options_.max_joint_step)) return false;
        if (options_.scene && !is_clear(arm_, *options_.scene, q_now_)) return false;
        for (int j = 0; j < joints; ++j) out.q[j] = q_now_[j];
        place(out);
        if (options_.gc >= 0 && options_.gc != out.gc) return false;
        return !options_.allowed || contains(*options_.allowed, out.psi);
    }

    /// If theta_2 or theta_6 is 0, the end effector is at its pose and the policy requests another psi,
    /// writes a step to `out` that rotates the neighbouring joints until psi can move. False if this does not
    /// apply.
    bool leave(const Pose<double>& pose, double psi, Step& out) const noexcept {
        if (!may_leave(now_, options_.policy)) return false;
        const Twist off = difference(user_pose(arm_, now_.flange), pose);
        if (!(size(off, StepTuning::length) <= tolerance::angle)) return false;
        Leaving way;
        double missed = infinity;  // without flip
        for (int flip = 0; flip < 4; ++flip) {
            if ((flip & 1 && !is_singular(now_, 0)) || (flip & 2 && !is_singular(now_, 1))) continue;
            if (flip > 0 && options_.gc >= 0) break;
            BranchParts parts;
            const Branch b = flipped(*branch_[0].motion, flip, psi, options_, parts);
            if (b.status != Status::OK) continue;
            const bool named = options_.policy.rule == Rule::towards;
            const double wish = named ? policy_on(options_, arm_, parts.motion).towards.psi : b.wish;
            if (is_nan(wish)) return false;
            missed = min(missed, abs(wrap(wish - psi)));
            offer_ways_on(arm_, parts.motion, *b.kept, now_, psi, wish, q_now_, way);
        }
        if (way.gc < 0 || !(way.missed < missed - LeavingTuning::off)) return false;
        const auto take = [&](const double* q) {
            const bool is_step =
                largest_move(q, q_now_) <= options_.max_joint_step &&
                (!options_.bounds || keeps(arm_, bounds_, q_now_, q, options_.max_joint_step)) &&
                (!options_.scene || is_clear(arm_, *options_.scene, q));
            for (int j = 0; j < joint_slots && is_step; ++j) out.q[j] = q[j];
            return is_step;
        };
        const MoveBox box = move_box(arm_, bounds_, q_now_, options_.max_joint_step, {});
        out.psi = way.psi;
        out.gc = way.gc;
        if (has_arrived(way, box.lower, box.upper) && take(way.to.q)) return true;
        out.psi = psi;
        const double k = pace(way.d, bounds_.dt, bounds_.velocity, bounds_.acceleration);
        const double share = share_within(way, k * bounds_.dt, box.lower, box.upper);
        Joints to{};
        for (int j = 0; j < joints; ++j) to.q[j] = q_now_[j] + share * way.d[j];
        return take(to.q);
    }

    /// The step in a branch, under the bounds.
    BoundedStep bounded(const Branch& b) const noexcept {
        return {arm_, *b.motion, *b.functions, q_now_, bounds_, options_.max_joint_step};
    }

    /// Whether joint j (0..6) can reach theta = `angle` or angle + pi, where branches meet, within one step
    /// and within `most` (rad).
    bool crosses(int j, double angle, double most) const noexcept {
        const double off = now_.theta[j] - angle, fastest = bounds_.velocity[j] * bounds_.dt;
        return abs(off - pi * round(off / pi)) <= min(min(options_.max_joint_step, fastest), most);
    }

    /// Whether the branch may change its shoulder sign (if flip & 1) and wrist sign (if flip & 2) within this
    /// step and by joint moves of at most `most` (rad).
    bool may_flip(int flip, double most) const noexcept {
        return (!(flip & 1) || crosses(1, 0.0, most)) && (!(flip & 2) || crosses(5, 0.0, most));
    }

    /// The branch with the shoulder sign (if flip & 1) and the wrist sign (if flip & 2) changed; `parts`
    /// stores what it refers to.
    Branch flipped(const SelfMotion<double>& motion, int flip, double psi, const StepOptions& options,
                   BranchParts& parts) const noexcept {
        parts.motion = motion;
        if (flip & 1) parts.motion.gc.shoulder = -parts.motion.gc.shoulder;
        if (flip & 2) parts.motion.gc.wrist = -parts.motion.gc.wrist;
        return look(arm_, limits_, psi, options, parts);
    }

    /// Adds the branches that the step can change to by joint moves of at most `most` (rad), with the psi
    /// that the policy requests there, starting from psi; none if the caller fixed the branch.
    void gather(double psi, double most) noexcept {
        const Branch& own = branch_[0];
        const bool hopeless = own.status != Status::OK && own.status != Status::LIMITS &&
                              own.status != Status::NOT_ALLOWED && own.status != Status::OUTSIDE &&
                              own.status != Status::CLEARANCE;
        if (options_.gc >= 0 || hopeless) return;
        for (int flip = 1; flip < 4; ++flip)
            if (may_flip(flip, most)) {
                branch_[count_] = flipped(*own.motion, flip, psi, options_, beside_[count_ - 1]);
                ++count_;
            }
    }

    /// Finds a solution with the other sign of the elbow if one step can pass the stretched arm; of several
    /// branches, the one with the least joint motion. Used only if the present sign has none. `why` states if
    /// only the user's arcs forbid it.
    bool turn_elbow(double psi, Status& why, Step& out) const noexcept {
        const double straight = arm_.delta_angle;
        if (options_.gc >= 0 || limits_.margin > 0 || !crosses(3, straight, infinity)) return false;
        Configuration<double> gc = branch_[0].motion->gc;
        gc.elbow = -gc.elbow;
        const SelfMotion<double> beyond = self_motion(arm_, branch_[0].motion->circle, gc);
        const auto is_there = [&](const StepOptions& options, Step& found) {
            BranchParts parts;
            double least = infinity;
            for (int flip = 0; flip < 4; ++flip)
                if (may_flip(flip, infinity))
                    take(flipped(beyond, flip, psi, options, parts), psi, nullptr, least, found);
            return least < infinity;
        };
        if (is_there(options_, out)) return true;
        if (!options_.allowed) return false;
        StepOptions any = options_;
        any.allowed = nullptr;
        Step forbidden;
        if (is_there(any, forbidden)) why = Status::NOT_ALLOWED;
        return false;
    }

    /// The reason why no branch has a step: of their reasons, the first in the order listed below; else that
    /// of the first branch.
    Status refusal() const noexcept {
        static constexpr Status order[] = {
            Status::NOT_ALLOWED,       Status::CLEARANCE, Status::ACCELERATION_LIMIT, Status::VELOCITY_LIMIT,
            Status::WINDING_EXHAUSTED, Status::LIMITS,    Status::JOINT_JUMP};
        Status of[4];
        for (int i = 0; i < count_; ++i) {
            const Branch& b = branch_[i];
            const bool shut = b.status == Status::LIMITS || b.status == Status::NOT_ALLOWED;
            of[i] = b.status;
            if (b.status == Status::OK || (i > 0 && shut)) of[i] = bounded(b).refusal(*b.own, *b.arcs);
            const bool met = options_.scene && b.status == Status::OK && of[i] == Status::NOT_ALLOWED;
            if (met && bounded(b).leads_to(*b.asked)) of[i] = Status::CLEARANCE;
            const bool speed = of[i] == Status::VELOCITY_LIMIT || of[i] == Status::ACCELERATION_LIMIT;
            if (shut && speed) of[i] = Status::JOINT_JUMP;  // no velocity leads to a branch without arcs
            const bool leapt = i > 0 && b.status == Status::OK && bounded(b).leads_to(*b.arcs);
            if (leapt) of[i] = Status::JOINT_JUMP;  // a step that does not pass between branches
        }
        for (const Status why : order)
            for (int i = 0; i < count_; ++i)
                if (of[i] == why) return why;
        return of[0];
    }

    /// Finds a solution of the pose that one step reaches: in the own branch if its psi can be kept, else in
    /// the branch with the least joint motion. False if there is none.
    bool exact(double psi, Step& out) noexcept {
        double least = infinity;
        count_ = 1;
        if (take(branch_[0], psi, options_.ahead, least, out) &&
            (out.psi == branch_[0].wish || bounded(branch_[0]).keeps(psi)))
            return true;
        gather(psi, least);
        for (int i = 1; i < count_; ++i) take(branch_[i], psi, nullptr, least, out);
        return least < infinity;
    }

    /// Writes the solution of one branch within the bounds, nearest to psi or to the part `ahead` (null:
    /// none), to `out` if its joints move less than `least` (rad), which is then updated; otherwise false.
    bool take(const Branch& b, double psi, const ArcSet* ahead, double& least, Step& out) const noexcept {
        if (b.status != Status::OK) return false;
        const BoundedStep step = bounded(b);
        const double found = bounded_psi(step, b, ahead, psi);
        if (is_nan(found)) return false;
        const Joints to = step.at(found);
        const double move = largest_move(to.q, q_now_);
        if (!(move < least)) return false;
        if (&b != &branch_[0] && !passes(arm_, q_now_, to.q)) return false;
        least = move;
        for (int j = 0; j < joint_slots; ++j) out.q[j] = to.q[j];
        out.psi = found;
        out.gc = index(b.motion->gc);
        return true;
    }

    /// The psi that the policy requests, or the nearest one to it within the bounds: on the part `ahead`,
    /// otherwise on the arcs; NaN if there is none. If it is out of bounds, the policy is also applied to the
    /// psi of the other carry rule. If the reference plane rotates fast, the elbow need not follow it; over
    /// the base axis the plane is the steadier reference.
    double bounded_psi(const BoundedStep& step, const Branch& b, const ArcSet* ahead,
                       double psi) const noexcept {
        ArcSet within, both;
        double wish = b.wish;
        if (ahead && b.kept != b.arcs) {
            intersect(*ahead, *b.kept, both);
            if (!both.empty()) ahead = &both;
        }
        const double there =
            ahead ? wish_ahead(*b.arcs, policy_on(options_, arm_, *b.motion), ahead, psi) : not_a_number;
        if (!is_nan(there)) {
            if (step.keeps(there)) return there;
            step.within(*ahead, {}, within);
            const double found = step.nearest(within, there);
            if (!is_nan(found)) return found;
            wish = there;
        }
        wish = slowed(b, psi, wish);
        if (step.keeps(wish)) return wish;
        const Carry way = options_.carry == Carry::psi ? Carry::elbow : Carry::psi;
        const double other = carried_psi(arm_, now_, b.motion->circle, way);
        if (is_nan(there) && abs(wrap(other - psi)) > tolerance::angle) {
            const Policy policy = policy_on(options_, arm_, *b.motion);
            const Resolution held = b.kept == b.arcs ? resolve(policy, *b.arcs, other)
                                                     : resolve_from_nearest_end(policy, *b.kept, other);
            if (held.status == Status::OK && step.keeps(held.psi)) return held.psi;
        }
        step.within(*b.arcs, {}, within);
        return step.nearest(within, wish);
    }

    /// The requested psi, moved less far from psi if accelerations are bounded, so that the joints can brake
    /// afterwards.
    double slowed(const Branch& b, double psi, double wish) const noexcept {
        bool bound = false;
        for (const double a : bounds_.acceleration) bound |= a < infinity;
        if (!bound || options_.policy.rule == Rule::repulsion) return wish;
        const double way = wrap(wish - psi);
        const double speed =
            speed_near_singular(arm_, *b.motion, *b.functions, now_, psi, way, q_now_, bounds_.velocity_now,
                                bounds_.velocity, bounds_.acceleration, StepTuning::turning);
        return psi + copysign(min(abs(way), speed * bounds_.dt), way);
    }

    /// Finds a solution near the present joints numerically. It is used if joint 2, 4 or 6 is nearly
    /// singular, where psi has too few digits to check limits. The sign of the elbow is kept, unless it is
    /// mere rounding. `why` is the reason so far; it becomes NOT_ALLOWED if only the user's arcs forbid the
    /// solution.
    bool solve_nearby(const Pose<double>& pose, Status& why, Step& out) const noexcept {
        const bool limits = why == Status::LIMITS || why == Status::WINDING_EXHAUSTED ||
                            why == Status::ELBOW_LIMIT || why == Status::JOINT_JUMP;
        const double straight = arm_.delta_angle;
        double bend = abs(std::sin(now_.theta[3] - straight));
        for (const int j : hinge_joint) bend = min(bend, abs(std::sin(now_.theta[j])));
        if (!limits || limits_.margin > 0 || bend > StepTuning::straight) return false;
        // a stretched elbow does not bend by itself: start from the pose's theta_4; either side is allowed
        const SinCos<double>& bent = branch_[0].motion->elbow.theta_4;
        const double theta_4 = atan2(bent.sin, bent.cos);
        const int side = index(configuration(arm_, now_.theta)) & 2;
        const bool either = abs(std::sin(now_.theta[3] - straight)) <= StepTuning::stretched;
        return solve_from(theta_4, pose, either ? -1 : side, why, out) ||
               (either && solve_from(2 * straight - theta_4, pose, -1, why, out));
    }

    /// Finds a solution numerically from the present joints, first with joint 4 at theta_4 (rad), then
    /// unchanged. The solution must have elbow bit gc & 2 = `side` (0, 2; -1: either) and stay within the
    /// limits and one step. `why` becomes NOT_ALLOWED if only the user's arcs forbid it.
    bool solve_from(double theta_4, const Pose<double>& pose, int side, Status& why,
                    Step& out) const noexcept {
        Limits box = arm_.limits;
        Joints start;
        for (int j = 0; j < joint_slots; ++j) start.q[j] = q_now_[j];
        for (int j = 0; j < joints; ++j) {
            const double reach = options_.max_joint_step - tolerance::bound;
            box.lower[j] = max(box.lower[j], q_now_[j] - reach);
            box.upper[j] = min(box.upper[j], q_now_[j] + reach);
            if (!(box.lower[j] <= box.upper[j])) return false;  // too far beyond a limit to return
        }
        Relaxed at{start, infinity};
        for (const double q_4 : {lift(to_q(arm_, 3, theta_4), q_now_[3]), q_now_[3]}) {
            if (meets(arm_, at)) break;
            int rounds = LocalSolveTuning::rounds;
            start.q[3] = q_4;
            at = solve_locally(arm_, box, start, pose, {}, 0.0, rounds);
        }
        if (!meets(arm_, at) || largest_move(at.at.q, q_now_) > options_.max_joint_step) return false;
        for (int j = 0; j < joint_slots; ++j) out.q[j] = at.at.q[j];
        place(out);
        if ((side >= 0 && (out.gc & 2) != side) || (options_.gc >= 0 && options_.gc != out.gc)) return false;
        if (options_.scene && !is_clear(arm_, *options_.scene, out.q)) return false;
        const bool asked = !options_.allowed || contains(*options_.allowed, out.psi);
        if (!asked) why = Status::NOT_ALLOWED;
        return asked && (!options_.bounds || keeps(arm_, bounds_, q_now_, out.q, options_.max_joint_step));
    }

    /// Writes a step to `out` that leaves the collision at psi, as far as it may go. Tries the end of the
    /// blocked arc that costs less joint motion, unless a link comes nearer to its closest obstacle; then the
    /// other end. False if psi is not in collision, or no step helps.
    bool escape(double psi, Step& out) const noexcept {
        const Branch& b = branch_[0];
        if (b.status != Status::OK || contains(*b.arcs, psi)) return false;
        const Place now = find(*b.asked, psi);
        if (now.index < 0) return false;
        const Arc& asked = b.asked->arc[now.index];
        double way[2] = {-infinity, infinity};
        for (int i = 0; i < b.arcs->count; ++i) {
            const Arc& arc = b.arcs->arc[i];
            const double up = lift(arc.lower, now.psi + pi) - now.psi,
                         down = lift(arc.upper, now.psi - pi) - now.psi;
            if (b.asked->full || now.psi + up <= asked.upper + tolerance::angle) way[1] = min(way[1], up);
            if (b.asked->full || now.psi + down >= asked.lower - tolerance::angle) way[0] = max(way[0], down);
        }
        const BoundedStep step = bounded(b);
        const auto far = [&](double w) {
            return abs(w) < infinity ? largest_move(step.at(now.psi + w).q, q_now_) : infinity;
        };
        const auto apart = [&](double at) {
            return proximity(arm_, *options_.scene, *b.motion, at, true).distance;
        };
        const bool swap = far(way[1]) < far(way[0]);
        const double here = apart(now.psi);
        for (const double w : {way[swap], way[!swap]}) {
            if (!(abs(w) < infinity)) continue;
            double low = 0, high = 1;  // shares of the way within the bounds
            for (int k = 0; k < StepTuning::halvings; ++k) {
                const double middle = 0.5 * (low + high);
                (step.keeps(now.psi + middle * w) ? low : high) = middle;
            }
            const double to = now.psi + low * w;
            if (!(abs(low * w) > tolerance::angle) || !(apart(to) >= here)) continue;
            const Joints q = step.at(to);
            for (int j = 0; j < joint_slots; ++j) out.q[j] = q.q[j];
            out.psi = wrap(to);
            out.gc = index(b.motion->gc);
            return true;
        }
        return false;
    }

    /// The joints at psi within the limits, in the revolutions nearest to the present ones.
    Joints within_limits(const Branch& b, double psi) const noexcept {
        const Directions<double> d = directions(*b.motion, sin_cos(psi));
        Joints q = joints_within_limits(arm_, d, q_now_);
        MoveBox box;
        for (int j = 0; j < joints; ++j) {
            box.lower[j] = arm_.limits.lower[j] - q_now_[j];
            box.upper[j] = arm_.limits.upper[j] - q_now_[j];
        }
        for (const int h : hinge_joint)
            if (abs(d.y[h]) <= tolerance::one_axis) share_turn(arm_, h, d.x[h] < 0, q_now_, box, q);
        return q;
    }

    /// The solution nearest to the present joints in these branches (one bit each). With a free roll joint 7
    /// costs nothing and keeps its value.
    Nearest nearest_of(const Pose<double>& pose, unsigned branches) const noexcept {
        NearestOptions asked;
        asked.near = q_now_;
        asked.branches = branches;
        asked.allowed = options_.allowed;
        if (arm_.roll_free) asked.weight[joints - 1] = 0.0;
        Nearest found = nearest_posture(arm_, limits_, pose, asked);
        if (arm_.roll_free) found.q[joints - 1] = q_now_[joints - 1];
        return found;
    }

    /// The branches with the present sign of the elbow, one bit each.
    unsigned this_side() const noexcept {
        const int elbow = index(branch_[0].motion->gc) & 2;
        unsigned out = 0;
        for (int gc = 0; gc < configurations; ++gc) out |= (gc & 2) == elbow ? 1u << gc : 0u;
        return out;
    }

    /// Chooses the configuration at which a step under bounds aims; false if there is none. Normally it is at
    /// the present psi, so that the end effector reaches its pose before the policy moves the elbow. If psi
    /// is in a gap, or far away, it is the solution nearest to the joints, possibly in another branch. That
    /// solution is constant on the straight way there, while the nearer end of a gap may alternate
    /// indefinitely.
    bool choose_goal(const Pose<double>& pose, double psi, Joints& to) const noexcept {
        const Branch& own = branch_[0];
        double least = infinity;
        for (int i = 0; i < count_; ++i) {  // the own branch, and those that meet it here
            const Branch& b = branch_[i];
            if (b.status != Status::OK) continue;
            const Joints held = within_limits(b, nearest(*b.arcs, psi));
            const double way = largest_move(held.q, q_now_);
            if (!(way < least)) continue;
            least = way;
            to = held;
        }
        if (own.status != Status::OK) return least < infinity;
        // near a hinge at 0 an arc may hold psi only by rounding, with joints beyond a limit
        const bool within = limit_margin(arm_.limits, to.q) >= -tolerance::angle;
        if (within && contains(*own.arcs, psi) && !(least > StepTuning::far)) return true;
        Nearest found = nearest_of(pose, 1u << index(own.motion->gc));
        const bool may_change = options_.gc < 0 && !(limits_.margin > 0);
        if (may_change && !(largest_move(found.q, q_now_) <= StepTuning::far))
            found = nearest_of(pose, this_side());
        for (int j = 0; j < joint_slots && is_solved(found.status); ++j) to.q[j] = found.q[j];
        return true;
    }

    /// Writes a step to `out` that moves as far as it may towards a solution of the pose; false if there is
    /// none within `longest` (rad) of every joint.
    bool approach(const Pose<double>& pose, double psi, double longest, Step& out) const noexcept {
        Joints to{};
        if (!choose_goal(pose, psi, to) || !(largest_move(to.q, q_now_) <= longest)) return false;
        double way[joints];
        for (int j = 0; j < joints; ++j) way[j] = to.q[j] - q_now_[j];
        const double k = pace(way, bounds_.dt, bounds_.velocity, bounds_.acceleration);
        if (!(k > 0)) return false;
        go(way, k, out);
        return true;
    }

    /// Applies the displacements k d dt, each as far as the bounds allow.
    void go(const double (&d)[joints], double k, Step& out) const noexcept {
        detail::go(arm_, bounds_, q_now_, options_.max_joint_step, d, k, out.q);
        place(out);
    }

    /// The displacement (rad) of joint j (0..6) if it brakes as hard as it may, within its limits.
    double braked(int j) const noexcept { return detail::braked(arm_, bounds_, q_now_, j); }

    /// Sets psi and branch of the step from its joints.
    void place(Step& out) const noexcept {
        out.q[joints] = 0;
        const Posture there = forward(arm_, out.q);
        out.psi = there.psi;
        out.gc = there.gc;
    }

    /// Moves to the pose with its wrist moved into joint 4's reach. If limits forbid all its arm angles,
    /// moves to a configuration that no small change brings nearer to the pose.
    Step to_nearest(const Pose<double>& pose, Status why) noexcept {
        Step out;
        const Limits side = on_these_sides(arm_, branch_meetings(arm_), q_now_, limits_.margin, options_.gc);
        const MovedIntoReach drawn = move_into_reach(arm_, reach_shell(arm_, side), pose, now_.flange);
        BranchParts parts;
        double psi = 0;
        branch_[0] = begin(drawn.pose, psi, parts);
        if (exact(psi, out) || approach(drawn.pose, psi, pi, out)) return finished(Status::PARTIAL, why, out);
        Joints start;
        for (int j = 0; j < joints; ++j) start.q[j] = q_now_[j];
        start.q[joints] = 0;
        const double roll = arm_.roll_free ? roll_towards(user_pose(arm_, now_.flange), pose) : 0.0;
        const Pose<double> asked = arm_.roll_free ? turned_about_z(pose, sin_cos(roll)) : pose;
        const Joints to = relaxed(arm_, side, start, asked, StepTuning::length).at;
        double way[joints];
        for (int j = 0; j < joints; ++j) way[j] = to.q[j] - q_now_[j];
        if (arm_.roll_free) way[joints - 1] = 0.0;
        go(way, pace(way, bounds_.dt, bounds_.velocity, bounds_.acceleration), out);
        return finished(Status::PARTIAL, why, out);
    }

    /// The result without a new pose; if accelerations are bounded, every joint brakes.
    Step halted(const Circle<double>& c, Status why) const noexcept {
        bool moving = false;
        for (int j = 0; j < joints; ++j)
            moving |= bounds_.acceleration[j] < infinity && bounds_.velocity_now[j] != 0;
        if (!moving) return stayed(arm_, q_now_, now_, c, options_.dt, why);
        Step out;
        for (int j = 0; j < joints; ++j)
            out.q[j] = q_now_[j] + (bounds_.acceleration[j] < infinity ? braked(j) : 0.0);
        place(out);
        return finished(why, why, out);
    }

    /// Completes a step with its status and reason, and returns it.
    Step& finished(Status status, Status why, Step& out) const noexcept {
        complete(arm_, q_now_, options_.dt, status, why, out);
        return out;
    }

    const Arm& arm_;
    const LimitTable& limits_;
    const double* q_now_;
    const Chain& now_;
    const StepOptions& options_;
    const Bounds& bounds_;
    Branch branch_[4];  // the first is that of the joints
    BranchParts beside_[3];
    int count_ = 1;
};

/// The step by the alternatives of StepFallback, whose operator() explains psi and own; kept out of line.
[[gnu::noinline]] inline Step step_by_fallback(const Arm& arm, const LimitTable& limits, const double* q_now,
                                               const Chain& now, const Pose<double>& pose,
                                               const StepOptions& options, double psi = 0,
                                               const Branch* own = nullptr) noexcept {
    return StepFallback(arm, limits, q_now, now, options)(pose, psi, own);
}

}  // namespace detail

/// The step from q_now, whose frames are `now`, to a user's `pose`. BAD_INPUT if the pose is not rigid or
/// q_now not finite.
inline Step step_from(const Arm& arm, const LimitTable& limits, const double* q_now, const Chain& now,
                      const Pose<double>& pose, const StepOptions& options) noexcept {
    const JointLanes here = joint_lanes(q_now);
    if (!is_rigid(pose) || !is_finite(here)) return detail::refused(arm, q_now, options.dt);
    if (options.bounds || options.allowed || options.scene)
        return detail::step_by_fallback(arm, limits, q_now, now, pose, options);
    const SelfMotion<double> m = detail::motion_from(arm, q_now, now, pose, options.gc);
    const double psi = detail::carried_psi(arm, now, m.circle, options.carry);
    const JointFunctions<double> f = joint_functions(m);
    ArcSet arcs;
    Resolution next{psi, feasible(m, f, limits, arcs)};
    if (next.status == Status::OK) {
        next = resolve(detail::policy_on(options, arm, m), arcs, psi);
        detail::Lifted to;
        if (next.status == Status::OK &&
            detail::is_step(arm, m, next.psi, here, options.max_joint_step, to) &&
            !detail::may_sweep(detail::singularity_sine(now.theta[1], now.theta[5]), options) &&
            !detail::may_leave(now, options.policy)) [[likely]]
            return detail::stepped(to, q_now, options.dt, next.psi, index(m.gc));
    }
    const detail::Branch own{&m, &f, &arcs, &arcs, &arcs, &arcs, next.status, next.psi};
    return detail::step_by_fallback(arm, limits, q_now, now, pose, options, psi, &own);
}

/// Computes the step from joints q_now to `pose`: one pass of fig. 10.
inline Step step(const Arm& arm, const LimitTable& limits, const double* q_now, const Pose<double>& pose,
                 const StepOptions& options) noexcept {
    return step_from(arm, limits, q_now, chain(arm, q_now), pose, options);
}

/// Distance (m) between the end effector of a chain and a pose.
inline double position_error(const Arm& arm, const Chain& now, const Pose<double>& pose) noexcept {
    return norm(user_pose(arm, now.flange).position - pose.position);
}

}  // namespace armangle

#include "../names/end.hpp"
