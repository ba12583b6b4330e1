// Rods against solids of any kind: arcs that are certified, from a few distances.
//
// F(psi) = distance^2 - R^2 is the least of k - 2 rho_p rho_q cos(psi - c) over pairs of points, one of each.
//   Witness: the two nearest points at one psi are such a pair, and their own arc is blocked, exactly.
//   Proof: between a and b = a + h where F is at least F_a and F_b, with A at least the 2 rho_p rho_q of all
//   pairs that can block (those with rho_q < rho_p + R),
//
//     F(a + t) >= F_a + (F_b - F_a) t / h - A t (h - t) / 2
//
//   since F less that line plus A t (h - t) / 2 is a least of concave functions that are >= 0 at both ends.
//
// So every psi is blocked by a witness, proven free, or in a sliver that counts as blocked. Witnesses reach
// an end from the blocked side, as Newton's method does.
#pragma once

#include <initializer_list>

#include "blocked_arc.hpp"
#include "least_between.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the certified arcs of a rod.
struct WitnessesTuning {
    /// A stretch shorter than this (rad) that is neither proven free nor witnessed counts as blocked.
    static constexpr double sliver = 1e-10;
    /// Shorter steps (rad) of an arc's end are rounding.
    static constexpr double settled = 1e-14;
    /// Distances asked of one pair. Where they are spent the rod is halved, up to so many times: what is near
    /// to the line turns little, and a near miss there is proven at once. What is left at last counts as
    /// blocked.
    static constexpr int most_queries = 200, most_halvings = 12;
    /// The largest number of Newton-like steps.
    static constexpr int most_steps = 60;
    /// Rounding of F as a share of the squares of all coordinates.
    static constexpr double rounding = 4e-16;
};

namespace detail {

/// For a solid's core: the greatest distance from the axis (m) and the greatest squared distance from the
/// origin (m^2).
struct Extent {
    double off_axis, square;
};

/// The greatest distance (m) of a solid's core from the axis, and its greatest squared distance (m^2) from
/// the origin.
inline Extent extent(const Solid& solid) noexcept {
    const auto grown = [](const Extent& e, const Vec3<double>& p) {
        return Extent{max(e.off_axis, off_axis(p)), max(e.square, dot(p, p))};
    };
    Extent out = grown({0.0, 0.0}, solid.a);
    if (solid.kind == SolidKind::capsule) out = grown(out, solid.b);
    if (solid.kind == SolidKind::box)
        for (int bits = 0; bits < 8; ++bits) out = grown(out, corner(solid, bits));
    for (int k = 0; k < solid.corner_count; ++k) out = grown(out, solid.a + solid.axes * solid.corners[k]);
    return out;
}

/// Finds the arcs that one solid blocks for one rod; not for half-spaces and fields.
class Witnesses {
public:
    /// Keeps a rod and a solid, which must outlive it, and computes how much their distance may vary over
    /// psi; R (m) is the sum of radii and clearance.
    Witnesses(const Rod& rod, const Solid& solid, double R) noexcept : rod_(rod), solid_(solid), R_(R) {
        const Extent mine = extent(as_solid(rod)), other = extent(solid);
        amplitude_ = 2.0 * mine.off_axis * min(other.off_axis, mine.off_axis + R);
        noise_ = WitnessesTuning::rounding * (mine.square + other.square);
    }

