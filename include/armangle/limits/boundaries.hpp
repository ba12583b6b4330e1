// Each limit as a boundary function B(psi) = a sin + b cos + c. The limit is violated where B is negative.
// Eq. (32), (35).
//
//     B |   .--.                  .-    {B < 0} is one arc, (phi + alpha, phi - alpha + 2 pi), with
//       |  /    \                /      phi = atan2(a, b), where B is largest, and
//     0 +-/-phi--\--------------/--     alpha = acos(-c / hypot(a, b)).
//       |/        `-._______.-'
//
//   pivot  g (U cos L - V sin L) >= 0 at the lower limit, <= 0 at the upper: the cone from one to the other;
//   hinge  cos(near) - H >= 0 and H - cos(far) >= 0, near and far being the limits of |theta|.
#pragma once

#include "../circle/joint_function.hpp"
#include "limit_table.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

using Slots = Lane<8>;

/// Arcs of several boundary functions, from lower in [-pi, pi) and at most 2 pi long; an arc of width 0 is
/// empty.
struct ArcLanes {
    Slots lower, upper;
};

/// The distance (rad) from `lower`, the start of an arc, to the end of another arc that starts at or before
/// it. It is less than the arc's width if the other one ends within it, and negative if it ends before.
template <class T>
ARMANGLE_INLINE T room_in(const T& lower, const T& other_lower, const T& other_width) noexcept {
    const T ahead = lower - other_lower;
    return other_width - select(ahead < T(0.0), ahead + T(two_pi), ahead);
}

/// The arcs {B < 0} of boundary functions, from phi (`middle`) and alpha (`half`).
ARMANGLE_INLINE ArcLanes negative_arcs(const Slots& middle, const Slots& half) noexcept {
    const Slots start = middle + half, turn = select(start >= Slots(pi), Slots(two_pi), Slots(0.0));
    return {start - turn, (middle - half) + (Slots(two_pi) - turn)};
}

/// The root of `excess`, a^2 + b^2 - c^2, or 0 if B never changes its sign. Together with -c it gives alpha =
/// acos(-c / h).
ARMANGLE_INLINE Slots half_chord(const Slots& excess) noexcept { return sqrt(max(excess, Slots(0.0))); }

}  // namespace detail

/// The arcs that the limits of joints 1, 3, 5 and 7 block: lanes 0-3 belong to their lower limits, lanes 4-7
/// to the upper ones.
struct PivotArcs {
    double lower[2 * pivots], upper[2 * pivots];
    // One bit a lane. kept: the arc blocks something (limited, moving, longer than the tolerance). cut: it
    // ends at the other limit's end. constant: the joint does not move. touching: it turns back at the limit.
    unsigned kept, cut, constant, touching;
};

/// The arcs where the boundary function of a limit of joint 2 or 6 is negative, by piece, joint and end
/// (near, far).
struct HingeArcs {
    double lower[pieces][2 * hinges], upper[pieces][2 * hinges];
    unsigned touching;  // one bit a hinge and end: the hinge turns back there
};

/// The solved boundary functions of one circle and branch.
struct Boundaries {
    PivotArcs pivot;
    HingeArcs hinge;
};

