// Conversion between joint values q and model angles theta, and their turns. No other file uses signs and
// offsets.
#pragma once

#include "arm.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The model angle theta (rad) of a joint value q (rad).
template <class T>
ARMANGLE_INLINE T to_theta(T q, T sign, T offset) noexcept {
    return sign * q + offset;
}

/// The joint value q = sign (theta - offset) (rad), in any revolution.
template <class T>
ARMANGLE_INLINE T to_q(T theta, T sign, T offset) noexcept {
    return sign * (theta - offset);
}

/// The model angle theta (rad) of joint j (0..6) at its value q (rad).
inline double to_theta(const Arm& arm, int j, double q) noexcept {
    return to_theta(q, arm.sign[j], arm.offset[j]);
}
/// The value (rad) of joint j (0..6) at the model angle theta (rad), in any revolution.
inline double to_q(const Arm& arm, int j, double theta) noexcept {
    return to_q(theta, arm.sign[j], arm.offset[j]);
}

/// The limits of a joint as a range of theta.
struct ThetaRange {
    double lower, upper;
};

/// The range of theta (rad) within the limits of joint j (0..6). A sign of -1 reverses it.
inline ThetaRange theta_range(const Arm& arm, const Limits& limits, int j) noexcept {
    const double a = to_theta(arm, j, limits.lower[j]), b = to_theta(arm, j, limits.upper[j]);
    return {min(a, b), max(a, b)};
}

/// The joint value q of a theta within [lower, upper], up to tolerance::angle. If several revolutions fit,
/// the one nearest to `near`; if none fits, the one nearest to the range.
template <class T>
ARMANGLE_INLINE T to_q(T theta, T sign, T offset, T lower, T upper, T near) noexcept {
    const T q = to_q(theta, sign, offset);
    const T turn = 1.0 / two_pi;
    const T wanted = round((near - q) * turn);
    const T nearest = q + two_pi * wanted;
    if (all((lower - tolerance::angle <= nearest) & (nearest <= upper + tolerance::angle))) return nearest;
    const T fewest = ceil((lower - tolerance::angle - q) * turn);
    const T most = floor((upper + tolerance::angle - q) * turn);
    const T below = q + two_pi * most, above = q + two_pi * fewest;  // used when the range holds no turn
    const T inside = q + two_pi * min(max(wanted, fewest), most);
    const T outside = select(lower - below < above - upper, below, above);
    return select(most < fewest, outside, inside);
}

namespace detail {

/// The difference (rad) between the model angle of a joint (0..6) at its value q and `zero`, wrapped to (-pi,
/// pi].
inline double off_angle(const Arm& arm, int joint, double zero, double q) noexcept {
    return wrap(to_theta(arm, joint, q) - zero);
}

/// The angle (rad, in (-pi, pi]) of joint 2, 4 or 6 (`hinge`: 1, 3, 5) from its singular position: theta_2,
/// theta_4 - delta or theta_6.
inline double bend(const Arm& arm, int hinge, double q) noexcept {
    return off_angle(arm, hinge, hinge == 3 ? arm.delta_angle : 0.0, q);
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
