// Rounded: a scalar that holds one value or many lanes, with one bound of size and one bound of error. The
// library's formulas run on it unchanged. All lanes share both bounds, so the bounds cost almost nothing.
//
// u is half a unit in the last place. IEEE 754 gives |fl(a op b) - (a op b)| <= u |a op b|, and so
//
//     |a| <= A, |error of a| <= e:    a + b:  A + B,   e_a + e_b + u (A + B)
//                                     a b:    A B,     A e_b + B e_a + e_a e_b + u (A + e_a) (B + e_b)
//
// A term of 2 u covers the rounding of the value. The bounds are sums and products of positive numbers; each
// operation rounds them by a share of u. `bound` adds the share of 2^20 operations.
#pragma once

#include "scalar.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Numbers of at most `size`, each within `radius` of the value stored.
template <class T>
struct Rounded {
    T value;
    double size, radius;

    /// Twice the relative rounding of one operation.
    static constexpr double rounding = 0x1p-52;

    Rounded() noexcept = default;
    /// A computed value with a bound `most` of its size and a bound `within` of its error.
    ARMANGLE_INLINE Rounded(const T& about, double most, double within) noexcept
        : value(about), size(most), radius(within) {}
    /// One exact number.
    ARMANGLE_INLINE Rounded(double exact) noexcept : value(exact), size(abs(exact)), radius(0.0) {}

    /// A bound of the error, including the rounding of the bound itself.
    double bound() const noexcept { return radius * (1.0 + 0x1p-32) + 1e-300; }

    ARMANGLE_INLINE friend Rounded operator+(const Rounded& a, const Rounded& b) noexcept {
        const double most = a.size + b.size;
        return {a.value + b.value, most, a.radius + b.radius + rounding * most};
    }
    ARMANGLE_INLINE friend Rounded operator-(const Rounded& a, const Rounded& b) noexcept {
        const double most = a.size + b.size;
        return {a.value - b.value, most, a.radius + b.radius + rounding * most};
    }
    ARMANGLE_INLINE friend Rounded operator-(const Rounded& a) noexcept {
        return {-a.value, a.size, a.radius};
    }
    ARMANGLE_INLINE friend Rounded operator*(const Rounded& a, const Rounded& b) noexcept {
        const double from_b = (a.size + a.radius) * (b.radius + rounding * b.size);
        return {a.value * b.value, a.size * b.size, from_b + a.radius * b.size};
    }
};

}  // namespace armangle

#include "../names/end.hpp"
