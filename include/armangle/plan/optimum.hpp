// The best curve of a branch: the descent from the curve of its search, first on few knots, by which branches
// are compared, then on as many as needed.
#pragma once

#include "branch_search.hpp"
#include "descent.hpp"
#include "task_family.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the search of a branch's best curve.
struct OptimumTuning {
    static constexpr int coarse = 12;    // intervals of the curves of branches that are compared ...
    static constexpr int middling = 48;  // ... and if such a curve violates the limits
    static constexpr double beside[] = {1e-4, 1e-3, 5e-3,
                                        0.02};  // of a fixed end: more breaks, because it may be left fast
    static constexpr double narrowest = 1e-4;   // intervals up to this length are not halved (of s)
};

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

/// Breaks of s from 0 to 1: equal intervals, and more breaks near a fixed end.
inline std::vector<double> breaks(int intervals, const FixedEnds& ends) {
    std::vector<double> out{0.0};
    for (const double s : OptimumTuning::beside)
        if (ends.first) out.push_back(s);
    for (int i = 1; i < intervals; ++i) out.push_back(static_cast<double>(i) / intervals);
    for (std::size_t i = std::size(OptimumTuning::beside); i-- > 0;)
        if (ends.last) out.push_back(1.0 - OptimumTuning::beside[i]);
    out.push_back(1.0);
    return out;
}

}  // namespace detail

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
/// limits. wall: one of DescentTuning::wall.
inline Optimum fine_optimum(const Task& task, const Objective& objective, int gc, FixedEnds ends, Spline now,
                            double wall) {
    Optimum out;
    long long work = DescentTuning::work;
    for (int level = 0; level <= DescentTuning::levels && work > 0; ++level) {
        const Quadrature q = quadrature(task, gc, now.breaks, true);
        Descent descent(task, objective, ends, wall);
        if (!descent.stand(q, now.control)) break;
        descent.run(DescentTuning::done, work);
        now.control = descent.control();
        out = detail::result(descent, now.breaks);
        std::copy(out.q, out.q + joints, ends.q);
        std::vector<double> finer = descent.finer(OptimumTuning::narrowest);
        if (finer.size() == now.breaks.size()) break;
        now = refined(now, finer);
    }
    return out;
}

/// The minimum next to the path of a search, on few knots: on more if that violates limits there, and the
/// curve itself, not found(), if it does on those too.
inline Optimum coarse_optimum(const Task& task, const Objective& objective, int gc, const FixedEnds& ends,
                              const detail::SearchedBranch& branch) {
    const auto drawn = [&](const std::vector<double>& breaks) {
        return detail::BranchSearch<TaskFamily>::drawn(branch, breaks);
    };
    for (const int intervals : {OptimumTuning::coarse, OptimumTuning::middling}) {
        const Quadrature q = quadrature(task, gc, detail::breaks(intervals, ends), false);
        Descent descent(task, objective, ends);
        if (!descent.stand(q, drawn(q.breaks).control)) continue;
        long long work = DescentTuning::work;
        descent.run(DescentTuning::rough, work);
        return detail::result(descent, q.breaks);
    }
    return as_it_is(task, objective, gc, ends, drawn({}));
}

}  // namespace armangle

#include "../names/end.hpp"
