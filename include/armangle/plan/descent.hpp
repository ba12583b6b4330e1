// The curve of least objective near a given one: phi as a spline, moved until it is stationary.
//
//     phi |  o      o           o  control values: the variables
//         |   `.__.' `.  o      x  Gauss points: there the objective is integrated, and limits must hold;
//         |   x  x   x`.'          a control value changes the points of its four intervals,
//         +------------------ s    so that the second derivatives are a band of seven
//
// Newton's method with Marquardt's damping (D. Marquardt, 1963). The first and second derivatives of the
// objective are exact: theta of each joint is a series in phi of series in s (jet.hpp). Intervals on which
// the curve still bends too sharply for its knots are halved, and the descent continues.
#pragma once

#include <array>

#include "curve.hpp"
#include "objective.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the descent to the curve of least objective.
struct DescentTuning {
    static constexpr int rounds = 60;
    static constexpr double step = 0.4;    // largest change of phi in one round (rad)
    static constexpr double done = 1e-9;   // share of the objective that another step would still save
    static constexpr double rough = 1e-4;  // the same if curves are only compared
    static constexpr double tiny = 1e-12;  // a smaller objective counts as 0
    /// r of the cost that enforces limits whatever the weights (rad), and of thicker walls, used if a curve
    /// slips through between its Gauss points.
    static constexpr double wall[] = {1e-4, 1e-3, 1e-2};
    static constexpr double soft[] = {1e-2, 1e-3};  // the same if the wall is too steep to slide along
    static constexpr double before = 0.02;          // ... and the distance at which it begins (rad)
    static constexpr double sharp = 1e-4;           // share of the objective that more knots may still save
    static constexpr double even = 4;  // an integrand that varies by less on an interval is integrated well
    static constexpr double small = 5e-3;  // and one with a smaller share of the objective
    static constexpr int levels = 6;       // halvings of an interval
    /// Largest product of rounds and intervals for the descents of one curve, over ten times the usual
    /// number. A norm has a kink where joints come to rest, about which Newton's method may oscillate.
    static constexpr long long work = 5000;
    static constexpr std::size_t points = 4;           // of an interval, unless segments cut it
    static constexpr std::size_t most_points = 20000;  // of a curve: beyond, an interval has one
};

namespace detail {

using SeriesInS = Jet<double, 1>;
template <int K>
using SeriesInPhi = Jet<SeriesInS, K>;

/// A point of the integration over s, with all data that do not depend on phi.
struct GaussPoint {
    double s, weight;
    std::size_t cell;                 // its interval: depends on control values cell .. cell + 3
    std::size_t first = 0, arcs = 0;  // arcs of phi that obstacles and the user permit; 0: all
    double basis[4], slope[4];        // weights of those control values in phi and dphi/ds
    JointFunctions<SeriesInS> functions;
    double theta_4, theta_4_rate;
    double wished;  // target phi; NaN without a target
};

/// Node k of the Gauss rule on [0, 1] with n points (1 to 4). Source: Abramowitz and Stegun, 25.4.30.
inline double gauss_node(std::size_t n, std::size_t k) noexcept {
    constexpr double node[4][4] = {
        {0.5},
        {0.21132486540518712, 0.7886751345948129},
        {0.1127016653792583, 0.5, 0.8872983346207417},
        {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263}};
    return node[n - 1][k];
}
/// The weight of point k of n in Gauss' quadrature over [0, 1].
inline double gauss_weight(std::size_t n, std::size_t k) noexcept {
    constexpr double weight[4][4] = {
        {1.0},
        {0.5, 0.5},
        {0.2777777777777778, 0.4444444444444444, 0.2777777777777778},
        {0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693}};
    return weight[n - 1][k];
}

/// The Taylor series of s sin + c cos + k in phi, K = 1 or 3.
template <int K>
SeriesInPhi<K> series(const Harmonic<SeriesInS>& f, const SinCos<double>& phi) noexcept {
    const SinCos<SeriesInS> at{SeriesInS(phi.sin), SeriesInS(phi.cos)};
    SeriesInPhi<K> out;
    out.coefficient[0] = f.at(at);
    out.coefficient[1] = f.slope(at);
    if constexpr (K == 3) {
        out.coefficient[2] = SeriesInS(-0.5) * (out.coefficient[0] - f.k);
        out.coefficient[3] = SeriesInS(-1.0 / 6.0) * out.coefficient[1];
    }
    return out;
}

/// Appends the arcs of phi that obstacles and the user permit at point p to `arcs` and stores their place in
/// p. If all phi are permitted, appends nothing; if none is, an arc without any phi.
inline void leave_open(const Task& task, int gc, GaussPoint& p, std::vector<Arc>& arcs) {
    const SelfMotion<double> m = self_motion(task.arm, task.circle_at(p.s), configuration(gc));
    ArcSet any, left;
    make_full(any);
    Tag blocking = 0;
    if (task.keep_open(p.s, m, any, left, blocking) != Status::OK) {
        make_empty(left);
        put(left, {0.0, 0.0, 0, 0});
    }
    if (left.full) return;
    p.first = arcs.size();
    p.arcs = static_cast<std::size_t>(left.count);
    arcs.insert(arcs.end(), left.arc, left.arc + left.count);
}

}  // namespace detail

