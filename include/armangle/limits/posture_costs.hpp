// The cost of a solution: what solve() minimizes, joint by joint, and the results with which it answers.
#pragma once

#include "feasible.hpp"
#include "possible.hpp"
#include "solve_locally.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The cost: the root of sum w d^2, the largest sqrt(w) |d|, or the (negative) distance to the nearest limit.
enum class Metric : std::uint8_t { l2, max, margin };

/// The cost of solutions and the set of permitted solutions.
struct NearestOptions {
    Metric metric = Metric::l2;
    const double* near = nullptr;                    // 7 joint values (rad); null: the middles of the ranges
    double weight[joints] = {1, 1, 1, 1, 1, 1, 1};   // w >= 0, for l2 and max
    unsigned branches = (1u << configurations) - 1;  // one bit for each permitted gc
    const ArcSet* allowed = nullptr;                 // arcs given by the user, intersected
    const ArcSet* clear[configurations] = {};        // for each gc: collision-free arcs, or null
    Status blocked[configurations] = {};             // status if these arcs leave nothing
};

/// One solution. If there is none, the numbers are NaN and gc is -1. UNPROVEN and the reasons of
/// nearest_outside() come with numbers.
struct Nearest {
    double q[joint_slots];
    double psi;  // in (-pi, pi]
    int gc;
    Status status;
    double distance;  // to `near` in the metric (rad); NaN for margin
    double margin;    // rad: distance to the nearest joint limit
    double gap;       // m: from the pose of q to the requested one, 0 unless from nearest_outside
};

/// One solution for each branch and arc, by rising cost.
struct Nearests {
    static constexpr int capacity = 64;
    int count = 0;
    Status status = Status::OK;  // the reason if there are none
    Nearest found[capacity];
};

/// Parameters of the search of the nearest solution.
struct NearestTuning {
    static constexpr int first_boxes = 16;      // on the whole circle, for each elbow
    static constexpr double narrowest = 1e-15;  // half width below which a box is not split (rad)
    static constexpr double smallest_square =
        1e-16;                              // square of Newton's last move and of its box's radius (rad)
    static constexpr double tie = 1e-13;    // costs closer than this share of them are equal
    static constexpr double noise = 1e-12;  // error of a joint's value if the cost is a maximum (rad)
    static constexpr int work = 400;        // largest number of splits of a first box: a hundred are many
    static constexpr int all_work = 4000;   // largest number of splits for one pose, each some microseconds
    static constexpr double apart = 1e-6;   // arm angles further apart are two solutions (rad)
    static constexpr int newton = 40, deepest = 20;
    static constexpr double near_straight = 1e-5;  // rad from straight at which psi may have too few digits
    static constexpr double near_straight_max = 2e-4;  // rad: the same for the metric max
    static constexpr double near_straight_locked =
        1e-2;                                 // rad: the same with a locked joint, which permits a single psi
    static constexpr double closed = 1e-8;    // rad: largest missing part of a full turn that arcs may bridge
    static constexpr double straight = 1e-5;  // rad from a straight elbow: its bend is the root of a rounding
    static constexpr double digits = 100;     // times rounding / bend^2: uncertainty of a joint given psi
    static constexpr double poor = 1e-3;      // rad: upper bound of that uncertainty
    static constexpr double bent = 3e-3;   // rad: hinges and elbow further from straight have an accurate psi
    static constexpr double start = 1e-3;  // most of a start from the pose (of the arm's size; rad)
    static constexpr double seed = 0.3;    // the same for the seed, and for starts that represent many
    static constexpr double gain = 1e-11;  // rad: ignore smaller improvements near another solution
    static constexpr int halvings = 40;    // bisections of the range of a largest cost
    static constexpr int bends = 64;  // largest number of ranges of the elbow's bend that a search looks at
    static constexpr int local_rounds =
        1200;  // rounds of solve_locally() for one pose, of some microseconds each
};

