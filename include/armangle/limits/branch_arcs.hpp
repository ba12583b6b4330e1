// The arcs of each branch at one pose, with the solutions that rounding hides from them, and the joints of a
// solution. Where psi has too few digits, joints are moved onto the pose numerically (solve_locally.hpp).
#pragma once

#include <iterator>

#include "../circle/forward.hpp"
#include "elbow_costs.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Solutions as joints: of a branch at psi, and near joints, where psi has too few digits.
class JointSearch : protected ElbowCosts {
public:
    /// `rounds` are those of solve_locally() that are left for the pose; they are counted down.
    JointSearch(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
                const NearestOptions& options, int& rounds) noexcept
        : ElbowCosts(arm, limits, pose, options), rounds_(rounds) {}

protected:
    /// The joints of a branch at psi, each in the revolution nearest to the seed (else the middle of its
    /// range). If theta_2 or theta_6 is at most `straight` (rad) from 0 or pi, its neighbours share their
    /// rotation in the cheapest way.
    Joints posture(int gc, double psi, double straight = tolerance::singular) const noexcept {
        const ElbowBranches& e = elbow_[gc >> 1 & 1];
        SelfMotion<double> m = e.motion;
        m.gc = configuration(gc);
        const Directions<double> d = directions(m, sin_cos(psi));
        double near[joints];
        for (int j = 0; j < joints; ++j) near[j] = joint_[j].near;
        Joints out = joints_within_limits(arm_, d, near);
        if (e.elbow_to_limit) out.q[3] = min(max(out.q[3], joint_[3].lower), joint_[3].upper);
        for (int side = 0; side < 2; ++side) {
            const int h = 4 * side + 1;
            if (!e.lost[side] && !(hypot(d.y[h - 1], d.x[h - 1]) <= tolerance::singular)) {
                if (!(abs(d.y[h]) <= straight)) continue;
            }
            share(e, side, d.x[h] < 0, out);
        }
        return out;
    }

    /// Splits in q the rotation that two joints on one axis have together in q, so that it costs least
    /// (distance from `near` in the metric, whole turns included) within their limits; leaves q unchanged if
    /// there is no such split. side 0: joints 1 and 3, side 1: joints 5 and 7. `flipped`: the joint between
    /// them is at theta = pi. The branches are not used.
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

    /// Checks a solution that rounding, a limit or two joints on one axis may have moved off its pose.
    /// Returns it unchanged or moved back onto the pose; empty if no solution within the limits is there.
    [[gnu::noinline, gnu::cold]] Nearest checked(const Nearest& out) const noexcept {
        Joints q{};
        for (int j = 0; j < joints; ++j) q.q[j] = out.q[j];
        Twist rest;
        const Pose<double> pose{orthonormal(pose_.rotation), pose_.position};
        const double off = distance(arm_, q.q, pose, arm_.size, rest);
        if (out.margin >= 0 && off <= 0.1 * LocalSolveTuning::meets * arm_.size) return out;
        int rounds = LocalSolveTuning::rounds;
        const Relaxed on = solve_locally(arm_, sides_of(out.gc, q), q, pose, {}, 0.0, rounds);
        const Nearest moved_on = meets(arm_, on) ? make_result(on.at) : refused(Status::LIMITS);
        // in its self-motion a solution at a limit may settle outside the permitted arcs
        const bool meets_it = out.margin >= 0 && off <= LocalSolveTuning::meets * arm_.size;
        return moved_on.status != Status::OK && meets_it ? out : moved_on;
    }

