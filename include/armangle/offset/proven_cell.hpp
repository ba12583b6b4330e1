// Proofs for a whole cell of a reach map of an arm with an offset (limits/proven_cell.hpp), by mean value
// forms.
//
// The closed form runs on a box of r, height, tilt and turn, and of the free joint. At the middle of the
// widest interval of the cell's middle all joints are within their limits over the whole box: then every pose
// of the cell is reachable at some azimuth and roll. If the middle is unreachable, boxes cover all values of
// the free joint, and in each of them every branch has no posture, or a joint beyond its limits.
#pragma once

#include "../limits/proven_cell.hpp"
#include "../numbers/mean_value.hpp"
#include "cells.hpp"
#include "freedom.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Proves one cell, branch by branch.
class OffsetCellProof {
public:
    /// Computes the poses of a cell as one box; the arm has no base and no tool.
    OffsetCellProof(const OffsetArm& arm, const ReducedPose& at, const CellSize& half) noexcept
        : arm_(arm),
          pose_(reduced_flange(arm.own, ReducedNumbers<Number>{Number::variable(0, at.r, half.r),
                                                               Number::variable(1, at.height, half.height),
                                                               Number::variable(2, at.tilt, half.tilt),
                                                               Number::variable(3, at.turn, half.turn),
                                                               Number(0.0), Number(0.0)})) {}

    /// Whether branch gc keeps all limits over the whole box at all values free +- half (rad) of the free
    /// joint, or nowhere.
    Known look(int gc, double free, double half) const noexcept {
        const Arm& rest = arm_.rest;
        const Number value = Number::variable(4, free, half);
        const SinCos<Number> theta_7 = sin_cos(Number(rest.sign[6]) * value + Number(rest.offset[6]));
        const OffsetMotion<Number> motion = offset_motion(arm_, pose_, gc);
        const OffsetWrist<Number> wrist = offset_wrist(arm_, motion, theta_7);
        if (wrist.excess.range.lo > 0 || wrist.inside.range.hi < 0) return Known::outside;
        const ThetaRanges ranges = ranges_of(motion.branch);
        for (int i = 0; i < ranges.count; ++i) {  // before the other joints are computed
            const ThetaRanges::One& one = ranges.one[i];
            if (one.joint == 3 &&
                keeps(one, enclosed(wrist.theta_4.sin, wrist.theta_4.cos)) == Known::outside)
                return Known::outside;
        }
        const Directions<Number> d = directions(motion, wrist, theta_7, sqrt(wrist.inside));
        bool inside = wrist.excess.range.hi <= 0 && wrist.inside.range.lo > 0;
        for (int i = 0; i < ranges.count; ++i) {
            const int j = ranges.one[i].joint;
            const Known kept = keeps(ranges.one[i], enclosed(d.y[j], d.x[j]));
            if (kept == Known::outside) return Known::outside;
            inside = inside && kept == Known::inside;
        }
        return inside ? Known::inside : Known::open;
    }

    /// Whether it is proven that branch gc holds no pose of the box at any value of the free joint in [lower,
    /// upper] (rad), which may be halved `halvings` times.
    bool none(int gc, double lower, double upper, int halvings) const noexcept {
        const double middle = 0.5 * (lower + upper);
        const Known known = look(gc, middle, above(0.5 * (upper - lower)));
        if (known == Known::outside) return true;
        if (known == Known::inside || halvings == 0) return false;
        return none(gc, lower, middle, halvings - 1) && none(gc, middle, upper, halvings - 1);
    }

private:
    using Number = MeanValue<5>;

    /// The ranges of the joint limits, in the order of the formulas, and of the singularity margin.
    ThetaRanges ranges_of(const OffsetBranch& branch) const noexcept {
        ThetaRanges out(arm_.rest, arm_.rest.limits, 0.0, branch);
        if (arm_.margin > 0) {
            out.keep_off(1, 0.0, branch.shoulder, arm_.margin);
            out.keep_off(3, arm_.rest.delta_angle, branch.elbow, arm_.margin);
        }
        return out;
    }

    /// Bounds the angle of a direction over the box, by the direction itself and by its slopes.
    static JointOver enclosed(const Number& y, const Number& x) noexcept {
        const bool known = y.middle.bounded() && x.middle.bounded();
        const double down = (known ? y.middle : y.range).middle(),
                     along = (known ? x.middle : x.range).middle(), size = std::hypot(down, along);
        const JointOver unknown{0.0, Interval::whole(), Interval::whole()};
        if (!(size > 0 && size < infinity)) return unknown;
        const SinCos<double> about{down / size, along / size};
        const auto tangent = [&about](const Interval& of_y, const Interval& of_x) {
            const Interval ahead = of_x * Interval(about.cos) + of_y * Interval(about.sin),
                           beside = of_y * Interval(about.cos) - of_x * Interval(about.sin);
            return ahead.lo > 0 ? beside / ahead : Interval::whole();
        };
        const auto angles = [](const Interval& of, double more) {
            return Interval(atan2(of.lo, 1.0) - more - angle_rounding,
                            atan2(of.hi, 1.0) + more + angle_rounding);
        };
        const Interval over = tangent(y.range, x.range);
        if (!over.bounded()) return unknown;
        JointOver out{atan2(about.sin, about.cos), angles(over, 0.0), Interval::whole()};
        const Interval square_size = square(x.range) + square(y.range);
        const double reach = Number::made(Interval::whole(), Interval::whole(), [&](int i) {
                                 return (x.range * y.slope[i] - y.range * x.slope[i]) / square_size;
                             }).reach();
        const Interval here = tangent(y.middle, x.middle);
        if (reach < infinity && here.bounded()) out.off = meet(out.off, angles(here, reach));
        return out;
    }

    const OffsetArm& arm_;
    Pose<Number> pose_;
};

}  // namespace detail

/// Tries to prove a cell of this size around a reduced pose. The value of the free joint (rad) and gc (0..7)
/// solve its middle; gc is -1 if the middle is unreachable.
inline Proven proven_cell(const ReducedArm<OffsetArm>& arm, const ReducedPose& middle, const CellSize& half,
                          double free, int gc) noexcept {
    const detail::OffsetCellProof proof(arm.free, middle, half);
    if (gc >= 0) return proof.look(gc, free, 0.0) == Known::inside ? Proven::all : Proven::unknown;
    const double step = two_pi / ProvenCellTuning::boxes;
    for (int branch = 0; branch < configurations; ++branch)
        for (int k = 0; k < ProvenCellTuning::boxes; ++k)
            if (!proof.none(branch, -pi + k * step, -pi + (k + 1) * step + 1e-12, ProvenCellTuning::halvings))
                return Proven::unknown;
    return Proven::none;
}

}  // namespace armangle

#include "../names/end.hpp"
