// A rod that moves with psi in any way against a solid, or against another one: arcs that are certified.
//
// F(psi) = distance^2 - R^2 is the least of g = |x - y|^2 - R^2 over pairs of points, one of each. Over a
// stretch of h rad let v and a be at most the speed and acceleration of x - y. A pair that blocks somewhere
// on it is never farther apart than R + v h, so
//
//     -2 (R + v h) a  <=  g'' = 2 |x' - y'|^2 + 2 (x - y) . (x'' - y'')  <=  2 v^2 + 2 (R + v h) a  =  A.
//
//   Free: where F is F_a, F_b > 0 at both ends, F >= F_a + (F_b - F_a) t / h - A t (h - t) / 2, as in
//   witnesses.hpp; or where both distances are longer than R by more than the points can move.
//   Blocked: the nearest points of one end are a pair; where they are too near at the other end too, they are
//   between, by the same bound from the other side.
//
// A field has no points. Stretches are free where the bound above says so of what the field stands for, and
// where the field itself, at all places between where a place of the rod is at both ends, keeps R but for a
// hundredth of the spacing; blocked where it, changing by 5/3 of the way at most, allows no more than a
// quarter. So arcs and distances tell of one surface.
//
// What is neither is halved; between a free and a blocked end the root is bracketed.
#pragma once

#include <initializer_list>

#include "least_between.hpp"
#include "swing.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the certified arcs of a moving rod.
struct MovingPairTuning {
    /// Cells that the circle begins with.
    static constexpr int cells = 8;
    /// A stretch shorter than this (rad) that is proven neither way counts as blocked; so short is a root's
    /// bracket.
    static constexpr double sliver = 1e-10, bracket = 2e-13;
    /// Distances asked of one pair; what is left then counts as blocked.
    static constexpr int most_queries = 2000;
    static constexpr int most_steps = 100;
};

namespace detail {

/// Finds the arm angles at which a moving rod touches a solid or another moving rod.
class MovingPair {
public:
    /// A pair of a rod, which must outlive it, and a solid at rest; R (m) is the sum of the radii and the
    /// clearance.
    MovingPair(const MovingRod& rod, const Solid& solid, double R) noexcept
        : rod_(rod), other_(nullptr), solid_(solid), R_(R) {
        if (!is_field()) return;
        const Rod here = rod.at({0.0, 1.0});
        sliver_ = bracket_ = FieldTuning::sliver;
        gap_ = half_gap(*solid.field, norm(here.end - here.begin));
    }
    /// A pair of two moving rods, `rod` and `other`, which must outlive it; R (m) is the sum of the radii and
    /// the clearance.
    MovingPair(const MovingRod& rod, const MovingRod& other, double R) noexcept
        : rod_(rod), other_(&other), solid_(as_solid(other.at({0.0, 1.0}))), R_(R) {}

    /// Calls blocked(lower, upper) for arcs (rad) that together cover all blocked psi, up to the tolerance of
    /// a field. Undecided stretches count as blocked; false if the budget of distances was spent.
    template <class Blocked>
    bool find(const Blocked& blocked) noexcept {
        Run run{0.0, 0.0, false};
        const auto add = [&](const Stretch& s) {
            if (run.any && run.upper == s.a.psi) {
                run.upper = s.b.psi;
                return;
            }
            if (run.any) blocked(run.lower, run.upper);
            run = {s.a.psi, s.b.psi, true};
        };
        Sample last = at(pi);
        for (int k = MovingPairTuning::cells - 1; k >= 0; --k) {
            const Sample here = at(k == 0 ? -pi : -pi + two_pi * k / MovingPairTuning::cells);
            push({here, last});
            last = here;
        }
        while (count_ > 0) {
            const Stretch s = stack_[--count_];
            const double h = s.b.psi - s.a.psi;
            const bool free_a = s.a.F > 0, free_b = s.b.F > 0, mixed = free_a != free_b;
            if (!mixed && free_a && is_free(s, h)) continue;
            const bool spent = queries_ >= MovingPairTuning::most_queries || count_ + 3 > most_stretches;
            if (spent || h < (mixed ? 1.5 * bracket_ : sliver_) || (!mixed && !free_a && is_blocked(s, h))) {
                add(s);
                continue;
            }
            if (mixed) {
                const Stretch root = bracketed(s);
                push({root.b, s.b});
                push(root);
                push({s.a, root.a});
                continue;
            }
            const Sample middle = at(0.5 * (s.a.psi + s.b.psi));
            push({middle, s.b});
            push({s.a, middle});
        }
        if (run.any) blocked(run.lower, run.upper);
        return queries_ < MovingPairTuning::most_queries;
    }

private:
    struct Sample {
        double psi, F, distance;
        double share;        // of the rod's nearest point, along it
        double other_share;  // of the other rod's
        Vec3<double> fixed;  // of a solid at rest
    };
    struct Stretch {
        Sample a, b;
    };
    struct Run {
        double lower, upper;
        bool any;
    };
    static constexpr int most_stretches = 96;

