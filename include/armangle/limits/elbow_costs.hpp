// Costs over boxes of psi: a value, a slope, bounds of the second derivative, and a lower bound for each of
// eight boxes, for the branches of each sign of the elbow.
#pragma once

#include "joint_boxes.hpp"
#include "posture_costs.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Two lines below the largest cost of a joint over eight boxes, as functions of the offset from their
/// middles; one rises and one falls. No solution costs less than at their crossing, up to the square of the
/// width.
struct Wedge {
    Boxes rising, rise, falling, fall;  // value at the middle and slope; -infinity: no line

    /// Replaces the rising or falling line by another one, by the sign of its slope, where that is higher at
    /// the middle.
    void add(const Boxes& value, const Boxes& slope) noexcept {
        const auto up = (Boxes(0.0) <= slope) & (rising < value),
                   down = (slope <= Boxes(0.0)) & (falling < value);
        rising = select(up, value, rising);
        rise = select(up, slope, rise);
        falling = select(down, value, falling);
        fall = select(down, slope, fall);
    }

    /// Adds the lines of another wedge.
    void add(const Wedge& other) noexcept {
        add(other.rising, other.rise);
        add(other.falling, other.fall);
    }

    /// The crossing of the two lines, or the nearest point to it within boxes of half width r, as an offset
    /// from their middles.
    Boxes cross(const Boxes& r) const noexcept {
        const Boxes none(-infinity), steep = max(rise - fall, Boxes(1e-300));
        const Boxes apart = select((rising == none) & (falling == none), Boxes(0.0), falling - rising);
        return min(max(apart / steep, -r), r);
    }

    /// The steepest slope of the two lines; infinite if there are none.
    Boxes steepest() const noexcept {
        const Boxes none(-infinity);
        return select((rising == none) & (falling == none), Boxes(infinity), max(rise, -fall));
    }

    /// The higher of the two lines at an offset from the middles.
    Boxes at(const Boxes& off) const noexcept { return max(rising + rise * off, falling + fall * off); }
};

/// Costs of eight boxes, summed over joints (the maximum in other metrics).
struct BoxCosts {
    Boxes value, slope;
    Enclosure<Boxes> second;
    Boxes least;      // lower bound of the cost in the box
    Boxes noise;      // error of `value` due to rounding
    unsigned smooth;  // one bit a box: value, slope and second (or all lines of the wedge) are valid
    Wedge wedge;      // used if the cost is a maximum
};

/// Data common to all branches with one sign of the elbow: joint functions for positive theta_2 and theta_6,
/// and the psi where a revolution of a joint ends.
struct ElbowBranches {
    bool open = false;
    SelfMotion<double> motion;  // with positive hinges
    JointFunctions<double> functions;
    bool lost[2] = {};             // this side's first and last joint rotate about one axis for every psi
    bool hides = false;            // arcs may miss solutions
    bool ill_conditioned = false;  // psi may have too few digits to distinguish solutions
    bool elbow_to_limit =
        false;  // move joint 4 to its limit, which the pose cannot distinguish from its value
    double cost_4;
    int cuts = 0;
    double cut[24];
    struct Corner {  // an end of an arc where a turn ends too: it may be feasible alone
        int gc;
        double psi;
    } corner[8];
    int corners = 0;
};

/// The two signs of the elbow at one pose, and the costs of their branches over boxes of psi.
class ElbowCosts : protected PostureCosts {
public:
    /// Computes the circle of a pose and the cost functions of the joints.
    ElbowCosts(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
               const NearestOptions& options) noexcept
        : PostureCosts(arm, options),
          limits_(limits),
          pose_(pose),
          circle_(circle(arm, flange_pose(arm, pose))) {}

protected:
    /// Whether the elbow is nearly stretched or folded and joint 4 violates a limit by no more than the
    /// accuracy of the wrist's distance. There the bend is the root of its rounding.
    bool straight_within_limits(const ElbowBranches& e) const noexcept {
        if (!(abs(circle_.triangle.eta.sin) <= NearestTuning::straight)) return false;
        const JointCost& c = joint_[3];
        const double theta_4 = atan2(e.motion.elbow.theta_4.sin, e.motion.elbow.theta_4.cos);
        const double q = to_q(theta_4, c.sign, c.offset, c.lower, c.upper, c.near);
        const double off = wrist_distance(arm_, elbow_bend(arm_, min(max(q, c.lower), c.upper)));
        return abs(off - circle_.distance) <= 2.0 * tolerance::stretched * arm_.size;
    }

