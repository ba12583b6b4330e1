// The reference half-plane, psi = 0. Eq. (5)-(8).
//
// Each definition of psi is a function of the wrist p = S->W (m) and its direction w = p / |p|. It returns a
// unit vector orthogonal to w, the elbow axis z_3 at psi = 0. All other formulas follow from it.
//
//   base            the virtual arm with theta_3 = 0: the plane through the axis of joint 1. Singular if the
//                   wrist lies on that axis, on either side of the shoulder.
//   vector          the plane through a vector given by the user; singular along it, on either side.
//   stereographic   the normal for a wrist above the shoulder, carried to w by the shortest rotation.
//                   Singular only if the wrist is straight below. Elias and Wen (2024), stereographic SEW
//                   angle.
#pragma once

#include "../arm/arm.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Whether the wrist lies on the z axis up to the tolerance; r: its distance from that axis (m). The
/// direction w must also be within 30 degrees of the axis, since near the shoulder the distance says little.
template <class T>
ARMANGLE_INLINE auto is_on_axis(const Arm& arm, const Vec3<T>& w, const T& r) noexcept {
    const auto above = w.x * w.x + w.y * w.y <= T(0.25);
    return above & (r <= T(tolerance::reference * arm.reach));
}

/// The normal by convention (theta_1 = 0) for a wrist on the z axis: the negative y axis, made orthogonal to
/// w; m = 1 / sqrt(1 - w_y^2).
template <class T>
ARMANGLE_INLINE Vec3<T> convention_normal(const Vec3<T>& w, const T& m) noexcept {
    return {w.x * w.y * m, (w.y * w.y - T(1.0)) * m, w.z * w.y * m};
}

/// z = (p_y, -p_x, 0) / r, the normal of the plane through w and the z axis. If the wrist lies on that axis
/// (eq. (5), second case), the convention theta_1 = 0 defines the normal.
template <class T>
ARMANGLE_INLINE Vec3<T> normal_about_z(const Arm& arm, const Vec3<T>& p, const Vec3<T>& w) noexcept {
    const T r = hypot(p.x, p.y);
    const auto on_axis = is_on_axis(arm, w, r);
    const T k = T(1.0) / select(on_axis, T(1.0), r);
    const Vec3<T> regular{p.y * k, -(p.x * k), T(0.0)};
    if (!any(on_axis)) return regular;
    const T m = T(1.0) / sqrt(select(on_axis, T(1.0) - w.y * w.y, T(1.0)));
    return select(on_axis, convention_normal(w, m), regular);
}

/// The unit normal of the plane through w and the arm's reference vector, where psi is 0.
template <class T>
ARMANGLE_INLINE Vec3<T> normal_about_vector(const Arm& arm, const Vec3<T>& p, const Vec3<T>& w) noexcept {
    const auto& [x, y, z] = arm.reference_frame;
    const Mat3<T> frame{spread<T>(x), spread<T>(y), spread<T>(z)};
    return frame * normal_about_z(arm, transposed_times(frame, p), transposed_times(frame, w));
}

/// Carries the vector `side`, orthogonal to a pole, to w by the shortest rotation from the pole to w. `image`
/// is the stereographic image of w, (w + pole) / (1 + w . pole); `share` is w . side.
template <class T>
ARMANGLE_INLINE Vec3<T> carried(const Vec3<T>& side, const Vec3<T>& image, const T& share) noexcept {
    return side - image * share;
}

/// The normal for Reference::stereographic: -y carried from z to w by the shortest rotation. Its image is
/// (w_x k, w_y k, 1) with k = 1 / (1 + w_z), or below the shoulder (1 - w_z) / (w_x^2 + w_y^2), which loses
/// no digits there. Straight below the shoulder the convention theta_1 = 0 holds.
template <class T>
ARMANGLE_INLINE Vec3<T> stereographic_normal(const Arm& arm, const Vec3<T>& p, const Vec3<T>& w) noexcept {
    const T one(1.0), across = w.x * w.x + w.y * w.y;
    const auto below = w.z < T(0.0);
    const auto lost = below & is_on_axis(arm, w, hypot(p.x, p.y));
    const T k = select(below, one - w.z, one) / select(below, select(lost, one, across), one + w.z);
    const Vec3<T> regular = carried({T(0.0), -one, T(0.0)}, {w.x * k, w.y * k, one}, -w.y);
    if (!any(lost)) return regular;
    const T m = one / sqrt(select(lost, one - w.y * w.y, one));
    return select(lost, convention_normal(w, m), regular);
}

}  // namespace detail

/// Axis z_3 of the elbow at psi = 0: the normal of the reference half-plane; p = S->W (m), w = p / |p|.
template <class T>
ARMANGLE_INLINE Vec3<T> reference_normal(const Arm& arm, const Vec3<T>& p, const Vec3<T>& w) noexcept {
    switch (arm.reference) {
        case Reference::vector: return detail::normal_about_vector(arm, p, w);
        case Reference::stereographic: return detail::stereographic_normal(arm, p, w);
        case Reference::base: break;
    }
    return detail::normal_about_z(arm, p, w);
}

/// Whether psi jumps at the wrist's direction w, so that the convention defines it; n = |S-W| in m.
template <class T>
ARMANGLE_INLINE auto is_reference_lost(const Arm& arm, const Vec3<T>& w, const T& n) noexcept {
    const auto over = [&](const Vec3<T>& v) { return detail::is_on_axis(arm, v, n * hypot(v.x, v.y)); };
    if (arm.reference == Reference::base) return over(w);
    if (arm.reference == Reference::stereographic) return over(w) & (w.z < T(0.0));
    const auto& [x, y, z] = arm.reference_frame;
    return over(transposed_times(Mat3<T>{spread<T>(x), spread<T>(y), spread<T>(z)}, w));
}

/// The vector k (1/m) such that k . dp is the rotation of the reference half-plane around w for a wrist
/// motion dp. z is its normal and n = |S-W| in m. Around an axis at the angle alpha to w the azimuth grows by
/// -z . dp / (n sin(alpha)), and its part along w is cos(alpha) times that. For a carried normal the azimuth
/// itself is subtracted.
template <class T>
ARMANGLE_INLINE Vec3<T> reference_turn(const Arm& arm, const Vec3<T>& w, const Vec3<T>& z,
                                       const T& n) noexcept {
    const T one(1.0);
    if (arm.reference == Reference::stereographic) [[unlikely]] {
        const T across = mul_add(w.x, w.x, w.y * w.y);
        const auto below = w.z < T(0.0);
        const T k = select(below, one - w.z, one) / (n * select(below, across, one + w.z));
        return {w.y * k, -(w.x * k), T(0.0)};
    }
    const Vec3<T> axis =
        arm.reference == Reference::base ? Vec3<T>{T(0.0), T(0.0), one} : spread<T>(arm.reference_frame.z);
    return z * (-dot(w, axis) / (n * norm(cross(axis, w))));
}

}  // namespace armangle

#include "../names/end.hpp"
