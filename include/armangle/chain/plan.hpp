// A whole path of a nearly S-R-S arm: planned on the nominal arm, corrected and proven on the true chain.
//
//     plan(nominal) -> corrected curve -> certify -> plan
//         ^                                  | a true joint is beyond a limit
//         +----- limits drawn in by that ----+
//
// The objective is that of the nominal arm. As plan/ this allocates.
#pragma once

#include "../plan/planner.hpp"
#include "certify.hpp"
#include "plan_verdicts.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of plans of a chain.
struct ChainPlanTuning {
    static constexpr int plans = 4;               // of the nominal arm, with limits drawn in further
    static constexpr double narrow_factor = 1.5;  // of what a joint was beyond its limit ...
    static constexpr double narrow_least = 1e-3;  // ... and this much more (rad)
    static constexpr double wider_least = 1e-3;   // m: the same of the clearance
    static constexpr double same_pose = 1e-12;    // m and rad: two poses that rounding alone tells apart
    static constexpr double like =
        0.05;  // rad: how far the nominal posture of an end may be from the true one
};

/// A plan of the nominal arm, with what turns its curve into one of the true chain.
struct ChainPlan : Plan {
    LeadShifts shifts;
    std::optional<Pose<double>> base;  // where the nominal arm stands, if not on its own base
};

