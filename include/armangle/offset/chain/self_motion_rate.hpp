// The self-motion of an arm on its own chain with an offset nominal arm.
#pragma once

#include "../psi_gradient.hpp"
#include "inverse.hpp"

#include "../../names/begin.hpp"

namespace armangle {

/// Returns dq / d(free joint) at a fixed pose in `q` (rad/rad), from the Jacobian of the true chain. The
/// rates are infinite where the Jacobian of the other six joints is singular. If there is no solution, the
/// status is that of inverse().
inline Inverse self_motion_rate(const OffsetChain& arm, const Pose<double>& pose, double free,
                                int gc) noexcept {
    Inverse out = inverse(arm, pose, free, gc);
    if (out.status != Status::OK) return out;
    double by[joints][joints];
    detail::derivatives_at(arm, out.q, jacobian(arm, out.q), by);
    for (int j = 0; j < joints; ++j) out.q[j] = by[j][6];
    return out;
}

/// Returns by how much (m) at least a value of the free joint puts the wrist beyond the reach, or inside the
/// inner reach; <= 0 if that is not certain.
inline double reach_excess(const OffsetChain& arm, const Pose<double>& pose, double free) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    return detail::certain_excess(arm, flange_pose(arm, exact), sin_cos(to_theta(arm.nominal.rest, 6, free)));
}

}  // namespace armangle

#include "../../names/end.hpp"
