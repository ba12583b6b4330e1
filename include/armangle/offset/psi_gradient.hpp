// psi of an arm with an offset is the value of its free joint: its gradient is 1 there.
#pragma once

#include "../self_motion/inverse_pullback.hpp"
#include "offset_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The robot's joint (0..6) whose value is psi.
template <free_joint_arm AnyArm>
int psi_joint(const AnyArm& arm) noexcept {
    return robot_joint(arm, joints - 1);
}

/// Writes the gradient dpsi/dq to `out`: 1 for the free joint.
template <free_joint_arm AnyArm>
void psi_gradient(const AnyArm& arm, const double*, double (&out)[joints]) noexcept {
    for (int j = 0; j < joints; ++j) out[j] = j == psi_joint(arm) ? 1.0 : 0.0;
}

/// Writes the change of the gradient of psi along joint velocities to `out`: 0.
template <free_joint_arm AnyArm>
void psi_gradient_change(const AnyArm&, const double*, const double*, double (&out)[joints]) noexcept {
    for (double& each : out) each = 0.0;
}

/// Whether a joint (0..6) does not move with psi: none, every other joint moves with the free joint.
template <free_joint_arm AnyArm>
bool is_fixed_by_pose(const AnyArm&, int) noexcept {
    return false;
}

}  // namespace armangle

#include "../names/end.hpp"
