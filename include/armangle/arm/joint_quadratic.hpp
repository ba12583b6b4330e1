// Bounded least squares over seven joints: min 1/2 x' H x - g' x, lower <= x <= upper.
//
// An active-set method. Each sweep solves for the free joints and stops at the first bound, which it
// activates. If no bound interferes, it releases the bound with the steepest descent, and ends if the
// released joint stops at once at this bound again: then the descent was rounding. Every sweep lowers the
// cost. If the sweeps run out, the result is still feasible and better than the start.
// Source: J. Nocedal, S. Wright, Numerical Optimization (2006), algorithm 16.3.
#pragma once

#include <type_traits>

#include "limits.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The cost 1/2 x' H x - g' x of a joint displacement x.
struct JointQuadratic {
    double H[joints][joints];  // symmetric, positive definite
    double g[joints];
};

/// Parameters of the bounded least squares over joints.
struct JointQuadraticTuning {
    static constexpr int sweeps = 24;
    static constexpr double pull = 1e-12;  // a bound stays active if its multiplier is below this share of g
};

namespace detail {

/// LDL' factorization of a symmetric matrix of n rows with entries entry(a, b); n may be a constant.
struct Factors {
    double L[joints][joints], inverse[joints];  // of D

    /// Factorizes the symmetric positive definite matrix with entries entry(a, b).
    template <class Count, class Entry>
    void of(Count n, const Entry& entry) noexcept {
        for (int a = 0; a < n; ++a) {
            double whole[joints], rest = entry(a, a);
            for (int b = 0; b < a; ++b) {
                whole[b] = entry(a, b);
                for (int k = 0; k < b; ++k) whole[b] -= whole[k] * L[b][k];
                L[a][b] = whole[b] * inverse[b];
                rest -= whole[b] * L[a][b];
            }
            inverse[a] = 1.0 / max(rest, 1e-300);
        }
    }

    /// Solves for one right-hand side of n numbers: y holds it on entry and the solution on return.
    template <class Count>
    void solve(Count n, double (&y)[joints]) const noexcept {
        for (int a = 0; a < n; ++a)
            for (int b = 0; b < a; ++b) y[a] -= L[a][b] * y[b];
        for (int a = n - 1; a >= 0; --a) {
            y[a] *= inverse[a];
            for (int k = a + 1; k < n; ++k) y[a] -= L[k][a] * y[k];
        }
    }
};

/// Solves H x = g for the joints marked free; the other joints keep their x.
inline void solve_free(const JointQuadratic& p, const bool (&free)[joints], double (&x)[joints]) noexcept {
    int index[joints], n = 0;
    for (int j = 0; j < joints; ++j)
        if (free[j]) index[n++] = j;
    double y[joints];
    for (int a = 0; a < n; ++a) {
        y[a] = p.g[index[a]];
        for (int j = 0; j < joints; ++j)
            if (!free[j]) y[a] -= p.H[index[a]][j] * x[j];
    }
    Factors factors;
    factors.of(n, [&](int a, int b) { return p.H[index[a]][index[b]]; });
    factors.solve(n, y);
    for (int a = 0; a < n; ++a) x[index[a]] = y[a];
}

}  // namespace detail

/// The unconstrained minimum of a cost, reusable for costs that differ in g alone.
class Unbounded {
public:
    /// Factorizes the quadratic form with all joints free.
    explicit Unbounded(const JointQuadratic& p) noexcept {
        factors_.of(all, [&p](int a, int b) { return p.H[a][b]; });
    }

    /// Stores in x the minimum for the linear term g.
    void minimise(const double (&g)[joints], double (&x)[joints]) const noexcept {
        for (int j = 0; j < joints; ++j) x[j] = g[j];
        factors_.solve(all, x);
    }

private:
    static constexpr std::integral_constant<int, joints> all{};
    detail::Factors factors_;
};

/// Minimizes the cost within the bounds; x is the start, which need not be within them, and the result.
/// solve(free, y) stores in y the minimum over the joints marked free, with the others fixed at y.
template <class Solve>
void minimise(const JointQuadratic& p, const double* lower, const double* upper, double (&x)[joints],
              const Solve& solve) noexcept {
    bool free[joints];
    double scale = 0;
    int released = -1;
    for (int j = 0; j < joints; ++j) {
        x[j] = min(max(x[j], lower[j]), upper[j]);
        free[j] = x[j] > lower[j] && x[j] < upper[j];
        scale = max(scale, abs(p.g[j]));
    }
    for (int sweep = 0; sweep < JointQuadraticTuning::sweeps; ++sweep) {
        double y[joints], share = 1.0;
        for (int j = 0; j < joints; ++j) y[j] = x[j];
        solve(free, y);
        int blocking = -1;
        for (int j = 0; j < joints; ++j) {
            if (!free[j]) continue;
            const double bound = y[j] < lower[j] ? lower[j] : upper[j];
            if (y[j] >= lower[j] && y[j] <= upper[j]) continue;
            const double part = (bound - x[j]) / (y[j] - x[j]);
            if (part < share || blocking < 0) {
                share = min(part, share);
                blocking = j;
            }
        }
        for (int j = 0; j < joints; ++j)
            if (free[j]) x[j] = min(max(x[j] + share * (y[j] - x[j]), lower[j]), upper[j]);
        if (blocking >= 0) {
            if (blocking == released && !(share > 0)) return;
            released = -1;
            x[blocking] = y[blocking] < lower[blocking] ? lower[blocking] : upper[blocking];
            free[blocking] = false;
            continue;
        }
        double worst = JointQuadraticTuning::pull * scale;
        released = -1;
        for (int j = 0; j < joints; ++j) {
            if (free[j] || !(lower[j] < upper[j])) continue;
            double slope = -p.g[j];
            for (int k = 0; k < joints; ++k) slope += p.H[j][k] * x[k];
            const double gain = x[j] <= lower[j] ? -slope : slope;
            if (gain > worst) {
                worst = gain;
                released = j;
            }
        }
        if (released < 0) return;
        free[released] = true;
    }
}
/// Minimizes the cost within the bounds; x is the start and the result.
inline void minimise(const JointQuadratic& p, const double* lower, const double* upper,
                     double (&x)[joints]) noexcept {
    minimise(p, lower, upper, x, [&p](const bool (&free)[joints], double (&y)[joints]) noexcept {
        detail::solve_free(p, free, y);
    });
}

}  // namespace armangle

#include "../names/end.hpp"
