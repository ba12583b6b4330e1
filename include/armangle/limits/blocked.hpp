// The arcs that limits block, and the free arcs between them.
//
//     joint 1 blocks    [xxxx]
//     joint 2 blocks       [xxxxx]        [xxx]
//     joint 5 blocks                        [xxxx]
//     free            ==]        [========]      [==     one sweep from the lowest lower end on
//
// A limit blocks one arc, or the common part of two (a pivot with more than half a turn, a gap between two
// pieces of a hinge). The rule needs no tangent, no sign of a derivative and no sampling. It is the same for
// limits of any sign, beyond +-pi or infinite.
#pragma once

#include "boundaries.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A list of arcs that limits block; they may overlap or touch. The feasible psi are the complement of their
/// union.
struct Blocked {
    static constexpr int capacity =
        2 * pivots + 4 * hinges + pivots + 1;  // pivots, hinges, the paper's arcs, and one scratch slot
    int count = 0;
    bool all = false;
    bool touching = false;  // a joint turns back at its limit, or a hinge at 0 or pi: one psi may hold
    bool beyond = false;    // a joint that psi does not move is beyond its limit, by less than the tolerance
    Tag furthest_tag = 0;
    double furthest = -infinity;  // the upper end that lies furthest, and its cause
    Arc arc[capacity];

    /// Adds an arc with lower in [-pi, pi), unless it is shorter than the tolerance. Without branches.
    ARMANGLE_INLINE void add(const Arc& a) noexcept {
        const bool kept = a.upper - a.lower >= tolerance::angle, further = kept & (a.upper > furthest);
        arc[count] = a;
        count += kept;
        furthest_tag = further ? a.upper_tag : furthest_tag;
        furthest = further ? a.upper : furthest;
        all |= a.upper - a.lower >= two_pi - tolerance::angle;
    }
};

namespace detail {

/// Blocks the intersection of a and b, which has at most two pieces. Each begins at the lower end of one arc.
/// A whole circle has no ends, wherever its seam lies.
ARMANGLE_INLINE void block_both(const Arc& a, const Arc& b, Blocked& out) noexcept {
    const double width_a = a.upper - a.lower, width_b = b.upper - b.lower;
    const double whole = two_pi - tolerance::same_psi;
    if (width_a >= whole) return out.add(b);
    if (width_b >= whole) return out.add(a);
    const double room_a = room_in(a.lower, b.lower, width_b), room_b = room_in(b.lower, a.lower, width_a);
    out.add({a.lower, room_a < width_a ? a.lower + room_a : a.upper, a.lower_tag,
             room_a < width_a ? b.upper_tag : a.upper_tag});
    out.add({b.lower, room_b < width_b ? b.lower + room_b : b.upper, b.lower_tag,
             room_b < width_b ? a.upper_tag : b.upper_tag});
}

/// Blocks psi_sing -+ epsilon of eq. (31) if the discriminant of eq. (30) is small: the singularity avoidance
/// of the paper. `pivot` counts joints 1, 3, 5, 7 from 0.
inline void avoid_paper_singularity(const LimitTable& t, const JointFunctions<double>& f, int pivot,
                                    Blocked& out) noexcept {
    const Harmonic<double> n = slope_numerator(f.pivot[pivot]);
    const double disc = n.s * n.s + n.c * n.c - n.k * n.k;
    if (abs(disc) > t.discriminant || hypot(n.s, n.c) <= tolerance::singular) return;
    const double psi = wrap(atan2(n.s, n.c) + (n.k > 0 ? pi : 0.0));
    const bool near = f.hinge[pivot / 2].H.at(sin_cos(psi)) > 0;
    const Tag tag = make_tag(hinge_joint[pivot / 2] + 1, near ? Side::near_singular : Side::far_singular);
    const double lower = psi - t.psi_margin, turn = lower < -pi ? two_pi : 0.0;
    out.add({lower + turn, psi + t.psi_margin + turn, tag, tag});
}

/// Whether joint 2 or 6 reaches 0 or pi at some psi, where the directions (V, U) of its neighbours vanish.
/// Only then can an arc end at a jump.
inline bool may_jump(const Hinge<double>& h) noexcept {
    return min(h.high.below_one, h.low.above_minus_one) <= tolerance::touching;
}

/// The |theta| (rad) of joint 2 or 6, which must not depend on psi; p is the first pivot on its side.
inline double constant_hinge(const Hinge<double>& h, const Pivot<double>& p) noexcept {
    const SinCos<double> zero{0.0, 1.0};
    const double sine = hypot(p.U.at(zero), p.V.at(zero)), cosine = h.H.at(zero);
    // if sin(theta) is 0 on the whole circle, (V, U) is the convention's (1, 0) and no sine
    const bool singular = sine * sine + cosine * cosine > 1.5;
    return atan2(singular ? 0.0 : sine, cosine);
}

}  // namespace detail

