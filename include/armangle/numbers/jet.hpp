// Jet<T, K>: a scalar that holds the Taylor coefficients of a function of one variable up to order K.
//
// The library's formulas run on it unchanged. Jet<double, 3> gives q, q', q'', q''' along a path in closed
// form. Jet<Interval, 1> encloses values and slopes over a piece of the path.
#pragma once

#include <type_traits>

#include "angles.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Does nothing: coefficients of exact numbers tell nothing of each other. Scalars that bound (enclosure.hpp)
/// have their own function.
template <class T, int K>
ARMANGLE_INLINE void tighten(T (&)[K]) noexcept {}

/// coefficient[k] = f^(k) / k!
template <class T, int K>
struct Jet {
    T coefficient[K + 1];

    Jet() noexcept = default;
    Jet(double constant) noexcept { fill(T(constant)); }
    Jet(const T& constant) noexcept
        requires(!std::is_same_v<T, double>)
    {
        fill(constant);
    }

    /// The jet of the variable itself at x: value x and derivative 1.
    static Jet variable(const T& x) noexcept {
        Jet out(x);
        out.coefficient[1] = T(1.0);
        return out;
    }
    /// The value, without derivatives.
    const T& value() const noexcept { return coefficient[0]; }

    friend Jet operator+(const Jet& a, const Jet& b) noexcept {
        Jet out;
        for (int k = 0; k <= K; ++k) out.coefficient[k] = a.coefficient[k] + b.coefficient[k];
        tighten(out.coefficient);
        return out;
    }
    friend Jet operator-(const Jet& a, const Jet& b) noexcept {
        Jet out;
        for (int k = 0; k <= K; ++k) out.coefficient[k] = a.coefficient[k] - b.coefficient[k];
        tighten(out.coefficient);
        return out;
    }
    friend Jet operator-(const Jet& a) noexcept {
        Jet out;
        for (int k = 0; k <= K; ++k) out.coefficient[k] = -a.coefficient[k];
        return out;
    }
    friend Jet operator*(const Jet& a, const Jet& b) noexcept {
        Jet out;
        for (int k = 0; k <= K; ++k) {
            out.coefficient[k] = a.coefficient[0] * b.coefficient[k];
            for (int i = 1; i <= k; ++i)
                out.coefficient[k] = out.coefficient[k] + a.coefficient[i] * b.coefficient[k - i];
        }
        tighten(out.coefficient);
        return out;
    }
    friend Jet operator/(const Jet& a, const Jet& b) noexcept {
        Jet out;
        for (int k = 0; k <= K; ++k) {
            T rest = a.coefficient[k];
            for (int i = 1; i <= k; ++i) rest = rest - b.coefficient[i] * out.coefficient[k - i];
            out.coefficient[k] = rest / b.coefficient[0];
        }
        tighten(out.coefficient);
        return out;
    }

    /// Comparisons compare the values alone; they return what comparisons of T do.
    friend auto operator<(const Jet& a, const Jet& b) noexcept { return a.value() < b.value(); }
    friend auto operator>(const Jet& a, const Jet& b) noexcept { return a.value() > b.value(); }
    friend auto operator<=(const Jet& a, const Jet& b) noexcept { return a.value() <= b.value(); }
    friend auto operator>=(const Jet& a, const Jet& b) noexcept { return a.value() >= b.value(); }
    friend auto operator==(const Jet& a, const Jet& b) noexcept { return a.value() == b.value(); }

private:
    /// Sets a constant: all derivatives are 0.
    void fill(const T& constant) noexcept {
        coefficient[0] = constant;
        for (int k = 1; k <= K; ++k) coefficient[k] = T(0.0);
    }
};

/// In each lane the series `yes` if the mask is set, else `no`.
template <class M, class T, int K>
Jet<T, K> select(const M& mask, const Jet<T, K>& yes, const Jet<T, K>& no) noexcept {
    Jet<T, K> out;
    for (int k = 0; k <= K; ++k) out.coefficient[k] = select(mask, yes.coefficient[k], no.coefficient[k]);
    return out;
}

