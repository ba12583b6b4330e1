// The solution that an arm goes to if a target at rest is not reached.
//
//   the target rests ------> after some time, one branch a cycle ------> straight there, and kept
//                            the solution nearest in time                until the target moves
//
// The limits are a box, so that a straight joint motion between two configurations always stays within them.
// If nothing stands about, a target that has a solution is therefore reached, whatever came before.
#pragma once

#include "../limits/nearest_search.hpp"
#include "../scene/clear.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The solution of a target at rest that was chosen, or how far the search for it is.
struct RestingChoice {
    // being searched; found; the arm goes there or stays there; there is none; it no longer binds the arm
    enum State : int { open, found, taken, none, left };

    int state = open;
    int asked = 0;           // branches that were asked
    int home = 0;            // the branch of the arm when the target came to rest
    int why = 0;             // Status: why it is not a solution, but the nearest that was found
    double gap = 0;          // m: of that one
    double rested = 0;       // s for which the target has rested
    double cost = infinity;  // of the best solution so far: distance weighted by the joints' velocities, s
    Joints at{};             // that solution

    /// Calls `visit` for the state that one cycle passes to the next, to save or restore it (saved.hpp).
    template <class Visit>
    void each_number(Visit& visit) {
        visit.within(state, open, left);
        visit.within(asked, 0, configurations);
        visit.within(home, 0, configurations - 1);
        visit.within(why, 0, status_count - 1);
        visit.all(rested, gap, cost, at);
    }
};

/// The collision-free solution of a target in branch gc within these limits that is nearest to options.near
/// by options.weight. options.branches must permit gc alone.
inline Nearest resting_solution(const Arm& arm, const Limits& limits, const Scene* scene,
                                const Pose<double>& pose, int gc, NearestOptions options) noexcept {
    const LimitTable table = limit_table(arm, limits);
    ArcSet open;
    if (scene) {
        const SelfMotion<double> m = self_motion(arm, pose, gc);
        ArcSet own;
        make_empty(open);
        options.clear[gc] = &open;
        options.blocked[gc] = feasible(m, joint_functions(m), table, own);
        if (options.blocked[gc] == Status::OK) options.blocked[gc] = keep_clear(arm, *scene, m, own, open);
    }
    return nearest_posture(arm, table, pose, options);
}

namespace detail {

inline constexpr int resting_samples = 48;  // of the whole circle

/// The solution of branch gc nearest to options.near by options.weight among a bounded number on given arcs:
/// the middles of equal parts, and the one nearest to the present value `held`. LIMITS if none is within the
/// limits. Of the result only status, distance and joints are set. The minimum over all is not searched for.
template <class AnyArm>
Nearest sampled_solution(const AnyArm& arm, const Limits& limits, const Pose<double>& pose, int gc,
                         const ArcSet& arcs, double held, const NearestOptions& options) noexcept {
    Nearest best{};
    best.status = Status::LIMITS;
    best.distance = infinity;
    const auto offer = [&](double at) {
        const Inverse one = inverse(arm, pose, wrap(at), gc, options.near);
        if (one.status != Status::OK || !within_limits(limits, one.q, tolerance::angle)) return;
        double cost = 0;
        for (int j = 0; j < joints; ++j) {
            const double off = one.q[j] - options.near[j];
            cost += options.weight[j] * off * off;
        }
        cost = sqrt(cost);
        if (!(cost < best.distance)) return;
        best.status = Status::OK;
        best.distance = cost;
        for (int j = 0; j < joints; ++j) best.q[j] = min(max(one.q[j], limits.lower[j]), limits.upper[j]);
    };
    for (int i = 0; i < arcs.count; ++i) {
        const Arc& arc = arcs.arc[i];
        const int parts = 1 + static_cast<int>((arc.upper - arc.lower) * resting_samples / two_pi);
        for (int k = 0; k < parts; ++k) offer(arc.lower + (k + 0.5) * (arc.upper - arc.lower) / parts);
    }
    const double own = nearest(arcs, held);
    if (!is_nan(own)) offer(own);
    return best;
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
