// Derivatives of the joints by the pose and by psi, of any arm whose Jacobian and gradient of psi are known.
//
// At a posture  M dq = (v, omega, dpsi),  M the Jacobian with the gradient of psi as its seventh row. So
// dq = M^-1 (v, omega, dpsi), and M^-1 is all first derivatives. Their own derivatives along a motion dq are
// -M^-1 dM M^-1, with dM from the axes a_i and the columns (v_i, a_i) of the Jacobian:
//
//     d v_i / d q_j = a_j x v_i (j < i), a_i x v_j (j >= i);   d a_i / d q_j = a_j x a_i (j < i), else 0
//
// and from psi_gradient_change(). It is the implicit function theorem. M is singular at a fold, at a straight
// elbow, and where two joints turn about one axis. An exact S-R-S arm has closed forms instead
// (circle/derivatives.hpp).
#pragma once

#include "../limits/solution_derivative.hpp"

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

/// Writes the derivatives of the joints at q with respect to twist and psi, the columns of Derivatives, to
/// `out`: the inverse of the Jacobian `jac` with the gradient of psi as its seventh row. If that is singular,
/// all rows are infinite but that of a joint whose value is psi.
template <class AnyArm>
void derivatives_at(const AnyArm& arm, const double* q, const Jacobian& jac,
                    double (&out)[joints][joints]) noexcept {
    const int free = psi_joint(arm);
    const double size = nominal(arm).size;
    double m[joints][joints];
    psi_gradient(arm, q, m[6]);
    for (int k = 0; k < joints; ++k)
        for (int i = 0; i < 6; ++i) m[i][k] = i < 3 ? jac.entry[i][k] / size : jac.entry[i][k];
    const bool regular = abs(m[6][0]) < infinity && invert(m, out);
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

/// Writes the change of the Jacobian for a small motion w of the joints, times joint velocities u, to `out`
/// (6).
inline void jacobian_change(const Jacobian& jac, const double* w, const double* u, double* out) noexcept {
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

/// The derivatives of the joints at (pose, psi, gc). Status OK, or a status of inverse() with all numbers
/// NaN. Derivatives that do not exist are infinite. Of several
/// postures it is that which inverse() finds with this seed.
template <class AnyArm>
Derivatives inverse_derivative(const AnyArm& arm, const Pose<double>& pose, double psi, int gc,
                               const double* seed = nullptr) noexcept {
    Derivatives out;
    const Inverse at = inverse(arm, pose, psi, gc, seed);
    out.status = at.status;
    for (auto& row : out.entry)
        for (double& entry : row) entry = not_a_number;
    if (at.status == Status::OK) detail::derivatives_at(arm, at.q, jacobian(arm, at.q), out.entry);
    return out;
}

namespace detail {

/// Writes the derivatives of dq_j/dpsi with respect to the twist and psi at joints q to `out`, from the
/// Jacobian and the derivatives `by` of the joints (derivatives_at).
template <class AnyArm>
void slope_derivatives_at(const AnyArm& arm, const double* q, const Jacobian& jac,
                          const double (&by)[joints][joints], double (&out)[joints][joints]) noexcept {
    double along[joints], u[joints], turn[joints];
    for (int j = 0; j < joints; ++j) u[j] = by[j][6];
    psi_gradient_change(arm, q, u, turn);
    for (int k = 0; k < joints; ++k) {
        double change[joints] = {};
        for (int j = 0; j < joints; ++j) {
            along[j] = by[j][k];
            change[6] += turn[j] * along[j];
        }
        jacobian_change(jac, along, u, change);
        for (int j = 0; j < joints; ++j) {
            out[j][k] = 0;
            for (int i = 0; i < joints; ++i) out[j][k] -= by[j][i] * change[i];
        }
    }
}

}  // namespace detail

/// Writes the derivatives of dq_j/dpsi for each joint with respect to the twist and to psi to `out`, in the
/// seven columns of Derivatives, at a solution.
template <class AnyArm>
void slope_derivatives(const AnyArm& arm, const Pose<double>&, const Nearest& at,
                       double (&out)[joints][joints]) noexcept {
    const Jacobian jac = jacobian(arm, at.q);
    double by[joints][joints];
    detail::derivatives_at(arm, at.q, jac, by);
    detail::slope_derivatives_at(arm, at.q, jac, by, out);
}

/// Always false: where two joints rotate around one axis, the derivatives are infinite anyway.
template <class AnyArm>
bool shares_a_turn(const AnyArm&, const double*) noexcept {
    return false;
}

}  // namespace armangle

#include "../names/end.hpp"
