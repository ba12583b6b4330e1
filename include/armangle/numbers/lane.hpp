// Lane<N>: N doubles that take every operation together, in the compiler's own vector types.
//
// Each lane performs the same IEEE operation as a double. A lane's result therefore does not depend on its
// neighbours and equals the result of the scalar formula bit for bit (compiled without contraction).
#pragma once

#include <bit>

#if defined(__CUDACC__)
#include "device/lane.hpp"
#else
#include "registers.hpp"
#endif

#include "../names/begin.hpp"

namespace armangle {

#if !defined(__CUDACC__)
template <int N>
struct Lane;

/// N Boolean values, one per lane.
template <int N>
struct LaneMask {
    static constexpr int width = N < register_width ? N : register_width, registers = N / width;
    typename detail::Vector<width>::Mask part[registers];

    bool operator[](int i) const noexcept { return part[i / width][i % width] != 0; }
};

/// N doubles as one scalar.
template <int N>
struct Lane {
    static constexpr int width = LaneMask<N>::width, registers = LaneMask<N>::registers;
    static_assert(N % width == 0 && N >= 2, "a Lane is a whole number of registers");
    using Values = typename detail::Vector<width>::Values;
    using Mask = typename detail::Vector<width>::Mask;
    Values part[registers];

    Lane() noexcept = default;
    /// All lanes x.
    ARMANGLE_INLINE Lane(double x) noexcept {
        for (auto& r : part) r = x - Values{};
    }

    double operator[](int i) const noexcept { return part[i / width][i % width]; }
    /// Sets lane i to x.
    void set(int i, double x) noexcept { part[i / width][i % width] = x; }

    /// Reads the lanes from N consecutive numbers.
    static Lane load(const double* from) noexcept {
        Lane out;
        __builtin_memcpy(out.part, from, sizeof(out.part));
        return out;
    }
    /// Builds a lane from values that were just computed one by one.
    ARMANGLE_INLINE static Lane of(const double (&values)[N]) noexcept {
        Lane out;
        for (int i = 0; i < registers; ++i) out.part[i] = detail::assemble<width>(values + i * width);
        return out;
    }
    /// Writes the lanes to N consecutive numbers.
    void store(double* to) const noexcept { __builtin_memcpy(to, part, sizeof(part)); }

    // One macro instead of twenty written bodies: every operator applies the same operator to each register.
#define ARMANGLE_LANE_ARITHMETIC(op)                                                 \
    ARMANGLE_INLINE friend Lane operator op(const Lane& a, const Lane& b) noexcept { \
        Lane out;                                                                    \
        for (int i = 0; i < registers; ++i) out.part[i] = a.part[i] op b.part[i];    \
        return out;                                                                  \
    }
    ARMANGLE_LANE_ARITHMETIC(+)
    ARMANGLE_LANE_ARITHMETIC(-)
    ARMANGLE_LANE_ARITHMETIC(*)
    ARMANGLE_LANE_ARITHMETIC(/)
#undef ARMANGLE_LANE_ARITHMETIC

#define ARMANGLE_LANE_COMPARISON(op)                                                        \
    ARMANGLE_INLINE friend LaneMask<N> operator op(const Lane& a, const Lane& b) noexcept { \
        LaneMask<N> out;                                                                    \
        for (int i = 0; i < registers; ++i) out.part[i] = a.part[i] op b.part[i];           \
        return out;                                                                         \
    }
    ARMANGLE_LANE_COMPARISON(<)
    ARMANGLE_LANE_COMPARISON(>)
    ARMANGLE_LANE_COMPARISON(<=)
    ARMANGLE_LANE_COMPARISON(>=)
    ARMANGLE_LANE_COMPARISON(==)
#undef ARMANGLE_LANE_COMPARISON

