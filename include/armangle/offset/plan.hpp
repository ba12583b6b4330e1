// A whole path of an arm with an offset wrist or shoulder: planned and proven as family_planner.hpp does for
// any closed form. As plan/ this allocates.
#pragma once

#include "../plan/family_planner.hpp"
#include "offset_family.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Plans a path like plan() for an S-R-S arm. `phi` of the stretches is the value of the free joint, and so
/// is the target for psi. These options are ignored: several scenes, arcs of the user, duration, a
/// singularity margin, a free roll, and a target for the elbow.
inline Plan plan(const OffsetArm& arm, const Segment* segments, std::size_t n, const PlanOptions& options,
                 const FamilyTuning& tuning = {}) {
    const Scene* const scene = options.scenes.count > 0 ? &options.scenes[0] : nullptr;
    return detail::FamilyPlanner(OffsetFamily(arm, scene), segments, n, options, tuning).run();
}

}  // namespace armangle

#include "../names/end.hpp"
