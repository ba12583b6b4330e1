// Cells of the free joint: what the joints of a posture do over a cell, enclosed, and whether they keep
// limits.
//
//     |--inside--|--?--|--outside--|--fold|   no posture
//                   ^ root                ^ cos theta_5 = 0
//
// A cell is enclosed by the closed form itself, run on Jet<Interval, 1>: values and slopes of all joints over
// the cell, rounding included, and by the mean value form about its middle. A limit that a joint passes once
// is an end, found as a root.
#pragma once

#include "../self_motion/joint_over.hpp"
#include "../self_motion/pieces.hpp"
#include "offset_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of cells of the free joint.
struct OffsetCellsTuning {
    static constexpr int cells = 24;  // of the circle, to begin with
    static constexpr int depth = 32;  // halvings of a cell; narrowest is reached before
    static constexpr int root_steps = 60;
};

/// Like cut_off of elbow.hpp on a jet: 0 if a gap is within rounding, else the given value. The derivatives
/// are known only if the case is decided.
template <int K>
Jet<Interval, K> cut_off(const Jet<Interval, K>& gap, const Jet<Interval, K>& rounding,
                         const Jet<Interval, K>& value) noexcept {
    const bool known = !any(gap.value() <= rounding.value());
    Jet<Interval, K> out(cut_off(gap.value(), rounding.value(), value.value()));
    for (int k = 1; k <= K; ++k) out.coefficient[k] = known ? value.coefficient[k] : Interval::whole();
    return out;
}

namespace detail {

/// The joints of a pose and branch, at a value of the free joint or bounded over a cell of such values.
class OffsetCells {
public:
    /// Computes what a pose and branch have in common for all values of the free joint.
    OffsetCells(const OffsetArm& arm, const Pose<double>& pose, int gc) noexcept
        : arm_(arm), motion_(offset_motion(arm, pose, gc)) {}

    /// The self-motion of the pose and branch.
    const OffsetMotion<>& motion() const noexcept { return motion_; }

    /// The value g^2 - t^2 (m^2) at a value of the free joint (rad), negative if there is no solution;
    /// -infinity if the wrist is out of reach.
    double inside(double free) const noexcept {
        const OffsetWrist<double> wrist = offset_wrist(arm_, motion_, sin_cos(to_theta(arm_.rest, 6, free)));
        return wrist.excess <= 0 ? wrist.inside : -infinity;
    }

    /// Writes the model angles theta (rad) of all joints, in the order of the formulas, at a value of the
    /// free joint (rad) that has a solution to `theta`.
    void at(double free, double* theta) const noexcept {
        const SinCos<double> theta_7 = sin_cos(to_theta(arm_.rest, 6, free));
        const OffsetWrist<double> wrist = offset_wrist(arm_, motion_, theta_7);
        angles(directions(motion_, wrist, theta_7, sqrt(max(wrist.inside, 0.0)))).store(theta);
    }
    /// Writes theta (rad) of all joints at a value of the free joint (rad) to `theta`, with two derivatives
    /// with respect to it. There must be a solution.
    void at(double free, Jet<double, 2> (&theta)[joints]) const noexcept {
        angles_along(arm_, motion_, Jet<double, 2>::variable(free), theta);
    }

    /// Bounds of the joints over a cell.
    struct Over {
        Known exists;   // inside: at every value of the cell; outside: at none
        bool beyond;    // out of reach all over the cell
        Interval fold;  // slope of g^2 - t^2 over the cell
        JointOver joint[joints];
    };

    /// The part of a cell's computation that ends at the wrist.
    struct Begun {
        double middle, half;
        SinCos<Jet<Interval, 1>> theta_7;
        OffsetWrist<Jet<Interval, 1>> wrist;
    };

    /// Starts `out`: whether solutions exist over the cell [middle - half, middle + half] of the free joint,
    /// and bounds of joints 4 and 7. `begun` keeps what finish() needs.
    void begin(double middle, double half, Begun& begun, Over& out) const noexcept {
        using Cell = Jet<Interval, 1>;
        const Cell free = Cell::variable({below(middle - half), above(middle + half)});
        const double sign = arm_.rest.sign[6];
        begun = {middle, half, sin_cos(Cell(sign) * free + Cell(arm_.rest.offset[6])), {}};
        begun.wrist = offset_wrist(arm_, motion_, begun.theta_7);
        const OffsetWrist<Cell>& wrist = begun.wrist;
        const OffsetWrist<double> here = offset_wrist(arm_, motion_, sin_cos(to_theta(arm_.rest, 6, middle)));
        const double rounding = angle_rounding * arm_.rest.size;
        const Interval reach = mean_value(wrist.excess, here.excess, half, rounding);
        const Interval inside = mean_value(wrist.inside, here.inside, half, rounding * arm_.rest.size);
        out.fold = wrist.inside.coefficient[1];
        out.exists = Known::open;
        out.beyond = reach.lo > 0;
        if (reach.lo > 0 || inside.hi < 0) out.exists = Known::outside;
        if (reach.hi <= 0 && inside.lo > 0) out.exists = Known::inside;
        if (out.exists == Known::outside) return;
        out.joint[3] = enclosed(wrist.theta_4.sin, wrist.theta_4.cos);
        out.joint[6] = enclosed(begun.theta_7.sin, begun.theta_7.cos);
    }

