// Feasible arcs: all psi of a pose and branch with every joint within its limits, and the causes of their
// ends. Eq. (25): Psi_all is the intersection of Psi_i over the joints.
//
//     self-motion -> joint functions -> boundaries -> blocked arcs -> free arcs with tagged ends
//     (circle/)      (circle/)          (32), (35)    blocked.hpp     here
#pragma once

#include "blocked.hpp"
#include "../status.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Corrects in `set` the tags of ends at which the direction (V, U) of a pivot joint vanishes: there the
/// joint jumps and does not reach its limit.
inline void mark_jumps(const JointFunctions<double>& f, ArcSet& set) noexcept {
    const auto mark = [&f](double psi, Tag& tag) {
        const int joint = tag_joint(tag) - 1;
        if (joint < 0 || joint % 2 == 1) return;
        const Pivot<double>& p = f.pivot[joint / 2];
        const SinCos<double> at = sin_cos(psi);
        if (hypot(p.U.at(at), p.V.at(at)) > tolerance::angle) return;
        const int hinge = joint / 4;
        tag = make_tag(hinge_joint[hinge] + 1,
                       f.hinge[hinge].H.at(at) > 0 ? Side::near_singular : Side::far_singular);
    };
    if (!may_jump(f.hinge[0]) && !may_jump(f.hinge[1])) return;
    for (int i = 0; i < set.count; ++i) {
        mark(set.arc[i].lower, set.arc[i].lower_tag);
        mark(set.arc[i].upper, set.arc[i].upper_tag);
    }
}

/// Corrects in `set` the tags of limits that are pi apart and have the same boundary function. The side on
/// which the joint is decides which limit it reaches.
inline void tell_opposite_limits(const LimitTable& t, const JointFunctions<double>& shoulder,
                                 const JointFunctions<double>& wrist, ArcSet& set) noexcept {
    const auto tell = [&](double psi, Tag& tag) {
        const int joint = tag_joint(tag) - 1, pivot = joint / 2;
        if (joint < 0 || joint % 2 == 1 || !t.cone[pivot].straight) return;
        const Pivot<double>& p = (pivot < pivots / 2 ? shoulder : wrist).pivot[pivot];
        const SinCos<double> at = sin_cos(psi), &lower = t.cone[pivot].lower;
        tag = t.tag[p.g * (p.V.at(at) * lower.cos + p.U.at(at) * lower.sin) > 0 ? pivot : pivots + pivot];
    };
    bool possible = false;
    for (const Cone& cone : t.cone) possible |= cone.straight;
    for (int i = 0; possible && i < set.count; ++i) {
        tell(set.arc[i].lower, set.arc[i].lower_tag);
        tell(set.arc[i].upper, set.arc[i].upper_tag);
    }
}

/// Completes the tags of the ends of free arcs and returns OK, or LIMITS if there are no arcs. The joint
/// functions are those of the shoulder's sign and of the wrist's.
inline Status tell_ends(const LimitTable& t, const JointFunctions<double>& shoulder,
                        const JointFunctions<double>& wrist, ArcSet& out) noexcept {
    if (!out.full) {
        tell_opposite_limits(t, shoulder, wrist, out);
        mark_jumps(shoulder, out);
    }
    return out.empty() ? Status::LIMITS : Status::OK;
}

/// Whether the first and last joint of a side (0: shoulder, 1: wrist) keep their limits, up to `slack` (rad),
/// if they rotate around one axis. The pose determines only theta_last + theta_first, or theta_last -
/// theta_first if the joint between them is at pi.
inline bool can_share(const LimitTable& t, const Directions<double>& d, int side, double slack) noexcept {
    const int first = 4 * side, last = first + 2;
    const double way = d.x[first + 1] < 0 ? -1.0 : 1.0;
    const ThetaRange &a = t.range[2 * side], &b = t.range[2 * side + 1];
    const double lower = b.lower + min(way * a.lower, way * a.upper) - slack,
                 upper = b.upper + max(way * a.lower, way * a.upper) + slack;
    if (!(upper - lower < two_pi)) return true;
    const double wanted = atan2(d.y[last], d.x[last]) + way * atan2(d.y[first], d.x[first]);
    const double at = lift(wanted, 0.5 * (lower + upper));
    return at >= lower && at <= upper;
}

