// The interface between formulas and numbers: the operations that a scalar type must offer.
//
// Every formula is written once, for a scalar T: double, a Lane of doubles (one pose per lane, lane.hpp) or
// an Interval (interval.hpp). A case distinction is a `select` on a mask, so all lanes run the same code.
#pragma once

#include <cmath>
#include <limits>

#if defined(__FAST_MATH__)
#error "armangle needs IEEE arithmetic: compile without -ffast-math"
#endif

// Inlines small functions: they run millions of times a second, and a call would cost more than their body.
#if defined(__CUDACC__)
#define ARMANGLE_INLINE __host__ __device__ inline
#elif defined(__GNUC__) && !defined(ARMANGLE_SMALL)
#define ARMANGLE_INLINE [[gnu::always_inline]] inline
#else
#define ARMANGLE_INLINE inline
#endif

// Keeps a rarely used function out of line.
#if defined(__CUDACC__)
#define ARMANGLE_SELDOM __host__ __device__
#else
#define ARMANGLE_SELDOM [[gnu::noinline, gnu::cold]]
#endif

#include "../names/begin.hpp"

namespace armangle {

inline constexpr double pi = 3.14159265358979323846;
inline constexpr double two_pi = 2.0 * pi;
inline constexpr double half_pi = 0.5 * pi;
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// The square root. This and the next functions are the operations of each scalar type, here for double:
/// roots, absolute values, signs, and one of two values by a mask, which can be tested for any and for all
/// lanes.
ARMANGLE_INLINE double sqrt(double x) noexcept { return std::sqrt(x); }
ARMANGLE_INLINE double abs(double x) noexcept { return std::fabs(x); }
ARMANGLE_INLINE double copysign(double magnitude, double sign) noexcept {
    return std::copysign(magnitude, sign);
}
/// `yes` if mask, otherwise `no`.
ARMANGLE_INLINE double select(bool mask, double yes, double no) noexcept { return mask ? yes : no; }
/// Whether a condition holds in any lane; a number has one.
ARMANGLE_INLINE bool any(bool mask) noexcept { return mask; }
/// Whether a condition holds in all lanes; a number has one.
ARMANGLE_INLINE bool all(bool mask) noexcept { return mask; }

/// a b + c, for every scalar type: one rounding if the hardware has a fused operation, otherwise two.
ARMANGLE_INLINE double mul_add(double a, double b, double c) noexcept {
#if defined(__CUDA_ARCH__)
    return std::fma(a, b, c);
#elif defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    return __builtin_fma(a, b, c);
#else
    return a * b + c;
#endif
}

/// Mask of NaN values: only NaN differs from itself.
template <class T>
ARMANGLE_INLINE auto is_nan(const T& x) noexcept {
    return !(x == x);
}

/// The lesser of two values; a if neither is less, as with a NaN.
template <class T>
ARMANGLE_INLINE T min(T a, T b) noexcept {
    return select(b < a, b, a);
}

/// The greater of two values; a if neither is greater, as with a NaN.
template <class T>
ARMANGLE_INLINE T max(T a, T b) noexcept {
    return select(a < b, b, a);
}

/// sqrt(a^2 + b^2), without protection against overflow.
template <class T>
ARMANGLE_INLINE T hypot(T a, T b) noexcept {
    return sqrt(mul_add(a, a, b * b));
}

/// Nearest integer, for |x| < 2^51; ties to even.
template <class T>
ARMANGLE_INLINE T round(T x) noexcept {
    constexpr double shift = 6755399441055744.0;  // 1.5 * 2^52: the sum has no bits left for a fraction
    return (x + shift) - shift;
}

/// The largest whole number that is not above x.
template <class T>
ARMANGLE_INLINE T floor(T x) noexcept {
    const T nearest = round(x);
    return nearest - select(x < nearest, T(1.0), T(0.0));
}

/// The smallest whole number that is not below x.
template <class T>
ARMANGLE_INLINE T ceil(T x) noexcept {
    const T nearest = round(x);
    return nearest + select(nearest < x, T(1.0), T(0.0));
}

}  // namespace armangle

#include "../names/end.hpp"
