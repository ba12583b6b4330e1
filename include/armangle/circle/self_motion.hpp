// The self-motion: all solutions of one pose in one branch. psi runs once around the circle while the end
// effector keeps its pose.
//
// This file computes what pose and branch determine; psi remains free. The joints at psi are in inverse.hpp
// (directions), each joint as a function of psi in joint_function.hpp (joint_functions), and the psi within
// the limits in feasible.hpp (feasible). Eq. (12)-(24).
#pragma once

#include "../arm/configuration.hpp"
#include "circle.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// One pose in one branch: the quantities common to all its solutions, independent of psi. Eq. (12)-(15).
template <class T>
struct SelfMotion {
    Circle<T> circle;
    Configuration<T> gc;
    Elbow<T> elbow;
};

/// Computes the self-motion of one branch on a circle.
template <class T>
ARMANGLE_INLINE SelfMotion<T> self_motion(const Arm& arm, const Circle<T>& circle,
                                          const Configuration<T>& gc) noexcept {
    return {circle, gc, elbow(arm, circle.triangle, gc.elbow)};
}

/// Computes the self-motion of a user's pose in one branch, for the arm's own psi.
template <class T>
ARMANGLE_INLINE SelfMotion<T> self_motion(const Arm& arm, const Pose<T>& pose,
                                          const Configuration<T>& gc) noexcept {
    return self_motion(arm, circle(arm, flange_pose(arm, pose)), gc);
}

/// The self-motion of a pose in branch gc, 0..7. The signs are computed after the circle, which needs all
/// registers.
ARMANGLE_INLINE SelfMotion<double> self_motion(const Arm& arm, const Pose<double>& pose, int gc) noexcept {
    const Circle<double> on = circle(arm, flange_pose(arm, pose));
    return self_motion(arm, on, configuration(gc));
}

/// Whether theta_1 is undefined (theta_2 = 0 or pi) for every psi, because axes 1 and 3 lie along S-W.
template <class T>
ARMANGLE_INLINE auto shoulder_singular(const SelfMotion<T>& m) noexcept {
    const Circle<T>& c = m.circle;
    const T along = c.w.x * c.w.x + c.w.y * c.w.y;
    const SinCos<T> beta = lean(m.elbow, m.elbow.beta);
    const T size = beta.cos * beta.cos * along + beta.sin * beta.sin * (T(1.0) + c.w.z * c.w.z);
    return size <= T(tolerance::singular * tolerance::singular);
}

/// Whether theta_5 is undefined (theta_6 = 0 or pi) for every psi, because axes 5 and 7 lie along S-W.
template <class T>
ARMANGLE_INLINE auto wrist_singular(const SelfMotion<T>& m) noexcept {
    const Circle<T>& c = m.circle;
    const T across = c.tool_e.z * c.tool_e.z + c.tool_z.z * c.tool_z.z;
    const T along = c.tool_w.z * c.tool_w.z;
    const SinCos<T> gamma = lean(m.elbow, m.elbow.gamma);
    const T size = gamma.sin * gamma.sin * along + across * (T(1.0) + gamma.cos * gamma.cos);
    return size <= T(tolerance::singular * tolerance::singular);
}

}  // namespace armangle

#include "../names/end.hpp"
