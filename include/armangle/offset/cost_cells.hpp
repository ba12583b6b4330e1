// What a posture of an arm with an offset costs over cells of the free joint, as many cells at a time as the
// processor has lanes.
//
//     cost |\      _        The closed form itself, run on Jet<Enclosure<CostCells>, 2>, gives every joint
//          | \    / \       at the middles, and bounds of its value, slope and curvature over the cells. So
//          +-|--|--|- free  a cell has a lower bound of second order, and it is told where the cost rises,
//                           falls or is convex all over it.
#pragma once

#include "../limits/nearest_search.hpp"
#include "offset_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The enclosure of cut_off() of elbow.hpp: 0 if the gap is below its rounding, otherwise the value. Its
/// radius is that of the value; its derivative is known if the gap has one sign.
template <class T, int K>
Jet<Enclosure<T>, K> cut_off(const Jet<Enclosure<T>, K>& gap, const Jet<Enclosure<T>, K>& rounding,
                             const Jet<Enclosure<T>, K>& value) noexcept {
    const auto vanishes = gap.value() <= rounding.value();
    Jet<Enclosure<T>, K> out = select(vanishes, Jet<Enclosure<T>, K>(0.0), value);
    out.coefficient[0].radius = value.coefficient[0].radius;
    return out;
}

namespace detail {

/// As many cells as the processor has lanes.
using CostCells = Lane<register_width>;

/// Bounds of the joints of a pose and branch over cells of the free joint, in the order of the formulas. The
/// free joint is middle + half u, u in [-1, 1].
struct OffsetOverCells {
    CostCells theta[joints];                            // at the middles
    CostCells travel[joints];                           // theta stays within theta +- travel
    Enclosure<CostCells> rate[joints], second[joints];  // d theta / du, and once more

    /// Computes the bounds over cells middle +- half (rad).
    OffsetOverCells(const OffsetArm& arm, const OffsetMotion<>& m, const CostCells& middle,
                    const CostCells& half) noexcept {
        using Over = Enclosure<CostCells>;
        Jet<Over, 2> free(0.0), angle[joints];
        free.coefficient[0] = {middle, half};
        free.coefficient[1] = {half, CostCells(0.0)};
        angles_along(arm, m, free, angle);
        for (int j = 0; j < joints; ++j) {
            theta[j] = angle[j].coefficient[0].middle;
            travel[j] = angle[j].coefficient[0].radius;
            rate[j] = angle[j].coefficient[1];
            second[j] = angle[j].coefficient[2] * CostCells(2.0);
        }
    }
};

/// Bounds of the cost over cells.
struct OffsetCellCosts {
    CostCells value;              // at the middles
    CostCells least;              // a lower bound over the cells
    CostCells best;               // from the middles to where the bound is least, a share of the half width
    unsigned rises, falls, bowl;  // one bit a cell: what the cost does all over it
};

/// Computes bounds of the cost over cells.
class OffsetCosts : protected PostureCosts {
protected:
    using PostureCosts::PostureCosts;

    /// The bounds of the cost over cells whose postures are within the limits.
    OffsetCellCosts costs(const OffsetOverCells& over) const noexcept {
        return squares() ? sums(over) : largest(over);
    }

private:
    using Lanes = CostCells;
    /// The difference of a joint from the seed over cells, with the multiple of 2 pi that is cheapest at the
    /// middles.
    struct Way {
        Lanes middle, least,
            most;  // from `near` at the middles; the least and the largest size over the cells
        LaneMask<register_width> smooth;  // whether that turn is the nearest all over the cell
    };
    /// The difference of joint j (0..6) from the seed over cells.
    Way way(int j, const OffsetOverCells& over) const noexcept {
        const JointCost& c = joint_[j];
        const Lanes zero(0.0), near(c.near), lower(c.lower), upper(c.upper), travel = over.travel[j];
        const Lanes q = to_q(over.theta[j], Lanes(c.sign), Lanes(c.offset), lower, upper, near);
        const auto apart = [&](const Lanes& at) {
            return max(zero, max(max(at - travel, lower) - near, near - min(at + travel, upper)));
        };
        const Lanes d = q - near;
        Way out{d, apart(q), abs(d) + travel, d == d};
        if (!c.wide) return out;
        const Lanes turn(two_pi), slack(tolerance::angle);
        for (const double side : {-1.0, 1.0}) {
            const Lanes other = q + Lanes(side) * turn;
            const auto fits = (other - travel <= upper + slack) & (lower - slack <= other + travel);
            const Lanes there = select(fits, max(zero, abs(other - near) - travel), Lanes(infinity));
            out.smooth = out.smooth & (out.most < there);
            out.least = min(out.least, there);
        }
        out.smooth = out.smooth & (lower <= q - travel) & (q + travel <= upper);
        return out;
    }

