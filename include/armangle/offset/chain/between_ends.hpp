// An arm on its own chain with an offset between its own axes 1 and 7, for the cells of its reach map
// (motion/reduced_place.hpp).
#pragma once

#include "../../motion/reduced_place.hpp"
#include "../reduced_place.hpp"
#include "../step.hpp"
#include "nearest_posture.hpp"

#include "../../names/begin.hpp"

namespace armangle {

/// What is before and behind the arm's own axes 1 and 7.
inline EndFrames end_frames(const OffsetChain& arm) noexcept {
    const Arm& own = arm.nominal.own;
    if (!arm.nominal.mirrored) return {own.base * inverted(arm.first), inverted(arm.last) * own.tool};
    // the formulas read the arm from its tool: a mirrored pose swaps what is before it with what is behind
    return {own.base * inverted(mirrored_pose(arm.last)), inverted(mirrored_pose(arm.first)) * own.tool};
}

/// The distances (m) of the wrist from the shoulder between which poses can be reachable: the links between
/// the joints widen those of the nominal arm.
inline ReducedReach reduced_reach(const OffsetChain& arm) noexcept {
    const ReducedReach of = reduced_reach(arm.nominal);
    return {max(0.0, of.inner - arm.shift), of.outer + arm.shift};
}

/// Whether turn and -turn have the same cell: a chain has no symmetry.
inline bool is_mirrored(const OffsetChain&) noexcept { return false; }

/// The chain between its joints, with the end links of a nominal arm with these parameters.
inline OffsetChain between_ends(const OffsetChain& arm, const ArmParameters& parameters) noexcept {
    OffsetChain out = arm;
    out.nominal = remade(arm.nominal, parameters);
    out.first = out.last = identity_pose();
    for (int k = 0; k <= joints; ++k)
        out.link[k] = arm.nominal.mirrored ? mirrored_pose(arm.row[joints - k]) : arm.row[k];
    return out;
}

/// Does nothing: these arms have no table of limits.
inline OffsetLimits limit_table(const OffsetChain&, double) noexcept { return {}; }
/// The functions for steps of an arm.
inline FreeJointSteps<OffsetChain> steps_of(const OffsetChain& arm, OffsetLimits) noexcept {
    return steps_of(arm);
}

static_assert(proven_arm<OffsetChain>);

}  // namespace armangle

#include "../../names/end.hpp"