    /// Calls blocked(lower, upper) for arcs (rad) that together cover all blocked psi. `halvings` counts how
    /// often the rod has been halved.
    template <class Blocked>
    void find(const Blocked& blocked, int halvings = 0) noexcept {
        const Vec3<double> middle = (rod_.begin + rod_.end) * 0.5, centre = around(solid_).centre;
        const double start = azimuth_between(middle, centre) + pi;  // where contact is least likely
        const Sample first = at(start);
        if (first.F >= 2.0 * amplitude_) return;
        if (first.F <= 0) {
            const Stretch arc = grown(first);
            blocked(arc.a, arc.b);
            push({arc.b, 0.0, arc.a + two_pi, 0.0});
        } else {
            push({start, first.F, start + two_pi, first.F});
        }
        while (count_ > 0) {
            const Stretch cell = stack_[--count_];
            if (!(cell.b > cell.a) || proven(cell)) continue;
            const bool spent = queries_ >= WitnessesTuning::most_queries || count_ + 2 > most_stretches;
            if (spent && !rod_.is_sphere() && halvings < WitnessesTuning::most_halvings)
                return halve(blocked, halvings + 1);
            if (spent || cell.b - cell.a < WitnessesTuning::sliver) {
                blocked(cell.a, cell.b);
                continue;
            }
            const Sample here = at(split(cell));
            if (here.F > 0) {
                push({cell.a, cell.F_a, here.psi, here.F});
                push({here.psi, here.F, cell.b, cell.F_b});
                continue;
            }
            const Stretch arc = grown(here);
            blocked(arc.a, arc.b);
            push({cell.a, cell.F_a, arc.a, 0.0});
            push({arc.b, 0.0, cell.b, cell.F_b});
        }
    }

private:
    /// Repeats the search for both halves of the rod, which has been halved `halvings` times with this one.
    template <class Blocked>
    void halve(const Blocked& blocked, int halvings) const noexcept {
        const Vec3<double> middle = (rod_.begin + rod_.end) * 0.5;
        for (const Rod& half : {Rod{rod_.begin, middle, rod_.radius}, Rod{middle, rod_.end, rod_.radius}})
            Witnesses(half, solid_, R_).find(blocked, halvings);
    }

    struct Sample {
        double psi, F;
        BlockedArc arc;  // of the nearest points
    };
    struct Stretch {
        double a, F_a, b, F_b;
    };
    static constexpr int most_stretches = 64;

    /// F = distance^2 - R^2 (m^2) at psi, and the arc that the two nearest points block.
    Sample at(double psi) noexcept {
        ++queries_;
        const SinCos<double> turn = sin_cos(psi);
        const Vec3<double> a = turned_by(rod_.begin, turn), b = turned_by(rod_.end, turn);
        const Approach pair = nearest(a, b, solid_);
        BlockedArc arc = point_point(pair.on_rod, pair.on_solid, R_);
        arc.centre += psi;
        return {psi, (pair.distance - R_) * (pair.distance + R_), arc};
    }

    /// The blocked arc around a blocked sample, extended by the arcs that the nearest points at its ends
    /// block, until these no longer move.
    Stretch grown(const Sample& from) noexcept {
        Stretch arc{from.psi, 0.0, from.psi, 0.0};
        const auto include = [&arc](const BlockedArc& turned, double near) {
            const double centre = lift(turned.centre, near);
            arc.a = min(arc.a, centre - turned.half);
            arc.b = max(arc.b, centre + turned.half);
        };
        include(from.arc, from.psi);
        for (const bool upper : {false, true}) {
            for (int step = 0; step < WitnessesTuning::most_steps && arc.b - arc.a < two_pi; ++step) {
                const double end = upper ? arc.b : arc.a;
                const Sample here = at(end);
                if (here.F >= -noise_) break;
                include(here.arc, end);
                if (abs((upper ? arc.b : arc.a) - end) < WitnessesTuning::settled) break;
            }
        }
        arc.b = min(arc.b, arc.a + two_pi);
        return arc;
    }

    /// Whether a stretch is proven free.
    bool proven(const Stretch& s) const noexcept {
        return least_between(s.F_a, s.F_b, amplitude_, s.b - s.a) >= 0;
    }

    /// The psi at which a stretch is split: where its lower bound is least, but not near its ends.
    double split(const Stretch& s) const noexcept {
        const double h = s.b - s.a, t = 0.5 * h - (s.F_b - s.F_a) / (amplitude_ * h);
        return s.a + min(max(t, 0.125 * h), 0.875 * h);
    }

    /// Puts a stretch on the stack.
    void push(const Stretch& s) noexcept { stack_[count_++] = s; }

    const Rod& rod_;
    const Solid& solid_;
    double R_, amplitude_, noise_;
    int queries_ = 0, count_ = 0;
    Stretch stack_[most_stretches];
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
