// Derivatives of forward and inverse: joints by pose and arm angle, arm angle by joints.
//
// A pose moves with a twist (v, omega): v of the end effector's origin (m), omega (rad), in the user's frame,
// like the rows of the Jacobian. With the Jacobian J and the gradient g of psi
//
//     [J; g] dq = (v, omega, dpsi),   so that   dq/d(v, omega, psi) = [J; g]^-1,
//
// which needs no matrix inversion. Let u be the velocity of the wrist, n = |S-W| and w the direction of S-W.
// The triangle S-E-W changes with n' = w . u alone, and its plane turns with
//
//     w x u / n + (psi' + k . u) w,       k: turn of the reference half-plane (reference_plane.hpp).
//
// Frame 3 adds the change of beta (elbow.hpp), frame 4 that of gamma = beta + theta_4. Joints 1 to 3 produce
// the angular velocity of frame 3; joints 5 to 7 produce the difference between the tool's and frame 4's. The
// gradient of psi is that of eq. (11), on Dual numbers. Both derivatives agree to rounding
// (tests/laws/test_derivatives.py).
#pragma once

#include "../arm/jacobian.hpp"
#include "../numbers/dual.hpp"
#include "inverse.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Joint velocities of a joint configuration per velocity of its pose, in the base frame of the DH rows.
template <class T>
struct Rates {
    using Mask = decltype(T(0.0) < T(0.0));

    Vec3<T> part[joints];  // theta_i' = part . angular velocity of joints 1-3 (5-7), rad/s of rad/s; not for
                           // 4
    Vec3<T> w, turn;       // S-W; k: turn of psi = 0 about w per metre of wrist motion
    Vec3<T> lean_3, lean_4;  // turn of frames 3 and 4 in the plane S-E-W per metre of n
    T bend;                  // change of theta_4 per metre of n
    T inverse_distance;      // 1 / n
    Vec3<T> lever;           // m, from the end effector's origin to the wrist
    // Whether derivatives exist. Shoulder and wrist: of joints 1-3 and of 5-7 at all. Elbow (neither
    // stretched nor folded): of any joint by the pose. Plane (psi does not jump): of any joint but 4 by the
    // pose.
    Mask shoulder, wrist, elbow, plane;
};

/// The gradient of a number with respect to the twist (v, omega) of a pose and with respect to psi.
template <class T>
struct Pull {
    Vec3<T> linear, angular;
    T psi;
};

/// Writes a gradient to a row: by the linear velocity (3), by the angular velocity (3), by psi.
template <class T>
ARMANGLE_INLINE void store_pull(const Pull<T>& p, T (&row)[joints]) noexcept {
    const T all[joints] = {p.linear.x, p.linear.y, p.linear.z, p.angular.x, p.angular.y, p.angular.z, p.psi};
    for (int k = 0; k < joints; ++k) row[k] = all[k];
}

