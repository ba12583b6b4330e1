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

namespace armangle {

namespace near_rule {
inline constexpr int plans = 4;              // of the nominal arm, with limits drawn in further
inline constexpr double drawn_more = 1.5;    // of what a joint was beyond its limit ...
inline constexpr double drawn_least = 1e-3;  // ... and this much more (rad)
inline constexpr double wider_least = 1e-3;  // m: the same of the clearance
}  // namespace near_rule

namespace detail {

/// The joints of the nominal arm at the pose, psi and GC that the true arm has at q; false where it has none.
inline bool nominal_joints(const NearArm& arm, const double* q, double (&out)[joint_slots]) noexcept {
    const Posture at = forward(arm, q);
    if (is_nan(at.psi)) return false;
    const Inverse found = inverse(arm.nominal, at.pose, at.psi, at.gc, q);
    for (int j = 0; j < joints; ++j) out[j] = found.q[j];
    return found.status == Status::OK;
}

}  // namespace detail

/// Plans as plan() of the exact arm; the stretches are of the nominal arm's curve, the proof is of the true
/// joints along it. Of obstacles the options hold those of the nominal arm, and `scene` is the same one of
/// the true arm, which keeps the clearance that it asks.
inline Plan plan(const NearArm& arm, const Segment* segments, std::size_t n, const double* rows,
                 std::size_t row_count, PlanOptions options, const Scene* scene = nullptr) {
    Scene wide{};
    const Scene* const wide_alone = &wide;
    if (options.scenes && scene) {
        wide = options.scenes[0];
        wide.clearance += near_rule::wider_least;
        for (const LinkDeviation& off : arm.deviation) wide.clearance += off.position;
        options.scenes = {&wide_alone, 1};
    }
    double start[joint_slots], goal[joint_slots];
    if (options.start && detail::nominal_joints(arm, options.start, start)) options.start = start;
    if (options.goal && detail::nominal_joints(arm, options.goal, goal)) options.goal = goal;
    const Limits limits = drawn_in(arm.nominal.limits, options.limit_margin);
    const double asked = options.singularity_margin;
    // where branches meet the true arm may have no posture: first without these places
    options.singularity_margin = max(asked, min(arm.wrist_shift / arm.nominal.reach + arm.turn, most_margin));
    Plan best;
    bool found = false;
    for (int round = 0; round < near_rule::plans; ++round) {
        Plan now = plan(arm.nominal, segments, n, rows, row_count, options);
        if (!now.ok && options.singularity_margin > asked) {
            options.singularity_margin = asked;
            now = plan(arm.nominal, segments, n, rows, row_count, options);
        }
        if (!now.ok) {
            if (!found) best = std::move(now);
            break;
        }
        const Curve drawn{arm.nominal, now.plane, now.gc, {segments, n}, now.stretches};
        double excess = 0, short_of = 0;
        now.proof = certify(CorrectedCurve{arm, drawn}, limits, asked, now.proof, scene, excess, short_of);
        const bool kept = now.proof.violated.empty();
        now.ok = kept;
        if (!kept) {
            BranchReport& report = now.branches.front();
            report.verdict = Verdict::unresolved;
            report.status = excess < infinity ? Status::LIMITS : Status::NEAR_SINGULAR;
            if (short_of > 0) report.status = Status::CLEARANCE;
            report.from = report.reached = now.proof.violated.front();
            report.to = now.proof.violated.back();
            while (!now.stretches.empty() && now.stretches.back().end > report.from) now.stretches.pop_back();
        }
        const bool done = kept || !(excess < infinity);
        if (!found || kept) best = std::move(now);
        found = true;
        if (done) break;
        if (excess > 0) options.limit_margin += near_rule::drawn_more * excess + near_rule::drawn_least;
        if (short_of > 0) wide.clearance += near_rule::drawn_more * short_of + near_rule::wider_least;
    }
    return best;
}

}  // namespace armangle
