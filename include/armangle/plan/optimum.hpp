// The best curve of a branch: descents from several curves, first on few knots, then the best of them on as
// many as it takes.
//
//     phi |  ____________  psi held       starting curves: the way of the search, and the naive ones, where
//         | ..............  phi held      they keep the limits, so that the result is never worse than they
//         |    x..x--x      the way
//         +---------------- s
#pragma once

#include "descent.hpp"
#include "search.hpp"

namespace armangle {

namespace optimum_rule {
inline constexpr int coarse = 12;          // intervals of the curves that are compared ...
inline constexpr int middling = 48;        // ... and where none of those keeps the limits
inline constexpr int held = 48;            // constant angles that are tried where the start is open
inline constexpr int layers = 48;          // sections on which they are looked at first
inline constexpr int descents = 2;         // of the starting curves, the best ones
inline constexpr double narrowest = 1e-4;  // interval that is not halved (of s)
}  // namespace optimum_rule

/// A curve of a branch and what it is worth.
struct Optimum {
    Spline curve;
    double energy = infinity;        // the objective, and the wall before the limits
    double stationarity = infinity;  // the share of it that another step would save
    Terms terms;
    double margin = -infinity;  // rad: the least distance at its Gauss points
    double q[joints] = {};      // at the first of them: the windings

    bool found() const noexcept { return energy < infinity; }
};

namespace detail {

inline Optimum result(Descent& descent, const std::vector<double>& breaks) {
    Optimum out{{breaks, descent.control()},
                descent.energy(),
                descent.stationarity(),
                descent.terms(),
                descent.margin(),
                {}};
    std::copy(descent.first_q(), descent.first_q() + joints, out.q);
    return out;
}

/// Where descents begin, and the best of them.
class Comparison {
public:
    Comparison(const Task& task, const Objective& objective, const Tube& tube, const Way& way,
               const FixedEnds& ends)
        : task_(task), objective_(objective), tube_(tube), way_(way), ends_(ends) {
        for (const Section& l : tube.sections) s_.push_back(l.s);
    }

    /// The best of the descents on few knots; on more where no starting curve keeps the limits there.
    Optimum run() {
        start();
        for (const int intervals : {optimum_rule::coarse, optimum_rule::middling}) {
            Optimum best = best_of(quadrature(task_, tube_.gc, even(intervals), false));
            if (best.found()) return best;
        }
        return {};
    }

private:
    static std::vector<double> even(int intervals) {
        std::vector<double> out;
        for (int i = 0; i <= intervals; ++i) out.push_back(static_cast<double>(i) / intervals);
        return out;
    }

    /// psi - phi at a section: the angle between the two zeros.
    double offset(const Section& l) const noexcept {
        const Triad<double> own = triad(task_.arm, flange_pose(task_.arm, task_.pose(l.s)));
        return arm_angle(own, l.motion.circle.z);
    }

    void start() {
        curves_.clear();
        std::vector<double> phi, turn;
        for (const Candidate& x : way_.rows) phi.push_back(x.phi);
        for (const Section& l : tube_.sections) {
            const double now = offset(l);
            turn.push_back(turn.empty() ? now : lift(now, turn.back()));
        }
        const double first = phi.front(), last = phi.back();
        curves_.push_back(phi);
        if (ends_.first && ends_.last) {
            for (std::size_t k = 0; k < phi.size(); ++k) phi[k] = first + s_[k] * (last - first);
            curves_.push_back(phi);
        } else if (ends_.first || ends_.last) {
            held(ends_.first ? first : last, turn, ends_.first ? turn.front() : turn.back());
        } else {
            for (int i = 0; i < optimum_rule::held; ++i) held(i * two_pi / optimum_rule::held, turn, 0.0);
        }
    }

    /// Adds the curves of constant phi and of constant psi that have `phi` where psi - phi is `zero`, as far
    /// as they stay on arcs.
    void held(double phi, const std::vector<double>& turn, double zero) {
        std::vector<double> same(turn.size(), phi), psi;
        for (const double t : turn) psi.push_back(phi + zero - t);
        if (on_arcs(same)) curves_.push_back(std::move(same));
        if (on_arcs(psi)) curves_.push_back(std::move(psi));
    }

    bool on_arcs(const std::vector<double>& phi) const noexcept {
        const std::size_t stride = phi.size() / optimum_rule::layers + 1;
        for (std::size_t k = 0; k < phi.size(); k += stride) {
            const Section& l = tube_.sections[k];
            if (l.full) continue;
            const Arc& a = tube_.arc(l)[nearest_arc(tube_, l, phi[k])];
            const double middle = 0.5 * (a.lower + a.upper);
            if (abs(lift(phi[k], middle) - middle) > 0.5 * (a.upper - a.lower) + tolerance::angle)
                return false;
        }
        return true;
    }

    Optimum best_of(const Quadrature& q) {
        struct Start {
            double energy;
            std::size_t curve;
        };
        std::vector<Start> order;
        for (std::size_t i = 0; i < curves_.size(); ++i) {
            Descent descent(task_, objective_, ends_);
            if (descent.stand(q, spline(q.breaks, s_, curves_[i]).control))
                order.push_back({descent.energy(), i});
        }
        std::stable_sort(order.begin(), order.end(),
                         [](const Start& a, const Start& b) { return a.energy < b.energy; });
        Optimum best;
        for (std::size_t i = 0; i < order.size() && i < optimum_rule::descents; ++i) {
            Descent descent(task_, objective_, ends_);
            descent.stand(q, spline(q.breaks, s_, curves_[order[i].curve]).control);
            descent.run(descent_rule::rough);
            if (descent.energy() < best.energy) best = detail::result(descent, q.breaks);
        }
        return best;
    }

    const Task& task_;
    const Objective& objective_;
    const Tube& tube_;
    const Way& way_;
    FixedEnds ends_;
    std::vector<double> s_;
    std::vector<std::vector<double>> curves_;  // phi at the sections
};

}  // namespace detail

/// The best curve of a branch on few knots: of descents from its way and from the naive curves.
inline Optimum coarse_optimum(const Task& task, const Objective& objective, const Tube& tube, const Way& way,
                              const FixedEnds& ends) {
    return detail::Comparison(task, objective, tube, way, ends).run();
}

/// A curve and what it is worth, not moved.
inline Optimum as_it_is(const Task& task, const Objective& objective, int gc, const FixedEnds& ends,
                        const Spline& curve) {
    const Quadrature q = quadrature(task, gc, curve.breaks, true);
    Descent descent(task, objective, ends);
    if (descent.stand(q, curve.control)) return detail::result(descent, curve.breaks);
    Optimum out;
    out.curve = curve;
    return out;
}

/// The optimum next to a curve, on as many knots as its bends need; none where the curve itself leaves the
/// limits.
inline Optimum fine_optimum(const Task& task, const Objective& objective, int gc, FixedEnds ends,
                            Spline now) {
    Optimum out;
    for (int level = 0; level <= descent_rule::levels; ++level) {
        const Quadrature q = quadrature(task, gc, now.breaks, true);
        Descent descent(task, objective, ends);
        if (!descent.stand(q, now.control)) break;
        descent.run(descent_rule::done);
        now.control = descent.control();
        out = detail::result(descent, now.breaks);
        std::copy(out.q, out.q + joints, ends.q);
        std::vector<double> finer = descent.finer(optimum_rule::narrowest);
        if (finer.size() == now.breaks.size()) break;
        now = refined(now, finer);
    }
    return out;
}

}  // namespace armangle
