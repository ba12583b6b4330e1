// What the queries of each kind of arm take in place of a table of limits.
#pragma once

#include "armangle/motion/freedom.hpp"
#include "armangle/offset/singular_end_slope.hpp"
#include "offset_handle.hpp"

namespace binding {

/// The table of the arm's limits, with a margin (rad) to singularities if it is positive.
inline armangle::LimitTable table(const ArmHandle& self, double margin) {
    return margin > 0 ? armangle::limit_table(self.arm, margin) : self.limits;
}
/// What an arm with an offset takes in place of a table of limits; `margin` is ignored: the arm has its own.
inline armangle::OffsetLimits table(const OffsetHandle& self, double margin) {
    return armangle::limit_table(self.arm, margin);
}
/// The view of an arm on its own chain, which knows its limits and the margin.
inline armangle::ChainSteps table(const ChainArmHandle& self, double margin) { return {self.arm, margin}; }
/// The functions for steps of the arm, which know its limits; a margin is ignored.
inline auto table(const OffsetChainHandle& self, double) { return armangle::steps_of(self.arm); }

/// The freedom of a pose within these limits.
template <class AnyArm, class Table>
armangle::Freedom freedom_within(const AnyArm& arm, const Table& limits,
                                 const armangle::Pose<double>& pose) noexcept {
    if constexpr (armangle::stepping_family<Table>)
        return armangle::freedom(limits, pose);
    else
        return armangle::freedom(arm, pose, limits);
}

/// Whether a pose is reachable within these limits.
template <class AnyArm, class Table>
bool reachable_within(const AnyArm& arm, const Table& limits, const armangle::Pose<double>& pose) noexcept {
    if constexpr (armangle::stepping_family<Table>)
        return armangle::is_reachable(limits, pose);
    else
        return armangle::is_reachable(arm, pose, limits);
}

/// Writes the derivative of the total freedom with respect to the twist of the pose.
template <class AnyArm, class Table>
void freedom_slope(const AnyArm& arm, const Table& limits, const armangle::Pose<double>& pose,
                   double (&slope)[6]) noexcept {
    if constexpr (armangle::free_joint_arm<AnyArm>)
        armangle::freedom_gradient(arm, pose, slope);
    else
        armangle::freedom_gradient(arm, pose, limits, slope);
}

}  // namespace binding