    ARMANGLE_INLINE friend Lane operator-(const Lane& a) noexcept {
        Lane out;
        for (int i = 0; i < registers; ++i) out.part[i] = -a.part[i];
        return out;
    }
};

template <int N>
ARMANGLE_INLINE LaneMask<N> operator&(const LaneMask<N>& a, const LaneMask<N>& b) noexcept {
    LaneMask<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = a.part[i] & b.part[i];
    return out;
}

template <int N>
ARMANGLE_INLINE LaneMask<N> operator|(const LaneMask<N>& a, const LaneMask<N>& b) noexcept {
    LaneMask<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = a.part[i] | b.part[i];
    return out;
}

template <int N>
ARMANGLE_INLINE LaneMask<N> operator!(const LaneMask<N>& a) noexcept {
    LaneMask<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = ~a.part[i];
    return out;
}

/// The eight numbers x0, x1, x2, x3, x0, x1, x2, x3.
ARMANGLE_INLINE Lane<8> twice(const double (&x)[4]) noexcept {
    Lane<8> out;
#if defined(__AVX512F__)
    const detail::Values4 four = detail::assemble<4>(x);
    out.part[0] = __builtin_shufflevector(four, four, 0, 1, 2, 3, 0, 1, 2, 3);
#else
    constexpr int half = Lane<8>::registers / 2;
    for (int i = 0; i < half; ++i)
        out.part[i] = out.part[half + i] = detail::assemble<Lane<8>::width>(x + i * Lane<8>::width);
#endif
    return out;
}

/// The lanes of x in the order x4, x5, x6, x7, x0, x1, x2, x3.
ARMANGLE_INLINE Lane<8> swap_halves(const Lane<8>& x) noexcept {
    Lane<8> out;
#if defined(__AVX512F__)
    out.part[0] = __builtin_shufflevector(x.part[0], x.part[0], 4, 5, 6, 7, 0, 1, 2, 3);
#else
    constexpr int half = Lane<8>::registers / 2;
    for (int i = 0; i < half; ++i) {
        out.part[i] = x.part[half + i];
        out.part[half + i] = x.part[i];
    }
#endif
    return out;
}

/// The first four lanes of x, then the first four of y.
ARMANGLE_INLINE Lane<8> first_halves(const Lane<8>& x, const Lane<8>& y) noexcept {
    Lane<8> out;
#if defined(__AVX512F__)
    out.part[0] = __builtin_shufflevector(x.part[0], y.part[0], 0, 1, 2, 3, 8, 9, 10, 11);
#else
    constexpr int half = Lane<8>::registers / 2;
    for (int i = 0; i < half; ++i) {
        out.part[i] = x.part[i];
        out.part[half + i] = y.part[i];
    }
#endif
    return out;
}

/// The mask as bits: bit i is lane i.
template <int N>
ARMANGLE_INLINE unsigned bits(const LaneMask<N>& mask) noexcept {
    unsigned out = 0;
    for (int i = 0; i < mask.registers; ++i) out |= detail::register_bits(mask.part[i]) << (i * mask.width);
    return out;
}

/// For each lane, the value that the mask selects.
template <int N>
ARMANGLE_INLINE Lane<N> select(const LaneMask<N>& mask, const Lane<N>& yes, const Lane<N>& no) noexcept {
    Lane<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = mask.part[i] ? yes.part[i] : no.part[i];
    return out;
}

/// The square root of each lane.
template <int N>
ARMANGLE_INLINE Lane<N> sqrt(const Lane<N>& x) noexcept {
    Lane<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = detail::register_sqrt(x.part[i]);
    return out;
}

/// a b + c, rounded like mul_add of doubles.
template <int N>
ARMANGLE_INLINE Lane<N> mul_add(const Lane<N>& a, const Lane<N>& b, const Lane<N>& c) noexcept {
    Lane<N> out;
    for (int i = 0; i < out.registers; ++i)
        out.part[i] = detail::register_mul_add(a.part[i], b.part[i], c.part[i]);
    return out;
}

/// The absolute value of each lane.
template <int N>
ARMANGLE_INLINE Lane<N> abs(const Lane<N>& x) noexcept {
    using Values = typename Lane<N>::Values;
    using Mask = typename Lane<N>::Mask;
    Lane<N> out;
    for (int i = 0; i < out.registers; ++i)
        out.part[i] = reinterpret_cast<Values>(reinterpret_cast<Mask>(x.part[i]) & INT64_MAX);
    return out;
}

/// In each lane, the magnitude of one number with the sign of the other.
template <int N>
ARMANGLE_INLINE Lane<N> copysign(const Lane<N>& magnitude, const Lane<N>& sign_of) noexcept {
    using Values = typename Lane<N>::Values;
    using Mask = typename Lane<N>::Mask;
    Lane<N> out;
    for (int i = 0; i < out.registers; ++i)
        out.part[i] = reinterpret_cast<Values>((reinterpret_cast<Mask>(magnitude.part[i]) & INT64_MAX) |
                                               (reinterpret_cast<Mask>(sign_of.part[i]) & INT64_MIN));
    return out;
}

#endif

/// Calls f(i) for each set bit i, in rising order. Compared with an array of bools and a plain loop, the arcs
/// of one branch take 12 % less time, of all eight 14 % (benchmarks/run_cpp.py, AVX-512).
template <class F>
ARMANGLE_INLINE void for_each_bit(unsigned mask, const F& f) noexcept {
    for (unsigned left = mask; left != 0; left &= left - 1) f(std::countr_zero(left));
}

/// Whether some lane is true.
template <int N>
ARMANGLE_INLINE bool any(const LaneMask<N>& mask) noexcept {
    return bits(mask) != 0;
}

/// Whether every lane is true.
template <int N>
ARMANGLE_INLINE bool all(const LaneMask<N>& mask) noexcept {
    return !any(!mask);
}

/// The smallest of eight values.
ARMANGLE_INLINE double least(const Lane<8>& x) noexcept {
    const Lane<8> four = min(x, swap_halves(x));
    const double a = four[0], b = four[1], c = four[2], d = four[3];
    return min(min(a, b), min(c, d));
}

}  // namespace armangle

#include "../names/end.hpp"