    /// Computes the joint functions of one elbow sign and the psi where revolutions end.
    void prepare_elbow(int elbow) noexcept {
        fill_functions(elbow_[elbow]);
        fill_cuts(elbow_[elbow]);
    }

    /// Computes the joint functions of one elbow sign, e, and how near they come to singularities.
    void fill_functions(ElbowBranches& e) const noexcept {
        e.functions = joint_functions(e.motion);
        e.lost[0] = shoulder_singular(e.motion);
        e.lost[1] = wrist_singular(e.motion);
        e.hides = may_hide(limits_, circle_, e.functions);
        // for a largest cost the search is less accurate near straight
        e.ill_conditioned = limits_.locked || e.hides ||
                            (options_.metric == Metric::max &&
                             comes_near_straight(NearestTuning::near_straight_max, circle_, e.functions));
    }

    /// The index gc of a branch (shoulder + 2 wrist) with one elbow sign.
    static int gc_of(int elbow, int branch) noexcept { return (branch & 1) + 2 * elbow + 4 * (branch >> 1); }

    /// The psi where joint j (0..6, not 3) has the given value, or is pi away from it (joints 2 and 6: where
    /// theta is mirrored).
    Roots limit_psi(const ElbowBranches& e, int j, double value) const noexcept {
        const SinCos<double> at = sin_cos(to_theta(value, arm_.sign[j], arm_.offset[j]));
        if (j % 2 == 0) {
            const Pivot<double>& p = e.functions.pivot[j / 2];
            return roots({p.U.s * at.cos - p.V.s * at.sin, p.U.c * at.cos - p.V.c * at.sin,
                          p.U.k * at.cos - p.V.k * at.sin});
        }
        const Harmonic<double>& H = e.functions.hinge[j / 4].H;
        return roots({H.s, H.c, H.k - at.cos});
    }

    /// Stores in e the psi where a joint with a range of 2 pi or more reaches a limit: one of its revolutions
    /// ends there.
    void fill_cuts(ElbowBranches& e) const noexcept {
        e.cuts = 0;
        for (int j = 0; j < joints; ++j) {
            if (j == 3 || !joint_[j].wide) continue;
            for (const double limit : {arm_.limits.lower[j], arm_.limits.upper[j]}) {
                if (!(abs(limit) < infinity)) continue;
                const Roots ends = limit_psi(e, j, limit);
                for (int i = 0; i < ends.count; ++i) e.cut[e.cuts++] = ends.psi[i];
            }
        }
    }

    /// A joint over boxes. q is the value at their middles, in the revolution nearest to `near` within the
    /// limits. `least` is the smallest |q - near| over the revolutions of q +- travel within the limits,
    /// infinite if there are none.
    struct Winding {
        Boxes q, least;
    };

    /// Computes a Winding from `any`, the joint at the middles in any revolution, and `travel`, its largest
    /// change within a box (rad).
    ARMANGLE_INLINE static Winding winding(const JointCost& c, const Boxes& any,
                                           const Boxes& travel) noexcept {
        if (c.direct) {
            const Boxes q = lift(any, Boxes(c.near));
            return {q, max(abs(q - Boxes(c.near)) - travel, Boxes(0.0))};
        }
        const double centre = c.centre();
        const Boxes turn = round((Boxes(centre) - any) * Boxes(1.0 / two_pi)), zero(0.0);
        const Boxes ahead(c.upper + tolerance::angle - centre), behind(centre - c.lower + tolerance::angle);
        const Boxes off = (any + Boxes(two_pi) * turn) - Boxes(centre);
        const auto above = zero < off;
        const Boxes near = abs(off), far = Boxes(two_pi) - near;
        const Boxes near_room = select(above, ahead, behind), far_room = select(above, behind, ahead);
        const Boxes near_edge = max(near - travel, zero), far_edge = max(far - travel, zero), none(infinity);
        const Boxes least = min(select(near_edge <= near_room, near_edge, none),
                                select(far_edge <= far_room, far_edge, none));
        // if neither is within the limits, the one that violates them less
        const auto other = (near_room < near) & (far - far_room < near - near_room);
        const Boxes next = select(other, select(above, Boxes(-1.0), Boxes(1.0)), zero);
        return {any + Boxes(two_pi) * (turn + next), Boxes(abs(centre - c.near)) + least};
    }

