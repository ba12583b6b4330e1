// The nearest solution of a pose: the one of least cost, globally over all branches, feasible psi and turns.
//
// Arcs and boxes of psi decide (box_search.hpp). Near singularities and where limits leave isolated solutions
// psi has too few digits: there the joints themselves are searched, from starts that psi suggests.
#pragma once

#include "box_search.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Searches the nearest solution of one pose: the arcs of each branch, and the least cost on each of them.
class NearestSearch : protected BoxSearch {
public:
    /// Computes everything that depends on the pose but not on psi.
    using BoxSearch::BoxSearch;
    using BoxSearch::put_in;

    /// The nearest solution of all, or the reason why there is none.
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
        if (elbow_[0].ill_conditioned || elbow_[1].ill_conditioned) [[unlikely]]
            search_by_joints(out);
        return proven(out);
    }

    /// Writes the nearest solution of each branch and arc to `out`.
    void all(Nearests& out) noexcept {
        place_boxes();
        for (int elbow = 0; elbow < 2; ++elbow) {
            if (!elbow_[elbow].open) continue;
            prepare_elbow(elbow);
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
        put_best_first(out);
        if (out.count > 0) out.status = out.found[0].status;
    }

    /// Puts the result of best() first and removes the other result of the same arc.
    void put_best_first(Nearests& out) const noexcept {
        int rounds = NearestTuning::local_rounds;
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
            if (elbow_[elbow].open) prepare_elbow(elbow);
        for (int gc = 0; gc < configurations; ++gc)
            for (int arc = 0; arc < arcs(gc).count; ++arc) {
                const Nearest out = somewhere(gc, arcs(gc).arc[arc]);
                if (out.status == Status::OK) return out;
            }
        Nearest out = nothing();
        any_ = true;
        if (search_bends(out))
            for (int elbow = 0; elbow < 2 && out.status != Status::OK; ++elbow) {
                if (!elbow_[elbow].hides) continue;
                search_near_singular(elbow, out);
                look_at_limits(elbow, out);
            }
        return out.status == Status::OK ? out : proven(out);
    }

    /// Removes isolated psi without a solution from a branch's arcs, and adds those found on the joints. If a
    /// joint is slightly `beyond` its limit on the arcs, also removes arcs without a solution.
    void keep_held(int gc, bool beyond, ArcSet& arcs) noexcept {
        const ElbowBranches& e = elbow_[gc >> 1 & 1];
        if (!e.open) return make_empty(arcs);
        prepare_elbow(gc >> 1 & 1);
        keep_tenable(gc, beyond, arcs);
        if (arcs.full) return;
        if (e.lost[0] || e.lost[1]) return;
        const ArcSet own = this->arcs(gc);
        for (int i = 0; i < own.count; ++i)
            if (is_isolated(own.arc[i]) && !contains(arcs, own.arc[i].lower)) put(arcs, own.arc[i]);
    }

private:
    /// If the cost is a sum, or both elbow signs cost the same: searches the cheaper sign first, and the
    /// other one too if it may be better.
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

    /// Keeps the solutions of an elbow sign that need no search; returns whether a search may find a better
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

    /// The cost of a solution including joint 4; infinite if there is none.
    double with_elbow(const Best& b) const noexcept {
        if (b.gc < 0) return infinity;
        return squares() ? b.cost : max(b.cost, elbow_[b.gc >> 1 & 1].cost_4);
    }

    /// Keeps the best solutions at the psi of an elbow sign at which two joints rotate around one axis and
    /// can share their rotation in any way.
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

    /// The psi at which the larger cost of joints 2 and 6 is least. No solution with this elbow sign costs
    /// less than `cost`, in any branch; -infinity if unknown.
    struct LeastBent {
        double cost, psi;
    };

    /// Computes LeastBent, if the limits of joints 2 and 6 are symmetric around theta = 0. Each |theta| is
    /// least where its cosine is largest, and rises from there on both sides. So the larger cost is least at
    /// one of these two psi, or where the costs cross on the shorter way between them.
    LeastBent least_bent(const ElbowBranches& e) const noexcept {
        if (options_.metric != Metric::margin || e.ill_conditioned) return {-infinity, not_a_number};
        double top[hinges];
        for (int h = 0; h < hinges; ++h) {
            const JointCost& c = joint_[hinge_joint[h]];
            const Harmonic<double>& H = e.functions.hinge[h].H;
            top[h] = atan2(H.s, H.c);
            const bool alike = abs(to_theta(arm_, hinge_joint[h], c.near)) <= NearestTuning::noise;
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
            if (move * move <= NearestTuning::smallest_square || i == NearestTuning::newton)
                return {min(now.cost[0] + now.slope[0] * move, now.cost[1] + now.slope[1] * move),
                        top[0] + x + move};
            if (!((x + move - before) * (x + move - behind) < 0)) move = 0.5 * (before + behind) - x;
            x += move;
        }
    }

    /// Keeps the solutions at a psi where two joints of a side (0: shoulder, 1: wrist) rotate around one
    /// axis, if they are better than the best.
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

    /// If the seed itself solves the pose within limits and permitted arcs, writes it to `out` as the
    /// solution, since nothing is nearer. Otherwise returns false and leaves `out` unchanged.
    bool keep_near(Nearest& out) noexcept {
        if (!options_.near || options_.metric == Metric::margin) return false;
        if (!within_limits(arm_.limits, options_.near, 0.0)) return false;
        const Posture here = forward(arm_, options_.near);
        if (here.psi != here.psi || !(options_.branches >> here.gc & 1)) return false;
        if (!same_pose(arm_.size, pose_, here.pose)) return false;
        if (!may_be(here.gc, here.psi)) return false;
        if (limits_.margin > 0) {
            const int elbow = here.gc >> 1 & 1;
            if (elbow_[elbow].open) prepare_elbow(elbow);
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

    /// Replaces `out` by a better solution, or by the first one, that is found numerically on the joints.
    [[gnu::noinline, gnu::cold]] void search_by_joints(Nearest& out) noexcept {
        // a result near the seed is so good that few other starts matter
        if (options_.near && options_.metric != Metric::margin) {
            Joints q{};
            for (int j = 0; j < joints; ++j) q.q[j] = options_.near[j];
            try_start(q, forward(arm_, q.q).gc, NearestTuning::seed, out);
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
            try_locally(q, out.gc, out);
            const Joints other = turned(q);
            if (largest_move(other.q, q.q) > pi) try_start(other, out.gc, NearestTuning::start, out);
        }
        for (int elbow = 0; elbow < 2; ++elbow) {
            ElbowBranches& e = elbow_[elbow];
            if (!e.open) continue;
            prepare_elbow(elbow);
            if (out.status != Status::OK) break;
            search_near_singular(elbow, out);
            if (limits_.locked) look_at_limits(elbow, out);
            for (int i = 0; i < e.corners; ++i) {
                const auto& [gc, psi] = e.corner[i];
                try_start(turned(posture(gc, psi)), gc, NearestTuning::start, out);
            }
        }
        if (!squares() && out.status == Status::OK) narrow(out);
    }

    /// Starts searches at the psi where joint 2 or 6 is nearest to 0 and to pi, if near enough; all around
    /// the circle if it hardly moves with psi and it or the elbow is near enough.
    void search_near_singular(int elbow, Nearest& out) noexcept {
        const ElbowBranches& e = elbow_[elbow];
        const double band = any_ ? poor_band(limits_) : NearestTuning::near_straight, gap = 0.5 * band * band;
        for (const Hinge<double>& h : e.functions.hinge) {
            const double top = atan2(h.H.s, h.H.c);
            const bool high = h.high.below_one <= gap, low = h.low.above_minus_one <= gap;
            if (high) starts_at(elbow, top, NearestTuning::start, out);
            if (low) starts_at(elbow, top + pi, NearestTuning::start, out);
            if (!(h.swing <= band && (high || low || circle_.triangle.eta.sin <= band))) continue;
            for (int i = 1; i < NearestTuning::first_boxes; ++i)
                starts_at(elbow, top + two_pi / NearestTuning::first_boxes * i, NearestTuning::seed, out);
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
                for (int i = 0; i < at.count; ++i) starts_at(elbow, at.psi[i], NearestTuning::start, out);
                if (locked) break;
            }
        }
    }

    /// Replaces `out` by any solution with a bend of the elbow that the pose does not distinguish from its
    /// own. Near theta_2 or theta_6 = 0 such a small bend moves their neighbours far. Ranges of bends without
    /// a possible psi are discarded, others are divided, the first ones first. Returns whether a branch stays
    /// undecided: its arcs at some bend lead to no solution, or there are too many ranges.
    bool search_bends(Nearest& out) noexcept {
        struct Range {
            int gc;
            BendRange bends;
        } queue[configurations + 2 * NearestTuning::bends];
        int count = 0;
        for (int gc = 0; gc < configurations; ++gc)
            if (elbow_[gc >> 1 & 1].hides && is_in(gc, options_.branches) && !possible(gc).empty())
                queue[count++] = {gc, bends_of(arm_, circle_.distance)};
        unsigned undecided = 0;
        for (int i = 0; i < count; ++i) {
            if (i == NearestTuning::bends) return true;
            const auto [gc, bends] = queue[i];
            if (is_in(gc, undecided)) continue;
            const double middle = sqrt(max(bends.least, LocalSolveTuning::meets) * bends.most);
            const SelfMotion<double> m =
                self_motion(arm_, with_bend(arm_, circle_, middle), configuration(gc));
            ArcSet arcs;
            detail::possible(limits_, m, turn_slack(arm_, circle_, middle, bends), arcs);
            if (arcs.empty()) continue;
            if (feasible(m, limits_, arcs) == Status::OK) {
                int widest = 0;
                for (int k = 1; k < arcs.count; ++k)
                    if (arcs.arc[k].upper - arcs.arc[k].lower >
                        arcs.arc[widest].upper - arcs.arc[widest].lower)
                        widest = k;
                const double psi = 0.5 * (arcs.arc[widest].lower + arcs.arc[widest].upper);
                const Joints q = joints_within_limits(arm_, directions(m, sin_cos(psi)), nullptr);
                out = moved_onto_pose(q, gc, {});
                if (out.status == Status::OK) return false;
                undecided |= 1u << gc;
            } else if (bends.most - bends.least <= LocalSolveTuning::meets) {
                undecided |= 1u << gc;
            } else {
                queue[count++] = {gc, {bends.least, middle}};
                queue[count++] = {gc, {middle, bends.most}};
            }
        }
        return undecided != 0;
    }

    /// Starts searches at psi in all branches of an elbow sign that may be nearer, with and without shared
    /// rotations. Starts further from the pose than `near` (of the arm's size) are left out.
    void starts_at(int elbow, double psi, double near, Nearest& out) noexcept {
        for (int branch = 0; branch < 4; ++branch) {
            const int gc = gc_of(elbow, branch);
            if (!(options_.branches >> gc & 1) || !contains(possible(gc), psi)) continue;
            const Joints shared = turned(posture(gc, psi, NearestTuning::near_straight)),
                         plain = turned(posture(gc, psi));
            try_start(shared, gc, near, out);
            if (largest_move(shared.q, plain.q) > tolerance::angle) try_start(plain, gc, near, out);
        }
    }

    /// Solves from a start that is cheaper than the best solution and within `near` (of the arm's size) of
    /// the pose, and replaces `out` if the result is better.
    void try_start(const Joints& start, int gc, double near, Nearest& out) noexcept {
        if (any_ && out.status == Status::OK) return;
        Joints inside = start;
        for (int j = 0; j < joints; ++j)
            inside.q[j] = min(max(start.q[j], arm_.limits.lower[j]), arm_.limits.upper[j]);
        if (!(rank(finished(inside.q, 0.0, gc)) < rank(out))) return;
        Twist rest;
        if (distance(arm_, inside.q, pose_, arm_.size, rest) > near * arm_.size) return;
        try_locally(inside, gc, out);
    }

    /// Moves a start onto the pose within the limits, then to the least cost nearby; keeps the result if it
    /// improves.
    void try_locally(const Joints& start, int gc, Nearest& out) noexcept {
        Attraction pull;
        for (int j = 0; squares() && !any_ && j < joints; ++j) {
            pull.weight[j] = joint_[j].weight;
            pull.near[j] = joint_[j].near;
        }
        const Nearest found = moved_onto_pose(start, gc, pull);
        if (found.status != Status::OK) return;
        if (rank(found) < rank(out) - NearestTuning::gain) out = found;
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
        double step = NearestTuning::gain;
        for (int i = 0; i < NearestTuning::halvings && most - least > NearestTuning::gain; ++i) {
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
            const Relaxed lower = solve_locally(arm_, box, q, pose, {}, 0.0, rounds_);
            if (meets(arm_, lower)) q = lower.at;
            (meets(arm_, lower) ? most : least) = half;
            step = meets(arm_, lower) ? 4.0 * step : infinity;
        }
        const Nearest found = make_result(q);
        if (found.status == Status::OK && rank(found) < rank(out) - NearestTuning::gain) out = found;
    }

    bool any_ = false;  // any solution will do
};

}  // namespace detail

/// The solution of a pose with the least cost (nearest to the seed, or furthest from the limits), globally
/// over the permitted branches, all feasible psi and all revolutions; or the reason why there is none.
inline Nearest nearest_posture(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
                               const NearestOptions& options) noexcept {
    int rounds = NearestTuning::local_rounds;
    return detail::NearestSearch(arm, limits, pose, options, rounds).best();
}

/// Any solution of a pose in the given branches (one bit each), or the reason for none. If psi has too few
/// digits for arcs, this function decides whether a pose is solvable.
inline Nearest some_posture(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
                            unsigned branches = (1u << configurations) - 1) noexcept {
    int rounds = NearestTuning::local_rounds;
    NearestOptions options;
    options.branches = branches;
    return detail::NearestSearch(arm, limits, pose, options, rounds).some();
}

/// Writes the nearest solution of each branch and arc to `out`: first that of nearest_posture(), then by
/// rising cost.
inline void nearest_postures(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
                             const NearestOptions& options, Nearests& out) noexcept {
    int rounds = NearestTuning::local_rounds;
    detail::NearestSearch(arm, limits, pose, options, rounds).all(out);
}

}  // namespace armangle

#include "../names/end.hpp"