    /// The bounds of a cost that is a sum of squares.
    OffsetCellCosts sums(const OffsetOverCells& over) const noexcept {
        const Lanes zero(0.0), one(1.0), half(0.5), two(2.0);
        Lanes value(0.0), least(0.0), slope(0.0);
        Enclosure<Lanes> second(0.0);
        auto smooth = zero == zero;
        for (int j = 0; j < joints; ++j) {
            const Way w = way(j, over);
            const Lanes weight(joint_[j].weight), sign(joint_[j].sign);
            const Enclosure<Lanes> d{w.middle, over.travel[j]};
            value = mul_add(weight * w.middle, w.middle, value);
            least = mul_add(weight * w.least, w.least, least);
            slope = mul_add(two * weight * sign * w.middle, over.rate[j].middle, slope);
            second = second + (square(over.rate[j]) + d * over.second[j] * sign) * (two * weight);
            smooth = smooth & w.smooth;
        }
        smooth = smooth & (second.radius < Lanes(unknown));
        const Lanes low = select(smooth, second.lower(), Lanes(-infinity)), steep = abs(slope);
        const Lanes line = value - steep + half * min(low, zero);
        const auto bowl = zero < low;
        const Lanes bent = value - half * slope * slope / select(bowl, low, one);
        least = max(least, select(bowl, max(line, bent), line));
        const auto one_way = smooth & (second.largest() <= steep);
        return {value,
                least,
                select(bowl, max(-one, min(one, -slope / select(bowl, low, one))), zero),
                bits(one_way & (zero < slope)),
                bits(one_way & (slope <= zero)),
                bits(bowl)};
    }

    /// The bounds of a cost that is the largest difference, or minus the limit margin.
    OffsetCellCosts largest(const OffsetOverCells& over) const noexcept {
        const Lanes zero(0.0), none(-infinity), half(0.5);
        Lanes value = none, least = none;
        Lanes rising = none, rise = zero, falling = none, fall = zero;  // lines below the cost
        Lanes most[joints], lower[joints], upper[joints];               // of each joint's cost; of its slope
        for (int j = 0; j < joints; ++j) {
            const Way w = way(j, over);
            const JointCost& c = joint_[j];
            const Lanes weight(c.weight), room(c.room);
            const bool counts = c.weight > 0;
            most[j] = select(w.smooth, weight * w.most - room, Lanes(infinity));
            const Lanes side = select(w.middle < zero, Lanes(-c.sign), Lanes(c.sign));
            const Enclosure<Lanes> rate = over.rate[j] * (weight * side);
            const auto kept = w.smooth & (over.travel[j] < abs(w.middle));  // on one side of `near`
            lower[j] = select(kept, rate.lower(), -rate.largest());
            upper[j] = select(kept, rate.upper(), rate.largest());
            if (!counts) most[j] = none;
            if (!counts && options_.metric != Metric::max) continue;
            value = max(value, counts ? weight * abs(w.middle) - room : zero);
            least = max(least, counts ? weight * w.least - room : zero);
            if (!counts) continue;
            const Lanes line = select(
                w.smooth, weight * abs(w.middle) - room - half * weight * over.second[j].largest(), none);
            const auto up = (zero <= rate.middle) & (rising < line),
                       down = (rate.middle < zero) & (falling < line);
            rising = select(up, line, rising);
            rise = select(up, rate.middle, rise);
            falling = select(down, line, falling);
            fall = select(down, rate.middle, fall);
        }
        const Lanes steep = max(rise - fall, Lanes(1e-300)), one(1.0);
        const Lanes apart = select((rising == none) & (falling == none), zero, falling - rising);
        const Lanes off = min(max(apart / steep, -one), one);
        least = max(least, max(select(rising == none, none, rising + rise * off),
                               select(falling == none, none, falling + fall * off)));
        auto rises = zero == zero, falls = rises;
        for (int j = 0; j < joints; ++j) {  // those that may be the largest
            const auto is_less = most[j] < least;
            rises = rises & (is_less | (zero <= lower[j]));
            falls = falls & (is_less | (upper[j] <= zero));
        }
        return {value, least, off, bits(rises), bits(falls), 0};
    }

    static constexpr double unknown = 1e90;  // a larger bound says nothing
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
