// The best curve of a branch: descents from several curves, first on few knots, then the best of them on as
// many as needed.
//
//     phi |  ____________  psi held       starting curves: the path of the search, and curves of constant
//         | ..............  phi held      angle, if they respect the limits, so that the result is never
//         |    x..x--x      the path      worse than they
//         +---------------- s
#pragma once

#include "descent.hpp"
#include "way.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace optimum_tuning {
inline constexpr int coarse = 12;       // intervals of the curves that are compared ...
inline constexpr int middling = 48;     // ... and if none of those respects the limits
inline constexpr int held = 48;         // constant angles that are tried if the start is free
inline constexpr std::size_t many = 6;  // with more starting curves, a quick evaluation selects the best
inline constexpr int starting_intervals = 6;        // ... on so many intervals
inline constexpr double near_better = 0.4;          // of phi at both ends: counts as near a better one (rad)
inline constexpr double soon[] = {0.03, 0.1, 0.3};  // of s: distance from a fixed end to a target for psi
inline constexpr double inset = 0.02;               // of that target from the ends of its arc (rad)
inline constexpr int layers = 48;                   // sections on which starting curves are first evaluated
inline constexpr int descents = 3;                  // of the best starting curves
inline constexpr double beside[] = {1e-4, 1e-3, 5e-3,
                                    0.02};  // of a fixed end: more breaks, because it may be left fast
inline constexpr double narrowest = 1e-4;   // intervals up to this length are not halved (of s)
}  // namespace optimum_tuning

/// A curve of a branch with its rating.
struct Optimum {
    Spline curve;
    double energy = infinity;        // the objective, and the wall before the limits
    double stationarity = infinity;  // the share of it that another step would save
    Terms terms;
    double margin = -infinity;  // rad: the least distance at its Gauss points
    double q[joints] = {};      // at the first of them: determines the turns

    /// Whether a curve was found.
    bool found() const noexcept { return energy < infinity; }
};

namespace detail {

/// The curve that a descent has reached on these breaks, with its objective and margins.
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

/// Whether a has a lower objective than b.
inline bool less(const Optimum& a, const Optimum& b) noexcept { return a.energy < b.energy; }

/// Compares starting curves and improves the best of them.
class Comparison {
public:
    /// Keeps references to a branch's tube, its path of largest margin `way` and of least cost `cheap`, and a
    /// copy of `ends`.
    Comparison(const Task& task, const Objective& objective, const Tube& tube, const Way& way,
               const Way& cheap, const FixedEnds& ends)
        : task_(task), objective_(objective), tube_(tube), way_(way), cheap_(cheap), ends_(ends) {
        for (const Section& l : tube.sections) s_.push_back(l.s);
    }

    /// Returns the minima found on few knots, the best first. Uses more knots if no starting curve respects
    /// the limits there.
    std::vector<Optimum> run() {
        start();
        for (const int intervals : {optimum_tuning::coarse, optimum_tuning::middling}) {
            std::vector<Optimum> best = best_of(quadrature(task_, tube_.gc, breaks(intervals), false));
            if (!best.empty()) return best;
        }
        return {};
    }

private:
    /// Breaks of s from 0 to 1: equal intervals, and more breaks near a fixed end.
    std::vector<double> breaks(int intervals) const {
        std::vector<double> out{0.0};
        for (const double s : optimum_tuning::beside)
            if (ends_.first) out.push_back(s);
        for (int i = 1; i < intervals; ++i) out.push_back(static_cast<double>(i) / intervals);
        for (std::size_t i = std::size(optimum_tuning::beside); i-- > 0;)
            if (ends_.last) out.push_back(1.0 - optimum_tuning::beside[i]);
        out.push_back(1.0);
        return out;
    }

    /// The difference psi - phi (rad) at each section, for one definition of psi.
    std::vector<double> offsets(Reference reference) const {
        Arm arm = task_.arm;
        arm.reference = reference;
        std::vector<double> out;
        for (const Section& l : tube_.sections) {
            const Triad<double> own = triad(arm, flange_pose(arm, task_.pose(l.s)));
            const double now = arm_angle(own, l.motion.circle.z);
            out.push_back(out.empty() ? now : lift(now, out.back()));
        }
        return out;
    }

