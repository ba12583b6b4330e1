// Number of joints, and seven joint values in one register.
#pragma once

#include "../numbers/lane.hpp"
#include "../numbers/tolerances.hpp"

#include "../names/begin.hpp"

namespace armangle {

inline constexpr int joints = 7;
/// Arrays over joints have one padding entry, always 0, to fill whole registers.
inline constexpr int joint_slots = 8;

/// One configuration, not a batch: lane j holds the value of joint j + 1, the eighth lane 0.
using JointLanes = Lane<joint_slots>;

/// The seven joint values of one configuration as lanes.
ARMANGLE_INLINE JointLanes joint_lanes(const double* q) noexcept {
    const double padded[joint_slots] = {q[0], q[1], q[2], q[3], q[4], q[5], q[6], 0.0};
    return JointLanes::of(padded);
}

/// Whether all seven joint values are finite and at most tolerance::largest_angle.
ARMANGLE_INLINE bool is_finite(const JointLanes& q) noexcept {
    return all(abs(q) <= JointLanes(tolerance::largest_angle));
}
/// Whether all of seven joint values are finite and at most tolerance::largest_angle.
inline bool is_finite(const double* q) noexcept { return is_finite(joint_lanes(q)); }

namespace detail {

/// Largest difference of one joint between two configurations (rad); no operand may be NaN.
ARMANGLE_INLINE double largest_move(const JointLanes& a, const JointLanes& b) noexcept {
    return -least(-abs(a - b));
}
/// The largest difference (rad) of a joint between two arrays of seven joint values; none may be NaN.
inline double largest_move(const double* a, const double* b) noexcept {
    return largest_move(joint_lanes(a), joint_lanes(b));
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
