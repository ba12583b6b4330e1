// Checks joints and poses given by the user: finite numbers, in rad and m.
#pragma once

#include "../numbers/arrays.hpp"
#include "arm.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The square root of 1000: the geometric mean between a length in m and the same number read in mm.
inline constexpr double between_metres_and_millimetres = 31.622776601683793;

/// A larger arm angle (rad), beyond two turns, was probably given in degrees.
inline constexpr double likely_degrees = 2.0 * two_pi;

/// Checks a 4x4 target pose (16 numbers, row by row) for an arm; returns the problem, or none, and stores the
/// offending number in `value`. A position farther away than 31.6 times the arm's size is reported as
/// probably given in mm.
template <class AnyArm>
Problem check_pose(const AnyArm& arm, const double* m, double& value) noexcept {
    const Problem problem = check_pose(m, value);
    if (problem != Problem::none) return problem;
    value = norm(load_pose(m).position);
    const bool meant = value <= between_metres_and_millimetres * nominal(arm).size;
    return meant ? Problem::none : Problem::pose_in_millimetres;
}

/// Checks seven joint values (rad); returns the problem, or none, and stores the offending number in `value`.
/// A value more than one revolution outside its limits is reported as probably given in degrees.
template <class AnyArm>
Problem check_joints(const AnyArm& arm, const double* q, double& value) noexcept {
    const Limits& limits = nominal(arm).limits;
    Problem problem = Problem::none;
    for (int j = joints - 1; j >= 0; --j) {
        const bool turned = q[j] < limits.lower[j] - two_pi || q[j] > limits.upper[j] + two_pi;
        const bool usable = abs(q[j]) <= tolerance::largest_angle;
        if (usable && !turned) continue;
        if (usable && problem == Problem::joints_not_finite) continue;
        problem = usable ? Problem::joints_in_degrees : Problem::joints_not_finite;
        value = q[j];
    }
    return problem;
}

}  // namespace armangle

#include "../names/end.hpp"