    /// Whether the revolution on the other side of `near` is beyond the limits, and stays there up to the
    /// next cut. Then q, at `off` from `near`, is the nearest revolution, however far it is.
    static auto alone(const JointCost& c, const Boxes& q, const Boxes& off) noexcept {
        const Boxes rival = q - select(off < Boxes(0.0), Boxes(-two_pi), Boxes(two_pi));
        return (rival < Boxes(c.lower - tolerance::angle)) | (Boxes(c.upper + tolerance::angle) < rival);
    }

    /// Adds the cost of joint i (0 to 2) of a side over eight boxes to `sum`; negative: in the branch with a
    /// negative middle joint.
    ARMANGLE_INLINE void add(BoxCosts& sum, const SideBoxes& boxes, int i, const JointCost& c, bool negative,
                             const Boxes& r) const noexcept {
        if (!(c.weight > 0)) return;
        const JointBoxes& j = boxes.joint[i];
        const Boxes& noise = boxes.noise;
        const bool hinge = i == 1;
        const Boxes sign(c.sign);
        const bool mirrored = hinge && negative;  // a pivot changes by half a turn instead
        const Boxes straight = negative ? j.theta + pi : j.theta;
        const Boxes theta = mirrored ? -j.theta : straight, way = mirrored ? -sign : sign;
        const Boxes near(c.near), travel = hinge ? j.travel : j.travel + noise, weight(c.weight);
        const auto [q, least] = winding(c, to_q(theta, sign, Boxes(c.offset)), travel);
        const Boxes off = q - near;
        if (!squares()) {
            sum.value = max(sum.value, weight * abs(off) - Boxes(c.room));
            sum.least = max(sum.least, weight * least - Boxes(c.room));
            const Boxes side = select(off < Boxes(0.0), Boxes(-1.0), Boxes(1.0)) * weight;
            const Boxes bend = Boxes(0.5) * weight * j.second.largest() * r * r;
            auto known = boxes.joint[0].travel < Boxes(infinity);
            if (c.wide) known = known & ((abs(off) + j.travel < Boxes(pi)) | alone(c, q, off));
            const Boxes line = side * off - Boxes(c.room) - bend;
            if (!hinge) sum.noise = max(sum.noise, weight * noise);
            sum.smooth &= bits(known);
            sum.wedge.add(select(known, hinge ? line : line - weight * noise, Boxes(-infinity)),
                          side * way * j.rate.middle);
            return;
        }
        const Enclosure<Boxes> d{off, j.travel}, rate = j.rate * way, second = j.second * way;
        sum.value = sum.value + weight * off * off;
        sum.slope = sum.slope + Boxes(2.0) * weight * off * rate.middle;
        sum.second = sum.second + (square(rate) + d * second) * (Boxes(2.0) * weight);
        sum.least = sum.least + weight * least * least;
        if (!hinge) sum.noise = sum.noise + Boxes(2.0) * weight * abs(off) * noise;
        if (c.wide) sum.smooth &= bits((abs(off) + j.travel < Boxes(pi)) | alone(c, q, off));
    }

    /// The neutral costs with which sums and maxima start.
    BoxCosts no_costs() const noexcept {
        const Boxes start(squares() ? 0.0 : -infinity), zero(0.0);
        return {start, zero, {zero, zero}, start, zero, 0xff, {start, zero, start, zero}};
    }

