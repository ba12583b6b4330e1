// What a plan of a nearly S-R-S arm says where it has no path. The search refuses on the nominal arm, and a
// refusal holds only if the true chain confirms it:
//
//     START, GOAL               the given joints lack limits, margin or clearance on the true chain
//     IMPOSSIBLE, UNREACHABLE   the proven arcs of the true chain exclude every psi at some s
//
// Otherwise the verdict is UNRESOLVED. Range, joints, limits and pair that a report names are the true ones.
#pragma once

#include <algorithm>
#include <span>

#include "../plan/plan_options.hpp"
#include "../plan/plan_reasons.hpp"
#include "hull_cells.hpp"

#include "../names/begin.hpp"

namespace armangle::detail {

/// Whether two poses differ by at most `off` in position (m) and in rotation (rad).
inline bool is_same(const Pose<double>& a, const Pose<double>& b, double off) noexcept {
    const Twist apart = difference(a, b);
    return max(norm(apart.linear), norm(apart.angular)) <= off;
}

/// Whether the true arm has the pose at joints q (within rounding of the caller).
inline bool belongs(const ChainArm& arm, const double* q, const Pose<double>& pose) noexcept {
    return is_same(tool_pose(arm, q), pose, PlanEndsTuning::on_pose);
}

/// Parameters of the verdicts of a chain.
struct ChainVerdictTuning {
    static constexpr double least_more =
        1e-3;  // rad, doubled: added to what opens a limit of the nominal arm
};

/// Judges the reports of a search on the nominal arm by the true chain.
class PlanVerdicts {
public:
    /// Keeps references to the chain, the path of n segments, the options of the plan and the obstacles,
    /// prepared for the true chain; null without any.
    PlanVerdicts(const ChainArm& arm, const Segment* segments, std::size_t n, const PlanOptions& options,
                 const Scene* scene)
        : arm_(arm),
          segments_(segments),
          segment_count_(n),
          options_(options),
          scene_(scene),
          limits_(drawn_in(arm.nominal.limits, options.limit_margin)),
          start_(judged_end(options.start, 0.0)),
          goal_(judged_end(options.goal, 1.0)) {}

    /// Whether a given start or goal lacks something on the true chain.
    bool refuses_end() const noexcept { return start_.status != Status::OK || goal_.status != Status::OK; }

    /// Replaces the verdicts of a plan's branches by those of the true chain. A plan without a path whose
    /// given start lacks something there has no curve either.
    void judge(Work& work, Plan& plan) const {
        for (BranchReport& x : plan.branches) {
            work.take(0);
            const bool own = !x.elsewhere && !plan.ok;
            if (own && start_.status != Status::OK) {
                refuse(start_, x);
                x.reached = 0;
                plan.stretches.clear();
            } else if (own && goal_.status != Status::OK) {
                refuse(goal_, x);
            } else if (x.verdict == Verdict::unreachable || x.verdict == Verdict::impossible) {
                judge_range(work, x);
            } else if (own && (x.verdict == Verdict::start || x.verdict == Verdict::goal) &&
                       x.status != Status::OUTSIDE && x.status != Status::NO_CONVERGENCE &&
                       x.status != Status::JOINT_JUMP) {
                leave_open(x);
            }
        }
    }

private:
    /// Why a branch has no posture at one s. OK: that is not proven.
    struct Exclusion {
        Status status = Status::OK;
        Tag touching = 0;  // a pair that collides; 0: none is known

        bool out_of_reach() const noexcept {
            return status == Status::UNREACHABLE || status == Status::FOLDED;
        }
    };

    /// An s, and why a branch has no posture there.
    struct Place {
        double s;
        Exclusion why;
    };

    /// The pose at s.
    Pose<double> pose(double s) const noexcept {
        return pose_at(segments_[segment_index(segments_, segment_count_, s)], s);
    }

    /// The arcs of branch gc at s that are proven within limits and singularity margin.
    ProvenArcs arcs(int gc, double s, const Limits& limits) const noexcept {
        ProvenArcs out;
        feasible(arm_, pose(s), gc, limits, options_.singularity_margin, out);
        return out;
    }