/// The Gauss points of a branch on given breaks of s.
struct Quadrature {
    std::vector<double> breaks;
    std::vector<detail::GaussPoint> points;
    std::vector<Arc> open;  // the arcs of all points
};

/// Computes the Gauss points of all intervals. If `cut`, no interval crosses the end of a segment, where the
/// path's velocity jumps. points: per interval, 1 to 4; one if all would be more than `most_points`.
inline Quadrature quadrature(const Task& task, int gc, const std::vector<double>& breaks, bool cut,
                             std::size_t points = DescentTuning::points) {
    using detail::SeriesInS;
    Quadrature out{breaks, {}, {}};
    const bool many = breaks.size() * DescentTuning::points > DescentTuning::most_points;
    std::vector<double> ends;
    std::size_t next = 0;
    for (std::size_t i = 0; i + 1 < breaks.size(); ++i) {
        const double l = breaks[i], r = breaks[i + 1];
        ends.assign(1, l);
        while (cut && next + 1 < task.segment_count && task.segments[next].end < r) {
            if (task.segments[next].end > l) ends.push_back(task.segments[next].end);
            ++next;
        }
        ends.push_back(r);
        const std::size_t cells = ends.size() - 1;
        const std::size_t n = many ? 1 : (points + cells - 1) / cells;
        double about[6];
        detail::knots_about(breaks, i, about);
        for (std::size_t c = 0; c < cells; ++c) {
            for (std::size_t k = 0; k < n; ++k) {
                detail::GaussPoint& p = out.points.emplace_back();
                const double width = ends[c + 1] - ends[c];
                p.s = ends[c] + width * detail::gauss_node(n, k);
                p.weight = width * detail::gauss_weight(n, k);
                p.cell = i;
                for (int b = 0; b < 4; ++b) {
                    double one[4] = {};
                    one[b] = 1;
                    p.basis[b] = detail::blossom(one, about, {p.s, p.s, p.s});
                    p.slope[b] = 3 *
                                 (detail::blossom(one, about, {p.s, p.s, r}) -
                                  detail::blossom(one, about, {p.s, p.s, l})) /
                                 (r - l);
                }
                const Segment& segment = task.segments[segment_index(task.segments, task.segment_count, p.s)];
                const Pose<SeriesInS> pose = pose_at(segment, SeriesInS::variable(p.s));
                const SelfMotion<SeriesInS> motion =
                    self_motion(task.arm, circle(task.arm, flange_pose(task.arm, pose), task.plane),
                                spread<SeriesInS>(configuration(gc)));
                p.functions = task.functions(motion);
                const SeriesInS theta_4 = atan2(motion.elbow.theta_4.sin, motion.elbow.theta_4.cos);
                p.theta_4 = theta_4.value();
                p.theta_4_rate = theta_4.coefficient[1];
                p.wished = task.wished_phi(gc, p.s);
                if (!task.encumbered()) continue;
                task.take(task.section_work(p.s));
                detail::leave_open(task, gc, p, out.open);
            }
        }
    }
    return out;
}

