// Solves a pose to its last digits with every joint within its limits, near a start.
//
// psi distinguishes solutions only as far as it has digits. If a hinge is 1e-12 rad from straight, a joint
// turns half around while psi changes by 1e-12. If every joint is locked, rounding leaves no psi at all. The
// joints themselves are well defined there. A damped Gauss-Newton method within the limits therefore
// minimizes |rest of the pose|^2 + share sum w (q - near)^2, first with a share, then without. Its steps use
// orthogonal transformations: normal equations would miss moves that change the pose by less than 1e-8 of
// their size.
#pragma once

#include "relaxed.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the solution of a pose near a start.
struct LocalSolveTuning {
    static constexpr int rounds = 40;            // Gauss-Newton rounds
    static constexpr int patience = 6;           // stop after so many rounds that do not halve the distance
    static constexpr double longest = 0.5;       // rad: largest move of a joint in one round
    static constexpr double damping = 1e-26;     // smallest damping of H (of the square of the arm's size)
    static constexpr double most = 1e-2;         // larger damping finds nothing (same unit)
    static constexpr double share = 1e-8;        // weight of the cost at first (same unit) ...
    static constexpr double last_share = 1e-12;  // ... and later, if the pose hardly distinguishes joints
    static constexpr double still = 1e-15;       // rad: shorter moves count as none
    static constexpr double exact = 2e-15;       // a pose this near is not improved (of the arm's size; rad)
    static constexpr double meets = 1e-13;       // a pose this near is solved (same unit)
    static constexpr double bent = 0.05;   // rad off straight: where an elbow begins that may bend either way
    static constexpr double same = 4e-15;  // poses this near are equal (same unit; of a unit vector)
};

/// Attracts a configuration on its way to a pose: joint j by weight[j] towards near[j].
struct Attraction {
    double weight[joints] = {}, near[joints] = {};
};

namespace detail {

/// Half of the cost that is minimized: the squared distance (m^2) from the pose, plus `share` times the
/// attraction.
inline double local_cost(const Attraction& pull, double share, const double* q, double distance) noexcept {
    double sum = distance * distance;
    for (int j = 0; j < joints; ++j) {
        const double off = q[j] - pull.near[j];
        if (share > 0 && pull.weight[j] > 0) sum += share * pull.weight[j] * off * off;
    }
    return 0.5 * sum;
}

/// Up to sixteen numbers as a vector.
struct Rows {
    static constexpr int capacity = 16;
    double row[capacity] = {};

    /// The scalar product with another vector.
    ARMANGLE_INLINE double dot(const Rows& other) const noexcept {
        const Lane<8> product = mul_add(upper(), other.upper(), lower() * other.lower()),
                      four = product + swap_halves(product);
        return (four[0] + four[1]) + (four[2] + four[3]);
    }
    /// Adds a multiple of another vector.
    ARMANGLE_INLINE void add(double factor, const Rows& other) noexcept {
        mul_add(Lane<8>(factor), other.lower(), lower()).store(row);
        mul_add(Lane<8>(factor), other.upper(), upper()).store(row + 8);
    }

private:
    /// The first eight numbers.
    Lane<8> lower() const noexcept { return Lane<8>::load(row); }
    /// The last eight numbers.
    Lane<8> upper() const noexcept { return Lane<8>::load(row + 8); }
};

/// Minimizes |A x - b|^2: six rows for a pose, and one for each joint that is damped or attracted.
struct JointLeastSquares {
    Rows A[joints], b;  // the columns of A

