// The redundancy left to a pose of any arm with one redundant joint, from its proven intervals.
#pragma once

#include "../self_motion/freedom_of.hpp"
#include "stepping_family.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Returns which branches hold a pose, and over how much of the free number. If the intervals of a branch do
/// not tell, a search for a solution does.
template <stepping_family F>
Freedom freedom(const F& family, const Pose<double>& pose) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    ProvenArcs found[configurations];
    for (int gc = 0; gc < configurations; ++gc) family.arcs(exact, gc, family.rows().limits, found[gc]);
    return detail::freedom_of(found, [&](int gc) noexcept {
        NearestOptions one;
        one.branches = 1u << gc;
        return is_solved(family.nearest(exact, one, nullptr).status);
    });
}

}  // namespace armangle

#include "../names/end.hpp"
