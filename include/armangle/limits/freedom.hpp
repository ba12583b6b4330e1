// The redundancy left to a pose: which of the eight branches solve it, and over how much of their circles.
// The numbers of feasible_all() without its sets.
#pragma once

#include "feasible_all.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Length of the feasible arcs of one pose over all branches.
struct Freedom {
    double total;         // rad: total length of all feasible arcs
    double widest;        // rad: length of the longest arc
    std::uint8_t gc;      // bit k: branch k solves the pose, possibly only at an isolated psi
    std::uint8_t arcs;    // number of arcs
    Status status;        // OK, or the obstruction in the branch that is nearest to a solution
    double unproven = 0;  // rad: total length of what is proven neither way and not counted
};

namespace detail {

/// The limits of a side (0: shoulder, 1: wrist) whose middle joint is at 0 or pi, so that its two neighbours
/// rotate around one axis and only their total rotation matters. With along = cos(theta_2), the second
/// becomes theta_3 + along theta_1 with the range that both permit; the first becomes unlimited.
inline Limits shared_limits(const Arm& arm, Limits limits, int side, double along) noexcept {
    const int first = 4 * side, second = first + 2;
    const ThetaRange a = theta_range(arm, limits, first), b = theta_range(arm, limits, second);
    const double lower = b.lower + min(along * a.lower, along * a.upper),
                 upper = b.upper + max(along * a.lower, along * a.upper);
    const double p = to_q(arm, second, lower), q = to_q(arm, second, upper);
    limits.lower[first] = -infinity;
    limits.upper[first] = infinity;
    limits.lower[second] = min(p, q);
    limits.upper[second] = max(p, q);
    return limits;
}

/// The value cos(theta_2) (side 0; theta_6: side 1) on a circle on which this joint stays at 0 or pi: +1 or
/// -1.
inline double lost_side(const JointFunctions<double>& f, int side) noexcept {
    return f.hinge[side].H.at({0.0, 1.0}) < 0 ? -1.0 : 1.0;
}

/// One psi of a branch at which joint 2 or 6 is at 0 or pi. Only the total rotation of its two neighbours is
/// determined there, so a solution may exist although no arc contains it.
struct Needle {
    double along[hinges];       // cos(theta) of each hinge at 0 or pi, 0 for others
    Limits limits;              // the two ranges on such a side are combined
    double theta[joint_slots];  // on such a side the first joint is 0 and the second has the common turn
};

/// Computes the needle at psi: on sides whose middle joint is at 0 or pi, both neighbours are combined.
inline Needle needle(const Arm& arm, const SelfMotion<double>& m, double psi) noexcept {
    const Directions<double> d = directions(m, sin_cos(psi));
    Needle n{{0, 0}, arm.limits, {}};
    angles(d).store(n.theta);
    for (int side = 0; side < hinges; ++side) {
        const int first = 4 * side, hinge = first + 1, second = first + 2;
        if (abs(d.y[hinge]) > tolerance::one_axis) continue;
        n.along[side] = d.x[hinge] < 0 ? -1.0 : 1.0;
        n.limits = shared_limits(arm, n.limits, side, n.along[side]);
        n.theta[second] += n.along[side] * n.theta[first];
        n.theta[first] = 0;
    }
    return n;
}

/// Whether all joints of a needle, except joint `except` (0..6, or -1), are within their limits.
inline bool holds(const Arm& arm, const Needle& n, int except) noexcept {
    bool inside = true;
    for (int j = 0; j < joints; ++j)
        inside &= j == except ||
                  cone(theta_range(arm, n.limits, j)).contains(sin_cos(n.theta[j]), tolerance::isolated);
    return inside;
}

/// Calls each(needle) for the isolated singular psi of a branch. The two joint functions are those of its
/// signs of theta_2 and theta_6.
template <class Each>
[[gnu::cold]] void each_needle(const Arm& arm, const SelfMotion<double>& m,
                               const JointFunctions<double>& shoulder, const JointFunctions<double>& wrist,
                               const Each& each) noexcept {
    for (const Hinge<double>& h : {shoulder.hinge[0], wrist.hinge[1]}) {
        if (is_constant(h)) continue;
        const double top = atan2(h.H.s, h.H.c);
        if (h.high.below_one <= tolerance::touching) each(needle(arm, m, top));
        if (h.low.above_minus_one <= tolerance::touching) each(needle(arm, m, top + pi));
    }
}

/// How to treat two joints that rotate around one axis at every psi. apart: each keeps its own limits, as in
/// feasible(). shared: they are one joint with the range of both.
enum class OneAxis : std::uint8_t { apart, shared };

/// Computes the arcs of the eight branches of a circle in order and calls each(gc, result of the sweep, arcs,
/// shoulder and wrist joint functions). Stops if `each` returns true. Of joints 1, 3, 5 and 7 only those in
/// `which` (their pivot_bits()) count.
template <class Each>
void each_branch(const Arm& arm, const Circle<double>& circle, const LimitTable& own, unsigned which,
                 OneAxis one_axis, const Each& each) noexcept {
    unsigned counted = all_joints;
    for (int p = 0; p < pivots; ++p)
        if (!(which & pivot_bits(p))) counted &= ~(1u << pivot_joint[p]);
    for (int side = 0; side < 2; ++side) {
        SelfMotion<double> m = self_motion(arm, circle, {1.0, side ? -1.0 : 1.0, 1.0});
        const Status status = elbow_status(m, own);
        const bool may_share = status == Status::OK && one_axis == OneAxis::shared;
        const bool lost[hinges] = {may_share && shoulder_singular(m), may_share && wrist_singular(m)};
        Sides sides[2];
        LimitTable shared;
        const LimitTable* table = &own;
        if (lost[0] || lost[1]) {
            const JointFunctions<double> f = joint_functions(m);
            Limits limits = arm.limits;
            for (int k = 0; k < hinges; ++k)
                if (lost[k]) limits = shared_limits(arm, limits, k, lost_side(f, k));
            shared = limit_table(arm, limits, own.margin);
            table = &shared;
        }
        bool made[2] = {false, false};
        for (int branch = 0; branch < 4; ++branch) {
            const int shoulder = branch & 1, wrist = branch >> 1, gc = shoulder + 2 * side + 4 * wrist;
            ArcSet arcs;
            Left left{status, false, infinity};
            if (status == Status::OK) {
                for (const int negative : {shoulder, wrist}) {
                    if (made[negative]) continue;
                    m.gc.shoulder = m.gc.wrist = negative ? -1.0 : 1.0;
                    block_sides(*table, m, which, sides[negative]);
                    made[negative] = true;
                }
                Blocked both = sides[shoulder].shoulder;
                append(sides[wrist].wrist, both);
                const JointFunctions<double>&of_shoulder = sides[shoulder].f, &of_wrist = sides[wrist].f;
                left = finish(*table, of_shoulder, of_wrist, both, arcs);
                if (left.may_isolate)
                    left.status = add_isolated(*table, m, of_shoulder, of_wrist, both, arcs, counted);
            }
            if (each(gc, left, arcs, sides[shoulder].f, sides[wrist].f)) return;
        }
    }
}

/// Returns that of two reasons which is nearer to a solution.
inline Status nearer_reason(Status a, Status b) noexcept {
    const auto rank = [](Status s) {
        switch (s) {
            case Status::OK: return 0;
            case Status::NEAR_SINGULAR: return 1;
            case Status::LIMITS: return 2;
            case Status::ELBOW_MARGIN: return 3;
            case Status::ELBOW_LIMIT: return 4;
            case Status::NO_POSTURE: return 5;
            default: return 6;
        }
    };
    return rank(b) < rank(a) ? b : a;
}

/// Computes the freedom from the arcs of each branch; used if two joints may rotate around one axis or an
/// isolated psi may be feasible.
[[gnu::noinline, gnu::cold]] inline Freedom freedom_by_branches(const Arm& arm, const Pose<double>& pose,
                                                                const Circle<double>& c,
                                                                const LimitTable& t) noexcept {
    Freedom out{0, 0, 0, 0, is_folded(c) ? Status::FOLDED : Status::UNREACHABLE};
    Hidden any;
    const auto mark = [&](int gc, Left left, ArcSet& arcs, const auto& f, const auto&) {
        tell_branch(arm, pose, c, t, gc, f, any, left, arcs);
        out.status = nearer_reason(out.status, left.status);
        out.gc = static_cast<std::uint8_t>(out.gc | (left.status == Status::OK) << gc);
        return false;
    };
    bool lost = false;
    for (const double side : {1.0, -1.0}) {
        const SelfMotion<double> m = self_motion(arm, c, {1.0, side, 1.0});
        lost |= shoulder_singular(m) || wrist_singular(m);
    }
    const auto add = [&](int gc, Left left, ArcSet& arcs, const auto& f, const auto& g) {
        if (lost)
            tell_branch(arm, pose, c, t, gc, f, any, left, arcs);
        else
            mark(gc, left, arcs, f, g);
        out.arcs = static_cast<std::uint8_t>(out.arcs + arcs.count);
        out.total += measure(arcs);
        for (int i = 0; i < arcs.count; ++i)
            out.widest = max(out.widest, arcs.arc[i].upper - arcs.arc[i].lower);
        return false;
    };
    each_branch(arm, c, t, all_pivots, OneAxis::apart, add);
    if (lost) each_branch(arm, c, t, all_pivots, OneAxis::shared, mark);
    return out;
}

/// Whether any branch solves the pose within the limits, from the arcs of each branch; used if two joints may
/// rotate around one axis or an isolated psi may be feasible.
[[gnu::noinline, gnu::cold]] inline bool is_held_by_a_branch(const Arm& arm, const Pose<double>& pose,
                                                             const Circle<double>& c,
                                                             const LimitTable& t) noexcept {
    bool held = false;
    Hidden any;
    const auto look = [&](int gc, Left left, ArcSet& arcs, const auto& f, const auto&) {
        tell_branch(arm, pose, c, t, gc, f, any, left, arcs);
        return held = left.status == Status::OK;
    };
    each_branch(arm, c, t, all_pivots, OneAxis::shared, look);
    return held;
}

/// Arcs blocked and left free by the limits of one half of the arm (its joints on one side of the elbow).
struct Half {
    Blocked blocked;
    ArcSet free;
    double gap;  // smallest gap or overlap between blocked arcs (rad)
};

/// The intersection of the two halves of a branch.
struct Common {
    bool held = false;      // some arc exists
    double gap = infinity;  // smallest gap or overlap between two arcs (rad)
};

/// Whether joint 2 or 6 violates its limits at every psi and with either sign, by more than rounding.
ARMANGLE_INLINE bool is_shut(const LimitTable& t, const JointFunctions<double>& f) noexcept {
    bool shut = false;
    for (int h = 0; h < hinges; ++h)
        shut |= 1.0 - f.hinge[h].high.below_one < t.least_cosine[h] - tolerance::angle ||
                f.hinge[h].low.above_minus_one - 1.0 > t.most_cosine[h] + tolerance::angle;
    return shut;
}

/// Tests eight psi at once: are the joints of a half (0: 1 to 3, 1: 5 to 7) inside their limits by more than
/// rounding? Writes one bit each, for a positive and for a negative middle joint.
ARMANGLE_INLINE void inside_at_eight(const LimitTable& t, const JointFunctions<double>& f, int half,
                                     const SinCos<Slots>& psi, unsigned (&out)[2]) noexcept {
    const auto at = [&psi](const Harmonic<double>& h) {
        return mul_add(Slots(h.s), psi.sin, mul_add(Slots(h.c), psi.cos, Slots(h.k)));
    };
    const Slots over(tolerance::angle), under(-tolerance::angle), H = at(f.hinge[half].H);
    for (int negative = 0; negative < 2; ++negative) {
        out[negative] = 0;
        for (int k = 0; k < t.piece_count[half][negative]; ++k) {
            const HingePiece& p = t.piece[half][negative][k];
            const Slots near(p.near.tag ? 1.0 - p.near.below_one : infinity),
                far(p.far.tag ? p.far.above_minus_one - 1.0 : -infinity);
            out[negative] |= bits((near - H > over) & (H - far > over));
        }
    }
    for (const int p : {2 * half, 2 * half + 1}) {
        if (t.cone[p].free) continue;
        const Slots U = at(f.pivot[p].U), V = at(f.pivot[p].V);
        const Slots lower = mul_add(Slots(t.u[p]), U, Slots(t.v[p]) * V),
                    upper = mul_add(Slots(t.u[pivots + p]), U, Slots(t.v[pivots + p]) * V);
        const bool wide = t.cone[p].wide;
        out[0] &= wide ? bits((lower > over) | (upper > over)) : bits((lower > over) & (upper > over));
        out[1] &= wide ? bits((lower < under) | (upper < under)) : bits((lower < under) & (upper < under));
    }
}

/// Whether one of eight fixed psi, in any branch of an elbow, is inside all limits by more than rounding. The
/// joint functions are those of positive theta_2 and theta_6.
ARMANGLE_INLINE bool holds_at_fixed_psi(const LimitTable& t, const JointFunctions<double>& f) noexcept {
    constexpr double c = 0.92387953251128674, s = 0.38268343236508977;  // of pi / 8; others in steps of pi /
                                                                        // 4
    constexpr double sines[8] = {s, c, c, s, -s, -c, -c, -s}, cosines[8] = {c, s, -s, -c, -c, -s, s, c};
    const SinCos<Slots> psi{Slots::load(sines), Slots::load(cosines)};
    unsigned shoulder[2], wrist[2];
    inside_at_eight(t, f, 0, psi, shoulder);
    inside_at_eight(t, f, 1, psi, wrist);
    return ((shoulder[0] | shoulder[1]) & (wrist[0] | wrist[1])) != 0;
}

/// Calls each(gc, shoulder's arcs, wrist's arcs, common), which fills `common`, for the branches whose elbow
/// is within its limits. Each half is solved once for a sign and serves two branches. Sets `status` to OK or
/// the reason nearest to it. Stops and returns true if `each` or is_enough(joint functions) returns true.
/// Returns true if the intersections of the halves are all psi; false if isolated psi may exist.
template <class Enough, class Each>
ARMANGLE_INLINE bool each_pair(const Arm& arm, const Circle<double>& c, const LimitTable& t, Status& status,
                               const Enough& is_enough, const Each& each) noexcept {
    if (t.locked) return false;
    bool hides = false;
    for (int side = 0; side < 2; ++side) {
        SelfMotion<double> m = self_motion(arm, c, {1.0, side ? -1.0 : 1.0, 1.0});
        const Status elbow = elbow_status(m, t);
        status = nearer_reason(status, elbow == Status::OK ? Status::LIMITS : elbow);
        if (elbow != Status::OK) {
            hides |= elbow == Status::ELBOW_LIMIT && is_about_straight(t, c);
            continue;
        }
        if (shoulder_singular(m) || wrist_singular(m)) return false;
        JointFunctions<double> f = joint_functions(m);
        hides |= !is_bent(t, c, f);
        if (is_shut(t, f)) continue;
        if (may_jump(f.hinge[0]) || may_jump(f.hinge[1])) return false;
        if (is_enough(f)) return true;
        Half half[2][hinges];  // [shoulder or wrist][positive or negative hinge]
        PivotAngles angles;
        Boundaries b;
        for (int branch = 0; branch < 4; ++branch) {
            const int shoulder = branch & 1, wrist = branch >> 1;
            if (branch < 2) {
                if (branch == 0) {
                    angles = pivot_angles(t, f);
                } else {
                    for (Pivot<double>& p : f.pivot) p.g = -1.0;
                    for (Hinge<double>& h : f.hinge) h.g = -1.0;
                    angles = opposite(angles);
                }
                pivot_arcs(t, angles, b.pivot);
                if (branch == 0 || !t.hinges_alike) solve_hinges(t, f, b.hinge);
                for (int h = 0; h < hinges; ++h) {
                    Half& now = half[branch][h];
                    block_hinge(t, f, b, h, now.blocked);
                    block_pivots(t, f, b, h == 0 ? shoulder_pivots : wrist_pivots, now.blocked);
                    now.gap = free_arcs(now.blocked, now.free);
                }
            }
            const Half &one = half[shoulder][0], &other = half[wrist][1];
            if (one.blocked.touching || other.blocked.touching) return false;
            if (one.blocked.all || other.blocked.all) continue;
            Common common;
            if (each(shoulder + 2 * side + 4 * wrist, one.free, other.free, common)) return true;
            const double gap = min(min(one.gap, other.gap), common.gap);
            if (gap <= NearestTuning::poor && gap <= unclear_gap(least_bend(c, f))) return false;
            if (common.held) status = Status::OK;
        }
    }
    return !hides;
}

}  // namespace detail

