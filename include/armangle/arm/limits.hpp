// Joint limits, and how far joints are from them, in the robot's own joint coordinates q. They are not the
// arm: a step's box, limits drawn in by a margin and limits moved out to explain a refusal are Limits like
// any others.
#pragma once

#include "joints.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// rad; +-infinity: no limit. The last slot stays without one.
struct Limits {
    double lower[joint_slots] = {-infinity, -infinity, -infinity, -infinity,
                                 -infinity, -infinity, -infinity, -infinity};
    double upper[joint_slots] = {infinity, infinity, infinity, infinity,
                                 infinity, infinity, infinity, infinity};
};

/// Whether a joint has no limit at all: its turns then mean nothing.
inline bool is_unlimited(const Limits& limits, int joint) noexcept {
    return limits.lower[joint] == -infinity && limits.upper[joint] == infinity;
}

/// Middle of a joint's range; 0 where it has no two ends.
inline double middle(const Limits& limits, int joint) noexcept {
    const double lower = limits.lower[joint], upper = limits.upper[joint];
    return lower > -infinity && upper < infinity ? 0.5 * (lower + upper) : 0.0;
}

/// The limits of one joint alone: the others have none.
inline Limits limits_of_one(const Limits& limits, int joint) noexcept {
    Limits out;
    out.lower[joint] = limits.lower[joint];
    out.upper[joint] = limits.upper[joint];
    return out;
}

/// The limits of all joints moved inward by `margin` (rad).
inline Limits drawn_in(Limits limits, double margin) noexcept {
    for (int j = 0; j < joints; ++j) {
        limits.lower[j] += margin;
        limits.upper[j] -= margin;
    }
    return limits;
}

/// Least distance to a limit over all joints; infinite without limits, NaN where a joint is not finite.
ARMANGLE_INLINE double limit_margin(const Limits& limits, const JointLanes& q) noexcept {
    if (any(is_nan(q))) return not_a_number;  // min would pass over it
    return least(min(q - JointLanes::load(limits.lower), JointLanes::load(limits.upper) - q));
}
/// The same of seven joint values.
inline double limit_margin(const Limits& limits, const double* q) noexcept {
    return limit_margin(limits, joint_lanes(q));
}

/// How limit_margin moves with the joints: +1 or -1 at the joint whose limit is nearest, 0 elsewhere and
/// without limits; NaN where a joint is not finite.
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

/// Whether no joint is further than `slack` (rad) outside its limits.
inline bool within_limits(const Limits& limits, const double* q, double slack) noexcept {
    return limit_margin(limits, q) >= -slack;
}

}  // namespace armangle

#include "../names/end.hpp"
