// Joint values over boxes of psi, eight boxes at a time: value, rate and second derivative at each middle,
// and bounds of the motion within the box.
//
//        theta(m) +- travel      theta is inside the band over the whole box; the band's width shrinks with
//   ____/~~~~~~~~~~~~~~\____     r^2 about the tangent, so bounds made from it are of second order.
//       m-r     m     m+r
//
// D = sin^2(theta_2) = 1 - H^2 (theta_6 on the wrist's side), N are the numerators of eq. (29). Pivot: theta'
// = N / D, theta'' = (N' - theta' D') / D. Hinge: theta' = -H' / h, theta'' = -(H'' + H theta'^2) / h, h =
// sqrt(D). Source: eq. (28), (33) and their derivatives. H and N are harmonic: over a box f moves by at most
// |f'(m)| r + |f(m) - k| r^2 / 2.
#pragma once

#include "../circle/joint_function.hpp"
#include "../numbers/enclosure.hpp"

#include "../names/begin.hpp"

namespace armangle {

using Boxes = Lane<8>;

/// One joint over eight boxes of psi, in theta of the branch with positive theta_2 and theta_6.
struct JointBoxes {
    Boxes theta;                    // at the middles
    Enclosure<Boxes> rate, second;  // theta', theta'' per rad of psi
    Boxes travel;                   // theta stays within theta +- travel; infinite if it may jump
};

/// The three joints on one side of the elbow.
struct SideBoxes {
    JointBoxes joint[3];
    Boxes noise;       // of the pivots' theta: U and V are rounded sums of numbers of size one
    unsigned regular;  // one bit a box over which the hinge stays away from 0 and pi
};

namespace detail {

/// A harmonic with the same coefficients in every lane.
ARMANGLE_INLINE Harmonic<Boxes> spread(const Harmonic<double>& f) noexcept {
    return {Boxes(f.s), Boxes(f.c), Boxes(f.k)};
}

/// A harmonic and its slope over boxes of half width r.
struct HarmonicBoxes {
    Enclosure<Boxes> value, slope;
};

/// Bounds a harmonic over boxes with middles `at` and half widths r (rad).
ARMANGLE_INLINE HarmonicBoxes over(const Harmonic<double>& harmonic, const SinCos<Boxes>& at,
                                   const Boxes& r) noexcept {
    const Harmonic<Boxes> f = spread(harmonic);
    const Boxes slope = f.slope(at), swing = mul_add(f.s, at.sin, f.c * at.cos), half = Boxes(0.5) * r * r;
    return {{swing + f.k, abs(slope) * r + abs(swing) * half}, {slope, abs(swing) * r + abs(slope) * half}};
}

/// The half width (rad) of the band around theta(m) in which the joint stays over a box: the part of the
/// tangent plus that of the curvature.
ARMANGLE_INLINE Boxes travel(const JointBoxes& j, const Boxes& r) noexcept {
    return abs(j.rate.middle) * r + Boxes(0.5) * j.second.largest() * r * r;
}

}  // namespace detail

/// Bounds joints 1-3 (side 0) or 5-7 (side 1) over boxes with middles `at` and half widths r (rad).
inline SideBoxes side_boxes(const JointFunctions<double>& f, int side, const SinCos<Boxes>& at,
                            const Boxes& r) noexcept {
    const Pivot<double>&first = f.pivot[2 * side], &last = f.pivot[2 * side + 1];
    const Hinge<double>& hinge = f.hinge[side];
    const Boxes zero(0.0);
    const auto value = [&at](const Harmonic<double>& h) { return detail::spread(h).at(at); };
    const Boxes u = value(first.U), v = value(first.V), sine = hypot(u, v), swing(hinge.swing);
    const detail::HarmonicBoxes H = detail::over(hinge.H, at, r);
    const Boxes moved = min(swing * r, Boxes(pi));  // |theta'| of a hinge is at most its swing
    const Enclosure<Boxes> h{sine, moved};
    const Enclosure<Boxes> D{sine * sine, min(moved * (Boxes(2.0) * sine + moved), square(H.value).radius)};
    const auto regular = (zero < h.lower()) & (zero < D.lower());
    const Enclosure<Boxes> per_D = reciprocal(D), per_h = reciprocal(h);
    const Enclosure<Boxes> D_slope = H.value * H.slope * Boxes(-2.0);
    SideBoxes out;
    out.noise = Boxes(tolerance::rounding) / max(sine, Boxes(tolerance::rounding));
    out.regular = bits(regular);
    const auto pivot = [&](const Pivot<double>& p, const Boxes& theta, JointBoxes& j) {
        const detail::HarmonicBoxes N = detail::over(slope_numerator(p), at, r);
        j.theta = theta;
        j.rate = N.value * per_D;
        j.second = (N.slope - j.rate * D_slope) * per_D;
        j.travel = select(regular, detail::travel(j, r), Boxes(infinity));
    };
    pivot(first, atan2(u, v), out.joint[0]);
    pivot(last, atan2(value(last.U), value(last.V)), out.joint[2]);
    JointBoxes& bend = out.joint[1];
    const Enclosure<Boxes> H_second{Boxes(hinge.H.k) - H.value.middle, H.value.radius};
    bend.theta = atan2(sine, H.value.middle);
    bend.rate = H.slope * per_h * Boxes(-1.0);
    bend.second = (H_second + H.value * square(bend.rate)) * per_h * Boxes(-1.0);
    bend.travel = select(regular, min(detail::travel(bend, r), moved), moved);
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
