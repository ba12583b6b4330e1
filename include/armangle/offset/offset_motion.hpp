// The self-motion of an offset wrist in closed form: the posture of a pose, a value of theta_7, and a branch.
//
//     theta_7 given: axis 6 is y_6, W = p - a_6 x_6, w = W - S, rho = |w|
//     theta_4 from rho (law of cosines), then in frame 4  w = (g, 0, h), g^2 + h^2 = rho^2
//     axis 5 is z_4:  z_4 . w = h,  z_4 . y_6 = 0,  |z_4| = 1
//       =>  z_4 = (h (w - t y_6) + r (w x y_6)) / (rho^2 - t^2),  t = w . y_6,  r = +-sqrt(g^2 - t^2)
//             w - t y_6 = u x_6 + v z_7,  w x y_6 = u z_7 - v x_6,  rho^2 - t^2 = u^2 + v^2
//       =>  theta_5 = atan2(-t / g, r / g)
//
// A posture needs |t| <= |g|: the line of axis 5 passes S at |g|, the plane across axis 6 at |t|. Where they
// are equal, cos theta_5 = 0, two branches meet and theta_7 turns back. Derivation:
// docs/background/other_wrists.md.
#pragma once

#include "offset_arm.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Signs of theta_2, theta_4 - delta and cos theta_5, with the index of configuration().
using OffsetBranch = Configuration<double>;

/// The branch of model angles theta (rad), which are in the order of the formulas.
inline OffsetBranch offset_branch(const OffsetArm& arm, const double* theta) noexcept {
    const auto sign = [](double angle) { return wrap(angle) < 0 ? -1.0 : 1.0; };
    return {sign(theta[1]), sign(theta[3] - arm.rest.delta_angle),
            abs(wrap(theta[4])) > half_pi ? -1.0 : 1.0};
}

/// The data of a pose and a branch; only theta_7 remains free.
template <class T = double>
struct OffsetMotion {
    Vec3<T> from_shoulder;  // p - S: of frame 6's origin
    Mat3<T> flange;
    OffsetBranch branch;
};

/// Computes the self-motion of a pose in a branch (0..7).
template <class T>
OffsetMotion<T> offset_motion(const OffsetArm& arm, const Pose<T>& pose, int gc) noexcept {
    const Pose<T> flange = flange_pose(arm, pose);
    const Vec3<T> at = mul_add(flange.rotation.z, T(-arm.rest.d_wf), flange.position);
    return {at - spread<T>(Vec3<double>{0, 0, arm.rest.d_bs}), flange.rotation, configuration(gc)};
}

namespace detail {

/// Converts a vector of the pose to the scalar type of theta_7.
template <class T, class U>
Vec3<T> in_scalar(const Vec3<U>& v) noexcept {
    if constexpr (std::is_same_v<T, U>)
        return v;
    else
        return spread<T>(v);
}

}  // namespace detail

/// The wrist and elbow at one theta_7; they show whether a solution exists.
template <class T>
struct OffsetWrist {
    Vec3<T> x6, y6, w;
    T length;           // rho, m
    SinCos<T> theta_4;  // means nothing out of reach
    T g, h, t;          // m
    T u, v;             // m: of w along x_6 and z_7, across y_6
    T inside;           // m^2: g^2 - t^2, negative where no posture is
    T excess;           // m beyond the reach, or inside the inner reach
};

/// Computes the wrist and elbow at a theta_7 (sine and cosine). There is no solution if `excess` is positive
/// or `inside` negative.
template <class T, class U>
OffsetWrist<T> offset_wrist(const OffsetArm& arm, const OffsetMotion<U>& m,
                            const SinCos<T>& theta_7) noexcept {
    const Arm& rest = arm.rest;
    const Vec3<T> x7 = detail::in_scalar<T>(m.flange.x), y7 = detail::in_scalar<T>(m.flange.y);
    const Vec3<T> s = detail::in_scalar<T>(m.from_shoulder);
    OffsetWrist<T> out;
    out.x6 = combine(x7, theta_7.cos, y7, -theta_7.sin);
    out.y6 = combine(x7, theta_7.sin, y7, theta_7.cos);
    out.w = mul_add(out.x6, T(-arm.a_6), s);
    const T along = dot(x7, s) * theta_7.cos - dot(y7, s) * theta_7.sin;  // s . x_6: one sine of theta_7
    const U fixed = dot(m.from_shoulder, m.from_shoulder) + U(arm.a_6 * arm.a_6);
    out.length = sqrt(T(fixed) - T(2.0 * arm.a_6) * along);
    const Triangle<T> triangle_now = triangle(rest, out.length);
    out.excess = triangle_now.excess;
    const T bend = T(m.branch.elbow) * triangle_now.eta.sin;
    out.theta_4 = {T(rest.delta.sin) * triangle_now.eta.cos + T(rest.delta.cos) * bend,
                   T(rest.delta.cos) * triangle_now.eta.cos - T(rest.delta.sin) * bend};
    const auto& [s4, c4] = out.theta_4;
    out.g = T(rest.a_3) * c4 + T(rest.d_se) * s4 + T(rest.a_4);
    out.h = T(rest.d_se) * c4 - T(rest.a_3) * s4 + T(rest.d_ew);
    out.t = dot(x7, s) * theta_7.sin + dot(y7, s) * theta_7.cos;  // x_6 is across y_6: s . y_6
    out.u = along - T(arm.a_6);
    out.v = dot(detail::in_scalar<T>(m.flange.z), s);
    out.inside = (out.g - out.t) * (out.g + out.t);
    return out;
}

