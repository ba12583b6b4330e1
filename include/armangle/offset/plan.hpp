// A whole path of an arm with an offset wrist or shoulder, also on its own chain: planned and proven as
// family_planner.hpp does for any family. As plan/ this allocates.
#pragma once

#include "../plan/family_planner.hpp"
#include "chain/nearest_posture.hpp"
#include "chain/offset_chain_family.hpp"
#include "offset_family.hpp"
#include "psi_towards.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// As for the nominal arm: the value of the free joint (rad) at which its elbow is as near to its target as
/// branch gc allows.
inline WishedPsi psi_towards(const OffsetChain& arm, const Pose<double>& pose, int gc,
                             const Towards& towards) noexcept {
    return psi_towards(arm.nominal, pose, gc, towards);
}

namespace detail {

/// Plans a path for an arm of a family.
template <planned_family F>
Plan planned_of(const F& family, const Segment* segments, std::size_t n, const PlanOptions& options,
                const FamilyTuning& tuning) {
    Work work(options.checkpoint, options.work);
    const auto planned = [&](const PlanOptions& asked) {
        return FamilyPlanner(family, segments, n, asked, work, tuning).run();
    };
    Plan out = fastest(options, work, planned, [&](const Plan& x) {
        return FamilyCurve<F>{family, x.gc, {segments, n}, x.stretches};
    });
    out.work_left = work.left();
    return out;
}

}  // namespace detail

/// Plans a path like plan() for an S-R-S arm. `phi` of the stretches is the value of the free joint, and so
/// are the target for psi and the arcs of the user. The singularity margin is the arm's own. A free roll is
/// ignored.
inline Plan plan(const OffsetArm& arm, const Segment* segments, std::size_t n, const PlanOptions& options,
                 const FamilyTuning& tuning = {}) {
    return detail::planned_of(OffsetFamily(arm), segments, n, options, tuning);
}

/// The same on an arm with its own chain, for which the obstacles are prepared.
inline Plan plan(const OffsetChain& arm, const Segment* segments, std::size_t n, const PlanOptions& options,
                 const FamilyTuning& tuning = {}) {
    return detail::planned_of(OffsetChainFamily(arm), segments, n, options, tuning);
}

}  // namespace armangle

#include "../names/end.hpp"
