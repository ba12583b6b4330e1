// The nearest posture of an arm with an offset wrist: of all branches, all values of the free joint and all
// windings the one nearest to given joints, globally.
//
// Branch and bound over the cells that feasible.hpp judges: a cell is dropped where no posture in it can be
// nearer than the best known, left with one end where the distance rises or falls all over it, and halved
// else. The best is finished by Newton's method on the slope.
#pragma once

#include "feasible.hpp"

namespace armangle {

/// On any status but OK the numbers are NaN and gc is -1.
struct OffsetNearest {
    double q[joint_slots];
    double free;
    int gc;
    Status status;
    double distance;  // root of sum w (q - near)^2, rad
    double margin;
};

namespace offset_rule {
inline constexpr int samples = 48;        // of each branch, for a first posture
inline constexpr double finest = 2e-7;    // rad: half width of a cell whose best is its middle's, finished
inline constexpr double tie = 1e-12;      // costs closer than this share of them are equal
inline constexpr int most_looks = 60000;  // of one pose
inline constexpr int newton = 8;
}  // namespace offset_rule

namespace detail {

/// The search of one pose over the free joint, in all branches.
class OffsetSearch {
public:
    OffsetSearch(const OffsetArm& arm, const Pose<double>& pose, const double* near,
                 const double* weight) noexcept
        : arm_(arm), pose_(pose) {
        for (int j = 0; j < joints; ++j) {
            near_[j] = near ? near[robot_joint(arm, j)] : arm.rest.joint_middle[j];
            weight_[j] = weight ? weight[robot_joint(arm, j)] : 1.0;
        }
    }

    OffsetNearest run(unsigned branches) noexcept {
        Status why = Status::UNREACHABLE;
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(branches >> gc & 1u)) continue;
            const OffsetCells cells(arm_, pose_, gc);
            for (int k = 0; k < offset_rule::samples; ++k)
                offer(cells, gc, -pi + two_pi * (k + 0.5) / offset_rule::samples, 0.0);
        }
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(branches >> gc & 1u)) continue;
            const Status refusal = search(gc);
            const auto rank = [](Status status) noexcept {
                if (status == Status::UNREACHABLE) return 0;
                return status == Status::NO_POSTURE ? 1 : 2;
            };
            if (rank(refusal) > rank(why)) why = refusal;
        }
        for (int gc = 0; gc < configurations; gc += 2)
            if (branches >> gc & 3u) offer_shared_turn(branches >> gc & 1u ? gc : gc + 1, gc);
        constexpr double no = not_a_number;
        OffsetNearest out{{no, no, no, no, no, no, no, 0.0}, no, -1, why, no, no};
        if (gc_ < 0) return out;
        double theta[joint_slots];
        OffsetCells(arm_, pose_, gc_).at(free_, theta);
        for (int j = 0; j < joints; ++j)
            out.q[robot_joint(arm_, j)] = shared_ ? shared_q_[j] : nearest_turn(j, theta[j]);
        out.free = free_ <= -pi ? pi : free_;
        out.gc = gc_;
        out.status = Status::OK;
        out.distance = sqrt(cost_);
        out.margin = limit_margin(arm_.own.limits, out.q);
        return out;
    }

