// The nearest solution of a pose: the one of least cost, globally over all branches, feasible psi and turns.
//
// cost(psi) is smooth between the ends of arcs. Branch and bound over boxes of psi:
//
//   cost |\      _          Every box has a lower bound, of first order by the band of each joint, of second
//        | \    / \         by cost' and cost'' over the box. Boxes with a bound above the best known cost
//        |  \__/   \___     are dropped, boxes with one sign of cost' leave one end, and boxes with
//        +------------- psi cost'' > 0 are finished by Newton's method. Others are split into eight lanes.
//                           If the cost is a maximum, two lines below it replace cost' and cost''.
//
// Source: E. R. Hansen, Global optimization using interval analysis (1980): monotonicity, convexity and
// midpoint tests.
#pragma once

#include <bit>
#include <iterator>

#include "../circle/forward.hpp"
#include "feasible.hpp"
#include "joint_boxes.hpp"
#include "possible.hpp"
#include "settled.hpp"

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

/// One solution. If the status is not OK, the numbers are NaN and gc is -1.
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

namespace nearest_rule {
inline constexpr int first_boxes = 16;      // on the whole circle, for each elbow
inline constexpr double narrowest = 1e-15;  // half width below which a box is not split (rad)
inline constexpr double settled = 1e-16;    // square of Newton's last move and of its box's radius (rad)
inline constexpr double tie = 1e-13;        // costs closer than this share of them are equal
inline constexpr double noise = 1e-12;      // error of a joint's value if the cost is a maximum (rad)
inline constexpr int work = 400;            // largest number of splits of a first box: a hundred are many
inline constexpr int all_work = 4000;       // largest number of splits for one pose, each some microseconds
inline constexpr double apart = 1e-6;       // arm angles further apart are two solutions (rad)
inline constexpr int newton = 40, deepest = 20;
inline constexpr double beside = 1e-5;      // rad from straight at which psi may have too few digits
inline constexpr double beside_max = 2e-4;  // rad: the same for the metric max
inline constexpr double beside_locked =
    1e-2;                                 // rad: the same with a locked joint, which permits a single psi
inline constexpr double closed = 1e-8;    // rad: largest missing part of a full turn that arcs may bridge
inline constexpr double straight = 1e-5;  // rad from a straight elbow: its bend is the root of a rounding
inline constexpr double digits = 100;     // times rounding / bend^2: uncertainty of a joint given psi
inline constexpr double poor = 1e-3;      // rad: upper bound of that uncertainty
inline constexpr double bent = 3e-3;      // rad: hinges and elbow further from straight have an accurate psi
inline constexpr double start = 1e-3;     // most of a start from the pose (of the arm's size; rad)
inline constexpr double seed = 0.3;       // the same for the seed, and for starts that represent many
inline constexpr double gain = 1e-11;     // rad: ignore smaller improvements near another solution
inline constexpr int halvings = 40;       // bisections of the range of a largest cost
inline constexpr int settling = 1200;     // rounds of settled() for one pose, of some microseconds each
}  // namespace nearest_rule

namespace detail {

/// The distance (rad) of joint 2, 4 or 6 from its singular position below which psi may not distinguish
/// solutions.
ARMANGLE_INLINE double poor_band(const LimitTable& t) noexcept {
    return t.locked ? nearest_rule::beside_locked : nearest_rule::beside;
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
    return !comes_near_straight(max(poor_band(t), nearest_rule::bent), c, f);
}

/// The square of the smallest distance of joints 2, 4 and 6 from their singular positions (rad^2).
inline double least_bend(const Circle<double>& c, const JointFunctions<double>& f) noexcept {
    double square = c.triangle.eta.sin * c.triangle.eta.sin;
    for (const Hinge<double>& h : f.hinge)
        square = min(square, 2.0 * min(h.high.below_one, h.low.above_minus_one));
    return square;
}

/// The uncertainty (rad) of a joint for a given psi, from the squared bend. If theta_2 or theta_6 is b from
/// 0, a neighbour moves by 1 / b for each radian of psi, which is known to rounding / b.
inline double untold(double least_bend) noexcept {
    return min(nearest_rule::digits * tolerance::rounding / least_bend, nearest_rule::poor);
}

/// The largest gap or overlap (rad) of blocked arcs that rounding alone may cause. Near the psi where a joint
/// turns back it is the root of the joint's uncertainty.
inline double unclear_gap(double least_bend) noexcept {
    return min(sqrt(untold(least_bend)), nearest_rule::poor);
}

/// Whether a single psi may be feasible although the arcs of a branch show none: rounding explains the
/// smallest `gap` or overlap of blocked arcs, or a joint turns back just before its limit.
inline bool may_meet(const Circle<double>& c, const JointFunctions<double>& f, double gap,
                     bool empty) noexcept {
    const double bend = least_bend(c, f);
    return gap <= unclear_gap(bend) || (empty && bend <= nearest_rule::bent * nearest_rule::bent);
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

/// Two lines below the largest cost of a joint over eight boxes, as functions of the offset from their
/// middles; one rises and one falls. No solution costs less than at their crossing, up to the square of the
/// width.
struct Wedge {
    Boxes rising, rise, falling, fall;  // value at the middle and slope; -infinity: no line

    /// Adds a line if it is higher at the middle than the present one.
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
    bool lost[2] = {};      // this side's first and last joint rotate about one axis for every psi
    bool hides = false;     // arcs may miss solutions
    bool delicate = false;  // psi may have too few digits to distinguish solutions
    bool drawn = false;     // move joint 4 to its limit, which the pose cannot distinguish from its value
    double cost_4;
    int cuts = 0;
    double cut[24];
    struct Corner {  // an end of an arc where a turn ends too: it may be feasible alone
        int gc;
        double psi;
    } corner[8];
    int corners = 0;
};

/// How two joints that rotate around one axis share their rotation. The pose determines v = wanted - epsilon
/// u alone; u and v are their distances from `near`.
struct Split {
    double u, v, cost;
};

/// Computes costs of solutions in the chosen metric.
class PostureCosts {
public:
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
        c.wide = !(c.upper - c.lower < two_pi - nearest_rule::closed);
        c.near = options_.near ? options_.near[j] : arm_.joint_middle[j];
        c.weight = options_.metric == Metric::max ? sqrt(options_.weight[j]) : options_.weight[j];
        if (options_.metric == Metric::margin) measure_margin(c, arm_.joint_middle[j]);
        c.direct = c.near - pi < c.lower && c.upper < c.near + pi;
        return c;
    }

    /// Sets up a cost that is the negative distance to the nearest limit. A joint with one limit can move so
    /// far from it that another joint decides.
    void measure_margin(JointCost& c, double middle) const noexcept {
        const bool below = c.lower > -infinity, above = c.upper < infinity;
        c.near = middle;
        c.weight = below && above ? 1.0 : 0.0;
        c.room = below && above ? 0.5 * (c.upper - c.lower) : 0.0;
        const double away = max(two_pi, most_margin_ + pi);
        if (below && !above) c.near = c.lower + away;
        if (above && !below) c.near = c.upper - away;
    }

    /// The cost of a joint at a distance d (rad) from `near`.
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
        return squares() ? nearest_rule::tie * (size + 2.0 * sqrt(size * grain_))
                         : nearest_rule::tie * size + nearest_rule::noise * grain_;
    }

    /// The cheapest way to share `wanted` within the limits; infinite cost if there is none.
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

    /// The complete result for a solution.
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

/// Searches the nearest solution of one pose: the arcs of each branch, and the least cost on each of them.
class NearestSearch : PostureCosts {
public:
    /// Computes everything that depends on the pose but not on psi.
    NearestSearch(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
                  const NearestOptions& options, int& rounds) noexcept
        : PostureCosts(arm, options), limits_(limits), pose_(pose), rounds_(rounds) {
        circle_ = circle(arm, flange_pose(arm, pose));
        for (int elbow = 0; elbow < 2; ++elbow) bend(elbow);
    }

    /// The nearest solution of all.
    Nearest best() noexcept {
        Nearest out;
        if (keep_near(out)) return out;
        // The elbow's cost is the same for every psi. If the cost is a maximum, it would hide the cost of the
        // other joints. So each elbow is searched without it, and the two results are compared with it.
        place_boxes();
        const bool together = squares() || abs(elbow_[0].cost_4 - elbow_[1].cost_4) <= tie(elbow_[0].cost_4);
        const Best found = together ? of_both_elbows() : of_each_elbow();
        best_ = found;
        out = best_.gc >= 0 ? result() : nothing();
        if (elbow_[0].delicate || elbow_[1].delicate) [[unlikely]]
            look_beside(out);
        return proven(out);
    }

