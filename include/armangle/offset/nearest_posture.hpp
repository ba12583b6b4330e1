// The nearest posture of an arm with an offset in every metric, among arcs of the user's own, and one for
// each branch and arc: NearestOptions as of any arm.
//
// feasible.hpp gives the arcs of a branch: on them every value has a posture within the limits, so that cells
// need not be judged, only bounded.
//
//     cost |\      _        a cell is dropped where its bound is above the best cost known, left with one end
//          | \    / \       where the cost rises or falls all over it, and halved else
//          +------------ free
//
// Postures of which arcs do not tell, where two joints share a turn, are nearest.hpp's.
#pragma once

#include "../limits/nearest.hpp"
#include "../scene/clear_cells.hpp"
#include "nearest.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// How the least cost on an arc is found.
struct OffsetCostTuning {
    int cells = 24;            // of the circle, to begin with
    int looks = 10000;         // cells looked at on one arc before the best found is taken
    double finest = 2e-7;      // rad: half width of a cell whose smooth cost is finished by Newton's method
    double narrowest = 1e-12;  // rad: half width of any other cell that is not halved again
    int newton = 8;
};

namespace detail {

/// The search of one pose over arcs of the free joint. Options are in the order of the formulas.
class OffsetArcSearch : PostureCosts {
public:
    OffsetArcSearch(const OffsetArm& arm, const Pose<double>& exact, const NearestOptions& in_order,
                    const OffsetCostTuning& tuning) noexcept
        : PostureCosts(arm.rest, in_order), offset_(arm), pose_(exact), tuning_(tuning) {}

    /// Offers some postures of an arc, so that less of it, and of others, need be searched.
    void begin(int gc, const Arc& arc) noexcept {
        const OffsetCells cells(offset_, pose_, gc);
        const int parts = parts_of(arc);
        const double width = (arc.upper - arc.lower) / parts;
        for (int k = 0; k < parts; ++k) offer(cells, gc, arc, arc.lower + (k + 0.5) * width);
        if (options_.near && options_.metric != Metric::margin) {
            const double seed = lift(joint_[joints - 1].near, 0.5 * (arc.lower + arc.upper));
            offer(cells, gc, arc, min(max(seed, arc.lower), arc.upper));
        }
    }

    /// Searches an arc of branch gc for what costs less than the best known.
    void search(int gc, const Arc& arc) noexcept {
        struct Cell {
            double lower, upper;
        };
        const OffsetCells cells(offset_, pose_, gc);
        offer(cells, gc, arc, arc.lower);
        if (!(arc.upper > arc.lower)) return;
        offer(cells, gc, arc, arc.upper);
        Cell stack[most_cells];
        const int parts = parts_of(arc);
        const double width = (arc.upper - arc.lower) / parts;
        int top = 0, looks = 0;
        for (int k = parts; k-- > 0;)
            stack[top++] = {arc.lower + k * width, k + 1 < parts ? arc.lower + (k + 1) * width : arc.upper};
        while (top > 0 && looks++ < tuning_.looks) {
            const Cell cell = stack[--top];
            const double middle = 0.5 * (cell.lower + cell.upper), half = middle - cell.lower;
            Bound of;
            if (!bound(cells, middle, half, of) || dropped(of.least)) continue;
            if (of.rises || of.falls) {
                offer(cells, gc, arc, of.rises ? cell.lower : cell.upper);
                continue;
            }
            offer(cells, gc, arc, middle);
            const bool finished = of.smooth && squares();
            if (half < (finished ? tuning_.finest : tuning_.narrowest) || top + 2 > most_cells) {
                offer(cells, gc, arc, cell.lower);
                offer(cells, gc, arc, cell.upper);
                continue;
            }
            stack[top++] = {middle, cell.upper};
            stack[top++] = {cell.lower, middle};
        }
    }

    /// Whether a posture was found.
    bool found() const noexcept { return gc_ >= 0; }
    /// Forgets it.
    void forget() noexcept {
        cost_ = infinity;
        gc_ = -1;
    }

    /// The best posture, in the robot's order.
    Nearest result() const noexcept {
        const OffsetCells cells(offset_, pose_, gc_);
        const auto at = [&](double free) {
            Joints out{};
            joints_at(cells, free, out.q);
            return out;
        };
        const auto is_open = [&](double free) {
            const double lifted = lift(free, 0.5 * (arc_.lower + arc_.upper));
            return lifted >= arc_.lower && lifted <= arc_.upper;
        };
        Nearest in_order = kept_within(at, is_open, free_, gc_);
        if (!settle(in_order)) return refused(Status::NEAR_SINGULAR);
        Nearest out = in_order;
        for (int j = 0; j < joints; ++j) out.q[robot_joint(offset_, j)] = in_order.q[j];
        out.psi = out.psi <= -pi ? pi : out.psi;
        return out;
    }

