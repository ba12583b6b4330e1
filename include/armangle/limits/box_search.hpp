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

#include "branch_arcs.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Branch and bound over boxes of psi: the least cost on the arcs of some branches.
class BoxSearch : protected BranchArcs {
public:
    using BranchArcs::BranchArcs;

protected:
    /// Places equal boxes around the circle. If the cost counts from a seed, carried() is the middle of one.
    void place_boxes() noexcept {
        const bool seeded = options_.near && options_.metric != Metric::margin;
        first_ = seeded ? carried() : -pi + pi / NearestTuning::first_boxes;
    }

    /// Computes lower bounds of the cost over the boxes of place_boxes() for the permitted branches of an
    /// elbow sign (0: positive, 1: negative).
    void survey(int elbow) noexcept {
        const ElbowBranches& e = elbow_[elbow];
        constexpr int n = NearestTuning::first_boxes;
        const double width = two_pi / n;
        const Boxes r(0.5 * width);
        for (int i = 0; i < n; i += 8) {
            double middle[8];
            for (int k = 0; k < 8; ++k) middle[k] = first_ + width * (i + k);
            survey_eight(e, elbow, i, Boxes::load(middle), r);
        }
    }

    /// Computes lower bounds for the branches of an elbow sign over eight boxes of half width r, from box i
    /// on.
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

    /// Keeps the solution at the cheapest middle of a box that is feasible in one of `branches` (bits), if
    /// any, so that dearer boxes can be skipped. only_arc: the index of the arc that must hold it, or -1.
    void offer_middles(unsigned branches, int only_arc) noexcept {
        constexpr int n = NearestTuning::first_boxes;
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
        constexpr int n = NearestTuning::first_boxes;
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
            const int given = NearestTuning::work < left_ ? NearestTuning::work : left_;
            work_ = given;
            look_into(next.branches, next.index, only_arc);
            cut_ |= work_ < 0;
            left_ -= work_ > 0 ? given - work_ : given;
        }
    }

    /// Searches box i for some branches of an elbow sign: together those whose arcs contain all of it, others
    /// singly.
    void look_into(unsigned branches, int i, int only_arc) noexcept {
        const double width = two_pi / NearestTuning::first_boxes, middle = first_ + width * i;
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

    /// Whether a box with this lower bound cannot contain a better solution.
    bool dropped(double least) const noexcept { return !(least < worth()) || least > ceiling_; }

    /// Eight bits: bit k is set if box k may contain a better solution, by its lower bound `least`.
    unsigned kept(const Boxes& least) const noexcept {
        return bits((least < Boxes(worth())) & (least <= Boxes(ceiling_)));
    }

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

    /// If a revolution of a joint ends at psi, keeps the solutions there that are better than the best: two
    /// revolutions that end at one psi, from either side, are both possible only there.
    void try_end(unsigned branches, double psi) noexcept {
        const ElbowBranches& e = elbow_of(branches);
        bool ends = false;
        for (int i = 0; i < e.cuts; ++i) ends |= abs(wrap(e.cut[i] - psi)) <= tolerance::isolated;
        for (int gc = 0; ends && gc < configurations; ++gc)
            if (is_in(gc, branches)) try_point(gc, psi, false);
    }

    /// Splits [from, to], in which no revolution ends, into eight boxes and searches them. If it is too
    /// narrow or the work is spent, only its ends are tried.
    void descend(unsigned branches, double from, double to, int depth) noexcept {
        const double radius = (to - from) / 16;
        if (radius < NearestTuning::narrowest || depth > NearestTuning::deepest || --work_ < 0) {
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

    /// Refines the best solution by Newton's method. From its cost alone a minimum is known to half the
    /// digits.
    void polish() noexcept {
        if (!squares() || best_.gc < 0 || best_.stationary) return;
        const double radius = 4 * NearestTuning::apart, psi = best_.psi;
        const int gc = best_.gc;
        const BoxCosts here = costs(gc, Boxes(psi), Boxes(radius));
        if (!(here.smooth & 1) || !(here.second.lower()[0] > 0)) return;
        const double second = here.second.middle[0], move = here.slope[0] / second;
        if (abs(move) < radius && holds(gc, -1, psi - move)) newton(gc, psi, radius, here.slope[0], second);
    }

    /// Finds the minimum of a box on which the cost is convex, with these derivatives at the middle, and
    /// keeps it if it is better than the best solution.
    void newton(int gc, double middle, double radius, double slope, double second) noexcept {
        double lower = middle - radius, upper = middle + radius, psi = middle;
        for (int i = 0; i < NearestTuning::newton; ++i) {
            (slope > 0 ? upper : lower) = psi;
            double next = psi - slope / second;
            if (!(next >= lower && next <= upper)) next = slope > 0 ? lower : upper;
            if (i > 3 && !(next > lower && next < upper)) next = 0.5 * (lower + upper);
            const double move = abs(next - psi);
            psi = next;
            if (!(move > NearestTuning::narrowest && move * move > NearestTuning::smallest_square * radius))
                break;
            const BoxCosts at = costs(gc, Boxes(psi), Boxes(0.0));
            slope = at.slope[0];
            second = at.second.middle[0];
        }
        try_point(gc, psi, true);
    }

    static constexpr unsigned elbow_branches = 0x33;  // of the first elbow: gc 0, 1, 4, 5
    double ceiling_ = infinity;                       // cost of another elbow
    double first_ = 0;
    int work_ = 0;  // splits left for a first box
    int left_ = NearestTuning::all_work;
    bool cut_ = false;  // some first box was not searched to its end
    double least_[configurations][NearestTuning::first_boxes],
        value_[configurations][NearestTuning::first_boxes];
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
