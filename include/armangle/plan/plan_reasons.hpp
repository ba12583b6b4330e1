// Writes into the report of a branch why it has no path: an end that it cannot have, sections without an arc,
// or the obstacle that ends the arc in which a path ends.
#pragma once

#include "diagnose.hpp"
#include "plan_ends.hpp"
#include "anchor.hpp"
#include "../scene/proximity.hpp"

#include "../names/begin.hpp"

namespace armangle::detail {

/// How densely a closed range is sampled for its worst place.
struct PlanReasonsTuning {
    static constexpr int samples = 5;  // of an empty range, to explain it
    static constexpr std::size_t sections_looked =
        33;                              // of a range closed by obstacles, to find its worst place
    static constexpr double look = 0.3;  // step of psi in that search (rad)
    static constexpr int thirds = 8;     // steps that narrow the neighbours of the worst place
    static constexpr double nearly_shut =
        1e-3;  // |sin| of theta_2 and theta_6 that together reject an end (rad), or soon after (s)
};

/// Explains failures of one task.
class PlanReasons {
public:
    /// Keeps a reference to the task that has no path.
    explicit PlanReasons(const Task& task) noexcept : task_(task) {}

    /// Index of the first section without an arc; the number of sections if there is none.
    static std::size_t first_empty(const Tube& t) noexcept {
        std::size_t k = 0;
        while (k < t.sections.size() && t.sections[k].status == Status::OK) ++k;
        return k;
    }

    /// Explains why the sections from `at` on have no arc.
    void explain_empty(const Tube& t, std::size_t at, BranchReport& out) const {
        std::size_t end = at;
        const auto out_of_reach = [](Status s) { return s == Status::UNREACHABLE || s == Status::FOLDED; };
        for (; end < t.sections.size() && t.sections[end].status != Status::OK; ++end) {
            if (out_of_reach(t.sections[end].status) && !out_of_reach(out.status)) {
                out.from = t.sections[end].s;
                out.status = t.sections[end].status;
            }
            out.excess = max(out.excess, t.sections[end].motion.circle.triangle.excess);
        }
        out.to = t.sections[end - 1].s;
        if (out_of_reach(out.status)) {
            out.verdict = Verdict::unreachable;
            return;
        }
        out.verdict = Verdict::impossible;
        out.from = t.sections[at].s;
        out.excess = 0;
        const Section& middle = t.sections[(at + end - 1) / 2];
        out.status = middle.status;
        out.touching = middle.blocking;
        out.shortfall = not_a_number;
        out.openings.clear();
        out.turns[0] = out.turns[1] = not_a_number;
        if (out.status == Status::CLEARANCE) explain_touching(t, at, end, out);
        if (out.status == Status::CLEARANCE || out.status == Status::POSE_BLOCKED ||
            out.status == Status::NOT_ALLOWED)
            return;
        explain_limits(task_, t, at, end, PlanReasonsTuning::samples, out);
    }

    /// The nearest pair at the arm angle, among samples within the limits, that keeps the largest distance;
    /// its tag is 0 if there is none.
    Proximity roomiest(const SelfMotion<double>& m, const Scene& scene, const ArcSet& own) const noexcept {
        Proximity best{-infinity, 0, {}, {}, not_a_number};
        const auto look = [&](double phi) {
            const Proximity here = proximity(task_.arm, scene, m, phi, true);
            if (here.distance > best.distance) best = here;
        };
        const int arcs = own.full ? 1 : own.count;
        for (int k = 0; k < arcs; ++k) {
            const double lower = own.full ? -pi : own.arc[k].lower, upper = own.full ? pi : own.arc[k].upper;
            const int steps = 2 + static_cast<int>((upper - lower) / PlanReasonsTuning::look);
            for (int i = 0; i <= steps; ++i) look(lower + (upper - lower) * i / steps);
        }
        return best;
    }

    /// Finds the pair that leaves no arm angle to sections `at` to `end` - 1, and by how much (m) it is too
    /// near at the worst place, which is searched among some sections and refined between its neighbours.
    void explain_touching(const Tube& t, std::size_t at, std::size_t end, BranchReport& out) const {
        double worst = t.sections[at].s, least = infinity;
        Proximity nearest{infinity, 0, {}, {}, not_a_number};
        const auto room = [&](double s) {
            const SelfMotion<double> m = self_motion(task_.arm, task_.circle_at(s), configuration(t.gc));
            ArcSet own;
            if (feasible(m, task_.functions(m), task_.table, own) != Status::OK) return infinity;
            const Proximity here = roomiest(m, task_.scenes.at(s), own);
            if (here.pair && here.distance < least) {
                worst = s;
                least = here.distance;
                nearest = here;
            }
            return here.distance;
        };
        const std::size_t count = end - at, looks = std::min(count, PlanReasonsTuning::sections_looked);
        std::vector<double> s;
        for (std::size_t i = 0; i < looks; ++i)
            s.push_back(t.sections[at + (looks > 1 ? i * (count - 1) / (looks - 1) : 0)].s);
        for (const double each : s) room(each);
        const auto where = static_cast<std::size_t>(std::find(s.begin(), s.end(), worst) - s.begin());
        double low = s[where ? where - 1 : 0], high = s[std::min(where + 1, looks - 1)];
        for (int i = 0; i < PlanReasonsTuning::thirds && low < high; ++i) {
            const double left = (2 * low + high) / 3, right = (low + 2 * high) / 3;
            if (room(left) < room(right))
                high = right;
            else
                low = left;
        }
        if (!nearest.pair) return;
        const SelfMotion<double> m = self_motion(task_.arm, task_.circle_at(worst), configuration(t.gc));
        const Scene& scene = task_.scenes.at(worst);
        ArcSet own;
        feasible(m, task_.functions(m), task_.table, own);
        const Proximity farthest = armangle::widest(task_.arm, scene, m, own).nearest;
        if (farthest.pair && farthest.distance > nearest.distance) nearest = farthest;
        out.touching = nearest.pair;
        out.shortfall = scene.clearance - nearest.distance;
    }

