// What turns about a line by psi, against what stands: the arcs that are closed forms.
//
// Coordinates: x along the line, the circle's (y, z) across it; psi adds to the azimuth atan2(z, y).
//
// clang-format off
//        z|    o p(psi)            least distance of p's circle from q:  h = hypot(g, rho_p - rho_q)
//         |   /                    greatest:                             H = hypot(g, rho_p + rho_q)
//         |  / rho_p     x q       g: how far apart the two are along the line
//         | /           rho_q
//      ---+-------------- y        d^2 = h^2 + (H^2 - h^2) sin^2((psi - centre) / 2)
// clang-format on
//
// Each function says which psi are blocked: an arc about a centre, so wide on both sides. No arccosine, and
// no difference of nearly equal numbers at a tangency.
#pragma once

#include "solids.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// An arc of arm angles that an obstacle blocks: |psi - centre| < half (rad). Half width 0 blocks nothing, pi
/// the whole circle.
struct BlockedArc {
    double centre, half;
};

inline constexpr BlockedArc blocks_nothing{0.0, 0.0}, blocks_all{0.0, pi};

/// Distance (m) of a point from the axis shoulder-wrist, which is the x axis.
template <class T>
ARMANGLE_INLINE T off_axis(const Vec3<T>& p) noexcept {
    return hypot(p.y, p.z);
}

/// Rotates a point by psi around the axis shoulder-wrist, which is the x axis.
inline Vec3<double> turned_by(const Vec3<double>& p, const SinCos<double>& psi) noexcept {
    return {p.x, p.y * psi.cos - p.z * psi.sin, p.y * psi.sin + p.z * psi.cos};
}

/// The angle (rad) around the x axis from point p to point q, in (-pi, pi].
inline double azimuth_between(const Vec3<double>& p, const Vec3<double>& q) noexcept {
    return atan2(p.y * q.z - p.z * q.y, p.y * q.y + p.z * q.z);
}

/// The arm angles at which point p, rotated by psi around the x axis, is nearer than R (m) to the fixed point
/// q.
inline BlockedArc point_point(const Vec3<double>& p, const Vec3<double>& q, double R) noexcept {
    const double rho_p = off_axis(p), rho_q = off_axis(q), g = p.x - q.x;
    const double h = hypot(g, rho_p - rho_q), H = hypot(g, rho_p + rho_q);
    if (R <= h) return blocks_nothing;
    if (R > H) return blocks_all;
    return {azimuth_between(p, q), 2.0 * atan2(sqrt((R - h) * (R + h)), sqrt((H - R) * (H + R)))};
}

/// The arm angles at which point p, rotated by psi around the x axis, lies below the plane normal . x =
/// limit.
inline BlockedArc point_plane(const Vec3<double>& p, const Vec3<double>& normal, double limit) noexcept {
    const double swing = off_axis(p) * off_axis(normal), k = limit - normal.x * p.x;
    if (k <= -swing) return blocks_nothing;
    if (k > swing) return blocks_all;
    return {azimuth_between(p, normal) + pi, 2.0 * atan2(sqrt(swing + k), sqrt(swing - k))};
}

/// A segment in the plane of the line and the direction of azimuth 90 degrees, on one side of the line:
/// points (w, r), r >= 0. `opposite` where it lies on the other side and was mirrored.
///
/// With x = rho_q cos(psi - azimuth of q + 90 degrees), how far q is from the line along the plane at psi,
/// the squared distance of a point is (w - q_w)^2 + r^2 + rho_q^2 - 2 r x: it falls as x grows, for all
/// points of the segment. So what is blocked is x above one threshold, and that is one arc.
struct PlanarRod {
    double w, r, along_w, along_r;  // one end, and the unit direction to the other
    double length;
    bool opposite;
};

/// Whether a ball of radius R with its centre at q_w along the axis and rho off it meets the segment at some
/// psi. The answer is exact: some psi brings the centre into the half-plane of the segment.
template <class T>
ARMANGLE_INLINE auto meets_planar(const PlanarRod& rod, const T& q_w, const T& rho, const T& R) noexcept {
    const T g = q_w - T(rod.w), across = rho - T(rod.r);
    const T along = mul_add(g, T(rod.along_w), across * T(rod.along_r));
    const T foot = min(max(along, T(0.0)), T(rod.length));
    const T x = g - foot * T(rod.along_w), y = across - foot * T(rod.along_r);
    return mul_add(x, x, y * y) < R * R;
}