/// The two bits of a pivot joint (0 to 3) in PivotArcs: of its lower limit and of its upper limit.
constexpr unsigned pivot_bits(int pivot) noexcept { return 1u << pivot | 1u << (pivots + pivot); }

/// Bits for joints 1 and 3; joints 5 and 7; all four; and one bit a joint instead of two.
inline constexpr unsigned shoulder_pivots = pivot_bits(0) | pivot_bits(1),
                          wrist_pivots = pivot_bits(2) | pivot_bits(3),
                          all_pivots = shoulder_pivots | wrist_pivots, each_pivot = (1u << pivots) - 1;

/// Adds the arcs that the limits of some pivot joints (`which`: their pivot_bits()) forbid.
inline void block_pivots(const LimitTable& t, const JointFunctions<double>& f, const Boundaries& b,
                         unsigned which, Blocked& out) noexcept {
    if (t.psi_margin > 0)
        for (int p = 0; p < pivots; ++p)
            if (which >> p & 1) detail::avoid_paper_singularity(t, f, p, out);
    for_each_bit(b.pivot.constant & which & each_pivot, [&](int p) {
        const Pivot<double>& pivot = f.pivot[p];
        const double k = pivot.g / hypot(pivot.U.k, pivot.V.k);
        const SinCos<double> at{pivot.U.k * k, pivot.V.k * k};
        const bool inside = t.cone[p].contains(at);
        out.all |= !inside;
        out.beyond |= inside && !t.cone[p].contains(at, 0.0);
    });
    out.touching |= (b.pivot.touching & which) != 0;
    for_each_bit(b.pivot.kept & which, [&](int i) {
        const Tag tag = t.tag[i], other = t.tag[(i + pivots) % (2 * pivots)];
        out.add({b.pivot.lower[i], b.pivot.upper[i], tag, b.pivot.cut >> i & 1 ? other : tag});
    });
}

/// Adds the arcs that the limits of joint 2 or 6 (`hinge`: 0, 1) forbid.
inline void block_hinge(const LimitTable& t, const JointFunctions<double>& f, const Boundaries& b, int hinge,
                        Blocked& out) noexcept {
    const int negative = f.hinge[hinge].g < 0, count = t.piece_count[hinge][negative];
    const HingePiece* piece = t.piece[hinge][negative];
    out.touching |= (b.hinge.touching >> (2 * hinge) & 3) != 0 || detail::may_jump(f.hinge[hinge]);
    if (count == 0) {
        out.all = true;
    } else if (is_constant(f.hinge[hinge])) {
        const double angle = detail::constant_hinge(f.hinge[hinge], f.pivot[2 * hinge]);
        const auto is_inside = [&](double slack) {
            bool in_piece = false;
            for (int k = 0; k < count; ++k)
                in_piece |= angle >= piece[k].near.angle - slack && angle <= piece[k].far.angle + slack;
            return in_piece;
        };
        const bool inside = is_inside(tolerance::angle);
        out.all |= !inside;
        out.beyond |= inside && !is_inside(0.0);
    } else {
        const auto outside = [&b, hinge](int end, Tag tag) {
            return Arc{b.hinge.lower[end / 2][2 * hinge + end % 2],
                       b.hinge.upper[end / 2][2 * hinge + end % 2], tag, tag};
        };
        const int last = count - 1;
        if (piece[0].near.tag) out.add(outside(0, piece[0].near.tag));
        if (count == 2) detail::block_both(outside(1, piece[0].far.tag), outside(2, piece[1].near.tag), out);
        if (piece[last].far.tag) out.add(outside(2 * last + 1, piece[last].far.tag));
    }
}