/// The series a b + c.
template <class T, int K>
Jet<T, K> mul_add(const Jet<T, K>& a, const Jet<T, K>& b, const Jet<T, K>& c) noexcept {
    return a * b + c;
}

/// The absolute value of a series by the sign of its value; at 0 that of the positive side.
template <class T, int K>
Jet<T, K> abs(const Jet<T, K>& a) noexcept {
    return select(a < Jet<T, K>(0.0), -a, a);
}

/// The series with the lesser value. For intervals the value is exact even if it is undecided which one is
/// less.
template <class T, int K>
Jet<T, K> min(const Jet<T, K>& a, const Jet<T, K>& b) noexcept {
    Jet<T, K> out = select(a < b, a, b);
    out.coefficient[0] = min(a.coefficient[0], b.coefficient[0]);
    return out;
}
/// The series with the larger value.
template <class T, int K>
Jet<T, K> max(const Jet<T, K>& a, const Jet<T, K>& b) noexcept {
    return -min(-a, -b);
}

/// Wraps the value to (-pi, pi]; the derivatives are unchanged.
template <class T, int K>
Jet<T, K> wrap(Jet<T, K> a) noexcept {
    a.coefficient[0] = wrap(a.coefficient[0]);
    return a;
}

/// The square root of a series; NaN if its value is negative, and without finite derivatives if it is 0.
template <class T, int K>
Jet<T, K> sqrt(const Jet<T, K>& a) noexcept {
    Jet<T, K> out;
    out.coefficient[0] = sqrt(a.coefficient[0]);
    const T twice = out.coefficient[0] + out.coefficient[0];
    for (int k = 1; k <= K; ++k) {
        T rest = a.coefficient[k];
        for (int i = 1; i < k; ++i) rest = rest - out.coefficient[i] * out.coefficient[k - i];
        out.coefficient[k] = rest / twice;
    }
    tighten(out.coefficient);
    return out;
}

/// The sine and cosine of a series, from s' = c a' and c' = -s a'.
template <class T, int K>
SinCos<Jet<T, K>> sin_cos(const Jet<T, K>& a) noexcept {
    SinCos<Jet<T, K>> out;
    const SinCos<T> now = sin_cos(a.coefficient[0]);
    out.sin.coefficient[0] = now.sin;
    out.cos.coefficient[0] = now.cos;
    for (int k = 1; k <= K; ++k) {  // s' = c a', c' = -s a'
        T s(0.0), c(0.0);
        for (int i = 1; i <= k; ++i) {
            const T slope = T(static_cast<double>(i)) * a.coefficient[i];
            s = s + slope * out.cos.coefficient[k - i];
            c = c - slope * out.sin.coefficient[k - i];
        }
        out.sin.coefficient[k] = s / T(static_cast<double>(k));
        out.cos.coefficient[k] = c / T(static_cast<double>(k));
    }
    tighten(out.sin.coefficient);
    tighten(out.cos.coefficient);
    return out;
}

/// The angle of the direction (x, y), from its derivative (x y' - y x') / (x^2 + y^2).
template <class T, int K>
Jet<T, K> atan2(const Jet<T, K>& y, const Jet<T, K>& x) noexcept {
    Jet<T, K> out;
    out.coefficient[0] = atan2(y.coefficient[0], x.coefficient[0]);
    const Jet<T, K> size = x * x + y * y;
    T turn[K + 1];
    for (int k = 0; k < K; ++k) {
        turn[k] = T(0.0);
        for (int i = 0; i <= k; ++i)
            turn[k] =
                turn[k] + T(static_cast<double>(k - i + 1)) * (x.coefficient[i] * y.coefficient[k - i + 1] -
                                                               y.coefficient[i] * x.coefficient[k - i + 1]);
        for (int i = 1; i <= k; ++i) turn[k] = turn[k] - size.coefficient[i] * turn[k - i];
        turn[k] = turn[k] / size.coefficient[0];
        out.coefficient[k + 1] = turn[k] / T(static_cast<double>(k + 1));
    }
    tighten(out.coefficient);
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
