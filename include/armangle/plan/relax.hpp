// Smooths a path inside its tube: least joint travel and margin over continuous phi.
//
//     phi |======.....=======            the configurations of the grid (x) slide along their arcs to the
//         |   x.      .x                 balance of travel and cost (.); only neighbours are coupled, so
//         |   . `x..x'  .                one step is a tridiagonal system
//         +------------------- s
//
// Gauss-Newton steps with Marquardt's damping (D. Marquardt, 1963), each solved by the Thomas algorithm
// (Gaussian elimination of a tridiagonal matrix, without pivoting).
#pragma once

#include "way.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace relax_tuning {
inline constexpr int rounds = 30;
inline constexpr double step = 0.15;   // largest change of phi in one round (rad)
inline constexpr double done = 1e-5;   // a round with a smaller move is the last (rad)
inline constexpr double inset = 0.02;  // from the ends of an arc (rad), or this share of narrow ones:
inline constexpr double narrow = 0.1;
inline constexpr double steepest = 1e3;  // upper bound used for dq/dphi
}  // namespace relax_tuning

namespace detail {

/// Minimizes joint travel and margin costs over phi at the rows of a path, by damped Gauss-Newton steps.
class Relaxation {
public:
    /// Keeps references to a path `way`, whose phi it changes except at fixed ends, and reserves its memory.
    Relaxation(const Task& task, const Tube& tube, const Objective& objective, Way& way, bool first_fixed,
               bool last_fixed, double floor)
        : task_(task), tube_(tube), objective_(objective), way_(way), floor_(floor) {
        n_ = way.rows.size();
        free_.assign(n_, true);
        if (first_fixed) free_[0] = false;
        if (last_fixed) free_[n_ - 1] = false;
        slope_.resize(n_ * joints);
        gradient_.resize(n_);
        diagonal_.resize(n_);
        off_.resize(n_);
        move_.resize(n_);
        best_.resize(n_);
    }

    /// Minimizes the cost.
    void run() {
        if (n_ < 2) return;
        double damping = 1e-3, energy = assemble();
        for (int round = 0; round < relax_tuning::rounds; ++round) {
            solve(damping);
            for (std::size_t k = 0; k < n_; ++k) best_[k] = way_.rows[k];
            const double most = apply();
            const double now = assemble();
            if (now < energy) {
                energy = now;
                damping = max(damping * 0.3, 1e-6);
                if (most < relax_tuning::done) return;
            } else {
                for (std::size_t k = 0; k < n_; ++k) way_.rows[k] = best_[k];
                if (damping > 1e6) return;
                damping *= 10;
                assemble();
            }
        }
    }

private:
    /// The length in s from section k to the next.
    double span(std::size_t k) const noexcept { return tube_.sections[k + 1].s - tube_.sections[k].s; }
    /// The length in s that belongs to section k.
    double share(std::size_t k) const noexcept {
        return 0.5 * ((k ? span(k - 1) : 0.0) + (k + 1 < n_ ? span(k) : 0.0));
    }
    /// The seven derivatives of the joints by phi at section k.
    double* slope(std::size_t k) noexcept { return slope_.data() + k * joints; }

    /// Computes the cost, its gradient and the Gauss-Newton matrix at the present path.
    double assemble() {
        double energy = 0;
        for (std::size_t k = 0; k < n_; ++k) {
            gradient_[k] = diagonal_[k] = off_[k] = 0;
            const Joints rate =
                armangle::rate(task_.arm, tube_.sections[k].functions, sin_cos(way_.rows[k].phi));
            for (int j = 0; j < joints; ++j) {
                const double r = rate.q[j];
                slope(k)[j] = max(-relax_tuning::steepest, min(relax_tuning::steepest, r));
            }
            energy += barrier(k);
        }
        for (std::size_t k = 0; k + 1 < n_; ++k) energy += travel(k);
        return energy;
    }

    /// Adds the joint travel from row k to the next.
    double travel(std::size_t k) {
        const double w = objective_.travel / span(k);
        const Candidate &a = way_.rows[k], &b = way_.rows[k + 1];
        double sum = 0;
        for (int j = 0; j < joints; ++j) {
            const double d = b.q[j] - a.q[j], sa = slope(k)[j], sb = slope(k + 1)[j];
            sum += d * d;
            gradient_[k] -= 2 * w * d * sa;
            gradient_[k + 1] += 2 * w * d * sb;
            diagonal_[k] += 2 * w * sa * sa;
            diagonal_[k + 1] += 2 * w * sb * sb;
            off_[k] -= 2 * w * sa * sb;
        }
        return w * sum;
    }