/// Moves a wrist with |t| > |g| to the posture with cos theta_5 = 0, from |g| = |t|, and returns by how much
/// (m) its upper arm has another length than the arm's. Near a stretched elbow, where a rounding of the
/// distance bends the elbow by 1e-7 rad, that is negligible.
inline double take_fold(const OffsetArm& arm, OffsetWrist<double>& wrist) noexcept {
    const Arm& rest = arm.rest;
    wrist.g = copysign(wrist.t, wrist.g);
    wrist.h = copysign(hypot(wrist.u, wrist.v), wrist.h);
    wrist.inside = 0.0;
    const double across = wrist.g - rest.a_4, along = wrist.h - rest.d_ew, length = hypot(across, along);
    const double y = rest.d_se * across - rest.a_3 * along, x = rest.a_3 * across + rest.d_se * along;
    wrist.theta_4 = {y / (rest.upper_arm * length), x / (rest.upper_arm * length)};
    return abs(length - rest.upper_arm);
}

/// Sine and cosine of theta_5 if g is not 0; `root` is sqrt(g^2 - t^2).
template <class T, class U>
SinCos<T> theta_5_of(const OffsetMotion<U>& m, const OffsetWrist<T>& wrist, const T& root) noexcept {
    const T side = select(wrist.g < T(0.0), T(-1.0), T(1.0)), size = T(1.0) / abs(wrist.g);
    return {-(side * wrist.t) * size, T(m.branch.wrist) * root * size};
}

/// The direction z_4 of axis 5; r = g cos theta_5.
template <class T>
Vec3<T> axis_5(const OffsetWrist<T>& wrist, const Vec3<T>& z7, const T& r) noexcept {
    const T scale = T(1.0) / (wrist.u * wrist.u + wrist.v * wrist.v);
    return combine(wrist.x6, (wrist.h * wrist.u - r * wrist.v) * scale, z7,
                   (wrist.h * wrist.v + r * wrist.u) * scale);
}

/// The directions of all joints if a solution with this theta_5 exists: r = g cos theta_5.
template <class T, class U>
Directions<T> directions(const OffsetMotion<U>& m, const OffsetWrist<T>& wrist, const SinCos<T>& theta_7,
                         const SinCos<T>& theta_5, const T& r) noexcept {
    const auto& [s4, c4] = wrist.theta_4;
    const Vec3<T> z7 = detail::in_scalar<T>(m.flange.z), z4 = axis_5(wrist, z7, r);
    const Vec3<T> forward = cross(z4, wrist.y6);  // y_6 = -s_5 x_4 + c_5 y_4
    const Vec3<T> x4 = combine(wrist.y6, -theta_5.sin, forward, -theta_5.cos);
    const Vec3<T> y4 = combine(wrist.y6, theta_5.cos, forward, -theta_5.sin);
    Frames<T> f;
    f.x3 = combine(x4, c4, z4, -s4);
    f.y3 = combine(x4, s4, z4, c4);
    f.z3 = -y4;
    Directions<T> d;
    const T h2 = hypot(f.y3.x, f.y3.y), shoulder = T(m.branch.shoulder);
    const auto flat_2 = h2 == T(0.0);
    put_shoulder(
        f, SinCos<T>{select(flat_2, T(0.0), shoulder * f.y3.y), select(flat_2, T(1.0), shoulder * f.y3.x)},
        shoulder * h2, d);
    d.y[3] = s4;
    d.x[3] = c4;
    d.y[4] = theta_5.sin;
    d.x[4] = theta_5.cos;
    d.y[5] = -dot(z4, wrist.x6);
    d.x[5] = dot(z4, z7);
    d.y[6] = theta_7.sin;
    d.x[6] = theta_7.cos;
    d.y[7] = T(0.0);
    d.x[7] = T(1.0);
    return d;
}

/// The directions of all joints of a solution, with `root` = sqrt(g^2 - t^2); its sign is that of the branch.
template <class T, class U>
Directions<T> directions(const OffsetMotion<U>& m, const OffsetWrist<T>& wrist, const SinCos<T>& theta_7,
                         const T& root) noexcept {
    const T side = select(wrist.g < T(0.0), T(-1.0), T(1.0));
    return directions(m, wrist, theta_7, theta_5_of(m, wrist, root), side * T(m.branch.wrist) * root);
}

}  // namespace armangle

#include "../names/end.hpp"
