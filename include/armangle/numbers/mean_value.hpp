// MeanValue: a scalar whose every result encloses a quantity over a box of N variables.
//
// A variable is middle + half u with u in [-1, 1]. A quantity is known by its value f(0) at the middle of the
// box, its range, and the ranges of its derivatives by u. All three are intervals, with their rounding. By
// the mean value theorem
//
//     f(u) in f(0) + sum_i f_i [-1, 1],
//
// and each operation cuts the range to that. Where the library's formulas run on it, the range is wider than
// the true one by a share that falls with the size of the box. Source: R. E. Moore, Interval Analysis (1966),
// chapter 6.
#pragma once

#include "interval.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A quantity over a box: its value at the middle, its range, and its derivatives by each variable.
template <int N>
struct MeanValue {
    Interval middle, range, slope[N];

    MeanValue() noexcept = default;
    /// A constant.
    MeanValue(double constant) noexcept : middle(constant), range(constant) {
        for (Interval& s : slope) s = Interval(0.0);
    }
    /// The variable i (0..N - 1), which is within `half` of `about`.
    static MeanValue variable(int i, double about, double half) noexcept {
        MeanValue out(about);
        out.range = {detail::below(about - half), detail::above(about + half)};
        out.slope[i] = Interval(half);
        return out;
    }
    /// A quantity of which nothing is known.
    static MeanValue unknown() noexcept {
        MeanValue out;
        out.middle = out.range = Interval::whole();
        for (Interval& s : out.slope) s = Interval::whole();
        return out;
    }
    /// By how much the quantity differs from its value at the middle at most; infinite if that is not known.
    double reach() const noexcept {
        double sum = 0;
        for (const Interval& s : slope) {
            if (!s.bounded()) return infinity;
            sum = detail::above(sum + detail::greater(std::fabs(s.lo), std::fabs(s.hi)));
        }
        return sum;
    }

    friend MeanValue operator+(const MeanValue& a, const MeanValue& b) noexcept {
        return made(a.middle + b.middle, a.range + b.range, [&](int i) { return a.slope[i] + b.slope[i]; });
    }
    friend MeanValue operator-(const MeanValue& a, const MeanValue& b) noexcept {
        return made(a.middle - b.middle, a.range - b.range, [&](int i) { return a.slope[i] - b.slope[i]; });
    }
    friend MeanValue operator-(const MeanValue& a) noexcept { return MeanValue(0.0) - a; }
    friend MeanValue operator*(const MeanValue& a, const MeanValue& b) noexcept {
        return made(a.middle * b.middle, a.range * b.range,
                    [&](int i) { return a.range * b.slope[i] + b.range * a.slope[i]; });
    }
    friend MeanValue operator/(const MeanValue& a, const MeanValue& b) noexcept {
        const Interval ratio = a.range / b.range;
        return made(a.middle / b.middle, ratio,
                    [&](int i) { return (a.slope[i] - b.slope[i] * ratio) / b.range; });
    }

    /// Comparisons say whether they may hold, and may fail, somewhere in the box.
    friend Decision operator<(const MeanValue& a, const MeanValue& b) noexcept { return a.range < b.range; }
    friend Decision operator<=(const MeanValue& a, const MeanValue& b) noexcept { return a.range <= b.range; }
    friend Decision operator==(const MeanValue& a, const MeanValue& b) noexcept { return a.range == b.range; }

    /// A quantity with this value at the middle, range, and slope(i) by each variable.
    template <class Slope>
    static MeanValue made(const Interval& middle, const Interval& range, const Slope& slope) noexcept {
        MeanValue out;
        out.middle = middle;
        for (int i = 0; i < N; ++i) out.slope[i] = slope(i);
        const double by = out.reach();
        out.range = by < infinity && middle.bounded() ? meet(range, middle + Interval(-by, by)) : range;
        return out;
    }
};

/// `yes` if the mask holds all over the box, `no` if it fails all over it; otherwise nothing is known.
template <int N>
MeanValue<N> select(Decision mask, const MeanValue<N>& yes, const MeanValue<N>& no) noexcept {
    if (!mask.may_fail) return yes;
    return mask.may_hold ? MeanValue<N>::unknown() : no;
}

/// a b + c.
template <int N>
MeanValue<N> mul_add(const MeanValue<N>& a, const MeanValue<N>& b, const MeanValue<N>& c) noexcept {
    return a * b + c;
}

/// The absolute value.
template <int N>
MeanValue<N> abs(const MeanValue<N>& a) noexcept {
    return select(a < MeanValue<N>(0.0), -a, a);
}

/// The greater of two quantities, whose range is known even where it is undecided which one that is.
template <int N>
MeanValue<N> max(const MeanValue<N>& a, const MeanValue<N>& b) noexcept {
    MeanValue<N> out = select(a < b, b, a);
    out.middle = max(a.middle, b.middle);
    out.range = max(a.range, b.range);
    return out;
}

/// The square root where there is one.
template <int N>
MeanValue<N> sqrt(const MeanValue<N>& a) noexcept {
    const Interval root = sqrt(a.range), twice = root + root;
    return MeanValue<N>::made(sqrt(a.middle), root, [&](int i) { return a.slope[i] / twice; });
}

/// The square; its range is never negative.
template <int N>
MeanValue<N> square(const MeanValue<N>& a) noexcept {
    const Interval twice = a.range + a.range;
    return MeanValue<N>::made(square(a.middle), square(a.range), [&](int i) { return twice * a.slope[i]; });
}

/// sqrt(a^2 + b^2).
template <int N>
MeanValue<N> hypot(const MeanValue<N>& a, const MeanValue<N>& b) noexcept {
    return sqrt(square(a) + square(b));
}

/// Like cut_off of elbow.hpp: 0 if a gap is within rounding, else the given value, which is then not
/// negative. The derivatives are known only if the case is decided.
template <int N>
MeanValue<N> cut_off(const MeanValue<N>& gap, const MeanValue<N>& rounding,
                     const MeanValue<N>& value) noexcept {
    MeanValue<N> out = value;
    out.middle = cut_off(gap.middle, rounding.middle, value.middle);
    out.range = cut_off(gap.range, rounding.range, value.range);
    if (any(gap <= rounding))
        for (Interval& s : out.slope) s = Interval::whole();
    return out;
}

/// Sine and cosine of an angle (rad).
template <int N>
SinCos<MeanValue<N>> sin_cos(const MeanValue<N>& a) noexcept {
    const SinCos<Interval> middle = sin_cos(a.middle), range = sin_cos(a.range);
    return {MeanValue<N>::made(middle.sin, range.sin, [&](int i) { return range.cos * a.slope[i]; }),
            MeanValue<N>::made(middle.cos, range.cos, [&](int i) { return -(range.sin * a.slope[i]); })};
}

}  // namespace armangle

#include "../names/end.hpp"