    /// The limits of a search from q: those of the arm, with joints 2, 4 and 6 on the sides of q and off
    /// their singularities by the margin, if there is one; if branches are restricted, on the sides of gc.
    Limits sides_of(int gc, const Joints& q) const noexcept {
        Limits out = arm_.limits;
        if (limits_.margin > 0) keep_off_singular(arm_, branch_meetings(arm_), q.q, limits_.margin, out);
        if (options_.branches == (1u << configurations) - 1) return out;
        const Configuration<double> c = configuration(gc);
        const double side[3] = {c.shoulder, c.elbow, c.wrist};
        for (int h = 0; h < 3; ++h) keep_on_side(arm_, 2 * h + 1, q.q[2 * h + 1], side[h], 0.0, out);
        return out;
    }

    /// The complete result for given joints; empty, with the reason, if their psi does not exist or the
    /// caller did not permit them.
    Nearest make_result(const Joints& q) const noexcept {
        const Posture here = forward(arm_, q.q);
        if (is_nan(here.psi)) return refused(Status::FOLDED);
        if (!is_off_singular(q)) return refused(Status::NEAR_SINGULAR);
        const int gc = permitted_branch(here.gc, q);
        if (!(options_.branches >> gc & 1) || !may_be(gc, here.psi)) return refused(Status::NOT_ALLOWED);
        return finished(q.q, here.psi, gc);
    }

    /// Whether joints 2, 4 and 6 keep the singularity margin.
    bool is_off_singular(const Joints& q) const noexcept {
        double least = infinity;
        for (const int h : {1, 3, 5}) least = min(least, abs(sin_cos(detail::bend(arm_, h, q.q[h])).sin));
        return least >= limits_.sin_margin - tolerance::isolated;
    }

    /// The branch of a configuration q, whose signs give gc. At a singularity it belongs to several branches;
    /// then a permitted one of them.
    int permitted_branch(int gc, const Joints& q) const noexcept {
        // a stretched elbow's bend is the root of the rounding of the wrist's distance
        const double uncertainty = sqrt(2.0 * tolerance::stretched);
        unsigned straight = abs(circle_.triangle.eta.sin) <= uncertainty ? 2u : 0u;
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

    /// The cost of a solution as an angle (rad); infinite if there is none.
    double rank(const Nearest& x) const noexcept {
        if (x.status != Status::OK) return infinity;
        return options_.metric == Metric::margin ? -x.margin : x.distance;
    }

    /// The same joints, each in the revolution nearest to the seed (else the middle of its range) among those
    /// that its limits permit, or miss by at most the joint's uncertainty.
    Joints turned(Joints q) const noexcept {
        for (int j = 0; j < joints; ++j) {
            const JointCost& c = joint_[j];
            const double beside = NearestTuning::near_straight;
            const double theta = to_theta(q.q[j], c.sign, c.offset);
            q.q[j] = to_q(theta, c.sign, c.offset, c.lower - beside, c.upper + beside, c.near);
        }
        return q;
    }

    /// The cost of joints, including joint 4.
    double whole_cost(const Joints& q) const noexcept {
        return squares() ? cost_of(q.q) : max(cost_of(q.q), cost_of(joint_[3], q.q[3] - joint_[3].near));
    }

    /// The solution near a start, moved to the least attraction; empty if there is none.
    Nearest moved_onto_pose(const Joints& start, int gc, const Attraction& pull) noexcept {
        const Pose<double> pose{orthonormal(pose_.rotation), pose_.position};
        const Limits limits = sides_of(gc, start);
        bool is_attracted = false;
        for (const double weight : pull.weight) is_attracted |= weight > 0;
        const Relaxed at = is_attracted ? solve_locally_attracted(arm_, limits, start, pose, pull, rounds_)
                                        : solve_locally(arm_, limits, start, pose, pull, 0.0, rounds_);
        return meets(arm_, at) ? make_result(at.at) : refused(Status::LIMITS);
    }

    int& rounds_;  // of solve_locally(), left for the pose
};

/// The arcs of each branch, computed on first use, and the best solution found on them.
class BranchArcs : protected JointSearch {
public:
    /// Computes the circle of a pose and the bend of both elbow signs with their limits; arcs follow on first
    /// use.
    BranchArcs(const Arm& arm, const LimitTable& limits, const Pose<double>& pose,
               const NearestOptions& options, int& rounds) noexcept
        : JointSearch(arm, limits, pose, options, rounds) {
        for (int elbow = 0; elbow < 2; ++elbow) bend(elbow);
    }

protected:
    /// Inserts the psi of a solution into the arcs of a branch as an arc of width 0, tagged with the nearest
    /// limit; does nothing if its status is not OK.
    void put_in(int gc, const Nearest& found, ArcSet& arcs) const noexcept {
        if (found.status != Status::OK) return;
        SelfMotion<double> m = elbow_[gc >> 1 & 1].motion;
        m.gc = configuration(gc);
        const Tag tag = nearest_limit(limits_, m.gc, directions(m, sin_cos(found.psi)), all_joints);
        put(arcs, {found.psi, found.psi, tag, tag});
    }

