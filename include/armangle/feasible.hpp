// Feasible arcs: all psi of a pose and branch that keep every joint within its limits. Eq. (25), (32), (35).
//
// Each limit is one boundary function B(psi) = a sin + b cos + c that must not be negative:
//   pivot  g (U cos L - V sin L) >= 0 at the lower limit, <= 0 at the upper: the cone from one to the other;
//   hinge  cos(near) - H >= 0 and H - cos(far) >= 0, near and far being the limits of |theta|.
// {B >= 0} is one arc, [phi - alpha, phi + alpha] with phi = atan2(a, b), alpha = acos(-c / hypot(a, b)), so what a
// limit blocks is one arc, or the common part of two; Psi is what no limit blocks. No tangent, no derivative sign, no
// sampling; limits of any sign, beyond +-pi or infinite are the same rule.
#pragma once

#include "joint_function.hpp"
#include "limit_table.hpp"
#include "status.hpp"

namespace armangle {

/// The arcs {B >= 0} of eight boundary functions at once; none is an arc of no width, all one of 2 pi.
struct BoundaryArcs {
    double a[8], b[8], c[8];     // in: B = a sin + b cos + c
    double lower[8], upper[8];   // out: phi -+ alpha, lower in [-pi, pi)

    /// With a^2 + b^2 - c^2 from a, b and c.
    ARMANGLE_INLINE void solve() noexcept {
        using Slots = Lane<8>;
        const Slots A = Slots::of(a), B = Slots::of(b), C = Slots::of(c);
        solve(mul_add(A, A, B * B) - C * C);
    }

    /// With a^2 + b^2 - c^2 given, where that is known better.
    ARMANGLE_INLINE void solve(const Lane<8>& excess) noexcept {
        using Slots = Lane<8>;
        const Slots A = Slots::of(a), B = Slots::of(b), C = Slots::of(c);
        const Slots middle = atan2(A, B);
        const Slots half = atan2(sqrt(max(excess, Slots(0.0))), -C);  // acos(-c / h), 0 or pi beyond +-1
        const Slots below = middle - half;
        const Slots turn = select(below < Slots(-pi), Slots(two_pi), Slots(0.0));
        (below + turn).store(lower), (middle + half + turn).store(upper);
    }
};

/// Boundary functions of one circle and branch, solved: lanes 0-3 and 4-7 of `pivot` are lower and upper limits, of
/// `hinge` near and far ends of hinge 2 (pieces 0, 1), then of hinge 6.
struct Boundaries {
    BoundaryArcs pivot, hinge;
    double hinge_excess[8];  // a^2 + b^2 - c^2 = (max H - cos(limit)) (cos(limit) - min H)
};

namespace detail {

ARMANGLE_INLINE void fill_boundaries(const LimitTable& t, const JointFunctions<double>& f, Boundaries& out) noexcept {
    for (int i = 0; i < 2 * pivots; ++i) {
        const Pivot<double>& p = f.pivot[i % pivots];
        const double u = p.g * t.u[i], v = p.g * t.v[i];
        out.pivot.a[i] = u * p.U.s + v * p.V.s;
        out.pivot.b[i] = u * p.U.c + v * p.V.c;
        out.pivot.c[i] = u * p.U.k + v * p.V.k;
    }
    for (int h = 0; h < hinges; ++h) {
        const Hinge<double>& hinge = f.hinge[h];
        const HingePiece* piece = t.piece[h][hinge.g < 0];
        for (int end = 0; end < 2 * pieces; ++end) {
            const int i = 4 * h + end;
            const HingeEnd& limit = end % 2 ? piece[end / 2].far : piece[end / 2].near;
            const double side = end % 2 ? 1.0 : -1.0;
            const bool acute = limit.below_one < 1.0;
            const double above = acute ? limit.below_one - hinge.high.below_one : hinge.high.above_minus_one - limit.above_minus_one;
            const double below = acute ? hinge.low.below_one - limit.below_one : limit.above_minus_one - hinge.low.above_minus_one;
            out.hinge.a[i] = side * hinge.H.s, out.hinge.b[i] = side * hinge.H.c;
            out.hinge.c[i] = side * 0.5 * (above - below), out.hinge_excess[i] = above * below;
        }
    }
}

}  // namespace detail

ARMANGLE_INLINE void boundaries(const LimitTable& t, const JointFunctions<double>& f, Boundaries& out) noexcept {
    detail::fill_boundaries(t, f, out);
    out.pivot.solve();
    out.hinge.solve(Lane<8>::of(out.hinge_excess));
}

/// Arcs that limits block; Psi is the rest. A list, not a set: they may overlap or touch.
struct Blocked {
    static constexpr int capacity = 2 * pivots + 4 * hinges + pivots + 1;  // of pivots, of hinges, the paper's, one to write
    int count = 0;
    bool all = false;
    Arc arc[capacity];