    /// The nearest solution of each branch and arc.
    void all(Nearests& out) noexcept {
        place_boxes();
        for (int elbow = 0; elbow < 2; ++elbow) {
            if (!elbow_[elbow].open) continue;
            open(elbow);
            survey(elbow);
        }
        out.count = 0;
        out.status = nothing().status;
        for (int gc = 0; gc < configurations; ++gc) {
            for (int arc = 0; arc < arcs(gc).count; ++arc) {
                best_ = Best{};
                search(1u << gc, arc);
                polish();
                const Nearest one = result();
                if (one.status == Status::OK) insert(out, one);
            }
        }
        lead(out);
        if (out.count > 0) out.status = out.found[0].status;
    }

    /// Puts the result of best() first and removes the other result of the same arc.
    void lead(Nearests& out) const noexcept {
        int rounds = nearest_rule::settling;
        const Nearest first = NearestSearch(arm_, limits_, pose_, options_, rounds).best();
        if (!is_solved(first.status)) return;
        const int arc = find(arcs_.arcs[first.gc], first.psi).index;
        int at = 0;
        const auto is_its = [&](const Nearest& row) {
            return row.gc == first.gc && find(arcs_.arcs[row.gc], row.psi).index == arc;
        };
        while (at < out.count && !is_its(out.found[at])) ++at;
        if (at == Nearests::capacity) --at;
        if (at == out.count) ++out.count;
        for (; at > 0; --at) out.found[at] = out.found[at - 1];
        out.found[0] = first;
    }

    /// Returns any solution, without a seed: on an arc, or found near the arcs; otherwise the reason.
    [[gnu::noinline, gnu::cold]] Nearest some() noexcept {
        for (int elbow = 0; elbow < 2; ++elbow)
            if (elbow_[elbow].open) open(elbow);
        for (int gc = 0; gc < configurations; ++gc)
            for (int arc = 0; arc < arcs(gc).count; ++arc) {
                const Nearest out = somewhere(gc, arcs(gc).arc[arc]);
                if (out.status == Status::OK) return out;
            }
        Nearest out = nothing();
        any_ = true;
        for (int elbow = 0; elbow < 2 && out.status != Status::OK; ++elbow) {
            if (!elbow_[elbow].hides) continue;
            try_bends(elbow, out);
            look_beside_straight(elbow, out);
            look_at_limits(elbow, out);
        }
        return out.status == Status::OK ? out : proven(out);
    }

    /// Removes isolated psi without a solution from a branch's arcs, and adds those found on the joints. If a
    /// joint is slightly `beyond` its limit on the arcs, also removes arcs without a solution.
    void keep_held(int gc, bool beyond, ArcSet& arcs) noexcept {
        const ElbowBranches& e = elbow_[gc >> 1 & 1];
        if (!e.open) return make_empty(arcs);
        open(gc >> 1 & 1);
        keep_tenable(gc, beyond, arcs);
        if (arcs.full) return;
        if (e.lost[0] || e.lost[1]) return;
        const ArcSet own = this->arcs(gc);
        for (int i = 0; i < own.count; ++i)
            if (is_isolated(own.arc[i]) && !contains(arcs, own.arc[i].lower)) put(arcs, own.arc[i]);
    }

    /// Inserts the psi of a solution into the arcs of a branch.
    void put_in(int gc, const Nearest& found, ArcSet& arcs) const noexcept {
        if (found.status != Status::OK) return;
        SelfMotion<double> m = elbow_[gc >> 1 & 1].motion;
        m.gc = configuration(gc);
        const Tag tag = nearest_limit(limits_, m.gc, directions(m, sin_cos(found.psi)), all_joints);
        put(arcs, {found.psi, found.psi, tag, tag});
    }

private:
    struct Best {
        double cost = infinity, psi = 0;
        int gc = -1;
        bool stationary = false;
    };

    static constexpr unsigned elbow_branches = 0x33;  // of the first elbow: gc 0, 1, 4, 5

    /// If the cost is a sum: searches the cheaper elbow sign first, then the other one if it may be better.
    Best of_both_elbows() noexcept {
        const double cost = elbow_[0].cost_4;
        const int first = elbow_[1].cost_4 < cost - tie(cost);
        unsigned branches = 0;
        for (const int elbow : {first, 1 - first}) {
            if (branches != 0 && squares() && dropped(elbow_[elbow].cost_4)) break;
            if (!begin(elbow)) continue;
            branches |= elbow_branches << 2 * elbow;
            offer_middles(elbow_branches << 2 * elbow, -1);
        }
        search_boxes(branches, -1);
        polish();
        return best_;
    }

    /// If the cost is a maximum: searches each elbow sign separately, the second only if its own cost
    /// permits.
    Best of_each_elbow() noexcept {
        Best found;
        for (int elbow = 0; elbow < 2; ++elbow) {
            if (elbow_[elbow].cost_4 > with_elbow(found)) continue;
            best_ = Best{};
            if (begin(elbow)) search(elbow_branches << 2 * elbow, -1);
            polish();
            if (found.gc < 0 || is_cheaper(best_, found)) found = best_;
            ceiling_ = with_elbow(found);
        }
        return found;
    }

    /// Offers the solutions of an elbow sign that need no search; returns whether a search may find a better
    /// one.
    bool begin(int elbow) noexcept {
        ElbowBranches& e = elbow_[elbow];
        if (!e.open) return false;
        fill_functions(e);
        const LeastBent bent = least_bent(e);
        if (dropped(bent.cost) && best_.gc < gc_of(elbow, 0)) return false;
        singular_points(elbow);
        for (int branch = 0; branch < 4 && bent.cost > -infinity; ++branch) {
            const int gc = gc_of(elbow, branch);
            if (best_.gc < gc && dropped(bent.cost)) continue;  // at best equal, and the lowest gc is kept
            if (holds(gc, -1, bent.psi)) try_point(gc, bent.psi, true);
        }
        if (dropped(bent.cost)) return false;
        fill_cuts(e);
        survey(elbow);
        return true;
    }

    /// Whether one elbow's best solution is cheaper than another's, with joint 4; if equal, without it.
    bool is_cheaper(const Best& one, const Best& other) const noexcept {
        const double now = with_elbow(one), before = with_elbow(other);
        if (!(abs(now - before) <= tie(before))) return now < before;
        return one.cost < other.cost - tie(other.cost);
    }

    // -- the problem

    /// Sets up one elbow sign: joint 4, which all its branches share, or the reason why none of them has an
    /// arc.
    void bend(int elbow) noexcept {
        ElbowBranches& e = elbow_[elbow];
        e.motion = self_motion(arm_, circle_, Configuration<double>{1.0, elbow ? -1.0 : 1.0, 1.0});
        Status status = elbow_status(e.motion, limits_);
        e.drawn = status == Status::ELBOW_LIMIT && straight_within_limits(e);
        if (e.drawn) status = Status::OK;
        for (int branch = 0; branch < 4; ++branch) {
            const int gc = gc_of(elbow, branch);
            arcs_.status[gc] = status;
        }
        e.open = status == Status::OK;
        const JointCost& c = joint_[3];
        const double theta_4 = atan2(e.motion.elbow.theta_4.sin, e.motion.elbow.theta_4.cos);
        e.cost_4 = cost_of(c, to_q(theta_4, c.sign, c.offset, c.lower, c.upper, c.near) - c.near);
    }

    /// Whether joint 4 violates a limit by no more than the accuracy of the wrist's distance. Near the
    /// stretched arm the bend is the root of its rounding.
    bool straight_within_limits(const ElbowBranches& e) const noexcept {
        if (!(abs(circle_.triangle.eta.sin) <= nearest_rule::straight)) return false;
        const JointCost& c = joint_[3];
        const double theta_4 = atan2(e.motion.elbow.theta_4.sin, e.motion.elbow.theta_4.cos);
        const double q = to_q(theta_4, c.sign, c.offset, c.lower, c.upper, c.near);
        const double off = wrist_distance(arm_, elbow_bend(arm_, min(max(q, c.lower), c.upper)));
        return abs(off - circle_.distance) <= 2.0 * tolerance::stretched * arm_.size;
    }

    /// Computes the joint functions of one elbow sign and the psi where revolutions end.
    void open(int elbow) noexcept {
        fill_functions(elbow_[elbow]);
        fill_cuts(elbow_[elbow]);
    }

    /// Computes the joint functions of one elbow sign and their singularities.
    void fill_functions(ElbowBranches& e) const noexcept {
        e.functions = joint_functions(e.motion);
        e.lost[0] = shoulder_singular(e.motion);
        e.lost[1] = wrist_singular(e.motion);
        e.hides = may_hide(limits_, circle_, e.functions);
        // for a largest cost the search is less accurate near straight
        e.delicate = limits_.locked || e.hides ||
                     (options_.metric == Metric::max &&
                      comes_near_straight(nearest_rule::beside_max, circle_, e.functions));
    }