    /// Writes the costs of the three joints of a side over eight boxes to `sum`; negative: in the branch with
    /// a negative middle joint.
    void side_costs(const ElbowBranches& e, const SideBoxes& boxes, int side, bool negative,
                    const SinCos<Boxes>& at, const Boxes& r, BoxCosts& sum) const noexcept {
        sum = no_costs();
        if (e.lost[side]) {
            lost_costs(e, side, negative, at, r, sum);
            if (!squares()) sum.smooth = 0;  // the lines do not hold this side's cost
            return;
        }
        for (int i = 0; i < 3; ++i) add(sum, boxes, i, joint_[4 * side + i], negative, r);
        sum.smooth &= boxes.regular;
    }

    /// The costs of each side over eight boxes, with its middle joint positive and negative.
    struct SidesCosts {
        BoxCosts shoulder[2], wrist[2];

        /// Computes the sides that the given branches (bits) use; other sides are left out.
        SidesCosts(const ElbowCosts& search, const ElbowBranches& e, unsigned branches, const Boxes& middle,
                   const Boxes& r) noexcept {
            static constexpr unsigned of_shoulder[2] = {0x55, 0xaa}, of_wrist[2] = {0x0f, 0xf0};
            const SinCos<Boxes> at = sin_cos(middle);
            const SideBoxes first = side_boxes(e.functions, 0, at, r),
                            second = side_boxes(e.functions, 1, at, r);
            for (int negative = 0; negative < 2; ++negative) {
                if (branches & of_shoulder[negative])
                    search.side_costs(e, first, 0, negative, at, r, shoulder[negative]);
                if (branches & of_wrist[negative])
                    search.side_costs(e, second, 1, negative, at, r, wrist[negative]);
            }
        }
    };

    /// The cost of both sides, a and b, and the elbow together; without the elbow if the cost is a maximum.
    BoxCosts total(const ElbowBranches& e, const BoxCosts& a, const BoxCosts& b) const noexcept {
        const Boxes elbow(e.cost_4);
        if (!squares()) {
            Wedge wedge = a.wedge;
            wedge.add(b.wedge);
            return {max(a.value, b.value), a.slope, a.second, max(a.least, b.least), max(a.noise, b.noise),
                    a.smooth & b.smooth,   wedge};
        }
        return {a.value + b.value + elbow,
                a.slope + b.slope,
                a.second + b.second,
                a.least + b.least + elbow,
                a.noise + b.noise,
                a.smooth & b.smooth,
                {}};
    }

    /// The sign epsilon for a side whose middle joint is 0 (or pi), so that its first and last joint rotate
    /// around one axis: the pose determines q_last + epsilon q_first.
    double epsilon(const ElbowBranches& e, int side) const noexcept {
        const bool flipped = e.functions.hinge[side].H.at({0.0, 1.0}) < 0;
        return joint_[4 * side].sign * joint_[4 * side + 2].sign * (flipped ? -1.0 : 1.0);
    }

    /// For a side whose first and last joint rotate around one axis: the sum v + epsilon u that the pose
    /// requires of the distances u of the first and v of the last joint from their seeds (rad). The first
    /// angle is 0 by convention, and the last is theta.
    double lost_wish(const ElbowBranches& e, int side, double theta) const noexcept {
        const JointCost &a = joint_[4 * side], &b = joint_[4 * side + 2];
        const double first = to_q(0.0, a.sign, a.offset), last = to_q(theta, b.sign, b.offset);
        return last - b.near + epsilon(e, side) * (first - a.near);
    }

    /// The cheapest common rotation (rad) of two joints that rotate about one axis, from `lower` to `upper`.
    double cheapest_wish(const JointCost& a, const JointCost& b, double eps, double lower,
                         double upper) const noexcept {
        const double free = b.centre() - b.near + eps * (a.centre() - a.near);
        return min(max(free, lower), upper);
    }

