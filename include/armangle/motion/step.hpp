// One pass of fig. 10, from the present joints to the next: arcs, eq. (36), inverse, and the checks of
// continuity.
#pragma once

#include "../circle/posture.hpp"
#include "bounds.hpp"
#include "../limits/feasible.hpp"
#include "../scene/clear.hpp"
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
    const Scene* scene = nullptr;     // obstacles that links keep clear of
    const Bounds* bounds = nullptr;   // on speeds and accelerations
    const ArcSet* ahead =
        nullptr;  // with bounds: the part of the arcs from which the poses ahead can be reached
};

/// On any status but OK, q is the present posture.
struct Step {
    double q[joint_slots];
    double psi;  // in (-pi, pi]
    int gc;
    Status status;
    double margin;  // rad: least distance of a joint of q to one of its limits, negative outside
};

namespace detail {

/// psi of the present posture, as it is to be carried to the circle of the next pose.
inline double carried_psi(const Arm& arm, const Chain& now, const Circle<double>& next,
                          Carry carry) noexcept {
    Triad<double> on = triad(arm, flange_pose(arm, user_pose(arm, now.flange)));
    if (carry == Carry::elbow || is_folded(on)) on = next;
    return arm_angle(on, now.z3);
}

/// Joints, and the least distance of one to its limits.
struct Lifted {
    JointLanes q;
    double margin;
};

/// The joints next to q_now. A joint that would leave its range has no turn left if the range is a full turn
/// or more; a narrower one has its only turn within the limits, however far that is.
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

/// No step: the present posture, and why.
[[gnu::noinline]] inline Step stayed(const Arm& arm, const double* q_now, const Chain& now,
                                     const Circle<double>& c, Status why) noexcept {
    Step out{};
    for (int i = 0; i < joints; ++i) out.q[i] = q_now[i];
    out.psi = carried_psi(arm, now, c, Carry::psi);
    out.gc = index(configuration(arm, now.theta));
    out.status = why;
    out.margin = limit_margin(arm.limits, q_now);
    return out;
}

/// No step: q_now as it came, psi NaN.
[[gnu::noinline]] inline Step refused(const Arm& arm, const double* q_now) noexcept {
    Step out{};
    for (int i = 0; i < joints; ++i) out.q[i] = q_now[i];
    out.psi = not_a_number;
    out.gc = -1;
    out.status = Status::BAD_INPUT;
    out.margin = limit_margin(arm.limits, q_now);
    return out;
}

/// The psi that the policy wants of what is `ahead`, in the arc that holds psi if there is some; NaN if
/// nothing is.
inline double wish_ahead(const StepOptions& options, const ArcSet& arcs, double psi) noexcept {
    if (!options.ahead || options.ahead->empty()) return not_a_number;
    Policy policy = options.policy;
    policy.outside = Outside::nearest;
    const Place place = find(arcs, psi);
    if (place.index < 0 || contains(*options.ahead, psi)) return resolve(policy, *options.ahead, psi).psi;
    ArcSet here, near;
    make_empty(here);
    here.arc[here.count++] = arcs.arc[place.index];
    here.full = arcs.full;
    intersect(here, *options.ahead, near);
    return resolve(policy, near.empty() ? *options.ahead : near, psi).psi;
}

/// The psi that the policy wants, or the nearest to it that keeps the bounds: of what is `ahead`, else of the
/// arcs.
[[gnu::noinline]] inline Resolution resolve_bounded(const BoundedStep& step, const StepOptions& options,
                                                    const ArcSet& own, const ArcSet& arcs, double psi,
                                                    double wish) noexcept {
    ArcSet within, further;
    const double there = wish_ahead(options, arcs, psi);
    if (!is_nan(there)) {
        if (step.keeps(there)) return {there, Status::OK};
        step.within(*options.ahead, {}, further);
        const double found = step.nearest(further, there);
        if (!is_nan(found)) return {found, Status::OK};
        wish = there;
    }
    if (step.keeps(wish)) return {wish, Status::OK};
    step.within(arcs, {}, within);
    const double found = step.nearest(within, wish);
    if (!is_nan(found)) return {found, Status::OK};
    return {psi, step.refusal(own, arcs)};
}

}  // namespace detail

/// The step from q_now, whose chain is `now`, to `pose` (as the user sees it).
inline Step step_from(const Arm& arm, const LimitTable& limits, const double* q_now, const Chain& now,
                      const Pose<double>& pose, const StepOptions& options) noexcept {
    const JointLanes here = joint_lanes(q_now);
    if (!is_rigid(pose) || !is_finite(here)) return detail::refused(arm, q_now);
    const SelfMotion<double> m =
        self_motion(arm, pose, options.gc < 0 ? configuration(arm, now.theta) : configuration(options.gc));
    const auto stay = [&](Status why) { return detail::stayed(arm, q_now, now, m.circle, why); };
    const double psi = detail::carried_psi(arm, now, m.circle, options.carry);
    const JointFunctions<double> f = joint_functions(m);
    ArcSet own, arcs, clear_arcs;
    const Status reason = feasible(m, f, limits, own);
    if (reason != Status::OK) return stay(reason);
    if (options.allowed) {
        intersect(own, *options.allowed, arcs);
        if (arcs.empty()) return stay(Status::NOT_ALLOWED);
    }
    const ArcSet& asked_for = options.allowed ? arcs : own;  // whatever stands about
    if (options.scene) {
        const Status blocked = keep_clear(arm, *options.scene, m, asked_for, clear_arcs);
        if (blocked != Status::OK) return stay(blocked);
    }
    const ArcSet& open = options.scene ? clear_arcs : asked_for;
    StepOptions with_psi;  // a wish for the elbow, as one for psi
    const bool wished = options.policy.rule == Rule::towards;
    if (wished) {
        with_psi = options;
        with_psi.policy = settled(options.policy, arm, m);
    }
    const StepOptions& asked = wished ? with_psi : options;
    Resolution next = resolve(asked.policy, open, psi);
    if (next.status != Status::OK) return stay(next.status);
    const auto within_bounds = [&](const Bounds& bounds) {
        const BoundedStep bounded{arm, m, f, q_now, bounds, options.max_joint_step};
        next = detail::resolve_bounded(bounded, asked, own, open, psi, next.psi);
        if (options.scene && next.status == Status::NOT_ALLOWED && bounded.leads_to(asked_for))
            next.status = Status::CLEARANCE;
    };
    if (options.bounds) within_bounds(*options.bounds);
    if (next.status != Status::OK) return stay(next.status);
    detail::Lifted to;
    next.status = detail::choose_windings(arm, directions(m, sin_cos(next.psi)), here, to);
    if (next.status != Status::OK || !(detail::largest_move(to.q, here) <= options.max_joint_step)) {
        within_bounds(options.bounds ? *options.bounds : no_bounds);
        if (next.status != Status::OK) return stay(next.status);
        next.status = detail::choose_windings(arm, directions(m, sin_cos(next.psi)), here, to);
    }
    if (next.status != Status::OK) return stay(next.status);
    Step out;
    to.q.store(out.q);
    out.psi = next.psi;
    out.gc = index(m.gc);
    out.status = Status::OK;
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