/// Whether the joints of `which` (bit j: joint j + 1; joint 4 is not tested) are within the limits at these
/// directions, or violate them by at most `slack` (rad).
inline bool allows(const LimitTable& t, const Configuration<double>& gc, const Directions<double>& d,
                   unsigned which, double slack) noexcept {
    for (int h = 0; h < hinges; ++h) {
        const int j = hinge_joint[h], negative = (h == 0 ? gc.shoulder : gc.wrist) < 0;
        const double angle = atan2(abs(d.y[j]), d.x[j]);
        bool inside = false;
        for (int k = 0; k < t.piece_count[h][negative]; ++k) {
            const HingePiece& piece = t.piece[h][negative][k];
            inside |= angle >= piece.near.angle - slack && angle <= piece.far.angle + slack;
        }
        if (which >> j & 1 && !inside) return false;
        const unsigned both = 5u << (j - 1);
        if (abs(d.y[j]) <= tolerance::one_axis) {
            if ((which & both) == both && !can_share(t, d, h, slack)) return false;
            continue;
        }
        for (const int pivot : {2 * h, 2 * h + 1}) {
            const int i = pivot_joint[pivot];
            const double k = 1.0 / hypot(d.y[i], d.x[i]);
            if (which >> i & 1 && !t.cone[pivot].contains({d.y[i] * k, d.x[i] * k}, slack)) return false;
        }
    }
    return true;
}

inline constexpr unsigned all_joints = (1u << joints) - 1;

/// Whether isolated psi may be feasible besides the free arcs. Possible causes are a locked joint, or a joint
/// that turns back at its limit. Near a singularity a joint may use its whole range on an arc below the
/// tolerance. If blocked arcs just meet (their smallest `gap` is about 0), two joints may reach their limits
/// at once.
inline bool may_isolate(const LimitTable& t, const Blocked& blocked, const ArcSet& out, double gap) noexcept {
    const bool beside =
        (gap < tolerance::angle || blocked.touching) && !(t.psi_margin > 0);  // psi_margin concerns psi alone
    return beside || t.locked || (out.empty() && (!blocked.all || blocked.touching));
}

/// The result of the sweep over blocked arcs: the status, and whether isolated psi may exist besides the
/// arcs.
struct Left {
    Status status;
    bool may_isolate;
    double gap;           // rad: smallest gap or overlap between two blocked arcs
    bool beyond = false;  // the arcs hold only if rounding explains that a joint is beyond its limit
};
/// Writes the arcs between the blocked ones, with the limit at each of their ends, to `out`; empty if
/// everything is blocked. The joint functions are those of the shoulder's sign and of the wrist's. Returns
/// the status, and whether single psi may remain.
inline Left finish(const LimitTable& t, const JointFunctions<double>& shoulder,
                   const JointFunctions<double>& wrist, const Blocked& blocked, ArcSet& out) noexcept {
    const double gap = free_arcs(blocked, out);
    return {tell_ends(t, shoulder, wrist, out), may_isolate(t, blocked, out, gap), gap, blocked.beyond};
}

/// The tag of an isolated psi at these directions: joint 2 or 6 at 0 or pi, or the nearest limit among the
/// joints of `which` (bit j: joint j + 1); 0 if they have none.
inline Tag nearest_limit(const LimitTable& t, const Configuration<double>& gc, const Directions<double>& d,
                         unsigned which) noexcept {
    double least = infinity;
    Tag tag = 0;
    const auto take = [&](double away, Tag of) {
        tag = away < least ? of : tag;
        least = min(least, away);
    };
    for (int h = 0; h < hinges; ++h) {
        const int j = hinge_joint[h], negative = (h == 0 ? gc.shoulder : gc.wrist) < 0;
        if (abs(d.y[j]) <= tolerance::angle)
            return make_tag(j + 1, d.x[j] > 0 ? Side::near_singular : Side::far_singular);
        for (int k = 0; which >> j & 1 && k < t.piece_count[h][negative]; ++k)
            for (const HingeEnd& end : {t.piece[h][negative][k].near, t.piece[h][negative][k].far})
                if (end.tag) take(abs(end.angle - atan2(abs(d.y[j]), d.x[j])), end.tag);
    }
    for (int p = 0; p < pivots; ++p) {
        const int i = pivot_joint[p];
        if (t.cone[p].free || !(which >> i & 1)) continue;
        const double theta = atan2(d.y[i], d.x[i]);
        take(abs(wrap(theta - t.range[p].lower)), t.tag[p]);
        take(abs(wrap(theta - t.range[p].upper)), t.tag[pivots + p]);
    }
    return tag;
}

/// Calls each(psi) where a joint turns back or joint 2 or 6 is at 0 or pi.
template <class Each>
void each_turning(const JointFunctions<double>& shoulder, const JointFunctions<double>& wrist,
                  const Each& each) noexcept {
    const auto give = [&each](const Profile& special) {
        for (const Roots& roots : {special.stationary, special.singular})
            for (int k = 0; k < roots.count; ++k) each(roots.psi[k]);
    };
    give(profile(shoulder.hinge[0]));
    give(profile(wrist.hinge[1]));
    for (int p = 0; p < pivots; ++p) give(profile((p < pivots / 2 ? shoulder : wrist).pivot[p]));
}