namespace detail {

/// Computes joint values of the nominal arm with the pose, psi and branch that the true arm has at q; q
/// itself if the nominal arm has that pose there too. False if there are none near q.
inline bool nominal_joints(const ChainArm& arm, const double* q, double (&out)[joint_slots]) noexcept {
    const Posture at = forward(arm, q);
    std::copy(q, q + joints, out);
    if (is_same(tool_pose(arm.nominal, q), at.pose, ChainPlanTuning::same_pose)) return true;
    if (is_nan(at.psi)) return false;
    const Inverse found = inverse(arm.nominal, at.pose, at.psi, at.gc, q);
    std::copy(found.q, found.q + joints, out);
    return found.status == Status::OK && largest_move(found.q, q) <= ChainPlanTuning::like;
}

/// The largest joint difference (rad) between q and the curve at s; infinite if the curve has no posture
/// there.
inline double gap_at(const CorrectedCurve& drawn, const double* q, double s) noexcept {
    const PlacedPosture at = drawn.at(s);
    return is_finite(at.q) ? largest_move(at.q, q) : infinity;
}

/// A failed plan for an end (s = 0 or 1) whose posture the nominal arm or the curve does not have.
inline ChainPlan refused_end(const ChainArm& arm, const double* q, double s, unsigned branches) {
    ChainPlan out;
    const int own = forward(arm, q).gc;
    for (int gc = 0; gc < configurations; ++gc) {
        if (!(branches >> gc & 1u)) continue;
        BranchReport& report = out.branches.emplace_back();
        report.gc = gc;
        report.verdict = s > 0 ? Verdict::goal : Verdict::start;
        report.status = Status::NO_CONVERGENCE;
        report.from = report.to = s;
        report.elsewhere = gc != own;
    }
    return out;
}

/// A failed plan if true link 0 touches an obstacle, whatever the joints.
inline ChainPlan refused_base(unsigned branches) {
    ChainPlan out;
    for (int gc = 0; gc < configurations; ++gc) {
        if (!(branches >> gc & 1u)) continue;
        BranchReport& report = out.branches.emplace_back();
        report.gc = gc;
        report.verdict = Verdict::impossible;
        report.to = 1;
    }
    return out;
}

/// Whether a plan fails at start or goal in at least one of the branches that its given ends are in.
inline bool refuses_end(const Plan& plan) noexcept {
    return std::any_of(plan.branches.begin(), plan.branches.end(), [](const BranchReport& x) {
        return !x.elsewhere && (x.verdict == Verdict::start || x.verdict == Verdict::goal);
    });
}

/// Whether obstacles keep a branch of a plan from a path.
inline bool is_blocked(const Plan& plan) noexcept {
    return std::any_of(plan.branches.begin(), plan.branches.end(), [](const BranchReport& x) {
        return x.touching != 0 || x.status == Status::CLEARANCE || x.status == Status::POSE_BLOCKED;
    });
}

/// Whether the search has found a path in a branch.
inline bool has_way(const Plan& plan) noexcept {
    return std::any_of(plan.branches.begin(), plan.branches.end(),
                       [](const BranchReport& x) { return x.verdict == Verdict::ok; });
}

/// Plans on the nominal arm with its present base, and corrects and proves the curve for the true chain.
/// `truth`: the true chain among its obstacles; null without any.
inline ChainPlan plan_about(Work& work, const ChainArm& arm, const Segment* segments, std::size_t n,
                            const double* rows, std::size_t row_count, PlanOptions options,
                            StraightMove<ChainArm>* truth, bool lacking) {
    // the nominal arm keeps more from obstacles by what its links are off, but no more than it has at a given
    // end that the true chain may have
    Scene wide{};
    const Scene* const wide_alone = &wide;
    double plain = 0, most_clearance = infinity;
    if (truth) {
        wide = options.scenes[0];
        wide.base_tag = 0;  // that of true link 0 counts
        plain = lacking ? infinity : wide.clearance;
        wide.clearance += ChainPlanTuning::wider_least;
        for (const LinkDeviation& off : arm.deviation) wide.clearance += off.position;
        options.scenes = {&wide_alone, 1};
    }
    struct End {
        const double*& nominal;
        const double* q;  // of the true arm
        double s;
        Pose<double> pose;
        double room[joint_slots];
    };
    End ends[] = {{options.start, options.start, 0, pose_at(segments[0], 0.0), {}},
                  {options.goal, options.goal, 1, pose_at(segments[n - 1], 1.0), {}}};
    for (End& end : ends) {
        if (!end.q) continue;
        if (nominal_joints(arm, end.q, end.room))
            end.nominal = end.room;
        else if (belongs(arm, end.q, end.pose))
            return refused_end(arm, end.q, end.s, options.branches);
        if (!truth || lacking) continue;
        const double room = StraightMove(arm.nominal, wide).nearest_pair(end.nominal, infinity).room;
        most_clearance = min(most_clearance, wide.clearance + room - StraightMoveTuning::rounded);
    }
    wide.clearance = min(wide.clearance, most_clearance);
    const auto planned = [&]() {
        return ChainPlan{plan_within(work, arm.nominal, segments, n, rows, row_count, options), {}, {}};
    };
    const Limits limits = drawn_in(arm.nominal.limits, options.limit_margin);
    const double asked = options.singularity_margin;
    // where branches meet the true arm may have no posture: first without these places
    options.singularity_margin = max(asked, min(arm.wrist_shift / arm.nominal.reach + arm.turn, most_margin));
    double excess = 0, short_of = 0, too_singular = 0;
    // corrects and proves a curve for the true chain, and ends it at the first violation
    const auto correct = [&](ChainPlan& now, const double* goal) {
        const Curve drawn{arm.nominal, now.plane, now.gc, {segments, n}, now.stretches};
        if (now.stretches.empty()) return;
        now.shifts = lead_shifts(arm, drawn, ends[0].q, goal);
        const CorrectedCurve curve{arm, drawn, now.shifts};
        now.proof = certify(curve, {ends[0].q, goal}, limits, asked, now.proof, truth, excess, short_of,
                            too_singular, &work);
        auto& violated = now.proof.violated;
        for (std::size_t i = 0; i < row_count && rows[i] <= now.stretches.back().end; ++i) {
            if (is_finite(curve.at(rows[i]).q)) continue;
            violated.push_back(rows[i]);
            excess = infinity;
        }
        std::sort(violated.begin(), violated.end());
        while (!violated.empty() && !now.stretches.empty() && now.stretches.back().end >= violated.front())
            now.stretches.pop_back();
    };
    ChainPlan best;
    bool found = false;
    for (int round = 0; round < ChainPlanTuning::plans; ++round) {
        ChainPlan now = planned();
        if (options.rate_only && has_way(now)) return now;
        if (!now.ok && options.singularity_margin > asked) {
            options.singularity_margin = asked;
            now = planned();
        }
        if (!now.ok && !found && wide.clearance > plain && is_blocked(now)) {
            wide.clearance = plain;
            now = planned();
        }
        if (!now.ok && found) break;
        if (!now.ok) {
            now.proof.open = {0.0, 1.0};
            correct(now, nullptr);
            for (BranchReport& x : now.branches)
                if (x.gc == now.gc && !now.proof.violated.empty())
                    x.reached = min(x.reached, now.proof.violated.front());
            best = std::move(now);
            break;
        }
        correct(now, ends[1].q);
        const bool kept = now.proof.violated.empty();
        now.ok = kept;
        if (!kept) {
            for (BranchReport& other : now.branches) {  // of the nominal arm alone
                if (other.verdict != Verdict::ok) continue;
                other.verdict = Verdict::unresolved;
                other.given_up = true;
            }
            BranchReport& report = now.branches.front();
            report.given_up = report.elsewhere = false;
            report.status = excess < infinity ? Status::LIMITS : Status::NEAR_SINGULAR;
            if (short_of > 0) report.status = Status::CLEARANCE;
            report.from = report.reached = now.proof.violated.front();
            report.to = now.proof.violated.back();
        }
        for (const End& end : ends) {
            if (!now.ok || !end.q) continue;
            const Curve drawn{arm.nominal, now.plane, now.gc, {segments, n}, now.stretches};
            const double gap = gap_at(CorrectedCurve{arm, drawn, now.shifts}, end.q, end.s);
            (end.s > 0 ? now.goal_gap : now.start_gap) = gap;
            const double most =
                belongs(arm, end.q, end.pose) ? PlanEndsTuning::end_move : tolerance::largest_angle;
            if (!(gap <= most)) now = refused_end(arm, end.q, end.s, options.branches);
        }
        const bool grows = excess > 0 || too_singular > 0 || wide.clearance < most_clearance;
        const bool done = kept || !grows || !(excess < infinity) || work.spent();
        if (!found || kept) best = std::move(now);
        found = true;
        if (done) break;
        if (excess > 0)
            options.limit_margin += ChainPlanTuning::narrow_factor * excess + ChainPlanTuning::narrow_least;
        if (too_singular > 0) {
            const double more = ChainPlanTuning::narrow_factor * too_singular + ChainPlanTuning::narrow_least;
            options.singularity_margin = min(options.singularity_margin + more, most_margin);
        }
        if (short_of > 0)
            wide.clearance =
                min(wide.clearance + ChainPlanTuning::narrow_factor * short_of + ChainPlanTuning::wider_least,
                    most_clearance);
    }
    return best;
}

/// The base for which the nominal arm has the true arm's pose at joints q.
inline Pose<double> base_at(const ChainArm& arm, const double* q) noexcept {
    Pose<double> out = tool_pose(arm, q) * inverted(tool_pose(arm.nominal, q)) * arm.nominal.base;
    out.rotation = orthonormal(out.rotation);
    return out;
}

}  // namespace detail

