// Interval: a scalar whose every result is guaranteed to contain the real result. The library's formulas run
// on it unchanged.
//
// Each operation widens its bounds outward by more than its rounding: |x| 2^-52 + 1e-300 is at least one unit
// in the last place. It trusts only the machine's + - * / and sqrt, which IEEE 754 rounds correctly. A
// comparison may be undecided. `select` on an undecided mask returns the whole line; no condition can be
// proven from it, so the caller subdivides.
#pragma once

#include "angles.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Result of a comparison: whether it can hold and whether it can fail for members of the intervals.
struct Decision {
    bool may_hold, may_fail;

    friend Decision operator&(Decision a, Decision b) noexcept {
        return {a.may_hold && b.may_hold, a.may_fail || b.may_fail};
    }
    friend Decision operator|(Decision a, Decision b) noexcept {
        return {a.may_hold || b.may_hold, a.may_fail && b.may_fail};
    }
    friend Decision operator!(Decision a) noexcept { return {a.may_fail, a.may_hold}; }
};

namespace detail {

/// A number below x, by more than the rounding of the operation that gave x.
inline double below(double x) noexcept { return x - (std::fabs(x) * 0x1p-52 + 1e-300); }
/// A number above x, by more than the rounding of the operation that gave x.
inline double above(double x) noexcept { return x + (std::fabs(x) * 0x1p-52 + 1e-300); }
/// The lesser of two numbers.
inline double lesser(double a, double b) noexcept { return a < b ? a : b; }
/// The greater of two numbers.
inline double greater(double a, double b) noexcept { return a < b ? b : a; }

/// Bound of the error of sin_cos(double) for |x| <= 1e3. The reduction errs by at most two roundings of a
/// number below 1.6 (2.3e-16 each) and by |k| 1e-36. The polynomials err by a truncation of 2e-17 and by
/// roundings below 4e-16.
inline constexpr double sin_cos_error = 1e-15;
inline constexpr double sin_cos_range = 1e3;

}  // namespace detail

/// All numbers from `lo` to `hi`. Arithmetic rounds outwards; a product or quotient is all numbers if an
/// operand is unbounded or the divisor may be 0.
struct Interval {
    double lo, hi;

    Interval() noexcept = default;
    /// An exact number.
    Interval(double x) noexcept : lo(x), hi(x) {}
    /// The interval [lower, upper].
    Interval(double lower, double upper) noexcept : lo(lower), hi(upper) {}

    /// The interval of all real numbers.
    static Interval whole() noexcept { return {-infinity, infinity}; }
    /// The middle of a bounded interval, rounded.
    double middle() const noexcept { return lo + 0.5 * (hi - lo); }
    /// Whether both ends are finite.
    bool bounded() const noexcept { return lo > -infinity && hi < infinity; }  // false for NaN

    friend Interval operator+(const Interval& a, const Interval& b) noexcept {
        return {detail::below(a.lo + b.lo), detail::above(a.hi + b.hi)};
    }
    friend Interval operator-(const Interval& a, const Interval& b) noexcept {
        return {detail::below(a.lo - b.hi), detail::above(a.hi - b.lo)};
    }
    friend Interval operator-(const Interval& a) noexcept { return {-a.hi, -a.lo}; }
    friend Interval operator*(const Interval& a, const Interval& b) noexcept {
        if (!a.bounded() || !b.bounded()) return whole();
        const double p = a.lo * b.lo, q = a.lo * b.hi, r = a.hi * b.lo, s = a.hi * b.hi;
        using detail::greater, detail::lesser;
        return {detail::below(lesser(lesser(p, q), lesser(r, s))),
                detail::above(greater(greater(p, q), greater(r, s)))};
    }
    friend Interval operator/(const Interval& a, const Interval& b) noexcept {
        if (!a.bounded() || !b.bounded() || !(b.lo > 0 || b.hi < 0)) return whole();
        const double p = a.lo / b.lo, q = a.lo / b.hi, r = a.hi / b.lo, s = a.hi / b.hi;
        using detail::greater, detail::lesser;
        return {detail::below(lesser(lesser(p, q), lesser(r, s))),
                detail::above(greater(greater(p, q), greater(r, s)))};
    }

    /// Comparisons say whether they may hold, and may fail, for a pair of members.
    friend Decision operator<(const Interval& a, const Interval& b) noexcept {
        return {!(a.lo >= b.hi), !(a.hi < b.lo)};
    }
    friend Decision operator<=(const Interval& a, const Interval& b) noexcept {
        return {!(a.lo > b.hi), !(a.hi <= b.lo)};
    }
    friend Decision operator>(const Interval& a, const Interval& b) noexcept { return b < a; }
    friend Decision operator>=(const Interval& a, const Interval& b) noexcept { return b <= a; }
    friend Decision operator==(const Interval& a, const Interval& b) noexcept {
        return {!(a.hi < b.lo || b.hi < a.lo), !(a.lo == a.hi && b.lo == b.hi && a.lo == b.lo)};
    }
};

