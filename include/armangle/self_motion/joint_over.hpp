// What one joint does over a cell of one number, the free number of a self-motion or s of a path: enclosed by
// its direction (y, x), run on Jet<Interval, 1>.
//
//     y |   /|     theta = middle + off: by the directions themselves, and by their slope about the middle
//       |  /_|x
#pragma once

#include "../numbers/interval.hpp"
#include "../numbers/jet.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

inline constexpr double angle_rounding = 4e-15;  // rad: of an angle computed in double

/// Bounds of one joint angle (rad) over a cell of a parameter: its value at the middle, the range of its
/// difference from that value, and the range of its derivative.
struct JointOver {
    double middle;   // rad, theta
    Interval off;    // theta - middle over the cell
    Interval slope;  // d theta / d of the number
};

/// A joint angle that follows a straight line up to a bounded error: middle + t along + e (rad), with |t| <=
/// 1 and |e| <= beside.
struct StraightJoint {
    double middle, along, beside;
};

/// Bounds a joint over a cell of half width `half` by a straight line plus an error. The line has the mean
/// slope if `sloped` is true and this makes the error smaller; else it is constant.
inline StraightJoint straight_joint(const JointOver& joint, double half, bool sloped) noexcept {
    const double within = 0.5 * (joint.off.hi - joint.off.lo),
                 beside = 0.5 * half * (joint.slope.hi - joint.slope.lo);
    if (sloped && beside < within)
        return {joint.middle, half * joint.slope.middle(), above(beside) + angle_rounding};
    return {joint.middle + joint.off.middle(), 0.0, above(within) + angle_rounding};
}

/// Bounds the joint angle atan2(y, x) over a cell of half width `half`, starting from its value theta at the
/// middle (`about`: sine and cosine of theta). An infinite `half` skips the bound by the slope, so that theta
/// may belong to any point of the cell. `off` is unbounded if the angle may differ from theta by 90 degrees
/// or more.
inline JointOver joint_over(const Jet<Interval, 1>& y, const Jet<Interval, 1>& x, double theta,
                            const SinCos<double>& about, double half) noexcept {
    const Interval along = x.value() * Interval(about.cos) + y.value() * Interval(about.sin);
    const Interval across = y.value() * Interval(about.cos) - x.value() * Interval(about.sin);
    JointOver out{theta, Interval::whole(), Interval::whole()};
    if (!(along.lo > 0) || !along.bounded() || !across.bounded()) return out;
    const Interval tangent = across / along;
    out.off = {atan2(tangent.lo, 1.0) - angle_rounding, atan2(tangent.hi, 1.0) + angle_rounding};
    const Interval size = square(x.value()) + square(y.value());
    out.slope = (x.value() * y.coefficient[1] - y.value() * x.coefficient[1]) / size;
    if (!out.slope.bounded() || !(half < infinity)) return out;
    const double reach = above(half * greater(abs(out.slope.lo), abs(out.slope.hi))) + 2.0 * angle_rounding;
    out.off = meet(out.off, {-reach, reach});
    return out;
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