/// Which ends of a curve are fixed, and the joints at s = 0 that determine the revolutions.
struct FixedEnds {
    bool first, last;
    double q[joints];
};

/// Minimizes the objective over curves of one branch.
class Descent {
public:
    /// Keeps references to task and objective, and a copy of `ends`; `wall` is one of DescentTuning::wall
    /// (rad). No curve is set yet.
    Descent(const Task& task, const Objective& objective, const FixedEnds& ends,
            double wall = DescentTuning::wall[0])
        : task_(task), objective_(objective), ends_(ends), asked_wall_(wall), wall_(wall) {}

    /// Starts at a curve on the breaks of the quadrature; false if it violates limits.
    bool stand(const Quadrature& quadrature, std::vector<double> control) {
        quadrature_ = &quadrature;
        control_ = std::move(control);
        return assemble<2>(control_, here_);
    }

    /// The present cost.
    double energy() const noexcept { return here_.energy; }
    /// The present cost by its terms.
    const Terms& terms() const noexcept { return here_.terms; }
    /// The spline coefficients of phi (rad) that the steps have reached.
    const std::vector<double>& control() const noexcept { return control_; }
    /// The least distance (rad) from limits and singularities at a Gauss point, among those that the
    /// objective weighs.
    double margin() const noexcept { return here_.margin; }
    /// The joints (rad) at the start of the curve.
    const double* first_q() const noexcept { return here_.q; }

    /// Minimizes until another step would save at most the share `done` of the objective, or `work` is spent.
    /// If the cost near limits stops it earlier, it continues with a softer one.
    void run(double done, long long& work) {
        if (go_down(done, work) || work <= 0) return;
        const std::vector<double> stopped = control_;
        const double least = here_.energy;
        for (const double wall : DescentTuning::soft) {
            if (!(wall > asked_wall_)) continue;
            wall_ = wall;
            assemble<2>(control_, here_);
            go_down(DescentTuning::rough, work);
        }
        wall_ = asked_wall_;
        if (assemble<2>(control_, here_)) go_down(done, work);
        if (here_.energy <= least) return;
        control_ = stopped;
        assemble<2>(control_, here_);
        std::copy(here_.q, here_.q + joints, ends_.q);
    }

    /// The share of the objective that a Newton step would save: 0 at a stationary curve, infinite if the
    /// curve is no minimum.
    double stationarity() {
        if (!solve(0)) return infinity;
        return saving_ / max(here_.energy, DescentTuning::tiny);
    }

