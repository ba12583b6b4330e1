// A nearly S-R-S arm between its own axes 1 and 7, for the cells of its reach map (motion/reduced_place.hpp).
#pragma once

#include "../motion/reduced_place.hpp"
#include "nearest_posture.hpp"
#include "step.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What is before and behind the arm's own axes 1 and 7.
inline EndFrames end_frames(const ChainArm& arm) noexcept {
    return {inverted(arm.first) * arm.nominal.base, arm.nominal.tool * inverted(arm.last)};
}

/// The distances (m) of the wrist from the shoulder between which poses can be reachable: the links between
/// the joints widen those of the nominal arm.
inline ReducedReach reduced_reach(const ChainArm& arm) noexcept {
    return {max(0.0, arm.nominal.inner_reach - arm.joint_shift), arm.nominal.reach + arm.joint_shift};
}

/// Whether turn and -turn have the same cell: a chain has no symmetry.
inline bool is_mirrored(const ChainArm&) noexcept { return false; }

/// The chain between its joints, with the end links of a nominal arm with these parameters.
inline ChainArm between_ends(const ChainArm& arm, const ArmParameters& parameters) noexcept {
    ChainArm out = arm;
    out.nominal = make_arm(parameters);
    Pose<double> nominal[joints + 1];
    detail::nominal_links(out.nominal, nominal);
    out.link[0] = nominal[0];
    out.link[joints] = nominal[joints];
    detail::measure(out);
    return out;
}

/// Takes the place of the LimitTable of an S-R-S arm: a singularity margin (rad). The limits are the arm's.
struct ChainLimits {
    double margin;
};
/// Keeps the margin (rad).
inline ChainLimits limit_table(const ChainArm&, double margin) noexcept { return {margin}; }
/// The functions for steps of an arm with a singularity margin.
inline ChainSteps steps_of(const ChainArm& arm, ChainLimits limits) noexcept { return {arm, limits.margin}; }

static_assert(proven_arm<ChainArm>);

}  // namespace armangle

#include "../names/end.hpp"