    struct Best {
        double cost = infinity, psi = 0;
        int gc = -1;
        bool stationary = false;
    };

    /// Sets up one elbow sign (0: positive, 1: negative): joint 4, which all its branches share, or the
    /// reason why none of them has an arc.
    void bend(int elbow) noexcept {
        ElbowBranches& e = elbow_[elbow];
        e.motion = self_motion(arm_, circle_, Configuration<double>{1.0, elbow ? -1.0 : 1.0, 1.0});
        Status status = elbow_status(e.motion, limits_);
        e.elbow_to_limit = status == Status::ELBOW_LIMIT && straight_within_limits(e);
        if (e.elbow_to_limit) status = Status::OK;
        for (int branch = 0; branch < 4; ++branch) {
            const int gc = gc_of(elbow, branch);
            arcs_.status[gc] = status;
        }
        e.open = status == Status::OK;
        const JointCost& c = joint_[3];
        const double theta_4 = atan2(e.motion.elbow.theta_4.sin, e.motion.elbow.theta_4.cos);
        e.cost_4 = cost_of(c, to_q(theta_4, c.sign, c.offset, c.lower, c.upper, c.near) - c.near);
    }

    /// The arcs of psi of a branch within the limits, empty if there are none; computed on first use, since
    /// most branches are too expensive to need them.
    const ArcSet& arcs(int gc) noexcept {
        if (!is_in(gc, filled_)) fill_arcs(gc);
        return arcs_.arcs[gc];
    }

    /// The arcs blocked by the limits for one elbow sign and one sign of theta_2 and theta_6 (0: positive, 1:
    /// negative), computed on first use.
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

    /// Adds to `arcs` the psi at which several joints reach their limits at once, if a solution on the joints
    /// exists there; rounding may leave no arc.
    [[gnu::noinline, gnu::cold]] void add_meeting(int gc, const JointFunctions<double>& shoulder,
                                                  const JointFunctions<double>& wrist, const Blocked& blocked,
                                                  ArcSet& arcs) noexcept {
        ElbowBranches& e = elbow_[gc >> 1 & 1];
        SelfMotion<double> m = e.motion;
        m.gc = configuration(gc);
        const double slack = uncertainty(least_bend(circle_, shoulder)),
                     gap = max(sqrt(slack), tolerance::locked);
        const auto look = [&](double psi) {
            const Directions<double> d = directions(m, sin_cos(psi));
            if (contains(arcs, psi) || !allows(limits_, m.gc, d, all_joints, slack)) return;
            const Nearest found = moved_onto_pose(turned(posture(gc, psi)), gc, {});
            if (found.status != Status::OK || found.gc != gc) return;
            put_in(gc, found, arcs);
            e.ill_conditioned = true;
        };
        each_meeting(shoulder, wrist, blocked, true, gap, look);
    }

    /// The psi at which a branch may have solutions, computed on first use; empty if it certainly has none.
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

