// The redundancy circle of a pose: its axis, its zero, and the tool axes relative to it. Eq. (3), (12)-(15),
// (20).
//
// The orthonormal triad is (w, e, z): w along shoulder-wrist, z the normal of the reference half-plane, e = w
// x z. In it the paper's matrices need no product: the columns of 0R3(psi) = A_s sin + B_s cos + C_s are
//   x_3 = w sin(beta) + f cos(beta),  y_3 = w cos(beta) - f sin(beta),  z_3 = z cos(psi) + e sin(psi),
// with f = e cos(psi) - z sin(psi). The entries of 4R7(psi) follow with gamma = beta + theta_4 and the tool
// axes in triad coordinates.
#pragma once

#include "elbow.hpp"
#include "reference_plane.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The axis S->W and the zero of psi on the circle around it, in the base frame.
template <class T>
struct Triad {
    Vec3<T> w, e, z;
    T distance;      // |S-W| in m
    double nearest;  // m: if the wrist is closer to the shoulder than this, no axis exists
};

/// A triad that has the same numbers in every lane.
template <class T>
ARMANGLE_INLINE Triad<T> spread(const Triad<double>& on) noexcept {
    return {spread<T>(on.w), spread<T>(on.e), spread<T>(on.z), T(on.distance), on.nearest};
}

/// Computes the triad of a flange pose 0T7 (without base and tool), in the frame of the DH rows. normal(p, w)
/// returns the zero of psi as a unit vector; p = S->W (m), w = p / |p|, or 0 if p is 0.
template <class T, class Normal>
ARMANGLE_INLINE Triad<T> triad(const Arm& arm, const Pose<T>& flange, const Normal& normal) noexcept {
    const Vec3<T> p =
        flange.position - Vec3<T>{T(0.0), T(0.0), T(arm.d_bs)} - flange.rotation.z * T(arm.d_wf);  // eq. (3)
    Triad<T> t;
    t.distance = norm(p);
    t.nearest = tolerance::folded * arm.reach;
    t.w = p * (T(1.0) / select(t.distance == T(0.0), T(1.0), t.distance));
    t.z = normal(p, t.w);
    t.e = cross(t.w, t.z);
    return t;
}

namespace detail {

/// Computes the triad of a flange pose 0T7 for the two rarer definitions of psi. Not inlined, and with the
/// flange by value, so that the common path can keep it in registers.
template <class T>
ARMANGLE_SELDOM Triad<T> other_triad(const Arm& arm, Pose<T> flange) noexcept {
    return triad(arm, flange,
                 [&arm](const Vec3<T>& p, const Vec3<T>& w) noexcept { return reference_normal(arm, p, w); });
}

}  // namespace detail

/// The triad of a flange pose 0T7 for the arm's own definition of psi.
template <class T>
ARMANGLE_INLINE Triad<T> triad(const Arm& arm, const Pose<T>& flange) noexcept {
    if (arm.reference != Reference::base) [[unlikely]]
        return detail::other_triad(arm, flange);
    return triad(arm, flange, [&arm](const Vec3<T>& p, const Vec3<T>& w) noexcept {
        return detail::normal_about_z(arm, p, w);
    });
}

/// The circle: its triad, the tool axes in it (w.x_7, w.y_7, w.z_7; the same for e and z), and the triangle
/// S-E-W.
template <class T>
struct Circle : Triad<T> {
    Vec3<T> tool_w, tool_e, tool_z;
    Triangle<T> triangle;
};

/// Computes the circle of a flange pose 0T7 on a given triad.
template <class T>
ARMANGLE_INLINE Circle<T> circle_on(const Arm& arm, const Triad<T>& triad, const Pose<T>& flange) noexcept {
    const auto& [x7, y7, z7] = flange.rotation;
    Circle<T> c;
    static_cast<Triad<T>&>(c) = triad;
    c.tool_w = {dot(c.w, x7), dot(c.w, y7), dot(c.w, z7)};
    c.tool_e = {dot(c.e, x7), dot(c.e, y7), dot(c.e, z7)};
    c.tool_z = {dot(c.z, x7), dot(c.z, y7), dot(c.z, z7)};
    c.triangle = triangle(arm, c.distance);
    return c;
}

/// Computes the circle of a flange pose 0T7 for the arm's own definition of psi.
template <class T>
ARMANGLE_INLINE Circle<T> circle(const Arm& arm, const Pose<T>& flange) noexcept {
    return circle_on(arm, triad(arm, flange), flange);
}

/// Whether the wrist coincides with the shoulder, so that no axis and no psi exist.
template <class T>
ARMANGLE_INLINE auto is_folded(const Triad<T>& c) noexcept {
    return c.distance <= T(c.nearest);
}

/// Whether the wrist is too far from the shoulder or too close to it.
template <class T>
ARMANGLE_INLINE auto is_unreachable(const Circle<T>& c) noexcept {
    return !(c.triangle.excess <= T(c.triangle.rounding));
}

/// The arm angle psi (rad, in (-pi, pi]) of a configuration whose elbow axis is z_3 (unit vector, frame of
/// the DH rows).
inline double arm_angle(const Triad<double>& c, const Vec3<double>& z3) noexcept {
    const double psi = atan2(dot(c.e, z3), dot(c.z, z3));  // w . (z x z3) = z3 . (w x z)
    return psi <= -pi ? pi : psi;
}

}  // namespace armangle

#include "../names/end.hpp"