    using PostureCosts::insert;
    using PostureCosts::nothing;
    using PostureCosts::refused;

private:
    static constexpr int most_cells = 128;

    /// What a cell may cost at least, and how the cost goes over it.
    struct Bound {
        double least;
        bool smooth, rises, falls;  // each joint keeps one turn; the cost goes one way
    };

    int parts_of(const Arc& arc) const noexcept {
        return 1 + static_cast<int>((arc.upper - arc.lower) / (two_pi / tuning_.cells));
    }
    bool dropped(double least) const noexcept { return least >= cost_ - tie(cost_); }

    void joints_at(const OffsetCells& cells, double free, double* q) const noexcept {
        double theta[joint_slots];
        cells.at(free, theta);
        for (int j = 0; j < joints; ++j) q[j] = turned(j, theta[j]);
    }
    /// q of joint j on the turn within its limits that costs least.
    double turned(int j, double theta) const noexcept {
        const JointCost& c = joint_[j];
        return to_q(theta, c.sign, c.offset, c.lower, c.upper, c.near);
    }
    /// Puts a posture on its pose to the last digits, where the free joint has too few; whether it is there.
    bool settle(Nearest& in_order) const noexcept {
        Joints at{};
        for (int j = 0; j < joints; ++j) at.q[robot_joint(offset_, j)] = in_order.q[j];
        const double size = offset_.own.size;
        Twist rest;
        const bool kept = within_limits(offset_.own.limits, at.q, 0.0);
        if (kept && distance(offset_, at.q, pose_, size, rest) <= 0.1 * settled_rule::meets * size)
            return true;
        int rounds = settled_rule::rounds;
        const Relaxed on = settled(offset_, offset_.own.limits, at, pose_, {}, 0.0, rounds);
        if (!meets(offset_, on)) return false;
        for (int j = 0; j < joints; ++j) at.q[j] = on.at.q[robot_joint(offset_, j)];
        in_order = finished(at.q, in_order.psi, in_order.gc);
        return true;
    }
    /// Of all joints.
    double cost_at(const OffsetCells& cells, double free) const noexcept {
        double q[joint_slots];
        joints_at(cells, free, q);
        double sum = cost_of(joint_[0], q[0] - joint_[0].near);
        for (int j = 1; j < joints; ++j) sum = both(sum, cost_of(joint_[j], q[j] - joint_[j].near));
        return sum;
    }
    /// A sum of squares with two derivatives by the free joint.
    Jet<double, 2> squares_at(const OffsetCells& cells, double free) const noexcept {
        using J = Jet<double, 2>;
        J theta[joints];
        J sum(0.0);
        cells.at(free, theta);
        for (int j = 0; j < joints; ++j) {
            J off = J(joint_[j].sign) * theta[j];
            off.coefficient[0] = turned(j, theta[j].value()) - joint_[j].near;
            sum = sum + J(joint_[j].weight) * (off * off);
        }
        return sum;
    }

    /// Takes a posture of an arc that costs less than the best; Newton's method moves it within the arc.
    void offer(const OffsetCells& cells, int gc, const Arc& arc, double free) noexcept {
        double now = cost_at(cells, free);
        for (int pass = 0; squares() && pass < tuning_.newton; ++pass) {
            const Jet<double, 2> here = squares_at(cells, free);
            const double to = free - 0.5 * here.coefficient[1] / here.coefficient[2];
            if (!(here.coefficient[2] > 0 && to >= arc.lower && to <= arc.upper)) break;
            const double then = cost_at(cells, to);
            if (!(then <= now)) break;
            const bool still = abs(to - free) < tolerance::rounding;
            free = to;
            now = then;
            if (still) break;
        }
        if (!(now < cost_) && gc_ >= 0) return;
        cost_ = now;
        free_ = wrap(free);
        gc_ = gc;
        arc_ = arc;
    }

