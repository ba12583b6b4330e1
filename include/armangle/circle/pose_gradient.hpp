// Reverse-mode gradients: from the gradient of a function by the results to its gradient by the arguments.
//
// A gradient by the sixteen entries of a pose matters along rigid motions alone, dp = v and dR = omega x R.
// Among the gradients that agree there, the smallest is returned. Results with gradient 0 contribute nothing,
// however steep they are. If a result with a nonzero gradient has no derivative, the whole gradient is NaN
// and a Hindrance gives the reason.
#pragma once

#include "../numbers/arrays.hpp"
#include "derivatives.hpp"
#include "forward.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Why a gradient does not exist: psi jumps, theta_2 or theta_6 is 0 or pi, the elbow is stretched or folded,
/// the pose has no solution, or an arm with an offset has no first derivatives there.
enum class Hindrance : int {
    none = 0,
    psi = 1,
    shoulder = 2,
    elbow = 4,
    wrist = 6,
    unreachable = 7,
    singular = 8
};

/// Converts a gradient with respect to the entries of a pose (4x4, row by row) to `by_twist`, that with
/// respect to its twist (v, omega).
inline void twist_gradient(const Pose<double>& pose, const double* by_entry, double (&by_twist)[6]) noexcept {
    const Pose<double> g = load_pose(by_entry);
    const auto& [x, y, z] = pose.rotation;
    const Vec3<double> omega = cross(x, g.rotation.x) + cross(y, g.rotation.y) + cross(z, g.rotation.z);
    const double all[6] = {g.position.x, g.position.y, g.position.z, omega.x, omega.y, omega.z};
    for (int k = 0; k < 6; ++k) by_twist[k] = all[k];
}

/// The smallest gradient with respect to a pose's entries that equals the gradient with respect to the twist
/// along rigid motions.
template <class T>
ARMANGLE_INLINE Pose<T> pose_gradient(const Pose<T>& pose, const Vec3<T>& linear,
                                      const Vec3<T>& angular) noexcept {
    // the sum of x cross (a cross x) over three orthonormal x is 2 a
    const Vec3<T> half = angular * T(0.5);
    return {{cross(half, pose.rotation.x), cross(half, pose.rotation.y), cross(half, pose.rotation.z)},
            linear};
}

/// Writes a gradient with respect to a pose's entries to `by_entry` (4x4, row by row); the last row is 0.
inline void store_gradient(const Pose<double>& gradient, double* by_entry) noexcept {
    store_pose(gradient, by_entry);
    by_entry[15] = 0;
}

/// Converts a change of a pose, given by its entries (4x4, row by row), to a twist (v, omega): dp, and the
/// axis of the skew part of dR R^T.
inline void twist_of(const Pose<double>& pose, const double* change, double (&twist)[6]) noexcept {
    twist_gradient(pose, change, twist);
    for (int k = 3; k < 6; ++k) twist[k] *= 0.5;
}

/// Writes the gradient of a function of forward() with respect to the joints to `by_q`, from its gradients
/// with respect to the pose's entries and to psi. Returns none, or why it does not exist; by_q is then NaN.
template <class AnyArm>
Hindrance forward_pullback(const AnyArm& arm, const double* q, const double* by_pose, double by_psi,
                           double (&by_q)[joints]) noexcept {
    const Jacobian j = jacobian(arm, q);
    double by_twist[6];
    twist_gradient(forward(arm, q).pose, by_pose, by_twist);
    for (int i = 0; i < joints; ++i) {
        by_q[i] = 0;
        for (int k = 0; k < 6; ++k) by_q[i] += by_twist[k] * j.entry[k][i];
    }
    if (by_psi == 0) return Hindrance::none;
    double of_psi[joints];
    psi_gradient(arm, q, of_psi);
    const bool exists = abs(of_psi[0]) < infinity;
    for (int i = 0; i < joints; ++i) by_q[i] = exists ? by_q[i] + by_psi * of_psi[i] : not_a_number;
    return exists ? Hindrance::none : Hindrance::psi;
}

