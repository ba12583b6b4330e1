// Derivatives of the joints of an arm with an offset by the pose and by its free joint.
//
// At a posture  M dq = (v, omega, dfree),  M the Jacobian with a seventh row, 1 at the free joint. So
// dq = M^-1 (v, omega, dfree), and M^-1 is all first derivatives. Their own derivatives along a motion dq are
// -M^-1 dM M^-1, with dM from the axes a_i and the columns (v_i, a_i) of the Jacobian:
//
//     d v_i / d q_j = a_j x v_i (j < i), a_i x v_j (j >= i);   d a_i / d q_j = a_j x a_i (j < i), else 0
//
// It is the implicit function theorem. M is singular at a fold, at a straight elbow, and where two joints
// turn about one axis.
#pragma once

#include "../limits/solution_derivative.hpp"
#include "offset_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Writes the inverse of m, which it overwrites, to `out`, with complete pivoting; false if a pivot is
/// negligible compared to entries of size one; `out` is then meaningless.
inline bool invert(double (&m)[joints][joints], double (&out)[joints][joints]) noexcept {
    for (int i = 0; i < joints; ++i)
        for (int k = 0; k < joints; ++k) out[i][k] = i == k ? 1.0 : 0.0;
    int column[joints];
    bool used[joints] = {};
    for (int i = 0; i < joints; ++i) {
        int row = i, best = -1;
        double most = tolerance::vanishing;
        for (int r = i; r < joints; ++r)
            for (int k = 0; k < joints; ++k) {
                if (used[k] || !(abs(m[r][k]) > most)) continue;
                most = abs(m[r][k]);
                row = r;
                best = k;
            }
        if (best < 0) return false;
        column[i] = best;
        used[best] = true;
        for (int k = 0; k < joints; ++k) {
            std::swap(m[i][k], m[row][k]);
            std::swap(out[i][k], out[row][k]);
        }
        const double scale = 1.0 / m[i][best];
        for (int k = 0; k < joints; ++k) {
            m[i][k] *= scale;
            out[i][k] *= scale;
        }
        for (int r = 0; r < joints; ++r) {
            const double share = r == i ? 0.0 : m[r][best];
            if (share == 0.0) continue;
            for (int k = 0; k < joints; ++k) {
                m[r][k] -= share * m[i][k];
                out[r][k] -= share * out[i][k];
            }
        }
    }
    for (int i = 0; i < joints; ++i)
        for (int k = 0; k < joints; ++k) m[column[i]][k] = out[i][k];
    for (int i = 0; i < joints; ++i)
        for (int k = 0; k < joints; ++k) out[i][k] = m[i][k];
    return true;
}

/// Writes the derivatives of the joints with respect to twist and free joint, the columns of Derivatives, to
/// `out`: the inverse of the Jacobian with a seventh row for the free joint. If that is singular, all rows
/// but that of the free joint are infinite.
template <free_joint_arm AnyArm>
void derivatives_at(const AnyArm& arm, const Jacobian& jac, double (&out)[joints][joints]) noexcept {
    const int free = robot_joint(arm, joints - 1);
    const double size = nominal(arm).size;
    double m[joints][joints];
    for (int k = 0; k < joints; ++k) {
        for (int i = 0; i < 6; ++i) m[i][k] = i < 3 ? jac.entry[i][k] / size : jac.entry[i][k];
        m[6][k] = k == free ? 1.0 : 0.0;
    }
    const bool regular = invert(m, out);
    for (int j = 0; j < joints; ++j)
        for (int k = 0; k < joints; ++k) {
            if (j == free)
                out[j][k] = k == 6 ? 1.0 : 0.0;
            else if (!regular)
                out[j][k] = infinity;
            else if (k < 3)
                out[j][k] /= size;
        }
}

/// Writes the change of the Jacobian for a small motion w of the joints, times joint velocities u, to `out`.
inline void jacobian_change(const Jacobian& jac, const double* w, const double* u,
                            double (&out)[6]) noexcept {
    const auto linear = [&jac](int i) {
        return Vec3<double>{jac.entry[0][i], jac.entry[1][i], jac.entry[2][i]};
    };
    const auto axis = [&jac](int i) {
        return Vec3<double>{jac.entry[3][i], jac.entry[4][i], jac.entry[5][i]};
    };
    Vec3<double> v{0, 0, 0}, a{0, 0, 0};
    for (int i = 0; i < joints; ++i)
        for (int j = 0; j < joints; ++j) {
            const double both = u[i] * w[j];
            v = v + (j < i ? cross(axis(j), linear(i)) : cross(axis(i), linear(j))) * both;
            if (j < i) a = a + cross(axis(j), axis(i)) * both;
        }
    const double all[6] = {v.x, v.y, v.z, a.x, a.y, a.z};
    for (int k = 0; k < 6; ++k) out[k] = all[k];
}

}  // namespace detail

/// The derivatives of the joints at (pose, free joint, gc). Status OK, or a status of inverse() with all
/// numbers NaN. Derivatives that do not exist are infinite.
template <free_joint_arm AnyArm>
Derivatives inverse_derivative(const AnyArm& arm, const Pose<double>& pose, double free, int gc) noexcept {
    Derivatives out;
    const Inverse at = inverse(arm, pose, free, gc);
    out.status = at.status;
    for (auto& row : out.entry)
        for (double& entry : row) entry = not_a_number;
    if (at.status == Status::OK) detail::derivatives_at(arm, jacobian(arm, at.q), out.entry);
    return out;
}

namespace detail {

/// Writes the derivatives of dq_j/dfree with respect to the twist and the free joint to `out`, from the
/// Jacobian and the derivatives `by` of the joints (derivatives_at).
inline void slope_derivatives_at(const Jacobian& jac, const double (&by)[joints][joints],
                                 double (&out)[joints][joints]) noexcept {
    double along[joints], u[joints];
    for (int j = 0; j < joints; ++j) u[j] = by[j][6];
    for (int k = 0; k < joints; ++k) {
        double change[6];
        for (int j = 0; j < joints; ++j) along[j] = by[j][k];
        jacobian_change(jac, along, u, change);
        for (int j = 0; j < joints; ++j) {
            out[j][k] = 0;
            for (int i = 0; i < 6; ++i) out[j][k] -= by[j][i] * change[i];
        }
    }
}

}  // namespace detail

/// Writes the derivatives of dq_j/dfree for each joint with respect to the twist and to the free joint to
/// `out`, in the seven columns of Derivatives. There must be a solution.
template <free_joint_arm AnyArm>
void slope_derivatives(const AnyArm& arm, const Pose<double>& pose, double free, int gc,
                       double (&out)[joints][joints]) noexcept {
    const Inverse at = inverse(arm, pose, free, gc);
    const Jacobian jac = jacobian(arm, at.q);
    double by[joints][joints];
    detail::derivatives_at(arm, jac, by);
    detail::slope_derivatives_at(jac, by, out);
}

/// Always false: where two joints rotate around one axis, the derivatives are infinite anyway.
template <free_joint_arm AnyArm>
bool shares_a_turn(const AnyArm&, const double*) noexcept {
    return false;
}

/// Always false: every other joint moves with the free joint.
template <free_joint_arm AnyArm>
bool is_fixed_by_pose(const AnyArm&, int) noexcept {
    return false;
}

}  // namespace armangle

#include "../names/end.hpp"