    /// Collects the curves from which descents begin.
    void start() {
        curves_.clear();
        std::vector<double> phi;
        for (const Candidate& x : way_.rows) phi.push_back(x.phi);
        const double first = phi.front(), last = phi.back();
        curves_.push_back(phi);
        if (cheap_.whole) {
            std::vector<double> other;
            for (const Candidate& x : cheap_.rows) other.push_back(x.phi);
            curves_.push_back(std::move(other));
        }
        if (task_.wish && objective_.psi > 0) wish(first, last);
        if (ends_.first && ends_.last) {
            for (std::size_t k = 0; k < phi.size(); ++k) phi[k] = first + s_[k] * (last - first);
            curves_.push_back(phi);
            return;
        }
        held(std::vector<double>(tube_.sections.size(), 0.0), first, last);
        held(offsets(Reference::base), first, last);
        held(offsets(Reference::stereographic), first, last);
        if (task_.arm.reference == Reference::vector) held(offsets(Reference::vector), first, last);
    }

    /// Adds the curves that follow the target for psi as nearly as the arcs allow. They leave a fixed start
    /// (reach a fixed goal) sooner or later.
    void wish(double first, double last) {
        std::vector<double> wished;
        for (const Section& l : tube_.sections) {
            const double before = wished.empty() ? first : wished.back(),
                         now = task_.wished_phi(tube_.gc, l.s);
            wished.push_back(now == now ? lift(now, before) : before);
        }
        for (const double soon : optimum_tuning::soon) {
            std::vector<double> phi = wished;
            for (std::size_t k = 0; k < phi.size(); ++k) {
                if (ends_.first) phi[k] += (first - wished.front()) * std::exp(-s_[k] / soon);
                if (ends_.last)
                    phi[k] += (lift(last, wished.back()) - wished.back()) * std::exp((s_[k] - 1) / soon);
                phi[k] = on_arc(tube_.sections[k], phi[k]);
            }
            curves_.push_back(std::move(phi));
            if (!ends_.first && !ends_.last) break;
        }
    }

    /// Returns phi, moved into the nearest arc and away from its ends by `inset`.
    double on_arc(const Section& l, double phi) const noexcept {
        if (l.full || l.count == 0) return phi;
        const Arc& a = tube_.arc(l)[nearest_arc(tube_, l, phi)];
        const double middle = 0.5 * (a.lower + a.upper), turn = lift(middle, phi) - middle;
        const double inset = min(optimum_tuning::inset, 0.5 * (a.upper - a.lower));
        return min(max(phi, a.lower + turn + inset), a.upper + turn - inset);
    }

    /// Adds the curves on which phi + turn is constant, through a fixed end, or else with many constants, if
    /// they stay on the arcs.
    void held(const std::vector<double>& turn, double first, double last) {
        if (ends_.first) {
            add(turn, first + turn.front());
        } else if (ends_.last) {
            add(turn, last + turn.back());
        } else {
            for (int i = 0; i < optimum_tuning::held; ++i) add(turn, i * two_pi / optimum_tuning::held);
        }
    }
    /// Adds the starting curve phi = sum - turn, if it is in the arcs.
    void add(const std::vector<double>& turn, double sum) {
        std::vector<double> phi;
        for (const double t : turn) phi.push_back(sum - t);
        if (on_arcs(phi)) curves_.push_back(std::move(phi));
    }