    /// If the psi `cut` where a revolution ends coincides with an end of one of the arcs, records it in e as
    /// a corner.
    void find_corner(ElbowBranches& e, int gc, double cut, const ArcSet& arcs) const noexcept {
        if (arcs.full) return;
        const double near = max(unclear_gap(least_bend(circle_, e.functions)), tolerance::locked);
        for (int i = 0; i < arcs.count; ++i) {
            const double off = min(abs(wrap(cut - arcs.arc[i].lower)), abs(wrap(cut - arcs.arc[i].upper)));
            if (off > near || e.corners == static_cast<int>(std::size(e.corner))) continue;
            e.corner[e.corners++] = {gc, cut};
            e.ill_conditioned = true;
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

    /// Computes the blocked arcs of a side (0: shoulder, 1: wrist) whose first and last joint rotate around
    /// one axis at every psi. The first joint, 0 by convention, blocks nothing; only the middle joint does.
    void block_lost(Sides& sides, int side) const noexcept {
        Boundaries b;
        boundaries(limits_, sides.f, b);
        Blocked& blocked = side == 0 ? sides.shoulder : sides.wrist;
        blocked = Blocked{};
        block_hinge(limits_, sides.f, b, side, blocked);
    }

    /// The psi at which the first and last joint of a side, rotating around one axis at every psi, can share
    /// their rotation within their limits; empty if they never can.
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

    /// Keeps the solution of a branch at psi if it is within the limits and better than the best;
    /// `stationary` says whether the cost has slope 0 there. Its cost is computed from the joints, since near
    /// a singular psi the value in the middle of a box is mere rounding.
    void try_point(int gc, double psi, bool stationary) noexcept {
        const Joints q = posture(gc, psi);
        if (!within_limits(arm_.limits, q.q, tolerance::angle)) return;
        offer(gc, psi, cost_of(q.q), stationary);
    }

    /// Keeps a solution if it is better than the best. Among equal costs a stationary point is kept, since it
    /// is more accurate, then the lowest gc, then the lowest psi.
    void offer(int gc, double psi, double cost, bool stationary) noexcept {
        const bool equal = best_.gc >= 0 && abs(cost - best_.cost) <= tie(cost);
        const bool beside = gc == best_.gc && abs(wrap(psi - best_.psi)) <= NearestTuning::apart;
        const bool lower = gc < best_.gc || (gc == best_.gc && wrap(psi) < wrap(best_.psi));
        bool better = cost < best_.cost;
        if (equal && stationary != best_.stationary)
            better = stationary;
        else if (equal && !beside)
            better = lower;
        if (better) best_ = {cost, psi, gc, stationary};
    }

    /// Whether psi lies in an arc of a branch, or in arc only_arc if that is not -1.
    bool holds(int gc, int only_arc, double psi) noexcept {
        const Place place = find(arcs(gc), psi, 0.0);
        return place.index >= 0 && (only_arc < 0 || place.index == only_arc);
    }

    /// The largest cost that still counts as better than the best one; infinite if there is no solution yet.
    double worth() const noexcept { return best_.cost < infinity ? best_.cost - tie(best_.cost) : infinity; }

    /// A solution at the middle or an end of an arc; a result with another status than OK if there is none.
    /// Overwrites the best solution.
    Nearest somewhere(int gc, const Arc& arc) noexcept {
        Nearest out;
        for (const double psi : {0.5 * (arc.lower + arc.upper), arc.lower, arc.upper}) {
            best_ = {0.0, psi, gc, false};
            out = result();
            if (out.status == Status::OK || arc.upper - arc.lower <= tolerance::same_psi) break;
        }
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
        return out.margin > 0 && !elbow_[gc >> 1 & 1].ill_conditioned ? out : checked(out);
    }

    AllArcs arcs_;
    Sides sides_[2][2];
    unsigned filled_ = 0, sided_ = 0, judged_ = 0;  // one bit for each of these that is computed
    ArcSet possible_[configurations];
    Best best_;
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