/// Calls each(psi) where joints may reach their limits at a single psi, known to `slack` (rad): at the ends
/// of blocked arcs and, if `turning`, where a joint turns back. A joint that moves slowly determines the end
/// of its arc less precisely than a fast one. If arcs overlap slightly, any of their ends may be feasible.
template <class Each>
void each_meeting(const JointFunctions<double>& shoulder, const JointFunctions<double>& wrist,
                  const Blocked& blocked, bool turning, double slack, const Each& each) noexcept {
    if (turning) each_turning(shoulder, wrist, each);
    for (int i = 0; i < blocked.count; ++i)
        for (const double end : {blocked.arc[i].lower, blocked.arc[i].upper})
            if (!lies_within(blocked, wrap(end), slack)) each(wrap(end));
}

/// Adds single psi to `out` where blocked arcs touch or a joint turns back, and the joints of `which` (bits)
/// are within their limits. The joint functions are as in finish(). Returns OK or the reason why `out` is
/// empty.
[[gnu::noinline, gnu::cold]] inline Status add_isolated(const LimitTable& t, const SelfMotion<double>& motion,
                                                        const JointFunctions<double>& shoulder,
                                                        const JointFunctions<double>& wrist,
                                                        const Blocked& blocked, ArcSet& out,
                                                        unsigned which = all_joints) noexcept {
    SelfMotion<double> m = motion;
    m.gc = {shoulder.hinge[0].g, m.gc.elbow, wrist.hinge[1].g};
    ArcSet gaps, added;
    narrow_gaps(blocked, gaps);
    make_empty(added);
    for (int i = 0; i < gaps.count; ++i) {
        const Arc& gap = gaps.arc[i];
        bool inside = false;
        for (const double psi : {0.5 * (gap.lower + gap.upper), gap.lower, gap.upper})
            inside = inside || allows(t, m.gc, directions(m, sin_cos(psi)), which, tolerance::isolated);
        if (inside) put(added, gap);
    }
    const auto look = [&](double psi) {
        const Directions<double> d = directions(m, sin_cos(psi));
        if (contains(out, psi) || contains(added, psi) || !allows(t, m.gc, d, which, tolerance::isolated))
            return;
        const Tag tag = nearest_limit(t, m.gc, d, which);
        put(added, {psi, psi, tag, tag});
    };
    each_meeting(shoulder, wrist, blocked, blocked.touching, tolerance::locked, look);
    tell_opposite_limits(t, shoulder, wrist, added);
    mark_jumps(shoulder, added);
    for (int i = 0; i < added.count; ++i) put(out, added.arc[i]);
    return out.empty() ? Status::LIMITS : Status::OK;
}

}  // namespace detail

namespace detail {

/// Whether theta_4 violates a limit by no more than the uncertainty of a solved pose. For the distance n of
/// the wrist, dn / dtheta_4 = La Lb sin(eta) / n.
[[gnu::noinline, gnu::cold]] inline bool elbow_may_be_within(const SelfMotion<double>& m,
                                                             const LimitTable& t) noexcept {
    const double slack = t.elbow_slack * m.circle.distance / m.circle.triangle.eta.sin;
    return t.elbow.contains(m.elbow.theta_4, min(slack, tolerance::angle));
}

}  // namespace detail

/// The status of the elbow: OK, or why no psi is feasible; theta_4 is the same for all psi.
ARMANGLE_INLINE Status elbow_status(const SelfMotion<double>& m, const LimitTable& t) noexcept {
    if (is_unreachable(m.circle)) return Status::UNREACHABLE;
    if (is_folded(m.circle)) return Status::FOLDED;
    if (!t.elbow.contains(m.elbow.theta_4, 0.0) && !detail::elbow_may_be_within(m, t))
        return Status::ELBOW_LIMIT;
    return m.circle.triangle.eta.sin < t.sin_margin ? Status::ELBOW_MARGIN : Status::OK;
}

namespace detail {

/// Writes the arcs that the limits of all joints but the fourth permit to `out`, and adds those that they
/// forbid to `blocked`.
inline Left free_of_all(const JointFunctions<double>& f, const LimitTable& t, Blocked& blocked,
                        ArcSet& out) noexcept {
    Boundaries b;
    boundaries(t, f, b);
    for (int h = 0; h < hinges; ++h) block_hinge(t, f, b, h, blocked);
    block_pivots(t, f, b, all_pivots, blocked);
    return finish(t, f, f, blocked, out);
}

/// Writes the psi that the limits of all joints but the fourth permit, single ones included, to `out`;
/// returns OK, or the reason if it is empty.
ARMANGLE_INLINE Status moving_joints(const SelfMotion<double>& m, const JointFunctions<double>& f,
                                     const LimitTable& t, ArcSet& out) noexcept {
    Blocked blocked;
    const Left left = free_of_all(f, t, blocked, out);
    if (!left.may_isolate) [[likely]]
        return left.status;
    return add_isolated(t, m, f, f, blocked, out);
}

}  // namespace detail

