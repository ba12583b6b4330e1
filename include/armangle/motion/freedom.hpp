// The redundancy left to a pose of any arm with one redundant joint, from its proven intervals.
#pragma once

#include "../self_motion/freedom_of.hpp"
#include "stepping_family.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Writes the arcs of all branches within the arm's limits to `found`, and returns their freedom. If those of
/// a branch do not tell whether it solves the pose, whose rotation is exact, a search for a solution does.
template <stepping_family F>
Freedom freedom_of(const F& family, const Pose<double>& exact, ProvenArcs (&found)[configurations]) noexcept {
    for (int gc = 0; gc < configurations; ++gc) family.arcs(exact, gc, family.rows().limits, found[gc]);
    return freedom_of(found, [&](int gc) noexcept {
        NearestOptions one;
        one.branches = 1u << gc;
        return is_solved(family.nearest(exact, one, nullptr).status);
    });
}

}  // namespace detail

/// Returns which branches hold a pose, and over how much of the free number.
template <stepping_family F>
Freedom freedom(const F& family, const Pose<double>& pose) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    ProvenArcs found[configurations];
    return detail::freedom_of(family, exact, found);
}

/// Whether any branch and value of the free number solves a pose within the limits. If no branch has an
/// interval, a search for a solution decides about those that are not excluded.
template <stepping_family F>
bool is_reachable(const F& family, const Pose<double>& pose) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    NearestOptions open;
    open.branches = 0;
    ProvenArcs found;
    for (int gc = 0; gc < configurations; ++gc) {
        family.arcs(exact, gc, family.rows().limits, found);
        if (!found.arcs.empty()) return true;
        if (found.unproven > 0) open.branches |= 1u << gc;
    }
    return open.branches != 0 && is_solved(family.nearest(exact, open, nullptr).status);
}

}  // namespace armangle

#include "../names/end.hpp"
