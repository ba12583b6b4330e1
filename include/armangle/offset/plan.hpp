// A whole path of an arm with an offset wrist or shoulder: planned and proven as family_planner.hpp does for
// any closed form. As plan/ this allocates.
#pragma once

#include "../plan/family_planner.hpp"
#include "offset_family.hpp"
#include "psi_towards.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Plans a path like plan() for an S-R-S arm. `phi` of the stretches is the value of the free joint, and so
/// are the target for psi and the arcs of the user. A singularity margin and a free roll are ignored.
inline Plan plan(const OffsetArm& arm, const Segment* segments, std::size_t n, const PlanOptions& options,
                 const FamilyTuning& tuning = {}) {
    const OffsetFamily family(arm);
    const auto planned = [&](const PlanOptions& asked) {
        return detail::FamilyPlanner(family, segments, n, asked, tuning).run();
    };
    return detail::fastest(options, planned, [&](const Plan& x) {
        return FamilyCurve<OffsetFamily>{family, x.gc, {segments, n}, x.stretches};
    });
}

}  // namespace armangle

#include "../names/end.hpp"