    /// Why branch gc has no posture at s within the limits and the user's arcs and clear of obstacles.
    Exclusion exclusion(int gc, double s) const {
        ProvenArcs found = arcs(gc, s, limits_);
        const Exclusion by_limits{found.status, 0};
        if (by_limits.out_of_reach() || (found.arcs.empty() && found.unproven == 0)) return by_limits;
        if (const Tag at_rest = scene_ ? rest_contact(arm_, *scene_, pose(s)) : 0)
            return {Status::POSE_BLOCKED, at_rest};
        if (options_.allowed) {
            ArcSet asked, some;
            options_.allowed(s, asked);
            intersect(found.arcs, asked, some);
            found.arcs = some;
            intersect(found.open, asked, some);
            if (found.arcs.empty() && some.empty()) return {Status::NOT_ALLOWED, 0};
        }
        if (found.unproven > 0 || !scene_) return {};
        Exclusion out;
        keep_clear(arm_, *scene_, pose(s), gc, found, out.touching);
        if (found.arcs.empty() && found.unproven == 0) out.status = found.status;
        return out;
    }

    /// Gives a report what the true chain says of a given end.
    static void refuse(const BranchReport& end, BranchReport& out) {
        leave_open(out);
        out.verdict = end.verdict;
        out.status = end.status;
        out.from = out.to = end.from;
        out.touching = end.touching;
        out.shortfall = end.shortfall;
        out.openings = end.openings;
    }

    /// Turns a report into one that nothing is proven.
    static void leave_open(BranchReport& out) {
        out.verdict = Verdict::unresolved;
        out.status = Status::NO_CONVERGENCE;
        out.excess = 0;
        out.nearest_psi = out.shortfall = out.turns[0] = out.turns[1] = not_a_number;
        out.blocking = 0;
        out.touching = 0;
        out.openings.clear();
    }

    /// What a given end q (null: none) lacks on the true chain at s, as the report of a branch; its status is
    /// OK if it lacks nothing. Joints of another pose are judged by those of the path with the same psi.
    BranchReport judged_end(const double* q, double s) const {
        BranchReport out;
        out.verdict = s > 0 ? Verdict::goal : Verdict::start;
        out.from = out.to = s;
        if (!q) return out;
        const Posture own = forward(arm_, q);
        Inverse row{};
        std::copy(q, q + joints, row.q);
        if (!belongs(arm_, q, pose(s))) {
            row = is_nan(own.psi) ? Inverse{} : inverse(arm_, pose(s), own.psi, own.gc, q);
            if (row.status != Status::OK || largest_move(row.q, q) > PlanEndsTuning::widest_gap) return out;
        }
        if (scene_) {
            const double none[joints] = {};
            const Proximity near = proximity(arm_, *scene_, row.q, none);
            if (near.distance < scene_->clearance - StraightMoveTuning::rounded) {
                out.status = rest_contact(arm_, *scene_, pose(s)) ? Status::POSE_BLOCKED : Status::CLEARANCE;
                out.touching = near.pair;
                out.shortfall = scene_->clearance - near.distance;
                return out;
            }
        }
        for (int j = 0; j < joints; ++j) {
            const double below = limits_.lower[j] - row.q[j], above = row.q[j] - limits_.upper[j];
            if (max(below, above) > tolerance::angle)
                out.openings.push_back({j + 1, above > below, max(below, above)});
        }
        if (!out.openings.empty())
            out.status = Status::LIMITS;
        else if (options_.singularity_margin - singular_distance(arm_.nominal, row.q) > tolerance::angle)
            out.status = Status::NEAR_SINGULAR;
        else if (options_.allowed && !is_nan(own.psi)) {
            ArcSet asked;
            options_.allowed(s, asked);
            if (!contains(asked, own.psi)) out.status = Status::NOT_ALLOWED;
        }
        return out;
    }