    /// Bounds a cell; false where some joint has no turn within its limits there.
    bool bound(const OffsetCells& cells, double middle, double half, Bound& out) const noexcept {
        OffsetCells::Over over;
        OffsetCells::Begun begun;
        cells.begin(middle, half, begun, over);
        if (over.exists == Known::outside) return false;
        cells.finish(begun, over);
        out = {squares() ? 0.0 : -infinity, over.exists == Known::inside, false, false};
        JointBound one[joints];
        Interval slope(0.0);
        double at_middle = 0;
        for (int j = 0; j < joints; ++j) {
            if (!bound(joint_[j], over.joint[j], one[j])) return false;
            out.least = both(out.least, one[j].least);
            out.smooth = out.smooth && one[j].smooth;
            at_middle += one[j].middle;
            slope = slope + one[j].slope;
        }
        if (!out.smooth) return true;
        if (squares()) {
            if (!slope.bounded()) {
                out.smooth = false;
                return true;
            }
            out.least = max(out.least, at_middle - half * max(abs(slope.lo), abs(slope.hi)));
            out.rises = slope.lo >= 0;
            out.falls = !out.rises && slope.hi <= 0;
            return true;
        }
        out.rises = out.falls = true;
        for (int j = 0; j < joints; ++j) {  // those that may be the largest
            if (!(one[j].most >= out.least)) continue;
            out.rises = out.rises && one[j].slope.lo >= 0;
            out.falls = out.falls && one[j].slope.hi <= 0;
        }
        if (out.rises) out.falls = false;
        return true;
    }

    /// What a joint costs over a cell, and d(cost)/d(free).
    struct JointBound {
        double least, most, middle;
        Interval slope;
        bool smooth;  // one turn costs least all over the cell
    };
    bool bound(const JointCost& c, const JointOver& over, JointBound& out) const noexcept {
        out = {cost_of(c, 0.0), infinity, 0.0, Interval::whole(), false};
        if (!over.off.bounded()) return true;
        const Interval off = c.sign > 0 ? over.off : -over.off;
        const double at = to_q(over.middle, c.sign, c.offset);
        const double fewest = ceil((c.lower - at) / two_pi), most_turns = floor((c.upper - at) / two_pi);
        const double turn = min(max(round((c.near - at) / two_pi), fewest), max(fewest, most_turns));
        double least = infinity, most = infinity, second = infinity, here = at;
        for (const double k : {turn - 1.0, turn, turn + 1.0}) {
            const double q = at + two_pi * k;
            const double from = max(q + off.lo, c.lower - tolerance::angle),
                         to = min(q + off.hi, c.upper + tolerance::angle);
            if (!(from <= to)) continue;
            const double nearest = max(0.0, max(from - c.near, c.near - to));
            if (nearest < least) {
                second = least;
                least = nearest;
                most = max(abs(from - c.near), abs(to - c.near));
                here = q;
            } else {
                second = min(second, nearest);
            }
        }
        if (!(least < infinity)) return false;
        out.least = cost_of(c, least);
        out.most = cost_of(c, most);
        out.middle = cost_of(c, here - c.near);
        // a turn of a joint that has several may end within the cell
        out.smooth = second > most && (!c.wide || (here + off.lo >= c.lower && here + off.hi <= c.upper));
        const Interval d{here + off.lo - c.near, here + off.hi - c.near};
        const Interval rate = Interval(c.sign) * over.slope;
        if (squares()) {
            out.slope = Interval(2.0 * c.weight) * d * rate;
        } else {
            const Interval way(d.hi <= 0 || d.lo < 0 ? -1.0 : 1.0, d.hi > 0 || d.lo >= 0 ? 1.0 : -1.0);
            out.slope = Interval(c.weight) * way * rate;
        }
        return true;
    }

    const OffsetArm& offset_;
    const Pose<double>& pose_;
    const OffsetCostTuning& tuning_;
    double cost_ = infinity, free_ = 0;
    int gc_ = -1;
    Arc arc_{};
};

/// What is asked, in the order of the formulas: `near` is where the seed goes.
inline NearestOptions in_formula_order(const OffsetArm& arm, const NearestOptions& asked,
                                       double (&near)[joints]) noexcept {
    NearestOptions out = asked;
    for (int j = 0; j < joints; ++j) {
        const int k = robot_joint(arm, j);
        out.weight[j] = asked.weight[k];
        if (asked.near) near[j] = asked.near[k];
    }
    if (asked.near) out.near = near;
    return out;
}

/// The arcs of each branch that may be used, and why there are none.
struct OffsetOpen {
    ArcSet arcs[configurations];
    Status status[configurations];
    bool doubtful = false;  // some branch has more than arcs tell

