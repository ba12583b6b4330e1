// Why a branch has no way: which joints leave no arm angle, and which limit, farther out by how much, would
// leave one.
#pragma once

#include <cstdint>
#include <vector>

#include "tube.hpp"

namespace armangle {

/// What became of one branch.
enum class Verdict : std::uint8_t {
    ok,
    unreachable,  // the wrist is out of reach, whatever the branch
    impossible,   // at some s no arm angle keeps all limits
    dead_end,     // every s has arm angles, but they do not join up from the start to the end
    start,        // the start lies outside the limits, or in another branch
    goal,         // the same of the goal
    unresolved,  // a way through the sections, of which no smooth curve was proven free of violations; or the
                 // search was given up
};

/// A limit that, alone moved out by `extra` rad, leaves an arm angle.
struct Opening {
    int joint;  // 1..7
    bool upper;
    double extra;
};

struct BranchReport {
    int gc = 0;
    Verdict verdict = Verdict::ok;
    Status status = Status::OK;
    double from = 0, to = 0;       // s of the trouble
    double excess = 0;             // m beyond the reach, the most of the range
    double reached = 0;            // s up to which the start leads
    double margin = not_a_number;  // rad, least along the way (asked margins deducted); joint 4 apart:
    double elbow_margin = not_a_number;
    double travel = not_a_number;  // cost of the way
    double nearest_psi = not_a_number;
    unsigned through = 0;   // bit k: the way passes through branch k too, where the two meet
    unsigned sections = 0;  // that were looked at
    bool given_up = false;  // the sections or links that a plan may try were spent before it was known
    unsigned blocking = 0;  // bit j: joint j + 1 is one of those that leave no arm angle
    std::vector<Opening> openings;
};

namespace detail {

/// Whether a self-motion has an arm angle once a limit is moved out.
inline bool opens(const Task& task, const SelfMotion<double>& m, int joint, bool upper,
                  double extra) noexcept {
    Limits wide = task.limits;
    (upper ? wide.upper : wide.lower)[joint] += upper ? extra : -extra;
    ArcSet arcs;
    return feasible(m, limit_table(task.arm, wide, task.table.margin), arcs) == Status::OK;
}

/// How far one limit must move out to leave an arm angle; infinity where that alone does not help.
inline double opening(const Task& task, const SelfMotion<double>& m, int joint, bool upper) noexcept {
    const double limit = upper ? task.limits.upper[joint] : task.limits.lower[joint];
    if (!(abs(limit) < infinity) || !opens(task, m, joint, upper, two_pi)) return infinity;
    double low = 0, high = two_pi;
    for (int i = 0; i < 36; ++i) {
        const double middle = 0.5 * (low + high);
        (opens(task, m, joint, upper, middle) ? high : low) = middle;
    }
    return high;
}

/// Joints of which none can be left out: their sets of arm angles have nothing in common, those of any fewer
/// have.
inline unsigned blocking_joints(const LimitTable& limits, const SelfMotion<double>& m) noexcept {
    const JointFunctions<double> f = joint_functions(m);
    ArcSet each[joints];
    for (int j = 0; j < joints; ++j) joint_arcs(m, f, limits, j, each[j]);
    const auto empty = [&](unsigned mask) {
        ArcSet common, before;
        make_full(common);
        for (int j = 0; j < joints; ++j)
            if (mask >> j & 1u) {
                before = common;
                intersect(before, each[j], common);
            }
        return common.empty();
    };
    unsigned kept = (1u << joints) - 1;
    if (!empty(kept)) return 0;
    for (int j = 0; j < joints; ++j)
        if (empty(kept & ~(1u << j))) kept &= ~(1u << j);
    return kept;
}

}  // namespace detail

/// Fills in who leaves no arm angle on these self-motions (each of them empty), and what would.
inline void explain_limits(const Task& task, const std::vector<SelfMotion<double>>& motions,
                           BranchReport& out) {
    for (const SelfMotion<double>& m : motions) out.blocking |= detail::blocking_joints(task.table, m);
    for (int j = 0; j < joints; ++j) {
        for (const bool upper : {false, true}) {
            double extra = 0;
            for (const SelfMotion<double>& m : motions)
                extra = max(extra, detail::opening(task, m, j, upper));
            if (extra < infinity) out.openings.push_back({j + 1, upper, extra});
        }
    }
}

/// One pose and branch: ok, unreachable or impossible, with what explains it.
inline BranchReport diagnose(const Task& task, double s, int gc) {
    const Section here = detail::solve_section(task, gc, s).section;
    BranchReport out;
    out.gc = gc;
    out.from = out.to = s;
    out.status = here.status;
    out.excess = max(here.motion.circle.triangle.excess, 0.0);
    switch (out.status) {
        case Status::OK: return out;
        case Status::UNREACHABLE:
        case Status::FOLDED: out.verdict = Verdict::unreachable; return out;
        default: out.verdict = Verdict::impossible;
    }
    explain_limits(task, {here.motion}, out);
    return out;
}

}  // namespace armangle
