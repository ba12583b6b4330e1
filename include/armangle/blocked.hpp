// What limits block, as a list of arcs, and the arcs that are left.
//
// What a limit blocks is one arc, or the common part of two (a pivot with more than half a turn, a gap between two
// pieces of a hinge). No tangent, no derivative sign, no sampling; limits of any sign, beyond +-pi or infinite are the
// same rule.
#pragma once

#include "boundaries.hpp"

namespace armangle {

/// Arcs that limits block; Psi is the rest. A list, not a set: they may overlap or touch.
struct Blocked {
    static constexpr int capacity = 2 * pivots + 4 * hinges + pivots + 1;  // of pivots, of hinges, the paper's, one to write
    int count = 0;
    bool all = false;
    Arc arc[capacity];

    ARMANGLE_INLINE void put(double lower, double upper, Tag lower_tag, Tag upper_tag, bool kept) noexcept {
        arc[count] = {lower, upper, lower_tag, upper_tag};
        count += kept;
    }

    /// An arc with lower in [-pi, pi), kept unless it is shorter than the tolerance: a touching point. No branch.
    ARMANGLE_INLINE void add(double lower, double upper, Tag lower_tag, Tag upper_tag) noexcept {
        put(lower, upper, lower_tag, upper_tag, upper - lower >= tolerance::angle);
        all |= upper - lower >= two_pi - tolerance::angle;
    }
};

namespace detail {

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
    if (t.psi_margin > 0) detail::avoid_paper_singularity(t, f, pivot, out);
    if (b.pivot.constant >> pivot & 1) {
        const Pivot<double>& p = f.pivot[pivot];
        const double k = p.g / hypot(p.U.k, p.V.k);
        out.all |= !t.cone[pivot].contains({p.U.k * k, p.V.k * k});
        return;
    }
    for (const int i : {pivot, pivots + pivot}) {
        const Tag tag = t.tag[i], other = t.tag[(i + pivots) % (2 * pivots)];
        out.put(b.pivot.lower[i], b.pivot.upper[i], tag, b.pivot.cut >> i & 1 ? other : tag, b.pivot.kept >> i & 1);
        out.all |= b.pivot.whole >> i & 1;
    }
}

/// Blocks what the limits of a hinge (0, 1 for joints 2, 6) forbid.
inline void block_hinge(const LimitTable& t, const JointFunctions<double>& f, const Boundaries& b, int hinge, Blocked& out) noexcept {
    const int negative = f.hinge[hinge].g < 0, count = t.piece_count[hinge][negative];
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
        const auto outside = [&b, hinge](int end, Tag tag) {
            return Arc{b.hinge.lower[end / 2][2 * hinge + end % 2], b.hinge.upper[end / 2][2 * hinge + end % 2], tag, tag};
        };
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

}  // namespace armangle