    /// The breaks of s, with those intervals halved on which the spline bends too sharply for its knots, or
    /// the integrand varies too fast for its points; intervals up to `narrowest` stay as they are.
    std::vector<double> finer(double narrowest) const {
        const std::vector<double>& breaks = quadrature_->breaks;
        const std::size_t n = breaks.size() - 1;
        std::vector<double> third(n), out;
        for (std::size_t i = 0; i < n; ++i) {
            double t[6];
            detail::knots_about(breaks, i, t);
            const double l = breaks[i], r = breaks[i + 1], h = r - l;
            const double* c = &control_[i];
            const double cubic = detail::blossom(c, t, {r, r, r}) - 3 * detail::blossom(c, t, {l, r, r}) +
                                 3 * detail::blossom(c, t, {l, l, r}) - detail::blossom(c, t, {l, l, l});
            third[i] = 6 * cubic / (h * h * h);
        }
        const double allowed =
            DescentTuning::sharp * max(here_.energy, DescentTuning::tiny) / static_cast<double>(n);
        for (std::size_t i = 0; i < n; ++i) {
            out.push_back(breaks[i]);
            const double h = breaks[i + 1] - breaks[i];
            const double jump =
                max(i ? abs(third[i] - third[i - 1]) : 0.0, i + 1 < n ? abs(third[i + 1] - third[i]) : 0.0);
            const double slope = h * h * jump / 24;  // approximate error of dphi/ds
            const Interior& f = here_.interior[i];
            const bool bends = f.stiffness * h * slope * slope > allowed;
            const bool rises =
                f.most > DescentTuning::even * f.least && f.most * h > DescentTuning::small * energy();
            if (h > narrowest && (bends || rises)) out.push_back(breaks[i] + 0.5 * h);
        }
        out.push_back(breaks.back());
        return out;
    }

private:
    /// Takes steps until another would save at most the share `done` of the objective; each step subtracts
    /// the number of its breaks from `work`. False if that was not reached before rounds or work were spent.
    bool go_down(double done, long long& work) {
        double damping = 1e-3;
        for (int round = 0; round < DescentTuning::rounds && damping < 1e9 && work > 0; ++round) {
            task_.take(WorkTuning::posture * static_cast<long long>(quadrature_->points.size()));
            work -= static_cast<long long>(quadrature_->breaks.size());
            if (!solve(damping)) {
                damping *= 10;
                continue;
            }
            if (saving_ <= done * max(here_.energy, DescentTuning::tiny)) return true;
            damping = advance() ? max(damping * 0.1, 1e-9) : damping * 10;
        }
        return false;
    }

    /// Data of the integrand on an interval: its extremes, and half its second derivative by dphi/ds.
    struct Interior {
        double most = 0, least = infinity, stiffness = 0;
    };

    /// The objective of a curve with its derivatives by the control values.
    struct Assembly {
        double energy = infinity;
        Terms terms;
        double margin = infinity;
        double q[joints];  // at the first point
        std::vector<double> gradient;
        std::vector<Interior> interior;           // of each interval
        std::vector<std::array<double, 4>> band;  // row i: second derivatives by i and i - 0, 1, 2, 3
    };

    /// The integrand at one point and its derivatives by phi and v = dphi/ds.
    struct Integrand {
        double value = 0, phi = 0, v = 0, phi_phi = 0, phi_v = 0, v_v = 0;
        double margin = infinity;
    };

    /// dq/ds of all joints with its derivatives by phi, and dq/dphi.
    struct Rates {
        double r[joints], phi[joints], phi_phi[joints], by_phi[joints], by_phi_2[joints];
    };
    void bend_duration(const Rates& rates, double n, double weight, Integrand& f) const noexcept;

    const Task& task_;
    const Objective& objective_;
    FixedEnds ends_;
    const Quadrature* quadrature_ = nullptr;
    std::vector<double> control_, tried_, step_;
    std::vector<std::array<double, 4>> factor_;
    Assembly here_, there_;
    double saving_ = 0, slope_ = 0;
    double asked_wall_, wall_;  // r, at the end and now

    /// The weight of the cost that enforces limits: that of the heaviest other term. So the common scale of
    /// the weights does not matter.
    double wall_weight() const noexcept {
        const Objective& w = objective_;
        const double heaviest =
            max(max(max(w.travel, w.duration), max(w.limits, w.singularities)), task_.wish ? w.psi : 0.0);
        return heaviest > 0 ? heaviest : 1.0;
    }
    template <int Order>
    bool assemble(const std::vector<double>& control, Assembly& out) const;
    template <int Order>
    bool integrand(const detail::GaussPoint& p, double phi, double v, const double* predicted_from, double ds,
                   double* q, double* rate, Integrand& f, Terms& terms) const noexcept;
    bool solve(double damping);
    bool advance();
};