private:
    /// q of joint j on the turn within its limits that is nearest to what is wanted.
    double nearest_turn(int j, double theta) const noexcept {
        const Arm& rest = arm_.rest;
        return to_q(theta, rest.sign[j], rest.offset[j], rest.limits.lower[j], rest.limits.upper[j],
                    near_[j]);
    }

    /// Cost and slope of the posture at a value of the free joint, and whether it is within the limits.
    struct Value {
        bool feasible;
        double cost, slope, curvature;
    };
    Value value(const OffsetCells& cells, double free) const noexcept {
        using Curve = Jet<double, 2>;
        Value out{cells.inside(free) >= 0, infinity, 0.0, 0.0};
        if (!out.feasible) return out;
        Curve theta[joints];
        cells.at(free, theta);
        Curve sum(0.0);
        for (int j = 0; j < joints; ++j) {
            const double q = nearest_turn(j, theta[j].value());
            if (!(q >= arm_.rest.limits.lower[j] - tolerance::angle &&
                  q <= arm_.rest.limits.upper[j] + tolerance::angle))
                out.feasible = false;
            Curve off = Curve(arm_.rest.sign[j]) * theta[j];
            off.coefficient[0] = q - near_[j];
            sum = sum + Curve(weight_[j]) * (off * off);
        }
        out.cost = sum.coefficient[0];
        out.slope = sum.coefficient[1];
        out.curvature = 2.0 * sum.coefficient[2];
        return out;
    }

    /// Takes a posture that is nearer than the best; Newton's method moves it within `reach`.
    void offer(const OffsetCells& cells, int gc, double free, double reach) noexcept {
        Value now = value(cells, free);
        if (!now.feasible) return;
        const double from = free;
        for (int pass = 0; pass < offset_rule::newton && reach > 0 && now.curvature > 0; ++pass) {
            const double to = free - now.slope / now.curvature;
            if (!(abs(to - from) <= reach)) break;
            const Value next = value(cells, to);
            if (!next.feasible || !(next.cost <= now.cost)) break;
            const bool still = abs(to - free) < 1e-15;
            free = to;
            now = next;
            if (still) break;
        }
        if (!(now.cost < cost_)) return;
        cost_ = now.cost;
        free_ = wrap(free);
        gc_ = gc;
    }

    /// Where theta_2 = 0, the axes of joints 1 and 3 are one, and share their turn as they like: no cell has
    /// that posture. Gauss-Newton on sin(theta_2) (cos theta_1, sin theta_1) from the wanted value of the
    /// free joint finds the one that is near; the shares are those of least cost within the limits.
    void offer_shared_turn(int gc, int positive) noexcept {
        const Arm& rest = arm_.rest;
        const OffsetCells cells(arm_, pose_, positive);
        double theta[joint_slots], ahead[joint_slots];
        double free = near_[6];
        for (int pass = 0; pass < offset_rule::newton; ++pass) {
            const double step = 1e-6;
            if (!(cells.inside(free) >= 0 && cells.inside(free + step) >= 0)) return;
            cells.at(free, theta);
            cells.at(free + step, ahead);
            const SinCos<double> at = sin_cos(theta[0]), then = sin_cos(ahead[0]);
            const double s = sin_cos(theta[1]).sin, t = sin_cos(ahead[1]).sin;
            const double x = (t * then.cos - s * at.cos) / step, y = (t * then.sin - s * at.sin) / step;
            if (!(x * x + y * y > 0)) break;
            const double by = -s * (at.cos * x + at.sin * y) / (x * x + y * y);
            if (!(abs(by) < 0.1)) return;
            free += by;
        }
        if (!(cells.inside(free) >= 0)) return;
        cells.at(free, theta);
        if (!(abs(wrap(theta[1])) <= 1e-8)) return;
        const double sum = theta[0] + theta[2];
        const double from_1 = to_theta(rest, 0, near_[0]), from_3 = sum - to_theta(rest, 2, near_[2]);
        const double other = from_1 + wrap(from_3 - from_1), weights = weight_[0] + weight_[2];
        const double wanted = weights > 0 ? (weight_[0] * from_1 + weight_[2] * other) / weights : from_1;
        double q[joints], cost = 0;
        q[0] = min(max(to_q(rest, 0, wanted), rest.limits.lower[0]), rest.limits.upper[0]);
        q[2] = nearest_turn(2, sum - to_theta(rest, 0, q[0]));
        q[2] = min(max(q[2], rest.limits.lower[2]), rest.limits.upper[2]);
        q[0] = nearest_turn(0, sum - to_theta(rest, 2, q[2]));
        for (const int j : {1, 3, 4, 5, 6}) q[j] = nearest_turn(j, theta[j]);
        for (int j = 0; j < joints; ++j) {
            if (!(q[j] >= rest.limits.lower[j] - tolerance::angle &&
                  q[j] <= rest.limits.upper[j] + tolerance::angle))
                return;
            cost += weight_[j] * (q[j] - near_[j]) * (q[j] - near_[j]);
        }
        if (!(cost < cost_)) return;
        cost_ = cost;
        free_ = wrap(free);
        gc_ = gc;
        shared_ = true;
        for (int j = 0; j < joints; ++j) shared_q_[j] = q[j];
    }

    /// The least cost of joint j over a cell, and d(cost)/d(free); false where no turn is within the limits.
    struct JointBound {
        double least;
        double middle;  // the cost at the middle of the cell, on the turn that `smooth` speaks of
        Interval slope;
        bool smooth;  // one turn is the nearest all over the cell
    };
    bool bound(int j, const JointOver& over, JointBound& out) const noexcept {
        const Arm& rest = arm_.rest;
        const double sign = rest.sign[j], lower = rest.limits.lower[j], upper = rest.limits.upper[j];
        out = {0.0, 0.0, Interval::whole(), false};
        if (!over.off.bounded()) return true;
        const Interval off = sign > 0 ? over.off : -over.off;
        const double at = to_q(over.middle, sign, rest.offset[j]);
        const double fewest = ceil((lower - at) / two_pi), most_turns = floor((upper - at) / two_pi);
        const double turn = min(max(round((near_[j] - at) / two_pi), fewest), max(fewest, most_turns));
        double least = infinity, most = infinity, second = infinity;
        double middle = at;
        for (const double k : {turn - 1.0, turn, turn + 1.0}) {
            const double here = at + two_pi * k;
            const double from = max(here + off.lo, lower - tolerance::angle),
                         to = min(here + off.hi, upper + tolerance::angle);
            if (!(from <= to)) continue;
            const double nearest = max(0.0, max(from - near_[j], near_[j] - to));
            if (nearest < least) {
                second = least;
                least = nearest;
                most = max(abs(from - near_[j]), abs(to - near_[j]));
                middle = here;
            } else {
                second = min(second, nearest);
            }
        }
        if (!(least < infinity)) return false;
        out.least = weight_[j] * least * least;
        // a turn of a joint that has several may end within the cell; other joints' pieces are cut there
        const bool whole = upper - lower < two_pi || (middle + off.lo >= lower && middle + off.hi <= upper);
        out.smooth = second > most && whole;
        out.middle = weight_[j] * (middle - near_[j]) * (middle - near_[j]);
        const Interval d{middle + off.lo - near_[j], middle + off.hi - near_[j]};
        out.slope = Interval(2.0 * weight_[j] * sign) * d * over.slope;
        return true;
    }

    /// Searches one branch; why it has no posture within the limits, or OK.
    Status search(int gc) noexcept {
        struct Cell {
            double lower, upper;
        };
        const ThetaRanges ranges(arm_.rest, arm_.rest.limits, 0.0, configuration(gc));
        OffsetJudge judge(arm_, pose_, gc, ranges);
        Cell stack[offset_rule::depth + 2];
        bool found = false;
        for (int k = 0; k < offset_rule::cells; ++k) {
            int top = 0;
            stack[top++] = {-pi + two_pi * k / offset_rule::cells,
                            -pi + two_pi * (k + 1) / offset_rule::cells};
            while (top > 0) {
                const Cell cell = stack[--top];
                OffsetCells::Over over;
                Piece piece;
                const Known known = judge.look(cell.lower, cell.upper, over, piece);
                if (known == Known::outside) continue;
                if (known == Known::inside &&
                    !(piece.upper >= piece.lower && (piece.upper > piece.lower || piece.lower_tag != 0)))
                    continue;
                found = found || known == Known::inside;
                const double middle = 0.5 * (cell.lower + cell.upper), half = middle - cell.lower;
                double least = 0, at_middle = 0;
                bool smooth = over.exists == Known::inside, possible = true;
                Interval slope(0.0);
                for (int j = 0; j < joints && possible; ++j) {
                    JointBound one;
                    possible = bound(j, over.joint[j], one);
                    least += one.least;
                    at_middle += one.middle;
                    smooth = smooth && one.smooth;
                    slope = slope + one.slope;
                }
                if (!possible) continue;
                smooth = smooth && slope.bounded();
                if (smooth) least = max(least, at_middle - half * max(abs(slope.lo), abs(slope.hi)));
                if (least >= cost_ * (1.0 - offset_rule::tie) - 1e-24) continue;
                if (known == Known::inside && smooth && (slope.lo >= 0 || slope.hi <= 0)) {
                    offer(judge.cells, gc, slope.lo >= 0 ? piece.lower : piece.upper, 0.0);
                    continue;
                }
                if (known == Known::inside) {
                    offer(judge.cells, gc, min(max(middle, piece.lower), piece.upper), half);
                    offer(judge.cells, gc, piece.lower, 0.0);
                    offer(judge.cells, gc, piece.upper, 0.0);
                } else {
                    offer(judge.cells, gc, middle, half);
                }
                const double end =
                    known == Known::inside && smooth ? offset_rule::finest : offset_rule::narrowest;
                if (half < end || top > offset_rule::depth ||
                    judge.looks() + looks_ >= offset_rule::most_looks)
                    continue;
                stack[top++] = {middle, cell.upper};
                stack[top++] = {cell.lower, middle};
            }
        }
        looks_ += judge.looks();
        return found ? Status::OK : judge.refusal();
    }

    const OffsetArm& arm_;
    const Pose<double>& pose_;
    double near_[joints], weight_[joints];
    double cost_ = infinity, free_ = 0;
    int gc_ = -1, looks_ = 0;
    bool shared_ = false;  // the best is a shared turn, of joints shared_q_
    double shared_q_[joints] = {};
};

}  // namespace detail

/// The posture nearest to `near` (7 joint values; null: the middles of the ranges) in the branches of the
/// bits, in the root of sum w d^2 (null: all weights 1).
inline OffsetNearest nearest(const OffsetArm& arm, const Pose<double>& pose, const double* near,
                             const double* weight = nullptr, unsigned branches = 255u) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    return detail::OffsetSearch(arm, exact, near, weight).run(branches);
}

}  // namespace armangle