    /// Solves for the joints marked free, with the others fixed at x, by Householder reflections.
    void solve(const bool (&free)[joints], double (&x)[joints]) const noexcept {
        Rows R[joints], y = b;
        int index[joints], n = 0;
        for (int j = 0; j < joints; ++j) {
            if (!free[j]) {
                y.add(-x[j], A[j]);
                continue;
            }
            R[n] = A[j];
            index[n++] = j;
        }
        for (int k = 0; k < n; ++k) {
            Rows v = R[k];
            for (int i = 0; i < k; ++i) v.row[i] = 0;
            const double size = sqrt(v.dot(v)), along = v.row[k] > 0 ? -size : size;
            if (size == 0) continue;
            v.row[k] -= along;
            const double factor = 1.0 / (along * v.row[k]);  // -2 / |v|^2
            for (int m = k + 1; m < n; ++m) R[m].add(factor * v.dot(R[m]), v);
            y.add(factor * v.dot(y), v);
            R[k].row[k] = along;
        }
        for (int k = n - 1; k >= 0; --k) {
            for (int m = k + 1; m < n; ++m) y.row[k] -= R[m].row[k] * x[index[m]];
            x[index[k]] = R[k].row[k] != 0 ? y.row[k] / R[k].row[k] : 0.0;
        }
    }

    /// The normal equations of this least-squares problem, for the active-set method.
    JointQuadratic quadratic() const noexcept {
        JointQuadratic out;
        for (int j = 0; j < joints; ++j) {
            out.g[j] = A[j].dot(b);
            for (int k = 0; k <= j; ++k) out.H[j][k] = out.H[k][j] = A[j].dot(A[k]);
        }
        return out;
    }
};

/// The rows of the least-squares problem at a configuration: first its pose, then attraction and damping
/// (m^2/rad^2).
template <class A>
JointLeastSquares local_rows(const A& arm, const double* q, const Twist& rest, const Attraction& pull,
                             double share, double damping) noexcept {
    const Jacobian J = jacobian(arm, q);
    const double length = nominal(arm).size, r[6] = {rest.linear.x,  rest.linear.y,  rest.linear.z,
                                                     rest.angular.x, rest.angular.y, rest.angular.z};
    JointLeastSquares out;
    for (int i = 0; i < 6; ++i) {
        const double unit = i < 3 ? 1.0 : length;
        out.b.row[i] = unit * r[i];
        for (int j = 0; j < joints; ++j) out.A[j].row[i] = unit * J.entry[i][j];
    }
    for (int j = 0; j < joints; ++j) {
        const double w = share > 0 ? share * pull.weight[j] : 0.0, hold = sqrt(damping + w);
        out.A[j].row[6 + j] = hold;
        out.b.row[6 + j] = w > 0 ? w * (pull.near[j] - q[j]) / hold : 0.0;
    }
    return out;
}

}  // namespace detail

/// From `start`, within the limits: the configuration at which no small change lowers distance^2 + share sum
/// w (q - near)^2; `share` in m^2/rad^2. Subtracts its rounds from `budget` and ends if none are left.
/// Without a share it also stops if rounds no longer approach the pose.
template <class A>
Relaxed solve_locally(const A& arm, const Limits& limits, const Joints& start, const Pose<double>& pose,
                      const Attraction& pull, double share, int& budget) noexcept {
    const double length = nominal(arm).size, square = length * length;
    Relaxed best{start, 0};
    for (int j = 0; j < joints; ++j) best.at.q[j] = min(max(start.q[j], limits.lower[j]), limits.upper[j]);
    Twist rest;
    best.distance = detail::distance(arm, best.at.q, pose, length, rest);
    double cost = detail::local_cost(pull, share, best.at.q, best.distance);
    double damping = LocalSolveTuning::damping, before = infinity;
    for (int round = 0; round < LocalSolveTuning::rounds && damping < LocalSolveTuning::most; ++round) {
        if (share == 0 && best.distance <= LocalSolveTuning::exact * length) break;
        if (round % LocalSolveTuning::patience == 0) {
            if (share == 0 && best.distance > 0.5 * before) break;
            before = best.distance;
        }
        if (--budget < 0) break;
        const detail::JointLeastSquares rows =
            detail::local_rows(arm, best.at.q, rest, pull, share, damping * square);
        double lower[joints], upper[joints], move[joints] = {}, longest = 0;
        for (int j = 0; j < joints; ++j) {
            lower[j] = max(limits.lower[j] - best.at.q[j], -LocalSolveTuning::longest);
            upper[j] = min(limits.upper[j] - best.at.q[j], LocalSolveTuning::longest);
        }
        minimise(rows.quadratic(), lower, upper, move,
                 [&rows](const bool (&free)[joints], double (&y)[joints]) noexcept { rows.solve(free, y); });
        Relaxed next = best;
        for (int j = 0; j < joints; ++j) {
            next.at.q[j] = min(max(best.at.q[j] + move[j], limits.lower[j]), limits.upper[j]);
            longest = max(longest, abs(next.at.q[j] - best.at.q[j]));
        }
        if (!(longest > LocalSolveTuning::still)) break;
        Twist next_rest;
        next.distance = detail::distance(arm, next.at.q, pose, length, next_rest);
        const double next_cost = detail::local_cost(pull, share, next.at.q, next.distance);
        if (next_cost < cost) {
            best = next;
            rest = next_rest;
            cost = next_cost;
            damping = max(1e-3 * damping, LocalSolveTuning::damping);
        } else {
            damping *= 1e3;
        }
    }
    return best;
}