    /// Completes the bounds of all joints over a cell that is not outside. If the existence is undecided,
    /// they hold for those values that have a solution.
    void finish(const Begun& begun, Over& out) const noexcept {
        using Cell = Jet<Interval, 1>;
        const Directions<Cell> d = directions(motion_, begun.wrist, begun.theta_7, sqrt(begun.wrist.inside));
        if (out.exists != Known::inside) {  // no posture need be at the middle of the cell
            for (int j = 0; j < joints; ++j) out.joint[j] = enclosed(d.y[j], d.x[j]);
            return;
        }
        double theta[joint_slots];
        at(begun.middle, theta);
        for (int j = 0; j < joints; ++j)
            out.joint[j] = joint_over(d.y[j], d.x[j], theta[j], sin_cos(theta[j]), begun.half);
    }

private:
    /// The range of a function over a cell of half width `half`: the intersection of its enclosed values
    /// `over` with the bound from its value `middle` at the middle and its slope.
    static Interval mean_value(const Jet<Interval, 1>& over, double middle, double half,
                               double rounding) noexcept {
        const Interval slope = over.coefficient[1];
        if (!slope.bounded() || !(abs(middle) < infinity)) return over.value();
        const double reach = above(half * greater(abs(slope.lo), abs(slope.hi))) + rounding;
        return meet(over.value(), {middle - reach, middle + reach});
    }

    /// Bounds a joint by its direction vector alone, without a value at the middle.
    static JointOver enclosed(const Jet<Interval, 1>& y, const Jet<Interval, 1>& x) noexcept {
        const double down = y.value().middle(), along = x.value().middle(), size = hypot(down, along);
        const bool known = size > 0 && size < infinity;
        const SinCos<double> about = known ? SinCos<double>{down / size, along / size} : SinCos<double>{0, 1};
        return joint_over(y, x, atan2(about.sin, about.cos), about, infinity);
    }

    const OffsetArm& arm_;
    OffsetMotion<> motion_;
};

/// Whether a joint keeps its range over a cell: inside, outside or undecided.
inline Known keeps(const ThetaRanges::One& range, const JointOver& joint) noexcept {
    const double about = wrap(joint.middle - range.middle);
    const double from = about + joint.off.lo, to = about + joint.off.hi;
    if (from >= -range.half && to <= range.half) return Known::inside;
    const bool turned_round = !(to < two_pi - range.half && from > range.half - two_pi);
    return !turned_round && (from > range.half || to < -range.half) ? Known::outside : Known::open;
}

/// Decides cells of the free joint by the joint limits: a cell is outside; or a piece of it is proven inside
/// and the rest outside; or it is undecided. Cells: OffsetCells, or the same class for another kind of arm.
template <class Cells>
class CellJudge {
public:
    /// Keeps a reference to the joint ranges that decide the cells of a pose in branch gc.
    template <class AnyArm>
    CellJudge(const AnyArm& arm, const Pose<double>& pose, int gc, const ThetaRanges& ranges) noexcept
        : cells(arm, pose, gc), ranges_(ranges) {}

    const Cells cells;

    /// Decides the cell [lower, upper] of the free joint: inside all limits, outside, or open. If it is
    /// inside, `piece` is the part that keeps the limits, perhaps empty. Bounds of the joints come in `cell`,
    /// unless it is outside.
    Known look(double lower, double upper, typename Cells::Over& cell, Piece& piece) noexcept {
        ++looks_;
        piece = {lower, upper, 0, 0};
        typename Cells::Begun begun;
        cells.begin(0.5 * (lower + upper), 0.5 * (upper - lower), begun, cell);
        if (cell.exists == Known::outside) {
            if (!cell.beyond) within_reach_ = true;
            return Known::outside;
        }
        within_reach_ = true;
        for (int i = 0; i < ranges_.count; ++i) {  // before the other joints are computed
            const int j = ranges_.one[i].joint;
            if ((j == 3 || j == 6) && keeps(ranges_.one[i], cell.joint[j]) == Known::outside)
                return broken(cell);
        }
        cells.finish(begun, cell);
        unsigned open = 0;
        for (int i = 0; i < ranges_.count; ++i) {
            const Known kept = keeps(ranges_.one[i], cell.joint[ranges_.one[i].joint]);
            if (kept == Known::outside) return broken(cell);
            if (kept == Known::open) open |= 1u << i;
        }
        if (cell.exists == Known::open) {
            if (open != 0 || !cut_at_fold(cell.fold, piece)) return Known::open;
            exists_ = exists_ || piece.upper > piece.lower;
            return Known::inside;
        }
        exists_ = true;
        for (int i = 0; i < ranges_.count; ++i)
            if (open >> i & 1u && !cut(ranges_.one[i], cell.joint[ranges_.one[i].joint], piece))
                return Known::open;
        return Known::inside;
    }