/// Computes the rates of the configuration at psi, for a flange pose 0T7 and its self-motion. Derivatives
/// that do not exist are 0.
template <class T>
ARMANGLE_INLINE Rates<T> rates(const Arm& arm, const Pose<T>& flange, const SelfMotion<T>& m,
                               const SinCos<T>& psi) noexcept {
    const T zero(0.0), one(1.0);
    const Circle<T>& c = m.circle;
    const Frames<T> f = frames(m, psi);
    Rates<T> r;
    const auto ratio = [&](const auto& exists, const T& above, const T& below) {
        return select(exists, above / select(exists, below, one), zero);
    };
    // joints 1-3 split an angular velocity along axis 1, axis 2 and y_3, the axis of joint 3
    const T sin_2 = m.gc.shoulder * hypot(f.y3.x, f.y3.y);
    r.shoulder = abs(sin_2) > T(tolerance::singular);
    const T over_2 = ratio(r.shoulder, one, sin_2);
    const T cos_1 = f.y3.x * over_2, sin_1 = f.y3.y * over_2;
    r.part[0] = {-(cos_1 * f.y3.z * over_2), -(sin_1 * f.y3.z * over_2), select(r.shoulder, one, zero)};
    r.part[1] = {-sin_1, cos_1, zero};
    r.part[2] = {cos_1 * over_2, sin_1 * over_2, zero};
    // joints 5-7 split it likewise along z_4, axis 6 and z_7
    const Vec3<T> across = f.x3 * m.elbow.beta.cos - f.y3 * m.elbow.beta.sin,
                  along = combine(f.x3, m.elbow.beta.sin, f.y3, m.elbow.beta.cos);
    const Vec3<T> x4 = combine(along, m.elbow.gamma.sin, across, m.elbow.gamma.cos),
                  z4 = combine(along, m.elbow.gamma.cos, across, -m.elbow.gamma.sin);
    const T sin_6 = m.gc.wrist * hypot(f.n1.z, f.n2.z);
    r.wrist = abs(sin_6) > T(tolerance::singular);
    const T over_6 = ratio(r.wrist, one, sin_6);
    const T cos_5 = f.n1.z * over_6, sin_5 = f.n2.z * over_6;
    const Vec3<T> level = combine(x4, cos_5, f.z3, -sin_5);  // part of z_7 across z_4; y_4 is -z_3
    r.part[4] = combine(z4, select(r.wrist, one, zero), level, -(f.n33 * over_6));
    r.part[5] = combine(x4, -sin_5, f.z3, -cos_5);
    r.part[6] = level * over_6;
    // the triangle: 2 n n' = -2 La Lb sin(eta) eta'
    const T sin_eta = m.gc.elbow * c.triangle.eta.sin;
    r.elbow = c.triangle.eta.sin > T(tolerance::singular);
    r.w = c.w;
    r.inverse_distance = one / c.distance;
    r.bend = -ratio(r.elbow, c.distance, T(arm.upper_arm * arm.forearm) * sin_eta);
    const T side = T(arm.upper_arm) + T(arm.forearm) * c.triangle.eta.cos;
    const T flat =
        mul_add(side, side, T(arm.forearm * arm.forearm) * c.triangle.eta.sin * c.triangle.eta.sin);
    const T share =
        T(arm.forearm) * ratio(r.elbow, mul_add(T(arm.upper_arm), c.triangle.eta.cos, T(arm.forearm)), flat);
    const T beta = -(share * r.bend);
    // a gap d_4 leans both frames about `across`: sin(tilt) = d_4 / n
    const T tilt = m.elbow.tilted ? -(m.elbow.tilt.sin / m.elbow.tilt.cos * r.inverse_distance) : zero;
    r.lean_3 = combine(f.z3, beta, across, -tilt);
    r.lean_4 = combine(f.z3, beta + r.bend, across, -tilt);
    r.plane = !is_reference_lost(arm, c.w, c.distance);
    r.turn = reference_turn(arm, c.w, c.z, c.distance);
    r.turn = select(r.plane, r.turn, Vec3<T>{zero, zero, zero});
    const Vec3<T> tip{T(arm.tool.position.x), T(arm.tool.position.y), T(arm.tool.position.z + arm.d_wf)};
    r.lever = -(flange.rotation * tip);
    return r;
}

/// Converts the gradient of a function with respect to the joints to its gradient with respect to twist and
/// psi. For joint j alone the result is row j of dq/d(v, omega, psi).
template <class T>
ARMANGLE_INLINE Pull<T> pulled(const Arm& arm, const Rates<T>& r, const T (&by_q)[joints]) noexcept {
    const auto of = [&](int j) { return by_q[j] * T(arm.sign[j]); };
    const Vec3<T> upper = mul_add(r.part[0], of(0), combine(r.part[1], of(1), r.part[2], of(2))),
                  lower = mul_add(r.part[4], of(4), combine(r.part[5], of(5), r.part[6], of(6))),
                  both = upper - lower;
    Pull<T> out;
    out.psi = dot(both, r.w);
    const T stretch = dot(upper, r.lean_3) - dot(lower, r.lean_4) + of(3) * r.bend;
    out.linear = mul_add(cross(both, r.w), r.inverse_distance, combine(r.turn, out.psi, r.w, stretch));
    out.angular = lower + cross(r.lever, out.linear);
    if (arm.has_base) {
        const Mat3<T> base = spread<T>(arm.base).rotation;
        out.linear = base * out.linear;
        out.angular = base * out.angular;
    }
    return out;
}

/// The derivatives of the joints with respect to (v, omega, psi): row j is joint j + 1. An entry is infinite
/// if it does not exist. Joints 1-3 (5-7) have none if theta_2 (theta_6) is 0 or pi. If the elbow is
/// stretched or folded, no joint has one with respect to the pose. If psi jumps, for example with the wrist
/// over the base axis, only joint 4 has one with respect to the pose.
struct Derivatives {
    double entry[joints][joints];
    Status status;
};

