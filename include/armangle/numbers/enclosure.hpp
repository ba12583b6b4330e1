// Enclosure: a scalar that holds a middle and a radius. Together they enclose every value of a quantity over
// a box.
//
// The middle is the exact value at the middle of the box. The radius bounds how far the value moves over the
// box; it is huge or NaN if nothing is known. The radius does not include rounding (interval.hpp does), so
// conclusions from an enclosure hold up to rounding. Enclosures of lanes are a scalar: the library's formulas
// run on Jet<Enclosure<Lane<8>>, K> unchanged. Source: centred forms, R. E. Moore, Interval Analysis (1966),
// chapter 6.
#pragma once

#include "angles.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A middle, and the largest distance of any value from it.
template <class T>
struct Enclosure {
    T middle, radius;

    /// Uninitialized.
    Enclosure() noexcept = default;
    /// An enclosure of all values that differ from `about` by at most `within`.
    ARMANGLE_INLINE Enclosure(const T& about, const T& within) noexcept : middle(about), radius(within) {}
    /// An enclosure of one exact number.
    ARMANGLE_INLINE Enclosure(double exact) noexcept : middle(exact), radius(0.0) {}

    /// The largest absolute value.
    T largest() const noexcept { return abs(middle) + radius; }
    /// The lower end.
    T lower() const noexcept { return middle - radius; }
    /// The upper end.
    T upper() const noexcept { return middle + radius; }

    ARMANGLE_INLINE friend Enclosure operator+(const Enclosure& a, const Enclosure& b) noexcept {
        return {a.middle + b.middle, a.radius + b.radius};
    }
    ARMANGLE_INLINE friend Enclosure operator-(const Enclosure& a, const Enclosure& b) noexcept {
        return {a.middle - b.middle, a.radius + b.radius};
    }
    ARMANGLE_INLINE friend Enclosure operator*(const Enclosure& a, const Enclosure& b) noexcept {
        return {a.middle * b.middle, abs(a.middle) * b.radius + a.radius * b.largest()};
    }
    ARMANGLE_INLINE friend Enclosure operator*(const Enclosure& a, const T& k) noexcept {
        return {a.middle * k, a.radius * abs(k)};
    }
    ARMANGLE_INLINE friend Enclosure operator-(const Enclosure& a) noexcept { return {-a.middle, a.radius}; }
    /// Nothing is known if the divisor may be 0.
    ARMANGLE_INLINE friend Enclosure operator/(const Enclosure& a, const Enclosure& b) noexcept {
        const T ratio = a.middle / b.middle, least = abs(b.middle) - b.radius;
        return {ratio, select(T(0.0) < least, (a.radius + abs(ratio) * b.radius) / least, T(infinity))};
    }
};

/// Result of a comparison over boxes: whether it holds at the middles, and whether it is the same over all of
/// a box.
template <class Mask>
struct BoxDecision {
    Mask holds, same;
};

/// Comparisons return a BoxDecision: whether it holds at the middles, and whether it is the same over all of
/// the boxes.
template <class T>
ARMANGLE_INLINE auto operator<(const Enclosure<T>& a, const Enclosure<T>& b) noexcept {
    const T apart = b.middle - a.middle;
    return BoxDecision<decltype(apart < apart)>{T(0.0) < apart, a.radius + b.radius < abs(apart)};
}
template <class T>
ARMANGLE_INLINE auto operator<=(const Enclosure<T>& a, const Enclosure<T>& b) noexcept {
    const T apart = b.middle - a.middle;
    return BoxDecision<decltype(apart < apart)>{T(0.0) <= apart, a.radius + b.radius < abs(apart)};
}
template <class T>
ARMANGLE_INLINE auto operator==(const Enclosure<T>& a, const Enclosure<T>& b) noexcept {
    const T apart = b.middle - a.middle;
    return BoxDecision<decltype(apart < apart)>{apart == T(0.0), a.radius + b.radius < abs(apart)};
}

