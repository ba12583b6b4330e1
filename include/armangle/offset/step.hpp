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
template <free_joint_arm AnyArm>
class FreeJointSteps {
public:
    /// Keeps a pointer to an arm.
    explicit FreeJointSteps(const AnyArm& arm) noexcept : arm_(&arm) {}

    /// The arm itself.
    const AnyArm& arm() const noexcept { return *arm_; }
    /// The arm without the offset, whose signs, offsets and limits are the robot's.
    const Arm& rows() const noexcept { return nominal(*arm_); }
    /// The singularity margin (rad) of the arm.
    double margin() const noexcept { return nominal_offset(*arm_).margin; }

    /// The value of the free joint (rad) and the branch at joints q.
    OnSelfMotion on(const double* q, const Pose<double>&, Carry) const noexcept {
        const OffsetArm& formulas = nominal_offset(*arm_);
        double theta[joints];
        for (int j = 0; j < joints; ++j) theta[j] = to_theta(formulas.rest, j, q[robot_joint(formulas, j)]);
        const double free = wrap(q[robot_joint(formulas, 6)]);
        return {free <= -pi ? pi : free, index(offset_branch(formulas, theta))};
    }
    /// Writes the directions of the joints at a pose, branch and value of the free joint (rad) to d; if the
    /// status is not OK, d is no solution.
    Status at(const Pose<double>& pose, int gc, double free, const double* seed,
              Directions<double>& d) const noexcept {
        return directions(*arm_, pose, free, gc, seed, d);
    }
    /// Writes the proven arcs of the free joint at a pose in branch gc within limits, in the robot's order of
    /// joints, to `out`.
    void arcs(const Pose<double>& pose, int gc, const Limits& limits, ProvenArcs& out) const noexcept {
        feasible(*arm_, pose, gc, limits, out);
    }
    /// The joints and angles at which branches meet.
    BranchMeetings meetings() const noexcept { return branch_meetings(*arm_); }
    /// The joints whose neighbours rotate about one axis where they are 0 or pi: none, since steps of these
    /// arms treat no such joint.
    std::span<const int> hinges() const noexcept { return {}; }
    /// The value of the free joint (rad) that brings the elbow nearest to its target; NaN if none is best.
    double towards(const Pose<double>& pose, int gc, const Towards& towards) const noexcept {
        return psi_towards(nominal_offset(*arm_), pose, gc, towards).psi;
    }
    /// How much farther (rad) the free joint stands in the same postures of a pose that is turned by `roll`
    /// (rad) about its own z axis, axis 7.
    double turned_by(double roll) const noexcept {
        if (nominal_offset(*arm_).mirrored) return 0.0;
        return rows().sign[joints - 1] * (rows().tool.rotation.z.z < 0 ? -roll : roll);
    }
    /// The nearest solution of a pose. With a free roll, joint 7 costs nothing and has the value that the
    /// pose requires.
    Nearest nearest(const Pose<double>& pose, const NearestOptions& options,
                    const Scene* scene) const noexcept {
        if constexpr (std::same_as<AnyArm, OffsetArm>) {
            if (rows().roll_free) {
                OffsetArm whole = *arm_;
                whole.own.roll_free = false;
                NearestOptions others = options;
                others.weight[joints - 1] = 0.0;
                return nearest_posture(whole, pose, others, scene);
            }
        }
        return nearest_posture(*arm_, pose, options, scene);
    }

private:
    const AnyArm* arm_;
};

/// The functions that steps of an arm with an offset use; it refers to the arm.
template <free_joint_arm AnyArm>
FreeJointSteps<AnyArm> steps_of(const AnyArm& arm) noexcept {
    return FreeJointSteps<AnyArm>(arm);
}

static_assert(stepping_family<FreeJointSteps<OffsetArm>>);

/// The step from joints q_now to `pose` (in the user's frame) within the arm's limits; Step::psi is the value
/// of the free joint.
template <free_joint_arm AnyArm>
Step step(const AnyArm& arm, const double* q_now, const Pose<double>& pose,
          const StepOptions& options) noexcept {
    return step(steps_of(arm), q_now, pose, options);
}

}  // namespace armangle

#include "../names/end.hpp"