namespace detail {

/// Writes the rates of a pose that has a solution to `out`; else returns BAD_INPUT, UNREACHABLE or FOLDED and
/// leaves `out` unchanged.
inline Status rates_at(const Arm& arm, const Pose<double>& pose, double psi, int gc,
                       Rates<double>& out) noexcept {
    if (gc < 0 || gc >= configurations || !(abs(psi) <= tolerance::largest_angle) || !is_rigid(pose))
        return Status::BAD_INPUT;
    const Pose<double> flange = flange_pose(arm, pose);
    const SelfMotion<double> m = self_motion(arm, circle(arm, flange), configuration(gc));
    if (is_unreachable(m.circle)) return Status::UNREACHABLE;
    if (is_folded(m.circle)) return Status::FOLDED;
    out = rates(arm, flange, m, sin_cos(psi));
    return Status::OK;
}

/// Whether joint j + 1 (j: 0..6) has a derivative with respect to psi.
inline bool moves_with_psi(const Rates<double>& r, int j) noexcept {
    return j == 3 || (j < 3 ? r.shoulder : r.wrist);
}
/// Whether joint j + 1 (j: 0..6) has a derivative with respect to the pose.
inline bool moves_with_pose(const Rates<double>& r, int j) noexcept {
    return moves_with_psi(r, j) && r.elbow && (j == 3 || r.plane);
}

/// Attaches eight partial derivatives to each component of a vector.
ARMANGLE_INLINE Vec3<Dual> with_partials(const Vec3<double>& at, const Vec3<Dual::Partials>& by) noexcept {
    return {{at.x, by.x}, {at.y, by.y}, {at.z, by.z}};
}

/// The vector product omega x v for eight angular velocities at once.
ARMANGLE_INLINE Vec3<Dual::Partials> turned(const Vec3<Dual::Partials>& omega,
                                            const Vec3<double>& v) noexcept {
    const Dual::Partials x(v.x), y(v.y), z(v.z);
    return {omega.y * z - omega.z * y, omega.z * x - omega.x * z, omega.x * y - omega.y * x};
}

/// A pose with its partial derivatives along eight twists (velocity, omega).
ARMANGLE_INLINE Pose<Dual> moving(const Pose<double>& pose, const Vec3<Dual::Partials>& velocity,
                                  const Vec3<Dual::Partials>& omega) noexcept {
    const auto column = [&omega](const Vec3<double>& v) { return with_partials(v, turned(omega, v)); };
    return {{column(pose.rotation.x), column(pose.rotation.y), column(pose.rotation.z)},
            with_partials(pose.position, velocity)};
}

}  // namespace detail

/// Computes the derivatives of the joints at (pose, psi, gc). Status OK, or UNREACHABLE, FOLDED, BAD_INPUT
/// with all numbers NaN. The seed of other kinds of arm is not needed.
inline Derivatives inverse_derivative(const Arm& arm, const Pose<double>& pose, double psi, int gc,
                                      const double* = nullptr) noexcept {
    Derivatives out;
    Rates<double> r;
    out.status = detail::rates_at(arm, pose, psi, gc, r);
    for (int j = 0; j < joints; ++j) {
        double (&row)[joints] = out.entry[j];
        for (double& entry : row) entry = not_a_number;
        if (out.status != Status::OK) continue;
        double one[joints] = {};
        one[j] = 1.0;
        store_pull(pulled(arm, r, one), row);
        if (!detail::moves_with_psi(r, j)) row[6] = infinity;
        for (int k = 0; k < 6; ++k)
            if (!detail::moves_with_pose(r, j)) row[k] = infinity;
    }
    return out;
}

/// Writes the gradient dpsi/dq at joints q (rad/rad) to `out`, for the arm's own psi; infinite if psi does
/// not exist or jumps there.
inline void psi_gradient(const Arm& arm, const double* q, double (&out)[joints]) noexcept {
    const Jacobian jac = jacobian(arm, q);
    double theta[joint_slots], column[6][joint_slots] = {}, axis[3][joint_slots] = {};
    Pose<double> frame[joints + 1];
    detail::walk(arm, joint_lanes(q), theta,
                 [&frame](int i, const Pose<double>& at) noexcept { frame[i] = at; });
    for (int i = 0; i < joints; ++i) {
        for (int k = 0; k < 6; ++k) column[k][i] = jac.entry[k][i];
        if (i > 2) continue;  // only the first three joints turn the elbow axis
        const Vec3<double> a = frame[i].rotation.z * arm.sign[i];
        axis[0][i] = a.x;
        axis[1][i] = a.y;
        axis[2][i] = a.z;
    }
    const auto lanes = [](const double (&row)[joint_slots]) { return Dual::Partials::load(row); };
    const Pose<Dual> moved =
        detail::moving(user_pose(arm, frame[joints]), {lanes(column[0]), lanes(column[1]), lanes(column[2])},
                       {lanes(column[3]), lanes(column[4]), lanes(column[5])});
    const Triad<Dual> c = triad(arm, flange_pose(arm, moved));
    const Vec3<double>& elbow_axis = frame[3].rotation.z;
    const Vec3<Dual> z3 = detail::with_partials(
        elbow_axis, detail::turned({lanes(axis[0]), lanes(axis[1]), lanes(axis[2])}, elbow_axis));
    double partial[Dual::variables];
    atan2(dot(c.e, z3), dot(c.z, z3)).partial.store(partial);
    const Vec3<double> w{c.w.x.value, c.w.y.value, c.w.z.value};
    const bool exists = !is_folded(c) && !is_reference_lost(arm, w, c.distance.value);
    for (int j = 0; j < joints; ++j) out[j] = exists && abs(partial[j]) < infinity ? partial[j] : infinity;
}

}  // namespace armangle

#include "../names/end.hpp"
