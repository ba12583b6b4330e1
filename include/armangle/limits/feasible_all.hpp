// Feasible arcs of a user's pose, in one branch or in all eight.
//
// Arcs of psi decide feasibility if psi has enough digits. If a branch has isolated psi alone, or no psi and
// a nearly straight hinge, possible.hpp excludes most branches. What remains is searched on the joints
// themselves, with one number of rounds for all branches. The search uses the code of nearest_posture(), so
// arcs, freedom and nearest solutions agree whether a solution exists.
#pragma once

#include "nearest_search.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Whether the feasible set must be searched on the joints instead of psi. This is so if no arc is wider than
/// the tolerance and isolated psi may be wrong or missing; if joints may `meet` at their limits at a psi near
/// arcs; or if a joint violates its limit at every psi by less than the tolerance. The paper's own avoidance
/// concerns psi, not configurations.
inline bool needs_joint_search(const LimitTable& t, const ArcSet& arcs, const Left& left, bool hides,
                               bool meet) noexcept {
    if (t.psi_margin > 0) return false;
    if (meet || left.beyond) return true;
    for (int i = 0; i < arcs.count; ++i)
        if (arcs.full || !is_isolated(arcs.arc[i])) return false;
    return !arcs.empty() || (hides && (left.status == Status::LIMITS || left.status == Status::ELBOW_LIMIT));
}

/// Whether a branch may have solutions that arcs miss. The joint functions are used only if the elbow permits
/// the pose.
inline bool may_hide(const LimitTable& t, const Circle<double>& c, Status status,
                     const JointFunctions<double>& f) noexcept {
    if (status == Status::OK || status == Status::LIMITS) return may_hide(t, c, f);
    return status == Status::ELBOW_LIMIT && is_about_straight(t, c);
}

/// The state of the search on the joints for one pose: any solution in any branch, searched once when a
/// branch first needs it, and the number of rounds left for all branches.
struct Hidden {
    bool asked = false;
    int rounds = NearestTuning::local_rounds;
    Nearest found;
};

/// Writes the arcs of a branch that the search on the joints finds to `out`. Returns OK, NEAR_SINGULAR if the
/// search was cut short, or the reason why there are none. If `any` knows that no branch has a solution, this
/// one has none.
[[gnu::noinline, gnu::cold]] inline Status solve_by_joints(const Arm& arm, const Pose<double>& pose, int gc,
                                                           const LimitTable& t, const Left& left, bool hides,
                                                           Hidden& any, ArcSet& out) noexcept {
    NearestOptions options;
    options.branches = 1u << gc;
    NearestSearch search(arm, t, pose, options, any.rounds);
    search.keep_held(gc, left.beyond, out);
    if (out.empty() && hides) {
        if (!any.asked) {
            any.asked = true;
            any.found = NearestSearch(arm, t, pose, {}, any.rounds).some();
        }
        if (any.found.status == Status::OK)
            search.put_in(gc, any.found.gc == gc ? any.found : search.some(), out);
    }
    if (!out.empty()) return Status::OK;
    if (any.rounds < 0) return Status::NEAR_SINGULAR;  // the search was cut short
    return left.status == Status::OK ? Status::LIMITS : left.status;
}

/// Completes the status in `left` and the arcs of a branch; searches on the joints if rounding may hide
/// solutions, and keeps in `any` what other branches need of that.
inline void tell_branch(const Arm& arm, const Pose<double>& pose, const Circle<double>& c,
                        const LimitTable& t, int gc, const JointFunctions<double>& f, Hidden& any, Left& left,
                        ArcSet& arcs) noexcept {
    const bool bends = left.status == Status::OK || left.status == Status::LIMITS;  // by the elbow
    const bool meet = bends && may_meet(c, f, left.gap, arcs.empty()), hides = may_hide(t, c, left.status, f);
    if (!needs_joint_search(t, arcs, left, hides, meet)) [[likely]]
        return;
    if (arcs.empty()) {
        ArcSet may;
        possible(arm, t, self_motion(arm, c, configuration(gc)), may);
        if (may.empty()) return;
    }
    left.status = solve_by_joints(arm, pose, gc, t, left, hides, any, arcs);
}

