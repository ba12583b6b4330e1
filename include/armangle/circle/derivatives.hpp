// Derivatives of the two doors: joints by pose and arm angle, arm angle by joints.
//
// A pose moves by a twist (v, omega): v of the tool's origin (m), omega (rad), in the frame that poses are
// given in, as the rows of the Jacobian. The inverse runs on Dual numbers whose partials are the six of the
// twist and that of psi; the same formulas, no second one. With the Jacobian J and the gradient g of psi
//
//     [J; g] dq = (v, omega, dpsi),   so that   dq/d(v, omega, psi) = [J; g]^-1.
#pragma once

#include "../arm/jacobian.hpp"
#include "../numbers/dual.hpp"
#include "inverse.hpp"

namespace armangle {

/// dq by (v, omega, psi): row j is joint j + 1. Infinite where it does not exist: a side on which theta_2
/// (theta_6) is 0 or pi, all joints where the elbow is stretched or folded.
struct Derivatives {
    double q[joints];
    double entry[joints][joints];
    Status status;
};

namespace detail {

/// The partials of a vector that a motion turns and moves.
ARMANGLE_INLINE Vec3<Dual> with_partials(const Vec3<double>& at, const Vec3<Dual::Partials>& by) noexcept {
    return {{at.x, by.x}, {at.y, by.y}, {at.z, by.z}};
}

/// omega x v for eight omegas.
ARMANGLE_INLINE Vec3<Dual::Partials> turned(const Vec3<Dual::Partials>& omega,
                                            const Vec3<double>& v) noexcept {
    const Dual::Partials x(v.x), y(v.y), z(v.z);
    return {omega.y * z - omega.z * y, omega.z * x - omega.x * z, omega.x * y - omega.y * x};
}

/// A pose that moves with eight twists.
ARMANGLE_INLINE Pose<Dual> moving(const Pose<double>& pose, const Vec3<Dual::Partials>& velocity,
                                  const Vec3<Dual::Partials>& omega) noexcept {
    const auto column = [&omega](const Vec3<double>& v) { return with_partials(v, turned(omega, v)); };
    return {{column(pose.rotation.x), column(pose.rotation.y), column(pose.rotation.z)},
            with_partials(pose.position, velocity)};
}

/// The variable k alone.
ARMANGLE_INLINE Dual::Partials unit(int k) noexcept {
    double one[Dual::variables] = {};
    one[k] = 1.0;
    return Dual::Partials::load(one);
}

}  // namespace detail

/// Joints of (pose, psi, gc), on the turns that inverse() takes without a seed, and their derivatives. OK, or
/// UNREACHABLE, FOLDED, BAD_INPUT as there; then all numbers are NaN.
inline Derivatives inverse_derivative(const Arm& arm, const Pose<double>& pose, double psi, int gc) noexcept {
    Derivatives out;
    out.status = Status::BAD_INPUT;
    for (int j = 0; j < joints; ++j) {
        out.q[j] = not_a_number;
        for (double& partial : out.entry[j]) partial = not_a_number;
    }
    if (gc < 0 || gc >= configurations || !(abs(psi) <= tolerance::largest_angle) || !is_rigid(pose))
        return out;
    const Pose<Dual> moved = detail::moving(pose, {detail::unit(0), detail::unit(1), detail::unit(2)},
                                            {detail::unit(3), detail::unit(4), detail::unit(5)});
    const Configuration<double> signs = configuration(gc);
    const SelfMotion<Dual> m =
        self_motion<Dual>(arm, moved, {Dual(signs.shoulder), Dual(signs.elbow), Dual(signs.wrist)});
    out.status = is_unreachable(m.circle) ? Status::UNREACHABLE : Status::FOLDED;
    if (is_unreachable(m.circle) || is_folded(m.circle)) return out;
    out.status = Status::OK;
    const Directions<Dual> d = directions(m, sin_cos(Dual(psi, detail::unit(6))));
    Directions<double> values;
    for (int j = 0; j < joint_slots; ++j) {
        values.y[j] = d.y[j].value;
        values.x[j] = d.x[j].value;
    }
    const Joints solved = joints_within_limits(arm, values, nullptr);
    for (int j = 0; j < joints; ++j) out.q[j] = solved.q[j];
    for (int j = 0; j < joints; ++j) {
        double partial[Dual::variables];
        const Dual theta = atan2(d.y[j], d.x[j]);
        (theta.partial * Dual::Partials(arm.sign[j])).store(partial);
        // the hinge beside a pivot says whether its direction exists
        const int hinge = j < 3 ? 1 : 5;
        const bool exists = j == 3 || abs(d.y[hinge].value) > tolerance::singular;
        for (int k = 0; k < joints; ++k)
            out.entry[j][k] = exists && abs(partial[k]) < infinity ? partial[k] : infinity;
    }
    if (!(m.circle.triangle.eta.sin.value > tolerance::singular))
        for (auto& row : out.entry)
            for (int k = 0; k < joints - 1; ++k) row[k] = infinity;
    return out;
}

/// dpsi/dq at joints q (rad/rad), in the arm's own psi; infinite where psi does not exist.
inline void psi_gradient(const Arm& arm, const double* q, double (&out)[joints]) noexcept {
    const Jacobian jac = jacobian(arm, q);
    double theta[joint_slots], column[6][joint_slots] = {}, axis[3][joint_slots] = {};
    Pose<double> frame[joints + 1];
    detail::walk(arm, joint_lanes(q), theta,
                 [&frame](int i, const Pose<double>& at) noexcept { frame[i] = at; });
    for (int i = 0; i < joints; ++i) {
        for (int k = 0; k < 6; ++k) column[k][i] = jac.entry[k][i];
        if (i > 2) continue;  // the elbow's axis turns with the first three joints
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
    const bool exists = !is_folded(c);
    for (int j = 0; j < joints; ++j) out[j] = exists && abs(partial[j]) < infinity ? partial[j] : infinity;
}

}  // namespace armangle
