// Each limit as a boundary function B(psi) = a sin + b cos + c, and the arc on which it is not negative. Eq. (32), (35).
//
//   pivot  g (U cos L - V sin L) >= 0 at the lower limit, <= 0 at the upper: the cone from one to the other;
//   hinge  cos(near) - H >= 0 and H - cos(far) >= 0, near and far being the limits of |theta|.
// {B >= 0} is one arc, [phi - alpha, phi + alpha] with phi = atan2(a, b), alpha = acos(-c / hypot(a, b)).
#pragma once

#include "joint_function.hpp"
#include "limit_table.hpp"

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

}  // namespace armangle