/// The slow part of feasible(): computes the arcs of a branch again into `out`, and searches on the joints
/// where rounding may hide solutions. Returns OK, or the reason if `out` is empty.
[[gnu::noinline, gnu::cold]] inline Status feasible_again(const Arm& arm, const Pose<double>& pose, int gc,
                                                          const LimitTable& t, ArcSet& out) noexcept {
    const SelfMotion<double> m = self_motion(arm, pose, gc);
    const JointFunctions<double> f = joint_functions(m);
    Left left{elbow_status(m, t), false, infinity};
    make_empty(out);
    Hidden any;
    if (left.status == Status::OK) {
        Blocked blocked;
        left = free_of_all(f, t, blocked, out);
        if (left.may_isolate) left.status = add_isolated(t, m, f, f, blocked, out);
    }
    tell_branch(arm, pose, m.circle, t, gc, f, any, left, out);
    return left.status;
}

}  // namespace detail

/// Computes the feasible arcs of a user's pose in branch gc, 0..7. If there are none, the status gives the
/// reason.
ARMANGLE_INLINE Status feasible(const Arm& arm, const Pose<double>& pose, int gc, const LimitTable& t,
                                ArcSet& out) noexcept {
    const SelfMotion<double> m = self_motion(arm, pose, gc);
    const JointFunctions<double> f = joint_functions(m);
    const Status elbow = elbow_status(m, t);
    make_empty(out);
    if (elbow != Status::OK)
        return elbow == Status::ELBOW_LIMIT ? detail::feasible_again(arm, pose, gc, t, out) : elbow;
    Blocked blocked;
    const bool bent = detail::is_bent(t, m.circle, f);
    const detail::Left left = detail::free_of_all(f, t, blocked, out);
    if (!left.may_isolate && !left.beyond && (bent || !out.empty()) && left.gap > NearestTuning::poor)
        [[likely]]
        return left.status;
    return detail::feasible_again(arm, pose, gc, t, out);
}

/// Computes the feasible arcs of a user's pose in all eight branches; the same sets as eight calls of
/// feasible().
inline void feasible_all(const Arm& arm, const Pose<double>& pose, const LimitTable& t,
                         AllArcs& out) noexcept {
    const Circle<double> on = circle(arm, flange_pose(arm, pose));
    detail::Hidden any;
    for (int side = 0; side < 2; ++side) {
        SelfMotion<double> m = self_motion(arm, on, configuration(2 * side));
        const Status status = elbow_status(m, t);
        detail::Sides sides[2];
        for (int negative = 0; status == Status::OK && negative < 2; ++negative) {
            m.gc.shoulder = m.gc.wrist = negative ? -1.0 : 1.0;
            detail::block_sides(t, m, all_pivots, sides[negative]);
        }
        for (int branch = 0; branch < 4; ++branch) {
            const int shoulder = branch & 1, wrist = branch >> 1, gc = shoulder + 2 * side + 4 * wrist;
            ArcSet& arcs = out.arcs[gc];
            make_empty(arcs);
            detail::Left left{status, false, infinity};
            if (status == Status::OK) {
                Blocked both = sides[shoulder].shoulder;
                detail::append(sides[wrist].wrist, both);
                const JointFunctions<double>&of_shoulder = sides[shoulder].f, &of_wrist = sides[wrist].f;
                left = detail::finish(t, of_shoulder, of_wrist, both, arcs);
                if (left.may_isolate) [[unlikely]]
                    left.status = detail::add_isolated(t, m, of_shoulder, of_wrist, both, arcs);
            }
            detail::tell_branch(arm, pose, on, t, gc, sides[shoulder].f, any, left, arcs);
            out.status[gc] = left.status;
        }
    }
}

}  // namespace armangle

#include "../names/end.hpp"