    /// Whether the obstacle is a half-space.
    bool flat() const noexcept { return solid_.kind == SolidKind::half_space; }
    /// Whether the obstacle is a distance field.
    bool is_field() const noexcept { return solid_.kind == SolidKind::field; }

    /// The nearest points of the pair at psi, their distance (m) and F, as in squared().
    Sample at(double psi) noexcept {
        ++queries_;
        const SinCos<double> turn = sin_cos(psi);
        const Rod rod = rod_.at(turn);
        const Vec3<double> along = rod.end - rod.begin;
        if (other_ != nullptr) {
            const Rod other = other_->at(turn);
            const Approach pair = nearest(rod.begin, rod.end, as_solid(other));
            return {psi,
                    squared(pair.distance),
                    pair.distance,
                    foot(rod.begin, along, pair.on_rod),
                    foot(other.begin, other.end - other.begin, pair.on_solid),
                    {}};
        }
        const Approach pair = nearest(rod.begin, rod.end, solid_);
        return {psi, squared(pair.distance), pair.distance, foot(rod.begin, along, pair.on_rod),
                0.0, pair.on_solid};
    }

    /// F of a distance (m): distance^2 - R^2; for a half-space, whose distance is signed, distance - R.
    double squared(double distance) const noexcept {
        return flat() ? distance - R_ : (distance - R_) * (distance + R_);
    }

    /// Whether a distance field proves a stretch free: not, up to the agreed tolerance, or wholly.
    enum class Kept { no, nearly, whole };
    /// Whether the pair keeps its distance all over a stretch of h rad, for a distance field; m: drift() of
    /// the stretch.
    Kept field_keeps(const Stretch& s, double h, const Drift& m) const noexcept {
        const double whole = hypot(R_, gap_), must = whole - FieldTuning::agreed_free * solid_.field->spacing,
                     a = hypot(s.a.distance, gap_), b = hypot(s.b.distance, gap_),
                     slope = FieldTuning::steepest * above_rounding;
        if (min(a, b) - slope * m.shift >= whole) return Kept::whole;
        if (!(m.speed * h < 2.0 * solid_.field->spacing)) return Kept::no;
        const Rod first = rod_.at(sin_cos(s.a.psi)), last = rod_.at(sin_cos(s.b.psi));
        const auto seen = [this](const Vec3<double>& p) { return in_grid(solid_, p); };
        const Vec3<double> from[2] = {seen(first.begin), seen(first.end)},
                           to[2] = {seen(last.begin), seen(last.end)};
        const double bow = 0.125 * m.acceleration * h * h * above_rounding;
        const double least = least_along(from, to, bow, must, *solid_.field);
        if (least >= whole) return Kept::whole;
        return least >= must ? Kept::nearly : Kept::no;
    }
    /// Whether a distance field counts a whole stretch of h rad as blocked, up to the agreed tolerance; m:
    /// drift() of the stretch.
    bool field_blocks(const Stretch& s, double h, const Drift& m) const noexcept {
        const double most = hypot(R_, gap_) + FieldTuning::agreed_blocked * solid_.field->spacing,
                     a = hypot(s.a.distance, gap_), b = hypot(s.b.distance, gap_),
                     slope = FieldTuning::steepest * above_rounding;
        return max(a, b) + slope * m.shift <= most || 0.5 * (a + b + slope * m.speed * h) <= most;
    }