    /// Whether a curve stays on the arcs, tested at some sections.
    bool on_arcs(const std::vector<double>& phi) const noexcept {
        const std::size_t stride = phi.size() / optimum_tuning::layers + 1;
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

    struct Start {
        double energy;
        std::size_t curve;
    };

    /// Those of `curves` that respect the limits on a quadrature, with their objectives, the lowest first;
    /// empty if none does.
    std::vector<Start> sorted(const Quadrature& q, const std::vector<Start>& curves) const {
        std::vector<Start> out;
        for (const Start& x : curves) {
            Descent descent(task_, objective_, ends_);
            const double energy = descent.objective_of(q, spline(q.breaks, s_, curves_[x.curve]).control);
            if (energy < infinity) out.push_back({energy, x.curve});
        }
        std::stable_sort(out.begin(), out.end(),
                         [](const Start& a, const Start& b) { return a.energy < b.energy; });
        return out;
    }

    /// The first of the rated curves, at most `many`, without those that begin and end near a better one:
    /// they would lead to the same minimum.
    std::vector<Start> apart(const std::vector<Start>& all) const {
        std::vector<Start> out;
        for (const Start& x : all) {
            const std::vector<double>& phi = curves_[x.curve];
            const bool seen = std::any_of(out.begin(), out.end(), [&](const Start& y) {
                const std::vector<double>& other = curves_[y.curve];
                return abs(wrap(phi.front() - other.front())) < optimum_tuning::near_better &&
                       abs(wrap(phi.back() - other.back())) < optimum_tuning::near_better;
            });
            if (!seen) out.push_back(x);
            if (out.size() == optimum_tuning::many) break;
        }
        return out;
    }

    /// Improves the best starting curves on a quadrature; the best result first, empty if no curve respects
    /// the limits.
    std::vector<Optimum> best_of(const Quadrature& q) const {
        std::vector<Start> order;
        for (std::size_t i = 0; i < curves_.size(); ++i) order.push_back({0.0, i});
        if (order.size() > optimum_tuning::many) {
            const Quadrature few =
                quadrature(task_, tube_.gc, breaks(optimum_tuning::starting_intervals), false, 2);
            order = apart(sorted(few, order));
            order.push_back({0.0, 0});
        }
        order = sorted(q, order);
        std::vector<Optimum> out;
        for (std::size_t i = 0; i < order.size() && i < optimum_tuning::descents; ++i) {
            long long work = descent_tuning::work;
            Descent descent(task_, objective_, ends_);
            descent.stand(q, spline(q.breaks, s_, curves_[order[i].curve]).control);
            descent.run(descent_tuning::rough, work);
            out.push_back(detail::result(descent, q.breaks));
        }
        std::stable_sort(out.begin(), out.end(), less);
        return out;
    }

    const Task& task_;
    const Objective& objective_;
    const Tube& tube_;
    const Way &way_, &cheap_;
    FixedEnds ends_;
    std::vector<double> s_;
    std::vector<std::vector<double>> curves_;  // phi at the sections
};

}  // namespace detail

/// The best curves of a branch on few knots, the best first; empty if none respects the limits. The starting
/// curves are its path of largest margin, its path of least cost (ignored if not whole), and curves of
/// constant angle.
inline std::vector<Optimum> coarse_optima(const Task& task, const Objective& objective, const Tube& tube,
                                          const Way& way, const Way& cheap, const FixedEnds& ends) {
    return detail::Comparison(task, objective, tube, way, cheap, ends).run();
}

/// Computes the objective and margins of a curve without changing it; not found() if it violates limits.
inline Optimum as_it_is(const Task& task, const Objective& objective, int gc, const FixedEnds& ends,
                        const Spline& curve) {
    const Quadrature q = quadrature(task, gc, curve.breaks, true);
    Descent descent(task, objective, ends);
    if (descent.stand(q, curve.control)) return detail::result(descent, curve.breaks);
    Optimum out;
    out.curve = curve;
    return out;
}

/// The minimum next to a curve, on as many knots as its bends need. Not found if the curve itself violates
/// limits. wall: one of descent_tuning::wall.
inline Optimum fine_optimum(const Task& task, const Objective& objective, int gc, FixedEnds ends, Spline now,
                            double wall) {
    Optimum out;
    long long work = descent_tuning::work;
    for (int level = 0; level <= descent_tuning::levels && work > 0; ++level) {
        const Quadrature q = quadrature(task, gc, now.breaks, true);
        Descent descent(task, objective, ends, wall);
        if (!descent.stand(q, now.control)) break;
        descent.run(descent_tuning::done, work);
        now.control = descent.control();
        out = detail::result(descent, now.breaks);
        std::copy(out.q, out.q + joints, ends.q);
        std::vector<double> finer = descent.finer(optimum_tuning::narrowest);
        if (finer.size() == now.breaks.size()) break;
        now = refined(now, finer);
    }
    return out;
}

/// The minima next to several rated curves, the best first; empty if none is found. Curves worse than a
/// minimum already found are left out.
inline std::vector<Optimum> fine_optima(const Task& task, const Objective& objective, int gc,
                                        const FixedEnds& ends, const std::vector<Optimum>& coarse,
                                        double wall) {
    std::vector<Optimum> out;
    double least = infinity;
    for (const Optimum& x : coarse) {
        if (!(x.energy < least)) break;
        FixedEnds own = ends;
        std::copy(x.q, x.q + joints, own.q);
        Optimum now = fine_optimum(task, objective, gc, own, x.curve, wall);
        if (!now.found()) continue;
        least = min(least, now.energy);
        out.push_back(std::move(now));
    }
    std::stable_sort(out.begin(), out.end(), detail::less);
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
