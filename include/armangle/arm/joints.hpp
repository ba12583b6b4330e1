// Joint values q and model angles theta, windings, and the distance to limits: the only lines that know the
// joint map.
#pragma once

#include "arm.hpp"

namespace armangle {

/// Seven values as lanes; the eighth is 0.
using JointLanes = Lane<joint_slots>;

ARMANGLE_INLINE JointLanes joint_lanes(const double* q) noexcept {
    const double padded[joint_slots] = {q[0], q[1], q[2], q[3], q[4], q[5], q[6], 0.0};
    return JointLanes::of(padded);
}

/// theta of a joint value q.
template <class T>
ARMANGLE_INLINE T to_theta(T q, T sign, T offset) noexcept {
    return sign * q + offset;
}

/// The q of a theta that lies within [lower, upper]; of several the nearest to `near`, of none the nearest to
/// the range.
template <class T>
ARMANGLE_INLINE T to_q(T theta, T sign, T offset, T lower, T upper, T near) noexcept {
    const T q = sign * (theta - offset);
    const T turn = 1.0 / two_pi;
    const T wanted = round((near - q) * turn);
    const T nearest = q + two_pi * wanted;
    if (all((lower - tolerance::angle <= nearest) & (nearest <= upper + tolerance::angle))) return nearest;
    const T fewest = ceil((lower - tolerance::angle - q) * turn);
    const T most = floor((upper + tolerance::angle - q) * turn);
    const T below = q + two_pi * most, above = q + two_pi * fewest;  // used when the range holds no winding
    const T inside = q + two_pi * min(max(wanted, fewest), most);
    const T outside = select(lower - below < above - upper, below, above);
    return select(most < fewest, outside, inside);
}

/// Whether all seven joint values are finite, and not beyond any sense.
ARMANGLE_INLINE bool is_finite(const JointLanes& q) noexcept {
    return all(abs(q) <= JointLanes(tolerance::largest_angle));
}
inline bool is_finite(const double* q) noexcept { return is_finite(joint_lanes(q)); }

/// Least distance to a limit over all joints; infinite without limits, NaN where a joint is not finite.
ARMANGLE_INLINE double limit_margin(const Arm& arm, const JointLanes& q) noexcept {
    if (any(!(q == q))) return not_a_number;  // min would pass over it
    return least(min(q - JointLanes::load(arm.joint_lower), JointLanes::load(arm.joint_upper) - q));
}
inline double limit_margin(const Arm& arm, const double* q) noexcept {
    return limit_margin(arm, joint_lanes(q));
}

inline bool within_limits(const Arm& arm, const double* q, double slack) noexcept {
    return limit_margin(arm, q) >= -slack;
}

namespace detail {

/// Largest move of a joint; no operand may be NaN.
ARMANGLE_INLINE double largest_move(const JointLanes& a, const JointLanes& b) noexcept {
    return -least(-abs(a - b));
}
inline double largest_move(const double* a, const double* b) noexcept {
    return largest_move(joint_lanes(a), joint_lanes(b));
}

}  // namespace detail

}  // namespace armangle