    /// Adds the cost of the distances of configuration k, each taken as linear in phi. The second derivative
    /// of c = 1 / d^2 would be 3 c'^2 / (2 c); in this form it stays positive on the tangent below the floor.
    double barrier(std::size_t k) {
        using Slope = Jet<double, 1>;
        Slope q[joints];
        for (int j = 0; j < joints; ++j) {
            q[j].coefficient[0] = way_.rows[k].q[j];
            q[j].coefficient[1] = slope(k)[j];
        }
        double sum = 0;
        const double scale = task_.margin_scale();
        distances(task_, q, [&](const Slope& distance, Kind kind) {
            const Slope here =
                Slope(share(k) * scale * weight(objective_, kind)) * cost(distance, kind, objective_.enough);
            if (!(here.value() > 0)) return;
            const double slope = here.coefficient[1];
            sum += here.value();
            gradient_[k] += slope;
            diagonal_[k] += 1.5 * slope * slope / here.value();
        });
        return sum;
    }

    /// Computes the step -(H + damping diag H)^-1 gradient by the Thomas algorithm; fixed ends do not move.
    void solve(double damping) {
        double carried = 0, before = 0;
        for (std::size_t k = 0; k < n_; ++k) {
            const bool linked = k > 0 && free_[k] && free_[k - 1];
            const double below = linked ? off_[k - 1] : 0.0;
            const double pivot = (free_[k] ? diagonal_[k] * (1 + damping) + 1e-12 : 1.0) - below * carried;
            const double right = (free_[k] ? -gradient_[k] : 0.0) - below * before;
            carried = (k + 1 < n_ && free_[k] && free_[k + 1] ? off_[k] : 0.0) / pivot;
            before = right / pivot;
            off_[k] = carried;
            move_[k] = before;
        }
        for (std::size_t k = n_ - 1; k-- > 0;) move_[k] -= off_[k] * move_[k + 1];
    }

    /// Moves every configuration as far as its arc and the floor allow; returns the largest change of phi
    /// (rad).
    double apply() {
        double most = 0;
        for (std::size_t k = 0; k < n_; ++k) {
            if (!free_[k]) continue;
            const Section& l = tube_.sections[k];
            const Candidate old = way_.rows[k];
            double step = min(max(move_[k], -relax_tuning::step), relax_tuning::step);
            for (int half = 0; half < 4; ++half, step *= 0.5) {
                Candidate x = old;
                x.phi = held(l, old, old.phi + step);
                const double phi[8] = {x.phi};
                const EightThetas solved(l, phi);
                for (int j = 0; j < joints; ++j)
                    x.q[j] = lift(to_q(task_.arm, j, solved.theta[j][0]), old.q[j]);
                x.worth = rating(task_, objective_, x.q);
                if (!within_limits(task_.limits, x.q, tolerance::angle) ||
                    x.worth.margin < min(floor_, old.worth.margin))
                    continue;
                most = max(most, abs(x.phi - old.phi));
                way_.rows[k] = x;
                break;
            }
        }
        return most;
    }

    /// Restricts phi to its arc; a phi that was outside may stay where it was.
    double held(const Section& l, const Candidate& old, double phi) const noexcept {
        if (l.full) return phi;
        const Arc& a = tube_.arc(l)[old.arc];
        const double middle = 0.5 * (a.lower + a.upper), turn = lift(middle, old.phi) - middle;
        const double inset = min(relax_tuning::inset, relax_tuning::narrow * (a.upper - a.lower));
        return min(max(phi, min(a.lower + turn + inset, old.phi)), max(a.upper + turn - inset, old.phi));
    }

    const Task& task_;
    const Tube& tube_;
    const Objective& objective_;
    Way& way_;
    double floor_;
    std::size_t n_;
    std::vector<bool> free_;
    std::vector<double> slope_, gradient_, diagonal_, off_, move_;
    std::vector<Candidate> best_;
};

}  // namespace detail

/// Moves the inner configurations of a path (and its ends, unless fixed) in place, so that joints travel
/// less. Distances from limits above `floor` (rad) stay above it.
inline void relax(const Task& task, const Tube& tube, const Objective& objective, Way& way, bool first_fixed,
                  bool last_fixed, double floor) {
    detail::Relaxation(task, tube, objective, way, first_fixed, last_fixed, floor).run();
}

}  // namespace armangle

#include "../names/end.hpp"
