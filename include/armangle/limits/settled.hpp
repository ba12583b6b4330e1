// A posture that meets a pose to its last digits with every joint within its limits, beside a start.
//
// psi tells postures apart only as far as it has digits: where a hinge is 1e-12 rad off straight, a joint
// turns half round while psi changes by 1e-12, and where every joint is locked rounding leaves no psi at all.
// The joints themselves are well defined there. Hence a damped Gauss-Newton method in the box of the limits:
// the least |rest of the pose|^2 + share sum w (q - near)^2, first with a share, then without. Its steps come
// from orthogonal transformations: normal equations would see no move that changes the pose by less than 1e-8
// of it.
#pragma once

#include "relaxed.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace settled_rule {
inline constexpr int rounds = 40;            // of Gauss-Newton
inline constexpr int patience = 6;           // rounds that do not halve the distance are the last
inline constexpr double longest = 0.5;       // rad: a round's longest move of a joint
inline constexpr double damping = 1e-26;     // least, of H (of the square of the arm's size)
inline constexpr double most = 1e-2;         // damping above this finds nothing (of the same)
inline constexpr double share = 1e-8;        // of the cost while it still counts (of the same) ...
inline constexpr double last_share = 1e-12;  // ... and then, where the pose hardly tells joints apart
inline constexpr double still = 1e-15;       // rad: a shorter move is none
inline constexpr double exact = 2e-15;       // a pose this near is not bettered (of the arm's size; rad)
inline constexpr double meets = 1e-13;       // a pose this near is met (of the same)
inline constexpr double same = 4e-15;        // a pose this near is the pose (of the same; of a unit vector)
}  // namespace settled_rule

/// What draws a posture on its way to a pose: joint j by weight[j] towards near[j].
struct Drawing {
    double weight[joints] = {}, near[joints] = {};
};

namespace detail {

/// Half of what a posture costs on the way: the square of the rest, and the pull.
inline double settling_cost(const Drawing& pull, double share, const double* q, double distance) noexcept {
    double sum = distance * distance;
    for (int j = 0; j < joints; ++j) {
        const double off = q[j] - pull.near[j];
        if (share > 0 && pull.weight[j] > 0) sum += share * pull.weight[j] * off * off;
    }
    return 0.5 * sum;
}

/// The least |A x - b|^2: six rows of a pose, and one for each joint that holds it or draws it.
struct JointLeastSquares {
    static constexpr int rows = 6 + joints;
    double A[rows][joints] = {}, b[rows] = {};

    /// Over the joints marked free, the others held at x; by Householder's reflections.
    void solve(const bool (&free)[joints], double (&x)[joints]) const noexcept {
        double R[rows][joints], y[rows];
        int index[joints], n = 0;
        for (int j = 0; j < joints; ++j)
            if (free[j]) index[n++] = j;
        for (int i = 0; i < rows; ++i) {
            y[i] = b[i];
            for (int j = 0; j < joints; ++j)
                if (!free[j]) y[i] -= A[i][j] * x[j];
            for (int k = 0; k < n; ++k) R[i][k] = A[i][index[k]];
        }
        for (int k = 0; k < n; ++k) {
            double size = 0;
            for (int i = k; i < rows; ++i) size += R[i][k] * R[i][k];
            const double along = R[k][k] > 0 ? -sqrt(size) : sqrt(size);
            if (size == 0) continue;
            const double head = R[k][k] - along, factor = 1.0 / (along * head);  // -2 / |v|^2
            const auto reflect = [&](double (&column)[rows]) {
                double sum = head * column[k];
                for (int i = k + 1; i < rows; ++i) sum += R[i][k] * column[i];
                sum *= factor;
                column[k] += sum * head;
                for (int i = k + 1; i < rows; ++i) column[i] += sum * R[i][k];
            };
            for (int m = k + 1; m < n; ++m) {
                double column[rows];
                for (int i = 0; i < rows; ++i) column[i] = R[i][m];
                reflect(column);
                for (int i = k; i < rows; ++i) R[i][m] = column[i];
            }
            reflect(y);
            R[k][k] = along;
        }
        for (int k = n - 1; k >= 0; --k) {
            for (int m = k + 1; m < n; ++m) y[k] -= R[k][m] * y[m];
            y[k] = R[k][k] != 0 ? y[k] / R[k][k] : 0.0;
            x[index[k]] = y[k];
        }
    }

    /// The same problem by its normal equations: signs of its slopes are good enough for an active set.
    JointQuadratic quadratic() const noexcept {
        JointQuadratic out{};
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < joints; ++j) {
                out.g[j] += A[i][j] * b[i];
                for (int k = 0; k < joints; ++k) out.H[j][k] += A[i][j] * A[i][k];
            }
        return out;
    }
};