/// Adds the derivatives of the pace n by phi and dphi/ds, times `weight`, to f.
inline void Descent::bend_duration(const Rates& rates, double n, double weight, Integrand& f) const noexcept {
    const double* slowness = objective_.slowness;
    double by_phi = 0, by_v = 0, phi_phi = 0, phi_v = 0, v_v = 0, bent = 0, bent_v = 0;
    for (int j = 0; j < joints; ++j) {
        const auto [slope, curved] = pace_slope(slowness[j], rates.r[j], n);
        by_phi += slope * rates.phi[j];
        by_v += slope * rates.by_phi[j];
        bent += slope * rates.phi_phi[j];
        bent_v += slope * rates.by_phi_2[j];
        phi_phi += curved * rates.phi[j] * rates.phi[j];
        phi_v += curved * rates.phi[j] * rates.by_phi[j];
        v_v += curved * rates.by_phi[j] * rates.by_phi[j];
    }
    f.phi += weight * by_phi;
    f.v += weight * by_v;
    f.phi_phi += weight * (phi_phi - 7 / n * by_phi * by_phi + bent);
    f.phi_v += weight * (phi_v - 7 / n * by_phi * by_v + bent_v);
    f.v_v += weight * (v_v - 7 / n * by_v * by_v);
}

/// Computes the objective at one point: its value and, if Order is 2, its derivatives in f, and its parts in
/// `terms`; false beyond a limit. before, rate: joints and dq/ds of the previous point (ds earlier); writes
/// those of this one to q (may be `before`) and rate. At the first point (ds = 0) the joints are in the
/// revolution nearest to `before`, and moved into the limits if no end is fixed.
template <int Order>
bool Descent::integrand(const detail::GaussPoint& p, double phi, double v, const double* before, double ds,
                        double* q, double* rate, Integrand& f, Terms& terms) const noexcept {
    using Series = detail::SeriesInPhi<Order + 1>;
    Series theta[joints];
    const SinCos<double> at = sin_cos(phi);
    for (int i = 0; i < pivots; ++i) {
        const Pivot<detail::SeriesInS>& pivot = p.functions.pivot[i];
        const Series g(pivot.g), u = detail::series<Order + 1>(pivot.U, at),
                                 w = detail::series<Order + 1>(pivot.V, at);
        theta[pivot_joint[i]] = atan2(g * u, g * w);
        if (i % 2) continue;
        const Hinge<detail::SeriesInS>& hinge = p.functions.hinge[i / 2];
        theta[hinge_joint[i / 2]] =
            atan2(Series(hinge.g) * sqrt(u * u + w * w), detail::series<Order + 1>(hinge.H, at));
    }
    theta[3] = Series(0.0);
    theta[3].coefficient[0].coefficient[0] = p.theta_4;
    theta[3].coefficient[0].coefficient[1] = p.theta_4_rate;
    using Curved = Jet<double, Order>;  // in phi
    Curved joint[joints];
    Rates rates;
    double travel = 0;
    for (int j = 0; j < joints; ++j) {
        const double sign = task_.arm.sign[j];
        const auto& c = theta[j].coefficient;
        const double by_phi = sign * c[1].value(), r = sign * c[0].coefficient[1] + by_phi * v;  // dq/ds
        const double near = before[j] + (ds > 0 ? 0.5 * ds * (rate[j] + r) : 0.0);
        const double value = c[0].value();
        q[j] =
            ds == 0 && !ends_.first && !ends_.last
                ? to_q(value, sign, task_.arm.offset[j], task_.limits.lower[j], task_.limits.upper[j], near)
                : lift(to_q(task_.arm, j, value), near);
        rate[j] = r;
        rates.r[j] = r;
        travel += r * r;
        joint[j].coefficient[0] = q[j];
        if constexpr (Order == 2) {
            const double by_phi_2 = 2 * sign * c[2].value(), by_phi_3 = 6 * sign * c[3].value();
            const double r_phi = sign * c[1].coefficient[1] + by_phi_2 * v;
            const double r_phi_phi = 2 * sign * c[2].coefficient[1] + by_phi_3 * v;
            rates.phi[j] = r_phi;
            rates.phi_phi[j] = r_phi_phi;
            rates.by_phi[j] = by_phi;
            rates.by_phi_2[j] = by_phi_2;
            f.phi += r * r_phi;
            f.v += r * by_phi;
            f.phi_phi += r_phi * r_phi + r * r_phi_phi;
            f.phi_v += by_phi * r_phi + r * by_phi_2;
            f.v_v += by_phi * by_phi;
            joint[j].coefficient[1] = by_phi;
            joint[j].coefficient[2] = 0.5 * by_phi_2;
        }
    }
    const double twice = 2 * objective_.travel;
    f.phi *= twice;
    f.v *= twice;
    f.phi_phi *= twice;
    f.phi_v *= twice;
    f.v_v *= twice;
    f.value = objective_.travel * travel;
    terms.travel += p.weight * travel;
    if (objective_.duration > 0) {
        const double n = pace(objective_.slowness, rates.r), weight = objective_.duration * task_.length;
        f.value += weight * n;
        if constexpr (Order == 2) bend_duration(rates, n, weight, f);
        terms.duration += p.weight * task_.length * n;
    }
    bool inside = true;
    const double scale = task_.margin_scale();
    if (p.wished == p.wished) {
        const SinCos<double> gap = sin_cos(phi - p.wished);
        const double wish = task_.wish_scale(), weighed = 2 * wish * objective_.psi;
        f.value += weighed * (1 - gap.cos);
        f.phi += weighed * gap.sin;
        f.phi_phi += weighed * gap.cos;
        terms.psi += 2 * p.weight * wish * (1 - gap.cos);
    }
    const auto add = [&](const Curved& sum) {
        f.value += scale * sum.value();
        if constexpr (Order == 2) {
            f.phi += scale * sum.coefficient[1];
            f.phi_phi += scale * 2 * sum.coefficient[2];
        }
    };
    const auto wall = [this](const Curved& distance) {
        const Curved held = max(distance, Curved(DescentTuning::tiny));
        const Curved near = Curved(wall_) / held - Curved(wall_ / DescentTuning::before);
        return Curved(wall_weight()) * near * near;
    };
    distances(task_, joint, [&](const Curved& distance, Kind kind) {
        if (!(distance.value() > 0)) inside = false;
        if (weight(objective_, kind) > 0) f.margin = min(f.margin, distance.value());
        if (!(distance.value() < max(objective_.enough, DescentTuning::before))) return;
        const Curved near = cost(distance, kind, objective_.enough);
        Curved sum = Curved(weight(objective_, kind)) * near;
        if (distance.value() < DescentTuning::before) sum = sum + wall(distance);
        add(sum);
        (kind == Kind::limit ? terms.limits : terms.singularities) += p.weight * scale * near.value();
    });
    if (p.arcs == 0) return inside && f.value < infinity;
    bool open = false;
    for (std::size_t i = 0; i < p.arcs; ++i) {
        const Arc& arc = quadrature_->open[p.first + i];
        const double here = lift(phi, 0.5 * (arc.lower + arc.upper));
        for (const double distance : {here - arc.lower, arc.upper - here}) {
            if (!(here > arc.lower && here < arc.upper)) continue;
            open = true;
            if (!(distance < DescentTuning::before)) continue;
            Curved off(distance);
            if constexpr (Order == 2) off.coefficient[1] = distance == here - arc.lower ? 1.0 : -1.0;
            add(wall(off));
        }
    }
    inside = inside && open;
    return inside && f.value < infinity;
}

