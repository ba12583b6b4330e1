// The result of a plan for an arm whose self-motion is a closed form: its free number as a spline over s, and
// from it every posture of the path.
#pragma once

#include "../self_motion/explicit_family.hpp"
#include "../self_motion/prove_stretch.hpp"
#include "certify.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A curve of the redundant parameter over the path, for any kind of arm; path and stretches belong to the
/// caller. phi of a stretch is the redundant parameter.
template <explicit_family F>
struct FamilyCurve {
    F family;
    int gc;
    std::span<const Segment> segments;
    std::span<const Stretch> stretches;

    /// Computes the directions of the joints on a stretch at s, for any scalar. Returns the distance from the
    /// end of the reach (a share of the reach); positive if a solution exists.
    template <class T>
    T place(const Stretch& x, const T& s, Directions<T>& out) const noexcept {
        return family.place(pose_at(segment_of(segments, x), s), gc, phi_at(x, s), out);
    }

    /// The configuration at s, with joints in the revolution nearest to the straight line between the ends of
    /// the stretch; NaN if there is no solution.
    PlacedPosture at(const Stretch& x, double s) const noexcept {
        PlacedPosture out;
        out.pose = pose_at(segment_of(segments, x), s);
        out.psi = phi_at(x, s);
        out.gc = gc;
        out.q[joints] = 0.0;
        const StraightWay way{x.start, x.end, x.q, x.q_end};
        Directions<double> d;
        const bool there = place(x, s, d) >= 0;
        for (int j = 0; j < joints; ++j)
            out.q[j] =
                there ? lift(to_q(family.rows(), j, atan2(d.y[j], d.x[j])), way.near(j, s)) : not_a_number;
        return out;
    }
    /// The configuration at s.
    PlacedPosture at(double s) const noexcept { return at(stretch_at(stretches, s), s); }

    /// The derivatives q', q'', q''' with respect to s: three rows of seven.
    void derivatives(double s, double* out) const noexcept {
        using J = Jet<double, 3>;
        Directions<J> d;
        place(stretch_at(stretches, s), J::variable(s), d);
        for (int j = 0; j < joints; ++j) {
            const J theta = atan2(d.y[j], d.x[j]);
            for (int k = 1; k <= 3; ++k)
                out[(k - 1) * joints + j] = family.rows().sign[j] * theta.coefficient[k] * (k == 3 ? 6.0 : k);
        }
    }
};

/// Computes the joints at the ends of every stretch, continuous from q0 on.
template <class F>
void lift_stretches(const FamilyCurve<F>& curve, std::span<Stretch> stretches, const double* q0) noexcept {
    double q[joints];
    std::copy(q0, q0 + joints, q);
    for (Stretch& x : stretches) {
        for (const bool last : {false, true}) {
            const double s = last ? x.end : x.start;
            Directions<double> d;
            curve.place(x, s, d);
            for (int j = 0; j < joints; ++j)
                q[j] = lift(to_q(curve.family.rows(), j, atan2(d.y[j], d.x[j])), q[j]);
            std::copy(q, q + joints, last ? x.q_end : x.q);
            (last ? x.psi_end : x.psi) = phi_at(x, s);
        }
    }
}

/// Proves that a curve keeps its limits and is collision-free. Limits are proven with a slack, except those
/// on which the curve begins or ends.
template <class F>
Proof certify(const FamilyCurve<F>& curve, const Limits& limits, const ProofTuning& tuning,
              const std::function<void()>& checkpoint) {
    Limits kept;
    const Stretch &first = curve.stretches.front(), &last = curve.stretches.back();
    for (int j = 0; j < joints; ++j) {
        const double low = min(first.q[j], last.q_end[j]) - limits.lower[j],
                     high = limits.upper[j] - max(first.q[j], last.q_end[j]);
        kept.lower[j] = limits.lower[j] + (low < 2 * tuning.slack ? -tuning.slack : tuning.slack);
        kept.upper[j] = limits.upper[j] - (high < 2 * tuning.slack ? -tuning.slack : tuning.slack);
    }
    Proof out;
    for (const Stretch& x : curve.stretches) {
        if (checkpoint) checkpoint();
        prove_stretch(
            curve.family.rows(), kept,
            [&]<class T>(const T& s, Directions<T>& d) { return curve.place(x, s, d); },
            {x.start, x.end, x.q, x.q_end}, tuning,
            [&](double from, double to, bool broken) {
                if (broken) out.violated.push_back(0.5 * (from + to));
                if (!out.open.empty() && from <= out.open.back())
                    out.open.back() = to;
                else
                    out.open.insert(out.open.end(), {from, to});
            },
            [&](const double* q, const double (&d)[joints], const double (&off)[joints]) {
                return curve.family.claim(q, d, off);
            });
    }
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