    /// The index gc of a branch (shoulder + 2 wrist) with one elbow sign.
    static int gc_of(int elbow, int branch) noexcept { return (branch & 1) + 2 * elbow + 4 * (branch >> 1); }

    /// The arcs of a branch, computed on first use, since most branches are too expensive to need them.
    const ArcSet& arcs(int gc) noexcept {
        if (!is_in(gc, filled_)) fill_arcs(gc);
        return arcs_.arcs[gc];
    }

    /// The arcs blocked by the limits for one elbow sign and one sign of theta_2 and theta_6, computed on
    /// first use.
    const Sides& sides(int elbow, int negative) noexcept {
        const ElbowBranches& e = elbow_[elbow];
        Sides& out = sides_[elbow][negative];
        if (is_in(2 * elbow + negative, sided_)) return out;
        sided_ |= 1u << (2 * elbow + negative);
        SelfMotion<double> m = e.motion;
        m.gc.shoulder = m.gc.wrist = negative ? -1.0 : 1.0;
        block_sides(limits_, m, all_pivots, out);
        for (int side = 0; side < 2; ++side)
            if (e.lost[side]) block_lost(out, side);
        return out;
    }

    /// Computes the arcs of a branch, without those that the caller forbids.
    void fill_arcs(int gc) noexcept {
        filled_ |= 1u << gc;
        const int elbow = gc >> 1 & 1;
        ElbowBranches& e = elbow_[elbow];
        Status& status = arcs_.status[gc];
        if (!e.open) return;
        if (!is_in(gc, options_.branches)) {
            status = Status::NOT_ALLOWED;
            return;
        }
        const Sides &shoulder = sides(elbow, gc & 1), &wrist = sides(elbow, gc >> 2);
        Blocked both = shoulder.shoulder;
        append(wrist.wrist, both);
        ArcSet& arcs = arcs_.arcs[gc];
        const Left left = finish(limits_, shoulder.f, wrist.f, both, arcs);
        status = left.status;
        if (left.may_isolate) [[unlikely]] {
            status = add_isolated(limits_, e.motion, shoulder.f, wrist.f, both, arcs);
        }
        if (left.may_isolate || left.beyond) [[unlikely]] {
            keep_tenable(gc, left.beyond, arcs);
            if (arcs.empty() && status == Status::OK) status = Status::LIMITS;
        }
        const bool meet = may_meet(circle_, e.functions, left.gap, arcs.empty());
        if (meet && !(limits_.psi_margin > 0) && !(arcs.empty() && possible(gc).empty())) [[unlikely]] {
            add_meeting(gc, shoulder.f, wrist.f, both, arcs);
            status = arcs.empty() ? Status::LIMITS : Status::OK;
        }
        for (int i = 0; i < e.cuts; ++i) find_corner(e, gc, e.cut[i], arcs);
        for (int side = 0; side < 2; ++side)
            if (e.lost[side]) keep(arcs, split_arc(e, side), Status::LIMITS, status);
        if (options_.allowed) keep(arcs, *options_.allowed, Status::NOT_ALLOWED, status);
        if (options_.clear[gc]) keep(arcs, *options_.clear[gc], options_.blocked[gc], status);
    }

    /// Keeps only those isolated psi that have a solution within the limits, since an invalid one could be
    /// the nearest and hide the others. If a joint is slightly `beyond` its limit, this applies to all arcs.
    [[gnu::noinline, gnu::cold]] void keep_tenable(int gc, bool beyond, ArcSet& arcs) noexcept {
        if (arcs.full && !beyond) return;
        const ArcSet before = arcs;
        const Best best = best_;
        make_empty(arcs);
        for (int i = 0; i < before.count; ++i) {
            const bool doubtful = beyond || is_isolated(before.arc[i]);
            if (doubtful && somewhere(gc, before.arc[i]).status != Status::OK) continue;
            if (before.full) make_full(arcs);
            if (!before.full) put(arcs, before.arc[i]);
        }
        best_ = best;
    }

    /// Adds psi at which several joints reach their limits at once, if a solution on the joints exists there;
    /// rounding may leave no arc.
    [[gnu::noinline, gnu::cold]] void add_meeting(int gc, const JointFunctions<double>& shoulder,
                                                  const JointFunctions<double>& wrist, const Blocked& blocked,
                                                  ArcSet& arcs) noexcept {
        ElbowBranches& e = elbow_[gc >> 1 & 1];
        SelfMotion<double> m = e.motion;
        m.gc = configuration(gc);
        const double slack = untold(least_bend(circle_, shoulder)), gap = max(sqrt(slack), tolerance::locked);
        const auto look = [&](double psi) {
            const Directions<double> d = directions(m, sin_cos(psi));
            if (contains(arcs, psi) || !allows(limits_, m.gc, d, all_joints, slack)) return;
            const Nearest found = moved_onto_pose(turned(posture(gc, psi)), gc, {});
            if (found.status != Status::OK || found.gc != gc) return;
            put_in(gc, found, arcs);
            e.delicate = true;
        };
        each_meeting(shoulder, wrist, blocked, true, gap, look);
    }

    /// The psi at which a branch may have solutions, computed on first use.
    const ArcSet& possible(int gc) noexcept {
        ArcSet& out = possible_[gc];
        if (is_in(gc, judged_)) return out;
        judged_ |= 1u << gc;
        const ElbowBranches& e = elbow_[gc >> 1 & 1];
        SelfMotion<double> m = e.motion;
        m.gc = configuration(gc);
        if (e.open) detail::possible(arm_, limits_, m, out);
        return out;
    }

    /// If the end of a revolution coincides with an end of one of the arcs, records it as a corner.
    void find_corner(ElbowBranches& e, int gc, double cut, const ArcSet& arcs) const noexcept {
        if (arcs.full) return;
        const double near = max(unclear_gap(least_bend(circle_, e.functions)), tolerance::locked);
        for (int i = 0; i < arcs.count; ++i) {
            const double off = min(abs(wrap(cut - arcs.arc[i].lower)), abs(wrap(cut - arcs.arc[i].upper)));
            if (off > near || e.corners == static_cast<int>(std::size(e.corner))) continue;
            e.corner[e.corners++] = {gc, cut};
            e.delicate = true;
        }
    }

    /// The empty result, with the reason why no arc of any branch has a solution.
    Nearest nothing() noexcept {
        for (int gc = 0; gc < configurations; ++gc) arcs(gc);
        const Nearest out = PostureCosts::nothing(arcs_.status);
        return out.status == Status::OK ? refused(Status::LIMITS) : out;  // arcs, but no solution on its pose
    }

    /// Keeps the part of the arcs that lies `within`; if none remains, sets the status to `otherwise`.
    static void keep(ArcSet& arcs, const ArcSet& within, Status otherwise, Status& status) noexcept {
        const ArcSet before = arcs;
        intersect(before, within, arcs);
        if (arcs.empty() && !before.empty()) status = otherwise;
    }

    /// Computes the blocked arcs of a side whose first and last joint rotate around one axis at every psi.
    /// The first joint, 0 by convention, blocks nothing; only the middle joint does.
    void block_lost(Sides& sides, int side) const noexcept {
        Boundaries b;
        boundaries(limits_, sides.f, b);
        Blocked& blocked = side == 0 ? sides.shoulder : sides.wrist;
        blocked = Blocked{};
        block_hinge(limits_, sides.f, b, side, blocked);
    }

    /// The psi at which the two joints of such a side can share their rotation within their limits.
    ArcSet split_arc(const ElbowBranches& e, int side) const noexcept {
        ArcSet out;
        const JointCost &a = joint_[4 * side], &b = joint_[4 * side + 2];
        const double eps = epsilon(e, side);
        const double u0 = a.lower - a.near, u1 = a.upper - a.near;
        const double least = b.lower - b.near + min(eps * u0, eps * u1),
                     most = b.upper - b.near + max(eps * u0, eps * u1);
        if (!(most - least < two_pi)) {
            make_full(out);
            return out;
        }
        const SinCos<double> zero{0.0, 1.0};
        const Pivot<double>& p = e.functions.pivot[2 * side + 1];
        const double rate = b.sign * derivative(p, zero),
                     at_zero = lost_wish(e, side, atan2(p.U.at(zero), p.V.at(zero)));
        const double from = (least - at_zero) / rate, to = (most - at_zero) / rate;
        make_arc(out, min(from, to), max(from, to), 0, 0);
        return out;
    }

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

    /// Finds the psi where a joint with a range of 2 pi or more reaches a limit: one of its revolutions ends
    /// there.
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

    // -- the cost

    /// The cost of a solution including joint 4; infinite if there is none.
    double with_elbow(const Best& b) const noexcept {
        if (b.gc < 0) return infinity;
        return squares() ? b.cost : max(b.cost, elbow_[b.gc >> 1 & 1].cost_4);
    }