    /// Computes the costs of a side whose first and last joint rotate around one axis, with the cheapest
    /// shares.
    void lost_costs(const ElbowBranches& e, int side, bool negative, const SinCos<Boxes>& at, const Boxes& r,
                    BoxCosts& out) const noexcept {
        const JointCost &a = joint_[4 * side], &b = joint_[4 * side + 2], &h = joint_[4 * side + 1];
        const Pivot<double>& p = e.functions.pivot[2 * side + 1];
        const double eps = epsilon(e, side),
                     theta_h = e.functions.hinge[side].H.at({0.0, 1.0}) < 0 ? pi : 0.0;
        const double q_h = to_q(negative ? -theta_h : theta_h, h.sign, h.offset, h.lower, h.upper, h.near);
        const double fixed = cost_of(h, q_h - h.near);
        const double rate = b.sign * derivative(p, {0.0, 1.0}), weights = a.weight + b.weight;
        for (int i = 0; i < 8; ++i) {
            const SinCos<double> here{at.sin[i], at.cos[i]};
            const double wish = lost_wish(e, side, atan2(p.U.at(here), p.V.at(here))), reach = r[i];
            double value = infinity, least = infinity, others = infinity, slope = 0;
            for (const int k : {0, -1, 1, -2, 2}) {
                const double w = wrap(wish) + two_pi * k;
                const Split now = split(a, b, eps, w);
                const double low = split(a, b, eps, cheapest_wish(a, b, eps, w - reach, w + reach)).cost;
                least = min(least, low);
                if (now.cost < value) {
                    others = min(others, value);
                    value = now.cost;
                    const bool last_at_limit = now.v <= b.lower - b.near || now.v >= b.upper - b.near;
                    slope = 2.0 * rate * (last_at_limit ? a.weight * now.u * eps : b.weight * now.v);
                } else {
                    others = min(others, low);
                }
            }
            const double steepest = 2.0 * max(a.weight, b.weight);
            const double flattest = weights > 0 ? 2.0 * a.weight * b.weight / weights : 0.0;
            out.value.set(i, both(value, fixed));
            out.slope.set(i, slope);
            out.second.middle.set(i, 0.5 * (steepest + flattest));
            out.second.radius.set(i, 0.5 * (steepest - flattest));
            out.least.set(i, both(least, fixed));
            if (!(value + abs(slope) * reach + 0.5 * steepest * reach * reach < others))
                out.smooth &= ~(1u << i);
        }
    }

    /// Whether branch gc is in a set of bits.
    static bool is_in(int gc, unsigned branches) noexcept { return branches >> gc & 1; }

    /// The costs of a branch over eight boxes of psi with these middles and half widths r.
    BoxCosts costs(int gc, const Boxes& middle, const Boxes& r) const noexcept {
        const ElbowBranches& e = elbow_[gc >> 1 & 1];
        const SidesCosts sides(*this, e, 1u << gc, middle, r);
        return total(e, sides.shoulder[gc & 1], sides.wrist[gc >> 2 & 1]);
    }

    /// The costs of joints 2 and 6 at a psi, and the derivatives of their |theta| with respect to psi; valid
    /// if the cost depends on |theta| alone.
    struct Bends {
        double cost[hinges], slope[hinges];

        /// The cost of joint 6 minus that of joint 2.
        double gap() const noexcept { return cost[1] - cost[0]; }
    };

    /// The costs of joints 2 and 6 at psi, and the slopes of their |theta|.
    Bends bends_at(const ElbowBranches& e, double psi) const noexcept {
        const SinCos<double> at = sin_cos(psi);
        Lane<hinges> sine, cosine;
        for (int h = 0; h < hinges; ++h) {
            const Pivot<double>& p = e.functions.pivot[2 * h];
            sine.set(h, hypot(p.U.at(at), p.V.at(at)));
            cosine.set(h, e.functions.hinge[h].H.at(at));
        }
        const Lane<hinges> theta = atan2(sine, cosine);
        Bends out;
        for (int h = 0; h < hinges; ++h) {
            out.cost[h] = cost_of(joint_[hinge_joint[h]], theta[h]);
            out.slope[h] = -e.functions.hinge[h].H.slope(at) / sine[h];
        }
        return out;
    }

    /// Whether the caller and the obstacles permit psi in branch gc.
    bool may_be(int gc, double psi) const noexcept {
        const ArcSet* clear = options_.clear[gc];
        if (clear && !contains(*clear, psi)) return false;
        return !options_.allowed || contains(*options_.allowed, psi);
    }

    const LimitTable& limits_;
    const Pose<double>& pose_;
    Circle<double> circle_;
    ElbowBranches elbow_[2];
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