/// Writes the change of forward()'s pose (4x4 entries, row by row) and of its psi for a change dq of the
/// joints. The change of psi is NaN if its derivative does not exist.
template <class AnyArm>
void forward_pushforward(const AnyArm& arm, const double* q, const double* dq, double* change,
                         double& psi) noexcept {
    const Jacobian j = jacobian(arm, q);
    double of_psi[joints], twist[6] = {};
    psi_gradient(arm, q, of_psi);
    psi = 0;
    for (int i = 0; i < joints; ++i) {
        for (int k = 0; k < 6; ++k) twist[k] += j.entry[k][i] * dq[i];
        if (dq[i] != 0) psi += abs(of_psi[i]) < infinity ? of_psi[i] * dq[i] : not_a_number;
    }
    const Vec3<double> omega{twist[3], twist[4], twist[5]};
    const Mat3<double> r = forward(arm, q).pose.rotation;
    store_gradient(
        {{cross(omega, r.x), cross(omega, r.y), cross(omega, r.z)}, {twist[0], twist[1], twist[2]}}, change);
}

namespace detail {

/// The reason why a gradient through the joints with a nonzero by_q does not exist with respect to psi or, if
/// `by_pose`, to the pose; Hindrance::none if it exists.
inline Hindrance hindrance(const Rates<double>& r, const double* by_q, bool by_pose) noexcept {
    bool asked[joints], any_asked = false, any_turn = false;
    for (int j = 0; j < joints; ++j) {
        asked[j] = by_q[j] != 0;
        any_asked |= asked[j];
        any_turn |= asked[j] && j != 3;
    }
    if (!r.shoulder && (asked[0] || asked[1] || asked[2])) return Hindrance::shoulder;
    if (!r.wrist && (asked[4] || asked[5] || asked[6])) return Hindrance::wrist;
    if (by_pose && !r.elbow && any_asked) return Hindrance::elbow;
    if (by_pose && !r.plane && any_turn) return Hindrance::psi;
    return Hindrance::none;
}

}  // namespace detail

/// Writes the gradient of a function of inverse() with respect to the pose's entries (4x4, row by row) and
/// psi, from its gradient by_q with respect to the joints. Returns none, or why it does not exist. It is then
/// NaN, except its part with respect to psi if only the other one is missing.
inline Hindrance inverse_pullback(const Arm& arm, const Pose<double>& pose, double psi, int gc,
                                  const double* by_q, double* by_pose, double& by_psi) noexcept {
    Pull<double> p{{0, 0, 0}, {0, 0, 0}, 0};
    Hindrance why = Hindrance::none;
    double given[joints];
    bool asked = false;
    for (int j = 0; j < joints; ++j) {
        given[j] = by_q[j];
        asked |= by_q[j] != 0;
    }
    if (asked) {
        constexpr Vec3<double> no{not_a_number, not_a_number, not_a_number};
        Rates<double> r;
        if (detail::rates_at(arm, pose, psi, gc, r) != Status::OK) {
            why = Hindrance::unreachable;
            p = {no, no, not_a_number};
        } else {
            p = pulled(arm, r, given);
            why = detail::hindrance(r, by_q, true);
            if (why != Hindrance::none) p.linear = p.angular = no;
            if (detail::hindrance(r, by_q, false) != Hindrance::none) p.psi = not_a_number;
        }
    }
    store_gradient(pose_gradient(pose, p.linear, p.angular), by_pose);
    by_psi = p.psi;
    return why;
}

/// Writes the change of the joints of inverse() for a change of the pose's entries and of psi to `dq`. NaN
/// for each joint whose derivative does not exist.
template <class AnyArm>
void inverse_pushforward(const AnyArm& arm, const Pose<double>& pose, double psi, int gc,
                         const double* change, double psi_change, double* dq) noexcept {
    const Derivatives d = inverse_derivative(arm, pose, psi, gc);
    double twist[6];
    twist_of(pose, change, twist);
    for (int j = 0; j < joints; ++j) {
        dq[j] = 0;
        for (int k = 0; k < joints; ++k) {
            const double by = k < 6 ? twist[k] : psi_change, entry = d.entry[j][k];
            if (by != 0) dq[j] += abs(entry) < infinity ? entry * by : not_a_number;
        }
    }
}

}  // namespace armangle

#include "../names/end.hpp"