    /// A joint over boxes. q is the value at their middles, in the revolution nearest to `near` within the
    /// limits. `least` is the smallest |q - near| over the revolutions of q +- travel within the limits,
    /// infinite if there are none.
    struct Winding {
        Boxes q, least;
    };

    /// Computes both from the distance of q to the value within the limits nearest to `near`.
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
    /// next cut. Then q is the nearest revolution, however far it is.
    static auto alone(const JointCost& c, const Boxes& q, const Boxes& off) noexcept {
        const Boxes rival = q - select(off < Boxes(0.0), Boxes(-two_pi), Boxes(two_pi));
        return (rival < Boxes(c.lower - tolerance::angle)) | (Boxes(c.upper + tolerance::angle) < rival);
    }

    /// Adds the cost of joint i of a side over eight boxes; negative: in the branch with a negative middle
    /// joint.
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

    /// Computes the costs of the three joints of a side; negative: in the branch with a negative middle
    /// joint.
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
        SidesCosts(const NearestSearch& search, const ElbowBranches& e, unsigned branches,
                   const Boxes& middle, const Boxes& r) noexcept {
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

    /// The cost of the two sides and the elbow together.
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

    // -- solutions at which two joints rotate about one axis

    /// The sign epsilon for a side whose middle joint is 0 (or pi), so that its first and last joint rotate
    /// around one axis: the pose determines q_last + epsilon q_first.
    double epsilon(const ElbowBranches& e, int side) const noexcept {
        const bool flipped = e.functions.hinge[side].H.at({0.0, 1.0}) < 0;
        return joint_[4 * side].sign * joint_[4 * side + 2].sign * (flipped ? -1.0 : 1.0);
    }

    /// The value wanted = v + epsilon u of such a side, where the first angle is 0 by convention and the last
    /// is theta.
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

    // -- solutions

    /// The joints of a branch at psi, in the revolutions nearest to `near`. If theta_2 or theta_6 is at most
    /// `straight` (rad) from 0 or pi, its neighbours share their rotation in the cheapest way.
    Joints posture(int gc, double psi, double straight = tolerance::singular) const noexcept {
        const ElbowBranches& e = elbow_[gc >> 1 & 1];
        SelfMotion<double> m = e.motion;
        m.gc = configuration(gc);
        const Directions<double> d = directions(m, sin_cos(psi));
        double near[joints];
        for (int j = 0; j < joints; ++j) near[j] = joint_[j].near;
        Joints out = joints_within_limits(arm_, d, near);
        if (e.drawn) out.q[3] = min(max(out.q[3], joint_[3].lower), joint_[3].upper);
        for (int side = 0; side < 2; ++side) {
            const int h = 4 * side + 1;
            if (!e.lost[side] && !(hypot(d.y[h - 1], d.x[h - 1]) <= tolerance::singular)) {
                if (!(abs(d.y[h]) <= straight)) continue;
            }
            share(e, side, d.x[h] < 0, out);
        }
        return out;
    }

    /// Splits the rotation of two joints that rotate around one axis in the cheapest way.
    void share(const ElbowBranches&, int side, bool flipped, Joints& q) const noexcept {
        const int i = 4 * side;
        const JointCost &a = joint_[i], &b = joint_[i + 2];
        const double eps = a.sign * b.sign * (flipped ? -1.0 : 1.0);
        const double wish = wrap((q.q[i + 2] - b.near) + eps * (q.q[i] - a.near));
        Split best{0, 0, infinity};
        for (const int k : {0, -1, 1, -2, 2}) {
            const Split now = split(a, b, eps, wish + two_pi * k);
            if (now.cost < best.cost) best = now;
        }
        if (!(best.cost < infinity)) return;
        q.q[i] = a.near + best.u;
        q.q[i + 2] = b.near + best.v;
    }

    /// Offers the solution of a branch at psi if it is within the limits. Its cost is computed from the
    /// joints, since near a singular psi the value in the middle of a box is mere rounding.
    void try_point(int gc, double psi, bool stationary) noexcept {
        const Joints q = posture(gc, psi);
        if (!within_limits(arm_.limits, q.q, tolerance::angle)) return;
        offer(gc, psi, cost_of(q.q), stationary);
    }

    /// Keeps a solution if it is better than the best. A stationary point is more accurate than its cost.
    /// Among equal costs, as for the mirrored solutions of an arm in one plane, the lowest gc, then the
    /// lowest psi, is kept.
    void offer(int gc, double psi, double cost, bool stationary) noexcept {
        const bool equal = best_.gc >= 0 && abs(cost - best_.cost) <= tie(cost);
        const bool beside = gc == best_.gc && abs(wrap(psi - best_.psi)) <= nearest_rule::apart;
        const bool lower = gc < best_.gc || (gc == best_.gc && wrap(psi) < wrap(best_.psi));
        bool better = cost < best_.cost;
        if (equal && stationary != best_.stationary)
            better = stationary;
        else if (equal && !beside)
            better = lower;
        if (better) best_ = {cost, psi, gc, stationary};
    }

    // -- branch and bound

    /// Places equal boxes around the circle; the seed's own psi is the middle of one.
    void place_boxes() noexcept {
        const bool seeded = options_.near && options_.metric != Metric::margin;
        first_ = seeded ? carried() : -pi + pi / nearest_rule::first_boxes;
    }

    /// Computes lower bounds for all branches of one elbow sign over these boxes.
    void survey(int elbow) noexcept {
        const ElbowBranches& e = elbow_[elbow];
        constexpr int n = nearest_rule::first_boxes;
        const double width = two_pi / n;
        const Boxes r(0.5 * width);
        for (int i = 0; i < n; i += 8) {
            double middle[8];
            for (int k = 0; k < 8; ++k) middle[k] = first_ + width * (i + k);
            survey_eight(e, elbow, i, Boxes::load(middle), r);
        }
    }

    /// Computes lower bounds for the four branches of an elbow sign over eight boxes, from box i on.
    void survey_eight(const ElbowBranches& e, int elbow, int i, const Boxes& middle,
                      const Boxes& r) noexcept {
        const unsigned some = options_.branches & elbow_branches << 2 * elbow;
        const SidesCosts sides(*this, e, some, middle, r);
        for (int gc = 0; gc < configurations; ++gc) {
            if (!is_in(gc, some)) continue;
            const BoxCosts sum = total(e, sides.shoulder[gc & 1], sides.wrist[gc >> 2 & 1]);
            sum.least.store(&least_[gc][i]);
            sum.value.store(&value_[gc][i]);
        }
    }

    /// The psi that keeps the seed's elbow axis on the circle of the pose.
    double carried() const noexcept {
        const Chain now = chain(arm_, options_.near);
        return arm_angle(circle_, now.z3);
    }

    /// Finds the best solution of some branches (bits), or of one arc if only_arc is not -1.
    void search(unsigned branches, int only_arc) noexcept {
        offer_middles(branches, only_arc);
        search_boxes(branches, only_arc);
    }

    /// Offers a first solution to compare with: the best middle of a box.
    void offer_middles(unsigned branches, int only_arc) noexcept {
        constexpr int n = nearest_rule::first_boxes;
        branches &= options_.branches;
        unsigned passed[configurations] = {};
        for (;;) {
            double least = best_.cost;
            int gc = -1, box = 0;
            for_each_bit(branches, [&](int branch) {
                for (int first = 0; first < n; first += 8) {
                    const Boxes value = Boxes::load(&value_[branch][first]);
                    for_each_bit(bits(value < Boxes(least)) & ~(passed[branch] >> first), [&](int k) {
                        if (!(value[k] < least)) return;
                        least = value[k];
                        gc = branch;
                        box = first + k;
                    });
                }
            });
            if (gc < 0) return;
            const double psi = first_ + two_pi / n * box;
            if (holds(gc, only_arc, psi)) return try_point(gc, psi, false);
            passed[gc] |= 1u << box;
        }
    }

    /// Searches the boxes in rising order of their bounds until none can contain a better solution.
    void search_boxes(unsigned branches, int only_arc) noexcept {
        constexpr int n = nearest_rule::first_boxes;
        branches &= options_.branches;
        struct Box {
            double least;
            int index;
            unsigned branches;  // searched together
        } box[configurations * n];
        int count = 0;
        for (int group = 0; group < (squares() ? configurations : 2); ++group) {
            const unsigned together = (squares() ? 1u << group : elbow_branches << 2 * group) & branches;
            for (int first = 0; first < n; first += 8) {
                Boxes least(infinity);
                for_each_bit(together, [&](int gc) { least = min(least, Boxes::load(&least_[gc][first])); });
                for_each_bit(kept(least), [&](int k) { box[count++] = {least[k], first + k, together}; });
            }
        }
        while (count > 0) {
            int at = 0;
            for (int k = 1; k < count; ++k)
                if (box[k].least < box[at].least) at = k;
            const Box next = box[at];
            if (dropped(next.least)) break;
            box[at] = box[--count];
            const int given = nearest_rule::work < left_ ? nearest_rule::work : left_;
            work_ = given;
            look_into(next.branches, next.index, only_arc);
            cut_ |= work_ < 0;
            left_ -= work_ > 0 ? given - work_ : given;
        }
    }

    /// Whether branch gc is in a set of bits.
    static bool is_in(int gc, unsigned branches) noexcept { return branches >> gc & 1; }

    /// Searches a box for some branches of an elbow sign: together those whose arcs contain all of it, others
    /// singly.
    void look_into(unsigned branches, int i, int only_arc) noexcept {
        const double width = two_pi / nearest_rule::first_boxes, middle = first_ + width * i;
        const double from = middle - 0.5 * width, to = middle + 0.5 * width;
        unsigned whole = 0;
        for (int gc = 0; gc < configurations; ++gc)
            if (is_in(gc, branches) && !dropped(least_[gc][i]) && covers(gc, only_arc, from, to))
                whole |= 1u << gc;
        if (whole) cut(whole, from, to);
        for (int gc = 0; gc < configurations; ++gc)
            if (is_in(gc, branches & ~whole) && !dropped(least_[gc][i])) clip(gc, only_arc, from, to);
    }

    /// Whether an arc of a branch, or arc only_arc if that is not -1, contains a whole box.
    bool covers(int gc, int only_arc, double from, double to) noexcept {
        const ArcSet& set = arcs(gc);
        const Place begin = find(set, from, 0.0);
        if (begin.index < 0 || (only_arc >= 0 && begin.index != only_arc)) return false;
        return set.full || begin.psi + (to - from) <= set.arc[begin.index].upper;
    }

    /// Whether psi lies in an arc of a branch, or in arc only_arc if that is not -1.
    bool holds(int gc, int only_arc, double psi) noexcept {
        const Place place = find(arcs(gc), psi, 0.0);
        return place.index >= 0 && (only_arc < 0 || place.index == only_arc);
    }

    /// Whether a box with this lower bound cannot contain a better solution.
    bool dropped(double least) const noexcept { return !(least < worth()) || least > ceiling_; }

    /// Eight bits: bit k is set if box k may contain a better solution, by its lower bound `least`.
    unsigned kept(const Boxes& least) const noexcept {
        return bits((least < Boxes(worth())) & (least <= Boxes(ceiling_)));
    }

    /// The largest cost that still counts as better than the best one.
    double worth() const noexcept { return best_.cost < infinity ? best_.cost - tie(best_.cost) : infinity; }

    /// Whether a box with this lower bound may contain a solution as good as the best.
    bool equals_best(double least) const noexcept {
        return !(least > best_.cost + tie(best_.cost)) && !(least > ceiling_);
    }

    /// Searches the parts of a box that lie in arcs of a branch, cut where revolutions end.
    void clip(int gc, int only_arc, double from, double to) noexcept {
        const ArcSet& set = arcs(gc);
        for (int i = 0; i < set.count; ++i) {
            if (only_arc >= 0 && i != only_arc) continue;
            // boxes begin up to half a box below -pi, where an arc that ends near 3 pi is two turns away
            for (const double turn : {-2.0 * two_pi, -two_pi, 0.0, two_pi}) {
                const double lower = max(set.arc[i].lower + turn, from),
                             upper = min(set.arc[i].upper + turn, to);
                // an isolated psi at the seam of two boxes belongs to one of them
                const double crack = is_isolated(set.arc[i]) ? tolerance::same_psi : 0.0;
                if (lower - upper <= crack) cut(1u << gc, lower, upper);
            }
        }
    }

    /// The data of the elbow sign that these branches share.
    const ElbowBranches& elbow_of(unsigned branches) const noexcept {
        return elbow_[(branches & elbow_branches) == 0];
    }

    /// Cuts a part of an arc where revolutions end, and searches each piece.
    void cut(unsigned branches, double from, double to) noexcept {
        const ElbowBranches& e = elbow_of(branches);
        try_end(branches, from);
        double at = from;
        for (;;) {
            double next = to;
            for (int i = 0; i < e.cuts; ++i) {
                const double x = lift(e.cut[i], 0.5 * (from + to));
                if (x > at && x < next) next = x;
            }
            descend(branches, at, next, 0);
            try_end(branches, next);
            if (!(next < to)) return;
            at = next;
        }
    }

    /// If a revolution of a joint ends at psi, offers the solutions there: two revolutions that end at one
    /// psi, from either side, are both possible only there.
    void try_end(unsigned branches, double psi) noexcept {
        const ElbowBranches& e = elbow_of(branches);
        bool ends = false;
        for (int i = 0; i < e.cuts; ++i) ends |= abs(wrap(e.cut[i] - psi)) <= tolerance::isolated;
        for (int gc = 0; ends && gc < configurations; ++gc)
            if (is_in(gc, branches)) try_point(gc, psi, false);
    }

    /// Splits [from, to], in which no revolution ends, into eight boxes and searches them.
    void descend(unsigned branches, double from, double to, int depth) noexcept {
        const double radius = (to - from) / 16;
        if (radius < nearest_rule::narrowest || depth > nearest_rule::deepest || --work_ < 0) {
            for (int gc = 0; gc < configurations; ++gc) {
                if (!is_in(gc, branches)) continue;
                try_point(gc, from, false);
                try_point(gc, to, false);
            }
            return;
        }
        double middle[8];
        for (int k = 0; k < 8; ++k) middle[k] = from + radius * (2 * k + 1);
        if (squares()) return descend_sums(std::countr_zero(branches), middle, radius, depth);
        descend_wedges(branches, middle, radius, depth);
    }

    /// Searches eight boxes of one branch if the cost is a sum.
    void descend_sums(int gc, const double (&middle)[8], double radius, int depth) noexcept {
        const BoxCosts sum = costs(gc, Boxes::load(middle), Boxes(radius));
        double value[8], least[8];
        const Boxes low = sum.second.lower();
        const Boxes bowl =
            sum.value - Boxes(0.5) * sum.slope * sum.slope / select(Boxes(0.0) < low, low, Boxes(1.0));
        Boxes bound = max(sum.least, sum.value - Boxes(radius) * abs(sum.slope) -
                                         Boxes(0.5 * radius * radius) * max(-low, Boxes(0.0)));
        bound = select(Boxes(0.0) < low, max(bound, bowl), bound) - sum.noise;
        sum.value.store(value);
        sum.least.store(least);
        int cheapest = 0;
        for (int k = 1; k < 8; ++k)
            if (value[k] < value[cheapest]) cheapest = k;
        if (value[cheapest] < best_.cost) try_point(gc, middle[cheapest], false);
        for (int k = 0; k < 8; ++k) {
            const bool smooth = sum.smooth >> k & 1;
            if (dropped(smooth ? bound[k] : least[k])) continue;
            const double slope = sum.slope[k], second = sum.second.largest()[k];
            if (smooth && abs(slope) > radius * second)
                try_point(gc, middle[k] + (slope > 0 ? -radius : radius), false);
            else if (smooth && low[k] > 0)
                newton(gc, middle[k], radius, slope, sum.second.middle[k]);
            else
                descend(1u << gc, middle[k] - radius, middle[k] + radius, depth + 1);
        }
    }

    /// Searches eight boxes if the cost is a maximum: in each box the part between the two lines of a branch
    /// that lies below the best cost.
    void descend_wedges(unsigned branches, const double (&middle)[8], double radius, int depth) noexcept {
        const ElbowBranches& e = elbow_of(branches);
        const Boxes r(radius);
        const SidesCosts sides(*this, e, branches, Boxes::load(middle), r);
        Wedge wedge[configurations];
        Boxes cross[configurations], bound[configurations];
        unsigned even[configurations] = {};  // a bit for each box where the cost varies less than its error
        int lowest = 0, lowest_gc = -1;
        for (int gc = 0; gc < configurations; ++gc) {
            if (!is_in(gc, branches)) continue;
            const BoxCosts sum = total(e, sides.shoulder[gc & 1], sides.wrist[gc >> 2 & 1]);
            wedge[gc] = sum.wedge;
            cross[gc] = sum.wedge.cross(r);
            bound[gc] = max(sum.wedge.at(cross[gc]), sum.least);
            even[gc] = sum.smooth & bits(sum.wedge.steepest() * r <= sum.noise);
            for (int k = 0; k < 8; ++k) {
                if (lowest_gc >= 0 && !(bound[gc][k] < bound[lowest_gc][lowest])) continue;
                lowest = k;
                lowest_gc = gc;
            }
        }
        if (!equals_best(bound[lowest_gc][lowest])) return;
        try_point(lowest_gc, middle[lowest] + cross[lowest_gc][lowest], false);
        for (int k = 0; k < 8; ++k) {
            unsigned kept = 0;
            double from = radius, to = -radius;
            for (int gc = 0; gc < configurations; ++gc) {
                if (!is_in(gc, branches)) continue;
                if (dropped(bound[gc][k]) || is_in(k, even[gc])) {
                    // among equal costs the rule decides, not the order of the search
                    if ((k != lowest || gc != lowest_gc) && equals_best(bound[gc][k]))
                        try_point(gc, middle[k] + cross[gc][k], false);
                    continue;
                }
                const Wedge& w = wedge[gc];
                double lower = -radius, upper = radius;
                if (w.fall[k] < 0) lower = max(lower, (best_.cost - w.falling[k]) / w.fall[k]);
                if (w.rise[k] > 0) upper = min(upper, (best_.cost - w.rising[k]) / w.rise[k]);
                if (!(lower <= upper)) continue;
                kept |= 1u << gc;
                from = min(from, lower);
                to = max(to, upper);
            }
            if (kept) descend(kept, middle[k] + from, middle[k] + to, depth + 1);
        }
    }

    /// The costs of a branch over eight boxes.
    BoxCosts costs(int gc, const Boxes& middle, const Boxes& r) const noexcept {
        const ElbowBranches& e = elbow_[gc >> 1 & 1];
        const SidesCosts sides(*this, e, 1u << gc, middle, r);
        return total(e, sides.shoulder[gc & 1], sides.wrist[gc >> 2 & 1]);
    }

    /// Refines the best solution by Newton's method. From its cost alone a minimum is known to half the
    /// digits.
    void polish() noexcept {
        if (!squares() || best_.gc < 0 || best_.stationary) return;
        const double radius = 4 * nearest_rule::apart, psi = best_.psi;
        const int gc = best_.gc;
        const BoxCosts here = costs(gc, Boxes(psi), Boxes(radius));
        if (!(here.smooth & 1) || !(here.second.lower()[0] > 0)) return;
        const double second = here.second.middle[0], move = here.slope[0] / second;
        if (abs(move) < radius && holds(gc, -1, psi - move)) newton(gc, psi, radius, here.slope[0], second);
    }

    /// Finds the minimum of a box on which the cost is convex, and offers it.
    void newton(int gc, double middle, double radius, double slope, double second) noexcept {
        double lower = middle - radius, upper = middle + radius, psi = middle;
        for (int i = 0; i < nearest_rule::newton; ++i) {
            (slope > 0 ? upper : lower) = psi;
            double next = psi - slope / second;
            if (!(next >= lower && next <= upper)) next = slope > 0 ? lower : upper;
            if (i > 3 && !(next > lower && next < upper)) next = 0.5 * (lower + upper);
            const double move = abs(next - psi);
            psi = next;
            if (!(move > nearest_rule::narrowest && move * move > nearest_rule::settled * radius)) break;
            const BoxCosts at = costs(gc, Boxes(psi), Boxes(0.0));
            slope = at.slope[0];
            second = at.second.middle[0];
        }
        try_point(gc, psi, true);
    }

    /// Offers the isolated psi of an elbow sign at which two joints rotate around one axis and can share
    /// their rotation in any way.
    void singular_points(int elbow) noexcept {
        const ElbowBranches& e = elbow_[elbow];
        if (limits_.margin > 0 || !e.open) return;
        for (int side = 0; side < 2; ++side) {
            if (e.lost[side]) continue;
            const Hinge<double>& h = e.functions.hinge[side];
            if (h.high.below_one <= tolerance::touching) touch(elbow, side, atan2(h.H.s, h.H.c));
            if (h.low.above_minus_one <= tolerance::touching) touch(elbow, side, atan2(h.H.s, h.H.c) + pi);
        }
    }

    /// The costs of joints 2 and 6 at a psi, and their derivatives with respect to psi; valid if the cost
    /// depends on |theta| alone.
    struct Bends {
        double cost[hinges], slope[hinges];

        /// The cost of joint 6 minus that of joint 2.
        double gap() const noexcept { return cost[1] - cost[0]; }
    };
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

    /// The psi at which the larger cost of joints 2 and 6 is least. No solution with this elbow sign costs
    /// less than `cost`, in any branch; -infinity if unknown.
    struct LeastBent {
        double cost, psi;
    };

    /// Computes it if the limits of joints 2 and 6 are symmetric around theta = 0. Each |theta| is least
    /// where its cosine is largest, and rises from there on both sides. So the larger cost is least at one of
    /// these two psi, or where the costs cross on the shorter way between them.
    LeastBent least_bent(const ElbowBranches& e) const noexcept {
        if (options_.metric != Metric::margin || e.delicate) return {-infinity, not_a_number};
        double top[hinges];
        for (int h = 0; h < hinges; ++h) {
            const JointCost& c = joint_[hinge_joint[h]];
            const Harmonic<double>& H = e.functions.hinge[h].H;
            top[h] = atan2(H.s, H.c);
            const bool alike = abs(to_theta(arm_, hinge_joint[h], c.near)) <= nearest_rule::noise;
            if (!(c.weight > 0 && alike)) return {-infinity, not_a_number};
        }
        const double way = wrap(top[1] - top[0]);
        const Bends here = bends_at(e, top[0]), there = bends_at(e, top[0] + way);
        if (!(here.gap() > 0)) return {here.cost[0], top[0]};
        if (!(there.gap() < 0)) return {there.cost[1], top[1]};
        // if both limits are equally wide this is the crossing itself
        const Harmonic<double>&H = e.functions.hinge[0].H, &G = e.functions.hinge[1].H;
        const Roots even = roots({H.s - G.s, H.c - G.c, H.k - G.k});
        double before = 0.0, behind = way, x = 0.5 * way;
        for (int i = 0; i < even.count; ++i) {
            const double at = wrap(even.psi[i] - top[0]);
            if ((at - before) * (at - behind) < 0) x = at;
        }
        for (int i = 0;; ++i) {
            const Bends now = bends_at(e, top[0] + x);
            (now.gap() > 0 ? before : behind) = x;
            double move = -now.gap() / (now.slope[1] - now.slope[0]);
            // one cost rises and the other falls: the smaller one is never above the crossing
            if (move * move <= nearest_rule::settled || i == nearest_rule::newton)
                return {min(now.cost[0] + now.slope[0] * move, now.cost[1] + now.slope[1] * move),
                        top[0] + x + move};
            if (!((x + move - before) * (x + move - behind) < 0)) move = 0.5 * (before + behind) - x;
            x += move;
        }
    }

    /// Offers the solutions at a psi where two joints of a side rotate around one axis.
    void touch(int elbow, int side, double psi) noexcept {
        const Pivot<double>& p = elbow_[elbow].functions.pivot[2 * side];
        const SinCos<double> at = sin_cos(psi);
        if (hypot(p.U.at(at), p.V.at(at)) > tolerance::singular) return;
        for (int branch = 0; branch < 4; ++branch) {
            const int gc = gc_of(elbow, branch);
            if (!(options_.branches >> gc & 1)) continue;
            if (may_be(gc, psi)) try_point(gc, psi, true);
        }
    }

    /// Whether the caller and the obstacles permit psi.
    bool may_be(int gc, double psi) const noexcept {
        const ArcSet* clear = options_.clear[gc];
        if (clear && !contains(*clear, psi)) return false;
        return !options_.allowed || contains(*options_.allowed, psi);
    }

    // -- results

    /// A solution at the middle or an end of an arc; empty if there is none.
    Nearest somewhere(int gc, const Arc& arc) noexcept {
        Nearest out;
        for (const double psi : {0.5 * (arc.lower + arc.upper), arc.lower, arc.upper}) {
            best_ = {0.0, psi, gc, false};
            out = result();
            if (out.status == Status::OK || arc.upper - arc.lower <= tolerance::same_psi) break;
        }
        return out;
    }

    /// Returns the seed itself if it solves the pose, since nothing is nearer; false if it does not.
    bool keep_near(Nearest& out) noexcept {
        if (!options_.near || options_.metric == Metric::margin) return false;
        if (!within_limits(arm_.limits, options_.near, 0.0)) return false;
        const Posture here = forward(arm_, options_.near);
        if (here.psi != here.psi || !(options_.branches >> here.gc & 1)) return false;
        if (!same_pose(arm_.size, pose_, here.pose)) return false;
        if (!may_be(here.gc, here.psi)) return false;
        if (limits_.margin > 0) {
            const int elbow = here.gc >> 1 & 1;
            if (elbow_[elbow].open) open(elbow);
            if (!contains(arcs(here.gc), here.psi)) return false;
        }
        out = finished(options_.near, here.psi, here.gc);
        return true;
    }

    /// The result with the status UNPROVEN (or NEAR_SINGULAR without a solution) if the search was cut short.
    Nearest proven(Nearest out) const noexcept {
        if (!cut_ && rounds_ >= 0) return out;
        const bool none = out.status == Status::LIMITS || out.status == Status::ELBOW_LIMIT;
        if (out.status == Status::OK) out.status = Status::UNPROVEN;
        if (none) out.status = Status::NEAR_SINGULAR;
        return out;
    }

    /// The complete result for the best solution found.
    Nearest result() noexcept {
        if (best_.gc < 0) return refused(Status::LIMITS);
        const int gc = best_.gc;
        const auto at = [this, gc](double psi) { return posture(gc, psi); };
        const auto is_open = [this, gc](double psi) { return holds(gc, -1, psi); };
        // the result of inverse() at the returned psi
        const Nearest out = kept_within(at, is_open, wrap(best_.psi), gc);
        return out.margin > 0 && !elbow_[gc >> 1 & 1].delicate ? out : checked(out);
    }

    /// Checks a solution that rounding, a limit or two joints on one axis may have moved off its pose.
    /// Returns it unchanged or moved back onto the pose; empty if no solution within the limits is there.
    [[gnu::noinline, gnu::cold]] Nearest checked(const Nearest& out) const noexcept {
        Joints q{};
        for (int j = 0; j < joints; ++j) q.q[j] = out.q[j];
        Twist rest;
        const Pose<double> pose{orthonormal(pose_.rotation), pose_.position};
        const double off = distance(arm_, q.q, pose, arm_.size, rest);
        if (out.margin >= 0 && off <= 0.1 * settled_rule::meets * arm_.size) return out;
        int rounds = settled_rule::rounds;
        const Relaxed on = settled(arm_, sides_of(out.gc, q), q, pose, {}, 0.0, rounds);
        const Nearest settled_on = meets(arm_, on) ? told(on.at) : refused(Status::LIMITS);
        // in its self-motion a solution at a limit may settle outside the permitted arcs
        const bool meets_it = out.margin >= 0 && off <= settled_rule::meets * arm_.size;
        return settled_on.status != Status::OK && meets_it ? out : settled_on;
    }

    /// The limits of a search near a configuration. If branches are restricted, joints 2, 4 and 6 keep the
    /// signs of gc.
    Limits sides_of(int gc, const Joints& q) const noexcept {
        Limits out = arm_.limits;
        if (limits_.margin > 0) keep_off_singular(arm_, q.q, limits_.margin, out);
        if (options_.branches == (1u << configurations) - 1) return out;
        const Configuration<double> c = configuration(gc);
        const double side[3] = {c.shoulder, c.elbow, c.wrist};
        for (int h = 0; h < 3; ++h) keep_on_side(arm_, 2 * h + 1, q.q[2 * h + 1], side[h], 0.0, out);
        return out;
    }

    /// The complete result for given joints; empty if the caller did not permit them.
    Nearest told(const Joints& q) const noexcept {
        const Posture here = forward(arm_, q.q);
        if (is_nan(here.psi)) return refused(Status::FOLDED);
        if (!is_off_singular(q)) return refused(Status::NEAR_SINGULAR);
        const int gc = asked_branch(here.gc, q);
        if (!(options_.branches >> gc & 1) || !may_be(gc, here.psi)) return refused(Status::NOT_ALLOWED);
        return finished(q.q, here.psi, gc);
    }

    /// Whether joints 2, 4 and 6 keep the singularity margin.
    bool is_off_singular(const Joints& q) const noexcept {
        double least = infinity;
        for (const int h : {1, 3, 5}) least = min(least, abs(sin_cos(detail::bend(arm_, h, q.q[h])).sin));
        return least >= limits_.sin_margin - tolerance::isolated;
    }

    /// The branch of a configuration. At a singularity it belongs to several branches; then the requested one
    /// of them.
    int asked_branch(int gc, const Joints& q) const noexcept {
        // a stretched elbow's bend is the root of the rounding of the wrist's distance
        const double untold = sqrt(2.0 * tolerance::stretched);
        unsigned straight = abs(circle_.triangle.eta.sin) <= untold ? 2u : 0u;
        for (int h = 0; h < hinges; ++h) {
            const int j = hinge_joint[h];
            const double sine = sin_cos(to_theta(q.q[j], arm_.sign[j], arm_.offset[j])).sin;
            if (abs(sine) <= tolerance::singular) straight |= h == 0 ? 1u : 4u;
        }
        for (unsigned mirrored = 0; mirrored < configurations; ++mirrored) {
            const int other = gc ^ static_cast<int>(mirrored);
            if ((mirrored & ~straight) == 0 && (options_.branches >> other & 1)) return other;
        }
        return gc;
    }

    // -- near singularities, and where limits leave isolated solutions: psi has too few digits there

    /// The cost of a solution as an angle (rad); infinite if there is none.
    double rank(const Nearest& x) const noexcept {
        if (x.status != Status::OK) return infinity;
        return options_.metric == Metric::margin ? -x.margin : x.distance;
    }

    /// Replaces a solution by a better one that is found numerically on the joints.
    [[gnu::noinline, gnu::cold]] void look_beside(Nearest& out) noexcept {
        // a result near the seed is so good that few other starts matter
        if (options_.near && options_.metric != Metric::margin) {
            Joints q{};
            for (int j = 0; j < joints; ++j) q.q[j] = options_.near[j];
            try_start(q, forward(arm_, q.q).gc, nearest_rule::seed, out);
        }
        if (out.status != Status::OK) {
            // whether a solution exists must not depend on the seed
            NearestOptions seedless = options_;
            seedless.near = nullptr;
            seedless.metric = Metric::l2;
            for (double& w : seedless.weight) w = 1.0;
            const Nearest some = NearestSearch(arm_, limits_, pose_, seedless, rounds_).some();
            if (some.status == Status::OK) out = finished(some.q, some.psi, some.gc);
        }
        if (out.status == Status::OK) {
            Joints q{};
            for (int j = 0; j < joints; ++j) q.q[j] = out.q[j];
            try_beside(q, out.gc, out);
            const Joints other = turned(q);
            if (largest_move(other.q, q.q) > pi) try_start(other, out.gc, nearest_rule::start, out);
        }
        for (int elbow = 0; elbow < 2; ++elbow) {
            ElbowBranches& e = elbow_[elbow];
            if (!e.open) continue;
            open(elbow);
            if (out.status != Status::OK) break;
            look_beside_straight(elbow, out);
            if (limits_.locked) look_at_limits(elbow, out);
            for (int i = 0; i < e.corners; ++i) {
                const auto& [gc, psi] = e.corner[i];
                try_start(turned(posture(gc, psi)), gc, nearest_rule::start, out);
            }
        }
        if (!squares() && out.status == Status::OK) narrow(out);
    }

    /// Starts searches at the psi where joint 2 or 6 is nearest to 0 and to pi, if near enough; all around
    /// the circle if both are.
    void look_beside_straight(int elbow, Nearest& out) noexcept {
        const ElbowBranches& e = elbow_[elbow];
        const double band = any_ ? poor_band(limits_) : nearest_rule::beside, gap = 0.5 * band * band;
        for (const Hinge<double>& h : e.functions.hinge) {
            const double top = atan2(h.H.s, h.H.c);
            const bool high = h.high.below_one <= gap, low = h.low.above_minus_one <= gap;
            if (high) starts_at(elbow, top, nearest_rule::start, out);
            if (low) starts_at(elbow, top + pi, nearest_rule::start, out);
            if (!(h.swing <= band && (high || low || circle_.triangle.eta.sin <= band))) continue;
            for (int i = 1; i < nearest_rule::first_boxes; ++i)
                starts_at(elbow, top + two_pi / nearest_rule::first_boxes * i, nearest_rule::seed, out);
        }
    }

    /// Starts searches at the psi where a joint is at a limit; if a solution is known, only for locked
    /// joints.
    void look_at_limits(int elbow, Nearest& out) noexcept {
        const ElbowBranches& e = elbow_[elbow];
        for (int j = 0; j < joints; ++j) {
            const JointCost& c = joint_[j];
            const bool locked = c.upper - c.lower <= tolerance::locked;
            if (j == 3 || !(locked || out.status != Status::OK)) continue;
            for (const double limit : {c.lower, c.upper}) {
                if (!(abs(limit) < infinity)) continue;
                const Roots at = limit_psi(e, j, limit);
                for (int i = 0; i < at.count; ++i) starts_at(elbow, at.psi[i], nearest_rule::start, out);
                if (locked) break;
            }
        }
    }

    /// Takes any solution with a bend of the elbow that the pose does not distinguish from its own. Near
    /// theta_2 or theta_6 = 0 such a small bend moves their neighbours far.
    void try_bends(int elbow, Nearest& out) noexcept {
        const BendRange bends = bends_of(arm_, circle_.distance);
        const auto &w = circle_.w, &e = circle_.tool_e, &z = circle_.tool_z;
        const double sine[hinges] = {hypot(w.x, w.y), hypot(e.z, z.z)};
        double last = not_a_number;
        const auto look = [&](double bend) {
            bend = min(max(bend, bends.least), bends.most);
            if (bend == last) return;
            last = bend;
            SelfMotion<double> m =
                self_motion(arm_, with_bend(arm_, circle_, bend), configuration(2 * elbow));
            for (int branch = 0; branch < 4 && out.status != Status::OK; ++branch) {
                const int gc = gc_of(elbow, branch);
                if (!(options_.branches >> gc & 1) || possible(gc).empty()) continue;
                m.gc = configuration(gc);
                ArcSet arcs;
                if (feasible(m, limits_, arcs) != Status::OK) continue;
                int widest = 0;
                for (int i = 1; i < arcs.count; ++i)
                    if (arcs.arc[i].upper - arcs.arc[i].lower >
                        arcs.arc[widest].upper - arcs.arc[widest].lower)
                        widest = i;
                const double psi = 0.5 * (arcs.arc[widest].lower + arcs.arc[widest].upper);
                const Joints q = joints_within_limits(arm_, directions(m, sin_cos(psi)), nullptr);
                const Nearest found = moved_onto_pose(q, gc, {});
                if (found.status == Status::OK) out = found;
            }
        };
        for (const double end : {bends.least, bends.most}) look(end);
        for (const double size : sine)
            for (const double bend : {0.5 * size, size, 2.0 * size}) {
                look(bend);
                look(pi - bend);
            }
    }

    /// Starts searches at psi in all branches of an elbow sign that may be nearer, with and without shared
    /// rotations.
    void starts_at(int elbow, double psi, double near, Nearest& out) noexcept {
        for (int branch = 0; branch < 4; ++branch) {
            const int gc = gc_of(elbow, branch);
            if (!(options_.branches >> gc & 1) || !contains(possible(gc), psi)) continue;
            const Joints shared = turned(posture(gc, psi, nearest_rule::beside)),
                         plain = turned(posture(gc, psi));
            try_start(shared, gc, near, out);
            if (largest_move(shared.q, plain.q) > tolerance::angle) try_start(plain, gc, near, out);
        }
    }

    /// The same joints, each in the revolution nearest to `near` among those that its limits permit, or miss
    /// by at most the joint's uncertainty.
    Joints turned(Joints q) const noexcept {
        for (int j = 0; j < joints; ++j) {
            const JointCost& c = joint_[j];
            const double beside = nearest_rule::beside;
            const double theta = to_theta(q.q[j], c.sign, c.offset);
            q.q[j] = to_q(theta, c.sign, c.offset, c.lower - beside, c.upper + beside, c.near);
        }
        return q;
    }

    /// The cost of joints, including joint 4.
    double whole_cost(const Joints& q) const noexcept {
        return squares() ? cost_of(q.q) : max(cost_of(q.q), cost_of(joint_[3], q.q[3] - joint_[3].near));
    }

    /// Tries a start that may improve the result: near to the pose, and cheaper than the best solution.
    void try_start(const Joints& start, int gc, double near, Nearest& out) noexcept {
        if (any_ && out.status == Status::OK) return;
        Joints inside = start;
        for (int j = 0; j < joints; ++j)
            inside.q[j] = min(max(start.q[j], arm_.limits.lower[j]), arm_.limits.upper[j]);
        if (!(rank(finished(inside.q, 0.0, gc)) < rank(out))) return;
        Twist rest;
        if (distance(arm_, inside.q, pose_, arm_.size, rest) > near * arm_.size) return;
        try_beside(inside, gc, out);
    }

    /// Moves a start onto the pose within the limits, then to the least cost nearby; keeps the result if it
    /// improves.
    void try_beside(const Joints& start, int gc, Nearest& out) noexcept {
        Drawing pull;
        for (int j = 0; squares() && !any_ && j < joints; ++j) {
            pull.weight[j] = joint_[j].weight;
            pull.near[j] = joint_[j].near;
        }
        const Nearest found = moved_onto_pose(start, gc, pull);
        if (found.status != Status::OK) return;
        if (rank(found) < rank(out) - nearest_rule::gain) out = found;
    }

    /// The solution near a start, moved to the least attraction; empty if there is none.
    Nearest moved_onto_pose(const Joints& start, int gc, const Drawing& pull) noexcept {
        const Pose<double> pose{orthonormal(pose_.rotation), pose_.position};
        const Limits limits = sides_of(gc, start);
        bool drawn = false;
        for (const double weight : pull.weight) drawn |= weight > 0;
        const Relaxed at = drawn ? settled_beside(arm_, limits, start, pose, pull, rounds_)
                                 : settled(arm_, limits, start, pose, pull, 0.0, rounds_);
        return meets(arm_, at) ? told(at.at) : refused(Status::LIMITS);
    }

    /// Lowers the largest cost of a joint near a solution by bisection, within the box of lower costs.
    void narrow(Nearest& out) noexcept {
        const Pose<double> pose{orthonormal(pose_.rotation), pose_.position};
        Joints q{};
        for (int j = 0; j < joints; ++j) q.q[j] = out.q[j];
        const Limits limits = sides_of(out.gc, q);
        double most = whole_cost(q), least = -infinity;
        for (int j = 0; j < joints; ++j) {
            const JointCost& c = joint_[j];
            if (!(c.weight > 0)) continue;
            const double inside = min(max(c.near, limits.lower[j]), limits.upper[j]);
            least = max(least, cost_of(c, inside - c.near));
        }
        double step = nearest_rule::gain;
        for (int i = 0; i < nearest_rule::halvings && most - least > nearest_rule::gain; ++i) {
            // nearby solutions are found in small steps: steps grow until one is too long
            const double half = max(most - step, 0.5 * (most + least));
            Limits box = limits;
            for (int j = 0; j < joints; ++j) {
                const JointCost& c = joint_[j];
                if (!(c.weight > 0)) continue;
                const double room = (half + c.room) / c.weight;
                box.lower[j] = max(box.lower[j], c.near - room);
                box.upper[j] = min(box.upper[j], c.near + room);
            }
            const Relaxed lower = settled(arm_, box, q, pose, {}, 0.0, rounds_);
            if (meets(arm_, lower)) q = lower.at;
            (meets(arm_, lower) ? most : least) = half;
            step = meets(arm_, lower) ? 4.0 * step : infinity;
        }
        const Nearest found = told(q);
        if (found.status == Status::OK && rank(found) < rank(out) - nearest_rule::gain) out = found;
    }

    const LimitTable& limits_;
    const Pose<double>& pose_;

    Circle<double> circle_;
    ElbowBranches elbow_[2];
    AllArcs arcs_;
    Sides sides_[2][2];
    unsigned filled_ = 0, sided_ = 0, judged_ = 0;  // one bit for each of these that is computed
    ArcSet possible_[configurations];
    Best best_;
    double ceiling_ = infinity;  // cost of another elbow
    double first_ = 0;
    int work_ = 0;  // splits left for a first box
    int left_ = nearest_rule::all_work;
    bool cut_ = false;  // some first box was not searched to its end
    int& rounds_;       // of settled(), left for the pose
    bool any_ = false;  // any solution will do
    double least_[configurations][nearest_rule::first_boxes],
        value_[configurations][nearest_rule::first_boxes];
};

}  // namespace detail

/// The solution of a pose that is nearest to a seed, globally over the permitted branches, all feasible psi
/// and all revolutions.
inline Nearest nearest_posture(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
                               const NearestOptions& options) noexcept {
    int rounds = nearest_rule::settling;
    return detail::NearestSearch(arm, limits, pose, options, rounds).best();
}

/// Any solution of a pose in the given branches (one bit each), or the reason for none. If psi has too few
/// digits for arcs, this function decides whether a pose is solvable.
inline Nearest some_posture(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
                            unsigned branches = (1u << configurations) - 1) noexcept {
    int rounds = nearest_rule::settling;
    NearestOptions options;
    options.branches = branches;
    return detail::NearestSearch(arm, limits, pose, options, rounds).some();
}

/// The nearest solution of each branch and arc: first that of nearest_posture(), then by rising distance.
inline void nearest_postures(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
                             const NearestOptions& options, Nearests& out) noexcept {
    int rounds = nearest_rule::settling;
    detail::NearestSearch(arm, limits, pose, options, rounds).all(out);
}

}  // namespace armangle

#include "../names/end.hpp"
