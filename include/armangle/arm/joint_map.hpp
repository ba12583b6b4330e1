// Joint values q and model angles theta, and the windings between them: the only lines that know the joint
// map.
#pragma once

#include "arm.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// theta of a joint value q.
template <class T>
ARMANGLE_INLINE T to_theta(T q, T sign, T offset) noexcept {
    return sign * q + offset;
}

/// The q of a theta, on the turn as it comes.
template <class T>
ARMANGLE_INLINE T to_q(T theta, T sign, T offset) noexcept {
    return sign * (theta - offset);
}

/// theta of joint j (0..6) at q, and q of its theta.
inline double to_theta(const Arm& arm, int j, double q) noexcept {
    return to_theta(q, arm.sign[j], arm.offset[j]);
}
inline double to_q(const Arm& arm, int j, double theta) noexcept {
    return to_q(theta, arm.sign[j], arm.offset[j]);
}

/// The limits of a joint as a range of theta.
struct ThetaRange {
    double lower, upper;
};

/// The range of theta that joint j's limits leave; a sign of -1 turns it round.
inline ThetaRange theta_range(const Arm& arm, const Limits& limits, int j) noexcept {
    const double a = to_theta(arm, j, limits.lower[j]), b = to_theta(arm, j, limits.upper[j]);
    return {min(a, b), max(a, b)};
}

/// The q of a theta that lies within [lower, upper]; of several the nearest to `near`, of none the nearest to
/// the range.
template <class T>
ARMANGLE_INLINE T to_q(T theta, T sign, T offset, T lower, T upper, T near) noexcept {
    const T q = to_q(theta, sign, offset);
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

namespace detail {

/// How far a joint's value is from a model angle, on the turn about it.
inline double off_angle(const Arm& arm, int joint, double zero, double q) noexcept {
    return wrap(to_theta(arm, joint, q) - zero);
}

/// How far a hinge's value is from straight, theta_2, theta_4 - delta or theta_6, on the turn about it.
inline double bend(const Arm& arm, int hinge, double q) noexcept {
    return off_angle(arm, hinge, hinge == 3 ? arm.delta_angle : 0.0, q);
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
