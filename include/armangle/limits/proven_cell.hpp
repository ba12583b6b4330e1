// Proofs for a whole cell of a reach map instead of its middle alone, by interval arithmetic.
//
// The circle's formulas run on boxes of (r, height, tilt, turn). For the middle of the widest arc of the
// cell's middle, joints 2 to 6 are evaluated. If they are within their limits over the whole box, every pose
// of the cell is reachable at some azimuth and roll. If the middle is unreachable, boxes cover all psi, and
// in each box some joint of every branch must violate its limits. Interval arithmetic decides with certainty
// or not at all: R. E. Moore, Interval Analysis (1966).
#pragma once

#include "../numbers/interval.hpp"
#include "reduced_pose.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What is proven for all poses of a cell: nothing; each is reachable at some azimuth and roll; none is
/// reachable.
enum class Proven : std::uint8_t { unknown, all, none };

/// Half the extent of a cell along each of its axes (m, m, rad, rad).
struct CellSize {
    double r, height, tilt, turn;
};

/// Parameters of the proof of a cell of a reach map.
struct ProvenCellTuning {
    static constexpr int boxes = 12;  // number of boxes that cover psi
    static constexpr int halvings = 3;
};

namespace detail {

/// Whether a direction (V, U) is inside a cone for all members of its intervals, or outside for all.
struct ConeVerdict {
    bool inside, outside;
};

/// Whether an angle with these bounds of sine and cosine is certainly in a cone, or certainly outside.
inline ConeVerdict cone_verdict(const Cone& cone, const Interval& sine, const Interval& cosine) noexcept {
    if (cone.free) return {true, false};
    const Interval above = sine * Interval(cone.lower.cos) - cosine * Interval(cone.lower.sin),
                   below = Interval(cone.upper.sin) * cosine - Interval(cone.upper.cos) * sine;
    const double slack = tolerance::angle;  // the cone's own sine and cosine are rounded
    const bool in_lower = above.lo > slack, in_upper = below.lo > slack, off_lower = above.hi < -slack,
               off_upper = below.hi < -slack;
    if (cone.wide) return {in_lower || in_upper, off_lower && off_upper};
    return {in_lower && in_upper, off_lower || off_upper};
}

/// Whether |theta| of joint 2 or 6 (`hinge`: 0, 1), whose cosine is in H, is for certain inside one of the
/// ranges permitted for that sign of theta (negative: 1), or outside all.
inline ConeVerdict hinge_verdict(const LimitTable& t, int hinge, int negative, const Interval& H) noexcept {
    ConeVerdict out{false, true};
    for (int k = 0; k < t.piece_count[hinge][negative]; ++k) {
        const HingePiece& piece = t.piece[hinge][negative][k];
        const double most = piece.near.tag ? 1.0 - piece.near.below_one : 2.0,
                     least = piece.far.tag ? 1.0 - piece.far.below_one : -2.0;
        out.inside |= H.hi < most - tolerance::angle && H.lo > least + tolerance::angle;
        out.outside &= H.lo > most + tolerance::angle || H.hi < least - tolerance::angle;
    }
    return out;
}

/// The circle, in intervals, of a box of reduced poses.
inline Circle<Interval> circle_of_box(const Arm& arm, const ReducedPose& at, const CellSize& half) noexcept {
    const auto box = [](double middle, double size) {
        return Interval(below(middle - size), above(middle + size));
    };
    const Interval r = box(at.r, half.r), height = box(at.height, half.height), zero(0.0);
    Circle<Interval> c;
    c.distance = hypot(r, height);
    c.nearest = tolerance::folded * arm.reach;
    const auto ratio = [&c](const Interval& a) { return meet(a / c.distance, Interval(-1.0, 1.0)); };
    c.w = {ratio(r), zero, ratio(height)};
    c.z = {zero, Interval(-1.0), zero};
    c.e = {c.w.z, zero, -c.w.x};
    const SinCos<Interval> tilt = sin_cos(box(at.tilt, half.tilt)), turn = sin_cos(box(at.turn, half.turn));
    // x_7 and y_7 affect joint 7 alone, which is not evaluated
    c.tool_w = {zero, zero, tilt.cos};
    c.tool_e = {zero, zero, tilt.sin * turn.cos};
    c.tool_z = {zero, zero, tilt.sin * turn.sin};
    c.triangle = triangle(arm, c.distance);
    return c;
}

/// Proves one cell for one sign of the elbow.
class CellProof {
public:
    /// Computes joint functions over all poses of a cell, given as intervals, and whether joint 4 is within
    /// its limits for all or none of them. `side`: elbow + (0) or - (1).
    CellProof(const ReducedArm<Arm>& arm, const Circle<Interval>& c, int side) noexcept : t_(arm.free_table) {
        SelfMotion<Interval> m =
            self_motion(arm.free, c, Configuration<Interval>{1.0, side ? -1.0 : 1.0, 1.0});
        const ConeVerdict elbow = cone_verdict(t_.elbow, m.elbow.theta_4.sin, m.elbow.theta_4.cos);
        const bool beyond = c.distance.lo > arm.free.reach || c.distance.hi < arm.free.inner_reach;
        none_ = beyond || elbow.outside || c.triangle.eta.sin.hi < t_.sin_margin;
        whole_ = elbow.inside && c.distance.hi < arm.free.reach && c.distance.lo > arm.free.inner_reach &&
                 c.triangle.eta.sin.lo > t_.sin_margin;
        if (!none_) f_ = joint_functions(m);
    }

