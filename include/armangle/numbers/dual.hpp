// Dual: a scalar that holds a value and its partial derivatives by eight variables.
//
// The library's formulas run on it unchanged: (a, a') (b, b') = (a b, a' b + a b'), and so on. One pass gives
// all partial derivatives of a result, exact to rounding.
#pragma once

#include "angles.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A value and its partials by eight variables.
struct Dual {
    static constexpr int variables = 8;
    using Partials = Lane<variables>;

    double value;
    Partials partial;

    Dual() noexcept = default;
    /// A constant: all derivatives are 0.
    ARMANGLE_INLINE Dual(double constant) noexcept : value(constant), partial(0.0) {}
    /// A value with its derivatives.
    ARMANGLE_INLINE Dual(double v, const Partials& p) noexcept : value(v), partial(p) {}

    ARMANGLE_INLINE friend Dual operator+(const Dual& a, const Dual& b) noexcept {
        return {a.value + b.value, a.partial + b.partial};
    }
    ARMANGLE_INLINE friend Dual operator-(const Dual& a, const Dual& b) noexcept {
        return {a.value - b.value, a.partial - b.partial};
    }
    ARMANGLE_INLINE friend Dual operator-(const Dual& a) noexcept { return {-a.value, -a.partial}; }
    ARMANGLE_INLINE friend Dual operator*(const Dual& a, const Dual& b) noexcept {
        return {a.value * b.value, mul_add(a.partial, Partials(b.value), b.partial * Partials(a.value))};
    }
    ARMANGLE_INLINE friend Dual operator/(const Dual& a, const Dual& b) noexcept {
        const double quotient = a.value / b.value;
        return {quotient, (a.partial - b.partial * Partials(quotient)) * Partials(1.0 / b.value)};
    }

    /// Comparisons compare the values alone.
    friend bool operator<(const Dual& a, const Dual& b) noexcept { return a.value < b.value; }
    friend bool operator>(const Dual& a, const Dual& b) noexcept { return a.value > b.value; }
    friend bool operator<=(const Dual& a, const Dual& b) noexcept { return a.value <= b.value; }
    friend bool operator>=(const Dual& a, const Dual& b) noexcept { return a.value >= b.value; }
    friend bool operator==(const Dual& a, const Dual& b) noexcept { return a.value == b.value; }
};

/// `yes` if mask, otherwise `no`.
ARMANGLE_INLINE Dual select(bool mask, const Dual& yes, const Dual& no) noexcept { return mask ? yes : no; }

/// a b + c.
ARMANGLE_INLINE Dual mul_add(const Dual& a, const Dual& b, const Dual& c) noexcept { return a * b + c; }

/// The absolute value; at 0 the derivative of the positive side.
ARMANGLE_INLINE Dual abs(const Dual& a) noexcept { return a.value < 0 ? -a : a; }

/// The square root; its derivatives are not finite at value 0.
ARMANGLE_INLINE Dual sqrt(const Dual& a) noexcept {
    const double root = sqrt(a.value);
    return {root, a.partial * Dual::Partials(0.5 / root)};
}

/// Sine and cosine of an angle (rad), with derivatives.
ARMANGLE_INLINE SinCos<Dual> sin_cos(const Dual& a) noexcept {
    const SinCos<double> now = sin_cos(a.value);
    return {{now.sin, a.partial * Dual::Partials(now.cos)}, {now.cos, a.partial * Dual::Partials(-now.sin)}};
}

/// The angle of the direction (x, y); its derivative is (x y' - y x') / (x^2 + y^2).
ARMANGLE_INLINE Dual atan2(const Dual& y, const Dual& x) noexcept {
    const double size = mul_add(x.value, x.value, y.value * y.value);
    const Dual::Partials turn = y.partial * Dual::Partials(x.value) - x.partial * Dual::Partials(y.value);
    return {atan2(y.value, x.value), turn * Dual::Partials(1.0 / size)};
}

}  // namespace armangle

#include "../names/end.hpp"