/// Computes the feasible arcs of one pose and branch with joint functions f. If there are none, the status
/// gives the reason.
ARMANGLE_INLINE Status feasible(const SelfMotion<double>& m, const JointFunctions<double>& f,
                                const LimitTable& t, ArcSet& out) noexcept {
    make_empty(out);
    const Status elbow = elbow_status(m, t);
    return elbow == Status::OK ? detail::moving_joints(m, f, t, out) : elbow;
}

/// Computes the feasible arcs of one pose and branch. If there are none, the status gives the reason.
ARMANGLE_INLINE Status feasible(const SelfMotion<double>& m, const LimitTable& t, ArcSet& out) noexcept {
    return feasible(m, joint_functions(m), t, out);
}

/// Computes the arcs that one joint (0..6) permits alone, and the status of that joint.
inline Status joint_arcs(const SelfMotion<double>& m, const JointFunctions<double>& f, const LimitTable& t,
                         int joint, ArcSet& out) noexcept {
    make_empty(out);
    const Status elbow = elbow_status(m, t);
    if (elbow == Status::FOLDED || elbow == Status::UNREACHABLE) return elbow;
    if (joint == 3) {
        if (elbow == Status::OK) make_full(out);
        return elbow;
    }
    Boundaries b;
    boundaries(t, f, b);
    Blocked blocked;
    for (int p = 0; p < pivots; ++p)
        if (pivot_joint[p] == joint) block_pivots(t, f, b, pivot_bits(p), blocked);
    for (int h = 0; h < hinges; ++h)
        if (hinge_joint[h] == joint) block_hinge(t, f, b, h, blocked);
    const detail::Left left = detail::finish(t, f, f, blocked, out);
    if (!left.may_isolate) return left.status;
    return detail::add_isolated(t, m, f, f, blocked, out, 1u << joint);
}

/// The joint value q (rad) at the end that a tag marks; NaN if no joint causes it. `margin` (rad) is the
/// table's.
inline double end_value(const Arm& arm, double margin, const Configuration<double>& gc, Tag tag) noexcept {
    const int joint = tag_joint(tag) - 1;
    if (joint < 0) return not_a_number;
    const double g = joint == 1 ? gc.shoulder : gc.wrist;
    double theta = 0;
    switch (tag_side(tag)) {
        case Side::lower: return arm.limits.lower[joint];
        case Side::upper: return arm.limits.upper[joint];
        case Side::near_margin: theta = g * margin; break;
        case Side::far_margin: theta = g * (pi - margin); break;
        case Side::near_singular: theta = 0; break;
        case Side::far_singular: theta = g * pi; break;
        default: return not_a_number;
    }
    return to_q(theta, arm.sign[joint], arm.offset[joint], arm.limits.lower[joint], arm.limits.upper[joint],
                arm.joint_middle[joint]);
}

/// The arcs of branches 0..7, each with the reason if there are none.
struct AllArcs {
    ArcSet arcs[configurations];
    Status status[configurations];
};

namespace detail {

/// Appends the blocked arcs of `from` to `to`.
inline void append(const Blocked& from, Blocked& to) noexcept {
    to.all |= from.all;
    to.touching |= from.touching;
    to.beyond |= from.beyond;
    for (int i = 0; i < from.count; ++i) to.add(from.arc[i]);
}

/// The arcs blocked by the joints on either side of the elbow, for one sign of theta_2 and theta_6.
struct Sides {
    JointFunctions<double> f;
    Blocked shoulder, wrist;
};

/// Computes the blocked arcs of both sides; of joints 1, 3, 5 and 7 only those in `which` (their
/// pivot_bits()) count.
inline void block_sides(const LimitTable& t, const SelfMotion<double>& m, unsigned which,
                        Sides& out) noexcept {
    out.f = joint_functions(m);
    Boundaries b;
    boundaries(t, out.f, b);
    for (int half = 0; half < hinges; ++half) {
        Blocked& side = half == 0 ? out.shoulder : out.wrist;
        block_hinge(t, out.f, b, half, side);
        block_pivots(t, out.f, b, which & (half == 0 ? shoulder_pivots : wrist_pivots), side);
    }
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