    /// An arc with lower in [-pi, pi), kept unless it is shorter than the tolerance: a touching point. No branch.
    ARMANGLE_INLINE void add(double lower, double upper, Tag lower_tag, Tag upper_tag) noexcept {
        arc[count] = {lower, upper, lower_tag, upper_tag};
        count += upper - lower >= tolerance::angle;
        all |= upper - lower >= two_pi - tolerance::angle;
    }
};

namespace detail {

/// The arc where boundary function i is negative.
inline Arc negative_arc(const BoundaryArcs& b, int i, Tag tag) noexcept {
    const double turn = b.upper[i] >= pi ? two_pi : 0.0;
    return {b.upper[i] - turn, b.lower[i] + (two_pi - turn), tag, tag};
}

inline void block(const Arc& a, Blocked& out) noexcept { out.add(a.lower, a.upper, a.lower_tag, a.upper_tag); }

/// Blocks the common part of two arcs: what of each lies in the other from its own lower end on, at most two pieces.
ARMANGLE_INLINE void block_both(const Arc& a, const Arc& b, Blocked& out) noexcept {
    const double ahead = a.lower - b.lower, width_a = a.upper - a.lower, width_b = b.upper - b.lower;
    const double room_a = width_b - (ahead < 0 ? ahead + two_pi : ahead);  // from a's lower end to b's upper one
    const double room_b = width_a - (ahead > 0 ? two_pi - ahead : -ahead);
    out.add(a.lower, room_a < width_a ? a.lower + room_a : a.upper, a.lower_tag, room_a < width_a ? b.upper_tag : a.upper_tag);
    out.add(b.lower, room_b < width_b ? b.lower + room_b : b.upper, b.lower_tag, room_b < width_b ? a.upper_tag : b.upper_tag);
}

/// Removes psi_sing -+ epsilon of eq. (31) where the discriminant of eq. (30) is small: the paper's own avoidance.
inline void avoid_paper_singularity(const LimitTable& t, const JointFunctions<double>& f, int pivot, Blocked& out) noexcept {
    const Linear<double> n = slope_numerator(f.pivot[pivot]);
    const double disc = n.s * n.s + n.c * n.c - n.k * n.k;
    if (abs(disc) > t.discriminant || hypot(n.s, n.c) <= tolerance::singular) return;
    const double psi = wrap(atan2(n.s, n.c) + (n.k > 0 ? pi : 0.0));
    const bool near = f.hinge[pivot / 2].H.at(sin_cos(psi)) > 0;
    const Tag tag = make_tag(hinge_joint[pivot / 2] + 1, near ? Side::near_singular : Side::far_singular);
    const double lower = psi - t.psi_margin, turn = lower < -pi ? two_pi : 0.0;
    out.add(lower + turn, psi + t.psi_margin + turn, tag, tag);
}

/// |theta| of a hinge that does not move with psi.
inline double constant_hinge(const Hinge<double>& h, const Pivot<double>& p) noexcept {
    const SinCos<double> zero{0.0, 1.0};
    const double sine = hypot(p.U.at(zero), p.V.at(zero)), cosine = h.H.at(zero);
    // where sin(theta) is 0 on the whole circle, (V, U) is the convention's (1, 0) and no sine
    const bool singular = sine * sine + cosine * cosine > 1.5;
    return atan2(singular ? 0.0 : sine, cosine);
}

}  // namespace detail

/// Blocks what the limits of a pivot (0..3 for joints 1, 3, 5, 7) forbid.
inline void block_pivot(const LimitTable& t, const JointFunctions<double>& f, const Boundaries& b, int pivot, Blocked& out) noexcept {
    const Pivot<double>& p = f.pivot[pivot];
    const int l = pivot, u = pivots + pivot;
    if (t.psi_margin > 0) detail::avoid_paper_singularity(t, f, pivot, out);
    if (t.free[pivot]) return;
    if (is_constant(p)) {
        const double k = p.g / hypot(p.U.k, p.V.k);
        out.all |= !t.cone[pivot].contains({p.U.k * k, p.V.k * k});
    } else if (t.wide[pivot]) {
        detail::block_both({b.pivot.lower[l], b.pivot.upper[l], t.tag[l], t.tag[l]},
                           {b.pivot.lower[u], b.pivot.upper[u], t.tag[u], t.tag[u]}, out);
    } else {
        detail::block(detail::negative_arc(b.pivot, l, t.tag[l]), out);
        detail::block(detail::negative_arc(b.pivot, u, t.tag[u]), out);
    }
}

/// Blocks what the limits of a hinge (0, 1 for joints 2, 6) forbid.
inline void block_hinge(const LimitTable& t, const JointFunctions<double>& f, const Boundaries& b, int hinge, Blocked& out) noexcept {
    const int negative = f.hinge[hinge].g < 0, count = t.piece_count[hinge][negative], first = 4 * hinge;
    const HingePiece* piece = t.piece[hinge][negative];
    if (count == 0) {
        out.all = true;
    } else if (is_constant(f.hinge[hinge])) {
        const double angle = detail::constant_hinge(f.hinge[hinge], f.pivot[2 * hinge]);
        bool inside = false;
        for (int k = 0; k < count; ++k)
            inside |= angle >= piece[k].near.angle - tolerance::angle && angle <= piece[k].far.angle + tolerance::angle;
        out.all |= !inside;
    } else {
        const auto outside = [&b, first](int end, Tag tag) { return detail::negative_arc(b.hinge, first + end, tag); };
        const int last = count - 1;
        if (piece[0].near.tag) detail::block(outside(0, piece[0].near.tag), out);
        if (count == 2) detail::block_both(outside(1, piece[0].far.tag), outside(2, piece[1].near.tag), out);
        if (piece[last].far.tag) detail::block(outside(2 * last + 1, piece[last].far.tag), out);
    }
}

namespace detail {

/// order[k] is the arc with the k-th lowest lower end. By counting, not swapping: no branch depends on the data.
inline void sort_arcs(const Blocked& blocked, int* order) noexcept {
    for (int i = 0; i < blocked.count; ++i) {
        int rank = 0;
        const double lower = blocked.arc[i].lower;
        for (int j = 0; j < i; ++j) rank += blocked.arc[j].lower <= lower;
        for (int j = i + 1; j < blocked.count; ++j) rank += blocked.arc[j].lower < lower;
        order[rank] = i;
    }
}

/// Puts an arc of the right length behind the others; no branch.
inline void append(ArcSet& out, const Arc& arc) noexcept {
    out.arc[out.count] = arc;
    out.count += arc.upper - arc.lower >= tolerance::angle;
}

/// A last arc that begins beyond pi belongs to the front.
inline void rotate_last(ArcSet& out) noexcept {
    if (out.count == 0 || out.arc[out.count - 1].lower < pi) return;
    Arc last = out.arc[out.count - 1];
    last.lower -= two_pi, last.upper -= two_pi;
    for (int i = out.count - 1; i > 0; --i) out.arc[i] = out.arc[i - 1];
    out.arc[0] = last;
}

}  // namespace detail

/// The arcs that are left between the blocked ones: one sweep over the circle.
inline void free_arcs(const Blocked& blocked, ArcSet& out) noexcept {
    make_empty(out);
    if (blocked.all) return;
    if (blocked.count == 0) return make_full(out);
    int order[Blocked::capacity];
    detail::sort_arcs(blocked, order);
    double reach = -infinity;  // how far the arcs so far block; at first those over the seam
    Tag tag = 0;
    for (int i = 0; i < blocked.count; ++i) {
        const Arc& arc = blocked.arc[i];
        const bool further = arc.upper - two_pi > reach;
        reach = further ? arc.upper - two_pi : reach, tag = further ? arc.upper_tag : tag;
    }
    const Arc& first = blocked.arc[order[0]];
    const bool over = reach > first.upper;
    reach = over ? reach : first.upper, tag = over ? tag : first.upper_tag;
    for (int k = 1; k < blocked.count; ++k) {
        const Arc& next = blocked.arc[order[k]];
        detail::append(out, {reach, next.lower, tag, next.lower_tag});
        const bool further = next.upper > reach;
        reach = further ? next.upper : reach, tag = further ? next.upper_tag : tag;
    }
    detail::append(out, {reach, first.lower + two_pi, tag, first.lower_tag});
    detail::rotate_last(out);
}

namespace detail {

/// Whether a hinge comes to 0 or pi, where the directions (V, U) of its pivots vanish: only then can an end be a jump.
inline bool may_jump(const Hinge<double>& h) noexcept { return min(h.high.below_one, h.low.above_minus_one) <= tolerance::touching; }

/// Ends at which a pivot's direction (V, U) itself vanishes: the joint jumps there, it does not reach its limit.
inline void mark_jumps(const JointFunctions<double>& f, ArcSet& set) noexcept {
    const auto mark = [&f](double psi, Tag& tag) {
        const int joint = tag_joint(tag) - 1;
        if (joint < 0 || joint % 2 == 1) return;
        const Pivot<double>& p = f.pivot[joint / 2];
        const SinCos<double> at = sin_cos(psi);
        if (hypot(p.U.at(at), p.V.at(at)) > tolerance::angle) return;
        const int hinge = joint / 4;
        tag = make_tag(hinge_joint[hinge] + 1, f.hinge[hinge].H.at(at) > 0 ? Side::near_singular : Side::far_singular);
    };
    if (!may_jump(f.hinge[0]) && !may_jump(f.hinge[1])) return;
    for (int i = 0; i < set.count; ++i) mark(set.arc[i].lower, set.arc[i].lower_tag), mark(set.arc[i].upper, set.arc[i].upper_tag);
}

/// Limits half a turn apart have the same boundary: the side on which the joint stands tells which one it reaches.
inline void tell_opposite_limits(const LimitTable& t, const JointFunctions<double>& shoulder, const JointFunctions<double>& wrist,
                                 ArcSet& set) noexcept {
    const auto tell = [&](double psi, Tag& tag) {
        const int joint = tag_joint(tag) - 1, pivot = joint / 2;
        if (joint < 0 || joint % 2 == 1 || !t.cone[pivot].straight) return;
        const Pivot<double>& p = (pivot < pivots / 2 ? shoulder : wrist).pivot[pivot];
        const SinCos<double> at = sin_cos(psi), &lower = t.cone[pivot].lower;
        tag = t.tag[p.g * (p.V.at(at) * lower.cos + p.U.at(at) * lower.sin) > 0 ? pivot : pivots + pivot];
    };
    bool possible = false;
    for (const Cone& cone : t.cone) possible |= cone.straight;
    for (int i = 0; possible && i < set.count; ++i) tell(set.arc[i].lower, set.arc[i].lower_tag), tell(set.arc[i].upper, set.arc[i].upper_tag);
}

/// The set that is left; the joint functions are those of the shoulder's sign and of the wrist's.
inline Status finish(const LimitTable& t, const JointFunctions<double>& shoulder, const JointFunctions<double>& wrist, Blocked& blocked,
                     ArcSet& out) noexcept {
    free_arcs(blocked, out);
    if (!out.full) tell_opposite_limits(t, shoulder, wrist, out), mark_jumps(shoulder, out);
    return out.empty() ? Status::LIMITS : Status::OK;
}

}  // namespace detail

/// Elbow: OK, or why no psi is feasible, theta_4 being the same for all.
inline Status elbow_status(const Arm& arm, const LimitTable& t, const Circle<double>& c, const Fold<double>& fold) noexcept {
    if (is_folded(arm, c)) return Status::FOLDED;
    if (is_unreachable(arm, c)) return Status::UNREACHABLE;
    if (!t.elbow.contains(fold.theta_4)) return Status::ELBOW_LIMIT;
    return c.triangle.eta.sin < t.sin_margin ? Status::ELBOW_MARGIN : Status::OK;
}

/// Psi_all of one circle and branch; empty with the reason in the status.
inline Status feasible(const Arm& arm, const LimitTable& t, const Circle<double>& c, const Fold<double>& fold,
                       const JointFunctions<double>& f, ArcSet& out) noexcept {
    make_empty(out);
    const Status elbow = elbow_status(arm, t, c, fold);
    if (elbow != Status::OK) return elbow;
    Boundaries b;
    boundaries(t, f, b);
    Blocked blocked;
    for (int h = 0; h < hinges; ++h) block_hinge(t, f, b, h, blocked);
    for (int p = 0; p < pivots; ++p) block_pivot(t, f, b, p, blocked);
    return detail::finish(t, f, f, blocked, out);
}

/// Psi_i of one joint (0..6), with the status of that joint alone.
inline Status joint_arcs(const Arm& arm, const LimitTable& t, const Circle<double>& c, const Fold<double>& fold,
                         const JointFunctions<double>& f, int joint, ArcSet& out) noexcept {
    make_empty(out);
    const Status elbow = elbow_status(arm, t, c, fold);
    if (elbow == Status::FOLDED || elbow == Status::UNREACHABLE) return elbow;
    if (joint == 3) {
        if (elbow == Status::OK) make_full(out);
        return elbow;
    }
    Boundaries b;
    boundaries(t, f, b);
    Blocked blocked;
    for (int p = 0; p < pivots; ++p)
        if (pivot_joint[p] == joint) block_pivot(t, f, b, p, blocked);
    for (int h = 0; h < hinges; ++h)
        if (hinge_joint[h] == joint) block_hinge(t, f, b, h, blocked);
    return detail::finish(t, f, f, blocked, out);
}

/// Value in q of the end that a tag marks; NaN for a user's end.
inline double end_value(const Arm& arm, double margin, const Configuration<double>& gc, Tag tag) noexcept {
    const int joint = tag_joint(tag) - 1;
    if (joint < 0) return not_a_number;
    const double g = joint == 1 ? gc.shoulder : gc.wrist;
    double theta = 0;
    switch (tag_side(tag)) {
        case Side::lower: return arm.lower[joint];
        case Side::upper: return arm.upper[joint];
        case Side::near_margin: theta = g * margin; break;
        case Side::far_margin: theta = g * (pi - margin); break;
        case Side::near_singular: theta = 0; break;
        case Side::far_singular: theta = g * pi; break;
        default: return not_a_number;
    }
    return joint_value(theta, arm.sign[joint], arm.offset[joint], arm.lower[joint], arm.upper[joint], arm.joint_middle[joint]);
}

}  // namespace armangle
