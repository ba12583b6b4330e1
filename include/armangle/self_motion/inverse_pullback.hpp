// Reverse-mode gradients of any arm of inverse_derivative.hpp, as circle/pose_gradient.hpp has them for an
// exact S-R-S arm.
#pragma once

#include <algorithm>

#include "../circle/pose_gradient.hpp"
#include "inverse_derivative.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Writes the gradient of a function of inverse() with respect to the pose's entries and psi, from its
/// gradient by_q with respect to the joints. NaN if a derivative that it needs does not exist; returns
/// why, or none.
template <class AnyArm>
Hindrance inverse_pullback(const AnyArm& arm, const Pose<double>& pose, double psi, int gc,
                           const double* by_q, double* by_pose, double& by_psi) noexcept {
    double by[joints] = {};
    Hindrance why = Hindrance::none;
    if (std::any_of(by_q, by_q + joints, [](double g) { return g != 0; })) {
        const Derivatives d = inverse_derivative(arm, pose, psi, gc);
        if (d.status != Status::OK) why = Hindrance::unreachable;
        for (int j = 0; j < joints; ++j) {
            if (by_q[j] == 0) continue;
            if (why == Hindrance::none && !(abs(d.entry[j][joints - 1]) < infinity))
                why = Hindrance::singular;
            for (int k = 0; k < joints; ++k) by[k] += by_q[j] * d.entry[j][k];
        }
    }
    for (double& each : by)
        if (why != Hindrance::none) each = not_a_number;
    store_gradient(pose_gradient<double>(pose, {by[0], by[1], by[2]}, {by[3], by[4], by[5]}), by_pose);
    by_psi = by[6];
    return why;
}

}  // namespace armangle

#include "../names/end.hpp"
