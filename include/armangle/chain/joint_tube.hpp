// Tubes of joints along a path, of any arm whose joints solve seven equations: a cubic of s and radii, and
// the proof that one posture lies in them for every s (certify.hpp explains the method).
#pragma once

#include "../numbers/interval.hpp"
#include "corrected_curve.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of tubes of joints.
struct JointTubeTuning {
    static constexpr double least_radius =
        1e-8;                            // rad: more than what two segments may lie apart turns a joint
    static constexpr double tube = 4.0;  // a radius over the defect that it has to hold
    static constexpr double largest_radius = 0.1;  // rad
};

namespace detail {

/// The largest absolute value in an interval.
inline double size_of(const Interval& x) noexcept { return greater(std::fabs(x.lo), std::fabs(x.hi)); }

/// Bounds of the joint angles over the parameters |s - middle| <= half: a cubic and a radius for each joint.
/// The true arm has exactly one posture within `radius` of the cubic, and it is within `within`.
struct JointTube {
    double middle, half;
    double theta[joints][4];  // Taylor coefficients at the middle
    double radius[joints];    // of the box that holds one posture alone
    double within[joints];    // how near to the cubic that posture is

    /// The range (rad) of the cubic of joint j (0..6) over parameters middle + off, widened by `more` on both
    /// sides.
    Interval range(int j, const Interval& off, double more) const noexcept {
        const double* c = theta[j];
        const Interval cubic =
            Interval(c[0]) + off * (Interval(c[1]) + off * (Interval(c[2]) + off * Interval(c[3])));
        return cubic + Interval(-more, more);
    }
};

/// Computes the tube of the piece [from, to] in `out` from the Taylor coefficients of the joint angles at its
/// middle and the inverse of the Jacobian there; returns whether it is proven to hold one posture.
/// equations(s, angle) returns the seven equations on Taylor coefficients.
template <class Equations>
bool enclose_joints(const Equations& equations, const Jet<double, 3> (&series)[joints],
                    const InverseSlope<double>& back, double from, double to, JointTube& out) noexcept {
    using J = Jet<Interval, 2>;
    using Row = SevenEquations<Interval>::Row;
    out.middle = 0.5 * (from + to);
    out.half = greater(above(out.middle - from), above(to - out.middle));
    for (int j = 0; j < joints; ++j)
        for (int k = 0; k < 4; ++k) out.theta[j][k] = series[j].coefficient[k];
    const auto within = [&](const Interval& s, const double* radius) {
        const J at = J::variable(s), off = at - J(out.middle);
        SinCos<J> turned[joints];
        for (int j = 0; j < joints; ++j) {
            const double* c = out.theta[j];
            J theta = J(c[0]) + off * (J(c[1]) + off * (J(c[2]) + off * J(c[3])));
            theta = theta + J(Interval(-radius[j], radius[j]));
            turned[j] = sin_cos(theta);
        }
        return equations(at, turned);
    };
    const auto order = [](const SevenEquations<J>::Row& row, int k) {
        return CorrectedCurve::order<Interval, 2>(row, k);
    };
    const auto times = [&back](int i, const Row& row) {
        const auto& c = back.row[i];
        return dot(spread<Interval>(c.wrist), row.wrist) + dot(spread<Interval>(c.turn), row.turn) +
               Interval(c.psi) * row.psi;
    };
    const Interval middle(out.middle), piece(from, to), off(-out.half, out.half);
    const double none[joints] = {};
    const auto left_there = within(middle, none).left;
    const auto left = within(piece, none).left;
    double defect[joints];
    const Interval far(0.0, above(out.half * out.half));
    for (int i = 0; i < joints; ++i) {
        const Interval first = times(i, order(left_there, 1)) * off;
        defect[i] = size_of(times(i, order(left_there, 0)) + first + times(i, order(left, 2)) * far);
        out.radius[i] = JointTubeTuning::least_radius + JointTubeTuning::tube * defect[i];
        if (!(out.radius[i] < JointTubeTuning::largest_radius)) return false;
    }
    const auto there = within(middle, out.radius), over = within(piece, out.radius);
    for (int i = 0; i < joints; ++i) {
        double sum = defect[i];
        for (int k = 0; k < joints; ++k) {
            const Interval entry = times(i, order(there.column[k], 0)) +
                                   times(i, order(over.column[k], 1)) * off - Interval(i == k ? 1.0 : 0.0);
            sum = above(sum + above(size_of(entry) * out.radius[k]));
        }
        out.within[i] = sum;
        if (!(sum < out.radius[i])) return false;
    }
    return true;
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
