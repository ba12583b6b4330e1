// The reference half-plane, psi = 0: the virtual arm with theta_3 = 0. Eq. (5)-(8).
//
// Another meaning of psi is another function of this shape in a file beside this one: it returns a unit
// vector orthogonal to the axis w, and everything above it follows.
#pragma once

#include "../arm/arm.hpp"

namespace armangle {

/// Axis z_3 of the virtual arm: the normal of the reference half-plane; p = S->W (m), w = p / |p|.
/// z = (p_y, -p_x, 0) / r; where the wrist lies on the base axis (eq. (5), second case) theta_1 = 0 of the
/// convention.
template <class T>
ARMANGLE_INLINE Vec3<T> reference_normal(const Arm& arm, const Vec3<T>& p, const Vec3<T>& w) noexcept {
    const T r = hypot(p.x, p.y);
    // Close to the shoulder the distance alone cannot tell: the direction must also be within 30 degrees of
    // the axis.
    const auto above = w.x * w.x + w.y * w.y <= T(0.25);
    const auto on_axis = above & (r <= T(tolerance::reference * arm.reach));
    const T k = T(1.0) / select(on_axis, T(1.0), r);
    const Vec3<T> regular{p.y * k, -(p.x * k), T(0.0)};
    if (!any(on_axis)) return regular;
    const T m = T(1.0) / sqrt(select(on_axis, T(1.0) - w.y * w.y, T(1.0)));
    const Vec3<T> convention{w.x * w.y * m, (w.y * w.y - T(1.0)) * m, w.z * w.y * m};
    return select(on_axis, convention, regular);
}

}  // namespace armangle
