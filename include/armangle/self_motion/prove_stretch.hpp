// Proof that joints keep their limits, and whatever else is claimed of their ways, on a stretch of a path,
// for any closed form that runs on Jet<Interval, 1>.
//
//     q |  __near the straight way__     every cell: a posture at each s, each joint less than half a turn
//       |  |~~~~~~cell~~~~~|~~~~~~~|     off the straight way (so its winding is that of the way), and
//       +--------------------------- s   within its limits; else it is halved
//
// Source: R. E. Moore, Interval Analysis (1966): the mean value form and bisection.
#pragma once

#include "../arm/joint_map.hpp"
#include "../circle/inverse.hpp"
#include "joint_over.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of prove_stretch.
struct ProofTuning {
    /// The largest number of times that an interval is halved.
    int depth = 14;
    /// The largest number of cells that are examined before the remainder is left unproven.
    int looks = 256;
    /// Limits are proven with this reserve (rad), which is more than the rounding of joint values.
    double slack = 1e-9;
    /// A limit that is exceeded by more than this (rad) is violated; up to this it is only touched.
    double broken = 4e-9;
    /// Cells with less distance from the end of the reach (a share of the reach), or with shorter direction
    /// vectors of a joint, are not proven: rounding of the joints could exceed `slack` there.
    double least_room = 1e-8, least_direction = 3e-6;
};

/// A stretch [start, end] of the path parameter s, and the joint angles at its two ends. Joint values between
/// are chosen in the revolution nearest to the straight line between both.
struct StraightWay {
    double start, end;
    const double *q, *q_end;

    /// The value (rad) of joint j (0..6) at s, in [start, end], on the straight line between both ends.
    double near(int j, double s) const noexcept {
        return q[j] + (s - start) / (end - start) * (q_end[j] - q[j]);
    }
};

namespace detail {

/// Result for one cell: everything claimed is proven, nothing is decided, or its middle violates the claim.
enum class Shown { proven, open, broken };

/// The claim that is always true: joint limits alone are proven.
struct AnyWay {
    Shown operator()(const double*, const double (&)[joints], const double (&)[joints]) const noexcept {
        return Shown::proven;
    }
};

/// Tries to prove the cell [from, to] of a stretch: limits of the joints, and `claim`. place(s, d) writes the
/// directions of the joints at s on any scalar and returns the distance from the end of the reach. claim(q,
/// d, off) states whether all joints q + t d + e with |t| <= 1 and |e_j| <= off_j (rad) fulfil the claim; it
/// returns `broken` if q itself does not.
template <class Place, class Claim>
Shown look_at_cell(const Arm& arm, const Limits& limits, const Place& place, const StraightWay& way,
                   double from, double to, const ProofTuning& tuning, const Claim& claim) noexcept {
    using Cell = Jet<Interval, 1>;
    const double middle = 0.5 * (from + to), half = greater(above(middle - from), above(to - middle));
    Directions<double> here;
    if (!(place(middle, here) > 0)) return Shown::broken;
    double q[joints], theta[joints], middles[joints], along[joints], beside[joints];
    for (int j = 0; j < joints; ++j) {
        theta[j] = atan2(here.y[j], here.x[j]);
        q[j] = lift(to_q(arm, j, theta[j]), way.near(j, middle));
        if (q[j] < limits.lower[j] - tuning.broken || q[j] > limits.upper[j] + tuning.broken)
            return Shown::broken;
    }
    Directions<Cell> d;
    if (!(place(Cell::variable({from, to}), d).value().lo > tuning.least_room)) return Shown::open;
    for (int j = 0; j < joints; ++j) {
        const Interval size = square(d.y[j].value()) + square(d.x[j].value());
        if (!(size.lo > tuning.least_direction * tuning.least_direction)) return Shown::open;
        const JointOver over = joint_over(d.y[j], d.x[j], theta[j], sin_cos(theta[j]), half);
        if (!over.off.bounded()) return Shown::open;
        const Interval range = Interval(q[j]) + (arm.sign[j] > 0 ? over.off : -over.off);
        const double a = way.near(j, from), b = way.near(j, to);
        if (!(range.hi - lesser(a, b) < pi && greater(a, b) - range.lo < pi)) return Shown::open;
        if (!(range.lo >= limits.lower[j] && range.hi <= limits.upper[j])) return Shown::open;
        const StraightJoint straight = straight_joint(over, half, true);
        middles[j] = q[j] + arm.sign[j] * (straight.middle - theta[j]);
        along[j] = arm.sign[j] * straight.along;
        beside[j] = straight.beside + angle_rounding;
    }
    return claim(middles, along, beside);
}

}  // namespace detail

/// Proves that the joints keep their limits, and `claim`, over a whole stretch, by bisection. Calls
/// left(from, to, broken) for each part that is not proven; `broken` is true if the middle of that part
/// violates a limit or the claim, or has no solution. Returns the number of cells it examined. `place`,
/// `claim`: see look_at_cell.
template <class Place, class Left, class Claim = detail::AnyWay>
int prove_stretch(const Arm& arm, const Limits& limits, const Place& place, const StraightWay& way,
                  const ProofTuning& tuning, const Left& left, const Claim& claim = {}) {
    struct Cell {
        double from, to;
        int depth;
    };
    constexpr int most = 64;
    Cell stack[most] = {{way.start, way.end, 0}};
    int looks = 0;
    for (int count = 1; count > 0;) {
        const Cell cell = stack[--count];
        const double middle = 0.5 * (cell.from + cell.to);
        const bool spent = looks >= tuning.looks;
        const detail::Shown shown =
            spent ? detail::Shown::open
                  : detail::look_at_cell(arm, limits, place, way, cell.from, cell.to, tuning, claim);
        looks += !spent;
        if (shown == detail::Shown::proven) continue;
        if (shown == detail::Shown::broken || spent || cell.depth == tuning.depth || count + 2 > most) {
            left(cell.from, cell.to, shown == detail::Shown::broken);
            continue;
        }
        stack[count++] = {middle, cell.to, cell.depth + 1};
        stack[count++] = {cell.from, middle, cell.depth + 1};
    }
    return looks;
}

}  // namespace armangle

#include "../names/end.hpp"