/// Plans as plan() of the exact arm. The stretches belong to the nominal arm's curve; the proof is for the
/// true joints along it. The options' obstacles are prepared for the nominal arm, `scene` is the same scene
/// prepared for the true arm. If this fails without prescribed arcs, and a given start or goal has its pose
/// on the path, it tries again with the nominal arm on a base at which it has that posture: the `base` of the
/// plan.
inline ChainPlan plan(const ChainArm& arm, const Segment* segments, std::size_t n, const double* rows,
                      std::size_t row_count, const PlanOptions& options, const Scene* scene = nullptr) {
    Work work(options.checkpoint, options.work);
    std::optional<StraightMove<ChainArm>> truth;
    if (scene) truth.emplace(arm, *scene);
    const detail::PlanVerdicts verdicts(arm, segments, n, options, scene);
    const auto about = [&](const ChainArm& with) {
        return detail::plan_about(work, with, segments, n, rows, row_count, options,
                                  truth ? &*truth : nullptr, verdicts.refuses_end());
    };
    const bool touches = scene && scene->base_tag;
    ChainPlan found = touches ? detail::refused_base(options.branches) : about(arm);
    for (const double* q : {options.start, options.goal}) {
        const bool rated = options.rate_only && detail::has_way(found);
        if (found.ok || rated || touches || !q || options.allowed || work.spent()) continue;
        if (!detail::belongs(arm, q,
                             q == options.start ? pose_at(segments[0], 0.0) : pose_at(segments[n - 1], 1.0)))
            continue;
        const ChainArm moved = with_base(arm, detail::base_at(arm, q));
        ChainPlan again = about(moved);
        if (!again.ok && !detail::refuses_end(found)) continue;
        found = std::move(again);
        found.base = moved.nominal.base;
    }
    if (!options.rate_only) verdicts.judge(work, found);
    found.work_left = work.left();
    return found;
}

}  // namespace armangle

#include "../names/end.hpp"
