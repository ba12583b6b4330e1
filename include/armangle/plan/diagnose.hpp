// Why a branch has no path: the joints that leave no arm angle, and the limit that would leave one if it were
// wider, and by how much.
#pragma once

#include <cstdint>
#include <vector>

#include "../limits/feasible_all.hpp"
#include "tube.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Outcome of one branch.
enum class Verdict : std::uint8_t {
    ok,
    unreachable,  // the wrist is out of reach, in every branch
    impossible,   // at some s no arm angle respects all limits
    dead_end,     // every s has arm angles, but they do not connect the start with the end
    start,        // the start violates limits, or is in another branch
    goal,         // the same for the goal
    unresolved,   // the sections are connected, but no smooth curve was proven free of violations, or the
                  // search was given up
};

/// A limit that, widened alone by `extra` rad, leaves an arm angle; or one that a start violates by that
/// amount.
struct Opening {
    int joint;  // 1..7
    bool upper;
    double extra;
};

/// The result of a plan in one branch: its path, or where and why there is none.
struct BranchReport {
    int gc = 0;
    Verdict verdict = Verdict::ok;
    Status status = Status::OK;
    double from = 0, to = 0;       // range of s of the obstruction
    double excess = 0;             // m beyond the reach, the largest in the range
    double reached = 0;            // s up to which a path leads from the start
    double margin = not_a_number;  // rad, least along the path (minus requested margins), without joint 4:
    double elbow_margin = not_a_number;
    double cost = not_a_number;          // the objective of the curve
    double stationarity = not_a_number;  // the share of it that another step of the descent would save
    double nearest_psi = not_a_number;
    unsigned through = 0;    // bit k: the path also uses branch k, where the two meet
    unsigned sections = 0;   // sections computed
    bool given_up = false;   // the permitted sections or links were used up before the outcome was known
    bool elsewhere = false;  // the start, or the goal, is in another branch
    unsigned blocking = 0;   // bit j: joint j + 1 is among those that leave no arm angle
    Tag touching = 0;        // the pair that leaves none, or fails by least; 0: obstacles are not the reason
    double shortfall = not_a_number;  // m by which that pair is too near
    std::vector<Opening> openings;
    /// For a start (goal) with both hinges at 0: how far joint 1, or else joint 5, must turn before the end
    /// effector moves (rad). NaN if that is not the reason, or beyond the limits.
    double turns[2] = {not_a_number, not_a_number};
};

