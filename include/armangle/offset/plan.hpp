// A whole path of an arm with an offset wrist or shoulder: planned and proven as family_planner.hpp does for
// any closed form. As plan/ this allocates.
#pragma once

#include "../plan/family_planner.hpp"
#include "offset_family.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Plans like plan() of the exact arm. `phi` of the stretches is the value of the free joint, and so is the
/// psi that is wished. The options must not ask for more than one scene, arcs of the user, duration, a
/// margin of singularities, a free roll, or a wish for the elbow: these are not read.
inline Plan plan(const OffsetArm& arm, const Segment* segments, std::size_t n, const PlanOptions& options,
                 const FamilyTuning& tuning = {}) {
    const Scene* const scene = options.scenes.count > 0 ? &options.scenes[0] : nullptr;
    return detail::FamilyPlanner(OffsetFamily(arm, scene), segments, n, options, tuning).run();
}

}  // namespace armangle

#include "../names/end.hpp"
