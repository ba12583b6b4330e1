// The objective of a plan as one number: an integral along the path; smaller is better.
//
//     cost \                                cost(d) = (r / d - r / enough)^2 of a distance d (rad), 0 beyond
//           \ <- its tangent below           `enough`: its slopes along a path are the same line on Jet
//            `-.__
//     ------|-----|------> distance
//         floor  enough
#pragma once

#include "../arm/joint_map.hpp"
#include "../numbers/jet.hpp"
#include "tube.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The weights of a plan. The terms are integrals over s from 0 to 1, each multiplied by its weight:
///   travel         |dq/ds|^2                          (rad^2)
///   limits         cost of the distances to limits    (1), times Task::margin_scale
///   singularities  the same for theta_2, theta_6 to 0 and +-pi
///   psi            2 - 2 cos of the angle to its target (wish_along.hpp), times length^2, 1 at least
///   duration       the time that joint speeds need (pace, s), times length
/// length: how far the path turns the arm (rad; tube.hpp: turned_length). So a path twice as long is weighed
/// like its halves, and over a short one the arm stays near its start.
struct Objective {
    double limits = 1, singularities = 1, travel = 1;  // weights, >= 0
    double enough = 0.35;                              // rad: larger distances cost nothing
    double psi = 1;                                    // weight, if there is a target for psi
    double duration = 0;                               // weight, >= 0
    double slowness[joints] = {};                      // of duration: 1 / typical speed of a joint (s/rad)
};

/// The terms of an objective along a curve, without weights.
struct Terms {
    double travel = 0, limits = 0, singularities = 0, psi = 0, duration = 0;

    /// The weighted sum of all terms.
    double weighed(const Objective& w) const noexcept {
        return w.travel * travel + w.limits * limits + w.singularities * singularities + w.psi * psi +
               w.duration * duration;
    }
};

/// Parameters of the objective of a plan.
struct ObjectiveTuning {
    static constexpr double reference = 0.2;  // r of the cost (rad)
    static constexpr double floor = 0.02;     // below this distance the cost is its tangent (rad) ...
    static constexpr double home = 0.1;       // ... and below this one from a singularity
    static constexpr double still = 1e-6;  // time for a unit of s without motion: keeps the pace smooth (s)
};

/// The typical speed (rad/s) of a joint on a path that turns the arm by `length` (rad): its greatest, or the
/// speed that it reaches with this acceleration over that distance.
inline double joint_speed(double velocity, double acceleration, double length) noexcept {
    return min(velocity, std::sqrt(acceleration * length));
}

/// The time for a unit of s (s) at rates dq/ds of the joints, to the power of 8; slowness (s/rad): time of
/// each joint for a radian. It is the largest time of a joint, as the smooth norm of order 8 of all, which is
/// up to 28 % more.
inline double pace_to_8(const double* slowness, const double* rate) noexcept {
    const double least = ObjectiveTuning::still * ObjectiveTuning::still;
    double sum = least * least * least * least;
    for (int j = 0; j < joints; ++j) {
        const double x = slowness[j] * rate[j], square = x * x;
        sum += square * square * square * square;
    }
    return sum;
}
/// The time for a unit of s (s) at rates dq/ds of the joints: up to 28 % more than the largest of slowness
/// |rate|.
inline double pace(const double* slowness, const double* rate) noexcept {
    return std::sqrt(std::sqrt(std::sqrt(pace_to_8(slowness, rate))));
}

/// The derivatives of the pace n by the rates of joints: its gradient has the entries `slope`, its Hessian
/// has `curved` on the diagonal, minus 7 / n times the product of two slopes.
struct PaceSlope {
    double slope, curved;
};
/// The entries for one joint at pace n. With x = slowness rate, the slope is slowness (x / n)^7.
inline PaceSlope pace_slope(double slowness, double rate, double n) noexcept {
    const double share = slowness * rate / n, cubed = share * share * share;
    return {slowness * cubed * cubed * share, 7 * slowness * slowness * cubed * cubed / n};
}

