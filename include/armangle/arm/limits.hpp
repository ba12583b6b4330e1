// Joint limits, and distances to them, in the robot's joint coordinates q. Limits are separate from the arm.
// They also hold the box of one step, limits narrowed by a margin, and limits widened to explain a rejection.
#pragma once

#include "joints.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// rad; +-infinity means no limit. The padding slot has no limits.
struct Limits {
    double lower[joint_slots] = {-infinity, -infinity, -infinity, -infinity,
                                 -infinity, -infinity, -infinity, -infinity};
    double upper[joint_slots] = {infinity, infinity, infinity, infinity,
                                 infinity, infinity, infinity, infinity};
};

/// Whether a joint (0..6) has neither limit (both infinite), so that any of its revolutions is allowed.
inline bool is_unlimited(const Limits& limits, int joint) noexcept {
    return limits.lower[joint] == -infinity && limits.upper[joint] == infinity;
}

/// Middle of the range of a joint (0..6), rad; 0 unless both limits are finite.
inline double middle(const Limits& limits, int joint) noexcept {
    const double lower = limits.lower[joint], upper = limits.upper[joint];
    return lower > -infinity && upper < infinity ? 0.5 * (lower + upper) : 0.0;
}

/// Limits that keep those of one joint (0..6) and none of the others.
inline Limits limits_of_one(const Limits& limits, int joint) noexcept {
    Limits out;
    out.lower[joint] = limits.lower[joint];
    out.upper[joint] = limits.upper[joint];
    return out;
}

/// The limits with the range of each joint narrowed by `margin` (rad) at both ends.
inline Limits drawn_in(Limits limits, double margin) noexcept {
    for (int j = 0; j < joints; ++j) {
        limits.lower[j] += margin;
        limits.upper[j] -= margin;
    }
    return limits;
}

/// Distance to the nearest joint limit (rad): negative outside, infinite without limits, NaN if a joint is
/// NaN.
ARMANGLE_INLINE double limit_margin(const Limits& limits, const JointLanes& q) noexcept {
    if (any(is_nan(q))) return not_a_number;  // min would ignore NaN
    return least(min(q - JointLanes::load(limits.lower), JointLanes::load(limits.upper) - q));
}
/// The distance (rad) of seven joint values to the nearest limit; negative outside, infinite without limits,
/// NaN if a joint is NaN.
inline double limit_margin(const Limits& limits, const double* q) noexcept {
    return limit_margin(limits, joint_lanes(q));
}

/// Writes the gradient of limit_margin with respect to the joints to `out`: +1 or -1 at the joint whose limit
/// is nearest, 0 elsewhere and without limits. NaN if a joint is NaN.
inline void limit_margin_gradient(const Limits& limits, const double* q, double (&out)[joints]) noexcept {
    const double least = limit_margin(limits, q);
    int nearest = -1;
    double slope = 0;
    for (int j = 0; j < joints; ++j) {
        out[j] = least == least ? 0.0 : not_a_number;
        const bool lower = q[j] - limits.lower[j] == least;
        if (nearest >= 0 || !(lower || limits.upper[j] - q[j] == least)) continue;
        nearest = j;
        slope = lower ? 1.0 : -1.0;
    }
    if (nearest >= 0 && least < infinity) out[nearest] = slope;
}

/// Whether no joint violates its limits by more than `slack` (rad); false for NaN.
inline bool within_limits(const Limits& limits, const double* q, double slack) noexcept {
    return limit_margin(limits, q) >= -slack;
}

}  // namespace armangle

#include "../names/end.hpp"
