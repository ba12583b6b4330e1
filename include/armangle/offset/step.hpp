// What a step and a lookahead ask of an arm with an offset wrist or shoulder: its free number is the value of
// joint 7 (1).
#pragma once

#include "../motion/follow.hpp"
#include "nearest_posture.hpp"
#include "offset_family.hpp"
#include "psi_towards.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Adapts an arm with an offset to the functions that need a stepping family (motion/stepping_family.hpp,
/// which explains the members).
class OffsetSteps {
public:
    explicit OffsetSteps(const OffsetArm& arm) noexcept : arm_(&arm) {}

    const OffsetArm& arm() const noexcept { return *arm_; }
    const Arm& rows() const noexcept { return arm_->own; }
    double margin() const noexcept { return 0.0; }

    OnSelfMotion on(const double* q, const Pose<double>&, Carry) const noexcept {
        double theta[joints];
        for (int j = 0; j < joints; ++j) theta[j] = to_theta(arm_->rest, j, q[robot_joint(*arm_, j)]);
        const double free = wrap(q[robot_joint(*arm_, 6)]);
        return {free <= -pi ? pi : free, index(offset_branch(*arm_, theta))};
    }
    Status at(const Pose<double>& pose, int gc, double free, const double* seed,
              Directions<double>& d) const noexcept {
        return directions(*arm_, pose, free, gc, seed, d);
    }
    void arcs(const Pose<double>& pose, int gc, const Limits& limits, ProvenArcs& out) const noexcept {
        feasible(*arm_, pose, gc, limits, out);
    }
    std::array<BranchMeeting, 3> meetings() const noexcept {
        return {{{robot_joint(*arm_, 1), 0.0},
                 {robot_joint(*arm_, 3), arm_->rest.delta_angle},
                 {robot_joint(*arm_, 4), half_pi}}};
    }
    std::span<const int> hinges() const noexcept { return {}; }
    double towards(const Pose<double>& pose, int gc, const Towards& towards) const noexcept {
        return psi_towards(*arm_, pose, gc, towards).psi;
    }
    Nearest nearest(const Pose<double>& pose, const NearestOptions& options,
                    const Scene* scene) const noexcept {
        return nearest_posture(*arm_, pose, options, scene);
    }

private:
    const OffsetArm* arm_;
};

static_assert(stepping_family<OffsetSteps>);

/// The step from joints q_now to `pose` (in the user's frame) within the arm's limits; Step::psi is the value
/// of the free joint.
inline Step step(const OffsetArm& arm, const double* q_now, const Pose<double>& pose,
                 const StepOptions& options) noexcept {
    return step(OffsetSteps(arm), q_now, pose, options);
}

}  // namespace armangle

#include "../names/end.hpp"
