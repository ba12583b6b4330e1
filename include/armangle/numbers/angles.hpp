// atan2, sine and cosine for every scalar type. The polynomials are short, and a lane and a double give the
// same bits.
//
// The coefficients are Chebyshev fits computed in 60-digit arithmetic, with the truncation errors stated.
#pragma once

#include "lane.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Wraps x to (-pi, pi].
template <class T>
ARMANGLE_INLINE T wrap(T x) noexcept {
    const T y = x - two_pi * round(x * (1.0 / two_pi));
    return select(y <= T(-pi), y + two_pi, y);
}

/// The angle x + 2 pi k nearest to `near`.
template <class T>
ARMANGLE_INLINE T lift(T x, T near) noexcept {
    return x + two_pi * round((near - x) * (1.0 / two_pi));
}

namespace detail {

/// Evaluates `count` terms c[first] + c[first + 1] x + ... of a polynomial, where powers[k] = x^(2^k). The
/// sum is split into halves, so the longest chain of dependent operations is the logarithm of the degree.
template <int first, int count, class T, int K, int P>
ARMANGLE_INLINE T halved(const double (&c)[K], const T (&powers)[P]) noexcept {
    if constexpr (count == 1) {
        return T(c[first]);
    } else if constexpr (count == 2) {
        return mul_add(powers[0], T(c[first + 1]), T(c[first]));
    } else {
        constexpr int power = 1 + (count > 4) + (count > 8), low = 1 << power;
        return mul_add(halved<first + low, count - low>(c, powers), powers[power],
                       halved<first, low>(c, powers));
    }
}

/// The value of the polynomial c[0] + c[1] x + ... at x, with at most 16 terms.
template <class T, int K>
ARMANGLE_INLINE T polynomial(const double (&c)[K], T x) noexcept {
    const T x2 = x * x, x4 = x2 * x2;
    const T powers[] = {x, x2, x4, x4 * x4};
    return halved<0, K>(c, powers);
}

inline constexpr double tan_eighth_pi = 0.41421356237309503;
inline constexpr double pi_tail = 1.2246467991473532e-16;  // pi - double(pi)
// pi/2 in three pieces. The first two have 33 bits, so k * piece is exact for |k| <= 2^20.
inline constexpr double half_pi_1 = 1.5707963267341256;
inline constexpr double half_pi_2 = 6.077100506303966e-11;
inline constexpr double half_pi_3 = 2.0222662487959506e-21;

}  // namespace detail

/// The angle (rad) of the direction (x, y), in [-pi, pi]; 0 for (0, 0).
template <class T>
ARMANGLE_INLINE T atan2(T y, T x) noexcept {
    const T ax = abs(x), ay = abs(y);
    const auto steep = ax < ay;
    const T near = select(steep, ay, ax), far = select(steep, ax, ay);
    const auto big = near * detail::tan_eighth_pi < far;
    const T num = select(big, far - near, far);
    const T den = select(big, far + near, near);
    const T t = num / select(den == T(0.0), T(1.0), den);
    const T z = t * t;
    // atan(t) = t + t z P(z), z = t^2, |t| <= tan(pi/8); truncation below 6e-18
    constexpr double terms[] = {-0.3333333333333333,  0.1999999999999552,   -0.14285714284666542,
                                0.11111111015256361,  -0.09090904578123903, 0.07692183190826087,
                                -0.06664511447381948, 0.0585814891280221,   -0.0508544973794026,
                                0.03923165829558719,  -0.01917688711906226};
    T angle = mul_add(t * z, detail::polynomial(terms, z), t);
    angle = select(big, angle + (0.25 * detail::pi_tail) + 0.25 * pi, angle);
    angle = select(steep, half_pi - (angle - 0.5 * detail::pi_tail), angle);
    angle = select(x < T(0.0), pi - (angle - detail::pi_tail), angle);
    return copysign(angle, y);
}

/// The angle (rad) of the direction (x, y), in [-pi, pi]; 0 for (0, 0). Evaluated as one lane: for doubles a
/// `select` compiles to a branch, and the octant is unpredictable.
ARMANGLE_INLINE double atan2(double y, double x) noexcept {
#if defined(__CUDA_ARCH__)
    return atan2<double>(y, x);
#else
    return atan2(Lane<2>(y), Lane<2>(x))[0];
#endif
}

/// Sine and cosine of an angle, or any pair that is used like them.
template <class T>
struct SinCos {
    T sin, cos;
};

/// Sine and cosine of any finite x; absolute error below 1e-15 for |x| <= 1e6.
template <class T>
ARMANGLE_INLINE SinCos<T> sin_cos(T x) noexcept {
    const T k = round(x * (2.0 / pi));
    const T r = mul_add(k, T(-detail::half_pi_3),
                        mul_add(k, T(-detail::half_pi_2), mul_add(k, T(-detail::half_pi_1), x)));
    const T z = r * r;
    // sin(x) = x + x z S(z), cos(x) = 1 - z/2 + z^2 C(z), z = x^2, |x| <= pi/4; truncation below 2e-17
    constexpr double sine_terms[] = {-0.16666666666666666,  0.008333333333330827,    -0.0001984126983657571,
                                     2.755731600817155e-06, -2.5051112272573243e-08, 1.5916726193889336e-10};
    constexpr double cosine_terms[] = {0.041666666666666664,   -0.0013888888888887322,
                                       2.4801587298651292e-05, -2.755731721268659e-07,
                                       2.0876134024090145e-09, -1.1381754653662937e-11};
    const T s = mul_add(r * z, detail::polynomial(sine_terms, z), r);
    const T c = mul_add(z * z, detail::polynomial(cosine_terms, z), mul_add(z, T(-0.5), T(1.0)));
    const T quadrant = k - 4.0 * round(k * 0.25);  // -2, -1, 0, 1 or 2
    const T side = abs(quadrant);
    const auto swapped = side == T(1.0);
    const auto behind = side == T(2.0);
    const T sine = select(swapped, c, s), cosine = select(swapped, s, c);
    return {select((quadrant < T(0.0)) | behind, -sine, sine),
            select((quadrant == T(1.0)) | behind, -cosine, cosine)};
}

/// Sine and cosine of x (rad), evaluated as one lane, like atan2.
ARMANGLE_INLINE SinCos<double> sin_cos(double x) noexcept {
#if defined(__CUDA_ARCH__)
    return sin_cos<double>(x);
#else
    const SinCos<Lane<2> > both = sin_cos(Lane<2>(x));
    return {both.sin[0], both.cos[0]};
#endif
}

}  // namespace armangle

#include "../names/end.hpp"