/// Computes the objective at these control values and, with Order 2, its gradient and the band of second
/// derivatives; false, with infinite energy, beyond a limit.
template <int Order>
bool Descent::assemble(const std::vector<double>& control, Assembly& out) const {
    const std::size_t n = control.size();
    out.energy = 0;
    out.terms = {};
    out.margin = infinity;
    if constexpr (Order == 2) {
        out.gradient.assign(n, 0.0);
        out.interior.assign(n - 3, {});
        out.band.assign(n, {});
    }
    double q[joints], rate[joints] = {}, last = 0;
    for (int j = 0; j < joints; ++j) q[j] = ends_.q[j];
    bool first = true;
    for (const detail::GaussPoint& p : quadrature_->points) {
        const double* c = &control[p.cell];
        double phi = 0, v = 0;
        for (int a = 0; a < 4; ++a) {
            phi += p.basis[a] * c[a];
            v += p.slope[a] * c[a];
        }
        Integrand f;
        if (!integrand<Order>(p, phi, v, q, first ? 0.0 : p.s - last, q, rate, f, out.terms)) {
            out.energy = infinity;
            return false;
        }
        if (first) std::copy(q, q + joints, out.q);
        first = false;
        last = p.s;
        out.energy += p.weight * f.value;
        if constexpr (Order == 0) continue;
        out.margin = min(out.margin, f.margin);
        Interior& inside = out.interior[p.cell];
        inside.most = max(inside.most, f.value);
        inside.least = min(inside.least, f.value);
        inside.stiffness = max(inside.stiffness, 0.5 * f.v_v);
        for (std::size_t a = 0; a < 4; ++a) {
            out.gradient[p.cell + a] += p.weight * (f.phi * p.basis[a] + f.v * p.slope[a]);
            const double to_phi = p.weight * (f.phi_phi * p.basis[a] + f.phi_v * p.slope[a]);
            const double to_v = p.weight * (f.phi_v * p.basis[a] + f.v_v * p.slope[a]);
            for (std::size_t b = 0; b <= a; ++b)
                out.band[p.cell + a][a - b] += to_phi * p.basis[b] + to_v * p.slope[b];
        }
    }
    return true;
}

