// What a plan strives for, as one function of a posture: the distances that it keeps, and what each costs.
//
//     cost \  <- its tangent from the floor down
//           \                            cost(d) = (0.1 w / d)^2 of a distance d (rad) and its weight w;
//            `.                          its slope along a way is the same line on Jet<double, 1>
//              `-..____
//     ------|-----------> distance
//         floor
#pragma once

#include "../arm/joints.hpp"
#include "../numbers/jet.hpp"
#include "tube.hpp"

namespace armangle {

/// What a plan strives for: first the largest least margin, up to `enough`; then margin along the way and
/// little travel.
struct Objective {
    double limits = 1, singularities = 1, travel = 1;  // weights, >= 0
    double enough = 0.35;                              // rad: margins beyond it count no more
};

namespace objective_rule {
inline constexpr double reference = 0.1;  // distance of cost 1 at weight 1 (rad)
inline constexpr double floor = 1e-3;     // below this distance the cost is its tangent (rad)
}  // namespace objective_rule

/// Cost of a distance from a limit or a singularity. The tangent below the floor keeps the cost finite at
/// distance 0, where a posture may begin, and its slope keeps pointing outward: a constant would leave such a
/// posture where it is.
template <class T>
T cost(const T& distance, double weight) noexcept {
    const T held = max(distance, T(objective_rule::floor));
    const T root = T(objective_rule::reference * weight) / held;
    return root * root * (T(1.0) + T(2.0) * (held - distance) / held);
}

namespace detail {

/// take(distance, weight) of joint j's limits.
template <class T, class Take>
void limit_distances(const Task& task, const Objective& objective, int j, const T& q, const Take& take) {
    if (!(objective.limits > 0)) return;
    if (task.limits.lower[j] > -infinity) take(q - T(task.limits.lower[j]), objective.limits);
    if (task.limits.upper[j] < infinity) take(T(task.limits.upper[j]) - q, objective.limits);
}

/// take(distance, weight) of the angles 0 and +-pi of theta, where a joint is singular.
template <class T, class Take>
void singular_distances(const Task& task, const Objective& objective, const T& theta, const Take& take) {
    if (!(objective.singularities > 0)) return;
    const T size = abs(wrap(theta));
    take(size - T(task.table.margin), objective.singularities);
    take(T(pi - task.table.margin) - size, objective.singularities);
}

}  // namespace detail

/// take(distance, weight) of all distances that phi decides: not those of joint 4, which is the same for
/// every phi.
template <class T, class Take>
void distances(const Task& task, const Objective& objective, const T* q, const Take& take) {
    for (int j = 0; j < joints; ++j)
        if (j != 3) detail::limit_distances(task, objective, j, q[j], take);
    for (const int j : {1, 5}) {
        const T theta = to_theta(q[j], T(task.arm.sign[j]), T(task.arm.offset[j]));
        detail::singular_distances(task, objective, theta, take);
    }
}

/// What a posture is worth.
struct Rating {
    double margin = infinity;  // rad: the least distance, each divided by its weight
    double cost = 0;
};

inline Rating rating(const Task& task, const Objective& objective, const double* q) noexcept {
    Rating out;
    distances(task, objective, q, [&out](double distance, double weight) {
        out.margin = min(out.margin, distance / weight);
        out.cost += cost(distance, weight);
    });
    return out;
}

/// The margin that joint 4 keeps at q_4 and theta_4 - delta = +-eta: the path decides it, not phi.
inline double elbow_margin(const Task& task, const Objective& objective, double q_4,
                           const SinCos<double>& eta) noexcept {
    double least = infinity;
    const auto take = [&least](double distance, double weight) { least = min(least, distance / weight); };
    detail::limit_distances(task, objective, 3, q_4, take);
    detail::singular_distances(task, objective, atan2(eta.sin, eta.cos), take);
    return least;
}

}  // namespace armangle