/// A point counts as on the axis if its distance from it is below this share of its coordinate along it.
inline constexpr double planar_rounding = 2e-15;

/// The threshold of x (see PlanarRod) above which a segment is nearer than R to points at q_w along the axis
/// and rho off it. It is -infinity if they are always nearer, and infinity if they never are.
template <class T>
ARMANGLE_INLINE T planar_threshold(const PlanarRod& rod, const T& q_w, const T& rho, const T& R) noexcept {
    const T zero(0.0), never(infinity), always(-infinity);
    const T fixed = mul_add(rho, rho, -(R * R));
    const auto of_end = [&](double w, double r) {
        const T g = q_w - T(w), numerator = mul_add(g, g, fixed + T(r * r));
        if (r > 0) return numerator / T(2.0 * r);
        return select(numerator < zero, always, never);
    };
    const double far_r = max(rod.r + rod.length * rod.along_r, 0.0);
    const T ends = min(of_end(rod.w, rod.r), of_end(rod.w + rod.length * rod.along_w, far_r));
    // within: A x^2 + 2 B x + C is R^2 less the squared distance from the line through the segment
    const T g = q_w - T(rod.w), m = g * T(rod.along_w) - T(rod.r * rod.along_r);
    const double A = rod.along_r * rod.along_r;
    const T B = T(rod.along_w) * (T(rod.r * rod.along_w) + g * T(rod.along_r));
    const T C = mul_add(m, m, -(mul_add(g, g, fixed + T(rod.r * rod.r))));
    const T inner = mul_add(B, B, -(T(A) * C)), root = sqrt(max(inner, zero));
    const auto level = (B == zero) & (T(A) == zero);  // along the line, on it: the distance is constant
    const T steep = (root - B) / T(A == 0 ? 1.0 : A), flat = -C / select(B + root == zero, T(1.0), B + root);
    const T x = select(level, select(C > zero, always, never), select(B > zero, flat, steep));
    const T at = select(level, m, mul_add(x, T(rod.along_r), m));
    const auto inside = (at >= zero) & (at <= T(rod.length)) & (level | (inner >= zero));
    return min(ends, select(inside, x, never));
}

/// The blocked arc of a threshold from planar_threshold, for a ball with centre q at distance rho from the
/// axis.
inline BlockedArc planar_arc(const PlanarRod& rod, const Vec3<double>& q, double rho,
                             double threshold) noexcept {
    if (threshold >= rho) return blocks_nothing;
    if (threshold < -rho) return blocks_all;
    return {atan2(q.z, q.y) + (rod.opposite ? half_pi : -half_pi),
            2.0 * atan2(sqrt(rho - threshold), sqrt(rho + threshold))};
}

/// Splits a segment in the plane y = 0 where it crosses the x axis, about which psi turns it, and returns the
/// number of pieces, 1 or 2. An end that is off the axis by rounding alone is moved onto it.
inline int planar_rods(Vec3<double> a, Vec3<double> b, PlanarRod (&out)[2]) noexcept {
    if (abs(a.z) < planar_rounding * abs(a.x)) a.z = 0;
    if (abs(b.z) < planar_rounding * abs(b.x)) b.z = 0;
    const auto piece = [](double w, double r, double to_w, double to_r, bool opposite) {
        const double length = hypot(to_w - w, to_r - r);
        const double sign = opposite ? -1.0 : 1.0, per = length > 0 ? 1.0 / length : 0.0;
        return PlanarRod{w, sign * r, (to_w - w) * per, sign * (to_r - r) * per, length, opposite};
    };
    if (a.z * b.z < 0) {  // across the line
        const double w = a.x + (b.x - a.x) * (a.z / (a.z - b.z));
        out[0] = piece(a.x, a.z, w, 0.0, a.z < 0);
        out[1] = piece(w, 0.0, b.x, b.z, b.z < 0);
        return 2;
    }
    out[0] = piece(a.x, a.z, b.x, b.z, a.z < 0 || b.z < 0);
    return 1;
}

}  // namespace armangle

#include "../names/end.hpp"