namespace detail {

/// Sorts blocked arcs: order[k] is the index of the arc with the k-th lowest lower end. Counting instead of
/// swapping avoids branches that depend on the data.
inline void sort_arcs(const Blocked& blocked, int* order) noexcept {
    for (int i = 0; i < blocked.count; ++i) {
        int rank = 0;
        const double lower = blocked.arc[i].lower;
        for (int j = 0; j < i; ++j) rank += blocked.arc[j].lower <= lower;
        for (int j = i + 1; j < blocked.count; ++j) rank += blocked.arc[j].lower < lower;
        order[rank] = i;
    }
}

}  // namespace detail

/// Writes the free arcs between the blocked ones, in one sweep over the circle. Returns the smallest gap or
/// overlap of two neighbours (rad), infinite if there is none. If it is below the tolerance, narrow_gaps()
/// lists the places.
inline double free_arcs(const Blocked& blocked, ArcSet& out) noexcept {
    make_empty(out);
    if (blocked.all) return infinity;
    if (blocked.count == 0) {
        make_full(out);
        return infinity;
    }
    double least = infinity;
    int order[Blocked::capacity], count = 0;
    detail::sort_arcs(blocked, order);
    const auto append = [&](const Arc& arc, bool real) {  // without branching
        const double width = arc.upper - arc.lower;
        out.arc[count] = arc;
        count += real & (width >= tolerance::angle);
        least = min(least, real ? abs(width) : infinity);
    };
    const Arc& first = blocked.arc[order[0]];
    double reach =
        blocked.furthest - two_pi;  // furthest blocked end so far; at first of the arc across the seam
    Tag tag = blocked.furthest_tag;
    const bool in_front = reach >= -pi;  // otherwise the free arc across the seam is the last one
    append({reach, first.lower, tag, first.lower_tag}, in_front);
    for (int k = 0;;) {
        const Arc& here = blocked.arc[order[k]];
        tag = here.upper > reach ? here.upper_tag : tag;
        reach = max(reach, here.upper);
        if (++k == blocked.count) break;
        const Arc& next = blocked.arc[order[k]];
        append({reach, next.lower, tag, next.lower_tag}, true);
    }
    append({reach, first.lower + two_pi, tag, first.lower_tag}, !in_front);
    out.count = count;
    return least;
}

/// Writes the places where blocked arcs touch or leave less than the tolerance between them. A place has no
/// width if only rounding separates the arcs.
inline void narrow_gaps(const Blocked& blocked, ArcSet& out) noexcept {
    make_empty(out);
    if (blocked.count == 0) return;
    int order[Blocked::capacity];
    detail::sort_arcs(blocked, order);
    double reach = blocked.furthest - two_pi;
    Tag tag = blocked.furthest_tag;
    for (int k = 0; k < blocked.count; ++k) {
        const Arc& here = blocked.arc[order[k]];
        const double width = here.lower - reach, middle = 0.5 * (here.lower + reach);
        if (abs(width) < tolerance::angle) {
            const bool point = width <= tolerance::same_psi;
            detail::put(out, {point ? middle : reach, point ? middle : here.lower, tag, here.lower_tag});
        }
        tag = here.upper > reach ? here.upper_tag : tag;
        reach = max(reach, here.upper);
    }
}

/// Whether psi lies in a blocked arc, more than `depth` (rad) from both of its ends.
inline bool lies_within(const Blocked& blocked, double psi, double depth) noexcept {
    for (int i = 0; i < blocked.count; ++i) {
        const Arc& arc = blocked.arc[i];
        const double ahead = psi < arc.lower ? psi - arc.lower + two_pi : psi - arc.lower;
        if (ahead > depth && ahead < arc.upper - arc.lower - depth) return true;
    }
    return false;
}

}  // namespace armangle

#include "../names/end.hpp"