namespace detail {

/// The distance (rad) of joint 2, 4 or 6 from its singular position below which psi may not distinguish
/// solutions.
ARMANGLE_INLINE double poor_band(const LimitTable& t) noexcept {
    return t.locked ? NearestTuning::near_straight_locked : NearestTuning::near_straight;
}

/// Whether the elbow is so near to stretched or folded that psi is inaccurate.
ARMANGLE_INLINE bool is_about_straight(const LimitTable& t, const Circle<double>& c) noexcept {
    return abs(c.triangle.eta.sin) <= poor_band(t);
}

/// Whether joint 2, joint 6 or the elbow comes within `band` (rad) of 0 or pi on the circle, or joint 2 or 6
/// hardly moves with psi.
ARMANGLE_INLINE bool comes_near_straight(double band, const Circle<double>& c,
                                         const JointFunctions<double>& f) noexcept {
    const double gap = 0.5 * band * band;  // 1 - cos
    bool out = abs(c.triangle.eta.sin) <= band;
    for (const Hinge<double>& h : f.hinge)
        out |= (min(h.high.below_one, h.low.above_minus_one) <= gap) | (h.swing <= band);
    return out;
}

/// Whether psi may have too few digits to distinguish solutions of a circle, so that arcs miss some.
ARMANGLE_INLINE bool may_hide(const LimitTable& t, const Circle<double>& c,
                              const JointFunctions<double>& f) noexcept {
    return comes_near_straight(poor_band(t), c, f);
}

/// Whether a circle is regular: psi has enough digits for every set that the limits may leave.
ARMANGLE_INLINE bool is_bent(const LimitTable& t, const Circle<double>& c,
                             const JointFunctions<double>& f) noexcept {
    return !comes_near_straight(max(poor_band(t), NearestTuning::bent), c, f);
}

/// The square of the smallest distance of joints 2, 4 and 6 from their singular positions (rad^2).
inline double least_bend(const Circle<double>& c, const JointFunctions<double>& f) noexcept {
    double square = c.triangle.eta.sin * c.triangle.eta.sin;
    for (const Hinge<double>& h : f.hinge)
        square = min(square, 2.0 * min(h.high.below_one, h.low.above_minus_one));
    return square;
}

/// The uncertainty (rad) of a joint for a given psi, from least_bend() (rad^2). If theta_2 or theta_6 is b
/// from 0, a neighbour moves by 1 / b for each radian of psi, which is known to rounding / b.
inline double uncertainty(double least_bend) noexcept {
    return min(NearestTuning::digits * tolerance::rounding / least_bend, NearestTuning::poor);
}

/// The largest gap or overlap (rad) of blocked arcs that rounding alone may cause, from least_bend() (rad^2).
/// Near the psi where a joint turns back it is the root of the joint's uncertainty.
inline double unclear_gap(double least_bend) noexcept {
    return min(sqrt(uncertainty(least_bend)), NearestTuning::poor);
}

/// Whether a single psi may be feasible although the arcs of a branch show none: rounding explains the
/// smallest `gap` or overlap (rad) of blocked arcs, or there is no arc (`empty`) and a joint is nearly
/// straight.
inline bool may_meet(const Circle<double>& c, const JointFunctions<double>& f, double gap,
                     bool empty) noexcept {
    const double bend = least_bend(c, f);
    return gap <= unclear_gap(bend) || (empty && bend <= NearestTuning::bent * NearestTuning::bent);
}

/// The cost of one joint: w d^2, or w |d| - room, with d = q - near.
struct JointCost {
    double near, weight, room;
    double sign, offset, lower, upper;
    bool wide;    // nearly a full turn or more, so that arcs have no gap: several turns are possible
    bool direct;  // the limits lie within half a turn of `near`: no other turn is possible