/// Computes the freedom of a user's pose within the limits of the table, which must be made from arm.limits.
inline Freedom freedom(const Arm& arm, const Pose<double>& pose, const LimitTable& t) noexcept {
    const Circle<double> c = circle(arm, flange_pose(arm, pose));
    Freedom out{0, 0, 0, 0, is_folded(c) ? Status::FOLDED : Status::UNREACHABLE};
    const auto add = [&](int gc, const ArcSet& shoulder, const ArcSet& wrist, detail::Common& common) {
        common.gap = each_common(shoulder, wrist, [&](double lower, double upper) {
            common.held = true;
            ++out.arcs;
            out.total += upper - lower;
            out.widest = max(out.widest, upper - lower);
        });
        out.gc = static_cast<std::uint8_t>(out.gc | common.held << gc);
        return false;
    };
    const auto never = [](const JointFunctions<double>&) { return false; };
    if (detail::each_pair(arm, c, t, out.status, never, add)) [[likely]]
        return out;
    return detail::freedom_by_branches(arm, pose, c, t);
}

/// Whether any branch and arm angle solves a pose within the limits.
inline bool is_reachable(const Arm& arm, const Pose<double>& pose, const LimitTable& t) noexcept {
    const Circle<double> c = circle(arm, flange_pose(arm, pose));
    bool reached = false;
    Status status = Status::UNREACHABLE;
    const auto look = [&](int, const ArcSet& shoulder, const ArcSet& wrist, detail::Common& common) {
        common.gap = each_common(shoulder, wrist, [&](double, double) { common.held = true; });
        return reached = common.held;
    };
    const auto inside_at_eight = [&](const JointFunctions<double>& f) {
        return reached = detail::holds_at_fixed_psi(t, f);
    };
    if (detail::each_pair(arm, c, t, status, inside_at_eight, look)) [[likely]]
        return reached;
    return detail::is_held_by_a_branch(arm, pose, c, t);
}

}  // namespace armangle

#include "../names/end.hpp"