    /// Keeps a report that every psi is excluded over a range of s as far as the true chain excludes it.
    void judge_range(Work& work, BranchReport& x) const {
        const auto ask = [&](double s) {
            work.take(WorkTuning::chain * (WorkTuning::section + work_of_pairs(options_.scenes, s)));
            return Place{s, exclusion(x.gc, s)};
        };
        Place place[PlanReasonsTuning::samples + 2];
        const int count = x.from < x.to ? static_cast<int>(std::size(place)) : 1;
        const double from = x.from, to = x.to;
        for (int i = 0; i < count; ++i) {
            const double share = (2 * i - 1) / (2.0 * PlanReasonsTuning::samples);
            place[i] = ask(count > 1 ? from + (to - from) * min(max(share, 0.0), 1.0) : from);
        }
        const auto openings = x.openings;
        leave_open(x);
        Place* const end = place + count;
        Place* first = std::find_if(place, end, [](const Place& at) { return at.why.out_of_reach(); });
        const bool far = first < end;
        const auto alike = [far](const Place& at) {
            return at.why.status != Status::OK && at.why.out_of_reach() == far;
        };
        first = std::find_if(place, end, alike);
        if (first == end) return;
        const Place* const last = std::find_if_not(first, end, alike) - 1;
        const auto edge = [&](const Place& in, const Place& out) {
            double inside = in.s, outside = out.s;
            for (int i = 0; i < TubeTuning::event_depth; ++i) {
                const double middle = 0.5 * (inside + outside);
                (alike(ask(middle)) ? inside : outside) = middle;
            }
            return inside;
        };
        x.from = first == place ? from : edge(*first, *(first - 1));
        x.to = last + 1 == end ? to : edge(*last, *(last + 1));
        const std::span<const Place> run(first, last + 1);
        const Place& middle = run[run.size() / 2];
        x.verdict = far ? Verdict::unreachable : Verdict::impossible;
        x.status = middle.why.status;
        if (far) {
            for (const Place& at : run) x.excess = max(x.excess, reach_excess(arm_, pose(at.s)));
        } else if (x.status == Status::CLEARANCE || x.status == Status::POSE_BLOCKED) {
            x.touching = middle.why.touching;
            if (x.status == Status::CLEARANCE) explain_touching(middle.s, x);
        } else if (x.status != Status::NOT_ALLOWED) {
            x.blocking = blocking_joints(x.gc, middle.s);
            for (const Opening& each : openings) add_opening(each, run, x);
        }
    }

    /// Reports the pair that is nearest where branch x.gc keeps farthest from obstacles at s.
    void explain_touching(double s, BranchReport& x) const {
        const ProvenArcs own = arcs(x.gc, s, limits_);
        const Proximity near =
            widest(arm_, *scene_, {orthonormal(pose(s).rotation), pose(s).position}, x.gc, own.arcs).nearest;
        if (!near.pair) return;
        x.touching = near.pair;
        x.shortfall = scene_->clearance - near.distance;
    }

    /// A minimal set of joints (bit j: joint j + 1) whose limits together exclude every psi at s.
    unsigned blocking_joints(int gc, double s) const {
        Limits left = limits_;
        unsigned out = 0;
        for (int j = 0; j < joints; ++j) {
            Limits fewer = left;
            fewer.lower[j] = -infinity;
            fewer.upper[j] = infinity;
            const ProvenArcs found = arcs(gc, s, fewer);
            if (found.arcs.empty() && found.unproven == 0)
                left = fewer;
            else
                out |= 1u << j;
        }
        return out;
    }

    /// Reports a limit that leaves a psi at all of `places` if it is wider by as much as on the nominal arm,
    /// or by a little more.
    void add_opening(Opening wider, std::span<const Place> places, BranchReport& x) const {
        const int j = wider.joint - 1;
        for (double more = ChainVerdictTuning::least_more; wider.extra < two_pi; more *= 2) {
            Limits wide = limits_;
            (wider.upper ? wide.upper : wide.lower)[j] += wider.upper ? wider.extra : -wider.extra;
            if (std::none_of(places.begin(), places.end(),
                             [&](const Place& at) { return arcs(x.gc, at.s, wide).arcs.empty(); })) {
                x.openings.push_back(wider);
                return;
            }
            wider.extra += more;
        }
    }

    const ChainArm& arm_;
    const Segment* segments_;
    std::size_t segment_count_;
    const PlanOptions& options_;
    const Scene* scene_;
    const Limits limits_;
    const BranchReport start_, goal_;
};

}  // namespace armangle::detail

#include "../names/end.hpp"