    /// The number of cells that were examined.
    int looks() const noexcept { return looks_; }
    /// The reason why a whole circle without any inside piece has none.
    Status refusal() const noexcept {
        if (exists_) return Status::LIMITS;
        return within_reach_ ? Status::NO_POSTURE : Status::UNREACHABLE;
    }

private:
    /// Records a cell in which a limit is violated throughout; returns outside.
    Known broken(const typename Cells::Over& cell) noexcept {
        exists_ = exists_ || cell.exists == Known::inside;
        return Known::outside;
    }

    /// Cuts a piece down to where g^2 - t^2 is not negative; false, without a change, unless that is
    /// monotonic over the whole cell.
    bool cut_at_fold(const Interval& slope, Piece& piece) const noexcept {
        if (!(slope.lo > 0 || slope.hi < 0)) return false;
        const auto gap = [this](double free) noexcept { return cells.inside(free); };
        if (!(gap(piece.lower) > -infinity && gap(piece.upper) > -infinity)) return false;
        const Tag fold = make_tag(5, Side::near_singular);
        keep_positive(gap, 0.0, fold, piece);
        return true;
    }

    /// Cuts a piece down to where a joint keeps its range; false, without a change, unless the joint is
    /// monotonic over the cell.
    bool cut(const ThetaRanges::One& range, const JointOver& joint, Piece& piece) const noexcept {
        if (!(joint.slope.lo > 0 || joint.slope.hi < 0)) return false;
        const double about = wrap(joint.middle - range.middle);
        const double from = about + joint.off.lo, to = about + joint.off.hi;
        if (!(to < two_pi - range.half && from > range.half - two_pi))
            return false;  // it may come in from behind
        const auto room = [this, j = range.joint](double limit, double side) noexcept {
            return [this, j, limit, side](double free) noexcept {
                double theta[joint_slots];
                cells.at(free, theta);
                return side * wrap(theta[j] - limit);
            };
        };
        if (from < -range.half)
            keep_positive(room(range.middle - range.half, 1.0), tolerance::isolated, range.low, piece);
        if (to > range.half)
            keep_positive(room(range.middle + range.half, -1.0), tolerance::isolated, range.high, piece);
        return true;
    }

    /// Cuts a piece down to where a monotonic function f(free) is not negative, with `tag` at the new end; to
    /// no width if that is nowhere. At an end of the piece values down to -`slack` count, so that a locked
    /// joint keeps one value.
    template <class F>
    static void keep_positive(const F& f, double slack, Tag tag, Piece& piece) noexcept {
        const double a = f(piece.lower), b = f(piece.upper);
        const bool kept_a = a >= -slack, kept_b = b >= -slack;
        if (kept_a && kept_b) return;
        if (!kept_a && !kept_b) {
            piece.upper = piece.lower;
            piece.lower_tag = 0;
            piece.upper_tag = 0;
            return;
        }
        const double kept = kept_a ? piece.lower : piece.upper;
        const bool within = kept_a ? a > 0 : b > 0;
        const double at = within ? root(f, piece.lower, a, piece.upper, b) : kept;
        (kept_a ? piece.upper : piece.lower) = at;
        (kept_a ? piece.upper_tag : piece.lower_tag) = tag;
    }

    /// The root of f in [a, b], whose values at the ends have opposite signs, by regula falsi (Illinois).
    template <class F>
    static double root(const F& f, double a, double fa, double b, double fb) noexcept {
        for (int pass = 0; pass < OffsetCellsTuning::root_steps && b - a > 1e-15 * (1.0 + abs(a)); ++pass) {
            double at = (a * fb - b * fa) / (fb - fa);
            if (!(at > a && at < b)) at = 0.5 * (a + b);
            const double now = f(at);
            if (now == 0) return at;
            const bool upper = (now < 0) == (fb < 0);
            (upper ? b : a) = at;
            (upper ? fb : fa) = now;
            (upper ? fa : fb) *= 0.5;
        }
        return 0.5 * (a + b);
    }

    const ThetaRanges& ranges_;
    int looks_ = 0;
    bool exists_ = false, within_reach_ = false;
};

using OffsetJudge = CellJudge<OffsetCells>;

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
