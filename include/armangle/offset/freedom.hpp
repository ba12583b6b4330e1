// The redundancy left to a pose of an arm with an offset: which branches hold it, over how much of the free
// joint.
//
// Intervals decide, but for what they leave unproven (feasible.hpp): there a search for a posture does.
#pragma once

#include "../self_motion/freedom_of.hpp"
#include "nearest_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Takes the place of the LimitTable of an S-R-S arm. An arm with an offset uses the limits and the margin
/// in its own parameters.
struct OffsetLimits {};
/// Does nothing: these arms have no table of limits.
inline OffsetLimits limit_table(const OffsetArm&, double) noexcept { return {}; }

namespace detail {

/// A solution in one of the branches whose bits are set, by search; its status says whether there is one.
[[gnu::noinline, gnu::cold]] inline Nearest find_any(const OffsetArm& arm, const Pose<double>& pose,
                                                     unsigned branches) noexcept {
    NearestOptions asked;
    asked.branches = branches;
    return nearest_posture(arm, pose, asked);
}

/// Computes the freedom from the arcs of each branch, within the limits of the arm.
inline Freedom freedom_of(const OffsetArm& arm, const Pose<double>& pose,
                          const ProvenArcs (&found)[configurations]) noexcept {
    return freedom_of(found,
                      [&](int gc) noexcept { return is_solved(find_any(arm, pose, 1u << gc).status); });
}

}  // namespace detail

/// Computes the freedom of a user's pose within the limits of the arm.
inline Freedom freedom(const OffsetArm& arm, const Pose<double>& pose, OffsetLimits) noexcept {
    ProvenArcs found[configurations];
    feasible_all(arm, pose, arm.own.limits, found);
    return detail::freedom_of(arm, pose, found);
}

/// Whether any branch and value of the free joint solves a pose within the limits.
inline bool is_reachable(const OffsetArm& arm, const Pose<double>& pose, OffsetLimits) noexcept {
    const OffsetArcsTuning tuning;
    detail::OffsetArcs all(arm, pose, arm.own.limits, tuning);
    unsigned open = 0;
    ProvenArcs found;
    for (int gc = 0; gc < configurations; ++gc) {
        all.find(gc, configurations - gc, found);
        if (!found.arcs.empty()) return true;
        open |= found.unproven > 0 ? 1u << gc : 0u;
    }
    return open != 0 && is_solved(detail::find_any(arm, pose, open).status);
}

}  // namespace armangle

#include "../names/end.hpp"