    OffsetOpen(const OffsetArm& arm, const Pose<double>& exact, const NearestOptions& o,
               const Scene* scene) noexcept {
        constexpr unsigned all = (1u << configurations) - 1;
        ProvenArcs found[configurations];
        if ((o.branches & all) == all) feasible_all(arm, exact, arm.own.limits, found);
        for (int gc = 0; gc < configurations; ++gc) {
            make_empty(arcs[gc]);
            status[gc] = Status::UNREACHABLE;
            if (!(o.branches >> gc & 1u)) continue;
            if ((o.branches & all) != all) feasible(arm, exact, gc, found[gc]);
            Tag blocking = 0;
            if (scene) keep_clear(arm, *scene, exact, gc, found[gc], blocking);
            arcs[gc] = found[gc].arcs;
            status[gc] = found[gc].status;
            doubtful = doubtful || found[gc].unproven > 0 || found[gc].status == Status::NEAR_SINGULAR;
            if (status[gc] != Status::OK || !o.allowed) continue;
            intersect(found[gc].arcs, *o.allowed, arcs[gc]);
            if (arcs[gc].empty()) status[gc] = Status::NOT_ALLOWED;
        }
    }
};

/// A posture of nearest() in the words of any arm's.
inline Nearest as_nearest(const OffsetNearest& found, bool seeded) noexcept {
    Nearest out{};
    for (int j = 0; j < joints; ++j) out.q[j] = found.q[j];
    out.psi = found.free;
    out.gc = found.gc;
    out.status = found.status;
    out.distance = seeded ? found.distance : not_a_number;
    out.margin = found.margin;
    out.gap = is_solved(found.status) ? 0.0 : not_a_number;
    return out;
}

}  // namespace detail

/// The posture of a pose that costs least, globally: over the branches and values of the free joint that may
/// be used, and all turns. Where the metric is l2 and nothing is `allowed`, also of those postures of which
/// arcs do not tell; else UNPROVEN where there are such, and none that arcs tell of.
inline Nearest nearest_posture(const OffsetArm& arm, const Pose<double>& pose, const NearestOptions& options,
                               const Scene* scene = nullptr, const OffsetCostTuning& tuning = {}) noexcept {
    const bool squares = options.metric == Metric::l2, seeded = options.near != nullptr;
    if (squares && !options.allowed)
        return detail::as_nearest(nearest(arm, pose, options.near, options.weight, options.branches, scene),
                                  seeded);
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    double near[joints];
    const NearestOptions in_order = detail::in_formula_order(arm, options, near);
    const detail::OffsetOpen open(arm, exact, options, scene);
    detail::OffsetArcSearch search(arm, exact, in_order, tuning);
    for (int gc = 0; gc < configurations; ++gc)
        for (int i = 0; i < open.arcs[gc].count; ++i) search.begin(gc, open.arcs[gc].arc[i]);
    for (int gc = 0; gc < configurations; ++gc)
        for (int i = 0; i < open.arcs[gc].count; ++i) search.search(gc, open.arcs[gc].arc[i]);
    if (search.found()) return search.result();
    Nearest none = search.nothing(open.status);
    if (!open.doubtful) return none;
    const OffsetNearest beside = nearest(arm, pose, options.near, options.weight, options.branches, scene);
    const bool kept =
        is_solved(beside.status) && !(options.allowed && !contains(*options.allowed, beside.free));
    if (!kept) return none;
    none = detail::as_nearest(beside, false);
    none.status = Status::UNPROVEN;
    return none;
}

/// The nearest posture of each branch and arc: first that of nearest_posture(), then by rising cost.
inline void nearest_postures(const OffsetArm& arm, const Pose<double>& pose, const NearestOptions& options,
                             Nearests& out, const Scene* scene = nullptr,
                             const OffsetCostTuning& tuning = {}) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    double near[joints];
    const NearestOptions in_order = detail::in_formula_order(arm, options, near);
    const detail::OffsetOpen open(arm, exact, options, scene);
    detail::OffsetArcSearch search(arm, exact, in_order, tuning);
    const Nearest first = nearest_posture(arm, pose, options, scene, tuning);
    const int its = is_solved(first.status) ? find(open.arcs[first.gc], first.psi).index : -1;
    out.count = 0;
    out.status = first.status;
    for (int gc = 0; gc < configurations; ++gc)
        for (int i = 0; i < open.arcs[gc].count; ++i) {
            const bool is_first = is_solved(first.status) && gc == first.gc && i == its;
            if (is_first) continue;
            search.forget();
            search.begin(gc, open.arcs[gc].arc[i]);
            search.search(gc, open.arcs[gc].arc[i]);
            if (search.found()) search.insert(out, search.result());
        }
    if (!is_solved(first.status)) return;
    out.status = Status::OK;
    if (out.count == Nearests::capacity) --out.count;
    for (int at = out.count; at > 0; --at) out.found[at] = out.found[at - 1];
    ++out.count;
    out.found[0] = first;
}

}  // namespace armangle

#include "../names/end.hpp"