    /// The value within the limits nearest to `near`.
    double centre() const noexcept { return min(max(near, lower), upper); }
};

/// How two joints that rotate around one axis share their rotation. The pose determines v = wanted - epsilon
/// u alone; u and v are their distances from `near`.
struct Split {
    double u, v, cost;
};

/// Computes costs of solutions in the chosen metric.
class PostureCosts {
public:
    /// Keeps references to both, and computes the cost function of each joint from its seed, weight and
    /// limits.
    PostureCosts(const Arm& arm, const NearestOptions& options) noexcept : arm_(arm), options_(options) {
        double narrowest = infinity;
        for (int j = 0; j < joints && options.metric == Metric::margin; ++j)
            narrowest = min(narrowest, arm.limits.upper[j] - arm.limits.lower[j]);
        if (narrowest < infinity) most_margin_ = 0.5 * narrowest;
        for (int j = 0; j < joints; ++j) {
            joint_[j] = joint_cost(j);
            grain_ = both(grain_, joint_[j].weight);
        }
    }

protected:
    /// Whether the cost is a sum of squares.
    bool squares() const noexcept { return options_.metric == Metric::l2; }

    /// The parameters of the cost of joint j (0..6) in the chosen metric.
    JointCost joint_cost(int j) const noexcept {
        JointCost c{};
        c.sign = arm_.sign[j];
        c.offset = arm_.offset[j];
        c.lower = arm_.limits.lower[j];
        c.upper = arm_.limits.upper[j];
        c.wide = !(c.upper - c.lower < two_pi - NearestTuning::closed);
        c.near = options_.near ? options_.near[j] : arm_.joint_middle[j];
        c.weight = options_.metric == Metric::max ? sqrt(options_.weight[j]) : options_.weight[j];
        if (options_.metric == Metric::margin) measure_margin(c, arm_.joint_middle[j]);
        c.direct = c.near - pi < c.lower && c.upper < c.near + pi;
        return c;
    }

    /// Makes c a cost that is the negative distance (rad) to the nearest limit. A joint with one limit can
    /// move so far from it that another joint decides.
    void measure_margin(JointCost& c, double middle) const noexcept {
        const bool below = c.lower > -infinity, above = c.upper < infinity;
        c.near = middle;
        c.weight = below && above ? 1.0 : 0.0;
        c.room = below && above ? 0.5 * (c.upper - c.lower) : 0.0;
        const double away = max(two_pi, most_margin_ + pi);
        if (below && !above) c.near = c.lower + away;
        if (above && !below) c.near = c.upper - away;
    }

    /// The cost of a joint at a distance d (rad) from `near`; -infinity for the metric margin if the joint
    /// has not two limits, since others decide.
    double cost_of(const JointCost& c, double d) const noexcept {
        if (squares()) return c.weight * d * d;
        if (!(c.weight > 0)) return options_.metric == Metric::max ? 0.0 : -infinity;
        return c.weight * abs(d) - c.room;
    }
    /// Combines two costs: their sum or their maximum.
    double both(double a, double b) const noexcept { return squares() ? a + b : max(a, b); }

    /// The cost of all joints; without joint 4 if the cost is a maximum.
    double cost_of(const double* q) const noexcept {
        double sum = cost_of(joint_[0], q[0] - joint_[0].near);
        for (int j = 1; j < joints; ++j)
            if (j != 3 || squares()) sum = both(sum, cost_of(joint_[j], q[j] - joint_[j].near));
        return sum;
    }

    /// The difference up to which two costs count as equal, from the rounding of the joints.
    double tie(double cost) const noexcept {
        const double size = abs(cost);
        return squares() ? NearestTuning::tie * (size + 2.0 * sqrt(size * grain_))
                         : NearestTuning::tie * size + NearestTuning::noise * grain_;
    }

    /// The cheapest way for joints a and b to share v + epsilon u = `wanted` within their limits; infinite
    /// cost if there is none.
    Split split(const JointCost& a, const JointCost& b, double eps, double wanted) const noexcept {
        const double t0 = min(eps * (a.lower - a.near), eps * (a.upper - a.near));  // t = eps u
        const double t1 = max(eps * (a.lower - a.near), eps * (a.upper - a.near));
        const double from = max(t0, wanted - (b.upper - b.near)), to = min(t1, wanted - (b.lower - b.near));
        if (!(from <= to + tolerance::angle)) return {0, 0, infinity};
        const double weights = a.weight + b.weight;
        double t = 0.0;
        if (squares()) {
            t = weights > 0 ? b.weight * wanted / weights : 0.0;
        } else if (b.weight > 0) {  // both cost the same, or one as much as possible
            const double equal = (b.weight * abs(wanted) - b.room + a.room) / weights;
            t = copysign(a.weight > 0 ? min(max(equal, 0.0), abs(wanted)) : abs(wanted), wanted);
        }
        t = min(max(t, from), to);
        const double u = eps * t, v = wanted - t;
        return {u, v, both(cost_of(a, u), cost_of(b, v))};
    }