/// Whether the condition may hold.
inline bool any(Decision mask) noexcept { return mask.may_hold; }

/// `yes` if the mask holds for certain, `no` if it fails for certain, otherwise everything.
inline Interval select(Decision mask, const Interval& yes, const Interval& no) noexcept {
    if (!mask.may_fail) return yes;
    return mask.may_hold ? Interval::whole() : no;
}

/// Returns 0 if a gap is at most `rounding`, else the given value (elbow.hpp). If both are possible, the
/// result covers both; the value is then not negative.
inline Interval cut_off(const Interval& gap, const Interval& rounding, const Interval& value) noexcept {
    const Decision vanishes = gap <= rounding;
    if (!vanishes.may_hold) return value;
    return {0.0, vanishes.may_fail ? detail::greater(value.hi, 0.0) : 0.0};
}

/// The enclosure of a b + c.
inline Interval mul_add(const Interval& a, const Interval& b, const Interval& c) noexcept {
    return a * b + c;
}

/// The tightest interval of |a|.
inline Interval abs(const Interval& a) noexcept {
    if (a.lo >= 0) return a;
    if (a.hi <= 0) return -a;
    return {0.0, detail::greater(-a.lo, a.hi)};
}

/// The squares of all members. Unlike a * a of an interval around 0, the result is never negative.
inline Interval square(const Interval& a) noexcept {
    const Interval product = a * a;
    return {a.lo <= 0 && a.hi >= 0 ? 0.0 : detail::greater(product.lo, 0.0), product.hi};
}

/// Square roots of the members that have one; all numbers if none has, or if `a` is unbounded. The lower
/// bound of an argument may fall below 0 although the real argument is never negative.
inline Interval sqrt(const Interval& a) noexcept {
    if (!(a.hi >= 0) || !a.bounded()) return Interval::whole();
    const double lo = a.lo > 0 ? detail::below(std::sqrt(a.lo)) : 0.0;
    return {detail::greater(lo, 0.0), detail::above(std::sqrt(a.hi))};
}

/// The enclosure of sqrt(a^2 + b^2).
inline Interval hypot(const Interval& a, const Interval& b) noexcept { return sqrt(square(a) + square(b)); }

/// The enclosure of the lesser number; all numbers if one is unbounded.
inline Interval min(const Interval& a, const Interval& b) noexcept {
    if (!a.bounded() || !b.bounded()) return Interval::whole();
    return {detail::lesser(a.lo, b.lo), detail::lesser(a.hi, b.hi)};
}

/// The enclosure of the greater number; all numbers if one is unbounded.
inline Interval max(const Interval& a, const Interval& b) noexcept { return -min(-a, -b); }

/// The intersection of two enclosures of one number, which always overlap; if one is unbounded, the other.
inline Interval meet(const Interval& a, const Interval& b) noexcept {
    if (!a.bounded()) return b;
    if (!b.bounded()) return a;
    return {detail::greater(a.lo, b.lo), detail::lesser(a.hi, b.hi)};
}

namespace detail {

/// Bounds of a sine or cosine, widened by its error and kept within [-1, 1].
inline Interval near_unit(double lower, double upper) noexcept {
    return {greater(lower - sin_cos_error, -1.0), lesser(upper + sin_cos_error, 1.0)};
}

}  // namespace detail

/// Sine and cosine: their values at both ends, and +-1 if an extreme lies or may lie between the ends; [-1,
/// 1] if x is 1 wide or more, or beyond sin_cos_range.
inline SinCos<Interval> sin_cos(const Interval& x) noexcept {
    const Interval any{-1.0, 1.0};
    if (!(x.lo >= -detail::sin_cos_range && x.hi <= detail::sin_cos_range) || !(x.hi - x.lo < 1.0))
        return {any, any};
    const SinCos<double> a = sin_cos(x.lo), b = sin_cos(x.hi);
    using detail::greater, detail::lesser, detail::near_unit;
    SinCos<Interval> out{near_unit(lesser(a.sin, b.sin), greater(a.sin, b.sin)),
                         near_unit(lesser(a.cos, b.cos), greater(a.cos, b.cos))};
    // Within a width below 1 each function has at most one extreme: the zero of the other function.
    const bool cos_changes = !(out.cos.lo > 0 || out.cos.hi < 0),
               sin_changes = !(out.sin.lo > 0 || out.sin.hi < 0);
    if (cos_changes) (a.sin + b.sin > 0 ? out.sin.hi : out.sin.lo) = a.sin + b.sin > 0 ? 1.0 : -1.0;
    if (sin_changes) (a.cos + b.cos > 0 ? out.cos.hi : out.cos.lo) = a.cos + b.cos > 0 ? 1.0 : -1.0;
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
