// What is wrong with joints and poses that an arm is given: whether they are numbers, in rad and m.
#pragma once

#include "../numbers/arrays.hpp"
#include "arm.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The middle, by ratio, between a length in m and the same number read in mm: the root of 1000.
inline constexpr double between_metres_and_millimetres = 31.622776601683793;

/// What is wrong with a 4x4 pose that an arm is asked for, and the value that shows it. A position (m) beyond
/// all lengths of the arm, that is nearer to them by ratio when it is read in mm, was not meant in m.
template <class AnyArm>
Problem check_pose(const AnyArm& arm, const double* m, double& value) noexcept {
    const Problem problem = check_pose(m, value);
    if (problem != Problem::none) return problem;
    value = norm(load_pose(m).position);
    const bool meant = value <= between_metres_and_millimetres * nominal(arm).size;
    return meant ? Problem::none : Problem::pose_in_millimetres;
}

/// What is wrong with seven joint values (rad) of an arm, and the value that shows it. A value more than a
/// turn outside the limits of its joint was not meant in rad.
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
