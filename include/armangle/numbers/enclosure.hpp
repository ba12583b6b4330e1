// Enclosure: a scalar that holds a middle and a radius. Together they enclose every value of a quantity over
// a box.
//
// The middle is the exact value at the middle of the box. The radius bounds how far the value moves over the
// box. The radius does not include rounding (interval.hpp does), so conclusions from an enclosure hold up to
// rounding. Source: centred forms, R. E. Moore, Interval Analysis (1966), chapter 6.
#pragma once

#include "scalar.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A middle, and the largest distance of any value from it.
template <class T>
struct Enclosure {
    T middle, radius;

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
};

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

}  // namespace armangle

#include "../names/end.hpp"
