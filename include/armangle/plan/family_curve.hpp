// The result of a plan for an arm whose self-motion is a closed form: its free number as a spline over s, and
// from it every posture of the path.
#pragma once

#include <array>

#include "../scene/clear_cells.hpp"
#include "../self_motion/explicit_family.hpp"
#include "../self_motion/prove_stretch.hpp"
#include "certify.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A curve of the redundant parameter over the path, for any kind of arm; path and stretches belong to the
/// caller. phi of a stretch is the redundant parameter.
template <planned_family F>
struct FamilyCurve {
    F family;
    int gc;
    std::span<const Segment> segments;
    std::span<const Stretch> stretches;

    /// Computes the directions of the joints on a stretch at s, for any scalar. Returns by how much a
    /// solution exists, as a share of the reach; negative without one.
    template <class T>
    T place(const Stretch& x, const T& s, Directions<T>& out) const noexcept {
        const auto pose = [&](const auto& at) noexcept { return pose_at(segment_of(segments, x), at); };
        const auto phi = [&](const auto& at) noexcept { return phi_at(x, at); };
        const StraightWay way{x.start, x.end, x.q, x.q_end};
        const auto near = [&way](double at) noexcept {
            Joints q;
            for (int j = 0; j < joints; ++j) q.q[j] = way.near(j, at);
            return q;
        };
        if constexpr (explicit_family<F>)
            return family.place(pose(s), gc, phi(s), nullptr, out);
        else if constexpr (std::is_same_v<T, Jet<Interval, 1>>)
            return family.enclose(pose, phi, near, gc, s.value(), out);
        else if constexpr (!std::is_same_v<T, double>)
            return family.place(pose(s), gc, phi(s), near(s.value()).q, out);
        else
            return family.place(pose(s), gc, phi(s), near(s).q, out);
    }

    /// A value of s in [from, to] on a stretch at which there is no solution, or at which `looks` cells do
    /// not decide that there is one; NaN if every s has one. Cells are halved down to the distance of two
    /// numbers. Only an explicit family is examined so; of others it is `from` if a joint jumps in between.
    double gap(const Stretch& x, double from, double to, int looks) const noexcept {
        Directions<double> here;
        if (!(place(x, from, here) >= 0)) return from;
        if (!(place(x, to, here) >= 0)) return to;
        if constexpr (!explicit_family<F>)
            return detail::leaps(*this, x, from, to, at(x, from), at(x, to)) ? from : not_a_number;
        Directions<Jet<Interval, 1>> over;
        std::array<double, 64> ends{to};
        for (std::size_t count = 1; count > 0;) {
            const double end = ends[count - 1], middle = 0.5 * (from + end);
            const double room = place(x, middle, here);
            if (!(room >= 0) || looks-- <= 0) return middle;
            const Jet<Interval, 1> whole = place(x, Jet<Interval, 1>::variable({from, end}), over);
            const Interval mean =
                Interval(room) + whole.coefficient[1] * (Interval(from, end) - Interval(middle));
            const bool proven = std::max(whole.value().lo, mean.lo) > tolerance::rounding;
            const bool last = !(middle > from && middle < end) || count == ends.size();
            if (!proven && !last) {
                ends[count++] = middle;
                continue;
            }
            from = end;
            --count;
        }
        return not_a_number;
    }

    /// The configuration at s of stretch x, with joints in the revolution nearest to the straight line
    /// between the ends of the stretch; its joints are NaN if there is no solution.
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
    /// The configuration at s; NaN if there is no solution.
    PlacedPosture at(double s) const noexcept { return at(stretch_at(stretches, s), s); }

    /// The derivatives q', q'', q''' with respect to s: three rows of seven. Between two stretches, those of
    /// the later one.
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

/// Writes the joints and psi at both ends of every stretch: each joint in the revolution nearest to the
/// previous end, the first one to q0.
template <class F>
void lift_stretches(const FamilyCurve<F>& curve, std::span<Stretch> stretches, const double* q0) noexcept {
    double q[joints];
    std::copy(q0, q0 + joints, q);
    for (Stretch& x : stretches) {
        for (const bool last : {false, true}) {
            const double s = last ? x.end : x.start;
            Directions<double> d;
            curve.family.place(pose_at(segment_of(curve.segments, x), s), curve.gc, phi_at(x, s), q, d);
            for (int j = 0; j < joints; ++j)
                q[j] = lift(to_q(curve.family.rows(), j, atan2(d.y[j], d.x[j])), q[j]);
            std::copy(q, q + joints, last ? x.q_end : x.q);
            (last ? x.psi_end : x.psi) = phi_at(x, s);
        }
    }
}

namespace detail {

/// The arc of the user in which a stretch must keep its redundant parameter, and the turn by which it is
/// counted there (rad).
struct HeldArc {
    double lower = 1.0, upper = -1.0, turn = 0.0;  // empty