    /// F (see squared()) of the same two material points as in a sample, at another psi; for a half-space
    /// their distance beyond R (m).
    double same_pair(const Sample& of, double psi) const noexcept {
        const SinCos<double> turn = sin_cos(psi);
        const auto point = [](const Rod& rod, double share) {
            return rod.begin + (rod.end - rod.begin) * share;
        };
        const Vec3<double> p = point(rod_.at(turn), of.share);
        if (flat()) return dot(solid_.a, p) - solid_.b.x - R_;
        const Vec3<double> q = other_ == nullptr ? of.fixed : point(other_->at(turn), of.other_share);
        return squared(norm(p - q));
    }

    /// Bounds of the relative speed, acceleration and displacement of the pair over a stretch of h rad.
    Drift drift(const Stretch& s, double h) const noexcept {
        const SinCos<double> middle = sin_cos(0.5 * (s.a.psi + s.b.psi));
        Drift out = rod_.over(middle, 0.5 * h * above_rounding);
        if (other_ == nullptr) return out;
        const Drift other = other_->over(middle, 0.5 * h * above_rounding);
        return {out.speed + other.speed, out.acceleration + other.acceleration, out.shift + other.shift};
    }

    /// Whether a stretch of h rad between two free samples is proven free.
    bool is_free(const Stretch& s, double h) const noexcept {
        const Drift m = drift(s, h);
        if (is_field()) {
            const Kept kept = field_keeps(s, h, m);
            if (kept != Kept::nearly) return kept == Kept::whole;
        }
        if (min(s.a.distance, s.b.distance) - m.shift * above_rounding > R_) return true;
        if (!(m.speed < infinity)) return false;
        const double bend =
            flat() ? m.acceleration : 2.0 * m.speed * m.speed + 2.0 * (R_ + m.speed * h) * m.acceleration;
        return least_between(s.a.F, s.b.F, bend * above_rounding, h) >= 0;
    }

    /// Whether a stretch of h rad between two blocked samples is proven blocked.
    bool is_blocked(const Stretch& s, double h) const noexcept {
        const Drift m = drift(s, h);
        if (is_field()) return field_blocks(s, h, m);
        if (!(m.speed < infinity)) return false;
        const double bend =
            (flat() ? m.acceleration : 2.0 * (R_ + m.speed * h) * m.acceleration) * above_rounding;
        const double a_at_b = same_pair(s.a, s.b.psi), b_at_a = same_pair(s.b, s.a.psi);
        return (a_at_b <= 0 && least_between(-s.a.F, -a_at_b, bend, h) >= 0) ||
               (b_at_a <= 0 && least_between(-b_at_a, -s.b.F, bend, h) >= 0);
    }

    /// Narrows a stretch with one free and one blocked end down to the root of F. Secant steps alternate with
    /// bisection in every third step.
    Stretch bracketed(Stretch s) noexcept {
        for (int step = 0; step < MovingPairTuning::most_steps; ++step) {
            const double h = s.b.psi - s.a.psi;
            if (h <= bracket_) break;
            const double share = step % 3 == 2 ? 0.5 : s.a.F / (s.a.F - s.b.F), room = 0.4 * bracket_;
            const double psi = s.a.psi + min(max(share * h, room), h - room);
            if (!(psi > s.a.psi && psi < s.b.psi)) break;
            const Sample here = at(psi);
            ((here.F > 0) == (s.a.F > 0) ? s.a : s.b) = here;
        }
        return s;
    }

    /// Puts a stretch on the stack.
    void push(const Stretch& s) noexcept { stack_[count_++] = s; }

    const MovingRod& rod_;
    const MovingRod* other_;
    Solid solid_;
    double R_;
    double sliver_ = MovingPairTuning::sliver, bracket_ = MovingPairTuning::bracket;
    double gap_ = 0;  // half of what is between the places that a field is asked at, m
    int queries_ = 0, count_ = 0;
    Stretch stack_[most_stretches];
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
