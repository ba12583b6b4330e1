// Global configuration GC: the branch of the inverse kinematics, eq. (2), as three signs or as an index 0..7.
#pragma once

#include "joint_map.hpp"

#include "../names/begin.hpp"

namespace armangle {

inline constexpr int configurations = 8;

/// Signs of theta_2, theta_4 - delta and theta_6; +1 at zero. Eq. (2).
template <class T>
struct Configuration {
    T shoulder, elbow, wrist;
};

/// The signs of branch `index` = (theta_2 < 0) + 2 (theta_4 - delta < 0) + 4 (theta_6 < 0), each angle
/// wrapped to (-pi, pi].
ARMANGLE_INLINE Configuration<double> configuration(int index) noexcept {
    return {index & 1 ? -1.0 : 1.0, index & 2 ? -1.0 : 1.0, index & 4 ? -1.0 : 1.0};
}

/// The signs of a branch, in every lane of a vector.
template <class T>
ARMANGLE_INLINE Configuration<T> spread(const Configuration<double>& gc) noexcept {
    return {T(gc.shoulder), T(gc.elbow), T(gc.wrist)};
}

/// The index 0..7 of three signs.
inline int index(const Configuration<double>& gc) noexcept {
    return (gc.shoulder < 0) + 2 * (gc.elbow < 0) + 4 * (gc.wrist < 0);
}

/// The signs of model angles theta (rad), eq. (2); theta_4 counts relative to the stretched arm.
inline Configuration<double> configuration(const Arm& arm, const double* theta) noexcept {
    const auto sign = [](double angle) { return wrap(angle) < 0 ? -1.0 : 1.0; };
    return {sign(theta[1]), sign(theta[3] - arm.delta_angle), sign(theta[5])};
}

/// The bits of a branch index that are ambiguous at these angles: 1 if theta_2 is 0 or pi, 4 if theta_6 is,
/// where two branches coincide.
inline int shared_signs(const double* theta) noexcept {
    const auto shut = [](double angle) { return abs(std::sin(angle)) <= tolerance::one_axis; };
    return (shut(theta[1]) ? 1 : 0) | (shut(theta[5]) ? 4 : 0);
}

}  // namespace armangle

#include "../names/end.hpp"