    /// If an obstacle, or the user, ends the arc of section l in which a path ends at phi, reports it.
    void explain_end(const Tube& t, const Section& l, double phi, BranchReport& out) const noexcept {
        if (!task_.encumbered() || l.full || l.count == 0) return;
        const Arc& a = t.arc(l)[nearest_arc(t, l, phi)];
        for (const Tag tag : {a.lower_tag, a.upper_tag}) {
            if (tag_obstacle(tag) >= 0) {
                out.status = Status::CLEARANCE;
                out.touching = tag;
            } else if (tag == make_tag(0, Side::user) && out.status == Status::LIMITS) {
                out.status = Status::NOT_ALLOWED;
            }
        }
    }

    /// The psi (rad) of the permitted arm angle of a section that is nearest to phi; NaN if there is none.
    double nearest_psi(const Tube& t, const Section& l, double phi) const noexcept {
        ArcSet arcs;
        make_empty(arcs);
        arcs.full = l.full;
        for (std::uint32_t k = 0; k < l.count; ++k) arcs.arc[arcs.count++] = t.arc(l)[k];
        if (arcs.empty()) return not_a_number;
        const SinCos<double> sc = sin_cos(nearest(arcs, phi));
        return arm_angle(triad(task_.arm, flange_pose(task_.arm, task_.pose(l.s))),
                         l.motion.circle.z * sc.cos + l.motion.circle.e * sc.sin);
    }

    /// If theta_2 and theta_6 are 0 at joints q, reports how far joint 1 or 5 must rotate first, the least
    /// that limits permit.
    void explain_turns(const double* q, double s, BranchReport& out) const noexcept {
        if (task_.arm.roll_free || singularity_sine(task_.arm, q) > PlanReasonsTuning::nearly_shut) return;
        const Segment& g = task_.segments[segment_index(task_.segments, task_.segment_count, s)];
        const Pose<Jet<double, 1>> moved = pose_at(g, Jet<double, 1>::variable(s));
        const auto part = [](const Vec3<Jet<double, 1>>& x, int k) {
            return Vec3<double>{x.x.coefficient[k], x.y.coefficient[k], x.z.coefficient[k]};
        };
        Pose<double> at[joints + 1];
        frames(task_.arm, q, at);
        const Chain now = chain(task_.arm, q);
        for (const int h : {0, 1}) {
            const int j = pivot_joint[2 * h], back = pivot_joint[2 * h + 1];
            const double turn = turn_before(at, part(moved.position, 0), part(moved.position, 1),
                                            angular_velocity(g, s), j + 1);
            const double shared = std::cos(now.theta[hinge_joint[h]]) > 0 ? -1.0 : 1.0;
            for (const double all : {turn, turn - std::copysign(pi, turn)}) {
                double there[joints];
                std::copy(q, q + joints, there);
                there[j] += task_.arm.sign[j] * all;
                there[back] += task_.arm.sign[back] * shared * all;
                if (!(abs(turn) > PlanEndsTuning::end_move) || !within_limits(task_.limits, there, 0.0))
                    continue;
                out.turns[h] = task_.arm.sign[j] * all;
                break;
            }
        }
    }

    /// Reports which of start and goal a branch cannot have, and why.
    void refuse_end(const AnchoredEnds& fixed, const double* start, const double* goal,
                    BranchReport& out) const {
        const Anchor& missing = fixed.starts ? fixed.goal : fixed.start;
        out.verdict = fixed.starts ? Verdict::goal : Verdict::start;
        out.from = out.to = fixed.starts ? 1.0 : 0.0;
        out.status = missing.why;
        out.elsewhere = missing.elsewhere;
        out.touching = missing.touching;
        out.shortfall = missing.shortfall;
        for (int j = 0; j < joints && missing.why == Status::LIMITS; ++j) {
            const double below = task_.limits.lower[j] - missing.q[j],
                         above = missing.q[j] - task_.limits.upper[j];
            if (max(below, above) > tolerance::angle)
                out.openings.push_back({j + 1, above > below, max(below, above)});
        }
        const bool reason = missing.why == Status::OUTSIDE && !missing.elsewhere;
        if (reason) explain_turns(fixed.starts ? goal : start, out.from, out);
    }

private:
    const Task& task_;
};

}  // namespace armangle::detail

#include "../names/end.hpp"