/// Whether a configuration, with its distance from the pose, solves it up to rounding.
template <class A>
bool meets(const A& arm, const Relaxed& at) noexcept {
    return at.distance <= LocalSolveTuning::meets * nominal(arm).size;
}

/// Moves the start onto the pose, then towards the attraction and back onto the pose; returns the best
/// solution, or joints with the distance left if none is found. Subtracts its rounds from `budget`.
template <class A>
Relaxed solve_locally_attracted(const A& arm, const Limits& limits, const Joints& start,
                                const Pose<double>& pose, const Attraction& pull, int& budget) noexcept {
    const double size = nominal(arm).size;
    const auto attraction = [&pull](const Relaxed& x) { return detail::local_cost(pull, 1.0, x.at.q, 0.0); };
    Relaxed best = solve_locally(arm, limits, start, pose, pull, 0.0, budget), from = best;
    for (const double share : {LocalSolveTuning::share, LocalSolveTuning::last_share}) {
        const Relaxed attracted =
            solve_locally(arm, limits, from.at, pose, pull, share * size * size, budget);
        from = solve_locally(arm, limits, attracted.at, pose, pull, 0.0, budget);
        if (meets(arm, from) && !(meets(arm, best) && attraction(best) <= attraction(from))) best = from;
    }
    return best;
}

/// Calls visit(joints) with the elbow as it is. If it is within `most` (rad) of the stretched arm, where it
/// does not bend by itself, also with the opposite bend, and well bent to both sides, until visit returns
/// true.
template <class Visit>
void with_either_bend(const Arm& nominal, Joints q, double most, const Visit& visit) noexcept {
    const double straight = lift(to_q(nominal, 3, nominal.delta_angle), q.q[3]), bend = q.q[3] - straight;
    if (visit(q) || !(abs(bend) <= most)) return;
    for (const double begin : {-bend, LocalSolveTuning::bent, -LocalSolveTuning::bent}) {
        q.q[3] = straight + begin;
        if (visit(q)) return;
    }
}

/// Whether two poses are equal up to rounding, for an arm of this size (m).
inline bool same_pose(double size, const Pose<double>& pose, const Pose<double>& other) noexcept {
    const auto far = [](const Vec3<double>& a, const Vec3<double>& b) {
        const Vec3<double> d = a - b;
        return max(max(abs(d.x), abs(d.y)), abs(d.z));
    };
    const auto &r = pose.rotation, &s = other.rotation;
    return far(pose.position, other.position) <= LocalSolveTuning::same * size &&
           max(max(far(r.x, s.x), far(r.y, s.y)), far(r.z, s.z)) <= LocalSolveTuning::same;
}

}  // namespace armangle

#include "../names/end.hpp"