/// The rows of a posture: its pose, then its pull and the damping (m^2/rad^2).
template <class A>
JointLeastSquares settling_rows(const A& arm, const double* q, const Twist& rest, const Drawing& pull,
                                double share, double damping) noexcept {
    const Jacobian J = jacobian(arm, q);
    const double length = nominal(arm).size, r[6] = {rest.linear.x,  rest.linear.y,  rest.linear.z,
                                                     rest.angular.x, rest.angular.y, rest.angular.z};
    JointLeastSquares out;
    for (int i = 0; i < 6; ++i) {
        const double unit = i < 3 ? 1.0 : length;
        out.b[i] = unit * r[i];
        for (int j = 0; j < joints; ++j) out.A[i][j] = unit * J.entry[i][j];
    }
    for (int j = 0; j < joints; ++j) {
        const double w = share > 0 ? share * pull.weight[j] : 0.0, hold = sqrt(damping + w);
        out.A[6 + j][j] = hold;
        out.b[6 + j] = w > 0 ? w * (pull.near[j] - q[j]) / hold : 0.0;
    }
    return out;
}

}  // namespace detail

/// The posture within limits from which no small move lowers distance^2 + share sum w (q - near)^2, from
/// `start`; `share` in m^2/rad^2. Each round is taken from `budget`; without a share it gives up where rounds
/// no longer lead to the pose.
template <class A>
Relaxed settled(const A& arm, const Limits& limits, const Joints& start, const Pose<double>& pose,
                const Drawing& pull, double share, int& budget) noexcept {
    const double length = nominal(arm).size, square = length * length;
    Relaxed best{start, 0};
    for (int j = 0; j < joints; ++j) best.at.q[j] = min(max(start.q[j], limits.lower[j]), limits.upper[j]);
    Twist rest;
    best.distance = detail::distance(arm, best.at.q, pose, length, rest);
    double cost = detail::settling_cost(pull, share, best.at.q, best.distance);
    double damping = settled_rule::damping, before = infinity;
    for (int round = 0; round < settled_rule::rounds && damping < settled_rule::most; ++round) {
        if (share == 0 && best.distance <= settled_rule::exact * length) break;
        if (round % settled_rule::patience == 0) {
            if (share == 0 && best.distance > 0.5 * before) break;
            before = best.distance;
        }
        if (--budget < 0) break;
        const detail::JointLeastSquares rows =
            detail::settling_rows(arm, best.at.q, rest, pull, share, damping * square);
        double lower[joints], upper[joints], move[joints] = {}, longest = 0;
        for (int j = 0; j < joints; ++j) {
            lower[j] = max(limits.lower[j] - best.at.q[j], -settled_rule::longest);
            upper[j] = min(limits.upper[j] - best.at.q[j], settled_rule::longest);
        }
        minimise(rows.quadratic(), lower, upper, move,
                 [&rows](const bool (&free)[joints], double (&y)[joints]) noexcept { rows.solve(free, y); });
        Relaxed next = best;
        for (int j = 0; j < joints; ++j) {
            next.at.q[j] = min(max(best.at.q[j] + move[j], limits.lower[j]), limits.upper[j]);
            longest = max(longest, abs(next.at.q[j] - best.at.q[j]));
        }
        if (!(longest > settled_rule::still)) break;
        Twist next_rest;
        next.distance = detail::distance(arm, next.at.q, pose, length, next_rest);
        const double next_cost = detail::settling_cost(pull, share, next.at.q, next.distance);
        if (next_cost < cost) {
            best = next;
            rest = next_rest;
            cost = next_cost;
            damping = max(1e-3 * damping, settled_rule::damping);
        } else {
            damping *= 1e3;
        }
    }
    return best;
}

/// Whether a settled posture meets the pose.
template <class A>
bool meets(const A& arm, const Relaxed& at) noexcept {
    return at.distance <= settled_rule::meets * nominal(arm).size;
}

/// The start settled on the pose, and then where it is drawn to beside that: the best of them on the pose.
template <class A>
Relaxed settled_beside(const A& arm, const Limits& limits, const Joints& start, const Pose<double>& pose,
                       const Drawing& pull, int& budget) noexcept {
    const double size = nominal(arm).size;
    const auto drawn = [&pull](const Relaxed& x) { return detail::settling_cost(pull, 1.0, x.at.q, 0.0); };
    Relaxed best = settled(arm, limits, start, pose, pull, 0.0, budget), from = best;
    for (const double share : {settled_rule::share, settled_rule::last_share}) {
        const Relaxed beside = settled(arm, limits, from.at, pose, pull, share * size * size, budget);
        from = settled(arm, limits, beside.at, pose, pull, 0.0, budget);
        if (meets(arm, from) && !(meets(arm, best) && drawn(best) <= drawn(from))) best = from;
    }
    return best;
}

/// Whether two poses are one but for rounding, of an arm of this size (m).
inline bool same_pose(double size, const Pose<double>& pose, const Pose<double>& other) noexcept {
    const auto far = [](const Vec3<double>& a, const Vec3<double>& b) {
        const Vec3<double> d = a - b;
        return max(max(abs(d.x), abs(d.y)), abs(d.z));
    };
    const auto &r = pose.rotation, &s = other.rotation;
    return far(pose.position, other.position) <= settled_rule::same * size &&
           max(max(far(r.x, s.x), far(r.y, s.y)), far(r.z, s.z)) <= settled_rule::same;
}

}  // namespace armangle

#include "../names/end.hpp"
