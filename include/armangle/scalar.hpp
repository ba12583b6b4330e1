// The seam between formulas and numbers: what a scalar must offer to be used in them.
//
// Every formula of the library is written once, for a scalar T. T is double, a Lane of doubles (one pose per
// lane, lane.hpp) or an Interval (interval.hpp). A branch is a `select` on a mask, so that all lanes take it.
#pragma once

#include <cmath>
#include <limits>

#if defined(__FAST_MATH__)
#error "armangle needs IEEE arithmetic: compile without -ffast-math"
#endif

namespace armangle {

inline constexpr double pi = 3.14159265358979323846;
inline constexpr double two_pi = 2.0 * pi;
inline constexpr double half_pi = 0.5 * pi;
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

inline double sqrt(double x) noexcept { return std::sqrt(x); }
inline double abs(double x) noexcept { return std::fabs(x); }
inline double copysign(double magnitude, double sign) noexcept { return std::copysign(magnitude, sign); }
inline double select(bool mask, double yes, double no) noexcept { return mask ? yes : no; }
inline bool any(bool mask) noexcept { return mask; }
inline bool all(bool mask) noexcept { return mask; }

/// a b + c: one rounding where the machine has it in hardware, two elsewhere; the same for every scalar type.
inline double mul_add(double a, double b, double c) noexcept {
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    return __builtin_fma(a, b, c);
#else
    return a * b + c;
#endif
}

template <class T>
T min(T a, T b) noexcept { return select(b < a, b, a); }

template <class T>
T max(T a, T b) noexcept { return select(a < b, b, a); }

template <class T>
T hypot(T a, T b) noexcept { return sqrt(mul_add(a, a, b * b)); }

/// Nearest integer, for |x| < 2^51; ties to even.
template <class T>
T round(T x) noexcept {
    constexpr double shift = 6755399441055744.0;  // 1.5 * 2^52: adding it leaves no room for a fraction
    return (x + shift) - shift;
}

template <class T>
T floor(T x) noexcept {
    const T nearest = round(x);
    return nearest - select(x < nearest, T(1.0), T(0.0));
}

template <class T>
T ceil(T x) noexcept {
    const T nearest = round(x);
    return nearest + select(nearest < x, T(1.0), T(0.0));
}

}  // namespace armangle