/// An enclosure of the value that the mask selects; infinitely wide where the mask changes within a box.
template <class Mask, class T>
ARMANGLE_INLINE Enclosure<T> select(const BoxDecision<Mask>& mask, const Enclosure<T>& yes,
                                    const Enclosure<T>& no) noexcept {
    return {select(mask.holds, yes.middle, no.middle),
            select(mask.same, select(mask.holds, yes.radius, no.radius), T(infinity))};
}

/// The enclosure of a b + c.
template <class T>
ARMANGLE_INLINE Enclosure<T> mul_add(const Enclosure<T>& a, const Enclosure<T>& b,
                                     const Enclosure<T>& c) noexcept {
    return a * b + c;
}

/// An enclosure of the lesser of two enclosed numbers. It moves no farther than the one that moves farther.
template <class T>
ARMANGLE_INLINE Enclosure<T> min(Enclosure<T> a, Enclosure<T> b) noexcept {
    return {min(a.middle, b.middle), max(a.radius, b.radius)};
}
/// An enclosure of the larger of two enclosed numbers.
template <class T>
ARMANGLE_INLINE Enclosure<T> max(Enclosure<T> a, Enclosure<T> b) noexcept {
    return {max(a.middle, b.middle), max(a.radius, b.radius)};
}

/// An enclosure of the square roots of the members that have one.
template <class T>
ARMANGLE_INLINE Enclosure<T> sqrt(const Enclosure<T>& a) noexcept {
    const T zero(0.0), root = sqrt(max(a.middle, zero)), least = sqrt(max(a.lower(), zero));
    const T most = sqrt(max(a.upper(), zero));
    return {root, max(root - least, most - root)};
}

/// Enclosures of sine and cosine, from |f(m + d) - f(m)| <= |f'(m)| d + d^2 / 2.
template <class T>
ARMANGLE_INLINE SinCos<Enclosure<T>> sin_cos(const Enclosure<T>& a) noexcept {
    const SinCos<T> at = sin_cos(a.middle);
    const T bend = T(0.5) * a.radius * a.radius;
    return {{at.sin, abs(at.cos) * a.radius + bend}, {at.cos, abs(at.sin) * a.radius + bend}};
}

/// Angle of the direction (x, y), continued over the box from the middle's; unknown if it may turn by a
/// quarter.
template <class T>
ARMANGLE_INLINE Enclosure<T> atan2(const Enclosure<T>& y, const Enclosure<T>& x) noexcept {
    const T size = sqrt(x.middle * x.middle + y.middle * y.middle);
    const T away = (abs(x.middle) * y.radius + abs(y.middle) * x.radius) / size;  // across the direction
    const T along = size - (abs(x.middle) * x.radius + abs(y.middle) * y.radius) / size;
    return {atan2(y.middle, x.middle), select(T(0.0) < along, away / along, T(infinity))};
}

/// The square of one value; tighter than a product of two independent values.
template <class T>
ARMANGLE_INLINE Enclosure<T> square(const Enclosure<T>& a) noexcept {
    return {a.middle * a.middle, a.radius * (T(2.0) * abs(a.middle) + a.radius)};
}

/// 1 / a, valid only if `a` is positive over the whole box; otherwise the result is meaningless.
template <class T>
ARMANGLE_INLINE Enclosure<T> reciprocal(const Enclosure<T>& a) noexcept {
    const T least = a.middle - a.radius;
    const auto positive = T(0.0) < least;
    const T one_over = T(1.0) / select(T(0.0) < a.middle, a.middle, T(1.0));
    return {one_over, a.radius * one_over / select(positive, least, T(1.0))};
}

/// Tightens the coefficients of a jet over boxes whose variable is in [-1, 1]: a derivative changes at most
/// by the next one. Unknown ones (infinite or NaN) are bounded by a large number.
template <class T, int K>
ARMANGLE_INLINE void tighten(Enclosure<T> (&coefficient)[K]) noexcept {
    const T unknown(1e100);
    for (int k = K; k-- > 0;) {
        T& radius = coefficient[k].radius;
        radius = select(radius < unknown, radius, unknown);
        if (k + 1 < K) radius = min(radius, T(k + 1.0) * coefficient[k + 1].largest());
    }
}

}  // namespace armangle

#include "../names/end.hpp"
