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

}  // namespace armangle

#include "../names/end.hpp"
