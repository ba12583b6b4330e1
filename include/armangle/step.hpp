// One pass of fig. 10, from the present joints to the next: arcs, eq. (36), inverse, and the checks of continuity.
#pragma once

#include "arm_angle.hpp"
#include "bounds.hpp"
#include "feasible.hpp"
#include "resolution.hpp"

namespace armangle {

/// What is carried from one pose to the next: the number psi (the paper), or the elbow axis itself.
enum class Carry : std::uint8_t { psi, elbow };

struct StepOptions {
    Policy policy;
    Carry carry = Carry::psi;
    double max_joint_step = 0.2;      // rad; a larger move of any joint is JOINT_JUMP
    int gc = -1;                      // 0..7, or -1: that of the present joints
    const ArcSet* allowed = nullptr;  // arcs of the user's own, intersected
    const Bounds* bounds = nullptr;   // on speeds and accelerations
    const ArcSet* ahead = nullptr;    // with bounds: the part of the arcs from which the poses ahead can be reached
};

/// On any status but OK, q is the present posture and residual its distance from the pose.
struct Step {
    double q[joint_slots];
    double psi;       // in (-pi, pi]
    int gc;
    Status status;
    double margin;    // rad: least distance of a joint of q to one of its limits, negative outside
};

/// Whether all seven joint values are finite, and not beyond any sense.
inline bool is_finite(const double* q) noexcept {
    using Slots = Lane<joint_slots>;
    return all(abs(joint_lanes(q)) <= Slots(tolerance::largest_angle));
}

/// Least distance to a limit over all joints; infinite without limits, NaN where a joint is.
inline double limit_margin(const Arm& arm, const double* q) noexcept {
    using Slots = Lane<joint_slots>;
    const Slots at = joint_lanes(q);
    if (any(!(at == at))) return not_a_number;
    return least(min(at - Slots::load(arm.joint_lower), Slots::load(arm.joint_upper) - at));
}

inline bool within_limits(const Arm& arm, const double* q, double slack) noexcept { return limit_margin(arm, q) >= -slack; }

namespace detail {

inline double largest_move(const double* a, const double* b) noexcept {
    const Lane<joint_slots> move = joint_lanes(a) - joint_lanes(b);
    return any(!(move == move)) ? not_a_number : -least(-abs(move));  // min would pass over a NaN
}

/// psi of the present posture, as it is to be carried to the circle of the next pose.
inline double carried_psi(const Arm& arm, const Chain& now, const Circle<double>& next, Carry carry) noexcept {
    if (carry == Carry::elbow) return arm_angle(next, now.z3);
    const Triad<double> here = triad(arm, flange_pose(arm, user_pose(arm, now.flange)));
    return is_folded(arm, here) ? arm_angle(next, now.z3) : arm_angle(here, now.z3);
}

/// Joints, and the least distance of one to its limits.
struct Wound {
    Joints q;
    double margin;
};

/// The joints next to q_now. A joint that would leave its range has no turn left if the range is a full turn or more;
/// a narrower one has its only turn within the limits, however far that is.
inline Status choose_windings(const Arm& arm, const Directions<double>& d, const double* q_now, Wound& out) noexcept {
    out.q = joints_near(arm, d, q_now);
    out.margin = limit_margin(arm, out.q.q);
    if (out.margin >= -tolerance::angle) return Status::OK;
    const Joints inside = joints_within_limits(arm, d, q_now);
    for (int i = 0; i < joints; ++i)
        if (abs(inside.q[i] - out.q.q[i]) > pi && !(arm.upper[i] - arm.lower[i] < two_pi)) return Status::WINDING_EXHAUSTED;
    out.q = inside;
    out.margin = limit_margin(arm, out.q.q);
    return out.margin >= -tolerance::angle ? Status::OK : Status::LIMITS;
}

/// No step: q_now as it came, psi NaN.
inline Step refused(const Arm& arm, const double* q_now) noexcept {
    Step out{};
    for (int i = 0; i < joints; ++i) out.q[i] = q_now[i];
    out.psi = not_a_number, out.gc = -1, out.status = Status::BAD_INPUT, out.margin = limit_margin(arm, q_now);
    return out;
}

/// The psi that the policy wants of what is `ahead`, in the arc that holds psi if there is some; NaN if nothing is.
inline double wish_ahead(const StepOptions& options, const ArcSet& arcs, double psi) noexcept {
    if (!options.ahead || options.ahead->empty()) return not_a_number;
    Policy policy = options.policy;
    policy.outside = Outside::nearest;
    const Place place = find(arcs, psi);
    if (place.index < 0 || contains(*options.ahead, psi)) return resolve(policy, *options.ahead, psi).psi;
    ArcSet here, near;
    make_empty(here);
    here.arc[here.count++] = arcs.arc[place.index], here.full = arcs.full;
    intersect(here, *options.ahead, near);
    return resolve(policy, near.empty() ? *options.ahead : near, psi).psi;
}

/// The psi that the policy wants, or the nearest to it that keeps the bounds: of what is `ahead`, else of the arcs.
[[gnu::noinline]] inline Resolution resolve_bounded(const BoundedStep& step, const StepOptions& options, const ArcSet& arcs, double psi,
                                                    double wish) noexcept {
    ArcSet within, further;
    const double there = wish_ahead(options, arcs, psi);
    if (there == there) {
        if (step.keeps(there)) return {there, Status::OK};
        step.within(*options.ahead, {}, further);
        const double found = step.nearest(further, there);
        if (found == found) return {found, Status::OK};
        wish = there;
    }
    if (step.keeps(wish)) return {wish, Status::OK};
    step.within(arcs, {}, within);
    const double found = step.nearest(within, wish);
    if (found == found) return {found, Status::OK};
    return {psi, step.refusal(arcs)};
}

/// Where the policy asks for more than the largest step: the psi nearest to its wish that fits, if the held psi does.
/// What the pose alone forces stays a jump.
[[gnu::noinline]] inline Resolution shortened(const BoundedStep& step, const ArcSet& arcs, double psi, double wish) noexcept {
    const Place held = find(arcs, psi);
    if (held.index < 0 || !step.keeps(held.psi)) return {psi, Status::JOINT_JUMP};
    ArcSet within;
    step.within(arcs, {}, within);
    const double found = step.nearest(within, wish);
    return {found == found ? found : wrap(held.psi), Status::OK};
}

}  // namespace detail

/// The step from q_now, whose chain is `now`, to `pose` (as the user sees it).
inline Step step_from(const Arm& arm, const LimitTable& limits, const double* q_now, const Chain& now, const Pose<double>& pose,
                      const StepOptions& options) noexcept {
    if (!is_rigid(pose) || !is_finite(q_now)) return detail::refused(arm, q_now);
    const Circle<double> c = circle(arm, flange_pose(arm, pose));
    const Configuration<double> gc = options.gc < 0 ? configuration(arm, now.theta) : configuration(options.gc);
    Step out{};
    for (int i = 0; i < joints; ++i) out.q[i] = q_now[i];
    const auto stay = [&](Status why) {
        out.status = why, out.gc = index(configuration(arm, now.theta)), out.margin = limit_margin(arm, q_now);
        out.psi = detail::carried_psi(arm, now, c, Carry::psi);
        return out;
    };
    const double psi = detail::carried_psi(arm, now, c, options.carry);
    const Fold<double> bend = fold(arm, c.triangle, gc.elbow);
    ArcSet arcs;
    const Status reason = feasible(arm, limits, c, bend, joint_functions(c, bend, gc), arcs);
    if (reason != Status::OK) return stay(reason);
    if (options.allowed) {
        const ArcSet own = arcs;
        intersect(own, *options.allowed, arcs);
    }
    Resolution next = resolve(options.policy, arcs, psi);
    if (options.bounds && next.status == Status::OK) {
        const BoundedStep bounded{arm, c, bend, gc, joint_functions(c, bend, gc), q_now, *options.bounds, options.max_joint_step};
        next = detail::resolve_bounded(bounded, options, arcs, psi, next.psi);
    }
    if (next.status != Status::OK) return stay(next.status);
    detail::Wound to;
    const auto joints_at_next = [&] { return detail::choose_windings(arm, directions(c, bend, gc, sin_cos(next.psi)), q_now, to); };
    Status move = joints_at_next();
    if (move == Status::OK && !(detail::largest_move(to.q.q, q_now) <= options.max_joint_step)) {
        const BoundedStep unbounded{arm, c, bend, gc, joint_functions(c, bend, gc), q_now, no_bounds, options.max_joint_step};
        next = detail::shortened(unbounded, arcs, psi, next.psi);
        move = next.status == Status::OK ? joints_at_next() : next.status;
    }
    if (move != Status::OK) return stay(move);
    for (int i = 0; i < joints; ++i) out.q[i] = to.q.q[i];
    out.psi = next.psi, out.gc = index(gc), out.status = Status::OK;
    out.margin = to.margin;
    return out;
}

/// The step from q_now to `pose`: one pass of fig. 10.
inline Step step(const Arm& arm, const LimitTable& limits, const double* q_now, const Pose<double>& pose,
                 const StepOptions& options) noexcept {
    return step_from(arm, limits, q_now, chain(arm, q_now), pose, options);
}

/// Distance (m) between the tool of a posture's chain and a pose.
inline double position_error(const Arm& arm, const Chain& now, const Pose<double>& pose) noexcept {
    return norm(user_pose(arm, now.flange).position - pose.position);
}

}  // namespace armangle