    /// Whether a branch of this elbow (1: theta_2, theta_6 is negative) is proven within its limits over the
    /// whole box at psi.
    bool holds(double psi, int gc_2, int gc_6) const noexcept {
        if (!whole_) return false;
        const SinCos<Interval> at = sin_cos(Interval(psi));
        return side(0, gc_2, at).inside && side(1, gc_6, at).inside;
    }

    /// Whether it is proven that no branch of this elbow reaches any part of the box at a psi in [lower,
    /// upper], which may be halved `halvings` times.
    bool none(double lower, double upper, int halvings) const noexcept {
        if (none_) return true;
        const SinCos<Interval> at = sin_cos(Interval(lower, upper));
        bool open[2][2];
        for (int half = 0; half < 2; ++half)
            for (int negative = 0; negative < 2; ++negative)
                open[half][negative] = !side(half, negative, at).outside;
        if (!((open[0][0] || open[0][1]) && (open[1][0] || open[1][1]))) return true;
        if (halvings == 0) return false;
        const double middle = 0.5 * (lower + upper);
        return none(lower, middle, halvings - 1) && none(middle, upper, halvings - 1);
    }

private:
    const LimitTable& t_;
    bool none_ = false, whole_ = false;
    JointFunctions<Interval> f_;

    /// The verdict for joints 2 and 3 (half 0) or joints 5 and 6 (half 1), for theta_2 or theta_6 < 0 if
    /// `negative` is 1.
    ConeVerdict side(int half, int negative, const SinCos<Interval>& at) const noexcept {
        const int pivot = half == 0 ? 1 : 2;
        const Interval g(negative ? -1.0 : 1.0);
        const ConeVerdict a = hinge_verdict(t_, half, negative, f_.hinge[half].H.at(at)),
                          b = cone_verdict(t_.cone[pivot], g * f_.pivot[pivot].U.at(at),
                                           g * f_.pivot[pivot].V.at(at));
        return {a.inside && b.inside, a.outside || b.outside};
    }
};

}  // namespace detail

/// Tries to prove a cell of this size around a reduced pose. psi and gc (0..7) solve its middle; gc is -1 if
/// the middle is unreachable.
inline Proven proven_cell(const ReducedArm<Arm>& arm, const ReducedPose& middle, const CellSize& half,
                          double psi, int gc) noexcept {
    const Circle<Interval> c = detail::circle_of_box(arm.free, middle, half);
    if (gc >= 0) {
        const detail::CellProof proof(arm, c, gc >> 1 & 1);
        return proof.holds(psi, gc & 1, gc >> 2) ? Proven::all : Proven::unknown;
    }
    const double step = two_pi / ProvenCellTuning::boxes;
    for (int side = 0; side < 2; ++side) {
        const detail::CellProof proof(arm, c, side);
        for (int k = 0; k < ProvenCellTuning::boxes; ++k)
            if (!proof.none(-pi + k * step, -pi + (k + 1) * step + 1e-12, ProvenCellTuning::halvings))
                return Proven::unknown;
    }
    return Proven::none;
}

}  // namespace armangle

#include "../names/end.hpp"
