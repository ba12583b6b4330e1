// Enclosure: a value and a radius that holds every value a quantity takes over a box, as a scalar of
// formulas.
//
// The middle is the value at the middle of the box, exactly; the radius bounds how far it moves over the box.
// Rounding is not in the radius (interval.hpp has it): what is decided by an enclosure is decided up to
// rounding. Source: centred forms, R. E. Moore, Interval Analysis (1966), chapter 6.
#pragma once

#include "scalar.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A middle, and how far from it values go at most.
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

/// The square: one value taken twice.
template <class T>
ARMANGLE_INLINE Enclosure<T> square(const Enclosure<T>& a) noexcept {
    return {a.middle * a.middle, a.radius * (T(2.0) * abs(a.middle) + a.radius)};
}

/// 1 / a of an `a` that is positive over the whole box; elsewhere the numbers mean nothing.
template <class T>
ARMANGLE_INLINE Enclosure<T> reciprocal(const Enclosure<T>& a) noexcept {
    const T least = a.middle - a.radius;
    const auto positive = T(0.0) < least;
    const T one_over = T(1.0) / select(T(0.0) < a.middle, a.middle, T(1.0));
    return {one_over, a.radius * one_over / select(positive, least, T(1.0))};
}

}  // namespace armangle

#include "../names/end.hpp"
