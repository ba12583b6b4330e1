// What a plan strives for, as one number: an integral along the way, the less the better.
//
//     cost \                                cost(d) = (r / d - r / enough)^2 of a distance d (rad), 0 beyond
//           \ <- its tangent below           `enough`: its slopes along a way are the same line on Jet
//            `-.__
//     ------|-----|------> distance
//         floor  enough
#pragma once

#include "../arm/joint_map.hpp"
#include "../numbers/jet.hpp"
#include "tube.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What a plan weighs; the terms are integrals over s from 0 to 1, and a weight multiplies its term:
///   travel         |dq/ds|^2                          (rad^2)
///   limits         cost of the distances to limits    (1), times Task::margin_scale
///   singularities  the same of theta_2, theta_6 to 0 and +-pi
///   psi            2 - 2 cos of the angle to what is wished (wish_along.hpp), times length^2, 1 at least
///   duration       the time that joint speeds need (pace, s), times length
/// length: how far the path turns the arm (rad; tube.hpp: turned_length), so that a path twice as long is
/// weighed as its halves are, and over a short one the arm stays near its start.
struct Objective {
    double limits = 1, singularities = 1, travel = 1;  // weights, >= 0
    double enough = 0.35;                              // rad: distances beyond it cost nothing
    double psi = 1;                                    // weight, where there is a wish
    double duration = 0;                               // weight, >= 0
    double slowness[joints] = {};                      // of duration: 1 / the speed a joint comes to (s/rad)
};

/// The terms of an objective along a curve, each without its weight.
struct Terms {
    double travel = 0, limits = 0, singularities = 0, psi = 0, duration = 0;

    double weighed(const Objective& w) const noexcept {
        return w.travel * travel + w.limits * limits + w.singularities * singularities + w.psi * psi +
               w.duration * duration;
    }
};

namespace objective_rule {
inline constexpr double reference = 0.2;  // r of the cost (rad)
inline constexpr double floor = 0.02;     // below this distance the cost is its tangent (rad) ...
inline constexpr double home = 0.1;       // ... and below this one from a singularity
inline constexpr double still = 1e-6;     // time that s needs where nothing moves: keeps the pace smooth (s)
}  // namespace objective_rule

/// Speed that a joint comes to on a path that turns the arm by `length` (rad): its greatest, or what it comes
/// to at this acceleration over that way.
inline double joint_speed(double velocity, double acceleration, double length) noexcept {
    return min(velocity, std::sqrt(acceleration * length));
}

/// The time that a unit of s needs (s): the joint that needs longest, as the norm of order 8 of all, which is
/// smooth, and up to 28 % more. To the power of 8.
inline double pace_to_8(const double* slowness, const double* rate) noexcept {
    const double least = objective_rule::still * objective_rule::still;
    double sum = least * least * least * least;
    for (int j = 0; j < joints; ++j) {
        const double x = slowness[j] * rate[j], square = x * x;
        sum += square * square * square * square;
    }
    return sum;
}
inline double pace(const double* slowness, const double* rate) noexcept {
    return std::sqrt(std::sqrt(std::sqrt(pace_to_8(slowness, rate))));
}

/// What a distance is from.
enum class Kind { limit, singularity };

/// What a distance of this kind weighs.
inline double weight(const Objective& objective, Kind kind) noexcept {
    return kind == Kind::limit ? objective.limits : objective.singularities;
}

/// Cost of a distance from a limit or a singularity. The tangent below the floor keeps the cost finite at
/// distance 0, where a posture may begin, so that it is left calmly: no motion of least cost is faster than
/// the root of what is to be saved. The slope keeps pointing outward: a constant would leave such a posture
/// where it is. A singularity's is higher: many motions begin at theta_2 = 0 or theta_6 = 0, and to leave it
/// in haste takes longer than it is worth.
template <class T>
T cost(const T& distance, Kind kind, double enough) noexcept {
    if (!(distance < T(enough)) || enough <= objective_rule::floor) return T(0.0);
    const double floor =
        kind == Kind::limit ? objective_rule::floor : min(objective_rule::home, 0.5 * enough);
    const T held = max(distance, T(floor));
    const T share = T(objective_rule::reference) / held;
    const T near = share - T(objective_rule::reference / enough);
    return near * near + T(2.0) * near * share * (held - distance) / held;
}

/// Cost of the angle between the arm angle and what is wished of it; 0 where nothing is.
inline double wish_cost(double gap) noexcept { return gap == gap ? 2 - 2 * sin_cos(gap).cos : 0.0; }

namespace detail {

/// take(distance, kind) of joint j's limits.
template <class T, class Take>
void limit_distances(const Task& task, int j, const T& q, const Take& take) {
    if (task.limits.lower[j] > -infinity) take(q - T(task.limits.lower[j]), Kind::limit);
    if (task.limits.upper[j] < infinity) take(T(task.limits.upper[j]) - q, Kind::limit);
}

/// take(distance, kind) of the angles 0 and +-pi of theta, where a joint is singular.
template <class T, class Take>
void singular_distances(const Task& task, const T& theta, const Take& take) {
    const T size = abs(wrap(theta));
    take(size - T(task.table.margin), Kind::singularity);
    take(T(pi - task.table.margin) - size, Kind::singularity);
}

}  // namespace detail

/// take(distance, kind) of all distances that phi decides: not those of joint 4, which is the same for every
/// phi.
template <class T, class Take>
void distances(const Task& task, const T* q, const Take& take) {
    for (int j = 0; j < joints; ++j)
        if (j != 3) detail::limit_distances(task, j, q[j], take);
    for (const int j : {1, 5}) {
        const T theta = to_theta(q[j], T(task.arm.sign[j]), T(task.arm.offset[j]));
        detail::singular_distances(task, theta, take);
    }
}

/// What a posture is worth.
struct Rating {
    double margin = infinity;  // rad: the least distance
    double cost = 0;           // of all distances, weighed
};

inline Rating rating(const Task& task, const Objective& objective, const double* q) noexcept {
    Rating out;
    distances(task, q, [&](double distance, Kind kind) {
        if (!(weight(objective, kind) > 0)) return;
        out.margin = min(out.margin, distance);
        out.cost += weight(objective, kind) * cost(distance, kind, objective.enough);
    });
    return out;
}

/// The margin that joint 4 keeps at q_4 and theta_4 - delta = +-eta: the path decides it, not phi.
inline double elbow_margin(const Task& task, const Objective& objective, double q_4,
                           const SinCos<double>& eta) noexcept {
    double least = infinity;
    const auto take = [&](double distance, Kind kind) {
        if (weight(objective, kind) > 0) least = min(least, distance);
    };
    detail::limit_distances(task, 3, q_4, take);
    detail::singular_distances(task, atan2(eta.sin, eta.cos), take);
    return least;
}

}  // namespace armangle

#include "../names/end.hpp"