    // -- results

    /// The empty result with its reason.
    static Nearest refused(Status why) noexcept {
        Nearest out{};
        for (double& q : out.q) q = not_a_number;
        out.psi = out.distance = out.margin = out.gap = not_a_number;
        out.gc = -1;
        out.status = why;
        return out;
    }

    /// The empty result, with the reason of the branch nearest to a solution; OK if a branch has arcs.
    Nearest nothing(const Status (&of)[configurations]) const noexcept {
        static constexpr Status order[] = {Status::OK,           Status::NOT_ALLOWED,   Status::CLEARANCE,
                                           Status::POSE_BLOCKED, Status::NEAR_SINGULAR, Status::LIMITS,
                                           Status::ELBOW_MARGIN, Status::ELBOW_LIMIT,   Status::FOLDED,
                                           Status::NO_POSTURE};
        for (const Status status : order)
            for (int gc = 0; gc < configurations; ++gc)
                if ((options_.branches >> gc & 1) && of[gc] == status) return refused(status);
        return refused(Status::UNREACHABLE);
    }

    /// The complete result for joints q that solve the pose: distance in the metric (NaN for the margin), and
    /// the least distance (rad) from limits.
    Nearest finished(const double* q, double psi, int gc) const noexcept {
        Nearest out{};
        for (int j = 0; j < joints; ++j) out.q[j] = q[j];
        out.psi = psi;
        out.gc = gc;
        out.status = Status::OK;
        const double cost =
            squares() ? cost_of(q) : max(cost_of(q), cost_of(joint_[3], q[3] - joint_[3].near));
        out.distance = squares() ? sqrt(cost) : cost;
        if (options_.metric == Metric::margin) out.distance = not_a_number;
        out.margin = limit_margin(arm_.limits, q);
        return out;
    }

    /// The solution at psi, at(psi), with no joint beyond its limits. At an end of an arc rounding may
    /// violate a limit. psi then moves back into the arc, is_open(psi), as little as necessary. If it is the
    /// only psi, the joint is set to its limit.
    template <class At, class Open>
    Nearest kept_within(const At& at, const Open& is_open, double psi, int gc) const noexcept {
        Joints q = at(psi);
        if (within_limits(arm_.limits, q.q, 0.0)) return finished(q.q, psi, gc);
        for (double step = tolerance::same_psi; step < tolerance::isolated; step *= 4)
            for (const double beside : {wrap(psi - step), wrap(psi + step)}) {
                if (!is_open(beside)) continue;
                const Joints here = at(beside);
                const bool turned = largest_move(here.q, q.q) > pi;
                if (!turned && within_limits(arm_.limits, here.q, 0.0)) return finished(here.q, beside, gc);
            }
        for (int j = 0; j < joints; ++j) {
            const double inside = min(max(q.q[j], arm_.limits.lower[j]), arm_.limits.upper[j]);
            if (abs(inside - q.q[j]) <= tolerance::isolated) q.q[j] = inside;
        }
        return finished(q.q, psi, gc);
    }

    /// Inserts a solution by its rank, unless the capacity is reached.
    void insert(Nearests& out, const Nearest& one) const noexcept {
        if (out.count == Nearests::capacity) return;
        const auto rank = [this](const Nearest& x) {
            return options_.metric == Metric::margin ? -x.margin : x.distance;
        };
        int at = out.count++;
        for (; at > 0 && rank(out.found[at - 1]) > rank(one); --at) out.found[at] = out.found[at - 1];
        out.found[at] = one;
    }

    const Arm& arm_;
    const NearestOptions& options_;
    JointCost joint_[joints];
    double grain_ = 0;        // cost of a radian: of all joints, or of the most expensive one
    double most_margin_ = 0;  // rad: possible distance of joints with two limits; 0 if none has two
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