/// The weighted cost of the time for a unit of s at joint rates dq/ds, on a path that turns the arm by
/// `length` (rad); 0 if the objective does not weigh duration.
inline double hurry(const Objective& w, double length, const double* rate) noexcept {
    return w.duration > 0 ? w.duration * length * pace(w.slowness, rate) : 0.0;
}

/// The kind of a distance.
enum class Kind { limit, singularity };

/// The objective's weight for distances of this kind.
inline double weight(const Objective& objective, Kind kind) noexcept {
    return kind == Kind::limit ? objective.limits : objective.singularities;
}

/// The cost of a distance (rad) from a limit or a singularity; 0 from `enough` on, and everywhere if `enough`
/// is not above the floor. Below a floor the cost is its tangent, so that it is finite at distance 0, where a
/// path may begin. The slope there is finite too, so that the path leaves calmly, and it points outward, so
/// that it does leave. The floor is higher for singularities, since many motions begin at theta_2 = 0 or
/// theta_6 = 0.
template <class T>
T cost(const T& distance, Kind kind, double enough) noexcept {
    if (!(distance < T(enough)) || enough <= ObjectiveTuning::floor) return T(0.0);
    const double floor =
        kind == Kind::limit ? ObjectiveTuning::floor : min(ObjectiveTuning::home, 0.5 * enough);
    const T held = max(distance, T(floor));
    const T share = T(ObjectiveTuning::reference) / held;
    const T near = share - T(ObjectiveTuning::reference / enough);
    return near * near + T(2.0) * near * share * (held - distance) / held;
}

/// The cost 2 - 2 cos(gap) of an angle `gap` (rad) between the arm angle and its target; 0 if `gap` is NaN,
/// that is without a target.
inline double wish_cost(double gap) noexcept { return gap == gap ? 2 - 2 * sin_cos(gap).cos : 0.0; }

namespace detail {

/// Calls take(distance, kind) with the distances (rad) of joint value q from the finite limits of joint j;
/// negative beyond.
template <class T, class Take>
void limit_distances(const Task& task, int j, const T& q, const Take& take) {
    if (task.limits.lower[j] > -infinity) take(q - T(task.limits.lower[j]), Kind::limit);
    if (task.limits.upper[j] < infinity) take(T(task.limits.upper[j]) - q, Kind::limit);
}

/// Calls take(distance, kind) with the distances (rad) of theta from 0 and +-pi, where the arm is singular,
/// minus the requested margin.
template <class T, class Take>
void singular_distances(const Task& task, const T& theta, const Take& take) {
    const T size = abs(wrap(theta));
    take(size - T(task.table.margin), Kind::singularity);
    take(T(pi - task.table.margin) - size, Kind::singularity);
}

}  // namespace detail

/// Calls take(distance, kind) for the distances (rad) from limits and singularities, without joint 4, which
/// is the same for every phi.
template <class T, class Take>
void distances(const Task& task, const T* q, const Take& take) {
    for (int j = 0; j < joints; ++j)
        if (j != 3) detail::limit_distances(task, j, q[j], take);
    for (const int j : {1, 5}) {
        const T theta = to_theta(q[j], T(task.arm.sign[j]), T(task.arm.offset[j]));
        detail::singular_distances(task, theta, take);
    }
}

/// The rating of a configuration.
struct Rating {
    double margin = infinity;  // rad: the least distance
    double cost = 0;           // of all distances, weighted
};

/// The least margin (rad) and the cost of limits and singularities at joints q, without joint 4; terms of
/// weight 0 do not count.
inline Rating rating(const Task& task, const Objective& objective, const double* q) noexcept {
    Rating out;
    distances(task, q, [&](double distance, Kind kind) {
        if (!(weight(objective, kind) > 0)) return;
        out.margin = min(out.margin, distance);
        out.cost += weight(objective, kind) * cost(distance, kind, objective.enough);
    });
    return out;
}

/// The margin (rad) of joint 4 at q_4 and theta_4 - delta = +-eta, without terms of weight 0. It depends on
/// the path, not on phi.
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
