// Rounded: a value, or many in lanes, with a bound of its size and one of its error. The formulas of the
// library run on it as they are; in lanes both bounds are those of all lanes together, so that they cost next
// to nothing.
//
// u is half a unit in the last place. IEEE 754 gives |fl(a op b) - (a op b)| <= u |a op b|, and so
//
//     |a| <= A, |error of a| <= e:    a + b:  A + B,   e_a + e_b + u (A + B)
//                                     a b:    A B,     A e_b + B e_a + e_a e_b + u (A + e_a) (B + e_b)
//
// A term of 2 u covers the rounding of the value; that of the bounds, sums and products of positive numbers,
// takes a share of u of them in each operation, and `bound` adds the share of 2^20 operations.
#pragma once

#include "scalar.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Numbers of at most `size`, each within `radius` of the value stored.
template <class T>
struct Rounded {
    T value;
    double size, radius;

    /// Twice the relative rounding of an operation.
    static constexpr double rounding = 0x1p-52;

    Rounded() noexcept = default;
    ARMANGLE_INLINE Rounded(const T& about, double most, double within) noexcept
        : value(about), size(most), radius(within) {}
    /// One exact number.
    ARMANGLE_INLINE Rounded(double exact) noexcept : value(exact), size(abs(exact)), radius(0.0) {}

    /// A bound of the error, its own rounding included.
    double bound() const noexcept { return radius * (1.0 + 0x1p-32) + 1e-300; }

    ARMANGLE_INLINE friend Rounded operator+(const Rounded& a, const Rounded& b) noexcept {
        const double size = a.size + b.size;
        return {a.value + b.value, size, a.radius + b.radius + rounding * size};
    }
    ARMANGLE_INLINE friend Rounded operator-(const Rounded& a, const Rounded& b) noexcept {
        const double size = a.size + b.size;
        return {a.value - b.value, size, a.radius + b.radius + rounding * size};
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