namespace detail {

/// How far (rad, from -90 to 90 degrees) joint `far` (5 or 1) must rotate before the end effector can move
/// with a twist, if theta_2 and theta_6 are 0. at: the DH frames; speed: velocity of the tool's origin, which
/// is at tip; turning: angular velocity. Joints 1 to 4 alone move the wrist (5 to 7 and 4 the shoulder,
/// relative to the tool): three equations for the near pivot, its neighbour and the elbow. The remaining
/// rotation is around the axes of joint `far` and its neighbour.
inline double turn_before(const Pose<double> (&at)[joints + 1], const Vec3<double>& tip,
                          const Vec3<double>& speed, const Vec3<double>& turning, int far) noexcept {
    const int pivot = far == 5 ? 0 : 4, hinge = far == 5 ? 1 : 5;  // near pivot and hinge: axes i of frame i
    const Vec3<double> from = at[far == 5 ? 1 : 5].position, to = at[far == 5 ? 5 : 1].position;
    const Vec3<double> moved = speed + cross(turning, to - tip);
    const auto axis = [&](int i) { return at[i].rotation.z; };
    const Vec3<double> a = cross(axis(pivot), to - from), b = cross(axis(hinge), to - from),
                       c = cross(axis(3), to - at[3].position);
    const double volume = dot(a, cross(b, c));
    const Vec3<double> rest =
        turning - (axis(pivot) * dot(moved, cross(b, c)) + axis(hinge) * dot(a, cross(moved, c)) +
                   axis(3) * dot(a, cross(b, moved))) *
                      (1.0 / volume);
    const Vec3<double> turned = axis(far - 1), across = axis(far);
    const double angle = atan2(dot(cross(turned, across), rest), dot(across, rest));
    return angle - pi * round(angle / pi);
}

/// Whether a self-motion has an arm angle within the limits after one limit of a joint (0 to 6) is widened by
/// `extra` (rad).
inline bool opens(const Task& task, const SelfMotion<double>& m, int joint, bool upper,
                  double extra) noexcept {
    Limits wide = task.limits;
    (upper ? wide.upper : wide.lower)[joint] += upper ? extra : -extra;
    ArcSet arcs;
    return feasible(m, limit_table(task.arm, wide, task.table.margin), arcs) == Status::OK;
}

/// How far (rad, at most 2 pi) one limit of a joint (0 to 6) must be widened so that an arm angle exists;
/// infinite if that alone does not help.
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

/// A minimal set of joints (bit j: joint j + 1) whose limits together leave no arm angle; 0 if one is left.
inline unsigned blocking_joints(const LimitTable& limits, const SelfMotion<double>& m) noexcept {
    const JointFunctions<double> f = joint_functions(m);
    ArcSet each[joints];
    for (int j = 0; j < joints; ++j) joint_arcs(m, f, limits, j, each[j]);
    if (each[3].empty()) return 1u << 3;  // for every psi: the other joints are irrelevant
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

/// Parameters of the reason why a branch has no path.
struct DiagnoseTuning {
    static constexpr int between = 4;      // self-motions sampled between two sections
    static constexpr int golden = 30;      // golden-section steps about the worst of them
    static constexpr double spare = 0.01;  // share of an opening that is added to it ...
    static constexpr double least = 1e-6;  // ... and the least amount added (rad)
};

namespace detail {

/// How far one limit must be widened so that arm angles exist at all s of a path; infinite if that alone does
/// not help.
class PathOpening {
public:
    /// Keeps references to its arguments. motions: those of `s`, rising; `empty` is the first without an arm
    /// angle within the limits.
    PathOpening(const Task& task, int gc, const std::vector<double>& s,
                const std::vector<SelfMotion<double>>& motions, std::size_t empty)
        : task_(task), gc_(gc), s_(s), motions_(motions), empty_(empty) {}

    /// How far (rad) one limit of a joint (0 to 6) must be widened so that every motion has an arm angle,
    /// with a little to spare; infinite if no widening of this limit suffices.
    double of(int joint, bool upper) const {
        double most = opening(task_, motions_[empty_], joint, upper);
        std::size_t worst = empty_;
        const auto spared = [&] { return most * (1 + DiagnoseTuning::spare) + DiagnoseTuning::least; };
        for (bool all = false; !all && most < infinity;) {
            all = true;
            LimitTable table = moved_out(joint, upper, spared());
            for (std::size_t i = 0; i < motions_.size() && most < infinity; ++i) {
                ArcSet arcs;
                if (feasible(motions_[i], table, arcs) == Status::OK) continue;
                // At a singularity some openings may leave an arm angle while larger ones do not: then no
                // opening is reported.
                const double wanted = opening(task_, motions_[i], joint, upper);
                most = wanted > spared() ? wanted : infinity;
                worst = i;
                all = false;
                if (most < infinity) table = moved_out(joint, upper, spared());
            }
            if (all) most = max(most, largest_widening(worst, joint, upper));
        }
        return most < infinity ? spared() : infinity;
    }

private:
    /// The limits with one limit of a joint (0 to 6) widened by `extra` (rad).
    LimitTable moved_out(int joint, bool upper, double extra) const noexcept {
        Limits wide = task_.limits;
        (upper ? wide.upper : wide.lower)[joint] += upper ? extra : -extra;
        return limit_table(task_.arm, wide, task_.table.margin);
    }

    /// The largest required widening (rad) between the neighbours of motion `at`, by golden-section search.
    double largest_widening(std::size_t at, int joint, bool upper) const noexcept {
        const double share = 0.5 * (std::sqrt(5.0) - 1.0);
        double low = s_[at ? at - 1 : 0], high = s_[std::min(at + 1, s_.size() - 1)], most = 0;
        const auto here = [&](double s) {
            const SelfMotion<double> m = self_motion(task_.arm, task_.circle_at(s), configuration(gc_));
            const double extra = opens(task_, m, joint, upper, 0.0) ? 0.0 : opening(task_, m, joint, upper);
            most = max(most, extra);
            return extra;
        };
        double left = high - share * (high - low), right = low + share * (high - low);
        double at_left = here(left), at_right = here(right);
        for (int i = 0; i < DiagnoseTuning::golden; ++i) {
            if (at_left > at_right) {
                high = right;
                right = left;
                at_right = at_left;
                left = high - share * (high - low);
                at_left = here(left);
            } else {
                low = left;
                left = right;
                at_left = at_right;
                right = low + share * (high - low);
                at_right = here(right);
            }
        }
        return most;
    }

    const Task& task_;
    int gc_;
    const std::vector<double>& s_;
    const std::vector<SelfMotion<double>>& motions_;
    std::size_t empty_;
};

}  // namespace detail

/// Adds to `out` the joints that leave no arm angle on sections `from` to `to` - 1 of a tube (each of them
/// has none), from `shown` of these. Also adds the limits that, widened alone, would leave one at every s, by
/// slightly more than the least amount.
inline void explain_limits(const Task& task, const Tube& tube, std::size_t from, std::size_t to, int shown,
                           BranchReport& out) {
    const std::size_t count = to - from;
    const std::size_t looks = std::min(count, static_cast<std::size_t>(shown));
    for (std::size_t i = 0; i < looks; ++i) {
        const Section& x = tube.sections[from + (2 * i + 1) * count / (2 * looks)];
        out.blocking |= detail::blocking_joints(task.table, x.motion);
    }
    std::vector<double> s;
    std::vector<SelfMotion<double>> motions;
    std::size_t empty = 0;
    for (std::size_t k = 0; k < tube.sections.size(); ++k) {
        const Section& x = tube.sections[k];
        if (k == from + count / 2) empty = s.size();
        s.push_back(x.s);
        motions.push_back(x.motion);
        if (k + 1 == tube.sections.size()) break;
        const Section& next = tube.sections[k + 1];
        if (x.status == Status::OK && next.status == Status::OK) continue;
        for (int i = 1; i < DiagnoseTuning::between; ++i) {
            s.push_back(x.s + (next.s - x.s) * i / DiagnoseTuning::between);
            motions.push_back(self_motion(task.arm, task.circle_at(s.back()), configuration(tube.gc)));
        }
    }
    const detail::PathOpening path(task, tube.gc, s, motions, empty);
    for (int j = 0; j < joints; ++j)
        for (const bool upper : {false, true}) {
            const double extra = path.of(j, upper);
            if (extra < infinity) out.openings.push_back({j + 1, upper, extra});
        }
}

/// Diagnosis of the limits at one pose and branch, without obstacles: ok, unreachable or impossible, with the
/// explanation.
inline BranchReport diagnose(const Task& task, double s, int gc) {
    ArcSet arcs;
    BranchReport out;
    out.gc = gc;
    out.from = out.to = s;
    out.status = feasible(task.arm, task.pose(s), gc, task.table, arcs);
    const SelfMotion<double> motion = self_motion(task.arm, task.circle_at(s), configuration(gc));
    out.excess = max(motion.circle.triangle.excess, 0.0);
    switch (out.status) {
        case Status::OK: return out;
        case Status::UNREACHABLE:
        case Status::FOLDED: out.verdict = Verdict::unreachable; return out;
        default: out.verdict = Verdict::impossible;
    }
    out.blocking = detail::blocking_joints(task.table, motion);
    for (int j = 0; j < joints; ++j)
        for (const bool upper : {false, true}) {
            const double extra = detail::opening(task, motion, j, upper);
            if (extra < infinity) out.openings.push_back({j + 1, upper, extra});
        }
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