namespace detail {

/// The number get(pivot) of all four pivot joints, for the lower and again for the upper limits.
template <class Get>
ARMANGLE_INLINE Slots of_pivots(const JointFunctions<double>& f, const Get& get) noexcept {
    const double four[pivots] = {get(f.pivot[0]), get(f.pivot[1]), get(f.pivot[2]), get(f.pivot[3])};
    return twice(four);
}

/// The angles phi and alpha of the boundary functions of the pivot joints; lanes as in PivotArcs.
struct PivotAngles {
    Slots middle, half;
    unsigned constant, touching;
};

/// One bit for each boundary function with a double root up to rounding, where the joint turns back. `excess`
/// is a^2 + b^2 - c^2, `square` a^2 + b^2.
ARMANGLE_INLINE unsigned touching_bits(const Slots& excess, const Slots& square) noexcept {
    return bits(abs(excess) < Slots(tolerance::turning_back) * square);
}

/// Computes the angles phi (the middle) and alpha (half the width) of the arcs of the boundary functions of
/// joints 1, 3, 5 and 7.
ARMANGLE_INLINE PivotAngles pivot_angles(const LimitTable& t, const JointFunctions<double>& f) noexcept {
    using P = const Pivot<double>&;
    const Harmonic<Slots> U{of_pivots(f, [](P p) { return p.U.s; }), of_pivots(f, [](P p) { return p.U.c; }),
                            of_pivots(f, [](P p) { return p.U.k; })};
    const Harmonic<Slots> V{of_pivots(f, [](P p) { return p.V.s; }), of_pivots(f, [](P p) { return p.V.c; }),
                            of_pivots(f, [](P p) { return p.V.k; })};
    const Slots g = of_pivots(f, [](P p) { return p.g; }), u = g * Slots::load(t.u), v = g * Slots::load(t.v);
    const Slots a = u * U.s + v * V.s, b = u * U.c + v * V.c, c = u * U.k + v * V.k;
    const Slots square = mul_add(a, a, b * b), excess = square - c * c;
    // if a joint stands at a limit, or half a turn from it, for every psi, B is pure rounding
    const auto nought = mul_add(c, c, square) <= Slots(tolerance::rounding * tolerance::rounding);
    const Slots half = select(nought, Slots(pi), atan2(half_chord(excess), -c));
    return {atan2(a, b), half, bits(is_constant(Pivot<Slots>{U, V, g})),
            touching_bits(excess, square) | bits(nought)};
}

/// The angles for the other sign of theta_2 and theta_6: B changes its sign, so that blocked and permitted
/// psi are exchanged.
ARMANGLE_INLINE PivotAngles opposite(const PivotAngles& p) noexcept {
    const Slots turn = select(p.middle > Slots(0.0), Slots(-pi), Slots(pi));
    return {p.middle + turn, Slots(pi) - p.half, p.constant, p.touching};
}

/// Computes the blocked arcs. If the range of a joint is at most pi, each limit blocks its own arc. If it is
/// larger, only the overlap of both arcs is blocked; each arc is then cut to its part of the overlap, from
/// its own lower end on.
ARMANGLE_INLINE void pivot_arcs(const LimitTable& t, const PivotAngles& p, PivotArcs& out) noexcept {
    const ArcLanes arc = negative_arcs(p.middle, p.half);
    const Slots width = arc.upper - arc.lower, other_width = swap_halves(width),
                whole(two_pi - tolerance::angle);
    // A limit that is violated for every psi has no end and an arbitrary seam, so it cuts nothing. In an
    // overlap the other limit's arc alone decides.
    const auto cut_off = Slots::load(t.room) == Slots(0.0);
    const auto endless = (whole <= width) & (other_width < whole) & cut_off;
    const Slots overlap = room_in(arc.lower, swap_halves(arc.lower), other_width) + Slots::load(t.room);
    const Slots room = select(whole <= other_width, Slots(infinity), overlap);
    const auto cut = room < width;
    const Slots upper = select(cut, arc.lower + room, arc.upper), length = upper - arc.lower;
    arc.lower.store(out.lower);
    upper.store(out.upper);
    out.constant = p.constant;
    out.touching = p.touching & t.limited & ~p.constant;
    out.kept = bits(length >= Slots(tolerance::angle)) & t.limited & ~p.constant & ~bits(endless);
    out.cut = bits(cut);
}

/// The number get(end) of the near and far ends of a piece of joint 2 and of one of joint 6.
template <class Get>
ARMANGLE_INLINE Slots of_ends(const HingePiece& first, const HingePiece& second, const Get& get) noexcept {
    const double four[2 * hinges] = {get(first.near), get(first.far), get(second.near), get(second.far)};
    return twice(four);
}

/// One number of joint 2 and one of joint 6, each for both of its limits.
ARMANGLE_INLINE Slots of_hinges(double first, double second) noexcept {
    const double four[2 * hinges] = {first, first, second, second};
    return twice(four);
}

/// Solves the boundary functions of joints 2 and 6: a^2 + b^2 - c^2 = (max H - cos(limit)) (cos(limit) - min
/// H). Each factor is computed from 1 - cos or 1 + cos, which keeps its digits.
ARMANGLE_INLINE void solve_hinges(const LimitTable& t, const JointFunctions<double>& f,
                                  HingeArcs& out) noexcept {
    const Hinge<double>&p = f.hinge[0], &q = f.hinge[1];
    const int p_negative = p.g < 0, q_negative = q.g < 0;
    const int p_count = t.piece_count[0][p_negative], q_count = t.piece_count[1][q_negative];
    const double sides[2 * hinges] = {-1.0, 1.0, -1.0, 1.0};
    const Slots side = twice(sides), one(1.0);
    const Slots a = side * of_hinges(p.H.s, q.H.s), b = side * of_hinges(p.H.c, q.H.c);
    const Slots high_below = of_hinges(p.high.below_one, q.high.below_one),
                high_above = of_hinges(p.high.above_minus_one, q.high.above_minus_one);
    const Slots low_below = of_hinges(p.low.below_one, q.low.below_one),
                low_above = of_hinges(p.low.above_minus_one, q.low.above_minus_one);
    const Slots square = mul_add(a, a, b * b);
    out.touching = 0;
    for (int k = 0; k < p_count || k < q_count; ++k) {
        const HingePiece &first = t.piece[0][p_negative][k], &second = t.piece[1][q_negative][k];
        const Slots limit_below = of_ends(first, second, [](const HingeEnd& e) { return e.below_one; });
        const Slots limit_above = of_ends(first, second, [](const HingeEnd& e) { return e.above_minus_one; });
        const auto acute = limit_below < one;
        const Slots above = select(acute, limit_below - high_below, high_above - limit_above);
        const Slots below = select(acute, low_below - limit_below, limit_above - low_above);
        const Slots c = side * (Slots(0.5) * (above - below));
        const Slots excess = above * below;
        out.touching |= touching_bits(excess, square);
        // phi and alpha are four angles each: one vector of eight
        const Slots angle = atan2(first_halves(a, half_chord(excess)), first_halves(b, -c));
        const ArcLanes arc = negative_arcs(angle, swap_halves(angle));
        double lower[8], upper[8];
        arc.lower.store(lower);
        arc.upper.store(upper);
        for (int i = 0; i < 2 * hinges; ++i) {
            out.lower[k][i] = lower[i];
            out.upper[k][i] = upper[i];
        }
    }
}

}  // namespace detail

/// Solves the boundary functions of all limits.
ARMANGLE_INLINE void boundaries(const LimitTable& t, const JointFunctions<double>& f,
                                Boundaries& out) noexcept {
    detail::pivot_arcs(t, detail::pivot_angles(t, f), out.pivot);
    detail::solve_hinges(t, f, out.hinge);
}

}  // namespace armangle

#include "../names/end.hpp"