/// Computes the step -(H + damping |diag H|)^-1 gradient with a banded L D L^T factorization; false if the
/// matrix is not positive definite. Fixed ends do not move.
inline bool Descent::solve(double damping) {
    const std::size_t n = control_.size();
    factor_.resize(n);
    step_.resize(n);
    const auto fixed = [&](std::size_t i) { return (i == 0 && ends_.first) || (i + 1 == n && ends_.last); };
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t k = std::min<std::size_t>(i, 3) + 1; k-- > 0;) {
            const std::size_t j = i - k;
            double sum = here_.band[i][k];
            if (k == 0) sum += damping * abs(sum) + DescentTuning::tiny;
            if (fixed(i) || fixed(j)) sum = k == 0 ? 1.0 : 0.0;
            for (std::size_t m = i > 3 ? i - 3 : 0; m < j; ++m)
                if (j - m <= 3) sum -= factor_[i][i - m] * factor_[m][0] * factor_[j][j - m];
            if (k == 0) {
                if (!(sum > 0)) return false;
                factor_[i][0] = sum;
            } else {
                factor_[i][k] = sum / factor_[j][0];
            }
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        step_[i] = fixed(i) ? 0.0 : -here_.gradient[i];
        for (std::size_t k = 1; k <= std::min<std::size_t>(i, 3); ++k)
            step_[i] -= factor_[i][k] * step_[i - k];
    }
    for (std::size_t i = 0; i < n; ++i) step_[i] /= factor_[i][0];
    slope_ = 0;
    for (std::size_t i = n; i-- > 0;) {
        for (std::size_t k = 1; k <= 3 && i + k < n; ++k) step_[i] -= factor_[i + k][k] * step_[i + k];
        slope_ += step_[i] * here_.gradient[i];
    }
    saving_ = -0.5 * slope_;
    return true;
}

/// Takes the step, or the part of it that lowers the objective within the limits; false if no part does.
inline bool Descent::advance() {
    double most = 0;
    for (const double x : step_) most = max(most, abs(x));
    double share = min(1.0, DescentTuning::step / most);
    for (int half = 0; half < 5; ++half, share *= 0.5) {
        tried_ = control_;
        for (std::size_t i = 0; i < tried_.size(); ++i) tried_[i] += share * step_[i];
        if (!assemble<2>(tried_, there_) || !(there_.energy <= here_.energy + 1e-4 * share * slope_))
            continue;
        control_.swap(tried_);
        std::swap(here_, there_);
        std::copy(here_.q, here_.q + joints, ends_.q);
        return true;
    }
    return false;
}

}  // namespace armangle

#include "../names/end.hpp"