    /// Takes the allowed arc that contains the middle of a stretch; empty if there is none.
    HeldArc(const ArcSet& allowed, const Stretch& x) noexcept {
        const double phi = phi_at(x, 0.5 * (x.start + x.end));
        const Place at = find(allowed, phi, 0.0);
        if (at.index < 0) return;
        lower = allowed.arc[at.index].lower;
        upper = allowed.arc[at.index].upper;
        turn = two_pi * round((at.psi - phi) / two_pi);
    }
    /// The distance (rad) to the nearer end of the arc, positive within it.
    template <class T>
    T room(const Stretch& x, const T& s) const noexcept {
        const T phi = phi_at(x, s) + T(turn);
        return min(phi - T(lower), T(upper) - phi);
    }
};

/// What is known of a scene over a cell: whether the motions from q by -d and by d (rad), with deviations
/// `off`, are proven free of collisions, are known to collide, or neither.
template <class AnyArm>
Shown shown_clear(const AnyArm& arm, const Scene& scene, const double* q, const double (&d)[joints],
                  const double (&off)[joints]) noexcept {
    const Around at = StraightMove<AnyArm>(arm, scene).about(q, d, off, nullptr);
    if (at.is_clear()) return Shown::proven;
    return max(at.touching[0], at.touching[1]) > 0 ? Shown::broken : Shown::open;
}

}  // namespace detail

/// Proves that a curve keeps its limits, the arm's singularity margin and its allowed arcs, and is
/// collision-free. Limits are proven with a slack, except those on which the curve begins or ends.
/// permits(stretch): false where the user does not permit its ends; it then counts as violated and unproven.
/// `looks` is reduced by the number of cells that are examined; at 0 the remainder is left unproven.
template <class F, class Permits>
Proof certify(const FamilyCurve<F>& curve, const Limits& limits, const AlsoKept& also, ProofTuning tuning,
              int& looks, const Permits& permits) {
    Limits kept = limits;
    const Stretch &first = curve.stretches.front(), &last = curve.stretches.back();
    curve.family.keep_margin(first.q, kept);
    for (int j = 0; j < joints; ++j) {
        const double low = min(first.q[j], last.q_end[j]) - kept.lower[j],
                     high = kept.upper[j] - max(first.q[j], last.q_end[j]);
        kept.lower[j] += low < 2 * tuning.slack ? -tuning.slack : tuning.slack;
        kept.upper[j] -= high < 2 * tuning.slack ? -tuning.slack : tuning.slack;
    }
    Proof out;
    const auto left = [&](const Stretch& x, double from, double to, bool broken) {
        const double gap = broken ? 0.5 * (from + to) : curve.gap(x, from, to, tuning.looks);
        if (!is_nan(gap)) out.violated.push_back(gap);
        if (!out.open.empty() && from <= out.open.back())
            out.open.back() = to;
        else
            out.open.insert(out.open.end(), {from, to});
    };
    const bool holds = also.allowed && !also.allowed->full;
    const int parts = std::max(also.scenes.count, 1);
    for (const Stretch& x : curve.stretches) {
        if (also.work) also.work->take(0);
        if (!permits(x)) {
            left(x, x.start, x.end, true);
            continue;
        }
        const detail::HeldArc arc(holds ? *also.allowed : ArcSet{}, x);
        const auto place = [&]<class T>(const T& s, Directions<T>& d) {
            const T room = curve.place(x, s, d);
            return holds ? min(room, arc.room(x, s)) : room;
        };
        const StraightWay whole{x.start, x.end, x.q, x.q_end};
        for (int k = 0; k < parts; ++k) {
            const double from = k == 0 ? x.start : max(x.start, also.scenes.begin(k)),
                         to = k + 1 == parts ? x.end : min(x.end, also.scenes.begin(k + 1));
            if (!(from < to)) continue;
            double q[joints], q_end[joints];
            for (int j = 0; j < joints; ++j) {
                q[j] = from > x.start ? whole.near(j, from) : x.q[j];
                q_end[j] = to < x.end ? whole.near(j, to) : x.q_end[j];
            }
            tuning.looks = std::min(tuning.looks, looks);
            looks -= prove_stretch(
                curve.family.rows(), kept, place, {from, to, q, q_end}, tuning,
                [&](double a, double b, bool broken) { left(x, a, b, broken); },
                [&](const double* at, const double (&d)[joints], const double (&off)[joints]) {
                    if (!also.scenes) return detail::Shown::proven;
                    return detail::shown_clear(curve.family.arm(), also.scenes[k], at, d, off);
                });
        }
    }
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
